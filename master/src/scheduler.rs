//! The scheduler: one owner of hosts and queue. It hears one [`Notice`] at a time, changes its tables, and starts jobs.
//!
//! Each job that runs has workers of its own and a thread of its own ([`service`]). Which job starts when, on which workers,
//! is [`allotment`]'s to say, which today gives all idle workers to one job at a time; nothing here counts on that.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use protocol::{
    handshake::Hello,
    options::JobOptions,
    request::{Ended, State, Status},
};
use tokio::sync::{mpsc, watch};
use tracing::{info, warn};
use worker::notify;

use crate::{
    connection::Acceptor,
    drive::{self, Input, WorkerLink},
    footprint::{self, Bearer},
    hosts::Hosts,
    http::board::Board,
    notice::{Error, Notice},
    queue::{self, Change, Entry, Queue, Starts, is_over},
    scheduler::retention::Limits,
    service::{self, Order},
    snapshot::store,
    spool::{self, Left, Record, Spool},
};

mod allotment;
pub mod retention;
#[cfg(test)]
mod tests;

/// The longest that an ending master waits until the jobs under way are stored.
const END_LIMIT: Duration = Duration::from_secs(60);
/// Between two looks of a job at the time that its workers take.
const WAKE_EVERY: Duration = Duration::from_secs(1);
/// The first and the longest pause of a queue whose host is short of something (s).
const PAUSES: [u64; 2] = [2, 30];

/// The owner of hosts and queue, and of all jobs under way.
pub struct Scheduler {
    folder: PathBuf,
    spool: Spool,
    started: Instant,
    /// What every worker's arithmetic must come to.
    proof: String,
    notices: mpsc::Sender<Notice>,
    hosts: Hosts,
    /// By connection: those that were welcomed and have not left.
    worker_links: BTreeMap<u32, WorkerLink>,
    queue: Queue,
    status: BTreeMap<u32, watch::Sender<Status>>,
    /// By the number of the job.
    running: BTreeMap<u32, Running>,
    /// What the page shows; none without a page.
    board: Option<Arc<Board>>,
    /// Jobs whose records on disk are older than what is here.
    unwritten: BTreeSet<u32>,
    /// Set while this host is short of what a job needs.
    pause: Option<Pause>,
    /// What is kept of jobs that are over.
    limits: Limits,
    /// When that was looked at last.
    looked: Option<Instant>,
}

/// The queue waits: this host has no room, files or memory left. The job that met it is tried again and goes on where it was stored.
struct Pause {
    why: String,
    until: Instant,
    seconds: u64,
}

/// A job under way.
struct Running {
    /// Ends it.
    stop: Arc<AtomicBool>,
    /// The way to its thread.
    line: mpsc::Sender<Input>,
}

impl Running {
    /// What ends it.
    fn stopper(&self) -> impl FnOnce() + use<> {
        let (stop, line) = (Arc::clone(&self.stop), self.line.clone());
        move || {
            stop.store(true, Ordering::Relaxed);
            // A full line keeps its thread awake anyway.
            let _ = line.try_send(Input::Wake);
        }
    }
}

impl Scheduler {
    /// With what an earlier master left.
    pub fn new(
        folder: PathBuf,
        spool: Spool,
        left: Left,
        notices: mpsc::Sender<Notice>,
        board: Option<Arc<Board>>,
    ) -> Self {
        let mut owner = Self {
            folder,
            spool,
            started: Instant::now(),
            proof: mechanics::proof::of_this_machine(),
            notices,
            hosts: Hosts::default(),
            worker_links: BTreeMap::new(),
            queue: Queue::new(left.first),
            status: BTreeMap::new(),
            running: BTreeMap::new(),
            board,
            unwritten: BTreeSet::new(),
            pause: None,
            limits: Limits::default(),
            looked: None,
        };
        for why in &left.warnings {
            warn!("{why}");
        }
        for (record, text) in left.jobs {
            owner.restore(record, text);
        }
        owner
    }

    /// Keeps no more than this of jobs that are over.
    #[must_use]
    pub fn keeping(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// A job of an earlier master; one that was under way goes on.
    fn restore(&mut self, record: Record, text: String) {
        let Record { job, name, title, state, options, at_work, cycle, time, ended, .. } = record.clone();
        let Record { deck_sum, starts, cancelled, elements, .. } = record;
        let interrupted = state == State::Running;
        let state = if interrupted { State::Queued } else { state };
        if !is_over(state) {
            info!(job, title, interrupted, "job of an earlier master");
        }
        self.status.insert(
            job,
            watch::Sender::new(Status { state, cycle, time, ended, ..Status::queued(job, title) }),
        );
        let folder = (!options.no_output).then(|| self.spool.results(job));
        let before = interrupted.then_some(at_work);
        let text = Arc::new(text);
        let entry = Entry {
            id: job,
            name,
            text,
            options,
            state,
            folder,
            before,
            deck_sum,
            starts,
            cancelled,
            elements,
        };
        self.queue.restore(entry);
        let verdict = if cancelled && matches!(state, State::Queued | State::Held) {
            Some((Change::Cancel, Ended::default()))
        } else if interrupted && starts.are_too_many(store::newest(&self.spool.snapshots(job))) {
            let failure = Some(format!(
                "held: {} masters ended while they ran it, and none of them stored it anew; look at the memory of this host, then `bolide resume {job}`",
                starts.count
            ));
            Some((Change::Hold, Ended { failure, ..Ended::default() }))
        } else {
            None
        };
        let Some((change, ended)) = verdict else { return };
        warn!(job, "{}", ended.failure.as_deref().unwrap_or("it was cancelled before the master ended"));
        if let Err(why) = self.change(job, change, Some(ended)) {
            warn!(job, "{why}");
        }
    }

    /// Puts on disk how a job stands, before anybody is told. One that was begun is called running until it is over.
    fn record(&self, job: u32, ended: Option<Ended>) -> Result<(), spool::Fault> {
        let (Some(entry), Some(status)) = (self.queue.get(job), self.status.get(&job)) else { return Ok(()) };
        let begun = entry.before.is_some() && !is_over(entry.state);
        let record = {
            let status = status.borrow();
            Record {
                job,
                name: entry.name.clone(),
                title: status.title.clone(),
                state: if begun { State::Running } else { entry.state },
                options: entry.options.clone(),
                at_work: entry.before.clone().unwrap_or_default(),
                cycle: status.cycle,
                time: status.time,
                ended,
                deck_sum: entry.deck_sum.clone(),
                starts: entry.starts,
                cancelled: entry.cancelled,
                elements: entry.elements,
            }
        };
        // A few kilobytes; the job's own thread does not wait for it.
        tokio::task::block_in_place(|| self.spool.change(&record))
    }

    /// Hears notices until it is to stop, then lets the jobs under way be stored.
    pub async fn run(mut self, mut heard: mpsc::Receiver<Notice>, stop: &AtomicBool, acceptor: &Acceptor) {
        let mut look = tokio::time::interval(Duration::from_millis(100));
        let (alive, mut said) = (notify::interval(), Instant::now());
        let mut wake = tokio::time::interval(WAKE_EVERY);
        while !stop.load(Ordering::Relaxed) {
            tokio::select! {
                notice = heard.recv() => if let Some(notice) = notice {
                    self.hear(notice);
                    self.start_next();
                },
                // An interrupted job waits for its workers for a while.
                _ = look.tick() => self.start_next(),
                _ = wake.tick() => {
                    self.wake();
                    self.write_late();
                    self.remove_expired();
                }
            }
            // Here, so that a manager sees a scheduler that is stuck.
            if alive.is_some_and(|interval| said.elapsed() >= interval) {
                notify::say("WATCHDOG=1");
                said = Instant::now();
            }
        }
        notify::say("STOPPING=1\nSTATUS=storing the job under way");
        // From here on END_LIMIT bounds what it waits for.
        tokio::spawn(notify::live());
        self.end(&mut heard, acceptor).await;
    }

    /// Lets the jobs under way be stored, and says good-bye.
    async fn end(&mut self, heard: &mut mpsc::Receiver<Notice>, acceptor: &Acceptor) {
        for running in self.running.values() {
            let line = running.line.clone();
            // Beside what is heard below: the line may be full.
            tokio::spawn(async move { line.send(Input::Suspend).await.is_ok() });
        }
        let _ = tokio::time::timeout(END_LIMIT, async {
            let mut wake = tokio::time::interval(WAKE_EVERY);
            while !self.running.is_empty() {
                tokio::select! {
                    notice = heard.recv() => match notice {
                        Some(notice) => self.hear(notice),
                        None => return,
                    },
                    _ = wake.tick() => self.wake(),
                }
            }
        })
        .await;
        acceptor.end();
        let leaving = self.worker_links.values().map(|worker_link| {
            let sender = worker_link.sender();
            tokio::spawn(async move { protocol::dial::leave(&sender, "the master is ending").await })
        });
        for left in leaving.collect::<Vec<_>>() {
            // A panic there would be a bug that the end of the process hides anyway.
            let _ = left.await;
        }
    }

    /// Lets the jobs under way look at the time that their workers take.
    fn wake(&self) {
        for running in self.running.values() {
            // A full line keeps its thread awake anyway.
            let _ = running.line.try_send(Input::Wake);
        }
    }

    /// A job could not go on for want of something on this host.
    fn pause(&mut self, job: u32, why: &str) {
        let seconds = self.pause.as_ref().map_or(PAUSES[0], |pause| (2 * pause.seconds).min(PAUSES[1]));
        warn!(job, "the queue pauses for {seconds} s: {why}");
        let until = Instant::now() + Duration::from_secs(seconds);
        self.pause = Some(Pause { why: why.to_owned(), until, seconds });
    }

    /// Changes the tables. A client that does not wait for its answer any more is none of our business.
    fn hear(&mut self, notice: Notice) {
        match notice {
            Notice::Knock { hello, address, incarnation, answer } => {
                let _ = answer.send(self.admit(&hello, &address, incarnation));
            }
            Notice::Joined(worker_link) => {
                let WorkerLink { spec, address, certificate, .. } = &worker_link;
                info!(
                    address,
                    certificate,
                    speed = spec.speed,
                    threads = spec.threads,
                    "worker {} joined",
                    spec.name
                );
                self.offer(&worker_link);
                self.worker_links.insert(worker_link.incarnation, worker_link);
            }
            Notice::Left { incarnation, why, dropped } => {
                self.worker_links.remove(&incarnation);
                match dropped {
                    true => self.hosts.drop_out(incarnation, &why),
                    false => self.hosts.lose(incarnation, &why),
                }
            }
            Notice::Suspect { incarnation, note } => self.hosts.suspect(incarnation, note),
            Notice::Submit { name, title, text, elements, options, answer } => {
                let _ = answer.send(self.submit(name, title, (text, elements), options));
            }
            Notice::Alive(answer) => {
                let _ = answer.send(());
            }
            Notice::Jobs(answer) => {
                let _ = answer.send(self.status.values().map(|s| s.borrow().clone()).collect());
            }
            Notice::Hosts(answer) => {
                let _ = answer.send(self.hosts.rows());
            }
            Notice::Watch(job, answer) => {
                let _ = answer.send(self.watch(job));
            }
            Notice::Cancel(job, answer) => {
                let _ = answer.send(self.cancel(job));
            }
            Notice::Resume(job, answer) => {
                let _ = answer.send(self.resume(job));
            }
            Notice::Remove(job, answer) => {
                let _ = answer.send(self.remove(job).map(|()| format!("job {job} is removed")));
            }
            Notice::Folder(job, answer) => {
                let _ = answer.send(self.folder(job));
            }
            Notice::Over(job, change, ended) => {
                self.running.remove(&job);
                self.hosts.release(job);
                self.queue.forget_starts(job);
                match &ended.failure {
                    Some(why) if matches!(change, Change::Suspend) => self.pause(job, why),
                    _ if matches!(change, Change::Suspend) => {}
                    Some(why) => warn!(job, "job failed: {why}"),
                    None => {
                        info!(job, digest = ended.digest, "job over");
                        self.pause = None;
                    }
                }
                if let Err(why) = self.change(job, change, Some(*ended)) {
                    warn!(job, "{why}");
                }
            }
        }
    }

    /// A worker that comes while jobs run is given to one of them.
    fn offer(&mut self, worker_link: &WorkerLink) {
        let job = allotment::for_newcomer(self.running.keys().copied());
        if let Some((job, Running { line, .. })) = job.and_then(|job| self.running.get_key_value(&job)) {
            self.hosts.occupy(&[worker_link.incarnation], *job);
            let (line, worker_link) = (line.clone(), worker_link.clone());
            // A job that is over by then gives all its hosts back.
            tokio::spawn(async move { line.send(Input::Joined(worker_link)).await.is_ok() });
        }
    }

    fn admit(&mut self, hello: &Hello, address: &str, incarnation: u32) -> Result<u32, String> {
        hello.proves(&self.proof)?;
        let (number, ghost) = self.hosts.admit(hello, address, incarnation)?;
        if let Some(ghost) = ghost.and_then(|ghost| self.worker_links.remove(&ghost)) {
            ghost.sender().abort(protocol::Error::Message("its process called again".into()));
        }
        Ok(number)
    }

    fn submit(
        &mut self,
        name: String,
        title: String,
        (text, elements): (String, u64),
        options: JobOptions,
    ) -> Result<u32, Error> {
        let job = self.queue.add(name.clone(), (text, elements), options.clone(), &self.folder)?;
        let record = Record {
            job,
            name,
            title: title.clone(),
            state: State::Queued,
            options,
            at_work: Vec::new(),
            cycle: 0,
            time: 0.0,
            ended: None,
            deck_sum: self.queue.get(job).map(|entry| entry.deck_sum.clone()).unwrap_or_default(),
            starts: Starts::default(),
            cancelled: false,
            elements,
        };
        let text = self.queue.get(job).map(|entry| Arc::clone(&entry.text)).unwrap_or_default();
        // Who is told that the job is queued finds it in the queue of the next master as well.
        if let Err(why) = tokio::task::block_in_place(|| self.spool.add(&record, &text)) {
            self.queue.take_back(job);
            return Err(Error::Disk { asked: "the job is not queued".to_owned(), why });
        }
        info!(job, title, "job queued");
        self.status.insert(job, watch::Sender::new(Status::queued(job, title)));
        Ok(job)
    }

    fn watch(&self, job: Option<u32>) -> Result<watch::Receiver<Status>, Error> {
        let job = job.or_else(|| self.queue.last()).ok_or(Error::NoJob)?;
        let status = self.status.get(&job).ok_or(queue::Error::Unknown(job))?;
        Ok(status.subscribe())
    }

    fn cancel(&mut self, job: u32) -> Result<String, Error> {
        queue::after(self.queue.get(job).ok_or(queue::Error::Unknown(job))?.state, Change::Cancel)?;
        // Who is told so finds it cancelled after a death of this master as well.
        self.queue.set_cancelled(job, true);
        if let Err(why) = self.record(job, self.ended(job)) {
            self.queue.set_cancelled(job, false);
            self.unwritten.insert(job);
            return Err(Error::Disk { asked: format!("job {job} is not cancelled"), why });
        }
        if let Some(stop) = self.running.get(&job).map(Running::stopper) {
            stop();
            return Ok(format!("job {job} ends after its present cycle"));
        }
        self.change(job, Change::Cancel, Some(Ended::default()))?;
        Ok(format!("job {job} is cancelled"))
    }

    /// How a job ended that is over.
    fn ended(&self, job: u32) -> Option<Ended> {
        self.status.get(&job).and_then(|status| status.borrow().ended.clone())
    }

    /// Puts on disk what there was no room for.
    fn write_late(&mut self) {
        for job in std::mem::take(&mut self.unwritten) {
            if self.record(job, self.ended(job)).is_err() {
                self.unwritten.insert(job);
            }
        }
    }

    fn resume(&mut self, job: u32) -> Result<String, Error> {
        let state = self.queue.get(job).ok_or(queue::Error::Unknown(job))?.state;
        queue::after(state, Change::Resume)?;
        let sum = self.queue.get(job).map(|entry| entry.deck_sum.clone()).unwrap_or_default();
        let text = tokio::task::block_in_place(|| self.spool.text(job, &sum)).map_err(Error::Deck)?;
        let state = self.queue.resume(job, text)?;
        self.record(job, None)
            .map_err(|why| Error::Disk { asked: format!("that job {job} goes on is not on disk"), why })?;
        if let Some(status) = self.status.get(&job) {
            status.send_modify(|status| (status.state, status.ended) = (state, None));
        }
        Ok(format!("job {job} goes on where it was stored"))
    }

    fn folder(&self, job: u32) -> Result<PathBuf, Error> {
        let entry = self.queue.get(job).ok_or(queue::Error::Unknown(job))?;
        let folder = entry.folder.clone().ok_or(Error::WritesNone(job))?;
        if folder.is_dir() {
            return Ok(folder);
        }
        Err(Error::NoResults(job, entry.state))
    }

    fn change(&mut self, job: u32, change: Change, ended: Option<Ended>) -> Result<(), queue::Error> {
        let (state, forgotten) = self.queue.apply(job, change)?;
        let ended = ended.filter(|_| is_over(state));
        if let Err(why) = self.record(job, ended.clone()) {
            warn!(job, "its record is not on disk yet: {why}");
            self.unwritten.insert(job);
        }
        if let Some(status) = self.status.get(&job) {
            status.send_modify(|status| {
                status.state = state;
                status.waits_for = None;
                status.ended = ended;
            });
        }
        for job in forgotten {
            self.status.remove(&job);
            self.spool.forget(job);
        }
        Ok(())
    }

    /// Starts the first of the waiting jobs that may start on the workers that are idle, and says what each of the others waits for.
    fn start_next(&mut self) {
        let waiting = self.queue.waiting();
        if waiting.is_empty() {
            return;
        }
        if let Some(pause) = self.pause.as_ref().filter(|pause| Instant::now() < pause.until) {
            let what = format!("{}; tried again within {} s", pause.why, pause.seconds);
            return waiting.iter().for_each(|entry| self.wait_for(entry.id, what.clone()));
        }
        let idle = self.hosts.idle().filter_map(|host| self.worker_links.get(&host.incarnation));
        let idle: Vec<&WorkerLink> = idle.collect();
        let bearers: Vec<Bearer<'_>> = idle.iter().map(|link| link.bearer()).collect();
        let running: Vec<u32> = self.running.keys().copied().collect();
        let available = footprint::available();
        let allotments = allotment::among(&waiting, &running, &bearers, self.started.elapsed(), available);
        for (job, what) in allotments.waits {
            self.wait_for(job, what);
        }
        if let Some(job) = allotments.starts {
            let worker_links = idle.into_iter().cloned().collect();
            self.start(job, worker_links);
        }
    }

    /// Starts a job on these workers, on a thread of its own.
    fn start(&mut self, job: u32, worker_links: Vec<WorkerLink>) {
        let (Some(entry), Some(status)) = (self.queue.get(job), self.status.get(&job).cloned()) else {
            return;
        };
        let stop = Arc::new(AtomicBool::new(false));
        let line = drive::channel(worker_links.len());
        let running = Running { stop: Arc::clone(&stop), line: line.0.clone() };
        let incarnations: Vec<u32> = worker_links.iter().map(|worker_link| worker_link.incarnation).collect();
        let at_work = worker_links.iter().map(|worker_link| worker_link.spec.name.clone()).collect();
        let order = Order {
            number: job,
            name: entry.name.clone(),
            text: Arc::clone(&entry.text),
            options: entry.options.clone(),
            folder: entry.folder.clone(),
            snapshots: self.spool.snapshots(job),
            at_work_before: entry.before.as_ref().map(Vec::len),
            worker_links,
            line: Mutex::new(Some(line)),
            stop,
            status,
            board: self.board.clone(),
            notices: self.notices.clone(),
        };
        self.hosts.occupy(&incarnations, job);
        self.running.insert(job, running);
        self.queue.set_at_work(job, at_work, store::newest(&self.spool.snapshots(job)));
        info!(job, workers = incarnations.len(), "job starts");
        if let Err(why) = self.change(job, Change::Start, None) {
            warn!(job, "{why}");
        }
        let notices = self.notices.clone();
        let started = std::thread::Builder::new().name(format!("job-{job}")).spawn(move || {
            let (change, ended) = service::serve(&order);
            drop(order);
            // The scheduler is gone only when the daemon ends.
            let _ = notices.blocking_send(Notice::Over(job, change, Box::new(ended)));
        });
        if let Err(error) = started {
            let ended = Ended { failure: Some(format!("its thread: {error}")), ..Ended::default() };
            self.hear(Notice::Over(job, Change::Fail, Box::new(ended)));
        }
    }

    fn wait_for(&self, job: u32, what: String) {
        if let Some(status) = self.status.get(&job) {
            status.send_if_modified(|status| {
                let new = status.waits_for.as_ref() != Some(&what);
                status.waits_for = Some(what);
                new
            });
        }
    }
}
