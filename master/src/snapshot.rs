//! Snapshots: the whole run at the start of a cycle, and how it gets to the disk and back.
//!
//! [`mod@file`] is the form of one on disk, [`store`] a folder of two generations, [`keeper`] the thread that writes beside
//! the run. What a snapshot holds is decided by the job: it is one of its checkpoints.

pub mod file;
pub mod keeper;
pub mod store;

use std::sync::Arc;

use mechanics::{exact::Quanta, rigid::switch::Formed, state::GlobalState, vote::Vote, wall::Pose};
use serde::{Deserialize, Serialize};

pub use file::{read, write};

use crate::{results::history::HistoryRow, run_totals::RunTotals};

/// All that a run needs to go on with the same bits, on any workers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// BLAKE3 of the problem but its end, and of the release that computes it: no other may go on with it.
    pub problem: [u8; 32],
    /// State at the start of a cycle.
    pub state: Arc<GlobalState>,
    /// `dt` of the cycle before (time).
    pub dt_previous: f64,
    /// `dt` of the cycle to come (time).
    pub dt: f64,
    /// Quanta of the sums of the cycle to come, and from the one after it on.
    pub quanta: [Quanta; 2],
    /// Rate at which bodies moved against each other (length per cycle), for the sorts to come.
    pub spread_rate: f64,
    /// The whole vote of the cycle before, still to take effect.
    pub vote: Vote,
    /// Poses of the walls of finite mass in the cycle to come.
    pub walls: Vec<Pose>,
    /// Parts that are rigid for a time, and are now.
    pub formed: Vec<Formed>,
    /// Energies and worst ratios so far.
    pub run_totals: RunTotals,
    pub rows: Vec<Arc<HistoryRow>>,
    /// Cycle and time of each state file so far; filled in by whoever writes those.
    pub states: Vec<(u64, f64)>,
    /// BLAKE3 of the files of each of them, so that a session which goes on finds out what was damaged or is missing.
    pub sums: Vec<[u8; 32]>,
}
