//! PROCESSES: `run --processes`, a child process for each worker, over loopback TCP.

use std::{
    collections::BTreeMap,
    net::Ipv4Addr,
    os::unix::process::CommandExt,
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{Arc, atomic::AtomicBool},
    time::{Duration, Instant},
};

use protocol::handshake::Role;
use tokio::{net::TcpListener, runtime::Runtime, sync::mpsc};

use crate::{
    connection::{Gate, listen},
    drive::{self, Seat, drive},
    embedded::{Sink, Traffic},
    event::{Action, Hand, Outcome},
    job::Job,
    notice::{Notice, WAITING_NOTICES},
};

/// The environment variable that names the executable, where this process is another one.
pub const BINARY: &str = "BOLIDE_BINARY";
/// The environment variable that brings a worker its secret.
pub const TOKEN: &str = "BOLIDE_TOKEN";
/// The longest that children may take to join.
const JOIN_LIMIT: Duration = Duration::from_secs(60);

/// Children that have joined. They are ended with this value.
pub struct Processes {
    gate: Arc<Gate>,
    seats: Vec<Seat>,
    children: Vec<Child>,
    /// Carries the links; taken only when this value is dropped.
    runtime: Option<Runtime>,
}

impl Processes {
    /// Starts a worker for each hand and waits until all have joined.
    ///
    /// # Errors
    /// If the executable cannot be started, a child ends, or not all join in time.
    pub fn start(hands: &[Hand]) -> Result<Self, String> {
        let binary = match std::env::var_os(BINARY) {
            Some(path) => PathBuf::from(path),
            None => std::env::current_exe().map_err(|e| format!("the path of this program: {e}"))?,
        };
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .thread_name("link")
            .build()
            .map_err(|e| format!("threads of links: {e}"))?;
        let fault = |e: std::io::Error| format!("listening on loopback: {e}");
        let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))).map_err(fault)?;
        let address = listener.local_addr().map_err(fault)?;
        let token = format!("{:016x}{:016x}", worker::random(), worker::random());
        let (events, mut heard) = mpsc::channel(WAITING_NOTICES);
        let gate = Arc::new(Gate::new(events, vec![Role::Worker], Some(token.clone()), None));
        runtime.spawn(listen(listener, Arc::clone(&gate)));
        let mut started = Self { gate, seats: Vec::new(), children: Vec::new(), runtime: None };
        for hand in hands {
            let child = Command::new(&binary)
                .args(["worker", "--once", "--master", &address.to_string(), "--name", &hand.name])
                .args(["--speed", &hand.speed.to_string(), "--threads", &hand.threads.to_string()])
                .env(TOKEN, &token)
                .env("BOLIDE_LOG", std::env::var("BOLIDE_LOG").unwrap_or_else(|_| "warn".to_owned()))
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                // Ctrl-C is for this process, which ends the run at a whole cycle.
                .process_group(0)
                .spawn()
                .map_err(|e| format!("starting {} worker: {e}", binary.display()))?;
            started.children.push(child);
        }
        started.seats = runtime.block_on(join(hands, &mut heard, &mut started.children))?;
        // What happens to the links from now on is told to the job by their own tasks.
        runtime.spawn(async move { while heard.recv().await.is_some() {} });
        started.runtime = Some(runtime);
        Ok(started)
    }

    /// Runs a job on them to its end.
    ///
    /// # Errors
    /// As for [`drive()`].
    pub fn run(
        &self,
        job: Job,
        first: Vec<Action>,
        sink: &mut dyn Sink,
        stop: &AtomicBool,
    ) -> Result<(Outcome, Traffic), String> {
        drive(job, first, 1, &self.seats, drive::channel(self.seats.len()), sink, stop)
    }
}

/// Waits until every hand has its seat, in the order of the hands.
async fn join(
    hands: &[Hand],
    heard: &mut mpsc::Receiver<Notice>,
    children: &mut [Child],
) -> Result<Vec<Seat>, String> {
    let deadline = Instant::now() + JOIN_LIMIT;
    let mut seats: BTreeMap<usize, Seat> = BTreeMap::new();
    while seats.len() < hands.len() {
        match tokio::time::timeout(Duration::from_millis(100), heard.recv()).await {
            Ok(Some(Notice::Knock { hello, answer, .. })) => {
                let place = hands.iter().position(|hand| hand.name == hello.name);
                let place = place.ok_or_else(|| format!("no worker {:?} was started", hello.name));
                // A child that has ended since is found below.
                let _ = answer.send(place.map(|place| place as u32));
            }
            Ok(Some(Notice::Joined(seat))) => {
                if let Some(place) = hands.iter().position(|hand| hand.name == seat.hand.name) {
                    seats.insert(place, seat);
                }
            }
            Ok(Some(Notice::Left { why, .. })) => {
                return Err(format!("a worker left before the start: {why}"));
            }
            Ok(Some(_)) => {}
            Ok(None) => return Err("the listener has ended".to_owned()),
            Err(_) => {
                for (child, hand) in children.iter_mut().zip(hands) {
                    if let Ok(Some(status)) = child.try_wait() {
                        return Err(format!("{} ended before it joined: {status}", hand.name));
                    }
                }
                if Instant::now() >= deadline {
                    let (joined, all, limit) = (seats.len(), hands.len(), JOIN_LIMIT.as_secs());
                    return Err(format!("{joined} of {all} workers joined within {limit} s"));
                }
            }
        }
    }
    Ok(seats.into_values().collect())
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.gate.end();
        if let Some(runtime) = self.runtime.take() {
            runtime.block_on(async {
                for seat in &self.seats {
                    protocol::dial::leave(&seat.sender(), "the run is over").await;
                }
            });
            runtime.shutdown_background();
        }
        for child in &mut self.children {
            // It may have gone by itself at the good-bye; both fail only then.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
