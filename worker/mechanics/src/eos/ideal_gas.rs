//! Ideal gas: `p = (gamma - 1) E / v`, E per initial volume.

use super::{EquationOfState, Line};
use crate::lanes::Lane;

/// Ratio of specific heats.
#[derive(Clone, Copy)]
pub(crate) struct IdealGas {
    /// gamma, above 1.
    pub gamma: f64,
}

impl EquationOfState for IdealGas {
    #[inline(always)]
    fn line<L: Lane>(&self, v: L, _burnt: L) -> Line<L> {
        let zero = L::splat(0.0);
        let b = L::splat(self.gamma - 1.0) / v;
        Line { a: zero, b, slope_a: zero, slope_b: -(b / v) }
    }

    /// A gas may thin out to nothing.
    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, _burnt: L) -> L {
        L::splat(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{eos::difference_stiffness, lanes::scalar::Scalar};

    #[test]
    fn stiffness_is_gamma_times_the_pressure() {
        let law = IdealGas { gamma: 1.4 };
        for (v, energy) in [(0.3, 2.5e5), (1.0, 2.5e5), (7.0, 1e4)] {
            let line = law.line(Scalar(v), Scalar(1.0));
            let p = line.pressure(Scalar(energy));
            let found = line.stiffness(Scalar(v), p, Scalar(energy)).0;
            assert!((p.0 / (0.4 * energy / v) - 1.0).abs() < 1e-14);
            assert!((found / (1.4 * p.0) - 1.0).abs() < 1e-13, "{found}");
            assert!((found / difference_stiffness(&law, v, energy, 1.0) - 1.0).abs() < 1e-6);
        }
    }
}
