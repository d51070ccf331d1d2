//! What the worlds of all seeds must come to.

use mechanics::{digest::digest, state::GlobalState};

use crate::{bits::Fingerprint, solve::Solved};

/// What must be equal to the bit whatever happens: fingerprint, all sums over cycles, and the states that were written.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    fingerprint: Fingerprint,
    /// As a snapshot stores them.
    run_totals: Vec<u8>,
    /// Digest of each, and the bits of what contact keeps of its nodes.
    states: Vec<(String, Vec<u64>)>,
}

impl Seen {
    /// Of a run that came to its end.
    ///
    /// # Panics
    /// If the sums cannot be encoded.
    pub fn of(solved: &Solved) -> Self {
        let mut run_totals = Vec::new();
        protocol::codec::encode_into(&solved.outcome.run_totals, &mut run_totals).expect("sums are numbers");
        let of_state = |state: &GlobalState| {
            let kept = state.contact.iter().flatten().map(|number| (number + 0.0).to_bits()).collect();
            (digest(state), kept)
        };
        let states = solved.states.iter().map(of_state).collect();
        Self { fingerprint: Fingerprint::of(solved), run_totals, states }
    }

    /// Digest of the final state.
    pub fn digest(&self) -> &str {
        &self.fingerprint.digest
    }
}
