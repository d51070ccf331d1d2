//! Element block: elements of one kind and one material with their own copies of their nodes.
//!
//! A [`Piece`] is the image of a sub-domain in element and node order, as it travels and is stored; a [`Block`] is
//! the same laid out for the kernels. Elements sit in *slots*, eight to a *lane set*, the same on every lane
//! width. In a structured block the slots of a set follow the local node index of their corner 0, so that the
//! corners of a set are contiguous loads; a slot beyond the end of a row holds no element (a *phantom*) and is masked
//! wherever a result leaves the kernel. A block knows nothing of other blocks: nodes that several hold are kept
//! equal by whoever integrates them.

use std::{mem::take, ops::Range};

use serde::{Deserialize, Serialize};

use crate::{
    element::{
        ElementVote, Step,
        hex8::{BySlot, View, pass},
        layout::{Corners, Layout, explicit, in_runs, structured},
        place::Nodal,
        shell4::{Core, ShellStep},
    },
    erosion::PieceErosion,
    lanes::{SET, Width},
    material::Material,
    mesh::{Topology, quad_area, twice},
    state::{N_FIELDS, ShellState, field::ENERGY, sparse, write_changed},
};

/// Stands for the global element index in a slot without an element.
const PHANTOM: u32 = u32::MAX;

/// State image of a sub-domain. Node arrays are by local node (structured: I fastest), element arrays by local
/// element (structured: I fastest).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Part index.
    pub part: u32,
    /// Index into [`crate::setup::Setup::materials`].
    pub material: u32,
    /// Index space or connectivity of the piece; explicit corners are local nodes.
    pub topology: Topology,
    /// Global node index of each local node.
    pub nodes: Vec<u32>,
    /// Global element index of each local element.
    pub elements: Vec<u32>,
    /// Position `x_n` (length).
    pub x: Vec<[f64; 3]>,
    /// Velocity `v_{n-1/2}` (length per time).
    pub v: Vec<[f64; 3]>,
    /// Nodal mass, that of all elements at the node.
    pub mass: Vec<f64>,
    /// Index into [`crate::setup::Setup::constraints`].
    pub constraint: Vec<u16>,
    /// Volume at time zero.
    pub initial_volume: Vec<f64>,
    /// One array per entry of [`crate::state::FIELDS`].
    pub fields: [Vec<f64>; N_FIELDS],
    /// In runs where anything erodes.
    pub erosion: Option<PieceErosion>,
    /// What shells have beside that; empty of solids.
    pub shells: ShellState,
}

/// Elements of one kind and one material, laid out for the kernels. The first `nodes.len()` entries of the node
/// arrays are nodes; what follows is padding, to whole sets of eight at least, that nothing may rely on.
pub struct Block {
    /// Part index.
    pub part: u32,
    /// Index into [`crate::setup::Setup::materials`].
    pub material: u32,
    /// Global node index of each local node.
    pub nodes: Vec<u32>,
    /// Global element index of each local element.
    pub elements: Vec<u32>,
    /// Position `x_n` by axis.
    pub x: [Vec<f64>; 3],
    /// Velocity `v_{n-1/2}` by axis.
    pub v: [Vec<f64>; 3],
    /// Nodal force of this block's elements by axis.
    pub f: [Vec<f64>; 3],
    /// Nodal mass.
    pub mass: Vec<f64>,
    /// Index into [`crate::setup::Setup::constraints`].
    pub constraint: Vec<u16>,
    /// Rotations, moments and layers of shells; none of solids.
    pub shells: Option<Box<Core>>,
    topology: Topology,
    layout: Layout,
    /// Slot of each local element.
    slots: Vec<u32>,
    fields: [Vec<f64>; N_FIELDS],
    initial_volume: Vec<f64>,
    /// Bits of the slots of each set that hold elements.
    alive: Vec<u8>,
    slot_elements: Vec<u32>,
    /// Lowest global element index of each set.
    lowest: Vec<u32>,
    /// Entries of a node array that the kernels may touch.
    reach: usize,
}

impl Block {
    /// Lays out a piece of solids. Forces are zero.
    ///
    /// # Panics
    /// As [`Block::of`], and if the piece is of shells.
    pub fn new(piece: &Piece) -> Block {
        Self::of(piece.clone(), &[])
    }

    /// Lays out a piece of one of `materials`. Its arrays go one by one, so that there need not be room for all of both.
    /// Forces are zero.
    ///
    /// # Panics
    /// If the arrays of the piece do not fit its topology or shells cannot be of its material, which whoever made or
    /// decoded it has checked.
    pub fn of(mut piece: Piece, materials: &[Material]) -> Block {
        let (n_nodes, n_elements) = (piece.nodes.len(), piece.elements.len());
        let by_node = [piece.x.len(), piece.v.len(), piece.mass.len(), piece.constraint.len()];
        assert!(by_node == [n_nodes; 4], "node arrays of {by_node:?} entries for {n_nodes} nodes");
        assert!(piece.initial_volume.len() == n_elements, "volumes for {n_elements} elements");
        assert!(piece.fields.iter().all(|f| f.len() == n_elements), "fields for {n_elements} elements");
        let (layout, slots, reach) = match &piece.topology {
            Topology::Structured { cells } => structured(cells.map(|c| c as usize), n_nodes),
            Topology::Explicit { hexahedra } => explicit(hexahedra, in_runs(hexahedra), n_nodes),
            Topology::Shells { quads, .. } => {
                let corners: Vec<_> = quads.iter().map(|&quad| twice(quad)).collect();
                // Shells have kernels and layers of their own, in the order of elements.
                let order = (0..quads.len() as u32).collect();
                explicit(&corners, (order, vec![None; quads.len().div_ceil(SET)]), n_nodes)
            }
        };
        let shells = match &piece.topology {
            Topology::Shells { quads, section } => {
                let material = materials.get(piece.material as usize).expect("shells need their material");
                let volume = &piece.initial_volume;
                let core = Core::new(quads, &piece.elements, volume, &piece.shells, section, material);
                Some(Box::new(core.expect("the deck has checked section and material")))
            }
            _ => None,
        };
        assert!(slots.len() == n_elements, "topology of {} elements, {n_elements} given", slots.len());
        let n_slots = match &layout {
            Layout::Structured { base, .. } => base.len() * SET,
            Layout::Explicit { sets, .. } => sets.len() * SET,
        };
        let by_slot = |values: Vec<f64>, phantom: f64| {
            let mut array = vec![phantom; n_slots];
            for (&slot, value) in slots.iter().zip(values) {
                write_changed(&mut array[slot as usize], value);
            }
            array
        };
        let n_padded = reach.max(n_nodes.next_multiple_of(SET));
        let by_axis = |values: Vec<[f64; 3]>| -> [Vec<f64>; 3] {
            std::array::from_fn(|axis| {
                let mut array: Vec<f64> = values.iter().map(|value| value[axis]).collect();
                array.resize(n_padded, 0.0);
                array
            })
        };
        let mut slot_elements = vec![PHANTOM; n_slots];
        for (&slot, &element) in slots.iter().zip(&piece.elements) {
            slot_elements[slot as usize] = element;
        }
        Block {
            part: piece.part,
            material: piece.material,
            x: by_axis(take(&mut piece.x)),
            v: by_axis(take(&mut piece.v)),
            f: std::array::from_fn(|_| vec![0.0; n_padded]),
            mass: piece.mass.iter().copied().chain(std::iter::repeat_n(1.0, n_padded - n_nodes)).collect(),
            shells,
            fields: std::array::from_fn(|field| by_slot(take(&mut piece.fields[field]), 0.0)),
            initial_volume: by_slot(take(&mut piece.initial_volume), 1.0),
            constraint: piece.constraint,
            topology: piece.topology,
            nodes: piece.nodes,
            elements: piece.elements,
            alive: slot_elements
                .chunks(SET)
                .map(|set| (0..).zip(set).map(|(i, &element)| u8::from(element != PHANTOM) << i).sum())
                .collect(),
            lowest: slot_elements
                .chunks(SET)
                .map(|set| set.iter().copied().min().unwrap_or(PHANTOM))
                .collect(),
            slot_elements,
            layout,
            slots,
            reach,
        }
    }

    /// The state image: what [`Block::new`] was given, to the bit, with the state of now. Which elements have eroded is not in
    /// it: whoever watches them adds that.
    pub fn piece(&self) -> Piece {
        let by_element = |array: &[f64]| sparse(self.slots.iter().map(|&slot| array[slot as usize]));
        let by_node = |arrays: &[Vec<f64>; 3]| by_node(self.nodes.len(), arrays);
        Piece {
            part: self.part,
            material: self.material,
            topology: self.topology.clone(),
            nodes: self.nodes.clone(),
            elements: self.elements.clone(),
            x: by_node(&self.x),
            v: by_node(&self.v),
            mass: self.mass[..self.nodes.len()].to_vec(),
            constraint: self.constraint.clone(),
            initial_volume: by_element(&self.initial_volume),
            fields: match &self.shells {
                None => std::array::from_fn(|field| by_element(&self.fields[field])),
                Some(core) => {
                    let all: Vec<_> = (0..self.elements.len()).map(|e| self.summary(core, e)).collect();
                    std::array::from_fn(|field| all.iter().map(|summary| summary[field]).collect())
                }
            },
            shells: self
                .shells
                .as_ref()
                .map_or_else(ShellState::default, |core| core.image(self.nodes.len(), self.elements.len())),
            erosion: None,
        }
    }

    /// [`Block::piece`] of a block that goes array by array, so that there need not be room for all of both.
    pub fn into_piece(mut self) -> Piece {
        if self.shells.is_some() {
            return self.piece();
        }
        let (n, slots) = (self.nodes.len(), take(&mut self.slots));
        let by_element = |array: Vec<f64>| sparse(slots.iter().map(|&slot| array[slot as usize]));
        drop((take(&mut self.f), take(&mut self.slot_elements)));
        self.mass.truncate(n);
        Piece {
            part: self.part,
            material: self.material,
            x: by_node(n, &take(&mut self.x)),
            v: by_node(n, &take(&mut self.v)),
            initial_volume: by_element(take(&mut self.initial_volume)),
            fields: self.fields.each_mut().map(|field| by_element(take(field))),
            topology: self.topology,
            nodes: self.nodes,
            elements: self.elements,
            mass: self.mass,
            constraint: self.constraint,
            erosion: None,
            shells: ShellState::default(),
        }
    }

    /// Number of slots, phantoms included.
    pub(crate) fn n_slots(&self) -> usize {
        self.slot_elements.len()
    }

    /// The slot of a local element.
    pub(crate) fn slot(&self, element: usize) -> usize {
        self.slots[element] as usize
    }

    /// Where corners are, and the entries of a node array that a pass over all slots may touch.
    pub(crate) fn layout(&self) -> (&Layout, usize) {
        (&self.layout, self.reach)
    }

    /// Bits of the slots of each set whose elements take part.
    pub(crate) fn alive(&self) -> &[u8] {
        &self.alive
    }

    /// Whether a local element takes part.
    pub(crate) fn is_alive(&self, element: usize) -> bool {
        let slot = self.slot(element);
        self.alive[slot / SET] >> (slot % SET) & 1 == 1
    }

    /// One state field by slot, of solids: what shells say of themselves is [`Block::element`].
    pub(crate) fn field_slots(&self, field: usize) -> &[f64] {
        &self.fields[field]
    }

    /// Takes the element of a slot out: it gives no force and no vote any more and keeps its state. Gives its global index and
    /// internal energy.
    pub(crate) fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.alive[slot / SET] &= !(1 << (slot % SET));
        (self.slot_elements[slot], self.fields[ENERGY][slot] * self.initial_volume[slot])
    }

    /// Number of lane sets.
    pub fn n_sets(&self) -> u32 {
        self.alive.len() as u32
    }

    /// Number of elements that take part in a range of lane sets.
    ///
    /// # Panics
    /// If there are no such sets.
    pub fn n_elements_of(&self, sets: &Range<u32>) -> u64 {
        let alive = &self.alive[sets.start as usize..sets.end as usize];
        alive.iter().map(|bits| u64::from(bits.count_ones())).sum()
    }

    /// One state field of a local element.
    pub fn field(&self, element: usize, field: usize) -> f64 {
        match &self.shells {
            None => self.fields[field][self.slots[element] as usize],
            Some(core) => self.summary(core, element)[field],
        }
    }

    /// The state of a local element as [`Block::piece`] has it, one number per entry of [`crate::state::FIELDS`].
    pub fn element(&self, element: usize) -> [f64; N_FIELDS] {
        match &self.shells {
            None => self.fields.each_ref().map(|values| values[self.slots[element] as usize]),
            Some(core) => self.summary(core, element),
        }
    }

    /// What a shell says of itself in the fields of solids, which its block does not keep up.
    fn summary(&self, core: &Core, element: usize) -> [f64; N_FIELDS] {
        let [a, b, c, d, ..] = self.corners(element);
        let x = [a, b, c, d].map(|n| std::array::from_fn(|axis| self.x[axis][n as usize]));
        core.summary(element, self.initial_volume[self.slot(element)], quad_area(&x))
    }

    /// The lane set of a local element.
    pub fn set_of_element(&self, element: usize) -> u32 {
        self.slots[element] / SET as u32
    }

    /// Local nodes of the corners of a local element.
    pub fn corners(&self, element: usize) -> [u32; 8] {
        self.slot_corners(self.slots[element] as usize)
    }

    fn slot_corners(&self, slot: usize) -> [u32; 8] {
        match &self.layout {
            Layout::Structured { row, plane, base } => {
                let n = base[slot / SET] + (slot % SET) as u32;
                let (row, plane) = (*row as u32, *plane as u32);
                [0, 1, row + 1, row, plane, plane + 1, plane + row + 1, plane + row].map(|d| n + d)
            }
            Layout::Explicit { sets, lists } => {
                let lane = slot % SET;
                match sets[slot / SET] {
                    Corners::Run(_, first) => first.map(|node| node + lane as u32),
                    Corners::List(list) => lists[list as usize].map(|nodes| nodes[lane]),
                }
            }
        }
    }

    /// Local nodes that the elements of a set touch, ascending.
    ///
    /// # Panics
    /// If there is no such set.
    pub fn nodes_of_set(&self, set: u32) -> Vec<u32> {
        let slots = set as usize * SET..(set as usize + 1) * SET;
        let members = slots.filter(|&slot| self.slot_elements[slot] != PHANTOM);
        let mut nodes: Vec<u32> = members.flat_map(|slot| self.slot_corners(slot)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// For each set, whether one of its elements has a node that `marked` (by local node) holds true: the sets to
    /// compute before the forces of those nodes travel.
    ///
    /// # Panics
    /// If `marked` is not by local node.
    pub fn sets_touching(&self, marked: &[bool]) -> Vec<bool> {
        assert!(marked.len() == self.nodes.len(), "{} marks, {} nodes", marked.len(), self.nodes.len());
        let touches = |set| self.nodes_of_set(set).iter().any(|&node| marked[node as usize]);
        (0..self.n_sets()).map(touches).collect()
    }

    /// See [`crate::cycle::Domain::plant_fault`].
    pub(crate) fn plant_fault(&mut self) {
        if let Some(core) = &mut self.shells {
            core.plant_fault();
            return;
        }
        if let Some(&slot) = self.slots.first() {
            let pressure = &mut self.fields[crate::state::field::PRESSURE][slot as usize];
            *pressure = pressure.next_up();
        }
    }

    /// Sets all forces to zero.
    pub fn clear_forces(&mut self) {
        let moments = self.shells.iter_mut().flat_map(|core| &mut core.m);
        for f in self.f.iter_mut().chain(moments) {
            f.fill(0.0);
        }
    }

    /// Adds the corner forces of the elements of `sets` at `x_n` to [`Block::f`], brings their state from `n-1` to
    /// `n` (unless `step.dt` is zero) and adds their votes. Each set is to be computed once a cycle.
    ///
    /// The result does not depend on `width`, on the order of sets, nor on how they are cut into calls.
    ///
    /// # Panics
    /// If a set is out of range or the machine lacks the width, see [`Width::require`].
    pub fn compute(
        &mut self,
        material: &Material,
        sets: &[Range<u32>],
        step: &Step,
        width: Width,
        vote: &mut ElementVote,
    ) {
        if let Some(core) = &mut self.shells {
            let step = ShellStep {
                dt: step.dt,
                force_quantum: step.force_quantum,
                moment_quantum: step.force_quantum.times(step.arm),
                energy_quantum: step.energy_quantum,
            };
            core.compute(&self.x, &self.v, &mut self.f, sets, &step, width, vote);
            return;
        }
        let [fx, fy, fz] = &mut self.f;
        let view = View {
            layout: &self.layout,
            reach: self.reach,
            nodes: Nodal {
                x: std::array::from_fn(|axis| self.x[axis].as_slice()),
                v: std::array::from_fn(|axis| self.v[axis].as_slice()),
                f: [fx, fy, fz],
            },
            slots: BySlot {
                fields: self.fields.each_mut().map(Vec::as_mut_slice),
                initial_volume: &self.initial_volume,
                alive: &self.alive,
                elements: &self.slot_elements,
                lowest: &self.lowest,
            },
        };
        // SAFETY: corners and slots of a block are inside its arrays since it was built.
        unsafe { pass::run(view, material, step, sets, width, vote) };
    }
}

/// The first `n` of arrays by axis, by node.
fn by_node(n: usize, arrays: &[Vec<f64>; 3]) -> Vec<[f64; 3]> {
    (0..n).map(|node| std::array::from_fn(|axis| arrays[axis][node])).collect()
}
