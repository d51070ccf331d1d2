//! Joins: coincident nodes of different parts become one.

use std::collections::HashMap;

use mechanics::mesh::{Mesh, Part};

use super::assembly::{Assembly, Join};
use crate::{
    fault::short,
    geometry::{norm, sub},
    log::Log,
    place::Place,
};

/// Merges coincident nodes of joined parts: a merged node keeps the lowest index, the others close up.
pub(super) fn merge(mesh: &mut Mesh, joins: &[Join], assembly: &mut Assembly, log: &Log<'_>) {
    let n_nodes = mesh.n_nodes();
    let mut part_of = vec![0u32; n_nodes];
    for (p, part) in mesh.parts.iter().enumerate() {
        for node in &part.nodes {
            part_of[*node as usize] = p as u32;
        }
    }
    // Each node points to one of lower or equal index; following them ends at the node that stays.
    let mut root: Vec<u32> = (0..n_nodes as u32).collect();
    for join in joins {
        let edge = join.parts.iter().map(|&p| assembly.smallest_edge[p]).fold(f64::INFINITY, f64::min);
        let tolerance = join.tolerance * edge;
        let empty = join.parts.iter().any(|&p| mesh.parts[p].nodes.is_empty());
        if !tolerance.is_finite() || tolerance <= 0.0 || empty {
            continue;
        }
        let merged = merge_pairs(mesh, join, tolerance, &part_of, &mut root);
        if merged == 0 {
            let names: Vec<String> =
                join.parts.iter().map(|&p| format!("\"{}\"", mesh.parts[p].name)).collect();
            log.fault(
                join.at,
                format!("a join of parts {} that share no nodes", names.join(", ")),
                format!("coincident nodes within {}", short(tolerance)),
                "move or mesh the parts so that nodes coincide, or raise the tolerance",
            );
        }
    }
    for node in 0..n_nodes as u32 {
        root[node as usize] = find(&root, node);
    }
    assembly.collapsed = collapsed(mesh, &root, &part_of, joins, log);
    // Close up the numbering.
    let mut new = vec![0u32; n_nodes];
    let mut kept = 0;
    for node in 0..n_nodes {
        if root[node] == node as u32 {
            new[node] = kept;
            mesh.positions[kept as usize] = mesh.positions[node];
            mesh.node_ids[kept as usize] = mesh.node_ids[node];
            kept += 1;
        }
    }
    mesh.positions.truncate(kept as usize);
    mesh.node_ids.truncate(kept as usize);
    for node in 0..n_nodes {
        new[node] = new[root[node] as usize];
        if root[node] != node as u32 {
            let (a, b) = (part_of[root[node] as usize] as usize, part_of[node] as usize);
            assembly.joined.push((a.min(b), a.max(b)));
        }
    }
    for part in &mut mesh.parts {
        for node in &mut part.nodes {
            *node = new[*node as usize];
        }
    }
    assembly.node_of_id.renumber(&new);
    assembly.joined.sort_unstable();
    assembly.joined.dedup();
}

/// The node that `node` is merged into so far.
fn find(root: &[u32], mut node: u32) -> u32 {
    while root[node as usize] != node {
        node = root[node as usize];
    }
    node
}

/// Unites every pair of nodes of different parts of a join within `tolerance`; the number of pairs. The
/// result does not depend on the order in which pairs are met.
fn merge_pairs(mesh: &Mesh, join: &Join, tolerance: f64, part_of: &[u32], root: &mut [u32]) -> usize {
    let cell = |p: [f64; 3]| p.map(|x| (x / (2.0 * tolerance)).floor() as i64);
    let boxes: Vec<Bounds> =
        join.parts.iter().map(|&p| Bounds::of(mesh, &mesh.parts[p], tolerance)).collect();
    // The first node of each cell, and behind each node the next in its cell.
    let mut first: HashMap<[i64; 3], u32> = HashMap::new();
    let mut nodes: Vec<(u32, u32)> = Vec::new();
    let mut merged = 0;
    for (own, &p) in join.parts.iter().enumerate() {
        let others = Bounds::of_others(&boxes, own);
        let is_near = |&&node: &&u32| {
            let x = mesh.positions[node as usize];
            others.iter().any(|bounds| bounds.contains(x))
        };
        let near: Vec<u32> = mesh.parts[p].nodes.iter().filter(is_near).copied().collect();
        for &node in &near {
            let x = mesh.positions[node as usize];
            // The cells that the ball around the node touches: one or two along each axis.
            let low = cell(x.map(|c| c - tolerance));
            let high = cell(x.map(|c| c + tolerance));
            for i in low[0]..=high[0] {
                for j in low[1]..=high[1] {
                    for k in low[2]..=high[2] {
                        let mut next = first.get(&[i, j, k]).copied().unwrap_or(END);
                        while next != END {
                            let (other, behind) = nodes[next as usize];
                            next = behind;
                            let near = norm(sub(mesh.positions[other as usize], x)) <= tolerance;
                            if near && part_of[other as usize] != part_of[node as usize] {
                                let (a, b) = (find(root, node), find(root, other));
                                root[a.max(b) as usize] = a.min(b);
                                merged += 1;
                            }
                        }
                    }
                }
            }
        }
        for &node in &near {
            let head = first.entry(cell(mesh.positions[node as usize])).or_insert(END);
            let behind = std::mem::replace(head, nodes.len() as u32);
            nodes.push((node, behind));
        }
    }
    merged
}

/// No node follows in its cell.
const END: u32 = u32::MAX;

/// Most parts of a join whose boxes are looked at one by one.
const MOST_BOXES: usize = 16;

/// The box around a part, wider by twice the tolerance of a join: no node outside of it is within the tolerance of one of the part.
#[derive(Clone, Copy)]
struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
}

impl Bounds {
    /// The boxes of all parts but one, or where they are many one around them.
    fn of_others(boxes: &[Self], own: usize) -> Vec<Self> {
        let others = boxes.iter().enumerate().filter(|(other, _)| *other != own).map(|(_, bounds)| *bounds);
        if boxes.len() <= MOST_BOXES {
            return others.collect();
        }
        let both = |a: Self, b: Self| Self {
            low: std::array::from_fn(|axis| a.low[axis].min(b.low[axis])),
            high: std::array::from_fn(|axis| a.high[axis].max(b.high[axis])),
        };
        others.reduce(both).into_iter().collect()
    }

    fn of(mesh: &Mesh, part: &Part, tolerance: f64) -> Self {
        let mut bounds = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
        for x in part.nodes.iter().map(|&node| mesh.positions[node as usize]) {
            for axis in 0..3 {
                bounds.low[axis] = bounds.low[axis].min(x[axis] - 2.0 * tolerance);
                bounds.high[axis] = bounds.high[axis].max(x[axis] + 2.0 * tolerance);
            }
        }
        bounds
    }

    fn contains(&self, x: [f64; 3]) -> bool {
        (0..3).all(|axis| self.low[axis] <= x[axis] && x[axis] <= self.high[axis])
    }
}

/// Reports parts of which a join merges two nodes of their own; true where there is one.
fn collapsed(mesh: &Mesh, root: &[u32], part_of: &[u32], joins: &[Join], log: &Log<'_>) -> bool {
    let mut last: HashMap<(u32, u32), u32> = HashMap::new();
    let mut reported = vec![false; mesh.parts.len()];
    let mut united = vec![false; root.len()];
    for (_, &root) in (0..).zip(root).filter(|(node, root)| node != *root) {
        united[root as usize] = true;
    }
    for node in (0..root.len()).filter(|&node| united[root[node] as usize]) {
        let part = part_of[node];
        if let Some(other) = last.insert((root[node], part), node as u32)
            && !std::mem::replace(&mut reported[part as usize], true)
        {
            let at =
                joins.iter().find(|j| j.parts.contains(&(part as usize))).map_or(Place::text(0), |j| j.at);
            log.fault(
                at,
                format!(
                    "a join that merges nodes {} and {} of the same part \"{}\"",
                    mesh.node_ids[other as usize], mesh.node_ids[node], mesh.parts[part as usize].name
                ),
                "at most one node of each part in one place",
                "lower the tolerance",
            );
        }
    }
    reported.contains(&true)
}
