//! What is due when under a virtual clock: ends of work, and messages on their way.

use std::cmp::Ordering;

use worker::session::Outcome;

use super::super::network::Way;
use super::super::timeline::Kind;
use crate::{sort::Sorted, world::Parcel};

/// A message on its way, as the clock knows it.
pub struct Sent {
    /// Its number in the run.
    pub number: u64,
    /// The message.
    pub parcel: Parcel,
    /// Incarnations of the hosts at its ends: of one that died or was given up it never comes.
    pub incarnations: [u32; 2],
    /// The cycle of the worker at one of its ends.
    pub cycle: u64,
    /// When it was handed to the sender's processor (s).
    pub at: f64,
}

/// What a processor works on.
pub enum Work {
    /// A task of a worker in this incarnation, and what will come of it.
    Task(usize, u32, Kind, Outcome),
    /// The master's sort, and what will come of it.
    Sort(Box<Sorted>),
    /// A message that leaves.
    Send(Sent),
    /// A message that comes in.
    Receive(Sent),
}

/// Work with the time it began.
pub struct Begun(pub f64, pub Work);

/// What is due.
pub enum What {
    /// A processor may have ended something, if nothing changed since this version.
    Processor(usize, u64),
    /// The first bits of a message reach a port on its way.
    Enters(Sent, Way),
    /// All of a message is there.
    Arrives(Sent),
    /// The time that the job asked for has passed.
    Timer,
    /// The master finds a worker lost: its index in the job, and why.
    Lost(usize, String),
    /// A host that stood still goes on, at this speed.
    GoesOn(usize, f64),
}

/// Something due: the earliest first, and of those due at once the first that was foreseen.
pub struct Due {
    /// When (s).
    pub time: f64,
    /// By when it was foreseen.
    pub order: u64,
    pub what: What,
}

impl PartialEq for Due {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Due {}
impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Due {
    /// The earliest is the greatest, as the heap gives the greatest first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.time.total_cmp(&self.time).then(other.order.cmp(&self.order))
    }
}
