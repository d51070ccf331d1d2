//! Which edges may meet before the next sort.
//!
//! A pair is kept if one of the edges sticks out, if the parts interact, if the edges share no node and are not of one element, if the pair was not
//! excluded at the start, and if the boxes of the two edges come within the reach: then it is on the list for as long as
//! the lists of nodes and faces are good, by the same rule on displacements. Edges are put into cubes that their boxes
//! touch; a pair belongs to the one cube that holds the lowest corner of what both boxes share.

use super::{
    super::{
        Settings, initial_pairs::ROUNDING, pair::Kind, search::Exclusions, surface::Surface,
        work_unit::WorkUnit,
    },
    Edge, zone,
};

/// Greatest cube index along an axis: three of them fit one key.
const MAX_CUBE: f64 = 2_097_000.0;

/// A box: lowest and highest corner.
type Bounds = [[f64; 3]; 2];

/// Units of edges that may meet before the next sort: pairs and their nodes, by cube; none where the deck does not ask for them.
/// `x` by surface node.
pub(in super::super) fn units(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    exclusions: &Exclusions,
) -> Vec<WorkUnit> {
    if !settings.edges {
        return Vec::new();
    }
    let excluded = exclusions.edges_on(surface);
    let mut units: Vec<WorkUnit> = Vec::new();
    for_each_near(surface, x, settings, settings.reach(), &mut |cube, [a, b]| {
        if excluded.binary_search(&[a, b]).is_ok() {
            return;
        }
        match units.last_mut() {
            Some(unit) if unit.cube == cube => unit.pairs.push([a, b]),
            _ => units.push(WorkUnit {
                kind: Kind::EdgeEdge,
                cube,
                pairs: vec![[a, b]],
                ..WorkUnit::default()
            }),
        }
    });
    for unit in &mut units {
        let nodes = unit.pairs.iter().flatten().flat_map(|&edge| surface.edges[edge as usize].nodes);
        unit.nodes = nodes.collect();
        unit.nodes.sort_unstable();
        unit.nodes.dedup();
        unit.interactions = unit.pairs.len() as u64;
    }
    units
}

/// Pairs of edges that interact and push each other already: two edges of the surface, distance. Between parts the deck
/// is at fault.
pub fn initial_edges(surface: &Surface, x: &[[f64; 3]], settings: &Settings) -> Vec<([u32; 2], f64)> {
    let mut pairs = Vec::new();
    for_each_near(surface, x, settings, settings.gap, &mut |_, [a, b]| {
        let [a_nodes, b_nodes] = [a, b].map(|edge| surface.edges[edge as usize].nodes.map(|n| x[n as usize]));
        let Some(closest) = zone::closest(&[a_nodes[0], a_nodes[1], b_nodes[0], b_nodes[1]]) else { return };
        let distance = closest.distance2.sqrt();
        if closest.crosses
            && distance < settings.gap * (1.0 - ROUNDING)
            && closest.weight(settings.gap).value > 0.0
        {
            pairs.push(([a, b], distance));
        }
    });
    pairs.sort_unstable_by_key(|&(pair, _)| pair);
    pairs
}

/// Calls `visit` with the cube and the edges (lower first) of every pair that may meet and whose boxes come within `reach`, by
/// ascending cube.
fn for_each_near(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    reach: f64,
    visit: &mut dyn FnMut([i32; 3], [u32; 2]),
) {
    let n_parts = settings.n_parts();
    let meets: Vec<bool> =
        (0..n_parts).map(|p| settings.interacts[p * n_parts..][..n_parts].contains(&true)).collect();
    // Half the reach on either side.
    let bounds: Vec<Bounds> = surface
        .edges
        .iter()
        .map(|edge| {
            let [p, q] = edge.nodes.map(|n| x[n as usize]);
            [[0, 1, 2].map(|a| p[a].min(q[a]) - 0.5 * reach), [0, 1, 2].map(|a| p[a].max(q[a]) + 0.5 * reach)]
        })
        .collect();
    let of = |sharp: bool| {
        let wanted = move |edge: &Edge| edge.sharp == sharp;
        (0..).zip(&surface.edges).filter(move |(_, edge)| wanted(edge)).map(|(index, _)| index)
    };
    let some =
        |sharp: bool| of(sharp).filter(|&edge: &u32| meets[surface.edges[edge as usize].part as usize]);
    if some(true).next().is_none() {
        return;
    }
    let all = some(true).chain(some(false)).map(|edge| &bounds[edge as usize]);
    let Some(grid) = Grid::new(all, reach) else { return };
    // Each edge in every cube that its box touches; flat ones where there are sharp ones.
    let mut held: Vec<([i32; 3], u32)> = Vec::new();
    some(true).for_each(|edge| grid.for_each_cube(&bounds[edge as usize], |cube| held.push((cube, edge))));
    held.sort_unstable();
    let mut cubes: Vec<[i32; 3]> = held.iter().map(|(cube, _)| *cube).collect();
    cubes.dedup();
    for edge in some(false) {
        grid.for_each_cube(&bounds[edge as usize], |cube| {
            if cubes.binary_search(&cube).is_ok() {
                held.push((cube, edge));
            }
        });
    }
    held.sort_unstable();
    for same in held.chunk_by(|a, b| a.0 == b.0) {
        let cube = same[0].0;
        for (n, &(_, i)) in same.iter().enumerate() {
            let first = &bounds[i as usize];
            for &(_, j) in &same[n + 1..] {
                if !surface.edges[i as usize].sharp && !surface.edges[j as usize].sharp {
                    continue;
                }
                let second = &bounds[j as usize];
                let apart = (0..3).any(|a| first[0][a] > second[1][a] || second[0][a] > first[1][a]);
                let pair = [i, j];
                if !apart
                    && grid.cube([0, 1, 2].map(|a| first[0][a].max(second[0][a]))) == cube
                    && may_meet(surface, settings, pair)
                {
                    visit(cube, pair);
                }
            }
        }
    }
}

/// Whether two edges interact by their parts, share no node, and are not of one element.
fn may_meet(surface: &Surface, settings: &Settings, pair: [u32; 2]) -> bool {
    let [a, b] = pair.map(|edge| &surface.edges[edge as usize]);
    if !settings.permits(a.part, b.part) || a.nodes.iter().any(|n| b.nodes.contains(n)) {
        return false;
    }
    let has = |faces: [u32; 2], nodes: [u32; 2]| {
        let elements = faces.into_iter().filter_map(|f| surface.faces.get(f as usize));
        elements.into_iter().any(|face| nodes.iter().all(|n| face.own.contains(n)))
    };
    !has(a.faces, b.nodes) && !has(b.faces, a.nodes)
}

/// The virtual grid: cubes counted from the lowest corner.
struct Grid {
    origin: [f64; 3],
    inverse_side: f64,
}

impl Grid {
    /// Cubes about as large as an edge, so that few hold many edges and few edges touch many; none without edges.
    fn new<'a>(bounds: impl Iterator<Item = &'a Bounds>, reach: f64) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (mut sum, mut longest, mut n) = (0.0, 0.0_f64, 0_u32);
        for [from, to] in bounds {
            let mut length = 0.0_f64;
            for a in 0..3 {
                low[a] = low[a].min(from[a]);
                high[a] = high[a].max(to[a]);
                length = length.max(to[a] - from[a]);
            }
            sum += length;
            n += 1;
            longest = longest.max(length);
        }
        if n == 0 {
            return None;
        }
        let mean = sum / f64::from(n);
        let side = (0..3).map(|a| (high[a] - low[a]) / MAX_CUBE).fold(2.0 * reach, f64::max);
        let side = side.max(mean).max(longest / 8.0);
        Some(Self { origin: low, inverse_side: if side > 0.0 { 1.0 / side } else { 1.0 } })
    }

    /// Calls `visit` with every cube that a box touches.
    fn for_each_cube(&self, [low, high]: &Bounds, mut visit: impl FnMut([i32; 3])) {
        let (low, high) = (self.cube(*low), self.cube(*high));
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                (low[0]..=high[0]).for_each(|i| visit([i, j, k]));
            }
        }
    }

    /// Cube of a point, monotonic in each coordinate.
    fn cube(&self, p: [f64; 3]) -> [i32; 3] {
        [0, 1, 2].map(|a| ((p[a] - self.origin[a]) * self.inverse_side).floor() as i32)
    }
}
