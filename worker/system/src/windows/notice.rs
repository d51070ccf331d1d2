//! What a service manager is told: Windows has no socket for it.

use std::{ffi::OsStr, io};

/// Tells nobody.
///
/// # Errors
/// Always.
pub fn send(_name: &OsStr, _state: &str) -> io::Result<()> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "Windows knows no NOTIFY_SOCKET"))
}
