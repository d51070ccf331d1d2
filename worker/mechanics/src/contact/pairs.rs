//! Node-face pairs as lists of batch nodes, the form in which lanes gather them.

use crate::lanes::{SET, Width};

/// Pairs by batch node indices. All lists are equally long.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    pub(super) node: Vec<u32>,
    pub(super) corners: [Vec<u32>; 4],
}

impl Pairs {
    pub(super) fn clear(&mut self) {
        self.node.clear();
        self.corners.iter_mut().for_each(Vec::clear);
    }

    #[inline(always)]
    pub(super) fn push(&mut self, node: u32, corners: [u32; 4]) {
        self.node.push(node);
        self.corners[0].push(corners[0]);
        self.corners[1].push(corners[1]);
        self.corners[2].push(corners[2]);
        self.corners[3].push(corners[3]);
    }

    /// Repeats the last pair until whole lane sets are full.
    pub(super) fn fill_up(&mut self) {
        let n = self.node.len().next_multiple_of(SET);
        for list in std::iter::once(&mut self.node).chain(&mut self.corners) {
            let last = list.last().copied().unwrap_or(0);
            list.resize(n, last);
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
        for list in std::iter::once(&self.node).chain(&self.corners) {
            assert!(list.len() == self.node.len(), "{} indices of {} pairs", list.len(), self.node.len());
            let highest = list.iter().fold(0, |highest, &i| if i > highest { i } else { highest });
            assert!(list.is_empty() || (highest as usize) < n, "node {highest} of {n}");
        }
    }
}
