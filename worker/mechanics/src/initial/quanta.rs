//! The quanta of a run's sums.

use rayon::prelude::*;

use super::largest_face;
use crate::{
    constraint::Circle,
    element::spring2,
    exact::{ENERGY_BITS, FORCE_BITS, MOMENTUM_BITS, Quanta, Quantum},
    load::{Drive, SurfaceKind},
    mesh::{Mesh, Part, Topology},
    rigid::{Body, switch::Switch},
    setup::Setup,
    state::{GlobalState, field},
    vectors::dot,
    wall::{Motion, RigidWall},
};

/// The quanta of a run's sums, from the deck's data alone.
///
/// Force: `F_ref = A max(K + 4G/3, rho v^2, p)` with A the largest initial face and p the greatest pressure load; the bulk modulus K of a gas is
/// more than its pressure at the start, that of an explosive (`rho D^2`) more than the pressure of detonation. Energy:
/// the initial kinetic energy, that of what is moved as the deck says, and, over the whole volume, a thousandth of the bulk modulus or the internal
/// energy at the start. Momentum: all mass at the greatest initial or prescribed speed, of walls too, a thousandth of the fastest
/// sound, or the speed to which its internal energy at the start could bring a material; where loads act, which bring bodies at rest
/// to speeds that no number of the deck has, a twentieth of the fastest sound. It must not depend on the end of the run: that may be another when it goes on.
///
/// What loads bring about nobody knows beforehand: sums that come near what is exact ask for coarser quanta ([`Quantum::sum_bound`]).
///
/// Springs have no modulus: their force and energy are those at an elongation of their length, of which the energy counts by a tenth, and the
/// momentum is that which this energy gives to all mass.
///
/// Parts of bodies that stay rigid have no inner forces ([`inert`]). A steel floor of a few cells would otherwise leave nothing of the forces in a
/// sheet: with faces of 16 m2 the quantum is about 1 N.
pub fn quanta(mesh: &Mesh, setup: &Setup, state: &GlobalState) -> Quanta {
    let speed2 = state.v.iter().map(|v| dot(*v, *v)).fold(0.0, f64::max);
    let prescribed = Prescribed::of(mesh, setup, state);
    let curves = &setup.loads.curves;
    let top_speed2 = speed2.max(prescribed.speed2);
    let pressure = setup
        .loads
        .surfaces
        .iter()
        .map(|surface| match surface.kind {
            SurfaceKind::Pressure(drive) => drive.greatest(curves),
            SurfaceKind::Blast(charge) => setup.loads.charges[charge as usize].greatest,
            SurfaceKind::Moving(load) => setup.loads.moving[load as usize].greatest(curves),
            SurfaceKind::Transmit => 0.0,
        })
        .fold(0.0, f64::max);
    let mut arm = 0.0_f64;
    let (mut force, mut stored, mut sound, mut driven2) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    // Energy of springs that are drawn by their length.
    let mut drawn = 0.0;
    let mut index = 0;
    let inert = inert(mesh, setup);
    for (p, part) in mesh.parts.iter().enumerate() {
        if let Topology::Springs { spring, .. } = &part.topology {
            for at in index..index + part.n_elements() {
                let length = state.initial_volume[at];
                let speed = top_speed2.sqrt().max(length * spring2::fastest(state, at));
                let pull = spring.reference(length, speed);
                force = force.max(pull);
                drawn += pull * length;
            }
            index += part.n_elements();
            continue;
        }
        let material = &setup.materials[part.material as usize];
        let modulus = material.wave_modulus();
        sound = sound.max((modulus / material.density).sqrt());
        let strength = if inert[p] { 0.0 } else { modulus.max(material.density * top_speed2) };
        let [of_part, longest] = force_and_arm(part, &mesh.positions, strength, pressure);
        (force, arm) = (force.max(of_part), arm.max(longest));
        for _ in 0..part.n_elements() {
            let energy = state.elements[field::ENERGY][index];
            let least = if inert[p] { 0.0 } else { 1e-3 * material.bulk() };
            stored += least.max(energy) * state.initial_volume[index];
            driven2 = driven2.max(2.0 * energy / material.density);
            index += 1;
        }
    }
    stored += 0.1 * drawn;
    let total_mass: f64 = state.mass.iter().sum();
    driven2 = driven2.max(2.0 * drawn / total_mass);
    let kinetic: f64 = state.v.iter().zip(&state.mass).map(|(v, m)| 0.5 * m * dot(*v, *v)).sum();
    let spinning: f64 = setup.bodies.iter().map(|body| 0.5 * dot(body.start.spin, body.start.momentum)).sum();
    let least = if setup.loads.are_any() { 0.05 } else { 1e-3 } * sound;
    Quanta {
        force: Quantum::for_reference(force, FORCE_BITS),
        energy: Quantum::for_reference(kinetic + spinning + prescribed.energy + stored, ENERGY_BITS),
        momentum: Quantum::for_reference(
            total_mass * top_speed2.max(driven2).sqrt().max(least),
            MOMENTUM_BITS,
        ),
        arm: if arm > 0.0 { Quantum::for_reference(arm, 0).value() } else { 1.0 },
    }
}

/// What motions that the deck prescribes come to at most.
struct Prescribed {
    /// Square of the greatest speed, of walls too.
    speed2: f64,
    /// Kinetic energy of all that is moved, each at its greatest speed.
    energy: f64,
}

impl Prescribed {
    fn of(mesh: &Mesh, setup: &Setup, state: &GlobalState) -> Self {
        let curves = &setup.loads.curves;
        let size2 = |drives: &[Option<Drive>; 3]| {
            drives.iter().flatten().map(|v| v.greatest(curves).powi(2)).sum::<f64>()
        };
        let about = |circle: &Circle, x: &[f64; 3]| {
            let across = (0..3).filter(|&a| a != usize::from(circle.axis));
            let arm2: f64 = across.map(|a| (x[a] - circle.point[a]).powi(2)).sum();
            circle.rate.greatest(curves).powi(2) * arm2
        };
        let of_wall = |wall: &RigidWall| match wall.motion {
            Motion::Fixed => 0.0,
            Motion::Driven(velocity) => velocity.iter().map(|v| v.greatest(curves).powi(2)).sum(),
            Motion::Free { velocity, .. } => velocity.iter().map(|v| v * v).sum::<f64>(),
        };
        let of_body = |body: &Body| {
            let reach = body.places.iter().map(|x| dot(*x, *x)).fold(0.0, f64::max).sqrt();
            let circle = body.circle.map_or(0.0, |circle| {
                circle.rate.greatest(curves).mul_add(reach, about(&circle, &body.start.centre).sqrt())
            });
            (size2(&body.spin).sqrt().mul_add(reach, size2(&body.velocity).sqrt()) + circle).powi(2)
        };
        let of_switch = |switch: &Switch| {
            size2(&switch.spin).sqrt().mul_add(switch.reach(mesh), size2(&switch.velocity).sqrt()).powi(2)
        };
        let mut prescribed =
            Self { speed2: setup.walls.iter().map(of_wall).fold(0.0, f64::max), energy: 0.0 };
        let constraints: Vec<f64> = setup.constraints.iter().map(|c| size2(&c.velocity)).collect();
        for ((&index, x), &mass) in state.constraint.iter().zip(&state.x).zip(&state.mass) {
            let circle = setup.constraints[index as usize].circle;
            prescribed
                .add(constraints[index as usize] + circle.map_or(0.0, |circle| about(&circle, x)), mass);
        }
        setup.bodies.iter().for_each(|body| prescribed.add(of_body(body), body.mass));
        for switch in &setup.switches {
            let nodes = switch.parts.iter().flat_map(|&part| &mesh.parts[part as usize].nodes);
            prescribed.add(of_switch(switch), nodes.map(|&node| state.mass[node as usize]).sum());
        }
        prescribed
    }

    /// Something of this mass is moved with this speed squared at most.
    fn add(&mut self, speed2: f64, mass: f64) {
        self.speed2 = self.speed2.max(speed2);
        self.energy = (0.5 * mass).mul_add(speed2, self.energy);
    }
}

/// Greatest force of an element of a part whose material resists with `strength` under loads of `pressure`, and the greatest arm of moments of one that
/// turns its nodes. Maxima have no order.
fn force_and_arm(part: &Part, positions: &[[f64; 3]], strength: f64, pressure: f64) -> [f64; 2] {
    let of_element = |e: usize| {
        let x = part.corners_at(e, positions);
        match &part.topology {
            Topology::Structured { .. }
            | Topology::Explicit { .. }
            | Topology::EightPoint { .. }
            | Topology::Tetrahedra { .. } => [largest_face(&x) * strength.max(pressure), 0.0],
            // A shell pulls with its section; only loads act on its face.
            Topology::Shells { section, thicknesses, .. } => {
                let area = largest_face(&x);
                let thickness = section.thickness_of(thicknesses, e);
                let force = (area.sqrt() * thickness * strength.max(pressure)).max(area * pressure);
                [force, area.sqrt()]
            }
            Topology::Trusses { area, .. } => [area * strength.max(pressure), 0.0],
            Topology::Springs { .. } => [0.0; 2],
            Topology::Beams { section, .. } => {
                [section.area * strength.max(pressure), part.volume(e, &x) / section.area]
            }
        }
    };
    (0..part.n_elements())
        .into_par_iter()
        .map(of_element)
        .reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
}

/// By part the force of an element that resists with its modulus; none of springs and of [`inert`] parts. Quanta follow from the greatest of them, so
/// forces in a part with a far smaller one have few digits.
pub fn force_references(mesh: &Mesh, setup: &Setup) -> Vec<f64> {
    let inert = inert(mesh, setup);
    let of_part = |(part, inert): (&Part, bool)| {
        let modulus = setup.materials[part.material as usize].wave_modulus();
        force_and_arm(part, &mesh.positions, if inert { 0.0 } else { modulus }, 0.0)[0]
    };
    mesh.parts.iter().zip(inert).map(of_part).collect()
}

/// By part whether it belongs to a body that is rigid for the whole run and that may touch no other such body: what pushes it comes from parts
/// that deform, from loads and from walls. None, where nothing deforms.
fn inert(mesh: &Mesh, setup: &Setup) -> Vec<bool> {
    let body_of = |part: u32| setup.bodies.iter().position(|body| body.parts.binary_search(&part).is_ok());
    let bodies: Vec<Option<usize>> = (0..mesh.parts.len() as u32).map(body_of).collect();
    let meets = |p: usize, q: usize| {
        let [a, b] = [p as u32, q as u32];
        bodies[q].is_some()
            && bodies[q] != bodies[p]
            && setup.contact.as_ref().is_some_and(|contact| contact.permits(a, b) || contact.permits(b, a))
    };
    let all = 0..bodies.len();
    let inert = all.clone().map(|p| bodies[p].is_some() && !all.clone().any(|q| meets(p, q)));
    let inert: Vec<bool> = inert.collect();
    if inert.iter().all(|&inert| inert) { vec![false; inert.len()] } else { inert }
}
