//! An octagonal girder that runs onto a rigid wall with nothing behind it: what the wall has of it, the stress that it
//! meets the wall with, and how long its eight sides stay alike.

use master::options::SessionOptions;
use mechanics::state::GlobalState;
use protocol::options::JobOptions;

use crate::{
    case::Figures,
    solve::{Solved, Workers, mean, model, solve},
};

/// Sides, shells around and along, side (m), thickness (m), length (m), speed (m/s).
const SIDES: usize = 8;
const AROUND: usize = 32;
const ALONG: usize = 128;
const SIDE: f64 = 0.04;
const THICKNESS: f64 = 2e-3;
const LENGTH: f64 = 0.8;
const SPEED: f64 = 20.0;
/// Of steel (kg/m3): 210 GPa, 0.3, 250 MPa, rising by 1 GPa of strain after yield.
const DENSITY: f64 = 7850.0;
/// Of the wall (kg): it is moved by 80 N s, so by 80 um/s.
const WALL: f64 = 1e6;
/// The girder has left the wall by then.
const CYCLES: u64 = 3000;

/// The girder, thrown at the wall; states every 50 us.
fn thrown() -> Solved {
    let radius = 0.5 * SIDE / (std::f64::consts::PI / SIDES as f64).sin();
    let hardening = 1e9 / (1.0 - 1e9 / 210e9);
    let deck = format!(
        "title = \"girder alone\"\nunits = \"SI\"\n[control]\nend_cycle = {CYCLES}\nend_time = 1\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"girder\"\nvelocity = [0, 0, {}]\nmaterial = {{ density = {DENSITY:?}, eos = {{ type = \"linear\", \
         bulk = 175e9 }}, strength = {{ type = \"von-mises\", shear = {:e}, yield_stress = 250e6, hardening = {hardening:e} }} }}\n\
         shell = {{ thickness = {THICKNESS}, points = 5 }}\n\
         prism = {{ axis = \"z\", base = [0, 0, 0], radius = {radius:e}, length = {LENGTH}, sides = {SIDES}, \
         cells = [{AROUND}, {ALONG}] }}\n[[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nmass = {WALL:e}\n",
        -SPEED,
        210e9 / 2.6
    );
    let mut model = model(&deck);
    model.output.period = Some(50e-6);
    let asked = JobOptions { snapshot_at: Some(CYCLES - 10), ..JobOptions::default() };
    let options = SessionOptions { asked, ..SessionOptions::default() };
    solve(model, Workers { options, ..Workers::default() }).unwrap_or_else(|e| panic!("{e}"))
}

/// How far a node is from where a turn by so many sides of the octagon, about its axis, puts the node that was there at
/// first: the greatest.
fn skew(solved: &Solved, state: &GlobalState, sides: usize) -> f64 {
    let nodes = &solved.model.mesh.parts[0].nodes;
    let at = |i: usize, j: usize| state.x[nodes[i % AROUND + AROUND * j] as usize];
    let angle = std::f64::consts::PI * 2.0 * sides as f64 / SIDES as f64;
    let (sin, cos) = if sides == 2 { (1.0, 0.0) } else { angle.sin_cos() };
    let all = (0..=ALONG).flat_map(|j| (0..AROUND).map(move |i| (i, j)));
    all.map(|(i, j)| {
        let ([x, y, z], there) = (at(i, j), at(i + sides * AROUND / SIDES, j));
        let turned = [x * cos - y * sin, x * sin + y * cos, z];
        (0..3).map(|a| (turned[a] - there[a]).abs()).fold(0.0, f64::max)
    })
    .fold(0.0, f64::max)
}

pub(super) fn a_girder_alone_gives_the_wall_its_momentum_and_stays_symmetric_throughout(
    figures: &mut Figures,
) {
    let solved = thrown();
    let mesh = &solved.model.mesh;
    let mass: f64 = solved.state.mass.iter().sum();
    let snapshot = solved.snapshot.as_ref().expect("it was asked for");
    let momentum = |v: &[[f64; 3]]| v.iter().zip(&snapshot.state.mass).map(|(v, m)| m * v[2]).sum::<f64>();
    let lost = momentum(&solved.model.velocity) - momentum(&snapshot.state.v);
    let [_, wall] = snapshot.walls[0];
    assert!(lost < -SPEED * mass, "it comes back: {lost}");
    figures.add("girder alone: momentum of the wall over what it lost", WALL * wall[2] / lost);

    // The fronts leave the wall at 5172 and 409 m/s; the first is back from the rear at 310 us.
    let section = mass / (DENSITY * LENGTH);
    let force = solved.rows.windows(2).map(|w| {
        let dt = 0.5 * (w[0].dt + w[1].dt);
        (w[1].time, (w[1].momentum[2] - w[0].momentum[2]) / dt)
    });
    let force: Vec<(f64, f64)> = force.collect();
    let plateau = mean(force.iter().filter(|(t, _)| (20e-6..100e-6).contains(t)).map(|(_, f)| *f));
    figures.add("girder alone: stress that it meets the wall with", plateau / section);

    let early = solved.state_at(100e-6);
    figures.add("girder alone: difference of its quarters at 100 us", skew(&solved, early, 2) / SIDE);
    figures.add("girder alone: difference of its eighths at 100 us", skew(&solved, early, 1) / SIDE);

    let rear = mesh.parts[0].nodes[AROUND * ALONG] as usize;
    let shortest = solved.states.iter().map(|state| {
        let front =
            mesh.parts[0].nodes[..AROUND].iter().map(|n| state.x[*n as usize][2]).fold(f64::MAX, f64::min);
        state.x[rear][2] - front
    });
    let shortened = LENGTH - shortest.fold(f64::MAX, f64::min);
    let last = solved.rows.last().expect("rows");
    figures.add("girder alone: greatest shortening", shortened);
    figures.add("girder alone: energy error", last.error);
}
