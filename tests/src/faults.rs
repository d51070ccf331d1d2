//! FAULTS: what befalls a cluster of real processes while it computes a benchmark, and what it costs.
//!
//! A [`Scene`] is a benchmark and the run of it that nothing happens to. A [`Case`] is a fault: it starts a cluster of a
//! master and three workers, waits for an instant of its job, does harm, and waits for the end, whose files must be those
//! of the undisturbed run to the byte. The lists are in [`workers`], [`masters`], [`links`], [`disks`], [`stuck`], [`doors`]; [`trust`] is where
//! certificates and tokens have theirs.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use serde_json::Value;

use crate::{
    cluster::{Cluster, Process, said, until},
    left::Left,
};

pub mod disks;
pub mod doors;
pub mod links;
pub mod masters;
pub mod stuck;
pub mod trust;
pub mod workers;

/// A benchmark and its undisturbed run.
pub struct Scene {
    /// The binary.
    pub bolide: PathBuf,
    pub deck: PathBuf,
    /// Cycles of the job.
    pub cycles: u64,
    /// Of the instants.
    pub seed: u64,
    /// The deck has contact, hence sorts.
    pub sorts: bool,
    undisturbed: Left,
}

pub struct Case {
    /// What happens, for the table.
    pub name: &'static str,
    /// At how many instants.
    pub tries: u64,
    /// Does it for a try.
    pub run: fn(&Scene, u64) -> Seen,
}

/// What was seen of a fault that the job outlived.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// From the fault to the line that names it (s).
    pub detected: Option<f64>,
    /// Cycles computed again.
    pub cycles_lost: Option<u64>,
    /// From the fault until the run was as far as before (s).
    pub time_lost: Option<f64>,
    /// What else there is to say.
    pub note: String,
}

/// A fault of the table.
#[derive(Debug)]
pub struct Row {
    /// What happened.
    pub name: &'static str,
    /// By try: what was seen, or why it is no pass.
    pub tries: Vec<Result<Seen, String>>,
}

/// All faults, in the order of the table.
pub fn cases() -> Vec<Case> {
    let lists = [
        workers::cases(),
        masters::cases(),
        links::cases(),
        disks::cases(),
        stuck::cases(),
        doors::cases(),
        trust::cases(),
    ];
    lists.into_iter().flatten().collect()
}

/// A cluster whose job is under way.
pub struct Running {
    /// Master and workers.
    pub cluster: Cluster,
    /// The client that submitted the job and waits for it.
    _submitted: Process,
}

impl Scene {
    /// Runs the benchmark with nothing happening.
    ///
    /// # Errors
    /// If it does not come to its end.
    pub fn new(bolide: &Path, deck: &Path, cycles: u64, seed: u64) -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|e| format!("a folder: {e}"))?;
        let out = folder.path().join("out");
        let mut command = Command::new(bolide);
        command.arg("run").arg(deck).args(["--cycles", &cycles.to_string(), "--json", "--out"]).arg(&out);
        let said = said(&mut command);
        let summary: Value = serde_json::from_str(&said.out).map_err(|e| format!("{e}: {said:?}"))?;
        // The deck may end before.
        let cycles = summary["cycles"].as_u64().ok_or("a summary without cycles")?;
        let undisturbed = Left::of(&out, &summary);
        let sorts = summary["sorts"].as_u64() > Some(0);
        Ok(Self { bolide: bolide.to_owned(), deck: deck.to_owned(), cycles, seed, sorts, undisturbed })
    }

    /// A cycle between 5 and 85 % of the run, another for each try.
    pub fn instant(&self, number: u64) -> u64 {
        let mut x = (self.seed + number + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        self.cycles / 20 + (x ^ (x >> 31)) % (self.cycles * 4 / 5)
    }

    /// A cluster without workers.
    pub fn cluster(&self, flags: &[&str], fail: Option<&str>, variables: &[(&str, &str)]) -> Cluster {
        let folder = tempfile::tempdir().expect("a folder");
        Cluster::start_in(&self.bolide, folder, false, flags, fail, variables)
    }

    /// Three workers and the job under way.
    pub fn begin(&self, flags: &[&str], fail: Option<&str>) -> Running {
        let mut cluster = self.cluster(flags, fail, &[]);
        for name in ["a", "b", "c"] {
            cluster.worker(name, "1");
        }
        self.submit(cluster)
    }

    /// Puts the job into the queue of a cluster with three workers.
    pub fn submit(&self, cluster: Cluster) -> Running {
        self.submit_asking(cluster, &[])
    }

    /// The same with more flags of `submit`.
    pub fn submit_asking(&self, cluster: Cluster, flags: &[&str]) -> Running {
        let (deck, cycles) = (self.deck.display().to_string(), self.cycles.to_string());
        let mut arguments =
            vec!["submit", "--wait", "--cycles", &cycles, "--min-workers", "3", "--snapshot-every", "0.2"];
        arguments.extend(flags);
        arguments.push(&deck);
        let submitted = Process::start("submit", &mut cluster.command("client", &arguments));
        Running { cluster, _submitted: submitted }
    }

    /// A cluster whose job was submitted by a client that has left: one that follows it takes its place.
    pub fn watch(&self, cluster: Cluster) -> Running {
        let watching = Process::start("watch", &mut cluster.command("client", &["watch", "1"]));
        Running { cluster, _submitted: watching }
    }

    /// Waits for the end of the job and compares what it left.
    ///
    /// # Panics
    /// If anything differs.
    pub fn end(&self, running: &Running) -> Value {
        let cluster = &running.cluster;
        let summary = cluster.json(&["watch", "1"]);
        assert_eq!(cluster.job(1)["state"], "done", "{}", cluster.master.text());
        Left::of(&cluster.results(1), &summary).assert_same(&self.undisturbed);
        summary
    }

    /// The same for a results folder of `bolide run`.
    ///
    /// # Panics
    /// If anything differs.
    pub fn compare(&self, folder: &Path, summary: &Value) {
        Left::of(folder, summary).assert_same(&self.undisturbed);
    }

    /// Does every try of a case.
    pub fn play(&self, case: &Case, tries: u64) -> Row {
        let tries = (0..tries).map(|number| {
            let seen = catch_unwind(AssertUnwindSafe(|| (case.run)(self, number)));
            seen.map_err(|panic| {
                let words = panic.downcast_ref::<String>().cloned();
                words.or_else(|| panic.downcast_ref::<&str>().map(|&w| w.to_owned())).unwrap_or_default()
            })
        });
        Row { name: case.name, tries: tries.collect() }
    }
}

impl Running {
    /// Cycles completed.
    pub fn cycle(&self) -> u64 {
        self.cluster.find_job(1).and_then(|job| job["cycle"].as_u64()).unwrap_or_default()
    }

    /// Waits until the job has come so far, or is over.
    pub fn wait_for_cycle(&self, cycle: u64) {
        until(
            || format!("cycle {cycle}; {}", self.cluster.master.text()),
            || {
                let job = self.cluster.find_job(1)?;
                let over = job["state"] == "done" || job["state"] == "failed";
                (over || job["cycle"].as_u64() >= Some(cycle)).then_some(())
            },
        );
    }

    /// Waits until so many snapshots of the job were committed.
    pub fn wait_for_snapshots(&self, number: u64) {
        let newest = || self.newest_snapshot();
        until(|| format!("snapshot {number}"), || (newest()? >= number).then_some(()));
    }

    /// The number of the snapshot that was committed last.
    pub fn newest_snapshot(&self) -> Option<u64> {
        let manifest = std::fs::read(self.cluster.snapshots(1).join("manifest.json")).ok()?;
        let manifest: Value = serde_json::from_slice(&manifest).ok()?;
        manifest["generations"][0]["number"].as_u64()
    }

    /// Waits until the master has printed these words so often.
    pub fn wait_for_count(&self, words: &str, count: usize) {
        until(
            || format!("{words:?}; {}", self.cluster.master.text()),
            || (self.cluster.master.count(words) >= count).then_some(()),
        );
    }
}

/// What the master says when it has found a worker lost.
pub const LOST: &str = "a worker is lost: back to cycle";
/// What it says when a job of an earlier one goes on.
pub const GOES_ON: &str = "the job goes on";

/// Cycles that the losses of a summary threw away.
pub fn cycles_lost(summary: &Value) -> u64 {
    let losses = summary["losses"].as_array().cloned().unwrap_or_default();
    losses.iter().map(|l| l["cycle"].as_u64().unwrap_or(0) - l["back_to"].as_u64().unwrap_or(0)).sum()
}

/// The number behind `name=` in a line.
pub fn field(line: &str, name: &str) -> Option<u64> {
    let rest = line.split(&format!("{name}=")).nth(1)?;
    rest.trim_start_matches("Some(").split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Seconds since an instant.
pub fn since(instant: Instant) -> Option<f64> {
    Some(instant.elapsed().as_secs_f64())
}

/// What a fault of sorts is where there are none.
pub fn no_sorts() -> Seen {
    Seen { note: "skipped: no contact, no sorts".into(), ..Seen::default() }
}

/// The table of a benchmark, as Markdown.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| fault | times | detected after (s) | cycles lost | time lost (s) | same bytes | |\n|---|---|---|---|---|---|---|\n",
    );
    for Row { name, tries } in rows {
        let seen: Vec<&Seen> = tries.iter().filter_map(|t| t.as_ref().ok()).collect();
        let of = |pick: fn(&Seen) -> Option<f64>, digits: usize| {
            let mut values: Vec<f64> = seen.iter().filter_map(|s| pick(s)).collect();
            values.sort_by(f64::total_cmp);
            match values.len() {
                0 => "-".to_owned(),
                1 => format!("{:.digits$}", values[0]),
                n => format!("{:.digits$}, at most {:.digits$}", values[n / 2], values[n - 1]),
            }
        };
        let skipped = seen.iter().filter(|s| s.note.starts_with("skipped")).count();
        let (times, same) = (tries.len() - skipped, seen.len() - skipped);
        let mut note = seen.last().map(|s| s.note.clone()).unwrap_or_default();
        if let Some(Err(why)) = tries.iter().find(|t| t.is_err()) {
            note = format!("FAILED: {}", why.lines().next().unwrap_or_default());
        }
        text += &format!(
            "| {name} | {times} | {} | {} | {} | {same} of {times} | {note} |\n",
            of(|s| s.detected, 2),
            of(|s| s.cycles_lost.map(|c| c as f64), 0),
            of(|s| s.time_lost, 2)
        );
    }
    text
}
