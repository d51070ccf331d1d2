//! The work that the last forces of an element still do in the step that leads to the cycle in which it erodes.
//!
//! Nodes move from `x_{n-1}` to `x_n` by half of the forces at each end. An element that erodes in cycle `n` has forces at the first
//! end only, and its energy is that of `x_{n-1}`: half of the work of those forces over the step is what nodes took of it since.

use super::super::{
    hourglass::{Amplitudes, amplitude},
    modes::{Gradient, Modes, modes_of},
    vector::Tensor,
    viscosity::Spread,
};
use crate::{lanes::scalar::Scalar, strength::Deviator};

/// What an element had at `x_{n-1}`, and how its corners moved since.
pub(super) struct Leaving<'a> {
    /// Positions of the corners at `x_n`, and their velocities since `x_{n-1}`.
    pub x: [[f64; 3]; 8],
    pub v: [[f64; 3]; 8],
    /// Time from `x_{n-1}` to `x_n`.
    pub dt: f64,
    /// Deviatoric stress xx, yy, xy, yz, zx.
    pub deviator: [f64; 5],
    /// Pressure and artificial viscosity.
    pub pressure: f64,
    /// Forces of elastic hourglass control; none without it.
    pub hourglass: Option<&'a Amplitudes<Scalar>>,
    /// Coefficient of viscous hourglass control, times mass and sound speed.
    pub viscous: f64,
}

/// Power of a stress, deviatoric xx, yy, xy, yz, zx and pressure, at a velocity gradient, per volume of that.
pub(in crate::element) fn power(rate: &Tensor<Scalar>, deviator: [f64; 5], pressure: f64) -> f64 {
    let [xx, yy, xy, yz, zx] = deviator.map(Scalar);
    let stress = Deviator { xx, yy, zz: -(xx + yy), xy, yz, zx };
    let along = Deviator {
        xx: rate.x.x,
        yy: rate.y.y,
        zz: rate.z.z,
        xy: Scalar(0.5) * (rate.x.y + rate.y.x),
        yz: Scalar(0.5) * (rate.y.z + rate.z.y),
        zx: Scalar(0.5) * (rate.z.x + rate.x.z),
    };
    let volume_rate = rate.x.x + rate.y.y + rate.z.z;
    (stress.contract(&along) - Scalar(pressure) * volume_rate).0
}

impl Leaving<'_> {
    /// Energy that the element takes of its nodes in the last half of a step, by forces of the first; negative where they push them.
    ///
    /// Forces of viscous hourglass control were those of velocities that are not known any more; the present ones stand for them.
    pub fn half_work(&self) -> f64 {
        let modes = |of: &[[f64; 3]; 8]| {
            let axis = |axis: usize| modes_of(of.map(|at| Scalar(at[axis])));
            Modes::of(axis(0), axis(1), axis(2))
        };
        let v = modes(&self.v);
        let before = Modes::before(&modes(&self.x), &v, Scalar(self.dt));
        let geometry = Gradient::of(&before);
        let rate = geometry.against(&v);
        let of_stress = power(&rate, self.deviator, self.pressure) * (1.0 / 64.0);
        let gradient = rate.scaled(Scalar(1.0) / geometry.volume_times_64);
        let q = Amplitudes {
            d: amplitude(&v.d, &gradient, &before.d),
            e: amplitude(&v.e, &gradient, &before.e),
            f: amplitude(&v.f, &gradient, &before.f),
            g: amplitude(&v.g, &gradient, &before.g),
        };
        let of_modes = self.hourglass.map_or(0.0, |forces| forces.dot(&q).0);
        let spread =
            Spread::of([&geometry.a, &geometry.b, &geometry.c, &geometry.d, &geometry.e, &geometry.f]);
        let area = (2.0 / 3.0 / 512.0 * spread.trace().0).sqrt();
        let resist = 2.0 * self.viscous * area / geometry.volume().0;
        0.5 * self.dt * ((of_stress + of_modes) + resist * q.square().0 / 8.0)
    }
}
