//! Steps 4 to 6 of a cycle: what the change of volume does to energy, pressure and viscosity of an element.

use super::{BySlot, Laws, Step};
use crate::{
    eos::{Burn, EquationOfState},
    failure::FailureLaw,
    lanes::Lane,
    state::field,
    strength::{Memory, StrengthLaw},
};

/// How an element changes in a step.
pub(in crate::element) struct Change<L: Lane> {
    pub initial_volume: L,
    /// At the end of the step, as are the next two.
    pub inverse_volume: L,
    pub relative_volume: L,
    /// That of the viscosity.
    pub length: L,
    /// Trace of the velocity gradient.
    pub volume_rate: L,
    /// Power of the deviatoric stress per volume, and the volume on which it works, that of the middle of the step, over the initial one.
    pub deviatoric_power: L,
    pub middle: L,
    /// Where the element had failed before the step.
    pub failed: L::Mask,
    /// Temperature by plastic work.
    pub temperature: L,
}

/// What the change of volume leaves.
pub(in crate::element) struct Compressed<L> {
    pub volume_change: L,
    /// `K + 4G/3`.
    pub stiffness: L,
    pub sound_square: L,
    pub sound: L,
    pub density: L,
    /// Viscosity over density (length^2 / time).
    pub damping: L,
    pub viscosity: L,
    /// Mean of the viscosities before and after.
    pub heating: L,
    pub energy: L,
    pub pressure: L,
    pub temperature: L,
    pub burn: Burn<L>,
}

impl<L: Lane> Compressed<L> {
    #[inline(always)]
    pub fn of<E: EquationOfState, S: StrengthLaw, F: FailureLaw>(
        change: &Change<L>,
        view: &BySlot<'_>,
        slot: usize,
        laws: &Laws<E, S, F>,
        step: &Step,
        memory: &Memory<L>,
    ) -> Self {
        let (zero, one, half) = (L::splat(0.0), L::splat(1.0), L::splat(0.5));
        let dt = L::splat(step.dt);
        let Change { initial_volume, relative_volume, length, volume_rate, .. } = *change;

        // 4. Pressure line at the new volume and the sound speed there.
        let (pressure_before, energy_before, volume_before): (L, L, L) = (
            view.state(slot, field::PRESSURE),
            view.state(slot, field::ENERGY),
            view.state(slot, field::RELATIVE_VOLUME),
        );
        let volume_change = L::select(zero.less(dt), relative_volume - volume_before, zero);
        let energy_before = (change.deviatoric_power * dt).mul_add(change.middle, energy_before);
        let mut burn = Burn { time_to_light: zero, burnt: one, pace_square: zero };
        if laws.eos.burns() {
            let left = view.state::<L>(slot, field::TIME_TO_LIGHT) - dt;
            burn = laws.eos.burn(left, relative_volume, initial_volume);
        }
        let energy = pressure_before.neg_mul_add(volume_change, energy_before);
        let mut line = if S::REMEMBERS {
            let line = laws.eos.line_about(relative_volume * memory.stretch, burn.burnt, energy);
            line.of_porous(memory.distension, memory.stretch)
        } else {
            laws.eos.line_about(relative_volume, burn.burnt, energy)
        };
        if S::REMEMBERS {
            line.a = line.a + memory.added_pressure;
        }
        let bulk = line
            .stiffness(relative_volume, line.pressure(energy), energy)
            .max(laws.eos.least_stiffness(burn.burnt));
        let mut stiffness = bulk + L::splat(4.0 / 3.0 * laws.strength.shear());
        if S::REMEMBERS {
            stiffness = stiffness + memory.added_stiffness;
        }
        let sound_square = stiffness * relative_volume * L::splat(1.0 / laws.density);
        let mut sound = sound_square.sqrt();
        if S::REMEMBERS {
            let met = (stiffness - memory.idle_stiffness).max(zero) / stiffness;
            sound = sound * met.sqrt();
        }

        // 5. Artificial viscosity in compression.
        let density = L::splat(laws.density) * (initial_volume * change.inverse_volume);
        let closing = L::select(volume_rate.less(zero), -volume_rate, zero);
        let quadratic = L::splat(step.quadratic_viscosity * step.quadratic_viscosity);
        let linear = L::splat(step.linear_viscosity);
        let damping = (quadratic * length).mul_add(closing, linear * sound) * length;
        let viscosity = density * damping * closing;
        // The forces at both ends of a step do work in it, so its heat is that of their mean.
        let heating = half * (view.state::<L>(slot, field::VISCOSITY) + viscosity);

        // 6. Energy and pressure together.
        let mut energy = line.energy_after(energy_before, pressure_before, heating, volume_change);
        let mut pressure = line.pressure(energy);
        if laws.failure.fails() || S::REMEMBERS {
            let mut least = L::select(change.failed, zero, L::splat(laws.failure.least_pressure()));
            if S::REMEMBERS {
                least = memory.least_pressure;
            }
            let cut = pressure.less(least);
            let resistance = half.mul_add(pressure_before + least, heating);
            energy = L::select(cut, resistance.neg_mul_add(volume_change, energy_before), energy);
            pressure = L::select(cut, least, pressure);
        }
        let mut temperature = change.temperature;
        let by_energy = laws.strength.heating_by_energy();
        if E::IS_CHOSEN && by_energy != 0.0 {
            // The temperature before says how far the energy was above the cold curve, which is followed to the new volume.
            let heat = view.state::<L>(slot, field::TEMPERATURE) * L::splat(1.0 / by_energy);
            let cold_before = view.state::<L>(slot, field::ENERGY) - heat;
            let line_before = laws.eos.line(volume_before, burn.burnt);
            let pressure_before = line_before.pressure(cold_before);
            let chord = line.energy_after(cold_before, pressure_before, zero, volume_change);
            // A shock crosses an element in a few steps: the curve bends between the ends of the chord, by the slopes there.
            let slope_before =
                line_before.stiffness(volume_before, pressure_before, cold_before) / volume_before;
            let slope = line.stiffness(relative_volume, line.pressure(chord), chord) / relative_volume;
            let bend = volume_change * volume_change * (slope - slope_before);
            let cold = L::splat(1.0 / 12.0).neg_mul_add(bend, chord);
            temperature = (energy - cold) * L::splat(by_energy);
        }
        Self {
            volume_change,
            stiffness,
            sound_square,
            sound,
            density,
            damping,
            viscosity,
            heating,
            energy,
            pressure,
            temperature,
            burn,
        }
    }
}
