//! Composite tetrahedra in whole runs.

use deck::Model;
use tests::{
    solve::{model, run},
    tetrahedra::cut,
};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits};

/// A plate that is struck, breaks and is worn off, and a block that flows: tetrahedra against tetrahedra and a pool of hexahedra.
fn struck_plate() -> Model {
    let plates = model(
        r#"
        title = "plates of tetrahedra"
        units = "cm-g-us"
        [control]
        end_cycle = 260
        end_time = 1e3
        [[part]]
        name = "target"
        material = "AL_2024_T351"
        fracture = true
        erosion = { geometric_strain = 0.05 }
        box = { origin = [0, 0, 0], size = [8, 8, 2], cells = [4, 4, 1] }
        [[part]]
        name = "projectile"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.06]
        box = { origin = [1.3, 0.7, 2.2], size = [4, 4, 2], cells = [2, 2, 1] }
        rotate = { axis = [1, 2, 0], degrees = 2, point = [4, 4, 2.2] }
        translate = [0, 0, 0.2]
        [[part]]
        name = "pool"
        material = "WATER"
        box = { origin = [0, 0, -2.2], size = [8, 8, 2], cells = [6, 6, 2] }
        [contact]
        gap_length = 0.15
        [output]
        history_cycles = 1
        "#,
    );
    cut(plates, |name| name != "pool")
}

#[test]
fn tetrahedra_have_the_same_bits_everywhere() {
    let model = struck_plate();
    let solved = run(model.clone());
    assert!(solved.state.n_eroded() > 0, "nothing eroded");
    assert!(solved.state.own.iter().any(|array| array.iter().any(|value| *value != 0.0)));
    let error = solved.outcome.run_totals.last.error;
    println!("{} eroded, energy error {error}", solved.state.n_eroded());
    assert!(error.abs() < 0.01, "energy error {error}");
    same_bits(&model);
}

#[test]
fn a_worker_with_tetrahedra_that_is_lost_changes_no_bit() {
    losing_a_worker_changes_no_bit(&struck_plate());
}

/// A bar that is thrown across keeps its energy.
#[test]
fn an_elastic_bar_of_tetrahedra_keeps_its_energy_over_twenty_thousand_cycles() {
    let bar = model(
        r#"
        title = "bar"
        units = "mm-ms-kg"
        [control]
        end_cycle = 20000
        end_time = 1e3
        [[part]]
        name = "bar"
        material = { density = 7.85e-6, eos = { type = "linear", bulk = 175 }, strength = { type = "elastic", shear = 80.77 } }
        box = { origin = [0, 0, 0], size = [20, 4, 4], cells = [5, 1, 1] }
        "#,
    );
    let mut model = cut(bar, |_| true);
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        v[2] = 4.0 * (x[0] / 20.0 - 0.5).powi(2);
    }
    let solved = run(model);
    let last = &solved.outcome.run_totals.last;
    println!("energy error {}", last.error);
    assert!(last.error.abs() < 1e-4, "energy error {}", last.error);
    assert_eq!(last.hourglass, 0.0);
}
