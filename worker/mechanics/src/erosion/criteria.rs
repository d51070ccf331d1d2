//! When elements erode, and what a state keeps of it.

use serde::{Deserialize, Serialize};

/// When elements of a part erode: as soon as they meet one of these. At least one is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Criteria {
    /// Instantaneous geometric strain: `sqrt(2/3 h:h)` with the logarithmic strain `h` from the initial shape to that of now.
    /// An element that is turned inside out has met it.
    pub geometric_strain: Option<f64>,
    /// Incremental geometric strain: `sqrt(2/3 D:D)` over time, with the rate of deformation `D`. It never falls. An element
    /// that is turned inside out has met it.
    pub incremental_strain: Option<f64>,
    /// Effective plastic strain; of shells, whose layers break at it one by one, that of the last of them. Shells erode by nothing else.
    pub plastic_strain: Option<f64>,
    /// The failure law of the material: damage has reached 1.
    pub failure: bool,
    /// Greatest logarithmic shear strain from the initial shape: half of what the greatest principal one is above the least.
    /// An element that is turned inside out has met it, here and in the next two.
    pub shear_strain: Option<f64>,
    /// Greatest logarithmic principal strain from the initial shape, in tension.
    pub principal_strain: Option<f64>,
    /// Greatest logarithmic principal strain from the initial shape, in compression.
    pub compressive_strain: Option<f64>,
    /// Logarithm of the volume over the initial one.
    pub expansion: Option<f64>,
    /// Logarithm of the initial volume over the volume.
    pub compaction: Option<f64>,
    /// Pressure, without artificial viscosity (stress).
    pub pressure: Option<f64>,
    /// Mean stress in tension: the pressure with its sign turned (stress).
    pub tension: Option<f64>,
    /// Greatest principal stress, in tension (stress).
    pub principal_stress: Option<f64>,
    /// Von Mises stress (stress).
    pub von_mises: Option<f64>,
    /// Temperature (K), of a material that has one.
    pub temperature: Option<f64>,
    /// The time step that the element allows, by the wave speed of its material at rest and with the safety factor, is below
    /// this (time).
    pub time_step: Option<f64>,
}

impl Criteria {
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// What a piece carries of erosion, in runs where anything erodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PieceErosion {
    /// Cycle in which each local element eroded, or [`ALIVE`](crate::state::ALIVE).
    pub eroded: Vec<u64>,
    /// Incremental geometric strain by local element; empty if no part of the run erodes by it.
    pub strain: Vec<f64>,
    /// Position at time zero by local node (length); empty in states, which it does not change.
    pub initial: Vec<[f64; 3]>,
}
