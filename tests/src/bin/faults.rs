//! The table of faults: both benchmarks of 27,000 elements on real processes, harmed in every way of
//! [`tests::faults`]; each must leave the bytes of the run that nothing happened to.
//!
//! `cargo run --release -p tests --bin faults -- [--bolide PATH] [--cycles N] [--deck PATH]... [--only WORDS] [--tries N] [--out FILE]`
//!
//! Without `--bolide`, `bolide-under-test` beside this one; build it first with `cargo build --release -p tests`. `--only` plays
//! the faults with these words in their name, `--tries` each at most so often. The table goes to `--out`, without
//! `--only` to `tests/FAULTS.md`. The program ends with failure if a run has other bytes.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use tests::{
    faults::{self, Scene},
    seeds::flips::{self, Campaign},
};

/// Tries of single bits in memory, in one process.
const FLIPS: u64 = 100;

struct Asked {
    bolide: PathBuf,
    decks: Vec<PathBuf>,
    cycles: u64,
    only: Option<String>,
    tries: u64,
    out: Option<PathBuf>,
}

fn asked() -> Result<Asked, String> {
    let here = std::env::current_exe().map_err(|e| format!("where this program is: {e}"))?;
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut asked = Asked {
        bolide: here.with_file_name("bolide-under-test"),
        decks: Vec::new(),
        cycles: 700,
        only: None,
        tries: u64::MAX,
        out: None,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{flag}: a value is needed"))?;
        let number = || value.parse::<u64>().map_err(|e| format!("{flag} {value}: {e}"));
        match flag.as_str() {
            "--bolide" => asked.bolide = value.into(),
            "--deck" => asked.decks.push(value.into()),
            "--cycles" => asked.cycles = number()?.max(100),
            "--only" => asked.only = Some(value),
            "--tries" => asked.tries = number()?.max(1),
            "--out" => asked.out = Some(value.into()),
            _ => return Err(format!("{flag}: read --bolide, --deck, --cycles, --only, --tries or --out")),
        }
    }
    if asked.decks.is_empty() {
        let examples = tests.join("../deck/examples");
        asked.decks =
            ["plates-joined.toml", "plates-free-slip.toml"].map(|name| examples.join(name)).to_vec();
    }
    if asked.only.is_none() && asked.out.is_none() {
        asked.out = Some(tests.join("FAULTS.md"));
    }
    Ok(asked)
}

fn main() -> ExitCode {
    match play() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(different) => {
            eprintln!("{different} runs have other bytes, or failed");
            ExitCode::FAILURE
        }
        Err(reason) => {
            eprintln!("{reason}");
            ExitCode::FAILURE
        }
    }
}

/// Plays everything, prints and writes the tables, and counts the runs that differ.
fn play() -> Result<usize, String> {
    let asked = asked()?;
    let started = Instant::now();
    // Failures are printed by the table.
    std::panic::set_hook(Box::new(|_| {}));
    let mut different = 0;
    let mut text = String::from(
        "# Faults\n\nWritten by `cargo run --release -p tests --bin faults`: a master and three workers of one thread each, \
         as processes on one machine, snapshots every 0.2 s. Every run must leave the digest, the energies, `history.csv` \
         and the state files of the undisturbed one, to the byte. *Detected* is from the fault to the line of the log \
         that names it (of a killed master: until the next one goes on with the job); *time lost* until the run is as far \
         as it was. With several times: the median, and the worst.\n",
    );
    for deck in &asked.decks {
        let deck = &deck.canonicalize().map_err(|e| format!("{}: {e}", deck.display()))?;
        let scene = Scene::new(&asked.bolide, deck, asked.cycles, 1)?;
        let name = deck.file_stem().unwrap_or_default().display().to_string();
        let mut rows = Vec::new();
        for case in faults::cases() {
            if asked.only.as_ref().is_some_and(|words| !case.name.contains(words.as_str())) {
                continue;
            }
            let row = scene.play(&case, case.tries.min(asked.tries));
            different += row.tries.iter().filter(|t| t.is_err()).count();
            for why in row.tries.iter().filter_map(|t| t.as_ref().err()) {
                eprintln!("{}: {why}", row.name);
            }
            print!("{}", faults::table(std::slice::from_ref(&row)).lines().nth(2).unwrap_or_default());
            println!();
            rows.push(row);
            // What was played is kept, should this program be ended.
            let table = format!("\n## {name}, {} cycles\n\n{}", scene.cycles, faults::table(&rows));
            write(&asked, &format!("{text}{table}"))?;
        }
        text += &format!("\n## {name}, {} cycles\n\n{}", scene.cycles, faults::table(&rows));
    }
    if asked.only.is_none() {
        let tries = Campaign::new().play_all(0..FLIPS);
        different += tries.last().map_or(0, |tries| tries.iter().filter(|each| each.is_wrong()).count());
        text += &flips::section(&tries);
    }
    let minutes = started.elapsed().as_secs_f64() / 60.0;
    text += &format!("\n{different} failed; {minutes:.1} minutes in all.\n");
    write(&asked, &text)?;
    Ok(different)
}

fn write(asked: &Asked, text: &str) -> Result<(), String> {
    let Some(path) = &asked.out else { return Ok(()) };
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
