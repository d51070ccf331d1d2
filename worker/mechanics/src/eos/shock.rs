//! Mie-Grueneisen about a straight shock line `Us = c0 + s up`, with `rho Gamma = rho0 Gamma0`.
//!
//! With `eta = 1 - v` and `K = rho0 c0^2`, the Hugoniot is `p_H = K eta / (1 - s eta)^2` at energy `p_H eta / 2` per
//! initial volume, so in compression `p = p_H (1 - Gamma0 eta / 2) + Gamma0 E`. In tension
//! `p = K (1/v - 1) + Gamma0 E`, which joins with equal slope. Compression beyond `s eta = 0.95`, close to the
//! pole of the line, is taken as that of the bound.

use super::{EquationOfState, Line};
use crate::lanes::Lane;

/// Constants of the shock line.
#[derive(Clone, Copy)]
pub(crate) struct Shock {
    /// `rho0 c0^2` (stress).
    pub bulk: f64,
    /// Slope s.
    pub s: f64,
    /// Gamma0.
    pub gamma: f64,
}

impl EquationOfState for Shock {
    #[inline(always)]
    fn line<L: Lane>(&self, v: L, _burnt: L) -> Line<L> {
        let one = L::splat(1.0);
        let bulk = L::splat(self.bulk);
        let gamma = L::splat(self.gamma);
        let half_gamma = L::splat(0.5 * self.gamma);
        let eta = one - v;
        let compressed = L::splat(0.0).less(eta);
        let slope_times_eta = (L::splat(self.s) * eta).min(L::splat(0.95));
        // One division serves both branches: 1/(1 - s eta) squeezed, 1/v stretched.
        let inverse = one / L::select(compressed, one - slope_times_eta, v);
        let square = inverse * inverse;
        let hugoniot = bulk * eta * square;
        let hugoniot_slope = bulk * (one + slope_times_eta) * square * inverse;
        let away = half_gamma.neg_mul_add(eta, one);
        let a = L::select(compressed, hugoniot * away, bulk * (inverse - one));
        let slope =
            L::select(compressed, half_gamma.mul_add(hugoniot, -(hugoniot_slope * away)), -(bulk * square));
        Line { a, b: gamma, slope_a: slope, slope_b: L::splat(0.0) }
    }

    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, _burnt: L) -> L {
        L::splat(0.1 * self.bulk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        eos::{Linear, difference_stiffness},
        lanes::scalar::Scalar,
    };

    /// Copper of the shock tables.
    const COPPER: Shock = Shock { bulk: 8960.0 * 3940.0 * 3940.0, s: 1.489, gamma: 2.02 };

    #[test]
    fn states_behind_shocks_lie_on_the_surface() {
        for (up, pressure) in [(250.0, 9.65944e9), (500.0, 20.98656e9)] {
            let us = 3940.0 + 1.489 * up;
            let v = 1.0 - up / us;
            let energy = 8960.0 * up * up / 2.0;
            let line = COPPER.line(Scalar(v), Scalar(1.0));
            let p = line.pressure(Scalar(energy)).0;
            assert!((p / (8960.0 * us * up) - 1.0).abs() < 1e-12);
            assert!((p / pressure - 1.0).abs() < 1e-5, "{p}");
        }
    }

    #[test]
    fn stiffness_is_the_slope_of_the_isentrope() {
        for law in [COPPER, Shock { gamma: 0.0, ..COPPER }] {
            for (v, energy) in [(0.8, 3e9), (0.97, 1e8), (1.02, 2e7), (1.2, 0.0)] {
                let line = law.line(Scalar(v), Scalar(1.0));
                let p = line.pressure(Scalar(energy)).0;
                let expected = difference_stiffness(&law, v, energy, 1.0);
                let found = line.stiffness(Scalar(v), Scalar(p), Scalar(energy)).0;
                assert!((found / expected - 1.0).abs() < 1e-6, "{v}: {found} {expected}");
            }
        }
        let linear = Linear { bulk: 7.0 };
        let stiffness =
            linear.line(Scalar(0.7), Scalar(1.0)).stiffness(Scalar(0.7), Scalar(1.0), Scalar(1.0)).0;
        assert!((stiffness - 7.0).abs() < 1e-14);
    }

    #[test]
    fn energy_after_satisfies_its_own_equation() {
        let line = COPPER.line(Scalar(0.9), Scalar(1.0));
        let (before, p_before, q, dv) = (2e9, 1.1e10, 4e8, -0.01);
        let after = line.energy_after(Scalar(before), Scalar(p_before), Scalar(q), Scalar(dv)).0;
        let p = line.pressure(Scalar(after)).0;
        let expected = before - ((p_before + p) / 2.0 + q) * dv;
        assert!((after / expected - 1.0).abs() < 1e-14);
    }
}
