//! The facts of a run that is over, from its model, its outcome and what it cost: what `summary.json` holds.

use std::collections::BTreeSet;

use deck::model::Model;
use mechanics::{contact::Surface, state::GlobalState};
use protocol::phase::{Phase, Report};

use crate::{
    embedded::Traffic,
    event::Outcome,
    job::Job,
    results::{
        history::PartEnergy,
        summary::{Energies, NamedBody, NamedPair, NamedPart, Summary, WorkUnits, WorkerTimes},
    },
    run_totals::{PairSums, RunTotals},
};

/// Counts of the surface, taken before the run.
pub struct SurfaceCensus {
    elements: u64,
    faces: u64,
    nodes: u64,
}

impl SurfaceCensus {
    /// Of a job; without contact the surface is counted all the same.
    pub fn of(job: &Job, model: &Model) -> Self {
        job.surface().map_or_else(|| Self::without_contact(model), Self::count)
    }

    /// Of a problem without contact.
    pub fn without_contact(model: &Model) -> Self {
        Self::count(&Surface::new(&model.mesh, &model.setup.materials, &|_| true))
    }

    fn count(surface: &Surface) -> Self {
        Self {
            elements: surface.n_elements() as u64,
            faces: surface.faces.len() as u64,
            nodes: surface.active.iter().filter(|active| **active).count() as u64,
        }
    }
}

/// The facts of a run, for a person and for a file.
pub fn summarise(
    model: &Model,
    census: &SurfaceCensus,
    outcome: &Outcome,
    traffic: Traffic,
    threads: u32,
    wall_s: f64,
) -> Summary {
    let run_totals = &outcome.run_totals;
    let cycles = outcome.state.as_ref().map_or(run_totals.last.cycle, |s| s.cycle);
    let elements = model.mesh.n_elements() as u64;
    let compute: u64 = outcome.work.iter().map(|w| w.compute_ns).sum::<u64>() + traffic.sort_ns;
    let contact: u64 = outcome.work.iter().map(|w| w.contact_ns).sum::<u64>() + traffic.sort_ns;
    let per = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
    let run_cycles = outcome.cycles_run as f64;
    let units = &outcome.census;
    Summary {
        title: model.title.clone(),
        elements,
        nodes: model.mesh.n_nodes() as u64,
        surface_elements: census.elements,
        surface_faces: census.faces,
        surface_nodes: census.nodes,
        workers: outcome.workers.len() as u32,
        threads,
        route: outcome.route.to_owned(),
        linked_pairs: pairs(&outcome.reports).0,
        relayed_pairs: pairs(&outcome.reports).1,
        lanes: outcome.lanes.clone(),
        cycles,
        end_time: outcome.state.as_ref().map_or(run_totals.last.time, |s| s.time),
        wall_s,
        grind_ns: per(compute as f64, elements as f64 * run_cycles),
        contact_share: per(contact as f64, compute as f64),
        sorts: outcome.sorts,
        work_units: WorkUnits {
            count: units.units as u64,
            nodes_min: units.nodes.0 as u64,
            nodes_mean: units.nodes.1,
            nodes_max: units.nodes.2 as u64,
            faces_min: units.faces.0 as u64,
            faces_mean: units.faces.1,
            faces_max: units.faces.2 as u64,
            interactions: units.interactions,
        },
        imbalance: outcome.imbalance,
        bytes_per_cycle: per(traffic.bytes as f64, run_cycles),
        master_bytes_per_cycle: per((traffic.bytes - traffic.peer_bytes) as f64, run_cycles),
        worker_times: worker_times(&outcome.workers, &outcome.reports),
        eroded_elements: run_totals.eroded_elements,
        eroded_mass: run_totals.eroded_mass,
        eroded_energy: run_totals.eroded,
        energies: Energies {
            kinetic: run_totals.last.kinetic,
            internal: run_totals.last.internal,
            hourglass: run_totals.hourglass,
            viscosity: run_totals.viscosity,
            contact: run_totals.last.contact + run_totals.friction,
            friction: run_totals.friction,
            wall_loss: run_totals.wall_loss,
            external: run_totals.external,
            error: run_totals.last.error,
            worst_body: worst_body(model, run_totals),
            parts: named_parts(model, &run_totals.last.parts, outcome.state.as_ref()),
            contacts: run_totals.contacts.iter().map(|pair| named_pair(model, pair)).collect(),
        },
        momentum_error: run_totals.momentum_error(),
        worst_courant: run_totals.worst_courant,
        worst_gap_travel: run_totals.worst_gap_travel,
        worst_penetration: run_totals.worst_penetration,
        rebalances: outcome.rebalances.clone(),
        losses: outcome.losses.clone(),
        digest: outcome.digest.clone(),
    }
}

/// The body whose own energy error is greatest; the first of equals. None where all is one body.
fn worst_body(model: &Model, run_totals: &RunTotals) -> Option<NamedBody> {
    let bodies = run_totals.bodies();
    if bodies.len() < 2 {
        return None;
    }
    let worst = bodies.into_iter().reduce(|a, b| if b.error.abs() > a.error.abs() { b } else { a })?;
    let parts = worst.parts.iter().map(|&p| model.mesh.parts[p].name.clone()).collect();
    Some(NamedBody { parts, gain: worst.gain, error: worst.error })
}

/// Energies of the parts beside their names, and what each has lost to erosion.
fn named_parts(model: &Model, parts: &[PartEnergy], state: Option<&GlobalState>) -> Vec<NamedPart> {
    let offsets = model.mesh.element_offsets();
    let eroded = |p: usize| {
        let elements = offsets[p]..offsets[p] + model.mesh.parts[p].n_elements();
        state.map_or(0, |state| elements.filter(|&e| state.is_eroded(e)).count() as u64)
    };
    let of = |(p, (part, e)): (usize, (&mechanics::mesh::Part, &PartEnergy))| NamedPart {
        eroded_elements: eroded(p),
        name: part.name.clone(),
        kinetic: e.kinetic,
        internal: e.internal,
        hourglass: e.hourglass,
        viscosity: e.viscosity,
        external: e.external,
    };
    model.mesh.parts.iter().zip(parts).enumerate().map(of).collect()
}

/// Energies of a pair beside the names of its parts.
fn named_pair(model: &Model, pair: &PairSums) -> NamedPair {
    let name = |p: u32| model.mesh.parts.get(p as usize).map_or_else(String::new, |part| part.name.clone());
    NamedPair {
        parts: pair.parts.map(name),
        contact: pair.contact + pair.friction,
        friction: pair.friction,
        eroded: pair.eroded,
    }
}

/// Pairs of workers that exchange over a link of their own, and those that the master relays for.
fn pairs(reports: &[Report]) -> (u64, u64) {
    let pair = |me: usize, other: &u32| (me.min(*other as usize), me.max(*other as usize));
    let of = |list: fn(&Report) -> &Vec<u32>| -> BTreeSet<(usize, usize)> {
        let lists = reports.iter().enumerate();
        lists.flat_map(|(me, report)| list(report).iter().map(move |other| pair(me, other))).collect()
    };
    let (linked, relayed) = (of(|report| &report.linked), of(|report| &report.relayed));
    (linked.difference(&relayed).count() as u64, relayed.len() as u64)
}

/// How the time of each worker went.
fn worker_times(names: &[String], reports: &[Report]) -> Vec<WorkerTimes> {
    let of = |(name, report): (&String, &Report)| WorkerTimes {
        name: (*name).to_owned(),
        border_s: report.seconds(Phase::Border),
        contact_s: report.seconds(Phase::Contact),
        interior_s: report.seconds(Phase::Interior),
        send_s: report.seconds(Phase::Send),
        wait_s: report.seconds(Phase::Wait),
        integrate_s: report.seconds(Phase::Integrate),
        other_s: report.seconds(Phase::Other),
        peer_bytes: report.peer_bytes,
    };
    names.iter().zip(reports).map(of).collect()
}
