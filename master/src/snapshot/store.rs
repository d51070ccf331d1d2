//! STORE: a folder with the two newest snapshots of a run, and a manifest that names them.
//!
//! A new one is written whole before the manifest names it, and the one before the last is removed only after that. So
//! at any instant - a killed process, a full disk, a lost power - the manifest names a whole one, once there was any.
//! What is in the folder beside what the manifest names was never committed, and is removed by the next write.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use tracing::trace;

use super::{
    Snapshot,
    file::{self, temporary_of},
};
use crate::{disk::sync_folder, results};

/// Name of a store in the folder of its run.
pub const FOLDER: &str = "snapshots";
/// Name of the manifest.
pub const MANIFEST: &str = "manifest.json";
/// Snapshots that are kept.
pub const GENERATIONS: usize = 2;

/// A snapshot that was committed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Generation {
    /// Counts the snapshots of a run.
    pub number: u64,
    /// The cycle that it begins at.
    pub cycle: u64,
    /// Its time (deck's unit).
    pub time: f64,
    /// Length of the file (bytes).
    pub bytes: u64,
    /// The file's last 32 bytes, hexadecimal.
    pub sum: String,
}

impl Generation {
    fn file_name(&self) -> String {
        name_of(self.number)
    }
}

fn name_of(number: u64) -> String {
    format!("snapshot-{number:06}.bolide")
}

fn number_of(name: &str) -> Option<u64> {
    name.strip_prefix("snapshot-")?.strip_suffix(".bolide")?.parse().ok()
}

#[derive(Serialize, Deserialize)]
struct Manifest {
    /// Newest first.
    generations: Vec<Generation>,
}

/// The newest snapshot that is whole, and what was wrong with newer ones.
#[derive(Debug)]
pub struct Found {
    /// None if there is none.
    pub snapshot: Option<Snapshot>,
    /// Sentences for the user.
    pub warnings: Vec<String>,
}

/// A folder of snapshots that one run writes to.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Newest first.
    generations: Vec<Generation>,
    next: u64,
}

impl Store {
    /// Takes a folder, which need not exist, with the snapshots that an earlier session of the run left there; gives the
    /// newest that is whole. Those that are not are named by no manifest any more once the next is written.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn open(folder: &Path) -> Result<(Self, Found), String> {
        Self::open_for(folder, |_| Ok(()))
    }

    /// The same for a run that goes on where its results are: a snapshot is not used if `check` finds that they are not what it counts on.
    ///
    /// # Errors
    /// If the folder cannot be read, or `check` could not look: what cannot be read now may be whole.
    pub fn open_for(
        folder: &Path,
        check: impl Fn(&Snapshot) -> Result<(), results::Error>,
    ) -> Result<(Self, Found), String> {
        let fault = |e: io::Error| format!("snapshots in {}: {e}", folder.display());
        let mut warnings = Vec::new();
        let mut numbers = Vec::new();
        match fs::read_dir(folder) {
            Ok(entries) => {
                for entry in entries {
                    let name = entry.map_err(fault)?.file_name();
                    numbers.extend(name.to_str().and_then(number_of));
                }
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(fault(error)),
        }
        numbers.sort_unstable_by(|a, b| b.cmp(a));
        let next = numbers.first().map_or(1, |last| last.saturating_add(1));
        let candidates = match read_manifest(folder) {
            Ok(Some(manifest)) => manifest.generations.iter().map(|g| g.number).collect(),
            Ok(None) => numbers,
            Err(why) => {
                warnings.push(format!("{why}; the snapshots beside it are tried, newest first"));
                numbers
            }
        };
        let mut store = Self { folder: folder.to_owned(), generations: Vec::new(), next };
        let mut newest = None;
        for number in candidates {
            if store.generations.len() == GENERATIONS {
                break;
            }
            let path = folder.join(name_of(number));
            match file::read_checked(&path) {
                Ok((snapshot, written)) => {
                    if let Err(why) = check(&snapshot) {
                        if !why.is_loss() {
                            return Err(why.to_string());
                        }
                        let cycle = snapshot.state.cycle;
                        warnings.push(format!("{why}; it is computed again from before cycle {cycle}"));
                        continue;
                    }
                    store.generations.push(Generation {
                        number,
                        cycle: snapshot.state.cycle,
                        time: snapshot.state.time,
                        bytes: written.bytes,
                        sum: written.sum.to_hex().to_string(),
                    });
                    newest = newest.or(Some(snapshot));
                }
                Err(why) => warnings.push(why),
            }
        }
        Ok((store, Found { snapshot: newest, warnings }))
    }

    /// The committed snapshots, newest first.
    pub fn generations(&self) -> &[Generation] {
        &self.generations
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Commits a snapshot: the file whole, then the manifest; then the one before the last goes.
    ///
    /// # Errors
    /// What the disk refused. What was committed before stays and is named.
    pub fn put(&mut self, snapshot: &Snapshot) -> Result<(), String> {
        let fault = |e: io::Error| format!("snapshots in {}: {e}", self.folder.display());
        fs::create_dir_all(&self.folder).map_err(fault)?;
        self.sweep().map_err(fault)?;
        let number = self.next;
        self.next = self.next.saturating_add(1);
        let written = file::write(&self.folder.join(name_of(number)), snapshot)?;
        trace!(number, "snapshot whole, not yet in the manifest");
        let generation = Generation {
            number,
            cycle: snapshot.state.cycle,
            time: snapshot.state.time,
            bytes: written.bytes,
            sum: written.sum.to_hex().to_string(),
        };
        let mut generations = vec![generation];
        generations.extend(self.generations.iter().take(GENERATIONS - 1).cloned());
        write_manifest(&self.folder, &Manifest { generations: generations.clone() })?;
        self.generations = generations;
        // The next write tries again.
        let _ = self.sweep();
        Ok(())
    }

    /// Removes all snapshots that the manifest does not name.
    fn sweep(&self) -> io::Result<()> {
        let named: Vec<String> = self.generations.iter().map(Generation::file_name).collect();
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            let name = entry.file_name();
            let Some(name) = name.to_str() else { continue };
            let ours = name.starts_with("snapshot-") && (name.ends_with(".tmp") || number_of(name).is_some());
            if ours && !named.iter().any(|n| n == name) {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }
}

/// Removes a store with all that it wrote; a folder with other files in it stays.
///
/// # Errors
/// What the disk refused.
pub fn remove(folder: &Path) -> Result<(), String> {
    let fault = |e: io::Error| format!("snapshots in {}: {e}", folder.display());
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(fault)?,
    };
    for entry in entries {
        let entry = entry.map_err(fault)?;
        let ours = entry.file_name().to_str().is_some_and(|name| {
            name.starts_with("snapshot-") && (name.ends_with(".tmp") || number_of(name).is_some())
                || name.starts_with("manifest.")
        });
        if ours {
            fs::remove_file(entry.path()).map_err(fault)?;
        }
    }
    // It fails if something else is in there, which is then somebody's.
    let _ = fs::remove_dir(folder);
    Ok(())
}

/// Number of the newest snapshot that a manifest names; 0 where there is none that can be read.
pub fn newest(folder: &Path) -> u64 {
    let manifest = read_manifest(folder).ok().flatten();
    manifest.and_then(|manifest| manifest.generations.first().map(|g| g.number)).unwrap_or_default()
}

fn read_manifest(folder: &Path) -> Result<Option<Manifest>, String> {
    let path = folder.join(MANIFEST);
    let fault = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(fault(&error)),
        Ok(bytes) => serde_json::from_slice(&bytes).map(Some).map_err(|e| fault(&e)),
    }
}

fn write_manifest(folder: &Path, manifest: &Manifest) -> Result<(), String> {
    let path = folder.join(MANIFEST);
    let text = serde_json::to_string_pretty(manifest).map_err(|e| e.to_string())?;
    write_durably(&path, text.as_bytes()).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes a small file so that a reader, now or after a loss of power, sees the former one or this one.
///
/// # Errors
/// What the disk refused; the former file then stays.
pub fn write_durably(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = temporary_of(path);
    let write = || {
        let mut file = fs::File::create(&temporary)?;
        io::Write::write_all(&mut file, bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)?;
        sync_folder(path)
    };
    write().inspect_err(|_| {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use mechanics::{
        exact::{Quanta, Quantum},
        state::GlobalState,
        vote::Vote,
    };

    use super::*;
    use crate::run_totals::RunTotals;

    const DECK: &str = "title = \"a cube\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"cube\"\nmaterial = \"AL_2024_T351\"\nbox = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }\n";

    fn snapshot(cycle: u64) -> Snapshot {
        let model = deck::read(DECK, "cube.toml").expect("the text above is a deck");
        // More than two chunks.
        let x = (0..100_000).map(|n| [n as f64, 0.5, cycle as f64]).collect();
        let state = GlobalState { cycle, x, ..GlobalState::default() };
        let quantum = Quantum::for_reference(1.0, 42);
        Snapshot {
            problem: [7; 32],
            state: Arc::new(state),
            dt_previous: 0.1,
            dt: 0.2,
            quanta: [Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 }; 2],
            spread_rate: 0.0,
            vote: Vote::empty(1),
            walls: Vec::new(),
            formed: Vec::new(),
            run_totals: RunTotals::new(&model, &vec![1.0; model.mesh.n_nodes()]),
            rows: Vec::new(),
            states: vec![(0, 0.0), (cycle, 0.5)],
            sums: vec![[3; 32], [4; 32]],
        }
    }

    /// A store with the snapshots of cycles 10 and 20.
    fn filled() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut store, found) = Store::open(&folder.path().join("snapshots")).expect("none is there");
        assert!(found.snapshot.is_none() && found.warnings.is_empty());
        for cycle in [5, 10, 20] {
            store.put(&snapshot(cycle)).expect("room");
        }
        (folder, store)
    }

    fn newest(store: &Store) -> (Option<u64>, Vec<String>) {
        let (_, found) = Store::open(store.folder()).expect("readable");
        (found.snapshot.map(|s| s.state.cycle), found.warnings)
    }

    fn file(store: &Store, generation: usize) -> PathBuf {
        store.folder().join(store.generations()[generation].file_name())
    }

    #[test]
    fn the_two_newest_are_kept_and_come_back_whole() {
        let (_folder, store) = filled();
        let (again, found) = Store::open(store.folder()).expect("readable");
        assert_eq!(found.snapshot, Some(snapshot(20)));
        assert_eq!(again.generations(), store.generations());
        assert_eq!(store.generations().iter().map(|g| g.cycle).collect::<Vec<_>>(), [20, 10]);
        assert_eq!(fs::read_dir(store.folder()).expect("readable").count(), 3, "two files and the manifest");
    }

    #[test]
    fn a_newest_that_was_cut_or_has_a_flipped_bit_anywhere_is_refused_and_the_older_is_used() {
        let (_folder, store) = filled();
        let path = file(&store, 0);
        let whole = fs::read(&path).expect("it is there");
        let step = whole.len() / 23;
        for at in (0..whole.len()).step_by(step).chain([8, 16, 24, whole.len() - 1]) {
            let mut flipped = whole.clone();
            flipped[at] ^= 0x20;
            for damaged in [&flipped[..], &whole[..at]] {
                fs::write(&path, damaged).expect("room");
                let (cycle, warnings) = newest(&store);
                assert_eq!(cycle, Some(10), "byte {at}");
                assert!(
                    warnings.len() == 1 && warnings[0].contains("snapshot-000003.bolide"),
                    "{warnings:?}"
                );
            }
        }
        fs::write(&path, &whole).expect("room");
        assert_eq!(newest(&store), (Some(20), vec![]));
    }

    #[test]
    fn with_no_manifest_or_a_torn_one_the_files_speak_for_themselves() {
        let (_folder, store) = filled();
        let manifest = store.folder().join(MANIFEST);
        fs::write(&manifest, "{\"generations\": [").expect("room");
        let (cycle, warnings) = newest(&store);
        assert_eq!((cycle, warnings.len()), (Some(20), 1));
        assert!(warnings[0].contains("manifest.json: "), "{warnings:?}");
        fs::remove_file(&manifest).expect("it is there");
        assert_eq!(newest(&store), (Some(20), vec![]));
    }

    #[test]
    fn a_write_that_is_refused_leaves_the_older_ones_and_the_next_one_sweeps_up() {
        let (_folder, mut store) = filled();
        let blocked = store.folder().join("manifest.tmp");
        fs::create_dir(&blocked).expect("room");
        let why = store.put(&snapshot(30)).expect_err("the manifest cannot be written");
        assert!(why.contains("manifest.json: "), "{why}");
        assert_eq!(newest(&store), (Some(20), vec![]), "what the manifest does not name was not committed");
        fs::remove_dir(&blocked).expect("empty");
        fs::write(store.folder().join("snapshot-000009.tmp"), "half").expect("room");
        store.put(&snapshot(40)).expect("room");
        assert_eq!(newest(&store), (Some(40), vec![]));
        assert_eq!(fs::read_dir(store.folder()).expect("readable").count(), 3);
        remove(store.folder()).expect("ours");
        assert!(!store.folder().exists());
    }

    #[test]
    fn a_snapshot_that_resumed_from_the_older_one_replaces_the_torn_one() {
        let (_folder, store) = filled();
        fs::write(file(&store, 0), "torn").expect("room");
        let (mut store, found) = Store::open(store.folder()).expect("readable");
        assert_eq!(found.snapshot.map(|s| s.state.cycle), Some(10));
        store.put(&snapshot(15)).expect("room");
        assert_eq!(newest(&store), (Some(15), vec![]));
        assert_eq!(store.generations().iter().map(|g| g.cycle).collect::<Vec<_>>(), [15, 10]);
    }
}
