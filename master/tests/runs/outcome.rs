//! What a run says when it is over: the verdict on its quality, where it comes from, pictures in its report, and how it changes with the
//! mesh.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use master::{
    quality::Grade,
    results::{REPORT, SUMMARY, SUMS, Summary},
};

/// A bar of copper that strikes a wall and loses the elements that it strikes with; a gauge stands there.
const BAR: &str = "title = \"bar\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.01\n[symmetry]\nplanes = [\"x\", \"y\"]\n\
    [[part]]\nname = \"bar\"\nmaterial = \"COPPER_TAYLOR_BENCHMARK\"\nvelocity = [0, 0, -227]\nerosion = { plastic_strain = 0.3 }\n\
    box = { origin = [-2, -2, 0], size = [4, 4, 12], cells = [4, 4, 12] }\n[[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
    [[gauge]]\nname = \"front\"\npoint = [0, 0, 0]\n[[gauge]]\nname = \"rear\"\npoint = [0, 0, 12]\n";

fn run(folder: &Path, deck: &str, flags: &[&str]) -> String {
    fs::write(folder.join("bar.toml"), deck).expect("room");
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    let done =
        command.current_dir(folder).args(["run", "bar.toml"]).args(flags).output().expect("bolide runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8_lossy(&done.stdout).into_owned()
}

fn summary(folder: &Path) -> Summary {
    let text = fs::read_to_string(folder.join(SUMMARY)).expect("a run writes a summary");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn a_run_is_judged_and_says_where_it_comes_from() {
    let folder = tempfile::tempdir().expect("room");
    let told = run(folder.path(), BAR, &[]);
    let results = folder.path().join("results/bar");
    let eroded = summary(&results);
    assert!(eroded.eroded_elements > 0, "the deck erodes");
    let grade = |name: &str| {
        let found = eroded.quality.measures.iter().find(|measure| measure.name == name);
        found.unwrap_or_else(|| panic!("{name} in {:?}", eroded.quality)).grade
    };
    assert_eq!(grade("gauges that lost their last element"), Grade::Look);
    assert_eq!(grade("elements across bar"), Grade::Look);
    assert!(eroded.quality.grade >= Grade::Look);
    assert_eq!(eroded.mirrors, [true, true, false]);
    // The verdict stands before the energies, the machinery is not told unasked.
    let place = |words: &str| told.find(words).unwrap_or_else(|| panic!("{words} in {told}"));
    assert!(
        place("quality    ") < place("energy     ")
            && place("end their curves there: front") < place("energy     ")
    );
    assert!(told.contains("origin     bolide 0.1.0, ") && told.contains(", bar.toml, on "), "{told}");
    assert!(!told.contains("traffic"), "{told}");
    // The report has the verdict, both states as pictures, and nothing that is fetched.
    let report = fs::read_to_string(results.join(REPORT)).expect("a run writes a report");
    assert_eq!(
        report.matches("<img alt=\"plastic strain, t = ").count()
            + report.matches("<img alt=\"velocity ").count(),
        2
    );
    assert!(
        report.contains("quality    ") && report.contains("traffic    ") && !report.contains("src=\"http")
    );

    let told = run(
        folder.path(),
        &BAR.replace("erosion = { plastic_strain = 0.3 }\n", ""),
        &["--force", "--verbose"],
    );
    assert!(told.contains("traffic    "), "{told}");
    let whole = summary(&results);
    assert!(
        whole.quality.measures.iter().all(|measure| !measure.name.starts_with("gauges")),
        "{:?}",
        whole.quality
    );
}

#[test]
fn a_run_that_is_over_and_lacks_its_report_or_its_checksums_is_completed() {
    let folder = tempfile::tempdir().expect("room");
    run(folder.path(), BAR, &["--cycles", "20"]);
    let results = folder.path().join("results/bar");
    let read = |name: &str| fs::read(results.join(name)).expect("written");
    let (report, sums) = (read(REPORT), read(SUMS));
    for missing in [&[SUMS][..], &[REPORT, SUMS]] {
        missing.iter().for_each(|name| fs::remove_file(results.join(name)).expect("it is there"));
        let told = run(folder.path(), BAR, &["--cycles", "20", "--resume", "results/bar"]);
        assert!(told.contains("that run is over; what its results lacked is written"), "{told}");
        assert_eq!((read(REPORT) == report, read(SUMS) == sums), (true, true), "{missing:?}");
    }
}

#[test]
fn workers_of_the_most_unlike_speeds_compute_the_same() {
    let folder = tempfile::tempdir().expect("room");
    let digest = |speeds: &str| {
        run(folder.path(), BAR, &["--cycles", "20", "--force", "--speeds", speeds]);
        summary(&folder.path().join("results/bar")).digest
    };
    let one = digest("1");
    assert_eq!([digest("1e6,1e-6"), digest("1e-6,1e6,1")], [one.clone(), one]);
}

#[test]
fn a_refined_run_is_compared_with_the_deck_as_it_is() {
    let folder = tempfile::tempdir().expect("room");
    let deck = BAR.replace("erosion = { plastic_strain = 0.3 }\n", "");
    let told = run(folder.path(), &deck, &["--refine", "2", "--measure", "last(rear:uz)", "--cycles", "400"]);
    let [coarse, fine] =
        ["bar", "bar-refined-2"].map(|name| summary(&folder.path().join("results").join(name)));
    assert_eq!(8 * coarse.elements, fine.elements);
    let row =
        told.lines().find(|line| line.starts_with("last(rear:uz)")).expect("the measure that was asked for");
    let values: Vec<f64> =
        row.split_whitespace().skip(1).take(2).map(|v| v.parse().expect("a number")).collect();
    assert!(values[0] < 0.0 && values[1] < 0.0 && values[0] != values[1], "{row}");
    assert!(told.contains("finer results in results/bar-refined-2"), "{told}");
    // A folder of results says what it was computed from: the finer one is computed again as it was.
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    let verified = command.current_dir(folder.path()).args(["verify", "results/bar-refined-2"]).output();
    let verified = verified.expect("bolide runs");
    assert!(verified.status.success(), "{}", String::from_utf8_lossy(&verified.stderr));
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    let wrong = command
        .current_dir(folder.path())
        .args(["run", "bar.toml", "--refine", "2", "--measure", "lost(x)"])
        .output();
    let wrong = String::from_utf8_lossy(&wrong.expect("bolide runs").stderr).into_owned();
    assert!(wrong.contains("--measure \"lost(x)\""), "{wrong}");
}

#[test]
fn tetrahedra_of_ten_nodes_are_solids_of_their_corners_in_d3plot() {
    let folder = tempfile::tempdir().expect("room");
    let mesh = "bolide mesh 1\nnodes 10\n1 0 0 0\n2 10 0 0\n3 0 10 0\n4 0 0 10\n5 5 0 0\n6 5 5 0\n7 0 5 0\n8 0 0 5\n9 5 0 5\n10 0 5 5\n\
        solids 1 \"tet\"\n1 1 2 3 4 5 6 7 8 9 10\n";
    fs::write(folder.path().join("tet.mesh"), mesh).expect("room");
    let deck = "title = \"tet\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.001\n[output]\nformats = [\"d3plot\"]\n\
        [[part]]\nname = \"tet\"\nmaterial = \"STEEL_1006\"\nvelocity = [0, 0, -50]\nmesh = { file = \"tet.mesh\" }\n";
    run(folder.path(), deck, &[]);
    let bytes = fs::read(folder.path().join("results/bar/d3plot")).expect("the format that was asked for");
    let word = |index: usize| i32::from_le_bytes(bytes[4 * index..4 * index + 4].try_into().expect("a word"));
    // Nodes, solids, shells; behind the control words and the positions are the corners and the part.
    assert_eq!([16, 23, 31].map(word), [10, 1, 0]);
    assert_eq!([0, 1, 2, 3, 4, 5, 6, 7, 8].map(|i| word(64 + 30 + i)), [1, 2, 3, 3, 4, 4, 4, 4, 1]);
}

#[test]
fn a_format_that_cannot_be_written_takes_nothing_from_the_run() {
    let folder = tempfile::tempdir().expect("room");
    let deck = BAR.replace("end_time = 0.01", "end_time = 0.02");
    fs::write(folder.path().join("bar.toml"), deck).expect("room");
    let results = folder.path().join("results/bar");
    let mut command = Command::new(env!("CARGO_BIN_EXE_bolide"));
    command.current_dir(folder.path()).args(["run", "bar.toml", "--format", "vtkhdf,d3plot"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("bolide runs");
    // Once the run writes, something stands where one of the formats goes.
    while !results.join("input.deck").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    fs::create_dir_all(results.join(".results.vtkhdf.tmp/full")).expect("room");
    let done = child.wait_with_output().expect("it ends");
    let [told, warned] = [done.stdout, done.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(done.status.code(), Some(1), "{told}{warned}");
    assert!(told.contains("digest") || told.contains("results in"), "{told}");
    assert!(warned.contains("format vtkhdf is missing, it cannot be written: "), "{warned}");
    assert!(warned.contains("bolide export writes it later"), "{warned}");
    let whole = summary(&results);
    assert!(!whole.digest.is_empty() && whole.warnings.iter().any(|words| words.contains("vtkhdf")));
    for name in ["d3plot", "checksums.json", REPORT] {
        assert!(results.join(name).is_file(), "{name}");
    }
}
