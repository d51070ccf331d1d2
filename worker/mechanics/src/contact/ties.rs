//! Nodes tied to faces: two meshes that do not match act as one body.
//!
//! A tie holds a node where it lay on a face at the start, in any direction, by a spring from the node to the point of the face with
//! the same shape functions. It is a penalty and not a constraint, because a spring is one more pair of contact: it needs no
//! order among nodes and faces, takes no mass from anyone, acts between any two workers by the exchange that there is, and may be
//! let go when its face erodes. The force lies on the line of both points and goes to the corners by the shape functions, the node gets
//! exactly minus what the corners get: momentum is conserved to the bit, angular momentum to rounding.
//!
//! A tie that can break ([`bond`](super::bond)) acts as long as the history of its node says that it holds.
//!
//! Ties are static data of the deck: which they are, their stiffness, and what bounds their frequency. By the row sums of
//! `M^-1 K`, of springs whose shares `w` at a node of mass m add up to `sum k w`, no frequency is above `2 sum k w / m`.

use serde::{Deserialize, Serialize};

use super::{
    Bond, Settings,
    batch::Batch,
    bond, force,
    pair::{Books, Cycle, Kind, Pairs},
    surface::Surface,
    work_unit::WorkUnit,
};

/// `omega dt` of ties at most. Elements take 2/3 of 2, the springs of contact 0.4: their squares, 1.8, 1 and 0.2, add up to less than
/// the 4 at which the leapfrog loses its hold. Energy is right at any, since the springs are linear and never let go.
const OMEGA_DT: f64 = 1.0;

/// Ties of a work unit.
const OF_UNIT: usize = 16;

/// A node that is tied to a face.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tie {
    /// Global node; tied once at most.
    pub node: u32,
    /// The face, see [`Face::key`](super::Face::key).
    pub face: u64,
    /// Part of the node and part of the face.
    pub parts: [u32; 2],
    /// Shape functions of the face's corners where the node lies.
    pub weights: [f64; 4],
    /// Stiffness of the spring (force per length).
    pub stiffness: f64,
    /// By the node and the four corners: stiffness of all ties there by its share in them (force per length).
    pub load: [f64; 5],
    /// What it bears, where it can break.
    pub bond: Option<Bond>,
}

impl Tie {
    /// Of the node and the corners, without sign.
    pub(super) fn shares(&self) -> [f64; 5] {
        let [a, b, c, d] = self.weights;
        [1.0, a, b, c, d]
    }
}

/// Units of the ties of which node and face are on the surface.
pub(super) fn units(surface: &Surface, settings: &Settings) -> Vec<WorkUnit> {
    let of_tie = |tie: &Tie| {
        let node = surface.node_index(tie.node).filter(|&n| surface.active[n as usize])?;
        Some([node, surface.face_index(tie.face)?])
    };
    let pairs: Vec<[u32; 2]> = settings.ties.iter().filter_map(of_tie).collect();
    let of_pairs = |(i, pairs): (i32, &[[u32; 2]])| {
        let faces = pairs.iter().flat_map(|&[_, face]| surface.faces[face as usize].nodes);
        let mut nodes: Vec<u32> = pairs.iter().map(|&[node, _]| node).chain(faces).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let interactions = pairs.len() as u64;
        WorkUnit {
            kind: Kind::Tied,
            cube: [i, 0, 0],
            nodes,
            pairs: pairs.to_vec(),
            interactions,
            ..WorkUnit::default()
        }
    };
    (0..).zip(pairs.chunks(OF_UNIT)).map(of_pairs).collect()
}

/// The ties of a batch: batch nodes of each, the tied node first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BatchTies {
    /// One for each tie.
    pub nodes: Vec<[u32; 5]>,
}

impl BatchTies {
    /// Those of units. `node_index` gives the batch node of a surface node.
    pub(super) fn gather(surface: &Surface, units: &[&WorkUnit], node_index: &[u32]) -> Self {
        let pairs = units.iter().filter(|unit| unit.kind == Kind::Tied).flat_map(|unit| &unit.pairs);
        let nodes = pairs.map(|&[node, face]| {
            let [a, b, c, d] = surface.faces[face as usize].nodes;
            [node, a, b, c, d].map(|n| node_index[n as usize])
        });
        Self { nodes: nodes.collect() }
    }

    /// Whether every index is in range.
    pub(super) fn is_sound(&self, n_nodes: usize) -> bool {
        self.nodes.iter().flatten().all(|&node| (node as usize) < n_nodes)
    }
}

/// A tie with its batch nodes.
#[derive(Clone, Copy, Debug)]
struct Spring {
    nodes: [usize; 5],
    weights: [f64; 4],
    stiffness: f64,
    parts: [u32; 2],
    bond: Option<Bond>,
    /// Greatest squared frequency at its nodes, made comparable with that of other springs of contact.
    frequency2: f64,
}

/// The ties of one batch.
#[derive(Clone, Debug, Default)]
pub(super) struct Ties {
    springs: Vec<Spring>,
    /// Of those that cannot break.
    frequency2: f64,
    /// Whether some can.
    any_break: bool,
    /// Where the number of a node is that says whether its tie holds.
    holds_at: usize,
}

impl Ties {
    /// Those of a batch, which must be sound, with the deck's constants.
    pub(super) fn new(batch: &Batch, settings: &Settings) -> Self {
        let mut ties = Self { holds_at: settings.first_of_bond(), ..Self::default() };
        for &nodes in &batch.listed.ties.nodes {
            let global = batch.nodes[nodes[0] as usize].global;
            let Ok(at) = settings.ties.binary_search_by_key(&global, |tie| tie.node) else { continue };
            let Tie { weights, stiffness, parts, load, bond, .. } = settings.ties[at];
            let nodes = nodes.map(|n| n as usize);
            let mut greatest = 0.0_f64;
            for (node, load) in nodes.into_iter().zip(load) {
                let frequency2 = 2.0 * load / batch.nodes[node].mass;
                let comparable = (force::OMEGA_DT / OMEGA_DT).powi(2) * frequency2;
                greatest = greatest.max(comparable);
            }
            ties.springs.push(Spring { nodes, weights, stiffness, parts, bond, frequency2: greatest });
            ties.any_break |= bond.is_some();
            if bond.is_none() {
                ties.frequency2 = ties.frequency2.max(greatest);
            }
        }
        ties
    }
}

impl Pairs for Ties {
    fn n_listed(&self) -> usize {
        self.springs.len()
    }

    fn n_looked_at(&self) -> usize {
        self.springs.len()
    }

    fn reads_velocities(&self) -> bool {
        self.any_break
    }

    #[inline(always)]
    fn forces(&mut self, cycle: &mut Cycle<'_>, Books { vote, by_pair }: &mut Books<'_>) -> f64 {
        let mut frequency2 = self.frequency2;
        for spring in &self.springs {
            let Spring { nodes: [node, corners @ ..], weights, stiffness, parts, .. } = spring;
            let apart = spring.apart(cycle.x);
            if let Some(bond) = &spring.bond {
                let holds = cycle.history.before(*node).get(self.holds_at);
                if holds.is_none_or(|holds| *holds == 0.0) {
                    continue;
                }
                if bond.breaks(apart.map(|along| stiffness * along), spring.normal(cycle.x)) {
                    let taken = cycle.energy_quantum.round(spring.freed(apart, cycle));
                    vote.friction += taken;
                    by_pair.energies.add(parts[0], parts[1], 0.0, taken);
                    continue;
                }
                cycle.history.after_mut(*node)[self.holds_at] = 1.0;
                frequency2 = frequency2.max(spring.frequency2);
            }
            let (mut square, mut on_node) = (0.0, [0.0; 3]);
            for a in 0..3 {
                square = apart[a].mul_add(apart[a], square);
                let force = stiffness * apart[a];
                let f = &mut cycle.f[a];
                let mut sum = 0.0;
                for i in 0..4 {
                    let term = cycle.force_quantum.round(weights[i] * force);
                    f[corners[i]] += term;
                    sum += term;
                }
                f[*node] -= sum;
                on_node[a] = -sum;
                // No corner gets more than all together, but for the rounding of four.
                let bound = force.abs() + 4.0 * cycle.force_quantum.value();
                vote.force_bound = if bound > vote.force_bound { bound } else { vote.force_bound };
            }
            let energy = cycle.energy_quantum.round(0.5 * stiffness * square);
            vote.energy += energy;
            by_pair.energies.add(parts[0], parts[1], energy, 0.0);
            if let Some(tally) = &mut by_pair.forces {
                tally.add((parts[0], parts[1]), on_node);
            }
        }
        frequency2
    }
}

impl Spring {
    /// The node less the point of the face that holds it, of positions or velocities.
    #[inline(always)]
    fn apart(&self, of: &[Vec<f64>; 3]) -> [f64; 3] {
        let [node, corners @ ..] = self.nodes;
        let mut apart = [0.0; 3];
        for (a, x) in of.iter().enumerate() {
            apart[a] = x[node];
            for (corner, weight) in corners.iter().zip(self.weights) {
                apart[a] = (-weight).mul_add(x[*corner], apart[a]);
            }
        }
        apart
    }

    /// Unit normal of the face.
    #[inline(always)]
    fn normal(&self, x: &[Vec<f64>; 3]) -> [f64; 3] {
        let [_, corners @ ..] = self.nodes;
        bond::normal(corners.map(|corner| [x[0][corner], x[1][corner], x[2][corner]]))
    }

    /// Energy that it takes out of the run where it breaks at this elongation: what it held in the cycle before, less the work that its
    /// force of then does in half of the step, `k u_before . u / 2`.
    fn freed(&self, apart: [f64; 3], cycle: &Cycle<'_>) -> f64 {
        let velocity = self.apart(cycle.v);
        let mut product = 0.0;
        for a in 0..3 {
            product = (-cycle.dt).mul_add(velocity[a], apart[a]).mul_add(apart[a], product);
        }
        0.5 * self.stiffness * product
    }
}
