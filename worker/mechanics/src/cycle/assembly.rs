//! A domain made of sub-domains at the start of an epoch.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::{
    Domain,
    bodies::Held,
    guests::Guests,
    room::Room,
    sharing::{Exchange, Groups},
};
use crate::{
    block::{Block, Piece},
    element::ElementVote,
    erosion::Eroding,
    home::Home,
    lanes::{SET, Width},
    load::face::{self, FaceVote},
    nodes::{Booked, NodeSet},
    setup::Setup,
    vote::{Gone, Quanta, Vote, Watched},
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
        let mut rooms: Vec<Room> = Vec::new();
        let pieces = subdomains.iter().flat_map(|subdomain| &subdomain.pieces);
        let home = Home::new(pieces.map(|piece| piece.nodes.as_slice()));
        let mut gather = Vec::new();
        for Subdomain { pieces, unowned, surface, .. } in subdomains {
            let first = rooms.len();
            for mut piece in pieces {
                let erosion = piece.erosion.take();
                let mut block = Block::of(piece, &setup.materials);
                let all = 0..block.n_sets();
                let material = &setup.materials[block.material as usize];
                let eroding = setup.erosion.of_part(block.part as usize).map(|criteria| {
                    Eroding::new(
                        criteria,
                        erosion.as_ref(),
                        &mut block,
                        material,
                        setup.control.safety_factor,
                    )
                });
                let faces = face::faces_of(&block, &setup.loads, material);
                let part = block.part;
                let is_rigid = setup.bodies.iter().any(|body| body.parts.binary_search(&part).is_ok());
                rooms.push(Room {
                    is_rigid,
                    sets: NodeSet::all(&block.constraint),
                    block,
                    border: Vec::new(),
                    interior: vec![all],
                    reference: Default::default(),
                    gathered: VecDeque::new(),
                    vote: ElementVote::default(),
                    booked: Booked::default(),
                    faces,
                    face_vote: NO_FACES,
                    walls: vec![WallVote::default(); setup.walls.len()],
                    eroding,
                });
            }
            let own = first as u32..rooms.len() as u32;
            let first_copy =
                |node: u32| home.get(node).iter().copied().find(|(block, _)| own.contains(block));
            for room in own.clone() {
                for local in 0..rooms[room as usize].block.nodes.len() as u32 {
                    let node = rooms[room as usize].block.nodes[local as usize];
                    let owned = unowned.binary_search(&node).is_err();
                    if owned && first_copy(node) == Some((room, local)) {
                        rooms[room as usize].sets[local as usize / SET].booked |= 1 << (local as usize % SET);
                    }
                }
            }
            for &node in &surface {
                if let Some((room, local)) = first_copy(node) {
                    if unowned.binary_search(&node).is_err() {
                        gather.push((room, local));
                    }
                    rooms[room as usize].sets[local as usize / SET].surface |= 1 << (local as usize % SET);
                }
            }
        }
        for room in &mut rooms {
            room.reference = room.surface_positions();
        }
        let gauges = gauges
            .iter()
            .enumerate()
            .filter_map(|(g, node)| {
                let &(room, local) =
                    home.get(*node).iter().find(|&&(r, l)| rooms[r as usize].is_booked(l))?;
                Some((g as u32, room, local))
            })
            .collect();
        let bodies = Held::all(&setup, &home, &mut rooms);
        Self {
            vote: Vote::empty(n_parts),
            cycle,
            time: 0.0,
            gone: Gone::default(),
            surface_ends: false,
            poses: Vec::with_capacity(setup.walls.len()),
            unbooked: vec![WallVote::default(); setup.walls.len()],
            setup,
            n_parts,
            quanta,
            width,
            rooms,
            guests: Guests::default(),
            contact: None,
            moments: false,
            exchange: Exchange::default(),
            groups: Groups::default(),
            bodies,
            sends_pushes: false,
            home,
            gather,
            gauges,
            element_gauges: Vec::new(),
            watched_pairs: Vec::new(),
        }
    }

    /// From now on votes say how these elements and contacts are; before the first plan is installed.
    pub fn watch(&mut self, watched: &Watched) {
        self.watched_pairs.clone_from(&watched.contacts);
        let place = |element: &u32| {
            let found = |room: &Room| room.block.elements.iter().position(|e| e == element);
            let mut rooms = (0..).zip(&self.rooms);
            rooms.find_map(|(index, room)| found(room).map(|local| (index, local as u32)))
        };
        let places = (0..).zip(&watched.elements);
        self.element_gauges = places
            .filter_map(|(gauge, element)| place(element).map(|(room, local)| (gauge, room, local)))
            .collect();
    }
}
