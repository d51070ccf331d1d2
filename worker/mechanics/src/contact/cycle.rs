//! One cycle of contact of a batch: the forces of all kinds of pairs, and what they book together.

use super::{
    ContactVote, Settings,
    batch::Batch,
    force,
    history::History,
    kinds::Kinds,
    pair::{Books, Cycle},
    pair_energy::{ByPair, PairEnergies},
    tally::Tally,
};
use crate::{contact::PairVote, exact::Quantum, lanes::Width};

/// The contact of one batch, from one sort to the next.
#[derive(Clone, Debug)]
pub struct Contact {
    n_parts: usize,
    pub(super) kinds: Kinds,
    /// What is kept of its nodes. Whoever holds them brings it to the state of now before the forces, and takes what they leave;
    /// without that no node is in a zone before the first cycle.
    pub history: History,
    /// Sums of the cycle by pair of parts.
    by_pair: ByPair,
}

impl Contact {
    /// Takes the pairs of a batch that can meet before the next sort. `x` by batch node, at any moment at
    /// which no spread since the sort exceeds the slack. The forces do not depend on `width`.
    ///
    /// # Panics
    /// If the batch is not sound ([`Batch::is_sound`]), `x` has fewer nodes or the machine lacks the width
    /// ([`Width::require`]).
    pub fn new(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3], width: Width) -> Self {
        assert!(width.available(), "lane width {width} is not on this machine");
        Self {
            n_parts: settings.n_parts(),
            kinds: Kinds::new(batch, settings, x, width),
            history: History::new(settings.n_history(), batch.nodes.len()),
            by_pair: ByPair::default(),
        }
    }

    /// Energies of the last cycle by pair of parts.
    pub fn energies(&self) -> &PairEnergies {
        &self.by_pair.energies
    }

    /// From now on the forces between these pairs of parts are summed; none of them for none.
    pub fn watch_pairs(&mut self, pairs: &[[u32; 2]]) {
        self.by_pair.forces = (!pairs.is_empty()).then(|| Tally::new(self.n_parts, pairs));
    }

    /// What [`Contact::forces`] found last between each watched pair that is in contact, by index of the pair.
    pub fn pair_votes(&self) -> Vec<(u32, PairVote)> {
        self.by_pair.forces.as_ref().map(Tally::votes).unwrap_or_default()
    }

    /// The lane width that it computes on.
    #[cfg(test)]
    pub(crate) fn width(&self) -> Width {
        self.kinds.faces.width
    }

    /// Whether [`Contact::forces`] reads velocities.
    pub(crate) fn reads_velocities(&self) -> bool {
        self.kinds.each().into_iter().any(|pairs| pairs.reads_velocities())
    }

    /// Number of pairs that a cycle looks at, of all kinds.
    pub fn n_pairs(&self) -> usize {
        self.kinds.each().into_iter().map(|pairs| pairs.n_looked_at()).sum()
    }

    /// Adds the contact forces at positions `x` into `f`, and says what they mean for the cycle.
    ///
    /// `v` is the velocity of half a step ago; it serves friction, and tells edges that have crossed. Arrays by batch node.
    pub fn forces(
        &mut self,
        x: &[Vec<f64>; 3],
        v: &[Vec<f64>; 3],
        dt: f64,
        force_quantum: Quantum,
        energy_quantum: Quantum,
        f: &mut [Vec<f64>; 3],
    ) -> ContactVote {
        let mut history = std::mem::take(&mut self.history);
        history.clear();
        let cycle = Cycle { x, v, dt, force_quantum, energy_quantum, f, history: &mut history };
        let vote = self.forces_of(cycle);
        self.history = history;
        vote
    }

    fn forces_of(&mut self, cycle: Cycle) -> ContactVote {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the feature has just been detected.
            return unsafe { self.forces_with_fma(cycle) };
        }
        self.forces_with(cycle)
    }

    /// [`Contact::forces_with`] compiled with fused multiply-add, which without it is a slow library call of
    /// the same bits.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "fma")]
    fn forces_with_fma(&mut self, cycle: Cycle) -> ContactVote {
        self.forces_with(cycle)
    }

    #[inline(always)]
    fn forces_with(&mut self, mut cycle: Cycle) -> ContactVote {
        let listed: usize = self.kinds.each().into_iter().map(|pairs| pairs.n_listed()).sum();
        let mut vote = ContactVote { pairs: listed as u64, ..ContactVote::default() };
        self.by_pair.clear(cycle.force_quantum);
        let mut books = Books { vote: &mut vote, by_pair: &mut self.by_pair };
        let frequency2 = self.kinds.forces(&mut cycle, &mut books);
        vote.dt = force::time_step(frequency2);
        vote
    }
}
