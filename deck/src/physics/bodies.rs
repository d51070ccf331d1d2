//! Bodies: parts that hang together by shared nodes, ties or rigid bodies, and when two of them meet if nothing turns them aside.

use mechanics::{
    contact::ROUNDING,
    wall::{Motion, Shape},
};

use super::Measured;
use crate::{
    geometry::{dot, norm, sub},
    model::Model,
};

/// Parts that hang together, with the box around them.
pub(super) struct Body {
    /// Indices of its parts, ascending.
    pub(super) parts: Vec<usize>,
    pub(super) low: [f64; 3],
    pub(super) high: [f64; 3],
    /// The velocity at which all of it starts; none where its nodes start at several.
    pub(super) velocity: Option<[f64; 3]>,
}

/// The bodies of a model, by their first part.
pub(super) fn of(model: &Model, measured: &[Measured]) -> Vec<Body> {
    let n = measured.len();
    let mut root: Vec<usize> = (0..n).collect();
    let mut unite = |a: usize, b: usize| {
        let (from, to) = (root[a].max(root[b]), root[a].min(root[b]));
        root.iter_mut().filter(|r| **r == from).for_each(|r| *r = to);
    };
    let mut holder = vec![usize::MAX; model.mesh.n_nodes()];
    for (p, part) in model.mesh.parts.iter().enumerate() {
        for &node in &part.nodes {
            let first = &mut holder[node as usize];
            if *first == usize::MAX {
                *first = p;
            } else if *first != p {
                unite(*first, p);
            }
        }
    }
    for body in &model.setup.bodies {
        body.parts.iter().for_each(|&p| unite(body.parts[0] as usize, p as usize));
    }
    for tie in model.setup.contact.iter().flat_map(|contact| &contact.ties) {
        unite(tie.parts[0] as usize, tie.parts[1] as usize);
    }
    let body = |first: usize| {
        let parts: Vec<usize> = (first..n).filter(|&p| root[p] == first).collect();
        let end = |pick: fn(f64, f64) -> f64, side: fn(&Measured) -> [f64; 3]| {
            std::array::from_fn(|a| parts.iter().map(|&p| side(&measured[p])[a]).reduce(pick).unwrap_or(0.0))
        };
        let (low, high) = (end(f64::min, |m| m.low), end(f64::max, |m| m.high));
        let velocity = measured[first].velocity;
        let alike = |&p: &usize| {
            let even = 1e-6 * measured[p].fastest.max(measured[first].fastest);
            let apart = sub(measured[p].velocity, velocity);
            measured[p].translates && dot(apart, apart).sqrt() <= even
        };
        let velocity = parts.iter().all(alike).then_some(velocity);
        Body { parts, low, high, velocity }
    };
    (0..n).filter(|&p| root[p] == p).map(body).collect()
}

impl Body {
    /// The sides of its box, shortest first.
    pub(super) fn sides(&self) -> [f64; 3] {
        let mut sides = sub(self.high, self.low);
        sides.sort_by(f64::total_cmp);
        sides
    }

    /// The names of its parts.
    pub(super) fn name(&self, model: &Model) -> String {
        let names: Vec<String> =
            self.parts.iter().take(3).map(|&p| format!("\"{}\"", model.mesh.parts[p].name)).collect();
        let kind = if self.parts.len() == 1 { "part" } else { "parts" };
        format!("{kind} {}{}", names.join(", "), if self.parts.len() > 3 { " and others" } else { "" })
    }

    /// When its box comes `within` a distance of that of another, both going on as they start; never, if they pass each other or part.
    pub(super) fn meets(&self, other: &Self, relative: [f64; 3], within: f64) -> Option<f64> {
        let (mut from, mut to) = (0.0_f64, f64::INFINITY);
        for a in 0..3 {
            let (gap, depth) = (other.low[a] - self.high[a] - within, other.high[a] - self.low[a] + within);
            let v = relative[a];
            if v == 0.0 {
                if gap > 0.0 || depth < 0.0 {
                    return None;
                }
                continue;
            }
            let times = [gap / v, depth / v];
            from = from.max(times[0].min(times[1]));
            to = to.min(times[0].max(times[1]));
        }
        // Boxes that touch and part have met, and do no more.
        (from <= to && to * norm(relative) > ROUNDING * within).then_some(from)
    }

    /// When it comes to a wall that it feels; at once where that cannot be told.
    pub(super) fn meets_wall(&self, model: &Model, velocity: [f64; 3]) -> Option<f64> {
        let felt = model.setup.walls.iter().enumerate().filter(|(w, wall)| {
            let by_node = |&p: &usize| {
                let nodes = &model.mesh.parts[p].nodes;
                nodes.iter().any(|&n| {
                    let held = model.setup.constraints[model.constraint[n as usize] as usize];
                    held.walls >> w & 1 == 1
                })
            };
            self.parts.iter().any(|&p| wall.parts[p]) || self.parts.iter().any(by_node)
        });
        let time = |(_, wall): (usize, &mechanics::wall::RigidWall)| {
            let Shape::Plane { point, normal } = wall.shape else { return Some(0.0) };
            let approach = match wall.motion {
                Motion::Fixed => -dot(velocity, normal),
                Motion::Free { velocity: of_wall, .. } => dot(sub(of_wall, velocity), normal),
                Motion::Driven(_) => return Some(0.0),
            };
            let nearest: f64 = (0..3)
                .map(|a| {
                    let x = if normal[a] > 0.0 { self.low[a] } else { self.high[a] };
                    (x - point[a]) * normal[a]
                })
                .sum();
            (approach > 0.0).then(|| nearest.max(0.0) / approach)
        };
        felt.filter_map(time).min_by(f64::total_cmp)
    }
}
