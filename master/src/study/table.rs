//! What a study leaves as tables: `table.csv` with a row for each run, `goal.csv` with a row for each search, `scatter.csv` with a row for
//! each measure of each point that was perturbed.
//!
//! Rows are ordered by the values of the parameters, and every number is the shortest decimal that reads back to the same bits. Nothing in them
//! depends on who computed what and when, so two studies can be compared as files.

use std::{collections::BTreeMap, fmt::Write as _};

use super::{
    goal::{self, Found, Site, Step},
    plan::{Goal, Point, Scatter, Study},
};

pub const TABLE: &str = "table.csv";
pub const GOAL: &str = "goal.csv";
pub const SCATTER: &str = "scatter.csv";

/// What is known of a run that is over.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It came to its end.
    Done(Row),
    /// It did not, and why.
    Failed(String),
}

impl Outcome {
    /// Whether the run came to its end and every measure of it has a value.
    pub fn is_whole(&self) -> bool {
        matches!(self, Self::Done(row) if row.values.iter().all(Result::is_ok))
    }
}

/// The results of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// By measure, or why it has none.
    pub values: Vec<Result<f64, String>>,
    pub cycles: u64,
    pub digest: String,
    /// By measure, the gauge that had not perforated and yet moved on at the end, if there is one ([`Formula::still_moving`]).
    ///
    /// [`Formula::still_moving`]: super::measure::Formula::still_moving
    pub still_moving: Vec<Option<String>>,
}

/// Outcomes by point.
pub type Outcomes = BTreeMap<Point, Outcome>;

/// What a search comes to know of a point.
pub fn known<'a>(
    study: &'a Study,
    outcomes: &'a Outcomes,
) -> impl Fn(&Point) -> Option<Result<f64, ()>> + 'a {
    move |point| {
        let measure = study.goal.search().map_or(0, |search| search.measure);
        Some(match outcomes.get(point)? {
            Outcome::Done(row) => row.values[measure].as_ref().copied().map_err(|_| ()),
            Outcome::Failed(_) => Err(()),
        })
    }
}

/// Where every search stands, in order.
pub fn found(study: &Study, outcomes: &Outcomes) -> Vec<(Site, Option<Found>)> {
    let known = known(study, outcomes);
    let of = |site: Site| {
        let found = match goal::step(study, &site, &known) {
            Step::Found(found) => Some(found),
            Step::Wants(_) => None,
        };
        (site, found)
    };
    goal::searches(study).into_iter().map(of).collect()
}

/// `velocity [m/s]`.
pub fn heading(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

fn parameters(study: &Study, without: Option<usize>) -> Vec<String> {
    let all = study.parameters.iter().enumerate().filter(|(index, _)| Some(*index) != without);
    all.map(|(_, parameter)| heading(&parameter.name, &parameter.unit)).collect()
}

fn numbers(values: &[f64], without: Option<usize>) -> Vec<String> {
    let all = values.iter().enumerate().filter(|(index, _)| Some(*index) != without);
    all.map(|(_, value)| format!("{value:?}")).collect()
}

fn line(cells: &[String]) -> String {
    let mut line = cells.join(",");
    line.push('\n');
    line
}

/// `table.csv`.
pub fn table(study: &Study, outcomes: &Outcomes) -> String {
    let mut header = parameters(study, None);
    header.extend(study.scatter.map(|_| "sample".to_owned()));
    header.extend(study.measures.iter().map(|measure| heading(&measure.name, &measure.unit)));
    header.extend(["cycles", "digest", "state"].map(str::to_owned));
    let mut text = line(&header);
    for (point, outcome) in outcomes {
        let mut cells = numbers(&point.values, None);
        cells.extend(study.scatter.map(|_| point.sample.to_string()));
        match outcome {
            Outcome::Done(Row { values, cycles, digest, still_moving: _ }) => {
                let cell = |value: &Result<f64, String>| {
                    value.as_ref().map_or_else(|_| String::new(), |value| format!("{value:?}"))
                };
                cells.extend(values.iter().map(cell));
                let state = if outcome.is_whole() { "done" } else { "incomplete" };
                cells.extend([cycles.to_string(), digest.clone(), state.to_owned()]);
            }
            Outcome::Failed(_) => {
                cells.extend(study.measures.iter().map(|_| String::new()));
                cells.extend(["", "", "failed"].map(str::to_owned));
            }
        }
        text.push_str(&line(&cells));
    }
    text
}

/// What a search found, in a word and four numbers: the bracket, where it is thought to be, and the value there.
pub fn told(found: Option<&Found>) -> (&'static str, [Option<f64>; 4]) {
    match found {
        Some(&Found::Limit { low, high, rising }) => {
            let word = if rising { "reached above" } else { "reached below" };
            (word, [Some(low), Some(high), Some(low + (high - low) / 2.0), None])
        }
        Some(&Found::Least { low, high, at, value }) => {
            ("found", [Some(low), Some(high), Some(at), Some(value)])
        }
        Some(Found::NoChange { reaches: true }) => ("reached at both ends", [None; 4]),
        Some(Found::NoChange { reaches: false }) => ("reached at neither end", [None; 4]),
        Some(Found::Failed { at }) => ("a run failed", [None, None, Some(*at), None]),
        Some(Found::Excluded { at }) => ("excluded by a condition", [None, None, Some(*at), None]),
        None => ("not ended", [None; 4]),
    }
}

/// What a search found in words, as [`told`], and whether the run that it rests on may have been too short.
pub fn result(study: &Study, outcomes: &Outcomes, site: &Site, found: Option<&Found>) -> String {
    let word = told(found).0;
    if is_too_short(study, outcomes, site, found) { format!("{word}; {TOO_SHORT}") } else { word.to_owned() }
}

/// Behind the result of a search whose "no" is not sure.
const TOO_SHORT: &str = "runs may be too short";

fn is_too_short(study: &Study, outcomes: &Outcomes, site: &Site, found: Option<&Found>) -> bool {
    let Some(search) = study.goal.search() else { return false };
    let is_moving = |at: f64| {
        let mut values = site.values.clone();
        values[search.parameter] = at;
        match outcomes.get(&Point { values, sample: site.sample }) {
            Some(Outcome::Done(row)) => row.still_moving[search.measure].is_some(),
            _ => false,
        }
    };
    match found {
        Some(&Found::Limit { low, high, rising }) => is_moving(if rising { low } else { high }),
        Some(Found::NoChange { reaches: false }) => is_moving(search.from) || is_moving(search.to),
        _ => false,
    }
}

/// `goal.csv`; none for a table.
pub fn goal(study: &Study, outcomes: &Outcomes) -> Option<String> {
    let search = study.goal.search()?;
    let searched = &study.parameters[search.parameter];
    let mut header = parameters(study, Some(search.parameter));
    header.extend(study.scatter.map(|_| "sample".to_owned()));
    header.extend(
        ["low", "high", "at"].map(|what| heading(&format!("{} {what}", searched.name), &searched.unit)),
    );
    let measure = &study.measures[search.measure];
    if matches!(study.goal, Goal::Least { .. }) {
        header.push(heading(&measure.name, &measure.unit));
    }
    header.push("result".to_owned());
    let mut text = line(&header);
    for (site, found) in found(study, outcomes) {
        let (_, [low, high, at, value]) = told(found.as_ref());
        let mut cells = numbers(&site.values, Some(search.parameter));
        cells.extend(study.scatter.map(|_| site.sample.to_string()));
        let cell = |number: Option<f64>| number.map_or_else(String::new, |number| format!("{number:?}"));
        cells.extend([low, high, at].map(cell));
        if matches!(study.goal, Goal::Least { .. }) {
            cells.push(cell(value));
        }
        cells.push(result(study, outcomes, &site, found.as_ref()));
        text.push_str(&line(&cells));
    }
    Some(text)
}

/// An interval of a number over perturbations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The run without a perturbation, if it came to its end.
    pub plain: Option<f64>,
    pub least: f64,
    pub greatest: f64,
    pub mean: f64,
    /// Standard deviation of a sample; 0 of one.
    pub deviation: f64,
    pub count: usize,
}

impl Interval {
    /// Of numbers, the one without a perturbation apart; none of no numbers.
    pub fn of(plain: Option<f64>, numbers: &[f64]) -> Option<Self> {
        if numbers.is_empty() {
            return None;
        }
        let n = numbers.len() as f64;
        // Deviations from one of the numbers lose no digits where all are nearly equal.
        let first = numbers[0];
        let mean = numbers.iter().map(|x| x - first).sum::<f64>() / n;
        let squares = numbers.iter().map(|x| (x - first - mean) * (x - first - mean)).sum::<f64>();
        Some(Self {
            plain,
            least: numbers.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean: first + mean,
            deviation: if numbers.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 },
            count: numbers.len(),
        })
    }

    /// The width relative to the greatest magnitude, over the amplitude of the perturbation: how much an output amplifies what nobody can
    /// measure.
    pub fn amplification(&self, scatter: Scatter) -> f64 {
        let greatest = self.least.abs().max(self.greatest.abs());
        if greatest > 0.0 { (self.greatest - self.least) / greatest / scatter.nodes } else { 0.0 }
    }
}

/// Values of the parameters, a name with its unit, and the interval of it: of every measure of a table, of what a goal seeks.
pub fn intervals(study: &Study, outcomes: &Outcomes) -> Vec<(Vec<f64>, String, Interval)> {
    if study.scatter.is_none() {
        return Vec::new();
    }
    let mut list = Vec::new();
    let mut put = |values: &[f64], name: String, all: &[(u32, f64)]| {
        let plain = all.iter().find(|(sample, _)| *sample == 0).map(|(_, value)| *value);
        let perturbed: Vec<f64> =
            all.iter().filter(|(sample, _)| *sample > 0).map(|(_, value)| *value).collect();
        list.extend(Interval::of(plain, &perturbed).map(|interval| (values.to_vec(), name, interval)));
    };
    if let Some(search) = study.goal.search() {
        let parameter = &study.parameters[search.parameter];
        let found = found(study, outcomes);
        for site in found.chunk_by(|(a, _), (b, _)| a.values == b.values) {
            let at = |(site, found): &(Site, Option<Found>)| match told(found.as_ref()) {
                (_, [Some(_), _, Some(at), _]) => Some((site.sample, at)),
                _ => None,
            };
            let all: Vec<(u32, f64)> = site.iter().filter_map(at).collect();
            put(
                &site[0].0.values,
                heading(&format!("{} of {}", search.name, parameter.name), &parameter.unit),
                &all,
            );
        }
        return list;
    }
    let runs: Vec<(&Point, &Outcome)> = outcomes.iter().collect();
    for of_point in runs.chunk_by(|(a, _), (b, _)| a.values == b.values) {
        for (index, measure) in study.measures.iter().enumerate() {
            let value = |(point, outcome): &(&Point, &Outcome)| match outcome {
                Outcome::Done(row) => Some((point.sample, *row.values[index].as_ref().ok()?)),
                Outcome::Failed(_) => None,
            };
            let all: Vec<(u32, f64)> = of_point.iter().filter_map(value).collect();
            put(&of_point[0].0.values, heading(&measure.name, &measure.unit), &all);
        }
    }
    list
}

/// `scatter.csv`; none of a study that perturbs nothing.
pub fn scatter(study: &Study, outcomes: &Outcomes) -> Option<String> {
    let scatter = study.scatter?;
    let searched = study.goal.search().map(|search| search.parameter);
    let mut header = parameters(study, searched);
    let columns = ["of", "unperturbed", "least", "greatest", "mean", "deviation", "samples", "amplification"];
    header.extend(columns.map(str::to_owned));
    let mut text = line(&header);
    for (values, name, interval) in intervals(study, outcomes) {
        let Interval { plain, least, greatest, mean, deviation, count } = interval;
        let mut cells = numbers(&values, searched);
        cells.push(name);
        cells.push(plain.map_or_else(String::new, |plain| format!("{plain:?}")));
        cells.extend([least, greatest, mean, deviation].map(|number| format!("{number:?}")));
        cells.push(count.to_string());
        let _ = write!(
            text,
            "{}",
            line(&[cells, vec![format!("{:?}", interval.amplification(scatter))]].concat())
        );
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_of_nearly_equal_numbers_lose_no_digits() {
        let near = |n: i64| 1.0 + n as f64 * f64::EPSILON;
        let interval = Interval::of(Some(1.0), &[near(1), near(2), near(3)]).expect("three numbers");
        assert_eq!((interval.mean, interval.deviation), (near(2), f64::EPSILON));
        assert_eq!((interval.least, interval.greatest, interval.count), (near(1), near(3), 3));
        let scatter = Scatter { nodes: f64::EPSILON, samples: 3, seed: 0 };
        assert!((interval.amplification(scatter) - 2.0).abs() < 1e-9);
        assert_eq!(Interval::of(None, &[]), None);
    }
}
