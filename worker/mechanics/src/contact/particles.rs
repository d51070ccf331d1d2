//! Particles: nodes that have lost all their elements, which press on each other where the deck asks for it.
//!
//! A solid that fails leaves its mass, momentum and kinetic energy at its nodes, and those press on faces as all nodes do ([`node_face`]).
//! Between each other they would pass: rubble in a confined place would bear nothing, and clouds would cross. So each is a ball as large as
//! the volume that it stands for, a cube of the side `2 R`: balls of a cubic grid just touch. The master pairs them up with the sort ([`sort`]); a worker
//! computes the balls of its units in each cycle ([`cycle`]).
//!
//! Two balls push each other along the line of their centres with the spring `k d`, where d is how far they overlap. It is contact alone: what
//! holds rubble together or heats it was the element's, and has been booked with it. A ball has no spin, so a force across that line would be a moment
//! that nobody takes: balls do not rub on each other, only on faces.
//!
//! Elements are often crushed when they fail, so nodes are born nearer than their balls allow. Springs that began at their full depth would push with energy
//! that nobody has put in. So a ball *lacks* a part of its radius: at its birth as much as keeps it from overlapping others, and as those make
//! room it grows, half of the room of a pair for each of both. It grows only where nothing presses on it, so no spring changes its energy. What a ball
//! lacks is its node's [history](super::History).
//!
//! A pair is looked at twice, once for each ball, with the same numbers: forces are opposite to the bit, and whoever computes a ball sees all that
//! decides on its radius. Nothing depends on pairs of which even whole balls are apart, but for the time step, so lists of any age say the same.
//!
//! [`node_face`]: super::node_face

pub(super) mod cycle;
pub(super) mod sort;

use serde::{Deserialize, Serialize};

use super::{Settings, WARNING, pair::Kind, surface::Surface, work_unit::WorkUnit};
use crate::{material::Material, mesh::Mesh};

/// A particle of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Surface node index.
    pub node: u32,
    /// Radius of the whole ball (length).
    pub radius: f64,
    /// Stiffness of its side of a spring (force per length).
    pub stiffness: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatchParticle {
    /// Batch node index.
    pub node: u32,
    /// Radius of the whole ball (length).
    pub radius: f64,
    /// Stiffness of its side of a spring (force per length).
    pub stiffness: f64,
    /// Whether it became a particle with the last change of the surface.
    pub is_new: bool,
}

/// The particles of a batch and their pairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BatchParticles {
    /// Particles of the pairs, ascending by node.
    pub particles: Vec<BatchParticle>,
    /// What is to be tested against what, ascending: a particle that the batch computes and another one, indices of particles.
    pub pairs: Vec<[u32; 2]>,
}

impl Settings {
    /// Whether freed nodes of any part are particles.
    pub(super) fn any_particles(&self) -> bool {
        self.particles.contains(&true)
    }

    /// Whether particles of two parts press on each other: those of one part always do.
    pub(super) fn presses(&self, a: u32, b: u32) -> bool {
        a == b || self.permits(a, b)
    }

    /// Beyond this distance of their balls no pair of particles has a part in a cycle (length): nearer ones limit the time step.
    pub(super) fn ahead_of_particles(&self) -> f64 {
        (WARNING - 1.0) * self.gap
    }
}

impl Surface {
    /// Collects the particles: nodes without an element, of parts whose flags are `settings.particles`; a joined node is of its lowest
    /// part, as in all of contact. `speed` is the closing speed of each part (length per time).
    ///
    /// The side of a spring is as stiff as the cube of the ball under its bulk modulus, and stops at the closing speed another like itself before
    /// their centres meet. A node takes the share of it that it takes of the springs of faces.
    pub fn find_particles(
        &mut self,
        mesh: &Mesh,
        materials: &[Material],
        settings: &Settings,
        speed: &[f64],
    ) {
        self.particles.clear();
        if !settings.any_particles() {
            return;
        }
        let mut freed = self.active.clone();
        self.faces.iter().flat_map(|face| face.nodes).for_each(|node| freed[node as usize] = false);
        // By global node, the surface node where it is freed.
        const NONE: u32 = u32::MAX;
        let mut place = vec![NONE; mesh.n_nodes()];
        for (n, &node) in (0..).zip(&self.nodes).filter(|(n, _)| freed[*n as usize]) {
            place[node as usize] = n;
        }
        let mut volume = vec![0.0; self.nodes.len()];
        for part in &mesh.parts {
            for e in 0..part.n_elements() {
                let corners = part.nodes_of(e);
                if corners.iter().all(|&node| place[node as usize] == NONE) {
                    continue;
                }
                let of_element = part.volume_of(e, &mesh.positions);
                for (&node, share) in corners.iter().zip(part.shares(e)) {
                    if let Some(volume) = volume.get_mut(place[node as usize] as usize) {
                        *volume += share * of_element;
                    }
                }
            }
        }
        for node in (0..self.nodes.len()).filter(|&node| volume[node] > 0.0) {
            let part = self.node_part[node] as usize;
            if settings.particles.get(part) != Some(&true) {
                continue;
            }
            let material = &materials[mesh.parts[part].material as usize];
            let side = libm::cbrt(volume[node]);
            let modulus = material.bulk().max(material.density * (speed[part] * speed[part]));
            let stiffness = self.node_share[node] * (modulus * side);
            self.particles.push(Particle { node: node as u32, radius: 0.5 * side, stiffness });
        }
    }

    /// The particle that a surface node is, if it is one.
    fn particle_of(&self, node: u32) -> Option<&Particle> {
        let at = self.particles.binary_search_by_key(&node, |particle| particle.node).ok()?;
        Some(&self.particles[at])
    }

    /// Particles that `before` had not: surface nodes, ascending.
    pub(super) fn new_particles(&self, before: &Self) -> Vec<u32> {
        let nodes = self.particles.iter().map(|particle| particle.node);
        nodes.filter(|&node| before.particle_of(node).is_none()).collect()
    }
}

impl BatchParticles {
    /// Those of units. `node_index` gives the batch node of a surface node.
    pub(super) fn gather(surface: &Surface, units: &[&WorkUnit], node_index: &[u32]) -> Self {
        let of_kind = || units.iter().filter(|unit| unit.kind == Kind::Particles);
        let mut used: Vec<u32> = of_kind().flat_map(|unit| &unit.nodes).copied().collect();
        used.sort_unstable();
        used.dedup();
        let particle = |&node: &u32| {
            let of_surface = surface.particle_of(node)?;
            let is_new = surface.exposed.particles.binary_search(&node).is_ok();
            let Particle { radius, stiffness, .. } = *of_surface;
            Some(BatchParticle { node: node_index[node as usize], radius, stiffness, is_new })
        };
        let place = |node: u32| used.partition_point(|&other| other < node) as u32;
        let mut pairs: Vec<[u32; 2]> =
            of_kind().flat_map(|unit| &unit.pairs).map(|pair| pair.map(place)).collect();
        pairs.sort_unstable();
        Self { particles: used.iter().filter_map(particle).collect(), pairs }
    }

    /// Whether every index is in range, of `n_nodes`, radii are positive and all is in order.
    pub(super) fn is_sound(&self, n_nodes: usize) -> bool {
        let n = self.particles.len();
        let particle = |p: &BatchParticle| {
            (p.node as usize) < n_nodes
                && p.radius.is_finite()
                && p.radius > 0.0
                && p.stiffness.is_finite()
                && p.stiffness >= 0.0
        };
        self.particles.iter().all(particle)
            && self.particles.is_sorted_by(|a, b| a.node < b.node)
            && self.pairs.iter().all(|&[a, b]| (a as usize) < n && (b as usize) < n && a != b)
            && self.pairs.is_sorted_by(|a, b| a < b)
    }
}
