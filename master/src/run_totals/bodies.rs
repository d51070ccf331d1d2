//! Energy by body. A body is a set of parts that share nodes, are rigid together or have touched; nothing else has.
//!
//! What a part gives another by contact is known for the pair alone: their springs hold it, or friction took it. So the account of
//! a part closes only together with all that it has touched, and that of a body always: its kinetic, internal, hourglass and eroded
//! energy, and that of the contacts inside it, less the work done on it from outside. A small body that gains energy shows there, however
//! large the run is.

use deck::model::Model;
use serde::{Deserialize, Serialize};

use super::RunTotals;
use crate::results::history::PartEnergy;

/// What a part is judged by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartScale {
    pub greatest_kinetic: f64,
    /// Greatest size of the work done on it.
    pub greatest_external: f64,
    /// The first cycle in which it had energy or work was done on it.
    pub first_stirred: Option<u64>,
}

impl PartScale {
    pub(super) fn book(&mut self, part: &PartEnergy, cycle: u64) {
        self.greatest_kinetic = self.greatest_kinetic.max(part.kinetic);
        self.greatest_external = self.greatest_external.max(part.external.abs());
        if part.kinetic != 0.0 || part.internal != 0.0 || part.external != 0.0 {
            self.first_stirred.get_or_insert(cycle);
        }
    }
}

/// The energy error of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyError {
    /// Its parts, ascending.
    pub parts: Vec<usize>,
    /// Energy that appeared in it since the first cycle; negative where it vanished.
    pub gain: f64,
    /// That over the greatest of what it had first, of its kinetic energies, and of the work done on it.
    pub error: f64,
    /// The latest cycle in which one of its parts was first stirred; none while all are at rest.
    pub first_stirred: Option<u64>,
}

/// By part, the lowest part that it shares nodes with or is rigid with, over others too.
pub(super) fn joined(model: &Model) -> Vec<usize> {
    let mut roots: Vec<usize> = (0..model.mesh.parts.len()).collect();
    let mut part_of = vec![usize::MAX; model.mesh.n_nodes()];
    for (p, part) in model.mesh.parts.iter().enumerate() {
        for &node in &part.nodes {
            let other = std::mem::replace(&mut part_of[node as usize], p);
            if other != usize::MAX {
                join(&mut roots, other, p);
            }
        }
    }
    for switch in &model.setup.switches {
        switch.parts.windows(2).for_each(|pair| join(&mut roots, pair[0] as usize, pair[1] as usize));
    }
    for body in &model.setup.bodies {
        body.parts.windows(2).for_each(|pair| join(&mut roots, pair[0] as usize, pair[1] as usize));
        // What shares nodes with a rigid body is moved by it.
        for part in body.nodes.iter().map(|&node| part_of[node as usize]).filter(|&part| part != usize::MAX) {
            join(&mut roots, body.account as usize, part);
        }
    }
    // Joints pass on energy that nobody books.
    for joint in &model.setup.joints {
        if let [Some(a), Some(b)] = joint.ends.map(|end| end.body) {
            let [a, b] = [a, b].map(|body| model.setup.bodies[body as usize].account as usize);
            join(&mut roots, a, b);
        }
    }
    (0..roots.len()).map(|p| root(&roots, p)).collect()
}

/// The lowest part of the body of a part.
fn root(roots: &[usize], mut part: usize) -> usize {
    while roots[part] != part {
        part = roots[part];
    }
    part
}

fn join(roots: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(roots, a), root(roots, b));
    roots[a.max(b)] = a.min(b);
}

impl RunTotals {
    /// The bodies as far as parts have touched, by their lowest part, and their energy errors; none before the first cycle.
    pub fn bodies(&self) -> Vec<BodyError> {
        let [first, now] = &self.parts;
        let mut roots = self.joined.clone();
        for pair in &self.contacts {
            join(&mut roots, pair.parts[0] as usize, pair.parts[1] as usize);
        }
        let mut bodies: Vec<BodyError> = Vec::new();
        let mut place = vec![usize::MAX; roots.len()];
        // By body: what it had first, its kinetic energies, work.
        let mut scales: Vec<[f64; 3]> = Vec::new();
        for (p, (first, now)) in first.iter().zip(now).enumerate() {
            let of = root(&roots, p);
            if of == p {
                place[p] = bodies.len();
                bodies.push(BodyError { parts: Vec::new(), gain: 0.0, error: 0.0, first_stirred: None });
                scales.push([0.0; 3]);
            }
            let (body, sums, scale) = (&mut bodies[place[of]], &mut scales[place[of]], &self.scales[p]);
            body.parts.push(p);
            body.gain += now.own() - first.own();
            body.first_stirred = body.first_stirred.max(scale.first_stirred);
            for (sum, term) in
                sums.iter_mut().zip([first.own(), scale.greatest_kinetic, scale.greatest_external])
            {
                *sum += term;
            }
        }
        for pair in &self.contacts {
            if let Some(body) = bodies.get_mut(place[root(&roots, pair.parts[0] as usize)]) {
                body.gain += pair.contact + pair.friction + pair.eroded - pair.first;
            }
        }
        for (body, sums) in bodies.iter_mut().zip(scales) {
            let scale = sums.into_iter().map(f64::abs).fold(0.0, f64::max);
            body.error = if scale > 0.0 { body.gain / scale } else { 0.0 };
        }
        bodies
    }
}
