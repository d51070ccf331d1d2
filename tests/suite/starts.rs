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

/// A rigid block that rests one gap above a rigid plate, and a soft spring that pulls it: what alone deforms would bear a step far longer than
/// their contact does.
#[test]
fn rigid_bodies_that_begin_in_contact_stay_where_all_else_is_soft() {
    let solved = run(model(
        r#"
        title = "block on a plate"
        units = "mm-ms-kg"
        [control]
        end_time = 3
        [[material]]
        name = "any"
        density = 7.85e-6
        eos = { type = "linear", bulk = 0.1 }
        strength = { type = "elastic", shear = 0.05 }
        [[part]]
        name = "block"
        material = "any"
        box = { origin = [0, 0, 0.5], size = [10, 10, 5], cells = [2, 2, 1] }
        [[part]]
        name = "plate"
        material = "any"
        box = { origin = [-10, -10, -5], size = [30, 30, 5], cells = [3, 3, 1] }
        [[part]]
        name = "spring"
        spring = { stiffness = 2e-5 }
        mesh = { nodes = [[900001, 10, 5, 5.5], [900002, 30, 5, 5.5]], elements = [[1, 900001, 900002]] }
        [[join]]
        parts = ["block", "spring"]
        [[mass]]
        nodes = [900002]
        mass = 0.001
        [[boundary]]
        type = "velocity"
        nodes = [900002]
        velocity = { x = 0.5, y = 0, z = 0 }
        [[rigid]]
        parts = ["block"]
        [[rigid]]
        parts = ["plate"]
        velocity = { x = 0, y = 0, z = 0 }
        spin = { x = 0, y = 0, z = 0 }
        [contact]
        friction = 0.4
        gap_length = 0.5
        [gravity]
        acceleration = [0, 0, -0.01]
        "#,
    ));
    let last = &solved.outcome.run_totals.last;
    // Its weight is 3.9e-5 kN, and the spring pulls it with up to 3e-5 kN, which friction does not hold.
    let fastest = solved.part_velocity(0).map(f64::abs).into_iter().fold(0.0, f64::max);
    assert!(fastest < 0.05 && last.error.abs() < 0.01, "{fastest} {last:?}");
}

/// Blocks of equal outline, glued and pressed on each other until the glue lets go: its nodes on the rim lie on two faces of the other block.
#[test]
fn a_tie_that_lets_go_on_the_rim_of_a_body_gives_no_energy() {
    for (cells, friction) in [("[6, 6, 2]", 0.0), ("[6, 6, 2]", 0.3), ("[4, 4, 2]", 0.0)] {
        let part = |name: &str, z: u32, cells: &str, speed: i32| {
            format!(
                "[[part]]\nname = \"{name}\"\nvelocity = [0, 0, {speed}]\n\
                 material = {{ density = 2.7e-6, eos = {{ type = \"linear\", bulk = 68.6 }}, strength = {{ type = \"elastic\", shear = 26.3 }} }}\n\
                 box = {{ origin = [0, 0, {z}], size = [10, 10, 4], cells = {cells} }}\n"
            )
        };
        let solved = run(model(&format!(
            "title = \"glued\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.01\n{}{}\
             [[boundary]]\ntype = \"fixed\"\nparts = [\"low\"]\nface = \"k-min\"\naxes = \"z\"\n\
             [contact]\nfriction = {friction}\n\
             [[contact.tie]]\nnodes = \"low\"\nfaces = \"high\"\ntensile_strength = 5e-4\nshear_strength = 5e-4\n",
            part("low", 0, cells, 0),
            part("high", 4, "[4, 4, 2]", -50)
        )));
        let totals = &solved.outcome.run_totals;
        assert!(totals.last.error.abs() < 5e-3, "{cells} {friction}: {:?}", totals.last);
    }
}
