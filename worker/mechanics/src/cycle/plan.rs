//! The plan that a domain acts by, from one boundary to the next: shared nodes, ghosts and work units put in their places,
//! and freed nodes taken out.

use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};

use serde::{Deserialize, Serialize};

use super::{Domain, Meter, bodies, ghosts::Ghosts, held_block::HeldBlock, touch::Places};
use crate::{
    contact::{Batch, BatchNode},
    lanes::SET,
    nodes::NodeSet,
};

/// Which nodes this worker shares with others and which work units it computes; from one plan boundary to the next.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Global nodes whose partial forces travel, in the order of the packed arrays.
    pub exchange: Vec<u32>,
    /// Work units.
    pub batch: Option<Batch>,
    /// Contact nodes that no sub-domain here has.
    pub ghosts: Vec<Ghost>,
    /// Global nodes whose state this worker sends to others when the plan starts to act.
    pub send: Vec<u32>,
    /// On route direct: to whom each of them goes.
    pub gives: Vec<Handed>,
    /// On route direct: from whom the state of each ghost comes.
    pub takes: Vec<Handed>,
    /// Whether moments travel behind the forces of each node: six numbers instead of three.
    pub moments: bool,
    /// Numbers that contact keeps of each node, which travel behind those.
    pub n_history: u32,
    /// On route direct: the workers that hold nodes of `exchange` too.
    pub neighbours: Vec<Neighbour>,
    /// Nodes held here that have no element left and leave the run with this plan; in the first plan of an epoch, all that
    /// have left before.
    pub dropped: Vec<u32>,
}

impl Plan {
    /// Numbers that travel for each node of the exchange.
    pub fn stride(&self) -> usize {
        (if self.moments { 6 } else { 3 }) + self.n_history as usize
    }
}

/// Another worker that holds nodes of the exchange.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Neighbour {
    /// Its index among the workers of the job.
    pub worker: u32,
    /// Positions in [`Plan::exchange`] of the nodes that both hold, ascending; both sides list them in the same order
    /// of nodes.
    pub shared: Vec<u32>,
}

/// Nodes whose state one worker sends another when a plan starts to act.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Handed {
    /// The other worker's index among those of the job.
    pub worker: u32,
    /// Positions in [`Plan::send`] of the one and in [`Plan::ghosts`] of the other, in the same order of nodes.
    pub places: Vec<u32>,
}

/// What integrating a ghost needs beside its position and velocity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ghost {
    /// Global node index.
    pub node: u32,
    /// Nodal mass.
    pub mass: f64,
    /// Index into the setup's constraints.
    pub constraint: u16,
}

impl Domain {
    /// Starts to act by `plan`. `ghost_state` is x, y, z, vx, vy, vz and the contact history of each ghost, in the plan's order.
    ///
    /// # Errors
    /// If the plan names a node that is neither held nor a ghost, or the state has the wrong length.
    pub fn install(&mut self, plan: &Plan, ghost_state: &[f64], meter: &dyn Meter) -> Result<(), String> {
        let n_history = self.n_history();
        let each = 6 + n_history;
        if ghost_state.len() != each * plan.ghosts.len() {
            return Err(format!(
                "{} numbers of ghost state for {} ghosts, expected {each} each",
                ghost_state.len(),
                plan.ghosts.len()
            ));
        }
        if plan.n_history as usize != n_history {
            return Err(format!(
                "{} numbers of contact history by node, expected {n_history}",
                plan.n_history
            ));
        }
        let constraint: Vec<u16> = plan.ghosts.iter().map(|g| g.constraint).collect();
        let sets = NodeSet::all(&constraint);
        let padded = |values: &mut dyn Iterator<Item = f64>, padding: f64| {
            let mut array: Vec<f64> = values.collect();
            array.resize(sets.len() * SET, padding);
            array
        };
        let number = |i: usize| padded(&mut ghost_state.chunks_exact(each).map(|s| s[i]), 0.0);
        self.ghosts = Ghosts {
            node: plan.ghosts.iter().map(|g| g.node).collect(),
            x: std::array::from_fn(number),
            v: std::array::from_fn(|a| number(3 + a)),
            f: std::array::from_fn(|_| padded(&mut std::iter::empty(), 0.0)),
            mass: padded(&mut plan.ghosts.iter().map(|g| g.mass), 1.0),
            contact_history: (0..n_history).map(|k| number(6 + k)).collect(),
            constraint,
            sets,
            exchanged: Vec::new(),
        };
        if let Some(ghost) =
            plan.ghosts.iter().find(|ghost| !self.copy_index.get(ghost.node).as_slice().is_empty())
        {
            return Err(format!("ghost {} is held here, must be a node of other workers alone", ghost.node));
        }
        let ghost_of: HashMap<u32, u32> =
            self.ghosts.node.iter().enumerate().map(|(i, &n)| (n, i as u32)).collect();
        let contact_nodes = plan.batch.as_ref().map_or(&[][..], |batch| &batch.nodes);
        if !contact_nodes.is_sorted_by(|a, b| a.global < b.global) {
            return Err("contact nodes are not in ascending order".to_owned());
        }
        let places = self.take_contact(plan.batch.as_ref(), &|node| ghost_of.get(&node).copied(), meter)?;
        // Every node with more than one copy, here or elsewhere, and every contact node.
        self.moments = plan.moments;
        self.exchange.clear();
        self.groups.clear();
        let n_shares = self.contact.len();
        self.held_blocks.iter_mut().for_each(|held_block| held_block.shared.clear(n_shares));
        let mut exchanged = HashSet::with_capacity(plan.exchange.len());
        let n_entries = bodies::entries_of(&plan.exchange, self.bodies.len())?;
        self.sends_pushes = n_entries > 0;
        for (place, &node) in (0..).zip(&plan.exchange[..plan.exchange.len() - n_entries]) {
            exchanged.insert(node);
            let copies = self.copy_index.get(node);
            let copies = copies.as_slice();
            let ghost = ghost_of.get(&node).copied();
            if copies.is_empty() && ghost.is_none() {
                return Err(format!("node {node} of the exchange is neither held nor a ghost"));
            }
            for &(held_block, local) in copies {
                self.held_blocks[held_block as usize].shared.exchanged.push([local, place]);
            }
            self.ghosts.exchanged.extend(ghost.map(|ghost| [ghost, place]));
            let contact = contact_nodes.binary_search_by_key(&node, |n| n.global).ok();
            let touching = contact.map_or(&[][..], |node| places.of(node));
            let n_blocks = self.held_blocks.len() as u32;
            let touching = touching.iter().map(|&(share, local)| (n_blocks + share, local));
            let keeper = contact.and_then(|node| places.own(node));
            self.exchange.push(copies.iter().copied().chain(touching), keeper);
        }
        // Nodes of rigid bodies have histories too, though their forces are not added up here.
        if n_history > 0 {
            self.share_histories(contact_nodes, &places, &exchanged, meter);
        }
        if !self.bodies.is_empty() {
            let nodes: Vec<u32> = contact_nodes.iter().map(|node| node.global).collect();
            self.find_bodies(&ghost_of, (&nodes, &places), &mut exchanged);
        }
        // Both lists ascend, so one walk over them finds the contact node of each.
        let mut holders = Vec::new();
        let (mut next, n_several) = (0, self.copy_index.several().len());
        for (i, node) in contact_nodes.iter().map(|n| n.global).enumerate() {
            while next < n_several && self.copy_index.several()[next] < node {
                self.share_locally(self.copy_index.several()[next], &[], &exchanged, &mut holders);
                next += 1;
            }
            next += usize::from(next < n_several && self.copy_index.several()[next] == node);
            self.share_locally(node, places.of(i), &exchanged, &mut holders);
        }
        for i in next..n_several {
            self.share_locally(self.copy_index.several()[i], &[], &exchanged, &mut holders);
        }
        let numbers = self.numbers();
        self.groups.place(&mut self.held_blocks, numbers);
        self.split_sets(&exchanged, meter);
        self.drop_nodes(&plan.dropped);
        Ok(())
    }

    /// Says which sets are computed before partial forces travel, and takes the positions of the sort that acts now.
    fn split_sets(&mut self, exchanged: &HashSet<u32>, meter: &dyn Meter) {
        self.order.deal(&mut self.held_blocks, meter, |held_block| {
            (held_block.border, held_block.interior) = if exchanged.is_empty() {
                let all = 0..held_block.block.n_sets();
                (Vec::new(), vec![all])
            } else {
                let touched: Vec<bool> =
                    held_block.block.nodes.iter().map(|n| exchanged.contains(n)).collect();
                split(&held_block.block.sets_touching(&touched))
            };
            if held_block.eroding.is_some() {
                held_block.leave_out_dead();
            }
            if let Some(gathered) = held_block.gathered.pop_front() {
                held_block.reference = gathered;
            }
        });
        self.has_border = self.held_blocks.iter().any(|held_block| !held_block.border.is_empty());
    }

    /// Says which copies of contact nodes take their histories from contact here. Nodes that can meet nothing have none.
    fn share_histories(
        &mut self,
        contact_nodes: &[BatchNode],
        places: &Places,
        exchanged: &HashSet<u32>,
        meter: &dyn Meter,
    ) {
        let of_contact = |node: u32| {
            let contact = contact_nodes.binary_search_by_key(&node, |n| n.global);
            contact.is_ok_and(|contact| places.own(contact).is_some())
        };
        self.order.deal(&mut self.held_blocks, meter, |held_block| {
            for (local, &node) in held_block.block.nodes.iter().enumerate() {
                let kept = held_block.contact_history.iter().any(|number| number[local] != 0.0);
                if kept && !exchanged.contains(&node) && !of_contact(node) {
                    held_block.contact_history.iter_mut().for_each(|number| number[local] = 0.0);
                }
            }
        });
        for (i, node) in
            contact_nodes.iter().enumerate().filter(|(_, node)| !exchanged.contains(&node.global))
        {
            let Some((share, in_share)) = places.own(i) else { continue };
            for &(held_block, local) in self.copy_index.get(node.global).as_slice() {
                self.held_blocks[held_block as usize].shared.kept.push([local, share, in_share]);
            }
        }
    }

    /// Takes freed nodes out of the run: they stand still from now on, and nothing feels them. A first plan names those of
    /// earlier cycles too, which stand still already: what left with them was booked then, and nothing is booked here.
    fn drop_nodes(&mut self, nodes: &[u32]) {
        for &node in nodes {
            for &(held_block, local) in self.copy_index.get(node).as_slice() {
                let held_block = &mut self.held_blocks[held_block as usize];
                let booked = held_block.drop_node(local);
                let (v, mass) = (&mut held_block.block.v, held_block.block.mass[local as usize]);
                let taken = |along: &mut [Vec<f64>; 3]| {
                    along.each_mut().map(|v| std::mem::take(&mut v[local as usize]))
                };
                let velocity = taken(v);
                let turning = held_block.block.turning.as_mut();
                let (spin, inertia) =
                    turning.map_or(([0.0; 3], 0.0), |t| (taken(&mut t.w), t.inertia[local as usize]));
                if booked {
                    let square = |[x, y, z]: [f64; 3]| x.mul_add(x, y.mul_add(y, z * z));
                    let kinetic = self.quanta.energy.round(0.5 * mass * square(velocity))
                        + self.quanta.energy.round(0.5 * inertia * square(spin));
                    self.gone.kinetic += kinetic;
                    self.vote.parts[held_block.block.part as usize].gone += kinetic;
                    for (sum, v) in self.gone.momentum.iter_mut().zip(velocity) {
                        *sum += self.quanta.momentum.round(mass * v);
                    }
                }
            }
        }
    }

    /// The surface in force ends with this cycle: the gathering that is due replaces those whose plans will not come any more, and
    /// the vote will say what the springs hold after it ([`crate::vote::Vote::released`]).
    pub fn end_surface(&mut self) {
        self.surface_ends = true;
        for held_block in &mut self.held_blocks {
            held_block.gathered.clear();
        }
    }

    /// Has a node added up here that is held here and not exchanged; `touching` are its places in the shares of contact.
    fn share_locally(
        &mut self,
        node: u32,
        touching: &[(u32, u32)],
        exchanged: &HashSet<u32>,
        holders: &mut Vec<(u32, u32)>,
    ) {
        let copies = self.copy_index.get(node);
        let copies = copies.as_slice();
        if copies.is_empty() || exchanged.contains(&node) {
            return;
        }
        if let &[(held_block, local)] = copies {
            let touched = &mut self.held_blocks[held_block as usize].shared.touched;
            touching.iter().for_each(|&(share, in_share)| touched[share as usize].push([local, in_share]));
            return;
        }
        let n_blocks = self.held_blocks.len() as u32;
        holders.clear();
        holders.extend_from_slice(copies);
        holders.extend(touching.iter().map(|&(share, in_share)| (n_blocks + share, in_share)));
        self.groups.push(holders);
    }
}

impl HeldBlock {
    /// Sets without a living element are not computed any more.
    pub(super) fn leave_out_dead(&mut self) {
        let alive = self.block.alive();
        self.border = living(&self.border, alive);
        self.interior = living(&self.interior, alive);
    }
}

/// The sets among these in which an element is alive, as ranges.
fn living(ranges: &[Range<u32>], alive: &[u8]) -> Vec<Range<u32>> {
    let mut living: Vec<Range<u32>> = Vec::new();
    for set in ranges.iter().cloned().flatten().filter(|&set| alive[set as usize] != 0) {
        match living.last_mut() {
            Some(last) if last.end == set => last.end += 1,
            _ => living.push(set..set + 1),
        }
    }
    living
}

/// Sets that touch marked nodes and the others, as ranges.
fn split(touching: &[bool]) -> (Vec<Range<u32>>, Vec<Range<u32>>) {
    let mut sides = (Vec::<Range<u32>>::new(), Vec::<Range<u32>>::new());
    for (set, &touches) in (0_u32..).zip(touching) {
        let side = if touches { &mut sides.0 } else { &mut sides.1 };
        match side.last_mut() {
            Some(last) if last.end == set => last.end += 1,
            _ => side.push(set..set + 1),
        }
    }
    sides
}
