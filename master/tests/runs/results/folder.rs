//! Folders that are taken, vanish or are full.

use std::fs;

use master::results::{
    self, Error, Folder,
    history::{History, Table},
    summary::Summary,
    vtu::Series,
};

use super::{dented, plates, row, scratch, summary};

#[test]
fn folder_with_content_is_refused_without_force_and_loses_only_results_with_it() {
    let path = scratch("folder");
    let folder = Folder::create(&path, false).expect("did not exist");
    let error = Folder::create(&path, true).expect_err("a run has it");
    assert!(matches!(&error, Error::Taken { path: named } if *named == path), "{error:?}");
    drop(folder);
    let folder = Folder::create(&path, false).expect("empty");
    for name in ["state-000000.vtu", ".state-000001.vtu.tmp", "results.pvd", "history.csv", "summary.json"] {
        fs::write(folder.file(name), "old").expect("writable");
    }
    for name in ["notes.txt", "state-mine.vtu"] {
        fs::write(folder.file(name), "mine").expect("writable");
    }
    drop(folder);
    let error = Folder::create(&path, false).expect_err("not empty");
    assert!(matches!(&error, Error::NotEmpty { path: named } if *named == path), "{error:?}");
    assert!(error.to_string().contains("--force") && error.to_string().contains("folder"), "{error}");
    assert_eq!(fs::read_dir(&path).expect("exists").count(), 7, "a refusal removes nothing");

    Folder::create(&path, true).expect("forced");
    let mut left: Vec<_> = fs::read_dir(&path)
        .expect("exists")
        .map(|e| e.expect("readable").file_name().into_string())
        .collect();
    left.sort();
    assert_eq!(left, [Ok("notes.txt".to_owned()), Ok("state-mine.vtu".to_owned())]);
}

#[test]
fn place_that_cannot_be_a_folder_is_an_error_that_names_it() {
    let folder = Folder::create(&scratch("blocked"), false).expect("fresh folder");
    let file = folder.file("results");
    fs::write(&file, "a file").expect("writable");
    for path in [file.clone(), file.join("below")] {
        for force in [false, true] {
            let error = Folder::create(&path, force).expect_err("a file is in the way");
            assert!(matches!(&error, Error::Io { path: named, .. } if *named == path), "{error:?}");
            assert!(error.to_string().contains(path.to_str().expect("UTF-8")), "{error}");
        }
    }
    // A folder in the place of a file that a run writes.
    let taken = scratch("taken");
    fs::create_dir_all(taken.join("results.pvd")).expect("writable");
    let error = Folder::create(&taken, true).expect_err("cannot remove a folder");
    assert!(
        error.to_string().starts_with(&format!("cannot remove {}", taken.join("results.pvd").display())),
        "{error}"
    );
}

#[test]
fn folder_that_vanishes_during_a_run_is_an_error_that_names_the_file() {
    let model = plates(2);
    let path = scratch("vanished");
    let folder = Folder::create(&path, false).expect("fresh folder");
    let mut series = Series::new(&folder, &model).expect("known fields");
    fs::remove_dir_all(&path).expect("just made");
    let error = series.write(&model, &dented(&model, 0, 0.0), None).expect_err("no folder");
    assert!(
        error.to_string().starts_with(&format!("cannot create {}", path.join("state-000000.vtu").display())),
        "{error}"
    );
    assert!(series.times().is_empty());
    assert!(matches!(summary(&model).write(&folder), Err(Error::Io { action: "create", .. })));
    assert!(matches!(History::create(&folder, &model), Err(Error::Io { action: "create", .. })));
}

/// Runs [`body_under_a_file_size_limit`] in a process whose files may grow to 8 KiB: further writes fail as on a
/// full disk.
#[test]
#[cfg(unix)]
fn write_that_does_not_fit_loses_nothing_that_was_written_before() {
    let run = std::process::Command::new("bash")
        .args([
            "-c",
            "trap '' XFSZ; ulimit -f 12; exec \"$0\" --exact --ignored results::folder::body_under_a_file_size_limit",
        ])
        .arg(std::env::current_exe().expect("a test runs from a file"))
        .output()
        .expect("bash is there");
    let text = String::from_utf8_lossy(&run.stdout);
    assert!(
        run.status.success() && text.contains("1 passed"),
        "{text}{}",
        String::from_utf8_lossy(&run.stderr)
    );
}

#[test]
#[cfg(unix)]
#[ignore = "started under a limit by write_that_does_not_fit_loses_nothing_that_was_written_before"]
fn body_under_a_file_size_limit() {
    let folder = Folder::create(&scratch("limit"), false).expect("fresh folder");
    let model = plates(2);

    let mut history = History::create(&folder, &model).expect("the header fits");
    let mut n_rows = 0;
    let error = loop {
        match history.append(&row(&model, n_rows)) {
            Ok(()) => n_rows += 1,
            Err(error) => break error,
        }
        assert!(n_rows < 1000, "12 KiB hold fewer rows");
    };
    assert!(
        error.to_string().starts_with(&format!("cannot write {}", folder.file("history.csv").display())),
        "{error}"
    );
    let table = Table::read(&folder.file(results::HISTORY)).expect("whole rows only");
    assert_eq!(table.rows.len() as u64, n_rows);
    assert!(n_rows > 5, "{n_rows} rows");

    let mut series = Series::new(&folder, &model).expect("known fields");
    let error = series.write(&model, &dented(&model, 0, 0.0), None).err();
    assert!(error.is_none(), "a small state fits: {error:?}");
    let index = fs::read(folder.file(results::PVD)).expect("written");
    let large = plates(8);
    let error = series.write(&large, &dented(&large, 1, 1.0), None).expect_err("does not fit");
    assert!(
        matches!(&error, Error::Io { action: "write", path, .. } if *path == folder.file("state-000001.vtu")),
        "{error:?}"
    );
    assert_eq!(fs::read(folder.file(results::PVD)).expect("still there"), index);
    assert_eq!(series.times(), [0.0]);
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .expect("exists")
        .map(|e| e.expect("readable").file_name().into_string())
        .collect();
    names.sort();
    assert_eq!(names, ["history.csv", "results.pvd", "state-000000.vtu"].map(|n| Ok(n.to_owned())));
}

/// A whole folder as a run leaves it, for readers outside this repository: `target/tmp/results/whole`.
#[test]
fn whole_folder_of_a_run_holds_states_index_history_and_summary() {
    let mut model = plates(20);
    model.output.fields = results::FIELD_NAMES.map(String::from).to_vec();
    model.output.compress = true;
    let worker: Vec<u32> = (0..model.mesh.n_elements() as u32).map(|e| e / 1000).collect();
    let folder = Folder::create(&scratch("whole"), false).expect("fresh folder");
    let mut series = Series::new(&folder, &model).expect("known fields");
    let mut history = History::create(&folder, &model).expect("fresh folder");
    for cycle in 0..3 {
        series.write(&model, &dented(&model, cycle, 2.0 * cycle as f64), Some(&worker)).expect("written");
        history.append(&row(&model, cycle)).expect("written");
    }
    let end = Summary { cycles: 3, end_time: dented(&model, 2, 0.0).time, ..summary(&model) };
    end.write(&folder).expect("written");
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .expect("exists")
        .map(|e| e.expect("readable").file_name().into_string())
        .collect();
    names.sort();
    let states = [0, 1, 2].map(results::state_name);
    let mut expected = vec!["history.csv", "results.pvd"];
    expected.extend(states.iter().map(String::as_str));
    expected.push("summary.json");
    assert_eq!(names, expected.into_iter().map(|n| Ok(n.to_owned())).collect::<Vec<_>>());
}
