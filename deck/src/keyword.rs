//! The reader of LS-DYNA keyword decks: files of cards become a typed deck and its mesh.
//!
//! 1. [`cards`]: lines, includes, cases and parameters become blocks of cards;
//! 2. [`read`]: each keyword is read by its columns into a [`problem`], by the numbers of the deck;
//! 3. [`translate`]: the problem becomes a typed deck, each entry with the card that it comes from.
//!
//! Checks and the model are then those of any deck. Nothing is passed over in silence: what is read and not honoured is a
//! fault where it would change what is computed, else a warning.

mod beam;
mod blast;
mod cards;
mod condition;
mod contact;
mod control;
mod damping;
mod define;
mod discrete;
mod erosion;
mod explosive;
mod expression;
mod fields;
mod inertia;
mod joint;
mod material;
mod members;
mod mesh;
mod mesh_alone;
mod moving;
mod parameter;
mod prescribed;
mod problem;
mod property;
mod read;
mod rigid;
mod set;
mod stress;
mod translate;
mod transmit;
mod unit;
mod velocity;

pub(crate) use expression::evaluate;
pub(crate) use mesh_alone::read_mesh;
pub use unit::NAMES as UNIT_NAMES;
pub(crate) use unit::name_of as units_of;

use crate::{
    bundle::Bundle,
    log::Log,
    typed::{Deck, mesh::Mesh},
};

/// Reads a keyword deck, which calls its mesh `mesh_name`. After a fault the deck holds what could be read.
pub(crate) fn read(bundle: &Bundle<'_>, mesh_name: &str, log: &Log<'_>) -> (Deck, Mesh) {
    let mut lines = cards::read(bundle, log);
    let problem = read::read(&mut lines, log);
    translate::translate(&problem, bundle.options.units.as_deref(), mesh_name, log)
}
