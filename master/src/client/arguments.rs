//! Flags of the commands that are clients of a master.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use protocol::options::JobOptions;

use crate::{command::ReadingArgs, notify::NotifyArgs};

/// Where a client looks for its master.
pub const MASTER: &str = "127.0.0.1:7117";

/// How a client reaches a master, and how it prints.
#[derive(Args, Clone, Debug)]
pub struct ClientArgs {
    #[arg(long, default_value = MASTER, help = "The master: HOST, HOST:PORT or [ADDRESS]:PORT")]
    pub master: String,
    /// Folder with this host's certificates, as `bolide certs host` makes it
    #[arg(long, value_name = "FOLDER")]
    pub certs: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Most workers of a job.
const MOST_WORKERS: u32 = 10_000;

/// Fewest and most workers of a job, 0 for any number.
fn workers(text: &str) -> Result<[u32; 2], String> {
    let number = |text: &str, missing: u32| match text {
        "" => Ok(missing),
        text => text
            .parse()
            .ok()
            .filter(|n| (1..=MOST_WORKERS).contains(n))
            .ok_or_else(|| format!("{text:?}: expected a number from 1 to {MOST_WORKERS}")),
    };
    let [least, most] = match text.split_once("..") {
        Some((least, most)) => [number(least, 1)?, number(most, 0)?],
        None => [number(text, 1)?; 2],
    };
    if most != 0 && most < least {
        return Err(format!("at most {most} workers and at least {least}: expected the fewest first"));
    }
    Ok([least, most])
}

/// Flags of `submit`.
#[derive(Args, Clone, Debug)]
#[command(group(ArgGroup::new("told").args(["notify", "webhook", "mail"]).multiple(true).requires("wait")))]
pub struct SubmitArgs {
    /// The deck (TOML, or LS-DYNA keywords); files that it refers to are sent along
    pub deck: PathBuf,
    /// What the deck leaves open
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Wait for at least MIN workers and take at most MAX: MIN..MAX, MIN.. or ..MAX; a number alone is both
    #[arg(long, value_name = "MIN..MAX", default_value = "1..", value_parser = workers, conflicts_with = "min_workers")]
    pub workers: [u32; 2],
    /// Wait for at least this many workers: the same as --workers N..
    #[arg(long, hide = true, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub min_workers: Option<u32>,
    /// Wait for workers whose speeds are together at least this
    #[arg(
        long,
        value_name = "SPEED",
        default_value_t = 0.0,
        hide_default_value = true,
        allow_negative_numbers = true
    )]
    pub min_speed: f64,
    /// Wait for workers that have together at least this much memory for a job (GB)
    #[arg(
        long,
        value_name = "GB",
        default_value_t = 0.0,
        hide_default_value = true,
        allow_negative_numbers = true
    )]
    pub min_memory: f64,
    /// Jobs of a higher priority start first; among equals, the oldest
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    pub priority: i32,
    /// Follow the job until it ends, then print its summary
    #[arg(long)]
    pub wait: bool,
    /// Write trace.json into the results: what every worker did in its last cycles, for Perfetto
    #[arg(long, conflicts_with = "no_output")]
    pub trace: bool,
    /// The job
    #[command(flatten)]
    pub job: JobOptions,
    /// The master
    #[command(flatten)]
    pub at: ClientArgs,
    // The last: its heading is that of all that follows.
    /// Whom to tell when it is over; with --wait
    #[command(flatten, next_help_heading = "Whom to tell when it is over, with --wait")]
    pub notify: NotifyArgs,
}
