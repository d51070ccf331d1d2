//! What a worker reports of a whole cycle: minima, maxima and exact sums, merged in any order.
//!
//! A vote of cycle `n` travels with the frame of cycle `n + 1` and takes effect a fixed lag later, on one
//! worker as on sixteen. Nothing here depends on how elements and nodes were dealt to workers.

mod numbers;

pub use numbers::not_a_number;
use serde::{Deserialize, Serialize};

use crate::{
    contact::{ContactVote, Extent, PairEnergies, PairVote},
    cross_section::{CrossSection, SectionVote},
    element::ElementVote,
    joint::JointVote,
    rigid,
    wall::WallVote,
    work::Work,
};

/// The vote of one cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Vote {
    /// Least true Courant limit of all elements (time), at the positions of the cycle.
    pub courant: f64,
    /// Global index of the element that has it; the lowest of equals.
    pub courant_element: u32,
    /// Least `0.1 / |rate of volume|` (time).
    pub volume_limit: f64,
    /// Least limit from the stiffness of contacts and from transmitting faces (time).
    pub contact_limit: f64,
    /// Greatest speed at which solids close in on a rigid wall that they may strike before the vote takes effect, as a share of their
    /// speed of sound at rest.
    pub strike: f64,
    /// Greatest squared speed of a contact node after integration.
    pub contact_speed_squared: f64,
    /// Greatest speed that a contact node may have when the vote takes effect.
    pub contact_speed_ahead: f64,
    /// Bound on every force term of the cycle.
    pub force_bound: f64,
    /// Deepest contact in gaps.
    pub worst_depth: f64,
    /// Global node index and surface face index of the deepest contact.
    pub worst_pair: (u32, u32),
    /// Node-face pairs tested.
    pub pairs: u64,
    /// Contacts in force.
    pub hits: u64,
    /// Energy stored in contacts.
    pub contact: f64,
    /// Energy lost to friction in this cycle.
    pub friction: f64,
    /// The last two by pair of parts.
    pub contact_energies: PairEnergies,
    /// Work of prescribed velocities, walls and loads in this cycle.
    pub external: Work,
    /// Momentum of all nodes at `t_n`, `m v_n`.
    pub momentum: [f64; 3],
    /// Energies and momentum by part.
    pub parts: Vec<PartVote>,
    /// What nodes gave each wall and support, see [`crate::setup::Setup::n_holders`]; empty if none was touched.
    pub walls: Vec<WallVote>,
    /// States of the rigid bodies after the cycle; the same from every worker.
    pub bodies: Vec<rigid::State>,
    /// What the joints say; the same from every worker.
    pub joints: Vec<JointVote>,
    /// Displacement extents of surface nodes since the sorted positions, by part.
    pub extents: Vec<Extent>,
    /// Position and velocity of gauge nodes at `t_n`: gauge index, then x, y, z, vx, vy, vz.
    pub gauges: Vec<(u32, [f64; 6])>,
    /// State of the elements that are watched: gauge index, and see [`crate::block::Block::reading`].
    pub element_gauges: Vec<(u32, Vec<f64>)>,
    /// Contact between the pairs of parts that are watched: index of the pair, ascending; pairs without force are left out.
    pub contacts: Vec<(u32, PairVote)>,
    /// What passes through cross-sections: index of the section, ascending; those of which no element is here are left out, and all of
    /// them in cycles that need no row.
    pub sections: Vec<(u32, SectionVote)>,
    /// The first element that went wrong, if any: global index and its volume.
    pub fault: Option<(u32, f64)>,
    /// Global indices of the elements that eroded in this cycle, ascending.
    pub eroded: Vec<u32>,
    /// What left the run with them, and with nodes that were dropped.
    pub gone: Gone,
    /// Energies in contacts after the cycle, where its surface ends with it: what the springs on the next one then have less has
    /// left the run. None where the surface stays.
    pub released: Option<PairEnergies>,
}

/// What left the run in a cycle through erosion: exact sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gone {
    /// Internal energy of eroded elements.
    pub internal: f64,
    /// Kinetic energy of freed nodes that were dropped.
    pub kinetic: f64,
    pub momentum: [f64; 3],
}

impl Gone {
    /// Adds what left with others.
    pub fn merge(&mut self, other: &Self) {
        self.internal += other.internal;
        self.kinetic += other.kinetic;
        for a in 0..3 {
            self.momentum[a] += other.momentum[a];
        }
    }
}

/// What of a run is watched beside its energies, because a deck asks for it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Watched {
    /// Global element of each element gauge.
    pub elements: Vec<u32>,
    /// Pairs of parts.
    pub contacts: Vec<[u32; 2]>,
    pub sections: Vec<CrossSection>,
    /// Cycles between two that have a row of the history.
    pub row_cycles: u32,
}

/// Energies and momentum of one part in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartVote {
    /// `sum 1/2 m v_{n-1/2} . v_{n+1/2}`: the kinetic energy at `t_n` that central differences conserve; at the start of a run
    /// `1/2 m v_0^2`.
    pub kinetic: f64,
    /// Internal energy of the elements.
    pub internal: f64,
    /// Hourglass work of this cycle.
    pub hourglass: f64,
    /// Work of artificial viscosity in this cycle (part of `internal`).
    pub viscosity: f64,
    /// Energy that left with eroded elements and dropped nodes in this cycle.
    pub gone: f64,
    /// Momentum of its nodes at `t_n`; parts add up to [`Vote::momentum`].
    pub momentum: [f64; 3],
    /// Work of prescribed velocities, walls and loads in this cycle.
    pub external: Work,
}

impl Vote {
    /// The vote of a worker that holds nothing.
    pub fn empty(n_parts: usize) -> Self {
        Self {
            courant: f64::INFINITY,
            courant_element: u32::MAX,
            volume_limit: f64::INFINITY,
            contact_limit: f64::INFINITY,
            strike: 0.0,
            contact_speed_squared: 0.0,
            contact_speed_ahead: 0.0,
            force_bound: 0.0,
            worst_depth: 0.0,
            worst_pair: (u32::MAX, u32::MAX),
            pairs: 0,
            hits: 0,
            contact: 0.0,
            friction: 0.0,
            contact_energies: PairEnergies::default(),
            external: Work::default(),
            momentum: [0.0; 3],
            parts: vec![PartVote::default(); n_parts],
            walls: Vec::new(),
            bodies: Vec::new(),
            joints: Vec::new(),
            extents: vec![Extent::NONE; n_parts],
            gauges: Vec::new(),
            element_gauges: Vec::new(),
            contacts: Vec::new(),
            sections: Vec::new(),
            fault: None,
            eroded: Vec::new(),
            gone: Gone::default(),
            released: None,
        }
    }

    /// All its energies added up: no sum of energies of the cycle is more, as far as parts of a sum do not cancel (energy).
    pub fn energies(&self) -> f64 {
        let of_work = |work: &Work| work.before.abs() + work.after.abs();
        let of_part = |part: &PartVote| {
            let PartVote { kinetic, internal, hourglass, viscosity, gone, momentum: _, external } = part;
            kinetic.abs()
                + internal.abs()
                + hourglass.abs()
                + viscosity.abs()
                + gone.abs()
                + of_work(external)
        };
        let of_wall = |wall: &WallVote| of_work(&wall.work) + of_work(&wall.loss);
        self.parts.iter().map(of_part).sum::<f64>()
            + self.walls.iter().map(of_wall).sum::<f64>()
            + self.contact.abs()
            + self.friction.abs()
    }

    /// Joins the vote of other elements and nodes of the same cycle; the order of merging is no matter.
    pub fn merge(&mut self, other: &Self) {
        if (other.courant, other.courant_element) < (self.courant, self.courant_element) {
            (self.courant, self.courant_element) = (other.courant, other.courant_element);
        }
        self.volume_limit = self.volume_limit.min(other.volume_limit);
        self.contact_limit = self.contact_limit.min(other.contact_limit);
        self.strike = self.strike.max(other.strike);
        self.contact_speed_squared = self.contact_speed_squared.max(other.contact_speed_squared);
        self.contact_speed_ahead = self.contact_speed_ahead.max(other.contact_speed_ahead);
        self.force_bound = self.force_bound.max(other.force_bound);
        self.deepest(other.worst_depth, other.worst_pair);
        self.pairs += other.pairs;
        self.hits += other.hits;
        self.contact += other.contact;
        self.friction += other.friction;
        self.contact_energies.merge(&other.contact_energies);
        self.external.merge(other.external);
        for axis in 0..3 {
            self.momentum[axis] += other.momentum[axis];
        }
        for (mine, theirs) in self.parts.iter_mut().zip(&other.parts) {
            mine.kinetic += theirs.kinetic;
            mine.internal += theirs.internal;
            mine.hourglass += theirs.hourglass;
            mine.viscosity += theirs.viscosity;
            mine.gone += theirs.gone;
            (0..3).for_each(|axis| mine.momentum[axis] += theirs.momentum[axis]);
            mine.external.merge(theirs.external);
        }
        for (mine, theirs) in self.extents.iter_mut().zip(&other.extents) {
            mine.merge(theirs);
        }
        self.add_walls(&other.walls);
        if self.bodies.is_empty() {
            self.bodies.clone_from(&other.bodies);
            self.joints.clone_from(&other.joints);
        }
        self.gauges.extend_from_slice(&other.gauges);
        self.gauges.sort_by_key(|g| g.0);
        self.element_gauges.extend_from_slice(&other.element_gauges);
        self.element_gauges.sort_by_key(|g| g.0);
        self.add_contacts(&other.contacts);
        self.add_sections(other.sections.iter().copied());
        self.note_fault(other.fault);
        self.add_eroded(&other.eroded);
        self.gone.merge(&other.gone);
        if let Some(released) = &other.released {
            self.released.get_or_insert_default().merge(released);
        }
    }

    /// Joins elements that eroded elsewhere.
    pub fn add_eroded(&mut self, eroded: &[u32]) {
        if !eroded.is_empty() {
            self.eroded.extend_from_slice(eroded);
            self.eroded.sort_unstable();
        }
    }

    /// Joins what the elements of one block of part `part` said.
    pub fn add_elements(&mut self, part: usize, vote: &ElementVote) {
        if (vote.courant, vote.courant_element) < (self.courant, self.courant_element) {
            (self.courant, self.courant_element) = (vote.courant, vote.courant_element);
        }
        self.volume_limit = self.volume_limit.min(vote.volume_limit);
        self.force_bound = self.force_bound.max(vote.force_bound);
        self.parts[part].internal += vote.internal;
        self.parts[part].hourglass += vote.hourglass;
        self.parts[part].viscosity += vote.viscosity;
        self.note_fault(vote.fault.as_ref().map(|f| (f.element, f.volume)));
    }

    /// Joins what the contacts of a worker said.
    pub fn add_contact(&mut self, vote: &ContactVote) {
        self.contact_limit = self.contact_limit.min(vote.dt);
        self.force_bound = self.force_bound.max(vote.force_bound);
        self.deepest(vote.worst_depth, vote.worst_pair);
        self.pairs += vote.pairs;
        self.hits += vote.hits;
        self.contact += vote.energy;
        self.friction += vote.friction;
    }

    /// Joins contacts of the pairs of parts that are watched.
    pub fn add_contacts(&mut self, others: &[(u32, PairVote)]) {
        for (pair, vote) in others {
            match self.contacts.binary_search_by_key(pair, |(pair, _)| *pair) {
                Ok(at) => self.contacts[at].1.merge(vote),
                Err(at) => self.contacts.insert(at, (*pair, *vote)),
            }
        }
    }

    /// Joins what passes through cross-sections elsewhere.
    pub fn add_sections(&mut self, others: impl Iterator<Item = (u32, SectionVote)>) {
        for (section, vote) in others {
            match self.sections.binary_search_by_key(&section, |(section, _)| *section) {
                Ok(at) => self.sections[at].1.merge(&vote),
                Err(at) => self.sections.insert(at, (section, vote)),
            }
        }
    }

    /// Joins what other nodes gave the walls.
    pub fn add_walls(&mut self, walls: &[WallVote]) {
        if walls.iter().all(|wall| *wall == WallVote::default()) {
            return;
        }
        if self.walls.len() < walls.len() {
            self.walls.resize(walls.len(), WallVote::default());
        }
        for (mine, theirs) in self.walls.iter_mut().zip(walls) {
            mine.merge(theirs);
        }
    }

    fn deepest(&mut self, depth: f64, pair: (u32, u32)) {
        if depth > self.worst_depth || (depth == self.worst_depth && pair < self.worst_pair) {
            (self.worst_depth, self.worst_pair) = (depth, pair);
        }
    }

    fn note_fault(&mut self, fault: Option<(u32, f64)>) {
        if let Some(new) = fault
            && self.fault.is_none_or(|old| new.0 < old.0)
        {
            self.fault = Some(new);
        }
    }
}
