//! Integration of nodes: central differences, prescribed velocities, rigid walls; what is booked and voted.
//!
//! Every holder of a node runs this with the same mass, constraint, walls and total force, and so gets the
//! same bits. Only the owner's copy is booked. Nodes go in sets of eight on lanes; those that something holds are
//! corrected one by one, and a set without any pays nothing for it.

#[cfg(target_arch = "x86_64")]
use crate::lanes::{avx2::Avx2, avx512::Avx512};
use crate::{
    contact::Extent,
    element::vector::Vector,
    lanes::{Lane, SET, Width, scalar::Scalar},
    setup::{Constraint, RigidWall},
    vote::Quanta,
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
}

/// One step of time for nodes.
pub struct Advance<'a> {
    /// `dt_{n-1}` (time).
    pub dt_previous: f64,
    /// `dt_n` (time).
    pub dt: f64,
    /// Prescribed velocities; entry 0 is free.
    pub constraints: &'a [Constraint],
    /// All walls; a node's constraint says which it feels.
    pub walls: &'a [RigidWall],
    /// Quanta of the sums.
    pub quanta: Quanta,
}

/// What the nodes say of a step: exact sums over booked nodes, each term rounded to its quantum, and extremes over
/// surface nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// `sum 1/2 m v_{n-1/2} . v_{n+1/2}`.
    pub kinetic: f64,
    /// Work done on the nodes by prescribed velocities and walls.
    pub external: f64,
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
    external: f64,
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
            external: 0.0,
        }
    }

    #[inline(always)]
    fn join(&self) -> Booked {
        let mut booked = Booked { external: self.external, ..Booked::default() };
        let (kinetic, momentum) = (self.kinetic.to_array(), arrays(&self.momentum));
        let (low, high) = (arrays(&self.low), arrays(&self.high));
        let (squared, ahead) = (self.speed_squared.to_array(), self.speed_ahead.to_array());
        for lane in 0..L::N {
            booked.kinetic += kinetic[lane];
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

impl Advance<'_> {
    /// Integrates all sets of nodes, books the owned nodes, votes on the surface, and clears the forces.
    ///
    /// `v_{n+1/2} = v_{n-1/2} + f/m (dt_{n-1} + dt_n)/2`, `x_{n+1} = x_n + v_{n+1/2} dt_n`. The result does not depend
    /// on `width`.
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
        assert!(width.available(), "lane width {width} is not on this machine");
        // SAFETY: the machine has the width, and the arrays hold all sets.
        unsafe {
            match width {
                Width::Scalar => on_scalar(self, nodes),
                #[cfg(target_arch = "x86_64")]
                Width::Avx2 => on_avx2(self, nodes),
                #[cfg(target_arch = "x86_64")]
                Width::Avx512 => on_avx512(self, nodes),
                #[cfg(not(target_arch = "x86_64"))]
                Width::Avx2 | Width::Avx512 => on_scalar(self, nodes),
            }
        }
    }

    /// # Safety
    /// All arrays of numbers hold all sets; the reference has eight for each set on the surface.
    #[inline(always)]
    unsafe fn all_sets<L: Lane>(&self, nodes: &mut Nodes<'_>) -> Booked {
        let mut tally = Tally::<L>::new();
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
                unsafe { self.lanes(nodes, moved, index * SET + lane, referred + lane, &mut tally) };
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
        if set.held != 0 {
            let mut held = arrays(&new);
            tally.external += self.hold(nodes, set, at, &mut held);
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
        let kinetic = L::splat(0.5) * mass * old.dot(&new);
        tally.kinetic = tally.kinetic + L::select(booked, (kinetic + energy) - energy, zero);
        let momentum = L::splat(self.quanta.momentum.magic());
        let carried = new.scaled(mass);
        tally.momentum.x = tally.momentum.x + L::select(booked, (carried.x + momentum) - momentum, zero);
        tally.momentum.y = tally.momentum.y + L::select(booked, (carried.y + momentum) - momentum, zero);
        tally.momentum.z = tally.momentum.z + L::select(booked, (carried.z + momentum) - momentum, zero);

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
    fn hold(&self, nodes: &Nodes<'_>, set: NodeSet, at: usize, velocity: &mut [[f64; SET]; 3]) -> f64 {
        let mut external = 0.0;
        for lane in (0..SET).filter(|lane| set.held >> lane & 1 == 1) {
            let i = at + lane;
            let old = [nodes.v[0][i], nodes.v[1][i], nodes.v[2][i]];
            let free = [velocity[0][lane], velocity[1][lane], velocity[2][lane]];
            let mut new = free;
            let held = &self.constraints[nodes.constraint[i] as usize];
            for (component, prescribed) in new.iter_mut().zip(held.velocity) {
                if let Some(velocity) = prescribed {
                    *component = velocity;
                }
            }
            let mut walls = held.walls;
            while walls != 0 {
                let x = [nodes.x[0][i], nodes.x[1][i], nodes.x[2][i]];
                stop_at_wall(&self.walls[walls.trailing_zeros() as usize], x, &mut new, self.dt);
                walls &= walls - 1;
            }
            if set.booked >> lane & 1 == 1 && new != free {
                // Impulse of the support times the mean velocity is its work.
                let mass = nodes.mass[i];
                let work = (0..3).map(|a| mass * (new[a] - free[a]) * 0.5 * (old[a] + new[a])).sum::<f64>();
                external += self.quanta.energy.round(work);
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

/// # Safety
/// As [`Advance::all_sets`].
unsafe fn on_scalar(advance: &Advance<'_>, nodes: &mut Nodes<'_>) -> Booked {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("fma") {
        // SAFETY: the machine has FMA; the rest is the caller's promise.
        return unsafe { on_scalar_fma(advance, nodes) };
    }
    // SAFETY: the caller's promise.
    unsafe { advance.all_sets::<Scalar>(nodes) }
}

/// # Safety
/// As [`Advance::all_sets`], on a machine with FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "fma")]
unsafe fn on_scalar_fma(advance: &Advance<'_>, nodes: &mut Nodes<'_>) -> Booked {
    // SAFETY: the caller's promise.
    unsafe { advance.all_sets::<Scalar>(nodes) }
}

/// # Safety
/// As [`Advance::all_sets`], on a machine with [`Width::Avx2`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn on_avx2(advance: &Advance<'_>, nodes: &mut Nodes<'_>) -> Booked {
    // SAFETY: the caller's promise.
    unsafe { advance.all_sets::<Avx2>(nodes) }
}

/// # Safety
/// As [`Advance::all_sets`], on a machine with [`Width::Avx512`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn on_avx512(advance: &Advance<'_>, nodes: &mut Nodes<'_>) -> Booked {
    // SAFETY: the caller's promise.
    unsafe { advance.all_sets::<Avx512>(nodes) }
}

/// Keeps a node that would end behind the wall on it; friction takes `mu` times the normal impulse.
fn stop_at_wall(wall: &RigidWall, x: [f64; 3], v: &mut [f64; 3], dt: f64) {
    let n = wall.normal;
    let height = (0..3).map(|a| (x[a] - wall.point[a]) * n[a]).sum::<f64>();
    let approach = (0..3).map(|a| v[a] * n[a]).sum::<f64>();
    if height + approach * dt >= 0.0 || dt == 0.0 {
        return;
    }
    let change = -height / dt - approach;
    for a in 0..3 {
        v[a] += change * n[a];
    }
    if wall.friction > 0.0 {
        let normal_speed = -height / dt;
        let tangential: [f64; 3] = std::array::from_fn(|a| v[a] - normal_speed * n[a]);
        let speed =
            (tangential[0] * tangential[0] + tangential[1] * tangential[1] + tangential[2] * tangential[2])
                .sqrt();
        if speed > 0.0 {
            let factor = (wall.friction * change / speed).min(1.0);
            for a in 0..3 {
                v[a] -= factor * tangential[a];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::Quantum;

    fn advance_one(
        v: [f64; 3],
        f: [f64; 3],
        constraint: Constraint,
        walls: &[RigidWall],
    ) -> ([f64; 3], [f64; 3], Booked) {
        let padded = |c: f64| [c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0].to_vec();
        let mut x = [0.0, 0.0, 0.001].map(padded);
        let mut vel = v.map(padded);
        let mut force = f.map(padded);
        let q = Quantum::for_reference(1e3, 46);
        let constraints = [Constraint::default(), constraint];
        let advance = Advance {
            dt_previous: 1e-3,
            dt: 1e-3,
            constraints: &constraints,
            walls,
            quanta: Quanta { force: q, energy: q, momentum: q },
        };
        let mut nodes = Nodes {
            x: &mut x,
            v: &mut vel,
            f: &mut force,
            mass: &[2.0; SET],
            constraint: &[1],
            sets: &[NodeSet { held: 1, booked: 1, surface: 0 }],
            reference: &Default::default(),
        };
        let booked = advance.run(&mut nodes, Width::best());
        assert!(force.iter().flatten().all(|&f| f == 0.0), "forces are cleared");
        (x.map(|c| c[0]), vel.map(|c| c[0]), booked)
    }

    #[test]
    fn free_node_gains_force_over_mass_times_dt() {
        let (x, v, booked) = advance_one([1.0, 0.0, 0.0], [4.0, 0.0, 0.0], Constraint::default(), &[]);
        assert!((v[0] - 1.002).abs() < 1e-15 && (x[0] - 1.002e-3).abs() < 1e-15);
        assert!((booked.kinetic - 1.002).abs() < 1e-9 && booked.external == 0.0);
    }

    #[test]
    fn prescribed_velocity_books_the_work_of_its_support() {
        let hold = Constraint { velocity: [Some(1.0), None, None], walls: 0 };
        let (_, v, booked) = advance_one([1.0, 0.0, 0.0], [4.0, 0.0, 0.0], hold, &[]);
        assert_eq!(v[0], 1.0);
        assert!((booked.external + 4.0e-3).abs() < 1e-9, "{}", booked.external);
    }

    #[test]
    fn wall_stops_the_node_on_its_plane_and_friction_follows_coulomb() {
        let touches = Constraint { velocity: [None; 3], walls: 1 };
        let mut wall =
            RigidWall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], friction: 0.0, parts: vec![true] };
        let (x, v, _) = advance_one([10.0, 0.0, -10.0], [0.0; 3], touches, std::slice::from_ref(&wall));
        assert!(x[2].abs() < 1e-15 && v[0] == 10.0);
        wall.friction = 0.3;
        let (_, v, _) = advance_one([10.0, 0.0, -10.0], [0.0; 3], touches, std::slice::from_ref(&wall));
        // normal velocity goes from -10 to -1 (it still closes one millimetre): tangential loses 0.3 * 9
        assert!((v[0] - 7.3).abs() < 1e-12, "{}", v[0]);
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
            Constraint { velocity: [Some(1.0), None, Some(0.0)], walls: 0 },
            Constraint { velocity: [None; 3], walls: 1 },
        ];
        let wall = RigidWall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], friction: 0.2, parts: vec![true] };
        let advance = Advance {
            dt_previous: 1e-4,
            dt: 1.1e-4,
            constraints: &constraints,
            walls: &[wall],
            quanta: Quanta { force: quantum, energy: quantum, momentum: quantum },
        };
        let run = |width: Width| {
            let (mut x, mut v, mut f) = (x.clone(), v.clone(), f.clone());
            let mut nodes = Nodes {
                x: &mut x,
                v: &mut v,
                f: &mut f,
                mass: &mass,
                constraint: &constraint,
                sets: &sets,
                reference: &reference,
            };
            let booked = advance.run(&mut nodes, width);
            assert!(booked.external != 0.0 && booked.speed_ahead > booked.speed_squared.sqrt());
            let bits: Vec<u64> = x.iter().chain(&v).flatten().map(|c| c.to_bits()).collect();
            (booked, bits)
        };
        let reference = run(Width::Scalar);
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert_eq!(run(width), reference, "{width}");
        }
    }
}
