//! Processes that this one starts, and its own end.

use std::{
    fs, io,
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::Path,
    process::Command,
};

/// Has a command start apart from this process's terminal: Ctrl-C does not reach it.
pub fn apart(command: &mut Command) {
    command.process_group(0);
}

/// A command in the words of the system's shell.
pub fn shell(words: &str) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", words]);
    command
}

/// Writes a script of the shell `sh` that can be started by its path.
///
/// # Errors
/// If the disk refuses, or the system knows no such scripts.
pub fn script(path: &Path, text: &str) -> io::Result<()> {
    fs::write(path, text)?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o755))
}

/// Ends this process at once, as `kill -9` would.
pub fn die() {
    // A process may always send itself a signal; this one returns to nobody.
    let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
}
