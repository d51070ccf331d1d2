//! The eight-node hexahedron with one integration point: one cycle of a lane set, from gather to scatter.
//!
//! The geometry is that of `modes`; the steps of a cycle are numbered in `slots`, in the order of their
//! dependence. `volume` and `volume_gradient` give single elements the same numbers.

use std::ops::Range;

pub(super) mod compression;
pub mod eight_points;
mod end;
pub(crate) mod group;
pub(super) mod leaving;
mod pass;
pub(crate) mod points;
pub(super) mod stress;
mod view;
mod volumes;

use super::{
    ElementVote, Fault, Step,
    hourglass::{
        Amplitudes, Frame, LEAST_STRAIN, OF_SUMS, PLASTIC, Resistance, amplitude, bounded, growth,
        stress_square,
    },
    layout::{Corners, Layout},
    modes::{Gradient, Modes, corner_values, modes_of},
    place::{Bases, Nodal, PACKED, Packed, Place, Rows},
    rotation::rotation,
    vector::{Tensor, Vector},
    viscosity::{Spread, Swing},
};
use crate::{
    eos::EquationOfState,
    exact::{EXACT, rounded},
    failure::{FailureLaw, Loading},
    lanes::{Lane, SET, scalar::Scalar},
    state::field,
    strength::{Deviator, History, Memory, StrengthLaw},
};
use compression::{Change, Compressed};
use end::End;
use stress::Stressed;
pub(super) use view::BySlot;
use view::View;
pub use volumes::volume;
pub(crate) use volumes::volumes;

/// Derivative of the volume by each corner coordinate.
pub fn volume_gradient(corners: &[[f64; 3]; 8]) -> [[f64; 3]; 8] {
    let g = Gradient::of(&scalar_modes(corners));
    let zero = Scalar(0.0);
    let axis = |a, b, c, d, e, f| corner_values([a, b, c, d, e, f, zero]);
    let x = axis(g.a.x, g.b.x, g.c.x, g.d.x, g.e.x, g.f.x);
    let y = axis(g.a.y, g.b.y, g.c.y, g.d.y, g.e.y, g.f.y);
    let z = axis(g.a.z, g.b.z, g.c.z, g.d.z, g.e.z, g.f.z);
    std::array::from_fn(|corner| [x[corner].0, y[corner].0, z[corner].0].map(|c| c / 64.0))
}

fn scalar_modes(corners: &[[f64; 3]; 8]) -> Modes<Scalar> {
    let axis = |axis: usize| modes_of(std::array::from_fn(|corner| Scalar(corners[corner][axis])));
    Modes::of(axis(0), axis(1), axis(2))
}

/// A material made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Laws<E, S, F> {
    pub density: f64,
    pub eos: E,
    pub strength: S,
    pub failure: F,
    pub hourglass: Resistance,
}

impl<E: EquationOfState, S, F> Laws<E, S, F> {
    /// Whether elements keep forces of hourglass control. Kernels that know their laws are for viscous control.
    #[inline(always)]
    fn elastic_control(&self) -> bool {
        E::IS_CHOSEN && self.hourglass.elastic
    }
}

/// Running sums and extremes by lane. Sums are exact and extremes order-free, so lanes join in any way.
pub(super) struct Tally<L> {
    pub internal: L,
    pub hourglass: L,
    pub viscosity: L,
    pub largest_force: L,
    pub largest_rate: L,
    /// Greatest frequency of an element so far, whose inverse is the least Courant limit.
    frequency: f64,
}

impl<L: Lane> Tally<L> {
    #[inline(always)]
    pub fn new(vote: &ElementVote) -> Self {
        let zero = L::splat(0.0);
        Self {
            internal: zero,
            hourglass: zero,
            viscosity: zero,
            largest_force: zero,
            largest_rate: zero,
            frequency: 1.0 / vote.courant,
        }
    }

    #[inline(always)]
    pub fn join(&self, vote: &mut ElementVote) {
        for lane in 0..L::N {
            vote.internal += self.internal.to_array()[lane];
            vote.hourglass += self.hourglass.to_array()[lane];
            vote.viscosity += self.viscosity.to_array()[lane];
            vote.force_bound = vote.force_bound.max(self.largest_force.to_array()[lane]);
            vote.volume_limit = vote.volume_limit.min(0.1 / self.largest_rate.to_array()[lane]);
        }
    }

    /// The frequency that an element must exceed to change the vote. An element of higher index than that of the vote
    /// is not chosen among equals; one of lower index is, also when only the inverses are equal.
    #[inline(always)]
    fn frequency_to_beat(&self, lowest: u32, vote: &ElementVote) -> f64 {
        if lowest > vote.courant_element { self.frequency } else { self.frequency * (1.0 - 1e-15) }
    }
}

/// Elements of the sets in one cycle: forces into `view.f`, new state, votes.
///
/// # Safety
/// Sets are below the number of sets of the block, and every corner of every slot, phantoms included, is
/// inside the node arrays with [`SET`] lanes behind it in a structured layout.
#[inline(always)]
unsafe fn compute<L: Lane, E: EquationOfState, S: StrengthLaw, F: FailureLaw>(
    view: &mut View<'_>,
    laws: &Laws<E, S, F>,
    step: &Step,
    sets: &[Range<u32>],
    vote: &mut ElementVote,
) {
    let View { layout, nodes, slots, .. } = view;
    let mut tally = Tally::<L>::new(vote);
    // A loop for each layout: what one needs in memory the other keeps in registers.
    // SAFETY: the caller's promise; what is packed holds whole sets.
    unsafe {
        match layout {
            Layout::Structured { row, plane, base } => {
                let place = Rows { row: *row, plane: *plane, base };
                for range in sets {
                    for set in range.start..range.end {
                        of_set::<L, _, E, S, F>(place, nodes, slots, laws, step, set, &mut tally, vote);
                    }
                }
            }
            Layout::Explicit { sets: places, lists } => {
                let mut packed = Packed::new();
                for range in sets {
                    for set in range.start..range.end {
                        // One kernel for both, which knows only whence it loads: a choice at each load would cost it its registers.
                        let place = *places.get_unchecked(set as usize);
                        let (place, mut arrays, list) = match place {
                            Corners::Run(along, first) => {
                                (Bases { first, along: Some(along) }, nodes.reborrow(), None)
                            }
                            Corners::List(list) => {
                                let list = lists.get_unchecked(list as usize);
                                packed.gather::<L>(nodes, list);
                                (PACKED, packed.nodal(), Some(list))
                            }
                        };
                        of_set::<L, _, E, S, F>(place, &mut arrays, slots, laws, step, set, &mut tally, vote);
                        if let Some(list) = list {
                            packed.scatter(nodes, list);
                        }
                    }
                }
            }
        }
    }
    tally.join(vote);
}

/// The slots of a set.
///
/// # Safety
/// As [`compute`].
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "one level of the kernel")]
unsafe fn of_set<L: Lane, P: Place, E: EquationOfState, S: StrengthLaw, F: FailureLaw>(
    place: P,
    nodes: &mut Nodal<'_>,
    view: &mut BySlot<'_>,
    laws: &Laws<E, S, F>,
    step: &Step,
    set: u32,
    tally: &mut Tally<L>,
    vote: &mut ElementVote,
) {
    let mut lane = 0;
    while lane < SET {
        let slot = set as usize * SET + lane;
        // SAFETY: handed on from the caller.
        unsafe { slots::<L, P, E, S, F>(place, nodes, view, laws, step, slot, tally, vote) };
        lane += L::N;
    }
}

/// The slots `slot..slot + N`.
///
/// # Safety
/// As [`compute`].
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "one level of the kernel")]
unsafe fn slots<L: Lane, P: Place, E: EquationOfState, S: StrengthLaw, F: FailureLaw>(
    place: P,
    nodes: &mut Nodal<'_>,
    view: &mut BySlot<'_>,
    laws: &Laws<E, S, F>,
    step: &Step,
    slot: usize,
    tally: &mut Tally<L>,
    vote: &mut ElementVote,
) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let elastic_control = laws.elastic_control();
    for axis in 0..3 {
        for array in [nodes.x[axis], nodes.v[axis], &*nodes.f[axis]] {
            place.fetch_ahead(array, slot);
        }
    }
    // SAFETY: slots are inside the state arrays, corners inside the node arrays.
    let (x, v, initial_volume, alive) = unsafe {
        (
            Modes::of(
                modes_of(place.corners(nodes.x[0], slot)),
                modes_of(place.corners(nodes.x[1], slot)),
                modes_of(place.corners(nodes.x[2], slot)),
            ),
            Modes::of(
                modes_of(place.corners(nodes.v[0], slot)),
                modes_of(place.corners(nodes.v[1], slot)),
                modes_of(place.corners(nodes.v[2], slot)),
            ),
            L::load(view.initial_volume, slot),
            L::mask(u32::from(*view.alive.get_unchecked(slot / SET)) >> (slot % SET)),
        )
    };

    // 1. Velocity gradient on the geometry of the middle of the step, and what of the velocity it leaves.
    let mid = Modes::before(&x, &v, L::splat(0.5 * step.dt));
    let at_mid = Gradient::of(&mid);
    let gradient = at_mid.against(&v).scaled(one / at_mid.volume_times_64);
    let hourglass = Amplitudes {
        d: amplitude(&v.d, &gradient, &mid.d),
        e: amplitude(&v.e, &gradient, &mid.e),
        f: amplitude(&v.f, &gradient, &mid.f),
        g: amplitude(&v.g, &gradient, &mid.g),
    };
    let volume_rate = gradient.x.x + gradient.y.y + gradient.z.z;

    // 2. Deviatoric stress, and 3. the geometry at the end of the step. With laws that are known the stress comes first: the
    //    geometry then fills its long chain of roots and quotients. Laws that are chosen here stand between branches, which nothing
    //    fills, and what they leave in registers is less than what the geometry needs.
    //    A law with history variables sees the volume, too.
    let (stressed, end);
    if E::IS_CHOSEN || S::REMEMBERS {
        end = End::of(&x, initial_volume);
        let size = [end.relative_volume, end.length];
        stressed = Stressed::of::<E, S, F>(&gradient, view, slot, laws, step.dt, alive, size);
    } else {
        stressed = Stressed::of::<E, S, F>(&gradient, view, slot, laws, step.dt, alive, [one; 2]);
        end = End::of(&x, initial_volume);
    }
    let Stressed {
        stress,
        power: deviatoric_power,
        history,
        plastic_before,
        strain,
        damage,
        failed,
        left,
        memory,
    } = stressed;
    let End {
        gradient: at_end,
        spread,
        area,
        volume,
        length,
        inverse_by_64,
        inverse_initial,
        relative_volume,
    } = end;
    let inverse_volume = inverse_by_64 * L::splat(64.0);

    // 4. Pressure line at the new volume, 5. viscosity, 6. energy and pressure together.
    let change = Change {
        initial_volume,
        inverse_volume,
        relative_volume,
        length,
        volume_rate,
        deviatoric_power,
        middle: at_mid.volume() * inverse_initial,
        failed,
        temperature: history.temperature,
    };
    let compressed = Compressed::of::<E, S, F>(&change, view, slot, laws, step, &memory);
    let Compressed { volume_change, stiffness, sound_square, sound, density, damping, .. } = compressed;
    let Compressed { viscosity, heating, energy, pressure, burn, .. } = compressed;
    let mut damage_after = damage;
    if laws.failure.fails() || S::REMEMBERS {
        let plastic_strain = [plastic_before, history.plastic_strain];
        let loading = Loading { stress, pressure, strain, plastic_strain, temperature: history.temperature };
        damage_after = if S::REMEMBERS { memory.damage } else { laws.failure.damage(damage, &loading) };
    }

    // 7. Hourglass forces: turned, grown, and yielding as the stress does. What they keep is written here, so that nothing of it
    //    stays in registers.
    let modes_square = hourglass.square();
    let mut check = energy + pressure + viscosity + modes_square + stress.sum();
    let mut coefficient = L::splat(2.0 * laws.hourglass.viscous);
    if laws.failure.fails() || S::REMEMBERS {
        let failed = one.less_equal(damage_after);
        coefficient = L::select(failed, L::splat(2.0 * laws.hourglass.failed), coefficient);
    }
    let coefficient = bounded(coefficient, [&x.d, &x.e, &x.f, &x.g], &spread, inverse_volume, OF_SUMS);
    let mut resist = coefficient * density * sound * area;
    let mut taken = L::splat(step.dt / 8.0) * resist * modes_square;
    let mut resisted = hourglass;
    if elastic_control {
        let spin = spin_of(&gradient, L::splat(0.5 * step.dt));
        let before = view.hourglass::<L>(slot);
        let turned = before.turned(&rotation(&spin));
        let frame = Frame {
            axes: [&mid.a, &mid.b, &mid.c],
            volume: at_mid.volume(),
            stiffness: stiffness * area * area * inverse_volume,
        };
        let trial = growth(&laws.hourglass, &hourglass, &frame, step.dt);
        let mut elastic = trial.mul_add(one, &turned).scaled(left);
        let bent = stress_square(&elastic, &frame);
        let may_yield = L::splat(laws.hourglass.sound).less(bent);
        if L::any(may_yield) {
            let factor = laws.strength.factor(strain.rate, history.temperature);
            let (yield_stress, _) =
                laws.strength.flow(history.plastic_strain.max(L::splat(LEAST_STRAIN)), factor);
            let most = L::splat(PLASTIC) * yield_stress;
            // Whether a lane yields is its own matter, whatever the others of its set do.
            let yields = L::both(may_yield, (most * most).less(bent));
            let share = L::select(yields, most / bent.sqrt(), one);
            elastic = elastic.scaled(share);
        }
        let power = elastic.mul_add(one, &before).dot(&hourglass);
        let damped = L::splat(step.dt / 8.0) * resist * modes_square;
        taken = L::splat(0.5 * step.dt).mul_add(power, damped);
        check = check + elastic.square();
        // Which lanes are active is not known yet: an element with a fault ends the run before its state is used.
        if step.dt != 0.0 {
            view.set_hourglass(slot, elastic, alive);
        }
        resisted = hourglass.mul_add(resist * L::splat(1.0 / 8.0), &elastic);
        resist = L::splat(8.0);
    }

    // 8. Which elements count.
    let upright = L::both(zero.less(at_mid.volume_times_64), zero.less(at_end.volume_times_64));
    let finite = check.abs().less_equal(L::splat(f64::MAX));
    let active = L::both(alive, L::both(upright, finite));
    if L::bits(active) != L::bits(alive) {
        let volumes = at_mid.volume().min(volume).to_array();
        offer_faults(&volumes, L::bits(alive) & !L::bits(active), &view.elements[slot..], vote);
    }

    // 9. Votes and energies.
    let double_inverse_square = L::splat(2.0 / 512.0) * inverse_volume * inverse_volume;
    let shear_square = L::splat(laws.strength.shear() / laws.density) * relative_volume;
    // The burn crosses elements faster than sound, and the step follows it.
    let sound_square = if laws.eos.burns() { sound_square.max(burn.pace_square) } else { sound_square };
    let swing = Swing { damping, sound_square, shear_square, trace: spread.trace() * double_inverse_square };
    offer_limit(&swing, &spread, double_inverse_square, active, (view, slot), tally, vote);
    let energy_magic = L::splat(step.energy_quantum.magic());
    let internal = energy * initial_volume;
    let squeezed = -(heating * volume_change * initial_volume);
    tally.internal = tally.internal + L::select(active, rounded(internal, energy_magic), zero);
    tally.hourglass = tally.hourglass + L::select(active, rounded(taken, energy_magic), zero);
    tally.viscosity = tally.viscosity + L::select(active, rounded(squeezed, energy_magic), zero);
    tally.largest_rate = tally.largest_rate.max(L::select(active, volume_rate.abs(), zero));

    // 10. State. Forces act from the first cycle on, so their viscosity is kept from there.
    let kept = Kept {
        stress,
        history,
        damage: damage_after,
        compressed: &compressed,
        relative_volume,
        memory: &memory,
    };
    kept.write(view, slot, laws, step, active);

    // 11. Corner forces: minus the stress, with the correction of hourglass control, on the volume gradient.
    //     The factor 1/64 takes back what the gradient is too large by.
    let squeeze = (pressure + viscosity) * L::splat(1.0 / 64.0);
    let stress = stress.scaled(L::splat(1.0 / 64.0));
    let resist = resist * L::splat(1.0 / 8.0);
    let bent = resisted.against(&x.d, &x.e, &x.f, &x.g).scaled(resist * inverse_by_64);
    let rows = [
        Vector { x: bent.x.x - (stress.xx - squeeze), y: bent.x.y - stress.xy, z: bent.x.z - stress.zx },
        Vector { x: bent.y.x - stress.xy, y: bent.y.y - (stress.yy - squeeze), z: bent.y.z - stress.yz },
        Vector { x: bent.z.x - stress.zx, y: bent.z.y - stress.yz, z: bent.z.z - (stress.zz - squeeze) },
    ];
    let Amplitudes { d, e, f, g } = resisted;
    let amplitudes = [[d.x, e.x, f.x, g.x], [d.y, e.y, f.y, g.y], [d.z, e.z, f.z, g.z]];
    let magic = L::splat(step.force_quantum.magic());
    let mut axis = 0;
    while axis < 3 {
        let forces = at_end.forces(&rows[axis], resist, amplitudes[axis]);
        let forces = balanced(forces, active, magic, &mut tally.largest_force);
        // SAFETY: corners are inside the node arrays.
        unsafe { place.scatter(nodes.f[axis], slot, forces) };
        axis += 1;
    }
}

/// What an element is in at the end of a step.
pub(super) struct Kept<'a, L: Lane> {
    pub stress: Deviator<L>,
    pub history: History<L>,
    pub damage: L,
    pub compressed: &'a Compressed<L>,
    pub relative_volume: L,
    pub memory: &'a Memory<L>,
}

impl<L: Lane> Kept<'_, L> {
    /// Writes it for the active lanes. A step of no time changes the viscosity alone.
    #[inline(always)]
    pub fn write<E: EquationOfState, S: StrengthLaw, F: FailureLaw>(
        &self,
        view: &mut BySlot<'_>,
        slot: usize,
        laws: &Laws<E, S, F>,
        step: &Step,
        active: L::Mask,
    ) {
        let Self { stress, history, compressed, .. } = self;
        view.set_state(slot, field::VISCOSITY, compressed.viscosity, active);
        if step.dt == 0.0 {
            return;
        }
        if laws.strength.deviatoric() {
            view.set_state(slot, field::SXX, stress.xx, active);
            view.set_state(slot, field::SYY, stress.yy, active);
            view.set_state(slot, field::SXY, stress.xy, active);
            view.set_state(slot, field::SYZ, stress.yz, active);
            view.set_state(slot, field::SZX, stress.zx, active);
        }
        if laws.strength.plastic() {
            view.set_state(slot, field::PLASTIC_STRAIN, history.plastic_strain, active);
        }
        if laws.strength.thermal() {
            view.set_state(slot, field::TEMPERATURE, compressed.temperature, active);
        }
        if laws.failure.fails() || S::REMEMBERS {
            view.set_state(slot, field::DAMAGE, self.damage, active);
        }
        if S::REMEMBERS {
            view.remember(slot, self.memory, active);
        }
        if laws.eos.burns() {
            view.set_state(slot, field::TIME_TO_LIGHT, compressed.burn.time_to_light, active);
        }
        view.set_state(slot, field::PRESSURE, compressed.pressure, active);
        view.set_state(slot, field::ENERGY, compressed.energy, active);
        view.set_state(slot, field::RELATIVE_VOLUME, self.relative_volume, active);
    }
}

/// Offers the limits of the step of active lanes, where one may be the least of all. `spread` times `double_inverse_square` is `2 S / V^2`.
#[inline(always)]
pub(super) fn offer_limit<L: Lane>(
    swing: &Swing<L>,
    spread: &Spread<L>,
    double_inverse_square: L,
    active: L::Mask,
    (view, slot): (&BySlot<'_>, usize),
    tally: &mut Tally<L>,
    vote: &mut ElementVote,
) {
    let to_beat = tally.frequency_to_beat(view.lowest[slot / SET], vote);
    let largest = spread.eigenvalue_bound() * double_inverse_square;
    if L::any(L::both(swing.may_exceed(to_beat, largest), active))
        && L::any(L::both(L::splat(to_beat).less(swing.frequency(largest)), active))
    {
        let exact = swing.frequency(spread.largest_eigenvalue() * double_inverse_square);
        let (frequencies, limits) = (exact.to_array(), (L::splat(1.0) / exact).to_array());
        for lane in 0..L::N {
            if L::bits(active) >> lane & 1 == 1 {
                vote.offer_courant(limits[lane], view.elements[slot + lane]);
                tally.frequency = tally.frequency.max(frequencies[lane]);
            }
        }
    }
}

/// Votes against the lanes of `bad`, whose elements are turned inside out or hold numbers that are none.
#[cold]
#[inline(never)]
pub(super) fn offer_faults(volumes: &[f64; SET], bad: u32, elements: &[u32], vote: &mut ElementVote) {
    for (lane, (&volume, &element)) in volumes.iter().zip(elements).enumerate() {
        if bad >> lane & 1 == 1 {
            vote.offer_fault(Fault { element, volume });
        }
    }
}

/// The axial vector of the spin of a step, from the velocity gradient and half of the step.
#[inline(always)]
pub(super) fn spin_of<L: Lane>(gradient: &Tensor<L>, half_dt: L) -> Vector<L> {
    Vector {
        x: half_dt * (gradient.z.y - gradient.y.z),
        y: half_dt * (gradient.x.z - gradient.z.x),
        z: half_dt * (gradient.y.x - gradient.x.y),
    }
}

/// One component of the corner forces of active elements as it is added: seven corners are rounded, the eighth takes
/// what they leave, so that the forces of an element add to exactly zero. The largest magnitude before that is kept.
#[inline(always)]
pub(super) fn balanced<L: Lane>(forces: [L; 8], active: L::Mask, magic: L, largest: &mut L) -> [L; 8] {
    let zero = L::splat(0.0);
    let mut terms = [zero; 8];
    let mut corner = 0;
    while corner < 8 {
        let force = L::select(active, forces[corner], zero);
        if EXACT {
            *largest = largest.max_magnitude(force);
        }
        terms[corner] = rounded(force, magic);
        corner += 1;
    }
    if EXACT {
        let [a, b, c, d, e, f, g, _] = terms;
        terms[7] = -(((a + b) + (c + d)) + ((e + f) + g));
    }
    terms
}
