//! Joints: the same bits on any workers and both routes, over a loss and over a snapshot.

use deck::Model;
use tests::{
    bits::Fingerprint,
    solve::{Workers, model, solve},
};

use crate::bits::{
    losing_a_worker_changes_no_bit, same_bits, same_bits_from_files, same_bits_on_route_direct,
};

/// A flail: an arm on a hinge that a curve drives, a chain of two links on balls, and a head on a universal joint, which strikes a block
/// that deforms. A plate slides on the block's far side along a rail.
fn flail() -> Model {
    let link = |name: &str, at: f64| {
        format!(
            "[[part]]\nname = \"{name}\"\nmaterial = \"STEEL_4340\"\n\
             box = {{ origin = [{at}, -0.5, -0.5], size = [3, 1, 1], cells = [3, 1, 1] }}\n[[rigid]]\nparts = [\"{name}\"]\n"
        )
    };
    let text = format!(
        r#"
        title = "flail"
        units = "cm-g-us"
        [control]
        end_cycle = 240
        end_time = 1e4
        [[curve]]
        name = "turn"
        points = [[0, 0.01], [1e4, 0.01]]
        {}
        spin = {{ x = 0, y = 0, z = {{ curve = "turn" }} }}
        start_spin = [0, 0, 0.01]
        {}
        {}
        {}
        [[part]]
        name = "block"
        material = "AL_2024_T351"
        box = {{ origin = [12.2, 1.3, -2], size = [4, 4, 4], cells = [4, 4, 4] }}
        [[part]]
        name = "slide"
        material = "STEEL_4340"
        box = {{ origin = [16.3, 1.3, -2], size = [1, 4, 4], cells = [1, 4, 4] }}
        [[rigid]]
        name = "sledge"
        parts = ["slide"]
        [[joint]]
        type = "revolute"
        bodies = ["arm"]
        point = [0, 0, 0]
        axis = [0, 0, 1]
        [[joint]]
        type = "spherical"
        bodies = ["arm", "first"]
        point = [3.1, 0, 0]
        [[joint]]
        type = "spherical"
        bodies = ["first", "second"]
        point = [6.3, 0, 0]
        [[joint]]
        type = "universal"
        bodies = ["second", "head"]
        point = [9.5, 0, 0]
        axis = [0, 1, 0]
        second_axis = [0, 0, 1]
        [[joint]]
        name = "rail"
        type = "translational"
        bodies = ["sledge"]
        point = [16.8, 3.3, 0]
        axis = [1, 0, 0]
        [contact]
        [output]
        history_cycles = 1
        "#,
        link("arm", 0.0),
        link("first", 3.2),
        link("second", 6.4),
        link("head", 9.6),
    );
    let mut model = model(&text);
    // All of it turns about the origin at first, so that no joint takes anything away.
    for body in &mut model.setup.bodies[..4] {
        let spin = [0.0, 0.0, 0.01];
        let centre = body.start.centre;
        body.start.spin = spin;
        body.start.momentum = [0.0, 0.0, body.inertia[2] * spin[2]];
        body.start.velocity = [-spin[2] * centre[1], spin[2] * centre[0], 0.0];
        for &node in &body.nodes {
            let [x, y, _] = model.mesh.positions[node as usize];
            model.velocity[node as usize] = [-spin[2] * y, spin[2] * x, 0.0];
        }
    }
    model
}

#[test]
fn a_flail_has_the_same_bits_on_both_routes() {
    let model = flail();
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let last = alone.rows.last().expect("rows");
    let struck = alone.outcome.run_totals.worst_penetration;
    println!("energy error {}, depth {struck}, forces of the joints {:?}", last.error, last.joints);
    assert!(struck > 0.0, "the head meets the block");
    assert!(last.error.abs() < 1e-3, "{}", last.error);
    same_bits(&model);
    same_bits_on_route_direct(&model, &Fingerprint::of(&alone));
}

#[test]
fn a_worker_of_a_flail_is_lost_without_a_bit() {
    losing_a_worker_changes_no_bit(&flail());
}

#[test]
fn a_flail_goes_on_from_its_snapshot_with_the_same_bits() {
    same_bits_from_files(&flail(), &[150]);
}

/// A motion that a joint does not allow ends the run with the joint's name.
#[test]
fn a_joint_that_what_is_prescribed_contradicts_ends_the_run_by_name() {
    let text = r#"
        title = "torn"
        units = "SI"
        [control]
        end_cycle = 400
        end_time = 1
        [[part]]
        name = "a"
        material = "LEAD"
        box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }
        [[part]]
        name = "b"
        material = "LEAD"
        velocity = [40, 0, 0]
        box = { origin = [2, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }
        [[rigid]]
        parts = ["a"]
        velocity = { x = 0, y = 0, z = 0 }
        spin = { x = 0, y = 0, z = 0 }
        [[rigid]]
        parts = ["b"]
        velocity = { x = 40, y = 0, z = 0 }
        spin = { x = 0, y = 0, z = 0 }
        [[joint]]
        name = "strut"
        type = "spherical"
        bodies = ["a", "b"]
        point = [1.5, 0.5, 0.5]
        "#;
    let failure = solve(model(text), Workers::default()).err().unwrap_or_default();
    assert!(failure.contains("joint `strut` is apart by"), "{failure}");
}
