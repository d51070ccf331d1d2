//! From a problem and its workers to the first assignments.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use mechanics::{
    block::Piece,
    contact::{Exclusions, Surface, initial_pairs},
    cycle::Subdomain,
    initial,
    mesh::Mesh,
    piece,
    vote::Quanta,
    wall,
};
use protocol::{
    message::{Assign, ToWorker, Work},
    phase::Report,
};

use super::{Bench, Job};
use crate::{
    decompose::decompose,
    event::{Action, Hand, Options},
    exchange::{Exchange, Holdings},
    ledger::Ledger,
    snapshot::Snapshot,
    sort::Sorter,
};
impl Job {
    /// Takes a problem to these workers: from its deck, or from a snapshot of it.
    ///
    /// # Errors
    /// If the problem cannot start: elements without volume, contact zones that overlap, no worker.
    pub fn new(
        model: Arc<Model>,
        hands: &[Hand],
        options: Options,
        resume: Option<Snapshot>,
    ) -> Result<(Self, Vec<Action>), String> {
        if hands.is_empty() {
            return Err("no worker: start one with `bolide worker --master HOST`".to_owned());
        }
        let mut setup = model.setup.clone();
        let mut constraint = model.constraint.clone();
        initial::bind_walls(&model.mesh, &mut setup, &mut constraint)?;
        let start = initial::state(&model.mesh, &setup, &model.velocity, &constraint)?;
        let fresh_quanta = initial::quanta(&model.mesh, &setup, &start);
        let (state, quanta, ledger, walls, rows, steps, vote_before) = match resume {
            None => {
                let ledger = Ledger::new(&model, &start.mass);
                let walls = wall::first_poses(&setup.walls);
                (start, fresh_quanta, ledger, walls, Vec::new(), BTreeMap::new(), None)
            }
            Some(snapshot) => {
                if snapshot.state.x.len() != start.x.len()
                    || snapshot.state.initial_volume != start.initial_volume
                    || snapshot.walls.len() != wall::first_poses(&setup.walls).len()
                {
                    return Err(
                        "the snapshot is of another problem: its mesh or its walls are not this deck's"
                            .to_owned(),
                    );
                }
                let cycle = snapshot.state.cycle;
                let time = snapshot.state.time;
                let mut steps = BTreeMap::new();
                if cycle > 0 {
                    steps.insert(cycle - 1, (snapshot.dt_previous, time - snapshot.dt_previous));
                }
                steps.insert(cycle, (snapshot.dt, time));
                let quanta = Quanta { force: snapshot.force_quantum, ..fresh_quanta };
                let Snapshot { state, ledger, walls, rows, vote, .. } = snapshot;
                (state, quanta, ledger, walls, rows, steps, Some(vote))
            }
        };
        let mut model = model;
        if setup != model.setup {
            let mut with_walls = (*model).clone();
            with_walls.setup = setup;
            model = Arc::new(with_walls);
        }
        let n = hands.len();
        let speeds: Vec<f64> = hands.iter().map(|h| h.speed).collect();
        let layout = decompose(&model.mesh, &speeds);
        let mut subdomains: Vec<Subdomain> = Vec::with_capacity(layout.len());
        let mut nodes_of: Vec<Vec<u32>> = Vec::with_capacity(layout.len());
        for (id, subdomain) in layout.iter().enumerate() {
            let threads = hands[subdomain.worker].threads.max(1) as usize;
            let pieces: Vec<Piece> = subdomain
                .region
                .split(threads)
                .iter()
                .map(|region| piece::cut(&model.mesh, &state, subdomain.part, region))
                .collect();
            let mut nodes: Vec<u32> = pieces.iter().flat_map(|p| p.nodes.iter().copied()).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes_of.push(nodes);
            subdomains.push(Subdomain { id: id as u32, pieces, unowned: Vec::new(), surface: Vec::new() });
        }
        let holdings = Holdings::new(model.mesh.n_nodes(), n, &layout, &nodes_of);
        let surface = model.setup.contact.as_ref().map(|settings| {
            let speed = initial::closing_speeds(&model.mesh, settings, &model.velocity);
            let mut surface = Surface::new(&model.mesh, &model.setup.materials, &|_| true);
            surface.stiffen(&model.mesh, &model.setup.materials, settings, &speed);
            surface
        });
        let mut gather: Vec<Vec<u32>> = vec![Vec::new(); n];
        for (subdomain, (place, nodes)) in subdomains.iter_mut().zip(layout.iter().zip(&nodes_of)) {
            let id = subdomain.id;
            subdomain.unowned =
                nodes.iter().copied().filter(|&node| holdings.owner_subdomain[node as usize] != id).collect();
            if let Some(surface) = &surface {
                subdomain.surface =
                    nodes.iter().copied().filter(|&node| surface.node_index(node).is_some()).collect();
                gather[place.worker].extend(
                    subdomain.surface.iter().filter(|&&node| holdings.owner_subdomain[node as usize] == id),
                );
            }
        }
        let shared_state = Arc::new(state.clone());
        let mut elements = vec![0.0; n];
        for s in &layout {
            elements[s.worker] += s.region.n_elements() as f64;
        }
        let (bench, exchange, census, interactions) = match (surface, &model.setup.contact) {
            (Some(surface), Some(settings)) => {
                let at_start: Vec<[f64; 3]> =
                    surface.nodes.iter().map(|&node| model.mesh.positions[node as usize]).collect();
                let inside = initial_pairs(&surface, &at_start, settings);
                refuse_overlap(&model.mesh, &surface, &inside, settings.gap)?;
                let exclusions = Exclusions::new(&surface, &inside);
                let sorter = Sorter::new(
                    surface,
                    settings.clone(),
                    exclusions,
                    speeds.clone(),
                    options.route,
                    options.dealing,
                    &gather,
                );
                let x = sorter.positions_of(&state);
                let bench = Bench { sorter, holdings, state: shared_state };
                let sorted = bench.sort(&x);
                (Some(Arc::new(bench)), sorted.exchange, sorted.census, sorted.interactions)
            }
            _ => {
                let exchange = Exchange::new(&holdings, vec![None; n], &state, options.route);
                (None, exchange, mechanics::contact::Census::default(), vec![0; n])
            }
        };
        let imbalance = imbalance(&elements, &interactions, &speeds);
        let exchange = Arc::new(exchange);
        let first_cycle = state.cycle;
        let dt_previous = first_cycle.checked_sub(1).and_then(|c| steps.get(&c)).map_or(0.0, |s| s.0);
        let mut by_worker: Vec<Vec<Subdomain>> = vec![Vec::new(); n];
        for (subdomain, place) in subdomains.into_iter().zip(&layout) {
            by_worker[place.worker].push(subdomain);
        }
        let gauges: Vec<u32> = model.output.gauges.iter().map(|g| g.node).collect();
        let actions = by_worker
            .into_iter()
            .enumerate()
            .map(|(w, subdomains)| {
                let assign = Assign {
                    setup: model.setup.clone(),
                    n_parts: model.mesh.parts.len() as u32,
                    quanta,
                    subdomains,
                    gauges: gauges.clone(),
                    lanes: options.lanes.clone(),
                    cycle: first_cycle,
                    dt_previous,
                    route: options.route,
                    plan: exchange.plans[w].clone(),
                    plan_hash: exchange.hash,
                    guest_state: exchange.guest_state_from(w, &state),
                };
                Action::Send(w, ToWorker::Assign(Box::new(assign)))
            })
            .collect();
        let next_state_time = model.output.period.map(|period| {
            let passed = (state.time / period).floor() + 1.0;
            passed * period
        });
        let job = Self {
            n_workers: n,
            quanta,
            bench,
            ready: vec![false; n],
            running: false,
            lanes: String::new(),
            first_cycle,
            steps,
            vote_before,
            arrivals: BTreeMap::new(),
            exchanges: VecDeque::from([(first_cycle, exchange)]),
            completed: first_cycle,
            sorts_under_way: VecDeque::new(),
            transfers: BTreeMap::new(),
            collecting: BTreeMap::new(),
            image_times: BTreeMap::new(),
            snapshot_state: None,
            snapshot_rest: None,
            next_state_time,
            last_gather: first_cycle,
            references: [(first_cycle, first_cycle); 2],
            last_spread: 0.0,
            spread_rate: 0.0,
            stop_asked: false,
            stop_at: None,
            failure: None,
            ledger,
            walls,
            rows,
            sorts: u64::from(census.units > 0),
            census,
            work: vec![Work::default(); n],
            reports: vec![Report::default(); n],
            imbalance,
            over: false,
            state,
            model,
            options,
        };
        Ok((job, actions))
    }
}

/// Most an element's interactions weigh against an element when imbalance is reported: an element-cycle costs about as
/// much as this many interactions.
const INTERACTIONS_PER_ELEMENT: f64 = 60.0;

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
            "node {} of part `{}` starts {distance:e} from part `{}`, inside the contact gap {gap:e}; move the parts apart by at least the gap, or join them",
            mesh.node_ids[surface.nodes[node as usize] as usize],
            mesh.parts[surface.node_part[node as usize] as usize].name,
            mesh.parts[surface.faces[face as usize].part as usize].name,
        )),
    }
}
