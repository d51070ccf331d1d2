//! Every message: who sends it, when, and what comes back.
//!
//! A run, seen from one worker: `Pieces`, `Assign` -> `Ready`; `Start`; then per cycle `Cycle` -> `Totals`; at a sort,
//! `Plan` arrives ahead of its cycle and `Transfer` goes both ways at that cycle; `Pieces` and `WorkerState` when asked; at the end
//! `Pieces`, `Report` and `WorkerState` with `last`, then `Release`. On route direct `Peers` comes before `Assign`, and partial forces go
//! from worker to worker as [`ToPeer`].
//!
//! Where votes travel by a [`Tree`] of the workers, only its root sends the master [`ToMaster::Votes`] and hears `Totals`.
//!
//! A job that is dealt out anew - a worker was lost, one joined, speeds turned out to be others - sends a further
//! `Assign` of the next epoch, at any time; what the worker still does for the epoch before comes to nothing.
//!
//! Orders act with a lag that is the same on every route: the orders that answer cycle `n` give the time step of
//! cycle `n + 1` and what happens at the start of cycle `n + 2`.

use mechanics::{
    contact::{Census, PartBox, Patch, PlacedPatch},
    cycle::{Plan, Standing, Subdomain},
    exact::Quanta,
    piece::Piece,
    rigid,
    setup::Setup,
    vote::{Vote, Watched},
    wall::Pose,
};
use serde::{Deserialize, Serialize};
use std::net::SocketAddr;

use crate::{options::Route, phase::Report};

/// From the master to a worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToWorker {
    /// First of a job, and of each epoch of it: all that the worker holds, but for the pieces that came before. Answered by `Ready`.
    Assign(Box<Assign>),
    /// When every worker is ready: the orders for the first cycle and the one after.
    Start {
        /// `orders[0].next + 1` is the first cycle.
        orders: [Orders; 2],
    },
    /// A new plan, sent before the cycle it acts at.
    Plan {
        /// The cycle whose positions it was sorted from: a plan of a gathering that a later one replaced is dropped.
        gathered_at: u64,
        /// Start of this cycle.
        acts_at: u64,
        /// Whom this worker shares nodes with and what it computes.
        plan: Box<Plan>,
        /// Hash of the whole exchange plan; each frame of its cycles carries it.
        hash: u64,
        /// Where workers [sort](Sorting) themselves, whose patches are near: the batch of the plan is the one that this worker has sorted.
        around: Vec<Around>,
    },
    /// The answer to every worker's `Cycle` of one cycle.
    Totals {
        cycle: u64,
        /// What comes next.
        orders: Orders,
        /// Total forces of this worker's exchange nodes, as many numbers each as the plan says, and of its entries for rigid bodies.
        totals: Vec<f64>,
    },
    /// On route master: state of the ghosts of a plan that starts to act: of each position, velocity and what contact keeps of it.
    Transfer {
        /// The cycle at which the plan acts.
        cycle: u64,
        /// x, y, z, vx, vy, vz by ghost.
        state: Vec<f64>,
    },
    /// Partial forces of another worker that has no link of its own to this one (route direct, relayed).
    Relayed {
        /// The other worker's index in the job.
        from: u32,
        /// What it says.
        message: ToPeer,
    },
    /// The job is over or given up; the worker forgets it.
    Release,
    /// Before `Assign` on route direct: where the other workers of this job and epoch are found.
    Peers(Box<Introduction>),
    /// At any time, to a worker that [divides](crate::handshake::Hello::divides): how many threads it computes with from now on; with none, which
    /// only an idle one is told, its connection ends. Not answered.
    Threads {
        computes: u32,
        /// Those of its threads that are given to another connection, which its process opens; 0 for none.
        apart: u32,
    },
    /// The job has heard nothing for long, and of a tree it hears only the votes of all: a worker that waits answers with
    /// [`ToMaster::At`], one that computes or is stuck does not.
    Where,
    /// Before `Assign`: some of the pieces that the worker is to hold, in the order of its sub-domains, so that neither side needs room for all
    /// of them in one message.
    Pieces {
        /// The epoch of the assignment to come.
        epoch: u32,
        /// With the number of the sub-domain that each is of.
        pieces: Vec<(u32, Piece)>,
    },
}

/// Who computes a job, for links between its workers. Its frame names the job and the epoch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Introduction {
    /// The index of the worker that is told.
    pub me: u32,
    /// Known to the workers of this epoch alone; whoever dials shows it.
    pub secret: String,
    /// By index.
    pub peer_workers: Vec<PeerWorker>,
}

/// A worker as the others see it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeerWorker {
    /// Name of the host, for messages.
    pub name: String,
    /// Where it takes peers: the host as the master saw it, and its own word for the port; none where it takes none.
    pub address: Option<SocketAddr>,
    /// The incarnation that its frames carry.
    pub incarnation: u32,
}

/// From one worker to another, on route direct. Of one kind there is one for each cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToPeer {
    pub cycle: u64,
    pub what: Said,
}

/// What one worker says to another in a cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Said {
    /// To each neighbour of the plan.
    Partials {
        /// Partial forces of the nodes that both hold, as many numbers each as the plan says.
        partials: Vec<f64>,
        /// What goes up or down the [`Tree`] and would else be a frame of its own.
        aboard: Option<Box<Aboard>>,
    },
    /// To the parent in the tree: the votes of the sender and of all below it.
    Votes(BranchVote),
    /// To a child in the tree: the orders that answer the cycle.
    Orders(Orders),
    /// To a worker around, where the cycle gathers and workers [sort](Sorting) themselves: the faces that may be near its nodes.
    Patch(PlacedPatch),
    /// To each worker around, when the sender has sorted a gathering: nodes of their patch that it will have as ghosts, ascending.
    Wants(Vec<u32>),
    /// To each worker [beside](Sorting::beside) it, when all around have said what they want of it: nodes that both hold, ascending, and who
    /// wants each.
    Asked(Vec<(u32, u32)>),
    /// To each worker that wants nodes, when all beside have said what they were asked for.
    Shares(Shares),
    /// At the cycle where a plan starts to act: state of the ghosts that the sender gives, as in [`ToWorker::Transfer`].
    Transfer(Vec<f64>),
}

/// The kinds of [`Said`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SaidKind {
    Partials,
    Votes,
    Orders,
    Patch,
    Wants,
    Asked,
    Shares,
    Transfer,
}

/// What a worker is told of the nodes that it wants as ghosts.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shares {
    /// Nodes that are constrained, ascending, and the index of each one's constraint.
    pub constraints: Vec<(u32, u16)>,
    /// Nodes, ascending, and a worker that will have each beside the sender and the receiver.
    pub with: Vec<(u32, u32)>,
}

/// What partial forces carry along for the tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Aboard {
    /// To the parent, of a worker without children: its vote.
    Vote(BranchVote),
    /// To a child without children: the orders that answer the cycle before.
    Orders(Orders),
}

/// The votes of some workers for the cycle before, as one; the order of merging is no matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BranchVote {
    /// How many workers.
    pub workers: u32,
    /// None in the first cycle of an epoch.
    pub vote: Option<Box<Vote>>,
}

impl BranchVote {
    /// Joins the votes of other workers.
    pub fn merge(&mut self, other: Self) {
        self.workers = self.workers.saturating_add(other.workers);
        match (&mut self.vote, other.vote) {
            (Some(all), Some(vote)) => all.merge(&vote),
            (all @ None, vote) => *all = vote,
            (Some(_), None) => {}
        }
    }
}

impl Said {
    /// Its kind.
    pub const fn kind(&self) -> SaidKind {
        match self {
            Self::Partials { .. } => SaidKind::Partials,
            Self::Votes(_) => SaidKind::Votes,
            Self::Orders(_) => SaidKind::Orders,
            Self::Patch(_) => SaidKind::Patch,
            Self::Wants(_) => SaidKind::Wants,
            Self::Asked(_) => SaidKind::Asked,
            Self::Shares(_) => SaidKind::Shares,
            Self::Transfer(_) => SaidKind::Transfer,
        }
    }

    /// Whether a worker in cycle `now` may hear this of `cycle`. Neighbours are at most a cycle apart. A vote is waited for by the
    /// orders that both need two cycles later, and those go to workers that have sent theirs. Who sends the state of
    /// ghosts is about to do what others need of its cycle, and any two workers are at most two cycles apart. A patch, and what is
    /// said of the ghosts of a gathering, may be on their way for as long as the plan of that gathering is not due.
    pub const fn is_near(&self, cycle: u64, now: u64) -> bool {
        let ahead = cycle.wrapping_sub(now);
        match self.kind() {
            SaidKind::Partials => ahead <= 1,
            SaidKind::Votes => ahead.wrapping_add(1) <= 3,
            SaidKind::Orders => cycle <= now && now - cycle <= 1,
            SaidKind::Transfer => ahead.wrapping_add(3) <= 5,
            SaidKind::Patch | SaidKind::Wants | SaidKind::Asked | SaidKind::Shares => {
                now.wrapping_sub(cycle).wrapping_add(2) <= u32::MAX as u64
            }
        }
    }

    /// The votes in it.
    pub fn into_votes(self) -> Option<BranchVote> {
        match self {
            Self::Votes(votes) => Some(votes),
            Self::Partials { aboard, .. } => match *aboard? {
                Aboard::Vote(votes) => Some(votes),
                Aboard::Orders(_) => None,
            },
            Self::Orders(_)
            | Self::Patch(_)
            | Self::Wants(_)
            | Self::Asked(_)
            | Self::Shares(_)
            | Self::Transfer(_) => None,
        }
    }
}

/// A worker's place in the tree by which votes go up to the master and orders come down from it, on route direct.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tree {
    /// Whom it sends votes to; none for the master.
    pub parent: Option<u32>,
    /// Whose votes it waits for and whom it sends orders to; of each, whether it has no children itself.
    pub children: Vec<(u32, bool)>,
}

/// All that a worker holds of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Assign {
    /// How often the job has been dealt out anew before. An assignment of a later epoch replaces the one in hand.
    pub epoch: u32,
    /// Materials, contact, boundaries, control.
    pub setup: Setup,
    /// Number of parts of the problem.
    pub n_parts: u32,
    /// Quanta of the sums.
    pub quanta: Quanta,
    /// Sub-domains; their pieces have come before.
    pub subdomains: Vec<Subdomain>,
    /// How many pieces each sub-domain has.
    pub n_pieces: Vec<u32>,
    /// Global node of each gauge.
    pub gauges: Vec<u32>,
    /// Elements and contacts that votes are to speak of.
    pub watched: Watched,
    /// Lane width to use: `scalar`, `neon`, `avx2`, `avx512`; none for the best of the machine.
    pub lanes: Option<String>,
    /// The cycle to start at.
    pub cycle: u64,
    /// `dt` of the cycle before it; 0 at the start of a run.
    pub dt_previous: f64,
    /// How partial forces travel.
    pub route: Route,
    /// The first plan.
    pub plan: Plan,
    pub plan_hash: u64,
    pub ghost_state: Vec<f64>,
    /// Where the rigid bodies are and how they move: all of them, on every worker.
    pub bodies: Vec<rigid::State>,
    /// How votes and orders travel; none where every worker exchanges them with the master itself.
    pub tree: Option<Tree>,
    /// Where workers sort what they hold of the surface; none where the master sorts all.
    pub sorting: Option<Box<Sorting>>,
}

/// What a worker needs to sort the nodes that it owns: against its own faces, and those that workers around send it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sorting {
    /// What it holds of the surface.
    pub patch: Patch,
    /// Patch nodes that it sorts, ascending.
    pub sorted: Vec<u32>,
    /// Pairs (global node, face id) that never interact, of those nodes.
    pub excluded: Vec<(u32, u32)>,
    /// Whose patches are near by the positions at the start of the epoch.
    pub around: Vec<Around>,
    /// The exchange that ghosts of later plans add to.
    pub standing: Standing,
    /// The workers that hold nodes of the surface too, ascending.
    pub beside: Vec<u32>,
    /// Patch nodes (global, ascending) that are constrained, and the index of each one's constraint.
    pub constraints: Vec<(u32, u16)>,
}

/// A worker whose patch may come near, until the lists of another sort are in force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Around {
    /// Its index in the job.
    pub worker: u32,
    /// Where its patch was when positions were gathered for the lists in force.
    pub boxes: Vec<PartBox>,
}

/// What came of a worker's sort, for the master, when it knows with whom it shares which nodes by the plan to come.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SortedPatch {
    /// Surface nodes that it sorted, and all that it looked at, with those of other workers' faces and its ghosts again.
    pub nodes: [u64; 2],
    /// Of its units.
    pub census: Census,
    /// Where its patch was.
    pub boxes: Vec<PartBox>,
}

/// What the next cycles do; the same on every worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Orders {
    /// The cycle whose time step `dt` is.
    pub next: u64,
    /// `dt` of cycle `next` (time).
    pub dt: f64,
    /// When cycle `next` begins (time).
    pub time: f64,
    /// Poses of the walls of finite mass in cycle `next`, in the order of the walls.
    pub walls: Vec<Pose>,
    /// Quanta of the sums from cycle `next + 1` on.
    pub quanta: Quanta,
    /// At the start of cycle `next + 1`, the positions of surface nodes travel; the plan sorted from them acts a sort
    /// lag later.
    pub gather: bool,
    /// With `gather`: elements have eroded. The plan sorted from these positions has the new surface and acts in the cycle
    /// after, for which all wait; plans of earlier gatherings that would act later than cycle `next + 1` do not come any more.
    pub blocking: bool,
    /// At the start of cycle `next + 1`, states are sent.
    pub collect: bool,
    /// The run ends at the start of cycle `next + 1`.
    pub stop: bool,
    /// In cycle `next + 1`, a sample of what elements come to is sent.
    pub sample: bool,
}

/// The block of a worker's `n_blocks` that a sample of `cycle` is of; as good as random, and known to both sides.
pub const fn sampled_block(cycle: u64, n_blocks: usize) -> usize {
    let mut x = cycle.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^= x >> 31;
    if n_blocks == 0 { 0 } else { (x % n_blocks as u64) as usize }
}

/// From a worker to the master.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToMaster {
    /// The assignment stands; the vote of a preparing pass (none when the run resumes).
    Ready {
        /// Vote of the state as it is.
        vote: Option<Box<Vote>>,
        /// Lane width in use.
        lanes: String,
    },
    /// Once per cycle, when contact and border elements are done.
    Cycle {
        cycle: u64,
        /// The vote of the whole of the cycle before; none in the first cycle.
        vote: Option<Box<Vote>>,
        /// Partial forces of the exchange nodes, as many numbers each as the plan says, and of its entries for rigid bodies.
        partials: Vec<f64>,
        /// Positions of owned surface nodes where this cycle gathers; else empty.
        gathered: Vec<f64>,
        /// How long this worker has worked on its tasks so far, by the clock of its host (ns): what `--balance
        /// measured` goes by. Whoever drives the session fills it in.
        busy: Work,
    },
    /// Once per cycle from the root of a tree: the votes of all workers, where in `Cycle` they are one worker's.
    Votes { cycle: u64, votes: BranchVote },
    /// From each worker of a tree where the cycle gathers.
    Gathered {
        cycle: u64,
        /// Positions of owned surface nodes.
        positions: Vec<f64>,
    },
    /// From each worker that sorts itself, once its patch is sorted.
    Sorted {
        /// The cycle whose positions it was sorted from.
        gathered_at: u64,
        sorted: Box<SortedPatch>,
    },
    /// The answer to [`ToWorker::Where`].
    At {
        /// 0 without its domain, 1 when it is ready, `c + 2` when it has sent what others need of cycle `c`.
        position: u64,
    },
    /// For another worker that this one has no link to (route direct). Passed on as it is.
    Relay {
        /// The other worker's index in the job.
        to: u32,
        /// What to pass on.
        message: ToPeer,
    },
    /// On route master: state of the nodes that others will have as ghosts.
    Transfer {
        /// The cycle at which the plan acts.
        cycle: u64,
        /// By node of the plan's send list: position, velocity and what contact keeps of it.
        state: Vec<f64>,
    },
    /// Some of the pieces of a state at the start of a cycle, in the worker's order.
    Pieces {
        cycle: u64,
        /// Version of the form of a piece.
        version: u32,
        pieces: Vec<Piece>,
    },
    /// The state at the start of a cycle is whole: all its pieces have been sent.
    WorkerState {
        cycle: u64,
        /// Set at the end of the run, with the vote of the last cycle.
        last: Option<Box<Vote>>,
        /// What this worker's compute threads have used so far.
        work: Work,
    },
    /// What the elements of one block came to in a cycle, to be computed again by the master.
    Sample {
        cycle: u64,
        /// `mechanics::cycle::Domain::sample` of the block that [`sampled_block`] names; zeros of a worker without any.
        hash: [u8; 16],
    },
    /// Before the last `WorkerState`, and about once a second: how the worker's time went, from its runtime.
    Report(Box<Report>),
    /// The worker cannot go on.
    Failed {
        cycle: u64,
        /// Why: a sentence for the user.
        reason: String,
    },
    /// The worker wants to go: it computes on until it is released, a few cycles later.
    Leaving,
}

impl ToMaster {
    /// The same with `busy` filled in, where it is the frame of a cycle.
    #[must_use]
    pub fn stamped(mut self, worked: Work) -> Self {
        if let Self::Cycle { busy, .. } = &mut self {
            *busy = worked;
        }
        self
    }
}

/// Elements whose pieces travel in one message: with some 270 bytes an element a message of 27 MB. A longer piece has one to itself.
pub const ELEMENTS_AT_ONCE: usize = 100_000;

/// Groups of neighbours, each of at most [`ELEMENTS_AT_ONCE`] elements or of one alone.
pub fn at_once<T>(all: Vec<T>, n_elements: impl Fn(&T) -> usize) -> Vec<Vec<T>> {
    let mut groups: Vec<Vec<T>> = Vec::new();
    let mut room = 0;
    for one in all {
        let n = n_elements(&one);
        match groups.last_mut() {
            Some(group) if n <= room => {
                room -= n;
                group.push(one);
            }
            _ => {
                room = ELEMENTS_AT_ONCE.saturating_sub(n);
                groups.push(vec![one]);
            }
        }
    }
    groups
}

/// Version of [`Piece`] as it travels and is stored. 1: the fields of `mechanics::state::FIELDS` in their first order.
/// 2: with damage and the time until an explosive is lit behind them. 3: with what has eroded. 4: with artificial viscosity,
/// hourglass control and history variables of laws.
pub const WORKER_STATE_VERSION: u32 = 4;

/// Time that a worker has computed for (ns): of its threads in a state, of its host in the frame of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// All phases.
    pub compute_ns: u64,
    /// Of that, contact.
    pub contact_ns: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_travel_in_their_order_few_at_a_time_and_long_ones_alone() {
        let sizes = vec![40_000, 50_000, 10_000, 1, 250_000, 0, 99_999, 2];
        let groups = at_once(sizes, |&n| n);
        let expected = [vec![40_000, 50_000, 10_000], vec![1], vec![250_000, 0], vec![99_999], vec![2]];
        assert_eq!(groups, expected);
        assert!(at_once(Vec::<usize>::new(), |&n| n).is_empty());
    }
}
