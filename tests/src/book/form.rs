//! Wedges, pyramids and tetrahedra of four nodes beside beams and hexahedra.

use crate::{
    case::Figures,
    forms::{Cell, cantilever, struck},
    solve::run,
};

/// One cell of two wedges or six pyramids across. Within its triangles a wedge has one strain: wedges whose triangles lie across the bar, and
/// not along it or above each other, would bend as stiffly as any triangles of one strain.
pub(super) fn a_cantilever_of_wedges_rings_as_a_beam_with_one_layer(figures: &mut Figures) {
    // Euler and Bernoulli: 1.8751^2 sqrt(E I / (rho A)) / (2 pi L^2).
    let slender =
        3.516_015 / std::f64::consts::TAU * (200.0f64 / 7.85e-6).sqrt() * 4.0 / 12.0f64.sqrt() / 6400.0;
    for (cell, name) in [
        (Cell::Wedges(0), "wedges with their heights along it"),
        (Cell::Wedges(2), "wedges with their heights across it"),
        (Cell::Pyramids, "pyramids"),
    ] {
        let [frequency, error, _] = cantilever(cell);
        figures.add(&format!("cantilever of forms @ {name}, frequency over the beam's"), frequency / slender);
        figures.add(&format!("cantilever of forms @ {name}, energy error"), error);
    }
}

pub(super) fn a_struck_bar_of_each_form_shortens_as_one_of_hexahedra(figures: &mut Figures) {
    let shortened = |of: Cell| {
        let solved = run(struck(|_| of));
        let ends = solved.state.x.iter().map(|x| x[0]);
        let [low, high] = ends.fold([f64::INFINITY, 0.0_f64], |[low, high], x| [low.min(x), high.max(x)]);
        (48.0 - (high - low), solved.rows.last().expect("rows").error)
    };
    let (whole, _) = shortened(Cell::Whole);
    for (cell, name) in [
        (Cell::Wedges(0), "wedges with their heights along it"),
        (Cell::Wedges(1), "wedges with their heights across it"),
        (Cell::Pyramids, "pyramids"),
        (Cell::Tetrahedra, "tetrahedra"),
    ] {
        let (short, error) = shortened(cell);
        figures
            .add(&format!("struck bar of forms @ {name}, shortening over that of hexahedra"), short / whole);
        figures.add(&format!("struck bar of forms @ {name}, energy error"), error);
    }
}
