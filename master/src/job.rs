//! The job's session on the master: a pure state machine, `apply(event) -> actions`.
//!
//! It decides time steps, sorts, images and the end from the votes of whole cycles, adds partial forces, and keeps the
//! ledger. It knows no socket, clock, disk or thread: those are events and actions.

mod epoch;
mod erosion;
mod images;
mod measure;
mod pace;
mod replay;
mod start;
mod stop;
#[cfg(test)]
mod tests;
mod verdict;

use std::sync::Arc;

use deck::model::Model;
use mechanics::{
    contact::{Census, Surface},
    digest,
    state::GlobalState,
    vote::{Quanta, Vote},
    wall::{self, Pose},
};
use protocol::{
    message::{IMAGE_VERSION, Orders, ToMaster, ToWorker, Work},
    options::Route,
    phase::Report,
};

use crate::{
    event::{Action, Event, Limit, Loss, Outcome, Progress, Rebalance},
    exchange::Exchange,
    holdings::Holdings,
    ledger::Ledger,
    options::SessionOptions,
    results::{history::HistoryRow, surface::Probe},
    sort::{Gathered, Sorted, Sorter},
};
use epoch::{Acting, Base, Epoch, Member, SortUnderWay, Step};
pub use erosion::surface_of;
use measure::{Patience, Proposal};
use start::Touching;
use stop::not_a_number;

/// What sorts work on: fixed for an epoch, but for the surface where elements erode.
pub struct Bench {
    /// Number of the epoch.
    pub epoch: u32,
    /// Surface, settings, speeds.
    pub sorter: Sorter,
    /// Who holds which nodes.
    pub holdings: Arc<Holdings>,
    /// Masses and constraints (positions are those of the epoch's start).
    pub state: Arc<GlobalState>,
    /// Nodes (global, ascending) that leave the run with the plan of the sort.
    pub dropped: Vec<u32>,
}

impl Bench {
    /// Does the sort that [`Action::Sort`] asks for.
    pub fn sort(&self, x: &Gathered) -> Sorted {
        worker::failpoint::die("die-in-sort");
        let mut sorted = self.sorter.run(self.epoch, x, &self.holdings, &self.state);
        if !self.dropped.is_empty() {
            for (worker, plan) in (0..).zip(&mut sorted.exchange.plans) {
                plan.dropped =
                    self.dropped.iter().copied().filter(|&node| self.holdings.holds(worker, node)).collect();
            }
        }
        sorted
    }

    /// The same with another surface.
    fn with_surface(&self, surface: Arc<Surface>, dropped: Vec<u32>) -> Self {
        Self {
            epoch: self.epoch,
            sorter: self.sorter.with_surface(surface),
            holdings: Arc::clone(&self.holdings),
            state: Arc::clone(&self.state),
            dropped,
        }
    }
}

/// Share of the allowed time step that a run begins with where bodies hold energy. Where a gas meets a thinner one, the
/// first steps raise velocities from nothing, and viscosity with them, before a vote can tell.
const START: f64 = 0.2;

/// Share of the time step that `vote`, of the time before the first cycle, allows.
fn first_share(vote: &Vote) -> f64 {
    if vote.parts.iter().any(|part| part.internal > 0.0) { START } else { 1.0 }
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
    options: SessionOptions,
    /// Those of the start; the quantum of forces may grow with the epoch.
    quanta: Quanta,
    /// None without contact.
    touching: Option<Touching>,
    /// In the order they came: the indices of events and actions.
    members: Vec<Member>,
    epoch: Epoch,
    /// Where the next epoch begins if a worker is lost or wrong: where samples are computed again, all that led here
    /// agreed.
    base: Arc<Base>,
    /// The time for a new base has come.
    keep_due: bool,
    /// No state is kept to go back to.
    lean: bool,
    first_cycle: u64,
    lanes: String,
    stop_asked: bool,
    /// This process has to leave.
    leaves: bool,
    /// Workers that failed by themselves: member, cycle and why.
    blamed: Vec<(usize, u64, String)>,
    failure: Option<String>,
    /// Speeds that the next epoch is to begin with.
    proposal: Option<Proposal>,
    patience: Patience,
    ledger: Ledger,
    /// Poses of the walls of finite mass in the newest cycle that was ordered.
    walls: Vec<Pose>,
    rows: Vec<Arc<HistoryRow>>,
    sorts: u64,
    census: Census,
    /// By member.
    work: Vec<Work>,
    /// By member, of its last stop.
    reports: Vec<Report>,
    imbalance: f64,
    rebalances: Vec<Rebalance>,
    losses: Vec<Loss>,
    over: bool,
    /// See [`Job::plant_unfenced`].
    unfenced: bool,
}

impl Job {
    /// Plants a bug: messages of epochs that are over are taken as if they were of now. For the test that shows that the
    /// seeded simulator finds such a bug.
    #[doc(hidden)]
    pub fn plant_unfenced(&mut self) {
        self.unfenced = true;
    }

    /// The state the run starts from.
    pub fn start_state(&self) -> &GlobalState {
        &self.base.state
    }

    /// Rows of history that a snapshot brought along.
    pub fn rows_before(&self) -> &[Arc<HistoryRow>] {
        &self.rows
    }

    /// Surface of the problem; none without contact.
    pub fn surface(&self) -> Option<&Surface> {
        self.epoch.bench.as_ref().map(|bench| bench.sorter.surface())
    }

    /// What computes contact again from a state; none without contact.
    pub fn probe(&self) -> Option<Probe> {
        let (touching, settings) = self.touching.as_ref().zip(self.model.setup.contact.clone())?;
        let (surface, exclusions) = touching.parts();
        Some(Probe { surface, settings, exclusions, quantum: self.quanta.force })
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
        self.over
    }

    /// How often it was dealt out anew.
    pub fn epoch(&self) -> u32 {
        self.epoch.number
    }

    /// Workers of the present epoch, in the order by which peers and plans name them.
    pub fn crew(&self) -> &[usize] {
        &self.epoch.crew
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
            Event::Message(member, epoch, message) => self.receive(member, epoch, message, &mut actions),
            Event::Sorted(sorted) => self.sorted(*sorted, &mut actions),
            Event::Stop => {
                self.stop_asked = true;
                if self.epoch.crew.is_empty() { self.finish_at_base(&mut actions) } else { Ok(()) }
            }
            Event::Suspend => {
                self.leaves = true;
                if self.epoch.crew.is_empty() {
                    self.suspend_at_base(&mut actions);
                }
                Ok(())
            }
            Event::Lost(member, why) => self.lost(member, why, &mut actions),
            Event::Joined(hand) => self.joined(hand, &mut actions),
            Event::Timer => {
                self.keep_due = true;
                Ok(())
            }
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
        let failed = self.failure.is_some();
        self.send_all(actions, |_| ToWorker::Release);
        let digest = state.as_ref().map(digest::digest).unwrap_or_default();
        let cycles_run = state.as_ref().map_or(self.epoch.completed, |s| s.cycle) - self.first_cycle;
        actions.push(Action::Over(Box::new(Outcome {
            failure: self.failure.take(),
            stopped: self.stop_asked,
            suspended: self.leaves && state.is_none() && !failed,
            state,
            digest,
            ledger: self.ledger.clone(),
            sorts: self.sorts,
            census: self.census,
            work: self.work.clone(),
            reports: self
                .epoch
                .crew
                .iter()
                .map(|&m| self.reports.get(m).cloned().unwrap_or_default())
                .collect(),
            imbalance: self.imbalance,
            lanes: self.lanes.clone(),
            route: self.options.route().name(),
            cycles_run,
            workers: self.epoch.crew.iter().map(|&m| self.members[m].hand.name.clone()).collect(),
            rebalances: std::mem::take(&mut self.rebalances),
            losses: std::mem::take(&mut self.losses),
        })));
    }

    /// Frames of an older epoch say nothing any more; those of a later one nobody can have sent.
    fn receive(
        &mut self,
        member: usize,
        epoch: u32,
        message: ToMaster,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let epoch = if self.unfenced { epoch.max(self.epoch.number) } else { epoch };
        if epoch < self.epoch.number {
            return Ok(());
        }
        match self.epoch.crew.iter().position(|&m| m == member) {
            Some(worker) if epoch == self.epoch.number => self.hear(worker, message, actions),
            _ => Err(format!(
                "worker {member} sends a message of epoch {epoch}, which it was not dealt; this is epoch {}",
                self.epoch.number
            )),
        }
    }

    /// From here on a worker is its position in the epoch's crew.
    fn hear(&mut self, worker: usize, message: ToMaster, actions: &mut Vec<Action>) -> Result<(), String> {
        match message {
            ToMaster::Ready { vote, lanes } => self.ready(worker, vote, lanes, actions),
            ToMaster::Cycle { cycle, vote, partials, gathered, busy } => {
                self.epoch.meter.note(worker, busy);
                self.arrived(worker, cycle, vote, &partials, gathered, actions)
            }
            ToMaster::Relay { to, message } => {
                let Some(&member) = self.epoch.crew.get(to as usize) else {
                    return Err(format!(
                        "worker {worker} writes to worker {to}, there are {}",
                        self.epoch.n()
                    ));
                };
                actions.push(Action::Send(member, ToWorker::Relayed { from: worker as u32, message }));
                Ok(())
            }
            ToMaster::Report(report) => {
                report.check(self.epoch.n()).map_err(|error| format!("worker {worker}: {error}"))?;
                let member = self.epoch.crew[worker];
                self.reports.resize(self.members.len(), Report::default());
                self.reports[member] = *report;
                Ok(())
            }
            ToMaster::Transfer { cycle, state } => self.transfer(worker, cycle, state, actions),
            ToMaster::Image { cycle, version, pieces, last, work } => {
                if version != IMAGE_VERSION {
                    return Err(format!(
                        "worker {worker} sends images of version {version}, this master reads {IMAGE_VERSION}"
                    ));
                }
                let member = self.epoch.crew[worker];
                self.work.resize(self.members.len(), Work::default());
                self.work[member] = work;
                self.image(worker, cycle, pieces, last, actions)
            }
            ToMaster::Sample { cycle, hash } => self.sampled(worker, cycle, hash, actions),
            ToMaster::Failed { cycle, reason } => self.blame(worker, cycle, reason, actions),
            ToMaster::Leaving => {
                let member = self.epoch.crew[worker];
                self.members[member].leaves = true;
                Ok(())
            }
        }
    }

    fn ready(
        &mut self,
        worker: usize,
        vote: Option<Box<Vote>>,
        lanes: String,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let epoch = &mut self.epoch;
        if epoch.running || std::mem::replace(&mut epoch.ready[worker], true) {
            return Err(format!("worker {worker} is ready twice"));
        }
        if !self.lanes.split('+').any(|l| l == lanes) {
            self.lanes = if self.lanes.is_empty() { lanes } else { format!("{}+{lanes}", self.lanes) };
        }
        if let Some(vote) = vote {
            match &mut epoch.vote_before {
                Some(merged) => merged.merge(&vote),
                None => epoch.vote_before = Some(*vote),
            }
        }
        if epoch.ready.iter().all(|r| *r) {
            epoch.running = true;
            self.start(actions)?;
        }
        Ok(())
    }

    /// Orders for the first cycle of an epoch and the one after.
    fn start(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        let first = self.epoch.first_cycle;
        let control = self.model.setup.control;
        let vote = self.epoch.vote_before.as_ref().ok_or("no worker voted")?;
        if !self.epoch.steps.contains_key(&first) {
            if let Some((element, volume)) = vote.fault {
                return Err(self.element_fault(element, volume, 0));
            }
            let time = self.base.state.time;
            let (dt, _, _) = self.limit(vote, f64::INFINITY);
            let dt = (first_share(vote) * dt).min(control.end_time - time).max(0.0);
            self.epoch.steps.insert(first, Step { dt, time, quantum: self.epoch.quantum });
        }
        let Step { dt, time, quantum } = self.epoch.steps[&first];
        let at_end = time >= control.end_time || first >= control.end_cycle;
        let store = self.options.asked.snapshot_at == Some(first) && self.epoch.number == 0;
        let blocking = !at_end && self.surface_changes_at(first);
        if blocking {
            self.gather_at(first, true);
        }
        let before = Orders {
            next: first.wrapping_sub(1),
            dt: 0.0,
            time,
            walls: self.walls.clone(),
            force_quantum: quantum,
            gather: blocking,
            blocking,
            collect: store || at_end,
            stop: at_end,
            sample: self.options.replay && !at_end,
        };
        if before.collect {
            self.epoch.image_times.insert(first, (time, false));
        }
        if at_end {
            self.epoch.stop_at = Some(first);
        } else if store {
            self.epoch.halves.entry(first).or_default();
        }
        let orders = self.orders_for(first, dt, [time, time + dt], None, actions);
        self.send_all(actions, |_| ToWorker::Start { orders: [before.clone(), orders.clone()] });
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
        if !self.epoch.running {
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
        // Workers look at their forces before they send them; a master does not rely on it.
        let looked_at = if self.options.replay { partials } else { &[] };
        if let Some(what) = not_a_number(vote.as_deref(), looked_at) {
            return self.blame(worker, cycle, what, actions);
        }
        let n = self.epoch.n();
        let arrivals = self.epoch.arrivals.entry(cycle).or_insert_with(|| Arrivals {
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
            && let Some(arrivals) = self.epoch.arrivals.remove(&cycle)
        {
            self.complete(cycle, arrivals, actions)?;
        }
        Ok(())
    }

    /// The exchange in force at a cycle. A worker that shares nothing may be a cycle ahead of the others, so two can be
    /// in use at once.
    fn exchange_at(&self, cycle: u64) -> Result<Arc<Exchange>, String> {
        let found = self.epoch.exchanges.iter().rev().find(|acting| acting.at <= cycle);
        found.map(|acting| Arc::clone(&acting.exchange)).ok_or_else(|| format!("no plan for cycle {cycle}"))
    }

    /// No frame of `cycle` or before will come any more.
    fn retire(&mut self, cycle: u64) {
        let epoch = &mut self.epoch;
        epoch.completed = cycle + 1;
        while let Some(acts_at) = epoch.exchanges.get(1).map(|acting| acting.at).filter(|at| *at <= cycle + 1)
        {
            epoch.exchanges.pop_front();
            let gathered = epoch.exchanges.front().map_or(acts_at, |acting| acting.gathered);
            epoch.references = [(acts_at, gathered), epoch.references[0]];
            self.sorts += 1;
        }
    }

    /// Every worker's frame of `cycle` is here: totals and orders go out, the vote of the cycle before is booked.
    fn complete(&mut self, cycle: u64, arrivals: Arrivals, actions: &mut Vec<Action>) -> Result<(), String> {
        let (vote, fresh) = match arrivals.vote {
            Some(vote) => {
                self.book(cycle - 1, &vote, actions);
                (vote, true)
            }
            None => (self.epoch.vote_before.clone().ok_or("a cycle without a vote")?, cycle == 0),
        };
        let now = *self.epoch.steps.get(&cycle).ok_or_else(|| format!("cycle {cycle} was not ordered"))?;
        if fresh {
            self.follow_spread(cycle.saturating_sub(1), &vote);
            if let (Some(eroded), Some(before)) = (&mut self.epoch.eroded, cycle.checked_sub(1)) {
                eroded.note(before, &vote.eroded)?;
            }
        }
        if self.epoch.halves.contains_key(&cycle) {
            let rest = self.rest_at(cycle, vote.clone())?;
            self.epoch.halves.entry(cycle).or_default().rest = Some(rest);
            self.complete_base(cycle, actions)?;
        }
        let control = self.model.setup.control;
        let (dt, limit, element) = self.limit(&vote, control.growth * now.dt);
        let time_next = now.time + now.dt;
        let remaining = (control.end_time - time_next).max(0.0);
        let (dt, limit) = if remaining < dt * 1.000_000_1 { (remaining, Limit::End) } else { (dt, limit) };
        self.check_floor(cycle + 1, dt, limit, element);
        let time_after = if limit == Limit::End { control.end_time } else { time_next + dt };
        self.epoch.steps.insert(cycle + 1, Step { dt, time: time_next, quantum: self.epoch.quantum });
        while self.epoch.steps.len() > 4 {
            self.epoch.steps.pop_first();
        }
        if let Some(coarser) = self.rescaled(&vote)? {
            self.epoch.quantum = coarser;
        }
        wall::advance(&self.model.setup.walls, &vote.walls, now.dt, &mut self.walls)?;
        let orders = self.orders_for(cycle + 1, dt, [time_next, time_after], Some(&vote), actions);
        let exchange = self.exchange_at(cycle)?;
        self.send_all(actions, |worker| {
            let totals = exchange.of_worker(worker, &arrivals.totals);
            ToWorker::Totals { cycle, orders: orders.clone(), totals }
        });
        self.retire(cycle);
        let sort = self.epoch.sorts_under_way.iter().find(|sort| sort.gathered == cycle);
        if let Some(blocking) = sort.map(|sort| sort.blocking)
            && let Some(bench) = self.bench_for(cycle, blocking)
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
            let x = bench.sorter.positions(&arrivals.gathered);
            actions.push(Action::Sort(bench, Gathered { cycle, x }));
        }
        actions.push(Action::Progress(Progress { cycle, time: now.time, dt: now.dt, element, limit }));
        Ok(())
    }

    /// A sort is done: its plan goes to the workers and acts a lag after the gathering. One of an older epoch is of no
    /// use any more.
    fn sorted(&mut self, sorted: Sorted, actions: &mut Vec<Action>) -> Result<(), String> {
        if sorted.epoch < self.epoch.number {
            return Ok(());
        }
        let gathered = sorted.gathered;
        match self.epoch.sorts_under_way.iter_mut().find(|sort| sort.gathered == gathered) {
            Some(sort) if sort.done.is_none() => sort.done = Some(sorted),
            // A blocking one has taken its place since it was begun.
            None if gathered < self.epoch.last_gather => return Ok(()),
            _ => return Err(format!("a sort of cycle {gathered} that nobody asked for")),
        }
        // Plans act in the order of their gatherings, whichever sort is done first.
        while self.epoch.sorts_under_way.front().is_some_and(|sort| sort.done.is_some()) {
            if let Some(sort) = self.epoch.sorts_under_way.pop_front() {
                self.plan(sort, actions);
            }
        }
        Ok(())
    }

    /// The plan of a sort that is done goes out.
    fn plan(&mut self, sort: SortUnderWay, actions: &mut Vec<Action>) {
        let SortUnderWay { gathered: gathered_at, acts_at, done, .. } = sort;
        let Some(sorted) = done else { return };
        self.census = sorted.census;
        let exchange = Arc::new(sorted.exchange);
        self.send_all(actions, |worker| {
            let plan = Box::new(exchange.plans[worker].clone());
            ToWorker::Plan { gathered_at, acts_at, plan, hash: exchange.hash }
        });
        self.epoch.exchanges.push_back(Acting { at: acts_at, gathered: gathered_at, exchange });
        // A late sort: the cycles before its own are complete, and workers wait for the plan. It is in force from here, as
        // it would be had it come in time, so that the cycles of further sorts do not depend on how long this one took.
        if acts_at <= self.epoch.completed {
            self.retire(self.epoch.completed - 1);
        }
    }

    fn transfer(
        &mut self,
        worker: usize,
        cycle: u64,
        state: Vec<f64>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let acting = self.epoch.exchanges.iter().find(|acting| acting.at == cycle);
        let exchange = acting
            .map(|acting| Arc::clone(&acting.exchange))
            .ok_or_else(|| format!("worker {worker} transfers nodes at cycle {cycle}, where no plan acts"))?;
        let expected = exchange.n_transfer(worker);
        if state.len() != expected {
            return Err(format!(
                "worker {worker} transfers {} numbers at cycle {cycle}, the plan has {expected}",
                state.len()
            ));
        }
        let n = self.epoch.n();
        let sent = self.epoch.transfers.entry(cycle).or_insert_with(|| vec![None; n]);
        sent[worker] = Some(state);
        let complete = (0..n).all(|w| sent[w].is_some() || exchange.n_transfer(w) == 0);
        if complete && let Some(sent) = self.epoch.transfers.remove(&cycle) {
            let sent: Vec<Vec<f64>> = sent.into_iter().map(Option::unwrap_or_default).collect();
            for (w, &member) in self.epoch.crew.iter().enumerate() {
                let state = exchange.guest_state(w, &sent);
                if !state.is_empty() {
                    actions.push(Action::Send(member, ToWorker::Transfer { cycle, state }));
                }
            }
        }
        Ok(())
    }
}
