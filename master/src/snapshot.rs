//! Snapshots on disk: the whole run at the start of a cycle, with a checksum.

use std::{fs, io::Write, path::Path};

use mechanics::{exact::Quantum, state::GlobalState, vote::Vote, wall::Pose};
use serde::{Deserialize, Serialize};

use crate::{ledger::Ledger, results::history::HistoryRow};

/// All that a run needs to go on with the same bits, on any workers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// State at the start of a cycle.
    pub state: GlobalState,
    /// `dt` of the cycle before (time).
    pub dt_previous: f64,
    /// `dt` of the cycle to come (time).
    pub dt: f64,
    /// Quantum of forces in the cycle to come, and from the one after it on.
    pub force_quanta: [Quantum; 2],
    /// Rate at which bodies moved against each other (length per cycle), for the sorts to come.
    pub spread_rate: f64,
    /// The whole vote of the cycle before, still to take effect.
    pub vote: Vote,
    /// Poses of the walls of finite mass in the cycle to come.
    pub walls: Vec<Pose>,
    /// Energies and worst ratios so far.
    pub ledger: Ledger,
    /// Rows of history so far.
    pub rows: Vec<HistoryRow>,
}

/// First bytes of a snapshot file.
const MAGIC: &[u8; 8] = b"BLDSNAP3";

/// Writes a snapshot: temporary file, checksum, fsync, rename.
///
/// # Errors
/// What the disk refused, with the path.
pub fn write(path: &Path, snapshot: &Snapshot) -> Result<(), String> {
    let fault = |e: &dyn std::fmt::Display| format!("snapshot {}: {e}", path.display());
    let body = protocol::codec::encode(snapshot).map_err(|e| fault(&e))?;
    let temporary = path.with_extension("tmp");
    let mut file = fs::File::create(&temporary).map_err(|e| fault(&e))?;
    let write = |file: &mut fs::File| {
        file.write_all(MAGIC)?;
        file.write_all(blake3::hash(&body).as_bytes())?;
        file.write_all(&body)?;
        file.sync_all()
    };
    write(&mut file).map_err(|e| fault(&e))?;
    fs::rename(&temporary, path).map_err(|e| fault(&e))
}

/// Reads a snapshot and checks it.
///
/// # Errors
/// If the file cannot be read, is not a snapshot, or its checksum does not match.
pub fn read(path: &Path) -> Result<Snapshot, String> {
    let fault = |e: &dyn std::fmt::Display| format!("snapshot {}: {e}", path.display());
    let bytes = fs::read(path).map_err(|e| fault(&e))?;
    let header = MAGIC.len() + blake3::OUT_LEN;
    if bytes.len() < header || &bytes[..MAGIC.len()] != MAGIC {
        return Err(fault(&"not a snapshot of this version"));
    }
    let (sum, body) = (&bytes[MAGIC.len()..header], &bytes[header..]);
    if blake3::hash(body).as_bytes() != sum {
        return Err(fault(&"checksum does not match: the file is torn; use an older one"));
    }
    protocol::codec::decode(body, body.len()).map_err(|e| fault(&e))
}
