//! What Bolide asks of the operating system beyond Rust's standard library: one module for each purpose, of the same functions
//! in `unix` and in `windows`. Nothing outside this crate asks which system it runs on.
//!
//! | module | purpose |
//! |---|---|
//! | [`allocator`] | memory of large arrays goes back to the system |
//! | [`callers`] | whose process is at the other end of a loopback connection |
//! | [`children`] | processes that this one starts, and its own end |
//! | [`clock`] | processor time of a thread; the time of day where this machine stands |
//! | [`files`] | how many files may be open; errors by which the system says that it has none left of something |
//! | [`folders`] | names that outlive a loss of power; a folder that one process has |
//! | [`host`] | the name of this machine |
//! | [`interrupts`] | Ctrl-C and the like |
//! | [`memory`] | how much memory there is |
//! | [`notice`] | what a service manager is told |
//! | [`owner`] | whether the people whose machine this is need it |
//! | [`private`] | files that are their owner's alone |
//! | [`processors`] | which processors threads may use, and how urgent a thread is |
//! | [`service`] | programs that the service manager of Windows starts |
//! | [`shared`] | memory that two processes have in common |
//! | [`terminal`] | keys one by one, and the size of the screen |

use std::path::PathBuf;

#[cfg(any(windows, test))]
mod command_line;
#[cfg(not(target_os = "linux"))]
mod unshared;

#[cfg(unix)]
mod unix;
#[cfg(unix)]
pub use unix::{
    allocator, callers, children, clock, files, folders, host, interrupts, memory, notice, owner, private,
    processors, service, shared, terminal,
};

#[cfg(windows)]
mod windows;
#[cfg(windows)]
pub use windows::{
    allocator, callers, children, clock, files, folders, host, interrupts, memory, notice, owner, private,
    processors, service, shared, terminal,
};

/// A program that is to start with the machine, as its service manager keeps it.
#[derive(Clone, Debug)]
pub struct Service {
    /// What commands call it.
    pub name: String,
    /// What lists call it.
    pub title: String,
    /// What it is for, as a sentence.
    pub description: String,
    /// Who runs it: `LocalService`, `DOMAIN\\user` and the like.
    pub account: String,
    /// The password of the account, where it has one.
    pub password: Option<String>,
    /// What this executable is started with; the first are [`Service::RUN`].
    pub arguments: Vec<String>,
    /// Where it starts, and where its log is; made if there is none, for the account and administrators alone.
    pub folder: PathBuf,
    /// Files that only the account and administrators may read from now on.
    pub secrets: Vec<PathBuf>,
    /// Folders that the account needs whole, if they are there already.
    pub needs: Vec<PathBuf>,
}

impl Service {
    /// How the command lines of all services of this program begin.
    pub const RUN: [&str; 2] = ["service", "run"];
}

/// What a program does when it is started as a service; gives its exit code.
pub type Body = Box<dyn FnOnce() -> u8 + Send>;

/// Who may read a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readers {
    /// Its owner, and who administers the machine.
    Owner,
    /// Everybody on this machine whom its folder lets in.
    All,
}

/// Whose process opened a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Caller {
    /// A process of the user of this one.
    Own,
    /// One of the machine's administrator: root, or the system itself.
    Administrator,
    /// One of another user; the names of both.
    Other { theirs: String, ours: String },
    /// The system does not list the connection: it is closed already, or comes from elsewhere.
    Unlisted,
    /// This system has no list of connections.
    NoList,
}

/// What shows, since the last look, that the people whose machine this is need it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signs {
    /// Processors that other programs kept busy, those left out that ask for no more than what is idle.
    pub others: f64,
    /// Somebody used a keyboard, or on Windows a mouse.
    pub typed: bool,
    /// Somebody logged in.
    pub logged_in: bool,
    /// The machine lives on its battery.
    pub on_battery: bool,
    /// Its temperature (degrees Celsius), where that is so high that the system acts against it.
    pub hot: Option<f64>,
}
