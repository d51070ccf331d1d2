//! KEEPER: writes snapshots on a thread of its own, at most one at a time, the newest first.
//!
//! Whoever runs a job hands over a checkpoint and goes on; encoding, checksums and the disk cost it nothing. A disk that
//! cannot keep up loses checkpoints, not cycles. A disk that refuses is a warning: the run goes on with the older ones.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use tracing::{debug, warn};

use super::{Snapshot, store::Store};

/// A checkpoint that comes this much early counts as in time: checkpoints are taken by a clock of the same period.
const EARLY: f64 = 0.8;

/// How often a run is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// After so many seconds.
    pub seconds: Option<f64>,
    /// After so many cycles.
    pub cycles: Option<u64>,
}

impl Interval {
    /// Whether anything is stored while the run goes.
    pub const fn is_never(&self) -> bool {
        self.seconds.is_none() && self.cycles.is_none()
    }
}

/// What has been stored.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// The cycle of the newest snapshot on disk.
    pub cycle: Option<u64>,
    /// How many were written by this session.
    pub count: u64,
    /// Wall-clock time that took, beside the run (s).
    pub seconds: f64,
    /// Why the last one that was tried is not on disk.
    pub refused: Option<String>,
}

#[derive(Default)]
struct WriteQueue {
    waiting: Option<Box<Snapshot>>,
    writing: bool,
    ended: bool,
    kept: Kept,
}

#[derive(Default)]
struct Shared {
    write_queue: Mutex<WriteQueue>,
    changed: Condvar,
}

impl Shared {
    fn write_queue(&self) -> MutexGuard<'_, WriteQueue> {
        self.write_queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The way to the thread that writes. Dropping it waits for the snapshot under way.
pub struct Keeper {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    interval: Interval,
    /// When and at which cycle the last was handed over.
    last: (Instant, u64),
}

impl Keeper {
    /// Starts the thread. `first_cycle` is where the run begins; files in `results` are made to outlive a loss of power
    /// before a snapshot that counts on them is committed.
    ///
    /// # Errors
    /// If it cannot start.
    pub fn start(
        store: Store,
        interval: Interval,
        first_cycle: u64,
        results: Option<PathBuf>,
    ) -> Result<Self, String> {
        let shared = Arc::new(Shared::default());
        shared.write_queue().kept.cycle = store.generations().first().map(|g| g.cycle);
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("snapshots".to_owned()).spawn(move || {
            system::processors::lowest_priority();
            serve(&of_thread, store, results.as_deref());
        });
        let thread = thread.map_err(|e| format!("a thread for snapshots: {e}"))?;
        Ok(Self { shared, thread: Some(thread), interval, last: (Instant::now(), first_cycle) })
    }

    /// Whether the checkpoint of a cycle is due.
    pub fn is_due(&self, cycle: u64) -> bool {
        let (at, last) = self.last;
        self.interval.seconds.is_some_and(|s| at.elapsed().as_secs_f64() >= EARLY * s)
            || self.interval.cycles.is_some_and(|n| cycle >= last.saturating_add(n))
    }

    /// Hands a snapshot over; one that still waits is replaced.
    pub fn put(&mut self, snapshot: Box<Snapshot>) {
        self.last = (Instant::now(), snapshot.state.cycle);
        self.shared.write_queue().waiting = Some(snapshot);
        self.shared.changed.notify_all();
    }

    /// What has been stored so far.
    pub fn kept(&self) -> Kept {
        self.shared.write_queue().kept.clone()
    }

    /// Waits until everything that was handed over is on disk, or was refused by it.
    pub fn flush(&self) -> Kept {
        let mut write_queue = self.shared.write_queue();
        while write_queue.writing || write_queue.waiting.is_some() {
            write_queue = self.shared.changed.wait(write_queue).unwrap_or_else(PoisonError::into_inner);
        }
        write_queue.kept.clone()
    }

    /// Forgets what waits, and ends with the snapshot under way.
    pub fn discard(self) {
        self.shared.write_queue().waiting = None;
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.shared.write_queue().ended = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // Its panic would be a bug that has printed its words.
            let _ = thread.join();
        }
    }
}

fn serve(shared: &Shared, mut store: Store, results: Option<&Path>) {
    loop {
        let mut write_queue = shared.write_queue();
        let snapshot = loop {
            match write_queue.waiting.take() {
                Some(snapshot) => break snapshot,
                None if write_queue.ended => return,
                None => {
                    write_queue = shared.changed.wait(write_queue).unwrap_or_else(PoisonError::into_inner)
                }
            }
        };
        write_queue.writing = true;
        drop(write_queue);
        let (cycle, started) = (snapshot.state.cycle, Instant::now());
        let synced = results.map_or(Ok(()), system::folders::sync);
        let result = synced.map_err(|e| format!("results folder: {e}")).and_then(|()| store.put(&snapshot));
        drop(snapshot);
        let took = started.elapsed();
        let mut write_queue = shared.write_queue();
        write_queue.writing = false;
        match result {
            Ok(()) => stored(&mut write_queue.kept, cycle, took),
            Err(why) => refused(&mut write_queue.kept, cycle, why),
        }
        drop(write_queue);
        shared.changed.notify_all();
    }
}

fn stored(kept: &mut Kept, cycle: u64, took: Duration) {
    debug!(cycle, ms = took.as_millis() as u64, "snapshot stored");
    kept.cycle = Some(cycle);
    kept.count += 1;
    kept.seconds += took.as_secs_f64();
    kept.refused = None;
}

/// Says so once for each reason.
fn refused(kept: &mut Kept, cycle: u64, why: String) {
    if kept.refused.as_ref() != Some(&why) {
        let older = match kept.cycle {
            Some(older) => format!("the one of cycle {older} stays"),
            None => "there is none yet".to_owned(),
        };
        warn!("no snapshot at cycle {cycle}: {why}; {older}, the run goes on");
    }
    kept.refused = Some(why);
}
