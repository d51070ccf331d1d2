//! Builds the exchange plan of each worker and adds partial forces on route master.
//!
//! A node that more than one worker holds (in a sub-domain, or as a ghost of its work units) is in the exchange: its
//! holders' partial forces are added here and the total goes back to each of them. What sub-domains share stays from
//! plan to plan ([`NodeOwners`]); a plan adds what its ghosts bring.

use mechanics::{
    contact::Batch,
    cycle::{Added, Ghost, Handed, Plan},
    state::GlobalState,
};

use protocol::options::Route;

use crate::node_owners::NodeOwners;

/// The exchange of all workers from one plan boundary to the next.
#[derive(Clone)]
pub struct Exchange {
    /// By worker.
    pub plans: Vec<Plan>,
    /// Says which exchange this is; frames carry it.
    pub hash: u64,
    route: Route,
    /// Numbers by node of the exchange: three of the force, with shells three of the moment, and what contact keeps of it.
    stride: usize,
    /// Numbers that contact keeps of each node: they are among those of the exchange, and behind those of ghosts.
    n_history: usize,
    /// Number of nodes in the exchange; 0 on route direct.
    n_slots: usize,
    /// By worker: the slot of each node of its exchange list; empty on route direct.
    slots: Vec<Vec<u32>>,
    /// By worker: where each ghost's state comes from, (worker, position in its send list).
    sources: Vec<Vec<(u32, u32)>>,
}

impl Exchange {
    /// Plans for these batches (one per worker, none where there is no contact).
    pub fn new(
        node_owners: &NodeOwners,
        batches: Vec<Option<Batch>>,
        state: &GlobalState,
        route: Route,
    ) -> Self {
        let global = |batch: &Batch| batch.nodes.iter().map(|node| node.global).collect();
        let ghosts = (0..).zip(&batches).map(|(worker, batch): (u32, &Option<Batch>)| {
            let mut nodes: Vec<u32> = batch.as_ref().map(global).unwrap_or_default();
            nodes.retain(|&node| !node_owners.holds(worker, node));
            nodes
        });
        let ghosts: Vec<Vec<u32>> = ghosts.collect();
        let mut exchange = Self::with_ghosts(node_owners, &ghosts, state, route);
        for (plan, batch) in exchange.plans.iter_mut().zip(batches) {
            plan.batch = batch;
        }
        exchange
    }

    /// Plans on route direct that workers complete among themselves after their sorts of a gathering, whose cycle stands for a hash.
    pub fn of_workers(n: usize, gathered: u64, state: &GlobalState) -> Self {
        Self {
            plans: vec![empty_plan(state); n],
            hash: gathered,
            route: Route::Direct,
            stride: empty_plan(state).stride(),
            n_history: state.contact.len(),
            n_slots: 0,
            slots: vec![Vec::new(); n],
            sources: vec![Vec::new(); n],
        }
    }

    /// Plans for these ghosts by worker, ascending nodes that it does not hold, without batches.
    fn with_ghosts(
        node_owners: &NodeOwners,
        ghosts_of: &[Vec<u32>],
        state: &GlobalState,
        route: Route,
    ) -> Self {
        let empty = empty_plan(state);
        let (stride, n_history) = (empty.stride(), state.contact.len());
        let mut plans: Vec<Plan> = vec![empty; node_owners.n_workers()];
        // Nodes, each with the workers that have it as a ghost: runs that ascend, which a stable sort merges.
        let mut ghosts: Vec<(u32, u32)> = Vec::with_capacity(ghosts_of.iter().map(Vec::len).sum());
        for (worker, nodes) in (0..).zip(ghosts_of) {
            ghosts.extend(nodes.iter().map(|&node| (node, worker)));
        }
        ghosts.sort();
        let mut added = vec![Added::default(); plans.len()];
        for (plan, nodes) in plans.iter_mut().zip(ghosts_of) {
            plan.ghosts.reserve(nodes.len());
        }
        let mut sources: Vec<Vec<(u32, u32)>> =
            ghosts_of.iter().map(|nodes| Vec::with_capacity(nodes.len())).collect();
        // On route master: added nodes and their slots.
        let mut new_slots: Vec<Vec<(u32, u32)>> = vec![Vec::new(); plans.len()];
        let mut n_slots = node_owners.n_shared() as u32;
        for ghosts in ghosts.chunk_by(|one, other| one.0 == other.0) {
            let node = ghosts[0].0;
            let owner = node_owners.owner_worker[node as usize];
            let others = node_owners.others(node);
            let send = &mut plans[owner as usize].send;
            let at = send.len() as u32;
            send.push(node);
            if others.is_empty() {
                added[owner as usize].nodes.push(node);
            }
            if route == Route::Master {
                let slot = node_owners.slot(node).unwrap_or(n_slots);
                if others.is_empty() {
                    new_slots[owner as usize].push((node, slot));
                    n_slots += 1;
                }
                ghosts.iter().for_each(|&(_, ghost)| new_slots[ghost as usize].push((node, slot)));
            }
            let (mass, constraint) = (state.mass[node as usize], state.constraint[node as usize]);
            for &(_, ghost) in ghosts {
                plans[ghost as usize].ghosts.push(Ghost { node, mass, constraint });
                sources[ghost as usize].push((owner, at));
                added[ghost as usize].nodes.push(node);
                for &holder in std::iter::once(&owner).chain(others) {
                    added[ghost as usize].with.push((node, holder));
                    added[holder as usize].with.push((node, ghost));
                }
                let others = ghosts.iter().filter(|&&(_, other)| other != ghost);
                added[ghost as usize].with.extend(others);
            }
        }
        let mut slots = vec![Vec::new(); plans.len()];
        for (worker, (plan, added)) in plans.iter_mut().zip(added).enumerate() {
            let standing = &node_owners.standing[worker];
            (plan.exchange, plan.neighbours) = standing.with(&added);
            if route == Route::Master {
                let stand = (&standing.nodes[..], &node_owners.slots[worker][..]);
                slots[worker] = slots_of(&plan.exchange, stand, &new_slots[worker]);
                plan.neighbours.clear();
            }
        }
        if route == Route::Direct {
            hand_over(&mut plans, &sources);
        }
        let hash = hash(&plans);
        Self { plans, hash, route, stride, n_history, n_slots: n_slots as usize, slots, sources }
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
        (6 + self.n_history) * self.plans[worker].send.len()
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

    /// State of a worker's ghosts out of what the owners sent.
    pub fn ghost_state(&self, worker: usize, sent: &[Vec<f64>]) -> Vec<f64> {
        let each = 6 + self.n_history;
        let mut out = Vec::with_capacity(each * self.sources[worker].len());
        for &(owner, at) in &self.sources[worker] {
            let first = each * at as usize;
            out.extend_from_slice(&sent[owner as usize][first..first + each]);
        }
        out
    }

    /// State of a worker's ghosts out of the global state.
    pub fn ghost_state_from(&self, worker: usize, state: &GlobalState) -> Vec<f64> {
        let mut out = Vec::with_capacity((6 + self.n_history) * self.plans[worker].ghosts.len());
        for ghost in &self.plans[worker].ghosts {
            out.extend_from_slice(&state.x[ghost.node as usize]);
            out.extend_from_slice(&state.v[ghost.node as usize]);
            out.extend(state.contact.iter().map(|number| number[ghost.node as usize]));
        }
        out
    }
}

/// A plan without nodes: it says what travels for each.
fn empty_plan(state: &GlobalState) -> Plan {
    let moments = !state.shells.inertia.is_empty();
    Plan { moments, n_history: state.contact.len() as u32, ..Plan::default() }
}

/// Says who gives whom the state of ghosts, from where each comes: worker and position in its send list.
fn hand_over(plans: &mut [Plan], sources: &[Vec<(u32, u32)>]) {
    /// Enters a place in the list of a worker, which is often the one that was found `before`.
    fn enter(list: &mut Vec<Handed>, before: &mut usize, worker: u32, place: u32) {
        if list.get(*before).is_none_or(|of| of.worker != worker) {
            *before = list.iter().position(|of| of.worker == worker).unwrap_or_else(|| {
                list.push(Handed { worker, places: Vec::new() });
                list.len() - 1
            });
        }
        list[*before].places.push(place);
    }
    let mut gives_before = vec![0; plans.len()];
    for (worker, sources) in (0..).zip(sources) {
        let mut takes_before = 0;
        for (ghost, &(owner, at)) in (0..).zip(sources) {
            enter(&mut plans[worker as usize].takes, &mut takes_before, owner, ghost);
            enter(&mut plans[owner as usize].gives, &mut gives_before[owner as usize], worker, at);
        }
    }
}

/// The slots of the nodes of an exchange: of those that stand, and of those that ghosts add.
fn slots_of(exchange: &[u32], (standing, slots): (&[u32], &[u32]), added: &[(u32, u32)]) -> Vec<u32> {
    let mut standing = standing.iter().zip(slots).peekable();
    let mut added = added.iter().peekable();
    let of_node = |node: &u32| {
        let stands = standing.next_if(|(stands, _)| *stands == node).map(|(_, slot)| *slot);
        stands.or_else(|| added.next_if(|(new, _)| new == node).map(|(_, slot)| *slot))
    };
    exchange.iter().filter_map(of_node).collect()
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
        eat(plan.ghosts.len() as u32);
        plan.ghosts.iter().for_each(|ghost| eat(ghost.node));
    }
    hash
}

#[cfg(test)]
mod tests {
    use mechanics::{contact::BatchNode, piece::Region};

    use super::*;
    use crate::{balance::Base, decompose::Subdomain};

    /// Small numbers without end.
    fn random(seed: u64) -> impl FnMut(u32) -> u32 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move |n| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u32 % n
        }
    }

    #[test]
    fn every_two_holders_of_a_node_list_it_at_equal_places_and_nobody_else_does() {
        const NODES: u32 = 60;
        for seed in 0..40 {
            let mut random = random(seed);
            let n = 2 + random(5) as usize;
            let mut nodes: Vec<Vec<u32>> = vec![Vec::new(); n];
            let mut ghosts = nodes.clone();
            for node in 0..NODES {
                nodes[random(n as u32) as usize].push(node);
                for worker in 0..n {
                    if random(4) == 0 && !nodes[worker].contains(&node) {
                        nodes[worker].push(node);
                    } else if random(5) == 0 {
                        ghosts[worker].push(node);
                    }
                }
            }
            let subdomains: Vec<Subdomain> = (0..n)
                .map(|worker| Subdomain { part: 0, region: Region::List(Vec::new()), worker })
                .collect();
            let node_owners = NodeOwners::new(NODES as usize, vec![Base::of(1.0); n], &subdomains, &nodes);
            let batch = |nodes: &Vec<u32>| {
                let node = |&global| BatchNode { global, part: 0, mass: 1.0, stiffness: 1.0, share: 1.0 };
                Some(Batch { nodes: nodes.iter().map(node).collect(), ..Batch::default() })
            };
            let mut state = GlobalState {
                mass: vec![1.0; NODES as usize],
                constraint: vec![0; NODES as usize],
                ..GlobalState::default()
            };
            // With shells a node has six numbers: here the same three twice.
            let twice = 1 + seed as usize % 2;
            if twice == 2 {
                state.shells.inertia = vec![1.0; NODES as usize];
            }
            let holds =
                |worker: usize, node: u32| nodes[worker].contains(&node) || ghosts[worker].contains(&node);
            let batches: Vec<_> = ghosts.iter().map(batch).collect();
            let direct = Exchange::new(&node_owners, batches.clone(), &state, Route::Direct);
            let master = Exchange::new(&node_owners, batches, &state, Route::Master);
            for worker in 0..n {
                let plan = &direct.plans[worker];
                let wanted: Vec<u32> = (0..NODES)
                    .filter(|&node| {
                        holds(worker, node) && (0..n).any(|other| other != worker && holds(other, node))
                    })
                    .collect();
                assert_eq!(plan.exchange, wanted, "seed {seed}, worker {worker}");
                assert_eq!(master.plans[worker].exchange, wanted);
                for other in (0..n).filter(|&other| other != worker) {
                    let both: Vec<u32> =
                        (0..NODES).filter(|&node| holds(worker, node) && holds(other, node)).collect();
                    let listed = plan.neighbours.iter().find(|neighbour| neighbour.worker == other as u32);
                    let listed: Vec<u32> = listed
                        .iter()
                        .flat_map(|neighbour| &neighbour.shared)
                        .map(|&at| plan.exchange[at as usize])
                        .collect();
                    assert_eq!(listed, both, "seed {seed}, {worker} with {other}");
                }
            }
            // Every holder adds its number; the total comes to all.
            let mut totals = master.totals();
            for worker in 0..n {
                let partials: Vec<f64> = master.plans[worker]
                    .exchange
                    .iter()
                    .flat_map(|&node| [f64::from(node), 1.0, worker as f64].repeat(twice))
                    .collect();
                assert_eq!(partials.len(), master.n_partials(worker));
                master.add(worker, &partials, &mut totals);
            }
            for worker in 0..n {
                let sums = master.of_worker(worker, &totals);
                for (&node, sum) in master.plans[worker].exchange.iter().zip(sums.chunks_exact(3 * twice)) {
                    let holders: Vec<usize> = (0..n).filter(|&w| holds(w, node)).collect();
                    let count = holders.len() as f64;
                    assert_eq!(sum[..2], [count * f64::from(node), count], "seed {seed}, node {node}");
                    assert_eq!(sum[2], holders.iter().sum::<usize>() as f64);
                    assert_eq!(sum[3 * (twice - 1)..], sum[..3]);
                }
            }
        }
    }
}
