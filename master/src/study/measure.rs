//! Measures: numbers that a study takes from the results of a run.
//!
//! A measure is an expression over columns of the history (`max(rear:uz)`), numbers of the summary, parameters and measures before it, or a
//! comparison of such, or one of the phrases of [`PHRASES`]. Only numbers that are the same on any machines may be used, so no time on
//! a clock is among them.

use std::fmt;

use deck::{
    Model,
    fault::nearest,
    parameters::{Parameters, names_in, value_of},
};

use crate::results::{Summary, history::Table};

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

/// What measures need to know of a deck.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Names and velocities at the start of gauges at nodes.
    gauges: Vec<(String, [f64; 3])>,
    parts: Vec<PartFacts>,
    /// Columns of the history, without units.
    columns: Vec<String>,
}

#[derive(Clone, Debug)]
struct PartFacts {
    name: String,
    /// The box around its nodes.
    low: [f64; 3],
    high: [f64; 3],
    /// Of all its nodes, where that is one.
    velocity: Option<[f64; 3]>,
}

impl Facts {
    /// Of a model, whose history has these columns.
    pub fn of(model: &Model, columns: &[String]) -> Self {
        let bare =
            |column: &String| column.rsplit_once(" [").map_or(column.as_str(), |(bare, _)| bare).to_owned();
        let part = |part: &mechanics::mesh::Part| {
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for &node in &part.nodes {
                let x = model.mesh.positions[node as usize];
                low = std::array::from_fn(|axis| low[axis].min(x[axis]));
                high = std::array::from_fn(|axis| high[axis].max(x[axis]));
            }
            let velocity = |node: &u32| model.velocity[*node as usize];
            let first = part.nodes.first().map(velocity);
            let velocity = first.filter(|first| part.nodes.iter().all(|node| velocity(node) == *first));
            PartFacts { name: part.name.clone(), low, high, velocity }
        };
        Self {
            gauges: model
                .output
                .gauges
                .iter()
                .map(|g| (g.name.clone(), model.velocity[g.node as usize]))
                .collect(),
            parts: model.mesh.parts.iter().map(part).collect(),
            columns: columns.iter().map(bare).collect(),
        }
    }

    fn gauge(&self, name: &str) -> Result<[f64; 3], Error> {
        let found = self.gauges.iter().find(|(known, _)| known == name);
        found.map(|(_, velocity)| *velocity).ok_or_else(|| Error::Owner {
            what: "[[gauge]] at a node",
            name: name.to_owned(),
            known: listed(self.gauges.iter().map(|(name, _)| name.as_str())),
        })
    }

    fn part(&self, name: &str) -> Result<&PartFacts, Error> {
        self.parts.iter().find(|part| part.name == name).ok_or_else(|| Error::Owner {
            what: "part",
            name: name.to_owned(),
            known: listed(self.parts.iter().map(|part| part.name.as_str())),
        })
    }

    /// The gauge that moves and the parts at rest, if only one gauge and at least one part come in question.
    fn perforation<'a>(
        &'a self,
        named: &Option<(String, String)>,
    ) -> Result<(&'a str, [f64; 3], Vec<&'a PartFacts>), Error> {
        if let Some((gauge, part)) = named {
            let velocity = self.gauge(gauge)?;
            let name =
                self.gauges.iter().find(|(known, _)| known == gauge).map_or("", |(name, _)| name.as_str());
            return Ok((name, moving(gauge, velocity)?, vec![self.part(part)?]));
        }
        let at_rest = |velocity: &[f64; 3]| *velocity == [0.0; 3];
        let moving: Vec<&(String, [f64; 3])> = self.gauges.iter().filter(|(_, v)| !at_rest(v)).collect();
        let targets: Vec<&PartFacts> =
            self.parts.iter().filter(|part| part.velocity.as_ref().is_some_and(at_rest)).collect();
        match (moving[..].as_ref(), targets.is_empty()) {
            ([(name, velocity)], false) => Ok((name, *velocity, targets)),
            ([_], true) => Err(Error::Which { what: "parts that are at rest at the start", found: 0 }),
            (several, _) => {
                Err(Error::Which { what: "gauges at nodes that move at the start", found: several.len() })
            }
        }
    }
}

fn moving(name: &str, velocity: [f64; 3]) -> Result<[f64; 3], Error> {
    if velocity == [0.0; 3] { Err(Error::AtRest(name.to_owned())) } else { Ok(velocity) }
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Formula {
    /// Reads a formula. Columns, gauges and parts are looked for in [`Formula::check`], once a deck is known.
    ///
    /// # Errors
    /// If a bracket stays open or a name is none of `known`.
    pub fn parse(text: &str, known: &[&str]) -> Result<Self, Error> {
        let mut formula = Self { clauses: Vec::new(), quantities: Vec::new() };
        for clause in text.split(" and ") {
            let (left, right) = match split_at_order(clause) {
                Some((left, order, right)) => (left, Some((order, right))),
                None => (clause, None),
            };
            let left = formula.term(left, known)?;
            let right = right.map(|(order, right)| formula.term(right, known).map(|right| (order, right)));
            formula.clauses.push(Clause { left, right: right.transpose()? });
        }
        Ok(formula)
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
                    if let Ok(velocity) = facts.gauge(name) {
                        moving(name, velocity)?;
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
                Ok(start) => Ok(dot(vector(name, "v")?, start) / dot(start, start).sqrt()),
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
                let (gauge, start, targets) = facts.perforation(named)?;
                let (x, v) = (vector(gauge, "")?, vector(gauge, "v")?);
                // The corner of a box that lies farthest along the way.
                let end = |part: &&PartFacts| {
                    let corner =
                        |axis: usize| if start[axis] > 0.0 { part.high[axis] } else { part.low[axis] };
                    dot([corner(0), corner(1), corner(2)], start)
                };
                let passed = targets.iter().all(|part| dot(x, start) > end(part));
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
