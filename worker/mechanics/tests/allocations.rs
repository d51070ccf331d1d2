//! Compute threads allocate nothing in a cycle but what is sent: the packed forces and the vote.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicUsize, Ordering},
};

use mechanics::{
    constraint::Constraint,
    cycle::{Domain, Meter, Plan, Sets, Subdomain},
    initial,
    lanes::Width,
    load::Drive,
    material::{Eos, Failure, Heat, Material, Strength},
    mesh::{Mesh, Part, Topology},
    piece::{Region, cut},
    setup::{Control, Setup},
};

/// Counts the calls that take memory, on all threads.
struct Counting;

static CALLS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: everything is handed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// No clock.
struct Silent;

impl Meter for Silent {
    fn start(&self) -> u64 {
        0
    }

    fn stop(&self, _mark: u64, _contact: bool) {}
}

/// A block of 6 x 5 x 8 steel cubes that hits a symmetry plane, in four pieces, with half of its nodes exchanged.
fn domain() -> Domain {
    let cells = [6, 5, 8];
    let mut positions = Vec::new();
    for k in 0..=cells[2] {
        for j in 0..=cells[1] {
            positions.extend((0..=cells[0]).map(|i| [i, j, k].map(f64::from)));
        }
    }
    let n_nodes = positions.len() as u32;
    let part = Part {
        name: "bar".into(),
        material: 0,
        topology: Topology::Structured { cells },
        nodes: (0..n_nodes).collect(),
        element_ids: (0..cells.iter().product()).collect(),
        hourglass: mechanics::element::hourglass::Hourglass::VISCOUS,
    };
    let mesh = Mesh { positions, node_ids: part.nodes.clone(), parts: vec![part], lumped: Vec::new() };
    let strength = Strength::JohnsonCook {
        shear: 0.8,
        a: 3.5e-3,
        b: 2.7e-3,
        n: 0.36,
        c: 0.022,
        m: 1.0,
        t_melt: 1811.0,
        t_room: 300.0,
        specific_heat: 4.5e-6,
        rate0: 1e-6,
        heat: Heat::PlasticWork,
    };
    let eos = Eos::Shock { c0: 0.457, s: 1.49, gamma: 2.17 };
    let setup = Setup {
        materials: vec![Material {
            name: "steel".into(),
            density: 7.9,
            eos,
            strength,
            failure: Failure::None,
        }],
        control: Control {
            end_time: 1.0,
            end_cycle: 100,
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
        constraints: vec![
            Constraint::default(),
            Constraint { velocity: [None, None, Some(Drive::constant(0.0))], ..Constraint::default() },
        ],
        walls: Vec::new(),
        bodies: Vec::new(),
        switches: Vec::new(),
        joints: Vec::new(),
        detonations: Vec::new(),
        loads: Default::default(),
        erosion: Default::default(),
    };
    let base = (cells[0] + 1) * (cells[1] + 1);
    let held: Vec<u16> = (0..n_nodes).map(|n| u16::from(n < base)).collect();
    let velocity = vec![[0.0, 0.0, -0.05]; n_nodes as usize];
    let state = initial::state(&mesh, &setup, &velocity, &held).expect("sound cubes");
    let quanta = initial::quanta(&mesh, &setup, &state);
    let whole = Region::Cells { low: [0; 3], high: cells };
    let pieces = whole.split(4).iter().map(|region| cut(&mesh, &state, 0, region)).collect();
    let subdomain = Subdomain { id: 0, pieces, unowned: Vec::new(), surface: (0..base).collect() };
    let mut domain = Domain::new(setup, 1, quanta, (vec![subdomain], 0), &[], Width::best());
    let plan = Plan { exchange: (n_nodes / 2..n_nodes).collect(), ..Plan::default() };
    domain.install(&plan, &[], &Silent).expect("all nodes are held");
    domain
}

#[test]
fn a_cycle_allocates_the_packed_forces_and_the_vote_only() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    pool.install(|| {
        let mut domain = domain();
        let mut courant = domain.prepare(&Silent).courant;
        let mut dt_previous = 0.0;
        let mut counts = Vec::with_capacity(40);
        for cycle in 0..50 {
            let dt = 0.5 * courant;
            let before = CALLS.load(Ordering::Relaxed);
            domain.contact(dt_previous, &Silent);
            domain.elements(Sets::Border, dt_previous, &Silent);
            let after_border = CALLS.load(Ordering::Relaxed);
            let partials = domain.partials(&Silent);
            let after_partials = CALLS.load(Ordering::Relaxed);
            domain.elements(Sets::Interior, dt_previous, &Silent);
            let after_interior = CALLS.load(Ordering::Relaxed);
            let vote = domain.integrate(&partials, dt_previous, dt, &[], &Silent).expect("totals of all");
            let after = CALLS.load(Ordering::Relaxed);
            assert!(vote.fault.is_none() && vote.parts[0].internal > 0.0 || cycle == 0);
            // The first cycles fill the queues of the pool.
            if cycle >= 10 {
                let elements = after_border - before + after_interior - after_partials;
                counts.push([elements, after_partials - after_border, after - after_interior]);
            }
            courant = vote.courant;
            dt_previous = dt;
        }
        // The pool's queues may grow in any single cycle, but not in most of them.
        let usual = |phase: usize| {
            let mut counts: Vec<_> = counts.iter().map(|count| count[phase]).collect();
            counts.sort_unstable();
            counts[3 * counts.len() / 4]
        };
        assert_eq!(usual(0), 0, "allocations by elements");
        assert_eq!(usual(1), 1, "by the packed forces");
        // The vote has one list of parts and one of extents.
        assert!(usual(2) <= 2, "{} by integration", usual(2));
    });
}
