//! `[[material]]` and `[[part]]`.

use std::collections::BTreeMap;

use mechanics::{
    failure::scatter::Scatter,
    mesh::{Form, Guide, SolidAxes},
};

use super::{
    entry::{face_names, text},
    hourglass,
    kind::{self, Word},
    row, shape,
};
use crate::{
    blocks::Block,
    geometry::norm,
    library,
    limits::{MAX_ENTRIES, MAX_ID, MAX_PARTS},
    place::{Origin, Place, Placed},
    table::{Range, Table, Value},
    typed::{
        mesh::{Explicit, Numbers, PartMesh, Places, Source},
        part::{Choice, Clamp, Criterion, Erosion, Kind, Own, Part, Placement, Rotation, Side},
    },
};

/// Reads every `[[material]]`.
pub(super) fn read_materials(deck: &Table<'_>) -> Vec<Own> {
    let mut materials = Vec::new();
    for table in deck.tables("material", MAX_ENTRIES) {
        let table = table.shared("material");
        let value = table.require("name", "a name in quotes");
        let name = value.and_then(|v| v.name()).unwrap_or_else(|| table.title.clone());
        let named = value.map(|v| v.origin());
        let material = library::read_material(table, name.clone());
        materials.push(Own { name, named, material });
    }
    materials
}

/// Reads every `[[part]]` of a deck with these planes of symmetry. A part with a fault keeps its place in the list, so that others may
/// refer to it.
pub(super) fn read_parts(deck: &Table<'_>, planes: [bool; 3]) -> Vec<Part> {
    deck.must_have("part", "at least one [[part]]");
    let tables = deck.tables("part", MAX_PARTS);
    let given = deck.get("part");
    // One that is no list, or too long a one, was told.
    let is_empty = given.is_none_or(|value| value.is_empty_list());
    if tables.is_empty() && is_empty {
        let at = given.map_or(0, |value| value.at);
        deck.faults.add(at, "a deck without [[part]]", "at least one part", "add a [[part]]");
    }
    let part = |(n, table): (usize, Table<'_>)| {
        let value = table.require("name", "a name in quotes");
        let given = value.and_then(|v| v.name());
        let named = value.filter(|_| given.is_some()).map(|v| v.origin());
        let at = value.map_or(table.place(), |v| Place::text(v.at));
        let name = given.unwrap_or_else(|| format!("part {}", n + 1));
        let fracture = table.get("fracture").filter(|v| v.boolean() == Some(true)).map(|v| v.origin());
        let axes = table.get("axes").and_then(|v| read_axes(v, (n, &name)));
        let scatter = table.get("scatter").and_then(|v| read_scatter(v, (n, &name)));
        let material = read_material(&table, &name);
        let velocity = table.get("velocity").and_then(|v| v.vector()).unwrap_or_default();
        let erosion = table.get("erosion").and_then(|v| read_erosion(v, &name));
        let (given, kind) = kind::read(&table, &name);
        let eight_points = table.get("points").and_then(read_points);
        let hourglass = table
            .get("hourglass")
            .and_then(|v| hourglass::read(v, &format!("\"{name}\"")).map(|control| v.placed(control)));
        let mesh = read_mesh(&table, &name, given, (kind.clone(), planes));
        let kind = kind.unwrap_or(Kind::Solids);
        let rotate = table.get("rotate").and_then(|v| read_rotation(v, &table));
        let translate = table.get("translate").and_then(|v| v.vector().map(|by| v.placed(by)));
        let place = table.get("place").and_then(|v| read_placement(v, &name));
        let clamp = table.get("clamp").and_then(read_clamp);
        table.finish();
        Part {
            at,
            name,
            named,
            material,
            fracture,
            axes,
            scatter,
            velocity,
            kind,
            eight_points,
            hourglass,
            erosion,
            mesh,
            rotate,
            translate,
            place,
            clamp,
        }
    };
    tables.into_iter().enumerate().map(part).collect()
}

/// Where a part asks for eight points; none where it has one.
fn read_points(value: Value<'_>) -> Option<Origin> {
    match value.integer(1, 8)? {
        1 => None,
        8 => Some(value.origin()),
        _ => {
            value.fault("1 or 8", "take 8 for solids that need no hourglass control");
            None
        }
    }
}

/// The material of a part, which springs do not have.
fn read_material(table: &Table<'_>, part: &str) -> Option<Choice> {
    if table.has("spring") {
        if let Some(value) = table.get("material") {
            value.fault("no material beside a spring, which has none", "remove it");
        }
        return None;
    }
    let value = table.require("material", "a material by name or as an inline table")?;
    read_choice(value, part)
}

/// A material that a part names or writes inline.
fn read_choice(value: Value<'_>, part: &str) -> Option<Choice> {
    if !value.is_table() {
        return text(value).map(Choice::Named);
    }
    let table = value.table(format!("material of \"{part}\""))?.shared("material");
    let name = table.get("name").map_or(Some(part.to_string()), |v| v.name());
    library::read_material(table, name?).map(|material| Choice::Inline(Box::new(material)))
}

/// Reads `erosion = { ... }` of a part.
fn read_erosion(value: Value<'_>, part: &str) -> Option<Erosion> {
    let table = value.table(format!("erosion of \"{part}\""))?;
    let mut limits = Vec::new();
    for criterion in Criterion::ALL {
        let given = table.get(criterion.key());
        if let Some((value, limit)) = given.and_then(|v| v.number(criterion.range()).map(|x| (v, x))) {
            limits.push((criterion, value.placed(limit)));
        }
    }
    let failure = table.get("failure").and_then(|v| v.boolean().map(|on| v.placed(on)));
    table.finish();
    Some(Erosion { origin: value.origin(), limits, failure })
}

/// The axes of the material by element: `"element"`, or a table with what they follow and the angle that turns them.
fn read_axes(value: Value<'_>, (part, name): (usize, &str)) -> Option<Placed<SolidAxes>> {
    let axes = |by, angle| Some(value.placed(SolidAxes { part: part as u32, by, angle }));
    if !value.is_table() {
        if text(value)?.value == "element" {
            return axes(Guide::Element, 0.0);
        }
        value.fault("\"element\", or a table with across or around", "write one of these");
        return None;
    }
    let table = value.table(format!("axes of \"{name}\""))?;
    let angle = table.number_or("angle", 0.0, Range::Any);
    let (across, around) = (table.get("across"), table.get("around"));
    let vector = |v: Value<'_>| {
        let vector = v.vector()?;
        if norm(vector) > 0.0 {
            return Some(vector);
        }
        v.fault("a vector of some length", "give it a direction");
        None
    };
    let by = match (across, around) {
        (None, None) => Some(Guide::Element),
        (Some(across), None) => vector(across).map(Guide::Across),
        (None, Some(along)) => {
            let point = table.get("point").map_or(Some([0.0; 3]), |v| v.vector());
            vector(along).zip(point).map(|(along, point)| Guide::Around { point, along })
        }
        (Some(_), Some(around)) => {
            around.fault("across or around", "remove one of them");
            None
        }
    };
    table.finish();
    axes(by?, angle)
}

fn read_scatter(value: Value<'_>, (part, name): (usize, &str)) -> Option<Placed<Scatter>> {
    let table = value.table(format!("scatter of \"{name}\""))?;
    let modulus = table.number("modulus", Range::Positive);
    let volume = table.get("volume").and_then(|v| v.number(Range::Positive));
    let seed = table.integer_or("seed", 0, 0, u64::from(u32::MAX));
    table.finish();
    Some(value.placed(Scatter { part: part as u32, modulus: modulus?, volume, seed }))
}

/// The mesh of a part: exactly one of the blocks, or `mesh`.
fn read_mesh(
    table: &Table<'_>,
    name: &str,
    given: Option<(Word, Value<'_>)>,
    (kind_of, planes): (Option<Kind>, [bool; 3]),
) -> Option<PartMesh> {
    const KINDS: [&str; 7] = ["box", "cylinder", "sphere", "tube", "plate", "prism", "mesh"];
    let present: Vec<(&'static str, Value<'_>)> =
        KINDS.iter().filter_map(|kind| table.get(kind).map(|v| (*kind, v))).collect();
    let [(kind, value)] = present[..] else {
        let found: Vec<&str> = present.iter().map(|(kind, _)| *kind).collect();
        let read = if found.is_empty() { "no mesh".to_string() } else { found.join(" and ") };
        table.faults.add(
            table.at,
            format!("{read} in {}", table.title),
            format!("exactly one of {}", KINDS.join(", ")),
            "give each part one mesh, for instance [part.box]",
        );
        return None;
    };
    let inner = value.table(format!("{kind} of \"{name}\""))?;
    let of_shells = ["plate", "prism"].contains(&kind);
    match given {
        None if of_shells => {
            let read = format!("a {kind} without a shell in {}", table.title);
            table.faults.add(table.at, read, "its thickness", "add shell = { thickness = ... }");
        }
        Some((Word::Shell, shell)) if !of_shells && kind != "mesh" => {
            shell.fault("no shell: solids fill this block", "remove it, or take plate, prism or mesh");
        }
        Some((word, bar)) if word != Word::Shell && kind != "mesh" => {
            let expected = format!("no {}: another kind of element fills this block", word.key());
            bar.fault(&expected, "remove it, or take mesh");
        }
        _ => {}
    }
    let (at, title) = (inner.place(), inner.title.clone());
    let source = if kind != "mesh" {
        let section = match kind_of {
            Some(Kind::Shells(section)) => Some(section),
            _ => None,
        };
        let shape = shape::read(kind, &inner, section, planes);
        inner.finish();
        shape.map(Source::Shape)
    } else if kind_of.is_none() {
        None
    } else if inner.has("file") {
        let mesh = inner.require("file", "the name of a mesh file").and_then(text);
        let body = match inner.get("body") {
            None => Some(None),
            Some(value) if value.is_text() => text(value).map(Some),
            Some(value) => {
                let number = value.integer(0, u64::from(MAX_ID));
                number.map(|number| Some(value.placed(number.to_string())))
            }
        };
        let scale = match inner.get("scale") {
            None => Some(None),
            Some(value) => value.number(Range::Positive).map(|scale| Some(value.placed(scale))),
        };
        let composite = match inner.get("tetrahedra") {
            None => Some(None),
            Some(value) => {
                let word = value.one_of(&["linear", "composite"]);
                word.map(|word| (word == 1).then(|| value.origin()))
            }
        };
        inner.finish();
        mesh.zip(body).zip(scale).zip(composite).map(|(((mesh, body), scale), composite)| Source::Body {
            mesh,
            body,
            scale,
            composite,
        })
    } else {
        read_explicit(inner, kind_of?).map(|own| Source::Explicit(Box::new(own)))
    };
    source.map(|source| PartMesh { at, title, source })
}

/// Nodes `[id, x, y, z]` and elements as [`row::read`] has them.
fn read_explicit(table: Table<'_>, kind: Kind) -> Option<Explicit> {
    let max = u64::from(MAX_ID);
    let nodes = table.require("nodes", "a list of [id, x, y, z]").and_then(|v| v.items());
    let elements = table.require("elements", "a list of [id, n1, ..., n8]").and_then(|v| v.items());
    let (nodes, elements) = (nodes?, elements?);
    let before = table.faults.count();
    let (mut node_ids, mut node_places) = (Vec::new(), Vec::new());
    let (mut element_ids, mut element_places) = (Vec::new(), Vec::new());
    let mut positions = Vec::new();
    let mut index: BTreeMap<u32, u32> = BTreeMap::new();
    for node in &nodes {
        let Some([id, x, y, z]) = node.fixed::<4>("[id, x, y, z]") else { continue };
        let id = id.integer(1, max);
        let at = [x, y, z].map(|v| v.number(Range::Any));
        let (Some(id), [Some(x), Some(y), Some(z)]) = (id, at) else { continue };
        if let Some(first) = index.get(&(id as u32)) {
            let place: Place = node_places[*first as usize];
            let line = table.faults.line_seen_from(place, table.place());
            node.fault(&format!("a node number other than {id}, which {line} has"), "renumber one");
            continue;
        }
        index.insert(id as u32, positions.len() as u32);
        node_ids.push(id as u32);
        node_places.push(Place::text(node.at));
        positions.push([x, y, z]);
    }
    let (mut all_corners, mut thicknesses): (Vec<u32>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut seen: BTreeMap<u32, Place> = BTreeMap::new();
    let mut used = vec![false; positions.len()];
    for element in &elements {
        let Some((numbers, thickness)) = row::read(element, &kind) else { continue };
        let id = numbers[0] as u32;
        if let Some(first) = seen.insert(id, Place::text(element.at)) {
            let line = table.faults.line_seen_from(first, table.place());
            element.fault(&format!("an element number other than {id}, which {line} has"), "renumber one");
        }
        let mut corners = vec![0; kind.n_corners()];
        let mut complete = true;
        for (corner, number) in corners.iter_mut().zip(&numbers[1..]) {
            match index.get(&(*number as u32)) {
                Some(node) => {
                    *corner = *node;
                    used[*node as usize] = true;
                }
                None => {
                    complete = false;
                    table.faults.add(
                        element.at,
                        format!("element {id} with node {number}"),
                        "nodes of this part",
                        "add the node to nodes, or correct the element",
                    );
                }
            }
        }
        let mut sorted = corners.clone();
        sorted.sort_unstable();
        let whole = <[u32; 8]>::try_from(&corners[..]).ok().filter(|_| matches!(kind, Kind::Solids));
        let is_solid = whole.is_some_and(|corners| Form::of(&corners) != Form::Hexahedron);
        if complete && !is_solid && sorted.windows(2).any(|w| w[0] == w[1]) {
            complete = false;
            let (expected, advice) = match kind {
                Kind::Solids => (
                    "eight different nodes, or six, five or four of a wedge, a pyramid or a tetrahedron",
                    "repeat the nodes of such an element as 1 2 3 4 5 5 6 6, 1 2 3 4 5 5 5 5 or 1 2 3 3 4 4 4 4",
                ),
                Kind::Shells(_) => {
                    ("four different nodes", "list each corner once; triangles come in mesh files")
                }
                Kind::Trusses { .. } | Kind::Cables { .. } | Kind::Springs(_) | Kind::Beams { .. } => {
                    ("two different nodes", "list both ends")
                }
            };
            element.fault(expected, advice);
        }
        if complete {
            all_corners.extend(corners);
            thicknesses.push(thickness.unwrap_or(0.0));
            element_ids.push(id);
            element_places.push(Place::text(element.at));
        }
    }
    if elements.is_empty() {
        table.faults.add(
            table.at,
            format!("{} without elements, hence without mass", table.title),
            "at least one element",
            "add elements or remove the part",
        );
    }
    // A node that a faulty element might have used is not called unused.
    if table.faults.count() == before {
        for (n, _) in used.iter().enumerate().filter(|(_, used)| !**used) {
            table.faults.add_at(
                node_places[n],
                format!("node {} of no element, hence without mass", node_ids[n]),
                "nodes that elements use",
                "remove the node",
            );
        }
    }
    let clean = table.faults.count() == before;
    table.finish();
    let topology = kind.topology(all_corners.chunks(kind.n_corners()), &thicknesses);
    let numbers = Numbers {
        nodes: node_ids,
        elements: element_ids,
        node_places: Places::Each(node_places),
        element_places: Places::Each(element_places),
        mesh: None,
    };
    clean.then_some(Explicit { block: Block { positions, topology, faces: Vec::new() }, numbers })
}

/// `place = { above = "plate", gap = 0.1 }`.
fn read_placement(value: Value<'_>, part: &str) -> Option<Placement> {
    let table = value.table(format!("place of \"{part}\""))?;
    let given: Vec<(Side, Value<'_>)> =
        Side::ALL.into_iter().filter_map(|side| table.get(side.key()).map(|v| (side, v))).collect();
    let gap = table.get("gap").map(|v| v.number(Range::NotNegative));
    table.finish();
    let [(side, other)] = given[..] else {
        value.fault(
            &format!("exactly one of {}", Side::ALL.map(Side::key).join(", ")),
            "name the part that it stands beside, for instance { above = \"plate\" }",
        );
        return None;
    };
    let beside = text(other)?;
    let gap = match gap {
        Some(gap) => Some(gap?),
        None => None,
    };
    Some(Placement { origin: value.origin(), side, beside, gap })
}

/// `clamp = "edges"`, or a list of faces.
fn read_clamp(value: Value<'_>) -> Option<Clamp> {
    if value.is_text() {
        if value.text() == Some("edges") {
            return Some(Clamp::Edges(value.origin()));
        }
        value
            .fault("\"edges\", or a list of faces", "write \"edges\" or for instance [\"i-min\", \"i-max\"]");
        return None;
    }
    face_names(value).map(Clamp::Faces)
}

/// `rotate` of a part.
fn read_rotation(value: Value<'_>, part: &Table<'_>) -> Option<Rotation> {
    let table = value.table(format!("rotate of {}", part.title))?;
    let axis = table.vector("axis");
    let degrees = table.number("degrees", Range::Any);
    let point = table.get("point").map_or(Some([0.0; 3]), |v| v.vector());
    let (at, faults) = (table.at, table.faults);
    table.finish();
    let (axis, degrees, point) = (axis?, degrees?, point?);
    let long = norm(axis);
    if long > 0.0 && long.is_finite() {
        return Some(Rotation { origin: value.origin(), point, axis, degrees });
    }
    let (read, expected) = (format!("axis = {axis:?}"), "an axis of some length");
    faults.add(at, read, expected, "give a direction such as [0, 0, 1]");
    None
}
