//! Names that outlive a loss of power, and a folder that one process has.

use std::{
    fs::{File, TryLockError},
    io,
    path::Path,
};

/// Makes the names in a folder outlive a loss of power.
///
/// # Errors
/// If there is no such folder, or the disk refuses.
pub fn sync(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Takes a folder for as long as the value lives; none if another process has it.
///
/// # Errors
/// If there is no such folder, or its file system knows no locks.
pub fn lock(folder: &Path) -> io::Result<Option<File>> {
    // Of the folder itself, which nobody can take away unnoticed, as a file in it could be.
    let lock = File::open(folder)?;
    match lock.try_lock() {
        Ok(()) => Ok(Some(lock)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error),
    }
}
