//! Runs a problem through master and workers in this process, and keeps all that they say.

use std::sync::{Arc, atomic::AtomicBool};

use deck::Model;
use master::{
    embedded::{self, Fate, Sink},
    event::{Action, Outcome, WorkerSpec},
    job::Job,
    options::SessionOptions,
    results::history::{GaugeRow, HistoryRow},
    snapshot::Snapshot,
};
use mechanics::state::GlobalState;
use protocol::options::JobOptions;

/// Reads a deck.
///
/// # Panics
/// With all faults, if it has any.
pub fn model(text: &str) -> Model {
    deck::read(text, "deck").unwrap_or_else(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        panic!("{}\n{text}", lines.join("\n"))
    })
}

/// Reads an example deck of the repository, with its meshes.
///
/// # Panics
/// If it is not there or has faults.
pub fn example(name: &str) -> Model {
    of_examples(&format!("{name}.toml"))
}

/// Reads an example of a keyword deck, with what it includes.
///
/// # Panics
/// If it is not there or has faults.
pub fn keyword(name: &str) -> Model {
    of_examples(&format!("{name}.k"))
}

/// A deck of the examples with the files that it names.
fn of_examples(file: &str) -> Model {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../deck/examples").join(file);
    master::deck_file::read_deck(&path).unwrap_or_else(|faults| panic!("{faults}"))
}

/// Who computes, and what is asked beside the deck.
#[derive(Clone, Debug)]
pub struct Workers {
    /// Relative speed of each worker.
    pub speeds: Vec<f64>,
    pub threads: u32,
    /// Options of the job.
    pub options: SessionOptions,
    /// Where to go on from.
    pub resume: Option<Snapshot>,
}

impl Default for Workers {
    /// One worker of one thread.
    fn default() -> Self {
        Self { speeds: vec![1.0], threads: 1, options: without_states(JobOptions::default()), resume: None }
    }
}

impl Workers {
    /// So many workers of one thread and equal speed.
    pub fn of(workers: usize) -> Self {
        Self { speeds: vec![1.0; workers], ..Self::default() }
    }
}

/// The options of a session that gathers no states on its way.
pub fn without_states(asked: JobOptions) -> SessionOptions {
    SessionOptions { asked: JobOptions { no_output: true, ..asked }, ..SessionOptions::default() }
}

/// A run that came to its end.
pub struct Solved {
    /// What was run.
    pub model: Arc<Model>,
    /// Final state: positions and element state at the end, velocities half a step before.
    pub state: GlobalState,
    /// Rows of the history, with those before a snapshot that the run went on from.
    pub rows: Vec<HistoryRow>,
    /// States at the output period, where the workers's options ask for them; the last is the final one.
    pub states: Vec<GlobalState>,
    /// The snapshot, where one was asked for.
    pub snapshot: Option<Snapshot>,
    /// Ledger, digest, counts.
    pub outcome: Outcome,
}

impl Solved {
    /// Times and readings of a gauge.
    pub fn gauge(&self, index: usize) -> impl Iterator<Item = (f64, GaugeRow)> + '_ {
        self.rows.iter().map(move |row| (row.time, row.gauges[index]))
    }

    /// Mean of `read` over the rows of a gauge between two times.
    pub fn gauge_mean(&self, index: usize, from: f64, to: f64, read: impl Fn(&GaugeRow) -> f64) -> f64 {
        mean(self.gauge(index).filter(|(time, _)| (from..to).contains(time)).map(|(_, row)| read(&row)))
    }

    /// Mean of an element field over the elements of a part whose initial centre passes `keep`.
    pub fn element_mean(
        &self,
        state: &GlobalState,
        part: usize,
        keep: impl Fn([f64; 3]) -> bool,
        read: impl Fn(&GlobalState, usize) -> f64,
    ) -> f64 {
        mean(self.elements(part).filter(|(_, centre)| keep(*centre)).map(|(e, _)| read(state, e)))
    }

    /// Global index and initial centre of each element of a part.
    pub fn elements(&self, part: usize) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        let mesh = &self.model.mesh;
        let first = mesh.element_offsets()[part];
        (0..mesh.parts[part].n_elements()).map(move |e| {
            let corners = mesh.parts[part].corners(e).map(|n| mesh.positions[n as usize]);
            (first + e, [0, 1, 2].map(|a| corners.iter().map(|x| x[a]).sum::<f64>() / 8.0))
        })
    }

    /// The state at the first output time that is at least `time`.
    ///
    /// # Panics
    /// If there is none: the test asked for no states or for a later one.
    pub fn state_at(&self, time: f64) -> &GlobalState {
        self.states
            .iter()
            .find(|state| state.time >= time * (1.0 - 1e-9))
            .unwrap_or_else(|| panic!("{} states, none at {time:e}", self.states.len()))
    }

    /// Velocity of the centre of mass of a part.
    pub fn part_velocity(&self, part: usize) -> [f64; 3] {
        let nodes = &self.model.mesh.parts[part].nodes;
        let mass: f64 = nodes.iter().map(|&n| self.state.mass[n as usize]).sum();
        [0, 1, 2].map(|a| {
            nodes.iter().map(|&n| self.state.mass[n as usize] * self.state.v[n as usize][a]).sum::<f64>()
                / mass
        })
    }
}

/// Mean of some numbers.
///
/// # Panics
/// If there are none: a window of the test is empty.
pub fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0_usize);
    for number in numbers {
        sum += number;
        n += 1;
    }
    assert!(n > 0, "the mean of nothing");
    sum / n as f64
}

/// The cross product of two vectors.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The first time at which a rising or falling series crosses `level`, between its samples.
pub fn crossing(series: impl Iterator<Item = (f64, f64)>, level: f64) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for (time, value) in series {
        if let Some((t0, v0)) = before
            && (v0 - level) * (value - level) <= 0.0
            && v0 != value
        {
            return Some(t0 + (time - t0) * (level - v0) / (value - v0));
        }
        before = Some((time, value));
    }
    None
}

/// Keeps what a run says.
#[derive(Default)]
struct Keep {
    rows: Vec<HistoryRow>,
    states: Vec<GlobalState>,
    snapshot: Option<Snapshot>,
}

impl Sink for Keep {
    fn take(&mut self, action: Action) -> Result<(), String> {
        match action {
            Action::Row(row) => self.rows.push(*row),
            Action::State(state) => self.states.push(*state),
            Action::Snapshot(snapshot) => self.snapshot = Some(*snapshot),
            Action::Rewind { rows, cycle } => {
                self.rows.truncate(rows);
                self.states.retain(|state| state.cycle <= cycle);
            }
            _ => {}
        }
        Ok(())
    }
}

/// Runs a problem to its end on this workers.
///
/// # Errors
/// Whatever kept it from its end.
pub fn solve(model: Model, at_work: Workers) -> Result<Solved, String> {
    solve_through(model, at_work, &mut |_| None)
}

/// [`solve`] with workers that come and go; see [`embedded::run_through`].
///
/// # Errors
/// Whatever kept it from its end.
pub fn solve_through(
    model: Model,
    at_work: Workers,
    fate: &mut (dyn FnMut(u64) -> Option<Fate> + Send),
) -> Result<Solved, String> {
    let model = Arc::new(model);
    let specs: Vec<WorkerSpec> = at_work
        .speeds
        .iter()
        .enumerate()
        .map(|(i, &speed)| WorkerSpec::new(format!("worker-{i}"), speed, at_work.threads))
        .collect();
    let (job, first) = Job::new(Arc::clone(&model), &specs, at_work.options, at_work.resume)?;
    let mut keep = Keep {
        rows: job.rows_before().iter().map(|row| HistoryRow::clone(row)).collect(),
        ..Keep::default()
    };
    let stop = AtomicBool::new(false);
    let (n, threads) = (specs.len(), at_work.threads as usize);
    let (mut outcome, _) = embedded::run_through(job, first, n, threads, &mut keep, &stop, fate)?;
    if let Some(failure) = outcome.failure.take() {
        return Err(failure);
    }
    let state = outcome.state.clone().ok_or("a run without a final state")?;
    let Keep { rows, states, snapshot } = keep;
    Ok(Solved { model, state, rows, states, snapshot, outcome })
}

/// [`solve`] with one worker of one thread.
///
/// # Panics
/// If the run fails.
pub fn run(model: Model) -> Solved {
    solve(model, Workers::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// [`run`] that keeps the states at the output period of the deck.
///
/// # Panics
/// If the run fails.
pub fn run_with_states(model: Model) -> Solved {
    let options = SessionOptions::default();
    solve(model, Workers { options, ..Workers::default() }).unwrap_or_else(|e| panic!("{e}"))
}
