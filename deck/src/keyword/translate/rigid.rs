//! Which parts are one rigid body each, and what holds, moves and starts them.

use std::collections::{BTreeMap, BTreeSet};

use super::state::{Bodies, Translation};
use crate::{
    keyword::{material::Law, rigid::Members},
    place::Place,
    typed::condition::{Components, Drive, Parts, Rigid, made},
};

const AXES: [&str; 3] = ["x", "y", "z"];
const FREE: Components = [const { None }; 3];

/// Finds the rigid bodies: parts of rigid material, parts that become rigid, and what belongs together.
pub(super) fn find_bodies(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let mut bodies = Bodies::default();
    for (&id, part) in problem.parts.iter().filter(|(id, _)| t.names.contains_key(id)) {
        if matches!(problem.materials.get(&part.material.value).map(|m| &m.law), Some(Law::Rigid { .. })) {
            bodies.lead.insert(id, id);
        }
    }
    let mut pairs = Vec::new();
    for card in &problem.rigid.joined {
        let members = match card.members {
            Members::Part(id) => vec![id],
            Members::Set(id) => problem.part_set(id, card.at, log),
        };
        for id in members {
            if !problem.parts.contains_key(&id) {
                log.fault(card.at, format!("part {id}"), "a part of the deck", "correct the number");
            } else if card.switched && t.names.contains_key(&id) {
                bodies.lead.entry(id).or_insert(id);
            }
            if card.lead != 0 {
                pairs.push((card.lead, id, card.at));
            }
        }
    }
    // After all cards, so that their order does not matter.
    for (lead, part, at) in pairs {
        match [lead, part].into_iter().find(|id| bodies.of(*id).is_none()) {
            Some(id) => log.fault(
                at,
                format!("part {id}, which deforms or has no elements"),
                "parts of rigid material or of *DEFORMABLE_TO_RIGID",
                "make it rigid, or join its nodes to those of the other part",
            ),
            None => bodies.join(lead, part),
        }
    }
    join_neighbours(t, &mut bodies);
    t.bodies = bodies;
    t.bodies.starts = starts(t);
}

/// Bodies that share nodes move as one.
fn join_neighbours(t: &Translation<'_>, bodies: &mut Bodies) {
    let mut first: BTreeMap<u32, u32> = BTreeMap::new();
    let mut joined: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for ((&id, _), body) in t.names.iter().zip(&t.mesh.bodies) {
        if bodies.of(id).is_none() {
            continue;
        }
        for node in body.corners().collect::<BTreeSet<u32>>() {
            let other = *first.entry(node).or_insert(id);
            if !bodies.same(other, id) {
                bodies.join(other, id);
                joined.insert((other, id), node);
            }
        }
    }
    for ((a, b), node) in joined {
        t.log.warn(
            t.problem.parts[&b].at,
            format!("rigid parts {a} and {b} share nodes, such as {node}: they are one body"),
        );
    }
}

/// What bodies begin with by `*INITIAL_VELOCITY_RIGID_BODY`.
fn starts(t: &Translation<'_>) -> BTreeMap<u32, [[f64; 3]; 2]> {
    let mut starts = BTreeMap::new();
    for start in &t.problem.rigid.starts {
        let turned = |v| t.turned(v, start.system, start.at);
        if let Some(lead) = body_at(t, start.part, start.at) {
            starts.insert(lead, [turned(start.velocity), turned(start.spin)]);
        }
    }
    starts
}

/// The body of a part that a card names; a part that is none is a fault at the card.
fn body_at(t: &Translation<'_>, part: u32, at: Place) -> Option<u32> {
    let lead = t.bodies.of(part);
    if lead.is_none() {
        t.log.fault(
            at,
            format!("part {part}"),
            "a part of a rigid body, with elements",
            "give it *MAT_RIGID, or move its nodes",
        );
    }
    lead
}

/// Puts the velocities of bodies over those of their nodes.
pub(super) fn start_bodies(
    t: &Translation<'_>,
    velocities: &mut BTreeMap<u32, [f64; 3]>,
    spins: &mut BTreeMap<u32, [f64; 3]>,
) {
    for ((id, _), body) in t.names.iter().zip(&t.mesh.bodies) {
        let Some(lead) = t.bodies.of(*id) else { continue };
        for node in body.corners() {
            // Nodes of a body turn as it does.
            spins.remove(&node);
            if let Some([velocity, _]) = t.bodies.starts.get(&lead) {
                velocities.insert(node, *velocity);
            }
        }
    }
}

/// Adds the rigid bodies to the deck.
pub(super) fn write(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (part, lead) in &t.bodies.lead {
        members.entry(*lead).or_default().push(*part);
    }
    let mut drives = drives(t);
    for (lead, parts) in members {
        // What holds a body is said by the part that leads, or else by the first that says anything.
        let law = |id: &u32| match problem.materials.get(&problem.parts[id].material.value).map(|m| &m.law) {
            Some(Law::Rigid { held }) => Some((*id, *held)),
            _ => None,
        };
        let ruling = law(&lead).or_else(|| parts.iter().find_map(law));
        let (ruler, held) = ruling.unwrap_or((lead, [[false; 3]; 2]));
        if let Some((other, _)) = parts.iter().filter_map(law).find(|(_, other)| *other != held) {
            log.warn(
                problem.parts[&other].at,
                format!(
                    "part {other} is of the body that part {ruler} leads: CON1 and CON2 of the latter hold it"
                ),
            );
        }
        let at = problem.parts[&lead].at;
        let mut components = [FREE; 2];
        for (turns, list) in components.iter_mut().enumerate() {
            for (axis, name) in AXES.into_iter().enumerate() {
                match drives.remove(&(lead, turns == 1, axis)) {
                    Some((place, _)) if held[turns][axis] => log.fault(
                        place,
                        format!("a motion of part {ruler} along or about {name}"),
                        "an axis that CON1 or CON2 of its *MAT_RIGID leaves free",
                        "take one of the two out",
                    ),
                    Some((_, drive)) => list[axis] = Some(drive),
                    None if held[turns][axis] => list[axis] = Some(Drive::constant(0.0)),
                    None => {}
                }
            }
        }
        let [velocity, spin] = components;
        let spun = t.bodies.starts.get(&lead).map(|[_, spin]| *spin);
        let start_spin = spun.map(|spin| t.vector(at, "an angular velocity of", spin));
        t.deck.rigid.push(Rigid {
            at,
            title: format!("the rigid body of part {lead}"),
            parts: Parts::Named(parts.iter().map(|id| made(t.names[id].clone(), at)).collect()),
            mass: None,
            inertia: None,
            start_spin,
            velocity,
            spin,
        });
    }
}

/// Motions by curve: by the part that leads, whether it turns, and axis, the place and drive of each.
fn drives(t: &mut Translation<'_>) -> BTreeMap<(u32, bool, usize), (Place, Drive)> {
    let (problem, log) = (t.problem, t.log);
    let mut drives: BTreeMap<(u32, bool, usize), (Place, Drive)> = BTreeMap::new();
    for motion in &problem.rigid.motions {
        let Some(lead) = body_at(t, motion.part, motion.at) else { continue };
        let Some(curve) = t.curve(motion.curve, motion.meaning, motion.at) else { continue };
        let drive = Drive { factor: motion.factor + 0.0, curve: Some(curve) };
        let key = (lead, motion.turns, motion.axis);
        if let Some((first, _)) = drives.insert(key, (motion.at, drive)) {
            log.fault(
                motion.at,
                format!("a second motion of the body of part {lead}"),
                format!("one by axis, which {} gives", log.line(first, motion.at)),
                "take one of the two out, or add up their curves",
            );
        }
    }
    drives
}
