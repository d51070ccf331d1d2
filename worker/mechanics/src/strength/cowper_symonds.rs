//! The factor of Cowper and Symonds (1957) on a yield stress: `1 + (rate / D)^(1/q)`.
//!
//! The rate is the total effective deviatoric strain rate.

use serde::{Deserialize, Serialize};

use crate::lanes::{Lane, functions::pow};

/// `1 + (rate / reference)^(1/exponent)`, a factor on the yield stress (Cowper and Symonds 1957).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CowperSymonds {
    /// D, the rate that doubles the yield stress (1/time).
    pub reference: f64,
    /// q.
    pub exponent: f64,
}

/// Constants made ready; the factor is 1 where there is none.
#[derive(Clone, Copy)]
pub(crate) struct RateFactor {
    /// `1/D` (time); 0 for no factor.
    inverse_reference: f64,
    /// `1/q`.
    power: f64,
}

impl RateFactor {
    /// That of a material.
    pub fn of(law: Option<CowperSymonds>) -> Self {
        match law {
            None => Self { inverse_reference: 0.0, power: 1.0 },
            Some(law) => Self { inverse_reference: 1.0 / law.reference, power: 1.0 / law.exponent },
        }
    }

    /// The factor at a strain rate (1/time).
    #[inline(always)]
    pub fn at<L: Lane>(&self, rate: L) -> L {
        let one = L::splat(1.0);
        // The same for all elements of the material.
        if self.inverse_reference == 0.0 {
            return one;
        }
        one + pow(rate * L::splat(self.inverse_reference), L::splat(self.power))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    #[test]
    fn mild_steel_doubles_its_yield_stress_at_the_reference_rate() {
        let law = RateFactor::of(Some(CowperSymonds { reference: 40.4, exponent: 5.0 }));
        let at = |rate: f64| law.at(Scalar(rate)).0;
        assert_eq!(at(0.0), 1.0);
        assert!((at(40.4) - 2.0).abs() < 1e-15);
        // Jones, Structural Impact: at 1000 per second the dynamic flow stress is 2.9 times the static one.
        assert!((at(1000.0) - (1.0 + (1000.0_f64 / 40.4).powf(0.2))).abs() < 1e-14);
        assert!((at(1000.0) - 2.9).abs() < 0.01);
        assert_eq!(RateFactor::of(None).at(Scalar(1e6)).0, 1.0);
    }
}
