//! The closed lists of a job: what happens to it, what it wants done, how it ends.

use std::sync::Arc;

use mechanics::{contact::Census, sample::Sample, state::GlobalState};
use protocol::{
    message::{ToMaster, ToWorker, Work},
    phase::Report,
};

use crate::{
    fragments::Runaway,
    incident::{Difference, Loss, Rebalance},
    job::Cutting,
    results::history::HistoryRow,
    run_totals::RunTotals,
    snapshot::Snapshot,
    sort::{Gathered, SortBasis, Sorted},
};

/// A worker as the job sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkerSpec {
    /// Name for messages.
    pub name: String,
    /// Relative speed, user-given.
    pub speed: f64,
    pub threads: u32,
    /// Of the workers with fast links to each other; empty for those that name none.
    pub region: String,
}

impl WorkerSpec {
    /// A worker that names no region.
    pub fn new(name: impl Into<String>, speed: f64, threads: u32) -> Self {
        Self { name: name.into(), speed, threads, region: String::new() }
    }

    /// It has so many threads from now on, and speed in proportion.
    pub fn compute_with(&mut self, threads: u32) {
        self.speed *= f64::from(threads) / f64::from(self.threads.max(1));
        self.threads = threads;
    }
}

/// What happens to a job. Workers have the index at which they came: first those of [`Job::new`](crate::job::Job::new),
/// then one after another as they join.
pub enum Event {
    /// A message from a worker, of the epoch that the worker was in when it was sent.
    Message(usize, u32, ToMaster),
    /// A sort is done.
    Sorted(Box<Sorted>),
    /// The user wants the run to end with the results so far.
    Stop,
    /// This process has to leave: the run is stored at the next cycle, to be gone on with by another one.
    Suspend,
    /// A worker is gone for good.
    Lost(usize, String),
    /// A worker has come; it has the next index.
    Joined(WorkerSpec),
    /// Another job needs a worker: it is to be freed at the next plan boundary.
    Yield(usize),
    /// A worker has so many threads from now on: what is dealt out next follows that.
    Threads(usize, u32),
    /// The time that [`Action::Timer`] asked for has passed.
    Timer,
}

/// What a job wants done.
pub enum Action {
    Send(usize, ToWorker),
    /// Cut pieces and send them, in the order of what is sent.
    Pieces(usize, Cutting),
    /// Sort; exactly one [`Event::Sorted`] answers it. Positions by surface node.
    Sort(Arc<SortBasis>, Gathered),
    /// Send [`Event::Timer`] in so many seconds.
    Timer(f64),
    /// Append a row of history.
    Row(Box<HistoryRow>),
    /// Write a state for the user.
    State(Box<GlobalState>),
    /// The run goes back: drop all rows but the first so many, and states of later cycles.
    Rewind {
        /// Rows to keep, those of a run before that this one resumed included.
        rows: usize,
        /// The cycle that the run goes back to.
        cycle: u64,
    },
    /// Work was dealt out anew: who has how many elements.
    Dealt(Vec<Deal>),
    /// Store the snapshot that was asked for.
    Snapshot(Box<Snapshot>),
    /// A checkpoint, which the run could be gone on with from disk; the last one of a run that is stopped comes in any case.
    Checkpoint {
        /// All of it but the states written.
        snapshot: Box<Snapshot>,
        /// The run stops here.
        last: bool,
    },
    /// A worker is released from the job, which goes on without it.
    Freed(usize),
    /// The worker of every element from now on, by global index, where the deck wants states to say it.
    Owners(Arc<[u32]>),
    /// Have no more to do with a worker, and tell it why: it failed by itself, or its numbers are wrong. The job has gone on
    /// without it, and it must not come back.
    Dismiss(usize, String),
    /// A worker's sample agreed with what it came to here; another may compute it a third time.
    Proved(Arc<Proved>),
    /// Tell the user how far it is.
    Progress(Progress),
    /// The job is over.
    Over(Box<Outcome>),
}

/// A worker's sample that was computed again and agreed.
#[derive(Clone, Debug, PartialEq)]
pub struct Proved {
    /// Name of the worker.
    pub worker: String,
    /// Name of the part whose block it is.
    pub part: String,
    /// What the elements came to.
    pub hash: [u8; 16],
    pub sample: Sample,
}

/// What a worker was dealt.
#[derive(Clone, Debug, PartialEq)]
pub struct Deal {
    pub name: String,
    /// The speed that it was dealt work by.
    pub speed: f64,
    pub elements: u64,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Cycles completed.
    pub cycle: u64,
    /// Time (time).
    pub time: f64,
    /// Time step (time).
    pub dt: f64,
    /// Global index of the element that limits it; none where something else does.
    pub element: Option<u32>,
    pub limit: Limit,
}

/// What limits a time step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Courant limit of an element.
    Courant,
    /// Rate of volume of an element.
    Volume,
    /// Stiffness of a contact.
    Contact,
    /// Solids will strike a rigid wall.
    Strike,
    /// A rigid body may not turn further.
    Turn,
    /// A contact node may not travel further.
    Travel,
    /// The step before times the growth.
    Growth,
    /// The end of the run.
    End,
}

/// How a job ended.
pub struct Outcome {
    /// None for a run to its end or to the user's stop; else what went wrong.
    pub failure: Option<String>,
    /// The user stopped it.
    pub stopped: bool,
    /// This process has to leave; the run is to be gone on with.
    pub suspended: bool,
    /// The final state, unless a worker could not give it.
    pub state: Option<GlobalState>,
    /// Digest of the final state.
    pub digest: String,
    pub run_totals: RunTotals,
    /// Sorts that took effect.
    pub sorts: u64,
    /// Census of the last sort.
    pub census: Census,
    /// Compute time of each worker.
    pub work: Vec<Work>,
    /// How the time of each worker went; empty where a worker did not come to the end.
    pub reports: Vec<Report>,
    /// Largest over mean of cost over speed.
    pub imbalance: f64,
    /// Lane width of the workers.
    pub lanes: String,
    /// Name of the route.
    pub route: &'static str,
    /// Cycles of this session of the run: not those before a snapshot that it resumed from.
    pub cycles_run: u64,
    /// Names of the workers at the end.
    pub workers: Vec<String>,
    /// When work was dealt out by other speeds.
    pub rebalances: Vec<Rebalance>,
    /// Workers that were lost at work.
    pub losses: Vec<Loss>,
    /// Computations that were found wrong, since another one came to something else.
    pub differences: Vec<Difference>,
    /// Fragments that gained energy though nothing pushed them.
    pub runaways: Vec<Runaway>,
    /// Cycles that waited for states on their way, of this session of the run.
    pub waits: u64,
}
