//! The master.

pub mod results;
