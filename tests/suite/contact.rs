//! Contact through the whole system: debris, bodies thrown at each other, meshes that do not match, plates.

use mechanics::state::{GlobalState, field};
use tests::{
    case::Sheet,
    checker::intruders,
    solve::{Crew, Solved, mean, model, run, solve},
};

/// Reproducible numbers from -1 to 1.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Linear and angular momentum, each by axis, and the sums of their magnitudes over the nodes.
fn momenta(mass: &[f64], x: &[[f64; 3]], v: &[[f64; 3]]) -> ([f64; 6], [f64; 2]) {
    let mut sums = [0.0; 6];
    let mut scales = [0.0; 2];
    for ((m, x), v) in mass.iter().zip(x).zip(v) {
        let turn = [x[1] * v[2] - x[2] * v[1], x[2] * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]];
        for a in 0..3 {
            sums[a] += m * v[a];
            sums[3 + a] += m * turn[a];
        }
        let norm = |c: &[f64; 3]| c.iter().map(|c| c * c).sum::<f64>().sqrt();
        scales[0] += m * norm(v);
        scales[1] += m * norm(&turn);
    }
    (sums, scales)
}

#[test]
fn eight_bodies_that_hit_each_other_keep_both_momenta() {
    let mut deck = String::from(
        "title = \"debris\"\nunits = \"SI\"\n[control]\nend_cycle = 2000\nend_time = 1\n\
         [contact]\ngap_length = 0.0002\nself_interaction = \"all\"\n",
    );
    let mut draws = Draws(7);
    for body in 0..8 {
        let centre = [0, 1, 2].map(|a| 0.0045 * if body >> a & 1 == 0 { -1.0 } else { 1.0 });
        let axis = [draws.next(), draws.next(), draws.next() + 2.0];
        deck += &format!(
            "[[part]]\nname = \"body {body}\"\nmaterial = \"STEEL_4340\"\n\
             box = {{ origin = [-0.002, -0.002, -0.003], size = [0.004, 0.004, 0.006], cells = [2, 2, 3] }}\n\
             rotate = {{ axis = {axis:?}, degrees = {:?} }}\ntranslate = {centre:?}\n",
            20.0 * draws.next()
        );
    }
    let mut model = model(&deck);
    for part in &model.mesh.parts {
        let centre = [0, 1, 2].map(|a| mean(part.nodes.iter().map(|&n| model.mesh.positions[n as usize][a])));
        // Towards the middle at 100 to 300 m/s, and turning.
        let speed = 200.0 + 100.0 * draws.next();
        let turn = [0; 3].map(|_| 2e4 * draws.next());
        for &n in &part.nodes {
            let r = [0, 1, 2].map(|a| model.mesh.positions[n as usize][a] - centre[a]);
            let spin = [
                turn[1] * r[2] - turn[2] * r[1],
                turn[2] * r[0] - turn[0] * r[2],
                turn[0] * r[1] - turn[1] * r[0],
            ];
            model.velocity[n as usize] = [0, 1, 2].map(|a| spin[a] - speed * centre[a] / 0.0078);
        }
    }
    let solved = run(model);
    let state = &solved.state;
    let (before, scales) = momenta(&state.mass, &solved.model.mesh.positions, &solved.model.velocity);
    let (after, _) = momenta(&state.mass, &state.x, &state.v);
    let change = |from: usize| (from..from + 3).map(|a| (after[a] - before[a]).powi(2)).sum::<f64>().sqrt();
    let ledger = &solved.outcome.ledger;
    let fastest = state.v.iter().flatten().fold(0.0_f64, |top, v| top.max(v.abs()));
    println!(
        "{} cycles, {:e} s, fastest {fastest}, kinetic {} of {}",
        state.cycle, state.time, ledger.last.kinetic, ledger.greatest_kinetic
    );
    let mut sheet = Sheet::default();
    sheet.add("debris: momentum", change(0) / scales[0]);
    sheet.add("debris: angular momentum", change(3) / scales[1]);
    sheet.add("debris: energy error", ledger.last.error);
    sheet.add("debris: penetration (gaps)", ledger.worst_penetration);
    sheet.add("debris: nodes in foreign bodies", intruders(&solved.model.mesh, &state.x).len() as f64);
    assert!(ledger.worst_penetration > 0.0, "nothing met");
    sheet.close();
}
