//! Nozzles and the segments that their jets press.

use super::{
    condition::{Outward, driven},
    state::Translation,
};
use crate::{
    geometry::{norm, sub},
    keyword::{
        condition::Target,
        moving::Nozzle,
        prescribed::{Meaning, Motion, Way},
        rigid::BodyNodes,
    },
    place::{Place, Placed},
    toml_deck::moving::USUAL_POINTS,
    typed::condition::{Components, Drive, Faces, Load, LoadKind, Moving, Parts, Path, made},
};

/// Adds a load for each nozzle and side that its segments show.
pub(super) fn write(t: &mut Translation<'_>) {
    let problem = t.problem;
    if problem.nozzles.is_empty() {
        return;
    }
    let outward = Outward::of(problem);
    for (n, nozzle) in (1..).zip(&problem.nozzles) {
        let at = nozzle.at;
        let sides = segments(t, nozzle, &outward);
        let (Some(way), Some(profile)) = (way_of(t, nozzle), t.curve(nozzle.profile, Meaning::Profile, at))
        else {
            continue;
        };
        let share = match nozzle.curve {
            0 => Drive::constant(1.0),
            id => match t.curve(id, Meaning::Velocity, at) {
                Some(curve) => Drive::along(curve, 1.0),
                None => continue,
            },
        };
        let radius = t.number(at, "a radius of", nozzle.radius);
        for (side, faces) in
            ["", " from behind"].into_iter().zip(sides).filter(|(_, faces)| !faces.is_empty())
        {
            let name = format!("jet {n}{side}");
            t.mesh.segments.insert(name.clone(), faces);
            let mut pressure = share.clone();
            if !side.is_empty() {
                pressure.factor = -1.0;
            }
            let moving = Moving {
                pressure,
                profile: Some(profile.clone()),
                radius,
                axis: way.1,
                path: way.0.clone(),
                points: nozzle.points.unwrap_or(USUAL_POINTS),
            };
            let kind = LoadKind::Moving {
                moving: Some(Box::new(moving)),
                faces: Some(Faces::Segments(made(name, at))),
            };
            let title = "a *LOAD_MOVING_PRESSURE".to_string();
            t.deck.loads.push(Load { at, title, parts: Parts::All, kind });
        }
    }
}

/// Whether a motion is that of the nodes of a nozzle.
pub(super) fn is_of_nozzle(t: &Translation<'_>, motion: &Motion) -> bool {
    t.problem.nozzles.iter().flat_map(|nozzle| &nozzle.nodes).any(|node| moves(t, motion, node.value))
}

/// Whether a motion names a node.
fn moves(t: &Translation<'_>, motion: &Motion, node: u32) -> bool {
    match motion.target {
        Target::Node(id) => id == node,
        Target::NodeSet(id) => t.problem.node_set(id, motion.at, t.log).contains(&node),
        _ => false,
    }
}

/// The segments that a nozzle presses: those that are listed outward, and those inward.
fn segments(t: &Translation<'_>, nozzle: &Nozzle, outward: &Outward) -> [Vec<[u32; 4]>; 2] {
    let (problem, log, at) = (t.problem, t.log, nozzle.at);
    let faces = outward.pressed(problem, nozzle.pressed, at, log);
    if faces.is_empty() && log.count() == 0 {
        log.fault(at, "a *LOAD_MOVING_PRESSURE on nothing", "at least one segment", "correct ID and IDT");
    }
    let mut sides = [Vec::new(), Vec::new()];
    for face in faces {
        let Some(same) = outward.is_outward(face, at, log) else { continue };
        sides[usize::from(!same)].push(face);
    }
    sides
}

/// The way of the origin of a nozzle, and its direction; none after a fault.
fn way_of(t: &mut Translation<'_>, nozzle: &Nozzle) -> Option<(Path, [f64; 3])> {
    let (problem, log) = (t.problem, t.log);
    let place = |node: &Placed<u32>| {
        let place = problem.position(node.value);
        match place {
            None => log.fault_of(node.origin, "a node of the deck", "add the node"),
            Some(_) if is_carried(t, node.value) => log.fault_of(
                node.origin,
                "a node that no element and no rigid body has, so that its way is known before the run",
                "name a node of the nozzle's own, and move it by *BOUNDARY_PRESCRIBED_MOTION_NODE",
            ),
            Some(_) => return place,
        }
        None
    };
    let [origin, head] = [place(&nozzle.nodes[0])?, place(&nozzle.nodes[1])?];
    let axis = sub(head, origin);
    if !(norm(axis) > 0.0 && norm(axis).is_finite()) {
        let expected = "another node than NODE1, at another place";
        log.fault_of(nozzle.nodes[1].origin, expected, "put the head of the nozzle where its jet goes");
        return None;
    }
    let motions = |node: u32| -> Vec<&Motion> {
        problem.conditions.motions.iter().filter(|motion| moves(t, motion, node)).collect()
    };
    let [of_origin, of_head] = [0, 1].map(|i| motions(nozzle.nodes[i].value));
    let alike = |a: &Motion, b: &Motion| a.way == b.way && a.how == b.how;
    let turns = of_origin.len() != of_head.len()
        || of_origin.iter().any(|motion| !of_head.iter().any(|other| alike(motion, other)));
    if turns {
        let expected = "the same motions as NODE1 has, for the nozzle keeps its direction";
        log.fault_of(nozzle.nodes[1].origin, expected, "move both nodes by the same curves");
        return None;
    }
    let mut velocity: Components = [const { None }; 3];
    for motion in of_origin {
        let refuse = |at: Place, read: &str| {
            log.fault(at, read, "one motion of a nozzle along each of x, y, z", "move it along the axes");
        };
        match motion.way {
            Way::Along(axis) if velocity[axis].is_none() => {
                velocity[axis] = Some(driven(t, &motion.how, motion.at)?);
            }
            Way::Along(_) => refuse(motion.at, "a second motion of a nozzle along an axis"),
            Way::Turn(_) | Way::About(..) => refuse(motion.at, "a nozzle that turns"),
        }
    }
    let start = t.vector(nozzle.at, "a nozzle at", origin);
    Some((Path::Velocity { start, velocity: Box::new(velocity) }, t.vector(nozzle.at, "a jet along", axis)))
}

/// Whether a node moves with an element or a rigid body.
fn is_carried(t: &Translation<'_>, node: u32) -> bool {
    let rigid = &t.problem.rigid;
    let named = |target: Target, at: Place| match target {
        Target::Node(id) => id == node,
        Target::NodeSet(id) => t.problem.node_set(id, at, t.log).contains(&node),
        _ => false,
    };
    t.used.contains(&node)
        || rigid.extra.iter().any(|extra| named(extra.target, extra.at))
        || rigid.of_nodes.iter().any(|body| match body.nodes {
            BodyNodes::Set(id) => named(Target::NodeSet(id), body.at),
            BodyNodes::Pair(pair) => pair.contains(&node),
        })
}
