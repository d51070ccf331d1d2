//! CLUSTER: a master and workers as real processes on port 0, and clients that talk to them.
//!
//! The path of the binary comes from the caller. Nothing sleeps for a fixed time: a test waits for a printed line or a
//! condition, and fails at a deadline with all that was printed. Processes are ended by their id when a value is
//! dropped.

use std::{
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// The longest that a test waits for anything.
pub const DEADLINE: Duration = Duration::from_secs(120);
/// Between two looks at a condition that nothing announces.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// What belongs in no binary but `bolide-under-test`: words of [`crate::failpoint`] and the name of the function behind its bug.
pub const FAULTS: [&str; 6] =
    ["BOLIDE_FAIL", "die-in-", "die-before-", "a test has ordered", "plant_fault", "flip_bit"];

/// Whether a program's code or data have these words in them, or one of its functions has them in its name. Debug information does
/// not count: it also speaks of functions that the linker has left out.
///
/// # Panics
/// If the bytes are no ELF file.
pub fn holds(program: &[u8], words: &str) -> bool {
    use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf::SHF_ALLOC};
    let file = object::File::parse(program).expect("a program");
    let loaded =
        |flags| matches!(flags, SectionFlags::Elf { sh_flags } if sh_flags & u64::from(SHF_ALLOC) != 0);
    let said = |bytes: &[u8]| bytes.windows(words.len()).any(|window| window == words.as_bytes());
    file.sections().filter(|section| loaded(section.flags())).any(|section| section.data().is_ok_and(said))
        || file.symbols().any(|symbol| symbol.name_bytes().is_ok_and(said))
}

/// A folder of this repository, from its root.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// A running process and the lines it has printed.
pub struct Process {
    name: String,
    child: Child,
    printed: Arc<Printed>,
    /// Threads that read what it prints; each ends when there is nothing more.
    readers: [JoinHandle<()>; 2],
}

#[derive(Default)]
struct Printed {
    lines: Mutex<Vec<String>>,
    more: Condvar,
}

impl Printed {
    fn lines(&self) -> MutexGuard<'_, Vec<String>> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn collect(self: &Arc<Self>, from: impl Read + Send + 'static) -> JoinHandle<()> {
        let printed = Arc::clone(self);
        std::thread::spawn(move || {
            for line in BufReader::new(from).lines() {
                let Ok(line) = line else { return };
                printed.lines().push(line);
                printed.more.notify_all();
            }
        })
    }
}

impl Process {
    /// Starts a command and collects what it prints.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start(name: &str, command: &mut Command) -> Self {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the binary starts");
        let printed = Arc::new(Printed::default());
        let readers = [
            printed.collect(child.stdout.take().expect("piped")),
            printed.collect(child.stderr.take().expect("piped")),
        ];
        Self { name: name.to_owned(), child, printed, readers }
    }

    /// The first line with `words` in it, now or later.
    ///
    /// # Panics
    /// At the deadline, with all lines so far.
    pub fn wait_for(&self, words: &str) -> String {
        let deadline = Instant::now() + DEADLINE;
        let mut lines = self.printed.lines();
        loop {
            if let Some(line) = lines.iter().find(|line| line.contains(words)) {
                return line.clone();
            }
            let left = deadline.saturating_duration_since(Instant::now());
            assert!(!left.is_zero(), "{} never printed {words:?}, only:\n{}", self.name, lines.join("\n"));
            lines = self.printed.more.wait_timeout(lines, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// How many of the lines so far have `words` in them.
    pub fn count(&self, words: &str) -> usize {
        self.printed.lines().iter().filter(|line| line.contains(words)).count()
    }

    /// Everything printed so far.
    pub fn text(&self) -> String {
        self.printed.lines().join("\n")
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// What its threads have used of processors so far (s), as Linux counts it.
    ///
    /// # Panics
    /// If it has ended, or the system has no `/proc`.
    pub fn processor_seconds(&self) -> f64 {
        let path = format!("/proc/{}/stat", self.id());
        let stat = std::fs::read_to_string(&path).expect("it runs");
        // The name of the program, in brackets, may hold spaces. A tick is 10 ms on every Linux.
        let fields = stat.rsplit(')').next().expect("a line").split_whitespace();
        let ticks = fields.skip(11).take(2).filter_map(|field| field.parse::<f64>().ok());
        ticks.sum::<f64>() / 100.0
    }

    /// Whether it runs.
    pub fn is_alive(&mut self) -> bool {
        self.child.try_wait().is_ok_and(|status| status.is_none())
    }

    /// Sends it a signal, by its name without `SIG`.
    ///
    /// # Panics
    /// If there is no such signal.
    pub fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.id().to_string()]).status();
        assert!(sent.expect("kill is there").success(), "kill -{name} {}", self.id());
    }

    /// Ends it as `kill -9` does.
    pub fn kill(&mut self) {
        // It may have ended by itself; both fail only then.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Waits for its end, and until all that it has printed is read.
    ///
    /// # Panics
    /// At the deadline.
    pub fn wait(&mut self) -> ExitStatus {
        let name = self.name.clone();
        let printed = Arc::clone(&self.printed);
        until(
            || format!("the end of {name}; it printed:\n{}", printed.lines().join("\n")),
            || {
                let status = self.child.try_wait().ok().flatten()?;
                self.readers.iter().all(JoinHandle::is_finished).then_some(status)
            },
        )
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Looks until there is something.
///
/// # Panics
/// At the deadline, naming `what`.
pub fn until<T>(what: impl Fn() -> String, mut look: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + DEADLINE;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < deadline, "waited in vain for {}", what());
        std::thread::sleep(LOOK_EVERY);
    }
}

/// What a client printed and how it ended.
#[derive(Debug)]
pub struct Said {
    /// Its exit code.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// A master, its workers, and a folder for all their files.
pub struct Cluster {
    binary: PathBuf,
    folder: tempfile::TempDir,
    pub master: Process,
    /// Where it listens.
    pub address: String,
    workers: Vec<(String, Process)>,
    tls: bool,
    /// Of the master.
    flags: Vec<String>,
    /// Of the environment of all daemons.
    variables: Vec<(String, String)>,
}

impl Cluster {
    /// Starts a master; with `tls` certificates are made for it, for workers and for clients.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn start(binary: &str, tls: bool) -> Self {
        Self::start_with(binary, tls, &[], None)
    }

    /// The same with further flags, and with faults ordered by `BOLIDE_FAIL`.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn start_with(binary: &str, tls: bool, flags: &[&str], fail: Option<&str>) -> Self {
        let binary = PathBuf::from(binary);
        let folder = tempfile::tempdir().expect("a folder for the test");
        if tls {
            make_certificates(&binary, &folder.path().join("certs"));
        }
        Self::start_in(&binary, folder, tls, flags, fail, &[])
    }

    /// The same in a folder that has what it needs, with further variables of the environment for all daemons.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn start_in(
        binary: &Path,
        folder: tempfile::TempDir,
        tls: bool,
        flags: &[&str],
        fail: Option<&str>,
        variables: &[(&str, &str)],
    ) -> Self {
        let flags: Vec<String> = flags.iter().map(|&flag| flag.to_owned()).collect();
        let variables: Vec<_> =
            variables.iter().map(|&(name, value)| (name.to_owned(), value.to_owned())).collect();
        let mut command = master_of(binary, folder.path(), "127.0.0.1:0", tls, &flags, fail);
        let master = Process::start("master", command.envs(variables.iter().cloned()));
        let line = master.wait_for("listening on ");
        let address = line.trim_start_matches("listening on ").to_owned();
        Self {
            binary: binary.to_owned(),
            folder,
            master,
            address,
            workers: Vec::new(),
            tls,
            flags,
            variables,
        }
    }

    /// Starts another master at the same address on the same files, once the present one has ended.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn restart_master(&mut self) {
        self.master.wait();
        let mut command =
            master_of(&self.binary, self.folder.path(), &self.address, self.tls, &self.flags, None);
        self.master = Process::start("master", command.envs(self.variables.iter().cloned()));
        self.master.wait_for("listening on ");
    }

    pub fn results(&self, job: u32) -> PathBuf {
        self.folder().join(format!("spool/job-{job}"))
    }

    pub fn snapshots(&self, job: u32) -> PathBuf {
        self.folder().join(format!("spool/queue/job-{job}.snapshots"))
    }

    /// The folder of this cluster's files, gone with it.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A command of the binary that talks to this master with the certificates of `host`.
    pub fn command(&self, host: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.binary);
        command.args(arguments).args(["--master", &self.address]).current_dir(self.folder.path());
        if self.tls {
            command.arg("--certs").arg(self.folder.path().join("certs").join(host));
        }
        command
    }

    /// Starts a worker with one thread and waits until it has joined.
    ///
    /// # Panics
    /// If it does not join.
    pub fn worker(&mut self, name: &str, speed: &str) {
        self.worker_with(name, speed, &[]);
    }

    /// The same with further flags.
    ///
    /// # Panics
    /// If it does not join.
    pub fn worker_with(&mut self, name: &str, speed: &str, flags: &[&str]) {
        self.worker_as(name, name, speed, flags);
    }

    /// The same with the certificate of a host other than `worker`.
    ///
    /// # Panics
    /// If it does not join.
    pub fn worker_as(&mut self, host: &str, name: &str, speed: &str, flags: &[&str]) {
        let mut arguments = vec!["worker", "--name", name, "--speed", speed];
        if !flags.contains(&"--threads") {
            arguments.extend(["--threads", "1"]);
        }
        arguments.extend(flags);
        self.certify(host);
        let mut command = self.command(host, &arguments);
        command.envs(self.variables.iter().cloned());
        let worker = Process::start(name, command.env("BOLIDE_LOG", "info"));
        worker.wait_for("joined");
        self.master.wait_for(&format!("worker {name} joined"));
        self.workers.push((name.to_owned(), worker));
    }

    /// Makes the certificate of a worker, where there are certificates and it has none.
    ///
    /// # Panics
    /// If the binary does not make it.
    pub fn certify(&self, host: &str) {
        let certs = self.folder().join("certs");
        if !self.tls || certs.join(host).is_dir() {
            return;
        }
        let mut command = Command::new(&self.binary);
        command.args(["certs", "host"]).arg(certs).args([host, "--role", "worker", "--address", "127.0.0.1"]);
        let made = said(&mut command);
        assert_eq!(made.code, Some(0), "{made:?}");
    }

    /// Starts a worker with faults ordered by `BOLIDE_FAIL`.
    ///
    /// # Panics
    /// If it does not join.
    pub fn worker_that_fails(&mut self, name: &str, fail: &str) {
        let address = self.address.clone();
        self.worker_through(name, &address, fail);
    }

    /// Starts a worker that dials the master at another address, with faults ordered by `BOLIDE_FAIL`.
    ///
    /// # Panics
    /// If it does not join.
    pub fn worker_through(&mut self, name: &str, address: &str, fail: &str) {
        let arguments = ["worker", "--name", name, "--threads", "1"];
        let mut command = Command::new(&self.binary);
        command.args(arguments).args(["--master", address]).current_dir(self.folder.path());
        command.envs(self.variables.iter().cloned());
        let worker = Process::start(name, command.env("BOLIDE_LOG", "info").env("BOLIDE_FAIL", fail));
        worker.wait_for("joined");
        self.master.wait_for(&format!("worker {name} joined"));
        self.workers.push((name.to_owned(), worker));
    }

    /// What master and workers have used of processors so far (s).
    ///
    /// # Panics
    /// If one has ended.
    pub fn processor_seconds(&self) -> f64 {
        let workers = self.workers.iter().map(|(_, worker)| worker.processor_seconds());
        self.master.processor_seconds() + workers.sum::<f64>()
    }

    /// The process of a worker, to wait for its end.
    ///
    /// # Panics
    /// If there is none of that name.
    pub fn process_mut(&mut self, name: &str) -> &mut Process {
        let worker = self.workers.iter_mut().find(|(n, _)| n == name);
        &mut worker.expect("a worker of that name").1
    }

    /// The process of a worker.
    ///
    /// # Panics
    /// If there is none of that name.
    pub fn process(&self, name: &str) -> &Process {
        let worker = self.workers.iter().find(|(n, _)| n == name);
        &worker.expect("a worker of that name").1
    }

    /// Where a worker takes other workers.
    ///
    /// # Panics
    /// If it does not say so.
    pub fn peer_address(&self, name: &str) -> String {
        let words = "listening for other workers on ";
        let line = self.process(name).wait_for(words);
        let rest = line.split(words).nth(1).and_then(|rest| rest.split_whitespace().next());
        rest.expect("an address").to_owned()
    }

    /// Ends a worker as `kill -9` does.
    ///
    /// # Panics
    /// If there is none of that name.
    pub fn kill_worker(&mut self, name: &str) {
        let worker = self.workers.iter_mut().find(|(n, _)| n == name);
        worker.expect("a worker of that name").1.kill();
    }

    /// Runs a client to its end.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn client(&self, arguments: &[&str]) -> Said {
        said(&mut self.command("client", arguments))
    }

    /// What a client prints with `--json`.
    ///
    /// # Panics
    /// If that is no JSON.
    pub fn json(&self, arguments: &[&str]) -> serde_json::Value {
        let mut arguments = arguments.to_vec();
        arguments.push("--json");
        let said = self.client(&arguments);
        serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{arguments:?}: {e} in {said:?}"))
    }

    /// The status of a job, as `jobs --json` gives it.
    ///
    /// # Panics
    /// If there is no such job.
    pub fn job(&self, job: u64) -> serde_json::Value {
        self.find_job(job).unwrap_or_else(|| panic!("no job {job}"))
    }

    /// The same, if the master can be asked and knows the job.
    pub fn find_job(&self, job: u64) -> Option<serde_json::Value> {
        let jobs: serde_json::Value = serde_json::from_str(&self.client(&["jobs", "--json"]).out).ok()?;
        jobs.as_array().and_then(|jobs| jobs.iter().find(|s| s["job"] == job).cloned())
    }

    /// Waits until a job is under way in its cycles.
    pub fn wait_until_running(&self, job: u64) {
        let status = std::cell::RefCell::new(serde_json::Value::Null);
        until(
            || format!("job {job} to run; {}", status.borrow()),
            || {
                *status.borrow_mut() = self.find_job(job).unwrap_or_default();
                let status = status.borrow();
                (status["state"] == "running" && status["cycle"].as_u64() > Some(0)).then_some(())
            },
        );
    }
}

fn master_of(
    binary: &Path,
    folder: &Path,
    listen: &str,
    tls: bool,
    flags: &[String],
    fail: Option<&str>,
) -> Command {
    let mut command = Command::new(binary);
    command.args(["master", "--listen", listen, "--spool"]).arg(folder.join("spool")).args(flags);
    if tls {
        command.arg("--certs").arg(folder.join("certs/master"));
    }
    command.env("BOLIDE_LOG", "info").env("BOLIDE_FAIL", fail.unwrap_or_default());
    command
}

/// Runs a command to its end.
///
/// # Panics
/// If it cannot be started.
pub fn said(command: &mut Command) -> Said {
    let output = command.output().expect("the binary starts");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Said { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// A CA in `folder` with the hosts `master`, `worker` and `client`, made by the binary.
///
/// # Panics
/// If the binary does not make them.
pub fn make_certificates(binary: &Path, folder: &Path) {
    let made = said(Command::new(binary).args(["certs", "ca"]).arg(folder));
    assert_eq!(made.code, Some(0), "{made:?}");
    for role in ["master", "worker", "client"] {
        let mut command = Command::new(binary);
        command.args(["certs", "host"]).arg(folder).args([role, "--role", role, "--address", "127.0.0.1"]);
        let made = said(&mut command);
        assert_eq!(made.code, Some(0), "{made:?}");
    }
}
