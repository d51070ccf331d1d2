//! Whether what a worker sends are numbers, and of parts that there are.

use mechanics::vote::{self, Vote};

/// What of a worker's frame is no number, or of a part beyond `n_parts`.
pub(super) fn not_a_number(vote: Option<&Vote>, partials: &[f64], n_parts: usize) -> Option<String> {
    vote.and_then(|vote| vote::not_a_number(vote, n_parts)).or_else(|| {
        let bad = partials.iter().find(|value| !value.is_finite());
        bad.map(|value| format!("a partial force of its frame is {value}, must be finite"))
    })
}
