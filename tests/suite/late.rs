//! Bodies at rest that are loaded late: their totals closes, and nothing stops them.
//!
//! Work from outside and the total of a row speak of the same instant, however long the body was at rest before.

use deck::Model;
use tests::solve::{Solved, model, run};

/// Cycles of a run after the load begins.
const LOADED: u64 = 400;
/// Largest energy error of the last row.
const LIMIT: f64 = 1e-3;
/// Largest error of any row, far from the half that ends a run.
const ANY: f64 = 0.2;

/// A body and where loads act on it.
struct Body {
    deck: &'static str,
    /// Its top (m).
    height: f64,
    face: &'static str,
    /// The faces that are pressed.
    pressed: &'static str,
    /// How hard (Pa).
    pressure: f64,
}

const BODIES: [Body; 3] = [
    Body {
        deck: "[[part]]\nname = \"block\"\nmaterial = \"CU_OFHC\"\n\
               box = { origin = [0, 0, 0], size = [0.01, 0.01, 0.02], cells = [5, 5, 10] }\n",
        height: 0.02,
        face: "k-max",
        pressed: "face = \"k-max\"",
        pressure: 1e9,
    },
    Body {
        deck: "[[part]]\nname = \"tube\"\nmaterial = \"STEEL_1006\"\n\
               tube = { base = [0, 0, 0], axis = \"z\", inner_radius = 0.01, outer_radius = 0.012, length = 0.03, \
               cells = [2, 16, 15] }\n",
        height: 0.03,
        face: "k-max",
        pressed: "face = \"i-max\"",
        pressure: 3e7,
    },
    Body {
        deck: "[[part]]\nname = \"plate\"\nmaterial = \"STEEL_1006\"\nshell = { thickness = 1e-3, points = 3 }\n\
               plate = { origin = [0, 0, 0], side_i = [0.02, 0, 0], side_j = [0, 0, 0.03], cells = [8, 12] }\n\
               [[boundary]]\ntype = \"fixed\"\nface = \"j-min\"\nrotations = \"xyz\"\n",
        height: 0.03,
        face: "j-max",
        pressed: "",
        pressure: 1e6,
    },
];

fn deck(body: &str, cycles: u64, load: &str) -> Model {
    model(&format!(
        "title = \"loaded late\"\nunits = \"SI\"\n[control]\nend_cycle = {cycles}\nend_time = 1\n\
         [output]\nhistory_cycles = 1\n{body}{load}"
    ))
}

/// Its step while it is at rest.
fn step_of(body: &str) -> f64 {
    let solved = run(deck(body, 3, ""));
    solved.rows.last().expect("rows").dt
}

/// Runs a body that a load meets after `rest` cycles.
fn loaded(body: &str, rest: u64, load: &str) -> Solved {
    let solved = run(deck(body, rest + LOADED, load));
    let quiet = solved.rows.iter().take_while(|row| row.total == 0.0 && row.external == 0.0).count() as u64;
    assert!(quiet.abs_diff(rest) <= 2, "at rest for {quiet} cycles, not {rest}");
    solved
}

/// The error of the last row, and the largest of any row.
fn errors(solved: &Solved) -> [f64; 2] {
    let last = solved.rows.last().expect("rows");
    assert!(last.external > 0.0, "the load does work");
    [last.error, solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max)]
}

fn ledger_closes(kind: &str, load: impl Fn(f64, &Body) -> String) {
    for body in BODIES {
        let dt = step_of(body.deck);
        for rest in [10, 100, 1000] {
            let solved = loaded(body.deck, rest, &load(rest as f64 * dt, &body));
            let [last, largest] = errors(&solved);
            let name = &solved.model.mesh.parts[0].name;
            println!("{name} loaded by {kind} after {rest} cycles: error {last:e}, largest {largest:e}");
            assert!(
                last.abs() < LIMIT && largest < ANY,
                "{name} by {kind} after {rest} cycles: {last:e}, {largest:e}"
            );
        }
    }
}

fn curve(from: f64) -> String {
    format!("[[curve]]\nname = \"late\"\npoints = [[0, 0], [{from:e}, 0], [{:e}, 1], [1, 1]]\n", from + 1e-6)
}

#[test]
fn a_wall_that_comes_late_does_the_work_that_the_body_has() {
    ledger_closes("a wall", |from, body| {
        let z = body.height + 20.0 * from;
        format!("[[wall]]\npoint = [0, 0, {z:e}]\nnormal = [0, 0, -1]\nvelocity = {{ z = -20 }}\n")
    });
}

#[test]
fn a_pressure_that_comes_late_does_the_work_that_the_body_has() {
    ledger_closes("a pressure", |from, body| {
        let face = body.pressed;
        let size = body.pressure;
        format!(
            "{}[[load]]\ntype = \"pressure\"\n{face}\npressure = {{ curve = \"late\", factor = {size:e} }}\n",
            curve(from)
        )
    });
}

#[test]
fn a_motion_that_comes_late_does_the_work_that_the_body_has() {
    ledger_closes("a motion", |from, body| {
        let face = body.face;
        format!(
            "{}[[boundary]]\ntype = \"velocity\"\nface = \"{face}\"\nvelocity = {{ z = {{ curve = \"late\", factor = -20 }} }}\n",
            curve(from)
        )
    });
}

/// A copper bar that starts at 227 m/s beside a wall, with a gauge at its rear.
fn bar(cycles: u64) -> Model {
    model(&format!(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_cycle = {cycles}\nend_time = 1\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"bar\"\nmaterial = \"CU_OFHC\"\nvelocity = [0, 0, -227]\n\
         box = {{ origin = [0, 0, 0], size = [0.006, 0.006, 0.03], cells = [3, 3, 15] }}\n\
         [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
         [[gauge]]\nname = \"rear\"\npoint = [0, 0, 0.03]\n"
    ))
}

#[test]
fn the_first_row_is_that_of_the_start() {
    let mass = 8960.0 * 0.006 * 0.006 * 0.03;
    let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-9;
    let solved = run(bar(3));
    let first = &solved.rows[0];
    assert_eq!(first.time, 0.0);
    assert!(near(first.kinetic, 0.5 * mass * 227.0 * 227.0), "{first:?}");
    assert!(near(first.momentum[2], -227.0 * mass), "{first:?}");
    assert_eq!([first.external, first.internal], [0.0; 2]);
    assert_eq!(first.gauges[0].x, solved.model.mesh.positions[solved.model.output.gauges[0].node as usize]);
    assert_eq!(first.gauges[0].v, [0.0, 0.0, -227.0]);
    // Each row's position is where the velocities between led.
    for rows in solved.rows.windows(2) {
        let [before, after] = [&rows[0], &rows[1]];
        let led = before.gauges[0].x[2] - 227.0 * (after.time - before.time);
        assert!((after.gauges[0].x[2] - led).abs() < 1e-12, "{before:?} {after:?}");
    }
}

#[test]
fn a_run_of_no_cycle_has_the_energy_and_momentum_of_its_start() {
    let mass = 8960.0 * 0.006 * 0.006 * 0.03;
    let mut bar = bar(1);
    bar.setup.control.end_cycle = 0;
    let totals = run(bar).outcome.run_totals;
    assert!((totals.last.kinetic / (0.5 * mass * 227.0 * 227.0) - 1.0).abs() < 1e-9, "{:?}", totals.last);
    assert_eq!(totals.momentum_error(), 0.0);
}

/// Foams are much stiffer where they begin to unload than at rest: the step knows it before, and no first touch ends a run.
#[test]
fn blocks_of_foam_that_strike_a_wall_run() {
    for (hysteresis, shape) in [(1.0, 1.0), (0.5, 2.0), (0.1, 5.0)] {
        for speed in [0.2, 1.0, 5.0, 30.0] {
            let solved = run(model(&format!(
                "title = \"foam\"\nunits = \"SI\"\n[control]\nend_cycle = 1500\nend_time = 1\nenergy_error = 0.05\n\
                 [[part]]\nname = \"block\"\nvelocity = [3, 0, -{speed}]\n\
                 material = {{ density = 100, eos = {{ type = \"linear\", bulk = 1e6 }}, strength = {{ type = \"low-density-foam\", \
                 young = 3e6, tension = 1e5, hysteresis = {hysteresis}, shape = {shape}, points = [[0, 0], [0.6, 0.5e6], [0.9, 9e6]] }} }}\n\
                 box = {{ origin = [0, 0, 0], size = [0.02, 0.02, 0.02], cells = [5, 5, 5] }}\n\
                 [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n"
            )));
            let last = solved.rows.last().expect("rows");
            println!("{hysteresis} {shape} {speed}: t {:.3e} s, energy error {:.1e}", last.time, last.error);
        }
    }
}
