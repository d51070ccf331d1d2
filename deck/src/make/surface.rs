//! The outer faces of parts, as far as the checks need them.

use mechanics::mesh::Topology;

use super::assembly::Assembly;
use crate::geometry::{FACES, norm, sub};

/// An outer face of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    pub(super) part: u32,
    /// Global element, and which [side](mechanics::mesh::Part::side) of it; those of hexahedra are in another order than our faces.
    pub(super) element: u32,
    pub(super) side: u8,
    /// Global nodes, outward by the right hand.
    pub(super) nodes: [u32; 4],
    /// Whether another part has the same face: joined bodies touch there and contact does not see it.
    pub(super) inside: bool,
}

/// Faces that one element of their part has, in the order of parts and elements.
pub(super) fn outer_faces(assembly: &Assembly) -> Vec<Face> {
    let mut keyed: Vec<([u32; 4], u64, Face)> = Vec::new();
    let mut order = 0;
    let offsets = assembly.mesh.element_offsets();
    let side = FACES.map(side_of);
    for (p, part) in assembly.mesh.parts.iter().enumerate() {
        let first = keyed.len();
        for e in 0..part.n_elements() {
            if let Topology::Tetrahedra { .. } = part.topology {
                let (own, element) = (part.nodes_of(e), (offsets[p] + e) as u32);
                for &side in part.sides() {
                    let nodes = part.side(side).map(|node| own[node]);
                    let Some(key) = key_of(nodes) else { continue };
                    let face = Face { part: p as u32, element, side: side as u8, nodes, inside: false };
                    keyed.push((key, order, face));
                    order += 1;
                }
                continue;
            }
            let corners = part.corners(e);
            for (f, face) in FACES.iter().enumerate() {
                // A shell is one face, its upper side.
                if !part.sides().contains(&f) {
                    continue;
                }
                if let Topology::Structured { cells } = &part.topology
                    && !on_side(*cells, e, f)
                {
                    continue;
                }
                let nodes = face.map(|c| corners[c]);
                let element = (offsets[p] + e) as u32;
                let Some(key) = key_of(nodes) else { continue };
                keyed.push((
                    key,
                    order,
                    Face { part: p as u32, element, side: side[f], nodes, inside: false },
                ));
                order += 1;
            }
        }
        if matches!(part.topology, Topology::Explicit { .. } | Topology::Tetrahedra { .. }) {
            let mut own = keyed.split_off(first);
            own.sort_unstable_by_key(|(key, order, _)| (*key, *order));
            keyed.extend(own.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0]));
        }
    }
    if !assembly.joined.is_empty() {
        keyed.sort_unstable_by_key(|(key, order, _)| (*key, *order));
        for same in keyed.chunk_by_mut(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
            for (_, _, face) in same {
                face.inside = true;
            }
        }
    }
    keyed.sort_unstable_by_key(|(_, order, _)| *order);
    keyed.into_iter().map(|(_, _, face)| face).collect()
}

/// What two elements at a face have in common: its nodes, each once. None where an element that repeats corners has
/// drawn the face to an edge.
fn key_of(mut nodes: [u32; 4]) -> Option<[u32; 4]> {
    nodes.sort_unstable();
    for i in 1..4 {
        if nodes[i] == nodes[i - 1] {
            nodes[i - 1] = u32::MAX;
        }
    }
    nodes.sort_unstable();
    (nodes[2] != u32::MAX).then_some(nodes)
}

/// The index into [`mechanics::mesh::FACES`] of the face with these corners.
fn side_of(mut corners: [usize; 4]) -> u8 {
    corners.sort_unstable();
    let same = |face: &[usize; 4]| {
        let mut other = *face;
        other.sort_unstable();
        other == corners
    };
    mechanics::mesh::FACES.iter().position(same).expect("a hexahedron has six faces") as u8
}

/// Whether face `f` of element `e` of a grid lies on the grid's side.
fn on_side(cells: [u32; 3], e: usize, f: usize) -> bool {
    let [ni, nj, nk] = cells.map(|c| c as usize);
    let (i, j, k) = (e % ni, e / ni % nj, e / ni / nj);
    // In the order of FACES.
    [k == 0, k == nk - 1, j == 0, j == nj - 1, i == ni - 1, i == 0][f]
}

/// The shortest edge of the outer faces of parts that meet any part; none where there is no such face.
pub(super) fn smallest_face_dimension(
    assembly: &Assembly,
    faces: &[Face],
    interacts: &[bool],
) -> Option<f64> {
    let n = assembly.mesh.parts.len();
    let meets: Vec<bool> = (0..n).map(|p| interacts[p * n..(p + 1) * n].contains(&true)).collect();
    let mut smallest = f64::INFINITY;
    for face in faces.iter().filter(|face| meets[face.part as usize] && !face.inside) {
        for side in 0..4 {
            let ends = [side, (side + 1) % 4].map(|corner| face.nodes[corner]);
            if ends[0] != ends[1] {
                let [a, b] = ends.map(|node| assembly.mesh.positions[node as usize]);
                smallest = smallest.min(norm(sub(a, b)));
            }
        }
    }
    (smallest > 0.0 && smallest.is_finite()).then_some(smallest)
}
