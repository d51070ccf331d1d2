//! Disks that are full. A small file system in memory is mounted for them, which only root may.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use super::{Case, GOES_ON, Seen, field, since};
use crate::cluster::said;

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
    ]
}

pub(super) fn skipped() -> Seen {
    Seen { note: "skipped: only root may mount a small file system".into(), ..Seen::default() }
}

/// A file system in memory, gone with this value.
pub(super) struct Disk(PathBuf);

impl Disk {
    pub(super) fn mount(folder: &Path, size: &str) -> Option<Self> {
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
