//! The typed deck: what a user asks for, by whichever format, before it is looked at as a whole.
//!
//! Both readers fill it: that of TOML decks (`toml_deck`) and that of keyword decks (`keyword`). Checks of what spans entries
//! and the making of the [`crate::model::Model`] (`make`) read it, and `write` puts it into the text of a TOML deck. Parts, curves and
//! sets are referred to by name; numbers are in the units of the deck, and inside the ranges that [`crate::table::Range`]
//! gives them. What could not be read was reported by the reader and is `None` here, so that checks can go on past it without
//! a second fault.

pub(crate) mod condition;
pub(crate) mod contact;
pub(crate) mod mesh;
pub(crate) mod part;
pub(crate) mod stress;

use mechanics::{burn::Detonation, element::hourglass::Hourglass};

use crate::{
    place::{Place, Placed},
    units::Units,
};
use condition::{Boundary, Curve, Gravity, Joint, Load, Lumped, Parts, Region, Relaxation, Rigid, Wall};
use contact::{Contact, Join};
use part::{Own, Part};
use stress::Stress;

#[derive(Clone, Debug)]
pub(crate) struct Deck {
    pub(crate) title: String,
    pub(crate) units: Units,
    pub(crate) control: Option<Control>,
    /// Materials of the deck's own, used or not.
    pub(crate) materials: Vec<Own>,
    pub(crate) parts: Vec<Part>,
    pub(crate) joins: Vec<Join>,
    pub(crate) curves: Vec<Curve>,
    pub(crate) boundaries: Vec<Boundary>,
    pub(crate) symmetry: Option<Symmetry>,
    pub(crate) walls: Vec<Wall>,
    pub(crate) rigid: Vec<Rigid>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) masses: Vec<Lumped>,
    pub(crate) loads: Vec<Load>,
    pub(crate) gravity: Option<Gravity>,
    pub(crate) relaxation: Option<Relaxation>,
    pub(crate) stresses: Vec<Stress>,
    pub(crate) contact: Option<Contact>,
    /// Whether the deck asks for contact, be it in a way that could not be read.
    pub(crate) has_contact: bool,
    pub(crate) erosion: Option<FreedNodes>,
    pub(crate) output: Output,
    pub(crate) sections: Vec<Section>,
    pub(crate) gauges: Vec<Gauge>,
    pub(crate) detonations: Vec<(Place, Option<Detonation>)>,
}

impl Deck {
    /// A deck with a title and nothing else.
    pub(crate) fn new(title: String, units: Units) -> Self {
        Self {
            title,
            units,
            control: None,
            materials: Vec::new(),
            parts: Vec::new(),
            joins: Vec::new(),
            curves: Vec::new(),
            boundaries: Vec::new(),
            symmetry: None,
            walls: Vec::new(),
            rigid: Vec::new(),
            joints: Vec::new(),
            masses: Vec::new(),
            loads: Vec::new(),
            gravity: None,
            relaxation: None,
            stresses: Vec::new(),
            contact: None,
            has_contact: false,
            erosion: None,
            output: Output::default(),
            sections: Vec::new(),
            gauges: Vec::new(),
            detonations: Vec::new(),
        }
    }
}

/// Ends, time step and damping; none where the default is to serve.
#[derive(Clone, Debug)]
pub(crate) struct Control {
    pub(crate) at: Place,
    pub(crate) end_time: Option<f64>,
    pub(crate) end_cycle: Option<u64>,
    pub(crate) safety_factor: Option<f64>,
    pub(crate) growth: Option<f64>,
    pub(crate) energy_error: Option<f64>,
    pub(crate) time_step_floor: Option<f64>,
    pub(crate) linear_viscosity: Option<f64>,
    pub(crate) quadratic_viscosity: Option<f64>,
    /// That of parts without one of their own.
    pub(crate) hourglass: Option<Hourglass>,
    pub(crate) sort_lag: Option<u32>,
    pub(crate) plan_interval: Option<u32>,
}

impl Control {
    /// Defaults throughout.
    pub(crate) fn new(at: Place) -> Self {
        Self {
            at,
            end_time: None,
            end_cycle: None,
            safety_factor: None,
            growth: None,
            energy_error: None,
            time_step_floor: None,
            linear_viscosity: None,
            quadratic_viscosity: None,
            hourglass: None,
            sort_lag: None,
            plan_interval: None,
        }
    }
}

/// Planes at which the whole problem is mirrored, all through the origin: what lies below them is left out.
#[derive(Clone, Debug)]
pub(crate) struct Symmetry {
    pub(crate) at: Place,
    /// Whether there is a plane across each axis.
    pub(crate) planes: [bool; 3],
}

/// What becomes of nodes that have lost all their elements.
#[derive(Clone, Debug)]
pub(crate) struct FreedNodes {
    pub(crate) at: Place,
    pub(crate) retain_inertia: Option<Placed<bool>>,
    /// Parts of which they press on each other.
    pub(crate) particles: Option<Placed<Parts>>,
}

/// Pairs of parts by name.
pub(crate) type PartPairs = Vec<Placed<[Placed<String>; 2]>>;

/// What to write and when.
#[derive(Clone, Debug)]
pub(crate) struct Output {
    pub(crate) period: Option<f64>,
    pub(crate) history_cycles: u32,
    pub(crate) snapshot_seconds: Option<f64>,
    pub(crate) snapshot_cycles: Option<u64>,
    pub(crate) fields: Vec<String>,
    pub(crate) formats: Vec<String>,
    pub(crate) compress: bool,
    pub(crate) workers: bool,
    pub(crate) contact_surface: Option<Placed<bool>>,
    /// Pairs of parts whose contact force is wanted.
    pub(crate) contact_forces: Option<Placed<PartPairs>>,
}

impl Default for Output {
    fn default() -> Self {
        let crate::model::Output { period, history_cycles, compress, workers, .. } =
            crate::model::Output::default();
        Self {
            period,
            history_cycles,
            snapshot_seconds: None,
            snapshot_cycles: None,
            fields: Vec::new(),
            formats: Vec::new(),
            compress,
            workers,
            contact_surface: None,
            contact_forces: None,
        }
    }
}

/// What a cross-section cuts.
#[derive(Clone, Debug)]
pub(crate) enum Cut {
    Plane {
        /// Point and normal, of any length above 0; none where they could not be read.
        plane: Option<[[f64; 3]; 2]>,
        parts: Parts,
        /// Elements whose centre is farther from the point are not cut.
        radius: Option<f64>,
    },
    /// These elements, whose corners among these nodes are ahead of the cut.
    Listed {
        nodes: Region,
        /// Numbers of solids, of shells and of trusses.
        elements: [Vec<Placed<u32>>; 3],
    },
}

/// A cut through bodies, whose force is wanted.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    pub(crate) at: Place,
    /// What it is called in messages.
    pub(crate) title: String,
    pub(crate) name: Option<Placed<String>>,
    pub(crate) cut: Cut,
}

/// A history of a node or of an element.
#[derive(Clone, Debug)]
pub(crate) struct Gauge {
    pub(crate) name: Option<Placed<String>>,
    pub(crate) of: Kind,
    /// None where it could not be read.
    pub(crate) spot: Option<Spot>,
    /// Where the nearest is looked for; every part without it.
    pub(crate) part: Option<Placed<String>>,
}

/// What a gauge stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Node,
    Element,
}

/// Where a gauge stands.
#[derive(Clone, Debug)]
pub(crate) enum Spot {
    /// The user's number of a node or element.
    Number(Placed<u32>),
    /// The nearest to this point.
    Point(Placed<[f64; 3]>),
    /// The nearest to the centre of its part.
    Centre,
}
