//! Links between processes of one machine go over memory, and nothing else about them changes.

use std::sync::OnceLock;

use tests::{
    cluster::{Cluster, Process, until},
    proxy::Proxy,
};

use crate::{BOLIDE, digest_of, run, small};

/// Cycles that outlast a count of links.
const CYCLES: &str = "4000";

/// The digest of them.
fn expected() -> &'static str {
    static DIGEST: OnceLock<String> = OnceLock::new();
    DIGEST.get_or_init(|| digest_of(&run(&["--cycles", CYCLES])))
}

/// How many memories of links a process has mapped, as Linux lists them.
fn mapped(process: &Process) -> usize {
    let maps = std::fs::read_to_string(format!("/proc/{}/maps", process.id())).expect("it runs");
    maps.lines().filter(|line| line.contains("/memfd:bolide-link")).count()
}

/// The first job under way, on so many workers, with links of their own.
fn submit(cluster: &Cluster, workers: &str) {
    let deck = small();
    let arguments = ["submit", &deck, "--cycles", CYCLES, "--no-output", "--route", "direct"];
    cluster.json(&[&arguments[..], &["--min-workers", workers]].concat());
    cluster.wait_until_running(1);
}

fn links_go_over_memory(tls: bool) {
    let mut cluster = Cluster::start(BOLIDE, tls);
    for name in ["a", "b", "c"] {
        cluster.worker(name, "1");
        assert_eq!(cluster.process(name).count("shares_memory=true"), 1, "{}", cluster.process(name).text());
    }
    submit(&cluster, "3");
    // One to the master and one to each neighbour: a has b beside it, or c, or both.
    let neighbours = |name: &str| mapped(cluster.process(name)).checked_sub(1).expect("one to the master");
    let found = ["a", "b", "c"].map(neighbours);
    assert_eq!(cluster.job(1)["state"], "running", "the job ended before its links were counted");
    assert_eq!(mapped(&cluster.master), 3);
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!(digest_of(&summary), expected());
    assert!(found.iter().all(|&n| n > 0), "{found:?}");
    let pairs = summary["linked_pairs"].as_u64();
    assert_eq!((pairs, &summary["relayed_pairs"]), (Some(found.iter().sum::<usize>() as u64 / 2), &0.into()));
    assert_eq!(cluster.master.count("WARN"), 0, "{}", cluster.master.text());
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "no memory is shared there")]
fn links_over_memory_give_the_same_digest() {
    links_go_over_memory(false);
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "no memory is shared there")]
fn links_over_memory_under_tls_do_the_same() {
    links_go_over_memory(true);
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "no memory is shared there")]
fn links_stay_on_tcp_where_they_are_told_to_or_are_emulated_or_something_is_in_between() {
    let mut cluster = Cluster::start(BOLIDE, false);
    let proxy = Proxy::start();
    proxy.forward(&cluster.address);
    cluster.worker_with("told", "1", &["--no-shared-memory"]);
    cluster.worker_with("emulated", "1", &["--link", "1gbit"]);
    cluster.worker_through("behind", &format!("127.0.0.1:{}", proxy.port), "");
    submit(&cluster, "3");
    for name in ["told", "emulated", "behind"] {
        assert_eq!(cluster.process(name).count("shares_memory"), 0, "{}", cluster.process(name).text());
        assert_eq!((name, mapped(cluster.process(name))), (name, 0));
        assert_eq!(cluster.process(name).count("WARN"), 0, "{}", cluster.process(name).text());
    }
    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), expected());

    // The master alone is told: the workers still have memory between them.
    let mut cluster = Cluster::start_with(BOLIDE, false, &["--no-shared-memory"], None);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    submit(&cluster, "2");
    let found = (mapped(&cluster.master), mapped(cluster.process("a")), mapped(cluster.process("b")));
    assert_eq!(cluster.job(1)["state"], "running", "the job ended before its links were counted");
    assert_eq!(found, (0, 1, 1));
    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), expected());
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "no memory is shared there")]
fn a_killed_worker_is_a_loss_like_any_other_and_leaves_no_memory_behind() {
    let mut cluster = Cluster::start(BOLIDE, false);
    for name in ["a", "victim", "c"] {
        cluster.worker(name, "1");
    }
    submit(&cluster, "3");
    assert!(mapped(cluster.process("victim")) > 1, "one to the master, and one to a neighbour");
    cluster.kill_worker("victim");
    cluster.master.wait_for("a worker is lost: back to cycle");
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!(digest_of(&summary), expected());
    let losses = summary["losses"].as_array().expect("a list");
    assert_eq!((losses.len(), &losses[0]["worker"]), (1, &"victim".into()), "{summary}");
    // The job is over: links to the master stand, no others.
    for (process, links) in [(&cluster.master, 2), (cluster.process("a"), 1), (cluster.process("c"), 1)] {
        until(
            || format!("{links} memories, {} are mapped", mapped(process)),
            || (mapped(process) == links).then_some(()),
        );
    }
    let left = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let left: Vec<_> = left.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    assert!(left.iter().all(|name| !name.contains("bolide")), "{left:?}");
}
