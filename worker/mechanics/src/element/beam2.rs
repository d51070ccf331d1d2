//! The two-node beam: a straight bar that stretches, twists, bends and shears, with three displacements and three rotations at a node.
//!
//! The element moves with a frame of its own: `e1` along the line of the nodes, `e2` carried from step to step by the least rotation
//! that takes the old line to the new one and by the mean rotation of the nodes about it, `e3 = e1 x e2`. In this frame it knows the
//! rates of six deformations: its length, its twist, and about each of `e2` and `e3` the rotations of both ends against the line
//! (Belytschko and Schwer 1977). These vanish for every rigid motion; forces and moments are their exact conjugates, so those of an
//! element balance.
//!
//! With `Phi = 12 E I / (G A_s L^2)` and `s` from -1 to 1 along the beam, end rotations `a` and `b` about an axis make the curvature
//! `((b - a) + 3 s (a + b) / (1 + Phi)) / L` and the shear strain `Phi / (1 + Phi) (a + b) / 2`. Elastic beams so have the exact
//! stiffness of Timoshenko's. Where the material may yield, the stress is kept at *fibres* of the section, at both ends and in the
//! middle (Simpson's rule, exact for elastic bending); each fibre has one direct stress and two shear stresses and returns to von Mises'
//! surface with the lateral stresses zero. A plastic hinge forms within an element, whose load is then too great by about a third of
//! the length of the element over that of the arm.
//!
//! The section keeps its shape and size. Rotational inertia of a node is the polar one of half of the beam, about any axis, so
//! torsion is exact and the rotation of cross-sections in bending somewhat heavy; the limit of the time step is that of
//! the fastest of the six motions with it. The elements are few and their arithmetic is short, so they are computed one at a time.

use crate::vectors::dot;

mod fibre;
pub(crate) mod group;
mod section;

pub use section::{BeamError, BeamSection, Shape, USUAL_POINTS, check};

/// State of an element beside its fibres: the axis `e2`, axial force, torque, the moments of the first and of the second end about
/// `e2`, likewise about `e3`, internal energy.
pub const ELEMENT: usize = 10;
/// Index of the axial force in the state of an element.
pub const AXIAL: usize = 3;
/// Index of the torque.
pub const TORQUE: usize = 4;
/// Index of the first of four moments.
pub const MOMENTS: usize = 5;
pub(crate) const ENERGY: usize = 9;

/// State of a fibre: stress along the beam, shear stress along `e2` and `e3`, plastic strain, temperature.
pub const FIBRE: usize = 5;
/// Index of the plastic strain in the state of a fibre.
pub(crate) const PLASTIC_STRAIN: usize = 3;
pub(crate) const TEMPERATURE: usize = 4;

/// Stations along a beam at which it has fibres: place from -1 to 1 and weight.
pub(crate) const STATIONS: [(f64, f64); 3] = [(-1.0, 1.0 / 6.0), (0.0, 4.0 / 6.0), (1.0, 1.0 / 6.0)];

/// The part of `across` that is normal to the beam from `a` to `b`, of length 1: the axis `e2` at the start. Where there is none, because
/// `across` lies along the beam or has no length, any axis serves.
pub fn axis(a: [f64; 3], b: [f64; 3], across: [f64; 3]) -> [f64; 3] {
    let along: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    let square = dot(along, along);
    let normal = |to: [f64; 3]| -> [f64; 3] {
        let share = dot(to, along) / square;
        std::array::from_fn(|i| to[i] - share * along[i])
    };
    let of_length_1 = |to: [f64; 3]| scaled(to, 1.0 / dot(to, to).sqrt());
    let given = normal(across);
    if dot(given, given) > 1e-12 * dot(across, across) {
        return of_length_1(given);
    }
    let least = (0..3).fold(0, |best, i| if along[i].abs() < along[best].abs() { i } else { best });
    let mut unit = [0.0; 3];
    unit[least] = 1.0;
    of_length_1(normal(unit))
}

fn scaled(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|a| a * by)
}
