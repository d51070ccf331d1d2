//! Bodies in three dimensions against published figures: Taylor bars, the sphere of Hertz, a cube on a wall.

use std::f64::consts::PI;

use crate::{
    case::Sheet,
    solve::{Solved, crossing, model, run},
};
use mechanics::state::field;

/// Length on the axis, radius of the foot and greatest plastic strain of a bar along z.
fn shape(solved: &Solved) -> [f64; 3] {
    let on_axis = |n: &usize| solved.model.mesh.positions[*n][..2] == [0.0, 0.0];
    let length =
        (0..solved.model.mesh.n_nodes()).filter(on_axis).map(|n| solved.state.x[n][2]).fold(0.0, f64::max);
    let radius = solved.state.x.iter().map(|x| x[0].hypot(x[1])).fold(0.0, f64::max);
    let strain = solved.state.elements[field::PLASTIC_STRAIN].iter().copied().fold(0.0, f64::max);
    [length, radius, strain]
}

const WALL: &str = "[[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n";
/// What others do: the foot's nodes stay on the wall, so that its rim cannot lift.
const HELD: &str = "[[boundary]]\ntype = \"fixed\"\nparts = [\"bar\"]\nface = \"k-min\"\naxes = \"z\"\n";

/// The copper bar with `[core, ring, length]` cells of a quarter.
fn copper_bar(sheet: &mut Sheet, cells: [u32; 3], foot: &str) {
    let family = if foot == WALL { "taylor copper, free foot" } else { "taylor copper, held foot" };
    let deck = format!(
        "title = \"Taylor bar, copper\"\nunits = \"mm-ms-kg\"\n\
         [control]\nend_time = 0.08\nlinear_viscosity = 0.06\nquadratic_viscosity = 1.2247\nhourglass = 0.03\n\
         [[part]]\nname = \"bar\"\nmaterial = \"COPPER_TAYLOR_BENCHMARK\"\nvelocity = [0, 0, -227]\n\
         cylinder = {{ base = [0, 0, 0], radius = 3.2, length = 32.4, sector = \"quarter\", cells = {cells:?} }}\n\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n{foot}"
    );
    let solved = run(model(&deck));
    let n = solved.model.mesh.n_elements();
    let [length, radius, strain] = shape(&solved);
    let ledger = &solved.outcome.ledger;
    let of = format!("{family} @ {n} elements");
    sheet.add(&format!("{of}, length (mm)"), length);
    sheet.add(&format!("{of}, radius of the foot (mm)"), radius);
    sheet.add(&format!("{of}, greatest plastic strain"), strain);
    sheet.add("taylor copper: energy error", ledger.last.error);
    sheet.add(
        "taylor copper: hourglass energy over kinetic at first",
        ledger.hourglass / ledger.greatest_kinetic,
    );
}

pub(super) fn the_copper_bar_is_as_long_and_its_foot_as_wide_as_others_find(sheet: &mut Sheet) {
    copper_bar(sheet, [3, 3, 36], WALL);
    copper_bar(sheet, [3, 3, 36], HELD);
}

pub(super) fn finer_copper_bars_come_nearer_to_what_others_converge_to(sheet: &mut Sheet) {
    copper_bar(sheet, [6, 6, 72], HELD);
    copper_bar(sheet, [8, 8, 96], HELD);
}

pub(super) fn the_johnson_cook_bar_ends_as_a_code_of_the_same_mesh_finds(sheet: &mut Sheet) {
    let deck = format!(
        "title = \"Taylor bar, OFHC copper\"\nunits = \"mm-ms-kg\"\n\
         [control]\nend_time = 0.09\nlinear_viscosity = 0.06\nquadratic_viscosity = 1.2247\nhourglass = 0.03\n\
         [[part]]\nname = \"bar\"\nmaterial = \"CU_OFHC\"\nvelocity = [0, 0, -190]\n\
         cylinder = {{ base = [0, 0, 0], radius = 3.81, length = 25.4, sector = \"quarter\", cells = [4, 4, 40] }}\n\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n{HELD}"
    );
    let solved = run(model(&deck));
    let [length, radius, strain] = shape(&solved);
    let hottest = solved.state.elements[field::TEMPERATURE].iter().copied().fold(0.0, f64::max);
    sheet.add("taylor OFHC: length (mm)", length);
    sheet.add("taylor OFHC: radius of the foot (mm)", radius);
    sheet.add("taylor OFHC: greatest plastic strain", strain);
    sheet.add("taylor OFHC: highest temperature (K)", hottest);
}

pub(super) fn a_soft_sphere_bounces_off_a_wall_as_hertz_says(sheet: &mut Sheet) {
    // E = 1 GPa, nu = 0.3, 1 m/s, a quarter of the sphere; the wall stands at its pole.
    let deck = "title = \"sphere of Hertz\"\nunits = \"SI\"\n\
        [control]\nend_time = 260e-6\nlinear_viscosity = 0.06\n\
        [output]\nhistory_cycles = 1\n\
        [[part]]\nname = \"sphere\"\nvelocity = [-1, 0, 0]\n\
        material = { density = 1000, eos = { type = \"linear\", bulk = 833333333.3333334 }, \
        strength = { type = \"elastic\", shear = 384615384.6153846 } }\n\
        sphere = { centre = [0, 0, 0], radius = 0.01, sector = \"quarter\", core_fraction = 0.6, cells = [26, 14] }\n\
        [[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"z\"\n\
        [[wall]]\npoint = [-0.01, 0, 0]\nnormal = [1, 0, 0]\n";
    let solved = run(model(deck));
    let mass: f64 = solved.state.mass.iter().sum();
    let momentum: Vec<(f64, f64)> = solved.rows.iter().map(|row| (row.time, 4.0 * row.momentum[0])).collect();
    // Force over some ten cycles, so that single nodes that meet the wall do not show.
    let force = momentum.windows(41).map(|w| (w[40].1 - w[0].1) / (w[40].0 - w[0].0)).fold(0.0, f64::max);
    // Hertz's force is below 1 % of its peak for the first and last 2 % of the contact; the momentum has then left its end
    // values by less than 1e-4. Taking one hundredth of the change at each end costs 11.9 % of the time in all.
    let (first, last) = (momentum[0].1, momentum[momentum.len() - 1].1);
    let at = |part: f64| {
        crossing(momentum.iter().copied(), first + part * (last - first)).expect("the sphere turns round")
    };
    let middle = at(0.75) - at(0.25);
    sheet.add("sphere of Hertz: greatest force (N)", force);
    sheet.add("sphere of Hertz: time of the middle half of the impulse (s)", middle);
    sheet.add("sphere of Hertz: restitution", -last / first);
    sheet.add("sphere of Hertz: mass (kg)", 4.0 * mass);
    assert!((4.0 / 3.0 * PI * 1e-6 * 1000.0 / (4.0 * mass) - 1.0).abs() < 0.01);
}

/// A cube that meets the plane z = 0 at 45 degrees; without Poisson's ratio its foot does not spread, so that all of it
/// slides one way.
fn thrown_at_wall(friction: f64) -> Solved {
    run(model(&format!(
        "title = \"oblique\"\nunits = \"SI\"\n[control]\nend_time = 6e-6\n\
        [[part]]\nname = \"cube\"\nvelocity = [10, 0, -10]\n\
        material = {{ density = 8000, eos = {{ type = \"linear\", bulk = 66.66666666666667e9 }}, \
        strength = {{ type = \"elastic\", shear = 100e9 }} }}\n\
        box = {{ origin = [0, 0, 1e-5], size = [0.01, 0.01, 0.01], cells = [5, 5, 5] }}\n\
        [[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nfriction = {friction:?}\n"
    )))
}

pub(super) fn a_rigid_wall_gives_its_impulse_along_its_normal_and_coulombs_share_beside_it(
    sheet: &mut Sheet,
) {
    for friction in [0.0, 0.05] {
        let solved = thrown_at_wall(friction);
        let mass: f64 = solved.state.mass.iter().sum();
        let v = [0, 1, 2].map(|a| {
            solved.state.v.iter().zip(&solved.state.mass).map(|(v, m)| m * v[a]).sum::<f64>() / mass
        });
        let at = format!("friction {friction:?}");
        assert!(v[2] > 0.0, "it has turned round: {v:?}");
        sheet.add(
            &format!("oblique on a wall @ {at}, tangential over normal impulse"),
            (10.0 - v[0]) / (v[2] + 10.0),
        );
        sheet.add("oblique on a wall: velocity across (m/s)", v[1]);
    }
}
