//! What a material asks its laws.

use super::{AnyRemembering, AnyStrength, Heat, Strength, StrengthLaw, porous};
use crate::{
    law::Variable,
    material::{Eos, Material},
};

impl Material {
    /// Shear modulus G (stress); zero without strength.
    pub fn shear(&self) -> f64 {
        AnyStrength::of(self).shear()
    }

    /// The history variables of its laws.
    pub fn history(&self) -> &'static [Variable] {
        match self.eos {
            _ if self.is_gas() => &[],
            Eos::Porous(_) => porous::HISTORY,
            _ => self.strength.history(),
        }
    }

    /// Whether its laws see and keep more of an element than damage, plastic strain and temperature. Such a material is for solids of one
    /// point, and has what failure its strength makes.
    pub fn remembers(&self) -> bool {
        AnyRemembering::of(self).is_some()
    }

    /// Whether its strength does, whatever the equation of state beside it, or takes its heat from the internal energy: then it stands
    /// beside none that keeps something of an element, too.
    pub fn has_strength_with_energy(&self) -> bool {
        let by_energy = matches!(self.strength, Strength::JohnsonCook { heat: Heat::InternalEnergy, .. });
        by_energy || AnyRemembering::of_strength(self).is_some()
    }
}
