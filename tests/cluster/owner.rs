//! A worker steps back for the people whose PC it is on, and comes back: the job goes on, with the same bits.

use std::time::SystemTime;

use tests::{
    cluster::{Cluster, Process, until},
    terminal::Terminal,
};

use crate::{BOLIDE, LONG, digest_of, long_reference, small};

/// How the host of a worker stands, and why.
fn standing(cluster: &Cluster, name: &str) -> (String, String) {
    let hosts = cluster.json(&["hosts"]);
    let host = hosts.as_array().and_then(|hosts| hosts.iter().find(|host| host["name"] == name));
    let host = host.expect("it has joined");
    let words = |key: &str| host[key].as_str().expect("words").to_owned();
    (words("state"), words("note"))
}

/// Waits until a host stands so; gives why.
fn wait_for(cluster: &Cluster, name: &str, state: &str, mut meanwhile: impl FnMut()) -> String {
    until(
        || format!("{state}; {:?}", standing(cluster, name)),
        || {
            meanwhile();
            let (found, note) = standing(cluster, name);
            (found == state).then_some(note)
        },
    )
}

/// Waits for the end of a step in which Linux notes when a terminal was read: eight seconds.
fn wait_for_end_of_step() {
    let seconds = || SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("after 1970").as_secs();
    until(|| "the end of such a step".to_owned(), || (seconds() % 8 == 6).then_some(()));
}

/// Other tests keep the processors busy: they are not to count.
const OWNED: [&str; 4] = ["--yield-to-owner", "--owner-load", "1000", "--owner-quiet"];

#[test]
fn a_worker_leaves_its_job_when_somebody_types_and_comes_back_later() {
    let mut cluster = Cluster::start(BOLIDE, false);
    let mut terminal = Terminal::start("cat", 80, 10);
    cluster.worker_with("door", "1", &[&OWNED[..], &["1"]].concat());
    wait_for_end_of_step();
    let why = wait_for(&cluster, "door", "left", || terminal.press("x\n"));
    assert_eq!(why, "stepped back: its owner types");
    wait_for(&cluster, "door", "idle", || {});
    cluster.kill_worker("door");

    cluster.worker("rack", "1");
    cluster.worker_with("desk", "1", &[&OWNED[..], &["1000"]].concat());
    wait_for_end_of_step();
    cluster.json(&["submit", "--cycles", LONG, "--workers", "2", &small()]);
    cluster.wait_until_running(1);
    let why = wait_for(&cluster, "desk", "left", || terminal.press("x\n"));
    assert_eq!(why, "stepped back: its owner types");
    cluster.process("desk").wait_for("staying away");
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!(digest_of(&summary), long_reference());
    assert_eq!(summary["workers"], 1, "{summary}");

    // With a share it stays in its job, and `hosts` says so while it lasts.
    cluster.kill_worker("rack");
    let flags = ["--yield-to-owner=0.25", "--owner-load", "1000", "--owner-quiet", "1"];
    cluster.worker_with("sofa", "1", &flags);
    // It outlasts the steps of eight seconds, and is cancelled.
    cluster.json(&["submit", "--cycles", "1000000", "--no-output", &small()]);
    cluster.wait_until_running(2);
    wait_for_end_of_step();
    let note = || standing(&cluster, "sofa").1;
    until(
        || format!("a part of the time; {}", note()),
        || {
            terminal.press("x\n");
            (note() == "job 2, works 25 % of the time: its owner types").then_some(())
        },
    );
    until(|| format!("all of the time; {}", note()), || (note() == "job 2").then_some(()));
    assert_eq!(cluster.client(&["cancel", "2"]).code, Some(0));
}

#[test]
fn outside_its_hours_a_worker_joins_nobody_and_says_so() {
    let cluster = Cluster::start(BOLIDE, false);
    // Together they are the week, so that now is within one of the two.
    let workers =
        [("early", "Mon-Wed, Thu 0:00-12:00"), ("late", "Thu 12:00-24:00, Fri-Sun")].map(|(name, hours)| {
            let mut command =
                cluster.command(name, &["worker", "--name", name, "--threads", "1", "--hours", hours]);
            Process::start(name, command.env("BOLIDE_LOG", "info"))
        });
    let says = |words: &str| workers.iter().map(|worker| worker.count(words)).collect::<Vec<_>>();
    let (away, joined) = until(
        || "one that stays away and one that joins".to_owned(),
        || {
            Some((says("staying away"), says("joined ")))
                .filter(|(away, joined)| [away, joined].iter().all(|n| n.contains(&1)))
        },
    );
    assert_eq!((away.iter().sum::<usize>(), joined.iter().sum::<usize>()), (1, 1));
    assert_ne!(away, joined);
}
