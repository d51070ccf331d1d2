//! What a mesh asks of single nodes: supports, walls, forces.

use serde::{Deserialize, Serialize};

use crate::load::Drive;

/// What acts on a node alone: prescribed velocities, walls, forces. A node's constraint is the same on every holder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Constraint {
    /// Prescribed velocity by axis x, y, z (length per time); `None` is free, a constant 0 is fixed, and one
    /// fixed axis is a symmetry plane.
    pub velocity: [Option<Drive>; 3],
    /// Walls that the node feels, one bit per entry of [`crate::setup::Setup::walls`]. Decks give it for walls that name nodes; the
    /// start of a run adds the walls that name parts ([`crate::initial::bind_walls`]).
    pub walls: u32,
    /// Forces on the node, one bit per entry of [`crate::load::Loads::forces`].
    pub forces: u32,
    /// Axes about which a node of shells does not turn: bit 0 is x.
    pub clamped: u8,
    /// By axis the number of the support that prescribes the velocity, from 1; 0 is none whose force is wanted.
    pub supports: [u8; 3],
}

/// Highest number of a support whose force is booked.
pub const MAX_SUPPORTS: u8 = 64;

/// Most walls in a run: one bit each in [`Constraint::walls`].
pub const MAX_WALLS: usize = 32;
