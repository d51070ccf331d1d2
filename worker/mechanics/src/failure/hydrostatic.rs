//! Cut-off of hydrostatic tension: the pressure does not fall below minus the limit, and there the element fails.
//!
//! One that heals is whole again once its pressure is positive: a fluid that cavitates and closes.

use super::{FailureLaw, Loading};
use crate::lanes::Lane;

/// The limit.
#[derive(Clone, Copy)]
pub(crate) struct Hydrostatic {
    /// Largest mean tension (stress).
    pub tension: f64,
    /// Whether compression makes the element whole.
    pub heals: bool,
}

impl FailureLaw for Hydrostatic {
    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let broken = loading.pressure.less_equal(L::splat(-self.tension));
        let damage = L::select(broken, one, damage);
        // The same for all elements of the material.
        if self.heals { L::select(zero.less(loading.pressure), zero, damage) } else { damage }
    }

    #[inline(always)]
    fn least_pressure(&self) -> f64 {
        -self.tension
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{failure::uniaxial, lanes::scalar::Scalar};

    #[test]
    fn tension_breaks_at_the_limit_and_only_compression_heals() {
        for heals in [false, true] {
            let law = Hydrostatic { tension: 1e5, heals };
            let after = |before: f64, p: f64| law.damage(Scalar(before), &uniaxial(0.0, p)).0;
            assert_eq!((after(0.0, -0.99e5), after(0.0, -1e5)), (0.0, 1.0));
            assert_eq!(after(1.0, 0.0), 1.0);
            assert_eq!(after(1.0, 1.0), if heals { 0.0 } else { 1.0 });
        }
    }
}
