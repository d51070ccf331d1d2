//! What a run under a virtual clock shows: what hosts did when, what travelled, and averages of it.

use mechanics::cycle::Load;
use worker::session::Task;

use crate::incident::{Loss, Rebalance};

/// Seconds of a worker's cycle by what they went into, at the speed of its host.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Phases {
    /// Elements before the partial forces leave.
    pub border: f64,
    pub contact: f64,
    /// Elements while partial forces travel.
    pub interior: f64,
    /// Processor time of messages, at both ends.
    pub send: f64,
    pub integrate: f64,
    /// Everything else: waiting, and on host 1 the master's work.
    pub wait: f64,
}

impl Phases {
    /// Processor time in it (s).
    pub fn busy(&self) -> f64 {
        self.border + self.contact + self.interior + self.send + self.integrate
    }
}

/// What a host does for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Building the domain.
    Load,
    /// State of nodes for other workers.
    Transfer,
    /// All elements, at a plan boundary.
    Elements,
    /// A new plan, and contact by it.
    Install,
    /// Contact and border elements.
    Border,
    /// Interior elements.
    Interior,
    Integrate,
    /// A state, or a sample of what elements came to.
    WorkerState,
    /// The master or a worker sorts, or the master makes plans of what workers have sorted.
    Sort,
    /// A message leaves.
    Send,
    /// A message comes in.
    Receive,
}

impl Kind {
    pub fn of(task: &Task) -> Self {
        match task {
            Task::Load { .. } => Kind::Load,
            Task::Transfer { .. } => Kind::Transfer,
            Task::Elements { .. } => Kind::Elements,
            Task::Install { .. } => Kind::Install,
            Task::Border { .. } => Kind::Border,
            Task::Interior { .. } => Kind::Interior,
            Task::Integrate { .. } => Kind::Integrate,
            Task::WorkerState { .. } | Task::Sample { .. } => Kind::WorkerState,
            Task::Spread { .. } | Task::Sort { .. } => Kind::Sort,
        }
    }
}

/// Something a host did, for pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Host, from 0.
    pub host: usize,
    /// The master's work, not the worker's.
    pub master: bool,
    pub kind: Kind,
    /// The worker's cycle.
    pub cycle: u64,
    /// From, to (s).
    pub time: (f64, f64),
    /// Number of the message that leaves or comes in.
    pub message: Option<u64>,
}

/// A message as it travelled between two hosts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Number of the message.
    pub message: u64,
    /// Hosts, from 0.
    pub hosts: (usize, usize),
    /// The cycle it belongs to: that of its sender, or of the receiver if the master sent it.
    pub cycle: u64,
    /// Bytes with the frames' headers, without those of packets.
    pub bytes: u64,
    /// Handed to the processor of the sender; all of it at the receiver (s).
    pub time: (f64, f64),
}

/// What was worked on in one cycle, by all workers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    pub elements: u64,
    /// Nodes, copies included.
    pub nodes: u64,
    pub pairs: u64,
    /// Pairs of plans that start to act.
    pub searched: u64,
    /// Surface nodes sorted, where this cycle gathered.
    pub sorted: u64,
}

/// What a run under a virtual clock shows.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    /// By worker and cycle: when the cycle ended (s).
    pub ends: Vec<Vec<f64>>,
    /// By worker and cycle.
    pub phases: Vec<Vec<Phases>>,
    /// By cycle.
    pub counts: Vec<Counts>,
    /// Cycles at which plans began to act.
    pub boundaries: Vec<u64>,
    /// What hosts did.
    pub spans: Vec<Span>,
    /// Messages between hosts.
    pub flights: Vec<Flight>,
    /// When work was dealt out by other speeds.
    pub rebalances: Vec<Rebalance>,
    /// Hosts that were lost.
    pub losses: Vec<Loss>,
    /// Digest of the final state.
    pub digest: String,
}

impl Timeline {
    /// Enters a task of a worker on a host of `speed`: what it costs at speed 1 and what it works on.
    pub fn enter(
        &mut self,
        (worker, cycle): (usize, u64),
        (kind, load): (Kind, &Load),
        costs: &Phases,
        speed: f64,
    ) {
        if matches!(kind, Kind::Load) {
            return;
        }
        let phases = phases_at(&mut self.phases[worker], cycle);
        phases.border += costs.border / speed;
        phases.contact += costs.contact / speed;
        phases.interior += costs.interior / speed;
        phases.integrate += costs.integrate / speed;
        if kind == Kind::WorkerState {
            return;
        }
        let counts = counts_at(&mut self.counts, cycle);
        match kind {
            Kind::Elements => counts.elements += load.border + load.interior,
            Kind::Border => {
                counts.elements += load.border;
                counts.pairs += load.pairs;
            }
            Kind::Interior => counts.elements += load.interior,
            Kind::Install => {
                counts.pairs += load.pairs;
                counts.searched += load.pairs;
            }
            Kind::Integrate => counts.nodes += load.nodes,
            _ => {}
        }
    }

    /// Enters the end of a worker's cycle (s); what was not busy is waiting.
    pub fn end_cycle(&mut self, worker: usize, cycle: u64, now: f64) {
        let ends = &mut self.ends[worker];
        let wall = now - ends.last().copied().unwrap_or(0.0);
        // What a run that went back does again counts when it is done again; cycles before a host joined are the others'.
        ends.truncate(cycle as usize);
        ends.resize(cycle as usize, 0.0);
        ends.push(now);
        let phases = phases_at(&mut self.phases[worker], cycle);
        phases.wait = (wall - phases.busy()).max(0.0);
    }

    /// The cycles that averages are taken over: from the first plan boundary to the last if there are several, so that
    /// sorts weigh at their real rate; else without the first two. The last two are never among them: the first workers to end
    /// send their final states while others are up to two cycles behind, and the master's host handles those instead of frames.
    pub fn window(&self) -> std::ops::Range<u64> {
        let n = self.counts.len() as u64;
        let first = 2.min(n.saturating_sub(1));
        let last = n.saturating_sub(2).max(n.min(first + 1));
        let within: Vec<u64> = self.boundaries.iter().copied().filter(|b| (2..=last).contains(b)).collect();
        match (within.first(), within.last()) {
            (Some(&first), Some(&last)) if last > first => first..last,
            _ => first..last,
        }
    }

    /// When the slowest worker had ended the cycles before `cycle` (s).
    pub fn reached(&self, cycle: u64) -> f64 {
        let Some(index) = (cycle as usize).checked_sub(1) else { return 0.0 };
        self.ends.iter().filter_map(|ends| ends.get(index)).copied().fold(0.0, f64::max)
    }

    /// Mean time of a cycle over the window (s).
    pub fn seconds_per_cycle(&self) -> f64 {
        let window = self.window();
        let cycles = (window.end - window.start).max(1) as f64;
        (self.reached(window.end) - self.reached(window.start)) / cycles
    }

    /// Mean bytes between hosts in a cycle of the window.
    pub fn bytes_per_cycle(&self) -> f64 {
        self.bytes_between(|_, _| true)
    }

    /// Mean bytes in a cycle of the window between hosts that are `apart`.
    pub fn bytes_between(&self, apart: impl Fn(usize, usize) -> bool) -> f64 {
        let window = self.window();
        let sent = self.flights.iter().filter(|f| window.contains(&f.cycle) && apart(f.hosts.0, f.hosts.1));
        sent.map(|f| f.bytes).sum::<u64>() as f64 / (window.end - window.start).max(1) as f64
    }

    /// Work per cycle of the window: elements, nodes, pairs, pairs of new plans, surface nodes sorted.
    pub fn work_per_cycle(&self) -> [f64; 5] {
        let window = self.window();
        let mut sum = [0.0; 5];
        for counts in &self.counts[window.start as usize..window.end as usize] {
            let Counts { elements, nodes, pairs, searched, sorted } = *counts;
            for (sum, count) in sum.iter_mut().zip([elements, nodes, pairs, searched, sorted]) {
                *sum += count as f64;
            }
        }
        sum.map(|s| s / (window.end - window.start).max(1) as f64)
    }

    /// Mean phases of a worker over the window.
    pub fn mean_phases(&self, worker: usize) -> Phases {
        let window = self.window();
        let cycles = (window.end - window.start).max(1) as f64;
        let mut mean = Phases::default();
        // A host may have come later or gone earlier.
        let there = self.phases[worker].iter().take(window.end as usize);
        for p in there.skip(window.start as usize) {
            mean.border += p.border / cycles;
            mean.contact += p.contact / cycles;
            mean.interior += p.interior / cycles;
            mean.send += p.send / cycles;
            mean.integrate += p.integrate / cycles;
            mean.wait += p.wait / cycles;
        }
        mean
    }
}

/// The phases of a cycle, made where there are none yet.
pub fn phases_at(phases: &mut Vec<Phases>, cycle: u64) -> &mut Phases {
    if phases.len() <= cycle as usize {
        phases.resize(cycle as usize + 1, Phases::default());
    }
    &mut phases[cycle as usize]
}

/// The counts of a cycle, made where there are none yet.
pub fn counts_at(counts: &mut Vec<Counts>, cycle: u64) -> &mut Counts {
    if counts.len() <= cycle as usize {
        counts.resize(cycle as usize + 1, Counts::default());
    }
    &mut counts[cycle as usize]
}
