//! PHASE: what a worker does with its time, as its runtime reports it at the end of a run.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// Cycles before the end whose spans a worker keeps.
pub const TRACED_CYCLES: u64 = 16;
/// Most spans of a report; a cycle has some ten.
pub const SPANS_LIMIT: usize = 4096;

/// What a worker is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Phase {
    /// Elements that touch nodes of the exchange, and the packing of their partial forces.
    Border,
    /// Contact, and the installation of a plan.
    Contact,
    /// All other elements; at a plan boundary all elements.
    Interior,
    /// Packing messages and handing them to links, which send beside the computation.
    Send,
    /// No task: frames of others or orders are awaited.
    Wait,
    /// Integration of all nodes, and the vote.
    Integrate,
    /// States, transfers.
    Other,
}

impl Phase {
    /// Every phase, in the order of [`Report::ns`].
    pub const ALL: [Self; 7] =
        [Self::Border, Self::Contact, Self::Interior, Self::Send, Self::Wait, Self::Integrate, Self::Other];

    /// Its name, as summaries and traces spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Border => "border",
            Self::Contact => "contact",
            Self::Interior => "interior",
            Self::Send => "send",
            Self::Wait => "wait",
            Self::Integrate => "integrate",
            Self::Other => "other",
        }
    }
}

/// One phase, once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// What was done.
    pub phase: Phase,
    pub cycle: u64,
    /// Its start on the host's clock (ns since 1970).
    pub start_ns: u64,
    /// Its length (ns).
    pub length_ns: u64,
}

/// How a worker's time went in one job, by wall clock.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Report {
    /// Time by phase since the first cycle, in the order of [`Phase::ALL`] (ns).
    pub ns: [u64; 7],
    /// The last [`TRACED_CYCLES`] cycles, oldest first.
    pub spans: Vec<Span>,
    /// The cycle that it is in, and how long it has worked on its tasks so far, by the clock of its host (ns).
    pub cycle: u64,
    pub busy_ns: u64,
    /// Bytes that this worker sent over its own links to others.
    pub peer_bytes: u64,
    /// Workers that it has exchanged with over a link of their own to the end.
    pub linked: Vec<u32>,
    /// Workers that the master relayed to or from, at the start, since their link broke, or always.
    pub relayed: Vec<u32>,
    /// Where it computes only a part of its time, because the people whose PC it is on come first: how large a part, and why.
    pub slow: Option<String>,
}

/// Most bytes of [`Report::slow`].
const WORDS_LIMIT: usize = 200;

impl Report {
    /// Time in one phase (s).
    pub fn seconds(&self, phase: Phase) -> f64 {
        self.ns[phase as usize] as f64 * 1e-9
    }

    /// Passes a report that is not longer than a worker's can be in a job of `workers`.
    ///
    /// # Errors
    /// [`Error::TooLong`].
    pub fn check(&self, workers: usize) -> Result<()> {
        for (what, length, limit) in [
            ("spans of a report", self.spans.len(), SPANS_LIMIT),
            ("links of a report", self.linked.len(), workers),
            ("relayed pairs of a report", self.relayed.len(), workers),
            ("words of a report", self.slow.as_ref().map_or(0, String::len), WORDS_LIMIT),
        ] {
            if length > limit {
                return Err(Error::TooLong { what, length: length as u64, limit: limit as u64 });
            }
        }
        Ok(())
    }
}
