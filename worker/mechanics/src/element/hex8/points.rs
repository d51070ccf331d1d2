//! What each point of an element of eight points keeps.

use std::ops::Range;

use crate::{
    lanes::SET,
    state::field::{DAMAGE, PLASTIC_STRAIN, SXX, SXY, SYY, SYZ, SZX, TEMPERATURE},
};

/// Points of an element: one lane set.
pub(crate) const POINTS: usize = SET;

/// The fields that each point has, indices into [`crate::state::FIELDS`].
pub(crate) const OF_POINT: [usize; 8] = [SXX, SYY, SXY, SYZ, SZX, PLASTIC_STRAIN, TEMPERATURE, DAMAGE];

/// Number of arrays that such elements have of their own ([`crate::piece::Piece::own`]): field by field, those of the points.
pub(crate) const N_OWN: usize = OF_POINT.len() * POINTS;

/// The arrays among them of the temperatures.
pub(crate) const TEMPERATURES: Range<usize> = 6 * POINTS..7 * POINTS;

/// Those of the damage.
pub(crate) const DAMAGES: Range<usize> = 7 * POINTS..8 * POINTS;
