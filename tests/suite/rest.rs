//! What lies on something below the angle of friction comes to rest: contact damps the pushes of what sticks. It costs an impact
//! next to nothing.

use tests::solve::{Solved, model, run};

/// Slopes of 14 and 10 degrees.
const TAN_14: f64 = 0.249_328_002_843_180_7;
const TAN_10: f64 = 0.176_326_980_708_464_98;

const STEEL: &str = "{ density = 7.85e-6, eos = { type = \"linear\", bulk = 160.0 }, \
                      strength = { type = \"elastic\", shear = 80.0 } }";

/// Blocks of steel on each other on a plate of this slope, with gravity turned instead of the plate; a gauge in each. Friction holds up to 16.7 degrees.
fn on_an_incline(slope: f64, end_time: f64, blocks: &[&str]) -> Solved {
    let cosine = 1.0 / slope.mul_add(slope, 1.0).sqrt();
    let mut text = format!(
        "title = \"at rest\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = {end_time:?}\n\
         [gravity]\nacceleration = [{:?}, 0, {:?}]\n[contact]\nfriction = 0.3\n[output]\nhistory_cycles = 5\n\
         [[part]]\nname = \"plate\"\nmaterial = {STEEL}\nclamp = [\"k-min\"]\n\
         box = {{ origin = [-12.5, -12.5, -2.5], size = [25, 25, 2.5], cells = [10, 10, 1] }}\n",
        2.0 * slope * cosine,
        -2.0 * cosine
    );
    let mut below = "plate".to_owned();
    for (i, shape) in blocks.iter().enumerate() {
        text += &format!(
            "[[part]]\nname = \"b{i}\"\nmaterial = {STEEL}\nbox = {{ {shape} }}\nplace = {{ above = \"{below}\" }}\n\
             [[gauge]]\nname = \"b{i}\"\npart = \"b{i}\"\n"
        );
        below = format!("b{i}");
    }
    run(model(&text))
}

/// Mean velocity of a gauge down the incline over the last quarter of a run, by its mean place before and in its last eighth.
fn creep(solved: &Solved, gauge: usize) -> f64 {
    let end = solved.rows.last().expect("rows").time;
    let place = |from: f64, to: f64| solved.gauge_mean(gauge, from * end, to * end, |gauge| gauge.x[0]);
    (place(0.875, 1.0) - place(0.75, 0.875)) / (0.125 * end)
}

#[test]
fn a_block_whose_nodes_lie_between_those_of_the_plate_rests_below_the_angle_of_friction() {
    let solved =
        on_an_incline(TAN_14, 0.5, &["origin = [-3.75, -3.75, 0], size = [10, 10, 4], cells = [4, 4, 2]"]);
    let (creep, error) = (creep(&solved, 0), solved.rows.last().expect("rows").error);
    println!("creeps at {creep:e} m/s, energy error {error:e}");
    // Without a damper it creeps at 1.2e-3 for ever.
    assert!(creep.abs() < 1e-6, "{creep:e}");
}

#[test]
fn a_stack_of_blocks_rests_below_the_angle_of_friction() {
    let blocks = [
        "origin = [-5, -5, 0], size = [10, 10, 8], cells = [4, 4, 3]",
        "origin = [-4.7, -5.2, 0], size = [10, 10, 8], cells = [3, 3, 2]",
        "origin = [-4.4, -5.4, 0], size = [10, 10, 8], cells = [4, 4, 3]",
    ];
    let solved = on_an_incline(TAN_10, 1.0, &blocks);
    let creeps = [0, 1, 2].map(|gauge| creep(&solved, gauge));
    println!("creep at {creeps:?} m/s, energy error {:e}", solved.rows.last().expect("rows").error);
    // Without a damper 2.7e-4, 1.1e-3 and 3.9e-3, from the lowest up. What is left is the sway of the stack.
    assert!(creeps.iter().all(|creep| creep.abs() < 1e-4), "{creeps:?}");
}

/// Two blocks that meet head-on: what friction and dampers took of their energy, and their rebound's velocity over that before.
fn head_on(velocity: f64, friction: f64) -> [f64; 2] {
    let block = |name: &str, shape: &str, velocity: f64| {
        format!(
            "[[part]]\nname = \"{name}\"\nmaterial = {STEEL}\nbox = {{ {shape}, size = [10, 10, 8] }}\n\
             velocity = [0, 0, {velocity:?}]\n"
        )
    };
    let text = format!(
        "title = \"head-on\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.02\n[contact]\nfriction = {friction:?}\n\
         [output]\nhistory_cycles = 1\n{}{}place = {{ above = \"a\" }}\n",
        block("a", "origin = [0, 0, 0], cells = [4, 4, 4]", 0.5 * velocity),
        block("b", "origin = [1.3, 1.3, 0], cells = [5, 5, 4]", -0.5 * velocity),
    );
    let solved = run(model(&text));
    let [first, last] = [solved.rows.first(), solved.rows.last()].map(|row| row.expect("rows"));
    [last.friction / first.kinetic, -last.part_momenta[1][2] / first.part_momenta[1][2]]
}

#[test]
fn a_head_on_impact_of_elastic_blocks_keeps_its_energy() {
    // Corners of one block lie on faces of the other, so they rub: that alone takes 0.54 and 0.51 %. The damper takes some 0.3 % at 10 m/s.
    for (velocity, most) in [(10.0, 0.012), (200.0, 0.0065)] {
        let [[none, smooth], [taken, rebound]] = [0.0, 0.3].map(|friction| head_on(velocity, friction));
        println!("{velocity} m/s: {taken:e} of the energy, rebound {rebound}, without friction {smooth}");
        assert_eq!(none, 0.0);
        assert!(taken < most, "{velocity} m/s: {taken:e}");
        // Without a damper 0.7953 and 0.7913; the rest shakes in the blocks.
        assert!(rebound > 0.785, "{velocity} m/s: {rebound}");
    }
}
