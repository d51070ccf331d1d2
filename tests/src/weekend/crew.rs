//! The workers of a weekend: each is started again when it has died, and guests come for a while.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use crate::cluster::{Cluster, Process};

const NAMES: [&str; 5] = ["a", "b", "c", "d", "e"];
/// Those with threads that small jobs share.
const SHARED: [&str; 2] = ["b", "d"];

struct Worker {
    name: &'static str,
    process: Process,
    /// It is stopped until then.
    stopped: Option<Instant>,
}

/// A process that is ended after a while.
struct Guest {
    _process: Process,
    until: Instant,
}

pub(super) struct Crew {
    workers: Vec<Worker>,
    guests: Vec<Guest>,
    /// Guests so far.
    n_guests: u64,
}

impl Crew {
    pub(super) fn start(cluster: &Cluster) -> Self {
        let worker = |name| {
            cluster.certify(name);
            Worker { name, process: start(cluster, name), stopped: None }
        };
        let workers = NAMES.map(worker).into_iter().collect();
        cluster.certify("guest");
        Self { workers, guests: Vec::new(), n_guests: 0 }
    }

    /// Starts those that have died, lets those go on that were stopped long enough, and ends guests. Gives what may not be: a worker that a
    /// wrong clock has ended for good.
    pub(super) fn revive(&mut self, cluster: &Cluster) -> Vec<String> {
        let now = Instant::now();
        let mut wrong = Vec::new();
        for worker in &mut self.workers {
            if !worker.process.is_alive() {
                let text = worker.process.text();
                if worker.process.wait().code() == Some(1) && text.contains("expired") {
                    wrong.push(format!("worker {} ended by itself: {text}", worker.name));
                }
                (worker.process, worker.stopped) = (start(cluster, worker.name), None);
            } else if worker.stopped.is_some_and(|until| now >= until) {
                worker.process.signal("CONT");
                worker.stopped = None;
            }
        }
        self.guests.retain(|guest| now < guest.until);
        wrong
    }

    pub(super) fn wake_all(&mut self) {
        for worker in &mut self.workers {
            if worker.stopped.take().is_some() && worker.process.is_alive() {
                worker.process.signal("CONT");
            }
        }
        self.guests.clear();
    }

    /// Process ids of the workers.
    pub(super) fn ids(&self) -> Vec<u32> {
        self.workers.iter().map(|worker| worker.process.id()).collect()
    }

    pub(super) fn kill(&mut self, number: u64) {
        self.pick(number).process.kill();
    }

    /// Sends a signal to a worker that is not stopped.
    pub(super) fn signal(&mut self, number: u64, name: &str) {
        let worker = self.pick(number);
        if worker.stopped.is_none() && worker.process.is_alive() {
            worker.process.signal(name);
        }
    }

    pub(super) fn stop(&mut self, number: u64, time: Duration) {
        self.signal(number, "STOP");
        self.pick(number).stopped = Some(Instant::now() + time);
    }

    fn pick(&mut self, number: u64) -> &mut Worker {
        let index = number as usize % self.workers.len();
        &mut self.workers[index]
    }

    /// A worker whose elements are wrong by one unit in the last place comes for a while.
    pub(super) fn invite_wrong(&mut self, cluster: &Cluster, time: Duration) {
        self.n_guests += 1;
        let name = format!("guest@{}", self.n_guests);
        let mut command = cluster.command("guest", &["worker", "--name", &name, "--threads", "1"]);
        let process = Process::start(&name, command.env("BOLIDE_FAIL", "ulp:1"));
        self.guests.push(Guest { _process: process, until: Instant::now() + time });
    }

    /// A worker with the certificate of another CA calls once; gives what it says.
    pub(super) fn call_with_certificate_of(&mut self, cluster: &Cluster, certs: PathBuf) -> String {
        let arguments = ["worker", "--name", "worker", "--once", "--patience", "1", "--threads", "1"];
        let mut command = std::process::Command::new(cluster.command("guest", &[]).get_program());
        command.args(arguments).args(["--master", &cluster.address, "--certs"]).arg(certs);
        let mut process = Process::start("stranger", &mut command);
        // It ends by itself, whatever the master does.
        process.wait();
        process.text()
    }
}

fn start(cluster: &Cluster, name: &str) -> Process {
    let threads = if SHARED.contains(&name) { "4" } else { "1" };
    let mut command = cluster.command(name, &["worker", "--name", name, "--threads", threads]);
    Process::start(name, command.env("BOLIDE_LOG", "warn"))
}
