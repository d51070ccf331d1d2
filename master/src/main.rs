//! The `bolide` binary: exit codes, logging, and which room a command goes to.
//!
//! Exit codes: 0 a run to its end, 1 a fault (deck, disk, physics, peer), 2 wrong flags, 130 stopped by Ctrl-C.

use std::{path::Path, process::ExitCode};

use clap::Parser;
use master::{
    command::{Cli, Command},
    run,
};

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_env("BOLIDE_LOG").unwrap_or_else(|_| "info".into()),
        )
        .with_writer(std::io::stderr)
        .init();
    let result = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Check { deck } => check(&deck),
        Command::Materials => {
            for name in deck::materials() {
                println!("{name}");
            }
            Ok(ExitCode::SUCCESS)
        }
    };
    result.unwrap_or_else(|reason| {
        eprintln!("bolide: {reason}");
        ExitCode::FAILURE
    })
}

fn check(path: &Path) -> Result<ExitCode, String> {
    let model = run::read_deck(path)?;
    println!(
        "{}: no fault; {} parts, {} elements, {} nodes",
        path.display(),
        model.mesh.parts.len(),
        model.mesh.n_elements(),
        model.mesh.n_nodes()
    );
    Ok(ExitCode::SUCCESS)
}
