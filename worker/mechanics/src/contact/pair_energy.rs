//! What contact books by pair of parts.

use serde::{Deserialize, Serialize};

use super::tally::Tally;
use crate::exact::Quantum;

/// Sums of one cycle by pair of parts: energies of all pairs that touch, forces of those that are watched.
#[derive(Clone, Debug, Default)]
pub(super) struct ByPair {
    pub(super) energies: PairEnergies,
    pub(super) forces: Option<Tally>,
}

impl ByPair {
    /// Empty sums of a cycle whose forces are multiples of a quantum.
    pub(super) fn clear(&mut self, force_quantum: Quantum) {
        self.energies.clear();
        if let Some(forces) = &mut self.forces {
            forces.clear(force_quantum);
        }
    }
}

/// Energies of one pair of parts, exact sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairEnergy {
    /// The parts, lower index first; equal for a part that meets itself.
    pub parts: [u32; 2],
    /// Energy in penalty springs.
    pub contact: f64,
    /// Energy that friction took in the cycle.
    pub friction: f64,
}

/// Energies of the pairs that touched, by their parts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairEnergies {
    list: Vec<PairEnergy>,
}

impl PairEnergies {
    /// The pairs, ascending.
    pub fn pairs(&self) -> &[PairEnergy] {
        &self.list
    }

    /// The same without what friction took.
    pub fn of_springs(&self) -> Self {
        let springs = self.list.iter().map(|pair| PairEnergy { friction: 0.0, ..*pair });
        Self { list: springs.collect() }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Adds energies of a node of one part at a face of another.
    pub fn add(&mut self, a: u32, b: u32, contact: f64, friction: f64) {
        let parts = [a.min(b), a.max(b)];
        let at = match self.list.binary_search_by_key(&parts, |pair| pair.parts) {
            Ok(at) => at,
            Err(at) => {
                self.list.insert(at, PairEnergy { parts, ..PairEnergy::default() });
                at
            }
        };
        self.list[at].contact += contact;
        self.list[at].friction += friction;
    }

    /// Joins what another worker has.
    pub fn merge(&mut self, other: &Self) {
        for pair in &other.list {
            self.add(pair.parts[0], pair.parts[1], pair.contact, pair.friction);
        }
    }
}
