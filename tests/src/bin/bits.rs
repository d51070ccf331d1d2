//! The whole matrix of bits, through the `bolide` binary and its worker processes: prints a table of digests.
//!
//! `cargo run --release -p tests --bin bits -- [--bolide PATH] [--cycles N] [--deck PATH]... [--most-workers N] [--clusters FOLDER]`
//!
//! `bits -- --examples [--bolide PATH]` runs every deck of `deck/examples` instead, whole or to a cycle after its first events,
//! on 1, 2 and 5 workers that are processes, and prints one line for each.
//!
//! With `--clusters deploy/clusters`, every cluster file there is emulated on both routes as well.
//!
//! Without `--bolide`, the binary beside this one; build it first with `cargo build --release -p master`. Without
//! `--deck`, both benchmarks of 27,000 elements and the pipe whip, shells between rigid bodies. Every run of a deck must have the digest, the history and the energies
//! of the first, which is one worker of one thread; the program ends with failure if one has not.

use std::{
    path::{Path, PathBuf},
    process::{Command, ExitCode},
};

use serde_json::Value;

/// What was asked on the command line.
struct Asked {
    bolide: PathBuf,
    decks: Vec<PathBuf>,
    cycles: u64,
    most_workers: usize,
    /// Folder of cluster files to emulate too.
    clusters: Option<PathBuf>,
    /// Every example instead of the matrix.
    examples: bool,
}

fn asked() -> Result<Asked, String> {
    let here = std::env::current_exe().map_err(|e| format!("where this program is: {e}"))?;
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deck/examples");
    let mut asked = Asked {
        bolide: here.with_file_name("bolide"),
        decks: Vec::new(),
        cycles: 300,
        most_workers: 7,
        clusters: None,
        examples: false,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        if flag == "--examples" {
            asked.examples = true;
            continue;
        }
        let value = arguments.next().ok_or_else(|| format!("{flag}: a value is needed"))?;
        let number = || value.parse::<u64>().map_err(|e| format!("{flag} {value}: {e}"));
        match flag.as_str() {
            "--bolide" => asked.bolide = value.into(),
            "--deck" => asked.decks.push(value.into()),
            "--cycles" => asked.cycles = number()?.max(2),
            "--clusters" => asked.clusters = Some(value.into()),
            "--most-workers" => asked.most_workers = number()? as usize,
            _ => {
                return Err(format!(
                    "{flag}: read --bolide, --deck, --cycles, --most-workers, --clusters or --examples"
                ));
            }
        }
    }
    if asked.examples && !asked.decks.is_empty() {
        return Err("--examples says which decks: leave --deck out".to_owned());
    }
    if asked.decks.is_empty() {
        let decks = ["plates-joined.toml", "plates-free-slip.toml", "pipe-whip.k"];
        asked.decks = decks.map(|name| examples.join(name)).to_vec();
    }
    Ok(asked)
}

/// One row of the table: what it is called and the flags of its run.
struct Row {
    name: String,
    flags: Vec<String>,
}

fn row(name: &str, flags: &str) -> Row {
    Row { name: name.to_owned(), flags: flags.split_whitespace().map(str::to_owned).collect() }
}

/// All rows; `processes` where this binary can start its workers as processes, `lanes` those of this machine.
fn rows(asked: &Asked, processes: bool, lanes: &[String], snapshot: &Path) -> Vec<Row> {
    let half = asked.cycles / 2;
    let mut rows = vec![row("1 worker, 1 thread", "--workers 1 --threads 1")];
    for workers in [1, 2, 3, 4, 7].into_iter().filter(|w| *w <= asked.most_workers) {
        // One worker of one thread is the first row.
        for threads in [1, 2].into_iter().filter(|threads| workers * threads > 1) {
            rows.push(row(
                &format!("{workers} workers of {threads} threads"),
                &format!("--workers {workers} --threads {threads}"),
            ));
        }
        if processes {
            rows.push(row(
                &format!("{workers} processes"),
                &format!("--workers {workers} --threads 1 --processes"),
            ));
        }
    }
    rows.push(row("speeds 1, 2, 0.5", "--workers 3 --threads 1 --speeds 1,2,0.5"));
    for lanes in lanes {
        rows.push(row(&format!("lanes {lanes}"), &format!("--workers 2 --threads 1 --lanes {lanes}")));
    }
    for (name, flag) in [
        ("sorts every cycle", "--sort-every 1"),
        ("sorts every 7 cycles", "--sort-every 7"),
        ("sorts by seed 11", "--sort-seed 11"),
        ("sorts by seed 4711", "--sort-seed 4711"),
    ] {
        for workers in [1, 3] {
            rows.push(row(
                &format!("{name}, {workers} workers"),
                &format!("--workers {workers} --threads 1 {flag}"),
            ));
        }
    }
    rows.push(row("snapshot on the way", &format!("--workers 2 --threads 1 --snapshot-at {half}")));
    for workers in [1, 3] {
        let mut restored =
            row(&format!("restored on {workers} workers"), &format!("--workers {workers} --threads 1"));
        restored.flags.extend(["--resume".to_owned(), snapshot.display().to_string()]);
        rows.push(restored);
    }
    rows
}

/// What a run must have in common with the others.
#[derive(PartialEq)]
struct Outcome {
    digest: String,
    cycles: Value,
    energies: Value,
    momentum_error: Value,
    history: String,
    eroded: Value,
    deepest: Value,
}

fn run(asked: &Asked, deck: &Path, row: &Row, out: &Path) -> Result<(Outcome, f64), String> {
    let output = Command::new(&asked.bolide)
        .arg("run")
        .arg(deck)
        .args(&row.flags)
        .args(["--cycles", &asked.cycles.to_string(), "--json", "--force", "--out"])
        .arg(out)
        .output()
        .map_err(|e| {
            format!("{}: {e}; build it with `cargo build --release -p master`", asked.bolide.display())
        })?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).trim().to_owned());
    }
    let summary: Value = serde_json::from_slice(&output.stdout).map_err(|e| format!("its summary: {e}"))?;
    let history = out.join("history.csv");
    let outcome = Outcome {
        digest: summary["digest"].as_str().ok_or("a summary without a digest")?.to_owned(),
        cycles: summary["cycles"].clone(),
        energies: summary["energies"].clone(),
        momentum_error: summary["momentum_error"].clone(),
        // Numbers are written so that they read back to the same bits: equal text is equal bits.
        history: std::fs::read_to_string(&history).map_err(|e| format!("{}: {e}", history.display()))?,
        eroded: summary["eroded_elements"].clone(),
        deepest: summary["worst_penetration"].clone(),
    };
    Ok((outcome, summary["wall_s"].as_f64().unwrap_or(f64::NAN)))
}

/// The lanes of this machine.
fn lanes() -> Vec<String> {
    use mechanics::lanes::Width;
    Width::ALL.into_iter().filter(|width| width.available()).map(|width| width.to_string()).collect()
}

fn main() -> ExitCode {
    match asked().and_then(|asked| if asked.examples { examples(asked) } else { matrix(&asked) }) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(different) => {
            eprintln!("{different} runs differ");
            ExitCode::FAILURE
        }
        Err(reason) => {
            eprintln!("{reason}");
            ExitCode::FAILURE
        }
    }
}

/// A copy of a deck whose contact has twice the default slack; none without contact.
fn with_doubled_slack(deck: &Path, folder: &Path) -> Result<Option<PathBuf>, String> {
    let text = std::fs::read_to_string(deck).map_err(|e| format!("{}: {e}", deck.display()))?;
    if !text.contains("[contact]\n") || text.contains("slack") {
        return Ok(None);
    }
    let copy = folder.join("doubled-slack.toml");
    std::fs::write(&copy, text.replace("[contact]\n", "[contact]\nslack_gaps = 8.0\n"))
        .map_err(|e| format!("{}: {e}", copy.display()))?;
    Ok(Some(copy))
}

/// The digest of a deck on an emulated cluster.
fn emulated(asked: &Asked, deck: &Path, cluster: &Path, route: &str) -> Result<String, String> {
    let output = Command::new(&asked.bolide)
        .arg("simulate")
        .arg(deck)
        .arg("--cluster")
        .arg(cluster)
        .args(["--route", route, "--json", "--cycles", &asked.cycles.max(4).to_string()])
        .output()
        .map_err(|e| format!("{}: {e}", asked.bolide.display()))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).trim().to_owned());
    }
    let summary: Value = serde_json::from_slice(&output.stdout).map_err(|e| format!("its summary: {e}"))?;
    Ok(summary["digest"].as_str().ok_or("a summary without a digest")?.to_owned())
}

/// Every cluster file of `--clusters` on both routes; counts those that have not the digest `first`.
fn on_clusters(asked: &Asked, deck: &Path, first: &str) -> Result<usize, String> {
    let Some(folder) = &asked.clusters else { return Ok(0) };
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    let mut different = 0;
    for file in &files {
        for route in ["master", "direct"] {
            let name = format!("{}, {route}", file.file_stem().unwrap_or_default().display());
            match emulated(asked, deck, file, route) {
                Ok(digest) => {
                    let verdict = if digest == first { "same" } else { "DIFFERENT" };
                    different += usize::from(digest != first);
                    println!("{name:<36} {digest}             {verdict}");
                }
                Err(reason) => {
                    different += 1;
                    println!("{name:<36} FAILED: {reason}");
                }
            }
        }
    }
    Ok(different)
}

/// What an example must have shown by the end of its run.
#[derive(Clone, Copy, PartialEq)]
enum Event {
    /// None to wait for: nothing meets or leaves in it, or it runs onto a wall at once.
    None,
    Contact,
    /// Contact, and elements that left.
    Erosion,
}

/// The last cycle of a deck that runs to its own end.
const WHOLE: u64 = 1_000_000;

/// Every deck of `deck/examples`, the cycle at which its run ends, and what has happened by then. An explosive burns from the
/// first cycle on.
const EXAMPLES: [(&str, u64, Event); 30] = [
    ("aramid-panel.toml", 1500, Event::Contact),
    ("ball-on-shell.k", WHOLE, Event::Contact),
    ("ball-tears-sheet.toml", 400, Event::Erosion),
    ("bar-on-wall.k", WHOLE, Event::None),
    ("blast-on-plate.toml", WHOLE, Event::None),
    ("block-on-plate.k", WHOLE, Event::Contact),
    ("bolted-joint.toml", WHOLE, Event::Erosion),
    ("ceramic-tile.toml", WHOLE, Event::Erosion),
    ("composite-panel.toml", 600, Event::Erosion),
    ("concrete-crater.toml", 800, Event::Contact),
    ("explosive-on-plate.toml", WHOLE, Event::Contact),
    ("fragment-on-water-box.toml", 300, Event::Contact),
    ("girder-crush.toml", 4000, Event::Contact),
    ("pendulum-hammer.toml", 3000, Event::Contact),
    ("pipe-whip.k", WHOLE, Event::Contact),
    ("plates-64k-free-slip.toml", 60, Event::Contact),
    ("plates-64k-joined.toml", 60, Event::None),
    ("plates-free-slip.toml", 300, Event::Contact),
    ("plates-joined.toml", 300, Event::None),
    ("punch-through-plate.k", WHOLE, Event::Erosion),
    ("ring-breaks.toml", WHOLE, Event::None),
    ("rod-through-plate.toml", 1000, Event::Erosion),
    ("rubble-in-box.toml", 1000, Event::Erosion),
    ("self-contact.toml", WHOLE, Event::Contact),
    ("sphere-6-km-s.toml", 400, Event::Erosion),
    ("table-on-tubes.toml", 2000, Event::Contact),
    ("taylor-copper.toml", 3000, Event::None),
    ("tetrahedral-fragment.toml", 1000, Event::Erosion),
    ("tube-crush.toml", WHOLE, Event::Contact),
    ("two-bars.toml", WHOLE, Event::Contact),
];

/// Names of the decks of a folder; a keyword mesh is a part of the deck that includes it.
fn decks_of(folder: &Path) -> Result<Vec<String>, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| !name.ends_with("-mesh.k")).collect();
    names.sort();
    Ok(names)
}

/// Every example on 1, 2 and 5 workers: prints the table and counts the decks that differ, fail, or show too little.
fn examples(mut asked: Asked) -> Result<usize, String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deck/examples");
    let listed = EXAMPLES.map(|(name, ..)| name);
    let found = decks_of(&folder)?;
    if found != listed {
        return Err(format!("the examples are {found:?}, the list of this program has {listed:?}"));
    }
    let out = std::env::temp_dir().join(format!("bolide-examples-{}", std::process::id()));
    let mut wrong = 0;
    println!(
        "{:<28} {:>7} {:>7} {:>8}  {:<32}  {:<9} {:<9}",
        "deck", "cycles", "eroded", "deepest", "digest, 1 worker", "2 workers", "5 workers"
    );
    for (name, cycles, event) in EXAMPLES {
        asked.cycles = cycles;
        let runs = [1, 2, 5].map(|workers| {
            let row = row(name, &format!("--workers {workers} --threads 1 --processes"));
            run(&asked, &folder.join(name), &row, &out).map(|(outcome, _)| outcome)
        });
        let [Ok(first), others @ ..] = &runs else {
            wrong += 1;
            println!("{name:<28} FAILED: {}", runs[0].as_ref().err().map_or("", String::as_str));
            continue;
        };
        let verdicts = others.each_ref().map(|other| match other {
            Ok(other) if other == first => "same",
            Ok(_) => "other",
            Err(_) => "FAILED",
        });
        let (eroded, deepest) = (first.eroded.as_u64().unwrap_or(0), first.deepest.as_f64().unwrap_or(0.0));
        let shown = match event {
            Event::None => true,
            Event::Contact => deepest > 0.0,
            Event::Erosion => deepest > 0.0 && eroded > 0,
        };
        wrong += usize::from(!shown || verdicts.iter().any(|verdict| *verdict != "same"));
        println!(
            "{name:<28} {:>7} {eroded:>7} {deepest:>8.4}  {:<32}  {:<9} {:<9}{}",
            first.cycles.as_u64().unwrap_or(0),
            first.digest,
            verdicts[0],
            verdicts[1],
            if shown { "" } else { " ended before its events" }
        );
        for reason in others.iter().filter_map(|other| other.as_ref().err()) {
            println!("    {reason}");
        }
    }
    std::fs::remove_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    Ok(wrong)
}

/// Runs everything, prints the table and counts the runs that differ.
fn matrix(asked: &Asked) -> Result<usize, String> {
    let help = Command::new(&asked.bolide).args(["run", "--help"]).output().map_err(|e| {
        format!("{}: {e}; build it with `cargo build --release -p master`", asked.bolide.display())
    })?;
    let processes = String::from_utf8_lossy(&help.stdout).contains("--processes");
    if !processes {
        println!("this binary has no --processes; workers run inside one process");
    }
    let folder = std::env::temp_dir().join(format!("bolide-bits-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut different = 0;
    for deck in &asked.decks {
        println!("\n{}, {} cycles", deck.display(), asked.cycles);
        // Overwritten by no run but the one that takes it.
        let kept = folder.join("snapshot.bolide");
        let mut first: Option<Outcome> = None;
        let wider = with_doubled_slack(deck, &folder)?;
        let doubled = wider.iter().map(|deck| (deck, row("doubled slack", "--workers 2 --threads 1")));
        let rows = rows(asked, processes, &lanes(), &kept);
        for (deck, row) in rows.into_iter().map(|row| (deck, row)).chain(doubled) {
            let out = folder.join("results");
            match run(asked, deck, &row, &out) {
                Ok((outcome, wall)) => {
                    let same = first.as_ref().is_none_or(|first| *first == outcome);
                    different += usize::from(!same);
                    let verdict = if same { "same" } else { "DIFFERENT" };
                    println!("{:<36} {} {wall:>8.2} s  {verdict}", row.name, outcome.digest);
                    first.get_or_insert(outcome);
                }
                Err(reason) => {
                    different += 1;
                    println!("{:<36} FAILED: {reason}", row.name);
                }
            }
            let taken = out.join("snapshot.bolide");
            if taken.exists() {
                std::fs::rename(&taken, &kept).map_err(|e| format!("{}: {e}", kept.display()))?;
            }
        }
        if let Some(first) = &first {
            different += on_clusters(asked, deck, &first.digest)?;
        }
    }
    std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(different)
}
