//! Charges in air and the shells that feel them, whichever way they are numbered.

use mechanics::load::blast::{Burst, Wave};
use tests::solve::{Solved, model, run};

/// Shells of 4 mm of steel in SI, as this shape has them, until a time; a kilogram of TNT explodes at a point.
fn shells(shape: &str, end: f64, point: [f64; 3], more: &str) -> Solved {
    run(model(&format!(
        "title = \"shells\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n[output]\nhistory_cycles = 100\n\
         [[part]]\nname = \"shells\"\nshell = {{ thickness = 4e-3 }}\n{shape}\n\
         material = {{ density = 8000, eos = {{ type = \"linear\", bulk = 150e9 }}, strength = {{ type = \"elastic\", shear = 80e9 }} }}\n\
         [[load]]\ntype = \"blast\"\nmass = 1\npoint = {point:?}\nburst = \"air\"\n{more}"
    )))
}

/// A free plate of 40 mm in the plane z = 0, whose upper side is that of z or the other one, and the momentum along z that it has then.
fn plate(upwards: bool, end: f64, height: f64, more: &str) -> f64 {
    let sides = ["[0.04, 0, 0]", "[0, 0.04, 0]"];
    let [i, j] = if upwards { sides } else { [sides[1], sides[0]] };
    let shape = format!("plate = {{ origin = [0, 0, 0], side_i = {i}, side_j = {j}, cells = [2, 2] }}");
    shells(&shape, end, [0.02, 0.02, height], more).outcome.run_totals.last.momentum[2]
}

#[test]
fn a_plate_flies_from_a_charge_with_the_impulse_of_its_distance_however_its_shells_are_numbered() {
    // Far enough that it is hardly nearer or farther in the end.
    let (wave, area) = (Wave::at(Burst::Air, 5.0, 1.0), 0.04 * 0.04);
    let end = 1.05e-3 * (wave.arrival + wave.duration + wave.negative.duration);
    let [pushed, pulled] = [wave.impulses[1], wave.negative.impulses()[1]].map(|impulse| impulse * area);
    for height in [5.0, -5.0] {
        let away = -f64::signum(height);
        for upwards in [true, false] {
            let positive = away * plate(upwards, end, height, "negative_phase = false\n");
            assert!((positive / pushed - 1.0).abs() < 0.01, "{height} {upwards}: {positive} {pushed}");
            let whole = away * plate(upwards, end, height, "");
            assert!(
                ((whole - (pushed - pulled)) / pushed).abs() < 0.01,
                "{height} {upwards}: {whole} {pushed} {pulled}"
            );
        }
    }
    // The side that is asked for has the incident pressure where it looks away.
    let behind = plate(true, end, -5.0, "negative_phase = false\nside = \"upper\"\n");
    let lower = plate(false, end, -5.0, "negative_phase = false\nside = \"lower\"\n");
    let incident = wave.impulses[0] * area;
    assert!(
        (-behind / incident - 1.0).abs() < 0.01 && (-lower / incident - 1.0).abs() < 0.01,
        "{behind} {lower}"
    );
}

#[test]
fn a_charge_within_a_tube_of_shells_widens_it() {
    let shape = "prism = { axis = \"z\", base = [0, 0, -0.3], radius = 0.4, length = 0.6, cells = [16, 4] }";
    let wave = Wave::at(Burst::Air, 0.4, 1.0);
    let wide = |solved: &Solved| {
        let radii = solved.state.x.iter().map(|x| x[0].mul_add(x[0], x[1] * x[1]).sqrt());
        radii.fold([f64::MAX, 0.0], |[least, most]: [f64; 2], r| [least.min(r), most.max(r)])
    };
    let end = 1e-3 * (wave.arrival + wave.duration);
    for (more, widens) in [("", true), ("side = \"upper\"\n", false)] {
        let [least, most] = wide(&shells(shape, end, [0.0; 3], more));
        assert!((least > 0.4 - 1e-6) == widens && (most > 0.4 + 1e-5) == widens, "{more}: {least} {most}");
    }
}
