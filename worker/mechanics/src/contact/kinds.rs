//! The kinds of pairs that there are ([`pair`](super::pair)). A new one is a line in each of these functions.

use super::{
    Settings,
    batch::Batch,
    edges::{self, cycle::Edges},
    node_face::NodeFace,
    pair::{Books, Cycle, Pairs},
    particles::{self, cycle::Particles},
    search::Exclusions,
    sort as by_cubes,
    surface::Surface,
    ties::{self, Ties},
    work_unit::WorkUnit,
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
    units.extend(particles::sort::units(surface, x, settings));
    units
}

/// All pairs of a batch, by kind.
#[derive(Clone, Debug)]
pub(super) struct Kinds {
    pub(super) faces: NodeFace,
    edges: Edges,
    ties: Ties,
    particles: Particles,
}

impl Kinds {
    /// Takes the pairs of a batch; see [`super::Contact::new`].
    pub(super) fn new(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3], width: Width) -> Self {
        Self {
            faces: NodeFace::new(batch, settings, x, width),
            edges: Edges::new(batch, settings),
            ties: Ties::new(batch, settings),
            particles: Particles::new(batch, settings),
        }
    }

    pub(super) fn each(&self) -> [&dyn Pairs; 4] {
        [&self.faces, &self.edges, &self.ties, &self.particles]
    }

    /// The forces of all. Gives the greatest squared frequency.
    #[inline(always)]
    pub(super) fn forces(&mut self, cycle: &mut Cycle<'_>, books: &mut Books<'_>) -> f64 {
        let faces = self.faces.forces(cycle, books);
        let edges = self.edges.forces(cycle, books);
        let ties = self.ties.forces(cycle, books);
        let particles = self.particles.forces(cycle, books);
        faces.max(edges).max(ties).max(particles)
    }
}
