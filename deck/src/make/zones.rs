//! Contact zones that overlap at the start: a node of one part inside another part, or nearer than the gap
//! to a face of it.
//!
//! The gap lies outside the bodies, so parts that touch in reality start one gap apart in the deck. Pairs
//! that do not interact, and pairs that joins make one body, are not looked at. Each pair is reported once,
//! with its worst node.

use std::collections::BTreeMap;

use mechanics::contact::{ROUNDING, Settings};
use rayon::prelude::*;

use super::{assembly::Assembly, part::PartDraft, surface::Face};
use crate::{
    fault::short,
    geometry::{add, norm, scaled, triangle_distance},
    log::Log,
};

/// The least distance found for a pair, and whether a node is inside.
#[derive(Clone, Copy)]
struct Worst {
    node: u32,
    distance: f64,
    inside: bool,
}

/// Reports every pair of parts whose zones overlap.
pub(super) fn overlaps(
    parts: &[PartDraft],
    assembly: &Assembly,
    settings: &Settings,
    faces: &[Face],
    log: &Log<'_>,
) {
    let gap = settings.gap;
    let found = worst_of_pairs(assembly, &settings.meet_from_apart(), faces, gap);
    for ((a, b), worst) in found {
        let line = log.line(parts[a].at, parts[b].at);
        let id = assembly.mesh.node_ids[worst.node as usize];
        let how = if worst.inside {
            format!("node {id} inside the other part")
        } else {
            format!("node {id} only {} from the other part", short(worst.distance))
        };
        log.fault(
            parts[b].at,
            format!("part \"{}\" that meets part \"{}\" ({line}): {how}", parts[b].name, parts[a].name),
            format!("parts at least one gap ({}) apart at the start", short(gap)),
            log.say(
                "move one of them, join them, switch the pair off in [[contact.pair]], or write contact.initial_penetration = \"ignore\"",
                "move one of them, name other parts in the *CONTACT, or give it IGNORE 1, which is initial_penetration = \"ignore\"",
            ),
        );
    }
}

/// The least distance of a node of one part from the surface of another that it may meet, as far as it is below
/// `within`; 0 where a node is inside.
pub(super) fn clearance(assembly: &Assembly, interacts: &[bool], faces: &[Face], within: f64) -> Option<f64> {
    let found = worst_of_pairs(assembly, interacts, faces, within);
    found.values().map(|w| if w.inside { 0.0 } else { w.distance }).min_by(f64::total_cmp)
}

/// The worst node of each pair of parts that are nearer than `gap`, lower part first.
fn worst_of_pairs(
    assembly: &Assembly,
    interacts: &[bool],
    faces: &[Face],
    gap: f64,
) -> BTreeMap<(usize, usize), Worst> {
    let n = assembly.mesh.parts.len();
    let surfaces: Vec<Surface> = (0..n).map(|p| Surface::of(p as u32, assembly, faces)).collect();
    let mut found: BTreeMap<(usize, usize), Worst> = BTreeMap::new();
    for (a, nodes) in surfaces.iter().enumerate() {
        for (b, faces) in surfaces.iter().enumerate() {
            let pair = (a.min(b), a.max(b));
            let apart = a == b || !interacts[a * n + b] || assembly.joined.binary_search(&pair).is_ok();
            if apart || !nodes.meets(faces, gap) {
                continue;
            }
            if let Some(worst) = worst_node(nodes, faces, assembly, gap) {
                let deeper = |old: &Worst| {
                    (worst.inside && !old.inside)
                        || (worst.inside == old.inside && worst.distance < old.distance)
                };
                let entry = found.entry(pair).or_insert(worst);
                if deeper(entry) {
                    *entry = worst;
                }
            }
        }
    }
    found
}

/// The outer faces and nodes of one part, and the box around them.
struct Surface<'a> {
    faces: &'a [Face],
    nodes: Vec<u32>,
    low: [f64; 3],
    high: [f64; 3],
}

impl<'a> Surface<'a> {
    fn of(part: u32, assembly: &Assembly, faces: &'a [Face]) -> Self {
        // Faces stand in the order of their parts.
        let first = faces.partition_point(|f| f.part < part);
        let faces = &faces[first..faces.partition_point(|f| f.part <= part)];
        let mut nodes: Vec<u32> = faces.iter().flat_map(|f| f.nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for node in &nodes {
            for (axis, x) in assembly.mesh.positions[*node as usize].into_iter().enumerate() {
                low[axis] = low[axis].min(x);
                high[axis] = high[axis].max(x);
            }
        }
        Self { faces, nodes, low, high }
    }

    /// Whether the boxes come within `reach`.
    fn meets(&self, other: &Self, reach: f64) -> bool {
        (0..3).all(|a| self.low[a] <= other.high[a] + reach && other.low[a] <= self.high[a] + reach)
    }
}

/// The worst node of one surface against the faces of another.
fn worst_node(nodes: &Surface<'_>, faces: &Surface<'_>, assembly: &Assembly, gap: f64) -> Option<Worst> {
    let position = |node: u32| assembly.mesh.positions[node as usize];
    let candidates: Vec<u32> = nodes
        .nodes
        .iter()
        .copied()
        .filter(|&node| {
            let x = position(node);
            (0..3).all(|a| x[a] >= faces.low[a] - gap && x[a] <= faces.high[a] + gap)
        })
        .collect();
    // Columns along z: a face can only be above or near a node whose column it reaches.
    let columns = Columns::of(&candidates, assembly, faces, gap);
    let none =
        |within: f64| Seen { nearest: vec![within; candidates.len()], above: vec![0; candidates.len()] };
    let see = |mut seen: Seen, face: &Face| {
        let corners = face.nodes.map(position);
        let middle = scaled(add(add(corners[0], corners[1]), add(corners[2], corners[3])), 0.25);
        let bounds = Bounds::of(&corners);
        columns.of_face(&corners, gap, |c| {
            let x = position(candidates[c as usize]);
            let (nearest, above) = (&mut seen.nearest[c as usize], &mut seen.above[c as usize]);
            // No triangle of the face is nearer than the box around it, and none is crossed beside or below it.
            let may_be_nearer = bounds.least_distance(x) <= *nearest;
            let ray = columns.beside(x);
            let may_cross = bounds.may_be_above(ray);
            for side in 0..4 {
                let (p, q) = (corners[side], corners[(side + 1) % 4]);
                if may_be_nearer {
                    *nearest = nearest.min(triangle_distance(x, p, q, middle));
                }
                *above += u32::from(may_cross && crosses(ray, p, q, middle));
            }
        });
        seen
    };
    // Neither least distances nor counts have an order.
    let look = |within: f64| {
        let faces = faces.faces.par_iter().with_min_len(AT_A_TIME);
        faces.fold(|| none(within), see).reduce(|| none(within), Seen::and)
    };
    let is_odd = |above: &u32| above % 2 == 1;
    let within = gap * (1.0 - ROUNDING);
    // Nothing is inside a shell.
    let part = faces.faces.first().map_or(0, |face| face.part as usize);
    let solid = assembly.mesh.parts[part].section().is_none();
    let mut seen = look(within);
    if solid && seen.above.iter().any(is_odd) {
        // Of nodes inside the one nearest to the surface is named, however deep it is.
        seen = look(f64::INFINITY);
    }
    let Seen { nearest, above } = seen;
    let worst = (0..candidates.len())
        .map(|c| Worst { node: candidates[c], distance: nearest[c], inside: solid && is_odd(&above[c]) })
        .filter(|w| w.inside || w.distance < within)
        .min_by(|a, b| b.inside.cmp(&a.inside).then(a.distance.total_cmp(&b.distance)))?;
    Some(worst)
}

/// Faces that one thread looks at before it asks for others.
const AT_A_TIME: usize = 4096;

/// What faces are to the candidates.
struct Seen {
    /// The least distance, or what was looked within.
    nearest: Vec<f64>,
    /// How many triangles are above.
    above: Vec<u32>,
}

impl Seen {
    /// With what other faces are to them.
    fn and(mut self, other: Self) -> Self {
        self.nearest.iter_mut().zip(other.nearest).for_each(|(one, other)| *one = one.min(other));
        self.above.iter_mut().zip(other.above).for_each(|(one, other)| *one += other);
        self
    }
}

/// The box around a face.
struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
}

impl Bounds {
    fn of(corners: &[[f64; 3]; 4]) -> Self {
        let end = |axis: usize, pick: fn(f64, f64) -> f64| {
            corners.iter().map(|corner| corner[axis]).reduce(pick).unwrap_or_default()
        };
        Self {
            low: std::array::from_fn(|axis| end(axis, f64::min)),
            high: std::array::from_fn(|axis| end(axis, f64::max)),
        }
    }

    /// A little less than the distance of a point from the box, so that rounding does not count.
    fn least_distance(&self, x: [f64; 3]) -> f64 {
        let outside = |axis: usize| (self.low[axis] - x[axis]).max(x[axis] - self.high[axis]).max(0.0);
        (1.0 - 1e-9) * norm([0, 1, 2].map(outside))
    }

    /// Whether a ray from `x` along +z may cross what is in the box.
    fn may_be_above(&self, x: [f64; 3]) -> bool {
        let within = |axis: usize| self.low[axis] <= x[axis] && x[axis] <= self.high[axis];
        within(0) && within(1) && x[2] <= self.high[2]
    }
}

/// Whether the ray from `x` along +z crosses the triangle.
fn crosses(x: [f64; 3], a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> bool {
    let turn =
        |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]).mul_add(x[1] - p[1], -((q[1] - p[1]) * (x[0] - p[0])));
    let (u, v, w) = (turn(b, c), turn(c, a), turn(a, b));
    if !((u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0)) {
        return false;
    }
    let sum = u + v + w;
    (u / sum).mul_add(a[2], (v / sum).mul_add(b[2], (w / sum) * c[2])) > x[2]
}

/// Nodes sorted into columns along z.
struct Columns {
    /// Nodes (by index among the candidates) of each column.
    columns: BTreeMap<[i64; 2], Vec<u32>>,
    width: f64,
    /// How far rays stand beside their node, so that they miss edges of aligned meshes.
    aside: [f64; 2],
}

impl Columns {
    fn of(candidates: &[u32], assembly: &Assembly, faces: &Surface<'_>, gap: f64) -> Self {
        let part = faces.faces.first().map_or(0, |f| f.part as usize);
        let edge = assembly.smallest_edge[part];
        let width = assembly.largest_edge[part].max(gap);
        let mut this = Self {
            columns: BTreeMap::new(),
            width,
            aside: [0.618_033_988e-4 * edge, 0.414_213_562e-4 * edge],
        };
        for (c, node) in candidates.iter().enumerate() {
            let x = assembly.mesh.positions[*node as usize];
            let column = this.column(x[0], x[1]);
            this.columns.entry(column).or_default().push(c as u32);
        }
        this
    }

    fn column(&self, x: f64, y: f64) -> [i64; 2] {
        [x, y].map(|c| (c / self.width).floor() as i64)
    }

    /// The start of a node's ray.
    fn beside(&self, x: [f64; 3]) -> [f64; 3] {
        [x[0] + self.aside[0], x[1] + self.aside[1], x[2]]
    }

    /// Looks at the nodes in the columns that a face reaches; a face is at most one width across, so these are a
    /// few columns.
    fn of_face(&self, corners: &[[f64; 3]; 4], gap: f64, mut look: impl FnMut(u32)) {
        let end = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
            corners.iter().map(|c| c[axis]).fold(start, pick)
        };
        let low = self.column(
            end(0, f64::min, f64::INFINITY) - gap - self.aside[0],
            end(1, f64::min, f64::INFINITY) - gap - self.aside[1],
        );
        let high =
            self.column(end(0, f64::max, f64::NEG_INFINITY) + gap, end(1, f64::max, f64::NEG_INFINITY) + gap);
        for i in low[0]..=high[0] {
            for (_, column) in self.columns.range([i, low[1]]..=[i, high[1]]) {
                column.iter().for_each(|&node| look(node));
            }
        }
    }
}
