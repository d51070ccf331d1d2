//! Builds the exchange plan of each worker and adds partial forces on route master.
//!
//! A node that more than one worker holds (in a sub-domain, or as a guest of its work units) is in the exchange: its
//! holders' partial forces are added here and the total goes back to each of them.

use std::collections::HashMap;

use mechanics::{
    contact::Batch,
    cycle::{Guest, Neighbour, Plan},
    state::GlobalState,
};

use protocol::message::Route;

use crate::decompose::{self, Subdomain};

/// Which workers hold which nodes in their sub-domains, and who owns them. Fixed between two decompositions.
pub struct Holdings {
    n_workers: usize,
    /// Sub-domain that owns each node: the lowest that has it.
    pub owner_subdomain: Vec<u32>,
    /// Worker of that sub-domain.
    pub owner_worker: Vec<u32>,
    /// What each worker's sub-domains cost in a cycle ([`decompose::work`]).
    pub work: Vec<f64>,
    /// Other workers that hold a node, ascending; most nodes have none and no entry.
    others: HashMap<u32, Vec<u32>>,
    /// Nodes that several workers hold, each with one of them, ascending by node; its owner first.
    shared: Vec<(u32, u32)>,
    /// By worker: how many of those it holds.
    n_shared: Vec<usize>,
}

impl Holdings {
    /// From the nodes of each sub-domain (global indices).
    pub fn new(n_nodes: usize, n_workers: usize, subdomains: &[Subdomain], nodes: &[Vec<u32>]) -> Self {
        let mut owner_subdomain = vec![u32::MAX; n_nodes];
        let mut owner_worker = vec![u32::MAX; n_nodes];
        let mut others: HashMap<u32, Vec<u32>> = HashMap::new();
        for (id, (subdomain, nodes)) in subdomains.iter().zip(nodes).enumerate() {
            let worker = subdomain.worker as u32;
            for &node in nodes {
                let owner = &mut owner_subdomain[node as usize];
                if *owner == u32::MAX {
                    *owner = id as u32;
                    owner_worker[node as usize] = worker;
                } else if owner_worker[node as usize] != worker {
                    let list = others.entry(node).or_default();
                    if let Err(at) = list.binary_search(&worker) {
                        list.insert(at, worker);
                    }
                }
            }
        }
        let of_node = |(&node, others): (&u32, &Vec<u32>)| {
            let owner = owner_worker[node as usize];
            std::iter::once(owner).chain(others.clone()).map(move |worker| (node, worker))
        };
        let mut shared: Vec<(u32, u32)> = others.iter().flat_map(of_node).collect();
        shared.sort_by_key(|&(node, _)| node);
        let mut n_shared = vec![0; n_workers];
        shared.iter().for_each(|&(_, worker)| n_shared[worker as usize] += 1);
        let work = decompose::work(subdomains, n_workers);
        Self { n_workers, owner_subdomain, owner_worker, work, others, shared, n_shared }
    }

    /// Whether a sub-domain of the worker has the node.
    pub fn holds(&self, worker: u32, node: u32) -> bool {
        self.owner_worker[node as usize] == worker
            || self.others.get(&node).is_some_and(|list| list.binary_search(&worker).is_ok())
    }
}

/// Nodes that two neighbours share, first guess.
const ROOM: usize = 256;

/// The exchange of all workers from one plan boundary to the next.
#[derive(Clone)]
pub struct Exchange {
    /// By worker.
    pub plans: Vec<Plan>,
    /// Says which exchange this is; frames carry it.
    pub hash: u64,
    route: Route,
    /// Number of nodes in the exchange; 0 on route direct.
    n_slots: usize,
    /// By worker: the slot of each node of its exchange list; empty on route direct.
    slots: Vec<Vec<u32>>,
    /// By worker: where each guest's state comes from, (worker, position in its send list).
    sources: Vec<Vec<(u32, u32)>>,
}

impl Exchange {
    /// Plans for these batches (one per worker, none where there is no contact).
    pub fn new(holdings: &Holdings, batches: Vec<Option<Batch>>, state: &GlobalState, route: Route) -> Self {
        let n = holdings.n_workers;
        let mut plans: Vec<Plan> = (0..n).map(|_| Plan::default()).collect();
        // Nodes that only guests share: each guest's worker, and once the owner.
        let mut added: Vec<(u32, u32)> = Vec::new();
        for (worker, batch) in batches.iter().enumerate() {
            let Some(batch) = batch else { continue };
            let mut guests: Vec<u32> = batch
                .nodes
                .iter()
                .map(|node| node.global)
                .filter(|&g| !holdings.holds(worker as u32, g))
                .collect();
            guests.sort_unstable();
            for &node in &guests {
                let owner = holdings.owner_worker[node as usize];
                added.push((node, worker as u32));
                plans[owner as usize].send.push(node);
                plans[worker].guests.push(Guest {
                    node,
                    mass: state.mass[node as usize],
                    constraint: state.constraint[node as usize],
                });
            }
        }
        added.sort_by_key(|&(node, _)| node);
        for plan in &mut plans {
            plan.send.sort_unstable();
            plan.send.dedup();
        }
        for (plan, n_shared) in plans.iter_mut().zip(&holdings.n_shared) {
            plan.exchange.reserve(n_shared + plan.guests.len() + plan.send.len());
        }
        let mut slots = vec![Vec::new(); n];
        let mut neighbours: Vec<Vec<Neighbour>> = vec![Vec::new(); n];
        const NONE: u32 = u32::MAX;
        // By worker and other: its place among the worker's neighbours.
        let mut place = vec![NONE; if route == Route::Direct { n * n } else { 0 }];
        let mut n_slots = 0;
        let (mut held, mut added) = (holdings.shared.as_slice(), added.as_slice());
        let mut holders = Vec::new();
        while let Some(&(node, _)) = match (held.first(), added.first()) {
            (Some(one), Some(other)) if other.0 < one.0 => Some(other),
            (Some(one), _) => Some(one),
            (None, other) => other,
        } {
            holders.clear();
            take(&mut held, node, &mut holders);
            if holders.is_empty() {
                holders.push(holdings.owner_worker[node as usize]);
            }
            take(&mut added, node, &mut holders);
            for &worker in &holders {
                plans[worker as usize].exchange.push(node);
            }
            if route == Route::Master {
                holders.iter().for_each(|&worker| slots[worker as usize].push(n_slots));
                n_slots += 1;
            } else {
                for &worker in &holders {
                    let at = plans[worker as usize].exchange.len() as u32 - 1;
                    for &other in holders.iter().filter(|other| **other != worker) {
                        let of_worker = &mut neighbours[worker as usize];
                        let place = &mut place[worker as usize * n + other as usize];
                        if *place == NONE {
                            *place = of_worker.len() as u32;
                            of_worker.push(Neighbour { worker: other, shared: Vec::with_capacity(ROOM) });
                        }
                        of_worker[*place as usize].shared.push(at);
                    }
                }
            }
        }
        for (plan, mut neighbours) in plans.iter_mut().zip(neighbours) {
            neighbours.sort_unstable_by_key(|neighbour| neighbour.worker);
            plan.neighbours = neighbours;
        }
        let sources = plans
            .iter()
            .map(|plan| {
                plan.guests
                    .iter()
                    .map(|guest| {
                        let owner = holdings.owner_worker[guest.node as usize];
                        let at = plans[owner as usize].send.partition_point(|&n| n < guest.node);
                        (owner, at as u32)
                    })
                    .collect()
            })
            .collect();
        for (plan, batch) in plans.iter_mut().zip(batches) {
            plan.batch = batch;
        }
        let hash = hash(&plans);
        Self { plans, hash, route, n_slots: n_slots as usize, slots, sources }
    }

    /// Numbers in the partial forces that a worker sends to the master: none on route direct.
    pub fn n_partials(&self, worker: usize) -> usize {
        match self.route {
            Route::Master => 3 * self.slots[worker].len(),
            Route::Direct => 0,
        }
    }

    /// Numbers in the transfer of a worker.
    pub fn n_transfer(&self, worker: usize) -> usize {
        6 * self.plans[worker].send.len()
    }

    /// Zero totals; none on route direct.
    pub fn totals(&self) -> Vec<f64> {
        match self.route {
            Route::Master => vec![0.0; 3 * self.n_slots],
            Route::Direct => Vec::new(),
        }
    }

    /// Adds the partial forces of one worker; exact, so the order of workers does not matter.
    pub fn add(&self, worker: usize, partials: &[f64], totals: &mut [f64]) {
        for (&slot, partial) in self.slots[worker].iter().zip(partials.chunks_exact(3)) {
            for (total, term) in totals[3 * slot as usize..].iter_mut().zip(partial) {
                *total += term;
            }
        }
    }

    /// The totals of one worker's nodes.
    pub fn of_worker(&self, worker: usize, totals: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.n_partials(worker));
        if self.route == Route::Direct {
            return out;
        }
        for &slot in &self.slots[worker] {
            out.extend_from_slice(&totals[3 * slot as usize..3 * slot as usize + 3]);
        }
        out
    }

    /// State of a worker's guests out of what the owners sent.
    pub fn guest_state(&self, worker: usize, sent: &[Vec<f64>]) -> Vec<f64> {
        let mut out = Vec::with_capacity(6 * self.sources[worker].len());
        for &(owner, at) in &self.sources[worker] {
            out.extend_from_slice(&sent[owner as usize][6 * at as usize..6 * at as usize + 6]);
        }
        out
    }

    /// State of a worker's guests out of the global state.
    pub fn guest_state_from(&self, worker: usize, state: &GlobalState) -> Vec<f64> {
        let mut out = Vec::with_capacity(6 * self.plans[worker].guests.len());
        for guest in &self.plans[worker].guests {
            out.extend_from_slice(&state.x[guest.node as usize]);
            out.extend_from_slice(&state.v[guest.node as usize]);
        }
        out
    }
}

/// Takes the workers of a node off the front of pairs.
fn take(pairs: &mut &[(u32, u32)], node: u32, workers: &mut Vec<u32>) {
    while let Some((&(_, worker), rest)) = pairs.split_first().filter(|(pair, _)| pair.0 == node) {
        workers.push(worker);
        *pairs = rest;
    }
}

/// A 64-bit hash of the lists that the packed arrays follow: FNV-1a over words.
fn hash(plans: &[Plan]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat =
        |value: u32| hash = (hash ^ u64::from(value)).wrapping_mul(0x0100_0000_01b3).rotate_left(29);
    for plan in plans {
        eat(plan.exchange.len() as u32);
        plan.exchange.iter().copied().for_each(&mut eat);
        eat(plan.send.len() as u32);
        plan.send.iter().copied().for_each(&mut eat);
        eat(plan.guests.len() as u32);
        plan.guests.iter().for_each(|guest| eat(guest.node));
    }
    hash
}
