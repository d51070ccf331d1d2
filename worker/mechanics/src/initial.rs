//! The state a run starts from: masses by the shares of element masses that their nodes carry and those that a deck puts at nodes, elements at rest volume without deviatoric stress,
//! gases at their pressure, explosives with the time until they are lit.

mod quanta;
mod stress;

pub use quanta::{force_references, quanta};
pub use stress::{InitialStress, PointStress, Points, stress, stress_fault};

use rayon::prelude::*;

use crate::{
    burn::lighting_time,
    constraint::{Constraint, MAX_WALLS},
    contact::{Extent, Settings},
    element::{beam2, hex8::points, shell4, spring2, tet10},
    exact::Quantum,
    failure::scatter::Scatter,
    material::Material,
    mesh::{FACES, Mesh, Part, SolidAxes, Topology, axes::turn, laminate},
    rigid::Body,
    setup::Setup,
    state::{ALIVE, GlobalState, N_FIELDS, PartHistory, ShellState, field, write_sparsely, zeros},
    vectors::{cross, dot, minus},
};

/// The state at time zero.
///
/// Nodal masses are exact sums of rounded shares, so that the order of elements and the joins do not matter.
///
/// # Errors
/// Names the first element without a positive volume, and the first node of a spring without mass.
pub fn state(
    mesh: &Mesh,
    setup: &Setup,
    velocity: &[[f64; 3]],
    constraint: &[u16],
) -> Result<GlobalState, String> {
    let n_elements = mesh.n_elements();
    let mut state = GlobalState {
        cycle: 0,
        time: 0.0,
        x: mesh.positions.clone(),
        v: velocity.to_vec(),
        mass: Vec::new(),
        constraint: constraint.to_vec(),
        initial_volume: Vec::with_capacity(n_elements),
        elements: std::array::from_fn(|_: usize| vec![0.0; n_elements]),
        eroded: vec![ALIVE; if setup.erosion.is_on() { n_elements } else { 0 }],
        strain: vec![0.0; if setup.erosion.counts_strain() { n_elements } else { 0 }],
        contact: zeros(setup.contact.as_ref().map_or(0, Settings::n_history), mesh.n_nodes()),
        shells: ShellState::default(),
        own: zeros(mesh.parts.iter().map(Part::n_own).max().unwrap_or(0), n_elements),
        history: Vec::new(),
    };
    if let Some(settings) = &setup.contact {
        settings.bind(&mut state.contact);
    }
    for (p, part) in (0..).zip(&mesh.parts) {
        let material = &setup.materials[part.material as usize];
        let variables = part.columns(material);
        if !variables.is_empty() {
            let mut columns: Vec<Vec<f64>> =
                variables.iter().map(|variable| vec![variable.initial; part.n_elements()]).collect();
            lay_axes(part, material, &mesh.positions, &mut columns)?;
            state.history.push(PartHistory { part: p, first: state.initial_volume.len() as u32, columns });
        }
        let first = state.initial_volume.len();
        state.initial_volume.extend(part.volumes(&mesh.positions));
        let of_part = first..state.initial_volume.len();
        for (e, &v) in state.initial_volume[of_part.clone()].iter().enumerate() {
            if v <= 0.0 || !v.is_finite() {
                return Err(format!(
                    "element {} of part `{}`: volume {v:e}, must be positive",
                    part.element_ids[e], part.name
                ));
            }
        }
        // Zeros stay unwritten.
        for (field, value) in [
            (field::TEMPERATURE, material.initial_temperature()),
            (field::RELATIVE_VOLUME, 1.0),
            (field::ENERGY, material.initial_energy()),
            (field::PRESSURE, material.initial_pressure()),
        ] {
            if value.to_bits() != 0 {
                state.elements[field][of_part.clone()].par_iter_mut().for_each(|place| *place = value);
            }
        }
        if let Topology::Trusses { cable: Some(cable), .. } = part.topology {
            for (field, value) in cable.at_start(material) {
                state.elements[field][of_part.clone()]
                    .iter_mut()
                    .for_each(|place| write_sparsely(place, value));
            }
        }
        if let Topology::EightPoint { .. } = part.topology {
            for of_point in &mut state.own[points::TEMPERATURES] {
                of_point[of_part.clone()].fill(material.initial_temperature());
            }
        }
        if let Topology::Tetrahedra { .. } = part.topology {
            for (array, value) in state.own.iter_mut().zip(tet10::at_start(material)) {
                array[of_part.clone()].fill(value);
            }
        }
        if let Some(speed) = material.detonation_speed() {
            let times = state.elements[field::TIME_TO_LIGHT][of_part].par_iter_mut();
            times.enumerate().for_each(|(e, time)| {
                let corners = part.corners_at(e, &mesh.positions);
                let centre = std::array::from_fn(|a| corners.iter().map(|x| x[a]).sum::<f64>() * 0.125);
                *time = lighting_time(&setup.detonations, centre, speed);
            });
        }
    }
    debug_assert_eq!(state.elements.len(), N_FIELDS);
    state.mass = masses(mesh, setup, &state.initial_volume);
    spring2::start(mesh, &mut state)?;
    shells(mesh, setup, &mut state);
    Ok(state)
}

/// Nodal masses of elements of these initial volumes, and those that a deck puts at nodes.
fn masses(mesh: &Mesh, setup: &Setup, initial_volume: &[f64]) -> Vec<f64> {
    let mut mass_of = Vec::with_capacity(initial_volume.len());
    for (p, part) in (0..).zip(&mesh.parts) {
        let body = setup.bodies.iter().find(|body| body.parts.binary_search(&p).is_ok());
        let density =
            setup.materials[part.material as usize].density * body.map_or(1.0, |body| body.nodal_scale);
        let of_part = mass_of.len()..mass_of.len() + part.n_elements();
        mass_of.extend(initial_volume[of_part].iter().map(|volume| density * volume));
    }
    let masses = mass_of.iter().copied().chain(mesh.lumped.iter().map(|(_, mass)| *mass));
    let heaviest = masses.fold(f64::MIN_POSITIVE, f64::max);
    // 64 shares at a node stay below 2^53 quanta.
    let quantum = Quantum::for_reference(heaviest, 50);
    let mut nodal = vec![0.0; mesh.n_nodes()];
    let mut index = 0;
    for part in &mesh.parts {
        for e in 0..part.n_elements() {
            for (&n, share) in part.nodes_of(e).iter().zip(part.shares(e)) {
                nodal[n as usize] += quantum.round(mass_of[index] * share);
            }
            index += 1;
        }
    }
    for &(n, mass) in &mesh.lumped {
        nodal[n as usize] += quantum.round(mass);
    }
    nodal
}

/// Gives elements the axes of their material.
///
/// # Errors
/// Names the first element that its guide gives none.
pub fn axes(
    state: &mut GlobalState,
    mesh: &Mesh,
    materials: &[Material],
    given: &[SolidAxes],
) -> Result<(), String> {
    for axes in given {
        let part = &mesh.parts[axes.part as usize];
        let Some(of_law) = materials[part.material as usize].strength.axes() else { continue };
        let Some(history) = state.history.iter_mut().find(|history| history.part == axes.part) else {
            continue;
        };
        for e in 0..part.n_elements() {
            let x = part.corners_at(e, &mesh.positions);
            let own = axes.of(&x).ok_or_else(|| {
                format!(
                    "element {} of part `{}` has no axes: it is flat, normal to the vector or on the line; choose other `axes`",
                    part.element_ids[e], part.name
                )
            })?;
            let turn = turn(&of_law, &own);
            for (column, turn) in history.columns.iter_mut().zip(turn) {
                column[e] = turn;
            }
            if let Topology::Tetrahedra { .. } = part.topology {
                for (k, turn) in turn.into_iter().enumerate() {
                    let of_points = &mut state.own[tet10::history(k)];
                    of_points.iter_mut().for_each(|of_point| of_point[history.first as usize + e] = turn);
                }
            }
        }
    }
    Ok(())
}

/// Gives elements the damage by which their strength scatters.
pub fn scatter(state: &mut GlobalState, mesh: &Mesh, given: &[Scatter]) {
    let mut first = 0;
    for (p, part) in (0..).zip(&mesh.parts) {
        for scatter in given.iter().filter(|scatter| scatter.part == p) {
            for (index, &number) in (first..).zip(&part.element_ids) {
                let damage = scatter.damage(number, state.initial_volume[index]);
                state.elements[field::DAMAGE][index] = damage;
                let of_points = match part.topology {
                    Topology::EightPoint { .. } => points::DAMAGES,
                    Topology::Tetrahedra { .. } => tet10::DAMAGES,
                    _ => 0..0,
                };
                state.own[of_points].iter_mut().for_each(|of_point| of_point[index] = damage);
            }
        }
        first += part.n_elements();
    }
}

/// Gives nodes of shells and beams their rotation rates at the start: those that are prescribed, and else what is given by node, or none
/// where `given` is empty.
pub fn spin(state: &mut GlobalState, setup: &Setup, given: &[[f64; 3]]) {
    for (n, spin) in state.shells.spin.iter_mut().enumerate() {
        if state.shells.inertia[n] > 0.0 {
            let given = given.get(n).copied().unwrap_or_default();
            let held =
                setup.constraints[usize::from(state.constraint[n])].spin(&setup.loads.curves, 0.0, 0.0);
            *spin = std::array::from_fn(|axis| held[axis].unwrap_or(given[axis]));
        }
    }
}

/// Gives the elements of a laminate the direction of angle 0, its first history variables.
///
/// # Errors
/// Where the axis has no part in the plane of an element.
fn lay_axes(
    part: &Part,
    material: &Material,
    positions: &[[f64; 3]],
    columns: &mut [Vec<f64>],
) -> Result<(), String> {
    let Some(laminate) = part.section().and_then(|section| section.laminate.as_ref()) else { return Ok(()) };
    for e in 0..part.n_elements() {
        let [a, b, c, d, ..] = part.corners(e);
        let x = [a, b, c, d].map(|n| positions[n as usize]);
        let along = laminate::direction(laminate.axis, material, &x).ok_or_else(|| {
            format!(
                "element {} of part `{}`: the axis of its plies is normal to it; take another axis",
                part.element_ids[e], part.name
            )
        })?;
        for (column, along) in columns.iter_mut().zip(along) {
            column[e] = along;
        }
    }
    Ok(())
}

/// The state of shells and beams at time zero. A node has a quarter of the rotational inertia of each of its shells and half of that of
/// each of its beams, see [`Part::gyration`].
fn shells(mesh: &Mesh, setup: &Setup, state: &mut GlobalState) {
    if !mesh.parts.iter().any(Part::turns_nodes) {
        return;
    }
    let n_elements = mesh.n_elements();
    let mut inertia_of = vec![0.0; n_elements];
    let fields = &mut state.own;
    for (part, first) in mesh.parts.iter().zip(mesh.element_offsets()) {
        let material = &setup.materials[part.material as usize];
        if let Topology::Beams { section, across, .. } = &part.topology {
            for (local, across) in across.iter().enumerate() {
                let [a, b, ..] = part.corners_at(local, &mesh.positions);
                let e = first + local;
                for (field, axis) in fields.iter_mut().zip(beam2::axis(a, b, *across)) {
                    field[e] = axis;
                }
                for fibre in fields[beam2::ELEMENT..section.n_fields()].chunks_mut(beam2::FIBRE) {
                    fibre[beam2::TEMPERATURE][e] = material.initial_temperature();
                }
                let volume = state.initial_volume[e];
                inertia_of[e] = material.density * volume * part.gyration(local, volume);
            }
        }
        let Topology::Shells { section, thicknesses, .. } = &part.topology else { continue };
        for local in 0..part.n_elements() {
            let e = first + local;
            let thickness = section.thickness_of(thicknesses, local);
            fields[shell4::THICKNESS][e] = thickness;
            for layer in fields[shell4::ELEMENT..section.n_fields()].chunks_mut(shell4::LAYER) {
                layer[shell4::LAYER - 1][e] = material.initial_temperature();
            }
            let volume = state.initial_volume[e];
            inertia_of[e] = material.density * volume * part.gyration(local, volume);
        }
    }
    let largest = inertia_of.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let quantum = Quantum::for_reference(largest, 50);
    let mut inertia = vec![0.0; mesh.n_nodes()];
    for (part, first) in mesh.parts.iter().zip(mesh.element_offsets()) {
        if !part.turns_nodes() {
            continue;
        }
        for e in 0..part.n_elements() {
            let eighth = quantum.round(inertia_of[first + e] * 0.125);
            // A shell has each corner twice, a beam each end four times.
            for n in part.corners(e) {
                inertia[n as usize] += eighth;
            }
        }
    }
    state.shells = ShellState { spin: vec![[0.0; 3]; mesh.n_nodes()], inertia };
}

/// Area of the largest face of a hexahedron.
pub(crate) fn largest_face(x: &[[f64; 3]; 8]) -> f64 {
    let mut greatest = 0.0_f64;
    for [p, q, r, s] in FACES {
        let normal = cross(minus(x[r], x[p]), minus(x[s], x[q]));
        greatest = greatest.max(dot(normal, normal));
    }
    // The root of the greatest square is the greatest root, rounding included.
    0.5 * greatest.sqrt()
}

/// Gives each node of a part that feels a wall a constraint that says so, beside the walls that a deck gave it.
///
/// # Errors
/// If there are more than [`MAX_WALLS`] walls or more kinds of constraint than an index can tell apart.
pub fn bind_walls(mesh: &Mesh, setup: &mut Setup, constraint: &mut [u16]) -> Result<(), String> {
    if setup.walls.len() > MAX_WALLS {
        return Err(format!("{} rigid walls, at most {MAX_WALLS} fit a run; join some", setup.walls.len()));
    }
    let mut mask = vec![0_u32; mesh.n_nodes()];
    for (w, wall) in setup.walls.iter().enumerate() {
        for (part, _) in mesh.parts.iter().zip(&wall.parts).filter(|(_, feels)| **feels) {
            for &n in &part.nodes {
                mask[n as usize] |= 1 << w;
            }
        }
    }
    let mut index_of = std::collections::BTreeMap::new();
    for (n, &walls) in mask.iter().enumerate().filter(|(_, walls)| **walls != 0) {
        let held = constraint[n];
        let next = setup.constraints.len();
        let index = *index_of.entry((held, walls)).or_insert(next);
        if index == next {
            let held = setup.constraints[held as usize];
            setup.constraints.push(Constraint { walls: walls | held.walls, ..held });
        }
        constraint[n] =
            u16::try_from(index).map_err(|_| "more than 65,535 kinds of constraint".to_owned())?;
    }
    Ok(())
}

/// By part, the least time step that its elements and those of the parts that it may meet allow in their initial geometry (time): the
/// thinnest way through an element over the speed of longitudinal waves, times the safety factor. Elements of rigid bodies allow any.
pub fn closing_steps(
    mesh: &Mesh,
    materials: &[Material],
    bodies: &[Body],
    safety_factor: f64,
    contact: &Settings,
) -> Vec<f64> {
    let of_part = |p: usize| {
        let part = &mesh.parts[p];
        if bodies.iter().any(|body| body.parts.binary_search(&(p as u32)).is_ok()) {
            return f64::INFINITY;
        }
        let material = &materials[part.material as usize];
        let speed = material.sound_speed();
        let volumes = part.corner_volumes(&mesh.positions);
        let thinnest = volumes.into_par_iter().enumerate().map(|(e, volume)| {
            let x = part.corners_at(e, &mesh.positions);
            match part.thickness_of(e) {
                // The height above the longest side, as if it were a parallelogram.
                Some(thickness) => volume / (thickness * longest(&[x[0], x[1], x[2], x[3]])),
                None => volume / largest_face(&x),
            }
        });
        safety_factor * thinnest.reduce(|| f64::INFINITY, f64::min) / speed
    };
    let alone: Vec<f64> = (0..mesh.parts.len()).map(of_part).collect();
    (0..alone.len())
        .map(|p| {
            let meets = (0..alone.len()).filter(|&q| contact.permits(p as u32, q as u32));
            meets.map(|q| alone[q]).fold(alone[p], f64::min)
        })
        .collect()
}

/// Length of the longest side.
fn longest(x: &[[f64; 3]; 4]) -> f64 {
    let side = |i: usize| (0..3).map(|a| (x[(i + 1) & 3][a] - x[i][a]).powi(2)).sum::<f64>().sqrt();
    (0..4).map(side).fold(0.0, f64::max)
}

/// The greatest speed at which each part closes in on a part that it may meet, itself included (length per time): the
/// diagonal of the box around both parts' initial velocities. `velocity` by global node.
pub fn closing_speeds(mesh: &Mesh, contact: &Settings, velocity: &[[f64; 3]]) -> Vec<f64> {
    let boxes: Vec<Extent> = mesh
        .parts
        .iter()
        .map(|part| {
            let mut extent = Extent::NONE;
            part.nodes.iter().for_each(|&n| extent.add(velocity[n as usize]));
            extent
        })
        .collect();
    let closing = |a: &Extent, b: &Extent| {
        (0..3).map(|i| (a.max[i] - b.min[i]).max(b.max[i] - a.min[i]).powi(2)).sum::<f64>().sqrt()
    };
    (0..boxes.len())
        .map(|p| {
            (0..boxes.len())
                .filter(|&q| contact.permits(p as u32, q as u32))
                .map(|q| closing(&boxes[p], &boxes[q]))
                .fold(0.0, f64::max)
        })
        .collect()
}
