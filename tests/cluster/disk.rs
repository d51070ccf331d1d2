//! Masters that die or are told to leave, disks that fill, snapshots that are torn: the run goes on where it was stored,
//! with the digest, the history and the files of one that nothing happened to.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

use tests::{
    cluster::{Cluster, Process, said, until},
    left::Left,
};

use crate::{BOLIDE, digest_of, small};

const CYCLES: &str = "2400";

/// The run that nothing happens to.
fn undisturbed() -> &'static Left {
    static RUN: OnceLock<Left> = OnceLock::new();
    RUN.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out");
        let said = said(
            Command::new(BOLIDE).arg("run").arg(small()).args(flags()).arg("--json").arg("--out").arg(&out),
        );
        let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
        let left = Left::of(&out, &summary);
        let states = left.files.iter().filter(|(name, _)| name.ends_with(".vtu")).count();
        assert!(states >= 4, "states on the way are compared as well; there are {states}");
        left
    })
}

fn flags() -> [&'static str; 4] {
    ["--cycles", CYCLES, "--threads", "1"]
}

/// A cluster with workers `a`, `b` and its first job under way, stored every 100 cycles.
fn running(flags: &[&str], fail: Option<&str>) -> (Cluster, Process) {
    let mut cluster = Cluster::start_with(BOLIDE, false, flags, fail);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    let submitted = submit(&cluster);
    cluster.wait_until_running(1);
    (cluster, submitted)
}

fn submit(cluster: &Cluster) -> Process {
    let deck = small();
    let arguments =
        ["submit", "--wait", "--cycles", CYCLES, "--min-workers", "2", "--snapshot-cycles", "100", &deck];
    Process::start("submit", &mut cluster.command("client", &arguments))
}

fn wait_for_cycle(cluster: &Cluster, cycle: u64) {
    until(
        || format!("cycle {cycle}; {}", cluster.job(1)),
        || (cluster.job(1)["cycle"].as_u64() >= Some(cycle)).then_some(()),
    );
}

/// Waits until so many snapshots of the job were committed.
fn wait_for_snapshot(cluster: &Cluster, number: u64) {
    let manifest = cluster.snapshots(1).join("manifest.json");
    let newest = || {
        let text = fs::read(&manifest).ok()?;
        let manifest: serde_json::Value = serde_json::from_slice(&text).ok()?;
        manifest["generations"][0]["number"].as_u64()
    };
    until(|| format!("snapshot {number}; {}", cluster.master.text()), || (newest()? >= number).then_some(()));
}

/// The summary of the job, whose results are those of the undisturbed run.
fn same_as_undisturbed(cluster: &Cluster) -> serde_json::Value {
    let summary = cluster.json(&["watch", "1"]);
    Left::of(&cluster.results(1), &summary).assert_same(undisturbed());
    assert_eq!(cluster.job(1)["state"], "done");
    summary
}

/// The newest snapshot file of the job that was committed.
fn newest_snapshot(cluster: &Cluster) -> PathBuf {
    let manifest = fs::read(cluster.snapshots(1).join("manifest.json")).expect("a manifest");
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).expect("whole");
    let number = manifest["generations"][0]["number"].as_u64().expect("a number");
    cluster.snapshots(1).join(format!("snapshot-{number:06}.bolide"))
}

#[test]
fn a_killed_master_finds_its_queue_and_goes_on_with_its_job() {
    let (mut cluster, _submitted) = running(&[], None);
    let second = small();
    assert_eq!(cluster.json(&["submit", &second, "--cycles", "40"])["job"], 2);
    assert_eq!(cluster.json(&["submit", &second, "--cycles", "40", "--priority", "1"])["job"], 3);
    assert_eq!(cluster.client(&["cancel", "2"]).code, Some(0));
    wait_for_snapshot(&cluster, 2);
    cluster.master.kill();
    cluster.restart_master();
    let states: Vec<_> = (1..=3).map(|job| cluster.job(job)["state"].clone()).collect();
    assert_eq!(states[1..], ["cancelled", "queued"]);
    cluster.master.wait_for("the job goes on");
    assert_eq!(cluster.master.count("the job goes on job=1 cycle=0"), 0, "{}", cluster.master.text());
    let summary = same_as_undisturbed(&cluster);
    assert_eq!(summary["workers"], 2, "both dialled again and were taken in");
    assert_eq!(digest_of(&cluster.json(&["watch", "3"])), crate::reference());
    assert_eq!(cluster.client(&["results", "1", "--out", "fetched"]).code, Some(0));
    assert!(cluster.folder().join("fetched/history.csv").is_file());
    assert!(!cluster.snapshots(1).exists(), "a job that is over needs no snapshots");
    assert_eq!(cluster.json(&["submit", &second, "--cycles", "40"])["job"], 4, "numbers go on");
    // What was over before a restart is there after it.
    cluster.master.kill();
    cluster.restart_master();
    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), undisturbed().digest);
}

#[test]
fn a_master_that_is_told_to_leave_stores_its_job_and_computes_no_cycle_twice() {
    let (mut cluster, _submitted) = running(&[], None);
    wait_for_cycle(&cluster, 300);
    cluster.master.signal("TERM");
    assert_eq!(cluster.master.wait().code(), Some(0), "{}", cluster.master.text());
    let line = cluster.master.wait_for("the job is stored and waits for the next master");
    let cycle = |line: &str| {
        line.rsplit("cycle=").next().and_then(|n| n.split_whitespace().next()?.parse::<u64>().ok())
    };
    let stored = cycle(&line.replace("Some(", "").replace(')', "")).expect("a cycle");
    assert!(stored >= 300, "{line}");
    cluster.restart_master();
    cluster.master.wait_for(&format!("the job goes on job=1 cycle={stored}"));
    same_as_undisturbed(&cluster);
}

#[test]
fn a_master_and_a_worker_killed_at_once_leave_the_same_files() {
    let (mut cluster, _submitted) = running(&[], None);
    wait_for_snapshot(&cluster, 1);
    cluster.kill_worker("b");
    cluster.master.kill();
    cluster.restart_master();
    assert_eq!(same_as_undisturbed(&cluster)["workers"], 1);
}

#[test]
fn a_master_that_dies_while_it_commits_a_snapshot_has_the_one_before() {
    for fail in ["die-in-snapshot:3", "die-before-manifest:3"] {
        let (mut cluster, _submitted) = running(&[], Some(fail));
        cluster.restart_master();
        let line = cluster.master.wait_for("the job goes on");
        assert!(!line.contains("cycle=0"), "{fail}: {line}");
        same_as_undisturbed(&cluster);
    }
}

#[test]
fn a_torn_snapshot_and_one_with_a_flipped_bit_are_refused_and_the_older_is_used() {
    for (what, words) in [("torn", "torn: "), ("flipped", "do not match their checksum")] {
        let (mut cluster, _submitted) = running(&[], None);
        wait_for_snapshot(&cluster, 3);
        cluster.master.kill();
        let path = newest_snapshot(&cluster);
        let mut bytes = fs::read(&path).expect("a snapshot");
        match what {
            "torn" => bytes.truncate(bytes.len() / 2),
            _ => {
                let middle = bytes.len() / 2;
                bytes[middle] ^= 0x10;
            }
        }
        fs::write(&path, bytes).expect("room");
        cluster.restart_master();
        cluster.master.wait_for(words);
        let line = cluster.master.wait_for("the job goes on");
        assert!(!line.contains("cycle=0"), "{line}");
        same_as_undisturbed(&cluster);
    }
}

#[test]
fn a_worker_that_is_told_to_leave_goes_at_a_boundary_and_nothing_is_computed_twice() {
    let (mut cluster, mut submitted) = running(&[], None);
    wait_for_cycle(&cluster, 200);
    cluster.process("b").signal("TERM");
    assert_eq!(cluster.process_mut("b").wait().code(), Some(0));
    assert_eq!(submitted.wait().code(), Some(0), "{}\n{}", submitted.text(), cluster.master.text());
    let summary = same_as_undisturbed(&cluster);
    assert_eq!((&summary["workers"], &summary["losses"]), (&1.into(), &serde_json::json!([])));
    let hosts = cluster.client(&["hosts"]).out;
    assert!(hosts.contains("the worker was told to end"), "{hosts}");
}

#[test]
fn a_worker_that_panics_or_computes_no_numbers_is_dropped_by_name_and_the_job_goes_on() {
    let faults = [
        ("panic:300", "a bug in the worker: a panic that a test has ordered"),
        ("nan-force:300", "partial force 1 of "),
        ("nan-vote:300", "of its vote is NaN, must be finite"),
    ];
    for (fail, words) in faults {
        let mut cluster = Cluster::start(BOLIDE, false);
        cluster.worker("a", "1");
        cluster.worker_that_fails("bad", fail);
        let mut submitted = submit(&cluster);
        let dropped = cluster.master.wait_for("is dropped: cycle ");
        assert!(dropped.contains("worker bad ") && dropped.contains(words), "{dropped}");
        assert_eq!(cluster.process_mut("bad").wait().code(), Some(1), "its process ends with the reason");
        cluster.process("bad").wait_for("worker bad was dropped: cycle ");
        assert_eq!(submitted.wait().code(), Some(0), "{}\n{}", submitted.text(), cluster.master.text());
        let summary = same_as_undisturbed(&cluster);
        assert_eq!((&summary["workers"], &summary["losses"][0]["worker"]), (&1.into(), &"bad".into()));
    }
}

#[test]
fn what_fails_on_a_second_worker_at_the_same_cycle_is_the_problems_fault() {
    let mut cluster = Cluster::start(BOLIDE, false);
    for name in ["a", "b", "c"] {
        cluster.worker_that_fails(name, "panic-always:300");
    }
    let mut submitted = submit(&cluster);
    assert_eq!(submitted.wait().code(), Some(1), "{}", submitted.text());
    submitted.wait_for("failed at cycle 300 as well, so it is not the worker's fault");
    assert_eq!(cluster.job(1)["state"], "failed");
    assert_eq!(cluster.master.count("is dropped: "), 1, "the second one is not to blame");
}

#[test]
fn a_stopped_worker_is_suspect_then_dead_by_name_and_may_join_anew() {
    let (cluster, mut submitted) = running(&["--dead-after", "2"], None);
    cluster.process("b").signal("STOP");
    cluster.master.wait_for("worker b is suspect: silent for 0.");
    let table = cluster.client(&["hosts"]).out;
    assert!(table.lines().any(|line| line.contains(" b ") && line.contains("suspect: silent")), "{table}");
    cluster.master.wait_for("a worker is lost: back to cycle");
    cluster.process("b").signal("CONT");
    until(
        || format!("b to join anew; {}", cluster.master.text()),
        || (cluster.master.count("worker b joined") == 2).then_some(()),
    );
    assert_eq!(submitted.wait().code(), Some(0), "{}\n{}", submitted.text(), cluster.master.text());
    let summary = same_as_undisturbed(&cluster);
    let why = summary["losses"][0]["why"].as_str().expect("a reason").to_owned();
    assert!(why.contains("no byte from the peer for 2"), "{why}");
}

#[test]
fn an_interrupted_run_says_the_command_that_goes_on_with_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(BOLIDE);
    command.current_dir(folder.path()).arg("run").arg(small()).args(flags()).args(["--out", "the results"]);
    let mut run = Process::start("run", &mut command);
    let history = folder.path().join("the results/history.csv");
    let rows = || fs::read_to_string(&history).unwrap_or_default().lines().count();
    until(|| format!("20 rows; {}", run.text()), || (rows() > 20).then_some(()));
    run.signal("INT");
    assert_eq!(run.wait().code(), Some(130), "{}", run.text());
    let line = run.wait_for("go on with: ");
    let resuming = line.split("go on with: ").nth(1).expect("a command").to_owned() + " --json";
    assert!(resuming.contains("--resume 'the results'"), "{resuming}");
    let said = said(Command::new("sh").current_dir(folder.path()).args(["-c", &resuming]));
    let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
    Left::of(&folder.path().join("the results"), &summary).assert_same(undisturbed());
}

/// A run that keeps a snapshot every 100 cycles, with `more` flags, the last of which takes the folder `out`.
fn run_in(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(BOLIDE);
    command.arg("run").arg(small()).args(flags()).args(["--snapshot-cycles", "100"]).args(more).arg(out);
    command
}

/// What such a run leaves in `out` when it is killed once it has three snapshots.
fn killed_after_three_snapshots(out: &Path) {
    // The last two are kept, each for a tenth of a second of a run of one: whoever looks late sees a later one, or the end.
    let is_third = |name: &str| name.starts_with("snapshot-") && name >= "snapshot-000003";
    let is_there = || {
        let files = fs::read_dir(out.join("snapshots")).into_iter().flatten();
        files.filter_map(|file| file.ok()?.file_name().into_string().ok()).any(|name| is_third(&name))
    };
    for _ in 0..20 {
        let mut run = Process::start("run", &mut run_in(out, &["--force", "--out"]));
        let seen = until(
            || format!("three snapshots; {}", run.text()),
            || if is_there() { Some(true) } else { run.text().contains("digest").then_some(false) },
        );
        run.kill();
        if seen && is_there() {
            return;
        }
    }
    panic!("twenty runs ended before anybody saw their third snapshot");
}

#[test]
fn a_state_that_is_damaged_or_missing_is_computed_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    killed_after_three_snapshots(&out);
    fs::remove_file(out.join("state-000000.vtu")).expect("it is there");
    let said = said(&mut run_in(&out, &["--json", "--resume"]));
    assert!(said.err.contains("state-000000.vtu") && said.err.contains("it is computed again"), "{said:?}");
    let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
    Left::of(&out, &summary).assert_same(undisturbed());
}

#[test]
fn a_state_due_where_a_run_is_interrupted_is_kept() {
    tests::faults::disks::interrupted(BOLIDE.as_ref(), small().as_ref(), 200);
}

#[test]
fn a_killed_run_goes_on_from_its_newest_whole_snapshot_into_the_same_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    killed_after_three_snapshots(&out);
    let said = said(&mut run_in(&out, &["--json", "--resume"]));
    let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
    Left::of(&out, &summary).assert_same(undisturbed());
}

#[test]
fn a_job_that_could_not_write_its_results_fails_with_the_reason_and_can_be_gone_on_with() {
    let (cluster, mut submitted) = running(&[], None);
    wait_for_snapshot(&cluster, 1);
    // A folder in the place of the next file: no user may write over it, root neither.
    let index = cluster.results(1).join(".results.pvd.tmp");
    until(|| "the name of the next index".to_owned(), || fs::create_dir(&index).is_ok().then_some(()));
    assert_eq!(submitted.wait().code(), Some(1), "{}", submitted.text());
    submitted.wait_for("results.pvd: Is a directory");
    assert_eq!(cluster.job(1)["state"], "failed");
    fs::remove_dir(&index).expect("empty");
    let resumed = cluster.client(&["resume", "1"]);
    assert_eq!((resumed.code, resumed.out.trim()), (Some(0), "job 1 goes on where it was stored"));
    same_as_undisturbed(&cluster);
    assert!(!cluster.master.wait_for("the job goes on").contains("cycle=0"));
    let again = cluster.client(&["resume", "1"]);
    assert!(again.err.contains("a job that is done cannot be resumed"), "{again:?}");
}

#[test]
fn a_disk_that_refuses_snapshots_stops_nothing_and_leaves_the_older_ones() {
    let (mut cluster, mut submitted) = running(&[], None);
    wait_for_snapshot(&cluster, 1);
    // A folder in the place of the file that comes next: no user may write over it, root neither.
    let manifest = cluster.snapshots(1).join("manifest.tmp");
    until(|| "the name of the next manifest".to_owned(), || fs::create_dir(&manifest).is_ok().then_some(()));
    let line = cluster.master.wait_for("no snapshot at cycle");
    assert!(line.contains("stays, the run goes on"), "{line}");
    cluster.master.kill();
    fs::remove_dir(&manifest).expect("empty");
    cluster.restart_master();
    let line = cluster.master.wait_for("the job goes on");
    assert!(!line.contains("cycle=0"), "{line}");
    same_as_undisturbed(&cluster);
    assert_eq!(submitted.wait().code(), Some(0), "it follows over the restart: {}", submitted.text());
    submitted.wait_for("dialling again for 60 s");
}
