//! Same bits where shells and solids meet.

use deck::Model;
use mechanics::{
    element::shell4::{InPlane, Rule},
    mesh::{Section, Topology},
};
use tests::{
    bits::Fingerprint,
    solve::{Workers, model, solve},
};

use super::{fingerprint, losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// A tube of shells on a wall, a ball inside that its sides stop, a lid that falls on it, and a bar that the lid carries on a
/// hinge along its edge.
fn shells_and_solids() -> Model {
    model(
        r#"
        title = "shells and solids"
        units = "SI"
        [control]
        end_time = 1
        end_cycle = 500
        [[material]]
        name = "steel"
        density = 7830
        eos = { type = "linear", bulk = 175e9 }
        strength = { type = "von-mises", shear = 80e9, yield_stress = 250e6, hardening = 500e6, cowper_symonds = { reference = 40.4, exponent = 5 } }
        [[part]]
        name = "bar"
        material = "steel"
        velocity = [0, 0, -20]
        box = { origin = [0.045, -0.045, 0.034], size = [0.01, 0.09, 0.01], cells = [1, 9, 1] }
        [[part]]
        name = "tube"
        material = "steel"
        velocity = [0, 0, -20]
        shell = { thickness = 1.2e-3 }
        prism = { axis = "z", base = [0, 0, 1e-4], radius = 0.0424, length = 0.04, sides = 4, cells = [40, 8] }
        [[part]]
        name = "ball"
        material = "steel"
        velocity = [60, 5, -20]
        sphere = { centre = [0.012, 0, 0.023], radius = 0.015, sector = "full", cells = [1, 1] }
        [[part]]
        name = "lid"
        material = "steel"
        velocity = [0, 0, -30]
        shell = { thickness = 2e-3, points = 5, rule = "lobatto" }
        plate = { origin = [-0.045, -0.045, 0.044], side_i = [0.09, 0, 0], side_j = [0, 0.09, 0], cells = [9, 9] }
        [[join]]
        parts = ["bar", "lid"]
        [[wall]]
        point = [0, 0, 0]
        normal = [0, 0, 1]
        friction = 0.2
        [[boundary]]
        type = "fixed"
        parts = ["lid"]
        face = "i-min"
        axes = ""
        rotations = "y"
        [contact]
        gap_length = 0.6e-3
        self_interaction = "all"
        friction = 0.1
        [output]
        history_cycles = 1
        [[gauge]]
        name = "rim"
        part = "lid"
        point = [0.045, 0, 0.044]
        "#,
    )
}

/// The lid of another thickness in each of its elements, as a mesh has it: pieces take those of their own elements.
#[test]
fn shells_of_many_thicknesses_have_the_same_bits() {
    let mut model = shells_and_solids();
    let lid = &mut model.mesh.parts[3];
    let n = lid.n_elements();
    let Topology::Shells { thicknesses, .. } = &mut lid.topology else { panic!("shells") };
    *thicknesses = (0..n).map(|e| 1.5e-3 + 1e-5 * e as f64).collect();
    same_bits(&model);
}

#[test]
fn shells_and_solids_in_contact_have_the_same_bits_on_both_routes() {
    let model = shells_and_solids();
    same_bits(&model);
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let row = alone.rows.last().expect("rows");
    assert!(row.error.abs() < 0.02, "energy error {}", row.error);
    // Shells turn, layers yield, and bodies of both kinds meet: without the ball the bits are others.
    assert!(alone.state.shells.spin.iter().flatten().any(|w| w.abs() > 1.0));
    let one = Fingerprint::of(&alone);
    same_bits_on_route_direct(&model, &one);
    for pair in [[1, 2], [1, 3]] {
        let mut other = model.clone();
        let contact = other.setup.contact.as_mut().expect("the deck has contact");
        let n = other.mesh.parts.len();
        for [a, b] in [pair, [pair[1], pair[0]]] {
            contact.interacts[a * n + b] = false;
        }
        assert_ne!(fingerprint(&other, Workers::default()).digest, one.digest, "parts {pair:?} never meet");
    }
}

/// The same, but the tube has four points in its plane, and the lid is a membrane of four points.
fn four_points() -> Model {
    let mut model = shells_and_solids();
    let parts = &mut model.mesh.parts;
    for (part, is_membrane) in [(1, false), (3, true)] {
        let Topology::Shells { section, .. } = &mut parts[part].topology else { panic!("a part of shells") };
        *section = Section {
            in_plane: InPlane::Four,
            is_membrane,
            ..Section::of(section.thickness, Rule::Gauss(if is_membrane { 1 } else { 3 }))
        };
    }
    model
}

#[test]
fn shells_of_four_points_and_membranes_have_the_same_bits() {
    let model = four_points();
    same_bits(&model);
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let row = alone.rows.last().expect("rows");
    assert!(row.error.abs() < 0.02, "energy error {}", row.error);
    let one = Fingerprint::of(&alone);
    same_bits_on_route_direct(&model, &one);
    assert_ne!(fingerprint(&shells_and_solids(), Workers::default()).digest, one.digest);
}

#[test]
fn a_worker_of_shells_that_is_lost_changes_no_bit() {
    let mut model = shells_and_solids();
    model.setup.control.end_cycle = 120;
    losing_a_worker_changes_no_bit(&model);
}
