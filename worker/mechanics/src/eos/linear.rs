//! Linear in the logarithmic volume strain: `p = -K ln v`.

use super::{EquationOfState, Line};
use crate::lanes::{Lane, functions::ln};

/// Bulk modulus K (stress).
#[derive(Clone, Copy)]
pub(crate) struct Linear {
    /// K.
    pub bulk: f64,
}

impl EquationOfState for Linear {
    #[inline(always)]
    fn line<L: Lane>(&self, v: L, _burnt: L) -> Line<L> {
        let bulk = L::splat(self.bulk);
        let zero = L::splat(0.0);
        Line { a: -(bulk * ln(v)), b: zero, slope_a: -(bulk / v), slope_b: zero }
    }

    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, _burnt: L) -> L {
        L::splat(0.1 * self.bulk)
    }
}
