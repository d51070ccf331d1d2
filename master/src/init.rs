//! INIT: `bolide init`, a commented deck of a usual problem to start from.

use std::{
    fs::File,
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use deck::{
    fault::nearest,
    starters::{STARTERS, Starter},
};

use crate::shell::{print, quoted};

/// Writes the deck of that name to `to`, by default its name with `.toml` here, to standard output where `to` is `-`. Without a name
/// lists them.
///
/// # Errors
/// A name that no deck has, a file that is there already or cannot be written.
pub fn run(name: Option<&str>, to: Option<&Path>) -> Result<ExitCode, String> {
    let Some(name) = name else {
        return print(&list()).map(|()| ExitCode::SUCCESS);
    };
    let starter = STARTERS.iter().find(|starter| starter.name == name).ok_or_else(|| unknown(name))?;
    if to == Some(Path::new("-")) {
        return print(starter.text).map(|()| ExitCode::SUCCESS);
    }
    let path = to.map_or_else(|| PathBuf::from(format!("{name}.toml")), Path::to_path_buf);
    // No file is replaced, not even one that appears at this moment.
    let mut file = File::create_new(&path).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => format!(
            "{0}: is there already and stays as it is; name another file: bolide init {name} FILE",
            path.display()
        ),
        _ => format!("{}: {e}", path.display()),
    })?;
    file.write_all(starter.text.as_bytes()).map_err(|e| format!("{}: {e}", path.display()))?;
    print(&next(starter, &path)).map(|()| ExitCode::SUCCESS)
}

fn list() -> String {
    let lines: Vec<String> =
        STARTERS.iter().map(|starter| format!("  {:8} {}", starter.name, starter.about)).collect();
    format!("Decks to start from:\n{}\n`bolide init NAME` writes NAME.toml here.", lines.join("\n"))
}

fn unknown(name: &str) -> String {
    let names = STARTERS.map(|starter| starter.name);
    // `taylor-bar` is far from `taylor`, which it begins with.
    let begins = |known: &&str| name.starts_with(known) || !name.is_empty() && known.starts_with(name);
    let advice = match nearest(name, names).or_else(|| names.into_iter().find(begins)) {
        Some(near) => format!("write {near}"),
        None => "`bolide init` alone lists them".to_owned(),
    };
    format!("read the deck \"{name}\"; expected one of {}; {advice}", names.join(", "))
}

/// What was written, and the commands that follow.
fn next(starter: &Starter, path: &Path) -> String {
    let deck = quoted(&path.display().to_string());
    let stem = path.file_stem().map_or_else(|| starter.name.into(), |stem| stem.to_string_lossy());
    let results = quoted(&format!("results/{stem}"));
    let picture = quoted(&format!("{stem}.png"));
    let commands = [
        (format!("bolide check {deck}"), "its mistakes, and what a run takes"),
        (format!("bolide run {deck}"), "writes the results folder"),
        (format!("bolide picture {results} --field {} --out {picture}", starter.field), "its last state"),
    ];
    let width = commands.iter().map(|(command, _)| command.len()).max().unwrap_or(0);
    let lines: Vec<String> =
        commands.iter().map(|(command, what)| format!("  {command:width$}   # {what}")).collect();
    format!("wrote {}: {}; next:\n{}", path.display(), starter.about, lines.join("\n"))
}
