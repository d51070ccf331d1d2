//! Nodes against faces in one cycle: from the candidate list through the zone to forces.
//!
//! Of this kind of pairs the only place that knows search, geometry and force. Gather: corners of faces to boxes; compute: near
//! features, hits, reactions; scatter: into the force arrays, in any order because all terms are exact.

use std::ops::Range;

use super::{
    Settings, WARNING,
    batch::Batch,
    boxes::Boxes,
    force::{
        self,
        lanes::{Pushes, Statics, Terms},
        spring::Hardening,
    },
    joint::{
        self, Hit, Near,
        lanes::{Firsts, firsts},
    },
    near_pairs::NearPairs,
    pair::{Books, Cycle, Pairs},
    pair_energy::PairEnergies,
    search::{self, Candidates},
    slots::Slots,
    watch::{BLOCK, Watch},
    zone::{
        Frame, OUTER,
        approach::{Approach, approach},
        lanes::{Closest, Rest, nearest},
    },
};
use bonded::Bonded;
use exposed::CameOut;

use crate::{
    exact::Quantum,
    lanes::{SET, Width},
};

/// The nodes and faces of one batch, from one sort to the next.
#[derive(Clone, Debug)]
pub(super) struct NodeFace {
    settings: Settings,
    hardening: Hardening,
    n_parts: usize,
    /// Pairs that can meet; `faces` are indices into the lists of active faces.
    candidates: Candidates,
    /// By active face, one that has candidates: batch nodes, face id (ascending), part.
    faces: Vec<[u32; 4]>,
    ids: Vec<u32>,
    parts: Vec<u32>,
    /// By active face, whether it is a shell; empty if none is.
    shells: Vec<bool>,
    /// By batch node.
    global: Vec<u32>,
    part: Vec<u32>,
    /// By batch node and by active face.
    statics: Statics,
    /// Whether no pair has friction.
    smooth: bool,
    /// The only pair of parts that may meet, if there is but one: it has all energy.
    only_pair: Option<[u32; 2]>,
    pub(super) width: Width,
    /// The candidates that can be near before nodes have moved much further.
    watch: Watch,
    /// Where parts erode, what came out last.
    came_out: CameOut,
    /// Nodes that ties hold until they break.
    bonded: Bonded,
    /// Whether friction sticks.
    sticks: bool,
    work: Work,
}

/// Work space of one block of nodes.
#[derive(Clone, Debug, Default)]
struct Work {
    boxes: Boxes,
    /// Active faces whose boxes hold a node, and the end of those of each node, while a list is taken.
    held: Vec<u32>,
    ends: Vec<u32>,
    /// Positions by batch node, a row each.
    rows: Vec<[f64; 4]>,
    closest: Closest,
    rest: Rest,
    firsts: Firsts,
    /// By near feature: lane of its node among the sets.
    lane: Vec<u32>,
    /// Features near nodes: where the pushes act.
    near_pairs: NearPairs,
    approach: Approach,
    face: Vec<u32>,
    share: Vec<f64>,
    stacking: Vec<f64>,
    /// Depths and directions from the long way: place, depth, direction.
    long_way: Vec<(usize, f64, [f64; 3])>,
    terms: Terms,
    /// The near faces of one node that needs the long way.
    near: Vec<Near>,
    hits: Vec<Hit>,
    beyond: Vec<u32>,
}

impl NodeFace {
    /// Takes the pairs of a batch that can meet before the next sort; see [`super::Contact::new`].
    pub(super) fn new(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3], width: Width) -> Self {
        let mut candidates = search::candidates(batch, settings, x);
        let mut index = vec![u32::MAX; batch.faces.len()];
        for &f in &candidates.faces {
            index[f as usize] = 0;
        }
        let mut contact = Self {
            n_parts: settings.n_parts(),
            hardening: Hardening::of(settings.gap),
            settings: settings.clone(),
            candidates: Candidates::default(),
            faces: Vec::new(),
            ids: Vec::new(),
            parts: Vec::new(),
            shells: Vec::new(),
            global: batch.nodes.iter().map(|n| n.global).collect(),
            part: batch.nodes.iter().map(|n| n.part).collect(),
            statics: Statics {
                factor: batch.nodes.iter().map(|n| settings.stiffness * n.share).collect(),
                stiffness: batch.nodes.iter().map(|n| n.stiffness).collect(),
                inverse_mass: batch.nodes.iter().map(|n| 1.0 / n.mass).collect(),
                face_stiffness: Vec::new(),
                least: batch.nodes.iter().map(|n| settings.least(n.part, n.mass)).collect(),
                face_least: Vec::new(),
            },
            only_pair: settings.only_pair(),
            smooth: settings.friction.iter().all(|&coefficient| coefficient <= 0.0),
            width,
            watch: Watch::default(),
            came_out: CameOut::default(),
            bonded: Bonded::of(batch, settings),
            sticks: settings.any_sticks(),
            work: Work::default(),
        };
        for (index, face) in index.iter_mut().zip(&batch.faces).filter(|(index, _)| **index == 0) {
            *index = contact.faces.len() as u32;
            contact.faces.push(face.nodes);
            contact.ids.push(face.id);
            contact.shells.push(super::surface::Face::is_shell(&face.corners));
            contact.parts.push(face.part);
            contact.statics.face_stiffness.push(face.stiffness);
            let lightest =
                face.nodes.map(|n| batch.nodes[n as usize].mass).into_iter().fold(f64::INFINITY, f64::min);
            contact.statics.face_least.push(settings.least(face.part, lightest));
        }
        if !contact.shells.contains(&true) {
            contact.shells.clear();
        }
        for f in &mut candidates.faces {
            *f = index[*f as usize];
        }
        contact.candidates = candidates;
        contact.came_out = CameOut::of(batch, &contact.ids);
        contact.watch =
            Watch::new(settings, &contact.candidates, &contact.faces, &contact.parts, &contact.part);
        let (mut watch, mut work) = (std::mem::take(&mut contact.watch), Work::default());
        contact.look(&mut watch, &mut work, x);
        (contact.watch, contact.work) = (watch, work);
        contact
    }

    /// Lists the candidates that can be near before nodes have moved much further.
    fn look(&self, watch: &mut Watch, work: &mut Work, x: &[Vec<f64>; 3]) {
        let Work { boxes, held, ends, .. } = work;
        let grow = WARNING.mul_add(self.settings.gap, watch.spread(&self.settings));
        boxes.measure(self.width, x, &self.faces, &watch.all, grow);
        let n = self.candidates.nodes.len();
        boxes.hold(self.width, &self.candidates, (0, n), held, ends);
        watch.take(x, &self.candidates.nodes, held, ends, &self.faces);
    }

    /// Forces of the nodes of some sets. Gives the greatest squared frequency of their springs.
    #[inline(always)]
    fn block(
        &self,
        slots: &Slots,
        sets: Range<usize>,
        work: &mut Work,
        cycle: &mut Cycle,
        books: &mut Books<'_>,
    ) -> f64 {
        let (gap, warning) = (self.settings.gap, WARNING * self.settings.gap);
        let Work { rows, closest, rest, .. } = work;
        nearest(self.width, rows, warning, slots, sets.clone(), closest, rest);
        firsts(self.width, (gap, warning), slots, sets.clone(), &work.closest, &mut work.firsts);
        work.approach.clear();
        work.lane.clear();
        work.share.clear();
        work.stacking.clear();
        work.long_way.clear();
        let base = SET * slots.of_sets(&sets).start;
        for (i, set) in sets.enumerate() {
            self.take_near(slots, (i, set), base, work);
        }
        let n = work.approach.index.len();
        if n == 0 {
            return 0.0;
        }
        let Work { approach: near, face, share, stacking, lane, .. } = work;
        // Whoever did not go the long way has the whole push.
        share.resize(n, 1.0);
        stacking.resize(n, 1.0);
        face.clear();
        face.extend(near.index.iter().map(|&i| slots.face()[base + i as usize]));
        work.near_pairs.choose(slots, lane, base, &near.index);
        // Of the last set what is left over repeats a pair and pushes nothing.
        near.fill_up();
        let filled = near.index.len();
        face.resize(filled, face[n - 1]);
        share.resize(filled, 0.0);
        stacking.resize(filled, 0.0);
        approach(self.width, &work.rows, gap, &work.near_pairs, &work.closest, near);
        for &(i, depth, direction) in &work.long_way {
            near.depth[i] = depth;
            (0..3).for_each(|a| near.direction[a][i] = direction[a]);
        }
        near.depth[n..].fill(0.0);
        if !self.bonded.is_empty() {
            self.take_bonded(n, work, cycle.history);
        }
        if self.settings.erodes {
            self.take_offsets(n, work, cycle.history);
        }
        if self.smooth { self.push(n, work, cycle, books) } else { self.rub(n, work, cycle, books) }
    }

    /// Whether an active face is a shell: nodes are outside of it wherever they are.
    #[inline(always)]
    fn is_shell(&self, face: u32) -> bool {
        !self.shells.is_empty() && self.shells[face as usize]
    }

    /// Takes the near features of the nodes of a set, the `i`-th of the block, into the lists; closest points count from
    /// lane `base` of the slots.
    #[inline(always)]
    fn take_near(&self, slots: &Slots, (i, set): (usize, usize), base: usize, work: &mut Work) {
        let firsts = &work.firsts;
        let (mut near, alone, one_sided) = (firsts.near[i], firsts.alone[i], firsts.one_sided[i]);
        let (of_set, first) = (SET * i..SET * (i + 1), (SET * set) as u32);
        if alone & one_sided == u8::MAX && self.shells.is_empty() {
            work.approach.index.extend_from_slice(&firsts.index[of_set.clone()]);
            work.approach.sign.extend_from_slice(&firsts.sign[of_set]);
            work.lane.extend(first..first + SET as u32);
            return;
        }
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let index = work.firsts.index[of_set.start + lane];
            let shell = self.is_shell(slots.face()[base + index as usize]);
            if alone >> lane & 1 == 1 && (one_sided >> lane & 1 == 1 || shell) {
                work.approach.index.push(index);
                work.approach.sign.push(if shell { 1.0 } else { work.firsts.sign[of_set.start + lane] });
                work.lane.push(first + lane as u32);
            } else {
                self.reduce(slots, (set, lane), base, work);
            }
        }
    }

    /// Takes the near features of one node, the long way.
    #[inline(never)]
    fn reduce(&self, slots: &Slots, (set, lane): (usize, usize), base: usize, work: &mut Work) {
        let (gap, warning) = (self.settings.gap, WARNING * self.settings.gap);
        let Work { closest, near, hits, beyond, rows, .. } = work;
        near.clear();
        for slot in slots.of_sets(&(set..set + 1)) {
            let at = SET * slot + lane;
            if closest.distance2[at - base] < warning * warning {
                let face = slots.face()[at];
                let (id, corners) = (self.ids[face as usize], self.faces[face as usize]);
                let mut nearest = closest.nearest(at - base);
                if self.is_shell(face) {
                    nearest.sides = OUTER;
                }
                near.push(Near { face: at as u32, id, corners, nearest });
            }
        }
        let frame = |at: u32| {
            let corners = self.faces[slots.face()[at as usize] as usize];
            Frame::new(&corners.map(|n| [0, 1, 2].map(|a| rows[n as usize][a])))
        };
        joint::reduce(near, gap, frame, hits, beyond);
        let stacking = if hits.len() > 1 { joint::stacking(hits) } else { 1.0 };
        let n_before = work.approach.index.len();
        work.share.resize(n_before, 1.0);
        work.stacking.resize(n_before, 1.0);
        let first_hit = n_before + beyond.len();
        let mut take = |at: u32, share: f64| {
            work.approach.index.push(at - base as u32);
            work.approach.sign.push(1.0);
            work.lane.push((SET * set + lane) as u32);
            work.share.push(share);
            work.stacking.push(stacking);
        };
        beyond.iter().for_each(|&i| take(near[i as usize].face, 1.0));
        hits.iter().for_each(|hit| take(near[hit.near as usize].face, hit.share));
        let long_way = hits.iter().enumerate().map(|(i, hit)| (first_hit + i, hit.depth, hit.direction));
        work.long_way.extend(long_way);
    }

    /// Forces without friction of the first `n` pushes. Gives the greatest squared frequency.
    #[inline(always)]
    fn push(&self, n: usize, work: &mut Work, cycle: &mut Cycle, books: &mut Books<'_>) -> f64 {
        let Books { vote, by_pair } = books;
        let approach = &work.approach;
        let pushes = Pushes {
            face: &work.face,
            depth: &approach.depth,
            direction: &approach.direction,
            share: &work.share,
            stacking: &work.stacking,
            weights: &approach.weights,
            hardening: self.hardening,
        };
        let (statics, pairs) = (&self.statics, &work.near_pairs);
        let quanta = (cycle.force_quantum, cycle.energy_quantum);
        let sums = force::lanes::push(self.width, statics, pairs, pushes, quanta, &mut work.terms);
        vote.hits += approach.depth.iter().map(|&depth| u64::from(depth > 0.0)).sum::<u64>();
        if sums.deepest > 0.0 && sums.deepest / self.settings.gap >= vote.worst_depth {
            // A quotient is one of the greatest only if its depth is nearly.
            let nearly = (1.0 - 1e-12) * sums.deepest;
            for (i, &depth) in approach.depth[..n].iter().enumerate().filter(|(_, depth)| **depth >= nearly) {
                let pair = (self.global[pairs.node()[i] as usize], self.ids[work.face[i] as usize]);
                vote.deepest(depth / self.settings.gap, pair);
            }
        }
        if sums.deepest > 0.0 {
            self.share_out(sums.energy, n, work, cycle.energy_quantum, &mut by_pair.energies);
        }
        if let Some(tally) = &mut by_pair.forces {
            for (i, _) in approach.depth[..n].iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
                let parts = (self.part[pairs.node()[i] as usize], self.parts[work.face[i] as usize]);
                tally.add(parts, [0, 1, 2].map(|a| work.terms[a][i]));
            }
        }
        vote.energy += sums.energy;
        vote.force_bound =
            if sums.force_bound > vote.force_bound { sums.force_bound } else { vote.force_bound };
        let n_nodes = self.global.len();
        let [fx, fy, fz] = cycle.f.each_mut().map(|f| &mut f[..n_nodes]);
        let corners = work.near_pairs.corners().each_ref().map(Vec::as_slice);
        let ends = [work.near_pairs.node(), corners[0], corners[1], corners[2], corners[3]];
        for (nodes, terms) in ends.into_iter().zip(work.terms.chunks_exact(3)) {
            for (((&node, x), y), z) in nodes[..n].iter().zip(&terms[0]).zip(&terms[1]).zip(&terms[2]) {
                fx[node as usize] += x;
                fy[node as usize] += y;
                fz[node as usize] += z;
            }
        }
        sums.frequency2
    }

    /// Books the energy of the first `n` pushes, of which some are in the zone, by pair of parts.
    fn share_out(&self, energy: f64, n: usize, work: &Work, quantum: Quantum, by_pair: &mut PairEnergies) {
        if let Some([a, b]) = self.only_pair {
            by_pair.add(a, b, energy, 0.0);
            return;
        }
        let (statics, nodes) = (&self.statics, work.near_pairs.node());
        let depths = work.approach.depth[..n].iter().enumerate();
        for (i, &depth) in depths.filter(|(_, depth)| **depth > 0.0) {
            let (node, face) = (nodes[i] as usize, work.face[i] as usize);
            let spring = self.hardening.spring_of_one(statics.stiffness(node, face) * work.share[i], depth);
            by_pair.add(self.part[node], self.parts[face], quantum.round(spring.energy), 0.0);
        }
    }

    /// Forces with friction of the first `n` pushes. Gives the greatest squared frequency.
    #[inline(always)]
    fn rub(&self, n: usize, work: &mut Work, cycle: &mut Cycle, books: &mut Books<'_>) -> f64 {
        let Books { vote, by_pair } = books;
        let (approach, statics) = (&work.approach, &self.statics);
        let mut frequency2 = 0.0_f64;
        let (mut end, mut deepest) = (0, 0);
        for i in 0..n {
            let node = work.near_pairs.node()[i] as usize;
            if self.sticks && i == end {
                (end, deepest) = stick::deepest(work.near_pairs.node(), &approach.depth, i, n);
            }
            let sticks_here = i == deepest;
            let face = work.face[i] as usize;
            let nodes = self.faces[face];
            let weights = [0, 1, 2, 3].map(|k| approach.weights[k][i]);
            let k = statics.stiffness(node, face);
            let of_corners = nodes.map(|n| statics.inverse_mass[n as usize]);
            let inverse_mass = force::inverse_mass(statics.inverse_mass[node], of_corners, &weights);
            let depth = approach.depth[i];
            let tangent = k * self.hardening.tangent_of_one(depth);
            frequency2 = frequency2.max(force::frequency2(tangent, work.stacking[i], inverse_mass));
            if depth <= 0.0 {
                continue;
            }
            vote.hits += 1;
            vote.deepest(depth / self.settings.gap, (self.global[node], self.ids[face]));
            let stiffness = k * work.share[i];
            let push = force::Push {
                stiffness,
                spring: self.hardening.spring_of_one(stiffness, depth),
                direction: [0, 1, 2].map(|a| approach.direction[a][i]),
                weights,
            };
            let between = self.part[node] as usize * self.n_parts + self.parts[face] as usize;
            let coefficient = self.settings.friction[between];
            let quanta = (cycle.force_quantum, cycle.energy_quantum);
            let reaction = if coefficient > 0.0 && self.sticks {
                let velocity = against(cycle.v, node, &nodes, &weights);
                let sticking = self.sticking(between, velocity, inverse_mass, cycle.dt);
                self.hold(&push, sticking, (node, sticks_here), quanta, cycle.history)
            } else {
                let sliding = (coefficient > 0.0).then(|| force::Sliding {
                    coefficient,
                    regular: self.settings.friction_velocity,
                    velocity: against(cycle.v, node, &nodes, &weights),
                    inverse_mass,
                    dt: cycle.dt,
                });
                force::react(&push, sliding.as_ref(), quanta, cycle.history.cycle)
            };
            vote.count(&reaction);
            let parts = (self.part[node], self.parts[face]);
            by_pair.energies.add(parts.0, parts.1, reaction.energy, reaction.friction);
            if let Some(tally) = &mut by_pair.forces {
                tally.add(parts, reaction.node);
            }
            for a in 0..3 {
                let f = &mut cycle.f[a];
                f[node] += reaction.node[a];
                for (corner, &n) in reaction.corners.iter().zip(&nodes) {
                    f[n as usize] += corner[a];
                }
            }
        }
        frequency2
    }
}

impl Pairs for NodeFace {
    fn n_listed(&self) -> usize {
        self.candidates.faces.len()
    }

    fn n_looked_at(&self) -> usize {
        self.watch.candidates.faces.len()
    }

    fn reads_velocities(&self) -> bool {
        !self.smooth
    }

    #[inline(always)]
    fn forces(&mut self, cycle: &mut Cycle<'_>, books: &mut Books<'_>) -> f64 {
        let mut work = std::mem::take(&mut self.work);
        let mut watch = std::mem::take(&mut self.watch);
        let mut frequency2 = 0.0;
        if watch.is_stale(cycle.x, &self.settings) {
            self.look(&mut watch, &mut work, cycle.x);
        }
        let n_sets = watch.slots.n_sets();
        if n_sets > 0 {
            let [x, y, z] = cycle.x;
            work.rows.clear();
            work.rows.extend(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z, 0.0]));
        }
        for first in (0..n_sets).step_by(BLOCK) {
            let sets = first..(first + BLOCK).min(n_sets);
            let voted = self.block(&watch.slots, sets, &mut work, cycle, books);
            frequency2 = if voted > frequency2 { voted } else { frequency2 };
        }
        (self.work, self.watch) = (work, watch);
        frequency2
    }
}

/// Velocity of a node against the point of a face with these weights.
#[inline(always)]
fn against(v: &[Vec<f64>; 3], node: usize, corners: &[u32; 4], weights: &[f64; 4]) -> [f64; 3] {
    let mut relative = [v[0][node], v[1][node], v[2][node]];
    for a in 0..3 {
        for i in 0..4 {
            relative[a] = (-weights[i]).mul_add(v[a][corners[i] as usize], relative[a]);
        }
    }
    relative
}

mod bonded;
mod exposed;
mod stick;
#[cfg(test)]
mod tests;
