//! Runs whose physics goes wrong end with a named message, a failing exit code and their results on disk.

use std::{path::Path, process::Command};

use master::results::{HISTORY, SUMMARY, history::Table};

const SOLID: &str = "material = { density = 8000, eos = { type = \"linear\", bulk = 66e9 }, strength = { type = \"elastic\", shear = 100e9 } }\n";
const CUBE: &str = "box = { origin = [0, 0, 0], size = [0.01, 0.01, 0.01], cells = [1, 1, 1] }\n";

/// What the binary said of a deck, after its exit code; its results are in `folder/out`.
fn run(folder: &Path, deck: &str, flags: &[&str]) -> (Option<i32>, String) {
    let file = folder.join("deck.toml");
    std::fs::write(&file, deck).expect("a file");
    let run = Command::new(env!("CARGO_BIN_EXE_bolide"))
        .arg("run")
        .arg(&file)
        .arg("--out")
        .arg(folder.join("out"))
        .args(flags)
        .output()
        .expect("it starts");
    (run.status.code(), String::from_utf8_lossy(&run.stderr).into_owned())
}

/// The deck fails with these words, alike on one worker and on two, and its results are there.
fn fails_with(deck: &str, words: &[&str]) {
    let mut reasons = Vec::new();
    for workers in ["1", "2"] {
        let folder = tempfile::tempdir().expect("a folder");
        let (code, err) = run(folder.path(), deck, &["--workers", workers, "--threads", "1"]);
        assert_eq!(code, Some(1), "{err}");
        for word in words {
            assert!(err.contains(word), "{word}: {err}");
        }
        let out = folder.path().join("out");
        let rows = Table::read(&out.join(HISTORY)).expect("a history").rows;
        let summary = std::fs::read_to_string(out.join(SUMMARY)).expect("a summary");
        let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
        let last = rows.last().expect("a row");
        assert_eq!(
            summary["energies"]["kinetic"].as_f64(),
            Some(last[3]),
            "the last row is that of the failure"
        );
        assert!(out.join("state-000000.vtu").exists() && out.join("state-000001.vtu").exists());
        reasons.push(err.lines().last().map(str::to_owned));
    }
    assert_eq!(reasons[0], reasons[1]);
}

#[test]
fn an_element_that_is_turned_inside_out_ends_the_run_with_its_volumes() {
    // 1 g at each corner: 1e10 N move it by far more than the cube within a step.
    let deck = format!(
        "title = \"inverted\"\nunits = \"SI\"\n[control]\nend_cycle = 50\n[[part]]\nname = \"cube\"\n{SOLID}{CUBE}\
         [[boundary]]\ntype = \"fixed\"\nface = \"k-min\"\n[[load]]\ntype = \"force\"\nface = \"k-max\"\nforce = [0, 0, -1e10]\n"
    );
    fails_with(&deck, &["of part `cube`: volume -", "at first 1", "refine the mesh"]);
}

#[test]
fn a_time_step_under_its_floor_ends_the_run_with_what_holds_it_down() {
    let deck = |floor: &str| {
        format!(
            "title = \"crushed\"\nunits = \"SI\"\n[control]\nend_cycle = 5000\n{floor}[[part]]\nname = \"cube\"\n{SOLID}{CUBE}\
             [[boundary]]\ntype = \"fixed\"\nface = \"k-min\"\n[[boundary]]\ntype = \"velocity\"\nface = \"k-max\"\nvelocity = {{ z = -100 }}\n"
        )
    };
    fails_with(
        &deck("time_step_floor = 5e-7\n"),
        &["time step ", "at least 5e-7", "of part `cube` holds it down"],
    );
    fails_with(&deck(""), &["time step ", " at cycle ", "control.time_step_floor"]);
}

#[test]
fn an_energy_error_above_the_limit_of_the_deck_ends_the_run_with_the_part() {
    let bars = include_str!("../../../deck/examples/two-bars.toml");
    let limited = bars.replace("end_time = 80e-6", "end_time = 80e-6\nenergy_error = 1e-7");
    assert_ne!(bars, limited);
    fails_with(&limited, &["energy error ", "at most 1e-7", "gained most", "control.energy_error"]);
    let folder = tempfile::tempdir().expect("a folder");
    let (code, err) = run(folder.path(), bars, &["--threads", "1"]);
    assert_eq!(code, Some(0), "{err}");
    let history = Table::read(&folder.path().join("out").join(HISTORY)).expect("a history");
    let sum = |kind: &str| {
        let of = |part: &str| history.column(&format!("{part}:{kind}")).expect("a column");
        of("striker").into_iter().zip(of("struck")).map(|(a, b)| a + b).collect::<Vec<f64>>()
    };
    let summary = std::fs::read_to_string(folder.path().join("out").join(SUMMARY)).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let energies = &summary["energies"];
    assert_eq!(energies["contacts"][0]["parts"], serde_json::json!(["striker", "struck"]));
    assert_eq!(energies["contacts"][0]["contact"], energies["contact"], "one pair has all of it");
    for kind in ["kinetic", "internal", "hourglass", "external"] {
        assert_eq!(history.column(kind).expect("a column"), sum(kind), "{kind} of the parts adds up exactly");
    }
}

#[test]
fn a_start_inside_another_part_is_refused_or_ignored_pair_by_pair() {
    // Two plates of two cubes each, the upper a tenth of a gap into the zone of the lower and sliding off.
    let deck = |more: &str| {
        format!(
            "title = \"inside\"\nunits = \"SI\"\n[control]\nend_time = 2e-5\n[[part]]\nname = \"below\"\n{SOLID}\
             box = {{ origin = [0, 0, 0], size = [0.08, 0.01, 0.01], cells = [8, 1, 1] }}\n\
             [[part]]\nname = \"above\"\nvelocity = [10, 0, -1]\n{SOLID}\
             box = {{ origin = [0.0031, 0.002, 0.0105], size = [0.01, 0.006, 0.01], cells = [1, 1, 1] }}\n\
             [contact]\ngap_length = 0.001\n{more}"
        )
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (code, err) = run(folder.path(), &deck(""), &["--threads", "1"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("parts at least one gap"), "{err}");
    for workers in ["1", "2"] {
        let folder = tempfile::tempdir().expect("a folder");
        let ignored = deck("initial_penetration = \"ignore\"\n");
        let (code, err) = run(folder.path(), &ignored, &["--workers", workers, "--threads", "1"]);
        assert_eq!(code, Some(0), "{err}");
        let history = Table::read(&folder.path().join("out").join(HISTORY)).expect("a history");
        let pushed = history.column("contact").expect("a column").into_iter().fold(0.0, f64::max);
        assert_eq!(pushed, 0.0, "nothing that starts there is pushed");
    }
}
