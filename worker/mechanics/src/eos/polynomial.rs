//! Polynomial in the compression `mu = 1/v - 1`, with a line in the energy.
//!
//! In compression `p = A1 mu + A2 mu^2 + A3 mu^3 + (B0 + B1 mu) E`, in tension `p = T1 mu + T2 mu^2 + B0 E`, E per
//! initial volume (AUTODYN's polynomial form). Both are zero at `mu = E = 0`; with T1 = A1 they join with equal slope.

use super::{EquationOfState, Line};
use crate::lanes::Lane;

/// Coefficients.
#[derive(Clone, Copy)]
pub(crate) struct Polynomial {
    /// A1 to A3 (stress).
    pub a: [f64; 3],
    /// B0 and B1.
    pub b: [f64; 2],
    /// T1 and T2 (stress).
    pub t: [f64; 2],
}

impl EquationOfState for Polynomial {
    #[inline(always)]
    fn line<L: Lane>(&self, v: L, _burnt: L) -> Line<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let inverse = one / v;
        let mu = inverse - one;
        let compressed = v.less(one);
        let c1 = L::select(compressed, L::splat(self.a[0]), L::splat(self.t[0]));
        let c2 = L::select(compressed, L::splat(self.a[1]), L::splat(self.t[1]));
        let c3 = L::select(compressed, L::splat(self.a[2]), zero);
        let b1 = L::select(compressed, L::splat(self.b[1]), zero);
        // d mu / d v.
        let rate = -(inverse * inverse);
        let slope = (L::splat(3.0) * c3).mul_add(mu, L::splat(2.0) * c2).mul_add(mu, c1);
        Line {
            a: c3.mul_add(mu, c2).mul_add(mu, c1) * mu,
            b: b1.mul_add(mu, L::splat(self.b[0])),
            slope_a: slope * rate,
            slope_b: b1 * rate,
        }
    }

    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, _burnt: L) -> L {
        L::splat(0.1 * self.a[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{eos::difference_stiffness, lanes::scalar::Scalar};

    const LAW: Polynomial = Polynomial { a: [160e9, 200e9, 90e9], b: [2.0, 1.5], t: [150e9, 30e9] };

    #[test]
    fn pressure_has_the_value_of_the_polynomial_on_either_side() {
        for (mu, energy) in [(0.25_f64, 2e9), (0.01, 1e7), (-0.02, 3e7)] {
            let p = LAW.line(Scalar(1.0 / (1.0 + mu)), Scalar(1.0)).pressure(Scalar(energy)).0;
            let expected = if mu > 0.0 {
                160e9 * mu + 200e9 * mu * mu + 90e9 * mu.powi(3) + (2.0 + 1.5 * mu) * energy
            } else {
                150e9 * mu + 30e9 * mu * mu + 2.0 * energy
            };
            assert!((p / expected - 1.0).abs() < 1e-12, "{mu}: {p} {expected}");
        }
    }

    #[test]
    fn stiffness_is_the_slope_of_the_isentrope() {
        for (v, energy) in [(0.8, 3e9), (0.97, 1e8), (1.02, 2e7)] {
            let line = LAW.line(Scalar(v), Scalar(1.0));
            let p = line.pressure(Scalar(energy));
            let found = line.stiffness(Scalar(v), p, Scalar(energy)).0;
            let expected = difference_stiffness(&LAW, v, energy, 1.0);
            assert!((found / expected - 1.0).abs() < 1e-6, "{v}: {found} {expected}");
        }
    }
}
