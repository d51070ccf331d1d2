//! A porous solid: the compaction of its equation of state, and the strength of its skeleton, one of the laws without history variables.

use super::{AnyStrength, Around, Deviator, History, Memory, StrengthLaw};
use crate::{
    eos::porous::{Pores, Porous},
    lanes::Lane,
    law::{Unit, Variable},
    material::Material,
};

/// What is kept of an element beside what its strength keeps.
pub(crate) const HISTORY: &[Variable] = &[Variable { name: "crushed_pores", unit: Unit::NONE, initial: 0.0 }];

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct PorousSolid {
    pores: Pores,
    tension: f64,
    skeleton: AnyStrength,
}

impl PorousSolid {
    /// That of a material with this equation of state.
    pub fn new(law: &Porous, material: &Material) -> Self {
        Self {
            pores: Pores::new(law, material.density),
            tension: law.tension,
            skeleton: AnyStrength::of(material),
        }
    }
}

impl StrengthLaw for PorousSolid {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        self.skeleton.plastic()
    }

    #[inline(always)]
    fn thermal(&self) -> bool {
        self.skeleton.thermal()
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.skeleton.shear()
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
        let Around { relative_volume, relative_volume_before, pressure_before, energy, .. } = *around;
        // The energy of the end as far as the pressure before the step changes it.
        let energy = pressure_before.neg_mul_add(relative_volume - relative_volume_before, energy);
        let compacted = self.pores.compacted(relative_volume, energy, memory.variables[0], pressure_before);
        memory.variables[0] = compacted.share;
        memory.stretch = self.pores.stretch(compacted.distension);
        memory.distension = compacted.distension;
        memory.least_pressure = L::splat(-self.tension);
        if !self.skeleton.deviatoric() {
            return Deviator::zero();
        }
        self.skeleton.update(trial, around.strain, history, active)
    }
}
