//! The four-node shell with one point or four in the plane (`plane`) and several through the thickness.
//!
//! A point at height z above the middle surface lies at `x + z p` and moves with `v + z w x p`: velocities v, rotation
//! rates w and corner fibers p, all bilinear. The velocity strains are those of that motion to first order in z, with
//! the change of the gradient by z that warped elements need (Belytschko, Wong and Chiang 1992). They vanish
//! for every rigid motion of every, also warped, element; nodal forces and moments are their exact conjugates, so each
//! element's forces and moments balance: that is what projections are otherwise used for.
//!
//! Stress lives in the frame of `geometry`, which turns with the material. Hourglass control is of stiffness type:
//! membrane and bending patterns with the stiffness of bending in the plane and of the plate, the pattern of
//! deflection and the twist of rotations in the plane with that of transverse shear scaled by `h^2 / A`. All are blind
//! to rigid motion and to constant strain, curvature and twist. A small viscous part (`DAMPING` in `kernel`) keeps a shaken sheet
//! from gaining energy.
//!
//! The layers of a composite are plies with axes of their own (`laminate`), which turn with that frame.
//!
//! The elements stand in `block::Core`, which a block of a cycle holds as its group; [`Shells`] is a core with nodes of its own.

pub mod block;
mod geometry;
mod kernel;
mod laminate;
mod layers;
mod plane;
mod section_error;
mod shells;

use serde::{Deserialize, Serialize};

use geometry::Geometry;

use crate::{element::vector::Vector, lanes::scalar::Scalar};

pub(crate) use block::Core;
pub use block::ShellStep;
pub use kernel::{ELEMENT, THICKNESS};
pub(crate) use kernel::{INTERNAL, SHEAR};
pub use layers::LAYER;
pub use section_error::SectionError;
pub use shells::Shells;

/// Axes of the frame of an element with its corners at `x`.
pub(crate) fn frame(x: &[[f64; 3]; 4]) -> [[f64; 3]; 3] {
    let corners = x.map(|[x, y, z]| Vector { x: Scalar(x), y: Scalar(y), z: Scalar(z) });
    Geometry::of(&corners).e.map(|axis| [axis.x.0, axis.y.0, axis.z.0])
}

/// Points in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum InPlane {
    /// One in the middle; hourglass control resists what it does not see.
    #[default]
    One,
    /// Gauss's two by two, which see every motion in the plane and every bending: full integration.
    Four,
}

impl InPlane {
    /// How many they are.
    pub fn points(self) -> usize {
        match self {
            Self::One => 1,
            Self::Four => plane::FOUR,
        }
    }
}

/// Points through the thickness: heights by half the thickness and weights that add up to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Rule {
    /// Gauss's points, 1 to 5; they integrate elastic bending exactly from 2 on.
    Gauss(u32),
    /// Lobatto's points, 3 to 5, of which the first and the last lie on the surfaces.
    Lobatto(u32),
}

impl Rule {
    /// Heights and weights, or `None` if there is no such rule.
    pub fn points(self) -> Option<Vec<(f64, f64)>> {
        let half: &[(f64, f64)] = match self {
            Rule::Gauss(1) => &[(0.0, 1.0)],
            Rule::Gauss(2) => &[(0.577_350_269_189_625_8, 0.5)],
            Rule::Gauss(3) => &[(0.0, 4.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 18.0)],
            Rule::Gauss(4) => &[
                (0.339_981_043_584_856_3, 0.326_072_577_431_273_07),
                (0.861_136_311_594_052_6, 0.173_927_422_568_726_93),
            ],
            Rule::Gauss(5) => &[
                (0.0, 64.0 / 225.0),
                (0.538_469_310_105_683_1, 0.239_314_335_249_683_24),
                (0.906_179_845_938_664, 0.118_463_442_528_094_54),
            ],
            Rule::Lobatto(3) => &[(0.0, 2.0 / 3.0), (1.0, 1.0 / 6.0)],
            Rule::Lobatto(4) => &[(0.447_213_595_499_957_9, 5.0 / 12.0), (1.0, 1.0 / 12.0)],
            Rule::Lobatto(5) => &[(0.0, 16.0 / 45.0), (0.654_653_670_707_977_1, 49.0 / 180.0), (1.0, 0.05)],
            _ => return None,
        };
        let below = half.iter().rev().filter(|(z, _)| *z > 0.0).map(|&(z, weight)| (-z, weight));
        Some(below.chain(half.iter().copied()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_what_they_promise() {
        let gauss = (1..=5).map(|n| (Rule::Gauss(n), 2 * n - 1));
        let lobatto = (3..=5).map(|n| (Rule::Lobatto(n), 2 * n - 3));
        for (rule, degree) in gauss.chain(lobatto) {
            let points = rule.points().expect("these rules exist");
            for power in 0..=degree as i32 {
                let found: f64 = points.iter().map(|(z, weight)| weight * z.powi(power)).sum();
                let exact = if power % 2 == 0 { 1.0 / f64::from(power + 1) } else { 0.0 };
                assert!((found - exact).abs() < 1e-14, "{rule:?} of z^{power}: {found}, not {exact}");
            }
        }
        assert_eq!((Rule::Gauss(6).points(), Rule::Lobatto(2).points()), (None, None));
    }
}
