//! Johnson and Cook (1983): `Y = (A + B e^n)(1 + C ln max(rate/rate0, 1))(1 - T*^m)`.
//!
//! The rate is the total effective deviatoric strain rate, floored at rate0; T* is
//! `(T - t_room) / (t_melt - t_room)` clamped to 0..1. All plastic work becomes heat, or the element says what heat it has
//! (`StrengthLaw::heating_by_energy`).

use serde::{Deserialize, Serialize};

use super::{Deviator, History, Strain, StrengthLaw};
use crate::lanes::{
    Lane,
    functions::{ln, pow},
};

/// What the temperature of a Johnson-Cook material follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Heat {
    /// Plastic work over `density * specific_heat`.
    PlasticWork,
    /// `(E - E_cold(v)) / (density * specific_heat)`: the internal energy, that of shocks too, less that of the material at the same volume
    /// without heat. The cold curve is the isentrope at 0 K, `dE_cold = -p(v, E_cold) dv`.
    InternalEnergy,
}

/// Constants of the law, those of [`crate::material::Strength::JohnsonCook`] made ready.
#[derive(Clone, Copy)]
pub(crate) struct JohnsonCook {
    /// G (stress).
    pub shear: f64,
    /// A (stress).
    pub a: f64,
    /// B (stress).
    pub b: f64,
    pub n: f64,
    pub c: f64,
    pub m: f64,
    /// Room temperature (K).
    pub t_room: f64,
    /// `1 / (t_melt - t_room)` (1/K).
    pub inverse_range: f64,
    /// `1 / (density * specific_heat)`: kelvin per energy per initial volume.
    pub heating: f64,
    /// The same for plastic work in solids; 0 where their temperature follows internal energy.
    pub by_work: f64,
    /// The same for internal energy above the cold curve; 0 where the temperature follows plastic work.
    pub by_energy: f64,
    /// `1 / rate0` (time).
    pub inverse_rate0: f64,
}

/// Least plastic strain at which the hardening is evaluated: its slope at zero is infinite for n < 1.
const LEAST_STRAIN: f64 = 1e-16;

impl JohnsonCook {
    /// Product of the rate factor and the thermal factor.
    #[inline(always)]
    fn softening<L: Lane>(&self, rate: L, temperature: L) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let mut factor = one;
        if self.c != 0.0 {
            let ratio = (rate * L::splat(self.inverse_rate0)).max(one);
            factor = L::splat(self.c).mul_add(ln(ratio), one);
        }
        let homologous =
            ((temperature - L::splat(self.t_room)) * L::splat(self.inverse_range)).max(zero).min(one);
        if L::any(zero.less(homologous)) {
            // The same for all elements of the material: the power 1 is no power.
            let softened = if self.m == 1.0 { homologous } else { pow(homologous, L::splat(self.m)) };
            factor = factor * (one - softened);
        }
        factor
    }

    /// Static hardening `B e^n`.
    #[inline(always)]
    fn hardening<L: Lane>(&self, strain: L) -> L {
        L::splat(self.b) * pow(strain, L::splat(self.n))
    }

    /// Flow stress at a plastic strain, a rate and a temperature.
    #[cfg(test)]
    fn flow_stress<L: Lane>(&self, strain: L, rate: L, temperature: L) -> L {
        (L::splat(self.a) + self.hardening(strain)) * self.softening(rate, temperature)
    }
}

/// What `1 - hot^m` is not below, for `hot` from 0 to 1: without a power.
#[inline(always)]
pub(super) fn least_left<L: Lane>(hot: L, m: f64) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    // The same for all elements of the material.
    if m < 1.0 { L::select(zero.less(hot), zero, one) } else { one - hot }
}

impl StrengthLaw for JohnsonCook {
    #[inline(always)]
    fn thermal(&self) -> bool {
        true
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
    }

    /// One evaluation, at the plastic strain that the step would reach if all its strain were plastic, and the
    /// tangent there. The tangent is finite even when the step starts at zero plastic strain.
    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        let grown = self.hardening(strain);
        // The slope is infinite at zero; a floor keeps the first step finite.
        let slope = L::splat(self.n) * grown / strain.max(L::splat(LEAST_STRAIN));
        ((L::splat(self.a) + grown) * factor, slope * factor)
    }

    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, temperature: L) -> L {
        let hot = (temperature - L::splat(self.t_room)) * L::splat(self.inverse_range);
        L::splat(self.a) * least_left(hot.max(L::splat(0.0)).min(L::splat(1.0)), self.m)
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, temperature: L) -> L {
        self.softening(rate, temperature)
    }

    #[inline(always)]
    fn heating(&self) -> f64 {
        self.heating
    }

    #[inline(always)]
    fn heating_by_energy(&self) -> f64 {
        self.by_energy
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let sigma_square = trial.mises_square();
        // Cold lanes below A cannot yield: the yield stress used below is at least A times the softening, which
        // is at least 1 in the cold. The margin is far above the roundings.
        let cold = history.temperature.less_equal(L::splat(self.t_room));
        let low = sigma_square.less_equal(L::splat(self.a * self.a * (1.0 - 1e-9)));
        if L::bits(L::both(L::both(cold, low), active)) == L::bits(active) {
            return trial;
        }
        let sigma = sigma_square.sqrt();
        let softening = self.softening(strain.rate, history.temperature);
        let reached = (history.plastic_strain + strain.increment).max(L::splat(LEAST_STRAIN));
        let hardening = self.hardening(reached);
        let slope = L::splat(self.n) * hardening / reached;
        // Yield stress at the strain before, by the tangent, not below that of the virgin material.
        let before = slope.neg_mul_add(reached - history.plastic_strain, hardening).max(zero);
        let yield_stress = (L::splat(self.a) + before) * softening;
        let yields = yield_stress.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        let three_g = L::splat(3.0 * self.shear);
        let slip = (sigma - yield_stress) / slope.mul_add(softening, three_g);
        let slip = L::select(yields, slip, zero);
        let flow = three_g.neg_mul_add(slip, sigma).max(zero);
        history.plastic_strain = history.plastic_strain + slip;
        history.temperature = (L::splat(self.by_work) * flow).mul_add(slip, history.temperature);
        trial.scaled(L::select(yields, flow / sigma, one))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    struct Reference {
        name: &'static str,
        density: f64,
        shear: f64,
        constants: [f64; 7],
        stress: [f64; 4],
        temperature: f64,
        flow: f64,
    }

    /// A, B, n, C, m, t_melt, specific heat; stress at (0.2, 1/s, 294 K), (0.2, 1000/s, 294 K),
    /// (0.2, 1000/s, 500 K), (0, 1/s, 294 K); temperature and stress after adiabatic strain 1 at 1000/s.
    const REFERENCES: [Reference; 4] = [
        Reference {
            name: "4340",
            density: 7830.0,
            shear: 77e9,
            constants: [792e6, 510e6, 0.26, 0.014, 1.03, 1793.0, 477.0],
            stress: [1127612381.818713, 1236662167.1828666, 1076537356.27103, 792e6],
            temperature: 609.3329339698996,
            flow: 1141259938.5617008,
        },
        Reference {
            name: "OFHC",
            density: 8960.0,
            shear: 46.4e9,
            constants: [90e6, 292e6, 0.31, 0.025, 1.09, 1356.0, 383.0],
            stress: [267297311.50232193, 313457921.86701936, 260999068.0990661, 90e6],
            temperature: 396.85178522900276,
            flow: 412806283.32130665,
        },
        Reference {
            name: "Armco",
            density: 7890.0,
            shear: 80e9,
            constants: [175e6, 380e6, 0.32, 0.060, 0.55, 1811.0, 452.0],
            stress: [402045655.0305804, 568679634.7863398, 379029752.4428855, 175e6],
            temperature: 443.4628419661651,
            flow: 565577790.4064753,
        },
        Reference {
            name: "2024",
            density: 2770.0,
            shear: 27.6e9,
            constants: [265e6, 426e6, 0.34, 0.015, 1.0, 775.0, 875.0],
            stress: [511467578.1531913, 564463971.09843, 322718486.5947365, 265e6],
            temperature: 497.9880922697567,
            flow: 439187051.0229734,
        },
    ];

    fn law(reference: &Reference) -> JohnsonCook {
        let [a, b, n, c, m, t_melt, specific_heat] = reference.constants;
        JohnsonCook {
            shear: reference.shear,
            a,
            b,
            n,
            c,
            m,
            t_room: 294.0,
            inverse_range: 1.0 / (t_melt - 294.0),
            heating: 1.0 / (reference.density * specific_heat),
            by_work: 1.0 / (reference.density * specific_heat),
            by_energy: 0.0,
            inverse_rate0: 1.0,
        }
    }

    #[test]
    fn flow_stress_has_the_published_point_values() {
        for reference in &REFERENCES {
            let law = law(reference);
            let points = [(0.2, 1.0, 294.0), (0.2, 1e3, 294.0), (0.2, 1e3, 500.0), (0.0, 1.0, 294.0)];
            for ((strain, rate, temperature), expected) in points.into_iter().zip(reference.stress) {
                let found = law.flow_stress(Scalar(strain), Scalar(rate), Scalar(temperature)).0;
                assert!((found / expected - 1.0).abs() < 1e-6, "{}: {found} {expected}", reference.name);
            }
        }
    }

    /// Pure shear at a constant rate until the plastic strain is 1.
    fn shear_until_one(law: &JohnsonCook, steps: f64) -> (f64, f64) {
        let rate = 1e3;
        let increment = 1.0 / steps;
        let mut history = History { plastic_strain: Scalar(0.0), temperature: Scalar(294.0) };
        let mut stress = Deviator::<Scalar>::zero();
        while history.plastic_strain.0 < 1.0 {
            let step = Scalar(2.0 * law.shear * increment * 3f64.sqrt() / 2.0);
            stress.xy = stress.xy + step;
            let strain = Strain { rate: Scalar(rate), increment: Scalar(increment) };
            stress = law.update(stress, strain, &mut history, true);
        }
        (history.temperature.0, (1.5 * stress.contract(&stress).0).sqrt())
    }

    #[test]
    fn adiabatic_heating_follows_the_integrated_curve() {
        for reference in &REFERENCES {
            let (temperature, flow) = shear_until_one(&law(reference), 4000.0);
            let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-3;
            assert!(close(temperature - 294.0, reference.temperature - 294.0), "{temperature}");
            assert!(close(flow, reference.flow), "{}: {flow} {}", reference.name, reference.flow);
        }
    }

    #[test]
    fn a_lane_inside_the_surface_comes_back_to_the_bit() {
        let law = law(&REFERENCES[0]);
        let mut trial = Deviator::<Scalar>::zero();
        trial.xy = Scalar(law.a / 3f64.sqrt() * 0.999_999);
        for temperature in [294.0, 294.000_001] {
            let mut history = History { plastic_strain: Scalar(0.0), temperature: Scalar(temperature) };
            let strain = Strain { rate: Scalar(1e3), increment: Scalar(1e-4) };
            let back = law.update(trial, strain, &mut history, true);
            assert_eq!(back.xy.0.to_bits(), trial.xy.0.to_bits());
            assert_eq!(history.plastic_strain.0.to_bits(), 0f64.to_bits());
        }
    }
}
