//! The worker: holds sub-domains and work units, computes, exchanges.
//!
//! [`session`] is a pure state machine that decides; [`compute`] does what it asks on the mechanics; `daemon`
//! carries bytes between the session and a master.

pub mod compute;
pub mod session;
