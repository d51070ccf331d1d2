//! The penalty spring: linear where it usually works, stiffer where a node gets near the depth at which a run must end.
//!
//! Its stiffness is chosen so that it stops a node at the closing speed of its part. What it cannot know is how hard the bodies behind
//! press: an element that does not crush as easily, a corner that meets an edge. So beyond [`FROM`] it grows:
//!
//! `f = k (d + s e^2)`, `E = k (d^2 / 2 + s e^3 / 3)`, `df/dd = k (1 + 2 s e)`, with `e = max(d - FROM gap, 0)` and `s = GROWTH / gap`.
//!
//! The energy is the integral of the force and the time step is voted by the slope, so that neither is lost.

use crate::lanes::{Lane, scalar::Scalar};

/// Depth (gaps) from which the spring hardens.
const FROM: f64 = 0.5;

/// How fast it does: at 0.9 gap its force is 3.8 times that of the linear spring, its energy 1.8 times.
const GROWTH: f64 = 16.0;

/// Where and how fast springs harden, of a gap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hardening {
    /// Depth from which they do (length).
    from: f64,
    /// `s` (one over a length).
    slope: f64,
}

/// A spring at a depth.
#[derive(Clone, Copy, Debug)]
pub struct Spring<L> {
    /// Force along its line, outward.
    pub force: L,
    /// Energy stored.
    pub energy: L,
}

impl Hardening {
    pub fn of(gap: f64) -> Self {
        Self { from: FROM * gap, slope: GROWTH / gap }
    }

    /// How far a depth is beyond that from which springs harden (length).
    #[inline(always)]
    fn beyond<L: Lane>(self, depth: L) -> L {
        (depth - L::splat(self.from)).max(L::splat(0.0))
    }

    /// A spring of stiffness `k` at a depth. Force and energy have the bits of a linear spring where it is one.
    #[inline(always)]
    pub fn spring<L: Lane>(self, k: L, depth: L) -> Spring<L> {
        let beyond = self.beyond(depth);
        let linear = k * depth;
        let harder = (k * L::splat(self.slope)) * (beyond * beyond);
        let energy = L::splat(0.5) * linear * depth + harder * beyond * L::splat(1.0 / 3.0);
        Spring { force: linear + harder, energy }
    }

    /// The same for one pair.
    #[inline(always)]
    pub fn spring_of_one(self, k: f64, depth: f64) -> Spring<f64> {
        let Spring { force: Scalar(force), energy: Scalar(energy) } = self.spring(Scalar(k), Scalar(depth));
        Spring { force, energy }
    }

    /// The slope of the force at a depth over the stiffness.
    #[inline(always)]
    pub fn tangent<L: Lane>(self, depth: L) -> L {
        L::splat(1.0) + L::splat(2.0 * self.slope) * self.beyond(depth)
    }

    /// The same for one pair.
    #[inline(always)]
    pub fn tangent_of_one(self, depth: f64) -> f64 {
        let Scalar(tangent) = self.tangent(Scalar(depth));
        tangent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_energy_is_the_integral_of_the_force_and_the_tangent_its_slope() {
        let hardening = Hardening::of(0.2);
        let k = 3.0;
        let step = 1e-7;
        for i in 1..200 {
            let depth = 1e-3 * f64::from(i);
            let [before, now, after] = [-step, 0.0, step].map(|by| hardening.spring_of_one(k, depth + by));
            let force = (after.energy - before.energy) / (2.0 * step);
            assert!((force - now.force).abs() < 1e-6 * now.force, "at {depth}: {force} for {}", now.force);
            let slope = (after.force - before.force) / (2.0 * step);
            assert!((slope / k - hardening.tangent_of_one(depth)).abs() < 1e-4, "at {depth}: {slope}");
        }
    }

    #[test]
    fn a_spring_that_is_not_deep_is_linear_to_the_bit() {
        let hardening = Hardening::of(0.2);
        for (k, depth) in [(3.7e9, 0.01), (1.1, 0.0999), (5.3e-7, 0.0)] {
            let spring = hardening.spring_of_one(k, depth);
            assert_eq!((spring.force, spring.energy), (k * depth, 0.5 * (k * depth) * depth));
            assert_eq!(hardening.tangent_of_one(depth), 1.0);
        }
    }

    #[test]
    fn near_the_depth_at_which_a_run_ends_it_pushes_almost_four_times_as_hard() {
        let deep = Hardening::of(1.0).spring_of_one(1.0, 0.9);
        assert!(
            (deep.force - 3.46).abs() < 1e-12 && (deep.energy - (0.405 + 1.024 / 3.0)).abs() < 1e-12,
            "{deep:?}"
        );
    }
}
