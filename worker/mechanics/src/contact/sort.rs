//! The bucket sort: surface nodes and faces into virtual cubes (the paper's section 2).
//!
//! Cubes have twice the smallest dimension of all interacting faces as their side, but at least twice the
//! reach, so one crushed face cannot shrink them without limit. They are *virtual*: only those that hold nodes
//! exist, found through an array or a hash table. The first pass puts each node into the cube that contains it and makes
//! the cube if need be; the second puts each face into every existing cube that holds nodes it may interact
//! with: those that its box, grown by the reach, touches. (The paper tests the nodes of the face; the box also
//! finds cubes in the middle of a face much larger than a cube.) Then interactions are counted and units
//! without any are removed.
//!
//! Cubes are counted from the lowest corner of all interacting nodes, so that a translation changes nothing.
//!
//! Before all that, what lies outside the box of the parts that it may meet, grown by the reach, is left out: of two
//! bodies that touch, most of the surface.

use super::{
    Settings,
    pair::Kind,
    search::Exclusions,
    surface::{Face, Surface},
    work_unit::WorkUnit,
};
use crate::mesh::MAX_NODES;

/// Greatest cube index along an axis: three of them fit one key.
const MAX_CUBE: f64 = 2_097_000.0;

/// The units of nodes and faces, in the order in which nodes first touch them; see [`super::sort()`].
pub(super) fn units(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    exclusions: &Exclusions,
) -> Vec<WorkUnit> {
    let sides = Sides::new(surface, x, settings);
    let Some(grid) = Grid::new(surface, x, settings, &sides) else { return Vec::new() };
    let (table, unit_of) = sort_nodes(x, &grid, &sides);
    let nodes = group(table.cubes.len(), unit_of.iter().zip(0..).map(|(&unit, node)| (unit, node)));
    let census = PartCensus::new(surface, &nodes);
    let mut interactions = vec![0_u64; table.cubes.len()];
    let incidences =
        sort_faces(surface, x, settings, &grid, &table, &unit_of, &census, &sides, &mut interactions);
    assemble(surface, settings, exclusions, &table.cubes, &unit_of, &nodes, &incidences, interactions)
}

/// Where nodes lie beside the box of all that they may meet: the box around the nodes of the parts that theirs interacts
/// with, grown by the reach.
struct Sides {
    /// By surface node: a bit for each side of the box of its part on which the node lies outside; 0 inside.
    outside: Vec<u8>,
    /// Faces that touch the box of their part, with their reach; ascending.
    faces: Vec<u32>,
}

impl Sides {
    fn new(surface: &Surface, x: &[[f64; 3]], settings: &Settings) -> Self {
        let n_parts = settings.n_parts();
        let nothing = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let grow = |around: &mut [[f64; 3]; 2], low: [f64; 3], high: [f64; 3]| {
            for a in 0..3 {
                around[0][a] = if low[a] < around[0][a] { low[a] } else { around[0][a] };
                around[1][a] = if high[a] > around[1][a] { high[a] } else { around[1][a] };
            }
        };
        let mut parts = vec![nothing; n_parts];
        for ((&p, &part), _) in
            x.iter().zip(&surface.node_part).zip(&surface.active).filter(|(_, active)| **active)
        {
            grow(&mut parts[part as usize], p, p);
        }
        for &(node, part) in &surface.joined {
            grow(&mut parts[part as usize], x[node as usize], x[node as usize]);
        }
        let reach = settings.reach();
        let boxes: Vec<[[f64; 3]; 2]> = (0..n_parts)
            .map(|part| {
                let mut around = nothing;
                for other in (0..n_parts).filter(|&other| settings.permits(part as u32, other as u32)) {
                    grow(&mut around, parts[other][0], parts[other][1]);
                }
                [around[0].map(|low| low - reach), around[1].map(|high| high + reach)]
            })
            .collect();
        let of_node = |((&p, &part), &active): ((&[f64; 3], &u32), &bool)| {
            if active { side(&boxes[part as usize], p) } else { INACTIVE }
        };
        let outside: Vec<u8> = x.iter().zip(&surface.node_part).zip(&surface.active).map(of_node).collect();
        let beside = |face: &Face, n: u32| {
            if surface.node_part[n as usize] == face.part {
                outside[n as usize]
            } else {
                side(&boxes[face.part as usize], x[n as usize])
            }
        };
        let touches = |face: &Face| face.nodes.into_iter().fold(u8::MAX, |all, n| all & beside(face, n)) == 0;
        let faces = (0..).zip(&surface.faces).filter(|(_, face)| touches(face)).map(|(f, _)| f).collect();
        Self { outside, faces }
    }
}

/// What stands for a node that takes no part in contact.
const INACTIVE: u8 = 1 << 6;

/// A bit for each side of a box on which a point lies outside.
#[inline(always)]
fn side([low, high]: &[[f64; 3]; 2], p: [f64; 3]) -> u8 {
    (0..3).fold(0, |bits, a| bits | u8::from(p[a] < low[a]) << a | u8::from(p[a] > high[a]) << (a + 3))
}

/// The virtual grid.
struct Grid {
    origin: [f64; 3],
    inverse_side: f64,
    reach: f64,
    /// Highest cube index that can hold a node, per axis.
    last: [i32; 3],
}

impl Grid {
    /// The grid for these positions; none if nothing interacts.
    fn new(surface: &Surface, x: &[[f64; 3]], settings: &Settings, sides: &Sides) -> Option<Self> {
        let mut min = [f64::INFINITY; 3];
        let mut max = [f64::NEG_INFINITY; 3];
        for (p, _) in x.iter().zip(&sides.outside).filter(|(_, outside)| **outside == 0) {
            for a in 0..3 {
                min[a] = if p[a] < min[a] { p[a] } else { min[a] };
                max[a] = if p[a] > max[a] { p[a] } else { max[a] };
            }
        }
        if min[0] > max[0] {
            return None;
        }
        let reach = settings.reach();
        let smallest =
            surface.smallest_dimension_of(x, &mut sides.faces.iter().map(|&f| &surface.faces[f as usize]));
        let floor = (0..3).map(|a| (max[a] - min[a]) / MAX_CUBE).fold(2.0 * reach, f64::max);
        // Without a reach and with faces of no size any side will do.
        let side = if smallest.is_finite() { floor.max(2.0 * smallest) } else { floor };
        let inverse_side = if side > 0.0 { 1.0 / side } else { 1.0 };
        let mut grid = Self { origin: min, inverse_side, reach, last: [0; 3] };
        grid.last = grid.cube(max);
        Some(grid)
    }

    /// Cube of a point; monotonic in each coordinate, rounding included, so a box test and a cube test agree.
    #[inline(always)]
    fn cube(&self, p: [f64; 3]) -> [i32; 3] {
        let along = |a: usize| {
            let c = (p[a] - self.origin[a]) * self.inverse_side;
            let truncated = c as i32;
            truncated - i32::from(c < f64::from(truncated))
        };
        [along(0), along(1), along(2)]
    }
}

/// Existing cubes. Where the bodies are compact, by place in an array of the whole grid; where they are far apart, by
/// hash of their index: open addressing over a power of two of slots.
struct Table {
    /// Unit of every cube of the grid, or [`NO_UNIT`]; empty if the grid is too large.
    dense: Vec<u32>,
    /// Cubes of the grid along the first two axes.
    extent: [usize; 2],
    /// Key and unit of each slot.
    slots: Vec<(u64, u32)>,
    mask: usize,
    cubes: Vec<[i32; 3]>,
}

impl Table {
    const FREE: u64 = u64::MAX;

    /// Cubes of the grid for each node up to which it is an array: as much memory as the hash table at most.
    const DENSE: f64 = 4.0;

    /// A table of about `n_nodes / 4` units in a grid with these highest cubes; the hash table is at most half full.
    fn with_room(n_nodes: usize, last: [i32; 3]) -> Self {
        let extent = last.map(|last| last as usize + 1);
        let all: f64 = extent.iter().map(|&n| n as f64).product();
        if all <= Self::DENSE * n_nodes as f64 {
            let dense = vec![NO_UNIT; extent.iter().product()];
            return Self {
                dense,
                extent: [extent[0], extent[1]],
                slots: Vec::new(),
                mask: 0,
                cubes: Vec::new(),
            };
        }
        let slots = (2 * (n_nodes / 4).max(8)).next_power_of_two();
        Self {
            dense: Vec::new(),
            extent: [0; 2],
            slots: vec![(Self::FREE, 0); slots],
            mask: slots - 1,
            cubes: Vec::new(),
        }
    }

    #[inline(always)]
    fn place(&self, cube: [i32; 3]) -> usize {
        cube[0] as usize + self.extent[0] * (cube[1] as usize + self.extent[1] * cube[2] as usize)
    }

    #[inline(always)]
    fn key(cube: [i32; 3]) -> u64 {
        (cube[0] as u64) | (cube[1] as u64) << 21 | (cube[2] as u64) << 42
    }

    /// Fibonacci hashing: the upper bits of a product with 2^64 over the golden ratio.
    #[inline(always)]
    fn slot(&self, key: u64) -> usize {
        (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & self.mask
    }

    /// Unit of a cube, if it exists.
    #[inline(always)]
    fn find(&self, cube: [i32; 3]) -> Option<u32> {
        if !self.dense.is_empty() {
            let unit = self.dense[self.place(cube)];
            return (unit != NO_UNIT).then_some(unit);
        }
        let key = Self::key(cube);
        let mut slot = self.slot(key);
        loop {
            let (found, unit) = self.slots[slot];
            if found == key {
                return Some(unit);
            }
            if found == Self::FREE {
                return None;
            }
            slot = (slot + 1) & self.mask;
        }
    }

    /// Unit of a cube, made if need be.
    #[inline(always)]
    fn find_or_create(&mut self, cube: [i32; 3]) -> u32 {
        if !self.dense.is_empty() {
            let place = self.place(cube);
            if self.dense[place] == NO_UNIT {
                self.dense[place] = self.cubes.len() as u32;
                self.cubes.push(cube);
            }
            return self.dense[place];
        }
        let key = Self::key(cube);
        let mut slot = self.slot(key);
        loop {
            let (found, unit) = self.slots[slot];
            if found == key {
                return unit;
            }
            if found == Self::FREE {
                let unit = self.cubes.len() as u32;
                self.cubes.push(cube);
                self.slots[slot] = (key, unit);
                if 2 * self.cubes.len() > self.slots.len() {
                    self.grow();
                }
                return unit;
            }
            slot = (slot + 1) & self.mask;
        }
    }

    /// Doubles the slots.
    fn grow(&mut self) {
        let old = std::mem::take(&mut self.slots);
        self.slots = vec![(Self::FREE, 0); 2 * old.len()];
        self.mask = self.slots.len() - 1;
        for entry in old.into_iter().filter(|entry| entry.0 != Self::FREE) {
            let mut slot = self.slot(entry.0);
            while self.slots[slot].0 != Self::FREE {
                slot = (slot + 1) & self.mask;
            }
            self.slots[slot] = entry;
        }
    }
}

/// Unit of a node that can meet nothing.
const NO_UNIT: u32 = u32::MAX;

/// First pass: the cubes that hold nodes, and the unit of each surface node.
fn sort_nodes(x: &[[f64; 3]], grid: &Grid, sides: &Sides) -> (Table, Vec<u32>) {
    let mut table = Table::with_room(x.len(), grid.last);
    let unit = |(&p, &outside)| if outside == 0 { table.find_or_create(grid.cube(p)) } else { NO_UNIT };
    let unit_of = x.iter().zip(&sides.outside).map(unit).collect();
    (table, unit_of)
}

/// How many nodes of which part each unit holds.
struct PartCensus {
    starts: Vec<u32>,
    counts: Vec<(u32, u32)>,
}

impl PartCensus {
    fn new(surface: &Surface, (starts, nodes): &(Vec<u32>, Vec<u32>)) -> Self {
        let mut census = Self { starts: vec![0], counts: Vec::with_capacity(starts.len()) };
        for bounds in starts.windows(2) {
            let first = census.counts.len();
            for &node in &nodes[bounds[0] as usize..bounds[1] as usize] {
                let part = surface.node_part[node as usize];
                match census.counts[first..].iter_mut().find(|(p, _)| *p == part) {
                    Some((_, count)) => *count += 1,
                    None => census.counts.push((part, 1)),
                }
            }
            census.starts.push(census.counts.len() as u32);
        }
        census
    }

    /// Nodes of a unit that interact with a part.
    #[inline(always)]
    fn permitted(&self, unit: u32, permitted: &[bool]) -> u32 {
        self.counts[self.starts[unit as usize] as usize..self.starts[unit as usize + 1] as usize]
            .iter()
            .map(|&(part, count)| if permitted[part as usize] { count } else { 0 })
            .sum()
    }
}

/// Second pass: (unit, face) for each existing cube that holds nodes a face may interact with, by ascending
/// face; adds up the interactions of each unit.
#[expect(clippy::too_many_arguments, reason = "one pass over everything the first pass left behind")]
fn sort_faces(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    grid: &Grid,
    table: &Table,
    unit_of: &[u32],
    census: &PartCensus,
    sides: &Sides,
    interactions: &mut [u64],
) -> Vec<(u32, u32)> {
    let n_parts = settings.n_parts();
    let mut incidences = Vec::with_capacity(6 * sides.faces.len());
    for &f in &sides.faces {
        let face = &surface.faces[f as usize];
        let permitted = &settings.interacts[face.part as usize * n_parts..][..n_parts];
        let (mut min, mut max) = (x[face.nodes[0] as usize], x[face.nodes[0] as usize]);
        for n in &face.nodes[1..] {
            let c = x[*n as usize];
            for a in 0..3 {
                min[a] = if c[a] < min[a] { c[a] } else { min[a] };
                max[a] = if c[a] > max[a] { c[a] } else { max[a] };
            }
        }
        let mut low = grid.cube([min[0] - grid.reach, min[1] - grid.reach, min[2] - grid.reach]);
        let mut high = grid.cube([max[0] + grid.reach, max[1] + grid.reach, max[2] + grid.reach]);
        for a in 0..3 {
            low[a] = low[a].max(0);
            high[a] = high[a].min(grid.last[a]);
        }
        // Own corners that can be in a unit and are permitted: to be taken off its count.
        let mut own = [NO_UNIT; MAX_NODES];
        for (own, &node) in own.iter_mut().zip(&face.own) {
            if node != u32::MAX && permitted[surface.node_part[node as usize] as usize] {
                *own = unit_of[node as usize];
            }
        }
        let mut put = |unit: u32| {
            let all = census.permitted(unit, permitted);
            if all > 0 {
                let own = own.iter().filter(|&&u| u == unit).count() as u64;
                interactions[unit as usize] += u64::from(all) - own;
                incidences.push((unit, f));
            }
        };
        let cells: f64 = (0..3).map(|a| f64::from(high[a]) - f64::from(low[a]) + 1.0).product();
        if cells <= table.cubes.len() as f64 {
            for k in low[2]..=high[2] {
                for j in low[1]..=high[1] {
                    for i in low[0]..=high[0] {
                        if let Some(unit) = table.find([i, j, k]) {
                            put(unit);
                        }
                    }
                }
            }
        } else {
            // A face larger than the whole problem's cubes: look at those that exist.
            for (unit, cube) in table.cubes.iter().enumerate() {
                if (0..3).all(|a| (low[a]..=high[a]).contains(&cube[a])) {
                    put(unit as u32);
                }
            }
        }
    }
    incidences
}

/// Gathers units from what the passes found; takes excluded pairs off and drops units without interactions.
#[expect(clippy::too_many_arguments, reason = "what both passes left behind")]
fn assemble(
    surface: &Surface,
    settings: &Settings,
    exclusions: &Exclusions,
    cubes: &[[i32; 3]],
    unit_of: &[u32],
    (node_starts, nodes): &(Vec<u32>, Vec<u32>),
    incidences: &[(u32, u32)],
    mut interactions: Vec<u64>,
) -> Vec<WorkUnit> {
    let (face_starts, faces) = group(cubes.len(), incidences.iter().copied());
    let slice = |starts: &[u32], unit: usize| starts[unit] as usize..starts[unit + 1] as usize;
    for (node, face) in exclusions.on(surface) {
        let (unit, f) = (unit_of[node as usize], &surface.faces[face as usize]);
        let counted = unit != NO_UNIT
            && settings.permits(surface.node_part[node as usize], f.part)
            && !f.own.contains(&node)
            && faces[slice(&face_starts, unit as usize)].binary_search(&face).is_ok();
        if counted {
            interactions[unit as usize] -= 1;
        }
    }
    (0..cubes.len())
        .filter(|&unit| interactions[unit] > 0)
        .map(|unit| WorkUnit {
            cube: cubes[unit],
            nodes: nodes[slice(node_starts, unit)].to_vec(),
            faces: faces[slice(&face_starts, unit)].to_vec(),
            pairs: Vec::new(),
            kind: Kind::NodeFace,
            interactions: interactions[unit],
        })
        .collect()
}

/// Counting sort of (unit, item): where the items of each unit begin, and the items in the order given.
fn group(n_units: usize, items: impl Iterator<Item = (u32, u32)> + Clone) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; n_units + 1];
    for (unit, _) in items.clone().filter(|item| item.0 != NO_UNIT) {
        starts[unit as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut next = starts.clone();
    let mut grouped = vec![0; starts[n_units] as usize];
    for (unit, item) in items.filter(|item| item.0 != NO_UNIT) {
        grouped[next[unit as usize] as usize] = item;
        next[unit as usize] += 1;
    }
    (starts, grouped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_and_a_hash_table_number_cubes_alike() {
        let last = [6, 4, 9];
        let (mut array, mut hash) = (Table::with_room(1000, last), Table::with_room(10, last));
        assert!(!array.dense.is_empty() && hash.dense.is_empty());
        let mut seed = 9_u64;
        for _ in 0..200 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let cube = [0, 1, 2].map(|a| (seed >> (20 + 14 * a)) as i32 & 0xfff).map(|i| i % 5);
            assert_eq!(array.find(cube), hash.find(cube));
            assert_eq!(array.find_or_create(cube), hash.find_or_create(cube));
        }
        assert!(array.cubes.len() > 40);
        assert_eq!(array.cubes, hash.cubes);
    }
}
