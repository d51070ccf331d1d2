//! What pushes bodies from outside.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::{
    load::{
        Gravity, Loads, MAX_FORCES, NodalForce, Relaxation, SurfaceKind, SurfaceLoad,
        blast::{Burst, Charge},
        moving::{MovingPressure, Path},
    },
    mesh::LOWER,
};

use super::{
    assembly::Assembly,
    names::{Curves, Names},
    part::PartDraft,
    region::{self, Asking, broken},
};
use crate::{
    fault::short,
    log::Log,
    place::Place,
    typed::{
        Deck,
        condition::{self, Faces, Load, LoadKind, Side},
    },
};

/// The loads of a deck, without its curves.
pub(super) struct LoadDraft {
    pub(super) list: Loads,
    /// By node: the forces that act on it, one bit each.
    pub(super) forces: BTreeMap<u32, u32>,
}

pub(super) fn make(
    deck: &Deck,
    names: &Names<'_>,
    parts: &[PartDraft],
    assembly: &Assembly,
    curves: &Curves<'_>,
    log: &Log<'_>,
) -> LoadDraft {
    let mut draft = LoadDraft { list: Loads::default(), forces: BTreeMap::new() };
    for load in &deck.loads {
        let selected = names.several(&load.parts).unwrap_or_default();
        match &load.kind {
            LoadKind::Pressure { pressure, faces } => {
                let pressure = pressure.as_ref().and_then(|pressure| curves.drive(pressure));
                let asking = Asking { at: load.at, title: &load.title, selected: &selected };
                let faces = match faces {
                    Some(faces) => region::faces(faces, &asking, parts, assembly, log),
                    None => Vec::new(),
                };
                if let Some(pressure) = pressure {
                    draft.list.surfaces.push(SurfaceLoad { kind: SurfaceKind::Pressure(pressure), faces });
                }
            }
            LoadKind::Blast { charge, faces: asked } => {
                let asking = Asking { at: load.at, title: &load.title, selected: &selected };
                let mut faces = match asked {
                    Some(faces) => region::faces(faces, &asking, parts, assembly, log),
                    None => Vec::new(),
                };
                if let Some(charge) =
                    charge.as_ref().and_then(|c| exploding(c, load, &mut faces, deck, assembly, log))
                {
                    if let (Some(Faces::Segments(name)), Place::Card { .. }) = (asked, load.at) {
                        warn_of_segments(&name.value, &charge, load, &faces, assembly, log);
                    }
                    let kind = SurfaceKind::Blast(draft.list.charges.len() as u32);
                    draft.list.charges.push(charge);
                    draft.list.surfaces.push(SurfaceLoad { kind, faces });
                }
            }
            LoadKind::Moving { moving, faces } => {
                let asking = Asking { at: load.at, title: &load.title, selected: &selected };
                let faces = match faces {
                    Some(faces) => region::faces(faces, &asking, parts, assembly, log),
                    None => Vec::new(),
                };
                if let Some(moving) = moving.as_ref().and_then(|given| moving_pressure(given, curves)) {
                    let kind = SurfaceKind::Moving(draft.list.moving.len() as u32);
                    draft.list.moving.push(moving);
                    draft.list.surfaces.push(SurfaceLoad { kind, faces });
                }
            }
            LoadKind::Force { force, by_mass, drive, nodes } => {
                let drive = curves.of_entry(drive);
                let nodes = nodes.as_ref().and_then(|nodes| region::nodes(nodes, &selected, assembly, log));
                let (Some(force), Some(nodes)) = (force, nodes) else { continue };
                if nodes.is_empty() && !broken(&selected, parts) {
                    log.fault(
                        load.at,
                        format!("{} that holds no node", load.title),
                        "at least one node",
                        "check parts, face, box, plane or nodes against the mesh",
                    );
                }
                push(&mut draft, load, NodalForce { force: *force, by_mass: *by_mass, drive }, nodes, log);
            }
        }
    }
    let gravity =
        |g: &condition::Gravity| Gravity { acceleration: g.acceleration, drive: curves.of_entry(&g.drive) };
    draft.list.gravity = deck.gravity.as_ref().map(gravity);
    draft.list.relaxation = deck.relaxation.map(|r| Relaxation {
        factor: r.factor,
        rate: r.rate,
        until: r.until.unwrap_or(f64::MAX),
    });
    draft
}

/// A charge in the units of the deck; none where a face is nearer than its pressure is known. The faces of shells become those of the side
/// that it is to load.
fn exploding(
    given: &condition::Charge,
    load: &Load,
    faces: &mut [(u32, u8)],
    deck: &Deck,
    assembly: &Assembly,
    log: &Log<'_>,
) -> Option<Charge> {
    let (units, kilograms) = deck.units.in_air();
    let condition::Charge { mass, point, span, burst, negative, side } = *given;
    let root = Charge::root(mass * kilograms);
    let mut charge = Charge { point, root, span, burst, negative, units, greatest: 0.0 };
    let mesh = &assembly.mesh;
    let offsets = mesh.element_offsets();
    let mut nearest = f64::MAX;
    for (element, face) in faces {
        let p = offsets.partition_point(|&first| first <= *element as usize) - 1;
        let part = &mesh.parts[p];
        let nodes = part.nodes_of(*element as usize - offsets[p]);
        let places = part.side(usize::from(*face)).map(|c| mesh.positions[nodes[c] as usize]);
        let centre = std::array::from_fn(|a| 0.25 * places.iter().map(|x| x[a]).sum::<f64>());
        nearest = nearest.min(charge.scaled_distance(centre));
        let lower = match side {
            Side::Facing => charge.is_behind(places),
            Side::Upper => false,
            Side::Lower => true,
        };
        if lower && part.section().is_some() {
            *face = LOWER as u8;
        }
    }
    if nearest < burst.nearest() {
        let kind = if burst == Burst::Air { "an air burst" } else { "a surface burst" };
        log.fault(
            load.at,
            format!("{} {} m/kg^(1/3) from a face", load.title, short(nearest)),
            format!("a scaled distance of at least {} for {kind}", burst.nearest()),
            "move the charge away, or model it as a part of an explosive",
        );
        return None;
    }
    // Faces that fly towards it may come twice as near.
    charge.greatest = charge.reflected_peak(0.5 * nearest);
    Some(charge)
}

/// Warns of segments of shells in a keyword deck whose normals look away from the charge: the side is not theirs.
fn warn_of_segments(
    name: &str,
    charge: &Charge,
    load: &Load,
    faces: &[(u32, u8)],
    assembly: &Assembly,
    log: &Log<'_>,
) {
    let mesh = &assembly.mesh;
    let offsets = mesh.element_offsets();
    let key = |nodes: [u32; 4]| BTreeSet::from(nodes);
    let of_shells = faces.iter().filter_map(|(element, side)| {
        let p = offsets.partition_point(|&first| first <= *element as usize) - 1;
        let part = &mesh.parts[p];
        let nodes = part.nodes_of(*element as usize - offsets[p]);
        part.section().map(|_| key(part.side(usize::from(*side)).map(|c| nodes[c])))
    });
    let of_shells: BTreeSet<BTreeSet<u32>> = of_shells.collect();
    let behind = |nodes: &&[u32; 4]| charge.is_behind(nodes.map(|node| mesh.positions[node as usize]));
    let segments = assembly.segments.get(name).into_iter().flatten();
    let count = segments.filter(behind).filter(|nodes| of_shells.contains(&key(**nodes))).count();
    if count > 0 {
        log.warn(
            load.at,
            format!("{count} segments of shells look away from the charge: it loads the side that faces it"),
        );
    }
}

/// A pressure that moves; none after a fault.
fn moving_pressure(given: &condition::Moving, curves: &Curves<'_>) -> Option<MovingPressure> {
    let pressure = curves.drive(&given.pressure);
    let profile = match &given.profile {
        Some(name) => Some(curves.drive(&condition::Drive::along(name.clone(), 1.0))?.curve?),
        None => None,
    };
    let path = match &given.path {
        condition::Path::Velocity { start, velocity } => {
            Path::Velocity { start: *start, velocity: curves.components(velocity)? }
        }
        condition::Path::Places(places) => Path::Places(places.clone()),
    };
    let axis = region::unit(given.axis);
    Some(MovingPressure {
        pressure: pressure?,
        profile,
        radius: given.radius,
        axis,
        path,
        points: given.points,
    })
}

/// Adds a force on some nodes.
fn push(draft: &mut LoadDraft, load: &Load, force: NodalForce, nodes: Vec<u32>, log: &Log<'_>) {
    let index = draft.list.forces.len();
    if index == MAX_FORCES {
        log.fault(
            load.at,
            format!("more than {MAX_FORCES} loads of types force and acceleration"),
            format!("at most {MAX_FORCES}"),
            "give more nodes the same force",
        );
    }
    if index >= MAX_FORCES {
        return;
    }
    draft.list.forces.push(force);
    for node in nodes {
        *draft.forces.entry(node).or_default() |= 1 << index;
    }
}

/// The masses that the deck puts at nodes, by node and ascending; those at one node are added up.
pub(super) fn lumped(
    deck: &Deck,
    names: &Names<'_>,
    parts: &[PartDraft],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Vec<(u32, f64)> {
    let mut masses: BTreeMap<u32, f64> = BTreeMap::new();
    for given in &deck.masses {
        let selected = names.several(&given.parts).unwrap_or_default();
        let nodes = given.nodes.as_ref().and_then(|nodes| region::nodes(nodes, &selected, assembly, log));
        let (Some(mass), Some(nodes)) = (given.mass, nodes) else { continue };
        if nodes.is_empty() && !broken(&selected, parts) {
            log.fault(
                given.at,
                format!("{} that holds no node", given.title),
                "at least one node",
                "check parts, face, box, plane or nodes against the mesh",
            );
        }
        nodes.into_iter().for_each(|node| *masses.entry(node).or_default() += mass);
    }
    masses.into_iter().collect()
}
