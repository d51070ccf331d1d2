//! Places in what a user wrote, and values that know theirs.

/// Where something starts. Places of one deck are of one kind; they are ordered as the user reads them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Byte offset in the text of a TOML file.
    Text(u32),
    /// A character of a card of a keyword deck.
    Card {
        /// Index of the file in the bundle.
        file: u16,
        /// Line, from 1.
        line: u32,
        /// Column, from 1.
        column: u16,
    },
}

impl Place {
    /// A byte offset of a TOML file.
    pub fn text(at: usize) -> Self {
        // Texts are shorter than 64 MiB.
        Self::Text(at as u32)
    }

    /// The first column of a line of a keyword deck.
    pub fn card(file: u16, line: u32) -> Self {
        Self::Card { file, line, column: 1 }
    }

    /// Index of its file in the bundle.
    pub fn file(self) -> u16 {
        match self {
            Self::Text(_) => 0,
            Self::Card { file, .. } => file,
        }
    }

    /// The same line at another column, from 1.
    pub fn at_column(self, column: u32) -> Self {
        match self {
            Self::Card { file, line, .. } => {
                Self::Card { file, line, column: u16::try_from(column).unwrap_or(u16::MAX) }
            }
            Self::Text(_) => self,
        }
    }
}

/// The words that a value was read from: a key of a TOML deck, or a field of a card, and what stands there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Where the value starts.
    pub at: Place,
    /// Behind its last character, an offset or a column as `at` is.
    pub end: u32,
    /// The key, or the name of the field.
    pub word: &'static str,
}

impl Origin {
    /// A whole card of a keyword deck that has no name of its own.
    pub fn card(at: Place) -> Self {
        Self { at, end: 0, word: "" }
    }
}

/// A value and the words that it was read from.
#[derive(Clone, Debug)]
pub struct Placed<T> {
    pub value: T,
    /// The words.
    pub origin: Origin,
}

impl<T> Placed<T> {
    /// A value that was read from some words.
    pub fn new(value: T, origin: Origin) -> Self {
        Self { value, origin }
    }
}
