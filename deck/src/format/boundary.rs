//! `[[boundary]]`: prescribed velocities by node, faces that transmit.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::{
    load::{Drive, Loads, SurfaceKind, SurfaceLoad},
    setup::{Constraint, MAX_WALLS},
    wall::RigidWall,
};

use super::{
    MAX_ENTRIES, Names, PartDraft,
    curve::Curves,
    load,
    rigid::{self, RigidDraft},
    wall,
};
use crate::{
    assembly::Assembly,
    check::{Face, outer_faces},
    fault::nearest,
    geometry::{dot, norm, scaled, sub},
    table::{Range, Table, Value},
};

/// Distance at which a node counts as on a plane or inside a box, over the smallest edge of its part.
pub(super) const ON_PLANE: f64 = 1e-3;

const TYPES: [&str; 4] = ["fixed", "velocity", "symmetry", "transmit"];

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Constraints, walls and loads of the deck.
pub(crate) struct Conditions {
    pub(crate) constraints: Vec<Constraint>,
    pub(crate) constraint: Vec<u16>,
    pub(crate) walls: Vec<RigidWall>,
    pub(crate) loads: Loads,
    /// Rigid bodies, to be made of the mesh.
    pub(crate) rigid: Vec<RigidDraft>,
}

/// One `[[boundary]]`: what it prescribes and where it stands.
struct Boundary {
    at: usize,
    velocity: Prescribed,
}

/// A drive as a key: bits of the factor, and the curve.
type DriveBits = Option<(u64, Option<u32>)>;

/// Velocities by axis.
type Prescribed = [Option<Drive>; 3];

/// Reads boundaries, walls and loads.
pub(crate) fn read(deck: &Table<'_>, names: &Names, parts: &[PartDraft], assembly: &Assembly) -> Conditions {
    let curves = Curves::read(deck);
    let turns = turning(assembly);
    let mut loads = load::read(deck, names, parts, assembly, &curves);
    let mut boundaries: Vec<Boundary> = Vec::new();
    // By node and axis: the boundary that prescribes it.
    let mut prescribed: BTreeMap<u32, [Option<usize>; 3]> = BTreeMap::new();
    // By node: axes about which it does not turn.
    let mut clamps: BTreeMap<u32, u8> = BTreeMap::new();
    // By pair of boundaries and axis: the first node both prescribe differently, and how many.
    let mut conflicts: BTreeMap<(usize, usize, usize), (u32, usize)> = BTreeMap::new();
    for table in deck.tables("boundary", MAX_ENTRIES) {
        let at = table.at;
        let kind = table
            .require("type", "one of fixed, velocity, symmetry, transmit")
            .and_then(|v| v.one_of(&TYPES));
        // Which keys belong depends on the type, so without one none is called unknown.
        let Some(kind) = kind else { continue };
        if TYPES[kind] == "transmit" {
            let faces = read_faces(&table, names, parts, assembly);
            let selected = names.of_table(&table);
            if let Some(p) = selected.into_iter().find(|&p| assembly.mesh.parts[p].section().is_some()) {
                let read = format!("{} on part \"{}\" of shells", table.title, parts[p].name);
                table.faults.add(table.at, read, "parts of solids", "name them under parts");
            }
            table.finish();
            loads.list.surfaces.push(SurfaceLoad { kind: SurfaceKind::Transmit, faces });
            continue;
        }
        let read = read_boundary(&table, TYPES[kind], names, parts, assembly, &curves);
        table.finish();
        let Some((velocity, clamped, nodes)) = read else { continue };
        let this = boundaries.len();
        boundaries.push(Boundary { at, velocity });
        for node in nodes {
            if clamped != 0 && turns[node as usize] {
                *clamps.entry(node).or_default() |= clamped;
            }
            let held = prescribed.entry(node).or_default();
            for axis in 0..3 {
                if velocity[axis].is_none() {
                    continue;
                }
                match held[axis] {
                    Some(other) if boundaries[other].velocity[axis] != velocity[axis] => {
                        conflicts.entry((other, this, axis)).or_insert((node, 0)).1 += 1;
                    }
                    _ => held[axis] = Some(this),
                }
            }
        }
    }
    for ((first, second, axis), (node, count)) in conflicts {
        let value = |b: usize| boundaries[b].velocity[axis].map(|v| curves.words(v)).unwrap_or_default();
        let (line, _) = deck.faults.place(boundaries[first].at);
        deck.faults.add(
            boundaries[second].at,
            format!(
                "{} velocity {} at node {} and {} more",
                AXES[axis],
                value(second),
                assembly.mesh.node_ids[node as usize],
                count - 1
            ),
            format!("{}, as the boundary at line {line} prescribes there", value(first)),
            "take the nodes out of one of the two",
        );
    }
    let mut walls = Vec::new();
    // By node: the walls that name it, one bit each. Walls that name parts are bound at the start of a run.
    let mut touched: BTreeMap<u32, u32> = BTreeMap::new();
    for table in deck.tables("wall", MAX_ENTRIES) {
        let at = table.at;
        let Some((wall, nodes)) = wall::read(table, names, assembly, &curves) else { continue };
        if nodes.is_some() && walls.len() >= MAX_WALLS {
            deck.faults.add(at, "a wall by nodes after 32 others", "at most 32 walls", "join some");
            continue;
        }
        for node in nodes.into_iter().flatten() {
            *touched.entry(node).or_default() |= 1 << walls.len();
        }
        walls.push(wall);
    }
    let rigid = rigid::read(deck, names, &curves);
    let (constraints, constraint) =
        number(deck, &boundaries, &prescribed, &clamps, &loads.forces, &touched, assembly.mesh.n_nodes());
    let loads = Loads { curves: curves.list, ..loads.list };
    Conditions { constraints, constraint, walls, loads, rigid }
}

/// Numbers the different constraints; entry 0 is free.
fn number(
    deck: &Table<'_>,
    boundaries: &[Boundary],
    prescribed: &BTreeMap<u32, [Option<usize>; 3]>,
    clamps: &BTreeMap<u32, u8>,
    forces: &BTreeMap<u32, u32>,
    touched: &BTreeMap<u32, u32>,
    n_nodes: usize,
) -> (Vec<Constraint>, Vec<u16>) {
    let mut list = vec![Constraint::default()];
    let mut known: BTreeMap<([DriveBits; 3], u32, u32, u8), u16> = BTreeMap::new();
    let mut of_node = vec![0u16; n_nodes];
    let nodes: BTreeSet<u32> =
        prescribed.keys().chain(clamps.keys()).chain(forces.keys()).chain(touched.keys()).copied().collect();
    for node in nodes {
        let held = prescribed.get(&node).copied().unwrap_or_default();
        let forces = forces.get(&node).copied().unwrap_or_default();
        let walls = touched.get(&node).copied().unwrap_or_default();
        let clamped = clamps.get(&node).copied().unwrap_or_default();
        let velocity = [0, 1, 2].map(|axis| held[axis].and_then(|b| boundaries[b].velocity[axis]));
        let key = (velocity.map(|v| v.map(|v| (v.factor.to_bits(), v.curve))), forces, walls, clamped);
        let next = list.len();
        let index = match known.get(&key) {
            Some(index) => *index,
            None => {
                let Ok(index) = u16::try_from(next) else {
                    deck.faults.add(
                        boundaries.first().map_or(0, |boundary| boundary.at),
                        format!("more than {} different constraints", u16::MAX),
                        "fewer",
                        "give more nodes the same velocities and forces",
                    );
                    return (list, of_node);
                };
                list.push(Constraint { velocity, walls, forces, clamped });
                known.insert(key, index);
                index
            }
        };
        of_node[node as usize] = index;
    }
    (list, of_node)
}

/// What a boundary prescribes, and its nodes.
fn read_boundary(
    table: &Table<'_>,
    kind: &str,
    names: &Names,
    parts: &[PartDraft],
    assembly: &Assembly,
    curves: &Curves,
) -> Option<(Prescribed, u8, Vec<u32>)> {
    let selected = names.of_table(table);
    // A part that could not be read has no nodes to select; that is no second fault.
    let broken = selected.is_empty() || selected.iter().any(|&p| parts[p].block.is_none());
    let (velocity, clamped, nodes) = match kind {
        "symmetry" => {
            let axis = table.require("axis", "one of x, y, z").and_then(|v| v.one_of(&AXES));
            let place = table.number_or("at", 0.0, Range::Any);
            let axis = axis?;
            let mut velocity = [None; 3];
            velocity[axis] = Some(Drive::constant(0.0));
            let nodes = choose(assembly, &selected, |x, near| (x[axis] - place).abs() <= near);
            // The plane turns only with itself.
            (velocity, 0b111 & !(1 << axis), nodes)
        }
        kind => {
            let clamped = match table.get("rotations") {
                None => Some(0),
                Some(value) => read_letters(value),
            };
            let velocity = if kind == "fixed" {
                read_axes(table, clamped.is_some_and(|clamped| clamped != 0))
            } else {
                read_velocity(table, curves)
            };
            let nodes = read_nodes(table, &selected, assembly);
            (velocity?, clamped?, nodes?)
        }
    };
    if nodes.is_empty() && !broken {
        table.faults.add(
            table.at,
            format!("{} that holds no node", table.title),
            "at least one node",
            "check parts, face, box, plane or axis against the mesh",
        );
    }
    Some((velocity, clamped, nodes))
}

/// Which nodes have shells and so turn, by global node.
fn turning(assembly: &Assembly) -> Vec<bool> {
    let mut turns = vec![false; assembly.mesh.n_nodes()];
    for part in assembly.mesh.parts.iter().filter(|part| part.section().is_some()) {
        for &n in &part.nodes {
            turns[n as usize] = true;
        }
    }
    turns
}

/// Bits of the axes that a text of the letters x, y, z names.
fn read_letters(value: Value<'_>) -> Option<u8> {
    let text = value.text()?;
    let mut bits = 0;
    for c in text.chars() {
        match AXES.iter().position(|axis| axis.starts_with(c)) {
            Some(axis) => bits |= 1 << axis,
            None => {
                value.fault("some of the letters x, y, z", "write for instance \"xz\"");
                return None;
            }
        }
    }
    Some(bits)
}

/// `axes = "xy"`: zero velocity on those; all three where it is absent. It may be empty where rotations are held.
fn read_axes(table: &Table<'_>, turns_held: bool) -> Option<Prescribed> {
    let Some(value) = table.get("axes") else { return Some([Some(Drive::constant(0.0)); 3]) };
    let text = value.text()?;
    let mut velocity = [None; 3];
    for c in text.chars() {
        match AXES.iter().position(|axis| axis.starts_with(c)) {
            Some(axis) => velocity[axis] = Some(Drive::constant(0.0)),
            None => {
                value.fault("some of the letters x, y, z", "write for instance \"xz\"");
                return None;
            }
        }
    }
    if velocity.iter().all(Option::is_none) && !turns_held {
        value.fault("some of the letters x, y, z", "write for instance \"xz\"");
        return None;
    }
    Some(velocity)
}

/// `velocity = { x = 1.0, z = { curve = "name" } }`: the axes not named stay free.
pub(super) fn read_velocity(table: &Table<'_>, curves: &Curves) -> Option<Prescribed> {
    read_components(table, "velocity", curves)
}

/// The same of any key.
pub(super) fn read_components(table: &Table<'_>, key: &'static str, curves: &Curves) -> Option<Prescribed> {
    let value = table.require(key, "a table of components such as { x = 1.0 }")?;
    let components = value.table(format!("{key} of {}", table.title))?;
    let mut velocity = [None; 3];
    let mut faulty = false;
    for (axis, name) in AXES.into_iter().enumerate() {
        if let Some(component) = components.get(name) {
            velocity[axis] = curves.drive(component);
            faulty |= velocity[axis].is_none();
        }
    }
    components.finish();
    if !faulty && velocity.iter().all(Option::is_none) {
        value.fault("at least one of x, y, z", "name the component that is prescribed");
        return None;
    }
    (!faulty).then_some(velocity)
}

/// The nodes of a boundary: all of its parts, or those of one face, box, plane or list.
pub(super) fn read_nodes(table: &Table<'_>, selected: &[usize], assembly: &Assembly) -> Option<Vec<u32>> {
    const WAYS: [&str; 4] = ["face", "box", "plane", "nodes"];
    let given: Vec<(&str, Value<'_>)> = WAYS.iter().filter_map(|w| table.get(w).map(|v| (*w, v))).collect();
    match given[..] {
        [] => Some(choose(assembly, selected, |_, _| true)),
        [("face", value)] => read_face(value, selected, assembly),
        [("box", value)] => {
            let region = value.table(format!("box of {}", table.title))?;
            let (low, high) = (region.vector("min"), region.vector("max"));
            region.finish();
            let (low, high) = (low?, high?);
            Some(choose(assembly, selected, |x, near| {
                (0..3).all(|a| x[a] >= low[a] - near && x[a] <= high[a] + near)
            }))
        }
        [("plane", value)] => {
            let plane = value.table(format!("plane of {}", table.title))?;
            let (point, normal) = (plane.vector("point"), read_direction(&plane, "normal"));
            plane.finish();
            let (point, normal) = (point?, normal?);
            Some(choose(assembly, selected, |x, near| dot(sub(x, point), normal).abs() <= near))
        }
        [("nodes", value)] if value.is_text() => {
            let name = value.text()?;
            let set = assembly.sets.get(name);
            if set.is_none() {
                let known = assembly.sets.keys().map(String::as_str);
                let advice = match nearest(name, known) {
                    Some(near) => format!("write \"{near}\""),
                    None => "add the set to the mesh file".to_string(),
                };
                value.fault("the name of a set of a mesh file", &advice);
            }
            Some(set?.clone())
        }
        [("nodes", value)] => {
            let mut nodes = Vec::new();
            for item in value.items()? {
                let Some(id) = item.integer(1, u64::from(u32::MAX)) else { continue };
                match assembly.node_of_id.get(&(id as u32)) {
                    Some(node) => nodes.push(*node),
                    None => item.fault("the number of a node", "list nodes of the mesh"),
                }
            }
            nodes.sort_unstable();
            nodes.dedup();
            Some(nodes)
        }
        _ => {
            let words: Vec<&str> = given.iter().map(|(way, _)| *way).collect();
            given[1].1.faults.add(
                given[1].1.at,
                words.join(" and "),
                "one of face, box, plane, nodes",
                "write one [[boundary]] for each",
            );
            None
        }
    }
}

/// The nodes of a named face of the selected parts.
fn read_face(value: Value<'_>, selected: &[usize], assembly: &Assembly) -> Option<Vec<u32>> {
    let name = value.text()?;
    let mut nodes = Vec::new();
    for &p in selected {
        let faces = &assembly.faces[p];
        match faces.iter().find(|(face, _)| *face == name) {
            Some((_, face)) => nodes.extend(face),
            None if assembly.mesh.parts[p].nodes.is_empty() => {}
            None => {
                let words: Vec<&str> = faces.iter().map(|(face, _)| *face).collect();
                let expected = if words.is_empty() {
                    format!("no face: part \"{}\" is an explicit mesh", assembly.mesh.parts[p].name)
                } else {
                    format!("one of {} of part \"{}\"", words.join(", "), assembly.mesh.parts[p].name)
                };
                value.fault(&expected, "choose one of them, or select with box, plane or nodes");
                return None;
            }
        }
    }
    nodes.sort_unstable();
    nodes.dedup();
    Some(nodes)
}

/// Nodes of the selected parts for which `fits(position, near)` holds, ascending; `near` is the distance at
/// which a node of that part counts as on a plane.
fn choose(assembly: &Assembly, selected: &[usize], fits: impl Fn([f64; 3], f64) -> bool) -> Vec<u32> {
    let mut nodes = Vec::new();
    for &p in selected {
        let near = ON_PLANE * assembly.smallest_edge[p];
        let part = &assembly.mesh.parts[p];
        nodes.extend(part.nodes.iter().filter(|n| fits(assembly.mesh.positions[**n as usize], near)));
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// A direction of any length, made one of unit length.
pub(super) fn read_direction(table: &Table<'_>, key: &'static str) -> Option<[f64; 3]> {
    let value = table.require(key, "[x, y, z]")?;
    let normal = value.vector()?;
    let long = norm(normal);
    if long > 0.0 && long.is_finite() {
        return Some(scaled(normal, 1.0 / long));
    }
    value.fault(
        &format!("{} {key} of some length", if key == "axis" { "an" } else { "a" }),
        "give a direction such as [0, 0, 1]",
    );
    None
}

/// The outer faces of the parts of a table whose nodes it selects; none is a fault.
pub(super) fn read_faces(
    table: &Table<'_>,
    names: &Names,
    parts: &[PartDraft],
    assembly: &Assembly,
) -> Vec<(u32, u8)> {
    let selected = names.of_table(table);
    let broken = selected.is_empty() || selected.iter().any(|&p| parts[p].block.is_none());
    let outer = outer_faces(assembly);
    if let Some(value) = table.get("segments") {
        return read_segments(value, assembly, &outer);
    }
    let Some(nodes) = read_nodes(table, &selected, assembly) else { return Vec::new() };
    let chosen = outer.iter().filter(|face| {
        !face.inside
            && selected.contains(&(face.part as usize))
            && face.nodes.iter().all(|n| nodes.binary_search(n).is_ok())
    });
    let faces: Vec<(u32, u8)> = chosen.map(|face| (face.element, face.side)).collect();
    if faces.is_empty() && !broken {
        table.faults.add(
            table.at,
            format!("{} that holds no face", table.title),
            "at least one outer face with all its nodes",
            "check parts, face, box, plane or nodes against the mesh",
        );
    }
    faces
}

/// The outer faces of a named set of a mesh file, whichever way round the file lists their nodes.
fn read_segments(value: Value<'_>, assembly: &Assembly, outer: &[Face]) -> Vec<(u32, u8)> {
    let Some(name) = value.text() else { return Vec::new() };
    let Some(set) = assembly.segments.get(name) else {
        let advice = match nearest(name, assembly.segments.keys().map(String::as_str)) {
            Some(near) => format!("write \"{near}\""),
            None => "add the segments to the mesh file".to_string(),
        };
        value.fault("the name of segments of a mesh file", &advice);
        return Vec::new();
    };
    let sorted = |mut nodes: [u32; 4]| {
        nodes.sort_unstable();
        nodes
    };
    let wanted: BTreeSet<[u32; 4]> = set.iter().map(|face| sorted(*face)).collect();
    let found: Vec<&Face> =
        outer.iter().filter(|face| !face.inside && wanted.contains(&sorted(face.nodes))).collect();
    if found.len() < wanted.len() || found.is_empty() {
        value.fault(
            &format!("{} outer faces of parts; {} of them are", wanted.len(), found.len()),
            "take out those that are not, and those that two parts share",
        );
    }
    found.into_iter().map(|face| (face.element, face.side)).collect()
}
