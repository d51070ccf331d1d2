//! An estimate of the exchange of partial forces in a cycle, from which follows when the slowest worker ends it.
//!
//! Every worker computes its contact and border elements and sends each neighbour a frame, in the order of the workers. A frame costs the
//! processors at both ends, occupies the wire out of the sender, travels, and occupies the wire into the receiver; those between two regions queue on one
//! way before that. Interior elements are computed beside all that. A worker integrates when it has computed all elements and taken in all
//! frames, and its vote leaves after its frames. It is what [`crate::simulate::virtual_clock`] charges, for one cycle that all begin at once.

use std::collections::BTreeMap;

use mechanics::{mesh::Mesh, piece::Region};

use super::{Fleet, Subdomain, grids::Cells};
use crate::balance::{Base, Costs, FAR_BYTE};

/// Bytes of a frame beside its partial forces.
const FRAME_BYTES: f64 = 64.0;
/// Bytes of the partial force on a node.
const FORCE_BYTES: f64 = 24.0;

/// What each worker holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Living elements.
    pub elements: f64,
    pub nodes: f64,
    /// Pairs of nodes and faces.
    pub pairs: f64,
    /// Messages that its place in the tree of votes costs.
    pub votes: f64,
}

impl Held {
    /// Element-cycles of elements, nodes and pairs.
    pub fn work(&self, costs: Costs) -> f64 {
        costs.node.mul_add(self.nodes, self.before_nodes(costs))
    }

    /// Element-cycles of what a worker does before it integrates its nodes.
    fn before_nodes(&self, costs: Costs) -> f64 {
        costs.pair.mul_add(self.pairs, self.elements)
    }
}

/// Elements at a border: across I, J and K, and on a seam. Those across different axes are the same where a border has its edges.
pub type Border = [f64; 4];

/// What two workers share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shared {
    pub workers: [u32; 2],
    pub nodes: f64,
    /// Elements of each that touch the other's.
    pub border: Border,
}

/// What workers share in structured parts.
pub struct Exchange {
    /// By worker, ascending: others and how many nodes it shares with them.
    neighbours: Vec<Vec<(u32, f64)>>,
    /// By worker: elements that touch the nodes that it shares.
    border: Vec<Border>,
    /// Bytes that a shared node takes in a frame.
    node_bytes: f64,
}

/// A frame on its way.
struct Frame {
    from: u32,
    to: u32,
    /// When its first bits reach the wire into the receiver.
    enters: f64,
    bytes: f64,
}

impl Exchange {
    /// Of sub-domains of `n` workers, of which different parts share so much ([`super::seams::Seams::between`]).
    pub fn new(mesh: &Mesh, subdomains: &[Subdomain], n: usize, mut shared: Vec<Shared>) -> Self {
        for part in subdomains.chunk_by(|one, other| one.part == other.part) {
            shared_in_part(part, &mut shared);
        }
        let with_moments = mesh.parts.iter().any(mechanics::mesh::Part::turns_nodes);
        let node_bytes = if with_moments { 2.0 * FORCE_BYTES } else { FORCE_BYTES };
        Self::of(shared, n, node_bytes)
    }

    /// Of what pairs of workers share.
    pub fn of(mut shared: Vec<Shared>, n: usize, node_bytes: f64) -> Self {
        shared.iter_mut().for_each(|pair| pair.workers.sort_unstable());
        shared.sort_by_key(|pair| pair.workers);
        let mut neighbours: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        let mut border = vec![Border::default(); n];
        for same in shared.chunk_by(|a, b| a.workers == b.workers) {
            let nodes = same.iter().map(|pair| pair.nodes).sum();
            let [one, other] = same[0].workers;
            for (worker, other) in [(one, other), (other, one)] {
                neighbours[worker as usize].push((other, nodes));
                for (axis, elements) in same.iter().flat_map(|pair| pair.border.into_iter().enumerate()) {
                    border[worker as usize][axis] += elements;
                }
            }
        }
        neighbours.iter_mut().for_each(|others| others.sort_unstable_by_key(|(other, _)| *other));
        Self { neighbours, border, node_bytes }
    }

    /// By worker, ascending: others that share nodes with it.
    pub fn neighbours(&self) -> Vec<Vec<u32>> {
        let of = |others: &Vec<(u32, f64)>| others.iter().map(|(other, _)| *other).collect();
        self.neighbours.iter().map(of).collect()
    }

    /// Copies of its nodes that others hold, by worker.
    #[cfg(test)]
    pub fn copies(&self) -> Vec<f64> {
        self.neighbours.iter().map(|others| others.iter().map(|(_, nodes)| nodes).sum()).collect()
    }

    /// What each worker does in a cycle, contact included, and when it ends it.
    pub fn cycle(&self, held: &[Held], fleet: Fleet<'_>, costs: Costs) -> Vec<Base> {
        let speeds = fleet.speeds;
        let bytes_of = |nodes: f64| self.node_bytes.mul_add(nodes, FRAME_BYTES);
        let handling = |bytes: f64| costs.copy.mul_add(bytes, costs.message);
        let mut frames: Vec<Frame> = Vec::with_capacity(self.neighbours.iter().map(Vec::len).sum());
        // By worker: when it has handed over its frames and when they have left, and what messages take of it.
        let mut sent: Vec<(f64, f64, f64)> = Vec::with_capacity(speeds.len());
        for (worker, (((others, border), held), speed)) in
            (0..).zip(self.neighbours.iter().zip(&self.border).zip(held).zip(speeds))
        {
            let border = costs.pair.mul_add(held.pairs, overlapping(*border, held.elements)) / speed;
            let (mut now, mut wire) = (border, 0.0_f64);
            for &(to, nodes) in others {
                let bytes = bytes_of(nodes);
                now += handling(bytes) / speed;
                let leaves = wire.max(now);
                wire = costs.byte.mul_add(bytes, leaves);
                frames.push(Frame { from: worker, to, enters: leaves + costs.travel, bytes });
            }
            // As many come in, of the same lengths.
            sent.push((now, wire, 2.0 * (now - border)));
        }
        pass_between_regions(&mut frames, fleet, costs);
        frames.sort_by(|a, b| a.to.cmp(&b.to).then(a.enters.total_cmp(&b.enters)));
        let mut frames = frames.into_iter().peekable();
        let mut cycle = Vec::with_capacity(speeds.len());
        for (worker, ((held, speed), (sent, left, messages))) in (0..).zip(held.iter().zip(speeds).zip(sent))
        {
            let (mut wire, mut done) = (0.0_f64, sent);
            while let Some(Frame { enters, bytes, .. }) = frames.next_if(|frame| frame.to == worker) {
                wire = costs.byte.mul_add(bytes, wire.max(enters));
                done = done.max(wire) + handling(bytes) / speed;
            }
            let computed = costs.message.mul_add(held.votes, held.before_nodes(costs)) / speed + messages;
            let nodes = costs.node * held.nodes / speed;
            // Its vote queues behind its frames.
            let end = (done.max(computed) + nodes).max(left);
            cycle.push(Base { busy: (computed + nodes) * speed, end: end * speed });
        }
        cycle
    }
}

/// Frames from one region to another queue on the one way out of it.
fn pass_between_regions(frames: &mut [Frame], fleet: Fleet<'_>, costs: Costs) {
    let is_far = |frame: &&mut Frame| !fleet.are_near(frame.from as usize, frame.to as usize);
    let mut far: Vec<&mut Frame> = frames.iter_mut().filter(is_far).collect();
    far.sort_by(|a, b| a.enters.total_cmp(&b.enters));
    let mut ways: BTreeMap<u32, f64> = BTreeMap::new();
    for frame in far {
        let way = ways.entry(fleet.region(frame.from as usize)).or_default();
        *way = (FAR_BYTE * costs.byte).mul_add(frame.bytes, way.max(frame.enters));
        frame.enters = *way;
    }
}

/// How many of so many elements are at borders. What is inside across one axis is as often inside across the others.
pub fn overlapping(borders: Border, elements: f64) -> f64 {
    let inside = |border: f64| (1.0 - border / elements).max(0.0);
    if elements > 0.0 { elements * (1.0 - borders.into_iter().map(inside).product::<f64>()) } else { 0.0 }
}

/// Nodes that sub-domains of different workers share in one structured part.
fn shared_in_part(part: &[Subdomain], shared: &mut Vec<Shared>) {
    let mut boxes: Vec<(Cells, u32)> = part
        .iter()
        .filter_map(|s| match s.region {
            Region::Cells { low, high } => Some((Cells { low, high }, s.worker as u32)),
            Region::List(_) => None,
        })
        .collect();
    if boxes.is_empty() {
        return;
    }
    // A sweep along the axis across which boxes are thinnest.
    let thickness = |a: usize| {
        let planes = boxes.iter().map(|(cells, _)| cells.high[a]).max().unwrap_or(0);
        boxes.iter().map(|(cells, _)| f64::from(cells.high[a] - cells.low[a])).sum::<f64>()
            / f64::from(planes)
    };
    let thicknesses = [0, 1, 2].map(thickness);
    let axis = (0..3).fold(0, |best, a| if thicknesses[a] < thicknesses[best] { a } else { best });
    boxes.sort_by_key(|(cells, _)| cells.low[axis]);
    let mut open: Vec<(Cells, u32)> = Vec::new();
    for (cells, worker) in boxes {
        open.retain(|(other, _)| other.high[axis] >= cells.low[axis]);
        for (other, of) in &open {
            let nodes = cells.nodes_shared_with(other);
            if *of != worker && nodes > 0.0 {
                shared.push(Shared { workers: [worker, *of], nodes, border: cells.border_with(other) });
            }
        }
        open.push((cells, worker));
    }
}
