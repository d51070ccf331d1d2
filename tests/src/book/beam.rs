//! Beams against closed forms: deflection, tones, buckling, a plastic hinge, and energy over a long free motion.

use deck::Model;

use crate::{
    case::Figures,
    solve::{Solved, model, run},
};

/// A row of `n` beams of steel, 10 mm square, from the origin along x; nodes from 1 on.
fn row(length: f64, n: usize, (strength, control): (&str, &str), conditions: &str) -> Model {
    let node = |i: usize| format!("[{}, {:e}, 0, 0]", i + 1, length * i as f64 / n as f64);
    let nodes: Vec<String> = (0..=n).map(node).collect();
    let elements: Vec<String> = (1..=n).map(|e| format!("[{e}, {e}, {}]", e + 1)).collect();
    model(&format!(
        "title = \"beams\"\nunits = \"SI\"\n[control]\n{control}\n[output]\nhistory_cycles = 10\n\
         [[part]]\nname = \"row\"\nmaterial = {{ density = 8000, eos = {{ type = \"linear\", bulk = 166.66666666666666e9 }}, \
         strength = {{ {strength}, shear = 76.92307692307692e9 }} }}\nbeam = {{ rectangle = [0.01, 0.01] }}\n\
         mesh = {{ nodes = [{}], elements = [{}] }}\n{conditions}",
        nodes.join(", "),
        elements.join(", ")
    ))
}

const ELASTIC: &str = "type = \"elastic\"";

const CLAMPED: &str = "[[boundary]]\ntype = \"fixed\"\nnodes = [1]\nrotations = \"xyz\"\n";

fn gauge(node: usize) -> String {
    format!("[[gauge]]\nname = \"watched\"\nnode = {node}\n")
}

/// The frequency (Hz) at which the gauge passes through its first place along z.
fn frequency(solved: &Solved) -> f64 {
    let path: Vec<(f64, f64)> = solved.gauge(0).map(|(time, row)| (time, row.x[2])).collect();
    let zeros: Vec<f64> = path
        .windows(2)
        .filter(|w| w[0].1 * w[1].1 < 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * w[0].1 / (w[0].1 - w[1].1))
        .collect();
    assert!(zeros.len() >= 4, "{} passages", zeros.len());
    0.5 * (zeros.len() - 1) as f64 / (zeros[zeros.len() - 1] - zeros[0])
}

/// 0.2 m under 100 N at the tip.
pub(super) fn a_cantilever_of_beams_bends_as_timoshenko_says(figures: &mut Figures) {
    for n in [1, 8] {
        let conditions = format!(
            "[relaxation]\nfactor = 0.998\n{CLAMPED}[[load]]\ntype = \"force\"\nnodes = [{}]\nforce = [0, 60, 80]\n",
            n + 1
        );
        let solved = run(row(0.2, n, (ELASTIC, "end_time = 1e9\nend_cycle = 20000"), &conditions));
        let [_, y, z] = solved.state.x[n];
        figures.add(&format!("cantilever of beams @ {n} elements, deflection (m)"), y.hypot(z));
    }
}

pub(super) fn a_cantilever_of_beams_rings_as_timoshenko_says(figures: &mut Figures) {
    let mut model = row(0.2, 16, (ELASTIC, "end_time = 0.03"), &(CLAMPED.to_owned() + &gauge(17)));
    let (beta, ratio) = (1.875_104_068_711_961_f64, 0.734_095_513_756_963_2);
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions).skip(1) {
        let s = beta * x[0] / 0.2;
        v[2] = 1e-3 * (s.cosh() - s.cos() - ratio * (s.sinh() - s.sin()));
    }
    figures.add("cantilever of beams: frequency (Hz)", frequency(&run(model)));
}

/// A column of 0.5 m between pins: its tone falls with the force that presses it, `f^2 = f0^2 (1 - P / P_cr)`.
pub(super) fn a_pressed_column_loses_its_stiffness_at_eulers_load(figures: &mut Figures) {
    let tone = |force: f64| {
        let mut conditions = "[[boundary]]\ntype = \"fixed\"\nnodes = [1]\n\
             [[boundary]]\ntype = \"fixed\"\nnodes = [21]\naxes = \"yz\"\n"
            .to_owned();
        if force > 0.0 {
            conditions +=
                &format!("[[load]]\ntype = \"force\"\nnodes = [21]\nforce = [{:e}, 0, 0]\n", -force);
        }
        let mut model = row(0.5, 20, (ELASTIC, "end_time = 0.06"), &(conditions + &gauge(11)));
        for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions).take(20).skip(1) {
            v[2] = 1e-2 * (std::f64::consts::PI * x[0] / 0.5).sin();
        }
        frequency(&run(model))
    };
    let force = 3500.0;
    let ratio = tone(force) / tone(0.0);
    figures.add("column of beams: Euler's load (N)", force / (1.0 - ratio * ratio));
}

/// A cantilever of 0.2 m whose tip is driven across far beyond yield: the force at the tip.
pub(super) fn a_cantilever_of_beams_turns_in_a_plastic_hinge(figures: &mut Figures) {
    let conditions = format!(
        "{CLAMPED}[[boundary]]\ntype = \"velocity\"\nnodes = [21]\nvelocity = {{ z = 0.5 }}\n{}",
        gauge(21)
    );
    let plastic = "type = \"von-mises\", yield_stress = 250e6";
    let solved = run(row(0.2, 20, (plastic, "end_time = 0.032"), &conditions));
    let at = |z: f64| solved.rows.iter().find(|row| row.gauges[0].x[2] >= z).expect("it goes so far");
    let (from, to) = (at(0.010), at(0.0155));
    let force = (to.external - from.external) / (to.gauges[0].x[2] - from.gauges[0].x[2]);
    figures.add("plastic hinge of beams: force at the tip (N)", force);
    let energy = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    figures.add("plastic hinge of beams: energy error", energy);
}

/// A bent frame that turns about a skew axis, swings and twists, free of all supports, for 20,000 cycles.
pub(super) fn a_free_frame_that_turns_keeps_its_energy(figures: &mut Figures) {
    let mut places: Vec<[f64; 3]> = (0..=6).map(|i| [0.02 * f64::from(i), 0.0, 0.0]).collect();
    places.extend((1..=6).map(|i| [0.12, 0.02 * f64::from(i), 0.0]));
    places.extend((1..=6).map(|i| [0.12, 0.12, 0.02 * f64::from(i)]));
    let nodes: Vec<String> =
        (1..).zip(&places).map(|(id, [x, y, z])| format!("[{id}, {x:e}, {y:e}, {z:e}]")).collect();
    let elements: Vec<String> = (1..places.len()).map(|e| format!("[{e}, {e}, {}]", e + 1)).collect();
    let mut model = model(&format!(
        "title = \"frame\"\nunits = \"SI\"\n[control]\nend_time = 1\nend_cycle = 20000\n[output]\nhistory_cycles = 50\n\
         [[part]]\nname = \"frame\"\nmaterial = {{ density = 8000, eos = {{ type = \"linear\", bulk = 166.66666666666666e9 }}, \
         strength = {{ type = \"elastic\", shear = 76.92307692307692e9 }} }}\n\
         beam = {{ rectangle = [0.004, 0.008], across = [1, 2, 3] }}\nmesh = {{ nodes = [{}], elements = [{}] }}\n",
        nodes.join(", "),
        elements.join(", ")
    ));
    let spin = [120.0, -90.0, 200.0];
    let centre = [0.08, 0.05, 0.03];
    for (v, x) in model.velocity.iter_mut().zip(&places) {
        let r = [0, 1, 2].map(|i| x[i] - centre[i]);
        *v = [0, 1, 2].map(|i| spin[(i + 1) % 3] * r[(i + 2) % 3] - spin[(i + 2) % 3] * r[(i + 1) % 3]);
    }
    model.spin = vec![spin; places.len()];
    // And it swings.
    model.velocity[18][0] += 3.0;
    let solved = run(model);
    let error = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    figures.add("free frame of beams: greatest energy error in 20,000 cycles", error);
    let kinetic = |row: usize| solved.rows[row].kinetic;
    assert!(kinetic(solved.rows.len() - 1) > 0.5 * kinetic(0), "it turns no more");
}
