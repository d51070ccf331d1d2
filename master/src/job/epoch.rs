//! An epoch: from one dealing out of the problem to the next.
//!
//! An epoch begins at a [`Checkpoint`], the whole state at the start of a cycle, on a set of workers and with speeds for
//! them. It ends with the job, or by one of three ways to the next:
//!
//! - *A worker is lost.* The run goes back to the newest checkpoint on those that are left: rows, totals and the schedule of
//!   output are those of the checkpoint, and sinks are told to drop what lies behind it.
//! - *A worker has joined, or speeds turned out to be others.* At the next plan boundary the workers stop at the start
//!   of a cycle with their states and the last vote; that is the checkpoint of the next epoch, and nothing is lost.
//! - *A part becomes rigid or deforms again.* Likewise, at the first cycle that starts in its time or after it.

use std::{collections::VecDeque, sync::Arc};

use deck::model::Model;
use protocol::message::{ToMaster, ToWorker};

use super::{
    balancing::{Meter, Shares},
    checkpoints::Checkpoint,
    frames::Inflow,
    samples::Samples,
    schedule::Schedule,
    sorts::Sorts,
    worker_states::WorkerStates,
};
use crate::event::Action;

/// All that is fixed for one epoch or counted in it. Workers are named by their position in its workers.
pub(super) struct Epoch {
    /// Its number; frames carry it.
    pub(super) number: u32,
    /// Indices of the workers, by position; nobody while the job waits for a worker.
    pub(super) at_work: Vec<usize>,
    /// The position of the worker that sends the votes of all, where they form a tree.
    pub(super) root: Option<usize>,
    pub(super) shares: Shares,
    /// The worker of every element, where the deck wants states to say it.
    pub(super) owners: Option<Arc<[u32]>>,
    pub(super) schedule: Schedule,
    pub(super) sorts: Sorts,
    pub(super) inflow: Inflow,
    /// States and samples, by the position of who sent them, that have overtaken votes on their way through the tree.
    pub(super) early: Vec<(usize, ToMaster)>,
    pub(super) worker_states: WorkerStates,
    /// Totals and orders by cycle, in order, that wait until fewer states are on their way.
    pub(super) held: VecDeque<(u64, Vec<Action>)>,
    pub(super) samples: Samples,
    pub(super) meter: Meter,
}

impl Epoch {
    /// Of a checkpoint, before its workers is there.
    pub(super) fn without_workers(number: u32, checkpoint: &Checkpoint, model: &Model) -> Self {
        Self {
            number,
            at_work: Vec::new(),
            root: None,
            shares: Shares::default(),
            owners: None,
            schedule: Schedule::new(checkpoint, model.output.period),
            sorts: Sorts::new(&checkpoint.state, checkpoint.continuation.spread_rate),
            inflow: Inflow::new(0, checkpoint.continuation.vote.clone()),
            early: Vec::new(),
            worker_states: WorkerStates::default(),
            held: VecDeque::new(),
            samples: Samples::default(),
            meter: Meter::new(0),
        }
    }

    /// Number of workers.
    pub(super) fn n(&self) -> usize {
        self.at_work.len()
    }

    /// The position of a worker.
    pub(super) fn position(&self, index: usize) -> Option<usize> {
        self.at_work.iter().position(|&member| member == index)
    }

    /// Lets totals and orders go, but those of cycles for which too many states are on their way.
    pub(super) fn release(&mut self, actions: &mut Vec<Action>) {
        while let Some((_, totals)) =
            self.held.pop_front_if(|(cycle, _)| !self.worker_states.are_behind(*cycle))
        {
            actions.extend(totals);
        }
    }

    pub(super) fn send_all(&self, actions: &mut Vec<Action>, message: impl Fn(usize) -> ToWorker) {
        for (position, &index) in self.at_work.iter().enumerate() {
            actions.push(Action::Send(index, message(position)));
        }
    }
}
