//! WRITER: states on their way to the disk, on a thread of its own.
//!
//! A state is compressed, and its contact computed, beside the run: whoever runs a job hands the state over and goes on.
//! One state may wait while one is written; a third waits for room. What the disk refuses is told at the next
//! opportunity, and nothing is written after it.

use std::{
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
};

use deck::model::Model;
use mechanics::state::GlobalState;

use super::{Error, vtu::Series};

/// A state and, by global element index, who computes what.
type Task = (Box<GlobalState>, Option<Arc<[u32]>>);

#[derive(Default)]
struct WriteQueue {
    waiting: Option<Task>,
    writing: bool,
    ended: bool,
    fault: Option<Error>,
}

struct Shared {
    write_queue: Mutex<WriteQueue>,
    changed: Condvar,
    /// Locked while a state is written.
    series: Mutex<Series>,
    /// Something is wrong; so that nobody waits for the lock to ask.
    failed: AtomicBool,
}

impl Shared {
    fn write_queue(&self) -> MutexGuard<'_, WriteQueue> {
        self.write_queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, write_queue: MutexGuard<'a, WriteQueue>) -> MutexGuard<'a, WriteQueue> {
        self.changed.wait(write_queue).unwrap_or_else(PoisonError::into_inner)
    }

    fn series(&self) -> MutexGuard<'_, Series> {
        self.series.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The way to the thread that writes states. Dropping it waits for those under way.
pub struct Writer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    /// Starts the thread.
    ///
    /// # Errors
    /// If it cannot start.
    pub fn start(series: Series, model: Arc<Model>) -> Result<Self, String> {
        let shared = Arc::new(Shared {
            write_queue: Mutex::default(),
            changed: Condvar::new(),
            series: Mutex::new(series),
            failed: AtomicBool::new(false),
        });
        let of_thread = Arc::clone(&shared);
        // At the priority of the others: a run that waits for it must not wait for strangers on this machine too.
        let thread = std::thread::Builder::new().name("states".to_owned());
        let thread = thread.spawn(move || serve(&of_thread, &model));
        let thread = thread.map_err(|e| format!("a thread for states: {e}"))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Hands a state over; waits while another one waits already. `workers` is as in [`super::vtu::write_vtu`].
    ///
    /// # Errors
    /// What the disk refused before.
    pub fn put(&self, state: Box<GlobalState>, workers: Option<Arc<[u32]>>) -> Result<(), Error> {
        let mut write_queue = self.shared.write_queue();
        while write_queue.waiting.is_some() {
            write_queue = self.shared.wait(write_queue);
        }
        if let Some(fault) = write_queue.fault.take() {
            return Err(fault);
        }
        write_queue.waiting = Some((state, workers));
        drop(write_queue);
        self.shared.changed.notify_all();
        Ok(())
    }

    /// Says what the disk refused, once, without waiting.
    ///
    /// # Errors
    /// That.
    pub fn check(&self) -> Result<(), Error> {
        if !self.shared.failed.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.shared.write_queue().fault.take().map_or(Ok(()), Err)
    }

    /// Waits until everything that was handed over is on disk.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn flush(&self) -> Result<(), Error> {
        let mut write_queue = self.shared.write_queue();
        while write_queue.writing || write_queue.waiting.is_some() {
            write_queue = self.shared.wait(write_queue);
        }
        write_queue.fault.take().map_or(Ok(()), Err)
    }

    /// Works on the series, which stands still meanwhile, with everything written.
    ///
    /// # Errors
    /// What the disk refused before, and the errors of `work`.
    pub fn with<T>(&self, work: impl FnOnce(&mut Series) -> Result<T, Error>) -> Result<T, Error> {
        self.flush()?;
        work(&mut self.shared.series())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.shared.write_queue().ended = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // Its panic would be a bug that has printed its words.
            let _ = thread.join();
        }
    }
}

/// Ends what a thread is in the middle of even if that panics, so that nobody waits for ever.
struct Busy<'a>(&'a Shared);

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.write_queue().writing = false;
        self.0.changed.notify_all();
    }
}

fn serve(shared: &Shared, model: &Model) {
    loop {
        let mut write_queue = shared.write_queue();
        let (state, workers) = loop {
            match write_queue.waiting.take() {
                Some(task) => break task,
                None if write_queue.ended => return,
                None => write_queue = shared.wait(write_queue),
            }
        };
        write_queue.writing = true;
        drop(write_queue);
        // There is room for the next to wait.
        shared.changed.notify_all();
        let _busy = Busy(shared);
        if shared.failed.load(Ordering::Relaxed) {
            continue;
        }
        if let Err(fault) = shared.series().write(model, &state, workers.as_deref()) {
            shared.write_queue().fault = Some(fault);
            shared.failed.store(true, Ordering::Relaxed);
        }
    }
}
