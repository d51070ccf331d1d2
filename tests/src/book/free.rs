//! Small free bodies: whatever they do, at default settings none of them gains energy, and what is left of their vibration stays.
//!
//! Energy is kinetic, of elastic strain and of plastic work: what a body has without the heat of viscosity and of hourglass control. The
//! totals book this heat by the velocities of half a step before, which for noise of the mesh is 10 to 40 % too much.

use deck::Model;
use master::results::history::PartEnergy;
use mechanics::{
    element::shell4::{ELEMENT, LAYER},
    state::field,
};

use crate::{
    case::Figures,
    solve::{Solved, model, run},
};

/// Elastic steel (SI): 210 GPa, 0.3.
const ELASTIC: &str = "{ density = 7850, eos = { type = \"linear\", bulk = 175e9 }, \
    strength = { type = \"elastic\", shear = 80.7692307692e9 } }";
/// The same, that yields at 200 MPa: at a particle velocity of some 5 m/s.
const PLASTIC: &str = "{ density = 7850, eos = { type = \"linear\", bulk = 175e9 }, \
    strength = { type = \"von-mises\", shear = 80.7692307692e9, yield_stress = 2e8, hardening = 1e9 } }";
/// Nearly a liquid, as lead is: its free elements swing at the highest frequency for their wave speed.
const SOFT: &str = "{ density = 11340, eos = { type = \"linear\", bulk = 46e9 }, \
    strength = { type = \"elastic\", shear = 1e9 } }";

/// Side of a cell (m).
const CELL: f64 = 1e-3;

fn deck(cycles: u64, rest: &str) -> Model {
    model(&format!(
        "title = \"free\"\nunits = \"SI\"\n[control]\nend_cycle = {cycles}\nend_time = 1\nenergy_error = 10\n\
         [output]\nhistory_cycles = 10\n{rest}"
    ))
}

fn solids(name: &str, material: &str, cells: [u32; 3]) -> String {
    let size = cells.map(|n| CELL * f64::from(n));
    format!(
        "[[part]]\nname = \"{name}\"\nmaterial = {material}\n\
         box = {{ origin = [0, 0, 0], size = {size:?}, cells = {cells:?} }}\n"
    )
}

fn shells(material: &str, in_plane: u32, cells: [u32; 2]) -> String {
    let size = cells.map(|n| CELL * f64::from(n));
    format!(
        "[[part]]\nname = \"patch\"\nmaterial = {material}\n\
         shell = {{ thickness = 2e-4, points = 3, in_plane = {in_plane} }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [{:e}, 0, 0], side_j = [0, {:e}, 0], cells = {cells:?} }}\n",
        size[0], size[1]
    )
}

/// Numbers between -1 and 1, the same on every machine.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Gives every node a velocity of its own, up to `speed` along each axis, and those of shells a rotation rate.
fn shaken(mut model: Model, speed: f64) -> Model {
    let mut draw = noise();
    for v in &mut model.velocity {
        *v = [0; 3].map(|_| speed * draw());
    }
    if model.mesh.parts.iter().any(|part| part.section().is_some()) {
        model.spin = model.velocity.iter().map(|_| [0; 3].map(|_| speed / CELL * draw())).collect();
    }
    model
}

/// The greatest energy of the first part over that at the start.
fn growth(solved: &Solved) -> f64 {
    let is_of_shells = solved.model.mesh.parts[0].section().is_some();
    let usable = |part: &PartEnergy| {
        // What hourglass control of elastic shells has taken it holds. What that of solids holds is booked together with what its
        // damping took, so it is left out: a body that gains energy gains motion.
        let stored = if is_of_shells { part.hourglass } else { 0.0 };
        part.kinetic + part.internal - part.viscosity + stored
    };
    let first = usable(&solved.rows[0].parts[0]);
    solved.rows.iter().map(|row| usable(&row.parts[0]) / first).fold(0.0, f64::max)
}

fn of_solids(figures: &mut Figures, cycles: u64, cells: [u32; 3]) {
    for (kind, material, speed) in
        [("elastic", ELASTIC, 0.1), ("plastic", PLASTIC, 30.0), ("nearly liquid", SOFT, 0.1)]
    {
        let solved = run(shaken(deck(cycles, &solids("block", material, cells)), speed));
        figures.add(&format!("free solids @ {kind}, greatest energy over the first"), growth(&solved));
    }
    let solved = run(shaken(deck(cycles, &solids("block", "\"STEEL_4340\"", cells)), 1.0));
    figures.add("free solids @ 4340, greatest energy over the first", growth(&solved));
    let strain = solved.state.elements[field::PLASTIC_STRAIN].iter().copied().fold(0.0, f64::max);
    figures.add("free solids: plastic strain of 4340 that shakes with 1 m/s", strain);
}

fn of_shells(figures: &mut Figures, cycles: u64, cells: [u32; 2]) {
    for (kind, material, speed) in [
        ("elastic", ELASTIC, 0.1),
        ("elastic with 5 m/s", ELASTIC, 5.0),
        ("elastic with 20 m/s", ELASTIC, 20.0),
        ("plastic", PLASTIC, 10.0),
    ] {
        let solved = run(shaken(deck(cycles, &shells(material, 1, cells)), speed));
        figures.add(&format!("free shells @ {kind}, greatest energy over the first"), growth(&solved));
        if material == ELASTIC {
            let difference = stored_by_stress(&solved) - booked_as_stored(&solved);
            let first = solved.rows[0].parts[0].kinetic;
            let name = format!("free shells @ {kind}, energy of the stress less that booked, over the first");
            figures.add(&name, difference / first);
        }
    }
}

fn of_shells_of_four_points(figures: &mut Figures, cycles: u64, cells: [u32; 2]) {
    for (kind, material, speed) in
        [("elastic", ELASTIC, 0.1), ("elastic with 20 m/s", ELASTIC, 20.0), ("plastic", PLASTIC, 10.0)]
    {
        let solved = run(shaken(deck(cycles, &shells(material, 4, cells)), speed));
        let name = format!("free shells of four points @ {kind}, greatest energy over the first");
        figures.add(&name, growth(&solved));
    }
}

/// Energy of an elastic sheet by its strain: what the layers' work has been.
fn booked_as_stored(solved: &Solved) -> f64 {
    let last = &solved.rows[solved.rows.len() - 1].parts[0];
    last.internal - last.viscosity
}

/// The same by the stress of its layers now, Gauss's three: what drifts apart in what is booked shows here.
fn stored_by_stress(solved: &Solved) -> f64 {
    const WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
    const YOUNG: f64 = 210e9;
    const POISSON: f64 = 0.3;
    const SHEAR: f64 = YOUNG / (2.0 * (1.0 + POISSON));
    let density = |element: usize, layer: usize| {
        let [xx, yy, xy, yz, zx] =
            std::array::from_fn(|i| solved.state.own[ELEMENT + layer * LAYER + i][element]);
        let direct = (xx * xx + yy * yy - 2.0 * POISSON * xx * yy) / YOUNG;
        0.5 * (direct + xy * xy / SHEAR + (yz * yz + zx * zx) / (5.0 / 6.0 * SHEAR))
    };
    let volumes = solved.state.initial_volume.iter().enumerate();
    let of_element =
        |element: usize| (0..3).map(|layer| WEIGHTS[layer] * density(element, layer)).sum::<f64>();
    volumes.map(|(element, volume)| volume * of_element(element)).sum()
}

/// A cube that turns about z once in some 1,000 cycles.
fn of_spin(figures: &mut Figures, cycles: u64, n: u32) {
    let mut model = deck(cycles, &solids("cube", ELASTIC, [n; 3]));
    let middle = 0.5 * CELL * f64::from(n);
    let rate = 1e5 / f64::from(n);
    for (v, [x, y, _]) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        *v = [-rate * (y - middle), rate * (x - middle), 0.0];
    }
    figures.add("spinning cube: greatest energy over the first", growth(&run(model)));
}

/// A free cube beside a bar of smaller cells, which shakes so hard that the step of both breathes by a tenth.
fn of_another(figures: &mut Figures, cycles: u64, n: u32) {
    let bar = "[[part]]\nname = \"bar\"\nmaterial = { density = 7850, eos = { type = \"linear\", bulk = 175e9 }, \
        strength = { type = \"elastic\", shear = 80.7692307692e9 } }\n\
        box = { origin = [0.1, 0, 0], size = [0.009, 0.0009, 0.0009], cells = [10, 1, 1] }\n";
    let mut model = deck(cycles, &format!("{}{bar}", solids("cube", ELASTIC, [n; 3])));
    let mut draw = noise();
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        *v = if x[0] < 0.05 { [0; 3].map(|_| 0.1 * draw()) } else { [1e4 * (x[0] - 0.1045), 0.0, 0.0] };
    }
    figures.add("free cube beside a shaking bar: greatest energy over the first", growth(&run(model)));
}

/// A few thousand cycles of those that gained energy soonest: a factor of 1e3 within 2,000 to 3,500 cycles.
pub(super) fn small_free_bodies_do_not_gain_energy(figures: &mut Figures) {
    for cells in [[1, 1, 1], [1, 1, 3], [2, 2, 2]] {
        of_solids(figures, 5000, cells);
    }
    for cells in [[1, 1], [2, 2]] {
        of_shells(figures, 5000, cells);
        of_shells_of_four_points(figures, 5000, cells);
    }
    of_spin(figures, 8000, 1);
    of_spin(figures, 8000, 2);
    of_another(figures, 5000, 1);
    of_another(figures, 5000, 2);
}

/// A hundred thousand cycles of bodies from one element to 160.
pub(super) fn free_bodies_keep_their_energy_for_a_hundred_thousand_cycles(figures: &mut Figures) {
    const CYCLES: u64 = 100_000;
    for cells in
        [[1, 1, 1], [1, 1, 2], [1, 1, 3], [1, 1, 10], [2, 2, 2], [2, 2, 10], [3, 3, 3], [4, 4, 4], [4, 4, 10]]
    {
        of_solids(figures, CYCLES, cells);
    }
    for cells in [[1, 1], [1, 2], [2, 2], [3, 3], [4, 4]] {
        of_shells(figures, CYCLES, cells);
        of_shells_of_four_points(figures, CYCLES, cells);
    }
    (1..=4).for_each(|n| of_spin(figures, CYCLES, n));
    (1..=2).for_each(|n| of_another(figures, CYCLES, n));
}
