//! Where and when explosives are lit.

use mechanics::burn::Detonation;

use super::state::Translation;
use crate::keyword::material::Law;

/// Adds the detonations to the deck. A front lights every explosive, so one of a part alone needs to be that of the only one.
pub(super) fn write_detonations(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let burns = |id: &&u32| {
        let material = problem.materials.get(&problem.parts[*id].material.value);
        matches!(material.map(|m| &m.law), Some(Law::Explosive { .. }))
    };
    let explosives: Vec<u32> = t.names.keys().filter(burns).copied().collect();
    for card in &problem.detonations {
        if card.part != 0 && explosives != [card.part] {
            let expected = match explosives.contains(&card.part) {
                true => "PID 0: a front lights every explosive that it comes to",
                false => "a part of *MAT_HIGH_EXPLOSIVE_BURN with elements",
            };
            log.fault(card.at, format!("part {}", card.part), expected, "give PID 0, or correct it");
            continue;
        }
        let point = t.vector(card.at, "a detonation at", card.point);
        let time = t.number(card.at, "a time of detonation of", card.time);
        t.deck.detonations.push((card.at, Some(Detonation { point, time })));
    }
}
