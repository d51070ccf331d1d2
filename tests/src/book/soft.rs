//! Hard bodies on soft ones: a steel block thrown on a block that is a thousand times softer, or on water.

use crate::{
    case::Figures,
    solve::{Workers, model, solve},
};

const FOAM: &str = "{ density = 1e-07, eos = { type = \"linear\", bulk = 0.008333333333 }, \
                    strength = { type = \"elastic\", shear = 0.009090909091 } }";
const RUBBER: &str = "{ density = 1.1e-06, eos = { type = \"linear\", bulk = 0.05 }, \
                      strength = { type = \"elastic\", shear = 0.001 } }";
const WATER: &str = "{ density = 1e-06, eos = { type = \"shock\", c0 = 1480, s = 1.79, gamma = 1.1 }, \
                     strength = { type = \"hydro\" } }";

/// A cube of steel of 10 mm thrown on a soft block (m/s) until `end` (ms).
fn thrown(material: &str, speed: f64, end: f64, contact: &str) -> String {
    format!(
        r#"
        title = "steel on a soft block"
        units = "mm-ms-kg"
        [control]
        end_time = {end}
        [[part]]
        name = "hit"
        material = {{ density = 7.85e-06, eos = {{ type = "linear", bulk = 175 }}, strength = {{ type = "elastic", shear = 80.76923077 }} }}
        velocity = [0, 0, -{speed}]
        box = {{ origin = [-5, -5, 1.3], size = [10, 10, 10], cells = [4, 4, 4] }}
        [[part]]
        name = "soft"
        material = {material}
        box = {{ origin = [-15, -15, -20], size = [30, 30, 20], cells = [12, 12, 8] }}
        [contact]
        {contact}
        "#
    )
}

pub(super) fn a_steel_block_thrown_on_foam_rubber_and_water_stays_outside(figures: &mut Figures) {
    let (mut deepest, mut error) = (0.0_f64, 0.0_f64);
    for (name, material, speed, end, contact) in [
        ("foam", FOAM, 2.0, 2.0, ""),
        ("foam", FOAM, 20.0, 0.5, ""),
        ("foam", FOAM, 50.0, 0.2, ""),
        ("foam", FOAM, 100.0, 0.1, ""),
        ("foam", FOAM, 50.0, 0.2, "stiffness = 1"),
        ("foam", FOAM, 50.0, 0.2, "gap_fraction = 0.25"),
        ("foam", FOAM, 50.0, 0.2, "gap_fraction = 0.5"),
        ("rubber", RUBBER, 50.0, 0.2, ""),
        ("rubber", RUBBER, 300.0, 0.03, ""),
        ("water", WATER, 50.0, 0.2, ""),
        ("water", WATER, 300.0, 0.03, ""),
    ] {
        let solved = solve(model(&thrown(material, speed, end, contact)), Workers::default())
            .unwrap_or_else(|e| panic!("{name} at {speed} m/s, {contact}: {e}"));
        let depth = solved.outcome.run_totals.worst_penetration;
        assert!(depth > 0.0, "{name} at {speed} m/s: nothing met");
        deepest = deepest.max(depth);
        error = error.max(solved.rows.last().map_or(f64::NAN, |row| row.error.abs()));
    }
    figures.add("hard on soft: deepest contact (gaps)", deepest);
    figures.add("hard on soft: greatest energy error", error);
}
