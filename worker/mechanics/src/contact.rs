//! The words of contact, and the order of its stages; nothing is computed here.
//!
//! A *surface* is the outer faces of the elements that are alive, and their nodes ([`surface`]). Every so
//! often the surface is *sorted* into *work units* ([`mod@sort`], [`work_unit`]): virtual cubes of which each
//! holds the nodes inside it and every face those may meet before the next sort. When that next sort is due
//! is a rule on displacements ([`reach`]). A worker gets a *batch* of units and each cycle
//! ([`cycle`]):
//! 1. takes the pairs that can meet before the next sort ([`search`], once per batch);
//! 2. drops those whose boxes are apart ([`search`]), most of them for several cycles at once;
//! 3. finds the closest point of each face to its node: the contact detection zone ([`zone`]), many nodes at a time
//!    (`slots`);
//! 4. reduces the hits of a node to distinct closest features with a side ([`joint`]);
//! 5. turns each hit into forces, a time-step vote and energies ([`force`]).
//!
//! That is a node against a face. Two edges that cross while no node is in a zone are not seen so; where the deck has them meet
//! too, they are a kind of pairs of their own ([`edges`]), and so are nodes that are tied to faces (`ties`) and particles that press on each other ([`particles`]). What a kind does for the sort, the batch and the cycle is said in `pair`;
//! `kinds` lists them.
//!
//! Search, geometry (zone and joint) and force know nothing of each other; only `node_face` knows all three.

use serde::{Deserialize, Serialize};

mod batch;
mod bond;
mod boxes;
pub mod cycle;
pub mod edges;
pub mod force;
mod history;
mod initial_pairs;
pub mod joint;
mod kinds;
pub mod map;
mod near_pairs;
mod node_face;
mod pair;
mod pair_energy;
pub mod particles;
pub mod patch;
pub mod reach;
pub mod search;
mod share;
mod slots;
pub mod sort;
pub mod surface;
mod tally;
mod ties;
mod tying;
mod watch;
pub mod work_unit;
pub mod zone;

pub use batch::{Batch, BatchFace, BatchNode, BatchUnit, Listed};
pub use bond::{Bond, Limit, strengthen};
pub use cycle::Contact;
pub use edges::{BatchEdge, BatchEdges, Edge, initial_edges};
pub use force::ContactVote;
pub use history::History;
pub use initial_pairs::{ROUNDING, initial_pairs};
pub use kinds::sort;
pub use map::Map;
pub use pair::Kind;
pub use pair_energy::{PairEnergies, PairEnergy};
pub use particles::{BatchParticle, BatchParticles, Particle};
pub use patch::{PartBox, Patch, PatchSort, PlacedPatch};
pub use reach::Extent;
pub use search::{Exclusions, cull};
pub(crate) use share::{Cut, Share};
pub use surface::{Exposed, Face, Surface};
pub use tally::PairVote;
pub use ties::{BatchTies, Tie};
pub use tying::{OnFace, on_faces, tie};
pub use work_unit::{Census, WorkUnit};

/// Distance, in gaps, within which a pair votes on the time step although only those within one gap push.
///
/// Votes take effect some cycles late, and a node crosses at most a fifth of the gap in one: from here it
/// needs five cycles to its first push.
pub const WARNING: f64 = 2.0;

/// Contact settings of a run. By default nothing meets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// By part, the initial time step of the elements that may meet at its faces (time, [`crate::initial::closing_steps`]): springs are at
    /// least as stiff as it allows. Empty for springs by moduli alone.
    pub steps: Vec<f64>,
    /// Coefficient of fast sliding by pair of parts, like `friction`; empty where it is that at rest.
    pub friction_kinetic: Vec<f64>,
    /// How fast the coefficient falls from rest to that of fast sliding, with the sliding velocity (time per length).
    pub friction_decay: f64,
    /// Whether nodes stick to faces, by springs with a slip limit; edges do not.
    pub sticks: bool,
    /// Velocity over which friction is regularised where nothing sticks (length per time): below it the force is
    /// proportional to the sliding velocity, so bodies creep.
    pub friction_velocity: f64,
    /// Nodes that start inside the zone of another part never meet the faces there; without it such a start is refused.
    pub ignores_initial: bool,
    /// Whether edges meet edges ([`edges`]).
    pub edges: bool,
    /// Nodes tied to faces, by node.
    pub ties: Vec<Tie>,
    /// Whether any of them can break.
    pub ties_break: bool,
    /// Whether any part erodes, so that faces come out with nodes in their zone.
    pub erodes: bool,
    /// By part, whether its nodes that have lost all their elements press on each other ([`particles`]). Empty where none do.
    pub particles: Vec<bool>,
}

impl Settings {
    /// Number of parts: the side of the matrices.
    pub fn n_parts(&self) -> usize {
        self.interacts.len().isqrt()
    }

    /// Whether nodes of part `a` interact with faces of part `b`.
    #[inline(always)]
    pub fn permits(&self, a: u32, b: u32) -> bool {
        self.interacts[a as usize * self.n_parts() + b as usize]
    }

    /// Whether how far nodes of two parts move against each other says when lists are stale: something of them may meet.
    pub(crate) fn meets(&self, a: u32, b: u32) -> bool {
        self.permits(a, b) || (a == b && self.particles.get(a as usize) == Some(&true))
    }

    /// Stiffness of a side of a part by its mass ([`force::least`]).
    pub(crate) fn least(&self, part: u32, mass: f64) -> f64 {
        self.steps.get(part as usize).map_or(0.0, |&step| force::least(mass, step))
    }

    /// The pair of parts that may meet, if there is only one.
    pub fn only_pair(&self) -> Option<[u32; 2]> {
        let n = self.n_parts();
        let mut pairs = (0..n * n).filter(|&i| self.interacts[i] && i / n <= i % n);
        let pair = pairs.next().map(|i| [(i / n) as u32, (i % n) as u32]);
        pair.filter(|_| pairs.next().is_none())
    }

    /// Cycles between trigger and sort after which nodes cannot have left the slack at the speeds that votes allow, where
    /// orders answer a vote two cycles later; 0 if one is too many.
    pub fn longest_lag(&self) -> u32 {
        ((self.slack / reach::lag_travel(self, 1) * (1.0 + 1e-9)) as u32).saturating_sub(2)
    }

    /// How near a pair is that a cycle looks at (length): the zone of warning and the spread of a worker's list between
    /// sorts, but no more than the reach.
    pub fn near(&self) -> f64 {
        WARNING.mul_add(self.gap, self.slack.min(watch::SPREAD * self.gap))
    }

    /// Reach of the sort (length): the zone of warning plus the slack.
    ///
    /// The paper's proximity test is the size of the detection zone plus the slack. Pairs between one gap and
    /// [`WARNING`] gaps vote on the time step, so they must be on the lists as surely as those that push:
    /// else the vote, and with it every bit, would depend on the cycle of the last sort.
    pub fn reach(&self) -> f64 {
        WARNING.mul_add(self.gap, self.slack)
    }
}
