//! Near node-face pairs as lists of batch nodes, the form in which lanes gather them. What is in the lists is written here
//! alone, so that their highest index is known.

use super::slots::Slots;
use crate::lanes::{SET, Width};

/// Pairs by batch node indices. All lists are equally long.
#[derive(Clone, Debug, Default)]
pub(super) struct NearPairs {
    node: Vec<u32>,
    corners: [Vec<u32>; 4],
    /// No index is higher.
    highest: u32,
}

impl NearPairs {
    pub(super) fn node(&self) -> &[u32] {
        &self.node
    }

    /// The corners of the face of each pair.
    pub(super) fn corners(&self) -> &[Vec<u32>; 4] {
        &self.corners
    }

    /// Room for so many pairs in all.
    pub(super) fn reserve(&mut self, n: usize) {
        for list in std::iter::once(&mut self.node).chain(&mut self.corners) {
            list.reserve(n.saturating_sub(list.len()));
        }
    }

    pub(super) fn clear(&mut self) {
        self.node.clear();
        self.corners.iter_mut().for_each(Vec::clear);
        self.highest = 0;
    }

    /// Appends the pair of lane `node` of sets and lane `face` of their slots.
    #[inline(always)]
    pub(super) fn push(&mut self, from: &Slots, node: usize, face: usize) {
        self.node.push(from.node()[node]);
        for (list, from) in self.corners.iter_mut().zip(from.corners()) {
            list.push(from[face]);
        }
        self.highest = from.highest();
    }

    /// Of sets of nodes the lanes `node` and of their slots the lanes `face`, which count from `base` on; the last is repeated
    /// until lane sets are full.
    #[inline(always)]
    pub(super) fn choose(&mut self, from: &Slots, node: &[u32], base: usize, face: &[u32]) {
        self.node.clear();
        self.node.extend(node.iter().map(|&lane| from.node()[lane as usize]));
        for (list, from) in self.corners.iter_mut().zip(from.corners()) {
            list.clear();
            list.extend(face.iter().map(|&lane| from[base + lane as usize]));
        }
        self.highest = from.highest();
        self.fill_up();
    }

    /// Repeats the last pair until lane sets are full.
    pub(super) fn fill_up(&mut self) {
        for list in std::iter::once(&mut self.node).chain(&mut self.corners) {
            let last = list.last().copied().unwrap_or(0);
            list.resize(list.len().next_multiple_of(SET), last);
        }
    }

    /// What lanes rely on: whole sets of indices of arrays of `n_nodes`, on a machine that has the width.
    ///
    /// # Panics
    /// If that is not so.
    pub(super) fn check(&self, width: Width, n_nodes: usize) {
        assert!(width.available(), "lane width {width} on a machine that lacks it");
        assert!(self.node.len().is_multiple_of(SET), "{} pairs in sets of {SET}", self.node.len());
        let n = n_nodes.min(1 << 31);
        for list in &self.corners {
            assert!(list.len() == self.node.len(), "{} indices of {} pairs", list.len(), self.node.len());
        }
        assert!(self.node.is_empty() || (self.highest as usize) < n, "node {} of {n}", self.highest);
    }
}
