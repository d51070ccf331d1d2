//! The master.

pub mod certs;
