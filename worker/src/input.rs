//! What the compute thread of a worker hears, from the master and from other workers.

use protocol::{
    Error,
    frame::Header,
    link::Sender,
    message::{ToPeer, ToWorker},
};

/// What the compute thread hears.
pub enum Input {
    /// A message of the master, with the header of its frame.
    Master(Header, ToWorker),
    /// Of a link to another worker.
    Peer(News),
    /// This process is to end or to step back, for this reason: the master is asked to release it.
    Leave(String),
}

/// The job and its epoch that links belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key {
    pub job: u32,
    pub epoch: u32,
}

/// What the compute thread hears about a peer.
pub struct News {
    /// Of which job and epoch.
    pub key: Key,
    /// The other worker's index.
    pub from: u32,
    pub what: What,
}

/// What happens to a pair.
pub enum What {
    /// A link stands.
    Stands(Sender),
    /// It could not be reached.
    Failed(Error),
    /// Partial forces came.
    Frame(Header, ToPeer),
    /// The link has ended.
    Ended(Error),
}
