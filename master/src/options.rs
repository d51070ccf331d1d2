//! What the session of one run goes by: the user's [`JobOptions`], and what the program that drives the session adds.

use std::fmt;

use deck::model::Model;
use protocol::{
    handshake::SPEEDS,
    options::{Balance, JobOptions, Route},
};

use crate::{
    balance::{Costs, Dealing},
    snapshot::keeper::Interval,
};

/// What a session goes by. [`Default`] is a run of the user's defaults in one process.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionOptions {
    /// What the user asked; a route that was left to the master is the master's.
    pub asked: JobOptions,
    /// How work units are dealt.
    pub dealing: Dealing,
    /// What work costs on the workers, relative to an element.
    pub costs: Costs,
    /// How often the state is kept in memory, to go back to when a worker is lost.
    pub keep: CheckpointEvery,
    /// Give every checkpoint to the sink, for snapshots on disk.
    pub store: bool,
    /// With no worker left, wait for one instead of ending.
    pub waits: bool,
    /// Samples of what elements come to are computed again here, at the first cycle of each epoch and where states are
    /// kept; a worker whose sample differs is dropped.
    pub replay: bool,
    /// How votes and orders travel on route direct.
    pub tree: VoteTree,
    /// What workers say is played from a tape of an emulated cluster, which keeps no pieces: states may lack theirs.
    pub played: bool,
}

/// When votes and orders travel by a tree of workers, and which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoteTree {
    /// Fewer workers exchange them with the master itself.
    pub from: usize,
    /// Most children of a worker that are its neighbours: it merges their votes.
    pub neighbours: usize,
}

impl Default for VoteTree {
    fn default() -> Self {
        Self { from: 5, neighbours: 12 }
    }
}

impl SessionOptions {
    /// Of what was asked, on so many workers; `all_take_peers` as for [`Route::choose`].
    pub fn of(asked: &JobOptions, workers: usize, all_take_peers: bool) -> Self {
        let route = Route::choose(asked.route, workers, all_take_peers);
        Self { asked: JobOptions { route: Some(route), ..asked.clone() }, ..Self::default() }
    }

    /// How partial forces travel.
    pub fn route(&self) -> Route {
        self.asked.route.unwrap_or_default()
    }

    /// Whether votes of so many workers travel by a tree: not through the master, and not where it looks at the vote or the times of each.
    pub fn has_tree(&self, workers: usize) -> bool {
        let looks = self.asked.verify > 0.0 || self.asked.balance == Balance::Measured;
        self.route() == Route::Direct && !looks && workers >= self.tree.from
    }

    /// What work costs; how a part is cut changes the number of messages on route direct only.
    pub fn costs(&self) -> Costs {
        let message = if self.route() == Route::Direct { self.costs.message } else { 0.0 };
        Costs { message, ..self.costs }
    }
}

/// How often the state is kept in memory, always at a plan boundary.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CheckpointEvery {
    /// Only where an epoch begins.
    #[default]
    Never,
    /// After so many seconds, which a timer of the session asks for.
    Seconds(f64),
    /// After so many cycles.
    Cycles(u64),
    /// After so many seconds or cycles, whichever comes first.
    Either(f64, u64),
}

impl CheckpointEvery {
    /// Often enough for memory, which asks for so many seconds, and for the disk.
    pub fn for_both(memory: Option<f64>, disk: Interval) -> Self {
        let seconds = match (memory, disk.seconds) {
            (Some(memory), Some(disk)) => Some(memory.min(disk)),
            (memory, disk) => memory.or(disk),
        };
        match (seconds, disk.cycles) {
            (Some(seconds), Some(cycles)) => Self::Either(seconds, cycles),
            (Some(seconds), None) => Self::Seconds(seconds),
            (None, Some(cycles)) => Self::Cycles(cycles),
            (None, None) => Self::Never,
        }
    }

    pub const fn seconds(self) -> Option<f64> {
        match self {
            Self::Seconds(seconds) | Self::Either(seconds, _) => Some(seconds),
            Self::Never | Self::Cycles(_) => None,
        }
    }

    pub const fn cycles(self) -> Option<u64> {
        match self {
            Self::Cycles(cycles) | Self::Either(_, cycles) => Some(cycles),
            Self::Never | Self::Seconds(_) => None,
        }
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

/// Brings the end of a run forward to where the options want it.
///
/// # Errors
/// If the time is none.
pub fn bring_end_forward(model: &mut Model, asked: &JobOptions) -> Result<(), Error> {
    let control = &mut model.setup.control;
    if let Some(cycles) = asked.cycles {
        control.end_cycle = control.end_cycle.min(cycles);
    }
    if let Some(time) = asked.end_time {
        if !(time.is_finite() && time > 0.0) {
            return Err(Error::EndTime(time));
        }
        control.end_time = control.end_time.min(time);
    }
    Ok(())
}

/// The relative speeds of `n` workers; those that are not given are 1.
///
/// # Errors
/// If a speed is not one that a worker may have, or there are more speeds than workers.
pub fn speeds_for(n: usize, given: &[f64]) -> Result<Vec<f64>, Error> {
    if given.len() > n {
        return Err(Error::Speeds { speeds: given.len(), workers: n });
    }
    if let Some(bad) = given.iter().find(|speed| !SPEEDS.contains(*speed)) {
        return Err(Error::Speed(*bad));
    }
    Ok((0..n).map(|i| given.get(i).copied().unwrap_or(1.0)).collect())
}

/// What is wrong with the options of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error {
    /// `--end-time` is no time.
    EndTime(f64),
    /// `--speeds` names more workers than there are.
    Speeds {
        /// Speeds that were given.
        speeds: usize,
        /// Workers asked for.
        workers: usize,
    },
    /// One of `--speeds` is no speed.
    Speed(f64),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::EndTime(time) => {
                write!(f, "--end-time {time}: a positive time in the deck's unit is needed")
            }
            Self::Speeds { speeds, workers } => {
                write!(f, "--speeds names {speeds} workers, --workers {workers}")
            }
            Self::Speed(bad) => {
                let (least, most) = (SPEEDS.start(), SPEEDS.end());
                write!(
                    f,
                    "--speeds {bad:?}: a speed, relative to the other workers, is from {least:e} to {most:e}"
                )
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_is_kept_as_often_as_memory_or_the_disk_asks() {
        let disk = |seconds, cycles| Interval { seconds, cycles };
        assert_eq!(CheckpointEvery::for_both(None, disk(None, None)), CheckpointEvery::Never);
        assert_eq!(
            CheckpointEvery::for_both(Some(10.0), disk(Some(60.0), None)),
            CheckpointEvery::Seconds(10.0)
        );
        assert_eq!(
            CheckpointEvery::for_both(Some(10.0), disk(Some(2.0), Some(5))),
            CheckpointEvery::Either(2.0, 5)
        );
        assert_eq!(CheckpointEvery::for_both(None, disk(None, Some(5))), CheckpointEvery::Cycles(5));
    }

    #[test]
    fn speeds_that_are_not_given_are_one_and_faults_name_the_flag_and_the_number() {
        assert_eq!(speeds_for(3, &[2.0, 0.5]), Ok(vec![2.0, 0.5, 1.0]));
        assert_eq!(speeds_for(1, &[1.0, 1.0]), Err(Error::Speeds { speeds: 2, workers: 1 }));
        assert_eq!(
            speeds_for(1, &[-2.0]).map_err(String::from).expect_err("negative")[..13],
            *"--speeds -2.0"
        );
        for bad in [f64::NAN, 0.0, 1e-300, 9e-7, 1.1e6, 1e300] {
            let why = speeds_for(1, &[bad]).map_err(String::from).expect_err("no speed");
            let expected =
                format!("--speeds {bad:?}: a speed, relative to the other workers, is from 1e-6 to 1e6");
            assert_eq!(why, expected);
        }
    }
}
