//! What a study asks for, as its file says it and checked by itself: parameters, points, measures, a goal.

use std::{cmp::Ordering, path::PathBuf, sync::OnceLock};

use deck::{bundle::Options, parameters::Parameters, perturb::Perturbation};
use mechanics::draw::mixed;

use super::{
    measure::{Formula, Measure},
    sample,
};

/// Most points of a study.
pub const MAX_POINTS: usize = 100_000;

/// A study.
#[derive(Clone, Debug)]
pub struct Study {
    /// Its file and the text in it, for faults that show later.
    pub file: String,
    pub text: String,
    pub title: String,
    /// The deck, as seen from where the study is seen from.
    pub deck: PathBuf,
    /// What a keyword deck does not say itself.
    pub options: Options,
    pub parameters: Vec<Parameter>,
    /// How parameters that have a range alone are sampled.
    pub sampling: Option<Sampling>,
    /// Points that are listed one by one, beside those of the grid.
    pub listed: Vec<Vec<f64>>,
    /// What a point must fulfil to be computed.
    pub conditions: Vec<Formula>,
    /// Their words.
    pub texts_of_conditions: Vec<String>,
    pub measures: Vec<Measure>,
    pub goal: Goal,
    pub scatter: Option<Scatter>,
    /// [`Study::sites`], once they were asked for.
    pub known_sites: OnceLock<Vec<Vec<f64>>>,
}

/// A parameter of the deck.
#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: String,
    /// Its unit, for headings; may be empty.
    pub unit: String,
    pub values: Values,
}

/// Which values a parameter takes.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Those of listed points alone.
    Listed,
    /// Each of these.
    Each(Vec<f64>),
    /// Between two numbers: sampled, or searched by the goal.
    Between { from: f64, to: f64, whole: bool },
}

/// How ranges are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    pub kind: sample::Kind,
    pub count: usize,
    pub seed: u64,
}

/// What is sought.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// The measures of all points.
    Table,
    /// Where a measure begins or ceases to reach a number as a parameter grows.
    Limit(Search),
    /// Where a measure is least (or greatest) as a parameter varies.
    Least { search: Search, greatest: bool },
}

impl Goal {
    pub fn search(&self) -> Option<&Search> {
        match self {
            Self::Table => None,
            Self::Limit(search) | Self::Least { search, .. } => Some(search),
        }
    }
}

/// A search along one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// What the results call what is found: `ballistic limit`, `threshold`, `minimum`, `maximum`.
    pub name: &'static str,
    /// Index of the parameter.
    pub parameter: usize,
    /// Index of the measure.
    pub measure: usize,
    /// What the measure is compared with.
    pub value: f64,
    /// The bracket to begin with.
    pub from: f64,
    pub to: f64,
    /// The bracket to end with is at most this wide.
    pub tolerance: f64,
    /// Points inside of the bracket that are computed in each round.
    pub probes: usize,
}

/// Runs of each point with perturbed nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// See [`Perturbation::nodes`].
    pub nodes: f64,
    /// Perturbed runs of each point, beside the one that is not.
    pub samples: u32,
    pub seed: u64,
}

/// One run of a study: values of the parameters, in their order, and which perturbation; 0 is none.
#[derive(Clone, Debug)]
pub struct Point {
    pub values: Vec<f64>,
    pub sample: u32,
}

impl Ord for Point {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_values = self.values.iter().zip(&other.values).map(|(a, b)| a.total_cmp(b));
        let unequal = by_values.into_iter().find(|order| order.is_ne());
        unequal.unwrap_or_else(|| self.sample.cmp(&other.sample))
    }
}

impl PartialOrd for Point {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Point {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Point {}

impl Study {
    /// The values of parameters by their names.
    pub fn named(&self, values: &[f64]) -> Parameters {
        self.parameters.iter().map(|parameter| parameter.name.clone()).zip(values.iter().copied()).collect()
    }

    /// What a deck is read with at a point.
    pub fn options_at(&self, point: &Point) -> Options {
        let perturbation = self.scatter.filter(|_| point.sample > 0).map(|scatter| Perturbation {
            nodes: scatter.nodes,
            seed: mixed(scatter.seed ^ mixed(u64::from(point.sample))),
        });
        Options { parameters: self.named(&point.values), perturbation, ..self.options.clone() }
    }

    /// Numbers of the perturbations of each point.
    pub fn samples(&self) -> std::ops::RangeInclusive<u32> {
        0..=self.scatter.map_or(0, |scatter| scatter.samples)
    }

    /// How many points there are before the conditions, along the parameters that no goal searches; none past any count.
    pub fn n_sites(&self) -> Option<usize> {
        let each = self.parameters.iter().filter_map(|parameter| match &parameter.values {
            Values::Each(values) => Some(values.len()),
            _ => None,
        });
        let grid = each.into_iter().try_fold(1_usize, usize::checked_mul)?;
        let sampled = grid.checked_mul(self.sampling.map_or(1, |sampling| sampling.count))?;
        let gridded = if self.has_grid() { sampled } else { 0 };
        gridded
            .checked_add(self.listed.len())?
            .checked_mul(self.scatter.map_or(1, |s| s.samples as usize + 1))
    }

    /// Whether there are points beside those that are listed.
    fn has_grid(&self) -> bool {
        !self.parameters.iter().any(|parameter| parameter.values == Values::Listed)
    }

    /// Values of the parameters at which something is computed or, along the one that a goal searches, sought: that one stands at the
    /// start of its bracket. Those that the conditions refuse are left out, unless the conditions speak of the one that is searched.
    pub fn sites(&self) -> &[Vec<f64>] {
        self.known_sites.get_or_init(|| self.find_sites())
    }

    fn find_sites(&self) -> Vec<Vec<f64>> {
        let mut sites = self.sites_before_conditions();
        sites.retain(|site| self.goal.search().is_some() || self.admits(site));
        sites
    }

    /// The same, with those that the conditions refuse.
    pub fn sites_before_conditions(&self) -> Vec<Vec<f64>> {
        let searched = self.goal.search().map(|search| search.parameter);
        let mut sites: Vec<Vec<f64>> = Vec::new();
        if self.has_grid() {
            sites.push(Vec::new());
        }
        let ranges = |index: usize| {
            matches!(self.parameters[index].values, Values::Between { .. }) && Some(index) != searched
        };
        let sampled: Vec<usize> = (0..self.parameters.len()).filter(|&index| ranges(index)).collect();
        let samples = match self.sampling {
            Some(Sampling { kind, count, seed }) => sample::points(kind, count, sampled.len(), seed),
            None => vec![Vec::new()],
        };
        for (index, parameter) in self.parameters.iter().enumerate() {
            if let Values::Each(values) = &parameter.values {
                let longer = |site: Vec<f64>| {
                    values.iter().map(move |&value| site.iter().copied().chain([value]).collect::<Vec<f64>>())
                };
                sites = sites.into_iter().flat_map(longer).collect();
            } else {
                // Filled in below, from the samples or by the search.
                let start = match parameter.values {
                    Values::Between { from, .. } if Some(index) == searched => from,
                    _ => 0.0,
                };
                sites.iter_mut().for_each(|site| site.push(start));
            }
        }
        let of_sample = |site: Vec<f64>| {
            let (samples, sampled) = (&samples, &sampled);
            samples.iter().map(move |fractions| {
                let mut site = site.clone();
                for (&index, &fraction) in sampled.iter().zip(fractions) {
                    site[index] = self.parameters[index].values.at(fraction);
                }
                site
            })
        };
        let mut sites: Vec<Vec<f64>> = sites.into_iter().flat_map(of_sample).collect();
        sites.extend(self.listed.iter().cloned());
        sites.sort_by(|a, b| {
            let point = |values: &Vec<f64>| Point { values: values.clone(), sample: 0 };
            point(a).cmp(&point(b))
        });
        sites.dedup_by(|a, b| a.iter().zip(b.iter()).all(|(a, b)| a.to_bits() == b.to_bits()));
        sites
    }

    /// Whether a point fulfils one condition.
    pub fn admits_by(&self, condition: &Formula, values: &[f64]) -> bool {
        condition.of_parameters(&self.named(values)).is_ok_and(|holds| holds != 0.0)
    }

    /// Whether a point fulfils the conditions. Their names were checked, so one that has no value holds nowhere.
    pub fn admits(&self, values: &[f64]) -> bool {
        let named = self.named(values);
        self.conditions
            .iter()
            .all(|condition| condition.of_parameters(&named).is_ok_and(|holds| holds != 0.0))
    }
}

impl Values {
    /// The value at a fraction of a range.
    pub fn at(&self, fraction: f64) -> f64 {
        match *self {
            Self::Between { from, to, whole } => {
                let value = from + (to - from) * fraction;
                if whole { value.round() } else { value }
            }
            Self::Listed | Self::Each(_) => 0.0,
        }
    }
}
