//! A block of a domain with what stands beside it, and work on all of them.

use std::{collections::VecDeque, ops::Range};

use crate::{
    block::Block,
    element::ElementVote,
    erosion::{Eroding, PieceErosion},
    lanes::SET,
    load::face::{FaceVote, LoadedFace},
    nodes::{Booked, NodeSet},
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
    /// What contact keeps of each node, by number; no array where it keeps nothing.
    pub contact_history: Vec<Vec<f64>>,
}

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

    pub fn is_booked(&self, local: u32) -> bool {
        self.sets[local as usize / SET].booked >> (local as usize % SET) & 1 == 1
    }
}

/// Runs `work` on each block, in parallel on the current pool when there are several.
pub(super) fn each(held_blocks: &mut [HeldBlock], work: impl Fn(&mut HeldBlock) + Send + Sync) {
    one_by_one(held_blocks, &work);
}

/// So many blocks are taken one by one at most: each is handed to the next thread by the one before.
const ONE_BY_ONE: usize = 32;

/// Whichever thread is free takes the next block: blocks of a small part and of a large one are not alike, and halves of the
/// list would leave a thread with all the large ones. Longer lists are halved first.
fn one_by_one(held_blocks: &mut [HeldBlock], work: &(impl Fn(&mut HeldBlock) + Send + Sync)) {
    match held_blocks {
        [] => {}
        [one] => work(one),
        [first, rest @ ..] if rest.len() < ONE_BY_ONE => {
            rayon::join(|| work(first), || one_by_one(rest, work));
        }
        many => {
            let (left, right) = many.split_at_mut(many.len() / 2);
            rayon::join(|| one_by_one(left, work), || one_by_one(right, work));
        }
    }
}
