//! Joints: their bodies by the nodes of the cards.

use std::collections::BTreeMap;

use mechanics::joint::Kind;

use super::{rigid, state::Translation};
use crate::{
    geometry::{norm, sub},
    keyword::{condition::Target, joint::JointCard, rigid::BodyNodes},
    place::{Place, Placed},
    typed::condition::{Joint, made},
};

/// Two nodes of a joint are in one place up to this share of their distance from the origin.
const NEAR: f64 = 1e-6;

pub(super) fn write(t: &mut Translation<'_>) {
    if t.problem.joints.is_empty() {
        return;
    }
    let bodies = bodies_of_nodes(t);
    for card in &t.problem.joints {
        t.deck.joints.extend(joint(t, card, &bodies));
    }
}

/// The name of the body that has a node.
fn bodies_of_nodes(t: &Translation<'_>) -> BTreeMap<u32, String> {
    let problem = t.problem;
    let mut bodies = BTreeMap::new();
    for ((id, _), body) in t.names.iter().zip(&t.mesh.bodies) {
        let Some(lead) = t.bodies.of(*id) else { continue };
        bodies.extend(body.corners().map(|node| (node, t.names[&lead].clone())));
    }
    // Nodes without elements may go with a body, so that a joint has a place.
    for given in &problem.rigid.extra {
        let Some(lead) = t.bodies.of(given.part) else { continue };
        let nodes = match given.target {
            Target::NodeSet(set) => problem.node_set(set, given.at, t.log),
            Target::Node(node) => vec![node],
            _ => Vec::new(),
        };
        bodies.extend(nodes.into_iter().map(|node| (node, t.names[&lead].clone())));
    }
    for given in &problem.rigid.of_nodes {
        let nodes = match given.nodes {
            BodyNodes::Set(set) => problem.node_set(set, given.at, t.log),
            BodyNodes::Pair(pair) => pair.to_vec(),
        };
        bodies.extend(nodes.into_iter().map(|node| (node, rigid::title_of(given))));
    }
    bodies
}

fn joint(t: &Translation<'_>, card: &JointCard, bodies: &BTreeMap<u32, String>) -> Option<Joint> {
    let (at, log) = (card.at, t.log);
    let position = |node: u32| {
        let found = t.problem.position(node);
        if found.is_none() {
            log.fault(at, format!("node {node}"), "a node of the deck", "correct the number");
        }
        found
    };
    let [n1, n2, n3, n4, ..] = card.nodes;
    let pairs: &[[u32; 2]] = match card.kind {
        Kind::Spherical | Kind::Universal | Kind::Fixed => &[[n1, n2]],
        _ => &[[n1, n2], [n3, n4]],
    };
    for &[a, b] in pairs {
        let (from, to) = (position(a)?, position(b)?);
        let apart = norm(sub(to, from));
        if apart > NEAR * (norm(from) + norm(to)) {
            log.warn(
                at,
                format!("nodes {a} and {b} of the joint are {apart:e} apart: it stands where the first is"),
            );
        }
    }
    let direction = |from: u32, to: u32| {
        let along = sub(position(to)?, position(from)?);
        if norm(along) == 0.0 {
            log.fault(
                at,
                format!("nodes {from} and {to} in one place"),
                "two places, between which the axis of the joint lies",
                "correct a number",
            );
            return None;
        }
        Some(along)
    };
    let axis = match card.kind {
        Kind::Spherical | Kind::Fixed => None,
        _ => Some(t.vector(at, "an axis along", direction(n1, n3)?)),
    };
    let second_axis = match card.kind {
        Kind::Universal => Some(t.vector(at, "an axis along", direction(n2, n4)?)),
        _ => None,
    };
    let names: Option<Vec<Placed<String>>> =
        [n1, n2].into_iter().map(|node| name_of(t, node, at, bodies)).collect();
    Some(Joint {
        at,
        title: format!("the joint of nodes {n1} and {n2}"),
        name: card.name.clone().map(|name| made(name, at)),
        kind: card.kind,
        bodies: Some(names?),
        point: Some(t.vector(at, "a joint at", position(n1)?)),
        axis,
        second_axis,
    })
}

fn name_of(
    t: &Translation<'_>,
    node: u32,
    at: Place,
    bodies: &BTreeMap<u32, String>,
) -> Option<Placed<String>> {
    let found = bodies.get(&node);
    if found.is_none() {
        t.log.fault(
            at,
            format!("node {node}, which is of no rigid body"),
            "nodes of two rigid bodies",
            "name one of its elements' nodes, or give it to the body by *CONSTRAINED_EXTRA_NODES",
        );
    }
    found.map(|name| made(name.clone(), at))
}
