//! Loads on the faces of a block's elements, as nodal forces.
//!
//! A face is the bilinear surface through its corners; what acts on it goes to the corners by their shape functions. A
//! uniform pressure on all faces of an element is then exactly its pressure times the volume gradient.

use super::{Drive, Loads, SurfaceKind, moving::Moment};
use crate::{
    block::Block,
    element::hex8,
    exact::Quantum,
    material::Material,
    mesh::FACES,
    setup::Control,
    time_step::TimeStep,
    vectors::{cross, dot, minus},
    work::Work,
};

/// A loaded face and what acted on it in this cycle.
#[derive(Clone, Debug)]
pub(crate) struct LoadedFace {
    /// Index into [`Loads::surfaces`].
    load: u32,
    /// Local nodes of the face; the last two are the same in a triangle.
    nodes: [usize; 4],
    /// Local nodes of the element's corners.
    corners: [u32; 8],
    /// Faces of the element that transmit.
    together: f64,
    /// `rho c_l` and `rho c_s` (stress over velocity), and `c_l`.
    impedance: [f64; 3],
    /// Forces on the corners of the face.
    force: [[f64; 3]; 4],
    /// Their power with the velocities before the step.
    power: f64,
}

/// What the faces of a block say of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FaceVote {
    /// Bound on every force term.
    pub force_bound: f64,
    /// Least limit on the step from dampers (time).
    pub limit: f64,
}

/// The loaded faces of a block: those of elements that take part.
pub(crate) fn faces_of(block: &Block, loads: &Loads, material: &Material) -> Vec<LoadedFace> {
    if loads.surfaces.is_empty() {
        return Vec::new();
    }
    let mut local: Vec<(u32, u32)> = block.globals().zip(0..).collect();
    local.sort_unstable();
    let find = |element: u32| local.binary_search_by_key(&element, |l| l.0).ok().map(|i| local[i].1 as usize);
    let longitudinal = material.sound_speed();
    let shear = (material.shear() / material.density).sqrt();
    let impedance = [material.density * longitudinal, material.density * shear, longitudinal];
    let mut found: Vec<(usize, LoadedFace)> = Vec::new();
    for (load, surface) in (0..).zip(&loads.surfaces) {
        for &(element, side) in &surface.faces {
            if let Some(e) = find(element).filter(|&e| block.is_alive(e)) {
                let corners = block.corners(e);
                let (force, power) = ([[0.0; 3]; 4], 0.0);
                let nodes = block.side(e, usize::from(side)).map(|node| node as usize);
                found.push((e, LoadedFace { load, nodes, corners, together: 0.0, impedance, force, power }));
            }
        }
    }
    let transmits = |face: &LoadedFace| loads.surfaces[face.load as usize].kind == SurfaceKind::Transmit;
    let mut damped: Vec<usize> = found.iter().filter(|(_, face)| transmits(face)).map(|(e, _)| *e).collect();
    damped.sort_unstable();
    for (e, face) in &mut found {
        face.together = (damped.partition_point(|d| d <= e) - damped.partition_point(|d| d < e)) as f64;
    }
    found.into_iter().map(|(_, face)| face).collect()
}

/// Area vectors of the corners of a bilinear face, outward: `integral of N_I n dA`.
pub(super) fn corner_areas(x: [[f64; 3]; 4]) -> [[f64; 3]; 4] {
    let (a, b, c, d) = (minus(x[1], x[0]), minus(x[2], x[1]), minus(x[2], x[3]), minus(x[3], x[0]));
    let products = [cross(a, d), cross(a, b), cross(c, b), cross(c, d)];
    std::array::from_fn(|i| {
        let [near, next, far, last] = [0, 1, 2, 3].map(|k| products[(i + k) % 4]);
        std::array::from_fn(|a| near[a] / 9.0 + (next[a] + last[a]) / 18.0 + far[a] / 36.0)
    })
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// `a` in the direction of length 1, and its length; nothing has no direction.
fn unit(a: [f64; 3]) -> ([f64; 3], f64) {
    let size = norm(a);
    (if size > 0.0 { a.map(|c| c / size) } else { a }, size)
}

/// The centre of a face and its outward normal of unit length.
fn middle(x: [[f64; 3]; 4]) -> ([f64; 3], [f64; 3]) {
    let centre = std::array::from_fn(|a| 0.25 * ((x[0][a] + x[1][a]) + (x[2][a] + x[3][a])));
    (centre, unit(cross(minus(x[2], x[0]), minus(x[3], x[1]))).0)
}

/// The force of the dampers on a corner of this area vector and velocity.
fn damped(area: [f64; 3], v: [f64; 3], [longitudinal, shear, _]: [f64; 3]) -> [f64; 3] {
    let (normal, size) = unit(area);
    let speed = dot(normal, v);
    std::array::from_fn(|a| {
        let across = normal[a] * speed;
        (across * longitudinal + (v[a] - across) * shear) * -size
    })
}

/// Adds the loads at `time` to the forces of the block, and keeps them for [`work`]. A pressure is its mean over a step `dt` around that time: the
/// last one, because nobody knows the next before the forces are known.
pub(crate) fn apply(
    faces: &mut [LoadedFace],
    block: &mut Block,
    loads: &Loads,
    control: &Control,
    (time, dt): (f64, f64),
    quantum: Quantum,
) -> FaceVote {
    let mean = |drive: Drive| drive.mean_around(&loads.curves, time, [dt; 2]);
    let mut vote = FaceVote { force_bound: 0.0, limit: f64::INFINITY };
    let damping = 8.0 * block.hourglass.damping() + 2.0 * control.linear_viscosity;
    let moments: Vec<Moment<'_>> =
        loads.moving.iter().map(|load| load.at(&loads.curves, mean(load.pressure), time)).collect();
    for face in faces {
        let nodes = face.nodes;
        let at = |values: &[Vec<f64>; 3], n: usize| [values[0][n], values[1][n], values[2][n]];
        let places = nodes.map(|n| at(&block.x, n));
        let velocities = nodes.map(|n| at(&block.v, n));
        let areas = corner_areas(places);
        let pressed = |pressure: f64| areas.map(|area| area.map(|c| c * -pressure));
        let kind = loads.surfaces[face.load as usize].kind;
        let forces = match kind {
            SurfaceKind::Pressure(drive) => pressed(mean(drive)),
            SurfaceKind::Blast(charge) => {
                let (centre, normal) = middle(places);
                let around = [time - 0.5 * dt, time + 0.5 * dt];
                pressed(loads.charges[charge as usize].pressure(centre, normal, around))
            }
            SurfaceKind::Moving(load) => moments[load as usize].forces(&places),
            SurfaceKind::Transmit => std::array::from_fn(|c| damped(areas[c], velocities[c], face.impedance)),
        };
        face.power = 0.0;
        for (corner, &n) in nodes.iter().enumerate() {
            let (force, v) = (forces[corner].map(|c| quantum.round(c)), velocities[corner]);
            for a in 0..3 {
                block.f[a][n] += force[a];
                vote.force_bound = vote.force_bound.max(force[a].abs());
            }
            face.force[corner] = force;
            face.power += force[0] * v[0] + force[1] * v[1] + force[2] * v[2];
        }
        if kind == SurfaceKind::Transmit {
            let x = face.corners.map(|n| at(&block.x, n as usize));
            vote.limit = vote.limit.min(damper_limit(&x, face.together, face.impedance[2], damping));
        }
    }
    vote
}

/// The step up to which dampers on `together` faces of an element are stable beside its stiffness, its viscosity and its
/// hourglass control. All damping acts with the velocities of half a step before, so the corners of the element need
/// `1 - dt C/(2m) - dt^2 K/(4m) > 0` in every mode; the largest of each term are added here:
/// `1 - r dt (n + d) - (r dt)^2` with `r` the wave speed over the least height and `d = 8 h + 2 l` of the coefficients of
/// hourglass control and linear viscosity.
fn damper_limit(x: &[[f64; 3]; 8], together: f64, speed: f64, damping: f64) -> f64 {
    let volume = hex8::volume(x);
    let area = |face: &[usize; 4]| {
        let p = face.map(|corner| x[corner]);
        0.5 * norm(cross(minus(p[2], p[0]), minus(p[3], p[1])))
    };
    let rate = speed * FACES.iter().map(area).fold(0.0, f64::max) / volume;
    let damped = rate * (together + damping);
    2.0 / (damped + damped.mul_add(damped, 4.0 * rate * rate).sqrt())
}

/// Work of the loads in the step around the time at which they acted.
pub(crate) fn work(faces: &[LoadedFace], block: &Block, step: &TimeStep<'_>) -> Work {
    let (half_steps, share) = (step.half_steps(), step.share_before());
    let quantum = step.dithered();
    let mut sum = Work::default();
    for face in faces {
        let after: f64 = face
            .nodes
            .iter()
            .zip(&face.force)
            .map(|(&n, f)| f[0] * block.v[0][n] + f[1] * block.v[1][n] + f[2] * block.v[2][n])
            .sum();
        sum.merge(Work::of([face.power, after].map(|power| half_steps * power), share, quantum));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_on_all_faces_is_pressure_times_the_volume_gradient() {
        let x = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.2, 1.1, 0.1],
            [0.0, 1.0, 0.2],
            [0.1, 0.0, 1.0],
            [1.0, 0.2, 1.3],
            [1.1, 1.0, 1.0],
            [-0.1, 1.1, 0.9],
        ];
        let mut sum = [[0.0; 3]; 8];
        for face in FACES {
            let areas = corner_areas(face.map(|c| x[c]));
            for (corner, area) in face.into_iter().zip(areas) {
                (0..3).for_each(|a| sum[corner][a] += area[a]);
            }
        }
        for (found, expected) in sum.iter().zip(hex8::volume_gradient(&x)) {
            for a in 0..3 {
                assert!((found[a] - expected[a]).abs() < 1e-15, "{found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_damped_cube_steps_by_the_golden_section_of_its_crossing_time_less_what_else_damps_it() {
        let corner =
            |c: usize| [f64::from([0, 2, 2, 0][c % 4]), f64::from([0, 0, 2, 2][c % 4]), 2.0 * (c / 4) as f64];
        let x: [[f64; 3]; 8] = std::array::from_fn(corner);
        let limit = |faces, damping| damper_limit(&x, faces, 4.0, damping) / 0.5;
        assert!((limit(1.0, 0.0) - 0.618_033_988_749_895).abs() < 1e-14);
        // Hourglass control of 0.1, linear viscosity of 0.2.
        assert!((limit(1.0, 1.2) - 0.387).abs() < 1e-3 && limit(3.0, 1.2) < 0.23);
    }
}
