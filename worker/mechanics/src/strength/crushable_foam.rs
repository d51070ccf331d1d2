//! Crushable foam: elastic without Poisson's ratio, principal stresses bounded by a crush curve in compression and by a tension.
//!
//! The whole stress grows by `E` times the strain of the step; then each principal stress is at least `-crush(1 - v)`, by the loss of
//! volume, and at most `tension`. It unloads elastically, and what it lost of its volume stays lost. The pressure is that of this
//! stress; the equation of state beside it says how fast waves are, and nothing else.
//!
//! J. O. Hallquist, LS-DYNA theoretical manual (1998), material model 63.

use super::{
    AHEAD, Around, Deviator, Hardening, History, Memory, StrengthLaw,
    curve::Curve,
    finite_strain::Symmetric,
    principal::{along, principal},
};
use crate::{
    lanes::Lane,
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law; the curve is that of the crush stress by loss of volume.
    pub struct CrushableFoam = "crushable-foam" {
        /// E (stress), without Poisson's ratio.
        young: STRESS, Positive;
        /// Greatest principal stress.
        tension: STRESS, NotNegative;
    }
}

impl CrushableFoam {
    /// What the points of the curve are.
    pub const POINTS: &'static str = "[loss of volume, crush stress]";

    /// The greatest loss of volume so far.
    pub const HISTORY: &'static [Variable] =
        &[Variable { name: "greatest_volume_loss", unit: Unit::NONE, initial: 0.0 }];

    /// E without Poisson's ratio.
    pub(crate) fn bulk(&self) -> f64 {
        self.young / 3.0
    }

    /// E without Poisson's ratio.
    pub(crate) fn shear(&self) -> f64 {
        0.5 * self.young
    }
}

/// The law made ready.
#[derive(Clone, Copy)]
pub(crate) struct Crushable {
    law: CrushableFoam,
    curve: Curve,
}

impl Crushable {
    pub fn new(law: &CrushableFoam, crush: &Hardening) -> Self {
        Self { law: *law, curve: Curve::new(crush) }
    }
}

impl StrengthLaw for Crushable {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear()
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        _history: &mut History<L>,
        memory: &mut Memory<L>,
        _active: L::Mask,
    ) -> Deviator<L> {
        let third = L::splat(1.0 / 3.0);
        memory.least_pressure = L::splat(-f64::MAX);
        let swelling = around.volume_rate * around.dt;
        let mean = L::splat(self.law.bulk()).mul_add(swelling, -around.pressure_before);
        let whole = Symmetric {
            xx: trial.xx + mean,
            yy: trial.yy + mean,
            zz: trial.zz + mean,
            xy: trial.xy,
            yz: trial.yz,
            zx: trial.zx,
        };
        let (values, axes) = principal(&whole);
        let lost = L::splat(1.0) - around.relative_volume;
        memory.variables[0] = memory.variables[0].max(lost);
        let [crush, slope, _] = self.curve.at(lost);
        // Locked foam is as stiff as its curve, which the step must know before a corner of the curve is there.
        let [_, soon, _] = self.curve.at(around.shortened().mul_add(L::splat(AHEAD), lost));
        memory.added_stiffness = slope.max(soon);
        let tension = L::splat(self.law.tension);
        let least = -crush;
        // What the bounds change is added to the trial, which elsewhere stays as it is.
        let change = [
            values[0].max(least).min(tension) - values[0],
            values[1].max(least).min(tension) - values[1],
            values[2].max(least).min(tension) - values[2],
        ];
        let mut change = along(&change, &axes);
        let shift = (change.xx + change.yy + change.zz) * third;
        change.xx = change.xx - shift;
        change.yy = change.yy - shift;
        change.zz = change.zz - shift;
        memory.added_pressure = -(mean + shift) - around.pressure;
        let moves = L::splat(0.0).less(around.dt);
        trial.plus(&change).or(moves, &trial)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::finite_strain::tests::Cube, *};
    use crate::{material::Strength, state::field};

    const YOUNG: f64 = 10e6;

    fn law() -> Strength {
        let crush = Hardening::through(&[[0.0, 0.2e6], [0.5, 0.3e6], [0.8, 3e6]]);
        Strength::CrushableFoam(CrushableFoam { young: YOUNG, tension: 0.05e6 }, crush)
    }

    fn curve(lost: f64) -> f64 {
        if lost < 0.5 { 0.2e6 + 0.2e6 * lost } else { 0.3e6 + 9e6 * (lost - 0.5) }
    }

    /// Whole stress along x and y.
    fn stress(cube: &Cube) -> [f64; 2] {
        let s = cube.deviator();
        let pressure = cube.block.reading(0)[field::PRESSURE];
        [s[0] - pressure, s[1] - pressure]
    }

    #[test]
    fn a_cube_is_crushed_along_its_curve_unloads_elastically_and_tears_at_its_tension() {
        let mut cube = Cube::of(law(), YOUNG / 3.0);
        let along = |l: f64| [[l, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let dt = 1e-3;
        let mut length = 1.0;
        for n in 1..=700 {
            length = 1.0 - 0.001 * f64::from(n);
            cube.step_to(&along(length), dt);
            let [x, y] = stress(&cube);
            let elastic = YOUNG * f64::ln(length);
            let wanted = elastic.max(-curve(1.0 - length));
            assert!((x - wanted).abs() < 1e-5 * 0.2e6, "{n}: {x} {wanted}");
            assert!(y.abs() < 1e-6 * 0.2e6, "{n}: {y}");
        }
        let crushed = curve(1.0 - length);
        assert!(crushed > 2e6);
        for n in 1..=100 {
            let now = length * (0.004 * f64::from(n)).exp();
            cube.step_to(&along(now), dt);
            let wanted = (YOUNG * 0.004 * f64::from(n) - crushed).min(0.05e6);
            let [x, y] = stress(&cube);
            assert!((x - wanted).abs() < 1e-4 * 0.2e6 && y.abs() < 1e-6 * 0.2e6, "{n}: {x} {wanted} {y}");
        }
    }

    #[test]
    fn a_pressure_from_all_sides_crushes_at_the_same_curve() {
        let mut cube = Cube::of(law(), YOUNG / 3.0);
        for n in 1..=200 {
            let l = 1.0 - 0.001 * f64::from(n);
            cube.step_to(&[[l, 0.0, 0.0], [0.0, l, 0.0], [0.0, 0.0, l]], 1e-3);
        }
        let pressure = cube.block.reading(0)[field::PRESSURE];
        assert_eq!(cube.history().len(), 1);
        assert!((cube.history()[0] - (1.0 - 0.8f64.powi(3))).abs() < 1e-12, "{:?}", cube.history());
        let wanted = curve(1.0 - 0.8f64.powi(3));
        assert!((pressure / wanted - 1.0).abs() < 1e-9, "{pressure} {wanted}");
    }
}
