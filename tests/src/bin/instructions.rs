//! Counts the instructions of an element-cycle of some examples under valgrind: `cargo run --release -p tests --bin instructions`.
//!
//! Prints each beside tests/instructions.toml and fails if one is more than two per cent above it, where the compiler is the one of the
//! table; with another the ratios are printed only. `instructions --write` writes the table, which a change that is worth its
//! instructions does. `instructions WORD` counts the cases whose names contain it. Exit code 3: there is no valgrind, or no AVX2.

use std::process::{Command, ExitCode, Stdio};

use mechanics::lanes::Width;
use rayon::prelude::*;
use tests::instructions::{CASES, Case, Table, path};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["run", name, cycles] => run(name, cycles),
        ["--write"] => compare("", true),
        [] => compare("", false),
        [word] if !word.starts_with('-') => compare(word, false),
        _ => Err("expected nothing, --write, or a word of a case's name".to_owned()),
    };
    result.unwrap_or_else(|fault| {
        eprintln!("instructions: {fault}");
        ExitCode::FAILURE
    })
}

/// What runs under valgrind.
fn run(name: &str, cycles: &str) -> Result<ExitCode, String> {
    let case =
        CASES.iter().find(|case| case.name() == name).ok_or_else(|| format!("{name}: no such case"))?;
    let cycles = cycles.parse().map_err(|e| format!("cycles {cycles:?}: {e}"))?;
    let pool = worker::daemon::compute_pool(1).map_err(|e| format!("a thread to compute on: {e}"))?;
    println!("{}", pool.install(|| case.run(cycles))?);
    Ok(ExitCode::SUCCESS)
}

fn compare(word: &str, write: bool) -> Result<ExitCode, String> {
    let has_valgrind =
        Command::new("valgrind").arg("--version").stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    if !has_valgrind || "avx2".parse::<Width>().and_then(Width::require).is_err() {
        println!("nothing is counted: this machine has no valgrind or no AVX2");
        return Ok(ExitCode::from(3));
    }
    let compiler = Command::new("rustc").arg("--version").output().map_err(|e| format!("rustc: {e}"))?;
    let compiler = String::from_utf8_lossy(&compiler.stdout).trim().to_owned();
    let table = if write { Table::default() } else { Table::read()? };
    if !write && table.compiler != compiler {
        println!("the table is of {}, this is {compiler}: no ratio is too much", table.compiler);
    }
    println!("instructions of an element-cycle");
    let mut counted = Table { compiler, ..Table::default() };
    let mut too_many = false;
    let chosen: Vec<Case> = CASES.into_iter().filter(|case| case.name().contains(word)).collect();
    // One on each core: valgrind uses one, and time is not what it counts.
    let counts: Vec<Result<f64, String>> = chosen.par_iter().with_max_len(1).map(Case::count).collect();
    for (case, count) in chosen.iter().zip(counts) {
        let (name, count) = (case.name(), (10.0 * count?).round() / 10.0);
        let (words, fails) = match write {
            true => (String::new(), false),
            false => table.judge(&name, count, &counted.compiler),
        };
        println!("{name:<32}{count:>10.1}  {words}");
        too_many |= fails;
        counted.counts.insert(name, count);
    }
    if write {
        let text = toml::to_string(&counted).map_err(|e| e.to_string())?;
        let head = "# Written by `cargo run --release -p tests --bin instructions -- --write`.\n";
        std::fs::write(path(), format!("{head}{text}")).map_err(|e| format!("{}: {e}", path().display()))?;
    }
    Ok(if too_many { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
