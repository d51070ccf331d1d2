//! SPOOL: the master's jobs on disk, so that a restarted master has them all.
//!
//! ```text
//! SPOOL/lock                      held by the master that uses the folder
//! SPOOL/job-7/                    results of job 7
//! SPOOL/queue/job-7.json          its record: state, options, how it ended
//! SPOOL/queue/job-7.toml          its deck, until it is done or cancelled
//! SPOOL/queue/job-7.snapshots/    where it can be gone on with, until then
//! ```
//!
//! A record is replaced whole and synchronised at every change of state, before anybody is told of the change. A job that a
//! record calls running, with no master to run it, was interrupted: it is the first to go on.

use std::{
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
};

use protocol::{
    options::JobOptions,
    request::{Ended, State},
};
use serde::{Deserialize, Serialize};

use crate::snapshot::store::{self, write_durably};

/// Longest record (bytes): a summary lists every worker.
const RECORD_LIMIT: u64 = 64 << 20;

/// What is on disk of a job beside its deck.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its number.
    pub job: u32,
    /// Name of the deck's file.
    pub name: String,
    /// Title of the deck.
    pub title: String,
    /// Where it stands.
    pub state: State,
    /// What is asked beside the deck.
    pub options: JobOptions,
    /// Names of the workers that it was last started with.
    #[serde(rename = "crew")]
    pub at_work: Vec<String>,
    /// Cycles completed, where it is over.
    pub cycle: u64,
    /// Time reached (deck's unit), where it is over.
    pub time: f64,
    pub ended: Option<Ended>,
}

/// The folder of a master.
#[derive(Debug)]
pub struct Spool {
    folder: PathBuf,
    /// Held as long as this value.
    _lock: File,
}

/// What an earlier master left.
#[derive(Debug, Default)]
pub struct Left {
    /// Records, with the decks of jobs that are not over, by number.
    pub jobs: Vec<(Record, String)>,
    /// The first number that no job has.
    pub first: u32,
    /// Sentences on records that cannot be read.
    pub warnings: Vec<String>,
}

impl Spool {
    /// Takes a folder, and reads what an earlier master left there.
    ///
    /// # Errors
    /// If it cannot be created, read or locked, or another master has it.
    pub fn open(folder: &Path) -> Result<(Self, Left), String> {
        let fault = |e: io::Error| format!("spool folder {}: {e}", folder.display());
        let queue = folder.join("queue");
        fs::create_dir_all(&queue).map_err(fault)?;
        let lock = File::create(folder.join("lock")).map_err(fault)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(format!(
                    "spool folder {}: another master uses it; name another with --spool",
                    folder.display()
                ));
            }
            Err(TryLockError::Error(error)) => return Err(fault(error)),
        }
        let spool = Self { folder: folder.to_owned(), _lock: lock };
        let mut left = Left { first: 1, ..Left::default() };
        for folder in [folder, &queue] {
            for entry in fs::read_dir(folder).map_err(fault)? {
                let name = entry.map_err(fault)?.file_name();
                let digits = name.to_str().and_then(|name| name.strip_prefix("job-"));
                let digits = digits.map(|rest| rest.split('.').next().unwrap_or(rest));
                let Some(number) = digits.and_then(|digits| digits.parse::<u32>().ok()) else { continue };
                left.first = left.first.max(number.saturating_add(1));
                if name.to_str().is_some_and(|name| name.ends_with(".json")) {
                    match spool.read(number) {
                        Ok(job) => left.jobs.push(job),
                        Err(why) => left.warnings.push(format!("{why}; the job is left out")),
                    }
                }
            }
        }
        left.jobs.sort_by_key(|(record, _)| record.job);
        Ok((spool, left))
    }

    fn read(&self, job: u32) -> Result<(Record, String), String> {
        let path = self.record(job);
        let fault = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let length = fs::metadata(&path).map_err(|e| fault(&e))?.len();
        if length > RECORD_LIMIT {
            return Err(fault(&format_args!("{length} bytes, at most {RECORD_LIMIT}")));
        }
        let bytes = fs::read(&path).map_err(|e| fault(&e))?;
        let record: Record = serde_json::from_slice(&bytes).map_err(|e| fault(&e))?;
        if record.job != job {
            return Err(fault(&format_args!("it is of job {}", record.job)));
        }
        let text = match record.ended {
            Some(_) => String::new(),
            None => self.text(job)?,
        };
        Ok((record, text))
    }

    /// The deck of a job that is not done or cancelled.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn text(&self, job: u32) -> Result<String, String> {
        let path = self.deck(job);
        fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Where results of a job go.
    pub fn results(&self, job: u32) -> PathBuf {
        self.folder.join(format!("job-{job}"))
    }

    /// Where a job is stored while it runs.
    pub fn snapshots(&self, job: u32) -> PathBuf {
        self.queue(job, "snapshots")
    }

    fn record(&self, job: u32) -> PathBuf {
        self.queue(job, "json")
    }

    fn deck(&self, job: u32) -> PathBuf {
        self.queue(job, "toml")
    }

    fn queue(&self, job: u32, ending: &str) -> PathBuf {
        self.folder.join("queue").join(format!("job-{job}.{ending}"))
    }

    /// Puts a new job on disk.
    ///
    /// # Errors
    /// What the disk refused; the job is then not there.
    pub fn add(&self, record: &Record, text: &str) -> Result<(), String> {
        let path = self.deck(record.job);
        let written = write_durably(&path, text.as_bytes()).map_err(|e| format!("{}: {e}", path.display()));
        written.and_then(|()| self.change(record)).inspect_err(|_| self.forget(record.job))
    }

    /// Replaces the record of a job; of one that nobody can go on with, deck and snapshots go after that.
    ///
    /// # Errors
    /// What the disk refused; the former record then stays.
    pub fn change(&self, record: &Record) -> Result<(), String> {
        let path = self.record(record.job);
        let text = serde_json::to_string_pretty(record).map_err(|e| e.to_string())?;
        write_durably(&path, text.as_bytes()).map_err(|e| format!("{}: {e}", path.display()))?;
        if matches!(record.state, State::Done | State::Cancelled) {
            // What cannot be removed takes room and harms nobody.
            let _ = fs::remove_file(self.deck(record.job));
            let _ = store::remove(&self.snapshots(record.job));
        }
        Ok(())
    }

    /// Removes all of a job but its results.
    pub fn forget(&self, job: u32) {
        // As above.
        let _ = fs::remove_file(self.record(job));
        let _ = fs::remove_file(self.deck(job));
        let _ = store::remove(&self.snapshots(job));
    }
}
