//! Strength of a fibre: one direct stress and two shear stresses, the lateral stresses being zero.

use crate::{
    lanes::scalar::Scalar,
    strength::{
        StrengthLaw,
        plane_stress::{PlaneLaw, STEPS},
    },
};

/// What a fibre remembers.
pub(super) struct Fibre {
    /// Along the beam, positive in tension.
    pub stress: f64,
    /// Along `e2` and `e3`.
    pub shear: [f64; 2],
    pub plastic_strain: f64,
    pub temperature: f64,
}

impl Fibre {
    /// Adds the elastic stresses of these increments of strain and returns them to `s^2 + 3 t^2 = Y^2`.
    ///
    /// With the multiplier `g`, the plastic strain over the effective stress, the direct stress is `s / (1 + E g)` and the shear stresses
    /// are `t / (1 + 3 G g)` of their trials; Newton's steps find where the effective stress meets the yield stress.
    pub fn update(&mut self, law: &PlaneLaw, strain: f64, slide: [f64; 2], dt: f64) {
        let (young, shear) = (law.young, law.shear());
        self.stress += young * strain;
        for (stress, slide) in self.shear.iter_mut().zip(slide) {
            *stress += shear * slide;
        }
        let strength = &law.strength;
        if !strength.plastic() {
            return;
        }
        let rate = (strain * strain + (slide[0] * slide[0] + slide[1] * slide[1]) / 3.0).sqrt() / dt;
        let factor = strength.factor(Scalar(rate), Scalar(self.temperature));
        let start = self.plastic_strain;
        let direct = self.stress * self.stress;
        let across = 3.0 * (self.shear[0] * self.shear[0] + self.shear[1] * self.shear[1]);
        if (direct + across).sqrt() <= strength.flow(Scalar(start), factor).0.0 {
            return;
        }
        let effective = |g: f64| {
            let (u, w) = (1.0 / (1.0 + young * g), 1.0 / (1.0 + 3.0 * shear * g));
            let (a, b) = (direct * u * u, across * w * w);
            let size = (a + b).sqrt().max(f64::MIN_POSITIVE);
            (size, -(a * u * young + b * w * 3.0 * shear) / size)
        };
        let mut g = 0.0_f64;
        for _ in 0..STEPS {
            let (size, slope) = effective(g);
            let (flow, hardening) = strength.flow(Scalar(start + g * size), factor);
            let descent = (hardening.0 * (size + g * slope) - slope).max(f64::MIN_POSITIVE);
            let next = (g + (size - flow.0) / descent).max(0.0);
            let small = (next - g).abs() <= 1e-12 * next;
            g = next;
            if small {
                break;
            }
        }
        let (size, _) = effective(g);
        self.stress /= 1.0 + young * g;
        self.shear = self.shear.map(|t| t / (1.0 + 3.0 * shear * g));
        self.plastic_strain = start + g * size;
        if strength.thermal() {
            self.temperature += strength.heating() * size * g * size;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Eos, Failure, Material, Strength};

    #[test]
    fn the_return_ends_on_the_surface_along_the_closed_forms_of_tension_and_shear() {
        let strength = Strength::VonMises { shear: 80e9, yield_stress: 300e6, hardening: 2e9, rate: None };
        let eos = Eos::Linear { bulk: 160e9 };
        let material =
            Material { name: "steel".into(), density: 7800.0, eos, strength, failure: Failure::None };
        let law = PlaneLaw::of(&material).expect("a law with strength");
        let fresh = || Fibre { stress: 0.0, shear: [0.0; 2], plastic_strain: 0.0, temperature: 0.0 };
        let (young, shear) = (law.young, law.shear());

        let mut drawn = fresh();
        drawn.update(&law, 0.01, [0.0; 2], 1.0);
        let slip = (0.01 * young - 300e6) / (young + 2e9);
        assert!((drawn.plastic_strain / slip - 1.0).abs() < 1e-12, "{}", drawn.plastic_strain);
        assert!((drawn.stress / (300e6 + 2e9 * slip) - 1.0).abs() < 1e-12, "{}", drawn.stress);

        let mut slid = fresh();
        slid.update(&law, 0.0, [0.006, -0.008], 1.0);
        let slip = (0.01 * shear * 3.0_f64.sqrt() - 300e6) / (3.0 * shear + 2e9);
        assert!((slid.plastic_strain / slip - 1.0).abs() < 1e-12, "{}", slid.plastic_strain);

        let mut both = fresh();
        both.update(&law, -0.004, [0.005, 0.002], 1.0);
        let size = (both.stress.powi(2) + 3.0 * (both.shear[0].powi(2) + both.shear[1].powi(2))).sqrt();
        let flow = 300e6 + 2e9 * both.plastic_strain;
        assert!((size / flow - 1.0).abs() < 1e-12, "{size} {flow}");
    }
}
