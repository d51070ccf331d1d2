//! Parts that are rigid for a time: from the times at which they switch to the spans in which they are bodies.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::load::Span;

use super::state::Translation;
use crate::{
    keyword::{material::Law, rigid::Members},
    place::Place,
    typed::condition::{Parts, Rigid, made},
};

/// Parts that are rigid for a time.
#[derive(Default)]
pub(super) struct Switched {
    /// When a part is rigid, with the part whose body it joins and where that is said; in the order of time.
    spans: BTreeMap<u32, Vec<(Span, u32, Place)>>,
}

/// Parts that switch at the same times, with the part whose body each joins and where that is said.
type Joining = BTreeMap<u32, (u32, Place)>;

/// What happens to a part at a time.
struct Event {
    time: f64,
    at: Place,
    /// The part whose body it joins; none where it deforms from then on.
    joins: Option<u32>,
}

impl Switched {
    /// Of all cards that switch parts. What no card lets deform again is rigid to the end.
    pub(super) fn of(t: &Translation<'_>) -> Self {
        let (problem, log) = (t.problem, t.log);
        let mut events: BTreeMap<u32, Vec<Event>> = BTreeMap::new();
        let parts_of = |members: Members, at: Place| {
            let parts = match members {
                Members::Part(id) => vec![id],
                Members::Set(id) => problem.part_set(id, at, log),
            };
            for id in parts.iter().filter(|id| !problem.parts.contains_key(id)) {
                log.fault(at, format!("part {id}"), "a part of the deck", "correct the number");
            }
            parts.into_iter().filter(|id| t.names.contains_key(id)).collect::<Vec<u32>>()
        };
        for card in &problem.rigid.switches {
            for &(at, members, lead) in &card.to_rigid {
                for id in parts_of(members, at) {
                    events.entry(id).or_default().push(Event { time: card.time, at, joins: Some(lead) });
                }
            }
            for &(at, members) in &card.to_deformable {
                for id in parts_of(members, at) {
                    events.entry(id).or_default().push(Event { time: card.time, at, joins: None });
                }
            }
        }
        // Those that begin rigid; unknown parts are reported with the bodies that last.
        for card in problem.rigid.joined.iter().filter(|card| card.switched) {
            let parts = match card.members {
                Members::Part(id) => vec![id],
                Members::Set(id) => problem.part_set(id, card.at, &log.quiet()),
            };
            for id in parts {
                let Some(list) = events.get_mut(&id) else { continue };
                list.push(Event { time: f64::NEG_INFINITY, at: card.at, joins: Some(card.lead) });
            }
        }
        let mut spans: BTreeMap<u32, Vec<(Span, u32, Place)>> = BTreeMap::new();
        for (id, mut list) in events {
            // Also a part that is rigid at no time at all is none that lasts.
            spans.entry(id).or_default();
            list.sort_by(|a, b| a.time.total_cmp(&b.time));
            if matches!(
                problem.materials.get(&problem.parts[&id].material.value).map(|m| &m.law),
                Some(Law::Rigid { .. })
            ) {
                log.fault(
                    list[0].at,
                    format!("part {id} of *MAT_RIGID"),
                    "a part that can deform",
                    "give it the material that it has when it deforms",
                );
                continue;
            }
            let mut since: Option<(f64, u32, Place)> = None;
            for event in list {
                match (event.joins, since) {
                    (Some(lead), None) => since = Some((event.time.max(0.0), lead, event.at)),
                    (None, Some((from, lead, at))) => {
                        if event.time > from {
                            let span = Span { from, until: event.time };
                            spans.entry(id).or_default().push((span, lead, at));
                        }
                        since = None;
                    }
                    (joins, _) => {
                        let is = if joins.is_some() { "rigid" } else { "deformable" };
                        log.warn(
                            event.at,
                            format!("part {id} is {is} before already: the switch does nothing"),
                        );
                    }
                }
            }
            if let Some((from, lead, at)) = since {
                let span = Span { from, ..Span::ALWAYS };
                spans.entry(id).or_default().push((span, lead, at));
            }
        }
        Self { spans }
    }

    /// Whether a part is rigid for a time.
    pub(super) fn is_timed(&self, part: u32) -> bool {
        self.spans.contains_key(&part)
    }
}

/// Adds them to the deck: parts that switch at the same times are one body where a card joins them or they share nodes.
pub(super) fn write(t: &mut Translation<'_>) {
    let mut at_once: Vec<(Span, Joining)> = Vec::new();
    for (&id, list) in &t.switched.spans {
        for &(span, lead, at) in list {
            match at_once.iter_mut().find(|(other, _)| *other == span) {
                Some((_, parts)) => _ = parts.insert(id, (lead, at)),
                None => at_once.push((span, Joining::from([(id, (lead, at))]))),
            }
        }
    }
    let mut made_now = Vec::new();
    for (span, parts) in at_once {
        for (at, members) in bodies_of(t, &parts) {
            made_now.push(Rigid {
                at,
                title: format!("the body of part {} from {}", members[0], span.from),
                name: None,
                parts: Parts::Named(members.iter().map(|id| made(t.names[id].clone(), at)).collect()),
                nodes: None,
                mass: None,
                inertia: None,
                start_spin: None,
                velocity: [const { None }; 3],
                spin: [const { None }; 3],
                circle: None,
                span,
            });
        }
    }
    t.deck.rigid.extend(made_now);
}

/// The bodies of parts that switch at the same times, each with the parts whose bodies they join.
fn bodies_of(t: &Translation<'_>, parts: &Joining) -> Vec<(Place, Vec<u32>)> {
    let mut lead: BTreeMap<u32, u32> = parts.keys().map(|&id| (id, id)).collect();
    let join = |lead: &mut BTreeMap<u32, u32>, a: u32, b: u32| {
        let (to, from) = (lead[&a].min(lead[&b]), lead[&a].max(lead[&b]));
        lead.values_mut().filter(|body| **body == from).for_each(|body| *body = to);
        to != from
    };
    for (&id, &(other, at)) in parts.iter().filter(|(_, (other, _))| *other != 0) {
        if parts.contains_key(&other) {
            join(&mut lead, id, other);
        } else {
            t.log.fault(
                at,
                format!("part {id}, which joins part {other}"),
                "a part that switches at the same times",
                "switch both by the same cards",
            );
        }
    }
    let mut first: BTreeMap<u32, u32> = BTreeMap::new();
    for ((&id, _), body) in t.names.iter().zip(&t.mesh.bodies) {
        let Some((_, at)) = parts.get(&id) else { continue };
        for node in body.corners().collect::<BTreeSet<u32>>() {
            let other = *first.entry(node).or_insert(id);
            if join(&mut lead, other, id) {
                t.log.warn(
                    *at,
                    format!("parts {other} and {id} share nodes, such as {node}: they are one body"),
                );
            }
        }
    }
    let mut bodies: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (id, body) in lead {
        bodies.entry(body).or_default().push(id);
    }
    bodies.into_iter().map(|(body, members)| (parts[&body].1, members)).collect()
}
