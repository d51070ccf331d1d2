//! What elements have at the start: stress and plastic strain.

use mechanics::initial::Points;

use super::condition::Parts;
use crate::place::{Place, Placed};

/// Stress and plastic strain of some elements at the start.
#[derive(Clone, Debug)]
pub(crate) struct Stress {
    pub(crate) at: Place,
    /// What it is called in messages.
    pub(crate) title: String,
    pub(crate) parts: Parts,
    /// Numbers of elements of these parts; all without.
    pub(crate) elements: Option<Vec<Placed<u32>>>,
    /// None where it could not be read.
    pub(crate) points: Option<Points>,
}
