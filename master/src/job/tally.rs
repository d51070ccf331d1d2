//! What a job counts for its summary; no decision depends on it.

use mechanics::contact::Census;
use protocol::{message::Work, phase::Report};

use crate::{
    fragments::Watch,
    incident::{Difference, Loss, Rebalance},
};

/// What a job counts for its summary.
#[derive(Default)]
pub(super) struct Tally {
    /// Sorts that took effect.
    pub(super) sorts: u64,
    /// Of the sort in force in the last cycle that is complete.
    pub(super) census: Census,
    /// By index: compute time.
    work: Vec<Work>,
    /// By index, of its last stop.
    reports: Vec<Report>,
    /// Largest over mean of cost over speed.
    pub(super) imbalance: f64,
    /// Lane widths of the workers, joined by `+`.
    lanes: String,
    pub(super) rebalances: Vec<Rebalance>,
    pub(super) losses: Vec<Loss>,
    pub(super) differences: Vec<Difference>,
    pub(super) fragments: Watch,
    /// Cycles that waited for states on their way.
    pub(super) waits: u64,
}

impl Tally {
    /// Of a job that nothing has happened to.
    pub(super) fn new() -> Self {
        Self { imbalance: 1.0, ..Self::default() }
    }

    /// A worker computes with this lane width.
    pub(super) fn note_lanes(&mut self, lanes: &str) {
        if self.lanes.is_empty() {
            lanes.clone_into(&mut self.lanes);
        } else if !self.lanes.split('+').any(|known| known == lanes) {
            self.lanes = format!("{}+{lanes}", self.lanes);
        }
    }

    /// Lane widths of the workers.
    pub(super) fn lanes(&self) -> &str {
        &self.lanes
    }

    /// What one of `n` workers has worked so far.
    pub(super) fn note_work(&mut self, (index, n): (usize, usize), work: Work) {
        self.work.resize(n, Work::default());
        self.work[index] = work;
    }

    /// What all have worked, by index; `n` is how many there ever were.
    pub(super) fn work(&self, n: usize) -> Vec<Work> {
        let mut work = self.work.clone();
        work.resize(n.max(work.len()), Work::default());
        work
    }

    /// How the time of one of `n` workers went.
    pub(super) fn note_report(&mut self, (index, n): (usize, usize), report: Report) {
        self.reports.resize(n, Report::default());
        self.reports[index] = report;
    }

    /// How the time of each of the workers went.
    pub(super) fn reports(&self, at_work: &[usize]) -> Vec<Report> {
        at_work.iter().map(|&index| self.reports.get(index).cloned().unwrap_or_default()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_lane_width_is_named_once_and_late_workers_have_a_row() {
        let mut tally = Tally::default();
        for lanes in ["avx2", "avx512", "avx2"] {
            tally.note_lanes(lanes);
        }
        assert_eq!(tally.lanes(), "avx2+avx512");
        tally.note_work((3, 4), Work { compute_ns: 7, contact_ns: 1 });
        assert_eq!(tally.work(4).iter().map(|work| work.compute_ns).collect::<Vec<_>>(), [0, 0, 0, 7]);
        assert_eq!(tally.reports(&[0, 3]).len(), 2);
    }
}
