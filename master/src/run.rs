//! `bolide run`: one deck, here, to its summary.

use std::{
    cell::Cell,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
    time::Instant,
};

use deck::{bundle::Options, model::Model};
use mechanics::lanes::Width;
use tracing::{info, warn};

use crate::{
    command::RunArgs,
    deck_file::{gather_deck, read_gathered},
    embedded::{self, Traffic},
    event::{Outcome, WorkerSpec},
    interrupt::stop_on_interrupt,
    job::Job,
    machine,
    options::{CheckpointEvery, SessionOptions, bring_end_forward, interval_for, speeds_for},
    output::Output,
    picture,
    processes::Processes,
    refine,
    results::{
        self, Folder, REPORT, SUMS, Summary, report,
        summary::{Origin, significant},
        sums, trace,
    },
    shell::{print, quoted, tell},
    snapshot::{
        self, Snapshot,
        keeper::Keeper,
        store::{self, Store},
    },
    summarise::{SurfaceCensus, summarise},
};

/// Seconds between snapshots of a run that asks for no other.
const SNAPSHOT_SECONDS: f64 = 60.0;

/// Where a run writes: `--out`, or the folder it resumes from, or `results/<deck name>`.
pub fn folder_for(args: &RunArgs) -> PathBuf {
    let resumed = args.resume.clone().filter(|path| path.is_dir());
    args.out.clone().or(resumed).unwrap_or_else(|| {
        Path::new("results").join(args.deck.file_stem().unwrap_or(std::ffi::OsStr::new("run")))
    })
}

/// [`run`], and then those are told whom the user wants told.
///
/// # Errors
/// As [`run`].
pub fn run_and_tell(args: &RunArgs) -> Result<ExitCode, String> {
    args.notify.check()?;
    let result = run(args);
    let folder = (!args.job.no_output).then(|| folder_for(args));
    args.notify.tell_of(&args.deck.display().to_string(), folder.as_deref(), &result);
    result
}

/// Runs a deck here: in this process, or with a process for each worker.
///
/// # Errors
/// Whatever kept it from its end.
pub fn run(args: &RunArgs) -> Result<ExitCode, String> {
    match args.refine {
        Some(factor) => refine::run(args, factor),
        None => run_with(args, &args.reading.options()),
    }
}

/// Runs a deck as the options of its reading have it.
///
/// # Errors
/// Whatever kept it from its end.
pub fn run_with(args: &RunArgs, reading: &Options) -> Result<ExitCode, String> {
    if let Some(pin) = &args.pin {
        pin.apply()?;
    }
    let asked = &args.job;
    let cores = worker::processors::cores();
    let n = args.workers.map_or(args.speeds.len().max(1), |n| n as usize);
    // Workers of one process share a pool; processes share the cores.
    let share = if args.processes { (cores / n).max(1) } else { cores };
    let threads = args.threads.map_or(share, |t| t as usize);
    machine::warn_of_threads(if args.processes { n * threads } else { threads });
    // The start takes no more threads than the run; a pool that a process has already stays.
    let of_start = if args.processes { cores.min(n * threads) } else { threads };
    let _ = rayon::ThreadPoolBuilder::new().num_threads(of_start).build_global();
    let text = gather_deck(&args.deck, reading)?;
    let mut model = read_gathered(&text, &args.deck.display().to_string())?;
    bring_end_forward(&mut model, asked)?;
    let others: Vec<_> = args.format.iter().filter(|name| !model.output.formats.contains(name)).collect();
    model.output.formats.extend(others.into_iter().cloned().collect::<Vec<_>>());
    let specs: Vec<WorkerSpec> = speeds_for(n, &args.speeds)?
        .into_iter()
        .enumerate()
        .map(|(i, speed)| WorkerSpec::new(format!("worker-{i}"), speed, threads as u32))
        .collect();
    let path = (!asked.no_output).then(|| folder_for(args));
    let interval = interval_for(asked, &model, path.as_ref().map(|_| SNAPSHOT_SECONDS));
    let asks_for_snapshots = !interval_for(asked, &model, None).is_never();
    if !interval.is_never() && path.is_none() {
        return Err("snapshots need a results folder; leave out --no-output".to_owned());
    }
    if let Some(lanes) = &asked.lanes {
        // Workers of this machine would refuse them, when the results of before were gone.
        lanes.parse::<Width>().and_then(Width::require).map_err(|e| e.to_string())?;
    }
    // A run that resumes from its own folder goes on writing there.
    let own = args.resume.as_deref().zip(path.as_deref()).filter(|(from, path)| is_of_folder(from, path));
    let own = own.map(|(_, path)| path);
    if let Some(folder) = own.filter(|_| args.resume.as_deref().is_some_and(Path::is_dir))
        && complete(folder)?
    {
        return print(&format!(
            "that run is over; what its results lacked is written\nresults in {}",
            folder.display()
        ))
        .map(|()| ExitCode::SUCCESS);
    }
    let resume = args.resume.as_deref().map(|path| resumed_from(path, own)).transpose()?.flatten();
    let in_place = own.is_some() && resume.is_some();
    // What is in there stays until nothing can keep the run from beginning.
    let folder = path.as_deref().map(|path| Folder::claim(path, args.force || own.is_some()));
    let folder = folder.transpose().map_err(|e| e.to_string())?;
    if let Some(path) = &args.trace {
        results::check_writable(path).map_err(|e| e.to_string())?;
    }
    if let (Some(snapshot), Some(folder), false) = (&resume, &folder, in_place) {
        say_what_is_missing(snapshot, folder.path());
    }
    // Nobody is lost who shares this process; a part that is computed twice goes back all the same.
    let memory = asked.keep_every.filter(|_| args.processes || asked.verify > 0.0);
    let options = SessionOptions {
        keep: CheckpointEvery::for_both(memory, interval),
        store: folder.is_some(),
        ..SessionOptions::of(asked, n, true)
    };
    let states =
        resume.as_ref().filter(|_| in_place).map(|snapshot| (snapshot.states.clone(), snapshot.sums.clone()));
    // Without contact the surface is found for its census alone, before there are states beside it.
    let bare = model.setup.contact.is_none().then(|| SurfaceCensus::without_contact(&model));
    let (mut job, first) = Job::new(Arc::new(model), &specs, options, resume)?;
    job.forget_start();
    let model = Arc::clone(job.model());
    let census = bare.unwrap_or_else(|| SurfaceCensus::of(&job, &model));
    let stop = stop_on_interrupt("stopping after this cycle");
    let children = args.processes.then(|| Processes::start(&specs)).transpose()?;
    if let (Some(folder), false) = (&folder, in_place) {
        folder.clear().map_err(|e| e.to_string())?;
    }
    let mut output = Output::new(Arc::clone(&model), folder, args.json)?;
    output.tells_all = args.verbose;
    output.keep_input(&args.deck.display().to_string(), &text, asked.end_time)?;
    drop(text);
    if let Some(folder) = &output.folder {
        let snapshots = folder.file(store::FOLDER);
        if !in_place {
            store::remove(&snapshots)?;
        }
        let (store, _) = Store::open(&snapshots)?;
        let results = Some(folder.path().to_owned());
        output.keeper = Some(Keeper::start(store, interval, job.start_state().cycle, results)?);
    }
    output.go_on(&job, states)?;
    if !args.processes && output.keeper.is_none() && asked.verify == 0.0 {
        job.keep_no_state();
    }
    let started = Instant::now();
    let ran = match &children {
        Some(children) => children.run(job, first, &mut output, &stop),
        None => {
            let pool = threads.max(cores.min(n * threads));
            embedded::run(job, first, n, pool, &mut output, &stop)
        }
    };
    let wall = started.elapsed().as_secs_f64();
    drop(children);
    output.finish();
    let (outcome, traffic) =
        ran.and_then(|ran| output.flush().map(|()| ran)).inspect_err(|_| say_what_is_stored(&output))?;
    if let (Some(keeper), true) = (&output.keeper, outcome.stopped && outcome.failure.is_none()) {
        say_how_to_resume(keeper, &output);
    }
    // A trace that cannot be written is told after the results, which are worth more.
    let traced = args.trace.as_deref().map(|path| trace::write(path, &outcome.workers, &outcome.reports));
    let total_threads = (n * threads) as u32;
    let ended = conclude(&model, &census, &outcome, traffic, total_threads, wall, &output, args.json)?;
    traced.transpose().map_err(|e| e.to_string())?;
    if !asks_for_snapshots && !outcome.stopped && outcome.failure.is_none() {
        forget_snapshots(output)?;
    }
    Ok(ended)
}

/// Whether what is resumed from is a results folder itself, or a snapshot file in it, by whatever path.
fn is_of_folder(from: &Path, folder: &Path) -> bool {
    let (Ok(from), Ok(folder)) = (fs::canonicalize(from), fs::canonicalize(folder)) else { return false };
    let parent = from.parent().filter(|_| from.is_file());
    from == folder || parent.is_some_and(|parent| parent == folder || parent == folder.join(store::FOLDER))
}

/// The snapshot in a file, or the newest whole one of a results folder; what is wrong with newer ones is a warning. One that goes on
/// where its results are (`own`) counts on its states: where those are damaged whichever snapshot is used, the run begins anew.
fn resumed_from(path: &Path, own: Option<&Path>) -> Result<Option<Snapshot>, String> {
    if !path.is_dir() {
        let snapshot = snapshot::read(path)?;
        if let Some(folder) = own {
            results::check_states(folder, &snapshot.sums).map_err(|why| {
                format!(
                    "{why}; {} counts on it: give --resume {}, or another folder with --out",
                    path.display(),
                    folder.display()
                )
            })?;
        }
        return Ok(Some(snapshot));
    }
    let folder = path.join(store::FOLDER);
    let whole = Cell::new(false);
    let check = |snapshot: &Snapshot| {
        whole.set(true);
        own.map_or(Ok(()), |folder| results::check_states(folder, &snapshot.sums))
    };
    let (_, found) = Store::open_for(&folder, check)?;
    for why in &found.warnings {
        warn!("{why}");
    }
    match found.snapshot {
        Some(snapshot) => {
            info!("going on at cycle {}", snapshot.state.cycle);
            Ok(Some(snapshot))
        }
        None if whole.get() => {
            info!("going on at cycle 0");
            Ok(None)
        }
        // A run that is complete has removed what it stored for itself alone.
        None => match Summary::read(path) {
            Ok(Summary { cycles, end_time, digest, .. })
                if found.warnings.is_empty() && !digest.is_empty() =>
            {
                Err(format!(
                    "{}: that run is over, after {cycles} cycles at time {} with digest {digest}, and there is nothing to resume; to compute it once more \
                 give --out another folder, since --force replaces its results",
                    path.display(),
                    significant(end_time)
                ))
            }
            _ => Err(format!("no whole snapshot in {}; start the run anew, with --force", folder.display())),
        },
    }
}

/// Writes the report and the checksums of a run that is over but could not write them, as on a full disk; gives whether they were missing.
fn complete(path: &Path) -> Result<bool, String> {
    let has = |name: &str| path.join(name).exists();
    let Ok(summary) = Summary::read(path) else { return Ok(false) };
    if summary.digest.is_empty() || has(REPORT) && has(SUMS) {
        return Ok(false);
    }
    // With a snapshot it goes on from there.
    let (_, found) = Store::open(&path.join(store::FOLDER))?;
    if found.snapshot.is_some() || !found.warnings.is_empty() {
        return Ok(false);
    }
    let fault = |e: results::Error| e.to_string();
    let folder = Folder::reopen(path).map_err(fault)?;
    if !has(REPORT) {
        let pictures = picture::of_report(path, &summary);
        report::write(&folder, &summary, &summary.units, &pictures).map_err(fault)?;
    }
    sums::write(&folder, &[]).map_err(fault)?;
    Ok(true)
}

/// Of a run that goes on in another folder than it began in: which states that will not have.
fn say_what_is_missing(snapshot: &Snapshot, folder: &Path) {
    let cycle = snapshot.state.cycle;
    let missing = snapshot.states.iter().filter(|(written, _)| *written < cycle).count();
    if missing > 0 {
        warn!(
            "{} will lack the states before cycle {cycle}, {missing} in number, which stay where the run began; its history is whole",
            folder.display()
        );
    }
}

/// What a run that is over has stored for itself alone.
fn forget_snapshots(output: Output) -> Result<(), String> {
    let Output { keeper, folder, .. } = output;
    drop(keeper);
    folder.map_or(Ok(()), |folder| store::remove(&folder.file(store::FOLDER)))
}

/// After an interrupt: the command that goes on.
fn say_how_to_resume(keeper: &Keeper, output: &Output) {
    let kept = keeper.flush();
    match (kept.refused, &output.folder) {
        (None, Some(folder)) if kept.cycle.is_some() => {
            let cycle = kept.cycle.unwrap_or_default();
            tell(&format!("stored at cycle {cycle}; go on with: {}", resuming_command(folder.path())));
        }
        (Some(why), _) => tell(&format!("not stored: {why}")),
        _ => tell("not stored: nothing was computed"),
    }
}

/// After a fault that no result tells of, such as a full disk: where the run can be gone on with.
fn say_what_is_stored(output: &Output) {
    let (Some(keeper), Some(folder)) = (&output.keeper, &output.folder) else { return };
    match keeper.flush().cycle {
        Some(cycle) => {
            tell(&format!("stored at cycle {cycle}; go on with: {}", resuming_command(folder.path())))
        }
        None => tell(&format!(
            "nothing is stored to go on from; a run is stored every {SNAPSHOT_SECONDS} s, with --snapshot-every SECONDS more often"
        )),
    }
}

/// The command of this process with `--resume FOLDER` in place of what says where to begin and to write.
fn resuming_command(folder: &Path) -> String {
    let mut words = Vec::new();
    let mut arguments = std::env::args();
    while let Some(word) = arguments.next() {
        match word.as_str() {
            "--resume" | "--out" => drop(arguments.next()),
            "--force" => {}
            other if other.starts_with("--resume=") || other.starts_with("--out=") => {}
            _ => words.push(word),
        }
    }
    words.extend(["--resume".to_owned(), folder.display().to_string()]);
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// Prints and writes the summary, and says how the process ends.
///
/// # Errors
/// The failure of the run, after its results are written.
#[expect(clippy::too_many_arguments, reason = "the facts of a run come from as many places")]
pub fn conclude(
    model: &Model,
    census: &SurfaceCensus,
    outcome: &Outcome,
    traffic: Traffic,
    threads: u32,
    wall_s: f64,
    output: &Output,
    json: bool,
) -> Result<ExitCode, String> {
    let summary = summarise(model, census, outcome, traffic, threads, wall_s);
    let origin = Origin::of(&output.deck);
    let mut summary = Summary { input: output.input.clone(), origin, ..summary };
    let formats = output.write_summary(&mut summary)?;
    formats.written.iter().for_each(|line| info!("{line}"));
    output.seal()?;
    for warning in &summary.warnings {
        warn!("{warning}");
    }
    let mut text = match json {
        true => serde_json::to_string(&summary).map_err(|e| e.to_string())?,
        false => summary.table(&model.units, output.tells_all),
    };
    if let (Some(folder), false) = (&output.folder, json) {
        text = format!("{}\nresults in {}", text, folder.path().display());
    }
    let printed = print(&text);
    match (&outcome.failure, outcome.stopped) {
        (Some(reason), _) => Err(reason.clone()),
        _ if printed.is_err() => printed.map(|()| ExitCode::SUCCESS),
        (None, true) => Ok(ExitCode::from(130)),
        (None, false) if formats.missing > 0 => Err("the run is complete, and so are its other results, but a format that was asked for is missing; bolide export writes it later".to_owned()),
        (None, false) => Ok(ExitCode::SUCCESS),
    }
}
