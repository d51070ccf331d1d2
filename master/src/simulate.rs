//! `bolide simulate`: what an emulated cluster would take for a deck, on one machine.
//!
//! [`cluster`] reads the cluster file. [`virtual_clock`] drives the real sessions on emulated hosts ([`machines`],
//! [`processor`]) and wires ([`network`]); [`timeline`] says what came of it. [`tape`] lets a run be driven again under other costs without computing. [`calibrate`] turns the
//! seconds of a cluster file into costs of work. [`table`] prints the tables of the paper ([`mod@paper`]) beside
//! modelled ones, [`figure`] draws them. [`queue`] plays many jobs at once. All figures are modelled, and say so.

use std::{path::Path, process::ExitCode, sync::Arc};

use deck::model::Model;
use mechanics::lanes::Width;
use protocol::options::Route;
use serde::Serialize;

pub mod calibrate;
pub mod cluster;
pub mod figure;
pub mod machines;
pub mod measure;
pub mod mixed;
pub mod network;
pub mod paper;
pub mod processor;
pub mod queue;
pub mod sweep;
pub mod table;
pub mod tape;
pub mod timeline;
pub mod virtual_clock;

use crate::{
    balance::Costs,
    command::SimulateArgs,
    deck_file::read_deck,
    incident::{Loss, Rebalance},
    shell::{print, tell},
};

use cluster::{Cluster, ElementCost};
use machines::{Machines, Scheme, What};
use timeline::{Phases, Timeline};

/// Does what `bolide simulate` is asked for.
///
/// # Errors
/// Faults of the files, and whatever keeps a run from its end.
pub fn run(args: &SimulateArgs) -> Result<ExitCode, String> {
    let cluster = cluster::read_file(&args.cluster)?;
    match &args.deck {
        None if args.decomposition => decomposition(args, &cluster),
        None if args.queue => queued(args, &first_hosts(args, cluster)?),
        Some(deck) if args.measure_costs => measured(args, &cluster, deck),
        Some(deck) => one(args, &first_hosts(args, cluster)?, deck),
        None => tables(args, &cluster),
    }
}

/// The cluster with as many hosts as are asked for.
fn first_hosts(args: &SimulateArgs, cluster: Cluster) -> Result<Cluster, String> {
    match args.hosts.map(|n| n as usize) {
        None => Ok(cluster),
        Some(n) if n <= cluster.speeds.len() => Ok(cluster.first(n)),
        Some(n) => {
            let (file, there) = (args.cluster.display(), cluster.speeds.len());
            Err(format!("{file}: {there} hosts, --hosts asks for {n}"))
        }
    }
}

fn model(path: &Path, cycles: u64) -> Result<Arc<Model>, String> {
    let mut model = read_deck(path)?;
    model.setup.control.end_cycle = model.setup.control.end_cycle.min(cycles);
    Ok(Arc::new(model))
}

/// A JSON object by line.
fn print_rows<T: Serialize>(rows: &[T]) -> Result<ExitCode, String> {
    for row in rows {
        print(&serde_json::to_string(row).map_err(|e| e.to_string())?)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn decomposition(args: &SimulateArgs, cluster: &Cluster) -> Result<ExitCode, String> {
    let costs = Costs { node: cluster.node, pair: cluster.pair, ..Costs::NONE };
    let rows = mixed::run(cluster.speeds.len(), &mixed::EDGES.map(|(edge, _)| edge), args.seeds, costs)?;
    if args.json {
        return print_rows(&rows);
    }
    print(&mixed::print(&rows, cluster.pair))?;
    Ok(ExitCode::SUCCESS)
}

fn queued(args: &SimulateArgs, cluster: &Cluster) -> Result<ExitCode, String> {
    let rows = queue::run(cluster, args.seeds)?;
    if args.json {
        return print_rows(&rows);
    }
    print(&queue::print(&cluster.title, &rows))?;
    Ok(ExitCode::SUCCESS)
}

fn measured(args: &SimulateArgs, cluster: &Cluster, deck: &Path) -> Result<ExitCode, String> {
    let lanes = args
        .lanes
        .as_ref()
        .map(|lanes| lanes.parse::<Width>().and_then(Width::require))
        .transpose()
        .map_err(|e| e.to_string())?;
    let (all, medians) =
        measure::run(&model(deck, args.cycles)?, cluster.speeds.len(), lanes, args.repetitions)?;
    if args.json {
        print(&serde_json::to_string(&medians).map_err(|e| e.to_string())?)?;
    } else {
        print(&measure::print(&all, &medians))?;
        print(&format!(
            "the cluster file: node = {}, pair = {}, search = {}, sort = {}, message_seconds = {:e}, byte_seconds = {:e}",
            cluster.node,
            cluster.pair,
            cluster.search,
            cluster.sort,
            cluster.network.message,
            cluster.network.byte
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn tables(args: &SimulateArgs, cluster: &Cluster) -> Result<ExitCode, String> {
    if cluster.changes.iter().any(|change| !matches!(change.what, What::Speed(_))) {
        return Err(format!("{}: hosts that come and go are for runs of one deck", args.cluster.display()));
    }
    let tables = cluster
        .tables
        .as_ref()
        .ok_or_else(|| format!("{}: no [tables]; add decks and hosts", args.cluster.display()))?;
    let models = [model(&tables.decks[0], args.cycles)?, model(&tables.decks[1], args.cycles)?];
    if !tables.rates.is_empty() {
        let rows = sweep::run(cluster, tables, &models, &mut |cell| tell(cell))?;
        if args.json {
            return print_rows(&rows);
        }
        print(&sweep::print(cluster, &rows))?;
        return Ok(ExitCode::SUCCESS);
    }
    let report = table::run(cluster, tables, &models, &mut |cell| tell(cell))?;
    if let Some(folder) = &args.out {
        pictures(folder, &cluster.title, &report.last)?;
        let path = folder.join("speed-up.svg");
        let picture = figure::speed_up(&cluster.title, &report.rows);
        std::fs::write(&path, picture).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    if args.json {
        return print_rows(&report.rows);
    }
    print(&table::print(cluster, &report))?;
    Ok(ExitCode::SUCCESS)
}

/// What one run on a cluster came to.
#[derive(Serialize)]
struct Summary<'a> {
    cluster: &'a str,
    clock: &'a str,
    route: &'a str,
    elements: usize,
    hosts: usize,
    cycles: usize,
    /// Cycles that averages are taken over.
    window: (u64, u64),
    sec_per_cycle: f64,
    /// Work of a cycle at speed 1 over the sum of speeds (s): no cluster is faster.
    bound: f64,
    bytes_per_cycle: f64,
    /// Of these, those between hosts of different regions.
    bytes_between_regions: f64,
    /// Mean phases of a cycle by worker (s).
    phases: Vec<Phases>,
    /// When work was dealt out by other speeds.
    rebalances: &'a [Rebalance],
    /// Hosts that were lost.
    losses: &'a [Loss],
    digest: &'a str,
}

fn one(args: &SimulateArgs, cluster: &Cluster, deck: &Path) -> Result<ExitCode, String> {
    let model = model(deck, args.cycles)?;
    let benchmarks = match (&cluster.element, &cluster.tables) {
        (ElementCost::Seconds(_), _) => [[0.0; 5]; 2],
        (ElementCost::Calibrated(_), Some(tables)) => [
            calibrate::work(&self::model(&tables.decks[0], args.cycles)?, cluster)?,
            calibrate::work(&self::model(&tables.decks[1], args.cycles)?, cluster)?,
        ],
        (ElementCost::Calibrated(_), None) => {
            return Err(format!(
                "{}: element = [s, s] needs the two decks of [tables] to be calibrated by",
                args.cluster.display()
            ));
        }
    };
    let costs = calibrate::costs(cluster, &benchmarks, 1.0);
    let work = calibrate::work(&model, cluster)?;
    let route = Route::choose(args.route, cluster.speeds.len(), true);
    let scheme = Scheme { balance: args.balance, sort_by: args.sort_by, ..Scheme::bolide(route) };
    let dealt_by = costs.relative(&cluster.network);
    let machines = Machines {
        believed: calibrate::believed(&model, (&cluster.speeds, &scheme), (&costs, dealt_by), &work),
        speeds: cluster.speeds.clone(),
        costs,
        dealt_by,
        network: cluster.network.clone(),
        changes: cluster.changes.clone(),
    };
    let bound = calibrate::seconds(&costs, &work) / cluster.speeds.iter().sum::<f64>();
    let (timeline, _) = virtual_clock::run(&model, &machines, scheme, None)?;
    let (window, regions) = (timeline.window(), &cluster.network.regions.of_host);
    let summary = Summary {
        cluster: &cluster.title,
        clock: "virtual",
        route: route.name(),
        elements: model.mesh.n_elements(),
        hosts: cluster.speeds.len(),
        cycles: timeline.counts.len(),
        window: (window.start, window.end),
        sec_per_cycle: timeline.seconds_per_cycle(),
        bound,
        bytes_per_cycle: timeline.bytes_per_cycle(),
        bytes_between_regions: timeline.bytes_between(|from, to| regions.get(from) != regions.get(to)),
        phases: (0..cluster.speeds.len()).map(|worker| timeline.mean_phases(worker)).collect(),
        rebalances: &timeline.rebalances,
        losses: &timeline.losses,
        digest: &timeline.digest,
    };
    if let Some(folder) = &args.out {
        pictures(folder, &cluster.title, &timeline)?;
    }
    if args.json {
        print(&serde_json::to_string(&summary).map_err(|e| e.to_string())?)?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&format!(
        "{}: modelled under a {} clock, route {}",
        summary.cluster, summary.clock, summary.route
    ))?;
    print(&format!(
        "{} elements, {} hosts, cycles {} to {}: {:.6} s/cycle, {:.4} of the bound {:.6}; {:.0} bytes/cycle",
        summary.elements,
        summary.hosts,
        window.start,
        window.end,
        summary.sec_per_cycle,
        summary.sec_per_cycle / summary.bound,
        summary.bound,
        summary.bytes_per_cycle
    ))?;
    if summary.bytes_between_regions > 0.0 {
        print(&format!("between regions: {:.0} bytes/cycle", summary.bytes_between_regions))?;
    }
    let [elements, nodes, pairs, searched, sorted] = work;
    print(&format!(
        "work per cycle: {elements:.0} elements, {nodes:.0} nodes, {pairs:.0} pairs, {searched:.0} pairs of new plans, {sorted:.0} surface nodes sorted"
    ))?;
    print("  host  speed     border    contact   interior       send  integrate       wait  (s/cycle)")?;
    for (i, (p, speed)) in summary.phases.iter().zip(&cluster.speeds).enumerate() {
        print(&format!(
            "  {:4}  {speed:5}  {:9.6}  {:9.6}  {:9.6}  {:9.6}  {:9.6}  {:9.6}",
            i + 1,
            p.border,
            p.contact,
            p.interior,
            p.send,
            p.integrate,
            p.wait
        ))?;
    }
    for Rebalance { cycle, imbalance_before, imbalance_after, .. } in summary.rebalances {
        print(&format!(
            "cycle {cycle}: dealt out anew, imbalance measured {imbalance_before:.3}, foreseen {imbalance_after:.3}"
        ))?;
    }
    for Loss { worker, cycle, back_to, why } in summary.losses {
        print(&format!("cycle {cycle}: {worker} is lost, {why}; back to cycle {back_to}"))?;
    }
    print(&format!("digest {}", summary.digest))?;
    Ok(ExitCode::SUCCESS)
}

/// Draws what a run shows.
fn pictures(folder: &Path, title: &str, timeline: &Timeline) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let write = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    write("space-time.svg", figure::space_time(title, timeline))?;
    write("trace.json", figure::trace(timeline))
}
