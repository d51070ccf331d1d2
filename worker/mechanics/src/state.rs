//! What a cycle changes, by global index: the form in which the master holds, stores and hashes a run.

use serde::{Deserialize, Serialize};

/// Element state fields in their order inside [`GlobalState::elements`] and inside a block.
///
/// Deviatoric stress (zz is minus the sum of xx and yy), pressure, internal energy per initial volume,
/// effective plastic strain, temperature, current volume over initial volume, damage, and the time until the
/// detonation arrives.
pub const FIELDS: [&str; 12] = [
    "stress_xx",
    "stress_yy",
    "stress_xy",
    "stress_yz",
    "stress_zx",
    "pressure",
    "energy",
    "plastic_strain",
    "temperature",
    "relative_volume",
    "damage",
    "time_to_light",
];

/// Number of element state fields.
pub const N_FIELDS: usize = FIELDS.len();

/// Indices into [`FIELDS`].
pub mod field {
    /// Deviatoric stress xx.
    pub const SXX: usize = 0;
    /// Deviatoric stress yy.
    pub const SYY: usize = 1;
    /// Deviatoric stress xy.
    pub const SXY: usize = 2;
    /// Deviatoric stress yz.
    pub const SYZ: usize = 3;
    /// Deviatoric stress zx.
    pub const SZX: usize = 4;
    /// Pressure, artificial viscosity not included.
    pub const PRESSURE: usize = 5;
    /// Internal energy per initial volume.
    pub const ENERGY: usize = 6;
    /// Effective plastic strain.
    pub const PLASTIC_STRAIN: usize = 7;
    /// Temperature (K).
    pub const TEMPERATURE: usize = 8;
    /// Volume over initial volume.
    pub const RELATIVE_VOLUME: usize = 9;
    /// Damage, 0 (whole) to 1 (failed).
    pub const DAMAGE: usize = 10;
    /// Time until the detonation arrives (time), negative after that; runs down with the steps. Zero where nothing
    /// burns.
    pub const TIME_TO_LIGHT: usize = 11;
}

/// The whole state of a run at the start of a cycle. Node arrays by global node index, element arrays by
/// global element index.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GlobalState {
    /// Cycles completed.
    pub cycle: u64,
    /// Time at `x` (time).
    pub time: f64,
    /// Position `x_n` (length).
    pub x: Vec<[f64; 3]>,
    /// Velocity `v_{n-1/2}` (length per time).
    pub v: Vec<[f64; 3]>,
    /// Nodal mass.
    pub mass: Vec<f64>,
    /// Index into [`crate::setup::Setup::constraints`] by node.
    pub constraint: Vec<u16>,
    /// Initial volume by element.
    pub initial_volume: Vec<f64>,
    /// One array per entry of [`FIELDS`], each by global element index.
    pub elements: [Vec<f64>; N_FIELDS],
    /// What shells have beside that; empty arrays in a run without shells.
    pub shells: ShellState,
}

/// What shells have beside the state of solids.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShellState {
    /// Rotation rate `w_{n-1/2}` by node (1/time); zero at nodes without shells.
    pub spin: Vec<[f64; 3]>,
    /// Rotational inertia about any axis by node (mass times length squared); zero at nodes without shells.
    pub inertia: Vec<f64>,
    /// By element: six hourglass forces, thickness, internal energy, energy of hourglass control; then for each point
    /// through the thickness, from below, stress xx, yy, xy, yz, zx in the frame of the element, plastic strain,
    /// temperature.
    pub fields: Vec<Vec<f64>>,
}
