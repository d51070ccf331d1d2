//! A typed deck becomes a model: the one set of checks on what spans entries, whichever format the deck was written in.
//!
//! The stages, each of which goes on past the faults of the one before as far as it can:
//! 1. names, materials, parts with their blocks, where these stand and what planes of symmetry leave of them;
//! 2. one mesh with one numbering, joins, volumes, masses, velocities;
//! 3. boundaries, walls, loads, rigid bodies, contact, output, which refer to parts and nodes;
//! 4. elements that are turned inside out, sections, contact zones that overlap.

mod assembly;
mod boundary;
mod burn;
mod clamp;
mod contact;
mod control;
mod erosion;
mod joint;
mod load;
mod material;
mod merge;
mod names;
mod node_ids;
mod output;
mod part;
mod placement;
mod region;
mod rigid;
mod section;
mod spans;
mod stress;
mod surface;
mod symmetry;
mod tie;
mod wall;
mod zones;

use mechanics::{
    contact::Settings,
    element::hourglass::Hourglass,
    initial,
    mesh::Topology,
    setup::{Control, Setup},
};

use crate::{
    log::Log,
    model::Model,
    place::Place,
    typed::{Deck, mesh::Meshes},
};
use material::Materials;
use names::{Curves, Names};

/// Checks a deck and makes its model; none where it has no control, or nobody waits for it. The model is not to be used after a fault.
pub(crate) fn model(deck: &Deck, meshes: &Meshes, log: &Log<'_>) -> Option<Model> {
    let mut materials = Materials::of(deck, log);
    let hourglass = deck.control.as_ref().and_then(|control| control.hourglass).unwrap_or_default();
    let mut parts = part::make((&deck.parts, hourglass), &mut materials, meshes, log);
    log.wanted()?;
    let materials = materials.list;
    let names = Names::of(&deck.parts, log);
    placement::resolve(deck, &mut parts, &names, &materials, meshes, log);
    log.wanted()?;
    symmetry::cut(deck, &mut parts, log);
    let parts = parts;
    let joins = assembly::joins(&deck.joins, &names, log);
    let mut assembly = assembly::assemble(&parts, &joins, &materials, meshes, log)?;
    log.wanted()?;
    if assembly.mesh.n_elements() == 0 && log.count() == 0 {
        let at = deck.control.as_ref().map_or(Place::text(0), |control| control.at);
        log.fault(at, "a deck without elements", "at least one element", "give a [[part]] a mesh");
        return None;
    }
    let curves = Curves::of(&deck.curves, log);
    let (rigid, switched) = rigid::drafts(&deck.rigid, &names, &curves, &assembly, log);
    let clamps = clamp::boundaries(&deck.parts, &parts, log);
    let intended: Vec<_> = symmetry::boundaries(deck).chain(clamps).collect();
    let supports: Vec<_> = deck.boundaries.iter().chain(&intended).collect();
    let mut conditions = boundary::make((deck, &supports), &names, curves, &parts, &assembly, log);
    assembly.mesh.lumped = load::lumped(deck, &names, &parts, &assembly, log);
    log.wanted()?;
    let bodies = rigid::make(&rigid, &materials, &mut assembly, &mut conditions, log);
    let switches = rigid::make_switches(&switched, &bodies, &materials, &assembly, &conditions, log);
    let joints = joint::make(&deck.joints, &rigid, &bodies, &assembly, log);
    let contact = deck.contact.as_ref().and_then(|contact| {
        contact::make(contact, &names, &mut assembly, &materials, &conditions, &rigid, log)
    });
    log.wanted()?;
    let settings = contact.as_ref().map(|contact| &contact.settings);
    let control = deck.control.as_ref().map(|given| {
        let control = control::make(given, log);
        Control { sort_lag: control::sort_lag(given, control.sort_lag, settings, log), ..control }
    });
    let erosion = erosion::make(deck, (&parts, &assembly), (&rigid, &bodies), log);
    let particles = erosion::particles(deck, &names, &parts, &erosion, log);
    let output = output::make(deck, &names, &assembly, &bodies, log);
    let detonations = burn::make(deck, &materials, &parts, log);
    let axes = parts.iter().filter_map(|part| part.axes).collect();
    let scatter = parts.iter().filter_map(|part| part.scatter).collect();
    let faces = contact.as_ref().map(|contact| (&contact.settings, contact.faces.as_slice()));
    log.wanted()?;
    spans::check(&parts, &assembly, faces, &materials, log);

    for (part, draft) in assembly.mesh.parts.iter_mut().zip(&parts) {
        if draft.eight_points {
            part::warn_of_forms(part, draft, log);
            part.refine_points();
        }
        if let Topology::Tetrahedra { .. } = part.topology {
            part.hourglass = Hourglass::NONE;
        }
    }

    let stress = stress::make(deck, &names, &assembly.mesh, (&materials, &rigid), log);
    let mut velocity = assembly.velocity;
    for (node, index) in conditions.constraint.iter().enumerate() {
        let held = &conditions.constraints[*index as usize];
        let x = assembly.mesh.positions[node];
        let prescribed = held.prescribed(&conditions.loads.curves, x, 0.0, 0.0);
        for (component, prescribed) in velocity[node].iter_mut().zip(prescribed) {
            *component = prescribed.unwrap_or(*component);
        }
    }
    log.wanted()?;
    let control = control?;
    let settings = contact.map(|contact| {
        let settings = contact.settings;
        // After a fault a part may have no material.
        let steps = if log.count() == 0 {
            initial::closing_steps(&assembly.mesh, &materials, &bodies, control.safety_factor, &settings)
        } else {
            Vec::new()
        };
        Settings { erodes: erosion.is_on(), particles, steps, ..settings }
    });
    Some(Model {
        title: deck.title.clone(),
        units: deck.units.name.to_string(),
        mesh: assembly.mesh,
        velocity,
        spin: assembly.spin,
        axes,
        scatter,
        stress,
        constraint: conditions.constraint,
        join_energy: assembly.join_energy,
        setup: Setup {
            materials,
            control,
            contact: settings,
            constraints: conditions.constraints,
            walls: conditions.walls,
            bodies,
            switches,
            joints,
            detonations,
            loads: conditions.loads,
            erosion,
        },
        output,
    })
}
