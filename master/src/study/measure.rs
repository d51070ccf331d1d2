//! Measures: numbers that a study takes from the results of a run.
//!
//! A measure is an expression over columns of the history (`max(rear:uz)`), numbers of the summary, parameters and measures before it, or a
//! comparison of such, or one of the phrases of [`PHRASES`]. Only numbers that are the same on any machines may be used, so no time on
//! a clock is among them.

use std::fmt;

use deck::{
    fault::nearest,
    parameters::{Parameters, names_in, value_of},
};

use crate::results::{Summary, history::Table};

mod facts;

pub use facts::Facts;
use facts::{dot, listed, moving};

/// Numbers of the summary that no machine changes.
pub const OF_SUMMARY: [&str; 15] = [
    "cycles",
    "end_time",
    "elements",
    "nodes",
    "kinetic",
    "internal",
    "hourglass",
    "contact",
    "friction",
    "external",
    "energy_error",
    "momentum_error",
    "eroded_elements",
    "eroded_mass",
    "worst_penetration",
];

/// What can be said in words.
pub const PHRASES: &str = "residual velocity of NAME, max displacement of GAUGE, max displacement of GAUGE along AXIS, perforated, \
                           perforated by GAUGE through PART";

/// Part of its velocity at the start below which a gauge counts as stopped: what is stuck in a plate shakes with it.
const SLOW: f64 = 0.05;

/// A named number.
#[derive(Clone, Debug)]
pub struct Measure {
    pub name: String,
    /// Its unit, for headings; may be empty.
    pub unit: String,
    pub formula: Formula,
    /// Place of the formula in the study (byte offset), and its words.
    pub at: usize,
    pub words: String,
}

/// An expression, or comparisons that all must hold (1) or else do not (0).
#[derive(Clone, Debug)]
pub struct Formula {
    clauses: Vec<Clause>,
    /// What the results are asked for; an expression calls them `__0`, `__1` and so on.
    quantities: Vec<Quantity>,
}

#[derive(Clone, Debug)]
struct Clause {
    left: String,
    right: Option<(Order, String)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Below,
    AtMost,
    Above,
    AtLeast,
}

/// What a run is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Quantity {
    /// One number of a column of the history.
    Column(Reduction, String),
    /// Velocity at the end along that of the start.
    ResidualVelocity(String),
    /// Greatest distance of a gauge from its start, or along an axis.
    Displacement(String, Option<usize>),
    /// Whether a gauge has passed a part; the only ones that come in question where none is named.
    Perforated(Option<(String, String)>),
}

/// How a column becomes a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reduction {
    First,
    Last,
    Max,
    Min,
    MaxAbs,
    Mean,
}

const REDUCTIONS: [(&str, Reduction); 6] = [
    ("first", Reduction::First),
    ("last", Reduction::Last),
    ("maxabs", Reduction::MaxAbs),
    ("max", Reduction::Max),
    ("min", Reduction::Min),
    ("mean", Reduction::Mean),
];

const AXES: [&str; 3] = ["x", "y", "z"];

/// What is wrong with a formula.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// A bracket is not closed.
    Open,
    /// A name that nothing has, and the nearest that something has.
    Name { name: String, near: Option<String>, known: String },
    /// A column that the history has not.
    Column { name: String, near: Option<String> },
    /// No gauge, or part, of that name.
    Owner { what: &'static str, name: String, known: String },
    /// A part has no one velocity at the start.
    NoVelocity(String),
    /// A body at rest has no direction of its own.
    AtRest(String),
    /// A gauge cannot perforate what is not before it.
    Away { gauge: String, part: String },
    /// Which gauge or part is meant by `perforated` is not clear.
    Which { what: &'static str, found: usize },
    /// An expression that has no value.
    Value { text: String, why: String },
    /// The results of a run are asked for where only parameters are known.
    NoRun,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let or =
            |near: &Option<String>| near.as_ref().map_or_else(String::new, |near| format!("; write {near}"));
        match self {
            Self::Open => f.write_str("close the bracket"),
            Self::Name { name, near, known } => {
                write!(
                    f,
                    "there is no parameter, measure before this or number of the summary {name}{}; known are {known}",
                    or(near)
                )
            }
            Self::Column { name, near } => {
                write!(
                    f,
                    "the history has no column {name}{}; history.csv of any run of the deck has all",
                    or(near)
                )
            }
            Self::Owner { what, name, known } => write!(f, "the deck has no {what} {name}; it has {known}"),
            Self::NoVelocity(part) => {
                write!(
                    f,
                    "nodes of part {part} start at unequal velocities; give it a [[gauge]] and name that"
                )
            }
            Self::AtRest(name) => {
                write!(f, "{name} is at rest at the start, so it has no direction to go on in")
            }
            Self::Away { gauge, part } => {
                write!(
                    f,
                    "at the start {part} is not before {gauge}, which flies away from it or past it; check the sign of the velocity and where both are"
                )
            }
            Self::Which { what, found } => {
                write!(
                    f,
                    "the deck has {found} {what}, one is needed; write perforated by GAUGE through PART"
                )
            }
            Self::Value { text, why } => write!(f, "{text}: {why}"),
            Self::NoRun => f.write_str("use parameters alone: a condition is looked at before anything runs"),
        }
    }
}

impl std::error::Error for Error {}

impl Formula {
    /// Reads a formula. Columns, gauges and parts are looked for in [`Formula::check`], once a deck is known.
    ///
    /// # Errors
    /// If a bracket stays open or a name is none of `known`.
    pub fn parse(text: &str, known: &[&str]) -> Result<Self, Error> {
        let pieces: Vec<&str> = text.split(" and ").collect();
        let mut formula = Self { clauses: Vec::new(), quantities: Vec::new() };
        for clause in Self::clauses(&pieces, known) {
            formula.clause(&clause, known)?;
        }
        Ok(formula)
    }

    /// Clauses of what stands between the words "and". Names may have that word in them: where a piece is no clause, one that goes over several
    /// pieces is taken. Every piece is one where that comes to nothing, so that a fault is told of the least part of the formula.
    fn clauses(pieces: &[&str], known: &[&str]) -> Vec<String> {
        let is_clause =
            |text: &str| Self { clauses: Vec::new(), quantities: Vec::new() }.clause(text, known).is_ok();
        let n = pieces.len();
        // By piece, where the clause that begins with it ends so that the rest are clauses too; none beyond the last are needed.
        let mut ends: Vec<Option<usize>> = vec![None; n];
        ends.push(Some(n));
        for start in (0..n).rev() {
            ends[start] = (start + 1..=n)
                .find(|&end| ends[end].is_some() && is_clause(&pieces[start..end].join(" and ")));
        }
        let mut clauses = Vec::new();
        let mut start = 0;
        while start < n {
            let end = ends[0].and_then(|_| ends[start]).unwrap_or(start + 1);
            clauses.push(pieces[start..end].join(" and "));
            start = end;
        }
        clauses
    }

    /// Reads and adds a clause.
    fn clause(&mut self, clause: &str, known: &[&str]) -> Result<(), Error> {
        let (left, right) = match split_at_order(clause) {
            Some((left, order, right)) => (left, Some((order, right))),
            None => (clause, None),
        };
        let left = self.term(left, known)?;
        let right = right.map(|(order, right)| self.term(right, known).map(|right| (order, right)));
        self.clauses.push(Clause { left, right: right.transpose()? });
        Ok(())
    }

    /// A side of a comparison, with names in place of what the results are asked for.
    fn term(&mut self, text: &str, known: &[&str]) -> Result<String, Error> {
        let text = text.trim();
        let term = match phrase(text) {
            Some(quantity) => self.name(quantity),
            None => self.without_columns(text)?,
        };
        for name in names_in(&term).filter(|name| !name.starts_with("__")) {
            if !known.contains(&name) {
                let near = nearest(name, known.iter().copied()).map(str::to_owned);
                return Err(Error::Name {
                    name: name.to_owned(),
                    near,
                    known: listed(known.iter().copied()),
                });
            }
        }
        // Names are known to stand for numbers: what else is wrong with the expression shows with any.
        let ones = names_in(&term).map(|name| (name.to_owned(), 1.0)).collect();
        match value_of(&term, &ones) {
            // Of ones alone it may come to something that has no value, such as 1 / (a - b).
            Err(why) if !why.starts_with("it comes to") => Err(Error::Value { text: text.to_owned(), why }),
            _ => Ok(term),
        }
    }

    fn name(&mut self, quantity: Quantity) -> String {
        let index = self.quantities.iter().position(|known| *known == quantity).unwrap_or_else(|| {
            self.quantities.push(quantity);
            self.quantities.len() - 1
        });
        format!("__{index}")
    }

    /// The expression with names in place of `max(COLUMN)` and its like.
    fn without_columns(&mut self, text: &str) -> Result<String, Error> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(open) = rest.find('(') {
            let before = &rest[..open];
            let reduction = REDUCTIONS.iter().find(|(word, _)| {
                before
                    .strip_suffix(word)
                    .is_some_and(|b| !b.ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_'))
            });
            let inside = &rest[open + 1..];
            let close = inside.find(')').ok_or(Error::Open)?;
            match reduction {
                // With two arguments it is the function of two numbers.
                Some((word, reduction))
                    if !inside[..close].contains(',') && !inside[..close].contains('(') =>
                {
                    out.push_str(&before[..before.len() - word.len()]);
                    let quantity = Quantity::Column(*reduction, inside[..close].trim().to_owned());
                    out.push_str(&self.name(quantity));
                    rest = &inside[close + 1..];
                }
                _ => {
                    out.push_str(&rest[..=open]);
                    rest = inside;
                }
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    /// Whether it says yes or no.
    pub fn is_comparison(&self) -> bool {
        let perforated = |clause: &Clause| {
            let index = clause.left.strip_prefix("__").and_then(|n| n.parse::<usize>().ok());
            matches!(index.and_then(|n| self.quantities.get(n)), Some(Quantity::Perforated(_)))
        };
        self.clauses.iter().all(|clause| clause.right.is_some() || perforated(clause))
    }

    /// Whether a deck has all that the formula speaks of.
    ///
    /// # Errors
    /// The first that it has not.
    pub fn check(&self, facts: &Facts) -> Result<(), Error> {
        for quantity in &self.quantities {
            match quantity {
                Quantity::Column(_, name) => {
                    if !facts.columns.contains(name) {
                        let near = nearest(name, facts.columns.iter().map(String::as_str)).map(str::to_owned);
                        return Err(Error::Column { name: name.clone(), near });
                    }
                }
                Quantity::ResidualVelocity(name) => {
                    if let Ok(gauge) = facts.gauge(name) {
                        moving(name, gauge.velocity)?;
                    } else if facts.parts.iter().any(|part| part.name == *name) {
                        let velocity =
                            facts.part(name)?.velocity.ok_or_else(|| Error::NoVelocity(name.clone()))?;
                        moving(name, velocity)?;
                    } else {
                        facts.gauge(name)?;
                    }
                }
                Quantity::Displacement(name, _) => {
                    facts.gauge(name)?;
                }
                Quantity::Perforated(named) => {
                    facts.perforation(named)?;
                }
            }
        }
        Ok(())
    }

    /// The value where only parameters are known.
    ///
    /// # Errors
    /// If it asks for results, or has no value.
    pub fn of_parameters(&self, known: &Parameters) -> Result<f64, Error> {
        if self.quantities.is_empty() { self.value(known) } else { Err(Error::NoRun) }
    }

    /// Whether it needs no results.
    pub fn is_of_parameters(&self) -> bool {
        self.quantities.is_empty()
    }

    /// The value of a run, with what is known beside it: parameters, numbers of the summary, measures before.
    ///
    /// # Errors
    /// If it has no value.
    pub fn of_run(&self, history: &Table, facts: &Facts, known: &Parameters) -> Result<f64, Error> {
        let mut all = known.clone();
        for (index, quantity) in self.quantities.iter().enumerate() {
            all.insert(format!("__{index}"), quantity.of(history, facts)?);
        }
        self.value(&all)
    }

    /// The gauge that has not perforated what it should and yet moves on at the end of the run, at more than [`SLOW`] of its velocity: the run
    /// may be too short to tell.
    pub fn still_moving<'a>(&self, history: &Table, facts: &'a Facts) -> Option<&'a str> {
        self.quantities.iter().find_map(|quantity| {
            let Quantity::Perforated(named) = quantity else { return None };
            let (gauge, _) = facts.perforation(named).ok()?;
            let left = Quantity::ResidualVelocity(gauge.name.clone()).of(history, facts).ok()?;
            let speed = dot(gauge.velocity, gauge.velocity).sqrt();
            let passed = quantity.of(history, facts).ok()? != 0.0;
            (!passed && left > SLOW * speed).then_some(gauge.name.as_str())
        })
    }

    fn value(&self, known: &Parameters) -> Result<f64, Error> {
        let value =
            |text: &String| value_of(text, known).map_err(|why| Error::Value { text: text.clone(), why });
        if let [Clause { left, right: None }] = &self.clauses[..] {
            return value(left);
        }
        let mut holds = true;
        for Clause { left, right } in &self.clauses {
            let left = value(left)?;
            holds &= match right {
                None => left != 0.0,
                Some((order, right)) => order.holds(left, value(right)?),
            };
        }
        Ok(f64::from(u8::from(holds)))
    }
}

impl Order {
    fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Below => a < b,
            Self::AtMost => a <= b,
            Self::Above => a > b,
            Self::AtLeast => a >= b,
        }
    }
}

/// The sides of a comparison.
fn split_at_order(text: &str) -> Option<(&str, Order, &str)> {
    let at = text.find(['<', '>'])?;
    let (left, right) = (&text[..at], &text[at + 1..]);
    let (right, or_equal) = match right.strip_prefix('=') {
        Some(rest) => (rest, true),
        None => (right, false),
    };
    let order = match (&text[at..=at], or_equal) {
        ("<", false) => Order::Below,
        ("<", true) => Order::AtMost,
        (_, false) => Order::Above,
        (_, true) => Order::AtLeast,
    };
    Some((left, order, right))
}

/// One of [`PHRASES`].
fn phrase(text: &str) -> Option<Quantity> {
    if text == "perforated" {
        return Some(Quantity::Perforated(None));
    }
    if let Some(rest) = text.strip_prefix("perforated by ") {
        let (gauge, part) = rest.split_once(" through ")?;
        return Some(Quantity::Perforated(Some((gauge.trim().to_owned(), part.trim().to_owned()))));
    }
    if let Some(name) = text.strip_prefix("residual velocity of ") {
        return Some(Quantity::ResidualVelocity(name.trim().to_owned()));
    }
    let rest = text.strip_prefix("max displacement of ")?;
    let along = rest.rsplit_once(" along ").and_then(|(name, axis)| {
        AXES.iter().position(|known| *known == axis.trim()).map(|axis| (name, axis))
    });
    Some(match along {
        Some((name, axis)) => Quantity::Displacement(name.trim().to_owned(), Some(axis)),
        None => Quantity::Displacement(rest.trim().to_owned(), None),
    })
}

impl Quantity {
    fn of(&self, history: &Table, facts: &Facts) -> Result<f64, Error> {
        let column = |name: &str| {
            let column = history.column(name).filter(|column| !column.is_empty());
            column.ok_or_else(|| Error::Column { name: name.to_owned(), near: None })
        };
        let last = |name: String| column(&name).map(|column| column.last().copied().unwrap_or_default());
        let vector = |name: &str, of: &str| -> Result<[f64; 3], Error> {
            let mut vector = [0.0; 3];
            for (x, axis) in vector.iter_mut().zip(AXES) {
                *x = last(format!("{name}:{of}{axis}"))?;
            }
            Ok(vector)
        };
        match self {
            Self::Column(reduction, name) => Ok(reduction.of(&column(name)?)),
            Self::ResidualVelocity(name) => match facts.gauge(name) {
                Ok(gauge) => {
                    let start = gauge.velocity;
                    Ok(dot(vector(name, "v")?, start) / dot(start, start).sqrt())
                }
                Err(_) => {
                    let start = facts.part(name)?.velocity.ok_or_else(|| Error::NoVelocity(name.clone()))?;
                    let along = |momentum: [f64; 3]| dot(momentum, start);
                    let mut first = [0.0; 3];
                    for (p, axis) in first.iter_mut().zip(AXES) {
                        *p = column(&format!("{name}:momentum_{axis}"))?[0];
                    }
                    let ratio = along(vector(name, "momentum_")?) / along(first);
                    Ok(dot(start, start).sqrt() * ratio)
                }
            },
            Self::Displacement(name, Some(axis)) => {
                Ok(Reduction::MaxAbs.of(&column(&format!("{name}:u{}", AXES[*axis]))?))
            }
            Self::Displacement(name, None) => {
                let [x, y, z] = AXES.map(|axis| column(&format!("{name}:u{axis}")));
                let (x, y, z) = (x?, y?, z?);
                let squares = x.iter().zip(&y).zip(&z).map(|((x, y), z)| x * x + y * y + z * z);
                Ok(squares.fold(0.0, f64::max).sqrt())
            }
            Self::Perforated(named) => {
                let (gauge, targets) = facts.perforation(named)?;
                let start = gauge.velocity;
                let (x, v) = (vector(&gauge.name, "")?, vector(&gauge.name, "v")?);
                let passed = targets.iter().all(|part| dot(x, start) > part.along(start)[1]);
                Ok(f64::from(u8::from(passed && dot(v, start) > 0.0)))
            }
        }
    }
}

impl Reduction {
    fn of(self, column: &[f64]) -> f64 {
        match self {
            Self::First => column.first().copied().unwrap_or_default(),
            Self::Last => column.last().copied().unwrap_or_default(),
            Self::Max => column.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            Self::Min => column.iter().copied().fold(f64::INFINITY, f64::min),
            Self::MaxAbs => column.iter().fold(0.0, |most, x| f64::max(most, x.abs())),
            Self::Mean => column.iter().sum::<f64>() / column.len() as f64,
        }
    }
}

/// The numbers of a summary that no machine changes, by their names.
pub fn of_summary(summary: &Summary) -> Parameters {
    let e = &summary.energies;
    let numbers = [
        summary.cycles as f64,
        summary.end_time,
        summary.elements as f64,
        summary.nodes as f64,
        e.kinetic,
        e.internal,
        e.hourglass,
        e.contact,
        e.friction,
        e.external,
        e.error,
        summary.momentum_error,
        summary.eroded_elements as f64,
        summary.eroded_mass,
        summary.worst_penetration,
    ];
    OF_SUMMARY.iter().map(|name| (*name).to_owned()).zip(numbers).collect()
}

#[cfg(test)]
mod tests;
