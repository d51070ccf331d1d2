//! Nodes that contact and other workers bring: packed contact nodes, and ghosts.

use super::{NONE, held_block::HeldBlock};
use crate::{contact::Contact, nodes::NodeSet};

/// Contact nodes, packed, and where their positions come from.
pub(super) struct HeldContact {
    pub contact: Contact,
    /// (block, local node), or (NONE, ghost).
    pub sources: Vec<(u32, u32)>,
    pub x: [Vec<f64>; 3],
    pub v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
    /// Every copy here of the nodes that do not travel: contact node, block, local node. Those take its history from contact. None where
    /// contact keeps nothing.
    pub keepers: Vec<[u32; 3]>,
}

/// Ghosts by index.
#[derive(Default)]
pub(super) struct Ghosts {
    pub node: Vec<u32>,
    pub x: [Vec<f64>; 3],
    pub v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
    pub mass: Vec<f64>,
    /// What contact keeps of each, by number.
    pub contact_history: Vec<Vec<f64>>,
    pub constraint: Vec<u16>,
    pub sets: Vec<NodeSet>,
}

impl HeldContact {
    /// Brings positions, histories, and velocities if contact reads them, to those of now.
    pub fn pack(&mut self, held_blocks: &[HeldBlock], ghosts: &Ghosts) {
        pack(&self.sources, |held_block| positions(held_blocks, ghosts, held_block), &mut self.x);
        if self.contact.reads_velocities() {
            pack(&self.sources, |held_block| velocities(held_blocks, ghosts, held_block), &mut self.v);
        }
        if self.contact.history.is_empty() {
            return;
        }
        for (node, &(held_block, local)) in self.sources.iter().enumerate() {
            let from = if held_block == NONE {
                &ghosts.contact_history
            } else {
                &held_blocks[held_block as usize].contact_history
            };
            for (to, from) in self.contact.history.before_mut(node).iter_mut().zip(from) {
                *to = from[local as usize];
            }
        }
    }

    /// Gives the nodes that do not travel the histories that the forces left.
    pub fn keep(&self, held_blocks: &mut [HeldBlock]) {
        for &[node, held_block, local] in &self.keepers {
            let numbers = &mut held_blocks[held_block as usize].contact_history;
            for (to, from) in numbers.iter_mut().zip(self.contact.history.after(node as usize)) {
                to[local as usize] = *from;
            }
        }
    }
}

/// Positions of the nodes of a block, or of the ghosts.
pub(super) fn positions<'a>(
    held_blocks: &'a [HeldBlock],
    ghosts: &'a Ghosts,
    held_block: u32,
) -> &'a [Vec<f64>; 3] {
    if held_block == NONE { &ghosts.x } else { &held_blocks[held_block as usize].block.x }
}

/// Velocities of the nodes of a block, or of the ghosts.
fn velocities<'a>(held_blocks: &'a [HeldBlock], ghosts: &'a Ghosts, held_block: u32) -> &'a [Vec<f64>; 3] {
    if held_block == NONE { &ghosts.v } else { &held_blocks[held_block as usize].block.v }
}

/// Packs what `from` gives by block, node by node.
pub(super) fn pack<'a>(
    sources: &[(u32, u32)],
    from: impl Fn(u32) -> &'a [Vec<f64>; 3],
    to: &mut [Vec<f64>; 3],
) {
    for (i, &(held_block, local)) in sources.iter().enumerate() {
        let from = from(held_block);
        for a in 0..3 {
            to[a][i] = from[a][local as usize];
        }
    }
}
