//! What a user may ask of one run beside its deck: one structure, from the command line or the page to the session of the job.
//!
//! `bolide run` and `bolide submit` take its fields as flags, so the comments of fields that are flags are the help that users
//! read. To add an option, add a field here and read it where it acts.

#![allow(rustdoc::invalid_html_tags, reason = "what stands in brackets is part of the help that users read")]

use clap::{
    Args, ValueEnum,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use mechanics::lanes::Width;
use serde::{Deserialize, Serialize};

/// Who sorts the contact surface, where votes travel from worker to worker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
pub enum SortBy {
    /// The master if it is done within the lag of a sort, else the workers
    #[default]
    Auto,
    /// The master, from positions of all
    Master,
    /// Each worker sorts what it holds
    Workers,
}

/// How partial forces travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Route {
    /// To the master, which adds them and sends totals back: the paper's card, and the reference.
    #[default]
    Master,
    /// From each worker to those that share nodes with it; votes and orders pass the master, and so does what is exchanged by
    /// pairs that cannot reach each other.
    Direct,
}

impl Route {
    /// Its name on the command line and in summaries.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Master => "master",
            Self::Direct => "direct",
        }
    }

    /// The route of a job on so many workers: the one asked for, else direct with two workers or more when every one of them
    /// takes peers (`all_take_peers`), and master otherwise. One worker has nobody to exchange with, and what is relayed
    /// passes the master's link twice as often as sums do.
    pub const fn choose(asked: Option<Self>, workers: usize, all_take_peers: bool) -> Self {
        match asked {
            Some(route) => route,
            None if workers > 1 && all_take_peers => Self::Direct,
            None => Self::Master,
        }
    }
}

/// What speeds work is dealt out by. No bit of a result depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
pub enum Balance {
    /// Those with which workers were started
    #[default]
    Given,
    /// Those, corrected by measured times
    Measured,
}

/// Routes as users write them; none for `auto`.
pub fn routes() -> impl TypedValueParser<Value = Option<Route>> {
    let values = [
        PossibleValue::new("auto").help("Direct with two workers or more that all take peers, else master"),
        PossibleValue::new("master").help("All through the master, which adds them"),
        PossibleValue::new("direct").help("From worker to worker; votes and orders pass the master"),
    ];
    PossibleValuesParser::new(values).map(|name| match name.as_str() {
        "master" => Some(Route::Master),
        "direct" => Some(Route::Direct),
        _ => None,
    })
}

/// Names of lane widths.
pub fn lanes() -> PossibleValuesParser {
    PossibleValuesParser::new([
        PossibleValue::new("scalar").help("One element at a time"),
        PossibleValue::new("neon").help("Four, on 64-bit ARM"),
        PossibleValue::new("avx2").help("Four"),
        PossibleValue::new("avx512").help("Eight"),
    ])
}

/// A number of seconds that a timer can wait for.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=1e9).contains(&seconds) => Ok(seconds),
        _ => Err("expected seconds from 0 to 1e9".to_owned()),
    }
}

/// A part of a whole.
fn fraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(fraction) if (0.0..=1.0).contains(&fraction) => Ok(fraction),
        _ => Err("expected a number from 0 to 1".to_owned()),
    }
}

/// [`seconds`] between two states; none for 0.
fn period(text: &str) -> Result<Option<f64>, String> {
    seconds(text).map(|seconds| Some(seconds).filter(|seconds| *seconds > 0.0))
}

/// A number that no run can be asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// A number outside of what it may be.
    Number {
        /// The flag.
        name: &'static str,
        value: f64,
        expected: &'static str,
    },
    /// No such lane width.
    Lanes(String),
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number { name, value, expected } => write!(f, "{name} {value}: must be {expected}"),
            Self::Lanes(name) => {
                let shown: String = name.chars().take(32).collect();
                write!(f, "lanes {shown:?}: must be scalar, neon, avx2 or avx512")
            }
        }
    }
}

impl std::error::Error for Error {}

/// Under which heading of the help flags stand that few runs need.
pub const ADVANCED: &str = "Advanced options";

/// What a user asks of a run beside its deck.
#[expect(
    unused_qualifications,
    reason = "by the whole path clap takes an option for the type of the value, as 0 and `auto` need"
)]
#[derive(Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JobOptions {
    /// Stop after this many cycles, or at the deck's end, whichever comes first
    #[arg(long)]
    pub cycles: Option<u64>,
    /// Stop at this time in the deck's unit, or at the deck's end, whichever comes first
    #[arg(long)]
    pub end_time: Option<f64>,
    /// Lane width; the widest of each machine by default
    #[arg(long, help_heading = ADVANCED, value_parser = lanes())]
    pub lanes: Option<String>,
    /// Route of the shared-node forces
    #[arg(long, help_heading = ADVANCED, value_parser = routes(), default_value = "auto")]
    pub route: std::option::Option<Route>,
    /// Write no results folder
    #[arg(long)]
    pub no_output: bool,
    /// Write a checkpoint at the start of this cycle, as snapshot.bolide in the results folder
    #[arg(long, help_heading = ADVANCED, value_name = "CYCLE")]
    pub snapshot_at: Option<u64>,
    /// Extra sorts every this many cycles, to test that they change nothing
    #[arg(long, hide = true)]
    pub sort_every: Option<u64>,
    /// Extra sorts at pseudo-random cycles of this seed, to test that they change nothing
    #[arg(long, hide = true)]
    pub sort_seed: Option<u64>,
    /// Wait for at least this many workers.
    #[arg(skip)]
    pub min_workers: u32,
    /// Take at most this many; 0 for any number.
    #[arg(skip)]
    #[serde(default)]
    pub max_workers: u32,
    /// Wait for workers whose speeds are together at least this; 0 for any.
    #[arg(skip)]
    #[serde(default)]
    pub min_speed: f64,
    /// Wait for workers that may together take at least this (GB); 0 for any.
    #[arg(skip)]
    #[serde(default)]
    pub min_memory: f64,
    /// Speeds by which work is distributed
    #[arg(long, help_heading = ADVANCED, value_enum, default_value = "given")]
    pub balance: Balance,
    /// Who sorts the contact surface, on route direct from five workers on
    #[arg(long, help_heading = ADVANCED, value_enum, default_value = "auto")]
    #[serde(default)]
    pub sort_by: SortBy,
    /// Keep a checkpoint in memory every this many seconds, to return to when a worker is lost; 0 for none beside those on disk
    #[arg(long, help_heading = ADVANCED, value_name = "SECONDS", default_value = "10", value_parser = period, allow_negative_numbers = true)]
    pub keep_every: std::option::Option<f64>,
    /// Compute this part of the work twice, by other workers the second time, from 0 to 1; where both differ a third time decides
    #[arg(long, help_heading = ADVANCED, value_name = "FRACTION", default_value = "0", value_parser = fraction, allow_negative_numbers = true)]
    #[serde(default)]
    pub verify: f64,
    /// Write a checkpoint to disk every this many seconds, for --resume; 0 for never [default: the deck's; else a
    /// master's jobs every 10, `run` every 60]
    #[arg(long, help_heading = ADVANCED, value_name = "SECONDS", value_parser = seconds)]
    pub snapshot_every: Option<f64>,
    /// The same every this many cycles
    #[arg(long, help_heading = ADVANCED, value_name = "CYCLES", value_parser = clap::value_parser!(u64).range(1..))]
    pub snapshot_cycles: Option<u64>,
    /// Jobs of a higher one go first.
    #[arg(skip)]
    pub priority: i32,
    /// Write `trace.json`: what every worker did in its last cycles.
    #[arg(skip)]
    pub trace: bool,
}

impl JobOptions {
    /// Checks every number, which may have come from anybody over a link.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn check(&self) -> Result<(), Error> {
        let number = |name, value: Option<f64>, good: fn(f64) -> bool, expected| match value {
            Some(value) if !good(value) => Err(Error::Number { name, value, expected }),
            _ => Ok(()),
        };
        let seconds = "a number of seconds above 0, at most 1e9";
        number("end time", self.end_time, |t| t.is_finite() && t > 0.0, "a positive number")?;
        number("keep-every", self.keep_every, |s| s > 0.0 && s <= 1e9, seconds)?;
        number("verify", Some(self.verify), |f| (0.0..=1.0).contains(&f), "from 0 to 1")?;
        number("snapshot-every", self.snapshot_every, |s| (0.0..=1e9).contains(&s), "seconds from 0 to 1e9")?;
        let whole = |n: Option<u64>| n.map(|n| n as f64);
        number("snapshot-cycles", whole(self.snapshot_cycles), |n| n >= 1.0, "1 or more")?;
        number("min-workers", Some(f64::from(self.min_workers)), |n| n <= 10_000.0, "at most 10000")?;
        let most = Some(f64::from(self.max_workers)).filter(|_| self.max_workers < self.min_workers);
        number("max-workers", most, |n| n == 0.0, "0 for any number, or at least min-workers")?;
        number("min-speed", Some(self.min_speed), |speed| (0.0..=1e9).contains(&speed), "from 0 to 1e9")?;
        number("min-memory", Some(self.min_memory), |gb| (0.0..=1e9).contains(&gb), "GB from 0 to 1e9")?;
        match &self.lanes {
            Some(name) if name.parse::<Width>().is_err() => Err(Error::Lanes(name.clone())),
            _ => Ok(()),
        }
    }

    /// Whether an extra sort is asked for at a cycle, for tests of bits: every so many cycles, or at pseudo-random ones, about
    /// one in four.
    pub fn forces_sort(&self, cycle: u64) -> bool {
        match (self.sort_every, self.sort_seed) {
            (Some(n), _) => cycle.is_multiple_of(n.max(1)),
            (None, Some(seed)) => {
                let mut x = cycle.wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                (x ^ (x >> 31)).is_multiple_of(4)
            }
            (None, None) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        job: JobOptions,
    }

    fn flags(words: &[&str]) -> Result<JobOptions, String> {
        let words = std::iter::once(&"flags").chain(words);
        Flags::try_parse_from(words).map(|flags| flags.job).map_err(|fault| fault.to_string())
    }

    #[test]
    fn flags_are_the_options_and_auto_and_zero_are_none() {
        let plain = JobOptions { keep_every: Some(10.0), ..JobOptions::default() };
        assert_eq!(flags(&[]), Ok(plain.clone()));
        assert_eq!(flags(&["--route", "auto"]), Ok(plain.clone()));
        let direct = JobOptions { route: Some(Route::Direct), ..plain.clone() };
        assert_eq!(flags(&["--route", "direct"]), Ok(direct));
        assert_eq!(flags(&["--keep-every", "0"]), Ok(JobOptions::default()));
        let lanes = JobOptions { lanes: Some("avx2".to_owned()), balance: Balance::Measured, ..plain };
        assert_eq!(flags(&["--lanes", "avx2", "--balance", "measured"]), Ok(lanes));
        for bad in [
            ["--verify", "1.5"],
            ["--route", "sideways"],
            ["--lanes", "avx"],
            ["--keep-every", "-1"],
            ["--keep-every", "x"],
        ] {
            let fault = flags(&bad).expect_err(bad[1]);
            assert!(fault.contains(bad[0]) && fault.contains(bad[1]), "{fault}");
        }
    }

    #[test]
    fn numbers_that_came_over_a_link_are_checked_one_and_all() {
        let good = JobOptions { keep_every: Some(10.0), snapshot_every: Some(0.0), ..JobOptions::default() };
        assert_eq!(good.check(), Ok(()));
        for (bad, words) in [
            (
                JobOptions { keep_every: Some(-1.0), ..good.clone() },
                "keep-every -1: must be a number of seconds",
            ),
            (JobOptions { keep_every: Some(1e300), ..good.clone() }, "keep-every 1"),
            (JobOptions { snapshot_every: Some(f64::NAN), ..good.clone() }, "snapshot-every NaN"),
            (JobOptions { snapshot_every: Some(f64::INFINITY), ..good.clone() }, "snapshot-every inf"),
            (JobOptions { verify: 1.5, ..good.clone() }, "verify 1.5: must be from 0 to 1"),
            (JobOptions { verify: f64::NAN, ..good.clone() }, "verify NaN"),
            (JobOptions { end_time: Some(0.0), ..good.clone() }, "end time 0: must be a positive number"),
            (JobOptions { snapshot_cycles: Some(0), ..good.clone() }, "snapshot-cycles 0"),
            (JobOptions { min_workers: u32::MAX, ..good.clone() }, "min-workers 4294967295"),
            (
                JobOptions { min_workers: 3, max_workers: 2, ..good.clone() },
                "max-workers 2: must be 0 for any number, or at least min-workers",
            ),
            (JobOptions { min_speed: f64::NAN, ..good.clone() }, "min-speed NaN: must be from 0 to 1e9"),
            (JobOptions { min_memory: -1.0, ..good.clone() }, "min-memory -1: must be GB from 0 to 1e9"),
            (JobOptions { lanes: Some("mmx".into()), ..good.clone() }, "lanes \"mmx\""),
        ] {
            let error = bad.check().expect_err(words).to_string();
            assert!(error.starts_with(words), "{error}");
        }
    }

    #[test]
    fn auto_is_direct_where_there_is_somebody_to_exchange_with_who_can_be_reached() {
        use Route::{Direct, Master};
        for (asked, workers, all_take_peers, route) in [
            (None, 2, true, Direct),
            (None, 1, true, Master),
            (None, 9, false, Master),
            (Some(Direct), 1, false, Direct),
            (Some(Master), 9, true, Master),
        ] {
            assert_eq!(Route::choose(asked, workers, all_take_peers), route, "{asked:?} of {workers}");
        }
    }
}
