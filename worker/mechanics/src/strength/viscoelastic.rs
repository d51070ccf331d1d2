//! Linear viscoelasticity: a shear modulus that relaxes, `G(t) = long_shear + (shear - long_shear) e^(-decay t)`.
//!
//! The stress is that of a spring of `long_shear` beside a spring and a damper in series (Zener's solid); the part of the latter is kept
//! and turns with the material as the whole stress does. Over a step of constant rate it is integrated exactly:
//! `h' = h e^(-decay dt) + 2 (shear - long_shear) D' (1 - e^(-decay dt)) / decay`.
//!
//! L. R. Herrmann, F. E. Peterson, A numerical procedure for viscoelastic stress analysis, Proc. 7th ICRPG Mechanical Behavior
//! Working Group (1968).

use super::{Around, Deviator, History, Memory, StrengthLaw};
use crate::{
    element::rotation::rotated,
    lanes::{Lane, functions::exp},
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law.
    pub struct Viscoelastic = "viscoelastic" {
        /// G at once (stress).
        shear: STRESS, Positive;
        /// G after a long time (stress).
        long_shear: STRESS, NotNegative;
        /// How fast it relaxes (1/time).
        decay: RATE, NotNegative;
    }
}

impl Viscoelastic {
    /// What of the stress relaxes.
    pub const HISTORY: &'static [Variable] = &[
        column("relaxing_stress_xx"),
        column("relaxing_stress_yy"),
        column("relaxing_stress_xy"),
        column("relaxing_stress_yz"),
        column("relaxing_stress_zx"),
    ];

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        (self.long_shear > self.shear).then_some("a long_shear that is not above shear")
    }
}

const fn column(name: &'static str) -> Variable {
    Variable { name, unit: Unit::STRESS, initial: 0.0 }
}

/// Decay over a step below which a series stands for `(1 - e^-x) / x`, whose error is then below 1e-14.
const SMALL: f64 = 1e-3;

impl StrengthLaw for Viscoelastic {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
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
        let one = L::splat(1.0);
        memory.least_pressure = L::splat(-f64::MAX);
        let v = &mut memory.variables;
        let kept = Deviator { xx: v[0], yy: v[1], zz: -(v[0] + v[1]), xy: v[2], yz: v[3], zx: v[4] };
        // Twice the strain of the step, half of it turned, as the trial has it.
        let strain = around.rate.scaled(around.dt);
        let strain = rotated(&strain, &around.spin).plus(&strain);
        let kept = rotated(&kept, &around.spin);
        let x = L::splat(self.decay) * around.dt;
        let left = exp(-x);
        let small = x.less(L::splat(SMALL));
        let series =
            L::splat(-1.0 / 24.0).mul_add(x, L::splat(1.0 / 6.0)).mul_add(x, L::splat(-0.5)).mul_add(x, one);
        let mean = L::select(small, series, (one - left) / L::select(small, one, x));
        let relaxing = L::splat(self.shear - self.long_shear) * mean;
        let after = strain.mul_add(relaxing, &kept.scaled(left));
        (v[0], v[1], v[2], v[3], v[4]) = (after.xx, after.yy, after.xy, after.yz, after.zx);
        // The trial has the whole strain at once, and what relaxes as it was.
        let lasting = strain.mul_add(L::splat(self.long_shear - self.shear), &trial);
        let whole = lasting.plus(&after).plus(&kept.scaled(-one));
        // A pass that prepares a run leaves the stress to the bit.
        whole.or(L::splat(0.0).less(around.dt), &trial)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::finite_strain::tests::{Cube, Gradient, sheared, uniaxial},
        *,
    };
    use crate::material::Strength;

    const LAW: Viscoelastic = Viscoelastic { shear: 100e6, long_shear: 30e6, decay: 50.0 };

    #[test]
    fn the_stress_builds_up_and_relaxes_as_the_closed_form_has_it() {
        // A constant rate of the logarithmic strain for 20 ms, in steps of 1 ms, then rest.
        let (dt, rate) = (1e-3, 10.0);
        let Viscoelastic { shear, long_shear, decay } = LAW;
        for decay in [decay, 0.1] {
            let mut cube = Cube::of(Strength::Viscoelastic(Viscoelastic { decay, ..LAW }), 1e9);
            for n in 1..=60 {
                let t = f64::from(n) * dt;
                cube.step_to(&uniaxial((rate * t.min(20.0 * dt)).exp()), dt);
                let s = cube.deviator();
                // The rate in the middle of such a step.
                let middle = 2.0 / dt * (0.5 * rate * dt).tanh();
                let drawn = t.min(20.0 * dt);
                let built = (1.0 - (-decay * drawn).exp()) / decay * (-decay * (t - drawn)).exp();
                let wanted = 2.0 * middle * (long_shear * drawn + (shear - long_shear) * built);
                // Across the bar the chords are a little longer than the volume asks for.
                assert!((s[0] / wanted - 1.0).abs() < 2e-5, "{n}: {} {wanted}", s[0]);
            }
        }
    }

    #[test]
    fn a_turn_leaves_the_stress_of_the_body_to_relax_alone() {
        let (dt, turns) = (1e-3, 40);
        let run = |path: &dyn Fn(f64) -> Gradient| {
            let mut cube = Cube::of(Strength::Viscoelastic(LAW), 1e9);
            cube.step_to(&sheared(1e-3, 0.0), dt);
            (1..=turns).for_each(|n| cube.step_to(&path(f64::from(n) / f64::from(turns)), dt));
            cube.deviator()
        };
        let still = run(&|_| sheared(1e-3, 0.0));
        let turned = run(&|s| sheared(1e-3, std::f64::consts::PI * s));
        for (still, turned) in still.iter().zip(turned) {
            assert!((still - turned).abs() < 1e-9 * 1e5, "{still} {turned}");
        }
        let elapsed = f64::from(turns) * dt;
        let wanted = 1e-3 * (LAW.long_shear + (LAW.shear - LAW.long_shear) * (-LAW.decay * elapsed).exp());
        assert!((still[3] / wanted - 1.0).abs() < 0.03, "{still:?} {wanted}");
    }

    #[test]
    fn a_modulus_that_grows_with_time_is_refused() {
        assert_eq!(LAW.fault(), None);
        assert!(Viscoelastic { long_shear: 101e6, ..LAW }.fault().is_some());
    }
}
