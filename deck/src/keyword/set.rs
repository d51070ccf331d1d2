//! `*SET_`: nodes, parts and segments by number, and what other keywords take from them.

use std::collections::BTreeMap;

use super::{
    cards::Block,
    fields::{Context, Fields, TENS},
};
use crate::place::Place;

/// One entry of a set; that of elements and parts is [`Entry::Node`], too.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    All,
    Node(u32),
    Range(u32, u32),
    /// From the first to the last in steps.
    Steps(u32, u32, u32),
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
    /// Of solids, shells and beams.
    pub(super) elements: [BTreeMap<u32, Described>; 3],
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
            "SOLID" | "SHELL" | "BEAM"
                if matches!(
                    way,
                    "" | "LIST" | "LIST_GENERATE" | "LIST_GENERATE_INCREMENT" | "GENERATE" | "GENERAL"
                ) =>
            {
                kind
            }
            _ => {
                // What would use it names other sets.
                block.ignore(context.log);
                return;
            }
        };
        let head = block.card(0);
        let id = context.fields(head, block.width, &TENS).id(0);
        let mut entries = Vec::new();
        for card in block.cards.iter().skip(1) {
            let f = context.fields(card, block.width, &TENS);
            if f.beyond_eight() > 0
                && kind != "SEGMENT"
                && !matches!(way, "COLUMN" | "LIST_GENERATE_INCREMENT")
            {
                f.fault(8, "at most eight numbers on a card of a set", "put the others on further cards");
            }
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
                ("NODE" | "PART" | "SOLID" | "SHELL" | "BEAM", "" | "LIST") => {
                    let each = (0..8).map(|i| f.id(i)).filter(|id| *id != 0);
                    entries.extend(each.map(|id| (Entry::Node(id), false)));
                }
                ("NODE" | "PART" | "SOLID" | "SHELL" | "BEAM", "LIST_GENERATE" | "GENERATE") => {
                    for i in (0..8).step_by(2).filter(|i| !f.blank(*i)) {
                        let (first, last) = (f.id(i), f.id(i + 1));
                        if last < first {
                            f.fault(i + 1, "a last number not below the first", "correct the range");
                            continue;
                        }
                        entries.push((Entry::Range(first, last), false));
                    }
                }
                ("NODE" | "PART" | "SOLID" | "SHELL" | "BEAM", "LIST_GENERATE_INCREMENT") => {
                    let [first, last, step] = [0, 1, 2].map(|i| f.id(i));
                    if last < first || step == 0 {
                        f.fault(
                            1,
                            "a last number not below the first, and a step above 0",
                            "correct the range",
                        );
                        continue;
                    }
                    entries.push((Entry::Steps(first, last, step), false));
                }
                // What stands behind the number is used by keywords that are not read.
                ("NODE" | "PART", "COLUMN") => {
                    entries.extend(Some(f.id(0)).filter(|id| *id != 0).map(|id| (Entry::Node(id), false)));
                }
                ("NODE" | "PART", "ADD") => {
                    let each = (0..8).map(|i| f.id(i)).filter(|id| *id != 0);
                    entries.extend(each.map(|id| (Entry::Set(id), false)));
                }
                (_, "GENERAL") => general(kind, &f, &mut entries),
                _ => {
                    let log = context.log;
                    let expected =
                        "SET_NODE, SET_PART or SET_SEGMENT with LIST, GENERATE, COLUMN, GENERAL or ADD";
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
            "SOLID" => &mut self.elements[0],
            "SHELL" => &mut self.elements[1],
            "BEAM" => &mut self.elements[2],
            _ => &mut self.segments,
        };
        match sets.entry(id) {
            std::collections::btree_map::Entry::Occupied(mut known) if collected => {
                known.get_mut().1.extend(entries);
            }
            std::collections::btree_map::Entry::Occupied(known) => {
                let words = format!("set {id}");
                let line = context.log.line(known.get().0, head.at);
                let expected = format!("a number that {line} does not have");
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
        ("SOLID" | "SHELL" | "BEAM", "ELEM") => entries.extend(numbers.map(|id| (Entry::Node(id), out))),
        ("SOLID" | "SHELL" | "BEAM", "PART") => entries.extend(numbers.map(|id| (Entry::Part(id), out))),
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
            "ALL, NODE, ELEM, PART, BOX, SEG or one of them after D",
            "list the members in one of these ways",
        ),
    }
}
