//! The composite ten-node tetrahedron: four corners and a node on each edge, twelve linear tetrahedra inside.
//!
//! After Guo, Ortiz, Belytschko and Repetto (2000) and Thoutireddy, Molinari, Repetto and Ortiz (2002). The element consists of a small
//! tetrahedron at each corner and of eight around the mean of its six edge nodes, and displacements are linear in each of them. Their
//! gradients, constant in each, are projected onto a field that is linear in the element and is taken at the four points of Gauss. The
//! projection is that of an element with straight edges, in closed form: with `V_k` the volume and `H_k` the velocity gradient of the
//! small tetrahedron k, and `l_gk` the mean in it of the natural coordinate of the corner next to point g,
//!
//! `V_g H_g = sum_k w_gk V_k H_k`, `V_g = sum_k w_gk V_k`, `w_gk = 1/4 + sqrt(5) (l_gk - 1/4)`.
//!
//! The weights of each small tetrahedron add to 1, so the volumes of the points are that of the element, and the power of the stresses is
//! `sum_g V_g s_g : H_g` without a remainder. A gradient that is the same everywhere is kept whatever the shape.
//!
//! *Pressure.* An element has one pressure, by its volume, so it does not lock where it is nearly incompressible: with a pressure at each
//! point a mesh would have a condition on its volume for every freedom that it has. What the rate of volume of a point has beside that of the
//! element is resisted by `2 G / 3`, as the other components of the strain are by `2 G`, and yields with them: a field of strain whose
//! deviator vanishes at all points would cost nothing without it. A point that has lost half of its share of the volume yields no further in
//! this: else a corner that is pressed into the element, at the edge of a wedge that strikes, flows until it is turned inside out. All
//! motions but the six rigid ones are resisted, so there is no hourglass control.
//!
//! *Nodes* are in the order of VTK, Abaqus, Nastran and LS-DYNA: edge nodes of 0-1, 1-2, 2-0, 0-3, 1-3 and 2-3. *Masses* are those that the
//! small tetrahedra give their corners, the mean of the edge nodes its share to each of these: inside a mesh nodes at corners and on edges carry
//! nearly the same.

use std::{fmt, ops::Range};

mod geometry;
pub(crate) mod group;
mod kernel;
mod leaving;

use super::vector::Vector;
use crate::{
    lanes::scalar::Scalar,
    law::MAX_HISTORY,
    material::Material,
    mesh::Spacing,
    state::field::{
        DAMAGE, ENERGY, PLASTIC_STRAIN, PRESSURE, RELATIVE_VOLUME, SXX, SXY, SYY, SYZ, SZX, TEMPERATURE,
    },
};
use geometry::Shape;

/// Nodes of an element.
pub const NODES: usize = 10;

/// The corners that each edge node stands between.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Share of a quarter of the volume of the element below which a point no longer yields in its own rate of volume.
const LEAST_SHARE: f64 = 0.5;

/// Share of the mass of an element that its nodes carry: 1/32 at a corner, 7/48 on an edge.
pub const SHARES: [f64; NODES] = {
    let mut shares = [7.0 / 48.0; NODES];
    let mut corner = 0;
    while corner < 4 {
        shares[corner] = 1.0 / 32.0;
        corner += 1;
    }
    shares
};

/// The triangles of the surface, outward, their last corner twice: four of each face, the fourth between its edge nodes.
pub const SIDES: [[usize; 4]; 16] = [
    [1, 5, 8, 8],
    [5, 2, 9, 9],
    [8, 9, 3, 3],
    [5, 9, 8, 8],
    [0, 7, 6, 6],
    [7, 3, 9, 9],
    [6, 9, 2, 2],
    [7, 9, 6, 6],
    [0, 4, 7, 7],
    [4, 1, 8, 8],
    [7, 8, 3, 3],
    [4, 8, 7, 7],
    [0, 6, 4, 4],
    [6, 2, 5, 5],
    [4, 5, 1, 1],
    [6, 5, 4, 4],
];

/// In a mesh some 24 elements meet at a corner and five at an edge, so both kinds of nodes carry three quarters of an element. A side
/// is as stiff against a node as that of a hexahedron of that spacing if a quarter of the element stands behind it: within 12 % where all edges
/// are equal.
pub(crate) const SPACING: Spacing = Spacing { node: 0.75, side: 0.25 };

/// Points of an element.
pub(crate) const POINTS: usize = 4;

/// The fields that each point has, indices into [`crate::state::FIELDS`].
pub(crate) const OF_POINT: [usize; 8] = [SXX, SYY, SXY, SYZ, SZX, PLASTIC_STRAIN, TEMPERATURE, DAMAGE];

/// The fields of the element that a law that remembers sees at each point.
pub(crate) const SHOWN: [usize; 3] = [ENERGY, PRESSURE, RELATIVE_VOLUME];

/// What a point keeps: [`OF_POINT`], the stress by its own rate of volume (tension positive), and the history variables of its law.
pub(crate) const BY_POINT: usize = OF_POINT.len() + 1 + MAX_HISTORY;

/// The arrays of the damage of the points.
pub(crate) const DAMAGES: Range<usize> = 7 * POINTS..8 * POINTS;

/// The place of that stress among them.
pub(crate) const SWELLING: usize = OF_POINT.len();

/// Number of arrays that such elements have of their own ([`crate::piece::Piece::own`]): number by number, those of the points.
pub(crate) const N_OWN: usize = BY_POINT * POINTS;

/// The arrays of a history variable of the law at the points.
pub(crate) const fn history(variable: usize) -> Range<usize> {
    let first = (SWELLING + 1 + variable) * POINTS;
    first..first + POINTS
}

/// What the points of an element of a material start with, one number per array of its own.
pub(crate) fn at_start(material: &Material) -> [f64; N_OWN] {
    let mut own = [0.0; N_OWN];
    let temperature = 6 * POINTS;
    own[temperature..temperature + POINTS].fill(material.initial_temperature());
    let history = own[(SWELLING + 1) * POINTS..].chunks_mut(POINTS);
    for (values, variable) in history.zip(material.history()) {
        values.fill(variable.initial);
    }
    own
}

/// The hexahedron that collapses to the corners.
pub fn collapsed(nodes: &[u32; NODES]) -> [u32; 8] {
    let [a, b, c, d, ..] = *nodes;
    [a, b, c, c, d, d, d, d]
}

/// Volume of an element whose nodes stand at `x`, as the kernel computes it, to the bit.
pub fn volume(x: &[[f64; 3]; NODES]) -> f64 {
    Shape::of(&x.map(scalars)).volume().0
}

/// Whether each of the small tetrahedra has a volume.
pub fn is_upright(x: &[[f64; 3]; NODES]) -> bool {
    Shape::of(&x.map(scalars)).volumes().iter().all(|volume| volume.0 > 0.0)
}

/// The small tetrahedra of an element by their corners; its nodes stand at `x`.
pub(crate) fn small(x: &[[f64; 3]; NODES]) -> [[[f64; 3]; 4]; geometry::SMALL] {
    let centre = std::array::from_fn(|a| x[4..].iter().map(|x| x[a]).sum::<f64>() / 6.0);
    std::array::from_fn(|k| {
        let [p, q, r] = geometry::TRIANGLES[k].map(|node| x[node]);
        [if k < 4 { x[k] } else { centre }, p, q, r]
    })
}

fn scalars([x, y, z]: [f64; 3]) -> Vector<Scalar> {
    Vector { x: Scalar(x), y: Scalar(y), z: Scalar(z) }
}

/// Why composite tetrahedra cannot be of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// It has no shear stiffness, which alone resists the motions that change no volume.
    Fluid,
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "a material with shear stiffness, which alone resists what changes no volume of such elements",
        )
    }
}

/// Whether composite tetrahedra can be of this material.
///
/// # Errors
/// [`Unfit`].
pub fn check(material: &Material) -> Result<(), Unfit> {
    if material.shear() > 0.0 { Ok(()) } else { Err(Unfit::Fluid) }
}
