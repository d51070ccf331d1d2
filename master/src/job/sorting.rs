//! When a sort is due, who does it, and how its plan reaches the workers: the master sorts the positions that workers gather, or makes
//! plans of what they have sorted themselves.

use std::sync::Arc;

use mechanics::vote::Vote;
use protocol::message::{SortedPatch, ToWorker};

use super::{
    Job,
    error::{Breach, Error},
    sorts,
};
use crate::{
    event::Action,
    sort::{Gathered, Sorted, What},
};

impl Job {
    /// Whether positions travel at the start of cycle `cycle`, so that a sort acts a lag later.
    pub(super) fn sort_due(&self, cycle: u64, vote: Option<&Vote>) -> bool {
        let setup = &self.problem.model.setup;
        let Some(settings) = &setup.contact else { return false };
        let forced = self.options.asked.forces_sort(cycle);
        let completed = self.epoch.schedule.completed();
        let lag = u64::from(setup.control.sort_lag);
        self.epoch.sorts.is_due(cycle, completed, vote, (settings, lag, forced))
    }

    /// Asks for the sort of the positions that came with the frames of a cycle, if they were gathered for one.
    pub(super) fn begin_sort(
        &mut self,
        cycle: u64,
        gathered: &[Vec<f64>],
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        if self.epoch.sorts.are_by_workers() {
            return Ok(());
        }
        let Some(basis) = self.epoch.sorts.basis_for(&self.problem.model, cycle) else { return Ok(()) };
        for (worker, numbers) in gathered.iter().enumerate() {
            let (numbers, expected) = (numbers.len(), basis.sorter.n_gathered(worker));
            if numbers != expected {
                return Err(Error::Worker(worker, Breach::Gathered { numbers, expected }));
            }
        }
        let what = What::Positions(basis.sorter.positions(gathered));
        actions.push(Action::Sort(basis, Gathered { cycle, what }));
        Ok(())
    }

    /// A worker has sorted what it holds of the surface; asks for the plan once all have.
    ///
    /// # Errors
    /// If nobody asked for it, or it cannot be such.
    pub(super) fn patch_sorted(
        &mut self,
        worker: usize,
        gathered: u64,
        sorted: SortedPatch,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        self.epoch.inflow.require_start(worker, gathered)?;
        let n = self.epoch.n();
        let Some(patches) = self.epoch.sorts.add_patch((worker, n), gathered, sorted)? else { return Ok(()) };
        let Some(basis) = self.epoch.sorts.basis_for(&self.problem.model, gathered) else { return Ok(()) };
        actions.push(Action::Sort(basis, Gathered { cycle: gathered, what: What::Patches(patches) }));
        Ok(())
    }

    /// A sort is done: its plan goes to the workers and acts a lag after the gathering. One of an older epoch is of no
    /// use any more.
    pub(super) fn sorted(&mut self, sorted: Sorted, actions: &mut Vec<Action>) -> Result<(), Error> {
        if sorted.epoch < self.epoch.number {
            return Ok(());
        }
        for sorts::Done { gathered, acts_at, sorted } in self.epoch.sorts.done(sorted)? {
            let census = sorted.census;
            let exchange = Arc::new(sorted.exchange);
            self.epoch.send_all(actions, |worker| {
                let plan = Box::new(exchange.plans[worker].clone());
                let around = sorted.around.get(worker).cloned().unwrap_or_default();
                ToWorker::Plan { gathered_at: gathered, acts_at, plan, hash: exchange.hash, around }
            });
            self.epoch.sorts.act(gathered, acts_at, exchange, census);
            // A late sort: the cycles before its own are complete, and workers wait for the plan. It is in force from here,
            // as it would be had it come in time, so that the cycles of further sorts do not depend on how long this one took.
            let completed = self.epoch.schedule.completed();
            if acts_at <= completed {
                self.retire(completed - 1);
            }
        }
        Ok(())
    }
}
