//! A law of which each kernel calls the update and does not hold it: long laws stand once for each width, see [`Lane::apart`].

use super::{Around, Deviator, History, Memory, Strain, StrengthLaw};
use crate::lanes::{self, Lane};

/// The law, called.
#[derive(Clone, Copy)]
pub(crate) struct Apart<S>(pub S);

struct Update<'a, L: Lane, S> {
    law: &'a S,
    trial: Deviator<L>,
    strain: Strain<L>,
    active: L::Mask,
    history: &'a mut History<L>,
    stress: &'a mut Deviator<L>,
}

impl<L: Lane, S: StrengthLaw> lanes::apart::Apart for Update<'_, L, S> {
    #[inline(always)]
    fn run(self) {
        *self.stress = self.law.update(self.trial, self.strain, self.history, self.active);
    }
}

struct Remember<'a, L: Lane, S> {
    law: &'a S,
    trial: Deviator<L>,
    around: Around<L>,
    active: L::Mask,
    history: &'a mut History<L>,
    memory: &'a mut Memory<L>,
    stress: &'a mut Deviator<L>,
}

impl<L: Lane, S: StrengthLaw> lanes::apart::Apart for Remember<'_, L, S> {
    #[inline(always)]
    fn run(self) {
        *self.stress = self.law.remember(self.trial, &self.around, self.history, self.memory, self.active);
    }
}

/// What a called function changes lies in memory for as long as it lives, so each call has copies of its own, and the kernel's stay in
/// registers.
impl<S: StrengthLaw> StrengthLaw for Apart<S> {
    const REMEMBERS: bool = S::REMEMBERS;

    #[inline(always)]
    fn deviatoric(&self) -> bool {
        self.0.deviatoric()
    }

    #[inline(always)]
    fn plastic(&self) -> bool {
        self.0.plastic()
    }

    #[inline(always)]
    fn thermal(&self) -> bool {
        self.0.thermal()
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.0.shear()
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        self.0.flow(strain, factor)
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, temperature: L) -> L {
        self.0.factor(rate, temperature)
    }

    #[inline(always)]
    fn heating(&self) -> f64 {
        self.0.heating()
    }

    #[inline(always)]
    fn heating_by_energy(&self) -> f64 {
        self.0.heating_by_energy()
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
        let (mut kept, mut remembered, mut stress) = (*history, *memory, trial);
        L::apart(Remember {
            law: &self.0,
            trial,
            around: *around,
            active,
            history: &mut kept,
            memory: &mut remembered,
            stress: &mut stress,
        });
        (*history, *memory) = (kept, remembered);
        stress
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (mut kept, mut stress) = (*history, trial);
        L::apart(Update { law: &self.0, trial, strain, active, history: &mut kept, stress: &mut stress });
        *history = kept;
        stress
    }
}
