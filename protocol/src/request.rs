//! What clients ask of a master and what it answers. All of these are control messages.
//!
//! A client sends one [`Request`] and waits; the master answers each with one [`Reply`], except [`Request::Watch`],
//! which is answered by [`Reply::Status`] again and again until the job has ended. Anything that cannot be done is
//! answered by [`Reply::No`] with the reason, and the connection goes on.

use serde::{Deserialize, Serialize};

use crate::{
    codec::{finite, finite_or_none},
    options::JobOptions,
};

/// Most bytes of a deck's text.
pub const DECK_LIMIT: usize = 256 << 20;
/// Most bytes of one piece of a file in [`Reply::Piece`].
pub const PIECE_LIMIT: u32 = 512 << 10;
/// Most bytes of the name of a results file.
pub const FILE_NAME_LIMIT: usize = 255;

/// From a client to the master.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Put a deck into the queue. Answered by [`Reply::Submitted`] or [`Reply::Faults`].
    Submit {
        /// Name of the deck's file, for the places of faults.
        name: String,
        text: String,
        /// What is asked of the run beside the deck.
        options: Box<JobOptions>,
    },
    /// Answered by [`Reply::Jobs`].
    Jobs,
    /// Answered by [`Reply::Hosts`].
    Hosts,
    /// Follow a job; the newest without a number.
    Watch { job: Option<u32> },
    /// Take a job from the queue, or end it after its present cycle. Answered by [`Reply::Done`].
    Cancel { job: u32 },
    /// Answered by [`Reply::Files`].
    Files { job: u32 },
    /// Answered by [`Reply::Piece`].
    File {
        job: u32,
        /// One of the names in [`Reply::Files`].
        name: String,
        /// Where to start (bytes).
        offset: u64,
    },
    /// Put a job that failed or is held back into the queue, to resume from its last checkpoint. Answered by [`Reply::Done`].
    Resume { job: u32 },
    /// Remove a job that is over, with its results. Answered by [`Reply::Done`].
    Remove { job: u32 },
    /// Keep a job out of the queue, or store it after its present cycle, until it is resumed. Answered by [`Reply::Done`].
    Hold { job: u32 },
}

/// Most bytes of [`Joining`] and [`Joined`] as they travel.
pub const JOINING_LIMIT: u32 = 16 << 10;

/// From a newcomer whose token was good, once, after Welcome: the key that it made for itself. Answered by [`Joined`], or
/// by the end of the connection with the reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Joining {
    /// A request for a certificate (PKCS#10, DER), signed with the key.
    pub request: Vec<u8>,
}

/// From the master to a newcomer: its place in the lab.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Joined {
    /// Its certificate (PEM).
    pub certificate: String,
    /// The CA's (PEM).
    pub ca: String,
}

/// From the master to a client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// The deck is in the queue under this number.
    Submitted { job: u32 },
    /// The deck has these faults, one line each; it is not in the queue.
    Faults(Vec<String>),
    /// Every job the master knows, oldest first.
    Jobs(Vec<Status>),
    /// Every host that is or was connected.
    Hosts(Vec<HostRow>),
    /// How a watched job stands; the last one has [`Status::ended`].
    Status(Box<Status>),
    /// It is done, or will be.
    Done(String),
    /// Name and length (bytes) of each file of a job's results.
    Files(Vec<(String, u64)>),
    /// Part of a file, at most [`PIECE_LIMIT`] bytes; none at its end.
    Piece(Vec<u8>),
    /// It cannot be done, and why.
    No(String),
}

/// Where a job stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Waits for the jobs before it, or for workers.
    Queued,
    /// Its workers compute.
    Running,
    /// It came to its end.
    Done,
    /// Something went wrong.
    Failed,
    /// A user keeps it back, or deaths of master or workers interrupted it again and again; a user may resume it.
    Held,
    /// A user took it back; what it had computed is kept.
    Cancelled,
}

impl State {
    /// Its name, as tables print it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Held => "held",
            Self::Cancelled => "cancelled",
        }
    }
}

/// How a job stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Its number, from 1.
    pub job: u32,
    /// Title of the deck.
    pub title: String,
    /// Where it stands.
    pub state: State,
    /// What it waits for, while it is queued.
    pub waits_for: Option<String>,
    /// Cycles completed.
    pub cycle: u64,
    /// Time reached (deck's unit).
    #[serde(deserialize_with = "finite")]
    pub time: f64,
    /// That unit; empty before it has run.
    pub time_unit: String,
    /// One line for a terminal: the time left, a comma, and more.
    pub progress: String,
    /// Seconds to its end as it goes now; none where nobody knows.
    #[serde(deserialize_with = "finite_or_none")]
    pub left_s: Option<f64>,
    /// Which worker computes how many elements.
    pub shares: Vec<Share>,
    /// Set once it is over.
    pub ended: Option<Ended>,
}

impl Status {
    /// Of a job that nothing has happened to.
    pub const fn queued(job: u32, title: String) -> Self {
        Self {
            job,
            title,
            state: State::Queued,
            waits_for: None,
            cycle: 0,
            time: 0.0,
            time_unit: String::new(),
            progress: String::new(),
            left_s: None,
            shares: Vec::new(),
            ended: None,
        }
    }
}

/// A worker's part of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Name of the host.
    pub host: String,
    /// Its relative speed.
    #[serde(deserialize_with = "finite")]
    pub speed: f64,
    /// Elements of its sub-domains.
    pub elements: u64,
}

/// How a job ended.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ended {
    /// What went wrong, if anything.
    pub failure: Option<String>,
    /// The digest of the final state, if there is one.
    pub digest: Option<String>,
    /// The run's summary as JSON, if it ran.
    pub summary: Option<String>,
    /// The same for a person to read.
    pub table: Option<String>,
}

/// One host in the table of hosts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostRow {
    /// Its number in the virtual machine, from 0.
    pub host: u32,
    pub name: String,
    /// Speed relative to the reference host.
    #[serde(deserialize_with = "finite")]
    pub speed: f64,
    pub threads: u32,
    /// Lane set.
    pub lanes: String,
    /// Where it calls from.
    pub address: String,
    /// The connection it is on.
    pub incarnation: u32,
    /// `idle`, `busy` or `lost`.
    pub state: String,
    /// The job it computes, or why it is lost.
    pub note: String,
}

/// Passes a file name that stands for a file of one folder and nothing else, on any system.
///
/// # Errors
/// A sentence with the name, if it is empty, too long, starts with a dot, or has other characters than letters, digits,
/// `-`, `_` and `.`.
pub fn check_file_name(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if !name.is_empty() && name.len() <= FILE_NAME_LIMIT && !name.starts_with('.') && name.chars().all(plain)
    {
        return Ok(());
    }
    let shown: String = name.chars().take(FILE_NAME_LIMIT).collect();
    Err(format!("{shown:?} is no name of a results file; ask for one that the list of files names"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_cannot_leave_their_folder() {
        for good in ["state-000001.vtu", "history.csv", "results.pvd"] {
            assert_eq!(check_file_name(good), Ok(()));
        }
        for bad in ["", "..", ".x", "../x", "/etc/passwd", "a/b", "a\\b", "C:x", "a\0b", "ä"] {
            assert!(check_file_name(bad).is_err(), "{bad:?}");
        }
    }
}
