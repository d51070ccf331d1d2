//! Force transducers: pairs of parts whose contact the history holds.

use super::{
    super::{draft::quoted, log::Place},
    Translation,
};
use crate::limits::MAX_CONTACT_FORCES;

impl Translation<'_> {
    /// The pairs of all transducers, each once, in the words of a TOML deck, and where the first transducer stands.
    pub(super) fn watched(&self) -> Option<(Place, String)> {
        let (problem, log) = (self.problem, self.log);
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for card in &problem.transducers {
            let own = card.watched(&self.met, problem, log);
            if own.is_empty() {
                log.warn(
                    card.at,
                    "a force transducer of parts that meet no other: there is nothing to write",
                );
            }
            for [a, b] in own {
                if !pairs.contains(&[a, b]) && !pairs.contains(&[b, a]) {
                    pairs.push([a, b]);
                }
            }
        }
        let at = problem.transducers.first().map(|card| card.at).filter(|_| !pairs.is_empty())?;
        if pairs.len() > MAX_CONTACT_FORCES {
            log.warn(
                at,
                format!(
                    "force transducers of {} pairs of parts: the first {MAX_CONTACT_FORCES} are written",
                    pairs.len()
                ),
            );
            pairs.truncate(MAX_CONTACT_FORCES);
        }
        let words: Vec<String> = pairs
            .iter()
            .map(|pair| {
                let [a, b] = pair.map(|id| quoted(&self.names[&id]));
                format!("[{a}, {b}]")
            })
            .collect();
        Some((at, words.join(", ")))
    }
}
