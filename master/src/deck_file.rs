//! Decks from files: gathered with all that they refer to, read and checked.

use std::{fmt, path::Path};

use deck::{
    bundle::{self, Options as Reading},
    model::Model,
};

/// Reads and checks a deck.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_deck(path: &Path) -> Result<Model, Error> {
    read_deck_with(path, &Reading::default())
}

/// Reads and checks a deck with what it does not say itself; warnings go to standard error.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_deck_with(path: &Path, options: &Reading) -> Result<Model, Error> {
    let text = gather_deck(path, options)?;
    let reading = deck::read_whole(&text, &path.display().to_string())
        .map_err(|faults| Error::of_faults(faults.iter().map(ToString::to_string)))?;
    warn(&reading.warnings);
    Ok(reading.model)
}

/// Tells what is done otherwise than a deck says, on standard error.
pub fn warn(warnings: &[deck::Warning]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

/// The text of a deck with the files that it refers to.
///
/// # Errors
/// If the deck cannot be opened, or is too large.
pub fn gather_deck(path: &Path, options: &Reading) -> Result<String, Error> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| Error::File { name: name.clone(), why: e.to_string() })?;
    // Comments of keyword decks are written in all kinds of encodings.
    let text = match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) if error.as_bytes().iter().any(|b| matches!(b, b'*' | b'$')) => {
            String::from_utf8_lossy(error.as_bytes()).into_owned()
        }
        Err(error) => return Err(Error::File { name, why: error.to_string() }),
    };
    let mut open =
        |path: &str| std::fs::read(path).ok().map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    bundle::gather(&name, text, options, &mut open).map_err(Error::Bundle)
}

/// Why a deck cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// Its file cannot be opened, or is no text.
    File {
        /// The file.
        name: String,
        /// The system's reason.
        why: String,
    },
    /// It cannot be gathered with the files that it refers to.
    Bundle(String),
    /// Its faults, a line each.
    Faults(Vec<String>),
}

impl Error {
    /// Of a deck with these faults.
    pub fn of_faults(lines: impl IntoIterator<Item = String>) -> Self {
        Self::Faults(lines.into_iter().collect())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { name, why } => write!(f, "{name}: {why}"),
            Self::Bundle(why) => f.write_str(why),
            Self::Faults(lines) => {
                let ending = if lines.len() == 1 { "" } else { "s" };
                write!(f, "{} fault{ending} in the deck\n{}", lines.len(), lines.join("\n"))
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}
