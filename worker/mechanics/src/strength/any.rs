//! The laws without history variables as one, chosen by the material.

use super::{
    Deviator, Elastic, Heat, History, Hydro, JohnsonCook, RateFactor, Strain, Strength, StrengthLaw,
    Tabulated, Voce, VonMises, apart::Apart, modified_johnson_cook::ModifiedCook, power_law::Power,
    zerilli_armstrong::Dislocations,
};
use crate::{lanes::Lane, material::Material};

/// The laws of this module by their names in [`AnyStrength`]: the one list that calls go by.
macro_rules! of_any {
    ($any:expr, $law:ident => $call:expr) => {
        match $any {
            AnyStrength::Hydro($law) => $call,
            AnyStrength::Elastic($law) => $call,
            AnyStrength::VonMises($law) => $call,
            AnyStrength::Tabulated($law) => $call,
            AnyStrength::JohnsonCook($law) => $call,
            AnyStrength::Voce($law) => $call,
            AnyStrength::PowerLaw($law) => $call,
            AnyStrength::ModifiedJohnsonCook($law) => $call,
            AnyStrength::ZerilliArmstrong($law) => $call,
        }
    };
}

/// Any of the laws, chosen by the material: the choice is one branch for a lane set, the same for the whole block.
#[derive(Clone, Copy)]
pub(crate) enum AnyStrength {
    Hydro(Hydro),
    Elastic(Elastic),
    VonMises(VonMises),
    Tabulated(Tabulated),
    JohnsonCook(JohnsonCook),
    Voce(Voce),
    PowerLaw(Apart<Power>),
    ModifiedJohnsonCook(Apart<ModifiedCook>),
    ZerilliArmstrong(Apart<Dislocations>),
}

impl AnyStrength {
    /// That of a material, made ready. Gases have none.
    pub fn of(material: &Material) -> Self {
        match material.strength {
            _ if material.is_gas() => Self::Hydro(Hydro),
            Strength::Hydro => Self::Hydro(Hydro),
            Strength::Elastic { shear } => Self::Elastic(Elastic { shear }),
            Strength::VonMises { shear, yield_stress, hardening, rate } => {
                Self::VonMises(VonMises { shear, yield_stress, hardening, rate: RateFactor::of(rate) })
            }
            Strength::Tabulated { shear, hardening, rate } => {
                Self::Tabulated(Tabulated::new(shear, &hardening, RateFactor::of(rate)))
            }
            Strength::JohnsonCook { shear, a, b, n, c, m, t_melt, t_room, specific_heat, rate0, heat } => {
                let heating = 1.0 / (material.density * specific_heat);
                let [by_work, by_energy] = match heat {
                    Heat::PlasticWork => [heating, 0.0],
                    Heat::InternalEnergy => [0.0, heating],
                };
                Self::JohnsonCook(JohnsonCook {
                    shear,
                    a,
                    b,
                    n,
                    c,
                    m,
                    t_room,
                    inverse_range: 1.0 / (t_melt - t_room),
                    heating,
                    by_work,
                    by_energy,
                    inverse_rate0: 1.0 / rate0,
                })
            }
            Strength::Voce(law) => Self::Voce(law),
            Strength::PowerLaw(law) => Self::PowerLaw(Apart(Power::new(&law))),
            Strength::ModifiedJohnsonCook(law) => {
                Self::ModifiedJohnsonCook(Apart(ModifiedCook::new(&law, material.density)))
            }
            Strength::ZerilliArmstrong(law) => {
                Self::ZerilliArmstrong(Apart(Dislocations::new(&law, material.density)))
            }
            // Their elements have a kernel of their own, see [`AnyRemembering`]; others ask for the stiffness.
            Strength::JohnsonHolmquist(law) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::SteinbergGuinan(law) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::SegmentedCeramic(law) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::HolmquistJohnsonCook(law) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::RiedelHiermaierThoma(law) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::MooneyRivlin(law) => Self::Elastic(Elastic { shear: law.shear() }),
            Strength::Ogden(law) => Self::Elastic(Elastic { shear: law.shear() }),
            Strength::Viscoelastic(law) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::CrushableFoam(law, _) => Self::Elastic(Elastic { shear: law.shear() }),
            Strength::LowDensityFoam(law, _) => Self::Elastic(Elastic { shear: law.shear() }),
            Strength::SoilFoam(law, _) => Self::Elastic(Elastic { shear: law.shear }),
            Strength::Honeycomb(law, _) => Self::Elastic(Elastic { shear: law.shear() }),
            Strength::Orthotropic(law) => Self::Elastic(Elastic { shear: law.shear() }),
            Strength::ChangChang(law) => Self::Elastic(Elastic { shear: law.shear() }),
        }
    }
}

impl StrengthLaw for AnyStrength {
    #[inline(always)]
    fn deviatoric(&self) -> bool {
        of_any!(self, law => law.deviatoric())
    }

    #[inline(always)]
    fn plastic(&self) -> bool {
        of_any!(self, law => law.plastic())
    }

    #[inline(always)]
    fn thermal(&self) -> bool {
        of_any!(self, law => law.thermal())
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        of_any!(self, law => law.shear())
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        of_any!(self, law => law.flow(strain, factor))
    }

    #[inline(always)]
    fn least_flow<L: Lane>(&self, strain: L, temperature: L) -> L {
        of_any!(self, law => law.least_flow(strain, temperature))
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, temperature: L) -> L {
        of_any!(self, law => law.factor(rate, temperature))
    }

    #[inline(always)]
    fn heating(&self) -> f64 {
        of_any!(self, law => law.heating())
    }

    #[inline(always)]
    fn heating_by_energy(&self) -> f64 {
        of_any!(self, law => law.heating_by_energy())
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        of_any!(self, law => law.update(trial, strain, history, active))
    }
}
