//! Steinberg, Cochran and Guinan's law of metals at high rates: shear modulus and yield stress follow pressure and temperature, and vanish where
//! the metal melts.
//!
//! D. J. Steinberg, S. G. Cochran, M. W. Guinan, A constitutive model for metals applicable at high-strain rate, J. Appl. Phys. 51 (1980)
//! 1498. With `eta = rho/rho0`, p the pressure, T the temperature and e the plastic strain:
//!
//! - `G = G0 (1 + A p / eta^(1/3) - B (T - T0))`;
//! - `Y = min(Y0 (1 + beta (e + e_i))^n, Y_max) (1 + A_y p / eta^(1/3) - B (T - T0))`;
//! - both are zero above `Tm = Tm0 eta^(2 (gamma0 - a - 1/3)) exp(2 a (1 - 1/eta))`.
//!
//! T is that of the internal energy above the cold curve ([`StrengthLaw::heating_by_energy`]), so shocks soften and melt. It does not depend on the
//! rate. Tension may have a cut-off.

use super::{Around, Deviator, History, Memory, StrengthLaw, tangent::Tangent};
use crate::{
    element::rotation::rotated,
    lanes::{
        Lane,
        functions::{cbrt, exp, ln, pow},
    },
    law::declared,
};

declared! {
    /// Constants of the law.
    pub struct SteinbergGuinan = "steinberg-guinan" {
        /// G0 (stress).
        shear: STRESS, Positive;
        /// Y0 (stress).
        yield_stress: STRESS, Positive;
        /// Y_max (stress): the most that hardening comes to.
        yield_limit: STRESS, Positive;
        /// beta, of the hardening.
        beta: NONE, NotNegative;
        /// Its exponent.
        n: NONE, NotNegative;
        /// e_i: plastic strain before the start.
        initial_strain: NONE, NotNegative = 0.0;
        /// A (1/stress), of the pressure in G.
        pressure_factor: COMPLIANCE, NotNegative;
        /// A_y (1/stress), of the pressure in Y; as a rule that of G.
        yield_pressure_factor: COMPLIANCE, NotNegative;
        /// B (1/K), of the temperature in both.
        temperature_factor: NONE, NotNegative;
        /// Tm0 (K).
        t_melt: NONE, Positive;
        /// gamma0 of the melting curve.
        melt_gamma: NONE, NotNegative;
        /// a of the melting curve.
        melt_a: NONE, NotNegative;
        /// T0 (K), also that at the start.
        t_room: NONE, Positive = 300.0;
        /// Energy per mass per K.
        specific_heat: SPECIFIC_ENERGY, Positive;
        /// The mean tension that it bears (stress).
        tension: STRESS, Positive = 1e30;
    }
}

impl SteinbergGuinan {
    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        if self.t_melt <= self.t_room {
            return Some("a melting temperature above room temperature");
        }
        (self.yield_limit < self.yield_stress).then_some("a yield_limit no less than yield_stress")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Metal {
    law: SteinbergGuinan,
    /// Kelvin per internal energy per initial volume.
    heating: f64,
}

impl Metal {
    /// In a material of this density.
    pub fn new(law: &SteinbergGuinan, density: f64) -> Self {
        Self { law: *law, heating: 1.0 / (density * law.specific_heat) }
    }

    /// `p / eta^(1/3)` and what temperature takes away; then whether the metal is solid.
    #[inline(always)]
    fn state<L: Lane>(&self, pressure: L, temperature: L, relative_volume: L) -> (L, L, L::Mask) {
        let (one, law) = (L::splat(1.0), &self.law);
        let pressed = pressure * cbrt(relative_volume);
        let warmed = L::splat(law.temperature_factor) * (temperature - L::splat(law.t_room));
        let power = 2.0 * (law.melt_gamma - law.melt_a - 1.0 / 3.0);
        let grown = L::splat(2.0 * law.melt_a) * (one - relative_volume);
        let melt = L::splat(law.t_melt) * exp(L::splat(power).neg_mul_add(ln(relative_volume), grown));
        (pressed, warmed, temperature.less(melt))
    }

    /// Hardened yield stress and its slope at room pressure and temperature.
    #[inline(always)]
    fn hardened<L: Lane>(&self, strain: L) -> (L, L) {
        let (zero, one, law) = (L::splat(0.0), L::splat(1.0), &self.law);
        let base = L::splat(law.beta).mul_add(strain + L::splat(law.initial_strain), one);
        let stress = L::splat(law.yield_stress) * pow(base, L::splat(law.n));
        let limit = L::splat(law.yield_limit);
        let grows = stress.less(limit);
        let slope = L::splat(law.beta * law.n) * stress / base;
        (L::select(grows, stress, limit), L::select(grows, slope, zero))
    }
}

impl StrengthLaw for Metal {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn thermal(&self) -> bool {
        true
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear
    }

    #[inline(always)]
    fn heating_by_energy(&self) -> f64 {
        self.heating
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        history: &mut History<L>,
        memory: &mut Memory<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one, law) = (L::splat(0.0), L::splat(1.0), &self.law);
        memory.least_pressure = L::splat(-law.tension);
        let pressure = around.pressure.max(memory.least_pressure);
        let (pressed, warmed, solid) = self.state(pressure, history.temperature, around.relative_volume);
        let stiff = (L::splat(law.pressure_factor).mul_add(pressed, one) - warmed).max(zero);
        let strong = (L::splat(law.yield_pressure_factor).mul_add(pressed, one) - warmed).max(zero);
        let (stiff, strong) = (L::select(solid, stiff, zero), L::select(solid, strong, zero));
        // The trial was made with G0; half of its increment has turned with the stress.
        let more = (stiff - one) * around.dt * L::splat(law.shear);
        let half = around.rate.scaled(more);
        let trial = trial.plus(&half).plus(&rotated(&half, &around.spin));
        let stiffer = L::splat(4.0 / 3.0 * law.shear) * (stiff - one);
        memory.added_stiffness = stiffer.max(zero);

        let reached = history.plastic_strain + around.strain.increment;
        let (stress, slope) = self.hardened(reached);
        let least = L::splat(law.yield_stress.min(law.yield_limit)) * strong;
        let tangent = Tangent { reached, stress: stress * strong, slope: slope * strong, least };
        // Without stiffness what is left of the stress goes as plastic strain of the cold metal.
        let shear = L::splat(law.shear) * L::select(zero.less(stiff), stiff, one);
        tangent.returned(trial, trial.mises_square().sqrt(), shear, 0.0, history, active)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{Strength, finite_strain::tests::Cube},
        *,
    };
    use crate::{
        lanes::scalar::Scalar,
        material::{Eos, Failure, Material},
        state::field,
    };

    /// OFHC copper, half hard, of the paper.
    const COPPER: SteinbergGuinan = SteinbergGuinan {
        shear: 47.7e9,
        yield_stress: 0.12e9,
        yield_limit: 0.64e9,
        beta: 36.0,
        n: 0.45,
        initial_strain: 0.0,
        pressure_factor: 2.83e-11,
        yield_pressure_factor: 2.83e-11,
        temperature_factor: 3.77e-4,
        t_melt: 1790.0,
        melt_gamma: 2.02,
        melt_a: 1.5,
        t_room: 300.0,
        specific_heat: 383.0,
        tension: 1e30,
    };
    const DENSITY: f64 = 8930.0;
    const SHOCK: Eos = Eos::Shock { c0: 3940.0, s: 1.489, gamma: 2.02 };

    fn copper(law: SteinbergGuinan, eos: Eos) -> Material {
        let strength = Strength::SteinbergGuinan(law);
        Material { name: "copper".into(), density: DENSITY, eos, strength, failure: Failure::None }
    }

    /// The published equations in plain numbers: G and Y.
    fn published(e: f64, p: f64, t: f64, v: f64) -> [f64; 2] {
        let eta = 1.0 / v;
        let melt = 1790.0 * eta.powf(2.0 * (2.02 - 1.5 - 1.0 / 3.0)) * (3.0 * (1.0 - v)).exp();
        let bracket = 1.0 + 2.83e-11 * p / eta.cbrt() - 3.77e-4 * (t - 300.0);
        if t >= melt {
            return [0.0; 2];
        }
        [47.7e9 * bracket, (0.12e9 * (1.0 + 36.0 * e).powf(0.45)).min(0.64e9) * bracket]
    }

    /// Squeezed quickly along x, as in a shock: every step has the shear modulus and the yield stress of its pressure and temperature.
    #[test]
    fn modulus_and_yield_stress_follow_pressure_and_temperature() {
        let mut cube = Cube::of_material(copper(COPPER, SHOCK));
        let (steps, dt) = (20_000, 1e-9);
        let (mut axial, mut strain, mut length) = (0.0f64, 0.0f64, 1.0f64);
        let mut before = cube.block.reading(0);
        let mut cold = (0.0f64, 1.0f64);
        for n in 1..=steps {
            let next = 1.0 - 0.25 * f64::from(n) / f64::from(steps);
            cube.step_to(&[[next, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], dt);
            let s = cube.block.reading(0);
            let stretching = (next - length) / dt / (0.5 * (next + length));
            // Pressure at the energy of the start, temperature of the start.
            let eta = 1.0 - next;
            let hugoniot = DENSITY * 3940.0 * 3940.0 * eta / (1.0 - 1.489 * eta).powi(2);
            let pressure = hugoniot * (1.0 - 1.01 * eta) + 2.02 * before[field::ENERGY];
            let at = |strain: f64| published(strain, pressure, before[field::TEMPERATURE], next);
            let [g, _] = at(strain);
            axial += 2.0 * g * (2.0 / 3.0) * stretching * dt;
            // The root of the return by Newton.
            let sigma = 1.5 * axial.abs();
            if sigma > at(strain)[1] {
                let mut slip = 0.0;
                for _ in 0..60 {
                    let h = 1e-7;
                    let slope = (at(strain + slip + h)[1] - at(strain + slip)[1]) / h;
                    slip += (sigma - 3.0 * g * slip - at(strain + slip)[1]) / (3.0 * g + slope);
                }
                strain += slip;
                axial *= 1.0 - 3.0 * g * slip / sigma;
            }
            let near = |found: f64, wanted: f64, scale: f64| {
                assert!((found - wanted).abs() < 2e-4 * scale, "{n}: {found} {wanted}");
            };
            near(s[field::SXX], axial, 1e9);
            near(s[field::PLASTIC_STRAIN], strain, 0.3);
            // The cold curve from the energy of the start, by Heun's steps.
            let on_curve = |v: f64, e: f64| {
                let eta = 1.0 - v;
                DENSITY * 3940.0 * 3940.0 * eta / (1.0 - 1.489 * eta).powi(2) * (1.0 - 1.01 * eta) + 2.02 * e
            };
            if n == 1 {
                cold = (-300.0 * DENSITY * 383.0, 1.0);
            }
            let p = on_curve(cold.1, cold.0);
            let guess = cold.0 - p * (next - cold.1);
            cold = (cold.0 - 0.5 * (p + on_curve(next, guess)) * (next - cold.1), next);
            let wanted = (s[field::ENERGY] - cold.0) / (DENSITY * 383.0);
            near(s[field::TEMPERATURE], wanted, wanted);
            (length, before) = (next, s);
        }
        let s = cube.block.reading(0);
        // Compressed by a quarter the metal is far stiffer and stronger than its limit, though hotter.
        assert!(s[field::PRESSURE] > 60e9 && s[field::TEMPERATURE] > 450.0, "{s:?}");
        let mises = 1.5 * s[field::SXX].abs();
        assert!(mises > 1.2 * 0.64e9, "{mises}");
        let [_, y] = published(s[field::PLASTIC_STRAIN], s[field::PRESSURE], s[field::TEMPERATURE], 0.75);
        assert!((mises / y - 1.0).abs() < 1e-3, "{mises} {y}");
    }

    #[test]
    fn state_and_hardening_are_those_of_the_equations() {
        let law = Metal::new(&COPPER, DENSITY);
        for (e, p, t, v) in [
            (0.0, 0.0, 300.0, 1.0),
            (0.1, 20e9, 500.0, 0.9),
            (3.0, -1e9, 250.0, 1.01),
            (0.5, 100e9, 3000.0, 0.7),
        ] {
            let (pressed, warmed, solid) = law.state(Scalar(p), Scalar(t), Scalar(v));
            assert!(solid);
            let bracket = 1.0 + 2.83e-11 * pressed.0 - warmed.0;
            let [g, y] = published(e, p, t, v);
            assert!((47.7e9 * bracket / g - 1.0).abs() < 1e-12, "{p} {t}");
            let (hardened, slope) = law.hardened(Scalar(e));
            assert!((hardened.0 * bracket / y - 1.0).abs() < 1e-12, "{e}");
            let difference = (law.hardened(Scalar(e + 1e-6)).0.0 - law.hardened(Scalar(e)).0.0) / 1e-6;
            assert!((slope.0 - difference).abs() <= 1e-4 * difference.max(1.0), "{e}");
        }
        // The melting curve: 1790 K at rest, higher under pressure.
        let solid = |t: f64, v: f64| law.state(Scalar(0.0), Scalar(t), Scalar(v)).2;
        assert!(solid(1789.9, 1.0) && !solid(1790.1, 1.0));
        let melt = 1790.0 * (1.0f64 / 0.8).powf(2.0 * (0.52 - 1.0 / 3.0)) * (3.0f64 * 0.2).exp();
        assert!(solid(melt * 0.9999, 0.8) && !solid(melt * 1.0001, 0.8));
    }

    #[test]
    fn what_has_melted_bears_no_shear_and_tension_has_its_cut_off() {
        // A melting curve that falls with compression.
        let law = SteinbergGuinan { t_melt: 350.0, melt_gamma: 0.0, melt_a: 0.0, tension: 1e9, ..COPPER };
        let mut cube = Cube::of_material(copper(law, SHOCK));
        let at = |x: f64| [[x, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut yielded = false;
        for n in 1..=4000 {
            cube.step_to(&at(1.0 - 0.2 * f64::from(n) / 4000.0), 1e-9);
            yielded |= cube.block.reading(0)[field::SXX].abs() > 1e8;
        }
        let s = cube.block.reading(0);
        assert!(yielded && s[field::TEMPERATURE] > 350.0 && s[field::PLASTIC_STRAIN] < 0.2, "{s:?}");
        assert!(s[field::SXX].abs() < 1e-3, "{s:?}");
        for n in 1..=4000 {
            cube.step_to(&at(0.8 + 0.3 * f64::from(n) / 4000.0), 1e-9);
        }
        assert_eq!(cube.block.reading(0)[field::PRESSURE], -1e9);
    }

    #[test]
    fn constants_of_no_metal_are_refused() {
        assert_eq!(COPPER.fault(), None);
        assert!(SteinbergGuinan { t_melt: 300.0, ..COPPER }.fault().is_some());
        assert!(SteinbergGuinan { yield_limit: 0.1e9, ..COPPER }.fault().is_some());
    }
}
