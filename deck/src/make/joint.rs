//! Joints between rigid bodies.

use mechanics::{
    joint::{End, Joint, Kind},
    rigid::Body,
};

use super::{assembly::Assembly, rigid::RigidDraft};
use crate::{
    fault::{nearest, short},
    geometry::{norm, sub},
    log::Log,
    place::Placed,
    typed::condition,
};

/// Two axes of a universal joint are at right angles up to this cosine.
const RIGHT: f64 = 1e-3;
/// A joint whose bodies part at the start more slowly than this share of their greatest speed takes nothing from them.
const PARTING: f64 = 1e-6;

/// Makes the joints. `bodies` are those of `drafts`, unless there was a fault: then there are none.
pub(super) fn make(
    given: &[condition::Joint],
    drafts: &[RigidDraft<'_>],
    bodies: &[Body],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Vec<Joint> {
    let mut joints = Vec::new();
    for joint in given {
        let Some(names) = &joint.bodies else { continue };
        let found: Option<Vec<usize>> = names.iter().map(|name| find(name, drafts, assembly, log)).collect();
        let axes = axes(joint, log);
        let (Some(found), Some(axes), Some(point)) = (found, axes, joint.point) else { continue };
        if let [a, b] = found[..]
            && a == b
        {
            log.fault(
                joint.at,
                format!(
                    "{} of \"{}\" and \"{}\", which are one rigid body",
                    joint.title, names[0].value, names[1].value
                ),
                "two bodies",
                "correct a name, or leave the joint out",
            );
            continue;
        }
        if bodies.len() != drafts.len() {
            continue;
        }
        let end = |body: Option<usize>| {
            let centre = body.map_or([0.0; 3], |b| bodies[b].start.centre);
            End { body: body.map(|b| b as u32), place: sub(point, centre), axes }
        };
        let made = Joint { kind: joint.kind, ends: [end(Some(found[0])), end(found.get(1).copied())] };
        warn(joint, &made, bodies, log);
        joints.push(made);
    }
    joints
}

/// The names of the joints in the history: their numbers where they have none.
pub(super) fn names(joints: &[condition::Joint], log: &Log<'_>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (number, joint) in (1..).zip(joints) {
        let name = joint.name.as_ref().map_or_else(|| format!("{number}"), |name| name.value.clone());
        if names.contains(&name) {
            let at = joint.name.as_ref().map(|name| name.origin);
            match at {
                Some(origin) => {
                    log.fault_of(origin, "a name that no other joint has", "choose another name");
                }
                None => log.fault(
                    joint.at,
                    format!("{}, which another is named after", joint.title),
                    "a name of its own",
                    "give it a name",
                ),
            }
        }
        names.push(name);
    }
    names
}

/// The body of that name, or with a part of that name.
fn find(
    name: &Placed<String>,
    drafts: &[RigidDraft<'_>],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Option<usize> {
    let part = assembly.mesh.parts.iter().position(|part| part.name == name.value);
    let found = drafts.iter().position(|draft| draft.is(&name.value, part));
    if found.is_none() {
        let parts = drafts
            .iter()
            .flat_map(|draft| draft.parts())
            .map(|&p| assembly.mesh.parts[p as usize].name.as_str());
        let known = drafts.iter().filter_map(|draft| draft.name()).chain(parts);
        let advice = match nearest(&name.value, known) {
            Some(near) => format!("write \"{near}\""),
            None if part.is_some() => "put the part into a [[rigid]]: joints hold rigid bodies".to_string(),
            None => "give a [[rigid]] that name".to_string(),
        };
        log.fault_of(name.origin, "the name of a [[rigid]], or of a part of one", advice);
    }
    found
}

/// Three axes at right angles, that of the joint first; none after a fault.
fn axes(joint: &condition::Joint, log: &Log<'_>) -> Option<[[f64; 3]; 3]> {
    let unit = |v: [f64; 3]| {
        let size = norm(v);
        v.map(|c| c / size)
    };
    let first = match (joint.kind, joint.axis) {
        (Kind::Spherical | Kind::Fixed, _) => [1.0, 0.0, 0.0],
        (_, axis) => unit(axis?),
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let across = match joint.kind {
        Kind::Universal => {
            let second = unit(joint.second_axis?);
            let cosine = dot(first, second);
            if cosine.abs() > RIGHT {
                log.fault(
                    joint.at,
                    format!("{} with axes whose angle has the cosine {}", joint.title, short(cosine)),
                    "two axes at right angles",
                    "correct axis or second_axis",
                );
                return None;
            }
            second
        }
        _ => {
            // The axis of space that is least along the first.
            let flat = (0..3).fold(0, |best, a| if first[a].abs() < first[best].abs() { a } else { best });
            std::array::from_fn(|a| if a == flat { 1.0 } else { 0.0 })
        }
    };
    let along = dot(first, across);
    let second = unit(std::array::from_fn(|a| across[a] - along * first[a]));
    let third = std::array::from_fn(|a| {
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        first[b] * second[c] - first[c] * second[b]
    });
    Some([first, second, third])
}

/// Says so where bodies part at the start: the joint takes that motion away.
fn warn(joint: &condition::Joint, made: &Joint, bodies: &[Body], log: &Log<'_>) {
    let parting = made.parting(bodies);
    let fastest =
        bodies.iter().map(|body| norm(body.start.velocity).max(norm(body.start.spin) * body.reach()));
    if parting > PARTING * fastest.fold(0.0, f64::max) {
        log.warn(
            joint.at,
            format!(
                "{}: its bodies part with {} at the start; the joint takes this motion and its energy away in the first cycle: give them velocities that agree",
                joint.title,
                short(parting)
            ),
        );
    }
}
