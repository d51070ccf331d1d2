//! Low density foam: a nominal stress for each principal stretch by itself, from a curve in compression, with hysteresis.
//!
//! With the principal stretches l and the volume J, the nominal stress along an axis is `-curve(1 - l)` in compression and
//! `min(young (l - 1), tension)` in tension; Cauchy's is `nominal l / J`. Nothing happens across an axis: there is no Poisson's ratio.
//! W is the energy of these stresses per initial volume and `W_max` the most it has been: stresses are multiplied by
//! `h + (1 - h) (W / W_max)^shape`, with `h` the key `hysteresis`, so the loading path is the curve and unloading gives back less. A value of 1 loses nothing.
//!
//! J. O. Hallquist, LS-DYNA theoretical manual (1998), material model 57, has the uncoupled stresses; the factor by energy is that of the
//! same code's hysteretic unloading of foams by rate.

use super::{
    AHEAD, Around, Deviator, Hardening, History, Memory, StrengthLaw,
    curve::Curve,
    finite_strain::{COLUMNS, Symmetric},
    principal::{along, principal},
};
use crate::{
    lanes::{
        Lane,
        functions::{cbrt, pow},
    },
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law; the curve is that of the nominal stress by nominal strain in compression.
    pub struct LowDensityFoam = "low-density-foam" {
        /// E in tension (stress), at least the slopes with which the curve begins.
        young: STRESS, Positive;
        /// Greatest nominal stress.
        tension: STRESS, NotNegative;
        /// What remains of the stress at the end of unloading.
        hysteresis: NONE, Fraction = 1.0;
        /// Exponent of the energy.
        shape: NONE, Positive = 1.0;
    }
}

/// Index of the greatest energy among the history variables.
const GREATEST: usize = 6;

impl LowDensityFoam {
    /// What the points of the curve are.
    pub const POINTS: &'static str = "[nominal strain, nominal stress]";

    /// The left Cauchy-Green tensor, and the greatest energy so far.
    pub const HISTORY: &'static [Variable] = &[
        COLUMNS[0],
        COLUMNS[1],
        COLUMNS[2],
        COLUMNS[3],
        COLUMNS[4],
        COLUMNS[5],
        Variable { name: "greatest_foam_energy", unit: Unit::STRESS, initial: 0.0 },
    ];

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
pub(crate) struct LowDensity {
    law: LowDensityFoam,
    curve: Curve,
}

impl LowDensity {
    pub fn new(law: &LowDensityFoam, curve: &Hardening) -> Self {
        Self { law: *law, curve: Curve::new(curve) }
    }

    /// Nominal stress, its slope and its energy at a stretch.
    #[inline(always)]
    fn nominal<L: Lane>(&self, stretch: L) -> [L; 3] {
        let zero = L::splat(0.0);
        let drawn = stretch - L::splat(1.0);
        let [crush, slope, area] = self.curve.at((-drawn).max(zero));
        let (young, tension) = (L::splat(self.law.young), L::splat(self.law.tension));
        let tears = L::splat(self.law.tension / self.law.young);
        let elastic = drawn.max(zero).min(tears);
        let pull = young * elastic;
        let stored = L::splat(0.5).mul_add(pull * elastic, tension * (drawn - elastic).max(zero));
        let pressed = drawn.less(zero);
        [L::select(pressed, -crush, pull), L::select(pressed, slope, young), L::select(pressed, area, stored)]
    }
}

impl StrengthLaw for LowDensity {
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
        let (zero, one, third) = (L::splat(0.0), L::splat(1.0), L::splat(1.0 / 3.0));
        memory.least_pressure = L::splat(-f64::MAX);
        let b = Symmetric::of(&memory.variables).stretched(&around.gradient, around.dt);
        b.keep(&mut memory.variables);
        let (squares, axes) = principal(&b);
        let side = cbrt(around.relative_volume);
        let inverse = one / around.relative_volume;
        let mut stress = [zero; 3];
        let (mut energy, mut stiffest, mut largest) = (zero, zero, zero);
        let mut axis = 0;
        while axis < 3 {
            let stretch = squares[axis].max(zero).sqrt() * side;
            let [nominal, here, stored] = self.nominal(stretch);
            // The step must know the stiffness behind a corner of the curve before it is there.
            let [_, soon, _] =
                self.nominal(around.shortened().neg_mul_add(L::splat(AHEAD) * stretch, stretch));
            let slope = here.max(soon);
            let share = stretch * inverse;
            stress[axis] = nominal * share;
            energy = energy + stored;
            largest = nominal.mul_add(nominal, largest);
            // What a stretch along the axis and one across it change of the stress.
            let along_it = slope.mul_add(stretch * share, stress[axis].abs());
            stiffest = stiffest.max(along_it);
            axis += 1;
        }
        let greatest = memory.variables[GREATEST].max(energy);
        memory.variables[GREATEST] = greatest;
        // What is pressed by a hair may be pulled by one in the next cycle.
        let young = L::splat(self.law.young);
        memory.added_stiffness = stiffest.max(young);
        // That of the equation of state and the shear modulus is young once more.
        memory.idle_stiffness = young;
        let lost = 1.0 - self.law.hysteresis;
        if lost > 0.0 {
            let some = zero.less(greatest);
            let part = L::select(some, energy / L::select(some, greatest, one), one);
            let left = pow(part, L::splat(self.law.shape));
            let factor = L::splat(lost).mul_add(left - one, one);
            stress = [stress[0] * factor, stress[1] * factor, stress[2] * factor];
            // As the factor falls, the stress does with it: most where unloading begins, and from a small strain, where the square of the stress
            // is twice E times the energy, as much as ever. The step knows that before anything is loaded.
            let held = zero.less(energy);
            let square = largest / L::select(held, energy, one).max(L::splat(f64::MIN_POSITIVE));
            let steep = L::select(held, square, zero).max(young + young) * inverse;
            memory.added_stiffness = L::splat(lost * self.law.shape).mul_add(steep, memory.added_stiffness);
        }
        let mean = (stress[0] + stress[1] + stress[2]) * third;
        memory.added_pressure = -mean - around.pressure;
        let deviator = [stress[0] - mean, stress[1] - mean, stress[2] - mean];
        // A pass that prepares a run leaves the stress to the bit.
        along(&deviator, &axes).or(zero.less(around.dt), &trial)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::finite_strain::tests::{Cube, led},
        *,
    };
    use crate::{material::Strength, state::field};

    const LAW: LowDensityFoam = LowDensityFoam { young: 2e6, tension: 0.4e6, hysteresis: 0.3, shape: 5.0 };
    const POINTS: [[f64; 2]; 4] = [[0.0, 0.0], [0.05, 0.05e6], [0.6, 0.1e6], [0.9, 2e6]];

    fn law(law: LowDensityFoam) -> Strength {
        Strength::LowDensityFoam(law, Hardening::through(&POINTS))
    }

    fn curve(strain: f64) -> f64 {
        let line = POINTS.windows(2).find(|w| strain <= w[1][0]).expect("below the last");
        line[0][1] + (strain - line[0][0]) * (line[1][1] - line[0][1]) / (line[1][0] - line[0][0])
    }

    /// Energy up to a strain, by a fine sum.
    fn energy(strain: f64) -> f64 {
        let n = 20_000;
        (0..n).map(|i| curve((f64::from(i) + 0.5) / f64::from(n) * strain)).sum::<f64>() * strain
            / f64::from(n)
    }

    fn along_x(stretch: f64) -> [[f64; 3]; 3] {
        [[stretch, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    }

    /// Cauchy's stress along x, y and z.
    fn stress(cube: &Cube) -> [f64; 3] {
        let s = cube.deviator();
        let pressure = cube.block.reading(0)[field::PRESSURE];
        [s[0] - pressure, s[1] - pressure, s[2] - pressure]
    }

    #[test]
    fn loading_follows_the_curve_and_unloading_gives_back_what_hysteresis_leaves() {
        for hysteresis in [1.0, 0.3] {
            let mut cube = Cube::of(law(LowDensityFoam { hysteresis, ..LAW }), LAW.young / 3.0);
            let deepest = 0.8;
            for n in 1..=160 {
                // Down to 0.8 and up again; the area across does not change, so Cauchy's stress is the nominal one.
                let strain = if n <= 80 { 0.01 * f64::from(n) } else { deepest - 0.01 * f64::from(n - 80) };
                cube.step_to(&along_x(1.0 - strain), 1e-3);
                let factor = if n <= 80 {
                    1.0
                } else {
                    hysteresis + (1.0 - hysteresis) * (energy(strain) / energy(deepest)).powf(LAW.shape)
                };
                let wanted = if strain > 1e-9 { -curve(strain) * factor } else { 0.0 };
                let [x, y, z] = stress(&cube);
                assert!((x - wanted).abs() < 1e-6 * 0.1e6, "{hysteresis} {n}: {x} {wanted}");
                assert!(y.abs().max(z.abs()) < 1e-6 * 0.1e6, "{n}: {y} {z}");
            }
        }
    }

    #[test]
    fn stretches_along_two_axes_have_their_own_stresses_over_the_area() {
        let lossless = LowDensityFoam { hysteresis: 1.0, ..LAW };
        let path = |t: f64| [[1.0 - 0.5 * t, 0.0, 0.0], [0.0, 1.0 + 0.3 * t, 0.0], [0.0, 0.0, 1.0 + 0.1 * t]];
        let [x, y, z] = stress(&led(law(lossless), LAW.young / 3.0, 50, path));
        let (wx, wy, wz) =
            (-curve(0.5) / (1.3 * 1.1), LAW.tension / (0.5 * 1.1), 0.1 * LAW.young / (0.5 * 1.3));
        for (found, wanted) in [(x, wx), (y, wy), (z, wz)] {
            assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
        }
    }
}
