//! `[[boundary]]` and `[[wall]]`: prescribed velocities by node, rigid planes by part.

use std::collections::BTreeMap;

use mechanics::setup::{Constraint, RigidWall};

use super::{MAX_ENTRIES, Names, PartDraft};
use crate::{
    assembly::Assembly,
    fault::short,
    geometry::{dot, norm, scaled, sub},
    table::{Range, Table, Value},
};

/// Distance at which a node counts as on a plane or inside a box, over the smallest edge of its part.
const ON_PLANE: f64 = 1e-3;

const TYPES: [&str; 3] = ["fixed", "velocity", "symmetry"];

const AXES: [&str; 3] = ["x", "y", "z"];

/// Constraints and walls of the deck.
pub(crate) struct Conditions {
    pub(crate) constraints: Vec<Constraint>,
    pub(crate) constraint: Vec<u16>,
    pub(crate) walls: Vec<RigidWall>,
}

/// One `[[boundary]]`: what it prescribes and where it stands.
struct Boundary {
    at: usize,
    velocity: [Option<f64>; 3],
}

/// Reads boundaries and walls.
pub(crate) fn read(deck: &Table<'_>, names: &Names, parts: &[PartDraft], assembly: &Assembly) -> Conditions {
    let mut boundaries: Vec<Boundary> = Vec::new();
    // By node and axis: the boundary that prescribes it.
    let mut prescribed: BTreeMap<u32, [Option<usize>; 3]> = BTreeMap::new();
    // By pair of boundaries and axis: the first node both prescribe differently, and how many.
    let mut conflicts: BTreeMap<(usize, usize, usize), (u32, usize)> = BTreeMap::new();
    for table in deck.tables("boundary", MAX_ENTRIES) {
        let at = table.at;
        let kind = table.require("type", "one of fixed, velocity, symmetry").and_then(|v| v.one_of(&TYPES));
        // Which keys belong depends on the type, so without one none is called unknown.
        let Some(kind) = kind else { continue };
        let read = read_boundary(&table, TYPES[kind], names, parts, assembly);
        table.finish();
        let Some((velocity, nodes)) = read else { continue };
        let this = boundaries.len();
        boundaries.push(Boundary { at, velocity });
        for node in nodes {
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
        let value = |b: usize| boundaries[b].velocity[axis].unwrap_or_default();
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
    let (constraints, constraint) = number(deck, &boundaries, &prescribed, assembly.mesh.n_nodes());
    let walls = deck
        .tables("wall", MAX_ENTRIES)
        .into_iter()
        .filter_map(|table| read_wall(table, names, assembly))
        .collect();
    Conditions { constraints, constraint, walls }
}

/// Numbers the different constraints; entry 0 is free.
fn number(
    deck: &Table<'_>,
    boundaries: &[Boundary],
    prescribed: &BTreeMap<u32, [Option<usize>; 3]>,
    n_nodes: usize,
) -> (Vec<Constraint>, Vec<u16>) {
    let mut list = vec![Constraint::default()];
    let mut known: BTreeMap<[Option<u64>; 3], u16> = BTreeMap::new();
    let mut of_node = vec![0u16; n_nodes];
    for (node, held) in prescribed {
        let velocity = [0, 1, 2].map(|axis| held[axis].and_then(|b| boundaries[b].velocity[axis]));
        let key = velocity.map(|v| v.map(f64::to_bits));
        let next = list.len();
        let index = match known.get(&key) {
            Some(index) => *index,
            None => {
                let Ok(index) = u16::try_from(next) else {
                    deck.faults.add(
                        boundaries[0].at,
                        format!("more than {} different constraints", u16::MAX),
                        "fewer",
                        "prescribe the same velocities to more nodes",
                    );
                    return (list, of_node);
                };
                list.push(Constraint { velocity, walls: 0 });
                known.insert(key, index);
                index
            }
        };
        of_node[*node as usize] = index;
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
) -> Option<([Option<f64>; 3], Vec<u32>)> {
    let selected = names.of_table(table);
    // A part that could not be read has no nodes to select; that is no second fault.
    let broken = selected.is_empty() || selected.iter().any(|&p| parts[p].block.is_none());
    let (velocity, nodes) = match kind {
        "symmetry" => {
            let axis = table.require("axis", "one of x, y, z").and_then(|v| v.one_of(&AXES));
            let place = table.number_or("at", 0.0, Range::Any);
            let axis = axis?;
            let mut velocity = [None; 3];
            velocity[axis] = Some(0.0);
            let nodes = choose(assembly, &selected, |x, near| (x[axis] - place).abs() <= near);
            (velocity, nodes)
        }
        kind => {
            let velocity = if kind == "fixed" { read_axes(table) } else { read_velocity(table) };
            let nodes = read_nodes(table, &selected, assembly);
            (velocity?, nodes?)
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
    Some((velocity, nodes))
}

/// `axes = "xy"`: zero velocity on those; all three where it is absent.
fn read_axes(table: &Table<'_>) -> Option<[Option<f64>; 3]> {
    let Some(value) = table.get("axes") else { return Some([Some(0.0); 3]) };
    let text = value.text()?;
    let mut velocity = [None; 3];
    for c in text.chars() {
        match AXES.iter().position(|axis| axis.starts_with(c)) {
            Some(axis) => velocity[axis] = Some(0.0),
            None => {
                value.fault("some of the letters x, y, z", "write for instance \"xz\"");
                return None;
            }
        }
    }
    if velocity.iter().all(Option::is_none) {
        value.fault("some of the letters x, y, z", "write for instance \"xz\"");
        return None;
    }
    Some(velocity)
}

/// `velocity = { x = 1.0, z = 0.0 }`: the axes not named stay free.
fn read_velocity(table: &Table<'_>) -> Option<[Option<f64>; 3]> {
    let value = table.require("velocity", "a table of components such as { x = 1.0 }")?;
    let components = value.table(format!("velocity of {}", table.title))?;
    let mut velocity = [None; 3];
    let mut faulty = false;
    for (axis, name) in AXES.into_iter().enumerate() {
        if let Some(component) = components.get(name) {
            velocity[axis] = component.number(Range::Any);
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
fn read_nodes(table: &Table<'_>, selected: &[usize], assembly: &Assembly) -> Option<Vec<u32>> {
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
            let (point, normal) = (plane.vector("point"), read_normal(&plane));
            plane.finish();
            let (point, normal) = (point?, normal?);
            Some(choose(assembly, selected, |x, near| dot(sub(x, point), normal).abs() <= near))
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

/// A normal of any length, made one of unit length.
fn read_normal(table: &Table<'_>) -> Option<[f64; 3]> {
    let value = table.require("normal", "[x, y, z]")?;
    let normal = value.vector()?;
    let long = norm(normal);
    if long > 0.0 && long.is_finite() {
        return Some(scaled(normal, 1.0 / long));
    }
    value.fault("a normal of some length", "give a direction such as [0, 0, 1]");
    None
}

/// One `[[wall]]`; a part that starts behind it is a fault.
fn read_wall(table: Table<'_>, names: &Names, assembly: &Assembly) -> Option<RigidWall> {
    let point = table.vector("point");
    let normal = read_normal(&table);
    let friction = table.number_or("friction", 0.0, Range::NotNegative);
    let selected = names.of_table(&table);
    let (at, title, faults) = (table.at, table.title.clone(), table.faults);
    table.finish();
    let (point, normal) = (point?, normal?);
    let mut parts = vec![false; names.len()];
    for &p in &selected {
        parts[p] = true;
        let part = &assembly.mesh.parts[p];
        let height = |node: u32| dot(sub(assembly.mesh.positions[node as usize], point), normal);
        let deepest = part.nodes.iter().copied().min_by(|a, b| height(*a).total_cmp(&height(*b)));
        let Some(deepest) = deepest else { continue };
        if height(deepest) < -ON_PLANE * assembly.smallest_edge[p] {
            faults.add(
                at,
                format!(
                    "{title} with node {} of part \"{}\" {} behind it",
                    assembly.mesh.node_ids[deepest as usize],
                    part.name,
                    short(-height(deepest))
                ),
                "every node on the side of the normal",
                "turn the normal, move the wall or the part, or leave the part out of parts",
            );
        }
    }
    Some(RigidWall { point, normal, friction, parts })
}
