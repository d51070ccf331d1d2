//! Failure laws on lanes: damage from 0 to 1.
//!
//! The damage an element starts a cycle with rules that cycle: at 1 the element has *failed*, its deviatoric stress is
//! zero and its pressure not negative, so it bears neither tension nor shear; it resists compression, keeps its mass
//! and stays in the mesh. A law sees the state at the end of the cycle and gives the damage the next one starts with.
//! A new law is a file like its neighbours here: constants, [`FailureLaw`], tests.

use crate::{
    lanes::Lane,
    material::{Failure, Material, Strength},
    strength::{Deviator, Strain},
};

pub(crate) mod cockcroft_latham;
pub(crate) mod hydrostatic;
pub(crate) mod johnson_cook;
pub(crate) mod plastic_strain;
pub(crate) mod principal_stress;
pub mod scatter;

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

pub(crate) trait FailureLaw: Copy {
    /// Whether there is damage at all.
    #[inline(always)]
    fn fails(&self) -> bool {
        true
    }

    /// Damage after, from `damage` before; lanes that hold nothing may give anything.
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L;

    /// The least pressure that an element which has not failed can have (stress).
    #[inline(always)]
    fn least_pressure(&self) -> f64 {
        -f64::MAX
    }
}

/// Never fails.
#[derive(Clone, Copy)]
pub(crate) struct Unfailing;

impl FailureLaw for Unfailing {
    #[inline(always)]
    fn fails(&self) -> bool {
        false
    }

    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, _loading: &Loading<L>) -> L {
        damage
    }
}

/// Any of the laws, chosen by the material: the choice is one branch for a lane set, the same for the whole block.
#[derive(Clone, Copy)]
pub(crate) enum AnyFailure {
    Unfailing(Unfailing),
    PlasticStrain(plastic_strain::PlasticStrain),
    PrincipalStress(principal_stress::PrincipalStress),
    Hydrostatic(hydrostatic::Hydrostatic),
    JohnsonCook(johnson_cook::JohnsonCookDamage),
    CockcroftLatham(cockcroft_latham::CockcroftLatham),
}

impl AnyFailure {
    /// That of a material, made ready. Gases have no strength, so nothing in them fails.
    pub fn of(material: &Material) -> Self {
        match material.failure {
            _ if material.is_gas() => Self::Unfailing(Unfailing),
            Failure::None => Self::Unfailing(Unfailing),
            Failure::PlasticStrain { limit } => {
                Self::PlasticStrain(plastic_strain::PlasticStrain { inverse_limit: 1.0 / limit })
            }
            Failure::PrincipalStress { tension } => {
                Self::PrincipalStress(principal_stress::PrincipalStress { tension })
            }
            Failure::Hydrostatic { tension, heals } => {
                Self::Hydrostatic(hydrostatic::Hydrostatic { tension, heals })
            }
            Failure::CockcroftLatham { work } => {
                Self::CockcroftLatham(cockcroft_latham::CockcroftLatham { inverse_work: 1.0 / work })
            }
            Failure::JohnsonCook { d } => {
                // Zeros make the factors of rate and temperature 1.
                let (inverse_rate0, t_room, inverse_range) = match material.strength {
                    Strength::JohnsonCook { rate0, t_room, t_melt, .. } => {
                        (1.0 / rate0, t_room, 1.0 / (t_melt - t_room))
                    }
                    _ => (0.0, 0.0, 0.0),
                };
                Self::JohnsonCook(johnson_cook::JohnsonCookDamage { d, inverse_rate0, t_room, inverse_range })
            }
        }
    }
}

impl FailureLaw for AnyFailure {
    #[inline(always)]
    fn fails(&self) -> bool {
        !matches!(self, Self::Unfailing(_))
    }

    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        match self {
            Self::Unfailing(law) => law.damage(damage, loading),
            Self::PlasticStrain(law) => law.damage(damage, loading),
            Self::PrincipalStress(law) => law.damage(damage, loading),
            Self::Hydrostatic(law) => law.damage(damage, loading),
            Self::JohnsonCook(law) => law.damage(damage, loading),
            Self::CockcroftLatham(law) => law.damage(damage, loading),
        }
    }

    #[inline(always)]
    fn least_pressure(&self) -> f64 {
        match self {
            Self::Hydrostatic(law) => law.least_pressure(),
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
