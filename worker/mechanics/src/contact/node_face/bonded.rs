//! Nodes that a tie holds on faces until it breaks, where the parts of both meet: contact does not push them while it holds, and
//! afterwards they are nodes like others.
//!
//! A tied node lies on its face, a whole gap deep in the zone. Its depth counts from an *offset*: its depth while the tie holds, at most that
//! afterwards. So it begins without force where it is let go, resists being pushed in from there, and once it has left the zone the offset is gone.
//!
//! A node on the rim of a body is pressed in behind the face to which it was tied and, as soon as it is a little within the rim, behind the face beside
//! it. Of faces in front of a node each pushes; of those behind which it lies only the nearest does, and what pushes about the same way, so
//! that the push begins from nothing wherever the node comes in.

use super::{NodeFace, Work};
use crate::contact::{Settings, batch::Batch, history::History, zone::dot};

/// No part.
const NONE: u32 = u32::MAX;
/// Depths within this share of the gap of each other are equal: on a plane of symmetry faces on both sides of it push.
const EQUAL: f64 = 1e-9;
/// Cosine from which on two faces push the same way and share the push.
const SAME_WAY: f64 = 0.5;

/// The bonded nodes of a batch.
#[derive(Clone, Debug, Default)]
pub(super) struct Bonded {
    /// By batch node, the part to whose faces it is tied, or [`NONE`]; empty where no node is.
    to: Vec<u32>,
    /// Where the numbers begin among those of a node: whether the tie holds, the offset.
    first: usize,
}

impl Bonded {
    pub(super) fn of(batch: &Batch, settings: &Settings) -> Self {
        if !settings.ties_break {
            return Self::default();
        }
        let to: Vec<u32> =
            batch.nodes.iter().map(|node| settings.bonded_to(node.global).unwrap_or(NONE)).collect();
        if to.iter().all(|&part| part == NONE) {
            return Self::default();
        }
        Self { to, first: settings.first_of_bond() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.to.is_empty()
    }
}

impl NodeFace {
    /// Takes the offsets of bonded nodes off the depths of the first `n` pushes, and leaves them in the history. The pushes of a node
    /// follow each other.
    #[inline(never)]
    pub(super) fn take_bonded(&self, n: usize, work: &mut Work, history: &mut History) {
        let (nodes, directions) = (work.near_pairs.node(), &work.approach.direction);
        let depths = &mut work.approach.depth;
        let mut end = 0;
        while end < n {
            let (first, node) = (end, nodes[end] as usize);
            while end < n && nodes[end] as usize == node {
                end += 1;
            }
            let part = self.bonded.to[node];
            if part == NONE {
                continue;
            }
            let on_part = |i: &usize| self.parts[work.face[*i] as usize] == part;
            let behind = |i: &usize| on_part(i) && depths[*i] > self.settings.gap;
            let nearest = (first..end).filter(behind).min_by(|&i, &j| depths[i].total_cmp(&depths[j]));
            if let Some(nearest) = nearest {
                let direction = |i: usize| directions.each_ref().map(|along| along[i]);
                let least = depths[nearest] + EQUAL * self.settings.gap;
                let others =
                    |&i: &usize| depths[i] > least && dot(direction(i), direction(nearest)) < SAME_WAY;
                let dropped: Vec<usize> = (first..end).filter(behind).filter(others).collect();
                dropped.into_iter().for_each(|i| depths[i] = 0.0);
            }
            let mut deepest = 0.0_f64;
            for i in (first..end).filter(on_part) {
                deepest = if depths[i] > deepest { depths[i] } else { deepest };
            }
            if deepest <= 0.0 {
                continue;
            }
            let at = self.bonded.first;
            let (holds, before) = (history.before(node)[at] != 0.0, history.before(node)[at + 1]);
            let offset = if holds { deepest } else { before.min(deepest) };
            history.after_mut(node)[at + 1] = offset;
            for i in (first..end).filter(on_part) {
                depths[i] = if depths[i] > offset { depths[i] - offset } else { 0.0 };
            }
        }
    }
}
