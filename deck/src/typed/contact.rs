//! Which parts meet, and which are one body.

use mechanics::contact::Limit;

use super::condition::Parts;
use crate::place::{Origin, Place, Placed};

/// Contact of a deck.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) at: Place,
    pub(crate) friction: f64,
    /// Coefficient of fast sliding; none where it is that at rest.
    pub(crate) friction_kinetic: Option<f64>,
    /// How fast the coefficient falls with the sliding velocity (time per length).
    pub(crate) friction_decay: f64,
    /// Whether different parts meet that no pair names.
    pub(crate) default_interacts: bool,
    /// Parts that meet themselves.
    pub(crate) self_interaction: Option<Parts>,
    pub(crate) pairs: Vec<Pair>,
    pub(crate) ties: Vec<Tie>,
    pub(crate) gap: Gap,
    pub(crate) slack: Slack,
    pub(crate) stiffness: Option<f64>,
    /// Given, nothing sticks.
    pub(crate) friction_velocity: Option<f64>,
    pub(crate) edges: bool,
    /// Whether parts that overlap at the start may.
    pub(crate) ignores_initial: bool,
}

/// What is said of two parts.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    pub(crate) origin: Origin,
    pub(crate) parts: [Placed<String>; 2],
    pub(crate) interacts: bool,
    pub(crate) friction: Option<f64>,
    pub(crate) friction_kinetic: Option<f64>,
}

/// Outer nodes of some parts tied to the outer faces of others.
#[derive(Clone, Debug)]
pub(crate) struct Tie {
    pub(crate) at: Place,
    pub(crate) nodes: Vec<Placed<String>>,
    pub(crate) faces: Vec<Placed<String>>,
    /// Greatest distance of a tied node from its face, over the smallest edge of both parts.
    pub(crate) tolerance: f64,
    /// Of pull and shear, where it breaks by them.
    pub(crate) limits: [Option<Limit>; 2],
}

/// How thick contact is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Gap {
    Default,
    /// By the distance of the bodies.
    Fit,
    /// Over the smallest face dimension.
    Fraction(f64, Origin),
    Length(f64, Origin),
    /// What could not be read.
    Broken,
}

/// How far beyond the gap lists of contact look.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Slack {
    Default,
    Gaps(f64),
    Length(f64),
    /// What could not be read.
    Broken,
}

/// Parts whose coincident nodes become one.
#[derive(Clone, Debug)]
pub(crate) struct Join {
    pub(crate) at: Place,
    pub(crate) parts: Parts,
    /// Greatest distance of nodes that merge, over the smallest edge of the joined parts.
    pub(crate) tolerance: f64,
}
