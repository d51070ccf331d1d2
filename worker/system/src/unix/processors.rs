//! Which processors threads may use, and how urgent a thread is.

use std::{collections::HashSet, fs, io, path::Path};

#[cfg(target_os = "linux")]
use linux::{allowed, confine, lower_thread};
#[cfg(not(target_os = "linux"))]
use other::{allowed, confine, lower_thread};

/// The one of a program that steps back for others.
const LOW: i32 = 10;

/// Gives the calling thread the lowest priority of the machine's ordinary ones, for good: it runs on what others leave
/// idle. A machine that refuses leaves it as it was.
pub fn lowest_priority() {
    lower_thread();
}

/// Gives this process, before it starts threads, a priority at which it gets a tenth of a processor that another program wants, and all of one that
/// none does.
pub fn low_priority_of_process() {
    let now = rustix::process::getpriority_process(None).unwrap_or(0);
    if now < LOW {
        let _ = rustix::process::setpriority_process(None, LOW);
    }
    // Linux may share processors out among sessions before it looks at priorities. A session that has other programs is left as it is.
    if rustix::process::getsid(None).is_ok_and(|leader| leader == rustix::process::getpid()) {
        let _ = fs::write("/proc/self/autogroup", LOW.to_string());
    }
}

/// Confines the calling thread, and all that it starts from now on, to processors of this machine.
///
/// # Errors
/// If the machine lacks one of them, or refuses.
pub fn pin(processors: &[usize]) -> io::Result<()> {
    confine(processors)?;
    // Those that the machine lacks are left out in silence.
    let taken = allowed().unwrap_or_default();
    let missing = |n: &&usize| !taken.is_empty() && !taken.contains(n);
    match processors.iter().filter(missing).count() {
        0 => Ok(()),
        missing => {
            let why = format!("this process can have {taken:?} of them, and not the {missing} others");
            Err(io::Error::new(io::ErrorKind::InvalidInput, why))
        }
    }
}

/// Number of cores that this process may use, however many processors each has; none if the machine does not say.
pub fn n_cores() -> Option<usize> {
    cores_among(&allowed()?, Path::new("/sys/devices/system/cpu"))
}

/// Number of cores that processors belong to; none if one of them does not say.
fn cores_among(processors: &[usize], folder: &Path) -> Option<usize> {
    let siblings =
        |n: &usize| fs::read_to_string(folder.join(format!("cpu{n}/topology/thread_siblings_list"))).ok();
    Some(processors.iter().map(siblings).collect::<Option<HashSet<String>>>()?.len())
}

/// What Linux does for a thread.
#[cfg(target_os = "linux")]
mod linux {
    use std::io;

    use rustix::thread::{CpuSet, gettid, sched_getaffinity, sched_setaffinity};

    /// The highest nice value.
    const LOWEST: i32 = 19;

    pub(super) fn lower_thread() {
        let _ = rustix::process::setpriority_process(Some(gettid()), LOWEST);
    }

    pub(super) fn confine(processors: &[usize]) -> io::Result<()> {
        let mut set = CpuSet::new();
        processors.iter().filter(|n| **n < CpuSet::MAX_CPU).for_each(|&n| set.set(n));
        Ok(sched_setaffinity(None, &set)?)
    }

    /// The processors that this thread may use.
    pub(super) fn allowed() -> Option<Vec<usize>> {
        let allowed = sched_getaffinity(None).ok()?;
        Some((0..CpuSet::MAX_CPU).filter(|&n| allowed.is_set(n)).collect())
    }
}

/// Other systems share out processors by themselves.
#[cfg(not(target_os = "linux"))]
mod other {
    use std::io;

    pub(super) fn lower_thread() {}

    pub(super) fn confine(_: &[usize]) -> io::Result<()> {
        let why = "this system does not confine threads to processors; leave out --pin";
        Err(io::Error::new(io::ErrorKind::Unsupported, why))
    }

    pub(super) fn allowed() -> Option<Vec<usize>> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_of_one_core_count_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        for (n, siblings) in [(0, "0,4\n"), (1, "1,5\n"), (4, "0,4\n"), (5, "1,5\n"), (8, "8\n")] {
            let topology = folder.join(format!("cpu{n}/topology"));
            fs::create_dir_all(&topology).expect("a folder");
            fs::write(topology.join("thread_siblings_list"), siblings).expect("a file");
        }
        let found = [&[0, 1, 4, 5, 8][..], &[0, 4], &[1, 8], &[0, 9]].map(|list| cores_among(list, folder));
        assert_eq!(found, [Some(3), Some(1), Some(2), None]);
    }
}
