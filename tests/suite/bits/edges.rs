//! Same bits where edges meet edges.

use deck::Model;
use tests::{
    bits::Fingerprint,
    solve::{Workers, model, solve},
};

use super::{losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// Ridge over ridge, bars across the rim of a sheet, one body rigid, one that erodes: edges meet edges before any node
/// meets a face.
fn crossing_edges() -> Model {
    model(
        r#"
        title = "edges"
        units = "mm-ms-kg"
        [control]
        end_cycle = 500
        end_time = 1e3
        [[part]]
        name = "ridge"
        material = "STEEL_4340"
        box = { origin = [-3, -3, -3], size = [6, 6, 6], cells = [3, 3, 3] }
        rotate = { axis = [1, 0, 0], degrees = 45 }
        [[part]]
        name = "across"
        material = "STEEL_4340"
        velocity = [10, 20, -300]
        box = { origin = [-3, -3, -3], size = [6, 6, 6], cells = [3, 3, 3] }
        rotate = { axis = [0.1, 1, 0], degrees = 45 }
        translate = [0.3, 0.2, 8.9]
        [[part]]
        name = "soft"
        material = "AL_2024_T351"
        velocity = [-300, 0, 0]
        box = { origin = [-3, -3, -3], size = [6, 6, 6], cells = [4, 4, 4] }
        rotate = { axis = [0, 0.1, 1], degrees = 45 }
        translate = [9.4, 0.1, 0.4]
        erosion = { geometric_strain = 0.2 }
        [[part]]
        name = "sheet"
        material = "MILD_STEEL"
        shell = { thickness = 0.4 }
        plate = { origin = [-12, -3, 0.3], side_i = [0, 6, 0], side_j = [-8, 0, 0], cells = [4, 5] }
        [[part]]
        name = "bar"
        material = "STEEL_4340"
        velocity = [-200, 0, 10]
        box = { origin = [-11.6, -0.6, -4], size = [2, 2, 8], cells = [1, 1, 4] }
        rotate = { axis = [0, 0, 1], degrees = 45, point = [-10.6, 0.4, 0] }
        translate = [0.6, 0, 0]
        [[rigid]]
        parts = ["bar"]
        [contact]
        gap_fraction = 0.15
        friction = 0.1
        edges = true
        [output]
        history_cycles = 1
        contact_forces = [["ridge", "across"], ["bar", "sheet"]]
        "#,
    )
}

#[test]
fn edges_that_meet_edges_have_the_same_bits_on_both_routes() {
    let model = crossing_edges();
    same_bits(&model);
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let row = alone.rows.last().expect("rows");
    assert!(row.error.abs() < 0.02, "energy error {}", row.error);
    for pair in 0..2 {
        let met =
            alone.rows.iter().any(|row| row.contacts.iter().any(|(p, vote)| *p == pair && vote.hits > 0));
        assert!(met, "pair {pair} never met");
    }
    println!("{} eroded, energy error {}", alone.outcome.run_totals.eroded_elements, row.error);
    assert!(alone.outcome.run_totals.eroded_elements > 0, "nothing eroded");
    let one = Fingerprint::of(&alone);
    same_bits_on_route_direct(&model, &one);
    let mut without = model.clone();
    without.setup.contact.as_mut().expect("the deck has contact").edges = false;
    let without = solve(without, Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_ne!(without.outcome.digest, one.digest, "edges change nothing");
}

#[test]
fn a_worker_with_edges_that_is_lost_changes_no_bit() {
    let mut model = crossing_edges();
    model.setup.control.end_cycle = 240;
    losing_a_worker_changes_no_bit(&model);
}
