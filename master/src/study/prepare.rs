//! Points made ready to run: their decks read and checked, with their identities.

use deck::{Fault, Model, bundle, physics};

use super::{
    cache::{self, identity_of},
    measure::Facts,
    plan::{Point, Study},
};
use crate::{deck_file, reading::ReadingArgs, results::history, shell::quoted};

/// A point whose deck is without fault.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The deck with all its files and with the values of its parameters: what a run or a master reads.
    pub text: String,
    /// Name of the deck's file, for messages.
    pub name: String,
    pub identity: String,
    pub title: String,
    pub elements: u64,
    pub facts: Facts,
    /// What is hardly meant by it, as `bolide check` says it.
    pub warnings: Vec<String>,
}

impl Prepared {
    /// Reads the model once more: it is not held while the point waits.
    ///
    /// # Errors
    /// The faults that it did not have before.
    pub fn model(&self) -> Result<Model, String> {
        deck::read(&self.text, &self.name).map_err(|faults| words(&faults))
    }
}

fn words(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// Why a point cannot run.
#[derive(Debug)]
pub enum Error {
    /// The deck cannot be opened.
    Deck(deck_file::Error),
    /// Its faults at this point.
    Faults(Vec<Fault>),
    /// It has no identity.
    Identity(cache::Error),
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Deck(why) => why.fmt(f),
            Self::Faults(faults) => f.write_str(&words(faults)),
            Self::Identity(why) => why.fmt(f),
        }
    }
}

impl std::error::Error for Error {}

/// Reads and checks the deck of a point.
///
/// # Errors
/// Its faults.
pub fn prepare(study: &Study, point: &Point) -> Result<Prepared, Error> {
    let text = deck_file::gather_deck(&study.deck, &study.options_at(point)).map_err(Error::Deck)?;
    let name = study.deck.display().to_string();
    let reading = deck::read_whole(&text, &name).map_err(Error::Faults)?;
    let model = reading.model;
    let of_reader = reading.warnings.iter().map(ToString::to_string);
    Ok(Prepared {
        warnings: of_reader.chain(physics::forecast(&model).warnings).collect(),
        identity: identity_of(&model).map_err(Error::Identity)?,
        title: model.title.clone(),
        elements: model.mesh.n_elements() as u64,
        facts: Facts::of(&model, &history::columns(&model)),
        text,
        name,
    })
}

/// The command that computes a point once more, with states to look at.
pub fn command(study: &Study, point: &Point, out: &str) -> String {
    let bundle::Options { units, case, parameters, perturbation, title: _, refine: _ } =
        study.options_at(point);
    let mut words = vec!["bolide".to_owned(), "run".to_owned(), study.deck.display().to_string()];
    let flags = ReadingArgs { units, case, set: parameters.into_iter().collect(), perturb: perturbation };
    words.extend(flags.words());
    words.extend(["--out".to_owned(), out.to_owned()]);
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}
