//! Four-node shells: static rows of the obstacle courses by relaxation, tones of a plate, the impulsive panel, and
//! folding tubes.

use std::f64::consts::{FRAC_PI_2, PI};

use deck::Model;
use mechanics::{constraint::Constraint, load::Drive};

use crate::{
    case::Figures,
    checker::{nearest, pierced},
    solve::{Solved, example, model, run, run_with_states},
};

/// An inch (m), and a pound of force per square inch (Pa).
const INCH: f64 = 0.0254;
const PSI: f64 = 6_894.757_293_168;
/// lbf s2/in4 in kg/m3.
const DENSITY: f64 = PSI / (INCH * INCH);

/// Elastic constants as a deck has them.
fn elastic(density: f64, young: f64, poisson: f64) -> String {
    let (bulk, shear) = (young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson)));
    format!(
        "{{ density = {density:e}, eos = {{ type = \"linear\", bulk = {bulk:e} }}, strength = {{ type = \"elastic\", \
         shear = {shear:e} }} }}"
    )
}

/// Linear-elastic, perfectly plastic.
fn plastic(density: f64, young: f64, poisson: f64, yield_stress: f64) -> String {
    let (bulk, shear) = (young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson)));
    format!(
        "{{ density = {density:e}, eos = {{ type = \"linear\", bulk = {bulk:e} }}, strength = {{ type = \"von-mises\", \
         shear = {shear:e}, yield_stress = {yield_stress:e} }} }}"
    )
}

/// A unit square of shells that comes to rest within `cycles`, if each takes 1 - `factor` of the velocities. Conditions
/// follow as text, then `place` puts the square where it belongs.
fn sheet_of(
    material: &str,
    (thickness, points): (f64, u32),
    cells: [u32; 2],
    (factor, cycles): (f64, u64),
    conditions: &str,
    place: impl Fn(f64, f64) -> [f64; 3],
) -> Model {
    let deck = format!(
        "title = \"sheet\"\nunits = \"SI\"\n[control]\nend_cycle = {cycles}\nend_time = 1e9\n[output]\nhistory_cycles = 1000\n\
         [relaxation]\nfactor = {factor}\n\
         [[part]]\nname = \"sheet\"\nmaterial = {material}\nshell = {{ thickness = {thickness:e}, points = {points} }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [1, 0, 0], side_j = [0, 1, 0], cells = {cells:?} }}\n{conditions}"
    );
    let mut model = model(&deck);
    for x in &mut model.mesh.positions {
        *x = place(x[0], x[1]);
    }
    model
}

/// An edge of the square that is held: translations, then rotations.
fn held(face: &str, axes: &str, rotations: &str) -> String {
    format!(
        "[[boundary]]\ntype = \"fixed\"\nparts = [\"sheet\"]\nface = \"{face}\"\naxes = \"{axes}\"\nrotations = \
         \"{rotations}\"\n"
    )
}

/// A force on nodes, from 1 along i, then along j.
fn pushed(nodes: &[u32], force: [f64; 3]) -> String {
    format!("[[load]]\ntype = \"force\"\nnodes = {nodes:?}\nforce = {force:?}\n")
}

/// How far a node has gone along an axis.
fn gone(solved: &Solved, node: u32, axis: usize) -> f64 {
    let node = node as usize - 1;
    solved.state.x[node][axis] - solved.model.mesh.positions[node][axis]
}

/// MacNeal and Harder's twisted beam: 12 by 1.1 by 0.32, turned by 90 degrees over its length.
pub(super) fn the_twisted_beam_bends_as_published(figures: &mut Figures) {
    for (axis, name) in [(2, "in plane"), (1, "out of plane")] {
        let mut conditions = held("i-min", "xyz", "xyz");
        for (j, share) in [(0, 0.25), (1, 0.5), (2, 0.25)] {
            let mut force = [0.0; 3];
            force[axis] = share;
            conditions += &pushed(&[13 * (j + 1)], force);
        }
        let solved = run(sheet_of(
            &elastic(2.5e-4, 29e6, 0.22),
            (0.32, 5),
            [12, 2],
            (0.999, 30_000),
            &conditions,
            |s, t| {
                let (sin, cos) = (s * FRAC_PI_2).sin_cos();
                [12.0 * s, 1.1 * (t - 0.5) * cos, 1.1 * (t - 0.5) * sin]
            },
        ));
        figures.add(&format!("twisted beam @ load {name}, deflection"), gone(&solved, 26, axis));
    }
}

/// A quarter of the roof of Scordelis and Lo: radius 25, length 50, 40 degrees to each side, under 90 per area.
pub(super) fn the_roof_sags_as_published(figures: &mut Figures) {
    // I along the axis from the diaphragm to the middle, J from the crown to the free edge.
    let conditions = held("i-min", "xz", "")
        + &held("i-max", "y", "xz")
        + &held("j-min", "x", "yz")
        + "[gravity]\nacceleration = [0, 0, -1]\n";
    let solved = run(sheet_of(
        &elastic(90.0 / 0.25, 4.32e8, 0.0),
        (0.25, 2),
        [16, 16],
        (0.997, 20_000),
        &conditions,
        |s, t| {
            let angle = 40.0_f64.to_radians() * t;
            [25.0 * angle.sin(), 25.0 * s, 25.0 * angle.cos()]
        },
    ));
    figures.add("obstacle course: roof, free edge", -gone(&solved, 17 * 17, 2));
}

/// An eighth of a cylinder with diaphragms at its ends, pinched by unit forces: radius 300, length 600, thickness 3.
pub(super) fn the_cylinder_is_pinched_as_published(figures: &mut Figures) {
    let conditions = held("i-min", "xz", "")
        + &held("i-max", "y", "xz")
        + &held("j-min", "x", "yz")
        + &held("j-max", "z", "xy")
        + &pushed(&[17], [0.0, 0.0, -0.25]);
    let solved =
        run(sheet_of(&elastic(1e-3, 3e6, 0.3), (3.0, 2), [16, 16], (0.998, 30_000), &conditions, |s, t| {
            let angle = FRAC_PI_2 * t;
            [300.0 * angle.sin(), 300.0 * s, 300.0 * angle.cos()]
        }));
    figures.add("obstacle course: pinched cylinder", -gone(&solved, 17, 2));
}

/// A quarter of a hemisphere with a hole of 18 degrees, pulled and pushed by pairs of forces of 2: radius 10, thickness
/// 0.04.
pub(super) fn the_hemisphere_opens_as_published(figures: &mut Figures) {
    // I along the equator from x to y, J up to the hole.
    let conditions = held("i-min", "y", "xz")
        + &held("i-max", "x", "yz")
        + &pushed(&[1], [1.0, 0.0, 0.0])
        + &pushed(&[17], [0.0, -1.0, 0.0]);
    let mut model =
        sheet_of(&elastic(1.0, 6.825e7, 0.3), (0.04, 2), [16, 16], (0.9999, 200_000), &conditions, |s, t| {
            let (around, up) = (FRAC_PI_2 * s, 72.0_f64.to_radians() * t);
            [10.0 * up.cos() * around.cos(), 10.0 * up.cos() * around.sin(), 10.0 * up.sin()]
        });
    // Nothing else keeps it from rising: the hole's edge stands in the middle of the arc.
    let held = model.mesh.n_nodes() - 9;
    hold(&mut model, held, 2);
    let solved = run(model);
    let mean = 0.5 * (gone(&solved, 1, 0) - gone(&solved, 17, 1));
    figures.add("obstacle course: hemisphere with a hole", mean);
}

/// A cantilever of 0.2 by 0.01 m, thick as wide, under 100 N at its tip.
pub(super) fn a_cantilever_of_shells_bends_as_a_beam(figures: &mut Figures) {
    let mut conditions = held("i-min", "xyz", "xyz");
    for (j, share) in [(0, 0.25), (1, 0.5), (2, 0.25)] {
        conditions += &pushed(&[41 * (j + 1)], [0.0, 0.0, 100.0 * share]);
    }
    let solved = run(sheet_of(
        &elastic(8000.0, 2e11, 0.3),
        (0.01, 2),
        [40, 2],
        (0.998, 20_000),
        &conditions,
        |s, t| [0.2 * s, 0.01 * t, 0.0],
    ));
    figures.add("cantilever of shells: deflection of its tip", gone(&solved, 82, 2));
}

/// The same, whose thickness falls by steps of its elements from 12 mm at the support to 4 mm at the tip.
pub(super) fn a_tapered_cantilever_of_shells_bends_as_a_beam(figures: &mut Figures) {
    const CELLS: usize = 40;
    let thickness = |i: usize| 0.012 - 0.008 * (i as f64 + 0.5) / CELLS as f64;
    let mut nodes = String::new();
    for j in 0..3 {
        for i in 0..=CELLS {
            let (x, y) = (0.2 * i as f64 / CELLS as f64, 0.005 * f64::from(j));
            nodes += &format!("[{}, {x:?}, {y:?}, 0], ", j as usize * (CELLS + 1) + i + 1);
        }
    }
    let mut elements = String::new();
    for e in 0..2 * CELLS {
        let a = e / CELLS * (CELLS + 1) + e % CELLS + 1;
        let [b, c, d] = [a + 1, a + CELLS + 2, a + CELLS + 1];
        elements += &format!("[{}, {a}, {b}, {c}, {d}, {:?}], ", e + 1, thickness(e % CELLS));
    }
    let mut deck = format!(
        "title = \"tapered\"\nunits = \"SI\"\n[control]\nend_cycle = 20000\nend_time = 1e9\n[output]\nhistory_cycles = 1000\n\
         [relaxation]\nfactor = 0.998\n\
         [[part]]\nname = \"sheet\"\nmaterial = {}\nshell = {{ thickness = 0.01, points = 2 }}\n\
         mesh = {{ nodes = [{nodes}], elements = [{elements}] }}\n\
         [[boundary]]\ntype = \"fixed\"\nnodes = [1, 42, 83]\nrotations = \"xyz\"\n",
        elastic(8000.0, 2e11, 0.3)
    );
    for (j, share) in [(0, 0.25), (1, 0.5), (2, 0.25)] {
        deck += &pushed(&[41 * (j + 1)], [0.0, 0.0, 20.0 * share]);
    }
    let solved = run(model(&deck));
    figures.add("tapered cantilever of shells: deflection of its tip (m)", gone(&solved, 82, 2));
    figures.add("tapered cantilever of shells: mass (kg)", solved.state.mass.iter().sum());
}

pub(super) fn a_square_plate_sags_under_pressure(figures: &mut Figures) {
    figures.add("square plate: deflection under 1000 Pa", sag_of_plate(16));
}

/// How deep (m) a hinged square plate of 0.2 m and 2 mm sags under 1000 Pa, given as acceleration; a quarter of it has `n` by `n` cells.
pub(super) fn sag_of_plate(n: u32) -> f64 {
    let conditions = held("i-min", "z", "x")
        + &held("j-min", "z", "y")
        + &held("i-max", "x", "yz")
        + &held("j-max", "y", "xz")
        + "[gravity]\nacceleration = [0, 0, -62.5]\n";
    let solved = run(sheet_of(
        &elastic(8000.0, 2e11, 0.3),
        (2e-3, 2),
        [n, n],
        (0.998, 20_000),
        &conditions,
        |s, t| [0.1 * s, 0.1 * t, 0.0],
    ));
    -gone(&solved, (n + 1) * (n + 1), 2)
}

/// A strip of 0.2 by 0.01 m, 2 mm thick, clamped at one end.
pub(super) fn a_strip_of_shells_rings_as_a_beam(figures: &mut Figures) {
    let deck = format!(
        "title = \"strip\"\nunits = \"SI\"\n[control]\nend_time = 0.062\n[output]\nhistory_cycles = 5\n\
         [[part]]\nname = \"strip\"\nmaterial = {}\nshell = {{ thickness = 2e-3, points = 2 }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [0.2, 0, 0], side_j = [0, 0.01, 0], cells = [40, 2] }}\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"strip\"]\nface = \"i-min\"\nrotations = \"xyz\"\n\
         [[gauge]]\nname = \"tip\"\npoint = [0.2, 0.005, 0]\n",
        elastic(8000.0, 2e11, 0.3)
    );
    let mut model = model(&deck);
    model.spin = vec![[0.0; 3]; model.mesh.n_nodes()];
    for (n, x) in model.mesh.positions.iter().enumerate() {
        let s = x[0] / 0.2;
        // About the first mode: w = s^2 (6 - 4 s + s^2) / 3, and its slope.
        let slope = (12.0 * s - 12.0 * s * s + 4.0 * s * s * s) / 3.0 / 0.2;
        model.velocity[n][2] = 1e-3 * s * s * (6.0 - 4.0 * s + s * s) / 3.0;
        model.spin[n] = [0.0, -1e-3 * slope, 0.0];
    }
    figures.add("strip of shells: frequency (Hz)", frequency(&run(model), 2));
}

/// Holds a node along an axis too.
fn hold(model: &mut Model, node: usize, axis: usize) {
    let mut held = model.setup.constraints[usize::from(model.constraint[node])];
    held.velocity[axis] = Some(Drive::constant(0.0));
    model.constraint[node] = model.setup.constraints.len() as u16;
    model.setup.constraints.push(held);
}

/// Square plates of 0.2 m and 2 mm: hinged all round, and clamped all round.
pub(super) fn a_square_plate_rings_at_its_frequencies(figures: &mut Figures) {
    for (name, rotations) in [("hinged", ""), ("clamped", "xyz")] {
        let edges: String = ["i-min", "i-max", "j-min", "j-max"]
            .iter()
            .map(|face| {
                format!(
                    "[[boundary]]\ntype = \"fixed\"\nparts = [\"plate\"]\nface = \"{face}\"\nrotations = \"{rotations}\"\n"
                )
            })
            .collect();
        let deck = format!(
            "title = \"plate\"\nunits = \"SI\"\n[control]\nend_time = 0.013\n[output]\nhistory_cycles = 5\n\
             [[part]]\nname = \"plate\"\nmaterial = {}\nshell = {{ thickness = 2e-3, points = 2 }}\n\
             plate = {{ origin = [0, 0, 0], side_i = [0.2, 0, 0], side_j = [0, 0.2, 0], cells = [24, 24] }}\n{edges}\
             [[gauge]]\nname = \"middle\"\npoint = [0.1, 0.1, 0]\n",
            elastic(8000.0, 2e11, 0.3)
        );
        let mut model = model(&deck);
        let power = if rotations.is_empty() { 1 } else { 2 };
        model.spin = vec![[0.0; 3]; model.mesh.n_nodes()];
        for n in 0..model.mesh.n_nodes() {
            let [x, y, _] = model.mesh.positions[n];
            let shape = |c: f64| (PI * c / 0.2).sin().powi(power);
            let slope = |c: f64| {
                let (sin, cos) = (PI * c / 0.2).sin_cos();
                f64::from(power) * sin.powi(power - 1) * cos * PI / 0.2
            };
            model.velocity[n][2] = 1e-3 * shape(x) * shape(y);
            model.spin[n] = [1e-3 * shape(x) * slope(y), -1e-3 * slope(x) * shape(y), 0.0];
        }
        let solved = run(model);
        figures.add(&format!("square plate @ {name}, frequency (Hz)"), frequency(&solved, 2));
    }
}

/// From the passages of a gauge through where it was.
fn frequency(solved: &Solved, axis: usize) -> f64 {
    let start = solved.model.mesh.positions[solved.model.output.gauges[0].node as usize][axis];
    let path: Vec<(f64, f64)> =
        solved.rows.iter().map(|row| (row.time, row.gauges[0].x[axis] - start)).collect();
    let zeros: Vec<f64> = path
        .windows(2)
        .filter(|w| w[0].1 * w[1].1 < 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * w[0].1 / (w[0].1 - w[1].1))
        .collect();
    assert!(zeros.len() >= 4, "{} passages", zeros.len());
    0.5 * (zeros.len() - 1) as f64 / (zeros[zeros.len() - 1] - zeros[0])
}

/// Balmer and Witmer's panel as in the room of structures, of shells with five points through the thickness. Half of it.
pub(super) fn the_impulsive_panel_of_shells_is_dented_about_as_deep(figures: &mut Figures) {
    impulsive_panel(figures, "impulsive panel of shells", 1);
    impulsive_panel(figures, "impulsive panel of shells of four points", 4);
}

/// The panel with so many points in the plane.
fn impulsive_panel(figures: &mut Figures, family: &str, in_plane: u32) {
    let (radius, thickness, length) = (2.9375 * INCH, 0.125 * INCH, 12.56 * INCH);
    let material = plastic(2.5e-4 * DENSITY, 10.5e6 * PSI, 0.33, 44_000.0 * PSI);
    let deck = format!(
        "title = \"impulsive panel\"\nunits = \"SI\"\n[control]\nend_time = 600e-6\n\
         [[part]]\nname = \"panel\"\nmaterial = {material}\n\
         shell = {{ thickness = {thickness:e}, points = 5, in_plane = {in_plane} }}\n\
         plate = {{ origin = [0, 0, 0], side_i = [1, 0, 0], side_j = [0, 1, 0], cells = [16, 32] }}\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"panel\"]\nface = \"i-min\"\nrotations = \"xyz\"\n\
         [[boundary]]\ntype = \"fixed\"\nparts = [\"panel\"]\nface = \"i-max\"\naxes = \"x\"\nrotations = \"yz\"\n\
         [[gauge]]\nname = \"middle\"\npoint = [1, 0.5, 0]\n[[gauge]]\nname = \"three quarters\"\npoint = [1, 0.75, 0]\n"
    );
    let mut model = model(&deck);
    let zero = Some(Drive::constant(0.0));
    for n in 0..model.mesh.n_nodes() {
        let [s, t, _] = model.mesh.positions[n];
        // From the clamped straight edge at -60 degrees to the crown.
        let angle = (s - 1.0) * 60.0_f64.to_radians();
        let z = t * length;
        model.mesh.positions[n] = [radius * angle.sin(), radius * angle.cos(), z];
        if (t == 0.0 || t == 1.0) && s > 0.0 {
            let clamped = model.setup.constraints[usize::from(model.constraint[n])].clamped;
            model.constraint[n] = model.setup.constraints.len() as u16;
            let velocity = [zero, zero, None];
            model.setup.constraints.push(Constraint { velocity, clamped, ..Constraint::default() });
        } else if angle >= -30.0_f64.to_radians() - 1e-9 && z <= 10.205 * INCH && s > 0.0 {
            let speed = 5650.0 * INCH;
            let along = if s == 1.0 { 0.0 } else { -speed * angle.sin() };
            model.velocity[n] = [along, -speed * angle.cos(), 0.0];
        }
    }
    let solved = run(model);
    for (gauge, name) in [(0, "half way"), (1, "at three quarters")] {
        let start = solved.model.mesh.positions[solved.model.output.gauges[gauge].node as usize][1];
        let greatest = solved.rows.iter().map(|row| start - row.gauges[gauge].x[1]).fold(0.0, f64::max);
        figures.add(&format!("{family} @ {name}, deflection (in)"), greatest / INCH);
    }
    figures.add(&format!("{family} @ energy error"), solved.outcome.run_totals.last.error);
}

/// A tube of shells that a wall shortens at a speed.
struct Tube {
    sides: u32,
    /// Of one side (m).
    width: f64,
    thickness: f64,
    yield_stress: f64,
    /// Whether its yield stress rises with the rate after Cowper and Symonds, 6844 /s and 3.91.
    rate: bool,
    /// Half the length of a fold (m).
    fold: f64,
    speed: f64,
    /// Length and how much of it goes, in widths, and elements along it.
    widths: [f64; 2],
    along: u32,
    meets_itself: bool,
    /// Of the wall, which it then slows down (kg); without, the wall keeps its speed.
    mass: Option<f64>,
}

impl Tube {
    /// Shortens it by a wall that keeps its speed; returns by how much too.
    fn crush(&self) -> (Solved, f64) {
        let (mut model, stroke) = (self.model(), self.widths[1] * self.width);
        model.output.period = Some(0.05 * stroke / self.speed);
        (run_with_states(model), stroke)
    }

    /// Every other side bulges by a hundredth of its width over the first fold, the others are dented: without that a
    /// perfect tube stretches its corners first. Edges meet edges, as folds cross far from all nodes.
    fn model(&self) -> Model {
        let [length, stroke] = self.widths.map(|widths| widths * self.width);
        let around = self.sides;
        let radius = 0.5 * self.width / (PI / f64::from(around)).sin();
        let mut material = plastic(7830.0, 2.1e11, 0.3, self.yield_stress);
        if self.rate {
            let end = material.len() - 3;
            material.insert_str(end, ", cowper_symonds = { reference = 6844, exponent = 3.91 }");
        }
        let contact = if self.meets_itself {
            let gap = 0.5 * self.thickness;
            format!("[contact]\ngap_length = {gap:e}\nself_interaction = \"all\"\nedges = true\n")
        } else {
            String::new()
        };
        let mass = self.mass.map_or(String::new(), |mass| format!("mass = {mass:e}\n"));
        let deck = format!(
            "title = \"tube\"\nunits = \"SI\"\n[control]\nend_time = {:e}\n[output]\nhistory_cycles = 100\nperiod = 1e-4\n\
             [[part]]\nname = \"tube\"\nmaterial = {material}\nshell = {{ thickness = {:e}, points = 5 }}\n\
             prism = {{ axis = \"z\", base = [0, 0, 0], radius = {radius:e}, length = {length:?}, sides = {around}, \
             cells = [{}, {}] }}\n\
             [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nfriction = 0.3\n\
             [[wall]]\npoint = [0, 0, {length:?}]\nnormal = [0, 0, -1]\nfriction = 0.3\nvelocity = {{ z = {:?} }}\n\
             {mass}{}",
            stroke / self.speed,
            self.thickness,
            12 * around,
            self.along,
            -self.speed,
            contact
        );
        let mut model = model(&deck);
        // Sides are even and odd from the corner on the axis x on.
        let sector = 2.0 * PI / f64::from(around);
        for [x, y, z] in &mut model.mesh.positions {
            let below = length - *z;
            if below < self.fold {
                let turns = y.atan2(*x).rem_euclid(2.0 * PI) / sector;
                let (side, along) = ((turns + 1e-9).floor(), (turns + 1e-9).fract());
                let sign = if (side as u32).is_multiple_of(2) { 1.0 } else { -1.0 };
                let outward = (side + 0.5) * sector;
                let by = 0.01 * self.width * sign * (PI * along).sin() * (PI * below / self.fold).sin();
                (*x, *y) = (by.mul_add(outward.cos(), *x), by.mul_add(outward.sin(), *y));
            }
        }
        model
    }
}

/// The tube of 50 by 50 by 2 mm of 250 MPa.
const SQUARE: Tube = Tube {
    sides: 4,
    width: 0.05,
    thickness: 2e-3,
    yield_stress: 250e6,
    rate: false,
    fold: 0.0168,
    speed: 20.0,
    widths: [6.0, 4.0],
    along: 72,
    meets_itself: true,
    mass: None,
};

/// The smallest distance of shells that share no node, in gaps, over all states; 4 where there is none so small.
fn closest(solved: &Solved, gap: f64) -> f64 {
    let all = solved.states.iter().map(|state| nearest(&solved.model.mesh, &state.x, 4.0 * gap));
    all.fold(4.0 * gap, f64::min) / gap
}

pub(super) fn a_square_tube_folds_at_its_mean_crush_force(figures: &mut Figures) {
    let (solved, stroke) = SQUARE.crush();
    let last = solved.rows.last().expect("rows");
    figures.add("square tube: mean crush force (N)", (last.internal + last.hourglass) / stroke);
    figures.add("square tube: energy error", last.error);
    figures.add("square tube: hourglass energy over internal", last.hourglass / last.internal);
    let crossings = pierced(&solved.model.mesh, &solved.state.x);
    figures.add("square tube: edges through faces", crossings.len() as f64);
    figures.add("square tube: smallest distance of sheets that share no node (gaps)", closest(&solved, 1e-3));
    figures.add("square tube: deepest contact (gaps)", solved.outcome.run_totals.worst_penetration);
    // What the same tube does that does not feel itself.
    let (solved, stroke) = Tube { meets_itself: false, ..SQUARE }.crush();
    let through = solved.rows.last().expect("rows");
    let crossings = pierced(&solved.model.mesh, &solved.state.x);
    figures.add("square tube without contact: edges through faces", crossings.len() as f64);
    let of = "square tube without contact: smallest distance of sheets that share no node (gaps)";
    figures.add(of, closest(&solved, 1e-3));
    figures.add(
        "square tube without contact: crush force over that with it",
        (through.internal + through.hourglass) / stroke / ((last.internal + last.hourglass) / stroke),
    );
}

/// The same tubes shorter, for three folds or so.
const SHORT: Tube = Tube { widths: [4.0, 2.0], along: 48, ..SQUARE };

/// Figures of a tube of the table.
fn crushed(figures: &mut Figures, name: &str, tube: &Tube) {
    let (solved, stroke) = tube.crush();
    let last = solved.rows.last().expect("rows");
    figures.add(&format!("tube @ {name}, mean crush force (N)"), (last.internal + last.hourglass) / stroke);
    let crossings = pierced(&solved.model.mesh, &solved.state.x);
    figures.add("tubes: edges through faces", crossings.len() as f64);
    let of = "tubes: smallest distance of sheets that share no node (gaps)";
    figures.add(of, closest(&solved, 0.5 * tube.thickness));
}

pub(super) fn a_tube_that_feels_the_rate_folds_at_a_greater_force(figures: &mut Figures) {
    crushed(figures, "50 by 2 mm of 250 MPa at 20 m/s", &Tube { rate: true, ..SHORT });
}

/// The tube that feels the rate and a wall of 100 kg, for as long as that would take over its whole length: at no state of
/// the output does a sheet pass through another.
pub(super) fn a_tube_that_is_crushed_to_a_block_passes_nowhere_through_itself(figures: &mut Figures) {
    let tube = Tube { rate: true, widths: [4.0, 4.0], mass: Some(100.0), ..SHORT };
    let solved = run_with_states(tube.model());
    let mesh = &solved.model.mesh;
    let worst = solved.states.iter().map(|state| pierced(mesh, &state.x).len()).max();
    figures.add("tube crushed to a block: edges through faces", worst.expect("states are written") as f64);
    let height = solved.state.x.iter().map(|x| x[2]).fold(0.0, f64::max);
    figures.add("tube crushed to a block: height left over length", height / (tube.widths[0] * tube.width));
    figures.add("tube crushed to a block: energy error", solved.rows.last().expect("rows").error);
    figures
        .add("tube crushed to a block: deepest contact (gaps)", solved.outcome.run_totals.worst_penetration);
}

pub(super) fn a_hexagonal_tube_folds_at_its_mean_crush_force(figures: &mut Figures) {
    crushed(figures, "hexagon, 50 by 2 mm of 250 MPa, no rate", &Tube { sides: 6, ..SHORT });
}

/// A tube of Abramowicz and Jones: half the length of its folds is theirs.
fn tested(width: f64, thickness: f64) -> Tube {
    let fold = 0.983 * (width * width * thickness).cbrt();
    Tube { rate: true, width, thickness, fold, yield_stress: 310e6, speed: 10.0, ..SHORT }
}

pub(super) fn a_thin_tube_that_was_tested_folds_at_its_mean_crush_force(figures: &mut Figures) {
    crushed(figures, "37.07 by 1.152 mm of 310 MPa at 10 m/s", &tested(0.03707, 1.152e-3));
}

pub(super) fn a_wide_tube_that_was_tested_folds_at_its_mean_crush_force(figures: &mut Figures) {
    crushed(figures, "49.31 by 1.63 mm of 310 MPa at 10 m/s", &tested(0.04931, 1.63e-3));
}

/// The girder of the examples: it folds on itself, and at no state of the output does a sheet pass through another.
pub(super) fn the_girder_folds_without_passing_through_itself(figures: &mut Figures) {
    let solved = run_with_states(example("girder-crush"));
    let worst = solved.states.iter().map(|state| pierced(&solved.model.mesh, &state.x).len()).max();
    figures.add("girder: edges through faces", worst.expect("states are written") as f64);
    figures.add("girder: smallest distance of sheets that share no node (gaps)", closest(&solved, 1e-3));
    let last = solved.rows.last().expect("rows");
    let rear = solved.model.output.gauges[0].node as usize;
    let shortened = solved.model.mesh.positions[rear][2] - last.gauges[0].x[2];
    figures.add("girder: mean crush force (N)", (last.internal + last.hourglass) / shortened);
    figures.add("girder: energy error", last.error);
    figures.add("girder: hourglass energy over internal", last.hourglass / last.internal);
    figures.add("girder: deepest contact over the gap", solved.outcome.run_totals.worst_penetration);
}
