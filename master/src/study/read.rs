//! The reader of study files: text becomes a [`Study`], or every fault of it with line and column.

use std::{collections::BTreeSet, path::Path};

use deck::{
    MAX_TITLE,
    bundle::Options,
    fault::{Fault, Faults},
    parameters::{MAX_PARAMETER, MAX_PARAMETERS, is_parameter},
    perturb::MAX_AMPLITUDE,
    table::{Range, Table, Value},
};
use toml::de::DeTable;

use super::{
    measure::{Formula, Measure, OF_SUMMARY},
    plan::{Goal, MAX_POINTS, Parameter, Sampling, Scatter, Search, Study, Values},
    sample::{Kind, MAX_DIMENSIONS},
};

/// Longest study file (bytes).
const MAX_TEXT: usize = 4 << 20;
const MAX_MEASURES: usize = 256;
const MAX_CONDITIONS: usize = 64;
/// Longest formula (bytes).
const MAX_FORMULA: usize = 1000;
/// Points inside a bracket of a goal that gives none.
const PROBES: u64 = 3;

/// Reads a study. `path` is where its file stands: its deck is named as seen from there.
///
/// # Errors
/// Every fault of it, ordered by place.
pub fn read(text: &str, path: &Path) -> Result<Study, Vec<Fault>> {
    let name = path.display().to_string();
    let faults = Faults::new(&name, text);
    if text.len() > MAX_TEXT {
        faults.add(
            0,
            format!("{} bytes of text", text.len()),
            format!("at most {MAX_TEXT}"),
            "split the study",
        );
        return Err(faults.into_list());
    }
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let at = error.span().map_or(0, |span| span.start);
        let message = error.message().trim().replace('\n', ", ");
        faults.add(at, format!("a syntax error ({message})"), "TOML", "mend the line");
    }
    if !errors.is_empty() {
        return Err(faults.into_list());
    }
    let study = read_document(document.get_ref(), path, &faults).map(|study| Study {
        file: name.clone(),
        text: text.to_owned(),
        ..study
    });
    match study {
        Some(study) if faults.count() == 0 => Ok(study),
        _ => Err(faults.into_list()),
    }
}

fn read_document<'a>(document: &'a DeTable<'a>, path: &Path, faults: &'a Faults<'a>) -> Option<Study> {
    let table = Table::new(document, 0, "the study".to_owned(), faults);
    let title = table.require("title", "a title in quotes").and_then(|value| {
        let text = value.text()?;
        if text.chars().count() > MAX_TITLE || text.chars().any(char::is_control) {
            value.fault(&format!("at most {MAX_TITLE} characters on one line"), "shorten it");
        }
        Some(text.to_owned())
    });
    let deck =
        table.require("deck", "the name of a deck's file, seen from the study's").and_then(|v| v.text());
    let options = Options {
        units: table.get("units").and_then(|v| v.text()).map(str::to_owned),
        case: table.get("case").and_then(|v| v.integer(0, u64::from(u32::MAX))).map(|case| case as u32),
        ..Options::default()
    };
    let parameters = read_parameters(&table);
    let names: Vec<&str> = parameters.iter().map(|(parameter, _)| parameter.name.as_str()).collect();
    let listed = table.get("points").map(|value| read_points(value, names.len())).unwrap_or_default();
    let conditions = table.get("where").map(|value| read_conditions(value, &names)).unwrap_or_default();
    let measures = read_measures(&table, &names);
    let goal = read_goal(&table, &parameters, &measures);
    let sampling = read_sampling(&table);
    let scatter = table.get("perturb").and_then(read_scatter);
    check_ranges(&table, &parameters, &goal, sampling.is_some(), listed.is_empty());
    table.finish();
    let study = Study {
        file: String::new(),
        text: String::new(),
        title: title?,
        deck: path.parent().unwrap_or(Path::new("")).join(deck?),
        options,
        parameters: parameters.into_iter().map(|(parameter, _)| parameter).collect(),
        sampling,
        listed,
        conditions: conditions.0,
        texts_of_conditions: conditions.1,
        measures,
        goal: goal?,
        scatter,
        known_sites: std::sync::OnceLock::new(),
    };
    if study.n_sites().is_none_or(|n| n > MAX_POINTS) {
        let read = "more points than a study may have";
        faults.add(0, read, format!("at most {MAX_POINTS} of grid, samples and list"), "take fewer values");
        return None;
    }
    Some(study)
}

/// Reads `[[parameter]]`, each with its place.
fn read_parameters(study: &Table<'_>) -> Vec<(Parameter, usize)> {
    let mut read: Vec<(Parameter, usize)> = Vec::new();
    let tables = study.tables("parameter", MAX_PARAMETERS);
    if tables.is_empty() && !study.has("parameter") {
        let expected = "at least one [[parameter]]";
        study.faults.add(0, "a study without [[parameter]]", expected, "name a parameter of the deck");
    }
    for table in tables {
        let at = table.at;
        let name = table.require("name", "a name in quotes").and_then(|value| {
            let name = value.text()?;
            if !is_parameter(name) {
                let expected =
                    format!("at most {MAX_PARAMETER} small letters, digits and underscores, a letter first");
                value.fault(&expected, "choose another name");
                return None;
            }
            if OF_SUMMARY.contains(&name) || read.iter().any(|(known, _)| known.name == name) {
                value.fault("a name that nothing else has", "choose another name");
                return None;
            }
            Some(name.to_owned())
        });
        let unit = read_unit(&table);
        let values = read_values(&table);
        table.finish();
        if let (Some(name), Some(values)) = (name, values) {
            read.push((Parameter { name, unit, values }, at));
        }
    }
    read
}

/// What a heading holds behind a name: no bracket, comma, quote or control character.
fn read_unit(table: &Table<'_>) -> String {
    let Some(value) = table.get("unit") else { return String::new() };
    let text = value.text().unwrap_or_default();
    if text.chars().count() > 20 || text.contains(['[', ']', ',', '"']) || text.chars().any(char::is_control)
    {
        value.fault("at most 20 characters without brackets, commas and quotes", "shorten it");
    }
    text.to_owned()
}

fn read_values(table: &Table<'_>) -> Option<Values> {
    let numbers = |value: Value<'_>| -> Option<Vec<f64>> {
        let items = value.items()?;
        let numbers: Option<Vec<f64>> = items.iter().map(|item| item.number(Range::Any)).collect();
        let numbers = numbers?;
        if numbers.is_empty() || numbers.len() > MAX_POINTS {
            value.fault(&format!("1 to {MAX_POINTS} numbers"), "change the list");
            return None;
        }
        let mut sorted = numbers.clone();
        sorted.sort_by(f64::total_cmp);
        if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            // Each point is computed once, so that the table would have fewer rows than the list has numbers.
            value.fault("numbers that differ", &format!("remove {} where it stands again", twice[0]));
            return None;
        }
        Some(numbers)
    };
    let whole = table.get("whole").map(|value| value.boolean()).unwrap_or(Some(false))?;
    let values = table.get("values");
    let (from, to, count) = (table.get("from"), table.get("to"), table.get("count"));
    if let Some(value) = values {
        for other in [from, to, count].into_iter().flatten() {
            other.fault("values, or from and to", "remove one of them");
        }
        return numbers(value).map(Values::Each);
    }
    let (from, to) = match (from, to) {
        (None, None) => {
            if let Some(count) = count {
                count.fault("from and to beside it", "add from = ... and to = ...");
                return None;
            }
            return Some(Values::Listed);
        }
        (Some(from), Some(to)) => (from.number(Range::Any), (to, to.number(Range::Any))),
        (Some(one), None) | (None, Some(one)) => {
            one.fault("both from and to", "add the other");
            return None;
        }
    };
    let (from, (place, Some(to))) = (from?, to) else { return None };
    if to <= from {
        place.fault(&format!("a number above from = {from}"), "exchange from and to");
        return None;
    }
    let range = Values::Between { from, to, whole };
    let Some(count) = count else { return Some(range) };
    let count = count.integer(2, MAX_POINTS as u64)?;
    let mut each: Vec<f64> = (0..count).map(|n| range.at(n as f64 / (count - 1) as f64)).collect();
    each.dedup();
    Some(Values::Each(each))
}

/// Reads `points`: lists of a number for each parameter.
fn read_points(value: Value<'_>, n_parameters: usize) -> Vec<Vec<f64>> {
    let Some(items) = value.items() else { return Vec::new() };
    if items.len() > MAX_POINTS {
        value.fault(&format!("at most {MAX_POINTS} points"), "split the study");
        return Vec::new();
    }
    let point = |item: Value<'_>| {
        let numbers = item.items()?;
        if numbers.len() != n_parameters {
            item.fault(&format!("{n_parameters} numbers, one for each [[parameter]]"), "complete the point");
            return None;
        }
        numbers.iter().map(|number| number.number(Range::Any)).collect()
    };
    items.into_iter().filter_map(point).collect()
}

/// Reads a formula over these names.
fn read_formula(value: Value<'_>, names: &[&str]) -> Option<(Formula, String)> {
    let text = value.text()?;
    if text.len() > MAX_FORMULA {
        value.fault(&format!("at most {MAX_FORMULA} characters"), "make several measures of it");
        return None;
    }
    match Formula::parse(text, names) {
        Ok(formula) => Some((formula, text.to_owned())),
        Err(why) => {
            value.fault(
                &format!("an expression, a comparison, or one of: {}", super::measure::PHRASES),
                &why.to_string(),
            );
            None
        }
    }
}

/// Conditions, and their words.
fn read_conditions(value: Value<'_>, names: &[&str]) -> (Vec<Formula>, Vec<String>) {
    let Some(items) = value.items() else { return Default::default() };
    if items.len() > MAX_CONDITIONS {
        value.fault(&format!("at most {MAX_CONDITIONS} conditions"), "join some with \" and \"");
        return Default::default();
    }
    let condition = |item: Value<'_>| {
        let (formula, text) = read_formula(item, names)?;
        if !formula.is_comparison() || !formula.is_of_parameters() {
            item.fault(
                "a comparison of parameters such as \"thickness < 2 * radius\"",
                "change the condition",
            );
            return None;
        }
        Some((formula, text))
    };
    items.into_iter().filter_map(condition).unzip()
}

/// Reads `[[measure]]`.
fn read_measures(study: &Table<'_>, parameters: &[&str]) -> Vec<Measure> {
    let mut measures: Vec<Measure> = Vec::new();
    let tables = study.tables("measure", MAX_MEASURES);
    if tables.is_empty() && !study.has("measure") {
        let expected = "at least one [[measure]]";
        study.faults.add(0, "a study without [[measure]]", expected, "say what is wanted of each run");
    }
    // A measure that is faulty may be meant by others all the same.
    let mut faulty: Vec<String> = Vec::new();
    for table in tables {
        let known: Vec<&str> = parameters.iter().copied().chain(OF_SUMMARY).collect();
        let earlier: Vec<&str> = measures.iter().map(|m| m.name.as_str()).collect();
        let name = table.require("name", "a name in quotes").and_then(|value| {
            let name = value.text()?;
            if !is_parameter(name) {
                let expected =
                    format!("at most {MAX_PARAMETER} small letters, digits and underscores, a letter first");
                value.fault(&expected, "choose another name");
                return None;
            }
            if known.contains(&name) || earlier.contains(&name) {
                value.fault("a name that nothing else has", "choose another name");
                return None;
            }
            Some(name.to_owned())
        });
        let unit = read_unit(&table);
        let names: Vec<&str> =
            known.into_iter().chain(earlier).chain(faulty.iter().map(String::as_str)).collect();
        let of = table.require("of", "what it is, such as \"max(rear:uz)\" or \"perforated\"");
        let read = of.and_then(|value| read_formula(value, &names));
        let at = of.map_or(table.at, |value| value.at);
        table.finish();
        match (name, read) {
            (Some(name), Some((formula, words))) => measures.push(Measure { name, unit, formula, at, words }),
            (Some(name), None) => faulty.push(name),
            _ => {}
        }
    }
    measures
}

const GOALS: [&str; 5] = ["table", "ballistic-limit", "threshold", "minimum", "maximum"];

/// Reads `[goal]`; a table without one.
fn read_goal(study: &Table<'_>, parameters: &[(Parameter, usize)], measures: &[Measure]) -> Option<Goal> {
    let Some(value) = study.get("goal") else { return Some(Goal::Table) };
    let table = value.table("[goal]".to_owned())?;
    let kind = table.require("kind", &format!("one of {}", GOALS.join(", "))).and_then(|v| v.one_of(&GOALS));
    if kind == Some(0) {
        table.finish();
        return Some(Goal::Table);
    }
    let parameter =
        table.require("parameter", "the name of the [[parameter]] to search along").and_then(|value| {
            let name = value.text()?;
            let found = parameters.iter().position(|(known, _)| known.name == name);
            if found.is_none() {
                let known: Vec<&str> = parameters.iter().map(|(known, _)| known.name.as_str()).collect();
                value.fault(&format!("one of {}", known.join(", ")), "name a [[parameter]]");
                return None;
            }
            if let Some((Parameter { values: Values::Between { from, to, .. }, .. }, _)) =
                found.map(|n| &parameters[n])
            {
                return found.map(|found| (found, *from, *to));
            }
            value.fault("a parameter with from and to, and no count", "give it a range to search");
            None
        });
    let measure = table.require("measure", "the name of a [[measure]]").and_then(|value| {
        let name = value.text()?;
        let found = measures.iter().position(|known| known.name == name);
        if found.is_none() {
            let known: Vec<&str> = measures.iter().map(|known| known.name.as_str()).collect();
            value.fault(&format!("one of {}", known.join(", ")), "name a [[measure]]");
        }
        if kind == Some(1) && found.is_some_and(|found| !measures[found].formula.is_comparison()) {
            value.fault(
                "a measure that says yes or no",
                "compare it, as in \"residual > 0\", or seek a threshold",
            );
            return None;
        }
        found
    });
    let tolerance = table.number("tolerance", Range::Positive);
    let probes =
        table.integer_or("probes", PROBES, if kind.is_some_and(|kind| kind > 2) { 3 } else { 1 }, 1000);
    let value = match kind {
        Some(2) => table.number("value", Range::Any),
        _ => Some(0.5),
    };
    table.finish();
    let kind = kind?;
    let (parameter, from, to) = parameter?;
    let name = ["table", "ballistic limit", "threshold", "minimum", "maximum"][kind];
    let search = Search {
        name,
        parameter,
        measure: measure?,
        value: value?,
        from,
        to,
        tolerance: tolerance?,
        probes: probes as usize,
    };
    Some(match kind {
        1 | 2 => Goal::Limit(search),
        _ => Goal::Least { search, greatest: kind == 4 },
    })
}

/// Reads `[sample]`.
fn read_sampling(study: &Table<'_>) -> Option<Sampling> {
    const KINDS: [&str; 2] = ["latin-hypercube", "sobol"];
    let table = study.get("sample").and_then(|value| value.table("[sample]".to_owned()))?;
    let kind = table.require("kind", &format!("one of {}", KINDS.join(", "))).and_then(|v| v.one_of(&KINDS));
    let count = table.require("count", "a number of points").and_then(|v| v.integer(1, MAX_POINTS as u64));
    let seed = table.integer_or("seed", 0, 0, i64::MAX as u64);
    table.finish();
    let kind = if kind? == 0 { Kind::LatinHypercube } else { Kind::Sobol };
    Some(Sampling { kind, count: count? as usize, seed })
}

/// Reads `perturb`.
fn read_scatter(value: Value<'_>) -> Option<Scatter> {
    let table = value.table("perturb".to_owned())?;
    let words = "a number above 0 and at most 1e-3";
    let nodes = table.number("nodes", Range::Within(0.0, MAX_AMPLITUDE, words));
    let samples = table.require("samples", "a number of samples").and_then(|v| v.integer(1, 10_000));
    let seed = table.integer_or("seed", 0, 0, i64::MAX as u64);
    table.finish();
    Some(Scatter { nodes: nodes?, samples: samples? as u32, seed })
}

/// Every parameter must have values: its own, those of samples, of the search, or of listed points.
fn check_ranges(
    study: &Table<'_>,
    parameters: &[(Parameter, usize)],
    goal: &Option<Goal>,
    is_sampled: bool,
    none_listed: bool,
) {
    // Of a faulty goal it is not known what it searches.
    let Some(goal) = goal else { return };
    let searched = goal.search().map(|search| search.parameter);
    let mut ranges = BTreeSet::new();
    for (index, (Parameter { name, values, .. }, at)) in parameters.iter().enumerate() {
        match values {
            Values::Between { .. } if Some(index) != searched => {
                ranges.insert(index);
                if !is_sampled {
                    study.faults.add(
                        *at,
                        format!("parameter {name} with a range alone"),
                        "a count, a list of values, [sample], or a goal that searches it",
                        "add count = ... for a grid",
                    );
                }
            }
            Values::Listed if none_listed => {
                let expected = "values, from and to, or points = [[...], ...]";
                let advice = "add values = [...]";
                study.faults.add(*at, format!("parameter {name} without values"), expected, advice);
            }
            _ => {}
        }
    }
    let at = study.get("sample").map_or(0, |value| value.at);
    if is_sampled && ranges.is_empty() {
        let expected = "a parameter with from and to, and no count";
        study.faults.add(
            at,
            "[sample] and no parameter with a range alone",
            expected,
            "remove [sample] or a count",
        );
    }
    if ranges.len() > MAX_DIMENSIONS {
        let read = format!("{} sampled parameters", ranges.len());
        study.faults.add(at, read, format!("at most {MAX_DIMENSIONS}"), "give some of them values");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::plan::Point;

    const MEASURE: &str = "[[measure]]\nname = \"m\"\nof = \"max(rear:uz)\"\n";

    fn faults(text: &str) -> Vec<String> {
        let faults = read(text, Path::new("a/study.toml")).expect_err(text);
        faults.iter().map(ToString::to_string).collect()
    }

    fn good(text: &str) -> Study {
        let text = format!("title = \"t\"\ndeck = \"d.toml\"\n{text}");
        read(&text, Path::new("a/study.toml")).unwrap_or_else(|faults| {
            panic!("{}", faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
        })
    }

    #[test]
    fn grids_lists_and_samples_multiply_and_conditions_leave_points_out() {
        let study = good(&format!(
            "points = [[9, 9, 0.5]]\nwhere = [\"a * b < 12\"]\n[[parameter]]\nname = \"a\"\nvalues = [1, 2, 3]\n[[parameter]]\nname = \"b\"\n\
             from = 2\nto = 4\ncount = 3\n[[parameter]]\nname = \"c\"\nfrom = 0\nto = 1\n[sample]\nkind = \"sobol\"\ncount = 4\n{MEASURE}"
        ));
        assert_eq!(study.deck, Path::new("a/d.toml"));
        assert_eq!(study.n_sites(), Some(3 * 3 * 4 + 1));
        let sites = study.sites();
        // 3 x 4 is not below 12, nor is 9 x 9.
        assert_eq!(sites.len(), 8 * 4);
        assert!(sites.windows(2).all(|w| {
            let point = |n: usize| Point { values: w[n].clone(), sample: 0 };
            point(0) < point(1)
        }));
        assert!(sites.iter().all(|site| site[0] * site[1] < 12.0 && (0.0..1.0).contains(&site[2])));
    }

    #[test]
    fn every_fault_of_a_study_is_told_with_its_place() {
        let found = faults(
            "title = \"t\"\ndek = \"d.toml\"\n[[parameter]]\nname = \"Speed\"\nvalues = [1, \"x\"]\n[[parameter]]\nname = \"t\"\nfrom = 3\nto = 1\n\
             [[measure]]\nname = \"m\"\nof = \"max(rear:uz) / thicknes\"\n[goal]\nkind = \"balistic-limit\"\n",
        );
        let starts = [
            "a/study.toml:1:1: read the study without \"deck\"; expected the name of a deck's file",
            "a/study.toml:2:1: read unknown key \"dek\" in the study",
            "a/study.toml:4:8: read name = \"Speed\"; expected at most 32 small letters",
            "a/study.toml:5:14: read values = \"x\"; expected a finite number",
            "a/study.toml:9:6: read to = 1; expected a number above from = 3; exchange from and to",
            "a/study.toml:12:6: read of = \"max(rear:uz) / thicknes\"; expected an expression",
            "a/study.toml:13:1: read [goal] without \"parameter\"",
            "a/study.toml:13:1: read [goal] without \"measure\"",
            "a/study.toml:13:1: read [goal] without \"tolerance\"",
            "a/study.toml:14:8: read kind = \"balistic-limit\"; expected one of table, ballistic-limit",
        ];
        assert_eq!(found.len(), starts.len(), "{found:#?}");
        for (fault, start) in found.iter().zip(starts) {
            assert!(fault.starts_with(start), "{fault}\n{start}");
        }
        assert!(faults("title = \n")[0].starts_with("a/study.toml:1:9: read a syntax error"));
    }

    #[test]
    fn no_damage_of_a_study_is_more_than_a_fault() {
        let text = "title = \"t\"\ndeck = \"d.toml\"\npoints = [[1, 2]]\nwhere = [\"a * (b - 1) < 12\"]\nperturb = { nodes = 1e-9, samples = 2 }\n\
                    [[parameter]]\nname = \"a\"\nfrom = 1\nto = 3\n[[parameter]]\nname = \"b\"\nvalues = [2]\n[[measure]]\nname = \"m\"\n\
                    of = \"max(rear:uz) > min(a, b) and perforated by x through y\"\n[goal]\nkind = \"ballistic-limit\"\nparameter = \"a\"\n\
                    measure = \"m\"\ntolerance = 1\n";
        let path = Path::new("s.toml");
        let mut random = 1;
        assert!(read(text, path).is_ok());
        for at in 0..text.len() {
            let mut bytes = text.as_bytes().to_vec();
            random = mechanics::draw::mixed(random);
            bytes[at] = b"()[]{}<>=\"#.,e-0 \n$~"[random as usize % 20];
            for piece in [&bytes[..], &bytes[..at]] {
                let text = std::str::from_utf8(piece).expect("letters of ASCII");
                if let Ok(study) = read(text, path) {
                    assert!(study.sites().len() <= MAX_POINTS);
                }
            }
        }
    }

    #[test]
    fn parameters_without_a_value_and_goals_without_a_range_are_faults() {
        let head = "title = \"t\"\ndeck = \"d.toml\"\n";
        for (text, words) in [
            ("[[parameter]]\nname = \"a\"\n", "3:1: read parameter a without values"),
            ("[[parameter]]\nname = \"a\"\nfrom = 1\nto = 2\n", "3:1: read parameter a with a range alone"),
            (
                "[[parameter]]\nname = \"a\"\nvalues = [100, 2, 100]\n",
                "5:10: read values = [100, 2, 100]; expected numbers that differ; remove 100",
            ),
            ("[[parameter]]\nname = \"a\"\nfrom = 1\n", "5:8: read from = 1; expected both from and to"),
            (
                "[[parameter]]\nname = \"a\"\nvalues = [1]\nto = 2\n",
                "6:6: read to = 2; expected values, or from and to",
            ),
            (
                "[[parameter]]\nname = \"a\"\nvalues = [1]\n[goal]\nkind = \"threshold\"\nparameter = \"a\"\nmeasure = \"m\"\nvalue = 1\ntolerance = 1\n",
                "8:13: read parameter = \"a\"; expected a parameter with from and to, and no count",
            ),
            (
                "[[parameter]]\nname = \"a\"\nfrom = 1\nto = 2\n[goal]\nkind = \"ballistic-limit\"\nparameter = \"a\"\nmeasure = \"m\"\ntolerance = 1\n",
                "10:11: read measure = \"m\"; expected a measure that says yes or no",
            ),
            (
                "where = [\"a < max(rear:uz)\"]\n[[parameter]]\nname = \"a\"\nvalues = [1]\n",
                "3:10: read where = \"a < max(rear:uz)\"; expected a comparison of parameters",
            ),
            (
                "points = [[1, 2]]\n[[parameter]]\nname = \"a\"\n",
                "3:11: read points = [1, 2]; expected 1 numbers",
            ),
            (
                "[[parameter]]\nname = \"cycles\"\nvalues = [1]\n",
                "4:8: read name = \"cycles\"; expected a name that nothing else has",
            ),
            (
                "[[parameter]]\nname = \"a\"\nvalues = [1]\n[sample]\nkind = \"sobol\"\ncount = 3\n",
                "6:1: read [sample] and no parameter with a range alone",
            ),
            (
                "perturb = { nodes = 1, samples = 2 }\n[[parameter]]\nname = \"a\"\nvalues = [1]\n",
                "3:21: read nodes = 1; expected a number above 0 and at most 1e-3",
            ),
        ] {
            let found = faults(&format!("{head}{text}{MEASURE}"));
            assert!(found.iter().any(|fault| fault.contains(words)), "{words}\n{found:#?}");
        }
    }
}
