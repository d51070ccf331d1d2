//! Putting the parts together: one numbering, joins, volumes, masses, velocities.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::{
    element::tet10,
    material::Material,
    mesh::{Mesh, Part, Topology},
};
use rayon::prelude::*;

use super::{merge::merge, names::Names, node_ids::NodeIds, part::PartDraft};
use crate::{
    geometry::{EDGES, distance_square, dot},
    log::Log,
    mesh_file::MeshFile,
    place::Place,
    typed::{
        contact,
        mesh::{Meshes, Numbers},
    },
};

/// Parts whose coincident nodes become one.
pub(super) struct Join {
    pub(super) at: Place,
    pub(super) parts: Vec<usize>,
    /// Greatest distance of nodes that merge, over the smallest edge of the joined parts.
    pub(super) tolerance: f64,
}

/// The mesh of all parts and what was measured on the way.
pub(super) struct Assembly {
    pub(super) mesh: Mesh,
    /// Initial velocity by global node.
    pub(super) velocity: Vec<[f64; 3]>,
    /// Initial rotation rate by global node (1/time); empty where no mesh file gives one.
    pub(super) spin: Vec<[f64; 3]>,
    /// Kinetic energy lost in joins.
    pub(super) join_energy: f64,
    /// Named faces of each part: their global nodes.
    pub(super) faces: Vec<Vec<(&'static str, Vec<u32>)>>,
    /// Smallest edge of each part; infinite for a part without elements.
    pub(super) smallest_edge: Vec<f64>,
    /// Largest edge of each part.
    pub(super) largest_edge: Vec<f64>,
    /// Volume by global element.
    pub(super) volumes: Vec<f64>,
    /// Whether a join merged nodes of one part, which has been reported.
    pub(super) collapsed: bool,
    /// Pairs of parts that share nodes, lower index first.
    pub(super) joined: Vec<(usize, usize)>,
    /// The global node of each user's number.
    pub(super) node_of_id: NodeIds,
    /// The initial velocity each part was given.
    pub(super) part_velocity: Vec<[f64; 3]>,
    /// Two corners of the box around the velocities that mesh files give, where they give any.
    pub(super) file_velocities: Vec<[f64; 3]>,
    /// Named sets of nodes from mesh files: global nodes, ascending.
    pub(super) sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of faces from mesh files: global nodes. Faces of nodes that no part has are left out.
    pub(super) segments: BTreeMap<String, Vec<[u32; 4]>>,
}

impl Assembly {
    /// Measures the volumes of all elements, where nodes have been moved.
    pub(super) fn measure_volumes(&mut self) {
        let Self { mesh, volumes, .. } = self;
        volumes.clear();
        for part in &mesh.parts {
            volumes.extend(part.volumes(&mesh.positions));
        }
    }
}

/// The joins of a deck, by the index of their parts.
pub(super) fn joins(joins: &[contact::Join], names: &Names<'_>, log: &Log<'_>) -> Vec<Join> {
    let mut list = Vec::new();
    for contact::Join { at, parts, tolerance } in joins {
        let Some(parts) = names.several(parts) else { continue };
        if parts.len() < 2 {
            log.fault(
                *at,
                "a join of one part",
                "at least two different parts",
                "name another part or remove the join",
            );
            continue;
        }
        list.push(Join { at: *at, parts, tolerance: *tolerance });
    }
    list
}

/// One mesh of all parts; none where nobody waits for it any more.
pub(super) fn assemble(
    drafts: &[PartDraft],
    joins: &[Join],
    materials: &[Material],
    meshes: &Meshes,
    log: &Log<'_>,
) -> Option<Assembly> {
    let mut mesh = number(drafts, log);
    let mut smallest_edge = Vec::new();
    let mut largest_edge = Vec::new();
    for part in &mesh.parts {
        log.wanted()?;
        let (low, high) = edges(&mesh.positions, part);
        smallest_edge.push(low);
        largest_edge.push(high);
    }
    let node_of_id = NodeIds::of(&mesh.node_ids);
    let mut assembly = Assembly {
        mesh: Mesh::default(),
        velocity: Vec::new(),
        spin: Vec::new(),
        join_energy: 0.0,
        faces: Vec::new(),
        smallest_edge,
        largest_edge,
        volumes: Vec::new(),
        collapsed: false,
        joined: Vec::new(),
        node_of_id,
        part_velocity: drafts.iter().map(|d| d.velocity).collect(),
        file_velocities: Vec::new(),
        sets: BTreeMap::new(),
        segments: BTreeMap::new(),
    };
    log.wanted()?;
    share(&mesh, drafts, &mut assembly.joined);
    if !joins.is_empty() {
        merge(&mut mesh, joins, &mut assembly, log);
    }
    for (draft, part) in drafts.iter().zip(&mesh.parts) {
        log.wanted()?;
        assembly.faces.push(global_faces(draft, part));
    }
    assembly.mesh = mesh;
    for part in &assembly.mesh.parts {
        log.wanted()?;
        assembly.volumes.extend(part.volumes(&assembly.mesh.positions));
    }
    velocities(&mut assembly, materials);
    let used = drafts.iter().filter_map(|d| d.numbers.as_ref()?.mesh.as_ref());
    for mesh in used.collect::<BTreeSet<_>>().into_iter().filter_map(|name| meshes.get(name)?.as_ref()) {
        take_over(&mesh.file, &mut assembly);
    }
    Some(assembly)
}

/// Pairs of parts of one file that name the same node, into `joined`.
fn share(mesh: &Mesh, drafts: &[PartDraft], joined: &mut Vec<(usize, usize)>) {
    if !drafts.iter().any(|d| d.numbers.as_ref().is_some_and(|e| e.mesh.is_some())) {
        return;
    }
    let mut holders: Vec<Option<usize>> = vec![None; mesh.n_nodes()];
    let mut several: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (p, part) in mesh.parts.iter().enumerate() {
        for node in &part.nodes {
            match holders[*node as usize] {
                None => holders[*node as usize] = Some(p),
                Some(first) => several.entry(*node).or_insert_with(|| vec![first]).push(p),
            }
        }
    }
    for list in several.values() {
        for (i, a) in list.iter().enumerate() {
            joined.extend(list[i + 1..].iter().map(|b| (*a, *b)));
        }
        if joined.len() > 1 << 16 {
            joined.sort_unstable();
            joined.dedup();
        }
    }
    joined.sort_unstable();
    joined.dedup();
}

/// Sets and velocities of a mesh file; numbers that no part uses are left out.
fn take_over(mesh: &MeshFile, assembly: &mut Assembly) {
    let node_of_id = &assembly.node_of_id;
    for (name, ids) in &mesh.sets {
        let set = assembly.sets.entry(name.clone()).or_default();
        set.extend(ids.iter().filter_map(|id| node_of_id.get(*id)));
        set.sort_unstable();
        set.dedup();
    }
    for (name, faces) in &mesh.segments {
        let known = |face: &[u32; 4]| {
            let nodes = face.map(|id| node_of_id.get(id));
            nodes.iter().all(Option::is_some).then(|| nodes.map(Option::unwrap_or_default))
        };
        assembly.segments.entry(name.clone()).or_default().extend(faces.iter().filter_map(known));
    }
    for (id, spin) in &mesh.spins {
        if let Some(node) = node_of_id.get(*id) {
            assembly.spin.resize(assembly.velocity.len(), [0.0; 3]);
            assembly.spin[node as usize] = *spin;
        }
    }
    for (id, velocity) in &mesh.velocities {
        if let Some(node) = node_of_id.get(*id) {
            assembly.velocity[node as usize] = *velocity;
            if assembly.file_velocities.is_empty() {
                assembly.file_velocities = vec![*velocity; 2];
            }
            for (axis, v) in velocity.iter().enumerate() {
                assembly.file_velocities[0][axis] = assembly.file_velocities[0][axis].min(*v);
                assembly.file_velocities[1][axis] = assembly.file_velocities[1][axis].max(*v);
            }
        }
    }
}

/// Numbers nodes and elements part by part, without joins.
fn number(drafts: &[PartDraft], log: &Log<'_>) -> Mesh {
    let mut mesh = Mesh::default();
    let explicit = || drafts.iter().filter_map(|d| d.numbers.as_ref().map(|e| (d, e)));
    let mut next_node = explicit().flat_map(|(_, e)| e.nodes.iter().copied()).max().unwrap_or(0) + 1;
    let mut next_element = explicit().flat_map(|(_, e)| e.elements.iter().copied()).max().unwrap_or(0) + 1;
    // Numbers of different parts may not meet; inside a part this was looked at when it was read.
    let mut node_owner: Owners<'_> = BTreeMap::new();
    // Solids and shells are numbered apart.
    let mut element_owner: [Owners<'_>; 3] = Default::default();
    // The node of each number of each file: its parts share them.
    let mut of_file: BTreeMap<(&str, u32), u32> = BTreeMap::new();
    for draft in drafts {
        let (positions, topology) = match &draft.block {
            Some(block) => (block.positions.as_slice(), block.topology.clone()),
            None => (&[][..], Topology::Explicit { hexahedra: Vec::new() }),
        };
        let first = mesh.positions.len() as u32;
        let file = draft.numbers.as_ref().and_then(|own| own.mesh.as_deref().map(|file| (file, own)));
        if let Some((file, own)) = file {
            number_shared(&mut mesh, (positions, topology), draft, (file, own), &mut of_file, log);
            owned(own, draft, &mut element_owner, &mut node_owner, log);
            continue;
        }
        mesh.positions.extend_from_slice(positions);
        let mut part = Part {
            name: draft.name.clone(),
            material: draft.material.unwrap_or(0),
            topology,
            nodes: (first..mesh.positions.len() as u32).collect(),
            element_ids: Vec::new(),
            hourglass: draft.hourglass,
        };
        match &draft.numbers {
            Some(own) => {
                owned(own, draft, &mut element_owner, &mut node_owner, log);
                mesh.node_ids.extend(&own.nodes);
                part.element_ids = own.elements.clone();
            }
            None => {
                let n_elements = part.n_elements() as u32;
                mesh.node_ids.extend(next_node..next_node + part.nodes.len() as u32);
                next_node += part.nodes.len() as u32;
                part.element_ids = (next_element..next_element + n_elements).collect();
                next_element += n_elements;
            }
        }
        mesh.parts.push(part);
    }
    mesh
}

/// Adds a part of a mesh file: nodes that an earlier part of the file has are that part's, and stand where it has them.
fn number_shared<'a>(
    mesh: &mut Mesh,
    (positions, topology): (&[[f64; 3]], Topology),
    draft: &PartDraft,
    (file, own): (&'a str, &Numbers),
    of_file: &mut BTreeMap<(&'a str, u32), u32>,
    log: &Log<'_>,
) {
    let mut nodes = Vec::with_capacity(positions.len());
    let mut apart = None;
    for (x, id) in positions.iter().zip(&own.nodes) {
        let next = mesh.positions.len() as u32;
        let node = *of_file.entry((file, *id)).or_insert(next);
        if node == next {
            mesh.positions.push(*x);
            mesh.node_ids.push(*id);
        } else if mesh.positions[node as usize] != *x {
            apart.get_or_insert((*id, node));
        }
        nodes.push(node);
    }
    if let Some((id, node)) = apart {
        let other = mesh.parts.iter().find(|part| part.nodes.contains(&node));
        log.fault(
            draft.at,
            format!("node {id} of \"{file}\" moved by part \"{}\"", draft.name),
            format!("it where part \"{}\" has it", other.map_or("", |part| &part.name)),
            "give parts that share nodes the same rotate, translate and place",
        );
    }
    mesh.parts.push(Part {
        name: draft.name.clone(),
        material: draft.material.unwrap_or(0),
        topology,
        nodes,
        element_ids: own.elements.clone(),
        hourglass: draft.hourglass,
    });
}

/// Where each number was taken: its place, and the mesh.
type Owners<'a> = BTreeMap<u32, (Place, Option<&'a str>)>;

/// Reports numbers that an earlier part has; parts of one file share nodes.
fn owned<'a>(
    own: &'a Numbers,
    draft: &PartDraft,
    elements: &mut [Owners<'a>; 3],
    nodes: &mut Owners<'a>,
    log: &Log<'_>,
) {
    let kind = match draft.block.as_ref().map(|block| &block.topology) {
        None
        | Some(
            Topology::Structured { .. }
            | Topology::Explicit { .. }
            | Topology::EightPoint { .. }
            | Topology::Tetrahedra { .. },
        ) => 0,
        Some(Topology::Shells { .. }) => 1,
        Some(Topology::Trusses { .. } | Topology::Springs { .. } | Topology::Beams { .. }) => 2,
    };
    let elements = &mut elements[kind];
    for (ids, places, owner, what) in [
        (&own.nodes, &own.node_places, nodes, "node"),
        (&own.elements, &own.element_places, elements, "element"),
    ] {
        for (i, id) in ids.iter().enumerate() {
            let (place, file) = (places.of(i), own.mesh.as_deref());
            let Some((other, of)) = owner.insert(*id, (place, file)) else { continue };
            if what == "node" && file.is_some() && of == file {
                continue;
            }
            let line = log.line(other, place);
            log.fault(
                place,
                format!("{what} {id} of part \"{}\"", draft.name),
                format!("a number other than {id}, which {line} has"),
                "renumber one; nodes shared by parts are listed in both and joined",
            );
        }
    }
}

/// Smallest and largest edge of a part.
fn edges(positions: &[[f64; 3]], part: &Part) -> (f64, f64) {
    // Squares, of which one root is drawn at the end.
    let of_element = |e: usize| {
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        let mut see = |a: u32, b: u32| {
            let square = distance_square(positions[a as usize], positions[b as usize]);
            (low, high) = (low.min(square), high.max(square));
        };
        if let Topology::Tetrahedra { .. } = part.topology {
            let nodes = part.nodes_of(e);
            for (edge, [a, b]) in tet10::EDGES.into_iter().enumerate() {
                for end in [a, b] {
                    see(nodes[4 + edge], nodes[end]);
                }
            }
        } else {
            let corners = part.corners(e);
            for [a, b] in EDGES.into_iter().filter(|[a, b]| corners[*a] != corners[*b]) {
                see(corners[a], corners[b]);
            }
        }
        (low, high)
    };
    let (low, high) = (0..part.n_elements())
        .into_par_iter()
        .map(of_element)
        .reduce(|| (f64::INFINITY, 0.0), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    (low.sqrt(), high.sqrt())
}

/// Named faces of a part by global node.
fn global_faces(draft: &PartDraft, part: &Part) -> Vec<(&'static str, Vec<u32>)> {
    let Some(block) = &draft.block else { return Vec::new() };
    block
        .faces
        .iter()
        .map(|(name, nodes)| (*name, nodes.iter().map(|local| part.nodes[*local as usize]).collect()))
        .collect()
}

/// Initial velocities, mass-weighted where parts share a node, and the kinetic energy that this loses.
fn velocities(assembly: &mut Assembly, materials: &[Material]) {
    let mesh = &assembly.mesh;
    assembly.velocity = vec![[0.0; 3]; mesh.n_nodes()];
    for (part, velocity) in mesh.parts.iter().zip(&assembly.part_velocity) {
        for node in &part.nodes {
            assembly.velocity[*node as usize] = *velocity;
        }
    }
    if assembly.joined.is_empty() {
        return;
    }
    let mut holders: BTreeMap<u32, Vec<(usize, f64)>> = BTreeMap::new();
    let mut count = vec![0u32; mesh.n_nodes()];
    for part in &mesh.parts {
        for node in &part.nodes {
            count[*node as usize] += 1;
        }
    }
    let mut element = 0;
    for (p, part) in mesh.parts.iter().enumerate() {
        let density = materials.get(part.material as usize).map_or(1.0, |m| m.density);
        for e in 0..part.n_elements() {
            let whole = density * assembly.volumes[element];
            element += 1;
            for (&node, share) in part.nodes_of(e).iter().zip(part.shares(e)) {
                let mass = whole * share;
                if count[node as usize] > 1 {
                    let list = holders.entry(node).or_default();
                    match list.iter_mut().find(|(q, _)| *q == p) {
                        Some((_, m)) => *m += mass,
                        None => list.push((p, mass)),
                    }
                }
            }
        }
    }
    for (node, list) in holders {
        let first = assembly.part_velocity[list[0].0];
        if list.iter().all(|(p, _)| assembly.part_velocity[*p] == first) {
            assembly.velocity[node as usize] = first;
            continue;
        }
        let total: f64 = list.iter().map(|(_, m)| m).sum();
        if total == 0.0 {
            // Of springs alone: their mass is that of the deck.
            assembly.velocity[node as usize] = first;
            continue;
        }
        let mut velocity = [0.0; 3];
        let mut before = 0.0;
        for (p, m) in &list {
            let v = assembly.part_velocity[*p];
            for (sum, component) in velocity.iter_mut().zip(v) {
                *sum += m * component / total;
            }
            before += 0.5 * m * dot(v, v);
        }
        assembly.join_energy += before - 0.5 * total * dot(velocity, velocity);
        assembly.velocity[node as usize] = velocity;
    }
}
