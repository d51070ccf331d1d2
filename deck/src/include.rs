//! Which lines of a keyword file matter, and which files they include.

/// Lines of a text that matter, with their numbers from 1; what follows `*END` is left out.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (u32, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.lines()
        .zip(1..)
        .map(|(line, number)| (number, line.trim_end()))
        .filter(|(_, line)| !line.starts_with('$'))
        .take_while(|(_, line)| !is_end(line))
}

/// Whether a text has an `*END`.
pub(crate) fn has_end(text: &str) -> bool {
    text.lines().any(|line| line.starts_with('*') && is_end(line))
}

fn is_end(line: &str) -> bool {
    let word = line.split(|c: char| c.is_whitespace() || c == '$').next().unwrap_or_default();
    word.eq_ignore_ascii_case("*END")
}

/// The paths at which a file looks for the includes it names, in the order in which they are tried.
/// `folders` are those of `*INCLUDE_PATH` so far.
pub(crate) fn includes(name: &str, text: &str, folders: &mut Vec<String>) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut kind = None;
    let mut before = String::new();
    for (_, line) in lines(text) {
        if line.starts_with('*') {
            kind = include_kind(line);
            before.clear();
            continue;
        }
        let Some(kind) = kind else { continue };
        if let Some(path) = path_of(line, &mut before) {
            match kind {
                Include::File => found.push(candidates(name, &path, folders)),
                Include::Folder => folders.push(path),
                Include::FolderBeside => folders.push(beside(name, &path)),
            }
        }
    }
    found
}

/// What an include card names.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Include {
    File,
    Folder,
    FolderBeside,
}

fn include_kind(line: &str) -> Option<Include> {
    let word = line.split_whitespace().next().unwrap_or_default();
    match word.to_ascii_uppercase().as_str() {
        "*INCLUDE" => Some(Include::File),
        "*INCLUDE_PATH" => Some(Include::Folder),
        "*INCLUDE_PATH_RELATIVE" => Some(Include::FolderBeside),
        _ => None,
    }
}

/// The path that ends on this line; one that goes on ends in ` +`.
pub(crate) fn path_of(line: &str, before: &mut String) -> Option<String> {
    let line = line.trim();
    match line.strip_suffix(" +") {
        Some(start) => {
            before.push_str(start.trim_end());
            None
        }
        None if line.is_empty() && before.is_empty() => None,
        None => Some(std::mem::take(before) + line),
    }
}

/// The paths at which a file looks for what it includes.
pub(crate) fn candidates(file: &str, path: &str, folders: &[String]) -> Vec<String> {
    let mut list = vec![beside(file, path)];
    list.extend(folders.iter().map(|folder| format!("{}/{path}", folder.trim_end_matches('/'))));
    list
}

/// A path that a file says, as seen from where that file is seen from. Whoever reads a deck has to find what another gathered, so both
/// separators and the drives of Windows are known on every system.
pub(crate) fn beside(file: &str, name: &str) -> String {
    let name = name.replace('\\', "/");
    let has_drive = matches!(name.as_bytes(), [drive, b':', b'/', ..] if drive.is_ascii_alphabetic());
    match file.rsplit_once(['/', '\\']) {
        Some((folder, _)) if !name.starts_with('/') && !has_drive => format!("{folder}/{name}"),
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_seen_from_the_folder_of_its_file_by_either_separator() {
        for (file, name, seen) in [
            ("plate.k", "mesh.k", "mesh.k"),
            ("decks/plate.k", "mesh.k", "decks/mesh.k"),
            ("decks\\plate.k", "mesh.k", "decks/mesh.k"),
            ("C:\\lab\\decks/plate.k", "parts\\mesh.k", "C:\\lab\\decks/parts/mesh.k"),
            ("decks/plate.k", "/lab/mesh.k", "/lab/mesh.k"),
            ("decks\\plate.k", "D:\\lab\\mesh.k", "D:/lab/mesh.k"),
        ] {
            assert_eq!(beside(file, name), seen, "{file}: {name}");
        }
    }
}
