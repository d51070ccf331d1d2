//! The outer faces of parts, as far as the checks need them.

use mechanics::mesh::Topology;

use super::assembly::Assembly;
use crate::geometry::{FACES, key_of_face, norm, sub};

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
        let mut add = |element: usize, side: u8, nodes: [u32; 4]| {
            let Some(key) = key_of_face(nodes) else { return };
            let element = (offsets[p] + element) as u32;
            keyed.push((key, order, Face { part: p as u32, element, side, nodes, inside: false }));
            order += 1;
        };
        match &part.topology {
            Topology::Tetrahedra { .. } => {
                for e in 0..part.n_elements() {
                    let own = part.nodes_of(e);
                    for &side in part.sides() {
                        add(e, side as u8, part.side(side).map(|node| own[node]));
                    }
                }
            }
            Topology::Structured { cells } => {
                for e in outer_cells(*cells) {
                    let corners = part.corners(e);
                    for (f, face) in FACES.iter().enumerate().filter(|(f, _)| on_side(*cells, e, *f)) {
                        add(e, side[f], face.map(|corner| corners[corner]));
                    }
                }
            }
            _ => {
                for e in 0..part.n_elements() {
                    let corners = part.corners(e);
                    // A shell is one face, its upper side.
                    for (f, face) in FACES.iter().enumerate().filter(|(f, _)| part.sides().contains(f)) {
                        add(e, side[f], face.map(|corner| corners[corner]));
                    }
                }
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

/// Elements of a grid that lie on one of its sides, ascending.
fn outer_cells(cells: [u32; 3]) -> impl Iterator<Item = usize> {
    let [ni, nj, nk] = cells.map(|c| c as usize);
    (0..nj * nk).flat_map(move |row| {
        let (j, k) = (row % nj, row / nj);
        let is_outer = j == 0 || j + 1 == nj || k == 0 || k + 1 == nk;
        let step = if is_outer || ni < 2 { 1 } else { ni - 1 };
        (0..ni).step_by(step).map(move |i| i + ni * row)
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outer_cells_are_those_with_a_face_on_a_side_of_the_grid() {
        for cells in [[1, 1, 1], [2, 1, 3], [4, 5, 6], [3, 3, 3], [1, 7, 2], [9, 2, 4]] {
            let n: u32 = cells.iter().product();
            let expected: Vec<usize> =
                (0..n as usize).filter(|&e| (0..6).any(|f| on_side(cells, e, f))).collect();
            assert_eq!(outer_cells(cells).collect::<Vec<_>>(), expected, "{cells:?}");
        }
    }
}
