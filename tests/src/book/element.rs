//! Elements and nodes, through the whole system: what single elements do is tested beside the mechanics.

use crate::{
    case::Figures,
    solve::{model, run},
};

/// A tumbling, shaking lump of steel, 12 elements.
const LUMP: &str = r#"
title = "free body"
units = "SI"
[control]
end_cycle = 10000
end_time = 1
[[part]]
name = "lump"
material = "STEEL_1006"
box = { origin = [0, 0, 0], size = [0.013, 0.007, 0.011], cells = [2, 2, 3], grading = [1.3, 1, 0.8] }
rotate = { axis = [1, 2, 3], degrees = 40 }
"#;

pub(super) fn mass_is_density_times_volume_and_a_free_body_keeps_its_momentum_for_ten_thousand_cycles(
    figures: &mut Figures,
) {
    let mut model = model(LUMP);
    for (v, [x, y, z]) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        // Flies, spins about a skew axis, and shakes.
        *v = [30.0 + 900.0 * y - 400.0 * z, -20.0 - 900.0 * x + 2000.0 * y, 10.0 + 400.0 * x - 3000.0 * z];
    }
    let solved = run(model);
    let state = &solved.state;
    assert_eq!(state.cycle, 10_000);
    let mass: f64 = state.mass.iter().sum();
    let momentum =
        |v: &[[f64; 3]]| [0, 1, 2].map(|a| v.iter().zip(&state.mass).map(|(v, m)| m * v[a]).sum::<f64>());
    let (before, after) = (momentum(&solved.model.velocity), momentum(&state.v));
    let scale: f64 = solved
        .model
        .velocity
        .iter()
        .zip(&state.mass)
        .map(|(v, m)| m * v.iter().map(|c| c * c).sum::<f64>().sqrt())
        .sum();
    let change = (0..3).map(|a| (after[a] - before[a]).powi(2)).sum::<f64>().sqrt();
    figures.add("free body: mass over density and volume", mass / (7896.0 * 0.013 * 0.007 * 0.011));
    figures.add("free body: momentum after 10,000 cycles", change / scale);
    figures.add("free body: energy error after 10,000 cycles", solved.outcome.run_totals.last.error);
}
