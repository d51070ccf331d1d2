//! Nodes inside a zone that they never entered: where parts erode, a face comes out from under an eroded element while nodes are near
//! it, and the faces around an edge leave one by one, so that the side on which a node lies turns over.
//!
//! A spring that begins at its full depth would push with energy that nobody has put in. So
//! - a node further in than the gap, behind the face, feels no force: a contact that began outside is stopped before that;
//! - a node that is in a zone without having entered it starts there without force. Its depth counts from an *offset*, which falls
//!   with the depth and is gone when the node has left.
//!
//! A node has not entered a zone if it or the face came out in this cycle, if it was behind a face in the last one, or if its depth grew by
//! more than two nodes can travel. The history of a node is its offset and the depth of the last cycle, of the deepest of its hits.

use super::{NodeFace, Work};
use crate::contact::{batch::Batch, history::History, surface::Exposed};

/// How much a depth may grow in a cycle (gaps): twice what a node may travel, and a little for the turn of the face.
const GROWTH: f64 = 0.45;

/// Depth in the history of a node behind a face (length): no depth is negative.
const BEHIND: f64 = -1.0;

/// What of a batch came out last.
#[derive(Clone, Debug, Default)]
pub(super) struct CameOut {
    /// In this cycle.
    at: u64,
    /// By batch node.
    nodes: Vec<bool>,
    /// By active face.
    faces: Vec<bool>,
}

impl CameOut {
    /// Of a batch whose active faces have these ids, ascending.
    pub(super) fn of(batch: &Batch, ids: &[u32]) -> Self {
        let Exposed { at, nodes, faces, .. } = &batch.listed.exposed;
        let mut of_nodes = vec![false; batch.nodes.len()];
        nodes.iter().for_each(|&node| of_nodes[node as usize] = true);
        Self {
            at: *at,
            nodes: of_nodes,
            faces: ids.iter().map(|id| faces.binary_search(id).is_ok()).collect(),
        }
    }
}

impl NodeFace {
    /// Takes the offsets off the depths of the first `n` pushes, and writes the history of their nodes. The pushes of a node
    /// follow each other.
    #[inline(always)]
    pub(super) fn take_offsets(&self, n: usize, work: &mut Work, history: &mut History) {
        let gap = self.settings.gap;
        let (nodes, depths) = (work.near_pairs.node(), &mut work.approach.depth);
        let comes_out = !history.is_empty() && history.cycle == self.came_out.at;
        let mut end = 0;
        while end < n {
            let (first, node) = (end, nodes[end] as usize);
            let (mut deepest, mut behind) = (0.0_f64, false);
            let mut came_out = comes_out && self.came_out.nodes[node];
            while end < n && nodes[end] as usize == node {
                let depth = depths[end];
                if depth > gap {
                    behind = true;
                    depths[end] = 0.0;
                } else if depth > 0.0 {
                    deepest = if depth > deepest { depth } else { deepest };
                    came_out |= comes_out && self.came_out.faces[work.face[end] as usize];
                }
                end += 1;
            }
            if history.is_empty() || (deepest <= 0.0 && !behind) {
                continue;
            }
            if deepest <= 0.0 {
                history.after_mut(node)[1] = BEHIND;
                continue;
            }
            let (offset, before) = (history.before(node)[0], history.before(node)[1]);
            let pressed = if before > offset { before - offset } else { 0.0 };
            let entered = !came_out && before >= 0.0 && deepest <= GROWTH.mul_add(gap, before);
            let offset = if entered { offset.min(deepest) } else { offset.max(deepest - pressed) };
            let after = history.after_mut(node);
            (after[0], after[1]) = (offset, deepest);
            for depth in &mut depths[first..end] {
                *depth = if *depth > offset { *depth - offset } else { 0.0 };
            }
        }
    }
}
