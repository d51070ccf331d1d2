//! A run under a real clock: the sessions of [`virtual_clock`](super::virtual_clock), on real threads, real links and
//! real time.
//!
//! Emulated time is time since the start over the *dilation*. Every worker computes on a thread of this machine; then it
//! waits until what the task is charged on its host, by the same [`Costs`](super::machines::Costs) as under the
//! virtual clock, has gone by since the task's start, times the dilation. Messages are frames over loopback TCP that
//! pass shaped `wires`; what they cost a processor is charged to the hosts at both ends, and the master shares host 1,
//! in the ranks of [`Processor`]. A task that is not done when its charge is over is an *overrun*: it makes its host
//! slower than it should be. Where more than [`OVERRUN_LIMIT`] of the tasks are, the figure is of no use.
//!
//! What the virtual clock only models is real here: queues of links and sockets, frames that overtake bulk, threads that
//! finish when they do. What neither has is losses, collisions and noise of an operating system of the time.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, mpsc},
    time::{Duration, Instant},
};

use deck::model::Model;
use mechanics::cycle::{Load, Meter};
use protocol::{
    frame,
    message::ToWorker,
    options::{JobOptions, Route},
    order::Letter,
    wire::{self, Packed},
};
use worker::{
    compute::{Machine, ThreadClock},
    session::{self, Outcome, Session, Task},
};

use super::{
    machines::{Machines, Scheme, What},
    processor::{Processor, Rank},
    timeline::{Flight, Kind, Span, Timeline, counts_at, phases_at},
};
use crate::{
    event::{Action, Event, Hand},
    job::Job,
    options::SessionOptions,
    sort::Sorted,
};

mod wires;

use wires::{Arrival, Wires};

/// Largest share of tasks that may overrun.
pub const OVERRUN_LIMIT: f64 = 0.01;
/// Most hosts: each has threads, and each pair a connection.
pub const MAX_HOSTS: usize = 64;
/// Nothing happens for so long only if the run hangs.
const HANG: Duration = Duration::from_secs(600);

/// What a run under a real clock was like beside its timeline.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Strain {
    /// Real seconds by emulated second.
    pub dilation: f64,
    /// Tasks and sorts that were charged.
    pub tasks: u64,
    /// Those that were not done when their charge was over.
    pub overruns: u64,
    /// What they were late by, all together (emulated s).
    pub late_seconds: f64,
    /// Thread-CPU time of all tasks and sorts (s).
    pub cpu_seconds: f64,
    /// Their charges over their CPU time, both in real time: by how much computing was stretched.
    pub stretch: f64,
    /// Wall time of the run (s).
    pub wall_seconds: f64,
}

impl Strain {
    /// Share of charged tasks that overran.
    pub fn share(&self) -> f64 {
        self.overruns as f64 / self.tasks.max(1) as f64
    }

    /// Whether the figures are of no use.
    pub fn refused(&self) -> bool {
        self.share() > OVERRUN_LIMIT
    }
}

/// One end of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum End {
    /// The master, on host 1.
    Master,
    /// A worker, by index.
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

/// What is known of a message beside its bytes.
#[derive(Clone, Copy)]
struct Slip {
    /// Its number.
    message: u64,
    from: End,
    to: End,
    bytes: u64,
    cycle: u64,
    /// When it was handed to the sender's processor.
    sent: f64,
}

/// Work of a processor.
enum Work {
    Task(usize),
    Sort,
    Send(Slip, Packed),
    Receive(Slip, Letter),
}

/// Work with the time it began.
struct Begun(f64, Work);

/// A task or sort on a thread and on an emulated processor; it is over when both are done.
struct UnderWay<T> {
    kind: Kind,
    charge: f64,
    begun: f64,
    /// When the processor was done.
    due: Option<f64>,
    outcome: Option<T>,
}

impl<T> UnderWay<T> {
    fn new(kind: Kind, charge: f64, begun: f64) -> Self {
        Self { kind, charge, begun, due: None, outcome: None }
    }

    fn is_over(&self) -> bool {
        self.due.is_some() && self.outcome.is_some()
    }
}

/// What threads and links bring, with the time of this machine.
struct News(Instant, Brought);

enum Brought {
    Done(usize, Box<Machine>, Outcome, u64),
    /// The number of a sort, what came of it, its thread-CPU time (ns).
    Sorted(u64, Box<Sorted>, u64),
    Arrived(Arrival),
}

struct Place {
    session: Session,
    machine: Option<Box<Machine>>,
    load: Load,
    task: Option<UnderWay<Outcome>>,
}

struct Clock<'a> {
    machines: &'a Machines,
    dilation: f64,
    job: Job,
    places: Vec<Place>,
    /// Sorts that the job waits for, in their order, with the number of the first.
    sorts: VecDeque<UnderWay<Box<Sorted>>>,
    first_sort: u64,
    processors: Vec<Processor<Begun>>,
    /// Messages so far.
    messages: u64,
    /// By host: when its last message was handled (s).
    message_ended: Vec<f64>,
    wires: Wires,
    /// Messages on their way between two ends: control messages keep their order, and so do frames of cycles.
    slips: BTreeMap<(End, End, bool), VecDeque<Slip>>,
    pool: rayon::ThreadPool,
    send: mpsc::Sender<News>,
    receive: mpsc::Receiver<News>,
    started: Instant,
    now: f64,
    timeline: Timeline,
    strain: Strain,
    charged: f64,
    over: bool,
}

/// Runs a problem on emulated machines in real time, an emulated second in `dilation` seconds.
///
/// # Errors
/// Whatever keeps the run from its end.
pub fn run(
    model: &Arc<Model>,
    machines: &Machines,
    route: Route,
    dilation: f64,
) -> Result<(Timeline, Strain), String> {
    let n = machines.speeds.len();
    if n > MAX_HOSTS {
        return Err(format!("{n} hosts under the real clock, at most {MAX_HOSTS}; use the virtual clock"));
    }
    if !(dilation.is_finite() && dilation > 0.0) {
        return Err(format!("a dilation of {dilation}, must be above 0"));
    }
    let hands: Vec<Hand> = machines
        .believed
        .iter()
        .enumerate()
        .map(|(i, &speed)| Hand { name: format!("host-{}", i + 1), speed, threads: 1 })
        .collect();
    let scheme = Scheme::bolide(route);
    let options = SessionOptions {
        asked: JobOptions { route: Some(route), no_output: true, ..JobOptions::default() },
        dealing: scheme.dealing,
        costs: machines.costs.relative(),
        ..SessionOptions::default()
    };
    let (job, first) = Job::new(Arc::clone(model), &hands, options, None)?;
    let (send, receive) = mpsc::channel();
    let arrived =
        wires::into_channel(send.clone(), |arrival| News(Instant::now(), Brought::Arrived(arrival)));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads())
        .thread_name(|i| format!("compute-{i}"))
        .build()
        .map_err(|e| format!("compute threads: {e}"))?;
    let place = || Place {
        session: Session::new(),
        machine: Some(Box::default()),
        load: Load::default(),
        task: None,
    };
    let mut clock = Clock {
        machines,
        dilation,
        job,
        places: (0..n).map(|_| place()).collect(),
        sorts: VecDeque::new(),
        first_sort: 0,
        processors: machines.speeds.iter().map(|&speed| Processor::new(speed)).collect(),
        messages: 0,
        message_ended: vec![0.0; n],
        wires: Wires::new(&machines.network, dilation, n, route == Route::Direct, &arrived)?,
        slips: BTreeMap::new(),
        pool,
        send,
        receive,
        started: Instant::now(),
        now: 0.0,
        timeline: Timeline { ends: vec![Vec::new(); n], phases: vec![Vec::new(); n], ..Timeline::default() },
        strain: Strain { dilation, ..Strain::default() },
        charged: 0.0,
        over: false,
    };
    clock.master_acts(first)?;
    clock.drive()?;
    let Clock { mut timeline, mut strain, charged, started, .. } = clock;
    timeline.boundaries.dedup();
    strain.stretch = charged * dilation / strain.cpu_seconds.max(1e-9);
    strain.wall_seconds = started.elapsed().as_secs_f64();
    Ok((timeline, strain))
}

/// Compute threads of this machine.
pub fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

impl Clock<'_> {
    /// Emulated time of a time of this machine (s).
    fn emulated(&self, at: Instant) -> f64 {
        at.saturating_duration_since(self.started).as_secs_f64() / self.dilation
    }

    fn drive(&mut self) -> Result<(), String> {
        while !self.over {
            let next = self.next_end();
            let news = match next {
                None => self.receive.recv_timeout(HANG),
                Some((time, _)) => {
                    let left = (time - self.emulated(Instant::now())) * self.dilation;
                    let left = Duration::try_from_secs_f64(left.max(0.0)).unwrap_or(HANG);
                    self.receive.recv_timeout(left)
                }
            };
            match (news, next) {
                (Ok(News(at, brought)), _) => {
                    let at = self.emulated(at);
                    self.run_to(at)?;
                    self.now = self.now.max(at);
                    self.hear(brought)?;
                }
                (Err(_), Some((time, _))) => self.run_to(time)?,
                (Err(_), None) => return Err(format!("nothing happened for {} s", HANG.as_secs())),
            }
        }
        Ok(())
    }

    /// When which processor is done with something, the earliest.
    fn next_end(&self) -> Option<(f64, usize)> {
        let ends = self.processors.iter().enumerate().filter_map(|(host, p)| Some((p.next_end()?, host)));
        ends.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Ends all that processors are done with up to a time, each at its own time.
    fn run_to(&mut self, time: f64) -> Result<(), String> {
        while !self.over
            && let Some((end, host)) = self.next_end()
            && end <= time
        {
            self.now = self.now.max(end);
            if let Some(begun) = self.processors[host].finish(self.now) {
                self.ended(host, begun)?;
            }
        }
        Ok(())
    }

    fn hear(&mut self, brought: Brought) -> Result<(), String> {
        match brought {
            Brought::Done(worker, machine, outcome, ns) => {
                self.strain.cpu_seconds += ns as f64 * 1e-9;
                self.places[worker].machine = Some(machine);
                let task = self.places[worker].task.as_mut().ok_or("the end of a task that was not begun")?;
                let kind = task.kind;
                task.outcome = Some(outcome);
                if matches!(kind, Kind::Load | Kind::Install) {
                    let load = self.places[worker].machine.as_ref().map(|m| m.load()).unwrap_or_default();
                    self.charge_rest(worker, kind, load)?;
                }
                self.complete(worker)
            }
            Brought::Sorted(number, sorted, ns) => {
                self.strain.cpu_seconds += ns as f64 * 1e-9;
                let sort = self.sorts.get_mut((number - self.first_sort) as usize);
                sort.ok_or("the end of a sort that was not begun")?.outcome = Some(sorted);
                self.complete_sorts()
            }
            Brought::Arrived(Arrival { from, to, letter }) => {
                let letter = letter?;
                let control = letter.header.kind == frame::Kind::Control;
                let slips = self.slips.get_mut(&(from, to, control));
                let slip = slips.and_then(VecDeque::pop_front).ok_or("a frame that nobody sent")?;
                self.take_in(slip, letter);
                Ok(())
            }
        }
    }

    fn post(&mut self, from: End, to: End, packed: Packed) {
        let bytes = packed.wire_bytes();
        let worker = if from == End::Master { to.host() } else { from.host() };
        let cycle = self.places[worker].session.cycle();
        self.messages += 1;
        let slip = Slip { message: self.messages, from, to, bytes, cycle, sent: self.now };
        self.charge_message(from, Begun(self.now, Work::Send(slip, packed)), bytes);
    }

    fn take_in(&mut self, slip: Slip, letter: Letter) {
        let Slip { message, from, to, bytes, cycle, sent } = slip;
        if from.host() != to.host() {
            let hosts = (from.host(), to.host());
            self.timeline.flights.push(Flight { message, hosts, cycle, bytes, time: (sent, self.now) });
        }
        self.charge_message(to, Begun(self.now, Work::Receive(slip, letter)), bytes);
    }

    fn charge_message(&mut self, end: End, work: Begun, bytes: u64) {
        let seconds = self.machines.network.handling(bytes);
        if let End::Worker(worker) = end {
            let cycle = self.places[worker].session.cycle();
            let speed = self.machines.speeds[worker];
            phases_at(&mut self.timeline.phases[worker], cycle).send += seconds / speed;
        }
        self.processors[end.host()].add(self.now, Rank::Message, seconds, work);
    }

    fn span(&mut self, host: usize, master: bool, kind: Kind, from: f64, message: Option<u64>) {
        let cycle = self.places[host].session.cycle();
        self.timeline.spans.push(Span { host, master, kind, cycle, time: (from, self.now), message });
    }

    /// A processor is done with something.
    fn ended(&mut self, host: usize, Begun(from, work): Begun) -> Result<(), String> {
        match work {
            Work::Send(slip, packed) => {
                // Messages are handled one after the other, from when the one before was done.
                let from = std::mem::replace(&mut self.message_ended[host], self.now).max(from);
                self.span(host, slip.from == End::Master, Kind::Send, from, Some(slip.message));
                let control = packed.kind == frame::Kind::Control;
                self.slips.entry((slip.from, slip.to, control)).or_default().push_back(slip);
                self.wires.send(slip.from, slip.to, packed)
            }
            Work::Receive(slip, letter) => {
                let from = std::mem::replace(&mut self.message_ended[host], self.now).max(from);
                self.span(host, slip.to == End::Master, Kind::Receive, from, Some(slip.message));
                self.deliver(slip, &letter)
            }
            Work::Task(worker) => {
                let task = self.places[worker].task.as_mut().ok_or("the end of a task that was not begun")?;
                task.due = Some(self.now);
                self.complete(worker)
            }
            Work::Sort => {
                let sort = self.sorts.iter_mut().find(|sort| sort.due.is_none());
                sort.ok_or("the end of a sort that was not begun")?.due = Some(self.now);
                self.complete_sorts()
            }
        }
    }

    /// Counts what is over, and whether it was late.
    fn book<T>(&mut self, work: &UnderWay<T>) {
        if work.charge > 0.0 && work.kind != Kind::Load {
            let late = self.now - work.due.unwrap_or(self.now);
            self.strain.tasks += 1;
            self.strain.overruns += u64::from(late > 0.0);
            self.strain.late_seconds += late;
        }
        self.charged += work.charge;
    }

    fn complete(&mut self, worker: usize) -> Result<(), String> {
        let Some(task) = self.places[worker].task.take_if(|task| task.is_over()) else { return Ok(()) };
        self.book(&task);
        self.span(worker, false, task.kind, task.begun, None);
        if task.kind == Kind::Integrate {
            self.end_cycle(worker);
        }
        match task.outcome {
            Some(outcome) => self.step(worker, session::Event::Done(outcome)),
            None => Ok(()),
        }
    }

    fn complete_sorts(&mut self) -> Result<(), String> {
        while let Some(sort) = self.sorts.pop_front_if(|sort| sort.is_over()) {
            self.first_sort += 1;
            self.book(&sort);
            self.span(0, true, Kind::Sort, sort.begun, None);
            if let Some(sorted) = sort.outcome {
                let actions = self.job.apply(Event::Sorted(sorted));
                self.master_acts(actions)?;
            }
        }
        Ok(())
    }

    fn end_cycle(&mut self, worker: usize) {
        let cycle = self.places[worker].session.cycle();
        self.timeline.end_cycle(worker, cycle, self.now);
        for change in self.machines.changes.iter().filter(|c| c.host == worker && c.cycle == cycle + 1) {
            // Hosts that come and go are refused before the run.
            if let What::Speed(speed) = change.what {
                self.processors[worker].set_speed(self.now, speed);
            }
        }
    }

    fn deliver(&mut self, slip: Slip, letter: &Letter) -> Result<(), String> {
        let fault = |e: protocol::Error| e.to_string();
        let (kind, bytes) = (letter.header.kind, &letter.bytes);
        match (slip.from, slip.to) {
            (End::Worker(from), End::Master) => {
                let message = wire::unpack_to_master(kind, bytes).map_err(fault)?;
                let actions =
                    self.job.apply(Event::Message(from, self.places[from].session.epoch(), message));
                self.master_acts(actions)
            }
            (End::Worker(from), End::Worker(to)) => {
                let message = wire::unpack_to_peer(kind, bytes).map_err(fault)?;
                self.step(to, session::Event::Peer(from as u32, message))
            }
            (End::Master, End::Worker(to)) => {
                let message = wire::unpack_to_worker(kind, bytes).map_err(fault)?;
                self.step(to, session::Event::Message(message))
            }
            (End::Master, End::Master) => Err("the master wrote to itself".to_owned()),
        }
    }

    fn step(&mut self, worker: usize, event: session::Event) -> Result<(), String> {
        for action in self.places[worker].session.apply(event) {
            let (to, packed) = match action {
                session::Action::Compute(task) => {
                    self.compute(worker, task)?;
                    continue;
                }
                session::Action::Forget => continue,
                session::Action::Send(message) => {
                    (End::Master, wire::pack_to_master(&message).map_err(|e| e.to_string())?)
                }
                session::Action::SendPeer(to, message) => {
                    (End::Worker(to as usize), wire::pack_to_peer(&message))
                }
            };
            self.post(End::Worker(worker), to, packed);
        }
        Ok(())
    }

    /// Gives a task to a thread and, where its charge is known, to the host's processor.
    fn compute(&mut self, worker: usize, task: Task) -> Result<(), String> {
        let kind = Kind::of(&task);
        let place = &mut self.places[worker];
        let mut machine = place.machine.take().ok_or("a worker asked for two tasks at once")?;
        let mut under_way = UnderWay::new(kind, 0.0, self.now);
        let known = !matches!(kind, Kind::Load | Kind::Install);
        if known {
            under_way.charge = self.machines.costs.of(kind, &place.load).busy();
        }
        let charge = under_way.charge;
        place.task = Some(under_way);
        if known {
            self.enter(worker, kind);
            self.processors[worker].add(self.now, Rank::Compute, charge, Begun(self.now, Work::Task(worker)));
        }
        let send = self.send.clone();
        self.pool.spawn(move || {
            let (outcome, ns) = cpu_time(|| machine.run(task));
            drop(machine.take_laps());
            // The receiver is gone only when the run is over.
            let _ = send.send(News(Instant::now(), Brought::Done(worker, machine, outcome, ns)));
        });
        Ok(())
    }

    /// The charge of a task that changes what the worker holds is known when it is done: what is left of it is waited for.
    fn charge_rest(&mut self, worker: usize, kind: Kind, load: Load) -> Result<(), String> {
        let charge = self.machines.costs.of(kind, &load).busy();
        self.places[worker].load = load;
        self.enter(worker, kind);
        let speed = self.processors[worker].speed();
        let task = self.places[worker].task.as_mut().ok_or("the end of a task that was not begun")?;
        task.charge = charge;
        let left = charge - (self.now - task.begun) * speed;
        if left > 0.0 {
            self.processors[worker].add(self.now, Rank::Compute, left, Begun(self.now, Work::Task(worker)));
        } else {
            task.due = Some(task.begun + charge / speed);
        }
        Ok(())
    }

    /// Enters a task in the timeline.
    fn enter(&mut self, worker: usize, kind: Kind) {
        let (load, cycle) = (self.places[worker].load, self.places[worker].session.cycle());
        let (costs, speed) = (self.machines.costs.of(kind, &load), self.machines.speeds[worker]);
        self.timeline.enter((worker, cycle), (kind, &load), &costs, speed);
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
                    let cycle = (self.timeline.counts.len() as u64).saturating_sub(1);
                    counts_at(&mut self.timeline.counts, cycle).sorted += x.n_nodes() as u64;
                    let seconds = self.machines.costs.sort * x.n_nodes() as f64;
                    let number = self.first_sort + self.sorts.len() as u64;
                    self.sorts.push_back(UnderWay::new(Kind::Sort, seconds, self.now));
                    self.processors[0].add(self.now, Rank::Idle, seconds, Begun(self.now, Work::Sort));
                    let send = self.send.clone();
                    self.pool.spawn(move || {
                        let (sorted, ns) = cpu_time(|| Box::new(bench.sort(&x)));
                        // The receiver is gone only when the run is over.
                        let _ = send.send(News(Instant::now(), Brought::Sorted(number, sorted, ns)));
                    });
                }
                Action::Over(outcome) => {
                    if let Some(reason) = outcome.failure {
                        return Err(reason);
                    }
                    self.timeline.digest = outcome.digest;
                    self.over = true;
                }
                Action::Row(_)
                | Action::State(_)
                | Action::Snapshot(_)
                | Action::Checkpoint { .. }
                | Action::Dismiss(..)
                | Action::Progress(_)
                | Action::Dealt(_)
                | Action::Owners(_)
                | Action::Rewind { .. }
                | Action::Timer(_) => {}
            }
        }
        Ok(())
    }
}

/// Least seconds of this machine that a cycle may take: links and timers are exact to a tick of a millisecond.
const SHORTEST_CYCLE: f64 = 0.2;
/// Fastest wire over loopback (bit/s): beyond, carrying frames takes this machine longer than they should.
const FASTEST_WIRE: f64 = 1e9;
/// Least stretch of computing on one thread of this machine; workers that share it need more.
const LEAST_STRETCH: f64 = 4.0;

/// A dilation at which overruns should be rare: `bound` is the time of a cycle (emulated s), `cpu` is what one worker
/// alone takes here for a cycle (s), and `alone` what a host of speed 1 is charged for it (emulated s).
pub fn choose_dilation(machines: &Machines, bound: f64, cpu: f64, alone: f64) -> f64 {
    let fastest = machines.speeds.iter().copied().fold(0.0, f64::max);
    let stretch = LEAST_STRETCH * (1.0 + machines.speeds.len() as f64 / threads() as f64);
    let least =
        [SHORTEST_CYCLE / bound, machines.network.rate / FASTEST_WIRE, stretch * cpu * fastest / alone];
    let least = least.into_iter().filter(|d| d.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    // Two digits, upward: a number that can be given again.
    let digit = 10f64.powf(least.log10().floor() - 1.0);
    (least / digit).ceil() * digit
}

/// Thread-CPU time of some work (ns).
pub fn cpu_time<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let clock = ThreadClock::default();
    let mark = clock.start();
    let result = work();
    clock.stop(mark, false);
    (result, clock.work().compute_ns)
}
