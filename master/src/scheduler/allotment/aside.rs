//! ASIDE: which jobs are stored so that the one with the reservation begins as it was told.

use super::{Claim, Table, in_order};

impl Table<'_> {
    /// Has jobs stored that came after the one that waits in `row`, if they alone keep it from beginning: they took longer than was
    /// expected, or those before it ended sooner. They wait behind it and lose nothing. True if it can begin without them, or without
    /// jobs that end soon in any case.
    pub(super) fn set_aside(&mut self, row: usize) -> bool {
        let lacks = (self.pinned() + self.rows[row].needs).saturating_sub(self.workers.len());
        let floors =
            |rows: &mut dyn Iterator<Item = usize>| -> usize { rows.map(|row| self.rows[row].floor()).sum() };
        let soon = floors(
            &mut (0..self.rows.len()).filter(|&other| self.rows[other].is_in && self.rows[other].ends_soon()),
        );
        if soon >= lacks {
            return true;
        }
        let lacks = lacks - soon;
        let mut behind = self.behind(row);
        behind.retain(|&other| !self.rows[other].ends_soon());
        if floors(&mut behind.iter().copied()) < lacks {
            return false;
        }
        let mut freed = 0;
        for other in behind {
            if freed < lacks {
                freed += self.rows[other].floor();
                self.done.stores.push(self.rows[other].claim.job);
            }
        }
        true
    }

    /// Jobs that run and would have to wait behind the one in `row` if they did not, the last come first.
    pub(super) fn behind(&self, row: usize) -> Vec<usize> {
        let waits = self.rows[row].claim;
        let later = |other: usize| {
            let claim = self.rows[other].claim;
            claim.runs && claim.job > waits.job
        };
        let mut later: Vec<usize> = (0..self.rows.len()).filter(|&other| later(other)).collect();
        // As if none of them had begun.
        let claims: Vec<Claim<'_>> = (0..self.rows.len())
            .map(|other| Claim {
                runs: self.rows[other].claim.runs && !later.contains(&other),
                ..self.rows[other].claim.clone()
            })
            .collect();
        let order: Vec<u32> = in_order(&claims).into_iter().map(|claim| claim.job).collect();
        let place = |job: u32| order.iter().position(|&other| other == job);
        later.retain(|&other| place(self.rows[other].claim.job) > place(waits.job));
        later.sort_by_key(|&other| std::cmp::Reverse(self.rows[other].claim.job));
        later
    }
}
