//! Master and workers in one process: the same sessions over an in-memory pipe.
//!
//! Messages are packed and unpacked as on a wire, so that bytes are counted and nothing is shared by accident; but
//! assignments and images of many elements are handed over as they are, since there need not be room for them twice. With one
//! worker everything runs in turn on the pool's own threads; with several, each worker's tasks run on one pool, one
//! task of a worker at a time.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc,
    },
    time::{Duration, Instant},
};

use mechanics::{block::Piece, cycle::Meter};
use protocol::{
    message::{ToMaster, ToPeer, ToWorker},
    phase::{Phase, Report},
    wire::{self, Packed},
};
use worker::{
    compute::{Machine, ThreadClock},
    session::{self, Session, Task},
    stopwatch::{Lap, Stopwatch},
};

use crate::{
    event::{Action, Event, Hand, Outcome},
    job::Job,
    sort::{Gathered, SortBasis, Sorted},
};

/// Where a run's outputs go.
pub trait Sink {
    /// Takes a row, a state, a snapshot or progress.
    ///
    /// # Errors
    /// What the disk refused; the run then ends with that as its failure.
    fn take(&mut self, action: Action) -> Result<(), String>;

    /// Looks at a message of a worker before the job takes it.
    fn heard(&mut self, _worker: &str, _message: &ToMaster) {}
}

/// What a run cost beside its outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Bytes of all messages with their headers.
    pub bytes: u64,
    /// Of these, bytes that passed from worker to worker.
    pub peer_bytes: u64,
    /// Thread-CPU time of sorts (ns).
    pub sort_ns: u64,
}

/// What befalls the workers of a run, for tests.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// A worker is gone, with all that it knew.
    Lose(usize),
    /// A worker comes.
    Join(Hand),
    /// From here on a worker's elements are wrong by one unit in the last place.
    Spoil(usize),
}

/// Something on its way between sessions, or a task's end.
enum Arrival {
    /// From, in which epoch.
    ToMaster(usize, u32, Packed),
    ToWorker(usize, Packed),
    /// A large assignment.
    Assign(usize, Box<ToWorker>),
    /// A large image; from, in which epoch.
    Image(usize, u32, Box<ToMaster>),
    /// From, by its place in the epoch's crew; to; in which epoch.
    ToPeer(u32, usize, u32, Packed),
    Done(usize, Box<Machine>, session::Outcome),
    Sorted(Box<Sorted>, u64),
}

/// Elements from which on a message is handed over as it is.
const WHOLE: usize = 50_000;

fn n_elements(pieces: &[Piece]) -> usize {
    pieces.iter().map(|piece| piece.elements.len()).sum()
}

struct Place {
    session: Session,
    /// Away while a task runs.
    machine: Option<Box<Machine>>,
    lost: bool,
    spoilt: bool,
    stopwatch: Stopwatch,
    /// Of this epoch: bytes sent to each neighbour.
    peers: (u32, BTreeMap<u32, u64>),
}

impl Place {
    fn new() -> Self {
        Self {
            session: Session::new(),
            machine: Some(Box::default()),
            stopwatch: Stopwatch::new(),
            lost: false,
            spoilt: false,
            peers: (0, BTreeMap::new()),
        }
    }

    fn report(&self) -> Report {
        let (epoch, peers) = &self.peers;
        let now = *epoch == self.session.epoch();
        Report {
            peer_bytes: peers.values().sum(),
            linked: if now { peers.keys().copied().collect() } else { Vec::new() },
            ..self.stopwatch.report()
        }
    }
}

/// Runs a job to its end. `threads` is the size of the pool.
///
/// # Errors
/// If the pool cannot start.
pub fn run(
    job: Job,
    first: Vec<Action>,
    n_workers: usize,
    threads: usize,
    sink: &mut (dyn Sink + Send),
    stop: &AtomicBool,
) -> Result<(Outcome, Traffic), String> {
    run_through(job, first, n_workers, threads, sink, stop, &mut |_| None)
}

/// [`run`] with workers that come and go: `fate` is asked before each arrival, by its number from 0.
///
/// # Errors
/// As for [`run`].
pub fn run_through(
    job: Job,
    first: Vec<Action>,
    n_workers: usize,
    threads: usize,
    sink: &mut (dyn Sink + Send),
    stop: &AtomicBool,
    fate: &mut (dyn FnMut(u64) -> Option<Fate> + Send),
) -> Result<(Outcome, Traffic), String> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("compute-{i}"))
        .build()
        .map_err(|e| format!("compute threads: {e}"))?;
    let pool = Arc::new(pool);
    let (send, receive) = mpsc::channel();
    let mut host = Host {
        job,
        places: (0..n_workers).map(|_| Place::new()).collect(),
        queue: VecDeque::new(),
        // With one worker, tasks run where the loop runs: on the pool.
        pool: (n_workers > 1).then(|| Arc::clone(&pool)),
        threads,
        send,
        receive,
        away: 0,
        timer: None,
        traffic: Traffic::default(),
        outcome: None,
    };
    if n_workers > 1 {
        host.drive(first, sink, stop, fate)
    } else {
        pool.install(|| host.drive(first, sink, stop, fate))
    }
}

struct Host {
    job: Job,
    places: Vec<Place>,
    queue: VecDeque<Arrival>,
    pool: Option<Arc<rayon::ThreadPool>>,
    threads: usize,
    send: mpsc::Sender<Arrival>,
    receive: mpsc::Receiver<Arrival>,
    /// Tasks and sorts under way on the pool.
    away: usize,
    /// When the job is told that its time has passed.
    timer: Option<Instant>,
    traffic: Traffic,
    outcome: Option<Outcome>,
}

impl Host {
    fn drive(
        &mut self,
        first: Vec<Action>,
        sink: &mut (dyn Sink + Send),
        stop: &AtomicBool,
        fate: &mut dyn FnMut(u64) -> Option<Fate>,
    ) -> Result<(Outcome, Traffic), String> {
        self.act(first, sink)?;
        let mut stopping = false;
        for number in 0.. {
            if self.timer.is_some_and(|due| Instant::now() >= due) {
                self.timer = None;
                self.apply(Event::Timer, sink)?;
            }
            match fate(number) {
                Some(Fate::Lose(worker)) if !self.places[worker].lost => {
                    self.places[worker].lost = true;
                    self.apply(Event::Lost(worker, "it was to be lost".to_owned()), sink)?;
                }
                Some(Fate::Spoil(worker)) => self.places[worker].spoilt = true,
                Some(Fate::Join(hand)) => {
                    self.places.push(Place::new());
                    self.apply(Event::Joined(hand), sink)?;
                }
                _ => {}
            }
            if !stopping && stop.load(Ordering::Relaxed) {
                stopping = true;
                self.apply(Event::Stop, sink)?;
            }
            if let Some(outcome) = self.outcome.take() {
                return Ok((outcome, self.traffic));
            }
            let arrival = match self.queue.pop_front() {
                Some(arrival) => arrival,
                None => self.wait()?,
            };
            match arrival {
                Arrival::ToMaster(worker, epoch, packed) => {
                    let message =
                        wire::unpack_to_master(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    self.apply(Event::Message(worker, epoch, message), sink)?;
                }
                Arrival::ToWorker(worker, packed) => {
                    let message =
                        wire::unpack_to_worker(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    self.step(worker, session::Event::Message(message))?;
                }
                Arrival::Assign(worker, message) => {
                    self.step(worker, session::Event::Message(*message))?;
                }
                Arrival::Image(worker, epoch, message) => {
                    self.apply(Event::Message(worker, epoch, *message), sink)?;
                }
                Arrival::ToPeer(from, worker, epoch, packed) => {
                    let message =
                        wire::unpack_to_peer(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    if self.places[worker].session.epoch() == epoch {
                        self.step(worker, session::Event::Peer(from, message))?;
                    }
                }
                Arrival::Done(worker, mut machine, outcome) => {
                    let place = &mut self.places[worker];
                    for lap in machine.take_laps() {
                        place.stopwatch.book(place.session.cycle(), lap);
                    }
                    if place.spoilt && matches!(outcome, session::Outcome::Computed) {
                        machine.plant_fault();
                    }
                    place.machine = Some(machine);
                    self.step(worker, session::Event::Done(outcome))?;
                }
                Arrival::Sorted(sorted, ns) => {
                    self.traffic.sort_ns += ns;
                    self.apply(Event::Sorted(sorted), sink)?;
                }
            }
        }
        Err("2^64 arrivals in one run".to_owned())
    }

    fn apply(&mut self, event: Event, sink: &mut (dyn Sink + Send)) -> Result<(), String> {
        let actions = self.job.apply(event);
        self.act(actions, sink)
    }

    /// The next end of a task or sort; nothing else can happen when the queue is empty.
    fn wait(&mut self) -> Result<Arrival, String> {
        if self.away == 0 {
            return Err("nothing to do and the job is not over".to_owned());
        }
        self.away -= 1;
        if self.pool.is_some() {
            return self.receive.recv().map_err(|e| e.to_string());
        }
        // On the pool's own thread: let it run what was spawned instead of sleeping on it.
        loop {
            if let Ok(arrival) = self.receive.try_recv() {
                return Ok(arrival);
            }
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                std::thread::yield_now();
            }
        }
    }

    fn step(&mut self, worker: usize, event: session::Event) -> Result<(), String> {
        let place = &mut self.places[worker];
        if place.lost {
            return Ok(());
        }
        let actions = place.session.apply(event);
        let epoch = place.session.epoch();
        for action in actions {
            match action {
                session::Action::Send(message) => self.timed(worker, |host| {
                    if let ToMaster::Image { last: Some(_), .. } = message {
                        let report = Box::new(host.places[worker].report());
                        host.send(worker, epoch, ToMaster::Report(report))?;
                    }
                    let worked = host.places[worker].machine.as_ref().map(|m| m.work()).unwrap_or_default();
                    host.send(worker, epoch, message.stamped(worked))
                })?,
                session::Action::SendPeer(to, message) => {
                    self.timed(worker, |host| host.send_peer(worker, epoch, to, &message))?;
                }
                session::Action::Compute(task) => self.compute(worker, task)?,
                session::Action::Forget => {
                    if let Some(machine) = &mut self.places[worker].machine {
                        machine.forget();
                    }
                }
            }
        }
        Ok(())
    }

    fn send_peer(&mut self, worker: usize, epoch: u32, to: u32, message: &ToPeer) -> Result<(), String> {
        // Of an epoch that is over, there is nobody to hear it.
        if epoch != self.job.epoch() {
            return Ok(());
        }
        let crew = self.job.crew();
        let from = crew.iter().position(|&member| member == worker);
        let (Some(from), Some(&member)) = (from, crew.get(to as usize)) else {
            return Err(format!("worker {worker} writes to {to}, there are {}", crew.len()));
        };
        let packed = wire::pack_to_peer(message);
        let bytes = packed.wire_bytes();
        self.traffic.bytes += bytes;
        self.traffic.peer_bytes += bytes;
        let (of, sent) = &mut self.places[worker].peers;
        if std::mem::replace(of, epoch) != epoch {
            sent.clear();
        }
        *sent.entry(to).or_default() += bytes;
        self.queue.push_back(Arrival::ToPeer(from as u32, member, epoch, packed));
        Ok(())
    }

    fn send(&mut self, worker: usize, epoch: u32, message: ToMaster) -> Result<(), String> {
        if let ToMaster::Image { pieces, .. } = &message
            && n_elements(pieces) > WHOLE
        {
            self.traffic.bytes += wire::measure_to_master(&message).map_err(|e| e.to_string())?;
            self.queue.push_back(Arrival::Image(worker, epoch, Box::new(message)));
            return Ok(());
        }
        let packed = wire::pack_to_master(&message).map_err(|e| e.to_string())?;
        self.traffic.bytes += packed.wire_bytes();
        self.queue.push_back(Arrival::ToMaster(worker, epoch, packed));
        Ok(())
    }

    /// Books what is done for a worker's messages as its sending.
    fn timed(
        &mut self,
        worker: usize,
        work: impl FnOnce(&mut Self) -> Result<(), String>,
    ) -> Result<(), String> {
        let (cycle, from) = (self.places[worker].session.cycle(), Instant::now());
        let result = work(self);
        let lap = Lap { phase: Phase::Send, from, to: Instant::now() };
        self.places[worker].stopwatch.book(cycle, lap);
        result
    }

    fn compute(&mut self, worker: usize, task: Task) -> Result<(), String> {
        let mut machine = self.places[worker].machine.take().ok_or("a worker asked for two tasks at once")?;
        match &self.pool {
            None => {
                let outcome = machine.run(task);
                self.queue.push_back(Arrival::Done(worker, machine, outcome));
            }
            Some(pool) => {
                let send = self.send.clone();
                self.away += 1;
                pool.spawn(move || {
                    let outcome = machine.run(task);
                    // The receiver is gone only when the run is over.
                    let _ = send.send(Arrival::Done(worker, machine, outcome));
                });
            }
        }
        Ok(())
    }

    fn act(&mut self, actions: Vec<Action>, sink: &mut (dyn Sink + Send)) -> Result<(), String> {
        for action in actions {
            match action {
                Action::Send(worker, ToWorker::Assign(assign))
                    if assign.subdomains.iter().map(|s| n_elements(&s.pieces)).sum::<usize>() > WHOLE =>
                {
                    let message = ToWorker::Assign(assign);
                    self.traffic.bytes += wire::measure_to_worker(&message).map_err(|e| e.to_string())?;
                    self.queue.push_back(Arrival::Assign(worker, Box::new(message)));
                }
                Action::Send(worker, message) => {
                    let packed = wire::pack_to_worker(&message).map_err(|e| e.to_string())?;
                    self.traffic.bytes += packed.wire_bytes();
                    self.queue.push_back(Arrival::ToWorker(worker, packed));
                }
                Action::Sort(bench, x) => self.sort(bench, x),
                Action::Timer(seconds) => {
                    self.timer = Some(Instant::now() + Duration::from_secs_f64(seconds))
                }
                Action::Dismiss(worker, _) => self.places[worker].lost = true,
                Action::Over(outcome) => self.outcome = Some(*outcome),
                other => sink.take(other)?,
            }
        }
        Ok(())
    }

    fn sort(&mut self, bench: Arc<SortBasis>, x: Gathered) {
        if self.threads == 1 && self.pool.is_none() {
            let (sorted, ns) = timed_sort(&bench, &x);
            self.queue.push_back(Arrival::Sorted(sorted, ns));
            return;
        }
        let send = self.send.clone();
        self.away += 1;
        let work = move || {
            let (sorted, ns) = timed_sort(&bench, &x);
            // The receiver is gone only when the run is over.
            let _ = send.send(Arrival::Sorted(sorted, ns));
        };
        match &self.pool {
            Some(pool) => pool.spawn(work),
            None => rayon::spawn(work),
        }
    }
}

/// A sort and its thread-CPU time (ns).
pub fn timed_sort(basis: &SortBasis, x: &Gathered) -> (Box<Sorted>, u64) {
    let clock = ThreadClock::default();
    let mark = clock.start();
    let sorted = Box::new(basis.sort(x));
    clock.stop(mark, true);
    (sorted, clock.work().contact_ns)
}
