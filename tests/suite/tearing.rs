//! Shells erode: their layers break one by one, an element leaves with the last of them, and what it took to tear is booked.

#![expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions")]

use deck::Model;
use mechanics::state::field;
use tests::{
    bits::Fingerprint,
    solve::{Workers, model, solve},
};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

const YIELD: f64 = 0.3;
const YOUNG: f64 = 210.0;
const LIMIT: f64 = 0.1;

/// One shell that is drawn out along x until it breaks; it is free to become narrower (mm, ms, kg, GPa, J).
fn strip() -> Model {
    let (bulk, shear) = (YOUNG / (3.0 * (1.0 - 0.6)), YOUNG / (2.0 * 1.3));
    model(&format!(
        r#"
        title = "a shell in tension"
        units = "mm-ms-kg"
        [control]
        end_time = 0.7
        [[part]]
        name = "strip"
        material = {{ density = 7.85e-06, eos = {{ type = "linear", bulk = {bulk:?} }}, strength = {{ type = "von-mises", shear = {shear:?}, yield_stress = {YIELD} }} }}
        shell = {{ thickness = 1, points = 3 }}
        plate = {{ origin = [0, 0, 0], side_i = [10, 0, 0], side_j = [0, 10, 0], cells = [1, 1] }}
        erosion = {{ plastic_strain = {LIMIT} }}
        [[boundary]]
        type = "fixed"
        face = "i-min"
        axes = "x"
        [[boundary]]
        type = "velocity"
        face = "i-max"
        velocity = {{ x = 2 }}
        [output]
        history_cycles = 1
        "#
    ))
}

#[test]
fn a_shell_in_tension_breaks_at_its_limit_and_its_work_is_booked() {
    let solved = solve(strip(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(solved.outcome.run_totals.eroded_elements, 1);
    // Elastic energy up to yield, then a volume that stays at a stress that stays.
    let expected = 100.0 * (YIELD * YIELD / (2.0 * YOUNG) + YIELD * LIMIT);
    let eroded = solved.rows.last().expect("rows").eroded;
    println!("{eroded} J, expected {expected} J");
    assert!((eroded / expected - 1.0).abs() < 0.01, "{eroded} J, expected {expected} J");
    // The ends are d = 10 (e^0.1 - 1) mm further apart then, and a yield strain.
    let broken = solved.rows.iter().find(|row| row.eroded > 0.0).expect("it breaks").time;
    let stretch = 10.0 * ((LIMIT + YIELD / YOUNG).exp() - 1.0) / 2.0;
    println!("at {broken} ms, expected {stretch} ms");
    assert!((broken / stretch - 1.0).abs() < 0.01, "at {broken} ms, expected {stretch} ms");
    let error = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    assert!(error < 2e-3, "energy error {error}");
}

/// A ball that tears a hole into a sheet.
fn sheet(retain_inertia: bool) -> Model {
    model(&format!(
        r#"
        title = "a ball tears a sheet"
        units = "mm-ms-kg"
        [control]
        end_time = 1
        end_cycle = 500
        [[part]]
        name = "ball"
        material = "STEEL_4340"
        velocity = [0, 20, -900]
        sphere = {{ centre = [0, 0, 5.7], radius = 5, sector = "full", cells = [2, 1] }}
        [[part]]
        name = "sheet"
        material = "AL_2024_T351"
        shell = {{ thickness = 1, points = 5 }}
        plate = {{ origin = [-10, -10, 0], side_i = [20, 0, 0], side_j = [0, 20, 0], cells = [16, 16] }}
        erosion = {{ plastic_strain = 0.2 }}
        [contact]
        friction = 0.1
        [erosion]
        retain_inertia = {retain_inertia}
        [output]
        history_cycles = 1
        "#
    ))
}

#[test]
fn a_torn_sheet_has_the_same_bits_on_any_workers_and_closes_its_energy() {
    for retain_inertia in [true, false] {
        let model = sheet(retain_inertia);
        let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
        let gone = alone.outcome.run_totals.eroded_elements;
        assert!(gone > 5, "{gone} eroded");
        // Elements with a broken layer are still there.
        let worn =
            |&e: &usize| !alone.state.is_eroded(e) && alone.state.elements[field::PLASTIC_STRAIN][e] >= 0.2;
        let n_worn = (0..model.mesh.n_elements()).filter(worn).count();
        println!("{n_worn} elements with a broken layer are left");
        assert!(n_worn > 0, "layers break all at once");
        let error = alone.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
        println!("{gone} eroded, energy error {error}");
        assert!(error < 0.01, "energy error {error}");
        let mass = alone.rows.last().expect("rows").eroded_mass;
        let expected =
            gone as f64 * model.setup.materials[model.mesh.parts[1].material as usize].density * 1.25 * 1.25;
        assert!((mass / expected - 1.0).abs() < 1e-12, "{mass} kg eroded, expected {expected}");
        same_bits(&model);
        same_bits_on_route_direct(&model, &Fingerprint::of(&alone));
    }
}

#[test]
fn a_worker_of_a_sheet_that_tears_is_lost_and_changes_no_bit() {
    for retain_inertia in [true, false] {
        losing_a_worker_changes_no_bit(&sheet(retain_inertia));
    }
}

/// A ball that breaks the plies of a panel one by one, and elements with them.
fn panel() -> Model {
    model(
        r#"
        title = "a ball goes through plies"
        units = "mm-ms-kg"
        [control]
        end_time = 1
        end_cycle = 700
        [[part]]
        name = "ball"
        material = "STEEL_4340"
        velocity = [0, 5, -150]
        sphere = { centre = [0, 0, 5.6], radius = 5, sector = "full", cells = [2, 1] }
        [[part]]
        name = "panel"
        material = "KEVLAR_49_EPOXY"
        shell = { plies = [{ angle = 0, thickness = 0.3 }, { angle = 60, thickness = 0.2 }, { angle = -60, thickness = 0.3 }], points = 2 }
        plate = { origin = [-10, -10, 0], side_i = [20, 0, 0], side_j = [0, 20, 0], cells = [16, 16] }
        clamp = "edges"
        erosion = { failure = true }
        [contact]
        gap_length = 0.3
        friction = 0.1
        [output]
        history_cycles = 1
        "#,
    )
}

#[test]
fn plies_that_break_have_the_same_bits_on_any_workers_and_over_a_loss_and_close_their_energy() {
    let model = panel();
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let gone = alone.outcome.run_totals.eroded_elements;
    println!("{gone} eroded");
    assert!(gone > 3, "{gone} eroded");
    let error = alone.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    assert!(error < 0.01, "energy error {error}");
    same_bits(&model);
    same_bits_on_route_direct(&model, &Fingerprint::of(&alone));
    losing_a_worker_changes_no_bit(&model);
}
