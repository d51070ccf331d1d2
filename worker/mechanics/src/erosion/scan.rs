//! The pass that finds the elements of a block which erode: one look at each element that is alive, before its forces.
//!
//! It goes over lane sets like the element kernel, and lanes never mix: which elements erode depends on no lane width.

use std::ops::Range;

use crate::{
    element::{
        layout::Layout,
        modes::{Gradient, Modes, modes_of},
        place::corners,
        vector::{Tensor, Vector},
        viscosity::{Spread, frequency},
    },
    lanes::{Lane, SET, Width, dispatch::Task},
    strength::Deviator,
};

use super::limits::{Shape, Stress, Volume};

/// What the pass goes by. State arrays are by slot.
pub(super) struct Scan<'a> {
    pub layout: &'a Layout,
    pub x: [&'a [f64]; 3],
    pub v: [&'a [f64]; 3],
    /// Bits of the slots of each set whose elements are alive.
    pub alive: &'a [u8],
    /// State fields that are compared as they are: plastic strain, damage, temperature, each with its limit.
    pub fields: [Option<(&'a [f64], f64)>; 3],
    /// Deviatoric stress xx, yy, xy, yz, zx and pressure, and their limits.
    pub stress: Option<([&'a [f64]; 6], Stress)>,
    /// Volume over initial volume, and its limits.
    pub volume: Option<(&'a [f64], Volume)>,
    /// Inverse of the Jacobian at time zero by rows, and the limits of the instantaneous strain.
    pub shape: Option<(&'a [Vec<f64>; 9], Shape)>,
    /// Incremental strain and its limit.
    pub strain: Option<(&'a mut [f64], f64)>,
    /// Square of the sound speed, and the frequency above which an element erodes.
    pub step: Option<(f64, f64)>,
    /// The step that led to `x` (time).
    pub dt: f64,
}

/// The slots of the sets whose elements erode, ascending within each range.
///
/// # Panics
/// If the machine lacks the width or the arrays do not hold the sets.
pub(super) fn run(scan: &mut Scan<'_>, sets: &[Range<u32>], reach: usize, width: Width) -> Vec<u32> {
    let n_sets = scan.alive.len();
    let n_slots = n_sets * SET;
    assert!(sets.iter().all(|range| range.end as usize <= n_sets), "sets {sets:?} of a block of {n_sets}");
    assert!(scan.x.iter().chain(&scan.v).all(|a| a.len() >= reach), "node arrays shrunk below {reach}");
    assert!(
        scan.fields.iter().flatten().all(|(values, _)| values.len() >= n_slots),
        "state fields of {n_slots} slots"
    );
    assert!(
        scan.stress.is_none_or(|(fields, _)| fields.iter().all(|values| values.len() >= n_slots)),
        "stress of {n_slots} slots"
    );
    assert!(scan.volume.is_none_or(|(values, _)| values.len() >= n_slots), "volumes of {n_slots} slots");
    assert!(
        scan.shape.is_none_or(|(rows, _)| rows.iter().all(|row| row.len() >= n_slots)),
        "initial shapes of {n_slots} slots"
    );
    assert!(
        scan.strain.as_ref().is_none_or(|(values, _)| values.len() >= n_slots),
        "incremental strain of {n_slots} slots"
    );
    width.run(Pass { scan, sets })
}

/// A scan whose arrays have been checked.
struct Pass<'a, 's> {
    scan: &'a mut Scan<'s>,
    sets: &'a [Range<u32>],
}

impl Task for Pass<'_, '_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<L: Lane>(self) -> Vec<u32> {
        let mut found = Vec::new();
        // SAFETY: `run` above, which alone makes a pass, has checked sets and arrays, and every corner of every slot is below
        // the reach of the block, lanes behind it included.
        unsafe { all::<L>(self.scan, self.sets, &mut found) };
        found
    }
}

/// # Safety
/// Sets are below the number of sets of the block; state arrays hold all slots; corners of all slots, phantoms included,
/// are inside the node arrays with [`SET`] lanes behind them in a structured layout.
#[inline(always)]
unsafe fn all<L: Lane>(scan: &mut Scan<'_>, sets: &[Range<u32>], found: &mut Vec<u32>) {
    for range in sets {
        for set in range.clone() {
            let alive = scan.alive[set as usize];
            if alive == 0 {
                continue;
            }
            let mut lane = 0;
            while lane < SET {
                let slot = set as usize * SET + lane;
                let alive = L::mask(u32::from(alive) >> lane);
                // SAFETY: handed on from the caller.
                let mut bits = unsafe { slots::<L>(scan, slot, alive) };
                while bits != 0 {
                    found.push(slot as u32 + bits.trailing_zeros());
                    bits &= bits - 1;
                }
                lane += L::N;
            }
        }
    }
}

/// Bits of the slots `slot..slot + N` that erode.
///
/// # Safety
/// As [`all`].
#[inline(always)]
unsafe fn slots<L: Lane>(scan: &mut Scan<'_>, slot: usize, alive: L::Mask) -> u32 {
    let mut bits = 0;
    for (values, limit) in scan.fields.into_iter().flatten() {
        // SAFETY: the slot is inside the state arrays.
        bits |= L::bits(L::splat(limit).less_equal(unsafe { L::load(values, slot) }));
    }
    if let Some((fields, limits)) = &scan.stress {
        // SAFETY: as above.
        let [xx, yy, xy, yz, zx, pressure] = fields.map(|field| unsafe { L::load(field, slot) });
        bits |= limits.met(&Deviator { xx, yy, zz: -(xx + yy), xy, yz, zx }, pressure);
    }
    if let Some((relative, limits)) = &scan.volume {
        // SAFETY: as above.
        bits |= limits.met(unsafe { L::load(relative, slot) });
    }
    if scan.shape.is_none() && scan.strain.is_none() && scan.step.is_none() {
        return bits & L::bits(alive);
    }
    let zero = L::splat(0.0);
    // SAFETY: corners are inside the node arrays.
    let x = unsafe { modes(scan.layout, scan.x, slot) };
    let at_end = Gradient::of(&x);
    if scan.shape.is_some() || scan.strain.is_some() {
        // SAFETY: as above.
        let v = unsafe { modes(scan.layout, scan.v, slot) };
        let at_mid = Gradient::of(&Modes::before(&x, &v, L::splat(0.5 * scan.dt)));
        let upright = L::both(zero.less(at_mid.volume_times_64), zero.less(at_end.volume_times_64));
        bits |= !L::bits(upright);
        if let Some((strain, limit)) = &mut scan.strain {
            let rate = at_mid.against(&v).scaled(L::splat(1.0) / at_mid.volume_times_64);
            // SAFETY: the slot is inside the state arrays.
            unsafe {
                let before = L::load(strain, slot);
                let after = effective(&rate).mul_add(L::splat(scan.dt), before);
                L::select(L::both(alive, upright), after, before).store(strain, slot);
                bits |= L::bits(L::splat(*limit).less_equal(after));
            }
        }
    }
    if let Some((rows, limits)) = scan.shape {
        // SAFETY: as above.
        let row = |i: usize| unsafe {
            Vector {
                x: L::load(&rows[i], slot),
                y: L::load(&rows[i + 1], slot),
                z: L::load(&rows[i + 2], slot),
            }
        };
        let gradient = Tensor::outer(&x.a, &row(0)).outer_add(&x.b, &row(3)).outer_add(&x.c, &row(6));
        bits |= L::bits(limits.met(&gradient));
    }
    if let Some((sound_square, most)) = scan.step {
        let spread = Spread::of([&at_end.a, &at_end.b, &at_end.c, &at_end.d, &at_end.e, &at_end.f]);
        let volume = at_end.volume();
        let scale = L::splat(2.0 / 512.0) / (volume * volume);
        let (sound_square, most) = (L::splat(sound_square), L::splat(most));
        let bound = frequency(spread.eigenvalue_bound() * scale, zero, sound_square);
        if L::any(most.less(bound)) {
            bits |= L::bits(most.less(frequency(spread.largest_eigenvalue() * scale, zero, sound_square)));
        }
    }
    bits & L::bits(alive)
}

/// # Safety
/// As [`all`].
#[inline(always)]
unsafe fn modes<L: Lane>(layout: &Layout, from: [&[f64]; 3], slot: usize) -> Modes<L> {
    // SAFETY: the caller's promise.
    unsafe {
        Modes::of(
            modes_of(corners(layout, from[0], slot)),
            modes_of(corners(layout, from[1], slot)),
            modes_of(corners(layout, from[2], slot)),
        )
    }
}

/// `sqrt(2/3 D:D)` of the symmetric part D of a velocity gradient.
#[inline(always)]
fn effective<L: Lane>(gradient: &Tensor<L>) -> L {
    let (xy, yz, zx) =
        (gradient.x.y + gradient.y.x, gradient.y.z + gradient.z.y, gradient.z.x + gradient.x.z);
    let straight =
        gradient.x.x.mul_add(gradient.x.x, gradient.y.y.mul_add(gradient.y.y, gradient.z.z * gradient.z.z));
    let across = xy.mul_add(xy, yz.mul_add(yz, zx * zx));
    (L::splat(2.0 / 3.0) * L::splat(0.5).mul_add(across, straight)).sqrt()
}
