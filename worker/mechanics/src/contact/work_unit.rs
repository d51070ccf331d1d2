//! Work unit: one cube of the sort with its nodes and faces, in surface indices. It lives where it was sorted.

use serde::{Deserialize, Serialize};

use super::pair::Kind;

/// One cube that holds nodes, and what is to be tested in it: pairs of one kind. Every interacting node is in exactly one unit
/// of nodes and faces, every pair of another kind in exactly one of its kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WorkUnit {
    /// What its pairs are.
    pub kind: Kind,
    /// Cube along each axis, counted from the lowest corner of all interacting nodes.
    pub cube: [i32; 3],
    /// Surface node indices, ascending.
    pub nodes: Vec<u32>,
    /// Surface face indices, ascending; of nodes against faces only.
    pub faces: Vec<u32>,
    /// Pairs that are listed one by one, of the other kinds: two surface edges, two particles.
    pub pairs: Vec<[u32; 2]>,
    /// Pairs to be tested: the unit's weight in the balance.
    pub interactions: u64,
}

impl WorkUnit {
    /// Whether there is nothing to be tested.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty() && self.pairs.is_empty()
    }
}

/// How units came out of a sort.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Census {
    /// Number of units.
    pub units: usize,
    /// Least, mean and greatest number of nodes of a unit.
    pub nodes: (usize, f64, usize),
    /// Least, mean and greatest number of faces of a unit.
    pub faces: (usize, f64, usize),
    /// Interactions of all units.
    pub interactions: u64,
}

impl Census {
    /// Counts the units of a sort; all zero without any.
    pub fn of(units: &[WorkUnit]) -> Self {
        let range = |count: &dyn Fn(&WorkUnit) -> usize| {
            let least = units.iter().map(count).min().unwrap_or(0);
            let greatest = units.iter().map(count).max().unwrap_or(0);
            let sum: usize = units.iter().map(count).sum();
            (least, sum as f64 / units.len().max(1) as f64, greatest)
        };
        Self {
            units: units.len(),
            nodes: range(&|unit| unit.nodes.len()),
            faces: range(&|unit| unit.faces.len()),
            interactions: units.iter().map(|unit| unit.interactions).sum(),
        }
    }

    /// Takes in the units of another worker's sort.
    pub fn merge(&mut self, other: &Self) {
        if other.units == 0 || self.units == 0 {
            *self = if self.units == 0 { *other } else { *self };
            return;
        }
        let (n, m) = (self.units as f64, other.units as f64);
        let join = |a: (usize, f64, usize), b: (usize, f64, usize)| {
            (a.0.min(b.0), (a.1 * n + b.1 * m) / (n + m), a.2.max(b.2))
        };
        self.nodes = join(self.nodes, other.nodes);
        self.faces = join(self.faces, other.faces);
        self.units += other.units;
        self.interactions += other.interactions;
    }
}
