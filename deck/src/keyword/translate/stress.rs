//! Stress and plastic strain at the start.

use std::collections::BTreeMap;

use super::state::Translation;
use crate::{
    keyword::stress::StressCard,
    place::{Origin, Placed},
    typed::{
        condition::{Parts, made},
        stress::Stress,
    },
};

/// Adds the stress of each element or set to the deck, an entry for each part that has some of it.
pub(super) fn write(t: &mut Translation<'_>) {
    let problem = t.problem;
    if problem.stresses.is_empty() {
        return;
    }
    let part_of: [BTreeMap<u32, u32>; 2] = [
        problem.solids.iter().map(|element| (element.id, element.part)).collect(),
        problem.shells.iter().map(|element| (element.id, element.part)).collect(),
    ];
    for card in &problem.stresses {
        write_card(t, card, &part_of[card.kind]);
    }
}

fn write_card(t: &mut Translation<'_>, card: &StressCard, part_of: &BTreeMap<u32, u32>) {
    let what = ["solid", "shell"][card.kind];
    let elements = match card.is_of_set {
        true => t.problem.element_set(card.kind, card.id, card.at, t.log),
        false => vec![card.id],
    };
    let mut by_part: BTreeMap<u32, Vec<Placed<u32>>> = BTreeMap::new();
    for id in elements {
        match part_of.get(&id).filter(|part| t.names.contains_key(part)) {
            Some(part) => by_part.entry(*part).or_default().push(Placed::new(id, Origin::card(card.at))),
            None => {
                let expected = format!("a {what} of the deck");
                t.log.fault(card.at, format!("{what} {id}"), expected, "correct the number");
            }
        }
    }
    let of =
        if card.is_of_set { format!("set {} of {what}s", card.id) } else { format!("{what} {}", card.id) };
    for (part, elements) in by_part {
        t.deck.stresses.push(Stress {
            at: card.at,
            title: format!("the initial stress of {of}"),
            parts: Parts::Named(vec![made(t.names[&part].clone(), card.at)]),
            elements: Some(elements),
            points: Some(card.points.clone()),
        });
    }
}
