//! A block of a domain with what stands beside it.

use std::{collections::VecDeque, ops::Range};

use super::{Meter, deal::deal};
use crate::{
    block::Block,
    cross_section::Cuts,
    element::{ElementVote, Step},
    erosion::{Eroding, PieceErosion},
    lanes::{SET, Width},
    load::face::{self, FaceVote, LoadedFace},
    material::Material,
    nodes::{Advance, Booked, NodeSet, Nodes},
    rigid::Push,
    setup::Setup,
    spin,
    wall::WallVote,
};

/// A block and what the domain keeps beside it.
pub(super) struct HeldBlock {
    pub block: Block,
    /// Its elements are those of a rigid body: they are not computed.
    pub is_rigid: bool,
    pub border: Vec<Range<u32>>,
    pub interior: Vec<Range<u32>>,
    /// Which nodes are held, booked and on the contact surface.
    pub sets: Vec<NodeSet>,
    /// Positions at the sort in force, eight for each set with nodes on the surface.
    pub reference: [Vec<f64>; 3],
    /// Those at gatherings whose sorts do not act yet, oldest first.
    pub gathered: VecDeque<[Vec<f64>; 3]>,
    pub vote: ElementVote,
    pub booked: Booked,
    /// Faces with loads, and what they said of the cycle.
    pub faces: Vec<LoadedFace>,
    pub face_vote: FaceVote,
    /// What booked nodes gave each wall.
    pub walls: Vec<WallVote>,
    /// Where the part erodes.
    pub eroding: Option<Eroding>,
    /// What cross-sections cut of it.
    pub cuts: Cuts,
    /// What contact keeps of each node, by number; no array where it keeps nothing.
    pub contact_history: Vec<Vec<f64>>,
    /// Its nodes with other holders.
    pub shared: SharedNodes,
    /// Its nodes of rigid bodies.
    pub led: Vec<Led>,
}

/// What a set of a kind of elements that turns its nodes costs, in sets of one that does not.
const TURNING: u64 = 2;

impl HeldBlock {
    /// Positions as of now of the sets with nodes on the surface.
    pub fn surface_positions(&self) -> [Vec<f64>; 3] {
        let touched = || (0..).zip(&self.sets).filter(|(_, set)| set.surface != 0);
        std::array::from_fn(|a| {
            touched().flat_map(|(set, _)| &self.block.x[a][set * SET..(set + 1) * SET]).copied().collect()
        })
    }

    /// Takes a copy of a node out of the sums and off the surface; true if it was the one that is booked. Reference positions
    /// of its set go with its last node on the surface.
    pub fn drop_node(&mut self, local: u32) -> bool {
        let (set, bit) = (local as usize / SET, 1 << (local as usize % SET));
        let booked = self.sets[set].booked & bit != 0;
        self.sets[set].booked &= !bit;
        let before = self.sets[set].surface;
        self.sets[set].surface &= !bit;
        if before != 0 && self.sets[set].surface == 0 {
            let at = SET * self.sets[..set].iter().filter(|set| set.surface != 0).count();
            for positions in std::iter::once(&mut self.reference).chain(&mut self.gathered) {
                for along in positions {
                    along.drain(at..at + SET);
                }
            }
        }
        booked
    }

    /// Which elements have eroded and how far the others are, where they can.
    pub fn erosion(&self) -> Option<PieceErosion> {
        self.eroding.as_ref().map(|eroding| eroding.state(&self.block))
    }

    /// What its elements cost, about, to be compared with other blocks.
    pub fn cost(&self) -> u64 {
        u64::from(self.block.n_sets()) * if self.block.turning.is_some() { TURNING } else { 1 }
    }

    pub fn is_booked(&self, local: u32) -> bool {
        self.sets[local as usize / SET].booked >> (local as usize % SET) & 1 == 1
    }

    /// Forces of its border or interior elements, and, if `reads_sections`, what passes through cross-sections.
    pub fn compute(
        &mut self,
        is_border: bool,
        material: &Material,
        (step, width): (&Step, Width),
        reads_sections: bool,
    ) {
        let sets = if is_border { &self.border } else { &self.interior };
        if reads_sections {
            self.cuts.compute(&mut self.block, material, sets, (step, width), &mut self.vote);
        } else {
            self.block.compute(material, sets, step, width, &mut self.vote);
        }
    }

    /// Finds the nodes whose strike on a wall would be felt by a solid: corners of its elements that live.
    pub fn mark_strikes(&mut self, setup: &Setup) {
        self.sets.iter_mut().for_each(|set| set.strikes = 0);
        if setup.walls.is_empty() || self.is_rigid || !self.block.is_of_solids() {
            return;
        }
        for element in (0..self.block.n_elements()).filter(|&element| self.block.is_alive(element)) {
            for &node in self.block.nodes_of(element).iter() {
                let node = node as usize;
                if setup.constraints[usize::from(self.block.constraint[node])].walls != 0 {
                    self.sets[node / SET].strikes |= 1 << (node % SET);
                }
            }
        }
    }

    /// Integrates its nodes and books what they say; elements that have eroded leave.
    pub fn integrate(&mut self, advance: &Advance<'_>, setup: &Setup, width: Width) {
        let block = &mut self.block;
        let mut nodes = Nodes {
            x: &mut block.x,
            v: &mut block.v,
            f: &mut block.f,
            mass: &block.mass,
            constraint: &block.constraint,
            sets: &self.sets,
            reference: &self.reference,
            walls: &mut self.walls,
        };
        self.booked = advance.run(&mut nodes, width);
        if let Some(turning) = &mut block.turning {
            let (kinetic, external) = spin::advance(advance, turning, &block.constraint, &self.sets, width);
            self.booked.kinetic += kinetic;
            self.booked.external.merge(external);
        }
        if !self.faces.is_empty() {
            self.booked.external.merge(face::work(&self.faces, block, &advance.step));
        }
        if self.eroding.as_mut().is_some_and(Eroding::take_change) {
            // Loads leave with the faces of eroded elements.
            self.leave_out_dead();
            self.mark_strikes(setup);
            if !self.faces.is_empty() {
                let material = &setup.materials[self.block.material as usize];
                self.faces = face::faces_of(&self.block, &setup.loads, material);
            }
        }
    }
}

/// Nodes of a block that have other holders.
#[derive(Default)]
pub(super) struct SharedNodes {
    /// Local node and place, in the exchange.
    pub exchanged: Vec<[u32; 2]>,
    /// Likewise among the totals of groups.
    pub local: Vec<[u32; 2]>,
    /// By share of contact: local node and the node there, of those that no other block has.
    pub touched: Vec<Vec<[u32; 2]>>,
    /// Local node, share of contact and the node there that leaves its history, unless that travels.
    pub kept: Vec<[u32; 3]>,
}

impl SharedNodes {
    /// None yet; `n_shares` of contact.
    pub fn clear(&mut self, n_shares: usize) {
        self.exchanged.clear();
        self.local.clear();
        self.kept.clear();
        self.touched.iter_mut().for_each(Vec::clear);
        self.touched.resize(n_shares, Vec::new());
    }
}

/// Nodes of a body in a block or in a share of contact, and what pushes the body there.
pub(super) struct Led {
    pub body: u32,
    /// Local node and place in the body.
    pub nodes: Vec<[u32; 2]>,
    pub push: Push,
}

impl Led {
    /// Those of one body among `list`.
    pub fn of(list: &mut Vec<Self>, body: u32) -> &mut Self {
        let at = list.iter().position(|led| led.body == body).unwrap_or_else(|| {
            list.push(Self { body, nodes: Vec::new(), push: Push::default() });
            list.len() - 1
        });
        &mut list[at]
    }
}

/// The order in which blocks are dealt: those that cost most first, because what is begun last is waited for.
#[derive(Default)]
pub(super) struct Order {
    /// Memory for references, empty between two uses.
    memory: Vec<&'static mut HeldBlock>,
}

impl Order {
    /// Does `work` on each block.
    pub fn deal(
        &mut self,
        held_blocks: &mut [HeldBlock],
        meter: &dyn Meter,
        work: impl Fn(&mut HeldBlock) + Sync,
    ) {
        let mut list: Vec<&mut HeldBlock> = std::mem::take(&mut self.memory);
        list.extend(held_blocks);
        list.sort_unstable_by_key(|held_block| std::cmp::Reverse(held_block.cost()));
        deal(list.drain(..), meter, false, work);
        self.memory = emptied(list);
    }
}

/// The memory of a list for references of another lifetime; collecting in place keeps it.
fn emptied<'a>(mut list: Vec<&mut HeldBlock>) -> Vec<&'a mut HeldBlock> {
    list.clear();
    list.into_iter().map(|_| unreachable!("the list is empty")).collect()
}
