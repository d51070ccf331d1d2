//! Integration of nodes: central differences, forces on nodes, gravity, relaxation, prescribed velocities, rigid walls;
//! what is booked and voted.
//!
//! Every holder of a node runs this with the same mass, constraint, walls and total force, and so gets the
//! same bits. Only the owner's copy is booked. Nodes go in sets of eight on lanes; those that something holds are
//! corrected one by one, and a set without any pays nothing for it.

use crate::{
    contact::Extent,
    element::vector::Vector,
    exact::rounded,
    lanes::{Lane, SET, Width, dispatch::Task},
    load::Loads,
    setup::Constraint,
    vote::{Quanta, Work},
    wall::{Motion, Pose, RigidWall, WallVote, touched_quantum},
};

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
}

impl NodeSet {
    /// The sets of nodes with these constraints; neither booked nor on the surface.
    pub fn all(constraint: &[u16]) -> Vec<NodeSet> {
        let bits = |set: &[u16]| (0..).zip(set).map(|(i, &c)| u8::from(c != 0) << i).sum();
        constraint.chunks(SET).map(|set| NodeSet { held: bits(set), ..NodeSet::default() }).collect()
    }
}

/// The nodes of a block or the guests of a worker, by local node index. Arrays of numbers are padded to whole sets;
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
    /// What booked nodes gave each wall in this step, by wall: terms are added to it.
    pub walls: &'a mut [WallVote],
}

/// One step of time for nodes.
pub struct Advance<'a> {
    /// `dt_{n-1}` (time).
    pub dt_previous: f64,
    /// `dt_n` (time).
    pub dt: f64,
    /// `t_n` (time).
    pub time: f64,
    /// What acts on single nodes; entry 0 is nothing.
    pub constraints: &'a [Constraint],
    /// All walls; a node's constraint says which it feels.
    pub walls: &'a [RigidWall],
    /// Where the walls are and how they move in this step.
    pub poses: &'a [Pose],
    /// Curves, forces on nodes, gravity, relaxation.
    pub loads: &'a Loads,
    /// Quanta of the sums.
    pub quanta: Quanta,
}

/// What the nodes say of a step: exact sums over booked nodes, each term rounded to its quantum, and extremes over
/// surface nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// `sum 1/2 m v_{n-1/2} . v_{n+1/2}`.
    pub kinetic: f64,
    /// Work done on the nodes by prescribed velocities, walls, forces, gravity and relaxation.
    pub external: Work,
    /// `sum m v_{n+1/2}`.
    pub momentum: [f64; 3],
    /// Displacements of surface nodes from the reference.
    pub extent: Extent,
    /// Greatest `|v_{n+1/2}|^2` of a surface node.
    pub speed_squared: f64,
    /// Greatest speed that a surface node may have when the vote takes effect.
    pub speed_ahead: f64,
}

/// [`Booked`] by lane; lanes join in any way.
struct Tally<L> {
    kinetic: L,
    momentum: Vector<L>,
    low: Vector<L>,
    high: Vector<L>,
    speed_squared: L,
    speed_ahead: L,
    /// Work of gravity and relaxation, before `t_n` and after it.
    body_work: [L; 2],
    external: Work,
}

impl<L: Lane> Tally<L> {
    #[inline(always)]
    fn new() -> Self {
        let zero = L::splat(0.0);
        Self {
            kinetic: zero,
            momentum: splat(0.0),
            low: splat(f64::INFINITY),
            high: splat(f64::NEG_INFINITY),
            speed_squared: zero,
            speed_ahead: zero,
            body_work: [zero; 2],
            external: Work::default(),
        }
    }

    #[inline(always)]
    fn join(&self) -> Booked {
        let mut booked = Booked { external: self.external, ..Booked::default() };
        let (kinetic, momentum) = (self.kinetic.to_array(), arrays(&self.momentum));
        let (low, high) = (arrays(&self.low), arrays(&self.high));
        let (squared, ahead) = (self.speed_squared.to_array(), self.speed_ahead.to_array());
        let [before, after] = [self.body_work[0].to_array(), self.body_work[1].to_array()];
        for lane in 0..L::N {
            booked.kinetic += kinetic[lane];
            booked.external.merge(Work { before: before[lane], after: after[lane] });
            for a in 0..3 {
                booked.momentum[a] += momentum[a][lane];
                booked.extent.min[a] = booked.extent.min[a].min(low[a][lane]);
                booked.extent.max[a] = booked.extent.max[a].max(high[a][lane]);
            }
            booked.speed_squared = booked.speed_squared.max(squared[lane]);
            booked.speed_ahead = booked.speed_ahead.max(ahead[lane]);
        }
        booked
    }
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
        let relaxation = self.loads.relaxation.filter(|r| self.time < r.until);
        if self.loads.gravity.is_none() && relaxation.is_none() {
            return None;
        }
        let half_steps = 0.5 * (self.dt_previous + self.dt);
        let gain = self.loads.gravity.map_or([0.0; 3], |gravity| {
            let scale = half_steps * gravity.drive.at(&self.loads.curves, self.time);
            gravity.acceleration.map(|g| g * scale)
        });
        Some(Body { gain, loss: relaxation.map_or(0.0, |r| 1.0 - r.factor) })
    }

    /// The force on a node that brings it to `target` in this step, whatever gravity and relaxation do.
    pub(crate) fn leading(&self, x: [f64; 3], v: [f64; 3], mass: f64, target: [f64; 3]) -> [f64; 3] {
        let half_steps = 0.5 * (self.dt_previous + self.dt);
        if self.dt == 0.0 || half_steps == 0.0 {
            return [0.0; 3];
        }
        let Body { gain, loss } = self.body().unwrap_or(Body { gain: [0.0; 3], loss: 0.0 });
        std::array::from_fn(|a| {
            let change = (target[a] - x[a]) / self.dt - v[a];
            mass / half_steps * (change - (gain[a] - loss * v[a]))
        })
    }

    /// The moment on a node of shells that turns it at `target` after this step, whatever relaxation does.
    pub(crate) fn turning(&self, spin: [f64; 3], inertia: f64, target: [f64; 3]) -> [f64; 3] {
        let half_steps = 0.5 * (self.dt_previous + self.dt);
        if half_steps == 0.0 {
            return [0.0; 3];
        }
        let loss = self.body().map_or(0.0, |body| body.loss);
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
        let dt = L::splat(self.dt);
        // SAFETY: the caller's promise.
        let (x, old, force, mass) =
            unsafe { (load(nodes.x, at), load(nodes.v, at), load(nodes.f, at), L::load(nodes.mass, at)) };
        let scale = L::splat(0.5 * (self.dt_previous + self.dt)) / mass;
        let mut new: Vector<L> = force.mul_add(scale, &old);
        let mut change = splat::<L>(0.0);
        if let Some(Body { gain, loss }) = body {
            let loss = L::splat(loss);
            change.x = loss.neg_mul_add(old.x, L::splat(gain[0]));
            change.y = loss.neg_mul_add(old.y, L::splat(gain[1]));
            change.z = loss.neg_mul_add(old.z, L::splat(gain[2]));
            new = Vector { x: new.x + change.x, y: new.y + change.y, z: new.z + change.z };
        }
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
        let energy = L::splat(self.quanta.energy.magic());
        if body.is_some() {
            let half_impulse = change.scaled(L::splat(0.5) * mass);
            let [before, after] = tally.body_work;
            let (earlier, later) = (half_impulse.dot(&old), half_impulse.dot(&new));
            tally.body_work = [
                before + L::select(booked, rounded(earlier, energy), zero),
                after + L::select(booked, rounded(later, energy), zero),
            ];
        }
        let kinetic = L::splat(0.5) * mass * old.dot(&new);
        tally.kinetic = tally.kinetic + L::select(booked, rounded(kinetic, energy), zero);
        let momentum = L::splat(self.quanta.momentum.magic());
        let carried = new.scaled(mass);
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
            let gain = L::splat(SPEED_LAG * self.dt) * force.dot(&force).sqrt() / mass;
            tally.speed_squared = tally.speed_squared.max(L::select(moved, squared, zero));
            tally.speed_ahead = tally.speed_ahead.max(L::select(moved, squared.sqrt() + gain, zero));
        }
    }

    /// Corrects the free velocities of held nodes from `at` on; gives the work of what holds the booked ones.
    fn hold(&self, nodes: &mut Nodes<'_>, set: NodeSet, at: usize, velocity: &mut [[f64; SET]; 3]) -> Work {
        let mut external = Work::default();
        let half_steps = 0.5 * (self.dt_previous + self.dt);
        let curves = &self.loads.curves;
        for lane in (0..SET).filter(|lane| set.held >> lane & 1 == 1) {
            let i = at + lane;
            let old = [nodes.v[0][i], nodes.v[1][i], nodes.v[2][i]];
            let free = [velocity[0][lane], velocity[1][lane], velocity[2][lane]];
            let mut new = free;
            let mass = nodes.mass[i];
            let booked = set.booked >> lane & 1 == 1;
            let held = &self.constraints[nodes.constraint[i] as usize];
            let mut forces = held.forces;
            while forces != 0 {
                let load = &self.loads.forces[forces.trailing_zeros() as usize];
                let scale = half_steps * load.drive.at(curves, self.time) / mass;
                for a in 0..3 {
                    new[a] += load.force[a] * scale;
                }
                forces &= forces - 1;
            }
            for (component, prescribed) in new.iter_mut().zip(held.velocity) {
                if let Some(velocity) = prescribed {
                    *component = velocity.at(curves, 0.5f64.mul_add(self.dt, self.time));
                }
            }
            let mut walls = held.walls;
            while walls != 0 {
                let w = walls.trailing_zeros() as usize;
                let x = [nodes.x[0][i], nodes.x[1][i], nodes.x[2][i]];
                let before = new;
                if self.walls[w].stop(&self.poses[w], x, &mut new, self.dt) && booked {
                    let quantum = self.quanta.momentum;
                    for a in 0..3 {
                        nodes.walls[w].impulse[a] += quantum.round(mass * (before[a] - new[a]));
                    }
                    if let Motion::Free { mass: own, .. } = self.walls[w].motion {
                        nodes.walls[w].touched += touched_quantum(own).round(mass);
                    }
                }
                walls &= walls - 1;
            }
            if booked && new != free {
                let with = |v: [f64; 3]| {
                    let work = (0..3).map(|a| 0.5 * mass * (new[a] - free[a]) * v[a]).sum::<f64>();
                    self.quanta.energy.round(work)
                };
                external.merge(Work { before: with(old), after: with(new) });
            }
            for a in 0..3 {
                velocity[a][lane] = new[a];
            }
        }
        external
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
mod tests {
    use super::*;
    use crate::{
        exact::Quantum,
        load::{Curve, Drive, Gravity, NodalForce, Relaxation},
        wall::Shape,
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
            dt_previous: 1e-3,
            dt: 1e-3,
            time: 0.5,
            constraints: &constraints,
            walls,
            poses: &vec![Pose::default(); walls.len()],
            loads,
            quanta: Quanta { force: q, energy: q, momentum: q, arm: 1.0 },
        };
        let mut nodes = Nodes {
            x: &mut x,
            v: &mut vel,
            f: &mut force,
            mass: &[2.0; SET],
            constraint: &[1],
            sets: &[NodeSet { held: 1, booked: 1, surface: 0 }],
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
    fn gravity_relaxation_and_nodal_force_change_the_velocity_and_book_their_work() {
        let curves = vec![Curve { points: vec![[0.0, 0.0], [1.0, 2.0]] }];
        let drive = Drive { factor: 3.0, curve: Some(0) };
        let force = NodalForce { force: [8.0, 0.0, 0.0], drive: Drive { factor: 1.0, curve: Some(0) } };
        let loads = Loads {
            curves,
            forces: vec![force],
            gravity: Some(Gravity { acceleration: [0.0, 0.0, -10.0], drive }),
            surfaces: Vec::new(),
            relaxation: Some(Relaxation { factor: 0.9, until: 0.6 }),
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
        let late = Loads { relaxation: Some(Relaxation { factor: 0.9, until: 0.5 }), ..loads.clone() };
        assert!((run(&late).1[1] - 2.0).abs() < 1e-15, "relaxation is over");
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
        let constraint: Vec<u16> = (0..n as u16).map(|i| [0, 0, 1, 0, 2][i as usize % 5]).collect();
        let mut sets = NodeSet::all(&constraint);
        for (i, set) in (0..n).map(|i| (i, i / SET)).filter(|(i, _)| i % 3 != 1) {
            sets[set].booked |= 1 << (i % SET);
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
        ];
        let motion = Motion::Free { mass: 50.0, velocity: [0.0; 3] };
        let wall = RigidWall { shape: FLOOR, motion, friction: 0.2, parts: vec![true] };
        let loads = Loads {
            forces: vec![NodalForce { force: [1e3, 0.0, 5e2], drive: Drive::constant(1.0) }],
            gravity: Some(Gravity { acceleration: [0.0, 3.0, -10.0], drive: Drive::constant(1.0) }),
            relaxation: Some(Relaxation { factor: 0.95, until: 1.0 }),
            ..Loads::default()
        };
        let advance = Advance {
            dt_previous: 1e-4,
            dt: 1.1e-4,
            time: 0.0,
            constraints: &constraints,
            walls: &[wall],
            poses: &[Pose::default()],
            loads: &loads,
            quanta: Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 },
        };
        let run = |width: Width| {
            let (mut x, mut v, mut f) = (x.clone(), v.clone(), f.clone());
            let mut votes = [WallVote::default()];
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
            assert!(votes[0].touched > 0.0);
            (booked, votes, bits)
        };
        let reference = run(Width::Scalar);
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert_eq!(run(width), reference, "{width}");
        }
    }
}
