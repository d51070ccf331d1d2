//! SPOOL: the master's jobs on disk, so that a restarted master has them all.
//!
//! ```text
//! SPOOL/                          locked by the master that uses it
//! SPOOL/job-7/                    results of job 7
//! SPOOL/queue/job-7.json          its record: state, options, how it ended
//! SPOOL/queue/job-7.json.copy     the same, for when the record is damaged
//! SPOOL/queue/job-7.toml          its deck, until it is done or cancelled; and a copy of it
//! SPOOL/queue/job-7.snapshots/    where it can be gone on with, until then
//! SPOOL/queue/last                the highest number of a job that was removed: it is not given again
//! ```
//!
//! A record is replaced whole and synchronised at every change of state, before anybody is told of the change. A job that a
//! record calls running, with no master to run it, was interrupted: it is the first to go on.
//!
//! A record stands behind its checksum and names that of its deck. A damaged record or deck is read from its copy and mended; a job whose
//! deck is damaged twice fails with that reason instead of computing another problem.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use protocol::{
    options::JobOptions,
    request::{Ended, State},
};
use serde::{Deserialize, Serialize};
use tracing::warn;

use crate::{
    queue::{Starts, sum_of},
    snapshot::store::{self, write_durably},
};

/// Longest record (bytes): a summary lists every worker.
const RECORD_LIMIT: u64 = 64 << 20;

/// What is on disk of a job beside its deck.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    /// BLAKE3 of the deck, hexadecimal; empty where an earlier release queued the job.
    #[serde(default)]
    pub deck_sum: String,
    #[serde(default)]
    pub starts: Starts,
    /// A user has taken it back, which it has still to come to.
    #[serde(default)]
    pub cancelled: bool,
    /// A user keeps it back, which it has still to come to. Not written where it is false, so that the checksums of older records hold.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub held: bool,
    /// Of its mesh; 0 where an earlier release queued the job.
    #[serde(default)]
    pub elements: u64,
    /// To its end, as it was expected; 0 where an earlier release queued the job.
    #[serde(default)]
    pub cycles: u64,
    /// Who submitted it, by certificate; empty without one.
    #[serde(default)]
    pub owner: String,
}

/// A record as it stands on disk.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sealed {
    /// BLAKE3 of the record as compact JSON, hexadecimal.
    sum: String,
    record: Record,
}

/// What is wrong with a file of the spool.
#[derive(Debug)]
pub enum Fault {
    /// It cannot be read.
    Io(PathBuf, io::Error),
    /// It is longer than any such file.
    Long(PathBuf, u64),
    /// It is no record.
    Form(PathBuf, serde_json::Error),
    /// Its bytes do not match their checksum.
    Sum { path: PathBuf, stated: String, computed: String },
    /// It is the record of another job.
    Job(PathBuf, u32),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Io(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Long(path, length) => {
                write!(f, "{}: {length} bytes, at most {RECORD_LIMIT}", path.display())
            }
            Self::Form(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Sum { path, stated, computed } => {
                write!(f, "{}: damaged: its checksum is {stated}, its bytes give {computed}", path.display())
            }
            Self::Job(path, job) => write!(f, "{}: it is of job {job}", path.display()),
        }
    }
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
        // An earlier release left it open to all.
        system::private::close(&queue).map_err(fault)?;
        let lock = system::folders::lock(folder).map_err(fault)?.ok_or_else(|| {
            format!("spool folder {}: another master uses it; name another with --spool", folder.display())
        })?;
        let spool = Self { folder: folder.to_owned(), _lock: lock };
        let mut left = Left { first: spool.last_removed().saturating_add(1), ..Left::default() };
        let mut records = BTreeSet::new();
        for folder in [folder, &queue] {
            for entry in fs::read_dir(folder).map_err(fault)? {
                let name = entry.map_err(fault)?.file_name();
                let digits = name.to_str().and_then(|name| name.strip_prefix("job-"));
                let digits = digits.map(|rest| rest.split('.').next().unwrap_or(rest));
                let Some(number) = digits.and_then(|digits| digits.parse::<u32>().ok()) else { continue };
                left.first = left.first.max(number.saturating_add(1));
                if name.to_str().is_some_and(|name| name.ends_with(".json") || name.ends_with(".json.copy")) {
                    records.insert(number);
                }
            }
        }
        for number in records {
            spool.scrub(number, &mut left);
        }
        Ok((spool, left))
    }

    /// Reads a job, mends what has a copy and says what was damaged.
    fn scrub(&self, job: u32, left: &mut Left) {
        let mut record = match read_record(&self.record(job), job) {
            Ok(record) => {
                self.mend_copy(job, &record, left);
                record
            }
            Err(damage) => match read_record(&self.copy(job), job) {
                Ok(record) => {
                    left.warnings.push(format!("{damage}; its copy is used"));
                    if let Err(why) = fs::copy(self.copy(job), self.record(job)) {
                        left.warnings.push(format!("{}: not mended: {why}", self.record(job).display()));
                    }
                    record
                }
                Err(copy) => return left.warnings.push(format!("{damage}; {copy}; the job is left out")),
            },
        };
        let text = match record.ended {
            Some(_) => String::new(),
            None => self.text_or_copy(job, &record.deck_sum, left).unwrap_or_else(|damage| {
                let failure = Some(format!("{damage}; submit the job again"));
                left.warnings.push(format!("{damage}; job {job} fails"));
                record.state = State::Failed;
                record.ended = Some(Ended { failure, ..Ended::default() });
                String::new()
            }),
        };
        left.jobs.push((record, text));
    }

    /// Makes a copy of a record that is not the same anew: for as long as it is damaged, the record must not be.
    fn mend_copy(&self, job: u32, record: &Record, left: &mut Left) {
        let damage = match read_record(&self.copy(job), job) {
            Ok(copy) if copy == *record => return,
            // The master ended between the two.
            Ok(_) => None,
            Err(damage) => Some(damage),
        };
        let mended = fs::read(self.record(job)).and_then(|bytes| write_durably(&self.copy(job), &bytes));
        let what = if mended.is_ok() { "it is made anew" } else { "it is not mended" };
        left.warnings.extend(damage.map(|damage| format!("{damage}; {what}")));
    }

    /// The deck of a job that is not done or cancelled, which has this checksum; an empty one matches all.
    ///
    /// # Errors
    /// If it cannot be read or is another.
    pub fn text(&self, job: u32, stated: &str) -> Result<String, Fault> {
        read_deck(self.deck(job), stated).or_else(|damage| {
            let text = read_deck(self.deck_copy(job), stated).map_err(|_| damage)?;
            // What cannot be mended is read from its copy again.
            let _ = write_durably(&self.deck(job), text.as_bytes());
            Ok(text)
        })
    }

    /// [`Spool::text`], which says what was damaged.
    fn text_or_copy(&self, job: u32, stated: &str, left: &mut Left) -> Result<String, Fault> {
        let damage = read_deck(self.deck(job), stated).err();
        let text = self.text(job, stated);
        match (damage, &text) {
            (Some(damage), Ok(_)) => left.warnings.push(format!("{damage}; its copy is used")),
            (None, Ok(text)) => {
                if let Err(damage) = read_deck(self.deck_copy(job), stated) {
                    let mended = write_durably(&self.deck_copy(job), text.as_bytes());
                    let what = if mended.is_ok() { "it is made anew" } else { "it is not mended" };
                    left.warnings.push(format!("{damage}; {what}"));
                }
            }
            _ => {}
        }
        text
    }

    fn deck_copy(&self, job: u32) -> PathBuf {
        self.queue(job, "toml.copy")
    }

    /// Where results of a job go.
    pub fn results(&self, job: u32) -> PathBuf {
        self.folder.join(format!("job-{job}"))
    }

    /// Where a job is stored while it runs.
    pub fn snapshots(&self, job: u32) -> PathBuf {
        self.queue(job, "snapshots")
    }

    /// The file that is written anew whenever a job changes.
    pub fn record(&self, job: u32) -> PathBuf {
        self.queue(job, "json")
    }

    fn copy(&self, job: u32) -> PathBuf {
        self.queue(job, "json.copy")
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
    pub fn add(&self, record: &Record, text: &str) -> Result<(), Fault> {
        let path = self.deck(record.job);
        let written = [&path, &self.deck_copy(record.job)].into_iter().try_for_each(|path| {
            write_durably(path, text.as_bytes()).map_err(|e| Fault::Io(path.clone(), e))
        });
        written.and_then(|()| self.change(record)).inspect_err(|_| self.forget(record.job))
    }

    /// Replaces the record of a job; of one that nobody can go on with, deck and snapshots go after that.
    ///
    /// # Errors
    /// What the disk refused; the former record then stays.
    pub fn change(&self, record: &Record) -> Result<(), Fault> {
        let form = |e| Fault::Form(self.record(record.job), e);
        let sum = sum_of(&serde_json::to_string(record).map_err(form)?);
        let sealed = Sealed { sum, record: record.clone() };
        let text = serde_json::to_string_pretty(&sealed).map_err(form)?;
        for path in [self.record(record.job), self.copy(record.job)] {
            write_durably(&path, text.as_bytes()).map_err(|e| Fault::Io(path.clone(), e))?;
        }
        if matches!(record.state, State::Done | State::Cancelled) {
            // What cannot be removed takes room and harms nobody.
            let _ = fs::remove_file(self.deck(record.job));
            let _ = fs::remove_file(self.deck_copy(record.job));
            let _ = store::remove(&self.snapshots(record.job));
        }
        Ok(())
    }

    /// The highest number of a job that was removed; 0 if none was.
    fn last_removed(&self) -> u32 {
        let text = fs::read_to_string(self.last()).unwrap_or_default();
        text.trim().parse().unwrap_or_default()
    }

    fn last(&self) -> PathBuf {
        self.folder.join("queue/last")
    }

    /// Removes all of a job but its results.
    pub fn forget(&self, job: u32) {
        if job > self.last_removed()
            && let Err(error) = write_durably(&self.last(), format!("{job}\n").as_bytes())
        {
            warn!(job, "{}: {error}; the next master may give its number again", self.last().display());
        }
        // As above.
        let _ = fs::remove_file(self.record(job));
        let _ = fs::remove_file(self.copy(job));
        let _ = fs::remove_file(self.deck(job));
        let _ = fs::remove_file(self.deck_copy(job));
        let _ = store::remove(&self.snapshots(job));
    }
}

fn read_deck(path: PathBuf, stated: &str) -> Result<String, Fault> {
    let text = fs::read_to_string(&path).map_err(|e| Fault::Io(path.clone(), e))?;
    let computed = sum_of(&text);
    if stated.is_empty() || stated == computed {
        return Ok(text);
    }
    Err(Fault::Sum { path, stated: stated.to_owned(), computed })
}

/// Reads the record of a job; one of an earlier release has no checksum.
fn read_record(path: &Path, job: u32) -> Result<Record, Fault> {
    let io = |e| Fault::Io(path.to_owned(), e);
    let form = |e| Fault::Form(path.to_owned(), e);
    let length = fs::metadata(path).map_err(io)?.len();
    if length > RECORD_LIMIT {
        return Err(Fault::Long(path.to_owned(), length));
    }
    let bytes = fs::read(path).map_err(io)?;
    let record = match serde_json::from_slice::<Record>(&bytes) {
        Ok(record) => record,
        Err(_) => {
            let Sealed { sum: stated, record } = serde_json::from_slice(&bytes).map_err(form)?;
            let computed = sum_of(&serde_json::to_string(&record).map_err(form)?);
            if stated != computed {
                return Err(Fault::Sum { path: path.to_owned(), stated, computed });
            }
            record
        }
    };
    if record.job == job { Ok(record) } else { Err(Fault::Job(path.to_owned(), record.job)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(job: u32) -> Record {
        Record {
            job,
            name: "deck.toml".into(),
            title: "plates".into(),
            state: State::Running,
            options: JobOptions::default(),
            at_work: vec!["a".into(), "b".into()],
            cycle: 12,
            time: 0.1 + 0.2,
            ended: None,
            deck_sum: sum_of("a deck"),
            starts: Starts { count: 1, snapshot: 3 },
            cancelled: false,
            held: false,
            elements: 8,
            cycles: 40,
            owner: "anna".to_owned(),
        }
    }

    #[test]
    fn a_flipped_bit_anywhere_in_a_record_is_mended_from_its_copy() {
        let folder = tempfile::tempdir().expect("a folder");
        let (spool, _) = Spool::open(folder.path()).expect("new");
        spool.add(&record(7), "a deck").expect("room");
        let path = spool.record(7);
        drop(spool);
        let whole = fs::read(&path).expect("written");
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 1 << (at % 8);
            fs::write(&path, damaged).expect("room");
            let (_, left) = Spool::open(folder.path()).expect("readable");
            assert_eq!(left.jobs, [(record(7), "a deck".to_owned())], "byte {at}: {:?}", left.warnings);
            // A digit past those that a number keeps changes nothing.
            let mended = fs::read(&path).ok().as_ref() == Some(&whole);
            assert!(mended || left.warnings.is_empty(), "byte {at}: {:?}", left.warnings);
        }
        fs::remove_file(&path).expect("it is there");
        let (_, left) = Spool::open(folder.path()).expect("readable");
        assert_eq!((left.jobs.len(), left.warnings.len()), (1, 1), "{:?}", left.warnings);
    }

    #[test]
    fn a_damaged_copy_is_made_anew_before_the_file_itself_is_damaged_too() {
        let folder = tempfile::tempdir().expect("a folder");
        let (spool, _) = Spool::open(folder.path()).expect("new");
        spool.add(&record(7), "a deck").expect("room");
        for path in [spool.copy(7), spool.deck_copy(7)] {
            let whole = fs::read(&path).expect("written");
            let mut damaged = whole.clone();
            damaged[3] ^= 1;
            fs::write(&path, damaged).expect("room");
            let mut left = Left::default();
            spool.scrub(7, &mut left);
            assert!(left.jobs.len() == 1 && left.warnings.len() == 1, "{left:?}");
            assert!(left.warnings[0].ends_with("it is made anew"), "{left:?}");
            assert_eq!(fs::read(&path).ok(), Some(whole));
        }
    }

    #[test]
    fn the_number_of_a_job_that_was_removed_is_not_given_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let (spool, left) = Spool::open(folder.path()).expect("new");
        assert_eq!(left.first, 1);
        for job in [7, 8] {
            spool.add(&record(job), "a deck").expect("room");
        }
        spool.forget(8);
        spool.forget(7);
        drop(spool);
        let (_, left) = Spool::open(folder.path()).expect("readable");
        assert_eq!((left.first, left.jobs.len()), (9, 0));
    }

    #[test]
    fn a_spool_has_one_master_whatever_is_removed_from_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let (_spool, _) = Spool::open(folder.path()).expect("new");
        let _ = fs::remove_file(folder.path().join("lock"));
        let second = Spool::open(folder.path()).expect_err("one has it");
        assert!(second.contains("another master uses it"), "{second}");
    }

    #[test]
    fn a_job_whose_deck_is_damaged_twice_fails_with_the_reason_and_the_others_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let (spool, _) = Spool::open(folder.path()).expect("new");
        spool.add(&record(7), "a deck").expect("room");
        spool.add(&record(8), "a deck").expect("room");
        fs::write(spool.deck(7), "a dock").expect("room");
        assert_eq!(spool.text(7, &sum_of("a deck")).ok().as_deref(), Some("a deck"), "its copy is used");
        assert_eq!(fs::read_to_string(spool.deck(7)).ok().as_deref(), Some("a deck"), "it is mended");
        fs::write(spool.deck(7), "a dock").expect("room");
        fs::write(spool.deck_copy(7), "a duck").expect("room");
        assert!(spool.text(7, &sum_of("a deck")).is_err());
        drop(spool);
        let (_, left) = Spool::open(folder.path()).expect("readable");
        let states: Vec<_> = left.jobs.iter().map(|(record, _)| (record.job, record.state)).collect();
        assert_eq!(states, [(7, State::Failed), (8, State::Running)]);
        let failure = left.jobs[0].0.ended.as_ref().and_then(|ended| ended.failure.clone());
        assert!(failure.is_some_and(|why| why.contains("job-7.toml: damaged")), "{:?}", left.warnings);
    }
}
