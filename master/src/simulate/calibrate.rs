//! Costs of work from a cluster file and from what one host works on per cycle.

use std::sync::Arc;

use deck::model::Model;
use mechanics::contact::Surface;
use protocol::options::Route;

use super::{
    cluster::{Cluster, ElementCost},
    machines::{Costs, Machines, Scheme},
    virtual_clock,
};
use crate::{balance, patches};

/// Work of one cycle of a problem on one host: elements, nodes, pairs, pairs of new plans, surface nodes sorted.
pub type Work = [f64; 5];

/// What one host works on per cycle, by running the problem on one.
///
/// # Errors
/// Whatever keeps the run from its end.
pub fn work(model: &Arc<Model>, cluster: &Cluster) -> Result<Work, String> {
    let one = Machines {
        speeds: vec![1.0],
        believed: vec![1.0],
        costs: Costs { element: 1.0, node: 0.0, pair: 0.0, search: 0.0, sort: 0.0 },
        network: cluster.network.clone(),
        changes: Vec::new(),
        dealt_by: balance::Costs::NONE,
    };
    let (timeline, _) = virtual_clock::run(model, &one, Scheme::bolide(Route::Direct), None)?;
    Ok(timeline.work_per_cycle())
}

/// Costs such that one host takes `1 / k` of the cluster file's seconds per cycle for the two benchmarks; as they
/// stand where the file gives seconds.
pub fn costs(cluster: &Cluster, benchmarks: &[Work; 2], k: f64) -> Costs {
    let (element, pair) = match cluster.element {
        ElementCost::Seconds(element) => (element, element * cluster.pair),
        ElementCost::Calibrated([plain, contact]) => {
            let [[elements, nodes, ..], [elements_2, nodes_2, pairs, searched, sorted]] = benchmarks;
            let element = plain / k / (elements + cluster.node * nodes);
            let left = contact / k - element * (elements_2 + cluster.node * nodes_2);
            (element, left.max(0.0) / (pairs + cluster.search * searched + cluster.sort * sorted).max(1.0))
        }
    };
    Costs {
        element,
        node: element * cluster.node,
        pair,
        search: pair * cluster.search,
        sort: pair * cluster.sort,
    }
}

/// Seconds of a cycle's work on one host of speed 1, sorts included.
pub fn seconds(costs: &Costs, work: &Work) -> f64 {
    let [elements, nodes, pairs, searched, sorted] = work;
    costs.element * elements
        + costs.node * nodes
        + costs.pair * pairs
        + costs.search * searched
        + costs.sort * sorted
}

/// The speeds by which the master deals out work: its own host has less left beside sorts of `sorted` surface nodes
/// ([`balance::beside_sorts`], the same that the daemon does), unless the workers sort.
pub fn believed(
    model: &Model,
    (speeds, scheme): (&[f64], &Scheme),
    (costs, dealt_by): (&Costs, balance::Costs),
    work: &Work,
) -> Vec<f64> {
    let sorted = surface_nodes(model);
    if patches::are_sorted_by_workers(model, &scheme.options(dealt_by), speeds, sorted) {
        return speeds.to_vec();
    }
    let beside: Vec<bool> = (0..speeds.len()).map(|host| host == 0).collect();
    let lag = model.setup.control.sort_lag;
    balance::beside_sorts(speeds, &beside, seconds(costs, work), costs.sort * sorted, lag)
}

/// Surface nodes that a sort of the problem works on.
pub fn surface_nodes(model: &Model) -> f64 {
    match model.setup.contact {
        Some(_) => Surface::new(&model.mesh, &model.setup.materials, &|_| true).nodes.len() as f64,
        None => 0.0,
    }
}
