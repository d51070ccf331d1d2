//! CONVERT: `bolide convert`, an LS-DYNA keyword deck as a TOML deck with its mesh in a file beside it.

use std::{fs, path::Path, process::ExitCode};

use deck::bundle::Options;

use crate::deck_file::{self, gather_deck, warn};

/// Writes `to` and its mesh.
///
/// # Errors
/// Faults of the deck, or files that cannot be written.
pub fn run(deck: &Path, to: &Path, force: bool, options: &Options) -> Result<ExitCode, String> {
    let text = gather_deck(deck, options)?;
    let mesh = to.with_extension("mesh");
    let name = mesh.file_name().and_then(|name| name.to_str());
    let name = name.ok_or_else(|| format!("{}: a file name is needed, such as model.toml", to.display()))?;
    for path in [to, &mesh] {
        if path.exists() && !force {
            return Err(format!("{}: is there already; name another, or give --force", path.display()));
        }
    }
    let converted = deck::convert(&text, &deck.display().to_string(), name)
        .map_err(|faults| deck_file::Error::of_faults(faults.iter().map(ToString::to_string)))?;
    warn(&converted.warnings);
    for (path, text) in [(&*mesh, &converted.mesh), (to, &converted.deck)] {
        fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    println!("wrote {} and {}", to.display(), mesh.display());
    Ok(ExitCode::SUCCESS)
}
