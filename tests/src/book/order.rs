//! Convergence: with what power of the cell size errors fall, and what the results come to on infinitely small cells.

use super::{
    gas::{noh_error, radius_of_blast, sods_tube},
    shell::sag_of_plate,
    solid::length_of_copper_bar,
    wave::first_tone,
};
use crate::case::Figures;

/// The power of the cell size by which the first error is greater than the second, on cells twice as large.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// A result on three meshes, each with cells half as large as the one before: its order without an exact value, and the value to which a
/// power of this order leads (Richardson 1911).
struct Trend {
    order: f64,
    limit: f64,
}

impl Trend {
    fn of([coarse, middle, fine]: [f64; 3]) -> Self {
        let order = order(middle - coarse, fine - middle);
        Self { order, limit: fine + (fine - middle) / (order.exp2() - 1.0) }
    }

    fn add_to(&self, figures: &mut Figures, name: &str, value: &str) {
        figures.add(&format!("{name}, order of accuracy"), self.order);
        figures.add(&format!("{name}, {value} on infinitely small cells"), self.limit);
    }
}

pub(super) fn shocks_converge_with_the_cells(figures: &mut Figures) {
    let sod = [50, 100, 200].map(|half| sods_tube(half).1);
    figures.add("Sod @ 100 and 200 cells, order of accuracy", order(sod[0], sod[1]));
    figures.add("Sod @ 200 and 400 cells, order of accuracy", order(sod[1], sod[2]));
    let noh = [100, 200, 400].map(noh_error);
    figures.add("Noh @ 100 and 200 cells, order of accuracy", order(noh[0], noh[1]));
    figures.add("Noh @ 200 and 400 cells, order of accuracy", order(noh[1], noh[2]));
}

pub(super) fn elastic_waves_and_bent_shells_converge_with_the_square_of_the_cells(figures: &mut Figures) {
    let tone = [10, 20, 40].map(first_tone);
    figures.add("ringing bar @ 10 and 20 cells, order of accuracy", order(25e3 - tone[0], 25e3 - tone[1]));
    figures.add("ringing bar @ 20 and 40 cells, order of accuracy", order(25e3 - tone[1], 25e3 - tone[2]));
    Trend::of(tone).add_to(figures, "ringing bar @ 10, 20 and 40 cells", "frequency (Hz)");
    let sag = [4, 8, 16].map(sag_of_plate);
    Trend::of(sag).add_to(figures, "square plate @ 4, 8 and 16 cells", "deflection (m)");
}

pub(super) fn taylor_bars_and_blasts_converge_with_the_cells(figures: &mut Figures) {
    let length = [2, 4, 8].map(length_of_copper_bar);
    Trend::of(length).add_to(figures, "taylor copper @ 2, 4 and 8 cells in the core", "length (mm)");
    let radius = [12, 24, 48].map(radius_of_blast);
    println!("point blast: radii {radius:?}");
    Trend::of(radius).add_to(figures, "point blast @ 12, 24 and 48 cells", "radius");
}
