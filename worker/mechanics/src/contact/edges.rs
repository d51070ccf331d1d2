//! Edges against edges, where the deck asks for it: what crosses without a node in any zone.
//!
//! Of two bodies that cross so, one does it with an edge that sticks out: one at which two faces meet at a convex angle, or
//! any edge of a shell (`features`). The other edge may have been flat at the start, as a mesh line of a face into which the
//! first is pressed; only hollow ones are left out. The master pairs them up with the sort (`sort`); a worker computes the pairs of its units each
//! cycle (`cycle`) from the closest points of the two lines and a weight that hands over to the nodes at the ends
//! (`zone`).
//!
//! The spring of a pair has the energy `W k (gap - d)^2 / 2`, where `d` is the distance of the closest points and `W` is 1
//! where all four end nodes are farther than a gap from the other edge, seen along the line of the closest points, and
//! 0 where one of them is on it: there the zones of nodes take over. Forces are the exact derivative of that energy by
//! the four nodes, so they conserve it and both momenta; where `W` is 1 they lie on the line of the closest points.

pub(super) mod cycle;
pub(super) mod features;
pub(super) mod sort;
pub(super) mod zone;

use serde::{Deserialize, Serialize};

use super::{pair::Kind, surface::Surface, work_unit::WorkUnit};

pub use sort::initial_edges;

/// In a pair of [`ContactVote::worst_pair`](super::ContactVote::worst_pair): the second number without this bit is a node of the
/// second edge, the first one of the first.
pub const EDGE: u32 = 1 << 31;

/// An edge of the surface that can meet others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Surface node indices, ascending.
    pub nodes: [u32; 2],
    /// Part of the edge: the lowest of its faces'.
    pub part: u32,
    /// Two of its faces; the second is `u32::MAX` at a rim.
    pub faces: [u32; 2],
    /// Whether it sticks out: of two edges that meet, one at least does.
    pub sharp: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatchEdge {
    /// Batch node indices.
    pub nodes: [u32; 2],
    pub part: u32,
    /// Mean of the stiffness of its nodes (force per length).
    pub stiffness: f64,
    /// Share of it that both nodes take together, at most 1: as half an element hangs on an edge as on a node inside a face.
    pub share: f64,
}

/// The edges of a batch and their pairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BatchEdges {
    /// Edges of the pairs, ascending by their place in the surface.
    pub edges: Vec<BatchEdge>,
    /// What is to be tested against what: batch edge indices.
    pub pairs: Vec<[u32; 2]>,
}

impl BatchEdges {
    /// Edges of units and their pairs. `node_index` gives the batch node of a surface node.
    pub(super) fn gather(surface: &Surface, units: &[&WorkUnit], node_index: &[u32]) -> Self {
        let pairs = || units.iter().filter(|unit| unit.kind == Kind::EdgeEdge).flat_map(|unit| &unit.pairs);
        let mut used: Vec<u32> = pairs().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let place = |edge: u32| used.partition_point(|&other| other < edge) as u32;
        let edge = |&edge: &u32| {
            let edge = &surface.edges[edge as usize];
            let [a, b] = edge.nodes.map(|n| n as usize);
            BatchEdge {
                nodes: [a, b].map(|n| node_index[n]),
                part: edge.part,
                stiffness: 0.5 * (surface.node_stiffness[a] + surface.node_stiffness[b]),
                share: (surface.node_share[a] + surface.node_share[b]).min(1.0),
            }
        };
        Self { edges: used.iter().map(edge).collect(), pairs: pairs().map(|pair| pair.map(place)).collect() }
    }

    /// Whether every index is in range, of `n_nodes` and `n_parts`.
    pub fn is_sound(&self, n_nodes: usize, n_parts: usize) -> bool {
        let n = self.edges.len();
        let edge = |edge: &BatchEdge| {
            (edge.part as usize) < n_parts && edge.nodes.iter().all(|&node| (node as usize) < n_nodes)
        };
        self.edges.iter().all(edge) && self.pairs.iter().flatten().all(|&edge| (edge as usize) < n)
    }
}
