//! Ceramics after Johnson and Holmquist's first model (JH-1): the strength of the intact material by segments of the pressure, kept until the
//! damage is 1, and from then on that of the failed one.
//!
//! G. R. Johnson, T. J. Holmquist, A computational constitutive model for brittle materials subjected to large strains, high strain rates
//! and high pressures, in Shock-Wave and High-Strain-Rate Phenomena in Materials, Marcel Dekker (1992) 1075; as used for silicon carbide
//! by T. J. Holmquist, G. R. Johnson, J. Appl. Phys. 91 (2002) 5858:
//!
//! - intact: lines from no strength at `-tension` to `strength1` at `pressure1` and on to `strength2` at `pressure2`, constant beyond; failed:
//!   `alpha p`, at most `failed_limit`; both times `1 + c ln max(rate/rate0, 1)`, the failed one before its limit;
//! - damage grows by plastic strain increment over a strain that rises in a line from 0 at `-tension` to `fracture_strain` at
//!   `fracture_pressure` and stays there;
//! - the pressure is at least `-tension`, of failed material 0. Where damage comes to 1 the elastic energy between the two strengths is
//!   released, and `beta` of it swells the material, as with the second model (`johnson_holmquist.rs`).

use super::{Around, Deviator, History, Memory, StrengthLaw, johnson_holmquist::bulked};
use crate::{
    lanes::{Lane, functions::ln},
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law; K, K2 and K3 are those of the polynomial equation of state beside it.
    pub struct SegmentedCeramic = "johnson-holmquist-1" {
        /// G (stress).
        shear: STRESS, Positive;
        /// S1 (stress).
        strength1: STRESS, Positive;
        /// P1 (stress).
        pressure1: STRESS, Positive;
        /// S2 (stress).
        strength2: STRESS, Positive;
        /// P2 (stress).
        pressure2: STRESS, Positive;
        /// C, of the rate.
        c: NONE, NotNegative;
        /// The rate up to which the strength does not depend on it (1/time).
        rate0: RATE, Positive;
        /// T (stress): the mean tension that the intact material bears.
        tension: STRESS, Positive;
        /// Slope of the strength of the failed material.
        alpha: NONE, NotNegative;
        /// Most of its strength (stress).
        failed_limit: STRESS, NotNegative;
        /// Most plastic strain to fracture.
        fracture_strain: NONE, Positive;
        /// P3 (stress), where it is that.
        fracture_pressure: STRESS, Positive;
        /// Share of the released elastic energy that goes into swelling.
        beta: NONE, Fraction;
    }
}

/// Index of the bulking pressure among the history variables.
const BULKING: usize = 0;
/// Index of the elastic energy that damage has released.
const RELEASED: usize = 1;

impl SegmentedCeramic {
    /// What the law keeps of an element beside damage and plastic strain.
    pub const HISTORY: &'static [Variable] = &[
        Variable { name: "bulking_pressure", unit: Unit::STRESS, initial: 0.0 },
        Variable { name: "released_energy", unit: Unit::STRESS, initial: 0.0 },
    ];

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        (self.pressure2 <= self.pressure1 || self.strength2 < self.strength1)
            .then_some("a second point above the first in pressure, and no lower in strength")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Segmented {
    law: SegmentedCeramic,
    bulk: f64,
    inverse_rate0: f64,
    /// Slopes of the two segments of the intact strength.
    slopes: [f64; 2],
    /// Plastic strain to fracture by pressure above `-tension` (1/stress).
    fracture: f64,
}

impl Segmented {
    /// In a material of this bulk modulus.
    pub fn new(law: &SegmentedCeramic, bulk: f64) -> Self {
        let second = (law.strength2 - law.strength1) / (law.pressure2 - law.pressure1);
        Self {
            law: *law,
            bulk,
            inverse_rate0: 1.0 / law.rate0,
            slopes: [law.strength1 / (law.pressure1 + law.tension), second],
            fracture: law.fracture_strain / (law.fracture_pressure + law.tension),
        }
    }

    /// Strength intact and failed, and plastic strain to fracture.
    #[inline(always)]
    fn curves<L: Lane>(&self, pressure: L, rate: L) -> [L; 3] {
        let (zero, one, law) = (L::splat(0.0), L::splat(1.0), &self.law);
        let log = ln((rate * L::splat(self.inverse_rate0)).max(one));
        let factor = L::splat(law.c).mul_add(log, one);
        let raised = (pressure + L::splat(law.tension)).max(zero);
        let first = L::splat(self.slopes[0]) * raised;
        let past = pressure - L::splat(law.pressure1);
        let second = L::splat(self.slopes[1]).mul_add(past, L::splat(law.strength1));
        let intact = L::select(past.less(zero), first, second.min(L::splat(law.strength2)));
        let failed = L::splat(law.alpha) * pressure.max(zero) * factor;
        let to_fracture = (L::splat(self.fracture) * raised).min(L::splat(law.fracture_strain));
        [intact * factor, failed.min(L::splat(law.failed_limit)), to_fracture]
    }
}

impl StrengthLaw for Segmented {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear
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
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (damage, bulking) = (memory.damage, memory.variables[BULKING]);
        let has_failed = one.less_equal(damage);
        memory.added_pressure = bulking;
        memory.least_pressure = L::select(has_failed, zero, L::splat(-self.law.tension));
        let pressure = (around.pressure + bulking).max(memory.least_pressure);
        let [intact, failed, to_fracture] = self.curves(pressure, around.strain.rate);
        let strength = L::select(has_failed, failed, intact);
        let sigma = trial.mises_square().sqrt();
        let yields = strength.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        let slip = L::select(yields, (sigma - strength) * L::splat(1.0 / (3.0 * self.law.shear)), zero);
        history.plastic_strain = history.plastic_strain + slip;
        let grown = L::select(zero.less(to_fracture), damage + slip / to_fracture, one).min(one);
        let after = L::select(yields, grown, damage);
        memory.damage = after;

        // What the fall from one strength to the other sets free.
        let breaks = L::both(damage.less(one), one.less_equal(after));
        let released = strength.mul_add(strength, -(failed * failed)).max(zero);
        let released = L::select(breaks, released * L::splat(1.0 / (6.0 * self.law.shear)), zero);
        memory.variables[RELEASED] = memory.variables[RELEASED] + released;
        let elastic = L::splat(self.bulk) * (one / around.relative_volume - one);
        memory.variables[BULKING] = bulked(elastic, bulking, released, self.law.beta * self.bulk);
        trial.scaled(L::select(yields, strength / sigma, one))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::finite_strain::tests::Cube, *};
    use crate::{
        lanes::scalar::Scalar,
        material::{Eos, Failure, Material, Strength},
        state::field,
    };

    /// Silicon carbide of the library, with a tenth of its strain to fracture: compression breaks it.
    const LAW: SegmentedCeramic = SegmentedCeramic {
        shear: 193e9,
        strength1: 7.1e9,
        pressure1: 2.5e9,
        strength2: 12.2e9,
        pressure2: 10e9,
        c: 0.009,
        rate0: 1.0,
        tension: 0.75e9,
        alpha: 0.4,
        failed_limit: 1.3e9,
        fracture_strain: 0.12,
        fracture_pressure: 99.75e9,
        beta: 1.0,
    };
    const K: [f64; 2] = [220e9, 361e9];
    const DT: f64 = 2e-9;

    fn silicon_carbide() -> Material {
        let eos = Eos::Polynomial { a1: K[0], a2: K[1], a3: 0.0, b0: 0.0, b1: 0.0, t1: K[0], t2: 0.0 };
        let strength = Strength::SegmentedCeramic(LAW);
        Material { name: "silicon carbide".into(), density: 3215.0, eos, strength, failure: Failure::None }
    }

    /// The published strength of the intact and of the failed material and the strain to fracture, in plain numbers.
    fn published(p: f64, rate: f64) -> [f64; 3] {
        let factor = 1.0 + 0.009 * rate.max(1.0).ln();
        let intact = match p / 1e9 {
            x if x < -0.75 => 0.0,
            x if x < 2.5 => 7.1 * (x + 0.75) / 3.25,
            x if x < 10.0 => 7.1 + 5.1 * (x - 2.5) / 7.5,
            _ => 12.2,
        };
        let failed = (0.4 * p.max(0.0) * factor).min(1.3e9);
        let strain = 0.12 * ((p + 0.75e9) / 100.5e9).clamp(0.0, 1.0);
        [1e9 * intact * factor, failed, strain]
    }

    #[test]
    fn strengths_lie_on_the_segments() {
        let law = Segmented::new(&LAW, K[0]);
        for p in [-1e9, -0.75e9, 0.0, 1e9, 2.5e9, 5e9, 10e9, 60e9, 120e9] {
            for rate in [0.1, 1e4] {
                let found = law.curves(Scalar(p), Scalar(rate)).map(|x| x.0);
                for (found, wanted) in found.into_iter().zip(published(p, rate)) {
                    assert!(
                        (found - wanted).abs() <= 1e-13 * wanted.abs().max(1.0),
                        "{p} {rate}: {found} {wanted}"
                    );
                }
            }
        }
    }

    /// Compressed by 8 %, pulled until it is 4 % too long, compressed again: intact, failed and swollen, torn, closed.
    #[test]
    fn an_element_follows_the_published_equations_through_loading_and_unloading() {
        let mut cube = Cube::of_material(silicon_carbide());
        let (mut axial, mut strain, mut damage, mut bulking) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        let (mut length, mut intact_steps, mut swollen) = (1.0f64, 0, 0.0f64);
        for n in 0..14_000 {
            let rate = if (5000..10_000).contains(&n) { 12_000.0 } else { -8_000.0 };
            let next = length + rate * DT;
            cube.step_to(&[[next, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], DT);
            let stretching = rate / (0.5 * (next + length));
            length = next;
            let mu = 1.0 / length - 1.0;
            let cold = if mu > 0.0 { K[0] * mu + K[1] * mu * mu } else { K[0] * mu };
            let failed = damage >= 1.0;
            let pressure = (cold + bulking).max(if failed { 0.0 } else { -0.75e9 });
            let [whole, broken, to_fracture] = published(pressure, 2.0 / 3.0 * stretching.abs());
            let strength = if failed { broken } else { whole };
            axial += 2.0 * LAW.shear * (2.0 / 3.0) * stretching * DT;
            let sigma = 1.5 * axial.abs();
            if sigma > strength {
                let slip = (sigma - strength) / (3.0 * LAW.shear);
                strain += slip;
                axial *= strength / sigma;
                if !failed {
                    damage = if to_fracture > 0.0 { (damage + slip / to_fracture).min(1.0) } else { 1.0 };
                    let pressed = K[0] * mu + bulking;
                    if damage >= 1.0 && pressed >= 0.0 && strength > broken {
                        let released = (strength * strength - broken * broken) / (6.0 * LAW.shear);
                        bulking = (pressed * pressed + 2.0 * K[0] * released).sqrt() - K[0] * mu;
                    }
                }
            }
            let s = cube.block.reading(0);
            for (found, wanted, scale) in [
                (s[field::PRESSURE], pressure, 1e10),
                (s[field::SXX], axial, 1e10),
                (s[field::PLASTIC_STRAIN], strain, 1e-2),
                (s[field::DAMAGE], damage, 1.0),
                (cube.history()[BULKING], bulking, 1e9),
            ] {
                assert!((found - wanted).abs() <= 1e-8 * scale, "step {n}: {found} for {wanted}");
            }
            intact_steps += u32::from(damage == 0.0);
            swollen = swollen.max(bulking);
        }
        assert!((200..9000).contains(&intact_steps) && damage == 1.0, "{intact_steps} {damage}");
        assert!(swollen > 1e8, "{swollen}");
    }

    #[test]
    fn segments_that_fall_are_refused() {
        assert_eq!(LAW.fault(), None);
        assert!(SegmentedCeramic { pressure2: 2.5e9, ..LAW }.fault().is_some());
        assert!(SegmentedCeramic { strength2: 7e9, ..LAW }.fault().is_some());
    }
}
