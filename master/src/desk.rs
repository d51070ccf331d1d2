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

use deck::{
    Bounds, Fault, MAX_ELEMENTS, Reading,
    model::Model,
    physics::{self, Forecast},
};
use mechanics::initial;
use protocol::options::{self, JobOptions};
use tokio::sync::Semaphore;

use crate::{deck_file::deck_of_study, footprint, http::surface, queue::Size};

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
    /// To its end, at its first time step; none where nothing limits it.
    pub cycles: Option<u64>,
}

impl Brought {
    /// What a job of it is expected to take with these options.
    pub fn size(&self, options: &JobOptions) -> Size {
        let cycles = [self.cycles, options.cycles].into_iter().flatten().min();
        Size { elements: self.elements, cycles: cycles.unwrap_or_default() }
    }
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
    /// It is a study of this deck.
    Study(String),
    /// No run of it can start.
    Start(String),
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
            Self::Study(deck) => write!(
                f,
                "this is a study: `bolide study FILE` in a terminal runs it, with --master by this master; a single run has the deck that it names, {deck}"
            ),
            Self::Start(why) => f.write_str(why),
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

/// What a look at a deck without faults tells.
pub struct Looked {
    pub forecast: Forecast,
    /// What the reader does otherwise than the deck says, a line each.
    pub warnings: Vec<String>,
}

/// Reads a deck when its turn has come. Dropped before that, nothing is read; dropped later, nothing more.
///
/// # Errors
/// Its faults, or why it is not read.
pub async fn read(name: String, text: String) -> Result<Brought, Error> {
    in_turn(name, text, |text, reading| {
        let cycles = physics::forecast(&reading.model).cycles;
        let Model { title, mesh, .. } = reading.model;
        let (parts, elements, nodes) = (mesh.parts.len(), mesh.n_elements() as u64, mesh.n_nodes());
        Brought { text, title, parts, elements, nodes, cycles }
    })
    .await
}

/// Reads a deck likewise, and says what a run of it would take and what in it is hardly meant.
///
/// # Errors
/// As [`read`].
pub async fn look(name: String, text: String) -> Result<Looked, Error> {
    in_turn(name, text, |_, reading| Looked {
        forecast: physics::forecast(&reading.model),
        warnings: reading.warnings.iter().map(ToString::to_string).collect(),
    })
    .await
}

/// Reads a deck likewise, and draws its bodies before the first cycle, as [`surface`] packs them.
///
/// # Errors
/// As [`read`], or why no run of it can start.
pub async fn draw(name: String, text: String) -> Result<Vec<u8>, Error> {
    in_turn(name, text, |_, reading| {
        let model = &reading.model;
        let state = initial::state(&model.mesh, &model.setup, &model.velocity, &model.constraint)?;
        Ok(surface::Skin::new(model).pack(model, &state))
    })
    .await?
    .map_err(Error::Start)
}

async fn in_turn<T: Send + 'static>(
    name: String,
    text: String,
    then: impl FnOnce(String, Reading) -> T + Send + 'static,
) -> Result<T, Error> {
    if name.len() > NAME_LIMIT || name.chars().any(char::is_control) {
        return Err(Error::Name(name.len()));
    }
    if let Some(deck) = deck_of_study(&text) {
        return Err(Error::Study(deck));
    }
    let turn = TURN.acquire().await.map_err(|_| Error::Ending)?;
    let given_up = Arc::new(AtomicBool::new(false));
    let _waits = Waits(Arc::clone(&given_up));
    let work = move || {
        // Until it has been read or given up.
        let _turn = turn;
        read_until(&given_up, &name, &text).map(|reading| then(text, reading))
    };
    let read = tokio::task::spawn_blocking(work).await.map_err(|_| Error::Bug)?;
    read.map_err(Error::Faults)
}

/// Reads a deck as far as nobody gives it up.
fn read_until(given_up: &AtomicBool, name: &str, text: &str) -> Result<Reading, Vec<Fault>> {
    let elements = footprint::most_elements().unwrap_or(MAX_ELEMENTS);
    let is_given_up = || given_up.load(Ordering::Relaxed);
    deck::read_whole_within(text, name, &Bounds { elements, is_given_up: &is_given_up })
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: &str = "title = \"block\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"block\"\n\
        material = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }\n";

    /// At which stages that shows is the reader's matter, and tested there.
    #[tokio::test(flavor = "multi_thread")]
    async fn a_caller_who_goes_gives_its_deck_up_and_holds_up_nobody() {
        let given_up = Arc::new(AtomicBool::new(false));
        let of_block = |given_up: &AtomicBool| read_until(given_up, "block.toml", BLOCK);
        assert_eq!(of_block(&given_up).map(|reading| reading.model.mesh.n_elements()).ok(), Some(8));
        drop(Waits(Arc::clone(&given_up)));
        let faults = of_block(&given_up).expect_err("nobody waits for it");
        assert_eq!(faults[0].read, "a deck that is given up");

        // Its turn comes back, whether its caller stays or goes.
        let gone = read("gone.toml".into(), BLOCK.into());
        let _ = tokio::time::timeout(std::time::Duration::ZERO, gone).await;
        let stays = read("stays.toml".into(), BLOCK.into()).await.expect("a deck");
        assert_eq!(stays.elements, 8);
    }
}
