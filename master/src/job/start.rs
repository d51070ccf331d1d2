//! From a problem and its workers to their assignments: at the start of a run, and of each epoch of it.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use mechanics::{
    block::Piece,
    contact::{Census, Exclusions, Surface, initial_edges, initial_pairs},
    cycle::Subdomain,
    initial,
    mesh::Mesh,
    piece::{self, Region},
    state::GlobalState,
    vote::{Quanta, Watched},
    wall,
};
use protocol::{
    message::{Assign, ToWorker, Work},
    phase::Report,
};

use super::{
    Bench, Job,
    epoch::{Acting, Base, Epoch, Member, Rest, Step},
    erosion::{self, Eroded},
    measure::{Meter, Patience},
};
use crate::{
    balance::INTERACTIONS_PER_ELEMENT,
    decompose::{self, Living, decompose, work},
    event::{Action, Deal, Hand},
    exchange::Exchange,
    holdings::Holdings,
    ledger::Ledger,
    options::SessionOptions,
    snapshot::Snapshot,
    sort::{Gathered, Sorter},
};

/// What of the contact stays the same in all epochs.
pub(super) struct Touching {
    surface: Arc<Surface>,
    exclusions: Arc<Exclusions>,
}

impl Touching {
    /// Surface and exclusions.
    pub(super) fn parts(&self) -> (Arc<Surface>, Arc<Exclusions>) {
        (Arc::clone(&self.surface), Arc::clone(&self.exclusions))
    }
}

impl Job {
    /// Takes a problem to these workers: from its deck, or from a snapshot of it.
    ///
    /// # Errors
    /// If the problem cannot start: elements without volume, contact zones that overlap, no worker.
    pub fn new(
        model: Arc<Model>,
        hands: &[Hand],
        options: SessionOptions,
        resume: Option<Snapshot>,
    ) -> Result<(Self, Vec<Action>), String> {
        if hands.is_empty() {
            return Err("no worker: start one with `bolide worker --master HOST`".to_owned());
        }
        let mut setup = model.setup.clone();
        let mut constraint = model.constraint.clone();
        initial::bind_walls(&model.mesh, &mut setup, &mut constraint)?;
        let mut start = initial::state(&model.mesh, &setup, &model.velocity, &constraint)?;
        initial::spin(&mut start, &setup.constraints, &model.spin);
        let quanta = initial::quanta(&model.mesh, &setup, &start);
        let (base, rows) = match resume {
            None => {
                let ledger = Ledger::new(&model, &start.mass);
                let rest = Rest {
                    dt_previous: 0.0,
                    dt: None,
                    quanta: [quanta.force; 2],
                    vote: None,
                    walls: wall::first_poses(&setup.walls),
                    ledger,
                    n_rows: 0,
                    spread_rate: 0.0,
                };
                (Base { state: Arc::new(start), rest }, Vec::new())
            }
            Some(snapshot) => {
                if shape(&snapshot.state) != shape(&start)
                    || snapshot.state.initial_volume != start.initial_volume
                    || snapshot.walls.len() != wall::first_poses(&setup.walls).len()
                    || snapshot.vote.bodies.len() != setup.bodies.len()
                {
                    return Err(
                        "the snapshot is of another problem: its mesh, its walls or its rigid bodies are not this deck's"
                            .to_owned(),
                    );
                }
                let rest = Rest {
                    dt_previous: snapshot.dt_previous,
                    dt: Some(snapshot.dt),
                    quanta: snapshot.force_quanta,
                    vote: Some(snapshot.vote),
                    walls: snapshot.walls,
                    ledger: snapshot.ledger,
                    n_rows: snapshot.rows.len(),
                    spread_rate: snapshot.spread_rate,
                };
                (Base { state: snapshot.state, rest }, snapshot.rows)
            }
        };
        let mut model = model;
        if setup != model.setup {
            let mut with_walls = (*model).clone();
            with_walls.setup = setup;
            model = Arc::new(with_walls);
        }
        let touching = model.setup.contact.as_ref().map(|settings| {
            let surface = erosion::surface(&model, &|_| true);
            let at_start: Vec<[f64; 3]> =
                surface.nodes.iter().map(|&node| model.mesh.positions[node as usize]).collect();
            let inside = initial_pairs(&surface, &at_start, settings);
            let exclusions = if settings.ignores_initial {
                Exclusions::around(&surface, &inside)
            } else {
                refuse_overlap(&model.mesh, &surface, &inside, settings.gap)?;
                Exclusions::new(&surface, &inside)
            };
            let crossing =
                if settings.edges { initial_edges(&surface, &at_start, settings) } else { Vec::new() };
            if !settings.ignores_initial {
                refuse_crossing(&model.mesh, &surface, &crossing, settings.gap)?;
            }
            let exclusions = Arc::new(exclusions.with_edges(&surface, &crossing));
            Ok::<_, String>(Touching { surface, exclusions })
        });
        let first_cycle = base.state.cycle;
        let keep = options.keep;
        let mut job = Self {
            quanta,
            touching: touching.transpose()?,
            members: hands
                .iter()
                .map(|hand| Member { hand: hand.clone(), alive: true, leaves: false })
                .collect(),
            epoch: Epoch::without_workers(0, &base, &model),
            ledger: base.rest.ledger.clone(),
            walls: base.rest.walls.clone(),
            base: Arc::new(base),
            keep_due: false,
            lean: false,
            first_cycle,
            lanes: String::new(),
            stop_asked: false,
            leaves: false,
            blamed: Vec::new(),
            failure: None,
            proposal: None,
            patience: Patience::default(),
            rows,
            sorts: 0,
            census: Census::default(),
            work: vec![Work::default(); hands.len()],
            reports: vec![Report::default(); hands.len()],
            imbalance: 1.0,
            rebalances: Vec::new(),
            losses: Vec::new(),
            over: false,
            unfenced: false,
            model,
            options,
        };
        let mut actions = Vec::new();
        job.epoch = job.deal(0, (0..hands.len()).collect(), &mut actions)?;
        job.sorts = u64::from(job.census.units > 0);
        if let Some(seconds) = keep.seconds() {
            actions.push(Action::Timer(seconds));
        }
        Ok((job, actions))
    }

    /// From now on no state is kept to go back to: for a crew of which nobody can be lost, as it shares this process.
    pub fn keep_no_state(&mut self) {
        self.lean = true;
        self.forget_base();
    }

    /// Drops what only going back would need of the base that has been dealt out.
    pub(super) fn forget_base(&mut self) {
        let state = Arc::new(self.base.state.statics());
        if let Some(bench) = self.epoch.bench.as_mut().and_then(Arc::get_mut) {
            bench.state = Arc::clone(&state);
        }
        self.base = Arc::new(Base { state, rest: self.base.rest.clone() });
    }

    /// Deals the base out to a crew, as epoch `number`.
    pub(super) fn deal(
        &mut self,
        number: u32,
        crew: Vec<usize>,
        actions: &mut Vec<Action>,
    ) -> Result<Epoch, String> {
        let base = Arc::clone(&self.base);
        if base.state.is_static() {
            return Err(format!("no state of cycle {} is kept to go back to", base.state.cycle));
        }
        let mut epoch = Epoch::without_workers(number, &base, &self.model);
        let n = crew.len();
        if n == 0 {
            actions.push(Action::Dealt(Vec::new()));
            return Ok(epoch);
        }
        let (model, state) = (&self.model, &base.state);
        let hands: Vec<&Hand> = crew.iter().map(|&member| &self.members[member].hand).collect();
        let speeds: Vec<f64> = hands.iter().map(|hand| hand.speed).collect();
        let costs = self.options.costs;
        let alive = self.alive_at_base();
        let layout = decompose(&model.mesh, &speeds, costs.node, alive.as_deref());
        if model.output.workers {
            let owners: Arc<[u32]> = decompose::owners(&model.mesh, &layout).into();
            actions.push(Action::Owners(Arc::clone(&owners)));
            epoch.owners = Some(owners);
        }
        let threads: Vec<u32> = hands.iter().map(|hand| hand.threads).collect();
        let held = work(&layout, n, costs.node, &Living::new(&model.mesh, alive.as_deref()));
        let cut = Cut::new(model, state, (&layout, held), &threads, self.touching.as_ref());
        let elements = work(&layout, n, 0.0, &Living::new(&model.mesh, alive.as_deref()));
        let dropped =
            epoch.eroded.as_ref().map(|eroded| eroded.dropped(model, state.cycle)).unwrap_or_default();
        if self.options.replay {
            epoch.blocks = blocks_of(&layout, &threads);
        }
        let (exchange, interactions) = match (&self.touching, &model.setup.contact) {
            (Some(touching), Some(settings)) => {
                let surface = epoch.eroded.as_ref().map(|eroded| eroded.surface(model, state.cycle));
                let sorter = Sorter::new(
                    surface.unwrap_or_else(|| Arc::clone(&touching.surface)),
                    settings.clone(),
                    Arc::clone(&touching.exclusions),
                    speeds.clone(),
                    self.options.route(),
                    self.options.dealing,
                    costs.pair,
                    &cut.gather,
                );
                let x = Gathered { cycle: state.cycle, x: sorter.positions_of(state) };
                let bench = Bench {
                    epoch: number,
                    sorter,
                    holdings: Arc::new(cut.holdings),
                    state: Arc::clone(state),
                    dropped,
                };
                let sorted = bench.sort(&x);
                epoch.bench = Some(Arc::new(Bench { dropped: Vec::new(), ..bench }));
                self.census = sorted.census;
                (sorted.exchange, sorted.interactions)
            }
            _ => (Exchange::new(&cut.holdings, vec![None; n], state, self.options.route()), vec![0; n]),
        };
        self.imbalance = imbalance(&elements, &interactions, &speeds);
        let exchange = Arc::new(exchange);
        let bodies = match &base.rest.vote {
            Some(vote) => vote.bodies.clone(),
            None => model.setup.bodies.iter().map(|body| body.start).collect(),
        };
        let gauges: Vec<u32> = model.output.gauges.iter().map(|g| g.node).collect();
        let watched = Watched {
            elements: model.output.element_gauges.iter().map(|g| g.element).collect(),
            contacts: model.output.contact_forces.clone(),
        };
        for (position, subdomains) in cut.by_worker.into_iter().enumerate() {
            let assign = Assign {
                epoch: number,
                setup: model.setup.clone(),
                n_parts: model.mesh.parts.len() as u32,
                quanta: Quanta { force: base.rest.quanta[0], ..self.quanta },
                subdomains,
                gauges: gauges.clone(),
                watched: watched.clone(),
                lanes: self.options.asked.lanes.clone(),
                cycle: state.cycle,
                dt_previous: base.rest.dt_previous,
                route: self.options.route(),
                plan: exchange.plans[position].clone(),
                plan_hash: exchange.hash,
                guest_state: exchange.guest_state_from(position, state),
                bodies: bodies.clone(),
            };
            actions.push(Action::Send(crew[position], ToWorker::Assign(Box::new(assign))));
        }
        actions.push(Action::Dealt(
            hands
                .iter()
                .zip(&elements)
                .map(|(hand, &e)| Deal { name: hand.name.clone(), speed: hand.speed, elements: e as u64 })
                .collect(),
        ));
        epoch.exchanges = VecDeque::from([Acting { at: state.cycle, gathered: state.cycle, exchange }]);
        epoch.ready = vec![false; n];
        epoch.meter = Meter::new(n);
        epoch.crew = crew;
        epoch.speeds = speeds;
        epoch.elements = elements;
        epoch.layout = layout;
        Ok(epoch)
    }

    /// Which elements are alive at the start of the next epoch; none where nothing can erode.
    fn alive_at_base(&self) -> Option<Vec<bool>> {
        let state = &self.base.state;
        (!state.eroded.is_empty()).then(|| (0..state.eroded.len()).map(|e| !state.is_eroded(e)).collect())
    }
}

impl Epoch {
    /// An epoch of a base before its crew is there.
    fn without_workers(number: u32, base: &Base, model: &Model) -> Self {
        let Base { state, rest } = base;
        let (first, time) = (state.cycle, state.time);
        let mut steps = BTreeMap::new();
        if let Some(dt) = rest.dt {
            let [now, _] = rest.quanta;
            if let Some(before) = first.checked_sub(1) {
                let dt = rest.dt_previous;
                steps.insert(before, Step { dt, time: time - dt, quantum: now });
            }
            steps.insert(first, Step { dt, time, quantum: now });
        }
        Self {
            number,
            crew: Vec::new(),
            speeds: Vec::new(),
            elements: Vec::new(),
            owners: None,
            bench: None,
            ready: Vec::new(),
            running: false,
            first_cycle: first,
            quantum: rest.quanta[1],
            steps,
            vote_before: rest.vote.clone(),
            arrivals: BTreeMap::new(),
            exchanges: VecDeque::new(),
            completed: first,
            sorts_under_way: VecDeque::new(),
            eroded: Eroded::new(state),
            layout: Vec::new(),
            transfers: BTreeMap::new(),
            collecting: BTreeMap::new(),
            image_times: BTreeMap::new(),
            blocks: Vec::new(),
            samples: BTreeMap::new(),
            halves: BTreeMap::new(),
            last_base: first,
            next_state_time: model.output.period.map(|period| output_after(time, period)),
            last_gather: first,
            references: [(first, first); 2],
            last_spread: 0.0,
            spread_rate: rest.spread_rate,
            stop_at: None,
            stop_sampled: false,
            stopped: None,
            pauses: false,
            meter: Meter::new(0),
        }
    }
}

/// The first multiple of `period` after `time`, to the bit: at whatever time it is asked between two of them, it is the
/// same one.
pub(super) fn output_after(time: f64, period: f64) -> f64 {
    let mut count = (time / period).floor();
    while count * period > time {
        count -= 1.0;
    }
    while count * period <= time {
        count += 1.0;
    }
    count * period
}

/// The sub-domains of a layout, and who holds what.
struct Cut {
    by_worker: Vec<Vec<Subdomain>>,
    holdings: Holdings,
    /// By worker: surface nodes that it owns, in the order of its gathering.
    gather: Vec<Vec<u32>>,
}

impl Cut {
    fn new(
        model: &Model,
        state: &GlobalState,
        (layout, work): (&[decompose::Subdomain], Vec<f64>),
        threads: &[u32],
        touching: Option<&Touching>,
    ) -> Self {
        let n = threads.len();
        let mut subdomains: Vec<Subdomain> = Vec::with_capacity(layout.len());
        let mut nodes_of: Vec<Vec<u32>> = Vec::with_capacity(layout.len());
        for (id, subdomain) in layout.iter().enumerate() {
            let pieces: Vec<Piece> = blocks(subdomain, threads)
                .iter()
                .map(|region| piece::cut(&model.mesh, state, subdomain.part, region))
                .collect();
            let mut nodes: Vec<u32> = pieces.iter().flat_map(|p| p.nodes.iter().copied()).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes_of.push(nodes);
            subdomains.push(Subdomain { id: id as u32, pieces, unowned: Vec::new(), surface: Vec::new() });
        }
        let holdings = Holdings::new(model.mesh.n_nodes(), work, layout, &nodes_of)
            .with_bodies(model.setup.bodies.len());
        let mut gather: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut by_worker: Vec<Vec<Subdomain>> = vec![Vec::new(); n];
        for (mut subdomain, (place, nodes)) in subdomains.into_iter().zip(layout.iter().zip(&nodes_of)) {
            let id = subdomain.id;
            subdomain.unowned =
                nodes.iter().copied().filter(|&node| holdings.owner_subdomain[node as usize] != id).collect();
            if let Some(Touching { surface, .. }) = touching {
                subdomain.surface =
                    nodes.iter().copied().filter(|&node| surface.node_index(node).is_some()).collect();
                gather[place.worker].extend(
                    subdomain.surface.iter().filter(|&&node| holdings.owner_subdomain[node as usize] == id),
                );
            }
            by_worker[place.worker].push(subdomain);
        }
        Self { by_worker, holdings, gather }
    }
}

/// How long the arrays of a state are: what its mesh and its laws ask for.
fn shape(state: &GlobalState) -> (Vec<usize>, Vec<usize>) {
    let GlobalState { x, v, mass, constraint, initial_volume, elements, eroded, strain, shells, .. } = state;
    let fixed =
        [x.len(), v.len(), mass.len(), constraint.len(), initial_volume.len(), eroded.len(), strain.len()];
    let of_shells =
        [shells.spin.len(), shells.inertia.len()].into_iter().chain(shells.fields.iter().map(Vec::len));
    (fixed.into_iter().chain(elements.iter().map(Vec::len)).collect(), of_shells.collect())
}

/// The blocks of a sub-domain, one for each thread of its worker.
fn blocks(subdomain: &decompose::Subdomain, threads: &[u32]) -> Vec<Region> {
    subdomain.region.split(threads[subdomain.worker].max(1) as usize)
}

/// By worker: part and elements of each of its blocks, in the worker's order.
fn blocks_of(layout: &[decompose::Subdomain], threads: &[u32]) -> Vec<Vec<(usize, Region)>> {
    let mut by_worker = vec![Vec::new(); threads.len()];
    for subdomain in layout {
        let regions = blocks(subdomain, threads);
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

/// The external gap: nodes of one part may not start inside the zone of another.
fn refuse_overlap(
    mesh: &Mesh,
    surface: &Surface,
    inside: &[(u32, u32, f64)],
    gap: f64,
) -> Result<(), String> {
    let foreign = inside
        .iter()
        .find(|(node, face, _)| surface.node_part[*node as usize] != surface.faces[*face as usize].part);
    match foreign {
        None => Ok(()),
        Some(&(node, face, distance)) => Err(format!(
            "node {} of part `{}` starts {distance:e} from part `{}`, inside the contact gap {gap:e}; move the parts apart by at least the gap, join them, or write contact.initial_penetration = \"ignore\"",
            mesh.node_ids[surface.nodes[node as usize] as usize],
            mesh.parts[surface.node_part[node as usize] as usize].name,
            mesh.parts[surface.faces[face as usize].part as usize].name,
        )),
    }
}

/// Refuses edges of two parts that start nearer to each other than the gap.
fn refuse_crossing(
    mesh: &Mesh,
    surface: &Surface,
    crossing: &[([u32; 2], f64)],
    gap: f64,
) -> Result<(), String> {
    let edges = |pair: [u32; 2]| pair.map(|edge| &surface.edges[edge as usize]);
    let foreign = crossing.iter().map(|&(pair, distance)| (edges(pair), distance));
    let Some(([a, b], distance)) = foreign.into_iter().find(|([a, b], _)| a.part != b.part) else {
        return Ok(());
    };
    let id = |n: u32| mesh.node_ids[surface.nodes[n as usize] as usize];
    Err(format!(
        "the edge from node {} to {} of part `{}` starts {distance:e} from the edge from node {} to {} of part `{}`, inside the contact gap {gap:e}; move the parts apart by at least the gap, join them, or write contact.initial_penetration = \"ignore\"",
        id(a.nodes[0]),
        id(a.nodes[1]),
        mesh.parts[a.part as usize].name,
        id(b.nodes[0]),
        id(b.nodes[1]),
        mesh.parts[b.part as usize].name,
    ))
}
