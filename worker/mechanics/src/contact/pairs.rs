//! Node-face pairs as lists of batch nodes, the form in which lanes gather them.

use crate::lanes::{SET, Width};

/// Pairs by batch node indices. All lists are equally long.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    pub(super) node: Vec<u32>,
    pub(super) corners: [Vec<u32>; 4],
}

impl Pairs {
    /// Room for `n` pairs, in whole lane sets; what they hold is for the caller to write.
    fn resize(&mut self, n: usize) {
        let n = n.next_multiple_of(SET);
        self.node.resize(n, 0);
        self.corners.iter_mut().for_each(|list| list.resize(n, 0));
    }

    /// Pairs each of `nodes` with its faces among `held`, up to its end in `ends`; `faces` gives batch nodes. The
    /// last is repeated until lane sets are full.
    #[inline(always)]
    pub(super) fn expand(&mut self, nodes: &[u32], ends: &[u32], held: &[u32], faces: &[[u32; 4]]) {
        self.resize(held.len());
        let mut start = 0;
        for (&node, &end) in nodes.iter().zip(ends) {
            self.node[start..end as usize].fill(node);
            start = end as usize;
        }
        let [a, b, c, d] = &mut self.corners;
        let lists = a.iter_mut().zip(b).zip(c.iter_mut().zip(d));
        for (((a, b), (c, d)), &face) in lists.zip(held) {
            [*a, *b, *c, *d] = faces[face as usize];
        }
        self.repeat_last(held.len());
    }

    /// The pairs of another list at `indices`; the last is repeated until lane sets are full.
    #[inline(always)]
    pub(super) fn choose(&mut self, from: &Pairs, indices: &[u32]) {
        self.resize(indices.len());
        let lists =
            std::iter::once((&mut self.node, &from.node)).chain(self.corners.iter_mut().zip(&from.corners));
        for (list, from) in lists {
            for (node, &i) in list.iter_mut().zip(indices) {
                *node = from[i as usize];
            }
        }
        self.repeat_last(indices.len());
    }

    #[inline(always)]
    fn repeat_last(&mut self, n: usize) {
        for list in std::iter::once(&mut self.node).chain(&mut self.corners) {
            let last = if n > 0 { list[n - 1] } else { 0 };
            list[n..].fill(last);
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
