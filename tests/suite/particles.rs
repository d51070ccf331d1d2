//! Nodes without elements that press on each other in whole runs: rubble in a box bears its piston, debris keeps energy and momentum, and no cut,
//! route, lane, restart or loss changes a bit.

use deck::Model;
use mechanics::state::ALIVE;
use tests::{
    bits::Fingerprint,
    solve::{Solved, Workers, example, model, solve},
};

use crate::{
    bits::{losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct},
    erosion::snapshots_after_an_erosion,
};

fn solved(model: &Model) -> Solved {
    solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Lets freed nodes pass through each other.
fn without_particles(mut model: Model) -> Model {
    model.setup.contact.as_mut().expect("contact").particles.clear();
    model
}

/// A box of 4 x 4 x 8 mm full of a material of 40 GPa whose elements all leave in the first cycle, under a piston that comes down at 40 m/s.
fn rubble() -> Model {
    let mut walls = String::from("[[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n");
    for (point, normal) in [([0, 0], [1, 0]), ([4, 0], [-1, 0]), ([0, 0], [0, 1]), ([0, 4], [0, -1])] {
        let ([x, y], [a, b]) = (point, normal);
        walls += &format!("[[wall]]\npoint = [{x}, {y}, 0]\nnormal = [{a}, {b}, 0]\n");
    }
    model(&format!(
        r#"
        title = "rubble under a piston"
        units = "mm-ms-kg"
        [control]
        end_time = 0.1
        [[material]]
        name = "brittle"
        density = 2.7e-6
        eos = {{ type = "linear", bulk = 40.0 }}
        strength = {{ type = "elastic", shear = 20.0 }}
        [[material]]
        name = "steel"
        density = 7.85e-6
        eos = {{ type = "linear", bulk = 160.0 }}
        strength = {{ type = "elastic", shear = 80.0 }}
        [[part]]
        name = "rubble"
        material = "brittle"
        box = {{ origin = [0, 0, 0], size = [4, 4, 8], cells = [4, 4, 8] }}
        erosion = {{ time_step = 1.0 }}
        [[part]]
        name = "piston"
        material = "steel"
        velocity = [0, 0, -40]
        box = {{ origin = [0, 0, 8.15], size = [4, 4, 1], cells = [4, 4, 1] }}
        [[boundary]]
        type = "velocity"
        parts = ["piston"]
        velocity = {{ x = 0, y = 0, z = -40 }}
        {walls}
        [erosion]
        particles = "all"
        [contact]
        [output]
        history_cycles = 2
        "#
    ))
}

/// The floor and the piston; the bulk modulus is 40 GPa.
#[test]
fn rubble_in_a_box_bears_its_piston_about_as_stiffly_as_its_bulk_modulus() {
    const AREA: f64 = 16.0;
    const BULK: f64 = 40.0;
    let pressed = solved(&rubble());
    assert!(pressed.state.eroded[..128].iter().all(|&cycle| cycle == 1), "all leave at once");
    // Mean pressure on the floor around a height of the piston, from the work of the piston between two times.
    let pressure = |run: &Solved, height: f64| {
        let near: Vec<f64> = run
            .rows
            .iter()
            .filter(|row| (8.15 - 40.0 * row.time - height).abs() < 0.1)
            .map(|row| row.holders[0].force[2] / AREA)
            .collect();
        assert!(near.len() > 5, "{} rows at {height}", near.len());
        near.iter().sum::<f64>() / near.len() as f64
    };
    let heights = [7.0, 6.0, 5.0, 4.6, 4.3];
    let found = heights.map(|height| pressure(&pressed, height));
    let stiffness = (found[4] - found[3]) / ((heights[3] - heights[4]) / heights[3]);
    println!(
        "pressure {found:.3?} GPa at heights {heights:?} mm of 8; stiffness there {stiffness:.2} GPa of {BULK}"
    );
    assert!(found[4] > 0.01 * BULK, "{found:?}");
    assert!((0.05 * BULK..BULK).contains(&stiffness), "{stiffness}");
    let worst = pressed.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    assert!(worst < 0.01, "energy error {worst}");
    let fallen = solved(&without_particles(rubble()));
    let through = heights.map(|height| pressure(&fallen, height));
    println!("without: {through:.4?} GPa");
    assert!(through.iter().all(|p| p.abs() < 0.05 * found[4]), "{through:?}");
}

/// The example: the piston bounces, and no energy comes in where particles are born.
#[test]
fn rubble_throws_a_piston_back_that_falls_to_the_floor_without_it() {
    let piston = |run: &Solved| {
        let nodes = &run.model.mesh.parts[1].nodes;
        nodes.iter().map(|&n| run.state.x[n as usize][2]).fold(f64::INFINITY, f64::min)
    };
    let lowest =
        |run: &Solved| run.rows.iter().map(|row| row.part_momenta[1][2]).fold(f64::NEG_INFINITY, f64::max);
    let with = solved(&example("rubble-in-box"));
    let without = solved(&without_particles(example("rubble-in-box")));
    let mass = 8.0 * 8.0 * 3.0 * 7.83e-6;
    println!(
        "with: piston at {:.3} mm, fastest up {:.2} m/s, error {:.2e}; without: {:.3} mm, {:.2} m/s, {:.2e}",
        piston(&with),
        lowest(&with) / mass,
        with.rows.last().expect("rows").error,
        piston(&without),
        lowest(&without) / mass,
        without.rows.last().expect("rows").error,
    );
    assert!(lowest(&with) > 15.0 * mass && piston(&with) > 2.0 * piston(&without).max(0.5));
    for run in [&with, &without] {
        let worst = run.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
        assert!(worst < 0.005, "energy error {worst}");
    }
}

/// Two plates of brittle cells that shatter on each other at 600 m/s, so that both clouds meet; nothing holds them.
fn clouds() -> Model {
    model(
        r#"
        title = "two plates shatter on each other"
        units = "mm-ms-kg"
        [control]
        end_time = 0.015
        [[material]]
        name = "glass"
        density = 2.5e-6
        eos = { type = "linear", bulk = 45.0 }
        strength = { type = "von-mises", shear = 30.0, yield_stress = 0.2, hardening = 0 }
        [[part]]
        name = "upper"
        material = "glass"
        velocity = [20, 0, -300]
        box = { origin = [-3, -3, 0.1], size = [6, 6, 2], cells = [12, 12, 4] }
        erosion = { plastic_strain = 0.15 }
        [[part]]
        name = "lower"
        material = "glass"
        velocity = [0, 0, 300]
        box = { origin = [-2.8, -3.1, -2.1], size = [6, 6, 2], cells = [12, 12, 4] }
        erosion = { plastic_strain = 0.15 }
        [erosion]
        particles = "all"
        [contact]
        [output]
        history_cycles = 1
        "#,
    )
}

#[test]
fn debris_that_meets_debris_keeps_energy_and_momentum_and_does_not_burst_at_birth() {
    let with = solved(&clouds());
    let without = solved(&without_particles(clouds()));
    let eroded = |run: &Solved| run.state.eroded.iter().filter(|&&cycle| cycle != ALIVE).count();
    assert!(eroded(&with) > 200, "{} eroded", eroded(&with));
    let pressed = |run: &Solved| run.rows.iter().map(|row| row.contact).fold(0.0, f64::max);
    assert_ne!(Fingerprint::of(&with), Fingerprint::of(&without), "particles have pressed");
    let mut jumps_of = Vec::new();
    for (name, run) in [("with", &with), ("without", &without)] {
        let (first, last) = (&run.rows[0], run.rows.last().expect("rows"));
        let worst = run.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
        let scale: f64 = first.part_momenta.iter().map(|p| p[2].abs()).sum();
        let drift = (0..3).map(|a| (last.momentum[a] - first.momentum[a]).abs()).fold(0.0, f64::max) / scale;
        // What comes into motion in a cycle: all that springs and elements give back.
        let jumps = run.rows.windows(2).map(|rows| (rows[1].kinetic - rows[0].kinetic) / first.kinetic);
        let jump = jumps.fold(0.0, f64::max);
        println!(
            "{name}: {} eroded, energy error {:.2e}, {worst:.2e} at worst, momentum {drift:.1e}, kinetic energy {:.3} of the first, rises by {jump:.1e} in a cycle at most, in springs {:.2e}",
            eroded(run),
            last.error,
            last.kinetic / first.kinetic,
            pressed(run) / first.kinetic,
        );
        assert!(worst < 0.005, "{name}: energy error {worst}");
        assert!(drift < 1e-12, "{name}: momentum {drift}");
        jumps_of.push(jump);
    }
    // Plates that strike each other set more in motion than births may.
    let [with, without] = jumps_of[..] else { panic!("{jumps_of:?}") };
    assert!(
        with <= 1.02 * without,
        "kinetic energy rises by {with} in a cycle, by {without} without particles"
    );
}

/// The example with fewer cells and a faster piston, until particles press.
fn short() -> Model {
    let mut model = model(
        r#"
        title = "a little rubble in a box"
        units = "mm-ms-kg"
        [control]
        end_cycle = 420
        end_time = 1.0
        [[material]]
        name = "brittle"
        density = 2.3e-6
        eos = { type = "linear", bulk = 13 }
        strength = { type = "elastic", shear = 10 }
        [[part]]
        name = "block"
        material = "brittle"
        box = { origin = [-2, -2, 0], size = [4, 4, 5], cells = [4, 4, 5] }
        erosion = { compressive_strain = 0.02, principal_strain = 0.01 }
        [[part]]
        name = "piston"
        material = "STEEL_4340"
        velocity = [3, 0, -200]
        box = { origin = [-2, -2, 5.15], size = [4, 4, 2], cells = [4, 4, 2] }
        [[wall]]
        point = [0, 0, 0]
        normal = [0, 0, 1]
        [[wall]]
        point = [-2, 0, 0]
        normal = [1, 0, 0]
        [[wall]]
        point = [0, -2, 0]
        normal = [0, 1, 0]
        [erosion]
        particles = ["block"]
        [contact]
        friction = 0.1
        [output]
        history_cycles = 1
        "#,
    );
    model.output.history_cycles = 1;
    model
}

#[test]
fn particles_have_the_same_bits_on_any_workers() {
    let model = short();
    let alone = solved(&model);
    let one = Fingerprint::of(&alone);
    assert_ne!(one, Fingerprint::of(&solved(&without_particles(model.clone()))), "particles have pressed");
    same_bits(&model);
    same_bits_on_route_direct(&model, &one);
}

#[test]
fn a_snapshot_while_particles_are_born_changes_no_bit() {
    snapshots_after_an_erosion(&short());
}

#[test]
fn a_worker_of_particles_that_is_lost_changes_no_bit() {
    losing_a_worker_changes_no_bit(&short());
}
