//! The laws with history variables, or that see pressure and energy ([`StrengthLaw::remember`]). They have a kernel of their own, so that the
//! other one does not become slower, and it calls all of them as one function ([`super::apart`]).

use super::{
    Around, Deviator, History, Memory, MooneyRivlin, Ogden, Strength, StrengthLaw, Viscoelastic,
    crushable_foam::Crushable, holmquist_johnson_cook::Concrete, honeycomb::Cells,
    johnson_holmquist::Ceramic, low_density_foam::LowDensity, orthotropic::Laminate, porous::PorousSolid,
    riedel_hiermaier_thoma, segmented_ceramic::Segmented, soil_foam::Soil, steinberg_guinan::Metal,
};
use crate::{
    lanes::Lane,
    material::{Eos, Material},
};

/// Any of them, chosen by the material: the choice is one branch for a lane set, the same for the whole block.
#[expect(clippy::large_enum_variant, reason = "one for a block; its curves stand in place")]
#[derive(Clone, Copy)]
pub(crate) enum AnyRemembering {
    JohnsonHolmquist(Ceramic),
    MooneyRivlin(MooneyRivlin),
    Ogden(Ogden),
    Viscoelastic(Viscoelastic),
    CrushableFoam(Crushable),
    LowDensityFoam(LowDensity),
    SoilFoam(Soil),
    Porous(PorousSolid),
    HolmquistJohnsonCook(Concrete),
    RiedelHiermaierThoma(riedel_hiermaier_thoma::Concrete),
    SteinbergGuinan(Metal),
    SegmentedCeramic(Segmented),
    Orthotropic(Laminate),
    Honeycomb(Cells),
}

/// The laws by their names: the one list that calls go by.
macro_rules! of_any {
    ($any:expr, $law:ident => $call:expr) => {
        match $any {
            AnyRemembering::JohnsonHolmquist($law) => $call,
            AnyRemembering::MooneyRivlin($law) => $call,
            AnyRemembering::Ogden($law) => $call,
            AnyRemembering::Viscoelastic($law) => $call,
            AnyRemembering::CrushableFoam($law) => $call,
            AnyRemembering::LowDensityFoam($law) => $call,
            AnyRemembering::SoilFoam($law) => $call,
            AnyRemembering::Porous($law) => $call,
            AnyRemembering::HolmquistJohnsonCook($law) => $call,
            AnyRemembering::RiedelHiermaierThoma($law) => $call,
            AnyRemembering::SteinbergGuinan($law) => $call,
            AnyRemembering::SegmentedCeramic($law) => $call,
            AnyRemembering::Orthotropic($law) => $call,
            AnyRemembering::Honeycomb($law) => $call,
        }
    };
}

impl AnyRemembering {
    /// That of a material, made ready; none if its law has no history variables.
    pub fn of(material: &Material) -> Option<Self> {
        match &material.eos {
            Eos::Porous(law) => Some(Self::Porous(PorousSolid::new(law, material))),
            _ if material.is_gas() => None,
            _ => Self::of_strength(material),
        }
    }

    /// That of a strength law, whatever the equation of state beside it.
    pub fn of_strength(material: &Material) -> Option<Self> {
        match material.strength {
            Strength::JohnsonHolmquist(law) => {
                Some(Self::JohnsonHolmquist(Ceramic::new(&law, material.bulk())))
            }
            Strength::MooneyRivlin(law) => Some(Self::MooneyRivlin(law)),
            Strength::Ogden(law) => Some(Self::Ogden(law)),
            Strength::Viscoelastic(law) => Some(Self::Viscoelastic(law)),
            Strength::CrushableFoam(law, curve) => Some(Self::CrushableFoam(Crushable::new(&law, &curve))),
            Strength::LowDensityFoam(law, curve) => Some(Self::LowDensityFoam(LowDensity::new(&law, &curve))),
            Strength::SoilFoam(law, curve) => Some(Self::SoilFoam(Soil::new(&law, &curve))),
            Strength::HolmquistJohnsonCook(law) => Some(Self::HolmquistJohnsonCook(Concrete::new(&law))),
            Strength::RiedelHiermaierThoma(law) => {
                Some(Self::RiedelHiermaierThoma(riedel_hiermaier_thoma::Concrete::new(&law)))
            }
            Strength::SteinbergGuinan(law) => Some(Self::SteinbergGuinan(Metal::new(&law, material.density))),
            Strength::SegmentedCeramic(law) => {
                Some(Self::SegmentedCeramic(Segmented::new(&law, material.bulk())))
            }
            Strength::Orthotropic(law) => Some(Self::Orthotropic(Laminate::new(&law))),
            Strength::Honeycomb(law, curve) => Some(Self::Honeycomb(Cells::new(&law, &curve))),
            _ => None,
        }
    }
}

impl StrengthLaw for AnyRemembering {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        of_any!(self, law => law.plastic())
    }

    #[inline(always)]
    fn thermal(&self) -> bool {
        of_any!(self, law => law.thermal())
    }

    #[inline(always)]
    fn heating_by_energy(&self) -> f64 {
        of_any!(self, law => law.heating_by_energy())
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        of_any!(self, law => law.shear())
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        history: &mut History<L>,
        memory: &mut Memory<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        of_any!(self, law => law.remember(trial, around, history, memory, active))
    }
}
