//! Faults on purpose, for tests of real processes: the environment variable `BOLIDE_FAIL` names where and when.
//!
//! `name:N`, several separated by commas: at cycle N for what happens in cycles, at the Nth time for what else is
//! named. It is read once; without it nothing happens and nothing is counted.

use std::sync::{
    OnceLock,
    atomic::{AtomicU64, Ordering},
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
        // A process may always send itself a signal; this one returns to nobody.
        let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
    }
}
