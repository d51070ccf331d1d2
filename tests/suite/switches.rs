//! Parts that are rigid for a time: what they keep, what they lose, and the same bits whatever happens in that time.

use deck::Model;
use mechanics::state::field;
use tests::{
    bits::Fingerprint,
    solve::{Solved, Workers, cross, model, run, solve},
};

use crate::bits::{
    losing_a_worker_changes_no_bit, same_bits, same_bits_from_files, same_bits_on_route_direct,
};

/// A bar of copper, and what else its deck needs.
fn bar(end: f64, rest: &str) -> Model {
    model(&format!(
        r#"
        title = "a bar that is rigid for a time"
        units = "cm-g-us"
        [control]
        end_time = {end:?}
        [output]
        history_cycles = 1
        [[part]]
        name = "bar"
        material = "CU_OFHC"
        velocity = [0, 0.002, -0.01]
        box = {{ origin = [-0.2, -0.2, 0], size = [0.4, 0.4, 1.6], cells = [4, 4, 16] }}
        {rest}
        "#
    ))
}

/// It strikes a slanting wall within 3 us, and has left it at 60 us: it turns and rings.
fn struck(end: f64, rest: &str) -> Model {
    bar(end, &format!("[[wall]]\npoint = [0, 0, -0.05]\nnormal = [0.1, 0, 1]\n{rest}"))
}

/// Momentum, angular momentum about the origin and kinetic energy of the nodes of a state.
fn moments(solved: &Solved) -> ([f64; 3], [f64; 3], f64) {
    let state = &solved.state;
    let (mut momentum, mut angular, mut kinetic) = ([0.0; 3], [0.0; 3], 0.0);
    for ((x, v), mass) in state.x.iter().zip(&state.v).zip(&state.mass) {
        let moment = cross(*x, *v);
        for a in 0..3 {
            momentum[a] += mass * v[a];
            angular[a] += mass * moment[a];
            kinetic += 0.5 * mass * v[a] * v[a];
        }
    }
    (momentum, angular, kinetic)
}

fn size(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Largest distance between two lists of places.
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    size([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
}

const RIGID: &str = "[[rigid]]\nparts = [\"bar\"]\nfrom = 60\nuntil = 300\n";

#[test]
fn a_part_that_becomes_rigid_keeps_momentum_and_books_what_it_loses() {
    let before = run(struck(60.0, RIGID));
    let rigid = run(struck(120.0, RIGID));
    let ((p, l, kinetic), after) = (moments(&before), moments(&rigid));
    assert!(apart(p, after.0) < 1e-6 * size(p), "{p:?} {:?}", after.0);
    assert!(apart(l, after.1) < 1e-4 * size(l), "{l:?} {:?}", after.1);
    let lost = kinetic - after.2;
    let (totals, totals_before) = (&rigid.outcome.run_totals, &before.outcome.run_totals);
    println!("kinetic {:.3e}, of which {lost:.3e} are lost; error {:.1e}", kinetic, totals.last.error);
    assert!(lost > 1e-3 * kinetic, "it rang: {lost}");
    assert!((totals.last.external - totals_before.last.external + lost).abs() < 0.05 * lost, "{totals:?}");
    assert!(totals.last.error.abs() < 1e-3, "{totals:?}");
    // It keeps its shape: distances of all nodes to the first stay what they were when it formed.
    let formed = run(struck(61.0, RIGID));
    let distances = |of: &Solved| of.state.x.iter().map(|x| apart(*x, of.state.x[0])).collect::<Vec<_>>();
    let worst =
        distances(&formed).iter().zip(distances(&rigid)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-10, "{worst} cm");
}

#[test]
fn a_part_that_deforms_again_has_the_stress_it_had_turned_with_it() {
    let spinning = RIGID.replace("until = 300", "until = 4000");
    let formed = run(struck(62.0, &spinning));
    let turned = run(struck(3900.0, &spinning));
    let mises = |solved: &Solved, e: usize| {
        let s = |f: usize| solved.state.elements[f][e];
        let (xx, yy) = (s(field::SXX), s(field::SYY));
        let squares = xx * xx + yy * yy + (xx + yy) * (xx + yy);
        (1.5 * (squares + 2.0 * (s(field::SXY).powi(2) + s(field::SYZ).powi(2) + s(field::SZX).powi(2))))
            .sqrt()
    };
    let n = formed.model.mesh.n_elements();
    let greatest = (0..n).map(|e| mises(&formed, e)).fold(0.0, f64::max);
    let worst = (0..n).map(|e| (mises(&formed, e) - mises(&turned, e)).abs()).fold(0.0, f64::max);
    let axis = |of: &Solved| {
        let (low, high) = (of.state.x[0], of.state.x[of.state.x.len() - 1]);
        [0, 1, 2].map(|a| high[a] - low[a])
    };
    let (a, b) = (axis(&formed), axis(&turned));
    let cosine = (0..3).map(|i| a[i] * b[i]).sum::<f64>() / size(a) / size(b);
    println!("cosine of its turn {cosine:.3}, stress changed by {worst:.2e} of {greatest:.2e}");
    assert!(cosine < 0.94, "it has turned by 20 degrees and more: {cosine}");
    assert!(worst < 1e-3 * greatest, "{worst} of {greatest}");
    // What it does from then on takes no energy from nowhere.
    let free = run(struck(4100.0, &spinning));
    assert!(free.outcome.run_totals.last.error.abs() < 1e-3, "{:?}", free.outcome.run_totals.last);
    let (p, after) = (moments(&turned).0, moments(&free).0);
    assert!(apart(p, after) < 1e-6 * size(p), "{p:?} {after:?}");
}

#[test]
fn a_part_that_is_rigid_from_the_start_strikes_once_it_deforms() {
    // While it is rigid no wall stops it; it begins to deform above the wall.
    let solved = run(struck(60.0, "[[rigid]]\nparts = [\"bar\"]\nuntil = 1.5\n"));
    let plain = run(struck(60.0, ""));
    let strain =
        |of: &Solved| of.state.elements[field::PLASTIC_STRAIN].iter().fold(0.0_f64, |a, b| a.max(*b));
    let (switched, never) = (strain(&solved), strain(&plain));
    println!("plastic strain {switched:.4}, {never:.4} of a bar that was never rigid");
    assert!((switched / never - 1.0).abs() < 1e-2);
}

#[test]
fn a_part_that_would_deform_again_inside_a_wall_ends_the_run_with_its_node() {
    let late = struck(60.0, "[[rigid]]\nparts = [\"bar\"]\nuntil = 6\n");
    let refused = solve(late, Workers::default()).err().expect("a node inside the wall");
    assert!(
        refused.contains("part `bar` is to deform again from 6") && refused.contains("[[wall]] 1"),
        "{refused}"
    );
}

/// Two bars that strike each other, rigid and deformable by turns.
fn two_bars() -> Model {
    let mut model = bar(
        60.0,
        r#"
        [[part]]
        name = "other"
        material = "CU_OFHC"
        velocity = [0, 0, 0.01]
        box = { origin = [-0.2, 0.21, 0], size = [0.4, 0.4, 0.8], cells = [4, 4, 8] }
        [contact]
        gap_length = 0.01
        [[rigid]]
        parts = ["bar"]
        from = 8
        until = 14
        [[rigid]]
        parts = ["bar", "other"]
        from = 16
        until = 20
        [[rigid]]
        parts = ["other"]
        from = 5
        until = 9
        "#,
    );
    model.setup.control.end_cycle = 460;
    model.output.history_cycles = 1;
    model
}

#[test]
fn parts_that_switch_have_the_same_bits_on_any_workers_and_routes() {
    let model = two_bars();
    let one = solve(model.clone(), Workers::default()).expect("a run");
    let last = &one.outcome.run_totals.last;
    assert!(last.time > 21.0 && last.error.abs() < 1e-3, "{last:?}");
    same_bits(&model);
    same_bits_on_route_direct(&model, &Fingerprint::of(&one));
}

#[test]
fn losses_and_snapshots_while_parts_switch_change_no_bit() {
    let model = two_bars();
    losing_a_worker_changes_no_bit(&model);
    let solved = run(model.clone());
    let cycle_at = |time: f64| solved.rows.iter().find(|row| row.time >= time).expect("a later row").cycle;
    // Both rigid, about the very cycle of a switch, and all of them one.
    same_bits_from_files(&model, &[cycle_at(8.5), cycle_at(9.0), cycle_at(9.0) + 1, cycle_at(18.0)]);
}

/// A part that is led from rest: contact knows of the jump before it comes.
#[test]
fn a_part_that_is_led_from_rest_moves_as_prescribed_without_passing_the_gap() {
    let mut model = model(
        r#"
        title = "a ram that begins to move"
        units = "SI"
        [control]
        end_time = 4e-5
        [output]
        history_cycles = 1
        [[part]]
        name = "ram"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0.0105], size = [0.01, 0.01, 0.01], cells = [4, 4, 4] }
        [[part]]
        name = "anvil"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0], size = [0.01, 0.01, 0.01], cells = [4, 4, 4] }
        [contact]
        gap_length = 3e-4
        [[rigid]]
        parts = ["ram"]
        from = 1e-5
        until = 3e-5
        velocity = { z = -150 }
        "#,
    );
    model.setup.control.end_cycle = 2000;
    let solved = run(model);
    let totals = &solved.outcome.run_totals;
    println!("{:.3} gaps in a cycle at most, error {:.1e}", totals.worst_gap_travel, totals.last.error);
    assert!(totals.worst_gap_travel <= 0.2 && totals.last.error.abs() < 1e-2, "{totals:?}");
    let mass = totals.masses[0];
    let speeds = solved.rows.iter().map(|row| (row.time, row.part_momenta[0][2] / mass));
    for (time, speed) in speeds {
        if time < 1e-5 {
            assert_eq!(speed, 0.0, "at {time}");
        } else if (1.1e-5..2.9e-5).contains(&time) {
            assert!((speed + 150.0).abs() < 1e-6, "{speed} at {time}");
        }
    }
}
