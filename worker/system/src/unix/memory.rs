//! How much memory there is.

use std::fs;

use rustix::process::{Resource, getrlimit};

/// What this process may ever have (bytes).
pub fn whole() -> Option<u64> {
    let limits = [field("/proc/meminfo", "MemTotal:"), cgroup("memory.max"), getrlimit(Resource::As).current];
    limits.into_iter().flatten().min()
}

/// What it may still take (bytes).
pub fn available() -> Option<u64> {
    let beside = |limit: Option<u64>, used: Option<u64>| Some(limit?.saturating_sub(used?));
    let left = [
        field("/proc/meminfo", "MemAvailable:"),
        beside(cgroup("memory.max"), used_by_group()),
        beside(getrlimit(Resource::As).current, field("/proc/self/status", "VmSize:")),
    ];
    left.into_iter().flatten().min()
}

/// What this process's control group holds and the system cannot take back at once: not the cache of files.
fn used_by_group() -> Option<u64> {
    let text = group_file("memory.stat")?;
    let lines = text.lines().filter_map(|line| line.split_once(' '));
    let back =
        lines.filter(|(name, _)| matches!(*name, "active_file" | "inactive_file" | "slab_reclaimable"));
    let back = back.filter_map(|(_, bytes)| bytes.trim().parse().ok()).fold(0_u64, u64::saturating_add);
    Some(cgroup("memory.current")?.saturating_sub(back))
}

/// A line of a file of Linux that states kilobytes.
fn field(path: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// A number of this process's control group, which may have none.
fn cgroup(name: &str) -> Option<u64> {
    group_file(name)?.trim().parse().ok()
}

/// A file of this process's control group.
fn group_file(name: &str) -> Option<String> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let group = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    fs::read_to_string(format!("/sys/fs/cgroup{group}/{name}")).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linux_says_what_there_is() {
        let (whole, available) = (whole().expect("Linux"), available().expect("Linux"));
        assert!(available <= whole && available > 0, "{available} of {whole}");
    }
}
