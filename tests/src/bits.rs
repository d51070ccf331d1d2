//! What must be equal to the bit between two runs of one problem.

use master::results::history::HistoryRow;
use protocol::options::JobOptions;

use crate::solve::Solved;

/// Digest of the final state, every number of the history, and the energies that are summed over cycles.
#[derive(Clone, Debug, PartialEq)]
pub struct Fingerprint {
    /// Digest of the final state.
    pub digest: String,
    /// Cycle and bits of each row.
    rows: Vec<(u64, Vec<u64>)>,
    /// Bits of hourglass, viscosity, friction and external energy, momentum error, worst ratios, and energies of contact by pair of
    /// parts.
    run_totals: Vec<u64>,
}

impl Fingerprint {
    /// Of a run that came to its end.
    pub fn of(solved: &Solved) -> Self {
        let run_totals = &solved.outcome.run_totals;
        Self {
            digest: solved.outcome.digest.clone(),
            rows: solved.rows.iter().map(|row| (row.cycle, numbers(row))).collect(),
            run_totals: [
                run_totals.hourglass,
                run_totals.viscosity,
                run_totals.friction,
                run_totals.external,
                run_totals.momentum_error(),
                run_totals.worst_courant,
                run_totals.worst_gap_travel,
                run_totals.worst_penetration,
            ]
            .into_iter()
            .chain(run_totals.contacts.iter().flat_map(|pair| [pair.contact, pair.friction, pair.eroded]))
            .map(f64::to_bits)
            .collect(),
        }
    }

    /// Fails where the other run differs, and says where first.
    ///
    /// # Panics
    /// If a bit is different.
    pub fn assert_equal(&self, other: &Self, name: &str) {
        assert!(!self.rows.is_empty(), "{name}: no history to compare");
        for (mine, theirs) in self.rows.iter().zip(&other.rows) {
            assert_eq!(mine, theirs, "{name}: history from cycle {} on", mine.0);
        }
        assert_eq!(self.rows.len(), other.rows.len(), "{name}: rows of history");
        assert_eq!(self.digest, other.digest, "{name}: digest");
        assert_eq!(self.run_totals, other.run_totals, "{name}: sums over cycles");
    }
}

fn numbers(row: &HistoryRow) -> Vec<u64> {
    [row.time, row.dt, row.kinetic, row.internal, row.hourglass, row.contact, row.friction]
        .into_iter()
        .chain([row.external, row.total, row.error])
        .chain([row.eroded, row.eroded_elements as f64, row.eroded_mass])
        .chain(row.momentum)
        .chain(row.parts.iter().flat_map(|part| [part.kinetic, part.internal]))
        .chain(row.gauges.iter().flat_map(|gauge| gauge.x.into_iter().chain(gauge.v)))
        .chain(row.element_gauges.iter().flatten().copied())
        .chain(row.sections.iter().flat_map(|(_, s)| s.force.into_iter().chain(s.moment).chain(s.places)))
        .chain(row.contacts.iter().flat_map(|(_, vote)| vote.force.into_iter().chain([vote.hits as f64])))
        .map(f64::to_bits)
        .collect()
}

/// The forced sorts that every comparison tries.
pub fn forced_sorts() -> [JobOptions; 3] {
    let every = |n| JobOptions { sort_every: Some(n), ..JobOptions::default() };
    [every(1), every(7), JobOptions { sort_seed: Some(11), ..JobOptions::default() }]
}
