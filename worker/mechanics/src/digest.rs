//! Digest: one hash of the final state, in canonical order, so that equal bits give equal text.

use crate::state::{FIELDS, GlobalState};

/// Fields that only some laws use. Where they are zero everywhere they leave no trace in the digest, so that a run
/// without such a law has the digest that it had before the law was there.
const LAW_FIELDS: [&str; 3] = ["damage", "time_to_light", "viscosity"];

/// BLAKE3 over cycle, time, positions, velocities (by global node index) and element fields (field by field, by global
/// element index; `LAW_FIELDS` after their names, if anything is in them), each number as its eight little-endian
/// bytes; the first 32 hexadecimal digits.
pub fn digest(state: &GlobalState) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&state.cycle.to_le_bytes());
    hasher.update(&state.time.to_le_bytes());
    for vectors in [&state.x, &state.v] {
        for vector in vectors {
            for component in vector {
                hasher.update(&component.to_le_bytes());
            }
        }
    }
    for (name, field) in FIELDS.iter().zip(&state.elements) {
        if LAW_FIELDS.contains(name) {
            if field.iter().all(|value| value.to_bits() == 0) {
                continue;
            }
            hasher.update(name.as_bytes());
        }
        for value in field {
            hasher.update(&value.to_le_bytes());
        }
    }
    // Likewise erosion: a run in which nothing eroded has the digest of one in which nothing could.
    if state.n_eroded() > 0 {
        hasher.update(b"eroded");
        for cycle in &state.eroded {
            hasher.update(&cycle.to_le_bytes());
        }
    }
    if state.strain.iter().any(|strain| *strain != 0.0) {
        hasher.update(b"strain");
        for strain in &state.strain {
            hasher.update(&strain.to_le_bytes());
        }
    }
    // A run without shells, elastic hourglass control and history variables has nothing here, and the digest that it had before there
    // were any.
    for spin in state.shells.spin.iter().flatten() {
        hasher.update(&spin.to_le_bytes());
    }
    for value in state.own.iter().flatten() {
        hasher.update(&value.to_le_bytes());
    }
    for value in state.history.iter().flat_map(|part| &part.columns).flatten() {
        hasher.update(&value.to_le_bytes());
    }
    hasher.finalize().to_hex()[..32].to_owned()
}
