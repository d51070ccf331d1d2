//! What contact costs: nanoseconds of thread CPU time, on one thread.
//!
//! Two plates of 40 x 40 columns, 64,000 elements, one gap apart: benchmark 2. The sort per surface node, with and without
//! self-interaction; then the force per surface node and per candidate pair and cycle where the plates lie on each
//! other, nodes over nodes, nodes over faces, and faces warped. Positions stay, so the list of near pairs is taken once.
//!
//! `cargo bench -p mechanics --bench contact`.

#![expect(clippy::disallowed_methods, reason = "bodies of measurements, whose digests nobody compares")]

use mechanics::{
    contact::{Batch, Contact, Exclusions, Surface, WorkUnit, sort},
    exact::Quantum,
    lanes::Width,
    mesh::Mesh,
};
use world::{add_block, materials, on_surface, settings, without_self};

#[expect(dead_code, reason = "the tests of contact use all of it")]
#[path = "../tests/contact/world.rs"]
mod world;

/// Gap and slack over the side of an element.
const GAP: f64 = 0.1;
const SLACK: f64 = 0.5;

/// Thread CPU time in seconds.
fn now() -> f64 {
    system::clock::thread_cpu_ns() as f64 * 1e-9
}

/// Median and least of the nanoseconds of `n` calls.
fn times(n: usize, mut call: impl FnMut()) -> [f64; 2] {
    let mut times: Vec<f64> = (0..n)
        .map(|_| {
            let start = now();
            call();
            (now() - start) * 1e9
        })
        .collect();
    times.sort_by(f64::total_cmp);
    [times[n / 2], times[0]]
}

fn main() {
    let mut mesh = Mesh::default();
    add_block(&mut mesh, [40, 40, 30], [0.0; 3], 1.0);
    add_block(&mut mesh, [40, 40, 10], [0.0, 0.0, 30.0 + GAP], 1.0);
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let n_nodes = surface.nodes.len() as f64;
    println!("{n_nodes} surface nodes; ns, median and (least)");
    let all = settings(2, GAP, SLACK);
    let apart = without_self(all.clone());
    for (title, settings) in [("sort, with self-interaction", &all), ("sort", &apart)] {
        let [median, least] = times(60, || {
            std::hint::black_box(sort(&surface, &x, settings, &Exclusions::default()));
        });
        println!("{title:<30}{:>8.1} ({:.1}) per surface node", median / n_nodes, least / n_nodes);
    }
    let units = sort(&surface, &x, &apart, &Exclusions::default());
    let units: Vec<&WorkUnit> = units.iter().collect();
    let batch = Batch::gather(&surface, &units, &|_| 1.0, &Exclusions::default());
    let quantum = Quantum::for_reference(1.0, 42);
    for (title, offset, waves) in [("on corners", 0.0, 0.0), ("on faces", 0.37, 0.0), ("warped", 0.37, 0.02)]
    {
        let mut x = [0, 1, 2]
            .map(|a| batch.nodes.iter().map(|n| mesh.positions[n.global as usize][a]).collect::<Vec<f64>>());
        for (i, node) in batch.nodes.iter().enumerate() {
            let wave = waves * (1.3 * x[0][i]).sin() * (0.9 * x[1][i]).cos();
            let upper = f64::from(node.part);
            x[0][i] += offset * upper;
            x[1][i] += offset * upper;
            x[2][i] += wave - 0.03 * upper;
        }
        let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
        let [built, _] = times(20, || {
            std::hint::black_box(Contact::new(&batch, &apart, &x, Width::best()));
        });
        let mut contact = Contact::new(&batch, &apart, &x, Width::best());
        let mut vote = contact.forces(&x, &x, 1.0, quantum, quantum, &mut f);
        let [median, least] = times(200, || vote = contact.forces(&x, &x, 1.0, quantum, quantum, &mut f));
        let (pairs, hits) = (vote.pairs as f64, vote.hits as f64);
        println!(
            "force, {title}: {pairs} pairs, {hits} hits; set-up {:.1} per surface node",
            built / n_nodes
        );
        for (unit, n) in [("surface node", n_nodes), ("candidate pair", pairs), ("hit", hits)] {
            println!("{:<30}{:>8.1} ({:.1}) per {unit} and cycle", "", median / n, least / n);
        }
    }
}
