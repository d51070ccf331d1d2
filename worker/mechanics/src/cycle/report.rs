//! What a domain says of itself: its vote on a cycle, and how much it holds.

use std::ops::Range;

use super::{Domain, Load, Meter, Sets};
use crate::{lanes::SET, vote::Vote, wall::WallVote};

impl Domain {
    /// Number of elements held.
    pub fn n_elements(&self) -> usize {
        self.rooms.iter().map(|r| r.block.elements.len()).sum()
    }

    /// What it holds under the plan in force.
    pub fn load(&self) -> Load {
        let mut load = Load::default();
        for room in &self.rooms {
            let count = |sets: &[Range<u32>]| sets.iter().map(|s| room.block.n_elements_of(s)).sum::<u64>();
            load.border += count(&room.border);
            load.interior += count(&room.interior);
            load.nodes += room.block.nodes.len() as u64;
        }
        load.nodes += self.guests.node.len() as u64;
        load.pairs = self.contact.as_ref().map_or(0, |room| room.contact.n_pairs() as u64);
        load
    }

    /// A pass with a step of zero: changes nothing and gives the vote a run starts from.
    pub fn prepare(&mut self, meter: &dyn Meter) -> Vote {
        self.vote = Vote::empty(self.n_parts);
        self.elements(Sets::All, 0.0, meter);
        self.load_faces(meter);
        for room in &mut self.rooms {
            room.block.clear_forces();
            let v = &room.block.v;
            let on_surface = |i: usize| room.sets[i / SET].surface >> (i % SET) & 1 == 1;
            let nodes = (0..room.block.nodes.len()).filter(|&i| on_surface(i));
            let top = nodes.map(|i| speed_squared(v, i)).fold(0.0, f64::max);
            self.vote.contact_speed_squared = self.vote.contact_speed_squared.max(top);
            self.vote.contact_speed_ahead = self.vote.contact_speed_ahead.max(top.sqrt());
        }
        self.finish_vote()
    }

    /// The vote of the cycle, which leaves an empty one for the next.
    pub(super) fn finish_vote(&mut self) -> Vote {
        let mut vote = std::mem::replace(&mut self.vote, Vote::empty(self.n_parts));
        for room in &mut self.rooms {
            let part = room.block.part as usize;
            vote.add_elements(part, &room.vote);
            vote.contact_limit = vote.contact_limit.min(room.face_vote.limit);
            vote.force_bound = vote.force_bound.max(room.face_vote.force_bound);
            vote.add_walls(&room.walls);
            room.walls.fill(WallVote::default());
            vote.parts[part].kinetic += room.booked.kinetic;
            vote.external.merge(room.booked.external);
            vote.parts[part].external.merge(room.booked.external);
            for a in 0..3 {
                vote.momentum[a] += room.booked.momentum[a];
            }
            vote.extents[part].merge(&room.booked.extent);
            vote.contact_speed_squared = vote.contact_speed_squared.max(room.booked.speed_squared);
            vote.contact_speed_ahead = vote.contact_speed_ahead.max(room.booked.speed_ahead);
            if let Some(eroding) = &mut room.eroding {
                let casualties = eroding.take_casualties();
                vote.add_eroded(&casualties.elements);
                vote.gone.internal += casualties.internal;
            }
        }
        self.vote_on_bodies(&mut vote);
        vote.gone.merge(&std::mem::take(&mut self.gone));
        for &(gauge, room, local) in &self.gauges {
            let (block, i) = (&self.rooms[room as usize].block, local as usize);
            let values =
                [block.x[0][i], block.x[1][i], block.x[2][i], block.v[0][i], block.v[1][i], block.v[2][i]];
            vote.gauges.push((gauge, values));
        }
        for &(gauge, room, local) in &self.element_gauges {
            vote.element_gauges.push((gauge, self.rooms[room as usize].block.element(local as usize)));
        }
        vote
    }
}

fn speed_squared(v: &[Vec<f64>; 3], i: usize) -> f64 {
    v[0][i] * v[0][i] + v[1][i] * v[1][i] + v[2][i] * v[2][i]
}
