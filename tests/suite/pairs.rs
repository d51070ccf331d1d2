//! Kinds of pairs of contact that keep a history or act from the start: friction that sticks, ties. None changes a bit with the
//! cut, the route, the lanes or a loss.

use deck::Model;
use tests::{
    bits::Fingerprint,
    solve::{Workers, model, solve},
};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// Blocks that slide on each other and stick, and one that is tied to the lowest by nodes that do not match.
fn stuck_and_tied() -> Model {
    model(
        r#"
        title = "tied and stuck blocks"
        units = "cm-g-us"
        [control]
        end_cycle = 260
        end_time = 1e3
        [[part]]
        name = "below"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0], size = [9, 8, 4], cells = [6, 5, 3] }
        [[part]]
        name = "above"
        material = "STEEL_1006"
        box = { origin = [1.3, 0.7, 4], size = [6, 6, 2], cells = [7, 6, 2] }
        [[part]]
        name = "striker"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.05]
        box = { origin = [2, 1, 6.15], size = [4, 4, 3], cells = [4, 4, 3] }
        [contact]
        gap_length = 0.1
        friction = 0.4
        friction_kinetic = 0.2
        friction_decay = 100
        [[contact.tie]]
        nodes = "above"
        faces = "below"
        [output]
        history_cycles = 1
        "#,
    )
}

#[test]
fn tied_blocks_and_one_that_sticks_have_the_same_bits_on_both_routes() {
    let model = stuck_and_tied();
    assert_eq!(model.setup.contact.as_ref().map(|contact| contact.ties.len()), Some(56));
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let stretched = alone.state.contact.iter().flatten().any(|&elongation| elongation != 0.0);
    assert!(stretched, "nothing sticks at the end");
    assert!(alone.rows.last().is_some_and(|row| row.friction > 0.0 && row.error.abs() < 5e-3));
    same_bits(&model);
    same_bits_on_route_direct(&model, &Fingerprint::of(&alone));
}

#[test]
fn a_worker_with_ties_and_springs_that_stick_is_lost_without_a_bit() {
    losing_a_worker_changes_no_bit(&stuck_and_tied());
}
