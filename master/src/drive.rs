//! DRIVE: a job's session over links to its workers.
//!
//! The calling thread owns the [`Job`]. What comes from the connections' tasks are its events; its actions are sent
//! through the links' queues without waiting, or given to the sink. Nothing is decided here.

mod worker_link;

use std::{
    collections::{BTreeMap, VecDeque},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use protocol::{
    frame::Header,
    message::{ToMaster, ToWorker},
    order::Place,
};
use system::processors::lowest_priority;
use tokio::sync::mpsc;
use tracing::warn;

use crate::{
    embedded::{Sink, Traffic, timed_sort},
    event::{Action, Event, Outcome},
    footprint::{self, Bearer},
    job::Job,
    pace::{Pace, Waiting},
    peers,
    sort::{Gathered, SortBasis, Sorted, What},
};
use worker_link::Member;
pub use worker_link::{Delivery, WorkerLink};

/// Messages of one worker that may wait for the job's thread.
const WAITING_PER_WORKER: usize = 8;

/// What reaches the job's thread.
pub enum Input {
    /// A message, with the header of its frame.
    Message(usize, Header, ToMaster),
    /// A worker's connection has ended.
    Lost(usize, String),
    /// A sort is done, with its thread-CPU time (ns); or the sort had a bug.
    Sorted(Result<(Box<Sorted>, u64), String>),
    /// A worker has come while the job runs.
    Joined(WorkerLink),
    /// Another job needs the worker on this connection.
    Yield(u32),
    /// The worker on this connection has so many threads from now on.
    Threads(u32, u32),
    /// Look at what is to be stopped.
    Wake,
    /// This process has to leave.
    Suspend,
}

/// The way to the thread of a job that begins with `n_workers`.
pub fn channel(n_workers: usize) -> (mpsc::Sender<Input>, mpsc::Receiver<Input>) {
    mpsc::channel(WAITING_PER_WORKER * n_workers + 1)
}

/// Runs job `number` on these workers, and those that join, to its end; `first` are the actions that came with the job,
/// and `line` is its [`channel`].
///
/// # Errors
/// What the sink refused, or that workers die of the job; the workers are released all the same.
pub fn drive(
    job: Job,
    first: Vec<Action>,
    number: u32,
    worker_links: &[WorkerLink],
    line: (mpsc::Sender<Input>, mpsc::Receiver<Input>),
    sink: &mut dyn Sink,
    stop: &AtomicBool,
) -> Result<(Outcome, Traffic), Error> {
    let (send, input) = line;
    let n_elements = job.n_elements();
    let mut driver = Driver {
        place: Place { job: number, epoch: job.epoch(), plan: 0 },
        job,
        members: Vec::new(),
        send,
        input,
        lost: VecDeque::new(),
        timer: None,
        sort_ns: 0,
        sorting: 0,
        outcome: None,
        began: Instant::now(),
        pace: Pace::new(n_elements),
        suspect: None,
        slow: BTreeMap::new(),
        ends: false,
        deaths: Deaths::default(),
    };
    for worker_link in worker_links {
        driver.worker_link(worker_link.clone());
    }
    driver.introduce();
    driver.begin_pace();
    let result = driver.run(first, sink, stop);
    for Member { link, .. } in driver.members.iter().filter(|member| !member.is_freed()) {
        link.delivery.close(number);
        if result.is_err() {
            // A worker that cannot be reached is found lost by its connection's task.
            let _ = link.send(driver.place, &ToWorker::Release);
        }
    }
    let bytes = driver.members.iter().map(Member::bytes).sum::<u64>();
    result.map(|outcome| {
        let peer_bytes = outcome.reports.iter().map(|report| report.peer_bytes).sum();
        (outcome, Traffic { bytes: bytes + peer_bytes, peer_bytes, sort_ns: driver.sort_ns, serial_ns: None })
    })
}

struct Driver {
    job: Job,
    place: Place,
    /// In the order they came.
    members: Vec<Member>,
    send: mpsc::Sender<Input>,
    input: mpsc::Receiver<Input>,
    /// Workers found lost while sending.
    lost: VecDeque<(usize, String)>,
    /// When the job is told that its time has passed.
    timer: Option<Instant>,
    sort_ns: u64,
    /// Sorts under way: the workers may have nothing to do.
    sorting: usize,
    outcome: Option<Outcome>,
    began: Instant,
    pace: Pace,
    /// The worker that the others were told is suspect.
    suspect: Option<usize>,
    /// Workers that compute a part of their time only, in words.
    slow: BTreeMap<usize, String>,
    /// Somebody waits for the end of the job.
    ends: bool,
    deaths: Deaths,
}

/// Why a job cannot be driven any further.
#[derive(Debug)]
pub enum Error {
    /// What the disk or this host refused.
    Sink(String),
    /// Workers were lost again and again, and the job came no further.
    Deaths { deaths: usize, cycle: u64, last: String },
    /// Workers were lost, and what they leave does not fit into the memory of the others.
    Memory { lost: String, needs: String },
}

impl From<String> for Error {
    fn from(reason: String) -> Self {
        Self::Sink(reason)
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sink(reason) => f.write_str(reason),
            Self::Deaths { deaths, cycle, last } => write!(
                f,
                "{deaths} workers were lost and the job came no further than cycle {cycle}; the last one: {last}; look at their memory, then `bolide resume`"
            ),
            Self::Memory { lost, needs } => {
                write!(f, "the job waits for workers, since without {lost} it needs {needs}")
            }
        }
    }
}

/// Losses of workers since the job last came further.
#[derive(Default)]
struct Deaths {
    deaths: usize,
    /// The furthest cycle, and the most workers at a time.
    cycle: u64,
    most: usize,
}

impl Deaths {
    /// Times that each worker may be lost.
    const EACH: usize = 3;

    /// A worker is lost.
    fn count(&mut self, last: &str) -> Result<(), Error> {
        self.deaths += 1;
        if self.deaths < Self::EACH * self.most.max(1) {
            return Ok(());
        }
        Err(Error::Deaths { deaths: self.deaths, cycle: self.cycle, last: last.to_owned() })
    }

    fn progress(&mut self, cycle: u64) {
        if cycle > self.cycle {
            (self.cycle, self.deaths) = (cycle, 0);
        }
    }
}

/// How far a message says that its worker has come, as [`Pace`] counts it.
const fn position(message: &ToMaster) -> Option<u64> {
    match message {
        ToMaster::Ready { .. } => Some(1),
        ToMaster::Cycle { cycle, .. } | ToMaster::Votes { cycle, .. } => Some(cycle.saturating_add(2)),
        ToMaster::At { position } => Some(*position),
        _ => None,
    }
}

impl Driver {
    /// Takes a worker in.
    fn worker_link(&mut self, worker_link: WorkerLink) {
        let index = self.members.len();
        if let Err(why) = worker_link.delivery.open(self.place.job, index, self.send.clone()) {
            self.lost.push_back((index, why));
        }
        self.members.push(Member::new(worker_link));
    }

    /// Tells the epoch's workers where they find each other, before they are dealt their work.
    fn introduce(&mut self) {
        if self.job.route() == protocol::options::Route::Direct {
            let at_work: Vec<(usize, &WorkerLink)> =
                self.job.at_work().iter().map(|&index| (index, &self.members[index].link)).collect();
            self.lost.extend(peers::introduce(&at_work, self.place));
        }
    }

    fn now(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// An epoch begins.
    fn begin_pace(&mut self) {
        let now = self.now();
        self.pace.begin(self.job.at_work(), now);
        self.deaths.most = self.deaths.most.max(self.job.at_work().len());
    }

    /// Names the worker that the job waits for, and gives it up when it is late.
    fn look_for_late(&mut self, sink: &mut dyn Sink) -> Result<(), Error> {
        if self.sorting > 0 {
            return Ok(());
        }
        let now = self.now();
        for &worker in self.job.at_work() {
            self.pace.hear_bytes(worker, self.members[worker].link.bytes(), now);
        }
        let Some(waiting) = self.pace.waits_for(self.ends, now) else { return Ok(()) };
        if self.pace.asks() {
            let at_work = self.job.at_work().iter().map(|&worker| (worker, &self.members[worker].link));
            let asked = at_work.map(|(worker, link)| (worker, link.send(self.place, &ToWorker::Where)));
            let lost = asked.filter_map(|(worker, sent)| sent.err().map(|error| (worker, error.to_string())));
            let lost: Vec<_> = lost.collect();
            self.lost.extend(lost);
            return Ok(());
        }
        let Waiting { worker, silence, longest, late } = waiting;
        let worker_link = &self.members[worker].link;
        let words = format!(
            "the job waits for it for {silence:.1} s, the longest wait before was {longest:.3} s; its link lives, so its computing is stuck"
        );
        if !late {
            if self.suspect != Some(worker) {
                warn!("worker {} is suspect: {words}", worker_link.spec.name);
                sink.suspect(worker_link.incarnation, Some(format!("suspect: {words}")));
                self.suspect = Some(worker);
            }
            return Ok(());
        }
        let why = format!("{} at {}: {words}", worker_link.spec.name, worker_link.address);
        warn!("worker {} is given up: {words}", worker_link.spec.name);
        worker_link.sender().abort(protocol::Error::Message(why.clone()));
        worker_link.delivery.close(self.place.job);
        self.suspect = None;
        self.lose(worker, why, sink)
    }

    fn lose(&mut self, worker: usize, why: String, sink: &mut dyn Sink) -> Result<(), Error> {
        if self.job.at_work().contains(&worker) && !self.ends {
            self.deaths.count(&why)?;
            self.check_memory(worker)?;
        }
        self.apply(Event::Lost(worker, why), sink)
    }

    /// Whether the workers at work have memory for the whole job without one of them. The system would end those that have none.
    fn check_memory(&self, without: usize) -> Result<(), Error> {
        match footprint::shortage(self.job.n_elements() as u64, None, &self.bearers(without)) {
            Some(needs) => Err(Error::Memory { lost: self.members[without].link.spec.name.clone(), needs }),
            None => Ok(()),
        }
    }

    /// The workers at work without one of them.
    fn bearers(&self, without: usize) -> Vec<Bearer<'_>> {
        let left = self.job.at_work().iter().filter(|&&worker| worker != without);
        left.map(|&worker| self.members[worker].link.bearer()).collect()
    }

    /// Takes a worker in that has memory for its share of the job; another one stays idle until the job is over.
    fn take_in(&mut self, worker_link: WorkerLink, sink: &mut dyn Sink) -> Result<(), Error> {
        let spec = worker_link.spec.clone();
        let mut bearers = self.bearers(usize::MAX);
        let is_alone = bearers.is_empty();
        bearers.push(worker_link.bearer());
        match footprint::shortage(self.job.n_elements() as u64, None, &bearers) {
            Some(needs) if is_alone => Err(Error::Memory { lost: "those that were lost".to_owned(), needs }),
            Some(needs) => {
                warn!("worker {} is not taken into the job, which would need {needs}", spec.name);
                Ok(())
            }
            None => {
                self.worker_link(worker_link);
                self.apply(Event::Joined(spec), sink)
            }
        }
    }

    /// The worker on a connection; none if it is not this job's any more.
    fn member_on(&self, incarnation: u32) -> Option<usize> {
        let is_it = |member: &Member| member.link.incarnation == incarnation && !member.is_freed();
        self.members.iter().rposition(is_it)
    }

    /// A worker's threads have changed.
    fn set_threads(&mut self, incarnation: u32, threads: u32, sink: &mut dyn Sink) -> Result<(), Error> {
        let Some(worker) = self.member_on(incarnation) else { return Ok(()) };
        self.members[worker].link.compute_with(threads);
        self.apply(Event::Threads(worker, threads), sink)
    }

    /// Tells whether a worker computes a part of its time only, when that has changed.
    fn hear_slow(&mut self, worker: usize, slow: Option<&String>, sink: &mut dyn Sink) {
        if self.slow.get(&worker) == slow {
            return;
        }
        sink.slow(self.members[worker].link.incarnation, slow.cloned());
        match slow {
            Some(words) => self.slow.insert(worker, words.clone()),
            None => self.slow.remove(&worker),
        };
    }

    /// A worker has been released: from here on it can be given to another job.
    fn free(&mut self, worker: usize, sink: &mut dyn Sink) {
        let job = self.place.job;
        let member = &mut self.members[worker];
        member.free();
        member.link.delivery.close(job);
        sink.freed(member.link.incarnation);
    }

    fn run(&mut self, first: Vec<Action>, sink: &mut dyn Sink, stop: &AtomicBool) -> Result<Outcome, Error> {
        self.act(first, sink)?;
        let mut stopping = false;
        loop {
            if !stopping && stop.load(Ordering::Relaxed) {
                stopping = true;
                self.ends = true;
                self.apply(Event::Stop, sink)?;
            }
            if self.timer.is_some_and(|due| Instant::now() >= due) {
                self.timer = None;
                self.apply(Event::Timer, sink)?;
            }
            if let Some(outcome) = self.outcome.take() {
                return Ok(outcome);
            }
            let input = match self.lost.pop_front() {
                Some((worker, why)) => Input::Lost(worker, why),
                None => {
                    self.input.blocking_recv().ok_or_else(|| "every way to the job is closed".to_owned())?
                }
            };
            let woken = matches!(input, Input::Wake);
            let mut is_answer = false;
            match input {
                Input::Message(worker, header, message) => match self.check(&header, &message) {
                    Ok(()) => {
                        if header.epoch == self.job.epoch() {
                            match (&message, position(&message)) {
                                (ToMaster::At { .. }, Some(position)) => {
                                    is_answer = true;
                                    self.pace.place(worker, position);
                                }
                                (ToMaster::Votes { .. }, Some(position)) => {
                                    self.pace.hear_all(position, self.now());
                                }
                                (_, position) => self.pace.hear(worker, position, self.now()),
                            }
                            if self.suspect == Some(worker) {
                                self.suspect = None;
                                sink.suspect(self.members[worker].link.incarnation, None);
                            }
                            sink.heard(&self.members[worker].link.spec.name, &message);
                            if let ToMaster::Report(report) = &message {
                                self.hear_slow(worker, report.slow.as_ref(), sink);
                            }
                        }
                        self.apply(Event::Message(worker, header.epoch, message), sink)?;
                    }
                    Err(why) => {
                        let worker_link = &self.members[worker].link;
                        let why = format!("{} at {}: {why}", worker_link.spec.name, worker_link.address);
                        worker_link.sender().abort(protocol::Error::Message(why.clone()));
                        self.lose(worker, why, sink)?;
                    }
                },
                Input::Lost(worker, why) => self.lose(worker, why, sink)?,
                Input::Sorted(sorted) => {
                    let (sorted, ns) = sorted?;
                    self.sort_ns += ns;
                    self.sorting = self.sorting.saturating_sub(1);
                    self.apply(Event::Sorted(sorted), sink)?;
                }
                Input::Joined(worker_link) => self.take_in(worker_link, sink)?,
                Input::Yield(incarnation) => {
                    if let Some(worker) = self.member_on(incarnation) {
                        self.apply(Event::Yield(worker), sink)?;
                    }
                }
                Input::Threads(incarnation, threads) => self.set_threads(incarnation, threads, sink)?,
                Input::Wake => self.look_for_late(sink)?,
                Input::Suspend => {
                    self.ends = true;
                    self.apply(Event::Suspend, sink)?;
                }
            }
            if !woken && !is_answer {
                self.pace.touch(self.now());
            }
        }
    }

    /// A cycle's frame follows the plan in force at its cycle, which the totals that answer it follow as well.
    fn check(&mut self, header: &Header, message: &ToMaster) -> Result<(), String> {
        let epoch = self.job.epoch();
        if header.epoch > epoch {
            return Err(format!("frame of epoch {}, this is epoch {epoch}", header.epoch));
        }
        if let ToMaster::Votes { cycle, .. } = message
            && header.epoch == epoch
        {
            if header.cycle != *cycle {
                return Err(format!("votes of cycle {cycle} in a frame of cycle {}", header.cycle));
            }
            // The root may be a plan further when the last vote comes to it; the orders follow the plan that it says.
            self.place.plan = header.plan;
        }
        if let ToMaster::Cycle { cycle, .. } | ToMaster::Gathered { cycle, .. } = message
            && header.epoch == epoch
        {
            let plan = self.job.plan_hash(*cycle);
            if header.cycle != *cycle || plan != Some(header.plan) {
                return Err(format!(
                    "cycle {cycle} in a frame of cycle {} under plan {:016x}, in force is {:016x}",
                    header.cycle,
                    header.plan,
                    plan.unwrap_or_default()
                ));
            }
            self.place.plan = header.plan;
        }
        Ok(())
    }

    fn apply(&mut self, event: Event, sink: &mut dyn Sink) -> Result<(), Error> {
        let actions = self.job.apply(event);
        self.act(actions, sink)
    }

    fn act(&mut self, actions: Vec<Action>, sink: &mut dyn Sink) -> Result<(), Error> {
        if self.place.epoch != self.job.epoch() {
            self.place.epoch = self.job.epoch();
            self.introduce();
            self.begin_pace();
        }
        for action in actions {
            match action {
                Action::Send(worker, message) => {
                    let sent = self.members[worker].link.send(self.place, &message);
                    self.note_sent(worker, sent);
                }
                Action::Pieces(worker, cutting) => {
                    let model = Arc::clone(self.job.model());
                    let make = move || cutting.cut(&model.mesh);
                    let sent = self.members[worker].link.send_later(self.place, make);
                    self.note_sent(worker, sent);
                }
                Action::Sort(bench, x) => {
                    self.sorting += 1;
                    self.sort(bench, x);
                }
                Action::Timer(seconds) => {
                    self.timer = Some(Instant::now() + Duration::from_secs_f64(seconds))
                }
                Action::Dismiss(worker, why) => {
                    let worker_link = &self.members[worker].link;
                    warn!("worker {} at {} is dropped: {why}", worker_link.spec.name, worker_link.address);
                    worker_link.delivery.dismiss(why);
                }
                Action::Freed(worker) => self.free(worker, sink),
                Action::Over(outcome) => self.outcome = Some(*outcome),
                other => {
                    if let Action::Progress(progress) = &other {
                        self.deaths.progress(progress.cycle);
                    }
                    sink.take(other)?;
                }
            }
        }
        Ok(())
    }

    /// A worker to which nothing can be sent is lost.
    fn note_sent(&mut self, worker: usize, sent: protocol::Result<()>) {
        if let Err(error) = sent {
            let worker_link = &self.members[worker].link;
            let why = format!("{} at {}: {error}", worker_link.spec.name, worker_link.address);
            self.lost.push_back((worker, why));
        }
    }

    fn sort(&self, bench: Arc<SortBasis>, x: Gathered) {
        let (send, failed) = (self.send.clone(), self.send.clone());
        // A sort of all is on a thread of the lowest priority: a worker on this host computes first, the sort takes what is idle. For
        // plans of what they have sorted themselves, workers wait.
        let is_long = matches!(x.what, What::Positions(_));
        let work = move || {
            if is_long {
                lowest_priority();
            }
            let sorted = catch_unwind(AssertUnwindSafe(|| timed_sort(&bench, &x)));
            let sorted = sorted.map_err(|_| "a bug in the sort; the log has its words".to_owned());
            // The receiver is gone only when the job is over.
            let _ = send.blocking_send(Input::Sorted(sorted));
        };
        if let Err(error) = std::thread::Builder::new().name("sort".to_owned()).spawn(work) {
            // As above.
            let _ = failed.try_send(Input::Sorted(Err(format!("a thread to sort on: {error}"))));
        }
    }
}
