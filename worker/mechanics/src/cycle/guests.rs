//! Nodes that contact and other workers bring: packed contact nodes, and guests.

use super::{NONE, room::Room};
use crate::{contact::Contact, nodes::NodeSet};

/// Contact nodes, packed, and where their positions come from.
pub(super) struct ContactRoom {
    pub contact: Contact,
    /// (block, local node), or (NONE, guest).
    pub sources: Vec<(u32, u32)>,
    pub x: [Vec<f64>; 3],
    pub v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
}

/// Guests by index.
#[derive(Default)]
pub(super) struct Guests {
    pub node: Vec<u32>,
    pub x: [Vec<f64>; 3],
    pub v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
    pub mass: Vec<f64>,
    pub constraint: Vec<u16>,
    pub sets: Vec<NodeSet>,
}

impl ContactRoom {
    /// Brings positions, and velocities if contact reads them, to those of now.
    pub fn pack(&mut self, rooms: &[Room], guests: &Guests) {
        pack(&self.sources, |room| positions(rooms, guests, room), &mut self.x);
        if self.contact.reads_velocities() {
            pack(&self.sources, |room| velocities(rooms, guests, room), &mut self.v);
        }
    }
}

/// Positions of the nodes of a block, or of the guests.
pub(super) fn positions<'a>(rooms: &'a [Room], guests: &'a Guests, room: u32) -> &'a [Vec<f64>; 3] {
    if room == NONE { &guests.x } else { &rooms[room as usize].block.x }
}

/// Velocities of the nodes of a block, or of the guests.
fn velocities<'a>(rooms: &'a [Room], guests: &'a Guests, room: u32) -> &'a [Vec<f64>; 3] {
    if room == NONE { &guests.v } else { &rooms[room as usize].block.v }
}

/// Packs what `from` gives by block, node by node.
pub(super) fn pack<'a>(
    sources: &[(u32, u32)],
    from: impl Fn(u32) -> &'a [Vec<f64>; 3],
    to: &mut [Vec<f64>; 3],
) {
    for (i, &(room, local)) in sources.iter().enumerate() {
        let from = from(room);
        for a in 0..3 {
            to[a][i] = from[a][local as usize];
        }
    }
}
