//! Decomposition: which worker holds which part of the Lagrange grids, in proportion to speeds.
//!
//! Every part is cut among all workers, with the same grouping of workers for all parts, so that facing columns of
//! neighbouring parts fall on one worker; or each part has workers of its own, which then have few neighbours. Structured parts are cut
//! along index planes ([`grids`], paper section 3), explicit ones by recursive coordinate bisection. Columns and slabs that are cut along two
//! axes or one share nodes with fewer others than blocks do, and rows of bricks with fewer than grids, which pays where messages cost more than
//! nodes and wires are fast. The best of several groupings and shapes wins, by the slowest finish of elements, nodes, contact, the exchange of
//! partial forces ([`exchange`]) and votes ([`crate::tree`]). Elements that have eroded cost nothing ([`Living`]); they are dealt out all the
//! same, since their state is still held.

pub mod blocks;
mod crew;
mod exchange;
mod grids;
mod seams;

use std::{collections::HashSet, mem::discriminant};

use mechanics::{
    mesh::{Mesh, Topology},
    piece::Region,
    setup::Setup,
};

use protocol::message::Tree;

use crate::{
    balance::{Base, Costs},
    tree,
};
use crew::{Crew, Halves};
pub use crew::{Fleet, regions};
use exchange::{Exchange, Held};
use grids::{Cells, Cutting, NEARS, SHAPES, Shape};
use seams::Seams;

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

/// How many orders of the workers are tried at most; the best by the estimate wins.
const GROUPINGS: usize = 25;

/// The first so many orders are divided by speed too.
const BY_SPEED: usize = 6;

/// How often a grouping is cut again at most for shares corrected by the work of the last cut, and then by the ends of the estimate.
const BY_WORK: usize = 3;
const BY_ENDS: usize = 8;

/// Of many workers fewer orders and corrections are tried: so many workers in all.
const TRIED: usize = 2000;

/// A cut that ends so many times later than the best is not corrected where wires are what workers wait for.
const NEAR: f64 = 1.15;

/// A shape that ended so many times later than the best is not tried with further groupings.
const FAR: f64 = 1.5;

/// Boxes that a worker holds of a part at most, in the mean.
const MOST_BOXES: usize = 5;

/// With contact, cycles of so many ways of a message are long enough for the estimate.
const WAYS: f64 = 10.0;

/// Shares that are corrected come as near to what they are to be as so much of the time of a message.
const FINEST: f64 = 0.25;

/// Workers wait if the last ends so many times later than all would by their work alone, were it even.
const WAITS: f64 = 1.03;

/// A correction by the ends has to gain so much, as the estimate knows a wire less well than work: of workers of one speed, and of several.
const GAINS: [f64; 2] = [1.003, 1.03];

/// Of the elements of a worker or of a part, the lesser: a worker has no piece of a part that is less.
const LEAST_PIECE: f64 = 0.05;

/// What decides where a problem may be cut, beside its mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct Traits<'a> {
    /// By global index: elements that cost anything; all do where it is none.
    pub alive: Option<&'a [bool]>,
    /// Structured parts that face each other exchange forces of contact.
    pub touch: bool,
    /// Contact of a node is its owner's, as where workers sort; else a unit of nodes of both sides is one worker's.
    pub by_node: bool,
    /// An element of any part takes as long as one of any other.
    pub alike: bool,
    /// Most neighbours that are children of a worker in the tree of votes ([`crate::tree`]), if there is one.
    pub children: Option<usize>,
}

impl<'a> Traits<'a> {
    /// Of a problem of which these elements are alive.
    pub fn of(mesh: &Mesh, setup: &Setup, alive: Option<&'a [bool]>) -> Self {
        let kind = |part: &mechanics::mesh::Part| {
            let material = &setup.materials[part.material as usize];
            let laws = (discriminant(&material.eos), discriminant(&material.strength));
            (laws, discriminant(&material.failure), discriminant(&part.hourglass.kind))
        };
        let are_alike = mesh.parts.windows(2).all(|two| kind(&two[0]) == kind(&two[1]));
        let alike = are_alike && setup.bodies.is_empty() && setup.switches.is_empty();
        Self { alive, touch: setup.contact.is_some(), by_node: false, alike, children: None }
    }
}

/// A way to cut.
#[derive(Clone, Copy)]
struct How<'a> {
    /// The order of the workers.
    order: &'a [usize],
    /// Where it is divided.
    halves: Halves,
    way: Way,
}

/// How structured parts are cut.
#[derive(Clone, Copy)]
struct Way {
    shape: Shape,
    /// How near to their share whole planes have to come.
    near: f64,
    /// Whether each part has workers of its own.
    apart: bool,
}

/// The sub-domains of [`cut`].
pub fn decompose(mesh: &Mesh, fleet: Fleet<'_>, costs: Costs, traits: Traits<'_>) -> Vec<Subdomain> {
    cut(mesh, fleet, costs, traits).subdomains
}

/// A mesh that has been cut for workers.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    pub subdomains: Vec<Subdomain>,
    /// By worker: its place in the tree of votes, whose messages the cut makes up for. None without a tree, and where some parts are no grids.
    pub tree: Vec<Tree>,
    /// What each worker does in a cycle beside contact.
    pub bases: Vec<Base>,
}

/// Cuts the mesh for these workers. Sub-domains come part by part, shells first; those without elements are left
/// out, so a worker may have none in a small problem.
pub fn cut(mesh: &Mesh, fleet: Fleet<'_>, costs: Costs, traits: Traits<'_>) -> Cut {
    let speeds = fleet.speeds;
    let n = speeds.len();
    let equal = speeds.iter().all(|s| *s == speeds[0]);
    let is_structured = |part: &mechanics::mesh::Part| matches!(part.topology, Topology::Structured { .. });
    let has_choice = n > 1 && costs.message > 0.0 && mesh.parts.iter().any(is_structured);
    let shapes = if has_choice { SHAPES } else { &SHAPES[..1] };
    let (groupings, by_work) = if n < 3 || equal { (1, 0) } else { (GROUPINGS.min(2 + TRIED / n), BY_WORK) };
    let living = Living::new(mesh, traits.alive);
    let seams = if has_choice { Seams::new(mesh, traits) } else { Seams::default() };
    let mut sizes = living.of_parts(mesh);
    for (size, pairs) in sizes.iter_mut().zip(seams.pairs_of_parts(mesh.parts.len())) {
        *size += costs.pair * pairs;
    }
    // Contact that the estimate does not know would be dealt to those that got fewer elements, and with it more ghosts. And how long a short
    // cycle takes is up to the ways of messages.
    let all_structured = mesh.parts.iter().all(is_structured);
    let is_long =
        sizes.iter().sum::<f64>() > WAYS * (costs.travel + costs.message) * speeds.iter().sum::<f64>();
    let is_known = !traits.touch || all_structured && is_long;
    let by_ends = if has_choice && is_known { BY_ENDS.min(TRIED / n) } else { 0 };
    let may_be_apart = has_choice && traits.alike && mesh.parts.len() > 1 && all_structured && is_known;
    // Who is a neighbour is known of structured parts.
    let children = traits.children.filter(|_| has_choice && all_structured);
    let mut search = Search { mesh, sizes, fleet, costs, living, seams, children, best: None };
    // Each way, and what it came to at the best.
    let with = |apart: bool| shapes.iter().map(move |&shape| Way { shape, near: NEARS[0], apart });
    let mut ways: Vec<(Way, f64)> = with(false).map(|way| (way, f64::INFINITY)).collect();
    if may_be_apart {
        ways.extend(with(true).map(|way| (way, f64::INFINITY)));
    }
    let first = fleet.order(0);
    if has_choice {
        for (way, ended) in &mut ways {
            for near in NEARS {
                let end = search
                    .cut(How { order: &first, halves: Halves::Count, way: Way { near, ..*way } }, (0, 0));
                if end < *ended {
                    (way.near, *ended) = (near, end);
                }
                if end > FAR * search.least() {
                    break;
                }
            }
        }
    }
    // It takes several boxes to come nearer, which is not worth less than a message.
    let finest = NEARS[0].max(FINEST * costs.message * n as f64 / search.sizes.iter().sum::<f64>());
    let by_count = (0..groupings).map(|seed| (seed, Halves::Count));
    let by_speed = (0..groupings.min(BY_SPEED)).filter(|_| !equal).map(|seed| (seed, Halves::Speed));
    for (seed, halves) in by_count.chain(by_speed) {
        let order = fleet.order(seed as u64);
        for (way, ended) in &mut ways {
            let is_divided = halves == Halves::Count || matches!(way.shape, Shape::Halves(_));
            if is_divided && !(ended.is_finite() && *ended > FAR * search.least()) {
                // Where planes are divided, shares come nearer to what corrections ask for.
                for near in [way.near, finest].into_iter().take(if way.near > finest { 2 } else { 1 }) {
                    let how = How { order: &order, halves, way: Way { near, ..*way } };
                    *ended = ended.min(search.cut(how, (by_work, by_ends)));
                }
            }
        }
    }
    search.best.map(|(_, cut)| cut).unwrap_or_default()
}

/// The search for the cut whose slowest worker ends a cycle first.
struct Search<'a> {
    mesh: &'a Mesh,
    /// By part: element-cycles of its living elements and of its contact.
    sizes: Vec<f64>,
    fleet: Fleet<'a>,
    costs: Costs,
    living: Living,
    seams: Seams,
    /// As in [`Traits`].
    children: Option<usize>,
    /// The best so far, and when its slowest worker ends.
    best: Option<(f64, Cut)>,
}

impl Search<'_> {
    /// When the slowest worker of the best cut ends.
    fn least(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |(least, _)| *least)
    }

    /// Cuts in one way: first by the speeds, then for shares that are corrected by the work of the cut before, at most `by_work` times, then
    /// by the ends of the estimate. Gives when the slowest worker of the best of these cuts ends.
    fn cut(&mut self, how: How<'_>, (by_work, by_ends): (usize, usize)) -> f64 {
        let Self { mesh, fleet, costs, .. } = *self;
        let speeds = fleet.speeds;
        let n = speeds.len();
        let mut ended = f64::INFINITY;
        let mut shares = speeds.to_vec();
        let mut before = Vec::new();
        for correction in 0..=by_work + by_ends {
            let subdomains = cut_all((mesh, &self.sizes), fleet, &shares, how, &self.living);
            let pieces: HashSet<(usize, usize)> = subdomains.iter().map(|s| (s.part, s.worker)).collect();
            if subdomains.len() > MOST_BOXES * pieces.len() && self.best.is_some() {
                break;
            }
            let mut held = held_by(&subdomains, n, &self.living);
            let (shared, pairs) = self.seams.between(&subdomains, n);
            held.iter_mut().zip(pairs).for_each(|(held, pairs)| held.pairs = pairs);
            let work: Vec<f64> = held.iter().map(|held| held.work(costs)).collect();
            let computed: Vec<f64> = work.iter().zip(speeds).map(|(work, speed)| work / speed).collect();
            let level = work.iter().sum::<f64>() / speeds.iter().sum::<f64>();
            let least = self.least();
            // An equal finish keeps the earlier grouping, and the first is the order the user gave.
            let gain = if correction > by_work { GAINS[usize::from(by_work > 0)] } else { 1.0 + 1e-9 };
            let is_better = |ends: &[f64]| last(ends) * gain < least;
            let (mut tree, mut cycle) = (Vec::new(), work.iter().copied().map(Base::of).collect::<Vec<_>>());
            if costs.message > 0.0 && is_better(&computed) {
                let exchange = Exchange::new(mesh, &subdomains, n, shared);
                if let Some(children) = self.children {
                    tree = tree::tree(&exchange.neighbours(), fleet, (children, &before), (level, costs));
                    held.iter_mut().zip(tree::messages(&tree)).for_each(|(held, votes)| held.votes = votes);
                }
                cycle = exchange.cycle(&held, fleet, costs);
            }
            let ends: Vec<f64> = cycle.iter().zip(speeds).map(|(base, speed)| base.end / speed).collect();
            ended = ended.min(last(&ends));
            let waits = last(&ends) > WAITS * level;
            let far = waits && last(&ends) > NEAR * least;
            if is_better(&ends) {
                let beside = |(base, held): (&Base, &Held)| {
                    let contact = costs.pair * held.pairs;
                    Base { busy: base.busy - contact, end: base.end - contact }
                };
                let bases = cycle.iter().zip(&held).map(beside).collect();
                self.best = Some((last(&ends), Cut { subdomains, tree: tree.clone(), bases }));
            }
            if far || correction >= by_work && !waits {
                break;
            }
            if correction < by_work {
                // Ragged pieces have more nodes, and contact takes time: their workers get fewer elements in the next try.
                for (share, computed) in shares.iter_mut().zip(&computed) {
                    *share *= if *computed > 0.0 { level / computed } else { 1.0 };
                }
            } else {
                // Those that end late because of wires or of votes get fewer too. Once shares are about right, hubs stay, as shares would
                // follow them.
                if correction > by_work {
                    before = tree;
                }
                let mean = ends.iter().sum::<f64>() / n as f64;
                shares.iter_mut().zip(&ends).for_each(|(share, end)| *share *= mean / end.max(0.1 * mean));
            }
        }
        ended
    }
}

/// The last of some ends.
fn last(ends: &[f64]) -> f64 {
    ends.iter().copied().fold(0.0, f64::max)
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
    let costs = Costs { node, ..Costs::NONE };
    held_by(subdomains, n, living).iter().map(|held| held.work(costs)).collect()
}

/// Living elements and nodes of each worker.
fn held_by(subdomains: &[Subdomain], n: usize, living: &Living) -> Vec<Held> {
    let mut of_worker = vec![Held::default(); n];
    for s in subdomains {
        let held = &mut of_worker[s.worker];
        held.nodes += match &s.region {
            Region::Cells { low, high } => (0..3).map(|a| f64::from(high[a] - low[a] + 1)).product(),
            Region::List(elements) => elements.len() as f64,
        };
        held.elements += living.of(s.part, &s.region) as f64;
    }
    of_worker
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

    /// Living elements of each part of structured ones; of a part without any, one.
    fn of_parts(&self, mesh: &Mesh) -> Vec<f64> {
        let of_part = |(part, of): (usize, &mechanics::mesh::Part)| match of.topology {
            Topology::Structured { cells } => {
                self.in_box(part, &Cells { low: [0; 3], high: cells }).max(1) as f64
            }
            _ => of.n_elements().max(1) as f64,
        };
        mesh.parts.iter().enumerate().map(of_part).collect()
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

/// Workers that have a part for themselves, and their shares of it by index of the worker.
struct Own {
    workers: Vec<usize>,
    shares: Vec<f64>,
}

/// Deals parts of such sizes out to workers in their order and by their shares: those at the end of one have a piece of the next one too.
fn own(sizes: &[f64], crew: Crew<'_>, shares: &[f64]) -> Vec<Own> {
    let by_share = sizes.iter().sum::<f64>() / crew.workers.iter().map(|&w| shares[w]).sum::<f64>();
    let mut end = 0.0;
    let of_part = |size: &f64| {
        let begin = end;
        end += size;
        let mut own = Own { workers: Vec::new(), shares: vec![0.0; shares.len()] };
        let mut at = 0.0;
        for &worker in crew.workers {
            let all = by_share * shares[worker];
            let common = (at + all).min(end) - at.max(begin);
            if common > LEAST_PIECE * all.min(*size) {
                own.workers.push(worker);
                own.shares[worker] = common;
            }
            at += all;
        }
        own
    };
    sizes.iter().map(of_part).collect()
}

fn cut_all(
    (mesh, sizes): (&Mesh, &[f64]),
    fleet: Fleet<'_>,
    shares: &[f64],
    how: How<'_>,
    living: &Living,
) -> Vec<Subdomain> {
    let How { order, halves, way: Way { shape, near, apart } } = how;
    let all = Crew { fleet: fleet.with(shares), workers: order, halves };
    let owns = if apart { own(sizes, Crew { fleet, ..all }, shares) } else { Vec::new() };
    let mut out = Vec::new();
    for (part, mesh_part) in mesh.parts.iter().enumerate() {
        let crew = owns.get(part).map_or(all, |own| Crew {
            fleet: fleet.with(&own.shares),
            workers: &own.workers,
            halves,
        });
        let mut pieces = Vec::new();
        match &mesh_part.topology {
            Topology::Structured { cells } => {
                let whole = Cells { low: [0; 3], high: *cells };
                let shortest = (0..3).fold(2, |best, a| if cells[a] < cells[best] { a } else { best });
                if whole.volume() > 0 {
                    let count = |cells: &Cells| living.in_box(part, cells);
                    Cutting { shape, shortest, near, count: &count }.cut(vec![whole], crew, &mut pieces);
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
                bisect(all, &centres, crew, &|e| living.counts(part, e), &mut pieces);
            }
        }
        pieces.retain(|(region, _): &(Region, usize)| region.n_elements() > 0);
        out.extend(pieces.into_iter().map(|(region, worker)| Subdomain { part, region, worker }));
    }
    // The lowest sub-domain that has a node books it, so it must know of its rotation.
    out.sort_by_key(|subdomain| !mesh.parts[subdomain.part].turns_nodes());
    out
}

/// Recursive coordinate bisection along the longest extent of the element centres; ties by element number.
fn bisect(
    mut elements: Vec<u32>,
    centres: &[[f64; 3]],
    crew: Crew<'_>,
    counts: &dyn Fn(u32) -> bool,
    out: &mut Vec<(Region, usize)>,
) {
    if crew.workers.len() == 1 || elements.len() <= 1 {
        elements.sort_unstable();
        out.push((Region::List(elements), crew.fastest()));
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
    let [split, _] = crew.splits();
    let [first, others] = crew.divided(split);
    let share = first.speed() / crew.speed();
    let living = elements.iter().filter(|&&e| counts(e)).count();
    let lower = (living as f64 * share).round() as usize;
    // Behind the last living element of the lower side.
    let mut passed = 0;
    let end = elements.iter().position(|&e| {
        passed += usize::from(counts(e));
        passed > lower
    });
    let upper = elements.split_off(end.unwrap_or(elements.len()));
    bisect(elements, centres, first, counts, out);
    bisect(upper, centres, others, counts, out);
}

#[cfg(test)]
mod tests;
