//! Disks that are full. A small file system in memory is mounted for them, which only root may.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use super::{Case, GOES_ON, Seen, field, since};
use crate::{
    cluster::{Process, said, until},
    left::Left,
};

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, tries, run| Case { name, tries, run };
    vec![
        case("disk of the snapshots full; then the master killed", 1, |scene, k| {
            let mut running = {
                let cluster = scene.cluster(&[], None, &[]);
                (cluster, Vec::new())
            };
            let queue = running.0.folder().join("spool/queue");
            // Two snapshots of 27,000 elements and no third one.
            let Some(disk) = Disk::mount(&queue, "13m") else { return skipped() };
            running.1.push(disk);
            let (mut cluster, disk) = running;
            for name in ["a", "b", "c"] {
                cluster.worker(name, "1");
            }
            let mut running = scene.submit(cluster);
            let line = running.cluster.master.wait_for("no snapshot at cycle");
            assert!(line.contains("No space left"), "{line}");
            running.wait_for_cycle(scene.instant(700 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.master.kill();
            running.cluster.restart_master();
            let line = running.cluster.master.wait_for(GOES_ON);
            let detected = since(at);
            let from = field(&line, "cycle").expect("a cycle");
            assert!(from > 0, "the older generations are readable: {line}");
            running.wait_for_cycle(cycle + 1);
            let time_lost = since(at);
            scene.end(&running);
            drop(disk);
            let note = "a warning, the run went on; the generation from before the disk was full was used";
            Seen { detected, cycles_lost: Some(cycle.saturating_sub(from)), time_lost, note: note.into() }
        }),
        case("disk of the results full", 1, |scene, _| {
            let folder = tempfile::tempdir().expect("a folder");
            let (small, out) = (folder.path().join("small"), folder.path().join("small/out"));
            fs::create_dir(&small).expect("room");
            let Some(disk) = Disk::mount(&small, "64m") else { return skipped() };
            let command = |more: &[&str]| {
                let mut command = Command::new(&scene.bolide);
                command.arg("run").arg(&scene.deck).args(["--cycles", &scene.cycles.to_string(), "--json"]);
                command.args(["--snapshot-cycles", "50"]).args(more).arg(&out);
                command
            };
            // Room for the first states and snapshots; a larger disk takes them all.
            let ballast = small.join("ballast");
            fs::write(&ballast, vec![0; 24 << 20]).expect("room");
            let full = said(&mut command(&["--out"]));
            assert_eq!(full.code, Some(1), "{}", full.err);
            assert!(full.err.contains("No space left"), "{}", full.err);
            fs::remove_file(&ballast).expect("it is there");
            drop(disk.grow("1g"));
            let resumed = said(&mut command(&["--resume"]));
            let summary =
                serde_json::from_str(&resumed.out).unwrap_or_else(|e| panic!("{e}: {}", resumed.err));
            scene.compare(&out, &summary);
            let line =
                resumed.err.lines().find(|line| line.contains("going on at cycle")).unwrap_or_default();
            let note = format!(
                "stopped with the reason; {} after --resume",
                line.split("INFO ").nth(1).unwrap_or("from the start")
            );
            Seen { note, ..Seen::default() }
        }),
        case("Ctrl-C of `bolide run` at a cycle at whose start a state is due", 2, |scene, _| {
            interrupted(&scene.bolide, &scene.deck, 60);
            Seen { note: "`--resume` leaves the files of the undisturbed run".into(), ..Seen::default() }
        }),
    ]
}

/// Interrupts a run that writes a state in every cycle, goes on with it, and compares what it leaves.
///
/// # Panics
/// If anything differs.
pub fn interrupted(bolide: &Path, deck: &Path, cycles: u64) {
    let folder = tempfile::tempdir().expect("a folder");
    let every = folder.path().join("deck.toml");
    let text = fs::read_to_string(deck).expect("readable");
    let period = text.lines().find(|line| line.starts_with("period")).expect("states are asked for");
    fs::write(&every, text.replace(period, "period = 1e-6")).expect("room");
    let command = |flag: &str, out: &str| {
        let mut command = Command::new(bolide);
        command.arg("run").arg(&every).args(["--cycles", &cycles.to_string(), "--threads", "1", "--json"]);
        command.arg(flag).arg(folder.path().join(out));
        command
    };
    let summary = |mut command: Command| {
        let said = said(&mut command);
        serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"))
    };
    let undisturbed = Left::of(&folder.path().join("whole"), &summary(command("--out", "whole")));
    let mut run = Process::start("run", &mut command("--out", "cut"));
    let begun = folder.path().join("cut/state-000010.vtu");
    until(|| format!("ten states; {}", run.text()), || begun.is_file().then_some(()));
    run.signal("INT");
    assert_eq!(run.wait().code(), Some(130), "{}", run.text());
    let snapshots = folder.path().join("cut/snapshots");
    assert!(snapshots.is_dir(), "{}", run.text());
    let resumed = summary(command("--resume", "cut"));
    Left::of(&folder.path().join("cut"), &resumed).assert_same(&undisturbed);
    assert!(!snapshots.exists(), "nobody asked for snapshots, and the run is over");
}

pub(super) fn skipped() -> Seen {
    Seen { note: "skipped: only root may mount a small file system".into(), ..Seen::default() }
}

/// A file system in memory, gone with this value.
pub(crate) struct Disk(PathBuf);

impl Disk {
    pub(crate) fn mount(folder: &Path, size: &str) -> Option<Self> {
        let mut command = Command::new("mount");
        command.args(["-t", "tmpfs", "-o", &format!("size={size}"), "tmpfs"]).arg(folder);
        command.output().is_ok_and(|o| o.status.success()).then(|| Self(folder.to_owned()))
    }

    /// The same with more room; unmounted with the folder that it is in.
    pub(super) fn grow(&self, size: &str) -> std::process::Output {
        let mut command = Command::new("mount");
        command.args(["-o", &format!("remount,size={size}")]).arg(&self.0);
        command.output().expect("mount is there")
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // Lazily: the daemons of the case may have files there until they are ended.
        let _ = Command::new("umount").arg("-l").arg(&self.0).output();
    }
}
