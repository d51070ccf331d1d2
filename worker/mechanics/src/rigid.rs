//! Rigid bodies: parts whose nodes move as one, or nodes alone.
//!
//! A body is a mass, an inertia and a [`State`]: centre, velocity, attitude, angular momentum. Its nodes sit at fixed
//! places in its frame, which at the start of a run is that of the deck moved to the centre. What pushes nodes - contact,
//! elements that share them, loads on faces - is added up as a [`Push`], an exact sum of integers, so that the order of
//! nodes, blocks and workers does not matter. Every worker holds every body and moves it by the same push; nodes follow.
//!
//! Angular momentum is kept in axes that do not turn, so torque alone changes it. The angular velocity of a step is that
//! of the attitude in its middle, `I(R_{n+1/2}) omega = L_{n+1/2}`, which is symmetric in time: energy does not drift.

use serde::{Deserialize, Serialize};

use crate::{
    constraint::{Circle, Constraint},
    exact::{Quanta, Quantum},
    load::Drive,
    time_step::TimeStep,
    vectors::{cross, dot, turn, turned},
    work::Work,
};

pub mod shape;
pub mod switch;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Its parts, by index, ascending; none of a body of nodes alone.
    pub parts: Vec<u32>,
    /// The part whose energies hold those of the body.
    pub account: u32,
    /// Mass, that of elements which share nodes with it included as far as they hang on these.
    pub mass: f64,
    /// Inertia about the centre in the frame of the body: xx, yy, zz, xy, yz, zx.
    pub inertia: [f64; 6],
    /// Prescribed velocity of the centre by axis (length per time).
    pub velocity: [Option<Drive>; 3],
    /// Prescribed angular velocity about axes through the centre that do not turn (radians per time).
    pub spin: [Option<Drive>; 3],
    /// A circle that the centre follows while the body turns as fast about its axis.
    pub circle: Option<Circle>,
    /// As it begins.
    pub start: State,
    /// Global node indices of its nodes, ascending.
    pub nodes: Vec<u32>,
    /// Where each of them is in the frame of the body (length).
    pub places: Vec<[f64; 3]>,
    /// What its nodes weigh over what its elements say: 1 unless the deck gives the mass.
    pub nodal_scale: f64,
    /// The quantum of arms: `2^-50` of the longest, or of what the inertia that its nodes have of their own is as an arm if that is longer.
    pub length: Quantum,
    /// Least Courant limit of its elements at rest (time) and the global index of the element that has it: of a body of a
    /// problem in which nothing deforms; else none.
    pub courant: Option<(f64, u32)>,
    /// Nodal forces: index into `places` and into [`crate::load::Loads::forces`].
    pub forces: Vec<(u32, u32)>,
    /// Forces by mass, each of all the nodes that feel it.
    pub pulls: Vec<Pull>,
}

/// A force by mass on some of the nodes of a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pull {
    /// Index into [`crate::load::Loads::forces`].
    pub load: u32,
    /// Mass that feels it.
    pub mass: f64,
    /// Centre of that mass in the frame of the body.
    pub place: [f64; 3],
}

/// Where a body is and how it moves, at the start of cycle `n`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Centre of mass at `t_n` (length).
    pub centre: [f64; 3],
    /// Its velocity at `n - 1/2` (length per time).
    pub velocity: [f64; 3],
    /// Attitude at `t_n`: unit quaternion w, x, y, z that turns the frame of the body into the axes of space.
    pub attitude: [f64; 4],
    /// Angular momentum about the centre at `n - 1/2`, in the axes of space.
    pub momentum: [f64; 3],
    /// Angular velocity at `n - 1/2`, in the axes of space (radians per time).
    pub spin: [f64; 3],
}

impl State {
    /// Whether all its numbers are such.
    pub fn is_finite(&self) -> bool {
        [self.centre, self.velocity, self.momentum, self.spin].iter().flatten().all(|c| c.is_finite())
            && self.attitude.iter().all(|c| c.is_finite())
    }

    /// From the centre to a place of the body.
    pub fn arm(&self, place: [f64; 3]) -> [f64; 3] {
        turned(&self.attitude, place)
    }

    /// How fast a place of the body moves.
    pub fn velocity_at(&self, place: [f64; 3]) -> [f64; 3] {
        let turning = cross(self.spin, self.arm(place));
        std::array::from_fn(|a| self.velocity[a] + turning[a])
    }

    /// Where a place of the body is now.
    pub fn at(&self, place: [f64; 3]) -> [f64; 3] {
        let arm = self.arm(place);
        std::array::from_fn(|a| self.centre[a] + arm[a])
    }
}

/// Numbers of one body in a packed array of pushes: limbs of force and torque.
pub const PUSH: usize = 18;
/// Entries of an exchange, of three numbers each, that carry the push on a body.
pub const ENTRIES: u32 = PUSH as u32 / 3;

/// The entries of an exchange that stand for the pushes on `n` bodies: numbers above those of all nodes, in the order of
/// the bodies.
pub fn entries(n: usize) -> std::ops::Range<u32> {
    u32::MAX - ENTRIES * n as u32..u32::MAX
}

/// Force on a body and torque about its centre, in integers: multiples of the quantum of forces, and of that times the
/// body's quantum of lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Push {
    pub force: [i128; 3],
    pub torque: [i128; 3],
}

/// Bits of the lower limbs of an integer that travels.
const LIMB: u32 = 40;

impl Push {
    /// Adds a force, a sum of multiples of `force`, at `arm` from the centre.
    pub fn add(&mut self, f: [f64; 3], arm: [f64; 3], force: Quantum, length: Quantum) {
        let f = f.map(|c| (c / force.value()) as i128);
        let r = arm.map(|c| (c / length.value()).round() as i128);
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            self.force[a] += f[a];
            self.torque[a] += r[b] * f[c] - r[c] * f[b];
        }
    }

    /// Adds a moment, a sum of multiples of `force` times a power of two that is more than `length`.
    pub fn add_moment(&mut self, m: [f64; 3], force: Quantum, length: Quantum) {
        for a in 0..3 {
            self.torque[a] += (m[a] / force.value() / length.value()) as i128;
        }
    }

    /// Adds another sum.
    pub fn join(&mut self, other: &Self) {
        for a in 0..3 {
            self.force[a] += other.force[a];
            self.torque[a] += other.torque[a];
        }
    }

    /// As numbers that add up exactly whatever their order, if no more than 64 are added.
    pub fn pack(&self) -> [f64; PUSH] {
        let mut out = [0.0; PUSH];
        let low = (1_i128 << LIMB) - 1;
        for (value, limbs) in self.force.iter().chain(&self.torque).zip(out.chunks_exact_mut(3)) {
            limbs[0] = (value & low) as f64;
            limbs[1] = (value >> LIMB & low) as f64;
            limbs[2] = (value >> (2 * LIMB)) as f64;
        }
        out
    }

    /// What was packed, or a sum of such.
    ///
    /// # Panics
    /// If there are fewer than [`PUSH`] numbers.
    pub fn unpack(limbs: &[f64]) -> Self {
        let value = |i: usize| {
            let limb = |k: usize| limbs[3 * i + k] as i128;
            limb(0).wrapping_add(limb(1) << LIMB).wrapping_add(limb(2).wrapping_shl(2 * LIMB))
        };
        Self { force: std::array::from_fn(value), torque: std::array::from_fn(|a| value(3 + a)) }
    }
}

/// What a body says of a step, each number rounded to its quantum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// Kinetic energy at `t_n`, see [`crate::work`], and that of the turning.
    pub kinetic: f64,
    /// Work of gravity, relaxation, nodal forces and whatever prescribes its motion.
    pub external: Work,
    /// `m v_n`.
    pub momentum: [f64; 3],
}

/// What gives a body a push at once: momentum, and angular momentum about its centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impulse {
    pub linear: [f64; 3],
    pub angular: [f64; 3],
}

impl Impulse {
    /// Adds a multiple of another.
    pub fn add(&mut self, factor: f64, other: &Self) {
        for a in 0..3 {
            self.linear[a] += factor * other.linear[a];
            self.angular[a] += factor * other.angular[a];
        }
    }

    /// The work that it does on a motion, with the other as linear and angular velocity.
    pub fn dot(&self, other: &Self) -> f64 {
        dot(self.linear, other.linear) + dot(self.angular, other.angular)
    }
}

/// How a body that no joint holds would move at `n + 1/2`.
#[derive(Clone, Copy, Debug)]
pub struct Free {
    /// Velocity and angular momentum by what pushes its nodes alone.
    pushed: [f64; 3],
    twisted: [f64; 3],
    /// The same with nodal forces, gravity and relaxation.
    velocity: [f64; 3],
    momentum: [f64; 3],
}

/// What of the motion of a body is prescribed in a step.
struct Prescribed {
    velocity: [Option<f64>; 3],
    spin: [Option<f64>; 3],
}

impl TimeStep<'_> {
    /// What a push, loads and the past make of a body.
    pub fn free(&self, body: &Body, push: &Push, state: &State) -> Free {
        let half_steps = self.half_steps();
        let force_quantum = self.quanta.force.value();
        let torque_quantum = force_quantum * body.length.value();
        let pushed: [f64; 3] = std::array::from_fn(|a| {
            state.velocity[a] + push.force[a] as f64 * force_quantum / body.mass * half_steps
        });
        let twisted: [f64; 3] =
            std::array::from_fn(|a| state.momentum[a] + push.torque[a] as f64 * torque_quantum * half_steps);
        let (mut velocity, mut momentum) = (pushed, twisted);
        let mut give = |impulse: [f64; 3], place: [f64; 3]| {
            let moment = cross(turned(&state.attitude, place), impulse);
            for a in 0..3 {
                velocity[a] += impulse[a] / body.mass;
                momentum[a] += moment[a];
            }
        };
        for &(node, load) in &body.forces {
            let load = &self.loads.forces[load as usize];
            let scale = half_steps * self.mean(&load.drive);
            give(load.force.map(|f| f * scale), body.places[node as usize]);
        }
        for pull in &body.pulls {
            let load = &self.loads.forces[pull.load as usize];
            let scale = half_steps * self.mean(&load.drive) * pull.mass;
            give(load.force.map(|f| f * scale), pull.place);
        }
        if let Some(gravity) = self.loads.gravity {
            let scale = half_steps * self.mean(&gravity.drive);
            (0..3).for_each(|a| velocity[a] += gravity.acceleration[a] * scale);
        }
        let loss = self.loss();
        if loss != 0.0 {
            for a in 0..3 {
                velocity[a] -= loss * state.velocity[a];
                momentum[a] -= loss * state.momentum[a];
            }
        }
        Free { pushed, twisted, velocity, momentum }
    }

    fn prescribed(&self, body: &Body, state: &State) -> Prescribed {
        let curves = &self.loads.curves;
        let of = |drive: Drive| drive.prescribed_for(curves, self.time, self.dt);
        let mut spin = body.spin.map(|drive| of(drive?));
        let motion = Constraint { velocity: body.velocity, circle: body.circle, ..Constraint::default() };
        if let Some(Circle { axis, rate, .. }) = body.circle {
            let axis = usize::from(axis);
            spin[axis] = of(rate).or(spin[axis]);
        }
        Prescribed { velocity: motion.prescribed(curves, state.centre, self.time, self.dt), spin }
    }

    /// Where a body is at `t_{n+1}` after joints gave it an impulse.
    pub fn moved(&self, body: &Body, free: &Free, impulse: &Impulse, state: &State) -> State {
        let prescribed = self.prescribed(body, state);
        let velocity: [f64; 3] = std::array::from_fn(|a| {
            prescribed.velocity[a].unwrap_or(free.velocity[a] + impulse.linear[a] / body.mass)
        });
        let momentum = std::array::from_fn(|a| free.momentum[a] + impulse.angular[a]);
        let (spin, momentum) = body.spin_of(&state.attitude, momentum, prescribed.spin, state.spin, self.dt);
        State {
            centre: std::array::from_fn(|a| state.centre[a] + velocity[a] * self.dt),
            velocity,
            attitude: turn(&state.attitude, spin, self.dt),
            momentum,
            spin,
        }
    }

    /// The velocities that an impulse adds at `t_n`: none along and about axes whose motion is prescribed.
    pub fn answer(&self, body: &Body, state: &State, impulse: &Impulse) -> Impulse {
        let prescribed = self.prescribed(body, state);
        let linear = std::array::from_fn(|a| match prescribed.velocity[a] {
            Some(_) => 0.0,
            None => impulse.linear[a] / body.mass,
        });
        let (mut rows, mut right) = (body.inertia_at(&state.attitude), impulse.angular);
        for axis in (0..3).filter(|&axis| prescribed.spin[axis].is_some()) {
            rows[axis] = std::array::from_fn(|b| if b == axis { 1.0 } else { 0.0 });
            right[axis] = 0.0;
        }
        Impulse { linear, angular: solve(rows, right) }
    }

    /// What a body says of its step from `old` to `new`. What joints gave it is booked nowhere: they give as much to the other body.
    pub fn booked(&self, body: &Body, free: &Free, impulse: &Impulse, old: &State, new: &State) -> Booked {
        let Quanta { energy, momentum: of_momentum, .. } = self.quanta;
        let (velocity, momentum) = (new.velocity, new.momentum);
        let share = self.share_before();
        // As of nodes, see `crate::work`.
        let at_share = |old: f64, between: f64| (2.0 * share).mul_add(between - old, old);
        let translation = at_share(dot(old.velocity, old.velocity), dot(old.velocity, velocity));
        let turning = 0.5 * (dot(old.spin, momentum) + dot(new.spin, old.momentum));
        let rotation = at_share(dot(old.spin, old.momentum), turning);
        let kinetic = 0.5 * body.mass.mul_add(translation, rotation);
        let carried = |a: usize| body.mass * (velocity[a] - old.velocity[a]).mul_add(share, old.velocity[a]);
        let work = |with_velocity: [f64; 3], with_spin: [f64; 3]| {
            let along = |a: usize| {
                let pushed = free.pushed[a] + impulse.linear[a] / body.mass;
                body.mass * (velocity[a] - pushed) * with_velocity[a]
            };
            let about = |a: usize| (momentum[a] - (free.twisted[a] + impulse.angular[a])) * with_spin[a];
            (0..3).map(|a| along(a) + about(a)).sum::<f64>()
        };
        let products = [work(old.velocity, old.spin), work(velocity, new.spin)];
        Booked {
            kinetic: energy.round(kinetic),
            external: Work::of(products, share, self.dithered()),
            momentum: [0, 1, 2].map(|a| of_momentum.round(carried(a))),
        }
    }
}

/// Most rounds of the search for the angular velocity; each gains as many digits as the body turns little in a step.
const ROUNDS: usize = 30;

impl Body {
    /// At least the longest arm of its nodes, and less than four times that or what stands for it, see [`Body::length`] (length).
    pub fn reach(&self) -> f64 {
        self.length.value() * (1_u64 << 50) as f64
    }

    /// Angular velocity and momentum in the middle of a step. Of both, one is given for each axis: `prescribed`, or
    /// `momentum`; the search begins at `guess`.
    fn spin_of(
        &self,
        attitude: &[f64; 4],
        momentum: [f64; 3],
        prescribed: [Option<f64>; 3],
        guess: [f64; 3],
        dt: f64,
    ) -> ([f64; 3], [f64; 3]) {
        let mut spin = guess;
        let mut inertia = [[0.0; 3]; 3];
        for _ in 0..ROUNDS {
            inertia = self.inertia_at(&turn(attitude, spin, 0.5 * dt));
            let mut rows = inertia;
            let mut right = momentum;
            for (axis, given) in prescribed.iter().enumerate() {
                if let Some(given) = *given {
                    rows[axis] = std::array::from_fn(|b| if b == axis { 1.0 } else { 0.0 });
                    right[axis] = given;
                }
            }
            let next = solve(rows, right);
            if next == spin {
                break;
            }
            spin = next;
        }
        let mut momentum = momentum;
        for axis in (0..3).filter(|&axis| prescribed[axis].is_some()) {
            momentum[axis] = dot(inertia[axis], spin);
        }
        (spin, momentum)
    }

    /// Inertia about the centre in the axes of space.
    fn inertia_at(&self, attitude: &[f64; 4]) -> [[f64; 3]; 3] {
        // Rows are the axes of the body.
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| turned(attitude, axis));
        let own = full(&self.inertia);
        let mut out = [[0.0; 3]; 3];
        for (i, row) in out.iter_mut().enumerate() {
            for (j, cell) in row.iter_mut().enumerate() {
                for k in 0..3 {
                    for l in 0..3 {
                        *cell += axes[k][i] * own[k][l] * axes[l][j];
                    }
                }
            }
        }
        out
    }
}

/// The whole matrix of xx, yy, zz, xy, yz, zx.
fn full(&[xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> [[f64; 3]; 3] {
    [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
}

/// Solves three equations without exchanging rows: those of an inertia are dominated by their diagonal minors, those of
/// prescribed components are rows of unity.
fn solve(mut rows: [[f64; 3]; 3], mut right: [f64; 3]) -> [f64; 3] {
    for i in 0..3 {
        for j in i + 1..3 {
            let factor = rows[j][i] / rows[i][i];
            let above = rows[i];
            (i..3).for_each(|k| rows[j][k] -= factor * above[k]);
            right[j] -= factor * right[i];
        }
    }
    let mut x = [0.0; 3];
    for i in (0..3).rev() {
        let known: f64 = (i + 1..3).map(|k| rows[i][k] * x[k]).sum();
        x[i] = (right[i] - known) / rows[i][i];
    }
    x
}

#[cfg(test)]
mod tests;
