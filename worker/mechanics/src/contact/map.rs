//! Map: what contact does to a surface in one state, for people to look at. No cycle uses it.
//!
//! The forces of a state follow from its positions alone, so they are computed again from these, with the very
//! functions of a cycle. Friction and particles are left out: what is mapped is the push between bodies.

use super::{
    Batch, Contact, Exclusions, Face, Settings, Surface, WARNING, WorkUnit,
    search::{Bounds, candidates},
    sort,
    zone::Frame,
};
use crate::{exact::Quantum, lanes::Width};

/// Contact of a surface in one state.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Force of contact on each surface node, friction left out.
    pub force: Vec<[f64; 3]>,
    /// Distance of each surface node from the nearest face that it may meet, or of a face's corner from a node that
    /// meets the face; at most [`Map::reach`] (length).
    pub gap: Vec<f64>,
    /// Pressure of contact on each face, positive where it is pushed inwards (a shell: from either side): forces on its nodes, shared by the faces
    /// that they push on in proportion to the areas seen along the force, over its area.
    pub pressure: Vec<f64>,
    /// Distances are not looked at beyond this (length).
    pub reach: f64,
}

impl Map {
    /// Contact at positions `x` by surface node. `mass` gives the mass of a global node, `quantum` is that of forces.
    pub fn new(
        surface: &Surface,
        x: &[[f64; 3]],
        settings: &Settings,
        exclusions: &Exclusions,
        mass: &dyn Fn(u32) -> f64,
        quantum: Quantum,
    ) -> Self {
        let mut settings = settings.clone();
        settings.friction.fill(0.0);
        // What they lack of their radii is not known here, and they are no bodies.
        settings.particles.clear();
        let units: Vec<WorkUnit> = sort(surface, x, &settings, exclusions);
        let units: Vec<&WorkUnit> = units.iter().filter(|unit| !unit.is_empty()).collect();
        let batch = Batch::gather(surface, &units, mass, exclusions);
        let index: Vec<usize> = batch
            .nodes
            .iter()
            .filter_map(|node| surface.node_index(node.global))
            .map(|n| n as usize)
            .collect();
        let packed: [Vec<f64>; 3] = std::array::from_fn(|a| index.iter().map(|&n| x[n][a]).collect());
        let at_rest = packed.each_ref().map(|x| vec![0.0; x.len()]);
        let mut forces = at_rest.clone();
        Contact::new(&batch, &settings, &packed, Width::best()).forces(
            &packed,
            &at_rest,
            0.0,
            quantum,
            quantum,
            &mut forces,
        );
        let mut force = vec![[0.0; 3]; x.len()];
        for (i, &n) in index.iter().enumerate() {
            force[n] = std::array::from_fn(|a| forces[a][i]);
        }
        let reach = WARNING * settings.gap;
        let gap = gaps(&batch, &settings, &packed, &index, x.len());
        let pressure = pressures(surface, x, &force);
        Self { force, gap, pressure, reach }
    }
}

/// Distances of surface nodes from what they may meet.
fn gaps(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3], index: &[usize], n: usize) -> Vec<f64> {
    let reach = WARNING * settings.gap;
    let mut least = vec![reach; n];
    let pairs = candidates(batch, settings, x);
    let at = |n: u32| x.each_ref().map(|x| x[n as usize]);
    for (&node, bounds) in pairs.nodes.iter().zip(pairs.starts.windows(2)) {
        let p = at(node);
        for &face in &pairs.faces[bounds[0] as usize..bounds[1] as usize] {
            let face = &batch.faces[face as usize];
            let corners = face.nodes.map(at);
            if !Bounds::of(&corners, reach).holds(p) {
                continue;
            }
            let nearest = Frame::new(&corners).nearest(p);
            let distance = nearest.distance2.sqrt();
            for touched in [node].into_iter().chain(face.nodes) {
                let place = &mut least[index[touched as usize]];
                *place = place.min(distance);
            }
        }
    }
    least
}

/// Pressure on each face from the forces on its nodes.
fn pressures(surface: &Surface, x: &[[f64; 3]], force: &[[f64; 3]]) -> Vec<f64> {
    let dot = |a: [f64; 3], b: [f64; 3]| a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]));
    // A quarter of the area as a vector, outward.
    let quarter: Vec<[f64; 3]> = surface
        .faces
        .iter()
        .map(|face| {
            let [a, b, c, d] = face.nodes.map(|n| x[n as usize]);
            let (p, q): ([f64; 3], [f64; 3]) =
                (std::array::from_fn(|i| c[i] - a[i]), std::array::from_fn(|i| d[i] - b[i]));
            [
                0.125 * (p[1] * q[2] - p[2] * q[1]),
                0.125 * (p[2] * q[0] - p[0] * q[2]),
                0.125 * (p[0] * q[1] - p[1] * q[0]),
            ]
        })
        .collect();
    let direction = |n: u32| {
        let f = force[n as usize];
        let size = dot(f, f).sqrt();
        (size > 0.0).then(|| (f.map(|c| c / size), size))
    };
    // How much of a face is seen along a force; a shell is pushed on either side.
    let facing = |face: &Face, area: [f64; 3], along: [f64; 3]| {
        let inwards = -dot(area, along);
        if Face::is_shell(&face.corners) { inwards.abs() } else { inwards.max(0.0) }
    };
    let mut seen = vec![0.0; x.len()];
    for (face, &area) in surface.faces.iter().zip(&quarter) {
        for n in face.nodes {
            if let Some((along, _)) = direction(n) {
                seen[n as usize] += facing(face, area, along);
            }
        }
    }
    let of = |(face, &area): (&Face, &[f64; 3])| {
        let size = dot(area, area).sqrt();
        let push = |n: u32| match direction(n) {
            Some((along, force)) if seen[n as usize] > 0.0 && size > 0.0 => {
                0.25 * (force / seen[n as usize]) * (facing(face, area, along) / size)
            }
            _ => 0.0,
        };
        face.nodes.map(push).iter().sum()
    };
    surface.faces.iter().zip(&quarter).map(of).collect()
}
