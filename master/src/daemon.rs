//! The master as a process: one owner of hosts and queue, and a listener whose connections talk to it.
//!
//! The owner hears [`Event`]s one at a time, changes its tables, and starts the next job when there is one and enough
//! workers are idle; a job has all of them. Each job runs on a thread of its own ([`service`]).

use std::{
    collections::BTreeMap,
    net::SocketAddr,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use protocol::{
    handshake::{Hello, Role},
    request::{Ended, HostRow, JobOptions, State, Status},
    shape::{Shape, Wire},
    tls,
};
use tokio::{
    net::TcpListener,
    sync::{Semaphore, mpsc, oneshot, watch},
};
use tracing::{info, warn};

use crate::{
    command::MasterArgs,
    connection::Gate,
    drive::{self, Input, Seat},
    hosts::Hosts,
    queue::{self, Queue, is_over},
    service::{self, Order},
};

/// Events that may wait for the owner.
pub const WAITING_EVENTS: usize = 1024;
/// Most connections at a time, those in their greeting included.
pub const CONNECTIONS: usize = 4096;
/// The longest that an ending master waits for the job under way.
const END_LIMIT: Duration = Duration::from_secs(10);

/// What the owner of hosts and queue hears.
pub enum Event {
    /// A worker wants to be taken in; answered with its number.
    Knock {
        /// Its greeting.
        hello: Box<Hello>,
        /// Where it calls from.
        address: String,
        /// Its connection.
        incarnation: u32,
        /// Its host's number, or why it is refused.
        answer: oneshot::Sender<Result<u32, String>>,
    },
    /// It was welcomed and can be given jobs.
    Joined(Seat),
    /// Its connection has ended.
    Left {
        /// The connection.
        incarnation: u32,
        /// Why.
        why: String,
    },
    /// A client brings a deck without faults; answered with the job's number.
    Submit {
        /// Name of its file.
        name: String,
        /// Its title.
        title: String,
        /// The deck.
        text: String,
        /// What is asked beside the deck.
        options: JobOptions,
        /// The job's number, or why it is refused.
        answer: oneshot::Sender<Result<u32, String>>,
    },
    /// A client asks for all jobs.
    Jobs(oneshot::Sender<Vec<Status>>),
    /// A client asks for all hosts.
    Hosts(oneshot::Sender<Vec<HostRow>>),
    /// A client follows a job; the newest without a number.
    Watch(Option<u32>, oneshot::Sender<Result<watch::Receiver<Status>, String>>),
    /// A client takes a job back.
    Cancel(u32, oneshot::Sender<Result<String, String>>),
    /// A client asks where a job's results are.
    Folder(u32, oneshot::Sender<Result<PathBuf, String>>),
    /// A job's thread is done.
    Over(u32, queue::Event, Box<Ended>),
}

/// `bolide master`: listens until Ctrl-C or SIGTERM.
///
/// # Errors
/// If it cannot listen there, or the certificates cannot be used.
pub fn run(args: &MasterArgs) -> Result<ExitCode, String> {
    let tls = args.certs.as_ref().map(|folder| tls::server_config(&tls::Paths::in_folder(folder)));
    let tls = tls.transpose().map_err(|e| e.to_string())?;
    if tls.is_none() {
        tls::loopback_only(args.listen).map_err(|e| e.to_string())?;
    }
    let port = args.link.map(|rate| Shape::port(Wire::ethernet(rate)));
    let first = first_job(&args.spool)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .thread_name("link")
        .build()
        .map_err(|e| format!("threads of links: {e}"))?;
    let result = runtime.block_on(async {
        let listener = TcpListener::bind(args.listen).await.map_err(|e| format!("{}: {e}", args.listen))?;
        let address = listener.local_addr().map_err(|e| e.to_string())?;
        announce(address, tls.is_some());
        let (events, heard) = mpsc::channel(WAITING_EVENTS);
        let gate =
            Arc::new(Gate::new(events.clone(), vec![Role::Worker, Role::Client], None, tls).behind(port));
        tokio::spawn(listen(listener, Arc::clone(&gate)));
        let stop = crate::run::stop_on_interrupt("ending; the job under way writes its results");
        Owner::new(args.spool.clone(), first, events).run(heard, &stop, &gate).await;
        Ok(ExitCode::SUCCESS)
    });
    runtime.shutdown_background();
    result
}

/// Takes connections for ever; each fault of one is one line in the log.
pub async fn listen(listener: TcpListener, gate: Arc<Gate>) {
    let places = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let (stream, address) = match listener.accept().await {
            Ok(taken) => taken,
            Err(error) => {
                // Out of file descriptors, most likely: connections that end give some back.
                warn!("taking a connection: {error}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            warn!("connection from {address} not taken: {CONNECTIONS} stand, at most {CONNECTIONS}");
            continue;
        };
        let gate = Arc::clone(&gate);
        tokio::spawn(async move {
            if let Err(error) = Arc::clone(&gate).take(stream, address.to_string()).await
                && !gate.is_ending()
            {
                warn!("connection from {address}: {error}");
            }
            drop(place);
        });
    }
}

/// Says where it listens and how workers join.
fn announce(address: SocketAddr, certificates: bool) {
    let host = if address.ip().is_unspecified() { host_name() } else { address.ip().to_string() };
    let host = if host.contains(':') { format!("[{host}]") } else { host };
    let certs = if certificates { " --certs FOLDER" } else { "" };
    println!("listening on {address}");
    println!("workers join with: bolide worker --master {host}:{}{certs}", address.port());
}

/// The name of this machine.
pub fn host_name() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name: String = name.trim().chars().filter(plain).take(40).collect();
    if name.is_empty() { "localhost".to_owned() } else { name }
}

/// The first number that no job of an earlier master in this spool folder has.
fn first_job(spool: &Path) -> Result<u32, String> {
    let fault = |e: std::io::Error| format!("spool folder {}: {e}", spool.display());
    std::fs::create_dir_all(spool).map_err(fault)?;
    let mut first = 1;
    for entry in std::fs::read_dir(spool).map_err(fault)? {
        let name = entry.map_err(fault)?.file_name();
        let number = name.to_str().and_then(|n| n.strip_prefix("job-")).and_then(|n| n.parse::<u32>().ok());
        first = first.max(number.map_or(0, |n| n.saturating_add(1)));
    }
    Ok(first)
}

/// The owner of hosts and queue.
struct Owner {
    spool: PathBuf,
    events: mpsc::Sender<Event>,
    hosts: Hosts,
    /// By connection: those that were welcomed and have not left.
    seats: BTreeMap<u32, Seat>,
    queue: Queue,
    status: BTreeMap<u32, watch::Sender<Status>>,
    running: Option<Running>,
}

/// The job under way.
struct Running {
    job: u32,
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

impl Owner {
    fn new(spool: PathBuf, first: u32, events: mpsc::Sender<Event>) -> Self {
        Self {
            spool,
            events,
            hosts: Hosts::default(),
            seats: BTreeMap::new(),
            queue: Queue::new(first),
            status: BTreeMap::new(),
            running: None,
        }
    }

    async fn run(mut self, mut heard: mpsc::Receiver<Event>, stop: &AtomicBool, gate: &Gate) {
        let mut look = tokio::time::interval(Duration::from_millis(100));
        while !stop.load(Ordering::Relaxed) {
            tokio::select! {
                event = heard.recv() => if let Some(event) = event {
                    self.hear(event);
                    self.start_next();
                },
                _ = look.tick() => {}
            }
        }
        self.end(&mut heard, gate).await;
    }

    /// Lets the job under way write its results, and says good-bye.
    async fn end(&mut self, heard: &mut mpsc::Receiver<Event>, gate: &Gate) {
        if let Some(running) = &self.running {
            running.stop();
        }
        let _ = tokio::time::timeout(END_LIMIT, async {
            while self.running.is_some()
                && let Some(event) = heard.recv().await
            {
                self.hear(event);
            }
        })
        .await;
        gate.end();
        let leaving = self.seats.values().map(|seat| {
            let sender = seat.sender();
            tokio::spawn(async move { protocol::dial::leave(&sender, "the master is ending").await })
        });
        for left in leaving.collect::<Vec<_>>() {
            // A panic there would be a bug that the end of the process hides anyway.
            let _ = left.await;
        }
    }

    /// Changes the tables. A client that does not wait for its answer any more is none of our business.
    fn hear(&mut self, event: Event) {
        match event {
            Event::Knock { hello, address, incarnation, answer } => {
                let _ = answer.send(self.admit(&hello, &address, incarnation));
            }
            Event::Joined(seat) => {
                let Seat { hand, address, .. } = &seat;
                info!(address, speed = hand.speed, threads = hand.threads, "worker {} joined", hand.name);
                self.offer(&seat);
                self.seats.insert(seat.incarnation, seat);
            }
            Event::Left { incarnation, why } => {
                self.seats.remove(&incarnation);
                self.hosts.lose(incarnation, &why);
            }
            Event::Submit { name, title, text, options, answer } => {
                let _ = answer.send(self.submit(name, title, text, options));
            }
            Event::Jobs(answer) => {
                let _ = answer.send(self.status.values().map(|s| s.borrow().clone()).collect());
            }
            Event::Hosts(answer) => {
                let _ = answer.send(self.hosts.rows());
            }
            Event::Watch(job, answer) => {
                let _ = answer.send(self.watch(job));
            }
            Event::Cancel(job, answer) => {
                let _ = answer.send(self.cancel(job));
            }
            Event::Folder(job, answer) => {
                let _ = answer.send(self.folder(job));
            }
            Event::Over(job, event, ended) => {
                self.running = None;
                self.hosts.release(job);
                match &ended.failure {
                    Some(why) => warn!(job, "job failed: {why}"),
                    None => info!(job, digest = ended.digest, "job over"),
                }
                if let Err(why) = self.change(job, event, Some(*ended)) {
                    warn!(job, "{why}");
                }
            }
        }
    }

    /// A worker that comes while a job runs is the job's.
    fn offer(&mut self, seat: &Seat) {
        if let Some(Running { job, line, .. }) = &self.running {
            self.hosts.occupy(&[seat.incarnation], *job);
            let (line, seat) = (line.clone(), seat.clone());
            // A job that is over by then gives all its hosts back.
            tokio::spawn(async move { line.send(Input::Joined(seat)).await.is_ok() });
        }
    }

    fn admit(&mut self, hello: &Hello, address: &str, incarnation: u32) -> Result<u32, String> {
        let (number, ghost) = self.hosts.admit(hello, address, incarnation)?;
        if let Some(ghost) = ghost.and_then(|ghost| self.seats.remove(&ghost)) {
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
        let job = self.queue.add(name, text, options, &self.spool)?;
        info!(job, title, "job queued");
        let status = Status {
            job,
            title,
            state: State::Queued,
            waits_for: None,
            cycle: 0,
            time: 0.0,
            progress: String::new(),
            shares: Vec::new(),
            ended: None,
        };
        self.status.insert(job, watch::Sender::new(status));
        Ok(job)
    }

    fn watch(&self, job: Option<u32>) -> Result<watch::Receiver<Status>, String> {
        let job = job.or_else(|| self.queue.last()).ok_or("no job yet")?;
        self.status.get(&job).map(watch::Sender::subscribe).ok_or_else(|| format!("no job {job}"))
    }

    fn cancel(&mut self, job: u32) -> Result<String, String> {
        if let Some(running) = &self.running
            && running.job == job
        {
            running.stop();
            return Ok(format!("job {job} ends after its present cycle"));
        }
        self.change(job, queue::Event::Cancel, Some(Ended::default()))?;
        Ok(format!("job {job} is cancelled"))
    }

    fn folder(&self, job: u32) -> Result<PathBuf, String> {
        let entry = self.queue.get(job).ok_or_else(|| format!("no job {job}"))?;
        let folder = entry.folder.clone().ok_or_else(|| format!("job {job} writes no results"))?;
        if folder.is_dir() {
            return Ok(folder);
        }
        Err(format!("job {job} is {} and has no results", entry.state.name()))
    }

    fn change(&mut self, job: u32, event: queue::Event, ended: Option<Ended>) -> Result<(), String> {
        let (state, forgotten) = self.queue.apply(job, event)?;
        if let Some(status) = self.status.get(&job) {
            status.send_modify(|status| {
                status.state = state;
                status.waits_for = None;
                status.ended = ended.filter(|_| is_over(state));
            });
        }
        for job in forgotten {
            self.status.remove(&job);
        }
        Ok(())
    }

    /// Gives the first job in the queue all idle workers, if there are enough.
    fn start_next(&mut self) {
        let Some(entry) = self.queue.first() else { return };
        let job = entry.id;
        if let Some(Running { job: running, .. }) = self.running {
            self.wait_for(job, format!("job {running}"));
            return;
        }
        let idle: Vec<u32> =
            self.hosts.idle().map(|h| h.incarnation).filter(|i| self.seats.contains_key(i)).collect();
        let needed = entry.options.min_workers.max(1) as usize;
        if idle.len() < needed {
            self.wait_for(job, format!("{needed} workers, {} are idle", idle.len()));
            return;
        }
        let Some(status) = self.status.get(&job).cloned() else { return };
        let stop = Arc::new(AtomicBool::new(false));
        let line = drive::channel(idle.len());
        let running = Running { job, stop: Arc::clone(&stop), line: line.0.clone() };
        let order = Order {
            number: job,
            name: entry.name.clone(),
            text: Arc::clone(&entry.text),
            options: entry.options.clone(),
            folder: entry.folder.clone(),
            seats: idle.iter().filter_map(|i| self.seats.get(i)).cloned().collect(),
            line: Mutex::new(Some(line)),
            stop,
            status,
        };
        self.hosts.occupy(&idle, job);
        self.running = Some(running);
        info!(job, workers = idle.len(), "job starts");
        if let Err(why) = self.change(job, queue::Event::Start, None) {
            warn!(job, "{why}");
        }
        let events = self.events.clone();
        let started = std::thread::Builder::new().name(format!("job-{job}")).spawn(move || {
            let (event, ended) = service::serve(&order);
            drop(order);
            // The owner is gone only when the daemon ends.
            let _ = events.blocking_send(Event::Over(job, event, Box::new(ended)));
        });
        if let Err(error) = started {
            let ended = Ended { failure: Some(format!("its thread: {error}")), ..Ended::default() };
            self.hear(Event::Over(job, queue::Event::Fail, Box::new(ended)));
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
