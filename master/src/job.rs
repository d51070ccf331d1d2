//! The job's session on the master: a pure state machine, `apply(event) -> actions`.
//!
//! It decides time steps, sorts, images and the end from the votes of whole cycles, adds partial forces, and keeps the
//! ledger. It knows no socket, clock, disk or thread: those are events and actions.

mod images;
mod pace;
mod start;
#[cfg(test)]
mod tests;
mod verdict;

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use mechanics::{
    contact::Surface,
    digest,
    state::GlobalState,
    vote::{Quanta, Vote},
    wall::{self, Pose},
};
use protocol::{
    message::{IMAGE_VERSION, Orders, Route, ToMaster, ToWorker, Work},
    phase::Report,
};

use crate::{
    event::{Action, Event, Limit, Options, Outcome, Progress},
    exchange::{Exchange, Holdings},
    ledger::Ledger,
    results::history::HistoryRow,
    sort::{Sorted, Sorter},
};
use images::{Collecting, SnapshotRest};

/// What sorts work on: fixed between two decompositions.
pub struct Bench {
    /// Surface, settings, speeds.
    pub sorter: Sorter,
    /// Who holds which nodes.
    pub holdings: Holdings,
    /// Masses and constraints (positions are those of the start).
    pub state: Arc<GlobalState>,
}

impl Bench {
    /// Does the sort that [`Action::Sort`] asks for.
    pub fn sort(&self, x: &[[f64; 3]]) -> Sorted {
        self.sorter.run(x, &self.holdings, &self.state)
    }
}

/// One cycle on its way: what has come from the workers.
struct Arrivals {
    arrived: Vec<bool>,
    vote: Option<Vote>,
    totals: Vec<f64>,
    gathered: Vec<Vec<f64>>,
}

/// The master's part in one job.
pub struct Job {
    model: Arc<Model>,
    options: Options,
    n_workers: usize,
    quanta: Quanta,
    bench: Option<Arc<Bench>>,
    state: GlobalState,
    ready: Vec<bool>,
    running: bool,
    lanes: String,
    first_cycle: u64,
    /// `dt` by cycle, and the time at its start; a few cycles around the present.
    steps: BTreeMap<u64, (f64, f64)>,
    /// The vote of the cycle before `first_cycle`.
    vote_before: Option<Vote>,
    arrivals: BTreeMap<u64, Arrivals>,
    /// Exchanges by the cycle they act from; the first is in force at the oldest cycle that is not complete.
    exchanges: VecDeque<(u64, Arc<Exchange>)>,
    /// The last complete cycle plus one.
    completed: u64,
    /// Cycles whose positions a sort works on, oldest first.
    sorts_under_way: VecDeque<u64>,
    transfers: BTreeMap<u64, Vec<Option<Vec<f64>>>>,
    collecting: BTreeMap<u64, Collecting>,
    /// Time of each image that was ordered and is not complete: frames of later cycles may overtake it.
    image_times: BTreeMap<u64, f64>,
    /// The images of a snapshot, and the rest of it: frames of cycles may overtake images, so either may come first.
    snapshot_state: Option<GlobalState>,
    snapshot_rest: Option<SnapshotRest>,
    next_state_time: Option<f64>,
    /// The cycle whose positions the newest sort works on, asked for or in force.
    last_gather: u64,
    /// The exchange in force and the one before it: where it began to act, and the cycle whose positions it sorted.
    references: [(u64, u64); 2],
    last_spread: f64,
    spread_rate: f64,
    stop_asked: bool,
    stop_at: Option<u64>,
    failure: Option<String>,
    ledger: Ledger,
    /// Poses of the walls of finite mass in the newest cycle that was ordered.
    walls: Vec<Pose>,
    rows: Vec<HistoryRow>,
    sorts: u64,
    census: mechanics::contact::Census,
    work: Vec<Work>,
    reports: Vec<Report>,
    imbalance: f64,
    over: bool,
}

impl Job {
    /// The state the run starts from.
    pub fn start_state(&self) -> &GlobalState {
        &self.state
    }

    /// Rows of history that a snapshot brought along.
    pub fn rows_before(&self) -> &[HistoryRow] {
        &self.rows
    }

    /// Surface of the problem; none without contact.
    pub fn surface(&self) -> Option<&Surface> {
        self.bench.as_ref().map(|bench| bench.sorter.surface())
    }

    /// How partial forces travel.
    pub fn route(&self) -> Route {
        self.options.route
    }

    /// Whether it has ended.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// Hash of the plan that frames of a cycle follow; none for a cycle without one.
    pub fn plan_hash(&self, cycle: u64) -> Option<u64> {
        self.exchange_at(cycle).ok().map(|exchange| exchange.hash)
    }

    /// Takes an event, says what to do.
    pub fn apply(&mut self, event: Event) -> Vec<Action> {
        let mut actions = Vec::new();
        if self.over {
            return actions;
        }
        let result = match event {
            Event::Message(worker, message) => self.hear(worker, message, &mut actions),
            Event::Sorted(sorted) => self.sorted(*sorted, &mut actions),
            Event::Stop => {
                self.stop_asked = true;
                Ok(())
            }
            Event::Lost(worker, why) => Err(format!("worker {worker} is lost: {why}")),
        };
        if let Err(reason) = result {
            self.give_up(reason, &mut actions);
        }
        actions
    }

    /// Ends the job without a final state.
    fn give_up(&mut self, reason: String, actions: &mut Vec<Action>) {
        self.failure = Some(reason);
        self.finish(None, actions);
    }

    fn finish(&mut self, state: Option<GlobalState>, actions: &mut Vec<Action>) {
        self.over = true;
        for worker in 0..self.n_workers {
            actions.push(Action::Send(worker, ToWorker::Release));
        }
        let digest = state.as_ref().map(digest::digest).unwrap_or_default();
        let cycles_run = state.as_ref().map_or(self.completed, |s| s.cycle) - self.first_cycle;
        actions.push(Action::Over(Box::new(Outcome {
            failure: self.failure.take(),
            stopped: self.stop_asked,
            state,
            digest,
            ledger: self.ledger.clone(),
            sorts: self.sorts,
            census: self.census,
            work: self.work.clone(),
            reports: std::mem::take(&mut self.reports),
            imbalance: self.imbalance,
            lanes: self.lanes.clone(),
            route: match self.options.route {
                Route::Master => "master",
                Route::Direct => "direct",
            },
            cycles_run,
        })));
    }

    fn hear(&mut self, worker: usize, message: ToMaster, actions: &mut Vec<Action>) -> Result<(), String> {
        match message {
            ToMaster::Ready { vote, lanes } => self.ready(worker, vote, lanes, actions),
            ToMaster::Cycle { cycle, vote, partials, gathered } => {
                self.arrived(worker, cycle, vote, &partials, gathered, actions)
            }
            ToMaster::Relay { to, message } => {
                if to as usize >= self.n_workers {
                    return Err(format!(
                        "worker {worker} writes to worker {to}, there are {}",
                        self.n_workers
                    ));
                }
                actions.push(Action::Send(to as usize, ToWorker::Relayed { from: worker as u32, message }));
                Ok(())
            }
            ToMaster::Report(report) => {
                report.check(self.n_workers).map_err(|error| format!("worker {worker}: {error}"))?;
                self.reports[worker] = *report;
                Ok(())
            }
            ToMaster::Transfer { cycle, state } => self.transfer(worker, cycle, state, actions),
            ToMaster::Image { cycle, version, pieces, last, work } => {
                if version != IMAGE_VERSION {
                    return Err(format!(
                        "worker {worker} sends images of version {version}, this master reads {IMAGE_VERSION}"
                    ));
                }
                self.work[worker] = work;
                self.image(worker, cycle, pieces, last, actions)
            }
            ToMaster::Failed { cycle, reason } => Err(format!("worker {worker}, cycle {cycle}: {reason}")),
        }
    }

    fn ready(
        &mut self,
        worker: usize,
        vote: Option<Box<Vote>>,
        lanes: String,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        if self.running || std::mem::replace(&mut self.ready[worker], true) {
            return Err(format!("worker {worker} is ready twice"));
        }
        if !self.lanes.split('+').any(|l| l == lanes) {
            self.lanes = if self.lanes.is_empty() { lanes } else { format!("{}+{lanes}", self.lanes) };
        }
        if let Some(vote) = vote {
            match &mut self.vote_before {
                Some(merged) => merged.merge(&vote),
                None => self.vote_before = Some(*vote),
            }
        }
        if self.ready.iter().all(|r| *r) {
            self.running = true;
            self.start(actions)?;
        }
        Ok(())
    }

    /// Orders for the first cycle and the one after.
    fn start(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        let first = self.first_cycle;
        let control = self.model.setup.control;
        let vote = self.vote_before.as_ref().ok_or("no worker voted")?;
        if !self.steps.contains_key(&first) {
            if let Some((element, volume)) = vote.fault {
                return Err(self.element_fault(element, volume, 0));
            }
            let (dt, _, _) = self.limit(vote, f64::INFINITY);
            let dt = dt.min(control.end_time - self.state.time).max(0.0);
            self.steps.insert(first, (dt, self.state.time));
        }
        let (dt, time) = self.steps[&first];
        let at_end = time >= control.end_time || first >= control.end_cycle;
        let snapshot_now = self.options.snapshot_at == Some(first);
        let before = Orders {
            next: first.wrapping_sub(1),
            dt: 0.0,
            time,
            walls: self.walls.clone(),
            force_quantum: self.quanta.force,
            gather: false,
            collect: snapshot_now || at_end,
            stop: at_end,
        };
        if before.collect {
            self.image_times.insert(first, time);
        }
        if at_end {
            self.stop_at = Some(first);
        }
        let orders = self.orders_for(first, dt, [time, time + dt], None);
        for worker in 0..self.n_workers {
            let orders = [before.clone(), orders.clone()];
            actions.push(Action::Send(worker, ToWorker::Start { orders }));
        }
        Ok(())
    }

    fn arrived(
        &mut self,
        worker: usize,
        cycle: u64,
        vote: Option<Box<Vote>>,
        partials: &[f64],
        gathered: Vec<f64>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        if !self.running {
            return Err(format!("worker {worker} sends cycle {cycle} before the start"));
        }
        let exchange = self.exchange_at(cycle)?;
        let expected = exchange.n_partials(worker);
        if partials.len() != expected {
            return Err(format!(
                "worker {worker}, cycle {cycle}: {} numbers of partial forces, the plan has {expected}",
                partials.len()
            ));
        }
        let n = self.n_workers;
        let arrivals = self.arrivals.entry(cycle).or_insert_with(|| Arrivals {
            arrived: vec![false; n],
            vote: None,
            totals: exchange.totals(),
            gathered: vec![Vec::new(); n],
        });
        if std::mem::replace(&mut arrivals.arrived[worker], true) {
            return Err(format!("worker {worker} sends cycle {cycle} twice"));
        }
        exchange.add(worker, partials, &mut arrivals.totals);
        arrivals.gathered[worker] = gathered;
        if let Some(vote) = vote {
            match &mut arrivals.vote {
                Some(merged) => merged.merge(&vote),
                None => arrivals.vote = Some(*vote),
            }
        }
        if arrivals.arrived.iter().all(|a| *a)
            && let Some(arrivals) = self.arrivals.remove(&cycle)
        {
            self.complete(cycle, arrivals, actions)?;
        }
        Ok(())
    }

    /// The exchange in force at a cycle. A worker that shares nothing may be a cycle ahead of the others, so two can be
    /// in use at once.
    fn exchange_at(&self, cycle: u64) -> Result<Arc<Exchange>, String> {
        let found = self.exchanges.iter().rev().find(|(acts_at, _)| *acts_at <= cycle);
        found.map(|(_, exchange)| Arc::clone(exchange)).ok_or_else(|| format!("no plan for cycle {cycle}"))
    }

    /// No frame of `cycle` or before will come any more.
    fn retire(&mut self, cycle: u64) {
        self.completed = cycle + 1;
        while let Some(&(acts_at, _)) = self.exchanges.get(1).filter(|(acts_at, _)| *acts_at <= cycle + 1) {
            self.exchanges.pop_front();
            let lag = u64::from(self.model.setup.control.sort_lag);
            self.references = [(acts_at, acts_at - lag), self.references[0]];
            self.sorts += 1;
        }
    }

    /// Every worker's frame of `cycle` is here: totals and orders go out, the vote of the cycle before is booked.
    fn complete(&mut self, cycle: u64, arrivals: Arrivals, actions: &mut Vec<Action>) -> Result<(), String> {
        let vote = match arrivals.vote {
            Some(vote) => {
                self.book(cycle - 1, &vote, actions);
                vote
            }
            None => self.vote_before.clone().ok_or("a cycle without a vote")?,
        };
        let (dt_now, time_now) =
            *self.steps.get(&cycle).ok_or_else(|| format!("cycle {cycle} was not ordered"))?;
        if self.options.snapshot_at == Some(cycle) {
            let dt_previous = cycle.checked_sub(1).and_then(|c| self.steps.get(&c)).map_or(0.0, |s| s.0);
            self.snapshot_rest = Some(SnapshotRest {
                dt_previous,
                dt: dt_now,
                force_quantum: self.quanta.force,
                vote: vote.clone(),
                walls: self.walls.clone(),
                ledger: self.ledger.clone(),
                rows: self.rows.clone(),
            });
            self.snapshot(actions);
        }
        self.follow_spread(cycle.saturating_sub(1), &vote);
        let growth = self.model.setup.control.growth;
        let (dt, limit, element) = self.limit(&vote, growth * dt_now);
        let time_next = time_now + dt_now;
        let remaining = (self.model.setup.control.end_time - time_next).max(0.0);
        let (dt, limit) = if remaining < dt * 1.000_000_1 { (remaining, Limit::End) } else { (dt, limit) };
        let time_after = if limit == Limit::End { self.model.setup.control.end_time } else { time_next + dt };
        self.steps.insert(cycle + 1, (dt, time_next));
        while self.steps.len() > 4 {
            self.steps.pop_first();
        }
        let coarser = self.rescaled(&vote)?;
        wall::advance(&self.model.setup.walls, &vote.walls, dt_now, &mut self.walls)?;
        let mut orders = self.orders_for(cycle + 1, dt, [time_next, time_after], Some(&vote));
        if let Some(quantum) = coarser {
            self.quanta.force = quantum;
            orders.force_quantum = quantum;
        }
        let exchange = self.exchange_at(cycle)?;
        for worker in 0..self.n_workers {
            let totals = exchange.of_worker(worker, &arrivals.totals);
            let orders = orders.clone();
            actions.push(Action::Send(worker, ToWorker::Totals { cycle, orders, totals }));
        }
        self.retire(cycle);
        if self.sorts_under_way.contains(&cycle)
            && let Some(bench) = &self.bench
        {
            for (worker, gathered) in arrivals.gathered.iter().enumerate() {
                let expected = bench.sorter.n_gathered(worker);
                if gathered.len() != expected {
                    return Err(format!(
                        "worker {worker} gathered {} numbers, expected {expected}",
                        gathered.len()
                    ));
                }
            }
            actions.push(Action::Sort(Arc::clone(bench), bench.sorter.positions(&arrivals.gathered)));
        }
        actions.push(Action::Progress(Progress { cycle, time: time_now, dt: dt_now, element, limit }));
        Ok(())
    }

    /// A sort is done: its plan goes to the workers and acts a lag after the gathering.
    fn sorted(&mut self, sorted: Sorted, actions: &mut Vec<Action>) -> Result<(), String> {
        let gathered_at = self.sorts_under_way.pop_front().ok_or("a sort that nobody asked for")?;
        let acts_at = gathered_at + u64::from(self.model.setup.control.sort_lag);
        self.census = sorted.census;
        for (worker, plan) in sorted.exchange.plans.iter().enumerate() {
            let plan = Box::new(plan.clone());
            actions.push(Action::Send(worker, ToWorker::Plan { acts_at, plan, hash: sorted.exchange.hash }));
        }
        self.exchanges.push_back((acts_at, Arc::new(sorted.exchange)));
        // A late sort: the cycles before its own are complete, and workers wait for the plan. It is in force from here, as
        // it would be had it come in time, so that the cycles of further sorts do not depend on how long this one took.
        if acts_at <= self.completed {
            self.retire(self.completed - 1);
        }
        Ok(())
    }

    fn transfer(
        &mut self,
        worker: usize,
        cycle: u64,
        state: Vec<f64>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let exchange = self
            .exchanges
            .iter()
            .find(|(acts_at, _)| *acts_at == cycle)
            .map(|(_, exchange)| Arc::clone(exchange))
            .ok_or_else(|| format!("worker {worker} transfers nodes at cycle {cycle}, where no plan acts"))?;
        let expected = exchange.n_transfer(worker);
        if state.len() != expected {
            return Err(format!(
                "worker {worker} transfers {} numbers at cycle {cycle}, the plan has {expected}",
                state.len()
            ));
        }
        let n = self.n_workers;
        let sent = self.transfers.entry(cycle).or_insert_with(|| vec![None; n]);
        sent[worker] = Some(state);
        let complete = (0..n).all(|w| sent[w].is_some() || exchange.n_transfer(w) == 0);
        if complete && let Some(sent) = self.transfers.remove(&cycle) {
            let sent: Vec<Vec<f64>> = sent.into_iter().map(Option::unwrap_or_default).collect();
            for w in 0..n {
                let state = exchange.guest_state(w, &sent);
                if !state.is_empty() {
                    actions.push(Action::Send(w, ToWorker::Transfer { cycle, state }));
                }
            }
        }
        Ok(())
    }
}
