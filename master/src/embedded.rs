//! Master and workers in one process: the same sessions over an in-memory pipe.
//!
//! Messages are packed and unpacked as on a wire, so that bytes are counted and nothing is shared by accident. With one
//! worker everything runs in turn on the pool's own threads; with several, each worker's tasks run on one pool, one
//! task of a worker at a time.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc,
    },
    time::Instant,
};

use mechanics::cycle::Meter;
use protocol::{
    message::ToMaster,
    phase::{Phase, Report},
    wire::{self, Packed},
};
use worker::{
    compute::{Machine, ThreadClock},
    session::{self, Session, Task},
    stopwatch::{Lap, Stopwatch},
};

use crate::{
    event::{Action, Event, Outcome},
    job::{Bench, Job},
    sort::Sorted,
};

/// Where a run's outputs go.
pub trait Sink {
    /// Takes a row, a state, a snapshot or progress.
    ///
    /// # Errors
    /// What the disk refused; the run then ends with that as its failure.
    fn take(&mut self, action: Action) -> Result<(), String>;
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

/// Something on its way between sessions, or a task's end.
enum Arrival {
    ToMaster(usize, Packed),
    ToWorker(usize, Packed),
    /// From, to.
    ToPeer(u32, usize, Packed),
    Done(usize, Box<Machine>, session::Outcome),
    Sorted(Box<Sorted>, u64),
}

struct Place {
    session: Session,
    /// Away while a task runs.
    machine: Option<Box<Machine>>,
    stopwatch: Stopwatch,
    /// Bytes sent to each neighbour.
    peers: BTreeMap<u32, u64>,
}

impl Place {
    fn new() -> Self {
        Self {
            session: Session::new(),
            machine: Some(Box::default()),
            stopwatch: Stopwatch::new(),
            peers: BTreeMap::new(),
        }
    }

    fn report(&self) -> Report {
        Report {
            peer_bytes: self.peers.values().sum(),
            linked: self.peers.keys().copied().collect(),
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
        traffic: Traffic::default(),
        outcome: None,
    };
    if n_workers > 1 { host.drive(first, sink, stop) } else { pool.install(|| host.drive(first, sink, stop)) }
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
    traffic: Traffic,
    outcome: Option<Outcome>,
}

impl Host {
    fn drive(
        &mut self,
        first: Vec<Action>,
        sink: &mut (dyn Sink + Send),
        stop: &AtomicBool,
    ) -> Result<(Outcome, Traffic), String> {
        self.act(first, sink)?;
        let mut stopping = false;
        loop {
            if !stopping && stop.load(Ordering::Relaxed) {
                stopping = true;
                let actions = self.job.apply(Event::Stop);
                self.act(actions, sink)?;
            }
            if let Some(outcome) = self.outcome.take() {
                return Ok((outcome, self.traffic));
            }
            let arrival = match self.queue.pop_front() {
                Some(arrival) => arrival,
                None => self.wait()?,
            };
            match arrival {
                Arrival::ToMaster(worker, packed) => {
                    let message =
                        wire::unpack_to_master(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    let actions = self.job.apply(Event::Message(worker, message));
                    self.act(actions, sink)?;
                }
                Arrival::ToWorker(worker, packed) => {
                    let message =
                        wire::unpack_to_worker(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    self.step(worker, session::Event::Message(message))?;
                }
                Arrival::ToPeer(from, worker, packed) => {
                    let message =
                        wire::unpack_to_peer(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    self.step(worker, session::Event::Peer(from, message))?;
                }
                Arrival::Done(worker, mut machine, outcome) => {
                    let place = &mut self.places[worker];
                    for lap in machine.take_laps() {
                        place.stopwatch.book(place.session.cycle(), lap);
                    }
                    place.machine = Some(machine);
                    self.step(worker, session::Event::Done(outcome))?;
                }
                Arrival::Sorted(sorted, ns) => {
                    self.traffic.sort_ns += ns;
                    let actions = self.job.apply(Event::Sorted(sorted));
                    self.act(actions, sink)?;
                }
            }
        }
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
        for action in self.places[worker].session.apply(event) {
            match action {
                session::Action::Send(message) => self.timed(worker, |host| {
                    if let ToMaster::Image { last: Some(_), .. } = message {
                        let report = Box::new(host.places[worker].report());
                        host.send(worker, &ToMaster::Report(report))?;
                    }
                    host.send(worker, &message)
                })?,
                session::Action::SendPeer(to, message) => self.timed(worker, |host| {
                    let packed = wire::pack_to_peer(&message);
                    let bytes = packed.wire_bytes();
                    host.traffic.bytes += bytes;
                    host.traffic.peer_bytes += bytes;
                    *host.places[worker].peers.entry(to).or_default() += bytes;
                    host.queue.push_back(Arrival::ToPeer(worker as u32, to as usize, packed));
                    Ok(())
                })?,
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

    fn send(&mut self, worker: usize, message: &ToMaster) -> Result<(), String> {
        let packed = wire::pack_to_master(message).map_err(|e| e.to_string())?;
        self.traffic.bytes += packed.wire_bytes();
        self.queue.push_back(Arrival::ToMaster(worker, packed));
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
                Action::Send(worker, message) => {
                    let packed = wire::pack_to_worker(&message).map_err(|e| e.to_string())?;
                    self.traffic.bytes += packed.wire_bytes();
                    self.queue.push_back(Arrival::ToWorker(worker, packed));
                }
                Action::Sort(bench, x) => self.sort(bench, x),
                Action::Over(outcome) => self.outcome = Some(*outcome),
                other => sink.take(other)?,
            }
        }
        Ok(())
    }

    fn sort(&mut self, bench: Arc<Bench>, x: Vec<[f64; 3]>) {
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
pub fn timed_sort(bench: &Bench, x: &[[f64; 3]]) -> (Box<Sorted>, u64) {
    let clock = ThreadClock::default();
    let mark = clock.start();
    let sorted = Box::new(bench.sort(x));
    clock.stop(mark, true);
    (sorted, clock.work().contact_ns)
}
