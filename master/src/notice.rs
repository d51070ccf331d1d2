//! What the master's scheduler hears: from the connections of workers, from clients and the page, from the threads of jobs.

use std::path::PathBuf;

use protocol::{
    handshake::Hello,
    options::JobOptions,
    request::{Ended, HostRow, Status},
};
use tokio::sync::{oneshot, watch};

use crate::{drive::WorkerLink, queue::Change};

/// Notices that may wait for the scheduler.
pub const WAITING_NOTICES: usize = 1024;

/// What the scheduler, which owns hosts and queue, hears from connections, pages and the threads of jobs.
pub enum Notice {
    /// A worker wants to be taken in; answered with its number.
    Knock {
        /// Its greeting.
        hello: Box<Hello>,
        /// Where it calls from.
        address: String,
        /// Its connection.
        incarnation: u32,
        /// Its host's number, or why it is refused.
        answer: oneshot::Sender<Result<u32, String>>,
    },
    /// It was welcomed and can be given jobs.
    Joined(WorkerLink),
    /// Its connection has ended.
    Left {
        /// The connection.
        incarnation: u32,
        why: String,
        /// Its job dropped the worker: it may not come back.
        dropped: bool,
    },
    /// A worker has been silent for long, or is heard again.
    Suspect {
        /// Its connection.
        incarnation: u32,
        /// In words, while it is silent.
        note: Option<String>,
    },
    /// A client brings a deck without faults; answered with the job's number.
    Submit {
        /// Name of its file.
        name: String,
        title: String,
        text: String,
        /// What its mesh has.
        elements: u64,
        /// What is asked beside the deck.
        options: JobOptions,
        /// The job's number, or why it is refused.
        answer: oneshot::Sender<Result<u32, String>>,
    },
    /// Somebody asks whether the owner of the queue still hears.
    Alive(oneshot::Sender<()>),
    /// A client asks for all jobs.
    Jobs(oneshot::Sender<Vec<Status>>),
    /// A client asks for all hosts.
    Hosts(oneshot::Sender<Vec<HostRow>>),
    /// A client follows a job; the newest without a number.
    Watch(Option<u32>, oneshot::Sender<Result<watch::Receiver<Status>, String>>),
    /// A client takes a job back.
    Cancel(u32, oneshot::Sender<Result<String, String>>),
    /// A client wants a job that failed to go on.
    Resume(u32, oneshot::Sender<Result<String, String>>),
    /// A client removes a job that is over.
    Remove(u32, oneshot::Sender<Result<String, String>>),
    /// A client asks where a job's results are.
    Folder(u32, oneshot::Sender<Result<PathBuf, String>>),
    /// A job's thread is done.
    Over(u32, Change, Box<Ended>),
}
