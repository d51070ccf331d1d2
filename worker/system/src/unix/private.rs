//! Files that are their owner's alone: keys, tokens, and what a master keeps.

use std::{
    fs::{self, File, OpenOptions, Permissions},
    io,
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::Path,
};

use crate::Readers;

/// Has all that this process makes from now on be its user's alone; on a system where a folder decides that, what it makes
/// in `folder`, which is made if there is none.
///
/// # Errors
/// None here.
pub fn from_now_on(_folder: &Path) -> io::Result<()> {
    rustix::process::umask(rustix::fs::Mode::RWXG | rustix::fs::Mode::RWXO);
    Ok(())
}

/// Closes a folder that others could read.
///
/// # Errors
/// If it is not this user's.
pub fn close(folder: &Path) -> io::Result<()> {
    fs::set_permissions(folder, Permissions::from_mode(0o700))
}

/// Opens a file as `options` say. One that is made now is for these readers from its first moment on, and for nobody but its
/// owner to write.
///
/// # Errors
/// As for [`OpenOptions::open`].
pub fn open(options: &OpenOptions, path: &Path, readers: Readers) -> io::Result<File> {
    let mode = match readers {
        Readers::Owner => 0o600,
        Readers::All => 0o644,
    };
    options.clone().mode(mode).open(path)
}

/// Who else can read a file, and the command that ends that; nothing where nobody can.
///
/// # Errors
/// If it cannot be looked at.
pub fn open_to_others(path: &Path) -> io::Result<Option<String>> {
    let mode = fs::metadata(path)?.permissions().mode() & 0o777;
    let path = path.display();
    Ok((mode & 0o077 != 0).then(|| format!("has mode {mode:04o}, must be 0600; run chmod 600 {path}")))
}
