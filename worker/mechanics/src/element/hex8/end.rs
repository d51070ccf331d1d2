//! Step 3 of a cycle: the geometry at the end of the step, with the one division that all its quotients share.

use crate::{
    element::{
        modes::{Gradient, Modes},
        viscosity::Spread,
    },
    lanes::Lane,
};

/// The geometry at the end of a step.
pub(super) struct End<L> {
    pub gradient: Gradient<L>,
    pub spread: Spread<L>,
    /// `sqrt(2/3 tr S)`.
    pub area: L,
    pub volume: L,
    /// That of the viscosity.
    pub length: L,
    /// `1 / (64 volume)`.
    pub inverse_by_64: L,
    /// `1 / initial volume`.
    pub inverse_initial: L,
    /// Exactly 1 as long as nothing moves.
    pub relative_volume: L,
}

impl<L: Lane> End<L> {
    #[inline(always)]
    pub fn of(x: &Modes<L>, initial_volume: L) -> Self {
        let one = L::splat(1.0);
        let gradient = Gradient::of(x);
        let spread =
            Spread::of([&gradient.a, &gradient.b, &gradient.c, &gradient.d, &gradient.e, &gradient.f]);
        let area_square = L::splat(2.0 / 3.0 / 512.0) * spread.trace();
        let area = area_square.sqrt();
        // One division inverts volume, initial volume and area: it is much slower than products.
        let starting = initial_volume * area_square;
        let inverse = one / (gradient.volume_times_64 * starting);
        let inverse_by_64 = inverse * starting;
        let inverse_others = inverse * gradient.volume_times_64;
        let inverse_initial = inverse_others * area_square;
        let volume = gradient.volume();
        let length = volume * (inverse_others * initial_volume * area);
        let relative_volume = (volume - initial_volume).mul_add(inverse_initial, one);
        Self { gradient, spread, area, volume, length, inverse_by_64, inverse_initial, relative_volume }
    }
}
