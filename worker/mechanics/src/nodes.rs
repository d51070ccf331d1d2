//! Integration of nodes: central differences, prescribed velocities, rigid walls; what is booked.
//!
//! Every holder of a node runs this with the same mass, constraint, walls and total force, and so gets the
//! same bits. Only the owner's copy is booked.

use crate::{
    setup::{Constraint, RigidWall},
    vote::Quanta,
};

/// The nodes of a block or the guests of a worker, by local node index.
pub struct Nodes<'a> {
    /// Position `x_n`, becomes `x_{n+1}`.
    pub x: &'a mut [Vec<f64>; 3],
    /// Velocity `v_{n-1/2}`, becomes `v_{n+1/2}`.
    pub v: &'a mut [Vec<f64>; 3],
    /// Total force at `x_n`.
    pub f: &'a [Vec<f64>; 3],
    /// Nodal mass.
    pub mass: &'a [f64],
    /// Index into the setup's constraints.
    pub constraint: &'a [u16],
    /// True where this copy books kinetic energy, momentum and work.
    pub booked: &'a [bool],
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

/// Sums over booked nodes, each term rounded to its quantum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// `sum 1/2 m v_{n-1/2} . v_{n+1/2}`.
    pub kinetic: f64,
    /// Work done on the nodes by prescribed velocities and walls.
    pub external: f64,
    /// `sum m v_{n+1/2}`.
    pub momentum: [f64; 3],
}

impl Advance<'_> {
    /// Integrates nodes `0..n` and books the owned ones.
    ///
    /// `v_{n+1/2} = v_{n-1/2} + f/m (dt_{n-1} + dt_n)/2`, `x_{n+1} = x_n + v_{n+1/2} dt_n`.
    pub fn run(&self, nodes: &mut Nodes<'_>) -> Booked {
        let n = nodes.mass.len();
        let half = 0.5 * (self.dt_previous + self.dt);
        let mut booked = Booked::default();
        for i in 0..n {
            let mass = nodes.mass[i];
            let scale = half / mass;
            let old = [nodes.v[0][i], nodes.v[1][i], nodes.v[2][i]];
            let free = std::array::from_fn(|a| old[a] + nodes.f[a][i] * scale);
            let mut new: [f64; 3] = free;
            let constraint = nodes.constraint[i];
            if constraint != 0 {
                let held = &self.constraints[constraint as usize];
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
            }
            for a in 0..3 {
                nodes.v[a][i] = new[a];
                nodes.x[a][i] += new[a] * self.dt;
            }
            if nodes.booked[i] {
                let quanta = &self.quanta;
                let dot = old[0] * new[0] + old[1] * new[1] + old[2] * new[2];
                booked.kinetic += quanta.energy.round(0.5 * mass * dot);
                for a in 0..3 {
                    booked.momentum[a] += quanta.momentum.round(mass * new[a]);
                }
                if new != free {
                    // Impulse of the support times the mean velocity is its work.
                    let work =
                        (0..3).map(|a| mass * (new[a] - free[a]) * 0.5 * (old[a] + new[a])).sum::<f64>();
                    booked.external += quanta.energy.round(work);
                }
            }
        }
        booked
    }
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
        let mut x = [vec![0.0], vec![0.0], vec![0.001]];
        let mut vel = v.map(|c| vec![c]);
        let force = f.map(|c| vec![c]);
        let q = Quantum::for_reference(1e3, 46);
        let constraints = [Constraint::default(), constraint];
        let advance = Advance {
            dt_previous: 1e-3,
            dt: 1e-3,
            constraints: &constraints,
            walls,
            quanta: Quanta { force: q, energy: q, momentum: q },
        };
        let booked = advance.run(&mut Nodes {
            x: &mut x,
            v: &mut vel,
            f: &force,
            mass: &[2.0],
            constraint: &[1],
            booked: &[true],
        });
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
}
