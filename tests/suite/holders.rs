//! Forces and work of walls and supports in the rows of the history.

use deck::Model;
use tests::solve::{Workers, model, run, solve};

/// A copper block on a held base that a wall crushes at 20 m/s.
fn crushed() -> Model {
    model(
        "title = \"crushed\"\nunits = \"SI\"\n[control]\nend_time = 1\nend_cycle = 300\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"block\"\nmaterial = \"CU_OFHC\"\n\
         box = { origin = [0, 0, 0], size = [0.01, 0.01, 0.02], cells = [4, 4, 8] }\n\
         [[boundary]]\ntype = \"fixed\"\nface = \"k-min\"\n\
         [[wall]]\npoint = [0, 0, 0.02]\nnormal = [0, 0, -1]\nvelocity = { z = -20 }\n",
    )
}

#[test]
fn the_crush_force_over_the_stroke_is_the_work() {
    let solved = run(crushed());
    let stroke = |time: f64| -20.0 * time;
    let mut work = 0.0;
    let mut impulse = 0.0;
    for rows in solved.rows.windows(2) {
        let [before, after] = [&rows[0], &rows[1]];
        let mean = |holder: usize| 0.5 * (before.holders[holder].force[2] + after.holders[holder].force[2]);
        work += mean(0) * (stroke(after.time) - stroke(before.time));
        impulse += (mean(0) + mean(1)) * (after.time - before.time);
    }
    let last = solved.rows.last().expect("rows");
    let [wall, base] = [last.holders[0], last.holders[1]];
    println!("work {work:e}, booked {:e}, external {:e}, loss {:e}", wall.work, last.external, wall.loss);
    assert!(work > 0.0 && (wall.work / work - 1.0).abs() < 1e-5, "{work} {wall:?}");
    assert!((last.external / wall.work - 1.0).abs() < 1e-9 && base.work == 0.0, "{last:?}");
    assert!((last.momentum[2] - impulse).abs() < 1e-3 * last.momentum[2].abs(), "{impulse} {last:?}");
    assert!(last.error.abs() < 2e-3, "{}", last.error);
}

#[test]
fn a_wall_that_stands_does_no_work_and_takes_the_energy_of_the_nodes_that_strike_it() {
    let solved = run(model(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_time = 2e-5\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"bar\"\nmaterial = \"CU_OFHC\"\nvelocity = [0, 0, -227]\n\
         box = { origin = [0, 0, 0], size = [0.006, 0.006, 0.03], cells = [3, 3, 15] }\n\
         [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n",
    ));
    let last = solved.rows.last().expect("rows");
    // Half of the first layer of elements stops at once.
    let struck = 0.5 * (0.5 * 8960.0 * 0.006 * 0.006 * 0.002) * 227.0 * 227.0;
    println!(
        "external {:e}, lost {:e}, energy of the struck nodes {struck:e}",
        last.external, last.wall_loss
    );
    assert_eq!([last.external, last.holders[0].work], [0.0; 2]);
    assert!(
        (last.wall_loss / struck - 1.0).abs() < 0.1 && last.wall_loss == last.holders[0].loss,
        "{last:?}"
    );
    let force = |row: usize| solved.rows[row].holders[0].force;
    assert!((0..100).all(|row| force(row)[0] == 0.0 && force(row)[2] >= 0.0), "it pushes along its normal");
}

#[test]
fn supports_and_walls_book_the_same_on_any_workers() {
    let alone = run(crushed());
    let three = solve(crushed(), Workers::of(3)).expect("three workers");
    assert_eq!(alone.rows, three.rows);
}
