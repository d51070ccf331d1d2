//! Decks from files: gathered with all that they refer to, read and checked.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use deck::{
    bundle::{self, Opened, Options as Reading},
    model::Model,
    physics,
};

use crate::shell::{quoted, tell};

/// Reads and checks a deck.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_deck(path: &Path) -> Result<Model, Error> {
    read_deck_with(path, &Reading::default())
}

/// Reads and checks a deck with what it does not say itself; warnings go to standard error.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_deck_with(path: &Path, options: &Reading) -> Result<Model, Error> {
    read_gathered(&gather_deck(path, options)?, &path.display().to_string())
}

/// Reads and checks the text of a deck with the files that it refers to; warnings go to standard error.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_gathered(text: &str, name: &str) -> Result<Model, Error> {
    let reading = deck::read_whole(text, name)
        .map_err(|faults| Error::of_faults(faults.iter().map(ToString::to_string)))?;
    warn(&reading.warnings);
    doubt(&reading.model);
    Ok(reading.model)
}

/// Tells what is done otherwise than a deck says, on standard error.
pub fn warn(warnings: &[deck::Warning]) {
    for warning in warnings {
        tell(&format!("warning: {warning}"));
    }
}

/// Tells what is hardly meant by a deck that runs, on standard error.
pub fn doubt(model: &Model) {
    for warning in physics::forecast(model).warnings {
        tell(&format!("warning: {warning}"));
    }
}

/// The text of a deck with the files that it refers to.
///
/// # Errors
/// If the deck cannot be opened, or is too large.
pub fn gather_deck(path: &Path, options: &Reading) -> Result<String, Error> {
    let name = path.display().to_string();
    let fault = |why| Error::File { name: name.clone(), why };
    let text = bundle::bytes_of_deck(path).and_then(bundle::text_of).map_err(fault)?;
    if let Some(deck) = deck_of_study(&text) {
        return Err(fault(format!("this is a study of the deck {deck}: bolide study {}", quoted(&name))));
    }
    let folder = folder_of(path);
    let mut open = |path: &str| {
        let (found, bytes) = read_in_any_case(path)?;
        let is_outside = !folder
            .as_ref()
            .is_some_and(|folder| std::fs::canonicalize(&found).is_ok_and(|found| found.starts_with(folder)));
        Some(Opened { text: String::from_utf8_lossy(&bytes).into_owned(), is_outside })
    };
    bundle::gather_from(&name, text, options, &mut open).map_err(Error::Bundle)
}

/// The deck that a text names which is a study, as `bolide study` takes it, and no deck itself.
pub fn deck_of_study(text: &str) -> Option<String> {
    // A deck may be long, and keyword decks are no TOML.
    if !text.contains("[[parameter]]") && !text.contains("[[measure]]") {
        return None;
    }
    let table: toml::Table = text.parse().ok()?;
    let deck = table.get("deck")?.as_str()?;
    (!table.contains_key("part") && !deck.chars().any(char::is_control)).then(|| deck.to_owned())
}

/// The folder of a deck, links followed as far as the deck itself.
fn folder_of(deck: &Path) -> Option<PathBuf> {
    let folder = deck.parent().filter(|folder| !folder.as_os_str().is_empty());
    std::fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()
}

/// Most folders of a path that is looked for in any case.
const MAX_FOLDERS: usize = 64;

/// A file that a deck refers to, with its bytes. Decks from machines that do not tell capitals from small letters name files and folders
/// in either: where none has the name, the only one that differs from it in case is taken.
fn read_in_any_case(path: &str) -> Option<(PathBuf, Vec<u8>)> {
    let path = Path::new(path);
    if let Ok(bytes) = bundle::bytes_of(path) {
        return Some((path.to_owned(), bytes));
    }
    if path.components().nth(MAX_FOLDERS).is_some() {
        return None;
    }
    let mut found = PathBuf::new();
    for part in path.components() {
        let next = found.join(part);
        let is_there = next.symlink_metadata().is_ok();
        found = if is_there { next } else { in_any_case(&found, part.as_os_str().to_str()?)? };
    }
    bundle::bytes_of(&found).ok().map(|bytes| (found, bytes))
}

/// The only entry of a folder whose name differs from `wanted` in case alone.
fn in_any_case(folder: &Path, wanted: &str) -> Option<PathBuf> {
    let here = Path::new(".");
    let entries = std::fs::read_dir(if folder.as_os_str().is_empty() { here } else { folder }).ok()?;
    let same = |entry: &std::fs::DirEntry| {
        entry.file_name().to_str().is_some_and(|name| name.eq_ignore_ascii_case(wanted))
    };
    let mut found = entries.flatten().filter(same);
    found.next().filter(|_| found.next().is_none()).map(|only| only.path())
}

/// Why a deck cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// Its file cannot be opened, or is no text.
    File {
        name: String,
        /// The system's reason.
        why: String,
    },
    /// It cannot be gathered with the files that it refers to.
    Bundle(String),
    /// Its faults, a line each.
    Faults(Vec<String>),
}

impl Error {
    /// Of a deck with these faults.
    pub fn of_faults(lines: impl IntoIterator<Item = String>) -> Self {
        Self::Faults(lines.into_iter().collect())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { name, why } => write!(f, "{name}: {why}"),
            Self::Bundle(why) => f.write_str(why),
            Self::Faults(lines) => {
                let ending = if lines.len() == 1 { "" } else { "s" };
                write!(f, "{} fault{ending} in the deck\n{}", lines.len(), lines.join("\n"))
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_is_told_from_a_deck() {
        let study =
            "title = \"s\"\ndeck = \"d.toml\"\n[[parameter]]\nname = \"v\"\n[[measure]]\nname = \"m\"\n";
        assert_eq!(deck_of_study(study).as_deref(), Some("d.toml"));
        let part = "[[part]]\nname = \"a\"\n";
        for deck in [part, &format!("{study}{part}"), "*KEYWORD\n$ [[parameter]]\n", "[[measure]]\n"] {
            assert_eq!(deck_of_study(deck), None, "{deck}");
        }
    }

    #[test]
    fn an_include_is_found_in_any_case_where_only_one_file_fits() {
        let folder = std::env::temp_dir().join(format!("bolide-include-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder of its own");
        let path = |name: &str| folder.join(name);
        for (name, text) in
            [("main.k", "*KEYWORD\n*INCLUDE\nModel.k\n*END\n"), ("MODEL.K", "*TITLE\nfound\n")]
        {
            std::fs::write(path(name), text).expect("a new file");
        }
        let gathered = || gather_deck(&path("main.k"), &Reading::default()).expect("few files");
        assert!(gathered().contains("*TITLE\nfound"), "{}", gathered());
        std::fs::write(path("model.K"), "*TITLE\nanother\n").expect("a new file");
        // Which of two is meant cannot be told.
        assert!(!gathered().contains("*TITLE"), "{}", gathered());
        // Folders, too.
        std::fs::create_dir_all(path("parts/Nose")).expect("a folder");
        std::fs::write(path("parts/Nose/mesh.k"), "*TITLE\nin a folder\n").expect("a new file");
        std::fs::write(path("main.k"), "*KEYWORD\n*INCLUDE\n./PARTS/nose/../NOSE/MESH.K\n*END\n")
            .expect("a deck");
        assert!(gathered().contains("*TITLE\nin a folder"), "{}", gathered());
        std::fs::remove_dir_all(&folder).expect("the folder of this test");
    }
}
