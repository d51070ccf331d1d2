//! What a hit does: penalty force, friction, time-step vote and energies of one node against one face.
//!
//! The force is that of a [spring] along the line of node and closest point, so it has no moment about either, and goes
//! back to the face's corners by its shape functions. Its stiffness comes from static data of the pair alone. All terms
//! are multiples of a quantum, so they add in any order to the same bits; the node gets exactly minus what the
//! corners get, so momentum is conserved to the bit.

use serde::{Deserialize, Serialize};

use crate::exact::Quantum;
use damper::Damped;
use spring::Spring;
use stick::Held;

pub(super) mod damper;
pub(super) mod lanes;
pub(super) mod spring;
pub(super) mod stick;

/// `omega dt` of a node between all its springs at most: the energy of a bounce is then right to 2.6 %.
pub const OMEGA_DT: f64 = 0.4;

/// Springs on a node for each of its own: while it pushes a face, the face's nodes push its own faces.
const BOTH_SIDES: f64 = 2.0;

/// A node in the zone of a face.
#[derive(Clone, Copy, Debug)]
pub struct Push {
    /// Penalty stiffness, the share of the hit included (force per length).
    pub stiffness: f64,
    /// What the penalty spring does at the depth of the node.
    pub spring: Spring<f64>,
    /// Unit vector of the force on the node.
    pub direction: [f64; 3],
    /// Shape functions of the face's corners at the closest point.
    pub weights: [f64; 4],
}

/// Sliding of a node over a face.
#[derive(Clone, Copy, Debug)]
pub struct Sliding {
    /// Coulomb coefficient, positive.
    pub coefficient: f64,
    /// Velocity over which friction is regularised.
    pub regular: f64,
    /// Velocity of the node against the closest point.
    pub velocity: [f64; 3],
    /// Inverse of the mass that the pair moves: `1/m + sum w_i^2/m_i`.
    pub inverse_mass: f64,
    /// Time step, over which work is done.
    pub dt: f64,
}

impl Sliding {
    /// What friction does where the node is pushed with `normal` along `n`: drag (force over velocity), the velocity that
    /// it acts against, and the energy that it takes in the step; none where nothing slides.
    #[inline(always)]
    pub(super) fn drag(&self, normal: f64, n: [f64; 3]) -> Option<(f64, [f64; 3], f64)> {
        let u = self.velocity;
        let across = n[2].mul_add(u[2], n[1].mul_add(u[1], n[0] * u[0]));
        let v = [(-across).mul_add(n[0], u[0]), (-across).mul_add(n[1], u[1]), (-across).mul_add(n[2], u[2])];
        let speed2 = v[2].mul_add(v[2], v[1].mul_add(v[1], v[0] * v[0]));
        let limit = self.coefficient * normal;
        let least = self.regular.max(BOTH_SIDES * limit * self.dt * self.inverse_mass);
        let divisor = speed2.sqrt().max(least);
        if divisor > 0.0 {
            let drag = limit / divisor;
            Some((drag, v, drag * speed2 * self.dt))
        } else {
            None
        }
    }
}

/// Forces of one hit, and the energies to book.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// Force on each corner of the face, in multiples of the force quantum.
    pub corners: [[f64; 3]; 4],
    /// Force on the node: exactly minus the sum of the corners'.
    pub node: [f64; 3],
    /// Energy in the spring and in that across it, in multiples of the energy quantum.
    pub energy: f64,
    /// Energy that friction takes out in this cycle, in multiples of the energy quantum.
    pub friction: f64,
}

/// Stiffness of a pair by moduli: factor times the harmonic mean of both sides (force per length). The factor is the
/// deck's times the node's share.
#[inline(always)]
pub fn stiffness(factor: f64, node: f64, face: f64) -> f64 {
    let sum = node + face;
    if sum > 0.0 { factor * (2.0 * node * face / sum) } else { 0.0 }
}

/// Stiffness of a side by its mass, as [`between`] takes it (force per length).
///
/// A spring between masses m and M swings at `omega^2 = k (1/m + 1/M)`, between all its kind at twice that. With `omega dt = 0.4` it is as stiff
/// as the time step allows, and stops a body of whatever modulus: `k = a b / (a + b)` with `a = 0.16 m / (2 dt^2)`.
pub(super) fn least(mass: f64, step: f64) -> f64 {
    if step > 0.0 { OMEGA_DT * OMEGA_DT / (BOTH_SIDES * step * step) * mass } else { 0.0 }
}

/// Penalty stiffness of a pair: that of moduli, or that of masses ([`least`]) where it is greater (force per length).
#[inline(always)]
pub(super) fn between(factor: f64, [node, face]: [f64; 2], [node_least, face_least]: [f64; 2]) -> f64 {
    let (by_moduli, by_masses) = (stiffness(factor, node, face), stiffness(0.5, node_least, face_least));
    if by_masses > by_moduli { by_masses } else { by_moduli }
}

/// Inverse of the mass that a pair moves: `1/m + sum w_i^2/m_i`, from inverse masses.
#[inline(always)]
pub fn inverse_mass(node: f64, corners: [f64; 4], weights: &[f64; 4]) -> f64 {
    let mut sum = node;
    for i in 0..4 {
        sum = (weights[i] * weights[i]).mul_add(corners[i], sum);
    }
    sum
}

/// Square of the frequency of `stacking` springs of this stiffness on one node.
#[inline(always)]
pub fn frequency2(stiffness: f64, stacking: f64, inverse_mass: f64) -> f64 {
    BOTH_SIDES * stacking * stiffness * inverse_mass
}

/// Longest time step for springs of this greatest squared frequency: `0.4 / omega`; infinite for none.
pub fn time_step(frequency2: f64) -> f64 {
    OMEGA_DT / frequency2.sqrt()
}

/// Force, energy and friction of one hit.
///
/// Friction is Coulomb's, regularised: `F_t = -mu F_n v_t / max(|v_t|, v_reg)`. It creeps instead of sticking.
/// So that friction never turns sliding round within a step, `v_reg` is at least `2 mu F_n dt (1/m + ...)`. It
/// acts at the closest point on the face and at the node, a moment of `F_t` times their distance.
#[inline(always)]
pub fn react(
    push: &Push,
    sliding: Option<&Sliding>,
    (force_quantum, energy_quantum): (Quantum, Quantum),
    cycle: u64,
) -> Reaction {
    let normal = push.spring.force;
    let n = push.direction;
    let mut force = [normal * n[0], normal * n[1], normal * n[2]];
    let mut friction = 0.0;
    if let Some((drag, v, taken)) = sliding.and_then(|sliding| sliding.drag(normal, n)) {
        for a in 0..3 {
            force[a] = (-drag).mul_add(v[a], force[a]);
        }
        friction = energy_quantum.dithered(cycle).round(taken);
    }
    let energy = energy_quantum.round(push.spring.energy);
    reaction(push, force, energy, friction, force_quantum)
}

/// The same with a push that is damped and friction that sticks.
#[inline(always)]
pub(super) fn react_held(
    push: &Push,
    damped: &Damped,
    held: &Held,
    (force_quantum, energy_quantum): (Quantum, Quantum),
    cycle: u64,
) -> Reaction {
    let mut force = [0.0; 3];
    for a in 0..3 {
        force[a] = damped.normal.mul_add(push.direction[a], held.force[a]);
    }
    let energy = energy_quantum.round(push.spring.energy + held.stored);
    let taken = energy_quantum.dithered(cycle).round(damped.taken + held.taken);
    reaction(push, force, energy, taken, force_quantum)
}

/// Puts the force of a hit on its node and corners.
#[inline(always)]
fn reaction(push: &Push, force: [f64; 3], energy: f64, friction: f64, force_quantum: Quantum) -> Reaction {
    let mut corners = [[0.0; 3]; 4];
    let mut node = [0.0; 3];
    for a in 0..3 {
        for (corner, w) in corners.iter_mut().zip(push.weights) {
            corner[a] = force_quantum.round(-(w * force[a]));
        }
        node[a] = -((corners[0][a] + corners[1][a]) + (corners[2][a] + corners[3][a]));
    }
    Reaction { corners, node, energy, friction }
}

/// What the contact of a batch says about the cycle. Merging does not depend on the order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactVote {
    /// Energy in all penalty springs, an exact sum.
    pub energy: f64,
    /// Energy that friction takes out this cycle, an exact sum.
    pub friction: f64,
    /// Greatest depth of any hit over the gap; from 0.9 the run must stop.
    pub worst_depth: f64,
    /// Global node and face id of the deepest hit, the lowest of equals; `u32::MAX` without hits.
    pub worst_pair: (u32, u32),
    /// Longest time step the penalty springs allow; infinite without a pair near.
    pub dt: f64,
    /// Greatest component of any force term, for the rescale vote.
    pub force_bound: f64,
    /// Pairs on the candidate list.
    pub pairs: u64,
    /// Hits: distinct closest features with a node in their zone.
    pub hits: u64,
}

impl ContactVote {
    /// Its numbers, for tests that flip bits in them.
    pub(crate) fn numbers_mut(&mut self) -> [&mut f64; 5] {
        let Self { energy, friction, worst_depth, dt, force_bound, .. } = self;
        [energy, friction, worst_depth, dt, force_bound]
    }
}

impl Default for ContactVote {
    fn default() -> Self {
        Self {
            energy: 0.0,
            friction: 0.0,
            worst_depth: 0.0,
            worst_pair: (u32::MAX, u32::MAX),
            dt: f64::INFINITY,
            force_bound: 0.0,
            pairs: 0,
            hits: 0,
        }
    }
}

impl ContactVote {
    /// Takes in the vote of another batch.
    pub fn merge(&mut self, other: &Self) {
        self.energy += other.energy;
        self.friction += other.friction;
        self.deepest(other.worst_depth, other.worst_pair);
        self.dt = self.dt.min(other.dt);
        self.force_bound = self.force_bound.max(other.force_bound);
        self.pairs += other.pairs;
        self.hits += other.hits;
    }

    /// Takes in the depth over the gap of one pair.
    #[inline(always)]
    pub fn deepest(&mut self, depth: f64, pair: (u32, u32)) {
        if depth > self.worst_depth || (depth == self.worst_depth && pair < self.worst_pair) {
            self.worst_depth = depth;
            self.worst_pair = pair;
        }
    }

    /// Takes in the forces and energies of one hit.
    #[inline(always)]
    pub fn count(&mut self, reaction: &Reaction) {
        self.energy += reaction.energy;
        self.friction += reaction.friction;
        // Weights are positive and add to one, so no corner's term exceeds the node's.
        for component in reaction.node {
            let magnitude = component.abs();
            self.force_bound = if magnitude > self.force_bound { magnitude } else { self.force_bound };
        }
    }
}
