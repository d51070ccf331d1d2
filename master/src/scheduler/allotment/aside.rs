//! ASIDE: which jobs are stored so that the one with the reservation begins as it was told.

use std::cmp::Reverse;

use super::{Claim, Row, Table, turns::in_order};

impl Table<'_> {
    /// Has jobs stored that came after the one that waits in `row`, if they alone keep it from beginning: they took longer than was
    /// expected, or those before it ended sooner. They wait behind it and lose nothing. Gives when it can begin (s): without them, and without jobs
    /// that end soon in any case.
    pub(super) fn set_aside(&mut self, row: usize) -> Option<f64> {
        if !self.is_settled() {
            return None;
        }
        let lacks = (self.pinned() + self.rows[row].needs).saturating_sub(self.workers.len());
        let end_soon = self.rows.iter().filter(|other| other.is_in && other.ends_soon());
        let begins = end_soon.clone().filter_map(|other| other.claim.left_s).fold(0.0, f64::max);
        let mut freed: usize = end_soon.map(Row::floor).sum();
        let mut stores = Vec::new();
        for other in self.behind(row) {
            if freed < lacks && !self.rows[other].ends_soon() {
                freed += self.rows[other].floor();
                stores.push(self.rows[other].claim.job);
            }
        }
        if freed < lacks {
            return None;
        }
        self.done.stores = stores;
        Some(begins)
    }

    /// Jobs that run and would have to wait behind the one in `row` if they did not, the last come first.
    pub(super) fn behind(&self, row: usize) -> Vec<usize> {
        let waits = self.rows[row].claim;
        let later = |&other: &usize| self.rows[other].claim.runs && self.rows[other].claim.job > waits.job;
        let mut later: Vec<usize> = (0..self.rows.len()).filter(later).collect();
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
        later.sort_by_key(|&other| Reverse(self.rows[other].claim.job));
        later
    }
}
