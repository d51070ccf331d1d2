//! Cases: a figure of ours beside a published or derived one, the tolerance, and the verdict.
//!
//! References stand in `reference.toml`, one row per case, with the source of each number. A test hands its figures
//! to a [`Figures`], which prints every row (seen with `--nocapture`) and then fails if one is outside its tolerance.

use std::{collections::BTreeMap, fmt, sync::LazyLock};

use serde::Deserialize;

/// How far a figure may be from its reference.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Tolerance {
    /// Fraction of the reference, either way.
    Relative(f64),
    /// In the unit of the reference, either way.
    Absolute(f64),
    /// The figure is between these; the reference is said for comparison.
    Between([f64; 2]),
    /// The magnitude of the figure is at most this; the reference is 0.
    AtMost(f64),
}

impl fmt::Display for Tolerance {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Relative(part) if *part < 1e-8 => write!(out, "{part:e} of it"),
            Self::Relative(part) => write!(out, "{} %", round(100.0 * part)),
            Self::Absolute(by) => write!(out, "+-{by:?}"),
            Self::Between([low, high]) => write!(out, "{low:?} to {high:?}"),
            Self::AtMost(limit) => write!(out, "<= {limit:?}"),
        }
    }
}

/// Without the noise of the last binary places.
fn round(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}

/// A row of `reference.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    #[serde(default)]
    value: f64,
    tolerance: Tolerance,
    source: String,
    /// Why our figure is known to miss; such a row must miss.
    miss: Option<String>,
}

/// Read when it is first asked for: its words are no part of the program, which knows figures that it has kept by that.
static TABLE: LazyLock<BTreeMap<String, Row>> = LazyLock::new(|| {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/reference.toml");
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    toml::from_str(&text).expect("reference.toml holds rows of cases only")
});

/// Names of all cases of `reference.toml`.
pub fn names() -> Vec<&'static str> {
    TABLE.keys().map(String::as_str).collect()
}

/// One figure and its verdict.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Name in `reference.toml`.
    pub name: String,
    /// The published or derived figure.
    pub reference: f64,
    /// Where it comes from.
    pub source: String,
    /// What the run gave.
    pub ours: f64,
    /// How far apart they may be.
    pub tolerance: Tolerance,
    /// Why our figure is known to be further off than that.
    pub miss: Option<String>,
}

impl Case {
    /// Compares `ours` with the row `name`.
    ///
    /// # Panics
    /// If there is no such row: a fault of the test.
    pub fn new(name: &str, ours: f64) -> Self {
        let row = TABLE.get(name).unwrap_or_else(|| panic!("reference.toml has no row \"{name}\""));
        Self {
            name: name.to_owned(),
            reference: row.value,
            source: row.source.clone(),
            ours,
            tolerance: row.tolerance,
            miss: row.miss.clone(),
        }
    }

    /// How far the figure is from its reference: in per cent of it, or as it is where the reference is 0.
    pub fn difference(&self) -> String {
        if self.reference == 0.0 {
            number(self.ours)
        } else {
            format!("{:+.3} %", 100.0 * (self.ours - self.reference) / self.reference.abs())
        }
    }

    /// `pass` or `miss`.
    pub fn verdict(&self) -> &'static str {
        if self.holds() { "pass" } else { "miss" }
    }

    /// Whether the row says of itself what the figure does.
    fn is_as_stated(&self) -> bool {
        self.holds() == self.miss.is_none()
    }

    /// Whether the figure is inside its tolerance; a figure that is no number is not.
    pub fn holds(&self) -> bool {
        let off = (self.ours - self.reference).abs();
        match self.tolerance {
            Tolerance::Relative(part) => off <= part * self.reference.abs(),
            Tolerance::Absolute(by) => off <= by,
            Tolerance::Between([low, high]) => (low..=high).contains(&self.ours),
            Tolerance::AtMost(limit) => self.ours.abs() <= limit,
        }
    }
}

/// Six digits.
pub fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) { format!("{x:.6}") } else { format!("{x:.5e}") }
}

impl fmt::Display for Case {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "{:<58} {:>14} {:>14} {:>18}  {}",
            self.name,
            number(self.reference),
            number(self.ours),
            self.tolerance.to_string(),
            self.verdict()
        )
    }
}

/// The cases of one test.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    cases: Vec<Case>,
}

impl Figures {
    /// Compares and prints a figure.
    pub fn add(&mut self, name: &str, ours: f64) {
        let case = Case::new(name, ours);
        println!("{case}");
        self.cases.push(case);
    }

    /// Figures by name, as they were added: what [`Figures::of`] takes back.
    pub fn figures(&self) -> Vec<(String, f64)> {
        self.cases.iter().map(|case| (case.name.clone(), case.ours)).collect()
    }

    /// Figures that were computed before, compared with the rows as they are now.
    ///
    /// # Panics
    /// If one has no row.
    pub fn of(figures: &[(String, f64)]) -> Self {
        Self { cases: figures.iter().map(|(name, ours)| Case::new(name, *ours)).collect() }
    }

    /// Whether every case holds, or misses for the reason that its row gives.
    pub fn is_as_stated(&self) -> bool {
        self.cases.iter().all(Case::is_as_stated)
    }

    pub fn cases(&self) -> &[Case] {
        &self.cases
    }

    /// Fails with all cases that missed, and those that did not though their row says so.
    ///
    /// # Panics
    /// If there is such a case, or none at all.
    pub fn close(self) {
        assert!(!self.cases.is_empty(), "a sheet without a case proves nothing");
        let missed: Vec<String> = self
            .cases
            .iter()
            .filter(|case| !case.is_as_stated())
            .map(|case| format!("{case}\n    {}", case.source))
            .collect();
        assert!(
            missed.is_empty(),
            "{} of {} cases are not as their rows say\n{}",
            missed.len(),
            self.cases.len(),
            missed.join("\n")
        );
    }
}
