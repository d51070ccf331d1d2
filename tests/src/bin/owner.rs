//! An owner comes back to a PC: `cargo run --release -p tests --bin owner -- [CYCLES]`, 20,000 unless said otherwise.
//!
//! Two workers, one for each of two processors; the second one yields to its owner. While a job runs on both, a program of ordinary priority, the
//! owner's, keeps the second processor busy to the end. Prints how soon that program has 95 % of the processor, as a mean over a second, and the time that the job takes from then on beside
//! that of the first worker alone. Uses `bolide-under-test` beside this program: build it first with `cargo build --release -p tests`. Ends with failure if the
//! digests differ.

use std::{
    io::{BufRead, BufReader, Read, Write},
    process::{Child, ChildStdin, ChildStdout, Command, ExitCode, Stdio},
    time::{Duration, Instant},
};

use rustix::process::setpriority_process;
use tests::cluster::{Cluster, Process, repository, until};

/// The argument by which this program is the owner's.
const OWNER: &str = "owner";
/// Of that program: how long it looks at what it gets of its processor.
const WINDOW: Duration = Duration::from_millis(50);
/// The part of its processor that it must have, over a second, to have it.
const HAS_IT: f64 = 0.95;

fn main() -> ExitCode {
    let argument = std::env::args().nth(1);
    if argument.as_deref() == Some(OWNER) {
        be_the_owner();
        return ExitCode::SUCCESS;
    }
    let cycles = argument.unwrap_or_else(|| "20000".to_owned());
    // Their priority is that of this program before it lowers its own, as the cluster is none of an owner's programs.
    let owners = [(); 3].map(|()| Owner::start());
    if let Err(error) = setpriority_process(None, 5) {
        eprintln!("owner: a lower priority: {error}");
        return ExitCode::FAILURE;
    }
    let mut jobs = [(&["rack"][..], 0.0), (&["rack", "desk"], 0.1), (&["rack", "desk"], 0.1)].into_iter();
    let [alone, with_owner, again] = owners.map(|owner| {
        let (workers, comes_after) = jobs.next().expect("as many as owners");
        play(&cycles, workers, (owner, comes_after))
    });
    println!(
        "workers       cycles  seconds after the owner came  of the bound  owner has 95 % after  digest"
    );
    let rate = f64::from(alone.cycles) / alone.seconds;
    let mut same = true;
    for played in [&alone, &with_owner, &again] {
        let bound = f64::from(played.cycles) / rate;
        println!(
            "{:12} {:7}  {:28.2}  {:12.3}  {:17.2} s   {}",
            played.workers,
            played.cycles,
            played.seconds,
            bound / played.seconds,
            played.owner_has_it,
            played.digest
        );
        same &= played.digest == alone.digest;
    }
    if same { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// How a job went.
struct Played {
    workers: String,
    /// Those that were left when the owner came.
    cycles: u32,
    /// What they took.
    seconds: f64,
    /// How long it took until the owner had the processor (s).
    owner_has_it: f64,
    digest: String,
}

/// Runs a job, to which the owner comes after a part of it.
fn play(cycles: &str, workers: &[&str], (mut owner, comes_after): (Owner, f64)) -> Played {
    let bolide = std::env::current_exe().expect("a path").with_file_name("bolide-under-test");
    let mut cluster = Cluster::start(bolide.to_str().expect("a path of letters"), false);
    for name in workers {
        match *name {
            "desk" => cluster.worker_with(name, "1", &["--pin", "1", "--yield-to-owner"]),
            name => cluster.worker_with(name, "1", &["--pin", "0"]),
        }
    }
    // The example, but only the number of cycles ends it.
    let text = std::fs::read_to_string(repository("deck/examples/plates-free-slip.toml")).expect("a deck");
    let deck = cluster.folder().join("plates.toml");
    std::fs::write(&deck, text.replace("end_time = 200.0 ", "end_time = 100000.0 ")).expect("room for it");
    let (n, deck) = (workers.len().to_string(), deck.display().to_string());
    let arguments = ["submit", &deck, "--cycles", cycles, "--workers", &n, "--no-output", "--wait"];
    let mut waiting = Process::start("submit", &mut cluster.command("client", &arguments));
    cluster.wait_until_running(1);
    let done = || cluster.job(1)["cycle"].as_u64().unwrap_or(0) as u32;
    let all: u32 = cycles.parse().expect("a number of cycles");
    let begin = (comes_after * f64::from(all)) as u32;
    until(|| "the first cycles".to_owned(), || (done() >= begin).then_some(()));
    let (start, done) = (Instant::now(), done());
    owner.come();
    assert!(waiting.wait().success(), "{}", waiting.text());
    let seconds = start.elapsed().as_secs_f64();
    let summary = cluster.json(&["watch", "1"]);
    Played {
        workers: workers.join(", "),
        cycles: all - done,
        seconds,
        owner_has_it: owner.go(),
        digest: summary["digest"].as_str().unwrap_or_default().to_owned(),
    }
}

/// The owner's program.
struct Owner {
    child: Child,
    tell: ChildStdin,
    says: ChildStdout,
}

impl Owner {
    fn start() -> Self {
        let mut command = Command::new(std::env::current_exe().expect("a path"));
        let mut child =
            command.arg(OWNER).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it starts");
        let (tell, says) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
        Self { child, tell, says }
    }

    fn come(&mut self) {
        self.tell.write_all(b"come\n").expect("it listens");
    }

    /// Ends it; gives how long it took until a second began in which it had its processor (s).
    fn go(mut self) -> f64 {
        self.tell.write_all(b"go\n").expect("it listens");
        drop(self.tell);
        let mut text = String::new();
        self.says.read_to_string(&mut text).expect("numbers");
        let _ = self.child.wait();
        let windows: Vec<f64> = text.split_whitespace().filter_map(|n| n.parse().ok()).collect();
        let second = (1.0 / WINDOW.as_secs_f64()) as usize;
        let has =
            windows.windows(second).position(|some| some.iter().sum::<f64>() >= HAS_IT * some.len() as f64);
        has.map_or(f64::INFINITY, |at| at as f64 * WINDOW.as_secs_f64())
    }
}

/// Waits for a line; then keeps the second processor busy to the next one, and prints what part of each window it had.
fn be_the_owner() {
    let pinned = system::processors::pin(&[1]);
    pinned.expect("a second processor");
    let mut lines = BufReader::new(std::io::stdin()).lines();
    if lines.next().is_none() {
        return;
    }
    let listener = std::thread::spawn(move || lines.next());
    let mut parts = Vec::new();
    while !listener.is_finished() {
        let (start, used) = (Instant::now(), system::clock::thread_cpu_ns());
        while start.elapsed() < WINDOW {}
        parts.push((system::clock::thread_cpu_ns() - used) as f64 / start.elapsed().as_nanos() as f64);
    }
    for part in parts {
        println!("{part:.3}");
    }
}
