//! What a run starts with: strength that scatters, axes of elements, nodes that a study has shaken.

use deck::{
    Model,
    bundle::{self, Options},
    perturb::Perturbation,
};
use tests::solve::{Workers, example, model, run};

use crate::bits::{fingerprint, losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// A model that ends at this cycle, before its end time.
fn ending(cycle: u64, mut model: Model) -> Model {
    model.setup.control.end_cycle = cycle;
    model
}

/// The ring is driven from rest to 240 m/s: its sums of momentum are exact though no number of the deck says so fast.
#[test]
fn a_ring_that_a_pressure_breaks_has_the_same_bits_on_any_workers() {
    let ring = ending(900, example("ring-breaks"));
    same_bits(&ring);
    same_bits_on_route_direct(&ring, &fingerprint(&ring, Workers::default()));
    losing_a_worker_changes_no_bit(&ending(700, ring));
}

#[test]
fn a_wound_tube_has_the_same_bits_on_any_workers() {
    let tube = ending(
        120,
        model(
            r#"
            title = "wound tube"
            units = "SI"
            [control]
            end_time = 1
            [[part]]
            name = "tube"
            material = "CARBON_AS4_3501_6"
            axes = { around = [0, 0, 1], angle = 45 }
            tube = { base = [0, 0, 0], inner_radius = 0.01, outer_radius = 0.012, length = 0.02, cells = [2, 24, 10] }
            clamp = ["k-min"]
            [[load]]
            type = "pressure"
            parts = ["tube"]
            face = "k-max"
            pressure = 50e6
            [output]
            history_cycles = 5
            "#,
        ),
    );
    same_bits(&tube);
    losing_a_worker_changes_no_bit(&tube);
}

#[test]
fn bodies_one_gap_apart_begin_when_a_study_has_shaken_their_nodes() {
    let deck = r#"
        title = "two blocks"
        units = "SI"
        [control]
        end_cycle = 2
        [[part]]
        name = "low"
        material = "STEEL_1006"
        box = { origin = [0, 0, 0], size = [4, 4, 1], cells = [4, 4, 1] }
        [[part]]
        name = "high"
        material = "STEEL_1006"
        velocity = [0, 0, 1]
        box = { origin = [0, 0, 1.2], size = [4, 4, 1], cells = [4, 4, 1] }
        [contact]
        gap_length = 0.2
    "#;
    for seed in 0..4 {
        let options =
            Options { perturbation: Some(Perturbation { nodes: 1e-9, seed }), ..Options::default() };
        let text = bundle::gather("blocks.toml", deck.to_owned(), &options, &mut |_| None).expect("one file");
        let shaken = run(model(&text));
        assert_eq!(shaken.outcome.cycles_run, 2, "seed {seed}");
        let energies = shaken.rows.last().map(|row| row.contact / row.kinetic);
        assert!(energies.is_some_and(|share| share < 1e-6), "{energies:?}");
    }
}
