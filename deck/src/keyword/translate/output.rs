//! What is written and when.

use std::collections::BTreeMap;

use super::{contact, state::Translation};
use crate::{
    geometry::sub,
    keyword::control::{CutCard, SectionCard},
    place::{Origin, Place, Placed},
    typed::{
        Cut, Gauge, Kind, Section, Spot,
        condition::{Parts, Region, made},
    },
};

const MAX_GAUGES: usize = 100;

/// Adds what is to be written to the deck.
pub(super) fn write(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let control = &problem.control;
    // NPLTC goes over DT.
    t.deck.output.period = match (control.states, control.end_time) {
        (1.., Some((_, end))) => Some(end / f64::from(control.states)),
        _ => control.period.map(|(_, period)| period),
    };
    if let Some((at, pairs)) = contact::watched(t) {
        let named =
            |pair: [u32; 2]| Placed::new(pair.map(|id| made(t.names[&id].clone(), at)), Origin::card(at));
        let pairs = pairs.into_iter().map(named).collect();
        t.deck.output.contact_forces = Some(Placed::new(pairs, Origin::card(at)));
    }
    for (number, card) in (1..).zip(&control.sections) {
        let faults = log.count();
        let section = section(t, number, card);
        // Without a set that it names it would cut nothing, which is no second fault.
        if log.count() == faults {
            t.deck.sections.push(section);
        }
    }
    let mut gauges: BTreeMap<u32, Place> = control.gauges.iter().map(|(at, id)| (*id, *at)).collect();
    for (at, set) in &control.gauge_sets {
        gauges.extend(problem.node_set(*set, *at, log).into_iter().map(|id| (id, *at)));
    }
    if let Some((id, at)) = gauges.iter().find(|(id, _)| t.references.has(**id)) {
        let words = format!(
            "the history of node {id}, which has no element, is not written: name a node of its rigid body that has one"
        );
        log.warn(*at, words);
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
    element_gauges(t);
}

/// Histories of solids and shells, which may have the same numbers.
fn element_gauges(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    for (kind, what) in [(0, "solid"), (1, "shell")] {
        let mut gauges: BTreeMap<u32, Place> =
            problem.control.element_gauges[kind].iter().map(|(at, id)| (*id, *at)).collect();
        for (at, set) in &problem.control.element_gauge_sets[kind] {
            gauges.extend(problem.element_set(kind, *set, *at, log).into_iter().map(|id| (id, *at)));
        }
        if gauges.is_empty() {
            continue;
        }
        let part_of: BTreeMap<u32, u32> = match kind {
            0 => problem.solids.iter().map(|element| (element.id, element.part)).collect(),
            _ => problem.shells.iter().map(|element| (element.id, element.part)).collect(),
        };
        let n = gauges.len();
        for (index, (id, at)) in gauges.into_iter().enumerate() {
            if index == MAX_GAUGES {
                log.warn(
                    at,
                    format!("histories of {n} {what}s: those of the first {MAX_GAUGES} are written"),
                );
                break;
            }
            let Some(part) = part_of.get(&id).and_then(|part| t.names.get(part)) else {
                log.fault(at, format!("{what} {id}"), format!("a {what} of the deck"), "correct the number");
                continue;
            };
            t.deck.gauges.push(Gauge {
                name: Some(made(format!("{what} {id}"), at)),
                of: Kind::Element,
                spot: Some(Spot::Number(Placed::new(id, Origin::card(at)))),
                part: Some(made(part.clone(), at)),
            });
        }
    }
}

/// A cross-section by its heading, or by its number.
fn section(t: &mut Translation<'_>, number: u32, card: &SectionCard) -> Section {
    let at = card.at;
    let name = match (card.heading.as_str(), card.id) {
        ("", 0) => number.to_string(),
        ("", id) => id.to_string(),
        (heading, _) => heading.to_string(),
    };
    let cut = match &card.cut {
        CutCard::Plane { parts, tail, head, radius } => {
            let parts = match *parts {
                0 => Parts::All,
                set => {
                    let members = t.problem.part_set(set, at, t.log);
                    let named = members.iter().filter_map(|id| t.names.get(id));
                    Parts::Named(named.map(|name| made(name.clone(), at)).collect())
                }
            };
            let radius = Some(*radius).filter(|radius| *radius > 0.0);
            Cut::Plane { plane: Some([*tail, sub(*head, *tail)]), parts, radius }
        }
        CutCard::Sets { nodes, elements } => {
            let nodes = t.problem.node_set(*nodes, at, t.log);
            let nodes = Region::Set(t.set(&format!("cross-section {name}"), nodes, at));
            let of = |(what, set): (usize, u32)| -> Vec<Placed<u32>> {
                let members = match set {
                    0 => Vec::new(),
                    set => t.problem.element_set(what, set, at, t.log),
                };
                members.into_iter().map(|id| Placed::new(id, Origin::card(at))).collect()
            };
            let [solids, shells, beams] = *elements;
            Cut::Listed { nodes, elements: [(0, solids), (1, shells), (2, beams)].map(of) }
        }
    };
    Section { at, title: format!("cross-section {name}"), name: Some(made(name, at)), cut }
}
