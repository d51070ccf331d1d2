//! Every subcommand and flag, with help and default.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Explicit Lagrangian impact simulation on whatever PCs a lab has.
#[derive(Debug, Parser)]
#[command(name = "bolide", version, about, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a deck here: master and workers in one process
    Run(RunArgs),
    /// Report every fault of a deck without running it
    Check {
        /// The deck
        deck: PathBuf,
    },
    /// List the material library
    Materials,
}

/// How partial forces travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Route {
    /// All through the master, which adds them
    Master,
    /// From worker to worker; votes and orders pass the master
    Direct,
}

impl From<Route> for protocol::message::Route {
    fn from(route: Route) -> Self {
        match route {
            Route::Master => Self::Master,
            Route::Direct => Self::Direct,
        }
    }
}

/// Lane width of the kernels; the bits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Lanes {
    /// One element at a time
    Scalar,
    /// Four
    Avx2,
    /// Eight
    Avx512,
}

impl Lanes {
    /// The name that a worker understands.
    pub fn name(self) -> String {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
        .to_owned()
    }
}

/// What a user may ask of one run, wherever it runs.
#[derive(Args, Clone, Debug)]
pub struct JobArgs {
    /// Route of the shared-node forces
    #[arg(long, value_enum, default_value = "master")]
    pub route: Route,
    /// Stop after this many cycles, or at the deck's end, whichever comes first
    #[arg(long)]
    pub cycles: Option<u64>,
    /// Stop at this time in the deck's unit, or at the deck's end, whichever comes first
    #[arg(long)]
    pub end_time: Option<f64>,
    /// Lane width; the widest of each machine by default
    #[arg(long, value_enum)]
    pub lanes: Option<Lanes>,
    /// Results folder [default: results/<deck name>]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Replace the results in an existing folder
    #[arg(long)]
    pub force: bool,
    /// Print the summary alone, as JSON, on standard output
    #[arg(long)]
    pub json: bool,
    /// Write no results folder
    #[arg(long)]
    pub no_output: bool,
    /// Store the run at the start of this cycle, as snapshot.bolide in the results folder
    #[arg(long, value_name = "CYCLE")]
    pub snapshot_at: Option<u64>,
    /// Extra sorts every so many cycles, to test that they change nothing
    #[arg(long, hide = true)]
    pub sort_every: Option<u64>,
    /// Extra sorts at pseudo-random cycles of this seed, to test that they change nothing
    #[arg(long, hide = true)]
    pub sort_seed: Option<u64>,
}

/// Flags of `run`.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// The deck (TOML)
    pub deck: PathBuf,
    /// Number of workers
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub workers: u32,
    /// Relative speeds of the workers, separated by commas; missing ones are 1
    #[arg(long, value_delimiter = ',')]
    pub speeds: Vec<f64>,
    /// Compute threads per worker [default: all cores]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Go on from this snapshot
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
    /// The rest
    #[command(flatten)]
    pub job: JobArgs,
}
