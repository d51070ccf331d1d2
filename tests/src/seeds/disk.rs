//! The disk of one seed: rows and states of the results, and a real store of snapshots in a folder of its own.
//!
//! It can be full, or the master have no descriptor left for a file; it can flip a bit of a stored file, and lose the last rename when its
//! machine loses power. What the master must not do about that
//! can be planted.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use master::{
    event::Action,
    results::{self, history::HistoryRow},
    service::is_shortage,
    snapshot::{
        Snapshot,
        file::CHUNK,
        store::{MANIFEST, Store},
    },
};
use mechanics::state::GlobalState;

use super::{Bug, Draws};

/// Bytes of a snapshot file before its first chunk.
const HEADER: usize = 24;
/// Bytes of a checksum.
const SUM: usize = 32;

/// What the system says where the disk has no room.
const NO_ROOM: i32 = if cfg!(windows) { 112 } else { 28 };
/// The same where a process has no descriptor left.
const NO_FILES: i32 = if cfg!(windows) { 4 } else { 24 };

/// What was written to the disk.
pub(super) struct Disk {
    pub(super) rows: Vec<HistoryRow>,
    pub(super) states: Vec<GlobalState>,
    /// Of snapshots; none as long as there are none.
    folder: Option<tempfile::TempDir>,
    store: Option<Store>,
    /// Files of the folder before the last snapshot was put there.
    before: Vec<(PathBuf, Vec<u8>)>,
    /// States that were written when that was.
    synced: usize,
    /// Writes that it has no room for.
    pub(super) full: u64,
    /// Files that the master cannot open, and callers that it cannot take.
    pub(super) files: u64,
    /// A state or row found no room: the job cannot go on before there is some.
    pub(super) is_short: bool,
    /// Why the job has failed.
    pub(super) failure: Option<String>,
    bug: Option<Bug>,
}

impl Disk {
    pub(super) fn new(bug: Option<Bug>) -> Self {
        Self {
            rows: Vec::new(),
            states: Vec::new(),
            folder: None,
            store: None,
            before: Vec::new(),
            synced: 0,
            full: 0,
            files: 0,
            is_short: false,
            failure: None,
            bug,
        }
    }

    /// Takes what a master writes.
    ///
    /// # Errors
    /// What the real disk refused.
    pub(super) fn take(&mut self, action: Action) -> Result<(), String> {
        match action {
            Action::Row(_) | Action::State(_) if self.refuses_results() => {}
            Action::Row(row) => self.rows.push(*row),
            Action::State(state) => self.states.push(*state),
            // The run goes on with the older ones.
            Action::Snapshot(_) | Action::Checkpoint { .. } if self.refusal().is_some() => {}
            Action::Snapshot(snapshot) | Action::Checkpoint { snapshot, .. } => self.put(&snapshot)?,
            Action::Rewind { rows, cycle } => {
                self.rows.truncate(rows);
                self.states.retain(|state| state.cycle <= cycle);
            }
            _ => {}
        }
        Ok(())
    }

    /// What the system says to the next write, if it refuses it.
    fn refusal(&mut self) -> Option<i32> {
        let (count, number) =
            if self.files > 0 { (&mut self.files, NO_FILES) } else { (&mut self.full, NO_ROOM) };
        let refuses = *count > 0;
        *count = count.saturating_sub(1);
        refuses.then_some(number)
    }

    /// Whether a row or state is not written; then the job waits or has failed, by what the master makes of the system's words.
    fn refuses_results(&mut self) -> bool {
        let Some(number) = self.refusal() else { return false };
        let source = io::Error::from_raw_os_error(number);
        let reason = results::Error::Io { action: "write", path: "results".into(), source }.to_string();
        match self.bug {
            // Planted: what is not written is not missed.
            Some(Bug::Careless) => {}
            // Planted: a lack of descriptors is the job's own fault.
            Some(Bug::Hasty) if number == NO_FILES => self.failure = Some(reason),
            _ if is_shortage(&reason) => self.is_short = true,
            _ => self.failure = Some(reason),
        }
        true
    }

    fn put(&mut self, snapshot: &Snapshot) -> Result<(), String> {
        // What an earlier session wrote behind the checkpoint that it was gone on with is of no use.
        if self.is_short {
            return Ok(());
        }
        if self.folder.is_none() {
            self.folder = Some(in_memory()?);
        }
        let path = self.path().ok_or("no folder")?;
        self.before = files(&path);
        if self.store.is_none() {
            self.store = Some(Store::open(&path)?.0);
        }
        self.synced = self.states.len();
        self.store.as_mut().map_or(Ok(()), |store| store.put(snapshot))
    }

    fn path(&self) -> Option<PathBuf> {
        self.folder.as_ref().map(|folder| folder.path().to_owned())
    }

    /// The newest snapshot that is whole, as the next master finds it.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(super) fn newest(&mut self) -> Result<Option<Snapshot>, String> {
        // Another process, with descriptors of its own.
        (self.is_short, self.files) = (false, 0);
        self.store = None;
        let Some(path) = self.path() else { return Ok(None) };
        if self.bug == Some(Bug::Trusting)
            && let Some(snapshot) = unchecked(&path)
        {
            return Ok(Some(snapshot));
        }
        let (store, found) = Store::open(&path)?;
        self.store = Some(store);
        Ok(found.snapshot)
    }

    /// A bit of one of the stored files flips.
    pub(super) fn rot(&mut self, draws: &mut Draws) {
        let Some(path) = self.path() else { return };
        let mut files = files(&path);
        if files.is_empty() {
            return;
        }
        let index = draws.below(files.len() as u64) as usize;
        let (path, bytes) = &mut files[index];
        if !bytes.is_empty() {
            let at = draws.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << draws.below(8);
            // It was written a moment ago.
            let _ = fs::write(path, bytes);
        }
    }

    /// The machine loses power before the last rename of a snapshot was durable; its file is there in part.
    pub(super) fn lose_rename(&mut self, draws: &mut Draws) {
        let Some(path) = self.path() else { return };
        if self.bug == Some(Bug::Unsynced) {
            // Planted: the snapshot is durable, and states that it counts on are not.
            self.states.truncate(self.synced.saturating_sub(1));
            return;
        }
        let now = files(&path);
        for (path, bytes) in &now {
            let was = self.before.iter().find(|(before, _)| before == path);
            // Folders of the system's memory do not run out of room for these.
            let _ = match was {
                Some((_, before)) => fs::write(path, before),
                None => fs::write(path, &bytes[..draws.below(bytes.len() as u64 + 1) as usize]),
            };
        }
        for (path, bytes) in self.before.iter().filter(|(path, _)| !now.iter().any(|(new, _)| new == path)) {
            let _ = fs::write(path, bytes);
        }
        if !self.before.iter().any(|(path, _)| path.ends_with(MANIFEST)) {
            let _ = fs::remove_file(path.join(MANIFEST));
        }
    }
}

/// A folder in memory where there is one: a seed must not wait for a disk.
fn in_memory() -> Result<tempfile::TempDir, String> {
    let folder = match Path::new("/dev/shm") {
        memory if memory.is_dir() => tempfile::tempdir_in(memory),
        _ => tempfile::tempdir(),
    };
    folder.map_err(|e| format!("a folder for snapshots: {e}"))
}

/// The files of a folder with their bytes, by name.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<(PathBuf, Vec<u8>)> =
        entries.flatten().filter_map(|entry| Some((entry.path(), fs::read(entry.path()).ok()?))).collect();
    files.sort();
    files
}

/// The newest snapshot of a folder, whatever its checksums say.
fn unchecked(folder: &Path) -> Option<Snapshot> {
    let files = files(folder);
    let newest = files.iter().rfind(|(path, _)| path.extension().is_some_and(|end| end == "bolide"))?;
    let body = newest.1.get(HEADER..newest.1.len().checked_sub(SUM)?)?;
    let chunks = body.chunks(SUM + CHUNK).flat_map(|chunk| chunk.get(SUM..).unwrap_or_default());
    let body: Vec<u8> = chunks.copied().collect();
    protocol::codec::decode(&body, body.len()).ok()
}
