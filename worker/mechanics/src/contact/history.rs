//! What contact keeps of a node from one cycle to the next.
//!
//! All pairs of a node are computed by one worker, but another one may compute them after the next sort. So the numbers belong to the
//! node, not to the pair: like its velocity they are equal on every holder, travel with the total forces, go to new ghosts, and
//! are part of a checkpoint. A node without a hit keeps zeros.

use super::Settings;

/// Numbers where faces come out from under eroded elements: offset of the depth, depth in the last cycle (see
/// [`exposed`](super::node_face)).
const EXPOSED: usize = 2;

/// Numbers where friction sticks: elongation of the spring, by axis.
const STICKS: usize = 3;

/// Numbers where ties break: 1 while the tie of the node holds, offset of its depth in the zone of the part to which it is tied (see
/// [`bond`](super::bond)).
const BOND: usize = 2;

/// Numbers where nodes without elements are particles: what the ball lacks of its radius (see [`particles`](super::particles)).
const PARTICLE: usize = 1;

impl Settings {
    /// Numbers that contact keeps by node.
    pub fn n_history(&self) -> usize {
        self.first_of_particle() + if self.any_particles() { PARTICLE } else { 0 }
    }

    /// Where the numbers of particles begin among those of a node.
    pub(super) fn first_of_particle(&self) -> usize {
        self.first_of_bond() + if self.ties_break { BOND } else { 0 }
    }

    /// Whether friction sticks anywhere.
    pub fn any_sticks(&self) -> bool {
        self.sticks && self.friction.iter().any(|&coefficient| coefficient > 0.0)
    }

    /// Where the numbers of ties that break begin among those of a node.
    pub(super) fn first_of_bond(&self) -> usize {
        self.first_of_stick() + if self.any_sticks() { STICKS } else { 0 }
    }

    /// Where the numbers of friction begin among those of a node.
    pub(super) fn first_of_stick(&self) -> usize {
        if self.erodes { EXPOSED } else { 0 }
    }
}

/// The numbers of the nodes of a batch in one cycle, node by node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// Numbers by node.
    n: usize,
    /// The cycle whose forces are computed.
    pub cycle: u64,
    /// At its start.
    before: Vec<f64>,
    /// At its end; zeros where this batch has not computed the node.
    after: Vec<f64>,
}

impl History {
    /// Zeros for nodes of which contact keeps `n` numbers.
    pub fn new(n: usize, n_nodes: usize) -> Self {
        Self { n, cycle: 0, before: vec![0.0; n * n_nodes], after: vec![0.0; n * n_nodes] }
    }

    /// Whether contact keeps nothing.
    pub fn is_empty(&self) -> bool {
        self.before.is_empty()
    }

    /// The numbers of a node at the start of the cycle.
    pub fn before(&self, node: usize) -> &[f64] {
        &self.before[self.n * node..self.n * (node + 1)]
    }

    /// The same, to be brought to those of now.
    pub fn before_mut(&mut self, node: usize) -> &mut [f64] {
        &mut self.before[self.n * node..self.n * (node + 1)]
    }

    /// The numbers of a node at the end of the cycle.
    pub fn after(&self, node: usize) -> &[f64] {
        &self.after[self.n * node..self.n * (node + 1)]
    }

    pub(super) fn after_mut(&mut self, node: usize) -> &mut [f64] {
        &mut self.after[self.n * node..self.n * (node + 1)]
    }

    /// Those at the start and at the end of the cycle, for tests that flip bits in them.
    pub(crate) fn numbers_mut(&mut self) -> [&mut [f64]; 2] {
        [&mut self.before, &mut self.after]
    }

    /// Nothing has been computed in this cycle.
    pub(super) fn clear(&mut self) {
        self.after.fill(0.0);
    }
}
