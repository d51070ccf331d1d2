//! What the tests of the whole system share.
//!
//! [`solve`] takes a deck through master and workers in this process; [`cluster`] runs real processes on loopback,
//! [`proxy`] stands between them; [`book`] holds the cases, [`case`] compares a figure with a published or derived one
//! of `reference.toml` and says how it went; [`checker`]
//! looks for nodes inside foreign bodies, without asking the contact code.

pub mod bits;
pub mod book;
pub mod browser;
pub mod case;
pub mod checker;
pub mod cluster;
pub mod faults;
pub mod left;
pub mod proxy;
pub mod solve;
