//! Grind time: nanoseconds of thread CPU time per element per cycle, on one thread.
//!
//! First whole cycles of benchmark 1 (a steel plate on an aluminium plate, joined, 500 m/s; Johnson-Cook and shock) by
//! number of elements, topology and lane width: elements, shared sums, integration and votes, as a worker runs them; beside them
//! a plate of shells with five points that is bent until it yields. Then the element kernel alone by laws, topology and lane
//! width, on a strained plate of 27,000 elements. On request the same cycles on one thread and on two in turn.
//!
//! `cargo bench -p mechanics --bench kernels`; after `--` a word chooses: `cycles`, `kernels`, `threads`, `quiet`, or a number of
//! elements; `assumed` beside it gives solids assumed strains, the default of decks, in place of viscous control. `quiet` compares builds on a machine that others use: of each chunk of sets the least over many cycles; names of lane
//! widths after it choose columns. `4000000` is on request only, for its memory.

#![expect(clippy::disallowed_methods, reason = "bodies of measurements, whose digests nobody compares")]

use laws::{SHOCK, johnson_cook, steel, steels};
use mechanics::{
    block::Block,
    constraint::Constraint,
    cycle::{self, Domain, Interval, Meter, Plan, Subdomain},
    element::{
        ElementVote, Step, hex8,
        hourglass::{Hourglass, N_FORCES},
        shell4::{Rule, ShellStep, Shells},
    },
    exact::{Quanta, Quantum},
    initial,
    lanes::Width,
    material::{Eos, Failure, Heat, Material, Strength},
    mesh::{Mesh, Part, Section, Topology},
    piece::{Piece, Region, cut},
    setup::{Control, Setup},
    state::{N_FIELDS, field},
};
use std::sync::atomic::{AtomicU64, Ordering};

#[path = "kernels/laws.rs"]
mod laws;

/// Elements along each index.
const CELLS: [u32; 3] = [30, 30, 30];

/// Hourglass control of solids: viscous, or assumed strains where the command line has the word `assumed`.
fn control() -> Hourglass {
    if std::env::args().any(|word| word == "assumed") {
        Hourglass::ASSUMED_STRAIN
    } else {
        Hourglass::VISCOUS
    }
}

fn plate(material: &Material, explicit: bool) -> Piece {
    let [ni, nj, nk] = CELLS;
    let mut positions = Vec::new();
    for k in 0..=nk {
        for j in 0..=nj {
            for i in 0..=ni {
                let (x, y, z) = (f64::from(i), f64::from(j), f64::from(k));
                let bend = [(0.7 * y + z).sin(), (0.9 * z + x).sin(), (0.8 * x + y).sin()];
                positions
                    .push([x + 0.05 * bend[0], y + 0.05 * bend[1], z + 0.05 * bend[2]].map(|c| c * 0.01));
            }
        }
    }
    let n_elements = (ni * nj * nk) as usize;
    let part = Part {
        name: "plate".into(),
        material: 0,
        topology: Topology::Structured { cells: CELLS },
        nodes: (0..positions.len() as u32).collect(),
        element_ids: (0..n_elements as u32).collect(),
        hourglass: control(),
    };
    let mesh = Mesh { positions, node_ids: part.nodes.clone(), parts: vec![part], lumped: Vec::new() };
    let hexahedra: Vec<[u32; 8]> = (0..n_elements).map(|e| mesh.parts[0].corners(e)).collect();
    let initial_volume: Vec<f64> = hexahedra
        .iter()
        .map(|corners| hex8::volume(&corners.map(|node| mesh.positions[node as usize])))
        .collect();
    let mut fields: [Vec<f64>; N_FIELDS] = std::array::from_fn(|_| vec![0.0; n_elements]);
    fields[field::RELATIVE_VOLUME].fill(1.0);
    fields[field::TEMPERATURE].fill(material.initial_temperature());
    let n_nodes = mesh.n_nodes();
    Piece {
        part: 0,
        material: 0,
        topology: if explicit {
            Topology::Explicit { hexahedra }
        } else {
            Topology::Structured { cells: CELLS }
        },
        nodes: (0..n_nodes as u32).collect(),
        elements: (0..n_elements as u32).collect(),
        // Enough to yield everywhere within the first steps.
        v: mesh
            .positions
            .iter()
            .map(|x| [2000.0 * x[1] - 500.0 * x[0], 1000.0 * x[2], 400.0 * x[2]])
            .collect(),
        x: mesh.positions,
        mass: vec![material.density * 1e-6; n_nodes],
        constraint: vec![0; n_nodes],
        initial_volume,
        fields,
        erosion: None,
        history: Vec::new(),
        contact: Vec::new(),
        shells: mechanics::state::ShellState::default(),
        own: vec![vec![0.0; n_elements]; if control().is_elastic() { N_FORCES } else { 0 }],
        hourglass: control(),
    }
}

/// Thread CPU time in seconds.
fn now() -> f64 {
    system::clock::thread_cpu_ns() as f64 * 1e-9
}

/// Step of the kernels alone.
const DT: f64 = 2e-7;

fn step() -> Step {
    Step {
        dt: DT,
        linear_viscosity: 0.2,
        quadratic_viscosity: 1.0,
        force_quantum: Quantum::for_reference(2e8, 42),
        energy_quantum: Quantum::for_reference(1e9, 40),
        arm: 1.0,
    }
}

/// Moves all nodes by one step and clears the forces.
fn drift(block: &mut Block) {
    for (x, v) in block.x.iter_mut().zip(&block.v) {
        for (x, v) in x.iter_mut().zip(v) {
            *x += DT * v;
        }
    }
    block.clear_forces();
}

/// Median and least over cycles of the nanoseconds per element, forces cleared, nodes moved at constant velocity.
/// On a machine that others use too, the least is the steadier of the two.
fn grind(material: &Material, explicit: bool, width: Width) -> [f64; 2] {
    let mut block = Block::new(&plate(material, explicit));
    let sets = 0..block.n_sets();
    let mut times: Vec<f64> = (0..60)
        .map(|_| {
            drift(&mut block);
            let start = now();
            let mut vote = ElementVote::default();
            block.compute(material, std::slice::from_ref(&sets), &step(), width, &mut vote);
            let spent = now() - start;
            assert!(vote.fault.is_none(), "fault {:?}", vote.fault);
            spent
        })
        .collect();
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]].map(|time| time * 1e9 / f64::from(CELLS.iter().product::<u32>()))
}

/// Nanoseconds per element of the kernel alone, wall clock, each chunk of 8 sets by its least of 80 cycles, the first twenty, in
/// which not all elements yield, left out: what neighbours take shows in most cycles, but hardly in all of them for one chunk.
fn quiet(material: &Material, explicit: bool, width: Width) -> f64 {
    let mut block = Block::new(&plate(material, explicit));
    let chunks: Vec<_> = (0..block.n_sets()).step_by(8).map(|s| s..(s + 8).min(block.n_sets())).collect();
    let mut least = vec![f64::INFINITY; chunks.len()];
    for cycle in 0..100 {
        drift(&mut block);
        let mut vote = ElementVote::default();
        for (chunk, least) in chunks.iter().zip(&mut least) {
            let start = std::time::Instant::now();
            block.compute(material, std::slice::from_ref(chunk), &step(), width, &mut vote);
            let spent = start.elapsed().as_secs_f64();
            *least = if cycle >= 20 { spent.min(*least) } else { *least };
        }
        assert!(vote.fault.is_none(), "fault {:?}", vote.fault);
    }
    least.iter().sum::<f64>() * 1e9 / f64::from(CELLS.iter().product::<u32>())
}

/// How the elements of the plates are given.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Structured,
    /// Written out, row by row.
    Explicit,
    /// Written out in the order of a curve that goes from cube to cube: nothing is loaded in a run.
    Scattered,
    /// One plate of shells.
    Shells,
}

/// Layers of the one plate of shells, in place of those below and above.
const FLAT: (u32, u32) = (0, 0);

/// How far along that curve an element is.
fn along_curve(place: [u32; 3]) -> u64 {
    let level = |bit: u32| -> u64 { (0..3).map(|a| u64::from(place[a] >> bit & 1) << a).sum() };
    (0..16).map(|bit| level(bit) << (3 * bit)).sum()
}

/// The domain of benchmark 1, whose plates have `below` and `above` layers of `side` by `side` elements, and the number
/// of elements; each plate is cut into `n_pieces`.
fn plates(
    side: u32,
    (below, above): (u32, u32),
    kind: Kind,
    width: Width,
    n_pieces: usize,
) -> (Domain, Quanta, usize) {
    let row = side + 1;
    let plane = row * row;
    let n_nodes = plane * (below + above + 1);
    let size = 0.01;
    let place = |n: u32| [n % row, n / row % row, n / plane].map(|c| f64::from(c) * size);
    let positions: Vec<[f64; 3]> = (0..n_nodes).map(place).collect();
    let part = |name: &str, material: u32, layers: u32, first: u32| {
        let cells = [side, side, layers];
        let n_elements = side * side * layers;
        let mut part = Part {
            name: name.into(),
            material,
            topology: Topology::Structured { cells },
            nodes: (0..plane * (layers + 1)).collect(),
            element_ids: (0..n_elements).collect(),
            hourglass: control(),
        };
        if kind != Kind::Structured {
            let mut order: Vec<u32> = (0..n_elements).collect();
            if kind == Kind::Scattered {
                order.sort_by_key(|&e| along_curve([e % side, e / side % side, e / (side * side)]));
            }
            let hexahedra = order.iter().map(|&e| part.corners(e as usize)).collect();
            part.topology = Topology::Explicit { hexahedra };
        }
        part.nodes.iter_mut().for_each(|n| *n += first * plane);
        part
    };
    let sheet = || {
        let quads = (0..side * side).map(|e| e / side * row + e % side);
        let section = Section::of(0.2 * size, Rule::Gauss(5));
        Part {
            name: "sheet".into(),
            material: 1,
            topology: Topology::Shells {
                quads: quads.map(|n| [n, n + 1, n + row + 1, n + row]).collect(),
                section,
                thicknesses: Vec::new(),
            },
            nodes: (0..plane).collect(),
            element_ids: (0..side * side).collect(),
            hourglass: Hourglass::VISCOUS,
        }
    };
    let parts = match kind {
        Kind::Shells => vec![sheet()],
        _ => vec![part("target", 0, below, 0), part("projectile", 1, above, below)],
    };
    let mesh = Mesh { node_ids: (0..n_nodes).collect(), positions, parts, lumped: Vec::new() };
    let steel = [7896.0, 4569.0, 1.49, 2.17, 81.8e9, 350e6, 275e6, 0.36, 0.022, 1811.0, 452.0];
    let aluminium = [2785.0, 5328.0, 1.338, 2.0, 27.6e9, 265e6, 426e6, 0.34, 0.015, 775.0, 875.0];
    let materials = [("aluminium", aluminium), ("steel", steel)].map(|(name, constants)| {
        let [density, c0, s, gamma, shear, a, b, n, c, t_melt, specific_heat] = constants;
        let (m, t_room, rate0) = (1.0, 300.0, 1.0);
        Material {
            name: name.into(),
            density,
            eos: Eos::Shock { c0, s, gamma },
            strength: Strength::JohnsonCook {
                shear,
                a,
                b,
                n,
                c,
                m,
                t_melt,
                t_room,
                specific_heat,
                rate0,
                heat: Heat::PlasticWork,
            },
            failure: Failure::None,
        }
    });
    let setup = Setup {
        materials: materials.into(),
        control: Control {
            end_time: 1.0,
            end_cycle: u64::MAX,
            safety_factor: 0.6666,
            growth: 1.05,
            energy_error: 0.5,
            time_step_floor: 0.0,
            linear_viscosity: 0.2,
            quadratic_viscosity: 1.0,
            sort_lag: 3,
            plan_interval: 100,
        },
        contact: None,
        constraints: vec![Constraint::default()],
        walls: Vec::new(),
        bodies: Vec::new(),
        switches: Vec::new(),
        joints: Vec::new(),
        detonations: Vec::new(),
        loads: Default::default(),
        erosion: Default::default(),
    };
    // The upper plate falls; a sheet is bent in waves of twenty elements.
    let velocity = |[x, y, z]: [f64; 3]| match kind {
        Kind::Shells => [0.0, 0.0, 60.0 * (31.0 * x).sin() * (27.0 * y).sin()],
        _ => [0.0, 0.0, if z > size * (f64::from(below) + 0.5) { -500.0 } else { 0.0 }],
    };
    let velocity: Vec<[f64; 3]> = mesh.positions.iter().map(|&x| velocity(x)).collect();
    let state = initial::state(&mesh, &setup, &velocity, &vec![0; mesh.n_nodes()]).expect("sound cubes");
    let quanta = initial::quanta(&mesh, &setup, &state);
    let subdomains: Vec<Subdomain> = (0..mesh.parts.len())
        .map(|p| {
            let region = match mesh.parts[p].topology {
                Topology::Structured { cells } => Region::Cells { low: [0; 3], high: cells },
                _ => Region::List((0..mesh.parts[p].n_elements() as u32).collect()),
            };
            let last = below * plane;
            let unowned = if p == 1 { (last..last + plane).collect() } else { Vec::new() };
            let pieces = region.split(n_pieces).iter().map(|region| cut(&mesh, &state, p, region)).collect();
            Subdomain { id: p as u32, pieces, unowned, surface: Vec::new() }
        })
        .collect();
    let n_elements = mesh.n_elements();
    let n_parts = mesh.parts.len();
    let mut domain = Domain::new(setup, n_parts, quanta, (subdomains, 0), &[], width);
    let plan = Plan { moments: kind == Kind::Shells, ..Plan::default() };
    domain.install(&plan, &[], &Silent).expect("a plan without other workers");
    (domain, quanta, n_elements)
}

/// Books nothing: the bench reads the clock itself.
struct Silent;

impl Meter for Silent {
    fn start(&self) -> u64 {
        0
    }

    fn stop(&self, _mark: u64, _contact: bool) {}
}

/// Counts thread-CPU time of the calling thread in work that is dealt to all (ns).
#[derive(Default)]
struct Dealt(AtomicU64);

impl Meter for Dealt {
    fn start(&self) -> u64 {
        (now() * 1e9) as u64
    }

    fn stop(&self, _mark: u64, _contact: bool) {}

    fn dealt(&self, mark: u64) {
        self.0.fetch_add(self.start().saturating_sub(mark), Ordering::Relaxed);
    }
}

/// Median and least over `n_cycles` cycles of the nanoseconds per element of a whole cycle by `clock` (seconds), from the
/// impact on.
fn whole_cycle(domain: (Domain, Quanta, usize), n_cycles: usize, clock: &dyn Fn() -> f64) -> [f64; 2] {
    let n_elements = domain.2 as f64;
    let mut times = cycle_times(domain, n_cycles, clock, &Silent);
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]].map(|time| time * 1e9 / n_elements)
}

/// Times of whole cycles by `clock` (seconds), from the impact on; `meter` hears of them.
fn cycle_times(
    (mut domain, quanta, _): (Domain, Quanta, usize),
    n_cycles: usize,
    clock: &dyn Fn() -> f64,
    meter: &dyn Meter,
) -> Vec<f64> {
    let mut vote = domain.prepare(&Silent);
    let mut dt_previous = 0.0;
    (0..n_cycles)
        .map(|cycle| {
            let limit = 0.6666 * vote.courant.min(vote.volume_limit);
            let dt = if cycle == 0 { 0.5 * limit } else { limit.min(1.05 * dt_previous) };
            let now = Interval { time: 0.0, dt_previous, dt, quanta };
            let start = clock();
            vote = cycle::step(&mut domain, &now, &[], |_, partials| partials, meter)
                .expect("totals of the exchange");
            let spent = clock() - start;
            assert!(vote.fault.is_none(), "fault {:?}", vote.fault);
            dt_previous = dt;
            spent
        })
        .collect()
}

/// The table of whole cycles; `only` chooses a number of elements.
fn cycles(only: Option<usize>) {
    println!("whole cycle of benchmark 1, ns per element and cycle, median and (least)");
    let widths: Vec<Width> =
        Width::ALL.into_iter().filter(|&width| width != Width::Scalar && width.available()).collect();
    let row = |first: &str, name: &str, of: &[String]| {
        let columns: String = of.iter().map(|column| format!("{column:>16}")).collect();
        println!("{first:>9}  {name:<22}{columns}");
    };
    row("elements", "elements are", &widths.iter().map(Width::to_string).collect::<Vec<_>>());
    let shapes = [
        (30, (20, 10), Kind::Structured, 200),
        (40, (30, 10), Kind::Structured, 120),
        (40, (30, 10), Kind::Explicit, 120),
        (40, (30, 10), Kind::Scattered, 120),
        (60, (40, 20), Kind::Structured, 50),
        (100, (75, 25), Kind::Structured, 20),
        (160, (120, 37), Kind::Structured, 8),
        (164, FLAT, Kind::Shells, 200),
        (253, FLAT, Kind::Shells, 120),
        (465, FLAT, Kind::Shells, 50),
        (1000, FLAT, Kind::Shells, 20),
    ];
    for (side, layers, kind, n_cycles) in shapes {
        let n_elements = (side * side * (layers.0 + layers.1).max(1)) as usize;
        let about = |only: usize| n_elements.abs_diff(only) <= only / 50;
        if !only.map_or(n_elements < LARGE, about) {
            continue;
        }
        let column = |&width: &Width| {
            let [median, least] = whole_cycle(plates(side, layers, kind, width, 1), n_cycles, &now);
            format!("{median:.1} ({least:.1})")
        };
        let columns: Vec<String> = widths.iter().map(column).collect();
        let name = match kind {
            Kind::Structured => "structured",
            Kind::Explicit => "explicit, in rows",
            Kind::Scattered => "explicit, in no rows",
            Kind::Shells => "shells, five points",
        };
        row(&n_elements.to_string(), name, &columns);
    }
}

/// Elements from which a size is measured on request only.
const LARGE: usize = 2_000_000;

/// Cycles of 64,000 elements by wall clock, on one thread and on two in turn.
fn threads() {
    println!(
        "64,000 elements, four blocks, wall-clock ns per element and cycle, median and (least); half of the first over the second"
    );
    let pools = [1, 2].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads"));
    let from = std::time::Instant::now();
    let wall = || from.elapsed().as_secs_f64();
    let mut found: Vec<f64> = (0..11)
        .map(|_| {
            let [one, two] = [0, 1].map(|i: usize| {
                let run =
                    || whole_cycle(plates(40, (30, 10), Kind::Structured, Width::best(), 2), 120, &wall);
                pools[i].install(run)
            });
            let efficiency = 0.5 * one[0] / two[0];
            println!("{:.1} ({:.1})  {:.1} ({:.1})  {efficiency:.3}", one[0], one[1], two[0], two[1]);
            efficiency
        })
        .collect();
    found.sort_by(f64::total_cmp);
    println!("median {:.3}, best {:.3}", found[5], found[10]);
    println!(
        "blocks of each plate on one thread: thread-CPU ns, and the share of a cycle that no other thread could take"
    );
    for n in [1, 2, 4, 8, 16] {
        let (domain, dealt) = (plates(40, (30, 10), Kind::Structured, Width::best(), n), Dealt::default());
        let n_elements = domain.2 as f64;
        let cycles = pools[0].install(|| cycle_times(domain, 120, &now, &dealt));
        let all: f64 = cycles.iter().sum();
        let ns = |seconds: f64| 1e9 * seconds / (n_elements * cycles.len() as f64);
        let share = 1.0 - dealt.0.into_inner() as f64 * 1e-9 / all;
        println!("{n:>3} {:>6.1} {share:.4}", ns(all));
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if words.iter().any(|word| word == "threads") {
        threads();
        return;
    }
    if words.iter().any(|word| word == "quiet") {
        quiet_table(&words);
        return;
    }
    // Blocks spread over the current pool: one of a single thread keeps all work on the clock.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| tables(&words));
}

fn tables(words: &[String]) {
    let only = words.iter().find_map(|word| word.parse().ok());
    let asks = |name: &str| words.iter().any(|word| word == name);
    if !asks("kernels") {
        cycles(only);
    }
    if only.is_none() && !asks("cycles") {
        kernels();
    }
}

/// The table of the quietest chunks; words that name lane widths choose columns.
fn quiet_table(words: &[String]) {
    println!("kernel alone, ns per element, quietest: structured, and written out");
    let named = |width: Width| words.contains(&width.to_string());
    let all = !Width::ALL.into_iter().any(named);
    let widths: Vec<Width> =
        Width::ALL.into_iter().filter(|&width| width.available() && (all || named(width))).collect();
    let row = |name: &str, of: &dyn Fn(Width) -> String| {
        let columns: String = widths.iter().map(|&width| format!("{:>20}", of(width))).collect();
        println!("{name:<34}{columns}");
    };
    row("laws", &|width| width.to_string());
    for material in steels() {
        row(&material.name, &|width| {
            let [rows, lists] = [false, true].map(|explicit| quiet(&material, explicit, width));
            format!("{rows:.1} {lists:.1}")
        });
    }
    let material = steel("shells, five points", SHOCK, johnson_cook(1.0));
    row(&material.name, &|width| format!("{:.1}", quiet_shells(&material, width)));
}

/// Nanoseconds per element of the kernel of shells alone, wall clock: a sheet of 256 that is bent until it yields, the least of 400
/// cycles.
fn quiet_shells(material: &Material, width: Width) -> f64 {
    let (side, size) = (16_u32, 0.01);
    let row = side + 1;
    let place = |n: u32| [n % row, n / row].map(|c| f64::from(c) * size);
    let x: Vec<[f64; 3]> = (0..row * row).map(place).map(|[x, y]| [x, y, 0.0]).collect();
    let corners: Vec<[u32; 4]> = (0..side * side)
        .map(|e| e / side * row + e % side)
        .map(|n| [n, n + 1, n + row + 1, n + row])
        .collect();
    let mut shells = Shells::new(&x, &corners, 0.2 * size, Rule::Gauss(5), material).expect("a steel sheet");
    for (v, [x, y, _]) in shells.v[2].iter_mut().zip(&x) {
        *v = 60.0 * (31.0 * x).sin() * (27.0 * y).sin();
    }
    let step = ShellStep {
        dt: DT,
        force_quantum: Quantum::for_reference(2e8, 42),
        moment_quantum: Quantum::for_reference(2e8, 42),
        energy_quantum: Quantum::for_reference(1e9, 40),
    };
    let mut least = f64::INFINITY;
    for cycle in 0..480 {
        for (x, v) in shells.x.iter_mut().zip(&shells.v) {
            for (x, v) in x.iter_mut().zip(v) {
                *x += DT * v;
            }
        }
        let start = std::time::Instant::now();
        let vote = shells.compute(&step, width);
        let spent = start.elapsed().as_secs_f64();
        assert!(vote.fault.is_none(), "fault {:?}", vote.fault);
        least = if cycle >= 80 { spent.min(least) } else { least };
    }
    least * 1e9 / f64::from(side * side)
}

/// The table of kernels.
fn kernels() {
    println!("element kernel alone, ns per element and cycle, median and (least)");
    println!("{:<34}{:<9}{:>16}{:>16}", "laws", "width", "structured", "explicit");
    for material in steels() {
        let name = &material.name;
        for width in Width::ALL {
            match width.require() {
                Ok(width) => {
                    let [structured, explicit] = [false, true].map(|explicit| {
                        let [median, least] = grind(&material, explicit, width);
                        format!("{median:.1} ({least:.1})")
                    });
                    println!("{name:<34}{:<9}{structured:>16}{explicit:>16}", width.to_string());
                }
                Err(error) => println!("{name:<34}{error}"),
            }
        }
    }
}
