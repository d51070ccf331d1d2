//! What the master's scheduler hears: from the connections of workers, from clients and the page, from the threads of jobs.

use std::{fmt, path::PathBuf};

use protocol::{
    handshake::Hello,
    options::JobOptions,
    request::{Ended, HostRow, State, Status},
};
use tokio::sync::{mpsc, oneshot, watch};

use crate::{
    drive::WorkerLink,
    queue::{self, Change, Size, Wish},
    results, spool,
};

/// Notices that may wait for the scheduler.
pub const WAITING_NOTICES: usize = 1024;

/// How a worker's connection ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It broke.
    Lost,
    /// The worker said good-bye.
    Left,
    /// Its job dropped the worker, which may not come back.
    Dropped,
}

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
        end: End,
    },
    /// A worker has been silent for long, or is heard again.
    Suspect {
        /// Its connection.
        incarnation: u32,
        /// In words, while it is silent.
        note: Option<String>,
    },
    /// A worker computes a part of its time only, or all of it again.
    Slow {
        /// Its connection.
        incarnation: u32,
        /// In words, while it does.
        note: Option<String>,
    },
    /// A job that goes on has released a worker.
    Freed {
        /// Its connection.
        incarnation: u32,
        job: u32,
    },
    /// A client brings a deck without faults; answered with the job's number.
    Submit {
        /// Name of its file.
        name: String,
        title: String,
        text: String,
        size: Size,
        /// What is asked beside the deck.
        options: JobOptions,
        /// Who brings it, by certificate; empty without one.
        owner: String,
        /// The job's number, or why it is refused.
        answer: oneshot::Sender<Result<u32, Error>>,
    },
    /// Somebody asks whether the owner of the queue still hears.
    Alive(oneshot::Sender<()>),
    /// A client asks for all jobs.
    Jobs(oneshot::Sender<Vec<Status>>),
    /// A client asks for all hosts.
    Hosts(oneshot::Sender<Vec<HostRow>>),
    /// A client follows a job; the newest without a number.
    Watch(Option<u32>, oneshot::Sender<Result<watch::Receiver<Status>, Error>>),
    /// A client takes a job back or keeps it back.
    Wish(u32, Wish, oneshot::Sender<Result<String, Error>>),
    /// A client wants a job that failed or is held to go on.
    Resume(u32, oneshot::Sender<Result<String, Error>>),
    /// A client removes a job that is over.
    Remove(u32, oneshot::Sender<Result<String, Error>>),
    /// A client asks where a job's results are.
    Folder(u32, oneshot::Sender<Result<PathBuf, Error>>),
    /// A job's thread is done.
    Over(u32, Change, Box<Ended>),
}

/// Why the scheduler does not do what a client or the page asks.
#[derive(Debug)]
pub enum Error {
    /// There is no job at all.
    NoJob,
    Queue(queue::Error),
    /// What was asked is not done, because it could not be put on disk.
    Disk {
        /// What was asked, as the beginning of a sentence.
        asked: String,
        why: spool::Fault,
    },
    /// The deck of a job cannot be read any more.
    Deck(spool::Fault),
    /// The results of a job cannot be removed.
    Results(results::Error),
    /// The job writes no results.
    WritesNone(u32),
    /// The job has no results in this state.
    NoResults(u32, State),
    /// A page of results that are there, which runs nothing.
    OnlyShows,
    /// The master ends and answers nobody any more.
    Ending,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoJob => f.write_str("no job yet"),
            Self::Queue(error) => error.fmt(f),
            Self::Disk { asked, why } => write!(f, "{asked}: {why}"),
            Self::Deck(fault) => fault.fmt(f),
            Self::Results(error) => error.fmt(f),
            Self::WritesNone(job) => write!(f, "job {job} writes no results"),
            Self::NoResults(job, state) => write!(f, "job {job} is {} and has no results", state.name()),
            Self::OnlyShows => f.write_str(
                "this page shows results that are there; start `bolide master --http 127.0.0.1:7118` to run decks from a page",
            ),
            Self::Ending => f.write_str("the master is ending"),
        }
    }
}

impl std::error::Error for Error {}

impl From<queue::Error> for Error {
    fn from(error: queue::Error) -> Self {
        Self::Queue(error)
    }
}

/// Puts a question to the scheduler.
///
/// # Errors
/// [`Error::Ending`] if the master is ending.
pub async fn ask<T>(
    notices: &mpsc::Sender<Notice>,
    question: impl FnOnce(oneshot::Sender<T>) -> Notice,
) -> Result<T, Error> {
    let (answer, answered) = oneshot::channel();
    notices.send(question(answer)).await.map_err(|_| Error::Ending)?;
    answered.await.map_err(|_| Error::Ending)
}
