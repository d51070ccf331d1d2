//! Stress and plastic strain at the start: a bar that is let go, plates in equilibrium, springback, hardening that is over.

use deck::Model;
use mechanics::state::{GlobalState, field};

use crate::{
    case::Figures,
    forms::{Cell, mesh},
    solve::{crossing, model, run, run_with_states},
    tetrahedra::cut,
};

/// Young's modulus 200 GPa, density 8000, no Poisson's ratio: waves of 5000 m/s.
const ELASTIC: &str = "{ density = 8000, eos = { type = \"linear\", bulk = 66.66666666666667e9 }, \
                       strength = { type = \"elastic\", shear = 100e9 } }";

fn head(end: &str, rest: &str) -> String {
    format!("title = \"stressed\"\nunits = \"SI\"\n[control]\n{end}\n[output]\nhistory_cycles = 1\n{rest}")
}

/// A bar of 0.1 m that is pulled with 100 MPa and held at both ends until one is let go at the start.
pub(super) fn a_pulled_bar_that_is_let_go_unloads_by_a_wave(figures: &mut Figures) {
    let deck = head(
        "end_time = 18e-6",
        &format!(
            "period = 15e-6\n[[part]]\nname = \"bar\"\nmaterial = {ELASTIC}\n\
             box = {{ origin = [0, 0, 0], size = [0.1, 5e-4, 5e-4], cells = [200, 1, 1] }}\n\
             [[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\n\
             [[initial_stress]]\nstress = [100e6, 0, 0, 0, 0, 0]\n\
             [[gauge]]\nname = \"middle\"\npoint = [0.05, 0, 0]\n[[gauge]]\nname = \"end\"\npoint = [0.1, 0, 0]\n"
        ),
    );
    let solved = run_with_states(model(&deck));
    figures.add("bar let go: velocity of its end", solved.gauge_mean(1, 5e-6, 15e-6, |g| g.v[0]));
    let middle = solved.gauge(0).map(|(time, g)| (time, -g.v[0]));
    figures.add("bar let go: arrival in the middle", crossing(middle, 1.25).expect("the wave gets there"));
    let stress =
        |state: &GlobalState, e: usize| state.elements[field::SXX][e] - state.elements[field::PRESSURE][e];
    let state = solved.state_at(15e-6);
    let of = |from: f64, to: f64| solved.element_mean(state, 0, |[x, _, _]| (from..to).contains(&x), stress);
    figures.add("bar let go: stress behind the wave", of(0.04, 0.09));
    figures.add("bar let go: stress ahead of it", of(0.0, 0.015));
    // What it held at the start, half the stress squared over Young's modulus in its volume.
    let first = &solved.rows[0];
    figures.add("bar let go: internal energy at the start", first.internal / (0.1 * 5e-4 * 5e-4));
    figures.add("bar let go: energy error", solved.outcome.run_totals.last.error);
}

/// How far pressure and von Mises' stress of any element are from what `[60, -30, 0]` MPa and 20 MPa of shear make, over that.
fn change(state: &GlobalState) -> f64 {
    let of = |k: usize, e: usize| state.elements[k][e];
    let mises = (60.0_f64 * 60.0 + 60.0 * 30.0 + 30.0 * 30.0 + 3.0 * 20.0 * 20.0).sqrt() * 1e6;
    let of_element = |e: usize| {
        let [xx, yy, xy] = [field::SXX, field::SYY, field::SXY].map(|k| of(k, e));
        let [yz, zx] = [field::SYZ, field::SZX].map(|k| of(k, e));
        let shears = xy * xy + yz * yz + zx * zx;
        let found = (3.0 * (xx * xx + yy * yy + xx * yy + shears)).sqrt();
        (found / mises - 1.0).abs().max((of(field::PRESSURE, e) / -10e6 - 1.0).abs())
    };
    (0..state.initial_volume.len()).map(of_element).fold(0.0, f64::max)
}

/// Plates in equilibrium, held at their edges: of each kind of solid and of shells.
pub(super) fn plates_in_equilibrium_stay_as_they_are(figures: &mut Figures) {
    const BOX: &str = "box = { origin = [0, 0, 0], size = [16, 16, 8], cells = [4, 4, 2] }\n";
    let of = |cell: Cell| mesh([4, 4, 2], |_| cell);
    let kinds = [
        ("hexahedra", BOX.to_owned()),
        ("eight points", format!("points = 8\n{BOX}")),
        ("wedges", of(Cell::Wedges(2))),
        ("pyramids", of(Cell::Pyramids)),
        ("tetrahedra", of(Cell::Tetrahedra)),
        ("composite tetrahedra", BOX.to_owned()),
        (
            "shells",
            "rotate = { axis = [0, 0, 1], degrees = 90, point = [8, 8, 0] }\nshell = { thickness = 2 }\n\
             plate = { origin = [0, 0, 0], side_i = [16, 0, 0], side_j = [0, 16, 0], cells = [4, 4] }\n"
                .to_owned(),
        ),
        (
            "membranes of four points",
            "rotate = { axis = [0, 0, 1], degrees = 90, point = [8, 8, 0] }\n\
             shell = { thickness = 2, in_plane = 4, membrane = true }\n\
             plate = { origin = [0, 0, 0], side_i = [16, 0, 0], side_j = [0, 16, 0], cells = [4, 4] }\n"
                .to_owned(),
        ),
    ];
    for (kind, shape) in kinds {
        let sides = [
            ([0, 0, 0], [1, 0, 0]),
            ([16, 0, 0], [1, 0, 0]),
            ([0, 0, 0], [0, 1, 0]),
            ([0, 16, 0], [0, 1, 0]),
        ];
        let held = sides.map(|(point, normal)| {
            format!("[[boundary]]\ntype = \"fixed\"\nplane = {{ point = {point:?}, normal = {normal:?} }}\n")
        });
        let held = held.concat();
        let deck = head(
            "end_cycle = 1000\nend_time = 1e3",
            &format!(
                "[[part]]\nname = \"plate\"\nmaterial = \"CU_OFHC\"\n{shape}{held}\
                 [[initial_stress]]\nstress = [60e6, -30e6, 0, 20e6, 0, 0]\nplastic_strain = 0.1\n"
            ),
        );
        let model = model(&deck);
        let solved = run(if kind == "composite tetrahedra" { cut(model, |_| true) } else { model });
        assert_eq!(solved.state.cycle, 1000);
        figures
            .add(&format!("plate under stress @ {kind}, change of it in 1000 cycles"), change(&solved.state));
    }
}

/// Bars that are pulled and held at both ends, along no axis of the deck.
pub(super) fn pulled_bars_that_are_held_stay_as_they_are(figures: &mut Figures) {
    for (kind, section) in [
        ("truss", "truss = { area = 1e-4 }"),
        ("beam", "beam = { rectangle = [0.01, 0.02], across = [0, 0, 1] }"),
    ] {
        let deck = head(
            "end_cycle = 1000\nend_time = 1",
            &format!(
                "[[part]]\nname = \"bar\"\nmaterial = \"STEEL_4340\"\n{section}\n\
                 mesh = {{ nodes = [[1, 0, 0, 0], [2, 0.3, 0.4, 0], [3, 0.6, 0.8, 0]], elements = [[1, 1, 2], [2, 2, 3]] }}\n\
                 [[boundary]]\ntype = \"fixed\"\nnodes = [1, 3]\n\
                 [[initial_stress]]\nstress = [36e6, 64e6, 0, 48e6, 0, 0]\nplastic_strain = 0.01\n"
            ),
        );
        let solved = run(model(&deck));
        let off = |e: usize| (-3.0 * solved.state.elements[field::PRESSURE][e] / 100e6 - 1.0).abs();
        let off = off(0).max(off(1));
        figures.add(&format!("pulled bar that is held @ {kind}, change of its stress in 1000 cycles"), off);
    }
}

/// A strip with a stress that is linear through its thickness springs back to an arc.
pub(super) fn a_bent_strip_springs_back(figures: &mut Figures) {
    for (points, in_plane, kind) in
        [(2, 1, "2 points"), (5, 1, "5 points"), (2, 4, "2 points in each of four")]
    {
        let deck = head(
            "end_time = 0.02",
            &format!(
                "[relaxation]\nrate = 2000\n[[part]]\nname = \"strip\"\nmaterial = {ELASTIC}\n\
                 shell = {{ thickness = 2e-3, points = {points}, in_plane = {in_plane} }}\n\
                 plate = {{ origin = [0, 0, 0], side_i = [0.1, 0, 0], side_j = [0, 0.01, 0], cells = [20, 2] }}\n\
                 [[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\nrotations = \"xyz\"\n\
                 [[initial_stress]]\nlayers = [{{ height = -1, stress = [-20e6, 0, 0, 0, 0, 0] }}, \
                 {{ height = 1, stress = [20e6, 0, 0, 0, 0, 0] }}]\n"
            ),
        );
        let solved = run(model(&deck));
        let tip = solved.state.x.iter().map(|x| x[2]).fold(f64::MIN, f64::max);
        figures.add(&format!("springback of a strip @ {kind}, deflection"), tip);
    }
}

/// A cube that was hardened before is pulled until it flows.
fn pulled(initial: &str) -> Model {
    model(&head(
        "end_time = 1e-3",
        &format!(
            "[[part]]\nname = \"cube\"\nmaterial = {{ density = 8000, eos = {{ type = \"linear\", bulk = \
             166.66666666666667e9 }}, strength = {{ type = \"von-mises\", shear = 76.92307692307692e9, yield_stress = \
             300e6, hardening = 1e9 }} }}\nbox = {{ origin = [0, 0, 0], size = [0.01, 0.01, 0.01], cells = [1, 1, 1] }}\n\
             [[boundary]]\ntype = \"fixed\"\nface = \"i-min\"\naxes = \"x\"\n\
             [[boundary]]\ntype = \"velocity\"\nface = \"i-max\"\nvelocity = {{ x = 0.1 }}\n{initial}"
        ),
    ))
}

pub(super) fn plastic_strain_at_the_start_has_hardened(figures: &mut Figures) {
    let solved = run(pulled("[[initial_stress]]\nplastic_strain = 0.1\n"));
    let of = |k: usize| solved.state.elements[k][0];
    figures.add("hardened cube: stress at its end", of(field::SXX) - of(field::PRESSURE));
    figures.add("hardened cube: plastic strain at its end", of(field::PLASTIC_STRAIN));
}
