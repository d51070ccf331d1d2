//! `[[part]]`: name, material, velocity, and its mesh as a block or as nodes and elements.

use std::collections::BTreeMap;

use mechanics::{
    element::shell4::Rule,
    erosion::Criteria,
    mesh::{Section, Topology},
};

use super::{MAX_ELEMENTS, MAX_NODES, MAX_PARTS, Materials, Meshes, erosion, shape};
use crate::{
    blocks::Block,
    geometry::{norm, scaled},
    mesh_file::Body,
    table::{Range, Table, Value},
};

/// Greatest node or element number a deck may give; generated numbers go on above.
const MAX_ID: u64 = 2_000_000_000;

/// A part as the deck describes it.
pub(crate) struct PartDraft {
    pub(crate) name: String,
    /// Offset of the part in the text.
    pub(crate) at: usize,
    /// Index into the materials in use; none after a fault.
    pub(crate) material: Option<u32>,
    pub(crate) velocity: [f64; 3],
    /// When its elements erode; none if they do not.
    pub(crate) erosion: Option<Criteria>,
    /// None after a fault.
    pub(crate) block: Option<Block>,
    /// Numbers and places of an explicit mesh.
    pub(crate) explicit: Option<Explicit>,
}

/// What the deck says about nodes and elements of its own.
pub(crate) struct Explicit {
    pub(crate) node_ids: Vec<u32>,
    pub(crate) element_ids: Vec<u32>,
    /// Offset of each node in the text.
    pub(crate) node_places: Vec<usize>,
    /// Offset of each element in the text.
    pub(crate) element_places: Vec<usize>,
    /// The file it comes from, whose parts share nodes.
    pub(crate) file: Option<String>,
}

/// Reads every part. A part with a fault keeps its place in the list, so that others may refer to it.
pub(crate) fn read_parts(deck: &Table<'_>, materials: &mut Materials, meshes: &Meshes) -> Vec<PartDraft> {
    let tables = deck.tables("part", MAX_PARTS);
    if tables.is_empty() && !deck.has("part") {
        deck.faults.add(0, "a deck without [[part]]", "at least one part", "add a [[part]]");
    }
    let mut parts: Vec<PartDraft> = Vec::new();
    let mut budget = Budget { nodes: MAX_NODES, elements: MAX_ELEMENTS };
    for (n, table) in tables.into_iter().enumerate() {
        let value = table.require("name", "a name in quotes");
        let name = value.and_then(|v| v.name());
        let at = value.map_or(table.at, |v| v.at);
        if let (Some(name), Some(value)) = (&name, value) {
            if let Some(first) = parts.iter().find(|p| p.name == *name) {
                let (line, _) = deck.faults.place(first.at);
                value.fault(
                    &format!("a name that the part at line {line} does not use"),
                    "choose another name",
                );
            }
            if name == "all" {
                value.fault("a name other than \"all\", which stands for every part", "choose another name");
            }
        }
        let name = name.unwrap_or_else(|| format!("part {}", n + 1));
        let fracture = table.get("fracture").filter(|v| v.boolean() == Some(true));
        let material = table
            .require("material", "a material by name or as an inline table")
            .and_then(|v| materials.resolve(v, &name, fracture));
        let velocity = table.get("velocity").and_then(|v| v.vector()).unwrap_or_default();
        let of_material = material.map(|m| &materials.list[m as usize]);
        let shells = table.get("shell").is_some();
        let erosion = table.get("erosion").and_then(|v| {
            if shells {
                v.fault("solids: shells do not erode", "remove erosion, or make the part of solids");
            }
            erosion::read_criteria(v, &name, of_material)
        });
        let (mut block, explicit) = read_mesh(&table, &name, meshes, &mut budget);
        let movable = explicit.as_ref().is_none_or(|own| own.file.is_none());
        if let Some(block) = &mut block
            && movable
        {
            transform(&table, block);
        } else {
            // The keys are known even where there is nothing to move.
            for key in [table.get("rotate"), table.get("translate")].into_iter().flatten() {
                if !movable {
                    key.fault("a mesh file where it is", "move the nodes in the file");
                }
            }
        }
        table.finish();
        parts.push(PartDraft { name, at, material, velocity, erosion, block, explicit });
    }
    parts
}

/// Nodes and elements that may still be made.
struct Budget {
    nodes: u64,
    elements: u64,
}

impl Budget {
    /// Takes a mesh of that size from the budget, or reports that it is too large.
    fn take(&mut self, size: Option<(u64, u64)>, at: usize, title: &str, table: &Table<'_>) -> Option<()> {
        let (nodes, elements) = size.unwrap_or((u64::MAX, u64::MAX));
        if nodes > self.nodes || elements > self.elements {
            let read = match size {
                Some((nodes, elements)) => format!("{title} with some {nodes} nodes and {elements} elements"),
                None => format!("{title} with more than 2^64 nodes"),
            };
            table.faults.add(
                at,
                read,
                format!("at most {MAX_NODES} nodes and {MAX_ELEMENTS} elements in all parts together"),
                "use fewer cells",
            );
            return None;
        }
        self.nodes -= nodes;
        self.elements -= elements;
        Some(())
    }
}

/// The mesh of a part: exactly one of the blocks, or `mesh`.
fn read_mesh(
    table: &Table<'_>,
    name: &str,
    meshes: &Meshes,
    budget: &mut Budget,
) -> (Option<Block>, Option<Explicit>) {
    const KINDS: [&str; 7] = ["box", "cylinder", "sphere", "tube", "plate", "prism", "mesh"];
    let shell = table.get("shell");
    let section = shell.and_then(|value| read_section(value, name));
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
        return (None, None);
    };
    let Some(inner) = value.table(format!("{kind} of \"{name}\"")) else { return (None, None) };
    let of_shells = ["plate", "prism"].contains(&kind);
    match shell {
        None if of_shells => {
            let read = format!("a {kind} without a shell in {}", table.title);
            table.faults.add(table.at, read, "its thickness", "add shell = { thickness = ... }");
        }
        Some(shell) if !of_shells && kind != "mesh" => {
            shell.fault("no shell: solids fill this block", "remove it, or take plate, prism or mesh");
        }
        _ => {}
    }
    if kind == "mesh" {
        if shell.is_some() && section.is_none() {
            return (None, None);
        }
        let read = if inner.has("file") {
            read_file(inner, name, meshes, budget, section)
        } else {
            read_explicit(inner, budget, section)
        };
        return match read {
            Some((block, explicit)) => (Some(block), Some(explicit)),
            None => (None, None),
        };
    }
    let shape = shape::read(kind, &inner, section);
    let (at, title) = (inner.at, inner.title.clone());
    inner.finish();
    let block = shape.and_then(|shape| {
        budget.take(shape.size(), at, &title, table)?;
        Some(shape.build())
    });
    (block, None)
}

/// `shell = { thickness, points, rule }`.
fn read_section(value: Value<'_>, name: &str) -> Option<Section> {
    let table = value.table(format!("shell of \"{name}\""))?;
    let thickness = table.number("thickness", Range::Positive);
    let rule = table.get("rule").map_or(Some(0), |v| v.one_of(&["gauss", "lobatto"]));
    let (least, default) = if rule == Some(1) { (3, 5) } else { (1, 3) };
    let points = table.integer_or("points", default, least, 5) as u32;
    table.finish();
    let rule = if rule? == 1 { Rule::Lobatto(points) } else { Rule::Gauss(points) };
    Some(Section { thickness: thickness?, rule })
}

/// Nodes `[id, x, y, z]` and elements `[id, n1 ... n8]`, of shells `[id, n1 ... n4]`.
fn read_explicit(
    table: Table<'_>,
    budget: &mut Budget,
    section: Option<Section>,
) -> Option<(Block, Explicit)> {
    let nodes = table.require("nodes", "a list of [id, x, y, z]").and_then(|v| v.items());
    let elements = table.require("elements", "a list of [id, n1, ..., n8]").and_then(|v| v.items());
    let (nodes, elements) = (nodes?, elements?);
    let size = Some((nodes.len() as u64, elements.len() as u64));
    budget.take(size, table.at, &table.title, &table)?;
    let before = table.faults.count();
    let mut explicit = Explicit {
        node_ids: Vec::new(),
        element_ids: Vec::new(),
        node_places: Vec::new(),
        element_places: Vec::new(),
        file: None,
    };
    let mut positions = Vec::new();
    let mut index: BTreeMap<u32, u32> = BTreeMap::new();
    for node in &nodes {
        let Some([id, x, y, z]) = node.fixed::<4>("[id, x, y, z]") else { continue };
        let id = id.integer(1, MAX_ID);
        let at = [x, y, z].map(|v| v.number(Range::Any));
        let (Some(id), [Some(x), Some(y), Some(z)]) = (id, at) else { continue };
        if let Some(first) = index.get(&(id as u32)) {
            let (line, _) = table.faults.place(explicit.node_places[*first as usize]);
            node.fault(&format!("a node number other than {id}, which line {line} has"), "renumber one");
            continue;
        }
        index.insert(id as u32, positions.len() as u32);
        explicit.node_ids.push(id as u32);
        explicit.node_places.push(node.at);
        positions.push([x, y, z]);
    }
    let mut hexahedra = Vec::new();
    let mut seen: BTreeMap<u32, usize> = BTreeMap::new();
    let mut used = vec![false; positions.len()];
    for element in &elements {
        let numbers = if section.is_some() {
            element.integers::<5>("[id, n1, n2, n3, n4]", 1, MAX_ID).map(|n| n.to_vec())
        } else {
            element.integers::<9>("[id, n1, ..., n8]", 1, MAX_ID).map(|n| n.to_vec())
        };
        let Some(numbers) = numbers else { continue };
        let id = numbers[0] as u32;
        if let Some(first) = seen.insert(id, element.at) {
            let (line, _) = table.faults.place(first);
            element
                .fault(&format!("an element number other than {id}, which line {line} has"), "renumber one");
        }
        let mut corners = [0; 8];
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
        let mut sorted = corners[..numbers.len() - 1].to_vec();
        sorted.sort_unstable();
        if complete && sorted.windows(2).any(|w| w[0] == w[1]) {
            complete = false;
            let (expected, advice) = match section {
                None => ("eight different nodes", "list each corner once; wedges are not read"),
                Some(_) => ("four different nodes", "list each corner once; triangles come in mesh files"),
            };
            element.fault(expected, advice);
        }
        if complete {
            hexahedra.push(corners);
            explicit.element_ids.push(id);
            explicit.element_places.push(element.at);
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
        for (n, used) in used.iter().enumerate() {
            if !used {
                table.faults.add(
                    explicit.node_places[n],
                    format!("node {} of no element, hence without mass", explicit.node_ids[n]),
                    "nodes that elements use",
                    "remove the node",
                );
            }
        }
    }
    let clean = table.faults.count() == before;
    table.finish();
    let topology = match section {
        None => Topology::Explicit { hexahedra },
        Some(section) => {
            let quads = hexahedra.iter().map(|&[a, b, c, d, ..]: &[u32; 8]| [a, b, c, d]).collect();
            Topology::Shells { quads, section }
        }
    };
    let block = Block { positions, topology, faces: Vec::new() };
    clean.then_some((block, explicit))
}

/// `file = "name"` and `body = "name"`: a body of a mesh file, by default the one called like the part.
fn read_file(
    table: Table<'_>,
    part: &str,
    meshes: &Meshes,
    budget: &mut Budget,
    section: Option<Section>,
) -> Option<(Block, Explicit)> {
    let file = table.require("file", "the name of a mesh file")?;
    let name = file.text();
    let body = table.get("body");
    let body_name = body.map_or(Some(part), |v| v.text());
    let (at, title) = (table.at, table.title.clone());
    let (name, body_name) = (name?, body_name?);
    let Some(mesh) = meshes.get(name) else {
        file.fault("a mesh file that can be read", "put it beside the deck, or correct the name");
        table.finish();
        return None;
    };
    let holds =
        |body: &&Body| if section.is_some() { !body.shells.is_empty() } else { !body.solids.is_empty() };
    if section.is_none() && mesh.body(body_name).is_some_and(|body| !body.shells.is_empty()) {
        let read = format!("the shells of body \"{body_name}\" in part \"{part}\"");
        table.faults.add(at, read, "their thickness", "add shell = { thickness = ... } to the part");
        table.finish();
        return None;
    }
    let Some(found) = mesh.body(body_name).filter(holds) else {
        let names: Vec<&str> = mesh.bodies.iter().filter(holds).map(|b| b.name.as_str()).take(20).collect();
        let what = if section.is_some() { "shells" } else { "solids" };
        body.unwrap_or(file).fault(
            &format!("a body with {what} of that file ({})", names.join(", ")),
            "choose one with body = \"name\"",
        );
        table.finish();
        return None;
    };
    let mut index: BTreeMap<u32, u32> = BTreeMap::new();
    for id in found.corners() {
        index.entry(id).or_insert(0);
    }
    let n_elements = found.solids.len() + found.shells.len();
    let all = found.solids.iter().map(|(id, corners)| (id, &corners[..]));
    let mut all = all.chain(found.shells.iter().map(|(id, corners)| (id, &corners[..])));
    let distinct =
        |corners: &[u32]| (0..corners.len()).filter(|&i| !corners[..i].contains(&corners[i])).count();
    let (kinds, expected): (&[usize], _) = match section {
        None => (&[4, 5, 6, 8], "eight, or six, five or four of a wedge, a pyramid or a tetrahedron"),
        Some(_) => (&[3, 4], "four, or three of a triangle"),
    };
    if let Some((id, corners)) = all.find(|(_, corners)| !kinds.contains(&distinct(corners))) {
        let read = format!("element {id} with {} different corners", distinct(corners));
        table.faults.add(at, read, expected, "correct the element");
        table.finish();
        return None;
    }
    budget.take(Some((index.len() as u64, n_elements as u64)), at, &title, &table)?;
    let mut positions = Vec::with_capacity(index.len());
    let mut node_ids = Vec::with_capacity(index.len());
    // Nodes in the order of the file.
    for (id, x) in &mesh.nodes {
        if let Some(local) = index.get_mut(id) {
            *local = positions.len() as u32;
            positions.push(*x);
            node_ids.push(*id);
        }
    }
    let topology = match section {
        None => Topology::Explicit {
            hexahedra: found.solids.iter().map(|(_, corners)| corners.map(|id| index[&id])).collect(),
        },
        Some(section) => Topology::Shells {
            quads: found.shells.iter().map(|(_, corners)| corners.map(|id| index[&id])).collect(),
            section,
        },
    };
    let ids = found.solids.iter().map(|(id, _)| id).chain(found.shells.iter().map(|(id, _)| id));
    let element_ids: Vec<u32> = ids.copied().collect();
    table.finish();
    let explicit = Explicit {
        node_places: vec![at; node_ids.len()],
        element_places: vec![at; element_ids.len()],
        node_ids,
        element_ids,
        file: Some(name.to_string()),
    };
    Some((Block { positions, topology, faces: Vec::new() }, explicit))
}

/// `rotate`, then `translate`.
fn transform(table: &Table<'_>, block: &mut Block) {
    if let Some(rotate) = table.get("rotate").and_then(|v| v.table(format!("rotate of {}", table.title))) {
        let axis = rotate.vector("axis");
        let degrees = rotate.number("degrees", Range::Any);
        let point = rotate.get("point").map_or(Some([0.0; 3]), |v| v.vector());
        if let (Some(axis), Some(degrees), Some(point)) = (axis, degrees, point) {
            let long = norm(axis);
            if long > 0.0 && long.is_finite() {
                block.rotate(point, scaled(axis, 1.0 / long), degrees);
            } else {
                let (read, expected) = (format!("axis = {axis:?}"), "an axis of some length");
                rotate.faults.add(rotate.at, read, expected, "give a direction such as [0, 0, 1]");
            }
        }
        rotate.finish();
    }
    if let Some(by) = table.get("translate").and_then(|v| v.vector()) {
        block.translate(by);
    }
}
