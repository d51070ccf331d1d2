//! Shells and beams whose nodes turn: what damps them, clamps that begin late, rotations about an axis, against energies that follow from the motion.

use deck::Model;
use tests::solve::{Solved, model, run};

const STEEL: &str = "{ density = 8000, eos = { type = \"linear\", bulk = 150e9 }, strength = { type = \"elastic\", shear = 80e9 } }";

/// A sheet of 16 shells of 10 mm in the plane z = 0, with so many points in the plane, which flies as `velocity` says of each place (m/s).
fn sheet(in_plane: u32, end: f64, velocity: impl Fn([f64; 3]) -> [f64; 3]) -> Model {
    let mut sheet = model(&format!(
        "title = \"sheet\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\nenergy_error = 10\n[output]\nhistory_cycles = 50\n\
         [[part]]\nname = \"sheet\"\nmaterial = {STEEL}\nshell = {{ thickness = 2e-3, in_plane = {in_plane} }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [0.04, 0, 0], side_j = [0, 0.04, 0], cells = [4, 4] }}\n"
    ));
    sheet.velocity = sheet.mesh.positions.iter().map(|x| velocity(*x)).collect();
    sheet
}

/// What is booked as taken by viscosity is what the sheet loses, so its total stays.
fn loses_what_is_booked(name: &str, sheet: Model) {
    let solved = run(sheet);
    let (first, last) = (&solved.rows[0], solved.rows.last().expect("rows"));
    let worst = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    let part = &last.parts[0];
    let lost = first.kinetic - (last.kinetic + last.internal - part.viscosity + last.hourglass);
    println!("{name}: lost {lost:e} of {:e}, booked {:e}, error {worst:e}", first.kinetic, part.viscosity);
    assert!(lost > 0.1 * first.kinetic, "{name}: hardly damped");
    assert!((part.viscosity / lost - 1.0).abs() < 0.02, "{name}: {} booked, {lost} lost", part.viscosity);
    assert!(worst < 0.01, "{name}: error {worst}");
}

#[test]
fn shells_book_the_damping_that_they_take() {
    for in_plane in [1, 4] {
        let rows =
            |[x, ..]: [f64; 3]| [if (100.0 * x).round() as i32 % 2 == 0 { 10.0 } else { -10.0 }, 0.0, 0.0];
        loses_what_is_booked(&format!("{in_plane} points, rows"), sheet(in_plane, 6e-3, rows));
        // Every mode of a sheet: no two nodes move alike.
        let all = |[x, y, _]: [f64; 3]| {
            let seed = (100.0 * x).round().mul_add(5.0, (100.0 * y).round());
            [1.3, 2.9, 4.7].map(|a| 10.0 * ((a * 7919.0 * (seed + 1.0) % 17.0) / 8.5 - 1.0))
        };
        loses_what_is_booked(&format!("{in_plane} points, all modes"), sheet(in_plane, 6e-3, all));
    }
}

/// A round bar of ten beams along x, 0.1 m long, and what else its deck needs.
fn bar(end: f64, rest: &str) -> Model {
    let nodes: Vec<String> =
        (0..=10).map(|i| format!("[{}, {:e}, 0, 0]", i + 1, 0.01 * f64::from(i))).collect();
    let beams: Vec<String> = (1..=10).map(|i| format!("[{i}, {i}, {}]", i + 1)).collect();
    model(&format!(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\nenergy_error = 10\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"bar\"\nmaterial = {STEEL}\nbeam = {{ round = 0.01 }}\nmesh = {{ nodes = [{}], elements = [{}] }}\n{rest}",
        nodes.join(", "),
        beams.join(", ")
    ))
}

/// Energy of the bar that spins about itself at 300/s: half of the density times the polar moment times the length.
fn of_spin() -> f64 {
    0.5 * 8000.0 * std::f64::consts::PI * 0.005_f64.powi(4) / 2.0 * 0.1 * 300.0 * 300.0
}

#[test]
fn a_clamp_that_begins_late_takes_the_energy_of_rotation_as_its_work() {
    let clamp = "[[boundary]]\ntype = \"fixed\"\naxes = \"\"\nrotations = \"xyz\"\nfrom = 5e-5\n";
    let mut bar = bar(1e-4, clamp);
    bar.spin = vec![[300.0, 0.0, 0.0]; bar.mesh.n_nodes()];
    let solved = run(bar);
    let (first, last) = (&solved.rows[0], solved.rows.last().expect("rows"));
    assert!((first.kinetic / of_spin() - 1.0).abs() < 1e-6, "{first:?}");
    assert_eq!(last.kinetic, 0.0);
    assert!((last.external / first.kinetic + 1.0).abs() < 1e-6, "{last:?}");
    let worst = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6, "error {worst}");
}

/// A plate of shells across the axis y and a bar of beams across it, which something turns at 600/s until it lets go of them.
fn turned(what: &str, end: f64, turns: &str) -> Solved {
    run(match what {
        "plate" => model(&format!(
            "title = \"plate\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n[output]\nhistory_cycles = 1\n\
             [[part]]\nname = \"plate\"\nmaterial = {STEEL}\nshell = {{ thickness = 2e-3 }}\n\
             plate = {{ origin = [-0.02, -0.02, 0], side_i = [0.04, 0, 0], side_j = [0, 0.04, 0], cells = [6, 6] }}\n{turns}"
        )),
        _ => bar(end, turns),
    })
}

#[test]
fn a_rotation_turns_the_nodes_of_shells_and_beams_as_a_rigid_body_does() {
    for (what, middle) in [("plate", 0.0), ("bar", 0.05)] {
        let boundary = format!(
            "[[boundary]]\ntype = \"rotation\"\naxis = \"y\"\npoint = [{middle}, 0, 0]\nrate = 600\nuntil = 2e-5\n"
        );
        let body = format!(
            "[[rigid]]\nparts = [\"{what}\"]\nvelocity = {{ x = 0, y = 0, z = 0 }}\nspin = {{ x = 0, y = 600, z = 0 }}\nuntil = 2e-5\n"
        );
        let [solved, rigid] = [boundary, body].map(|turns| turned(what, 6e-5, &turns));
        // The body is given its motion in the first cycle.
        let (start, expected) = (solved.rows[0].kinetic, rigid.rows.last().expect("rows").kinetic);
        assert!((start / expected - 1.0).abs() < 1e-5, "{what}: {start:e} at the start, not {expected:e}");
        let last = solved.rows.last().expect("rows");
        let strained = solved.rows.iter().map(|row| row.internal).fold(0.0, f64::max) / start;
        println!("{what}: strained by {strained:e}, external {:e}, error {:e}", last.external, last.error);
        assert!(strained < 1e-4, "{what}: {strained:e} of its energy is strain");
        assert!((last.kinetic / expected - 1.0).abs() < 1e-4 && last.error.abs() < 1e-5, "{what}: {last:?}");
    }
}

#[test]
fn a_stressed_sheet_that_is_turned_about_an_axis_of_its_plane_keeps_its_energy() {
    let solved = run(model(&format!(
        "title = \"turned\"\nunits = \"SI\"\n[control]\nend_time = 1.5708e-3\n\
         [[part]]\nname = \"sheet\"\nmaterial = {STEEL}\nshell = {{ thickness = 1e-3 }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [0.02, 0, 0], side_j = [0, 0.02, 0], cells = [2, 2] }}\n\
         [[boundary]]\ntype = \"rotation\"\nparts = [\"sheet\"]\naxis = \"x\"\npoint = [0.003, 0.004, 0]\nrate = 2e4\n\
         [[boundary]]\ntype = \"fixed\"\naxes = \"x\"\n[[initial_stress]]\nstress = [2e8, -5e7, 0, 8e7, 0, 0]\n"
    )));
    let [first, last] = [&solved.rows[0], solved.rows.last().expect("rows")].map(|row| row.internal);
    println!("{first} J, {last} after five turns");
    // Where its nodes turned as the circle does and its elements as their chords, it was sheared by the difference: half as much again.
    assert!((last / first - 1.0).abs() < 1e-3, "{first} {last}");
}

#[test]
fn a_rotation_that_begins_late_gives_the_energy_of_rotation_as_its_work() {
    let late =
        "[[boundary]]\ntype = \"rotation\"\naxis = \"x\"\npoint = [0, 0, 0]\nrate = 300\nfrom = 5e-5\n";
    let solved = run(bar(1e-4, late));
    let last = solved.rows.last().expect("rows");
    assert!((last.kinetic / of_spin() - 1.0).abs() < 1e-6, "{last:?}");
    assert!((last.external / last.kinetic - 1.0).abs() < 1e-6 && last.error.abs() < 1e-6, "{last:?}");
}

/// What is strained and turns keeps its energy: rubber-like bars that spin, pulled by what they weigh. By the stress turned to the end of a
/// step, in place of that in its middle, one of a single element gained 2.0 % in this time, one of 16 elements 0.15 %.
#[test]
fn what_is_strained_and_spins_keeps_its_energy() {
    let kinds = ["", "points = 8\n", "hourglass = { kind = \"stiffness\" }\n"];
    for (keys, cells) in kinds.into_iter().flat_map(|keys| [[1, 1, 1], [4, 2, 2]].map(|cells| (keys, cells)))
    {
        let mut bar = model(&format!(
            "title = \"bar\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 1\nenergy_error = 10\n[output]\nhistory_cycles = 20\n\
             [[part]]\nname = \"bar\"\n{keys}material = {{ density = 1e-6, eos = {{ type = \"linear\", bulk = 0.5 }}, strength = {{ type = \"elastic\", shear = 8e-3 }} }}\n\
             box = {{ origin = [-2, -1, -1], size = [4, 2, 2], cells = {cells:?} }}\n"
        ));
        let spin = |[x, y, _]: [f64; 3]| [-15.8 * y, 15.8 * x, 0.0];
        bar.velocity = bar.mesh.positions.iter().map(|x| spin(*x)).collect();
        let solved = run(bar);
        let last = solved.rows.last().expect("rows");
        println!(
            "{keys}{cells:?} internal {:e} of {:e}, error {:e}",
            last.internal, last.kinetic, last.error
        );
        assert!(last.internal > 1e-3 * last.kinetic, "hardly strained: {last:?}");
        assert!(last.error.abs() < 5e-4, "{keys}{cells:?} {last:?}");
    }
}
