//! Processor time of a thread.

use rustix::time::{ClockId, clock_gettime};

/// Processor time of the calling thread so far (ns).
pub fn thread_cpu_ns() -> u64 {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}
