//! Axes of a material that is not the same in all directions: how they turn with an element, and tensors along them.
//!
//! A law has its axes `a`, `b` and `c = a x b` at the start among its constants, by `a` and a vector `d` in the plane of `a` and `b`. It keeps the
//! turn of an element since then as a unit quaternion, four history variables. The spin of a step turns it as it turns the stress (Hughes
//! and Winget 1980), so a stress that goes round with its element has the same components along the axes.

use super::{Around, Deviator, Memory, finite_strain::Symmetric};
use crate::{
    element::vector::{Tensor, Vector},
    lanes::Lane,
    law::{Unit, Variable},
    vectors::{cross, dot},
};

/// The columns of a law that keeps the turn, first among its history variables.
pub(super) const COLUMNS: [Variable; 4] =
    [column("turn_w", 1.0), column("turn_x", 0.0), column("turn_y", 0.0), column("turn_z", 0.0)];

const fn column(name: &'static str, initial: f64) -> Variable {
    Variable { name, unit: Unit::NONE, initial }
}

/// The sine below which two directions count as one: a plane of such would be that of their rounding.
pub(crate) const LEAST_SINE: f64 = 1e-6;

/// The direction of a vector; none where it is no longer than `least`.
pub(crate) fn direction(v: [f64; 3], least: f64) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > least && length.is_finite()).then(|| v.map(|x| x / length))
}

/// The axes at the start by the vectors a and d; none where they span no plane.
pub(crate) fn at_start(a: [f64; 3], d: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let a = direction(a, 0.0)?;
    let c = direction(cross(a, direction(d, 0.0)?), LEAST_SINE)?;
    Some([a, cross(c, a), c])
}

/// The axes of an element before and after a step.
pub(super) struct Axes<L> {
    before: [Vector<L>; 3],
    after: [Vector<L>; 3],
}

impl<L: Lane> Axes<L> {
    /// From the first four history variables, which are brought to the end of the step.
    #[inline(always)]
    pub fn turned(start: &[[f64; 3]; 3], variables: &mut [L], around: &Around<L>) -> Self {
        let (one, half) = (L::splat(1.0), L::splat(0.5));
        let turn = [variables[0], variables[1], variables[2], variables[3]];
        let w = around.spin.scaled(half);
        let scale = one / w.dot(&w).mul_add(one, one).sqrt();
        // (1, w/2) times the quaternion so far.
        let axis = Vector { x: turn[1], y: turn[2], z: turn[3] };
        let real = turn[0] - w.dot(&axis);
        let whole = w.cross_add(&axis, &w.mul_add(turn[0], &axis));
        let next = [real * scale, whole.x * scale, whole.y * scale, whole.z * scale];
        // Rounding does not add up.
        let square =
            next[0].mul_add(next[0], next[1].mul_add(next[1], next[2].mul_add(next[2], next[3] * next[3])));
        let to_unit = L::splat(-0.5).mul_add(square, L::splat(1.5));
        let moves = L::splat(0.0).less(around.dt);
        let mut after = turn;
        let mut i = 0;
        while i < 4 {
            after[i] = L::select(moves, next[i] * to_unit, turn[i]);
            variables[i] = after[i];
            i += 1;
        }
        Self { before: axes(start, &turn), after: axes(start, &after) }
    }

    /// The whole stress before the step, turned with it, along the axes after it: aa, bb, cc, ab, bc, ca. The trial has an isotropic increment of
    /// this shear modulus for this strain of the step, which is taken off.
    #[inline(always)]
    pub fn stress_before(
        &self,
        trial: &Deviator<L>,
        around: &Around<L>,
        strain: &[L; 6],
        shear: f64,
    ) -> [L; 6] {
        let mean = -around.pressure_before;
        let whole = Symmetric {
            xx: trial.xx + mean,
            yy: trial.yy + mean,
            zz: trial.zz + mean,
            xy: trial.xy,
            yz: trial.yz,
            zx: trial.zx,
        };
        let third = (strain[0] + strain[1] + strain[2]) * L::splat(1.0 / 3.0);
        let twice = L::splat(2.0 * shear);
        let mut stress = components(&self.after, &whole);
        let mut i = 0;
        while i < 6 {
            let strain = if i < 3 { strain[i] - third } else { strain[i] };
            stress[i] = twice.neg_mul_add(strain, stress[i]);
            i += 1;
        }
        stress
    }

    /// The strain of the step along the axes, which turn within it; shears are those of the tensor.
    #[inline(always)]
    pub fn strain(&self, around: &Around<L>) -> [L; 6] {
        let third = around.volume_rate * L::splat(1.0 / 3.0);
        let rate = Symmetric {
            xx: around.rate.xx + third,
            yy: around.rate.yy + third,
            zz: around.rate.zz + third,
            xy: around.rate.xy,
            yz: around.rate.yz,
            zx: around.rate.zx,
        };
        let (first, last) = (components(&self.before, &rate), components(&self.after, &rate));
        let half_step = L::splat(0.5) * around.dt;
        let mut strain = first;
        let mut i = 0;
        while i < 6 {
            strain[i] = half_step * (first[i] + last[i]);
            i += 1;
        }
        strain
    }

    /// What a law answers that makes the whole stress, by its components along the axes after the step. A pass that prepares a run leaves the
    /// stress to the bit.
    #[inline(always)]
    pub fn answer(
        &self,
        stress: [L; 6],
        trial: &Deviator<L>,
        around: &Around<L>,
        memory: &mut Memory<L>,
    ) -> Deviator<L> {
        let (mean, deviator) = self.stress(stress);
        memory.least_pressure = L::splat(-f64::MAX);
        memory.added_pressure = -mean - around.pressure;
        deviator.or(L::splat(0.0).less(around.dt), trial)
    }

    /// The mean of a stress with these components along the axes after the step, and its deviator.
    #[inline(always)]
    fn stress(&self, [aa, bb, cc, ab, bc, ca]: [L; 6]) -> (L, Deviator<L>) {
        let mean = (aa + bb + cc) * L::splat(1.0 / 3.0);
        let [a, b, c] = &self.after;
        // What the stress does to each axis.
        let to_a = c.mul_add(ca, &b.mul_add(ab, &a.scaled(aa - mean)));
        let to_b = c.mul_add(bc, &b.mul_add(bb - mean, &a.scaled(ab)));
        let to_c = c.mul_add(cc - mean, &b.mul_add(bc, &a.scaled(ca)));
        let Tensor { x, y, z } = Tensor::outer(a, &to_a).outer_add(b, &to_b).outer_add(c, &to_c);
        (mean, Deviator { xx: x.x, yy: y.y, zz: -(x.x + y.y), xy: x.y, yz: y.z, zx: z.x })
    }
}

#[inline(always)]
fn components<L: Lane>([a, b, c]: &[Vector<L>; 3], s: &Symmetric<L>) -> [L; 6] {
    let tensor = Tensor {
        x: Vector { x: s.xx, y: s.xy, z: s.zx },
        y: Vector { x: s.xy, y: s.yy, z: s.yz },
        z: Vector { x: s.zx, y: s.yz, z: s.zz },
    };
    let (to_a, to_b, to_c) = (tensor.apply(a), tensor.apply(b), tensor.apply(c));
    [a.dot(&to_a), b.dot(&to_b), c.dot(&to_c), b.dot(&to_a), c.dot(&to_b), a.dot(&to_c)]
}

/// The axes of the start, turned by a unit quaternion.
#[inline(always)]
fn axes<L: Lane>(start: &[[f64; 3]; 3], [w, x, y, z]: &[L; 4]) -> [Vector<L>; 3] {
    let two = L::splat(2.0);
    let axis = Vector { x: *x, y: *y, z: *z };
    let turned = |[vx, vy, vz]: [f64; 3]| {
        let v = Vector { x: L::splat(vx), y: L::splat(vy), z: L::splat(vz) };
        // v + 2 q x (q x v + w v)
        let inner = axis.cross_add(&v, &v.scaled(*w));
        axis.cross(&inner).mul_add(two, &v)
    };
    [turned(start[0]), turned(start[1]), turned(start[2])]
}
