//! Erosion: which elements leave a run, and what is left of them.
//!
//! [`Criteria`] say by part when an element is taken out. An element that meets one at the start of its pass of cycle `n` gives
//! no force in that cycle nor in any after it, has no vote, and keeps its last state; its internal energy is booked as
//! eroded in the vote of `n`. Its faces stay on the contact surface until that vote has been answered: from cycle
//! `n + `[`SURFACE_LAG`] on they are gone and the faces that they hid are outside. So neither cycle depends on how a run is cut,
//! sorted or timed.
//!
//! Mass stays at the nodes. A node without any element left is *freed*: it flies on and keeps colliding, or it leaves the
//! run too, with its mass, momentum and kinetic energy booked, as [`Erosion::retain_inertia`] says.
//!
//! Strains are those of the middle of an element, and effective ones: `sqrt(2/3 e:e)`, which is 1 where a bar of constant
//! volume is `e` = 2.718 times as long as at first.

use serde::{Deserialize, Serialize};

/// Limit of a geometric strain where the deck gives none.
pub const GEOMETRIC_STRAIN: f64 = 1.5;

/// Cycles from that in which an element erodes to the first on the new surface: its vote comes with the next frame, the orders
/// that answer it act two cycles later, where positions travel, and the sort of those acts in the cycle after.
pub const SURFACE_LAG: u64 = 4;

/// Stands for the cycle of erosion of an element that is alive.
pub const ALIVE: u64 = u64::MAX;

/// What erodes in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Erosion {
    /// Whether nodes that have lost all their elements keep their inertia and stay in the run.
    pub retain_inertia: bool,
    /// Criteria by part; none for a part that does not erode. Empty if nothing does.
    pub parts: Vec<Option<Criteria>>,
}

impl Default for Erosion {
    fn default() -> Self {
        Self { retain_inertia: true, parts: Vec::new() }
    }
}

impl Erosion {
    /// Whether any part erodes.
    pub fn is_on(&self) -> bool {
        self.parts.iter().any(Option::is_some)
    }

    /// Whether any part erodes by its incremental strain, which is then part of the state.
    pub fn counts_strain(&self) -> bool {
        self.parts.iter().flatten().any(|criteria| criteria.incremental_strain.is_some())
    }

    /// The criteria of a part.
    pub fn of_part(&self, part: usize) -> Option<&Criteria> {
        self.parts.get(part).and_then(Option::as_ref)
    }
}

/// When elements of a part erode: as soon as they meet one of these. At least one is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Criteria {
    /// Instantaneous geometric strain: `sqrt(2/3 h:h)` with the logarithmic strain `h` from the initial shape to that of now.
    /// An element that is turned inside out has met it.
    pub geometric_strain: Option<f64>,
    /// Incremental geometric strain: `sqrt(2/3 D:D)` over time, with the rate of deformation `D`. It never falls. An element
    /// that is turned inside out has met it.
    pub incremental_strain: Option<f64>,
    /// Effective plastic strain.
    pub plastic_strain: Option<f64>,
    /// The failure law of the material: damage has reached 1.
    pub failure: bool,
    /// The time step that the element allows, by the wave speed of its material at rest and with the safety factor, is below
    /// this (time).
    pub time_step: Option<f64>,
}

impl Criteria {
    /// Whether there is any.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
