//! Faults and warnings of a deck, in the words of the format that its user wrote.

use std::{cell::RefCell, collections::BTreeMap, fmt};

use crate::{
    fault::{Fault, Faults, MAX_FAULTS, once_for_one_cause},
    limits::{Bounds, MAX_ELEMENTS},
    place::{Origin, Place},
};

/// The format that a user wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    Toml,
    Keyword,
}

/// Something a user should know about a deck that runs. Displayed as `file:line: words`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// What is done otherwise than the deck says.
    pub words: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.line, self.words)
    }
}

/// What was found so far in all files of a deck. Readers and checks share one.
pub(crate) struct Log<'a> {
    /// Where tables of a TOML deck report.
    pub(crate) faults: Faults<'a>,
    dialect: Dialect,
    files: Vec<&'a str>,
    warnings: RefCell<Vec<(Place, String)>>,
    /// Keywords that change nothing here, by name: the first line of each.
    ignored: RefCell<BTreeMap<String, Place>>,
    /// Most elements that the deck may ask for.
    most_elements: u64,
    /// Whether nobody waits for the deck any more.
    is_given_up: Option<&'a dyn Fn() -> bool>,
}

impl<'a> Log<'a> {
    /// Nothing found yet in a TOML deck and its mesh files.
    pub(crate) fn toml(files: &[(&'a str, &'a str)]) -> Self {
        Self::of(Dialect::Toml, files)
    }

    /// Nothing found yet in the files of a keyword deck.
    pub(crate) fn keyword(files: &[(&'a str, &'a str)]) -> Self {
        Self::of(Dialect::Keyword, files)
    }

    fn of(dialect: Dialect, files: &[(&'a str, &'a str)]) -> Self {
        Self {
            faults: Faults::of_files(files),
            dialect,
            files: files.iter().map(|(name, _)| *name).collect(),
            warnings: RefCell::new(Vec::new()),
            ignored: RefCell::new(BTreeMap::new()),
            most_elements: MAX_ELEMENTS,
            is_given_up: None,
        }
    }

    /// A log in the same words for checks that are made again: nobody reads it.
    pub(crate) fn quiet(&self) -> Log<'static> {
        Log { most_elements: self.most_elements, ..Log::of(self.dialect, &[]) }
    }

    /// A fault at a place. Of a card of a keyword deck its keyword is told too.
    pub(crate) fn fault(
        &self,
        at: Place,
        read: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        let read: String = read.into();
        let card = if read.starts_with('*') { None } else { self.card(at) };
        let read = card.map_or(read.clone(), |card| format!("{read} ({card})"));
        self.faults.add_at(at, read, expected, advice);
    }

    /// A fault of a field, from 0, of a card.
    pub(crate) fn fault_in_field(
        &self,
        at: Place,
        field: usize,
        read: &str,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        let read = match self.card(at) {
            Some(card) => format!("{read} (field {}, {card})", field + 1),
            None => read.to_string(),
        };
        self.faults.add_at(at, read, expected, advice);
    }

    /// A fault of a value, which is quoted.
    pub(crate) fn fault_of(&self, origin: Origin, expected: impl Into<String>, advice: impl Into<String>) {
        self.fault(origin.at, self.quote_origin(origin), expected, advice);
    }

    /// What a deck says at an origin: `key = value`, or `FIELD = value`.
    fn quote_origin(&self, origin: Origin) -> String {
        let value = self.faults.quote_origin(origin);
        match (origin.word, value.as_str()) {
            ("", _) => "this card".to_string(),
            (word, "") => format!("{word} blank"),
            (word, value) => format!("{word} = {value}"),
        }
    }

    /// Which card of which keyword stands at a place of a keyword deck; none of a place that is no card, or far below its
    /// keyword, as in a list of nodes.
    fn card(&self, at: Place) -> Option<String> {
        const FAR: u32 = 1000;
        if self.dialect != Dialect::Keyword {
            return None;
        }
        let Place::Card { file, line, .. } = at else { return None };
        let mut number = 0;
        for line in (line.saturating_sub(FAR).max(1)..=line).rev() {
            let words = self.faults.line(file, line);
            if let Some(keyword) = words.strip_prefix('*') {
                let keyword = keyword.split_whitespace().next().unwrap_or_default().to_ascii_uppercase();
                return (number > 0).then(|| format!("card {number} of *{keyword}"));
            }
            number += u32::from(!words.starts_with('$'));
        }
        None
    }

    /// Of the same words in both formats those of the user's.
    pub(crate) fn say<'w>(&self, toml: &'w str, keyword: &'w str) -> &'w str {
        match self.dialect {
            Dialect::Toml => toml,
            Dialect::Keyword => keyword,
        }
    }

    /// Whether the user wrote keywords.
    pub(crate) fn is_of_keywords(&self) -> bool {
        self.dialect == Dialect::Keyword
    }

    /// `line 12`, with its file where that is not the one of `from`.
    pub(crate) fn line(&self, at: Place, from: Place) -> String {
        self.faults.line_seen_from(at, from)
    }

    /// Most elements that the deck may ask for.
    pub(crate) fn most_elements(&self) -> u64 {
        self.most_elements
    }

    /// Has the deck ask for no more elements, nor for more than any deck may, and somebody say when it is given up.
    pub(crate) fn within(mut self, bounds: &Bounds<'a>) -> Self {
        self.most_elements = bounds.elements.min(MAX_ELEMENTS);
        self.is_given_up = Some(bounds.is_given_up);
        self
    }

    /// Whether nobody waits for the deck any more: then what was read of it is of no use.
    pub(crate) fn is_given_up(&self) -> bool {
        self.is_given_up.is_some_and(|is_given_up| is_given_up())
    }

    /// None where nobody waits for the deck any more, for functions that go no further then.
    pub(crate) fn wanted(&self) -> Option<()> {
        (!self.is_given_up()).then_some(())
    }

    pub(crate) fn warn(&self, at: Place, words: impl Into<String>) {
        let warning = (at.at_column(1), words.into());
        let mut warnings = self.warnings.borrow_mut();
        if warnings.len() < MAX_FAULTS && !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }

    /// A keyword that changes nothing here.
    pub(crate) fn ignore(&self, at: Place, keyword: &str) {
        self.ignored.borrow_mut().entry(keyword.to_string()).or_insert(at);
    }

    /// Number of faults so far.
    pub(crate) fn count(&self) -> usize {
        self.faults.count()
    }

    /// A piece of a line, cut to a readable length; `a blank field` where there is nothing.
    pub(crate) fn quote(&self, words: &str) -> String {
        const MAX_QUOTE: usize = 60;
        let words = words.trim();
        match words.char_indices().nth(MAX_QUOTE) {
            _ if words.is_empty() => "a blank field".to_string(),
            Some((end, _)) => format!("{}...", &words[..end]),
            None => words.to_string(),
        }
    }

    /// Faults and warnings, each in the order of their places.
    pub(crate) fn into_lists(self) -> (Vec<Fault>, Vec<Warning>) {
        let mut warnings = self.warnings.into_inner();
        let ignored = self.ignored.into_inner();
        let line = |at: &Place| self.faults.line_and_column(*at).0;
        if let Some(first) = ignored.values().min() {
            let names: Vec<String> =
                ignored.iter().map(|(name, at)| format!("*{name} (line {})", line(at))).collect();
            let words = format!("ignored, nothing here depends on it: {}", names.join(", "));
            warnings.push((*first, words));
        }
        warnings.sort();
        let file = |at: &Place| match at {
            Place::Card { file, .. } => self.files.get(usize::from(*file)).copied().unwrap_or("deck"),
            Place::Text(_) => self.files.first().copied().unwrap_or("deck"),
        };
        let warnings: Vec<Warning> = warnings
            .into_iter()
            .map(|(at, words)| Warning { file: file(&at).to_string(), line: line(&at), words })
            .collect();
        let faults = match self.dialect {
            Dialect::Keyword => once_for_one_cause(self.faults.into_list()),
            Dialect::Toml => self.faults.into_list(),
        };
        (faults, warnings)
    }
}
