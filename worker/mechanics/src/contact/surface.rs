//! Surface: which faces of the elements that are alive lie outside, and their nodes.
//!
//! A face is outside if no second element that is alive has the same corner nodes; faces between joined parts
//! are therefore inside. A face of a degenerate element counts with its distinct nodes and vanishes with fewer
//! than three. The surface holds static data only; positions come from the caller, by surface node.
//!
//! Where elements erode the surface is collected anew without them. All nodes of parts that can erode are then among its nodes
//! from the start, so that the nodes whose positions and votes travel stay the same; [`Surface::active`] says which of them
//! can meet anything: those on faces, and those that have no element left.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    edges::{Edge, features::features},
    particles::Particle,
};
use crate::{
    material::Material,
    mesh::{MAX_NODES, Mesh, Part, Topology},
};

/// Depth (gaps) within which the penalty stops a node at the closing speed of its part; the rest of 0.9 is for the bodies
/// behind it.
const STOPPING_DEPTH: f64 = 0.75;

/// The outer faces of a mesh and their nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Global node index of each surface node, ascending.
    pub nodes: Vec<u32>,
    /// Part of each surface node; the lowest of them where joined parts share it (and the one whose row of the
    /// matrix counts for it).
    pub node_part: Vec<u32>,
    /// Mean of the stiffness of the faces around each surface node (force per length).
    pub node_stiffness: Vec<f64>,
    /// Material around each surface node against that around one inside a flat face, by volume: 1 there, 1/2 on an
    /// edge, 1/4 at a corner. The penalty takes this share, as the node carries that share of the pressure; otherwise
    /// the light nodes of edges and corners would rule the time step.
    pub node_share: Vec<f64>,
    /// Whether each surface node takes part in contact. Not those inside a part that can erode, nor those that were dropped.
    pub active: Vec<bool>,
    /// Faces by element, then side.
    pub faces: Vec<Face>,
    /// Nodes that joined parts share, with each part of theirs beside that of `node_part`: such a node interacts as one of the
    /// lowest part alone, but is a corner of faces of all.
    pub joined: Vec<(u32, u32)>,
    /// Edges that can meet others, by their nodes; empty unless they were asked for ([`Surface::find_edges`]).
    pub edges: Vec<Edge>,
    /// Nodes without an element that press on each other, by node; empty unless they were asked for ([`Surface::find_particles`]).
    pub particles: Vec<Particle>,
    /// What came out with the last change of the surface; nothing of one that has never changed.
    pub exposed: Exposed,
}

/// Nodes and faces that come out from under eroded elements, ascending. Of a surface nodes are surface nodes, of a batch batch
/// nodes; faces are surface faces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exposed {
    /// The first cycle with them.
    pub at: u64,
    pub nodes: Vec<u32>,
    pub faces: Vec<u32>,
    /// Nodes that become particles. A batch has this with its particles instead.
    pub particles: Vec<u32>,
}

/// One outer face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Surface node indices, outward by the right-hand rule.
    pub nodes: [u32; 4],
    /// Global element index.
    pub element: u32,
    /// Side of the element, see [`Part::side`].
    pub side: u32,
    /// Part of the element.
    pub part: u32,
    /// `K A^2 / V` of the element in its initial geometry (force per length).
    pub stiffness: f64,
    /// Global nodes of the element, which never interact with this face, and `u32::MAX` behind the last.
    pub corners: [u32; MAX_NODES],
    /// Surface nodes among those, each once, and `u32::MAX` in the other places.
    pub own: [u32; MAX_NODES],
}

impl Face {
    /// Whether it is a shell, which pushes nodes away on both its sides.
    pub fn is_shell(corners: &[u32; MAX_NODES]) -> bool {
        corners[..4] == corners[4..8] && corners[0] != corners[1]
    }

    /// A number that stays with this face when the surface is redefined.
    pub fn key(&self) -> u64 {
        u64::from(self.element) * 16 + u64::from(self.side)
    }
}

/// One side of one element on the way to the surface.
#[derive(Clone, Copy)]
struct Side {
    key: [u32; 3],
    element: u32,
    side: u32,
}

impl Surface {
    /// Collects the outer faces of the elements for which `alive` (by global element index) holds.
    ///
    /// # Panics
    /// If a part names a material or a node that does not exist: the deck has checked both.
    pub fn new(mesh: &Mesh, materials: &[Material], alive: &dyn Fn(u32) -> bool) -> Self {
        Self::eroded(mesh, materials, alive, &[], true)
    }

    /// The same with all nodes of the parts that can erode, whose flags are `erodes` (none for no part). Nodes of theirs without
    /// an element that is alive take part if inertia is retained. Nodal masses and shares are those of all elements, for
    /// mass stays at the nodes.
    ///
    /// # Panics
    /// As [`Surface::new`].
    pub fn eroded(
        mesh: &Mesh,
        materials: &[Material],
        alive: &dyn Fn(u32) -> bool,
        erodes: &[bool],
        retain_inertia: bool,
    ) -> Self {
        let alive: Vec<bool> = (0..mesh.n_elements() as u32).map(alive).collect();
        let mut outer = outer_sides(mesh, &alive);
        outer.sort_unstable();
        let offsets = mesh.element_offsets();
        let mut index = vec![u32::MAX; mesh.n_nodes()];
        let mut part = 0;
        let mut faces = Vec::with_capacity(outer.len());
        for (element, side) in outer {
            while element as usize >= offsets[part + 1] {
                part += 1;
            }
            let e = element as usize - offsets[part];
            let corners = mesh.parts[part].nodes_of(e);
            let bulk = materials[mesh.parts[part].material as usize].bulk();
            let nodes = mesh.parts[part].side(side as usize).map(|c| corners[c]);
            let area = area(nodes.map(|n| mesh.positions[n as usize]));
            let volume = mesh.parts[part].volume_of(e, &mesh.positions);
            for n in nodes {
                index[n as usize] = 0;
            }
            let stiffness = stiffness_of(&mesh.parts[part], e, bulk, [area, volume]);
            let part = part as u32;
            let corners = corners.padded();
            faces.push(Face { nodes, element, side, part, stiffness, corners, own: [u32::MAX; MAX_NODES] });
        }
        let on_faces = index.clone();
        for (part, _) in mesh.parts.iter().zip(erodes).filter(|(_, erodes)| **erodes) {
            for &n in &part.nodes {
                index[n as usize] = 0;
            }
        }
        let nodes: Vec<u32> = (0..mesh.n_nodes() as u32).filter(|&n| index[n as usize] == 0).collect();
        for (i, &n) in nodes.iter().enumerate() {
            index[n as usize] = i as u32;
        }
        let mut node_part = vec![u32::MAX; nodes.len()];
        let mut node_stiffness = vec![0.0; nodes.len()];
        let mut node_share = vec![0.0; nodes.len()];
        let mut count = vec![0_u32; nodes.len()];
        let mut around = vec![0.0; nodes.len()];
        let freed = freed(mesh, &alive, erodes, &nodes);
        let active: Vec<bool> = (0..)
            .zip(&nodes)
            .map(|(i, &n)| on_faces[n as usize] == 0 || (retain_inertia && freed.get(i) == Some(&true)))
            .collect();
        for (p, part) in (0..).zip(&mesh.parts) {
            let bulk = materials[part.material as usize].bulk();
            let touches = |&e: &usize| part.nodes_of(e).iter().any(|&n| index[n as usize] != u32::MAX);
            let touching: Vec<usize> = (0..part.n_elements()).into_par_iter().filter(touches).collect();
            for e in touching {
                let corners = part.nodes_of(e);
                let volume = part.volume_of(e, &mesh.positions);
                let of_node = part.spacing().node * volume;
                let shares = part.shares(e);
                for (corner, n) in corners.iter().map(|&n| index[n as usize] as usize).enumerate() {
                    if n == u32::MAX as usize {
                        continue;
                    }
                    around[n] += shares[corner] * volume;
                    if on_faces[nodes[n] as usize] == 0 {
                        continue;
                    }
                    // A node without faces is as stiff as the sides that it was a corner of.
                    node_part[n] = node_part[n].min(p);
                    let sides = part.sides().iter().map(|&side| part.side(side));
                    for side in sides.filter(|side| active[n] && side.contains(&corner)) {
                        let area = area(side.map(|c| mesh.positions[corners[c] as usize]));
                        node_stiffness[n] += stiffness_of(part, e, bulk, [area, volume]);
                        node_share[n] += of_node;
                        count[n] += 1;
                    }
                }
            }
        }
        for face in &mut faces {
            let of_part = &mesh.parts[face.part as usize];
            let e = face.element as usize - offsets[face.part as usize];
            let of_node = of_part.spacing().node * of_part.volume_of(e, &mesh.positions);
            face.nodes = face.nodes.map(|n| index[n as usize]);
            for (i, n) in face.corners.into_iter().enumerate() {
                if n != u32::MAX && !face.corners[..i].contains(&n) {
                    face.own[i] = index[n as usize];
                }
            }
            for n in face.nodes.map(|n| n as usize) {
                node_part[n] = node_part[n].min(face.part);
                node_stiffness[n] += face.stiffness;
                node_share[n] += of_node;
                count[n] += 1;
            }
        }
        for n in (0..nodes.len()).filter(|&n| count[n] > 0) {
            node_stiffness[n] /= f64::from(count[n]);
            let half_mean = 0.5 * node_share[n] / f64::from(count[n]);
            node_share[n] = if half_mean > 0.0 { (around[n] / half_mean).min(1.0) } else { 1.0 };
        }
        let mut joined: Vec<(u32, u32)> = faces
            .iter()
            .flat_map(|face| face.nodes.map(|n| (n, face.part)))
            .filter(|&(n, part)| node_part[n as usize] != part)
            .collect();
        joined.sort_unstable();
        joined.dedup();
        Self {
            nodes,
            node_part,
            node_stiffness,
            node_share,
            active,
            faces,
            joined,
            edges: Vec::new(),
            particles: Vec::new(),
            exposed: Exposed::default(),
        }
    }

    /// Notes what this surface, which is in force from cycle `at` on, has and the one `before` had not. Both have the same nodes.
    pub fn note_exposed(&mut self, before: &Self, at: u64) {
        let new = |face: &Face| before.face_index(face.key()).is_none();
        let faces = (0..).zip(&self.faces).filter(|(_, face)| new(face)).map(|(f, _)| f).collect();
        let active = self.active.iter().zip(&before.active);
        let nodes = (0..).zip(active).filter(|(_, (now, then))| **now && !**then).map(|(n, _)| n).collect();
        self.exposed = Exposed { at, nodes, faces, particles: self.new_particles(before) };
    }

    /// Collects the edges that stick out, for contact of edges.
    pub fn find_edges(&mut self, mesh: &Mesh) {
        self.edges = features(self, mesh);
    }

    /// Raises stiffness where bodies close in so fast that `K A^2 / V` could not stop them inside the gap.
    ///
    /// A node of mass m at speed v sinks `v sqrt(m / k)` into a spring, so `k >= m v^2 / (3/4 gap)^2` holds it; m is half
    /// its element's mass, as for a node inside a flat face. `speed` is the closing speed of each part, static data
    /// of the deck like the rest (length per time). The time step pays nothing: it is bound by gap and speed already.
    pub fn stiffen(
        &mut self,
        mesh: &Mesh,
        materials: &[Material],
        settings: &super::Settings,
        speed: &[f64],
    ) {
        let depth = STOPPING_DEPTH * settings.gap;
        let mut sum = vec![0.0; self.nodes.len()];
        let mut count = vec![0_u32; self.nodes.len()];
        let offsets = mesh.element_offsets();
        let least = |part: usize, e: usize| {
            let of_part = &mesh.parts[part];
            let density = materials[of_part.material as usize].density;
            let mass = density * (of_part.spacing().node * of_part.volume_of(e, &mesh.positions));
            0.5 * mass * speed[part] * speed[part] / (depth * depth * settings.stiffness)
        };
        for face in &mut self.faces {
            let part = face.part as usize;
            let least = least(part, face.element as usize - offsets[part]);
            face.stiffness = face.stiffness.max(least);
            for n in face.nodes {
                sum[n as usize] += face.stiffness;
                count[n as usize] += 1;
            }
        }
        for (n, stiffness) in self.node_stiffness.iter_mut().enumerate() {
            if count[n] > 0 {
                *stiffness = sum[n] / f64::from(count[n]);
            }
        }
        let freed = |n: usize| self.active[n] && count[n] == 0;
        if !(0..self.nodes.len()).any(freed) {
            return;
        }
        for (p, part) in mesh.parts.iter().enumerate() {
            for e in 0..part.n_elements() {
                for node in part.nodes_of(e).iter() {
                    let Ok(n) = self.nodes.binary_search(node) else { continue };
                    if self.active[n] && count[n] == 0 {
                        self.node_stiffness[n] = self.node_stiffness[n].max(least(p, e));
                    }
                }
            }
        }
    }

    /// Number of elements with at least one outer face.
    pub fn n_elements(&self) -> usize {
        self.faces.chunk_by(|a, b| a.element == b.element).count()
    }

    /// Shortest edge of any face (length); infinite without faces. `x` by surface node.
    pub fn smallest_dimension(&self, x: &[[f64; 3]]) -> f64 {
        self.smallest_dimension_of(x, &mut self.faces.iter())
    }

    /// Shortest edge of some faces (length).
    pub(crate) fn smallest_dimension_of(
        &self,
        x: &[[f64; 3]],
        faces: &mut dyn Iterator<Item = &Face>,
    ) -> f64 {
        let mut smallest = f64::INFINITY;
        for face in faces {
            for i in 0..4 {
                let (a, b) = (face.nodes[i], face.nodes[(i + 1) & 3]);
                if a != b {
                    let (a, b) = (x[a as usize], x[b as usize]);
                    let e = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
                    let length2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
                    smallest = if length2 < smallest { length2 } else { smallest };
                }
            }
        }
        smallest.sqrt()
    }

    /// Surface node index of a global node, if it is on the surface.
    pub fn node_index(&self, global: u32) -> Option<u32> {
        self.nodes.binary_search(&global).ok().map(|i| i as u32)
    }

    /// Face index of a key ([`Face::key`]), if that face is outside.
    pub fn face_index(&self, key: u64) -> Option<u32> {
        self.faces.binary_search_by_key(&key, Face::key).ok().map(|i| i as u32)
    }
}

/// Penalty stiffness of a side of element `e` of a part.
fn stiffness_of(part: &Part, e: usize, bulk: f64, [area, volume]: [f64; 2]) -> f64 {
    match part.thickness_of(e) {
        // As the shell itself resists in its plane: across its thickness it would rule the time step.
        Some(thickness) => bulk * thickness,
        None if volume > 0.0 => bulk * area * area / (part.spacing().side * volume),
        None => 0.0,
    }
}

/// Whether each of `nodes` (ascending) is of parts that can erode and has no element that is alive; empty if no part can.
fn freed(mesh: &Mesh, alive: &[bool], erodes: &[bool], nodes: &[u32]) -> Vec<bool> {
    if !erodes.contains(&true) {
        return Vec::new();
    }
    let mut held = vec![false; mesh.n_nodes()];
    let mut element = 0;
    for part in &mesh.parts {
        for e in 0..part.n_elements() {
            if alive[element] {
                part.nodes_of(e).iter().for_each(|&n| held[n as usize] = true);
            }
            element += 1;
        }
    }
    nodes.iter().map(|&n| !held[n as usize]).collect()
}

/// Element and side of every outer face, in no order. Sides are bucketed by their lowest node, so that each
/// is compared with a few others only.
fn outer_sides(mesh: &Mesh, alive: &[bool]) -> Vec<(u32, u32)> {
    let shared = shared_nodes(mesh);
    let candidates = candidates(mesh, alive, &shared);
    let mut starts = vec![0_u32; mesh.n_nodes() + 1];
    for_each_side(mesh, alive, (&candidates, &shared), &mut |lowest, _| starts[lowest as usize + 1] += 1);
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let empty = Side { key: [0; 3], element: 0, side: 0 };
    let mut sides = vec![empty; starts[starts.len() - 1] as usize];
    let mut next = starts.clone();
    for_each_side(mesh, alive, (&candidates, &shared), &mut |lowest, side| {
        sides[next[lowest as usize] as usize] = side;
        next[lowest as usize] += 1;
    });
    let mut outer = Vec::new();
    for bucket in starts.windows(2) {
        let bucket = &sides[bucket[0] as usize..bucket[1] as usize];
        for (i, side) in bucket.iter().enumerate() {
            if !bucket.iter().enumerate().any(|(j, other)| j != i && other.key == side.key) {
                outer.push((side.element, side.side));
            }
        }
    }
    outer
}

/// Whether each node is one of several parts, or has several places in the index space of one.
fn shared_nodes(mesh: &Mesh) -> Vec<bool> {
    let (mut seen, mut shared) = (vec![false; mesh.n_nodes()], vec![false; mesh.n_nodes()]);
    for &node in mesh.parts.iter().flat_map(|part| &part.nodes) {
        shared[node as usize] |= std::mem::replace(&mut seen[node as usize], true);
    }
    shared
}

/// Which sides of an element of an index space, as [`FACES`](crate::mesh::FACES) has them, another element of it has too, which is
/// alive; `alive` is by element of the part.
fn inside_of(cells: [u32; 3], e: usize, alive: &[bool]) -> [bool; 6] {
    let [ni, nj, nk] = cells.map(|c| c as usize);
    let [i, j, k] = [e % ni, e / ni % nj, e / ni / nj];
    [
        k > 0 && alive[e - ni * nj],
        k + 1 < nk && alive[e + ni * nj],
        j > 0 && alive[e - ni],
        i + 1 < ni && alive[e + 1],
        j + 1 < nj && alive[e + ni],
        i > 0 && alive[e - 1],
    ]
}

/// Which sides of an element of a part lie between it and its neighbours in an index space.
fn inside(part: &Part, e: usize, alive: &[bool]) -> [bool; 6] {
    match &part.topology {
        Topology::Structured { cells } => inside_of(*cells, e, alive),
        _ => [false; 6],
    }
}

/// Elements of each part that are alive and may have a side outside.
fn candidates(mesh: &Mesh, alive: &[bool], shared: &[bool]) -> Vec<Vec<u32>> {
    let mut first = 0;
    let of_part = |part: &Part| {
        let alive = &alive[first..first + part.n_elements()];
        first += part.n_elements();
        let may = |&e: &u32| {
            let e = e as usize;
            alive[e]
                && (inside(part, e, alive) != [true; 6]
                    || part.nodes_of(e).iter().any(|&n| shared[n as usize]))
        };
        (0..alive.len() as u32).into_par_iter().filter(may).collect()
    };
    mesh.parts.iter().map(of_part).collect()
}

/// Calls `visit` with the lowest node of every side of the candidates that may be outside, and the rest of its key. Left out are
/// sides between two elements of an index space: a third element could have such a side only if it shared its nodes.
fn for_each_side(
    mesh: &Mesh,
    alive: &[bool],
    (candidates, shared): (&[Vec<u32>], &[bool]),
    visit: &mut dyn FnMut(u32, Side),
) {
    let mut first = 0;
    for (part, candidates) in mesh.parts.iter().zip(candidates) {
        let alive = &alive[first..first + part.n_elements()];
        for &e in candidates {
            let (element, e) = (first as u32 + e, e as usize);
            let (inside, corners) = (inside(part, e, alive), part.nodes_of(e));
            // A shell is one face, whose zone acts on both its sides.
            for &side in part.sides() {
                let between = inside.get(side) == Some(&true);
                if between && !part.side(side).iter().any(|&c| shared[corners[c] as usize]) {
                    continue;
                }
                let mut key = part.side(side).map(|c| corners[c]);
                key.sort_unstable();
                for i in 1..4 {
                    if key[i] == key[i - 1] {
                        key[i - 1] = u32::MAX;
                    }
                }
                key.sort_unstable();
                if key[2] != u32::MAX {
                    visit(key[0], Side { key: [key[1], key[2], key[3]], element, side: side as u32 });
                }
            }
        }
        first += part.n_elements();
    }
}

/// Magnitude of the vector area of a quadrilateral: half the cross product of its diagonals.
fn area(x: [[f64; 3]; 4]) -> f64 {
    let d = |a: [f64; 3], b: [f64; 3]| [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let (p, q) = (d(x[0], x[2]), d(x[1], x[3]));
    let c = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    0.5 * (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]).sqrt()
}
