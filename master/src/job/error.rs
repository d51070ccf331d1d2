//! Why a job cannot start, or cannot go on.

use std::fmt;

use mechanics::exact::Quantum;
use protocol::message::WORKER_STATE_VERSION;

use crate::erosion::UnknownElement;

/// Why a job cannot start, or cannot go on. What goes wrong in its physics is no error: it is the failure of its outcome.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// There is nobody to start with.
    NoWorker,
    /// The problem cannot start as it is; in words of the mechanics.
    Problem(String),
    /// Two parts start inside the contact zone of each other.
    Zones(Box<Overlap>),
    /// The snapshot does not fit the deck.
    AnotherProblem,
    /// The problem has no bytes to take the checksum of.
    Unencoded(String),
    /// A worker broke a rule of the messages.
    Worker(usize, Breach),
    /// A worker that there is not is lost.
    Unknown {
        /// Its index.
        worker: usize,
        /// How many there are.
        known: usize,
    },
    /// The last worker of a job that does not wait is lost.
    LastLost {
        /// Its name.
        worker: String,
        why: String,
    },
    /// The last workers were dropped, for numbers that are wrong.
    LastDropped {
        worker: String,
        /// What was wrong.
        why: String,
    },
    /// A worker failed, and there is no other to go on with.
    Failed {
        /// Its name.
        worker: String,
        cycle: u64,
        /// Why.
        reason: String,
    },
    /// A second worker failed where a first one had: the problem is to blame.
    FailedAgain {
        /// Its name.
        worker: String,
        cycle: u64,
        /// Why.
        reason: String,
        first: String,
        /// Its cycle.
        at: u64,
    },
    /// The samples of all workers are others than the master's.
    AllDiffer {
        /// How many there are.
        workers: usize,
        /// How the first one differs.
        first: String,
    },
    /// Computations of an interval came to different ends each time.
    NoTwoAgree {
        /// The cycle at whose start it begins.
        begins: u64,
        /// The cycle at whose start the last one ended.
        ends: u64,
        computations: usize,
    },
    /// A worker is lost whose work nobody can take up, because no state is kept.
    NotKept {
        /// The cycle to go back to.
        cycle: u64,
    },
    /// The job has been dealt out too often.
    Epochs,
    /// A cycle came that no orders were given for.
    NotOrdered(u64),
    /// A cycle came without a plan.
    NoPlan(u64),
    /// Nobody voted.
    NoVote,
    /// A cycle of all frames has no vote.
    CycleWithoutVote,
    /// A sort came that nobody asked for.
    UnknownSort(u64),
    /// A vote names an element that there is not.
    UnknownElement(UnknownElement),
    /// Forces are greater than exact sums hold.
    Force {
        /// Their bound (force).
        bound: f64,
        /// Quantum of the sums.
        quantum: Quantum,
    },
    /// The first vote says that an element has no volume.
    Element(String),
}

/// What a worker may not do. All of it is a bug of one side, or another program at the other end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Breach {
    /// A message of an epoch that it is not in.
    Epoch {
        /// The message's.
        epoch: u32,
        /// The present one.
        now: u32,
    },
    /// A message to a worker that there is not.
    Address {
        /// To whom.
        to: u32,
        /// How many there are.
        workers: usize,
    },
    /// A report with numbers that cannot be.
    Report(String),
    /// States of another version.
    StateVersion(u32),
    /// A state of so many elements, from a worker that holds others.
    Elements { cycle: u64, elements: u64, held: u64 },
    /// It says twice that it is ready.
    ReadyTwice,
    /// A cycle before all were ready.
    BeforeStart(u64),
    /// The votes of all in a cycle, from a worker that is not the root of their tree.
    NotTheRoot(u64),
    /// The votes of so many workers in a cycle, where there are others.
    Voters { cycle: u64, voters: u32, workers: usize },
    /// States or samples again and again, before the votes of this cycle.
    TooEarly(u64),
    /// The same thing of a cycle twice.
    Twice(Sent, u64),
    /// Something of a cycle that nobody asked for.
    Unasked(Sent, u64),
    /// So many numbers of partial forces in a cycle where the plan has others.
    Partials {
        cycle: u64,
        /// Numbers that came.
        numbers: usize,
        /// Numbers of the plan.
        planned: usize,
    },
    /// So many numbers of gathered positions.
    Gathered {
        /// Numbers that came.
        numbers: usize,
        /// Numbers that were expected.
        expected: usize,
    },
    /// A sort of a cycle with parts or boxes that cannot be.
    NoSort(u64),
    /// State of nodes that move to other workers, in a cycle in which none do.
    TransferWithoutPlan(u64),
    /// So many numbers of such state.
    Transfer {
        cycle: u64,
        /// Numbers that came.
        numbers: usize,
        /// Numbers of the plan.
        planned: usize,
    },
}

/// What a worker sends of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    Frame,
    Positions,
    WorkerState,
    Sample,
    Sort,
}

/// Nodes or edges of two parts that start nearer than the gap.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlap {
    /// What is too near, with the user's numbers of nodes.
    pub what: TooNear,
    /// Names of both parts.
    pub parts: [String; 2],
    /// How far they are apart (length).
    pub distance: f64,
    /// The gap (length).
    pub gap: f64,
}

/// What is too near to another part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TooNear {
    /// A node to a face.
    Node(u32),
    /// An edge to an edge: the nodes of both.
    Edges([[u32; 2]; 2]),
}

impl Error {
    /// Whether workers' numbers led to it, which a flipped bit could have changed.
    pub(super) const fn follows_from_numbers(&self) -> bool {
        matches!(self, Self::Problem(_) | Self::UnknownElement(_) | Self::Force { .. } | Self::Element(_))
    }
}

impl From<UnknownElement> for Error {
    fn from(unknown: UnknownElement) -> Self {
        Self::UnknownElement(unknown)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoWorker => f.write_str("no worker: start one with `bolide worker --master HOST`"),
            Self::Problem(why) | Self::Element(why) => f.write_str(why),
            Self::Zones(overlap) => overlap.fmt(f),
            Self::AnotherProblem => write!(
                f,
                "the snapshot is of another problem or release: title, mesh, materials and conditions must be this deck's, computed by Bolide {}; run without the snapshot",
                env!("CARGO_PKG_VERSION")
            ),
            Self::Unencoded(why) => write!(f, "the checksum of the problem: {why}"),
            Self::Worker(worker, breach) => breach.write(*worker, f),
            Self::Unknown { worker, known } => write!(f, "worker {worker} of {known} is lost"),
            Self::LastLost { worker, why } => {
                write!(f, "worker {worker} is lost: {why}; no other is left")
            }
            Self::LastDropped { worker, why } => write!(f, "worker {worker}: {why}; no other is left"),
            Self::Failed { worker, cycle, reason } => write!(f, "worker {worker}, cycle {cycle}: {reason}"),
            Self::FailedAgain { worker, cycle, reason, first, at } => write!(
                f,
                "worker {worker}, cycle {cycle}: {reason}; worker {first} failed at cycle {at} as well, so it is not the worker's fault"
            ),
            Self::AllDiffer { workers, first } => write!(
                f,
                "the samples of all {workers} workers differ from this master's: look at its host. {first}"
            ),
            Self::NoTwoAgree { begins, ends, computations } => write!(
                f,
                "cycles {begins} to {ends}: no two of {computations} computations by different workers agree; a host computes wrongly each time, run `bolide bench` and a memory test on each"
            ),
            Self::NotKept { cycle } => write!(f, "no state of cycle {cycle} is kept to go back to"),
            Self::Epochs => f.write_str("2^32 epochs of one job"),
            Self::NotOrdered(cycle) => write!(f, "cycle {cycle} was not ordered"),
            Self::NoPlan(cycle) => write!(f, "no plan for cycle {cycle}"),
            Self::NoVote => f.write_str("no worker voted"),
            Self::CycleWithoutVote => f.write_str("a cycle without a vote"),
            Self::UnknownSort(cycle) => write!(f, "a sort of cycle {cycle} that nobody asked for"),
            Self::UnknownElement(unknown) => unknown.fmt(f),
            Self::Force { bound, quantum } => write!(
                f,
                "a force of up to {bound:e}, exact sums hold {:e}; the run has blown up or needs a smaller time step",
                quantum.term_bound()
            ),
        }
    }
}

impl Breach {
    fn write(&self, worker: usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Epoch { epoch, now } => write!(
                f,
                "worker {worker} sends a message of epoch {epoch}, which it was not dealt; this is epoch {now}"
            ),
            Self::Address { to, workers } => {
                write!(f, "worker {worker} writes to worker {to}, there are {workers}")
            }
            Self::Report(why) => write!(f, "worker {worker}: {why}"),
            Self::StateVersion(version) => write!(
                f,
                "worker {worker} sends states of version {version}, this master reads {WORKER_STATE_VERSION}"
            ),
            Self::Elements { cycle, elements, held } => {
                write!(
                    f,
                    "worker {worker} sends {elements} elements in its state of cycle {cycle}, it holds {held}"
                )
            }
            Self::ReadyTwice => write!(f, "worker {worker} is ready twice"),
            Self::BeforeStart(cycle) => write!(f, "worker {worker} sends cycle {cycle} before the start"),
            Self::TooEarly(cycle) => {
                write!(
                    f,
                    "worker {worker} sends states and samples again and again before the votes of cycle {cycle}"
                )
            }
            Self::NotTheRoot(cycle) => {
                write!(
                    f,
                    "worker {worker} sends the votes of all in cycle {cycle}, which another one collects"
                )
            }
            Self::Voters { cycle, voters, workers } => {
                write!(
                    f,
                    "worker {worker} sends the votes of {voters} workers in cycle {cycle}, there are {workers}"
                )
            }
            Self::Twice(sent, cycle) => {
                let what = match sent {
                    Sent::Frame => "",
                    Sent::Positions => "positions of ",
                    Sent::WorkerState => "its state of ",
                    Sent::Sample => "its sample of ",
                    Sent::Sort => "its sort of ",
                };
                write!(f, "worker {worker} sends {what}cycle {cycle} twice")
            }
            Self::Unasked(sent, cycle) => {
                let what = match sent {
                    Sent::Frame => "a frame",
                    Sent::Positions => "positions",
                    Sent::WorkerState => "a state",
                    Sent::Sample => "a sample",
                    Sent::Sort => "a sort",
                };
                write!(f, "worker {worker} sends {what} of cycle {cycle}, which nobody asked for")
            }
            Self::Partials { cycle, numbers, planned } => write!(
                f,
                "worker {worker}, cycle {cycle}: {numbers} numbers of partial forces, the plan has {planned}"
            ),
            Self::Gathered { numbers, expected } => {
                write!(f, "worker {worker} gathered {numbers} numbers, expected {expected}")
            }
            Self::NoSort(cycle) => write!(
                f,
                "worker {worker} sends a sort of cycle {cycle} with parts or boxes that there are not"
            ),
            Self::TransferWithoutPlan(cycle) => {
                write!(f, "worker {worker} transfers nodes at cycle {cycle}, where no plan acts")
            }
            Self::Transfer { cycle, numbers, planned } => write!(
                f,
                "worker {worker} transfers {numbers} numbers at cycle {cycle}, the plan has {planned}"
            ),
        }
    }
}

impl fmt::Display for Overlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, parts: [part, other], distance, gap } = self;
        match what {
            TooNear::Node(node) => {
                write!(f, "node {node} of part `{part}` starts {distance:e} from part `{other}`")?;
            }
            TooNear::Edges([[a, b], [c, d]]) => write!(
                f,
                "the edge from node {a} to {b} of part `{part}` starts {distance:e} from the edge from node {c} to {d} of part `{other}`"
            )?,
        }
        write!(
            f,
            ", inside the contact gap {gap:e}; move the parts apart by at least the gap, join them, or write contact.initial_penetration = \"ignore\""
        )
    }
}

impl std::error::Error for Error {}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}
