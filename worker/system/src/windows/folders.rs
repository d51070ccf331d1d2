//! Names that outlive a loss of power, and a folder that one process has.

use std::{
    fs::{File, OpenOptions},
    io,
    os::windows::fs::OpenOptionsExt,
    path::Path,
};

use windows_sys::Win32::{
    Foundation::{
        ERROR_ACCESS_DENIED, ERROR_INVALID_FUNCTION, ERROR_INVALID_HANDLE, ERROR_SHARING_VIOLATION,
    },
    Storage::FileSystem::{FILE_FLAG_BACKUP_SEMANTICS, FILE_SHARE_READ},
};

/// The file in a folder that stands for it while a process has it.
const LOCK: &str = "locked";

/// Makes the names in a folder outlive a loss of power. NTFS writes changes of names to its journal in their order; where the
/// file system flushes no folders, that is what there is.
///
/// # Errors
/// If there is no such folder, or the disk refuses.
pub fn sync(folder: &Path) -> io::Result<()> {
    // A folder can be opened with this flag alone, and flushed if it was opened for writing.
    let opened = OpenOptions::new().write(true).custom_flags(FILE_FLAG_BACKUP_SEMANTICS).open(folder);
    match opened.and_then(|folder| folder.sync_all()) {
        Err(error) if flushes_no_folders(&error) && folder.is_dir() => Ok(()),
        result => result,
    }
}

fn flushes_no_folders(error: &io::Error) -> bool {
    let known = [ERROR_ACCESS_DENIED, ERROR_INVALID_FUNCTION, ERROR_INVALID_HANDLE];
    error.raw_os_error().is_some_and(|number| known.contains(&(number as u32)))
}

/// Takes a folder for as long as the value lives; none if another process has it.
///
/// # Errors
/// If there is no such folder, or it cannot be written.
pub fn lock(folder: &Path) -> io::Result<Option<File>> {
    // Nobody else can open it for writing, or delete it, before it is closed.
    let options =
        OpenOptions::new().write(true).create(true).truncate(false).share_mode(FILE_SHARE_READ).clone();
    match options.open(folder.join(LOCK)) {
        Ok(lock) => Ok(Some(lock)),
        Err(error) if error.raw_os_error() == Some(ERROR_SHARING_VIOLATION as i32) => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_one_processs_until_it_lets_go_and_its_names_can_be_synchronised() {
        let folder = tempfile::tempdir().expect("a folder");
        let lock_of = || lock(folder.path()).expect("a folder that can be written");
        let held = lock_of().expect("nobody has it");
        assert!(lock_of().is_none());
        assert!(std::fs::remove_file(folder.path().join(LOCK)).is_err(), "nobody can take it away");
        drop(held);
        assert!(lock_of().is_some());
        sync(folder.path()).expect("a folder");
        assert!(sync(&folder.path().join("none")).is_err());
    }
}
