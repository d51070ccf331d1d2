//! The rigid bodies of a domain: where their nodes are held here, what pushes them, and how their nodes follow.
//!
//! Every worker holds the state of every body. What its blocks and work units push a body with travels as integers at the
//! end of the exchange, so all move it alike. A node of a body is then given the force that brings it to its place: it is
//! integrated, watched and voted on like any other, but books nothing, which the body does for it. Nodes of shells get a
//! moment too, which turns them as the body turns.

use std::collections::{HashMap, HashSet};

use super::{Domain, Ghosts, HeldBlock, NONE};
use crate::{
    copy_index::CopyIndex,
    exact::Quantum,
    lanes::SET,
    nodes,
    rigid::{self, Body, Booked, ENTRIES, PUSH, Push, State},
    setup::Setup,
    vote::Vote,
};

/// A body and its nodes here.
pub(super) struct Held {
    state: State,
    /// Room, local node and place of every copy in a block.
    copies: Vec<[u32; 3]>,
    /// Ghost and place.
    ghosts: Vec<[u32; 2]>,
    /// Contact node and place.
    contact: Vec<[u32; 2]>,
    /// Whether this domain books it.
    is_booked: bool,
    push: Push,
    booked: Booked,
}

impl Held {
    /// Finds the copies of all bodies; from now on their nodes book nothing.
    pub(super) fn all(setup: &Setup, copy_index: &CopyIndex, held_blocks: &mut [HeldBlock]) -> Vec<Self> {
        let held = setup.bodies.iter().map(|body| {
            let mut copies = Vec::new();
            for (place, &node) in (0..).zip(&body.nodes) {
                copies.extend(
                    copy_index.get(node).iter().map(|&(held_block, local)| [held_block, local, place]),
                );
            }
            let booked = |&[held_block, local, place]: &[u32; 3]| {
                place == 0 && held_blocks[held_block as usize].is_booked(local)
            };
            let is_booked = copies.iter().any(booked);
            for &[held_block, local, _] in &copies {
                held_blocks[held_block as usize].sets[local as usize / SET].booked &=
                    !(1 << (local as usize % SET));
            }
            Self {
                state: body.start,
                copies,
                ghosts: Vec::new(),
                contact: Vec::new(),
                is_booked,
                push: Push::default(),
                booked: Booked::default(),
            }
        });
        held.collect()
    }
}

impl Domain {
    /// Where the bodies are and how they move, in the order of the setup.
    ///
    /// # Errors
    /// If there are more or fewer than the problem has.
    pub fn place_bodies(&mut self, states: &[State]) -> Result<(), String> {
        if states.len() != self.bodies.len() {
            return Err(format!(
                "states of {} rigid bodies, the problem has {}",
                states.len(),
                self.bodies.len()
            ));
        }
        for (held, &state) in self.bodies.iter_mut().zip(states) {
            held.state = state;
        }
        Ok(())
    }

    /// Finds the nodes of bodies among ghosts and contact nodes (global indices, ascending), and adds all of them to
    /// `exchanged`: elements that push them are computed before partial forces travel.
    pub(super) fn find_bodies(
        &mut self,
        ghost_of: &HashMap<u32, u32>,
        contact_nodes: &[u32],
        exchanged: &mut HashSet<u32>,
    ) {
        for (held, body) in self.bodies.iter_mut().zip(&self.setup.bodies) {
            exchanged.extend(&body.nodes);
            let among = |find: &dyn Fn(&u32) -> Option<u32>| {
                (0..).zip(&body.nodes).filter_map(|(place, node)| Some([find(node)?, place])).collect()
            };
            held.ghosts = among(&|node| ghost_of.get(node).copied());
            held.contact = among(&|node| contact_nodes.binary_search(node).ok().map(|i| i as u32));
        }
    }

    /// Adds up what pushes the bodies here, at `x_n`.
    pub(super) fn push_bodies(&mut self) {
        let force = self.quanta.force;
        for (held, body) in self.bodies.iter_mut().zip(&self.setup.bodies) {
            held.push = Push::default();
            let state = &held.state;
            for &[held_block, local, place] in &held.copies {
                let block = &self.held_blocks[held_block as usize].block;
                push(&mut held.push, at(&block.f, local), body, state, place, force);
                if let Some(turning) = &block.turning {
                    held.push.add_moment(at(&turning.m, local), force, body.length);
                }
            }
            if let Some(contact) = &self.contact {
                for &[node, place] in &held.contact {
                    push(&mut held.push, at(&contact.f, node), body, state, place, force);
                }
            }
        }
    }

    /// What pushes the bodies here, to travel: three numbers in each entry, which may have block for more.
    pub(super) fn pack_pushes(&self, out: &mut Vec<f64>) {
        if !self.sends_pushes {
            return;
        }
        for held in &self.bodies {
            for limbs in held.push.pack().chunks_exact(3) {
                out.extend(limbs);
                out.resize(out.len() + self.stride() - 3, 0.0);
            }
        }
    }

    /// Numbers of totals that stand for pushes on bodies.
    pub(super) fn n_pushes(&self) -> usize {
        if self.sends_pushes { ENTRIES as usize * self.stride() * self.bodies.len() } else { 0 }
    }

    /// Moves the bodies to `t_{n+1}` by the totals of their pushes (those here, if they do not travel), and gives their
    /// nodes the forces that bring these along.
    pub(super) fn move_bodies(&mut self, totals: &[f64], dt_previous: f64, dt: f64) {
        if self.bodies.is_empty() {
            return;
        }
        let stride = self.stride();
        let (time, loads, quanta) = (self.time, &self.setup.loads, self.quanta);
        let advance = rigid::Advance { dt_previous, dt, time, loads, quanta };
        let of_nodes =
            nodes::Advance { dt_previous, dt, time, constraints: &[], walls: &[], poses: &[], loads, quanta };
        let Ghosts { x, v, f, mass, .. } = &mut self.ghosts;
        for (b, (held, body)) in self.bodies.iter_mut().zip(&self.setup.bodies).enumerate() {
            if self.sends_pushes {
                let first = ENTRIES as usize * b * stride;
                held.push = Push::unpack(&std::array::from_fn::<f64, PUSH, _>(|i| {
                    totals[first + i / 3 * stride + i % 3]
                }));
            }
            held.booked = advance.run(body, &held.push, &mut held.state);
            if dt_previous == 0.0 {
                held.booked.external.put_off();
            }
            for &[held_block, local, place] in &held.copies {
                let block = &mut self.held_blocks[held_block as usize].block;
                let target = held.state.at(body.places[place as usize]);
                let (x, v) = (at(&block.x, local), at(&block.v, local));
                let force = of_nodes.leading(x, v, block.mass[local as usize], target);
                (0..3).for_each(|a| block.f[a][local as usize] = force[a]);
                if let Some(turning) = &mut block.turning {
                    let (spin, inertia) = (at(&turning.w, local), turning.inertia[local as usize]);
                    let moment = of_nodes.turning(spin, inertia, held.state.spin);
                    (0..3).for_each(|a| turning.m[a][local as usize] = moment[a]);
                }
            }
            for &[ghost, place] in &held.ghosts {
                let target = held.state.at(body.places[place as usize]);
                let force = of_nodes.leading(at(x, ghost), at(v, ghost), mass[ghost as usize], target);
                (0..3).for_each(|a| f[a][ghost as usize] = force[a]);
            }
        }
    }

    /// What the bodies say of a cycle.
    pub(super) fn vote_on_bodies(&self, vote: &mut Vote) {
        for (held, body) in self.bodies.iter().zip(&self.setup.bodies) {
            vote.bodies.push(held.state);
            if let Some((limit, element)) = body.courant
                && (limit, element) < (vote.courant, vote.courant_element)
            {
                (vote.courant, vote.courant_element) = (limit, element);
            }
            if !held.is_booked {
                continue;
            }
            let part = body.parts.first().map_or(0, |&part| part as usize);
            vote.parts[part].kinetic += held.booked.kinetic;
            vote.parts[part].external.merge(held.booked.external);
            vote.external.merge(held.booked.external);
            (0..3).for_each(|a| vote.momentum[a] += held.booked.momentum[a]);
        }
    }
}

fn at(values: &[Vec<f64>; 3], i: u32) -> [f64; 3] {
    std::array::from_fn(|a| values[a][i as usize])
}

fn push(sum: &mut Push, f: [f64; 3], body: &Body, state: &State, place: u32, force: Quantum) {
    if f != [0.0; 3] {
        sum.add(f, state.arm(body.places[place as usize]), force, body.length);
    }
}

/// How many entries of an exchange (ascending) stand for pushes on bodies.
///
/// # Errors
/// If they are not all of them, or not these.
pub(super) fn entries_of(exchange: &[u32], n_bodies: usize) -> Result<usize, String> {
    let expected = rigid::entries(n_bodies);
    let first = exchange.partition_point(|&entry| entry < expected.start);
    let found = &exchange[first..];
    if found.is_empty() || found.iter().copied().eq(expected) {
        return Ok(found.len());
    }
    Err(format!(
        "{} entries of the exchange for {n_bodies} rigid bodies, from {} on",
        found.len(),
        found.first().unwrap_or(&NONE)
    ))
}
