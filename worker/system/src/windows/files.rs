//! How many files this process may have open, and the errors by which the system says that it has none left of something.

/// A process may have millions of handles: as many as are wanted.
pub fn raise_limit(wanted: u64) -> u64 {
    wanted
}

/// Errors of the system that say that it has none left of something, or no disk to write to until somebody helps: files (4), memory
/// (8, 14, 1450, 1455), room on a disk (39, 112, 1295), a disk that is protected, not ready or fails (19, 21, 1117), sockets and their
/// buffers (10024, 10055).
pub const SHORTAGES: &[i32] = &[4, 8, 14, 19, 21, 39, 112, 1117, 1295, 1450, 1455, 10024, 10055];
