//! Processor time of a thread; the time of day where this machine stands.
//!
//! Times of threads come in steps of 15.6 ms here; only their processor cycles are exact. How long a cycle takes is measured once.

use std::{
    sync::OnceLock,
    time::{Duration, Instant},
};

use windows_sys::Win32::{
    Foundation::{FILETIME, SYSTEMTIME},
    System::{
        SystemInformation::GetLocalTime,
        Threading::{GetCurrentThread, GetThreadTimes},
        WindowsProgramming::QueryThreadCycleTime,
    },
};

/// The length of one measurement of a cycle, and their number. A thread that is interrupted counts fewer cycles, so the one with the most counts.
const MEASUREMENT: Duration = Duration::from_millis(1);
const MEASUREMENTS: usize = 5;

/// Processor time of the calling thread so far (ns).
pub fn thread_cpu_ns() -> u64 {
    static NS_PER_CYCLE: OnceLock<Option<f64>> = OnceLock::new();
    match (NS_PER_CYCLE.get_or_init(ns_per_cycle), cycles()) {
        (Some(ns), Some(cycles)) => (cycles as f64 * ns) as u64,
        _ => in_steps(),
    }
}

/// None on a system that does not count cycles, as wine 8.
fn ns_per_cycle() -> Option<f64> {
    let mut most = 0.0_f64;
    for _ in 0..MEASUREMENTS {
        let (from, start) = (cycles()?, Instant::now());
        while start.elapsed() < MEASUREMENT {}
        most = most.max((cycles()? - from) as f64 / start.elapsed().as_nanos() as f64);
    }
    (most > 0.0).then(|| 1.0 / most)
}

/// Cycles of the calling thread so far.
fn cycles() -> Option<u64> {
    let mut cycles = 0;
    // SAFETY: the handle of the calling thread is always good, and the number is ours.
    let done = unsafe { QueryThreadCycleTime(GetCurrentThread(), &raw mut cycles) };
    (done != 0).then_some(cycles)
}

/// Time in the system and outside it (ns).
fn in_steps() -> u64 {
    let [mut created, mut ended, mut kernel, mut user] = [FILETIME::default(); 4];
    // SAFETY: the handle of the calling thread is always good, and the four times are ours.
    unsafe {
        GetThreadTimes(GetCurrentThread(), &raw mut created, &raw mut ended, &raw mut kernel, &raw mut user);
    }
    let ns = |time: FILETIME| 100 * (u64::from(time.dwHighDateTime) << 32 | u64::from(time.dwLowDateTime));
    ns(kernel) + ns(user)
}

/// Minutes since Monday began, where this machine stands.
pub fn minute_of_week() -> u32 {
    let mut local = SYSTEMTIME::default();
    // SAFETY: the structure is ours.
    unsafe { GetLocalTime(&raw mut local) };
    (u32::from(local.wDayOfWeek) + 6) % 7 * 24 * 60 + u32::from(local.wHour) * 60 + u32::from(local.wMinute)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_of_this_thread_counts_and_never_runs_back() {
        let mut last = thread_cpu_ns();
        let start = last;
        while last < start + 40_000_000 {
            let now = thread_cpu_ns();
            assert!(now >= last, "{now} after {last}");
            last = now;
        }
    }

    #[test]
    fn a_week_has_so_many_minutes() {
        assert!(minute_of_week() < 7 * 24 * 60);
    }
}
