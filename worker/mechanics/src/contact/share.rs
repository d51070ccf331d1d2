//! A batch cut into shares for threads: whole units, with what contact needs of their nodes and faces.
//!
//! A node on a face of one share may be a node of another: it is in both, and both add to its force. All sums are exact, so
//! the cut changes no bit.

use std::ops::Range;

use super::{
    batch::{Batch, BatchUnit, Listed},
    edges::BatchEdges,
    particles::BatchParticles,
    surface::Exposed,
    ties::BatchTies,
};

/// Nodes of units for which another share is worth its own lists.
const NODES: usize = 512;
/// Pairs that are listed one by one likewise.
const PAIRS: usize = 256;

/// No index.
const NONE: u32 = u32::MAX;

/// A part of a batch, a batch itself.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    pub(crate) batch: Batch,
    /// Index in the whole batch of each node, ascending.
    pub(crate) nodes: Vec<u32>,
}

/// How a batch is cut.
#[derive(Clone, Debug)]
pub(crate) struct Cut {
    units: Vec<Range<usize>>,
    edges: Vec<Range<usize>>,
    /// Ties of each.
    ties: Vec<Vec<u32>>,
    /// Particles that each computes, ascending.
    particles: Vec<Vec<u32>>,
    /// By node of the batch the share that computes it.
    owners: Vec<u32>,
}

impl Cut {
    /// Cuts a batch into `most` shares of like work, fewer if it is small; one at least.
    pub(crate) fn new(batch: &Batch, most: usize) -> Self {
        let n_nodes: usize = batch.units.iter().map(|unit| unit.nodes.len()).sum();
        let Listed { edges, ties, particles, .. } = &batch.listed;
        let n_pairs = edges.pairs.len() + ties.nodes.len() + particles.pairs.len();
        Self::into(batch, (n_nodes / NODES + n_pairs / PAIRS).clamp(1, most.max(1)))
    }

    /// Cuts a batch into `n` shares, which may be empty.
    pub(super) fn into(batch: &Batch, n: usize) -> Self {
        let n_nodes: usize = batch.units.iter().map(|unit| unit.nodes.len()).sum();
        let even = |len: usize| (0..n).map(|i| len * i / n..len * (i + 1) / n).collect();
        let (mut units, mut taken, mut first) = (Vec::with_capacity(n), 0, 0);
        for i in 1..=n {
            let mut end = first;
            while end < batch.units.len() && (i == n || taken < n_nodes * i / n) {
                taken += batch.units[end].nodes.len();
                end += 1;
            }
            units.push(first..end);
            first = end;
        }
        let mut owners = vec![NONE; batch.nodes.len()];
        for (share, units) in (0..).zip(&units) {
            for &node in batch.units[units.clone()].iter().flat_map(|unit| &unit.nodes) {
                owners[node as usize] = share;
            }
        }
        // What is kept of a node is left by one share: that of its units has its tie too.
        let mut ties = vec![Vec::new(); n];
        let n_ties = batch.listed.ties.nodes.len();
        for (tie, &[node, ..]) in batch.listed.ties.nodes.iter().enumerate() {
            let owner = &mut owners[node as usize];
            if *owner == NONE {
                *owner = (n * tie / n_ties) as u32;
            }
            ties[*owner as usize].push(tie as u32);
        }
        let listed = &batch.listed.particles;
        let mut particles = vec![Vec::new(); n];
        for (i, of_one) in listed.pairs.chunk_by(|a, b| a[0] == b[0]).enumerate() {
            let own = of_one[0][0];
            let owner = &mut owners[listed.particles[own as usize].node as usize];
            if *owner == NONE {
                *owner = (n * i / listed.particles.len()) as u32;
            }
            particles[*owner as usize].push(own);
        }
        owners.iter_mut().filter(|owner| **owner == NONE).for_each(|owner| *owner = 0);
        Self { units, edges: even(batch.listed.edges.pairs.len()), ties, particles, owners }
    }

    /// Number of shares.
    pub(crate) fn len(&self) -> usize {
        self.units.len()
    }

    /// By node of the batch the share that has it in a unit, which knows all faces that it may meet, or as a tied node or a particle of its own; 0 for nodes
    /// of none, which that share need not have.
    pub(crate) fn owners(&self) -> &[u32] {
        &self.owners
    }

    /// One of the shares.
    pub(crate) fn share(&self, batch: &Batch, share: usize) -> Share {
        let units = &batch.units[self.units[share].clone()];
        let Listed { edges, ties, particles: listed, exposed } = &batch.listed;
        let pairs = &edges.pairs[self.edges[share].clone()];
        let ties: Vec<[u32; 5]> = self.ties[share].iter().map(|&tie| ties.nodes[tie as usize]).collect();
        let pairs_of = |own: u32| {
            let first = listed.pairs.partition_point(|pair| pair[0] < own);
            let n = listed.pairs[first..].partition_point(|pair| pair[0] == own);
            &listed.pairs[first..first + n]
        };
        let presses: Vec<[u32; 2]> =
            self.particles[share].iter().flat_map(|&own| pairs_of(own)).copied().collect();

        let mut faces = Indices::new(batch.faces.len());
        let mut edge_indices = Indices::new(edges.edges.len());
        let mut particles = Indices::new(listed.particles.len());
        let mut nodes = Indices::new(batch.nodes.len());
        units.iter().flat_map(|unit| &unit.faces).for_each(|&face| faces.mark(face));
        pairs.iter().flatten().for_each(|&edge| edge_indices.mark(edge));
        presses.iter().flatten().for_each(|&particle| particles.mark(particle));
        let (faces, edge_indices, particles) = (faces.number(), edge_indices.number(), particles.number());
        units.iter().flat_map(|unit| &unit.nodes).for_each(|&node| nodes.mark(node));
        faces
            .list
            .iter()
            .flat_map(|&face| batch.faces[face as usize].nodes)
            .for_each(|node| nodes.mark(node));
        let of_edges = edge_indices.list.iter().flat_map(|&edge| edges.edges[edge as usize].nodes);
        of_edges.for_each(|node| nodes.mark(node));
        ties.iter().flatten().for_each(|&node| nodes.mark(node));
        let of_particles = particles.list.iter().map(|&particle| listed.particles[particle as usize].node);
        of_particles.for_each(|node| nodes.mark(node));
        let nodes = nodes.number();

        let excluded = batch.excluded.iter().copied().filter(|&(node, face)| {
            let known = batch.nodes.binary_search_by_key(&node, |n| n.global);
            let face = batch.faces.binary_search_by_key(&face, |f| f.id);
            known.is_ok_and(|at| nodes.has(at)) && face.is_ok_and(|at| faces.has(at))
        });
        let of_unit = |unit: &BatchUnit| BatchUnit {
            nodes: unit.nodes.iter().map(|&node| nodes.of(node)).collect(),
            faces: unit.faces.iter().map(|&face| faces.of(face)).collect(),
        };
        let came_out = exposed.nodes.iter().filter(|&&node| nodes.has(node as usize));
        let batch = Batch {
            nodes: nodes.taken(&batch.nodes, |_| {}),
            faces: faces.taken(&batch.faces, |face| face.nodes = face.nodes.map(|node| nodes.of(node))),
            units: units.iter().map(of_unit).collect(),
            excluded: excluded.collect(),
            listed: Listed {
                edges: BatchEdges {
                    edges: edge_indices
                        .taken(&edges.edges, |edge| edge.nodes = edge.nodes.map(|node| nodes.of(node))),
                    pairs: pairs.iter().map(|pair| pair.map(|edge| edge_indices.of(edge))).collect(),
                },
                ties: BatchTies { nodes: ties.iter().map(|tie| tie.map(|node| nodes.of(node))).collect() },
                particles: BatchParticles {
                    particles: particles
                        .taken(&listed.particles, |particle| particle.node = nodes.of(particle.node)),
                    pairs: presses.iter().map(|pair| pair.map(|particle| particles.of(particle))).collect(),
                },
                exposed: Exposed {
                    at: exposed.at,
                    nodes: came_out.map(|&node| nodes.of(node)).collect(),
                    faces: exposed.faces.clone(),
                    particles: Vec::new(),
                },
            },
        };
        Share { batch, nodes: nodes.list }
    }
}

/// Some of the entries of a list, and their numbers among themselves.
struct Indices {
    number: Vec<u32>,
    list: Vec<u32>,
}

impl Indices {
    fn new(n: usize) -> Self {
        Self { number: vec![NONE; n], list: Vec::new() }
    }

    fn mark(&mut self, index: u32) {
        self.number[index as usize] = 0;
    }

    /// Numbers those that are marked in ascending order.
    fn number(mut self) -> Self {
        for (index, number) in (0..).zip(&mut self.number).filter(|(_, number)| **number != NONE) {
            *number = self.list.len() as u32;
            self.list.push(index);
        }
        self
    }

    fn has(&self, index: usize) -> bool {
        self.number[index] != NONE
    }

    /// Copies of the marked entries of `all`, each as `change` makes it.
    fn taken<T: Copy>(&self, all: &[T], change: impl Fn(&mut T)) -> Vec<T> {
        let mut taken: Vec<T> = self.list.iter().map(|&index| all[index as usize]).collect();
        taken.iter_mut().for_each(change);
        taken
    }

    fn of(&self, index: u32) -> u32 {
        self.number[index as usize]
    }
}
