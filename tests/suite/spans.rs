//! What begins and ends in a run, circles, masses at nodes, bodies of nodes, gravity of parts: against closed forms.

use deck::Model;
use tests::solve::{Solved, model, run};

use crate::bits::same_bits;

/// An elastic cube of 8 elements, 10 mm wide and 8 g, at the origin, and what else its deck needs.
fn cube(end: f64, rest: &str) -> Model {
    cubes(end, &part("cube", 0.0, 0.0), rest)
}

fn cubes(end: f64, parts: &str, rest: &str) -> Model {
    model(&format!(
        "title = \"spans\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n[output]\nhistory_cycles = 1\n{parts}{rest}"
    ))
}

fn part(name: &str, x: f64, speed: f64) -> String {
    format!(
        "[[part]]\nname = \"{name}\"\nvelocity = [{speed:e}, 0, 0]\n\
         material = {{ density = 8000, eos = {{ type = \"linear\", bulk = 150e9 }}, \
         strength = {{ type = \"elastic\", shear = 80e9 }} }}\n\
         box = {{ origin = [{x:e}, 0, 0], size = [0.01, 0.01, 0.01], cells = [2, 2, 2] }}\n"
    )
}

const MASS: f64 = 8e-3;

fn longest_step(solved: &Solved) -> f64 {
    solved.rows.iter().map(|row| row.dt).fold(0.0, f64::max)
}

#[test]
fn what_is_held_falls_once_its_support_has_ended() {
    let rest = "[gravity]\nacceleration = [0, 0, -1e6]\n[[boundary]]\ntype = \"fixed\"\nuntil = 8e-6\n";
    let solved = run(cube(2e-5, rest));
    let last = &solved.outcome.run_totals.last;
    let fallen = -last.momentum[2] / (MASS * 1e6);
    let slack = 2.0 * longest_step(&solved);
    assert!((fallen - (last.time - 8e-6)).abs() < slack, "{fallen} at {}", last.time);
    let held: Vec<_> = solved.rows.iter().filter(|row| row.time < 8e-6 - slack).collect();
    assert!(held.len() > 3 && held.iter().all(|row| row.kinetic == 0.0), "it stands while it is held");
    // The support carried the weight and did no work.
    assert_eq!(last.holders[0].work, 0.0);
    assert!((last.external / last.kinetic - 1.0).abs() < 1e-9, "{last:?}");
}

#[test]
fn a_prescribed_velocity_does_its_work_when_it_begins() {
    let rest = "[[boundary]]\ntype = \"velocity\"\nvelocity = { x = 5 }\nfrom = 8e-6\nuntil = 1.6e-5\n";
    let solved = run(cube(2e-5, rest));
    let slack = longest_step(&solved);
    let speed = |row: usize| solved.rows[row].momentum[0] / MASS;
    for (n, row) in solved.rows.iter().enumerate() {
        if row.time < 8e-6 - slack {
            assert_eq!(speed(n), 0.0, "{}", row.time);
        } else if row.time > 8e-6 + slack {
            assert!((speed(n) - 5.0).abs() < 1e-9, "{} at {}", speed(n), row.time);
        }
    }
    let last = &solved.outcome.run_totals.last;
    assert!((last.kinetic / (0.5 * MASS * 25.0) - 1.0).abs() < 1e-9, "{last:?}");
    // Spans of a part of a step, at the start, within a step and over two: whoever is free afterwards goes on as fast.
    for from in [0.0, 4.3e-6, 0.49 * slack, 7.9 * slack] {
        let until = from + 0.2 * slack;
        let solved = run(cube(
            1e-5,
            &format!(
                "[[boundary]]\ntype = \"velocity\"\nvelocity = {{ x = 5 }}\nfrom = {from}\nuntil = {until}\n"
            ),
        ));
        let last = &solved.outcome.run_totals.last;
        assert!((last.momentum[0] / (5.0 * MASS) - 1.0).abs() < 1e-9, "{from}: {last:?}");
    }
    assert!((last.external / last.kinetic - 1.0).abs() < 1e-9 && last.error.abs() < 1e-9, "{last:?}");
}

#[test]
fn forces_and_pressures_give_the_impulse_of_their_span() {
    let force = "[[load]]\ntype = \"force\"\nforce = [3, 0, 0]\nfrom = 4e-6\nuntil = 1e-5\n";
    let pressure =
        "[[load]]\ntype = \"pressure\"\nface = \"i-min\"\npressure = 81e4\nfrom = 4e-6\nuntil = 1e-5\n";
    for rest in [force, pressure] {
        let solved = run(cube(1.5e-5, rest));
        // 27 nodes of 3 N, 1 cm2 of 810 kPa.
        let last = &solved.outcome.run_totals.last;
        assert!((last.momentum[0] / (81.0 * 6e-6) - 1.0).abs() < 1e-3, "{}: {rest}", last.momentum[0]);
        assert!(last.error.abs() < 2e-2, "{last:?}");
    }
}

/// A free plate of 40 mm by 40 mm that is pressed at 1 MPa for 6 us.
#[test]
fn a_pressure_on_shells_gives_its_impulse_against_their_upper_side() {
    const IMPULSE: f64 = 0.04 * 0.04 * 1e6 * 6e-6;
    let given = |text: &str| run(model(text)).outcome.run_totals.last.momentum;
    let sides = ["[0.04, 0, 0]", "[0, 0.04, 0]"];
    for (i, j, up) in [(0, 1, 1.0), (1, 0, -1.0)] {
        for pressure in [1e6_f64, -1e6] {
            let text = format!(
                "title = \"plate\"\nunits = \"SI\"\n[control]\nend_time = 1.5e-5\n[[part]]\nname = \"plate\"\nshell = {{ thickness = 4e-3 }}\n\
                 material = {{ density = 8000, eos = {{ type = \"linear\", bulk = 150e9 }}, strength = {{ type = \"elastic\", shear = 80e9 }} }}\n\
                 plate = {{ origin = [0, 0, 0], side_i = {}, side_j = {}, cells = [4, 4] }}\n\
                 [[load]]\ntype = \"pressure\"\npressure = {pressure:e}\nfrom = 4e-6\nuntil = 1e-5\n",
                sides[i], sides[j]
            );
            let [x, y, z] = given(&text).map(|p| p / IMPULSE);
            assert!(
                (z + up * pressure.signum()).abs() < 1e-3 && x.abs().max(y.abs()) < 1e-6,
                "{up} {pressure}: {x} {y} {z}"
            );
        }
    }
}

#[test]
fn pulses_within_a_step_give_their_impulse_and_motions_their_way() {
    const BODY: &str = "[[rigid]]\nparts = [\"cube\"]\n";
    // A triangle of 0.2 us, a third of a step.
    let curve = "[[curve]]\nname = \"pulse\"\npoints = [[5e-6, 0], [5.1e-6, 1], [5.2e-6, 0]]\n";
    let force = "[[load]]\ntype = \"force\"\nforce = [3e4, 0, 0]\ncurve = \"pulse\"\n";
    let pressure =
        "[[load]]\ntype = \"pressure\"\nface = \"i-min\"\npressure = { curve = \"pulse\", factor = 81e8 }\n";
    let gravity = "[gravity]\nacceleration = [1.0125e8, 0, 0]\ncurve = \"pulse\"\n";
    let spanned = "[[load]]\ntype = \"force\"\nforce = [1.5e4, 0, 0]\nfrom = 5e-6\nuntil = 5.2e-6\n";
    // Once the step is constant, the mean over the last one misses nothing of a pressure.
    for (load, error) in [(force, 1e-9), (pressure, 1e-3), (gravity, 1e-9), (spanned, 1e-9)] {
        for body in ["", BODY] {
            let solved = run(cube(1e-5, &format!("{curve}{load}{body}")));
            assert!(longest_step(&solved) > 4e-7, "{}", longest_step(&solved));
            let given = solved.outcome.run_totals.last.momentum[0] / (27.0 * 3e4 * 1e-7);
            assert!((given - 1.0).abs() < error, "{given}: {load}{body}");
        }
    }
    let velocity = "velocity = { x = { curve = \"pulse\", factor = 300 } }\n";
    for body in ["[[boundary]]\ntype = \"velocity\"\n", BODY] {
        let gauge = "[[gauge]]\nname = \"corner\"\npoint = [0, 0, 0]\n";
        let solved = run(cube(1e-5, &format!("{curve}{body}{velocity}{gauge}")));
        let way = solved.rows.last().expect("rows").gauges[0].x[0] / (300.0 * 1e-7);
        assert!((way - 1.0).abs() < 1e-9, "{way}: {body}");
    }
}

#[test]
fn a_body_of_nodes_that_spins_on_a_soft_spring_is_followed_as_it_turns() {
    let solved = run(model(
        "title = \"a dumbbell of masses\"\nunits = \"SI\"\n[control]\nend_time = 2\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"springs\"\nspring = { stiffness = 10 }\n\
         mesh = { nodes = [[1, 1, 0, 0], [2, -1, 0, 0], [3, 0, 0.5, 0], [4, 0, 0, -1]], elements = [[1, 1, 4], [2, 2, 3]] }\n\
         [[mass]]\nnodes = [1, 2, 3, 4]\nmass = 1.0\n[[boundary]]\ntype = \"fixed\"\nnodes = [4]\n\
         [[rigid]]\nname = \"body\"\nnodes = [1, 2, 3]\nstart_spin = [0, 30, 0]\n",
    ));
    assert!(longest_step(&solved) <= 0.1 / 30.0 * 1.01, "{}", longest_step(&solved));
    let last = &solved.outcome.run_totals.last;
    assert!(last.error.abs() < 1e-2, "{last:?}");
}

/// 1 kg of TNT, 0.6 m below a cube whose lower face feels it: heavy enough to stay there, and light enough that the rounding of work in each
/// cycle is small beside what it gets.
fn blasted(burst: &str, more: &str) -> Model {
    let rest = format!(
        "[[load]]\ntype = \"blast\"\nface = \"k-min\"\nmass = 1\npoint = [0.005, 0.005, -0.6]\nburst = \"{burst}\"\n\
         {more}[[rigid]]\nparts = [\"cube\"]\n[[mass]]\nmass = 0.1\n"
    );
    cube(3e-3, &rest)
}

#[test]
fn a_charge_gives_the_reflected_impulse_of_its_distance() {
    use mechanics::load::blast::{Burst, Wave};
    for (name, burst) in [("air", Burst::Air), ("surface", Burst::Surface)] {
        let solved = run(blasted(name, "negative_phase = false\n"));
        let last = &solved.outcome.run_totals.last;
        let wave = Wave::at(burst, 0.6, 1.0);
        // kPa ms on a square centimetre; the wave arrives inside a step, which has its mean.
        let wanted = wave.impulses[1] * 1e-4;
        assert!((last.momentum[2] / wanted - 1.0).abs() < 1e-4, "{name}: {} {wanted}", last.momentum[2]);
        let arrived = solved.rows.iter().find(|row| row.momentum[2] > 0.0).expect("it arrives").time;
        let step = longest_step(&solved);
        assert!((arrived - 1e-3 * wave.arrival).abs() < 2.0 * step, "{arrived} {wave:?}");
        assert!((last.external / last.kinetic - 1.0).abs() < 1e-6, "{last:?}");
    }
    let whole = run(blasted("air", "")).outcome.run_totals.last.momentum[2];
    let positive = run(blasted("air", "negative_phase = false\n")).outcome.run_totals.last.momentum[2];
    assert!(whole < positive, "what follows sucks: {whole} {positive}");
}

#[test]
fn a_body_whose_nodes_follow_circles_turns_without_strain() {
    // A quarter turn about an axis beside the cube.
    let rate = 0.5 * std::f64::consts::PI / 2e-5;
    let rest = format!(
        "[[boundary]]\ntype = \"rotation\"\naxis = \"z\"\npoint = [0.03, 0.01, 0]\nrate = {rate:e}\n\
         [[gauge]]\nname = \"corner\"\npoint = [0.01, 0.01, 0.01]\n"
    );
    let solved = run(cube(2e-5, &rest));
    let row = solved.rows.last().expect("rows");
    let (x, angle) = (row.gauges[0].x, rate * row.time);
    #[expect(clippy::disallowed_methods, reason = "a closed form to compare with, of no run")]
    let (sine, cosine) = angle.sin_cos();
    let wanted = [0.03 - 0.02 * cosine, 0.01 - 0.02 * sine, 0.01];
    assert!((0..3).all(|a| (x[a] - wanted[a]).abs() < 1e-12), "{x:?}");
    let last = &solved.outcome.run_totals.last;
    assert!(last.kinetic > 0.1 && last.internal.abs() < 1e-6 * last.kinetic, "{last:?}");
}

#[test]
fn a_mass_at_nodes_slows_what_it_hangs_on_and_weighs_what_it_says() {
    let rest = "[[mass]]\nface = \"k-max\"\nmass = 2e-3\n[[load]]\ntype = \"force\"\nforce = [0, 3, 0]\n\
                [gravity]\nacceleration = [1e5, 0, 0]\n";
    let solved = run(cube(1e-5, rest));
    let last = &solved.outcome.run_totals.last;
    let total: f64 = solved.state.mass.iter().sum();
    assert!((total / (MASS + 9.0 * 2e-3) - 1.0).abs() < 1e-12, "{total}");
    let given = [total * 1e5 * last.time, 81.0 * last.time];
    for a in 0..2 {
        assert!((last.momentum[a] / given[a] - 1.0).abs() < 1e-9, "{:?} {given:?}", last.momentum);
    }
    assert!(last.error.abs() < 1e-3, "{last:?}");
}

#[test]
fn gravity_of_one_part_leaves_the_other_whether_it_is_rigid_or_not() {
    for rigid in ["", "[[rigid]]\nparts = [\"a\"]\n"] {
        let parts = part("a", 0.0, 0.0) + &part("b", 0.02, 0.0);
        let rest =
            "[[load]]\ntype = \"acceleration\"\nparts = [\"a\"]\nacceleration = [0, 0, -1e6]\nuntil = 1e-5\n";
        let solved = run(cubes(2e-5, &parts, &format!("{rest}{rigid}")));
        let [a, b] = [0, 1].map(|part| solved.part_velocity(part)[2]);
        assert!(
            (a / -10.0 - 1.0).abs() < 1e-9 + 1e6 * 2.0 * longest_step(&solved) / 10.0 && b == 0.0,
            "{a} {b}"
        );
        let last = &solved.outcome.run_totals.last;
        assert!((last.external / (0.5 * MASS * a * a) - 1.0).abs() < 1e-9, "{last:?}");
    }
}

/// Two cubes 10 mm apart, the facing nodes of both one rigid body; the first moves towards the second.
fn coupled() -> Model {
    let parts = part("a", 0.0, 20.0) + &part("b", 0.02, 0.0);
    let nodes = "[[rigid]]\nnodes = [3, 6, 9, 12, 15, 18, 21, 24, 27, 28, 31, 34, 37, 40, 43, 46, 49, 52]\n";
    cubes(6e-5, &parts, nodes)
}

#[test]
fn a_rigid_body_of_nodes_couples_what_it_joins() {
    let model = coupled();
    let body = &model.setup.bodies[0];
    // Half of each cube's outer layer hangs on it.
    assert!((body.mass / (2.0 * MASS / 4.0) - 1.0).abs() < 1e-12 && body.parts.is_empty(), "{body:?}");
    assert!((body.start.velocity[0] / 10.0 - 1.0).abs() < 1e-12, "{:?}", body.start);
    let solved = run(model);
    let last = &solved.outcome.run_totals.last;
    assert!((last.momentum[0] / (20.0 * MASS) - 1.0).abs() < 1e-9, "{last:?}");
    let [a, b] = [0, 1].map(|part| solved.part_velocity(part)[0]);
    assert!(a > 0.0 && b > 5.0, "both move: {a} {b}");
    let nodes = &solved.model.setup.bodies[0].nodes;
    let x = |n: u32| solved.state.x[n as usize][0];
    assert!(nodes.iter().all(|&n| ((x(n) - x(nodes[0])).abs() - 0.005).abs() < 0.005 + 1e-12));
    let apart = x(nodes[17]) - x(nodes[0]);
    assert!((apart - 0.01).abs() < 1e-12, "{apart}");
    // The shock from element to element costs as much as it does without the body.
    assert!(last.error.abs() < 2e-2, "{last:?}");
}

#[test]
fn bodies_of_nodes_spans_and_masses_are_the_same_bits_on_any_workers() {
    let mut model = coupled();
    model.setup.control.end_cycle = 60;
    model.setup.control.end_time = 1.0;
    same_bits(&model);
    let rest = "[[mass]]\nface = \"i-max\"\nmass = 1e-3\n\
                [[boundary]]\ntype = \"rotation\"\nface = \"k-min\"\naxis = \"z\"\npoint = [0, 0, 0]\nrate = 1e4\nfrom = 2e-6\n\
                [[boundary]]\ntype = \"fixed\"\nface = \"k-max\"\nuntil = 6e-6\n\
                [[load]]\ntype = \"acceleration\"\nacceleration = [0, 1e6, 0]\nfrom = 1e-6\n";
    let mut model = cube(1.0, rest);
    model.setup.control.end_cycle = 60;
    same_bits(&model);
    let blast = "[[load]]\ntype = \"blast\"\nface = \"k-min\"\nmass = 1e-3\npoint = [0.005, 0.005, -0.02]\nburst = \"air\"\n\
                 [[load]]\ntype = \"blast\"\nmass = 1e-3\npoint = [0.05, 0.0, 0.0]\nburst = \"surface\"\nfrom = 1e-6\n";
    let mut model = cube(1.0, blast);
    model.setup.control.end_cycle = 60;
    same_bits(&model);
}

/// The time step foresees a motion that begins at full speed, and the quiet time before keeps its long steps.
#[test]
fn a_prescribed_motion_that_jumps_keeps_to_the_travel_of_contact() {
    let boundary = "[[boundary]]\nparts = [\"high\"]\ntype = \"velocity\"\nvelocity = { z = { curve = \"jump\", factor = -500 } }\n\
                    [[curve]]\nname = \"jump\"\npoints = [[0, 0], [9.99999e-6, 0], [1e-5, 1], [1, 1]]\n";
    let span =
        "[[boundary]]\nparts = [\"high\"]\ntype = \"velocity\"\nvelocity = { z = -500 }\nfrom = 1e-5\n";
    let turn = "[[boundary]]\nparts = [\"high\"]\ntype = \"rotation\"\naxis = \"y\"\npoint = [1.005, 0, 0]\nrate = -500\nfrom = 1e-5\n";
    let rigid = boundary
        .replace("[[boundary]]\nparts = [\"high\"]\ntype = \"velocity\"", "[[rigid]]\nparts = [\"high\"]");
    for (rest, jumps) in [(boundary, true), (&rigid, true), (span, true), (turn, true), ("", false)] {
        let high = part("high", 0.0, 0.0).replace("[0e0, 0, 0], size", "[0, 0, 0.015], size");
        let parts = format!("{}{high}", part("low", 0.0, 0.0));
        let model = cubes(1.4e-5, &parts, &format!("[contact]\ngap_fraction = 0.1\n{rest}"));
        let solved = run(model);
        let travel = solved.outcome.run_totals.worst_gap_travel;
        let quiet = longest_step(&solved);
        let last = solved.rows.iter().rev().nth(1).expect("rows").dt;
        let steady =
            solved.rows.iter().filter(|row| row.time < 9e-6).map(|row| row.dt).fold(f64::MAX, f64::min);
        assert!(travel < 0.2 && (travel > 0.15) == jumps, "{travel}: {rest}");
        assert!(!jumps || last < 0.6 * quiet, "{last:e} after, {quiet:e} before");
        assert!(steady > 0.99 * quiet, "{steady:e}, {quiet:e}: {rest}");
    }
}

#[test]
fn steps_that_foresee_a_motion_are_the_same_bits_on_any_workers_and_after_a_checkpoint() {
    let rest = "[contact]\ngap_fraction = 0.1\n[[boundary]]\nparts = [\"high\"]\ntype = \"velocity\"\n\
                velocity = { x = { curve = \"swell\", factor = 300 }, z = { curve = \"swell\", factor = -60 } }\n\
                [[curve]]\nname = \"swell\"\npoints = [[0, 0], [1e-6, 0.3], [4e-6, 1], [4.1e-6, 0.01], [9e-6, 3], [1, 3]]\n";
    let high = part("high", 0.0, 0.0).replace("[0e0, 0, 0], size", "[0, 0, 0.0106], size");
    let mut model = cubes(1.0, &format!("{}{high}", part("low", 0.0, 0.0)), rest);
    model.setup.control.end_cycle = 100;
    same_bits(&model);
}
