//! Runs that cannot begin, and runs into folders that hold something: what was there stays until it is replaced for good.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use tests::{
    cluster::{Process, Said, said, until},
    left::Left,
};

use crate::{BOLIDE, LONG, small};

/// `bolide run` of the small deck with one thread in a folder.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(BOLIDE);
    command.args(["run", &small(), "--threads", "1"]).args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Said {
    said(&mut command(folder, arguments))
}

/// Every file below a folder with its bytes.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("readable").path();
        match path.is_dir() {
            true => files.extend(self::files(&path)),
            false => files.push((path.clone(), fs::read(&path).expect("readable"))),
        }
    }
    files.sort();
    files
}

#[test]
fn results_of_before_stay_where_the_next_run_cannot_begin() {
    let folder = tempfile::tempdir().expect("a folder");
    let first = run(folder.path(), &["--cycles", "120", "--snapshot-cycles", "50", "--out", "out"]);
    assert_eq!(first.code, Some(0), "{first:?}");
    let out = folder.path().join("out");
    let before = files(&out);
    assert!(before.iter().any(|(path, _)| path.ends_with("checksums.json")), "{first:?}");
    assert!(before.iter().any(|(path, _)| path.starts_with(out.join("snapshots"))), "{first:?}");
    let lanes = if cfg!(target_arch = "x86_64") { "neon" } else { "avx2" };
    for (flags, why) in [
        (&["--perturb", "1e-4:1"][..], "inside the contact gap"),
        (&["--lanes", lanes], "is not on this machine"),
        (&["--trace", "none/trace.json"], "cannot create none/trace.json"),
        (&["--trace", "out"], "cannot create out"),
        (&["--trace", ".."], "cannot create .."),
        (&["--resume", "none"], "none"),
        (&["--processes"], "starting /none worker"),
    ] {
        let mut command = command(folder.path(), &["--out", "out", "--force"]);
        let refused = said(command.args(flags).env("BOLIDE_BINARY", "/none"));
        assert!(refused.code == Some(1) && refused.err.contains(why), "{flags:?}: {refused:?}");
        assert!(!refused.err.contains("panicked"), "{flags:?}: {refused:?}");
        assert!(files(&out) == before, "{flags:?} changed what was there");
    }
    let replaced = run(folder.path(), &["--cycles", "20", "--out", "out", "--force"]);
    assert_eq!(replaced.code, Some(0), "{replaced:?}");
    assert!(!out.join("snapshots").exists(), "what another run stored goes with its states");
}

#[test]
fn two_runs_do_not_write_to_one_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut first = Process::start("first", &mut command(folder.path(), &["--cycles", LONG, "--out", "out"]));
    let history = folder.path().join("out/history.csv");
    until(|| first.text(), || history.is_file().then_some(()));
    let second = run(folder.path(), &["--cycles", "20", "--out", "./out", "--force"]);
    assert!(second.code == Some(1) && second.err.contains("another run writes to this folder"), "{second:?}");
    assert!(history.is_file() && first.is_alive(), "{}", first.text());
    first.kill();
    let third = run(folder.path(), &["--cycles", "20", "--out", "out", "--force"]);
    assert_eq!(third.code, Some(0), "a killed run leaves no lock: {third:?}");
}

#[test]
fn a_trace_that_cannot_be_written_costs_no_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let flags = ["--cycles", "2400", "--out", "out", "--trace", "trace.json"];
    let mut run = Process::start("run", &mut command(folder.path(), &flags));
    until(|| run.text(), || folder.path().join("out/history.csv").is_file().then_some(()));
    // Nobody may write over a folder, root neither.
    fs::create_dir(folder.path().join("trace.json")).expect("room");
    assert_eq!(run.wait().code(), Some(1), "{}", run.text());
    run.wait_for("trace.json: Is a directory");
    run.wait_for("  digest ");
    for name in ["summary.json", "report.html", "checksums.json"] {
        assert!(folder.path().join("out").join(name).is_file(), "{name}: {}", run.text());
    }
}

#[test]
fn a_run_that_resumes_from_its_own_folder_goes_on_there_by_whatever_path() {
    let folder = tempfile::tempdir().expect("a folder");
    let flags = ["--cycles", "300", "--snapshot-cycles", "100", "--json"];
    let left = |said: &Said| {
        let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
        Left::of(&folder.path().join("out"), &summary)
    };
    let with = |more: &[&str]| run(folder.path(), &[&flags[..], more].concat());
    let first = left(&with(&["--out", "out"]));
    assert!(first.files.iter().filter(|(name, _)| name.ends_with(".vtu")).count() > 2);
    // A run that goes on may keep another.
    let oldest = || {
        let snapshots = fs::read_dir(folder.path().join("out/snapshots")).expect("stored");
        let names =
            snapshots.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned());
        let oldest = names.filter(|name| name.ends_with(".bolide")).min().expect("one is kept");
        format!("out/snapshots/{oldest}")
    };
    let elsewhere = with(&["--resume", &oldest(), "--out", "other"]);
    assert_eq!(elsewhere.code, Some(0), "{elsewhere:?}");
    assert!(elsewhere.err.contains("other will lack the "), "{elsewhere:?}");
    let by_another_path = || "out/../out".to_owned();
    for from in [&by_another_path as &dyn Fn() -> String, &oldest] {
        let said = with(&["--resume", &from(), "--out", "out", "--force"]);
        assert!(!said.err.contains("will lack"), "{said:?}");
        left(&said).assert_same(&first);
    }
    fs::remove_file(folder.path().join("out/state-000000.vtu")).expect("it is there");
    let refused = with(&["--resume", &oldest(), "--out", "out"]);
    assert!(refused.code == Some(1) && refused.err.contains("give --resume out"), "{refused:?}");
}

#[test]
fn nothing_is_said_of_the_quality_of_a_run_that_computed_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = command(folder.path(), &["--cycles", "40", "--no-output", "--processes"]);
    let said = said(command.env(tests::failpoint::VARIABLE, "die-in-load:1"));
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.out.contains(", 0 cycles to 0 us"), "{said:?}");
    assert!(!said.out.contains("  quality") && !said.out.contains("  digest"), "{said:?}");
}
