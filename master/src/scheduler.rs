//! The scheduler: one owner of hosts and queue. It hears one [`Notice`] at a time, changes its tables, and starts jobs.
//!
//! Each job that runs has workers of its own and a thread of its own ([`service`]). Which job starts when, on which workers,
//! is [`allotment`]'s to say, which today gives all idle workers to one job at a time; nothing here counts on that.

use std::{
    collections::BTreeMap,
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
    hosts::Hosts,
    http::board::Board,
    notice::Notice,
    queue::{self, Change, Entry, Queue, is_over},
    service::{self, Order},
    spool::{Left, Record, Spool},
};

mod allotment;

use allotment::Allotment;

/// The longest that an ending master waits until the jobs under way are stored.
const END_LIMIT: Duration = Duration::from_secs(60);

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
}

/// A job under way.
struct Running {
    /// Ends it.
    stop: Arc<AtomicBool>,
    /// The way to its thread.
    line: mpsc::Sender<Input>,
}

impl Running {
    fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
        // A full line keeps its thread awake anyway.
        let _ = self.line.try_send(Input::Wake);
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
        };
        for why in &left.warnings {
            warn!("{why}");
        }
        for (record, text) in left.jobs {
            owner.restore(record, text);
        }
        owner
    }

    /// A job of an earlier master; one that was under way goes on.
    fn restore(&mut self, record: Record, text: String) {
        let Record { job, name, title, state, options, at_work, cycle, time, ended } = record;
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
        self.queue.restore(Entry { id: job, name, text: Arc::new(text), options, state, folder, before });
    }

    /// Puts on disk how a job stands, before anybody is told. One that was begun is called running until it is over.
    fn record(&self, job: u32, ended: Option<Ended>) -> Result<(), String> {
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
            }
        };
        // A few kilobytes; the job's own thread does not wait for it.
        tokio::task::block_in_place(|| self.spool.change(&record))
    }

    /// Hears notices until it is to stop, then lets the jobs under way be stored.
    pub async fn run(mut self, mut heard: mpsc::Receiver<Notice>, stop: &AtomicBool, acceptor: &Acceptor) {
        let mut look = tokio::time::interval(Duration::from_millis(100));
        let (alive, mut said) = (notify::interval(), Instant::now());
        while !stop.load(Ordering::Relaxed) {
            tokio::select! {
                notice = heard.recv() => if let Some(notice) = notice {
                    self.hear(notice);
                    self.start_next();
                },
                // An interrupted job waits for its workers for a while.
                _ = look.tick() => self.start_next(),
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
            while !self.running.is_empty()
                && let Some(notice) = heard.recv().await
            {
                self.hear(notice);
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

    /// Changes the tables. A client that does not wait for its answer any more is none of our business.
    fn hear(&mut self, notice: Notice) {
        match notice {
            Notice::Knock { hello, address, incarnation, answer } => {
                let _ = answer.send(self.admit(&hello, &address, incarnation));
            }
            Notice::Joined(worker_link) => {
                let WorkerLink { spec, address, .. } = &worker_link;
                info!(address, speed = spec.speed, threads = spec.threads, "worker {} joined", spec.name);
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
            Notice::Submit { name, title, text, options, answer } => {
                let _ = answer.send(self.submit(name, title, text, options));
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
            Notice::Folder(job, answer) => {
                let _ = answer.send(self.folder(job));
            }
            Notice::Over(job, change, ended) => {
                self.running.remove(&job);
                self.hosts.release(job);
                match &ended.failure {
                    _ if matches!(change, Change::Suspend) => {}
                    Some(why) => warn!(job, "job failed: {why}"),
                    None => info!(job, digest = ended.digest, "job over"),
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
        text: String,
        options: JobOptions,
    ) -> Result<u32, String> {
        let job = self.queue.add(name.clone(), text, options.clone(), &self.folder)?;
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
        };
        let text = self.queue.get(job).map(|entry| Arc::clone(&entry.text)).unwrap_or_default();
        // Who is told that the job is queued finds it in the queue of the next master as well.
        if let Err(why) = tokio::task::block_in_place(|| self.spool.add(&record, &text)) {
            self.queue.take_back(job);
            return Err(format!("the job is not queued: {why}"));
        }
        info!(job, title, "job queued");
        self.status.insert(job, watch::Sender::new(Status::queued(job, title)));
        Ok(job)
    }

    fn watch(&self, job: Option<u32>) -> Result<watch::Receiver<Status>, String> {
        let job = job.or_else(|| self.queue.last()).ok_or("no job yet")?;
        self.status.get(&job).map(watch::Sender::subscribe).ok_or_else(|| format!("no job {job}"))
    }

    fn cancel(&mut self, job: u32) -> Result<String, String> {
        if let Some(running) = self.running.get(&job) {
            running.stop();
            return Ok(format!("job {job} ends after its present cycle"));
        }
        self.change(job, Change::Cancel, Some(Ended::default()))?;
        Ok(format!("job {job} is cancelled"))
    }

    fn resume(&mut self, job: u32) -> Result<String, String> {
        let state = self.queue.get(job).ok_or_else(|| format!("no job {job}"))?.state;
        queue::after(state, Change::Resume)?;
        let text = tokio::task::block_in_place(|| self.spool.text(job))?;
        let state = self.queue.resume(job, text)?;
        self.record(job, None)?;
        if let Some(status) = self.status.get(&job) {
            status.send_modify(|status| (status.state, status.ended) = (state, None));
        }
        Ok(format!("job {job} goes on where it was stored"))
    }

    fn folder(&self, job: u32) -> Result<PathBuf, String> {
        let entry = self.queue.get(job).ok_or_else(|| format!("no job {job}"))?;
        let folder = entry.folder.clone().ok_or_else(|| format!("job {job} writes no results"))?;
        if folder.is_dir() {
            return Ok(folder);
        }
        Err(format!("job {job} is {} and has no results", entry.state.name()))
    }

    fn change(&mut self, job: u32, change: Change, ended: Option<Ended>) -> Result<(), String> {
        let (state, forgotten) = self.queue.apply(job, change)?;
        let ended = ended.filter(|_| is_over(state));
        if let Err(why) = self.record(job, ended.clone()) {
            warn!(job, "its record is not on disk: {why}");
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

    /// Starts the first job in the queue, if it may start on the workers that are idle.
    fn start_next(&mut self) {
        let Some(entry) = self.queue.first() else { return };
        let idle: Vec<&WorkerLink> =
            self.hosts.idle().filter_map(|host| self.worker_links.get(&host.incarnation)).collect();
        let names: Vec<&str> = idle.iter().map(|worker_link| worker_link.spec.name.as_str()).collect();
        let running: Vec<u32> = self.running.keys().copied().collect();
        match allotment::of(entry, &running, &names, self.started.elapsed()) {
            Allotment::Wait(what) => self.wait_for(entry.id, what),
            Allotment::Start => {
                let (job, worker_links) = (entry.id, idle.into_iter().cloned().collect());
                self.start(job, worker_links);
            }
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
        };
        self.hosts.occupy(&incarnations, job);
        self.running.insert(job, running);
        self.queue.set_at_work(job, at_work);
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
