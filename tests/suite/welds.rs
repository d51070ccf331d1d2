//! Rigid bodies of a few nodes: welds of sheets, of beams and of blocks, against the whole that they make of them and closed forms.

use deck::Model;
use tests::solve::{Solved, cross, model, run};

use crate::bits::same_bits;

const STEEL: &str = "{ density = 8000, eos = { type = \"linear\", bulk = 150e9 }, strength = { type = \"elastic\", shear = 80e9 } }";
/// Its Young's modulus (Pa).
const YOUNG: f64 = 9.0 * 150e9 * 80e9 / (3.0 * 150e9 + 80e9);

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

fn size(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn worst_error(solved: &Solved) -> f64 {
    solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max)
}

/// Momentum and angular momentum about the origin: of the bodies, and of nodes that none has.
fn moments(solved: &Solved) -> [[f64; 3]; 2] {
    let state = &solved.state;
    let (mut momentum, mut angular) = ([0.0; 3], [0.0; 3]);
    let mut add = |mass: f64, x: [f64; 3], v: [f64; 3], own: [f64; 3]| {
        let moment = cross(x, v);
        for a in 0..3 {
            momentum[a] += mass * v[a];
            angular[a] += mass.mul_add(moment[a], own[a]);
        }
    };
    let bodies = &solved.model.setup.bodies;
    for (body, moved) in bodies.iter().zip(&solved.outcome.run_totals.bodies) {
        add(body.mass, moved.centre, moved.velocity, moved.momentum);
    }
    for n in 0..state.x.len() {
        if bodies.iter().all(|body| body.nodes.binary_search(&(n as u32)).is_err()) {
            let own = state.shells.inertia.get(n).map_or([0.0; 3], |i| state.shells.spin[n].map(|w| i * w));
            add(state.mass[n], state.x[n], state.v[n], own);
        }
    }
    [momentum, angular]
}

/// A strip of 10 by 2 shells whose root is held, in two halves of 15 nodes each of which the second is `gap` higher, and what makes one
/// of them. Its tip is pushed up and aside.
fn strip(gap: f64, end_cycle: u32, whole: &str) -> Model {
    model(&format!(
        r#"
        title = "strip of two halves"
        units = "SI"
        [control]
        end_time = 1
        end_cycle = {end_cycle}
        [[part]]
        name = "root"
        material = {STEEL}
        shell = {{ thickness = 2e-3 }}
        plate = {{ origin = [0, 0, 0], side_i = [0.05, 0, 0], side_j = [0, 0.02, 0], cells = [5, 2] }}
        [[part]]
        name = "strip"
        material = {STEEL}
        shell = {{ thickness = 2e-3 }}
        plate = {{ origin = [0.05, 0, {gap:e}], side_i = [0.05, 0, 0], side_j = [0, 0.02, 0], cells = [5, 2] }}
        [[boundary]]
        type = "fixed"
        parts = ["root"]
        face = "i-min"
        rotations = "xyz"
        [[load]]
        type = "force"
        parts = ["strip"]
        face = "i-max"
        force = [0, 10, 40]
        {whole}
        [output]
        history_cycles = 1
        [[gauge]]
        name = "tip"
        part = "strip"
        point = [0.1, 0.01, {gap:e}]
        "#
    ))
}

/// Each node of the end of the first half in one body with that of the second which is above it.
fn welds(gap: f64) -> String {
    let apart = strip(gap, 1, "");
    let mesh = &apart.mesh;
    let ends = |part: usize| {
        let nodes = mesh.parts[part].nodes.iter().copied();
        nodes.filter(|&n| (mesh.positions[n as usize][0] - 0.05).abs() < 1e-9).collect::<Vec<_>>()
    };
    let weld = |(a, b): (u32, u32)| {
        let apart = minus(mesh.positions[b as usize], mesh.positions[a as usize]);
        assert!(size(minus(apart, [0.0, 0.0, gap])) < 1e-12, "{apart:?}");
        format!("[[rigid]]\nnodes = [{}, {}]\n", mesh.node_ids[a as usize], mesh.node_ids[b as usize])
    };
    let welds: Vec<String> = ends(0).into_iter().zip(ends(1)).map(weld).collect();
    assert_eq!(welds.len(), 3);
    welds.concat()
}

/// A strip that one row of bodies welds, against one whose halves are joined: the greatest difference of the rise of their tips over that
/// rise.
fn beside_one_sheet(gap: f64) -> (f64, Solved) {
    let joined = run(strip(0.0, 800, "[[join]]\nparts = [\"root\", \"strip\"]\n"));
    let welded = run(strip(gap, 800, &welds(gap)));
    let most = joined.gauge(0).map(|(_, row)| row.x[2]).fold(0.0, f64::max);
    assert!(most > 1e-4, "the strip hardly bends: {most}");
    let apart = joined.gauge(0).zip(welded.gauge(0)).map(|((time, a), (of_welded, b))| {
        assert!((time - of_welded).abs() < 1e-3 * time.max(1e-9), "rows of other times");
        (a.x[2] - (b.x[2] - gap)).abs()
    });
    let worst = apart.fold(0.0, f64::max) / most;
    println!("gap {gap}: rise {most:e} m, apart by {worst:e} of it, energy error {:e}", worst_error(&welded));
    assert!(worst_error(&welded) < worst_error(&joined) + 1e-3, "energy error {}", worst_error(&welded));
    (worst, welded)
}

#[test]
fn sheets_welded_node_on_node_bend_as_one_sheet() {
    let (apart, _) = beside_one_sheet(0.0);
    assert!(apart < 1e-8, "{apart}");
}

#[test]
fn sheets_welded_across_a_gap_pass_on_their_moments() {
    let (apart, welded) = beside_one_sheet(1e-3);
    assert!(apart < 0.03, "{apart}");
    let limits: Vec<f64> = welded.rows.iter().map(|row| row.dt).collect();
    let shortest = limits[1..limits.len() - 1].iter().copied().fold(f64::INFINITY, f64::min);
    assert!(shortest > 0.5 * limits[1], "steps fell to {shortest}");
}

#[test]
fn welded_sheets_have_the_same_bits_on_any_workers() {
    same_bits(&strip(1e-3, 100, &welds(1e-3)));
}

/// Two blocks a millimetre apart, of which the upper flies, and a weld from a corner of the one to one of the other.
fn blocks(oblique: bool) -> Model {
    let text = |rigid: &str| {
        format!(
            "title = \"blocks\"\nunits = \"SI\"\n[control]\nend_time = 1\nend_cycle = 300\n[output]\nhistory_cycles = 1\n\
             [[part]]\nname = \"low\"\nmaterial = {STEEL}\n\
             box = {{ origin = [0, 0, 0], size = [0.02, 0.02, 0.02], cells = [2, 2, 2] }}\n\
             [[part]]\nname = \"up\"\nmaterial = {STEEL}\nvelocity = [3, -2, 10]\n\
             box = {{ origin = [0, 0, 0.021], size = [0.02, 0.02, 0.02], cells = [2, 2, 2] }}\n{rigid}"
        )
    };
    let apart = model(&text(""));
    let near = |x: [f64; 3]| {
        let far = |n: &usize| size(minus(apart.mesh.positions[*n], x));
        let node = (0..apart.mesh.n_nodes()).min_by(|a, b| far(a).total_cmp(&far(b))).expect("nodes");
        apart.mesh.node_ids[node]
    };
    let above = if oblique { [0.02, 0.01, 0.021] } else { [0.01, 0.01, 0.021] };
    model(&text(&format!("[[rigid]]\nnodes = [{}, {}]\n", near([0.01, 0.01, 0.02]), near(above))))
}

#[test]
fn a_weld_of_blocks_that_move_apart_takes_up_their_momenta() {
    for oblique in [false, true] {
        let solved = run(blocks(oblique));
        let mass = 8000.0 * 0.02_f64.powi(3);
        let flying = [3.0, -2.0, 10.0].map(|v| mass * v);
        let turning = cross([0.01, 0.01, 0.031], flying);
        let [momentum, angular] = moments(&solved);
        println!("{momentum:?} {flying:?}\n{angular:?} {turning:?}, error {}", worst_error(&solved));
        assert!(size(minus(momentum, flying)) < 1e-9 * size(flying), "{momentum:?}, at first {flying:?}");
        assert!(size(minus(angular, turning)) < 1e-3 * size(turning), "{angular:?}, at first {turning:?}");
        assert!(worst_error(&solved) < 0.02, "energy error {}", worst_error(&solved));
    }
}

/// A round bar of twelve beams along x with a gap after the sixth, whose ends there are welded; its root is held, its tip pushed.
fn bar(gap: f64, end: f64) -> Model {
    let place = |i: u32| 0.01 * f64::from(i.min(6) + i.saturating_sub(7)) + if i > 6 { gap } else { 0.0 };
    let nodes: Vec<String> = (0..14).map(|i| format!("[{}, {:e}, 0, 0]", i + 1, place(i))).collect();
    let beams: Vec<String> = (1..14).filter(|i| *i != 7).map(|i| format!("[{i}, {i}, {}]", i + 1)).collect();
    model(&format!(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"bar\"\nmaterial = {STEEL}\nbeam = {{ round = 0.005 }}\nmesh = {{ nodes = [{}], elements = [{}] }}\n\
         [[rigid]]\nnodes = [7, 8]\n[[boundary]]\ntype = \"fixed\"\nnodes = [1]\nrotations = \"xyz\"\n\
         [[load]]\ntype = \"force\"\nparts = [\"bar\"]\nnodes = [14]\nforce = [0, 3, 4]\n\
         [[gauge]]\nname = \"tip\"\npart = \"bar\"\npoint = [{:e}, 0, 0]\n",
        nodes.join(", "),
        beams.join(", "),
        place(13)
    ))
}

#[test]
fn beams_welded_end_to_end_bend_as_one_of_the_whole_length() {
    let area = std::f64::consts::PI * 0.0025_f64.powi(2);
    let stiffness = YOUNG * area * 0.0025_f64.powi(2) / 4.0;
    for gap in [0.0, 1e-3] {
        let (length, weld) = (0.12 + gap, 0.06);
        // The first mode of a cantilever; a force that sets in at once bends it about its static deflection, which is the mean over a period.
        let rate = 1.875_104_f64.powi(2) * (stiffness / (8000.0 * area)).sqrt() / (length * length);
        let period = std::f64::consts::TAU / rate;
        let solved = run(bar(gap, period));
        // Nothing bends in the gap.
        let bends = length.powi(3) - (length - weld).powi(3) + (length - weld - gap).powi(3);
        let mean = |axis: usize| solved.gauge_mean(0, 0.0, period, |row| row.x[axis]);
        let [expected, found] =
            [bends / (3.0 * stiffness), mean(1).mul_add(mean(1), mean(2) * mean(2)).sqrt() / 5.0];
        println!("gap {gap}: {found:e} m/N, expected {expected:e}, energy error {:e}", worst_error(&solved));
        assert!((found / expected - 1.0).abs() < 0.02, "{found} m/N, expected {expected}");
        assert!((mean(2) / mean(1) - 4.0 / 3.0).abs() < 1e-6, "{} {}", mean(1), mean(2));
        assert!(worst_error(&solved) < 0.01, "energy error {}", worst_error(&solved));
    }
}
