//! Damage after Johnson and Cook (Eng. Fract. Mech. 21, 1985, 31): the sum of plastic strain increments over
//! `e_f = (D1 + D2 exp(D3 eta))(1 + D4 ln max(rate/rate0, 1))(1 + D5 T*)`.
//!
//! eta is the mean stress over the von Mises stress, positive in tension, and taken as at most 1.5, where the published
//! fits end; the rate is the total effective deviatoric one; T* is that of the strength law, clamped to 0..1. Some
//! published constants give no strain at all in high tension: e_f is at least [`LEAST_STRAIN`].

use super::{FailureLaw, Loading};
use crate::lanes::{
    Lane,
    functions::{exp, ln},
    splat_each,
};

/// Least strain at fracture.
const LEAST_STRAIN: f64 = 1e-6;
/// Greatest ratio of mean to von Mises stress.
const HIGHEST_TRIAXIALITY: f64 = 1.5;

/// Constants made ready.
#[derive(Clone, Copy)]
pub(crate) struct JohnsonCookDamage {
    /// D1 to D5.
    pub d: [f64; 5],
    /// `1 / rate0` (time).
    pub inverse_rate0: f64,
    /// Room temperature (K).
    pub t_room: f64,
    /// `1 / (t_melt - t_room)` (1/K).
    pub inverse_range: f64,
}

impl JohnsonCookDamage {
    /// Strain at fracture at a constant triaxiality, rate and temperature.
    #[inline(always)]
    fn fracture_strain<L: Lane>(&self, triaxiality: L, rate: L, temperature: L) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let [d1, d2, d3, d4, d5] = splat_each::<L, _>(&self.d);
        let eta = triaxiality.min(L::splat(HIGHEST_TRIAXIALITY));
        let mut strain = d2.mul_add(exp(d3 * eta), d1);
        // The same for all elements of the material.
        if self.d[3] != 0.0 {
            strain = strain * d4.mul_add(ln((rate * L::splat(self.inverse_rate0)).max(one)), one);
        }
        let homologous =
            ((temperature - L::splat(self.t_room)) * L::splat(self.inverse_range)).max(zero).min(one);
        (strain * d5.mul_add(homologous, one)).max(L::splat(LEAST_STRAIN))
    }
}

impl FailureLaw for JohnsonCookDamage {
    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        let slip = loading.plastic_strain[1] - loading.plastic_strain[0];
        // Without slip no lane changes: what is left out would add exactly zero.
        if !L::any(L::splat(0.0).less(slip)) {
            return damage;
        }
        let sigma = loading.stress.mises_square().sqrt();
        let triaxiality = -loading.pressure / sigma.max(L::splat(f64::MIN_POSITIVE));
        let strain = self.fracture_strain(triaxiality, loading.strain.rate, loading.temperature);
        (damage + slip / strain).min(L::splat(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{failure::uniaxial, lanes::scalar::Scalar};

    fn law(d: [f64; 5], t_melt: f64) -> JohnsonCookDamage {
        JohnsonCookDamage { d, inverse_rate0: 1.0, t_room: 294.0, inverse_range: 1.0 / (t_melt - 294.0) }
    }

    /// Name, constants, melting temperature, and strains at fracture at triaxiality 1/3 and 0 (rate 1, room).
    const PUBLISHED: [(&str, [f64; 5], f64, [f64; 2]); 4] = [
        ("4340", [0.05, 3.44, -2.12, 0.002, 0.61], 1793.0, [1.746903, 3.49]),
        ("OFHC", [0.54, 4.89, -3.03, 0.014, 1.12], 1356.0, [2.321031, 5.43]),
        ("Armco", [-2.20, 5.43, -0.47, 0.016, 0.63], 1811.0, [2.442590, 3.23]),
        ("2024", [0.13, 0.13, -1.5, 0.011, 0.0], 775.0, [0.208849, 0.26]),
    ];

    #[test]
    fn fracture_strains_have_the_published_point_values() {
        for (name, d, t_melt, [tension, shear]) in PUBLISHED {
            let law = law(d, t_melt);
            let at =
                |eta: f64, rate: f64, t: f64| law.fracture_strain(Scalar(eta), Scalar(rate), Scalar(t)).0;
            assert!((at(1.0 / 3.0, 1.0, 294.0) / tension - 1.0).abs() < 3e-6, "{name}");
            assert!((at(0.0, 1.0, 294.0) / shear - 1.0).abs() < 1e-12, "{name}");
            let hot = shear * (1.0 + d[3] * 1e3_f64.ln()) * (1.0 + d[4] * 0.5);
            assert!((at(0.0, 1e3, 0.5 * (294.0 + t_melt)) / hot - 1.0).abs() < 1e-12, "{name}");
            assert_eq!(at(0.0, 1e-3, 200.0).to_bits(), at(0.0, 1.0, 294.0).to_bits());
        }
    }

    #[test]
    fn strain_at_a_constant_triaxiality_breaks_at_the_fracture_strain() {
        let law = law(PUBLISHED[0].1, PUBLISHED[0].2);
        let (mises, eta) = (9e8, 1.0 / 3.0);
        let mut loading = uniaxial(mises, -eta * mises);
        loading.strain.rate = Scalar(1.0);
        loading.temperature = Scalar(294.0);
        let mut damage = Scalar(0.0);
        for step in 0..1000 {
            loading.plastic_strain = [0, 1].map(|ahead| Scalar(1.746903 * f64::from(step + ahead) / 1e3));
            assert!(damage.0 < 1.0, "broken at step {step}");
            damage = law.damage(damage, &loading);
        }
        assert!((damage.0 - 1.0).abs() < 3e-6, "{}", damage.0);
    }

    #[test]
    fn no_state_gives_a_damage_beyond_0_to_1() {
        let law = law([-0.77, 1.45, -0.47, 0.0, 1.6], 925.0);
        for (mises, pressure) in [(0.0, 0.0), (1.0, -1e12), (1e8, 1e12), (0.0, 1e9), (1e8, -1.6e8)] {
            let mut loading = uniaxial(mises, pressure);
            loading.plastic_strain[1] = Scalar(1e-3);
            let damage = law.damage(Scalar(0.5), &loading).0;
            assert!((0.5..=1.0).contains(&damage), "{mises} {pressure}: {damage}");
        }
    }
}
