//! What a run was and how well it went: `summary.json`, and the same for a person to read.
//!
//! Units and formulas of every field are stated in the deck reference.

use std::{io::Write as _, path::Path};

use serde::{Deserialize, Serialize};

mod table;

pub use table::significant;

use super::{Error, Folder, SUMMARY, write_whole};
use crate::{
    incident::{Loss, Rebalance},
    machine,
    quality::Quality,
};

/// A finished run. Shares and relative quantities are fractions of one. All numbers are finite: JSON has no
/// others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Title of the deck.
    pub title: String,
    /// Elements of all parts.
    pub elements: u64,
    /// Nodes after joins.
    pub nodes: u64,
    /// Elements with at least one surface face.
    pub surface_elements: u64,
    pub surface_faces: u64,
    /// Nodes of surface faces.
    pub surface_nodes: u64,
    /// Workers at the end of the run.
    pub workers: u32,
    /// Compute threads of all workers together.
    pub threads: u32,
    /// Route of the exchange: `master` or `direct`.
    pub route: String,
    /// Pairs of workers that exchanged over a link of their own; 0 on route master.
    pub linked_pairs: u64,
    /// Pairs of workers that the master relayed for, because they could not reach each other or their link broke.
    pub relayed_pairs: u64,
    /// Lane width of the workers: `scalar`, `neon`, `avx2` or `avx512`; joined by `+` where they differ.
    pub lanes: String,
    /// Cycles completed.
    pub cycles: u64,
    /// Time reached (time).
    pub end_time: f64,
    /// Wall-clock time of the cycles (s).
    pub wall_s: f64,
    /// Thread-CPU time per element and cycle (ns), contact and sorts included.
    pub grind_ns: f64,
    /// Share of `grind_ns` in contact and sorts.
    pub contact_share: f64,
    /// Share of a cycle of one thread that is done by one thread however many there are; known of one worker in this process.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub serial_share: Option<f64>,
    /// Sorts that took effect.
    pub sorts: u64,
    /// Contact work units of the sort in force in the last cycle.
    pub work_units: WorkUnits,
    /// Largest over mean of cost over speed by worker; 1 is perfect.
    pub imbalance: f64,
    /// Bytes on all links over cycles.
    pub bytes_per_cycle: f64,
    /// Of these, bytes on the links of the master.
    pub master_bytes_per_cycle: f64,
    /// How the time of each worker went.
    pub worker_times: Vec<WorkerTimes>,
    /// Energies at the end.
    pub energies: Energies,
    /// Elements that have eroded.
    pub eroded_elements: u64,
    /// Their mass, which stays at the nodes as long as those do.
    pub eroded_mass: f64,
    /// Energy that left with them, with nodes that were dropped, and with springs of contact on surfaces that have ended.
    pub eroded_energy: f64,
    /// Ties that have let go, of those that can break; none where none can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub broken_ties: Option<u64>,
    /// Change of momentum over the largest initial momentum of a part; 0 if all were at rest.
    pub momentum_error: f64,
    /// Largest time step over the true Courant limit; below 1 is stable.
    pub worst_courant: f64,
    /// Largest travel of a contact node in one cycle (gaps); at most 0.2 is asked for.
    pub worst_gap_travel: f64,
    /// Deepest penetration (gaps).
    pub worst_penetration: f64,
    /// When work was dealt out by other speeds, with `--balance measured`.
    pub rebalances: Vec<Rebalance>,
    /// Workers that were lost, and how far the run went back for them.
    pub losses: Vec<Loss>,
    /// What makes the results doubtful, and what to do about it.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Gauges whose last element has eroded.
    #[serde(default)]
    pub dead_gauges: Vec<DeadGauge>,
    /// How far the numbers can be trusted.
    #[serde(default)]
    pub quality: Quality,
    /// Planes of symmetry through the origin, by the axis across them.
    #[serde(default)]
    pub mirrors: [bool; 3],
    /// Name of the deck's units.
    #[serde(default)]
    pub units: String,
    /// Which program computed it from which deck, when and where.
    #[serde(default)]
    pub origin: Origin,
    /// Hash of the final state (hexadecimal).
    pub digest: String,
    /// What it was computed from; none where no folder was written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<Input>,
}

/// Where results come from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Release of the program.
    pub version: String,
    /// When the run ended, UTC.
    pub date: String,
    /// File of the deck, as it was given.
    pub deck: String,
    /// The machine of the master, or of a run without one.
    pub machine: String,
}

impl Origin {
    /// Of a run of this deck that has just ended here.
    pub fn of(deck: &str) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            date: machine::now(),
            deck: deck.replace(char::is_control, " "),
            machine: machine::words(),
        }
    }
}

/// What a run was computed from, so that it can be computed again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// BLAKE3 of `input.deck` (hexadecimal).
    pub deck: String,
    /// The end that was asked for beside the deck (time).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_time: Option<f64>,
}

/// Wall-clock time of a worker since its first cycle, by what it did (s).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkerTimes {
    /// Name of the host.
    pub name: String,
    /// Elements that touch nodes of the exchange, and packing partial forces.
    pub border_s: f64,
    /// Contact, and the installation of plans.
    pub contact_s: f64,
    /// All other elements; at a plan boundary all elements.
    pub interior_s: f64,
    /// Packing messages and queueing them; links send beside the computation.
    pub send_s: f64,
    /// Without a task: frames of others or orders were awaited.
    pub wait_s: f64,
    /// Integration of all nodes, and the vote.
    pub integrate_s: f64,
    /// States and transfers.
    pub other_s: f64,
    /// Bytes that it sent to other workers over links of its own.
    pub peer_bytes: u64,
}

/// Sizes of contact work units. Zero without contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkUnits {
    /// Units that hold at least one interaction.
    pub count: u64,
    /// Fewest nodes of a unit.
    pub nodes_min: u64,
    /// Mean nodes of a unit.
    pub nodes_mean: f64,
    /// Most nodes of a unit.
    pub nodes_max: u64,
    /// Fewest faces of a unit.
    pub faces_min: u64,
    /// Mean faces of a unit.
    pub faces_mean: f64,
    /// Most faces of a unit.
    pub faces_max: u64,
    /// Node-face interactions of all units.
    pub interactions: u64,
}

/// Energies of one part in the deck's unit of energy, sums over the run but for kinetic and internal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedPart {
    /// Its name in the deck.
    pub name: String,
    /// Its mass at the start; a node that parts share counts with the first of them, a rigid body with its first part.
    #[serde(default)]
    pub mass: f64,
    /// Its momentum at the end.
    #[serde(default)]
    pub momentum: [f64; 3],
    pub kinetic: f64,
    pub internal: f64,
    /// Energy taken by hourglass forces.
    pub hourglass: f64,
    /// Part of `internal` that artificial viscosity put in.
    pub viscosity: f64,
    /// Work done on it from outside.
    pub external: f64,
    /// Elements of it that have eroded.
    #[serde(default)]
    pub eroded_elements: u64,
    /// Energy that left it with them, and with nodes that were dropped.
    #[serde(default)]
    pub eroded_energy: f64,
}

impl NamedPart {
    /// Its internal energy with what has eroded of it: what its hourglass and viscous work went into.
    pub fn internal_of_all(&self) -> f64 {
        self.internal.max(0.0) + self.eroded_energy.max(0.0)
    }
}

/// A gauge that has lost its last element: rows after this one are no signal of the body.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DeadGauge {
    /// Its name in the deck.
    pub name: String,
    /// The cycle at whose start that left.
    pub cycle: u64,
    /// When that was (time).
    pub time: f64,
}

/// A body: parts that share nodes or have touched, and nothing else has touched them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedBody {
    pub parts: Vec<String>,
    /// Energy that appeared or vanished in it.
    pub gain: f64,
    /// That over the greatest of what it had first, of its kinetic energies, and of the work done on it.
    pub error: f64,
}

/// Energies of the contact of two parts in the deck's unit of energy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedPair {
    /// Their names; twice the same for a part that meets itself.
    pub parts: [String; 2],
    /// Energy held by springs and taken by friction.
    pub contact: f64,
    /// Part of `contact` that friction took.
    pub friction: f64,
    /// What springs lost where the surface changed by erosion; part of the eroded energy.
    #[serde(default)]
    pub eroded: f64,
}

/// Energies of the whole problem in the deck's unit of energy; `error` is relative.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    pub kinetic: f64,
    pub internal: f64,
    /// Energy taken by hourglass forces.
    pub hourglass: f64,
    /// Part of `internal` that artificial viscosity put in.
    pub viscosity: f64,
    /// Energy held by contact springs and taken by friction.
    pub contact: f64,
    /// Part of `contact` that friction took.
    pub friction: f64,
    /// Energy lost at rigid walls: by nodes that strike them, and by friction.
    #[serde(default)]
    pub wall_loss: f64,
    /// Work done on the bodies from outside.
    pub external: f64,
    /// Energy error: what appeared or vanished, relative.
    pub error: f64,
    /// The body whose own energy error is greatest, where there are several.
    #[serde(default)]
    pub worst_body: Option<NamedBody>,
    /// By part, in deck order.
    pub parts: Vec<NamedPart>,
    /// By pair of parts that touched, in deck order.
    pub contacts: Vec<NamedPair>,
}

impl Summary {
    /// Reads the `summary.json` of a results folder; a run that has not ended has none.
    ///
    /// # Errors
    /// The file and what is wrong with it.
    pub fn read(folder: &Path) -> Result<Self, String> {
        let path = folder.join(SUMMARY);
        let text = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        serde_json::from_slice(&text).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Writes `summary.json` into the results folder.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, folder: &Folder) -> Result<(), Error> {
        write_whole(&folder.file(SUMMARY), |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            out.write_all(b"\n")
        })
    }
}
