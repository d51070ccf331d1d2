//! Von Mises yield with hardening by a power of the whole strain, as sheet metal is described (Swift 1952):
//! `Y = k (initial_strain + e)^n (1 + (rate / reference_rate)^(1/rate_exponent))`, e the plastic strain.
//!
//! H. W. Swift, Plastic instability under plane stress, J. Mech. Phys. Solids 1 (1952) 1. The strain at first yield keeps the slope finite
//! where Johnson and Cook's power has none.

use super::{CowperSymonds, Deviator, History, RateFactor, Strain, StrengthLaw, newton};
use crate::{
    lanes::{Lane, functions::pow, scalar::Scalar},
    law::declared,
};

declared! {
    /// Constants of the law.
    pub struct PowerLaw = "power-law" {
        /// G (stress).
        shear: STRESS, Positive;
        /// Yield stress at a whole strain of 1.
        k: STRESS, Positive;
        /// Exponent of the strain.
        n: NONE, Positive;
        /// Strain at which the material first yields.
        initial_strain: NONE, Positive;
        /// Rate that doubles the yield stress (1/time); 0 for a yield stress that does not depend on the rate.
        reference_rate: RATE, NotNegative = 0.0;
        /// q of Cowper and Symonds.
        rate_exponent: NONE, Positive = 1.0;
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Power {
    law: PowerLaw,
    /// Yield stress without plastic strain.
    first: f64,
    rate: RateFactor,
}

impl Power {
    pub fn new(law: &PowerLaw) -> Self {
        let rate = CowperSymonds { reference: law.reference_rate, exponent: law.rate_exponent };
        Self {
            law: *law,
            first: law.k * pow(Scalar(law.initial_strain), Scalar(law.n)).0,
            rate: RateFactor::of((law.reference_rate > 0.0).then_some(rate)),
        }
    }
}

impl StrengthLaw for Power {
    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        let whole = strain.max(L::splat(0.0)) + L::splat(self.law.initial_strain);
        let stress = L::splat(self.law.k) * pow(whole, L::splat(self.law.n)) * factor;
        (stress, L::splat(self.law.n) * stress / whole)
    }

    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, _temperature: L) -> L {
        L::splat(self.first * (1.0 - 1e-9))
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, _temperature: L) -> L {
        self.rate.at(rate)
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let sigma = trial.mises_square().sqrt();
        let before = history.plastic_strain;
        // Elements that stay below the first yield stress need no power.
        if !L::any(L::both(self.least_flow(before, history.temperature).less(sigma), active)) {
            return trial;
        }
        let rate = self.rate.at(strain.rate);
        let yields = self.flow(before, rate).0.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        newton::returned(self, &trial, sigma, rate, yields, history)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        material::{Eos, Failure, Material, Strength},
        state::field,
        strength::{
            finite_strain::tests::{Cube, uniaxial},
            plane_stress::{Layer, Plane, PlaneLaw, sheared},
        },
    };

    /// Drawing steel, which yields at 190 MPa.
    const LAW: PowerLaw = PowerLaw {
        shear: 80e9,
        k: 540e6,
        n: 0.22,
        initial_strain: 0.0087,
        reference_rate: 802.0,
        rate_exponent: 3.585,
    };

    fn closed_form(strain: f64, rate: f64) -> f64 {
        let factor = 1.0 + (rate / LAW.reference_rate).powf(1.0 / LAW.rate_exponent);
        LAW.k * (LAW.initial_strain + strain).powf(LAW.n) * factor
    }

    #[test]
    fn one_step_of_any_size_ends_on_the_curve_of_its_rate() {
        let law = Power::new(&LAW);
        for (before, rate) in [(0.0, 0.0), (0.02, 1.0), (0.3, 1e4)] {
            for overshoot in [1e3, 1e7, 1e9, 3e10] {
                let sigma = closed_form(before, rate) + overshoot;
                let mut trial = Deviator::<Scalar>::zero();
                trial.xy = Scalar(sigma / 3f64.sqrt());
                let mut history = History { plastic_strain: Scalar(before), temperature: Scalar(0.0) };
                let strain = Strain { rate: Scalar(rate), increment: Scalar(1e-3) };
                let stress = law.update(trial, strain, &mut history, true).mises_square().0.sqrt();
                let after = history.plastic_strain.0;
                assert!(
                    (stress / closed_form(after, rate) - 1.0).abs() < 1e-9,
                    "{before} {overshoot}: {stress}"
                );
                let elastic = (sigma - stress) / (3.0 * LAW.shear);
                assert!(((after - before) / elastic - 1.0).abs() < 1e-6, "{before} {overshoot}: {after}");
            }
        }
    }

    #[test]
    fn a_lane_inside_the_surface_comes_back_to_the_bit() {
        let law = Power::new(&LAW);
        for (before, share) in [(0.0, 0.999_999), (0.1, 0.999_999), (0.1, 0.3)] {
            let mut trial = Deviator::<Scalar>::zero();
            trial.xy = Scalar(share * closed_form(before, 1.0) / 3f64.sqrt());
            let mut history = History { plastic_strain: Scalar(before), temperature: Scalar(0.0) };
            let strain = Strain { rate: Scalar(1.0), increment: Scalar(1e-3) };
            let back = law.update(trial, strain, &mut history, true);
            assert_eq!(back.xy.0.to_bits(), trial.xy.0.to_bits());
            assert_eq!(history.plastic_strain.0.to_bits(), before.to_bits());
        }
    }

    fn steel(law: PowerLaw) -> Material {
        let (eos, strength) = (Eos::Linear { bulk: 170e9 }, Strength::PowerLaw(law));
        Material { name: "steel".into(), density: 7850.0, eos, strength, failure: Failure::None }
    }

    #[test]
    fn a_layer_in_plane_stress_returns_to_the_curve_by_what_elasticity_leaves() {
        let law = PlaneLaw::of(&steel(LAW)).expect("a law that layers know");
        let zero = Scalar(0.0);
        for overshoot in [1.001, 1.5, 4.0, 16.0] {
            let trial = overshoot * closed_form(0.0, 0.0);
            let stress = Plane { xx: zero, yy: zero, xy: Scalar(trial / 3f64.sqrt()), yz: zero, zx: zero };
            let mut layer = Layer { stress, plastic_strain: zero, temperature: zero };
            assert!(law.update(&mut layer, &sheared(0.0)));
            let (strain, stress) = (layer.plastic_strain.0, layer.stress.xy.0 * 3f64.sqrt());
            assert!((stress / closed_form(strain, 0.0) - 1.0).abs() < 1e-9, "{overshoot}: {stress}");
            let elastic = (trial - stress) / (3.0 * LAW.shear);
            assert!((strain / elastic - 1.0).abs() < 1e-6, "{overshoot}: {strain} {elastic}");
        }
    }

    /// Drawn out at a constant logarithmic rate at unit volume.
    #[test]
    fn an_element_hardens_along_the_curve_of_its_rate() {
        let mut cube = Cube::of_material(steel(LAW));
        let (steps, dt, end) = (5_000, 1e-6, 0.5f64);
        let rate = end / (f64::from(steps) * dt);
        for n in 1..=steps {
            let strain = end * f64::from(n) / f64::from(steps);
            cube.step_to(&uniaxial(strain.exp()), dt);
            if n % 500 == 0 {
                let s = cube.block.reading(0);
                let (plastic, mises) = (s[field::PLASTIC_STRAIN], 1.5 * s[field::SXX]);
                let wanted = closed_form(plastic, rate);
                assert!((mises / wanted - 1.0).abs() < 1e-6, "{strain}: {mises} {wanted}");
                assert!((plastic + mises / (3.0 * LAW.shear) - strain).abs() < 1e-5 * strain, "{plastic}");
            }
        }
        assert!(cube.block.reading(0)[field::PLASTIC_STRAIN] > 0.49);
    }
}
