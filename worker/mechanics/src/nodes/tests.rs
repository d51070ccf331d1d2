use super::*;
use crate::{
    exact::{Quanta, Quantum},
    load::{Curve, Drive, Gravity, Loads, NodalForce, Relaxation},
    wall::{Motion, Shape},
};

const FLOOR: Shape = Shape::Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] };

fn advance_one(
    v: [f64; 3],
    f: [f64; 3],
    constraint: Constraint,
    walls: &[RigidWall],
) -> ([f64; 3], [f64; 3], Booked) {
    let (x, v, booked, _) = loaded_one(v, f, constraint, walls, &Loads::default());
    (x, v, booked)
}

fn loaded_one(
    v: [f64; 3],
    f: [f64; 3],
    constraint: Constraint,
    walls: &[RigidWall],
    loads: &Loads,
) -> ([f64; 3], [f64; 3], Booked, Vec<WallVote>) {
    let padded = |c: f64| [c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0].to_vec();
    let mut x = [0.0, 0.0, 0.001].map(padded);
    let mut vel = v.map(padded);
    let mut force = f.map(padded);
    let mut votes = vec![WallVote::default(); walls.len()];
    let q = Quantum::for_reference(1e3, 46);
    let constraints = [Constraint::default(), constraint];
    let advance = Advance {
        step: TimeStep {
            dt_previous: 1e-3,
            dt: 1e-3,
            time: 0.5,
            cycle: 0,
            loads,
            quanta: Quanta { force: q, energy: q, momentum: q, arm: 1.0 },
        },
        constraints: &constraints,
        walls,
        poses: &vec![Pose::default(); walls.len()],
    };
    let mut nodes = Nodes {
        x: &mut x,
        v: &mut vel,
        f: &mut force,
        mass: &[2.0; SET],
        constraint: &[1],
        sets: &[NodeSet { held: 1, booked: 1, surface: 0, strikes: 1 }],
        reference: &Default::default(),
        walls: &mut votes,
    };
    let booked = advance.run(&mut nodes, Width::best());
    assert!(force.iter().flatten().all(|&f| f == 0.0), "forces are cleared");
    (x.map(|c| c[0]), vel.map(|c| c[0]), booked, votes)
}

#[test]
fn free_node_gains_force_over_mass_times_dt() {
    let (x, v, booked) = advance_one([1.0, 0.0, 0.0], [4.0, 0.0, 0.0], Constraint::default(), &[]);
    assert!((v[0] - 1.002).abs() < 1e-15 && (x[0] - 1.002e-3).abs() < 1e-15);
    assert!((booked.kinetic - 1.002).abs() < 1e-9 && booked.external == Work::default());
}

#[test]
fn prescribed_velocity_books_the_work_of_its_support() {
    let hold = Constraint { velocity: [Some(Drive::constant(1.0)), None, None], ..Constraint::default() };
    let (_, v, booked) = advance_one([1.0, 0.0, 0.0], [4.0, 0.0, 0.0], hold, &[]);
    assert_eq!(v[0], 1.0);
    // As fast before as after: half of the work is done by t_n.
    let Work { before, after } = booked.external;
    assert!((before + 2.0e-3).abs() < 1e-9 && (after + 2.0e-3).abs() < 1e-9, "{before} {after}");
}

#[test]
fn wall_stops_the_node_on_its_plane_and_friction_follows_coulomb() {
    let touches = Constraint { walls: 1, ..Constraint::default() };
    let mut wall = RigidWall { shape: FLOOR, motion: Motion::Fixed, friction: 0.0, parts: vec![true] };
    let (x, v, _) = advance_one([10.0, 0.0, -10.0], [0.0; 3], touches, std::slice::from_ref(&wall));
    assert!(x[2].abs() < 1e-15 && v[0] == 10.0);
    wall.friction = 0.3;
    let (_, v, _) = advance_one([10.0, 0.0, -10.0], [0.0; 3], touches, std::slice::from_ref(&wall));
    // normal velocity goes from -10 to -1 (it still closes one millimetre): tangential loses 0.3 * 9
    assert!((v[0] - 7.3).abs() < 1e-12, "{}", v[0]);
}

#[test]
fn what_a_node_loses_the_wall_gets_and_a_light_wall_counts_the_mass_on_it() {
    let touches = Constraint { walls: 1, ..Constraint::default() };
    let motion = Motion::Free { mass: 100.0, velocity: [0.0; 3] };
    let wall = RigidWall { shape: FLOOR, motion, friction: 0.3, parts: vec![true] };
    let before = [10.0, 0.0, -10.0];
    let (_, v, _, votes) = loaded_one(before, [0.0; 3], touches, &[wall], &Loads::default());
    for a in 0..3 {
        assert!((votes[0].impulse[a] - 2.0 * (before[a] - v[a])).abs() < 1e-9, "{:?}", votes[0]);
    }
    assert_eq!(votes[0].touched, 2.0);
}

#[test]
fn a_strike_within_three_steps_is_foreseen_with_the_speed_of_the_node_against_the_wall() {
    let touches = Constraint { walls: 1, ..Constraint::default() };
    let fixed = RigidWall { shape: FLOOR, motion: Motion::Fixed, friction: 0.0, parts: vec![true] };
    let closing = |v: [f64; 3], f: [f64; 3]| {
        loaded_one(v, f, touches, std::slice::from_ref(&fixed), &Loads::default()).2.closing
    };
    // The node is a thousandth above the wall, and a step is a thousandth long.
    assert_eq!(closing([9.0, 0.0, -10.0], [0.0; 3]), 10.0, "it strikes now");
    assert_eq!(closing([9.0, 0.0, -0.4], [0.0; 3]), 0.4, "it strikes within three steps");
    assert_eq!(closing([9.0, 0.0, -0.3], [0.0; 3]), 0.0, "it is too far away");
    assert_eq!(closing([9.0, 0.0, 10.0], [0.0; 3]), 0.0, "it leaves");
    assert_eq!(closing([0.0; 3], [0.0, 0.0, -1e5]), 0.0, "it is pressed, not fast");
    let free = Constraint::default();
    let (_, _, booked, _) = loaded_one([0.0, 0.0, -10.0], [0.0; 3], free, &[fixed], &Loads::default());
    assert_eq!(booked.closing, 0.0, "it does not feel the wall");
}

#[test]
fn gravity_relaxation_and_nodal_force_change_the_velocity_and_book_their_work() {
    let curves = vec![Curve { points: vec![[0.0, 0.0], [1.0, 2.0]] }];
    let drive = Drive::along(0, 3.0);
    let force = NodalForce { force: [8.0, 0.0, 0.0], by_mass: false, drive: Drive::along(0, 1.0) };
    let loads = Loads {
        curves,
        forces: vec![force],
        gravity: Some(Gravity { acceleration: [0.0, 0.0, -10.0], drive }),
        surfaces: Vec::new(),
        charges: Vec::new(),
        moving: Vec::new(),
        relaxation: Some(Relaxation { factor: 0.9, rate: 0.0, until: 0.6 }),
    };
    let pushed = Constraint { forces: 1, ..Constraint::default() };
    let run = |loads| loaded_one([1.0, 2.0, 0.0], [0.0; 3], pushed, &[], loads);
    // At 0.5 the curve is 1; a step of 1e-3, mass 2: 8/2 e-3 along x, -30e-3 along z.
    let (_, v, booked, _) = run(&loads);
    let expected: [f64; 3] = [0.9 + 4e-3, 1.8, -30e-3];
    assert!((0..3).all(|a| (v[a] - expected[a]).abs() < 1e-15), "{v:?}");
    let energy = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>();
    assert!(
        (booked.external.whole() - (energy(v) - energy([1.0, 2.0, 0.0]))).abs() < 1e-9,
        "{:?}",
        booked.external
    );
    let late = Loads { relaxation: Some(Relaxation { factor: 0.9, rate: 0.0, until: 0.5 }), ..loads.clone() };
    assert!((run(&late).1[1] - 2.0).abs() < 1e-15, "relaxation is over");
    // exp(-0.1) is 0.904837.
    let by_rate =
        Loads { relaxation: Some(Relaxation { factor: 1.0, rate: 100.0, until: 0.6 }), ..loads.clone() };
    assert!((run(&by_rate).1[1] - 2.0 * 0.95 / 1.05).abs() < 1e-15, "{:?}", run(&by_rate).1);
    assert!((by_rate.loss(0.5, 1.0) - 1.0).abs() < 1e-15, "it stops, and does not turn around");
}

#[test]
fn every_width_gives_the_same_bits_whatever_holds_the_nodes() {
    let n = 21;
    let mut seed = 5_u64;
    let mut numbers = |n: usize, low: f64, high: f64| -> Vec<f64> {
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..n).map(|_| draw()).collect()
    };
    let padded = usize::next_multiple_of(n, SET);
    let mut vectors = |size: f64| -> [Vec<f64>; 3] { [0; 3].map(|_| numbers(padded, -size, size)) };
    let (x, v, f, reference) = (vectors(1e-3), vectors(10.0), vectors(1e4), vectors(1e-3));
    let mass = numbers(padded, 1.0, 2.0);
    let constraint: Vec<u16> = (0..n as u16).map(|i| [0, 3, 1, 0, 2][i as usize % 5]).collect();
    let mut sets = NodeSet::all(&constraint);
    for (i, set) in (0..n).map(|i| (i, i / SET)).filter(|(i, _)| i % 3 != 1) {
        sets[set].booked |= 1 << (i % SET);
        sets[set].strikes |= sets[set].held & 1 << (i % SET);
        if !(8..=17).contains(&i) {
            sets[set].surface |= 1 << (i % SET);
        }
    }
    let quantum = Quantum::for_reference(1e6, 46);
    let constraints = [
        Constraint::default(),
        Constraint {
            velocity: [Some(Drive::constant(1.0)), None, Some(Drive::constant(0.0))],
            ..Constraint::default()
        },
        Constraint { walls: 1, forces: 1, ..Constraint::default() },
        Constraint { walls: 2, ..Constraint::default() },
    ];
    let motion = Motion::Free { mass: 50.0, velocity: [0.0; 3] };
    let wall = RigidWall { shape: FLOOR, motion, friction: 0.2, parts: vec![true] };
    // Felt by none but neighbours of those that feel the floor.
    let beside = Shape::Plane { point: [-1e-4, 0.0, 0.0], normal: [1.0, 0.0, 0.0] };
    let beside = RigidWall { shape: beside, motion: Motion::Fixed, friction: 0.0, parts: vec![true] };
    let loads = Loads {
        forces: vec![NodalForce { force: [1e3, 0.0, 5e2], by_mass: false, drive: Drive::constant(1.0) }],
        gravity: Some(Gravity { acceleration: [0.0, 3.0, -10.0], drive: Drive::constant(1.0) }),
        relaxation: Some(Relaxation { factor: 0.95, rate: 3.0, until: 1.0 }),
        ..Loads::default()
    };
    let advance = Advance {
        step: TimeStep {
            dt_previous: 1e-4,
            dt: 1.1e-4,
            time: 0.0,
            cycle: 3,
            loads: &loads,
            quanta: Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 },
        },
        constraints: &constraints,
        walls: &[wall, beside],
        poses: &[Pose::default(); 2],
    };
    let run = |width: Width| {
        let (mut x, mut v, mut f) = (x.clone(), v.clone(), f.clone());
        let mut votes = [WallVote::default(); 2];
        let mut nodes = Nodes {
            x: &mut x,
            v: &mut v,
            f: &mut f,
            mass: &mass,
            constraint: &constraint,
            sets: &sets,
            reference: &reference,
            walls: &mut votes,
        };
        let booked = advance.run(&mut nodes, width);
        assert!(booked.external != Work::default() && booked.speed_ahead > booked.speed_squared.sqrt());
        let bits: Vec<u64> = x.iter().chain(&v).flatten().map(|c| c.to_bits()).collect();
        assert!(votes[0].touched > 0.0 && booked.closing > 0.0);
        (booked, votes, bits)
    };
    let reference = run(Width::Scalar);
    for width in Width::ALL.into_iter().filter(|width| width.available()) {
        assert_eq!(run(width), reference, "{width}");
    }
}

/// A mass on a spring under gravity, whose steps grow by 5 % and are cut to a tenth at the end.
#[test]
fn energy_is_kept_where_the_time_step_changes() {
    let (mass, stiffness, g) = (2.0, 50.0, -9.81);
    let omega = f64::sqrt(stiffness / mass);
    let loads = Loads {
        gravity: Some(Gravity { acceleration: [0.0, 0.0, g], drive: Drive::constant(1.0) }),
        ..Loads::default()
    };
    let q = Quantum::for_reference(1e3, 46);
    let mut nodes = ([0, 1, 2].map(|_| vec![0.0; SET]), [0, 1, 2].map(|_| vec![0.0; SET]));
    nodes.1[2][0] = 1.0;
    let masses = [mass; SET];
    let mut steps: Vec<f64> = (0..60).map(|n| 0.005 / omega * 1.05_f64.powi(n)).collect();
    steps.push(0.1 * steps[59]);
    steps.push(steps[60]);
    let (mut dt_previous, mut time, mut ahead, mut external, mut worst) = (0.0, 0.0, 0.0, 0.0, 0.0_f64);
    let [x, v] = [&mut nodes.0, &mut nodes.1];
    for (cycle, &dt) in (0..).zip(&steps) {
        let at = x[2][0];
        let mut f = [0, 1, 2].map(|_| vec![0.0; SET]);
        f[2][0] = -stiffness * at;
        let advance = Advance {
            step: TimeStep {
                dt_previous,
                dt,
                time,
                cycle,
                loads: &loads,
                quanta: Quanta { force: q, energy: q, momentum: q, arm: 1.0 },
            },
            constraints: &[Constraint::default()],
            walls: &[],
            poses: &[],
        };
        let sets = [NodeSet { booked: 1, ..NodeSet::default() }];
        let booked = advance.run(
            &mut Nodes {
                x,
                v,
                f: &mut f,
                mass: &masses,
                constraint: &[0; SET],
                sets: &sets,
                reference: &[const { Vec::new() }; 3],
                walls: &mut [],
            },
            Width::Scalar,
        );
        external += ahead + booked.external.before;
        ahead = booked.external.after;
        let gained = 0.5 * stiffness * at * at + booked.kinetic - external - 0.5 * mass;
        worst = worst.max(gained.abs());
        (time, dt_previous) = (time + dt, dt);
    }
    // With `1/2 m v_{n-1/2} . v_{n+1/2}` for the kinetic energy it is 0.115.
    assert!(worst < 2e-3, "{worst} of 1");
}
