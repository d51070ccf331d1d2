//! Elements by part, and the nodes that they use.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::state::Translation;
use crate::{
    fault::short,
    geometry::{cross, norm, sub, volume},
    keyword::{
        discrete::Discrete,
        problem::{Beam, Section, Shell},
    },
    mesh_file::Body,
    place::Place,
};

/// The elements of a part, and their places.
struct Found {
    body: Body,
    /// Of its elements, in their order.
    places: Vec<Place>,
}

impl Found {
    fn of(part: u32) -> Self {
        let body = Body { name: format!("part {part}"), ..Body::default() };
        Self { body, places: Vec::new() }
    }
}

/// Elements by part, nodes that they use.
pub(super) fn read(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let mut bodies: BTreeMap<u32, Found> = BTreeMap::new();
    let mut seen: HashMap<u32, Place> = HashMap::with_capacity(problem.solids.len());
    let mut missing: BTreeSet<u32> = BTreeSet::new();
    // The first tetrahedron of four nodes, and how many there are.
    let mut linear: Option<(Place, usize)> = None;
    for solid in &problem.solids {
        let (id, at) = (solid.id, solid.at);
        if let Some(first) = seen.insert(id, at) {
            let expected = format!("a number other than {id}, which {} has", log.line(first, at));
            log.fault(at, format!("element {id}"), expected, "renumber one");
            continue;
        }
        let mut all = solid.nodes.iter().chain(solid.edges.iter().flatten());
        if let Some(node) = all.find(|node| problem.position(**node).is_none()) {
            log.fault(at, format!("element {id} with node {node}"), "nodes of the deck", "add the node");
            continue;
        }
        let nodes = corners_of(solid.nodes);
        let corners = nodes.map(|node| problem.position(node).unwrap_or_default());
        if !problem.parts.contains_key(&solid.part) {
            // Told once for all of its elements.
            if missing.insert(solid.part) {
                let read = format!("element {id} of part {}", solid.part);
                log.fault(at, read, "a part of the deck", "add the *PART");
            }
            continue;
        }
        let distinct = solid.nodes.iter().collect::<BTreeSet<_>>().len();
        if !matches!(distinct, 4 | 5 | 6 | 8) {
            log.fault(
                at,
                format!("element {id} with {distinct} different corners"),
                "eight, or six, five or four of a wedge, a pyramid or a tetrahedron",
                "correct the element",
            );
            continue;
        }
        if distinct == 4 && solid.edges.is_none() {
            linear.get_or_insert((at, 0)).1 += 1;
        }
        let v = volume(&corners);
        if !(v > 0.0 && v.is_finite()) {
            log.fault(
                at,
                format!("element {id} with volume {}", short(v)),
                "a volume above 0",
                "number the first four corners so that their normal points to the other four",
            );
            continue;
        }
        t.used.extend(solid.nodes.into_iter().chain(solid.edges.into_iter().flatten()));
        let found = bodies.entry(solid.part).or_insert_with(|| Found::of(solid.part));
        match solid.edges {
            Some([e, f, g, h, i, j]) => {
                let [a, b, c, d, ..] = solid.nodes;
                found.body.tetrahedra.push((id, [a, b, c, d, e, f, g, h, i, j]));
            }
            None => found.body.solids.push((id, nodes)),
        }
        found.places.push(at);
    }
    if let Some((at, count)) = linear {
        log.warn(
            at,
            format!(
                "{count} tetrahedra of four nodes: of one strain each, too stiff where they bend, flow or keep their volume"
            ),
        );
    }
    let mut named = read_shells(t, &mut bodies);
    named.extend(read_beams(t, &mut bodies));
    named.extend(read_discretes(t, &mut bodies));
    for (id, part) in &problem.parts {
        let Some(found) = bodies.remove(id) else {
            if !named.contains(id) {
                log.warn(part.at, format!("part {id} has no elements and is left out"));
            }
            continue;
        };
        check_section(t, *id, &found.body);
        t.places.push(found.places);
        t.mesh.bodies.push(found.body);
        t.names.insert(*id, String::new());
    }
    for node in problem.nodes.iter().filter(|node| t.used.contains(&node.id)) {
        t.mesh.nodes.push((node.id, node.x));
    }
    if t.mesh.bodies.is_empty() && log.count() == 0 {
        let expected = "*ELEMENT_SOLID, *ELEMENT_SHELL, *ELEMENT_BEAM or *ELEMENT_DISCRETE";
        log.fault(Place::card(0, 1), "a deck without elements", expected, "add a mesh");
    }
}

/// Looks at whether the section of a part goes with its elements.
fn check_section(t: &mut Translation<'_>, id: u32, body: &Body) {
    let (problem, log) = (t.problem, t.log);
    let part = &problem.parts[&id];
    match problem.sections.get(&part.section.value) {
        Some((at, section)) => {
            let goes_with = match section {
                Section::Solid { .. } => "solids",
                Section::Shell(_) => "shells",
                Section::Truss(_) | Section::Cable(_) | Section::Beam(_) | Section::Discrete => "trusses",
            };
            if !body.solids.is_empty() && !body.tetrahedra.is_empty() {
                let read = format!("part {id} with solids of eight and of ten nodes");
                log.fault(part.at, read, "solids of one of them", "make a part of the others");
                t.without_section.insert(id);
                return;
            }
            let is_of_solids = !body.solids.is_empty() || !body.tetrahedra.is_empty();
            let lists = [is_of_solids, !body.shells.is_empty(), !body.trusses.is_empty()];
            let several = lists.into_iter().filter(|is| *is).count() > 1;
            if body.kind() == goes_with && !several {
                return;
            }
            let (other, expected) = match goes_with {
                "solids" if body.shells.is_empty() => ("beams", "a *SECTION_BEAM"),
                "solids" => ("shells", "a *SECTION_SHELL"),
                _ if is_of_solids => ("solids", "a *SECTION_SOLID"),
                "shells" => ("beams", "a *SECTION_BEAM"),
                _ => ("shells", "a *SECTION_SHELL"),
            };
            let read = format!("part {id} with {other} and the section at {}", log.line(*at, part.at));
            log.fault(part.at, read, expected, "correct SECID; a part has elements of one kind");
        }
        None => log.fault_of(part.section.origin, "a section of the deck", "add it"),
    }
    t.without_section.insert(id);
}

/// Shells by part, and the parts that have any.
fn read_shells(t: &mut Translation<'_>, bodies: &mut BTreeMap<u32, Found>) -> BTreeSet<u32> {
    let (problem, log) = (t.problem, t.log);
    let mut parts = BTreeSet::new();
    let mut seen: HashMap<u32, Place> = HashMap::with_capacity(problem.shells.len());
    let (mut missing, mut thin) = (BTreeSet::new(), BTreeSet::new());
    let mut triangles: Option<(Place, usize)> = None;
    for shell in &problem.shells {
        let Shell { id, part, nodes, at, .. } = *shell;
        parts.insert(part);
        if let Some(first) = seen.insert(id, at) {
            let expected = format!("a number other than {id}, which {} has", log.line(first, at));
            log.fault(at, format!("shell {id}"), expected, "renumber one");
            continue;
        }
        if let Some(node) = nodes.iter().find(|node| problem.position(**node).is_none()) {
            log.fault(at, format!("shell {id} with node {node}"), "nodes of the deck", "add the node");
            continue;
        }
        let Some(card) = problem.parts.get(&part) else {
            if missing.insert(part) {
                log.fault(at, format!("shell {id} of part {part}"), "a part of the deck", "add the *PART");
            }
            continue;
        };
        let distinct = nodes.iter().collect::<BTreeSet<_>>().len();
        if distinct < 3 || (distinct == 3 && nodes[3] != nodes[2]) {
            let read = format!("shell {id} with nodes {nodes:?}");
            log.fault(at, read, "four different ones, or a triangle that repeats the third", "correct them");
            continue;
        }
        if distinct == 3 {
            triangles.get_or_insert((at, 0)).1 += 1;
        }
        let [a, b, c, d] = nodes.map(|node| problem.position(node).unwrap_or_default());
        let area = 0.5 * norm(cross(sub(c, a), sub(d, b)));
        if !(area > 0.0 && area.is_finite()) {
            let read = format!("shell {id} with area {}", short(area));
            log.fault(at, read, "an area above 0", "order its corners around it");
            continue;
        }
        // A section that is none of shells is told with the part.
        let of_section = match problem.sections.get(&card.section.value) {
            Some((_, Section::Shell(shell))) => shell.thickness,
            _ => 1.0,
        };
        let thickness = shell.thickness(of_section);
        if thickness <= 0.0 || (of_section <= 0.0 && !shell.is_even()) {
            if thin.insert(part) {
                let read = format!("shell {id} without a thickness");
                log.fault(at, read, "T1 of its *SECTION_SHELL, or its own", "give one");
            }
            continue;
        }
        t.thicknesses.entry(part).or_insert(thickness);
        t.used.extend(nodes);
        t.turns.extend(nodes);
        let found = bodies.entry(part).or_insert_with(|| Found::of(part));
        found.body.shells.push((id, nodes));
        found.body.thicknesses.push(thickness);
        found.places.push(at);
    }
    // Those of a part may differ by rounding alone.
    for (part, found) in bodies {
        let common = t.thicknesses.get(part).copied().unwrap_or_default();
        if found.body.thicknesses.iter().all(|t| (t - common).abs() <= 1e-6 * common) {
            found.body.thicknesses.clear();
        }
        for (thickness, at) in found.body.thicknesses.iter().zip(&found.places) {
            t.number(*at, "a thickness of", *thickness);
        }
    }
    if let Some((at, count)) = triangles {
        log.warn(at, format!("{count} triangles: computed as quadrilaterals with two corners in one node"));
    }
    parts
}

/// Trusses and beams by part, and the parts that have any.
fn read_beams(t: &mut Translation<'_>, bodies: &mut BTreeMap<u32, Found>) -> BTreeSet<u32> {
    let (problem, log) = (t.problem, t.log);
    let mut parts = BTreeSet::new();
    let mut seen: HashMap<u32, Place> = HashMap::with_capacity(problem.beams.len());
    let mut missing = BTreeSet::new();
    for beam in &problem.beams {
        let Beam { id, part, nodes, at, .. } = *beam;
        parts.insert(part);
        if let Some(first) = seen.insert(id, at) {
            let expected = format!("a number other than {id}, which {} has", log.line(first, at));
            log.fault(at, format!("beam {id}"), expected, "renumber one");
            continue;
        }
        if let Some(node) = nodes.iter().find(|node| problem.position(**node).is_none()) {
            log.fault(at, format!("beam {id} with node {node}"), "nodes of the deck", "add the node");
            continue;
        }
        let Some(card) = problem.parts.get(&part) else {
            if missing.insert(part) {
                log.fault(at, format!("beam {id} of part {part}"), "a part of the deck", "add the *PART");
            }
            continue;
        };
        let section = problem.sections.get(&card.section.value);
        if matches!(section, Some((_, Section::Discrete))) {
            if missing.insert(part) {
                let read = format!("beam {id} of part {part}, whose section is of springs");
                log.fault(at, read, "a *SECTION_BEAM", "correct SECID, or take *ELEMENT_DISCRETE");
            }
            continue;
        }
        let [a, b] = nodes.map(|node| problem.position(node).unwrap_or_default());
        let length = norm(sub(b, a));
        if !(length > 0.0 && length.is_finite()) {
            let read = format!("beam {id} of length {}", short(length));
            log.fault(at, read, "a length above 0", "give two nodes at different places");
            continue;
        }
        t.used.extend(nodes);
        let is_beam = matches!(section, Some((_, Section::Beam(_))));
        let third = if is_beam && beam.third != 0 { problem.position(beam.third) } else { None };
        if is_beam {
            t.turns.extend(nodes);
            if beam.third != 0 && third.is_none() {
                let read = format!("beam {id} with node {} for its direction", beam.third);
                log.fault(at, read, "a node of the deck", "add the node");
            }
            if let Some(origin) = beam.released {
                log.fault_of(origin, "ends that are not released", "leave RT and RR blank");
            }
        }
        let found = bodies.entry(part).or_insert_with(|| Found::of(part));
        if is_beam {
            let towards = beam.across.or(third.map(|third| sub(third, a)));
            found.body.across.push(towards.unwrap_or_default());
        }
        found.body.trusses.push((id, nodes));
        found.places.push(at);
    }
    parts
}

/// Springs and dampers by part, and the parts that have any.
fn read_discretes(t: &mut Translation<'_>, bodies: &mut BTreeMap<u32, Found>) -> BTreeSet<u32> {
    let (problem, log) = (t.problem, t.log);
    let mut parts = BTreeSet::new();
    let mut seen: HashMap<u32, Place> = problem.beams.iter().map(|beam| (beam.id, beam.at)).collect();
    let of_beams: BTreeSet<u32> = problem.beams.iter().map(|beam| beam.part).collect();
    let (mut missing, mut mixed) = (BTreeSet::new(), BTreeSet::new());
    for discrete in &problem.discretes {
        let Discrete { id, part, nodes, at, .. } = *discrete;
        parts.insert(part);
        if let Some(first) = seen.insert(id, at) {
            let expected = format!("a number other than {id}, which {} has", log.line(first, at));
            log.fault(at, format!("spring {id}"), expected, "renumber one; beams and springs share numbers");
            continue;
        }
        if let Some(node) = nodes.iter().find(|node| problem.position(**node).is_none()) {
            log.fault(at, format!("spring {id} with node {node}"), "nodes of the deck", "add the node");
            continue;
        }
        let Some(card) = problem.parts.get(&part) else {
            if missing.insert(part) {
                log.fault(at, format!("spring {id} of part {part}"), "a part of the deck", "add the *PART");
            }
            continue;
        };
        let section = problem.sections.get(&card.section.value);
        if of_beams.contains(&part)
            || section.is_some_and(|(_, section)| !matches!(section, Section::Discrete))
        {
            if mixed.insert(part) {
                let read = format!("spring {id} of part {part}");
                log.fault(at, read, "a part of springs alone, with a *SECTION_DISCRETE", "correct SECID");
            }
            continue;
        }
        let [a, b] = nodes.map(|node| problem.position(node).unwrap_or_default());
        let length = norm(sub(b, a));
        if !(length > 0.0 && length.is_finite()) {
            let read = format!("spring {id} of length {}", short(length));
            log.fault(at, read, "a length above 0", "give two nodes at different places");
            continue;
        }
        t.used.extend(nodes);
        let found = bodies.entry(part).or_insert_with(|| Found::of(part));
        found.body.trusses.push((id, nodes));
        found.places.push(at);
    }
    parts
}

/// Corners such that those which coincide are neighbours: a tetrahedron repeats its last node, which would leave a face
/// of all four.
pub(in crate::keyword) fn corners_of(nodes: [u32; 8]) -> [u32; 8] {
    let [a, b, c, d, rest @ ..] = nodes;
    let tetrahedron = rest.iter().all(|node| *node == d) && a != b && b != c && c != d && a != c;
    if tetrahedron { [a, b, c, c, d, d, d, d] } else { nodes }
}
