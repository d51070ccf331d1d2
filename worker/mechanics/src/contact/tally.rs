//! Forces between pairs of parts, for histories: sums over the contacts of a cycle.

use serde::{Deserialize, Serialize};

use crate::exact::Quantum;

/// A sum over all contacts of a pair has far more terms than one over those of a node, so it has a quantum that is
/// `2^12` times as large: `2^21` terms at which a coarser quantum is asked for are added exactly. Of the 42 bits below the
/// stiffest face force 30 are left.
const COARSER: u32 = 12;

/// No pair.
const NONE: u32 = u32::MAX;

/// Contact of one pair of parts in one cycle: exact sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairVote {
    /// Force on the first part from the second.
    pub force: [f64; 3],
    /// Contacts in force: nodes of either in zones of the other.
    pub hits: u64,
}

impl PairVote {
    /// Adds what other contacts of the same pair give.
    pub fn merge(&mut self, other: &Self) {
        for axis in 0..3 {
            self.force[axis] += other.force[axis];
        }
        self.hits += other.hits;
    }
}

/// Sums by pair of parts. Whatever order contacts come in, the bits are the same.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    n_parts: usize,
    /// By parts of node and face, row-major: the pair that they are, and whether the node is of its first part.
    pair_of: Vec<(u32, bool)>,
    sums: Vec<PairVote>,
    quantum: Option<Quantum>,
}

impl Tally {
    /// For these pairs of different parts.
    pub(super) fn new(n_parts: usize, pairs: &[[u32; 2]]) -> Self {
        let mut pair_of = vec![(NONE, false); n_parts * n_parts];
        for (index, &[a, b]) in (0..).zip(pairs) {
            pair_of[a as usize * n_parts + b as usize] = (index, true);
            pair_of[b as usize * n_parts + a as usize] = (index, false);
        }
        Self { n_parts, pair_of, sums: vec![PairVote::default(); pairs.len()], quantum: None }
    }

    /// Begins a cycle with this quantum of forces.
    pub(super) fn clear(&mut self, force: Quantum) {
        self.sums.fill(PairVote::default());
        self.quantum = Some(force.coarser(COARSER));
    }

    /// Adds the force on a node of the first part from a face of the second.
    #[inline]
    pub(super) fn add(&mut self, (node, face): (u32, u32), force: [f64; 3]) {
        let (pair, first) = self.pair_of[node as usize * self.n_parts + face as usize];
        let (Some(sum), Some(quantum)) = (self.sums.get_mut(pair as usize), self.quantum) else { return };
        for (sum, force) in sum.force.iter_mut().zip(force) {
            *sum += quantum.round(if first { force } else { -force });
        }
        sum.hits += 1;
    }

    /// The sums of pairs in contact, by index.
    pub(super) fn votes(&self) -> Vec<(u32, PairVote)> {
        (0..).zip(&self.sums).filter(|(_, sum)| sum.hits > 0).map(|(pair, sum)| (pair, *sum)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_on_the_first_part_is_minus_that_on_the_second_in_any_order() {
        let pairs = [[2, 0], [0, 1]];
        let terms: Vec<((u32, u32), [f64; 3])> = (0..1000)
            .map(|i| {
                let x = f64::from(i).sin() * 1e3;
                ([(0, 2), (2, 0), (1, 0), (1, 2), (1, 1)][i as usize % 5], [x, -2.0 * x, 0.1])
            })
            .collect();
        let run = |terms: &mut dyn Iterator<Item = &((u32, u32), [f64; 3])>| {
            let mut tally = Tally::new(3, &pairs);
            tally.clear(Quantum::for_reference(1e3, 42));
            terms.for_each(|&(parts, force)| tally.add(parts, force));
            tally.votes()
        };
        let forward = run(&mut terms.iter());
        assert_eq!(forward, run(&mut terms.iter().rev()));
        let expected = |node: u32, face: u32, axis: usize| {
            let of = |n: u32, f: u32| -> f64 {
                terms.iter().filter(|(parts, _)| *parts == (n, f)).map(|(_, force)| force[axis]).sum()
            };
            of(node, face) - of(face, node)
        };
        for axis in 0..3 {
            assert!((forward[0].1.force[axis] - expected(2, 0, axis)).abs() < 1e-2);
            assert!((forward[1].1.force[axis] - expected(0, 1, axis)).abs() < 1e-2);
        }
        assert_eq!(
            forward.iter().map(|(pair, vote)| (*pair, vote.hits)).collect::<Vec<_>>(),
            [(0, 400), (1, 200)]
        );
        let mut tally = Tally::new(3, &pairs);
        tally.clear(Quantum::for_reference(1e3, 42));
        assert_eq!(tally.votes(), []);
    }
}
