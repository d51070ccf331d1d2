//! The master as a process: one owner of hosts and queue, and a listener whose connections talk to it.
//!
//! The owner hears [`Event`]s one at a time, changes its tables, and starts the next job when there is one and enough
//! workers are idle; a job has all of them. Each job runs on a thread of its own ([`service`]).

use std::{
    collections::BTreeMap,
    net::SocketAddr,
    path::PathBuf,
    process::ExitCode,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use protocol::{
    handshake::{Hello, Role},
    options::JobOptions,
    request::{Ended, HostRow, State, Status},
    shape::{Shape, Wire},
    tls,
    token::Token,
};
use tokio::{
    net::TcpListener,
    sync::{Semaphore, mpsc, oneshot, watch},
};
use tracing::{info, warn};
use worker::notify;

use crate::{
    command::MasterArgs,
    connection::Gate,
    drive::{self, Input, Seat},
    hosts::Hosts,
    http::{self, board::Board},
    lab::Lab,
    queue::{self, Entry, Queue, is_over},
    service::{self, Order},
    spool::{Left, Record, Spool},
};

/// Events that may wait for the owner.
pub const WAITING_EVENTS: usize = 1024;
/// Most connections at a time, those in their greeting included.
pub const CONNECTIONS: usize = 4096;
/// How long the token that a master prints at its start is good.
const FIRST_TOKEN_HOURS: u64 = 24;
/// The longest that an ending master waits until the job under way is stored.
const END_LIMIT: Duration = Duration::from_secs(60);
/// How long an interrupted job waits for all of its workers before it goes on with those that are back; later ones are taken
/// in at plan boundaries.
const RETURN_LIMIT: Duration = Duration::from_secs(2);

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
        /// Its job dropped the worker: it may not come back.
        dropped: bool,
    },
    /// A worker has been silent for long, or is heard again.
    Suspect {
        /// Its connection.
        incarnation: u32,
        /// In words, while it is silent.
        note: Option<String>,
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
    /// A client wants a job that failed to go on.
    Resume(u32, oneshot::Sender<Result<String, String>>),
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
    let lab = args.lab.as_ref().map(|folder| Lab::open(folder)).transpose().map_err(|e| e.to_string())?;
    let tls = args.certs.as_ref().map(|folder| tls::Paths::in_folder(folder));
    let config = if lab.is_some() { tls::open_server_config } else { tls::server_config };
    let tls = tls.map(|paths| config(&paths)).transpose().map_err(|e| e.to_string())?;
    if tls.is_none() {
        tls::loopback_only(args.listen).map_err(|e| e.to_string())?;
    }
    let port = args.link.map(|rate| Shape::port(Wire::ethernet(rate)));
    let (spool, left) = Spool::open(&args.spool)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .thread_name("link")
        .build()
        .map_err(|e| format!("threads of links: {e}"))?;
    let dead_after = Duration::from_secs_f64(args.dead_after);
    let result = runtime.block_on(async {
        let listener = TcpListener::bind(args.listen).await.map_err(|e| format!("{}: {e}", args.listen))?;
        let address = listener.local_addr().map_err(|e| e.to_string())?;
        let join = announce(address, tls.is_some(), lab.as_ref())?;
        let lab = lab.map(|lab| lab.follow().map(|revoked| (lab, revoked))).transpose();
        let lab = lab.map_err(|e| e.to_string())?;
        let (events, heard) = mpsc::channel(WAITING_EVENTS);
        let gate = Arc::new(
            Gate::new(events.clone(), vec![Role::Worker, Role::Client], None, tls)
                .behind(port)
                .of(lab)
                .patient_for(dead_after),
        );
        tokio::spawn(listen(listener, Arc::clone(&gate)));
        let board = open_page(args, join, &events).await?;
        let stop =
            crate::interrupt::stop_on_interrupt("ending; the job under way is stored for the next master");
        notify::say(&format!("READY=1\nSTATUS=listening on {address}"));
        Owner::new(args.spool.clone(), spool, left, events, board).run(heard, &stop, &gate).await;
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

/// Opens the page where one is asked for, and prints its address with its token.
async fn open_page(
    args: &MasterArgs,
    join: String,
    events: &mpsc::Sender<Event>,
) -> Result<Option<Arc<Board>>, String> {
    let Some(address) = args.http else { return Ok(None) };
    let place = http::Place::open(address, args.certs.as_deref()).await?;
    let (address, secure) = (place.address()?, place.is_secure());
    let loopback = address.ip().is_loopback();
    let guard = http::guard::Guard::new(&args.spool, address.port(), loopback, secure, host_name())?;
    let scheme = if secure { "https" } else { "http" };
    println!("page: {scheme}://{}/?token={}", reachable(address), guard.token());
    let board = Arc::new(Board::default());
    let office = http::Office { events: events.clone(), board: Arc::clone(&board), join, guard };
    tokio::spawn(http::serve(place, office));
    Ok(Some(board))
}

/// Says where it listens and how workers join; gives the line for workers. The page shows it as well, to whoever may submit
/// jobs, so the line with a token is printed here only.
fn announce(address: SocketAddr, certificates: bool, lab: Option<&Lab>) -> Result<String, String> {
    let host = reachable(address);
    let certs = if certificates { " --certs FOLDER" } else { "" };
    let join = format!("bolide worker --master {host}{certs}");
    println!("listening on {address}");
    println!("workers join with: {join}");
    if let Some(lab) = lab {
        let token = lab.issue(tls::Role::Worker, FIRST_TOKEN_HOURS).map_err(|e| e.to_string())?;
        println!("a new PC joins with: {}", line_to_paste(&host, &token, tls::Role::Worker));
        println!("more such lines: bolide certs token LAB --master {host}");
    }
    Ok(join)
}

/// What is pasted on a bare PC.
pub fn line_to_paste(master: &str, token: &Token, role: tls::Role) -> String {
    match role {
        tls::Role::Worker => format!("bolide worker --master {master} --certs bolide-certs --join {token}"),
        _ => format!("bolide certs join {master} {token} bolide-certs"),
    }
}

/// Host and port as others write them.
fn reachable(address: SocketAddr) -> String {
    let host = if address.ip().is_unspecified() { host_name() } else { address.ip().to_string() };
    let host = if host.contains(':') { format!("[{host}]") } else { host };
    format!("{host}:{}", address.port())
}

/// The name of this machine.
pub fn host_name() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name: String = name.trim().chars().filter(plain).take(40).collect();
    if name.is_empty() { "localhost".to_owned() } else { name }
}

/// The owner of hosts and queue.
struct Owner {
    folder: PathBuf,
    spool: Spool,
    started: Instant,
    /// What every worker's arithmetic must come to.
    proof: String,
    events: mpsc::Sender<Event>,
    hosts: Hosts,
    /// By connection: those that were welcomed and have not left.
    seats: BTreeMap<u32, Seat>,
    queue: Queue,
    status: BTreeMap<u32, watch::Sender<Status>>,
    running: Option<Running>,
    /// What the page shows; none without a page.
    board: Option<Arc<Board>>,
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
    /// With what an earlier master left.
    fn new(
        folder: PathBuf,
        spool: Spool,
        left: Left,
        events: mpsc::Sender<Event>,
        board: Option<Arc<Board>>,
    ) -> Self {
        let mut owner = Self {
            folder,
            spool,
            started: Instant::now(),
            proof: mechanics::proof::of_this_machine(),
            events,
            hosts: Hosts::default(),
            seats: BTreeMap::new(),
            queue: Queue::new(left.first),
            status: BTreeMap::new(),
            running: None,
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
        let Record { job, name, title, state, options, crew, cycle, time, ended } = record;
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
        let before = interrupted.then_some(crew);
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
                crew: entry.before.clone().unwrap_or_default(),
                cycle: status.cycle,
                time: status.time,
                ended,
            }
        };
        // A few kilobytes; the job's own thread does not wait for it.
        tokio::task::block_in_place(|| self.spool.change(&record))
    }

    async fn run(mut self, mut heard: mpsc::Receiver<Event>, stop: &AtomicBool, gate: &Gate) {
        let mut look = tokio::time::interval(Duration::from_millis(100));
        let (alive, mut said) = (notify::interval(), Instant::now());
        while !stop.load(Ordering::Relaxed) {
            tokio::select! {
                event = heard.recv() => if let Some(event) = event {
                    self.hear(event);
                    self.start_next();
                },
                // An interrupted job waits for its workers for a while.
                _ = look.tick() => self.start_next(),
            }
            // Here, so that a manager sees an owner that is stuck.
            if alive.is_some_and(|interval| said.elapsed() >= interval) {
                notify::say("WATCHDOG=1");
                said = Instant::now();
            }
        }
        notify::say("STOPPING=1\nSTATUS=storing the job under way");
        // From here on END_LIMIT bounds what it waits for.
        tokio::spawn(notify::live());
        self.end(&mut heard, gate).await;
    }

    /// Lets the job under way be stored, and says good-bye.
    async fn end(&mut self, heard: &mut mpsc::Receiver<Event>, gate: &Gate) {
        if let Some(running) = &self.running {
            let line = running.line.clone();
            // Beside what is heard below: the line may be full.
            tokio::spawn(async move { line.send(Input::Suspend).await.is_ok() });
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
            Event::Left { incarnation, why, dropped } => {
                self.seats.remove(&incarnation);
                match dropped {
                    true => self.hosts.drop_out(incarnation, &why),
                    false => self.hosts.lose(incarnation, &why),
                }
            }
            Event::Suspect { incarnation, note } => self.hosts.suspect(incarnation, note),
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
            Event::Resume(job, answer) => {
                let _ = answer.send(self.resume(job));
            }
            Event::Folder(job, answer) => {
                let _ = answer.send(self.folder(job));
            }
            Event::Over(job, event, ended) => {
                self.running = None;
                self.hosts.release(job);
                match &ended.failure {
                    _ if matches!(event, queue::Event::Suspend) => {}
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
        hello.proves(&self.proof)?;
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
        let job = self.queue.add(name.clone(), text, options.clone(), &self.folder)?;
        let record = Record {
            job,
            name,
            title: title.clone(),
            state: State::Queued,
            options,
            crew: Vec::new(),
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
        if let Some(running) = &self.running
            && running.job == job
        {
            running.stop();
            return Ok(format!("job {job} ends after its present cycle"));
        }
        self.change(job, queue::Event::Cancel, Some(Ended::default()))?;
        Ok(format!("job {job} is cancelled"))
    }

    fn resume(&mut self, job: u32) -> Result<String, String> {
        let state = self.queue.get(job).ok_or_else(|| format!("no job {job}"))?.state;
        queue::after(state, queue::Event::Resume)?;
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

    fn change(&mut self, job: u32, event: queue::Event, ended: Option<Ended>) -> Result<(), String> {
        let (state, forgotten) = self.queue.apply(job, event)?;
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
        let back =
            |name: &&String| idle.iter().filter_map(|i| self.seats.get(i)).any(|s| s.hand.name == **name);
        match &entry.before {
            // Any worker will do for what was begun with enough of them.
            Some(crew) => {
                let (all, back) = (crew.len(), crew.iter().filter(back).count());
                if idle.is_empty() || back < all && self.started.elapsed() < RETURN_LIMIT {
                    self.wait_for(job, format!("its workers: {back} of {all} are back"));
                    return;
                }
            }
            None if idle.len() < needed => {
                self.wait_for(job, format!("{needed} workers, {} are idle", idle.len()));
                return;
            }
            None => {}
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
            snapshots: self.spool.snapshots(job),
            crew_before: entry.before.as_ref().map(Vec::len),
            seats: idle.iter().filter_map(|i| self.seats.get(i)).cloned().collect(),
            line: Mutex::new(Some(line)),
            stop,
            status,
            board: self.board.clone(),
        };
        let crew = idle.iter().filter_map(|i| self.seats.get(i)).map(|seat| seat.hand.name.clone()).collect();
        self.hosts.occupy(&idle, job);
        self.running = Some(running);
        self.queue.set_crew(job, crew);
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
