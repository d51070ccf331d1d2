//! Node-face pairs as lists of batch nodes, the form in which lanes gather them. What is in the lists is written here
//! alone, so that their highest index is known.

use crate::lanes::{SET, Width};

/// Pairs by batch node indices. All lists are equally long.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    node: Vec<u32>,
    corners: [Vec<u32>; 4],
    /// No index is higher.
    highest: u32,
}

impl Pairs {
    /// The node of each pair.
    pub(super) fn node(&self) -> &[u32] {
        &self.node
    }

    /// The corners of the face of each pair.
    pub(super) fn corners(&self) -> &[Vec<u32>; 4] {
        &self.corners
    }

    pub(super) fn clear(&mut self) {
        self.node.clear();
        self.corners.iter_mut().for_each(Vec::clear);
        self.highest = 0;
    }

    pub(super) fn reserve(&mut self, n: usize) {
        self.node.reserve(n);
        self.corners.iter_mut().for_each(|list| list.reserve(n));
    }

    /// Appends each of `nodes` with its faces among `listed`, which begin and end where `starts` says; `faces` gives
    /// batch nodes. The last is repeated until lane sets are full.
    pub(super) fn extend(&mut self, nodes: &[u32], starts: &[u32], listed: &[u32], faces: &[[u32; 4]]) {
        for (&node, bounds) in nodes.iter().zip(starts.windows(2)) {
            for &face in &listed[bounds[0] as usize..bounds[1] as usize] {
                let corners = faces[face as usize];
                self.node.push(node);
                self.corners.iter_mut().zip(corners).for_each(|(list, corner)| list.push(corner));
                let [a, b, c, d] = corners;
                self.highest = self.highest.max(node).max(a.max(b)).max(c.max(d));
            }
        }
        self.fill_up();
    }

    /// The pairs of another list, from `first` on, at `indices`; the last is repeated until lane sets are full.
    #[inline(always)]
    pub(super) fn choose(&mut self, from: &Pairs, first: usize, indices: &[u32]) {
        let lists =
            std::iter::once((&mut self.node, &from.node)).chain(self.corners.iter_mut().zip(&from.corners));
        for (list, from) in lists {
            let from = &from[first..];
            list.clear();
            list.extend(indices.iter().map(|&i| from[i as usize]));
        }
        self.highest = from.highest;
        self.fill_up();
    }

    fn fill_up(&mut self) {
        for list in std::iter::once(&mut self.node).chain(&mut self.corners) {
            let last = list.last().copied().unwrap_or(0);
            list.resize(list.len().next_multiple_of(SET), last);
        }
    }

    /// What lanes rely on: whole sets of valid indices, on a machine that has the width.
    ///
    /// # Panics
    /// If that is not so.
    pub(super) fn check(&self, width: Width, x: &[Vec<f64>; 3]) {
        self.check_nodes(width, x.iter().map(Vec::len).min().unwrap_or(0));
    }

    /// [`Pairs::check`] for arrays of `n_nodes`.
    ///
    /// # Panics
    /// As there.
    pub(super) fn check_nodes(&self, width: Width, n_nodes: usize) {
        assert!(width.available(), "lane width {width} on a machine that lacks it");
        assert!(self.node.len().is_multiple_of(SET), "{} pairs in sets of {SET}", self.node.len());
        let n = n_nodes.min(1 << 31);
        for list in &self.corners {
            assert!(list.len() == self.node.len(), "{} indices of {} pairs", list.len(), self.node.len());
        }
        assert!(self.node.is_empty() || (self.highest as usize) < n, "node {} of {n}", self.highest);
    }
}
