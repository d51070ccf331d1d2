//! Friction that sticks: a block on an incline, at rest below the angle of friction and in motion above it.

use crate::{
    case::Figures,
    solve::{model, run},
};

const FRICTION: f64 = 0.3;
/// Of gravity (m/ms^2 or 1000 m/s^2).
const PULL: f64 = 5.0;

/// A block of 10 x 10 x 5 mm on a plate that is fixed below; gravity is turned instead of the plate.
fn incline(degrees: f64) -> String {
    let [along, down] = [PULL * degrees.to_radians().sin(), PULL * degrees.to_radians().cos()];
    let material = "{ density = 7.85e-06, eos = { type = \"linear\", bulk = 8.333333333 }, \
                    strength = { type = \"elastic\", shear = 3.846153846 } }";
    format!(
        r#"
        title = "block on an incline"
        units = "mm-ms-kg"
        [control]
        end_time = 10.0
        [[part]]
        name = "plate"
        material = {material}
        box = {{ origin = [0, 0, -3], size = [80, 20, 3], cells = [30, 8, 2] }}
        [[part]]
        name = "block"
        material = {material}
        box = {{ origin = [5, 5, 0.16], size = [10, 10, 5], cells = [5, 5, 3] }}
        [[boundary]]
        type = "fixed"
        parts = ["plate"]
        face = "k-min"
        [gravity]
        acceleration = [{along:?}, 0, -{down:?}]
        [contact]
        friction = {FRICTION}
        [[gauge]]
        name = "middle"
        part = "block"
        point = [10, 10, 5.16]
        [output]
        history_cycles = 5
        "#
    )
}

pub(super) fn a_block_on_an_incline_rests_or_slides_after_coulomb(figures: &mut Figures) {
    for degrees in [10.0, 16.0, 17.0_f64, 20.0] {
        let solved = run(model(&incline(degrees)));
        let mean = |from: f64| solved.gauge_mean(0, from, from + 1.0, |gauge| gauge.v[0]);
        if degrees < FRICTION.atan().to_degrees() {
            // The block still swings a little from its landing, many times in a millisecond: its mean place is what creeps.
            let place = |from: f64| solved.gauge_mean(0, from, from + 1.0, |gauge| gauge.x[0]);
            figures
                .add(&format!("incline at rest @ {degrees} degrees, creep"), (place(9.0) - place(8.0)).abs());
        } else {
            // The speed wavers by 0.015 mm/ms as the front edge of the block passes the nodes of the plate: the longer the stretch, the
            // less of that is in its mean. The landing takes the first two milliseconds.
            let ours = (mean(9.0) - mean(2.0)) / 7.0;
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let exact = PULL * FRICTION.mul_add(-cosine, sine);
            figures.add(&format!("incline that slides @ {degrees} degrees, acceleration"), ours / exact);
        }
    }
}
