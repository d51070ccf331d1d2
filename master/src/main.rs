//! The `bolide` binary; [`program`] has what it does.

use std::process::ExitCode;

use master::program;
use tracing_subscriber::{layer::SubscriberExt, util::SubscriberInitExt};

fn main() -> ExitCode {
    tracing_subscriber::registry().with(program::log()).init();
    program::main(|machine, task, _| machine.run(task))
}
