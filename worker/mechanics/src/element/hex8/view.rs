//! The arrays of a block as a kernel reads and writes them.

use crate::{
    element::{
        hourglass::{Amplitudes, N_FORCES},
        layout::Layout,
        place::Nodal,
    },
    lanes::Lane,
    state::N_FIELDS,
};

/// The arrays of a block as a kernel sees them. State arrays are by slot, node arrays by local node and padded.
pub(crate) struct View<'a> {
    pub layout: &'a Layout,
    /// Entries of a node array that the kernel may touch.
    pub reach: usize,
    pub nodes: Nodal<'a>,
    pub slots: BySlot<'a>,
}

/// Arrays by slot or set.
pub(crate) struct BySlot<'a> {
    pub fields: [&'a mut [f64]; N_FIELDS],
    /// Forces of elastic hourglass control; empty without it.
    pub hourglass: [&'a mut [f64]; N_FORCES],
    /// One array per history variable of the material.
    pub history: &'a mut [Vec<f64>],
    /// Volume at time zero by slot; 1 in phantoms.
    pub initial_volume: &'a [f64],
    /// Bits of the slots of a set whose elements take part; phantoms do not.
    pub alive: &'a [u8],
    /// Global element index by slot.
    pub elements: &'a [u32],
    /// Lowest global element index by set.
    pub lowest: &'a [u32],
}

impl BySlot<'_> {
    /// A state field of the slots from `slot` on, which is inside the arrays.
    #[inline(always)]
    pub fn state<L: Lane>(&self, slot: usize, field: usize) -> L {
        // SAFETY: the kernel keeps slots inside the state arrays.
        unsafe { L::load(self.fields[field], slot) }
    }

    /// Writes a state field of the active lanes; the others keep theirs.
    #[inline(always)]
    pub fn set_state<L: Lane>(&mut self, slot: usize, field: usize, value: L, active: L::Mask) {
        let kept = self.state(slot, field);
        // SAFETY: the kernel keeps slots inside the state arrays.
        unsafe { L::select(active, value, kept).store(self.fields[field], slot) };
    }

    /// Forces of elastic hourglass control of the slots from `slot` on; they have such control.
    #[inline(always)]
    pub fn hourglass<L: Lane>(&self, slot: usize) -> Amplitudes<L> {
        let mut forces = [L::splat(0.0); N_FORCES];
        for i in 0..N_FORCES {
            // SAFETY: the kernel keeps slots inside the state arrays, which these are with elastic control.
            forces[i] = unsafe { L::load(self.hourglass[i], slot) };
        }
        Amplitudes::from_array(forces)
    }

    /// Writes them for the active lanes; the others keep theirs.
    #[inline(always)]
    pub fn set_hourglass<L: Lane>(&mut self, slot: usize, forces: Amplitudes<L>, active: L::Mask) {
        let forces = forces.to_array();
        for i in 0..N_FORCES {
            // SAFETY: as in `hourglass`.
            unsafe {
                let kept = L::load(self.hourglass[i], slot);
                L::select(active, forces[i], kept).store(self.hourglass[i], slot);
            }
        }
    }
}
