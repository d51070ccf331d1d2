//! The worker: holds sub-domains and work units, computes, exchanges.
//!
//! [`session`] is a pure state machine that decides; [`compute`] does what it asks on the mechanics, on threads
//! that a [`team`] keeps awake; [`daemon`] carries bytes between a master and the compute thread of [`runner`];
//! [`peers`] between that and other workers. [`stopwatch`] tells where the time goes, [`notify`] a service manager
//! how this process does; [`owner`] steps back where the people whose PC it is on need it;
//! [`processors`] confines it to some of this machine's; in [`slots`] several small jobs share its threads.

use std::hash::{BuildHasher, Hasher, RandomState};

pub mod compute;
pub mod daemon;
pub mod ending;
pub mod input;
pub mod notify;
pub mod owner;
pub mod peers;
pub mod processors;
pub mod runner;
pub mod session;
pub mod slots;
pub mod sorter;
pub mod stopwatch;
pub mod team;

/// A number that no other process draws: for nonces and tokens.
pub fn random() -> u64 {
    // Each state is keyed from the system's source of random bytes.
    RandomState::new().build_hasher().finish()
}
