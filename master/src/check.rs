//! CHECK: `bolide check`, the faults of a deck, or what a run of it would take and what in it is hardly meant.

use std::{path::Path, process::ExitCode};

use deck::{
    Fault, MAX_NUMBER, Warning,
    bundle::Options,
    fault::short,
    physics::{self, Forecast, GRIND_NS},
};
use serde::Serialize;

use crate::{
    deck_file::{Error, gather_deck, warn},
    progress,
    shell::{print, tell},
};

/// What `--json` prints.
#[derive(Serialize)]
struct Checked {
    deck: String,
    /// A line each; a deck with faults has no forecast.
    faults: Vec<String>,
    /// Of the reader and of the physics, a line each.
    warnings: Vec<String>,
    forecast: Option<Forecast>,
    /// Of each part the counts of cells of its block; empty of a part with another mesh.
    cells: Vec<Vec<u32>>,
}

/// Checks a deck.
///
/// # Errors
/// Its faults, one per line.
pub fn run(path: &Path, json: bool, options: &Options) -> Result<ExitCode, String> {
    let name = path.display().to_string();
    let text = gather_deck(path, options)?;
    let lines = |faults: &[Fault]| faults.iter().map(Fault::to_string).collect::<Vec<_>>();
    let read = deck::read_whole(&text, &name);
    let forecast = read.as_ref().ok().map(|reading| physics::forecast(&reading.model));
    if !json {
        let reading = read.map_err(|faults| Error::of_faults(lines(&faults)))?;
        warn(&reading.warnings);
        if let Some(forecast) = &forecast {
            forecast.warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
            print(&format!("{name}: no fault{}", words(forecast, &reading.cells)))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let code = if read.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    let of_reader = read.as_ref().map_or(&[][..], |reading| &reading.warnings);
    let of_physics = forecast.iter().flat_map(|forecast| forecast.warnings.clone());
    let checked = Checked {
        deck: name,
        warnings: of_reader.iter().map(Warning::to_string).chain(of_physics).collect(),
        faults: read.as_ref().err().map_or_else(Vec::new, |faults| lines(faults)),
        forecast,
        cells: read.as_ref().map_or_else(|_| Vec::new(), |reading| reading.cells.clone()),
    };
    print(&serde_json::to_string_pretty(&checked).map_err(|e| e.to_string())?)?;
    Ok(code)
}

/// The forecast of a deck without a fault, from the end of its first line on, with the counts of cells by part.
fn words(forecast: &Forecast, cells: &[Vec<u32>]) -> String {
    let Forecast { parts, elements, nodes, .. } = forecast;
    let count = forecast.warnings.len();
    let doubts = match count {
        0 => String::new(),
        1 => ", 1 warning".to_owned(),
        _ => format!(", {count} warnings"),
    };
    let n_parts = if parts.len() == 1 { "1 part".to_owned() } else { format!("{} parts", parts.len()) };
    let mut text = format!("{doubts}; {n_parts}, {elements} elements, {nodes} nodes\n");
    let width = parts.iter().map(|part| part.name.chars().count()).max().unwrap_or(0).max(4);
    text += &format!(
        "  {:width$}  {:>10}  {:>10}  {:>10}  {:>12}  {:>10}  cells\n",
        "part", "elements", "mass kg", "speed m/s", "least cell m", "step s"
    );
    for (part, cells) in parts.iter().zip(cells) {
        let counts: Vec<String> = cells.iter().map(u32::to_string).collect();
        let counts = if counts.is_empty() { "of a mesh".to_owned() } else { counts.join(" x ") };
        let step = part.step_s.map_or_else(|| "any".to_owned(), digits);
        text += &format!(
            "  {:width$}  {:>10}  {:>10}  {:>10}  {:>12}  {:>10}  {counts}\n",
            part.name,
            part.elements,
            digits(part.mass_kg),
            digits(part.speed_m_s),
            digits(part.least_cell_m),
            step
        );
    }
    // A run of a count of cycles has no end in time.
    let end = match forecast.end_time_s {
        end if end <= MAX_NUMBER => format!(" to {} s", digits(end)),
        _ => String::new(),
    };
    let run = match (forecast.first_step_s, forecast.cycles, forecast.thread_s) {
        (Some(step), Some(cycles), Some(seconds)) => format!(
            "first step {} s, {cycles} cycles{end}, {} of thread time at {GRIND_NS} ns per element and cycle",
            digits(step),
            span(seconds)
        ),
        _ => format!("the mesh limits no step{end}"),
    };
    text + &format!("  {run}\n  memory {} of master and worker\n", size(forecast.memory_bytes))
}

/// Four digits of a number.
fn digits(x: f64) -> String {
    short(format!("{x:.3e}").parse().unwrap_or(x))
}

/// A time that a person waits for.
fn span(seconds: f64) -> String {
    if seconds < 1.0 { "less than 1 s".to_owned() } else { progress::span(seconds) }
}

fn size(bytes: u64) -> String {
    match bytes as f64 {
        b if b < 1e9 => format!("{:.0} MB", b / 1e6),
        b => format!("{:.1} GB", b / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sizes_are_told_in_units_that_fit() {
        let spans = [0.2, 5.0, 600.0, 36_000.0, 864_000.0].map(span);
        assert_eq!(spans, ["less than 1 s", "5 s", "10 min", "10.0 h", "10.0 days"]);
        assert_eq!([300_000_000, 3_400_000_000].map(size), ["300 MB", "3.4 GB"]);
        assert_eq!([1.234_56e-9, 7.850_04].map(digits), ["1.235e-9", "7.85"]);
    }
}
