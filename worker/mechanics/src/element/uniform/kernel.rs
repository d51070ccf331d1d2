//! One cycle of a lane set, from gather to scatter. The steps are those of the hexahedron ([`hex8`](crate::element::hex8)), with the geometry and
//! the modes of a [`Form`].

use super::{
    MODES, MOST,
    form::{ByMode, ByNode, Form, dot, none},
    shape::Shape,
};
use crate::{
    element::{
        ElementVote, Step,
        hex8::{
            BySlot, Kept, Laws, Tally, balanced,
            compression::{Change, Compressed},
            offer_faults, offer_limit, spin_of,
            stress::Stressed,
        },
        hourglass::{Amplitudes, LEAST_STRAIN, PLASTIC, bounded},
        place::{Nodal, PACKED, Place},
        rotation::rotation,
        vector::{Tensor, Vector},
        viscosity::Swing,
    },
    eos::{AnyEos, EquationOfState},
    exact::rounded,
    failure::{FailureLaw, Loading},
    lanes::{Lane, SET},
    strength::StrengthLaw,
};

/// Values of packed node arrays at the nodes of some lanes.
#[inline(always)]
fn gathered<L: Lane>(form: &Form, of: &[&[f64]; 3], lane: usize) -> ByNode<L> {
    let mut all = [none(); MOST];
    let mut node = 0;
    while node < form.n_nodes {
        let at = form.corner[node] * SET + lane;
        // SAFETY: packed arrays hold eight corners of a set.
        all[node] = unsafe { Vector { x: L::load(of[0], at), y: L::load(of[1], at), z: L::load(of[2], at) } };
        node += 1;
    }
    all
}

/// `forces[0], forces[1]` as the first vectors that hourglass control keeps of an element, and back.
#[inline(always)]
fn as_kept<L: Lane>(forces: &ByMode<L>) -> Amplitudes<L> {
    Amplitudes { d: forces[0], e: forces[1], f: none(), g: none() }
}

#[inline(always)]
pub(super) fn of_kept<L: Lane>(kept: &Amplitudes<L>) -> ByMode<L> {
    [kept.d, kept.e]
}

/// Elements of the slots `slot..slot + N`, whose nodes are packed: forces into the packed arrays, new state, votes.
///
/// # Safety
/// The slots are inside the arrays by slot, and the node arrays are packed ones.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "one level of the kernel")]
pub(super) unsafe fn slots<L: Lane, S: StrengthLaw, F: FailureLaw>(
    form: &Form,
    nodes: &mut Nodal<'_>,
    view: &mut BySlot<'_>,
    laws: &Laws<AnyEos, S, F>,
    step: &Step,
    slot: usize,
    tally: &mut Tally<L>,
    vote: &mut ElementVote,
) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let lane = slot % SET;
    let (x, v) = (gathered::<L>(form, &nodes.x, lane), gathered::<L>(form, &nodes.v, lane));
    // SAFETY: the caller's promise.
    let (initial_volume, alive) = unsafe {
        (
            L::load(view.initial_volume, slot),
            L::mask(u32::from(*view.alive.get_unchecked(slot / SET)) >> lane),
        )
    };

    // 1. Velocity gradient on the geometry of the middle of the step, and what of the velocity it leaves.
    let mut mid = x;
    let mut node = 0;
    while node < form.n_nodes {
        mid[node] = v[node].neg_mul_add(L::splat(0.5 * step.dt), &x[node]);
        node += 1;
    }
    let at_mid = Shape::of(form, &mid);
    let gradient = at_mid.against(&v).scaled(one / at_mid.volume);
    let volume_rate = gradient.x.x + gradient.y.y + gradient.z.z;
    let (of_v, of_x) = (form.along(&v), form.along(&mid));
    let mut amplitudes = [none(); MODES];
    let mut mode = 0;
    while mode < form.n_modes {
        let linear = gradient.apply(&of_x[mode]);
        amplitudes[mode] = linear.neg_mul_add(one, &of_v[mode]);
        mode += 1;
    }

    // 2. The geometry at the end of the step, and 3. deviatoric stress.
    let at_end = Shape::of(form, &x);
    let spread = at_end.spread(form);
    let area = (L::splat(2.0 / 3.0) * spread.trace()).sqrt();
    let volume = at_end.volume;
    let inverse_volume = one / volume;
    let length = volume / area;
    let inverse_initial = one / initial_volume;
    let relative_volume = (volume - initial_volume).mul_add(inverse_initial, one);
    let size = [relative_volume, length];
    let stressed = Stressed::of::<AnyEos, S, F>(&gradient, view, slot, laws, step.dt, alive, size);
    let Stressed { stress, history, plastic_before, strain, failed, left, memory, .. } = stressed;

    // 4. Pressure line at the new volume, 5. viscosity, 6. energy and pressure together.
    let change = Change {
        initial_volume,
        inverse_volume,
        relative_volume,
        length,
        volume_rate,
        deviatoric_power: stressed.power,
        middle: at_mid.volume * inverse_initial,
        failed,
        temperature: history.temperature,
    };
    let compressed = Compressed::of::<AnyEos, S, F>(&change, view, slot, laws, step, &memory);
    let Compressed { stiffness, sound_square, sound, density, viscosity, energy, pressure, .. } = compressed;
    let mut damage = stressed.damage;
    if laws.failure.fails() || S::REMEMBERS {
        let plastic_strain = [plastic_before, history.plastic_strain];
        let loading = Loading { stress, pressure, strain, plastic_strain, temperature: history.temperature };
        damage = if S::REMEMBERS { memory.damage } else { laws.failure.damage(damage, &loading) };
    }

    // 7. Hourglass forces: turned, grown, and yielding as the stress does. A mode moves what a node carries, where one of a hexahedron
    //    moves the whole element.
    let modes_square = dot(&amplitudes, &amplitudes);
    let mut coefficient = L::splat(2.0 * laws.hourglass.viscous);
    if laws.failure.fails() || S::REMEMBERS {
        let failed = one.less_equal(damage);
        coefficient = L::select(failed, L::splat(2.0 * laws.hourglass.failed), coefficient);
    }
    let by_mass = L::splat(8.0 / form.n_nodes as f64);
    let modes = form.along(&x);
    let coefficient = bounded(coefficient, [&modes[0], &modes[1]], &spread, inverse_volume, 1.0);
    let resist = by_mass * coefficient * density * sound * area;
    let mut taken = L::splat(step.dt) * resist * modes_square;
    let mut check = energy + pressure + viscosity + modes_square + stress.sum();
    let mut forces = [amplitudes[0].scaled(resist), amplitudes[1].scaled(resist)];
    if form.n_modes > 0 && laws.hourglass.elastic {
        let spin = spin_of(&gradient, L::splat(0.5 * step.dt));
        let before = view.hourglass::<L>(slot);
        let turned = of_kept(&before.turned(&rotation(&spin)));
        let before = of_kept(&before);
        let grown = if laws.hourglass.assumes_strain {
            let rate = form.assumed(&laws.hourglass, &mid, at_mid.volume, &amplitudes);
            [rate[0].scaled(L::splat(step.dt)), rate[1].scaled(L::splat(step.dt))]
        } else {
            let of_modes = L::splat(0.5 * laws.hourglass.stiffness * step.dt) * by_mass;
            let factor = of_modes * stiffness * area * area * inverse_volume;
            [amplitudes[0].scaled(factor), amplitudes[1].scaled(factor)]
        };
        let mut elastic =
            [grown[0].mul_add(one, &turned[0]).scaled(left), grown[1].mul_add(one, &turned[1]).scaled(left)];
        let bent = form.stress_square(&mid, at_mid.volume, &elastic);
        let may_yield = L::splat(laws.hourglass.sound).less(bent);
        if L::any(may_yield) {
            let factor = laws.strength.factor(strain.rate, history.temperature);
            let (yield_stress, _) =
                laws.strength.flow(history.plastic_strain.max(L::splat(LEAST_STRAIN)), factor);
            let most = L::splat(PLASTIC) * yield_stress;
            let yields = L::both(may_yield, (most * most).less(bent));
            let share = L::select(yields, most / bent.sqrt(), one);
            elastic = [elastic[0].scaled(share), elastic[1].scaled(share)];
        }
        let both = [elastic[0].mul_add(one, &before[0]), elastic[1].mul_add(one, &before[1])];
        taken = L::splat(0.5 * step.dt).mul_add(dot(&both, &amplitudes), taken);
        check = check + dot(&elastic, &elastic);
        // Which lanes are active is not known yet: an element with a fault ends the run before its state is used.
        if step.dt != 0.0 {
            view.set_hourglass(slot, as_kept(&elastic), alive);
        }
        forces = [forces[0].mul_add(one, &elastic[0]), forces[1].mul_add(one, &elastic[1])];
    }

    // 8. Which elements count.
    let upright = L::both(zero.less(at_mid.volume), zero.less(volume));
    let finite = check.abs().less_equal(L::splat(f64::MAX));
    let active = L::both(alive, L::both(upright, finite));
    if L::bits(active) != L::bits(alive) {
        let volumes = at_mid.volume.min(volume).to_array();
        offer_faults(&volumes, L::bits(alive) & !L::bits(active), &view.elements[slot..], vote);
    }

    // 9. Votes and energies.
    let double_inverse_square = L::splat(2.0) * inverse_volume * inverse_volume;
    let shear_square = L::splat(laws.strength.shear() / laws.density) * relative_volume;
    let pace_square = compressed.burn.pace_square;
    let sound_square = if laws.eos.burns() { sound_square.max(pace_square) } else { sound_square };
    let trace = spread.trace() * double_inverse_square;
    let swing = Swing { damping: compressed.damping, sound_square, shear_square, trace };
    offer_limit(&swing, &spread, double_inverse_square, active, (view, slot), tally, vote);
    let magic = L::splat(step.energy_quantum.magic());
    let counted = |value: L| rounded(L::select(active, value, zero), magic);
    let squeezed = -(compressed.heating * compressed.volume_change * initial_volume);
    tally.internal = tally.internal + counted(energy * initial_volume);
    tally.hourglass = tally.hourglass + counted(taken);
    tally.viscosity = tally.viscosity + counted(squeezed);
    tally.largest_rate = tally.largest_rate.max(L::select(active, volume_rate.abs(), zero));

    // 10. State.
    let kept = Kept { stress, history, damage, compressed: &compressed, relative_volume, memory: &memory };
    kept.write(view, slot, laws, step, active);

    // 11. Forces of the nodes: minus the stress, with the correction of hourglass control, on the volume gradient.
    let squeeze = pressure + viscosity;
    let mut rows = Tensor {
        x: Vector { x: squeeze - stress.xx, y: -stress.xy, z: -stress.zx },
        y: Vector { x: -stress.xy, y: squeeze - stress.yy, z: -stress.yz },
        z: Vector { x: -stress.zx, y: -stress.yz, z: squeeze - stress.zz },
    };
    let at = form.along(&x);
    let mut mode = 0;
    while mode < form.n_modes {
        rows = rows.outer_add(&forces[mode].scaled(inverse_volume), &at[mode]);
        mode += 1;
    }
    let mut by_corner = [[zero; 8]; 3];
    let mut node = 0;
    while node < form.n_nodes {
        let mut force = rows.apply(&at_end.gradient[node]);
        let mut mode = 0;
        while mode < form.n_modes {
            force = forces[mode].neg_mul_add(L::splat(form.patterns[mode][node]), &force);
            mode += 1;
        }
        // The last corner takes what rounding leaves, so a node stands there.
        let place = if node + 1 == form.n_nodes { 7 } else { node };
        (by_corner[0][place], by_corner[1][place], by_corner[2][place]) = (force.x, force.y, force.z);
        node += 1;
    }
    let magic = L::splat(step.force_quantum.magic());
    let mut axis = 0;
    while axis < 3 {
        let terms = balanced(by_corner[axis], active, magic, &mut tally.largest_force);
        let mut of_corner = [zero; 8];
        let mut node = 0;
        while node < form.n_nodes {
            of_corner[form.corner[node]] = terms[if node + 1 == form.n_nodes { 7 } else { node }];
            node += 1;
        }
        // SAFETY: packed arrays hold eight corners of a set.
        unsafe { PACKED.scatter(nodes.f[axis], slot, of_corner) };
        axis += 1;
    }
}
