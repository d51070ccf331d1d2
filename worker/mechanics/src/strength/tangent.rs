//! The return to a yield stress that depends on strain, rate and temperature in any way: by the tangent at the plastic strain that the step
//! would reach if all its strain were plastic, where slopes are finite. Rate and temperature are those before the return.

use super::{Deviator, History};
use crate::lanes::Lane;

/// Least plastic strain at which a yield stress is evaluated: slopes at zero may be infinite.
pub(super) const LEAST_STRAIN: f64 = 1e-16;

/// A yield stress by the plastic strain, near the strain of a step.
pub(super) struct Tangent<L> {
    /// The plastic strain at which the two others hold.
    pub reached: L,
    pub stress: L,
    pub slope: L,
    /// That of the material without plastic strain: the tangent goes no lower.
    pub least: L,
}

impl<L: Lane> Tangent<L> {
    /// Returns the trial of this von Mises stress; each unit of plastic work warms by `heating`. Lanes inside keep their bits.
    #[inline(always)]
    pub fn returned(
        &self,
        trial: Deviator<L>,
        sigma: L,
        shear: L,
        heating: f64,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let yield_stress =
            self.slope.neg_mul_add(self.reached - history.plastic_strain, self.stress).max(self.least);
        let yields = yield_stress.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        let three_g = L::splat(3.0) * shear;
        let slip = L::select(yields, (sigma - yield_stress) / (three_g + self.slope), zero);
        let flow = three_g.neg_mul_add(slip, sigma).max(zero);
        history.plastic_strain = history.plastic_strain + slip;
        history.temperature = (L::splat(heating) * flow).mul_add(slip, history.temperature);
        trial.scaled(L::select(yields, flow / sigma, one))
    }
}
