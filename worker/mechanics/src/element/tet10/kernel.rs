//! One cycle of a lane set of composite tetrahedra, from gather to scatter: a lane holds an element, and its points are computed one after
//! the other. Energy, pressure and viscosity of the element are the steps of the hexahedron of one point.

use super::{
    LEAST_SHARE, NODES, POINTS, SHARES, SHOWN, SWELLING,
    geometry::{Shape, no_tensor},
};
use crate::{
    element::{
        ElementVote, Step,
        hex8::{
            BySlot, Laws, Tally,
            compression::{Change, Compressed},
            offer_faults,
            stress::Stressed,
        },
        place::Nodal,
        vector::{Tensor, Vector},
    },
    eos::{AnyEos, EquationOfState},
    exact::{EXACT, rounded},
    failure::{FailureLaw, Loading},
    lanes::{Lane, SET},
    state::field,
    strength::{Deviator, History, Memory, Strain, StrengthLaw},
};

/// The arrays that a set is computed from. Arrays of points are by point, then as those of elements.
pub(super) struct Arrays<'a> {
    pub elements: BySlot<'a>,
    pub points: [BySlot<'a>; POINTS],
    /// Stress of the points by their own rate of volume.
    pub swelling: [&'a mut [f64]; POINTS],
}

/// The state of a point at the end of a step.
#[derive(Clone, Copy)]
struct Point<L: Lane> {
    stress: Deviator<L>,
    swelling: L,
    history: History<L>,
    plastic_before: L,
    strain: Strain<L>,
    damage: L,
    failed: L::Mask,
    memory: Memory<L>,
    /// Rate of deformation less that of the element.
    apart: Deviator<L>,
    /// Rate of volume less that of the element.
    swells: L,
}

/// Positions and velocities of the nodes of some lanes.
///
/// # Safety
/// The nodes are inside the arrays.
#[inline(always)]
unsafe fn gathered<L: Lane>(of: &[&[f64]; 3], list: &[[u32; SET]; NODES], lane: usize) -> [Vector<L>; NODES] {
    let zero = L::splat(0.0);
    let mut all = [Vector { x: zero, y: zero, z: zero }; NODES];
    let mut node = 0;
    while node < NODES {
        let at = &list[node];
        // SAFETY: the caller's promise.
        all[node] = unsafe {
            Vector {
                x: L::gather(of[0], at, lane),
                y: L::gather(of[1], at, lane),
                z: L::gather(of[2], at, lane),
            }
        };
        node += 1;
    }
    all
}

/// Elements of the slots `slot..slot + N`: forces into the node arrays, new state, votes.
///
/// # Safety
/// The nodes of `list` are inside the node arrays, the slots inside the arrays by slot.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "one level of the kernel")]
pub(super) unsafe fn slots<L: Lane, S: StrengthLaw, F: FailureLaw>(
    list: &[[u32; SET]; NODES],
    nodes: &mut Nodal<'_>,
    arrays: &mut Arrays<'_>,
    laws: &Laws<AnyEos, S, F>,
    step: &Step,
    slot: usize,
    tally: &mut Tally<L>,
    vote: &mut ElementVote,
) {
    let (zero, one, half, third) = (L::splat(0.0), L::splat(1.0), L::splat(0.5), L::splat(1.0 / 3.0));
    let lane = slot % SET;
    // SAFETY: the caller's promise.
    let (x, v, initial_volume, alive) = unsafe {
        (
            gathered::<L>(&nodes.x, list, lane),
            gathered::<L>(&nodes.v, list, lane),
            L::load(arrays.elements.initial_volume, slot),
            L::mask(u32::from(*arrays.elements.alive.get_unchecked(slot / SET)) >> lane),
        )
    };

    // 1. Velocity gradients on the geometry of the middle of the step.
    let mut mid = x;
    let mut node = 0;
    while node < NODES {
        mid[node] = v[node].neg_mul_add(L::splat(0.5 * step.dt), &x[node]);
        node += 1;
    }
    let at_mid = Shape::of(&mid);
    let rates = at_mid.against(&v);
    let points_at_mid = at_mid.of_points();
    let volume_at_mid = at_mid.six_volumes();
    let whole = rates.whole.scaled(one / volume_at_mid);
    let volume_rate = whole.x.x + whole.y.y + whole.z.z;

    // 2. Geometry at the end of the step.
    let end = Shape::of(&x);
    let points_at_end = end.of_points();
    let six_volumes = end.six_volumes();
    let by_nodes = end.volume_gradient();
    let (mut gradient_square, mut breathing) = (zero, zero);
    let mut node = 0;
    while node < NODES {
        let square = by_nodes[node].dot(&by_nodes[node]);
        gradient_square = gradient_square + square;
        breathing = square.mul_add(L::splat(1.0 / SHARES[node]), breathing);
        node += 1;
    }
    let inverse = one / six_volumes;
    let inverse_volume = inverse * L::splat(6.0);
    let length = six_volumes / (L::splat(2.0 / 3.0) * gradient_square).sqrt();
    let volume = end.volume();
    let inverse_initial = one / initial_volume;
    let relative_volume = (volume - initial_volume).mul_add(inverse_initial, one);

    // 3. Stress of the points. A law sees the rate of volume of the element.
    let nothing = Point {
        stress: Deviator::zero(),
        swelling: zero,
        history: History { plastic_strain: zero, temperature: zero },
        plastic_before: zero,
        strain: Strain { rate: zero, increment: zero },
        damage: zero,
        failed: L::mask(0),
        memory: Memory::none(),
        apart: Deviator::zero(),
        swells: zero,
    };
    let mut points = [nothing; POINTS];
    let mut power = zero;
    let mut failed = L::mask(u32::MAX);
    let mut upright = L::both(zero.less(volume_at_mid), zero.less(six_volumes));
    let mut temperature = zero;
    let mut memory = Memory { distension: zero, stretch: zero, ..Memory::none() };
    let mut check = zero;
    let mut g = 0;
    while g < POINTS {
        let gradient = rates.points[g].scaled(one / points_at_mid[g]);
        let swells = gradient.x.x + gradient.y.y + gradient.z.z - volume_rate;
        let own = -(swells * third);
        let gradient = Tensor {
            x: Vector { x: gradient.x.x + own, ..gradient.x },
            y: Vector { y: gradient.y.y + own, ..gradient.y },
            z: Vector { z: gradient.z.z + own, ..gradient.z },
        };
        upright = L::both(upright, L::both(zero.less(points_at_mid[g]), zero.less(points_at_end[g])));
        if S::REMEMBERS {
            let mut shown = 0;
            while shown < SHOWN.len() {
                let value = arrays.elements.state::<L>(slot, SHOWN[shown]);
                arrays.points[g].set_state(slot, SHOWN[shown], value, alive);
                shown += 1;
            }
        }
        let size = [relative_volume, length];
        let stressed =
            Stressed::of::<AnyEos, S, F>(&gradient, &arrays.points[g], slot, laws, step.dt, alive, size);
        // SAFETY: the slot is inside the arrays.
        let before = unsafe { L::load(arrays.swelling[g], slot) };
        let grown = L::splat(2.0 / 3.0 * laws.strength.shear() * step.dt).mul_add(swells, before);
        let squeezed = points_at_end[g].less(L::splat(LEAST_SHARE * 0.25) * six_volumes);
        let swelling = grown * L::select(squeezed, one, stressed.left);
        let of_point = (half * (before + swelling)).mul_add(swells, stressed.power);
        power = of_point.mul_add(points_at_mid[g], power);
        failed = L::both(failed, stressed.failed);
        temperature = L::splat(0.25).mul_add(stressed.history.temperature, temperature);
        check = check + stressed.stress.sum() + swelling;
        if S::REMEMBERS {
            let quarter = L::splat(0.25);
            let of_point = &stressed.memory;
            memory.added_pressure = quarter.mul_add(of_point.added_pressure, memory.added_pressure);
            memory.least_pressure = quarter.mul_add(of_point.least_pressure, memory.least_pressure);
            memory.distension = quarter.mul_add(of_point.distension, memory.distension);
            memory.stretch = quarter.mul_add(of_point.stretch, memory.stretch);
            memory.idle_stiffness = quarter.mul_add(of_point.idle_stiffness, memory.idle_stiffness);
            memory.added_stiffness = memory.added_stiffness.max(of_point.added_stiffness);
        }
        points[g] = Point {
            stress: stressed.stress,
            swelling,
            history: stressed.history,
            plastic_before: stressed.plastic_before,
            strain: stressed.strain,
            damage: stressed.damage,
            failed: stressed.failed,
            memory: stressed.memory,
            apart: Deviator {
                xx: gradient.x.x - whole.x.x,
                yy: gradient.y.y - whole.y.y,
                zz: gradient.z.z - whole.z.z,
                xy: half * (gradient.x.y + gradient.y.x - whole.x.y - whole.y.x),
                yz: half * (gradient.y.z + gradient.z.y - whole.y.z - whole.z.y),
                zx: half * (gradient.z.x + gradient.x.z - whole.z.x - whole.x.z),
            },
            swells,
        };
        g += 1;
    }

    // 4. Pressure, viscosity and energy of the element.
    let change = Change {
        initial_volume,
        inverse_volume,
        relative_volume,
        length,
        volume_rate,
        deviatoric_power: power / volume_at_mid,
        middle: volume_at_mid * L::splat(1.0 / 6.0) * inverse_initial,
        failed,
        temperature,
    };
    let compressed = Compressed::of::<AnyEos, S, F>(&change, &arrays.elements, slot, laws, step, &memory);
    let Compressed { volume_change, sound_square, sound, density, damping, viscosity, .. } = compressed;
    let Compressed { heating, energy, pressure, burn, stiffness, .. } = compressed;
    let by_energy = laws.strength.heating_by_energy() != 0.0;
    let fails = laws.failure.fails() || S::REMEMBERS;

    // 5. Damage of the points, and the friction of those that have failed, which hold nothing but the volume of the element.
    let friction = L::splat(2.0 * laws.hourglass.failed) * density * sound * length;
    let mut stresses = [no_tensor(); POINTS];
    let mut mean_swelling = zero;
    let mut g = 0;
    while g < POINTS {
        mean_swelling = points[g].swelling.mul_add(points_at_end[g], mean_swelling);
        g += 1;
    }
    mean_swelling = mean_swelling * inverse;
    let (mut taken, mut rubs) = (zero, zero);
    let mut g = 0;
    while g < POINTS {
        let point = &mut points[g];
        let mut stress = point.stress;
        let mut swelling = point.swelling - mean_swelling;
        if fails {
            let loading = Loading {
                stress: point.stress,
                pressure,
                strain: point.strain,
                plastic_strain: [point.plastic_before, point.history.plastic_strain],
                temperature: point.history.temperature,
            };
            point.damage =
                if S::REMEMBERS { point.memory.damage } else { laws.failure.damage(point.damage, &loading) };
            let coefficient = L::select(point.failed, friction, zero);
            rubs = rubs.max(coefficient);
            stress = point.apart.mul_add(coefficient, &stress);
            let swells = coefficient * third * point.swells;
            swelling = swelling + swells;
            let work = point.apart.contract(&point.apart).mul_add(coefficient, swells * point.swells);
            taken = (work * points_at_mid[g]).mul_add(L::splat(step.dt / 6.0), taken);
        }
        let hydrostatic = swelling - (pressure + viscosity);
        stresses[g] = Tensor {
            x: Vector { x: stress.xx + hydrostatic, y: stress.xy, z: stress.zx },
            y: Vector { x: stress.xy, y: stress.yy + hydrostatic, z: stress.yz },
            z: Vector { x: stress.zx, y: stress.yz, z: stress.zz + hydrostatic },
        };
        g += 1;
    }

    // 6. Which elements count.
    let check = check + energy + pressure + viscosity + taken;
    let finite = check.abs().less_equal(L::splat(f64::MAX));
    let active = L::both(alive, L::both(upright, finite));
    if L::bits(active) != L::bits(alive) {
        let volumes = (volume_at_mid * L::splat(1.0 / 6.0)).min(volume).to_array();
        let bad = L::bits(alive) & !L::bits(active);
        offer_faults(&volumes, bad, &arrays.elements.elements[slot..], vote);
    }

    // 7. The step. Of all motions of the nodes of an element, those that change its volume are no faster than `K a` and the rest than
    //    `2 G b` (over the density), so their sum bounds the frequency; the viscosity damps the first at the rate `a damping`.
    let trace = breathing * inverse * inverse;
    let narrowest = end.narrowest(&points_at_end, inverse);
    let shear_square = L::splat(laws.strength.shear() / laws.density) * relative_volume;
    let sound_square = if laws.eos.burns() { sound_square.max(burn.pace_square) } else { sound_square };
    let bulk_square = L::splat(4.0 / 3.0).neg_mul_add(shear_square, sound_square).max(zero);
    let added = if S::REMEMBERS { memory.added_stiffness / stiffness * sound_square } else { zero };
    let square = bulk_square.mul_add(trace, (shear_square + shear_square + added) * narrowest);
    let rate = damping.mul_add(trace, rubs / density * narrowest) * L::splat(1.0 / 8.0);
    let frequency = rate + rate.mul_add(rate, L::splat(0.25) * square).sqrt();
    let limits = (one / frequency).to_array();
    let mut bits = L::bits(active);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        vote.offer_courant(limits[lane], arrays.elements.elements[slot + lane]);
        bits &= bits - 1;
    }

    // 8. Votes and energies.
    let magic = L::splat(step.energy_quantum.magic());
    let counted = |value: L| rounded(L::select(active, value, zero), magic);
    tally.internal = tally.internal + counted(energy * initial_volume);
    tally.hourglass = tally.hourglass + counted(taken);
    tally.viscosity = tally.viscosity + counted(-(heating * volume_change * initial_volume));
    tally.largest_rate = tally.largest_rate.max(L::select(active, volume_rate.abs(), zero));

    // 9. State.
    let elements = &mut arrays.elements;
    elements.set_state(slot, field::VISCOSITY, viscosity, active);
    if step.dt != 0.0 {
        let quarter = L::splat(0.25);
        let mut mean = [zero; 8];
        let mut remembered = Memory::none();
        let mut g = 0;
        while g < POINTS {
            let point = &points[g];
            let temperature = if by_energy { compressed.temperature } else { point.history.temperature };
            let values = [
                point.stress.xx,
                point.stress.yy,
                point.stress.xy,
                point.stress.yz,
                point.stress.zx,
                point.history.plastic_strain,
                temperature,
                point.damage,
            ];
            let mut k = 0;
            while k < SWELLING {
                arrays.points[g].set_state(slot, super::OF_POINT[k], values[k], active);
                mean[k] = quarter.mul_add(values[k], mean[k]);
                k += 1;
            }
            // SAFETY: the slot is inside the arrays.
            unsafe {
                let kept = L::load(arrays.swelling[g], slot);
                L::select(active, point.swelling, kept).store(arrays.swelling[g], slot);
            }
            if S::REMEMBERS {
                arrays.points[g].remember(slot, &point.memory, active);
                let mut i = 0;
                while i < point.memory.variables.len() {
                    remembered.variables[i] =
                        quarter.mul_add(point.memory.variables[i], remembered.variables[i]);
                    i += 1;
                }
            }
            g += 1;
        }
        let mut k = 0;
        while k < SWELLING {
            elements.set_state(slot, super::OF_POINT[k], mean[k], active);
            k += 1;
        }
        if S::REMEMBERS {
            elements.remember(slot, &remembered, active);
        }
        if laws.eos.burns() {
            elements.set_state(slot, field::TIME_TO_LIGHT, burn.time_to_light, active);
        }
        elements.set_state(slot, field::PRESSURE, pressure, active);
        elements.set_state(slot, field::ENERGY, energy, active);
        elements.set_state(slot, field::RELATIVE_VOLUME, relative_volume, active);
    }

    // 10. Forces on the nodes: minus the stress on the gradients.
    let forces = end.forces(&stresses);
    let magic = L::splat(step.force_quantum.magic());
    let mut axis = 0;
    while axis < 3 {
        let terms = balanced(&forces, axis, active, magic, &mut tally.largest_force);
        let mut node = 0;
        while node < NODES {
            let terms = terms[node].to_array();
            let mut of_lane = 0;
            while of_lane < L::N {
                // Of two lanes with the same node each adds its own. Every value is a multiple of the quantum, so no order can show.
                // SAFETY: the caller's promise.
                unsafe {
                    *nodes.f[axis].get_unchecked_mut(list[node][lane + of_lane] as usize) += terms[of_lane];
                }
                of_lane += 1;
            }
            node += 1;
        }
        axis += 1;
    }
}

/// One component of the forces of active elements as it is added: those on nine nodes are rounded, the tenth takes what they leave, so
/// that the forces of an element add to exactly zero. The largest magnitude before that is kept.
#[inline(always)]
fn balanced<L: Lane>(
    forces: &[Vector<L>; NODES],
    axis: usize,
    active: L::Mask,
    magic: L,
    largest: &mut L,
) -> [L; NODES] {
    let zero = L::splat(0.0);
    let (mut terms, mut sum) = ([zero; NODES], zero);
    let mut node = 0;
    while node < NODES {
        let force = &forces[node];
        let component = if axis == 0 {
            force.x
        } else if axis == 1 {
            force.y
        } else {
            force.z
        };
        let force = L::select(active, component * L::splat(-1.0 / 6.0), zero);
        if EXACT {
            *largest = largest.max_magnitude(force);
        }
        terms[node] = rounded(force, magic);
        if node + 1 < NODES {
            sum = sum + terms[node];
        }
        node += 1;
    }
    if EXACT {
        terms[NODES - 1] = -sum;
    }
    terms
}
