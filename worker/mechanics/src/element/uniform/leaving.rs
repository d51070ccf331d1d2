//! The work that the last forces of an element still do in the step that leads to the cycle in which it erodes, see the same of the
//! hexahedron.

use super::{
    MODES, MOST,
    form::{ByMode, Form, dot, none},
    shape::Shape,
};
use crate::{
    element::{hex8::leaving::power, vector::Vector},
    lanes::scalar::Scalar,
};

/// What an element had at `x_{n-1}`, and how its nodes moved since.
pub(super) struct Leaving {
    /// Positions of the nodes at `x_n`, and their velocities since `x_{n-1}`.
    pub x: [[f64; 3]; MOST],
    pub v: [[f64; 3]; MOST],
    /// Time from `x_{n-1}` to `x_n`.
    pub dt: f64,
    /// Deviatoric stress xx, yy, xy, yz, zx.
    pub deviator: [f64; 5],
    /// Pressure and artificial viscosity.
    pub pressure: f64,
    /// Forces of elastic hourglass control.
    pub elastic: ByMode<Scalar>,
    /// Coefficient of viscous hourglass control, times mass and sound speed.
    pub viscous: f64,
}

impl Leaving {
    /// Energy that the element takes of its nodes in the last half of a step, by forces of the first; negative where they push them.
    pub fn half_work(&self, form: &Form) -> f64 {
        let vector = |[x, y, z]: [f64; 3]| Vector { x: Scalar(x), y: Scalar(y), z: Scalar(z) };
        let before = std::array::from_fn(|n| {
            vector(std::array::from_fn(|a| (-self.dt).mul_add(self.v[n][a], self.x[n][a])))
        });
        let v = self.v.map(vector);
        let shape = Shape::of(form, &before);
        let rate = shape.against(&v);
        let of_stress = power(&rate, self.deviator, self.pressure);
        let gradient = rate.scaled(Scalar(1.0) / shape.volume);
        let (of_v, of_x) = (form.along(&v), form.along(&before));
        let mut amplitudes = [none(); MODES];
        for mode in 0..form.n_modes {
            amplitudes[mode] = gradient.apply(&of_x[mode]).neg_mul_add(Scalar(1.0), &of_v[mode]);
        }
        let area = (2.0 / 3.0 * shape.spread(form).trace().0).sqrt();
        let resist = 8.0 / form.n_nodes as f64 * 2.0 * self.viscous * area / shape.volume.0;
        let of_modes = dot(&self.elastic, &amplitudes).0 + resist * dot(&amplitudes, &amplitudes).0;
        0.5 * self.dt * (of_stress + of_modes)
    }
}
