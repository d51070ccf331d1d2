//! Rigid bodies of shells: the same bits on any workers, what is joined to them feels them as it should, nothing is lost.

use deck::Model;
use mechanics::element::shell4;
use tests::{
    bits::Fingerprint,
    solve::{Solved, Workers, cross, keyword, model, solve},
};

use crate::bits::{
    losing_a_worker_changes_no_bit, same_bits, same_bits_from_files, same_bits_on_route_direct,
};

fn run(model: &Model, at_work: Workers) -> Solved {
    solve(model.clone(), at_work).unwrap_or_else(|e| panic!("{e}"))
}

/// The pipe whip from shortly before the pipes meet.
fn whip() -> Model {
    let mut model = keyword("pipe-whip");
    for velocity in &mut model.velocity {
        velocity.iter_mut().for_each(|v| *v *= 4.0);
    }
    let start = &mut model.setup.bodies[0].start;
    (0..3).for_each(|a| {
        start.spin[a] *= 4.0;
        start.momentum[a] *= 4.0;
    });
    model.spin.iter_mut().flatten().for_each(|w| *w *= 4.0);
    model.setup.control.end_cycle = 200;
    model.output.history_cycles = 1;
    model
}

#[test]
fn a_pipe_between_rigid_shells_has_the_same_bits_on_both_routes() {
    let model = whip();
    same_bits(&model);
    let one = Fingerprint::of(&run(&model, Workers::default()));
    same_bits_on_route_direct(&model, &one);
}

#[test]
fn a_worker_of_rigid_shells_that_is_lost_changes_no_bit() {
    let mut model = whip();
    model.setup.control.end_cycle = 120;
    losing_a_worker_changes_no_bit(&model);
}

#[test]
fn a_snapshot_of_rigid_shells_goes_on_from_its_file_with_the_same_bits() {
    let mut model = whip();
    model.setup.control.end_cycle = 120;
    same_bits_from_files(&model, &[70]);
}

/// A strip of shells that bends: 10 by 2 elements with one row more at its root, which `root` holds.
fn strip(root: &str) -> Model {
    model(&format!(
        r#"
        title = "strip"
        units = "SI"
        [control]
        end_time = 1
        end_cycle = 400
        [[material]]
        name = "steel"
        density = 7830
        eos = {{ type = "linear", bulk = 175e9 }}
        strength = {{ type = "elastic", shear = 80e9 }}
        [[part]]
        name = "root"
        material = "steel"
        shell = {{ thickness = 2e-3 }}
        plate = {{ origin = [-0.01, 0, 0], side_i = [0.01, 0, 0], side_j = [0, 0.02, 0], cells = [1, 2] }}
        [[part]]
        name = "strip"
        material = "steel"
        shell = {{ thickness = 2e-3 }}
        plate = {{ origin = [0, 0, 0], side_i = [0.1, 0, 0], side_j = [0, 0.02, 0], cells = [10, 2] }}
        [[join]]
        parts = ["root", "strip"]
        [[load]]
        type = "force"
        parts = ["strip"]
        face = "i-max"
        force = [0, 10, 40]
        {root}
        [output]
        history_cycles = 1
        [[gauge]]
        name = "tip"
        part = "strip"
        point = [0.1, 0.01, 0]
        "#
    ))
}

#[test]
fn a_strip_on_a_body_that_is_held_bends_as_one_that_is_clamped() {
    let held = run(
        &strip(
            "[[rigid]]\nparts = [\"root\"]\nvelocity = { x = 0, y = 0, z = 0 }\nspin = { x = 0, y = 0, z = 0 }",
        ),
        Workers::default(),
    );
    let clamped = run(
        &strip("[[boundary]]\ntype = \"fixed\"\nparts = [\"root\"]\naxes = \"xyz\"\nrotations = \"xyz\""),
        Workers::default(),
    );
    let tips = held.gauge(0).zip(clamped.gauge(0));
    let most = clamped.gauge(0).map(|(_, row)| row.x[2].abs()).fold(0.0, f64::max);
    assert!(most > 1e-4, "the strip hardly bends: {most}");
    for ((_, a), (_, b)) in tips {
        for axis in 0..3 {
            assert!((a.x[axis] - b.x[axis]).abs() < 1e-9 * most, "{:?} {:?}", a.x, b.x);
        }
    }
}

#[test]
fn a_free_body_takes_the_moments_of_the_shells_on_it() {
    let pushed = |root: &str| {
        let mut model = strip(root);
        model.setup.loads.forces.iter_mut().for_each(|force| force.force = [0.0, 0.0, 40.0]);
        model
    };
    let model = pushed("[[rigid]]\nparts = [\"root\"]");
    let solved = run(&model, Workers::default());
    let row = solved.rows.last().expect("rows");
    // A force that sets in at once costs shells 0.3 % with or without a body among them.
    let without = run(&pushed(""), Workers::default()).rows.last().expect("rows").error;
    assert!(row.external > 0.0 && (row.error - without).abs() < 2e-4, "{} and {without}", row.error);
    // Angular momentum is the moment of the impulse: three forces of 40 N push the tip for the time that was run.
    let state = &solved.state;
    let body = &model.setup.bodies[0];
    let moved = solved.outcome.run_totals.bodies[0];
    let mut total = cross(moved.centre, moved.velocity.map(|v| body.mass * v));
    (0..3).for_each(|a| total[a] += moved.momentum[a]);
    for n in (0..state.x.len()).filter(|n| body.nodes.binary_search(&(*n as u32)).is_err()) {
        let of_node = cross(state.x[n], state.v[n].map(|v| state.mass[n] * v));
        (0..3).for_each(|a| total[a] += of_node[a] + state.shells.inertia[n] * state.shells.spin[n][a]);
    }
    let tips: Vec<usize> =
        (0..state.x.len()).filter(|n| (model.mesh.positions[*n][0] - 0.1).abs() < 1e-9).collect();
    assert_eq!(tips.len(), 3);
    // The arm of the tip about the origin hardly changes in x.
    let impulse = 3.0 * 40.0 * (state.time - 0.5 * row.dt);
    assert!((total[1] / (-0.1 * impulse) - 1.0).abs() < 1e-3, "{total:?}, impulse {impulse}");
    // The strip turns its root by the moments in it: in the sense in which the force turns the tip.
    assert!(moved.spin[1] < 0.0, "{moved:?}");
}

#[test]
fn a_sheet_that_is_pulled_gets_thinner_unless_the_deck_says_that_it_does_not() {
    let thickness = |key: &str| {
        let deck = model(&format!(
            "title = \"strip\"\nunits = \"SI\"\n[control]\nend_time = 1e-4\n[[part]]\nname = \"strip\"\n\
             material = \"STEEL_1006\"\nshell = {{ thickness = 1e-3{key} }}\n\
             plate = {{ origin = [0, 0, 0], side_i = [0.02, 0, 0], side_j = [0, 0.01, 0], cells = [8, 4] }}\n\
             [[boundary]]\ntype = \"velocity\"\nface = \"i-max\"\nvelocity = {{ x = 20 }}\n\
             [[boundary]]\ntype = \"velocity\"\nface = \"i-min\"\nvelocity = {{ x = 0 }}\n"
        ));
        let solved = run(&deck, Workers::default());
        let of = &solved.state.own[shell4::THICKNESS];
        of.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let (follows, stays) = (thickness(""), thickness(", thinning = false"));
    println!("least thickness {follows:e} m, {stays:e} m without thinning");
    assert_eq!(stays, 1e-3);
    // A tenth longer, plastic: the thickness takes half of that.
    assert!((0.90e-3..0.98e-3).contains(&follows), "{follows}");
}
