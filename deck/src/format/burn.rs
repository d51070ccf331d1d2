//! `[[detonation]]`: where and when explosives are lit.

use mechanics::{burn::Detonation, material::Material};

use super::{MAX_ENTRIES, PartDraft};
use crate::table::{Range, Table};

/// Reads the detonations. An explosive that nothing lights would bear no load for ever, and a detonation without an
/// explosive does nothing: both are faults.
pub(crate) fn read(deck: &Table<'_>, materials: &[Material], parts: &[PartDraft]) -> Vec<Detonation> {
    let mut detonations = Vec::new();
    let mut first = None;
    for table in deck.tables("detonation", MAX_ENTRIES) {
        first = first.or(Some(table.at));
        let point = table.vector("point");
        let time = table.number_or("time", 0.0, Range::NotNegative);
        table.finish();
        if let Some(point) = point {
            detonations.push(Detonation { point, time });
        }
    }
    let burns =
        |part: &&PartDraft| part.material.is_some_and(|m| materials[m as usize].detonation_speed().is_some());
    let explosive = parts.iter().find(burns);
    match (first, explosive) {
        (None, Some(part)) => deck.faults.add(
            part.at,
            format!("part \"{}\" of an explosive in a deck without [[detonation]]", part.name),
            "at least one point that lights it",
            "add [[detonation]] with point = [x, y, z]",
        ),
        // A part whose material could not be read may have been meant.
        (Some(at), None) if parts.iter().all(|part| part.material.is_some()) => deck.faults.add(
            at,
            "[[detonation]] in a deck without an explosive",
            "a part with a jwl equation of state",
            "remove it, or choose an explosive",
        ),
        _ => {}
    }
    detonations
}
