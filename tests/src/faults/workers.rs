//! Workers that die, stop, panic and compute no numbers.

use std::time::{Duration, Instant};

use super::{Case, LOST, Running, Scene, Seen, cycles_lost, no_sorts, since};

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, tries, run| Case { name, tries, run };
    vec![
        case("kill -9 of a worker, random instants", 20, |scene, k| {
            harm(scene, k, LOST, |running| running.cluster.kill_worker("b"))
        }),
        case("worker killed while it loads its sub-domains", 1, |s, _| killed_in(s, "die-in-load:1")),
        case("worker killed in contact and border elements", 1, |s, _| killed_in(s, "die-in-border:120")),
        case("worker killed in interior elements", 1, |s, _| killed_in(s, "die-in-interior:120")),
        case("worker killed while it integrates", 1, |s, _| killed_in(s, "die-in-integrate:120")),
        case("worker killed while it gathers positions for a sort", 1, |s, _| {
            killed_in_sort(s, "die-in-gather:2")
        }),
        case("worker killed at a plan boundary, in the transfer", 1, |s, _| {
            killed_in_sort(s, "die-in-transfer:2")
        }),
        case("worker killed at a plan boundary, in its elements", 1, |s, _| {
            killed_in_sort(s, "die-in-elements:2")
        }),
        case("worker killed while it installs a plan", 1, |s, _| killed_in_sort(s, "die-in-install:2")),
        case("one of six that sort, killed while it sends what is near others", 1, |s, _| {
            killed_of_six(s, "die-in-spread:2")
        }),
        case("one of six that sort, killed while it sorts", 1, |s, _| killed_of_six(s, "die-in-sort:2")),
        case("worker killed while it sends its state for a snapshot", 1, |s, _| {
            killed_in(s, "die-in-image:2")
        }),
        case("second worker killed during the rollback for the first", 1, |scene, k| {
            let mut cluster = scene.cluster(&[], None, &[]);
            cluster.worker("a", "1");
            cluster.worker("b", "1");
            cluster.worker_that_fails("c", "die-in-load:2");
            let mut running = scene.submit(cluster);
            running.wait_for_cycle(scene.instant(k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.kill_worker("b");
            running.wait_for_count(LOST, 2);
            close(scene, &running, cycle, at, since(at))
        }),
        case("kill -9 of two workers at once", 3, |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(100 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.kill_worker("a");
            running.cluster.kill_worker("c");
            running.wait_for_count(LOST, 2);
            close(scene, &running, cycle, at, since(at))
        }),
        case("kill -9 of all workers; new ones join 1 s later", 1, |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(k));
            let (cycle, at) = (running.cycle(), Instant::now());
            ["a", "b", "c"].iter().for_each(|name| running.cluster.kill_worker(name));
            running.wait_for_count(LOST, 3);
            let detected = since(at);
            std::thread::sleep(Duration::from_secs(1));
            running.cluster.worker("d", "1");
            running.cluster.worker("e", "1");
            close(scene, &running, cycle, at, detected)
        }),
        case("SIGSTOP of a worker for 5 s", 1, |scene, k| {
            let running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.process("b").signal("STOP");
            running.wait_for_count("worker b is suspect", 1);
            let detected = since(at);
            std::thread::sleep(Duration::from_secs(5).saturating_sub(at.elapsed()));
            running.cluster.process("b").signal("CONT");
            let mut seen = close(scene, &running, cycle, at, detected);
            seen.note = "suspect, heard again, nothing computed twice".to_owned();
            assert_eq!(running.cluster.master.count(LOST), 0);
            seen
        }),
        case("SIGSTOP of a worker for ever", 1, |scene, k| {
            let mut seen = harm(scene, k, LOST, |running| running.cluster.process("b").signal("STOP"));
            seen.note = "dead after 10 s of silence".to_owned();
            seen
        }),
        case("worker told to leave (SIGTERM)", 1, |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.process("b").signal("TERM");
            assert_eq!(running.cluster.process_mut("b").wait().code(), Some(0));
            let mut seen = close(scene, &running, cycle, at, since(at));
            seen.note = "released at a plan boundary".to_owned();
            seen
        }),
        case("panic in a worker", 1, |s, _| dropped(s, "panic:100")),
        case("NaN in a worker's forces", 1, |s, _| dropped(s, "nan-force:100")),
        case("NaN in a worker's energies", 1, |s, _| dropped(s, "nan-vote:100")),
    ]
}

/// Does harm at an instant; `words` are what the master says of it.
pub(super) fn harm(scene: &Scene, k: u64, words: &str, harm: fn(&mut Running)) -> Seen {
    let mut running = scene.begin(&[], None);
    running.wait_for_cycle(scene.instant(k));
    let (cycle, at) = (running.cycle(), Instant::now());
    harm(&mut running);
    running.wait_for_count(words, 1);
    let detected = since(at);
    close(scene, &running, cycle, at, detected)
}

/// Waits until the run is as far as it was, then for its end.
pub(super) fn close(
    scene: &Scene,
    running: &Running,
    cycle: u64,
    at: Instant,
    detected: Option<f64>,
) -> Seen {
    running.wait_for_cycle(cycle + 1);
    let time_lost = since(at);
    let summary = scene.end(running);
    Seen { detected, cycles_lost: Some(cycles_lost(&summary)), time_lost, note: String::new() }
}

/// A worker that ends itself at a point of its work.
fn killed_in(scene: &Scene, fail: &str) -> Seen {
    killed_of(scene, (&["a", "b"], &[]), fail)
}

/// Where workers sort what they hold of the surface.
fn killed_of_six(scene: &Scene, fail: &str) -> Seen {
    let asking = ["--route", "direct", "--sort-by", "workers"];
    if scene.sorts { killed_of(scene, (&["a", "b", "d", "e", "f"], &asking), fail) } else { no_sorts() }
}

fn killed_of(scene: &Scene, (others, asking): (&[&str], &[&str]), fail: &str) -> Seen {
    let mut cluster = scene.cluster(&[], None, &[]);
    others.iter().for_each(|name| cluster.worker(name, "1"));
    cluster.worker_that_fails("c", fail);
    let mut running = scene.submit_asking(cluster, asking);
    let died = running.cluster.process_mut("c").wait();
    let at = Instant::now();
    assert!(!died.success(), "it died of its own");
    running.wait_for_count(LOST, 1);
    let detected = since(at);
    let cycle = running.cycle();
    close(scene, &running, cycle, at, detected)
}

fn killed_in_sort(scene: &Scene, fail: &str) -> Seen {
    if scene.sorts { killed_in(scene, fail) } else { no_sorts() }
}

/// A worker that is not to blame for its machine.
fn dropped(scene: &Scene, fail: &str) -> Seen {
    let mut cluster = scene.cluster(&[], None, &[]);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    cluster.worker_that_fails("c", fail);
    let running = scene.submit(cluster);
    let line = running.cluster.master.wait_for("worker c at ");
    let at = Instant::now();
    let cycle = running.cycle();
    let mut seen = close(scene, &running, cycle, at, None);
    seen.note = line.split("is dropped: ").nth(1).unwrap_or_default().to_owned();
    seen
}
