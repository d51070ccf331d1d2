//! CONVERT: `bolide convert`, an LS-DYNA keyword deck as a TOML deck with its mesh in a file beside it; of a mesh of another program a TOML
//! deck to start from, which names the mesh where it is.

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

use deck::{bundle::Options, mesh_file::Format};

use crate::{
    deck_file::{self, gather_deck, warn},
    shell::print,
};

/// Writes `to`, by default the name of the deck with the ending .toml, and of a keyword deck its mesh.
///
/// # Errors
/// Faults of the deck, or files that cannot be written.
pub fn run(deck: &Path, to: Option<&Path>, force: bool, options: &Options) -> Result<ExitCode, String> {
    let beside = deck.with_extension("toml");
    let to = to.unwrap_or(&beside);
    let text = gather_deck(deck, options)?;
    // Options make a bundle of one file too, which holds the text of the file.
    match Format::is_foreign_mesh(&deck.display().to_string(), &text) {
        true => start(deck, &text, to, force),
        false => convert(deck, &text, to, force),
    }
}

/// Writes a deck to start from for a mesh.
fn start(mesh: &Path, text: &str, to: &Path, force: bool) -> Result<ExitCode, String> {
    // The deck names the mesh as seen from its own folder.
    let folder =
        |path: &Path| path.parent().filter(|folder| !folder.as_os_str().is_empty()).map(Path::to_path_buf);
    let seen = match (folder(mesh) == folder(to), mesh.file_name()) {
        (true, Some(name)) => name.into(),
        _ => fs::canonicalize(mesh).map_err(|e| format!("{}: {e}", mesh.display()))?,
    };
    let written = deck::start_from_mesh(text, &mesh.display().to_string(), &seen.display().to_string())
        .map_err(|faults| deck_file::Error::of_faults(faults.iter().map(ToString::to_string)))?;
    keep_source(mesh, &[to])?;
    may_write(to, force)?;
    warn(&written.warnings);
    fs::write(to, &written.deck).map_err(|e| format!("{}: {e}", to.display()))?;
    print(&format!(
        "wrote {}: choose materials, supports and velocities there, then bolide run {}",
        to.display(),
        to.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// What is converted is not replaced, whatever is forced.
fn keep_source(source: &Path, written: &[&Path]) -> Result<(), String> {
    match written.iter().find(|path| is_same(source, path)) {
        Some(path) => Err(format!(
            "{}: is what is converted, {}, which stays as it is; name another file to write, such as {}",
            path.display(),
            source.display(),
            source.with_file_name("converted.toml").display()
        )),
        None => Ok(()),
    }
}

/// Whether two paths are of one file, there or not.
fn is_same(one: &Path, other: &Path) -> bool {
    let of = |path: &Path| -> Option<PathBuf> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let beside =
            || Some(fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?.join(path.file_name()?));
        fs::canonicalize(path).ok().or_else(beside)
    };
    one == other || of(one).zip(of(other)).is_some_and(|(one, other)| one == other)
}

fn may_write(path: &Path, force: bool) -> Result<(), String> {
    if path.exists() && !force {
        return Err(format!("{}: is there already; name another, or give --force", path.display()));
    }
    Ok(())
}

/// Writes a keyword deck as a TOML deck, with its mesh beside it.
fn convert(deck: &Path, text: &str, to: &Path, force: bool) -> Result<ExitCode, String> {
    let mesh = to.with_extension("mesh");
    let name = mesh.file_name().and_then(|name| name.to_str());
    let name = name.ok_or_else(|| format!("{}: a file name is needed, such as model.toml", to.display()))?;
    let converted = deck::convert(text, &deck.display().to_string(), name)
        .map_err(|faults| deck_file::Error::of_faults(faults.iter().map(ToString::to_string)))?;
    keep_source(deck, &[to, &mesh])?;
    if is_same(to, &mesh) {
        return Err(format!(
            "{}: the deck would be written over its own mesh; give it another ending, such as {}",
            to.display(),
            to.with_extension("toml").display()
        ));
    }
    for path in [to, &mesh] {
        may_write(path, force)?;
    }
    warn(&converted.warnings);
    for (path, text) in [(&*mesh, &converted.mesh), (to, &converted.deck)] {
        fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    print(&format!("wrote {} and {}", to.display(), mesh.display()))?;
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_the_source_nor_its_mesh_is_written_over() {
        let folder = tempfile::tempdir().expect("room for a folder");
        let file = |name: &str| folder.path().join(name);
        let deck = include_str!("../../deck/examples/ball-on-shell.k");
        fs::write(file("a.k"), deck).expect("room");
        fs::create_dir(file("b")).expect("room");
        let convert = |from: &str, to: &str| run(&file(from), Some(&file(to)), true, &Options::default());
        let why = convert("a.k", "b.mesh").expect_err("its own mesh");
        assert!(why.contains("over its own mesh") && why.contains("b.toml"), "{why}");
        let why = convert("a.k", "b/../a.k").expect_err("the source");
        assert!(why.contains("is what is converted"), "{why}");
        fs::copy(file("a.k"), file("c.mesh")).expect("room");
        let why = convert("c.mesh", "c.toml").expect_err("its mesh is the source");
        assert!(why.contains("is what is converted"), "{why}");
        assert_eq!(fs::read_to_string(file("a.k")).expect("there"), deck);
        assert_eq!(convert("a.k", "b.toml"), Ok(ExitCode::SUCCESS));
    }
}
