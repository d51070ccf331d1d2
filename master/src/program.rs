//! PROGRAM: what a binary does with its command line: exit codes, logging, and which module a command goes to.
//!
//! Exit codes: 0 a run to its end, 1 a fault (deck, disk, physics, peer), 2 wrong flags, 130 stopped by Ctrl-C.

use std::{io::IsTerminal, path::Path, process::ExitCode, time::Duration};

use clap::CommandFactory;
use protocol::{
    handshake,
    request::Request,
    shape::{Shape, Wire},
    tls,
};
use tracing::{Subscriber, level_filters::LevelFilter};
use tracing_subscriber::{Layer, filter::Targets, registry::LookupSpan};
use worker::{daemon::Listen, owner::Rules, runner::Compute};

use crate::{
    add, as_service, bench,
    bench::grind::Speed,
    ca_folder::CaFolder,
    certs::{self, arguments::Certs},
    check, client,
    command::{Bench, Cli, Command, WorkerArgs},
    convert, daemon, export, init, machine, materials, newcomer, picture, processes, report, run,
    shell::{may_colour, print, quoted, tell},
    simulate, study, verify,
};

/// The log: to standard error, of the levels that `BOLIDE_LOG` says (`debug`, or by module `info,worker=debug`), else from
/// `info` on; what it says wrong is told there.
pub fn log<S: Subscriber + for<'a> LookupSpan<'a>>() -> impl Layer<S> {
    let text = std::env::var("BOLIDE_LOG").ok().filter(|text| !text.trim().is_empty());
    let asked = text.and_then(|text| {
        levels(&text)
            .map_err(|why| tell(&format!("bolide: BOLIDE_LOG={text}: {why}; logging from info on")))
            .ok()
    });
    tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal() && may_colour())
        .with_target(false)
        // That a line cannot be written cannot be told there either.
        .log_internal_errors(false)
        .with_filter(asked.unwrap_or_else(|| Targets::new().with_default(LevelFilter::INFO)))
}

/// What `BOLIDE_LOG` says. A word alone that is no level would be taken for a module, of which there is none, and nothing be logged.
fn levels(text: &str) -> Result<Targets, String> {
    for item in text.split(',').map(str::trim).filter(|item| !item.is_empty()) {
        let level = item.rsplit_once('=').map_or(item, |(_, level)| level);
        if level.parse::<LevelFilter>().is_err() {
            return Err(format!(
                "expected off, error, warn, info, debug or trace, or MODULE=LEVEL, separated by commas; found {item:?}"
            ));
        }
    }
    text.parse().map_err(|e| format!("{e}"))
}

/// Does what the command line says. `compute` is what computes the tasks of a worker.
pub fn main(compute: Compute) -> ExitCode {
    system::allocator::return_large_arrays();
    let result = match Cli::of_process().command {
        Command::Run(args) => run::run_and_tell(&args),
        Command::Study(args) => study::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Master(args) => daemon::run(&args),
        Command::Worker(args) => work(args, compute),
        Command::Add(args) => add::run(&args),
        Command::Submit(args) => client::submit(&args),
        Command::Watch { job, until, at } => client::watch(job, until, &at),
        Command::Jobs { at } => client::jobs(&at),
        Command::Hosts { at } => client::hosts(&at),
        Command::Cancel { job, at } => client::act(&Request::Cancel { job }, &at),
        Command::Hold { job, at } => client::act(&Request::Hold { job }, &at),
        Command::Resume { job, at } => client::act(&Request::Resume { job }, &at),
        Command::Rm { job, at } => client::act(&Request::Remove { job }, &at),
        Command::Results { job, out, force, at } => client::results(job, out, force, &at),
        Command::Bench { what: Some(Bench::Messages(args)), .. } => bench::messages::run(&args),
        Command::Bench { what: None, grind } => bench::grind::run(&grind),
        Command::Service { what } => {
            as_service::run(what, join_first, move |command| serve(command, compute))
        }
        Command::Certs { what } => make_certificates(what),
        Command::Top { at } => client::top::run(&at),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "bolide", &mut script);
            print(&String::from_utf8_lossy(&script)).map(|()| ExitCode::SUCCESS)
        }
        Command::Man { out } => manual(out.as_deref()),
        Command::Check { deck, json, reading } => check::run(&deck, json, &reading.options()),
        Command::Init { name, file } => init::run(name.as_deref(), file.as_deref()),
        Command::Schema => serde_json::to_string_pretty(&deck::schema::json())
            .map_err(|e| e.to_string())
            .and_then(|schema| print(&schema))
            .map(|()| ExitCode::SUCCESS),
        Command::Convert { deck, to, force, reading } => {
            convert::run(&deck, to.as_deref(), force, &reading.options())
        }
        Command::Verify(args) => verify::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Picture(args) => picture::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Materials(args) => materials::run(&args),
    };
    result.unwrap_or_else(|reason| {
        tell(&format!("bolide: {reason}"));
        ExitCode::FAILURE
    })
}

/// What a service does.
fn serve(command: Command, compute: Compute) -> Result<ExitCode, String> {
    match command {
        Command::Master(args) => daemon::run(&args),
        Command::Worker(args) => {
            // Whoever sits at the machine comes first.
            system::processors::low_priority_of_process();
            work(args, compute)
        }
        _ => Err("no daemon".to_owned()),
    }
}

/// Exchanges the token of a worker, if it has one and no certificate yet.
fn join_first(command: &Command) -> Result<(), String> {
    match command {
        Command::Worker(args) => join(args),
        _ => Ok(()),
    }
}

fn join(args: &WorkerArgs) -> Result<(), String> {
    let token = args.join.clone().or_else(|| std::env::var(newcomer::TOKEN).ok());
    if let (Some(token), Some(folder)) = (&token, &args.certs) {
        let name = args.name.clone().unwrap_or_else(machine::host_name);
        let (token, host) = (newcomer::token(token)?, handshake::host_of(&name));
        let certificate = tls::Paths::in_folder(folder).certificate;
        if !certificate.exists() {
            newcomer::join(&args.master, &token, host, folder)?;
        } else if newcomer::has_expired(&certificate) {
            tracing::info!("{} has expired; asking for another", certificate.display());
            newcomer::join_anew(&args.master, &token, host, folder)?;
        }
    }
    Ok(())
}

fn work(args: WorkerArgs, compute: Compute) -> Result<ExitCode, String> {
    join(&args)?;
    if let Some(pin) = &args.pin {
        pin.apply()?;
    }
    if args.yield_to_owner.is_some() {
        system::processors::low_priority_of_process();
    }
    let cores = worker::processors::cores() as u32;
    let speed = match args.speed {
        Speed::Given(speed) => speed,
        Speed::Auto => {
            let speed = bench::grind::speed(args.threads.unwrap_or(cores))?;
            tracing::info!(speed, "measured: 1 is a thread that takes 100 ns for an element-cycle");
            speed
        }
    };
    machine::warn_of_threads(args.threads.unwrap_or(cores) as usize);
    let options = worker::daemon::Options {
        master: args.master,
        name: match args.name {
            Some(name) => name,
            None => name_of(args.certs.as_deref())?,
        },
        region: args.region.unwrap_or_default(),
        speed,
        threads: args.threads.unwrap_or(cores),
        memory: args.memory.map(|gigabytes| (gigabytes * 1e9) as u64),
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
        share_memory: !args.no_shared_memory,
        compute,
        rules: Rules {
            share: args.yield_to_owner,
            load: args.owner_load,
            quiet: Duration::from_secs_f64(args.owner_quiet),
            hours: args.hours,
        },
    };
    worker::daemon::run(&options).map(|()| ExitCode::SUCCESS)
}

/// The name of a worker that was given none: its host's, as its certificate says where it has one, and the process.
fn name_of(certs: Option<&Path>) -> Result<String, String> {
    let process = std::process::id();
    let Some(folder) = certs else { return Ok(format!("{}-{process}", machine::host_name())) };
    let path = tls::Paths::in_folder(folder).certificate;
    let identity = tls::identity_of_file(&path).map_err(|e| e.to_string())?;
    Ok(format!("{}@{process}", identity.name))
}

fn make_certificates(what: Certs) -> Result<ExitCode, String> {
    match what {
        Certs::Ca { folder, force } => {
            let path = certs::make_ca(&folder, force).map_err(|e| e.to_string())?;
            print(&format!("made {}", path.display()))?;
        }
        Certs::Host { folder, name, address, role, force } => {
            certs::make_host(&folder, &name, &address, role.role(), force).map_err(|e| e.to_string())?;
            print(&format!("made {}; copy this folder to {name}", folder.join(&name).display()))?;
        }
        Certs::Token { folder, role, hours, master } => {
            let token = CaFolder::open(&folder).and_then(|ca| ca.issue(role.role(), hours));
            print(&daemon::line_to_paste(&master, &token.map_err(|e| e.to_string())?, role.role()))?;
        }
        Certs::Join { master, token, folder, name } => {
            newcomer::join(
                &master,
                &newcomer::token(&token)?,
                &name.unwrap_or_else(machine::host_name),
                &folder,
            )?;
            print(&format!("made {}", tls::Paths::in_folder(&folder).certificate.display()))?;
        }
        Certs::Revoke { folder, name } => {
            let ca_folder = CaFolder::open(&folder).map_err(|e| e.to_string())?;
            let revoked = ca_folder.revoke(&name).map_err(|e| e.to_string())?;
            if ca_folder.has_master(&name).map_err(|e| e.to_string())? {
                let lab = quoted(&folder.display().to_string());
                print(&format!(
                    "revoked {revoked} of {name}, but only a master looks at the list, for who calls it: workers and clients go on taking {name} for \
                     their master. If its key is in other hands, make a new CA with `bolide certs ca {lab} --force` and new certificates for all hosts"
                ))?;
            } else {
                print(&format!(
                    "revoked {revoked} of {name}; a running master with --lab ends its links within seconds"
                ))?;
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn manual(folder: Option<&Path>) -> Result<ExitCode, String> {
    let command = Cli::command();
    match folder {
        None => {
            let mut page = Vec::new();
            clap_mangen::Man::new(command).render(&mut page).map_err(|e| format!("the page: {e}"))?;
            print(&String::from_utf8_lossy(&page))?;
        }
        Some(folder) => {
            let fault = |e: std::io::Error| format!("{}: {e}", folder.display());
            std::fs::create_dir_all(folder).map_err(fault)?;
            clap_mangen::generate_to(command, folder).map_err(fault)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_of_the_log_are_taken_and_other_words_are_named() {
        for good in ["debug", "info,worker=debug", "WARN", "off", "info, worker=trace"] {
            assert!(levels(good).is_ok(), "{good}");
        }
        for bad in ["nonsense", "info,worker", "worker=loud"] {
            let why = levels(bad).expect_err(bad);
            let item = bad.rsplit(',').next().unwrap_or_default();
            assert!(why.starts_with("expected off, error, warn") && why.contains(item), "{why}");
        }
    }
}
