//! The kinds of pairs that there are ([`pair`](super::pair)). A new one is a line in each of these functions.

use serde::{Deserialize, Serialize};

use super::{
    BatchEdges, BatchTies, Settings, edges,
    edges::cycle::Edges,
    node_face::NodeFace,
    pair::{Books, Cycle, Pairs},
    search::Exclusions,
    sort as by_cubes,
    surface::{Exposed, Surface},
    ties::{self, Ties},
    work_unit::{Batch, WorkUnit},
};
use crate::lanes::Width;

/// Sorts a surface into work units: those of nodes and faces in the order in which its nodes first touch them, then those of
/// other kinds. `x` by surface node.
///
/// Every pair of a node and a face that interact and of which the node lies in the face's box grown by the reach is in exactly
/// one unit. Nodes and faces that can meet nothing are left out.
///
/// # Panics
/// If the settings know fewer parts than the surface.
pub fn sort(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    exclusions: &Exclusions,
) -> Vec<WorkUnit> {
    let mut units = by_cubes::units(surface, x, settings, exclusions);
    units.extend(edges::sort::units(surface, x, settings, exclusions));
    units.extend(ties::units(surface, settings));
    units
}

/// What a batch has of the pairs that are listed one by one, and of what came out last.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Listed {
    /// Pairs of edges, where the deck asks for them.
    pub edges: BatchEdges,
    /// Nodes tied to faces.
    pub ties: BatchTies,
    /// What came out last; read in that cycle alone.
    pub exposed: Exposed,
}

impl Listed {
    /// Of some units; `node_index` gives the batch node of a surface node.
    pub(super) fn gather(surface: &Surface, units: &[&WorkUnit], node_index: &[u32]) -> Self {
        let came_out = &surface.exposed;
        let mut exposed = Exposed { at: came_out.at, ..Exposed::default() };
        for unit in units {
            let new = |of: &[u32], item: &u32| of.binary_search(item).is_ok();
            exposed.faces.extend(unit.faces.iter().filter(|face| new(&came_out.faces, face)));
            let nodes = unit.nodes.iter().filter(|node| new(&came_out.nodes, node));
            exposed.nodes.extend(nodes.map(|&node| node_index[node as usize]));
        }
        for list in [&mut exposed.nodes, &mut exposed.faces] {
            list.sort_unstable();
            list.dedup();
        }
        Self {
            edges: BatchEdges::gather(surface, units, node_index),
            ties: BatchTies::gather(surface, units, node_index),
            exposed,
        }
    }

    /// Whether every index is in range, of `n_nodes` and `n_parts`.
    pub(super) fn is_sound(&self, n_nodes: usize, n_parts: usize) -> bool {
        let Exposed { nodes, faces, .. } = &self.exposed;
        let known = nodes.iter().all(|&node| (node as usize) < n_nodes) && faces.is_sorted();
        known && self.edges.is_sound(n_nodes, n_parts) && self.ties.is_sound(n_nodes)
    }
}

/// All pairs of a batch, by kind.
#[derive(Clone, Debug)]
pub(super) struct Kinds {
    pub(super) faces: NodeFace,
    edges: Edges,
    ties: Ties,
}

impl Kinds {
    /// Takes the pairs of a batch; see [`super::Contact::new`].
    pub(super) fn new(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3], width: Width) -> Self {
        Self {
            faces: NodeFace::new(batch, settings, x, width),
            edges: Edges::new(batch, settings),
            ties: Ties::new(batch, settings),
        }
    }

    pub(super) fn each(&self) -> [&dyn Pairs; 3] {
        [&self.faces, &self.edges, &self.ties]
    }

    /// The forces of all. Gives the greatest squared frequency.
    #[inline(always)]
    pub(super) fn forces(&mut self, cycle: &mut Cycle<'_>, books: &mut Books<'_>) -> f64 {
        let faces = self.faces.forces(cycle, books);
        let edges = self.edges.forces(cycle, books);
        let ties = self.ties.forces(cycle, books);
        faces.max(edges).max(ties)
    }
}
