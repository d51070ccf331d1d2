//! RETENTION: which jobs that are over are removed, and removing them with their results.

use std::{
    fs, io,
    path::Path,
    time::{Duration, Instant, SystemTime},
};

use protocol::request::State;
use tracing::{info, warn};

use super::Scheduler;
use crate::{notice::Error, queue::Entry, results};

/// Between two looks at what jobs that are over take.
const LOOK_EVERY: Duration = Duration::from_secs(10);

/// How long and how much is kept of jobs that are over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Older ones are removed.
    pub age: Option<Duration>,
    /// The oldest are removed until all take no more than this (bytes).
    pub bytes: Option<u64>,
}

impl Limits {
    /// Whether everything is kept.
    pub const fn are_none(&self) -> bool {
        self.age.is_none() && self.bytes.is_none()
    }
}

/// What a job that is over takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kept {
    job: u32,
    /// Since its end.
    age: Duration,
    /// Of its results and snapshots.
    bytes: u64,
}

/// The jobs that are removed, the oldest first. For room the one that ended last is not: its user has hardly seen it.
fn expired(kept: &[Kept], limits: &Limits) -> Vec<u32> {
    let mut oldest_first = kept.to_vec();
    oldest_first.sort_by_key(|kept| std::cmp::Reverse((kept.age, std::cmp::Reverse(kept.job))));
    let last = oldest_first.last().map(|kept| kept.job);
    let mut left: u64 = kept.iter().map(|kept| kept.bytes).sum();
    let mut expired = Vec::new();
    for Kept { job, age, bytes } in oldest_first {
        let old = limits.age.is_some_and(|most| age > most);
        let large = Some(job) != last && limits.bytes.is_some_and(|most| left > most);
        if old || large {
            left -= bytes;
            expired.push(job);
        }
    }
    expired
}

/// How long ago a file was written; nothing if that is not known, or the clock has been set back since.
fn age_of(path: &Path) -> Duration {
    let written = fs::metadata(path).and_then(|meta| meta.modified());
    written.ok().and_then(|at| SystemTime::now().duration_since(at).ok()).unwrap_or_default()
}

/// Bytes of the files of a folder; a folder that is not there has none.
fn bytes_of(folder: &Path) -> u64 {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let files = entries.filter_map(Result::ok).filter_map(|entry| entry.metadata().ok());
    files.filter(fs::Metadata::is_file).map(|meta| meta.len()).sum()
}

/// Removes the results of a run, and its folder unless something else is in there.
///
/// # Errors
/// What the disk refused.
fn remove_results(folder: &Path) -> Result<(), results::Error> {
    if folder.is_symlink() || !folder.is_dir() {
        return Ok(());
    }
    drop(results::Folder::create(folder, true)?);
    // Where the lock is a file, it stays.
    let _ = fs::remove_file(folder.join(results::LOCK));
    match fs::remove_dir(folder) {
        // Somebody's files stay.
        Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => Ok(()),
        other => {
            other.map_err(|source| results::Error::Io { action: "remove", path: folder.to_owned(), source })
        }
    }
}

impl Scheduler {
    /// Removes a job that is over with all that it left.
    pub(super) fn remove(&mut self, job: u32) -> Result<(), Error> {
        let entry = self.queue.remove(job)?;
        let removed = tokio::task::block_in_place(|| match &entry.folder {
            Some(folder) => remove_results(folder),
            None => Ok(()),
        });
        if let Err(error) = removed {
            self.queue.restore(entry);
            return Err(Error::Results(error));
        }
        tokio::task::block_in_place(|| self.spool.forget(job));
        self.status.remove(&job);
        Ok(())
    }

    /// Removes what is older or more than is kept.
    pub(super) fn remove_expired(&mut self) {
        if self.limits.are_none() || self.looked.is_some_and(|at| at.elapsed() < LOOK_EVERY) {
            return;
        }
        self.looked = Some(Instant::now());
        let kept = |entry: &Entry| Kept {
            job: entry.id,
            age: age_of(&self.spool.record(entry.id)),
            bytes: entry.folder.as_deref().map(bytes_of).unwrap_or_default()
                + bytes_of(&self.spool.snapshots(entry.id)),
        };
        // A held job waits for its user.
        let over = self.queue.over().filter(|entry| entry.state != State::Held);
        let kept: Vec<Kept> = tokio::task::block_in_place(|| over.map(kept).collect());
        for job in expired(&kept, &self.limits) {
            match self.remove(job) {
                Ok(()) => info!(job, "removed: no more is kept (--keep-days, --keep-gb)"),
                Err(error) => warn!(job, "not removed: {error}"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(job: u32, days: u64, bytes: u64) -> Kept {
        Kept { job, age: Duration::from_secs(days * 86_400), bytes }
    }

    #[test]
    fn the_oldest_go_until_what_is_left_is_young_and_small_enough() {
        let all = [kept(1, 9, 50), kept(2, 5, 10), kept(3, 5, 20), kept(4, 0, 90)];
        let days = |days: u64| Some(Duration::from_secs(days * 86_400));
        assert!(expired(&all, &Limits::default()).is_empty());
        assert_eq!(expired(&all, &Limits { age: days(5), bytes: None }), [1]);
        assert_eq!(expired(&all, &Limits { age: None, bytes: Some(115) }), [1, 2]);
        assert_eq!(expired(&all, &Limits { age: days(1), bytes: Some(100) }), [1, 2, 3]);
        assert_eq!(
            expired(&all, &Limits { age: None, bytes: Some(0) }),
            [1, 2, 3],
            "what has just ended stays"
        );
        assert!(expired(&all[3..], &Limits { age: days(0), bytes: Some(0) }).is_empty(), "it has no age yet");
    }

    #[test]
    fn files_that_no_run_wrote_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let (clean, shared) = (folder.path().join("job-1"), folder.path().join("job-2"));
        for path in [&clean, &shared] {
            fs::create_dir(path).expect("room");
            fs::write(path.join("state-000000.vtu"), "12345").expect("room");
        }
        fs::write(shared.join("thesis.txt"), "mine").expect("room");
        assert_eq!(bytes_of(&clean), 5);
        remove_results(&clean).expect("ours");
        remove_results(&shared).expect("ours");
        remove_results(&folder.path().join("job-3")).expect("nothing to do");
        assert!(!clean.exists() && shared.join("thesis.txt").is_file());
        assert!(!shared.join("state-000000.vtu").exists());
    }
}
