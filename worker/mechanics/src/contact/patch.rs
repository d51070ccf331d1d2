//! A patch: the faces of a surface that one worker holds, and their nodes. Workers that sort what they hold tell each other what of
//! their patches is near ([`Patch::near`]), and each sorts its own nodes against its own faces and those ([`sort`]).
//!
//! Every node is sorted by one worker, which sees all faces in reach of it. So the workers together list the pairs that
//! [`super::sort()`] of the whole surface lists, whatever the patches are. Only pairs of nodes and faces are found like this.

use serde::{Deserialize, Serialize};

use super::{
    Settings,
    batch::{self, Batch, BatchFace, BatchNode},
    kinds,
    search::{Exclusions, cull},
    surface::{Exposed, Face, Surface},
    work_unit::{Census, WorkUnit},
};
use crate::mesh::MAX_NODES;

/// Faces of a surface and their nodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Patch {
    /// By ascending global index.
    pub nodes: Vec<BatchNode>,
    /// By ascending id; their nodes are patch nodes.
    pub faces: Vec<BatchFace>,
}

/// A patch on its way to another worker: where its nodes are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlacedPatch {
    pub patch: Patch,
    /// By patch node (length).
    pub x: Vec<[f64; 3]>,
}

/// The box around the nodes of one part and the corners of its faces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartBox {
    pub part: u32,
    /// Lowest corner (length).
    pub low: [f64; 3],
    /// Highest corner (length).
    pub high: [f64; 3],
}

impl PartBox {
    const fn nothing(part: u32) -> Self {
        Self { part, low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] }
    }

    fn grow(&mut self, p: [f64; 3]) {
        for a in 0..3 {
            self.low[a] = self.low[a].min(p[a]);
            self.high[a] = self.high[a].max(p[a]);
        }
    }

    /// Whether two boxes are nearer to each other than `distance` along every axis.
    pub fn is_near(&self, other: &Self, distance: f64) -> bool {
        (0..3).all(|a| self.low[a] - distance <= other.high[a] && other.low[a] - distance <= self.high[a])
    }
}

/// What came of the sort of one patch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PatchSort {
    /// The units; none if nothing is near.
    pub batch: Option<Batch>,
    pub census: Census,
    /// Surface nodes that were looked at.
    pub seen: usize,
}

impl Patch {
    /// Of a surface: some of its faces (ascending), and some of its nodes (ascending) beside their corners. `mass` gives the mass of a
    /// global node.
    pub fn of(surface: &Surface, nodes: &[u32], faces: &[u32], mass: &dyn Fn(u32) -> f64) -> Self {
        let corners = faces.iter().flat_map(|&f| surface.faces[f as usize].nodes);
        let mut all: Vec<u32> = nodes.iter().copied().chain(corners).collect();
        all.sort_unstable();
        all.dedup();
        let node = |&n: &u32| {
            let i = n as usize;
            let global = surface.nodes[i];
            BatchNode {
                global,
                part: surface.node_part[i],
                mass: mass(global),
                stiffness: surface.node_stiffness[i],
                share: surface.node_share[i],
            }
        };
        let face = |&f: &u32| {
            let Face { nodes, part, stiffness, corners, .. } = surface.faces[f as usize];
            let nodes = nodes.map(|n| all.partition_point(|&other| other < n) as u32);
            BatchFace { nodes, id: f, part, stiffness, corners }
        };
        Self { nodes: all.iter().map(node).collect(), faces: faces.iter().map(face).collect() }
    }

    /// Whether every index is in range, parts among `n_parts`, and nodes and faces in order.
    pub fn is_sound(&self, n_parts: usize) -> bool {
        batch::are_sound(&self.nodes, &self.faces, n_parts)
    }

    /// The boxes of the parts that it has something of, ascending. `x` by patch node.
    pub fn boxes(&self, x: &[[f64; 3]]) -> Vec<PartBox> {
        let mut boxes: Vec<PartBox> = Vec::new();
        let mut grow = |part: u32, p: [f64; 3]| {
            let at = boxes.binary_search_by_key(&part, |of| of.part).unwrap_or_else(|at| {
                boxes.insert(at, PartBox::nothing(part));
                at
            });
            boxes[at].grow(p);
        };
        for (node, &p) in self.nodes.iter().zip(x) {
            grow(node.part, p);
        }
        for face in &self.faces {
            face.nodes.iter().for_each(|&n| grow(face.part, x[n as usize]));
        }
        boxes
    }

    /// Its faces, ascending, that are nearer than `distance` to the boxes of a patch with whose nodes they interact.
    pub fn near(&self, x: &[[f64; 3]], boxes: &[PartBox], settings: &Settings, distance: f64) -> Vec<u32> {
        let is_near = |face: &BatchFace| {
            let mut around = PartBox::nothing(face.part);
            face.nodes.iter().for_each(|&n| around.grow(x[n as usize]));
            boxes.iter().any(|of| settings.permits(of.part, face.part) && of.is_near(&around, distance))
        };
        (0..).zip(&self.faces).filter(|(_, face)| is_near(face)).map(|(f, _)| f).collect()
    }

    /// Some of its faces with their nodes, for another worker. `x` by patch node.
    pub fn placed(&self, faces: &[u32], x: &[[f64; 3]]) -> PlacedPatch {
        let mut nodes: Vec<u32> = faces.iter().flat_map(|&f| self.faces[f as usize].nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let face = |&f: &u32| {
            let face = self.faces[f as usize];
            let nodes = face.nodes.map(|n| nodes.partition_point(|&other| other < n) as u32);
            BatchFace { nodes, ..face }
        };
        let patch = Self {
            nodes: nodes.iter().map(|&n| self.nodes[n as usize]).collect(),
            faces: faces.iter().map(face).collect(),
        };
        PlacedPatch { patch, x: nodes.iter().map(|&n| x[n as usize]).collect() }
    }
}

impl PlacedPatch {
    /// Whether the patch is [sound](Patch::is_sound) and every node has a position that is a number.
    pub fn is_sound(&self, n_parts: usize) -> bool {
        self.patch.is_sound(n_parts)
            && self.x.len() == self.patch.nodes.len()
            && self.x.iter().flatten().all(|x| x.is_finite())
    }
}

/// How far patches can be from each other at the positions of the last sort and have pairs to list at the next (length): nodes move
/// against each other by the slack at most while its lists are in force.
pub fn margin(settings: &Settings) -> f64 {
    (settings.reach() + settings.slack) * (1.0 + 1e-9)
}

/// Sorts the nodes `sorted` (patch nodes, ascending) of a patch against its faces and those that others have sent. `x` by patch node;
/// `excluded` are pairs (global node, face id) that never interact.
///
/// # Panics
/// If a patch is not [sound](Patch::is_sound).
pub fn sort(
    own: &Patch,
    sorted: &[u32],
    x: &[[f64; 3]],
    others: &[PlacedPatch],
    settings: &Settings,
    excluded: &[(u32, u32)],
) -> PatchSort {
    let (surface, masses, x) = joined((own, x), others);
    let is_sorted = |n: u32| {
        let place = own.nodes.binary_search_by_key(&surface.nodes[n as usize], |node| node.global);
        place.is_ok_and(|place| sorted.binary_search(&(place as u32)).is_ok())
    };
    let sorted_here: Vec<bool> = (0..surface.nodes.len() as u32).map(is_sorted).collect();
    let exclusions = Exclusions::of_keys(excluded.iter().map(|&(node, id)| (key(id), node)));
    let mut units = kinds::sort(&surface, &x, settings, &exclusions);
    for unit in &mut units {
        let n = unit.nodes.len();
        unit.nodes.retain(|&node| sorted_here[node as usize]);
        if unit.nodes.len() < n {
            unit.interactions = interactions(unit, &surface, settings, &exclusions);
        }
    }
    units.retain(|unit| unit.interactions > 0);
    let census = Census::of(&units);
    cull(&mut units, &surface, &x, settings, &exclusions);
    let units: Vec<&WorkUnit> = units.iter().filter(|unit| !unit.is_empty()).collect();
    if units.is_empty() {
        return PatchSort { batch: None, census, seen: x.len() };
    }
    let mass = |node: u32| masses[surface.nodes.partition_point(|&other| other < node)];
    let mut batch = Batch::gather(&surface, &units, &mass, &exclusions);
    let id = |face: u32| surface.faces[face as usize].element;
    batch.faces.iter_mut().for_each(|face| face.id = id(face.id));
    batch.excluded.iter_mut().for_each(|(_, face)| *face = id(*face));
    PatchSort { batch: Some(batch), census, seen: x.len() }
}

/// Key of a face among those of patches.
const fn key(id: u32) -> u64 {
    id as u64 * 16
}

/// One surface of a patch and those that others have sent: faces have their id for an element. Gives masses and positions by node too.
fn joined((own, x): (&Patch, &[[f64; 3]]), others: &[PlacedPatch]) -> (Surface, Vec<f64>, Vec<[f64; 3]>) {
    let patches = || std::iter::once((own, x)).chain(others.iter().map(|other| (&other.patch, &other.x[..])));
    let mut nodes: Vec<(BatchNode, [f64; 3])> =
        patches().flat_map(|(patch, x)| patch.nodes.iter().copied().zip(x.iter().copied())).collect();
    nodes.sort_by_key(|(node, _)| node.global);
    nodes.dedup_by_key(|(node, _)| node.global);
    let place = |global: u32| nodes.binary_search_by_key(&global, |(node, _)| node.global);
    let face = |patch: &Patch, face: &BatchFace| {
        let at = |n: u32| place(patch.nodes[n as usize].global).unwrap_or_default() as u32;
        let BatchFace { nodes, id, part, stiffness, corners } = *face;
        let mut own = [u32::MAX; MAX_NODES];
        for (i, (own, corner)) in own.iter_mut().zip(corners).enumerate() {
            if corner != u32::MAX && !corners[..i].contains(&corner) {
                *own = place(corner).map_or(u32::MAX, |n| n as u32);
            }
        }
        Face { nodes: nodes.map(at), element: id, side: 0, part, stiffness, corners, own }
    };
    let mut faces: Vec<Face> =
        patches().flat_map(|(patch, _)| patch.faces.iter().map(move |of| face(patch, of))).collect();
    faces.sort_by_key(|face| face.element);
    faces.dedup_by_key(|face| face.element);
    let mut joined: Vec<(u32, u32)> = faces
        .iter()
        .flat_map(|face| face.nodes.map(|n| (n, face.part)))
        .filter(|&(n, part)| nodes[n as usize].0.part != part)
        .collect();
    joined.sort_unstable();
    joined.dedup();
    let of = |number: fn(&BatchNode) -> f64| nodes.iter().map(|(node, _)| number(node)).collect();
    let surface = Surface {
        nodes: nodes.iter().map(|(node, _)| node.global).collect(),
        node_part: nodes.iter().map(|(node, _)| node.part).collect(),
        node_stiffness: of(|node| node.stiffness),
        node_share: of(|node| node.share),
        active: vec![true; nodes.len()],
        joined,
        edges: Vec::new(),
        particles: Vec::new(),
        exposed: Exposed::default(),
        faces,
    };
    (surface, of(|node| node.mass), nodes.iter().map(|(_, x)| *x).collect())
}

/// The pairs of a unit to be tested, counted one by one.
fn interactions(unit: &WorkUnit, surface: &Surface, settings: &Settings, exclusions: &Exclusions) -> u64 {
    let of_face = |&f: &u32| {
        let face = &surface.faces[f as usize];
        let counts = |&&n: &&u32| {
            settings.permits(surface.node_part[n as usize], face.part)
                && !face.own.contains(&n)
                && !exclusions.has(face.key(), surface.nodes[n as usize])
        };
        unit.nodes.iter().filter(counts).count() as u64
    };
    unit.faces.iter().map(of_face).sum()
}
