//! Processor time of a thread; the time of day where this machine stands.

use rustix::time::{ClockId, clock_gettime};

/// Processor time of the calling thread so far (ns).
pub fn thread_cpu_ns() -> u64 {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}

/// Minutes since Monday began, where this machine stands; in UTC if the system does not know where that is.
pub fn minute_of_week() -> u32 {
    let now = clock_gettime(ClockId::Realtime).tv_sec;
    // SAFETY: all fields are numbers, or a pointer to a name that is not read.
    let mut local: libc::tm = unsafe { std::mem::zeroed() };
    // SAFETY: both are ours; the function is the one that may be called from any thread.
    let known = unsafe { !libc::localtime_r(&raw const now, &raw mut local).is_null() };
    if !known {
        // The first day of 1970 was a Thursday.
        return ((now / 60 + 3 * 24 * 60).rem_euclid(7 * 24 * 60)) as u32;
    }
    ((local.tm_wday + 6) % 7 * 24 * 60 + local.tm_hour * 60 + local.tm_min) as u32
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    #[test]
    fn a_week_has_the_minutes_that_date_shows() {
        let minute = || {
            let date = Command::new("date").arg("+%u %H %M").output().expect("date");
            let text = String::from_utf8(date.stdout).expect("numbers");
            let numbers: Vec<u32> = text.split_whitespace().map(|n| n.parse().expect("a number")).collect();
            (numbers[0] - 1) * 24 * 60 + numbers[1] * 60 + numbers[2]
        };
        let (before, ours, after) = (minute(), super::minute_of_week(), minute());
        assert!(ours == before || ours == after, "{before} {ours} {after}");
    }
}
