//! Frames of cycles as they come from the workers of one epoch: what is whole once every worker has sent its own.

use std::{collections::BTreeMap, sync::Arc};

use mechanics::vote::Vote;
use protocol::message::BranchVote;

use super::error::{Breach, Error, Sent};
use crate::exchange::Exchange;

/// One worker's frame of a cycle.
pub(super) struct Frame {
    pub(super) vote: Option<Box<Vote>>,
    pub(super) partials: Vec<f64>,
    pub(super) gathered: Vec<f64>,
}

/// One cycle's frames: what has come from the workers.
pub(super) struct Frames {
    arrived: Vec<bool>,
    /// Of all that have come; none in the first cycle of an epoch.
    pub(super) vote: Option<Vote>,
    /// Sums of partial forces, on route master.
    pub(super) totals: Vec<f64>,
    /// By worker: gathered positions.
    pub(super) gathered: Vec<Vec<f64>>,
}

/// One cycle where votes come from the root of a tree: what has come.
#[derive(Default)]
struct OfTree {
    votes: Option<BranchVote>,
    /// Positions of all workers are part of it; known once the votes have come.
    gathers: bool,
    gathered: BTreeMap<usize, Vec<f64>>,
}

/// All frames of one epoch.
pub(super) struct Inflow {
    ready: Vec<bool>,
    running: bool,
    /// The vote of the cycle before the first.
    vote_before: Option<Vote>,
    cycles: BTreeMap<u64, Frames>,
    /// Those of a tree.
    of_tree: BTreeMap<u64, OfTree>,
    /// State of nodes that move between workers when a plan begins to act, by its cycle, then by worker.
    transfers: BTreeMap<u64, Vec<Option<Vec<f64>>>>,
}

/// Merges a worker's vote into those that have come.
pub(super) fn merge(all: &mut Option<Vote>, vote: Option<Box<Vote>>) {
    match (all, vote) {
        (Some(all), Some(vote)) => all.merge(&vote),
        (all @ None, Some(vote)) => *all = Some(*vote),
        (_, None) => {}
    }
}

impl Inflow {
    /// From so many workers.
    pub(super) fn new(n: usize, vote_before: Option<Vote>) -> Self {
        Self {
            ready: vec![false; n],
            running: false,
            vote_before,
            cycles: BTreeMap::new(),
            of_tree: BTreeMap::new(),
            transfers: BTreeMap::new(),
        }
    }

    /// The vote of the cycle before the first: that of the checkpoint, or of workers that are ready.
    pub(super) fn vote_before(&self) -> Option<&Vote> {
        self.vote_before.as_ref()
    }

    /// A worker is ready; gives whether all are, for the first time.
    ///
    /// # Errors
    /// If it was ready before.
    pub(super) fn ready(&mut self, worker: usize, vote: Option<Box<Vote>>) -> Result<bool, Error> {
        if self.running || std::mem::replace(&mut self.ready[worker], true) {
            return Err(Error::Worker(worker, Breach::ReadyTwice));
        }
        merge(&mut self.vote_before, vote);
        self.running = self.ready.iter().all(|ready| *ready);
        Ok(self.running)
    }

    /// Looks whether a frame can be one of its cycle.
    ///
    /// # Errors
    /// If not all are ready, or it has other numbers of partial forces than the plan.
    pub(super) fn check(
        &self,
        worker: usize,
        cycle: u64,
        frame: &Frame,
        exchange: &Exchange,
    ) -> Result<(), Error> {
        let (numbers, planned) = (frame.partials.len(), exchange.n_partials(worker));
        if numbers != planned {
            return Err(Error::Worker(worker, Breach::Partials { cycle, numbers, planned }));
        }
        Ok(())
    }

    /// # Errors
    /// If not all are ready.
    pub(super) fn require_start(&self, worker: usize, cycle: u64) -> Result<(), Error> {
        if self.running { Ok(()) } else { Err(Error::Worker(worker, Breach::BeforeStart(cycle))) }
    }

    /// Adds a frame; gives all of its cycle once they are here.
    ///
    /// # Errors
    /// If the worker sent one of that cycle before.
    pub(super) fn add(
        &mut self,
        worker: usize,
        cycle: u64,
        frame: Frame,
        exchange: &Exchange,
    ) -> Result<Option<Frames>, Error> {
        let n = self.ready.len();
        let frames = self.cycles.entry(cycle).or_insert_with(|| Frames {
            arrived: vec![false; n],
            vote: None,
            totals: exchange.totals(),
            gathered: vec![Vec::new(); n],
        });
        if std::mem::replace(&mut frames.arrived[worker], true) {
            return Err(Error::Worker(worker, Breach::Twice(Sent::Frame, cycle)));
        }
        exchange.add(worker, &frame.partials, &mut frames.totals);
        frames.gathered[worker] = frame.gathered;
        merge(&mut frames.vote, frame.vote);
        let whole = frames.arrived.iter().all(|arrived| *arrived);
        Ok(if whole { self.cycles.remove(&cycle) } else { None })
    }

    /// Adds the votes of all; where the cycle `gathers`, positions of all belong to it.
    ///
    /// # Errors
    /// If they are not those of all, or have come before.
    pub(super) fn add_votes(
        &mut self,
        worker: usize,
        cycle: u64,
        votes: BranchVote,
        gathers: bool,
    ) -> Result<(), Error> {
        let (voters, workers) = (votes.workers, self.ready.len());
        if voters as usize != workers {
            return Err(Error::Worker(worker, Breach::Voters { cycle, voters, workers }));
        }
        let of_tree = self.of_tree.entry(cycle).or_default();
        of_tree.gathers = gathers;
        if of_tree.votes.replace(votes).is_some() {
            return Err(Error::Worker(worker, Breach::Twice(Sent::Frame, cycle)));
        }
        Ok(())
    }

    /// Adds the positions of a worker's surface nodes.
    ///
    /// # Errors
    /// If they have come before.
    pub(super) fn add_gathered(
        &mut self,
        worker: usize,
        cycle: u64,
        positions: Vec<f64>,
    ) -> Result<(), Error> {
        let of_tree = self.of_tree.entry(cycle).or_default();
        if of_tree.gathered.insert(worker, positions).is_some() {
            return Err(Error::Worker(worker, Breach::Twice(Sent::Positions, cycle)));
        }
        Ok(())
    }

    /// All of the next cycle of a tree, once it is here. Votes come in the order of cycles, positions whenever they can.
    pub(super) fn next_whole(&mut self) -> Option<(u64, Frames)> {
        let n = self.ready.len();
        let first = self.of_tree.first_entry()?;
        let OfTree { votes, gathers, gathered } = first.get();
        if votes.is_none() || (*gathers && gathered.len() < n) {
            return None;
        }
        let (cycle, OfTree { votes, gathered, .. }) = first.remove_entry();
        let frames = Frames {
            arrived: Vec::new(),
            vote: votes?.vote.map(|vote| *vote),
            totals: Vec::new(),
            gathered: gathered.into_values().collect(),
        };
        Some((cycle, frames))
    }

    /// Adds the state of nodes that leave a worker at a cycle; gives, once all are here, what each worker takes in.
    ///
    /// # Errors
    /// If no plan (`exchange`) begins there, or the plan has other numbers.
    pub(super) fn transfer(
        &mut self,
        worker: usize,
        cycle: u64,
        state: Vec<f64>,
        exchange: Option<Arc<Exchange>>,
    ) -> Result<Vec<(usize, Vec<f64>)>, Error> {
        let exchange = exchange.ok_or(Error::Worker(worker, Breach::TransferWithoutPlan(cycle)))?;
        let (numbers, planned) = (state.len(), exchange.n_transfer(worker));
        if numbers != planned {
            return Err(Error::Worker(worker, Breach::Transfer { cycle, numbers, planned }));
        }
        let n = self.ready.len();
        let sent = self.transfers.entry(cycle).or_insert_with(|| vec![None; n]);
        sent[worker] = Some(state);
        if !(0..n).all(|w| sent[w].is_some() || exchange.n_transfer(w) == 0) {
            return Ok(Vec::new());
        }
        let sent = self.transfers.remove(&cycle).unwrap_or_default();
        let sent: Vec<Vec<f64>> = sent.into_iter().map(Option::unwrap_or_default).collect();
        let arrives = (0..n).map(|w| (w, exchange.ghost_state(w, &sent)));
        Ok(arrives.filter(|(_, state)| !state.is_empty()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::job, *};

    fn frame(vote: Option<Vote>, n: usize) -> Frame {
        Frame { vote: vote.map(Box::new), partials: vec![1.0; n], gathered: Vec::new() }
    }

    #[test]
    fn a_cycle_is_whole_when_the_last_worker_has_sent_and_its_votes_are_one() {
        let exchange = job(2).0.epoch.sorts.exchange_at(0).expect("the first plan");
        let mut inflow = Inflow::new(2, None);
        assert_eq!(inflow.require_start(0, 0), Err(Error::Worker(0, Breach::BeforeStart(0))));
        let vote = |courant| Vote { courant, ..Vote::empty(2) };
        assert_eq!(inflow.ready(0, Some(Box::new(vote(2.0)))), Ok(false));
        assert_eq!(inflow.ready(0, None), Err(Error::Worker(0, Breach::ReadyTwice)));
        assert_eq!(inflow.ready(1, Some(Box::new(vote(1.0)))), Ok(true));
        assert_eq!(inflow.vote_before().map(|vote| vote.courant), Some(1.0));
        let n = exchange.n_partials(0);
        let short = inflow.check(0, 4, &frame(None, n - 1), &exchange);
        let breach = Breach::Partials { cycle: 4, numbers: n - 1, planned: n };
        assert_eq!(short, Err(Error::Worker(0, breach)));
        assert!(inflow.add(0, 4, frame(Some(vote(3.0)), n), &exchange).expect("the first").is_none());
        let twice = inflow.add(0, 4, frame(None, n), &exchange).err();
        assert_eq!(twice, Some(Error::Worker(0, Breach::Twice(Sent::Frame, 4))));
        let n = exchange.n_partials(1);
        let whole = inflow.add(1, 4, frame(Some(vote(2.5)), n), &exchange).expect("the second");
        let whole = whole.expect("both are here");
        assert_eq!(whole.vote.map(|vote| vote.courant), Some(2.5));
        assert!(whole.totals.iter().all(|total| *total == 2.0) && !whole.totals.is_empty());
    }

    #[test]
    fn nodes_move_between_workers_only_where_a_plan_begins_to_act() {
        let mut inflow = Inflow::new(2, None);
        let refused = inflow.transfer(1, 6, Vec::new(), None);
        assert_eq!(refused, Err(Error::Worker(1, Breach::TransferWithoutPlan(6))));
        let exchange = job(2).0.epoch.sorts.beginning_at(0);
        let refused = inflow.transfer(1, 0, vec![0.0; 1000], exchange);
        assert!(matches!(refused, Err(Error::Worker(1, Breach::Transfer { numbers: 1000, .. }))));
    }
}
