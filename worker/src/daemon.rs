//! The worker as a process: dials a master, greets it, and carries bytes between the link and the session.
//!
//! One task receives frames and hands messages through a bounded queue to the compute thread, which owns session and
//! machine and sends through the link's queue without waiting. So heartbeats go on while it computes. Nothing is
//! decided here except when to dial again.

use std::{
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use mechanics::lanes::Width;
use protocol::{
    Error, Result,
    dial::{self, Call},
    frame::Header,
    handshake::{Hello, Role},
    link::Receiver,
    message::{ToMaster, ToWorker},
    order::{BULK_ON_THE_WAY, Inbox, Outbox, Place},
    tls::ClientConfig,
    wire,
};
use rayon::ThreadPool;
use tokio::sync::{mpsc, oneshot};
use tracing::{info, warn};

use crate::{
    compute::Machine,
    session::{Action, Event, Outcome, Session},
};

/// Messages that may wait for the compute thread; a master sends at most a few ahead.
pub const WAITING_MESSAGES: usize = 64;
/// The first pause before dialling again; each next one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(200);
/// The longest pause before dialling again.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// How a worker process runs.
#[derive(Clone, Debug)]
pub struct Options {
    /// The master: `HOST:PORT`.
    pub master: String,
    /// Name of this host.
    pub name: String,
    /// Relative speed.
    pub speed: f64,
    /// Compute threads.
    pub threads: u32,
    /// Folder with this host's certificates.
    pub certs: Option<PathBuf>,
    /// How long a master that cannot be reached is dialled.
    pub patience: Duration,
    /// End with the first connection instead of dialling again.
    pub once: bool,
    /// The secret that the master asks for.
    pub token: Option<String>,
}

/// Computes for a master until a signal, a refusal, or until the master has been away for too long.
///
/// # Errors
/// Why it cannot go on, as a sentence.
pub fn run(options: &Options) -> std::result::Result<(), String> {
    let certificates = dial::certificates(options.certs.as_deref()).map_err(|e| e.to_string())?;
    let pool = compute_pool(options.threads as usize)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .thread_name("link")
        .build()
        .map_err(|e| format!("threads of the link: {e}"))?;
    let hello = greeting(options);
    let result = runtime.block_on(async {
        tokio::select! {
            result = stay(options, certificates.as_ref(), &hello, &pool) => result,
            () = interrupted() => Ok(()),
        }
    });
    // A task under way need not be waited for.
    runtime.shutdown_background();
    result
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
    hello
}

/// Ends at Ctrl-C or SIGTERM.
async fn interrupted() {
    use tokio::signal::unix::{SignalKind, signal};
    let Ok(mut term) = signal(SignalKind::terminate()) else { return std::future::pending().await };
    tokio::select! {
        interrupt = tokio::signal::ctrl_c() => if interrupt.is_err() { std::future::pending().await },
        _ = term.recv() => {}
    }
}

/// Dials, serves, dials again.
async fn stay(
    options: &Options,
    certificates: Option<&Arc<ClientConfig>>,
    hello: &Hello,
    pool: &Arc<ThreadPool>,
) -> std::result::Result<(), String> {
    let mut alone_since = Instant::now();
    let mut pause = FIRST_PAUSE;
    loop {
        let error = match dial::dial(&options.master, certificates, hello).await {
            Ok(call) => {
                info!(
                    host = call.welcome.host,
                    incarnation = call.welcome.incarnation,
                    "joined {}",
                    options.master
                );
                let error = serve(call, Arc::clone(pool)).await;
                if options.once {
                    return Ok(());
                }
                (alone_since, pause) = (Instant::now(), FIRST_PAUSE);
                warn!("link to {} ended: {error}; dialling again", options.master);
                error
            }
            Err(error) if is_final(&error) => return Err(error.to_string()),
            Err(error) => error,
        };
        if alone_since.elapsed() >= options.patience {
            let seconds = options.patience.as_secs();
            return Err(format!("no master at {} for {seconds} s; last: {error}", options.master));
        }
        tokio::time::sleep(pause).await;
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
}

/// Whether dialling again would meet the same.
fn is_final(error: &Error) -> bool {
    match error {
        Error::Refused { .. }
        | Error::Certificate(_)
        | Error::Address { .. }
        | Error::Message(_)
        | Error::Magic { .. }
        | Error::FrameVersion { .. } => true,
        // What TLS refuses.
        Error::Io { kind, .. } => *kind == std::io::ErrorKind::InvalidData,
        _ => false,
    }
}

/// Computes for the master at the other end until the connection ends; gives the reason.
pub async fn serve(call: Call, pool: Arc<ThreadPool>) -> Error {
    let Call { sender, mut receiver, welcome } = call;
    let (send, messages) = mpsc::channel(WAITING_MESSAGES);
    let (fail, mut failed) = oneshot::channel();
    let outbox = Outbox::new(sender.clone(), welcome.incarnation);
    let computing = std::thread::Builder::new().name("session".to_owned()).spawn(move || {
        if let Err(error) = pool.install(|| compute(outbox, messages)) {
            // The receiver is gone when the connection has ended already.
            let _ = fail.send(error);
        }
    });
    let error = match &computing {
        Err(error) => Error::io("starting the compute thread", error),
        Ok(_) => tokio::select! {
            error = listen(&mut receiver, &send) => error,
            Ok(error) = &mut failed => error,
        },
    };
    if !matches!(error, Error::Closed | Error::Left { .. } | Error::Io { .. }) {
        dial::leave(&sender, &error.to_string()).await;
    }
    drop((receiver, send));
    if let Ok(thread) = computing {
        // Two machines at a time would need twice the memory: wait for the task under way.
        let _ = tokio::task::spawn_blocking(move || thread.join()).await;
    }
    error
}

/// Hands every message on, in order; ends with the link.
async fn listen(receiver: &mut Receiver, send: &mpsc::Sender<(Header, ToWorker)>) -> Error {
    let mut inbox = Inbox::new(0, BULK_ON_THE_WAY);
    loop {
        if let Err(error) = hand_on(receiver, &mut inbox, send).await {
            return error;
        }
    }
}

async fn hand_on(
    receiver: &mut Receiver,
    inbox: &mut Inbox,
    send: &mpsc::Sender<(Header, ToWorker)>,
) -> Result<()> {
    inbox.accept(receiver.receive().await?)?;
    while let Some(letter) = inbox.take() {
        let message = wire::unpack_to_worker(letter.header.kind, &letter.bytes)?;
        receiver.recycle(letter.bytes);
        if send.send((letter.header, message)).await.is_err() {
            // The compute thread says why in its own words.
            std::future::pending::<()>().await;
        }
    }
    Ok(())
}

/// The compute thread: session and machine, one message after another.
fn compute(mut outbox: Outbox, mut messages: mpsc::Receiver<(Header, ToWorker)>) -> Result<()> {
    let mut session = Session::new();
    let mut machine = Machine::new();
    let mut watch = Watch::default();
    while let Some((header, message)) = messages.blocking_recv() {
        watch.heard(&header, &message)?;
        let mut events = VecDeque::from([Event::Message(message)]);
        while let Some(event) = events.pop_front() {
            for action in session.apply(event) {
                match action {
                    Action::Send(message) => {
                        let place = watch.said(&message, session.plan_hash());
                        outbox.send(place, wire::pack_to_master(&message)?)?;
                    }
                    // No links between workers yet: the master passes it on.
                    Action::SendPeer(to, message) => {
                        let relay = ToMaster::Relay { to, message };
                        let place = watch.said(&relay, session.plan_hash());
                        outbox.send(place, wire::pack_to_master(&relay)?)?;
                    }
                    Action::Compute(task) => {
                        let outcome = catch_unwind(AssertUnwindSafe(|| machine.run(task)));
                        let outcome = outcome.unwrap_or_else(|panic| {
                            machine = Machine::new();
                            Outcome::Failed(format!("a bug in the worker: {}", words(panic.as_ref())))
                        });
                        events.push_back(Event::Done(outcome));
                    }
                    Action::Forget => machine.forget(),
                }
            }
        }
    }
    Ok(())
}

/// What a panic said.
fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no words").to_owned()
}

/// Compares what frames say of themselves with the job in hand.
#[derive(Debug, Default)]
struct Watch {
    place: Place,
    /// Plan hashes of the cycles whose totals are still to come.
    plans: VecDeque<(u64, u64)>,
}

impl Watch {
    /// A message came: of the job in hand, of the cycle its frame names, following the plan its cycle was sent by.
    fn heard(&mut self, header: &Header, message: &ToWorker) -> Result<()> {
        if let ToWorker::Assign(assign) = message {
            self.place = Place { job: header.job, epoch: header.epoch, plan: assign.plan_hash };
            self.plans.clear();
            return Ok(());
        }
        let (theirs, ours) = ((header.job, header.epoch), (self.place.job, self.place.epoch));
        if theirs != ours {
            return Err(Error::Message(format!(
                "{} frame of job {} epoch {}, this worker has job {} epoch {}",
                header.kind, theirs.0, theirs.1, ours.0, ours.1
            )));
        }
        if let ToWorker::Totals { cycle, .. } = message {
            let plan = match self.plans.pop_front() {
                Some((sent, plan)) if sent == *cycle && header.cycle == *cycle => plan,
                sent => {
                    return Err(Error::Message(format!(
                        "totals of cycle {cycle} in a frame of cycle {}, those of {:?} are next",
                        header.cycle,
                        sent.map(|(cycle, _)| cycle)
                    )));
                }
            };
            if plan != header.plan {
                return Err(Error::Message(format!(
                    "totals of cycle {cycle} follow plan {:016x}, sent was plan {plan:016x}",
                    header.plan
                )));
            }
        }
        Ok(())
    }

    /// A message goes out under the plan in force.
    fn said(&mut self, message: &ToMaster, plan: u64) -> Place {
        self.place.plan = plan;
        if let ToMaster::Cycle { cycle, .. } = message {
            self.plans.push_back((*cycle, plan));
        }
        self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::frame::Kind;

    fn header(job: u32, cycle: u64, plan: u64) -> Header {
        Header { job, cycle, plan, ..Header::new(Kind::Totals) }
    }

    fn totals(cycle: u64) -> ToWorker {
        let quantum = mechanics::exact::Quantum::for_reference(1.0, 42);
        let orders = protocol::message::Orders {
            next: cycle + 1,
            dt: 1.0,
            time: 0.0,
            walls: Vec::new(),
            force_quantum: quantum,
            gather: false,
            collect: false,
            stop: false,
        };
        ToWorker::Totals { cycle, orders, totals: Vec::new() }
    }

    #[test]
    fn frames_of_another_job_cycle_or_plan_are_named() {
        let place = Place { job: 3, epoch: 0, plan: 8 };
        let sent = ToMaster::Cycle { cycle: 5, vote: None, partials: Vec::new(), gathered: Vec::new() };
        let fresh = || {
            let mut watch = Watch { place, plans: VecDeque::new() };
            assert_eq!(watch.said(&sent, 8), place);
            watch
        };
        assert_eq!(fresh().heard(&header(3, 5, 8), &totals(5)), Ok(()));
        for (header, message, words) in [
            (header(2, 5, 8), totals(5), "of job 2 epoch 0, this worker has job 3 epoch 0"),
            (
                header(3, 6, 8),
                totals(6),
                "totals of cycle 6 in a frame of cycle 6, those of Some(5) are next",
            ),
            (header(3, 6, 8), totals(5), "totals of cycle 5 in a frame of cycle 6"),
            (header(3, 5, 9), totals(5), "follow plan 0000000000000009, sent was plan 0000000000000008"),
        ] {
            let error = fresh().heard(&header, &message).expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
