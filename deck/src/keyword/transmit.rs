//! `*BOUNDARY_NON_REFLECTING`: faces through which waves leave.

use super::{
    cards::Block,
    fields::{Context, TENS},
    problem::Problem,
};

/// Reads sets of segments, one of a card.
pub(super) fn read(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        let f = context.fields(card, block.width, &TENS);
        for i in [1, 2].into_iter().filter(|i| f.real(*i, 0.0) != 0.0) {
            f.fault(i, "faces through which waves of both kinds leave", "leave AD and AS blank");
        }
        problem.transmitting.push((f.at, f.id(0)));
    }
}
