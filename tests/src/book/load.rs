//! Loads and boundaries: pressure, forces and velocities by curve, gravity, relaxation, faces that transmit, walls that
//! stand, move or have a mass.
//!
//! Bars are columns of cubes without Poisson's ratio, 200 GPa and 8000 kg/m3: waves of 5000 m/s, 40 MPa s/m.

use mechanics::load::blast::{Burst, Wave};
use protocol::options::JobOptions;

use crate::{
    case::Figures,
    solve::{Solved, Workers, mean, model, run, solve, without_states},
};

const IMPEDANCE: f64 = 4e7;
/// Length of a bar of 100 cells.
const LENGTH: f64 = 0.1;
const SIDE: f64 = LENGTH / 100.0;

/// Runs a bar from the origin along x, with what else its deck needs, and keeps its history of each cycle.
fn bar(end: f64, velocity: f64, rest: &str) -> Solved {
    run(model(&format!(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"bar\"\nvelocity = [{velocity:e}, 0, 0]\n\
         material = {{ density = 8000, eos = {{ type = \"linear\", bulk = 66.66666666666667e9 }}, \
         strength = {{ type = \"elastic\", shear = 100e9 }} }}\n\
         box = {{ origin = [0, 0, 0], size = [{LENGTH}, {SIDE:e}, {SIDE:e}], cells = [100, 1, 1] }}\n\
         [[gauge]]\nname = \"near\"\npoint = [0, 0, 0]\n[[gauge]]\nname = \"middle\"\npoint = [0.05, 0, 0]\n\
         [[gauge]]\nname = \"far\"\npoint = [{LENGTH}, 0, 0]\n{rest}"
    )))
}

fn mass() -> f64 {
    8000.0 * LENGTH * SIDE * SIDE
}

pub(super) fn a_pressure_by_curve_drives_a_wave_of_its_shape(figures: &mut Figures) {
    // Up to 400 MPa in 4 us, then constant: a particle velocity of 10 m/s, and half of it at 2 us after the arrival.
    let rest = "[[curve]]\nname = \"up\"\npoints = [[0, 0], [4e-6, 4e8]]\n\
                [[load]]\ntype = \"pressure\"\nface = \"i-min\"\npressure = { curve = \"up\" }\n";
    let solved = bar(18e-6, 0.0, rest);
    figures.add("pressure by curve: plateau of velocity", solved.gauge_mean(1, 15.5e-6, 17.5e-6, |g| g.v[0]));
    figures
        .add("pressure by curve: velocity on the ramp", solved.gauge_mean(1, 11.8e-6, 12.2e-6, |g| g.v[0]));
    let last = &solved.outcome.run_totals.last;
    // p v A over the time at full pressure, and a third of that over the ramp.
    let work = 4e8 * 10.0 * SIDE * SIDE * (14e-6 + 4e-6 / 3.0);
    figures.add("pressure by curve: work over p v A t", last.external / work);
    figures.add("pressure by curve: energy of the bar over the work", last.total / last.external);
}

pub(super) fn a_velocity_by_curve_arrives_as_it_was_prescribed(figures: &mut Figures) {
    let rest = "[[curve]]\nname = \"hat\"\npoints = [[0, 0], [4e-6, 1], [8e-6, 0]]\n\
                [[boundary]]\ntype = \"velocity\"\nface = \"i-min\"\n\
                velocity = { x = { curve = \"hat\", factor = 10 } }\n";
    let solved = bar(19e-6, 0.0, rest);
    let at = |from, to| solved.gauge_mean(1, from, to, |g| g.v[0]);
    figures.add("velocity by curve: rising", at(11.8e-6, 12.2e-6));
    figures.add("velocity by curve: falling", at(15.8e-6, 16.2e-6));
    let last = &solved.outcome.run_totals.last;
    // rho c A times the integral of v^2: 100/3 over 8 us.
    let work = IMPEDANCE * SIDE * SIDE * 100.0 / 3.0 * 8e-6;
    figures.add("velocity by curve: work", last.external / work);
}

pub(super) fn a_transmitting_face_lets_a_pulse_out(figures: &mut Figures) {
    // A pulse of 6 us runs along the bar, leaves from 20 us to 26 us, and would be back at the middle from 30 us on.
    let rest = "[[curve]]\nname = \"hat\"\npoints = [[0, 0], [1e-6, 1], [5e-6, 1], [6e-6, 0]]\n\
                [[load]]\ntype = \"pressure\"\nface = \"i-min\"\npressure = { curve = \"hat\", factor = 4e8 }\n";
    let with = |face: &str| {
        let solved = bar(40e-6, 0.0, &format!("{rest}{face}"));
        let top = |from: f64, to: f64| {
            let inside = solved.gauge(1).filter(|(time, _)| (from..to).contains(time));
            inside.map(|(_, row)| row.v[0].abs()).fold(0.0, f64::max)
        };
        let back = top(28e-6, 40e-6) / top(10e-6, 17e-6);
        let last = solved.outcome.run_totals.last.clone();
        // What viscosity took on the way stays in the bar as heat.
        (back, last.kinetic, last.error)
    };
    let (back, left, error) = with("[[boundary]]\ntype = \"transmit\"\nface = \"i-max\"\n");
    let (free, whole, _) = with("");
    figures.add("transmitting face: reflected share of the pulse", back);
    figures.add("transmitting face: kinetic energy left in the bar", left / whole);
    figures.add("transmitting face: energy error", error);
    assert!(free > 0.9, "without it the pulse comes back: {free}");
}

pub(super) fn shear_waves_leave_through_a_transmitting_face_too(figures: &mut Figures) {
    // The sides move across the bar only: shear waves of sqrt(100e9 / 8000) m/s.
    let speed = (100e9_f64 / 8000.0).sqrt();
    let rest = "[[boundary]]\ntype = \"fixed\"\naxes = \"xz\"\n\
                [[curve]]\nname = \"hat\"\npoints = [[0, 0], [2e-6, 1], [7e-6, 1], [9e-6, 0]]\n\
                [[boundary]]\ntype = \"velocity\"\nface = \"i-min\"\nvelocity = { y = { curve = \"hat\", factor = 10 } }\n\
                [[boundary]]\ntype = \"transmit\"\nface = \"i-max\"\n";
    let solved = bar(2.0 * LENGTH / speed, 0.0, rest);
    let top = |from: f64, to: f64| {
        let inside = solved.gauge(1).filter(|(time, _)| (from..to).contains(time));
        inside.map(|(_, row)| row.v[1].abs()).fold(0.0, f64::max)
    };
    let (first, gone) = (0.5 * LENGTH / speed, 0.5 * LENGTH / speed + 12e-6);
    figures
        .add("transmitting face: reflected share of a shear pulse", top(gone, f64::MAX) / top(first, gone));
}

pub(super) fn a_force_by_curve_gives_its_impulse_and_gravity_its_fall(figures: &mut Figures) {
    // Four nodes, 2 N each over a hat of 4 us; the bar falls sideways with 1e6 m/s2 for the whole time.
    let rest = "[[curve]]\nname = \"hat\"\npoints = [[0, 0], [2e-6, 1], [4e-6, 0]]\n\
                [[load]]\ntype = \"force\"\nface = \"i-max\"\nforce = [2, 0, 0]\ncurve = \"hat\"\n\
                [gravity]\nacceleration = [0, 0, -1e6]\n";
    let solved = bar(30e-6, 0.0, rest);
    let [along, _, down] = solved.outcome.run_totals.last.momentum;
    figures.add("force by curve: momentum over its integral", along / (4.0 * 2.0 * 2e-6));
    let last = &solved.outcome.run_totals.last;
    figures.add("gravity: momentum over m g t", down / (-mass() * 1e6 * last.time));
    let fallen = solved.state.x[0][2] / (-0.5e6 * solved.state.time.powi(2));
    figures.add("gravity: fall over g t^2 / 2", fallen);
    figures.add("gravity: energy error", last.error);
}

pub(super) fn a_hanging_bar_relaxes_to_its_length_under_its_weight(figures: &mut Figures) {
    let rest = "[[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\n[gravity]\nacceleration = [1e6, 0, 0]\n\
                [relaxation]\nfactor = 0.97\n";
    let solved = bar(600e-6, 0.0, rest);
    let tip = solved.rows.last().expect("rows").gauges[2].x[0] - LENGTH;
    figures.add("hanging bar: tip", tip);
    let middle = solved.rows.last().expect("rows").gauges[1].x[0] - 0.5 * LENGTH;
    figures.add("hanging bar: middle", middle);
}

pub(super) fn a_wall_of_finite_mass_is_slowed_by_the_bar_it_strikes(figures: &mut Figures) {
    // Until the wave is back, 2L/c, the bar is a damper: V = V0 exp(-rho c A t / M). Ten masses of the bar.
    let heavy = 10.0 * mass();
    let rest = format!(
        "[[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\nmass = {heavy:e}\nvelocity = {{ x = 10 }}\n"
    );
    let solved = bar(36e-6, 0.0, &rest);
    // While it is pressed, the bar's face moves with the wall.
    let decay = IMPEDANCE * SIDE * SIDE / heavy;
    let expected = 10.0 * (-decay * 35e-6_f64).exp();
    figures
        .add("wall of finite mass: velocity", solved.gauge_mean(0, 34.5e-6, 35.5e-6, |g| g.v[0]) / expected);
    let last = &solved.outcome.run_totals.last;
    let given = heavy * 10.0 * (1.0 - (-decay * last.time).exp());
    figures.add("wall of finite mass: momentum that it gave", last.momentum[0] / given);
    let work = 0.5 * heavy * 100.0 * (1.0 - (-2.0 * decay * last.time).exp());
    figures.add("wall of finite mass: work that it did", last.external / work);
}

pub(super) fn what_bodies_lose_a_wall_of_finite_mass_has(figures: &mut Figures) {
    // A cube of copper strikes it askew and leaves it; the state is looked at in free flight.
    let deck = "title = \"impulse\"\nunits = \"SI\"\n[control]\nend_cycle = 500\nend_time = 1\n\
        [[part]]\nname = \"cube\"\nmaterial = \"CU_OFHC\"\nvelocity = [60, 0, -80]\n\
        box = { origin = [0, 0, 1e-5], size = [0.01, 0.01, 0.01], cells = [5, 5, 5] }\n\
        [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nmass = 0.05\nfriction = 0.2\n";
    let options = without_states(JobOptions { snapshot_at: Some(490), ..JobOptions::default() });
    let solved = solve(model(deck), Workers { options, ..Workers::default() }).expect("a cube bounces");
    let snapshot = solved.snapshot.as_ref().expect("it was asked for");
    let [_, wall] = snapshot.walls[0];
    let momentum =
        |v: &[[f64; 3]], a: usize| -> f64 { v.iter().zip(&snapshot.state.mass).map(|(v, m)| m * v[a]).sum() };
    for (axis, name) in [(2, "along its normal"), (0, "across it")] {
        let lost = momentum(&solved.model.velocity, axis) - momentum(&snapshot.state.v, axis);
        assert!(lost.abs() > 0.01, "it has met the wall: {lost}");
        figures.add(
            &format!("wall of finite mass @ impulse {name}, over what the cube lost"),
            0.05 * wall[axis] / lost,
        );
    }
}

pub(super) fn a_driven_wall_pushes_as_a_bar_that_strikes_it_is_pushed(figures: &mut Figures) {
    let rest = "[[curve]]\nname = \"on\"\npoints = [[0, 1], [1, 1]]\n[[wall]]\npoint = [0, 0, 0]\n\
                normal = [1, 0, 0]\nvelocity = { x = { curve = \"on\", factor = 10 } }\n";
    let driven = bar(45e-6, 0.0, rest);
    let plateau = |solved: &Solved| {
        let force = solved
            .rows
            .windows(2)
            .map(|w| (w[1].time, (w[1].momentum[0] - w[0].momentum[0]) / (0.5 * (w[0].dt + w[1].dt))));
        mean(force.filter(|(t, _)| (5e-6..35e-6).contains(t)).map(|(_, f)| f)) / (SIDE * SIDE)
    };
    figures.add("driven wall: stress", plateau(&driven));
    // Seen from the wall it is the bar that comes.
    let struck = bar(45e-6, -10.0, "[[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n");
    let difference = driven.part_velocity(0)[0] - struck.part_velocity(0)[0] - 10.0;
    figures.add("driven wall: velocity beside that of a standing one", difference);
}

pub(super) fn a_wall_gives_the_impulse_that_bodies_lack_and_rubs_after_coulomb(figures: &mut Figures) {
    // A cube of one element comes at 45 degrees, held across, where it would bulge.
    let fall = |friction: f64| {
        let solved = run(model(&format!(
            "title = \"oblique\"\nunits = \"SI\"\n[control]\nend_time = 4e-6\nsafety_factor = 0.3\n[output]\nhistory_cycles = 1\n\
             [[part]]\nname = \"cube\"\nvelocity = [10, 0, -10]\nmaterial = {{ density = 8000, \
             eos = {{ type = \"linear\", bulk = 66.66666666666667e9 }} }}\n\
             box = {{ origin = [0, 0, 1e-6], size = [0.001, 0.001, 0.001], cells = [1, 1, 1] }}\n\
             [[boundary]]\ntype = \"fixed\"\naxes = \"y\"\n\
             [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nfriction = {friction}\n"
        )));
        solved.part_velocity(0)
    };
    let smooth = fall(0.0);
    figures.add("oblique on a smooth wall: velocity along it", smooth[0]);
    let rough = fall(0.1);
    // The tangential loss is the coefficient times the normal change, whatever the rebound.
    figures
        .add("oblique on a rough wall: tangential over normal change", (10.0 - rough[0]) / (rough[2] + 10.0));
}

pub(super) fn a_body_between_a_sphere_and_a_cylinder_stays_outside_both(figures: &mut Figures) {
    let solved = run(model(
        "title = \"die\"\nunits = \"SI\"\n[control]\nend_time = 60e-6\n\
         [[part]]\nname = \"blank\"\nmaterial = \"CU_OFHC\"\n\
         box = { origin = [-0.01, -0.01, 0], size = [0.02, 0.02, 0.004], cells = [16, 16, 4] }\n\
         [[wall]]\nshape = \"sphere\"\npoint = [0, 0, 0.0091]\nradius = 0.005\nmass = 0.05\nvelocity = { z = -80 }\n\
         [[wall]]\nshape = \"cylinder\"\npoint = [0, 0, -0.0061]\naxis = [0, 1, 0]\nradius = 0.006\n",
    ));
    let last = &solved.outcome.run_totals.last;
    let cylinder = |x: [f64; 3]| (x[0].powi(2) + (x[2] + 0.0061).powi(2)).sqrt() - 0.006;
    let deepest = solved.state.x.iter().map(|x| -cylinder(*x)).fold(f64::MIN, f64::max);
    figures.add("die: deepest node inside the cylinder", deepest.max(0.0));
    let bent = solved.state.x.iter().map(|x| x[2]).fold(f64::MAX, f64::min);
    assert!(bent < -1e-4, "the blank bends over the cylinder: {bent}");
    figures.add("die: energy error", last.error);
}

/// Peaks of the waves of one kilogram on the ground at twenty distances.
pub(super) fn blasts_have_the_peaks_of_another_published_fit_at_twenty_distances(figures: &mut Figures) {
    for i in 0..20 {
        let scaled = 0.2 * 200f64.powf(f64::from(i) / 19.5);
        let wave = Wave::at(Burst::Surface, scaled, 1.0);
        figures.add(&format!("blast on the ground @ {scaled:.4} m, incident peak (kPa)"), wave.peaks[0]);
        if scaled < 2.0 {
            figures.add(&format!("blast on the ground @ {scaled:.4} m, reflected peak (kPa)"), wave.peaks[1]);
        }
    }
}
