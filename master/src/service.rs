//! SERVICE: one job of the queue, from its deck's text to its summary. Runs on a thread of its own.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
    sync::{Arc, atomic::AtomicBool},
    time::{Duration, Instant},
};

use deck::model::Model;
use protocol::{
    message::ToWorker,
    request::{Ended, JobOptions, Share, Status},
};
use tokio::sync::watch;

use crate::{
    drive::{Seat, drive},
    embedded::Sink,
    event::Action,
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

fn run(order: &Order) -> Result<(Event, Ended), String> {
    let mut model = deck::read(&order.text, &order.name)
        .map_err(|faults| faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    limit(&mut model, &order.options)?;
    let model = Arc::new(model);
    let hands: Vec<_> = order.seats.iter().map(|seat| seat.hand.clone()).collect();
    let all_take_peers = order.seats.iter().all(|seat| seat.peer.is_some());
    let options = options_for(&order.options, hands.len(), all_take_peers);
    let (job, first) = Job::new(Arc::clone(&model), &hands, options, None)?;
    let shares = shares(&order.seats, &first);
    order.status.send_modify(|status| status.shares = shares);
    let folder = order.folder.as_ref().map(|path| Folder::create(path, false)).transpose();
    let mut output = Output::new(Arc::clone(&model), folder.map_err(|e| e.to_string())?, true)?;
    output.state(job.start_state())?;
    let census = Census::of(&job, &model);
    let started = Instant::now();
    let mut reporter = Reporter { output, model: &model, status: &order.status, started, last: None };
    let (outcome, traffic) = drive(job, first, order.number, &order.seats, &mut reporter, &order.stop)?;
    let wall = started.elapsed().as_secs_f64();
    let threads = hands.iter().map(|hand| hand.threads).sum();
    let names: Vec<&str> = hands.iter().map(|hand| hand.name.as_str()).collect();
    let summary = summarise(&model, &census, &outcome, traffic, &names, threads, wall);
    if let Some(folder) = &reporter.output.folder {
        summary.write(folder).map_err(|e| e.to_string())?;
        if order.options.trace {
            trace::write(&folder.file(TRACE), &names, &outcome.reports).map_err(|e| e.to_string())?;
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

/// Elements of each worker, from its assignment.
fn shares(seats: &[Seat], first: &[Action]) -> Vec<Share> {
    let mut shares: Vec<Share> = seats
        .iter()
        .map(|seat| Share { host: seat.hand.name.clone(), speed: seat.hand.speed, elements: 0 })
        .collect();
    for action in first {
        if let Action::Send(worker, ToWorker::Assign(assign)) = action {
            let pieces = assign.subdomains.iter().flat_map(|subdomain| &subdomain.pieces);
            shares[*worker].elements += pieces.map(|piece| piece.elements.len() as u64).sum::<u64>();
        }
    }
    shares
}

/// Results to the disk, progress to watchers.
struct Reporter<'a> {
    output: Output,
    model: &'a Model,
    status: &'a watch::Sender<Status>,
    started: Instant,
    last: Option<Instant>,
}

impl Sink for Reporter<'_> {
    fn take(&mut self, action: Action) -> Result<(), String> {
        let Action::Progress(progress) = action else { return self.output.take(action) };
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
