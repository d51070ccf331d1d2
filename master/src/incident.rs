//! What a run tells of its workers when it is over: losses, and times at which work was dealt out anew.

use std::fmt;

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

/// A computation of an interval came to something else than two others that agree; it left no trace in the results.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Difference {
    /// The cycle at whose start the interval begins.
    pub begins: u64,
    /// The cycle at whose start it ends.
    pub ends: u64,
    /// The first cycle whose votes show it; none if the end alone does.
    pub cycle: Option<u64>,
    /// Workers of the sub-domains that show it first.
    pub workers: Vec<String>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { begins, ends, cycle, workers } = self;
        write!(f, "one computation of cycles {begins} to {ends} was wrong and is not in the results; ")?;
        let names = workers.join(", ");
        match cycle {
            Some(cycle) => write!(f, "it differs first in cycle {cycle}, on {names}: test the memory there"),
            None if workers.is_empty() => {
                f.write_str("nothing shows on which worker: test the memory of all hosts")
            }
            None => write!(f, "it differs at the end, on {names}: test the memory there"),
        }
    }
}
