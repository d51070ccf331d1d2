//! Thin structures of solid elements under impulses, and the tones of a cantilever.

use mechanics::{constraint::Constraint, load::Drive};

use crate::{
    case::Figures,
    solve::{Solved, model, run},
    tetrahedra::cut,
};

/// An inch (m), and a pound of force per square inch (Pa).
const INCH: f64 = 0.0254;
const PSI: f64 = 6_894.757_293_168;
/// lbf s2/in4 in kg/m3.
const DENSITY: f64 = PSI / (INCH * INCH);

/// A linear-elastic, perfectly plastic material.
fn perfectly_plastic(density: f64, young: f64, poisson: f64, yield_stress: f64) -> String {
    let bulk = young / (3.0 * (1.0 - 2.0 * poisson));
    let shear = young / (2.0 * (1.0 + poisson));
    format!(
        "{{ density = {density:e}, eos = {{ type = \"linear\", bulk = {bulk:e} }}, strength = {{ type = \"von-mises\", \
         shear = {shear:e}, yield_stress = {yield_stress:e} }} }}"
    )
}

/// How far the node of a gauge has gone against an axis: the greatest, and all by time.
fn deflections(solved: &Solved, gauge: usize, axis: usize) -> (f64, Vec<(f64, f64)>) {
    let start = solved.model.mesh.positions[solved.model.output.gauges[gauge].node as usize][axis];
    let path: Vec<(f64, f64)> =
        solved.rows.iter().map(|row| (row.time, start - row.gauges[gauge].x[axis])).collect();
    (path.iter().map(|(_, d)| *d).fold(0.0, f64::max), path)
}

/// Balmer and Witmer's panel: 120 degrees of a cylinder, straight edges clamped, ends hinged, explosively thrown
/// inward over 60 degrees and 10.205 in from one end. Half of it, with 4 elements through the thickness.
pub(super) fn the_impulsive_panel_is_dented_as_deep_as_measured(figures: &mut Figures) {
    let (radius, thickness, length) = (2.9375 * INCH, 0.125 * INCH, 12.56 * INCH);
    let material = perfectly_plastic(2.5e-4 * DENSITY, 10.5e6 * PSI, 0.33, 44_000.0 * PSI);
    let deck = format!(
        "title = \"impulsive panel\"\nunits = \"SI\"\n[control]\nend_time = 600e-6\nlinear_viscosity = 0.06\nhourglass = 0.03\n\
         [[part]]\nname = \"panel\"\nmaterial = {material}\n\
         tube = {{ base = [0, 0, 0], inner_radius = {:e}, outer_radius = {:e}, length = {length:e}, start_degrees = 30, \
         angle_degrees = 60, cells = [4, 32, 64] }}\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"panel\"]\nface = \"j-min\"\n\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n\
         [[gauge]]\nname = \"middle\"\npoint = [0, {radius:e}, {:e}]\n\
         [[gauge]]\nname = \"three quarters\"\npoint = [0, {radius:e}, {:e}]\n",
        radius - 0.5 * thickness,
        radius + 0.5 * thickness,
        0.5 * length,
        9.42 * INCH
    );
    let mut model = model(&deck);
    let zero = Some(Drive::constant(0.0));
    let clamped = model
        .setup
        .constraints
        .iter()
        .position(|c| c.velocity == [zero; 3])
        .expect("the straight edge is clamped") as u16;
    // Hinged: held across the panel, free to slide along it.
    let hinged = model.setup.constraints.len() as u16;
    model.setup.constraints.push(Constraint { velocity: [zero, zero, None], ..Constraint::default() });
    for n in 0..model.mesh.n_nodes() {
        let [x, y, z] = model.mesh.positions[n];
        let (r, angle) = (x.hypot(y), x.atan2(y).to_degrees());
        let near = 1e-6 * INCH;
        if (r - radius).abs() < near && (z < near || z > length - near) {
            model.constraint[n] = hinged;
        } else if angle.abs() <= 30.0 + 1e-6 && z <= 10.205 * INCH && model.constraint[n] != clamped {
            model.velocity[n] = [-5650.0 * INCH * x / r, -5650.0 * INCH * y / r, 0.0];
        }
    }
    let solved = run(model);
    for (gauge, name) in [(0, "half way"), (1, "at three quarters")] {
        let (greatest, _) = deflections(&solved, gauge, 1);
        figures.add(&format!("impulsive panel @ {name}, deflection (in)"), greatest / INCH);
    }
    figures.add("impulsive panel: energy error", solved.outcome.run_totals.last.error);
}

/// A clamped beam of 10 x 1.2 x 0.125 in, its middle 2 in thrown at 5,000 in/s; a quarter of it.
pub(super) fn the_impulsive_beam_bends_as_a_code_of_the_same_elements_finds(figures: &mut Figures) {
    let material = perfectly_plastic(2.61e-4 * DENSITY, 10.4e6 * PSI, 0.3, 41_400.0 * PSI);
    let deck = format!(
        "title = \"impulsive beam\"\nunits = \"SI\"\n[control]\nend_time = 2e-3\nlinear_viscosity = 0.06\nhourglass = 0.03\n\
         [[part]]\nname = \"beam\"\nmaterial = {material}\n\
         box = {{ origin = [0, 0, 0], size = [{:e}, {:e}, {:e}], cells = [80, 6, 4] }}\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"beam\"]\nface = \"i-max\"\n\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n\
         [[gauge]]\nname = \"middle\"\npoint = [0, 0, {:e}]\n",
        5.0 * INCH,
        0.6 * INCH,
        0.125 * INCH,
        0.0625 * INCH
    );
    let mut model = model(&deck);
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        if x[0] <= (1.0 + 1e-6) * INCH {
            v[2] = -5000.0 * INCH;
        }
    }
    let solved = run(model);
    let (greatest, path) = deflections(&solved, 0, 2);
    let peak_at = path.iter().find(|(_, d)| *d == greatest).map_or(0.0, |(t, _)| *t);
    let after: Vec<f64> = path.iter().filter(|(t, _)| *t > 1.5 * peak_at).map(|(_, d)| *d).collect();
    figures.add("impulsive beam: greatest deflection (in)", greatest / INCH);
    figures.add(
        "impulsive beam: mean deflection afterwards (in)",
        after.iter().sum::<f64>() / after.len() as f64 / INCH,
    );
}

/// A beam clamped at both ends, thrown at 30 m/s all over: half of its length and of its width. Theory takes it as rigid and
/// perfectly plastic, so it is ten times as stiff here as aluminium, whose elastic bending would take half of the energy.
pub(super) fn a_beam_thrown_all_over_is_bent_about_as_a_rigid_plastic_one(figures: &mut Figures) {
    let (height, length) = (3.175e-3, 0.127);
    let deck = format!(
        "title = \"clamped beam\"\nunits = \"SI\"\n[control]\nend_time = 0.8e-3\nlinear_viscosity = 0.06\nhourglass = 0.03\n\
         [[part]]\nname = \"beam\"\nmaterial = {}\n\
         box = {{ origin = [0, 0, 0], size = [{length}, 0.015, {height}], cells = [60, 4, 4] }}\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"beam\"]\nface = \"i-max\"\n\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n\
         [[gauge]]\nname = \"middle\"\npoint = [0, 0, {:e}]\n",
        perfectly_plastic(2.61e-4 * DENSITY, 10.4e7 * PSI, 0.3, 285.4e6),
        0.5 * height
    );
    let mut model = model(&deck);
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        if x[0] < length {
            v[2] = -30.0;
        }
    }
    let (greatest, _) = deflections(&run(model), 0, 2);
    figures.add("beam thrown all over: greatest deflection over its height", greatest / height);
}

/// A cantilever of 0.2 m with a section of 10 mm square, two and four elements high, without hourglass control.
pub(super) fn a_cantilever_of_one_point_elements_rings_at_its_reduced_bending_stiffness(
    figures: &mut Figures,
) {
    for layers in [2, 4] {
        figures.add(
            &format!("cantilever @ {layers} layers, frequency (Hz)"),
            first_frequency(layers, "hourglass = 0"),
        );
    }
}

/// The same beam with one and two layers of elements whose hourglass control bends as a beam does.
pub(super) fn a_cantilever_of_assumed_strains_rings_as_a_beam_with_one_layer(figures: &mut Figures) {
    for layers in [1, 2] {
        let frequency = first_frequency(layers, ASSUMED);
        figures.add(&format!("cantilever @ {layers} layers of assumed strain, frequency (Hz)"), frequency);
    }
}

/// The same beam of elements of eight points.
pub(super) fn a_cantilever_of_eight_points_is_hardly_softer_than_a_beam(figures: &mut Figures) {
    for layers in [2, 4] {
        let frequency = first_frequency(layers, "points = 8");
        figures.add(&format!("cantilever @ {layers} layers of eight points, frequency (Hz)"), frequency);
    }
}

/// The same beam of one layer of cubes, cut into composite tetrahedra: two nodes apart through its height.
pub(super) fn a_cantilever_of_composite_tetrahedra_rings_as_a_beam(figures: &mut Figures) {
    figures.add("cantilever @ tetrahedra, frequency (Hz)", first_frequency(1, TETRAHEDRA));
}

/// The same beams in their second and third mode, both at once.
pub(super) fn higher_tones_of_a_cantilever_are_those_of_timoshenko_with_that_stiffness(
    figures: &mut Figures,
) {
    for layers in [2, 4] {
        let solved = cantilever(layers, &[1, 2], "hourglass = 0");
        for (mode, name) in [(1, "second"), (2, "third")] {
            let frequency = peak(&solved, slender_frequency(mode));
            figures.add(&format!("cantilever @ {layers} layers, {name} mode (Hz)"), frequency);
        }
    }
}

/// Wave numbers of a clamped-free beam times its length, and how much of sinh - sin belongs to cosh - cos.
const MODES: [(f64, f64); 3] = [
    (1.875_104_068_711_961, 0.734_095_513_756_963_2),
    (4.694_091_132_974_175, 1.018_467_318_759_305),
    (7.854_757_438_237_613, 0.999_224_496_517_271_8),
];

/// After Euler and Bernoulli (Hz): 0.2 m, 10 mm square, 200 GPa, 8000 kg/m3.
fn slender_frequency(mode: usize) -> f64 {
    let stiffness_over_mass = 200e9_f64 * 0.01 * 0.01 / 12.0 / 8000.0;
    (MODES[mode].0 / 0.2).powi(2) * stiffness_over_mass.sqrt() / (2.0 * std::f64::consts::PI)
}

/// Stands for solids that are cut into tetrahedra.
const TETRAHEDRA: &str = "# tetrahedra";

/// Hourglass control of a part.
const ASSUMED: &str = "hourglass = { kind = \"assumed-strain\" }";

/// The beam, thrown across in these modes, of these elements.
fn cantilever(layers: u32, modes: &[usize], elements: &str) -> Solved {
    let deck = format!(
        "title = \"cantilever\"\nunits = \"SI\"\n[control]\nend_time = 0.016\nlinear_viscosity = 0\nquadratic_viscosity = 0\n\
         [output]\nhistory_cycles = 10\n\
         [[part]]\nname = \"beam\"\n{elements}\nmaterial = {{ density = 8000, eos = {{ type = \"linear\", bulk = 166.66666666666666e9 }}, \
         strength = {{ type = \"elastic\", shear = 76.92307692307692e9 }} }}\n\
         box = {{ origin = [0, 0, 0], size = [0.2, 0.01, 0.01], cells = [{}, {layers}, {layers}] }}\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"beam\"]\nface = \"i-min\"\n\
         [[gauge]]\nname = \"tip\"\npoint = [0.2, 0.005, 0.005]\n",
        20 * layers
    );
    let mut model = model(&deck);
    if elements == TETRAHEDRA {
        model = cut(model, |_| true);
    }
    let shape = |s: f64, (beta, ratio): (f64, f64)| {
        (beta * s).cosh() - (beta * s).cos() - ratio * ((beta * s).sinh() - (beta * s).sin())
    };
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        if x[0] > 0.0 {
            v[2] = 1e-3 * modes.iter().map(|mode| shape(x[0] / 0.2, MODES[*mode])).sum::<f64>();
        }
    }
    run(model)
}

fn first_frequency(layers: u32, elements: &str) -> f64 {
    let solved = cantilever(layers, &[0], elements);
    // Displacement of the tip passes through 0 twice a period.
    let start = solved.model.mesh.positions[solved.model.output.gauges[0].node as usize][2];
    let path: Vec<(f64, f64)> =
        solved.rows.iter().map(|row| (row.time, row.gauges[0].x[2] - start)).collect();
    let zeros: Vec<f64> = path
        .windows(2)
        .filter(|w| w[0].1 * w[1].1 < 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * w[0].1 / (w[0].1 - w[1].1))
        .collect();
    assert!(zeros.len() >= 4, "{} passages", zeros.len());
    let periods = 0.5 * (zeros.len() - 1) as f64;
    periods / (zeros[zeros.len() - 1] - zeros[0])
}

/// The frequency (Hz) from 0.75 to 1.1 of `near` at which the tip's velocity across is strongest, through Hann's window.
fn peak(solved: &Solved, near: f64) -> f64 {
    use std::f64::consts::PI;
    let tip: Vec<(f64, f64)> = solved.gauge(0).map(|(time, gauge)| (time, gauge.v[2])).collect();
    let end = tip.last().expect("rows").0;
    let strength = |frequency: f64| {
        let (mut even, mut odd) = (0.0, 0.0);
        for (time, v) in &tip {
            let weighted = v * (PI * time / end).sin().powi(2);
            let (sin, cos) = (2.0 * PI * frequency * time).sin_cos();
            (even, odd) = (weighted.mul_add(cos, even), weighted.mul_add(sin, odd));
        }
        even.hypot(odd)
    };
    let best = |low: f64, high: f64| {
        let all = (0..=100).map(|i| low + (high - low) * f64::from(i) / 100.0);
        all.max_by(|a, b| strength(*a).total_cmp(&strength(*b))).expect("a hundred")
    };
    let (low, high) = (0.75 * near, 1.1 * near);
    let coarse = best(low, high);
    let step = 0.01 * (high - low);
    assert!(low + step < coarse && coarse < high - step, "no peak between {low} and {high}");
    best(coarse - step, coarse + step)
}
