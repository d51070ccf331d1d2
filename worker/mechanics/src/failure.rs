//! Failure laws on lanes: damage from 0 to 1.
//!
//! The damage an element starts a cycle with rules that cycle: at 1 the element has *failed*, its deviatoric stress is
//! zero and its pressure not negative, so it bears neither tension nor shear; it resists compression, keeps its mass
//! and stays in the mesh. A law sees the state at the end of the cycle and gives the damage the next one starts with.
//! A new law is a file like its neighbours here: constants, [`FailureLaw`], tests.

use crate::{
    lanes::Lane,
    strength::{Deviator, Strain},
};

pub(crate) mod hydrostatic;
pub(crate) mod johnson_cook;
pub(crate) mod plastic_strain;
pub(crate) mod principal_stress;

/// The state at the end of a cycle, for the damage it does.
#[derive(Clone, Copy)]
pub(crate) struct Loading<L> {
    /// Deviatoric stress.
    pub stress: Deviator<L>,
    /// Pressure, cut off as the law demands.
    pub pressure: L,
    /// Rate of deformation.
    pub strain: Strain<L>,
    /// Effective plastic strain before and after.
    pub plastic_strain: [L; 2],
    /// Temperature (K).
    pub temperature: L,
}

/// A failure law.
pub(crate) trait FailureLaw: Copy {
    /// Whether there is damage at all.
    const FAILS: bool;

    /// Damage after, from `damage` before; lanes that hold nothing may give anything.
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L;

    /// The least pressure that an element which has not failed can have (stress).
    fn least_pressure(&self) -> f64 {
        -f64::MAX
    }
}

/// Never fails.
#[derive(Clone, Copy)]
pub(crate) struct Unfailing;

impl FailureLaw for Unfailing {
    const FAILS: bool = false;

    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, _loading: &Loading<L>) -> L {
        damage
    }
}

/// Any of the laws that fail. They are chosen once for each lane set, not for each block, so that the kernels of all
/// other laws are compiled twice and not five times: the choice is one branch, the same for the whole block.
#[derive(Clone, Copy)]
pub(crate) enum Failing {
    PlasticStrain(plastic_strain::PlasticStrain),
    PrincipalStress(principal_stress::PrincipalStress),
    Hydrostatic(hydrostatic::Hydrostatic),
    JohnsonCook(johnson_cook::JohnsonCookDamage),
}

impl FailureLaw for Failing {
    const FAILS: bool = true;

    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        match self {
            Failing::PlasticStrain(law) => law.damage(damage, loading),
            Failing::PrincipalStress(law) => law.damage(damage, loading),
            Failing::Hydrostatic(law) => law.damage(damage, loading),
            Failing::JohnsonCook(law) => law.damage(damage, loading),
        }
    }

    #[inline(always)]
    fn least_pressure(&self) -> f64 {
        match self {
            Failing::Hydrostatic(law) => law.least_pressure(),
            _ => -f64::MAX,
        }
    }
}

/// A state for the tests of the laws: uniaxial deviator of von Mises stress `mises`, at rest.
#[cfg(test)]
pub(crate) fn uniaxial(mises: f64, pressure: f64) -> Loading<crate::lanes::scalar::Scalar> {
    use crate::lanes::scalar::Scalar;
    let third = Scalar(mises / 3.0);
    let stress = Deviator { xx: Scalar(2.0) * third, yy: -third, zz: -third, ..Deviator::zero() };
    Loading {
        stress,
        pressure: Scalar(pressure),
        strain: Strain { rate: Scalar(0.0), increment: Scalar(0.0) },
        plastic_strain: [Scalar(0.0); 2],
        temperature: Scalar(0.0),
    }
}
