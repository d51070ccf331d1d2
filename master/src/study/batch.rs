//! Runs of a study as tasks of a site's own batch system, over a folder that all machines see: job arrays of Slurm, or a launcher by a template.
//!
//! ```text
//! OUT/tasks/run-task                 computes the run of a folder: what a task does
//! OUT/tasks/<identity>/deck          its deck, with all files
//! OUT/tasks/<identity>/job           the Slurm job that has it
//! OUT/tasks/<identity>/results/      as of any `bolide run`
//! OUT/tasks/<identity>/exit          written when it is over: the exit code
//! ```
//!
//! A task that ends without `exit` was cancelled, preempted or lost; it is put there again and goes on from its last checkpoint.

use std::{
    collections::BTreeMap,
    fmt, fs, io,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::Arc,
    time::{Duration, Instant},
};

use super::{
    cache::{Cache, FILES},
    place::{Finished, Place, RunError, Task},
};
use crate::{results::Summary, shell::quoted};

/// How often tasks are looked at.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How long the `exit` of a task that its engine knows no more may take to be seen here: shared folders are seen late.
const GRACE: Duration = Duration::from_secs(5);
/// How often a run is begun before it counts as failed.
const MOST_TRIES: u32 = 5;
/// Tasks of one array at most: what Slurm takes unless it is told otherwise.
const MOST_OF_ARRAY: usize = 1_000;

const RUN_TASK: &str = r#"#!/bin/sh
# Computes one run of a study: the folder of the task is $1. Made by `bolide study`.
cd "$1" || exit 1
exec 9> lock
flock 9 || exit 1
[ -f exit ] && exit 0
if [ -d results/snapshots ]; then set -- --resume results; else set -- --out results --force; fi
BOLIDE run deck "$@" --snapshot-every 60 THREADS > log 2>&1
code=$?
# 130: it was asked to stop, and goes on when it is begun again.
[ $code = 130 ] && exit 130
echo $code > exit.new && mv exit.new exit
"#;

/// What computes the tasks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Job arrays of Slurm, by `sbatch` and `squeue` on the path.
    Slurm,
    /// A command for each task, which ends when the task does; `{run}` in it is the command of the task.
    Command(String),
}

/// Why tasks cannot be computed.
#[derive(Debug)]
pub enum Error {
    /// The system refused.
    Io { path: PathBuf, source: io::Error },
    /// A program of the engine cannot be started.
    Start { program: String, source: io::Error },
    /// It refused, in its words.
    Refused { program: String, said: String },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, source } => write!(f, "{}: {source}", path.display()),
            Self::Start { program, source } => write!(f, "{program} cannot be started: {source}"),
            Self::Refused { program, said } => write!(f, "{program}: {said}"),
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}

fn at<'a>(path: &'a Path) -> impl FnOnce(io::Error) -> Error + 'a {
    move |source| Error::Io { path: path.to_owned(), source }
}

/// A batch system.
pub struct Batch {
    engine: Engine,
    folder: PathBuf,
    cache: Arc<Cache>,
    /// Tasks at once.
    most: usize,
    /// By identity.
    tasks: BTreeMap<String, Tracked>,
}

struct Tracked {
    task: Task,
    tries: u32,
    engine: Held,
}

/// Where a task is.
enum Held {
    /// It has still to be begun.
    No,
    /// In an array of Slurm.
    Job(String),
    /// Behind a launcher.
    Launcher(Child),
    /// The engine knows it no more since then.
    Gone(Instant),
}

impl Batch {
    /// With tasks in a folder that all machines see, at most so many at once, each of so many threads.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn new(
        engine: Engine,
        out: &Path,
        cache: Arc<Cache>,
        most: usize,
        threads: Option<u32>,
    ) -> Result<Self, Error> {
        let folder = out.join("tasks");
        fs::create_dir_all(&folder).map_err(at(&folder))?;
        let folder = fs::canonicalize(&folder).map_err(at(&folder))?;
        let binary = std::env::current_exe().map_err(at(Path::new("this program")))?;
        let threads = threads.map_or_else(String::new, |threads| format!("--threads {threads}"));
        let script =
            RUN_TASK.replace("BOLIDE", &quoted(&binary.display().to_string())).replace("THREADS", &threads);
        let path = folder.join("run-task");
        system::children::script(&path, &script).map_err(at(&path))?;
        Ok(Self { engine, folder, cache, most, tasks: BTreeMap::new() })
    }

    fn folder_of(&self, identity: &str) -> PathBuf {
        self.folder.join(identity)
    }

    fn command_of(&self, identity: &str) -> String {
        let [script, folder] = [self.folder.join("run-task"), self.folder_of(identity)];
        format!("sh {} {}", quoted(&script.display().to_string()), quoted(&folder.display().to_string()))
    }

    /// Begins the tasks that have not been begun.
    fn begin(&mut self) -> Result<(), Error> {
        let idle = |(identity, tracked): (&String, &Tracked)| {
            matches!(tracked.engine, Held::No).then(|| identity.clone())
        };
        let idle: Vec<String> = self.tasks.iter().filter_map(idle).collect();
        match &self.engine {
            Engine::Slurm => {
                for identities in idle.chunks(MOST_OF_ARRAY) {
                    let job = self.submit_array(identities)?;
                    for identity in identities {
                        let path = self.folder_of(identity).join("job");
                        fs::write(&path, &job).map_err(at(&path))?;
                        if let Some(tracked) = self.tasks.get_mut(identity) {
                            tracked.engine = Held::Job(job.clone());
                        }
                    }
                }
            }
            Engine::Command(template) => {
                for identity in idle {
                    let line = template.replace("{run}", &self.command_of(&identity));
                    let mut command = system::children::shell(&line);
                    command.stdin(Stdio::null()).stdout(Stdio::null());
                    let child = command.spawn().map_err(|source| Error::Start { program: line, source })?;
                    if let Some(tracked) = self.tasks.get_mut(&identity) {
                        tracked.engine = Held::Launcher(child);
                    }
                }
            }
        }
        Ok(())
    }

    /// Puts tasks into Slurm's queue as one array; gives its number.
    fn submit_array(&self, identities: &[String]) -> Result<String, Error> {
        let list = self.folder.join("array.txt");
        let number = (1..).map(|n| self.folder.join(format!("array-{n}.sh"))).find(|path| !path.exists());
        let script = number.unwrap_or(list);
        let mut text = format!(
            "#!/bin/sh\n#SBATCH --job-name=bolide-study\n#SBATCH --array=1-{}\n#SBATCH --ntasks=1\n#SBATCH --requeue\n\
             #SBATCH --output=/dev/null\ncase $SLURM_ARRAY_TASK_ID in\n",
            identities.len()
        );
        for (number, identity) in (1..).zip(identities) {
            text += &format!("{number}) exec {} ;;\n", self.command_of(identity));
        }
        text += "esac\n";
        fs::write(&script, text).map_err(at(&script))?;
        let said = said("sbatch", &["--parsable", &script.display().to_string()])?;
        // `NUMBER` or `NUMBER;CLUSTER`.
        let job = said.trim().split(';').next().unwrap_or_default().to_owned();
        if job.is_empty() || !job.bytes().all(|b| b.is_ascii_digit()) {
            return Err(Error::Refused { program: "sbatch".to_owned(), said });
        }
        Ok(job)
    }

    /// Asks which tasks the engine still has, and notes those that it has not.
    fn look(&mut self) {
        let mut queued: BTreeMap<String, bool> = BTreeMap::new();
        for tracked in self.tasks.values_mut() {
            let gone = match &mut tracked.engine {
                Held::Job(job) => !*queued.entry(job.clone()).or_insert_with(|| is_queued(job)),
                Held::Launcher(child) => child.try_wait().is_ok_and(|ended| ended.is_some()),
                Held::No | Held::Gone(_) => false,
            };
            if gone {
                tracked.engine = Held::Gone(Instant::now());
            }
        }
    }

    /// Takes the results of a task into the cache, if it is over.
    fn gather(&self, identity: &str) -> Option<Result<u64, RunError>> {
        let folder = self.folder_of(identity);
        let code = fs::read_to_string(folder.join("exit")).ok()?;
        let elsewhere = |path: &Path, e: io::Error| RunError::Elsewhere(format!("{}: {e}", path.display()));
        let take = || -> Result<u64, RunError> {
            if code.trim() != "0" {
                let log = fs::read_to_string(folder.join("log")).unwrap_or_default();
                let last =
                    log.lines().rev().find(|line| line.starts_with("bolide: ")).unwrap_or("it says nothing");
                return Err(RunError::Elsewhere(format!("exit code {}: {last}", code.trim())));
            }
            let Some(work) = self.cache.begin(identity).map_err(RunError::Cache)? else { return Ok(0) };
            for name in FILES {
                let path = folder.join("results").join(name);
                fs::copy(&path, work.folder().join(name)).map_err(|e| elsewhere(&path, e))?;
            }
            let entry = self.cache.commit(work).map_err(RunError::Cache)?;
            let path = entry.join(FILES[1]);
            let text = fs::read_to_string(&path).map_err(|e| elsewhere(&path, e))?;
            let summary: Summary = serde_json::from_str(&text).map_err(|e| elsewhere(&path, e.into()))?;
            Ok(summary.elements * summary.cycles)
        };
        let result = take();
        // What stays is of no use to anybody; a failed run leaves it to be looked at.
        if result.is_ok() {
            let _ = fs::remove_dir_all(&folder);
        }
        Some(result)
    }
}

impl Place for Batch {
    fn has_room(&self, _: &Task) -> bool {
        self.tasks.len() < self.most
    }

    fn take(&mut self, task: Task, _: usize) -> Result<(), String> {
        let identity = task.prepared.identity.clone();
        let folder = self.folder_of(&identity);
        fs::create_dir_all(&folder).map_err(at(&folder))?;
        // One that failed in an earlier study is tried again.
        if fs::read_to_string(folder.join("exit")).is_ok_and(|code| code.trim() != "0") {
            fs::remove_dir_all(&folder).map_err(at(&folder))?;
            fs::create_dir_all(&folder).map_err(at(&folder))?;
        }
        let deck = folder.join("deck");
        fs::write(&deck, &task.prepared.text).map_err(at(&deck))?;
        // An earlier session of the study may have put it into the queue.
        let job = fs::read_to_string(folder.join("job")).ok().filter(|_| self.engine == Engine::Slurm);
        let engine = job.filter(|job| is_queued(job)).map_or(Held::No, Held::Job);
        self.tasks.insert(identity, Tracked { task, tries: 1, engine });
        Ok(())
    }

    fn wait(&mut self, stop: bool) -> Result<Vec<Finished>, String> {
        if stop {
            // Tasks of Slurm stay in its queue: the study finds them there.
            let stopped = |mut tracked: Tracked| {
                if let Held::Launcher(child) = &mut tracked.engine {
                    // It may have ended by itself.
                    let _ = child.kill();
                    let _ = child.wait();
                }
                Finished { point: tracked.task.point, result: Err(RunError::Stopped) }
            };
            return Ok(std::mem::take(&mut self.tasks).into_values().map(stopped).collect());
        }
        self.begin()?;
        std::thread::sleep(LOOK_EVERY);
        self.look();
        let mut finished = Vec::new();
        for identity in self.tasks.keys().cloned().collect::<Vec<_>>() {
            if let Some(result) = self.gather(&identity) {
                let tracked = self.tasks.remove(&identity);
                finished.extend(tracked.map(|tracked| Finished { point: tracked.task.point, result }));
                continue;
            }
            let Some(tracked) = self.tasks.get_mut(&identity) else { continue };
            if matches!(tracked.engine, Held::Gone(since) if since.elapsed() >= GRACE) {
                tracked.engine = Held::No;
                tracked.tries += 1;
                if tracked.tries > MOST_TRIES {
                    let why = format!(
                        "it ended {MOST_TRIES} times without a result; see {}",
                        self.folder_of(&identity).join("log").display()
                    );
                    let tracked = self.tasks.remove(&identity);
                    let result = Err(RunError::Elsewhere(why));
                    finished.extend(tracked.map(|tracked| Finished { point: tracked.task.point, result }));
                }
            }
        }
        Ok(finished)
    }
}

/// Whether Slurm has a job in its queue. One that it does not know is over.
fn is_queued(job: &str) -> bool {
    said("squeue", &["--noheader", &format!("--jobs={}", job.trim())])
        .is_ok_and(|lines| !lines.trim().is_empty())
}

/// What a program prints.
fn said(program: &str, arguments: &[&str]) -> Result<String, Error> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|source| Error::Start { program: program.to_owned(), source })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(Error::Refused { program: program.to_owned(), said });
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
