//! What is still to be computed for a goal, and what was found: pure functions of the outcomes so far.
//!
//! Searches go in rounds: a round's points follow from the outcomes of those before it, whenever and wherever those were computed. So the
//! points, and with them the table, do not depend on machines, on what was computed before, or on interruptions.

use super::plan::{Goal, Point, Search, Study, Values};

/// Most rounds of a search: each halves the bracket at least, and numbers have no more bits.
const MOST_ROUNDS: usize = 200;

/// What is known of a point: the value of the goal's measure, or that its run failed.
pub type Known<'a> = dyn Fn(&Point) -> Option<Result<f64, ()>> + 'a;

/// Where a search stands.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// These points are needed next.
    Wants(Vec<Point>),
    /// It has ended.
    Found(Found),
}

/// How a search has ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// The measure reaches its number on one side of the bracket only. `rising` if that is the upper side.
    Limit { low: f64, high: f64, rising: bool },
    /// The least (or greatest) value of all points, and the bracket around it.
    Least { low: f64, high: f64, at: f64, value: f64 },
    /// The measure is on the same side of its number at both ends of the bracket.
    NoChange { reaches: bool },
    /// A run that the search needs has failed.
    Failed { at: f64 },
    /// A condition of the study excludes a point that the search needs.
    Excluded { at: f64 },
}

/// One search: where the other parameters stand, and which perturbation.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    pub values: Vec<f64>,
    pub sample: u32,
}

/// All searches of a study; none of a table.
pub fn searches(study: &Study) -> Vec<Site> {
    if study.goal.search().is_none() {
        return Vec::new();
    }
    let with_samples =
        |values: Vec<f64>| study.samples().map(move |sample| Site { values: values.clone(), sample });
    study.sites().iter().cloned().flat_map(with_samples).collect()
}

/// Points that are wanted next, those that are known among them not.
pub fn wanted(study: &Study, known: &Known<'_>) -> Vec<Point> {
    if study.goal == Goal::Table {
        let with_samples =
            |values: Vec<f64>| study.samples().map(move |sample| Point { values: values.clone(), sample });
        let points = study.sites().iter().cloned().flat_map(with_samples);
        return points.filter(|point| known(point).is_none()).collect();
    }
    let mut points: Vec<Point> = searches(study)
        .iter()
        .filter_map(|site| match step(study, site, known) {
            Step::Wants(points) => Some(points),
            Step::Found(_) => None,
        })
        .flatten()
        .filter(|point| known(point).is_none())
        .collect();
    points.sort();
    points.dedup();
    points
}

/// Where a search stands.
pub fn step(study: &Study, site: &Site, known: &Known<'_>) -> Step {
    match &study.goal {
        Goal::Table => Step::Wants(Vec::new()),
        Goal::Limit(search) => Searching { study, search, site, known }.limit(),
        Goal::Least { search, greatest } => Searching { study, search, site, known }.least(*greatest),
    }
}

struct Searching<'a> {
    study: &'a Study,
    search: &'a Search,
    site: &'a Site,
    known: &'a Known<'a>,
}

impl Searching<'_> {
    fn point(&self, at: f64) -> Point {
        let mut values = self.site.values.clone();
        values[self.search.parameter] = at;
        Point { values, sample: self.site.sample }
    }

    /// The bracket and the points inside of it, ascending and without equal ones.
    fn round(&self, low: f64, high: f64) -> Vec<f64> {
        let whole = matches!(
            self.study.parameters[self.search.parameter].values,
            Values::Between { whole: true, .. }
        );
        let parts = (self.search.probes + 1) as f64;
        let inside = (1..=self.search.probes).map(|k| {
            let at = low + (high - low) * (k as f64 / parts);
            if whole { at.round() } else { at }
        });
        let mut all: Vec<f64> = std::iter::once(low).chain(inside).chain([high]).collect();
        all.dedup();
        all
    }

    /// Values of the measure at points, or what is needed before they are known.
    fn values(&self, round: &[f64]) -> Result<Vec<f64>, Step> {
        let points: Vec<Point> = round.iter().map(|&at| self.point(at)).collect();
        if let Some(excluded) = points.iter().position(|point| !self.study.admits(&point.values)) {
            return Err(Step::Found(Found::Excluded { at: round[excluded] }));
        }
        let known: Vec<Option<Result<f64, ()>>> = points.iter().map(|point| (self.known)(point)).collect();
        if known.iter().any(Option::is_none) {
            return Err(Step::Wants(points));
        }
        let failed = |value: &Option<Result<f64, ()>>| matches!(value, Some(Err(())));
        match known.iter().position(failed) {
            Some(failed) => Err(Step::Found(Found::Failed { at: round[failed] })),
            None => Ok(known.into_iter().flatten().flatten().collect()),
        }
    }

    fn limit(&self) -> Step {
        let (mut low, mut high) = (self.search.from, self.search.to);
        for _ in 0..MOST_ROUNDS {
            let round = self.round(low, high);
            let values = match self.values(&round) {
                Ok(values) => values,
                Err(step) => return step,
            };
            let reaches: Vec<bool> = values.iter().map(|value| *value >= self.search.value).collect();
            let Some(first) = (1..reaches.len()).find(|&n| reaches[n] != reaches[0]) else {
                return Step::Found(Found::NoChange { reaches: reaches[0] });
            };
            let narrower = round[first] - round[first - 1] < high - low;
            (low, high) = (round[first - 1], round[first]);
            if high - low <= self.search.tolerance || !narrower {
                return Step::Found(Found::Limit { low, high, rising: !reaches[0] });
            }
        }
        Step::Found(Found::Limit { low, high, rising: true })
    }

    fn least(&self, greatest: bool) -> Step {
        let (mut low, mut high) = (self.search.from, self.search.to);
        loop {
            let round = self.round(low, high);
            let values = match self.values(&round) {
                Ok(values) => values,
                Err(step) => return step,
            };
            let better = |a: f64, b: f64| if greatest { a > b } else { a < b };
            let best =
                (1..values.len()).fold(0, |best, n| if better(values[n], values[best]) { n } else { best });
            let next = (round[best.saturating_sub(1)], round[(best + 1).min(round.len() - 1)]);
            let narrower = next.1 - next.0 < high - low;
            (low, high) = next;
            if high - low <= self.search.tolerance || !narrower {
                return Step::Found(Found::Least { low, high, at: round[best], value: values[best] });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::RefCell, collections::BTreeMap};

    use super::*;
    use crate::study::{measure::Formula, plan::Parameter};

    fn study(goal: Goal, whole: bool) -> Study {
        let parameter = |name: &str, values| Parameter { name: name.to_owned(), unit: String::new(), values };
        Study {
            file: String::new(),
            text: String::new(),
            title: String::new(),
            deck: "deck.toml".into(),
            options: deck::bundle::Options::default(),
            parameters: vec![
                parameter("t", Values::Each(vec![1.0, 2.0])),
                parameter("v", Values::Between { from: 0.0, to: 100.0, whole }),
            ],
            sampling: None,
            listed: Vec::new(),
            conditions: Vec::new(),
            texts_of_conditions: Vec::new(),
            measures: Vec::new(),
            goal,
            scatter: None,
            known_sites: std::sync::OnceLock::new(),
        }
    }

    fn search(probes: usize, tolerance: f64) -> Search {
        Search {
            name: "threshold",
            parameter: 1,
            measure: 0,
            value: 0.5,
            from: 0.0,
            to: 100.0,
            tolerance,
            probes,
        }
    }

    /// Computes what is wanted until nothing is, one of the wanted points at a time in an order of `turn`; gives the points and what was
    /// found.
    fn run(
        study: &Study,
        turn: usize,
        measure: impl Fn(&[f64]) -> Result<f64, ()>,
    ) -> (Vec<Point>, Vec<Found>) {
        let outcomes: RefCell<BTreeMap<Point, Result<f64, ()>>> = RefCell::default();
        let known = |point: &Point| outcomes.borrow().get(point).copied();
        loop {
            let wanted = wanted(study, &known);
            if wanted.is_empty() {
                break;
            }
            let next = wanted[turn % wanted.len()].clone();
            let value = measure(&next.values);
            assert!(outcomes.borrow_mut().insert(next, value).is_none(), "no point is computed twice");
        }
        let sites = searches(study);
        let found = sites.iter().map(|site| match step(study, site, &known) {
            Step::Found(found) => found,
            Step::Wants(points) => panic!("{points:?}"),
        });
        let found = found.collect();
        let points = outcomes.borrow().keys().cloned().collect();
        (points, found)
    }

    #[test]
    fn a_limit_lies_in_its_bracket_and_its_points_depend_on_no_order() {
        let study = study(Goal::Limit(search(3, 1.0)), false);
        let measure = |values: &[f64]| Ok(f64::from(u8::from(values[1] > 40.0 * values[0] - 3.3)));
        let (points, found) = run(&study, 0, measure);
        for (site, limit) in [(0, 36.7), (1, 76.7)] {
            let Found::Limit { low, high, rising: true } = found[site] else { panic!("{found:?}") };
            assert!(low < limit && limit < high && high - low <= 1.0, "{found:?}");
        }
        // Three probes quarter a bracket: 100, 25, 6.25, 1.56, 0.39.
        assert_eq!(points.len(), 2 * (2 + 4 * 3));
        for turn in 1..5 {
            assert_eq!(run(&study, turn, measure), (points.clone(), found.clone()));
        }
    }

    #[test]
    fn searches_end_where_nothing_changes_a_run_fails_or_a_number_is_whole() {
        let goal = Goal::Limit(search(1, 0.0));
        assert_eq!(
            run(&study(goal.clone(), false), 0, |_| Ok(1.0)).1,
            vec![Found::NoChange { reaches: true }; 2]
        );
        let fails = |values: &[f64]| if values[1] == 50.0 { Err(()) } else { Ok(values[1] / 100.0) };
        assert_eq!(run(&study(goal.clone(), false), 0, fails).1, vec![Found::Failed { at: 50.0 }; 2]);
        let falls = |values: &[f64]| Ok(f64::from(u8::from(values[1] < 61.5)));
        let whole = run(&study(goal.clone(), true), 0, falls).1;
        assert_eq!(whole, vec![Found::Limit { low: 61.0, high: 62.0, rising: false }; 2]);
        let exact = run(&study(goal, false), 0, falls).1;
        let Found::Limit { low, high, .. } = exact[0] else { panic!("{exact:?}") };
        assert_eq!(f64::from_bits(low.to_bits() + 1).to_bits(), high.to_bits(), "neighbours");
    }

    #[test]
    fn conditions_hold_for_points_of_searches_too() {
        let mut study = study(Goal::Limit(search(1, 1.0)), false);
        study.conditions = vec![Formula::parse("t * v < 150", &["t", "v"]).expect("a condition")];
        let (_, found) = run(&study, 0, |values| Ok(values[1] / 100.0));
        assert!(matches!(found[..], [Found::Limit { .. }, Found::Excluded { at: 100.0 }]), "{found:?}");
    }

    #[test]
    fn a_minimum_is_found_to_its_tolerance() {
        for (greatest, sign) in [(false, 1.0), (true, -1.0)] {
            let study = study(Goal::Least { search: search(3, 0.5), greatest }, false);
            let measure = |values: &[f64]| Ok(sign * (values[1] - 31.0 * values[0]).powi(2));
            let (_, found) = run(&study, 1, measure);
            for (site, expected) in [(0, 31.0), (1, 62.0)] {
                let Found::Least { low, high, at, .. } = found[site] else { panic!("{found:?}") };
                assert!((low..=high).contains(&expected) && f64::abs(at - expected) <= 0.5, "{found:?}");
            }
        }
    }
}
