//! From a problem and its workers to their assignments: at the start of a run, and of each epoch of it.

use std::sync::Arc;

use deck::model::Model;
use mechanics::{
    contact::Census, cycle::Plan, cycle::Subdomain, piece, rigid::switch, state::GlobalState, vote::Watched,
};
use protocol::message::{Assign, ToWorker};
use rayon::prelude::*;

use super::{
    Ending, Job,
    balancing::{Balancing, Meter, Shares},
    checkpoints::{Checkpoint, Checkpoints},
    cutting::{Block, Cutting},
    epoch::Epoch,
    error::Error,
    frames::Inflow,
    problem::{Problem, Touching},
    samples::Samples,
    tally::Tally,
    twice::Twice,
    verdict::Account,
    workers::Workers,
};
use crate::{
    balance::{Base, Costs, INTERACTIONS_PER_ELEMENT},
    decompose::{self, Cut, Fleet, Living, Traits, blocks, work},
    event::{Action, Deal, WorkerSpec},
    exchange::Exchange,
    node_owners::NodeOwners,
    options::SessionOptions,
    patches,
    snapshot::Snapshot,
    sort::{Gathered, SortBasis, Sorter, What},
    tree,
};

impl Job {
    /// Takes a problem to these workers: from its deck, or from a snapshot of it.
    ///
    /// # Errors
    /// If the problem cannot start: elements without volume, contact zones that overlap, no worker.
    pub fn new(
        model: Arc<Model>,
        specs: &[WorkerSpec],
        options: SessionOptions,
        resume: Option<Snapshot>,
    ) -> Result<(Self, Vec<Action>), Error> {
        if specs.is_empty() {
            return Err(Error::NoWorker);
        }
        let (problem, start) = Problem::new(model)?;
        let (first, rows) = match resume {
            None => (Checkpoint::first(&problem, start), Vec::new()),
            Some(snapshot) => Checkpoint::restored(snapshot, &problem, &start)?,
        };
        let keep = options.keep;
        let twice = Twice::new(options.asked.verify, &problem.sum);
        let mut job = Self {
            twice,
            epoch: Epoch::without_workers(0, &first, &problem.model),
            account: Account::new(&first, rows),
            first_cycle: first.cycle(),
            checkpoints: Checkpoints::new(first, keep),
            workers: Workers::new(specs),
            balancing: Balancing::default(),
            tally: Tally::new(),
            ending: Ending::default(),
            lean: false,
            problem,
            options,
        };
        let mut actions = Vec::new();
        job.switch_parts().map_err(Error::Problem)?;
        job.epoch = job.deal(0, (0..specs.len()).collect(), &mut actions)?;
        job.tally.sorts = u64::from(job.tally.census.units > 0);
        if let Some(seconds) = keep.seconds() {
            actions.push(Action::Timer(seconds));
        }
        Ok((job, actions))
    }

    /// Lets go of what of the model only the start of a run needs: velocities, rotation rates and constraints by node. Of a model that
    /// others have too, and where surfaces change, all stays.
    pub fn forget_start(&mut self) {
        let Problem { model, touching, .. } = &mut self.problem;
        let surfaces_change = touching.is_some() && model.setup.erosion.is_on();
        if let Some(model) = Arc::get_mut(model).filter(|_| !surfaces_change) {
            (model.velocity, model.spin, model.constraint) = (Vec::new(), Vec::new(), Vec::new());
        }
    }

    /// From now on no state is kept to go back to: for a set of workers of which nobody can be lost, as it shares this process.
    pub fn keep_no_state(&mut self) {
        self.lean = true;
        self.forget_state();
    }

    /// Drops what only going back would need of the checkpoint that has been dealt out.
    pub(super) fn forget_state(&mut self) {
        let statics = self.checkpoints.forget_state(self.problem.touching.is_some());
        self.epoch.sorts.forget_state(&statics);
    }

    /// Deals the newest checkpoint out to a set of workers, as epoch `number`.
    pub(super) fn deal(
        &mut self,
        number: u32,
        at_work: Vec<usize>,
        actions: &mut Vec<Action>,
    ) -> Result<Epoch, Error> {
        let checkpoint = Arc::clone(self.checkpoints.newest());
        if checkpoint.state.is_static() {
            return Err(Error::NotKept { cycle: checkpoint.cycle() });
        }
        let (problem, model) = (&self.problem, &self.problem.model);
        let mut epoch = Epoch::without_workers(number, &checkpoint, model);
        let n = at_work.len();
        if n == 0 {
            actions.push(Action::Dealt(Vec::new()));
            return Ok(epoch);
        }
        let state = &checkpoint.state;
        let specs: Vec<&WorkerSpec> = at_work.iter().map(|&index| self.workers.spec(index)).collect();
        let speeds = self.twice.speeds(&at_work);
        let speeds: Vec<f64> = speeds.unwrap_or_else(|| specs.iter().map(|spec| spec.speed).collect());
        let costs = self.options.costs();
        let alive = alive_in(state);
        let regions = decompose::regions(specs.iter().map(|spec| &*spec.region));
        let fleet = Fleet { speeds: &speeds, regions: &regions };
        let by_workers = problem.touching.as_ref().is_some_and(|touching| {
            let n_nodes = touching.surface.nodes.len() as f64;
            patches::are_sorted_by_workers(model, &self.options, &speeds, n_nodes)
        });
        let traits = Traits {
            by_node: by_workers,
            children: self.options.has_tree(n).then_some(self.options.tree.neighbours),
            ..Traits::of(&model.mesh, &model.setup, alive.as_deref())
        };
        let Cut { subdomains: layout, tree: mut trees, bases } =
            decompose::cut(&model.mesh, fleet, costs, traits);
        if model.output.workers {
            let owners: Arc<[u32]> = decompose::owners(&model.mesh, &layout).into();
            actions.push(Action::Owners(Arc::clone(&owners)));
            epoch.owners = Some(owners);
        }
        let threads: Vec<u32> = specs.iter().map(|spec| spec.threads).collect();
        let n_bodies = model.setup.bodies.len() + checkpoint.continuation.formed.len();
        let dealt = (layout.as_slice(), bases);
        let division = Division::new((model, n_bodies), dealt, &threads, problem.touching.as_ref());
        let elements = work(&layout, n, 0.0, &Living::new(&model.mesh, alive.as_deref()));
        if self.options.replay {
            epoch.samples = Samples::new(blocks::by_worker(&model.mesh, &layout, &threads));
        }
        let Division { by_worker, node_owners, gather } = division;
        let First { exchange, interactions, basis, census } =
            self.first_sort(&epoch, state, (fleet, costs), (node_owners, &gather));
        if let Some(children) = traits.children.filter(|_| trees.is_empty()) {
            let cycle = elements.iter().sum::<f64>() / speeds.iter().sum::<f64>();
            let neighbours = |plan: &Plan| plan.neighbours.iter().map(|other| other.worker).collect();
            let neighbours: Vec<Vec<u32>> = exchange.plans.iter().map(neighbours).collect();
            trees = tree::tree(&neighbours, fleet, (children, &[]), (cycle, costs));
        }
        epoch.root = trees.iter().position(|place| place.parent.is_none());
        let mut sortings = match (&basis, &model.setup.contact) {
            (Some(basis), Some(settings)) if by_workers => {
                let owners = decompose::owners(&model.mesh, &layout);
                let (surface, exclusions) = (basis.sorter.surface(), basis.sorter.exclusions());
                let who = (&owners[..], &gather[..], &*basis.node_owners);
                patches::cut(surface, (settings, exclusions), who, state)
            }
            _ => Vec::new(),
        };
        for (position, (dealt, mut assign)) in self.assignments(number, by_worker, &exchange).enumerate() {
            assign.tree = trees.get(position).cloned();
            assign.sorting = sortings.get_mut(position).map(|sorting| Box::new(std::mem::take(sorting)));
            let cuttings = Cutting::of(state, number, dealt);
            actions.extend(cuttings.map(|cutting| Action::Pieces(at_work[position], cutting)));
            actions.push(Action::Send(at_work[position], ToWorker::Assign(Box::new(assign))));
        }
        actions.push(Action::Dealt(
            specs
                .iter()
                .zip(&elements)
                .map(|(spec, &e)| Deal { name: spec.name.clone(), speed: spec.speed, elements: e as u64 })
                .collect(),
        ));
        self.tally.imbalance = imbalance(&elements, &interactions, &speeds);
        self.tally.census = census.unwrap_or(self.tally.census);
        epoch.sorts.begin(state.cycle, (basis, by_workers), exchange);
        epoch.inflow = Inflow::new(n, checkpoint.continuation.vote.clone());
        epoch.meter = Meter::new(n);
        epoch.at_work = at_work;
        let mut held = vec![0; n];
        layout.iter().for_each(|place| held[place.worker] += place.region.n_elements() as u64);
        epoch.shares = Shares { speeds, regions, elements, layout, held };
        Ok(epoch)
    }

    /// The exchange that an epoch begins with: where bodies may touch, that of a sort of the state.
    fn first_sort(
        &self,
        epoch: &Epoch,
        state: &Arc<GlobalState>,
        (fleet, costs): (Fleet<'_>, Costs),
        (node_owners, gather): (NodeOwners, &[Vec<u32>]),
    ) -> First {
        let model = &self.problem.model;
        let (Some(touching), Some(settings)) = (&self.problem.touching, &model.setup.contact) else {
            let n = fleet.speeds.len();
            let exchange = Exchange::new(&node_owners, vec![None; n], state, self.options.route());
            return First {
                exchange: Arc::new(exchange),
                interactions: vec![0; n],
                basis: None,
                census: None,
            };
        };
        let eroded = epoch.sorts.eroded();
        let surface = eroded.map(|eroded| eroded.surface(model, state.cycle));
        let dropped = eroded.map(|eroded| eroded.dropped(model, state.cycle)).unwrap_or_default();
        let sorter = Sorter::new(
            surface.unwrap_or_else(|| Arc::clone(&touching.surface)),
            settings.clone(),
            Arc::clone(&touching.exclusions),
            fleet,
            self.options.route(),
            self.options.dealing,
            costs,
            gather,
        );
        let x = Gathered { cycle: state.cycle, what: What::Positions(sorter.positions_of(state)) };
        let (node_owners, state) = (Arc::new(node_owners), Arc::clone(state));
        let whole = SortBasis { epoch: epoch.number, sorter, node_owners, state, dropped };
        let sorted = whole.sort(&x);
        First {
            exchange: Arc::new(sorted.exchange),
            interactions: sorted.interactions,
            census: Some(sorted.census),
            basis: Some(Arc::new(SortBasis { dropped: Vec::new(), ..whole })),
        }
    }

    /// By worker the blocks that it is dealt, and its assignment without them, without its place in the tree and its part of sorts.
    fn assignments<'a>(
        &'a self,
        epoch: u32,
        by_worker: Vec<Share>,
        exchange: &'a Exchange,
    ) -> impl Iterator<Item = (Vec<Block>, Assign)> + 'a {
        let (problem, checkpoint) = (&self.problem, self.checkpoints.newest());
        let (model, state) = (&problem.model, &checkpoint.state);
        let bodies = checkpoint.bodies(problem);
        let setup = switch::with_formed(&model.setup, &checkpoint.continuation.formed);
        let output = &model.output;
        let watched = Watched {
            elements: output.element_gauges.iter().map(|g| g.element).collect(),
            contacts: output.contact_forces.clone(),
            sections: output.sections.iter().map(|section| section.cut.clone()).collect(),
            row_cycles: output.history_cycles,
        };
        by_worker.into_iter().enumerate().map(move |(position, share)| {
            let Share { subdomains, n_pieces, blocks } = share;
            let assign = Assign {
                epoch,
                setup: setup.clone(),
                n_parts: model.mesh.parts.len() as u32,
                quanta: checkpoint.continuation.quanta[0],
                subdomains,
                n_pieces,
                gauges: output.gauges.iter().map(|g| g.node).collect(),
                watched: watched.clone(),
                lanes: self.options.asked.lanes.clone(),
                cycle: state.cycle,
                dt_previous: checkpoint.continuation.dt_previous,
                route: self.options.route(),
                plan: exchange.plans[position].clone(),
                plan_hash: exchange.hash,
                ghost_state: exchange.ghost_state_from(position, state),
                bodies: bodies.clone(),
                tree: None,
                sorting: None,
            };
            (blocks, assign)
        })
    }
}

/// What an epoch begins with.
struct First {
    exchange: Arc<Exchange>,
    /// Pairs that each worker looks at.
    interactions: Vec<u64>,
    /// What later sorts need, and what the first one counted; none where nothing can touch.
    basis: Option<Arc<SortBasis>>,
    census: Option<Census>,
}

/// Which elements are alive in a state; none where nothing can erode.
fn alive_in(state: &GlobalState) -> Option<Vec<bool>> {
    (!state.eroded.is_empty()).then(|| (0..state.eroded.len()).map(|e| !state.is_eroded(e)).collect())
}

/// What a worker is to hold.
#[derive(Default)]
struct Share {
    /// Without their pieces.
    subdomains: Vec<Subdomain>,
    n_pieces: Vec<u32>,
    blocks: Vec<Block>,
}

/// The sub-domains of a layout, and who holds what.
struct Division {
    by_worker: Vec<Share>,
    node_owners: NodeOwners,
    /// By worker: surface nodes that it owns, in the order of its gathering.
    gather: Vec<Vec<u32>>,
}

impl Division {
    fn new(
        (model, n_bodies): (&Model, usize),
        (layout, bases): (&[decompose::Subdomain], Vec<Base>),
        threads: &[u32],
        touching: Option<&Touching>,
    ) -> Self {
        let n = threads.len();
        let nodes_of: Vec<Vec<u32>> =
            layout.par_iter().map(|place| piece::nodes(&model.mesh, place.part, &place.region)).collect();
        let node_owners =
            NodeOwners::new(model.mesh.n_nodes(), bases, layout, &nodes_of).with_bodies(n_bodies);
        let mut gather: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut by_worker: Vec<Share> = (0..n).map(|_| Share::default()).collect();
        let regions = blocks::of_layout(&model.mesh, layout, threads);
        for (((id, place), nodes), regions) in (0..).zip(layout).zip(&nodes_of).zip(regions) {
            let is_unowned = |&node: &u32| node_owners.owner_subdomain[node as usize] != id;
            let unowned = nodes.iter().copied().filter(is_unowned).collect();
            let mut surface = Vec::new();
            if let Some(touching) = touching {
                let is_here = |node: &u32| nodes.binary_search(node).is_ok();
                surface.extend(touching.surface.nodes.iter().copied().filter(is_here));
                let owned = surface.iter().filter(|node| !is_unowned(node));
                gather[place.worker].extend(owned);
            }
            let held = &mut by_worker[place.worker];
            held.n_pieces.push(regions.len() as u32);
            let of_region = |region| Block { subdomain: id, part: place.part, region };
            held.blocks.extend(regions.into_iter().map(of_region));
            held.subdomains.push(Subdomain { id, pieces: Vec::new(), unowned, surface });
        }
        Self { by_worker, node_owners, gather }
    }
}

/// Largest over mean of cost over speed, workers without a speed aside.
fn imbalance(elements: &[f64], interactions: &[u64], speeds: &[f64]) -> f64 {
    let finish: Vec<f64> = elements
        .iter()
        .zip(interactions)
        .zip(speeds)
        .map(|((e, i), s)| (e + *i as f64 / INTERACTIONS_PER_ELEMENT) / s)
        .collect();
    let bound = finish.iter().zip(speeds).map(|(f, s)| f * s).sum::<f64>() / speeds.iter().sum::<f64>();
    if bound > 0.0 { finish.iter().copied().fold(0.0, f64::max) / bound } else { 1.0 }
}
