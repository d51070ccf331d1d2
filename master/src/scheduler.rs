//! The scheduler: one owner of hosts and queue. It hears one [`Notice`] at a time, changes its tables, and starts jobs.
//!
//! Each job that runs has workers of its own and a thread of its own ([`service`](crate::service)). Which job has which workers is
//! [`allotment`]'s to say; [`starting`] does what it says.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::{
        Arc,
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
    drive::{Input, WorkerLink},
    hosts::Hosts,
    http::board::Board,
    notice::{Error, Notice},
    notify::{Notifier, Over},
    queue::{self, Change, Entry, Queue, Size, Starts, Wish, is_over},
    results::Units,
    scheduler::{allotment::Call, retention::Limits},
    snapshot::store,
    spool::{self, Left, Record, Spool},
};

pub mod allotment;
pub mod retention;
mod starting;
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
    /// By connection: workers that are to leave their job for another one.
    called: BTreeMap<u32, Call>,
    /// Jobs whose records on disk are older than what is here.
    unwritten: BTreeSet<u32>,
    /// Set while this host is short of what a job needs.
    pause: Option<Pause>,
    /// What is kept of jobs that are over.
    limits: Limits,
    /// When that was looked at last.
    looked: Option<Instant>,
    /// Tells of each job that is over.
    notifier: Option<Notifier>,
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

    /// Has it stored at its next cycle.
    fn suspend(&self) {
        let line = self.line.clone();
        // Beside what the scheduler hears meanwhile: the line may be full.
        tokio::spawn(async move { line.send(Input::Suspend).await.is_ok() });
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
        notifier: Option<Notifier>,
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
            called: BTreeMap::new(),
            unwritten: BTreeSet::new(),
            pause: None,
            limits: Limits::default(),
            looked: None,
            notifier,
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
        let Record { deck_sum, starts, cancelled, held, elements, cycles, owner, .. } = record;
        let wish = if cancelled { Some(Wish::Cancel) } else { held.then_some(Wish::Hold) };
        let interrupted = state == State::Running;
        let state = if interrupted { State::Queued } else { state };
        if !is_over(state) {
            info!(job, title, interrupted, "job of an earlier master");
        }
        // What is told of a run is not kept: of one without a summary its history has the unit of its time.
        let has_summary = ended.as_ref().is_some_and(|ended| ended.summary.is_some());
        let units = (cycle > 0 && !has_summary).then(|| Units::of_results(&self.spool.results(job)));
        let unit = units.map(|units| units.time).filter(|unit| *unit != Units::named("").time);
        let time_unit = unit.unwrap_or_default().to_owned();
        self.status.insert(
            job,
            watch::Sender::new(Status {
                time_unit,
                state,
                cycle,
                time,
                waits_for: waits_for_user(job, state, ended.as_ref()),
                ended,
                ..Status::queued(job, title)
            }),
        );
        let folder = (!options.no_output).then(|| self.spool.results(job));
        let before = (interrupted || !at_work.is_empty()).then_some(at_work);
        let text = Arc::new(text);
        let entry = Entry {
            id: job,
            name,
            text,
            options,
            state,
            folder,
            before,
            aside: false,
            deck_sum,
            starts,
            wish,
            size: Size { elements, cycles },
            owner,
        };
        self.queue.restore(entry);
        let wished = wish.map(Wish::change).filter(|&change| queue::after(state, change).is_ok());
        let verdict = if let Some(change) = wished {
            Some((change, Ended::default()))
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
        warn!(job, "{}", ended.failure.as_deref().unwrap_or("its user wanted so before the master ended"));
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
                cancelled: entry.wish == Some(Wish::Cancel),
                held: entry.wish == Some(Wish::Hold),
                elements: entry.size.elements,
                cycles: entry.size.cycles,
                owner: entry.owner.clone(),
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
                    self.arrange();
                },
                // An interrupted job waits for its workers for a while.
                _ = look.tick() => self.arrange(),
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
        self.running.values().for_each(Running::suspend);
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
        if let Some(notifier) = self.notifier.take() {
            tokio::task::block_in_place(|| notifier.end());
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
                self.worker_links.insert(worker_link.incarnation, worker_link);
            }
            Notice::Left { incarnation, why, end } => {
                self.worker_links.remove(&incarnation);
                self.called.remove(&incarnation);
                self.hosts.gone(incarnation, &why, end);
            }
            Notice::Suspect { incarnation, note } => self.hosts.suspect(incarnation, note),
            Notice::Slow { incarnation, note } => self.hosts.slow(incarnation, note),
            Notice::Freed { incarnation, job } => {
                self.called.remove(&incarnation);
                self.hosts.free(incarnation, job);
            }
            Notice::Submit { name, title, text, size, options, owner, answer } => {
                let _ = answer.send(self.submit((name, title), (text, size), options, owner));
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
            Notice::Wish(job, wish, answer) => {
                let _ = answer.send(self.wish(job, wish));
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
                self.called.retain(|_, call| call.from != job);
                self.queue.forget_starts(job);
                let wish = self.queue.get(job).and_then(|entry| entry.wish);
                // What is stored, for whatever reason, is where its user wanted it.
                let change = wish.filter(|_| change == Change::Suspend).map_or(change, Wish::change);
                match &ended.failure {
                    Some(why) if matches!(change, Change::Suspend) => self.pause(job, why),
                    _ if matches!(change, Change::Suspend) => {}
                    None if matches!(change, Change::Hold) => info!(job, "job is stored and held"),
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
        (name, title): (String, String),
        (text, size): (String, Size),
        options: JobOptions,
        owner: String,
    ) -> Result<u32, Error> {
        let job =
            self.queue.add(name.clone(), (text, size), (options.clone(), owner.clone()), &self.folder)?;
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
            held: false,
            elements: size.elements,
            cycles: size.cycles,
            owner,
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

    /// Takes a job back, or keeps it back.
    fn wish(&mut self, job: u32, wish: Wish) -> Result<String, Error> {
        let entry = self.queue.get(job).ok_or(queue::Error::Unknown(job))?;
        let (state, before) = (entry.state, entry.wish);
        // One that is to end is as good as over.
        let ends = wish == Wish::Hold && before == Some(Wish::Cancel);
        queue::after(if ends { State::Cancelled } else { state }, wish.change())?;
        // Who is told so finds it done after a death of this master as well.
        self.queue.set_wish(job, Some(wish));
        let (what, verb) = match wish {
            Wish::Cancel => ("cancelled", "ends"),
            Wish::Hold => ("held", "is stored"),
        };
        if let Err(why) = self.record(job, self.ended(job)) {
            self.queue.set_wish(job, before);
            self.unwritten.insert(job);
            return Err(Error::Disk { asked: format!("job {job} is not {what}"), why });
        }
        if let Some(running) = self.running.get(&job) {
            match wish {
                Wish::Cancel => running.stopper()(),
                Wish::Hold => running.suspend(),
            }
            return Ok(format!("job {job} {verb} after its present cycle"));
        }
        self.change(job, wish.change(), Some(Ended::default()))?;
        Ok(format!("job {job} is {what}"))
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
        let entry = self.queue.get(job).ok_or(queue::Error::Unknown(job))?;
        let had_begun = entry.before.is_some() || entry.folder.as_ref().is_some_and(|folder| folder.exists());
        let text =
            tokio::task::block_in_place(|| self.spool.text(job, &entry.deck_sum)).map_err(Error::Deck)?;
        let state = self.queue.resume(job, text, had_begun)?;
        self.record(job, None)
            .map_err(|why| Error::Disk { asked: format!("that job {job} goes on is not on disk"), why })?;
        if let Some(status) = self.status.get(&job) {
            status.send_modify(|status| {
                (status.state, status.ended, status.waits_for) = (state, None, None);
            });
        }
        Ok(format!(
            "job {job} {}",
            if had_begun { "goes on where it was stored" } else { "waits for workers" }
        ))
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
        // One that its user holds has not ended: it is watched until it has.
        let has_ended = |ended: &Ended| is_over(state) && (state != State::Held || ended.failure.is_some());
        let ended = ended.filter(has_ended);
        if let Err(why) = self.record(job, ended.clone()) {
            warn!(job, "its record is not on disk yet: {why}");
            self.unwritten.insert(job);
        }
        if let (Some(notifier), Some(ended), Some(entry)) = (&self.notifier, &ended, self.queue.get(job)) {
            let folder = entry.folder.clone().filter(|folder| folder.is_dir());
            notifier.tell(Over::of_job(job, (&entry.name, &entry.owner), state, folder, ended));
        }
        if let Some(status) = self.status.get(&job) {
            status.send_modify(|status| {
                status.state = state;
                status.waits_for = waits_for_user(job, state, ended.as_ref());
                status.ended = ended;
            });
        }
        for job in forgotten {
            self.status.remove(&job);
            self.spool.forget(job);
        }
        Ok(())
    }
}

/// What a job waits for that its user holds; one that is held because masters or workers died of it has a failure that says so.
fn waits_for_user(job: u32, state: State, ended: Option<&Ended>) -> Option<String> {
    (state == State::Held && ended.is_none()).then(|| format!("`bolide resume {job}`"))
}
