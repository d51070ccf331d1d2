//! PROCESSES: `run --processes`, a child process for each worker, over loopback TCP.

use std::{
    collections::BTreeMap,
    net::Ipv4Addr,
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{Arc, atomic::AtomicBool},
    time::{Duration, Instant},
};

use protocol::handshake::Role;
use tokio::{net::TcpListener, runtime::Runtime, sync::mpsc};

use crate::{
    connection::{Acceptor, listen},
    drive::{self, WorkerLink, drive},
    embedded::{Sink, Traffic},
    event::{Action, Outcome, WorkerSpec},
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
    acceptor: Arc<Acceptor>,
    worker_links: Vec<WorkerLink>,
    children: Vec<Child>,
    /// Carries the links; taken only when this value is dropped.
    runtime: Option<Runtime>,
}

impl Processes {
    /// Starts a worker for each specification and waits until all have joined.
    ///
    /// # Errors
    /// If the executable cannot be started, a child ends, or not all join in time.
    pub fn start(specs: &[WorkerSpec]) -> Result<Self, String> {
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
        let acceptor = Arc::new(Acceptor::new(events, vec![Role::Worker], Some(token.clone()), None));
        runtime.spawn(listen(listener, Arc::clone(&acceptor)));
        let mut started = Self { acceptor, worker_links: Vec::new(), children: Vec::new(), runtime: None };
        for spec in specs {
            let mut command = Command::new(&binary);
            command
                .args(["worker", "--once", "--master", &address.to_string(), "--name", &spec.name])
                .args(["--speed", &spec.speed.to_string(), "--threads", &spec.threads.to_string()])
                .env(TOKEN, &token)
                .env("BOLIDE_LOG", std::env::var("BOLIDE_LOG").unwrap_or_else(|_| "warn".to_owned()))
                .stdin(Stdio::null())
                .stdout(Stdio::null());
            // Ctrl-C is for this process, which ends the run at a whole cycle.
            system::children::apart(&mut command);
            let child = command.spawn().map_err(|e| format!("starting {} worker: {e}", binary.display()))?;
            started.children.push(child);
        }
        started.worker_links = runtime.block_on(join(specs, &mut heard, &mut started.children))?;
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
        let line = drive::channel(self.worker_links.len());
        drive(job, first, 1, &self.worker_links, line, sink, stop).map_err(|e| e.to_string())
    }
}

/// Waits until every specification has its link, in the order of the workers.
async fn join(
    specs: &[WorkerSpec],
    heard: &mut mpsc::Receiver<Notice>,
    children: &mut [Child],
) -> Result<Vec<WorkerLink>, String> {
    let deadline = Instant::now() + JOIN_LIMIT;
    let mut worker_links: BTreeMap<usize, WorkerLink> = BTreeMap::new();
    while worker_links.len() < specs.len() {
        match tokio::time::timeout(Duration::from_millis(100), heard.recv()).await {
            Ok(Some(Notice::Knock { hello, answer, .. })) => {
                let place = specs.iter().position(|spec| spec.name == hello.name);
                let place = place.ok_or_else(|| format!("no worker {:?} was started", hello.name));
                // A child that has ended since is found below.
                let _ = answer.send(place.map(|place| place as u32));
            }
            Ok(Some(Notice::Joined(worker_link))) => {
                if let Some(place) = specs.iter().position(|spec| spec.name == worker_link.spec.name) {
                    worker_links.insert(place, worker_link);
                }
            }
            Ok(Some(Notice::Left { why, .. })) => {
                return Err(format!("a worker left before the start: {why}"));
            }
            Ok(Some(_)) => {}
            Ok(None) => return Err("the listener has ended".to_owned()),
            Err(_) => {
                for (child, spec) in children.iter_mut().zip(specs) {
                    if let Ok(Some(status)) = child.try_wait() {
                        return Err(format!("{} ended before it joined: {status}", spec.name));
                    }
                }
                if Instant::now() >= deadline {
                    let (joined, all, limit) = (worker_links.len(), specs.len(), JOIN_LIMIT.as_secs());
                    return Err(format!("{joined} of {all} workers joined within {limit} s"));
                }
            }
        }
    }
    Ok(worker_links.into_values().collect())
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.acceptor.end();
        if let Some(runtime) = self.runtime.take() {
            runtime.block_on(async {
                for worker_link in &self.worker_links {
                    protocol::dial::leave(&worker_link.sender(), "the run is over").await;
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
