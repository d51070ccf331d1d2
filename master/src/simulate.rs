//! `bolide simulate`: what an emulated cluster would take for a deck, on one machine.
//!
//! [`cluster`] reads the cluster file. [`virtual_clock`] drives the real sessions on emulated hosts ([`processor`]) and
//! wires ([`network`]); [`tape`] lets a run be driven again under other costs without computing. [`calibrate`] turns the
//! seconds of a cluster file into costs of work. [`table`] prints the tables of the paper ([`mod@paper`]) beside
//! modelled ones. All figures are modelled, and say so.

use std::{path::Path, process::ExitCode, sync::Arc};

use deck::model::Model;

pub mod calibrate;
pub mod cluster;
pub mod network;
pub mod paper;
pub mod processor;
pub mod table;
pub mod tape;
pub mod virtual_clock;

use crate::{command::SimulateArgs, run::read_deck};

use cluster::Cluster;

/// Does what `bolide simulate` is asked for.
///
/// # Errors
/// Faults of the files, and whatever keeps a run from its end.
pub fn run(args: &SimulateArgs) -> Result<ExitCode, String> {
    let cluster = cluster::read_file(&args.cluster)?;
    match &args.deck {
        Some(deck) => one(args, &cluster, deck),
        None => tables(args, &cluster),
    }
}

fn model(path: &Path, cycles: u64) -> Result<Arc<Model>, String> {
    let mut model = read_deck(path)?;
    model.setup.control.end_cycle = model.setup.control.end_cycle.min(cycles);
    Ok(Arc::new(model))
}

fn tables(args: &SimulateArgs, cluster: &Cluster) -> Result<ExitCode, String> {
    let tables = cluster
        .tables
        .as_ref()
        .ok_or_else(|| format!("{}: no [tables]; add decks and hosts", args.cluster.display()))?;
    let models = [model(&tables.decks[0], args.cycles)?, model(&tables.decks[1], args.cycles)?];
    let report = table::run(cluster, tables, &models, &mut |cell| eprintln!("{cell}"))?;
    if args.json {
        for row in &report.rows {
            println!("{}", serde_json::to_string(row).map_err(|e| e.to_string())?);
        }
    } else {
        print!("{}", table::print(cluster, &report));
    }
    Ok(ExitCode::SUCCESS)
}

fn one(_args: &SimulateArgs, _cluster: &Cluster, _deck: &Path) -> Result<ExitCode, String> {
    Err("later".into())
}
