//! Solids that strike rigid walls: the step knows before the viscosity jumps.

use deck::Model;
use master::results::history::HistoryRow;
use tests::solve::{Workers, model, run, solve};

use crate::bits::same_bits;

/// A block of cells of 2.5 mm that strikes a wall at a speed (m/s), from a height in cells.
fn block(material: &str, speed: f64, height: f64) -> Model {
    let height = 2.5e-3 * height;
    model(&format!(
        r#"
        title = "strike"
        units = "SI"
        [control]
        end_time = 2e-5
        [output]
        history_cycles = 1
        [[part]]
        name = "block"
        material = "{material}"
        velocity = [0, 0, {:?}]
        box = {{ origin = [-0.01, -0.01, {height:?}], size = [0.02, 0.02, 0.02], cells = [8, 8, 8] }}
        [[wall]]
        point = [0, 0, 0]
        normal = [0, 0, 1]
        "#,
        -speed
    ))
}

#[test]
fn blocks_of_every_kind_strike_a_wall_at_a_third_of_their_speed_of_sound() {
    for material in ["LEAD", "DU_0p75TI", "CONCRETE_48_MPA", "NATURAL_RUBBER_TRELOAR", "WATER", "CU_OFHC"] {
        for height in [0.0, 0.13] {
            let solved = solve(block(material, 600.0, height), Workers::of(1));
            let solved = solved.unwrap_or_else(|e| panic!("{material} from {height}: {e}"));
            let totals = &solved.outcome.run_totals;
            println!("{material} from {height}: {:.3} of the Courant limit at most", totals.worst_courant);
            assert!(totals.worst_courant <= 1.0 && totals.last.error.abs() < 0.05, "{material}: {totals:?}");
            assert!(totals.last.wall_loss > 0.0, "{material} has struck");
        }
    }
}

/// Up to the cycle in which it strikes, a block that strikes slowly has the steps of one without a wall.
#[test]
fn a_slow_strike_changes_no_step() {
    let walled = block("CU_OFHC", 100.0, 0.1);
    let mut free = walled.clone();
    free.setup.walls.clear();
    free.setup.constraints.iter_mut().for_each(|held| held.walls = 0);
    let (walled, free) = (run(walled), run(free));
    let struck = walled.rows.iter().position(|row| row.wall_loss > 0.0).expect("it strikes");
    assert!(struck > 2, "cycle {struck}");
    let steps = |rows: &[HistoryRow]| rows[..=struck].iter().map(|row| row.dt.to_bits()).collect::<Vec<_>>();
    assert_eq!(steps(&walled.rows), steps(&free.rows));
}

#[test]
fn a_strike_has_the_same_bits_on_any_workers() {
    let mut model = block("LEAD", 600.0, 0.5);
    model.setup.control.end_cycle = 60;
    same_bits(&model);
}
