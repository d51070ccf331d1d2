//! Contact where parts erode at high speed: a sphere on a plate, over speeds, gaps, with and without fracture.

use crate::{
    case::Figures,
    solve::{Workers, model, solve},
};

/// A quarter of a ball of 5 mm on a plate of 2 mm, both of aluminium, at a speed (m/s) with a gap over the smallest face.
fn ball_on_plate(speed: f64, gap: f64, fracture: bool) -> String {
    let end = if speed < 1500.0 { 0.015 } else { 0.01 };
    format!(
        r#"
        title = "ball on plate"
        units = "mm-ms-kg"
        [control]
        end_time = {end}
        energy_error = 1e9
        [[part]]
        name = "ball"
        material = "AL_2024_T351"
        fracture = {fracture}
        velocity = [0, 0, -{speed}]
        sphere = {{ centre = [0, 0, 2.9], radius = 2.5, sector = "quarter", core_fraction = 0.5, cells = [2, 3] }}
        rotate = {{ axis = [0, 1, 0], degrees = 90, point = [0, 0, 2.9] }}
        erosion = {{ geometric_strain = 1.5 }}
        [[part]]
        name = "plate"
        material = "AL_2024_T351"
        fracture = {fracture}
        box = {{ origin = [0, 0, -2], size = [10, 10, 2], cells = [20, 20, 4] }}
        erosion = {{ geometric_strain = 1.5 }}
        [contact]
        gap_fraction = {gap}
        self_interaction = "all"
        [[boundary]]
        type = "symmetry"
        axis = "x"
        [[boundary]]
        type = "symmetry"
        axis = "y"
        [output]
        history_cycles = 1
        "#
    )
}

pub(super) fn a_ball_goes_through_a_plate_at_any_speed_and_gap(figures: &mut Figures) {
    let (mut ended, mut error, mut negative) = (0, 0.0_f64, 0.0_f64);
    for speed in [1e3, 2e3, 3e3, 5e3, 7e3] {
        for (gap, fracture) in [0.1, 0.25, 0.5].into_iter().flat_map(|gap| [(gap, false), (gap, true)]) {
            let solved = match solve(model(&ball_on_plate(speed, gap, fracture)), Workers::default()) {
                Ok(solved) => solved,
                Err(why) => {
                    eprintln!("{speed} m/s, gap {gap}, fracture {fracture}: {why}");
                    continue;
                }
            };
            ended += 1;
            let initial = solved.rows[0].kinetic;
            error = solved.rows.iter().map(|row| row.error.abs()).fold(error, f64::max);
            negative = solved.rows.iter().map(|row| -row.eroded / initial).fold(negative, f64::max);
        }
    }
    figures.add("eroding contact: runs that reach their end", f64::from(ended));
    figures.add("eroding contact: greatest energy error", error);
    figures.add("eroding contact: greatest eroded energy below zero", negative);
}
