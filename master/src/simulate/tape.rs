//! What the tasks and sorts of a run gave, so that its sessions can be driven again under other costs without computing.
//!
//! Partial forces are kept as their number alone: totals decide nothing that takes time, votes do.

use std::collections::VecDeque;

use mechanics::{
    contact::{BatchFace, BatchNode, Patch, PlacedPatch},
    cycle::{Load, Meter},
    vote::Vote,
};
use protocol::message::{SortedPatch, Work};
use worker::{
    compute::{Machine, ThreadClock},
    session::{Outcome, Task, Wanted},
};

use super::timeline::Kind;
use crate::sort::Sorted;

/// What a run gave, by worker in the order of its tasks.
#[derive(Clone, Default)]
pub struct Tape {
    /// Outcomes of each worker's tasks.
    pub workers: Vec<Vec<Taped>>,
    /// Outcomes of the sorts.
    pub sorts: Vec<Sorted>,
    /// Thread-CPU time of each sort by surface node (ns).
    pub sort_ns: Vec<f64>,
    /// Digest of the run's final state.
    pub digest: String,
}

/// One outcome: what it was, and what the worker held then.
#[derive(Clone)]
pub struct Taped {
    kind: Kind,
    load: Load,
    /// Thread-CPU time of the calling thread (ns).
    used_ns: u64,
    kept: Kept,
}

impl Taped {
    /// What the task was.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// What the worker held then.
    pub fn load(&self) -> Load {
        self.load
    }

    /// Thread-CPU time of the thread that drove the task (ns): all of it where tasks run on one thread.
    pub fn used_ns(&self) -> u64 {
        self.used_ns
    }
}

#[derive(Clone)]
enum Kept {
    Loaded(Option<Box<Vote>>, String),
    Transferred(usize),
    Computed,
    Forces(usize, usize),
    Integrated(Box<Vote>),
    WorkerState,
    Sampled([u8; 16]),
    /// By receiver.
    Spread(Vec<(u32, KeptPatch)>),
    Sorted(u64, Box<SortedPatch>, Vec<Wanted>),
}

/// The size of a patch: a node and a face of it, and how many there are.
#[derive(Clone)]
struct KeptPatch {
    node: Option<BatchNode>,
    face: Option<BatchFace>,
    numbers: [usize; 2],
}

impl KeptPatch {
    fn of(PlacedPatch { patch, .. }: &PlacedPatch) -> Self {
        let numbers = [patch.nodes.len(), patch.faces.len()];
        Self { node: patch.nodes.last().copied(), face: patch.faces.last().copied(), numbers }
    }

    /// As long as it was, and as sound. Nobody sorts it.
    fn give(self) -> PlacedPatch {
        let [nodes, faces] = self.numbers;
        // The last number is the highest.
        let ends_at = |last: u32, n: usize| (last + 1).saturating_sub(n as u32)..=last;
        let nodes_of = |node: BatchNode| {
            ends_at(node.global, nodes).map(|global| BatchNode { global, ..node }).collect()
        };
        let faces_of = |face: BatchFace| {
            let mut faces = vec![face; faces];
            ends_at(face.id, faces.len()).zip(&mut faces).for_each(|(id, face)| face.id = id);
            faces
        };
        let patch = Patch {
            nodes: self.node.map(nodes_of).unwrap_or_default(),
            faces: self.face.map(faces_of).unwrap_or_default(),
        };
        PlacedPatch { patch, x: vec![[0.0; 3]; nodes] }
    }
}

impl Kept {
    /// Whether it can be the outcome of a task.
    fn answers(&self, task: &Task) -> bool {
        matches!(
            (self, task),
            (Self::Loaded(..), Task::Load { .. })
                | (Self::Transferred(_), Task::Transfer { .. })
                | (Self::Computed, Task::Elements { .. } | Task::Interior { .. })
                | (Self::Forces(..), Task::Install { .. } | Task::Border { .. })
                | (Self::Integrated(_), Task::Integrate { .. })
                | (Self::WorkerState, Task::WorkerState { .. })
                | (Self::Sampled(_), Task::Sample { .. })
                | (Self::Spread(_), Task::Spread { .. })
                | (Self::Sorted(..), Task::Sort { .. })
        )
    }
}

/// Whether a task is one of a sort: those come between the others whenever messages have arrived, in an order of their own.
fn is_of_sort(task: &Task) -> [bool; 2] {
    [matches!(task, Task::Spread { .. }), matches!(task, Task::Sort { .. })]
}

/// A worker's part in a run: computes, or plays a tape.
pub enum Player {
    /// Computes and keeps what came of it.
    Live {
        /// The domain.
        machine: Box<Machine>,
        /// What the domain holds.
        load: Load,
        /// What came of its tasks so far.
        kept: Vec<Taped>,
    },
    /// Plays what another run kept.
    Tape(VecDeque<Taped>),
}

impl Player {
    pub fn live() -> Self {
        Self::Live { machine: Box::default(), load: Load::default(), kept: Vec::new() }
    }

    /// Does a task: its outcome and what the worker holds with it.
    ///
    /// # Errors
    /// The sentence of a task that failed, or that the tape is of another run.
    pub fn run(&mut self, task: Task) -> Result<(Outcome, Load), String> {
        match self {
            Self::Live { machine, load, kept } => {
                // Elements erode where it integrates.
                let builds =
                    matches!(task, Task::Load { .. } | Task::Install { .. } | Task::Integrate { .. });
                let kind = Kind::of(&task);
                let clock = ThreadClock::default();
                let mark = clock.start();
                let outcome = machine.run(task);
                clock.stop(mark, false);
                if builds {
                    *load = machine.load();
                }
                let used_ns = clock.work().compute_ns;
                kept.push(Taped { kind, load: *load, used_ns, kept: keep(&outcome)? });
                Ok((outcome, *load))
            }
            Self::Tape(left) => {
                let of_sort = is_of_sort(&task);
                let kind = |kept: &Kept| [matches!(kept, Kept::Spread(_)), matches!(kept, Kept::Sorted(..))];
                let next = left.iter().position(|taped| kind(&taped.kept) == of_sort);
                let next = next.and_then(|next| left.remove(next));
                // The run that was taped may have ended before this sort, whose plan would act after the end.
                if let (None, Task::Sort { gathered_at, .. }) = (&next, &task) {
                    let sorted = Box::new(SortedPatch::default());
                    let (gathered_at, wants) = (*gathered_at, Vec::new());
                    return Ok((Outcome::Sorted { gathered_at, sorted, wants }, Load::default()));
                }
                let Taped { load, kept, .. } = next.ok_or("the tape of a run is shorter than the run")?;
                if !kept.answers(&task) {
                    return Err("the tape is of a run with other sorts: report this as a bug".to_owned());
                }
                Ok((give(kept), load))
            }
        }
    }
}

fn keep(outcome: &Outcome) -> Result<Kept, String> {
    Ok(match outcome {
        Outcome::Loaded { vote, lanes } => Kept::Loaded(vote.clone(), lanes.clone()),
        Outcome::Transferred(state) => Kept::Transferred(state.len()),
        Outcome::Computed => Kept::Computed,
        Outcome::Forces { partials, gathered } => Kept::Forces(partials.len(), gathered.len()),
        Outcome::Integrated(vote) => Kept::Integrated(vote.clone()),
        Outcome::WorkerState { .. } => Kept::WorkerState,
        Outcome::Sampled(hash) => Kept::Sampled(*hash),
        Outcome::Spread(patches) => {
            Kept::Spread(patches.iter().map(|(to, patch)| (*to, KeptPatch::of(patch))).collect())
        }
        Outcome::Sorted { gathered_at, sorted, wants } => {
            Kept::Sorted(*gathered_at, sorted.clone(), wants.clone())
        }
        Outcome::Failed(reason) => return Err(reason.clone()),
    })
}

fn give(kept: Kept) -> Outcome {
    match kept {
        Kept::Loaded(vote, lanes) => Outcome::Loaded { vote, lanes },
        Kept::Transferred(n) => Outcome::Transferred(vec![0.0; n]),
        Kept::Computed => Outcome::Computed,
        Kept::Forces(partials, gathered) => {
            Outcome::Forces { partials: vec![0.0; partials], gathered: vec![0.0; gathered] }
        }
        Kept::Integrated(vote) => Outcome::Integrated(vote),
        Kept::Sampled(hash) => Outcome::Sampled(hash),
        Kept::Spread(patches) => {
            Outcome::Spread(patches.into_iter().map(|(to, patch)| (to, patch.give())).collect())
        }
        Kept::Sorted(gathered_at, sorted, wants) => Outcome::Sorted { gathered_at, sorted, wants },
        Kept::WorkerState => Outcome::WorkerState { pieces: Vec::new(), work: Work::default() },
    }
}
