//! The workers that were ever given to a job: who is still there, who wants to go, who failed by itself.
//!
//! A worker's *index* is the number at which it came. In an epoch it is named by its position in the epoch's workers.

use super::error::Error;
use crate::event::WorkerSpec;

/// Cycles that two workers' failures may lie apart and still be the same: one computes ahead of what the other has said.
const SAME_FAULT: u64 = 2;

struct Worker {
    /// As it came; its speed is the one that it is dealt work by.
    spec: WorkerSpec,
    /// Not lost.
    alive: bool,
    /// Why it goes, if it does.
    goes: Option<Goes>,
}

/// Why a worker goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goes {
    /// Its process is to end, or to step back: it goes as soon as all can stop at a cycle.
    Ends,
    /// Another job needs it: it goes at the next plan boundary.
    Needed,
}

/// All workers of a job, by index.
pub(super) struct Workers {
    all: Vec<Worker>,
    /// Those that failed by themselves: index and cycle.
    failed: Vec<(usize, u64)>,
}

impl Workers {
    /// Those that a job begins with.
    pub(super) fn new(specs: &[WorkerSpec]) -> Self {
        let mut workers = Self { all: Vec::new(), failed: Vec::new() };
        specs.iter().for_each(|spec| workers.join(spec.clone()));
        workers
    }

    /// How many there ever were.
    pub(super) fn n(&self) -> usize {
        self.all.len()
    }

    /// One has come.
    pub(super) fn join(&mut self, spec: WorkerSpec) {
        self.all.push(Worker { spec, alive: true, goes: None });
    }

    /// As it came.
    pub(super) fn spec(&self, index: usize) -> &WorkerSpec {
        &self.all[index].spec
    }

    pub(super) fn names(&self, at_work: &[usize]) -> Vec<String> {
        at_work.iter().map(|&index| self.all[index].spec.name.clone()).collect()
    }

    /// Indices of those that are alive: the workers of the next epoch.
    pub(super) fn alive(&self) -> Vec<usize> {
        (0..self.all.len()).filter(|&index| self.all[index].alive).collect()
    }

    /// Whether anybody is.
    pub(super) fn is_any_alive(&self) -> bool {
        self.all.iter().any(|worker| worker.alive)
    }

    /// One is gone; gives whether it was there.
    ///
    /// # Errors
    /// If there never was one of that index.
    pub(super) fn lose(&mut self, index: usize) -> Result<bool, Error> {
        let known = self.all.len();
        let lost = self.all.get_mut(index).ok_or(Error::Unknown { worker: index, known })?;
        Ok(std::mem::replace(&mut lost.alive, false))
    }

    /// One is to go. A process that is to end does, whoever needs it.
    pub(super) fn leave(&mut self, index: usize, why: Goes) {
        if let Some(worker) = self.all.get_mut(index)
            && worker.goes != Some(Goes::Ends)
        {
            worker.goes = Some(why);
        }
    }

    /// Whether somebody waits to be taken into the workers.
    pub(super) fn has_newcomers(&self, at_work: &[usize]) -> bool {
        self.all.iter().filter(|worker| worker.alive && worker.goes.is_none()).count()
            > at_work.iter().filter(|&&index| self.all[index].goes.is_none()).count()
    }

    /// Whether somebody of the workers is to go for this reason.
    pub(super) fn has_leavers(&self, at_work: &[usize], reason: Goes) -> bool {
        at_work.iter().any(|&index| self.all[index].goes == Some(reason))
    }

    /// Lets those of the workers go that are to; gives their indices, and why they go.
    pub(super) fn release(&mut self, at_work: &[usize]) -> Vec<(usize, Goes)> {
        let goes = |&index: &usize| self.all[index].goes.map(|why| (index, why));
        let released: Vec<(usize, Goes)> = at_work.iter().filter_map(goes).collect();
        released.iter().for_each(|&(index, _)| self.all[index].alive = false);
        released
    }

    /// Lets one go at once that is there and not at work; gives whether it went.
    pub(super) fn release_idle(&mut self, index: usize, at_work: &[usize]) -> bool {
        match self.all.get_mut(index) {
            Some(worker) if worker.alive && !at_work.contains(&index) => {
                worker.alive = false;
                true
            }
            _ => false,
        }
    }

    /// One has so many threads from now on.
    pub(super) fn set_threads(&mut self, index: usize, threads: u32) {
        if let Some(worker) = self.all.get_mut(index) {
            worker.spec.compute_with(threads);
        }
    }

    /// The workers is dealt work by other speeds from now on.
    pub(super) fn set_speeds(&mut self, at_work: &[usize], speeds: &[f64]) {
        for (&index, &speed) in at_work.iter().zip(speeds) {
            self.all[index].spec.speed = speed;
        }
    }

    /// One failed by itself at a cycle. If the same has happened to another at about the same cycle, or nobody else is left,
    /// it is the problem's fault.
    ///
    /// # Errors
    /// Then the reason, which ends the job.
    pub(super) fn fail(&mut self, index: usize, cycle: u64, reason: &str) -> Result<(), Error> {
        let worker = self.all[index].spec.name.clone();
        if let Some(&(first, at)) = self.failed.iter().find(|(_, at)| at.abs_diff(cycle) <= SAME_FAULT) {
            let first = self.all[first].spec.name.clone();
            return Err(Error::FailedAgain { worker, cycle, reason: reason.to_owned(), first, at });
        }
        if !self.all.iter().enumerate().any(|(other, worker)| other != index && worker.alive) {
            return Err(Error::Failed { worker, cycle, reason: reason.to_owned() });
        }
        self.failed.push((index, cycle));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three() -> Workers {
        let spec = |name: &str| WorkerSpec::new(name, 1.0, 1);
        Workers::new(&["a", "b", "c"].map(spec))
    }

    #[test]
    fn a_worker_is_lost_once_and_one_that_never_came_not_at_all() {
        let mut workers = three();
        assert_eq!(workers.lose(1), Ok(true));
        assert_eq!(workers.lose(1), Ok(false));
        assert_eq!(workers.lose(3), Err(Error::Unknown { worker: 3, known: 3 }));
        assert_eq!(workers.alive(), [0, 2]);
    }

    #[test]
    fn a_worker_with_twice_the_threads_is_dealt_twice_the_work() {
        let mut workers = three();
        workers.set_speeds(&[1], &[0.9]);
        workers.set_threads(1, 4);
        assert_eq!((workers.spec(1).speed, workers.spec(1).threads), (3.6, 4));
        workers.set_threads(1, 2);
        assert_eq!((workers.spec(1).speed, workers.spec(1).threads), (1.8, 2));
        workers.set_threads(7, 2);
        assert_eq!(workers.spec(0).threads, 1);
    }

    #[test]
    fn newcomers_are_those_beyond_the_workers_at_work_and_leavers_are_let_go_once() {
        let mut workers = three();
        assert!(!workers.has_newcomers(&[0, 1, 2]) && workers.has_newcomers(&[0, 1]));
        workers.leave(1, Goes::Needed);
        assert!(workers.has_leavers(&[0, 1, 2], Goes::Needed) && !workers.has_newcomers(&[0, 1, 2]));
        assert_eq!(workers.release(&[0, 1, 2]), [(1, Goes::Needed)]);
        assert_eq!(workers.alive(), [0, 2]);
        workers.leave(2, Goes::Ends);
        workers.leave(2, Goes::Needed);
        assert_eq!(workers.release(&[0, 2]), [(2, Goes::Ends)], "a process that ends goes to no other job");
        workers.leave(7, Goes::Needed);
        assert!(
            !workers.release_idle(0, &[0]) && workers.release_idle(0, &[]) && !workers.release_idle(7, &[])
        );
        assert_eq!(workers.alive(), [0_usize; 0]);
    }

    #[test]
    fn the_first_failure_is_the_workers_a_second_at_the_same_cycle_the_problems() {
        let mut workers = three();
        assert_eq!(workers.fail(0, 40, "NaN"), Ok(()));
        assert_eq!(workers.lose(0), Ok(true));
        assert_eq!(workers.fail(1, 50, "NaN"), Ok(()), "far from the first");
        let again = workers.fail(2, 42, "NaN").expect_err("near the first");
        assert_eq!(
            again.to_string(),
            "worker c, cycle 42: NaN; worker a failed at cycle 40 as well, so it is not the worker's fault"
        );
        let alone = Workers::new(&[WorkerSpec::new("a", 1.0, 1)]).fail(0, 3, "NaN");
        assert_eq!(alone.map_err(|e| e.to_string()), Err("worker a, cycle 3: NaN".to_owned()));
    }
}
