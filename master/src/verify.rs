//! `bolide verify`: computes a results folder again and names the first cycle and place that differ.
//!
//! The run is computed again in intervals: from the deck's start to the first snapshot that the folder keeps, from each snapshot to the next, and
//! from the last one to the end. Every interval begins from its own snapshot, so a fault in one does not show in those behind it.
//! Rows of history, state files, contact surfaces, the snapshot at its end and the summary's digest are [compared](compare) bit by bit.
//! Which worker computed an element is taken over from the file: it changes no number.
//!
//! The deck is the one that the folder holds, with the hash that its summary states. With `--files` nothing is computed: files are compared
//! with [their checksums](sums).

pub mod arguments;
mod compare;

use std::{
    fmt, fs,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{Arc, atomic::AtomicBool, atomic::Ordering},
};

use deck::model::Model;

use crate::{
    deck_file::{read_deck_with, read_gathered},
    embedded,
    event::WorkerSpec,
    interrupt::stop_on_interrupt,
    job::Job,
    options::{SessionOptions, bring_end_forward},
    queue::sum_of,
    results::{
        INPUT, SUMMARY, SUMS, Summary,
        sums::{self, Checked},
    },
    shell::{print, tell},
    snapshot::{self, Snapshot, store},
};
use arguments::VerifyArgs;
use compare::{Comparison, Difference};

/// Why a folder could not be verified.
#[derive(Debug)]
enum Error {
    /// The summary is of another deck.
    OtherDeck { results: PathBuf, written: String, given: String },
    /// The folder holds no deck.
    NoDeck(PathBuf),
    /// The deck in the folder is not the one that the summary is of.
    DamagedDeck { path: PathBuf, stated: String, computed: String },
    /// Flags say how to read a deck that is not named.
    Reading(Vec<String>),
    /// The folder has no checksums.
    NoSums(PathBuf),
    /// Nothing in the folder says how far the run came.
    NoEnd(PathBuf),
    /// `--from` or `--to` leave nothing.
    Empty { from: u64, to: u64, end: u64 },
    /// `--interval` is none of the folder's.
    NoInterval { asked: usize, kept: Vec<[u64; 2]> },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherDeck { results, written, given } => write!(
                f,
                "{} holds results of {written:?}, the deck is {given:?}; name with --deck the deck that they were computed from",
                results.display()
            ),
            Self::NoDeck(results) => write!(
                f,
                "{} holds no {INPUT}; name with --deck the deck that it was computed from",
                results.display()
            ),
            Self::DamagedDeck { path, stated, computed } => write!(
                f,
                "{}: its BLAKE3 is {computed}, {SUMMARY} says {stated}; name with --deck the deck that the results were computed from",
                path.display()
            ),
            Self::Reading(words) => write!(
                f,
                "{}: the deck that the folder holds was read with its flags already; leave them out, or name a deck with --deck",
                words.join(" ")
            ),
            Self::NoSums(results) => write!(
                f,
                "{} holds no {SUMS}: the run did not come to its end; verify it without --files",
                results.display()
            ),
            Self::NoEnd(results) => write!(
                f,
                "{} has neither a summary nor a row of history nor a snapshot, so nothing says how far the run came; give --to CYCLE, or name the results folder of a run",
                results.display()
            ),
            Self::Empty { from, to, end } => write!(
                f,
                "cycles {from} to {to}: the run has cycles 0 to {end}; give --from and --to in rising order within them"
            ),
            Self::NoInterval { asked, kept } => {
                write!(f, "--interval {asked}: there are {} (", kept.len())?;
                for (index, [begins, ends]) in kept.iter().enumerate() {
                    write!(
                        f,
                        "{}{}: cycles {begins} to {ends}",
                        if index > 0 { ", " } else { "" },
                        index + 1
                    )?;
                }
                f.write_str("); a run keeps more snapshots with --snapshot-cycles")
            }
        }
    }
}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}

/// Computes a results folder again. The exit code says whether all is equal.
///
/// # Errors
/// Whatever kept it from comparing.
pub fn run(args: &VerifyArgs) -> Result<ExitCode, String> {
    let results = &args.results;
    if args.files {
        return check_files(results);
    }
    let summary = read_summary(results)?;
    let mut model = read_input(args, summary.as_ref())?;
    if let Some(summary) = summary.as_ref().filter(|summary| summary.title != model.title) {
        let (written, given) = (summary.title.clone(), model.title);
        return Err(Error::OtherDeck { results: results.clone(), written, given }.into());
    }
    let written =
        summary.as_ref().and_then(|summary| summary.input.as_ref()).and_then(|input| input.end_time);
    let end_time = args.end_time.or(written);
    let asked = protocol::options::JobOptions { end_time, ..Default::default() };
    bring_end_forward(&mut model, &asked)?;
    let mut differences = Vec::new();
    let snapshots = snapshots_of(results, &mut differences)?;
    let mut comparison = Comparison::of(results, &model, summary.is_some())?;
    let last_row = comparison.last_row().map(|cycle| cycle + 1);
    let last_snapshot = snapshots.last().map(|snapshot| snapshot.state.cycle);
    let end = summary.as_ref().map(|summary| summary.cycles).or(last_row.max(last_snapshot)).or(args.to);
    let end = end.ok_or_else(|| Error::NoEnd(results.clone()))?;
    let mut bounds = vec![0];
    bounds.extend(snapshots.iter().map(|snapshot| snapshot.state.cycle).filter(|&cycle| cycle < end));
    bounds.push(end);
    bounds.dedup();
    let kept: Vec<[u64; 2]> = bounds.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let [from, to] = match args.interval {
        Some(asked) => *asked
            .checked_sub(1)
            .and_then(|index| kept.get(index))
            .ok_or_else(|| Error::NoInterval { asked, kept: kept.clone() })?,
        None => [args.from.unwrap_or(0), args.to.unwrap_or(end)],
    };
    if from >= to || to > end {
        return Err(Error::Empty { from, to, end }.into());
    }
    comparison.within(from, to);
    let stop = stop_on_interrupt("stopping after this cycle");
    for [begins, ends] in kept.into_iter().filter(|[begins, ends]| *ends > from && *begins < to) {
        let first = snapshots.iter().find(|snapshot| snapshot.state.cycle == begins);
        let last = snapshots.iter().find(|snapshot| snapshot.state.cycle == ends.min(to));
        let digest = summary.as_ref().filter(|_| ends.min(to) == end).map(|summary| summary.digest.as_str());
        let whole = interval(args, &model, (first, ends.min(to)), (last, digest), &mut comparison, &stop)?;
        if !whole {
            tell(&format!("bolide: stopped; nothing behind cycle {begins} is verified"));
            return Ok(ExitCode::from(130));
        }
    }
    comparison.look_for_unvisited();
    let compared = comparison.compared();
    differences.extend(comparison.into_differences());
    differences.sort_by_key(|difference| difference.cycle);
    let Some(first) = differences.first() else {
        print(&format!("cycles {from} to {to}: all is equal ({compared})"))?;
        return Ok(ExitCode::SUCCESS);
    };
    print(&format!(
        "cycles {from} to {to}: the first difference is in cycle {}: {}",
        first.cycle, first.place
    ))?;
    for other in &differences[1..] {
        print(&format!("cycle {}: {}", other.cycle, other.place))?;
    }
    Ok(ExitCode::FAILURE)
}

/// Compares the files of a folder with their checksums.
fn check_files(results: &Path) -> Result<ExitCode, String> {
    let checked = sums::check(results).map_err(|e| e.to_string())?;
    let Checked { count, damaged } = checked.ok_or_else(|| Error::NoSums(results.to_owned()))?;
    for error in &damaged {
        print(&error.to_string())?;
    }
    if damaged.is_empty() {
        print(&format!("{count} checksums match"))?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&format!(
        "{} of {count} checksums do not match; what can be computed again `bolide verify` names",
        damaged.len()
    ))?;
    Ok(ExitCode::FAILURE)
}

/// The deck that the results were computed from: the one that is named, or else the one in the folder, which is that of the summary.
fn read_input(args: &VerifyArgs, summary: Option<&Summary>) -> Result<Model, String> {
    if let Some(deck) = &args.deck {
        return Ok(read_deck_with(deck, &args.reading.options())?);
    }
    let words = args.reading.words();
    if !words.is_empty() {
        return Err(Error::Reading(words).into());
    }
    let path = args.results.join(INPUT);
    let text = match fs::read_to_string(&path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Error::NoDeck(args.results.clone()).into());
        }
        text => text.map_err(|e| format!("cannot read {}: {e}", path.display()))?,
    };
    let computed = sum_of(&text);
    match summary.and_then(|summary| summary.input.as_ref()) {
        Some(input) if input.deck != computed => {
            Err(Error::DamagedDeck { path, stated: input.deck.clone(), computed }.into())
        }
        _ => Ok(read_gathered(&text, &path.display().to_string())?),
    }
}

fn read_summary(results: &Path) -> Result<Option<Summary>, String> {
    let path = results.join(SUMMARY);
    match fs::read(&path) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(Some)
            .map_err(|e| format!("{}: {e}; remove it to verify the other files", path.display())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound && results.is_dir() => Ok(None),
        Err(error) => Err(format!("cannot read {}: {error}", path.display())),
    }
}

/// The snapshots that a folder keeps, by cycle; one that cannot be read is a difference.
fn snapshots_of(results: &Path, differences: &mut Vec<Difference>) -> Result<Vec<Snapshot>, String> {
    let folder = results.join(store::FOLDER);
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let entries = match fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(snapshots),
        Err(error) => return Err(format!("cannot read {}: {error}", folder.display())),
    };
    for entry in entries {
        let path = entry.map_err(|e| format!("cannot read {}: {e}", folder.display()))?.path();
        if path.extension().is_none_or(|extension| extension != "bolide") {
            continue;
        }
        match snapshot::read(&path) {
            Ok(snapshot) => snapshots.push(snapshot),
            Err(why) => differences.push(Difference { cycle: 0, place: why }),
        }
    }
    snapshots.sort_by_key(|snapshot| snapshot.state.cycle);
    snapshots.dedup_by_key(|snapshot| snapshot.state.cycle);
    Ok(snapshots)
}

/// Computes one interval again; gives whether it came to its end.
fn interval(
    args: &VerifyArgs,
    model: &Model,
    (first, to): (Option<&Snapshot>, u64),
    (last, digest): (Option<&Snapshot>, Option<&str>),
    comparison: &mut Comparison,
    stop: &Arc<AtomicBool>,
) -> Result<bool, String> {
    let mut model = model.clone();
    model.setup.control.end_cycle = to;
    let model = Arc::new(model);
    let n = args.workers as usize;
    let threads = args.threads.map_or_else(worker::processors::cores, |threads| threads as usize);
    let spec = |i| WorkerSpec::new(format!("worker-{i}"), 1.0, threads as u32);
    let specs: Vec<WorkerSpec> = (0..n).map(spec).collect();
    let options = SessionOptions::of(&protocol::options::JobOptions::default(), n, true);
    let (mut job, actions) = Job::new(Arc::clone(&model), &specs, options, first.cloned())?;
    comparison.begin(Arc::clone(&model), job.probe(), to)?;
    // The start of a run has its state, a snapshot need not.
    comparison.state(job.start_state(), first.is_none())?;
    job.keep_no_state();
    let (outcome, _) = embedded::run(job, actions, n, threads, comparison, stop)?;
    if outcome.stopped || stop.load(Ordering::Relaxed) {
        return Ok(false);
    }
    comparison.end()?;
    // A run that fails there failed so before: what it wrote is compared all the same.
    if let Some(why) = outcome.failure {
        tell(&format!("bolide: the run ends with: {why}"));
    }
    if let (Some(snapshot), Some(state)) = (last, &outcome.state) {
        comparison.snapshot(&model, &snapshot.state, state);
    }
    if let Some(written) = digest.filter(|written| *written != outcome.digest) {
        comparison.add(to, format!("{SUMMARY}: digest {written}, computed again to {}", outcome.digest));
    }
    Ok(true)
}
