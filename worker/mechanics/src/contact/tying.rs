//! Which nodes lie on faces of another part before the first cycle, and the ties of these.

use std::collections::BTreeMap;

use super::{
    Settings, bond, force,
    initial_pairs::initial_pairs,
    surface::Surface,
    ties::Tie,
    zone::{Frame, dot},
};

/// A node on a face: surface indices, shape functions, the point and the distance from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnFace {
    /// Surface node.
    pub node: u32,
    /// Surface face.
    pub face: u32,
    /// Shape functions of its corners.
    pub weights: [f64; 4],
    /// The closest point of the face (length).
    pub at: [f64; 3],
    /// Distance of the node from it (length).
    pub distance: f64,
}

/// The nodes of a part that lie within `distance` of faces of another, each with the nearest of these, by node. `settings` have
/// this distance as their gap, and let the two parts interact and no others. `x` by surface node.
pub fn on_faces(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    [nodes, faces]: [u32; 2],
) -> Vec<OnFace> {
    let outward = outward(surface, x);
    let against = |node: u32, face: u32| {
        dot(outward[node as usize], bond::unit(bond::area_of(x, &surface.faces[face as usize])))
    };
    let mut nearest: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
    for (node, face, distance) in initial_pairs(surface, x, settings) {
        let of = (surface.node_part[node as usize], surface.faces[face as usize].part);
        if of == (nodes, faces) {
            let best = nearest.entry(node).or_insert((distance, face));
            let (even, own) = (EVEN * settings.gap, outward[node as usize]);
            // On the rim of a body several faces are as near: the one that looks at the node's own is meant.
            let faces_it =
                || against(node, face) < EVEN.mul_add(-dot(own, own).sqrt(), against(node, best.1));
            if distance < best.0 - even || (distance < best.0 + even && faces_it()) {
                *best = (distance, face);
            }
        }
    }
    let place = |(node, (distance, face)): (u32, (f64, u32))| {
        let corners = surface.faces[face as usize].nodes.map(|n| x[n as usize]);
        let (frame, p) = (Frame::new(&corners), x[node as usize]);
        let weights = frame.weights(&frame.nearest(p), p);
        let at = std::array::from_fn(|a| (0..4).fold(0.0, |sum, i| weights[i].mul_add(corners[i][a], sum)));
        OnFace { node, face, weights, at, distance }
    };
    nearest.into_iter().map(place).collect()
}

/// Distances, over the gap, and areas, over that of a node, that differ by less are equal.
const EVEN: f64 = 1e-6;

/// Sum of the area vectors of the faces around each node.
fn outward(surface: &Surface, x: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut outward = vec![[0.0; 3]; surface.nodes.len()];
    for face in &surface.faces {
        let area = bond::area_of(x, face);
        for n in face.nodes {
            (0..3).for_each(|a| outward[n as usize][a] += area[a]);
        }
    }
    outward
}

/// The ties of nodes on faces, by node. Stiffness is the harmonic mean of both sides' `K A^2 / V`, of which the node takes its share.
pub fn tie(surface: &Surface, found: &[OnFace]) -> Vec<Tie> {
    let mut ties: Vec<Tie> = found
        .iter()
        .map(|on| {
            let (n, face) = (on.node as usize, &surface.faces[on.face as usize]);
            Tie {
                node: surface.nodes[n],
                face: face.key(),
                parts: [surface.node_part[n], face.part],
                weights: on.weights,
                stiffness: force::stiffness(surface.node_share[n], surface.node_stiffness[n], face.stiffness),
                load: [0.0; 5],
                bond: None,
            }
        })
        .collect();
    let ends = |on: &OnFace| {
        let [a, b, c, d] = surface.faces[on.face as usize].nodes;
        [on.node, a, b, c, d]
    };
    let mut load = vec![0.0; surface.nodes.len()];
    for (on, tie) in found.iter().zip(&ties) {
        for (node, share) in ends(on).into_iter().zip(tie.shares()) {
            load[node as usize] += tie.stiffness * share;
        }
    }
    for (on, tie) in found.iter().zip(&mut ties) {
        tie.load = ends(on).map(|node| load[node as usize]);
    }
    ties.sort_unstable_by_key(|tie| tie.node);
    ties
}
