//! Viscous hourglass control orthogonal to linear fields, after Flanagan and Belytschko (1981).
//!
//! The four modes of the velocity that a linear field cannot have are `q = v_m - L x_m` for
//! m = eta zeta, xi zeta, xi eta, xi eta zeta, with the velocity gradient L and the modes x_m of the mid-step
//! geometry. Each is resisted by `-c q` on its pattern, made orthogonal to linear fields at the end of the step:
//! `f_I = -c sum_m [Gamma_mI - (8/V) x_m . B_I] q_m`, with `c = 2 Q rho c_sound V / L_v`. Its second part acts like a
//! stress `-(8 c / V) sum_m q_m x_m^T` (not symmetric), and is given to the element as that, so that the forces have
//! neither resultant nor moment.

use super::vector::{Tensor, Vector};
use crate::lanes::Lane;

/// The amplitudes of the four modes, eight times as large as q, as the modes are.
#[derive(Clone, Copy)]
pub(crate) struct Hourglass<L> {
    pub d: Vector<L>,
    pub e: Vector<L>,
    pub f: Vector<L>,
    pub g: Vector<L>,
}

/// `v - L x`.
#[inline(always)]
pub(crate) fn amplitude<L: Lane>(v: &Vector<L>, gradient: &Tensor<L>, x: &Vector<L>) -> Vector<L> {
    let linear = gradient.apply(x);
    Vector { x: v.x - linear.x, y: v.y - linear.y, z: v.z - linear.z }
}

impl<L: Lane> Hourglass<L> {
    /// Sum of the squares, `64 q . q`. The power taken from the nodes is `8 c q . q`.
    #[inline(always)]
    pub fn square(&self) -> L {
        self.d.dot(&self.d) + self.e.dot(&self.e) + (self.f.dot(&self.f) + self.g.dot(&self.g))
    }

    /// `64 sum_m q_m x_m^T` for the modes x_m at the end of the step.
    #[inline(always)]
    pub fn against(&self, d: &Vector<L>, e: &Vector<L>, f: &Vector<L>, g: &Vector<L>) -> Tensor<L> {
        Tensor::outer(&self.d, d).outer_add(&self.e, e).outer_add(&self.f, f).outer_add(&self.g, g)
    }
}
