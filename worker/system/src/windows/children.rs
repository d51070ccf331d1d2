//! Processes that this one starts, and its own end.

use std::{io, os::windows::process::CommandExt, path::Path, process::Command};

use windows_sys::Win32::System::Threading::{CREATE_NEW_PROCESS_GROUP, GetCurrentProcess, TerminateProcess};

/// Has a command start apart from this process's console: Ctrl-C does not reach it.
pub fn apart(command: &mut Command) {
    command.creation_flags(CREATE_NEW_PROCESS_GROUP);
}

/// A command in the words of the system's shell.
pub fn shell(words: &str) -> Command {
    let mut command = Command::new("cmd");
    // `cmd` reads the words itself; quotes within them would be marked for another reader.
    command.args(["/D", "/S", "/C"]).raw_arg(format!("\"{words}\""));
    command
}

/// Writes a script of the shell `sh` that can be started by its path: Windows starts none.
///
/// # Errors
/// Always.
pub fn script(_path: &Path, _text: &str) -> io::Result<()> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "Windows starts no scripts of sh; choose another engine"))
}

/// Ends this process at once, with nothing tidied up.
pub fn die() {
    // SAFETY: a process may always end itself.
    unsafe {
        TerminateProcess(GetCurrentProcess(), 137);
    }
}
