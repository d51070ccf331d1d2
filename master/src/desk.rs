//! DESK: decks that callers bring are read here, one at a time, and within this host's memory.
//!
//! A short text can ask for a mesh of any size. So a deck may ask for no more elements than a job of this master could have, and
//! whoever comes while one is read waits; a caller that goes meanwhile has its deck read by nobody.

use std::fmt;

use deck::{Fault, MAX_ELEMENTS};
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

/// Reads a deck when its turn has come. Dropped before that, nothing is read.
///
/// # Errors
/// Its faults, or why it is not read.
pub async fn read(name: String, text: String) -> Result<Brought, Error> {
    if name.len() > NAME_LIMIT || name.chars().any(char::is_control) {
        return Err(Error::Name(name.len()));
    }
    let turn = TURN.acquire().await.map_err(|_| Error::Ending)?;
    let work = move || {
        // Until it has been read, however long its caller stays.
        let _turn = turn;
        let most = footprint::most_elements().unwrap_or(MAX_ELEMENTS);
        let model = deck::read_at_most(&text, &name, most)?;
        let (parts, elements, nodes) =
            (model.mesh.parts.len(), model.mesh.n_elements() as u64, model.mesh.n_nodes());
        Ok(Brought { text, title: model.title, parts, elements, nodes })
    };
    let read = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Bug)?;
    read.map_err(Error::Faults)
}
