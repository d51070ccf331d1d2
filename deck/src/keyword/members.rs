//! The nodes, parts, segments and elements that sets of a deck come to.

use std::collections::{BTreeMap, BTreeSet};

use super::{problem::Problem, set::Entry};
use crate::{log::Log, place::Place};

/// Deepest nesting of sets of sets.
const MAX_DEPTH: usize = 20;

/// A walk through sets that name others.
struct Walk {
    of_nodes: bool,
    /// The sets that name one another, down to the present one.
    path: Vec<u32>,
    /// Members of the sets that were seen, each of which is looked at once however often it is named.
    done: BTreeMap<u32, Vec<u32>>,
}

impl Walk {
    fn of(of_nodes: bool) -> Self {
        Self { of_nodes, path: Vec::new(), done: BTreeMap::new() }
    }
}

impl Problem {
    /// Nodes of a set, ascending.
    pub(super) fn node_set(&self, id: u32, by: Place, log: &Log<'_>) -> Vec<u32> {
        self.members(id, (by, log), &mut Walk::of(true))
    }

    /// Parts of a set, ascending.
    pub(super) fn part_set(&self, id: u32, by: Place, log: &Log<'_>) -> Vec<u32> {
        self.members(id, (by, log), &mut Walk::of(false))
    }

    /// Solids (0), shells (1) or beams (2) of a set, ascending.
    pub(super) fn element_set(&self, kind: usize, id: u32, by: Place, log: &Log<'_>) -> Vec<u32> {
        let Some((at, entries)) = self.sets.elements[kind].get(&id) else {
            let what = ["solids", "shells", "beams"][kind];
            let expected = format!("a set of {what} of the deck");
            log.fault(
                by,
                format!("set {id}"),
                expected,
                "define it by LIST, GENERATE or GENERAL, or name another",
            );
            return Vec::new();
        };
        let known: BTreeMap<u32, u32> = match kind {
            0 => self.solids.iter().map(|element| (element.id, element.part)).collect(),
            1 => self.shells.iter().map(|element| (element.id, element.part)).collect(),
            _ => self.beams.iter().map(|element| (element.id, element.part)).collect(),
        };
        let mut members = BTreeSet::new();
        let mut strange = 0;
        for (entry, out) in entries {
            let found: Vec<u32> = match entry {
                Entry::All => known.keys().copied().collect(),
                Entry::Node(id) => known.contains_key(id).then_some(*id).into_iter().collect(),
                Entry::Range(first, last) => known.range(first..=last).map(|(id, _)| *id).collect(),
                Entry::Steps(first, last, step) => {
                    let range = known.range(first..=last).map(|(id, _)| *id);
                    range.filter(|id| (id - first).is_multiple_of(*step)).collect()
                }
                Entry::Part(part) => known.iter().filter(|(_, of)| *of == part).map(|(id, _)| *id).collect(),
                Entry::Box(_) | Entry::Set(_) | Entry::Segment(_) => Vec::new(),
            };
            strange += usize::from(found.is_empty());
            for id in found {
                if *out {
                    members.remove(&id)
                } else {
                    members.insert(id)
                };
            }
        }
        if strange > 0 {
            log.warn(*at, format!("set {id}: {strange} of its entries name no element of the deck"));
        }
        members.into_iter().collect()
    }

    /// Nodes or parts of a set, and of those that it names.
    fn members(&self, id: u32, (by, log): (Place, &Log<'_>), walk: &mut Walk) -> Vec<u32> {
        let of_nodes = walk.of_nodes;
        let (sets, what) = if of_nodes { (&self.sets.nodes, "nodes") } else { (&self.sets.parts, "parts") };
        let Some((at, entries)) = sets.get(&id) else {
            log.fault(
                by,
                format!("set {id}"),
                format!("a set of {what} of the deck"),
                "define it, or name another",
            );
            return Vec::new();
        };
        if let Some(start) = walk.path.iter().position(|above| *above == id) {
            let mut read = format!("set {id}");
            for other in walk.path.iter().skip(start + 1) {
                read += &format!(", which names set {other}");
            }
            if walk.path.len() > start + 1 {
                read += &format!(", which names set {id} again");
            }
            log.fault(by, read, "sets that do not hold themselves", "list the members of one of them");
            return Vec::new();
        }
        if walk.path.len() == MAX_DEPTH {
            let expected = format!("at most {MAX_DEPTH} sets one in another");
            log.fault(by, format!("set {id}"), expected, "list the members");
            return Vec::new();
        }
        walk.path.push(id);
        let mut named = BTreeSet::new();
        let mut members: Vec<u32> = Vec::new();
        for (entry, out) in entries {
            let mut found: Vec<u32> = match entry {
                Entry::All if of_nodes => self.nodes.iter().map(|n| n.id).collect(),
                Entry::All => self.parts.keys().copied().collect(),
                Entry::Node(id) => vec![*id],
                Entry::Range(first, last) if of_nodes => {
                    self.nodes.iter().map(|n| n.id).filter(|id| (first..=last).contains(&id)).collect()
                }
                Entry::Range(first, last) => self.parts.range(first..=last).map(|(id, _)| *id).collect(),
                Entry::Steps(first, last, step) => {
                    let is = |id: &u32| (first..=last).contains(&id) && (id - first).is_multiple_of(*step);
                    match of_nodes {
                        true => self.nodes.iter().map(|n| n.id).filter(is).collect(),
                        false => self.parts.keys().copied().filter(is).collect(),
                    }
                }
                Entry::Part(part) => self.nodes_of_part(*part),
                Entry::Box(number) => {
                    let inside = self.within(*number, *at, log);
                    self.nodes.iter().filter(|n| inside(n.x)).map(|n| n.id).collect()
                }
                // Named once more it adds nothing.
                Entry::Set(other) if !named.insert(*other) => Vec::new(),
                Entry::Set(other) => {
                    if !walk.done.contains_key(other) {
                        let members = self.members(*other, (*at, log), walk);
                        walk.done.insert(*other, members);
                    }
                    walk.done.get(other).cloned().unwrap_or_default()
                }
                Entry::Segment(_) => Vec::new(),
            };
            found.sort_unstable();
            if *out {
                members.retain(|id| found.binary_search(id).is_err());
            } else {
                members.append(&mut found);
            }
        }
        walk.path.pop();
        members.sort_unstable();
        members.dedup();
        let known = |id: &u32| match of_nodes {
            true => self.node_index.contains_key(id),
            false => self.parts.contains_key(id),
        };
        let strange = members.iter().filter(|id| !known(id)).count();
        if strange > 0 {
            log.warn(*at, format!("set {id} names {strange} {what} that the deck does not have"));
            members.retain(known);
        }
        members
    }

    /// Segments of a set. Parts and boxes stand for the outer faces there.
    pub(super) fn segment_set(&self, id: u32, by: Place, log: &Log<'_>) -> Vec<[u32; 4]> {
        let Some((at, entries)) = self.sets.segments.get(&id) else {
            log.fault(by, format!("set {id}"), "a set of segments of the deck", "define it, or name another");
            return Vec::new();
        };
        let mut list = Vec::new();
        for (entry, out) in entries {
            match entry {
                Entry::Segment(face) if !out => list.push(*face),
                _ => {
                    log.fault(*at, format!("set {id}"), "segments by their nodes", "list them, *SET_SEGMENT")
                }
            }
        }
        list
    }

    /// Whether a point lies in a box, with its sides.
    pub(super) fn within(&self, number: u32, by: Place, log: &Log<'_>) -> impl Fn([f64; 3]) -> bool + use<> {
        let bounds = self.boxes.get(&number).copied();
        if bounds.is_none() {
            log.fault(by, format!("box {number}"), "a *DEFINE_BOX of the deck", "define it, or name another");
        }
        let [low, high] = bounds.unwrap_or_default();
        move |x| (0..3).all(|a| (low[a]..=high[a]).contains(&x[a]))
    }
}
