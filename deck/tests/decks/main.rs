//! Decks as their authors write them: what is read, what is refused, and where.

mod bad_decks;
mod budgets;
mod damage;
mod examples;
mod intent;
mod keyword;
mod mesh_files;
mod mutations;
mod physics;
mod reading;
mod schema;
mod tetrahedra;
