//! Master and workers in one process: a [`World`] in which messages arrive in the order they are sent.
//!
//! Assignments and states of many elements are handed over as they are, since there need not be room for them twice. With one
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

use mechanics::cycle::Meter;
use protocol::{
    message::{ToMaster, Work},
    phase::{Phase, Report},
};
use system::clock::thread_cpu_ns;
use worker::{
    compute::{Machine, ThreadClock},
    session::{self, Task},
    stopwatch::{Lap, Stopwatch},
    team::Team,
};

use crate::{
    event::{Action, Event, Outcome, WorkerSpec},
    job::Job,
    sort::{Gathered, SortBasis, Sorted},
    world::{End, Error, Parcel, Sessions, Surroundings, World},
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

    /// A worker, by its connection, is waited for, in words; or it is heard again.
    fn suspect(&mut self, _incarnation: u32, _note: Option<String>) {}

    /// A worker, by its connection, computes a part of its time only, in words; or all of it again.
    fn slow(&mut self, _incarnation: u32, _note: Option<String>) {}

    /// A worker, by its connection, has been released while the job goes on.
    fn freed(&mut self, _incarnation: u32) {}
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
    /// With one worker in this process: thread-CPU time of the cycles that one thread spends while the others have nothing to
    /// do (ns).
    pub serial_ns: Option<u64>,
}

/// What is done to what a worker holds, with a number that says where.
pub type Numbered = fn(&mut Machine, u64);

/// What befalls the workers of a run.
#[derive(Clone, Debug)]
pub enum Fate {
    /// A worker is gone, with all that it knew.
    Lose(usize),
    /// A worker comes.
    Join(WorkerSpec),
    /// From here on this is done to what a worker holds whenever it has computed elements.
    Touch(usize, fn(&mut Machine)),
    /// This is done, with this number, to what a worker holds when it has next computed elements.
    TouchOnce(usize, Numbered, u64),
    /// The user stops the run.
    Stop,
}

/// Something that has arrived, or a task's end.
enum Arrival {
    Parcel(Parcel),
    Done(usize, Box<Machine>, session::Outcome),
    Sorted(Box<Sorted>, u64),
}

/// Elements from which on a message is handed over as it is.
pub const WHOLE: usize = 50_000;

/// A worker in this process.
struct LocalWorker {
    /// Away while a task runs.
    machine: Option<Box<Machine>>,
    lost: bool,
    touch: Option<fn(&mut Machine)>,
    touch_once: Option<(Numbered, u64)>,
    stopwatch: Stopwatch,
    /// Of this epoch: bytes sent to each neighbour.
    peers: (u32, BTreeMap<u32, u64>),
}

impl LocalWorker {
    fn new(machine: Machine) -> Self {
        Self {
            machine: Some(Box::new(machine)),
            stopwatch: Stopwatch::new(),
            lost: false,
            touch: None,
            touch_once: None,
            peers: (0, BTreeMap::new()),
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
    let team = Team::default();
    let process = Process {
        sink,
        places: match n_workers {
            1 => vec![LocalWorker::new(Machine::alone(team.clone()))],
            n => (0..n).map(|_| LocalWorker::new(Machine::new())).collect(),
        },
        queue: VecDeque::new(),
        // With one worker, tasks run where the loop runs: on the pool.
        pool: (n_workers > 1).then(|| Arc::clone(&pool)),
        team,
        threads,
        send,
        receive,
        away: 0,
        timer: None,
        send_began: Instant::now(),
        cycles_from: None,
        traffic: Traffic::default(),
    };
    let mut world = World::new(n_workers, process);
    let ended = if n_workers > 1 {
        drive(&mut world, job, first, stop, fate)
    } else {
        pool.install(|| drive(&mut world, job, first, stop, fate))
    };
    Ok((ended?, world.surroundings.traffic))
}

/// One process: its threads, and what is between the sessions.
struct Process<'a> {
    sink: &'a mut (dyn Sink + Send),
    places: Vec<LocalWorker>,
    queue: VecDeque<Arrival>,
    pool: Option<Arc<rayon::ThreadPool>>,
    /// Of one worker: the threads of the pool that stay awake for it.
    team: Team,
    threads: usize,
    send: mpsc::Sender<Arrival>,
    receive: mpsc::Receiver<Arrival>,
    /// Tasks and sorts under way on the pool.
    away: usize,
    /// When the job is told that its time has passed.
    timer: Option<Instant>,
    /// When the message that is being packed was begun.
    send_began: Instant,
    /// CPU time of the thread that runs tasks, without what all threads share, when the first cycle began, and the sorts until
    /// then (ns).
    cycles_from: Option<[u64; 2]>,
    traffic: Traffic,
}

fn drive(
    world: &mut World<Process<'_>>,
    job: Job,
    first: Vec<Action>,
    stop: &AtomicBool,
    fate: &mut dyn FnMut(u64) -> Option<Fate>,
) -> Result<Outcome, Error> {
    let members = (0..world.surroundings.places.len()).collect();
    world.begin(job, first, members)?;
    let mut stopping = false;
    for number in 0.. {
        if world.surroundings.timer.take_if(|due| Instant::now() >= *due).is_some() {
            world.apply(Event::Timer)?;
        }
        match fate(number) {
            Some(Fate::Lose(host)) if !world.surroundings.places[host].lost => {
                world.surroundings.places[host].lost = true;
                if let Some(member) = world.sessions.part(host) {
                    world.apply(Event::Lost(member, "it was to be lost".to_owned()))?;
                }
            }
            Some(Fate::TouchOnce(host, touch, number)) => {
                world.surroundings.places[host].touch_once = Some((touch, number));
            }
            Some(Fate::Stop) => stop.store(true, Ordering::Relaxed),
            Some(Fate::Touch(host, touch)) => world.surroundings.places[host].touch = Some(touch),
            Some(Fate::Join(spec)) => {
                world.surroundings.places.push(LocalWorker::new(Machine::new()));
                let host = world.sessions.add_host();
                world.join(host, spec)?;
            }
            _ => {}
        }
        if !stopping && stop.load(Ordering::Relaxed) {
            stopping = true;
            world.apply(Event::Stop)?;
        }
        if let Some(outcome) = world.outcome() {
            return Ok(outcome);
        }
        match world.surroundings.next()? {
            Arrival::Parcel(parcel) => {
                let letter = world.open(parcel)?;
                world.hear(letter)?;
            }
            Arrival::Done(host, mut machine, outcome) => {
                let place = &mut world.surroundings.places[host];
                let cycle = world.sessions.hosts[host].session.cycle();
                machine.take_laps().for_each(|lap| place.stopwatch.book(cycle, lap));
                if matches!(outcome, session::Outcome::Computed) {
                    if let Some(touch) = place.touch {
                        touch(&mut machine);
                    }
                    if let Some((touch, number)) = place.touch_once.take() {
                        touch(&mut machine, number);
                    }
                }
                place.machine = Some(machine);
                world.step(host, session::Event::Done(outcome))?;
            }
            Arrival::Sorted(sorted, ns) => {
                world.surroundings.traffic.sort_ns += ns;
                world.apply(Event::Sorted(sorted))?;
            }
        }
    }
    Err(Error::Stuck)
}

impl Process<'_> {
    /// What arrives next.
    fn next(&mut self) -> Result<Arrival, Error> {
        match self.queue.pop_front() {
            Some(arrival) => Ok(arrival),
            None => self.wait(),
        }
    }

    /// The next end of a task or sort; nothing else can happen when the queue is empty.
    fn wait(&mut self) -> Result<Arrival, Error> {
        if self.away == 0 {
            return Err(Error::Stuck);
        }
        self.away -= 1;
        if self.pool.is_some() {
            return self.receive.recv().map_err(|e| Error::Surroundings(e.to_string()));
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
}

impl Surroundings for Process<'_> {
    fn post(&mut self, sessions: &Sessions, parcel: Parcel) -> Result<(), Error> {
        self.traffic.bytes += parcel.bytes;
        if let (End::Host(from), End::Host(to)) = (parcel.from, parcel.to) {
            self.traffic.peer_bytes += parcel.bytes;
            let (of, sent) = &mut self.places[from].peers;
            if std::mem::replace(of, parcel.epoch) != parcel.epoch {
                sent.clear();
            }
            if let Some(position) = sessions.position(to) {
                *sent.entry(position).or_default() += parcel.bytes;
            }
        }
        self.queue.push_back(Arrival::Parcel(parcel));
        Ok(())
    }

    fn compute(&mut self, _: &Sessions, host: usize, task: Task) -> Result<(), Error> {
        let mut machine = self.places[host].machine.take().ok_or(Error::TwoTasks)?;
        match &self.pool {
            None => {
                if self.cycles_from.is_none() && matches!(task, Task::Border { .. }) {
                    self.cycles_from = Some([alone(&machine), self.traffic.sort_ns]);
                }
                let ends_cycle = matches!(task, Task::Integrate { .. });
                let outcome = machine.run(task);
                if ends_cycle && let Some([from, sorted]) = self.cycles_from {
                    // Where there is another thread a sort runs beside the cycles.
                    let sorts = if self.threads == 1 { self.traffic.sort_ns - sorted } else { 0 };
                    self.traffic.serial_ns = Some(alone(&machine).saturating_sub(from + sorts));
                }
                self.queue.push_back(Arrival::Done(host, machine, outcome));
            }
            Some(pool) => {
                let send = self.send.clone();
                self.away += 1;
                pool.spawn(move || {
                    let outcome = machine.run(task);
                    // The receiver is gone only when the run is over.
                    let _ = send.send(Arrival::Done(host, machine, outcome));
                });
            }
        }
        Ok(())
    }

    fn sort(&mut self, _: &Sessions, basis: Arc<SortBasis>, x: Gathered) -> Result<(), Error> {
        if self.threads == 1 && self.pool.is_none() {
            let (sorted, ns) = timed_sort(&basis, &x);
            self.queue.push_back(Arrival::Sorted(sorted, ns));
            return Ok(());
        }
        let send = self.send.clone();
        self.away += 1;
        let work = move || {
            let (sorted, ns) = timed_sort(&basis, &x);
            // The receiver is gone only when the run is over.
            let _ = send.send(Arrival::Sorted(sorted, ns));
        };
        match &self.pool {
            Some(pool) => pool.spawn(work),
            None => self.team.beside(work),
        }
        Ok(())
    }

    fn timer(&mut self, seconds: f64) {
        self.timer = Some(Instant::now() + Duration::from_secs_f64(seconds));
    }

    fn take(&mut self, action: Action) -> Result<(), Error> {
        self.sink.take(action).map_err(Error::Surroundings)
    }

    fn dismiss(&mut self, host: usize) {
        self.places[host].lost = true;
    }

    fn forget(&mut self, host: usize) {
        if let Some(machine) = &mut self.places[host].machine {
            machine.forget();
        }
    }

    fn is_alive(&self, host: usize) -> bool {
        !self.places[host].lost
    }

    fn worked(&self, host: usize) -> Option<Work> {
        Some(self.places[host].machine.as_ref().map(|machine| machine.work()).unwrap_or_default())
    }

    fn report(&self, sessions: &Sessions, host: usize) -> Option<Report> {
        let LocalWorker { stopwatch, peers: (epoch, peers), .. } = &self.places[host];
        let now = *epoch == sessions.hosts[host].session.epoch();
        Some(Report {
            peer_bytes: peers.values().sum(),
            linked: if now { peers.keys().copied().collect() } else { Vec::new() },
            ..stopwatch.report()
        })
    }

    fn hands_over(&self, elements: usize) -> bool {
        elements > WHOLE
    }

    fn send_begins(&mut self) {
        self.send_began = Instant::now();
    }

    fn send_ends(&mut self, host: usize, cycle: u64) {
        let lap = Lap { phase: Phase::Send, from: self.send_began, to: Instant::now() };
        self.places[host].stopwatch.book(cycle, lap);
    }
}

/// CPU time of the calling thread, which runs the tasks of a machine, without what all threads share (ns).
fn alone(machine: &Machine) -> u64 {
    thread_cpu_ns().saturating_sub(machine.dealt_ns())
}

/// A sort and its thread-CPU time (ns).
pub fn timed_sort(basis: &SortBasis, x: &Gathered) -> (Box<Sorted>, u64) {
    let clock = ThreadClock::default();
    let mark = clock.start();
    let sorted = Box::new(basis.sort(x));
    clock.stop(mark, true);
    (sorted, clock.work().contact_ns)
}
