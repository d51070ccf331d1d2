//! The job's session on the master: a pure state machine, `apply(event) -> actions`.
//!
//! It decides time steps, sorts, states and the end from the votes of whole cycles, adds partial forces, and keeps the
//! totals. It knows no socket, clock, disk or thread: those are events and actions.
//!
//! What it knows is in parts that know nothing of each other's insides, each tested by itself: `problem` is the same for the
//! whole job; `workers`, `checkpoints`, `balancing`, the account (`verdict`) and the `tally` live as long as the job; an
//! `epoch` has a `schedule`, `sorts`, frames of cycles (`frames`), `worker_states` and `samples`. Here they are brought
//! together: this file takes events and completes cycles, `by_tree` those whose votes travel by a `tree`, `sorting` asks for sorts and sends plans, `collect` says what comes of states and samples, `deal` begins an epoch,
//! `turnover` ends one.

mod balancing;
mod by_tree;
mod checkpoints;
mod collect;
mod cutting;
mod deal;
mod epoch;
mod error;
mod foresight;
mod frames;
mod numbers;
mod problem;
mod samples;
mod schedule;
mod sorting;
mod sorts;
mod tally;
#[cfg(test)]
mod tests;
mod turnover;
mod twice;
mod verdict;
mod worker_states;
mod workers;

use std::sync::Arc;

use deck::model::Model;
use mechanics::{contact::Surface, digest, state::GlobalState, vote::Vote};
use protocol::{
    message::{Orders, ToMaster, ToWorker, WORKER_STATE_VERSION},
    options::Route,
};

use crate::{
    event::{Action, Event, Outcome, Progress},
    options::SessionOptions,
    results::{history::HistoryRow, surface::Probe},
};
use balancing::Balancing;
use checkpoints::Checkpoints;
pub use cutting::Cutting;
use epoch::Epoch;
use error::Breach;
pub use error::Error;
use foresight::Window;
use frames::{Frame, Frames};
use numbers::not_a_number;
use problem::Problem;
use schedule::{Step, allowed, first_share, rigid_limit, step_after};
use tally::Tally;
use twice::Twice;
use verdict::{Account, element_fault};
use workers::{Goes, Workers};

/// What was asked of the end.
#[derive(Default)]
struct Ending {
    /// The user wants the results so far.
    stop_asked: bool,
    /// This process has to leave.
    leaves: bool,
    over: bool,
}

/// The master's part in one job.
pub struct Job {
    problem: Problem,
    options: SessionOptions,
    workers: Workers,
    epoch: Epoch,
    checkpoints: Checkpoints,
    /// No state is kept to go back to.
    lean: bool,
    account: Account,
    balancing: Balancing,
    tally: Tally,
    twice: Twice,
    first_cycle: u64,
    ending: Ending,
}

impl Job {
    /// The state the run starts from.
    pub fn start_state(&self) -> &GlobalState {
        &self.checkpoints.newest().state
    }

    /// Rows of history that a snapshot brought along.
    pub fn rows_before(&self) -> &[Arc<HistoryRow>] {
        &self.account.rows
    }

    /// Surface of the problem; none without contact.
    pub fn surface(&self) -> Option<&Surface> {
        self.epoch.sorts.basis().map(|basis| basis.sorter.surface())
    }

    /// What computes contact again from a state; none without contact.
    pub fn probe(&self) -> Option<Probe> {
        let Problem { model, quanta, touching, .. } = &self.problem;
        let (touching, settings) = touching.as_ref().zip(model.setup.contact.clone())?;
        let (surface, exclusions) = (Arc::clone(&touching.surface), Arc::clone(&touching.exclusions));
        Some(Probe { surface, settings, exclusions, quantum: quanta.force })
    }

    /// The worker of every element, where the deck wants states to say it.
    pub fn owners(&self) -> Option<Arc<[u32]>> {
        self.epoch.owners.clone()
    }

    /// How partial forces travel.
    pub fn route(&self) -> Route {
        self.options.route()
    }

    /// Whether it has ended.
    pub fn is_over(&self) -> bool {
        self.ending.over
    }

    /// How often it was dealt out anew.
    pub fn epoch(&self) -> u32 {
        self.epoch.number
    }

    pub fn n_elements(&self) -> usize {
        self.problem.model.mesh.n_elements()
    }

    /// Workers of the present epoch, in the order by which peers and plans name them.
    pub fn at_work(&self) -> &[usize] {
        &self.epoch.at_work
    }

    /// Hash of the plan that frames of a cycle follow; none for a cycle without one.
    pub fn plan_hash(&self, cycle: u64) -> Option<u64> {
        self.epoch.sorts.exchange_at(cycle).ok().map(|exchange| exchange.hash)
    }

    /// The model, with walls bound to their nodes.
    pub fn model(&self) -> &Arc<Model> {
        &self.problem.model
    }

    /// Takes an event, says what to do.
    pub fn apply(&mut self, event: Event) -> Vec<Action> {
        let mut actions = Vec::new();
        if self.ending.over {
            return actions;
        }
        let heard = self.hear(event, &mut actions);
        if let Err(error) = heard.or_else(|fault| self.judge_fault(fault, &mut actions)) {
            // Ends the job without a final state.
            self.account.failure = Some(error.to_string());
            self.finish(None, &mut actions);
        }
        actions
    }

    fn hear(&mut self, event: Event, actions: &mut Vec<Action>) -> Result<(), Error> {
        match event {
            Event::Message(index, epoch, message) => return self.receive(index, epoch, message, actions),
            Event::Sorted(sorted) => return self.sorted(*sorted, actions),
            Event::Lost(index, why) => return self.lost(index, why, actions),
            Event::Joined(spec) => return self.joined(spec, actions),
            Event::Yield(index) => self.yield_worker(index, actions),
            Event::Threads(index, threads) => self.workers.set_threads(index, threads),
            // An interval that is taken again ends where it did before.
            Event::Timer if self.twice.until().is_some() => {
                actions.extend(self.options.keep.seconds().map(Action::Timer));
            }
            Event::Timer => self.checkpoints.time_has_come(),
            Event::Stop => {
                self.ending.stop_asked = true;
                if self.epoch.at_work.is_empty() {
                    self.finish_at_checkpoint(actions);
                }
            }
            Event::Suspend => {
                self.ending.leaves = true;
                if self.epoch.at_work.is_empty() {
                    self.suspend_at_checkpoint(actions);
                }
            }
        }
        Ok(())
    }

    fn finish(&mut self, state: Option<GlobalState>, actions: &mut Vec<Action>) {
        self.ending.over = true;
        if let Some(state) = &state {
            self.note_fragments(state);
        }
        let failure = self.account.failure.take();
        self.epoch.send_all(actions, |_| ToWorker::Release);
        let digest = state.as_ref().map(digest::digest).unwrap_or_default();
        let last = state.as_ref().map_or(self.epoch.schedule.completed(), |s| s.cycle);
        let (at_work, tally) = (&self.epoch.at_work, &mut self.tally);
        actions.push(Action::Over(Box::new(Outcome {
            stopped: self.ending.stop_asked,
            suspended: self.ending.leaves && state.is_none() && failure.is_none(),
            failure,
            state,
            digest,
            run_totals: self.account.run_totals.clone(),
            sorts: tally.sorts,
            census: tally.census,
            work: tally.work(self.workers.n()),
            reports: tally.reports(at_work),
            imbalance: tally.imbalance,
            lanes: tally.lanes().to_owned(),
            route: self.options.route().name(),
            cycles_run: last - self.first_cycle,
            workers: self.workers.names(at_work),
            rebalances: std::mem::take(&mut tally.rebalances),
            losses: std::mem::take(&mut tally.losses),
            differences: std::mem::take(&mut tally.differences),
            runaways: tally.fragments.take_runaways(),
            waits: tally.waits,
        })));
    }

    /// Frames of an older epoch say nothing any more, but that their sender is to go; those of a later one nobody can have sent.
    fn receive(
        &mut self,
        index: usize,
        epoch: u32,
        message: ToMaster,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        let now = self.epoch.number;
        if epoch < now {
            if matches!(message, ToMaster::Leaving) {
                self.workers.leave(index, Goes::Ends);
            }
            return Ok(());
        }
        match self.epoch.position(index) {
            Some(worker) if epoch == now => self.take((worker, index), message, actions),
            _ => Err(Error::Worker(index, Breach::Epoch { epoch, now })),
        }
    }

    /// From here on a worker is its position in the epoch's workers.
    fn take(
        &mut self,
        (worker, index): (usize, usize),
        message: ToMaster,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        let n = self.epoch.n();
        if self.is_early(&message) {
            return self.hold(worker, message);
        }
        match message {
            ToMaster::Ready { vote, lanes } => {
                let all = self.epoch.inflow.ready(worker, vote)?;
                self.tally.note_lanes(&lanes);
                if all { self.start(actions) } else { Ok(()) }
            }
            ToMaster::Cycle { cycle, vote, partials, gathered, busy } => {
                self.epoch.meter.note(worker, busy);
                self.arrived(worker, cycle, Frame { vote, partials, gathered }, actions)
            }
            ToMaster::Votes { cycle, votes } => self.votes_arrived(worker, cycle, votes, actions),
            ToMaster::Gathered { cycle, positions } => {
                self.positions_arrived(worker, cycle, positions, actions)
            }
            ToMaster::Sorted { gathered_at, sorted } => {
                self.patch_sorted(worker, gathered_at, *sorted, actions)
            }
            // Whoever drives the session waits for it.
            ToMaster::At { .. } => Ok(()),
            ToMaster::Relay { to, message } => {
                let member = self.epoch.at_work.get(to as usize).copied();
                let breach = Breach::Address { to, workers: n };
                let member = member.ok_or(Error::Worker(worker, breach))?;
                actions.push(Action::Send(member, ToWorker::Relayed { from: worker as u32, message }));
                Ok(())
            }
            ToMaster::Report(report) => {
                report.check(n).map_err(|e| Error::Worker(worker, Breach::Report(e.to_string())))?;
                self.tally.note_report((index, self.workers.n()), *report);
                Ok(())
            }
            ToMaster::Transfer { cycle, state } => {
                let exchange = self.epoch.sorts.beginning_at(cycle);
                for (to, state) in self.epoch.inflow.transfer(worker, cycle, state, exchange)? {
                    actions.push(Action::Send(self.epoch.at_work[to], ToWorker::Transfer { cycle, state }));
                }
                Ok(())
            }
            ToMaster::Pieces { cycle, version, pieces } => {
                if version != WORKER_STATE_VERSION {
                    return Err(Error::Worker(worker, Breach::StateVersion(version)));
                }
                if self.epoch.schedule.stops_at(cycle) {
                    let noted = self.twice.note_end((worker, n), &pieces);
                    noted.map_err(|e| Error::Unencoded(e.to_string()))?;
                }
                let before = Arc::clone(&self.checkpoints.newest().state);
                self.epoch.worker_states.add((worker, n), cycle, pieces, &before)
            }
            ToMaster::WorkerState { cycle, last, work } => {
                let n_parts = self.problem.model.mesh.parts.len();
                if let Some(what) = not_a_number(last.as_deref(), &[], n_parts) {
                    return self.blame(worker, cycle, &what, actions);
                }
                self.tally.note_work((index, self.workers.n()), work);
                let before = Arc::clone(&self.checkpoints.newest().state);
                let held = (!self.options.played).then(|| self.epoch.shares.held[worker]);
                match self.epoch.worker_states.end((worker, n, held), cycle, last, &before)? {
                    Some(worker_state) => {
                        self.epoch.release(actions);
                        self.collected(worker_state, actions)
                    }
                    None => Ok(()),
                }
            }
            ToMaster::Sample { cycle, hash } => self.sampled(worker, cycle, hash, actions),
            ToMaster::Failed { cycle, reason } => self.blame(worker, cycle, &reason, actions),
            ToMaster::Leaving => {
                self.workers.leave(index, Goes::Ends);
                Ok(())
            }
        }
    }

    /// Orders for the first cycle of an epoch and the one after.
    fn start(&mut self, actions: &mut Vec<Action>) -> Result<(), Error> {
        let first = self.epoch.schedule.first_cycle();
        let control = self.model().setup.control;
        let start = Arc::clone(&self.checkpoints.newest().state);
        let vote = self.epoch.inflow.vote_before().ok_or(Error::NoVote)?;
        let (problem, walls) = (&self.problem, &self.account.walls);
        let Step { dt, time, quanta } = self.epoch.schedule.first_step(start.time, &control, || {
            if let Some(fault) = vote.fault {
                return Err(Error::Element(element_fault(problem, fault, 0)));
            }
            let window = Window { known: None, from: start.time, longest: control.end_time - start.time };
            let (dt, _, _) = allowed(problem, walls, vote, window);
            Ok((first_share(problem, vote) * dt).min(rigid_limit(problem)))
        })?;
        let at_end = time >= control.end_time || first >= control.end_cycle;
        let store = self.options.asked.snapshot_at == Some(first) && self.epoch.number == 0;
        let blocking = !at_end && self.epoch.sorts.surface_changes_at(first);
        if blocking {
            self.epoch.sorts.gather_at(first, true, u64::from(control.sort_lag));
        }
        let before = Orders {
            next: first.wrapping_sub(1),
            dt: 0.0,
            time,
            walls: self.account.walls.clone(),
            quanta,
            gather: blocking,
            blocking,
            collect: store || at_end,
            stop: at_end,
            sample: self.options.replay && !at_end,
        };
        if before.collect {
            self.epoch.worker_states.order(first, time, false);
        }
        if at_end {
            self.epoch.schedule.stop_at(first, false);
        } else if store {
            self.checkpoints.expect(first);
        }
        let orders = self.orders_for(first, dt, [time, time + dt], None, actions);
        self.epoch.send_all(actions, |_| ToWorker::Start { orders: [before.clone(), orders.clone()] });
        Ok(())
    }

    /// The orders that give `dt` of cycle `next`, from `time` to `time_after`, and what happens then. Walls of finite mass
    /// are where they are in that cycle. `vote` is of the cycle two before the sort that it may trigger could gather.
    fn orders_for(
        &mut self,
        next: u64,
        dt: f64,
        [time, time_after]: [f64; 2],
        vote: Option<&Vote>,
        actions: &mut Vec<Action>,
    ) -> Orders {
        let control = self.model().setup.control;
        let after = next + 1;
        if !self.epoch.schedule.is_stopping() {
            // Who stops a run gets an end that two computations agree on, where one of them is under way.
            let stops = self.ending.stop_asked && self.twice.until().is_none_or(|until| after >= until);
            let ends = stops
                || self.ending.leaves
                || self.account.failure.is_some()
                || time_after >= control.end_time
                || after >= control.end_cycle;
            let pauses = !ends
                && match self.twice.until() {
                    Some(until) => after >= until,
                    None => {
                        self.switches_at(time_after)
                            || self.wants_next_epoch(after)
                            || (self.twice.is_chosen() && self.checkpoint_due(after, actions))
                    }
                };
            if ends || pauses {
                self.epoch.schedule.stop_at(after, pauses);
            }
        }
        let stop = self.epoch.schedule.stops_at(after);
        let due = !self.options.asked.no_output && self.epoch.schedule.state_due(time_after);
        let keep = !self.epoch.schedule.is_stopping()
            && !self.twice.is_chosen()
            && self.checkpoint_due(after, actions);
        if keep {
            self.checkpoints.expect(after);
        }
        let collect = stop || due || keep;
        if collect {
            self.epoch.worker_states.order(after, time_after, due);
        }
        let blocking = !stop && self.epoch.sorts.surface_changes_at(after);
        let gather = blocking || (!stop && self.sort_due(after, vote));
        if gather {
            self.epoch.sorts.gather_at(after, blocking, u64::from(control.sort_lag));
        }
        let (walls, quanta) = (self.account.walls.clone(), self.epoch.schedule.quanta());
        let sample = (keep || stop) && self.options.replay;
        if stop && sample {
            self.epoch.schedule.sample_stop();
        }
        Orders { next, dt, time, walls, quanta, gather, blocking, collect, stop, sample }
    }

    /// Plan boundaries are the cycles at which plans begin to act, and at latest every so many.
    fn is_boundary(&self, cycle: u64) -> bool {
        let interval = self.model().setup.control.plan_interval.max(1);
        cycle.is_multiple_of(u64::from(interval)) || self.epoch.sorts.change_plan_at(cycle)
    }

    /// Whether the state at the start of a cycle is to be kept, to go back to.
    fn checkpoint_due(&mut self, cycle: u64, actions: &mut Vec<Action>) -> bool {
        let boundary = self.is_boundary(cycle);
        let (due, timer) = self.checkpoints.due(cycle, boundary);
        actions.extend(timer.map(Action::Timer));
        due || self.options.asked.snapshot_at == Some(cycle)
    }

    /// A frame of a cycle has come.
    fn arrived(
        &mut self,
        worker: usize,
        cycle: u64,
        frame: Frame,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        self.epoch.inflow.require_start(worker, cycle)?;
        let exchange = self.epoch.sorts.exchange_at(cycle)?;
        self.epoch.inflow.check(worker, cycle, &frame, &exchange)?;
        // Workers look at their forces before they send them; a master does not rely on it.
        let looked_at: &[f64] = if self.options.replay { &frame.partials } else { &[] };
        let n_parts = self.problem.model.mesh.parts.len();
        if let Some(what) = not_a_number(frame.vote.as_deref(), looked_at, n_parts) {
            return self.blame(worker, cycle, &what, actions);
        }
        self.twice.note((worker, self.epoch.n()), cycle, frame.vote.as_deref());
        match self.epoch.inflow.add(worker, cycle, frame, &exchange)? {
            Some(frames) => self.complete(cycle, frames, actions),
            None => Ok(()),
        }
    }

    /// Books the vote of a cycle, where its step is still known.
    fn book(&mut self, cycle: u64, vote: &Vote, actions: &mut Vec<Action>) {
        if let Some(step) = self.epoch.schedule.step(cycle) {
            self.account.book(&self.problem, (cycle, step), vote, actions);
        }
    }

    /// No frame of `cycle` or before will come any more.
    fn retire(&mut self, cycle: u64) {
        self.epoch.schedule.complete(cycle);
        self.epoch.sorts.retire_before(cycle + 1);
    }

    /// Every worker's frame of `cycle` is here: totals and orders go out, the vote of the cycle before is booked.
    fn complete(&mut self, cycle: u64, frames: Frames, actions: &mut Vec<Action>) -> Result<(), Error> {
        let (vote, fresh) = match frames.vote {
            Some(vote) => {
                if let Some(before) = cycle.checked_sub(1) {
                    self.book(before, &vote, actions);
                }
                (vote, true)
            }
            None => {
                let before = self.epoch.inflow.vote_before().cloned();
                (before.ok_or(Error::CycleWithoutVote)?, cycle == 0)
            }
        };
        let now = self.epoch.schedule.ordered(cycle)?;
        if let Some(census) = self.epoch.sorts.census_beginning_at(cycle) {
            self.tally.sorts += 1;
            self.tally.census = census;
        }
        if fresh {
            if let Some(settings) = &self.problem.model.setup.contact {
                self.epoch.sorts.follow_spread(cycle.saturating_sub(1), &vote, settings);
            }
            if let Some(before) = cycle.checked_sub(1) {
                self.epoch.sorts.note_erosion(before, &vote)?;
            }
        }
        if self.checkpoints.is_expected(cycle) {
            let continuation = self.rest_at(cycle, vote.clone())?;
            self.checkpoints.take_rest(cycle, continuation);
            self.complete_checkpoint(cycle, actions)?;
        }
        let control = self.model().setup.control;
        let walls = &self.account.walls;
        let known = cycle.checked_sub(1).and_then(|before| Some(self.epoch.schedule.step(before)?.dt));
        let (dt, limit, element) = step_after(&self.problem, walls, &vote, (known, now));
        let next = self.epoch.schedule.order_after(cycle, now, (dt, limit), &control);
        self.account.check_floor(&self.problem, (cycle + 1, next.dt), next.limit, element);
        self.epoch.schedule.rescale(&vote, self.problem.mass)?;
        self.account.move_walls(&self.problem, &vote, now.dt)?;
        let times = [next.time, next.time_after];
        let orders = self.orders_for(cycle + 1, next.dt, times, Some(&vote), actions);
        let mut totals = Vec::new();
        match self.epoch.root {
            Some(root) => {
                let message = ToWorker::Totals { cycle, orders, totals: Vec::new() };
                totals.push(Action::Send(self.epoch.at_work[root], message));
            }
            None => {
                let exchange = self.epoch.sorts.exchange_at(cycle)?;
                self.epoch.send_all(&mut totals, |worker| {
                    let totals = exchange.of_worker(worker, &frames.totals);
                    ToWorker::Totals { cycle, orders: orders.clone(), totals }
                });
            }
        }
        self.epoch.held.push_back((cycle, totals));
        self.epoch.release(actions);
        self.tally.waits += u64::from(!self.epoch.held.is_empty());
        self.retire(cycle);
        self.begin_sort(cycle, &frames.gathered, actions)?;
        let limit = next.limit;
        actions.push(Action::Progress(Progress { cycle, time: now.time, dt: now.dt, element, limit }));
        Ok(())
    }
}
