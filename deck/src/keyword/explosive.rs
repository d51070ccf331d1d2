//! Explosives: `*MAT_HIGH_EXPLOSIVE_BURN` and `*EOS_JWL`, which are one law here, and `*INITIAL_DETONATION`.

use super::{
    cards::Block,
    fields::{Context, Fields, TENS},
    material::{EosCard, Law},
    problem::Problem,
};
use crate::{place::Place, table::Range};

/// Constants of `*EOS_JWL`.
#[derive(Clone, Copy)]
pub(super) struct Jwl {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) r1: f64,
    pub(super) r2: f64,
    pub(super) omega: f64,
    /// Energy per initial volume.
    pub(super) energy: f64,
}

/// A point from which explosives are lit.
pub(super) struct DetonationCard {
    pub(super) at: Place,
    /// The only part that it lights; 0 is all.
    pub(super) part: u32,
    pub(super) point: [f64; 3],
    pub(super) time: f64,
}

/// Reads `*MAT_HIGH_EXPLOSIVE_BURN`.
pub(super) fn read_material(f: &Fields<'_>, context: &Context<'_>) -> Option<Law> {
    let speed = f.positive(2, "a speed of detonation");
    let pressure = f.positive(3, "a pressure of detonation");
    if f.real(4, 0.0) != 0.0 {
        let words = "BETA: explosives burn as they are lit and as they are compressed, as with BETA 0";
        context.log.warn(f.at, words);
    }
    for (i, name) in [(5, "K"), (6, "G"), (7, "SIGY")].into_iter().filter(|(i, _)| f.real(*i, 0.0) != 0.0) {
        f.fault(i, format!("{name} blank: what has not burnt is as stiff as its products"), "leave it blank");
    }
    Some(Law::Explosive { speed: speed?, pressure: pressure? })
}

/// Reads `*EOS_JWL`.
pub(super) fn read_jwl(f: &Fields<'_>) -> Option<EosCard> {
    if !matches!(f.real(7, 0.0), 0.0 | 1.0) {
        f.fault(7, "a relative volume of 1 at the start", "leave VO blank");
    }
    let [a, b] = [1, 2].map(|i| f.within(i, 0.0, Range::NotNegative));
    let [r1, r2, omega] = [(3, "R1"), (4, "R2"), (5, "OMEG")].map(|(i, name)| f.positive(i, name));
    let energy = f.positive(6, "an energy");
    Some(EosCard::Jwl(Jwl { a, b, r1: r1?, r2: r2?, omega: omega?, energy: energy? }))
}

/// Reads `*INITIAL_DETONATION`: a card each.
pub(super) fn read_detonations(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        let f = context.fields(card, block.width, &TENS);
        let time = f.within(4, 0.0, Range::NotNegative);
        problem.detonations.push(DetonationCard { at: f.at, part: f.id(0), point: f.vector(1), time });
    }
}
