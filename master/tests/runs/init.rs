//! `bolide init`: the decks to start from are checked without a warning, run, and replace no file.

use std::{
    fs,
    io::Read,
    path::Path,
    process::{Command, Output, Stdio},
};

use deck::starters::STARTERS;

fn bolide(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    command.current_dir(folder).args(words).output().expect("the binary of this build starts")
}

fn texts(output: &Output) -> [String; 2] {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned())
}

#[test]
fn every_deck_to_start_from_is_checked_without_a_warning_and_runs() {
    let folder = tempfile::tempdir().expect("a folder of its own");
    for starter in STARTERS {
        let file = format!("{}.toml", starter.name);
        let [told, _] = texts(&bolide(folder.path(), &["init", starter.name]));
        assert!(told.starts_with(&format!("wrote {file}")), "{told}");
        let [checked, doubts] = texts(&bolide(folder.path(), &["check", &file]));
        assert!(checked.starts_with(&format!("{file}: no fault;")), "{file}: {checked}{doubts}");
        assert!(doubts.is_empty(), "{file}: {doubts}");
        let run = bolide(folder.path(), &["run", &file, "--cycles", "12"]);
        let [_, log] = texts(&run);
        assert!(run.status.success(), "{file}: {log}");
        let results = format!("results/{}", starter.name);
        let summary = fs::read_to_string(folder.path().join(&results).join("summary.json"));
        let summary: serde_json::Value =
            serde_json::from_str(&summary.expect("a run writes a summary")).expect("JSON");
        assert_eq!(summary["cycles"], 12, "{file}");
        // The field that the picture is suggested with is in the states.
        let picture = bolide(
            folder.path(),
            &[
                "picture",
                &results,
                "--field",
                starter.field,
                "--out",
                "a.png",
                "--width",
                "64",
                "--height",
                "64",
            ],
        );
        assert!(picture.status.success(), "{file}: {}", texts(&picture)[1]);
    }
}

#[test]
fn a_file_that_is_there_stays_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder of its own");
    fs::write(folder.path().join("taylor.toml"), "mine").expect("a new file");
    let refused = bolide(folder.path(), &["init", "taylor"]);
    let [_, told] = texts(&refused);
    assert_eq!(refused.status.code(), Some(1));
    assert!(told.contains("taylor.toml: is there already"), "{told}");
    assert_eq!(fs::read_to_string(folder.path().join("taylor.toml")).expect("a file"), "mine");
    let other = bolide(folder.path(), &["init", "taylor", "other.toml"]);
    assert!(other.status.success(), "{:?}", texts(&other));
    let printed = bolide(folder.path(), &["init", "taylor", "-"]);
    assert_eq!(printed.stdout, fs::read(folder.path().join("other.toml")).expect("a file"));
}

/// A pager that is left before the end.
#[test]
fn a_reader_that_leaves_early_is_no_fault() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    let mut child = command.args(["schema"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let child = child.as_mut().expect("the binary of this build starts");
    drop(child.stdout.take());
    let mut told = String::new();
    child.stderr.take().expect("a pipe").read_to_string(&mut told).expect("text");
    assert!(child.wait().expect("it ends").success(), "{told}");
    assert!(told.is_empty(), "{told}");
}

#[test]
fn an_unknown_deck_is_told_with_the_near_one_and_none_lists_all() {
    let folder = tempfile::tempdir().expect("a folder of its own");
    let [_, told] = texts(&bolide(folder.path(), &["init", "tailor"]));
    assert!(told.contains("\"tailor\"") && told.contains("write taylor"), "{told}");
    let [listed, _] = texts(&bolide(folder.path(), &["init"]));
    for starter in STARTERS {
        assert!(listed.contains(starter.about), "{listed}");
    }
}
