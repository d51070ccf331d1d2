//! A domain made of sub-domains at the start of an epoch.

use std::collections::VecDeque;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    Domain,
    bodies::Held,
    ghosts::Ghosts,
    held_block::{HeldBlock, Order, SharedNodes},
    sharing::{Exchange, Groups},
};
use crate::{
    block::Block,
    copy_index::CopyIndex,
    cross_section::Cuts,
    element::ElementVote,
    erosion::Eroding,
    exact::Quanta,
    joint::Mechanism,
    lanes::{SET, Width},
    load::face::{self, FaceVote},
    nodes::{Booked, NodeSet},
    piece::Piece,
    setup::Setup,
    vote::{Gone, Vote, Watched},
    wall::WallVote,
};

/// A sub-domain as the master hands it out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subdomain {
    /// Number of the sub-domain; the lowest that has a node owns it.
    pub id: u32,
    /// Its state, cut for the threads of its worker.
    pub pieces: Vec<Piece>,
    /// Global nodes of it that another sub-domain owns, ascending.
    pub unowned: Vec<u32>,
    /// Global nodes of it on the contact surface, ascending.
    pub surface: Vec<u32>,
}

/// What a block without loads on faces says.
const NO_FACES: FaceVote = FaceVote { force_bound: 0.0, limit: f64::INFINITY };

impl HeldBlock {
    /// Lays out a piece. Which of its nodes others have too is still to be said.
    fn of(mut piece: Piece, setup: &Setup) -> Self {
        let erosion = piece.erosion.take();
        let contact_history = std::mem::take(&mut piece.contact);
        let mut block = Block::of(piece, &setup.materials);
        let all = 0..block.n_sets();
        let material = &setup.materials[block.material as usize];
        let eroding = setup.erosion.of_part(block.part as usize).map(|criteria| {
            Eroding::new(criteria, erosion.as_ref(), &mut block, material, setup.control.safety_factor)
        });
        let part = block.part;
        let mut held_block = Self {
            is_rigid: setup.bodies.iter().any(|body| body.parts.binary_search(&part).is_ok()),
            sets: NodeSet::all(&block.constraint),
            faces: face::faces_of(&block, &setup.loads, material),
            block,
            border: Vec::new(),
            interior: vec![all],
            reference: Default::default(),
            gathered: VecDeque::new(),
            vote: ElementVote::default(),
            booked: Booked::default(),
            face_vote: NO_FACES,
            walls: vec![WallVote::default(); setup.n_holders()],
            eroding,
            cuts: Cuts::default(),
            contact_history,
            shared: SharedNodes::default(),
            led: Vec::new(),
        };
        held_block.mark_strikes(setup);
        held_block
    }
}

impl Domain {
    /// Builds the blocks of the sub-domains at the start of a cycle. `gauges` are global node indices by gauge.
    pub fn new(
        setup: Setup,
        n_parts: usize,
        quanta: Quanta,
        (subdomains, cycle): (Vec<Subdomain>, u64),
        gauges: &[u32],
        width: Width,
    ) -> Self {
        let pieces = subdomains.iter().flat_map(|subdomain| &subdomain.pieces);
        let copy_index = CopyIndex::new(pieces.map(|piece| piece.nodes.as_slice()));
        let mut gather = Vec::new();
        let n_pieces: Vec<usize> = subdomains.iter().map(|subdomain| subdomain.pieces.len()).collect();
        let mut pieces = Vec::with_capacity(n_pieces.iter().sum());
        let mut borders = Vec::with_capacity(subdomains.len());
        for subdomain in subdomains {
            pieces.extend(subdomain.pieces);
            borders.push((subdomain.unowned, subdomain.surface));
        }
        let mut held_blocks: Vec<HeldBlock> =
            pieces.into_par_iter().map(|piece| HeldBlock::of(piece, &setup)).collect();
        let mut end = 0;
        for (n_pieces, (unowned, surface)) in n_pieces.into_iter().zip(borders) {
            let own = end as u32..(end + n_pieces) as u32;
            end += n_pieces;
            let first_copy = |node: u32| {
                copy_index.get(node).as_slice().iter().copied().find(|(block, _)| own.contains(block))
            };
            let blocks = &mut held_blocks[own.start as usize..own.end as usize];
            blocks.par_iter_mut().enumerate().for_each(|(index, held_block)| {
                let index = own.start + index as u32;
                for (local, &node) in (0..).zip(&held_block.block.nodes) {
                    let owned = unowned.binary_search(&node).is_err();
                    if owned && first_copy(node) == Some((index, local)) {
                        held_block.sets[local as usize / SET].booked |= 1 << (local as usize % SET);
                    }
                }
            });
            for &node in &surface {
                if let Some((held_block, local)) = first_copy(node) {
                    if unowned.binary_search(&node).is_err() {
                        gather.push((held_block, local));
                    }
                    held_blocks[held_block as usize].sets[local as usize / SET].surface |=
                        1 << (local as usize % SET);
                }
            }
        }
        for held_block in &mut held_blocks {
            held_block.reference = held_block.surface_positions();
        }
        let gauges = gauges
            .iter()
            .enumerate()
            .filter_map(|(g, node)| {
                let copies = copy_index.get(*node);
                let is_booked = |&&(r, l): &&(u32, u32)| held_blocks[r as usize].is_booked(l);
                let &(held_block, local) = copies.as_slice().iter().find(is_booked)?;
                Some((g as u32, held_block, local))
            })
            .collect();
        let bodies = Held::all(&setup, &copy_index, &mut held_blocks);
        let mechanism = Mechanism::of(&setup.joints, bodies.len());
        Self {
            vote: Vote::empty(n_parts),
            cycle,
            time: 0.0,
            gone: Gone::default(),
            surface_ends: false,
            poses: Vec::with_capacity(setup.walls.len()),
            unbooked: vec![WallVote::default(); setup.n_holders()],
            setup,
            n_parts,
            quanta,
            width,
            held_blocks,
            order: Order::default(),
            ghosts: Ghosts::default(),
            contact: Vec::new(),
            moments: false,
            exchange: Exchange::default(),
            groups: Groups::default(),
            has_border: false,
            bodies,
            mechanism,
            joint_votes: Vec::new(),
            sends_pushes: false,
            copy_index,
            gather,
            gauges,
            gauges_before: Vec::new(),
            element_gauges: Vec::new(),
            watched_pairs: Vec::new(),
            row_cycles: 1,
            reads_sections: false,
        }
    }

    /// From now on votes say how these elements and contacts are; before the first plan is installed.
    pub fn watch(&mut self, watched: &Watched) {
        self.watched_pairs.clone_from(&watched.contacts);
        self.row_cycles = watched.row_cycles;
        for held_block in self.held_blocks.iter_mut().filter(|held_block| !held_block.is_rigid) {
            held_block.cuts = Cuts::of(&watched.sections, &held_block.block);
        }
        let place = |element: &u32| {
            let found = |held_block: &HeldBlock| held_block.block.globals().position(|e| e == *element);
            let mut held_blocks = (0..).zip(&self.held_blocks);
            held_blocks.find_map(|(index, held_block)| found(held_block).map(|local| (index, local as u32)))
        };
        let places = (0..).zip(&watched.elements);
        self.element_gauges = places
            .filter_map(|(gauge, element)| {
                place(element).map(|(held_block, local)| (gauge, held_block, local))
            })
            .collect();
    }
}
