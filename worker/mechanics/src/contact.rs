//! The words of contact, and the order of its stages; nothing is computed here.

use serde::{Deserialize, Serialize};

/// Contact settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Radius of the contact detection zone (length).
    pub gap: f64,
    /// Slack: how far bodies may move against each other before the lists are stale (length).
    pub slack: f64,
    /// Coulomb coefficient by pair of parts, row-major, `n_parts * n_parts`, symmetric.
    pub friction: Vec<f64>,
    /// Which pairs of parts interact, row-major, symmetric; the diagonal is self-interaction.
    pub interacts: Vec<bool>,
    /// Factor on the penalty stiffness `K A^2 / V`; 0.5.
    pub stiffness: f64,
    /// Velocity over which friction is regularised (length per time): below it the force is proportional to
    /// the sliding velocity, so bodies creep instead of sticking.
    pub friction_velocity: f64,
}
