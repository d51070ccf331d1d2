//! Springs, dampers and cables against closed forms.

use crate::{
    case::Figures,
    solve::{Solved, model, run},
};

/// Steps that show the closed form without the error of the scheme.
const SHORT_STEPS: &str = "safety_factor = 0.03\n";

/// A mass of 2 kg at (1, 0, 0) on a spring from the origin, whose other end is held; it begins with 3 m/s along the spring.
fn on_spring(law: &str, end_time: f64, more: &str) -> Solved {
    with_control(SHORT_STEPS, law, end_time, more)
}

fn with_control(control: &str, law: &str, end_time: f64, more: &str) -> Solved {
    run(model(&format!(
        "title = \"a mass on a spring\"\nunits = \"SI\"\n[control]\nend_time = {end_time}\n{control}[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"spring\"\nvelocity = [3, 0, 0]\nspring = {{ {law} }}\n\
         mesh = {{ nodes = [[1, 0, 0, 0], [2, 1, 0, 0]], elements = [[1, 1, 2]] }}\n\
         [[mass]]\nnodes = [1, 2]\nmass = 2\n[[boundary]]\ntype = \"fixed\"\nnodes = [1]\n\
         [[gauge]]\nname = \"mass\"\nnode = 2\n{more}"
    )))
}

/// Times and elongations of the mass.
fn path(solved: &Solved) -> Vec<(f64, f64)> {
    solved.gauge(0).map(|(time, row)| (time, row.x[0] - 1.0)).collect()
}

/// When the path passes through a value.
fn passages(path: &[(f64, f64)], value: f64) -> Vec<f64> {
    path.windows(2)
        .filter(|w| (w[0].1 - value) * (w[1].1 - value) < 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * (value - w[0].1) / (w[1].1 - w[0].1))
        .collect()
}

/// Twice the mean time between zeros.
fn period(path: &[(f64, f64)]) -> f64 {
    let zeros = passages(path, 0.0);
    2.0 * (zeros[zeros.len() - 1] - zeros[0]) / (zeros.len() - 1) as f64
}

/// The logarithmic decrement over the first two periods. A parabola through three points finds each peak.
fn decrement(path: &[(f64, f64)]) -> f64 {
    let peaks: Vec<f64> = path
        .windows(3)
        .filter(|w| w[1].1 > w[0].1 && w[1].1 >= w[2].1)
        .map(|w| {
            let [a, b, c] = [w[0].1, w[1].1, w[2].1];
            b + (c - a) * (c - a) / (8.0 * (2.0 * b - a - c))
        })
        .collect();
    (peaks[0] / peaks[2]).ln() / 2.0
}

/// The greatest energy error of the history, over the energy of the mass.
fn energy_error(solved: &Solved) -> f64 {
    let first = solved.rows[0].total;
    solved.rows.iter().map(|row| ((row.total - row.external - first) / 9.0).abs()).fold(0.0, f64::max)
}

/// 8 kN/m and 2 kg.
pub(super) fn a_mass_on_a_spring_swings_as_the_closed_form_says(figures: &mut Figures) {
    let solved = on_spring("stiffness = 8000", 1.0, "");
    let measured = period(&path(&solved));
    // The leapfrog scheme is faster by w dt / 2 over the arc of its sine.
    let half = 0.5 * 4000_f64.sqrt() * solved.rows[solved.rows.len() - 2].dt;
    figures
        .add("mass on a spring: period, without the error of the scheme (s)", measured * half.asin() / half);
    figures.add("mass on a spring: energy error", energy_error(&solved));
    let solved = with_control("", "stiffness = 8000", 1.0, "");
    figures.add("mass on a spring, default step: period (s)", period(&path(&solved)));
}

/// The same with a tenth of the critical damping, and a damper of 40 Ns/m alone.
pub(super) fn a_damper_takes_the_energy_of_a_mass_as_the_closed_form_says(figures: &mut Figures) {
    let solved = on_spring("stiffness = 8000, damping = 25.298221281347036", 0.4, "");
    figures.add("mass on a damped spring: logarithmic decrement", decrement(&path(&solved)));
    figures.add("mass on a damped spring: energy error", energy_error(&solved));
    let solved = with_control("", "stiffness = 8000, damping = 25.298221281347036", 0.4, "");
    figures.add("mass on a damped spring, default step: logarithmic decrement", decrement(&path(&solved)));
    let alone = on_spring("damping = 40", 1.0, "");
    let last = alone.rows.last().expect("rows");
    figures.add("mass on a damper alone: way to rest (m)", last.gauges[0].x[0] - 1.0);
    figures.add("mass on a damper alone: energy in the damper (J)", last.internal);
    let alone = with_control("", "damping = 40", 0.1, "");
    let last = alone.rows.last().expect("rows");
    figures.add(
        "mass on a damper alone, default step: way after two times m / c (m)",
        last.gauges[0].x[0] - 1.0,
    );
}

/// The end is driven out by 0.1 m and back to its place: the spring keeps the area of its loop.
pub(super) fn an_elastoplastic_spring_keeps_the_area_of_its_loop(figures: &mut Figures) {
    let driven = "[[curve]]\nname = \"to and fro\"\npoints = [[0, 1], [0.1, 1], [0.1000001, -1], [0.2, -1]]\n\
         [[boundary]]\ntype = \"velocity\"\nnodes = [2]\nvelocity = { x = { curve = \"to and fro\", factor = 1 } }\n";
    let solved = on_spring("stiffness = 8000, tangent = 800, yield_force = 200, offset = 0", 0.2, driven);
    let last = solved.rows.last().expect("rows");
    figures.add("elastoplastic spring: work of its loop (J)", last.external);
    figures.add("elastoplastic spring: force at the end (N)", solved.state.own[0][0]);
}

/// A nonlinear spring of points: 3 kN/m up to 50 mm, 30 kN/m beyond.
pub(super) fn a_spring_of_points_stops_a_mass_as_its_energy_says(figures: &mut Figures) {
    let solved = on_spring("points = [[-0.05, -150], [0, 0], [0.05, 150], [0.1, 1650]]", 0.2, "");
    let most = path(&solved).iter().map(|(_, x)| *x).fold(0.0, f64::max);
    figures.add("spring of points: longest stretch (m)", most);
}

/// A mass of 20 kg is thrown up at 2 m/s from the end of a cable of 1 m, falls back, stretches the cable and is thrown up again. The
/// cable weighs 5 g.
pub(super) fn a_mass_that_falls_into_a_slack_cable_stretches_it_as_its_energy_says(figures: &mut Figures) {
    let (bulk, shear) = (2e9 / 3.0, 1e9);
    let solved = run(model(&format!(
        "title = \"a slack cable\"\nunits = \"SI\"\n[control]\nend_time = 0.5\n[gravity]\nacceleration = [10, 0, 0]\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"cable\"\nmaterial = {{ density = 50, eos = {{ type = \"linear\", bulk = {bulk:e} }}, \
         strength = {{ type = \"elastic\", shear = {shear:e} }} }}\nvelocity = [-2, 0, 0]\ncable = {{ area = 1e-4 }}\n\
         mesh = {{ nodes = [[1, 0, 0, 0], [2, 1, 0, 0]], elements = [[1, 1, 2]] }}\n\
         [[mass]]\nnodes = [2]\nmass = 20\n[[boundary]]\ntype = \"fixed\"\nnodes = [1]\n\
         [[gauge]]\nname = \"mass\"\nnode = 2\n"
    )));
    let path = path(&solved);
    figures.add("cable that is drawn: longest stretch (m)", path.iter().map(|(_, x)| *x).fold(0.0, f64::max));
    // Slack again, it leaves the mass its speed, and pulls no more.
    let last = solved.rows.last().expect("rows");
    let (x, v) = (last.gauges[0].x[0], last.gauges[0].v[0]);
    let speed = (v * v + 20.0 * (1.0 - x)).sqrt();
    figures.add("cable that is drawn: speed of the mass as it falls slack again (m/s)", speed);
    figures.add("cable that is drawn: energy left in it when it is slack (J)", last.internal.abs());
}
