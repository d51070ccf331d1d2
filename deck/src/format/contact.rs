//! `[contact]`: gap, slack, which parts meet, friction.

use mechanics::{
    contact::{Settings, WARNING},
    load::Drive,
    material::Material,
    rigid::Body,
    setup::Constraint,
    wall::Motion,
};

use super::{MAX_CONTACT_PARTS, MAX_ENTRIES, Names, boundary::Conditions};
use crate::{
    assembly::Assembly,
    check::{Face, clearance, outer_faces, smallest_face_dimension},
    fault::short,
    geometry::{norm, sub},
    table::{Range, Table},
};

/// Contact settings with the place of what other checks refer to.
pub(crate) struct ContactDraft {
    pub(crate) settings: Settings,
    /// Outer faces of every part.
    pub(crate) faces: Vec<Face>,
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

/// Reads `[contact]`; none where the deck has none.
pub(crate) fn read(
    deck: &Table<'_>,
    names: &Names,
    assembly: &Assembly,
    materials: &[Material],
    conditions: &Conditions,
    bodies: &[Body],
) -> Option<ContactDraft> {
    let table = deck.get("contact")?.table("[contact]".to_string())?;
    let n = names.len();
    if n > MAX_CONTACT_PARTS {
        table.faults.add(
            table.at,
            format!("[contact] with {n} parts"),
            format!("at most {MAX_CONTACT_PARTS}"),
            "make one part of bodies of one material, with self_interaction",
        );
        return None;
    }
    let friction = table.number_or("friction", 0.0, Range::NotNegative);
    let others = table.get("default_interacts").and_then(|v| v.boolean()).unwrap_or(true);
    let mut interacts: Vec<bool> = (0..n * n).map(|i| others && i / n != i % n).collect();
    let mut frictions = vec![friction; n * n];
    if let Some(value) = table.get("self_interaction") {
        for p in names.several(value).unwrap_or_default() {
            interacts[p * n + p] = true;
        }
    }
    read_pairs(&table, names, &mut interacts, &mut frictions);
    // A rigid body does not meet itself.
    for body in bodies {
        for (a, b) in body.parts.iter().flat_map(|&a| body.parts.iter().map(move |&b| (a, b))) {
            interacts[a as usize * n + b as usize] = false;
        }
    }
    let faces = outer_faces(assembly);
    let smallest = smallest_face_dimension(assembly, &faces, &interacts);
    let gap = match table.get("gap_fraction").filter(|v| v.is_text()) {
        Some(value) if value.one_of(&["fit"]).is_some() => {
            let fit = |face: f64| {
                // A gap of half the thickness stands for it.
                let most = thinnest(assembly, &interacts).map_or(GAP_FRACTION * face, |h| 0.5 * h.min(face));
                let clearance = clearance(assembly, &interacts, &faces, most);
                clearance.map_or(most, |d| (FIT_SHARE * d).clamp(FIT_LEAST * face, most))
            };
            smallest.map(fit)
        }
        Some(_) => None,
        None => read_gap(&table, smallest),
    };
    let slack = match (table.get("slack_gaps"), table.get("slack_length")) {
        (Some(_), Some(second)) => {
            second.fault("one of slack_gaps and slack_length", "remove one of the two");
            None
        }
        (None, Some(length)) => length.number(Range::Positive),
        (Some(gaps), None) => gaps.number(Range::Positive).zip(gap).map(|(gaps, gap)| gaps * gap),
        (None, None) => gap.map(|gap| default_slack(gap, smallest)),
    };
    let stiffness =
        table.number_or("stiffness", 0.5, Range::Within(0.0, 1.0, "a number above 0 and at most 1"));
    let friction_velocity = match table.get("friction_velocity") {
        Some(value) => value.number(Range::Positive),
        None => Some(default_friction_velocity(assembly, materials, conditions)),
    };
    let edges = table.get("edges").and_then(|v| v.boolean()).unwrap_or(false);
    let initial = table.get("initial_penetration").and_then(|v| v.one_of(&["refuse", "ignore"]));
    let at = table.at;
    if n > 0 && !interacts.contains(&true) {
        table.faults.add(
            at,
            "[contact] in which no part meets another",
            "at least one pair of parts, or a part that meets itself",
            "add self_interaction, let a pair interact, or remove [contact]",
        );
    }
    table.finish();
    let settings = Settings {
        gap: gap?,
        slack: slack?,
        friction: frictions,
        interacts,
        stiffness,
        friction_velocity: friction_velocity?,
        ignores_initial: initial == Some(1),
        edges,
    };
    Some(ContactDraft { settings, faces })
}

/// The least thickness of shells that interact.
fn thinnest(assembly: &Assembly, interacts: &[bool]) -> Option<f64> {
    let parts = &assembly.mesh.parts;
    let meets = |p: usize| interacts[p * parts.len()..(p + 1) * parts.len()].contains(&true);
    let of_shells = (0..parts.len()).filter(|&p| meets(p)).filter_map(|p| parts[p].section());
    of_shells.map(|section| section.thickness).min_by(f64::total_cmp)
}

/// `[[contact.pair]]`: whether two parts interact, and their friction.
fn read_pairs(table: &Table<'_>, names: &Names, interacts: &mut [bool], frictions: &mut [f64]) {
    let n = names.len();
    let mut seen: Vec<((usize, usize), usize)> = Vec::new();
    for pair in table.tables("pair", MAX_ENTRIES) {
        let parts = pair.require("parts", "two part names");
        let both = parts.and_then(|v| v.fixed::<2>("two part names").map(|both| (v, both)));
        let on = pair.get("interacts").map_or(Some(true), |v| v.boolean());
        let friction = pair.get("friction").map(|v| v.number(Range::NotNegative));
        pair.finish();
        let Some((value, [a, b])) = both else { continue };
        let (Some(a), Some(b)) = (names.one(a), names.one(b)) else { continue };
        let key = (a.min(b), a.max(b));
        if let Some((_, first)) = seen.iter().find(|(other, _)| *other == key) {
            let (line, _) = table.faults.place(*first);
            value.fault(&format!("a pair that line {line} does not have"), "remove one of the two");
            continue;
        }
        seen.push((key, value.at));
        for cell in [a * n + b, b * n + a] {
            interacts[cell] = on.unwrap_or(true);
            if let Some(Some(friction)) = friction {
                frictions[cell] = friction;
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
fn read_gap(table: &Table<'_>, smallest: Option<f64>) -> Option<f64> {
    let fraction = table.get("gap_fraction");
    let length = table.get("gap_length");
    match (fraction, length) {
        (Some(_), Some(second)) => {
            second.fault("one of gap_fraction and gap_length", "remove one of the two");
            None
        }
        (None, None) => smallest.map(|face| GAP_FRACTION * face),
        (Some(value), None) => {
            let fraction = value.number(Range::Positive)?;
            if !(0.1..=0.5).contains(&fraction) {
                value.fault(
                    "a fraction from 0.1 to 0.5 of the smallest face dimension",
                    "choose one between, or leave it out for 0.1",
                );
                return None;
            }
            smallest.map(|face| fraction * face)
        }
        (None, Some(value)) => {
            let gap = value.number(Range::Positive)?;
            let Some(face) = smallest else { return Some(gap) };
            // A gap of 10 % that was rounded in the deck still counts.
            if gap < 0.1 * face * (1.0 - 1e-9) || gap > 0.5 * face * (1.0 + 1e-9) {
                value.fault(
                    &format!(
                        "10 % to 50 % of the smallest face dimension {}: {} to {}",
                        short(face),
                        short(0.1 * face),
                        short(0.5 * face)
                    ),
                    "choose one between, or write gap_fraction",
                );
                return None;
            }
            Some(gap)
        }
    }
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
