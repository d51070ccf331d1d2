//! One cycle of contact: from the candidate list through the zone to forces.
//!
//! The only place that knows search, geometry and force. Gather: corners of faces to boxes; compute: near
//! features, hits, reactions; scatter: into the force arrays, in any order because all terms are exact.

use super::{
    ContactVote, Exclusions, Settings, WARNING, force,
    joint::{self, Hit, Near},
    search::{self, Bounds, Candidates},
    sort::sort,
    surface::Surface,
    work_unit::Batch,
    zone::Frame,
};
use crate::exact::Quantum;

/// A pair at exactly one gap is outside the zone, rounding or not: only nearer ones by this fraction are
/// inside it at time zero.
const INSIDE: f64 = 1e-9;

/// Pairs that interact and are inside the zone already: surface node, surface face, distance, by node then
/// face. `x` by surface node. Pairs of one part are to be excluded ([`Exclusions`]); between parts the deck is
/// at fault.
pub fn initial_pairs(surface: &Surface, x: &[[f64; 3]], settings: &Settings) -> Vec<(u32, u32, f64)> {
    let mut pairs = Vec::new();
    for unit in sort(surface, x, settings, &Exclusions::default()) {
        for &f in &unit.faces {
            let face = &surface.faces[f as usize];
            let corners = face.nodes.map(|n| x[n as usize]);
            let bounds = Bounds::of(&corners, settings.gap);
            for &n in &unit.nodes {
                let p = x[n as usize];
                if bounds.holds(p)
                    && settings.permits(surface.node_part[n as usize], face.part)
                    && !face.own.contains(&n)
                {
                    let distance = Frame::new(&corners).nearest(p).distance2.sqrt();
                    if distance < settings.gap * (1.0 - INSIDE) {
                        pairs.push((n, f, distance));
                    }
                }
            }
        }
    }
    pairs.sort_unstable_by_key(|&(n, f, _)| (n, f));
    pairs
}

/// A face that has candidates, as the cycle needs it.
#[derive(Clone, Copy, Debug)]
struct ActiveFace {
    /// Batch nodes.
    nodes: [u32; 4],
    /// Global nodes of the same corners.
    corners: [u32; 4],
    id: u32,
    part: u32,
    stiffness: f64,
}

/// A face without a frame in this cycle.
const UNFRAMED: u32 = u32::MAX;

/// The contact of one batch, from one sort to the next.
#[derive(Clone, Debug)]
pub struct Contact {
    settings: Settings,
    n_parts: usize,
    /// Pairs that can meet; `faces` are indices into `active`.
    candidates: Candidates,
    active: Vec<ActiveFace>,
    /// By batch node.
    global: Vec<u32>,
    part: Vec<u32>,
    stiffness: Vec<f64>,
    /// The deck's factor times the node's share.
    factor: Vec<f64>,
    inverse_mass: Vec<f64>,
    /// Corners and boxes of the active faces, and frames of those that a node is near.
    corners: Vec<[[f64; 3]; 4]>,
    bounds: Vec<Bounds>,
    frames: Vec<Frame>,
    /// Place of each active face in `frames`, or [`UNFRAMED`].
    framed: Vec<u32>,
    /// Work space of one node.
    near: Vec<Near>,
    hits: Vec<Hit>,
    beyond: Vec<u32>,
}

/// Arrays of one cycle, by batch node index.
struct Cycle<'a> {
    x: &'a [Vec<f64>; 3],
    v: &'a [Vec<f64>; 3],
    dt: f64,
    force_quantum: Quantum,
    energy_quantum: Quantum,
    f: &'a mut [Vec<f64>; 3],
}

impl Contact {
    /// Takes the pairs of a batch that can meet before the next sort. `x` by batch node, at any moment at
    /// which no spread since the sort exceeds the slack.
    ///
    /// # Panics
    /// If the batch is not sound ([`Batch::is_sound`]) or `x` has fewer nodes.
    pub fn new(batch: &Batch, settings: &Settings, x: &[Vec<f64>; 3]) -> Self {
        let mut candidates = search::candidates(batch, settings, x);
        let mut index = vec![u32::MAX; batch.faces.len()];
        for &f in &candidates.faces {
            index[f as usize] = 0;
        }
        let mut active = Vec::new();
        for (index, face) in index.iter_mut().zip(&batch.faces).filter(|(index, _)| **index == 0) {
            *index = active.len() as u32;
            active.push(ActiveFace {
                nodes: face.nodes,
                corners: face.nodes.map(|n| batch.nodes[n as usize].global),
                id: face.id,
                part: face.part,
                stiffness: face.stiffness,
            });
        }
        for f in &mut candidates.faces {
            *f = index[*f as usize];
        }
        let most = candidates.starts.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0);
        Self {
            n_parts: settings.n_parts(),
            settings: settings.clone(),
            candidates,
            corners: Vec::with_capacity(active.len()),
            bounds: Vec::with_capacity(active.len()),
            frames: Vec::with_capacity(active.len()),
            framed: Vec::with_capacity(active.len()),
            active,
            global: batch.nodes.iter().map(|n| n.global).collect(),
            part: batch.nodes.iter().map(|n| n.part).collect(),
            stiffness: batch.nodes.iter().map(|n| n.stiffness).collect(),
            factor: batch.nodes.iter().map(|n| settings.stiffness * n.share).collect(),
            inverse_mass: batch.nodes.iter().map(|n| 1.0 / n.mass).collect(),
            near: Vec::with_capacity(most),
            hits: Vec::with_capacity(most),
            beyond: Vec::with_capacity(most),
        }
    }

    /// Number of node-face pairs on the candidate list.
    pub fn n_pairs(&self) -> usize {
        self.candidates.faces.len()
    }

    /// Adds the contact forces at positions `x` into `f`, and says what they mean for the cycle.
    ///
    /// `v` is the velocity of half a step ago and serves friction only. Arrays by batch node.
    pub fn forces(
        &mut self,
        x: &[Vec<f64>; 3],
        v: &[Vec<f64>; 3],
        dt: f64,
        force_quantum: Quantum,
        energy_quantum: Quantum,
        f: &mut [Vec<f64>; 3],
    ) -> ContactVote {
        let cycle = Cycle { x, v, dt, force_quantum, energy_quantum, f };
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the feature has just been detected.
            return unsafe { self.forces_with_fma(cycle) };
        }
        self.forces_with(cycle)
    }

    /// [`Contact::forces_with`] compiled with fused multiply-add, which without it is a slow library call of
    /// the same bits.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "fma")]
    fn forces_with_fma(&mut self, cycle: Cycle) -> ContactVote {
        self.forces_with(cycle)
    }

    #[inline(always)]
    fn forces_with(&mut self, mut cycle: Cycle) -> ContactVote {
        let warning = WARNING * self.settings.gap;
        self.gather(cycle.x, warning);
        let mut vote = ContactVote { pairs: self.candidates.faces.len() as u64, ..ContactVote::default() };
        let mut frequency2 = 0.0;
        for i in 0..self.candidates.nodes.len() {
            let node = self.candidates.nodes[i];
            let p = cycle.x.each_ref().map(|x| x[node as usize]);
            self.near.clear();
            let range = self.candidates.starts[i] as usize..self.candidates.starts[i + 1] as usize;
            for &f in &self.candidates.faces[range] {
                if self.bounds[f as usize].holds(p) {
                    let framed = &mut self.framed[f as usize];
                    if *framed == UNFRAMED {
                        *framed = self.frames.len() as u32;
                        self.frames.push(Frame::new(&self.corners[f as usize]));
                    }
                    let nearest = self.frames[*framed as usize].nearest(p);
                    if nearest.distance2 < warning * warning {
                        let face = &self.active[f as usize];
                        self.near.push(Near { face: f, id: face.id, corners: face.corners, nearest });
                    }
                }
            }
            if !self.near.is_empty() {
                let voted = self.node(node, p, &mut cycle, &mut vote);
                frequency2 = if voted > frequency2 { voted } else { frequency2 };
            }
        }
        vote.dt = force::time_step(frequency2);
        vote
    }

    /// Corners and boxes of the active faces; no frames yet.
    #[inline(always)]
    fn gather(&mut self, x: &[Vec<f64>; 3], warning: f64) {
        let at = |n: u32| x.each_ref().map(|x| x[n as usize]);
        self.corners.clear();
        self.corners.extend(self.active.iter().map(|face| face.nodes.map(at)));
        self.bounds.clear();
        self.bounds.extend(self.corners.iter().map(|corners| Bounds::of(corners, warning)));
        self.frames.clear();
        self.framed.clear();
        self.framed.resize(self.active.len(), UNFRAMED);
    }

    /// Forces of one node at `p` and its near faces. Gives the greatest squared frequency of its springs.
    #[inline(always)]
    fn node(&mut self, node: u32, p: [f64; 3], cycle: &mut Cycle, vote: &mut ContactVote) -> f64 {
        let n = node as usize;
        let (frames, framed) = (&self.frames, &self.framed);
        let frame = |f: u32| &frames[framed[f as usize] as usize];
        joint::reduce(&mut self.near, self.settings.gap, frame, &mut self.hits, &mut self.beyond);
        let stacking = if self.hits.len() > 1 { joint::stacking(&self.hits) } else { 1.0 };
        let mut frequency2 = 0.0_f64;
        for &i in &self.beyond {
            let near = &self.near[i as usize];
            let face = &self.active[near.face as usize];
            let k = force::stiffness(self.factor[n], self.stiffness[n], face.stiffness);
            let weights = frame(near.face).weights(&near.nearest, p);
            let inverse_mass = self.pair_inverse_mass(n, face, &weights);
            frequency2 = frequency2.max(force::frequency2(k, stacking, inverse_mass));
        }
        for hit in &self.hits {
            let near = &self.near[hit.near as usize];
            let face = &self.active[near.face as usize];
            vote.deepest(hit.depth / self.settings.gap, (self.global[n], face.id));
            let k = force::stiffness(self.factor[n], self.stiffness[n], face.stiffness);
            let weights = frame(near.face).weights(&near.nearest, p);
            let inverse_mass = self.pair_inverse_mass(n, face, &weights);
            frequency2 = frequency2.max(force::frequency2(k, stacking, inverse_mass));
            let push =
                force::Push { stiffness: k * hit.share, depth: hit.depth, direction: hit.direction, weights };
            let coefficient =
                self.settings.friction[self.part[n] as usize * self.n_parts + face.part as usize];
            let sliding = (coefficient > 0.0).then(|| force::Sliding {
                coefficient,
                regular: self.settings.friction_velocity,
                velocity: against(cycle.v, n, &face.nodes, &weights),
                inverse_mass,
                dt: cycle.dt,
            });
            let reaction = force::react(&push, sliding.as_ref(), cycle.force_quantum, cycle.energy_quantum);
            vote.count(&reaction);
            for a in 0..3 {
                let f = &mut cycle.f[a];
                f[n] += reaction.node[a];
                for i in 0..4 {
                    f[face.nodes[i] as usize] += reaction.corners[i][a];
                }
            }
        }
        frequency2
    }

    #[inline(always)]
    fn pair_inverse_mass(&self, node: usize, face: &ActiveFace, weights: &[f64; 4]) -> f64 {
        force::inverse_mass(
            self.inverse_mass[node],
            face.nodes.map(|n| self.inverse_mass[n as usize]),
            weights,
        )
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{BatchFace, BatchNode, BatchUnit};

    #[test]
    fn with_and_without_fused_multiply_add_instructions_the_bits_are_equal() {
        let mut seed = 3_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        // 64 warped faces, each with a node somewhere in its zone.
        let (mut batch, mut x) = (Batch::default(), [vec![], vec![], vec![]]);
        for i in 0..64_u32 {
            for corner in [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0.5, 0.5, 0.0]] {
                let global = batch.nodes.len() as u32;
                let part = u32::from(corner[0] == 0.5);
                batch.nodes.push(BatchNode {
                    global,
                    part,
                    mass: 1.0 + random(),
                    stiffness: 1.0 + random(),
                    share: 0.25 + 0.75 * random(),
                });
                for a in 0..3 {
                    x[a].push(corner[a] + 0.3 * random() + if a == 0 { 10.0 * f64::from(i) } else { 0.0 });
                }
            }
            let nodes = [0, 1, 2, 3].map(|c| 5 * i + c);
            let corners = [u32::MAX; 8];
            batch.faces.push(BatchFace { nodes, id: i, part: 0, stiffness: 1.0 + random(), corners });
            batch.units.push(BatchUnit { nodes: vec![5 * i + 4], faces: vec![i] });
        }
        let settings = Settings {
            gap: 0.4,
            slack: 0.1,
            friction: vec![0.3; 4],
            interacts: vec![true; 4],
            stiffness: 0.5,
            friction_velocity: 1e-3,
        };
        let mut contact = Contact::new(&batch, &settings, &x);
        let v = [x[1].clone(), x[2].clone(), x[0].clone()];
        let mut run = |fused: bool| {
            let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            let force_quantum = Quantum::for_reference(1.0, 50);
            let energy_quantum = force_quantum;
            let cycle = Cycle { x: &x, v: &v, dt: 0.1, force_quantum, energy_quantum, f: &mut f };
            let vote = if fused {
                let vote = contact.forces(&x, &v, 0.1, force_quantum, energy_quantum, cycle.f);
                assert!(vote.hits > 40, "{vote:?}");
                vote
            } else {
                contact.forces_with(cycle)
            };
            (vote, f.iter().flatten().map(|f| f.to_bits()).collect::<Vec<u64>>())
        };
        assert_eq!(run(true), run(false));
    }
}
