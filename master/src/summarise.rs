//! The facts of a run that is over, from its model, its outcome and what it cost: what `summary.json` holds.

use std::collections::BTreeSet;

use deck::model::Model;
use mechanics::{contact::Surface, element::hourglass::Kind, state::GlobalState};
use protocol::phase::{Phase, Report};

use crate::{
    embedded::Traffic,
    event::Outcome,
    job::Job,
    quality,
    results::{
        Units,
        history::PartEnergy,
        summary::{
            DeadGauge, Energies, NamedBody, NamedPair, NamedPart, Origin, Summary, WorkUnits, WorkerTimes,
        },
    },
    run_totals::{Dead, PairSums, RunTotals},
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
    let dead = dead_gauges(model, run_totals);
    let parts = named_parts(model, run_totals, outcome.state.as_ref());
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
        serial_share: traffic.serial_ns.map(|serial| {
            let cycles = compute.saturating_sub(traffic.sort_ns) + serial;
            per(serial as f64, cycles as f64)
        }),
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
            parts: parts.clone(),
            contacts: run_totals.contacts.iter().map(|pair| named_pair(model, pair)).collect(),
        },
        broken_ties: outcome.state.as_ref().and_then(|state| {
            model.setup.contact.as_ref().and_then(|settings| settings.n_broken(&state.contact))
        }),
        momentum_error: run_totals.momentum_error(),
        worst_courant: run_totals.worst_courant,
        worst_gap_travel: run_totals.worst_gap_travel,
        worst_penetration: run_totals.worst_penetration,
        rebalances: outcome.rebalances.clone(),
        losses: outcome.losses.clone(),
        warnings: hourglass_warnings(&model.mesh.parts, &parts, run_totals.scale())
            .into_iter()
            .chain(outcome.runaways.iter().map(ToString::to_string))
            .chain(dead.iter().map(|gauge| dead_gauge_warning(gauge, Units::named(&model.units).time)))
            .chain(outcome.differences.iter().map(ToString::to_string))
            .chain(waits_warning(outcome.waits, outcome.cycles_run))
            .collect(),
        quality: match outcome.failure.is_some() && outcome.cycles_run == 0 {
            // Nothing was computed that could be judged.
            true => quality::Quality::default(),
            false => quality::judge(model, &parts, outcome, &dead),
        },
        mirrors: model.output.mirrors,
        units: model.units.clone(),
        origin: Origin::default(),
        dead_gauges: dead,
        digest: outcome.digest.clone(),
        input: None,
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

/// Masses, momenta and energies of the parts beside their names, and what each has lost to erosion.
fn named_parts(model: &Model, run_totals: &RunTotals, state: Option<&GlobalState>) -> Vec<NamedPart> {
    let offsets = model.mesh.element_offsets();
    let eroded = |p: usize| {
        let elements = offsets[p]..offsets[p] + model.mesh.parts[p].n_elements();
        state.map_or(0, |state| elements.filter(|&e| state.is_eroded(e)).count() as u64)
    };
    let of = |(p, (part, e)): (usize, (&mechanics::mesh::Part, &PartEnergy))| NamedPart {
        eroded_elements: eroded(p),
        eroded_energy: e.eroded,
        name: part.name.clone(),
        mass: run_totals.masses.get(p).copied().unwrap_or_default(),
        momentum: run_totals.last.part_momenta.get(p).copied().unwrap_or_default(),
        kinetic: e.kinetic,
        internal: e.internal,
        hourglass: e.hourglass,
        viscosity: e.viscosity,
        external: e.external,
    };
    model.mesh.parts.iter().zip(&run_totals.last.parts).enumerate().map(of).collect()
}

/// Gauges that have lost their last element, by name.
fn dead_gauges(model: &Model, run_totals: &RunTotals) -> Vec<DeadGauge> {
    let output = &model.output;
    let at_nodes = output.gauges.iter().map(|gauge| &gauge.name);
    let names: Vec<&String> = at_nodes.chain(output.element_gauges.iter().map(|gauge| &gauge.name)).collect();
    let dead = run_totals.gauges.dead.iter();
    let named = |dead: &Dead| {
        let name = (*names.get(dead.gauge as usize)?).clone();
        Some(DeadGauge { name, cycle: dead.cycle, time: dead.time })
    };
    dead.filter_map(named).collect()
}

/// What a reader of its curve should know.
fn dead_gauge_warning(gauge: &DeadGauge, unit: &str) -> String {
    let DeadGauge { name, cycle, time } = gauge;
    format!(
        "gauge \"{name}\": the last element at it has eroded in cycle {cycle}, at {time:.4e} {unit}; what it reads after that is debris, so end its curve there"
    )
}

/// Share of the internal energy of a part above which its hourglass energy is told.
const HOURGLASS_SHARE: f64 = 0.1;
/// Share of the energy of the whole run below which the hourglass energy of a part is nothing to tell.
const NEGLIGIBLE: f64 = 0.01;

/// That more than a tenth of the cycles of a run waited for states on their way to the master.
fn waits_warning(waits: u64, cycles: u64) -> Option<String> {
    (waits > cycles / 10).then(|| {
        format!(
            "{waits} of {cycles} cycles waited for results on their way to the master: a longer period of [output] would shorten the run"
        )
    })
}

/// The parts whose hourglass energy is large beside their internal energy, as warnings; `scale` is the energy of the
/// run.
fn hourglass_warnings(of_mesh: &[mechanics::mesh::Part], parts: &[NamedPart], scale: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    for (in_mesh, part) in of_mesh.iter().zip(parts) {
        let (hourglass, internal) = (part.hourglass, part.internal_of_all());
        if hourglass <= HOURGLASS_SHARE * internal || hourglass <= NEGLIGIBLE * scale {
            continue;
        }
        let name = &part.name;
        let of = if internal > 0.0 { format!(" of {internal:.3e}") } else { String::new() };
        let advice = match in_mesh.hourglass.kind {
            _ if in_mesh.section().is_some() => "refine its mesh where it bends or is struck",
            Kind::AssumedStrain => {
                "much of it bends inside single elements, so refine its mesh where it bends or is struck and see whether the answer stays"
            }
            Kind::Viscous | Kind::Stiffness => {
                "refine its mesh where it bends or is struck, or give it hourglass = { kind = \"assumed-strain\" }"
            }
        };
        warnings.push(format!(
            "part \"{name}\": hourglass energy {hourglass:.3e}, above a tenth of its internal energy{of}; {advice}"
        ));
    }
    warnings
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

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::{
        element::hourglass::Hourglass,
        mesh::{Part, Topology},
    };

    #[test]
    fn cycles_that_waited_for_results_are_told_where_they_are_many() {
        assert_eq!(waits_warning(10, 100), None);
        let told = waits_warning(11, 100).expect("more than a tenth");
        assert!(told.starts_with("11 of 100 cycles waited for results"), "{told}");
    }

    fn part(name: &str, internal: f64, hourglass: f64, eroded_elements: u64) -> NamedPart {
        NamedPart { name: name.to_owned(), internal, hourglass, eroded_elements, ..NamedPart::default() }
    }

    #[test]
    fn a_part_whose_hourglass_energy_is_a_tenth_of_the_internal_one_is_told_where_that_matters() {
        let mut parts = [
            part("sound", 10.0, 0.9, 0),
            part("swallowed", 10.0, 1.1, 0),
            part("hardly strained", 1e-3, 0.5, 0),
            part("cold and bent", -1e-9, 2.0, 0),
            part("worn", 1.0, 1.5, 3),
        ];
        parts[4].eroded_energy = 20.0;
        let in_mesh = |kind: Kind| Part {
            name: String::new(),
            material: 0,
            topology: Topology::Structured { cells: [1; 3] },
            nodes: Vec::new(),
            element_ids: Vec::new(),
            hourglass: Hourglass { kind, coefficient: 0.1 },
        };
        let mut of_mesh = [Kind::Viscous; 5].map(in_mesh);
        of_mesh[3].hourglass.kind = Kind::AssumedStrain;
        assert_eq!(
            hourglass_warnings(&of_mesh, &parts, 100.0),
            [
                "part \"swallowed\": hourglass energy 1.100e0, above a tenth of its internal energy of 1.000e1; refine its mesh \
                 where it bends or is struck, or give it hourglass = { kind = \"assumed-strain\" }",
                "part \"cold and bent\": hourglass energy 2.000e0, above a tenth of its internal energy; much of it bends inside \
                 single elements, so refine its mesh where it bends or is struck and see whether the answer stays",
            ]
        );
        // What has eroded of others is none of its own.
        parts[4].eroded_energy = 0.0;
        parts[1].eroded_energy = 20.0;
        assert_eq!(hourglass_warnings(&of_mesh[4..], &parts[4..], 100.0).len(), 1);
    }
}
