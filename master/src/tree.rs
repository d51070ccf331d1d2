//! The tree of an epoch's workers by which votes go up to the master and orders come down from it.
//!
//! Merging votes is exact in any order, so every tree gives the same bits. The master hears one worker, the *root*, so neither its
//! work nor a slow host that it runs on depends on the number of workers.
//!
//! What a worker and its neighbour send each other for the tree travels aboard their partial forces
//! ([`Aboard`](protocol::message::Aboard)) if one of them has no children, and costs no message. So some workers become *hubs*, which
//! have neighbours for children, and a tree of few levels joins the hubs. There each child costs its parent two messages in a cycle,
//! and each level the way of a message up and down, which the lag of orders hides as long as a cycle is longer.
//!
//! Each region has a tree of its own; their roots are joined by one more. So one message of a cycle goes up and one down between two regions.

use std::collections::VecDeque;

use protocol::message::Tree;

use crate::{balance::Costs, decompose::Fleet};

/// Most children of a hub of middle speed that are hubs.
const MOST_CHILDREN: usize = 8;
/// Children are in proportion to the speed, up to so many times those of a worker of middle speed.
const MOST_SPEED: f64 = 4.0;

/// By worker: its place in the tree. `neighbours` are those of each; a hub has at most so many (`most`) of them for children. The hubs of a tree
/// `before` are tried first. `cycle` is what a cycle takes, in elements of a worker of speed 1.
pub fn tree(
    neighbours: &[Vec<u32>],
    fleet: Fleet<'_>,
    (most, before): (usize, &[Tree]),
    (cycle, costs): (f64, Costs),
) -> Vec<Tree> {
    let speeds = fleet.speeds;
    let mut sorted = speeds.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[speeds.len() / 2];
    let relative: Vec<f64> = speeds.iter().map(|speed| (speed / middle).min(MOST_SPEED)).collect();
    let mut places = vec![Tree::default(); speeds.len()];
    let hubs = join_neighbours((neighbours, fleet), &relative, (most, before), &mut places);
    let children = most_children(hubs.len(), cycle, costs);
    let mut roots = Vec::new();
    for region in by_region(hubs, fleet) {
        roots.push(region[0]);
        join_hubs(region, &relative, children, &mut places);
    }
    join_hubs(roots, &relative, children, &mut places);
    let is_leaf: Vec<bool> = places.iter().map(|place| place.children.is_empty()).collect();
    places
        .iter_mut()
        .flat_map(|place| &mut place.children)
        .for_each(|(child, leaf)| *leaf = is_leaf[*child as usize]);
    places
}

/// By worker: messages of a cycle that its place in a tree costs, sent and received ones.
pub fn messages(places: &[Tree]) -> Vec<f64> {
    let is_hub = |place: &Tree| !place.children.is_empty();
    let of = |place: &Tree| {
        let hubs = place.children.iter().filter(|(child, _)| is_hub(&places[*child as usize])).count();
        if is_hub(place) { 2.0 * (hubs as f64 + 1.0) } else { 0.0 }
    };
    places.iter().map(of).collect()
}

/// Hubs of one region after another, the region with the fastest first, and in each region the fastest first.
fn by_region(hubs: Vec<usize>, fleet: Fleet<'_>) -> Vec<Vec<usize>> {
    let mut regions: Vec<Vec<usize>> = Vec::new();
    for hub in hubs {
        match regions.iter_mut().find(|region| fleet.are_near(region[0], hub)) {
            Some(region) => region.push(hub),
            None => regions.push(vec![hub]),
        }
    }
    regions
}

/// Makes some workers parents of neighbours in their region, until every worker has a parent or is one; gives those, the fastest first.
fn join_neighbours(
    (neighbours, fleet): (&[Vec<u32>], Fleet<'_>),
    relative: &[f64],
    (most, before): (usize, &[Tree]),
    places: &mut [Tree],
) -> Vec<usize> {
    let n = neighbours.len();
    let mut is_free = vec![true; n];
    let mut hubs: Vec<usize> = Vec::new();
    let room = |worker: usize| (most as f64 * relative[worker]) as usize;
    let neighbours = |worker: usize| {
        let neighbours = neighbours[worker].iter().map(|&other| other as usize);
        neighbours.filter(move |&other| fleet.are_near(worker, other))
    };
    let was_hub = |worker: usize| before.get(worker).is_some_and(|place| !place.children.is_empty());
    while is_free.contains(&true) {
        let free_neighbours =
            |worker: usize| neighbours(worker).filter(|&other| is_free[other]).take(room(worker));
        // A slow worker is made one where nobody else will do.
        let gain = |worker: usize| (1.0 + free_neighbours(worker).count() as f64) * relative[worker].min(1.0);
        let candidates = (0..n).filter(|&worker| is_free[worker]);
        // The master's own host often is the first, so of equals the last is taken.
        let order = |&a: &usize, &b: &usize| {
            let again = was_hub(a).cmp(&was_hub(b));
            again.then(gain(a).total_cmp(&gain(b))).then(relative[a].total_cmp(&relative[b]))
        };
        let Some(hub) = candidates.max_by(order) else { break };
        let children: Vec<usize> = free_neighbours(hub).collect();
        is_free[hub] = false;
        // The neighbours of the last ones belong to hubs, or are some.
        let near = neighbours(hub)
            .filter(|other| hubs.contains(other) && places[*other].children.len() < room(*other));
        if let (true, Some(parent)) =
            (children.is_empty(), near.min_by_key(|&other| places[other].children.len()))
        {
            places[hub].parent = Some(parent as u32);
            places[parent].children.push((hub as u32, false));
            continue;
        }
        for child in children {
            is_free[child] = false;
            places[child].parent = Some(hub as u32);
            places[hub].children.push((child as u32, false));
        }
        hubs.push(hub);
    }
    hubs.sort_by(|&a, &b| relative[b].total_cmp(&relative[a]));
    hubs
}

/// Joins workers level by level, each with at most so many children by its speed.
fn join_hubs(hubs: Vec<usize>, relative: &[f64], most: usize, places: &mut [Tree]) {
    let mut hubs = hubs.into_iter();
    let mut parents: VecDeque<usize> = hubs.next().into_iter().collect();
    while let Some(parent) = parents.pop_front() {
        let room = (most as f64 * relative[parent]).round() as usize;
        // The last that could have children has one at least.
        for _ in 0..room.max(usize::from(parents.is_empty())) {
            let Some(child) = hubs.next() else { return };
            places[child].parent = Some(parent as u32);
            places[parent].children.push((child as u32, false));
            parents.push_back(child);
        }
    }
}

/// The number of children that delays a cycle least.
fn most_children(n: usize, cycle: f64, costs: Costs) -> usize {
    let delay = |children: usize| {
        let (mut levels, mut hubs) = (0, 1);
        while hubs < n {
            (levels, hubs) = (levels + 1, children * hubs + 1);
        }
        let travels = 2.0 * f64::from(levels) * (costs.travel + (1.0 + children as f64) * costs.message);
        2.0 * children as f64 * costs.message + (travels - cycle).max(0.0)
    };
    (2..=MOST_CHILDREN).min_by(|&a, &b| delay(a).total_cmp(&delay(b))).unwrap_or(MOST_CHILDREN)
}

#[cfg(test)]
mod tests {
    use super::*;
    const COSTS: Costs = Costs { node: 0.09, pair: 1.2, message: 65.0, travel: 310.0, ..Costs::NONE };

    /// Workers in a row, each the neighbour of those within `reach`.
    fn row(n: usize, reach: usize) -> Vec<Vec<u32>> {
        let near = |worker: usize| {
            let near = (0..n).filter(|&other| other != worker && other.abs_diff(worker) <= reach);
            near.map(|other| other as u32).collect()
        };
        (0..n).map(near).collect()
    }

    /// Levels below the root; panics where a worker is missing, or parent and child disagree.
    fn depth(places: &[Tree]) -> usize {
        let mut level: Vec<usize> = (0..places.len()).filter(|&w| places[w].parent.is_none()).collect();
        assert_eq!(level.len(), 1, "one root");
        let (mut seen, mut depth) = (1, 0);
        loop {
            let mut next = Vec::new();
            for &parent in &level {
                for &(child, is_leaf) in &places[parent].children {
                    assert_eq!(places[child as usize].parent, Some(parent as u32));
                    assert_eq!(places[child as usize].children.is_empty(), is_leaf);
                    next.push(child as usize);
                }
            }
            if next.is_empty() {
                assert_eq!(seen, places.len());
                return depth;
            }
            (seen, depth, level) = (seen + next.len(), depth + 1, next);
        }
    }

    #[test]
    fn every_worker_is_in_the_tree_once_whatever_the_speeds() {
        for n in 1..70 {
            let speeds: Vec<f64> = (0..n).map(|w| [0.3, 7.0, 1.9, 0.77, 100.0][(w * w + n) % 5]).collect();
            for cycle in [0.0, 1e3, 1e6] {
                assert!(
                    depth(&tree(&row(n, 2), Fleet::near(&speeds), (12, &[]), (cycle, COSTS))) <= 8,
                    "{n} workers"
                );
            }
        }
        assert!(
            depth(&tree(&row(40, 0), Fleet::near(&[1.0; 40]), (12, &[]), (1e6, COSTS))) <= 6,
            "without neighbours"
        );
        assert!(depth(&tree(&row(1000, 3), Fleet::near(&[1.0; 1000]), (12, &[]), (1e4, COSTS))) <= 9);
    }

    #[test]
    fn between_regions_one_worker_of_each_talks_to_one_of_another() {
        let speeds: Vec<f64> = (0..60).map(|w| [1.0, 3.0, 0.5][w % 3]).collect();
        let regions: Vec<u32> = (0..60).map(|w| [2, 0, 1][w / 20]).collect();
        let fleet = Fleet { speeds: &speeds, regions: &regions };
        let places = tree(&row(60, 8), fleet, (12, &[]), (1e4, COSTS));
        assert!(depth(&places) <= 6);
        let parent = |worker: usize| places[worker].parent.map(|parent| parent as usize);
        let across = (0..60).filter(|&w| parent(w).is_some_and(|parent| regions[parent] != regions[w]));
        assert_eq!(across.count(), 2);
    }

    #[test]
    fn hubs_stay_where_they_were_and_their_messages_count() {
        let near = Fleet::near(&[1.0; 40]);
        let of = |reach: usize, before: &[Tree]| tree(&row(40, reach), near, (12, before), (1e6, COSTS));
        let hubs =
            |places: &[Tree]| (0..40).filter(|&w| !places[w].children.is_empty()).collect::<Vec<usize>>();
        let wide = of(6, &[]);
        assert_ne!(hubs(&of(5, &[])), hubs(&wide));
        let again = of(5, &wide);
        assert!(hubs(&wide).iter().all(|hub| hubs(&again).contains(hub)), "{:?}", hubs(&again));
        let messages = messages(&again);
        let edges = 2.0 * (hubs(&again).len() as f64 - 1.0);
        assert_eq!(
            messages.iter().sum::<f64>(),
            2.0 * edges + 2.0,
            "each edge of hubs twice, and the master"
        );
        assert!((0..40).all(|w| (messages[w] > 0.0) == hubs(&again).contains(&w)));
    }

    #[test]
    fn long_cycles_have_narrow_trees_and_short_ones_wide_ones() {
        assert_eq!(most_children(80, 1e6, COSTS), 2);
        assert!(most_children(1000, 1e3, COSTS) >= 4);
    }

    #[test]
    fn slow_workers_have_no_children_and_the_root_is_a_fast_one() {
        let speeds = [0.3, 7.0, 7.0, 7.0, 1.9, 1.9, 0.77, 0.77, 0.77];
        let places = tree(&row(9, 8), Fleet::near(&speeds), (12, &[]), (1e6, COSTS));
        assert!(places[0].children.is_empty());
        let root = places.iter().position(|place| place.parent.is_none());
        assert!(root.is_some_and(|root| speeds[root] == 7.0));
        assert!(depth(&places) <= 2);
    }

    #[test]
    fn nearly_all_workers_without_children_hang_on_a_neighbour_and_hubs_are_few() {
        let places = tree(&row(64, 4), Fleet::near(&[1.0; 64]), (12, &[]), (1e6, COSTS));
        let leaves = (0..64).filter(|&worker| places[worker].children.is_empty());
        let is_near =
            |&worker: &usize| places[worker].parent.is_some_and(|parent| parent.abs_diff(worker as u32) <= 4);
        assert!(leaves.clone().count() >= 54);
        let far: Vec<usize> = leaves.filter(|worker| !is_near(worker)).collect();
        assert!(far.len() <= 2, "{far:?}");
        let is_hub = |worker: u32| !places[worker as usize].children.is_empty();
        let hubs = |place: &Tree| place.children.iter().filter(|(child, _)| is_hub(*child)).count();
        assert!(places.iter().all(|place| hubs(place) <= 2));
    }
}
