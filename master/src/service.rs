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
use protocol::request::{Ended, JobOptions, Share, Status};
use tokio::sync::{mpsc, watch};
use tracing::{info, warn};

use crate::{
    balance,
    drive::{self, Input, Seat, drive},
    embedded::Sink,
    event::{Action, Deal, Hand, Options},
    job::Job,
    queue::Event,
    results::{Folder, TRACE, trace},
    run::{Census, Output, limit, options_for, progress_line, summarise},
};

/// The shortest time between two changes of what watchers see of a run.
const REPORT_EVERY: Duration = Duration::from_millis(100);

/// A job that was given workers.
pub struct Order {
    /// Its number.
    pub number: u32,
    /// Name of the deck's file.
    pub name: String,
    /// The deck.
    pub text: Arc<String>,
    /// What is asked beside the deck.
    pub options: JobOptions,
    /// Where results go.
    pub folder: Option<PathBuf>,
    /// Its workers.
    pub seats: Vec<Seat>,
    /// The way to its thread; taken when it is driven.
    pub line: Mutex<Option<(mpsc::Sender<Input>, mpsc::Receiver<Input>)>>,
    /// Set to end it with the results so far.
    pub stop: Arc<AtomicBool>,
    /// What watchers see.
    pub status: watch::Sender<Status>,
}

/// Runs the job; gives how it ended. A bug becomes a failure of this job alone.
pub fn serve(order: &Order) -> (Event, Ended) {
    let result = catch_unwind(AssertUnwindSafe(|| run(order)));
    let result = result.unwrap_or_else(|_| {
        for seat in &order.seats {
            seat.sender().abort(protocol::Error::Message("a bug ended the job".into()));
        }
        Err("a bug in the master; its log has the words".to_owned())
    });
    result.unwrap_or_else(|reason| (Event::Fail, Ended { failure: Some(reason), ..Ended::default() }))
}

/// Whether an address is one of this machine: then it can be bound to.
fn is_here(address: &str) -> bool {
    let ip = address.parse::<SocketAddr>().map(|address| address.ip());
    ip.is_ok_and(|ip| ip.is_loopback() || UdpSocket::bind((ip, 0)).is_ok())
}

/// Workers on this machine are dealt less, for sorts run beside them ([`balance::beside_sorts`]).
fn share_with_sorts(model: &Model, hands: &mut [Hand], beside: &[bool]) {
    if model.setup.contact.is_none() || !beside.contains(&true) {
        return;
    }
    let surface = Surface::new(&model.mesh, &model.setup.materials, &|_| true);
    let speeds: Vec<f64> = hands.iter().map(|hand| hand.speed).collect();
    let sort = balance::SORT_ELEMENTS * surface.nodes.len() as f64;
    let elements = model.mesh.n_elements() as f64;
    let lag = model.setup.control.sort_lag;
    let left = balance::beside_sorts(&speeds, beside, elements, sort, lag);
    for (hand, speed) in hands.iter_mut().zip(left) {
        hand.speed = speed;
    }
}

fn run(order: &Order) -> Result<(Event, Ended), String> {
    let mut model = deck::read(&order.text, &order.name)
        .map_err(|faults| faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    limit(&mut model, &order.options)?;
    let model = Arc::new(model);
    let mut hands: Vec<_> = order.seats.iter().map(|seat| seat.hand.clone()).collect();
    let beside: Vec<bool> = order.seats.iter().map(|seat| is_here(&seat.address)).collect();
    share_with_sorts(&model, &mut hands, &beside);
    let all_take_peers = order.seats.iter().all(|seat| seat.peer.is_some());
    let options = options_for(&order.options, hands.len(), all_take_peers);
    let options = Options { waits: true, ..options };
    let (job, first) = Job::new(Arc::clone(&model), &hands, options, None)?;
    let line = order.line.lock().unwrap_or_else(PoisonError::into_inner).take();
    let line = line.unwrap_or_else(|| drive::channel(order.seats.len()));
    let folder = order.folder.as_ref().map(|path| Folder::create(path, false)).transpose();
    let mut output = Output::new(Arc::clone(&model), folder.map_err(|e| e.to_string())?, true)?;
    output.state(job.start_state())?;
    let census = Census::of(&job, &model);
    let started = Instant::now();
    let mut reporter =
        Reporter { number: order.number, output, model: &model, status: &order.status, started, last: None };
    let (outcome, traffic) = drive(job, first, order.number, &order.seats, line, &mut reporter, &order.stop)?;
    let wall = started.elapsed().as_secs_f64();
    let threads = hands.iter().map(|hand| hand.threads).sum();
    let summary = summarise(&model, &census, &outcome, traffic, threads, wall);
    if let Some(folder) = &reporter.output.folder {
        summary.write(folder).map_err(|e| e.to_string())?;
        if order.options.trace {
            trace::write(&folder.file(TRACE), &outcome.workers, &outcome.reports)
                .map_err(|e| e.to_string())?;
        }
    }
    order.status.send_modify(|status| {
        status.cycle = summary.cycles;
        status.time = summary.end_time;
    });
    let event = match (&outcome.failure, outcome.stopped) {
        (Some(_), _) => Event::Fail,
        (None, true) => Event::Cancel,
        (None, false) => Event::Finish,
    };
    let ended = Ended {
        failure: outcome.failure,
        digest: Some(outcome.digest).filter(|digest| !digest.is_empty()),
        summary: Some(serde_json::to_string(&summary).map_err(|e| e.to_string())?),
        table: Some(summary.table(&model.units)),
    };
    Ok((event, ended))
}

/// Results to the disk, progress to watchers.
struct Reporter<'a> {
    /// The job's.
    number: u32,
    output: Output,
    model: &'a Model,
    status: &'a watch::Sender<Status>,
    started: Instant,
    last: Option<Instant>,
}

impl Reporter<'_> {
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
    fn take(&mut self, action: Action) -> Result<(), String> {
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
        let (line, _) = progress_line(self.model, &progress, elapsed);
        self.status.send_modify(|status| {
            status.cycle = progress.cycle;
            status.time = progress.time;
            status.progress = line;
        });
        Ok(())
    }
}
