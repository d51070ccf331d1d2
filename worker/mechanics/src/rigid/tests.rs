use super::*;
use crate::{
    constraint::Constraint,
    element::shell4::Rule,
    load::{Curve, Gravity, Loads},
    material::{Eos, Failure, Material, Strength},
    mesh::{Mesh, Part, Section, Topology},
};

fn steel() -> Material {
    Material {
        name: "steel".into(),
        density: 8000.0,
        eos: Eos::Linear { bulk: 1.6e11 },
        strength: Strength::Hydro,
        failure: Failure::None,
    }
}

/// A box of one hexahedron with its low corner at `low`, each place put through `shape`.
fn brick(low: [f64; 3], size: [f64; 3], shape: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let corner = |i: usize| {
        let steps = [i & 1, i >> 1 & 1, i >> 2];
        shape(std::array::from_fn(|a| low[a] + size[a] * steps[a] as f64))
    };
    let part = Part {
        name: "brick".into(),
        material: 0,
        topology: Topology::Structured { cells: [1; 3] },
        nodes: (0..8).collect(),
        element_ids: vec![1],
        hourglass: crate::element::hourglass::Hourglass::VISCOUS,
    };
    Mesh {
        positions: (0..8).map(corner).collect(),
        node_ids: (1..9).collect(),
        parts: vec![part],
        lumped: Vec::new(),
    }
}

fn made(mesh: &Mesh, given: shape::Given, velocity: &[[f64; 3]]) -> Result<Body, String> {
    made_of(mesh, given, (velocity, &[]))
}

fn made_of(mesh: &Mesh, given: shape::Given, motion: (&[[f64; 3]], &[[f64; 3]])) -> Result<Body, String> {
    let of_node = vec![0; mesh.n_nodes()];
    shape::body(mesh, &[steel()], (&[Constraint::default()], &of_node), &Loads::default(), given, motion)
}

fn spinning(size: [f64; 3], spin: [f64; 3]) -> Body {
    let mesh = brick([1.0, -2.0, 0.5], size, |x| x);
    let given = shape::Given { parts: vec![0], start_spin: Some(spin), ..shape::Given::default() };
    made(&mesh, given, &[[0.0; 3]; 8]).expect("a body")
}

fn step_of(loads: &Loads, time: f64, dt: f64) -> TimeStep<'_> {
    let q = Quantum::for_reference(1e6, 46);
    TimeStep {
        dt_previous: dt,
        dt,
        time,
        cycle: 0,
        loads,
        quanta: Quanta { force: q, energy: q, momentum: q, arm: 1.0 },
    }
}

/// Moves a body that nothing pushes.
fn go(step: &TimeStep<'_>, body: &Body, state: &mut State) -> Booked {
    let free = step.free(body, &Push::default(), state);
    let old = *state;
    *state = step.moved(body, &free, &Impulse::default(), &old);
    step.booked(body, &free, &Impulse::default(), &old, state)
}

#[test]
fn a_brick_has_its_mass_its_centre_and_its_inertia() {
    let size = [0.2, 0.3, 0.5];
    let body = spinning(size, [0.0; 3]);
    let mass = 8000.0 * size.iter().product::<f64>();
    assert!((body.mass / mass - 1.0).abs() < 1e-14);
    for a in 0..3 {
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        let expected = mass / 12.0 * (size[b] * size[b] + size[c] * size[c]);
        assert!((body.inertia[a] / expected - 1.0).abs() < 1e-13, "{:?}", body.inertia);
        assert!(body.inertia[3 + a].abs() < 1e-13 * expected);
        assert!((body.start.centre[a] - ([1.0, -2.0, 0.5][a] + 0.5 * size[a])).abs() < 1e-15);
    }
}

#[test]
fn a_frustum_has_the_moments_of_its_integrals() {
    // Section (2 - z)^2 over 0 < z < 1: mass 7/3, height 11/28, of density one.
    let mesh =
        brick([-1.0, -1.0, 0.0], [2.0, 2.0, 1.0], |[x, y, z]| [x * (1.0 - 0.5 * z), y * (1.0 - 0.5 * z), z]);
    let given = shape::Given { parts: vec![0], ..shape::Given::default() };
    let body = made(&mesh, given, &[[0.0; 3]; 8]).expect("a body");
    let mass = 8000.0 * 7.0 / 3.0;
    assert!((body.mass / mass - 1.0).abs() < 1e-14, "{}", body.mass);
    assert!((body.start.centre[2] - 11.0 / 28.0).abs() < 1e-14, "{:?}", body.start.centre);
    // About the axis: integral of s^4 / 6 with s = 2 - z, which is 31/30.
    assert!((body.inertia[2] / (8000.0 * 31.0 / 30.0) - 1.0).abs() < 1e-13, "{:?}", body.inertia);
}

/// A tube of shells, open at both ends, of `n` by `n` elements along z.
fn tube(radius: f64, length: f64, thickness: f64, n: u32) -> Mesh {
    let place = |i: u32| {
        let angle = f64::from(i % n) / f64::from(n) * std::f64::consts::TAU;
        [radius * angle.cos(), radius * angle.sin(), length * f64::from(i / n) / f64::from(n)]
    };
    let quad = |i: u32| {
        let (low, next) = (i / n * n, (i + 1) % n);
        [i, low + next, low + n + next, i + n]
    };
    let part = Part {
        name: "tube".into(),
        material: 0,
        topology: Topology::Shells {
            quads: (0..n * n).map(quad).collect(),
            section: Section::of(thickness, Rule::Gauss(2)),
            thicknesses: Vec::new(),
        },
        nodes: (0..n * (n + 1)).collect(),
        element_ids: (1..=n * n).collect(),
        hourglass: crate::element::hourglass::Hourglass::VISCOUS,
    };
    let positions: Vec<[f64; 3]> = (0..n * (n + 1)).map(place).collect();
    Mesh {
        node_ids: (1..=positions.len() as u32).collect(),
        positions,
        parts: vec![part],
        lumped: Vec::new(),
    }
}

#[test]
fn a_tube_of_shells_has_its_mass_its_centre_and_its_inertia_with_its_thickness() {
    let (radius, length, thickness) = (0.4, 1.0, 0.2);
    let mesh = tube(radius, length, thickness, 120);
    let given = shape::Given { parts: vec![0], ..shape::Given::default() };
    let body = made(&mesh, given, &vec![[0.0; 3]; mesh.n_nodes()]).expect("a body");
    let mass = 8000.0 * std::f64::consts::TAU * radius * length * thickness;
    // Facets are inside the circle: by 1 - pi^2 / 6 n^2 in length, and twice that more in the square of the radius.
    assert!((body.mass / mass - 1.0).abs() < 2e-4, "{} of {mass}", body.mass);
    assert!((body.start.centre[2] - 0.5).abs() < 1e-11, "{:?}", body.start.centre);
    // Of a tube with radii r - h/2 and r + h/2, spread evenly over its middle: r^2 + h^2 / 12 about the axis.
    let across = thickness * thickness / 12.0;
    let about_axis = mass * (radius * radius + across);
    let beside = mass * (0.5 * radius * radius + length * length / 12.0 + 0.5 * across);
    assert!((body.inertia[2] / about_axis - 1.0).abs() < 6e-4, "{:?}", body.inertia);
    assert!((body.inertia[0] / beside - 1.0).abs() < 6e-4, "{:?}, expected {beside}", body.inertia);
    let thin = made(
        &tube(radius, length, 1e-3, 120),
        shape::Given { parts: vec![0], ..shape::Given::default() },
        &vec![[0.0; 3]; mesh.n_nodes()],
    )
    .expect("a body");
    // Without its thickness it would be 2 % less.
    let share = body.inertia[2] / body.mass / (thin.inertia[2] / thin.mass) - 1.0;
    assert!((share / (across / (radius * radius)) - 1.0).abs() < 1e-3, "{share}");
}

#[test]
fn a_moment_is_added_to_the_torque_alone() {
    let (force, length) = (Quantum::for_reference(1e9, 42), Quantum::for_reference(0.3, 50));
    let arm = Quantum::for_reference(0.01, 0).value();
    let m = [3.0, -7.0, 2e15].map(|c| c * force.value() * arm);
    let (mut once, mut twice) = (Push::default(), Push::default());
    once.add_moment(m.map(|c| 2.0 * c), force, length);
    (0..2).for_each(|_| twice.add_moment(m, force, length));
    assert_eq!(once, twice);
    assert_eq!(once.force, [0; 3]);
    for a in 0..3 {
        let torque = once.torque[a] as f64 * length.value() * force.value();
        assert_eq!(torque.to_bits(), (2.0 * m[a]).to_bits());
    }
}

#[test]
fn the_rigid_part_of_the_motion_of_the_nodes_is_taken_up() {
    let mesh = brick([1.0, -2.0, 0.5], [0.2, 0.3, 0.5], |[x, y, z]| [x + 0.1 * y * z, y, z]);
    let (v, spin) = ([3.0, -1.0, 2.0], [10.0, 20.0, -5.0]);
    let given = shape::Given { parts: vec![0], ..shape::Given::default() };
    let still = made(&mesh, given.clone(), &[[0.0; 3]; 8]).expect("a body");
    let mut velocity = still.places.iter().map(|&r| cross(spin, r)).collect::<Vec<_>>();
    velocity.iter_mut().for_each(|at| (0..3).for_each(|a| at[a] += v[a]));
    let body = made(&mesh, given, &velocity).expect("a body");
    for a in 0..3 {
        assert!((body.start.velocity[a] - v[a]).abs() < 1e-12, "{:?}", body.start);
        assert!((body.start.spin[a] - spin[a]).abs() < 1e-11, "{:?}", body.start);
    }
}

#[test]
fn what_is_given_stands_and_too_little_inertia_is_refused() {
    let mesh = brick([0.0; 3], [1.0; 3], |x| x);
    let given = |inertia: f64| shape::Given {
        parts: vec![0],
        mass: Some(16_000.0),
        inertia: Some(([0.5, 0.5, 0.6], [inertia, inertia, inertia, 0.0, 0.0, 0.0])),
        ..shape::Given::default()
    };
    let body = made(&mesh, given(5000.0), &[[0.0; 3]; 8]).expect("a body");
    assert_eq!((body.mass, body.start.centre), (16_000.0, [0.5, 0.5, 0.6]));
    assert!((body.nodal_scale - 2.0).abs() < 1e-14, "{}", body.nodal_scale);
    assert!((body.inertia[1] - 5000.0).abs() < 1e-9, "{:?}", body.inertia);
    let error = made(&mesh, given(500.0), &[[0.0; 3]; 8]).expect_err("too little");
    assert!(error.contains("less than a tenth"), "{error}");
}

#[test]
fn a_push_is_the_same_however_it_is_cut_and_packed() {
    let (force, length) = (Quantum::for_reference(1e9, 42), Quantum::for_reference(0.3, 50));
    let mut seed = 9_u64;
    let mut draw = |size: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        size * ((seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    let terms: Vec<([f64; 3], [f64; 3])> =
        (0..300).map(|_| ([0; 3].map(|_| force.round(draw(1e10))), [0; 3].map(|_| draw(0.15)))).collect();
    let mut whole = Push::default();
    terms.iter().for_each(|(f, r)| whole.add(*f, *r, force, length));
    for workers in [1, 2, 5] {
        let mut sum = [0.0; PUSH];
        for w in 0..workers {
            let mut own = Push::default();
            terms.iter().skip(w).step_by(workers).for_each(|(f, r)| own.add(*f, *r, force, length));
            sum.iter_mut().zip(own.pack()).for_each(|(s, limb)| *s += limb);
        }
        assert_eq!(Push::unpack(&sum), whole, "{workers} workers");
    }
    // The force of a node may be split among workers, too.
    let mut split = Push::default();
    for (f, r) in &terms {
        let half = f.map(|c| force.round(0.37 * c));
        split.add(half, *r, force, length);
        split.add(std::array::from_fn(|a| f[a] - half[a]), *r, force, length);
    }
    assert_eq!(split, whole);
    let torque: f64 = terms.iter().map(|(f, r)| r[1] * f[2] - r[2] * f[1]).sum();
    let found = whole.torque[0] as f64 * force.value() * length.value();
    assert!((found / torque - 1.0).abs() < 1e-9, "{found} {torque}");
}

#[test]
fn a_round_top_precesses_as_eulers_equations_say_and_keeps_energy_and_momentum() {
    // Square in section: inertia about z, and another about x and y.
    let spin = [30.0, 0.0, 200.0];
    let body = spinning([0.2, 0.2, 0.5], spin);
    let (size, rate) = {
        let l = body.start.momentum;
        let size = dot(l, l).sqrt();
        (size, size / body.inertia[0])
    };
    let (loads, dt, steps) = (Loads::default(), 1e-5, 40_000);
    let mut state = body.start;
    let mut error = 0.0_f64;
    let mut energies = [f64::INFINITY, 0.0];
    for n in 0..steps {
        let booked = go(&step_of(&loads, 0.0, dt), &body, &mut state);
        energies = [energies[0].min(booked.kinetic), energies[1].max(booked.kinetic)];
        assert_eq!(state.momentum, body.start.momentum, "angular momentum, to the bit");
        // The axis of the body turns about the momentum at the rate |L| / I.
        let angle = rate * dt * f64::from(n + 1);
        let unit = state.momentum.map(|l| l / size);
        let axis = [0.0, 0.0, 1.0];
        let (along, side) = (dot(unit, axis), cross(unit, axis));
        let expected: [f64; 3] = std::array::from_fn(|a| {
            axis[a] * angle.cos() + side[a] * angle.sin() + unit[a] * along * (1.0 - angle.cos())
        });
        let found = turned(&state.attitude, axis);
        error = (0..3).map(|a| (found[a] - expected[a]).abs()).fold(error, f64::max);
    }
    println!(
        "axis off by {error:e} after {} turns, energy {energies:?}",
        rate * dt * 4e4 / std::f64::consts::TAU
    );
    assert!(error < 2e-6, "{error}");
    assert!(energies[1] / energies[0] - 1.0 < 1e-7, "{energies:?}");
    assert!(state.attitude.iter().map(|q| q * q).sum::<f64>() - 1.0 < 1e-15);
}

#[test]
fn a_book_that_turns_over_does_not_gain_energy() {
    // About the middle axis: unstable, it flips for ever.
    let body = spinning([0.3, 0.05, 0.2], [0.1, 0.1, 100.0]);
    let (loads, dt) = (Loads::default(), 1e-4);
    let mut state = body.start;
    let mut energies = [f64::INFINITY, 0.0];
    let mut flips = 0;
    let mut up = true;
    for _ in 0..100_000 {
        let booked = go(&step_of(&loads, 0.0, dt), &body, &mut state);
        energies = [energies[0].min(booked.kinetic), energies[1].max(booked.kinetic)];
        let now = turned(&state.attitude, [0.0, 0.0, 1.0])[2] > 0.0;
        flips += u32::from(now != up);
        up = now;
    }
    println!("{flips} flips, energy {energies:?}");
    assert!(flips > 10, "{flips}");
    assert!(energies[1] / energies[0] - 1.0 < 1e-4, "{energies:?}");
}

#[test]
fn a_prescribed_turn_has_its_angle_and_its_support_does_the_work() {
    let mut body = spinning([0.2, 0.3, 0.5], [0.0; 3]);
    let zero = Some(Drive::constant(0.0));
    body.spin = [zero, zero, Some(Drive::along(0, 1.0))];
    body.velocity[0] = Some(Drive::constant(5.0));
    let loads = Loads {
        curves: vec![Curve { points: vec![[0.0, 0.0], [1.0, 2.0]] }],
        gravity: Some(Gravity { acceleration: [0.0, 0.0, -10.0], drive: Drive::constant(1.0) }),
        ..Loads::default()
    };
    body.start.velocity[0] = 5.0;
    let mut state = body.start;
    let (dt, mut work) = (1e-3, 0.0);
    let first = go(&TimeStep { dt_previous: 0.0, ..step_of(&loads, 0.0, dt) }, &body, &mut state);
    let mut last = first;
    for n in 1..1000 {
        work += last.external.after;
        last = go(&step_of(&loads, f64::from(n) * dt, dt), &body, &mut state);
        work += last.external.before;
    }
    // Angle 1 about z after one second; five metres along x, and half g t^2 down.
    let turned_by = 2.0 * (state.attitude[3] / state.attitude[0]).atan();
    assert!((turned_by - 1.0).abs() < 1e-12, "{turned_by}");
    assert!((state.centre[0] - body.start.centre[0] - 5.0).abs() < 1e-12);
    assert!((state.centre[2] - body.start.centre[2] + 5.0).abs() < 1e-2);
    let gained = last.kinetic - first.kinetic;
    assert!((work / gained - 1.0).abs() < 3e-3, "{work} {gained}");
}

#[test]
fn a_turn_by_a_large_angle_is_that_of_its_sine() {
    for angle in [1e-6, 0.01, 0.06, 0.3, 2.0, 40.0_f64] {
        let q = turn(&[1.0, 0.0, 0.0, 0.0], [0.0, angle, 0.0], 1.0);
        assert!((q[2] - (0.5 * angle).sin()).abs() < 1e-14, "{angle}: {q:?}");
        assert!((q[0] - (0.5 * angle).cos()).abs() < 1e-14, "{angle}: {q:?}");
    }
}

/// Two bricks whose low corners are at the origin and at `low`, of eight nodes each.
fn two_bricks(low: [f64; 3]) -> Mesh {
    let (mut mesh, mut upper) = (brick([0.0; 3], [1.0; 3], |x| x), brick(low, [1.0; 3], |x| x));
    mesh.positions.append(&mut upper.positions);
    mesh.node_ids = (1..17).collect();
    mesh.parts.extend(upper.parts.pop().map(|part| Part { nodes: (8..16).collect(), ..part }));
    mesh
}

#[test]
fn nodes_on_a_line_of_solids_take_up_their_momenta_and_do_not_turn_about_it() {
    // From a corner of the one to a corner of the other: along z, and oblique.
    for low in [[1.0, 1.0, 1.5], [1.3, 0.8, 1.4]] {
        let mesh = two_bricks(low);
        let mut velocity = vec![[0.0; 3]; 16];
        velocity[8..].fill([2.0, 3.0, 10.0]);
        let given = shape::Given { nodes: vec![7, 8], ..shape::Given::default() };
        let body = made(&mesh, given, &velocity).expect("a body");
        assert!(body.start.is_finite(), "{:?}", body.start);
        // An eighth of a tonne of steel each.
        let (mass, arm) = (1000.0, [0, 1, 2].map(|a| mesh.positions[8][a] - mesh.positions[7][a]));
        let carried = velocity[8].map(|v| mass * v);
        let angular = cross(arm.map(|c| 0.5 * c), carried);
        for a in 0..3 {
            assert!((body.mass * body.start.velocity[a] - carried[a]).abs() < 1e-9, "{:?}", body.start);
            assert!((body.start.momentum[a] - angular[a]).abs() < 1e-6, "{:?} {angular:?}", body.start);
        }
        let about = dot(body.start.spin, arm) / dot(arm, arm).sqrt();
        assert!(about.abs() < 1e-8, "{about} about the line of {:?}", body.start.spin);
    }
}

/// Squares of one shell each, with sides of 0.2 m and so thick, in planes z = 0, `gap`, ...: parts of four nodes.
fn squares(n: u32, gap: f64, thickness: f64) -> Mesh {
    let corners = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2]];
    let part = |i: u32| Part {
        name: format!("square {i}"),
        material: 0,
        topology: Topology::Shells {
            quads: vec![[0, 1, 2, 3]],
            section: Section::of(thickness, Rule::Gauss(2)),
            thicknesses: Vec::new(),
        },
        nodes: (4 * i..4 * i + 4).collect(),
        element_ids: vec![i + 1],
        hourglass: crate::element::hourglass::Hourglass::VISCOUS,
    };
    let at = |i: u32| corners.map(|[x, y]| [x, y, gap * f64::from(i)]);
    Mesh {
        positions: (0..n).flat_map(at).collect(),
        node_ids: (1..=4 * n).collect(),
        parts: (0..n).map(part).collect(),
        lumped: Vec::new(),
    }
}

#[test]
fn nodes_of_shells_give_a_body_their_own_inertia_and_what_they_turn_with() {
    for gap in [0.01, 0.0] {
        let mesh = squares(2, gap, 0.01);
        let given = || shape::Given { nodes: vec![2, 6], ..shape::Given::default() };
        let (mut velocity, mut spin) = (vec![[0.0; 3]; 8], vec![[0.0; 3]; 8]);
        (velocity[2], velocity[6]) = ([1.0, 0.0, 0.0], [-1.0, 0.0, 2.0]);
        (spin[2], spin[6]) = ([0.0, 5.0, 30.0], [0.0, 1.0, -10.0]);
        let body = made_of(&mesh, given(), (&velocity, &spin)).expect("a body");
        let mass = 8000.0 * 0.2 * 0.2 * 0.01 / 4.0;
        let (own, arm) = (mass * 0.2 * 0.2 / 8.0, 0.5 * gap);
        let expected = [2.0 * (own + mass * arm * arm), 2.0 * (own + mass * arm * arm), 2.0 * own];
        // Velocities of +1 and -1 at arms of -gap / 2 and gap / 2.
        let angular = [0.0, 6.0 * own - 2.0 * mass * arm, 20.0 * own];
        for a in 0..3 {
            assert!((body.inertia[a] / expected[a] - 1.0).abs() < 1e-12, "{:?} {expected:?}", body.inertia);
            assert!((body.start.momentum[a] - angular[a]).abs() < 1e-12 * own, "{:?}", body.start);
            assert!((body.start.spin[a] - angular[a] / expected[a]).abs() < 1e-11, "{:?}", body.start);
        }
        assert_eq!(body.start.velocity, [0.0, 0.0, 1.0]);
        assert!(body.reach() >= arm.max((own / mass).sqrt()), "{}", body.reach());
    }
    // Solids in one point have nothing that could turn.
    let mesh = two_bricks([1.0; 3]);
    let given = shape::Given { nodes: vec![7, 8], ..shape::Given::default() };
    assert!(made(&mesh, given, &[[0.0; 3]; 16]).is_err());
}

#[test]
fn a_rigid_shell_has_the_inertia_of_its_thickness_and_what_hangs_on_it_that_of_its_nodes() {
    let mesh = squares(2, 0.05, 0.01);
    let mass = 8000.0 * 0.2 * 0.2 * 0.01;
    let inertia_of = |nodes: Vec<u32>| {
        let given = shape::Given { parts: vec![0], nodes, ..shape::Given::default() };
        made(&mesh, given, &[[0.0; 3]; 8]).expect("a body").inertia
    };
    let alone = inertia_of(Vec::new());
    let plate = mass * (0.2 * 0.2 + 0.2 * 0.2) / 12.0;
    assert!((alone[2] / plate - 1.0).abs() < 1e-12, "{alone:?}");
    let flat = mass * (0.2 * 0.2 + 0.01 * 0.01) / 12.0;
    assert!((alone[0] / flat - 1.0).abs() < 1e-12, "{alone:?}");
    // A corner of the other hangs above one of its own: a quarter of the mass, on the diagonal.
    let hung = inertia_of(vec![6]);
    let quarter = 0.25 * mass;
    let reduced = quarter * mass / (quarter + mass);
    let expected = plate + quarter * 0.2 * 0.2 / 8.0 + reduced * 2.0 * 0.1 * 0.1;
    assert!((hung[2] / expected - 1.0).abs() < 1e-12, "{hung:?} {expected}");
}
