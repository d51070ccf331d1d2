//! Which workers hold which nodes in their sub-domains, and who owns them. Fixed between two decompositions.

use mechanics::{
    cycle::{Standing, standing::share},
    rigid,
};

use crate::{balance::Base, decompose::Subdomain};

/// Which workers hold which nodes in their sub-domains, and who owns them. Fixed between two decompositions.
pub struct NodeOwners {
    /// Sub-domain that owns each node: the lowest that has it.
    pub owner_subdomain: Vec<u32>,
    /// Worker of that sub-domain.
    pub owner_worker: Vec<u32>,
    /// What each worker does beside contact ([`crate::decompose::Cut`]).
    pub bases: Vec<Base>,
    /// Nodes that several workers hold, ascending, and behind them the entries of rigid bodies.
    shared: Vec<u32>,
    /// By such node: where the workers beside its owner begin in `others`, and behind the last where they end.
    firsts: Vec<u32>,
    /// Those workers, ascending by node.
    others: Vec<u32>,
    /// By node, a bit: whether several workers hold it. Most nodes have one holder, and are not looked for then.
    several: Vec<u64>,
    /// By worker: what of the exchange stays the same in all plans.
    pub standing: Vec<Standing>,
    /// By worker: the place of each of those nodes among the nodes that several workers hold.
    pub slots: Vec<Vec<u32>>,
}

impl NodeOwners {
    /// From the nodes of each sub-domain (global indices); `bases` is what each worker does beside contact.
    pub fn new(n_nodes: usize, bases: Vec<Base>, subdomains: &[Subdomain], nodes: &[Vec<u32>]) -> Self {
        let mut owner_subdomain = vec![u32::MAX; n_nodes];
        let mut owner_worker = vec![u32::MAX; n_nodes];
        // Nodes, each with a worker that holds it beside its owner.
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for (id, (subdomain, nodes)) in subdomains.iter().zip(nodes).enumerate() {
            let worker = subdomain.worker as u32;
            for &node in nodes {
                let owner = &mut owner_subdomain[node as usize];
                if *owner == u32::MAX {
                    *owner = id as u32;
                    owner_worker[node as usize] = worker;
                } else if owner_worker[node as usize] != worker {
                    pairs.push((node, worker));
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let (mut shared, mut firsts) = (Vec::new(), Vec::new());
        let mut several = vec![0; n_nodes.div_ceil(64)];
        for (first, &(node, _)) in (0..).zip(&pairs) {
            if shared.last() != Some(&node) {
                shared.push(node);
                firsts.push(first);
                several[node as usize / 64] |= 1 << (node % 64);
            }
        }
        firsts.push(pairs.len() as u32);
        let others = pairs.into_iter().map(|(_, worker)| worker).collect();
        let mut node_owners = Self {
            owner_subdomain,
            owner_worker,
            standing: Vec::new(),
            slots: Vec::new(),
            bases,
            shared,
            firsts,
            others,
            several,
        };
        node_owners.stand();
        node_owners
    }

    /// The same with the pushes on `n` rigid bodies in the exchange of every worker, where there are several.
    #[must_use]
    pub fn with_bodies(mut self, n: usize) -> Self {
        let n_workers = self.n_workers() as u32;
        if n_workers < 2 {
            return self;
        }
        for entry in rigid::entries(n) {
            let slot = self.shared.len() as u32;
            self.shared.push(entry);
            for (worker, (stand, slots)) in (0..).zip(self.standing.iter_mut().zip(&mut self.slots)) {
                let at = stand.nodes.len() as u32;
                stand.nodes.push(entry);
                slots.push(slot);
                for other in (0..n_workers).filter(|&other| other != worker) {
                    share(&mut stand.neighbours, other, at);
                }
            }
        }
        for stand in &mut self.standing {
            stand.neighbours.sort_unstable_by_key(|neighbour| neighbour.worker);
        }
        self
    }

    fn stand(&mut self) {
        let mut standing = vec![Standing::default(); self.bases.len()];
        let mut slots = vec![Vec::new(); self.bases.len()];
        for (slot, &node) in self.shared.iter().enumerate() {
            for worker in self.holders(node) {
                let stand = &mut standing[worker as usize];
                let at = stand.nodes.len() as u32;
                stand.nodes.push(node);
                slots[worker as usize].push(slot as u32);
                for other in self.holders(node).filter(|&other| other != worker) {
                    share(&mut stand.neighbours, other, at);
                }
            }
        }
        for stand in &mut standing {
            stand.neighbours.sort_unstable_by_key(|neighbour| neighbour.worker);
        }
        (self.standing, self.slots) = (standing, slots);
    }

    pub fn n_workers(&self) -> usize {
        self.bases.len()
    }

    /// Number of nodes that several workers hold, and of entries of rigid bodies.
    pub fn n_shared(&self) -> usize {
        self.shared.len()
    }

    /// Place of a node among those that several workers hold.
    pub fn slot(&self, node: u32) -> Option<u32> {
        self.shared.binary_search(&node).ok().map(|slot| slot as u32)
    }

    /// Workers beside its owner whose sub-domains have the node, ascending.
    pub fn others(&self, node: u32) -> &[u32] {
        if self.several[node as usize / 64] >> (node % 64) & 1 == 0 {
            return &[];
        }
        let at = self.shared.partition_point(|&other| other < node);
        &self.others[self.firsts[at] as usize..self.firsts[at + 1] as usize]
    }

    /// Workers whose sub-domains have the node, its owner first.
    pub fn holders(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        std::iter::once(self.owner_worker[node as usize]).chain(self.others(node).iter().copied())
    }

    /// Whether a sub-domain of the worker has the node.
    pub fn holds(&self, worker: u32, node: u32) -> bool {
        self.holders(node).any(|holder| holder == worker)
    }
}
