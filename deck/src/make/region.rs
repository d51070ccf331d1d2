//! The nodes and faces that entries of a deck speak of.

use std::collections::BTreeSet;

use super::{
    assembly::Assembly,
    part::PartDraft,
    surface::{Face, outer_faces},
};
use crate::{
    fault::nearest,
    geometry::{dot, norm, scaled, sub},
    log::Log,
    place::{Place, Placed},
    typed::condition::{Faces, Region},
};

/// Distance at which a node counts as on a plane or inside a box, over the smallest edge of its part.
pub(super) const ON_PLANE: f64 = 1e-3;

/// Whether some of the selected parts could not be read: then they have no nodes to select, which is no second fault.
pub(super) fn broken(selected: &[usize], parts: &[PartDraft]) -> bool {
    selected.is_empty() || selected.iter().any(|&p| parts[p].block.is_none())
}

/// A direction of unit length.
pub(super) fn unit(direction: [f64; 3]) -> [f64; 3] {
    scaled(direction, 1.0 / norm(direction))
}

/// The nodes of a region, ascending; none after a fault.
pub(super) fn nodes(
    region: &Region,
    selected: &[usize],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Option<Vec<u32>> {
    match region {
        Region::All => Some(choose(assembly, selected, |_, _| true)),
        Region::Faces(names) => {
            let faces: Option<Vec<Vec<u32>>> =
                names.iter().map(|name| of_face(name, selected, assembly, log)).collect();
            let mut nodes = faces?.concat();
            nodes.sort_unstable();
            nodes.dedup();
            Some(nodes)
        }
        Region::Box { low, high } => Some(choose(assembly, selected, |x, near| {
            (0..3).all(|a| x[a] >= low[a] - near && x[a] <= high[a] + near)
        })),
        Region::Plane { point, normal } => {
            let normal = unit(*normal);
            Some(choose(assembly, selected, |x, near| dot(sub(x, *point), normal).abs() <= near))
        }
        Region::Set(name) => {
            let set = assembly.sets.get(&name.value);
            if set.is_none() {
                let advice = match nearest(&name.value, assembly.sets.keys().map(String::as_str)) {
                    Some(near) => format!("write \"{near}\""),
                    None => "add the set to the mesh file".to_string(),
                };
                log.fault_of(name.origin, "the name of a set of a mesh file", advice);
            }
            set.cloned()
        }
        Region::Numbers(numbers) => {
            let mut nodes = Vec::new();
            for id in numbers {
                match assembly.node_of_id.get(id.value) {
                    Some(node) => nodes.push(node),
                    None => log.fault_of(id.origin, "the number of a node", "list nodes of the mesh"),
                }
            }
            nodes.sort_unstable();
            nodes.dedup();
            Some(nodes)
        }
    }
}

/// The nodes of a named face of the selected parts.
fn of_face(
    name: &Placed<String>,
    selected: &[usize],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Option<Vec<u32>> {
    let mut nodes = Vec::new();
    for &p in selected {
        let faces = &assembly.faces[p];
        match faces.iter().find(|(face, _)| *face == name.value) {
            Some((_, face)) => nodes.extend(face),
            None if assembly.mesh.parts[p].nodes.is_empty() => {}
            None => {
                let words: Vec<&str> = faces.iter().map(|(face, _)| *face).collect();
                let expected = if words.is_empty() {
                    format!("no face: part \"{}\" is an explicit mesh", assembly.mesh.parts[p].name)
                } else {
                    format!("one of {} of part \"{}\"", words.join(", "), assembly.mesh.parts[p].name)
                };
                let advice = "choose one of them, or select with box, plane or nodes";
                log.fault_of(name.origin, expected, advice);
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
pub(super) fn choose(
    assembly: &Assembly,
    selected: &[usize],
    fits: impl Fn([f64; 3], f64) -> bool,
) -> Vec<u32> {
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

/// The entry that asks for faces.
pub(super) struct Asking<'a> {
    pub(super) at: Place,
    pub(super) title: &'a str,
    /// Its parts.
    pub(super) selected: &'a [usize],
}

/// The outer faces of the selected parts that an entry means; none at all is a fault.
pub(super) fn faces(
    faces: &Faces,
    asking: &Asking<'_>,
    parts: &[PartDraft],
    assembly: &Assembly,
    log: &Log<'_>,
) -> Vec<(u32, u8)> {
    let selected = asking.selected;
    let outer = outer_faces(assembly);
    let region = match faces {
        Faces::Segments(name) => return segments(name, assembly, &outer, log),
        Faces::Of(region) => region,
    };
    let Some(nodes) = nodes(region, selected, assembly, log) else { return Vec::new() };
    let chosen = outer.iter().filter(|face| {
        !face.inside
            && selected.contains(&(face.part as usize))
            && face.nodes.iter().all(|n| nodes.binary_search(n).is_ok())
    });
    let faces: Vec<(u32, u8)> = chosen.map(|face| (face.element, face.side)).collect();
    if faces.is_empty() && !broken(selected, parts) {
        log.fault(
            asking.at,
            format!("{} that holds no face", asking.title),
            "at least one outer face with all its nodes",
            "check parts, face, box, plane or nodes against the mesh",
        );
    }
    faces
}

/// The outer faces of a named set of a mesh, whichever way round it lists their nodes.
fn segments(name: &Placed<String>, assembly: &Assembly, outer: &[Face], log: &Log<'_>) -> Vec<(u32, u8)> {
    let Some(set) = assembly.segments.get(&name.value) else {
        let advice = match nearest(&name.value, assembly.segments.keys().map(String::as_str)) {
            Some(near) => format!("write \"{near}\""),
            None => "add the segments to the mesh file".to_string(),
        };
        log.fault_of(name.origin, "the name of segments of a mesh file", advice);
        return Vec::new();
    };
    // A triangle may repeat any of its nodes.
    let sorted = |mut nodes: [u32; 4]| {
        nodes.sort_unstable();
        for i in 1..4 {
            if nodes[i] == nodes[i - 1] {
                nodes[i - 1] = u32::MAX;
            }
        }
        nodes.sort_unstable();
        nodes
    };
    let wanted: BTreeSet<[u32; 4]> = set.iter().map(|face| sorted(*face)).collect();
    let found: Vec<&Face> =
        outer.iter().filter(|face| !face.inside && wanted.contains(&sorted(face.nodes))).collect();
    if found.len() < wanted.len() || found.is_empty() {
        log.fault_of(
            name.origin,
            format!("{} outer faces of parts; {} of them are", wanted.len(), found.len()),
            "take out those that are not, and those that two parts share",
        );
    }
    found.into_iter().map(|face| (face.element, face.side)).collect()
}
