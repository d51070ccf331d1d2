//! The form of a snapshot on disk: chunks, each behind its checksum.
//!
//! Magic, length of the body, cycle, then for each [`CHUNK`] of the body its BLAKE3 sum and its bytes, then the sum of
//! header and sums. A file that was cut short or has a flipped bit is refused by the chunk where it is wrong.

use std::{
    fs::File,
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

use tracing::trace;

use super::Snapshot;
use crate::disk::sync_folder;

/// First bytes of a snapshot file: the form of the file and of what is in it.
const MAGIC: &[u8; 8] = b"BLDSNAPE";
/// Bytes that one checksum covers.
pub const CHUNK: usize = 1 << 20;
/// Magic, length, cycle.
const HEADER: usize = 24;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Length of the file (bytes).
    pub bytes: u64,
    /// Sum of header and sums, the file's last bytes.
    pub sum: blake3::Hash,
}

/// Writes a snapshot: temporary file, checksums, fsync, rename, fsync of the folder. A file of that name stays whole until
/// the new one is.
///
/// # Errors
/// What the disk refused, with the path; the temporary file is then removed.
pub fn write(path: &Path, snapshot: &Snapshot) -> Result<Written, String> {
    let fault = |e: &dyn std::fmt::Display| format!("snapshot {}: {e}", path.display());
    let body = protocol::codec::encode(snapshot).map_err(|e| fault(&e))?;
    let temporary = temporary_of(path);
    let written = stream(&temporary, &body, snapshot.state.cycle);
    drop(body);
    let written = written.and_then(|written| {
        std::fs::rename(&temporary, path)?;
        sync_folder(path)?;
        Ok(written)
    });
    written.map_err(|error| {
        // The first error is the one to report; a file that stays is removed by the next write to this name.
        let _ = std::fs::remove_file(&temporary);
        fault(&error)
    })
}

/// The name under which a file is written before it has its own.
pub(super) fn temporary_of(path: &Path) -> PathBuf {
    path.with_extension("tmp")
}

fn stream(path: &Path, body: &[u8], cycle: u64) -> io::Result<Written> {
    let mut file = File::create(path)?;
    let mut header = Vec::with_capacity(HEADER);
    header.extend_from_slice(MAGIC);
    header.extend_from_slice(&(body.len() as u64).to_le_bytes());
    header.extend_from_slice(&cycle.to_le_bytes());
    let mut sums = blake3::Hasher::new();
    sums.update(&header);
    file.write_all(&header)?;
    for (number, chunk) in body.chunks(CHUNK).enumerate() {
        let sum = blake3::hash(chunk);
        sums.update(sum.as_bytes());
        file.write_all(sum.as_bytes())?;
        file.write_all(chunk)?;
        if number == 0 {
            trace!(cycle, "first chunk of a snapshot written");
        }
    }
    let sum = sums.finalize();
    file.write_all(sum.as_bytes())?;
    file.sync_all()?;
    let sums = (body.len().div_ceil(CHUNK) + 1) * blake3::OUT_LEN;
    Ok(Written { bytes: (HEADER + body.len() + sums) as u64, sum })
}

/// Reads a snapshot and checks it.
///
/// # Errors
/// If the file cannot be read, is no snapshot of this version, was cut short, or a checksum does not match.
pub fn read(path: &Path) -> Result<Snapshot, String> {
    read_checked(path).map(|(snapshot, _)| snapshot)
}

/// [`read`], with what the file was written as.
///
/// # Errors
/// As for [`read`].
pub fn read_checked(path: &Path) -> Result<(Snapshot, Written), String> {
    let fault = |e: &dyn std::fmt::Display| format!("snapshot {}: {e}", path.display());
    let mut file = File::open(path).map_err(|e| fault(&e))?;
    let length = file.metadata().map_err(|e| fault(&e))?.len();
    let mut header = [0; HEADER];
    file.read_exact(&mut header).map_err(|_| fault(&"not a snapshot of this version"))?;
    if !header.starts_with(MAGIC) {
        return Err(fault(&"not a snapshot of this version"));
    }
    let number = |at: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&header[at..at + 8]);
        u64::from_le_bytes(bytes)
    };
    let (stated, cycle) = (number(8), number(16));
    // What the header says is believed only as far as the file is long.
    let sums = stated.div_ceil(CHUNK as u64).saturating_add(1).saturating_mul(blake3::OUT_LEN as u64);
    let expected = stated.saturating_add(sums).saturating_add(HEADER as u64);
    if length != expected {
        return Err(fault(&format_args!(
            "torn: {length} bytes, its header says {expected}; an older one is needed"
        )));
    }
    let mut body = vec![0; stated as usize];
    let mut sums = blake3::Hasher::new();
    sums.update(&header);
    let mut sum = [0; blake3::OUT_LEN];
    for (index, chunk) in body.chunks_mut(CHUNK).enumerate() {
        file.read_exact(&mut sum).and_then(|()| file.read_exact(chunk)).map_err(|e| fault(&e))?;
        if blake3::hash(chunk) != blake3::Hash::from_bytes(sum) {
            let (from, to) = (index * CHUNK, index * CHUNK + chunk.len());
            return Err(fault(&format_args!(
                "bytes {from} to {to} of its body do not match their checksum; an older one is needed"
            )));
        }
        sums.update(&sum);
    }
    file.read_exact(&mut sum).map_err(|e| fault(&e))?;
    if sums.finalize() != blake3::Hash::from_bytes(sum) {
        return Err(fault(&"the sum of its checksums does not match; an older one is needed"));
    }
    let snapshot: Snapshot = protocol::codec::decode(&body, body.len()).map_err(|e| fault(&e))?;
    if snapshot.state.cycle != cycle {
        let found = snapshot.state.cycle;
        return Err(fault(&format_args!("state of cycle {found}, its header says {cycle}")));
    }
    Ok((snapshot, Written { bytes: length, sum: blake3::Hash::from_bytes(sum) }))
}
