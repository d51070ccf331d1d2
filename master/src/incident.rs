//! What a run tells of its workers when it is over: losses, and times at which work was dealt out anew.

use serde::{Deserialize, Serialize};

/// Work was dealt out anew because speeds turned out to be others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rebalance {
    /// At the start of this cycle.
    pub cycle: u64,
    /// Names of the workers, in the order of the following.
    pub workers: Vec<String>,
    /// Speeds that work was dealt out by before.
    pub speeds_before: Vec<f64>,
    pub speeds_after: Vec<f64>,
    /// Time of the slowest worker over that of a perfect cut, as measured before.
    pub imbalance_before: f64,
    /// The same as it is foreseen with the new cut.
    pub imbalance_after: f64,
}

/// A worker was lost and the run went back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Loss {
    /// Name of the worker.
    pub worker: String,
    /// The first cycle that was not complete.
    pub cycle: u64,
    /// The cycle that the run went back to.
    pub back_to: u64,
    pub why: String,
}
