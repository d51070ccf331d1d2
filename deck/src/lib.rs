//! Text in, checked [`Model`] out.
//!
//! [`read`] takes the text of a TOML deck (`README.md` is the reference of the format) and gives either a
//! [`Model`] that can run, or every [`Fault`] of the deck with line, column, what was read, what was
//! expected and what to do. It opens no file, allocates nothing before its size is known to be inside the
//! named limits, and does not panic on any text.
//!
//! Parts are built from blocks, by the material library or materials of the deck ([`library`]), in one
//! named consistent set of units ([`units`]). Nothing is computed here that a cycle needs.

mod assembly;
mod blocks;
mod check;
pub mod fault;
mod format;
mod geometry;
pub mod library;
pub mod model;
pub mod table;
pub mod units;

pub use fault::{Fault, MAX_FAULTS};
pub use format::{MAX_CONTACT_PARTS, MAX_ELEMENTS, MAX_ENTRIES, MAX_NODES, MAX_PARTS, MAX_TEXT, MAX_TITLE};
pub use model::Model;
pub use table::{MAX_NAME, MAX_NUMBER};

/// Reads and checks a deck. `file_name` stands in the faults; no file is opened.
///
/// # Errors
///
/// Every fault of the deck, ordered by place, at most [`MAX_FAULTS`]. Faults of syntax hide all others.
pub fn read(text: &str, file_name: &str) -> Result<Model, Vec<Fault>> {
    format::read(text, file_name)
}

/// Names of the library's materials.
pub fn materials() -> Vec<&'static str> {
    library::names()
}
