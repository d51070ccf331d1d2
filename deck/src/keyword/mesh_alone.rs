//! The mesh of a keyword file alone: nodes, elements by part, sets. All other keywords are left out.

use std::collections::{BTreeMap, BTreeSet};

use super::{cards, problem::Problem, read, translate::corners_of};
use crate::{
    bundle::Bundle,
    limits::MAX_NODES,
    log::Log,
    mesh_file::{Body, Found, MeshFile, Read},
    place::Place,
};

/// Reads the first file of a bundle, with what it includes.
///
/// # Errors
/// Its faults, each with its line.
pub(crate) fn read_mesh(bundle: &Bundle<'_>) -> Read {
    let log = Log::keyword(&bundle.files);
    let mut lines = cards::read(bundle, &log);
    let problem = read::read_mesh(&mut lines, &log);
    let (mesh, places) = mesh_of(&problem, &log);
    let (faults, warnings) = log.into_lists();
    if faults.is_empty() { Ok(Found { mesh, places, warnings }) } else { Err(faults) }
}

/// The mesh, and the places of the elements of each body.
fn mesh_of(problem: &Problem, log: &Log<'_>) -> (MeshFile, Vec<Vec<Place>>) {
    let mut mesh = MeshFile {
        nodes: problem.nodes.iter().map(|node| (node.id, node.x)).collect(),
        ..MeshFile::default()
    };
    let mut bodies: BTreeMap<(u32, usize), (Body, Vec<Place>)> = BTreeMap::new();
    let solids = problem.solids.iter().map(|solid| (0, solid.id, solid.part, solid.at, &solid.nodes[..]));
    let mut edges: BTreeMap<u32, [u32; 6]> = BTreeMap::new();
    edges.extend(problem.solids.iter().filter_map(|solid| Some((solid.id, solid.edges?))));
    let shells = problem.shells.iter().map(|shell| (1, shell.id, shell.part, shell.at, &shell.nodes[..]));
    let mut thicknesses: BTreeMap<u32, f64> = BTreeMap::new();
    for shell in &problem.shells {
        if !shell.is_even() {
            let read = format!("shell {} with a thickness at some of its corners", shell.id);
            log.fault(shell.at, read, "one at all corners, or none", "give all, as the section is not read");
        }
        thicknesses.insert(shell.id, shell.thickness(0.0));
    }
    let beams = problem.beams.iter().map(|beam| (2, beam.id, beam.part, beam.at, &beam.nodes[..]));
    let discretes = &problem.discretes;
    let discretes = discretes.iter().map(|spring| (2, spring.id, spring.part, spring.at, &spring.nodes[..]));
    let mut seen: [BTreeMap<u32, Place>; 3] = Default::default();
    for (kind, id, part, at, nodes) in solids.chain(shells).chain(beams).chain(discretes) {
        if let Some(first) = seen[kind].insert(id, at) {
            let expected = format!("a number other than {id}, which {} has", log.line(first, at));
            log.fault(at, format!("element {id}"), expected, "renumber one");
        }
        let on_edges = edges.get(&id).filter(|_| kind == 0).into_iter().flatten();
        let mut all = nodes.iter().chain(on_edges);
        if let Some(node) = all.find(|node| problem.position(**node).is_none()) {
            log.fault(at, format!("element {id} with node {node}"), "nodes of the mesh", "add the node");
            continue;
        }
        let (body, of_elements) = bodies.entry((part, kind)).or_default();
        of_elements.push(at);
        match (<[u32; 8]>::try_from(nodes), <[u32; 4]>::try_from(nodes), <[u32; 2]>::try_from(nodes)) {
            (Ok([a, b, c, d, ..]), ..) if edges.contains_key(&id) => {
                let [e, f, g, h, i, j] = edges[&id];
                body.tetrahedra.push((id, [a, b, c, d, e, f, g, h, i, j]));
            }
            (Ok(nodes), ..) => body.solids.push((id, corners_of(nodes))),
            (_, Ok(nodes), _) => {
                body.shells.push((id, nodes));
                body.thicknesses.push(thicknesses.get(&id).copied().unwrap_or_default());
            }
            (.., Ok(nodes)) => body.trusses.push((id, nodes)),
            _ => {}
        }
    }
    if bodies.is_empty() && log.count() == 0 {
        let expected = "*ELEMENT_SOLID, *ELEMENT_SHELL, *ELEMENT_BEAM or *ELEMENT_DISCRETE";
        log.fault(Place::card(0, 1), "a mesh without elements", expected, "add the elements");
    }
    // A heading names its part where it tells it from others.
    let (mut titles, mut several) = (BTreeSet::new(), BTreeSet::new());
    for title in problem.parts.values().map(|part| part.title.trim()) {
        if !titles.insert(title) {
            several.insert(title);
        }
    }
    let mut places = Vec::new();
    for ((part, _), (mut body, of_elements)) in bodies {
        let title = problem.parts.get(&part).map_or("", |card| card.title.trim());
        let named = !title.is_empty() && !several.contains(title);
        body.name = if named { title.to_string() } else { format!("part {part}") };
        body.number = Some(part);
        if body.thicknesses.iter().all(|thickness| *thickness == 0.0) {
            body.thicknesses.clear();
        }
        mesh.bodies.push(body);
        places.push(of_elements);
    }
    let mut members = 0;
    for (id, (at, _)) in &problem.sets.nodes {
        let nodes = problem.node_set(*id, *at, log);
        members += nodes.len();
        if members as u64 > MAX_NODES {
            log.fault(
                *at,
                format!("set {id}"),
                format!("at most {MAX_NODES} members of all sets"),
                "remove sets",
            );
            break;
        }
        mesh.sets.insert(format!("set {id}"), nodes);
    }
    for (id, (at, _)) in &problem.sets.segments {
        mesh.segments.insert(format!("set {id}"), problem.segment_set(*id, *at, log));
    }
    (mesh, places)
}
