//! Strength in plane stress: the layers of a shell, whose normal stress is zero.
//!
//! The return to the von Mises surface is that of Simo and Taylor (1986): with
//! `s^2 = A / (1 + E g / (3 (1 - nu)))^2 + B / (1 + 2 G g)^2`, `A = (xx + yy)^2 / 4`,
//! `B = 3/4 (xx - yy)^2 + 3 (xy^2 + yz^2 + zx^2)` of the trial, and a plastic increment of `2/3 g s`, the multiplier g is
//! where s meets the yield stress. Newton's steps come from one side where hardening does not grow steeper, since the
//! difference is then convex. Each lane stops where its own step was small, whatever its neighbours do.

use super::{AnyStrength, StrengthLaw};
use crate::{lanes::Lane, material::Material};

/// Most Newton steps of the return. From a trial far outside each step halves the distance until the last few: a trial of 1e4 times the yield
/// stress takes 19.
pub(crate) const STEPS: usize = 32;
/// A lane stops after a step of this part of its multiplier: the next would be smaller than its rounding.
const SMALL: f64 = 1e-9;

/// Stress of a layer: the components that plane stress leaves.
#[derive(Clone, Copy)]
pub(crate) struct Plane<L> {
    pub xx: L,
    pub yy: L,
    pub xy: L,
    pub yz: L,
    pub zx: L,
}

/// What a layer remembers.
#[derive(Clone, Copy)]
pub(crate) struct Layer<L> {
    pub stress: Plane<L>,
    /// Effective plastic strain.
    pub plastic_strain: L,
    /// Temperature (K); zero for laws without one.
    pub temperature: L,
}

#[derive(Clone, Copy)]
pub(crate) struct PlaneLaw {
    /// Young's modulus (stress).
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Yield stress and what it depends on.
    pub strength: AnyStrength,
}

impl PlaneLaw {
    /// The law of a material, or its name if layers do not know it: shells need strength.
    pub fn of(material: &Material) -> Result<PlaneLaw, &'static str> {
        if material.is_gas() {
            return Err("a gas");
        }
        if material.remembers() {
            return Err(material
                .strength
                .declared()
                .map_or("a law with history variables", |(name, _)| name));
        }
        let strength = AnyStrength::of(material);
        if !strength.deviatoric() {
            return Err("hydro");
        }
        let (bulk, shear) = (material.bulk(), material.shear());
        let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
        Ok(PlaneLaw { young, poisson: young / (2.0 * shear) - 1.0, strength })
    }

    /// Whether it yields at all.
    pub fn yields(&self) -> bool {
        self.strength.plastic()
    }

    /// Shear modulus.
    pub fn shear(&self) -> f64 {
        0.5 * self.young / (1.0 + self.poisson)
    }

    /// Returns the trial stress in `layer` to the yield surface and keeps its history; `rate` is the effective strain
    /// rate. True where it yielded. A lane inside the surface keeps its bits.
    #[inline(always)]
    pub fn update<L: Lane>(&self, layer: &mut Layer<L>, rate: L) -> L::Mask {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let none = L::mask(0);
        if !self.strength.plastic() {
            return none;
        }
        let s = layer.stress;
        let (sum, difference) = (s.xx + s.yy, s.xx - s.yy);
        let a = L::splat(0.25) * sum * sum;
        let shears = s.xy.mul_add(s.xy, s.yz.mul_add(s.yz, s.zx * s.zx));
        let b = (L::splat(0.75) * difference).mul_add(difference, L::splat(3.0) * shears);
        let factor = self.strength.factor(rate, layer.temperature);
        let start = layer.plastic_strain;
        let yields = self.strength.flow(start, factor).0.less((a + b).sqrt());
        if !L::any(yields) {
            return none;
        }
        let k_a = L::splat(self.young / (3.0 * (1.0 - self.poisson)));
        let k_b = L::splat(2.0 * self.shear());
        let two_thirds = L::splat(2.0 / 3.0);
        let tiny = L::splat(f64::MIN_POSITIVE);
        let mut g = zero;
        let mut open = yields;
        let mut step = 0;
        while step < STEPS && L::any(open) {
            let (u, w) = (one / k_a.mul_add(g, one), one / k_b.mul_add(g, one));
            let (au, bw) = (a * u * u, b * w * w);
            let sigma = (au + bw).sqrt().max(tiny);
            let slope = -(au * u).mul_add(k_a, bw * w * k_b) / sigma;
            let strain = (two_thirds * g).mul_add(sigma, start);
            let (flow, hardening) = self.strength.flow(strain, factor);
            let strain_slope = two_thirds * g.mul_add(slope, sigma);
            let descent = hardening.mul_add(strain_slope, -slope).max(tiny);
            let next = (g + (sigma - flow) / descent).max(zero);
            let far = (L::splat(SMALL) * next).less((next - g).abs());
            g = L::select(open, next, g);
            open = L::both(open, far);
            step += 1;
        }
        let (u, w) = (one / k_a.mul_add(g, one), one / k_b.mul_add(g, one));
        let sigma = (a * u * u + b * w * w).sqrt();
        let slip = two_thirds * g * sigma;
        let half = L::splat(0.5);
        let (sum, difference) = (half * sum * u, half * difference * w);
        layer.stress = Plane {
            xx: L::select(yields, sum + difference, s.xx),
            yy: L::select(yields, sum - difference, s.yy),
            xy: L::select(yields, s.xy * w, s.xy),
            yz: L::select(yields, s.yz * w, s.yz),
            zx: L::select(yields, s.zx * w, s.zx),
        };
        layer.plastic_strain = start + L::select(yields, slip, zero);
        if self.strength.thermal() {
            let heat = L::splat(self.strength.heating()) * sigma * slip;
            layer.temperature = layer.temperature + L::select(yields, heat, zero);
        }
        yields
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        lanes::scalar::Scalar,
        material::{Eos, Failure, Hardening, Heat, Strength},
        strength::CowperSymonds,
    };

    const SHEAR: f64 = 77e9;

    fn law(strength: Strength) -> PlaneLaw {
        let (density, eos) = (7850.0, Eos::Linear { bulk: 167e9 });
        let material = Material { name: "steel".into(), density, eos, strength, failure: Failure::None };
        PlaneLaw::of(&material).expect("a law that layers know")
    }

    fn layer(stress: [f64; 5]) -> Layer<Scalar> {
        let [xx, yy, xy, yz, zx] = stress.map(Scalar);
        let stress = Plane { xx, yy, xy, yz, zx };
        Layer { stress, plastic_strain: Scalar(0.0), temperature: Scalar(0.0) }
    }

    #[test]
    fn the_return_ends_on_the_hardened_surface_and_in_the_closed_form_of_shear() {
        let law = law(Strength::VonMises { shear: SHEAR, yield_stress: 300e6, hardening: 1e9, rate: None });
        let mut mixed = layer([500e6, -200e6, 150e6, 20e6, -40e6]);
        assert!(law.update(&mut mixed, Scalar(0.0)));
        let s = mixed.stress;
        let shears = s.xy.0.powi(2) + s.yz.0.powi(2) + s.zx.0.powi(2);
        let mises = (s.xx.0.powi(2) - s.xx.0 * s.yy.0 + s.yy.0.powi(2) + 3.0 * shears).sqrt();
        let flow = 300e6 + 1e9 * mixed.plastic_strain.0;
        assert!((mises / flow - 1.0).abs() < 1e-12, "{mises} {flow}");

        let mut sheared = layer([0.0, 0.0, 400e6, 0.0, 0.0]);
        law.update(&mut sheared, Scalar(0.0));
        let slip = (400e6 * 3f64.sqrt() - 300e6) / (3.0 * law.shear() + 1e9);
        assert!((sheared.plastic_strain.0 / slip - 1.0).abs() < 1e-12, "{:?}", sheared.plastic_strain);
    }

    #[test]
    fn a_layer_far_outside_returns_to_its_curve_all_the_same() {
        let voce = super::super::Voce { shear: SHEAR, yield_stress: 240e6, q: 120e6, b: 14.0 };
        let steel = Strength::VonMises { shear: SHEAR, yield_stress: 240e6, hardening: 1e9, rate: None };
        for strength in [Strength::Voce(voce), steel] {
            let law = law(strength);
            for times in [2.0, 100.0, 1e4] {
                let trial = times * 240e6;
                let mut layer = layer([trial, 0.3 * trial, 0.2 * trial, 0.0, 0.0]);
                law.update(&mut layer, Scalar(1.0));
                let Plane { xx, yy, xy, .. } = layer.stress;
                let (xx, yy, xy) = (xx.0, yy.0, xy.0);
                let found = (xx * xx - xx * yy + yy * yy + 3.0 * xy * xy).sqrt();
                let flow = law.strength.flow(layer.plastic_strain, Scalar(1.0)).0.0;
                assert!((found / flow - 1.0).abs() < 1e-8, "{times} times: {found} on a curve of {flow}");
            }
        }
    }

    #[test]
    fn johnson_cook_returns_to_its_flow_stress_from_the_first_strain_on() {
        let law = law(Strength::JohnsonCook {
            shear: 46e9,
            a: 90e6,
            b: 292e6,
            n: 0.31,
            c: 0.0,
            m: 1.09,
            t_melt: 1356.0,
            t_room: 294.0,
            specific_heat: 383.0,
            rate0: 1.0,
            heat: Heat::PlasticWork,
        });
        let mut layer = layer([0.0, 0.0, 120e6, 0.0, 0.0]);
        layer.temperature = Scalar(294.0);
        law.update(&mut layer, Scalar(1.0));
        let expected = 90e6 + 292e6 * layer.plastic_strain.0.powf(0.31);
        let found = layer.stress.xy.0 * 3f64.sqrt();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }

    #[test]
    fn a_table_is_followed_from_line_to_line_and_the_rate_factor_multiplies_it() {
        let points = [[0.0, 300e6], [0.001, 400e6], [0.005, 450e6], [0.02, 460e6]];
        let mut table = Hardening { n_points: 4, strain: [0.0; 10], stress: [0.0; 10] };
        for (i, [strain, stress]) in points.into_iter().enumerate() {
            (table.strain[i], table.stress[i]) = (strain, stress);
        }
        let on_table = |e: f64| {
            let last = points.iter().rposition(|p| p[0] <= e).expect("the first is 0");
            let Some(next) = points.get(last + 1) else { return points[last][1] };
            let [at, stress] = points[last];
            stress + (next[1] - stress) * (e - at) / (next[0] - at)
        };
        let rated = CowperSymonds { reference: 40.4, exponent: 5.0 };
        for (rate, factor) in [(None, 1.0), (Some(rated), 1.0 + (200.0_f64 / 40.4).powf(0.2))] {
            let law = law(Strength::Tabulated { shear: SHEAR, hardening: table, rate });
            for overshoot in [1.001, 1.2, 2.0, 5.0, 40.0] {
                let mut layer = layer([0.0, 0.0, overshoot * factor * 300e6 / 3f64.sqrt(), 0.0, 0.0]);
                assert!(law.update(&mut layer, Scalar(200.0)));
                let expected = factor * on_table(layer.plastic_strain.0);
                let found = layer.stress.xy.0 * 3f64.sqrt();
                assert!((found / expected - 1.0).abs() < 1e-9, "{overshoot}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_layer_inside_the_surface_keeps_its_bits() {
        let law = law(Strength::VonMises { shear: SHEAR, yield_stress: 3e8, hardening: 0.0, rate: None });
        let mut inside = layer([1.1e8, 0.7e8, -0.3e8, 1.0, 2.0]);
        assert!(!law.update(&mut inside, Scalar(0.0)));
        assert_eq!(inside.stress.xx.0.to_bits(), 1.1e8f64.to_bits());
        assert_eq!(inside.plastic_strain.0.to_bits(), 0f64.to_bits());
    }
}
