//! FAILPOINT: faults on purpose in real processes: the environment variable `BOLIDE_FAIL` names where and when. The binary
//! `bolide-under-test` has them; `bolide` itself has none.
//!
//! `name:N`, several separated by commas: at cycle N for what happens in cycles, at the Nth time for what else is
//! named. It is read once; without it nothing happens and nothing is counted.

use std::{
    fmt,
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    },
};

use mechanics::flip::Target;
use tracing::{
    Event, Subscriber,
    field::{Field, Visit},
};
use tracing_subscriber::{Layer, layer::Context};
use worker::{
    compute::Machine,
    session::{Outcome, Task},
};

/// The environment variable.
pub const VARIABLE: &str = "BOLIDE_FAIL";

struct Point {
    name: String,
    at: u64,
    passed: AtomicU64,
}

fn points() -> &'static [Point] {
    static POINTS: OnceLock<Vec<Point>> = OnceLock::new();
    POINTS.get_or_init(|| {
        let text = std::env::var(VARIABLE).unwrap_or_default();
        let point = |item: &str| {
            let (name, at) = item.split_once(':')?;
            Some(Point { name: name.to_owned(), at: at.parse().ok()?, passed: AtomicU64::new(0) })
        };
        text.split(',').filter_map(point).collect()
    })
}

/// Whether the fault of this name is due at its Nth passing.
pub fn passes(name: &str) -> bool {
    points().iter().any(|p| p.name == name && p.passed.fetch_add(1, Ordering::Relaxed) + 1 == p.at)
}

/// Whether the fault of this name is due in this cycle; each is due once.
pub fn in_cycle(name: &str, cycle: u64) -> bool {
    points().iter().any(|p| p.name == name && cycle >= p.at && p.passed.fetch_add(1, Ordering::Relaxed) == 0)
}

/// Whether the fault of this name is due in this cycle, every time it comes.
pub fn at_cycle(name: &str, cycle: u64) -> bool {
    points().iter().any(|p| p.name == name && cycle == p.at)
}

/// Whether the fault of this name is due in this cycle and all later ones.
pub fn from_cycle(name: &str, cycle: u64) -> bool {
    points().iter().any(|p| p.name == name && cycle >= p.at)
}

/// Ends the process as `kill -9` would, if this fault is due.
pub fn die(name: &str) {
    if passes(name) {
        system::children::die();
    }
}

/// Computes a task of a worker, with the faults that are due.
pub fn compute(machine: &mut Machine, task: Task, cycle: u64) -> Outcome {
    let name = match &task {
        Task::Load { .. } => "die-in-load",
        Task::Transfer { .. } => "die-in-transfer",
        Task::Elements { .. } => "die-in-elements",
        Task::Install { .. } => "die-in-install",
        Task::Border { .. } => "die-in-border",
        Task::Interior { .. } => "die-in-interior",
        Task::Integrate { .. } => "die-in-integrate",
        Task::WorkerState { .. } => "die-in-image",
        Task::Sample { .. } => "die-in-sample",
        Task::Spread { .. } => "die-in-spread",
        Task::Sort { .. } => "die-in-sort",
    };
    die(name);
    if matches!(task, Task::Load { .. }) && passes("stick-in-load") || in_cycle("stick", cycle) {
        // The link lives on in threads of its own.
        loop {
            std::thread::park();
        }
    }
    if let Task::Border { gather: true, .. } | Task::Install { gather: true, .. } = &task {
        die("die-in-gather");
    }
    if in_cycle("panic", cycle) || at_cycle("panic-always", cycle) {
        panic!("a panic that a test has ordered");
    }
    let mut outcome = machine.run(task);
    match &mut outcome {
        Outcome::Computed if from_cycle("ulp", cycle) => machine.plant_fault(),
        Outcome::Computed if in_cycle("flip", cycle) => {
            // The volume of an element, which is not zero.
            machine.flip_bit(Target::Constants, 100, 40);
        }
        Outcome::Integrated(vote) if in_cycle("lie", cycle) => {
            // Samples are of elements and do not show it.
            let lie = |energy: f64| f64::from_bits(energy.to_bits() ^ 1 << 30);
            vote.parts.iter_mut().for_each(|part| part.kinetic = lie(part.kinetic));
        }
        Outcome::Integrated(vote) if in_cycle("nan-vote", cycle) => {
            vote.parts.iter_mut().for_each(|part| part.internal = f64::NAN);
        }
        Outcome::Forces { partials, .. } if !partials.is_empty() && in_cycle("nan-force", cycle) => {
            partials[0] = f64::NAN;
        }
        _ => {}
    }
    outcome
}

/// Moments of a master, by what it traces, and the fault that ends it there.
const MOMENTS: [(&str, &str); 3] = [
    ("sort begins", "die-in-sort"),
    ("first chunk of a snapshot written", "die-in-snapshot"),
    ("snapshot whole, not yet in the manifest", "die-before-manifest"),
];

/// Listens to what the process traces and ends it at the moments that were ordered.
pub struct Watcher;

impl<S: Subscriber> Layer<S> for Watcher {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut words = Words(String::new());
        event.record(&mut words);
        if let Some((_, name)) = MOMENTS.iter().find(|(moment, _)| *moment == words.0) {
            die(name);
        }
    }
}

/// The message of an event.
struct Words(String);

impl Visit for Words {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}
