//! FILES: how many of the files that this process may have open connections may take.

/// The soft limit that a master raises itself to, where the hard one allows it.
const WANTED: u64 = 16_384;
/// Kept for results, snapshots, the page and its connections.
const KEPT: u64 = 512;

/// Raises the soft limit of open files; gives how many of them connections may take.
pub fn raise_limit() -> usize {
    for_connections(system::files::raise_limit(WANTED))
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
