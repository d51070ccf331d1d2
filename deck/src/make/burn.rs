//! Where and when explosives are lit.

use mechanics::{burn::Detonation, material::Material};

use super::part::PartDraft;
use crate::{log::Log, typed::Deck};

/// The detonations. An explosive that nothing lights would bear no load for ever, and a detonation without an
/// explosive does nothing: both are faults.
pub(super) fn make(
    deck: &Deck,
    materials: &[Material],
    parts: &[PartDraft],
    log: &Log<'_>,
) -> Vec<Detonation> {
    let burns =
        |part: &&PartDraft| part.material.is_some_and(|m| materials[m as usize].detonation_speed().is_some());
    let explosive = parts.iter().find(burns);
    match (deck.detonations.first(), explosive) {
        (None, Some(part)) => log.fault(
            part.at,
            format!(
                "part \"{}\" of an explosive in a deck without {}",
                part.name,
                log.say("[[detonation]]", "*INITIAL_DETONATION")
            ),
            "at least one point that lights it",
            log.say("add [[detonation]] with point = [x, y, z]", "add *INITIAL_DETONATION"),
        ),
        // A part whose material could not be read may have been meant.
        (Some((at, _)), None) if parts.iter().all(|part| part.material.is_some()) => log.fault(
            *at,
            log.say(
                "[[detonation]] in a deck without an explosive",
                "*INITIAL_DETONATION in a deck without an explosive",
            ),
            log.say("a part with a jwl equation of state", "a part of *MAT_HIGH_EXPLOSIVE_BURN"),
            "remove it, or choose an explosive",
        ),
        _ => {}
    }
    deck.detonations.iter().filter_map(|(_, detonation)| *detonation).collect()
}
