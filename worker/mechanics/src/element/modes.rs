//! The modal form of the eight-node hexahedron: seven modes of the corners, volume and its exact gradient.
//!
//! With `x(xi, eta, zeta) = x0 + a xi + b eta + c zeta + d eta zeta + e xi zeta + f xi eta + g xi eta zeta` over the cube
//! -1..1, that is `m = (1/8) sum_I Gamma_mI x_I`, the volume integral of the Jacobian is
//!
//! `V/8 = a.(b x c + f x e/3) + [c.(e x d) + b.(d x f)]/3`,
//!
//! its derivatives by the modes are the `G_m` of [`Gradient`] (g has none), `B_I = dV/dx_I = sum_m Gamma_mI G_m`, and
//! the velocity gradient is `L = (8/V) sum_m v_m G_m^T`. This is the volume and the mean gradient of Flanagan and
//! Belytschko (1981).

use super::vector::{Tensor, Vector};
use crate::lanes::Lane;

/// The seven modes of a vector field at the corners, without its mean, eight times as large as in the formulas: they
/// are the plain sums over the corners, and what follows from them takes powers of two back where that is cheapest.
#[derive(Clone, Copy)]
pub(crate) struct Modes<L> {
    pub a: Vector<L>,
    pub b: Vector<L>,
    pub c: Vector<L>,
    pub d: Vector<L>,
    pub e: Vector<L>,
    pub f: Vector<L>,
    pub g: Vector<L>,
}

impl<L: Lane> Modes<L> {
    #[inline(always)]
    pub fn of(x: [L; 7], y: [L; 7], z: [L; 7]) -> Self {
        Self {
            a: Vector { x: x[0], y: y[0], z: z[0] },
            b: Vector { x: x[1], y: y[1], z: z[1] },
            c: Vector { x: x[2], y: y[2], z: z[2] },
            d: Vector { x: x[3], y: y[3], z: z[3] },
            e: Vector { x: x[4], y: y[4], z: z[4] },
            f: Vector { x: x[5], y: y[5], z: z[5] },
            g: Vector { x: x[6], y: y[6], z: z[6] },
        }
    }

    /// `x - v * half`: the positions at the middle of the step.
    #[inline(always)]
    pub fn before(x: &Self, v: &Self, half: L) -> Self {
        Self {
            a: v.a.neg_mul_add(half, &x.a),
            b: v.b.neg_mul_add(half, &x.b),
            c: v.c.neg_mul_add(half, &x.c),
            d: v.d.neg_mul_add(half, &x.d),
            e: v.e.neg_mul_add(half, &x.e),
            f: v.f.neg_mul_add(half, &x.f),
            g: v.g.neg_mul_add(half, &x.g),
        }
    }
}

/// The sums `sum_I Gamma_mI u_I` of one component at the corners for the modes xi, eta, zeta, eta zeta, xi zeta, xi eta,
/// xi eta zeta.
#[inline(always)]
pub(crate) fn modes_of<L: Lane>(u: [L; 8]) -> [L; 7] {
    let (s0, d0) = (u[1] + u[0], u[1] - u[0]);
    let (s1, d1) = (u[2] + u[3], u[2] - u[3]);
    let (s2, d2) = (u[5] + u[4], u[5] - u[4]);
    let (s3, d3) = (u[6] + u[7], u[6] - u[7]);
    let (low, low_eta) = (s1 + s0, s1 - s0);
    let (low_xi, low_xi_eta) = (d1 + d0, d1 - d0);
    let (high, high_eta) = (s3 + s2, s3 - s2);
    let (high_xi, high_xi_eta) = (d3 + d2, d3 - d2);
    [
        high_xi + low_xi,
        high_eta + low_eta,
        high - low,
        high_eta - low_eta,
        high_xi - low_xi,
        high_xi_eta + low_xi_eta,
        high_xi_eta - low_xi_eta,
    ]
}

/// `sum_m Gamma_mI phi_m` at the corners, the way back from modes.
#[inline(always)]
pub(crate) fn corner_values<L: Lane>([a, b, c, d, e, f, g]: [L; 7]) -> [L; 8] {
    let (eta_low, eta_high) = (b - d, b + d);
    let (xi_low, xi_high) = (a - e, a + e);
    let (both_low, both_high) = (f - g, f + g);
    let (low_0, low_1) = (-c - eta_low, eta_low - c);
    let (high_0, high_1) = (c - eta_high, c + eta_high);
    let (xi_low_0, xi_low_1) = (xi_low - both_low, xi_low + both_low);
    let (xi_high_0, xi_high_1) = (xi_high - both_high, xi_high + both_high);
    [
        low_0 - xi_low_0,
        low_0 + xi_low_0,
        low_1 + xi_low_1,
        low_1 - xi_low_1,
        high_0 - xi_high_0,
        high_0 + xi_high_0,
        high_1 + xi_high_1,
        high_1 - xi_high_1,
    ]
}

/// Volume and its derivatives by the modes, from modes that are eight times as large.
#[derive(Clone, Copy)]
pub(crate) struct Gradient<L> {
    /// `64 G_a`, and so on.
    pub a: Vector<L>,
    pub b: Vector<L>,
    pub c: Vector<L>,
    pub d: Vector<L>,
    pub e: Vector<L>,
    pub f: Vector<L>,
    /// `64 V`, which is `512 V/8`.
    pub volume_times_64: L,
}

impl<L: Lane> Gradient<L> {
    #[inline(always)]
    pub fn of(m: &Modes<L>) -> Self {
        let third = L::splat(1.0 / 3.0);
        // Each product of two of the bent modes, or of one with a straight one, carries one third.
        let (d, e, f) = (m.d.scaled(third), m.e.scaled(third), m.f.scaled(third));
        let df = d.cross(&m.f);
        let ed = e.cross(&m.d);
        let a = m.b.cross_add(&m.c, &f.cross(&m.e));
        Self {
            b: m.c.cross_add(&m.a, &df),
            c: m.a.cross_add(&m.b, &ed),
            d: m.c.cross_add(&e, &f.cross(&m.b)),
            e: m.a.cross_add(&f, &d.cross(&m.c)),
            f: e.cross_add(&m.a, &m.b.cross(&d)),
            volume_times_64: m.a.dot(&a) + (m.c.dot(&ed) + m.b.dot(&df)),
            a,
        }
    }

    #[inline(always)]
    pub fn volume(&self) -> L {
        self.volume_times_64 * L::splat(1.0 / 64.0)
    }

    /// `512 sum_m v_m G_m^T`; by [`Gradient::volume_times_64`] it is the velocity gradient.
    #[inline(always)]
    pub fn against(&self, v: &Modes<L>) -> Tensor<L> {
        Tensor::outer(&v.a, &self.a)
            .outer_add(&v.b, &self.b)
            .outer_add(&v.c, &self.c)
            .outer_add(&v.d, &self.d)
            .outer_add(&v.e, &self.e)
            .outer_add(&v.f, &self.f)
    }

    /// One component of the corner forces, `row . 64 G_m - resist 8 q_m` for each mode, brought to the corners.
    #[inline(always)]
    pub fn forces(&self, row: &Vector<L>, resist: L, q: [L; 4]) -> [L; 8] {
        corner_values([
            row.dot(&self.a),
            row.dot(&self.b),
            row.dot(&self.c),
            resist.neg_mul_add(q[0], row.dot(&self.d)),
            resist.neg_mul_add(q[1], row.dot(&self.e)),
            resist.neg_mul_add(q[2], row.dot(&self.f)),
            -(resist * q[3]),
        ])
    }
}
