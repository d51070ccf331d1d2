//! The rigid bodies of a domain: where their nodes are held here, what pushes them, and how their nodes follow.
//!
//! Every worker holds the state of every body. What its blocks and work units push a body with travels as integers at the
//! end of the exchange, so all move it alike. A node of a body is then given the force that brings it to its place: it is
//! integrated, watched and voted on like any other, but books nothing, which the body does for it. Nodes of shells get a
//! moment too, which turns them as the body turns.

use std::collections::{HashMap, HashSet};

use super::{
    Domain, Ghosts, Meter, NONE,
    deal::deal,
    held_block::{HeldBlock, Led},
    touch::Places,
};
use crate::{
    block::Block,
    copy_index::CopyIndex,
    exact::Quantum,
    joint::Moving,
    lanes::SET,
    nodes,
    rigid::{self, Body, Booked, ENTRIES, Free, PUSH, Push, State},
    setup::Setup,
    spin::Turning,
    time_step::TimeStep,
    vote::Vote,
};

impl Led {
    /// Adds up what pushes the body here.
    fn add_up(&mut self, f: &[Vec<f64>; 3], turning: Option<&Turning>, bodies: Bodies<'_>, force: Quantum) {
        let (state, body) = (&bodies.held[self.body as usize].state, &bodies.of[self.body as usize]);
        self.push = Push::default();
        for &[local, place] in &self.nodes {
            push(&mut self.push, at(f, local), body, state, place, force);
            if let Some(turning) = turning {
                self.push.add_moment(at(&turning.m, local), force, body.length);
            }
        }
    }
}

/// All bodies: their states, and what they are.
#[derive(Clone, Copy)]
pub(super) struct Bodies<'a> {
    pub held: &'a [Held],
    pub of: &'a [Body],
}

/// A body and its nodes here, apart from those in blocks and in shares of contact.
pub(super) struct Held {
    state: State,
    /// Ghost and place.
    ghosts: Vec<[u32; 2]>,
    /// Whether this domain books it.
    is_booked: bool,
    push: Push,
    booked: Booked,
}

impl Held {
    /// Finds the copies of all bodies; from now on their nodes book nothing.
    pub(super) fn all(setup: &Setup, copy_index: &CopyIndex, held_blocks: &mut [HeldBlock]) -> Vec<Self> {
        let held = (0..).zip(&setup.bodies).map(|(index, body)| {
            let mut copies = Vec::new();
            for (place, &node) in (0..).zip(&body.nodes) {
                copies.extend(
                    copy_index
                        .get(node)
                        .as_slice()
                        .iter()
                        .map(|&(held_block, local)| [held_block, local, place]),
                );
            }
            let booked = |&[held_block, local, place]: &[u32; 3]| {
                place == 0 && held_blocks[held_block as usize].is_booked(local)
            };
            let is_booked = copies.iter().any(booked);
            for &[held_block, local, place] in &copies {
                let held_block = &mut held_blocks[held_block as usize];
                held_block.sets[local as usize / SET].booked &= !(1 << (local as usize % SET));
                Led::of(&mut held_block.led, index).nodes.push([local, place]);
            }
            Self {
                state: body.start,
                ghosts: Vec::new(),
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

    /// Finds the nodes of bodies among ghosts and contact nodes (global indices, ascending, and where they are), and adds all of them to
    /// `exchanged`: elements that push them are computed before partial forces travel.
    pub(super) fn find_bodies(
        &mut self,
        ghost_of: &HashMap<u32, u32>,
        (contact_nodes, places): (&[u32], &Places),
        exchanged: &mut HashSet<u32>,
    ) {
        for (index, (held, body)) in (0..).zip(self.bodies.iter_mut().zip(&self.setup.bodies)) {
            exchanged.extend(&body.nodes);
            let nodes = || (0..).zip(&body.nodes);
            held.ghosts = nodes().filter_map(|(place, node)| Some([*ghost_of.get(node)?, place])).collect();
            for (place, node) in nodes() {
                let Ok(node) = contact_nodes.binary_search(node) else { continue };
                for &(share, local) in places.of(node) {
                    Led::of(&mut self.contact[share as usize].led, index).nodes.push([local, place]);
                }
            }
        }
    }

    /// Adds up what pushes the bodies here, at `x_n`.
    pub(super) fn push_bodies(&mut self, meter: &dyn Meter) {
        if self.bodies.is_empty() {
            return;
        }
        let force = self.quanta.force;
        let bodies = Bodies { held: &self.bodies, of: &self.setup.bodies };
        let of_block = |held_block: &mut HeldBlock| {
            let Block { f, turning, .. } = &held_block.block;
            held_block.led.iter_mut().for_each(|led| led.add_up(f, turning.as_ref(), bodies, force));
        };
        deal(self.held_blocks.iter_mut(), meter, false, of_block);
        deal(self.contact.iter_mut(), meter, false, |held| {
            held.led.iter_mut().for_each(|led| led.add_up(&held.f, None, bodies, force));
        });
        self.bodies.iter_mut().for_each(|held| held.push = Push::default());
        let of_blocks = self.held_blocks.iter().flat_map(|held_block| &held_block.led);
        for led in of_blocks.chain(self.contact.iter().flat_map(|held| &held.led)) {
            self.bodies[led.body as usize].push.join(&led.push);
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

    /// Moves the bodies to `t_{n+1}` by the totals of their pushes (those here, if they do not travel).
    pub(super) fn move_bodies(&mut self, totals: &[f64], dt_previous: f64, dt: f64) {
        let stride = self.stride();
        let (time, loads, quanta) = (self.time, &self.setup.loads, self.quanta);
        let step = TimeStep { dt_previous, dt, time, cycle: self.cycle, loads, quanta };
        let bodies = &self.setup.bodies;
        if self.sends_pushes {
            for (b, held) in self.bodies.iter_mut().enumerate() {
                let first = ENTRIES as usize * b * stride;
                held.push = Push::unpack(&std::array::from_fn::<f64, PUSH, _>(|i| {
                    totals[first + i / 3 * stride + i % 3]
                }));
            }
        }
        let states: Vec<State> = self.bodies.iter().map(|held| held.state).collect();
        let free = |(held, body): (&Held, &Body)| step.free(body, &held.push, &held.state);
        let free: Vec<Free> = self.bodies.iter().zip(bodies).map(free).collect();
        let moving = Moving { step: &step, bodies, states: &states, free: &free };
        let (impulses, votes) = self.mechanism.hold(&self.setup.joints, &moving);
        self.joint_votes = votes;
        for (b, held) in self.bodies.iter_mut().enumerate() {
            held.state = step.moved(&bodies[b], &free[b], &impulses[b], &states[b]);
            held.booked = step.booked(&bodies[b], &free[b], &impulses[b], &states[b], &held.state);
        }
    }

    /// What the bodies say of a cycle.
    pub(super) fn vote_on_bodies(&self, vote: &mut Vote) {
        vote.joints.clone_from(&self.joint_votes);
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
            let part = body.account as usize;
            vote.parts[part].kinetic += held.booked.kinetic;
            vote.parts[part].external.merge(held.booked.external);
            vote.external.merge(held.booked.external);
            for a in 0..3 {
                vote.momentum[a] += held.booked.momentum[a];
                vote.parts[part].momentum[a] += held.booked.momentum[a];
            }
        }
    }
}

impl HeldBlock {
    /// Gives the nodes of bodies the forces that bring them along.
    pub(super) fn lead(&mut self, bodies: Bodies<'_>, advance: &nodes::Advance<'_>) {
        let block = &mut self.block;
        for Led { body, nodes, .. } in &self.led {
            let (state, body) = (&bodies.held[*body as usize].state, &bodies.of[*body as usize]);
            for &[local, place] in nodes {
                let target = state.at(body.places[place as usize]);
                let (x, v) = (at(&block.x, local), at(&block.v, local));
                let force = advance.leading(x, v, block.mass[local as usize], target);
                (0..3).for_each(|a| block.f[a][local as usize] = force[a]);
                if let Some(turning) = &mut block.turning {
                    let (spin, inertia) = (at(&turning.w, local), turning.inertia[local as usize]);
                    let moment = advance.turning(spin, inertia, state.spin);
                    (0..3).for_each(|a| turning.m[a][local as usize] = moment[a]);
                }
            }
        }
    }
}

impl Ghosts {
    /// Likewise.
    pub(super) fn lead(&mut self, bodies: Bodies<'_>, advance: &nodes::Advance<'_>) {
        let Self { x, v, f, mass, .. } = self;
        for (held, body) in bodies.held.iter().zip(bodies.of) {
            for &[ghost, place] in &held.ghosts {
                let target = held.state.at(body.places[place as usize]);
                let force = advance.leading(at(x, ghost), at(v, ghost), mass[ghost as usize], target);
                (0..3).for_each(|a| f[a][ghost as usize] = force[a]);
            }
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
