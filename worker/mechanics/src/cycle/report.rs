//! What a domain says of itself: its vote on a cycle, and how much it holds.

use std::ops::Range;

use super::{Domain, Load, Meter, Sets, held_block::HeldBlock};
use crate::{
    lanes::SET,
    setup::Setup,
    vote::Vote,
    wall::{self, WallVote},
};

impl Domain {
    /// Number of elements held.
    pub fn n_elements(&self) -> usize {
        self.held_blocks.iter().map(|r| r.block.n_elements()).sum()
    }

    /// What it holds under the plan in force.
    pub fn load(&self) -> Load {
        let mut load = Load::default();
        for held_block in &self.held_blocks {
            let count =
                |sets: &[Range<u32>]| sets.iter().map(|s| held_block.block.n_elements_of(s)).sum::<u64>();
            load.border += count(&held_block.border);
            load.interior += count(&held_block.interior);
            load.nodes += held_block.block.nodes.len() as u64;
        }
        load.nodes += self.ghosts.node.len() as u64;
        load.pairs = self.contact.iter().map(|held| held.contact.n_pairs() as u64).sum();
        load
    }

    /// A pass with a step of zero: changes nothing and gives the vote a run starts from.
    pub fn prepare(&mut self, meter: &dyn Meter) -> Vote {
        self.vote = Vote::empty(self.n_parts);
        self.elements(Sets::All, 0.0, meter);
        self.load_faces(0.0, meter);
        for held_block in &mut self.held_blocks {
            held_block.block.clear_forces();
            let v = &held_block.block.v;
            let on_surface = |i: usize| held_block.sets[i / SET].surface >> (i % SET) & 1 == 1;
            let nodes = (0..held_block.block.nodes.len()).filter(|&i| on_surface(i));
            let top = nodes.map(|i| speed_squared(v, i)).fold(0.0, f64::max);
            self.vote.contact_speed_squared = self.vote.contact_speed_squared.max(top);
            self.vote.contact_speed_ahead = self.vote.contact_speed_ahead.max(top.sqrt());
        }
        self.foresee_strikes();
        self.gauges_before = self.read_gauges();
        self.finish_vote(0.0)
    }

    /// Before the first step nobody knows how long steps are: whatever closes in on a wall counts, however far it is.
    fn foresee_strikes(&mut self) {
        let Setup { walls, loads, constraints, .. } = &self.setup;
        let free = wall::first_poses(walls);
        wall::poses(walls, &loads.curves, self.time, 0.0, &free, &mut self.poses);
        for HeldBlock { block, sets, booked, .. } in &mut self.held_blocks {
            for i in (0..block.nodes.len()).filter(|i| sets[i / SET].strikes >> (i % SET) & 1 == 1) {
                let felt = constraints[usize::from(block.constraint[i])].walls;
                let (x, v) = (block.x.each_ref().map(|x| x[i]), block.v.each_ref().map(|v| v[i]));
                let closing = wall::closing(walls, &self.poses, felt, x, v, f64::INFINITY);
                booked.closing = booked.closing.max(closing);
            }
        }
    }

    /// Positions and velocities of the gauge nodes as they are.
    pub(super) fn read_gauges(&self) -> Vec<[f64; 6]> {
        let read = |&(_, held_block, local): &(u32, u32, u32)| {
            let (block, i) = (&self.held_blocks[held_block as usize].block, local as usize);
            [block.x[0][i], block.x[1][i], block.x[2][i], block.v[0][i], block.v[1][i], block.v[2][i]]
        };
        self.gauges.iter().map(read).collect()
    }

    /// The vote of the cycle, which leaves an empty one for the next. `share_before` is that of [`crate::time_step::TimeStep::share_before`].
    pub(super) fn finish_vote(&mut self, share_before: f64) -> Vote {
        let mut vote = std::mem::replace(&mut self.vote, Vote::empty(self.n_parts));
        for held_block in &mut self.held_blocks {
            let part = held_block.block.part as usize;
            vote.add_elements(part, &held_block.vote);
            vote.contact_limit = vote.contact_limit.min(held_block.face_vote.limit);
            vote.force_bound = vote.force_bound.max(held_block.face_vote.force_bound);
            vote.add_walls(&held_block.walls);
            held_block.walls.fill(WallVote::default());
            vote.parts[part].kinetic += held_block.booked.kinetic;
            vote.external.merge(held_block.booked.external);
            vote.parts[part].external.merge(held_block.booked.external);
            for a in 0..3 {
                vote.momentum[a] += held_block.booked.momentum[a];
                vote.parts[part].momentum[a] += held_block.booked.momentum[a];
            }
            if self.reads_sections {
                vote.add_sections(held_block.cuts.take());
            }
            vote.extents[part].merge(&held_block.booked.extent);
            vote.contact_speed_squared = vote.contact_speed_squared.max(held_block.booked.speed_squared);
            vote.contact_speed_ahead = vote.contact_speed_ahead.max(held_block.booked.speed_ahead);
            if held_block.booked.closing > 0.0 {
                let sound = self.setup.materials[held_block.block.material as usize].sound_speed();
                vote.strike = vote.strike.max(held_block.booked.closing / sound);
            }
            if let Some(eroding) = &mut held_block.eroding {
                let eroded_now = eroding.take_casualties();
                vote.add_eroded(&eroded_now.elements);
                vote.gone.internal += eroded_now.internal;
                vote.parts[part].gone += eroded_now.internal;
            }
        }
        self.vote_on_bodies(&mut vote);
        vote.gone.merge(&std::mem::take(&mut self.gone));
        let after = self.read_gauges();
        let before = std::mem::take(&mut self.gauges_before);
        for ((&(gauge, ..), mut read), after) in self.gauges.iter().zip(before).zip(after) {
            for (v, after) in read[3..].iter_mut().zip(&after[3..]) {
                *v = (after - *v).mul_add(share_before, *v);
            }
            vote.gauges.push((gauge, read));
        }
        for &(gauge, held_block, local) in &self.element_gauges {
            vote.element_gauges
                .push((gauge, self.held_blocks[held_block as usize].block.reading(local as usize)));
        }
        vote
    }
}

fn speed_squared(v: &[Vec<f64>; 3], i: usize) -> f64 {
    v[0][i] * v[0][i] + v[1][i] * v[1][i] + v[2][i] * v[2][i]
}
