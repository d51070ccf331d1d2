//! Strength in plane stress: the layers of a shell, whose normal stress is zero.
//!
//! The return to the von Mises surface is that of Simo and Taylor (1986): with
//! `s^2 = A / (1 + E g / (3 (1 - nu)))^2 + B / (1 + 2 G g)^2`, `A = (xx + yy)^2 / 4`,
//! `B = 3/4 (xx - yy)^2 + 3 (xy^2 + yz^2 + zx^2)` of the trial, and a plastic increment of `2/3 g s`, the multiplier g is
//! where s meets the yield stress.
//!
//! The yield stress is followed along its tangent `Y + H e`, e the plastic increment. The root of `Y / s = 1 - 2/3 H g` is then sought,
//! because `1 / s` hardly curves: it is linear in g where A or B is zero, and concave else, so that Newton's steps from a g that is too
//! small stay so. Where the tangent is that of the step before, this is Newton's step for the yield stress as well. Each lane
//! stops where its own step was small, whatever its neighbours do.

use super::{AnyStrength, StrengthLaw};
use crate::{lanes::Lane, material::Material};

/// Most steps of a return. Two or three are usual, ten where a power of the plastic strain begins.
pub(crate) const STEPS: usize = 32;
/// A lane stops after a step of this part of its multiplier: what is left is at most about its square.
const SMALL: f64 = 3e-5;
/// Or after one that changed its stress by this part.
const TINY: f64 = 1e-10;
/// A step back goes at most to this part of the multiplier: the tangent of a power of the plastic strain may lead beyond zero.
const BACK: f64 = 0.125;
/// What has melted keeps this part of its trial stress.
const MELTED: f64 = 1e-10;
/// The least yield stress at any rate is taken smaller by this, which is far above all roundings.
const MARGIN: f64 = 1.0 - 1e-9;

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
        if material.remembers() || material.strength.layers().is_some() {
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

    /// Returns the trial stress in `layer` to the yield surface and keeps its history; `rates` are those of strain, xx, yy and xy. True
    /// where it yielded. A lane inside the surface keeps its bits.
    #[inline(always)]
    pub fn update<L: Lane>(&self, layer: &mut Layer<L>, rates: &[L; 3]) -> L::Mask {
        let none = L::mask(0);
        if !self.strength.plastic() {
            return none;
        }
        let s = layer.stress;
        let (sum, difference) = (s.xx + s.yy, s.xx - s.yy);
        let a = L::splat(0.25) * sum * sum;
        let shears = s.xy.mul_add(s.xy, s.yz.mul_add(s.yz, s.zx * s.zx));
        let b = (L::splat(0.75) * difference).mul_add(difference, L::splat(3.0) * shears);
        let least = self.strength.least_flow(layer.plastic_strain, layer.temperature);
        let inside = (a + b).less(L::splat(MARGIN) * least * least);
        if L::bits(inside) == (1 << L::N) - 1 {
            return none;
        }
        let factor = self.strength.factor(effective_rate(rates), layer.temperature);
        let trial = Trial::new(self, a, b);
        let Some((yields, end)) = trial.back(&self.strength, layer.plastic_strain, factor) else {
            return none;
        };
        let half = L::splat(0.5);
        let (u, w) = (end.z * end.inverse, end.x * end.inverse);
        let (sum, difference) = (half * sum * u, half * difference * w);
        layer.stress = Plane {
            xx: L::select(yields, sum + difference, s.xx),
            yy: L::select(yields, sum - difference, s.yy),
            xy: L::select(yields, s.xy * w, s.xy),
            yz: L::select(yields, s.yz * w, s.yz),
            zx: L::select(yields, s.zx * w, s.zx),
        };
        let slip = L::select(yields, end.slip, L::splat(0.0));
        layer.plastic_strain = layer.plastic_strain + slip;
        if self.strength.thermal() {
            let heat = L::splat(self.strength.heating()) * end.stress;
            layer.temperature = heat.mul_add(slip, layer.temperature);
        }
        yields
    }
}

/// Effective rate of an incompressible layer, from those of strain xx, yy and xy.
#[inline(always)]
fn effective_rate<L: Lane>(rates: &[L; 3]) -> L {
    let [xx, yy, xy] = *rates;
    let square = xx.mul_add(xx, yy.mul_add(yy, xx * yy));
    let square = (L::splat(0.25) * xy).mul_add(xy, square);
    (L::splat(4.0 / 3.0) * square).sqrt()
}

/// A trial outside the surface.
#[derive(Clone, Copy)]
struct Trial<L> {
    /// A and B of the head of the file.
    a: L,
    b: L,
    /// What multiplies g in their divisors.
    k_a: L,
    k_b: L,
}

/// Where a trial is with a multiplier g.
#[derive(Clone, Copy)]
struct Place<L> {
    g: L,
    /// `1 + E g / (3 (1 - nu))` and `1 + 2 G g`; one over their product.
    x: L,
    z: L,
    inverse: L,
    /// The effective stress, by their product.
    scaled: L,
    scaled_square: L,
    /// The effective stress.
    stress: L,
    /// Plastic strain on the way.
    slip: L,
}

impl<L: Lane> Trial<L> {
    #[inline(always)]
    fn new(law: &PlaneLaw, a: L, b: L) -> Self {
        let k_a = L::splat(law.young / (3.0 * (1.0 - law.poisson)));
        Self { a, b, k_a, k_b: L::splat(2.0 * law.shear()) }
    }

    /// Where it begins.
    #[inline(always)]
    fn start(&self) -> Place<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let scaled_square = self.a + self.b;
        let scaled = scaled_square.sqrt();
        Place { g: zero, x: one, z: one, inverse: one, scaled, scaled_square, stress: scaled, slip: zero }
    }

    #[inline(always)]
    fn at(&self, g: L) -> Place<L> {
        let one = L::splat(1.0);
        let (x, z) = (self.k_a.mul_add(g, one), self.k_b.mul_add(g, one));
        let scaled_square = (self.a * z).mul_add(z, self.b * x * x);
        let scaled = scaled_square.sqrt();
        let inverse = one / (x * z);
        let stress = scaled * inverse;
        let slip = L::splat(2.0 / 3.0) * g * stress;
        Place { g, x, z, inverse, scaled, scaled_square, stress, slip }
    }

    /// The multiplier after a step from `place`, where the yield stress is `base + 3/2 slope slip`.
    #[inline(always)]
    fn step(&self, place: &Place<L>, base: L, slope: L) -> L {
        let Place { g, x, z, scaled, scaled_square, .. } = *place;
        let left = slope.neg_mul_add(g, L::splat(1.0));
        let above = left.mul_add(scaled, -(base * (x * z)));
        let cubes = (self.a * self.k_a * z).mul_add(z * z, self.b * self.k_b * x * (x * x));
        let descent = base.mul_add(cubes, slope * scaled_square * scaled);
        g + scaled_square * above / descent.max(L::splat(f64::MIN_POSITIVE))
    }

    /// Goes back to the yield stress of `strength` from a plastic strain of `start`: who yields and where they end; none if nobody does.
    #[inline(always)]
    fn back(&self, strength: &AnyStrength, start: L, factor: L) -> Option<(L::Mask, Place<L>)> {
        let two_thirds = L::splat(2.0 / 3.0);
        let mut place = self.start();
        let least = L::splat(MELTED) * place.stress;
        let mut yields = L::mask(0);
        let mut open = yields;
        let mut step = 0;
        loop {
            let (flow, hardening) = strength.flow(start + place.slip, factor);
            if step == 0 {
                yields = flow.less(place.stress);
                if !L::any(yields) {
                    return None;
                }
                open = yields;
            }
            let base = hardening.neg_mul_add(place.slip, flow.max(least));
            let slope = two_thirds * hardening;
            let mut g = self.step(&place, base, slope);
            if step == 0 {
                // The first tangent leads far: a second step along it spares one on the curve.
                g = self.step(&self.at(g), base, slope);
            }
            g = g.max(L::splat(BACK) * place.g);
            let change = (g - place.g).abs();
            let far = L::both((L::splat(SMALL) * g).less(change), L::splat(TINY).less(self.k_b * change));
            place = self.at(L::select(open, g, place.g));
            open = L::both(open, far);
            step += 1;
            if step == STEPS || !L::any(open) {
                return Some((yields, place));
            }
        }
    }
}

/// Rates of a layer that is sheared in its plane, by their effective rate.
#[cfg(test)]
pub(crate) fn sheared(rate: f64) -> [crate::lanes::scalar::Scalar; 3] {
    [0.0, 0.0, rate * 3f64.sqrt()].map(crate::lanes::scalar::Scalar)
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
        assert!(law.update(&mut mixed, &sheared(0.0)));
        let s = mixed.stress;
        let shears = s.xy.0.powi(2) + s.yz.0.powi(2) + s.zx.0.powi(2);
        let mises = (s.xx.0.powi(2) - s.xx.0 * s.yy.0 + s.yy.0.powi(2) + 3.0 * shears).sqrt();
        let flow = 300e6 + 1e9 * mixed.plastic_strain.0;
        assert!((mises / flow - 1.0).abs() < 1e-12, "{mises} {flow}");

        let mut pure = layer([0.0, 0.0, 400e6, 0.0, 0.0]);
        law.update(&mut pure, &sheared(0.0));
        let slip = (400e6 * 3f64.sqrt() - 300e6) / (3.0 * law.shear() + 1e9);
        assert!((pure.plastic_strain.0 / slip - 1.0).abs() < 1e-12, "{:?}", pure.plastic_strain);
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
                law.update(&mut layer, &sheared(1.0));
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
        // Hardening that begins with an infinite slope takes nearly all of a small overshoot.
        for overshoot in [0.01, 0.1, 1.3, 30.0] {
            let mut layer = layer([0.0, 0.0, (1.0 + overshoot) * 90e6 / 3f64.sqrt(), 0.0, 0.0]);
            layer.temperature = Scalar(294.0);
            law.update(&mut layer, &sheared(1.0));
            let expected = 90e6 + 292e6 * layer.plastic_strain.0.powf(0.31);
            let found = layer.stress.xy.0 * 3f64.sqrt();
            assert!((found / expected - 1.0).abs() < 1e-9, "{overshoot}: {found} {expected}");
        }
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
                assert!(law.update(&mut layer, &sheared(200.0)));
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
        assert!(!law.update(&mut inside, &sheared(0.0)));
        assert_eq!(inside.stress.xx.0.to_bits(), 1.1e8f64.to_bits());
        assert_eq!(inside.plastic_strain.0.to_bits(), 0f64.to_bits());
    }
}
