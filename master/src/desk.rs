//! DESK: decks that callers bring are read here, one at a time, and within this host's memory.
//!
//! A short text can ask for a mesh of any size. So a deck may ask for no more elements than a job of this master could have, and
//! whoever comes while one is read waits; a deck whose caller goes meanwhile is not read, or no further.

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use deck::{Bounds, Fault, MAX_ELEMENTS};
use protocol::options;
use tokio::sync::Semaphore;

use crate::footprint;

/// Longest name of a deck (bytes).
const NAME_LIMIT: usize = 4096;

/// Held while a deck is read.
static TURN: Semaphore = Semaphore::const_new(1);

/// A deck without faults.
pub struct Brought {
    /// The deck itself.
    pub text: String,
    pub title: String,
    pub parts: usize,
    pub elements: u64,
    pub nodes: usize,
}

/// Why a deck is not taken.
#[derive(Debug)]
pub enum Error {
    /// What is asked beside it cannot be.
    Options(options::Error),
    /// Its name is too long, or holds signs that no line of a log can show.
    Name(usize),
    /// It has these faults.
    Faults(Vec<Fault>),
    /// Reading it had a bug.
    Bug,
    /// The master is ending.
    Ending,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Options(error) => error.fmt(f),
            Self::Name(length) => {
                write!(
                    f,
                    "the deck's name has {length} bytes, at most {NAME_LIMIT} without control characters"
                )
            }
            Self::Faults(faults) => {
                let faults: Vec<String> = faults.iter().map(Fault::to_string).collect();
                f.write_str(&faults.join("\n"))
            }
            Self::Bug => f.write_str("a bug in the master; its log has the words"),
            Self::Ending => f.write_str("the master is ending"),
        }
    }
}

/// Says when it is dropped that nobody waits for a deck any more.
struct Waits(Arc<AtomicBool>);

impl Drop for Waits {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Reads a deck when its turn has come. Dropped before that, nothing is read; dropped later, nothing more.
///
/// # Errors
/// Its faults, or why it is not read.
pub async fn read(name: String, text: String) -> Result<Brought, Error> {
    if name.len() > NAME_LIMIT || name.chars().any(char::is_control) {
        return Err(Error::Name(name.len()));
    }
    let turn = TURN.acquire().await.map_err(|_| Error::Ending)?;
    let given_up = Arc::new(AtomicBool::new(false));
    let _waits = Waits(Arc::clone(&given_up));
    let work = move || {
        // Until it has been read or given up.
        let _turn = turn;
        let elements = footprint::most_elements().unwrap_or(MAX_ELEMENTS);
        let is_given_up = || given_up.load(Ordering::Relaxed);
        let model = deck::read_within(&text, &name, &Bounds { elements, is_given_up: &is_given_up })?;
        let (parts, elements, nodes) =
            (model.mesh.parts.len(), model.mesh.n_elements() as u64, model.mesh.n_nodes());
        Ok(Brought { text, title: model.title, parts, elements, nodes })
    };
    let read = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Bug)?;
    read.map_err(Error::Faults)
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    /// So many blocks of 8,000 elements.
    fn blocks(n: usize) -> String {
        let mut text = String::from("title = \"blocks\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n");
        for part in 0..n {
            text += &format!(
                "[[part]]\nname = \"block {part}\"\nmaterial = \"LEAD\"\nbox = {{ origin = [0, 0, {}], size = [1, 1, 1], cells = [20, 20, 20] }}\n",
                2 * part
            );
        }
        text
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_deck_that_is_being_read_holds_up_nobody_once_its_caller_has_gone() {
        let started = Instant::now();
        let whole = read("large.toml".into(), blocks(150)).await.expect("a deck");
        let takes = started.elapsed();
        assert_eq!(whole.elements, 1_200_000);
        let gone = tokio::time::timeout(takes / 20, read("large.toml".into(), blocks(150))).await;
        assert!(gone.is_err(), "its caller has gone, and it is being read");
        let started = Instant::now();
        let small = read("small.toml".into(), blocks(1)).await.expect("a deck");
        let waited = started.elapsed();
        assert_eq!(small.elements, 8_000);
        assert!(
            waited < takes / 2 + Duration::from_millis(50),
            "waited {waited:?}, the large one takes {takes:?}"
        );
    }
}
