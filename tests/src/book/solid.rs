//! Bodies in three dimensions against published figures: the Taylor bar.

use crate::{
    case::Sheet,
    solve::{example, run},
};
use mechanics::state::field;

pub(super) fn the_copper_bar_is_as_long_and_its_foot_as_wide_as_others_find(sheet: &mut Sheet) {
    let solved = run(example("taylor-copper"));
    assert_eq!(solved.model.mesh.n_elements(), 972);
    let on_axis = |n: &usize| solved.model.mesh.positions[*n][..2] == [0.0, 0.0];
    let length =
        (0..solved.model.mesh.n_nodes()).filter(on_axis).map(|n| solved.state.x[n][2]).fold(0.0, f64::max);
    let radius = solved.state.x.iter().map(|x| x[0].hypot(x[1])).fold(0.0, f64::max);
    let strain = solved.state.elements[field::PLASTIC_STRAIN].iter().copied().fold(0.0, f64::max);
    let ledger = &solved.outcome.ledger;
    sheet.add("taylor copper 972: length (mm)", length);
    sheet.add("taylor copper 972: radius of the foot (mm)", radius);
    sheet.add("taylor copper 972: greatest plastic strain", strain);
    sheet.add("taylor copper 972: energy error", ledger.last.error);
    sheet.add(
        "taylor copper 972: hourglass energy over kinetic at first",
        ledger.hourglass / ledger.greatest_kinetic,
    );
    println!("{} cycles", solved.state.cycle);
}
