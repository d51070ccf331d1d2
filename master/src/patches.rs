//! Where workers sort what they hold of the surface: the patch of each, and whose patches are near.

use std::collections::BTreeSet;

use deck::model::Model;
use mechanics::{
    contact::{Exclusions, PartBox, Patch, Settings, Surface, patch},
    state::GlobalState,
};
use protocol::{
    message::{Around, Sorting},
    options::SortBy,
};

use crate::{
    balance::{Dealing, SORT_ELEMENTS},
    node_owners::NodeOwners,
    options::SessionOptions,
};

/// Bytes of a gathered position.
const POSITION_BYTES: f64 = 24.0;

/// Whether workers of these speeds sort what they hold of a surface of `n_nodes`: where the master would not be done within the lag of a
/// sort. Workers find pairs of nodes and faces alone, on a surface that does not change, and votes travel by a tree.
pub fn are_sorted_by_workers(model: &Model, options: &SessionOptions, speeds: &[f64], n_nodes: f64) -> bool {
    let Some(settings) = &model.setup.contact else { return false };
    let others = settings.edges || settings.erodes || !settings.ties.is_empty();
    let alone = !others && settings.particles.is_empty() && options.dealing == Dealing::Owners;
    let by_master = {
        let cycle = model.mesh.n_elements() as f64 / speeds.iter().sum::<f64>();
        let node = POSITION_BYTES.mul_add(options.costs().byte, SORT_ELEMENTS);
        n_nodes * node <= (f64::from(model.setup.control.sort_lag) - 0.5) * cycle
    };
    let chosen = match options.asked.sort_by {
        SortBy::Master => false,
        SortBy::Workers => true,
        SortBy::Auto => !by_master,
    };
    alone && chosen && options.has_tree(speeds.len())
}

/// What each worker needs to sort the nodes that it owns. `owners` gives the worker of every element, `gather` by worker the global
/// surface nodes that it owns, and `state` has positions, masses and constraints.
pub fn cut(
    surface: &Surface,
    (settings, exclusions): (&Settings, &Exclusions),
    (owners, gather, node_owners): (&[u32], &[Vec<u32>], &NodeOwners),
    state: &GlobalState,
) -> Vec<Sorting> {
    let mass = |node: u32| state.mass[node as usize];
    let n = gather.len();
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); n];
    for (f, face) in (0..).zip(&surface.faces) {
        faces[owners[face.element as usize] as usize].push(f);
    }
    let mut sorts_node = vec![u32::MAX; surface.nodes.len()];
    let mut of_worker: Vec<Vec<u32>> = vec![Vec::new(); n];
    for (worker, nodes) in gather.iter().enumerate() {
        for node in nodes.iter().filter_map(|&node| surface.node_index(node)) {
            sorts_node[node as usize] = worker as u32;
            of_worker[worker].push(node);
        }
    }
    let mut excluded: Vec<Vec<(u32, u32)>> = vec![Vec::new(); n];
    for (node, face) in exclusions.on(surface) {
        let worker = sorts_node[node as usize] as usize;
        excluded[worker].push((surface.nodes[node as usize], face));
    }
    let mut boxes = Vec::with_capacity(n);
    let mut sortings: Vec<Sorting> = (0..n)
        .map(|worker| {
            let patch = Patch::of(surface, &of_worker[worker], &faces[worker], &mass);
            let index = |global: u32| surface.node_index(global).unwrap_or_default() as usize;
            let at: Vec<[f64; 3]> = patch.nodes.iter().map(|node| state.x[node.global as usize]).collect();
            let is_sorted = |global: u32| sorts_node[index(global)] == worker as u32;
            let sorted = (0..).zip(&patch.nodes).filter(|(_, node)| is_sorted(node.global));
            let sorted = sorted.map(|(at, _)| at).collect();
            boxes.push(patch.boxes(&at));
            let mut excluded = std::mem::take(&mut excluded[worker]);
            excluded.sort_unstable();
            let constrained =
                patch.nodes.iter().map(|node| (node.global, state.constraint[node.global as usize]));
            let constraints = constrained.filter(|(_, constraint)| *constraint != 0).collect();
            let standing = node_owners.standing[worker].clone();
            let is_surface = |&at: &u32| surface.node_index(standing.nodes[at as usize]).is_some();
            let beside = standing.neighbours.iter().filter(|other| other.shared.iter().any(is_surface));
            let beside = beside.map(|other| other.worker).collect();
            Sorting { patch, sorted, excluded, standing, beside, constraints, around: Vec::new() }
        })
        .collect();
    for (sorting, around) in sortings.iter_mut().zip(around(&boxes, settings)) {
        sorting.around = around;
    }
    sortings
}

/// By worker: the others whose patches may have come near when positions are gathered next. `boxes` are those of each worker's patch.
pub fn around(boxes: &[Vec<PartBox>], settings: &Settings) -> Vec<Vec<Around>> {
    let distance = patch::margin(settings);
    // Along the longest axis a box meets only those that begin before it ends.
    let mut all: Vec<(u32, &PartBox)> =
        (0..).zip(boxes).flat_map(|(worker, boxes)| boxes.iter().map(move |of| (worker, of))).collect();
    let length = |a: usize| {
        let low = all.iter().map(|(_, of)| of.low[a]).fold(f64::INFINITY, f64::min);
        all.iter().map(|(_, of)| of.high[a]).fold(f64::NEG_INFINITY, f64::max) - low
    };
    let axis = [1, 2].into_iter().fold(0, |best, a| if length(a) > length(best) { a } else { best });
    all.sort_by(|(_, a), (_, b)| a.low[axis].total_cmp(&b.low[axis]));
    let mut near: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); boxes.len()];
    for (i, (worker, of)) in all.iter().enumerate() {
        for (other, theirs) in &all[i + 1..] {
            if theirs.low[axis] - distance > of.high[axis] {
                break;
            }
            let meets = settings.permits(of.part, theirs.part) || settings.permits(theirs.part, of.part);
            if worker != other && meets && of.is_near(theirs, distance) {
                near[*worker as usize].insert(*other);
                near[*other as usize].insert(*worker);
            }
        }
    }
    let around = |&worker: &u32| Around { worker, boxes: boxes[worker as usize].clone() };
    near.into_iter().map(|workers| workers.iter().map(around).collect()).collect()
}

/// Whether a worker's boxes can be such: ascending, of parts that there are, with corners that are numbers.
pub fn are_sound(boxes: &[PartBox], n_parts: usize) -> bool {
    boxes.is_sorted_by(|a, b| a.part < b.part)
        && boxes.iter().all(|of| (of.part as usize) < n_parts)
        && boxes.iter().flat_map(|of| of.low.iter().chain(&of.high)).all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workers_around_are_those_whose_boxes_of_parts_that_meet_are_near() {
        let settings = Settings {
            gap: 0.1,
            slack: 0.1,
            interacts: vec![false, true, true, false],
            ..Settings::default()
        };
        let at = |part, x: f64, y: f64| PartBox { part, low: [x, y, 0.0], high: [x + 1.0, y + 1.0, 1.0] };
        let boxes = [
            vec![at(0, 0.0, 0.0), at(1, 10.0, 0.0)],
            vec![at(1, 1.3, 0.0)],
            vec![at(0, 1.2, 0.0)],
            vec![at(1, -1.5, 0.0)],
            Vec::new(),
        ];
        let found: Vec<Vec<u32>> = around(&boxes, &settings)
            .into_iter()
            .map(|around| around.into_iter().map(|of| of.worker).collect())
            .collect();
        // 0.2 + 0.1 + 0.1 apart at most; workers 0 and 2 have the same part near each other.
        assert_eq!(found, [vec![1], vec![0, 2], vec![1], vec![], vec![]]);
        assert!((patch::margin(&settings) - 0.4).abs() < 1e-6);
    }
}
