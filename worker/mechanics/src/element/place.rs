//! How a kernel comes by what a lane set has at its corners, and adds forces there: a loop for each layout, in which no load
//! has to choose.

use super::layout::{Along, Corners, Layout};
use crate::lanes::{Lane, SET};

/// Node arrays.
pub(crate) struct Nodal<'a> {
    pub x: [&'a [f64]; 3],
    pub v: [&'a [f64]; 3],
    pub f: [&'a mut [f64]; 3],
}

impl<'a> Nodal<'a> {
    /// The arrays of a block.
    pub fn of(x: &'a [Vec<f64>; 3], v: &'a [Vec<f64>; 3], f: &'a mut [Vec<f64>; 3]) -> Self {
        Self {
            x: x.each_ref().map(Vec::as_slice),
            v: v.each_ref().map(Vec::as_slice),
            f: f.each_mut().map(Vec::as_mut_slice),
        }
    }

    #[inline(always)]
    pub(super) fn reborrow(&mut self) -> Nodal<'_> {
        let [fx, fy, fz] = &mut self.f;
        Nodal { x: self.x, v: self.v, f: [fx, fy, fz] }
    }
}

/// Values of one node array at the eight corners.
///
/// # Safety
/// As [`compute`](super::hex8::compute).
#[inline(always)]
pub(crate) unsafe fn corners<L: Lane>(layout: &Layout, from: &[f64], slot: usize) -> [L; 8] {
    // SAFETY: the caller's promise.
    unsafe {
        match layout {
            Layout::Structured { row, plane, base } => {
                Rows { row: *row, plane: *plane, base }.corners(from, slot)
            }
            Layout::Explicit { sets, lists } => match *sets.get_unchecked(slot / SET) {
                Corners::Run(along, first) => Bases { first, along: Some(along) }.corners(from, slot),
                Corners::List(list) => {
                    let [a, b, c, d, e, f, g, h] = lists.get_unchecked(list as usize);
                    let lane = slot % SET;
                    [
                        L::gather(from, a, lane),
                        L::gather(from, b, lane),
                        L::gather(from, c, lane),
                        L::gather(from, d, lane),
                        L::gather(from, e, lane),
                        L::gather(from, f, lane),
                        L::gather(from, g, lane),
                        L::gather(from, h, lane),
                    ]
                }
            },
        }
    }
}

/// A layout as the loop over its sets knows it.
pub(super) trait Place: Copy {
    /// Values of one node array at the eight corners.
    ///
    /// # Safety
    /// As [`compute`](super::hex8::compute).
    unsafe fn corners<L: Lane>(self, from: &[f64], slot: usize) -> [L; 8];

    /// Adds corner values to one node array. Every value is a multiple of the quantum, so no order can show.
    ///
    /// # Safety
    /// As [`compute`](super::hex8::compute).
    unsafe fn scatter<L: Lane>(self, to: &mut [f64], slot: usize, values: [L; 8]);

    /// Asks for what the next set will be the first to touch of a node array.
    fn fetch_ahead(self, array: &[f64], slot: usize);
}

/// [`Layout::Structured`].
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub(super) row: usize,
    pub(super) plane: usize,
    pub(super) base: &'a [u32],
}

impl Place for Rows<'_> {
    #[inline(always)]
    unsafe fn corners<L: Lane>(self, from: &[f64], slot: usize) -> [L; 8] {
        let Self { row, plane, base } = self;
        // SAFETY: the caller's promise covers every access here.
        unsafe {
            let n = *base.get_unchecked(slot / SET) as usize + slot % SET;
            [
                L::load(from, n),
                L::load(from, n + 1),
                L::load(from, n + row + 1),
                L::load(from, n + row),
                L::load(from, n + plane),
                L::load(from, n + plane + 1),
                L::load(from, n + plane + row + 1),
                L::load(from, n + plane + row),
            ]
        }
    }

    #[inline(always)]
    unsafe fn scatter<L: Lane>(self, to: &mut [f64], slot: usize, values: [L; 8]) {
        let Self { row, plane, base } = self;
        // SAFETY: the caller's promise covers every access here.
        unsafe {
            let n = *base.get_unchecked(slot / SET) as usize + slot % SET;
            add_pair(to, n, values[0], values[1]);
            add_pair(to, n + row, values[3], values[2]);
            add_pair(to, n + plane, values[4], values[5]);
            add_pair(to, n + plane + row, values[7], values[6]);
        }
    }

    #[inline(always)]
    fn fetch_ahead(self, array: &[f64], slot: usize) {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let n = self.base[slot / SET] as usize + slot % SET + 2 * SET;
            for at in [n + self.plane + self.row, n + self.row] {
                // SAFETY: any address may be asked for.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(array.as_ptr().wrapping_add(at).cast()) }
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = (array, slot);
    }
}

/// A set of [`Layout::Explicit`], in the node arrays or packed.
#[derive(Clone, Copy)]
pub(super) struct Bases {
    /// Where each corner of the first slot is; those of the next follow it.
    pub(super) first: [u32; 8],
    /// The direction of a run; none of what is packed, where every corner has its own entry.
    pub(super) along: Option<Along>,
}

impl Bases {
    #[inline(always)]
    fn at(self, corner: usize, slot: usize) -> usize {
        self.first[corner] as usize + slot % SET
    }

    /// # Safety
    /// As [`compute`](super::hex8::compute).
    #[inline(always)]
    unsafe fn add_pairs<L: Lane>(self, to: &mut [f64], slot: usize, values: [L; 8], along: Along) {
        let [[a, b], [c, d], [e, f], [g, h]] = along.pairs();
        // SAFETY: the caller's promise; the corners of the face behind are one before those of the other.
        unsafe {
            add_pair(to, self.at(a, slot), values[a], values[b]);
            add_pair(to, self.at(c, slot), values[c], values[d]);
            add_pair(to, self.at(e, slot), values[e], values[f]);
            add_pair(to, self.at(g, slot), values[g], values[h]);
        }
    }
}

impl Place for Bases {
    #[inline(always)]
    unsafe fn corners<L: Lane>(self, from: &[f64], slot: usize) -> [L; 8] {
        // SAFETY: the caller's promise covers every access here; the nodes of a run follow each other.
        unsafe {
            [
                L::load(from, self.at(0, slot)),
                L::load(from, self.at(1, slot)),
                L::load(from, self.at(2, slot)),
                L::load(from, self.at(3, slot)),
                L::load(from, self.at(4, slot)),
                L::load(from, self.at(5, slot)),
                L::load(from, self.at(6, slot)),
                L::load(from, self.at(7, slot)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn scatter<L: Lane>(self, to: &mut [f64], slot: usize, values: [L; 8]) {
        // SAFETY: the caller's promise covers every access here.
        unsafe {
            match self.along {
                // Each by itself, so that no value is chosen by an index in memory.
                Some(Along::I) => self.add_pairs(to, slot, values, Along::I),
                Some(Along::J) => self.add_pairs(to, slot, values, Along::J),
                Some(Along::K) => self.add_pairs(to, slot, values, Along::K),
                None => {
                    let mut corner = 0;
                    while corner < 8 {
                        values[corner].store(to, self.at(corner, slot));
                        corner += 1;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn fetch_ahead(self, _array: &[f64], _slot: usize) {}
}

/// What a set has at its corners, by corner and slot.
pub(super) const PACKED: Bases = Bases { first: [0, 8, 16, 24, 32, 40, 48, 56], along: None };

/// The node arrays of a set that is no run, put together by corner and slot.
#[repr(align(64))]
pub(super) struct Packed {
    x: [[f64; 8 * SET]; 3],
    v: [[f64; 8 * SET]; 3],
    f: [[f64; 8 * SET]; 3],
}

impl Packed {
    pub(super) fn new() -> Self {
        let zeros = [[0.0; 8 * SET]; 3];
        Self { x: zeros, v: zeros, f: zeros }
    }

    #[inline(always)]
    pub(super) fn nodal(&mut self) -> Nodal<'_> {
        let [fx, fy, fz] = &mut self.f;
        Nodal {
            x: [&self.x[0], &self.x[1], &self.x[2]],
            v: [&self.v[0], &self.v[1], &self.v[2]],
            f: [fx, fy, fz],
        }
    }

    /// Positions and velocities of these nodes.
    ///
    /// # Safety
    /// The nodes are inside the arrays.
    #[inline(always)]
    pub(super) unsafe fn gather<L: Lane>(&mut self, nodes: &Nodal<'_>, list: &[[u32; SET]; 8]) {
        let mut corner = 0;
        while corner < 8 {
            let of_slots = list[corner];
            let mut lane = 0;
            while lane < SET {
                let mut axis = 0;
                while axis < 3 {
                    // SAFETY: the caller's promise; a set has eight slots.
                    unsafe {
                        let at = corner * SET + lane;
                        L::gather(nodes.x[axis], &of_slots, lane).store(&mut self.x[axis], at);
                        L::gather(nodes.v[axis], &of_slots, lane).store(&mut self.v[axis], at);
                    }
                    axis += 1;
                }
                lane += L::N;
            }
            corner += 1;
        }
    }

    /// Adds the forces to those of these nodes. Every value is a multiple of the quantum, so no order can show.
    ///
    /// # Safety
    /// The nodes are inside the arrays.
    #[inline(always)]
    pub(super) unsafe fn scatter(&self, nodes: &mut Nodal<'_>, list: &[[u32; SET]; 8]) {
        let mut corner = 0;
        while corner < 8 {
            let mut lane = 0;
            while lane < SET {
                let node = list[corner][lane] as usize;
                let mut axis = 0;
                while axis < 3 {
                    // SAFETY: the caller's promise.
                    unsafe { *nodes.f[axis].get_unchecked_mut(node) += self.f[axis][corner * SET + lane] };
                    axis += 1;
                }
                lane += 1;
            }
            corner += 1;
        }
    }
}

/// Adds `low` from `at` on and `high` from `at + 1` on. Two stores of which the second overlaps the first would
/// make its load wait, so the lanes are added in registers and only the last goes alone.
///
/// # Safety
/// `at + N < to.len()`.
#[inline(always)]
unsafe fn add_pair<L: Lane>(to: &mut [f64], at: usize, low: L, high: L) {
    let (shifted, last) = high.shifted_up();
    // SAFETY: the caller keeps the lanes inside.
    unsafe {
        (L::load(to, at) + (low + shifted)).store(to, at);
        *to.get_unchecked_mut(at + L::N) += last;
    }
}
