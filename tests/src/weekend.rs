//! WEEKEND: a lab that runs on by itself while something goes wrong every two seconds.
//!
//! A master and five workers are real processes with certificates; whoever dies is started again, as a service manager would do. Jobs of
//! mixed sizes are submitted all the time. Each [`Act`] does harm; the lists are in [`acts`]. Every job that ends must have the digest of the
//! undisturbed run of its deck, one that is held must say why and go on when it is resumed, and memory, descriptors and the spool must stay
//! bounded: [`curves`] has them.

pub mod acts;
mod crew;
pub mod curves;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::{Duration, Instant},
};

use serde_json::Value;

use crate::{
    cluster::{Cluster, Said, make_certificates, repository, said},
    faults::{disks::Disk, masters::clock_library},
    seeds::Draws,
};
use acts::Act;
use crew::Crew;
use curves::Curves;

/// Between two acts.
const ACT_EVERY: Duration = Duration::from_secs(2);
/// Jobs that wait or run, once the queue is full.
const QUEUED: usize = 4;
/// The longest that the last jobs may take after the last act.
const LAST_JOBS: Duration = Duration::from_secs(600);
/// The longest that a client waits for its answer (s).
const CLIENT_SECONDS: &str = "60";
/// Room of the spool.
const SPOOL: &str = "200m";
/// File of a clock's folder by which it is wrong.
const JUMP: &str = "jump";
/// What jobs that are over may take of it (GB).
const KEPT: &str = "0.05";

/// Two cubes that meet: a job of a moment.
const CUBES: &str = r#"
title = "weekend: cubes"
units = "SI"
[control]
end_cycle = 400
[[part]]
name = "low"
material = "LEAD"
box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [6, 6, 6] }
[[part]]
name = "high"
material = "LEAD"
velocity = [0, 0, -100]
box = { origin = [0.1, 0.2, 1.06], size = [1, 1, 1], cells = [6, 6, 6] }
[contact]
gap_fraction = 0.1
[output]
period = 1e-3
"#;

/// A deck of the weekend.
struct Kind {
    /// By this the list of jobs names it.
    title: String,
    path: PathBuf,
    cycles: &'static str,
    /// Digest of its undisturbed run; none of a deck that must fail.
    digest: Option<String>,
}

/// What was seen of the jobs.
#[derive(Debug, Default)]
pub struct Seen {
    pub submitted: u64,
    /// Submits and cancels that got no answer or were refused: the master was away, or its disk was full.
    pub unanswered: u64,
    /// With the digest of the undisturbed run.
    pub done: u64,
    /// Decks that must fail, with their reason.
    pub failed: u64,
    /// Taken back by their user.
    pub cancelled: u64,
    /// Held with a reason, and resumed.
    pub held: u64,
    /// Reasons for which jobs were held.
    pub reasons: BTreeSet<String>,
    /// What may not be.
    pub wrong: Vec<String>,
}

/// A weekend under way.
pub struct Weekend {
    cluster: Cluster,
    crew: Crew,
    draws: Draws,
    kinds: Vec<Kind>,
    /// By number: where a job stood when it was last looked at.
    jobs: BTreeMap<u64, String>,
    /// Jobs that were taken back.
    cancelled: BTreeSet<u64>,
    /// Jobs that want more workers than there are.
    crowd: BTreeSet<u64>,
    /// Of these so many may wait.
    crowd_limit: usize,
    pub seen: Seen,
    /// How often each act was done.
    pub acts: BTreeMap<Act, u64>,
    pub curves: Curves,
    /// The disk of the spool; none where it cannot be mounted.
    disk: Option<Disk>,
    /// Until when the disk is full.
    full_until: Option<Instant>,
    /// A folder with the master's wall clock; none where it cannot be made.
    clock: Option<tempfile::TempDir>,
    /// Until when that clock is wrong.
    wrong_until: Option<Instant>,
    begun: Instant,
}

impl Weekend {
    /// Runs each deck undisturbed, and starts the cluster. `seed` draws the acts.
    ///
    /// # Errors
    /// What kept it from that.
    pub fn begin(bolide: &Path, seed: u64) -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|e| format!("a folder: {e}"))?;
        let kinds = kinds(bolide, folder.path())?;
        make_certificates(bolide, &folder.path().join("certs"));
        make_certificates(bolide, &folder.path().join("others"));
        let spool = folder.path().join("spool");
        fs::create_dir(&spool).map_err(|e| format!("{}: {e}", spool.display()))?;
        let disk = Disk::mount(&spool, SPOOL);
        let flags = ["--http", "127.0.0.1:0", "--keep-gb", KEPT];
        let clock = clock_library();
        let paths = clock.as_ref().map(|clock| ["clock.so", JUMP].map(|name| clock.path().join(name)));
        let paths = paths.map(|paths| paths.map(|path| path.display().to_string()));
        let variables = match &paths {
            Some([library, jump]) => vec![("LD_PRELOAD", library.as_str()), ("BOLIDE_CLOCK_FILE", jump)],
            None => Vec::new(),
        };
        let cluster = Cluster::start_in(bolide, folder, true, &flags, None, &variables);
        let crew = Crew::start(&cluster);
        Ok(Self {
            cluster,
            crew,
            draws: Draws::new(seed),
            kinds,
            jobs: BTreeMap::new(),
            cancelled: BTreeSet::new(),
            crowd: BTreeSet::new(),
            crowd_limit: 1,
            seen: Seen::default(),
            acts: BTreeMap::new(),
            curves: Curves::default(),
            disk,
            full_until: None,
            clock,
            wrong_until: None,
            begun: Instant::now(),
        })
    }

    /// Plays for so long, then waits for the last jobs. Gives whether all was as it must be.
    pub fn play(&mut self, time: Duration) -> bool {
        let end = Instant::now() + time;
        while Instant::now() < end {
            let next = Instant::now() + ACT_EVERY;
            self.look();
            self.fill();
            self.act();
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
        }
        self.calm();
        let deadline = Instant::now() + LAST_JOBS;
        while Instant::now() < deadline && self.jobs.values().any(|state| !is_over(state)) {
            self.look();
            std::thread::sleep(ACT_EVERY);
        }
        self.look();
        for (job, state) in self.jobs.iter().filter(|(_, state)| !is_over(state)) {
            self.seen
                .wrong
                .push(format!("job {job} is {state} {} s after the last act", LAST_JOBS.as_secs()));
        }
        self.seen.wrong.is_empty()
    }

    /// Nothing goes wrong any more, and nobody waits for what never comes.
    fn calm(&mut self) {
        self.free_disk();
        self.set_clock_right();
        self.crew.wake_all();
        self.crowd_limit = 0;
    }

    /// Starts again whoever has died, and takes note of the jobs and of what all of it takes.
    fn look(&mut self) {
        self.revive();
        if self.full_until.is_some_and(|until| Instant::now() >= until) {
            self.free_disk();
        }
        if self.wrong_until.is_some_and(|until| Instant::now() >= until) {
            self.set_clock_right();
        }
        let status = self.status();
        for job in &status {
            self.note(job);
        }
        self.thin_crowd(&status);
        let spool = self.cluster.folder().join("spool");
        self.curves.sample(self.begun.elapsed(), self.cluster.master.id(), &self.crew.ids(), &spool);
    }

    /// Takes back the oldest of those that wait for workers who never come; each must say what it waits for.
    fn thin_crowd(&mut self, status: &[Value]) {
        let waiting: Vec<&Value> = status
            .iter()
            .filter(|job| job["state"] == "queued" && self.crowd.contains(&number_of(job)))
            .collect();
        let surplus = waiting.len().saturating_sub(self.crowd_limit);
        for job in waiting.into_iter().take(surplus) {
            let number = number_of(job);
            if !job["waits_for"].is_string() {
                self.seen.wrong.push(format!("job {number} waits and does not say what for"));
            }
            self.cancel(number);
        }
    }

    fn revive(&mut self) {
        if !self.cluster.master.is_alive() {
            // Neither a disk without room nor a wrong clock keeps a master from starting for long: somebody sees to that.
            self.free_disk();
            self.set_clock_right();
            self.cluster.restart_master();
        }
        self.seen.wrong.extend(self.crew.revive(&self.cluster));
    }

    fn free_disk(&mut self) {
        if self.full_until.take().is_some() {
            // It was never written where the disk was full already.
            let _ = fs::remove_file(self.ballast());
        }
    }

    fn set_clock_right(&mut self) {
        if self.wrong_until.take().is_some()
            && let Some(clock) = &self.clock
        {
            let _ = fs::remove_file(clock.path().join(JUMP));
        }
    }

    fn ballast(&self) -> PathBuf {
        self.cluster.folder().join("spool/ballast")
    }

    /// Asks as a client, and gives up after a while.
    fn ask(&self, arguments: &[&str]) -> Said {
        let inner = self.cluster.command("client", arguments);
        let mut command = Command::new("timeout");
        command.arg(CLIENT_SECONDS).arg(inner.get_program()).args(inner.get_args());
        said(command.current_dir(self.cluster.folder()))
    }

    /// All jobs, as the master lists them; none where it does not answer.
    fn status(&self) -> Vec<Value> {
        serde_json::from_str(&self.ask(&["jobs", "--json"]).out).unwrap_or_default()
    }

    /// Takes note of where a job stands, and judges it once, when it is over.
    fn note(&mut self, job: &Value) {
        let number = number_of(job);
        let state = job["state"].as_str().unwrap_or_default().to_owned();
        let before = self.jobs.insert(number, state.clone());
        if before.as_ref() == Some(&state) {
            return;
        }
        let failure = job["ended"]["failure"].as_str().unwrap_or_default();
        let digest = job["ended"]["digest"].as_str();
        let title = title_of(job);
        let Some(kind) = self.kinds.iter().find(|kind| kind.title == title) else {
            return self.seen.wrong.push(format!("job {number} is of nobody: {title:?}"));
        };
        if title == self.kinds[acts::CROWD].title {
            self.crowd.insert(number);
        }
        let wrong = match state.as_str() {
            _ if before.as_deref().is_some_and(|before| is_over(before) && before != "held") => {
                Some(format!("was {before:?} and is {state}"))
            }
            "done" if kind.digest.is_some() && kind.digest.as_deref() == digest => {
                self.seen.done += 1;
                None
            }
            "failed" if kind.digest.is_none() && failure.contains("time step") => {
                self.seen.failed += 1;
                None
            }
            "cancelled" if self.cancelled.contains(&number) => {
                self.seen.cancelled += 1;
                None
            }
            "held" if !failure.is_empty() => {
                self.seen.held += 1;
                self.seen.reasons.insert(failure.split(';').next().unwrap_or_default().to_owned());
                self.ask(&["resume", &number.to_string()]);
                None
            }
            "queued" | "running" => None,
            _ => Some(format!("ends {state}, digest {digest:?}, not {:?}, {failure:?}", kind.digest)),
        };
        self.seen.wrong.extend(wrong.map(|what| format!("job {number}, {title:?}: {what}")));
    }

    /// Jobs that wait for their turn or run, as they were last seen.
    fn n_open(&self) -> usize {
        self.jobs.iter().filter(|(job, state)| !is_over(state) && !self.crowd.contains(job)).count()
    }

    /// Submits small and large jobs until the queue is full.
    fn fill(&mut self) {
        let mut open = self.n_open();
        while open < QUEUED {
            let usual = self.kinds.len() - acts::SPECIAL;
            let kind = [0, 0, 0, 1, 1, 2, 3][self.draws.below(7) as usize] % usual;
            if !self.submit(kind, &[]) {
                return;
            }
            open += 1;
        }
    }

    /// Submits a job of a kind; gives whether the master took it.
    fn submit(&mut self, kind: usize, more: &[&str]) -> bool {
        let verify = ["0", "0", "0.5"][self.draws.below(3) as usize];
        let Kind { path, cycles, .. } = &self.kinds[kind];
        let path = path.display().to_string();
        let flags =
            ["submit", &path, "--cycles", cycles, "--snapshot-every", "1", "--verify", verify, "--json"];
        let said = self.ask(&[&flags, more].concat());
        let taken = said.code == Some(0);
        if taken {
            self.seen.submitted += 1
        } else {
            self.seen.unanswered += 1
        }
        taken
    }

    fn cancel(&mut self, job: u64) {
        // Who hears nothing does not know; either end is good then.
        self.cancelled.insert(job);
        if self.ask(&["cancel", &job.to_string()]).code != Some(0) {
            self.seen.unanswered += 1;
        }
    }
}

fn number_of(job: &Value) -> u64 {
    job["job"].as_u64().unwrap_or_default()
}

fn title_of(job: &Value) -> &str {
    job["title"].as_str().unwrap_or_default()
}

fn is_over(state: &str) -> bool {
    !matches!(state, "queued" | "running")
}

/// The decks, with their undisturbed digests; special ones last, see [`acts::SPECIAL`].
fn kinds(bolide: &Path, folder: &Path) -> Result<Vec<Kind>, String> {
    let decks = folder.join("decks");
    fs::create_dir(&decks).map_err(|e| format!("{}: {e}", decks.display()))?;
    let write = |name: &str, text: String| {
        let path = decks.join(name);
        fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display())).map(|()| path)
    };
    let poison =
        CUBES.replace("cubes\"", "poison\"").replace("[control]", "[control]\ntime_step_floor = 1.0");
    let crowd = CUBES.replace("cubes\"", "crowd\"");
    let listed = [
        (write("cubes.toml", CUBES.to_owned())?, "400"),
        (repository("tests/decks/plates-small.toml"), "300"),
        (repository("deck/examples/plates-free-slip.toml"), "80"),
        (repository("deck/examples/plates-joined.toml"), "60"),
        (write("poison.toml", poison)?, "400"),
        (write("crowd.toml", crowd)?, "400"),
    ];
    let kind = |(path, cycles): (PathBuf, &'static str)| {
        let out = folder.join("undisturbed");
        let mut command = Command::new(bolide);
        command.arg("run").arg(&path).args([
            "--cycles",
            cycles,
            "--threads",
            "1",
            "--json",
            "--force",
            "--out",
        ]);
        let said = said(command.arg(&out));
        let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let title = text.lines().find_map(|line| line.strip_prefix("title = \"")?.strip_suffix('"'));
        let title = title.ok_or_else(|| format!("{}: no title", path.display()))?.to_owned();
        let summary: Value =
            serde_json::from_str(&said.out).map_err(|e| format!("{title}: {e}: {said:?}"))?;
        let digest = (said.code == Some(0)).then(|| summary["digest"].as_str().map(str::to_owned)).flatten();
        Ok(Kind { title, path, cycles, digest })
    };
    listed.into_iter().map(kind).collect()
}
