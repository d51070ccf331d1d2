//! Cross-sections: the elements that are cut, by a plane or as listed, and their corners ahead of the cut.

use std::collections::BTreeMap;

use mechanics::{cross_section::CrossSection, exact::Quantum, mesh::Part, rigid::Body};

use super::{
    assembly::Assembly,
    names::Names,
    region::{self, ON_PLANE, unit},
};
use crate::{
    geometry::{dot, norm, sub},
    log::Log,
    model::Section,
    place::{Origin, Placed},
    typed::{
        Cut, Deck,
        condition::{Parts, Region},
    },
};

/// The sections of a deck. Elements of rigid bodies have no forces and are never cut.
pub(super) fn make(
    deck: &Deck,
    names: &Names<'_>,
    assembly: &Assembly,
    bodies: &[Body],
    log: &Log<'_>,
) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    for given in &deck.sections {
        if let Some(name) = &given.name
            && sections.iter().any(|section| section.name == name.value)
        {
            log.fault_of(name.origin, "a name that no other section has", "choose another name");
        }
        let chosen = match &given.cut {
            Cut::Plane { plane, parts, radius } => by_plane(*plane, parts, *radius, names, assembly, bodies),
            Cut::Listed { nodes, elements } => listed(nodes, elements, assembly, bodies, log),
        };
        let (Some(name), Some((cuts, is_whole))) = (&given.name, chosen) else { continue };
        if cuts.is_empty() && is_whole {
            let (expected, advice) = match given.cut {
                Cut::Plane { .. } => (
                    "a plane with nodes of an element that deforms on both sides",
                    "check point, normal, radius and parts against the mesh",
                ),
                Cut::Listed { .. } => (
                    "an element that deforms and has some of the nodes, not all",
                    "list the nodes of the cut and the elements behind it",
                ),
            };
            log.fault(given.at, format!("{} that cuts nothing", given.title), expected, advice);
        }
        let cut = section(cuts, assembly);
        sections.push(Section { name: name.value.clone(), cut });
    }
    sections
}

/// Elements with a bit for each node ahead.
type Cuts = Vec<(u32, u16)>;

/// Bits of the nodes that are ahead; none of an element of which all are or none is.
fn ahead(n_corners: usize, is_ahead: impl Fn(usize) -> bool) -> Option<u16> {
    let ahead: u16 = (0..n_corners).map(|i| u16::from(is_ahead(i)) << i).sum();
    let all = (0..n_corners).map(|i| 1 << i).sum::<u16>();
    (ahead != 0 && ahead != all).then_some(ahead)
}

fn is_rigid(bodies: &[Body], part: usize) -> bool {
    bodies.iter().any(|body| body.parts.contains(&(part as u32)))
}

/// What a plane cuts, and whether all its parts have elements: one without has a fault of its own. None where the plane or its parts could
/// not be read. A node on the plane is ahead of it.
fn by_plane(
    plane: Option<[[f64; 3]; 2]>,
    parts: &Parts,
    radius: Option<f64>,
    names: &Names<'_>,
    assembly: &Assembly,
    bodies: &[Body],
) -> Option<(Cuts, bool)> {
    let mut selected = names.several(parts)?;
    selected.retain(|&p| !is_rigid(bodies, p));
    let [point, normal] = plane?;
    let normal = unit(normal);
    let mesh = &assembly.mesh;
    let offsets = mesh.element_offsets();
    let mut cuts = Vec::new();
    for &p in &selected {
        let part: &Part = &mesh.parts[p];
        let near = ON_PLANE * assembly.smallest_edge[p];
        for e in 0..part.n_elements() {
            let corners = part.corners_at(e, &mesh.positions);
            let nodes = part.nodes_of(e);
            let is_ahead = |i: usize| dot(sub(mesh.positions[nodes[i] as usize], point), normal) >= -near;
            let centre = [0, 1, 2].map(|a| 0.125 * corners.iter().map(|x| x[a]).sum::<f64>());
            if radius.is_some_and(|radius| norm(sub(centre, point)) > radius) {
                continue;
            }
            cuts.extend(ahead(part.n_corners(), is_ahead).map(|ahead| ((offsets[p] + e) as u32, ahead)));
        }
    }
    let is_whole = selected.iter().all(|&p| mesh.parts[p].n_elements() > 0);
    Some((cuts, is_whole))
}

/// Which of [`Cut::Listed`] the elements of a part are among.
fn kind_of(part: &Part) -> usize {
    match part.n_corners() {
        8 | 10 => 0,
        4 => 1,
        _ => 2,
    }
}

/// What listed nodes and elements cut; none after a fault.
fn listed(
    nodes: &Region,
    elements: &[Vec<Placed<u32>>; 3],
    assembly: &Assembly,
    bodies: &[Body],
    log: &Log<'_>,
) -> Option<(Cuts, bool)> {
    let mesh = &assembly.mesh;
    let all: Vec<usize> = (0..mesh.parts.len()).collect();
    let nodes = region::nodes(nodes, &all, assembly, log)?;
    let wanted: [BTreeMap<u32, Origin>; 3] =
        elements.each_ref().map(|list| list.iter().map(|id| (id.value, id.origin)).collect());
    let mut missing = wanted.clone();
    let mut cuts = Vec::new();
    for ((p, part), offset) in mesh.parts.iter().enumerate().zip(mesh.element_offsets()) {
        let kind = kind_of(part);
        for (e, id) in part.element_ids.iter().enumerate().filter(|(_, id)| wanted[kind].contains_key(id)) {
            missing[kind].remove(id);
            let corners = part.nodes_of(e);
            let ahead = ahead(part.n_corners(), |i| nodes.binary_search(&corners[i]).is_ok());
            if !is_rigid(bodies, p) {
                cuts.extend(ahead.map(|ahead| ((offset + e) as u32, ahead)));
            }
        }
    }
    for (what, missing) in ["a solid", "a shell", "a truss or a beam"].into_iter().zip(&missing) {
        for origin in missing.values() {
            log.fault_of(*origin, format!("the number of {what}"), "list elements of the mesh");
        }
    }
    missing.iter().all(BTreeMap::is_empty).then_some((cuts, true))
}

/// The section of these cuts.
fn section(elements: Cuts, assembly: &Assembly) -> CrossSection {
    let mesh = &assembly.mesh;
    let offsets = mesh.element_offsets();
    let (mut sum, mut n_corners) = ([0.0; 3], 0.0);
    for &(element, ahead) in &elements {
        let p = offsets.partition_point(|&first| first <= element as usize) - 1;
        let corners = mesh.parts[p].nodes_of(element as usize - offsets[p]);
        for (_, node) in corners.iter().enumerate().filter(|(i, _)| ahead >> i & 1 == 1) {
            for (sum, x) in sum.iter_mut().zip(mesh.positions[*node as usize]) {
                *sum += x;
            }
            n_corners += 1.0;
        }
    }
    let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max].map(|of_two| {
        let positions = mesh.positions.iter().copied();
        positions.reduce(|a, b| std::array::from_fn(|i| of_two(a[i], b[i]))).unwrap_or_default()
    });
    let length = norm(sub(high, low));
    CrossSection {
        origin: if n_corners > 0.0 { sum.map(|sum| sum / n_corners) } else { low },
        arm: if length > 0.0 && length.is_finite() { Quantum::for_reference(length, 0).value() } else { 1.0 },
        elements,
    }
}
