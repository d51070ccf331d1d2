//! The work that the last forces of an element still do in the step that leads to the cycle in which it erodes, see the same of the
//! hexahedron.

use super::{NODES, POINTS, geometry::Shape};
use crate::{
    element::vector::{Tensor, Vector},
    lanes::scalar::Scalar,
};

/// What an element had at `x_{n-1}`, and how its nodes moved since.
pub(super) struct Leaving {
    /// Positions of the nodes at `x_n`, and their velocities since `x_{n-1}`.
    pub x: [[f64; 3]; NODES],
    pub v: [[f64; 3]; NODES],
    /// Time from `x_{n-1}` to `x_n`.
    pub dt: f64,
    /// By point deviatoric stress xx, yy, xy, yz, zx, and the stress by its own rate of volume.
    pub points: [[f64; 6]; POINTS],
    /// Pressure and artificial viscosity.
    pub pressure: f64,
}

impl Leaving {
    /// Energy that the element takes of its nodes in the last half of a step, by forces of the first; negative where they push them. The
    /// friction of failed points is left out.
    pub fn half_work(&self) -> f64 {
        let before: [[f64; 3]; NODES] =
            std::array::from_fn(|n| std::array::from_fn(|a| (-self.dt).mul_add(self.v[n][a], self.x[n][a])));
        let shape = Shape::of(&before.map(super::scalars));
        let volumes = shape.of_points();
        let all: f64 = volumes.iter().map(|volume| volume.0).sum();
        let mean =
            self.points.iter().zip(&volumes).map(|(point, volume)| point[5] * volume.0).sum::<f64>() / all;
        let stresses = self.points.map(|[xx, yy, xy, yz, zx, swelling]| {
            let p = swelling - mean - self.pressure;
            let row = |x, y, z| Vector { x: Scalar(x), y: Scalar(y), z: Scalar(z) };
            Tensor { x: row(xx + p, xy, zx), y: row(xy, yy + p, yz), z: row(zx, yz, p - (xx + yy)) }
        });
        let forces = shape.forces(&stresses);
        let power: f64 = forces.iter().zip(&self.v).map(|(force, v)| force.dot(&super::scalars(*v)).0).sum();
        0.5 * self.dt * power / 6.0
    }
}
