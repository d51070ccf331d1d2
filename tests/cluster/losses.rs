//! Workers that die, that come, and nobody left, as real processes: the run goes on, with the same bits and files.

use std::{fs, path::Path, sync::OnceLock, time::Duration};

use tests::cluster::{Cluster, Process, said, until};

use crate::{BOLIDE, digest_of, small};

const CYCLES: &str = "4000";

/// Digest and history of an undisturbed run.
fn undisturbed() -> &'static (String, String) {
    static RUN: OnceLock<(String, String)> = OnceLock::new();
    RUN.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out");
        let mut command = std::process::Command::new(BOLIDE);
        command.args(["run", &small(), "--cycles", CYCLES, "--threads", "1", "--json", "--out"]).arg(&out);
        let said = said(&mut command);
        let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
        (digest_of(&summary), history(&out))
    })
}

fn history(folder: &Path) -> String {
    fs::read_to_string(folder.join("history.csv")).expect("a history")
}

/// A cluster with these workers, and its first job under way.
fn running(names: &[&str], more: &[&str]) -> (Cluster, Process) {
    let mut cluster = Cluster::start(BOLIDE, false);
    for name in names {
        cluster.worker(name, "1");
    }
    let n = names.len().to_string();
    let mut arguments = vec!["submit", "--wait", "--json", "--cycles", CYCLES, "--min-workers", &n];
    arguments.extend(["--keep-every", "0.2"]);
    arguments.extend(more);
    let deck = small();
    arguments.push(&deck);
    let waiting = Process::start("submit", &mut cluster.command("client", &arguments));
    cluster.wait_until_running(1);
    (cluster, waiting)
}

/// Waits until the job has come so far.
fn wait_for_cycle(cluster: &Cluster, cycle: u64) {
    until(
        || format!("cycle {cycle}; {}", cluster.job(1)),
        || (cluster.job(1)["cycle"].as_u64() >= Some(cycle)).then_some(()),
    );
}

/// The summary of the job, which gave the digest and the history of the undisturbed run.
fn same_as_undisturbed(cluster: &Cluster, waiting: &mut Process) -> serde_json::Value {
    assert_eq!(waiting.wait().code(), Some(0), "{}\n{}", waiting.text(), cluster.master.text());
    let summary = cluster.json(&["watch"]);
    let (digest, rows) = undisturbed();
    assert_eq!(&digest_of(&summary), digest);
    assert!(&history(&cluster.folder().join("spool/job-1")) == rows, "other rows than the undisturbed run's");
    summary
}

#[test]
fn a_job_goes_on_when_a_worker_is_killed() {
    for route in ["master", "direct"] {
        let (mut cluster, mut waiting) = running(&["a", "victim", "c"], &["--route", route]);
        wait_for_cycle(&cluster, 1000);
        cluster.kill_worker("victim");
        let summary = same_as_undisturbed(&cluster, &mut waiting);
        let losses = summary["losses"].as_array().expect("a list");
        assert_eq!(losses.len(), 1, "{summary}");
        assert_eq!(losses[0]["worker"], "victim");
        assert!(losses[0]["back_to"].as_u64() <= losses[0]["cycle"].as_u64(), "{summary}");
        assert_eq!(summary["workers"], 2);
        let table = cluster.client(&["hosts"]).out;
        let row = table.lines().find(|line| line.contains("victim")).expect("it is remembered");
        assert!(row.contains(" lost "), "{row}");
        cluster.master.wait_for("a worker is lost: back to cycle");
    }
}

#[test]
fn two_workers_killed_at_once_and_one_more_later_leave_the_same_bits() {
    let (mut cluster, mut waiting) = running(&["a", "b", "c", "d"], &[]);
    wait_for_cycle(&cluster, 600);
    cluster.kill_worker("b");
    cluster.kill_worker("a");
    wait_for_cycle(&cluster, 1500);
    cluster.kill_worker("d");
    let summary = same_as_undisturbed(&cluster, &mut waiting);
    assert_eq!((summary["losses"].as_array().map(Vec::len), &summary["workers"]), (Some(3), &1.into()));
}

#[test]
fn workers_whose_votes_travel_by_a_tree_are_killed_at_its_root_and_elsewhere() {
    let names = ["a", "b", "c", "d", "e", "f", "g"];
    // They sort too, so that no list of one that is lost is anywhere else.
    let (mut cluster, mut waiting) = running(&names, &["--route", "direct", "--sort-by", "workers"]);
    wait_for_cycle(&cluster, 400);
    // Of equal workers the last is the root.
    cluster.kill_worker("g");
    wait_for_cycle(&cluster, 1000);
    cluster.kill_worker("a");
    wait_for_cycle(&cluster, 1500);
    // The next root; four are left, which vote without a tree.
    cluster.kill_worker("f");
    let summary = same_as_undisturbed(&cluster, &mut waiting);
    assert_eq!((summary["losses"].as_array().map(Vec::len), &summary["workers"]), (Some(3), &4.into()));
}

#[test]
fn a_worker_that_comes_while_a_job_runs_is_used_from_the_next_boundary() {
    let (mut cluster, mut waiting) = running(&["a"], &[]);
    cluster.worker("late", "3");
    until(
        || format!("a share for the one that came; {}", cluster.job(1)),
        || {
            let shares = cluster.job(1)["shares"].as_array().cloned().unwrap_or_default();
            let late = shares.iter().find(|share| share["host"] == "late")?["elements"].as_u64()?;
            (late.abs_diff(3 * 3456 / 4) <= 144).then_some(())
        },
    );
    let summary = same_as_undisturbed(&cluster, &mut waiting);
    assert_eq!((&summary["workers"], &summary["losses"]), (&2.into(), &serde_json::json!([])));
}

#[test]
fn a_job_whose_workers_all_died_waits_for_one_and_goes_on() {
    let (mut cluster, mut waiting) = running(&["a", "b"], &[]);
    wait_for_cycle(&cluster, 800);
    cluster.kill_worker("a");
    cluster.kill_worker("b");
    until(
        || format!("the job to wait; {}", cluster.job(1)),
        || (cluster.job(1)["waits_for"] == "a worker: all are lost").then_some(()),
    );
    assert_eq!(cluster.job(1)["state"], "running");
    cluster.worker("new", "1");
    let summary = same_as_undisturbed(&cluster, &mut waiting);
    assert_eq!((summary["losses"].as_array().map(Vec::len), &summary["workers"]), (Some(2), &1.into()));
}

/// As a batch system tells the processes of a job that is preempted: all, one shortly after the other.
#[test]
fn workers_told_to_leave_one_after_another_leave_the_job_waiting() {
    let names = ["a", "b", "c", "d"];
    let (mut cluster, mut waiting) = running(&names, &[]);
    wait_for_cycle(&cluster, 500);
    for name in names {
        cluster.process(name).signal("TERM");
        std::thread::sleep(Duration::from_millis(3));
    }
    for name in names {
        assert_eq!(cluster.process_mut(name).wait().code(), Some(0));
    }
    cluster.master.wait_for("work is dealt out job=1 workers=0");
    assert_eq!(cluster.job(1)["state"], "running", "it is not done: nobody has stayed to its end");
    cluster.worker("e", "1");
    let summary = same_as_undisturbed(&cluster, &mut waiting);
    assert_eq!(summary["losses"].as_array().map(Vec::len), Some(0), "{summary}");
}

#[test]
fn a_job_that_waits_for_a_worker_can_be_cancelled() {
    let (mut cluster, mut waiting) = running(&["a"], &[]);
    cluster.kill_worker("a");
    until(
        || format!("the job to wait; {}", cluster.job(1)),
        || (cluster.job(1)["waits_for"] == "a worker: all are lost").then_some(()),
    );
    assert_eq!(cluster.client(&["cancel", "1"]).code, Some(0));
    assert_ne!(waiting.wait().code(), Some(0));
    assert_eq!(cluster.job(1)["state"], "cancelled");
}

/// 3,456 elements take 35.6 MB of a worker, half of them 34.6 MB.
#[test]
fn a_job_whose_remaining_workers_have_no_memory_for_it_waits_for_others_with_the_numbers() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker_with("small", "1", &["--memory", "0.035"]);
    cluster.worker("large", "1");
    let deck = small();
    let job =
        ["submit", "--wait", "--json", "--cycles", CYCLES, "--min-workers", "2", "--snapshot-every", "0.2"];
    let mut waiting =
        Process::start("submit", &mut cluster.command("client", &[&job[..], &[&deck]].concat()));
    cluster.wait_until_running(1);
    wait_for_cycle(&cluster, 800);
    cluster.kill_worker("large");
    cluster.master.wait_for("the job waits for workers, since without large it needs memory: ");
    let words = "on worker small for its 3456 of 3456 elements";
    until(
        || format!("the job to wait; {}", cluster.job(1)),
        || {
            let job = cluster.job(1);
            let waits = job["waits_for"].as_str()?;
            (job["state"] == "queued" && waits.starts_with("memory: ") && waits.contains(words)).then_some(())
        },
    );
    cluster.worker("new", "1");
    let summary = same_as_undisturbed(&cluster, &mut waiting);
    assert_eq!(summary["workers"], 2, "{summary}");
}
