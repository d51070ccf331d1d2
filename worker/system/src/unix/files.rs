//! How many files this process may have open, and the errors by which the system says that it has none left of something.

use rustix::process::{Resource, getrlimit, setrlimit};

/// Raises the limit of open files to `wanted`, as far as the system lets it; gives what it is then.
pub fn raise_limit(wanted: u64) -> u64 {
    let mut limit = getrlimit(Resource::Nofile);
    let raised = wanted.min(limit.maximum.unwrap_or(wanted));
    if limit.current.is_some_and(|current| current < raised) {
        let before = limit.current;
        limit.current = Some(raised);
        if setrlimit(Resource::Nofile, limit).is_err() {
            limit.current = before;
        }
    }
    limit.current.unwrap_or(wanted)
}

/// Errors of the system that say that it has none left of something, or no disk to write to until somebody helps: memory (12), files
/// (23, 24), room on a disk (28, 122), a disk that fails, was made read-only for that, or is that of a server which is away (5, 30, 116).
pub const SHORTAGES: &[i32] = &[5, 12, 23, 24, 28, 30, 116, 122];
