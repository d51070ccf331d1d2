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
}

/// Ghosts by index.
#[derive(Default)]
pub(super) struct Ghosts {
    pub node: Vec<u32>,
    pub x: [Vec<f64>; 3],
    pub v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
    pub mass: Vec<f64>,
    pub constraint: Vec<u16>,
    pub sets: Vec<NodeSet>,
}

impl HeldContact {
    /// Brings positions, and velocities if contact reads them, to those of now.
    pub fn pack(&mut self, held_blocks: &[HeldBlock], ghosts: &Ghosts) {
        pack(&self.sources, |held_block| positions(held_blocks, ghosts, held_block), &mut self.x);
        if self.contact.reads_velocities() {
            pack(&self.sources, |held_block| velocities(held_blocks, ghosts, held_block), &mut self.v);
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
