//! BENCH: what this machine's parts cost, measured on the real ones.

pub mod grind;
pub mod messages;
