//! A strip of shells, bent to a U, whose arms are thrown together.

use std::f64::consts::PI;

use crate::{
    case::Figures,
    checker::{nearest, pierced},
    solve::{Solved, model, run_with_states},
};

/// Thickness, gap, radius of the bend, length of an arm (m), speed of its end (m/s).
const THICKNESS: f64 = 2e-3;
const GAP: f64 = 1e-3;
const BEND: f64 = 5e-3;
const ARM: f64 = 0.045;
const SPEED: f64 = 40.0;

/// Arms upright at x = +-5 mm, the bend below them; each turns about its foot towards the other.
fn thrown(meets_itself: bool) -> Solved {
    let contact = if meets_itself {
        format!("[contact]\ngap_length = {GAP:e}\nself_interaction = \"all\"\n")
    } else {
        String::new()
    };
    let deck = format!(
        "title = \"fold\"\nunits = \"SI\"\n[control]\nend_time = 1e-3\n[output]\nhistory_cycles = 100\n\
         [[part]]\nname = \"strip\"\nmaterial = {{ density = 7830, eos = {{ type = \"linear\", bulk = 175e9 }}, \
         strength = {{ type = \"von-mises\", shear = 80.77e9, yield_stress = 250e6 }} }}\n\
         shell = {{ thickness = {THICKNESS:e}, points = 5 }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [1, 0, 0], side_j = [0, 0.02, 0], cells = [48, 8] }}\n{contact}"
    );
    let mut model = model(&deck);
    model.output.period = Some(20e-6);
    let whole = 2.0 * ARM + PI * BEND;
    for (x, v) in model.mesh.positions.iter_mut().zip(&mut model.velocity) {
        let along = whole * x[0];
        let beyond = along - ARM - PI * BEND;
        let (sign, height) = if along < ARM { (-1.0, ARM - along) } else { (1.0, beyond) };
        if along < ARM || beyond > 0.0 {
            (x[0], x[2]) = (sign * BEND, height);
            v[0] = -sign * SPEED * height / ARM;
        } else {
            let angle = (along - ARM) / BEND;
            (x[0], x[2]) = (-BEND * angle.cos(), -BEND * angle.sin());
        }
    }
    run_with_states(model)
}

pub(super) fn arms_of_a_strip_that_are_thrown_together_stay_apart(figures: &mut Figures) {
    let distances = |solved: &Solved| -> Vec<f64> {
        solved.states.iter().map(|state| nearest(&solved.model.mesh, &state.x, 4.0 * GAP) / GAP).collect()
    };
    let (with, without) = (thrown(true), thrown(false));
    let smallest = |all: &[f64]| all.iter().copied().fold(4.0, f64::min);
    figures.add("folded strip: smallest distance of its arms (gaps)", smallest(&distances(&with)));
    figures.add("folded strip: deepest contact (gaps)", with.outcome.run_totals.worst_penetration);
    figures.add("folded strip: energy error", with.outcome.run_totals.last.error);
    let crossings = |solved: &Solved| {
        solved.states.iter().map(|state| pierced(&solved.model.mesh, &state.x).len()).max().unwrap_or(0)
            as f64
    };
    figures.add("folded strip: edges through faces", crossings(&with));
    figures.add("folded strip without contact: edges through faces", crossings(&without));
}
