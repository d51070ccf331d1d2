//! A run under a virtual clock: real sessions, real messages, and the time that they would have taken.
//!
//! The sessions of master and workers are driven as in [`crate::embedded`], but in the order of virtual time: a task ends
//! when the emulated host has done its work, a message arrives when the emulated network has carried its bytes. What
//! is computed is computed for real, once, so the digest is that of any other run. No clock of this machine is read,
//! and ties go to what was due first: the same run gives the same figures to the last digit.
//!
//! Host `i` runs worker `i`, and host 0 the master too. A host has one processor ([`Processor`]). Work is charged by
//! [`Costs`], messages by [`Network`].

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use mechanics::cycle::Load;
use protocol::{
    message::{Route, ToWorker},
    wire::{self, Packed},
};
use worker::session::{self, Outcome, Session, Task};

use super::{
    network::{Network, Stage, Traffic},
    processor::{Processor, Rank},
    tape::{Player, Tape},
};
use crate::{
    balance::Dealing,
    event::{Action, Balance, Event, Hand, Options, Rebalance},
    job::Job,
    sort::Sorted,
};

/// What work costs on a host of speed 1 (s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Costs {
    /// An element in a cycle.
    pub element: f64,
    /// Integrating a node in a cycle.
    pub node: f64,
    /// A node-face pair on the lists, in a cycle.
    pub pair: f64,
    /// A pair, once when its plan starts to act: finding it, and setting up what the plan needs.
    pub search: f64,
    /// A surface node in a sort.
    pub sort: f64,
}

impl Costs {
    /// Contact, elements and integration of a task (s).
    pub(super) fn of(&self, task: Kind, load: &Load) -> Phases {
        let elements = |n: u64| self.element * n as f64;
        let contact = self.pair * load.pairs as f64;
        let none = Phases::default();
        match task {
            Kind::Load | Kind::Elements => Phases { border: elements(load.border + load.interior), ..none },
            Kind::Install => Phases { contact: contact + self.search * load.pairs as f64, ..none },
            Kind::Border => Phases { contact, border: elements(load.border), ..none },
            Kind::Interior => Phases { interior: elements(load.interior), ..none },
            Kind::Integrate => Phases { integrate: self.node * load.nodes as f64, ..none },
            Kind::Transfer | Kind::Image | Kind::Sort | Kind::Send | Kind::Receive => none,
        }
    }
}

/// The cluster that a run is put on.
#[derive(Clone, Debug, PartialEq)]
pub struct Machines {
    /// Relative speed of each host.
    pub speeds: Vec<f64>,
    /// What the master believes of them: the speeds by which it deals out work.
    pub believed: Vec<f64>,
    /// Costs of work.
    pub costs: Costs,
    /// The network.
    pub network: Network,
    /// Changes of speed, by cycle.
    pub changes: Vec<Change>,
}

/// A host's speed changes when its worker starts a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Host, from 0.
    pub host: usize,
    /// The cycle.
    pub cycle: u64,
    /// Relative speed from then on.
    pub speed: f64,
}

/// How the program itself goes about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheme {
    /// Route of the partial forces.
    pub route: Route,
    /// How work units are dealt.
    pub dealing: Dealing,
    /// Whether messages leave before the interior elements are computed.
    pub overlap: bool,
    /// What speeds work is dealt out by.
    pub balance: Balance,
}

impl Scheme {
    /// What Bolide does, on a route.
    pub fn bolide(route: Route) -> Self {
        Self { route, dealing: Dealing::Owners, overlap: true, balance: Balance::Given }
    }

    /// The control: a star without overlap, units dealt by weight alone.
    pub fn control() -> Self {
        Self { route: Route::Master, dealing: Dealing::Weights, overlap: false, balance: Balance::Given }
    }
}

/// Seconds of a worker's cycle by what they went into, at the speed of its host.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Phases {
    /// Elements before the partial forces leave.
    pub border: f64,
    /// Contact.
    pub contact: f64,
    /// Elements while partial forces travel.
    pub interior: f64,
    /// Processor time of messages, at both ends.
    pub send: f64,
    /// Integrating.
    pub integrate: f64,
    /// Everything else: waiting, and on host 1 the master's work.
    pub wait: f64,
}

impl Phases {
    /// Adds what a task costs at speed 1, on a host of `speed`.
    pub(super) fn charge(&mut self, costs: &Self, speed: f64) {
        self.border += costs.border / speed;
        self.contact += costs.contact / speed;
        self.interior += costs.interior / speed;
        self.integrate += costs.integrate / speed;
    }

    pub(super) fn busy(&self) -> f64 {
        self.border + self.contact + self.interior + self.send + self.integrate
    }
}

/// What a host does for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Building the domain.
    Load,
    /// State of nodes for other workers.
    Transfer,
    /// All elements, at a plan boundary.
    Elements,
    /// A new plan, and contact by it.
    Install,
    /// Contact and border elements.
    Border,
    /// Interior elements.
    Interior,
    /// Integrating.
    Integrate,
    /// An image.
    Image,
    /// The master sorts.
    Sort,
    /// A message leaves.
    Send,
    /// A message comes in.
    Receive,
}

/// Something a host did, for pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Host, from 0.
    pub host: usize,
    /// The master's work, not the worker's.
    pub master: bool,
    /// What.
    pub kind: Kind,
    /// The worker's cycle.
    pub cycle: u64,
    /// From, to (s).
    pub time: (f64, f64),
}

/// A message as it travelled between two hosts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Hosts, from 0.
    pub hosts: (usize, usize),
    /// The cycle it belongs to: that of its sender, or of the receiver if the master sent it.
    pub cycle: u64,
    /// Bytes with the frames' headers, without those of packets.
    pub bytes: u64,
    /// Handed to the processor of the sender; all of it at the receiver (s).
    pub time: (f64, f64),
}

/// What was worked on in one cycle, by all workers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Elements.
    pub elements: u64,
    /// Nodes, copies included.
    pub nodes: u64,
    /// Pairs.
    pub pairs: u64,
    /// Pairs of plans that start to act.
    pub searched: u64,
    /// Surface nodes sorted, where this cycle gathered.
    pub sorted: u64,
}

/// What a run under a virtual clock shows.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    /// By worker and cycle: when the cycle ended (s).
    pub ends: Vec<Vec<f64>>,
    /// By worker and cycle.
    pub phases: Vec<Vec<Phases>>,
    /// By cycle.
    pub counts: Vec<Counts>,
    /// Cycles at which plans began to act.
    pub boundaries: Vec<u64>,
    /// What hosts did.
    pub spans: Vec<Span>,
    /// Messages between hosts.
    pub flights: Vec<Flight>,
    /// When work was dealt out by other speeds.
    pub rebalances: Vec<Rebalance>,
    /// Digest of the final state.
    pub digest: String,
}

impl Timeline {
    /// The cycles that averages are taken over: from the first plan boundary to the last if there are several, so that
    /// sorts weigh at their real rate; else without the first two.
    pub fn window(&self) -> std::ops::Range<u64> {
        let n = self.counts.len() as u64;
        let within: Vec<u64> = self.boundaries.iter().copied().filter(|&b| b >= 2 && b <= n).collect();
        match (within.first(), within.last()) {
            (Some(&first), Some(&last)) if last > first => first..last,
            _ => 2.min(n.saturating_sub(1))..n,
        }
    }

    /// When the slowest worker had ended the cycles before `cycle` (s).
    pub fn reached(&self, cycle: u64) -> f64 {
        let Some(index) = (cycle as usize).checked_sub(1) else { return 0.0 };
        self.ends.iter().filter_map(|ends| ends.get(index)).copied().fold(0.0, f64::max)
    }

    /// Mean time of a cycle over the window (s).
    pub fn seconds_per_cycle(&self) -> f64 {
        let window = self.window();
        let cycles = (window.end - window.start).max(1) as f64;
        (self.reached(window.end) - self.reached(window.start)) / cycles
    }

    /// Mean bytes between hosts in a cycle of the window.
    pub fn bytes_per_cycle(&self) -> f64 {
        let window = self.window();
        let sent = self.flights.iter().filter(|f| window.contains(&f.cycle));
        sent.map(|f| f.bytes).sum::<u64>() as f64 / (window.end - window.start).max(1) as f64
    }

    /// Work per cycle of the window: elements, nodes, pairs, pairs of new plans, surface nodes sorted.
    pub fn work_per_cycle(&self) -> [f64; 5] {
        let window = self.window();
        let mut sum = [0.0; 5];
        for counts in &self.counts[window.start as usize..window.end as usize] {
            let Counts { elements, nodes, pairs, searched, sorted } = *counts;
            for (sum, count) in sum.iter_mut().zip([elements, nodes, pairs, searched, sorted]) {
                *sum += count as f64;
            }
        }
        sum.map(|s| s / (window.end - window.start).max(1) as f64)
    }

    /// Mean phases of a worker over the window.
    pub fn mean_phases(&self, worker: usize) -> Phases {
        let window = self.window();
        let cycles = (window.end - window.start).max(1) as f64;
        let mut mean = Phases::default();
        for p in &self.phases[worker][window.start as usize..window.end as usize] {
            mean.border += p.border / cycles;
            mean.contact += p.contact / cycles;
            mean.interior += p.interior / cycles;
            mean.send += p.send / cycles;
            mean.integrate += p.integrate / cycles;
            mean.wait += p.wait / cycles;
        }
        mean
    }
}

/// One end of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Master,
    Worker(usize),
}

impl End {
    fn host(self) -> usize {
        match self {
            Self::Master => 0,
            Self::Worker(worker) => worker,
        }
    }
}

struct Parcel {
    from: End,
    to: End,
    packed: Packed,
    bytes: u64,
    /// Epoch and cycle of the worker at one of its ends.
    epoch: u32,
    cycle: u64,
    sent: f64,
}

enum Work {
    Task(usize, Kind, Outcome),
    Sort(Box<Sorted>),
    Send(Parcel),
    Receive(Parcel),
}

/// Work with the time it began.
struct Begun(f64, Work);

enum What {
    /// A processor may have ended something, if nothing changed since this version.
    Processor(usize, u64),
    Enters(Parcel),
    Arrives(Parcel),
}

struct Due {
    time: f64,
    order: u64,
    what: What,
}

impl PartialEq for Due {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Due {}
impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Due {
    /// The earliest is the greatest, as the heap gives the greatest first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.time.total_cmp(&self.time).then(other.order.cmp(&self.order))
    }
}

struct Place {
    session: Session,
    player: Player,
    /// What its tasks took so far, at the speeds that its host had (virtual ns).
    busy: protocol::message::Work,
    /// Messages that wait for the end of a task: without overlap.
    held: Vec<Parcel>,
}

struct Clock<'a> {
    machines: &'a Machines,
    overlap: bool,
    job: Job,
    places: Vec<Place>,
    sorts: VecDeque<Sorted>,
    sorts_kept: Vec<Sorted>,
    live: bool,
    processors: Vec<Processor<Begun>>,
    traffic: Traffic,
    /// By host: when its last message was handled (s).
    message_ended: Vec<f64>,
    heap: BinaryHeap<Due>,
    order: u64,
    now: f64,
    timeline: Timeline,
    over: bool,
}

/// Runs a problem on emulated machines: computing, or by the tape of another run of the same problem, hosts and scheme.
///
/// # Errors
/// Whatever keeps the run from its end.
pub fn run(
    model: &Arc<Model>,
    machines: &Machines,
    scheme: Scheme,
    tape: Option<&Tape>,
) -> Result<(Timeline, Option<Tape>), String> {
    let n = machines.speeds.len();
    let hands: Vec<Hand> = machines
        .believed
        .iter()
        .enumerate()
        .map(|(i, &speed)| Hand { name: format!("host-{}", i + 1), speed, threads: 1 })
        .collect();
    let options = Options {
        route: scheme.route,
        dealing: scheme.dealing,
        balance: scheme.balance,
        ..Options::default()
    };
    let (job, first) = Job::new(Arc::clone(model), &hands, options, None)?;
    let players: Vec<Player> = match tape {
        None => (0..n).map(|_| Player::live()).collect(),
        Some(tape) => tape.workers.iter().map(|kept| Player::Tape(kept.iter().cloned().collect())).collect(),
    };
    if players.len() != n {
        return Err(format!("a tape of {} workers for {n} hosts", players.len()));
    }
    let mut clock = Clock {
        machines,
        overlap: scheme.overlap,
        job,
        places: players
            .into_iter()
            .map(|player| Place {
                session: Session::new(),
                player,
                busy: Default::default(),
                held: Vec::new(),
            })
            .collect(),
        sorts: tape.map(|tape| tape.sorts.iter().cloned().collect()).unwrap_or_default(),
        sorts_kept: Vec::new(),
        live: tape.is_none(),
        processors: machines.speeds.iter().map(|&speed| Processor::new(speed)).collect(),
        traffic: Traffic::new(&machines.network, n),
        message_ended: vec![0.0; n],
        heap: BinaryHeap::new(),
        order: 0,
        now: 0.0,
        timeline: Timeline { ends: vec![Vec::new(); n], phases: vec![Vec::new(); n], ..Timeline::default() },
        over: false,
    };
    clock.master_acts(first)?;
    clock.drive()?;
    let Clock { mut timeline, places, sorts_kept, .. } = clock;
    timeline.boundaries.dedup();
    if let Some(tape) = tape {
        timeline.digest.clone_from(&tape.digest);
        return Ok((timeline, None));
    }
    let workers = places
        .into_iter()
        .map(|place| match place.player {
            Player::Live { kept, .. } => kept,
            Player::Tape(_) => Vec::new(),
        })
        .collect();
    let digest = timeline.digest.clone();
    Ok((timeline, Some(Tape { workers, sorts: sorts_kept, digest })))
}

impl Clock<'_> {
    fn drive(&mut self) -> Result<(), String> {
        while !self.over {
            let Due { time, what, .. } = self.heap.pop().ok_or("nothing to do and the job is not over")?;
            match what {
                What::Processor(host, version) => {
                    if self.processors[host].version() == version {
                        self.now = time;
                        if let Some(begun) = self.processors[host].finish(time) {
                            self.ended(host, begun)?;
                        }
                        self.foresee(host);
                    }
                }
                What::Enters(parcel) => {
                    self.now = time;
                    let arrival = self.traffic.enter(time, parcel.to.host(), parcel.bytes);
                    self.at(arrival, What::Arrives(parcel));
                }
                What::Arrives(parcel) => {
                    self.now = time;
                    self.take_in(parcel);
                }
            }
        }
        Ok(())
    }

    fn at(&mut self, time: f64, what: What) {
        self.order += 1;
        self.heap.push(Due { time, order: self.order, what });
    }

    fn foresee(&mut self, host: usize) {
        if let Some(time) = self.processors[host].next_end() {
            let version = self.processors[host].version();
            self.at(time, What::Processor(host, version));
        }
    }

    /// A message goes to the sender's processor.
    fn post(&mut self, from: End, to: End, packed: Packed) {
        let parcel = self.parcel(from, to, packed);
        self.hand_over(parcel);
    }

    fn parcel(&self, from: End, to: End, packed: Packed) -> Parcel {
        let bytes = packed.wire_bytes();
        let worker = if from == End::Master { to.host() } else { from.host() };
        let session = &self.places[worker].session;
        Parcel { from, to, packed, bytes, epoch: session.epoch(), cycle: session.cycle(), sent: self.now }
    }

    fn hand_over(&mut self, parcel: Parcel) {
        let host = parcel.from.host();
        let seconds = self.machines.network.handling(parcel.bytes);
        self.charge_message(parcel.from, seconds);
        self.processors[host].add(self.now, Rank::Message, seconds, Begun(self.now, Work::Send(parcel)));
        self.foresee(host);
    }

    fn take_in(&mut self, parcel: Parcel) {
        let host = parcel.to.host();
        if parcel.from.host() != host {
            let hosts = (parcel.from.host(), host);
            let time = (parcel.sent, self.now);
            self.timeline.flights.push(Flight { hosts, cycle: parcel.cycle, bytes: parcel.bytes, time });
        }
        let seconds = self.machines.network.handling(parcel.bytes);
        self.charge_message(parcel.to, seconds);
        self.processors[host].add(self.now, Rank::Message, seconds, Begun(self.now, Work::Receive(parcel)));
        self.foresee(host);
    }

    fn charge_message(&mut self, end: End, seconds: f64) {
        if let End::Worker(worker) = end {
            let speed = self.machines.speeds[worker];
            let cycle = self.places[worker].session.cycle();
            phases_at(&mut self.timeline.phases[worker], cycle).send += seconds / speed;
        }
    }

    fn span(&mut self, host: usize, master: bool, kind: Kind, from: f64) {
        let cycle = self.places[host].session.cycle();
        self.timeline.spans.push(Span { host, master, kind, cycle, time: (from, self.now) });
    }

    fn ended(&mut self, host: usize, Begun(from, work): Begun) -> Result<(), String> {
        // Messages are handled one after the other, from when the one before was done.
        let from = match work {
            Work::Send(_) | Work::Receive(_) => {
                std::mem::replace(&mut self.message_ended[host], self.now).max(from)
            }
            _ => from,
        };
        match work {
            Work::Send(parcel) => {
                self.span(host, parcel.from == End::Master, Kind::Send, from);
                if parcel.to.host() == host {
                    self.take_in(parcel);
                } else {
                    match self.traffic.leave(self.now, host, parcel.bytes) {
                        Stage::Arrives(time) => self.at(time, What::Arrives(parcel)),
                        Stage::Enters(time) => self.at(time, What::Enters(parcel)),
                    }
                }
                Ok(())
            }
            Work::Receive(parcel) => {
                self.span(host, parcel.to == End::Master, Kind::Receive, from);
                self.deliver(parcel)
            }
            Work::Sort(sorted) => {
                self.span(host, true, Kind::Sort, from);
                let actions = self.job.apply(Event::Sorted(sorted));
                self.master_acts(actions)
            }
            Work::Task(worker, kind, outcome) => {
                self.span(host, false, kind, from);
                for parcel in std::mem::take(&mut self.places[worker].held) {
                    self.hand_over(parcel);
                }
                if kind == Kind::Integrate {
                    self.end_cycle(worker);
                }
                self.step(worker, session::Event::Done(outcome))
            }
        }
    }

    fn end_cycle(&mut self, worker: usize) {
        let cycle = self.places[worker].session.cycle();
        let ends = &mut self.timeline.ends[worker];
        let wall = self.now - ends.last().copied().unwrap_or(0.0);
        ends.push(self.now);
        let phases = phases_at(&mut self.timeline.phases[worker], cycle);
        phases.wait = (wall - phases.busy()).max(0.0);
        for change in self.machines.changes.iter().filter(|c| c.host == worker && c.cycle == cycle + 1) {
            self.processors[worker].set_speed(self.now, change.speed);
        }
    }

    fn deliver(&mut self, parcel: Parcel) -> Result<(), String> {
        let Parcel { from, to, packed, epoch, .. } = parcel;
        let fault = |e: protocol::Error| e.to_string();
        match (from, to) {
            (End::Worker(from), End::Master) => {
                let message = wire::unpack_to_master(packed.kind, &packed.bytes).map_err(fault)?;
                let actions = self.job.apply(Event::Message(from, epoch, message));
                self.master_acts(actions)
            }
            // Of an epoch that is over: nobody hears it.
            (End::Worker(_), End::Worker(to)) if self.places[to].session.epoch() != epoch => Ok(()),
            (End::Worker(from), End::Worker(to)) => {
                let message = wire::unpack_to_peer(packed.kind, &packed.bytes).map_err(fault)?;
                self.step(to, session::Event::Peer(from as u32, message))
            }
            (End::Master, End::Worker(to)) => {
                let message = wire::unpack_to_worker(packed.kind, &packed.bytes).map_err(fault)?;
                self.step(to, session::Event::Message(message))
            }
            (End::Master, End::Master) => Err("the master wrote to itself".to_owned()),
        }
    }

    fn step(&mut self, worker: usize, event: session::Event) -> Result<(), String> {
        let actions = self.places[worker].session.apply(event);
        let computes = actions.iter().any(|action| matches!(action, session::Action::Compute(_)));
        for action in actions {
            let (to, packed) = match action {
                session::Action::Compute(task) => {
                    self.compute(worker, task)?;
                    continue;
                }
                session::Action::Forget => continue,
                session::Action::Send(message) => {
                    let message = message.stamped(self.places[worker].busy);
                    (End::Master, wire::pack_to_master(&message).map_err(|e| e.to_string())?)
                }
                session::Action::SendPeer(to, message) => {
                    (End::Worker(to as usize), wire::pack_to_peer(&message))
                }
            };
            let from = End::Worker(worker);
            if computes && !self.overlap {
                let parcel = self.parcel(from, to, packed);
                self.places[worker].held.push(parcel);
            } else {
                self.post(from, to, packed);
            }
        }
        Ok(())
    }

    fn compute(&mut self, worker: usize, task: Task) -> Result<(), String> {
        let kind = kind_of(&task);
        let cycle = self.places[worker].session.cycle();
        let (outcome, load) = self.places[worker].player.run(task)?;
        let costs = self.machines.costs.of(kind, &load);
        if kind != Kind::Load {
            let speed = self.machines.speeds[worker];
            let phases = phases_at(&mut self.timeline.phases[worker], cycle);
            phases.charge(&costs, speed);
            count(&mut self.timeline.counts, kind, cycle, &load);
        }
        // Host 0 keeps some of its time for the master's sorts; it is slower by that.
        let kept = if worker == 0 { self.machines.believed[0] / self.machines.speeds[0] } else { 1.0 };
        let speed = self.processors[worker].speed() * kept;
        let busy = &mut self.places[worker].busy;
        busy.compute_ns += (costs.busy() / speed * 1e9) as u64;
        busy.contact_ns += (costs.contact / speed * 1e9) as u64;
        let work = Begun(self.now, Work::Task(worker, kind, outcome));
        self.processors[worker].add(self.now, Rank::Compute, costs.busy(), work);
        self.foresee(worker);
        Ok(())
    }

    fn master_acts(&mut self, actions: Vec<Action>) -> Result<(), String> {
        for action in actions {
            match action {
                Action::Send(worker, message) => {
                    if let ToWorker::Plan { acts_at, .. } = &message {
                        self.timeline.boundaries.push(*acts_at);
                    }
                    let packed = wire::pack_to_worker(&message).map_err(|e| e.to_string())?;
                    self.post(End::Master, End::Worker(worker), packed);
                }
                Action::Sort(bench, x) => {
                    let sorted = if self.live {
                        let sorted = bench.sort(&x);
                        self.sorts_kept.push(sorted.clone());
                        sorted
                    } else {
                        self.sorts.pop_front().ok_or("the tape of a run has fewer sorts than the run")?
                    };
                    let cycle = self.timeline.counts.len() as u64 - 1;
                    counts_at(&mut self.timeline.counts, cycle).sorted += x.len() as u64;
                    let seconds = self.machines.costs.sort * x.len() as f64;
                    let work = Begun(self.now, Work::Sort(Box::new(sorted)));
                    self.processors[0].add(self.now, Rank::Idle, seconds, work);
                    self.foresee(0);
                }
                Action::Over(outcome) => {
                    if let Some(reason) = outcome.failure {
                        return Err(reason);
                    }
                    self.timeline.digest = outcome.digest;
                    self.timeline.rebalances = outcome.rebalances;
                    self.over = true;
                }
                Action::Row(_)
                | Action::State(_)
                | Action::Snapshot(_)
                | Action::Progress(_)
                | Action::Dealt(_)
                | Action::Rewind { .. }
                | Action::Timer(_) => {}
            }
        }
        Ok(())
    }
}

/// Enters what a task works on in the counts of its cycle.
pub(super) fn count(counts: &mut Vec<Counts>, kind: Kind, cycle: u64, load: &Load) {
    if kind == Kind::Image {
        return;
    }
    let counts = counts_at(counts, cycle);
    match kind {
        Kind::Elements => counts.elements += load.border + load.interior,
        Kind::Border => {
            counts.elements += load.border;
            counts.pairs += load.pairs;
        }
        Kind::Interior => counts.elements += load.interior,
        Kind::Install => {
            counts.pairs += load.pairs;
            counts.searched += load.pairs;
        }
        Kind::Integrate => counts.nodes += load.nodes,
        _ => {}
    }
}

pub(super) fn kind_of(task: &Task) -> Kind {
    match task {
        Task::Load { .. } => Kind::Load,
        Task::Transfer { .. } => Kind::Transfer,
        Task::Elements { .. } => Kind::Elements,
        Task::Install { .. } => Kind::Install,
        Task::Border { .. } => Kind::Border,
        Task::Interior { .. } => Kind::Interior,
        Task::Integrate { .. } => Kind::Integrate,
        Task::Image => Kind::Image,
    }
}

pub(super) fn phases_at(phases: &mut Vec<Phases>, cycle: u64) -> &mut Phases {
    if phases.len() <= cycle as usize {
        phases.resize(cycle as usize + 1, Phases::default());
    }
    &mut phases[cycle as usize]
}

pub(super) fn counts_at(counts: &mut Vec<Counts>, cycle: u64) -> &mut Counts {
    if counts.len() <= cycle as usize {
        counts.resize(cycle as usize + 1, Counts::default());
    }
    &mut counts[cycle as usize]
}
