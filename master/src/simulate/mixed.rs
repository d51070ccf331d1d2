//! `--decomposition`: how near a lab of mixed speeds comes to its bound, contact included, over several seeds.
//!
//! The benchmark's plates with so many elements along an edge are dealt to as many hosts as the cluster file has, of
//! random integer speeds; one sort of the initial state gives the contact of each. Nothing is integrated. A host's time
//! is `(elements + node x nodes + pair x pairs) / speed`, the bound is the sum of that over the sum of speeds. Beside it stand slabs
//! along the first axis, in proportion to speeds and rounded to planes, whose units stay with the owners of their nodes.

use std::fmt::Write as _;

use deck::model::Model;
use mechanics::{
    contact::{self, Batch, Contact, Exclusions, Surface, WorkUnit, initial_pairs},
    lanes::Width,
    mesh::{Mesh, Topology},
    piece::Region,
};
use serde::Serialize;

use crate::{
    balance::{self, Costs},
    decompose::{Cut, Fleet, Living, Subdomain, Traits, cut, decompose, work},
};

/// Edges of the problems (elements), and the goal of each: time over the bound.
pub const EDGES: [(u32, f64); 3] = [(30, 1.05), (40, 1.04), (100, 1.015)];
/// Cells of the paper's tables: edge, and numbers of equal hosts.
const EQUAL: [(u32, &[usize]); 2] = [(30, &[2, 3, 4]), (40, &[2, 4, 8, 16])];
/// Highest speed; the lowest is 1.
const FASTEST: u64 = 4;

/// One lab and problem.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Elements along an edge of the plates together.
    pub edge: u32,
    /// Elements of the problem.
    pub elements: usize,
    /// Which speeds; 0 are equal ones.
    pub seed: u64,
    pub hosts: usize,
    /// Relative speed of each host.
    pub speeds: Vec<f64>,
    /// Elements alone: time over the bound.
    pub elements_over_bound: f64,
    /// Nodes and contact included.
    pub time_over_bound: f64,
    /// Work of all hosts without contact over that of one: nodes that several hosts have.
    pub copies: f64,
    /// Slabs, nodes and contact included.
    pub slabs_over_bound: f64,
    /// Node-face pairs of all hosts.
    pub pairs: usize,
    /// Interactions of all units.
    pub interactions: u64,
}

/// Speeds of a seed: integers of 1 to 4 by a small generator, all 1 for seed 0.
pub fn speeds(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let speed = |_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        if seed == 0 { 1.0 } else { (1 + (state >> 33) % FASTEST) as f64 }
    };
    (0..n).map(speed).collect()
}

/// The benchmark's plates, free slip: `edge` cells of 1 cm along each axis, a quarter of the thickness (a third at 30, as
/// in the paper) is the projectile's.
///
/// # Errors
/// Faults of the deck that is made here: a bug.
pub fn plates(edge: u32) -> Result<Model, String> {
    let thick = if edge == 30 { 10 } else { edge / 4 };
    let target = edge - thick;
    let deck = format!(
        "title = \"plates of {edge}\"\nunits = \"cm-g-us\"\n[control]\nend_time = 100.0\n\
         [[part]]\nname = \"target\"\nmaterial = \"AL_2024_T351\"\n\
         box = {{ origin = [0, 0, 0], size = [{edge}, {edge}, {target}], cells = [{edge}, {edge}, {target}] }}\n\
         [[part]]\nname = \"projectile\"\nmaterial = \"STEEL_1006\"\nvelocity = [0, 0, -0.05]\n\
         box = {{ origin = [0, 0, {target}.1], size = [{edge}, {edge}, {thick}], cells = [{edge}, {edge}, {thick}] }}\n\
         [contact]\ngap_length = 0.1\n"
    );
    deck::read(&deck, "the plates of --decomposition").map_err(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        lines.join("\n")
    })
}

/// A problem sorted once.
pub struct Sorted {
    model: Model,
    surface: Surface,
    exclusions: Exclusions,
    x: Vec<[f64; 3]>,
    units: Vec<WorkUnit>,
    weights: Vec<u64>,
}

impl Sorted {
    /// Sorts the initial state.
    ///
    /// # Errors
    /// A problem without contact.
    pub fn new(model: Model) -> Result<Self, String> {
        let settings = model.setup.contact.as_ref().ok_or("the problem has no contact")?;
        let surface = Surface::new(&model.mesh, &model.setup.materials, &|_| true);
        let x: Vec<[f64; 3]> =
            surface.nodes.iter().map(|&node| model.mesh.positions[node as usize]).collect();
        let exclusions = Exclusions::new(&surface, &initial_pairs(&surface, &x, settings));
        let mut units = contact::sort(&surface, &x, settings, &exclusions);
        let weights = contact::cull(&mut units, &surface, &x, settings, &exclusions);
        Ok(Self { model, surface, exclusions, x, units, weights })
    }

    /// What hosts of these speeds come to. `costs` in elements.
    pub fn row(&self, edge: u32, seed: u64, speeds: &[f64], costs: Costs) -> Row {
        let Costs { node, pair, .. } = costs;
        let mesh = &self.model.mesh;
        let (fleet, traits) = (Fleet::near(speeds), Traits::of(mesh, &self.model.setup, None));
        let Cut { subdomains: layout, bases, .. } = cut(mesh, fleet, costs, traits);
        let living = Living::new(mesh, None);
        let elements = elements_of(&layout, speeds.len());
        let owner = owners(mesh, &layout);
        let owner = |node: u32| owner[self.surface.nodes[node as usize] as usize] as usize;
        let held = work(&layout, speeds.len(), node, &living);
        let nodes = |unit: &WorkUnit| balance::nodes_of(unit, &self.surface);
        let chosen = balance::assign(&self.units, (&self.weights, costs), fleet, &bases, (&owner, &nodes));
        let pairs = self.pairs(&chosen, speeds.len());

        let slabs = slabs(mesh, speeds);
        let whole = decompose(mesh, Fleet::near(&[1.0]), costs, traits);
        let slab_owner = owners(mesh, &slabs);
        let slab_owner = |node: u32| slab_owner[self.surface.nodes[node as usize] as usize] as usize;
        let slab_chosen = balance::assign_to_owners(&self.units, speeds.len(), &slab_owner);
        let slab_pairs = self.pairs(&slab_chosen, speeds.len());
        Row {
            edge,
            elements: mesh.n_elements(),
            seed,
            hosts: speeds.len(),
            speeds: speeds.to_vec(),
            elements_over_bound: over_bound(&elements, &vec![0; speeds.len()], pair, speeds),
            time_over_bound: over_bound(&held, &pairs, pair, speeds),
            slabs_over_bound: over_bound(
                &work(&slabs, speeds.len(), node, &living),
                &slab_pairs,
                pair,
                speeds,
            ),
            copies: held.iter().sum::<f64>() / work(&whole, 1, node, &living)[0],
            pairs: pairs.iter().sum(),
            interactions: self.units.iter().map(|unit| unit.interactions).sum(),
        }
    }

    /// Pairs that each worker finds in its units.
    fn pairs(&self, chosen: &[usize], n: usize) -> Vec<usize> {
        let Some(settings) = &self.model.setup.contact else { return vec![0; n] };
        let mut mine: Vec<Vec<&WorkUnit>> = vec![Vec::new(); n];
        for (unit, &worker) in self.units.iter().zip(chosen) {
            mine[worker].push(unit);
        }
        let of_worker = |units: &Vec<&WorkUnit>| {
            let batch = Batch::gather(&self.surface, units, &|_| 1.0, &self.exclusions);
            let x: [Vec<f64>; 3] = std::array::from_fn(|a| {
                let at = |global: u32| self.surface.node_index(global).map_or(0.0, |i| self.x[i as usize][a]);
                batch.nodes.iter().map(|node| at(node.global)).collect()
            });
            Contact::new(&batch, settings, &x, Width::best()).n_pairs()
        };
        mine.iter().map(of_worker).collect()
    }
}

fn elements_of(layout: &[Subdomain], n: usize) -> Vec<f64> {
    let mut elements = vec![0.0; n];
    for s in layout {
        elements[s.worker] += s.region.n_elements() as f64;
    }
    elements
}

/// The slowest host's time over the bound.
fn over_bound(elements: &[f64], pairs: &[usize], pair: f64, speeds: &[f64]) -> f64 {
    let work: Vec<f64> = elements.iter().zip(pairs).map(|(e, &p)| e + pair * p as f64).collect();
    let slowest = work.iter().zip(speeds).map(|(w, s)| w / s).fold(0.0, f64::max);
    slowest * speeds.iter().sum::<f64>() / work.iter().sum::<f64>()
}

/// Worker of the lowest sub-domain that has each node, by global node.
fn owners(mesh: &Mesh, layout: &[Subdomain]) -> Vec<u32> {
    let mut owner = vec![u32::MAX; mesh.n_nodes()];
    for s in layout {
        let part = &mesh.parts[s.part];
        let mut take = |element: usize| {
            for &node in part.nodes_of(element).iter() {
                let owner = &mut owner[node as usize];
                if *owner == u32::MAX {
                    *owner = s.worker as u32;
                }
            }
        };
        match (&part.topology, &s.region) {
            (Topology::Structured { cells }, Region::Cells { low, high }) => {
                for k in low[2]..high[2] {
                    for j in low[1]..high[1] {
                        for i in low[0]..high[0] {
                            take((i + cells[0] * (j + cells[1] * k)) as usize);
                        }
                    }
                }
            }
            (_, Region::List(elements)) => elements.iter().for_each(|&e| take(e as usize)),
            (_, Region::Cells { .. }) => {}
        }
    }
    owner
}

/// Slabs of every structured part along the first axis, in proportion to speeds, rounded to planes.
fn slabs(mesh: &Mesh, speeds: &[f64]) -> Vec<Subdomain> {
    let all: f64 = speeds.iter().sum();
    let mut out = Vec::new();
    for (part, mesh_part) in mesh.parts.iter().enumerate() {
        let Topology::Structured { cells } = mesh_part.topology else { continue };
        let (mut passed, mut from) = (0.0, 0);
        for (worker, speed) in speeds.iter().enumerate() {
            passed += speed;
            let to = (f64::from(cells[0]) * passed / all).round() as u32;
            if to > from {
                let region = Region::Cells { low: [from, 0, 0], high: [to, cells[1], cells[2]] };
                out.push(Subdomain { part, region, worker });
            }
            from = to;
        }
    }
    out
}

/// All rows: for each edge the paper's cells of equal hosts (seed 0), then seeds from 1 up.
///
/// # Errors
/// As [`plates`] and [`Sorted::new`].
pub fn run(hosts: usize, edges: &[u32], seeds: u64, costs: Costs) -> Result<Vec<Row>, String> {
    let mut rows = Vec::new();
    for &edge in edges {
        let sorted = Sorted::new(plates(edge)?)?;
        let equal = EQUAL.iter().filter(|(of, _)| *of == edge).flat_map(|(_, hosts)| hosts.iter());
        for &n in equal {
            rows.push(sorted.row(edge, 0, &speeds(n, 0), costs));
        }
        for seed in 1..=seeds {
            rows.push(sorted.row(edge, seed, &speeds(hosts, seed), costs));
        }
    }
    Ok(rows)
}

/// The rows as a table for people.
pub fn print(rows: &[Row], pair: f64) -> String {
    let mut text = format!(
        "slowest host over the bound, modelled: elements, nodes and contact of one sort, a pair costs {pair} elements\n  \
         elements  seed  hosts  sum of speeds  elements alone  contact included     goal  slabs  copies\n"
    );
    for row in rows {
        let goal = EDGES.iter().find(|(edge, _)| *edge == row.edge).filter(|_| row.seed > 0);
        let goal = goal.map_or_else(|| "      -".to_owned(), |(_, goal)| format!("<= {goal:5.3}"));
        let seed = if row.seed == 0 { "equal".to_owned() } else { row.seed.to_string() };
        let _ = writeln!(
            text,
            "  {:8} {seed:>5} {:6} {:14} {:15.4} {:17.4}  {goal:>8} {:6.3}  {:6.3}",
            row.elements,
            row.hosts,
            row.speeds.iter().sum::<f64>(),
            row.elements_over_bound,
            row.time_over_bound,
            row.slabs_over_bound,
            row.copies
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixed_lab_is_near_its_bound_with_contact_and_slabs_are_not() {
        for row in
            run(16, &[30], 1, Costs { node: 0.1, pair: 1.0, ..Costs::NONE }).expect("the plates have contact")
        {
            println!("{row:?}");
            if row.seed == 0 {
                assert_eq!(row.elements_over_bound, 1.0, "the paper's cells divide evenly: {row:?}");
            }
            assert!(row.time_over_bound <= 1.05, "{row:?}");
            assert!(row.slabs_over_bound > row.time_over_bound, "{row:?}");
        }
    }

    #[test]
    fn speeds_of_a_seed_are_integers_up_to_four() {
        for seed in 1..50 {
            let speeds = speeds(16, seed);
            assert!(speeds.iter().all(|s| (1.0..=4.0).contains(s) && s.fract() == 0.0), "{speeds:?}");
            assert!(speeds.iter().any(|s| *s != speeds[0]), "{speeds:?}");
        }
    }
}
