//! Kinds of pairs of contact that keep a history or act from the start: friction that sticks, ties, and ties that break. None changes a bit with the
//! cut, the route, the lanes or a loss.

use deck::Model;
use tests::{
    bits::Fingerprint,
    solve::{Workers, model, run, solve},
};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// Blocks that slide on each other and stick, and one that is tied to the lowest by nodes that do not match.
fn stuck_and_tied() -> Model {
    model(STUCK_AND_TIED)
}

const STUCK_AND_TIED: &str = r#"
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
        "#;

/// The same blocks where ties break, those near the striker first; the parts meet and stick then.
fn bonded() -> Model {
    model(&bonded_text())
}

fn bonded_text() -> String {
    let text = STUCK_AND_TIED.replace(
        "faces = \"below\"",
        "faces = \"below\"\ntensile_strength = 1.2e-2\nshear_strength = 1.2e-2",
    );
    text.replace("end_cycle = 260", "end_cycle = 200")
}

#[test]
fn ties_that_break_have_the_same_bits_on_both_routes() {
    let model = bonded();
    let settings = model.setup.contact.clone().expect("contact");
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let broken = settings.n_broken(&alone.state.contact).expect("ties that can break");
    let last = alone.rows.last().expect("rows");
    println!("{broken} of {} ties broken, energy error {}", settings.ties.len(), last.error);
    assert!((5..50).contains(&broken), "{broken} ties broken");
    assert!(last.error.abs() < 5e-3, "{}", last.error);
    same_bits(&model);
    same_bits_on_route_direct(&model, &Fingerprint::of(&alone));
}

#[test]
fn a_worker_is_lost_among_ties_that_break_without_a_bit() {
    losing_a_worker_changes_no_bit(&bonded());
}

/// The same where the lower block erodes too, so that ties let go of faces that leave.
#[test]
fn ties_that_break_on_a_part_that_erodes_have_the_same_bits() {
    let model = model(
        &bonded_text().replace("name = \"below\"", "name = \"below\"\nerosion = { plastic_strain = 0.02 }"),
    );
    let settings = model.setup.contact.clone().expect("contact");
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let broken = settings.n_broken(&alone.state.contact).expect("ties that can break");
    println!("{broken} ties broken, {} elements eroded", alone.state.n_eroded());
    assert!((5..56).contains(&broken) && alone.state.n_eroded() > 0);
    same_bits(&model);
    losing_a_worker_changes_no_bit(&model);
}

/// A block that is thrown aslant from the one to which it is tied, and breaks off in shear while it is pressed.
#[test]
fn a_block_that_breaks_off_in_shear_rests_on_the_other_where_they_meet_and_passes_where_they_do_not() {
    let thrown = |contact: &str| {
        let text = format!(
            r#"
            title = "sheared off"
            units = "cm-g-us"
            [control]
            end_time = 60
            [[part]]
            name = "below"
            material = "AL_2024_T351"
            box = {{ origin = [0, 0, 0], size = [9, 8, 4], cells = [6, 5, 3] }}
            [[part]]
            name = "above"
            material = "STEEL_1006"
            velocity = [0.02, 0, -0.005]
            box = {{ origin = [1.3, 0.7, 4], size = [5, 5, 2], cells = [6, 6, 2] }}
            [contact]
            gap_length = 0.2
            {contact}
            [[contact.tie]]
            nodes = "above"
            faces = "below"
            shear_strength = 1e-3
            "#
        );
        let solved = run(model(&text));
        let settings = solved.model.setup.contact.clone().expect("contact");
        assert_eq!(settings.n_broken(&solved.state.contact), Some(49), "all let go");
        let error = solved.rows.last().expect("rows").error;
        let up = solved.part_velocity(1)[2] - solved.part_velocity(0)[2];
        println!(
            "{contact}: relative velocity {up}, energy error {error}, depth {}",
            solved.outcome.run_totals.worst_penetration
        );
        assert!(error.abs() < 5e-3, "{error}");
        (up, solved.outcome.run_totals.worst_penetration)
    };
    let (up, depth) = thrown("");
    assert!(up > 0.0 && depth > 0.0, "{up}, {depth}");
    let (up, depth) = thrown("default_interacts = false");
    assert!(up < -0.002 && depth == 0.0, "{up}, {depth}");
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
