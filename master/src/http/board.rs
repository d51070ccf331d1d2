//! BOARD: what the page shows of jobs while they run: energies, progress, load, phases, surfaces. In memory, bounded.
//!
//! A job's thread writes its [`JobView`], requests read it. Nothing here decides anything, and a master without a page has
//! no board.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use deck::model::Model;
use mechanics::state::GlobalState;
use protocol::{
    message::{ToMaster, Work},
    phase::{Phase, Report},
    token::hex,
};
use serde::Serialize;

use super::surface::Skin;
use crate::{
    event::{Deal, Progress, Proved},
    progress::Begun,
    results::{Units, history::HistoryRow},
};

/// Jobs whose views are kept.
pub const SHEETS_LIMIT: usize = 16;
/// Most points of a curve; beyond that every second one is dropped.
pub const POINTS_LIMIT: usize = 2000;
/// Most bytes of one job's surfaces; beyond that every second state is dropped.
pub const SURFACES_LIMIT: usize = 32 << 20;
/// Over how long the load of a host is averaged.
const LOAD_WINDOW: Duration = Duration::from_secs(2);

/// The views of the newest jobs.
#[derive(Default)]
pub struct Board(Mutex<BTreeMap<u32, Arc<Mutex<JobView>>>>);

/// Locks; a reader or writer that panicked leaves numbers to show all the same.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Board {
    /// A view for a job that starts, or goes on where it has begun: it keeps the surfaces of before. The oldest goes when there are too many.
    pub fn begin(&self, job: u32, model: &Model, begun: Begun) -> Arc<Mutex<JobView>> {
        let mut job_views = lock(&self.0);
        let mut job_view = JobView::new(model, begun);
        if let Some(before) = job_views.get(&job) {
            job_view.states = std::mem::take(&mut lock(before).states);
        }
        let job_view = Arc::new(Mutex::new(job_view));
        job_views.insert(job, Arc::clone(&job_view));
        while job_views.len() > SHEETS_LIMIT {
            job_views.pop_first();
        }
        job_view
    }

    /// A job's view.
    pub fn job_view(&self, job: u32) -> Option<Arc<Mutex<JobView>>> {
        lock(&self.0).get(&job).cloned()
    }

    /// The part of its time that a host computed lately (0 to 1), in the newest job it is seen in.
    pub fn load(&self, host: &str) -> Option<f64> {
        let job_views: Vec<_> = lock(&self.0).values().rev().cloned().collect();
        job_views.iter().find_map(|job_view| lock(job_view).workers.get(host).map(|worker| worker.load))
    }
}

/// A point of the energy curves. Energies of the whole problem in the deck's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Cycles completed.
    pub cycle: u64,
    /// Time (time).
    pub time: f64,
    pub kinetic: f64,
    pub internal: f64,
    /// Energy taken by hourglass forces.
    pub hourglass: f64,
    /// Energy of contact springs and friction.
    pub contact: f64,
    /// Energy that left with eroded elements.
    pub eroded: f64,
    /// Energy lost at walls.
    pub wall_loss: f64,
    /// Their sum.
    pub total: f64,
}

impl From<&HistoryRow> for Point {
    fn from(row: &HistoryRow) -> Self {
        Self {
            cycle: row.cycle,
            time: row.time,
            kinetic: row.kinetic,
            internal: row.internal,
            hourglass: row.hourglass,
            contact: row.contact + row.friction,
            eroded: row.eroded,
            wall_loss: row.wall_loss,
            total: row.total,
        }
    }
}

/// How far a run is.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Brief {
    /// Part of the whole (0 to 1).
    pub share: f64,
    /// Seconds to its end, reckoned from what is done; none before the first cycles.
    pub eta_s: Option<f64>,
    /// Cycles per second lately.
    pub rate: f64,
    /// Slowest worker over mean, lately; none before two cycles.
    pub imbalance: Option<f64>,
    /// Time step (time).
    pub dt: f64,
    /// Elements of the problem.
    pub elements: usize,
    /// States whose surfaces can be asked for.
    pub states: usize,
}

/// What one worker does.
#[derive(Default)]
struct Worker {
    elements: u64,
    speed: f64,
    busy: Option<Work>,
    /// Of the cycles on the way: what each took (ns).
    took: BTreeMap<u64, u64>,
    /// Where votes travel by a tree: its last report, and what a cycle took since the one before (ns).
    reported: Option<[u64; 2]>,
    each_took: Option<f64>,
    load: f64,
    mark: Option<(Instant, u64)>,
    report: Option<Report>,
}

impl Worker {
    /// It has been busy for so long.
    fn look(&mut self, now: Instant, busy_ns: u64) {
        let (since, ns) = *self.mark.get_or_insert((now, busy_ns));
        let passed = now.duration_since(since);
        if passed > LOAD_WINDOW / 2 {
            let computed = busy_ns.saturating_sub(ns) as f64;
            self.load = (computed / passed.as_nanos() as f64).clamp(0.0, 1.0);
            self.mark = Some((now, busy_ns));
        }
    }
}

/// A kept surface.
struct Kept {
    cycle: u64,
    time: f64,
    bytes: Arc<Vec<u8>>,
}

/// What is known of one job.
pub struct JobView {
    units: Units,
    end_time: f64,
    end_cycle: u64,
    started: Instant,
    begun: Begun,
    brief: Brief,
    pace: VecDeque<(Instant, u64)>,
    points: Vec<Point>,
    stride: u64,
    rows: u64,
    workers: BTreeMap<String, Worker>,
    balance: Vec<(u64, f64)>,
    /// Votes travel by a tree: workers' reports say what their cycles take.
    by_tree: bool,
    skin: Skin,
    /// Planes of symmetry.
    mirrors: [bool; 3],
    states: Vec<Kept>,
    /// The newest sample that agreed, to be computed a third time by who asks for it.
    proved: Option<Arc<Proved>>,
}

impl JobView {
    fn new(model: &Model, begun: Begun) -> Self {
        let control = &model.setup.control;
        Self {
            units: Units::named(&model.units),
            end_time: control.end_time,
            end_cycle: control.end_cycle,
            started: Instant::now(),
            begun,
            brief: Brief { elements: model.mesh.n_elements(), ..Brief::default() },
            pace: VecDeque::new(),
            points: Vec::new(),
            stride: 1,
            rows: 0,
            workers: BTreeMap::new(),
            balance: Vec::new(),
            by_tree: false,
            skin: Skin::new(model),
            mirrors: model.output.mirrors,
            states: Vec::new(),
            proved: None,
        }
    }

    pub fn brief(&self) -> &Brief {
        &self.brief
    }

    /// Takes a row of history.
    pub fn row(&mut self, row: &HistoryRow) {
        self.rows += 1;
        if self.rows.is_multiple_of(self.stride) || self.points.is_empty() {
            self.points.push(row.into());
        }
        if self.points.len() > POINTS_LIMIT {
            halve(&mut self.points);
            self.stride *= 2;
        }
    }

    /// Takes a written state.
    pub fn state(&mut self, model: &Model, state: &GlobalState) {
        if self.states.last().is_some_and(|last| last.cycle == state.cycle) {
            return;
        }
        let bytes = Arc::new(self.skin.pack(model, state));
        self.states.push(Kept { cycle: state.cycle, time: state.time, bytes });
        while self.states.len() > 2
            && self.states.iter().map(|kept| kept.bytes.len()).sum::<usize>() > SURFACES_LIMIT
        {
            halve(&mut self.states);
        }
        self.brief.states = self.states.len();
    }

    /// When a state was (time).
    pub fn time_of(&self, index: usize) -> Option<f64> {
        self.states.get(index).map(|kept| kept.time)
    }

    /// A state's surface.
    pub fn surface(&self, index: usize) -> Option<Arc<Vec<u8>>> {
        self.states.get(index).map(|kept| Arc::clone(&kept.bytes))
    }

    /// Work was dealt out.
    pub fn dealt(&mut self, deals: &[Deal]) {
        for worker in self.workers.values_mut() {
            *worker = Worker::default();
        }
        self.workers.retain(|name, _| deals.iter().any(|deal| deal.name == *name));
        for deal in deals {
            let worker = self.workers.entry(deal.name.clone()).or_default();
            (worker.elements, worker.speed) = (deal.elements, deal.speed);
        }
    }

    /// A worker's sample agreed with what it came to here.
    pub fn proved(&mut self, proved: &Arc<Proved>) {
        self.proved = Some(Arc::clone(proved));
    }

    /// The newest sample that agreed.
    pub fn newest_proved(&self) -> Option<Arc<Proved>> {
        self.proved.clone()
    }

    /// The run goes back to a cycle.
    pub fn rewind(&mut self, cycle: u64) {
        self.points.retain(|point| point.cycle <= cycle);
        self.balance.retain(|(at, _)| *at < cycle);
        self.states.retain(|kept| kept.cycle <= cycle);
        self.brief.states = self.states.len();
        self.pace.clear();
    }

    /// Takes progress.
    pub fn progress(&mut self, progress: &Progress) {
        let now = Instant::now();
        let share = progress.time / self.end_time;
        let share = share.max(progress.cycle as f64 / self.end_cycle as f64).clamp(0.0, 1.0);
        let elapsed = now.duration_since(self.started).as_secs_f64();
        self.pace.push_back((now, progress.cycle));
        while self.pace.len() > 2 && now.duration_since(self.pace[1].0) > LOAD_WINDOW {
            self.pace.pop_front();
        }
        let (from, cycle) = self.pace[0];
        let passed = now.duration_since(from).as_secs_f64();
        self.brief.share = share;
        self.brief.eta_s = self.begun.left(share, elapsed);
        self.brief.dt = progress.dt;
        if passed > 0.0 {
            self.brief.rate = progress.cycle.saturating_sub(cycle) as f64 / passed;
        }
    }

    /// It is over: the last cycle was reached if `whole`.
    pub fn over(&mut self, whole: bool) {
        self.brief.eta_s = None;
        self.brief.rate = 0.0;
        if whole {
            self.brief.share = 1.0;
        }
        for worker in self.workers.values_mut() {
            worker.load = 0.0;
        }
    }

    /// Looks at a message of a worker on its way to the job.
    pub fn heard(&mut self, host: &str, message: &ToMaster) {
        match message {
            ToMaster::Cycle { cycle, busy, .. } => {
                self.by_tree = false;
                self.cycle(host, *cycle, *busy);
            }
            ToMaster::Votes { .. } => self.by_tree = true,
            ToMaster::Report(report) => {
                let worker = self.workers.entry(host.to_owned()).or_default();
                worker.report = Some(report.as_ref().clone());
                if self.by_tree {
                    self.reported(host, report.cycle, report.busy_ns);
                }
            }
            _ => {}
        }
    }

    fn cycle(&mut self, host: &str, cycle: u64, busy: Work) {
        let now = Instant::now();
        let worker = self.workers.entry(host.to_owned()).or_default();
        if let Some(before) = worker.busy.replace(busy) {
            worker.took.insert(cycle, busy.compute_ns.saturating_sub(before.compute_ns));
        }
        worker.look(now, busy.compute_ns);
        if self.workers.values().all(|worker| worker.took.contains_key(&cycle)) {
            let took = self.workers.values().map(|worker| worker.took[&cycle] as f64);
            let mean = took.clone().sum::<f64>() / self.workers.len() as f64;
            let most = took.fold(0.0, f64::max);
            for worker in self.workers.values_mut() {
                worker.took.retain(|&at, _| at > cycle);
            }
            self.add_balance(cycle, most, mean);
        }
    }

    /// A worker of a tree has been busy for so long by this cycle.
    fn reported(&mut self, host: &str, cycle: u64, busy_ns: u64) {
        let worker = self.workers.entry(host.to_owned()).or_default();
        if let Some([before, ns]) = worker.reported.replace([cycle, busy_ns])
            && cycle > before
        {
            worker.each_took = Some(busy_ns.saturating_sub(ns) as f64 / (cycle - before) as f64);
        }
        worker.look(Instant::now(), busy_ns);
        if self.workers.values().all(|worker| worker.each_took.is_some()) {
            let took = self.workers.values_mut().filter_map(|worker| worker.each_took.take());
            let took: Vec<f64> = took.collect();
            let most = took.iter().copied().fold(0.0, f64::max);
            self.add_balance(cycle, most, took.iter().sum::<f64>() / took.len() as f64);
        }
    }

    /// What the slowest took at a cycle, and all in the mean.
    fn add_balance(&mut self, cycle: u64, most: f64, mean: f64) {
        if mean > 0.0 {
            self.balance.push((cycle, most / mean));
            let lately = &self.balance[self.balance.len().saturating_sub(32)..];
            let sum: f64 = lately.iter().map(|(_, ratio)| ratio).sum();
            self.brief.imbalance = Some(sum / lately.len() as f64);
        }
        if self.balance.len() > 2 * POINTS_LIMIT {
            halve(&mut self.balance);
        }
    }

    /// Everything but the surfaces, as JSON.
    pub fn json(&self) -> serde_json::Value {
        let spans = || self.workers.values().filter_map(|w| w.report.as_ref()).flat_map(|r| &r.spans);
        let start = spans().map(|span| span.start_ns).min().unwrap_or(0);
        let workers: Vec<_> = self.workers.iter().map(|(name, worker)| worker.json(name, start)).collect();
        let states: Vec<_> = self
            .states
            .iter()
            .map(|s| serde_json::json!({ "key": s.cycle, "cycle": s.cycle, "time": s.time }))
            .collect();
        let parts = self.skin.parts();
        serde_json::json!({
            "brief": self.brief,
            "end_time": self.end_time,
            "units": self.units.json(),
            "elapsed_s": self.started.elapsed().as_secs_f64(),
            "energies": self.points,
            "imbalance": self.balance,
            "phases": Phase::ALL.map(Phase::name),
            "workers": workers,
            "states": states,
            "parts": parts,
            "mirrors": self.mirrors,
            "proved": self.proved.as_ref().map(|proved| serde_json::json!({
                "worker": proved.worker, "part": proved.part, "cycle": proved.sample.cycle,
                "elements": proved.sample.piece.elements.len(), "hash": hex(&proved.hash),
            })),
        })
    }
}

impl Worker {
    /// Spans as (phase, cycle, start, length) in nanoseconds since the first of all workers.
    fn json(&self, name: &str, start: u64) -> serde_json::Value {
        let spans = self.report.iter().flat_map(|report| &report.spans);
        let spans: Vec<[u64; 4]> =
            spans.map(|s| [s.phase as u64, s.cycle, s.start_ns - start, s.length_ns]).collect();
        serde_json::json!({
            "name": name, "elements": self.elements, "speed": self.speed, "load": self.load,
            "phase_ns": self.report.as_ref().map(|report| report.ns), "spans": spans,
        })
    }
}

/// So many entries of a list at most, at even distances, its last among them.
pub fn thinned<T>(list: Vec<T>, most: usize) -> Vec<T> {
    let step = list.len().div_ceil(most.max(1)).max(1);
    let last = list.len().saturating_sub(1);
    list.into_iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last).map(|(_, one)| one).collect()
}

/// Drops every second entry but keeps the last.
fn halve<T>(list: &mut Vec<T>) {
    let last = list.len().saturating_sub(1);
    let mut index = 0;
    list.retain(|_| {
        index += 1;
        (index - 1) % 2 == 0 || index - 1 == last
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job_view() -> JobView {
        let text = include_str!("../../../tests/decks/plates-small.toml");
        JobView::new(&deck::read(text, "small").expect("without faults"), Begun::default())
    }

    fn frame(cycle: u64, compute_ns: u64) -> ToMaster {
        let busy = Work { compute_ns, contact_ns: 0 };
        ToMaster::Cycle { cycle, vote: None, partials: Vec::new(), gathered: Vec::new(), busy }
    }

    #[test]
    fn curves_are_thinned_and_keep_their_ends() {
        let mut job_view = job_view();
        for cycle in 0..10 * POINTS_LIMIT as u64 {
            job_view.row(&HistoryRow { cycle, ..HistoryRow::default() });
        }
        assert!(job_view.points.len() <= POINTS_LIMIT + 1);
        assert_eq!(job_view.points[0].cycle, 0);
        assert!(job_view.points.last().is_some_and(|p| p.cycle > 9 * POINTS_LIMIT as u64));
        job_view.rewind(100);
        assert!(job_view.points.iter().all(|point| point.cycle <= 100));
    }

    #[test]
    fn a_job_that_goes_on_keeps_its_surfaces_and_its_pace_is_that_since_then() {
        let text = include_str!("../../../tests/decks/plates-small.toml");
        let model = deck::read(text, "small").expect("without faults");
        let board = Board::default();
        let kept = |cycle| Kept { cycle, time: 0.0, bytes: Arc::default() };
        lock(&board.begin(1, &model, Begun::default())).states = vec![kept(0), kept(20), kept(40)];
        let again = board.begin(1, &model, Begun { cycle: 30, share: 0.5 });
        let mut again = lock(&again);
        again.rewind(30);
        assert_eq!((again.states.len(), again.brief.states), (2, 2));
        again.started = Instant::now().checked_sub(Duration::from_secs(10)).expect("long after the start");
        let time = 0.6 * model.setup.control.end_time;
        let limit = crate::event::Limit::Courant;
        again.progress(&Progress { cycle: 40, time, dt: 1.0, element: None, limit });
        assert!(again.brief.eta_s.is_some_and(|left| (40.0..41.0).contains(&left)), "{:?}", again.brief);
    }

    #[test]
    fn imbalance_is_the_slowest_over_the_mean_of_whole_cycles() {
        let mut job_view = job_view();
        let deal = |name: &str| Deal { name: name.to_owned(), speed: 1.0, elements: 1 };
        job_view.dealt(&[deal("a"), deal("b")]);
        for cycle in 1..=3 {
            job_view.heard("a", &frame(cycle, 100 * cycle));
            job_view.heard("b", &frame(cycle, 300 * cycle));
        }
        assert_eq!(job_view.balance, [(2, 1.5), (3, 1.5)]);
        assert_eq!(job_view.brief.imbalance, Some(1.5));
    }

    #[test]
    fn where_votes_travel_by_a_tree_reports_say_how_uneven_cycles_are() {
        let mut job_view = job_view();
        let deal = |name: &str| Deal { name: name.to_owned(), speed: 1.0, elements: 1 };
        job_view.dealt(&[deal("a"), deal("b")]);
        let report =
            |cycle, busy_ns| ToMaster::Report(Box::new(Report { cycle, busy_ns, ..Report::default() }));
        job_view.heard("a", &ToMaster::Votes { cycle: 1, votes: Default::default() });
        for (second, cycles) in [(1, 10), (2, 20)] {
            job_view.heard("a", &report(cycles, 100 * cycles));
            job_view.heard("b", &report(cycles + second, 300 * (cycles + second)));
        }
        assert_eq!(job_view.balance, [(22, 1.5)]);
    }
}
