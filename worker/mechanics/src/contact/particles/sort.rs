//! Which particles may meet before the next sort.
//!
//! A pair is kept if the parts press on each other and if along each axis both are no farther apart than their whole balls, the distance within which they
//! limit the time step, and the slack: then it is on the list for as long as those of nodes and faces are good, by the same rule on
//! displacements. Particles are put into cubes of which each reaches no farther than the next; all pairs of one are in the unit of its cube.

use super::{
    super::{Settings, pair::Kind, surface::Surface, work_unit::WorkUnit},
    Particle,
};

/// Greatest cube index along an axis: three of them fit one key.
const MAX_CUBE: f64 = 2_097_000.0;

/// Units of particles that may meet others before the next sort, by cube; none without any. `x` by surface node.
pub(in super::super) fn units(surface: &Surface, x: &[[f64; 3]], settings: &Settings) -> Vec<WorkUnit> {
    if !settings.any_particles() || surface.particles.len() < 2 {
        return Vec::new();
    }
    let at = |particle: &Particle| x[particle.node as usize];
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut largest = 0.0_f64;
    for particle in &surface.particles {
        let p = at(particle);
        for a in 0..3 {
            low[a] = low[a].min(p[a]);
            high[a] = high[a].max(p[a]);
        }
        largest = largest.max(particle.radius);
    }
    let beyond = settings.ahead_of_particles() + settings.slack;
    // A little more than the reach, so that no rounding takes a pair two cubes apart.
    let reach = 1.001 * 2.0_f64.mul_add(largest, beyond);
    let side = (0..3).map(|a| (high[a] - low[a]) / MAX_CUBE).fold(reach, f64::max);
    let cube = |p: [f64; 3]| [0, 1, 2].map(|a| ((p[a] - low[a]) / side).floor() as i32);
    // Along x the cubes of a row follow each other.
    let key = |[i, j, k]: [i32; 3]| [k, j, i];
    let mut held: Vec<([i32; 3], u32)> =
        (0..).zip(&surface.particles).map(|(i, particle)| (key(cube(at(particle))), i)).collect();
    held.sort_unstable();
    let row = |j: i32, k: i32, i: i32| {
        let first = held.partition_point(|(other, _)| *other < key([i - 1, j, k]));
        let n = held[first..].partition_point(|(other, _)| *other <= key([i + 1, j, k]));
        &held[first..first + n]
    };
    let meet = |a: &Particle, b: &Particle| {
        let (p, q) = (at(a), at(b));
        let reach = a.radius + b.radius + beyond;
        let [part_a, part_b] = [a, b].map(|particle| surface.node_part[particle.node as usize]);
        (0..3).all(|axis| (p[axis] - q[axis]).abs() <= reach) && settings.presses(part_a, part_b)
    };
    let mut units = Vec::new();
    for same in held.chunk_by(|a, b| a.0 == b.0) {
        let [k, j, i] = same[0].0;
        let mut around: Vec<u32> = Vec::new();
        for (k, j) in (k - 1..=k + 1).flat_map(|k| (j - 1..=j + 1).map(move |j| (k, j))) {
            around.extend(row(j, k, i).iter().map(|(_, particle)| *particle));
        }
        around.sort_unstable();
        let mut pairs = Vec::new();
        for &(_, own) in same {
            let particle = &surface.particles[own as usize];
            let others = around.iter().filter(|other| **other != own);
            let others = others.map(|&other| &surface.particles[other as usize]);
            pairs.extend(
                others.filter(|other| meet(particle, other)).map(|other| [particle.node, other.node]),
            );
        }
        if pairs.is_empty() {
            continue;
        }
        let mut nodes: Vec<u32> = pairs.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let interactions = pairs.len() as u64;
        units.push(WorkUnit {
            kind: Kind::Particles,
            cube: [i, j, k],
            nodes,
            pairs,
            interactions,
            ..WorkUnit::default()
        });
    }
    units
}
