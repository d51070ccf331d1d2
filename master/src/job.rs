//! The job's session on the master: a pure state machine, `apply(event) -> actions`.
//!
//! It decides time steps, sorts, images and the end from the votes of whole cycles, adds partial forces, and keeps the
//! ledger. It knows no socket, clock, disk or thread: those are events and actions.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use mechanics::{
    block::Piece,
    contact::{Exclusions, Surface, initial_pairs, reach},
    cycle::Subdomain,
    digest,
    exact::Quantum,
    initial,
    mesh::Mesh,
    piece,
    state::GlobalState,
    vote::{Quanta, Vote},
};
use protocol::message::{Assign, IMAGE_VERSION, Orders, Route, ToMaster, ToWorker, Work};

use crate::{
    balance::Dealing,
    decompose::{self, decompose},
    exchange::{Exchange, Holdings},
    ledger::Ledger,
    results::history::HistoryRow,
    snapshot::Snapshot,
    sort::{Sorted, Sorter},
};

/// A worker as the job sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Hand {
    /// Name for messages.
    pub name: String,
    /// Relative speed, user-given.
    pub speed: f64,
    /// Compute threads.
    pub threads: u32,
}

/// What a user may ask of a run beside the deck.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Lane width by name; none for the best.
    pub lanes: Option<String>,
    /// How partial forces travel.
    pub route: Route,
    /// How work units are dealt.
    pub dealing: Dealing,
    /// Take a snapshot at the start of this cycle.
    pub snapshot_at: Option<u64>,
    /// Write states while the run goes (the last one is always gathered).
    pub states: bool,
    /// Forces extra sorts, for tests of bits.
    pub force_sorts: ForceSorts,
}

/// Extra sorts, which may not change a bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ForceSorts {
    /// Only when due.
    #[default]
    Never,
    /// Every so many cycles.
    Every(u64),
    /// At pseudo-random cycles, about one in four.
    Seeded(u64),
}

impl ForceSorts {
    fn at(self, cycle: u64) -> bool {
        match self {
            Self::Never => false,
            Self::Every(n) => cycle.is_multiple_of(n.max(1)),
            Self::Seeded(seed) => {
                let mut x = cycle.wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                (x ^ (x >> 31)).is_multiple_of(4)
            }
        }
    }
}

/// What happens to a job.
pub enum Event {
    /// A message from a worker.
    Message(usize, ToMaster),
    /// A sort is done.
    Sorted(Box<Sorted>),
    /// The user wants the run to end with the results so far.
    Stop,
    /// A worker is gone for good.
    Lost(usize, String),
}

/// What a job wants done.
pub enum Action {
    /// Send to a worker.
    Send(usize, ToWorker),
    /// Sort; exactly one [`Event::Sorted`] answers it. Positions by surface node.
    Sort(Arc<Bench>, Vec<[f64; 3]>),
    /// Append a row of history.
    Row(Box<HistoryRow>),
    /// Write a state for the user.
    State(Box<GlobalState>),
    /// Store a snapshot.
    Snapshot(Box<Snapshot>),
    /// Tell the user how far it is.
    Progress(Progress),
    /// The job is over.
    Over(Box<Outcome>),
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Cycles completed.
    pub cycle: u64,
    /// Time (time).
    pub time: f64,
    /// Time step (time).
    pub dt: f64,
    /// Global index of the element that limits it; none where something else does.
    pub element: Option<u32>,
    /// What limits it.
    pub limit: Limit,
}

/// What limits a time step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Courant limit of an element.
    Courant,
    /// Rate of volume of an element.
    Volume,
    /// Stiffness of a contact.
    Contact,
    /// A contact node may not travel further.
    Travel,
    /// The step before times the growth.
    Growth,
    /// The end of the run.
    End,
}

/// How a job ended.
pub struct Outcome {
    /// None for a run to its end or to the user's stop; else what went wrong.
    pub failure: Option<String>,
    /// The user stopped it.
    pub stopped: bool,
    /// The final state, unless a worker could not give it.
    pub state: Option<GlobalState>,
    /// Digest of the final state.
    pub digest: String,
    /// The ledger.
    pub ledger: Ledger,
    /// Sorts that took effect.
    pub sorts: u64,
    /// Census of the last sort.
    pub census: mechanics::contact::Census,
    /// Compute time of each worker.
    pub work: Vec<Work>,
    /// Largest over mean of cost over speed.
    pub imbalance: f64,
    /// Lane width of the workers.
    pub lanes: String,
    /// Name of the route.
    pub route: &'static str,
    /// Cycles of this session of the run: not those before a snapshot that it resumed from.
    pub cycles_run: u64,
}

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

/// What a snapshot holds beside the state, as it was when its cycle was complete.
struct SnapshotRest {
    dt_previous: f64,
    dt: f64,
    force_quantum: Quantum,
    vote: Vote,
    ledger: Ledger,
    rows: Vec<HistoryRow>,
}

/// An image on its way.
struct Collecting {
    pieces: Vec<Piece>,
    arrived: Vec<bool>,
    vote: Option<Vote>,
}

/// Most an element's interactions weigh against an element when imbalance is reported: an element-cycle costs about as
/// much as this many interactions.
const INTERACTIONS_PER_ELEMENT: f64 = 60.0;
/// Deepest contact (gaps) before the run is stopped.
const DEEPEST: f64 = 0.9;
/// Share of the gap that contact votes for per cycle; the lag may not take it past 20 %.
const TRAVEL_VOTE: f64 = 0.16;

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
    /// The images of a snapshot, and the rest of it: frames of cycles may overtake images, so either may come first.
    snapshot_state: Option<GlobalState>,
    snapshot_rest: Option<SnapshotRest>,
    next_state_time: Option<f64>,
    last_spread: f64,
    spread_rate: f64,
    stop_asked: bool,
    stop_at: Option<u64>,
    failure: Option<String>,
    ledger: Ledger,
    rows: Vec<HistoryRow>,
    sorts: u64,
    census: mechanics::contact::Census,
    work: Vec<Work>,
    imbalance: f64,
    over: bool,
}

impl Job {
    /// Takes a problem to these workers: from its deck, or from a snapshot of it.
    ///
    /// # Errors
    /// If the problem cannot start: elements without volume, contact zones that overlap, no worker.
    pub fn new(
        model: Arc<Model>,
        hands: &[Hand],
        options: Options,
        resume: Option<Snapshot>,
    ) -> Result<(Self, Vec<Action>), String> {
        if hands.is_empty() {
            return Err("no worker: start one with `bolide worker --master HOST`".to_owned());
        }
        let mut setup = model.setup.clone();
        let mut constraint = model.constraint.clone();
        initial::bind_walls(&model.mesh, &mut setup, &mut constraint)?;
        let start = initial::state(&model.mesh, &setup, &model.velocity, &constraint)?;
        let fresh_quanta = initial::quanta(&model.mesh, &setup, &start);
        let (state, quanta, ledger, rows, steps, vote_before) = match resume {
            None => {
                let ledger = Ledger::new(&model, &start.mass);
                (start, fresh_quanta, ledger, Vec::new(), BTreeMap::new(), None)
            }
            Some(snapshot) => {
                if snapshot.state.x.len() != start.x.len()
                    || snapshot.state.initial_volume != start.initial_volume
                {
                    return Err("the snapshot is of another problem: its mesh is not this deck's".to_owned());
                }
                let cycle = snapshot.state.cycle;
                let time = snapshot.state.time;
                let mut steps = BTreeMap::new();
                if cycle > 0 {
                    steps.insert(cycle - 1, (snapshot.dt_previous, time - snapshot.dt_previous));
                }
                steps.insert(cycle, (snapshot.dt, time));
                let quanta = Quanta { force: snapshot.force_quantum, ..fresh_quanta };
                (snapshot.state, quanta, snapshot.ledger, snapshot.rows, steps, Some(snapshot.vote))
            }
        };
        let mut model = model;
        if setup != model.setup {
            let mut with_walls = (*model).clone();
            with_walls.setup = setup;
            model = Arc::new(with_walls);
        }
        let n = hands.len();
        let speeds: Vec<f64> = hands.iter().map(|h| h.speed).collect();
        let layout = decompose(&model.mesh, &speeds);
        let mut subdomains: Vec<Subdomain> = Vec::with_capacity(layout.len());
        let mut nodes_of: Vec<Vec<u32>> = Vec::with_capacity(layout.len());
        for (id, subdomain) in layout.iter().enumerate() {
            let threads = hands[subdomain.worker].threads.max(1) as usize;
            let pieces: Vec<Piece> = subdomain
                .region
                .split(threads)
                .iter()
                .map(|region| piece::cut(&model.mesh, &state, subdomain.part, region))
                .collect();
            let mut nodes: Vec<u32> = pieces.iter().flat_map(|p| p.nodes.iter().copied()).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes_of.push(nodes);
            subdomains.push(Subdomain { id: id as u32, pieces, unowned: Vec::new(), surface: Vec::new() });
        }
        let holdings = Holdings::new(model.mesh.n_nodes(), n, &layout, &nodes_of);
        let surface = model
            .setup
            .contact
            .as_ref()
            .map(|_| Surface::new(&model.mesh, &model.setup.materials, &|_| true));
        let mut gather: Vec<Vec<u32>> = vec![Vec::new(); n];
        for (subdomain, (place, nodes)) in subdomains.iter_mut().zip(layout.iter().zip(&nodes_of)) {
            let id = subdomain.id;
            subdomain.unowned =
                nodes.iter().copied().filter(|&node| holdings.owner_subdomain[node as usize] != id).collect();
            if let Some(surface) = &surface {
                subdomain.surface =
                    nodes.iter().copied().filter(|&node| surface.node_index(node).is_some()).collect();
                gather[place.worker].extend(
                    subdomain.surface.iter().filter(|&&node| holdings.owner_subdomain[node as usize] == id),
                );
            }
        }
        let shared_state = Arc::new(state.clone());
        let mut elements = vec![0.0; n];
        for s in &layout {
            elements[s.worker] += s.region.n_elements() as f64;
        }
        let (bench, exchange, census, interactions) = match (surface, &model.setup.contact) {
            (Some(surface), Some(settings)) => {
                let at_start: Vec<[f64; 3]> =
                    surface.nodes.iter().map(|&node| model.mesh.positions[node as usize]).collect();
                let inside = initial_pairs(&surface, &at_start, settings);
                refuse_overlap(&model.mesh, &surface, &inside, settings.gap)?;
                let exclusions = Exclusions::new(&surface, &inside);
                let sorter = Sorter::new(
                    surface,
                    settings.clone(),
                    exclusions,
                    speeds.clone(),
                    options.route,
                    options.dealing,
                    &gather,
                );
                let x = sorter.positions_of(&state);
                let bench = Bench { sorter, holdings, state: shared_state };
                let sorted = bench.sort(&x);
                (Some(Arc::new(bench)), sorted.exchange, sorted.census, sorted.interactions)
            }
            _ => {
                let exchange = Exchange::new(&holdings, vec![None; n], &state, options.route);
                (None, exchange, mechanics::contact::Census::default(), vec![0; n])
            }
        };
        let imbalance = imbalance(&elements, &interactions, &speeds);
        let exchange = Arc::new(exchange);
        let first_cycle = state.cycle;
        let dt_previous = first_cycle.checked_sub(1).and_then(|c| steps.get(&c)).map_or(0.0, |s| s.0);
        let mut by_worker: Vec<Vec<Subdomain>> = vec![Vec::new(); n];
        for (subdomain, place) in subdomains.into_iter().zip(&layout) {
            by_worker[place.worker].push(subdomain);
        }
        let gauges: Vec<u32> = model.output.gauges.iter().map(|g| g.node).collect();
        let actions = by_worker
            .into_iter()
            .enumerate()
            .map(|(w, subdomains)| {
                let assign = Assign {
                    setup: model.setup.clone(),
                    n_parts: model.mesh.parts.len() as u32,
                    quanta,
                    subdomains,
                    gauges: gauges.clone(),
                    lanes: options.lanes.clone(),
                    cycle: first_cycle,
                    dt_previous,
                    route: options.route,
                    plan: exchange.plans[w].clone(),
                    plan_hash: exchange.hash,
                    guest_state: exchange.guest_state_from(w, &state),
                };
                Action::Send(w, ToWorker::Assign(Box::new(assign)))
            })
            .collect();
        let next_state_time = model.output.period.map(|period| {
            let passed = (state.time / period).floor() + 1.0;
            passed * period
        });
        let job = Self {
            n_workers: n,
            quanta,
            bench,
            ready: vec![false; n],
            running: false,
            lanes: String::new(),
            first_cycle,
            steps,
            vote_before,
            arrivals: BTreeMap::new(),
            exchanges: VecDeque::from([(first_cycle, exchange)]),
            completed: first_cycle,
            sorts_under_way: VecDeque::new(),
            transfers: BTreeMap::new(),
            collecting: BTreeMap::new(),
            snapshot_state: None,
            snapshot_rest: None,
            next_state_time,
            last_spread: 0.0,
            spread_rate: 0.0,
            stop_asked: false,
            stop_at: None,
            failure: None,
            ledger,
            rows,
            sorts: u64::from(census.units > 0),
            census,
            work: vec![Work::default(); n],
            imbalance,
            over: false,
            state,
            model,
            options,
        };
        Ok((job, actions))
    }

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
            force_quantum: self.quanta.force,
            gather: false,
            collect: snapshot_now || at_end,
            stop: at_end,
        };
        if at_end {
            self.stop_at = Some(first);
        }
        let orders = self.orders_for(first, dt, time + dt, None);
        for worker in 0..self.n_workers {
            actions.push(Action::Send(worker, ToWorker::Start { orders: [before, orders] }));
        }
        Ok(())
    }

    /// The orders that give `dt` of cycle `next`, which ends at `time_after`, and what happens then. `vote` is of the
    /// cycle two before the sort that it may trigger could gather.
    fn orders_for(&mut self, next: u64, dt: f64, time_after: f64, vote: Option<&Vote>) -> Orders {
        let control = self.model.setup.control;
        let after = next + 1;
        if self.stop_at.is_none()
            && (self.stop_asked
                || self.failure.is_some()
                || time_after >= control.end_time
                || after >= control.end_cycle)
        {
            self.stop_at = Some(after);
        }
        let stop = self.stop_at == Some(after);
        let mut collect = stop || self.options.snapshot_at == Some(after);
        if self.options.states
            && let (Some(due), Some(period)) = (self.next_state_time, self.model.output.period)
            && time_after >= due
        {
            collect = true;
            self.next_state_time = Some(((time_after / period).floor() + 1.0) * period);
        }
        let gather = !stop && self.sort_due(after, vote);
        if gather {
            self.sorts_under_way.push_back(after);
        }
        Orders { next, dt, force_quantum: self.quanta.force, gather, collect, stop }
    }

    /// Whether positions travel at the start of cycle `cycle`, so that a sort acts a lag later.
    fn sort_due(&mut self, cycle: u64, vote: Option<&Vote>) -> bool {
        let (Some(_), Some(settings)) = (&self.bench, &self.model.setup.contact) else { return false };
        let lag = u64::from(self.model.setup.control.sort_lag);
        let waiting = self.exchanges.iter().filter(|(acts_at, _)| *acts_at > self.completed).count();
        let in_flight = self.sorts_under_way.len() + waiting;
        if in_flight as u64 > 2 * lag + 2 {
            return false;
        }
        if self.options.force_sorts.at(cycle) {
            return true;
        }
        let Some(vote) = vote else { return false };
        if in_flight > 0 {
            return false;
        }
        let (spread, _) = reach::worst_spread(&vote.extents, settings);
        // Positions were those of two cycles before `cycle`; the sort acts `lag` cycles after it.
        let ahead = (lag + 3) as f64;
        spread + 1.5 * ahead * self.spread_rate > settings.slack
    }

    /// The step that a vote allows, what limits it, and the element if one does.
    fn limit(&self, vote: &Vote, grown: f64) -> (f64, Limit, Option<u32>) {
        let control = &self.model.setup.control;
        let mut best = (grown, Limit::Growth, None);
        let mut offer = |dt: f64, limit: Limit, element: Option<u32>| {
            if dt < best.0 {
                best = (dt, limit, element);
            }
        };
        offer(control.safety_factor * vote.courant, Limit::Courant, Some(vote.courant_element));
        offer(vote.volume_limit, Limit::Volume, None);
        offer(vote.contact_limit, Limit::Contact, None);
        if let Some(contact) = &self.model.setup.contact
            && vote.contact_speed_ahead > 0.0
        {
            offer(TRAVEL_VOTE * contact.gap / vote.contact_speed_ahead, Limit::Travel, None);
        }
        best
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
        while self.exchanges.get(1).is_some_and(|(acts_at, _)| *acts_at <= cycle + 1) {
            self.exchanges.pop_front();
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
                ledger: self.ledger.clone(),
                rows: self.rows.clone(),
            });
            self.snapshot(actions);
        }
        self.follow_spread(&vote);
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
        let mut orders = self.orders_for(cycle + 1, dt, time_after, Some(&vote));
        if let Some(quantum) = coarser {
            self.quanta.force = quantum;
            orders.force_quantum = quantum;
        }
        let exchange = self.exchange_at(cycle)?;
        for worker in 0..self.n_workers {
            let totals = exchange.of_worker(worker, &arrivals.totals);
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

    /// Forces nearing the bound of exact sums ask for a coarser quantum.
    fn rescaled(&self, vote: &Vote) -> Result<Option<Quantum>, String> {
        let quantum = self.quanta.force;
        if vote.force_bound > quantum.term_bound() || !vote.force_bound.is_finite() {
            return Err(format!(
                "a force of up to {:e}, exact sums hold {:e}; the run has blown up or needs a smaller time step",
                vote.force_bound,
                quantum.term_bound()
            ));
        }
        Ok((vote.force_bound > quantum.rescale_bound()).then(|| Quantum::for_reference(vote.force_bound, 42)))
    }

    /// Keeps the rate at which bodies move against each other (length per cycle).
    fn follow_spread(&mut self, vote: &Vote) {
        let Some(settings) = &self.model.setup.contact else { return };
        let (spread, _) = reach::worst_spread(&vote.extents, settings);
        if !spread.is_finite() {
            return;
        }
        if spread >= self.last_spread {
            self.spread_rate = spread - self.last_spread;
        }
        self.last_spread = spread;
    }

    /// Books the whole vote of a cycle, and stops the run where the physics went wrong.
    fn book(&mut self, cycle: u64, vote: &Vote, actions: &mut Vec<Action>) {
        let Some(&(dt, time)) = self.steps.get(&cycle) else { return };
        let gap = self.model.setup.contact.as_ref().map(|c| c.gap);
        self.ledger.book(vote, cycle, time, dt, gap);
        if cycle.is_multiple_of(u64::from(self.model.output.history_cycles.max(1))) {
            self.row(actions);
        }
        if self.failure.is_some() {
            return;
        }
        self.failure = if let Some((element, volume)) = vote.fault {
            Some(self.element_fault(element, volume, cycle))
        } else if vote.worst_depth >= DEEPEST {
            let (node, face) = vote.worst_pair;
            Some(format!(
                "node {} is {:.2} gaps into the contact zone of surface face {face} at cycle {cycle}, at most {DEEPEST}; raise contact.stiffness or the gap",
                self.model.mesh.node_ids.get(node as usize).copied().unwrap_or(node),
                vote.worst_depth
            ))
        } else if self.ledger.worst_courant > 1.0 {
            Some(format!(
                "cycle {cycle}: time step {dt:e} above the Courant limit {:e} of element {}; lower control.safety_factor",
                vote.courant,
                self.element_name(vote.courant_element)
            ))
        } else if self.ledger.worst_gap_travel > 0.2 {
            Some(format!(
                "cycle {cycle}: a contact node travelled {:.3} gaps in one cycle, at most 0.2; lower control.safety_factor or control.growth",
                self.ledger.worst_gap_travel
            ))
        } else {
            self.stale(vote, cycle)
        };
    }

    fn stale(&self, vote: &Vote, cycle: u64) -> Option<String> {
        let settings = self.model.setup.contact.as_ref()?;
        let (spread, [a, b]) = reach::worst_spread(&vote.extents, settings);
        (spread > settings.slack).then(|| {
            let name = |p: u32| self.model.mesh.parts[p as usize].name.as_str();
            format!(
                "cycle {cycle}: parts `{}` and `{}` moved {spread:e} against each other since the last sort, the slack is {:e}; raise contact.slack",
                name(a),
                name(b),
                settings.slack
            )
        })
    }

    fn row(&mut self, actions: &mut Vec<Action>) {
        self.rows.push(self.ledger.last.clone());
        actions.push(Action::Row(Box::new(self.ledger.last.clone())));
    }

    fn element_name(&self, element: u32) -> String {
        let mut left = element as usize;
        for part in &self.model.mesh.parts {
            let n = part.n_elements();
            if left < n {
                return format!(
                    "{} of part `{}`",
                    part.element_ids.get(left).copied().unwrap_or(left as u32),
                    part.name
                );
            }
            left -= n;
        }
        element.to_string()
    }

    fn element_fault(&self, element: u32, volume: f64, cycle: u64) -> String {
        let was = self.state.initial_volume.get(element as usize).copied().unwrap_or(f64::NAN);
        format!(
            "element {}: volume {volume:e} at cycle {cycle}, at first {was:e}; refine the mesh, soften the load or add an erosion strain",
            self.element_name(element)
        )
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

    fn image(
        &mut self,
        worker: usize,
        cycle: u64,
        pieces: Vec<Piece>,
        last: Option<Box<Vote>>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let n = self.n_workers;
        let collecting = self.collecting.entry(cycle).or_insert_with(|| Collecting {
            pieces: Vec::new(),
            arrived: vec![false; n],
            vote: None,
        });
        if std::mem::replace(&mut collecting.arrived[worker], true) {
            return Err(format!("worker {worker} sends its image of cycle {cycle} twice"));
        }
        collecting.pieces.extend(pieces);
        if let Some(vote) = last {
            match &mut collecting.vote {
                Some(merged) => merged.merge(&vote),
                None => collecting.vote = Some(*vote),
            }
        }
        if !collecting.arrived.iter().all(|a| *a) {
            return Ok(());
        }
        let Some(collected) = self.collecting.remove(&cycle) else { return Ok(()) };
        let mut state = self.state.clone();
        for piece in &collected.pieces {
            piece::put_back(piece, &mut state)?;
        }
        state.cycle = cycle;
        state.time = self.time_at(cycle);
        if let Some(vote) = collected.vote {
            if cycle > self.first_cycle {
                self.book(cycle - 1, &vote, actions);
                if !(cycle - 1).is_multiple_of(u64::from(self.model.output.history_cycles.max(1))) {
                    self.row(actions);
                }
            }
            actions.push(Action::State(Box::new(state.clone())));
            self.finish(Some(state), actions);
            return Ok(());
        }
        if self.options.snapshot_at == Some(cycle) {
            self.snapshot_state = Some(state.clone());
            self.snapshot(actions);
        }
        if self.options.states {
            actions.push(Action::State(Box::new(state)));
        }
        Ok(())
    }

    /// Stores the snapshot once both halves of it are here.
    fn snapshot(&mut self, actions: &mut Vec<Action>) {
        if let (Some(_), Some(_)) = (&self.snapshot_state, &self.snapshot_rest)
            && let (Some(state), Some(rest)) = (self.snapshot_state.take(), self.snapshot_rest.take())
        {
            let SnapshotRest { dt_previous, dt, force_quantum, vote, ledger, rows } = rest;
            let snapshot = Snapshot { state, dt_previous, dt, force_quantum, vote, ledger, rows };
            actions.push(Action::Snapshot(Box::new(snapshot)));
        }
    }

    fn time_at(&self, cycle: u64) -> f64 {
        if let Some((_, time)) = self.steps.get(&cycle) {
            return *time;
        }
        cycle
            .checked_sub(1)
            .and_then(|before| self.steps.get(&before))
            .map_or(self.state.time, |(dt, time)| (time + dt).min(self.model.setup.control.end_time))
    }
}

/// Largest over mean of cost over speed, workers without a speed aside.
fn imbalance(elements: &[f64], interactions: &[u64], speeds: &[f64]) -> f64 {
    let finish: Vec<f64> = elements
        .iter()
        .zip(interactions)
        .zip(speeds)
        .map(|((e, i), s)| (e + *i as f64 / INTERACTIONS_PER_ELEMENT) / s)
        .collect();
    let bound = finish.iter().zip(speeds).map(|(f, s)| f * s).sum::<f64>() / speeds.iter().sum::<f64>();
    debug_assert!(decompose::slowest_finish(&[], speeds) == 0.0);
    if bound > 0.0 { finish.iter().copied().fold(0.0, f64::max) / bound } else { 1.0 }
}

/// The external gap: nodes of one part may not start inside the zone of another.
fn refuse_overlap(
    mesh: &Mesh,
    surface: &Surface,
    inside: &[(u32, u32, f64)],
    gap: f64,
) -> Result<(), String> {
    let foreign = inside
        .iter()
        .find(|(node, face, _)| surface.node_part[*node as usize] != surface.faces[*face as usize].part);
    match foreign {
        None => Ok(()),
        Some(&(node, face, distance)) => Err(format!(
            "node {} of part `{}` starts {distance:e} from part `{}`, inside the contact gap {gap:e}; move the parts apart by at least the gap, or join them",
            mesh.node_ids[surface.nodes[node as usize] as usize],
            mesh.parts[surface.node_part[node as usize] as usize].name,
            mesh.parts[surface.faces[face as usize].part as usize].name,
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECK: &str = r#"
        title = "two cubes"
        units = "SI"
        [control]
        end_cycle = 3
        [[part]]
        name = "low"
        material = "LEAD"
        box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }
        [[part]]
        name = "high"
        material = "LEAD"
        velocity = [0, 0, -10]
        box = { origin = [0, 0, 1.1], size = [1, 1, 1], cells = [2, 2, 2] }
        [contact]
        gap_fraction = 0.1
    "#;

    fn hands(n: usize) -> Vec<Hand> {
        (0..n).map(|i| Hand { name: format!("worker-{i}"), speed: 1.0, threads: 1 }).collect()
    }

    fn job(n: usize) -> (Job, Vec<Action>) {
        let model = deck::read(DECK, "two cubes").expect("a good deck");
        Job::new(Arc::new(model), &hands(n), Options::default(), None).expect("a good problem")
    }

    /// A job whose workers are ready and have their first orders, and the number of exchange nodes of each.
    fn started(n: usize) -> (Job, Vec<usize>) {
        let (mut job, actions) = job(n);
        let exchange: Vec<usize> = actions
            .iter()
            .map(|action| match action {
                Action::Send(_, ToWorker::Assign(assign)) => assign.plan.exchange.len(),
                _ => panic!("a job begins with assignments"),
            })
            .collect();
        for worker in 0..n {
            let mut vote = Vote::empty(2);
            vote.courant = 1e-4;
            let actions = job.apply(Event::Message(
                worker,
                ToMaster::Ready { vote: Some(Box::new(vote)), lanes: "scalar".into() },
            ));
            let starts =
                actions.iter().filter(|a| matches!(a, Action::Send(_, ToWorker::Start { .. }))).count();
            assert_eq!(starts, if worker + 1 == n { n } else { 0 }, "all start when the last is ready");
        }
        (job, exchange)
    }

    fn cycle(cycle: u64, n_exchange: usize) -> ToMaster {
        let vote = (cycle > 0).then(|| Box::new(Vote { courant: 1e-4, ..Vote::empty(2) }));
        ToMaster::Cycle { cycle, vote, partials: vec![1.0; 3 * n_exchange], gathered: Vec::new() }
    }

    fn failure(actions: &[Action]) -> &str {
        actions
            .iter()
            .find_map(|action| match action {
                Action::Over(outcome) => outcome.failure.as_deref(),
                _ => None,
            })
            .expect("the job ends with a reason")
    }

    #[test]
    fn totals_are_the_sums_of_both_workers_and_come_when_both_have_sent() {
        let (mut job, exchange) = started(2);
        assert!(exchange[0] > 0 && exchange[0] == exchange[1]);
        assert!(job.apply(Event::Message(0, cycle(0, exchange[0]))).is_empty());
        let actions = job.apply(Event::Message(1, cycle(0, exchange[1])));
        let totals: Vec<&Vec<f64>> = actions
            .iter()
            .filter_map(|a| match a {
                Action::Send(_, ToWorker::Totals { totals, .. }) => Some(totals),
                _ => None,
            })
            .collect();
        assert_eq!(totals.len(), 2);
        assert!(totals.iter().all(|t| t.len() == 3 * exchange[0] && t.iter().all(|x| *x == 2.0)));
    }

    #[test]
    fn a_frame_of_the_wrong_length_ends_the_job_with_both_lengths() {
        let (mut job, exchange) = started(2);
        let actions = job.apply(Event::Message(1, cycle(0, exchange[1] + 1)));
        let reason = failure(&actions);
        assert!(
            reason.contains(&format!("{}", 3 * exchange[1]))
                && reason.contains(&format!("{}", 3 * exchange[1] + 3)),
            "{reason}"
        );
        assert!(job.is_over() && job.apply(Event::Stop).is_empty());
    }

    #[test]
    fn the_same_cycle_twice_from_one_worker_ends_the_job() {
        let (mut job, exchange) = started(2);
        job.apply(Event::Message(0, cycle(0, exchange[0])));
        let actions = job.apply(Event::Message(0, cycle(0, exchange[0])));
        assert!(failure(&actions).contains("twice"));
    }

    #[test]
    fn a_lost_worker_is_named_and_the_others_are_released() {
        let (mut job, _) = started(3);
        let actions = job.apply(Event::Lost(2, "closed by peer".into()));
        assert!(failure(&actions).contains("worker 2"));
        assert_eq!(actions.iter().filter(|a| matches!(a, Action::Send(_, ToWorker::Release))).count(), 3);
    }

    #[test]
    fn images_of_another_version_are_refused_with_both_versions() {
        let (mut job, _) = started(1);
        let image = ToMaster::Image {
            cycle: 1,
            version: IMAGE_VERSION + 1,
            pieces: Vec::new(),
            last: None,
            work: Work::default(),
        };
        let actions = job.apply(Event::Message(0, image));
        let reason = failure(&actions).to_owned();
        assert!(
            reason.contains(&IMAGE_VERSION.to_string()) && reason.contains(&(IMAGE_VERSION + 1).to_string())
        );
    }

    #[test]
    fn a_node_inside_a_foreign_gap_is_refused_with_its_number() {
        let text = DECK.replace("1.1]", "1.02]");
        let faults = deck::read(&text, "two cubes").map(|_| ()).expect_err("zones overlap");
        assert!(faults[0].to_string().contains("low"), "{}", faults[0]);
    }
}
