//! A batch of [work units](WorkUnit) as a worker gets it: compact, with nodes and faces of its own numbers, and with the static data
//! that computing contact needs.

use serde::{Deserialize, Serialize};

use super::{
    edges::BatchEdges,
    pair::Kind,
    particles::BatchParticles,
    search::Exclusions,
    surface::{Exposed, Surface},
    ties::BatchTies,
    work_unit::WorkUnit,
};
use crate::mesh::MAX_NODES;

/// The units of one worker: everything contact needs of their nodes and faces except position and velocity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    /// Nodes of the units and of their faces, by ascending global index.
    pub nodes: Vec<BatchNode>,
    /// Faces of the units, by ascending id.
    pub faces: Vec<BatchFace>,
    /// What is to be tested against what, in batch indices.
    pub units: Vec<BatchUnit>,
    /// Pairs (global node, face id) that never interact, ascending.
    pub excluded: Vec<(u32, u32)>,
    /// Pairs that are listed one by one.
    pub listed: Listed,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatchNode {
    /// Global node index.
    pub global: u32,
    pub part: u32,
    /// Nodal mass.
    pub mass: f64,
    /// Mean `K A^2 / V` of its faces (force per length).
    pub stiffness: f64,
    /// Share of it that the node takes ([`Surface::node_share`]).
    pub share: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatchFace {
    /// Batch node indices, outward by the right-hand rule.
    pub nodes: [u32; 4],
    /// Surface face index: the same number on every worker.
    pub id: u32,
    /// Part of its element.
    pub part: u32,
    /// `K A^2 / V` of its element (force per length).
    pub stiffness: f64,
    /// Global nodes of its element, and `u32::MAX` behind the last.
    pub corners: [u32; MAX_NODES],
}

/// One unit of a batch.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BatchUnit {
    /// Batch node indices.
    pub nodes: Vec<u32>,
    /// Batch face indices.
    pub faces: Vec<u32>,
}

impl Batch {
    /// Gathers units into a batch. `mass` gives the mass of a global node.
    pub fn gather(
        surface: &Surface,
        units: &[&WorkUnit],
        mass: &dyn Fn(u32) -> f64,
        exclusions: &Exclusions,
    ) -> Self {
        const NONE: u32 = u32::MAX;
        let mut face_index = vec![NONE; surface.faces.len()];
        let mut node_index = vec![NONE; surface.nodes.len()];
        let (mut nodes_of, mut faces_of) = (Vec::new(), Vec::new());
        let take = |index: &mut [u32], list: &mut Vec<u32>, item: u32| {
            let new = std::mem::replace(&mut index[item as usize], 0) == NONE;
            if new {
                list.push(item);
            }
            new
        };
        for unit in units {
            for &node in &unit.nodes {
                take(&mut node_index, &mut nodes_of, node);
            }
            for &face in &unit.faces {
                if take(&mut face_index, &mut faces_of, face) {
                    for node in surface.faces[face as usize].nodes {
                        take(&mut node_index, &mut nodes_of, node);
                    }
                }
            }
        }
        nodes_of.sort_unstable();
        faces_of.sort_unstable();
        let mut nodes = Vec::with_capacity(nodes_of.len());
        for n in nodes_of.into_iter().map(|n| n as usize) {
            node_index[n] = nodes.len() as u32;
            let global = surface.nodes[n];
            nodes.push(BatchNode {
                global,
                part: surface.node_part[n],
                mass: mass(global),
                stiffness: surface.node_stiffness[n],
                share: surface.node_share[n],
            });
        }
        let mut faces = Vec::with_capacity(faces_of.len());
        for f in faces_of {
            face_index[f as usize] = faces.len() as u32;
            let face = &surface.faces[f as usize];
            faces.push(BatchFace {
                nodes: face.nodes.map(|n| node_index[n as usize]),
                id: f,
                part: face.part,
                stiffness: face.stiffness,
                corners: face.corners,
            });
        }
        let mut excluded: Vec<(u32, u32)> = exclusions
            .on(surface)
            .filter(|&(node, face)| node_index[node as usize] != NONE && face_index[face as usize] != NONE)
            .map(|(node, face)| (surface.nodes[node as usize], face))
            .collect();
        excluded.sort_unstable();
        let units_of = units;
        let units = units
            .iter()
            .filter(|unit| unit.kind == Kind::NodeFace)
            .map(|unit| BatchUnit {
                nodes: unit.nodes.iter().map(|&n| node_index[n as usize]).collect(),
                faces: unit.faces.iter().map(|&f| face_index[f as usize]).collect(),
            })
            .collect();
        let listed = Listed::gather(surface, units_of, &node_index);
        Self { nodes, faces, units, excluded, listed }
    }

    /// Whether every index is in range, parts among `n_parts`, masses positive and nodes and faces in order: what a batch
    /// from outside must satisfy before [`super::Contact::new`].
    pub fn is_sound(&self, n_parts: usize) -> bool {
        let (n_nodes, n_faces) = (self.nodes.len(), self.faces.len());
        let below = |indices: &[u32], n: usize| indices.iter().all(|&i| (i as usize) < n);
        are_sound(&self.nodes, &self.faces, n_parts)
            && self.units.iter().all(|u| below(&u.nodes, n_nodes) && below(&u.faces, n_faces))
            && self.excluded.is_sorted()
            && self.listed.is_sound(n_nodes, n_parts)
    }
}

/// Whether nodes and faces are in order, their parts among `n_parts`, masses positive and corners among the nodes.
pub(super) fn are_sound(nodes: &[BatchNode], faces: &[BatchFace], n_parts: usize) -> bool {
    let is_corner = |&n: &u32| (n as usize) < nodes.len();
    nodes.iter().all(|n| (n.part as usize) < n_parts && n.mass > 0.0)
        && faces.iter().all(|f| (f.part as usize) < n_parts && f.nodes.iter().all(is_corner))
        && nodes.is_sorted_by(|a, b| a.global < b.global)
        && faces.is_sorted_by(|a, b| a.id < b.id)
}

/// What a batch has of the pairs that are listed one by one, and of what came out last.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Listed {
    /// Pairs of edges, where the deck asks for them.
    pub edges: BatchEdges,
    /// Nodes tied to faces.
    pub ties: BatchTies,
    /// Pairs of particles.
    pub particles: BatchParticles,
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
            particles: BatchParticles::gather(surface, units, node_index),
            exposed,
        }
    }

    /// Whether every index is in range, of `n_nodes` and `n_parts`.
    pub(super) fn is_sound(&self, n_nodes: usize, n_parts: usize) -> bool {
        let Exposed { nodes, faces, .. } = &self.exposed;
        let known = nodes.iter().all(|&node| (node as usize) < n_nodes) && faces.is_sorted();
        known
            && self.edges.is_sound(n_nodes, n_parts)
            && self.ties.is_sound(n_nodes)
            && self.particles.is_sound(n_nodes)
    }
}
