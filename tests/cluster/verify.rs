//! What is computed again: results folders, where one flipped bit is named with its place, and intervals of a run with a liar at work.

use std::{fs, path::Path, process::Command};

use tests::cluster::{Cluster, Said, said};

use crate::{BOLIDE, digest_of, run, small};

/// With the deck that the folder holds.
fn verify(results: &Path, arguments: &[&str]) -> Said {
    let mut command = Command::new(BOLIDE);
    said(command.arg("verify").arg(results).args(["--threads", "1"]).args(arguments))
}

/// Flips the lowest bit of a byte.
fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).expect("a file of the run");
    bytes[at] ^= 1;
    fs::write(path, bytes).expect("room");
}

#[test]
fn a_folder_is_equal_until_a_bit_of_a_row_a_state_or_a_snapshot_flips() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut command = Command::new(BOLIDE);
    command.args(["run", &small(), "--workers", "2", "--threads", "1", "--cycles", "300"]);
    command.args(["--snapshot-cycles", "60", "--out"]).arg(&out);
    let ran = said(&mut command);
    assert_eq!(ran.code, Some(0), "{ran:?}");

    let equal = verify(&out, &[]);
    assert_eq!(equal.code, Some(0), "{equal:?}");
    assert!(equal.out.contains("cycles 0 to 300: all is equal"), "{equal:?}");
    let beyond = verify(&out, &["--interval", "9"]);
    assert!(beyond.err.contains("--interval 9: there are 3 (1: cycles 0 to "), "{beyond:?}");
    let backward = verify(&out, &["--from", "200", "--to", "100"]);
    assert!(backward.err.contains("the run has cycles 0 to 300"), "{backward:?}");

    // The last digit of the last row.
    let history = out.join("history.csv");
    let text = fs::read_to_string(&history).expect("a history");
    let digit = text.trim_end().rfind(|c: char| c.is_ascii_digit()).expect("a number");
    flip(&history, digit);
    let found = verify(&out, &["--interval", "3"]);
    assert_eq!(found.code, Some(1), "{found:?}");
    let cycle = text.lines().last().expect("a row").split(',').next().expect("a cell");
    assert!(found.out.contains(&format!("history.csv, row of cycle {cycle}: ")), "{found:?}");
    assert!(found.out.contains("computed again to"), "{found:?}");
    // It is not in the first interval.
    assert_eq!(verify(&out, &["--interval", "1"]).code, Some(0));
    fs::write(&history, text).expect("room");

    // In the size of a block, where compressed numbers stay the same, and within the numbers.
    let state = out.join("state-000000.vtu");
    let bytes = fs::read(&state).expect("a state");
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let start = bytes.windows(marker.len()).position(|window| window == marker).expect("numbers");
    let words =
        [(11, "its numbers are equal, its byte"), (100, "its numbers are equal"), (140, "array velocity")];
    for (offset, words) in words {
        flip(&state, start + marker.len() + offset);
        let found = verify(&out, &["--interval", "1"]);
        assert_eq!(found.code, Some(1), "byte {offset}: {found:?}");
        assert!(found.out.contains("the first difference is in cycle 0: state-000000.vtu: "), "{found:?}");
        assert!(found.out.contains(words), "{found:?}");
        fs::write(&state, &bytes).expect("room");
    }

    let input = out.join("input.deck");
    let text = fs::read_to_string(&input).expect("the deck");
    assert_eq!(text, fs::read_to_string(small()).expect("the deck"));
    fs::write(&input, text.replace("-0.05", "-0.06")).expect("room");
    let refused = verify(&out, &["--interval", "1"]);
    assert!(refused.code == Some(1) && refused.err.contains("input.deck: its BLAKE3 is "), "{refused:?}");
    assert_eq!(verify(&out, &["--deck", &small(), "--interval", "1"]).code, Some(0), "with the deck named");
    let damaged = verify(&out, &["--files"]);
    assert!(damaged.code == Some(1) && damaged.out.contains("input.deck: damaged"), "{damaged:?}");
    fs::write(&input, text).expect("room");
    let whole = verify(&out, &["--files"]);
    assert!(whole.code == Some(0) && whole.out.contains("checksums match"), "{whole:?}");

    // A state whose numbers are others: that of another run.
    let other = folder.path().join("other");
    let text = fs::read_to_string(small()).expect("the deck");
    let deck = folder.path().join("other.toml");
    fs::write(&deck, text.replace("[0, 0, -0.05]", "[0, 0, -0.0500001]")).expect("room");
    let ran = said(Command::new(BOLIDE).arg("run").arg(&deck).args(["--cycles", "1", "--out"]).arg(&other));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    fs::copy(other.join("state-000000.vtu"), &state).expect("room");
    let found = verify(&out, &["--interval", "1"]);
    assert!(
        found.out.contains("velocity of node ")
            && found.out.contains("is -0.0500001, computed again to -0.05"),
        "{found:?}"
    );
    fs::write(&state, &bytes).expect("room");

    let snapshots =
        fs::read_dir(out.join("snapshots")).expect("snapshots").map(|f| f.expect("a file").path());
    let snapshot =
        snapshots.filter(|path| path.extension().is_some_and(|e| e == "bolide")).min().expect("one");
    flip(&snapshot, 4000);
    let found = verify(&out, &[]);
    assert_eq!(found.code, Some(1), "{found:?}");
    assert!(found.out.contains("checksum"), "{found:?}");
}

#[test]
fn a_folder_of_a_run_with_another_end_or_without_its_last_files_is_told_from_a_damaged_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut command = Command::new(BOLIDE);
    command.args(["run", &small(), "--threads", "1", "--end-time", "50", "--out"]).arg(&out);
    let ran = said(&mut command);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let equal = verify(&out, &[]);
    assert_eq!(equal.code, Some(0), "the summary says which end was asked for: {equal:?}");
    // Another end shows in the last step, not before.
    let found = verify(&out, &["--end-time", "60"]);
    assert_eq!(found.code, Some(1), "{found:?}");
    let (first, _) = found.out.split_once(": history.csv, row of cycle ").expect("the last row differs");
    let cycle = first.rsplit(' ').next().and_then(|word| word.parse::<u64>().ok());
    assert!(cycle > Some(100), "{found:?}");

    // A killed run has no summary, and its last state may not have come to the disk.
    let index = fs::read_to_string(out.join("results.pvd")).expect("an index");
    let lines: Vec<&str> = index
        .lines()
        .filter(|line| !["state-000002", "state-000003"].iter().any(|name| line.contains(name)))
        .collect();
    fs::write(out.join("results.pvd"), lines.join("\n")).expect("room");
    fs::remove_file(out.join("summary.json")).expect("a summary");
    let killed = verify(&out, &["--end-time", "50"]);
    assert_eq!(killed.code, Some(0), "{killed:?}");
    // One that is missing between two others was there.
    let lines: Vec<&str> = index.lines().filter(|line| !line.contains("state-000001")).collect();
    fs::write(out.join("results.pvd"), lines.join("\n")).expect("room");
    let found = verify(&out, &["--end-time", "50"]);
    assert_eq!(found.code, Some(1), "{found:?}");
}

/// Each lie is of the kinetic energy of one cycle, in another interval; all intervals are computed by two workers.
#[test]
fn a_worker_that_lies_three_times_is_dismissed_by_name_and_the_run_has_the_bits_of_an_undisturbed_one() {
    let undisturbed = digest_of(&run(&["--cycles", "400"]));
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    cluster.worker_that_fails("liar", "lie:100,lie:200,lie:300");
    let deck = small();
    let job = ["submit", "--wait", "--cycles", "400", "--min-workers", "3", "--snapshot-cycles", "50"];
    let ended = cluster.client(&[&job[..], &["--verify", "1", &deck]].concat());
    assert_eq!(ended.code, Some(0), "{ended:?}\n{}", cluster.master.text());
    let summary = cluster.json(&["watch"]);
    assert_eq!(digest_of(&summary), undisturbed, "{summary}");

    let warnings = summary["warnings"].as_array().expect("a list");
    let named = |cycle: u64| {
        let words = format!("it differs first in cycle {cycle}, on liar: test the memory there");
        warnings.iter().filter(|warning| warning.as_str().is_some_and(|text| text.contains(&words))).count()
    };
    assert_eq!([100, 200, 300].map(named), [1; 3], "{summary}");
    let losses = summary["losses"].as_array().expect("a list");
    assert_eq!((losses.len(), &losses[0]["worker"]), (1, &"liar".into()), "{summary}");
    let why = losses[0]["why"].as_str().expect("a reason");
    assert!(why.starts_with("3 computations of intervals that others computed otherwise name it"), "{why}");
    // It leaves behind the interval that two computations agree on: nothing is computed anew for it.
    assert_eq!(losses[0]["cycle"], losses[0]["back_to"], "{summary}");
    assert!(losses[0]["cycle"].as_u64() > Some(300), "{summary}");
    assert_eq!(summary["workers"], 2, "its work went to the others: {summary}");
    cluster.master.wait_for("worker liar at ");
    // It is kept out as long as this master lives.
    cluster.process_mut("liar").wait_for("name it; test its memory, or keep it out");
}
