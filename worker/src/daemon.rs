//! The worker as a process: dials a master, greets it, and carries bytes between the link and the session.
//!
//! One task receives frames and hands messages through a bounded queue to the compute thread ([`crate::runner`]), which
//! owns session and machine and sends through the link's queue without waiting. So heartbeats go on while it computes.
//! Nothing is decided here except when to dial again.

use std::{
    net::IpAddr,
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use mechanics::lanes::Width;
use protocol::{
    Error, Result,
    dial::{self, Call},
    handshake::{Hello, Role},
    link::Receiver,
    order::{BULK_ON_THE_WAY, Inbox, Outbox},
    shape::Shape,
    tls::{self, ClientConfig},
    wire,
};
use rayon::ThreadPool;
use system::interrupts::Interrupts;
use tokio::{
    sync::{mpsc, oneshot, watch},
    task::JoinSet,
};
use tracing::{info, warn};

use crate::{
    ending,
    input::Input,
    notify,
    owner::{self, Rules, Share},
    peers::{Peers, links::Links},
    runner::{Compute, Runner},
    slots::{self, Slot},
};

/// Messages that may wait for the compute thread: a master sends at most a few ahead, a neighbour two.
pub const WAITING_MESSAGES: usize = 256;
/// The first pause before dialling again; each next one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(200);
/// The longest pause before dialling again.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// The longest that a worker which is to end waits to be released.
const LEAVE_LIMIT: Duration = Duration::from_secs(60);

/// The longest that a worker which steps back waits to be released; others have to take over from the last checkpoint then.
const STEP_BACK_LIMIT: Duration = Duration::from_secs(3);
/// What a worker says that was told to end.
const GOODBYE: &str = "the worker was told to end";

/// How a worker process runs.
#[derive(Clone, Debug)]
pub struct Options {
    /// The master: `HOST:PORT`.
    pub master: String,
    /// Name of this host.
    pub name: String,
    /// The region of the virtual machine that it is in; empty to name none.
    pub region: String,
    /// Relative speed.
    pub speed: f64,
    pub threads: u32,
    /// Memory that it may take (bytes); none for what is available.
    pub memory: Option<u64>,
    /// Folder with this host's certificates.
    pub certs: Option<PathBuf>,
    /// How long a master that cannot be reached is dialled.
    pub patience: Duration,
    /// End with the first connection instead of dialling again.
    pub once: bool,
    /// The secret that the master asks for.
    pub token: Option<String>,
    /// This host's emulated port; none for what the network gives.
    pub port: Option<Shape>,
    /// Whether and where it takes other workers.
    pub peers: Listen,
    /// Links within this machine may go on over memory; never through an emulated port.
    pub share_memory: bool,
    /// What computes its tasks.
    pub compute: Compute,
    /// When it steps back for the people whose PC it is on.
    pub rules: Rules,
}

/// Whether and where a worker takes other workers, for links of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Listen {
    /// Nowhere, and it dials none: the master relays.
    Nowhere,
    /// On the interface that it reaches the master by.
    Port {
        /// The port to listen on; 0 for any.
        port: u16,
        /// The port that others dial, where it is not the same: of a port that is forwarded.
        announce: Option<u16>,
    },
}

/// What computing for a master needs beside the connection.
#[derive(Clone)]
pub struct Service {
    pub pool: Arc<ThreadPool>,
    /// Where other workers call; without it the master relays.
    pub peers: Option<Arc<Peers>>,
    /// What computes a task.
    pub compute: Compute,
    /// The part of its time that it may.
    pub share: Share,
    /// How many threads the pool has, and what gives some of them away.
    pub slot: Slot,
}

/// What a worker is told to do beside what its master says.
#[derive(Clone)]
struct Told {
    /// To end.
    end: watch::Receiver<Option<()>>,
    /// To stay away from the master, and why.
    away: watch::Receiver<Option<String>>,
}

/// Waits until something is said; for ever if nobody is there to say it.
async fn is_told<T: Clone>(said: &mut watch::Receiver<Option<T>>) -> T {
    let said = said.wait_for(Option::is_some).await.ok().and_then(|said| said.clone());
    match said {
        Some(said) => said,
        None => std::future::pending().await,
    }
}

/// Computes for a master until a signal, a refusal, or until the master has been away for too long.
///
/// # Errors
/// Why it cannot go on, as a sentence.
pub fn run(options: &Options) -> std::result::Result<(), String> {
    let certificates = dial::certificates(options.certs.as_deref()).map_err(|e| e.to_string())?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .thread_name("link")
        .build()
        .map_err(|e| format!("threads of the link: {e}"))?;
    let result = runtime.block_on(async {
        let (told, end) = watch::channel(None);
        let share = Share::default();
        let away = owner::watch(&options.rules, &share);
        tokio::spawn(notify::live());
        if let Some(folder) = &options.certs {
            ending::watch(tls::Paths::in_folder(folder).certificate);
        }
        // A master that is away is no fault of this service.
        notify::say(&format!("READY=1\nSTATUS=dialling {}", options.master));
        let process = Process {
            options: options.clone(),
            certificates,
            hello: greeting(options),
            share,
            told: Told { end, away },
        };
        tokio::select! {
            result = serve_in_slots(process) => result,
            () = leave_by_and_by(&told) => Ok(()),
        }
    });
    // A task under way need not be waited for.
    runtime.shutdown_background();
    result
}

/// What the slots of a process have in common.
#[derive(Clone)]
struct Process {
    options: Options,
    certificates: Option<Arc<ClientConfig>>,
    /// What the whole of it says of itself.
    hello: Hello,
    share: Share,
    told: Told,
}

/// Serves with all threads, and in more slots where the master has some given away; ends with the last of them.
async fn serve_in_slots(process: Process) -> std::result::Result<(), String> {
    let (open, mut asked) = mpsc::unbounded_channel();
    let open = process.hello.divides.then_some(open);
    let all = process.options.threads;
    let mut serving = JoinSet::new();
    serving.spawn(stay(process.clone(), process.hello.clone(), Slot::new(all, all, open.clone())));
    let mut slots = 1;
    loop {
        tokio::select! {
            Some(threads) = asked.recv() => {
                slots += 1;
                let hello = Hello { name: slots::name_of(&process.options.name, slots), ..process.hello.clone() };
                info!(threads, "slot {} opens", hello.name);
                serving.spawn(stay(process.clone(), hello, Slot::new(threads, all, open.clone())));
            }
            Some(ended) = serving.join_next() => {
                let result = ended.unwrap_or_else(|bug| Err(format!("a slot: {bug}")));
                if serving.is_empty() {
                    return result;
                }
                if let Err(why) = result {
                    warn!("a slot of this worker ends: {why}");
                }
            }
        }
    }
}

/// The pool that a worker computes on.
///
/// # Errors
/// If its threads cannot start.
pub fn compute_pool(threads: usize) -> std::result::Result<Arc<ThreadPool>, String> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("compute-{i}"))
        .build()
        .map(Arc::new)
        .map_err(|e| format!("compute threads: {e}"))
}

/// What this process says of itself; its nonce is drawn once.
fn greeting(options: &Options) -> Hello {
    let mut hello = Hello::new(
        Role::Worker,
        &options.name,
        options.speed,
        options.threads,
        Width::best().to_string(),
        crate::random(),
    );
    hello.token.clone_from(&options.token);
    hello.region.clone_from(&options.region);
    hello.proof = Some(mechanics::proof::of_this_machine());
    hello.memory = options.memory.or_else(system::memory::available).unwrap_or_default();
    // Each slot has ports of its own: the one that other workers call, and the one that is emulated.
    let peers = matches!(options.peers, Listen::Nowhere | Listen::Port { port: 0, announce: None });
    hello.divides = options.threads > 1 && peers && options.port.is_none();
    hello
}

/// At Ctrl-C, or another request to end, asks to be released from its job; ends at the second one, or when leaving takes too long.
async fn leave_by_and_by(told: &watch::Sender<Option<()>>) {
    let Ok(mut interrupts) = Interrupts::listen() else { return std::future::pending().await };
    interrupts.next().await;
    warn!("leaving once the job can stop; once more to leave at once");
    notify::say("STOPPING=1\nSTATUS=leaving once the job can stop");
    told.send_replace(Some(()));
    tokio::select! {
        () = interrupts.next() => {}
        () = tokio::time::sleep(LEAVE_LIMIT) => {
            warn!("not released within {} s; leaving", LEAVE_LIMIT.as_secs());
        }
    }
}

/// Dials, serves, dials again, in one slot.
async fn stay(process: Process, mut hello: Hello, slot: Slot) -> std::result::Result<(), String> {
    let Process { options, certificates, hello: whole, share, mut told } = process;
    let pool = compute_pool(slot.threads() as usize)?;
    let mut service = Service { pool, peers: None, compute: options.compute, share, slot };
    let mut listening = None;
    let mut alone_since = Instant::now();
    let mut pause = FIRST_PAUSE;
    // Why the master was not reached, as it was told last.
    let mut told_why = None;
    loop {
        let away = told.away.borrow().clone();
        if let Some(why) = away {
            notify::say(&format!("STATUS=staying away from {}: {why}", options.master));
            tokio::select! {
                _ = told.away.wait_for(Option::is_none) => {}
                () = is_told(&mut told.end) => return Ok(()),
            }
            (alone_since, pause) = (Instant::now(), FIRST_PAUSE);
        }
        service.slot.offer(&whole, &mut hello);
        if service.pool.current_num_threads() != hello.threads as usize {
            service.pool = compute_pool(hello.threads as usize)?;
        }
        let joined = join(&options, certificates.as_ref(), &mut hello, &mut listening, &mut service).await;
        let error = match joined {
            Ok(call) => {
                told_why = None;
                info!(
                    host = call.welcome.host,
                    incarnation = call.welcome.incarnation,
                    shares_memory = call.shares_memory.then_some(true),
                    "joined {}",
                    options.master
                );
                notify::say(&format!("STATUS=joined {} as host {}", options.master, call.welcome.host));
                let error = serve_until(call, service.clone(), told.clone()).await;
                let is_away = told.away.borrow().is_some();
                let is_over = told.end.borrow().is_some() || service.slot.threads() == 0;
                if is_over || (options.once && !is_away) {
                    return Ok(());
                }
                (alone_since, pause) = (Instant::now(), FIRST_PAUSE);
                if is_away {
                    info!("left {}", options.master);
                    continue;
                }
                warn!("link to {} ended: {error}; dialling again", options.master);
                notify::say(&format!("STATUS=dialling {} again", options.master));
                error
            }
            Err(error) if is_final(&error) => return Err(error.to_string()),
            Err(error) => {
                let why = error.to_string();
                if told_why.as_ref() != Some(&why) {
                    let seconds = options.patience.saturating_sub(alone_since.elapsed()).as_secs();
                    warn!("no master at {}: {why}; dialling again for {seconds} s", options.master);
                    told_why = Some(why);
                }
                error
            }
        };
        if alone_since.elapsed() >= options.patience {
            let seconds = options.patience.as_secs();
            return Err(format!("no master at {} for {seconds} s; last: {error}", options.master));
        }
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = is_told(&mut told.end) => return Ok(()),
        }
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
}

/// Reaches the master, listens for other workers on the interface that leads there, and greets.
async fn join(
    options: &Options,
    certificates: Option<&Arc<ClientConfig>>,
    hello: &mut Hello,
    listening: &mut Option<IpAddr>,
    service: &mut Service,
) -> Result<Call> {
    let reached = dial::reach(&options.master, certificates).await?;
    let reached = reached.through(options.port.as_ref()).sharing_memory(options.share_memory);
    let ip = reached.local_ip()?;
    if let Listen::Port { port, announce } = options.peers
        && *listening != Some(ip)
    {
        service.peers = None;
        let listener = Peers::bind(ip, port).await?;
        let bound = listener.local_addr().map_err(|e| Error::io("the port for other workers", &e))?;
        let (certs, port) = (options.certs.as_deref(), options.port.clone());
        service.peers = Some(Arc::new(Peers::start(listener, certs, port, options.share_memory)?));
        *listening = Some(ip);
        hello.peer_port = announce.unwrap_or(bound.port());
        info!(announced = hello.peer_port, "listening for other workers on {bound}");
    }
    reached.greet(hello).await
}

/// Whether dialling again would meet the same.
fn is_final(error: &Error) -> bool {
    match error {
        // A clock that jumps, here or there, comes back. The master may refuse the date that TLS has let pass a moment before.
        Error::Refused { reason } if is_of_clocks(reason) => false,
        Error::Refused { .. }
        | Error::Certificate(_)
        | Error::Address { .. }
        | Error::Message(_)
        | Error::Magic { .. }
        | Error::FrameVersion { .. } => true,
        Error::Io { kind: std::io::ErrorKind::InvalidData, why, .. } if is_of_clocks(why) => false,
        // What TLS refuses.
        Error::Io { kind: std::io::ErrorKind::InvalidData, .. } => true,
        // The port for other workers.
        Error::Io { kind, .. } => *kind == std::io::ErrorKind::AddrInUse,
        _ => false,
    }
}

/// Whether TLS was refused for a date, which is tried again for as long as a master that is away is dialled.
fn is_of_clocks(why: &str) -> bool {
    why.contains("has expired") || why.contains("not valid yet")
}

/// Computes for the master at the other end until the connection ends; gives the reason.
pub async fn serve(call: Call, service: Service) -> Error {
    let (_end, end) = watch::channel(None);
    let (_away, away) = watch::channel(None);
    serve_until(call, service, Told { end, away }).await
}

/// [`serve`] until this process is told to leave and the master has released it.
async fn serve_until(
    call: Call,
    Service { pool, peers, compute, share, slot }: Service,
    mut told: Told,
) -> Error {
    let Call { sender, mut receiver, welcome, .. } = call;
    let (send, messages) = mpsc::channel(WAITING_MESSAGES);
    let (fail, mut failed) = oneshot::channel();
    let outbox = Outbox::new(sender.clone(), welcome.incarnation);
    let links = Links::new(peers.as_deref(), send.downgrade());
    let computing = std::thread::Builder::new().name("session".to_owned()).spawn(move || {
        let runner = Runner::new(compute, share, slot, outbox, links);
        if let Err(error) = compute_in(pool, runner, messages) {
            // The receiver is gone when the connection has ended already.
            let _ = fail.send(error);
        }
    });
    let asking = send.clone();
    let leave = async move {
        let (reason, limit) = tokio::select! {
            () = is_told(&mut told.end) => (GOODBYE.to_owned(), LEAVE_LIMIT),
            why = is_told(&mut told.away) => (format!("stepped back: {why}"), STEP_BACK_LIMIT),
        };
        // The compute thread ends only with this function.
        let _ = asking.send(Input::Leave(reason.clone())).await;
        tokio::time::sleep(limit).await;
        Error::Left { reason }
    };
    let mut left = false;
    let error = match &computing {
        Err(error) => Error::io("starting the compute thread", error),
        Ok(_) => tokio::select! {
            error = listen(&mut receiver, &send) => error,
            Ok(error) = &mut failed => {
                left = matches!(&error, Error::Left { .. });
                error
            }
            error = leave => {
                left = true;
                error
            }
        },
    };
    match &error {
        Error::Left { reason } if left => dial::leave(&sender, reason).await,
        Error::Closed | Error::Left { .. } | Error::Io { .. } => {}
        error => dial::leave(&sender, &error.to_string()).await,
    }
    drop((receiver, send));
    if let Ok(thread) = computing {
        // Two machines at a time would need twice the memory: wait for the task under way.
        let _ = tokio::task::spawn_blocking(move || thread.join()).await;
    }
    error
}

/// Runs on `pool`, and on others as the slot's threads change.
fn compute_in(
    mut pool: Arc<ThreadPool>,
    mut runner: Runner,
    mut messages: mpsc::Receiver<Input>,
) -> Result<()> {
    while let Some(threads) = pool.install(|| runner.run(&mut messages))? {
        pool = compute_pool(threads as usize).map_err(Error::Message)?;
    }
    Ok(())
}

/// Hands every message on, in order; ends with the link.
async fn listen(receiver: &mut Receiver, send: &mpsc::Sender<Input>) -> Error {
    let mut inbox = Inbox::new(0, BULK_ON_THE_WAY);
    loop {
        if let Err(error) = hand_on(receiver, &mut inbox, send).await {
            return error;
        }
    }
}

async fn hand_on(receiver: &mut Receiver, inbox: &mut Inbox, send: &mpsc::Sender<Input>) -> Result<()> {
    inbox.accept(receiver.receive().await?)?;
    while let Some(letter) = inbox.take() {
        let message = wire::unpack_to_worker(letter.header.kind, &letter.bytes)?;
        receiver.recycle(letter.bytes);
        if send.send(Input::Master(letter.header, message)).await.is_err() {
            // The compute thread says why in its own words.
            std::future::pending::<()>().await;
        }
    }
    Ok(())
}
