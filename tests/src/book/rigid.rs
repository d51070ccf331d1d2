//! Rigid bodies: a free top, a ball on a block, a mass on the end of a bar.

use crate::{
    case::Figures,
    solve::{Solved, cross, model, run},
};
use deck::model::Model;

fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|c| c * c).sum::<f64>().sqrt()
}

pub(super) fn a_free_top_precesses_after_euler(figures: &mut Figures) {
    // Twice as long as wide, spun about an axis 17 degrees off its own.
    let model = model(
        "title = \"top\"\nunits = \"SI\"\n[control]\nend_time = 0.04\n\
         [[part]]\nname = \"top\"\nmaterial = \"STEEL_4340\"\nvelocity = [3, 0, 1]\n\
         box = { origin = [0, 0, 0], size = [0.1, 0.1, 0.2], cells = [2, 2, 4] }\n\
         [[rigid]]\nparts = [\"top\"]\nstart_spin = [300, 0, 1000]\n[output]\nhistory_cycles = 1\n",
    );
    let (body, mesh) = (model.setup.bodies[0].clone(), model.mesh.clone());
    let solved = run(model);
    // The axis of the body turns about the momentum at |L| over the inertia about a cross axis.
    let momentum = body.start.momentum;
    let angle = norm(momentum) / body.inertia[0] * solved.state.time;
    let unit = momentum.map(|l| l / norm(momentum));
    let (axis, side) = ([0.0, 0.0, 1.0], cross(unit, [0.0, 0.0, 1.0]));
    let expected: [f64; 3] = std::array::from_fn(|a| {
        axis[a] * angle.cos() + side[a] * angle.sin() + unit[a] * unit[2] * (1.0 - angle.cos())
    });
    let at = |x: [f64; 3]| {
        let near = |p: &[f64; 3]| (0..3).all(|a| (p[a] - x[a]).abs() < 1e-9);
        solved.state.x[mesh.positions.iter().position(near).expect("a node")]
    };
    let (foot, head) = (at([0.05, 0.05, 0.0]), at([0.05, 0.05, 0.2]));
    let found: [f64; 3] = std::array::from_fn(|a| (head[a] - foot[a]) / 0.2);
    let off = norm(std::array::from_fn(|a| found[a] - expected[a]));
    println!("{} cycles, {:.2} turns", solved.state.cycle, angle / std::f64::consts::TAU);
    figures.add("top: its axis after three turns of it", off);
    let length = |a: u32, b: u32| {
        let between = |x: &[[f64; 3]]| norm(std::array::from_fn(|i| x[a as usize][i] - x[b as usize][i]));
        between(&solved.state.x) / between(&mesh.positions) - 1.0
    };
    let n = mesh.n_nodes() as u32;
    let strain = (1..n).map(|b| length(0, b).abs()).fold(0.0, f64::max);
    figures.add("top: strain", strain);
    let end = solved.outcome.run_totals.bodies[0];
    let change = norm(std::array::from_fn(|a| end.momentum[a] - momentum[a])) / norm(momentum);
    figures.add("top: angular momentum", change);
    figures.add("top: momentum", solved.outcome.run_totals.momentum_error());
    let kinetic = |row: &master::results::history::HistoryRow| row.kinetic;
    let (low, high) = solved.rows[1..]
        .iter()
        .map(kinetic)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), k| (low.min(k), high.max(k)));
    figures.add("top: energy", high / low - 1.0);
}

/// Momentum and angular momentum of all, and the sums of their magnitudes over nodes and bodies.
fn momenta(
    model: &Model,
    mass: &[f64],
    x: &[[f64; 3]],
    v: &[[f64; 3]],
    bodies: &[mechanics::rigid::State],
) -> ([[f64; 3]; 2], [f64; 2]) {
    let (mut linear, mut angular, mut scales) = ([0.0; 3], [0.0; 3], [0.0; 2]);
    let mut add = |m: f64, x: [f64; 3], v: [f64; 3], own: [f64; 3]| {
        let turn = cross(x, v);
        scales[0] += m * norm(v);
        scales[1] += m * norm(turn) + norm(own);
        for a in 0..3 {
            linear[a] += m * v[a];
            angular[a] += m * turn[a] + own[a];
        }
    };
    let rigid = |n: &usize| model.setup.bodies.iter().any(|b| b.nodes.binary_search(&(*n as u32)).is_ok());
    for n in (0..x.len()).filter(|n| !rigid(n)) {
        add(mass[n], x[n], v[n], [0.0; 3]);
    }
    for (body, state) in model.setup.bodies.iter().zip(bodies) {
        add(body.mass, state.centre, state.velocity, state.momentum);
    }
    ([linear, angular], scales)
}

pub(super) fn a_rigid_ball_that_strikes_a_block_keeps_both_momenta(figures: &mut Figures) {
    let solved = run(model(
        "title = \"ball on block\"\nunits = \"SI\"\n[control]\nend_time = 6e-4\n\
         [[part]]\nname = \"ball\"\nmaterial = \"STEEL_4340\"\nvelocity = [2, 0, -10]\n\
         sphere = { centre = [0.004, 0.001, 0.0115], radius = 0.01, cells = [4, 4] }\n\
         [[part]]\nname = \"block\"\nmaterial = { density = 2700, eos = { type = \"linear\", bulk = 70e9 }, strength = { type = \"elastic\", shear = 26e9 } }\n\
         box = { origin = [-0.02, -0.02, -0.02], size = [0.04, 0.04, 0.02], cells = [12, 12, 6] }\n\
         [[rigid]]\nparts = [\"ball\"]\nstart_spin = [0, 500, 200]\n\
         [contact]\ngap_fraction = 0.3\nstiffness = 1\n[output]\nhistory_cycles = 10\n",
    ));
    let Solved { model, state, outcome, .. } = &solved;
    let start: Vec<_> = model.setup.bodies.iter().map(|body| body.start).collect();
    let (before, _) = momenta(model, &state.mass, &model.mesh.positions, &model.velocity, &start);
    let (after, scales) = momenta(model, &state.mass, &state.x, &state.v, &outcome.run_totals.bodies);
    let change = |k: usize| norm(std::array::from_fn(|a| after[k][a] - before[k][a])) / scales[k];
    let ball = outcome.run_totals.bodies[0];
    println!("{} cycles, ball leaves at {:?}, spin {:?}", state.cycle, ball.velocity, ball.spin);
    assert!(ball.velocity[2] > 0.0 && outcome.run_totals.worst_penetration > 0.0, "it bounces");
    figures.add("rigid ball: momentum", change(0));
    figures.add("rigid ball: angular momentum", change(1));
    figures.add("rigid ball: energy error", outcome.run_totals.last.error);
    figures.add("rigid ball: penetration (gaps)", outcome.run_totals.worst_penetration);
}

pub(super) fn a_rigid_mass_on_the_end_of_a_bar_slows_down_after_saint_venant(figures: &mut Figures) {
    // Without Poisson's ratio waves have one axis.
    let solved = run(model(
        "title = \"mass on bar\"\nunits = \"SI\"\n[control]\nend_time = 3e-5\n\
         [[material]]\nname = \"bar\"\ndensity = 8000\neos = { type = \"linear\", bulk = 66.66666666666667e9 }\nstrength = { type = \"elastic\", shear = 100e9 }\n\
         [[part]]\nname = \"mass\"\nmaterial = \"bar\"\nvelocity = [10, 0, 0]\n\
         box = { origin = [-0.05, 0, 0], size = [0.05, 0.002, 0.002], cells = [10, 2, 2] }\n\
         [[part]]\nname = \"bar\"\nmaterial = \"bar\"\n\
         box = { origin = [0, 0, 0], size = [0.2, 0.002, 0.002], cells = [200, 2, 2] }\n\
         [[rigid]]\nparts = [\"mass\"]\nvelocity = { y = 0, z = 0 }\nspin = { x = 0, y = 0, z = 0 }\n\
         [[join]]\nparts = \"all\"\n[output]\nhistory_cycles = 1\n[[gauge]]\nname = \"mass\"\npart = \"mass\"\npoint = [-0.05, 0, 0]\n",
    ));
    // rho c A v slows rho L A, on which half an element of the bar hangs, at rest before.
    let sound = (200e9_f64 / 8000.0).sqrt();
    let (long, hung) = (0.05, 0.0005);
    let formula = |t: f64| 10.0 * long / (long + hung) * (-sound * t / (long + hung)).exp();
    let at = |time: f64| {
        let row = solved.rows.iter().min_by(|a, b| (a.time - time).abs().total_cmp(&(b.time - time).abs()));
        let row = row.expect("rows");
        (row.gauges[0].v[0], row.time)
    };
    for (name, time) in [("early", 1e-5), ("late", 3e-5)] {
        let (v, t) = at(time);
        figures.add(&format!("mass on bar @ velocity over that of the formula, {name}"), v / formula(t));
    }
    figures.add("mass on bar: energy error", solved.outcome.run_totals.last.error);
}
