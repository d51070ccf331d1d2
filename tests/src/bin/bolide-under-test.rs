//! `bolide` for tests of real processes: the same program, with the faults that `BOLIDE_FAIL` orders ([`tests::failpoint`]).

use std::process::ExitCode;

use master::program;
use tests::failpoint::{Watcher, compute};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::{Layer, filter::Targets, layer::SubscriberExt, util::SubscriberInitExt};

fn main() -> ExitCode {
    let watched = Targets::new()
        .with_target("master::sort", LevelFilter::TRACE)
        .with_target("master::snapshot", LevelFilter::TRACE);
    tracing_subscriber::registry().with(program::log()).with(Watcher.with_filter(watched)).init();
    program::main(compute)
}
