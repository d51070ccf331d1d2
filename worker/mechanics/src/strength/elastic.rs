//! Laws without yield: none at all, and hypoelastic.

use super::{Deviator, History, Strain, StrengthLaw};
use crate::lanes::Lane;

/// No shear strength: the deviator stays zero.
#[derive(Clone, Copy)]
pub(crate) struct Hydro;

impl StrengthLaw for Hydro {
    #[inline(always)]
    fn deviatoric(&self) -> bool {
        false
    }

    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        0.0
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        _trial: Deviator<L>,
        _strain: Strain<L>,
        _history: &mut History<L>,
        _active: L::Mask,
    ) -> Deviator<L> {
        Deviator::zero()
    }
}

/// Hypoelastic: the trial is the result.
#[derive(Clone, Copy)]
pub(crate) struct Elastic {
    /// G (stress).
    pub shear: f64,
}

impl StrengthLaw for Elastic {
    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
    }
}
