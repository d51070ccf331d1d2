//! Steps 2 and 9 of a cycle as far as laws of strength go: the deviatoric stress, and what a law keeps of an element.

use super::{BySlot, Laws, spin_of};
use crate::{
    element::{rotation::rotated, vector::Tensor},
    eos::EquationOfState,
    failure::FailureLaw,
    lanes::Lane,
    law::MAX_HISTORY,
    state::field,
    strength::{Around, Deviator, History, Memory, Strain, StrengthLaw},
};

impl BySlot<'_> {
    /// The history variables of the slots from `slot` on.
    #[inline(always)]
    fn memory<L: Lane>(&self, slot: usize) -> Memory<L> {
        let mut memory = Memory::none();
        let mut i = 0;
        while i < MAX_HISTORY && i < self.history.len() {
            // SAFETY: the kernel keeps slots inside the state arrays.
            memory.variables[i] = unsafe { L::load(&self.history[i], slot) };
            i += 1;
        }
        memory
    }

    /// Writes the history variables of the active lanes; the others keep theirs.
    #[inline(always)]
    pub(in crate::element) fn remember<L: Lane>(&mut self, slot: usize, memory: &Memory<L>, active: L::Mask) {
        let kept: Memory<L> = self.memory(slot);
        let mut i = 0;
        while i < MAX_HISTORY && i < self.history.len() {
            // SAFETY: the kernel keeps slots inside the state arrays.
            unsafe {
                L::select(active, memory.variables[i], kept.variables[i]).store(&mut self.history[i], slot);
            }
            i += 1;
        }
    }
}

/// The deviatoric stress of the end of a step and what came with it.
pub(in crate::element) struct Stressed<L: Lane> {
    pub stress: Deviator<L>,
    /// Its power per volume, with the mean of the stresses before and after.
    pub power: L,
    pub history: History<L>,
    pub plastic_before: L,
    pub strain: Strain<L>,
    /// Before the step.
    pub damage: L,
    /// Where that is 1.
    pub failed: L::Mask,
    /// What yield and failure leave of the trial stress, between 0 and 1; reckoned for elastic hourglass control only.
    pub left: L,
    /// Zeros of a law without history variables.
    pub memory: Memory<L>,
}

impl<L: Lane> Stressed<L> {
    /// Rotation, elastic increment, yield. `size` is relative volume and length at the end of the step, for a law that remembers.
    #[inline(always)]
    pub fn of<E: EquationOfState, S: StrengthLaw, F: FailureLaw>(
        gradient: &Tensor<L>,
        view: &BySlot<'_>,
        slot: usize,
        laws: &Laws<E, S, F>,
        dt: f64,
        alive: L::Mask,
        size: [L; 2],
    ) -> Self {
        let (zero, one, half) = (L::splat(0.0), L::splat(1.0), L::splat(0.5));
        let damage: L =
            if laws.failure.fails() || S::REMEMBERS { view.state(slot, field::DAMAGE) } else { zero };
        let mut memory = Memory::none();
        let failed = one.less_equal(damage);
        let mut history = History { plastic_strain: zero, temperature: zero };
        let mut strain = Strain { rate: zero, increment: zero };
        let mut plastic_before = zero;
        let mut stress = Deviator::zero();
        let mut power = zero;
        let mut left = one;
        if laws.strength.deviatoric() {
            let third = (gradient.x.x + gradient.y.y + gradient.z.z) * L::splat(1.0 / 3.0);
            let rate = Deviator {
                xx: gradient.x.x - third,
                yy: gradient.y.y - third,
                zz: gradient.z.z - third,
                xy: half * (gradient.x.y + gradient.y.x),
                yz: half * (gradient.y.z + gradient.z.y),
                zx: half * (gradient.z.x + gradient.x.z),
            };
            let spin = spin_of(gradient, L::splat(0.5 * dt));
            let (xx, yy): (L, L) = (view.state(slot, field::SXX), view.state(slot, field::SYY));
            let before = Deviator {
                xx,
                yy,
                zz: -(xx + yy),
                xy: view.state(slot, field::SXY),
                yz: view.state(slot, field::SYZ),
                zx: view.state(slot, field::SZX),
            };
            // Half of the increment turns with the stress, half does not: second order in the spin.
            let half_increment = L::splat(laws.strength.shear() * dt);
            let turned = rotated(&rate.mul_add(half_increment, &before), &spin);
            let mut trial = rate.mul_add(half_increment, &turned);
            if laws.failure.fails() {
                trial = trial.scaled(L::select(failed, zero, one));
            }
            if laws.strength.plastic() {
                history.plastic_strain = view.state(slot, field::PLASTIC_STRAIN);
                plastic_before = history.plastic_strain;
            }
            if laws.strength.thermal() {
                history.temperature = view.state(slot, field::TEMPERATURE);
            }
            let rate_square = rate.contract(&rate);
            let effective = (L::splat(2.0 / 3.0) * rate_square).sqrt();
            strain = Strain { rate: effective, increment: effective * L::splat(dt) };
            if S::REMEMBERS {
                memory = view.memory(slot);
                memory.damage = damage;
                let [relative_volume, length] = size;
                let energy = view.state(slot, field::ENERGY);
                let line = laws.eos.line_about(relative_volume, one, energy);
                let around = Around {
                    pressure: line.pressure(energy),
                    pressure_before: view.state(slot, field::PRESSURE),
                    energy,
                    density: L::splat(laws.density) / relative_volume,
                    relative_volume,
                    relative_volume_before: view.state(slot, field::RELATIVE_VOLUME),
                    gradient: *gradient,
                    spin,
                    rate,
                    volume_rate: third * L::splat(3.0),
                    strain,
                    length,
                    dt: L::splat(dt),
                };
                stress = laws.strength.remember(trial, &around, &mut history, &mut memory, alive);
            } else {
                stress = laws.strength.update(trial, strain, &mut history, alive);
            }
            // The mean of both ends is the stress of the middle, as the rate is, whose axes have not turned: to second order the work of the
            // forces. With the stress before turned to the end a body that spins would seem to gain energy.
            power = half * before.plus(&stress).contract(&rate);
            if laws.elastic_control() {
                left = L::select(failed, zero, one);
                let yields = plastic_before.less(history.plastic_strain);
                if L::any(yields) {
                    let share =
                        stress.contract(&trial) / trial.contract(&trial).max(L::splat(f64::MIN_POSITIVE));
                    left = L::select(yields, share.max(zero).min(left), left);
                }
            }
        }
        Self { stress, power, history, plastic_before, strain, damage, failed, left, memory }
    }
}
