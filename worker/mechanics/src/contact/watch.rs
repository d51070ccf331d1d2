//! Which candidates can be near soon: of the pairs that can meet before the next sort, those worth a look in every cycle.
//!
//! Most candidates are far apart for many cycles. A list of those whose boxes, grown by the zone of warning and by a
//! *spread*, hold their nodes is taken at some positions; it misses nothing while, for each pair of parts that has candidates,
//! nodes have moved against each other from those positions by no more than the spread along any axis: the rule of
//! sorts ([`reach`](super::reach)) within a batch. A pair that is not on the list is in no box, so it can neither push
//! nor vote: when the list is taken anew changes no bit.

use super::{
    Settings,
    reach::{self, Extent},
    search::Candidates,
    slots::Slots,
};
use crate::lanes::SET;

/// Spread of a list, in gaps: it lasts five cycles at the fastest that nodes may travel, and grows boxes by as much as
/// the zone of warning does.
pub(super) const SPREAD: f64 = 2.0;

/// A list counts as stale this fraction before its spread: far more than rounding of positions can hide.
const MARGIN: f64 = 1e-3;

/// Sets of nodes whose pairs are computed together: their lists fit the first cache.
pub(super) const BLOCK: usize = 8;

/// Batch nodes and active faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Listed {
    /// Nodes of pairs and of the faces, ascending.
    pub(super) nodes: Vec<u32>,
    pub(super) faces: Vec<u32>,
}

/// The list, and what says when it is stale.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    /// All nodes and faces of candidates.
    pub(super) all: Listed,
    /// Pairs on the list.
    pub(super) candidates: Candidates,
    /// The same for lanes.
    pub(super) slots: Slots,
    /// Positions at which the list was taken, by batch node; empty before the first.
    x: [Vec<f64>; 3],
    /// Runs of batch nodes of one part: part, first, end.
    runs: Vec<(u32, u32, u32)>,
    /// Corners of faces of another part than their own: part of the face, node.
    strangers: Vec<(u32, u32)>,
    /// By part.
    extents: Vec<Extent>,
    /// Part of the node and part of the face of all candidates, each once.
    meeting: Vec<(u32, u32)>,
}

impl Watch {
    /// Watches nothing yet. `candidates` with active faces, whose batch nodes and parts are `faces` and `face_part`;
    /// `part` by batch node.
    pub(super) fn new(
        settings: &Settings,
        candidates: &Candidates,
        faces: &[[u32; 4]],
        face_part: &[u32],
        part: &[u32],
    ) -> Self {
        let mut watch = Self {
            extents: vec![Extent::NONE; settings.n_parts()],
            candidates: Candidates {
                nodes: Vec::with_capacity(candidates.nodes.len()),
                starts: Vec::with_capacity(candidates.starts.len()),
                faces: Vec::with_capacity(candidates.faces.len()),
            },
            ..Self::default()
        };
        // A set has as many slots as that of its nodes with the most faces. Where nodes are left out, those of one set come
        // into two at most.
        let most = |starts: &[u32]| starts.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0) as usize;
        let sets = (0..candidates.nodes.len()).step_by(SET);
        let n_slots =
            sets.map(|first| most(&candidates.starts[first..(first + SET + 1).min(candidates.starts.len())]));
        watch.slots.reserve(candidates.nodes.len(), 2 * n_slots.sum::<usize>());
        watch.all = Listed::of(candidates, faces, part.len());
        for (node, &part) in (0..).zip(part) {
            match watch.runs.last_mut() {
                Some((of, _, end)) if *of == part => *end = node + 1,
                _ => watch.runs.push((part, node, node + 1)),
            }
        }
        for (nodes, &of) in faces.iter().zip(face_part) {
            let others = nodes.iter().filter(|&&n| part[n as usize] != of);
            watch.strangers.extend(others.map(|&n| (of, n)));
        }
        watch.strangers.sort_unstable();
        watch.strangers.dedup();
        let n_parts = settings.n_parts();
        let mut met = vec![false; n_parts * n_parts];
        for (&node, bounds) in candidates.nodes.iter().zip(candidates.starts.windows(2)) {
            let of_node = part[node as usize];
            for &face in &candidates.faces[bounds[0] as usize..bounds[1] as usize] {
                let of_face = face_part[face as usize];
                let met = &mut met[of_node as usize * n_parts + of_face as usize];
                if !std::mem::replace(met, true) {
                    watch.meeting.push((of_node, of_face));
                }
            }
        }
        watch
    }

    /// Position along the first axis at which the list has a node, in bits.
    #[cfg(test)]
    pub(super) fn taken_at(&self, node: usize) -> Option<u64> {
        self.x[0].get(node).map(|x| x.to_bits())
    }

    /// How far nodes may move against each other while a list lasts (length).
    pub(super) fn spread(&self, settings: &Settings) -> f64 {
        SPREAD * settings.gap
    }

    /// Whether nodes at `x` have moved so far that the list may miss a pair, or none has been taken.
    #[inline(always)]
    pub(super) fn is_stale(&mut self, x: &[Vec<f64>; 3], settings: &Settings) -> bool {
        if self.x[0].len() != x[0].len() {
            return true;
        }
        self.extents.fill(Extent::NONE);
        for &(part, first, end) in &self.runs {
            let extent = &mut self.extents[part as usize];
            for a in 0..3 {
                let (now, then) =
                    (&x[a][first as usize..end as usize], &self.x[a][first as usize..end as usize]);
                let (min, max) = range(now, then);
                extent.min[a] = if min < extent.min[a] { min } else { extent.min[a] };
                extent.max[a] = if max > extent.max[a] { max } else { extent.max[a] };
            }
        }
        for &(part, node) in &self.strangers {
            let n = node as usize;
            self.extents[part as usize].add([0, 1, 2].map(|a| x[a][n] - self.x[a][n]));
        }
        let limit = (1.0 - MARGIN) * self.spread(settings);
        let spread =
            |&(a, b): &(u32, u32)| reach::spread(&self.extents[a as usize], &self.extents[b as usize]);
        self.meeting.iter().any(|pair| spread(pair) > limit)
    }

    /// Takes the list anew at `x`: of `nodes` the `held` faces, up to the end of each in `ends`.
    pub(super) fn take(
        &mut self,
        x: &[Vec<f64>; 3],
        nodes: &[u32],
        held: &[u32],
        ends: &[u32],
        faces: &[[u32; 4]],
    ) {
        for (then, now) in self.x.iter_mut().zip(x) {
            then.clear();
            then.extend_from_slice(now);
        }
        let Candidates { nodes: near, starts, faces: near_faces } = &mut self.candidates;
        near.clear();
        starts.clear();
        starts.push(0);
        near_faces.clear();
        near_faces.extend_from_slice(held);
        for (&node, &end) in nodes.iter().zip(ends) {
            if starts.last() != Some(&end) {
                near.push(node);
                starts.push(end);
            }
        }
        self.slots.take(&self.candidates, faces);
    }
}

/// Least and greatest of `now - then`, in eight chains that fill lanes. The order of minima is no matter.
#[inline(always)]
fn range(now: &[f64], then: &[f64]) -> (f64, f64) {
    let (mut least, mut greatest) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
    let (nows, thens) = (now.chunks_exact(8), then.chunks_exact(8));
    let rest = nows.remainder().iter().zip(thens.remainder());
    for (now, then) in nows.zip(thens) {
        for i in 0..8 {
            let moved = now[i] - then[i];
            least[i] = if moved < least[i] { moved } else { least[i] };
            greatest[i] = if moved > greatest[i] { moved } else { greatest[i] };
        }
    }
    for (now, then) in rest {
        let moved = now - then;
        least[0] = if moved < least[0] { moved } else { least[0] };
        greatest[0] = if moved > greatest[0] { moved } else { greatest[0] };
    }
    let (mut min, mut max) = (least[0], greatest[0]);
    for i in 1..8 {
        min = if least[i] < min { least[i] } else { min };
        max = if greatest[i] > max { greatest[i] } else { max };
    }
    (min, max)
}

impl Listed {
    /// The nodes and faces of pairs, each once and ascending; `faces` gives the corners among `n_nodes`.
    fn of(pairs: &Candidates, faces: &[[u32; 4]], n_nodes: usize) -> Self {
        let (mut node_marks, mut face_marks) = (vec![false; n_nodes], vec![false; faces.len()]);
        pairs.nodes.iter().for_each(|&node| node_marks[node as usize] = true);
        for &face in &pairs.faces {
            face_marks[face as usize] = true;
            faces[face as usize].iter().for_each(|&node| node_marks[node as usize] = true);
        }
        let marked = |marks: &[bool]| (0..).zip(marks).filter(|(_, mark)| **mark).map(|(i, _)| i).collect();
        Self { nodes: marked(&node_marks), faces: marked(&face_marks) }
    }
}
