//! Nodes that other workers bring.

use crate::{
    flip::Target,
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
    /// The numbers of this target, for tests that flip bits in them.
    pub fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        let arrays = match target {
            Target::Positions => self.x.as_mut_slice(),
            Target::Velocities => &mut self.v,
            Target::Forces => &mut self.f,
            Target::Constants => std::slice::from_mut(&mut self.mass),
            Target::History => &mut self.contact_history,
            _ => &mut [],
        };
        arrays.iter_mut().map(Vec::as_mut_slice).collect()
    }

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
