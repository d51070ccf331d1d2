//! Energies that are shown side by side add up: in the history, in the report's legend and on the page, for every example.

use std::path::{Path, PathBuf};

use master::{
    deck_file::read_deck,
    http::{board::Point, folder::sheet as folder_sheet},
    results::{
        Folder, HISTORY, REPORT, Summary,
        history::{History, HistoryRow, Table},
        report,
    },
};
use tests::solve::{Workers, solve};

/// Cycles of examples of which nothing can erode.
const CYCLES: u64 = 20;
/// Cycles after which something has eroded in the others.
const ERODED: u64 = 500;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deck")
}

/// Every deck of `deck/examples`; a keyword mesh is a part of the deck that includes it.
fn examples() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder().join("examples")).expect("the examples");
    let mut decks: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    decks.retain(|path| !path.to_string_lossy().ends_with("-mesh.k"));
    decks.sort();
    decks
}

/// The names that the reference of the deck adds up to `total`.
fn documented() -> Vec<String> {
    let reference = std::fs::read_to_string(folder().join("README.md")).expect("the reference");
    let line = reference.lines().find(|line| line.starts_with("| `total` |")).expect("a row for `total`");
    let formula = line.split('|').nth(2).expect("a second cell").trim().trim_matches('`');
    formula.split('+').map(|name| name.trim().to_owned()).collect()
}

/// What the legend of the report's first plot says last: name and number.
fn legend(page: &str) -> Vec<(String, f64)> {
    let plot = page.split("<h2>").nth(1).expect("a plot of energies");
    plot.split("/></svg> ")
        .skip(1)
        .map(|entry| {
            let (name, rest) = entry.split_once(" <small>").expect("a name");
            let number = rest.split_once("</small>").expect("a number").0;
            (name.to_owned(), number.parse().expect("a number"))
        })
        .collect()
}

#[test]
fn energies_add_up_wherever_they_are_shown() {
    let shares = documented();
    let mut eroding = 0;
    for path in examples() {
        let mut model = read_deck(&path).unwrap_or_else(|faults| panic!("{faults}"));
        let erodes = model.setup.erosion.is_on();
        let walled = !model.setup.walls.is_empty();
        model.setup.control.end_cycle = if erodes { ERODED } else { CYCLES };
        model.output.history_cycles = if erodes { 20 } else { 1 };
        let solved = solve(model, Workers::of(2)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let scratch = tempfile::tempdir().expect("a folder");
        let out = Folder::create(scratch.path(), true).expect("a results folder");
        let mut history = History::create(&out, &solved.model).expect("a history");
        solved.rows.iter().for_each(|row| history.append(row).expect("a row"));
        let table = Table::read(&scratch.path().join(HISTORY)).expect("the history");
        let column = |name: &str| table.column(name);
        let total = column("total").expect("a total");
        let columns: Vec<Vec<f64>> = shares.iter().filter_map(|name| column(name)).collect();
        let absent = usize::from(!erodes) + usize::from(!walled);
        assert_eq!(columns.len(), shares.len() - absent, "{}: {shares:?}", path.display());
        let adds_up = |parts: &[f64], total: f64, digits: f64, what: &str| {
            let sum: f64 = parts.iter().sum();
            let scale = parts.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            let off = (sum - total).abs();
            assert!(off <= digits * scale, "{}, {what}: {parts:?} are {sum}, not {total}", path.display());
        };
        for (row, &total) in total.iter().enumerate() {
            let parts: Vec<f64> = columns.iter().map(|column| column[row]).collect();
            adds_up(&parts, total, 1e-6, "history");
            let point = Point::from(&solved.rows[row]);
            let parts = [
                point.kinetic,
                point.internal,
                point.hourglass,
                point.contact,
                point.eroded,
                point.wall_loss,
            ];
            adds_up(&parts, point.total, 1e-6, "page");
        }
        assert_momenta(&solved.rows, &path);
        // The page of a results folder has them from the file.
        let sheet = folder_sheet(scratch.path()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let points = sheet["energies"].as_array().expect("points");
        assert_eq!(points.len(), solved.rows.len(), "{}", path.display());
        for (point, row) in points.iter().zip(&solved.rows) {
            let number = |name: &str| point[name].as_f64().expect("a number");
            let parts = ["kinetic", "internal", "hourglass", "contact", "eroded", "wall_loss"].map(number);
            adds_up(&parts, number("total"), 1e-6, "page of a folder");
            assert_eq!(number("time").to_bits(), row.time.to_bits(), "{}", path.display());
        }
        report::write(&out, &Summary::default(), &solved.model.units, &[]).expect("a report");
        let page = std::fs::read_to_string(scratch.path().join(REPORT)).expect("the report");
        // The wall of one example waits for a load of another case: nothing moves.
        assert_eq!(
            page.contains("<h2>Energies "),
            total.iter().any(|&total| total != 0.0),
            "{}",
            path.display()
        );
        if !page.contains("<h2>Energies ") {
            continue;
        }
        let mut shown = legend(&page);
        shown.retain(|(name, _)| name != "external work");
        let (name, total) = shown.pop().unwrap_or_else(|| panic!("{}: no total", path.display()));
        assert_eq!(name, "total", "{}: {shown:?}", path.display());
        // Six digits are printed.
        adds_up(&shown.iter().map(|(_, value)| *value).collect::<Vec<_>>(), total, 2e-5, "report");
        eroding += usize::from(solved.rows.last().is_some_and(|row| row.eroded != 0.0));
    }
    assert_eq!(eroding, 6, "examples that lost energy by erosion");
}

/// Momenta of parts are exact sums: those of all parts are the momentum to the bit.
fn assert_momenta(rows: &[HistoryRow], path: &Path) {
    for row in rows {
        let sum = row
            .part_momenta
            .iter()
            .fold([0.0; 3], |sum: [f64; 3], part| std::array::from_fn(|axis| sum[axis] + part[axis]));
        assert_eq!(sum, row.momentum, "{}, cycle {}", path.display(), row.cycle);
    }
}

/// The page's script names the shares that the master sends.
#[test]
fn the_page_shows_every_share_of_the_sum() {
    let script = include_str!("../../master/page/energies.js");
    let from = script.find("const SERIES = [").expect("the series");
    let series = &script[from..from + script[from..].find("];").expect("their end")];
    for key in ["kinetic", "internal", "hourglass", "contact", "eroded", "wall_loss", "total"] {
        assert!(series.contains(&format!("key: '{key}'")), "{key} is no curve of the page");
    }
}
