//! Sort: from gathered positions, or from what workers have sorted, to the next plan. Pure computation, run beside the cycles.
//!
//! The sort itself is mechanics'; here its units are dealt to workers and become batches and an exchange.

use std::sync::Arc;

use mechanics::{
    contact::{self, Batch, Census, Exclusions, Surface},
    state::GlobalState,
};

use protocol::{
    message::{Around, SortedPatch},
    options::Route,
};
use tracing::trace;

use crate::{
    balance::{self, Costs, Dealing},
    decompose::Fleet,
    exchange::Exchange,
    node_owners::NodeOwners,
    patches,
};

/// All that a sort needs and that stays the same between two decompositions.
pub struct Sorter {
    surface: Arc<Surface>,
    settings: contact::Settings,
    exclusions: Arc<Exclusions>,
    speeds: Vec<f64>,
    /// Region of each worker, by number.
    regions: Vec<u32>,
    route: Route,
    dealing: Dealing,
    /// What a pair costs, in element-cycles.
    costs: Costs,
    /// By worker: surface node index of each gathered position.
    gather: Vec<Vec<u32>>,
}

/// What a sort works on.
pub struct Gathered {
    /// The cycle at whose start positions are.
    pub cycle: u64,
    pub what: What,
}

/// What comes of a gathering.
pub enum What {
    /// Positions by surface node (length).
    Positions(Vec<[f64; 3]>),
    /// What workers made of their patches, by worker.
    Patches(Vec<SortedPatch>),
}

impl Gathered {
    /// Number of surface nodes that the master sorts, or of boxes of workers' patches.
    pub fn n_nodes(&self) -> usize {
        match &self.what {
            What::Positions(x) => x.len(),
            What::Patches(patches) => patches.iter().map(|patch| patch.boxes.len()).sum(),
        }
    }
}

/// What came of a sort.
#[derive(Clone)]
pub struct Sorted {
    /// The epoch that it was done for.
    pub epoch: u32,
    /// The cycle of its positions: sorts that are done at the same time end in any order.
    pub gathered: u64,
    /// The next plan of every worker.
    pub exchange: Exchange,
    /// The census of the work units.
    pub census: Census,
    /// Interactions by worker.
    pub interactions: Vec<u64>,
    /// By worker, where workers sort themselves: whose patches are near.
    pub around: Vec<Vec<Around>>,
}

impl Sorter {
    /// `gather` lists, by worker, the global surface nodes whose positions it sends, in its order.
    #[expect(clippy::too_many_arguments, reason = "what a sort needs, once by epoch")]
    pub fn new(
        surface: Arc<Surface>,
        settings: contact::Settings,
        exclusions: Arc<Exclusions>,
        Fleet { speeds, regions }: Fleet<'_>,
        route: Route,
        dealing: Dealing,
        costs: Costs,
        gather: &[Vec<u32>],
    ) -> Self {
        let gather = gather
            .iter()
            .map(|nodes| nodes.iter().filter_map(|&node| surface.node_index(node)).collect())
            .collect();
        let (speeds, regions) = (speeds.to_vec(), regions.to_vec());
        Self { surface, settings, exclusions, speeds, regions, route, dealing, costs, gather }
    }

    /// The same for another surface with the same nodes.
    pub fn with_surface(&self, surface: Arc<Surface>) -> Self {
        Self {
            surface,
            settings: self.settings.clone(),
            exclusions: Arc::clone(&self.exclusions),
            speeds: self.speeds.clone(),
            regions: self.regions.clone(),
            route: self.route,
            dealing: self.dealing,
            costs: self.costs,
            gather: self.gather.clone(),
        }
    }

    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    pub fn exclusions(&self) -> &Exclusions {
        &self.exclusions
    }

    /// Number of parts of the problem.
    pub fn n_parts(&self) -> usize {
        self.settings.n_parts()
    }

    /// Numbers that a worker's gathering has.
    pub fn n_gathered(&self, worker: usize) -> usize {
        3 * self.gather[worker].len()
    }

    /// Positions by surface node from what each worker gathered.
    pub fn positions(&self, gathered: &[Vec<f64>]) -> Vec<[f64; 3]> {
        let mut x = vec![[0.0; 3]; self.surface.nodes.len()];
        for (slots, values) in self.gather.iter().zip(gathered) {
            for (&slot, position) in slots.iter().zip(values.chunks_exact(3)) {
                x[slot as usize].copy_from_slice(position);
            }
        }
        x
    }

    /// Positions by surface node from the global state.
    pub fn positions_of(&self, state: &GlobalState) -> Vec<[f64; 3]> {
        self.surface.nodes.iter().map(|&node| state.x[node as usize]).collect()
    }

    /// Sorts, balances, plans. `x` by surface node; of `state` only masses and constraints are read.
    pub fn run(&self, epoch: u32, of: &Gathered, node_owners: &NodeOwners, state: &GlobalState) -> Sorted {
        let x = match &of.what {
            What::Positions(x) => x,
            What::Patches(patches) => return self.plan(epoch, of.cycle, patches, state),
        };
        let mut units = contact::sort(&self.surface, x, &self.settings, &self.exclusions);
        let census = Census::of(&units);
        let owner = |node: u32| node_owners.owner_worker[self.surface.nodes[node as usize] as usize] as usize;
        let worker_of = match self.dealing {
            Dealing::Owners => {
                let weights = contact::cull(&mut units, &self.surface, x, &self.settings, &self.exclusions);
                let nodes = |unit: &contact::WorkUnit| balance::nodes_of(unit, &self.surface);
                let fleet = Fleet { speeds: &self.speeds, regions: &self.regions };
                balance::assign(&units, (&weights, self.costs), fleet, &node_owners.bases, (&owner, &nodes))
            }
            Dealing::Weights => balance::assign_by_weight(&units, &self.speeds),
        };
        let n = self.speeds.len();
        let mut mine: Vec<Vec<&contact::WorkUnit>> = vec![Vec::new(); n];
        let mut interactions = vec![0; n];
        for (unit, &worker) in units.iter().zip(&worker_of).filter(|(unit, _)| !unit.is_empty()) {
            mine[worker].push(unit);
            interactions[worker] += unit.interactions;
        }
        let mass = |node: u32| state.mass[node as usize];
        let batches = mine
            .iter()
            .map(|units| {
                (!units.is_empty()).then(|| Batch::gather(&self.surface, units, &mass, &self.exclusions))
            })
            .collect();
        let exchange = Exchange::new(node_owners, batches, state, self.route);
        Sorted { epoch, gathered: of.cycle, exchange, census, interactions, around: Vec::new() }
    }

    /// What the master adds to plans that workers have made: who is around whom from now on.
    fn plan(&self, epoch: u32, gathered: u64, patches: &[SortedPatch], state: &GlobalState) -> Sorted {
        let mut census = Census::default();
        patches.iter().for_each(|patch| census.merge(&patch.census));
        let boxes: Vec<_> = patches.iter().map(|patch| patch.boxes.clone()).collect();
        Sorted {
            epoch,
            gathered,
            exchange: Exchange::of_workers(patches.len(), gathered, state),
            census,
            interactions: patches.iter().map(|patch| patch.census.interactions).collect(),
            around: patches::around(&boxes, &self.settings),
        }
    }
}

/// What sorts work on: fixed for an epoch, but for the surface where elements erode.
pub struct SortBasis {
    /// Number of the epoch.
    pub epoch: u32,
    /// Surface, settings, speeds.
    pub sorter: Sorter,
    /// Who holds which nodes.
    pub node_owners: Arc<NodeOwners>,
    /// Masses and constraints (positions are those of the epoch's start).
    pub state: Arc<GlobalState>,
    /// Nodes (global, ascending) that leave the run with the plan of the sort.
    pub dropped: Vec<u32>,
}

impl SortBasis {
    /// Does the sort that `Action::Sort` of a job asks for.
    pub fn sort(&self, x: &Gathered) -> Sorted {
        trace!(epoch = self.epoch, "sort begins");
        let mut sorted = self.sorter.run(self.epoch, x, &self.node_owners, &self.state);
        if !self.dropped.is_empty() {
            for (worker, plan) in (0..).zip(&mut sorted.exchange.plans) {
                plan.dropped = self
                    .dropped
                    .iter()
                    .copied()
                    .filter(|&node| self.node_owners.holds(worker, node))
                    .collect();
            }
        }
        sorted
    }

    /// The same with another surface.
    pub fn with_surface(&self, surface: Arc<Surface>, dropped: Vec<u32>) -> Self {
        Self {
            epoch: self.epoch,
            sorter: self.sorter.with_surface(surface),
            node_owners: Arc::clone(&self.node_owners),
            state: Arc::clone(&self.state),
            dropped,
        }
    }
}
