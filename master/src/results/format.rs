//! Formats of results beside VTU, for programs that do not read it.
//!
//! A run writes its states as VTU files: they are what a rewind deletes, a checkpoint names by checksum and `bolide verify` computes
//! again. Every other format is made from those files: at the end of a run whose deck asks for it, or later by `bolide
//! export`, also from the states of a run that was killed. So a format is one module that fills [`Format`] and knows neither
//! runs nor models.

use std::path::{Path, PathBuf};

use super::{
    Error,
    vtu::read::{self, Piece},
};

/// A format that is made from the states of a folder.
pub trait Format: Sync {
    /// Its name in decks and on the command line.
    fn name(&self) -> &'static str;

    /// Whether a file of this name is one that [`Self::write`] leaves in a results folder.
    fn writes(&self, file: &str) -> bool;

    /// Fields that states have for its sake although they are usually left out.
    fn fields(&self) -> &'static [&'static str];

    /// Writes its files into the folder of the states, whole or not at all, and replaces those of before.
    ///
    /// # Errors
    /// [`Error`] of a state that cannot be read, or of the disk.
    fn write(&self, states: &States) -> Result<Written, Error>;
}

/// What was written.
#[derive(Debug)]
pub struct Written {
    /// The file to open.
    pub path: PathBuf,
    /// What a reader of the format should know, in a sentence; may be empty.
    pub note: String,
}

/// The states of a results folder, in the order of time. There is at least one.
pub struct States {
    folder: PathBuf,
    files: Vec<PathBuf>,
}

impl States {
    /// Those that the index of a folder lists.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Malformed`] of the index.
    pub fn of(folder: &Path) -> Result<Self, Error> {
        let files = read::index(folder)?.into_iter().map(|(_, file)| file).collect();
        Ok(Self { folder: folder.to_owned(), files })
    }

    /// The results folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.files.len()
    }

    /// Reads one of them.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Malformed`].
    ///
    /// # Panics
    /// If there are not so many.
    pub fn read(&self, index: usize) -> Result<Piece, Error> {
        Piece::open(&self.files[index])
    }

    /// An error about the file of a state.
    pub(super) fn malformed(&self, index: usize, what: impl Into<String>) -> Error {
        Error::Malformed { path: self.files[index].clone(), line: 1, what: what.into() }
    }
}
