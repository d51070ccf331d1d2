//! The `bolide` binary: exit codes, logging, and which room a command goes to.
//!
//! Exit codes: 0 a run to its end, 1 a fault (deck, disk, physics, peer), 2 wrong flags, 130 stopped by Ctrl-C.

use std::{io::IsTerminal, path::Path, process::ExitCode, time::Duration};

use clap::Parser;

use master::{
    bench, certs, client,
    command::{Bench, Certs, Cli, Command, WorkerArgs},
    daemon, processes, run, simulate,
};
use protocol::shape::{Shape, Wire};
use worker::daemon::Listen;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_env("BOLIDE_LOG").unwrap_or_else(|_| "info".into()),
        )
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .init();
    let result = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Master(args) => daemon::run(&args),
        Command::Worker(args) => work(args),
        Command::Submit(args) => client::submit(&args),
        Command::Watch { job, at } => client::watch(job, &at),
        Command::Jobs { at } => client::jobs(&at),
        Command::Hosts { at } => client::hosts(&at),
        Command::Cancel { job, at } => client::cancel(job, &at),
        Command::Results { job, out, force, at } => client::results(job, out, force, &at),
        Command::Bench { what: Bench::Messages(args) } => bench::messages::run(&args),
        Command::Certs { what } => make_certificates(what),
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

fn work(args: WorkerArgs) -> Result<ExitCode, String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as u32;
    let options = worker::daemon::Options {
        master: args.master,
        name: args.name.unwrap_or_else(|| format!("{}-{}", daemon::host_name(), std::process::id())),
        speed: args.speed,
        threads: args.threads.unwrap_or(cores),
        certs: args.certs,
        patience: Duration::from_secs(args.patience),
        once: args.once,
        token: std::env::var(processes::TOKEN).ok(),
        port: args.link.map(|rate| Shape::port(Wire::ethernet(rate))),
        peers: if args.no_peers {
            Listen::Nowhere
        } else {
            Listen::Port { port: args.peer_port, announce: args.peer_announce }
        },
    };
    worker::daemon::run(&options).map(|()| ExitCode::SUCCESS)
}

fn make_certificates(what: Certs) -> Result<ExitCode, String> {
    match what {
        Certs::Ca { folder, force } => {
            let path = certs::make_ca(&folder, force).map_err(|e| e.to_string())?;
            println!("made {}", path.display());
        }
        Certs::Host { folder, name, address, role, force } => {
            certs::make_host(&folder, &name, &address, role.role(), force).map_err(|e| e.to_string())?;
            println!("made {}; copy this folder to {name}", folder.join(&name).display());
        }
    }
    Ok(ExitCode::SUCCESS)
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
