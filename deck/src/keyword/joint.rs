//! `*CONSTRAINED_JOINT_...`: two rigid bodies by pairs of their nodes.

use mechanics::joint::Kind;

use super::{
    cards::{Block, Card},
    fields::{Context, TENS},
};
use crate::place::Place;

/// A joint as its cards have it.
pub(super) struct JointCard {
    pub(super) at: Place,
    pub(super) kind: Kind,
    /// Its heading, or else its number.
    pub(super) name: Option<String>,
    /// Those of the first body at odd numbers, of the second at even ones, counted from 1.
    pub(super) nodes: [u32; 6],
}

/// The words behind `CONSTRAINED_JOINT_`, and how many nodes each needs.
const KINDS: [(&str, Kind, usize); 7] = [
    ("SPHERICAL", Kind::Spherical, 2),
    ("UNIVERSAL", Kind::Universal, 4),
    ("REVOLUTE", Kind::Revolute, 4),
    ("CYLINDRICAL", Kind::Cylindrical, 4),
    ("TRANSLATIONAL", Kind::Translational, 4),
    ("PLANAR", Kind::Planar, 4),
    ("LOCKING", Kind::Fixed, 2),
];

/// The kind of a keyword, and which of the suffixes `_ID`, `_LOCAL`, `_FAILURE` it has.
fn known(word: &str) -> Option<((Kind, usize), [bool; 3])> {
    let mut words = word.strip_prefix("CONSTRAINED_JOINT_")?.split('_');
    let first = words.next()?;
    let (_, kind, n_nodes) = KINDS.into_iter().find(|(name, ..)| *name == first)?;
    let mut suffixes = [false; 3];
    for suffix in words {
        let at = ["ID", "LOCAL", "FAILURE"].iter().position(|known| *known == suffix)?;
        suffixes[at] = true;
    }
    Some(((kind, n_nodes), suffixes))
}

/// Whether a keyword is read here.
pub(super) fn knows(word: &str) -> bool {
    known(word).is_some()
}

pub(super) fn read(joints: &mut Vec<JointCard>, block: &Block<'_>, context: &Context<'_>) {
    let Some(((kind, n_nodes), [named, local, fails])) = known(&block.keyword) else { return };
    if fails {
        context.log.fault(
            block.at,
            format!("*{}", block.keyword),
            "a joint that holds",
            "take _FAILURE and its cards out",
        );
        return;
    }
    let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
    while let Some(mut card) = cards.next() {
        let mut name = None;
        if named {
            let heading = context.fields(card, block.width, &[10, 70]);
            let words = heading.words(1);
            name = Some(if words.is_empty() { heading.words(0) } else { words }.to_string());
            match cards.next() {
                Some(next) => card = next,
                None => break,
            }
        }
        let f = context.fields(card, block.width, &TENS);
        if local {
            // Where forces are written in axes of its own, which are in those of space here.
            cards.next().into_iter().for_each(Card::mark);
        }
        let nodes = [0, 1, 2, 3, 4, 5].map(|i| f.id(i));
        match nodes[..n_nodes].iter().position(|node| *node == 0) {
            Some(i) => f.fault(i, format!("{n_nodes} nodes of a joint of this kind"), "give their numbers"),
            None => joints.push(JointCard { at: f.at, kind, name, nodes }),
        }
    }
}
