//! The wedge of six nodes. Its modes are the linear fields over the triangle, times the coordinate t through the wedge, -1 to 1 from
//! triangle to triangle: the vertices k of one move by `Q_k`, those of the other by `-Q_k`, and the `Q_k` have no sum.
//!
//! With the gradients `G_k` of the triangle's coordinates, its unit normal n and the half height h, `A = sum_k Q_k G_k^T` is the gradient of
//! the motion of the triangle. S is the symmetric part of A in the plane, w its rotation about n, `A_n = sum_k (n . Q_k) G_k`,
//! and M the second moment of the triangle over its area. Twice the work is
//! `(V/3) 2G [S:S + nu/(1 - nu) (tr S)^2] + (V/h^2) [E A_n.M A_n + G w^2 tr M]`: the wedge bends as a plate across its height, bends as a bar along it, and
//! twists about it. The shear that comes with the two bendings of a linear field is left out, because it is not there in a bar that bends: so the
//! wedge does not lock.

use super::{
    MODES, MOST,
    form::{ByMode, ByNode, Form, none},
};
use crate::{
    element::{hourglass::Resistance, vector::Vector},
    lanes::Lane,
};

/// The triangle in the middle between those of a wedge.
struct Middle<L> {
    /// Vertices, from the centre.
    at: [Vector<L>; 3],
    /// Gradients of the coordinates of the triangle.
    gradient: [Vector<L>; 3],
    normal: Vector<L>,
    /// Half of the height.
    height: L,
}

impl<L: Lane> Middle<L> {
    #[inline(always)]
    fn of(x: &ByNode<L>) -> Self {
        let (one, half, third) = (L::splat(1.0), L::splat(0.5), L::splat(1.0 / 3.0));
        let mut at = [none(); 3];
        let mut centre = none();
        let mut rise = none();
        let mut k = 0;
        while k < 3 {
            at[k] = x[k].mul_add(one, &x[k + 3]).scaled(half);
            centre = at[k].mul_add(third, &centre);
            rise = x[k].neg_mul_add(one, &x[k + 3]).mul_add(L::splat(1.0 / 6.0), &rise);
            k += 1;
        }
        let mut k = 0;
        while k < 3 {
            at[k] = centre.neg_mul_add(one, &at[k]);
            k += 1;
        }
        let twice_area = (at[0].neg_mul_add(one, &at[1])).cross(&at[0].neg_mul_add(one, &at[2]));
        let square = twice_area.dot(&twice_area);
        let normal = twice_area.scaled(one / square.sqrt());
        let by_area = twice_area.scaled(one / square);
        let mut gradient = [none(); 3];
        let mut k = 0;
        while k < 3 {
            let opposite = at[(k + 1) % 3].neg_mul_add(one, &at[(k + 2) % 3]);
            gradient[k] = by_area.cross(&opposite);
            k += 1;
        }
        Self { at, gradient, normal, height: rise.dot(&normal) }
    }
}

/// `sum_m h_mk u_m` at each vertex of the first triangle.
#[inline(always)]
fn at_vertices<L: Lane>(u: &ByMode<L>) -> [Vector<L>; 3] {
    let mut of_vertex = [none(); 3];
    let mut k = 0;
    while k < 3 {
        let second = u[1].scaled(L::splat(FORM.patterns[1][k]));
        of_vertex[k] = u[0].mul_add(L::splat(FORM.patterns[0][k]), &second);
        k += 1;
    }
    of_vertex
}

/// `sum_k h_mk u_k` of each mode.
#[inline(always)]
fn of_modes<L: Lane>(u: &[Vector<L>; 3]) -> ByMode<L> {
    let mut of_mode = [none(); MODES];
    let mut mode = 0;
    while mode < MODES {
        let mut k = 0;
        while k < 3 {
            of_mode[mode] = u[k].mul_add(L::splat(FORM.patterns[mode][k]), &of_mode[mode]);
            k += 1;
        }
        mode += 1;
    }
    of_mode
}

/// `1 / sqrt(12)`.
const ROOT: f64 = 0.288_675_134_594_812_9;

pub(super) const FORM: Form = Form {
    n_nodes: 6,
    node_of: [0, 1, 4, 3, 2, 2, 5, 5],
    corner: [0, 1, 4, 3, 2, 6],
    shares: [1.0 / 6.0; MOST],
    n_modes: 2,
    patterns: [[2.0 * ROOT, -ROOT, -ROOT, -2.0 * ROOT, ROOT, ROOT], [0.0, 0.5, -0.5, 0.0, -0.5, 0.5]],
};

/// See [`Form::assumed`].
#[inline(always)]
pub(super) fn assumed<L: Lane>(
    resistance: &Resistance,
    x: &ByNode<L>,
    volume: L,
    amplitudes: &ByMode<L>,
) -> ByMode<L> {
    let (zero, half) = (L::splat(0.0), L::splat(0.5));
    let Middle { at, gradient, normal, height } = Middle::of(x);
    let mut q = at_vertices(amplitudes);
    // Parts in the plane and along the normal.
    let mut rises = [zero; 3];
    let (mut trace, mut turn) = (zero, zero);
    let (mut climb, mut moment) = (none(), zero);
    let mut k = 0;
    while k < 3 {
        rises[k] = normal.dot(&q[k]);
        q[k] = normal.neg_mul_add(rises[k], &q[k]);
        trace = trace + gradient[k].dot(&q[k]);
        turn = turn + half * normal.dot(&gradient[k].cross(&q[k]));
        climb = gradient[k].mul_add(rises[k], &climb);
        moment = moment + at[k].dot(&at[k]) * L::splat(1.0 / 12.0);
        k += 1;
    }
    // `M A_n`.
    let mut bent = none();
    let mut k = 0;
    while k < 3 {
        bent = at[k].mul_add(at[k].dot(&climb) * L::splat(1.0 / 12.0), &bent);
        k += 1;
    }
    let by_height = volume / (height * height);
    // `2G V/3` of S and of its trace, `E V/h^2`, `G V/h^2 tr M`, each with the coefficient of the control.
    let plate = L::splat(resistance.bending * (1.0 - resistance.poisson)) * volume;
    let widened = L::splat(resistance.bending * resistance.poisson) * volume * trace;
    let bar = L::splat(9.0 * resistance.fourth) * by_height;
    let twist = L::splat(3.0 * resistance.twisting) * by_height * moment * turn * half;
    let mut force = [none(); 3];
    let mut k = 0;
    while k < 3 {
        let own = &gradient[k];
        // `S G_k`, twice.
        let mut strained = none();
        let mut j = 0;
        while j < 3 {
            strained = q[j].mul_add(gradient[j].dot(own), &strained);
            strained = gradient[j].mul_add(q[j].dot(own), &strained);
            j += 1;
        }
        let in_plane = strained.mul_add(half * plate, &own.scaled(widened));
        let turned = normal.cross(own).mul_add(twist, &in_plane);
        force[k] = normal.mul_add(bar * own.dot(&bent), &turned);
        k += 1;
    }
    of_modes(&force)
}

/// See [`Form::stress_square`].
#[inline(always)]
pub(super) fn stress_square<L: Lane>(x: &ByNode<L>, volume: L, forces: &ByMode<L>) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let Middle { at, normal, height, .. } = Middle::of(x);
    let on_vertices = at_vertices(forces);
    let (mut rows, mut lever, mut radius_square) = ([none(); 3], none(), zero);
    let mut k = 0;
    while k < 3 {
        // The patterns have length 1 over both triangles.
        let force = on_vertices[k].scaled(L::splat(2.0));
        rows[0] = at[k].mul_add(force.x, &rows[0]);
        rows[1] = at[k].mul_add(force.y, &rows[1]);
        rows[2] = at[k].mul_add(force.z, &rows[2]);
        lever = at[k].mul_add(normal.dot(&force), &lever);
        radius_square = at[k].dot(&at[k]).mul_add(L::splat(1.0 / 3.0), radius_square);
        k += 1;
    }
    let all = rows[0].dot(&rows[0]) + rows[1].dot(&rows[1]) + rows[2].dot(&rows[2]);
    let up = lever.dot(&lever);
    let inverse = one / volume;
    let plate = L::splat(9.0) * (all - up).max(zero);
    let bar = L::splat(64.0) * up * height * height / radius_square;
    (plate + bar) * inverse * inverse
}
