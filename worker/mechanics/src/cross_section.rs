//! Cross-sections: the force and the moment that elements pass through a cut.
//!
//! A [`CrossSection`] is a layer of elements and, of each, the corners ahead of the cut. What the side ahead does to the side behind is
//! minus the sum of the forces of these elements on these corners. Forces of a block are exact sums, so what one element adds is read
//! off as a difference: its neighbours in a lane set are masked while it is computed. Each element is still computed once, by the same
//! kernel. Every term is rounded and bounded by itself, so the sums do not depend on blocks, threads and workers.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{
    block::Block,
    element::{ElementVote, Step},
    exact::Quantum,
    lanes::{SET, Width},
    material::Material,
    mesh::Nodes,
    setup::Control,
    vectors::cross,
};

/// Elements that are cut, and which of their corners are ahead of the cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossSection {
    /// Point from which arms are measured: the mean of the corners ahead at the start (length).
    pub origin: [f64; 3],
    /// A power of two that is at least as long as the problem (length).
    pub arm: f64,
    /// Global element index, ascending, and a bit for each of its nodes ahead.
    pub elements: Vec<(u32, u16)>,
}

/// What passes through a cross-section at `t_n`: exact sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SectionVote {
    /// Force of the side ahead on the side behind.
    pub force: [f64; 3],
    /// Its moment about the origin of the section.
    pub moment: [f64; 3],
    /// Sum of the places of the corners ahead, from the origin: a node counts once for each element that has it.
    pub places: [f64; 3],
    /// Number of these corners.
    pub corners: u64,
}

impl SectionVote {
    /// Adds what other elements of the same section pass.
    pub fn merge(&mut self, other: &Self) {
        for axis in 0..3 {
            self.force[axis] += other.force[axis];
            self.moment[axis] += other.moment[axis];
            self.places[axis] += other.places[axis];
        }
        self.corners += other.corners;
    }

    /// Centre of the section now, and the moment about it; of one without elements its origin, and none.
    pub fn about_centre(&self, origin: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        if self.corners == 0 {
            return (origin, [0.0; 3]);
        }
        let centre = self.places.map(|sum| sum / self.corners as f64);
        let moved = cross(centre, self.force);
        (std::array::from_fn(|a| origin[a] + centre[a]), std::array::from_fn(|a| self.moment[a] - moved[a]))
    }
}

/// Whether the vote of a cycle must say what passes through cross-sections: its row of the history is due, or it may be the last of the
/// run, which has a row in any case. `dt` is the step before; the step of this cycle is at most [`Control::growth`] times that, so the
/// run may end with any of the last few.
pub(crate) fn are_due(row_cycles: u32, control: &Control, (cycle, time, dt): (u64, f64, f64)) -> bool {
    let longest = 1.000_001 * control.growth.max(1.0) * dt;
    cycle.is_multiple_of(u64::from(row_cycles.max(1)))
        || cycle.saturating_add(1) >= control.end_cycle
        || control.end_time - time <= longest
}

/// The part of a cross-section that a block holds.
#[derive(Clone, Debug)]
struct Held {
    /// Index of the section.
    index: u32,
    origin: [f64; 3],
    arm: f64,
    /// Binary logarithm of the terms that the whole section may have.
    bits: u32,
    vote: SectionVote,
}

/// Room that a sum leaves for each term above the bound of a force, `2^47` quanta: `2^52` over that.
const SPARE_BITS: u32 = 5;

impl Held {
    /// Takes what an element gives a node ahead at `x`: a force, and a moment of shells.
    fn add(&mut self, x: [f64; 3], force: [f64; 3], moment: [f64; 3], quantum: Quantum) {
        let bits = self.bits;
        let of_force = quantum.coarser(bits.saturating_sub(SPARE_BITS));
        let of_moment = quantum.times(self.arm).coarser(bits);
        let of_length = Quantum::for_reference(self.arm, 48 - bits as i32);
        // Terms that are farther than 32 arms, or turn more, are cut off: a sum that rounds would depend on its order.
        let term = |x: f64, quantum: Quantum| {
            let bound = quantum.coarser(52 - bits).value();
            quantum.round(x.clamp(-bound, bound))
        };
        let place: [f64; 3] = std::array::from_fn(|a| x[a] - self.origin[a]);
        let turning = cross(place, force);
        for a in 0..3 {
            self.vote.force[a] -= term(force[a], of_force);
            self.vote.moment[a] -= term(turning[a] + moment[a], of_moment);
            self.vote.places[a] += term(place[a], of_length);
        }
        self.vote.corners += 1;
    }
}

/// A lane set with elements that are cut.
#[derive(Clone, Debug)]
struct CutSet {
    set: u32,
    /// Slots of all of them.
    lanes: u8,
    /// Those that take part while the set is computed slot by slot.
    alive: u8,
    passes: Vec<Pass>,
}

/// Elements of a lane set that share no node.
#[derive(Clone, Debug)]
struct Pass {
    lanes: u8,
    /// All nodes of these elements.
    touched: Vec<u32>,
    cuts: Vec<Cut>,
}

/// An element that one section cuts.
#[derive(Clone, Debug)]
struct Cut {
    lane: u8,
    /// Place among the sections of the block.
    section: usize,
    /// Local nodes ahead, each once.
    nodes: Vec<u32>,
}

/// Everything that sections cut of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cuts {
    sections: Vec<Held>,
    /// By set, ascending.
    sets: Vec<CutSet>,
    /// Forces and moments of nodes before a pass.
    before: Vec<[f64; 6]>,
}

impl Cuts {
    /// What `sections` cut of a block.
    pub fn of(sections: &[CrossSection], block: &Block) -> Self {
        let mut cuts = Self::default();
        let mut found: Vec<(u32, Nodes, Cut)> = Vec::new();
        for (index, section) in (0..).zip(sections) {
            let before = found.len();
            for (local, element) in block.globals().enumerate() {
                let Ok(at) = section.elements.binary_search_by_key(&element, |(element, _)| *element) else {
                    continue;
                };
                let (corners, ahead, slot) =
                    (block.nodes_of(local), section.elements[at].1, block.slot(local));
                let mut nodes: Vec<u32> =
                    (0..corners.len()).filter(|i| ahead >> i & 1 == 1).map(|i| corners[i]).collect();
                nodes.sort_unstable();
                nodes.dedup();
                let cut = Cut { lane: (slot % SET) as u8, section: cuts.sections.len(), nodes };
                found.push(((slot / SET) as u32, corners, cut));
            }
            if found.len() > before {
                let terms: u64 =
                    section.elements.iter().map(|(_, ahead)| u64::from(ahead.count_ones().max(8))).sum();
                cuts.sections.push(Held {
                    index,
                    origin: section.origin,
                    arm: section.arm,
                    bits: terms.next_power_of_two().trailing_zeros(),
                    vote: SectionVote::default(),
                });
            }
        }
        found.sort_by_key(|(set, _, cut)| (*set, cut.lane, cut.section));
        for (set, corners, cut) in found {
            cuts.take_in(set, corners, cut);
        }
        cuts
    }

    /// Puts an element into the first pass of its set whose elements share no node with it.
    fn take_in(&mut self, set: u32, corners: Nodes, cut: Cut) {
        if self.sets.last().is_none_or(|last| last.set != set) {
            self.sets.push(CutSet { set, lanes: 0, alive: 0, passes: Vec::new() });
        }
        let of_set = self.sets.last_mut().expect("one was just pushed");
        let bit = 1 << cut.lane;
        of_set.lanes |= bit;
        // One element that two sections cut stays in one pass.
        let known = of_set.passes.iter().position(|pass| pass.lanes & bit != 0);
        let is_apart = |pass: &Pass| !corners.iter().any(|node| pass.touched.contains(node));
        let at = known.or_else(|| of_set.passes.iter().position(is_apart)).unwrap_or_else(|| {
            of_set.passes.push(Pass { lanes: 0, touched: Vec::new(), cuts: Vec::new() });
            of_set.passes.len() - 1
        });
        let pass = &mut of_set.passes[at];
        pass.lanes |= bit;
        pass.touched.extend_from_slice(&corners);
        pass.cuts.push(cut);
    }

    /// As [`Block::compute`], to the same bits; adds what passes through the sections.
    pub fn compute(
        &mut self,
        block: &mut Block,
        material: &Material,
        sets: &[Range<u32>],
        (step, width): (&Step, Width),
        vote: &mut ElementVote,
    ) {
        let Self { sections, sets: cut_sets, before } = self;
        let wanted = |cut: &CutSet| sets.iter().any(|range| range.contains(&cut.set));
        for cut in cut_sets.iter_mut().filter(|cut| wanted(cut)) {
            let alive = &mut block.alive_mut()[cut.set as usize];
            cut.alive = *alive;
            *alive &= !cut.lanes;
        }
        block.compute(material, sets, step, width, vote);
        for cut in cut_sets.iter().filter(|cut| wanted(cut)) {
            let at = cut.set as usize;
            for pass in cut.passes.iter().filter(|pass| pass.lanes & cut.alive != 0) {
                let takes_part = |cut_element: &&Cut| cut.alive >> cut_element.lane & 1 == 1;
                before.clear();
                for of_element in pass.cuts.iter().filter(takes_part) {
                    before.extend(of_element.nodes.iter().map(|&node| pull(block, node)));
                }
                block.alive_mut()[at] = cut.alive & pass.lanes;
                let alone = cut.set..cut.set + 1;
                block.compute(material, std::slice::from_ref(&alone), step, width, vote);
                let mut earlier = before.iter();
                for of_element in pass.cuts.iter().filter(takes_part) {
                    for (&node, earlier) in of_element.nodes.iter().zip(&mut earlier) {
                        let now = pull(block, node);
                        let given: [f64; 6] = std::array::from_fn(|i| now[i] - earlier[i]);
                        let [fx, fy, fz, mx, my, mz] = given;
                        let x = [0, 1, 2].map(|a| block.x[a][node as usize]);
                        let section = &mut sections[of_element.section];
                        section.add(x, [fx, fy, fz], [mx, my, mz], step.force_quantum);
                    }
                }
            }
            block.alive_mut()[at] = cut.alive;
        }
    }

    /// What has passed through the sections since this was asked last, by index.
    pub fn take(&mut self) -> impl Iterator<Item = (u32, SectionVote)> + '_ {
        self.sections.iter_mut().map(|held| (held.index, std::mem::take(&mut held.vote)))
    }
}

/// Force and moment that a node of a block has so far.
fn pull(block: &Block, node: u32) -> [f64; 6] {
    let n = node as usize;
    let [fx, fy, fz] = [0, 1, 2].map(|a| block.f[a][n]);
    let [mx, my, mz] = block.turning.as_ref().map_or([0.0; 3], |turning| [0, 1, 2].map(|a| turning.m[a][n]));
    [fx, fy, fz, mx, my, mz]
}
