//! Flags of `verify`.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "what stands in brackets is part of the help that users read"
)]

use std::path::PathBuf;

use clap::Args;

use crate::command::ReadingArgs;

/// Flags of `verify`.
#[derive(Args, Clone, Debug)]
pub struct VerifyArgs {
    /// The results folder of a run that has ended or was stopped
    pub results: PathBuf,
    /// The deck that it was computed from [default: the one that the folder holds]
    #[arg(long)]
    pub deck: Option<PathBuf>,
    /// What a keyword deck does not say
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Only compare the files with their checksums; nothing is computed
    #[arg(long, conflicts_with_all = ["deck", "from", "to", "interval", "end_time"])]
    pub files: bool,
    /// First cycle to compare; computing begins at the last snapshot before it
    #[arg(long, value_name = "CYCLE")]
    pub from: Option<u64>,
    /// Cycle to end at [default: where the run ended]
    #[arg(long, value_name = "CYCLE")]
    pub to: Option<u64>,
    /// Only this interval between kept snapshots, counted from 1: start to first snapshot, and so on
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["from", "to"])]
    pub interval: Option<usize>,
    /// --end-time that the run was given [default: what its summary says]
    #[arg(long)]
    pub end_time: Option<f64>,
    /// Number of workers
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub workers: u32,
    /// Compute threads per worker [default: the cores that it may use]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}
