//! Masters that die, are told to leave, and whose clock is set back.

use std::{
    fs,
    process::Command,
    time::{Duration, Instant},
};

use super::{Case, GOES_ON, Running, Scene, Seen, field, no_sorts, since, workers::close};

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, tries, run| Case { name, tries, run };
    vec![
        case("kill -9 of the master, random instants", 10, |scene, k| restarted(scene, 200 + k, |_| {})),
        case("kill -9 of the master and a worker together", 3, |scene, k| {
            restarted(scene, 300 + k, |running| running.cluster.kill_worker("b"))
        }),
        case("kill -9 of the master and all workers; new workers", 1, |scene, k| {
            restarted(scene, 320 + k, |running| {
                ["a", "b", "c"].iter().for_each(|name| running.cluster.kill_worker(name));
            })
        }),
        case("master killed while it writes a snapshot", 1, |s, _| killed_in(s, "die-in-snapshot:2")),
        case("master killed between a snapshot and its manifest", 1, |s, _| {
            killed_in(s, "die-before-manifest:2")
        }),
        case("master killed during a sort", 1, |scene, _| {
            if scene.sorts { killed_in(scene, "die-in-sort:3") } else { no_sorts() }
        }),
        case(
            "both holders of the newest snapshot: the master killed, its newest file torn",
            1,
            |scene, k| {
                let mut running = scene.begin(&[], None);
                running.wait_for_snapshots(2);
                running.wait_for_cycle(scene.instant(400 + k));
                let (cycle, at) = (running.cycle(), Instant::now());
                running.cluster.master.kill();
                damage(&running, |bytes| bytes.truncate(bytes.len() / 3));
                let mut seen = go_on(scene, &mut running, cycle, at);
                running.cluster.master.wait_for("torn: ");
                seen.note = "the generation before was used".to_owned();
                seen
            },
        ),
        case("a bit flipped in the newest snapshot, the master killed", 1, |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_snapshots(2);
            running.wait_for_cycle(scene.instant(410 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.master.kill();
            damage(&running, |bytes| {
                let place = bytes.len() * 2 / 3;
                bytes[place] ^= 1;
            });
            let mut seen = go_on(scene, &mut running, cycle, at);
            running.cluster.master.wait_for("do not match their checksum");
            seen.note = "the generation before was used".to_owned();
            seen
        }),
        case("master told to leave (SIGTERM) and started again", 1, |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(420 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.master.signal("TERM");
            assert_eq!(running.cluster.master.wait().code(), Some(0));
            let line = running.cluster.master.wait_for("the job is stored");
            let stored = field(&line, "cycle").expect("a cycle");
            let mut seen = go_on(scene, &mut running, cycle, at);
            seen.cycles_lost = Some(cycle.saturating_sub(stored));
            seen.note = "stored at the next cycle".to_owned();
            seen
        }),
        case("SIGSTOP of the master for 5 s", 1, |s, k| stopped(s, 440 + k, 5, "waited for")),
        case("SIGSTOP of the master for 13 s", 1, |s, k| {
            stopped(s, 450 + k, 13, "workers give it up after 10 s, dial again and are taken in anew")
        }),
        case("wall clock set back an hour, on all hosts", 1, |scene, k| {
            let Some(library) = clock_library() else {
                return Seen {
                    note: "skipped: no C compiler to make the clock with".into(),
                    ..Seen::default()
                };
            };
            let jump = library.path().join("jump");
            let (preload, file) =
                (library.path().join("clock.so").display().to_string(), jump.display().to_string());
            let variables = [("LD_PRELOAD", preload.as_str()), ("BOLIDE_CLOCK_FILE", file.as_str())];
            let mut cluster = scene.cluster(&[], None, &variables);
            for name in ["a", "b", "c"] {
                cluster.worker(name, "1");
            }
            let running = scene.submit(cluster);
            running.wait_for_cycle(scene.instant(430 + k));
            fs::write(&jump, "-3600").expect("room");
            let summary = scene.end(&running);
            assert_eq!(summary["losses"], serde_json::json!([]));
            Seen { cycles_lost: Some(0), note: "no decision reads it".into(), ..Seen::default() }
        }),
    ]
}

/// Kills the master at an instant, and whoever else `also` does, and starts it again.
fn restarted(scene: &Scene, k: u64, also: fn(&mut Running)) -> Seen {
    let mut running = scene.begin(&[], None);
    running.wait_for_cycle(scene.instant(k));
    let (cycle, at) = (running.cycle(), Instant::now());
    running.cluster.master.kill();
    also(&mut running);
    go_on(scene, &mut running, cycle, at)
}

/// Stops the master for so many seconds.
fn stopped(scene: &Scene, k: u64, seconds: u64, note: &str) -> Seen {
    let running = scene.begin(&[], None);
    running.wait_for_cycle(scene.instant(k));
    let (cycle, at) = (running.cycle(), Instant::now());
    running.cluster.master.signal("STOP");
    std::thread::sleep(Duration::from_secs(seconds));
    running.cluster.master.signal("CONT");
    Seen { note: note.to_owned(), ..close(scene, &running, cycle, at, None) }
}

/// A master that ends itself at a point of its work.
fn killed_in(scene: &Scene, fail: &str) -> Seen {
    let mut running = scene.begin(&[], Some(fail));
    running.cluster.master.wait();
    let at = Instant::now();
    go_on(scene, &mut running, 0, at)
}

/// Starts the master again and waits for the end of the job.
fn go_on(scene: &Scene, running: &mut Running, cycle: u64, at: Instant) -> Seen {
    let alive = ["a", "b", "c"].iter().any(|name| running.cluster.process_mut(name).is_alive());
    running.cluster.restart_master();
    if !alive {
        running.cluster.worker("d", "1");
        running.cluster.worker("e", "1");
    }
    let line = running.cluster.master.wait_for(GOES_ON);
    let detected = since(at);
    let from = field(&line, "cycle").expect("a cycle");
    running.wait_for_cycle(cycle + 1);
    let time_lost = since(at);
    scene.end(running);
    Seen { detected, cycles_lost: Some(cycle.saturating_sub(from)), time_lost, note: String::new() }
}

/// Does harm to the newest snapshot file.
fn damage(running: &Running, harm: impl Fn(&mut Vec<u8>)) {
    let number = running.newest_snapshot().expect("one was committed");
    let newest = running.cluster.snapshots(1).join(format!("snapshot-{number:06}.bolide"));
    let mut bytes = fs::read(&newest).expect("readable");
    harm(&mut bytes);
    fs::write(&newest, bytes).expect("room");
}

/// A library whose wall clock is ahead by the seconds in the file `BOLIDE_CLOCK_FILE`, as long as there is one, and always by
/// `BOLIDE_CLOCK_SHIFT` (s).
const CLOCK: &str = r#"
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
int clock_gettime(clockid_t id, struct timespec *t) {
    int result = (int)syscall(SYS_clock_gettime, id, t);
    const char *name = getenv("BOLIDE_CLOCK_FILE");
    const char *shift = getenv("BOLIDE_CLOCK_SHIFT");
    int file = id == CLOCK_REALTIME && name ? open(name, O_RDONLY | O_CLOEXEC) : -1;
    if (file >= 0) {
        char seconds[32] = "";
        if (read(file, seconds, sizeof seconds - 1) > 0) t->tv_sec += atol(seconds);
        close(file);
    }
    if (id == CLOCK_REALTIME && shift) t->tv_sec += atol(shift);
    return result;
}
"#;

/// A folder with `clock.so` in it; none where there is no C compiler.
pub(crate) fn clock_library() -> Option<tempfile::TempDir> {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, library) = (folder.path().join("clock.c"), folder.path().join("clock.so"));
    fs::write(&source, CLOCK).expect("room");
    let made = Command::new("cc").args(["-shared", "-fPIC", "-o"]).arg(&library).arg(&source).status();
    made.is_ok_and(|status| status.success()).then_some(folder)
}
