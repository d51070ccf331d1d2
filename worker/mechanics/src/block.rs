//! Element block: elements of one kind and one material with their own copies of their nodes.
//!
//! A [`Piece`] is the state of a sub-domain in element and node order, as it travels and is stored; a [`Block`] is
//! the same laid out for the kernels: nodes, and a [`Group`] of elements of one kind, which the block asks without knowing
//! what they are. A block knows nothing of other blocks: nodes that several hold are kept equal by whoever integrates them.

use std::{mem::take, ops::Range};

use crate::{
    element::{
        ElementVote, Step,
        group::{Call, ElementArrays, Group, Scanned},
        hourglass::Hourglass,
        kinds,
        place::Nodal,
    },
    erosion::criteria::Criteria,
    flip::Target,
    lanes::{SET, Width},
    material::Material,
    mesh::{Nodes, Topology},
    piece::Piece,
    spin::Turning,
    state::{N_FIELDS, ShellState},
};

/// Elements of one kind and one material, laid out for the kernels. The first `nodes.len()` entries of the node
/// arrays are nodes; what follows is padding, to whole sets of eight at least, that nothing may rely on.
pub struct Block {
    /// Part index.
    pub part: u32,
    /// Index into [`crate::setup::Setup::materials`].
    pub material: u32,
    /// Global node index of each local node.
    pub nodes: Vec<u32>,
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
    /// Rotations of the nodes, where the elements turn them.
    pub turning: Option<Turning>,
    /// Hourglass control of solids.
    pub(crate) hourglass: Hourglass,
    topology: Topology,
    group: Box<dyn Group>,
}

impl Block {
    /// Lays out a piece of a kind that needs no material for it. Forces are zero.
    ///
    /// # Panics
    /// As [`Block::of`], and if the piece is of another kind.
    pub fn new(piece: &Piece) -> Block {
        Self::of(piece.clone(), &[])
    }

    /// Lays out a piece of one of `materials`. Its arrays go one by one, so that there need not be room for all of both.
    /// Forces are zero.
    ///
    /// # Panics
    /// If the arrays of the piece do not fit its topology or its elements cannot be of its material, which whoever made or
    /// decoded it has checked.
    pub fn of(mut piece: Piece, materials: &[Material]) -> Block {
        let (n_nodes, n_elements) = (piece.nodes.len(), piece.elements.len());
        let by_node = [piece.x.len(), piece.v.len(), piece.mass.len(), piece.constraint.len()];
        assert!(by_node == [n_nodes; 4], "node arrays of {by_node:?} entries for {n_nodes} nodes");
        assert!(piece.initial_volume.len() == n_elements, "volumes for {n_elements} elements");
        let arrays = piece.fields.iter().chain(&piece.history);
        assert!(arrays.into_iter().all(|f| f.len() == n_elements), "fields for {n_elements} elements");
        let (group, turning) = kinds::of(&mut piece, materials);
        let n_padded = group.reach().max(n_nodes.next_multiple_of(SET));
        let by_axis = |values: Vec<[f64; 3]>| -> [Vec<f64>; 3] {
            std::array::from_fn(|axis| {
                let mut array: Vec<f64> = values.iter().map(|value| value[axis]).collect();
                array.resize(n_padded, 0.0);
                array
            })
        };
        Block {
            part: piece.part,
            material: piece.material,
            x: by_axis(take(&mut piece.x)),
            v: by_axis(take(&mut piece.v)),
            f: std::array::from_fn(|_| vec![0.0; n_padded]),
            mass: piece.mass.iter().copied().chain(std::iter::repeat_n(1.0, n_padded - n_nodes)).collect(),
            constraint: piece.constraint,
            turning,
            hourglass: piece.hourglass,
            topology: piece.topology,
            nodes: piece.nodes,
            group,
        }
    }

    /// The state: what [`Block::new`] was given, to the bit, with the state of now. Which elements have eroded and what
    /// contact keeps of nodes is not in it: whoever holds the block adds that.
    pub fn piece(&self) -> Piece {
        let n = self.nodes.len();
        let ElementArrays { initial_volume, fields, own, history } = self.group.image(&self.x);
        Piece {
            part: self.part,
            material: self.material,
            topology: self.topology.clone(),
            nodes: self.nodes.clone(),
            elements: self.globals().collect(),
            x: by_node(n, &self.x),
            v: by_node(n, &self.v),
            mass: self.mass[..n].to_vec(),
            constraint: self.constraint.clone(),
            initial_volume,
            fields,
            shells: of_shells(n, self.turning.as_ref()),
            own,
            hourglass: self.hourglass,
            erosion: None,
            history,
            contact: Vec::new(),
        }
    }

    /// [`Block::piece`] of a block that goes array by array, so that there need not be room for all of both.
    pub fn into_piece(mut self) -> Piece {
        let n = self.nodes.len();
        drop(take(&mut self.f));
        let elements = self.globals().collect();
        let ElementArrays { initial_volume, fields, own, history } = self.group.into_image(&self.x);
        self.mass.truncate(n);
        Piece {
            part: self.part,
            material: self.material,
            x: by_node(n, &take(&mut self.x)),
            v: by_node(n, &take(&mut self.v)),
            initial_volume,
            fields,
            topology: self.topology,
            nodes: self.nodes,
            elements,
            mass: self.mass,
            constraint: self.constraint,
            erosion: None,
            contact: Vec::new(),
            shells: of_shells(n, self.turning.as_ref()),
            own,
            hourglass: self.hourglass,
            history,
        }
    }

    pub fn n_elements(&self) -> usize {
        self.group.n_elements()
    }

    /// Global element index of each local element.
    pub fn globals(&self) -> impl Iterator<Item = u32> {
        (0..self.n_elements()).map(|element| self.group.global(self.slot(element)))
    }

    /// Number of slots, empty ones included.
    pub(crate) fn n_slots(&self) -> usize {
        self.alive().len() * SET
    }

    /// The slot of a local element.
    pub(crate) fn slot(&self, element: usize) -> usize {
        self.group.slot(element)
    }

    /// Bits of the slots of each set whose elements take part.
    pub(crate) fn alive(&self) -> &[u8] {
        self.group.alive()
    }

    /// The same, to mask elements while others of their sets are computed.
    pub(crate) fn alive_mut(&mut self) -> &mut [u8] {
        self.group.alive_mut()
    }

    /// Whether a local element takes part.
    pub(crate) fn is_alive(&self, element: usize) -> bool {
        let slot = self.slot(element);
        self.alive()[slot / SET] >> (slot % SET) & 1 == 1
    }

    /// The arrays for the pass of erosion, of elements of a kind that it scans.
    pub(crate) fn scanned(&self) -> Option<Scanned<'_>> {
        self.group.scanned()
    }

    /// The slots of `sets` whose elements meet a criterion, of elements of another kind.
    pub(crate) fn met(&self, criteria: &Criteria, sets: &[Range<u32>]) -> Vec<u32> {
        self.group.met(criteria, sets)
    }

    /// Every number that a cycle changes of the elements, in a fixed order.
    pub(crate) fn visit(&self, visit: &mut dyn FnMut(f64)) {
        self.group.visit(visit);
    }

    /// Takes the element of a slot out: it gives no force and no vote any more and keeps its state. Gives its global index and
    /// internal energy.
    pub(crate) fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.group.take_out(slot)
    }

    /// Energy that the element of a slot took of its nodes since its state, if it has no forces any more; `dt` is the step to the
    /// positions of now.
    pub(crate) fn half_work(&self, slot: usize, dt: f64, material: &Material) -> f64 {
        self.group.half_work(slot, [&self.x, &self.v], dt, material)
    }

    /// Number of lane sets.
    pub fn n_sets(&self) -> u32 {
        self.alive().len() as u32
    }

    /// Number of elements that take part in a range of lane sets.
    ///
    /// # Panics
    /// If there are no such sets.
    pub fn n_elements_of(&self, sets: &Range<u32>) -> u64 {
        let alive = &self.alive()[sets.start as usize..sets.end as usize];
        alive.iter().map(|bits| u64::from(bits.count_ones())).sum()
    }

    /// One state field of a local element.
    pub fn field(&self, element: usize, field: usize) -> f64 {
        self.element(element)[field]
    }

    /// The state of a local element as [`Block::piece`] has it, one number per entry of [`crate::state::FIELDS`].
    pub fn element(&self, element: usize) -> [f64; N_FIELDS] {
        self.group.element(element, &self.x)
    }

    /// The state of a local element, and behind it its history variables, see [`Part::columns`](crate::mesh::Part::columns).
    pub fn reading(&self, element: usize) -> Vec<f64> {
        let slot = self.slot(element);
        self.element(element).into_iter().chain(self.group.variables(slot)).collect()
    }

    /// The lane set of a local element.
    pub fn set_of_element(&self, element: usize) -> u32 {
        (self.slot(element) / SET) as u32
    }

    /// Local nodes of the corners of a local element.
    pub fn corners(&self, element: usize) -> [u32; 8] {
        self.group.corners(element)
    }

    /// Local nodes of a local element, in the order of [`Part::nodes_of`](crate::mesh::Part::nodes_of).
    pub fn nodes_of(&self, element: usize) -> Nodes {
        self.group.nodes(element)
    }

    /// Whether its elements have a volume of their own.
    pub(crate) fn is_of_solids(&self) -> bool {
        match self.topology {
            Topology::Structured { .. } | Topology::Explicit { .. } => true,
            Topology::EightPoint { .. } | Topology::Tetrahedra { .. } => true,
            Topology::Shells { .. } | Topology::Beams { .. } => false,
            Topology::Trusses { .. } | Topology::Springs { .. } => false,
        }
    }

    /// Local nodes of a side of a local element, see [`Part::side`](crate::mesh::Part::side).
    pub fn side(&self, element: usize, side: usize) -> [u32; 4] {
        let nodes = self.nodes_of(element);
        self.topology.side(side).map(|node| nodes[node])
    }

    /// For each set, whether one of its elements has a node that `marked` (by local node) holds true: the sets to
    /// compute before the forces of those nodes travel.
    ///
    /// # Panics
    /// If `marked` is not by local node.
    pub fn sets_touching(&self, marked: &[bool]) -> Vec<bool> {
        assert!(marked.len() == self.nodes.len(), "{} marks, {} nodes", marked.len(), self.nodes.len());
        let mut touching = vec![false; self.alive().len()];
        for element in 0..self.n_elements() {
            let touches = self.nodes_of(element).iter().any(|&node| marked[node as usize]);
            touching[self.slot(element) / SET] |= touches;
        }
        touching
    }

    /// See [`crate::cycle::Domain::plant_fault`].
    pub(crate) fn plant_fault(&mut self) {
        if let Some(stress) = self.group.first_stress() {
            *stress = stress.next_up();
        }
    }

    /// The numbers of this target, for tests that flip bits in them. What [`Target::Votes`] are, and contact keeps of nodes, is
    /// not here.
    pub(crate) fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        let Self { x, v, f, mass, turning, group, .. } = self;
        let mut numbers = group.numbers_mut(target);
        match (target, turning) {
            (Target::Positions, _) => numbers.extend(x.iter_mut().map(Vec::as_mut_slice)),
            (Target::Velocities, _) => numbers.extend(v.iter_mut().map(Vec::as_mut_slice)),
            (Target::Spins, Some(turning)) => numbers.extend(turning.w.iter_mut().map(Vec::as_mut_slice)),
            (Target::Forces, turning) => {
                let moments = turning.iter_mut().flat_map(|turning| &mut turning.m);
                numbers.extend(f.iter_mut().chain(moments).map(Vec::as_mut_slice));
            }
            (Target::Constants, turning) => {
                numbers.push(mass);
                numbers.extend(turning.as_mut().map(|turning| turning.inertia.as_mut_slice()));
            }
            _ => {}
        }
        numbers
    }

    /// Sets all forces and moments to zero.
    pub fn clear_forces(&mut self) {
        let moments = self.turning.iter_mut().flat_map(|turning| &mut turning.m);
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
        let nodes = Nodal::of(&self.x, &self.v, &mut self.f);
        self.group.compute(nodes, self.turning.as_mut(), &Call { material, sets, step, width }, vote);
    }
}

/// The first `n` of arrays by axis, by node.
fn by_node(n: usize, arrays: &[Vec<f64>; 3]) -> Vec<[f64; 3]> {
    (0..n).map(|node| std::array::from_fn(|axis| arrays[axis][node])).collect()
}

/// Rotations of the first `n` nodes, as a piece carries them.
fn of_shells(n: usize, turning: Option<&Turning>) -> ShellState {
    let Some(turning) = turning else { return ShellState::default() };
    ShellState { spin: by_node(n, &turning.w), inertia: turning.inertia[..n].to_vec() }
}
