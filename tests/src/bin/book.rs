//! The verification book: computes its cases, prints every figure, and writes the table of `tests/VERIFICATION.md`.
//!
//! `cargo run --release -p tests --bin book -- [--quick | --kept] [WORD]...`
//!
//! With words, only cases whose name contains one of them; with `--quick`, only those of the suite. Figures are kept beside
//! the program, by the digest of its own bytes: without words, what this very program has computed before is not computed
//! again, so that long cases may be computed on their own before. The file is written as soon as the program has figures of
//! all cases; `--kept` computes nothing and writes it of what there is, naming the cases that are not computed. The program fails if a figure missed whose row does not give the reason, or did not though its row does.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    panic::catch_unwind,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

use tests::{
    book::{ENTRIES, Entry},
    case::{Case, Figures, number},
};

/// What is said of a case of which there are no figures.
const NOT_COMPUTED: &str = "it was not computed when this file was written";

/// What came of an entry: its figures, or what it said when it broke off.
type Done = Result<Figures, String>;

fn main() -> ExitCode {
    let (flags, words): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument.starts_with("--"));
    if let Some(flag) = flags.iter().find(|flag| !["--quick", "--kept"].contains(&flag.as_str())) {
        eprintln!("{flag}: read --quick, --kept, or words of the names of cases");
        return ExitCode::from(2);
    }
    let has = |flag: &str| flags.iter().any(|other| other == flag);
    let chosen: Vec<&Entry> = ENTRIES
        .iter()
        .filter(|entry| !has("--quick") || entry.quick)
        .filter(|entry| words.is_empty() || words.iter().any(|word| entry.name.contains(word)))
        .collect();
    if chosen.is_empty() {
        let names: Vec<&str> = ENTRIES.iter().map(|entry| entry.name).collect();
        eprintln!("no case is called so; they are\n{}", names.join("\n"));
        return ExitCode::from(2);
    }
    let shelf = match Shelf::of_this_program() {
        Ok(shelf) => shelf,
        Err(error) => {
            eprintln!("no place beside the program to keep figures: {error}");
            return ExitCode::FAILURE;
        }
    };
    let wanted = |entry: &&&Entry| !has("--kept") && (!words.is_empty() || shelf.take(entry).is_none());
    let mut missing: Vec<&Entry> = chosen.iter().filter(wanted).copied().collect();
    // Long ones first, so that no core is left alone with one at the end.
    missing.sort_by_key(|entry| entry.quick);
    let computed = compute(&missing, &shelf);
    let of = |entry: &Entry| match missing.iter().position(|other| other.name == entry.name) {
        Some(at) => computed[at].clone(),
        None => shelf.take(entry).ok_or_else(|| NOT_COMPUTED.to_owned()),
    };
    let mut fine = true;
    for entry in &chosen {
        let done = of(entry);
        if let Err(words) = &done {
            println!("{}: no figures: {words}", entry.name);
        }
        fine &= done.is_ok_and(|sheet| sheet.is_as_stated());
    }
    let all: Vec<&Entry> = ENTRIES.iter().collect();
    let done: Vec<Done> = all.iter().map(|entry| of(entry)).collect();
    if chosen.len() == ENTRIES.len() || done.iter().all(Result::is_ok) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("VERIFICATION.md");
        if let Err(error) = std::fs::write(&path, table(&all, &done)) {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
        println!("{} is written", path.display());
    }
    if fine { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Figures that this program has computed, one file for each case.
struct Shelf(PathBuf);

impl Shelf {
    /// The folder beside the program that is named after the digest of its bytes.
    fn of_this_program() -> std::io::Result<Self> {
        let program = std::env::current_exe()?;
        let digest = blake3::hash(&std::fs::read(&program)?).to_hex();
        let folder = program.with_file_name(format!("book-{}", &digest[..16]));
        std::fs::create_dir_all(&folder)?;
        Ok(Self(folder))
    }

    fn path(&self, entry: &Entry) -> PathBuf {
        self.0.join(entry.name.replace(": ", "-")).with_extension("json")
    }

    /// What was kept of a case.
    fn take(&self, entry: &Entry) -> Option<Figures> {
        let text = std::fs::read(self.path(entry)).ok()?;
        // Bits, because a figure may be no number.
        let kept: Vec<(String, u64)> = serde_json::from_slice(&text).ok()?;
        Some(Figures::of(
            &kept.into_iter().map(|(name, bits)| (name, f64::from_bits(bits))).collect::<Vec<_>>(),
        ))
    }

    /// Keeps the figures of a case. A disk that does not take them costs computing them again.
    fn keep(&self, entry: &Entry, sheet: &Figures) {
        let bits: Vec<(String, u64)> =
            sheet.figures().into_iter().map(|(name, ours)| (name, ours.to_bits())).collect();
        let text = serde_json::to_vec(&bits).expect("names and numbers");
        if let Err(error) = std::fs::write(self.path(entry), text) {
            eprintln!("{}: {error}", self.path(entry).display());
        }
    }
}

/// Computes entries on as many threads as there are cores, each entry on one.
fn compute(entries: &[&Entry], shelf: &Shelf) -> Vec<Done> {
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Done>> = entries.iter().map(|_| Mutex::new(Err("not begun".to_owned()))).collect();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores.min(entries.len()) {
            scope.spawn(|| {
                while let at = next.fetch_add(1, Ordering::Relaxed)
                    && let Some(entry) = entries.get(at)
                {
                    let begun = Instant::now();
                    let result = catch_unwind(|| entry.run()).map_err(|panic| {
                        let text = panic.downcast_ref::<String>().map(String::as_str);
                        text.or_else(|| panic.downcast_ref::<&str>().copied())
                            .unwrap_or("no words")
                            .to_owned()
                    });
                    println!("{:.1} s for {}", begun.elapsed().as_secs_f64(), entry.name);
                    if let Ok(sheet) = &result {
                        shelf.keep(entry, sheet);
                    }
                    *done[at].lock().unwrap_or_else(PoisonError::into_inner) = result;
                }
            });
        }
    });
    done.into_iter().map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// The figure of each row that is furthest off: a row may be met by several runs.
fn worst(cases: &[Case]) -> Vec<&Case> {
    let mut by_name: BTreeMap<&str, (usize, &Case)> = BTreeMap::new();
    for (at, case) in cases.iter().enumerate() {
        let off = |case: &Case| (case.ours - case.reference).abs();
        let slot = by_name.entry(&case.name).or_insert((at, case));
        if off(case) > off(slot.1) {
            slot.1 = case;
        }
    }
    let mut rows: Vec<(usize, &Case)> = by_name.into_values().collect();
    rows.sort_by_key(|(at, _)| *at);
    rows.into_iter().map(|(_, case)| case).collect()
}

/// `VERIFICATION.md`.
fn table(entries: &[&Entry], done: &[Done]) -> String {
    let rows: Vec<Vec<&Case>> =
        done.iter().map(|d| d.as_ref().map_or(Vec::new(), |s| worst(s.cases()))).collect();
    let all = rows.iter().map(Vec::len).sum::<usize>();
    let passed = rows.iter().flatten().filter(|case| case.holds()).count();
    let mut out = format!(
        "# Verification\n\nWritten by `cargo run --release -p tests --bin book`; {passed} of {all} figures pass. What a case \
         sets up stands in `tests/src/book/`, its references in `tests/reference.toml`. Figures are in SI units unless the \
         row says otherwise; where several runs meet one row, the one furthest off is shown.\n"
    );
    for ((entry, done), rows) in entries.iter().zip(done).zip(&rows) {
        let _ = write!(out, "\n## {}\n\n", entry.name.replace('_', " "));
        if let Err(words) = done {
            let _ = writeln!(out, "No figures: {words}.");
            continue;
        }
        out += "| case | reference | source | ours | difference | tolerance | verdict |\n|---|---|---|---|---|---|---|\n";
        for case in rows {
            let reason = case.miss.as_ref().map_or(String::new(), |why| format!(": {why}"));
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} | {} | {}{reason} |",
                case.name,
                number(case.reference),
                case.source.replace('|', "\\|"),
                number(case.ours),
                case.difference(),
                case.tolerance,
                case.verdict()
            );
        }
    }
    out
}
