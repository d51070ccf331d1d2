//! Nodes that other workers bring.

use crate::{
    lanes::Width,
    nodes::{Advance, NodeSet, Nodes},
    wall::WallVote,
};

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
    /// Ghost and its place in the exchange.
    pub exchanged: Vec<[u32; 2]>,
}

impl Ghosts {
    /// Integrates them. What they give walls goes to `unbooked`: their owners book it.
    pub fn integrate(&mut self, advance: &Advance<'_>, unbooked: &mut [WallVote], width: Width) {
        let mut nodes = Nodes {
            x: &mut self.x,
            v: &mut self.v,
            f: &mut self.f,
            mass: &self.mass,
            constraint: &self.constraint,
            sets: &self.sets,
            reference: &Default::default(),
            walls: unbooked,
        };
        advance.run(&mut nodes, width);
    }
}
