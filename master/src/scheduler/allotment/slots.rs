//! SLOTS: small jobs share a worker by its threads, and have them back when nobody else needs them.

use std::{cmp::Reverse, collections::BTreeMap};

use super::{HELPS, Stands, Table, USED_WELL, Worker};
use crate::footprint::{self, Bearer};

/// A worker that is to go on with so many threads; with none, which an idle one is told, another slot of its process has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Threads {
    pub worker: u32,
    pub computes: u32,
    /// Those that call as another worker.
    pub apart: u32,
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
    /// Of each job that runs on one worker and uses half of its threads at most: those that it can leave to others, the worker, and those that it uses.
    pub(super) fn spares(&self) -> impl Iterator<Item = (u32, usize, u32)> + '_ {
        self.rows.iter().filter_map(|row| {
            let &[index] = &row.has[..] else { return None };
            let (worker, uses) = (&self.workers[index], row.claim.threads(USED_WELL));
            let leaves = worker.divides && uses <= worker.threads / 2;
            if !leaves || row.n() > 1 || row.claim.elements == 0 || row.ends_soon() {
                return None;
            }
            let bearer = with(worker, uses).bearer;
            let goes_on = row.claim.lack([&bearer].into_iter()).is_none()
                && footprint::shortage(row.claim.elements, None, &[bearer]).is_none();
            goes_on.then_some((worker.threads - uses, index, uses))
        })
    }

    /// Has the job that can leave most threads leave them to whoever lacks a worker: they are due, and idle once they have called. False
    /// where there is none.
    pub(super) fn divide(&mut self) -> bool {
        let Some((apart, worker, computes)) = self.spares().max() else { return false };
        let whole = self.workers[worker];
        self.workers[worker] = with(&whole, computes);
        self.idle.push(self.workers.len());
        self.workers.push(Worker { stands: Stands::Due, ..with(&whole, apart) });
        self.done.threads.push(Threads { worker: whole.incarnation, computes, apart });
        true
    }

    /// Gives the threads of slots that nobody needs to a job that has one worker, on another slot of their process, if they make it faster; so do
    /// those that such a job would else have as a worker more. What a job has on several workers would have to be dealt out anew.
    pub(super) fn give_threads(&mut self) {
        if self.rows.iter().any(|row| !row.claim.runs) {
            return;
        }
        for row in 0..self.rows.len() {
            let &[worker] = &self.rows[row].has[..] else { continue };
            let whole = self.workers[worker];
            let is_beside = |other: &usize| {
                let other = &self.workers[*other];
                other.process == whole.process && other.divides && other.stands == Stands::Idle
            };
            let joins = self.rows[row].given.iter().copied().filter(is_beside);
            let helps = whole.threads < self.rows[row].claim.threads(HELPS);
            let idle = self.idle.iter().copied().filter(|other| helps && is_beside(other));
            let slots: Vec<usize> = joins.chain(idle).collect();
            if slots.is_empty() {
                continue;
            }
            self.idle.retain(|other| !slots.contains(other));
            self.rows[row].given.retain(|other| !slots.contains(other));
            let computes = whole.threads + slots.iter().map(|&slot| self.workers[slot].threads).sum::<u32>();
            self.workers[worker] = with(&whole, computes);
            let incarnations = slots.iter().map(|&slot| self.workers[slot].incarnation);
            self.done.threads.extend(incarnations.map(|worker| Threads { worker, computes: 0, apart: 0 }));
            self.done.threads.push(Threads { worker: whole.incarnation, computes, apart: 0 });
        }
    }
}
