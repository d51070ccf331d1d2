//! SERVICE: one job of the queue, from its deck's text to its summary. Runs on a thread of its own.

use std::{
    net::{SocketAddr, UdpSocket},
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError, atomic::AtomicBool},
    time::{Duration, Instant},
};

use deck::model::Model;
use mechanics::contact::Surface;
use protocol::{
    message::ToMaster,
    options::JobOptions,
    request::{Ended, Share, Status},
};
use tokio::sync::{mpsc, watch};
use tracing::{info, warn};

use crate::{
    balance,
    drive::{self, Input, WorkerLink, drive},
    embedded::Sink,
    event::{Action, Deal, WorkerSpec},
    http::board::{self, Board, JobView},
    job::Job,
    notice::Notice,
    options::{CheckpointEvery, SessionOptions, bring_end_forward, interval_for},
    output::Output,
    patches,
    progress::{Begun, progress_line},
    queue::Change,
    results::{self, Folder, Summary, TRACE, summary::Origin, trace},
    snapshot::{Snapshot, keeper::Keeper, store::Store},
    summarise::{SurfaceCensus, summarise},
};

/// Seconds between snapshots of a job that asks for no other.
const SNAPSHOT_SECONDS: f64 = 10.0;
/// The shortest time between two changes of what watchers see of a run.
const REPORT_EVERY: Duration = Duration::from_millis(100);

/// A job that was given workers.
pub struct Order {
    pub number: u32,
    /// Name of the deck's file.
    pub name: String,
    pub text: Arc<String>,
    /// What is asked beside the deck.
    pub options: JobOptions,
    /// Where results go.
    pub folder: Option<PathBuf>,
    /// Where it is stored while it runs.
    pub snapshots: PathBuf,
    /// Of a job that an earlier session has begun: how many workers it had.
    pub at_work_before: Option<usize>,
    pub worker_links: Vec<WorkerLink>,
    /// Workers that this one's master has, which may come to it later.
    pub workers_there: usize,
    /// The way to its thread; taken when it is driven.
    pub line: Mutex<Option<(mpsc::Sender<Input>, mpsc::Receiver<Input>)>>,
    /// Set to end it with the results so far.
    pub stop: Arc<AtomicBool>,
    /// What watchers see.
    pub status: watch::Sender<Status>,
    /// What the page shows of runs, if there is a page.
    pub board: Option<Arc<Board>>,
    /// The way to the scheduler.
    pub notices: mpsc::Sender<Notice>,
}

/// Why a job does not go on.
enum Failure {
    /// It is to blame, or its deck, or its folder.
    Job(String),
    /// It is held: workers die of it.
    Held(String),
    /// Its workers have no memory for it without one that was lost; it waits for others.
    Waits(String),
    /// This host is short of room, files or memory; the job waits for them.
    Shortage(String),
}

impl From<String> for Failure {
    fn from(reason: String) -> Self {
        if is_shortage(&reason) { Self::Shortage(reason) } else { Self::Job(reason) }
    }
}

impl From<drive::Error> for Failure {
    fn from(error: drive::Error) -> Self {
        match error {
            drive::Error::Sink(reason) => reason.into(),
            drive::Error::Deaths { .. } => Self::Held(error.to_string()),
            drive::Error::Memory { .. } => Self::Waits(error.to_string()),
        }
    }
}

/// Whether a reason ends in an error by which the system says that it has none left of something.
pub fn is_shortage(reason: &str) -> bool {
    system::files::SHORTAGES.iter().any(|number| reason.contains(&format!("(os error {number})")))
}

/// Runs the job; gives how it ended. A bug becomes a failure of this job alone.
pub fn serve(order: &Order) -> (Change, Ended) {
    let result = catch_unwind(AssertUnwindSafe(|| run(order)));
    let result = result.unwrap_or_else(|_| {
        for worker_link in &order.worker_links {
            worker_link.sender().abort(protocol::Error::Message("a bug ended the job".into()));
        }
        Err(Failure::Job("a bug in the master; its log has the words".to_owned()))
    });
    result.unwrap_or_else(|failure| {
        let (change, reason) = match failure {
            // The queue says what it waits for, and lets others pass.
            Failure::Waits(reason) => {
                warn!(job = order.number, "{reason}");
                return (Change::Suspend, Ended::default());
            }
            Failure::Job(reason) => (Change::Fail, reason),
            Failure::Held(reason) => (Change::Hold, format!("held: {reason}")),
            Failure::Shortage(reason) => (Change::Suspend, reason),
        };
        (change, Ended { failure: Some(reason), ..Ended::default() })
    })
}

/// Whether an address is one of this machine: then it can be bound to.
fn is_here(address: &str) -> bool {
    let ip = address.parse::<SocketAddr>().map(|address| address.ip());
    ip.is_ok_and(|ip| ip.is_loopback() || UdpSocket::bind((ip, 0)).is_ok())
}

/// Workers on this machine are dealt less where the master's sorts run beside them ([`balance::beside_sorts`]).
fn share_with_sorts(model: &Model, options: &SessionOptions, specs: &mut [WorkerSpec], beside: &[bool]) {
    if model.setup.contact.is_none() || !beside.contains(&true) {
        return;
    }
    let surface = Surface::new(&model.mesh, &model.setup.materials, &|_| true);
    let speeds: Vec<f64> = specs.iter().map(|spec| spec.speed).collect();
    let n_nodes = surface.nodes.len() as f64;
    if patches::are_sorted_by_workers(model, options, &speeds, n_nodes) {
        return;
    }
    let sort = balance::SORT_ELEMENTS * n_nodes;
    let elements = model.mesh.n_elements() as f64;
    let lag = model.setup.control.sort_lag;
    let left = balance::beside_sorts(&speeds, beside, elements, sort, lag);
    for (spec, speed) in specs.iter_mut().zip(left) {
        spec.speed = speed;
    }
}

fn run(order: &Order) -> Result<(Change, Ended), Failure> {
    let mut model = deck::read(&order.text, &order.name)
        .map_err(|faults| faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    bring_end_forward(&mut model, &order.options).map_err(|e| Failure::Job(e.to_string()))?;
    let model = Arc::new(model);
    let mut specs: Vec<_> = order.worker_links.iter().map(|worker_link| worker_link.spec.clone()).collect();
    let beside: Vec<bool> =
        order.worker_links.iter().map(|worker_link| is_here(&worker_link.address)).collect();
    let all_take_peers = order.worker_links.iter().all(|worker_link| worker_link.peer.is_some());
    let interval = interval_for(&order.options, &model, Some(SNAPSHOT_SECONDS));
    let keep = CheckpointEvery::for_both(order.options.keep_every, interval);
    // Others may come, or will be back.
    let workers = order.workers_there.max(order.at_work_before.unwrap_or_default());
    let options = SessionOptions::of(&order.options, workers, all_take_peers);
    let options = SessionOptions { waits: true, keep, store: true, replay: true, ..options };
    share_with_sorts(&model, &options, &mut specs, &beside);
    if let Some(path) = order.folder.as_ref().filter(|path| path.is_symlink()) {
        let reason = format!("{} is a link; results stay in the spool folder, remove it", path.display());
        return Err(Failure::Job(reason));
    }
    let check = |snapshot: &Snapshot| match &order.folder {
        Some(folder) => results::check_states(folder, &snapshot.sums),
        None => Ok(()),
    };
    let (store, found) = Store::open_for(&order.snapshots, check)?;
    for why in &found.warnings {
        warn!(job = order.number, "{why}");
    }
    let states = found.snapshot.as_ref().map(|snapshot| (snapshot.states.clone(), snapshot.sums.clone()));
    let (job, first) = Job::new(Arc::clone(&model), &specs, options, found.snapshot)
        .map_err(|e| Failure::Job(e.to_string()))?;
    if order.at_work_before.is_some() {
        info!(job = order.number, cycle = job.start_state().cycle, "the job goes on");
    }
    let line = order.line.lock().unwrap_or_else(PoisonError::into_inner).take();
    let line = line.unwrap_or_else(|| drive::channel(order.worker_links.len()));
    let folder = order.folder.as_ref().map(|path| match &states {
        Some(_) => Folder::reopen(path),
        None => Folder::create(path, order.at_work_before.is_some()),
    });
    let folder = folder.transpose().map_err(|e| e.to_string())?;
    let mut output = Output::new(Arc::clone(&model), folder, true)?;
    output.keep_input(&order.name, &order.text, order.options.end_time)?;
    let results = output.folder.as_ref().map(|folder| folder.path().to_owned());
    output.keeper = Some(Keeper::start(store, interval, job.start_state().cycle, results)?);
    output.go_on(&job, states)?;
    let begun = Begun::at(&model, job.start_state());
    let job_view = order.board.as_ref().map(|board| board.begin(order.number, &model, begun));
    if let Some(job_view) = &job_view {
        let mut job_view = board::lock(job_view);
        job_view.rewind(job.start_state().cycle);
        job.rows_before().iter().for_each(|row| job_view.row(row));
        job_view.state(&model, job.start_state());
    }
    order.status.send_modify(|status| status.time_unit = results::Units::named(&model.units).time.to_owned());
    let census = SurfaceCensus::of(&job, &model);
    let started = Instant::now();
    let mut reporter = Reporter {
        number: order.number,
        output,
        model: &model,
        status: &order.status,
        started,
        begun,
        last: None,
        job_view: job_view.clone(),
        notices: &order.notices,
    };
    let (outcome, traffic) =
        drive(job, first, order.number, &order.worker_links, line, &mut reporter, &order.stop)?;
    reporter.output.flush()?;
    if let Some(job_view) = &job_view {
        board::lock(job_view).over(outcome.failure.is_none() && !outcome.stopped);
    }
    let wall = started.elapsed().as_secs_f64();
    if let Some(keeper) = reporter.output.keeper.take() {
        if outcome.suspended {
            let kept = keeper.flush();
            info!(job = order.number, cycle = kept.cycle, "the job is stored and waits for the next master");
            return Ok((Change::Suspend, Ended::default()));
        }
        keeper.discard();
    }
    let threads = specs.iter().map(|spec| spec.threads).sum();
    let summary = summarise(&model, &census, &outcome, traffic, threads, wall);
    let mut summary =
        Summary { input: reporter.output.input.clone(), origin: Origin::of(&order.name), ..summary };
    let formats = reporter.output.write_summary(&mut summary)?;
    formats.written.iter().for_each(|line| info!(job = order.number, "{line}"));
    if let (Some(folder), true) = (&reporter.output.folder, order.options.trace) {
        trace::write(&folder.file(TRACE), &outcome.workers, &outcome.reports).map_err(|e| e.to_string())?;
    }
    reporter.output.seal()?;
    for warning in &summary.warnings {
        warn!(job = order.number, "{warning}");
    }
    order.status.send_modify(|status| {
        status.cycle = summary.cycles;
        status.time = summary.end_time;
    });
    let change = match (&outcome.failure, outcome.stopped) {
        (Some(_), _) => Change::Fail,
        (None, true) => Change::Cancel,
        (None, false) => Change::Finish,
    };
    let ended = Ended {
        failure: outcome.failure,
        digest: Some(outcome.digest).filter(|digest| !digest.is_empty()),
        summary: Some(serde_json::to_string(&summary).map_err(|e| e.to_string())?),
        table: Some(summary.table(&model.units, false)),
    };
    Ok((change, ended))
}

/// Results to the disk, progress to watchers.
struct Reporter<'a> {
    /// The job's.
    number: u32,
    output: Output,
    model: &'a Model,
    status: &'a watch::Sender<Status>,
    started: Instant,
    begun: Begun,
    last: Option<Instant>,
    /// What the page shows.
    job_view: Option<Arc<Mutex<JobView>>>,
    notices: &'a mpsc::Sender<Notice>,
}

impl Reporter<'_> {
    /// What the page shows of an action.
    fn show(&self, action: &Action) {
        let Some(job_view) = &self.job_view else { return };
        let mut job_view = board::lock(job_view);
        match action {
            Action::Row(row) => job_view.row(row),
            Action::State(state) => job_view.state(self.model, state),
            Action::Dealt(deals) => job_view.dealt(deals),
            Action::Proved(proved) => job_view.proved(proved),
            Action::Rewind { cycle, .. } => job_view.rewind(*cycle),
            Action::Progress(progress) => job_view.progress(progress),
            _ => {}
        }
    }

    /// Work was dealt out anew; with nobody to deal it to, the job waits.
    fn dealt(&self, deals: Vec<Deal>) {
        let workers = deals.len();
        info!(job = self.number, workers, "work is dealt out");
        let waits_for = deals.is_empty().then(|| "a worker: all are lost".to_owned());
        let share = |Deal { name, speed, elements }| Share { host: name, speed, elements };
        let shares = deals.into_iter().map(share).collect();
        self.status.send_modify(|status| {
            status.shares = shares;
            status.waits_for = waits_for;
        });
    }
}

impl Sink for Reporter<'_> {
    fn heard(&mut self, worker: &str, message: &ToMaster) {
        if let Some(job_view) = &self.job_view {
            board::lock(job_view).heard(worker, message);
        }
    }

    fn suspect(&mut self, incarnation: u32, note: Option<String>) {
        // A scheduler that has more to hear than it can shows the note of a later look.
        let _ = self.notices.try_send(Notice::Suspect { incarnation, note });
    }

    fn slow(&mut self, incarnation: u32, note: Option<String>) {
        let _ = self.notices.blocking_send(Notice::Slow { incarnation, note });
    }

    fn freed(&mut self, incarnation: u32) {
        // The scheduler lives as long as the daemon.
        let _ = self.notices.blocking_send(Notice::Freed { incarnation, job: self.number });
    }

    fn take(&mut self, action: Action) -> Result<(), String> {
        self.show(&action);
        let progress = match action {
            Action::Progress(progress) => progress,
            Action::Dealt(deals) => {
                self.dealt(deals);
                return Ok(());
            }
            Action::Rewind { cycle, .. } => {
                warn!(job = self.number, "a worker is lost: back to cycle {cycle}");
                return self.output.take(action);
            }
            other => return self.output.take(other),
        };
        let now = Instant::now();
        if self.last.is_some_and(|last| now.duration_since(last) < REPORT_EVERY) {
            return Ok(());
        }
        self.last = Some(now);
        let elapsed = now.duration_since(self.started).as_secs_f64();
        let (line, _, left) = progress_line(self.model, &progress, self.begun, elapsed);
        self.status.send_modify(|status| {
            status.cycle = progress.cycle;
            status.time = progress.time;
            status.progress = line;
            status.left_s = left;
        });
        Ok(())
    }
}
