//! Zerilli and Armstrong's law, by the motion of dislocations:
//! `Y = C0 + (C1 + C2 sqrt(e)) exp(-C3 T + C4 T ln(rate/rate0)) + C5 e^n`.
//!
//! F. J. Zerilli, R. W. Armstrong, Dislocation-mechanics-based constitutive relations for material dynamics calculations, J. Appl. Phys. 61
//! (1987) 1816. Metals with a body-centred lattice (iron) have C1, C5 and n, where obstacles are those of the lattice; metals with a
//! face-centred one (copper) have C2, where they are the other dislocations. T is absolute; the rate is that of the whole effective
//! deviatoric strain. The share `taylor_quinney` of the plastic work becomes heat.

use super::{
    Deviator, History, Strain, StrengthLaw,
    tangent::{LEAST_STRAIN, Tangent},
};
use crate::{
    lanes::{
        Lane,
        functions::{exp, ln, pow},
    },
    law::declared,
};

declared! {
    /// Constants of the law.
    pub struct ZerilliArmstrong = "zerilli-armstrong" {
        /// G (stress).
        shear: STRESS, Positive;
        /// C0 (stress), that rate and temperature do not change.
        c0: STRESS, NotNegative;
        /// C1 (stress), body-centred.
        c1: STRESS, NotNegative = 0.0;
        /// C2 (stress), face-centred.
        c2: STRESS, NotNegative = 0.0;
        /// C3 (1/K).
        c3: NONE, NotNegative;
        /// C4 (1/K).
        c4: NONE, NotNegative;
        /// C5 (stress), hardening of the body-centred.
        c5: STRESS, NotNegative = 0.0;
        /// Its exponent.
        n: NONE, Positive = 1.0;
        /// Temperature at the start (K).
        t_room: NONE, Positive;
        /// Energy per mass per K.
        specific_heat: SPECIFIC_ENERGY, Positive;
        /// The unit of the rate under the logarithm (1/time): one per second as published.
        rate0: RATE, Positive;
        /// Share of the plastic work that becomes heat.
        taylor_quinney: NONE, Fraction = 0.9;
    }
}

impl ZerilliArmstrong {
    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        (self.c0 + self.c1 + self.c2 <= 0.0).then_some("c0, c1 or c2 above 0")
    }
}

/// Least rate over rate0 under the logarithm.
const LEAST_RATE: f64 = 1e-12;

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Dislocations {
    law: ZerilliArmstrong,
    inverse_rate0: f64,
    /// Kelvin per plastic work per initial volume.
    heating: f64,
}

impl Dislocations {
    /// In a material of this density.
    pub fn new(law: &ZerilliArmstrong, density: f64) -> Self {
        let heating = law.taylor_quinney / (density * law.specific_heat);
        Self { law: *law, inverse_rate0: 1.0 / law.rate0, heating }
    }
}

impl StrengthLaw for Dislocations {
    #[inline(always)]
    fn thermal(&self) -> bool {
        true
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        let law = &self.law;
        let strain = strain.max(L::splat(LEAST_STRAIN));
        let mut stress = L::splat(law.c1).mul_add(factor, L::splat(law.c0));
        let mut slope = L::splat(0.0);
        // The same for all elements of the material.
        if law.c2 != 0.0 {
            let face = L::splat(law.c2) * strain.sqrt() * factor;
            stress = stress + face;
            slope = L::splat(0.5) * face / strain;
        }
        if law.c5 != 0.0 {
            let body = L::splat(law.c5) * pow(strain, L::splat(law.n));
            stress = stress + body;
            slope = slope + L::splat(law.n) * body / strain;
        }
        (stress, slope)
    }

    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, _temperature: L) -> L {
        L::splat(self.law.c0)
    }

    /// The exponential.
    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, temperature: L) -> L {
        let log = ln((rate * L::splat(self.inverse_rate0)).max(L::splat(LEAST_RATE)));
        exp(temperature * L::splat(self.law.c4).mul_add(log, L::splat(-self.law.c3)))
    }

    #[inline(always)]
    fn heating(&self) -> f64 {
        self.heating
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let sigma_square = trial.mises_square();
        let low = sigma_square.less_equal(L::splat(self.law.c0 * self.law.c0 * (1.0 - 1e-9)));
        if L::bits(L::both(low, active)) == L::bits(active) {
            return trial;
        }
        let factor = self.factor(strain.rate, history.temperature);
        let reached = history.plastic_strain + strain.increment;
        let (stress, slope) = self.flow(reached, factor);
        let least = L::splat(self.law.c1).mul_add(factor, L::splat(self.law.c0));
        let tangent = Tangent { reached, stress, slope, least };
        tangent.returned(trial, sigma_square.sqrt(), L::splat(self.law.shear), self.heating, history, active)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            Strength,
            finite_strain::tests::{Cube, uniaxial},
        },
        *,
    };
    use crate::{
        lanes::scalar::Scalar,
        material::{Eos, Failure, Material},
        state::field,
        strength::plane_stress::{Layer, Plane, PlaneLaw, sheared},
    };

    /// OFHC copper and Armco iron of the paper.
    const COPPER: ZerilliArmstrong = ZerilliArmstrong {
        shear: 46.4e9,
        c0: 65e6,
        c1: 0.0,
        c2: 890e6,
        c3: 0.0028,
        c4: 0.000_115,
        c5: 0.0,
        n: 1.0,
        t_room: 294.0,
        specific_heat: 383.0,
        rate0: 1.0,
        taylor_quinney: 0.9,
    };
    const IRON: ZerilliArmstrong = ZerilliArmstrong {
        shear: 80e9,
        c0: 65e6,
        c1: 1033e6,
        c2: 0.0,
        c3: 0.00698,
        c4: 0.000_415,
        c5: 266e6,
        n: 0.289,
        specific_heat: 452.0,
        ..COPPER
    };

    fn metal(law: ZerilliArmstrong, density: f64) -> Material {
        let (eos, strength) = (Eos::Linear { bulk: 140e9 }, Strength::ZerilliArmstrong(law));
        Material { name: "metal".into(), density, eos, strength, failure: Failure::None }
    }

    /// The published equations in plain numbers.
    fn copper(e: f64, rate: f64, t: f64) -> f64 {
        65e6 + 890e6 * e.sqrt() * (-0.0028 * t + 0.000_115 * t * rate.ln()).exp()
    }

    fn iron(e: f64, rate: f64, t: f64) -> f64 {
        65e6 + 1033e6 * (-0.00698 * t + 0.000_415 * t * rate.ln()).exp() + 266e6 * e.powf(0.289)
    }

    type Published = fn(f64, f64, f64) -> f64;
    const PUBLISHED: [(ZerilliArmstrong, f64, Published); 2] =
        [(COPPER, 8960.0, copper), (IRON, 7890.0, iron)];

    #[test]
    fn flow_stress_and_slope_are_those_of_the_equations() {
        for (law, density, published) in PUBLISHED {
            let ready = Dislocations::new(&law, density);
            for (e, rate, t) in [(0.05, 1.0, 294.0), (0.3, 1e3, 294.0), (0.3, 1e5, 800.0), (2.0, 1e-3, 100.0)]
            {
                let (found, slope) = ready.flow(Scalar(e), ready.factor(Scalar(rate), Scalar(t)));
                assert!((found.0 / published(e, rate, t) - 1.0).abs() < 1e-12, "{e} {rate}: {}", found.0);
                let h = 1e-5 * e;
                let difference = (published(e + h, rate, t) - published(e - h, rate, t)) / (2.0 * h);
                assert!((slope.0 / difference - 1.0).abs() < 1e-8, "{e} {rate}: {}", slope.0);
            }
        }
    }

    /// Drawn out at a constant logarithmic rate at unit volume, with its own heat: temperature by Runge and Kutta, stress by the equation.
    #[test]
    fn an_element_follows_the_heated_curve() {
        for (law, density, published) in PUBLISHED {
            let mut cube = Cube::of_material(metal(law, density));
            let (steps, dt, end) = (20_000, 1e-8, 1.0f64);
            let rate = end / (f64::from(steps) * dt);
            for n in 1..=steps {
                cube.step_to(&uniaxial((end * f64::from(n) / f64::from(steps)).exp()), dt);
            }
            let s = cube.block.reading(0);
            let strain = s[field::PLASTIC_STRAIN];
            let slope = |e: f64, t: f64| 0.9 / (density * law.specific_heat) * published(e, rate, t);
            let (mut t, h) = (294.0, strain / 4000.0);
            for n in 0..4000 {
                let e = h * f64::from(n);
                let k1 = slope(e, t);
                let k2 = slope(e + 0.5 * h, t + 0.5 * h * k1);
                let k3 = slope(e + 0.5 * h, t + 0.5 * h * k2);
                let k4 = slope(e + h, t + h * k3);
                t += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
            }
            let (found, mises) = (s[field::TEMPERATURE], 1.5 * s[field::SXX]);
            assert!(t > 370.0 && ((found - t) / (t - 294.0)).abs() < 2e-4, "{found} {t}");
            assert!((mises / published(strain, rate, found) - 1.0).abs() < 5e-5, "{mises}");
            assert!((strain + mises / (3.0 * law.shear) - end).abs() < 1e-6, "{strain}");
        }
    }

    #[test]
    fn a_lane_inside_the_surface_comes_back_to_the_bit() {
        let ready = Dislocations::new(&IRON, 7890.0);
        for share in [0.999_999, 0.1] {
            let mut trial = Deviator::<Scalar>::zero();
            trial.xy = Scalar(iron(0.1, 1e3, 294.0) / 3f64.sqrt() * share);
            let mut history = History { plastic_strain: Scalar(0.1), temperature: Scalar(294.0) };
            let strain = Strain { rate: Scalar(1e3), increment: Scalar(0.0) };
            let back = ready.update(trial, strain, &mut history, true);
            assert_eq!(back.xy.0.to_bits(), trial.xy.0.to_bits());
            assert_eq!(history.plastic_strain.0.to_bits(), 0.1f64.to_bits());
        }
    }

    #[test]
    fn a_layer_in_plane_stress_returns_to_the_curve() {
        for (law, density, published) in PUBLISHED {
            let plane = PlaneLaw::of(&metal(law, density)).expect("a law that layers know");
            let zero = Scalar(0.0);
            let trial = 2.0 * published(0.05, 100.0, 294.0);
            let stress = Plane { xx: zero, yy: zero, xy: Scalar(trial / 3f64.sqrt()), yz: zero, zx: zero };
            let mut layer = Layer { stress, plastic_strain: Scalar(0.05), temperature: Scalar(294.0) };
            assert!(plane.update(&mut layer, &sheared(100.0)));
            let (strain, stress) = (layer.plastic_strain.0, layer.stress.xy.0 * 3f64.sqrt());
            assert!((stress / published(strain, 100.0, 294.0) - 1.0).abs() < 1e-8, "{stress}");
            let elastic = (trial - stress) / (3.0 * law.shear);
            assert!(((strain - 0.05) / elastic - 1.0).abs() < 1e-6, "{strain} {elastic}");
        }
    }

    #[test]
    fn a_metal_without_strength_is_refused() {
        assert_eq!((COPPER.fault(), IRON.fault()), (None, None));
        assert!(ZerilliArmstrong { c0: 0.0, c2: 0.0, ..COPPER }.fault().is_some());
    }
}
