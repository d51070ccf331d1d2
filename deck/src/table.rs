//! Tables and values of a parsed deck that know their place and report their own faults.
//!
//! A [`Table`] remembers which keys were asked for; [`Table::finish`] reports the others with the nearest
//! known key. Readers return `None` after reporting, so a caller may go on with the next entry.

use std::{cell::RefCell, collections::BTreeSet};

use toml::de::{DeTable, DeValue};

use crate::{
    fault::{Faults, nearest},
    place::{Origin, Place, Placed},
    schema::recorder::{Kind, Recorder},
};

/// Longest name of a part, material or gauge (characters).
pub const MAX_NAME: usize = 64;
/// Greatest magnitude of a number, and the inverse of the least number above zero, so that volumes, masses
/// and energies stay inside what a number can hold.
pub const MAX_NUMBER: f64 = 1e60;

/// Whether a number is 0 or of a magnitude that a deck may give.
pub(crate) fn holds(x: f64) -> bool {
    x == 0.0 || (1.0 / MAX_NUMBER..=MAX_NUMBER).contains(&x.abs())
}

/// A table of the deck.
pub struct Table<'a> {
    table: &'a DeTable<'a>,
    /// Offset of its header or opening brace.
    pub at: usize,
    /// What it is called in messages, for instance `[control]`.
    pub title: String,
    /// Where faults are reported.
    pub faults: &'a Faults<'a>,
    known: RefCell<BTreeSet<&'static str>>,
    /// What it is to a recorder of what readers ask.
    kind: usize,
}

/// A value of the deck and the key it stands under.
#[derive(Clone, Copy)]
pub struct Value<'a> {
    value: &'a DeValue<'a>,
    /// Offset of its first character.
    pub at: usize,
    end: usize,
    key: &'static str,
    /// The kind of the table that it stands in, and how many lists it is inside of there.
    owner: usize,
    depth: usize,
    /// Where faults are reported.
    pub faults: &'a Faults<'a>,
}

impl<'a> Table<'a> {
    /// A table called `title`, its header at offset `at`.
    pub fn new(table: &'a DeTable<'a>, at: usize, title: String, faults: &'a Faults<'a>) -> Self {
        Self::of_kind(table, at, title, faults, Recorder::WHOLE)
    }

    fn of_kind(
        table: &'a DeTable<'a>,
        at: usize,
        title: String,
        faults: &'a Faults<'a>,
        kind: usize,
    ) -> Self {
        if let Some(recorder) = &faults.recorder {
            recorder.begin(kind);
        }
        Self { table, at, title, faults, known: RefCell::new(BTreeSet::new()), kind }
    }

    /// A table that is read as all others of this name, wherever it stands.
    pub(crate) fn shared(self, name: &'static str) -> Self {
        let kind =
            self.faults.recorder.as_ref().map_or(self.kind, |recorder| recorder.share(self.kind, name));
        Self { kind, ..self }
    }

    /// Where it stands.
    pub(crate) fn place(&self) -> Place {
        Place::text(self.at)
    }

    /// The value under `key`, if the deck has one.
    pub fn get(&self, key: &'static str) -> Option<Value<'a>> {
        self.known.borrow_mut().insert(key);
        if let Some(recorder) = &self.faults.recorder {
            recorder.ask(self.kind, key);
        }
        let spanned = self.table.get(key)?;
        let span = spanned.span();
        Some(Value {
            value: spanned.get_ref(),
            at: span.start,
            end: span.end,
            key,
            owner: self.kind,
            depth: 0,
            faults: self.faults,
        })
    }

    /// The value under `key`; its absence is a fault. `expected` says what belongs there.
    pub fn require(&self, key: &'static str, expected: &str) -> Option<Value<'a>> {
        if let Some(recorder) = &self.faults.recorder {
            recorder.require(self.kind, key, expected);
        }
        let value = self.get(key);
        if value.is_none() {
            self.faults.add(
                self.at,
                format!("{} without \"{key}\"", self.title),
                expected,
                format!("add {key} = ..."),
            );
        }
        value
    }

    /// Notes for a schema that a table must have a key whose absence its reader tells in words of its own.
    pub(crate) fn must_have(&self, key: &'static str, expected: &str) {
        if let Some(recorder) = &self.faults.recorder {
            recorder.require(self.kind, key, expected);
        }
    }

    /// A number under `key` that passes `range`, or `default` where the key is absent or faulty (a faulty
    /// one is reported).
    pub fn number_or(&self, key: &'static str, default: f64, range: Range) -> f64 {
        self.get(key).and_then(|v| v.number(range)).unwrap_or(default)
    }

    /// An integer under `key` between `min` and `max`, or `default` where it is absent or faulty.
    pub fn integer_or(&self, key: &'static str, default: u64, min: u64, max: u64) -> u64 {
        self.get(key).and_then(|v| v.integer(min, max)).unwrap_or(default)
    }

    /// A required number.
    pub fn number(&self, key: &'static str, range: Range) -> Option<f64> {
        self.require(key, range.words())?.number(range)
    }

    /// A required point or vector.
    pub fn vector(&self, key: &'static str) -> Option<[f64; 3]> {
        self.require(key, "[x, y, z]")?.vector()
    }

    /// The tables of an array of tables such as `[[part]]`; empty where the key is absent.
    pub fn tables(&self, key: &'static str, max: usize) -> Vec<Table<'a>> {
        let Some(value) = self.get(key) else { return Vec::new() };
        let DeValue::Array(array) = value.value else {
            value.fault(&format!("an array of tables [[{key}]]"), &format!("write [[{key}]] before each"));
            return Vec::new();
        };
        if array.len() > max {
            value.faults.add(
                value.at,
                format!("{} [[{key}]] entries", array.len()),
                format!("at most {max}"),
                "merge or split the deck",
            );
            return Vec::new();
        }
        value.record(Kind::List(None));
        let one = Value { depth: 1, ..value };
        let mut tables = Vec::new();
        for (n, item) in array.iter().enumerate() {
            let title = format!("[[{key}]] {}", n + 1);
            match item.get_ref() {
                DeValue::Table(table) => {
                    tables.push(Table::of_kind(
                        table,
                        item.span().start,
                        title,
                        self.faults,
                        one.table_kind(),
                    ));
                }
                _ => Value { value: item.get_ref(), at: item.span().start, end: item.span().end, ..value }
                    .fault("a table", &format!("write [[{key}]] before each")),
            }
        }
        tables
    }

    /// Whether the deck has `key`, without making it known.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Reports every key that nobody asked for.
    pub fn finish(self) {
        let known = self.known.into_inner();
        for key in self.table.keys() {
            let name = key.get_ref().as_ref();
            if known.contains(name) {
                continue;
            }
            let advice = match nearest(name, known.iter().copied()) {
                Some(near) => format!("write \"{near}\", or remove it"),
                None => "remove it".to_string(),
            };
            let words: Vec<&str> = known.iter().copied().collect();
            let span = key.span();
            self.faults.add(
                span.start,
                format!("unknown key \"{}\" in {}", self.faults.quote(span.start, span.end), self.title),
                format!("one of {}", words.join(", ")),
                advice,
            );
        }
    }
}

/// Which numbers a key takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// Above the first and at most the second; the words say so.
    Within(f64, f64, &'static str),
}

impl Range {
    /// Whether a number is one of them.
    pub(crate) fn admits(self, x: f64) -> bool {
        match self {
            Self::Any => true,
            Self::Positive => x > 0.0,
            Self::NotNegative => x >= 0.0,
            Self::Within(low, high, _) => x > low && x <= high,
        }
    }

    /// What is expected.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Any => "a finite number",
            Self::Positive => "a number above 0",
            Self::NotNegative => "a number of 0 or more",
            Self::Within(_, _, words) => words,
        }
    }
}

impl<'a> Value<'a> {
    /// What the deck says here, as `key = value`.
    pub fn words(&self) -> String {
        format!("{} = {}", self.key, self.faults.quote(self.at, self.end))
    }

    /// The words that it stands in.
    pub(crate) fn origin(&self) -> Origin {
        Origin { at: Place::text(self.at), end: self.end as u32, word: self.key }
    }

    /// Something that was read here, with these words.
    pub(crate) fn placed<T>(&self, value: T) -> Placed<T> {
        Placed::new(value, self.origin())
    }

    /// Notes what a reader asks of this value.
    fn record(&self, kind: Kind) {
        if let Some(recorder) = &self.faults.recorder {
            recorder.note(self.owner, self.key, self.depth, kind);
        }
    }

    /// The kind of the table that this value is.
    fn table_kind(&self) -> usize {
        match &self.faults.recorder {
            Some(recorder) => recorder.table(self.owner, self.key, self.depth),
            None => Recorder::WHOLE,
        }
    }

    /// Notes a question whose answer decides how a reader goes on.
    fn answered(&self, question: &'static str, answer: bool) -> bool {
        if let Some(recorder) = &self.faults.recorder {
            recorder.answer(self.owner, self.key, self.depth, question, answer);
        }
        answer
    }

    /// Reports this value.
    pub fn fault(&self, expected: &str, advice: &str) {
        self.faults.add(self.at, self.words(), expected, advice);
    }

    /// A finite number in `range`.
    pub fn number(&self, range: Range) -> Option<f64> {
        self.record(Kind::Number(range));
        let number = match self.value {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => {
                i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64)
            }
            _ => None,
        };
        // Infinities and NaN are not numbers of a deck.
        let number = number.filter(|x| x.is_finite() && range.admits(*x));
        if let Some(x) = number
            && !holds(x)
        {
            self.fault(&format!("a magnitude from 1e-60 to {MAX_NUMBER:e}, or 0"), "choose other units");
            return None;
        }
        if number.is_none() {
            self.fault(range.words(), &format!("change {}", self.key));
        }
        number.map(|x| x + 0.0)
    }

    /// An integer from `min` to `max`.
    pub fn integer(&self, min: u64, max: u64) -> Option<u64> {
        self.record(Kind::Integer(min, max));
        let number = match self.value {
            DeValue::Integer(integer) => u64::from_str_radix(integer.as_str(), integer.radix()).ok(),
            _ => None,
        };
        let number = number.filter(|n| (min..=max).contains(n));
        if number.is_none() {
            self.fault(&format!("a whole number from {min} to {max}"), &format!("change {}", self.key));
        }
        number
    }

    pub fn text(&self) -> Option<&'a str> {
        self.record(Kind::Text);
        self.characters()
    }

    fn characters(&self) -> Option<&'a str> {
        match self.value {
            DeValue::String(text) => Some(text.as_ref()),
            _ => {
                self.fault("a text in quotes", "put it in double quotes");
                None
            }
        }
    }

    /// A name: letters, digits, space, dash and underscore, at most [`MAX_NAME`]; it becomes a column
    /// heading or a file name.
    pub fn name(&self) -> Option<String> {
        self.record(Kind::Name);
        let text = self.characters()?;
        let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, ' ' | '-' | '_');
        if text.is_empty() || text.len() > MAX_NAME || !text.chars().all(fits) || text.trim() != text {
            self.fault(
                &format!("1 to {MAX_NAME} letters, digits, spaces, dashes or underscores"),
                "choose another name",
            );
            return None;
        }
        Some(text.to_string())
    }

    /// One of a few words; the index of the word.
    pub fn one_of(&self, words: &[&'static str]) -> Option<usize> {
        self.record(Kind::Words(words.to_vec()));
        let text = self.characters()?;
        let found = words.iter().position(|w| *w == text);
        if found.is_none() {
            let advice = match nearest(text, words.iter().copied()) {
                Some(near) => format!("write \"{near}\""),
                None => "choose one of them".to_string(),
            };
            self.fault(&format!("one of {}", words.join(", ")), &advice);
        }
        found
    }

    /// True or false.
    pub fn boolean(&self) -> Option<bool> {
        self.record(Kind::Boolean);
        match self.value {
            DeValue::Boolean(b) => Some(*b),
            _ => {
                self.fault("true or false", "write true or false without quotes");
                None
            }
        }
    }

    /// A point or vector `[x, y, z]` of finite numbers.
    pub fn vector(&self) -> Option<[f64; 3]> {
        self.numbers::<3>("[x, y, z]", Range::Any)
    }

    /// Exactly `N` numbers in `range`.
    pub fn numbers<const N: usize>(&self, expected: &str, range: Range) -> Option<[f64; N]> {
        let items = self.fixed::<N>(expected)?;
        let read = items.map(|item| item.number(range));
        if read.iter().any(Option::is_none) {
            return None;
        }
        Some(read.map(|x| x.unwrap_or_default()))
    }

    /// Exactly `N` whole numbers from `min` to `max`.
    pub fn integers<const N: usize>(&self, expected: &str, min: u64, max: u64) -> Option<[u64; N]> {
        let items = self.fixed::<N>(expected)?;
        let read = items.map(|item| item.integer(min, max));
        if read.iter().any(Option::is_none) {
            return None;
        }
        Some(read.map(|x| x.unwrap_or_default()))
    }

    /// Exactly `N` values.
    pub fn fixed<const N: usize>(&self, expected: &str) -> Option<[Value<'a>; N]> {
        let items = match self.value {
            DeValue::Array(array) if array.len() == N => {
                self.record(Kind::List(Some(N)));
                self.list()?
            }
            _ => {
                self.fault(expected, &format!("write {N} values in square brackets"));
                return None;
            }
        };
        items.try_into().ok()
    }

    /// The items of an array.
    pub fn items(&self) -> Option<Vec<Value<'a>>> {
        self.record(Kind::List(None));
        self.list()
    }

    fn list(&self) -> Option<Vec<Value<'a>>> {
        let DeValue::Array(array) = self.value else {
            self.fault("a list in square brackets", "write [ ... ]");
            return None;
        };
        Some(
            array
                .iter()
                .map(|item| Value {
                    value: item.get_ref(),
                    at: item.span().start,
                    end: item.span().end,
                    depth: self.depth + 1,
                    ..*self
                })
                .collect(),
        )
    }

    /// Whether this is a text (rather than a list or table).
    pub fn is_text(&self) -> bool {
        self.answered("a text", matches!(self.value, DeValue::String(_)))
    }

    /// Whether this is a list of so many values.
    pub(crate) fn is_list_of(&self, n: usize) -> bool {
        self.answered("of that length", matches!(self.value, DeValue::Array(array) if array.len() == n))
    }

    pub fn is_list(&self) -> bool {
        self.answered("a list", matches!(self.value, DeValue::Array(_)))
    }

    /// Whether the value is a list of nothing.
    pub fn is_empty_list(&self) -> bool {
        matches!(self.value, DeValue::Array(list) if list.is_empty())
    }

    pub fn is_table(&self) -> bool {
        self.answered("a table", matches!(self.value, DeValue::Table(_)))
    }

    /// A table called `title`.
    pub fn table(&self, title: String) -> Option<Table<'a>> {
        match self.value {
            DeValue::Table(table) => {
                Some(Table::of_kind(table, self.at, title, self.faults, self.table_kind()))
            }
            _ => {
                self.fault("a table", &format!("write {} = {{ ... }} or a [table] heading", self.key));
                None
            }
        }
    }
}
