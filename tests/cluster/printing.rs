//! Standard output and standard error that nobody reads, or that are full: no command ends with a panic.

use std::{fs::File, process::Command};

use tests::cluster::{Cluster, Said, repository, said};

use crate::{BOLIDE, small};

/// Runs a command whose standard output is a full disk.
fn said_to_full_disk(command: &mut Command) -> Said {
    let full = File::options().write(true).open("/dev/full").expect("Linux has it");
    said(command.stdout(full))
}

/// Runs a command whose reader has gone.
fn said_to_nobody(command: &mut Command) -> Said {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    said(command.stdout(writer))
}

/// What a command does in both cases; it succeeds where it is heard.
fn check(mut command: impl FnMut() -> Command) {
    let full = said_to_full_disk(&mut command());
    assert_eq!(full.code, Some(1), "{:?}: {full:?}", command());
    let last = full.err.lines().last().unwrap_or_default();
    assert!(last.starts_with("bolide: standard output: "), "{:?}: {full:?}", command());
    assert!(!full.err.contains("panicked"), "{:?}: {full:?}", command());
    let closed = said_to_nobody(&mut command());
    assert_eq!(closed.code, Some(0), "{:?}: {closed:?}", command());
    assert!(!closed.err.contains("panicked"), "{:?}: {closed:?}", command());
}

/// A run tells its progress and its warnings on standard error; nobody need be there to hear of them.
#[test]
fn standard_error_that_is_full_ends_no_run() {
    let mut command = Command::new(BOLIDE);
    command.args(["run", &small(), "--cycles", "40", "--threads", "1", "--no-output", "--json"]);
    let full = || File::options().write(true).open("/dev/full").expect("Linux has it");
    let told = said(command.env("BOLIDE_LOG", "debug").stderr(full()));
    assert_eq!(told.code, Some(0), "{told:?}");
    assert!(told.out.contains(crate::reference()), "{told:?}");
    let refused = said(Command::new(BOLIDE).args(["check", "none.toml"]).stderr(full()));
    assert_eq!(refused.code, Some(1), "{refused:?}");
}

#[test]
fn standard_output_that_is_full_or_closed_ends_no_command_with_a_panic() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out").display().to_string();
    let picture = folder.path().join("picture.png").display().to_string();
    let small = small();
    let run = ["run", &small, "--cycles", "20", "--threads", "1", "--out", &out, "--force"];
    check(|| {
        let mut command = Command::new(BOLIDE);
        command.args(run);
        command
    });
    for name in ["summary.json", "report.html", "checksums.json"] {
        assert!(folder.path().join("out").join(name).is_file(), "{name} of a run whose summary was not read");
    }
    let cluster = repository("deploy/clusters/modern-16.toml").display().to_string();
    for arguments in [
        &["check", &small][..],
        &["check", &small, "--json"],
        &["verify", &out, "--files"],
        &["export", &out, "--format", "vtkhdf"],
        &["picture", &out, "--field", "pressure", "--out", &picture],
        &["materials"],
        &["schema"],
        &["init"],
        &["completions", "bash"],
        &["man"],
        &["simulate", &small, "--cluster", &cluster, "--hosts", "2", "--cycles", "4"],
    ] {
        check(|| {
            let mut command = Command::new(BOLIDE);
            command.args(arguments);
            command
        });
    }
    let cluster = Cluster::start(BOLIDE, false);
    cluster.json(&["submit", &small, "--cycles", "20", "--no-output"]);
    for arguments in [&["jobs"][..], &["jobs", "--json"], &["hosts"], &["top"]] {
        check(|| cluster.command("client", arguments));
    }
}
