//! Integration of nodes: central differences, forces on nodes, gravity, relaxation, prescribed velocities, rigid walls;
//! what is booked and voted.
//!
//! Every holder of a node runs this with the same mass, constraint, walls and total force, and so gets the
//! same bits. Only the owner's copy is booked. Nodes go in sets of eight on lanes; those that something moves are
//! corrected one by one, and a set without any pays nothing for it.

mod hold;
mod tally;

use crate::{
    constraint::Constraint,
    contact::Extent,
    element::vector::Vector,
    exact::rounded,
    lanes::{Lane, SET, Width, dispatch::Task},
    time_step::TimeStep,
    wall::{Pose, RigidWall, WallVote},
    work::{self, Work},
};
use tally::Tally;

/// Cycles for which a surface node's speed is foreseen by its acceleration: a vote takes effect two cycles later, and
/// forces of an impact still grow meanwhile.
const SPEED_LAG: f64 = 3.0;

/// Which of eight consecutive nodes are particular; bit `i` is the node `i` of the set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeSet {
    /// Those with a constraint.
    pub held: u8,
    /// Those whose copy books kinetic energy, momentum and work.
    pub booked: u8,
    /// Those on the contact surface, as far as this copy votes on them.
    pub surface: u8,
    /// Those that feel walls and are corners of solids which live: the step is to know when they will strike.
    pub strikes: u8,
}

impl NodeSet {
    /// The sets of nodes with these constraints; neither booked nor on the surface.
    pub fn all(constraint: &[u16]) -> Vec<NodeSet> {
        let bits = |set: &[u16]| (0..).zip(set).map(|(i, &c)| u8::from(c != 0) << i).sum();
        constraint.chunks(SET).map(|set| NodeSet { held: bits(set), ..NodeSet::default() }).collect()
    }
}

/// The nodes of a block or the ghosts of a worker, by local node index. Arrays of numbers are padded to whole sets;
/// masses of the padding are positive.
pub struct Nodes<'a> {
    /// Position `x_n`, becomes `x_{n+1}`.
    pub x: &'a mut [Vec<f64>; 3],
    /// Velocity `v_{n-1/2}`, becomes `v_{n+1/2}`.
    pub v: &'a mut [Vec<f64>; 3],
    /// Total force at `x_n`, becomes zero: that of the next cycle is added to it.
    pub f: &'a mut [Vec<f64>; 3],
    /// Nodal mass.
    pub mass: &'a [f64],
    /// Index into the setup's constraints.
    pub constraint: &'a [u16],
    /// What is particular, by set.
    pub sets: &'a [NodeSet],
    /// Positions that displacements of surface nodes are counted from: eight for each set with such a node.
    pub reference: &'a [Vec<f64>; 3],
    /// What booked nodes gave each wall and support in this step, see [`crate::setup::Setup::n_holders`]: terms are added to it.
    pub walls: &'a mut [WallVote],
}

/// One step of time for nodes.
pub struct Advance<'a> {
    /// The step itself.
    pub step: TimeStep<'a>,
    /// What acts on single nodes; entry 0 is nothing.
    pub constraints: &'a [Constraint],
    /// All walls; a node's constraint says which it feels.
    pub walls: &'a [RigidWall],
    /// Where the walls are and how they move in this step.
    pub poses: &'a [Pose],
}

/// What the nodes say of a step: exact sums over booked nodes, each term rounded to its quantum, and extremes over
/// surface nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// The kinetic energy at `t_n`, see [`crate::work`]. In the first cycle of a run `1/2 m v_0^2`.
    pub kinetic: f64,
    /// Work done on the nodes by prescribed velocities, walls, forces, gravity and relaxation.
    pub external: Work,
    /// `sum m v_n`, with `v_n` between the velocities before and after in proportion to the steps.
    pub momentum: [f64; 3],
    /// Displacements of surface nodes from the reference.
    pub extent: Extent,
    /// Greatest `|v_{n+1/2}|^2` of a surface node.
    pub speed_squared: f64,
    /// Greatest speed that a surface node may have when the vote takes effect.
    pub speed_ahead: f64,
    /// Greatest speed at which a node of solids closes in on a wall that it may strike before the vote takes effect.
    pub closing: f64,
}

/// What changes the velocity of every node: `gain - loss v`.
#[derive(Clone, Copy)]
struct Body {
    gain: [f64; 3],
    loss: f64,
}

/// The integration of nodes whose arrays have been checked.
struct Integration<'a, 'n> {
    advance: &'a Advance<'a>,
    nodes: &'a mut Nodes<'n>,
}

impl Task for Integration<'_, '_> {
    type Output = Booked;

    #[inline(always)]
    fn run<L: Lane>(self) -> Booked {
        // SAFETY: [`Advance::run`], which alone makes it, has found that the arrays hold all sets.
        unsafe { self.advance.all_sets::<L>(self.nodes) }
    }
}

impl Advance<'_> {
    /// Gravity and relaxation in this step, if there are any.
    fn body(&self) -> Option<Body> {
        let loss = self.step.loss();
        if self.step.loads.gravity.is_none() && loss == 0.0 {
            return None;
        }
        let gain = self.step.loads.gravity.map_or([0.0; 3], |gravity| {
            let scale = self.step.half_steps() * self.step.mean(&gravity.drive);
            gravity.acceleration.map(|g| g * scale)
        });
        Some(Body { gain, loss })
    }

    /// The force on a node that brings it to `target` in this step, whatever gravity and relaxation do.
    pub(crate) fn leading(&self, x: [f64; 3], v: [f64; 3], mass: f64, target: [f64; 3]) -> [f64; 3] {
        let half_steps = self.step.half_steps();
        if self.step.dt == 0.0 || half_steps == 0.0 {
            return [0.0; 3];
        }
        let Body { gain, loss } = self.body().unwrap_or(Body { gain: [0.0; 3], loss: 0.0 });
        std::array::from_fn(|a| {
            let change = (target[a] - x[a]) / self.step.dt - v[a];
            mass / half_steps * (change - (gain[a] - loss * v[a]))
        })
    }

    /// The moment on a node of shells that turns it at `target` after this step, whatever relaxation does.
    pub(crate) fn turning(&self, spin: [f64; 3], inertia: f64, target: [f64; 3]) -> [f64; 3] {
        let half_steps = self.step.half_steps();
        if half_steps == 0.0 {
            return [0.0; 3];
        }
        let loss = self.step.loss();
        std::array::from_fn(|a| inertia / half_steps * (target[a] - spin[a] + loss * spin[a]))
    }

    /// Integrates all sets of nodes, books the owned nodes, votes on the surface, and clears the forces.
    ///
    /// `v_{n+1/2} = v_{n-1/2} + f/m (dt_{n-1} + dt_n)/2`, `x_{n+1} = x_n + v_{n+1/2} dt_n`, with gravity and relaxation
    /// added to the first where there are any. The result does not depend on `width`.
    ///
    /// # Panics
    /// If an array is shorter than the sets or the machine lacks the width, see [`Width::require`].
    pub fn run(&self, nodes: &mut Nodes<'_>, width: Width) -> Booked {
        let n = nodes.sets.len() * SET;
        let shortest = [&*nodes.x, &*nodes.v, &*nodes.f].into_iter().flatten().map(Vec::len).min();
        let shortest = shortest.map_or(0, |s| s.min(nodes.mass.len()));
        assert!(shortest >= n, "node arrays of {shortest}, {n} in sets");
        let n_referred = nodes.sets.iter().filter(|set| set.surface != 0).count() * SET;
        assert!(nodes.reference.iter().all(|r| r.len() >= n_referred), "reference of {n_referred} nodes");
        width.run(Integration { advance: self, nodes })
    }

    /// # Safety
    /// All arrays of numbers hold all sets; the reference has eight for each set on the surface.
    #[inline(always)]
    unsafe fn all_sets<L: Lane>(&self, nodes: &mut Nodes<'_>) -> Booked {
        let mut tally = Tally::<L>::new();
        let body = self.body();
        let mut referred = 0;
        for index in 0..nodes.sets.len() {
            let set = nodes.sets[index];
            let mut lane = 0;
            while lane < SET {
                let moved = NodeSet {
                    held: low_bits::<L>(set.held >> lane),
                    booked: set.booked >> lane,
                    surface: low_bits::<L>(set.surface >> lane),
                    strikes: low_bits::<L>(set.strikes >> lane),
                };
                // SAFETY: the lanes are inside the set; the rest is the caller's promise.
                unsafe { self.lanes(nodes, moved, body, index * SET + lane, referred + lane, &mut tally) };
                lane += L::N;
            }
            if set.surface != 0 {
                referred += SET;
            }
        }
        tally.join()
    }

    /// The nodes `at..at + N`, whose reference starts at `referred` if any is on the surface.
    ///
    /// # Safety
    /// As [`Advance::all_sets`].
    #[inline(always)]
    unsafe fn lanes<L: Lane>(
        &self,
        nodes: &mut Nodes<'_>,
        set: NodeSet,
        body: Option<Body>,
        at: usize,
        referred: usize,
        tally: &mut Tally<L>,
    ) {
        let zero = L::splat(0.0);
        let dt = L::splat(self.step.dt);
        // SAFETY: the caller's promise.
        let (x, old, force, mass) =
            unsafe { (load(nodes.x, at), load(nodes.v, at), load(nodes.f, at), L::load(nodes.mass, at)) };
        let scale = L::splat(self.step.half_steps()) / mass;
        let mut new: Vector<L> = force.mul_add(scale, &old);
        let mut change = splat::<L>(0.0);
        if let Some(Body { gain, loss }) = body {
            let loss = L::splat(loss);
            change.x = loss.neg_mul_add(old.x, L::splat(gain[0]));
            change.y = loss.neg_mul_add(old.y, L::splat(gain[1]));
            change.z = loss.neg_mul_add(old.z, L::splat(gain[2]));
            new = Vector { x: new.x + change.x, y: new.y + change.y, z: new.z + change.z };
        }
        let mut near = 0;
        let mut held = set.held;
        if held != 0 {
            [held, near] = self.not_clear(nodes, set, at, &x, &new);
        }
        if near != 0 {
            tally.closing = tally.closing.max(self.closing(nodes, near, at));
        }
        let set = NodeSet { held, ..set };
        if set.held != 0 {
            let mut held = arrays(&new);
            tally.external.merge(self.hold(nodes, set, at, &mut held));
            // SAFETY: the arrays hold a whole set.
            new = unsafe {
                Vector { x: L::load(&held[0], 0), y: L::load(&held[1], 0), z: L::load(&held[2], 0) }
            };
        }
        let x = new.mul_add(dt, &x);
        // SAFETY: the caller's promise.
        unsafe {
            store(&new, nodes.v, at);
            store(&x, nodes.x, at);
            store(&splat::<L>(0.0), nodes.f, at);
        }

        let booked = L::mask(u32::from(set.booked));
        let energy = L::splat(self.step.quanta.energy.magic());
        if body.is_some() {
            let impulse = change.scaled(mass);
            let quantum = self.step.dithered();
            let halves = work::halves([impulse.dot(&old), impulse.dot(&new)], self.step.share_before());
            for (sum, half) in tally.body_work.iter_mut().zip(halves) {
                *sum = *sum + L::select(booked, quantum.round_lanes(half), zero);
            }
        }
        let share = self.step.share_before();
        let passed = Vector { x: new.x - old.x, y: new.y - old.y, z: new.z - old.z };
        let kinetic = L::splat(0.5) * mass * old.dot(&passed.mul_add(L::splat(2.0 * share), &old));
        tally.kinetic = tally.kinetic + L::select(booked, rounded(kinetic, energy), zero);
        let momentum = L::splat(self.step.quanta.momentum.magic());
        let carried = passed.mul_add(L::splat(share), &old).scaled(mass);
        tally.momentum.x = tally.momentum.x + L::select(booked, rounded(carried.x, momentum), zero);
        tally.momentum.y = tally.momentum.y + L::select(booked, rounded(carried.y, momentum), zero);
        tally.momentum.z = tally.momentum.z + L::select(booked, rounded(carried.z, momentum), zero);

        if set.surface != 0 {
            // SAFETY: the caller's promise.
            let from = unsafe { load::<L>(nodes.reference, referred) };
            let moved = L::mask(u32::from(set.surface));
            tally.low.x = tally.low.x.min(L::select(moved, x.x - from.x, tally.low.x));
            tally.low.y = tally.low.y.min(L::select(moved, x.y - from.y, tally.low.y));
            tally.low.z = tally.low.z.min(L::select(moved, x.z - from.z, tally.low.z));
            tally.high.x = tally.high.x.max(L::select(moved, x.x - from.x, tally.high.x));
            tally.high.y = tally.high.y.max(L::select(moved, x.y - from.y, tally.high.y));
            tally.high.z = tally.high.z.max(L::select(moved, x.z - from.z, tally.high.z));
            let squared = new.dot(&new);
            let gain = L::splat(SPEED_LAG * self.step.dt) * force.dot(&force).sqrt() / mass;
            tally.speed_squared = tally.speed_squared.max(L::select(moved, squared, zero));
            tally.speed_ahead = tally.speed_ahead.max(L::select(moved, squared.sqrt() + gain, zero));
        }
    }
}

/// The bits of the first N lanes.
#[inline(always)]
fn low_bits<L: Lane>(bits: u8) -> u8 {
    bits & (((1_u32 << L::N) - 1) as u8)
}

#[inline(always)]
fn arrays<L: Lane>(vector: &Vector<L>) -> [[f64; SET]; 3] {
    [vector.x.to_array(), vector.y.to_array(), vector.z.to_array()]
}

#[inline(always)]
fn splat<L: Lane>(value: f64) -> Vector<L> {
    Vector { x: L::splat(value), y: L::splat(value), z: L::splat(value) }
}

/// # Safety
/// `at + N` is inside the arrays.
#[inline(always)]
unsafe fn load<L: Lane>(from: &[Vec<f64>; 3], at: usize) -> Vector<L> {
    // SAFETY: the caller's promise.
    unsafe { Vector { x: L::load(&from[0], at), y: L::load(&from[1], at), z: L::load(&from[2], at) } }
}

/// # Safety
/// `at + N` is inside the arrays.
#[inline(always)]
unsafe fn store<L: Lane>(values: &Vector<L>, to: &mut [Vec<f64>; 3], at: usize) {
    let [x, y, z] = to;
    // SAFETY: the caller's promise.
    unsafe {
        values.x.store(x, at);
        values.y.store(y, at);
        values.z.store(z, at);
    }
}

#[cfg(test)]
mod tests;
