//! Digest: one hash of the final state, in canonical order, so that equal bits give equal text.

use crate::state::GlobalState;

/// BLAKE3 over cycle, time, positions, velocities (by global node index) and element fields (field by field, by global
/// element index), each number as its eight little-endian bytes; the first 32 hexadecimal digits.
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
    for field in &state.elements {
        for value in field {
            hasher.update(&value.to_le_bytes());
        }
    }
    hasher.finalize().to_hex()[..32].to_owned()
}
