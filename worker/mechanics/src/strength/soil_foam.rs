//! Soil and foam: a compaction curve of the pressure, and a yield surface that grows with it.
//!
//! With `x = -ln v` the pressure is `curve(x)` as long as x is the most that it has been, and below that most `x_m` it is
//! `curve(x_m) - unloading (x_m - x)`, no lower than `-tension`: what is compacted stays so. The second invariant of the deviator is at most
//! `a0 + a1 p + a2 p^2`, so the yield stress is `sqrt(3 (a0 + a1 p + a2 p^2))`; deformation at the surface is perfectly plastic.
//!
//! R. D. Krieg, A simple constitutive description for cellular concrete, Sandia SC-DR-72-0883 (1972).

use super::{Around, Deviator, Hardening, History, Memory, StrengthLaw, curve::Curve};
use crate::{
    lanes::{Lane, functions::ln},
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law; the curve is that of the pressure by `ln(rho/rho0)`.
    pub struct SoilFoam = "soil-foam" {
        /// G (stress).
        shear: STRESS, Positive;
        /// Bulk modulus of unloading (stress), at least the slopes of the curve.
        unloading: STRESS, Positive;
        /// Constant of the yield surface (square of a stress).
        a0: STRESS_SQUARED, NotNegative;
        /// Its slope (stress).
        a1: STRESS, NotNegative = 0.0;
        /// Its second coefficient.
        a2: NONE, Any = 0.0;
        /// The mean tension that it bears (stress).
        tension: STRESS, NotNegative = 0.0;
    }
}

impl SoilFoam {
    /// What the points of the curve are.
    pub const POINTS: &'static str = "[ln(rho/rho0), pressure]";

    /// How far it has been compacted.
    pub const HISTORY: &'static [Variable] =
        &[Variable { name: "greatest_compression", unit: Unit::NONE, initial: 0.0 }];

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self, curve: &Hardening) -> Option<&'static str> {
        if curve.stress[0] != 0.0 {
            return Some("a curve that begins without pressure");
        }
        (curve.steepest() > self.unloading)
            .then_some("an unloading modulus no less than the steepest line of the curve")
    }
}

/// The law made ready.
#[derive(Clone, Copy)]
pub(crate) struct Soil {
    law: SoilFoam,
    curve: Curve,
}

impl Soil {
    pub fn new(law: &SoilFoam, curve: &Hardening) -> Self {
        Self { law: *law, curve: Curve::new(curve) }
    }
}

impl StrengthLaw for Soil {
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
        let law = &self.law;
        let compression = -ln(around.relative_volume);
        let most = memory.variables[0].max(compression);
        memory.variables[0] = most;
        let [compacted, _, _] = self.curve.at(most);
        let least = L::splat(-law.tension);
        let pressure = L::splat(law.unloading).neg_mul_add(most - compression, compacted).max(least);
        memory.least_pressure = least;
        memory.added_pressure = pressure - around.pressure;
        let surface =
            L::splat(law.a2).mul_add(pressure, L::splat(law.a1)).mul_add(pressure, L::splat(law.a0));
        let strength = (L::splat(3.0) * surface.max(zero)).sqrt();
        let sigma = trial.mises_square().sqrt();
        let yields = strength.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        let slip = L::select(yields, (sigma - strength) * L::splat(1.0 / (3.0 * law.shear)), zero);
        history.plastic_strain = history.plastic_strain + slip;
        trial.scaled(L::select(yields, strength / sigma, one))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::finite_strain::tests::Cube, *};
    use crate::{material::Strength, state::field};

    const LAW: SoilFoam =
        SoilFoam { shear: 20e6, unloading: 300e6, a0: 1e10, a1: 2e5, a2: 0.3, tension: 0.1e6 };
    const POINTS: [[f64; 2]; 3] = [[0.0, 0.0], [0.1, 1e6], [0.2, 11e6]];

    fn soil() -> Strength {
        Strength::SoilFoam(LAW, Hardening::through(&POINTS))
    }

    fn curve(x: f64) -> f64 {
        if x < 0.1 { 10e6 * x } else { 1e6 + 100e6 * (x - 0.1) }
    }

    fn even(compression: f64) -> [[f64; 3]; 3] {
        let l = (-compression / 3.0).exp();
        [[l, 0.0, 0.0], [0.0, l, 0.0], [0.0, 0.0, l]]
    }

    #[test]
    fn pressure_follows_the_curve_unloads_steeply_and_is_cut_off_in_tension() {
        let mut cube = Cube::of(soil(), LAW.unloading);
        let step = |cube: &mut Cube, x: f64, wanted: f64| {
            cube.step_to(&even(x), 1e-3);
            let found = cube.block.reading(0)[field::PRESSURE];
            assert!((found - wanted).abs() < 1e-8 * 11e6, "{x}: {found} {wanted}");
        };
        (1..=150).map(|n| 0.001 * f64::from(n)).for_each(|x| step(&mut cube, x, curve(x)));
        let unloaded = |x: f64| (curve(0.15) - LAW.unloading * (0.15 - x)).max(-LAW.tension);
        (1..=40).map(|n| 0.15 - 0.001 * f64::from(n)).for_each(|x| step(&mut cube, x, unloaded(x)));
        assert_eq!(cube.block.reading(0)[field::PRESSURE], -LAW.tension);
        assert!((cube.history()[0] - 0.15).abs() < 1e-12);
        // Closed again, and on along the curve.
        (1..=90).map(|n| 0.11 + 0.001 * f64::from(n)).for_each(|x| {
            step(&mut cube, x, if x < 0.15 { unloaded(x) } else { curve(x) });
        });
    }

    #[test]
    fn shear_yields_where_the_second_invariant_comes_to_the_surface() {
        for compression in [0.0, 0.05, 0.15] {
            let mut cube = Cube::of(soil(), LAW.unloading);
            let l = (-compression / 3.0f64).exp();
            (1..=50).for_each(|n| cube.step_to(&even(compression * f64::from(n) / 50.0), 1e-3));
            let mut shear = 0.0;
            for _ in 0..400 {
                shear += 0.001;
                cube.step_to(&[[l, shear * l, 0.0], [0.0, l, 0.0], [0.0, 0.0, l]], 1e-3);
            }
            let p = curve(compression);
            let wanted = LAW.a0 + LAW.a1 * p + LAW.a2 * p * p;
            let s = cube.deviator();
            let second =
                0.5 * (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
            assert!((second / wanted - 1.0).abs() < 1e-6, "{compression}: {second} {wanted}");
            assert!(cube.block.reading(0)[field::PLASTIC_STRAIN] > 0.01);
        }
    }

    #[test]
    fn unloading_that_is_softer_than_the_curve_is_refused() {
        assert_eq!(LAW.fault(&Hardening::through(&POINTS)), None);
        assert!(SoilFoam { unloading: 99e6, ..LAW }.fault(&Hardening::through(&POINTS)).is_some());
        assert!(LAW.fault(&Hardening::through(&[[0.0, 1e5], [0.1, 1e6]])).is_some());
    }
}
