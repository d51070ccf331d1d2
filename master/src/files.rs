//! FILES: how many files this process may have open, and how many of them connections may take.

use rustix::process::{Resource, getrlimit, setrlimit};

/// The soft limit that a master raises itself to, where the hard one allows it.
const WANTED: u64 = 16_384;
/// Kept for results, snapshots, the page and its connections.
const KEPT: u64 = 512;

/// Raises the soft limit of open files; gives how many of them connections may take.
pub fn raise_limit() -> usize {
    let mut limit = getrlimit(Resource::Nofile);
    let raised = WANTED.min(limit.maximum.unwrap_or(WANTED));
    if limit.current.is_some_and(|current| current < raised) {
        let before = limit.current;
        limit.current = Some(raised);
        if setrlimit(Resource::Nofile, limit).is_err() {
            limit.current = before;
        }
    }
    for_connections(limit.current.unwrap_or(WANTED))
}

/// Of a low limit half is kept.
fn for_connections(limit: u64) -> usize {
    usize::try_from(limit.saturating_sub(KEPT).max(limit / 2)).unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_always_have_files_left() {
        assert_eq!([256, 1024, 16_384].map(for_connections), [128, 512, 15_872]);
    }
}
