//! Cycles whose votes travel by a tree of the workers: they come as one from its root, and what workers send the master themselves can
//! overtake them.

use protocol::message::{BranchVote, ToMaster};

use super::{
    Job,
    error::{Breach, Error, Sent},
    numbers::not_a_number,
};
use crate::event::Action;

/// Cycles that a worker can be ahead of the last that is complete.
const POSITIONS_AHEAD: u64 = 4;
/// States and samples of a worker that can overtake its votes.
const EARLY: usize = 4;

impl Job {
    /// The votes of all workers have come from the root of their tree.
    pub(super) fn votes_arrived(
        &mut self,
        worker: usize,
        cycle: u64,
        votes: BranchVote,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        self.epoch.inflow.require_start(worker, cycle)?;
        if self.epoch.root != Some(worker) {
            return Err(Error::Worker(worker, Breach::NotTheRoot(cycle)));
        }
        let n_parts = self.problem.model.mesh.parts.len();
        if let Some(what) = not_a_number(votes.vote.as_deref(), &[], n_parts) {
            return self.blame(worker, cycle, &what, actions);
        }
        let sorts = &self.epoch.sorts;
        let gathers = sorts.gathers_at(cycle) && !sorts.are_by_workers();
        self.epoch.inflow.add_votes(worker, cycle, votes, gathers)?;
        self.complete_whole(actions)
    }

    /// Positions of a worker's surface nodes have come, where votes travel by a tree.
    pub(super) fn positions_arrived(
        &mut self,
        worker: usize,
        cycle: u64,
        positions: Vec<f64>,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        self.epoch.inflow.require_start(worker, cycle)?;
        let next = self.epoch.schedule.completed();
        match cycle.checked_sub(next) {
            // Of a gathering that was replaced before they came.
            None => Ok(()),
            Some(ahead)
                if self.epoch.root.is_some()
                    && !self.epoch.sorts.are_by_workers()
                    && ahead < POSITIONS_AHEAD =>
            {
                self.epoch.inflow.add_gathered(worker, cycle, positions)?;
                self.complete_whole(actions)
            }
            Some(_) => Err(Error::Worker(worker, Breach::Unasked(Sent::Positions, cycle))),
        }
    }

    /// Completes the cycles of which all has come from the tree, and takes the states and samples that came before.
    fn complete_whole(&mut self, actions: &mut Vec<Action>) -> Result<(), Error> {
        let epoch = self.epoch.number;
        while let Some((cycle, frames)) = self.epoch.inflow.next_whole() {
            self.complete(cycle, frames, actions)?;
            for (worker, message) in std::mem::take(&mut self.epoch.early) {
                // A sample may have ended the epoch.
                if self.epoch.number == epoch && !self.ending.over {
                    self.take((worker, self.epoch.at_work[worker]), message, actions)?;
                }
            }
        }
        Ok(())
    }

    /// Whether a message has overtaken votes that its sender sent before, which travel by the tree: states of a cycle come after the
    /// votes of the cycle before, samples after those of their own.
    pub(super) fn is_early(&self, message: &ToMaster) -> bool {
        let schedule = &self.epoch.schedule;
        let follows = match message {
            ToMaster::Pieces { cycle, .. } | ToMaster::WorkerState { cycle, .. } => *cycle,
            ToMaster::Sample { cycle, .. } if schedule.stops_at(*cycle) => *cycle,
            ToMaster::Sample { cycle, .. } => cycle.saturating_add(1),
            _ => return false,
        };
        self.epoch.root.is_some() && schedule.completed() < follows
    }

    /// Keeps a message that has overtaken votes until they have come.
    ///
    /// # Errors
    /// If there are more than can be.
    pub(super) fn hold(&mut self, worker: usize, message: ToMaster) -> Result<(), Error> {
        let is_of_state = |message: &ToMaster| matches!(message, ToMaster::Pieces { .. });
        let elements = |message: &ToMaster| match message {
            ToMaster::Pieces { pieces, .. } => pieces.iter().map(|piece| piece.elements.len() as u64).sum(),
            _ => 0,
        };
        let theirs = self.epoch.early.iter().filter(|(from, _)| *from == worker).map(|(_, held)| held);
        let others = theirs.clone().filter(|held| !is_of_state(held)).count();
        let held = theirs.map(elements).sum::<u64>() + elements(&message);
        if others >= EARLY || held > EARLY as u64 * self.epoch.shares.held[worker] {
            return Err(Error::Worker(worker, Breach::TooEarly(self.epoch.schedule.completed())));
        }
        self.epoch.early.push((worker, message));
        Ok(())
    }
}
