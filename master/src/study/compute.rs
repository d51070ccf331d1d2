//! One run of a study in this process: from the text of its deck to a history and a summary, without states.
//!
//! A run that takes longer than [`STORED_EVERY`] stores its state, so that a study which is killed goes on with it from there.

use std::{
    fmt,
    path::Path,
    sync::{Arc, atomic::AtomicBool},
    time::Instant,
};

use deck::Model;
use protocol::options::JobOptions;

use crate::{
    embedded::{self, Sink},
    event::{Action, WorkerSpec},
    job::Job,
    options::{CheckpointEvery, SessionOptions},
    results::{Folder, history::History},
    snapshot::{
        Snapshot,
        keeper::{Interval, Keeper},
        store::{self, Store},
    },
    summarise::{SurfaceCensus, summarise},
};

/// Seconds between two stored states of a run.
const STORED_EVERY: f64 = 20.0;

/// How a run has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Its results are written. So many element-cycles were computed, by this process.
    Done { element_cycles: u64 },
    /// It was asked to stop; what it had computed is stored.
    Stopped,
}

/// Why a run has no results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// The problem itself: it cannot start, or it ended with an error.
    Physics(String),
    /// The disk, or this machine.
    Machine(String),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Physics(why) | Self::Machine(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for Error {}

/// Computes a model with one worker of so many threads, and writes into a folder what an entry of the cache holds.
///
/// # Errors
/// The failure of the run, or what the machine refused.
pub fn compute(model: Model, folder: &Path, threads: usize, stop: &AtomicBool) -> Result<End, Error> {
    let machine = |why: String| Error::Machine(why);
    let results = |why: crate::results::Error| Error::Machine(why.to_string());
    let model = Arc::new(quiet(model));
    let spec = WorkerSpec::new("worker-0", 1.0, threads as u32);
    let interval = Interval { seconds: Some(STORED_EVERY), cycles: None };
    let asked = JobOptions::default();
    let options = SessionOptions {
        keep: CheckpointEvery::for_both(None, interval),
        store: true,
        ..SessionOptions::of(&asked, 1, true)
    };
    let snapshots = folder.join(store::FOLDER);
    let (_, found) = Store::open(&snapshots).map_err(machine)?;
    let begin = |snapshot: Option<Snapshot>| {
        Job::new(Arc::clone(&model), std::slice::from_ref(&spec), options.clone(), snapshot)
    };
    let resumed = found.snapshot.and_then(|snapshot| begin(Some(snapshot)).ok());
    let (job, first) = match resumed {
        Some(begun) => begun,
        None => {
            store::remove(&snapshots).map_err(machine)?;
            begin(None).map_err(|why| Error::Physics(why.to_string()))?
        }
    };
    let census = SurfaceCensus::of(&job, &model);
    let folder = Folder::create(folder, true).map_err(results)?;
    let (store, _) = Store::open(&snapshots).map_err(machine)?;
    let mut sink = Rows {
        keeper: Keeper::start(store, interval, job.start_state().cycle, None).map_err(machine)?,
        history: History::create(&folder, &model).map_err(results)?,
        ends: Vec::new(),
    };
    sink.ends.push(sink.history.length());
    for row in job.rows_before() {
        sink.row(row).map_err(machine)?;
    }
    let started = Instant::now();
    let (outcome, traffic) = embedded::run(job, first, 1, threads, &mut sink, stop).map_err(machine)?;
    if let Some(why) = &outcome.failure {
        return Err(Error::Physics(why.clone()));
    }
    if outcome.stopped {
        sink.keeper.flush();
        return Ok(End::Stopped);
    }
    let element_cycles = model.mesh.n_elements() as u64 * outcome.cycles_run;
    let wall = started.elapsed().as_secs_f64();
    let summary = summarise(&model, &census, &outcome, traffic, threads as u32, wall);
    summary.write(&folder).map_err(results)?;
    Ok(End::Done { element_cycles })
}

/// A model of whose states only the first and the last are asked for: nobody keeps them.
fn quiet(mut model: Model) -> Model {
    model.output.period = None;
    model.output.workers = false;
    model.output.contact_surface = false;
    model
}

/// Takes rows of the history, and states to go on from.
struct Rows {
    history: History,
    keeper: Keeper,
    /// Length of the history before its first row and after each (bytes).
    ends: Vec<u64>,
}

impl Rows {
    fn row(&mut self, row: &crate::results::history::HistoryRow) -> Result<(), String> {
        self.history.append(row).map_err(|e| e.to_string())?;
        self.ends.push(self.history.length());
        Ok(())
    }
}

impl Sink for Rows {
    fn take(&mut self, action: Action) -> Result<(), String> {
        match action {
            Action::Row(row) => self.row(&row),
            Action::Rewind { rows, .. } => {
                self.ends.truncate(rows + 1);
                self.ends.last().map_or(Ok(()), |&end| self.history.roll_back(end)).map_err(|e| e.to_string())
            }
            Action::Checkpoint { snapshot, last } => {
                if last || self.keeper.is_due(snapshot.state.cycle) {
                    self.keeper.put(snapshot);
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}
