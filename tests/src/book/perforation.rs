//! Targets that projectiles go through, beside tests: what is left of their speed, and the speed from which on they do.

use std::path::Path;

use deck::bundle::Options;
use master::deck_file::read_deck_with;

use crate::{
    case::Figures,
    solve::{Solved, Workers, example, run, solve},
};

/// Velocity at which half of the blunt projectiles went through 12 mm of Weldox 460 E (m/s): Borvik and others (1999).
const LIMIT: f64 = 184.5;
/// Thickness of that plate (mm).
const PLATE: f64 = 12.0;

/// A deck of the repository at a velocity (m/s).
fn at(deck: &str, velocity: f64) -> Solved {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deck").join(deck);
    let parameters = [("velocity".to_owned(), velocity)].into();
    let model = read_deck_with(&path, &Options { parameters, ..Options::default() });
    let model = model.unwrap_or_else(|faults| panic!("{faults}"));
    solve(model, Workers::default()).unwrap_or_else(|e| panic!("{velocity} m/s: {e}"))
}

/// Mean velocity of the first part at the end over that at the start.
fn left_of_the_velocity(solved: &Solved) -> f64 {
    let (first, last) = (&solved.rows[0], solved.rows.last().expect("rows"));
    last.part_momenta[0][2] / first.part_momenta[0][2]
}

pub(super) fn a_blunt_projectile_goes_through_steel_from_the_measured_velocity_on(figures: &mut Figures) {
    for (words, factor) in [("5 % below", 0.95), ("5 % above", 1.05)] {
        let solved = at("studies/blunt-projectile.toml", factor * LIMIT);
        let nose = |row: &master::results::history::HistoryRow| row.gauges[0].x[2];
        let way = nose(&solved.rows[0]) - nose(solved.rows.last().expect("rows"));
        figures.add(
            &format!("blunt projectile @ {words} its limit, way of the nose over the thickness"),
            way / PLATE,
        );
    }
}

pub(super) fn a_fragment_of_tetrahedra_keeps_of_its_velocity_what_thor_leaves_it(figures: &mut Figures) {
    let solved = run(example("tetrahedral-fragment"));
    figures.add(
        "fragment through aluminium @ 600 m/s, residual velocity (m/s)",
        600.0 * left_of_the_velocity(&solved),
    );
    let error = solved.rows.last().expect("rows").error;
    figures.add("fragment through aluminium @ 600 m/s, energy error", error);
}

pub(super) fn an_ogive_keeps_of_its_velocity_what_it_kept_behind_a_slab_of_concrete(figures: &mut Figures) {
    for velocity in [606.0, 749.0, 1058.0] {
        let solved = at("studies/ogive-through-concrete.toml", velocity);
        figures.add(
            &format!("ogive through concrete @ {velocity} m/s, residual velocity (m/s)"),
            velocity * left_of_the_velocity(&solved),
        );
        let error = solved.rows.last().expect("rows").error;
        figures.add(&format!("ogive through concrete @ {velocity} m/s, energy error"), error);
    }
}
