//! The course of a study: which points are known, wait, or are under way. One thread owns all of it.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use deck::fault::{Faults, short};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::{
    cache::{Cache, FILES},
    goal,
    measure::{self, Facts},
    place::{Finished, Place, RunError, Task},
    plan::{Point, Study},
    prepare::{self, Prepared, prepare},
    table::{self, Outcome, Outcomes, Row},
};
use crate::{
    results::{Summary, history::Table},
    shell::{print, tell},
};

/// Faults of a deck that are printed at most.
const MOST_FAULTS: usize = 100;
/// Warnings of decks that are printed at most.
const MOST_WARNINGS: usize = 30;

/// What a study has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Runs that were computed.
    pub computed: usize,
    pub element_cycles: u64,
    /// Runs that the cache answered.
    pub answered: usize,
}

/// A study under way.
pub struct Course<'a> {
    study: &'a Study,
    cache: Arc<Cache>,
    outcomes: Outcomes,
    /// In the order in which they begin.
    waiting: VecDeque<Task>,
    under_way: BTreeMap<Point, Arc<Prepared>>,
    /// Points that were made ready before the first run.
    ready: BTreeMap<Point, Arc<Prepared>>,
    pub tally: Tally,
}

/// Of a study without a point: how many of the points each of its conditions admits.
fn excluded(study: &Study) -> String {
    let sites = study.sites_before_conditions();
    let admitted = study.conditions.iter().zip(&study.texts_of_conditions).map(|(condition, text)| {
        let admitted = sites.iter().filter(|site| study.admits_by(condition, site)).count();
        format!("{text:?} admits {admitted}")
    });
    let admitted: Vec<String> = admitted.collect();
    format!(
        "{}: the conditions of the study exclude every point: of {} {}; change where, or the values",
        study.file,
        sites.len(),
        admitted.join(", ")
    )
}

impl<'a> Course<'a> {
    /// A study of which nothing is known.
    pub fn new(study: &'a Study, cache: Arc<Cache>) -> Self {
        Self {
            study,
            cache,
            outcomes: Outcomes::new(),
            waiting: VecDeque::new(),
            under_way: BTreeMap::new(),
            ready: BTreeMap::new(),
            tally: Tally::default(),
        }
    }

    /// Reads the decks of the points that are wanted first, and checks the measures against them.
    ///
    /// # Errors
    /// Every fault of every deck, each once, with a point that has it; those of measures.
    pub fn begin(&mut self) -> Result<(), String> {
        let wanted = self.wanted();
        if wanted.is_empty() {
            return Err(excluded(self.study));
        }
        let mut faults: BTreeMap<String, (usize, &Point)> = BTreeMap::new();
        let mut n_faulty = 0;
        let all = prepare_all(self.study, &wanted);
        for (point, prepared) in wanted.iter().zip(all) {
            match prepared {
                Ok(prepared) => {
                    self.ready.insert(point.clone(), Arc::new(prepared));
                }
                Err(prepare::Error::Faults(list)) => {
                    n_faulty += 1;
                    for fault in list {
                        faults.entry(fault.to_string()).or_insert((0, point)).0 += 1;
                    }
                }
                Err(why) => return Err(why.to_string()),
            }
        }
        if !faults.is_empty() {
            let lines = faults.iter().take(MOST_FAULTS).map(|(fault, (count, point))| {
                let at = words(self.study, &point.values, None);
                if *count == 1 {
                    format!("{fault} (at {at})")
                } else {
                    format!("{fault} (at {at} and {} more)", count - 1)
                }
            });
            let lines: Vec<String> = lines.collect();
            let n = wanted.len();
            return Err(format!(
                "{} fault{} in the deck at {n_faulty} of {n} points\n{}",
                faults.len(),
                if faults.len() == 1 { "" } else { "s" },
                lines.join("\n")
            ));
        }
        check_measures(self.study, &self.ready)?;
        self.warn();
        Ok(())
    }

    /// Tells what is doubtful in the decks, each warning once, with a point that has it where others have not.
    fn warn(&self) {
        let mut warnings: BTreeMap<&str, (usize, &Point)> = BTreeMap::new();
        for (point, prepared) in &self.ready {
            for warning in &prepared.warnings {
                warnings.entry(warning).or_insert((0, point)).0 += 1;
            }
        }
        for (warning, (count, point)) in warnings.iter().take(MOST_WARNINGS) {
            let at = words(self.study, &point.values, None);
            match count {
                count if *count == self.ready.len() => tell(&format!("warning: {warning}")),
                1 => tell(&format!("warning: {warning} (at {at})")),
                count => tell(&format!("warning: {warning} (at {at} and {} more)", count - 1)),
            }
        }
        if let Some(more) = warnings.len().checked_sub(MOST_WARNINGS).filter(|more| *more > 0) {
            tell(&format!("and {more} warnings more, which bolide check tells of each point"));
        }
    }

    /// Prints the points that are known so far with their identities.
    ///
    /// # Errors
    /// Standard output cannot be written.
    pub fn list(&self) -> Result<(), String> {
        for (point, prepared) in &self.ready {
            let known = if self.cache.look(&prepared.identity).is_some() { "  in the cache" } else { "" };
            let sample =
                self.study.scatter.map_or_else(String::new, |_| format!(", sample {}", point.sample));
            print(&format!(
                "{}  {}{sample}{known}",
                prepared.identity,
                words(self.study, &point.values, None)
            ))?;
        }
        Ok(())
    }

    /// Computes all that the goal wants, until it wants no more or `stop` is set.
    ///
    /// # Errors
    /// If the place can compute no more, or results cannot be read.
    pub fn run(&mut self, place: &mut dyn Place, stop: &AtomicBool) -> Result<(), String> {
        loop {
            let stopping = stop.load(Ordering::Relaxed);
            if !stopping {
                self.look_for_more()?;
            }
            while !stopping
                && let Some(next) = self.waiting.front()
                && place.has_room(next)
                && let Some(task) = self.waiting.pop_front()
            {
                self.under_way.insert(task.point.clone(), Arc::clone(&task.prepared));
                place.take(task, self.waiting.len())?;
            }
            if self.under_way.is_empty() && (stopping || self.is_over()) {
                return Ok(());
            }
            for finished in place.wait(stopping)? {
                self.finish(finished)?;
            }
        }
    }

    /// Whether nothing is wanted any more.
    pub fn is_over(&self) -> bool {
        self.under_way.is_empty() && self.waiting.is_empty() && self.wanted().is_empty()
    }

    /// What is known in the end.
    pub fn into_outcomes(self) -> Outcomes {
        self.outcomes
    }

    fn wanted(&self) -> Vec<Point> {
        goal::wanted(self.study, &table::known(self.study, &self.outcomes))
    }

    /// Takes what the goal wants next from the cache, or puts it into the queue; the largest first.
    fn look_for_more(&mut self) -> Result<(), String> {
        loop {
            let waiting: BTreeSet<&Point> = self.waiting.iter().map(|task| &task.point).collect();
            let is_new = |point: &Point| !self.under_way.contains_key(point) && !waiting.contains(point);
            let new: Vec<Point> = self.wanted().into_iter().filter(is_new).collect();
            if new.is_empty() {
                return Ok(());
            }
            let unread: Vec<Point> =
                new.iter().filter(|point| !self.ready.contains_key(point)).cloned().collect();
            for (point, prepared) in unread.iter().zip(prepare_all(self.study, &unread)) {
                match prepared {
                    Ok(prepared) => {
                        self.ready.insert(point.clone(), Arc::new(prepared));
                    }
                    Err(why) => self.put(
                        point.clone(),
                        Outcome::Failed(format!("its deck is faulty: {why}")),
                        "failed",
                    ),
                }
            }
            let mut answered = false;
            for point in new {
                let Some(prepared) = self.ready.remove(&point) else { continue };
                if self.is_computed(&prepared.identity) {
                    // Another point is the same run: it is answered when that is over.
                    self.ready.insert(point, prepared);
                    continue;
                }
                match self.cache.look(&prepared.identity) {
                    Some(entry) => {
                        let outcome = outcome_of(self.study, &point, &prepared.facts, &entry)?;
                        self.tally.answered += 1;
                        answered = true;
                        self.put(point, outcome, "from the cache");
                    }
                    None => self.waiting.push_back(Task { point, prepared }),
                }
            }
            self.waiting.make_contiguous().sort_by_key(|task| std::cmp::Reverse(task.prepared.elements));
            if !answered {
                return Ok(());
            }
        }
    }

    /// Whether a run of this identity waits or is under way.
    fn is_computed(&self, identity: &str) -> bool {
        let waiting = self.waiting.iter().map(|task| &task.prepared);
        waiting.chain(self.under_way.values()).any(|prepared| prepared.identity == identity)
    }

    /// A run is over.
    fn finish(&mut self, Finished { point, result }: Finished) -> Result<(), String> {
        let Some(prepared) = self.under_way.remove(&point) else { return Ok(()) };
        match result {
            Ok(element_cycles) => {
                let Some(entry) = self.cache.look(&prepared.identity) else {
                    return Err("results of a run are gone from the cache as soon as they were there; raise --keep-gb".to_owned());
                };
                let outcome = outcome_of(self.study, &point, &prepared.facts, &entry)?;
                if element_cycles > 0 {
                    self.tally.computed += 1;
                    self.tally.element_cycles += element_cycles;
                } else {
                    self.tally.answered += 1;
                }
                self.put(point, outcome, "computed");
            }
            Err(RunError::Stopped) => {}
            Err(why @ RunError::Cache(_)) => return Err(why.to_string()),
            Err(why) => self.put(point, Outcome::Failed(why.to_string()), "failed"),
        }
        Ok(())
    }

    fn put(&mut self, point: Point, outcome: Outcome, how: &str) {
        let at = words(self.study, &point.values, None);
        let sample = if point.sample > 0 { format!(", sample {}", point.sample) } else { String::new() };
        let told = match &outcome {
            Outcome::Done(row) => {
                let values = self.study.measures.iter().zip(&row.values).zip(&row.still_moving);
                values
                    .map(|((measure, value), moving)| {
                        let value = match value {
                            Ok(value) => short(*value),
                            Err(why) => format!("has no value: {why}"),
                        };
                        let doubt = moving.as_ref().map_or_else(String::new, |gauge| {
                            format!(" (too short? {gauge} still moves forward at the end)")
                        });
                        format!("{} {value}{doubt}", measure.name)
                    })
                    .collect::<Vec<_>>()
                    .join(", ")
            }
            Outcome::Failed(why) => why.clone(),
        };
        // A run whose measure has no value counts as failed, however its results came.
        let how = if !outcome.is_whole() { "failed" } else { how };
        tell(&format!("{at}{sample}: {told} ({how})"));
        self.outcomes.insert(point, outcome);
    }
}

fn prepare_all(study: &Study, points: &[Point]) -> Vec<Result<Prepared, prepare::Error>> {
    points.par_iter().map(|point| prepare(study, point)).collect()
}

/// `velocity = 200, thickness = 5`.
pub fn words(study: &Study, values: &[f64], without: Option<usize>) -> String {
    let all = study.parameters.iter().zip(values).enumerate().filter(|(index, _)| Some(*index) != without);
    all.map(|(_, (parameter, value))| format!("{} = {value}", parameter.name)).collect::<Vec<_>>().join(", ")
}

/// Whether the deck has what the measures speak of, as faults of the study file: of each measure the first.
fn check_measures(study: &Study, ready: &BTreeMap<Point, Arc<Prepared>>) -> Result<(), String> {
    let text = &study.text;
    let faults = Faults::new(&study.file, text);
    for measure in &study.measures {
        let fault = ready.iter().enumerate().find_map(|(number, (point, prepared))| {
            let why = measure.formula.check(&prepared.facts).err()?.to_string();
            // What the first point lacks is hardly a matter of its values.
            Some(if number == 0 { why } else { format!("{why} (at {})", words(study, &point.values, None)) })
        });
        if let Some(why) = fault {
            let expected = "what the deck has";
            faults.add(measure.at, format!("of = \"{}\"", measure.words), expected, why);
        }
    }
    let lines: Vec<String> = faults.into_list().iter().map(ToString::to_string).collect();
    let ending = if lines.len() == 1 { "" } else { "s" };
    if lines.is_empty() {
        Ok(())
    } else {
        Err(format!("{} fault{ending} in the study\n{}", lines.len(), lines.join("\n")))
    }
}

/// The measures of a run whose results lie in a folder. One without a value leaves the others theirs.
fn outcome_of(study: &Study, point: &Point, facts: &Facts, entry: &Path) -> Result<Outcome, String> {
    let [history, summary] = FILES.map(|name| entry.join(name));
    let history = Table::read(&history).map_err(|e| e.to_string())?;
    let fault = |e: &dyn std::fmt::Display| format!("{}: {e}", summary.display());
    let text = std::fs::read_to_string(&summary).map_err(|e| fault(&e))?;
    let summary: Summary = serde_json::from_str(&text).map_err(|e| fault(&e))?;
    let mut known = study.named(&point.values);
    known.extend(measure::of_summary(&summary));
    let (mut values, mut still_moving) = (Vec::new(), Vec::new());
    for measure in &study.measures {
        match measure.formula.of_run(&history, facts, &known) {
            Ok(value) => {
                known.insert(measure.name.clone(), value);
                values.push(Ok(value));
                still_moving.push(measure.formula.still_moving(&history, facts).map(str::to_owned));
            }
            Err(why) => {
                values.push(Err(why.to_string()));
                still_moving.push(None);
            }
        }
    }
    Ok(Outcome::Done(Row { values, cycles: summary.cycles, digest: summary.digest, still_moving }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{HISTORY, SUMMARY};

    #[test]
    fn a_measure_without_a_value_leaves_the_others_the_cycles_and_the_digest() {
        let text = "title = \"s\"\ndeck = \"d.toml\"\n[[parameter]]\nname = \"v\"\nvalues = [0.7]\n[[measure]]\nname = \"a\"\n\
            of = \"2 * kinetic\"\n[[measure]]\nname = \"b\"\nof = \"kinetic / friction\"\n[[measure]]\nname = \"c\"\nof = \"v * a\"\n";
        let study = super::super::read::read(text, Path::new("s.toml")).expect("no fault");
        let deck = "title = \"block\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"block\"\nmaterial = \"LEAD\"\n\
            box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }\n";
        let facts = Facts::of(&deck::read(deck, "d.toml").expect("no fault"), &[]);
        let entry = tempfile::tempdir().expect("room");
        let mut summary = Summary { cycles: 70, digest: "ab12".to_owned(), ..Summary::default() };
        summary.energies.kinetic = 4.0;
        let json = serde_json::to_string(&summary).expect("numbers");
        std::fs::write(entry.path().join(SUMMARY), json).expect("room");
        std::fs::write(entry.path().join(HISTORY), "time [s]\n0.0\n").expect("room");
        let point = Point { values: vec![0.7], sample: 0 };
        let outcome = outcome_of(&study, &point, &facts, entry.path()).expect("readable");
        let Outcome::Done(row) = &outcome else { panic!("{outcome:?}") };
        assert!(row.values[1].as_ref().is_err_and(|why| why.contains("it comes to inf")), "{row:?}");
        assert!(!outcome.is_whole());
        let table = table::table(&study, &Outcomes::from([(point, outcome)]));
        assert_eq!(table, "v,a,b,c,cycles,digest,state\n0.7,8.0,,5.6,70,ab12,incomplete\n");
    }
}
