//! The seam between contact and its kinds of pairs.
//!
//! A kind - a node against a face, an edge against an edge, a node tied to a face, a particle against a particle - is a module that does five things, each with its neighbours'
//! shape:
//! 1. it lists its pairs for a sort, as work units of its own [`Kind`], whose weight for the balance is the number of pairs that
//!    a cycle looks at;
//! 2. it says what a batch carries of them to a worker, and whether that is sound;
//! 3. it takes the pairs of a batch, from one sort to the next;
//! 4. each cycle it adds their forces and books energies, depths and hits ([`Pairs::forces`]);
//! 5. it votes on the time step by the greatest frequency of its springs.
//!
//! All kinds stand in [`kinds`](super::kinds), which alone knows them; none knows another. A kind may use the search, the geometry and
//! the force of its neighbours, which do not know each other either.

use super::{ContactVote, history::History, pair_energy::ByPair};
use crate::exact::Quantum;

/// What the pairs of a work unit are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Nodes against faces: all nodes of the unit with all its faces.
    #[default]
    NodeFace,
    /// Edges against edges: pairs of surface edges, listed one by one.
    EdgeEdge,
    /// Nodes tied to faces: surface node and surface face, listed one by one.
    Tied,
    /// Particles against particles: surface nodes, listed one by one, once for each of both.
    Particles,
}

/// Arrays of one cycle, by batch node.
pub(super) struct Cycle<'a> {
    pub(super) x: &'a [Vec<f64>; 3],
    /// Half a step ago, with the step `dt` that led to `x`.
    pub(super) v: &'a [Vec<f64>; 3],
    pub(super) dt: f64,
    pub(super) force_quantum: Quantum,
    pub(super) energy_quantum: Quantum,
    pub(super) f: &'a mut [Vec<f64>; 3],
    /// What contact keeps of nodes.
    pub(super) history: &'a mut History,
}

/// Where all kinds book a cycle: sums that are exact and extremes, so that their order is free.
pub(super) struct Books<'a> {
    pub(super) vote: &'a mut ContactVote,
    pub(super) by_pair: &'a mut ByPair,
}

/// The pairs of one kind on a worker, from one sort to the next.
pub(super) trait Pairs {
    /// Number of pairs that can act before the next sort.
    fn n_listed(&self) -> usize;

    /// Number of pairs that a cycle looks at.
    fn n_looked_at(&self) -> usize;

    /// Whether [`Pairs::forces`] reads velocities.
    fn reads_velocities(&self) -> bool;

    /// Adds forces and books what they mean. Gives the greatest squared frequency of the springs that act or soon may.
    fn forces(&mut self, cycle: &mut Cycle<'_>, books: &mut Books<'_>) -> f64;
}
