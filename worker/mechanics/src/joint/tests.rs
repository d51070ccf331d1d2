use super::*;
use crate::{
    exact::{Quanta, Quantum},
    load::{Curve, Drive, Gravity, Loads},
    rigid::Push,
};

const DT: f64 = 1e-3;
const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A body with its centre at a point: mass and principal inertias.
fn body(centre: [f64; 3], mass: f64, [xx, yy, zz]: [f64; 3], spin: [f64; 3]) -> Body {
    let momentum = [xx * spin[0], yy * spin[1], zz * spin[2]];
    Body {
        parts: Vec::new(),
        account: 0,
        mass,
        inertia: [xx, yy, zz, 0.0, 0.0, 0.0],
        velocity: [None; 3],
        spin: [None; 3],
        circle: None,
        start: State { centre, velocity: [0.0; 3], attitude: IDENTITY, momentum, spin },
        nodes: Vec::new(),
        places: Vec::new(),
        nodal_scale: 1.0,
        length: Quantum::for_reference(1.0, 50),
        courant: None,
        forces: Vec::new(),
        pulls: Vec::new(),
    }
}

/// A joint of two bodies, or of one and space, at a point with three axes.
fn joint(kind: Kind, of: [Option<u32>; 2], bodies: &[Body], point: [f64; 3], axes: [[f64; 3]; 3]) -> Joint {
    let end = |body: Option<u32>| {
        let centre = body.map_or([0.0; 3], |b| bodies[b as usize].start.centre);
        End { body, place: std::array::from_fn(|a| point[a] - centre[a]), axes }
    };
    Joint { kind, ends: of.map(end) }
}

/// A mechanism under way.
struct World {
    bodies: Vec<Body>,
    joints: Vec<Joint>,
    states: Vec<State>,
    loads: Loads,
    time: f64,
    votes: Vec<JointVote>,
    kinetic: f64,
    external: f64,
}

impl World {
    fn new(bodies: Vec<Body>, joints: Vec<Joint>) -> Self {
        let states = bodies.iter().map(|body| body.start).collect();
        let (loads, votes) = (Loads::default(), Vec::new());
        Self { bodies, joints, states, loads, time: 0.0, votes, kinetic: 0.0, external: 0.0 }
    }

    fn under_gravity(mut self, acceleration: [f64; 3]) -> Self {
        self.loads.gravity = Some(Gravity { acceleration, drive: Drive::constant(1.0) });
        self
    }

    /// Goes so many steps of [`DT`] on.
    fn go(&mut self, steps: usize) {
        let mechanism = Mechanism::of(&self.joints, self.bodies.len());
        let fine = Quantum::for_reference(1.0, 60);
        for _ in 0..steps {
            let dt_previous = if self.time == 0.0 { 0.0 } else { DT };
            let quanta = Quanta { force: fine, energy: fine, momentum: fine, arm: 1.0 };
            let step =
                TimeStep { dt_previous, dt: DT, time: self.time, cycle: 0, loads: &self.loads, quanta };
            let free = |(body, state)| step.free(body, &Push::default(), state);
            let free: Vec<Free> = self.bodies.iter().zip(&self.states).map(free).collect();
            let moving = Moving { step: &step, bodies: &self.bodies, states: &self.states, free: &free };
            let (impulses, votes) = mechanism.hold(&self.joints, &moving);
            self.kinetic = 0.0;
            let old = self.states.clone();
            for (b, body) in self.bodies.iter().enumerate() {
                self.states[b] = step.moved(body, &free[b], &impulses[b], &old[b]);
                let booked = step.booked(body, &free[b], &impulses[b], &old[b], &self.states[b]);
                self.kinetic += booked.kinetic;
                self.external += booked.external.before + booked.external.after;
            }
            self.votes = votes;
            self.time += DT;
        }
    }

    fn apart(&self) -> f64 {
        self.votes.iter().map(|vote| vote.apart).fold(0.0, f64::max)
    }
}

/// A rod of length 1 m and mass 1 kg that hangs from its end at the origin, out of plumb by an angle in the plane of x and z.
fn pendulum(angle: f64, kind: Kind) -> World {
    let centre = [0.5 * angle.sin(), 0.0, -0.5 * angle.cos()];
    let rod = body(centre, 1.0, [1.0 / 12.0, 1.0 / 12.0, 1e-3], [0.0; 3]);
    let axes = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    let bodies = vec![rod];
    let hinge = joint(kind, [Some(0), None], &bodies, [0.0; 3], axes);
    World::new(bodies, vec![hinge]).under_gravity([0.0, 0.0, -9.81])
}

/// Period of a rod that hangs from its end: `2 pi sqrt(2 l / 3 g) / agm(1, cos(angle / 2))`.
fn period(angle: f64) -> f64 {
    let (mut a, mut b) = (1.0_f64, (0.5 * angle).cos());
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    2.0 * std::f64::consts::PI * (2.0_f64 / (3.0 * 9.81)).sqrt() / a
}

#[test]
fn a_rod_on_a_hinge_swings_with_the_period_of_its_amplitude() {
    for kind in [Kind::Revolute, Kind::Spherical] {
        for angle in [0.05, 1.0, 2.5] {
            let mut world = pendulum(angle, kind);
            // Passages through the plumb, between which half a period goes by.
            let (mut passages, mut x) = (Vec::new(), world.states[0].centre[0]);
            while passages.len() < 11 {
                world.go(1);
                let now = world.states[0].centre[0];
                if now * x < 0.0 {
                    passages.push(world.time - DT * now / (now - x));
                }
                x = now;
                assert!(world.apart() < 1e-13, "{kind:?}, {angle}: {}", world.apart());
            }
            let measured = (passages[10] - passages[0]) / 5.0;
            let error = (measured / period(angle) - 1.0).abs();
            assert!(error < 3e-6, "{kind:?}, {angle}: {measured} for {}", period(angle));
        }
    }
}

#[test]
fn a_hanging_rod_gives_its_hinge_its_weight() {
    let mut world = pendulum(0.0, Kind::Revolute);
    world.go(3);
    let JointVote { force, moment, .. } = world.votes[0];
    assert!((force[2] + 9.81).abs() < 1e-9 && force[0].abs() < 1e-12, "{force:?}");
    assert!(moment.iter().all(|m| m.abs() < 1e-9), "{moment:?}");
}

#[test]
fn bodies_on_joints_keep_momentum_its_moment_and_energy() {
    use Kind::*;
    for kind in [Spherical, Universal, Revolute, Cylindrical, Translational, Planar, Fixed] {
        let bodies = vec![
            body([-0.3, 0.1, 0.0], 2.0, [0.05, 0.11, 0.08], [0.0; 3]),
            body([0.4, 0.0, -0.2], 1.3, [0.07, 0.02, 0.06], [0.0; 3]),
        ];
        let lean = 1.0 / 3.0_f64.sqrt();
        let first = [lean; 3];
        let second = [0.5_f64.sqrt(), -(0.5_f64.sqrt()), 0.0];
        let axes = [first, second, cross(first, second)];
        let held = joint(kind, [Some(0), Some(1)], &bodies, [0.05, 0.02, 0.03], axes);
        let mut world = World::new(bodies, vec![held]);
        // Both turn as one about the common centre, faster about z, and the second has what the joint leaves free.
        let spin = [0.7, -1.1, 2.3];
        let free_spin = match kind {
            Revolute | Cylindrical | Planar => first.map(|c| 3.0 * c),
            Spherical => [1.0, 2.0, -2.0],
            _ => [0.0; 3],
        };
        for (b, state) in world.states.iter_mut().enumerate() {
            let own = if b == 1 { free_spin } else { [0.0; 3] };
            state.spin = std::array::from_fn(|a| spin[a] + own[a]);
            let about_joint = cross(own, std::array::from_fn(|a| state.centre[a] - [0.05, 0.02, 0.03][a]));
            let orbit = cross(spin, state.centre);
            state.velocity = std::array::from_fn(|a| orbit[a] + about_joint[a]);
            let [xx, yy, zz, ..] = world.bodies[b].inertia;
            state.momentum = [xx * state.spin[0], yy * state.spin[1], zz * state.spin[2]];
        }
        let sums = |world: &World| {
            let (mut linear, mut angular) = ([0.0; 3], [0.0; 3]);
            for (body, state) in world.bodies.iter().zip(&world.states) {
                let p = state.velocity.map(|v| body.mass * v);
                // Where the centre is half a step before, when it has this velocity.
                let at = std::array::from_fn(|a| state.centre[a] - 0.5 * DT * state.velocity[a]);
                let orbit = cross(at, p);
                for a in 0..3 {
                    linear[a] += p[a];
                    angular[a] += orbit[a] + state.momentum[a];
                }
            }
            (linear, angular)
        };
        world.go(1);
        let ((linear, angular), kinetic) = (sums(&world), world.kinetic);
        let mut spread: f64 = 0.0;
        for _ in 0..5 {
            world.go(500);
            let (l, a) = sums(&world);
            for axis in 0..3 {
                assert!((l[axis] - linear[axis]).abs() < 1e-11, "{kind:?} {l:?} {linear:?}");
                assert!((a[axis] - angular[axis]).abs() < 1e-5, "{kind:?} {a:?} {angular:?}");
            }
            assert!(world.apart() < 1e-12, "{kind:?} {}", world.apart());
            spread = spread.max((world.kinetic / kinetic - 1.0).abs());
        }
        assert!(spread < 1e-4, "{kind:?}: kinetic energy by {spread}");
    }
}

#[test]
fn a_closed_frame_of_four_hinges_moves_though_its_rows_say_the_same_twice() {
    // A parallelogram: two cranks of 0.3 m on the ground, 1 m apart, and a coupler. Its four hinges are parallel, so twenty rows take
    // seventeen of eighteen freedoms.
    let axes = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let crank = |x| body([x, 0.15, 0.0], 0.5, [4e-3, 1e-4, 4e-3], [0.0, 0.0, 1.0]);
    let coupler = body([0.5, 0.3, 0.0], 1.0, [1e-3, 0.09, 0.09], [0.0; 3]);
    let mut bodies = vec![crank(0.0), crank(1.0), coupler];
    for (b, speed) in [(0, -0.15), (1, -0.15), (2, -0.3)] {
        bodies[b].start.velocity = [speed, 0.0, 0.0];
    }
    let hinge = |of, point| joint(Kind::Revolute, of, &bodies, point, axes);
    let joints = vec![
        hinge([Some(0), None], [0.0, 0.0, 0.0]),
        hinge([Some(1), None], [1.0, 0.0, 0.0]),
        hinge([Some(0), Some(2)], [0.0, 0.3, 0.0]),
        hinge([Some(1), Some(2)], [1.0, 0.3, 0.0]),
    ];
    let mut world = World::new(bodies, joints);
    let mut greatest: f64 = 0.0;
    for _ in 0..20_000 {
        world.go(1);
        greatest = greatest.max(world.apart());
    }
    // Nothing slows it: each crank has turned by 20 radians. Stretched out, even more rows say the same.
    assert!(greatest < 1e-10, "{greatest}");
    let turned_by = 20.0_f64;
    let wanted = [0.5 - 0.3 * turned_by.sin(), 0.3 * turned_by.cos(), 0.0];
    let centre = world.states[2].centre;
    let error = (0..3).map(|a| (centre[a] - wanted[a]).abs()).fold(0.0, f64::max);
    assert!(error < 1e-5, "{centre:?} for {wanted:?}");
}

#[test]
fn a_driven_crank_pays_for_what_it_moves() {
    // A crank of 0.2 m that turns at 10 rad/s moves a slider of 2 kg by a rod of 0.6 m.
    let mut crank = body([0.1, 0.0, 0.0], 0.4, [1e-4, 2e-3, 2e-3], [0.0, 0.0, 10.0]);
    let rate = Drive { curve: Some(0), ..Drive::constant(10.0) };
    crank.spin = [None, None, Some(rate)];
    crank.start.velocity = [0.0, 1.0, 0.0];
    let rod_spin = -10.0 / 3.0;
    let mut rod = body([0.5, 0.0, 0.0], 0.8, [1e-3, 0.03, 0.03], [0.0, 0.0, rod_spin]);
    rod.start.velocity = [0.0, 1.0, 0.0];
    let slider = body([0.8, 0.0, 0.0], 2.0, [0.01; 3], [0.0; 3]);
    let bodies = vec![crank, rod, slider];
    let axes = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let joints = vec![
        joint(Kind::Revolute, [Some(0), None], &bodies, [0.0; 3], axes),
        joint(Kind::Revolute, [Some(0), Some(1)], &bodies, [0.2, 0.0, 0.0], axes),
        joint(Kind::Revolute, [Some(1), Some(2)], &bodies, [0.8, 0.0, 0.0], axes),
        joint(Kind::Translational, [Some(2), None], &bodies, [0.8, 0.0, 0.0], AXES),
    ];
    let mut world = World::new(bodies, joints);
    world.loads.curves = vec![Curve { points: vec![[0.0, 1.0], [10.0, 1.0]] }];
    world.go(1);
    let start = world.kinetic;
    for step in 1..2_000 {
        world.go(1);
        // The state is half a step ahead of its energy, and a step ahead in place.
        let angle = 10.0 * world.time;
        let along = 0.2 * angle.cos() + (0.36 - (0.2 * angle.sin()).powi(2)).sqrt();
        let x = world.states[2].centre[0];
        assert!((x - along).abs() < 2e-6, "step {step}: {x} for {along}");
        assert!(world.apart() < 1e-12);
    }
    let gained = world.kinetic - start;
    assert!((world.external - gained).abs() < 0.01 * 2.0, "{} for {gained}", world.external);
}

#[test]
fn a_heavy_top_on_a_ball_goes_round_steadily() {
    // Steady precession of a symmetric top: I3 w3 p - I1 p^2 cos(tilt) = m g l (Goldstein, Classical Mechanics, 5.7).
    let (mass, arm, across, along, tilt) = (2.0, 0.1, 0.03, 0.004, 0.5_f64);
    let gravity = 9.81;
    let rate = 4.0;
    // The cross inertia is that about the ball.
    let about_ball = across + mass * arm * arm;
    let spin = (mass * gravity * arm + about_ball * rate * rate * tilt.cos()) / (along * rate);
    let axis = [tilt.sin(), 0.0, tilt.cos()];
    let centre = axis.map(|c| arm * c);
    let mut top = body(centre, mass, [1.0; 3], [0.0; 3]);
    let entry = |i: usize, j: usize| f64::from(i == j) * across + (along - across) * axis[i] * axis[j];
    top.inertia = [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(2, 0)];
    let turning: [f64; 3] =
        std::array::from_fn(|a| axis[a] * (spin - rate * tilt.cos()) + if a == 2 { rate } else { 0.0 });
    top.start.spin = turning;
    top.start.momentum = std::array::from_fn(|i| (0..3).map(|j| entry(i, j) * turning[j]).sum());
    top.start.velocity = cross([0.0, 0.0, rate], centre);
    let bodies = vec![top];
    let ball = joint(Kind::Spherical, [Some(0), None], &bodies, [0.0; 3], AXES);
    assert!(ball.parting(&bodies) < 1e-15);
    let mut world = World::new(bodies, vec![ball]).under_gravity([0.0, 0.0, -gravity]);
    for _ in 0..8 {
        world.go(200);
        let angle = rate * world.time;
        let wanted = [arm * tilt.sin() * angle.cos(), arm * tilt.sin() * angle.sin(), arm * tilt.cos()];
        let at = world.states[0].centre;
        let off = (0..3).map(|a| (at[a] - wanted[a]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-3 * arm, "at {} s: {at:?} for {wanted:?}", world.time);
    }
}
