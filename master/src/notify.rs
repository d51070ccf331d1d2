//! NOTIFY: a command of the user's that is run when a run, a job or a study is over.

use std::{
    path::Path,
    process::{ExitCode, Stdio},
};

/// Runs a command in a shell, with what is over in its environment: `BOLIDE_JOB`, the deck, the study or the number of the job; `BOLIDE_STATE`, one
/// of `done`, `failed`, `stopped`; `BOLIDE_FOLDER`, where the results are on this PC, or empty; `BOLIDE_REASON`, why it failed, or empty. What the command
/// comes to does not matter to what is over: a fault of it is told on standard error.
pub fn notify(command: Option<&str>, job: &str, folder: Option<&Path>, result: &Result<ExitCode, String>) {
    let Some(command) = command else { return };
    let (state, reason) = match result {
        Err(why) => ("failed", why.as_str()),
        Ok(code) if *code == ExitCode::SUCCESS => ("done", ""),
        Ok(_) => ("stopped", ""),
    };
    let mut shell = system::children::shell(command);
    shell.stdin(Stdio::null());
    shell.env("BOLIDE_JOB", job).env("BOLIDE_STATE", state).env("BOLIDE_REASON", reason.replace('\0', " "));
    shell.env(
        "BOLIDE_FOLDER",
        folder.map(|folder| std::path::absolute(folder).unwrap_or(folder.to_owned())).unwrap_or_default(),
    );
    match shell.status() {
        Ok(status) if status.success() => {}
        Ok(status) => eprintln!("--notify {command}: {status}"),
        Err(error) => eprintln!("--notify {command}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_told_what_is_over_and_how() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("told");
        let command = format!(
            "printf '%s|%s|%s|%s' \"$BOLIDE_JOB\" \"$BOLIDE_STATE\" \"$BOLIDE_FOLDER\" \"$BOLIDE_REASON\" > {}",
            out.display()
        );
        let told = |result, folder| {
            notify(Some(&command), "7", folder, &result);
            std::fs::read_to_string(&out).expect("it was told")
        };
        assert_eq!(told(Ok(ExitCode::SUCCESS), Some(Path::new("/tmp/x"))), "7|done|/tmp/x|");
        assert_eq!(told(Ok(ExitCode::from(130)), None), "7|stopped||");
        assert_eq!(told(Err("no disk; it's full".to_owned()), None), "7|failed||no disk; it's full");
    }
}
