//! Where the runs of a study are computed.

use std::{fmt, sync::Arc};

use super::{cache, compute, plan::Point, prepare::Prepared};

/// A run that is wanted.
#[derive(Clone, Debug)]
pub struct Task {
    pub point: Point,
    pub prepared: Arc<Prepared>,
}

/// A run that is over. Its results are in the cache.
#[derive(Debug)]
pub struct Finished {
    pub point: Point,
    /// Element-cycles that were computed for it.
    pub result: Result<u64, RunError>,
}

/// Why a run has no results.
#[derive(Debug)]
pub enum RunError {
    /// The run itself.
    Compute(compute::Error),
    /// Its results could not be kept.
    Cache(cache::Error),
    /// What a master, or whoever ran it elsewhere, says.
    Elsewhere(String),
    /// The study was asked to stop.
    Stopped,
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Compute(why) => why.fmt(f),
            Self::Cache(why) => why.fmt(f),
            Self::Elsewhere(why) => f.write_str(why),
            Self::Stopped => f.write_str("the study was asked to stop"),
        }
    }
}

impl std::error::Error for RunError {}

/// Computes runs, several at once.
pub trait Place {
    /// How many more runs it takes now, while `waiting` of them wait and this would be the next.
    fn has_room(&self, next: &Task) -> bool;

    /// Takes a run. `waiting` is how many more wait.
    ///
    /// # Errors
    /// If no run can be computed there any more.
    fn take(&mut self, task: Task, waiting: usize) -> Result<(), String>;

    /// Waits until runs are over, or a moment; with `stop` those under way are asked to end.
    ///
    /// # Errors
    /// As for [`Place::take`].
    fn wait(&mut self, stop: bool) -> Result<Vec<Finished>, String>;
}
