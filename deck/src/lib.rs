//! Text in, checked [`model::Model`] out.
pub mod model;
