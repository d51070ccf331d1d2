//! Search: which node-face pairs of a batch can meet. No distances, no forces; the candidate list is all that
//! leaves.
//!
//! The filter, in its order, each check with its reason:
//! 1. the parts interact (the deck's matrix);
//! 2. the node is no corner of the face's element (a node touches its own faces for ever);
//! 3. the pair is not excluded (it was inside the zone at time zero);
//! 4. the face's box, grown by the zone of warning and twice the slack, holds the node (stage zero, once per
//!    batch: a batch may begin to act some cycles after the sort, and between any two moments within the
//!    slack of the sorted positions lies at most twice the slack);
//! 5. the face's box, grown by the zone of warning, holds the node (stage one, every cycle).

use serde::{Deserialize, Serialize};

use super::{Settings, WARNING, batch::Batch, pair::Kind, surface::Surface, work_unit::WorkUnit};

/// Pairs that never interact because they were inside the zone at time zero.
///
/// Kept by global node and face key, so they survive a change of surface.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Exclusions {
    /// (face key, global node), ascending.
    pairs: Vec<(u64, u32)>,
    /// Pairs of edges by their global nodes, each ascending.
    edges: Vec<[[u32; 2]; 2]>,
}

impl Exclusions {
    /// Excludes pairs given as [`super::initial_pairs`] gives them.
    pub fn new(surface: &Surface, pairs: &[(u32, u32, f64)]) -> Self {
        let mut pairs: Vec<_> = pairs
            .iter()
            .map(|&(node, face, _)| (surface.faces[face as usize].key(), surface.nodes[node as usize]))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        Self { pairs, edges: Vec::new() }
    }

    /// Excludes pairs that start in contact on request: each node with its faces in `pairs` and, of their parts, with the
    /// faces around these, onto which it may slide; pairs of one part as [`Exclusions::new`] does.
    pub fn around(surface: &Surface, pairs: &[(u32, u32, f64)]) -> Self {
        let foreign =
            |&(n, f, _): &(u32, u32, f64)| surface.node_part[n as usize] != surface.faces[f as usize].part;
        let mut touched: Vec<u32> = pairs
            .iter()
            .filter(|pair| foreign(pair))
            .flat_map(|p| surface.faces[p.1 as usize].nodes)
            .collect();
        touched.sort_unstable();
        touched.dedup();
        let mut faces_at: Vec<Vec<u32>> = vec![Vec::new(); touched.len()];
        for (f, face) in (0..).zip(&surface.faces) {
            for node in face.nodes {
                if let Ok(at) = touched.binary_search(&node) {
                    faces_at[at].push(f);
                }
            }
        }
        let mut all = pairs.to_vec();
        for &(n, f, distance) in pairs.iter().filter(|pair| foreign(pair)) {
            let face = &surface.faces[f as usize];
            for node in face.nodes {
                let around = touched.binary_search(&node).map_or(&[][..], |at| &faces_at[at][..]);
                let near = around.iter().filter(|&&g| surface.faces[g as usize].part == face.part);
                all.extend(near.map(|&g| (n, g, distance)));
            }
        }
        Self::new(surface, &all)
    }

    /// Excludes pairs of a face's key and a global node.
    pub(super) fn of_keys(pairs: impl Iterator<Item = (u64, u32)>) -> Self {
        let mut pairs: Vec<_> = pairs.collect();
        pairs.sort_unstable();
        Self { pairs, edges: Vec::new() }
    }

    /// Whether the pair of a face, by its key, and a global node is excluded.
    pub(super) fn has(&self, face: u64, node: u32) -> bool {
        self.pairs.binary_search(&(face, node)).is_ok()
    }

    /// The same, and pairs of edges given as [`super::initial_edges`] gives them.
    #[must_use]
    pub fn with_edges(mut self, surface: &Surface, pairs: &[([u32; 2], f64)]) -> Self {
        let nodes = |edge: u32| surface.edges[edge as usize].nodes.map(|n| surface.nodes[n as usize]);
        self.edges = pairs.iter().map(|(pair, _)| pair.map(nodes)).collect();
        self.edges.sort_unstable();
        self.edges.dedup();
        self
    }

    /// The excluded pairs of edges of the surface, ascending.
    pub(super) fn edges_on(&self, surface: &Surface) -> Vec<[u32; 2]> {
        let index = |nodes: [u32; 2]| {
            let [a, b] = nodes.map(|n| surface.node_index(n));
            let key = [a?, b?];
            surface.edges.binary_search_by_key(&key, |edge| edge.nodes).ok().map(|at| at as u32)
        };
        let mut found: Vec<[u32; 2]> =
            self.edges.iter().filter_map(|&[a, b]| Some([index(a)?, index(b)?])).collect();
        found.sort_unstable();
        found
    }

    /// The excluded pairs (surface node, surface face) of which both are on the surface.
    pub fn on<'a>(&'a self, surface: &'a Surface) -> impl Iterator<Item = (u32, u32)> + 'a {
        self.pairs
            .iter()
            .filter_map(|&(key, node)| Some((surface.node_index(node)?, surface.face_index(key)?)))
    }
}

/// Node-face pairs that can meet, by node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Candidates {
    /// Batch nodes with at least one candidate.
    pub nodes: Vec<u32>,
    /// Where the faces of each of `nodes` begin in `faces`, and their end.
    pub starts: Vec<u32>,
    /// Batch faces, ascending for each node.
    pub faces: Vec<u32>,
}

/// Axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner (length).
    pub min: [f64; 3],
    /// Highest corner (length).
    pub max: [f64; 3],
}

impl Bounds {
    /// Box of four corners, grown on all sides.
    #[inline(always)]
    pub fn of(corners: &[[f64; 3]; 4], grow: f64) -> Self {
        let lower = |a: f64, b: f64| if a < b { a } else { b };
        let upper = |a: f64, b: f64| if a > b { a } else { b };
        let [p, q, r, s] = corners;
        Self {
            min: [0, 1, 2].map(|a| lower(lower(p[a], q[a]), lower(r[a], s[a])) - grow),
            max: [0, 1, 2].map(|a| upper(upper(p[a], q[a]), upper(r[a], s[a])) + grow),
        }
    }

    /// Box of points; one that meets nothing for none.
    fn around(points: &[[f64; 3]]) -> Self {
        let mut bounds = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        for p in points {
            for a in 0..3 {
                bounds.min[a] = if p[a] < bounds.min[a] { p[a] } else { bounds.min[a] };
                bounds.max[a] = if p[a] > bounds.max[a] { p[a] } else { bounds.max[a] };
            }
        }
        bounds
    }

    /// Whether two boxes have a point in common.
    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|a| self.min[a] <= other.max[a] && other.min[a] <= self.max[a])
    }

    /// The box that is smaller on all sides.
    fn shrunk(&self, by: f64) -> Self {
        Self { min: self.min.map(|c| c + by), max: self.max.map(|c| c - by) }
    }

    /// Whether a point lies inside or on the border.
    #[inline(always)]
    pub fn holds(&self, p: [f64; 3]) -> bool {
        (p[0] >= self.min[0])
            & (p[0] <= self.max[0])
            & (p[1] >= self.min[1])
            & (p[1] <= self.max[1])
            & (p[2] >= self.min[2])
            & (p[2] <= self.max[2])
    }
}

/// Leaves in each unit the nodes and faces that have a pair which can meet before the next sort (checks 1 to 4, with one
/// slack, for `x` are the sorted positions, by surface node), and gives by unit the number of those that are near
/// ([`Settings::near`]): what a cycle looks at, and what a unit weighs. The others cost a look once in several cycles. A cube of the sort reaches as far on all sides, a face's box only across the face;
/// on a plain surface far from others nothing is left.
pub fn cull(
    units: &mut [WorkUnit],
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    exclusions: &Exclusions,
) -> Vec<u64> {
    let reach = settings.reach();
    let beyond = reach - settings.near();
    let mut excluded: Vec<(u32, u32)> = exclusions.on(surface).collect();
    excluded.sort_unstable();
    const NONE: u32 = u32::MAX;
    // A face is in several units; its box is made once.
    let mut place = vec![NONE; surface.faces.len()];
    let mut boxes: Vec<Bounds> = Vec::new();
    let (mut at, mut met) = (Vec::new(), Vec::new());
    let of_unit = |unit: &mut WorkUnit| {
        if unit.kind != Kind::NodeFace {
            return unit.pairs.len() as u64;
        }
        let WorkUnit { nodes, faces, .. } = unit;
        at.clear();
        at.extend(nodes.iter().map(|&n| x[n as usize]));
        met.clear();
        met.resize(nodes.len(), false);
        let mut pairs = 0;
        // Most faces of a unit are those of its nodes' own body, or beside them all.
        let around = Bounds::around(&at);
        let of_nodes = nodes.first().map(|&n| surface.node_part[n as usize]);
        let alone = nodes.iter().all(|&n| Some(surface.node_part[n as usize]) == of_nodes);
        faces.retain(|&f| {
            let face = &surface.faces[f as usize];
            if alone && of_nodes.is_some_and(|part| !settings.permits(part, face.part)) {
                return false;
            }
            let place = &mut place[f as usize];
            if *place == NONE {
                *place = boxes.len() as u32;
                boxes.push(Bounds::of(&face.nodes.map(|n| x[n as usize]), reach));
            }
            let bounds = boxes[*place as usize];
            if !bounds.meets(&around) {
                return false;
            }
            let near = bounds.shrunk(beyond);
            let mut any = false;
            for (i, _) in at.iter().enumerate().filter(|(_, p)| bounds.holds(**p)) {
                let n = nodes[i];
                let meets = settings.permits(surface.node_part[n as usize], face.part)
                    && !face.own.contains(&n)
                    && (excluded.is_empty() || excluded.binary_search(&(n, f)).is_err());
                met[i] |= meets;
                any |= meets;
                pairs += u64::from(meets && near.holds(at[i]));
            }
            any
        });
        let mut met = met.iter();
        nodes.retain(|_| met.next().is_some_and(|met| *met));
        pairs
    };
    units.iter_mut().map(of_unit).collect()
}

/// Stage zero: the pairs of each unit that can meet before the next sort (checks 1 to 4). `x` by batch node.
pub fn candidates(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3]) -> Candidates {
    let n_parts = settings.n_parts();
    let grow = 2.0_f64.mul_add(settings.slack, WARNING * settings.gap);
    let at = |n: u32| [x[0][n as usize], x[1][n as usize], x[2][n as usize]];
    let bounds: Vec<Bounds> = batch.faces.iter().map(|f| Bounds::of(&f.nodes.map(at), grow)).collect();
    let mut found = Candidates { nodes: Vec::new(), starts: vec![0], faces: Vec::new() };
    for unit in &batch.units {
        for &n in &unit.nodes {
            let (p, node) = (at(n), &batch.nodes[n as usize]);
            let permitted = &settings.interacts[node.part as usize * n_parts..][..n_parts];
            let first = found.faces.len();
            for &f in &unit.faces {
                let face = &batch.faces[f as usize];
                if bounds[f as usize].holds(p)
                    && permitted[face.part as usize]
                    && !face.corners.contains(&node.global)
                    && (batch.excluded.is_empty()
                        || batch.excluded.binary_search(&(node.global, face.id)).is_err())
                {
                    found.faces.push(f);
                }
            }
            if found.faces.len() > first {
                found.faces[first..].sort_unstable();
                found.nodes.push(n);
                found.starts.push(found.faces.len() as u32);
            }
        }
    }
    found
}
