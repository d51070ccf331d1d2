//! Where structured parts face each other: what their sub-domains exchange if they are on different workers.
//!
//! Joined parts share the nodes of their seam. Where parts may touch, a node that faces an element of another worker
//! is a ghost there, and its forces go both ways as those of a shared node do; and its pairs take time.

use std::collections::BTreeMap;

use mechanics::{
    mesh::{Mesh, Part, Topology},
    piece::Region,
};

use super::{Subdomain, Traits, exchange::Shared, grids::Cells};

/// Nodes of different parts that are one, or face each other.
#[derive(Debug, Default)]
pub struct Seams {
    /// Parts that have some, ascending, and the cells that their places lie in.
    parts: Vec<(usize, Cells)>,
    pairs: Vec<Pair>,
    /// As in [`Traits`].
    by_node: bool,
}

/// A node of a part, and that of another one beside it, each by one of its cells. Of nodes that face each other the first is whose contact it is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair {
    places: [(u32, [u32; 3]); 2],
    /// Whether both are one node; else they face each other.
    is_joined: bool,
}

/// A node on the surface of a part.
#[derive(Clone, Copy, Debug)]
struct Place {
    part: u32,
    node: u32,
    /// A cell that has it.
    cell: [u32; 3],
    x: [f64; 3],
}

/// Nodes are exchanged that lie within so many nodes of one that faces an element of another worker, and at most so many for one that does. On
/// 80 hosts the plates of 1,000,000 elements in blocks send 3.5 MB a cycle for 10,100 that do, and each pair of workers has 110.
const MARGIN: f64 = 4.0;
const MOST_GHOSTS: f64 = 5.0;

/// Cells that a unit reaches beyond the cells of the worker that has most of its nodes.
const UNIT: u32 = 3;

/// Pairs of a node that faces another part, with faces of that: the 20,200 of the plates of 1,000,000 elements have 81,600.
const CONTACT_PAIRS: f64 = 4.0;

/// How far from a node, in edges of the coarser part, one that faces it lies at most.
const REACH: f64 = 1.0;

impl Seams {
    /// Of the structured parts of a mesh; nodes face each other if its parts touch.
    pub fn new(mesh: &Mesh, Traits { touch, by_node, .. }: Traits<'_>) -> Self {
        let structured = |part: &Part| matches!(part.topology, Topology::Structured { .. });
        let known = |part: &Part| !part.nodes.is_empty();
        if mesh.parts.iter().filter(|part| structured(part) && known(part)).count() < 2 {
            return Self::default();
        }
        let surfaces: Vec<Vec<Place>> =
            (0..).zip(&mesh.parts).map(|(p, part)| surface(mesh, p, part)).collect();
        let mut pairs = joined(&surfaces);
        if touch {
            let bounds: Vec<_> =
                surfaces.iter().zip(&mesh.parts).map(|(s, part)| Bounds::of(s, part, mesh)).collect();
            for (a, one) in surfaces.iter().enumerate() {
                for (b, other) in surfaces.iter().enumerate() {
                    if let (true, Some(of_one), Some(of_other)) = (a != b, bounds[a], bounds[b]) {
                        facing((one, of_one), (other, of_other), &mut pairs);
                    }
                }
            }
        }
        let mut parts: Vec<(usize, Cells)> = Vec::new();
        for (part, cell) in pairs.iter().flat_map(|pair| pair.places) {
            let high = cell.map(|c| c + 1);
            match parts.iter_mut().find(|(p, _)| *p == part as usize) {
                Some((_, cells)) => {
                    cells.low = std::array::from_fn(|a| cells.low[a].min(cell[a]));
                    cells.high = std::array::from_fn(|a| cells.high[a].max(high[a]));
                }
                None => parts.push((part as usize, Cells { low: cell, high })),
            }
        }
        Self { parts, pairs, by_node }
    }

    /// What lies on seams between these sub-domains of `n` workers: nodes that pairs of workers exchange, and how many pairs of nodes and
    /// faces each worker looks at in a cycle.
    pub fn between(&self, subdomains: &[Subdomain], n: usize) -> (Vec<Shared>, Vec<f64>) {
        let owners: Vec<Vec<u32>> =
            self.parts.iter().map(|(part, within)| owners_within(subdomains, *part, within)).collect();
        let owner = |(part, cell): (u32, [u32; 3])| {
            let at = self.parts.iter().position(|(p, _)| *p == part as usize)?;
            owners[at].get(place_in(&self.parts[at].1, cell)).copied()
        };
        let mut shared: BTreeMap<[u32; 2], [f64; 2]> = BTreeMap::new();
        let mut contact = vec![0.0; n];
        for Pair { places, is_joined } in &self.pairs {
            let [Some(one), Some(other)] = places.map(owner) else { continue };
            let mut add = |one: u32, other: u32, [joined, facing]: [f64; 2]| {
                if one != other {
                    let shared = shared.entry([one.min(other), one.max(other)]).or_default();
                    *shared = [shared[0] + joined, shared[1] + facing];
                }
            };
            if *is_joined {
                add(one, other, [1.0, 0.0]);
                continue;
            }
            contact[self.whose(one, other) as usize] += CONTACT_PAIRS;
            add(one, other, [0.0, 0.5]);
            // Those near it exchange a frame, however few nodes.
            for near in (0..8).filter_map(|corner| owner(self.shifted(places[1], corner))) {
                add(one, near, [0.0, 0.0]);
            }
        }
        let of = |(workers, [joined, facing]): ([u32; 2], [f64; 2])| Shared {
            workers,
            nodes: joined + ghosts(facing),
            border: [0.0, 0.0, 0.0, joined + facing],
        };
        (shared.into_iter().map(of).collect(), contact)
    }

    /// The place as far from another one of a part as a unit reaches, in one of eight directions; at most at the end of the seam.
    fn shifted(&self, (part, cell): (u32, [u32; 3]), direction: u32) -> (u32, [u32; 3]) {
        let Some((_, Cells { low, high })) = self.parts.iter().find(|(p, _)| *p == part as usize) else {
            return (part, cell);
        };
        let shift = |a: usize| {
            let forward = direction >> a & 1 == 1;
            if forward { (cell[a] + UNIT).min(high[a] - 1) } else { cell[a].saturating_sub(UNIT).max(low[a]) }
        };
        (part, std::array::from_fn(shift))
    }

    /// Whose contact it is if a node of one faces another: a unit of which two own as many nodes is the lower one's.
    fn whose(&self, one: u32, other: u32) -> u32 {
        if self.by_node { one } else { one.min(other) }
    }

    /// How many pairs of nodes and faces each of so many parts has.
    pub fn pairs_of_parts(&self, n: usize) -> Vec<f64> {
        let mut pairs = vec![0.0; n];
        for Pair { places: [one, other], .. } in self.pairs.iter().filter(|pair| !pair.is_joined) {
            pairs[self.whose(one.0, other.0) as usize] += CONTACT_PAIRS;
        }
        pairs
    }
}

/// Nodes that two workers exchange for so many that face each other: a unit takes a margin around them from both sides.
fn ghosts(facing: f64) -> f64 {
    (MOST_GHOSTS * facing).min((facing.sqrt() + 2.0 * MARGIN).powi(2))
}

/// Number of a cell among those of a box, I fastest.
fn place_in(within: &Cells, cell: [u32; 3]) -> usize {
    let [i, j, k] = std::array::from_fn(|a| (cell[a] - within.low[a]) as usize);
    let [ni, nj, _]: [usize; 3] = std::array::from_fn(|a| (within.high[a] - within.low[a]) as usize);
    i + ni * (j + nj * k)
}

/// The worker of each cell of a part in a box.
fn owners_within(subdomains: &[Subdomain], part: usize, within: &Cells) -> Vec<u32> {
    let mut owners = vec![u32::MAX; within.volume() as usize];
    for subdomain in subdomains.iter().filter(|s| s.part == part) {
        let Region::Cells { low, high } = subdomain.region else { continue };
        let low: [u32; 3] = std::array::from_fn(|a| low[a].max(within.low[a]));
        let high: [u32; 3] = std::array::from_fn(|a| high[a].min(within.high[a]));
        if (0..3).any(|a| low[a] >= high[a]) {
            continue;
        }
        for k in low[2]..high[2] {
            for j in low[1]..high[1] {
                let first = place_in(within, [low[0], j, k]);
                owners[first..][..(high[0] - low[0]) as usize].fill(subdomain.worker as u32);
            }
        }
    }
    owners
}

/// Nodes on the surface of a structured part; none of others.
fn surface(mesh: &Mesh, p: u32, part: &Part) -> Vec<Place> {
    let Topology::Structured { cells } = part.topology else { return Vec::new() };
    let mut places = Vec::new();
    let inside = |a: usize, at: u32| at > 0 && at < cells[a];
    for (number, &node) in part.nodes.iter().enumerate() {
        let number = number as u32;
        let row = cells[0] + 1;
        let at = [number % row, number / row % (cells[1] + 1), number / row / (cells[1] + 1)];
        if (0..3).all(|a| inside(a, at[a])) {
            continue;
        }
        let cell = std::array::from_fn(|a| at[a].min(cells[a].max(1) - 1));
        places.push(Place { part: p, node, cell, x: mesh.positions[node as usize] });
    }
    places
}

/// Nodes that several parts have.
fn joined(surfaces: &[Vec<Place>]) -> Vec<Pair> {
    let mut places: Vec<&Place> = surfaces.iter().flatten().collect();
    places.sort_by_key(|place| (place.node, place.part));
    let mut pairs = Vec::new();
    for same in places.chunk_by(|one, other| one.node == other.node) {
        for pair in same.windows(2).filter(|pair| pair[0].part != pair[1].part) {
            pairs.push(Pair { places: [pair[0], pair[1]].map(|p| (p.part, p.cell)), is_joined: true });
        }
    }
    pairs
}

/// Where the surface of a part is, and how long its edges are.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
    edge: f64,
}

impl Bounds {
    fn of(surface: &[Place], part: &Part, mesh: &Mesh) -> Option<Self> {
        let Topology::Structured { cells } = part.topology else { return None };
        let first = surface.first()?;
        let mut bounds = Self { low: first.x, high: first.x, edge: 0.0 };
        for place in surface {
            bounds.low = std::array::from_fn(|a| bounds.low[a].min(place.x[a]));
            bounds.high = std::array::from_fn(|a| bounds.high[a].max(place.x[a]));
        }
        // The mean of the cell in the middle stands for all.
        let steps = [1, cells[0] + 1, (cells[0] + 1) * (cells[1] + 1)];
        let middle: u32 = (0..3).map(|a| cells[a] / 2 * steps[a]).sum();
        let x = |at: u32| mesh.positions[part.nodes[at as usize] as usize];
        let longest = |step: u32| {
            let (one, other) = (x(middle), x(middle + step));
            (0..3).map(|a| (one[a] - other[a]).powi(2)).sum::<f64>().sqrt()
        };
        bounds.edge = steps.map(longest).into_iter().fold(0.0, f64::max);
        Some(bounds)
    }
}

/// Nodes of one part and of another one that face each other: of those within reach the nearest. Asked from both sides, so each counts half.
fn facing((one, of_one): (&[Place], Bounds), (other, of_other): (&[Place], Bounds), pairs: &mut Vec<Pair>) {
    let reach = REACH * of_one.edge.max(of_other.edge);
    if reach <= 0.0 || !reach.is_finite() {
        return;
    }
    let near = |place: &&Place, to: &Bounds| {
        (0..3).all(|a| place.x[a] >= to.low[a] - reach && place.x[a] <= to.high[a] + reach)
    };
    let bin = |x: [f64; 3]| x.map(|x| (x / reach).floor() as i64);
    let mut bins: Vec<([i64; 3], &Place)> =
        other.iter().filter(|p| near(p, &of_one)).map(|place| (bin(place.x), place)).collect();
    bins.sort_by_key(|(bin, place)| (*bin, place.node));
    for place in one.iter().filter(|p| near(p, &of_other)) {
        let [i, j, k] = bin(place.x);
        let mut best: Option<(f64, &Place)> = None;
        for (di, dj) in (-1..=1).flat_map(|di| (-1..=1).map(move |dj| (di, dj))) {
            let column = [i + di, j + dj, k - 1];
            let from = bins.partition_point(|(bin, _)| *bin < column);
            let column = bins[from..].iter().take_while(|(bin, _)| *bin <= [i + di, j + dj, k + 1]);
            for (_, candidate) in column {
                let distance = (0..3).map(|a| (place.x[a] - candidate.x[a]).powi(2)).sum::<f64>();
                if candidate.node != place.node
                    && distance <= reach * reach
                    && best.is_none_or(|(least, _)| distance < least)
                {
                    best = Some((distance, candidate));
                }
            }
        }
        if let Some((_, candidate)) = best {
            pairs.push(Pair {
                places: [(place.part, place.cell), (candidate.part, candidate.cell)],
                is_joined: false,
            });
        }
    }
}
