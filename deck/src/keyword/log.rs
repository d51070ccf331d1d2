//! Faults and warnings of a deck of several files.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::fmt;

use crate::fault::{Fault, MAX_FAULTS};

/// Longest piece of a line quoted (characters).
const MAX_QUOTE: usize = 60;

/// A line of one of the files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    /// Index of the file in the bundle.
    pub(crate) file: u16,
    /// From 1.
    pub(crate) line: u32,
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

/// What was found so far.
pub(crate) struct Log {
    files: Vec<String>,
    faults: RefCell<Vec<(Place, Fault)>>,
    more: Cell<usize>,
    warnings: RefCell<Vec<(Place, String)>>,
    /// Keywords that change nothing here, by name: the first line of each.
    ignored: RefCell<BTreeMap<String, Place>>,
}

impl Log {
    pub(crate) fn new(files: Vec<String>) -> Self {
        Self {
            files,
            faults: RefCell::new(Vec::new()),
            more: Cell::new(0),
            warnings: RefCell::new(Vec::new()),
            ignored: RefCell::new(BTreeMap::new()),
        }
    }

    /// A fault at the start of a line.
    pub(crate) fn fault(
        &self,
        at: Place,
        read: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        self.fault_in(at, 1, read, expected, advice);
    }

    /// A fault at a column of a line, from 1.
    pub(crate) fn fault_in(
        &self,
        at: Place,
        column: u32,
        read: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        if self.faults.borrow().len() >= MAX_FAULTS {
            self.more.set(self.more.get() + 1);
            return;
        }
        let fault = Fault {
            file: self.file(at).to_string(),
            line: at.line,
            column,
            read: read.into(),
            expected: expected.into(),
            advice: advice.into(),
        };
        self.faults.borrow_mut().push((at, fault));
    }

    /// A warning.
    pub(crate) fn warn(&self, at: Place, words: impl Into<String>) {
        let warning = (at, words.into());
        let mut warnings = self.warnings.borrow_mut();
        if warnings.len() < MAX_FAULTS && !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }

    /// A keyword that changes nothing here.
    pub(crate) fn ignore(&self, at: Place, keyword: &str) {
        self.ignored.borrow_mut().entry(keyword.to_string()).or_insert(at);
    }

    /// Name of the file of a place.
    pub(crate) fn file(&self, at: Place) -> &str {
        self.files.get(usize::from(at.file)).map_or("deck", String::as_str)
    }

    /// Number of faults so far.
    pub(crate) fn count(&self) -> usize {
        self.faults.borrow().len() + self.more.get()
    }

    /// A piece of a line, cut to a readable length; `a blank card` where there is nothing.
    pub(crate) fn quote(&self, words: &str) -> String {
        let words = words.trim();
        match words.char_indices().nth(MAX_QUOTE) {
            _ if words.is_empty() => "a blank field".to_string(),
            Some((end, _)) => format!("{}...", &words[..end]),
            None => words.to_string(),
        }
    }

    /// Faults and warnings, each in the order of their places.
    pub(crate) fn into_lists(self) -> (Vec<Fault>, Vec<Warning>) {
        let mut faults = self.faults.into_inner();
        faults.sort_by_key(|(at, fault)| (*at, fault.column));
        let mut faults: Vec<Fault> = faults.into_iter().map(|(_, fault)| fault).collect();
        if self.more.get() > 0 {
            faults.push(Fault {
                file: self.files.first().cloned().unwrap_or_default(),
                line: 1,
                column: 1,
                read: format!("{} more faults", self.more.get()),
                expected: "none".to_string(),
                advice: "mend those above and check again".to_string(),
            });
        }
        let mut warnings = self.warnings.into_inner();
        let ignored = self.ignored.into_inner();
        if let Some(first) = ignored.values().min() {
            let names: Vec<String> =
                ignored.iter().map(|(name, at)| format!("*{name} (line {})", at.line)).collect();
            let words = format!("ignored, nothing here depends on it: {}", names.join(", "));
            warnings.push((*first, words));
        }
        warnings.sort();
        let name = |at: &Place| self.files.get(usize::from(at.file)).cloned().unwrap_or_default();
        let warnings = warnings
            .into_iter()
            .map(|(at, words)| Warning { file: name(&at), line: at.line, words })
            .collect();
        (faults, warnings)
    }
}
