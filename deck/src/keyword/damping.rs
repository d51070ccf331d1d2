//! `*DAMPING_GLOBAL`: velocities die away by the mass of the nodes.

use super::{
    cards::Block,
    fields::{Context, TENS},
    problem::Problem,
};

/// Reads the rate, which all directions and turns have alike.
pub(super) fn read(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let card = block.card(0);
    let f = context.fields(card, block.width, &TENS);
    if f.id(0) != 0 {
        f.fault(0, "no curve: damping is constant", "leave LCID blank and give VALDMP");
    }
    let shares = [2, 3, 4, 5, 6, 7].map(|i| f.real(i, 0.0));
    if let Some(i) = shares.iter().position(|share| *share != shares[0]) {
        f.fault(
            2 + i,
            format!("{}, as STX: all directions and turns alike", shares[0]),
            "leave STX to SRZ blank",
        );
    }
    let share = if shares[0] == 0.0 { 1.0 } else { shares[0] };
    let rate = f.real(1, 0.0) * share;
    if rate < 0.0 {
        f.fault(1, "a rate of 0 or more", "correct it");
    }
    problem.damping += rate;
}
