//! Edge pairs of a batch in one cycle: from positions to forces, votes and energies.

use super::{
    super::{
        BatchEdge, Settings, WARNING,
        batch::Batch,
        force::{self, damper::Damper, spring::Hardening},
        pair::{Books, Cycle, Pairs},
        zone::Vector,
    },
    EDGE,
    zone::{self, Closest},
};

/// An edge with what its pairs need.
#[derive(Clone, Copy, Debug)]
struct Side {
    nodes: [u32; 2],
    /// Global number of its first node.
    name: u32,
    part: u32,
    inverse_mass: [f64; 2],
}

/// Two edges that may meet.
#[derive(Clone, Copy, Debug)]
struct Pair {
    sides: [u32; 2],
    /// Penalty stiffness (force per length).
    stiffness: f64,
    friction: f64,
}

/// The edge pairs of one batch.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Edges {
    sides: Vec<Side>,
    pairs: Vec<Pair>,
    gap: f64,
    hardening: Hardening,
    friction_velocity: f64,
    /// Whether friction sticks, so that pushes are damped (edges themselves do not stick).
    sticks: bool,
}

impl Edges {
    /// Those of a batch, which must be sound.
    pub(in super::super) fn new(batch: &Batch, settings: &Settings) -> Self {
        let sides: Vec<Side> = batch
            .listed
            .edges
            .edges
            .iter()
            .map(|edge| Side {
                nodes: edge.nodes,
                name: batch.nodes[edge.nodes[0] as usize].global,
                part: edge.part,
                inverse_mass: edge.nodes.map(|n| 1.0 / batch.nodes[n as usize].mass),
            })
            .collect();
        let n_parts = settings.n_parts();
        let pair = |&sides: &[u32; 2]| {
            let [a, b] = sides.map(|side| &batch.listed.edges.edges[side as usize]);
            let factor = settings.stiffness * a.share.min(b.share);
            let lightest = |edge: &BatchEdge| {
                edge.nodes.map(|n| batch.nodes[n as usize].mass).into_iter().fold(f64::INFINITY, f64::min)
            };
            let least = [a, b].map(|edge| settings.least(edge.part, lightest(edge)));
            Pair {
                sides,
                stiffness: force::between(factor, [a.stiffness, b.stiffness], least),
                friction: settings.friction[a.part as usize * n_parts + b.part as usize],
            }
        };
        let pairs = batch.listed.edges.pairs.iter().map(pair).collect();
        Self {
            sides,
            pairs,
            gap: settings.gap,
            hardening: Hardening::of(settings.gap),
            friction_velocity: settings.friction_velocity,
            sticks: settings.any_sticks(),
        }
    }

    /// Inverse of the mass that a pair moves, where the closest points may be soon: a gap nearer to the ends.
    #[inline(always)]
    fn inverse_mass(&self, closest: &Closest, sides: [&Side; 2]) -> f64 {
        let mut sum = 0.0;
        for i in 0..2 {
            let margin = self.gap / closest.lengths[i];
            let s = closest.at[i];
            let s = if s < 0.5 { (s - margin).max(0.0) } else { (s + margin).min(1.0) };
            let [a, b] = sides[i].inverse_mass;
            sum += (s * s).mul_add(b, (1.0 - s) * (1.0 - s) * a);
        }
        sum
    }

    /// Force, energy and depth of a pair in its zone.
    #[inline(always)]
    fn push(
        &self,
        pair: &Pair,
        sides: [&Side; 2],
        nodes: [usize; 4],
        closest: &Closest,
        cycle: &mut Cycle<'_>,
        Books { vote, by_pair }: &mut Books<'_>,
    ) {
        let weight = closest.weight(self.gap);
        if weight.value <= 0.0 {
            return;
        }
        let ([s, t], distance) = (closest.at, closest.distance2.sqrt());
        let shares = [1.0 - s, s, -(1.0 - t), -t];
        let names = (sides[0].name, EDGE | sides[1].name);
        if distance <= 1e-9 * self.gap {
            // The line has no direction: no force, and a depth at which the run ends.
            vote.deepest(1.0, names);
            return;
        }
        let n = closest.vector.map(|c| c / distance);
        let velocity = relative(cycle.v, nodes, shares);
        let closing = dot(n, velocity) * cycle.dt;
        let mut depth = self.gap - distance;
        if closing > distance && crossed(cycle, nodes) {
            depth = self.gap + distance;
        }
        vote.hits += 1;
        vote.deepest(depth / self.gap, names);
        let depth = self.gap - distance;
        let spring = self.hardening.spring_of_one(pair.stiffness, depth);
        let mut normal = weight.value * spring.force;
        let (mut drag, mut taken) = (None, 0.0);
        if pair.friction > 0.0 {
            let inverse_mass = sides[0].inverse_mass.iter().chain(&sides[1].inverse_mass);
            let inverse_mass: f64 = inverse_mass.zip(shares).map(|(m, share)| m * (share * share)).sum();
            if self.sticks {
                let stiffness = weight.value * pair.stiffness;
                let damper = Damper { stiffness, inverse_mass, gap: self.gap, velocity, dt: cycle.dt };
                let damped = damper.of(normal, n);
                (normal, taken) = (damped.normal, damped.taken);
            }
            let sliding = force::Sliding {
                coefficient: pair.friction,
                regular: self.friction_velocity,
                velocity,
                inverse_mass,
                dt: cycle.dt,
            };
            drag = sliding.drag(normal, n);
        }
        let mut force = [normal * n[0], normal * n[1], normal * n[2]];
        if let Some((drag, v, by_sliding)) = drag {
            for a in 0..3 {
                force[a] = (-drag).mul_add(v[a], force[a]);
            }
            taken += by_sliding;
        }
        let friction = cycle.energy_quantum.dithered(cycle.history.cycle).round(taken);
        let energy = spring.energy;
        let [mut of_u, mut of_v] = [[0.0; 3]; 2];
        if let Some([along, by_u, by_v]) = weight.slopes {
            for a in 0..3 {
                force[a] = (-energy).mul_add(along[a], force[a]);
                of_u[a] = -(energy * by_u[a]);
                of_v[a] = -(energy * by_v[a]);
            }
        }
        let quantum = cycle.force_quantum;
        let mut on_first = [0.0; 3];
        for a in 0..3 {
            let terms = [
                quantum.round(shares[0].mul_add(force[a], -of_u[a])),
                quantum.round(shares[1].mul_add(force[a], of_u[a])),
                quantum.round(shares[2].mul_add(force[a], -of_v[a])),
            ];
            let last = -((terms[0] + terms[1]) + terms[2]);
            on_first[a] = terms[0] + terms[1];
            let f = &mut cycle.f[a];
            f[nodes[0]] += terms[0];
            f[nodes[1]] += terms[1];
            f[nodes[2]] += terms[2];
            f[nodes[3]] += last;
            for term in [terms[0], terms[1], terms[2], last] {
                let magnitude = term.abs();
                vote.force_bound = if magnitude > vote.force_bound { magnitude } else { vote.force_bound };
            }
        }
        let energy = cycle.energy_quantum.round(weight.value * energy);
        vote.energy += energy;
        vote.friction += friction;
        by_pair.energies.add(sides[0].part, sides[1].part, energy, friction);
        if let Some(tally) = &mut by_pair.forces {
            tally.add((sides[0].part, sides[1].part), on_first);
        }
    }
}

impl Pairs for Edges {
    fn n_listed(&self) -> usize {
        self.pairs.len()
    }

    fn n_looked_at(&self) -> usize {
        self.pairs.len()
    }

    fn reads_velocities(&self) -> bool {
        !self.pairs.is_empty()
    }

    #[inline(always)]
    fn forces(&mut self, cycle: &mut Cycle<'_>, books: &mut Books<'_>) -> f64 {
        let warning = WARNING * self.gap;
        let mut frequency2 = 0.0_f64;
        for pair in &self.pairs {
            let sides = [&self.sides[pair.sides[0] as usize], &self.sides[pair.sides[1] as usize]];
            let [[a, b], [c, d]] = [sides[0].nodes, sides[1].nodes];
            let nodes = [a as usize, b as usize, c as usize, d as usize];
            if are_apart(cycle.x, nodes, warning) {
                continue;
            }
            let x = nodes.map(|n| at(cycle.x, n));
            let Some(closest) = zone::closest(&x) else { continue };
            if closest.distance2 >= warning * warning {
                continue;
            }
            let inverse_mass = self.inverse_mass(&closest, sides);
            let depth = self.gap - closest.distance2.sqrt();
            let tangent = pair.stiffness * self.hardening.tangent_of_one(depth);
            let stiffness = tangent * closest.weight_ahead(self.gap);
            let voted = force::frequency2(stiffness, 1.0, inverse_mass);
            frequency2 = if voted > frequency2 { voted } else { frequency2 };
            if closest.crosses && closest.distance2 < self.gap * self.gap {
                self.push(pair, sides, nodes, &closest, cycle, books);
            }
        }
        frequency2
    }
}

#[inline(always)]
fn at(x: &[Vec<f64>; 3], n: usize) -> Vector {
    [x[0][n], x[1][n], x[2][n]]
}

#[inline(always)]
fn dot(a: Vector, b: Vector) -> f64 {
    super::super::zone::dot(a, b)
}

/// Whether the boxes of two edges are more than `within` apart along some axis.
#[inline(always)]
fn are_apart(x: &[Vec<f64>; 3], [a, b, c, d]: [usize; 4], within: f64) -> bool {
    let least = |p: f64, q: f64| if p < q { p } else { q };
    let most = |p: f64, q: f64| if p > q { p } else { q };
    let mut apart = false;
    for x in x {
        let (p, q, r, s) = (x[a], x[b], x[c], x[d]);
        apart |= (least(r, s) - most(p, q) > within) | (least(p, q) - most(r, s) > within);
    }
    apart
}

/// Velocity of the first closest point against the second: shares of the four nodes.
#[inline(always)]
fn relative(v: &[Vec<f64>; 3], nodes: [usize; 4], shares: [f64; 4]) -> Vector {
    let mut sum = [0.0; 3];
    for a in 0..3 {
        for i in 0..4 {
            sum[a] = shares[i].mul_add(v[a][nodes[i]], sum[a]);
        }
    }
    sum
}

/// Whether two edges whose closest points have passed each other in the last step crossed before it too: then one has gone
/// through the other. The motion before may have been beside the ends of one.
#[inline(never)]
fn crossed(cycle: &Cycle<'_>, nodes: [usize; 4]) -> bool {
    let before = nodes.map(|n| {
        let (x, v) = (at(cycle.x, n), at(cycle.v, n));
        [0, 1, 2].map(|a| (-cycle.dt).mul_add(v[a], x[a]))
    });
    zone::closest(&before).is_some_and(|closest| closest.crosses)
}
