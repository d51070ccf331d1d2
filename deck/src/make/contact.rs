//! Contact: gap, slack, which parts meet, friction; which are tied stands in `tie`.

use std::collections::BTreeMap;

use mechanics::{
    constraint::Constraint,
    contact::{Settings, WARNING},
    load::Drive,
    material::Material,
    wall::Motion,
};

use super::{
    assembly::Assembly,
    boundary::Conditions,
    names::Names,
    rigid::{self, RigidDraft},
    surface::{Face, outer_faces, smallest_face_dimension},
    tie::{self, Tied},
    zones::clearance,
};
use crate::{
    fault::short,
    geometry::{norm, sub},
    limits::MAX_CONTACT_PARTS,
    log::Log,
    place::Origin,
    typed::contact::{Contact, Gap, Pair, Slack},
};

/// Contact settings with the faces that other checks look at.
pub(super) struct ContactDraft {
    pub(super) settings: Settings,
    /// Outer faces of every part.
    pub(super) faces: Vec<Face>,
}

/// Default gap over the smallest face dimension.
const GAP_FRACTION: f64 = 0.1;
/// Least gap over the smallest face dimension that fits itself to bodies which start close: the time step shrinks with
/// the gap.
const FIT_LEAST: f64 = 0.01;
/// A gap that fits over the distance of the bodies.
const FIT_SHARE: f64 = 0.95;
/// Default slack over the gap. Two nodes travel at most 40 % of the gap against each other in a cycle, so lists last twenty
/// cycles at the least; two go to votes and orders, eight to a sort.
const SLACK_GAPS: f64 = 8.0;
/// Default slack over the gap where that would be less: shorter lists would cost more in sorts than they save.
const LEAST_SLACK_GAPS: f64 = 2.5;
/// Default friction velocity over the largest difference of initial velocities.
const FRICTION_VELOCITY: f64 = 0.01;
/// Default friction velocity over the largest bulk sound speed where nothing moves at the start.
const FRICTION_VELOCITY_AT_REST: f64 = 1e-5;
/// Default stiffness.
const STIFFNESS: f64 = 0.5;

/// Makes the contact of a deck; none after a fault.
pub(super) fn make(
    contact: &Contact,
    names: &Names<'_>,
    assembly: &mut Assembly,
    materials: &[Material],
    conditions: &Conditions,
    rigid: &[RigidDraft<'_>],
    log: &Log<'_>,
) -> Option<ContactDraft> {
    let n = names.len();
    if n > MAX_CONTACT_PARTS {
        log.fault(
            contact.at,
            format!("{} with {n} parts", log.say("[contact]", "*CONTACT")),
            format!("at most {MAX_CONTACT_PARTS}"),
            log.say(
                "make one part of bodies of one material, with self_interaction",
                "make one part of bodies of one material",
            ),
        );
        return None;
    }
    let Meetings { interacts, frictions, kinetic, tied } = meetings(contact, names, rigid, log);
    let ties = tie::make(&contact.ties, &tied, assembly, materials, log);
    let assembly = &*assembly;
    let faces = outer_faces(assembly);
    let smallest = smallest_face_dimension(assembly, &faces, &touching(&interacts, &tied, n));
    let most = smallest.map(|face| widest_fit(assembly, &interacts, face));
    let gap = match (contact.gap, smallest.zip(most)) {
        (Gap::Fit, Some((face, most))) => {
            let mut from_apart = interacts.clone();
            for [a, b] in tied.iter().map(|tied| tied.parts) {
                (from_apart[a * n + b], from_apart[b * n + a]) = (false, false);
            }
            let clearance = clearance(assembly, &from_apart, &faces, most);
            Some(clearance.map_or(most, |d| (FIT_SHARE * d).clamp(FIT_LEAST * face, most)))
        }
        (Gap::Fit, None) => None,
        _ => fixed_gap(contact, smallest, thinnest(assembly, &interacts), log),
    };
    let slack = match contact.slack {
        Slack::Default => gap.map(|gap| default_slack(gap, smallest)),
        Slack::Gaps(gaps) => gap.map(|gap| gaps * gap),
        Slack::Length(length) => Some(length),
        Slack::Broken => None,
    };
    let friction_velocity = contact
        .friction_velocity
        .unwrap_or_else(|| default_friction_velocity(assembly, materials, conditions));
    if n > 0 && !interacts.contains(&true) && contact.ties.is_empty() {
        log.fault(
            contact.at,
            format!("{} in which no part meets another", log.say("[contact]", "*CONTACT")),
            "at least one pair of parts, or a part that meets itself",
            log.say(
                "add self_interaction, let a pair interact, or remove [contact]",
                "name other parts, or remove it",
            ),
        );
    }
    let settings = Settings {
        gap: gap?,
        slack: slack?,
        friction: frictions,
        friction_kinetic: kinetic,
        friction_decay: contact.friction_decay,
        sticks: contact.friction_velocity.is_none(),
        interacts,
        stiffness: contact.stiffness.unwrap_or(STIFFNESS),
        friction_velocity,
        ignores_initial: contact.ignores_initial,
        edges: contact.edges,
        ties_break: ties.iter().any(|tie| tie.bond.is_some()),
        ties,
        // The rest is known with the parts.
        ..Settings::default()
    };
    Some(ContactDraft { settings, faces })
}

/// Which parts meet, by pair of parts, and how they rub.
struct Meetings {
    interacts: Vec<bool>,
    frictions: Vec<f64>,
    kinetic: Vec<f64>,
    tied: Vec<Tied>,
}

fn meetings(contact: &Contact, names: &Names<'_>, rigid: &[RigidDraft<'_>], log: &Log<'_>) -> Meetings {
    let n = names.len();
    let others = contact.default_interacts;
    let mut interacts: Vec<bool> = (0..n * n).map(|i| others && i / n != i % n).collect();
    let mut frictions = vec![contact.friction; n * n];
    let mut kinetic = vec![contact.friction_kinetic; n * n];
    if let Some(parts) = &contact.self_interaction {
        for p in names.several(parts).unwrap_or_default() {
            interacts[p * n + p] = true;
        }
    }
    apply_pairs(&contact.pairs, names, &mut interacts, (&mut frictions, &mut kinetic), log);
    let kinetic: Vec<f64> =
        kinetic.iter().zip(&frictions).map(|(kinetic, friction)| kinetic.unwrap_or(*friction)).collect();
    // A rigid body does not meet itself.
    for parts in rigid::parts_of(rigid) {
        for (a, b) in parts.iter().flat_map(|&a| parts.iter().map(move |&b| (a, b))) {
            interacts[a as usize * n + b as usize] = false;
        }
    }
    // Parts that are tied hold each other already, for ever or until the tie breaks.
    let is_rigid = |part: usize| rigid::parts_of(rigid).any(|parts| parts.contains(&(part as u32)));
    let tied = tie::tied(&contact.ties, names, &is_rigid, log);
    for [a, b] in tied.iter().filter(|tied| tied.limits == [None, None]).map(|tied| tied.parts) {
        (interacts[a * n + b], interacts[b * n + a]) = (false, false);
    }
    Meetings { interacts, frictions, kinetic, tied }
}

/// The pairs whose faces limit the gap.
fn touching(interacts: &[bool], tied: &[Tied], n: usize) -> Vec<bool> {
    let mut touching = interacts.to_vec();
    if !interacts.contains(&true) {
        // The gap bounds only what nodes travel in a cycle.
        tied.iter().for_each(|tied| touching[tied.parts[0] * n + tied.parts[1]] = true);
    }
    touching
}

/// The widest gap that fits itself: that of bodies which start far from each other.
fn widest_fit(assembly: &Assembly, interacts: &[bool], face: f64) -> f64 {
    // A gap of half the thickness stands for it.
    thinnest(assembly, interacts).map_or(GAP_FRACTION * face, |h| 0.5 * h.min(face))
}

/// A gap that does not fit itself, for the smallest face dimension and the least thickness of shells.
fn fixed_gap(contact: &Contact, smallest: Option<f64>, thinnest: Option<f64>, log: &Log<'_>) -> Option<f64> {
    match contact.gap {
        Gap::Fit | Gap::Default => smallest.map(|face| GAP_FRACTION * face),
        Gap::Fraction(fraction, origin) => of_fraction(fraction, origin, smallest, log),
        Gap::Length(length, origin) => of_length(length, origin, (smallest, thinnest), log),
        Gap::Broken => None,
    }
}

/// The gap of a mesh whose parts are yet to be moved to where they start; none after a fault.
pub(super) fn gap_to_come(
    contact: &Contact,
    names: &Names<'_>,
    assembly: &Assembly,
    rigid: &[RigidDraft<'_>],
    log: &Log<'_>,
) -> Option<f64> {
    if names.len() > MAX_CONTACT_PARTS {
        return None;
    }
    let Meetings { interacts, tied, .. } = meetings(contact, names, rigid, log);
    let faces = outer_faces(assembly);
    let smallest = smallest_face_dimension(assembly, &faces, &touching(&interacts, &tied, names.len()));
    match contact.gap {
        Gap::Fit => smallest.map(|face| widest_fit(assembly, &interacts, face)),
        _ => fixed_gap(contact, smallest, thinnest(assembly, &interacts), log),
    }
}

/// The least thickness of shells that interact.
fn thinnest(assembly: &Assembly, interacts: &[bool]) -> Option<f64> {
    let parts = &assembly.mesh.parts;
    let meets = |p: usize| interacts[p * parts.len()..(p + 1) * parts.len()].contains(&true);
    let of_shells = (0..parts.len()).filter(|&p| meets(p)).filter_map(|p| parts[p].least_thickness());
    of_shells.min_by(f64::total_cmp)
}

/// Whether the two parts of each pair interact, and their friction.
fn apply_pairs(
    pairs: &[Pair],
    names: &Names<'_>,
    interacts: &mut [bool],
    (frictions, kinetic): (&mut [f64], &mut [Option<f64>]),
    log: &Log<'_>,
) {
    let n = names.len();
    let mut seen: BTreeMap<(usize, usize), Origin> = BTreeMap::new();
    for pair in pairs {
        let [a, b] = [0, 1].map(|i| names.one(&pair.parts[i]));
        let (Some(a), Some(b)) = (a, b) else { continue };
        let key = (a.min(b), a.max(b));
        if let Some(first) = seen.get(&key) {
            let line = log.line(first.at, pair.origin.at);
            log.fault_of(pair.origin, format!("a pair that {line} does not have"), "remove one of the two");
            continue;
        }
        seen.insert(key, pair.origin);
        for cell in [a * n + b, b * n + a] {
            interacts[cell] = pair.interacts;
            if let Some(friction) = pair.friction {
                frictions[cell] = friction;
                kinetic[cell] = None;
            }
            if pair.friction_kinetic.is_some() {
                kinetic[cell] = pair.friction_kinetic;
            }
        }
    }
}

/// Default slack for a gap and the smallest face dimension (lengths): so much that the reach of a sort is that dimension, for
/// its cubes have twice that as their side anyway.
fn default_slack(gap: f64, smallest: Option<f64>) -> f64 {
    let wide = smallest.map_or(f64::INFINITY, |face| WARNING.mul_add(-gap, face));
    (SLACK_GAPS * gap).min(wide).max(LEAST_SLACK_GAPS * gap)
}

/// The gap as a length; outside 10 % to 50 % of the smallest face dimension it is a fault.
fn of_fraction(fraction: f64, origin: Origin, smallest: Option<f64>, log: &Log<'_>) -> Option<f64> {
    if !(0.1..=0.5).contains(&fraction) {
        log.fault_of(
            origin,
            "a fraction from 0.1 to 0.5 of the smallest face dimension",
            "choose one between, or leave it out for 0.1",
        );
        return None;
    }
    smallest.map(|face| fraction * face)
}

/// The same of a gap that is given as a length.
fn of_length(
    gap: f64,
    origin: Origin,
    (smallest, thinnest): (Option<f64>, Option<f64>),
    log: &Log<'_>,
) -> Option<f64> {
    let Some(face) = smallest else { return Some(gap) };
    // A gap of 10 % that was rounded in the deck still counts.
    if gap < 0.1 * face * (1.0 - 1e-9) || gap > 0.5 * face * (1.0 + 1e-9) {
        // Half their thickness stands for shells, which may be less than any length that is allowed here.
        let advice = match thinnest.filter(|thickness| 0.5 * thickness < 0.1 * face) {
            Some(thickness) => format!(
                "write gap_fraction = \"fit\", which takes half the thickness {} of the thinnest shells",
                short(thickness)
            ),
            None => "choose one between, or write gap_fraction".to_string(),
        };
        log.fault_of(
            origin,
            format!(
                "10 % to 50 % of the smallest face dimension {}: {} to {}",
                short(face),
                short(0.1 * face),
                short(0.5 * face)
            ),
            advice,
        );
        return None;
    }
    Some(gap)
}

/// One per cent of the largest difference of two velocities that stand in the deck (parts, boundaries, and
/// rest where there is a wall or one part only); where nothing moves, 1e-5 of the largest sound speed.
fn default_friction_velocity(assembly: &Assembly, materials: &[Material], conditions: &Conditions) -> f64 {
    let mut velocities = assembly.part_velocity.clone();
    velocities.extend(&assembly.file_velocities);
    // At its greatest, where it follows a curve.
    let speed = |v: Drive| v.greatest(&conditions.loads.curves).copysign(v.factor);
    let of_constraint = |c: &Constraint| c.velocity.map(|v| v.map_or(0.0, speed));
    velocities.extend(conditions.constraints.iter().skip(1).map(of_constraint));
    velocities.extend(conditions.walls.iter().map(|wall| match wall.motion {
        Motion::Fixed => [0.0; 3],
        Motion::Driven(velocity) => velocity.map(speed),
        Motion::Free { velocity, .. } => velocity,
    }));
    if velocities.len() == 1 {
        velocities.push([0.0; 3]);
    }
    // The largest difference is found per axis: its ends are the extremes.
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for v in &velocities {
        for axis in 0..3 {
            low[axis] = low[axis].min(v[axis]);
            high[axis] = high[axis].max(v[axis]);
        }
    }
    let spread = if velocities.is_empty() { 0.0 } else { norm(sub(high, low)) };
    if spread > 0.0 {
        return FRICTION_VELOCITY * spread;
    }
    let sound = materials.iter().map(|m| (m.bulk() / m.density).sqrt()).fold(0.0, f64::max);
    FRICTION_VELOCITY_AT_REST * sound
}
