//! Epochs: from one dealing out of the problem to the next.
//!
//! An epoch begins at a [`Base`], the whole state at the start of a cycle, on a crew of workers and with speeds for
//! them. It ends with the job, or by one of two ways to the next:
//!
//! - *A worker is lost.* The run goes back to the newest base on those that are left: rows, ledger and the schedule of
//!   output are those of the base, and sinks are told to drop what lies behind it.
//! - *A worker has joined, or speeds turned out to be others.* At the next plan boundary the workers stop at the start
//!   of a cycle with their images and the last vote; that is the base of the next epoch, and nothing is lost.
//!
//! A base is all that the cycles after it depend on, so no bit of the run depends on how often, when and on whom it is
//! begun anew.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use mechanics::{exact::Quantum, piece::Region, state::GlobalState, vote::Vote, wall::Pose};
use protocol::message::ToWorker;

use super::{Arrivals, Bench, Job, erosion::Eroded, images::Collecting, measure::Meter};
use crate::{
    decompose::Subdomain,
    event::{Action, Hand, Loss},
    exchange::Exchange,
    ledger::Ledger,
    sort::Sorted,
};

/// A worker that was ever given to the job.
pub(super) struct Member {
    /// As it came; its speed is the one that it is dealt work by.
    pub(super) hand: Hand,
    /// Not lost.
    pub(super) alive: bool,
    /// It wants to go, at the next plan boundary.
    pub(super) leaves: bool,
}

/// What a base holds beside the state.
#[derive(Clone)]
pub(super) struct Rest {
    /// `dt` of the cycle before (time).
    pub(super) dt_previous: f64,
    /// `dt` of the cycle to come; none at the start of a run, where the first vote gives it.
    pub(super) dt: Option<f64>,
    /// Quantum of forces in the cycle to come, and from the one after it on.
    pub(super) quanta: [Quantum; 2],
    /// The whole vote of the cycle before; none at the start of a run.
    pub(super) vote: Option<Vote>,
    /// Poses of the walls of finite mass in the cycle to come.
    pub(super) walls: Vec<Pose>,
    /// With the cycle before in it.
    pub(super) ledger: Ledger,
    /// Rows of history up to there.
    pub(super) n_rows: usize,
    /// As it was known then.
    pub(super) spread_rate: f64,
}

/// Where an epoch can begin.
pub(super) struct Base {
    pub(super) state: Arc<GlobalState>,
    pub(super) rest: Rest,
}

/// A base on its way: frames of cycles may overtake images, so either half may come first.
#[derive(Default)]
pub(super) struct Halves {
    pub(super) state: Option<GlobalState>,
    pub(super) rest: Option<Rest>,
}

/// One cycle's step.
#[derive(Clone, Copy)]
pub(super) struct Step {
    /// Time step (time).
    pub(super) dt: f64,
    /// Time at its start.
    pub(super) time: f64,
    /// Quantum of its forces.
    pub(super) quantum: Quantum,
}

/// An exchange and where it begins to act.
pub(super) struct Acting {
    pub(super) at: u64,
    /// The cycle whose positions it was sorted from.
    pub(super) gathered: u64,
    pub(super) exchange: Arc<Exchange>,
}

/// A sort that was ordered.
pub(super) struct SortUnderWay {
    /// The cycle at whose start positions travel.
    pub(super) gathered: u64,
    /// The cycle from which its plan acts.
    pub(super) acts_at: u64,
    /// All wait for it, because the surface changes.
    pub(super) blocking: bool,
    /// What came of it, until those before it are done.
    pub(super) done: Option<Sorted>,
}

/// All that is fixed for one epoch or counted in it. *Positions* are indices into its crew.
pub(super) struct Epoch {
    /// Its number; frames carry it.
    pub(super) number: u32,
    /// Members at work, by position; nobody while the job waits for a worker.
    pub(super) crew: Vec<usize>,
    /// By position: what work is dealt out by.
    pub(super) speeds: Vec<f64>,
    /// By position.
    pub(super) elements: Vec<f64>,
    /// The worker of every element, where the deck wants states to say it.
    pub(super) owners: Option<Arc<[u32]>>,
    pub(super) bench: Option<Arc<Bench>>,
    pub(super) ready: Vec<bool>,
    pub(super) running: bool,
    pub(super) first_cycle: u64,
    /// Quantum of forces from the cycle after the last ordered one on.
    pub(super) quantum: Quantum,
    /// By cycle; a few cycles around the present.
    pub(super) steps: BTreeMap<u64, Step>,
    /// The vote of the cycle before `first_cycle`.
    pub(super) vote_before: Option<Vote>,
    pub(super) arrivals: BTreeMap<u64, Arrivals>,
    /// By the cycle they act from; the first is in force at the oldest cycle that is not complete.
    pub(super) exchanges: VecDeque<Acting>,
    /// The last complete cycle plus one.
    pub(super) completed: u64,
    /// Sorts that were ordered and are not done, oldest first.
    pub(super) sorts_under_way: VecDeque<SortUnderWay>,
    /// What has eroded; none where nothing can.
    pub(super) eroded: Option<Eroded>,
    /// Which worker has which elements.
    pub(super) layout: Vec<Subdomain>,
    pub(super) transfers: BTreeMap<u64, Vec<Option<Vec<f64>>>>,
    pub(super) collecting: BTreeMap<u64, Collecting>,
    /// Time of each image that was ordered and is not complete, and whether it is for the user.
    pub(super) image_times: BTreeMap<u64, (f64, bool)>,
    /// By position: part and elements of each block, where samples are computed again.
    pub(super) blocks: Vec<Vec<(usize, Region)>>,
    /// Samples by cycle, then by position.
    pub(super) samples: BTreeMap<u64, Vec<Option<[u8; 16]>>>,
    /// Bases on their way.
    pub(super) halves: BTreeMap<u64, Halves>,
    /// The cycle of the newest base, whole or on its way.
    pub(super) last_base: u64,
    pub(super) next_state_time: Option<f64>,
    /// The cycle whose positions the newest sort works on, asked for or in force.
    pub(super) last_gather: u64,
    /// The exchange in force and the one before it: where it began to act, and the cycle whose positions it sorted.
    pub(super) references: [(u64, u64); 2],
    pub(super) last_spread: f64,
    pub(super) spread_rate: f64,
    /// All stop at the start of this cycle.
    pub(super) stop_at: Option<u64>,
    /// Samples come with that stop.
    pub(super) stop_sampled: bool,
    /// All have stopped, and their images are here: state, last vote, whether the state is for the user.
    pub(super) stopped: Option<(GlobalState, Vote, bool)>,
    /// They stop for the next epoch, not for the end.
    pub(super) pauses: bool,
    pub(super) meter: Meter,
}

impl Epoch {
    /// Number of workers.
    pub(super) fn n(&self) -> usize {
        self.crew.len()
    }
}

impl Job {
    /// A worker is gone.
    pub(super) fn lost(
        &mut self,
        member: usize,
        why: String,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let known = self.members.len();
        let lost =
            self.members.get_mut(member).ok_or_else(|| format!("worker {member} of {known} is lost"))?;
        if !std::mem::replace(&mut lost.alive, false) || !self.epoch.crew.contains(&member) {
            return Ok(());
        }
        let worker = lost.hand.name.clone();
        let no_other = !self.members.iter().any(|member| member.alive);
        if no_other && !self.options.waits {
            return Err(format!("worker {worker} is lost: {why}; no other is left"));
        }
        let (cycle, back_to) = (self.epoch.completed, self.base.state.cycle);
        self.losses.push(Loss { worker, cycle, back_to, why });
        self.go_back(actions);
        self.next_epoch(actions)
    }

    /// A worker has come: it is taken in at the next plan boundary, or at once by a job that waits.
    pub(super) fn joined(&mut self, hand: Hand, actions: &mut Vec<Action>) -> Result<(), String> {
        self.members.push(Member { hand, alive: true, leaves: false });
        if self.epoch.crew.is_empty() { self.next_epoch(actions) } else { Ok(()) }
    }

    /// Whether somebody waits to be taken in.
    pub(super) fn has_newcomers(&self) -> bool {
        self.members.iter().filter(|member| member.alive && !member.leaves).count()
            > self.epoch.crew.iter().filter(|&&member| !self.members[member].leaves).count()
    }

    /// Whether somebody wants to go.
    pub(super) fn has_leavers(&self) -> bool {
        self.epoch.crew.iter().any(|&member| self.members[member].leaves)
    }

    /// Everything that was booked after the base is forgotten, here and in the results.
    pub(super) fn go_back(&mut self, actions: &mut Vec<Action>) {
        let rest = &self.base.rest;
        self.ledger = rest.ledger.clone();
        self.walls.clone_from(&rest.walls);
        self.rows.truncate(rest.n_rows);
        self.failure = None;
        self.proposal = None;
        actions.push(Action::Rewind { rows: rest.n_rows, cycle: self.base.state.cycle });
    }

    /// All have stopped at the start of a cycle, and their images are here.
    pub(super) fn paused(
        &mut self,
        state: GlobalState,
        vote: Vote,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let cycle = state.cycle;
        let rest = self.rest_at(cycle, vote)?;
        self.base = Arc::new(Base { state: Arc::new(state), rest });
        self.store(cycle, actions);
        self.adopt_proposal(cycle);
        for &member in &self.epoch.crew {
            if self.members[member].leaves {
                self.members[member].alive = false;
                actions.push(Action::Send(member, ToWorker::Release));
            }
        }
        self.next_epoch(actions)
    }

    /// What a base at the start of a cycle holds beside the state, once the cycle before is booked with this vote.
    pub(super) fn rest_at(&self, cycle: u64, vote: Vote) -> Result<Rest, String> {
        let step = self.epoch.steps.get(&cycle).ok_or_else(|| format!("cycle {cycle} was not ordered"))?;
        let before = cycle.checked_sub(1).and_then(|cycle| self.epoch.steps.get(&cycle));
        Ok(Rest {
            dt_previous: before.map_or(0.0, |step| step.dt),
            dt: Some(step.dt),
            quanta: [step.quantum, self.epoch.quantum],
            vote: Some(vote),
            walls: self.walls.clone(),
            ledger: self.ledger.clone(),
            n_rows: self.rows.len(),
            spread_rate: self.epoch.spread_rate,
        })
    }

    /// Deals the base out to all that are alive; with nobody, the job waits.
    pub(super) fn next_epoch(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        let number = self.epoch.number.checked_add(1).ok_or("2^32 epochs of one job")?;
        let crew: Vec<usize> = (0..self.members.len()).filter(|&m| self.members[m].alive).collect();
        let nobody = crew.is_empty();
        self.epoch = self.deal(number, crew, actions)?;
        if self.lean {
            self.forget_base();
        }
        if nobody && self.leaves {
            self.suspend_at_base(actions);
        } else if nobody && self.stop_asked {
            return self.finish_at_base(actions);
        }
        Ok(())
    }

    /// The user does not want to wait for a worker any longer.
    pub(super) fn finish_at_base(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        let state = GlobalState::clone(&self.base.state);
        self.end_with(state, actions)
    }

    /// Sends to the whole crew.
    pub(super) fn send_all(&self, actions: &mut Vec<Action>, message: impl Fn(usize) -> ToWorker) {
        for (position, &member) in self.epoch.crew.iter().enumerate() {
            actions.push(Action::Send(member, message(position)));
        }
    }
}
