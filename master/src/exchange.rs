//! Builds the exchange plan of each worker and adds partial forces on route master.
//!
//! A node that more than one worker holds (in a sub-domain, or as a guest of its work units) is in the exchange: its
//! holders' partial forces are added here and the total goes back to each of them.

use std::collections::{BTreeMap, HashMap};

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
        Self {
            n_workers,
            owner_subdomain,
            owner_worker,
            work: decompose::work(subdomains, n_workers),
            others,
        }
    }

    /// Whether a sub-domain of the worker has the node.
    pub fn holds(&self, worker: u32, node: u32) -> bool {
        self.owner_worker[node as usize] == worker
            || self.others.get(&node).is_some_and(|list| list.binary_search(&worker).is_ok())
    }
}

/// The exchange of all workers from one plan boundary to the next.
#[derive(Clone)]
pub struct Exchange {
    /// By worker.
    pub plans: Vec<Plan>,
    /// Says which exchange this is; frames carry it.
    pub hash: u64,
    route: Route,
    /// Numbers by node of the exchange: three of the force, and with shells three of the moment.
    stride: usize,
    /// Number of nodes in the exchange.
    n_slots: usize,
    /// By worker: the slot of each node of its exchange list.
    slots: Vec<Vec<u32>>,
    /// By worker: where each guest's state comes from, (worker, position in its send list).
    sources: Vec<Vec<(u32, u32)>>,
}

impl Exchange {
    /// Plans for these batches (one per worker, none where there is no contact).
    pub fn new(holdings: &Holdings, batches: Vec<Option<Batch>>, state: &GlobalState, route: Route) -> Self {
        let n = holdings.n_workers;
        let mut holders: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (&node, others) in &holdings.others {
            let list = holders.entry(node).or_default();
            list.push(holdings.owner_worker[node as usize]);
            list.extend(others);
        }
        let moments = !state.shells.spin.is_empty();
        let stride = if moments { 6 } else { 3 };
        let mut plans: Vec<Plan> = (0..n).map(|_| Plan { moments, ..Plan::default() }).collect();
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
                holders.entry(node).or_insert_with(|| vec![owner]).push(worker as u32);
                plans[owner as usize].send.push(node);
                plans[worker].guests.push(Guest {
                    node,
                    mass: state.mass[node as usize],
                    constraint: state.constraint[node as usize],
                });
            }
        }
        for plan in &mut plans {
            plan.send.sort_unstable();
            plan.send.dedup();
        }
        let mut slots = vec![Vec::new(); n];
        let mut shared: Vec<BTreeMap<u32, Vec<u32>>> = vec![BTreeMap::new(); n];
        for (slot, (&node, list)) in holders.iter().enumerate() {
            for &worker in list {
                slots[worker as usize].push(slot as u32);
                plans[worker as usize].exchange.push(node);
            }
            if route == Route::Direct {
                for &worker in list {
                    let at = plans[worker as usize].exchange.len() as u32 - 1;
                    for &other in list.iter().filter(|other| **other != worker) {
                        shared[worker as usize].entry(other).or_default().push(at);
                    }
                }
            }
        }
        for (plan, shared) in plans.iter_mut().zip(shared) {
            plan.neighbours =
                shared.into_iter().map(|(worker, shared)| Neighbour { worker, shared }).collect();
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
        Self { plans, hash, route, stride, n_slots: holders.len(), slots, sources }
    }

    /// Numbers in the partial forces that a worker sends to the master: none on route direct.
    pub fn n_partials(&self, worker: usize) -> usize {
        match self.route {
            Route::Master => self.stride * self.slots[worker].len(),
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
            Route::Master => vec![0.0; self.stride * self.n_slots],
            Route::Direct => Vec::new(),
        }
    }

    /// Adds the partial forces of one worker; exact, so the order of workers does not matter.
    pub fn add(&self, worker: usize, partials: &[f64], totals: &mut [f64]) {
        for (&slot, partial) in self.slots[worker].iter().zip(partials.chunks_exact(self.stride)) {
            for (total, term) in totals[self.stride * slot as usize..].iter_mut().zip(partial) {
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
            let first = self.stride * slot as usize;
            out.extend_from_slice(&totals[first..first + self.stride]);
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

/// A 64-bit FNV-1a hash of the lists that the packed arrays follow.
fn hash(plans: &[Plan]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |value: u32| {
        for byte in value.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
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
