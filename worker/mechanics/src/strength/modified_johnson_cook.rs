//! Johnson and Cook's law with the saturating hardening of Voce and a rate factor that is a power:
//! `Y = (A + B e^n + Q1 (1 - exp(-C1 e)) + Q2 (1 - exp(-C2 e))) (1 + rate/rate0)^C (1 - T*^m)`.
//!
//! T. Borvik, O. S. Hopperstad, T. Berstad, M. Langseth, A computational model of viscoplasticity and ductile damage for impact and
//! penetration, Eur. J. Mech. A/Solids 20 (2001) 685. The rate is that of the whole effective deviatoric strain, as with the other
//! laws. T* is `(T - t_room) / (t_melt - t_room)`, clamped to 0..1; the share `taylor_quinney` of the plastic work becomes heat.

use super::{
    Deviator, History, Strain, StrengthLaw,
    johnson_cook::least_left,
    tangent::{LEAST_STRAIN, Tangent},
};
use crate::{
    lanes::{
        Lane,
        functions::{exp, pow},
    },
    law::declared,
};

declared! {
    /// Constants of the law.
    pub struct ModifiedJohnsonCook = "modified-johnson-cook" {
        /// G (stress).
        shear: STRESS, Positive;
        /// A (stress).
        a: STRESS, Positive;
        /// B (stress).
        b: STRESS, NotNegative = 0.0;
        /// Exponent of the plastic strain.
        n: NONE, Positive = 1.0;
        /// Q1 (stress): what the first term adds in the end.
        q1: STRESS, NotNegative = 0.0;
        /// C1: how fast.
        c1: NONE, NotNegative = 0.0;
        /// Q2 (stress).
        q2: STRESS, NotNegative = 0.0;
        /// C2.
        c2: NONE, NotNegative = 0.0;
        /// C, exponent of the rate.
        c: NONE, NotNegative;
        /// Exponent of the temperature.
        m: NONE, Positive;
        /// Melting temperature (K).
        t_melt: NONE, Positive;
        /// Room temperature (K), also that at the start.
        t_room: NONE, Positive;
        /// Energy per mass per K.
        specific_heat: SPECIFIC_ENERGY, Positive;
        /// Reference strain rate (1/time).
        rate0: RATE, Positive;
        /// Share of the plastic work that becomes heat.
        taylor_quinney: NONE, Fraction = 0.9;
    }
}

impl ModifiedJohnsonCook {
    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        (self.t_melt <= self.t_room).then_some("a melting temperature above room temperature")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct ModifiedCook {
    law: ModifiedJohnsonCook,
    inverse_rate0: f64,
    inverse_range: f64,
    /// Kelvin per plastic work per initial volume.
    heating: f64,
}

impl ModifiedCook {
    /// In a material of this density.
    pub fn new(law: &ModifiedJohnsonCook, density: f64) -> Self {
        Self {
            law: *law,
            inverse_rate0: 1.0 / law.rate0,
            inverse_range: 1.0 / (law.t_melt - law.t_room),
            heating: law.taylor_quinney / (density * law.specific_heat),
        }
    }

    /// Stress and slope by plastic strain of the static curve at room temperature, without A.
    #[inline(always)]
    fn hardening<L: Lane>(&self, strain: L) -> (L, L) {
        let law = &self.law;
        let strain = strain.max(L::splat(LEAST_STRAIN));
        let power = L::splat(law.b) * pow(strain, L::splat(law.n));
        let (mut stress, mut slope) = (power, L::splat(law.n) * power / strain);
        // The same for all elements of the material.
        if law.q1 != 0.0 {
            let left = L::splat(law.q1) * exp(-(L::splat(law.c1) * strain));
            stress = stress + (L::splat(law.q1) - left);
            slope = L::splat(law.c1).mul_add(left, slope);
        }
        if law.q2 != 0.0 {
            let left = L::splat(law.q2) * exp(-(L::splat(law.c2) * strain));
            stress = stress + (L::splat(law.q2) - left);
            slope = L::splat(law.c2).mul_add(left, slope);
        }
        (stress, slope)
    }
}

impl StrengthLaw for ModifiedCook {
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
        let (stress, slope) = self.hardening(strain);
        ((L::splat(self.law.a) + stress) * factor, slope * factor)
    }

    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, temperature: L) -> L {
        let hot = (temperature - L::splat(self.law.t_room)) * L::splat(self.inverse_range);
        L::splat(self.law.a) * least_left(hot.max(L::splat(0.0)).min(L::splat(1.0)), self.law.m)
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, temperature: L) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let hot = (temperature - L::splat(law.t_room)) * L::splat(self.inverse_range);
        let hot = hot.max(zero).min(one);
        let softened = if law.m == 1.0 { hot } else { pow(hot, L::splat(law.m)) };
        let quick = pow(rate.mul_add(L::splat(self.inverse_rate0), one), L::splat(law.c));
        quick * (one - softened)
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
        // Cold lanes below A cannot yield, as their factor is at least 1. The margin is far above the roundings.
        let cold = history.temperature.less_equal(L::splat(self.law.t_room));
        let low = sigma_square.less_equal(L::splat(self.law.a * self.law.a * (1.0 - 1e-9)));
        if L::bits(L::both(L::both(cold, low), active)) == L::bits(active) {
            return trial;
        }
        let factor = self.factor(strain.rate, history.temperature);
        let reached = history.plastic_strain + strain.increment;
        let (stress, slope) = self.flow(reached, factor);
        let tangent = Tangent { reached, stress, slope, least: L::splat(self.law.a) * factor };
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

    const LAW: ModifiedJohnsonCook = ModifiedJohnsonCook {
        shear: 75e9,
        a: 499e6,
        b: 382e6,
        n: 0.458,
        q1: 120e6,
        c1: 9.0,
        q2: 40e6,
        c2: 150.0,
        c: 0.0079,
        m: 0.893,
        t_melt: 1800.0,
        t_room: 293.0,
        specific_heat: 452.0,
        rate0: 5e-4,
        taylor_quinney: 0.9,
    };

    fn steel(law: ModifiedJohnsonCook, failure: Failure) -> Material {
        let (eos, strength) = (Eos::Linear { bulk: 160e9 }, Strength::ModifiedJohnsonCook(law));
        Material { name: "steel".into(), density: 7850.0, eos, strength, failure }
    }

    /// The published equation in plain numbers.
    fn published(strain: f64, rate: f64, temperature: f64) -> f64 {
        let voce = |q: f64, c: f64| q * (1.0 - (-c * strain).exp());
        let hardened = LAW.a + LAW.b * strain.powf(LAW.n) + voce(LAW.q1, LAW.c1) + voce(LAW.q2, LAW.c2);
        let hot = ((temperature - 293.0) / (1800.0 - 293.0)).clamp(0.0, 1.0);
        hardened * (1.0 + rate / LAW.rate0).powf(LAW.c) * (1.0 - hot.powf(LAW.m))
    }

    #[test]
    fn flow_stress_and_slope_are_those_of_the_equation() {
        let law = ModifiedCook::new(&LAW, 7850.0);
        for (strain, rate, temperature) in
            [(0.0, 0.0, 293.0), (0.02, 1.0, 293.0), (0.3, 1e3, 700.0), (1.2, 1e5, 250.0), (0.5, 1.0, 1900.0)]
        {
            let factor = law.factor(Scalar(rate), Scalar(temperature));
            let (found, slope) = law.flow(Scalar(strain), factor);
            let wanted = published(strain, rate, temperature);
            assert!((found.0 - wanted).abs() <= 1e-7 * LAW.a, "{strain} {rate}: {} {wanted}", found.0);
            if strain > 0.0 && wanted > 0.0 {
                let h = 1e-6 * strain;
                let difference =
                    published(strain + h, rate, temperature) - published(strain - h, rate, temperature);
                assert!((slope.0 * 2.0 * h / difference - 1.0).abs() < 1e-6, "{strain} {rate}");
            }
        }
    }

    /// Drawn out at a constant logarithmic rate at unit volume: stress by the equation, and the work of the greatest principal stress,
    /// two thirds of the yield stress, by its integral.
    #[test]
    fn an_element_follows_the_curve_and_breaks_where_the_integral_says() {
        let cold = ModifiedJohnsonCook { taylor_quinney: 0.0, ..LAW };
        let work = 340e6;
        let mut cube = Cube::of_material(steel(cold, Failure::CockcroftLatham { work }));
        let (steps, dt, end) = (20_000, 1e-7, 0.5f64);
        let rate = end / (f64::from(steps) * dt);
        let factor = (1.0 + rate / LAW.rate0).powf(LAW.c);
        let integral = |e: f64| {
            let voce = |q: f64, c: f64| q * (e - (1.0 - (-c * e).exp()) / c);
            let power = LAW.b * e.powf(LAW.n + 1.0) / (LAW.n + 1.0);
            factor * (LAW.a * e + power + voce(LAW.q1, LAW.c1) + voce(LAW.q2, LAW.c2))
        };
        let mut compared = 0;
        for n in 1..=steps {
            let strain = end * f64::from(n) / f64::from(steps);
            cube.step_to(&uniaxial(strain.exp()), dt);
            if n % 1000 == 0 {
                let s = cube.block.reading(0);
                let (plastic, mises) = (s[field::PLASTIC_STRAIN], 1.5 * s[field::SXX]);
                let wanted = published(plastic, rate, 293.0);
                assert!((mises / wanted - 1.0).abs() < 1e-6, "{strain}: {mises} {wanted}");
                assert!((plastic + mises / (3.0 * LAW.shear) - strain).abs() < 1e-6 * strain, "{plastic}");
                let damage = 2.0 / 3.0 * integral(plastic) / work;
                assert!(damage < 1.0, "the element was to break last");
                assert!((s[field::DAMAGE] / damage - 1.0).abs() < 2e-4, "{} {damage}", s[field::DAMAGE]);
                compared += 1;
            }
        }
        assert_eq!(compared, 20);
        assert!(cube.block.reading(0)[field::DAMAGE] > 0.85, "{:?}", cube.block.reading(0));
    }

    #[test]
    fn plastic_work_heats_by_its_share() {
        let mut cube = Cube::of_material(steel(LAW, Failure::None));
        let (steps, dt, end) = (20_000, 1e-7, 1.0f64);
        let rate = end / (f64::from(steps) * dt);
        for n in 1..=steps {
            cube.step_to(&uniaxial((end * f64::from(n) / f64::from(steps)).exp()), dt);
        }
        // The temperature by plastic strain, by Runge and Kutta.
        let s = cube.block.reading(0);
        let slope = |e: f64, t: f64| 0.9 / (7850.0 * 452.0) * published(e, rate, t);
        let (mut t, h) = (293.0, s[field::PLASTIC_STRAIN] / 2000.0);
        for n in 0..2000 {
            let e = h * f64::from(n);
            let k1 = slope(e, t);
            let k2 = slope(e + 0.5 * h, t + 0.5 * h * k1);
            let k3 = slope(e + 0.5 * h, t + 0.5 * h * k2);
            let k4 = slope(e + h, t + h * k3);
            t += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        }
        let (found, mises) = (s[field::TEMPERATURE], 1.5 * s[field::SXX]);
        assert!(t > 450.0 && ((found - t) / (t - 293.0)).abs() < 1e-4, "{found} {t}");
        assert!((mises / published(s[field::PLASTIC_STRAIN], rate, found) - 1.0).abs() < 2e-5, "{mises}");
    }

    #[test]
    fn a_lane_inside_the_surface_comes_back_to_the_bit() {
        let law = ModifiedCook::new(&LAW, 7850.0);
        let mut trial = Deviator::<Scalar>::zero();
        trial.xy = Scalar(LAW.a / 3f64.sqrt() * 0.999_999);
        for temperature in [293.0, 293.000_001] {
            let mut history = History { plastic_strain: Scalar(0.0), temperature: Scalar(temperature) };
            let strain = Strain { rate: Scalar(1e3), increment: Scalar(1e-4) };
            let back = law.update(trial, strain, &mut history, true);
            assert_eq!(back.xy.0.to_bits(), trial.xy.0.to_bits());
            assert_eq!(history.plastic_strain.0.to_bits(), 0f64.to_bits());
        }
    }

    #[test]
    fn a_layer_in_plane_stress_returns_to_the_curve() {
        let law = PlaneLaw::of(&steel(LAW, Failure::None)).expect("a law that layers know");
        let zero = Scalar(0.0);
        for overshoot in [1.2, 3.0] {
            let trial = overshoot * LAW.a;
            let stress = Plane { xx: zero, yy: zero, xy: Scalar(trial / 3f64.sqrt()), yz: zero, zx: zero };
            let mut layer = Layer { stress, plastic_strain: zero, temperature: Scalar(293.0) };
            assert!(law.update(&mut layer, &sheared(100.0)));
            let (strain, stress) = (layer.plastic_strain.0, layer.stress.xy.0 * 3f64.sqrt());
            let wanted = published(strain, 100.0, 293.0);
            assert!((stress / wanted - 1.0).abs() < 1e-8, "{overshoot}: {stress} {wanted}");
            let elastic = (trial - stress) / (3.0 * LAW.shear);
            assert!((strain / elastic - 1.0).abs() < 1e-6, "{overshoot}: {strain} {elastic}");
        }
    }

    #[test]
    fn a_material_that_melts_cold_is_refused() {
        assert_eq!(LAW.fault(), None);
        assert!(ModifiedJohnsonCook { t_melt: 293.0, ..LAW }.fault().is_some());
    }
}
