//! SLOTS: small jobs share a worker by its threads, and have them back when nobody else needs them.

use std::{cmp::Reverse, collections::BTreeMap};

use super::{Claim, HELPS, Stands, Table, USED_WELL, Worker};
use crate::footprint::{self, Bearer};

/// A worker that is to go on with so many threads; with none, which an idle one is told, another slot of its process has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Threads {
    pub worker: u32,
    pub computes: u32,
    /// Those that call as another worker.
    pub apart: u32,
}

/// Threads of which each has at most so many elements of a job.
fn threads_of(claim: &Claim<'_>, elements: u64) -> u32 {
    u32::try_from(claim.elements.div_ceil(elements)).unwrap_or(u32::MAX).max(1)
}

/// The worker with so many of its threads, or of its process's.
fn with<'a>(worker: &Worker<'a>, threads: u32) -> Worker<'a> {
    let part = f64::from(threads) / f64::from(worker.threads.max(1));
    let bearer = Bearer {
        speed: worker.bearer.speed * part,
        memory: (worker.bearer.memory as f64 * part) as u64,
        ..worker.bearer
    };
    Worker { threads, bearer, ..*worker }
}

/// The workers, idle slots of one process as one, and what is to be done for that.
pub(super) fn united<'a>(workers: &[Worker<'a>]) -> (Vec<Worker<'a>>, Vec<Threads>) {
    let mut idle: BTreeMap<u64, Vec<&Worker<'a>>> = BTreeMap::new();
    for worker in workers.iter().filter(|worker| worker.divides && worker.stands == Stands::Idle) {
        idle.entry(worker.process).or_default().push(worker);
    }
    let (mut all, mut done) = (workers.to_vec(), Vec::new());
    for mut slots in idle.into_values().filter(|slots| slots.len() > 1) {
        let threads = slots.iter().map(|slot| slot.threads).sum();
        // The one that has the worker's own name, if it is there.
        slots.sort_by_key(|slot| Reverse((slot.bearer.name.len(), slot.bearer.name)));
        let Some(stays) = slots.pop() else { continue };
        all.retain(|worker| slots.iter().all(|slot| slot.incarnation != worker.incarnation));
        all.iter_mut()
            .filter(|worker| worker.incarnation == stays.incarnation)
            .for_each(|worker| *worker = with(stays, threads));
        done.extend(slots.iter().map(|slot| Threads { worker: slot.incarnation, computes: 0, apart: 0 }));
        done.push(Threads { worker: stays.incarnation, computes: threads, apart: 0 });
    }
    (all, done)
}

impl Table<'_> {
    /// Has a job that runs on one worker, and uses half of its threads at most, leave the others to whoever lacks a worker: they are due, and
    /// idle once they have called. False where there is none.
    pub(super) fn divide(&mut self) -> bool {
        let spare = |row: &usize| {
            let row = &self.rows[*row];
            let &[worker] = &row.has[..] else { return None };
            let (uses, threads) = (threads_of(row.claim, USED_WELL), self.workers[worker].threads);
            if row.n() > 1
                || row.claim.elements == 0
                || row.ends_soon()
                || uses > threads / 2
                || !self.workers[worker].divides
            {
                return None;
            }
            let bearer = with(&self.workers[worker], uses).bearer;
            let goes_on = row.claim.lack([&bearer].into_iter()).is_none()
                && footprint::shortage(row.claim.elements, None, &[bearer]).is_none();
            goes_on.then_some((threads - uses, worker, uses))
        };
        let Some((apart, worker, computes)) = (0..self.rows.len()).filter_map(|row| spare(&row)).max() else {
            return false;
        };
        let whole = self.workers[worker];
        self.workers[worker] = with(&whole, computes);
        self.idle.push(self.workers.len());
        self.workers.push(Worker { stands: Stands::Due, ..with(&whole, apart) });
        self.done.threads.push(Threads { worker: whole.incarnation, computes, apart });
        true
    }

    /// Gives the threads of slots that nobody needs to a job on another slot of their process, if they make it faster; so do those that
    /// such a job would else have as a worker more.
    pub(super) fn give_threads(&mut self) {
        if self.rows.iter().any(|row| !row.claim.runs) {
            return;
        }
        for row in 0..self.rows.len() {
            let Some(&worker) = self.rows[row].has.iter().find(|&&worker| self.workers[worker].divides)
            else {
                continue;
            };
            let whole = self.workers[worker];
            let is_beside = |other: &usize| {
                let other = &self.workers[*other];
                other.process == whole.process && other.divides && other.stands == Stands::Idle
            };
            let joins: Vec<usize> = self.rows[row].given.iter().copied().filter(is_beside).collect();
            let helps = whole.threads < threads_of(self.rows[row].claim, HELPS);
            let idle = self.idle.iter().copied().filter(|worker| helps && is_beside(worker));
            let slots: Vec<usize> = joins.into_iter().chain(idle).collect();
            if slots.is_empty() {
                continue;
            }
            self.idle.retain(|worker| !slots.contains(worker));
            self.rows[row].given.retain(|worker| !slots.contains(worker));
            let of_slots: u32 = slots.iter().map(|&slot| self.workers[slot].threads).sum();
            self.workers[worker] = with(&whole, whole.threads + of_slots);
            let incarnations = slots.iter().map(|&slot| self.workers[slot].incarnation);
            self.done.threads.extend(incarnations.map(|worker| Threads { worker, computes: 0, apart: 0 }));
            let computes = whole.threads + of_slots;
            self.done.threads.push(Threads { worker: whole.incarnation, computes, apart: 0 });
        }
    }
}
