//! Results of earlier runs, by the identity of what was computed.
//!
//! The identity of a run is the BLAKE3 sum of its model as read (mesh, materials, conditions, end, and what the history holds), of the release,
//! and of the proof of its arithmetic ([`mechanics::proof`]). A run has equal bits on all machines, so its results answer for it wherever it is asked for
//! again. What an entry holds is checked by its checksums each time; a damaged one is computed anew.
//!
//! ```text
//! CACHE/<identity>/history.csv, summary.json    the results
//! CACHE/<identity>/sums.json                    their checksums, written last
//! CACHE/<identity>.part/                        a run under way, with its checkpoints
//! CACHE/locks/<identity>                        locked by whoever computes it
//! ```

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::SystemTime,
};

use deck::Model;
use mechanics::{lanes::Width, proof};
use serde::{Deserialize, Serialize};
use tracing::warn;

use crate::results::{HISTORY, SUMMARY, write_whole};

/// Files that an entry holds.
pub const FILES: [&str; 2] = [HISTORY, SUMMARY];
const SUMS: &str = "sums.json";
const PART: &str = ".part";
/// Digits of an identity in names.
const DIGITS: usize = 32;

/// Why results could not be kept.
#[derive(Debug)]
pub enum Error {
    /// The system refused.
    Io { path: PathBuf, source: io::Error },
    /// A run left no file of this name.
    Missing(PathBuf),
    /// A model has no identity.
    Identity(protocol::Error),
    /// What was written could not be made whole.
    Results(crate::results::Error),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, source } => write!(f, "{}: {source}", path.display()),
            Self::Missing(path) => write!(f, "{}: the run left no such file", path.display()),
            Self::Identity(why) => write!(f, "identity of a run: {why}"),
            Self::Results(why) => why.fmt(f),
        }
    }
}

impl std::error::Error for Error {}

fn at<'a>(path: &'a Path) -> impl FnOnce(io::Error) -> Error + 'a {
    move |source| Error::Io { path: path.to_owned(), source }
}

/// The identity of a run of a model, in hexadecimal digits. What is written beside the history does not belong to it.
///
/// # Errors
/// If the model cannot be encoded.
pub fn identity_of(model: &Model) -> Result<String, Error> {
    let output = deck::model::Output {
        history_cycles: model.output.history_cycles,
        contact_forces: model.output.contact_forces.clone(),
        sections: model.output.sections.clone(),
        gauges: model.output.gauges.clone(),
        element_gauges: model.output.element_gauges.clone(),
        ..deck::model::Output::default()
    };
    let release = (env!("CARGO_PKG_VERSION"), physics());
    let mut hasher = blake3::Hasher::new();
    protocol::codec::encode_into(&(release, model.without_setup(), &model.setup, output), &mut hasher)
        .map_err(Error::Identity)?;
    Ok(hasher.finalize().to_hex()[..DIGITS].to_owned())
}

/// What the laws of this build come to, the same on every machine.
fn physics() -> &'static str {
    static DIGEST: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    DIGEST.get_or_init(|| proof::digest(Width::Scalar))
}

/// A folder of results.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    /// Most bytes of all entries.
    most: u64,
    /// Entries that this process has used, which are removed last.
    used: Mutex<BTreeSet<String>>,
}

/// What `sums.json` holds.
#[derive(Serialize, Deserialize)]
struct Sums {
    identity: String,
    /// BLAKE3 of each file, in hexadecimal digits.
    files: BTreeMap<String, String>,
}

/// A run that this process alone computes.
#[derive(Debug)]
pub struct Work {
    folder: PathBuf,
    identity: String,
    /// Held as long as this value.
    _lock: File,
}

impl Work {
    /// Where the run writes.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Cache {
    /// Takes a folder, which need not exist, for at most so many bytes of results.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn open(folder: &Path, most: u64) -> Result<Self, Error> {
        let locks = folder.join("locks");
        fs::create_dir_all(&locks).map_err(at(&locks))?;
        Ok(Self { folder: folder.to_owned(), most, used: Mutex::default() })
    }

    /// The entry of an identity, if it is there and whole.
    pub fn look(&self, identity: &str) -> Option<PathBuf> {
        let entry = self.folder.join(identity);
        match check(&entry, identity) {
            Ok(true) => {
                // Whatever was used last is removed last; where the time cannot be set it is removed a little too early.
                if let Ok(file) = File::open(entry.join(SUMS)) {
                    let _ = file.set_modified(SystemTime::now());
                }
                self.used.lock().unwrap_or_else(PoisonError::into_inner).insert(identity.to_owned());
                Some(entry)
            }
            Ok(false) => None,
            Err(why) => {
                warn!("{}: {why}; it is computed anew", entry.display());
                // What stays is replaced by what is computed.
                let _ = fs::remove_dir_all(&entry);
                None
            }
        }
    }

    /// Takes an identity to compute, after whoever else computes it; nothing if that gave its results.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn begin(&self, identity: &str) -> Result<Option<Work>, Error> {
        let path = self.folder.join("locks").join(identity);
        let lock = File::create(&path).map_err(at(&path))?;
        lock.lock().map_err(at(&path))?;
        if self.look(identity).is_some() {
            return Ok(None);
        }
        let folder = self.folder.join(format!("{identity}{PART}"));
        fs::create_dir_all(&folder).map_err(at(&folder))?;
        Ok(Some(Work { folder, identity: identity.to_owned(), _lock: lock }))
    }

    /// Makes the results of a run an entry, and removes what else it left.
    ///
    /// # Errors
    /// If a file is missing or the disk refuses.
    pub fn commit(&self, work: Work) -> Result<PathBuf, Error> {
        let mut files = BTreeMap::new();
        for name in FILES {
            let path = work.folder.join(name);
            if !path.is_file() {
                return Err(Error::Missing(path));
            }
            files.insert(name.to_owned(), sum_of(&path).map_err(at(&path))?);
        }
        for file in fs::read_dir(&work.folder).map_err(at(&work.folder))? {
            let file = file.map_err(at(&work.folder))?;
            if !FILES.iter().any(|name| file.file_name() == *name) {
                let path = file.path();
                let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
                removed.map_err(at(&path))?;
            }
        }
        let sums = Sums { identity: work.identity.clone(), files };
        let written = write_whole(&work.folder.join(SUMS), |out| {
            serde_json::to_writer_pretty(out, &sums).map_err(io::Error::from)
        });
        written.map_err(Error::Results)?;
        let entry = self.folder.join(&work.identity);
        if entry.exists() {
            fs::remove_dir_all(&entry).map_err(at(&entry))?;
        }
        fs::rename(&work.folder, &entry).map_err(at(&entry))?;
        self.used.lock().unwrap_or_else(PoisonError::into_inner).insert(work.identity.clone());
        drop(work);
        self.shrink();
        Ok(entry)
    }

    /// Removes the entries that were not used for the longest time until the rest is small enough; runs that nobody computes any more count as
    /// such. Those that this process has used go last.
    fn shrink(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        let mut found: Vec<(bool, SystemTime, u64, PathBuf)> = entries
            .flatten()
            .filter_map(|entry| {
                let path = entry.path();
                let name = entry.file_name().into_string().ok()?;
                let (name, dated) = match name.strip_suffix(PART) {
                    Some(identity) if self.is_left(identity) => (identity.to_owned(), path.clone()),
                    Some(_) => return None,
                    None => (name, path.join(SUMS)),
                };
                let time =
                    fs::metadata(dated).and_then(|m| m.modified()).ok().filter(|_| is_identity(&name))?;
                Some((used.contains(&name), time, bytes_in(&path), path))
            })
            .collect();
        found.sort();
        let mut all: u64 = found.iter().map(|(_, _, bytes, _)| bytes).sum();
        for (_, _, bytes, path) in found {
            if all <= self.most {
                return;
            }
            // One that cannot be removed is tried again next time.
            if fs::remove_dir_all(&path).is_ok() {
                all -= bytes;
            }
        }
    }

    /// Whether nobody computes the run of an identity.
    fn is_left(&self, identity: &str) -> bool {
        File::open(self.folder.join("locks").join(identity)).is_ok_and(|lock| lock.try_lock().is_ok())
    }
}

fn is_identity(name: &str) -> bool {
    name.len() == DIGITS && name.bytes().all(|b| b.is_ascii_hexdigit())
}

fn bytes_in(folder: &Path) -> u64 {
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let bytes = |file: fs::DirEntry| match file.metadata() {
        Ok(metadata) if metadata.is_dir() => bytes_in(&file.path()),
        metadata => metadata.map_or(0, |metadata| metadata.len()),
    };
    files.map(bytes).sum()
}

fn sum_of(path: &Path) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// Whether an entry is there; an error in words if it is not what was written.
fn check(entry: &Path, identity: &str) -> Result<bool, String> {
    let text = match fs::read_to_string(entry.join(SUMS)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        text => text.map_err(|e| format!("{SUMS}: {e}"))?,
    };
    let sums: Sums = serde_json::from_str(&text).map_err(|e| format!("{SUMS}: {e}"))?;
    if sums.identity != identity {
        return Err(format!("it holds the results of {}", sums.identity));
    }
    for name in FILES {
        let computed = sum_of(&entry.join(name)).map_err(|e| format!("{name}: {e}"))?;
        if sums.files.get(name) != Some(&computed) {
            return Err(format!("{name} does not match its checksum"));
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(cache: &Cache, identity: &str, bytes: usize) {
        let work = cache.begin(identity).expect("a disk").expect("not there");
        fs::write(work.folder().join(HISTORY), "x".repeat(bytes)).expect("room");
        fs::write(work.folder().join(SUMMARY), "{}").expect("room");
        fs::create_dir(work.folder().join("snapshots")).expect("room");
        cache.commit(work).expect("whole");
    }

    fn name(digit: char) -> String {
        digit.to_string().repeat(DIGITS)
    }

    #[test]
    fn an_entry_is_answered_only_if_every_byte_is_what_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = Cache::open(folder.path(), u64::MAX).expect("a folder");
        assert!(cache.look(&name('a')).is_none());
        fill(&cache, &name('a'), 100);
        let entry = cache.look(&name('a')).expect("it was committed");
        assert!(!entry.join("snapshots").exists());
        assert!(cache.begin(&name('a')).expect("a disk").is_none(), "there is nothing to compute");
        let mut bytes = fs::read(entry.join(HISTORY)).expect("there");
        bytes[50] ^= 1;
        fs::write(entry.join(HISTORY), bytes).expect("room");
        assert!(cache.look(&name('a')).is_none());
        fill(&cache, &name('a'), 100);
        // Moved to another name it answers for nothing.
        fs::rename(folder.path().join(name('a')), folder.path().join(name('b'))).expect("a disk");
        assert!(cache.look(&name('b')).is_none());
    }

    #[test]
    fn what_was_not_used_for_the_longest_time_goes_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let fill_all = Cache::open(folder.path(), u64::MAX).expect("a folder");
        for digit in ['1', '2', '3'] {
            fill(&fill_all, &name(digit), 1000);
            let sums = folder.path().join(name(digit)).join(SUMS);
            let age = std::time::Duration::from_secs(1000 - u64::from(digit as u32));
            File::open(sums).and_then(|file| file.set_modified(SystemTime::now() - age)).expect("ours");
        }
        // A run was left by a study that was killed, before all others.
        let cut = folder.path().join(name('5') + PART);
        drop(fill_all.begin(&name('5')).expect("a disk"));
        fs::write(cut.join(HISTORY), "x".repeat(5_000)).expect("room");
        File::open(&cut)
            .and_then(|file| file.set_modified(SystemTime::now() - std::time::Duration::from_secs(5_000)))
            .expect("ours");
        // A later process uses the oldest.
        let cache = Cache::open(folder.path(), 3_500).expect("a folder");
        let under_way = cache.begin(&name('6')).expect("a disk").expect("not there");
        assert!(cache.look(&name('1')).is_some());
        fill(&cache, &name('4'), 1000);
        let left = ['1', '2', '3', '4'].map(|digit| folder.path().join(name(digit)).is_dir());
        assert_eq!(left, [true, false, false, true]);
        assert!(!cut.is_dir() && under_way.folder().is_dir());
    }
}
