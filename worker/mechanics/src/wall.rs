//! Rigid walls: planes, cylinders and spheres that stand, move as prescribed, or have a mass of their own.
//!
//! A node that would end a step inside the wall is put on its surface, which books an impulse on the wall. A wall of
//! finite mass gathers these impulses over all nodes, as exact sums that travel with the votes: what nodes gave it in
//! cycle n changes its velocity in cycle n + 2, on one worker as on many. Nodes that rest on it follow it with that lag,
//! which is stable as long as they weigh less than the wall.

use serde::{Deserialize, Serialize};

use crate::{
    element::vector::Vector,
    exact::Quantum,
    lanes::Lane,
    load::{Curve, Drive},
    work::Work,
};

/// A wall that no node of the named parts enters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigidWall {
    /// Its surface at time zero.
    pub shape: Shape,
    /// How it moves; it never turns.
    pub motion: Motion,
    /// Coulomb coefficient; 0 slides freely.
    pub friction: f64,
    /// Parts that feel the wall, by part index; true for each that does.
    pub parts: Vec<bool>,
}

/// Surface of a wall; material is outside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// All behind a plane.
    Plane {
        /// A point of the plane.
        point: [f64; 3],
        /// Unit normal, pointing to the side where material may be.
        normal: [f64; 3],
    },
    /// All inside a round cylinder without ends.
    Cylinder {
        /// A point of its axis.
        point: [f64; 3],
        /// Unit direction of its axis.
        axis: [f64; 3],
        /// Radius (length).
        radius: f64,
    },
    /// All inside a sphere.
    Sphere {
        centre: [f64; 3],
        /// Radius (length).
        radius: f64,
    },
}

impl Shape {
    /// Signed distance of a point, positive outside, and the unit normal there.
    pub fn height(&self, x: [f64; 3]) -> (f64, [f64; 3]) {
        match *self {
            Self::Plane { point, normal } => ((0..3).map(|a| (x[a] - point[a]) * normal[a]).sum(), normal),
            Self::Cylinder { point, axis, radius } => {
                let from: [f64; 3] = std::array::from_fn(|a| x[a] - point[a]);
                let along = dot(from, axis);
                round(std::array::from_fn(|a| along.mul_add(-axis[a], from[a])), radius)
            }
            Self::Sphere { centre, radius } => round(std::array::from_fn(|a| x[a] - centre[a]), radius),
        }
    }
}

/// Height over a circle or sphere; in its very middle any direction is out.
fn round(from: [f64; 3], radius: f64) -> (f64, [f64; 3]) {
    let distance = dot(from, from).sqrt();
    let normal = if distance > 0.0 { from.map(|c| c / distance) } else { [0.0, 0.0, 1.0] };
    (distance - radius, normal)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// How a wall moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// It stands.
    Fixed,
    /// Its velocity is given (length per time).
    Driven([Drive; 3]),
    /// It has a mass, and starts at this velocity.
    Free {
        mass: f64,
        /// Velocity at the start (length per time).
        velocity: [f64; 3],
    },
}

/// Displacement of a wall at the start of a step and its velocity during it.
pub type Pose = [[f64; 3]; 2];

/// Poses of the walls of finite mass before the first cycle, in the order of the walls.
pub fn first_poses(walls: &[RigidWall]) -> Vec<Pose> {
    walls
        .iter()
        .filter_map(|wall| match wall.motion {
            Motion::Free { velocity, .. } => Some([[0.0; 3], velocity]),
            _ => None,
        })
        .collect()
}

/// Poses of all walls in the step from `time` by `dt`, into `poses`; `free` are those of the walls of finite mass.
pub fn poses(
    walls: &[RigidWall],
    curves: &[Curve],
    time: f64,
    dt: f64,
    free: &[Pose],
    poses: &mut Vec<Pose>,
) {
    poses.clear();
    let mut free = free.iter();
    poses.extend(walls.iter().map(|wall| match wall.motion {
        Motion::Fixed => [[0.0; 3]; 2],
        Motion::Driven(velocity) => {
            let moved = velocity.map(|v| v.integral(curves, time));
            let mean = |a: usize| (velocity[a].integral(curves, time + dt) - moved[a]) / dt;
            [moved, if dt > 0.0 { std::array::from_fn(mean) } else { velocity.map(|v| v.at(curves, time)) }]
        }
        Motion::Free { .. } => free.next().copied().unwrap_or_default(),
    }));
}

/// The greatest speed at which a node closes in on one of the walls that it feels, see [`RigidWall::closing`]: one bit of `felt` for each.
pub fn closing(
    walls: &[RigidWall],
    poses: &[Pose],
    mut felt: u32,
    x: [f64; 3],
    v: [f64; 3],
    reach: f64,
) -> f64 {
    let mut greatest = 0.0_f64;
    while felt != 0 {
        let w = felt.trailing_zeros() as usize;
        felt &= felt - 1;
        greatest = greatest.max(walls[w].closing(&poses[w], x, v, reach));
    }
    greatest
}

/// What the nodes gave a wall or a support in one cycle, and its work: exact sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WallVote {
    pub impulse: [f64; 3],
    /// Mass of the nodes that touched a wall of finite mass.
    pub touched: f64,
    /// Work on the nodes: of a wall by its own velocity, of a support by that which it prescribes.
    pub work: Work,
    /// What nodes lost at a wall beside that: a node that strikes it stops at once, and friction.
    pub loss: Work,
}

impl WallVote {
    /// Joins what other nodes gave.
    pub fn merge(&mut self, other: &Self) {
        for a in 0..3 {
            self.impulse[a] += other.impulse[a];
        }
        self.touched += other.touched;
        self.work.merge(other.work);
        self.loss.merge(other.loss);
    }
}

/// Steps within which a strike is foreseen. A vote takes effect two steps after its own, and each may be twice as long as the one before.
pub const FORESEEN: f64 = 3.0;

/// Most of a wall's mass that nodes which touch it may have: past all of it they would shake it ever more.
pub const TOUCHED_SHARE: f64 = 0.5;

/// The quantum of masses that touch a wall of mass `mass`.
pub fn touched_quantum(mass: f64) -> Quantum {
    Quantum::for_reference(mass, 40)
}

/// Brings the poses of the walls of finite mass from one cycle to the next: the displacement by the velocity of the
/// cycle that ends, the velocity by the impulses of the cycle before it.
///
/// # Errors
/// Names the first wall that is too light for the nodes on it.
pub fn advance(walls: &[RigidWall], votes: &[WallVote], dt: f64, free: &mut [Pose]) -> Result<(), String> {
    let finite = walls.iter().enumerate().filter_map(|(w, wall)| match wall.motion {
        Motion::Free { mass, .. } => Some((w, mass)),
        _ => None,
    });
    for ((w, mass), [moved, velocity]) in finite.zip(free) {
        let vote = votes.get(w).copied().unwrap_or_default();
        if vote.touched > TOUCHED_SHARE * mass {
            return Err(format!(
                "[[wall]] {}: nodes of mass {:e} touch it, its own is {mass:e}; make it at least twice as heavy as what touches it, or refine the bodies",
                w + 1,
                vote.touched
            ));
        }
        for a in 0..3 {
            moved[a] += velocity[a] * dt;
            velocity[a] += vote.impulse[a] / mass;
        }
    }
    Ok(())
}

impl RigidWall {
    /// The nodes that [`RigidWall::stop`] would leave alone in a step of `dt`, for many nodes at once, rounding as `stop` does; and those that
    /// do not come to the wall within `reach` (time) either, as fast as they are.
    #[inline(always)]
    pub(crate) fn clear<L: Lane>(
        &self,
        pose: &Pose,
        x: &Vector<L>,
        v: &Vector<L>,
        [dt, reach]: [f64; 2],
    ) -> [L::Mask; 2] {
        let each = |[x, y, z]: [f64; 3]| Vector { x: L::splat(x), y: L::splat(y), z: L::splat(z) };
        let less = |a: &Vector<L>, b: &Vector<L>| Vector { x: a.x - b.x, y: a.y - b.y, z: a.z - b.z };
        let sum = |a: &Vector<L>, b: &Vector<L>| a.x * b.x + a.y * b.y + a.z * b.z;
        let (zero, step, reach) = (L::splat(0.0), L::splat(dt), L::splat(reach));
        let [moved, speed] = *pose;
        let (x, v) = (less(x, &each(moved)), less(v, &each(speed)));
        let end = || Vector { x: x.x + v.x * step, y: x.y + v.y * step, z: x.z + v.z * step };
        let outside = |from: &Vector<L>, radius: f64| sum(from, from).sqrt() - L::splat(radius);
        // The shape bulges outwards: a node is no sooner there than on the straight way to the nearest point.
        let later = |from: &Vector<L>, radius: f64| {
            let distance = sum(from, from).sqrt();
            (distance - L::splat(radius)) * distance + sum(&v, from) * reach
        };
        let [height, height_later] = match self.shape {
            Shape::Plane { point, normal } => {
                let normal = each(normal);
                let (height, approach) = (sum(&less(&x, &each(point)), &normal), sum(&v, &normal));
                [height + approach * step, height + approach * reach]
            }
            Shape::Cylinder { point, axis, radius } => {
                let axis = each(axis);
                let across = |x: &Vector<L>| {
                    let from = less(x, &each(point));
                    let along = sum(&from, &axis);
                    Vector {
                        x: along.neg_mul_add(axis.x, from.x),
                        y: along.neg_mul_add(axis.y, from.y),
                        z: along.neg_mul_add(axis.z, from.z),
                    }
                };
                [outside(&across(&end()), radius), later(&across(&x), radius)]
            }
            Shape::Sphere { centre, radius } => {
                [outside(&less(&end(), &each(centre)), radius), later(&less(&x, &each(centre)), radius)]
            }
        };
        [zero.less_equal(height), zero.less_equal(height_later)]
    }

    /// The speed at which a node closes in on the wall, if it may strike within `reach` (time) as fast as it is; else zero. What the
    /// wall stops at once, elements behind it feel as a jump.
    pub fn closing(&self, [moved, speed]: &Pose, x: [f64; 3], v: [f64; 3], reach: f64) -> f64 {
        let (height, normal) = self.shape.height(std::array::from_fn(|a| x[a] - moved[a]));
        let closing = -(0..3).map(|a| (v[a] - speed[a]) * normal[a]).sum::<f64>();
        if closing > 0.0 && height < closing * reach { closing } else { 0.0 }
    }

    /// Keeps a node that would end inside the wall on its surface; friction takes `mu` times the normal impulse. True
    /// if it touched.
    pub fn stop(&self, pose: &Pose, x: [f64; 3], v: &mut [f64; 3], dt: f64) -> bool {
        if dt == 0.0 {
            return false;
        }
        let [moved, speed] = *pose;
        let x: [f64; 3] = std::array::from_fn(|a| x[a] - moved[a]);
        let mut relative: [f64; 3] = std::array::from_fn(|a| v[a] - speed[a]);
        let (n, change, normal_speed);
        match self.shape {
            Shape::Plane { normal, .. } => {
                let (height, _) = self.shape.height(x);
                let approach = (0..3).map(|a| relative[a] * normal[a]).sum::<f64>();
                if height + approach * dt >= 0.0 {
                    return false;
                }
                (n, change, normal_speed) = (normal, -height / dt - approach, -height / dt);
            }
            _ => {
                let (height, normal) = self.shape.height(std::array::from_fn(|a| x[a] + relative[a] * dt));
                if height >= 0.0 {
                    return false;
                }
                let approach = (0..3).map(|a| relative[a] * normal[a]).sum::<f64>();
                (n, change, normal_speed) = (normal, -height / dt, approach - height / dt);
            }
        }
        for a in 0..3 {
            v[a] += change * n[a];
            relative[a] += change * n[a];
        }
        if self.friction > 0.0 {
            let tangential: [f64; 3] = std::array::from_fn(|a| relative[a] - normal_speed * n[a]);
            let slip = (tangential[0] * tangential[0]
                + tangential[1] * tangential[1]
                + tangential[2] * tangential[2])
                .sqrt();
            if slip > 0.0 {
                let factor = (self.friction * change / slip).min(1.0);
                for a in 0..3 {
                    v[a] -= factor * tangential[a];
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{SET, Width, dispatch::Task};

    fn wall(shape: Shape, motion: Motion, friction: f64) -> RigidWall {
        RigidWall { shape, motion, friction, parts: vec![true] }
    }

    #[test]
    fn a_node_that_would_enter_a_round_wall_ends_on_its_surface() {
        let dt = 1e-3;
        let sphere = Shape::Sphere { centre: [0.0, 0.0, -1.0], radius: 1.0 };
        let cylinder = Shape::Cylinder { point: [5.0, 0.0, -2.0], axis: [1.0, 0.0, 0.0], radius: 2.0 };
        for (shape, x) in [(sphere, [0.1, 0.05, 0.0]), (cylinder, [0.1, 0.05, 0.01])] {
            let mut v = [1.0, -3.0, -40.0];
            let free = v;
            let wall = wall(shape, Motion::Fixed, 0.0);
            assert!(wall.stop(&[[0.0; 3]; 2], x, &mut v, dt));
            let (height, n) = shape.height(std::array::from_fn(|a| x[a] + v[a] * dt));
            assert!(height.abs() < 1e-15, "{height}");
            // What it got is along the normal there.
            let got: [f64; 3] = std::array::from_fn(|a| v[a] - free[a]);
            assert!((dot(got, n) - dot(got, got).sqrt()).abs() < 1e-12);
            let mut away = [0.0, 0.0, 40.0];
            assert!(!wall.stop(&[[0.0; 3]; 2], x, &mut away, dt));
        }
    }

    /// Nodes that end a step within a rounding of the wall: for each the answer of eight at once is that of one alone.
    struct Grazing<'a>(&'a RigidWall);

    impl Task for Grazing<'_> {
        type Output = ();

        fn run<L: Lane>(self) {
            let (pose, dt) = ([[0.3, -0.2, 0.1], [2.0, 1.0, -4.0]], 1e-3);
            let (mut n_clear, mut n_far) = (0, 0);
            for start in 0..200 {
                let node = |lane: usize| {
                    let angle = (start * L::N + lane) as f64 * 0.37;
                    let v = [30.0 * angle.cos(), -20.0, -40.0 * angle.sin()];
                    // Along its way out of the middle the node is moved until it ends on the surface.
                    let out = [angle.sin().powi(2), 0.5, angle.cos().powi(2)];
                    let end = |t: f64| -> [f64; 3] { std::array::from_fn(|a| out[a] * t - 0.7) };
                    let (mut inside, mut outside): (f64, f64) = (0.0, 8.0);
                    for _halving in 0..60 {
                        let middle = 0.5 * (inside + outside);
                        if self.0.shape.height(end(middle)).0 < 0.0 {
                            inside = middle
                        } else {
                            outside = middle
                        }
                    }
                    let at = if (lane + start).is_multiple_of(2) { inside } else { outside };
                    let x: [f64; 3] =
                        std::array::from_fn(|a| end(at)[a] - (v[a] - pose[1][a]) * dt + pose[0][a]);
                    (x, v)
                };
                let lanes = |component: &dyn Fn(usize) -> f64| {
                    let numbers: [f64; SET] = std::array::from_fn(component);
                    // SAFETY: a set has room for all lanes.
                    unsafe { L::load(&numbers, 0) }
                };
                let each = |of: &dyn Fn(usize) -> [f64; 3]| Vector {
                    x: lanes(&|i| of(i)[0]),
                    y: lanes(&|i| of(i)[1]),
                    z: lanes(&|i| of(i)[2]),
                };
                let (x, v) = (each(&|i| node(i).0), each(&|i| node(i).1));
                let reach = 3.0 * dt;
                let [clear, far] = self.0.clear(&pose, &x, &v, [dt, reach]).map(L::bits);
                for lane in 0..L::N {
                    let (x, mut v) = node(lane);
                    // None is far that will strike, but for rounding. One that leaves may count as near: `closing` knows.
                    let is_far = far >> lane & 1 == 1;
                    let soon = self.0.closing(&pose, x, v, (1.0 - 1e-9) * reach);
                    assert!(!is_far || soon == 0.0, "{:?}: {x:?} {v:?}", self.0.shape);
                    n_far += usize::from(is_far);
                    let is_clear = !self.0.stop(&pose, x, &mut v, dt);
                    assert_eq!(clear >> lane & 1 == 1, is_clear, "{:?}: {x:?} {v:?}", self.0.shape);
                    n_clear += usize::from(is_clear);
                }
            }
            assert!((20..200 * L::N - 20).contains(&n_far), "{n_far} are far from {:?}", self.0.shape);
            assert!((20..200 * L::N - 20).contains(&n_clear), "{n_clear} are clear of {:?}", self.0.shape);
        }
    }

    #[test]
    fn eight_nodes_at_once_are_clear_of_a_wall_as_each_alone_is() {
        let slanted = [0.6, 0.0, 0.8];
        for shape in [
            Shape::Plane { point: [0.1, 0.2, 0.3], normal: slanted },
            Shape::Cylinder { point: [-0.8, 0.0, -0.6], axis: slanted, radius: 1.3 },
            Shape::Sphere { centre: [-0.7, -0.6, -0.8], radius: 1.1 },
        ] {
            let wall = wall(shape, Motion::Fixed, 0.1);
            for width in Width::ALL.into_iter().filter(|width| width.available()) {
                width.run(Grazing(&wall));
            }
        }
    }

    #[test]
    fn a_moving_plane_pushes_and_rubs_as_a_standing_one_does_seen_from_it() {
        let plane = Shape::Plane { point: [0.0; 3], normal: [0.0, 0.0, 1.0] };
        let wall = wall(plane, Motion::Fixed, 0.3);
        let (x, dt) = ([0.0, 0.0, 0.001], 1e-3);
        let mut standing = [10.0, 0.0, -10.0];
        wall.stop(&[[0.0; 3]; 2], x, &mut standing, dt);
        let speed = [2.0, 1.0, -4.0];
        let mut moving: [f64; 3] = [12.0, 1.0, -14.0];
        wall.stop(&[[1.0, 0.0, 0.5], speed], [0.0, 0.0, 0.501], &mut moving, dt);
        for a in 0..3 {
            assert!((moving[a] - speed[a] - standing[a]).abs() < 1e-10, "{moving:?} {standing:?}");
        }
    }

    #[test]
    fn a_driven_wall_is_where_the_integral_of_its_velocity_says() {
        let curves = [Curve { points: vec![[0.0, 0.0], [2.0, 4.0]] }];
        let drive = Drive::along(0, 1.0);
        let motion = Motion::Driven([drive, Drive::constant(3.0), Drive::constant(0.0)]);
        let walls = [wall(Shape::Sphere { centre: [0.0; 3], radius: 1.0 }, motion, 0.0)];
        let mut found = Vec::new();
        poses(&walls, &curves, 1.0, 0.5, &[], &mut found);
        assert_eq!(found, [[[1.0, 3.0, 0.0], [2.5, 3.0, 0.0]]]);
    }

    #[test]
    fn a_wall_of_finite_mass_takes_the_impulse_and_one_too_light_is_refused() {
        let motion = Motion::Free { mass: 4.0, velocity: [1.0, 0.0, 0.0] };
        let sphere = Shape::Sphere { centre: [0.0; 3], radius: 1.0 };
        let walls = [wall(sphere, Motion::Fixed, 0.0), wall(sphere, motion, 0.0)];
        let mut free = first_poses(&walls);
        let vote = WallVote { impulse: [2.0, 0.0, -8.0], touched: 1.0, ..WallVote::default() };
        let other = WallVote { impulse: [9.0; 3], ..WallVote::default() };
        advance(&walls, &[other, vote], 0.25, &mut free).expect("light nodes");
        assert_eq!(free, [[[0.25, 0.0, 0.0], [1.5, 0.0, -2.0]]]);
        let heavy = WallVote { touched: 2.5, ..vote };
        let error = advance(&walls, &[other, heavy], 0.25, &mut free).expect_err("too light");
        assert!(error.starts_with("[[wall]] 2: nodes of mass 2.5e0"), "{error}");
    }
}
