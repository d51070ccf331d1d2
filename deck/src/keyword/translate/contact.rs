//! Which parts meet, whose contact forces are written, and what becomes of nodes that erosion frees.

use std::collections::{BTreeMap, BTreeSet};

use super::{part::first_erosion, state::Translation};
use crate::{
    keyword::contact::{ContactCard, Side, Tied},
    limits::MAX_CONTACT_FORCES,
    place::{Origin, Place, Placed},
    typed::{
        FreedNodes,
        condition::made,
        contact::{Contact, Gap, Pair, Slack, Tie},
    },
};

/// Adds contact to the deck.
pub(super) fn write(t: &mut Translation<'_>) {
    let problem = t.problem;
    let mut pairs: BTreeMap<(u32, u32), &ContactCard> = BTreeMap::new();
    let mut ties = Vec::new();
    let sheets: BTreeSet<u32> = problem.shells.iter().map(|shell| shell.part).collect();
    let mut ignoring = None;
    for contact in &problem.contacts {
        if let Some(tied) = contact.tied {
            let tie = tie_of(contact, tied, t);
            if tie.is_none() {
                t.log.warn(
                    contact.at,
                    "a tied contact without parts with elements on both sides: it ties nothing",
                );
            }
            ties.extend(tie);
            if !tied.then_meets {
                continue;
            }
        }
        let (mut meets, mut sheets_meet) = (false, false);
        for (a, b) in pairs_of(contact, t) {
            let known = t.names.contains_key(&a) && t.names.contains_key(&b);
            if known && !t.bodies.same(a, b) {
                pairs.entry((a, b)).or_insert(contact);
                meets = true;
                sheets_meet |= sheets.contains(&a) && sheets.contains(&b);
            }
        }
        if sheets_meet {
            t.log.warn(
                contact.at,
                "where shells meet shells, their middles come as near as half the thinnest, so that surfaces overlap by half a thickness; \
                 LS-DYNA keeps them (t1 + t2) / 2 apart: where that matters, convert the deck and give its [contact] a gap_length of a whole thickness",
            );
        }
        if meets {
            ignoring = ignoring.or(contact.ignores_initial).or(problem.control.ignores_initial);
        }
        if !meets && contact.tied.is_none() {
            t.log.warn(contact.at, "a contact of no parts with elements that may meet: it does nothing");
        }
    }
    let Some(at) =
        problem.contacts.first().map(|contact| contact.at).filter(|_| !(pairs.is_empty() && ties.is_empty()))
    else {
        return;
    };
    if let Some((at, ignore)) = ignoring {
        let words = format!(
            "IGNORE {ignore}: nodes that start inside another part, or nearer than the gap to it, pass the faces there for the whole run, in every \
             contact of the deck, where LS-DYNA has them meet from the depth at which they start; move bodies that only touch apart by the gap"
        );
        t.log.warn(at, words);
    }
    write_freed_nodes(t);
    t.met = pairs.keys().copied().collect();
    let decay = the_decay(&pairs, t);
    let pair = |((a, b), card): ((u32, u32), &ContactCard)| Pair {
        origin: Origin::card(card.at),
        parts: [a, b].map(|id| made(t.names[&id].clone(), card.at)),
        interacts: true,
        friction: (card.friction != 0.0 || card.decay.is_some()).then_some(card.friction),
        friction_kinetic: card.decay.map(|(kinetic, _)| kinetic),
    };
    let met = !pairs.is_empty();
    let pairs = pairs.into_iter().map(pair).collect();
    t.deck.has_contact = true;
    t.deck.contact = Some(Contact {
        at,
        friction: 0.0,
        friction_kinetic: None,
        friction_decay: decay,
        default_interacts: false,
        self_interaction: None,
        pairs,
        ties,
        gap: if met { Gap::Fit } else { Gap::Default },
        slack: Slack::Default,
        stiffness: None,
        friction_velocity: None,
        edges: problem.contacts.iter().any(|contact| contact.edges),
        ignores_initial: ignoring.is_some(),
    });
}

/// How fast friction falls with the velocity: what the first contact says of which it does.
fn the_decay(pairs: &BTreeMap<(u32, u32), &ContactCard>, t: &Translation<'_>) -> f64 {
    let decays = |card: &&ContactCard| card.decay.map(|(_, decay)| (card.at, decay));
    let given: BTreeMap<Place, f64> = pairs.values().filter_map(decays).collect();
    let Some(&first) = given.values().next() else { return 0.0 };
    for (&at, _) in given.iter().filter(|(_, decay)| **decay != first) {
        t.log.warn(at, format!("DC of the first contact of which friction falls is that of all: {first}"));
    }
    first
}

/// Distance of a tied node from its face over the smallest edge of both parts: LS-DYNA takes nodes within 5 % of a face's diagonal.
const TIED_WITHIN: f64 = 0.05;

/// The tie of a card whose parts have elements; parts on both sides are left to the second.
fn tie_of(contact: &ContactCard, tied: Tied, t: &Translation<'_>) -> Option<Tie> {
    let faces = parts_of(contact, contact.second?, t);
    let nodes: Vec<u32> =
        parts_of(contact, contact.first, t).into_iter().filter(|part| !faces.contains(part)).collect();
    let named = |parts: Vec<u32>| -> Vec<Placed<String>> {
        let names = parts.iter().filter_map(|part| t.names.get(part));
        names.map(|name| made(name.clone(), contact.at)).collect()
    };
    let (nodes, faces) = (named(nodes), named(faces));
    let empty = nodes.is_empty() || faces.is_empty();
    (!empty).then_some(Tie { at: contact.at, nodes, faces, tolerance: TIED_WITHIN, limits: tied.limits })
}

/// Of a deck with contact: LS-DYNA drops freed nodes unless ENMASS keeps them.
fn write_freed_nodes(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let Some(first) = first_erosion(t) else { return };
    let (at, keeps) = problem.control.freed_nodes.unwrap_or((first, false));
    t.deck.erosion =
        Some(FreedNodes { at, retain_inertia: Some(Placed::new(keeps, Origin::card(at))), particles: None });
    for contact in problem.contacts.iter().filter(|contact| !contact.erodes) {
        log.warn(
            contact.at,
            "the faces that eroded elements uncover meet others too, as in an ERODING contact with EROSOP 1",
        );
    }
}

/// The pairs of all transducers, each once, and where the first transducer stands.
pub(super) fn watched(t: &Translation<'_>) -> Option<(Place, Vec<[u32; 2]>)> {
    let (problem, log) = (t.problem, t.log);
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    for card in &problem.transducers {
        let own = watched_by(card, t);
        if own.is_empty() {
            log.warn(card.at, "a force transducer of parts that meet no other: there is nothing to write");
        }
        for [a, b] in own {
            if !pairs.contains(&[a, b]) && !pairs.contains(&[b, a]) {
                pairs.push([a, b]);
            }
        }
    }
    let at = problem.transducers.first().map(|card| card.at).filter(|_| !pairs.is_empty())?;
    if pairs.len() > MAX_CONTACT_FORCES {
        let n = pairs.len();
        let words =
            format!("force transducers of {n} pairs of parts: the first {MAX_CONTACT_FORCES} are written");
        log.warn(at, words);
        pairs.truncate(MAX_CONTACT_FORCES);
    }
    Some((at, pairs))
}

/// Pairs of different parts of a transducer among those that meet: one of its own, then the other.
fn watched_by(card: &ContactCard, t: &Translation<'_>) -> Vec<[u32; 2]> {
    let first: BTreeSet<u32> = parts_of(card, card.first, t).into_iter().collect();
    let second: Option<BTreeSet<u32>> = card.second.map(|side| parts_of(card, side, t).into_iter().collect());
    let from = |part: &u32| second.as_ref().is_none_or(|second| second.contains(part));
    let mut pairs = Vec::new();
    for &(a, b) in t.met.iter().filter(|(a, b)| a != b) {
        if first.contains(&a) && from(&b) {
            pairs.push([a, b]);
        } else if first.contains(&b) && from(&a) {
            pairs.push([b, a]);
        }
    }
    pairs
}

/// Pairs of parts that meet, lower number first, in order.
fn pairs_of(card: &ContactCard, t: &Translation<'_>) -> Vec<(u32, u32)> {
    let first = parts_of(card, card.first, t);
    let mut pairs = Vec::new();
    match card.second {
        None => {
            for (i, a) in first.iter().enumerate() {
                pairs.extend(first[i..].iter().map(|b| (*a, *b)));
            }
        }
        Some(second) => {
            let second = parts_of(card, second, t);
            for a in &first {
                pairs.extend(second.iter().map(|b| (*a.min(b), *a.max(b))));
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn parts_of(card: &ContactCard, side: Side, t: &Translation<'_>) -> Vec<u32> {
    let (problem, log) = (t.problem, t.log);
    let holding = |nodes: Vec<u32>, what: &str| {
        let held = |id: &u32| nodes.binary_search(id).is_ok();
        let solids = problem.solids.iter().filter(|e| e.nodes.iter().any(held)).map(|e| e.part);
        let shells = problem.shells.iter().filter(|e| e.nodes.iter().any(held)).map(|e| e.part);
        let beams = problem.beams.iter().filter(|e| e.nodes.iter().any(held)).map(|e| e.part);
        let mut parts: Vec<u32> = solids.chain(shells).chain(beams).collect();
        parts.sort_unstable();
        parts.dedup();
        log.warn(card.at, format!("a contact of a set of {what}: the parts that hold them meet as a whole"));
        parts
    };
    match side {
        Side::All => problem.parts.keys().copied().collect(),
        Side::Part(id) => {
            if !problem.parts.contains_key(&id) {
                log.fault(card.at, format!("part {id}"), "a part of the deck", "correct the number");
            }
            vec![id]
        }
        Side::PartSet(id) => problem.part_set(id, card.at, log),
        Side::NotPartSet(id) => {
            let out = problem.part_set(id, card.at, log);
            problem.parts.keys().copied().filter(|p| out.binary_search(p).is_err()).collect()
        }
        Side::NodeSet(id) => holding(problem.node_set(id, card.at, log), "nodes"),
        Side::SegmentSet(id) => {
            let mut nodes: Vec<u32> = problem.segment_set(id, card.at, log).into_iter().flatten().collect();
            nodes.sort_unstable();
            holding(nodes, "segments")
        }
    }
}
