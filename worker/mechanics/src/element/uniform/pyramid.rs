//! The pyramid of five nodes. Its mode warps or shears the base, `u = Q xi eta` there, and is gone at the apex.
//!
//! With the half axes a and b of the base, of lengths `l_a` and `l_b`, and the unit normal n, twice the work of the mode is
//! `(V/3) [2G/(1 - nu) ((Q.a)^2/l_a^4 + (Q.b)^2/l_b^4) + G (Q.n)^2 (1/l_a^2 + 1/l_b^2)]`: the base bends in its plane as two strips do and twists out of
//! it. It is the formula of the hexahedron for its mode `xi eta`, without the strains of the other modes that would come with it; the squares of
//! the natural coordinates have the mean 1/3 over a pyramid as over a cube.

use super::{
    MOST,
    form::{ByMode, ByNode, Form, none},
};
use crate::{
    element::{hourglass::Resistance, vector::Vector},
    lanes::Lane,
};

/// Half axes of the base, the inverse squares of their lengths, and their unit normal.
struct Base<L> {
    a: Vector<L>,
    b: Vector<L>,
    inverse_a: L,
    inverse_b: L,
    normal: Vector<L>,
}

impl<L: Lane> Base<L> {
    #[inline(always)]
    fn of(x: &ByNode<L>) -> Self {
        let (one, quarter) = (L::splat(1.0), L::splat(0.25));
        // Diagonals: their halves are sum and difference of the axes.
        let (p, q) = (x[0].neg_mul_add(one, &x[2]), x[3].neg_mul_add(one, &x[1]));
        let a = p.mul_add(one, &q).scaled(quarter);
        let b = q.neg_mul_add(one, &p).scaled(quarter);
        let normal = a.cross(&b);
        let normal = normal.scaled(one / normal.dot(&normal).sqrt());
        Self { a, b, inverse_a: one / a.dot(&a), inverse_b: one / b.dot(&b), normal }
    }
}

pub(super) const FORM: Form = Form {
    n_nodes: 5,
    node_of: [0, 1, 2, 3, 4, 4, 4, 4],
    corner: [0, 1, 2, 3, 4, 0],
    shares: [3.0 / 16.0, 3.0 / 16.0, 3.0 / 16.0, 3.0 / 16.0, 0.25, 0.0],
    n_modes: 1,
    patterns: [[0.5, -0.5, 0.5, -0.5, 0.0, 0.0], [0.0; MOST]],
};

/// See [`Form::assumed`].
#[inline(always)]
pub(super) fn assumed<L: Lane>(
    resistance: &Resistance,
    x: &ByNode<L>,
    volume: L,
    amplitudes: &ByMode<L>,
) -> ByMode<L> {
    let base = Base::of(x);
    // The corners move by half of the amplitude, and the force on the amplitude is half of that on them.
    let q = amplitudes[0].scaled(L::splat(0.25));
    let (bending, twisting) = (L::splat(resistance.bending), L::splat(resistance.twisting));
    let along_a = bending * base.a.dot(&q) * base.inverse_a * base.inverse_a;
    let along_b = bending * base.b.dot(&q) * base.inverse_b * base.inverse_b;
    let across = twisting * base.normal.dot(&q) * (base.inverse_a + base.inverse_b);
    let force = base.a.mul_add(along_a, &base.b.mul_add(along_b, &base.normal.scaled(across)));
    [force.scaled(volume), none()]
}

/// See [`Form::stress_square`].
#[inline(always)]
pub(super) fn stress_square<L: Lane>(x: &ByNode<L>, volume: L, forces: &ByMode<L>) -> L {
    let base = Base::of(x);
    let (a, b, n) = (base.a.dot(&forces[0]), base.b.dot(&forces[0]), base.normal.dot(&forces[0]));
    let scale = L::splat(6.0) / volume;
    let length_square = L::splat(1.0) / (base.inverse_a + base.inverse_b);
    a.mul_add(a, b.mul_add(b, length_square * n * n)) * scale * scale
}
