//! What tests of the whole system share: [`cluster`] runs real processes on loopback.

pub mod cluster;
