//! What happens to a session, and what it wants done.

use mechanics::{contact::PlacedPatch, cycle::Plan, exact::Quanta, piece::Piece, vote::Vote, wall::Pose};
use protocol::message::{Around, Assign, SortedPatch, ToMaster, ToPeer, ToWorker, Work};

/// What happens to a session.
#[derive(Debug)]
pub enum Event {
    /// A message from the master, in the order it was sent.
    Message(ToWorker),
    /// A message from another worker of the job, by its index.
    Peer(u32, ToPeer),
    /// A task is done.
    Done(Outcome),
}

/// What a session wants done.
#[derive(Debug)]
pub enum Action {
    Send(ToMaster),
    /// Send to another worker of the job, over a link of our own or through the master.
    SendPeer(u32, ToPeer),
    /// Compute; exactly one [`Event::Done`] answers it.
    Compute(Task),
    /// The job is over: drop the domain.
    Forget,
}

/// Work on the domain. `dt_previous` is `dt_{n-1}`, the step that led to `x_n` (time).
#[derive(Debug)]
pub enum Task {
    /// Build the domain and install the first plan.
    Load {
        /// All that this worker holds.
        assign: Box<Assign>,
        /// Ask for the vote of a preparing pass.
        prepare: bool,
    },
    /// State of nodes for other workers.
    Transfer {
        /// Global node indices.
        nodes: Vec<u32>,
    },
    /// All element sets at `x_n`, before a new plan is in force.
    Elements {
        /// The step before.
        dt_previous: f64,
        /// Quanta of the sums from now on.
        quanta: Quanta,
        /// When the cycle begins.
        time: f64,
    },
    /// Install a plan; contact; partial forces.
    Install {
        plan: Box<Plan>,
        /// Where workers sort themselves: the gathering whose own sort is the plan's batch, and who is around now.
        sorted: Option<(u64, Vec<Around>)>,
        /// By ghost: position, velocity and what contact keeps of it.
        ghost_state: Vec<f64>,
        /// The step before.
        dt_previous: f64,
        /// Gather positions then.
        gather: bool,
        /// This gathering replaces those whose plans have not acted.
        blocking: bool,
    },
    /// Contact, border elements, partial forces.
    Border {
        /// The step before.
        dt_previous: f64,
        /// Quanta of the sums from now on.
        quanta: Quanta,
        /// When the cycle begins.
        time: f64,
        /// Gather positions first.
        gather: bool,
        /// This gathering replaces those whose plans have not acted.
        blocking: bool,
    },
    /// Interior elements.
    Interior {
        /// The step before.
        dt_previous: f64,
    },
    /// Totals in place, integrate.
    Integrate {
        /// As many numbers as the plan says by node of the exchange.
        totals: Vec<f64>,
        /// The step before.
        dt_previous: f64,
        /// The step to take.
        dt: f64,
        /// Poses of the walls of finite mass in this cycle.
        walls: Vec<Pose>,
    },
    /// State of all sub-domains.
    WorkerState {
        /// Nothing is computed on them after that.
        last: bool,
    },
    /// What elements came to in this cycle, in one block.
    Sample { cycle: u64 },
    /// What of this worker's patch is near others, at the start of this cycle.
    Spread { cycle: u64 },
    /// The sort of this worker's patch.
    Sort {
        /// The cycle whose positions it is of.
        gathered_at: u64,
        /// What the workers around have sent, and who.
        patches: Vec<(u32, PlacedPatch)>,
    },
}

/// A node of another worker's patch that a sort wants as a ghost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Global node index.
    pub node: u32,
    /// Nodal mass.
    pub mass: f64,
    /// The worker around whose patch it is of; the first, of several.
    pub from: u32,
}

/// What came of a task.
#[derive(Debug)]
pub enum Outcome {
    Loaded {
        /// Of the preparing pass, if one was asked for.
        vote: Option<Box<Vote>>,
        /// Lane width in use.
        lanes: String,
    },
    /// Of `Transfer`: by node position, velocity and what contact keeps of it.
    Transferred(Vec<f64>),
    Computed,
    Forces {
        /// As many numbers as the plan says by node of the exchange.
        partials: Vec<f64>,
        /// Three numbers by owned surface node, if asked for.
        gathered: Vec<f64>,
    },
    Integrated(Box<Vote>),
    WorkerState {
        /// The state.
        pieces: Vec<Piece>,
        /// Compute time so far.
        work: Work,
    },
    Sampled([u8; 16]),
    /// What goes to which worker.
    Spread(Vec<(u32, PlacedPatch)>),
    Sorted {
        /// The cycle whose positions it was sorted from.
        gathered_at: u64,
        sorted: Box<SortedPatch>,
        /// By ascending node.
        wants: Vec<Wanted>,
    },
    /// The task failed: a sentence for the user.
    Failed(String),
}
