//! Von Mises yield with linear isotropic hardening, returned radially.

use super::{Deviator, History, RateFactor, Strain, StrengthLaw};
use crate::lanes::Lane;

/// `Y = (yield_stress + hardening * plastic strain) * rate factor`, not below zero.
#[derive(Clone, Copy)]
pub(crate) struct VonMises {
    /// G (stress).
    pub shear: f64,
    /// Initial yield stress.
    pub yield_stress: f64,
    /// `d Y / d plastic strain` (stress).
    pub hardening: f64,
    /// Factor for the strain rate.
    pub rate: RateFactor,
}

impl StrengthLaw for VonMises {
    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        let stress = L::splat(self.hardening).mul_add(strain, L::splat(self.yield_stress));
        (stress * factor, L::splat(self.hardening) * factor)
    }

    /// That at no rate.
    #[inline(always)]
    fn least_flow<L: Lane>(&self, strain: L, _temperature: L) -> L {
        L::splat(self.hardening).mul_add(strain, L::splat(self.yield_stress)).max(L::splat(0.0))
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, _temperature: L) -> L {
        self.rate.at(rate)
    }

    /// The implicit return `sigma - 3 G d = Y(e + d)` is linear in d, hence exact.
    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let sigma = trial.mises_square().sqrt();
        let factor = self.rate.at(strain.rate);
        let hardening = L::splat(self.hardening) * factor;
        let yield_stress = hardening
            .mul_add(history.plastic_strain, L::splat(self.yield_stress) * factor)
            .max(L::splat(0.0));
        let yields = yield_stress.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        let three_g = 3.0 * self.shear;
        let slip = (sigma - yield_stress) / (L::splat(three_g) + hardening);
        let factor = L::splat(three_g).neg_mul_add(slip, sigma) / sigma;
        let zero = L::splat(0.0);
        history.plastic_strain = history.plastic_strain + L::select(yields, slip, zero);
        trial.scaled(L::select(yields, factor.max(zero), L::splat(1.0)))
    }
}
