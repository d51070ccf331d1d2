//! Convergence: with what power of the cell size the errors of shocks fall.

use super::gas::{noh_error, sods_tube};
use crate::case::Figures;

/// The power of the cell size by which the first error is greater than the second, on cells twice as large.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

pub(super) fn shocks_converge_with_the_cells(figures: &mut Figures) {
    let sod = [50, 100, 200].map(|half| sods_tube(half).1);
    figures.add("Sod @ 100 and 200 cells, order of accuracy", order(sod[0], sod[1]));
    figures.add("Sod @ 200 and 400 cells, order of accuracy", order(sod[1], sod[2]));
    let noh = [100, 200, 400].map(noh_error);
    figures.add("Noh @ 100 and 200 cells, order of accuracy", order(noh[0], noh[1]));
    figures.add("Noh @ 200 and 400 cells, order of accuracy", order(noh[1], noh[2]));
}
