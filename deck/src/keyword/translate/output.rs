//! What is written and when.

use std::collections::BTreeMap;

use super::{contact, state::Translation};
use crate::{
    geometry::sub,
    keyword::control::SectionCard,
    place::{Origin, Place, Placed},
    typed::{
        Gauge, Kind, Section, Spot,
        condition::{Parts, made},
    },
};

const MAX_GAUGES: usize = 100;

/// Adds what is to be written to the deck.
pub(super) fn write(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let control = &problem.control;
    t.deck.output.period = control.period.map(|(_, period)| period);
    if let Some((at, pairs)) = contact::watched(t) {
        let named =
            |pair: [u32; 2]| Placed::new(pair.map(|id| made(t.names[&id].clone(), at)), Origin::card(at));
        let pairs = pairs.into_iter().map(named).collect();
        t.deck.output.contact_forces = Some(Placed::new(pairs, Origin::card(at)));
    }
    for (number, card) in (1..).zip(&control.sections) {
        let section = section(t, number, card);
        t.deck.sections.push(section);
    }
    let mut gauges: BTreeMap<u32, Place> = control.gauges.iter().map(|(at, id)| (*id, *at)).collect();
    for (at, set) in &control.gauge_sets {
        gauges.extend(problem.node_set(*set, *at, log).into_iter().map(|id| (id, *at)));
    }
    gauges.retain(|id, _| t.used.contains(id));
    if let Some((_, at)) = gauges.iter().nth(MAX_GAUGES) {
        let n = gauges.len();
        log.warn(*at, format!("histories of {n} nodes: those of the first {MAX_GAUGES} are written"));
    }
    for (id, at) in gauges.into_iter().take(MAX_GAUGES) {
        t.deck.gauges.push(Gauge {
            name: Some(made(format!("node {id}"), at)),
            of: Kind::Node,
            spot: Some(Spot::Number(Placed::new(id, Origin::card(at)))),
            part: None,
        });
    }
}

/// A cross-section by its heading, or by its number.
fn section(t: &Translation<'_>, number: u32, card: &SectionCard) -> Section {
    let at = card.at;
    let name = match (card.heading.as_str(), card.id) {
        ("", 0) => number.to_string(),
        ("", id) => id.to_string(),
        (heading, _) => heading.to_string(),
    };
    let parts = match card.parts {
        0 => Parts::All,
        set => {
            let members = t.problem.part_set(set, at, t.log);
            let named = members.iter().filter_map(|id| t.names.get(id));
            Parts::Named(named.map(|name| made(name.clone(), at)).collect())
        }
    };
    Section {
        at,
        title: format!("cross-section {name}"),
        name: Some(made(name, at)),
        parts,
        plane: Some([card.tail, sub(card.head, card.tail)]),
        radius: Some(card.radius).filter(|radius| *radius > 0.0),
    }
}
