//! REFINE: `bolide run DECK --refine 2`, the deck on its own mesh and on a finer one, and how what they come to differs.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
    process::ExitCode,
};

use deck::{bundle::Options, model::Model};

use crate::{
    command::RunArgs,
    deck_file::{gather_deck, read_gathered},
    results::{HISTORY, Summary, Units, history, history::Table, summary::significant},
    run::{folder_for, run_with},
    shell::{print, tell},
    study::measure::{Facts, Formula, OF_SUMMARY, of_summary},
};

/// Gauges whose readings are compared without being asked for, and parts likewise.
const GAUGES: usize = 4;
const PARTS: usize = 4;
/// Change of a measure, over the greatest of its kind, below which the mesh is called fine enough for it.
const SETTLED: f64 = 0.02;

/// What both runs are asked for.
struct Compared {
    name: String,
    unit: String,
    /// Whether a change of it says that the mesh is too coarse.
    is_judged: bool,
    values: [f64; 2],
}

/// The unit of what is counted.
const COUNT: &str = "1";

/// Runs the deck twice and prints the comparison. The finer run goes beside the first, into `FOLDER-refined-FACTOR`.
///
/// # Errors
/// Whatever kept a run from its end, and formulas that cannot be computed.
pub fn run(args: &RunArgs, factor: u32) -> Result<ExitCode, String> {
    let coarse = folder_for(args);
    let mut name = coarse.file_name().unwrap_or_default().to_owned();
    name.push(format!("-refined-{factor}"));
    let fine = coarse.with_file_name(name);
    let reading = args.reading.options();
    let finer = Options { refine: Some(factor), ..reading.clone() };
    let shown = args.deck.display().to_string();
    // What is wrong with the finer deck, or with a formula, is told before the first run and not after it.
    let model = read_gathered(&gather_deck(&args.deck, &finer)?, &shown)?;
    let formulas = formulas(&args.measure)?;
    let facts = Facts::of(&model, &history::columns(&model));
    for (text, formula) in &formulas {
        formula.check(&facts).map_err(|why| format!("--measure {text:?}: {why}"))?;
    }
    tell(&format!(
        "{} elements with cells {factor} times finer; that run takes some {} times as long as the first",
        model.mesh.n_elements(),
        u64::from(factor).pow(4)
    ));
    drop(model);
    for (folder, reading) in [(&coarse, &reading), (&fine, &finer)] {
        let args = RunArgs { out: Some(folder.clone()), ..args.clone() };
        let code = run_with(&args, reading)?;
        if code != ExitCode::SUCCESS {
            return Ok(code);
        }
    }
    let model = read_gathered(&gather_deck(&args.deck, &reading)?, &shown)?;
    let compared = compare(&model, [&coarse, &fine], &formulas)?;
    print(&table(&compared, factor, &fine))?;
    Ok(ExitCode::SUCCESS)
}

fn formulas(texts: &[String]) -> Result<Vec<(String, Formula)>, String> {
    let parse = |text: &String| {
        Formula::parse(text, &OF_SUMMARY)
            .map(|formula| (text.clone(), formula))
            .map_err(|why| format!("--measure {text:?}: {why}"))
    };
    texts.iter().map(parse).collect()
}

/// What two results folders of a deck came to.
fn compare(
    model: &Model,
    folders: [&PathBuf; 2],
    formulas: &[(String, Formula)],
) -> Result<Vec<Compared>, String> {
    let read = |folder: &PathBuf| -> Result<(Summary, Table), String> {
        Ok((Summary::read(folder)?, Table::read(&folder.join(HISTORY)).map_err(|e| e.to_string())?))
    };
    let runs = [read(folders[0])?, read(folders[1])?];
    let Units { length, time, energy, .. } = Units::named(&model.units);
    let speed = format!("{length}/{time}");
    let mut compared = Vec::new();
    let mut add = |name: String, unit: &str, of: &dyn Fn(&(Summary, Table)) -> f64| {
        // More elements, and less hourglass energy, are what a finer mesh is for.
        let is_judged = ![COUNT, "%"].contains(&unit);
        compared.push(Compared {
            name,
            unit: unit.to_owned(),
            is_judged,
            values: [of(&runs[0]), of(&runs[1])],
        });
    };
    add("elements".to_owned(), COUNT, &|(s, _)| s.elements as f64);
    add("kinetic energy".to_owned(), energy, &|(s, _)| s.energies.kinetic);
    add("internal energy".to_owned(), energy, &|(s, _)| s.energies.internal);
    add("hourglass over internal energy".to_owned(), "%", &|(s, _)| {
        let internal = s.energies.internal + s.eroded_energy;
        if internal > 0.0 { 100.0 * s.energies.hourglass / internal } else { 0.0 }
    });
    if runs.iter().any(|(s, _)| s.eroded_elements > 0) {
        add("eroded energy".to_owned(), energy, &|(s, _)| s.eroded_energy);
    }
    for (index, part) in model.mesh.parts.iter().enumerate().take(PARTS) {
        add(format!("{}: mean speed at the end", part.name), &speed, &|(s, _)| {
            s.energies.parts.get(index).map_or(0.0, |part| {
                let p = part.momentum.map(|p| p * p).iter().sum::<f64>().sqrt();
                if part.mass > 0.0 { p / part.mass } else { 0.0 }
            })
        });
    }
    for gauge in model.output.gauges.iter().take(GAUGES) {
        for (what, unit, words) in
            [("u", length, "displacement at the end"), ("v", speed.as_str(), "greatest speed")]
        {
            add(format!("{}: {words}", gauge.name), unit, &|(_, history)| {
                let axes =
                    ["x", "y", "z"].map(|axis| history.column(&format!("{}:{what}{axis}", gauge.name)));
                let length = |row: usize| {
                    axes.iter().flatten().map(|column| column[row] * column[row]).sum::<f64>().sqrt()
                };
                let rows = 0..history.rows.len();
                if what == "u" {
                    rows.last().map_or(0.0, length)
                } else {
                    rows.map(length).fold(0.0, f64::max)
                }
            });
        }
    }
    for (text, formula) in formulas {
        let value = |(summary, history): &(Summary, Table)| {
            let facts = Facts::of(model, &history.columns);
            formula.check(&facts).and_then(|()| formula.of_run(history, &facts, &of_summary(summary)))
        };
        let both = |why| format!("--measure {text:?}: {why}");
        let values = [value(&runs[0]).map_err(both)?, value(&runs[1]).map_err(both)?];
        compared.push(Compared { name: text.clone(), unit: String::new(), is_judged: true, values });
    }
    Ok(compared)
}

/// The comparison for a terminal.
fn table(compared: &[Compared], factor: u32, fine: &Path) -> String {
    let names: Vec<String> = compared
        .iter()
        .map(|one| {
            if one.unit.is_empty() || one.unit == COUNT {
                one.name.clone()
            } else {
                format!("{} ({})", one.name, one.unit)
            }
        })
        .map(|name| name.replace(char::is_control, " "))
        .collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut text =
        format!("\n{:width$}  {:>12}  {:>12}  change\n", "trend", "as it is", format!("{factor} x finer"));
    let (mut judged, mut unsettled) = (0, 0);
    for (name, Compared { unit, is_judged, values: [coarse, fine], .. }) in names.iter().zip(compared) {
        let change = if *coarse != 0.0 { (fine - coarse) / coarse.abs() } else { f64::NAN };
        // Of a small share of the energy, or of a body that hardly moves any more, a large change is no large one.
        let of_kind = compared.iter().filter(|one| !unit.is_empty() && one.unit == *unit);
        let scale =
            of_kind.flat_map(|one| one.values).chain([*coarse]).fold(0.0_f64, |most, v| most.max(v.abs()));
        let settles = (fine - coarse).abs() <= SETTLED * scale;
        let words = match coarse == fine {
            true => "none".to_owned(),
            false if change.is_finite() => format!("{:+.1} %", 100.0 * change),
            false => "from zero".to_owned(),
        };
        let mark = if *is_judged && !settles { "  *" } else { "" };
        let words = if unit == COUNT { String::new() } else { format!("{words}{mark}") };
        let tell = |value: f64| if unit == COUNT { format!("{value}") } else { significant(value) };
        let line = format!("{name:width$}  {:>12}  {:>12}  {words}", tell(*coarse), tell(*fine));
        let _ = writeln!(text, "{}", line.trim_end());
        judged += usize::from(*is_judged);
        unsettled += usize::from(*is_judged && !settles);
    }
    let limit = 100.0 * SETTLED;
    let verdict = if unsettled == 0 {
        format!(
            "all {judged} stay within {limit:.0} % of the greatest of their kind: the mesh is fine enough for them"
        )
    } else {
        format!(
            "* {unsettled} of {judged} change by more than {limit:.0} % of the greatest of their kind: for them the mesh of the deck is too coarse, \
             and perhaps the finer one too"
        )
    };
    let _ = writeln!(text, "{verdict}\nfiner results in {}", fine.display());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_with_the_mesh_is_told_apart_from_what_stays() {
        let of = |name: &str, unit: &str, values| Compared {
            name: name.to_owned(),
            unit: unit.to_owned(),
            is_judged: ![COUNT, "%"].contains(&unit),
            values,
        };
        let all = [
            of("elements", COUNT, [8.0, 64.0]),
            of("stays", "J", [100.0, 101.0]),
            of("small", "J", [1.0, 1.5]),
            of("moves", "mm", [1.0, 1.5]),
            of("rests", "mm", [0.0; 2]),
            of("share", "%", [9.0, 2.0]),
        ];
        let table = table(&all, 2, Path::new("results/x-refined-2"));
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines[2].starts_with("elements  ") && lines[2].ends_with(" 64"), "{table}");
        assert!(lines[3].ends_with("+1.0 %") && lines[4].ends_with("+50.0 %"), "{table}");
        assert!(
            lines[5].ends_with("+50.0 %  *") && lines[6].ends_with("none") && lines[7].ends_with("-77.8 %"),
            "{table}"
        );
        assert!(lines[8].starts_with("* 1 of 4 change"), "{table}");
        assert!(table.ends_with("finer results in results/x-refined-2\n"));
    }
}
