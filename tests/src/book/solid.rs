//! Bodies in three dimensions against published figures: Taylor bars, the sphere of Hertz, a cube on a wall.

use std::f64::consts::PI;

use crate::{
    case::Figures,
    solve::{Solved, crossing, model, run},
    tetrahedra::cut,
};
use deck::Model;
use mechanics::{mesh::Topology, state::field};

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

/// The copper bar with `[core, ring, length]` cells of a quarter, at its end.
fn struck_copper_bar(cells: [u32; 3], foot: &str) -> Solved {
    run(copper_bar_deck(cells, foot))
}

fn copper_bar_deck(cells: [u32; 3], foot: &str) -> Model {
    model(&format!(
        "title = \"Taylor bar, copper\"\nunits = \"mm-ms-kg\"\n\
         [control]\nend_time = 0.08\nlinear_viscosity = 0.06\nquadratic_viscosity = 1.2247\nhourglass = 0.03\n\
         [[part]]\nname = \"bar\"\nmaterial = \"COPPER_TAYLOR_BENCHMARK\"\nvelocity = [0, 0, -227]\n\
         cylinder = {{ base = [0, 0, 0], radius = 3.2, length = 32.4, sector = \"quarter\", cells = {cells:?} }}\n\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"x\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n{foot}"
    ))
}

/// The bar of composite tetrahedra whose nodes are as far apart as those of the hexahedra it is compared with.
pub(super) fn the_copper_bar_of_tetrahedra_ends_as_that_of_hexahedra_of_their_spacing(figures: &mut Figures) {
    let hexahedra = shape(&struck_copper_bar([4, 4, 36], HELD));
    let solved = run(cut(copper_bar_deck([2, 2, 18], HELD), |_| true));
    let tetrahedra = shape(&solved);
    for (name, i) in [("length", 0), ("radius of the foot", 1)] {
        let figure = format!("taylor copper, tetrahedra over hexahedra @ {name}");
        figures.add(&figure, tetrahedra[i] / hexahedra[i]);
    }
    figures.add("taylor copper, tetrahedra: length (mm)", tetrahedra[0]);
    figures.add("taylor copper: energy error", solved.outcome.run_totals.last.error);
}

/// Length (mm) of the copper bar with `n` by `n` cells in its core.
pub(super) fn length_of_copper_bar(n: u32) -> f64 {
    shape(&struck_copper_bar([n, n, 12 * n], HELD))[0]
}

fn copper_bar(figures: &mut Figures, cells: [u32; 3], foot: &str) {
    let family = if foot == WALL { "taylor copper, free foot" } else { "taylor copper, held foot" };
    let solved = struck_copper_bar(cells, foot);
    let n = solved.model.mesh.n_elements();
    let [length, radius, strain] = shape(&solved);
    let run_totals = &solved.outcome.run_totals;
    let of = format!("{family} @ {n} elements");
    figures.add(&format!("{of}, length (mm)"), length);
    figures.add(&format!("{of}, radius of the foot (mm)"), radius);
    figures.add(&format!("{of}, greatest plastic strain"), strain);
    figures.add("taylor copper: energy error", run_totals.last.error);
    figures.add(
        "taylor copper: hourglass energy over kinetic at first",
        run_totals.hourglass / run_totals.greatest_kinetic,
    );
}

pub(super) fn the_copper_bar_is_as_long_and_its_foot_as_wide_as_others_find(figures: &mut Figures) {
    copper_bar(figures, [3, 3, 36], WALL);
    copper_bar(figures, [3, 3, 36], HELD);
}

pub(super) fn finer_copper_bars_come_nearer_to_what_others_converge_to(figures: &mut Figures) {
    copper_bar(figures, [6, 6, 72], HELD);
    copper_bar(figures, [8, 8, 96], HELD);
}

pub(super) fn the_johnson_cook_bar_ends_as_a_code_of_the_same_mesh_finds(figures: &mut Figures) {
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
    figures.add("taylor OFHC: length (mm)", length);
    figures.add("taylor OFHC: radius of the foot (mm)", radius);
    figures.add("taylor OFHC: greatest plastic strain", strain);
    figures.add("taylor OFHC: highest temperature (K)", hottest);
}

pub(super) fn a_soft_sphere_bounces_off_a_wall_as_hertz_says(figures: &mut Figures) {
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
    figures.add("sphere of Hertz: greatest force (N)", force);
    figures.add("sphere of Hertz: time of the middle half of the impulse (s)", middle);
    figures.add("sphere of Hertz: restitution", -last / first);
    figures.add("sphere of Hertz: mass (kg)", 4.0 * mass);
    assert!((4.0 / 3.0 * PI * 1e-6 * 1000.0 / (4.0 * mass) - 1.0).abs() < 0.01);
}

/// A quarter of a steel sphere of 10 mm about the origin, whose cells are `finer` times smaller at its pole at negative x
/// and as much larger at the other one: a ball goes into itself by an inversion that keeps angles, so cells keep their
/// shapes.
const STEEL_SPHERE: &str = "material = { density = 7850, eos = { type = \"linear\", bulk = 175e9 }, strength = \
    { type = \"elastic\", shear = 80.76923076923077e9 } }\n\
    sphere = { centre = [0, 0, 0], radius = 0.01, sector = \"quarter\", cells = ";

fn refine_pole(x: &mut [f64; 3], finer: f64) {
    let (a, r) = ((finer - 1.0) / (finer + 1.0), 0.01);
    let [x0, y, z] = x.map(|c| c / r);
    let (square, along) = (x0 * x0 + y * y + z * z, x0);
    let beside = along - a;
    let from_a = square - 2.0 * a * along + a * a;
    let scale = 1.0 + square * a * a - 2.0 * a * along;
    let own = 1.0 - a * a;
    *x = [own * beside - from_a * a, own * y, own * z].map(|c| r * c / scale);
}

/// The figures of an impact of spheres from the momentum by time that it changes.
fn bounce(figures: &mut Figures, of: &str, momentum: &[(f64, f64)]) {
    // As for the soft sphere: force over some cycles, and the time of the middle half of the impulse.
    let force = momentum.windows(41).map(|w| (w[40].1 - w[0].1) / (w[40].0 - w[0].0)).fold(0.0, f64::max);
    let (first, last) = (momentum[0].1, momentum[momentum.len() - 1].1);
    let at = |part: f64| {
        crossing(momentum.iter().copied(), first + part * (last - first)).expect("the sphere turns round")
    };
    figures.add(&format!("{of}, greatest force (N)"), force);
    figures.add(&format!("{of}, time of the middle half of the impulse (s)"), at(0.75) - at(0.25));
    figures.add(&format!("{of}, restitution"), -last / first);
}

pub(super) fn steel_spheres_bounce_off_a_wall_as_hertz_says(figures: &mut Figures) {
    for (speed, cells, finer, end) in
        [(0.1, [14, 8], 8.0, 100e-6), (1.0, [18, 10], 4.0, 64e-6), (10.0, [18, 10], 2.0, 42e-6)]
    {
        let mut model = model(&format!(
            "title = \"steel sphere\"\nunits = \"SI\"\n[control]\nend_time = {end:e}\nlinear_viscosity = 0.06\n\
             [output]\nhistory_cycles = 1\n[[part]]\nname = \"sphere\"\nvelocity = [{:?}, 0, 0]\n{STEEL_SPHERE}{cells:?} }}\n\
             [[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"z\"\n\
             [[wall]]\npoint = [-0.01, 0, 0]\nnormal = [1, 0, 0]\n",
            -speed
        ));
        model.mesh.positions.iter_mut().for_each(|x| refine_pole(x, finer));
        let solved = run(model);
        let momentum: Vec<(f64, f64)> =
            solved.rows.iter().map(|row| (row.time, 4.0 * row.momentum[0])).collect();
        bounce(figures, &format!("steel sphere on a wall @ {speed:?} m/s"), &momentum);
    }
}

/// Two of them, each at half of 1 m/s; half a gap of contact lies on either side of the middle.
pub(super) fn two_steel_spheres_bounce_off_each_other_as_hertz_says(figures: &mut Figures) {
    let (cells, finer) = ([14, 8], 5.0);
    let gap = 1e-5;
    let sphere = |name: &str, speed: f64, at: f64| {
        format!(
            "[[part]]\nname = \"{name}\"\nvelocity = [{speed:?}, 0, 0]\n{STEEL_SPHERE}{cells:?} }}\ntranslate = [{at:?}, 0, 0]\n"
        )
    };
    let mut model = model(&format!(
        "title = \"steel spheres\"\nunits = \"SI\"\n[control]\nend_time = 74e-6\nlinear_viscosity = 0.06\n\
         [output]\nhistory_cycles = 1\ncontact_forces = [[\"right\", \"left\"]]\n[contact]\nstiffness = 1\n{}{}\
         [[boundary]]\ntype = \"symmetry\"\naxis = \"y\"\n[[boundary]]\ntype = \"symmetry\"\naxis = \"z\"\n",
        sphere("right", -0.5, 0.0),
        sphere("left", 0.5, -0.03)
    ));
    let right = model.mesh.parts[0].nodes.len();
    assert!(model.mesh.parts[0].nodes.iter().all(|n| (*n as usize) < right), "nodes are numbered by parts");
    for (n, x) in model.mesh.positions.iter_mut().enumerate() {
        if n >= right {
            x[0] += 0.03;
        }
        refine_pole(x, finer);
        x[0] += 0.01 + 0.5 * gap;
        if n >= right {
            x[0] = -x[0];
        }
    }
    mirror(&mut model, 1);
    // A tenth of the faces at the poles, which the deck does not know.
    let contact = model.setup.contact.as_mut().expect("spheres that meet");
    (contact.gap, contact.slack) = (gap, 0.5 * gap);
    let solved = run(model);
    let mass: f64 = solved.state.mass[..right].iter().sum();
    let mut now = -0.5 * 4.0 * mass;
    let momentum: Vec<(f64, f64)> = solved
        .rows
        .iter()
        .map(|row| {
            now += row.contacts.first().map_or(0.0, |(_, pair)| 4.0 * pair.force[0] * row.dt);
            (row.time, now)
        })
        .collect();
    bounce(figures, "two steel spheres @ closing at 1.0 m/s", &momentum);
    figures.add(
        "two steel spheres: greatest depth of contact (gaps)",
        solved.outcome.run_totals.worst_penetration,
    );
}

/// Puts the corners of a part that was reflected in an order that has a positive volume.
fn mirror(model: &mut Model, part: usize) {
    let Topology::Explicit { hexahedra } = &mut model.mesh.parts[part].topology else {
        panic!("spheres list their corners");
    };
    for [a, b, c, d, e, f, g, h] in hexahedra.iter_mut() {
        (*a, *b, *c, *d, *e, *f, *g, *h) = (*e, *f, *g, *h, *a, *b, *c, *d);
    }
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
    figures: &mut Figures,
) {
    for friction in [0.0, 0.05] {
        let solved = thrown_at_wall(friction);
        let mass: f64 = solved.state.mass.iter().sum();
        let v = [0, 1, 2].map(|a| {
            solved.state.v.iter().zip(&solved.state.mass).map(|(v, m)| m * v[a]).sum::<f64>() / mass
        });
        let at = format!("friction {friction:?}");
        assert!(v[2] > 0.0, "it has turned round: {v:?}");
        figures.add(
            &format!("oblique on a wall @ {at}, tangential over normal impulse"),
            (10.0 - v[0]) / (v[2] + 10.0),
        );
        figures.add("oblique on a wall: velocity across (m/s)", v[1]);
    }
}
