//! `bolide run`: one deck, here, to its summary.

use std::{
    collections::BTreeSet,
    io::IsTerminal,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use deck::{
    bundle::{self, Options},
    model::Model,
};
use indicatif::{ProgressBar, ProgressStyle};
use mechanics::state::GlobalState;
use protocol::{
    phase::{Phase, Report},
    request::JobOptions,
};
use tracing::{info, warn};

use crate::{
    command::RunArgs,
    embedded::{self, Sink, Traffic},
    event::{self, Action, ForceSorts, Hand, Keep, Limit, Outcome, Progress},
    job::Job,
    processes::Processes,
    results::{
        Folder,
        history::{History, HistoryRow, PartEnergy},
        report,
        summary::{Energies, NamedPair, NamedPart, Summary, WorkUnits, WorkerTimes},
        trace,
        vtu::Series,
        writer::Writer,
    },
    snapshot::{
        self, Snapshot,
        keeper::{Interval, Keeper},
        store::{self, Store},
    },
};

/// Reads and checks a deck.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_deck(path: &Path) -> Result<Model, String> {
    read_deck_with(path, &Options::default())
}

/// Reads and checks a deck with what it does not say itself; warnings go to standard error.
///
/// # Errors
/// Every fault of it, one per line.
pub fn read_deck_with(path: &Path, options: &Options) -> Result<Model, String> {
    let text = gather_deck(path, options)?;
    let reading = deck::read_whole(&text, &path.display().to_string()).map_err(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        list_of_faults(&lines)
    })?;
    warn(&reading.warnings);
    Ok(reading.model)
}

/// Tells what is done otherwise than a deck says, on standard error.
pub fn warn(warnings: &[deck::Warning]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

/// The text of a deck with the files that it refers to.
///
/// # Errors
/// If the deck cannot be opened, or is too large.
pub fn gather_deck(path: &Path, options: &Options) -> Result<String, String> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| format!("{name}: {e}"))?;
    // Comments of keyword decks are written in all kinds of encodings.
    let text = match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) if error.as_bytes().iter().any(|b| matches!(b, b'*' | b'$')) => {
            String::from_utf8_lossy(error.as_bytes()).into_owned()
        }
        Err(error) => return Err(format!("{name}: {error}")),
    };
    let mut open =
        |path: &str| std::fs::read(path).ok().map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    bundle::gather(&name, text, options, &mut open)
}

/// Every fault of a deck, one per line, under their number.
pub fn list_of_faults(lines: &[String]) -> String {
    let ending = if lines.len() == 1 { "" } else { "s" };
    format!("{} fault{ending} in the deck\n{}", lines.len(), lines.join("\n"))
}

/// A deck with what the flags change of it.
///
/// # Errors
/// Faults of the deck or of the flags.
pub fn model_for(deck: &Path, reading: &Options, options: &JobOptions) -> Result<Model, String> {
    let mut model = read_deck_with(deck, reading)?;
    limit(&mut model, options)?;
    Ok(model)
}

/// Brings the end of a run forward to where the flags want it.
///
/// # Errors
/// If the time is none.
pub fn limit(model: &mut Model, options: &JobOptions) -> Result<(), String> {
    let control = &mut model.setup.control;
    if let Some(cycles) = options.cycles {
        control.end_cycle = control.end_cycle.min(cycles);
    }
    if let Some(time) = options.end_time {
        if !(time.is_finite() && time > 0.0) {
            return Err(format!("--end-time {time}: a positive time in the deck's unit is needed"));
        }
        control.end_time = control.end_time.min(time);
    }
    Ok(())
}

/// The options of a job from what was asked, on so many workers; `all_take_peers` as for
/// [`RouteChoice::choose`](protocol::request::RouteChoice::choose).
pub fn options_for(asked: &JobOptions, workers: usize, all_take_peers: bool) -> event::Options {
    event::Options {
        lanes: asked.lanes.clone(),
        route: asked.route.choose(workers, all_take_peers),
        dealing: crate::balance::Dealing::Owners,
        costs: Default::default(),
        snapshot_at: asked.snapshot_at,
        keep: Keep::Never,
        store: false,
        balance: asked.balance,
        waits: false,
        replay: false,
        states: !asked.no_output,
        force_sorts: match (asked.sort_every, asked.sort_seed) {
            (Some(n), _) => ForceSorts::Every(n),
            (None, Some(seed)) => ForceSorts::Seeded(seed),
            (None, None) => ForceSorts::Never,
        },
    }
}

/// How often a run is stored on disk: as asked, else as its deck says, else every `default` seconds.
pub fn interval_for(asked: &JobOptions, model: &Model, default: Option<f64>) -> Interval {
    let positive = |seconds: &f64| *seconds > 0.0;
    let output = &model.output;
    if asked.snapshot_every.is_some() || asked.snapshot_cycles.is_some() {
        return Interval { seconds: asked.snapshot_every.filter(positive), cycles: asked.snapshot_cycles };
    }
    if output.snapshot_seconds.is_some() || output.snapshot_cycles.is_some() {
        return Interval { seconds: output.snapshot_seconds, cycles: output.snapshot_cycles };
    }
    Interval { seconds: default, cycles: None }
}

/// How often the state is kept in memory, so that it can be gone back to and stored.
pub fn keep_for(memory: Option<f64>, interval: Interval) -> Keep {
    let seconds = match (memory, interval.seconds) {
        (Some(memory), Some(disk)) => Some(memory.min(disk)),
        (memory, disk) => memory.or(disk),
    };
    match (seconds, interval.cycles) {
        (Some(seconds), Some(cycles)) => Keep::Either(seconds, cycles),
        (Some(seconds), None) => Keep::Seconds(seconds),
        (None, Some(cycles)) => Keep::Cycles(cycles),
        (None, None) => Keep::Never,
    }
}

/// The relative speeds of `n` workers.
///
/// # Errors
/// If a speed is not positive or there are more speeds than workers.
pub fn speeds_for(n: usize, given: &[f64]) -> Result<Vec<f64>, String> {
    if given.len() > n {
        return Err(format!("--speeds names {} workers, --workers {n}", given.len()));
    }
    if let Some(bad) = given.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
        return Err(format!("--speeds {bad}: a speed is a positive number, relative to the other workers"));
    }
    Ok((0..n).map(|i| given.get(i).copied().unwrap_or(1.0)).collect())
}

/// Where a run writes: `--out`, or the folder it resumes from, or `results/<deck name>`.
pub fn folder_for(args: &RunArgs) -> PathBuf {
    let resumed = args.resume.clone().filter(|path| path.is_dir());
    args.out.clone().or(resumed).unwrap_or_else(|| {
        Path::new("results").join(args.deck.file_stem().unwrap_or(std::ffi::OsStr::new("run")))
    })
}

/// Runs a deck here: in this process, or with a process for each worker.
///
/// # Errors
/// Whatever kept it from its end.
pub fn run(args: &RunArgs) -> Result<ExitCode, String> {
    if let Some(pin) = &args.pin {
        pin.apply()?;
    }
    let asked = args.job.asked();
    let model = Arc::new(model_for(&args.deck, &args.reading.options(), &asked)?);
    let n = args.workers as usize;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.threads.map_or(cores, |t| t as usize);
    let hands: Vec<Hand> = speeds_for(n, &args.speeds)?
        .into_iter()
        .enumerate()
        .map(|(i, speed)| Hand { name: format!("worker-{i}"), speed, threads: threads as u32 })
        .collect();
    let resume = args.resume.as_deref().map(resumed_from).transpose()?;
    let path = (!asked.no_output).then(|| folder_for(args));
    // A run that resumes from its own folder goes on writing there.
    let in_place = path.is_some() && args.resume.is_some() && args.resume == path;
    let folder = path.as_deref().map(|path| match in_place {
        true => Folder::reopen(path),
        false => Folder::create(path, args.force),
    });
    let folder = folder.transpose().map_err(|e| e.to_string())?;
    let interval = interval_for(&asked, &model, None);
    if !interval.is_never() && folder.is_none() {
        return Err("snapshots need a results folder; leave out --no-output".to_owned());
    }
    // Nobody is lost who shares this process.
    let memory = asked.keep_every.filter(|_| args.processes);
    let options = event::Options {
        keep: keep_for(memory, interval),
        store: folder.is_some(),
        ..options_for(&asked, n, true)
    };
    let states = resume.as_ref().filter(|_| in_place).map(|snapshot| snapshot.states.clone());
    // Without contact the surface is found for its census alone, before there are states beside it.
    let bare = model.setup.contact.is_none().then(|| Census::without_contact(&model));
    let (mut job, first) = Job::new(Arc::clone(&model), &hands, options, resume)?;
    let census = bare.unwrap_or_else(|| Census::of(&job, &model));
    let mut output = Output::new(Arc::clone(&model), folder, args.json)?;
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
    if !args.processes && output.keeper.is_none() {
        job.keep_no_state();
    }
    let stop = stop_on_interrupt("stopping after this cycle");
    let children = args.processes.then(|| Processes::start(&hands)).transpose()?;
    let started = Instant::now();
    let (outcome, traffic) = match &children {
        Some(children) => children.run(job, first, &mut output, &stop)?,
        None => {
            let pool = threads.max(cores.min(n * threads));
            embedded::run(job, first, n, pool, &mut output, &stop)?
        }
    };
    let wall = started.elapsed().as_secs_f64();
    drop(children);
    output.finish();
    output.flush()?;
    if let (Some(keeper), true) = (&output.keeper, outcome.stopped && outcome.failure.is_none()) {
        say_how_to_resume(keeper, &output);
    }
    if let Some(path) = &args.trace {
        trace::write(path, &outcome.workers, &outcome.reports).map_err(|e| e.to_string())?;
    }
    let total_threads = (n * threads) as u32;
    conclude(&model, &census, &outcome, traffic, total_threads, wall, &output, args.json)
}

/// The snapshot in a file, or the newest whole one of a results folder; what is wrong with newer ones is a warning.
fn resumed_from(path: &Path) -> Result<Snapshot, String> {
    if !path.is_dir() {
        return snapshot::read(path);
    }
    let folder = path.join(store::FOLDER);
    let (_, found) = Store::open(&folder)?;
    for why in &found.warnings {
        warn!("{why}");
    }
    let snapshot = found.snapshot.ok_or_else(|| {
        format!("no whole snapshot in {}; start the run anew, with --force", folder.display())
    })?;
    info!("going on at cycle {}", snapshot.state.cycle);
    Ok(snapshot)
}

/// After an interrupt: the command that goes on.
fn say_how_to_resume(keeper: &Keeper, output: &Output) {
    let kept = keeper.flush();
    match (kept.refused, &output.folder) {
        (None, Some(folder)) if kept.cycle.is_some() => {
            let cycle = kept.cycle.unwrap_or_default();
            eprintln!("stored at cycle {cycle}; go on with: {}", resuming_command(folder.path()));
        }
        (Some(why), _) => eprintln!("not stored: {why}"),
        _ => eprintln!("not stored: nothing was computed"),
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

/// A word as a shell takes it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Counts of the surface, taken before the run.
pub struct Census {
    elements: u64,
    faces: u64,
    nodes: u64,
}

impl Census {
    /// Of a job; without contact the surface is counted all the same.
    pub fn of(job: &Job, model: &Model) -> Self {
        job.surface().map_or_else(|| Self::without_contact(model), Self::count)
    }

    fn without_contact(model: &Model) -> Self {
        Self::count(&mechanics::contact::Surface::new(&model.mesh, &model.setup.materials, &|_| true))
    }

    fn count(surface: &mechanics::contact::Surface) -> Self {
        Self {
            elements: surface.n_elements() as u64,
            faces: surface.faces.len() as u64,
            nodes: surface.active.iter().filter(|active| **active).count() as u64,
        }
    }
}

/// Prints and writes the summary, and says how the process ends.
///
/// # Errors
/// The failure of the run, after its results are written.
#[expect(clippy::too_many_arguments, reason = "the facts of a run come from as many places")]
pub fn conclude(
    model: &Model,
    census: &Census,
    outcome: &Outcome,
    traffic: Traffic,
    threads: u32,
    wall_s: f64,
    output: &Output,
    json: bool,
) -> Result<ExitCode, String> {
    let summary = summarise(model, census, outcome, traffic, threads, wall_s);
    if let Some(folder) = &output.folder {
        summary.write(folder).map_err(|e| e.to_string())?;
        report::write(folder, &summary, &model.units).map_err(|e| e.to_string())?;
    }
    if json {
        println!("{}", serde_json::to_string(&summary).map_err(|e| e.to_string())?);
    } else {
        println!("{}", summary.table(&model.units));
        if let Some(folder) = &output.folder {
            println!("results in {}", folder.path().display());
        }
    }
    match (&outcome.failure, outcome.stopped) {
        (Some(reason), _) => Err(reason.clone()),
        (None, true) => Ok(ExitCode::from(130)),
        (None, false) => Ok(ExitCode::SUCCESS),
    }
}

/// The facts of a run, for a person and for a file.
pub fn summarise(
    model: &Model,
    census: &Census,
    outcome: &Outcome,
    traffic: Traffic,
    threads: u32,
    wall_s: f64,
) -> Summary {
    let ledger = &outcome.ledger;
    let cycles = outcome.state.as_ref().map_or(ledger.last.cycle, |s| s.cycle);
    let elements = model.mesh.n_elements() as u64;
    let compute: u64 = outcome.work.iter().map(|w| w.compute_ns).sum::<u64>() + traffic.sort_ns;
    let contact: u64 = outcome.work.iter().map(|w| w.contact_ns).sum::<u64>() + traffic.sort_ns;
    let per = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
    let run_cycles = outcome.cycles_run as f64;
    let units = &outcome.census;
    Summary {
        title: model.title.clone(),
        elements,
        nodes: model.mesh.n_nodes() as u64,
        surface_elements: census.elements,
        surface_faces: census.faces,
        surface_nodes: census.nodes,
        workers: outcome.workers.len() as u32,
        threads,
        route: outcome.route.to_owned(),
        linked_pairs: pairs(&outcome.reports).0,
        relayed_pairs: pairs(&outcome.reports).1,
        lanes: outcome.lanes.clone(),
        cycles,
        end_time: outcome.state.as_ref().map_or(ledger.last.time, |s| s.time),
        wall_s,
        grind_ns: per(compute as f64, elements as f64 * run_cycles),
        contact_share: per(contact as f64, compute as f64),
        sorts: outcome.sorts,
        work_units: WorkUnits {
            count: units.units as u64,
            nodes_min: units.nodes.0 as u64,
            nodes_mean: units.nodes.1,
            nodes_max: units.nodes.2 as u64,
            faces_min: units.faces.0 as u64,
            faces_mean: units.faces.1,
            faces_max: units.faces.2 as u64,
            interactions: units.interactions,
        },
        imbalance: outcome.imbalance,
        bytes_per_cycle: per(traffic.bytes as f64, run_cycles),
        master_bytes_per_cycle: per((traffic.bytes - traffic.peer_bytes) as f64, run_cycles),
        worker_times: worker_times(&outcome.workers, &outcome.reports),
        eroded_elements: ledger.eroded_elements,
        eroded_mass: ledger.eroded_mass,
        eroded_energy: ledger.eroded,
        energies: Energies {
            kinetic: ledger.last.kinetic,
            internal: ledger.last.internal,
            hourglass: ledger.hourglass,
            viscosity: ledger.viscosity,
            contact: ledger.last.contact + ledger.friction,
            friction: ledger.friction,
            external: ledger.external,
            error: ledger.last.error,
            parts: named_parts(model, &ledger.last.parts, outcome.state.as_ref()),
            contacts: ledger.contacts.iter().map(|pair| named_pair(model, pair)).collect(),
        },
        momentum_error: ledger.momentum_error(),
        worst_courant: ledger.worst_courant,
        worst_gap_travel: ledger.worst_gap_travel,
        worst_penetration: ledger.worst_penetration,
        rebalances: outcome.rebalances.clone(),
        losses: outcome.losses.clone(),
        digest: outcome.digest.clone(),
    }
}

/// Energies of the parts beside their names, and what each has lost to erosion.
fn named_parts(model: &Model, parts: &[PartEnergy], state: Option<&GlobalState>) -> Vec<NamedPart> {
    let offsets = model.mesh.element_offsets();
    let eroded = |p: usize| {
        let elements = offsets[p]..offsets[p] + model.mesh.parts[p].n_elements();
        state.map_or(0, |state| elements.filter(|&e| state.is_eroded(e)).count() as u64)
    };
    let of = |(p, (part, e)): (usize, (&mechanics::mesh::Part, &PartEnergy))| NamedPart {
        eroded_elements: eroded(p),
        name: part.name.clone(),
        kinetic: e.kinetic,
        internal: e.internal,
        hourglass: e.hourglass,
        viscosity: e.viscosity,
        external: e.external,
    };
    model.mesh.parts.iter().zip(parts).enumerate().map(of).collect()
}

/// Energies of a pair beside the names of its parts.
fn named_pair(model: &Model, pair: &crate::ledger::PairSums) -> NamedPair {
    let name = |p: u32| model.mesh.parts.get(p as usize).map_or_else(String::new, |part| part.name.clone());
    NamedPair {
        parts: pair.parts.map(name),
        contact: pair.contact + pair.friction,
        friction: pair.friction,
        eroded: pair.eroded,
    }
}

/// Pairs of workers that exchange over a link of their own, and those that the master relays for.
fn pairs(reports: &[Report]) -> (u64, u64) {
    let pair = |me: usize, other: &u32| (me.min(*other as usize), me.max(*other as usize));
    let of = |list: fn(&Report) -> &Vec<u32>| -> BTreeSet<(usize, usize)> {
        let lists = reports.iter().enumerate();
        lists.flat_map(|(me, report)| list(report).iter().map(move |other| pair(me, other))).collect()
    };
    let (linked, relayed) = (of(|report| &report.linked), of(|report| &report.relayed));
    (linked.difference(&relayed).count() as u64, relayed.len() as u64)
}

/// How the time of each worker went.
fn worker_times(names: &[String], reports: &[Report]) -> Vec<WorkerTimes> {
    let of = |(name, report): (&String, &Report)| WorkerTimes {
        name: (*name).to_owned(),
        border_s: report.seconds(Phase::Border),
        contact_s: report.seconds(Phase::Contact),
        interior_s: report.seconds(Phase::Interior),
        send_s: report.seconds(Phase::Send),
        wait_s: report.seconds(Phase::Wait),
        integrate_s: report.seconds(Phase::Integrate),
        other_s: report.seconds(Phase::Other),
        peer_bytes: report.peer_bytes,
    };
    names.iter().zip(reports).map(of).collect()
}

/// A flag that Ctrl-C or SIGTERM sets, saying `what` happens now; a second one ends the process at once.
pub fn stop_on_interrupt(what: &'static str) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let (heeded, heeding) = std::sync::mpsc::channel();
    let spawned = std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else {
            return;
        };
        runtime.block_on(async {
            use tokio::signal::unix::{SignalKind, signal};
            let Ok(mut interrupt) = signal(SignalKind::interrupt()) else { return };
            let Ok(mut term) = signal(SignalKind::terminate()) else { return };
            // The caller waits for this.
            let _ = heeded.send(());
            loop {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = term.recv() => {}
                }
                if flag.swap(true, Ordering::Relaxed) {
                    std::process::exit(130);
                }
                eprintln!("{what}; once more to leave at once");
            }
        });
    });
    if spawned.is_ok() {
        // Without the thread Ctrl-C ends the process as usual.
        let _ = heeding.recv();
    }
    stop
}

/// Writes rows and states, shows progress.
pub struct Output {
    model: Arc<Model>,
    /// The results folder; none with `--no-output`.
    pub folder: Option<Folder>,
    /// Where bases go; none where nothing is stored.
    pub keeper: Option<Keeper>,
    history: Option<History>,
    writer: Option<Writer>,
    /// By global element index, who computes what; none where nobody wants to know.
    owners: Option<Arc<[u32]>>,
    bar: Option<ProgressBar>,
    started: Instant,
    last_line: Instant,
    /// Length of the history before its first row and after each (bytes).
    row_ends: Vec<u64>,
    /// Cycle and time of each state written.
    states: Vec<(u64, f64)>,
}

impl Output {
    /// Opens the files of a results folder.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn new(model: Arc<Model>, folder: Option<Folder>, json: bool) -> Result<Self, String> {
        let fault = |e: crate::results::Error| e.to_string();
        let history = folder.as_ref().map(|f| History::create(f, &model)).transpose().map_err(fault)?;
        let series = folder.as_ref().map(|f| Series::new(f, &model)).transpose().map_err(fault)?;
        let writer = series.map(|series| Writer::start(series, Arc::clone(&model))).transpose()?;
        let bar = (std::io::stderr().is_terminal() && !json).then(|| {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = ProgressStyle::with_template("{bar:24} {percent:>3}% {msg}") {
                bar.set_style(style);
            }
            bar
        });
        let row_ends = history.iter().map(History::length).collect();
        Ok(Self {
            model,
            folder,
            keeper: None,
            history,
            row_ends,
            states: Vec::new(),
            writer,
            owners: None,
            bar,
            started: Instant::now(),
            last_line: Instant::now(),
        })
    }

    /// Writes what belongs before the first cycle of a session: the rows so far, and the first state. `states` are those
    /// that an earlier session wrote into this very folder before the snapshot that is gone on with; later ones go.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn go_on(&mut self, job: &Job, states: Option<Vec<(u64, f64)>>) -> Result<(), String> {
        for row in job.rows_before() {
            self.row(row)?;
        }
        let Some(writer) = &self.writer else { return Ok(()) };
        if let Some(probe) = job.probe().filter(|_| self.model.output.contact_surface) {
            let on = |series: &mut Series| {
                series.with_contact(probe);
                Ok(())
            };
            writer.with(on).map_err(|e| e.to_string())?;
        }
        self.owners = job.owners();
        let Some(states) = states else { return self.state(Box::new(job.start_state().clone())) };
        if let Some(folder) = &self.folder {
            folder.keep_states(states.len()).map_err(|e| e.to_string())?;
        }
        self.states = states;
        self.roll_back()
    }

    /// Makes the index name the states that are left.
    fn roll_back(&mut self) -> Result<(), String> {
        let Some(writer) = &self.writer else { return Ok(()) };
        let times: Vec<f64> = self.states.iter().map(|(_, time)| *time).collect();
        writer.with(|series| series.roll_back(&times)).map_err(|e| e.to_string())
    }

    /// States that were handed over are on disk after this.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn flush(&self) -> Result<(), String> {
        self.writer.as_ref().map_or(Ok(()), Writer::flush).map_err(|e| e.to_string())
    }

    /// Appends a row of history.
    ///
    /// # Errors
    /// What the disk refused.
    pub fn row(&mut self, row: &HistoryRow) -> Result<(), String> {
        let Some(history) = &mut self.history else { return Ok(()) };
        history.append(row).map_err(|e| e.to_string())?;
        self.row_ends.push(history.length());
        Ok(())
    }

    /// Drops all rows but the first so many, and states of later cycles than this.
    fn rewind(&mut self, rows: usize, cycle: u64) -> Result<(), String> {
        let fault = |e: crate::results::Error| e.to_string();
        self.row_ends.truncate(rows + 1);
        if let (Some(history), Some(&end)) = (&mut self.history, self.row_ends.last()) {
            history.roll_back(end).map_err(fault)?;
        }
        self.states.retain(|(written, _)| *written <= cycle);
        self.roll_back()
    }

    /// Has a state written, unless one of that time was the last.
    ///
    /// # Errors
    /// What the disk refused, of this state or of one before.
    pub fn state(&mut self, state: Box<GlobalState>) -> Result<(), String> {
        if self.states.last().is_some_and(|(_, time)| *time == state.time) {
            return Ok(());
        }
        let moment = (state.cycle, state.time);
        if let Some(writer) = &self.writer {
            writer.put(state, self.owners.clone()).map_err(|e| e.to_string())?;
        }
        self.states.push(moment);
        Ok(())
    }

    fn progress(&mut self, progress: Progress) {
        let now = Instant::now();
        let every = if self.bar.is_some() { 0.1 } else { 10.0 };
        if now.duration_since(self.last_line).as_secs_f64() < every {
            return;
        }
        self.last_line = now;
        let elapsed = now.duration_since(self.started).as_secs_f64();
        let (line, share) = progress_line(&self.model, &progress, elapsed);
        match &self.bar {
            Some(bar) => {
                bar.set_position((share * 1000.0) as u64);
                bar.set_message(line);
            }
            None => eprintln!("{line}"),
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// How far a run is, in words and as a share of the whole, `elapsed` seconds after its start.
pub fn progress_line(model: &Model, progress: &Progress, elapsed: f64) -> (String, f64) {
    let control = &model.setup.control;
    let share =
        (progress.time / control.end_time).max(progress.cycle as f64 / control.end_cycle as f64).min(1.0);
    let grind = elapsed * 1e9 / (progress.cycle.max(1) as f64 * model.mesh.n_elements() as f64);
    let limit = match (progress.limit, progress.element) {
        (Limit::Courant, Some(element)) => format!("element {element}"),
        (limit, _) => format!("{limit:?}").to_lowercase(),
    };
    let eta =
        if share > 0.0 { format!("  ETA {:.0} s", elapsed * (1.0 - share) / share) } else { String::new() };
    let units = crate::results::Units::named(&model.units).time;
    let line = format!(
        "cycle {}  t {:.4e} {units}  dt {:.3e} ({limit})  {grind:.0} ns/element wall{eta}",
        progress.cycle, progress.time, progress.dt
    );
    (line, share)
}

impl Sink for Output {
    fn take(&mut self, action: Action) -> Result<(), String> {
        if let Some(writer) = &self.writer {
            writer.check().map_err(|e| e.to_string())?;
        }
        match action {
            Action::Row(row) => self.row(&row),
            Action::State(state) => self.state(state),
            Action::Snapshot(stored) => match &self.folder {
                Some(folder) => {
                    self.flush()?;
                    let mut stored = stored;
                    let cycle = stored.state.cycle;
                    stored.states.extend(self.states.iter().filter(|(written, _)| *written <= cycle));
                    snapshot::write(&folder.file("snapshot.bolide"), &stored).map(|_| ())
                }
                None => Err("a snapshot needs a results folder; leave out --no-output".to_owned()),
            },
            Action::Base { mut snapshot, last } => {
                let cycle = snapshot.state.cycle;
                if self.keeper.as_ref().is_some_and(|keeper| last || keeper.is_due(cycle)) {
                    // A snapshot counts on the states that it names.
                    self.flush()?;
                }
                if let Some(keeper) = self.keeper.as_mut().filter(|keeper| last || keeper.is_due(cycle)) {
                    snapshot.states.extend(self.states.iter().filter(|(written, _)| *written <= cycle));
                    keeper.put(snapshot);
                }
                Ok(())
            }
            Action::Progress(progress) => {
                self.progress(progress);
                Ok(())
            }
            Action::Rewind { rows, cycle } => self.rewind(rows, cycle),
            Action::Owners(owners) => {
                self.owners = Some(owners);
                Ok(())
            }
            Action::Send(..)
            | Action::Sort(..)
            | Action::Timer(_)
            | Action::Dealt(_)
            | Action::Dismiss(..)
            | Action::Over(_) => Ok(()),
        }
    }
}
