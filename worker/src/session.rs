//! The worker's session: a pure state machine, `apply(event) -> actions`.
//!
//! It knows no socket, clock or thread. Computation is an action whose outcome comes back as an event; at most one
//! is under way. An assignment of a later epoch replaces the one in hand at any time: the outcome of the task under way
//! is then thrown away, and the new domain is built when it has come. The steps of a cycle, in order: states if ordered; at a plan boundary transfer, all elements, install;
//! else contact and border; send; interior; a sample if ordered; totals; integrate.

mod boundary;
mod event;
mod sharing;
mod sorts;
mod totals;
mod tree;

use std::collections::{BTreeMap, VecDeque};

use mechanics::{cycle::Neighbour, exact::Quanta, piece::Piece, vote::Vote};
use protocol::{
    message::{Assign, Orders, ToMaster, ToWorker, WORKER_STATE_VERSION, at_once},
    options::Route,
};

use boundary::Coming;
pub use event::{Action, Event, Outcome, Task, Wanted};
use sorts::Sorts;
use totals::all_finite;
use tree::Branch;

/// Where a session stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// No job.
    Idle,
    /// Building the domain.
    Loading,
    /// Waiting for `Start`.
    Ready,
    /// Computing states at the start of the cycle; more of the cycle follows unless it is the last.
    SendingState,
    /// At a plan boundary: packing the transfer.
    Packing,
    /// At a plan boundary: all elements.
    Elements,
    /// At a plan boundary: waiting for the plan or the ghosts.
    AwaitGhosts,
    /// Contact and border, or install and contact.
    Border,
    /// Interior elements.
    Interior,
    /// Waiting for totals or orders.
    AwaitTotals,
    /// Spreading or sorting what it holds of the surface.
    Sorting {
        /// While a plan is awaited; else while totals or orders are.
        at_boundary: bool,
    },
    /// Hashing a sample, with all elements done.
    Sampling,
    /// After the last state: computing the elements of the cycle that will not be, for a sample of them.
    Proving,
    Integrating,
    /// Failed or finished; only `Release` or `Assign` is heard.
    Over,
}

/// Most cycles whose totals may wait here.
const MAX_BUFFERED: usize = 2;

/// The position of a worker that has sent what others need of a cycle, see [`ToMaster::At`].
const fn position_after(cycle: u64) -> u64 {
    cycle.saturating_add(2)
}

/// Gives the sub-domains of an assignment the pieces that have come.
fn fill(assign: &mut Assign, pieces: Vec<(u32, Piece)>) -> Result<(), String> {
    let mut place = 0;
    for (id, piece) in pieces {
        if assign.subdomains.get(place).is_none_or(|subdomain| subdomain.id != id) {
            let found = assign.subdomains.iter().position(|subdomain| subdomain.id == id);
            place = found.ok_or_else(|| {
                format!("a piece of sub-domain {id}, the assignment has none of that number")
            })?;
        }
        assign.subdomains[place].pieces.push(piece);
    }
    let found = assign.subdomains.iter().map(|subdomain| subdomain.pieces.len() as u32);
    if !found.clone().eq(assign.n_pieces.iter().copied()) {
        let found: Vec<u32> = found.collect();
        return Err(format!("{found:?} pieces by sub-domain, the assignment says {:?}", assign.n_pieces));
    }
    Ok(())
}

/// The state of a worker's part in one job.
#[derive(Debug)]
pub struct Session {
    phase: Phase,
    epoch: u32,
    /// A task is under way.
    busy: bool,
    /// Its outcome is of an epoch or a job that is over.
    outdated: bool,
    /// What is held is to be forgotten once the task is done: the job is over.
    released: bool,
    /// An assignment that waits for that task's end.
    next: Option<Box<Assign>>,
    /// Pieces of an assignment to come, with the number of their sub-domain, and its epoch.
    coming: (u32, Vec<(u32, Piece)>),
    cycle: u64,
    first_cycle: u64,
    sort_lag: u64,
    dt_previous: f64,
    dt: f64,
    /// Orders by the cycle whose step they give.
    orders: BTreeMap<u64, Orders>,
    totals: VecDeque<(u64, Vec<f64>)>,
    /// Cycles of gatherings and at which their plans act, and the plans that have come.
    boundaries: VecDeque<(u64, u64)>,
    plans: VecDeque<Coming>,
    /// State of ghosts that has come from the master, or on route direct from their owners, by (cycle, worker).
    ghosts: Option<(u64, Vec<f64>)>,
    ghosts_heard: BTreeMap<(u64, u32), Vec<f64>>,
    n_exchange: usize,
    route: Route,
    neighbours: Vec<Neighbour>,
    /// Numbers by node of the exchange.
    stride: usize,
    /// On route direct: own partial forces of this cycle, and what neighbours sent, by (cycle, worker).
    partials: Vec<f64>,
    heard: BTreeMap<(u64, u32), Vec<f64>>,
    plan_hash: u64,
    /// Where votes and orders travel by a tree.
    branch: Option<Branch>,
    /// Where this worker sorts what it holds.
    sorts: Option<Sorts>,
    vote: Option<Box<Vote>>,
    resumed: bool,
    state_sent: bool,
    /// This cycle's sample is still to be sent.
    sample_due: bool,
    /// The interior was computed with the border: at a plan boundary.
    whole: bool,
}

impl Default for Session {
    fn default() -> Self {
        Self::new()
    }
}

impl Session {
    /// A session without a job.
    pub fn new() -> Self {
        Self {
            phase: Phase::Idle,
            epoch: 0,
            busy: false,
            outdated: false,
            released: false,
            next: None,
            coming: (0, Vec::new()),
            cycle: 0,
            first_cycle: 0,
            sort_lag: 0,
            dt_previous: 0.0,
            dt: 0.0,
            orders: BTreeMap::new(),
            totals: VecDeque::new(),
            boundaries: VecDeque::new(),
            plans: VecDeque::new(),
            ghosts: None,
            ghosts_heard: BTreeMap::new(),
            n_exchange: 0,
            route: Route::Master,
            neighbours: Vec::new(),
            stride: 3,
            partials: Vec::new(),
            heard: BTreeMap::new(),
            plan_hash: 0,
            branch: None,
            sorts: None,
            vote: None,
            resumed: false,
            state_sent: false,
            sample_due: false,
            whole: false,
        }
    }

    /// Whether it has no job.
    pub fn is_idle(&self) -> bool {
        self.phase == Phase::Idle
    }

    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// The epoch of the assignment in hand; every frame carries it.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// How far it has come, as [`ToMaster::At`] counts it.
    fn position(&self) -> u64 {
        match self.phase {
            Phase::Idle | Phase::Loading => 0,
            Phase::Ready => 1,
            Phase::Interior
            | Phase::AwaitTotals
            | Phase::Sorting { at_boundary: false }
            | Phase::Sampling
            | Phase::Integrating
            | Phase::Over => position_after(self.cycle),
            _ => self.cycle + 1,
        }
    }

    /// Hash of the plan in force; every frame of a cycle carries it.
    pub fn plan_hash(&self) -> u64 {
        self.plan_hash
    }

    /// Hash of the plan that acts at a cycle, this one or a later one; none while that plan has not come.
    pub fn plan_at(&self, cycle: u64) -> Option<u64> {
        match self.boundaries.iter().rev().find(|(_, acts_at)| *acts_at <= cycle) {
            None => Some(self.plan_hash),
            Some((_, boundary)) => {
                self.plans.iter().find(|plan| plan.acts_at == *boundary).map(|plan| plan.hash)
            }
        }
    }

    /// Takes an event, says what to do.
    pub fn apply(&mut self, event: Event) -> Vec<Action> {
        let mut actions = Vec::new();
        if matches!(event, Event::Done(_)) {
            self.busy = false;
            if std::mem::take(&mut self.outdated) {
                self.after_outdated(&mut actions);
                return actions;
            }
        }
        if let Err(reason) = self.step(event, &mut actions) {
            self.fail(reason, &mut actions);
        }
        self.busy |= actions.iter().any(|action| matches!(action, Action::Compute(_)));
        actions
    }

    /// The task of an epoch or a job that is over has come to its end.
    fn after_outdated(&mut self, actions: &mut Vec<Action>) {
        if std::mem::take(&mut self.released) {
            actions.push(Action::Forget);
        }
        self.next.take().into_iter().for_each(|assign| self.load(assign, actions));
    }

    /// Passes an assignment of this epoch, or pieces of it, if it may come now.
    fn expect(&self, epoch: u32) -> Result<(), String> {
        let free = matches!(self.phase, Phase::Idle | Phase::Over);
        if free || epoch > self.epoch {
            return Ok(());
        }
        Err(format!(
            "an assignment of epoch {epoch} while {:?} in epoch {}: a job is in hand",
            self.phase, self.epoch
        ))
    }

    /// Drops all of the job in hand; a task under way goes on, for nothing.
    fn clear(&mut self) {
        let outdated = self.busy || self.outdated;
        *self = Self { busy: self.busy, outdated, released: self.released, ..Self::new() };
    }

    /// Begins an epoch.
    fn load(&mut self, assign: Box<Assign>, actions: &mut Vec<Action>) {
        let prepare = !self.resumed;
        self.busy = true;
        actions.push(Action::Compute(Task::Load { assign, prepare }));
    }

    fn fail(&mut self, reason: String, actions: &mut Vec<Action>) {
        self.phase = Phase::Over;
        actions.push(Action::Send(ToMaster::Failed { cycle: self.cycle, reason }));
    }

    fn step(&mut self, event: Event, actions: &mut Vec<Action>) -> Result<(), String> {
        match event {
            Event::Message(ToWorker::Relayed { from, message }) => self.hear_peer(from, message, actions),
            Event::Message(message) => self.hear(message, actions),
            Event::Peer(from, message) => self.hear_peer(from, message, actions),
            Event::Done(Outcome::Failed(reason)) => Err(reason),
            Event::Done(outcome) => self.done(outcome, actions),
        }
    }

    fn hear(&mut self, message: ToWorker, actions: &mut Vec<Action>) -> Result<(), String> {
        match message {
            ToWorker::Release => {
                self.clear();
                self.released = self.busy;
                if !self.released {
                    actions.push(Action::Forget);
                }
                Ok(())
            }
            ToWorker::Pieces { epoch, pieces } => {
                self.expect(epoch)?;
                if self.coming.0 != epoch {
                    self.coming = (epoch, Vec::new());
                }
                self.coming.1.extend(pieces);
                Ok(())
            }
            ToWorker::Assign(mut assign) => {
                self.expect(assign.epoch)?;
                let (epoch, pieces) = std::mem::take(&mut self.coming);
                let pieces = if epoch == assign.epoch { pieces } else { Vec::new() };
                fill(&mut assign, pieces)?;
                self.clear();
                self.phase = Phase::Loading;
                self.epoch = assign.epoch;
                self.cycle = assign.cycle;
                self.first_cycle = assign.cycle;
                self.dt_previous = assign.dt_previous;
                self.sort_lag = u64::from(assign.setup.control.sort_lag);
                self.n_exchange = assign.plan.exchange.len();
                self.route = assign.route;
                self.neighbours.clone_from(&assign.plan.neighbours);
                self.stride = assign.plan.stride();
                self.plan_hash = assign.plan_hash;
                let n_parts = assign.n_parts as usize;
                self.branch = assign.tree.clone().map(|place| Branch::new(place, n_parts));
                let sorts = assign.sorting.as_ref().map(|sorting| Sorts::new(n_parts, sorting));
                self.sorts = sorts.transpose()?;
                self.resumed = assign.cycle > 0;
                if self.busy {
                    self.next = Some(assign);
                } else {
                    self.load(assign, actions);
                }
                Ok(())
            }
            ToWorker::Where => {
                actions.push(Action::Send(ToMaster::At { position: self.position() }));
                Ok(())
            }
            _ if self.phase == Phase::Over || self.phase == Phase::Idle => Ok(()),
            ToWorker::Relayed { from, message } => self.hear_peer(from, message, actions),
            // Links and threads are the runtime's affair.
            ToWorker::Peers(_) | ToWorker::Threads { .. } => Ok(()),
            ToWorker::Start { orders } => {
                for order in orders {
                    self.orders.insert(order.next, order);
                }
                match self.phase {
                    Phase::Ready => self.begin_cycle(actions),
                    phase => Err(format!("start while {phase:?}, expected Ready")),
                }
            }
            // Its gathering was replaced while it was on its way.
            ToWorker::Plan { gathered_at, acts_at, .. }
                if !self.boundaries.contains(&(gathered_at, acts_at)) =>
            {
                Ok(())
            }
            ToWorker::Plan { gathered_at, acts_at, mut plan, hash, around } => {
                if let Some(sorts) = &mut self.sorts {
                    sorts.complete(gathered_at, &mut plan)?;
                }
                if self.plans.len() as u64 > self.sort_lag + 1 {
                    return Err(format!("plan for cycle {acts_at} while {} others wait", self.plans.len()));
                }
                self.plans.push_back(Coming { gathered_at, acts_at, hash, plan, around });
                self.resume_waiting(actions)
            }
            ToWorker::Transfer { cycle, state } => {
                self.ghosts = Some((cycle, state));
                self.resume_waiting(actions)
            }
            ToWorker::Totals { cycle, orders, totals } => {
                if self.totals.len() >= MAX_BUFFERED {
                    return Err(format!(
                        "totals of cycle {cycle} while {} cycles wait, at most {MAX_BUFFERED}",
                        self.totals.len()
                    ));
                }
                self.take_orders(cycle, orders, actions);
                if !totals.is_empty() {
                    self.totals.push_back((cycle, totals));
                }
                self.resume_waiting(actions)
            }
        }
    }

    fn after_sorting(&mut self, at_boundary: bool, actions: &mut Vec<Action>) -> Result<(), String> {
        self.phase = if at_boundary { Phase::AwaitGhosts } else { Phase::AwaitTotals };
        self.resume_waiting(actions)
    }

    fn resume_waiting(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        match self.phase {
            Phase::AwaitGhosts => self.try_boundary(actions),
            Phase::AwaitTotals => self.try_integrate(actions),
            _ => Ok(()),
        }
    }

    fn done(&mut self, outcome: Outcome, actions: &mut Vec<Action>) -> Result<(), String> {
        match (self.phase, outcome) {
            (Phase::Over | Phase::Idle, _) => Ok(()),
            (Phase::Loading, Outcome::Loaded { vote, lanes }) => {
                self.phase = Phase::Ready;
                actions.push(Action::Send(ToMaster::Ready { vote, lanes }));
                Ok(())
            }
            (Phase::SendingState, Outcome::WorkerState { pieces, work }) => {
                let stop = self.flags()?.stop;
                let last = if stop {
                    Some(self.vote.take().unwrap_or_else(|| Box::new(Vote::empty(0))))
                } else {
                    None
                };
                let (cycle, version) = (self.cycle, WORKER_STATE_VERSION);
                for pieces in at_once(pieces, |piece| piece.elements.len()) {
                    actions.push(Action::Send(ToMaster::Pieces { cycle, version, pieces }));
                }
                actions.push(Action::Send(ToMaster::WorkerState { cycle, last, work }));
                if stop && self.sample_due {
                    self.phase = Phase::Proving;
                    let (quanta, time) = self.quanta_and_time()?;
                    let (dt_previous, gather, blocking) = (self.dt_previous, false, false);
                    actions.push(Action::Compute(Task::Border {
                        dt_previous,
                        quanta,
                        time,
                        gather,
                        blocking,
                    }));
                    return Ok(());
                }
                if stop {
                    self.phase = Phase::Over;
                    return Ok(());
                }
                self.state_sent = true;
                self.begin_cycle(actions)
            }
            (Phase::Packing, Outcome::Transferred(state)) => {
                all_finite("position or velocity", &state)?;
                self.hand_over(state, actions)?;
                self.phase = Phase::Elements;
                let (quanta, time) = self.quanta_and_time()?;
                let dt_previous = self.dt_previous;
                actions.push(Action::Compute(Task::Elements { dt_previous, quanta, time }));
                Ok(())
            }
            (Phase::Elements, Outcome::Computed) => {
                self.phase = Phase::AwaitGhosts;
                self.whole = true;
                self.try_boundary(actions)
            }
            (Phase::Border, Outcome::Forces { partials, gathered }) => {
                all_finite("partial force", &partials)?;
                self.send_forces(partials, gathered, actions)?;
                if std::mem::take(&mut self.whole) {
                    self.phase = Phase::AwaitTotals;
                    return self.try_integrate(actions);
                }
                self.phase = Phase::Interior;
                actions.push(Action::Compute(Task::Interior { dt_previous: self.dt_previous }));
                Ok(())
            }
            (Phase::Interior, Outcome::Computed) => {
                self.phase = Phase::AwaitTotals;
                self.try_integrate(actions)
            }
            (Phase::Sampling, Outcome::Sampled(hash)) => {
                actions.push(Action::Send(ToMaster::Sample { cycle: self.cycle, hash }));
                self.sample_due = false;
                self.phase = Phase::AwaitTotals;
                self.try_integrate(actions)
            }
            (Phase::Sorting { at_boundary }, Outcome::Spread(patches)) => {
                self.spread(patches, actions);
                self.after_sorting(at_boundary, actions)
            }
            (Phase::Sorting { at_boundary }, Outcome::Sorted { gathered_at, sorted, wants }) => {
                self.want(gathered_at, sorted, wants, actions);
                self.after_sorting(at_boundary, actions)
            }
            (Phase::Proving, Outcome::Forces { .. }) => {
                actions.push(Action::Compute(Task::Interior { dt_previous: self.dt_previous }));
                Ok(())
            }
            (Phase::Proving, Outcome::Computed) => {
                actions.push(Action::Compute(Task::Sample { cycle: self.cycle }));
                Ok(())
            }
            (Phase::Proving, Outcome::Sampled(hash)) => {
                actions.push(Action::Send(ToMaster::Sample { cycle: self.cycle, hash }));
                self.phase = Phase::Over;
                Ok(())
            }
            (Phase::Integrating, Outcome::Integrated(vote)) => {
                self.vote = Some(vote);
                self.dt_previous = self.dt;
                self.cycle += 1;
                self.state_sent = false;
                self.begin_cycle(actions)
            }
            (phase, outcome) => Err(format!("outcome {outcome:?} while {phase:?}")),
        }
    }

    /// The orders whose flags act at the start of this cycle.
    fn flags(&self) -> Result<&Orders, String> {
        let before = self.cycle.wrapping_sub(1);
        self.orders.get(&before).ok_or_else(|| format!("no orders for the start of cycle {}", self.cycle))
    }

    /// The quanta of the sums of this cycle, and when it begins.
    fn quanta_and_time(&self) -> Result<(Quanta, f64), String> {
        let before = self.flags()?;
        Ok((before.quanta, before.time + before.dt))
    }

    fn begin_cycle(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        let Orders { stop, collect, gather, blocking, sample, .. } = *self.flags()?;
        self.sample_due = sample;
        while let Some(entry) = self.orders.first_entry()
            && entry.key().wrapping_add(1) < self.cycle
        {
            entry.remove();
        }
        if (stop || collect) && !self.state_sent {
            self.phase = Phase::SendingState;
            actions.push(Action::Compute(Task::WorkerState { last: stop && !sample }));
            return Ok(());
        }
        if gather {
            let mut acts_at = self.cycle + self.sort_lag;
            if blocking {
                acts_at = self.cycle + 1;
                self.boundaries.retain(|(_, at)| *at <= self.cycle);
                self.plans.retain(|plan| plan.acts_at <= self.cycle);
            }
            self.boundaries.push_back((self.cycle, acts_at));
            self.sorts.iter_mut().for_each(Sorts::gather);
        }
        if self.boundaries.front().is_some_and(|(_, at)| *at == self.cycle) {
            self.phase = Phase::AwaitGhosts;
            self.whole = false;
            return self.try_boundary(actions);
        }
        self.phase = Phase::Border;
        let (quanta, time) = self.quanta_and_time()?;
        let dt_previous = self.dt_previous;
        actions.push(Action::Compute(Task::Border { dt_previous, quanta, time, gather, blocking }));
        Ok(())
    }

    /// A worker that shares no node needs only the orders of the cycle before.
    fn try_integrate(&mut self, actions: &mut Vec<Action>) -> Result<(), String> {
        if self.sample_due {
            self.phase = Phase::Sampling;
            actions.push(Action::Compute(Task::Sample { cycle: self.cycle }));
            return Ok(());
        }
        if self.sort(false, actions) {
            return Ok(());
        }
        let Some(orders) = self.orders.get(&self.cycle) else { return Ok(()) };
        let (dt, walls) = (orders.dt, orders.walls.clone());
        let totals = match self.route {
            _ if self.n_exchange == 0 => Some(Vec::new()),
            Route::Master => self.totals_of_master()?,
            Route::Direct => self.totals_of_peers()?,
        };
        let Some(totals) = totals else { return Ok(()) };
        self.dt = dt;
        self.phase = Phase::Integrating;
        let dt_previous = self.dt_previous;
        actions.push(Action::Compute(Task::Integrate { totals, dt_previous, dt, walls }));
        Ok(())
    }
}

#[cfg(test)]
mod sorting_tests;
#[cfg(test)]
mod tests;
