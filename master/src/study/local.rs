//! Runs of a study on this PC: several at once, each with some of its cores.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver, RecvTimeoutError, Sender},
    },
    time::Duration,
};

use super::{
    cache::Cache,
    compute::{self, End, compute},
    place::{Finished, Place, RunError, Task},
};
use crate::footprint;

/// Elements that are worth a thread of their own: below, threads wait for each other more than they compute.
const ELEMENTS_PER_THREAD: usize = 2_000;
/// What a run takes of memory for an element, at its peak, and at all (bytes): twice what a master takes, as master and worker share the process.
const OF_ELEMENT: u64 = 2_200;
const OF_RUN: u64 = 64 << 20;
/// How long a wait for runs lasts at most.
const MOMENT: Duration = Duration::from_millis(200);

/// This PC.
pub struct Local {
    cache: Arc<Cache>,
    /// Threads of each run, if the user said so.
    threads: Option<usize>,
    /// Runs at once.
    most: usize,
    cores: usize,
    /// Threads of the runs under way.
    busy: usize,
    under_way: usize,
    stop: Arc<AtomicBool>,
    send: Sender<(usize, Finished)>,
    receive: Receiver<(usize, Finished)>,
}

impl Local {
    /// With so many runs at once, each of so many threads, where the user said so. There is one more than cores where each may have one, so
    /// that none of them rests while a run reads its deck, makes its mesh or waits for the disk.
    pub fn new(cache: Arc<Cache>, runs: Option<u32>, threads: Option<u32>) -> Self {
        let cores = worker::processors::cores();
        let threads = threads.map(|threads| threads as usize);
        let of_each = threads.unwrap_or(1);
        let most = (cores / of_each).max(1) + usize::from(of_each == 1);
        let most = runs.map_or(most, |runs| runs as usize);
        let (send, receive) = mpsc::channel();
        let stop = Arc::default();
        Self { cache, threads, most, cores, busy: 0, under_way: 0, stop, send, receive }
    }
}

impl Place for Local {
    fn has_room(&self, next: &Task) -> bool {
        let needed = OF_RUN + next.prepared.elements * OF_ELEMENT;
        let fits = footprint::available().is_none_or(|available| needed <= available);
        // A run that never fits is begun alone.
        self.under_way == 0 || (self.under_way < self.most && fits)
    }

    fn take(&mut self, task: Task, waiting: usize) -> Result<(), String> {
        let at_once = (waiting + 1).min(self.most.saturating_sub(self.under_way).max(1));
        let useful = (task.prepared.elements as usize / ELEMENTS_PER_THREAD).max(1);
        let free = self.cores.saturating_sub(self.busy);
        let threads = self.threads.unwrap_or_else(|| (free / at_once).clamp(1, useful));
        let (cache, stop, send) = (Arc::clone(&self.cache), Arc::clone(&self.stop), self.send.clone());
        let run = move || {
            let bug = || {
                RunError::Compute(compute::Error::Machine(
                    "a bug in the run; the log has its words".to_owned(),
                ))
            };
            let result = catch_unwind(AssertUnwindSafe(|| run(&task, &cache, threads, &stop)));
            let result = result.unwrap_or_else(|_| Err(bug()));
            // The receiver is gone only when the study is over.
            let _ = send.send((threads, Finished { point: task.point, result }));
        };
        let spawned = std::thread::Builder::new().name("run".to_owned()).spawn(run);
        spawned.map_err(|e| format!("a thread for a run: {e}"))?;
        self.under_way += 1;
        self.busy += threads;
        Ok(())
    }

    fn wait(&mut self, stop: bool) -> Result<Vec<Finished>, String> {
        self.stop.store(stop, Ordering::Relaxed);
        let first = match self.receive.recv_timeout(MOMENT) {
            Ok(first) => first,
            Err(RecvTimeoutError::Timeout) => return Ok(Vec::new()),
            Err(RecvTimeoutError::Disconnected) => return Err("every run is gone".to_owned()),
        };
        let mut finished = Vec::new();
        for (threads, run) in std::iter::once(first).chain(self.receive.try_iter()) {
            self.under_way -= 1;
            self.busy -= threads;
            finished.push(run);
        }
        Ok(finished)
    }
}

/// Computes a run, unless somebody else has done so meanwhile.
fn run(task: &Task, cache: &Cache, threads: usize, stop: &AtomicBool) -> Result<u64, RunError> {
    let Some(work) = cache.begin(&task.prepared.identity).map_err(RunError::Cache)? else { return Ok(0) };
    let model = task.prepared.model().map_err(|why| RunError::Compute(compute::Error::Physics(why)))?;
    match compute(model, work.folder(), threads, stop) {
        Err(why @ compute::Error::Physics(_)) => {
            // Begun again it would end in the same way. What cannot be removed is bounded with the rest.
            let _ = std::fs::remove_dir_all(work.folder());
            Err(RunError::Compute(why))
        }
        Err(why) => Err(RunError::Compute(why)),
        Ok(End::Stopped) => Err(RunError::Stopped),
        Ok(End::Done { element_cycles }) => {
            cache.commit(work).map_err(RunError::Cache)?;
            Ok(element_cycles)
        }
    }
}
