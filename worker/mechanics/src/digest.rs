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
        update(&mut hasher, vectors.as_flattened());
    }
    for (name, field) in FIELDS.iter().zip(&state.elements) {
        if LAW_FIELDS.contains(name) {
            if field.iter().all(|value| value.to_bits() == 0) {
                continue;
            }
            hasher.update(name.as_bytes());
        }
        update(&mut hasher, field);
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
        update(&mut hasher, &state.strain);
    }
    // A run without shells, elastic hourglass control and history variables has nothing here, and the digest that it had before there
    // were any.
    update(&mut hasher, state.shells.spin.as_flattened());
    state.own.iter().for_each(|array| update(&mut hasher, array));
    state.history.iter().flat_map(|part| &part.columns).for_each(|column| update(&mut hasher, column));
    hasher.finalize().to_hex()[..32].to_owned()
}

/// Numbers of an array from which on threads share it: the least for which BLAKE3 advises it.
const MANY: usize = 1 << 14;

fn update(hasher: &mut blake3::Hasher, values: &[f64]) {
    if cfg!(target_endian = "big") {
        values.iter().for_each(|value| {
            hasher.update(&value.to_le_bytes());
        });
    } else if values.len() < MANY {
        hasher.update(bytemuck::cast_slice(values));
    } else {
        hasher.update_rayon(bytemuck::cast_slice(values));
    }
}
