//! From a problem and its workers to their assignments: at the start of a run, and of each epoch of it.

use std::sync::Arc;

use deck::model::Model;
use mechanics::{
    cycle::Plan,
    cycle::Subdomain,
    exact::Quanta,
    mesh::Mesh,
    piece::{self, Region},
    rigid::switch,
    state::GlobalState,
    vote::Watched,
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
    balance::{Base, INTERACTIONS_PER_ELEMENT},
    decompose::{self, Cut, Fleet, Living, Traits, work},
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
        let dropped =
            epoch.sorts.eroded().map(|eroded| eroded.dropped(model, state.cycle)).unwrap_or_default();
        if self.options.replay {
            epoch.samples = Samples::new(blocks_of(&model.mesh, &layout, &threads));
        }
        let mut basis = None;
        let (exchange, interactions) = match (&problem.touching, &model.setup.contact) {
            (Some(touching), Some(settings)) => {
                let surface = epoch.sorts.eroded().map(|eroded| eroded.surface(model, state.cycle));
                let sorter = Sorter::new(
                    surface.unwrap_or_else(|| Arc::clone(&touching.surface)),
                    settings.clone(),
                    Arc::clone(&touching.exclusions),
                    fleet,
                    self.options.route(),
                    self.options.dealing,
                    costs,
                    &division.gather,
                );
                let what = What::Positions(sorter.positions_of(state));
                let x = Gathered { cycle: state.cycle, what };
                let whole = SortBasis {
                    epoch: number,
                    sorter,
                    node_owners: Arc::new(division.node_owners),
                    state: Arc::clone(state),
                    dropped,
                };
                let sorted = whole.sort(&x);
                basis = Some(Arc::new(SortBasis { dropped: Vec::new(), ..whole }));
                self.tally.census = sorted.census;
                (sorted.exchange, sorted.interactions)
            }
            _ => {
                (Exchange::new(&division.node_owners, vec![None; n], state, self.options.route()), vec![0; n])
            }
        };
        self.tally.imbalance = imbalance(&elements, &interactions, &speeds);
        let exchange = Arc::new(exchange);
        let bodies = checkpoint.bodies(problem);
        let setup = switch::with_formed(&model.setup, &checkpoint.continuation.formed);
        let gauges: Vec<u32> = model.output.gauges.iter().map(|g| g.node).collect();
        let watched = Watched {
            elements: model.output.element_gauges.iter().map(|g| g.element).collect(),
            contacts: model.output.contact_forces.clone(),
            sections: model.output.sections.iter().map(|section| section.cut.clone()).collect(),
            row_cycles: model.output.history_cycles,
        };
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
                let who = (&owners[..], &division.gather[..], &*basis.node_owners);
                patches::cut(surface, (settings, exclusions), who, state)
            }
            _ => Vec::new(),
        };
        for (position, share) in division.by_worker.into_iter().enumerate() {
            let Share { subdomains, n_pieces, blocks } = share;
            let cuttings = Cutting::of(state, number, blocks);
            actions.extend(cuttings.map(|cutting| Action::Pieces(at_work[position], cutting)));
            let assign = Assign {
                epoch: number,
                setup: setup.clone(),
                n_parts: model.mesh.parts.len() as u32,
                quanta: Quanta { force: checkpoint.continuation.quanta[0], ..problem.quanta },
                subdomains,
                n_pieces,
                gauges: gauges.clone(),
                watched: watched.clone(),
                lanes: self.options.asked.lanes.clone(),
                cycle: state.cycle,
                dt_previous: checkpoint.continuation.dt_previous,
                route: self.options.route(),
                plan: exchange.plans[position].clone(),
                plan_hash: exchange.hash,
                ghost_state: exchange.ghost_state_from(position, state),
                bodies: bodies.clone(),
                tree: trees.get(position).cloned(),
                sorting: sortings.get_mut(position).map(|sorting| Box::new(std::mem::take(sorting))),
            };
            actions.push(Action::Send(at_work[position], ToWorker::Assign(Box::new(assign))));
        }
        actions.push(Action::Dealt(
            specs
                .iter()
                .zip(&elements)
                .map(|(spec, &e)| Deal { name: spec.name.clone(), speed: spec.speed, elements: e as u64 })
                .collect(),
        ));
        epoch.sorts.begin(state.cycle, (basis, by_workers), exchange);
        epoch.inflow = Inflow::new(n, checkpoint.continuation.vote.clone());
        epoch.meter = Meter::new(n);
        epoch.at_work = at_work;
        let mut held = vec![0; n];
        layout.iter().for_each(|place| held[place.worker] += place.region.n_elements() as u64);
        epoch.shares = Shares { speeds, regions, elements, layout, held };
        Ok(epoch)
    }
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
        let regions = blocks(&model.mesh, layout, threads);
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

/// Blocks for each thread of a worker that has several: whoever is free takes the next, so that unequal blocks and unequal cores
/// come out even.
const BLOCKS: usize = 4;

/// Elements of a block below which its nodes, which other blocks have too, cost more than an even share gains.
const ELEMENTS: usize = 2000;

/// Elements that a block has at most, but for one that rounding gives it: pieces travel by blocks.
const MOST: usize = 250_000;

/// The blocks of each sub-domain: of a worker with several threads at least one for each, in proportion to the elements, and of each
/// form of elements one of its own.
fn blocks(mesh: &Mesh, layout: &[decompose::Subdomain], threads: &[u32]) -> Vec<Vec<Region>> {
    let mut elements = vec![0; threads.len()];
    layout.iter().for_each(|subdomain| elements[subdomain.worker] += subdomain.region.n_elements());
    let of_subdomain = |subdomain: &decompose::Subdomain| {
        let (all, threads) = (elements[subdomain.worker].max(1), threads[subdomain.worker].max(1) as usize);
        let n = if threads > 1 { (all / ELEMENTS).clamp(threads, BLOCKS * threads) } else { 1 };
        let n = n.max(all.div_ceil(MOST));
        let regions = subdomain.region.split((n * subdomain.region.n_elements()).div_ceil(all).max(1));
        regions.into_iter().flat_map(|region| region.by_form(&mesh.parts[subdomain.part])).collect()
    };
    layout.iter().map(of_subdomain).collect()
}

/// By worker: part and elements of each of its blocks, in the worker's order.
fn blocks_of(mesh: &Mesh, layout: &[decompose::Subdomain], threads: &[u32]) -> Vec<Vec<(usize, Region)>> {
    let mut by_worker = vec![Vec::new(); threads.len()];
    for (subdomain, regions) in layout.iter().zip(blocks(mesh, layout, threads)) {
        by_worker[subdomain.worker].extend(regions.into_iter().map(|region| (subdomain.part, region)));
    }
    by_worker
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
