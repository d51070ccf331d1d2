//! What makes names on disk last.

use std::{io, path::Path};

/// Makes the names in the folder of `path` outlive a loss of power.
pub fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    system::folders::sync(folder.unwrap_or(Path::new(".")))
}
