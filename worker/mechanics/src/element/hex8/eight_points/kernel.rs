//! One cycle of an element with eight points, from gather to scatter; the points are the lanes.
//!
//! With the natural axes at a point, `x_k = dx/dk` for k = xi, eta, zeta, and their cofactors `c_xi = x_eta x x_zeta` and so on, the
//! velocity gradient there is `sum_k v_k c_k^T / det` and the volume of the point is `det`. So the power of the stress is
//! `sum_points sum_k (s c_k) . v_k`, whose derivatives by the modes of `v` are the forces on the modes.

use super::{POINTS, Step};
use crate::{
    element::{
        ElementVote,
        hex8::{
            BySlot, Laws, Tally, balanced,
            compression::{Change, Compressed},
            end::End,
            offer_faults,
            stress::Stressed,
        },
        hourglass::{Amplitudes, OF_SUMS, amplitude, bounded},
        modes::{Gradient, Modes, corner_values, modes_of},
        place::Nodal,
        vector::{Tensor, Vector},
        viscosity::{Spread, Swing},
    },
    eos::{AnyEos, EquationOfState},
    exact::rounded,
    failure::{AnyFailure, FailureLaw, Loading},
    lanes::{Lane, SET, scalar::Scalar},
    mesh::CORNERS,
    state::field,
    strength::{AnyStrength, Deviator, History, Memory, Strain, StrengthLaw},
};

/// Natural coordinates of the points of Gauss: those of the corners over the root of three.
const NATURAL: [[f64; POINTS]; 3] = {
    let mut at = [[0.0; POINTS]; 3];
    let mut point = 0;
    while point < POINTS {
        let mut axis = 0;
        while axis < 3 {
            at[axis][point] = CORNERS[point][axis] * 0.577_350_269_189_625_8;
            axis += 1;
        }
        point += 1;
    }
    at
};

/// Numbers of the points of an element.
type Points = [f64; POINTS];

/// Natural coordinates of some points.
#[derive(Clone, Copy)]
struct Natural<L> {
    xi: L,
    eta: L,
    zeta: L,
}

impl<L: Lane> Natural<L> {
    #[inline(always)]
    fn at(point: usize) -> Self {
        let [xi, eta, zeta] = NATURAL.each_ref().map(|values| get(values, point));
        Self { xi, eta, zeta }
    }

    /// Derivatives of a field by the natural coordinates, eight times as large, as its modes are.
    #[inline(always)]
    fn derivatives(&self, modes: &Modes<Scalar>) -> [Vector<L>; 3] {
        let [a, b, c, d, e, f, g] =
            [modes.a, modes.b, modes.c, modes.d, modes.e, modes.f, modes.g].map(splat::<L>);
        let Self { xi, eta, zeta } = *self;
        [
            g.mul_add(eta * zeta, &f.mul_add(eta, &e.mul_add(zeta, &a))),
            g.mul_add(xi * zeta, &f.mul_add(xi, &d.mul_add(zeta, &b))),
            g.mul_add(xi * eta, &e.mul_add(xi, &d.mul_add(eta, &c))),
        ]
    }
}

#[inline(always)]
fn splat<L: Lane>(v: Vector<Scalar>) -> Vector<L> {
    Vector { x: L::splat(v.x.0), y: L::splat(v.y.0), z: L::splat(v.z.0) }
}

#[inline(always)]
fn get<L: Lane>(values: &Points, point: usize) -> L {
    assert!(point + L::N <= POINTS);
    // SAFETY: just checked.
    unsafe { L::load(values, point) }
}

#[inline(always)]
fn put<L: Lane>(value: L, values: &mut Points, point: usize) {
    assert!(point + L::N <= POINTS);
    // SAFETY: just checked.
    unsafe { value.store(values, point) };
}

/// Cofactors of the natural axes, 64 times as large, and the volume of the point, 512 times as large.
#[inline(always)]
fn cofactors<L: Lane>(axes: &[Vector<L>; 3]) -> ([Vector<L>; 3], L) {
    let [xi, eta, zeta] = axes;
    let along_xi = eta.cross(zeta);
    let volume = xi.dot(&along_xi);
    ([along_xi, zeta.cross(xi), xi.cross(eta)], volume)
}

/// The same sum on every width.
#[inline(always)]
fn sum(v: &Points) -> f64 {
    ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]))
}

#[inline(always)]
fn mean(v: &Points) -> f64 {
    sum(v) * (1.0 / POINTS as f64)
}

/// What the points leave for the element.
struct Left {
    /// Deviatoric stress xx, yy, zz, xy, yz, zx.
    stress: [Points; 6],
    /// Power of the stress times the volume of the middle of the step (64 times 8 of it).
    power: Points,
    rate: Points,
    increment: Points,
    plastic_before: Points,
    plastic_strain: Points,
    temperature: Points,
    damage: Points,
    /// Volume at the middle of the step, 512 times as large.
    volume: Points,
}

/// Forces, new state and vote of the element of a slot.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "one level of the kernel")]
pub(super) fn compute<L: Lane>(
    corners: [usize; 8],
    nodes: &mut Nodal<'_>,
    elements: &mut BySlot<'_>,
    points: &mut BySlot<'_>,
    laws: &Laws<AnyEos, AnyStrength, AnyFailure>,
    step: &Step,
    slot: usize,
    tally: &mut Tally<Scalar>,
    vote: &mut ElementVote,
) {
    let modes = |of: &[&[f64]; 3]| {
        let axis = |axis: usize| modes_of(corners.map(|node| Scalar(of[axis][node])));
        Modes::of(axis(0), axis(1), axis(2))
    };
    let (x, v) = (modes(&nodes.x), modes(&nodes.v));
    let initial_volume = Scalar(elements.initial_volume[slot]);
    let mid = Modes::before(&x, &v, Scalar(0.5 * step.dt));
    let at_mid = Gradient::of(&mid);
    let gradient = at_mid.against(&v).scaled(Scalar(1.0) / at_mid.volume_times_64);
    let end = End::of(&x, initial_volume);

    // Stress of the points.
    let first = slot * POINTS;
    let mut left = stresses::<L>(&mid, &v, points, first, laws, step.dt);

    // Pressure of the element, as with one point. It has failed when all its points have.
    let failed = laws.failure.fails() && left.damage.iter().all(|&damage| damage >= 1.0);
    let change = Change {
        initial_volume,
        inverse_volume: end.inverse_by_64 * Scalar(64.0),
        relative_volume: end.relative_volume,
        length: end.length,
        volume_rate: gradient.x.x + gradient.y.y + gradient.z.z,
        deviatoric_power: Scalar(sum(&left.power)) / (Scalar(8.0) * at_mid.volume_times_64),
        middle: at_mid.volume() * end.inverse_initial,
        failed,
        temperature: Scalar(mean(&left.temperature)),
    };
    let compressed = Compressed::of(&change, elements, slot, laws, step, &Memory::none());
    let Compressed { volume_change, sound_square, density, damping, viscosity, heating, .. } = compressed;
    let Compressed { energy, pressure, burn, sound, .. } = compressed;
    if laws.strength.heating_by_energy() != 0.0 {
        left.temperature = [compressed.temperature.0; POINTS];
    }
    if laws.failure.fails() {
        damages::<L>(&mut left, laws, pressure);
    }

    // What is left of the resistance of the modes where all points have failed.
    let q = Amplitudes {
        d: amplitude(&v.d, &gradient, &mid.d),
        e: amplitude(&v.e, &gradient, &mid.e),
        f: amplitude(&v.f, &gradient, &mid.f),
        g: amplitude(&v.g, &gradient, &mid.g),
    };
    let mut resist = Scalar(0.0);
    if failed {
        let inverse_volume = end.inverse_by_64 * Scalar(64.0);
        let modes = [&x.d, &x.e, &x.f, &x.g];
        let twice = bounded(Scalar(2.0 * laws.hourglass.failed), modes, &end.spread, inverse_volume, OF_SUMS);
        resist = twice * density * sound * end.area;
    }
    let taken = Scalar(step.dt / 8.0) * resist * q.square();

    // Forces on the modes, and the narrowest point.
    let (of_stress, narrowest, upright) = forces_on_modes::<L>(&x, &left, &end);

    let check = [energy, pressure, viscosity, q.square()].iter().map(|value| value.0).sum::<f64>()
        + left.stress.iter().map(sum).sum::<f64>()
        + of_stress.iter().flatten().sum::<f64>();
    let is_upright = upright
        && left.volume.iter().all(|&volume| volume > 0.0)
        && at_mid.volume_times_64.0 > 0.0
        && end.gradient.volume_times_64.0 > 0.0;
    if !is_upright || !check.is_finite() {
        let volume = at_mid.volume().min(end.volume).0;
        offer_faults(&[volume; SET], 1, &elements.elements[slot..=slot], vote);
        return;
    }

    // Votes and energies.
    let inverse_volume = change.inverse_volume;
    let double_inverse_square = Scalar(2.0 / 512.0) * inverse_volume * inverse_volume;
    let shear_square = Scalar(laws.strength.shear() / laws.density) * end.relative_volume;
    let sound_square = if laws.eos.burns() { sound_square.max(burn.pace_square) } else { sound_square };
    let trace = end.spread.trace() * double_inverse_square;
    let swing = Swing { damping, sound_square, shear_square, trace };
    let largest = (end.spread.largest_eigenvalue() * double_inverse_square).max(narrowest);
    let frequency = swing.frequency(largest);
    vote.offer_courant((Scalar(1.0) / frequency).0, elements.elements[slot]);
    let magic = Scalar(step.energy_quantum.magic());
    tally.internal = tally.internal + rounded(energy * initial_volume, magic);
    tally.hourglass = tally.hourglass + rounded(taken, magic);
    tally.viscosity = tally.viscosity + rounded(-(heating * volume_change * initial_volume), magic);
    tally.largest_rate = tally.largest_rate.max(change.volume_rate.abs());

    // State.
    elements.fields[field::VISCOSITY][slot] = viscosity.0;
    if step.dt != 0.0 {
        let [xx, yy, _, xy, yz, zx] = &left.stress;
        for (k, values) in [
            (field::SXX, xx),
            (field::SYY, yy),
            (field::SXY, xy),
            (field::SYZ, yz),
            (field::SZX, zx),
            (field::PLASTIC_STRAIN, &left.plastic_strain),
            (field::TEMPERATURE, &left.temperature),
            (field::DAMAGE, &left.damage),
        ] {
            points.fields[k][first..first + POINTS].copy_from_slice(values);
            elements.fields[k][slot] = mean(values);
        }
        if laws.eos.burns() {
            elements.fields[field::TIME_TO_LIGHT][slot] = burn.time_to_light.0;
        }
        elements.fields[field::PRESSURE][slot] = pressure.0;
        elements.fields[field::ENERGY][slot] = energy.0;
        elements.fields[field::RELATIVE_VOLUME][slot] = end.relative_volume.0;
    }

    // Corner forces: of the modes by the points, of the volume by the pressure.
    let squeeze = (pressure + viscosity) * Scalar(1.0 / 64.0);
    let resist = resist * Scalar(1.0 / 8.0);
    let bent = q.against(&x.d, &x.e, &x.f, &x.g).scaled(resist * end.inverse_by_64);
    let rows = [
        Vector { x: bent.x.x + squeeze, ..bent.x },
        Vector { y: bent.y.y + squeeze, ..bent.y },
        Vector { z: bent.z.z + squeeze, ..bent.z },
    ];
    let amplitudes =
        [[q.d.x, q.e.x, q.f.x, q.g.x], [q.d.y, q.e.y, q.f.y, q.g.y], [q.d.z, q.e.z, q.f.z, q.g.z]];
    let magic = Scalar(step.force_quantum.magic());
    for axis in 0..3 {
        let by_volume = end.gradient.forces(&rows[axis], resist, amplitudes[axis]);
        let by_points = corner_values(of_stress[axis].map(Scalar));
        let forces = std::array::from_fn(|corner| by_volume[corner] - by_points[corner]);
        let forces = balanced(forces, true, magic, &mut tally.largest_force);
        for (node, force) in corners.into_iter().zip(forces) {
            nodes.f[axis][node] += force.0;
        }
    }
}

/// The stress of the points at the end of the step.
#[inline(always)]
fn stresses<L: Lane>(
    mid: &Modes<Scalar>,
    v: &Modes<Scalar>,
    points: &BySlot<'_>,
    first: usize,
    laws: &Laws<AnyEos, AnyStrength, AnyFailure>,
    dt: f64,
) -> Left {
    const NONE: Points = [0.0; POINTS];
    let mut left = Left {
        stress: [NONE; 6],
        power: NONE,
        rate: NONE,
        increment: NONE,
        plastic_before: NONE,
        plastic_strain: NONE,
        temperature: NONE,
        damage: NONE,
        volume: NONE,
    };
    let one = L::splat(1.0);
    let mut point = 0;
    while point < POINTS {
        let natural = Natural::<L>::at(point);
        let (cofactors, volume) = cofactors(&natural.derivatives(mid));
        let [along_xi, along_eta, along_zeta] = natural.derivatives(v);
        let gradient = Tensor::outer(&along_xi, &cofactors[0])
            .outer_add(&along_eta, &cofactors[1])
            .outer_add(&along_zeta, &cofactors[2])
            .scaled(one / volume);
        let all = L::mask(u32::MAX);
        let Stressed { stress, power, history, plastic_before, strain, damage, .. } =
            Stressed::of(&gradient, points, first + point, laws, dt, all, [one; 2]);
        let components = [stress.xx, stress.yy, stress.zz, stress.xy, stress.yz, stress.zx];
        for (component, values) in components.into_iter().zip(&mut left.stress) {
            put(component, values, point);
        }
        put(power * volume, &mut left.power, point);
        put(strain.rate, &mut left.rate, point);
        put(strain.increment, &mut left.increment, point);
        put(plastic_before, &mut left.plastic_before, point);
        let History { plastic_strain, temperature } = history;
        put(plastic_strain, &mut left.plastic_strain, point);
        put(temperature, &mut left.temperature, point);
        put(damage, &mut left.damage, point);
        put(volume, &mut left.volume, point);
        point += L::N;
    }
    left
}

/// The damage of the points at the end of the step, with the pressure of the element.
#[inline(always)]
fn damages<L: Lane>(left: &mut Left, laws: &Laws<AnyEos, AnyStrength, AnyFailure>, pressure: Scalar) {
    let mut point = 0;
    while point < POINTS {
        let [xx, yy, zz, xy, yz, zx] = left.stress.each_ref().map(|values| get::<L>(values, point));
        let loading = Loading {
            stress: Deviator { xx, yy, zz, xy, yz, zx },
            pressure: L::splat(pressure.0),
            strain: Strain { rate: get(&left.rate, point), increment: get(&left.increment, point) },
            plastic_strain: [get(&left.plastic_before, point), get(&left.plastic_strain, point)],
            temperature: get(&left.temperature, point),
        };
        let damage = laws.failure.damage(get::<L>(&left.damage, point), &loading);
        put(damage, &mut left.damage, point);
        point += L::N;
    }
}

/// By axis, what the stress of the points gives to each mode (over 64, as the rows of the pressure are); the square of the greatest inverse
/// length of a point, as [`Swing::frequency`] takes it; and whether no corner is folded inward.
///
/// A point limits the step as an element of its axes would, whose nodes have the mass of this one: exact where all edges are parallel.
#[inline(always)]
fn forces_on_modes<L: Lane>(
    x: &Modes<Scalar>,
    left: &Left,
    end: &End<Scalar>,
) -> ([[f64; 7]; 3], Scalar, bool) {
    // Traction on the faces across each natural axis, by axis of space.
    let mut tractions = [[[0.0; POINTS]; 3]; 3];
    let (mut volumes, mut inverse_squares) = ([0.0; POINTS], [0.0; POINTS]);
    let inverse_volume = L::splat(0.25 * 64.0 * end.inverse_by_64.0);
    let mut point = 0;
    while point < POINTS {
        let (cofactors, volume) = cofactors(&Natural::<L>::at(point).derivatives(x));
        let [xx, yy, zz, xy, yz, zx] = left.stress.each_ref().map(|values| get::<L>(values, point));
        let stress = Tensor {
            x: Vector { x: xx, y: xy, z: zx },
            y: Vector { x: xy, y: yy, z: yz },
            z: Vector { x: zx, y: yz, z: zz },
        };
        for (cofactor, traction) in cofactors.iter().zip(&mut tractions) {
            let Vector { x, y, z } = stress.apply(cofactor);
            for (component, values) in [x, y, z].into_iter().zip(traction) {
                put(component, values, point);
            }
        }
        let [a, b, c] = &cofactors;
        let square = Spread::gram([a, b, c]).largest_eigenvalue() * inverse_volume / volume;
        put(volume, &mut volumes, point);
        put(square, &mut inverse_squares, point);
        point += L::N;
    }
    let [xi, eta, zeta] = &NATURAL;
    let product = |a: &Points, b: &Points| -> Points { std::array::from_fn(|i| a[i] * b[i]) };
    let along = |values: &Points, weights: &Points| sum(&product(values, weights));
    let (eta_zeta, xi_zeta, xi_eta) = (product(eta, zeta), product(xi, zeta), product(xi, eta));
    let of_axis = |axis: usize| {
        let [t_xi, t_eta, t_zeta] = [&tractions[0][axis], &tractions[1][axis], &tractions[2][axis]];
        [
            sum(t_xi),
            sum(t_eta),
            sum(t_zeta),
            along(t_eta, zeta) + along(t_zeta, eta),
            along(t_xi, zeta) + along(t_zeta, xi),
            along(t_xi, eta) + along(t_eta, xi),
            along(t_xi, &eta_zeta) + along(t_eta, &xi_zeta) + along(t_zeta, &xi_eta),
        ]
        .map(|force| force * (1.0 / (8.0 * 64.0)))
    };
    let narrowest = inverse_squares.iter().copied().fold(0.0, f64::max);
    ([of_axis(0), of_axis(1), of_axis(2)], Scalar(narrowest), volumes.iter().all(|&volume| volume > 0.0))
}
