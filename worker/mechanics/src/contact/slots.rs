//! Nodes in sets, each with the faces that it watches: the form in which lanes go through pairs.
//!
//! A lane is a node. Eight nodes make a *set*; *slot* `k` of a set holds the `k`-th face of each of them, so what is
//! reduced over the faces of a node never leaves its lane. A node with fewer faces than others of its set repeats its
//! last; how many are its own is written beside. What is in the lists is written here alone, so that their highest
//! index is known.

use std::ops::Range;

use super::search::Candidates;
use crate::lanes::{SET, Width};

/// Sets of nodes and the slots of their faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Slots {
    /// By lane of each set: batch node. The last set repeats the last node until it is full.
    node: Vec<u32>,
    /// By lane of each set: faces of the node, none for one that is repeated.
    count: Vec<u32>,
    /// Where the slots of each set begin, and where the last ends.
    starts: Vec<u32>,
    /// By lane of each slot: index of the face.
    face: Vec<u32>,
    /// By lane of each slot: batch nodes of the face.
    corners: [Vec<u32>; 4],
    /// No node is higher.
    highest: u32,
}

impl Slots {
    /// Room for as many nodes and slots.
    pub(super) fn reserve(&mut self, n_nodes: usize, n_slots: usize) {
        let n_lanes = n_nodes.next_multiple_of(SET);
        self.node.reserve(n_lanes);
        self.count.reserve(n_lanes);
        self.starts.reserve(n_lanes / SET + 1);
        self.face.reserve(SET * n_slots);
        self.corners.iter_mut().for_each(|list| list.reserve(SET * n_slots));
    }

    /// Takes the pairs of a list anew; `faces` gives batch nodes.
    pub(super) fn take(&mut self, pairs: &Candidates, faces: &[[u32; 4]]) {
        self.node.clear();
        self.count.clear();
        self.starts.clear();
        self.face.clear();
        self.corners.iter_mut().for_each(Vec::clear);
        self.highest = 0;
        self.starts.push(0);
        for (set, nodes) in pairs.nodes.chunks(SET).enumerate() {
            let starts = &pairs.starts[SET * set..=SET * set + nodes.len()];
            let last = nodes[nodes.len() - 1];
            let mut most = 0;
            for lane in 0..SET {
                let count = if lane < nodes.len() { starts[lane + 1] - starts[lane] } else { 0 };
                self.node.push(nodes.get(lane).copied().unwrap_or(last));
                self.count.push(count);
                most = most.max(count);
            }
            for slot in 0..most {
                for lane in 0..SET {
                    // A node is listed with one face at least.
                    let own = lane.min(nodes.len() - 1);
                    let place = (starts[own] + slot).min(starts[own + 1] - 1);
                    let face = pairs.faces[place as usize];
                    self.face.push(face);
                    let corners = faces[face as usize];
                    self.corners.iter_mut().zip(corners).for_each(|(list, corner)| list.push(corner));
                    let [a, b, c, d] = corners;
                    self.highest = self.highest.max(a.max(b)).max(c.max(d));
                }
            }
            self.highest = nodes.iter().fold(self.highest, |highest, &node| highest.max(node));
            self.starts.push((self.face.len() / SET) as u32);
        }
    }

    pub(super) fn n_sets(&self) -> usize {
        self.node.len() / SET
    }

    pub(super) fn of_sets(&self, sets: &Range<usize>) -> Range<usize> {
        self.starts[sets.start] as usize..self.starts[sets.end] as usize
    }

    /// By lane of each set: batch node.
    pub(super) fn node(&self) -> &[u32] {
        &self.node
    }

    /// By lane of each set: faces of the node.
    pub(super) fn count(&self) -> &[u32] {
        &self.count
    }

    /// By lane of each slot: index of the face.
    pub(super) fn face(&self) -> &[u32] {
        &self.face
    }

    /// By lane of each slot: batch nodes of the face.
    pub(super) fn corners(&self) -> &[Vec<u32>; 4] {
        &self.corners
    }

    /// The highest batch node of the lists.
    pub(super) fn highest(&self) -> u32 {
        self.highest
    }

    /// What lanes rely on: whole sets of valid indices below 2^31, on a machine that has the width.
    ///
    /// # Panics
    /// If that is not so.
    pub(super) fn check(&self, width: Width, n_nodes: usize) {
        assert!(width.available(), "lane width {width} on a machine that lacks it");
        let n_sets = self.n_sets();
        assert!(self.node.len() == SET * n_sets && self.count.len() == SET * n_sets, "{n_sets} sets");
        let n_slots = self.starts.get(n_sets).map_or(0, |&end| end as usize);
        assert!(self.face.len() == SET * n_slots, "{} faces in {n_slots} slots", self.face.len());
        for list in &self.corners {
            assert!(list.len() == SET * n_slots, "{} corners in {n_slots} slots", list.len());
        }
        let n = n_nodes.min(1 << 31);
        assert!(n_sets == 0 || (self.highest as usize) < n, "node {} of {n}", self.highest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_is_in_its_nodes_lane_and_what_is_left_over_repeats() {
        let faces: Vec<[u32; 4]> = (0..9).map(|f| [4 * f, 4 * f + 1, 4 * f + 2, 4 * f + 3]).collect();
        let counts = [1, 3, 2, 1, 1, 4, 1, 1, 2, 1];
        let mut pairs = Candidates { nodes: (50..60).collect(), starts: vec![0], faces: vec![] };
        for (i, &count) in counts.iter().enumerate() {
            pairs.faces.extend((0..count).map(|k| (i as u32 + k) % 9));
            pairs.starts.push(pairs.faces.len() as u32);
        }
        let mut slots = Slots::default();
        // A second taking leaves nothing of the first.
        slots.take(&pairs, &faces);
        slots.take(&pairs, &faces);
        slots.check(Width::Scalar, 60);
        assert_eq!((slots.n_sets(), slots.of_sets(&(0..1)), slots.of_sets(&(1..2))), (2, 0..4, 4..6));
        let mut found = Vec::new();
        for set in 0..2 {
            for slot in slots.of_sets(&(set..set + 1)) {
                for lane in 0..SET {
                    let (at, of_set) = (SET * slot + lane, SET * set + lane);
                    let corners = [0, 1, 2, 3].map(|c| slots.corners()[c][at]);
                    assert_eq!(corners, faces[slots.face()[at] as usize]);
                    if ((slot - slots.of_sets(&(set..set + 1)).start) as u32) < slots.count()[of_set] {
                        found.push((slots.node()[of_set], slots.face()[at]));
                    }
                }
            }
        }
        found.sort_by_key(|&(node, _)| node);
        let of = |i: usize| pairs.starts[i] as usize..pairs.starts[i + 1] as usize;
        let wanted: Vec<(u32, u32)> =
            (0..10).flat_map(|i| pairs.faces[of(i)].iter().map(move |&face| (50 + i as u32, face))).collect();
        assert_eq!(found, wanted);
        assert_eq!(slots.node()[10..], [59; 6]);
    }

    #[test]
    #[should_panic(expected = "node 59 of 59")]
    fn a_node_beyond_the_arrays_is_refused() {
        let pairs = Candidates { nodes: vec![59], starts: vec![0, 1], faces: vec![0] };
        let mut slots = Slots::default();
        slots.take(&pairs, &[[0, 1, 2, 3]]);
        slots.check(Width::Scalar, 59);
    }
}
