//! Failure at an effective plastic strain: the damage is the strain over the limit.

use super::{FailureLaw, Loading};
use crate::lanes::Lane;

/// The limit.
#[derive(Clone, Copy)]
pub(crate) struct PlasticStrain {
    /// `1 / limit`.
    pub inverse_limit: f64,
}

impl FailureLaw for PlasticStrain {
    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        let reached = loading.plastic_strain[1] * L::splat(self.inverse_limit);
        reached.max(damage).min(L::splat(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{failure::uniaxial, lanes::scalar::Scalar};

    #[test]
    fn damage_is_the_strain_over_the_limit_and_never_falls() {
        let law = PlasticStrain { inverse_limit: 1.0 / 0.4 };
        let mut loading = uniaxial(4e8, 0.0);
        for (strain, before, after) in [(0.1, 0.0, 0.25), (0.1, 0.5, 0.5), (0.4, 0.9, 1.0), (3.0, 0.9, 1.0)] {
            loading.plastic_strain[1] = Scalar(strain);
            assert!((law.damage(Scalar(before), &loading).0 - after).abs() < 1e-15);
        }
    }
}
