//! `*SET_`: nodes, parts and segments by number, and what other keywords take from them.

use std::collections::BTreeMap;

use super::{
    cards::Block,
    fields::{Context, Fields, TENS},
    log::{Log, Place},
    problem::Problem,
};

/// Most numbers that one range may name.
const MAX_RANGE: u32 = 10_000_000;

/// One entry of a set of nodes or segments.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    All,
    Node(u32),
    Range(u32, u32),
    Part(u32),
    Box(u32),
    Set(u32),
    Segment([u32; 4]),
}

/// A set as the deck describes it; what is true takes its entry out.
pub(super) type Described = (Place, Vec<(Entry, bool)>);

/// The sets of a deck by number.
#[derive(Default)]
pub(super) struct Sets {
    pub(super) nodes: BTreeMap<u32, Described>,
    pub(super) parts: BTreeMap<u32, Described>,
    pub(super) segments: BTreeMap<u32, Described>,
}

impl Sets {
    /// Reads a `*SET_` keyword.
    pub(super) fn read(&mut self, block: &mut Block<'_>, context: &Context<'_>) {
        // Sets of the same number are not joined by it here.
        let collected = block.take("_COLLECT");
        let word = block.keyword["SET_".len()..].to_string();
        let (kind, way) = word.split_once('_').unwrap_or((&word, ""));
        let kind = match kind {
            "NODE" | "PART" | "SEGMENT" => kind,
            _ => {
                // What would use it names sets of nodes, parts or segments.
                context.log.ignore(block.at, &block.keyword);
                return;
            }
        };
        let head = block.card(0);
        let id = context.fields(&head, block.width, &TENS).id(0);
        let mut entries = Vec::new();
        for card in block.cards.iter().skip(1) {
            let f = context.fields(card, block.width, &TENS);
            match (kind, way) {
                ("SEGMENT", "") => {
                    let mut face = [0, 1, 2, 3].map(|i| f.id(i));
                    if face[3] == 0 {
                        face[3] = face[2];
                    }
                    if face.contains(&0) {
                        f.fault(0, "three or four nodes", "complete the segment");
                    }
                    entries.push((Entry::Segment(face), false));
                }
                ("NODE" | "PART", "" | "LIST") => {
                    let each = (0..8).map(|i| f.id(i)).filter(|id| *id != 0);
                    entries.extend(each.map(|id| (Entry::Node(id), false)));
                }
                ("NODE" | "PART", "LIST_GENERATE" | "GENERATE") => {
                    for i in (0..8).step_by(2).filter(|i| !f.blank(*i)) {
                        let (first, last) = (f.id(i), f.id(i + 1));
                        if last < first || last - first >= MAX_RANGE {
                            f.fault(i + 1, "a last number not below the first", "correct the range");
                            continue;
                        }
                        entries.push((Entry::Range(first, last), false));
                    }
                }
                ("NODE" | "PART", "ADD") => {
                    let each = (0..8).map(|i| f.id(i)).filter(|id| *id != 0);
                    entries.extend(each.map(|id| (Entry::Set(id), false)));
                }
                (_, "GENERAL") => general(kind, &f, &mut entries),
                _ => {
                    let log = context.log;
                    let expected = "SET_NODE, SET_PART or SET_SEGMENT with LIST, GENERATE, GENERAL or ADD";
                    log.fault(
                        block.at,
                        format!("*{}", log.quote(&block.keyword)),
                        expected,
                        "list the members",
                    );
                    return;
                }
            }
        }
        let sets = match kind {
            "NODE" => &mut self.nodes,
            "PART" => &mut self.parts,
            _ => &mut self.segments,
        };
        match sets.entry(id) {
            std::collections::btree_map::Entry::Occupied(mut known) if collected => {
                known.get_mut().1.extend(entries);
            }
            std::collections::btree_map::Entry::Occupied(known) => {
                let words = format!("set {id}");
                let expected = format!("a number that line {} does not have", known.get().0.line);
                context.log.fault(head.at, words, expected, "renumber one");
            }
            std::collections::btree_map::Entry::Vacant(place) => {
                place.insert((head.at, entries));
            }
        }
    }
}

/// A card of `_GENERAL`: a word, then numbers.
fn general(kind: &str, f: &Fields<'_>, entries: &mut Vec<(Entry, bool)>) {
    let word = f.words(0).to_ascii_uppercase();
    let (out, stem) = match word.strip_prefix('D') {
        Some(stem) => (true, stem),
        None => (false, word.as_str()),
    };
    let numbers = (1..8).map(|i| f.id(i)).filter(|id| *id != 0);
    match (kind, stem) {
        (_, "ALL") => entries.push((Entry::All, out)),
        ("NODE", "NODE") | ("PART", "PART") => entries.extend(numbers.map(|id| (Entry::Node(id), out))),
        ("NODE" | "SEGMENT", "PART") => entries.extend(numbers.map(|id| (Entry::Part(id), out))),
        ("NODE" | "SEGMENT", "BOX") => entries.extend(numbers.map(|id| (Entry::Box(id), out))),
        ("SEGMENT", "SEG") => {
            let mut face = [1, 2, 3, 4].map(|i| f.id(i));
            if face[3] == 0 {
                face[3] = face[2];
            }
            entries.push((Entry::Segment(face), out));
        }
        _ => f.fault(
            0,
            "ALL, NODE, PART, BOX, SEG or one of them after D",
            "list the members in one of these ways",
        ),
    }
}

/// Deepest nesting of sets of sets.
const MAX_DEPTH: usize = 20;

impl Problem {
    /// Nodes of a set, ascending.
    pub(super) fn node_set(&self, id: u32, by: Place, log: &Log) -> Vec<u32> {
        self.members(id, by, log, true, 0)
    }

    /// Parts of a set, ascending.
    pub(super) fn part_set(&self, id: u32, by: Place, log: &Log) -> Vec<u32> {
        self.members(id, by, log, false, 0)
    }

    fn members(&self, id: u32, by: Place, log: &Log, of_nodes: bool, depth: usize) -> Vec<u32> {
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
        if depth == MAX_DEPTH {
            log.fault(by, format!("set {id}"), "sets that do not hold themselves", "list the members");
            return Vec::new();
        }
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
                Entry::Part(part) => self.nodes_of_part(*part),
                Entry::Box(number) => {
                    let inside = self.within(*number, *at, log);
                    self.nodes.iter().filter(|n| inside(n.x)).map(|n| n.id).collect()
                }
                Entry::Set(other) => self.members(*other, *at, log, of_nodes, depth + 1),
                Entry::Segment(_) => Vec::new(),
            };
            found.sort_unstable();
            if *out {
                members.retain(|id| found.binary_search(id).is_err());
            } else {
                members.append(&mut found);
            }
        }
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
    pub(super) fn segment_set(&self, id: u32, by: Place, log: &Log) -> Vec<[u32; 4]> {
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

    /// Nodes of the elements of a part, ascending.
    pub(super) fn nodes_of_part(&self, part: u32) -> Vec<u32> {
        let solids = self.solids.iter().filter(|e| e.part == part).flat_map(|e| e.nodes);
        let shells = self.shells.iter().filter(|e| e.part == part).flat_map(|e| e.nodes);
        let mut nodes: Vec<u32> = solids.chain(shells).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Whether a point lies in a box, with its sides.
    pub(super) fn within(&self, number: u32, by: Place, log: &Log) -> impl Fn([f64; 3]) -> bool + use<> {
        let bounds = self.boxes.get(&number).copied();
        if bounds.is_none() {
            log.fault(by, format!("box {number}"), "a *DEFINE_BOX of the deck", "define it, or name another");
        }
        let [low, high] = bounds.unwrap_or_default();
        move |x| (0..3).all(|a| (low[a]..=high[a]).contains(&x[a]))
    }
}
