//! Forms of the elements in a part of hexahedra.
//!
//! A wedge, a pyramid or a tetrahedron of four nodes is written as a hexahedron some of whose corners are the same node, so that meshes,
//! surfaces and cuts know one list of eight corners. It is computed as an element of its own form
//! ([`uniform`](crate::element::uniform)), whose nodes carry the mass that belongs to them.

use super::MAX_NODES;

/// What the corners of an element make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Eight nodes; also what has fewer and is none of the others.
    Hexahedron,
    /// Six nodes: two edges of one face have collapsed.
    Wedge,
    /// Five nodes: a face has collapsed to the apex.
    Pyramid,
    /// Four nodes: a face and an edge of the face across have collapsed.
    Tetrahedron,
}

impl Form {
    pub const ALL: [Self; 4] = [Self::Hexahedron, Self::Wedge, Self::Pyramid, Self::Tetrahedron];

    /// The form of an element with these corners.
    pub fn of(corners: &[u32; 8]) -> Self {
        Self::turned(*corners).0
    }

    /// The form of an element, and its corners turned so that they are, by nodes, `0 1 2 3 4 4 6 6` of a wedge with triangles `0 1 4` and
    /// `3 2 6`, `0 1 2 3 4 4 4 4` of a pyramid, `0 1 2 2 4 4 4 4` of a tetrahedron.
    pub fn turned(corners: [u32; 8]) -> (Self, [u32; 8]) {
        if differ(&corners) {
            return (Self::Hexahedron, corners);
        }
        for rotation in ROTATIONS {
            let c = rotation.map(|corner| corners[corner]);
            let is_apex = c[4] == c[5] && c[5] == c[6] && c[6] == c[7];
            let form = if c[4] == c[5] && c[6] == c[7] && differ(&[c[0], c[1], c[2], c[3], c[4], c[6]]) {
                Self::Wedge
            } else if is_apex && differ(&[c[0], c[1], c[2], c[3], c[4]]) {
                Self::Pyramid
            } else if is_apex && c[2] == c[3] && differ(&[c[0], c[1], c[2], c[4]]) {
                Self::Tetrahedron
            } else {
                continue;
            };
            return (form, c);
        }
        (Self::Hexahedron, corners)
    }

    /// The share of the mass of an element that stands at each of these corners, its own. The corners of a node have its share together: a
    /// sixth of a wedge, a quarter of a tetrahedron, of a pyramid 3/16 in the base and a quarter at the apex, as the integrals of linear
    /// functions over it are.
    pub(super) fn shares(corners: &[u32; 8]) -> [f64; MAX_NODES] {
        let form = Self::of(corners);
        let mut shares = [0.0; MAX_NODES];
        for (share, corner) in shares.iter_mut().zip(corners) {
            let times = corners.iter().filter(|other| *other == corner).count();
            let of_node = match (form, times) {
                (Self::Hexahedron, times) => 0.125 * times as f64,
                (Self::Wedge, _) => 1.0 / 6.0,
                (Self::Pyramid, 1) => 3.0 / 16.0,
                (Self::Pyramid | Self::Tetrahedron, _) => 0.25,
            };
            *share = of_node / times as f64;
        }
        shares
    }

    /// The corners of [`Form::turned`] that stand for its nodes, in the order that VTK has.
    pub fn nodes(self) -> &'static [usize] {
        match self {
            Self::Hexahedron => &[0, 1, 2, 3, 4, 5, 6, 7],
            // VTK's normals of the triangles point out of the wedge.
            Self::Wedge => &[0, 1, 4, 3, 2, 6],
            Self::Pyramid => &[0, 1, 2, 3, 4],
            Self::Tetrahedron => &[0, 1, 2, 4],
        }
    }
}

fn differ(nodes: &[u32]) -> bool {
    nodes.iter().enumerate().all(|(i, node)| !nodes[..i].contains(node))
}

/// The turns of a cube: which corner comes to each place.
const ROTATIONS: [[usize; 8]; 24] = rotations();

const fn rotations() -> [[usize; 8]; 24] {
    const AXES: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let mut all = [[0; 8]; 24];
    let (mut n, mut turn) = (0, 0);
    while turn < 48 {
        let (axes, signs) = (AXES[turn / 8], turn % 8);
        // An odd exchange of axes with an even number of mirrors turns a cube inside out, and the other way round.
        let mirrors = (signs & 1) + (signs >> 1 & 1) + (signs >> 2);
        if (turn / 24 + mirrors).is_multiple_of(2) {
            let mut corner = 0;
            while corner < 8 {
                let bits = bits_of(corner);
                let mut from = [0; 3];
                let mut axis = 0;
                while axis < 3 {
                    from[axes[axis]] = bits[axis] ^ (signs >> axis & 1);
                    axis += 1;
                }
                all[n][corner] = corner_of(from);
                corner += 1;
            }
            n += 1;
        }
        turn += 1;
    }
    all
}

/// Which end of each axis a corner has, in the order of [`CORNERS`](super::CORNERS).
const fn bits_of(corner: usize) -> [usize; 3] {
    let around = corner % 4;
    [if around == 1 || around == 2 { 1 } else { 0 }, around / 2, corner / 4]
}

const fn corner_of([x, y, z]: [usize; 3]) -> usize {
    4 * z + if y == 0 { x } else { 3 - x }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{CORNERS, FACES},
        *,
    };
    use crate::element::hex8;

    #[test]
    fn a_cube_has_24_turns_which_keep_its_volume() {
        for (i, rotation) in ROTATIONS.iter().enumerate() {
            assert!(!ROTATIONS[..i].contains(rotation));
            assert!((hex8::volume(&rotation.map(|corner| CORNERS[corner])) - 8.0).abs() < 1e-15);
        }
    }

    #[test]
    fn forms_are_found_however_their_corners_are_named() {
        let plain = [
            (Form::Hexahedron, [0, 1, 2, 3, 4, 5, 6, 7]),
            (Form::Wedge, [0, 1, 2, 3, 4, 4, 6, 6]),
            (Form::Pyramid, [0, 1, 2, 3, 4, 4, 4, 4]),
            (Form::Tetrahedron, [0, 1, 2, 2, 4, 4, 4, 4]),
            // A corner cut off at an edge, and edges that are askew.
            (Form::Hexahedron, [0, 1, 2, 3, 4, 4, 6, 7]),
            (Form::Hexahedron, [0, 0, 2, 3, 4, 5, 5, 7]),
        ];
        for (form, corners) in plain {
            for rotation in ROTATIONS {
                let named = rotation.map(|corner| corners[corner]);
                let (found, turned) = Form::turned(named);
                assert_eq!(found, form, "{named:?}");
                // The same solid: its faces are those of before.
                let faces = |c: [u32; 8]| {
                    let mut faces = FACES.map(|face| {
                        let mut nodes = face.map(|corner| c[corner]);
                        nodes.sort_unstable();
                        nodes
                    });
                    faces.sort_unstable();
                    faces
                };
                assert_eq!(faces(turned), faces(named));
                let place = |c: [u32; 8]| hex8::volume(&c.map(|node| CORNERS[node as usize]));
                assert!((place(turned) - place(named)).abs() < 1e-15);
                let shares = Form::shares(&named);
                assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{shares:?}");
            }
        }
        let masses = |corners: [u32; 8]| {
            let mut of_node = [0.0; 8];
            corners
                .iter()
                .zip(Form::shares(&corners))
                .for_each(|(&node, share)| of_node[node as usize] += share);
            of_node
        };
        let sixth = 1.0 / 6.0;
        assert_eq!(masses([0, 1, 2, 2, 4, 5, 6, 6]), [sixth, sixth, sixth, 0.0, sixth, sixth, sixth, 0.0]);
        assert_eq!(masses([0, 1, 2, 2, 4, 4, 4, 4]), [0.25, 0.25, 0.25, 0.0, 0.25, 0.0, 0.0, 0.0]);
    }
}
