//! What makes names on disk last.

use std::{fs::File, io, path::Path};

/// Makes the names in the folder of `path` outlive a loss of power.
pub fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}
