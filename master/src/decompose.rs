//! Decomposition: which worker holds which part of the Lagrange grids, in proportion to speeds.
//!
//! Every part is cut among all workers, with the same grouping of workers for all parts, so that facing columns of
//! neighbouring parts fall on one worker. Structured parts are cut along index planes (paper section 3), explicit
//! ones by recursive coordinate bisection. Columns and slabs that are cut along two axes or one share nodes with fewer others than blocks
//! do, which pays where messages cost more than nodes and wires are fast. The best of several groupings and sets of axes wins, by the
//! slowest finish of elements, nodes ([`work`]) and messages. Elements that have eroded cost nothing ([`Living`]); they are dealt out
//! all the same, since their state is still held.

use std::collections::BTreeSet;

use mechanics::{
    mesh::{Mesh, Topology},
    piece::Region,
};

use crate::balance::Costs;

/// A sub-domain: a region of a part on a worker.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdomain {
    /// Part index.
    pub part: usize,
    /// Its elements.
    pub region: Region,
    /// Worker index.
    pub worker: usize,
}

/// How many orders of the workers are tried; the best by the bound wins.
const GROUPINGS: u64 = 25;

/// How often a grouping is cut again, each time for shares corrected by what came of the last.
const CORRECTIONS: usize = 4;

/// Cuts the mesh for workers of these relative speeds. Sub-domains come part by part, shells first; those without elements are left
/// out, so a worker may have none in a small problem. `alive` says by global index which elements cost anything; all do
/// where it is none.
pub fn decompose(mesh: &Mesh, speeds: &[f64], costs: Costs, alive: Option<&[bool]>) -> Vec<Subdomain> {
    let living = Living::new(mesh, alive);
    let mut best: Option<(f64, Vec<Subdomain>)> = None;
    let equal = speeds.iter().all(|s| *s == speeds[0]);
    let is_structured = |part: &mechanics::mesh::Part| matches!(part.topology, Topology::Structured { .. });
    let choices = if costs.message > 0.0 && mesh.parts.iter().any(is_structured) { AXES } else { &AXES[..1] };
    for seed in 0..if speeds.len() < 3 || equal { 1 } else { GROUPINGS } {
        let order = grouping(speeds, seed);
        for axes in choices {
            let mut shares = speeds.to_vec();
            for _ in 0..if equal { 1 } else { CORRECTIONS } {
                let subdomains = cut_all(mesh, &shares, (&order, axes), &living);
                let work = work(&subdomains, speeds.len(), costs.node, &living);
                let finish = slowest(&work, speeds);
                let mean = work.iter().sum::<f64>() / speeds.iter().sum::<f64>();
                // Ragged pieces have more nodes: their workers get fewer elements in the next try.
                for ((share, work), speed) in shares.iter_mut().zip(&work).zip(speeds) {
                    *share *= if *work > 0.0 { mean * speed / work } else { 1.0 };
                }
                // An equal finish keeps the earlier grouping, and the first is the order the user gave.
                let is_better =
                    |finish: f64| best.as_ref().is_none_or(|(least, _)| finish < *least * (1.0 - 1e-9));
                if !is_better(finish) {
                    continue;
                }
                let finish = if costs.message > 0.0 {
                    let shared = Shared::new(&subdomains, speeds.len());
                    shared.slowest(&shared.add_messages(work, costs.message), speeds, costs.byte)
                } else {
                    finish
                };
                if is_better(finish) {
                    best = Some((finish, subdomains));
                }
            }
        }
    }
    best.map(|(_, subdomains)| subdomains).unwrap_or_default()
}

/// What each worker's sub-domains cost in a cycle (element-cycles): living elements, nodes, and messages to those that share nodes.
pub fn held(subdomains: &[Subdomain], n: usize, costs: Costs, living: &Living) -> Vec<f64> {
    let work = work(subdomains, n, costs.node, living);
    if costs.message > 0.0 { Shared::new(subdomains, n).add_messages(work, costs.message) } else { work }
}

/// The last finish.
fn slowest(work: &[f64], speeds: &[f64]) -> f64 {
    work.iter().zip(speeds).map(|(w, s)| w / s).fold(0.0, f64::max)
}

/// How much longer than its bytes an exchange takes: frames of several neighbours follow each other, and both sides wait for the last.
const WIRE: f64 = 2.0;

/// What workers share in structured parts.
struct Shared {
    /// By worker: others with which it shares nodes.
    neighbours: Vec<u32>,
    /// By worker: copies of its nodes that others hold.
    nodes: Vec<f64>,
}

impl Shared {
    fn new(subdomains: &[Subdomain], n: usize) -> Self {
        let boxes: Vec<(usize, Cells, usize)> = subdomains
            .iter()
            .filter_map(|s| match s.region {
                Region::Cells { low, high } => Some((s.part, Cells { low, high }, s.worker)),
                Region::List(_) => None,
            })
            .collect();
        let mut shared = Self { neighbours: vec![0; n], nodes: vec![0.0; n] };
        let mut pairs = BTreeSet::new();
        for (at, (part, cells, worker)) in boxes.iter().enumerate() {
            for (other_part, other_cells, other) in &boxes[at + 1..] {
                let nodes = cells.nodes_shared_with(other_cells);
                if part == other_part && worker != other && nodes > 0.0 {
                    pairs.insert((*worker.min(other), *worker.max(other)));
                    shared.nodes[*worker] += nodes;
                    shared.nodes[*other] += nodes;
                }
            }
        }
        for (one, other) in pairs {
            shared.neighbours[one] += 1;
            shared.neighbours[other] += 1;
        }
        shared
    }

    /// Adds what messages cost: two for each neighbour.
    fn add_messages(&self, mut work: Vec<f64>, message: f64) -> Vec<f64> {
        for (work, &neighbours) in work.iter_mut().zip(&self.neighbours) {
            *work += 2.0 * message * f64::from(neighbours);
        }
        work
    }

    /// The last finish, with partial forces of three numbers by node on a wire in each direction: they travel while elements are computed
    /// that touch no other worker's, of which there are fewer by about the shared nodes.
    fn slowest(&self, work: &[f64], speeds: &[f64], byte: f64) -> f64 {
        let finish = |((work, speed), nodes): ((&f64, &f64), &f64)| {
            let beside = (work - nodes).max(0.0) / speed;
            work / speed + (WIRE * 24.0 * byte * nodes - beside).max(0.0)
        };
        work.iter().zip(speeds).zip(&self.nodes).map(finish).fold(0.0, f64::max)
    }
}

/// The worker of every element, by global index.
pub fn owners(mesh: &Mesh, subdomains: &[Subdomain]) -> Vec<u32> {
    let offsets = mesh.element_offsets();
    let mut owners = vec![0; mesh.n_elements()];
    for Subdomain { part, region, worker } in subdomains {
        let mut own = |element: usize| owners[offsets[*part] + element] = *worker as u32;
        match (region, &mesh.parts[*part].topology) {
            (Region::Cells { low, high }, Topology::Structured { cells }) => {
                let [ni, nj, _] = cells.map(|c| c as usize);
                let [i0, j0, k0] = low.map(|c| c as usize);
                let [i1, j1, k1] = high.map(|c| c as usize);
                for k in k0..k1 {
                    for j in j0..j1 {
                        (i0..i1).for_each(|i| own(i + ni * (j + nj * k)));
                    }
                }
            }
            (Region::List(elements), _) => elements.iter().for_each(|&e| own(e as usize)),
            (Region::Cells { .. }, _) => unreachable!("cells are cut from structured parts alone"),
        }
    }
    owners
}

/// What each worker's sub-domains cost in a cycle (element-cycles): their living elements, and all their nodes at `node` each.
pub fn work(subdomains: &[Subdomain], n: usize, node: f64, living: &Living) -> Vec<f64> {
    let mut work = vec![0.0; n];
    for s in subdomains {
        let nodes = match &s.region {
            Region::Cells { low, high } => (0..3).map(|a| f64::from(high[a] - low[a] + 1)).product(),
            Region::List(elements) => elements.len() as f64,
        };
        work[s.worker] += node.mul_add(nodes, living.of(s.part, &s.region) as f64);
    }
    work
}

/// Which elements of a mesh are alive, for counting them in boxes.
pub struct Living {
    /// By part; none where all are alive.
    parts: Vec<Option<Part>>,
}

/// The living elements of one part.
enum Part {
    /// Of a structured part: how many lie below each corner of the index space, I fastest; and nodes along I and J.
    Below(Vec<u64>, [usize; 2]),
    /// By element of an explicit part.
    List(Vec<bool>),
}

impl Living {
    /// From flags by global element; all are alive where there are none.
    ///
    /// # Panics
    /// If there are flags, but not one for each element of the mesh.
    pub fn new(mesh: &Mesh, alive: Option<&[bool]>) -> Self {
        let Some(alive) = alive else { return Self { parts: mesh.parts.iter().map(|_| None).collect() } };
        let mut first = 0;
        let of_part = |part: &mechanics::mesh::Part| {
            let alive = &alive[first..first + part.n_elements()];
            first += part.n_elements();
            if !alive.contains(&false) {
                return None;
            }
            Some(match &part.topology {
                Topology::Explicit { .. }
                | Topology::EightPoint { .. }
                | Topology::Tetrahedra { .. }
                | Topology::Shells { .. }
                | Topology::Trusses { .. }
                | Topology::Springs { .. }
                | Topology::Beams { .. } => Part::List(alive.to_vec()),
                Topology::Structured { cells } => {
                    let [ni, nj, nk] = cells.map(|n| n as usize);
                    let (row, plane) = (ni + 1, (ni + 1) * (nj + 1));
                    let mut below = vec![0_u64; plane * (nk + 1)];
                    for k in 0..nk {
                        for j in 0..nj {
                            let mut along = 0;
                            for i in 0..ni {
                                along += u64::from(alive[i + ni * (j + nj * k)]);
                                let at = (i + 1) + row * (j + 1) + plane * (k + 1);
                                below[at] =
                                    along + below[at - row] + below[at - plane] - below[at - row - plane];
                            }
                        }
                    }
                    Part::Below(below, [row, nj + 1])
                }
            })
        };
        Self { parts: mesh.parts.iter().map(of_part).collect() }
    }

    /// Living elements in a region of a part.
    pub fn of(&self, part: usize, region: &Region) -> u64 {
        match (region, &self.parts[part]) {
            (Region::Cells { low, high }, _) => self.in_box(part, &Cells { low: *low, high: *high }),
            (Region::List(elements), Some(Part::List(alive))) => {
                elements.iter().filter(|&&e| alive[e as usize]).count() as u64
            }
            (Region::List(elements), _) => elements.len() as u64,
        }
    }

    fn in_box(&self, part: usize, cells: &Cells) -> u64 {
        let Some(Part::Below(below, [row, rows])) = &self.parts[part] else { return cells.volume() };
        let (low, high) = (cells.low.map(|n| n as usize), cells.high.map(|n| n as usize));
        let at = |i: usize, j: usize, k: usize| below[i + row * (j + rows * k)];
        let up_to = |k: usize| {
            (at(high[0], high[1], k) + at(low[0], low[1], k))
                - at(low[0], high[1], k)
                - at(high[0], low[1], k)
        };
        up_to(high[2]) - up_to(low[2])
    }

    /// Whether an element of an explicit part costs anything.
    fn counts(&self, part: usize, element: u32) -> bool {
        match &self.parts[part] {
            Some(Part::List(alive)) => alive[element as usize],
            _ => true,
        }
    }
}

/// The largest `elements / speed` of a worker.
pub fn slowest_finish(subdomains: &[Subdomain], speeds: &[f64]) -> f64 {
    let mut cost = vec![0.0; speeds.len()];
    for s in subdomains {
        cost[s.worker] += s.region.n_elements() as f64;
    }
    cost.iter().zip(speeds).map(|(c, s)| c / s).fold(0.0, f64::max)
}

/// Seed 0: as given; 1: fastest first; others: shuffled by a small generator.
fn grouping(speeds: &[f64], seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..speeds.len()).collect();
    match seed {
        0 => {}
        1 => order.sort_by(|&a, &b| speeds[b].total_cmp(&speeds[a])),
        _ => {
            let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            for i in (1..order.len()).rev() {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                order.swap(i, (state % (i as u64 + 1)) as usize);
            }
        }
    }
    order
}

fn cut_all(
    mesh: &Mesh,
    speeds: &[f64],
    (order, axes): (&[usize], &[usize]),
    living: &Living,
) -> Vec<Subdomain> {
    let mut out = Vec::new();
    for (part, mesh_part) in mesh.parts.iter().enumerate() {
        let mut pieces = Vec::new();
        match &mesh_part.topology {
            Topology::Structured { cells } => {
                let all = Cells { low: [0; 3], high: *cells };
                let shortest = (0..3).fold(2, |best, a| if cells[a] < cells[best] { a } else { best });
                if all.volume() > 0 {
                    let count = |cells: &Cells| living.in_box(part, cells);
                    cut_planes(vec![all], (axes, shortest), order, speeds, &count, &mut pieces);
                }
            }
            Topology::Explicit { .. }
            | Topology::EightPoint { .. }
            | Topology::Tetrahedra { .. }
            | Topology::Shells { .. }
            | Topology::Trusses { .. }
            | Topology::Springs { .. }
            | Topology::Beams { .. } => {
                let n_elements = mesh_part.n_elements();
                let centres: Vec<[f64; 3]> = (0..n_elements)
                    .map(|e| {
                        let corners = mesh_part.corners(e);
                        std::array::from_fn(|a| {
                            corners.iter().map(|&n| mesh.positions[n as usize][a]).sum::<f64>()
                        })
                    })
                    .collect();
                let all = (0..n_elements as u32).collect();
                bisect(all, &centres, order, speeds, &|e| living.counts(part, e), &mut pieces);
            }
        }
        pieces.retain(|(region, _): &(Region, usize)| region.n_elements() > 0);
        out.extend(pieces.into_iter().map(|(region, worker)| Subdomain { part, region, worker }));
    }
    // The lowest sub-domain that has a node books it, so it must know of its rotation.
    out.sort_by_key(|subdomain| !mesh.parts[subdomain.part].turns_nodes());
    out
}

fn total(workers: &[usize], speeds: &[f64]) -> f64 {
    workers.iter().map(|&w| speeds[w]).sum()
}

fn fastest(workers: &[usize], speeds: &[f64]) -> usize {
    workers.iter().copied().fold(workers[0], |best, w| if speeds[w] > speeds[best] { w } else { best })
}

/// Recursive bisection along index planes, of all boxes together. Where whole planes miss the share of the workers, the
/// last plane is divided once more, so that the miss is at most half a column along the part's shortest axis. Of `axes` it
/// is that with the smaller interface.
fn cut_planes(
    boxes: Vec<Cells>,
    (axes, shortest): (&[usize], usize),
    workers: &[usize],
    speeds: &[f64],
    count: &dyn Fn(&Cells) -> u64,
    out: &mut Vec<(Region, usize)>,
) {
    let volume: u64 = boxes.iter().map(count).sum();
    if workers.len() == 1 || volume <= 1 {
        let worker = fastest(workers, speeds);
        out.extend(boxes.into_iter().map(|Cells { low, high }| (Region::Cells { low, high }, worker)));
        return;
    }
    let middle = workers.len() / 2;
    let mut best: Option<(f64, Cut, usize)> = None;
    for split in [middle, workers.len() - middle] {
        let target = volume as f64 * total(&workers[..split], speeds) / total(workers, speeds);
        for &axis in axes {
            let Some(whole) = Cut::whole(&boxes, axis, target, count) else { continue };
            let interface = volume as f64 / whole.planes;
            let near = NEAR * target.min(volume as f64 - target);
            let (cut, dearer) = match Cut::jagged(&boxes, axis, shortest, target, count) {
                Some(jagged) if whole.missed > near && jagged.missed < whole.missed => (jagged, JAG),
                _ => (whole, 1.0),
            };
            let score = interface * dearer + cut.missed;
            if best.as_ref().is_none_or(|(least, ..)| score < least * (1.0 - 1e-9)) {
                best = Some((score, cut, split));
            }
        }
    }
    let Some((_, cut, split)) = best else {
        let worker = fastest(workers, speeds);
        out.extend(boxes.into_iter().map(|Cells { low, high }| (Region::Cells { low, high }, worker)));
        return;
    };
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for cells in &boxes {
        let (low, rest) = cells.at(cut.axis, cut.plane);
        below.extend(low);
        let Some(rest) = rest else { continue };
        match cut.row {
            None => above.push(rest),
            Some((second, row)) => {
                let (layer, beyond) = rest.at(cut.axis, cut.plane + 1);
                above.extend(beyond);
                let (low, high) = layer.map_or((None, None), |layer| layer.at(second, row));
                below.extend(low);
                above.extend(high);
            }
        }
    }
    cut_planes(below, (axes, shortest), &workers[..split], speeds, count, out);
    cut_planes(above, (axes, shortest), &workers[split..], speeds, count, out);
}

/// Sets of axes to cut along, in the order in which equals are preferred: a lane set lies along I, so a cut across J has fewer of them at
/// the border and leaves rows long.
const AXES: &[&[usize]] = &[&[1, 0, 2], &[1, 0], &[1, 2], &[0, 2], &[1], &[0], &[2]];

/// How near to the share of the workers whole planes have to come, relative to the smaller side.
const NEAR: f64 = 0.002;
/// How much a jagged interface counts against a plane one.
const JAG: f64 = 1.1;

/// A box of cells of a structured part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cells {
    low: [u32; 3],
    high: [u32; 3],
}

impl Cells {
    fn volume(&self) -> u64 {
        (0..3).map(|a| u64::from(self.high[a] - self.low[a])).product()
    }

    /// How many nodes both have.
    fn nodes_shared_with(&self, other: &Self) -> f64 {
        let along = |a: usize| {
            f64::from((self.high[a].min(other.high[a]) + 1).saturating_sub(self.low[a].max(other.low[a])))
        };
        (0..3).map(along).product()
    }

    /// What lies below index plane `plane` of an axis, and the rest.
    fn at(&self, axis: usize, plane: u32) -> (Option<Self>, Option<Self>) {
        let plane = plane.clamp(self.low[axis], self.high[axis]);
        let (mut below, mut above) = (*self, *self);
        below.high[axis] = plane;
        above.low[axis] = plane;
        ((below.volume() > 0).then_some(below), (above.volume() > 0).then_some(above))
    }
}

/// Where boxes are cut: below a plane, and of that plane below a row of another axis.
struct Cut {
    axis: usize,
    plane: u32,
    row: Option<(usize, u32)>,
    /// Elements beside the target.
    missed: f64,
    /// Planes along the axis that the boxes have on average.
    planes: f64,
}

impl Cut {
    /// The plane whose lower side is nearest to `target` elements, with something on both sides.
    fn whole(boxes: &[Cells], axis: usize, target: f64, count: &dyn Fn(&Cells) -> u64) -> Option<Self> {
        let low = boxes.iter().map(|c| c.low[axis]).min()?;
        let high = boxes.iter().map(|c| c.high[axis]).max()?;
        let missed = |plane: u32| (below(boxes, axis, plane, count) as f64 - target).abs();
        let best = (low + 1..high).reduce(|a, b| if missed(b) < missed(a) { b } else { a })?;
        let planes = f64::from(high - low);
        Some(Self { axis, plane: best, row: None, missed: missed(best), planes })
    }

    /// The same with the plane that crosses the target divided along the longer of the other axes; no part is cut
    /// along its shortest for that.
    fn jagged(
        boxes: &[Cells],
        axis: usize,
        shortest: usize,
        target: f64,
        count: &dyn Fn(&Cells) -> u64,
    ) -> Option<Self> {
        let second = if axis == shortest { (axis + 1) % 3 } else { 3 - axis - shortest };
        let low = boxes.iter().map(|c| c.low[axis]).min()?;
        let high = boxes.iter().map(|c| c.high[axis]).max()?;
        let plane = (low..high).rev().find(|&plane| below(boxes, axis, plane, count) as f64 <= target)?;
        let before = below(boxes, axis, plane, count) as f64;
        let layer: Vec<Cells> = boxes
            .iter()
            .filter_map(|c| c.at(axis, plane).1)
            .filter_map(|c| c.at(axis, plane + 1).0)
            .collect();
        let row = Self::whole(&layer, second, target - before, count)?;
        let planes = f64::from(high - low);
        Some(Self { axis, plane, row: Some((second, row.plane)), missed: row.missed, planes })
    }
}

/// Elements that count below a plane.
fn below(boxes: &[Cells], axis: usize, plane: u32, count: &dyn Fn(&Cells) -> u64) -> u64 {
    boxes.iter().filter_map(|c| c.at(axis, plane).0).map(|c| count(&c)).sum()
}

/// Recursive coordinate bisection along the longest extent of the element centres; ties by element number.
fn bisect(
    mut elements: Vec<u32>,
    centres: &[[f64; 3]],
    workers: &[usize],
    speeds: &[f64],
    counts: &dyn Fn(u32) -> bool,
    out: &mut Vec<(Region, usize)>,
) {
    if workers.len() == 1 || elements.len() <= 1 {
        elements.sort_unstable();
        out.push((Region::List(elements), fastest(workers, speeds)));
        return;
    }
    let extent = |axis: usize| {
        let values = elements.iter().map(|&e| centres[e as usize][axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let axis = (0..3).fold(0, |best, a| if extent(a) > extent(best) { a } else { best });
    elements.sort_unstable_by(|&a, &b| {
        centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
    });
    let split = workers.len() / 2;
    let share = total(&workers[..split], speeds) / total(workers, speeds);
    let living = elements.iter().filter(|&&e| counts(e)).count();
    let lower = (living as f64 * share).round() as usize;
    // Behind the last living element of the lower side.
    let mut passed = 0;
    let end = elements.iter().position(|&e| {
        passed += usize::from(counts(e));
        passed > lower
    });
    let upper = elements.split_off(end.unwrap_or(elements.len()));
    bisect(elements, centres, &workers[..split], speeds, counts, out);
    bisect(upper, centres, &workers[split..], speeds, counts, out);
}

#[cfg(test)]
mod tests;
