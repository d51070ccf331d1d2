//! Four-node shells: static rows of the obstacle courses by relaxation, tones of a plate, the impulsive panel, and
//! folding tubes.

use std::f64::consts::{FRAC_PI_2, PI};

use deck::Model;
use mechanics::{load::Drive, setup::Constraint};

use crate::{
    case::Sheet,
    checker::pierced,
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
pub(super) fn the_twisted_beam_bends_as_published(sheet: &mut Sheet) {
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
        sheet.add(&format!("twisted beam @ load {name}, deflection"), gone(&solved, 26, axis));
    }
}

/// A quarter of the roof of Scordelis and Lo: radius 25, length 50, 40 degrees to each side, under 90 per area.
pub(super) fn the_roof_sags_as_published(sheet: &mut Sheet) {
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
    sheet.add("obstacle course: roof, free edge", -gone(&solved, 17 * 17, 2));
}

/// An eighth of a cylinder with diaphragms at its ends, pinched by unit forces: radius 300, length 600, thickness 3.
pub(super) fn the_cylinder_is_pinched_as_published(sheet: &mut Sheet) {
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
    sheet.add("obstacle course: pinched cylinder", -gone(&solved, 17, 2));
}

/// A quarter of a hemisphere with a hole of 18 degrees, pulled and pushed by pairs of forces of 2: radius 10, thickness
/// 0.04.
pub(super) fn the_hemisphere_opens_as_published(sheet: &mut Sheet) {
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
    sheet.add("obstacle course: hemisphere with a hole", mean);
}

/// Holds a node along an axis too.
fn hold(model: &mut Model, node: usize, axis: usize) {
    let mut held = model.setup.constraints[usize::from(model.constraint[node])];
    held.velocity[axis] = Some(Drive::constant(0.0));
    model.constraint[node] = model.setup.constraints.len() as u16;
    model.setup.constraints.push(held);
}

/// Square plates of 0.2 m and 2 mm: hinged all round, and clamped all round.
pub(super) fn a_square_plate_rings_at_its_frequencies(sheet: &mut Sheet) {
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
        sheet.add(&format!("square plate @ {name}, frequency (Hz)"), frequency(&solved, 2));
    }
}

/// From the passages of a gauge through where it was.
fn frequency(solved: &Solved, axis: usize) -> f64 {
    let start = solved.model.mesh.positions[solved.model.output.gauges[0].node as usize][axis];
    let path: Vec<(f64, f64)> =
        solved.rows.iter().map(|row| (row.time + row.dt, row.gauges[0].x[axis] - start)).collect();
    let zeros: Vec<f64> = path
        .windows(2)
        .filter(|w| w[0].1 * w[1].1 < 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * w[0].1 / (w[0].1 - w[1].1))
        .collect();
    assert!(zeros.len() >= 4, "{} passages", zeros.len());
    0.5 * (zeros.len() - 1) as f64 / (zeros[zeros.len() - 1] - zeros[0])
}

/// Balmer and Witmer's panel as in the room of structures, of shells with five points. Half of it.
pub(super) fn the_impulsive_panel_of_shells_is_dented_about_as_deep(sheet: &mut Sheet) {
    let (radius, thickness, length) = (2.9375 * INCH, 0.125 * INCH, 12.56 * INCH);
    let material = plastic(2.5e-4 * DENSITY, 10.5e6 * PSI, 0.33, 44_000.0 * PSI);
    let deck = format!(
        "title = \"impulsive panel\"\nunits = \"SI\"\n[control]\nend_time = 600e-6\n\
         [[part]]\nname = \"panel\"\nmaterial = {material}\nshell = {{ thickness = {thickness:e}, points = 5 }}\n\
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
        sheet.add(&format!("impulsive panel of shells @ {name}, deflection (in)"), greatest / INCH);
    }
    sheet.add("impulsive panel of shells: energy error", solved.outcome.ledger.last.error);
}

/// A square tube of 50 by 50 by 2 mm that a wall shortens at 20 m/s by 0.2 m. Two of its sides bulge by half a millimetre over
/// the first fold, the others are dented: without that a perfect tube stretches its corners first.
pub(super) fn a_square_tube_folds_at_its_mean_crush_force(sheet: &mut Sheet) {
    let (side, length, stroke) = (0.05, 0.3, 0.2);
    let deck = format!(
        "title = \"square tube\"\nunits = \"SI\"\n[control]\nend_time = {:e}\n[output]\nhistory_cycles = 100\n\
         [[part]]\nname = \"tube\"\nmaterial = {}\nshell = {{ thickness = 2e-3, points = 5 }}\n\
         prism = {{ axis = \"z\", base = [0, 0, 0], radius = {:e}, length = {length}, sides = 4, cells = [48, 72] }}\n\
         [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nfriction = 0.3\n\
         [[wall]]\npoint = [0, 0, {length}]\nnormal = [0, 0, -1]\nfriction = 0.3\nvelocity = {{ z = -20 }}\n\
         [contact]\ngap_length = 1e-3\nself_interaction = \"all\"\n",
        stroke / 20.0,
        plastic(7830.0, 2.1e11, 0.3, 250e6),
        side * 0.5_f64.sqrt()
    );
    let mut model = model(&deck);
    let (radius, fold) = (side * 0.5_f64.sqrt(), 0.0168);
    for [x, y, z] in &mut model.mesh.positions {
        let below = length - *z;
        if below < fold {
            let sign = (*x * *y).signum();
            let by = 5e-4 * sign * (PI * x.abs() / radius).sin() * (PI * below / fold).sin() * 0.5_f64.sqrt();
            (*x, *y) = (by.mul_add(x.signum(), *x), by.mul_add(y.signum(), *y));
        }
    }
    let solved = run(model);
    let last = solved.rows.last().expect("rows");
    sheet.add("square tube: mean crush force (N)", (last.internal + last.hourglass) / stroke);
    sheet.add("square tube: energy error", last.error);
    sheet.add("square tube: hourglass energy over internal", last.hourglass / last.internal);
    let crossings = pierced(&solved.model.mesh, &solved.state.x);
    sheet.add("square tube: edges through faces", crossings.len() as f64);
}

/// The girder of the examples: it folds on itself, and at no state of the output does a sheet pass through another.
pub(super) fn the_girder_folds_without_passing_through_itself(sheet: &mut Sheet) {
    let solved = run_with_states(example("girder-crush"));
    let worst = solved.states.iter().map(|state| pierced(&solved.model.mesh, &state.x).len()).max();
    sheet.add("girder: edges through faces", worst.expect("states are written") as f64);
    let last = solved.rows.last().expect("rows");
    let rear = solved.model.output.gauges[0].node as usize;
    let shortened = solved.model.mesh.positions[rear][2] - last.gauges[0].x[2];
    sheet.add("girder: mean crush force (N)", (last.internal + last.hourglass) / shortened);
    sheet.add("girder: energy error", last.error);
    sheet.add("girder: hourglass energy over internal", last.hourglass / last.internal);
    sheet.add("girder: deepest contact over the gap", solved.outcome.ledger.worst_penetration);
}
