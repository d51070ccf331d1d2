//! The seam between a block and its elements: a block has nodes and one group of elements of one kind.
//!
//! An element kind is a module that implements [`Group`] and has an arm in [`Topology`](crate::mesh::Topology) and in
//! [`kinds`](super::kinds); a block, a cycle, erosion, loads and samples ask a group by this trait and by nothing else. Elements sit in
//! *slots*, eight to a *lane set*, the same on every lane width; a slot may be empty.

use std::ops::Range;

use super::{ElementVote, Step, layout::Layout, place::Nodal};
use crate::{
    erosion::criteria::Criteria,
    flip::Target,
    lanes::{SET, Width},
    material::Material,
    mesh::Nodes,
    spin::Turning,
    state::N_FIELDS,
};

/// Stands for the global element index in a slot without an element.
pub(crate) const PHANTOM: u32 = u32::MAX;

/// What a group is told beside the nodes.
pub(crate) struct Call<'a> {
    pub material: &'a Material,
    /// The sets to compute, each once a cycle.
    pub sets: &'a [Range<u32>],
    pub step: &'a Step,
    pub width: Width,
}

impl Call<'_> {
    /// Whether a block of so many sets, whose kernels touch so many entries of a node array, can be computed.
    ///
    /// # Panics
    /// If a set is out of range or node arrays are shorter.
    pub(crate) fn check(&self, n_sets: usize, reach: usize, nodes: &Nodal<'_>) {
        let sets = self.sets;
        assert!(sets.iter().all(|r| r.end as usize <= n_sets), "sets {sets:?} of a block of {n_sets}");
        let arrays = nodes.x.iter().chain(&nodes.v).map(|a| a.len());
        let shortest = arrays.chain(nodes.f.iter().map(|a| a.len())).min().unwrap_or(0);
        assert!(shortest >= reach, "node arrays shrunk to {shortest}, below {reach}");
    }
}

/// The methods of [`Group`] of a kind that leaves its slots, and what the element as a whole keeps, to the field `solids`.
macro_rules! slots_of_solids {
    () => {
        fn reach(&self) -> usize {
            self.solids.reach()
        }

        fn alive(&self) -> &[u8] {
            self.solids.alive()
        }

        fn alive_mut(&mut self) -> &mut [u8] {
            self.solids.alive_mut()
        }

        fn n_elements(&self) -> usize {
            self.solids.n_elements()
        }

        fn global(&self, slot: usize) -> u32 {
            self.solids.global(slot)
        }

        fn slot(&self, element: usize) -> usize {
            self.solids.slot(element)
        }

        fn corners(&self, element: usize) -> [u32; 8] {
            self.solids.corners(element)
        }

        fn element(&self, element: usize, x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
            self.solids.element(element, x)
        }

        fn variables(&self, slot: usize) -> Vec<f64> {
            self.solids.variables(slot)
        }

        fn take_out(&mut self, slot: usize) -> (u32, f64) {
            self.solids.take_out(slot)
        }

        /// By the corners alone: the limits of erosion see an element as if its edges were straight.
        fn scanned(&self) -> Option<Scanned<'_>> {
            self.solids.scanned()
        }

        fn first_stress(&mut self) -> Option<&mut f64> {
            self.solids.first_stress()
        }
    };
}
pub(crate) use slots_of_solids;

/// The methods of [`Group`] of a kind of two nodes whose slots are its elements: of its fields `n_nodes`, `alive`, `elements` and `bars`.
macro_rules! slots_of_bars {
    () => {
        fn reach(&self) -> usize {
            self.n_nodes
        }

        fn alive(&self) -> &[u8] {
            &self.alive
        }

        fn alive_mut(&mut self) -> &mut [u8] {
            &mut self.alive
        }

        fn n_elements(&self) -> usize {
            self.elements.len()
        }

        fn global(&self, slot: usize) -> u32 {
            self.elements[slot]
        }

        fn slot(&self, element: usize) -> usize {
            element
        }

        fn corners(&self, element: usize) -> [u32; 8] {
            crate::mesh::spread(self.bars[element])
        }
    };
}
pub(crate) use slots_of_bars;

/// Element arrays of a [`Piece`], by local element.
pub(crate) struct ElementArrays {
    /// Volume at time zero.
    pub initial_volume: Vec<f64>,
    /// One array per entry of [`crate::state::FIELDS`]: the state, or what stands for it in results.
    pub fields: [Vec<f64>; N_FIELDS],
    /// State of this kind alone.
    pub own: Vec<Vec<f64>>,
    /// One array per entry of [`Part::columns`](crate::mesh::Part::columns).
    pub history: Vec<Vec<f64>>,
}

/// The arrays that the pass of erosion reads.
pub(crate) struct Scanned<'a> {
    pub layout: &'a Layout,
    /// Entries of a node array that a pass over all slots may touch.
    pub reach: usize,
    /// Bits of the slots of each set whose elements take part.
    pub alive: &'a [u8],
    /// One array per entry of [`crate::state::FIELDS`], by slot.
    pub fields: [&'a [f64]; N_FIELDS],
}

/// [`Group::alive`] of so many elements that sit one after the other and all take part.
pub(crate) fn all_alive(n_elements: usize) -> Vec<u8> {
    (0..n_elements.div_ceil(SET))
        .map(|set| (0..SET).map(|i| u8::from(set * SET + i < n_elements) << i).sum())
        .collect()
}

/// The slots of `sets` whose elements take part.
pub(crate) fn living(alive: &[u8], sets: &[Range<u32>]) -> impl Iterator<Item = usize> {
    let slots = sets.iter().flat_map(|range| range.start as usize * SET..range.end as usize * SET);
    slots.filter(|slot| alive[slot / SET] >> (slot % SET) & 1 == 1)
}

/// The elements of a block. Elements are by local index, nodes by the local index of the block.
pub(crate) trait Group: Send + Sync {
    /// Entries of a node array that the kernels may touch.
    fn reach(&self) -> usize;

    /// Bits of the slots of each set whose elements take part.
    fn alive(&self) -> &[u8];

    /// The same, to mask elements while others of their sets are computed.
    fn alive_mut(&mut self) -> &mut [u8];

    fn n_elements(&self) -> usize;

    /// Global index of the element of a slot, which holds one.
    fn global(&self, slot: usize) -> u32;

    fn slot(&self, element: usize) -> usize;

    /// Nodes of the corners of an element. A kind with fewer corners than a hexahedron names some of them twice.
    fn corners(&self, element: usize) -> [u32; 8];

    /// All nodes of an element, in the order of [`Part::nodes_of`](crate::mesh::Part::nodes_of).
    fn nodes(&self, element: usize) -> Nodes {
        Nodes::of(self.corners(element))
    }

    /// Adds forces and moments of the elements at `x_n`, brings their state from `n-1` to `n` (unless the step is zero) and adds
    /// their votes. The result depends neither on the width, nor on the order of sets, nor on how they are cut into calls.
    ///
    /// # Panics
    /// If a set is out of range, node arrays are shorter than the reach or the machine lacks the width.
    fn compute(
        &mut self,
        nodes: Nodal<'_>,
        turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    );

    /// What an element says of itself, one number per entry of [`crate::state::FIELDS`], with its nodes at `x`.
    fn element(&self, element: usize, x: &[Vec<f64>; 3]) -> [f64; N_FIELDS];

    /// The history variables of the element of a slot, one per entry of [`Part::columns`](crate::mesh::Part::columns).
    fn variables(&self, _slot: usize) -> Vec<f64> {
        Vec::new()
    }

    /// The arrays of the image, with the nodes at `x`.
    fn image(&self, x: &[Vec<f64>; 3]) -> ElementArrays;

    /// [`Group::image`] of a group that is not needed any more: a kind with large arrays lets them go one by one.
    fn into_image(self: Box<Self>, x: &[Vec<f64>; 3]) -> ElementArrays;

    /// Every number that a cycle changes, in a fixed order.
    fn visit(&self, visit: &mut dyn FnMut(f64));

    /// Takes the element of a slot out: it gives no force and no vote any more and keeps its state. Gives its global index and
    /// internal energy.
    fn take_out(&mut self, slot: usize) -> (u32, f64);

    /// Energy that the element of a slot takes of its nodes in the second half of the step `dt` to the positions `x` of now, with the
    /// velocities `v`, by the forces that it had before the step. A shell gives none: all its layers have broken, and what its hourglass
    /// control still holds is left out, as is what damps it.
    fn half_work(&self, _slot: usize, _moved: [&[Vec<f64>; 3]; 2], _dt: f64, _material: &Material) -> f64 {
        0.0
    }

    /// The arrays for the pass of erosion; none of a kind that looks for itself, see [`Group::met`].
    fn scanned(&self) -> Option<Scanned<'_>> {
        None
    }

    /// The slots of `sets` whose elements take part and meet a criterion of erosion, of a kind that is not [scanned](Group::scanned);
    /// none of a kind that does not erode.
    fn met(&self, _criteria: &Criteria, _sets: &[Range<u32>]) -> Vec<u32> {
        Vec::new()
    }

    /// A number of the stress of the first element, for tests that change it; none without elements.
    fn first_stress(&mut self) -> Option<&mut f64>;

    /// The arrays of numbers of this target, for tests that flip bits in them.
    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]>;
}
