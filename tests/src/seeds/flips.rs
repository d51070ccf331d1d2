//! FLIPS: single bits that flip in a worker's memory, and what becomes of the run by the part of it that is computed twice.
//!
//! A try flips one bit of one worker at one instant, all three drawn from the number of the try, in each of the [`Target`]s alike. The run is
//! then compared with the undisturbed one: digest, rows of the history, sums over cycles and the states that were written. One that differs
//! and says nothing is the only bad end.

use std::{fmt::Write as _, ops::Range, sync::Arc};

use deck::Model;
use master::options::{CheckpointEvery, SessionOptions};
use mechanics::flip::Target;
use protocol::options::{JobOptions, Route};
use worker::compute::Machine;

use super::{Draws, Fault, Played, Plot, Seen, Stage, play, plot};

/// Parts of the run that are computed twice, see [`JobOptions::verify`].
pub const FRACTIONS: [f64; 4] = [0.0, 0.05, 0.5, 1.0];

/// Workers of a run.
const WORKERS: usize = 3;

/// One bit of a host's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flip {
    /// Picked by this number among those alive.
    pub host: u64,
    /// What is hit, or what comes next in [`Target::ALL`] where the host holds nothing of it.
    pub target: Target,
    /// Which number of these.
    pub place: u64,
    /// Which bit of it.
    pub bit: u32,
}

impl Flip {
    /// One that is drawn.
    pub fn draw(draws: &mut Draws) -> Self {
        Self {
            host: draws.below(64),
            target: Target::ALL[draws.below(Target::ALL.len() as u64) as usize],
            place: draws.below(1 << 40),
            bit: draws.below(64) as u32,
        }
    }

    /// Flips the bit; gives what was hit, and nothing of a machine that holds nothing now.
    pub(super) fn befall(self, machine: &mut Machine) -> Option<Target> {
        let first = Target::ALL.iter().position(|target| *target == self.target).unwrap_or_default();
        let mut targets = Target::ALL.iter().cycle().skip(first).take(Target::ALL.len());
        targets.find(|target| machine.flip_bit(**target, self.place, self.bit)).copied()
    }
}

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The results are right, and the run says that something was not.
    Found,
    /// The run ended with an error.
    Error,
    /// The results are right, and nobody saw anything.
    Harmless,
    /// The run says that something was wrong, which other parts of it had taken over by then: the results are others.
    Late,
    /// The results are others, and nobody saw anything.
    Silent,
}

impl End {
    /// Each of them.
    pub const ALL: [Self; 5] = [Self::Found, Self::Error, Self::Harmless, Self::Late, Self::Silent];
}

/// A try.
#[derive(Clone, Debug)]
pub struct Try {
    pub end: End,
    /// What was hit; none if the run was over before.
    pub target: Option<Target>,
    /// The run names the worker whose memory it was, as lost or as different.
    pub named: bool,
    /// The flip, when, and what the run said.
    pub told: String,
}

impl Try {
    /// The run ended with other results than the undisturbed one.
    pub fn is_wrong(&self) -> bool {
        matches!(self.end, End::Late | End::Silent)
    }
}

/// The undisturbed runs.
pub struct Campaign {
    stage: Stage,
    /// Happenings of a run, by fraction.
    lengths: Vec<u64>,
}

impl Campaign {
    /// Plays the undisturbed runs.
    ///
    /// # Panics
    /// If one is not as all others.
    pub fn new() -> Self {
        let stage = Stage::new();
        let length = |verify| {
            let played = play(&stage.model, &options(verify), 0, Plot::quiet(WORKERS));
            let played = played.unwrap_or_else(|why| panic!("undisturbed, --verify {verify}: {why}"));
            assert!(
                Seen::of(&played.solved) == stage.answer,
                "undisturbed, --verify {verify}: other results"
            );
            assert_eq!(played.solved.outcome.differences, [], "undisturbed, --verify {verify}");
            played.count
        };
        let lengths = FRACTIONS.map(length).to_vec();
        Self { stage, lengths }
    }

    /// Plays these numbers with each fraction, see [`FRACTIONS`].
    pub fn play_all(&self, numbers: Range<u64>) -> Vec<Vec<Try>> {
        (0..FRACTIONS.len())
            .map(|fraction| numbers.clone().map(|n| self.play(n, fraction)).collect())
            .collect()
    }

    /// Flips a bit, with the fraction of this index.
    pub fn play(&self, number: u64, fraction: usize) -> Try {
        let mut draws = Draws::new(number ^ 0xf11b);
        let flip = Flip::draw(&mut draws);
        let at = (draws.below(1 << 32) * self.lengths[fraction]) >> 32;
        // Which intervals are computed twice follows from the deck, title and all.
        let model = Model { title: format!("try {number}"), ..Model::clone(&self.stage.model) };
        let plot = Plot::of(WORKERS, at, Fault::Flip(flip));
        let verify = FRACTIONS[fraction];
        let told = format!("try {number}, --verify {verify}: {flip:?} before happening {at}");
        match play(&Arc::new(model), &options(verify), number, plot) {
            Ok(played) => self.judge(&played, &told),
            Err(why) => Try { end: End::Error, target: None, named: false, told: format!("{told}: {why}") },
        }
    }

    fn judge(&self, played: &Played, told: &str) -> Try {
        let Played { solved, flipped, .. } = played;
        let outcome = &solved.outcome;
        let is_right = Seen::of(solved) == self.stage.answer;
        let is_seen = !outcome.differences.is_empty() || !outcome.losses.is_empty();
        let end = match (is_right, is_seen) {
            (true, true) => End::Found,
            (true, false) => End::Harmless,
            (false, true) => End::Late,
            (false, false) => End::Silent,
        };
        let target = flipped.first().map(|(_, target)| *target);
        let lost = outcome.losses.iter().map(|loss| &loss.worker);
        let mut names = outcome.differences.iter().flat_map(|difference| &difference.workers).chain(lost);
        let hit = flipped.first().map(|(host, _)| super::spec(*host).name);
        let named = names.any(|name| Some(name) == hit.as_ref());
        let told = format!("{told}: {:?} {:?}", outcome.differences, outcome.losses);
        Try { end, target, named, told }
    }
}

impl Default for Campaign {
    fn default() -> Self {
        Self::new()
    }
}

/// Checkpoints at every plan boundary, so that a run has some ten intervals.
fn options(verify: f64) -> SessionOptions {
    let options = plot::options(Route::Direct);
    let asked = JobOptions { verify, ..options.asked };
    SessionOptions { asked, keep: CheckpointEvery::Cycles(1), ..options }
}

/// The tables with what they say, for the document of all faults.
pub fn section(tries: &[Vec<Try>]) -> String {
    let n = tries.first().map_or(0, Vec::len);
    format!(
        "\n## Single bits in a worker's memory, a small deck\n\n{n} tries of `cargo run --release -p tests --bin flips`: three workers in one \
         process and virtual time, one bit of one of them flips at one instant, and no other fault. The samples that a master always takes are \
         on. *Found*: the results are those of the undisturbed run (digest, history, sums over cycles, states), and the summary tells of it, \
         *by name* with the worker. *Error*: the run ended with one. *Harmless*: the same results, nothing told. *Late*: told, but the results \
         are others. *Silent*: the results are others, nothing told.\n\n{}",
        table(tries)
    )
}

/// Ends by fraction, then by what was hit where nothing and where all is computed twice, as tables.
pub fn table(tries: &[Vec<Try>]) -> String {
    let mut text = String::from(
        "| `--verify` | found | by name | error | harmless | late | silent |\n|---|---|---|---|---|---|---|\n",
    );
    let count = |tries: &[Try], end| tries.iter().filter(|each| each.end == end).count();
    for (verify, tries) in FRACTIONS.iter().zip(tries) {
        let named = tries.iter().filter(|each| each.end == End::Found && each.named).count();
        let [found, error, harmless, late, silent] = End::ALL.map(|end| count(tries, end));
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {verify} | {found} | {named} | {error} | {harmless} | {late} | {silent} |");
    }
    let (Some(without), Some(all)) = (tries.first(), tries.last()) else { return text };
    text += "\n| what is hit | found, 0 | silent, 0 | found, 1 | harmless, 1 |\n|---|---|---|---|---|\n";
    for target in Target::ALL {
        let of = |tries: &[Try], end| {
            tries.iter().filter(|each| each.target == Some(target) && each.end == end).count()
        };
        let name = format!("{target:?}").to_lowercase();
        let [found, silent] = [End::Found, End::Silent].map(|end| of(without, end));
        let [found_then, harmless] = [End::Found, End::Harmless].map(|end| of(all, end));
        let _ = writeln!(text, "| {name} | {found} | {silent} | {found_then} | {harmless} |");
    }
    text
}
