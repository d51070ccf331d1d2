//! `bolide bench`: what this machine takes for an element, a node and a pair in a cycle, for a sort and for a message, and
//! the speed that a worker of it would state.
//!
//! Whole runs of small decks in this process, on one thread: elements, shared sums, integration, votes and energies are
//! all in the figures, which are thread-CPU time. Of several rounds the median and the least are printed; on a machine
//! that others use too the least is the steadier.

#![expect(clippy::disallowed_methods, reason = "a size in cells is rounded")]

use std::{
    process::ExitCode,
    str::FromStr,
    sync::{Arc, atomic::AtomicBool},
    time::Instant,
};

use deck::model::Model;
use mechanics::{lanes::Width, mesh::Topology};
use protocol::options::JobOptions;
use serde::Serialize;

use crate::{
    command::GrindArgs,
    deck_file,
    embedded::{self, Sink},
    event::{Action, WorkerSpec},
    job::Job,
    options::SessionOptions,
    shell::print,
    simulate::measure::{self, Measured},
};

/// A worker's speed relative to the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// Measured when the worker starts.
    Auto,
    /// As it was said.
    Given(f64),
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        text.parse().map(Self::Given).map_err(|_| format!("speed {text:?}: a number, or auto to measure it"))
    }
}

/// The grind time of speed 1 (ns): a thread that takes half as long has speed 2.
const SPEED_ONE: f64 = 100.0;

/// Cycles of a run that is measured.
const CYCLES: u64 = 40;

/// A plate of aluminium below one of steel, as in benchmark 1, at 500 m/s; or both of `material`, at 50 m/s, since a soft
/// one stiffens faster than its time step follows.
fn plates(side: u32, material: Option<&str>, gap: f64) -> String {
    let (below, above) = (side / 3 * 2, side / 3);
    let [target, projectile] = match material {
        Some(_) => ["own", "own"],
        None => ["AL_2024_T351", "STEEL_1006"],
    };
    let own = material.map_or(String::new(), |laws| format!("[[material]]\nname = \"own\"\n{laws}\n"));
    let between = if gap > 0.0 {
        format!("[contact]\ngap_length = {gap}\n")
    } else {
        "[[join]]\nparts = [\"target\", \"projectile\"]\n".to_owned()
    };
    format!(
        "title = \"bench\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n{own}\
         [[part]]\nname = \"target\"\nmaterial = \"{target}\"\n\
         box = {{ origin = [0, 0, 0], size = [{side}, {side}, {below}], cells = [{side}, {side}, {below}] }}\n\
         [[part]]\nname = \"projectile\"\nmaterial = \"{projectile}\"\nvelocity = [0, 0, -{speed}]\n\
         box = {{ origin = [0, 0, {base}], size = [{side}, {side}, {above}], cells = [{side}, {side}, {above}] }}\n{between}",
        base = f64::from(below) + gap,
        speed = if material.is_some() { 50 } else { 500 },
    )
}

/// Laws beside Johnson-Cook and shock, as a deck has them.
const LAWS: [(&str, &str); 4] = [
    (
        "von Mises, shock",
        "density = 7896\neos = { type = \"shock\", c0 = 4569, s = 1.49, gamma = 2.17 }\nstrength = { type = \"von-mises\", shear = 81.8e9, yield_stress = 350e6, hardening = 1e8 }",
    ),
    (
        "elastic, linear",
        "density = 7896\neos = { type = \"linear\", bulk = 164e9 }\nstrength = { type = \"elastic\", shear = 81.8e9 }",
    ),
    (
        "hydro, polynomial",
        "density = 1000\neos = { type = \"polynomial\", a1 = 2.2e9, a2 = 9.5e9, a3 = 1.4e10, b0 = 0.28, b1 = 0.28 }\nstrength = { type = \"hydro\" }",
    ),
    (
        "hydro, ideal gas",
        "density = 1.2\neos = { type = \"ideal-gas\", gamma = 1.4, energy = 2e5 }\nstrength = { type = \"hydro\" }",
    ),
];

/// A view of about as many shells with five points, half of which runs against the other and yields.
fn shells(side: u32) -> String {
    let along = f64::from(side).powf(1.5).round() as u32;
    let half = (along / 2).max(1);
    let part = |name: &str, origin: u32, speed: i32| {
        format!(
            "[[part]]\nname = \"{name}\"\nmaterial = \"own\"\nvelocity = [{speed}, 0, 5]\n\
             shell = {{ thickness = 0.2, points = 5 }}\n\
             plate = {{ origin = [{origin}, 0, 0], side_i = [{half}, 0, 0], side_j = [0, {along}, 0], cells = [{half}, {along}] }}\n"
        )
    };
    format!(
        "title = \"bench\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[material]]\nname = \"own\"\n{}\n{}{}\
         [[join]]\nparts = [\"one\", \"other\"]\n",
        LAWS[0].1,
        part("one", 0, 50),
        part("other", half, -50)
    )
}

fn model(text: &str, explicit: bool) -> Result<Arc<Model>, String> {
    let mut model = deck::read(text, "bench")
        .map_err(|faults| deck_file::Error::of_faults(faults.iter().map(ToString::to_string)))?;
    model.setup.control.end_cycle = CYCLES;
    if explicit {
        for part in &mut model.mesh.parts {
            if let Topology::Structured { cells } = part.topology {
                part.topology = Topology::Explicit { hexahedra: connectivity(cells) };
            }
        }
    }
    Ok(Arc::new(model))
}

/// Corners of the elements of a grid, as local nodes.
fn connectivity([ni, nj, nk]: [u32; 3]) -> Vec<[u32; 8]> {
    let (row, plane) = (ni + 1, (ni + 1) * (nj + 1));
    let mut hexahedra = Vec::with_capacity((ni * nj * nk) as usize);
    for k in 0..nk {
        for j in 0..nj {
            hexahedra.extend((0..ni).map(|i| {
                let n = i + j * row + k * plane;
                [0, 1, row + 1, row, plane, plane + 1, plane + row + 1, plane + row].map(|d| n + d)
            }));
        }
    }
    hexahedra
}

/// Takes nothing: a bench has no results.
struct Nothing;

impl Sink for Nothing {
    fn take(&mut self, _: Action) -> Result<(), String> {
        Ok(())
    }
}

/// What one run took.
#[derive(Clone, Copy)]
struct Taken {
    /// Of a cycle and element (ns of thread CPU).
    element_ns: f64,
    /// Contact, without sorts, of a cycle and surface node (ns of thread CPU).
    contact_ns: f64,
    /// Wall clock of the run, its start included (ns).
    wall_ns: f64,
    /// Share of a cycle that one thread does alone.
    serial: f64,
}

fn once(model: &Arc<Model>, threads: u32, lanes: Option<Width>) -> Result<Taken, String> {
    let specs = [WorkerSpec::new("bench", 1.0, threads)];
    let lanes = lanes.map(|width| width.to_string());
    let asked = JobOptions { lanes, no_output: true, ..JobOptions::default() };
    let options = SessionOptions { asked, ..SessionOptions::default() };
    let (mut job, first) = Job::new(Arc::clone(model), &specs, options, None)?;
    job.keep_no_state();
    let surface_nodes = job.surface().map_or(0, |surface| surface.nodes.len());
    let started = Instant::now();
    let (outcome, traffic) =
        embedded::run(job, first, 1, threads as usize, &mut Nothing, &AtomicBool::new(false))?;
    let wall = started.elapsed().as_nanos() as f64;
    if let Some(failure) = outcome.failure {
        return Err(failure);
    }
    let cycles = outcome.cycles_run.max(1) as f64;
    let all: u64 = outcome.work.iter().map(|work| work.compute_ns).sum::<u64>() + traffic.sort_ns;
    let contact: u64 = outcome.work.iter().map(|work| work.contact_ns).sum();
    Ok(Taken {
        element_ns: all as f64 / (cycles * model.mesh.n_elements() as f64),
        contact_ns: contact as f64 / (cycles * surface_nodes.max(1) as f64),
        wall_ns: wall,
        serial: traffic.serial_ns.map_or(0.0, |serial| {
            serial as f64 / (serial + all.saturating_sub(traffic.sort_ns)).max(1) as f64
        }),
    })
}

/// Wall clock of a cycle (ns): what a run that lasts three times as long takes more, so that the start does not count.
fn wall_of_a_cycle(model: &Model, threads: u32, lanes: Option<Width>) -> Result<f64, String> {
    let mut taken = [0.0; 2];
    for (times, taken) in [1, 3].into_iter().zip(&mut taken) {
        let mut model = model.clone();
        model.setup.control.end_cycle = times * CYCLES;
        *taken = once(&Arc::new(model), threads, lanes)?.wall_ns;
    }
    let cycles = 2 * CYCLES;
    Ok((taken[1] - taken[0]).max(1.0) / cycles as f64)
}

/// Median and least.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Median of the rounds.
    pub median: f64,
    pub least: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let least = values.first().copied().unwrap_or(0.0);
        Self { median: values.get(values.len() / 2).copied().unwrap_or(0.0), least }
    }
}

/// Grind time of one kind of element and laws (ns per element and cycle).
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Laws and topology.
    pub name: String,
    /// Number of elements.
    pub elements: usize,
    /// The time.
    pub ns: Spread,
}

/// All that `bolide bench` says.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Lane width.
    pub lanes: String,
    /// Element by element kind and laws.
    pub elements: Vec<Row>,
    /// Benchmark 2: contact of a surface node in a cycle, sorts aside (ns).
    pub contact_node_ns: Spread,
    /// A pair that a cycle looks at (ns); none where no pair was there.
    pub pair_ns: Option<f64>,
    /// A surface node in a sort (ns); none where there was none.
    pub sort_node_ns: Option<f64>,
    /// A short message over loopback, at each end (ns).
    pub message_ns: f64,
    /// A byte of a long one, at each end (ns).
    pub byte_ns: f64,
    /// Share of a cycle that one thread does alone, however many there are: joined plates and plates in contact.
    pub serial_shares: [Spread; 2],
    /// Wall clock of one thread over that of two and by two, by turns; none where there is one processor.
    pub two_threads: Option<Spread>,
    /// What `--speed auto` says with one thread.
    pub speed_of_a_thread: f64,
}

/// Measures and prints.
///
/// # Errors
/// Lanes that this machine lacks, processors that it has not, a run that fails.
pub fn run(args: &GrindArgs) -> Result<ExitCode, String> {
    if let Some(pin) = &args.pin {
        pin.apply()?;
    }
    let lanes = args.lanes.as_ref().map(|lanes| lanes.parse::<Width>().and_then(Width::require));
    let lanes = lanes.transpose().map_err(|e| e.to_string())?;
    let report = measured(args.rounds, args.side, lanes)?;
    if args.json {
        print(&serde_json::to_string(&report).map_err(|e| e.to_string())?)?;
    } else {
        print(&table(&report))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn measured(rounds: u32, side: u32, lanes: Option<Width>) -> Result<Report, String> {
    let mut cases = vec![
        ("Johnson-Cook, shock".to_owned(), model(&plates(side, None, 0.0), false)?),
        ("Johnson-Cook, shock, explicit connectivity".to_owned(), model(&plates(side, None, 0.0), true)?),
    ];
    for (name, laws) in LAWS {
        cases.push((name.to_owned(), model(&plates(side, Some(laws), 0.0), false)?));
    }
    cases.push(("shells of five points, von Mises".to_owned(), model(&shells(side), false)?));
    let touching = model(&plates(side, None, 0.1), false)?;
    let mut times = vec![Vec::new(); cases.len()];
    let (mut contact, mut two, mut serial) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    let cores = worker::processors::cores();
    for _ in 0..rounds {
        for (case, ((_, model), times)) in cases.iter().zip(&mut times).enumerate() {
            let taken = once(model, 1, lanes)?;
            times.push(taken.element_ns);
            if case == 0 {
                serial[0].push(taken.serial);
            }
        }
        let taken = once(&touching, 1, lanes)?;
        contact.push(taken.contact_ns);
        serial[1].push(taken.serial);
        if cores > 1 {
            let (_, joined) = &cases[0];
            two.push(wall_of_a_cycle(joined, 1, lanes)? / (2.0 * wall_of_a_cycle(joined, 2, lanes)?));
        }
    }
    let (_, Measured { element_ns, pair, sort, message_ns, byte_ns, .. }) =
        measure::run(&touching, 1, lanes, rounds)?;
    let elements: Vec<Row> = cases
        .into_iter()
        .zip(times)
        .map(|((name, model), times)| Row { name, elements: model.mesh.n_elements(), ns: Spread::of(times) })
        .collect();
    Ok(Report {
        lanes: lanes.unwrap_or_else(Width::best).to_string(),
        speed_of_a_thread: speed_of(elements[0].ns.least, 1),
        elements,
        contact_node_ns: Spread::of(contact),
        pair_ns: pair.map(|pair| pair * element_ns),
        sort_node_ns: pair.zip(sort).map(|(pair, sort)| sort * pair * element_ns),
        message_ns,
        byte_ns,
        serial_shares: serial.map(Spread::of),
        two_threads: (cores > 1).then(|| Spread::of(two)),
    })
}

/// What the time of an element is over that of the first on the machines of deploy/bench/README.md.
const USUAL_OF_ELEMENTS: [&str; 7] =
    ["30-75 ns; avx2 55-105", "1.0-1.4", "0.85-0.95", "0.85-0.95", "0.5-0.6", "0.5-0.6", "1.3-1.6"];
/// The same of a surface node in contact.
const USUAL_OF_CONTACT: &str = "0.4-0.6";

/// The report as a table: beside each figure what it is over the first, and what that usually is.
fn table(report: &Report) -> String {
    let elements = &report.elements;
    let first = elements.first().map_or(f64::NAN, |row| row.ns.least);
    let mut lines = vec![format!(
        "{:<52}{:>9}{:>9}{:>8}   {}",
        format!("lanes {}; ns of thread CPU", report.lanes),
        "median",
        "least",
        "ratio",
        "usual ratio"
    )];
    let mut line = |name: &str, Spread { median, least }: Spread, usual: &str| {
        let line = format!("  {name:<50}{median:>9.1}{least:>9.1}{:>8.2}   {usual}", least / first);
        lines.push(line.trim_end().to_owned());
    };
    for (Row { name, ns, .. }, usual) in elements.iter().zip(USUAL_OF_ELEMENTS) {
        line(&format!("element: {name}"), *ns, usual);
    }
    line("surface node in contact, sorts aside", report.contact_node_ns, USUAL_OF_CONTACT);
    let alone = |value: f64| Spread { median: value, least: value };
    for (name, ns) in [
        ("pair of contact that a cycle looks at", report.pair_ns),
        ("surface node in a sort", report.sort_node_ns),
    ] {
        line(
            name,
            alone(ns.unwrap_or(f64::NAN)),
            if ns.is_none() { "not measured: none was there" } else { "" },
        );
    }
    line("short message over loopback, at each end", alone(report.message_ns), "");
    lines.push(format!(
        "  {:<50}{:>9.3}{:>9.3}",
        "byte of a long message, at each end", report.byte_ns, report.byte_ns
    ));
    let [joined, touching] = report.serial_shares.map(|share| 100.0 * share.median);
    lines.push("threads (%)".to_owned());
    let mut share = |name: &str, percent: f64, usual: &str| {
        lines.push(format!("  {name:<50}{percent:>9.1}{:>17}   {usual}", ""));
    };
    share("of a cycle of joined plates by one thread alone", joined, "0.6-1.5");
    share("of a cycle of plates in contact by one alone", touching, "2-3");
    if let Some(Spread { median, .. }) = report.two_threads {
        share("two threads, of twice one (wall clock)", 100.0 * median, "60-95");
    }
    let speed = report.speed_of_a_thread;
    lines.push(format!("speed of a thread, as `worker --speed auto` says: {speed:.2}, where 1 is {SPEED_ONE} ns in the first row"));
    lines.join("\n") + "\n"
}

/// Speed of so many threads of which each takes `ns` for an element-cycle, to two digits behind the point.
fn speed_of(ns: f64, threads: u32) -> f64 {
    let speed = SPEED_ONE / ns * f64::from(threads);
    (100.0 * speed).round().max(1.0) / 100.0
}

/// The speed of this machine with so many threads: 1 is a thread that takes 100 ns for an element-cycle of benchmark 1.
/// The least of three runs of 8,000 elements counts.
///
/// # Errors
/// A run that fails.
pub fn speed(threads: u32) -> Result<f64, String> {
    let joined = model(&plates(21, None, 0.0), false)?;
    let mut least = f64::INFINITY;
    for _ in 0..3 {
        least = least.min(once(&joined, 1, None)?.element_ns);
    }
    Ok(speed_of(least, threads))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_read_and_faults_say_what_was_read() {
        assert_eq!("auto".parse(), Ok(Speed::Auto));
        assert_eq!("0.5".parse(), Ok(Speed::Given(0.5)));
        let fault = "speed \"fast\": a number, or auto to measure it".to_owned();
        assert_eq!("fast".parse::<Speed>(), Err(fault));
    }

    #[test]
    fn all_cases_run_and_explicit_connectivity_is_the_grid_s() {
        for (_, laws) in LAWS {
            let taken = once(&model(&plates(6, Some(laws), 0.0), false).expect("a sound deck"), 1, None);
            assert!(taken.expect("a run to its end").element_ns > 0.0);
        }
        let job_view = model(&shells(6), false).expect("a sound deck");
        assert_eq!(job_view.mesh.n_elements(), 7 * 2 * 15);
        assert!(once(&job_view, 1, None).expect("a run to its end").element_ns > 0.0);
        let [grid, list] = [false, true].map(|explicit| {
            let model = model(&plates(6, None, 0.1), explicit).expect("a sound deck");
            let parts = &model.mesh.parts;
            (0..parts[1].n_elements()).map(|e| parts[1].corners(e)).collect::<Vec<_>>()
        });
        assert_eq!(grid, list);
    }

    #[test]
    fn every_line_of_a_small_bench_is_a_measured_figure() {
        let report = measured(1, 6, Some(Width::Scalar)).expect("all of its runs end");
        assert_eq!((report.lanes.as_str(), report.elements.len()), ("scalar", 7));
        let of_elements = report.elements.iter().map(|row| (row.name.as_str(), row.ns.least));
        let others = [
            ("contact", report.contact_node_ns.least),
            ("pair", report.pair_ns.unwrap_or(f64::NAN)),
            ("sort", report.sort_node_ns.unwrap_or(f64::NAN)),
            ("message", report.message_ns),
            ("speed", report.speed_of_a_thread),
        ];
        for (name, ns) in of_elements.chain(others) {
            assert!(ns > 0.0 && ns.is_finite(), "{name}: {ns} ns");
        }
        let lines = 1 + 7 + 5 + 1 + 2 + 1 + usize::from(report.two_threads.is_some());
        assert_eq!(table(&report).lines().count(), lines, "{}", table(&report));
    }

    #[test]
    fn a_thread_of_fifty_nanoseconds_has_speed_two() {
        assert_eq!(speed_of(50.0, 1), 2.0);
        assert_eq!(speed_of(80.0, 2), 2.5);
        assert_eq!(speed_of(1e9, 1), 0.01);
    }
}
