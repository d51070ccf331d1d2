//! A fault of a deck: where it stands, what was read, what was expected, what to do.
//!
//! Reading never stops at the first fault: every stage adds to one [`Faults`] and goes on with what it
//! has, so a user sees the whole list at once.

use std::{
    cell::{Cell, OnceCell, RefCell},
    fmt,
};

use crate::{
    place::{Origin, Place},
    schema::recorder::Recorder,
};

/// Most faults reported for one deck; the list ends with the number left out.
pub const MAX_FAULTS: usize = 500;

/// Most faults in a row that differ in their lines alone.
const MAX_ALIKE: usize = 3;

/// Longest piece of deck text quoted in a fault (characters).
const MAX_QUOTE: usize = 60;

/// One fault. Displayed as `file:line:column: read X; expected Y; do Z`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Name of the deck as its caller gave it.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// What stands in the deck.
    pub read: String,
    /// What should stand there.
    pub expected: String,
    /// What the user can do.
    pub advice: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, read, expected, advice } = self;
        write!(f, "{file}:{line}:{column}: read {read}; expected {expected}; {advice}")
    }
}

impl std::error::Error for Fault {}

/// A file of a deck, and where its lines start.
struct File<'a> {
    name: &'a str,
    text: &'a str,
    line_starts: OnceCell<Vec<usize>>,
}

impl File<'_> {
    fn line_starts(&self) -> &[usize] {
        let starts = || std::iter::once(0).chain(self.text.match_indices('\n').map(|(i, _)| i + 1)).collect();
        self.line_starts.get_or_init(starts)
    }
}

/// The faults found so far, with the texts that turn offsets into lines and columns.
pub struct Faults<'a> {
    files: Vec<File<'a>>,
    /// Each with the index of its file.
    list: RefCell<Vec<(u16, Fault)>>,
    /// Faults past [`MAX_FAULTS`], which are only counted.
    more: Cell<usize>,
    /// What readers ask, where somebody wants to know.
    pub(crate) recorder: Option<Recorder>,
}

impl<'a> Faults<'a> {
    /// No faults yet of one file.
    pub fn new(file: &'a str, text: &'a str) -> Self {
        Self::of_files(&[(file, text)])
    }

    /// No faults yet of several files, of which there is at least one.
    pub(crate) fn of_files(files: &[(&'a str, &'a str)]) -> Self {
        let file = |(name, text): &(&'a str, &'a str)| File { name, text, line_starts: OnceCell::new() };
        Self {
            files: files.iter().map(file).collect(),
            list: RefCell::new(Vec::new()),
            more: Cell::new(0),
            recorder: None,
        }
    }

    /// Adds a fault at byte offset `at` of the text.
    pub fn add(
        &self,
        at: usize,
        read: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        self.add_at(Place::text(at), read, expected, advice);
    }

    /// Adds a fault at a place.
    pub(crate) fn add_at(
        &self,
        at: Place,
        read: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) {
        if self.full() {
            self.more.set(self.more.get() + 1);
            return;
        }
        let (line, column) = self.line_and_column(at);
        let file = at.file();
        let fault = Fault {
            file: self.name(file).to_string(),
            line,
            column,
            read: read.into(),
            expected: expected.into(),
            advice: advice.into(),
        };
        self.list.borrow_mut().push((file, fault));
    }

    fn name(&self, file: u16) -> &'a str {
        self.files.get(usize::from(file)).map_or("deck", |file| file.name)
    }

    /// Line and column of a place, both from 1.
    pub(crate) fn line_and_column(&self, at: Place) -> (u32, u32) {
        match at {
            Place::Text(at) => self.place(at as usize),
            Place::Card { line, column, .. } => (line, u32::from(column)),
        }
    }

    /// The line of a place, for a message about another place: with its file where that is another.
    pub(crate) fn line_seen_from(&self, at: Place, from: Place) -> String {
        let (line, _) = self.line_and_column(at);
        match at.file() == from.file() {
            true => format!("line {line}"),
            false => format!("line {line} of {}", self.name(at.file())),
        }
    }

    /// Line and column of a byte offset, both from 1. Offsets past the end or inside a character are
    /// moved back to the nearest character.
    pub fn place(&self, at: usize) -> (u32, u32) {
        let Some(file) = self.files.first() else { return (1, 1) };
        let mut at = at.min(file.text.len());
        while !file.text.is_char_boundary(at) {
            at -= 1;
        }
        let starts = file.line_starts();
        let line = starts.partition_point(|&start| start <= at);
        (line as u32, file.text[starts[line - 1]..at].chars().count() as u32 + 1)
    }

    /// The deck's own words between two offsets, on one line and cut to a readable length.
    pub fn quote(&self, from: usize, to: usize) -> String {
        let text = self.files.first().map_or("", |file| file.text);
        cut(text.get(from..to).unwrap_or_default())
    }

    /// The words between two places of one file, the second given as [`Origin::end`] is.
    pub(crate) fn quote_origin(&self, origin: Origin) -> String {
        match origin.at {
            Place::Text(at) => self.quote(at as usize, origin.end as usize),
            Place::Card { file, line, column } => {
                let from = usize::from(column).saturating_sub(1);
                let long = (origin.end as usize).saturating_sub(usize::from(column));
                cut(&self.line(file, line).chars().skip(from).take(long).collect::<String>())
            }
        }
    }

    /// A line of a file, from 1, without its end.
    pub(crate) fn line(&self, file: u16, line: u32) -> &'a str {
        let Some(file) = self.files.get(usize::from(file)) else { return "" };
        let starts = file.line_starts();
        let Some(from) = starts.get((line as usize).wrapping_sub(1)) else { return "" };
        let to = starts.get(line as usize).copied().unwrap_or(file.text.len());
        file.text[*from..to].trim_end()
    }

    pub fn count(&self) -> usize {
        self.list.borrow().len() + self.more.get()
    }

    /// Whether further faults are only counted; advice for them need not be sought.
    pub fn full(&self) -> bool {
        self.list.borrow().len() >= MAX_FAULTS
    }

    /// The faults in the order of their places, at most [`MAX_FAULTS`] and then one with the rest.
    pub fn into_list(self) -> Vec<Fault> {
        let mut list = std::mem::take(&mut *self.list.borrow_mut());
        list.sort_by_key(|(file, fault)| (*file, fault.line, fault.column));
        let mut list: Vec<Fault> = list.into_iter().map(|(_, fault)| fault).collect();
        let rest = self.more.get();
        if rest > 0 {
            list.push(Fault {
                file: self.name(0).to_string(),
                line: 1,
                column: 1,
                read: format!("{rest} more faults"),
                expected: "none".to_string(),
                advice: "fix those above and check again".to_string(),
            });
        }
        list
    }
}

/// Of faults that say the same of line after line, as a column of numbers that is shifted gives, the first few, of which the last tells
/// how many follow; and of those that are equal in all words the first.
pub(crate) fn once_for_one_cause(list: Vec<Fault>) -> Vec<Fault> {
    let alike = |a: &Fault, b: &Fault| {
        (&a.file, a.column, &a.expected, &a.advice) == (&b.file, b.column, &b.expected, &b.advice)
    };
    let mut kept: Vec<Fault> = Vec::new();
    let mut rest = list.into_iter().peekable();
    while let Some(first) = rest.next() {
        let mut run = vec![first];
        while let Some(next) = rest.next_if(|next| alike(&run[0], next)) {
            if !run.contains(&next) {
                run.push(next);
            }
        }
        let hidden = run.len().saturating_sub(MAX_ALIKE);
        let last_line = run.last().map_or(0, |fault| fault.line);
        run.truncate(MAX_ALIKE);
        if let (Some(last), true) = (run.last_mut(), hidden > 0) {
            last.advice.push_str(&format!("; {hidden} more lines have this fault, to line {last_line}"));
        }
        kept.append(&mut run);
    }
    kept
}

/// Words on one line, cut to a readable length.
fn cut(piece: &str) -> String {
    let mut words = String::new();
    for (n, c) in piece.split_whitespace().flat_map(|w| w.chars().chain([' '])).enumerate() {
        if n >= MAX_QUOTE {
            return words.trim_end().to_string() + "...";
        }
        words.push(c);
    }
    words.trim_end().to_string()
}

/// A measured number to six digits, for messages.
pub fn short(x: f64) -> String {
    let rounded = format!("{x:.5e}").parse().unwrap_or(x);
    let magnitude = f64::abs(rounded);
    if magnitude == 0.0 || (1e-4..1e7).contains(&magnitude) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// The known word nearest to `word`, if it is near enough to be what was meant. Words of the same pieces in another order are nearest.
pub fn nearest<'w>(word: &str, known: impl IntoIterator<Item = &'w str>) -> Option<&'w str> {
    if word.chars().count() > MAX_QUOTE {
        return None;
    }
    let lower = word.to_lowercase();
    known
        .into_iter()
        .map(|k| (k.to_lowercase(), k))
        .map(|(known, k)| {
            (if pieces(&known) == pieces(&lower) { 0 } else { edit_distance(&lower, &known) }, k)
        })
        .filter(|&(d, k)| d <= 1 + k.chars().count() / 3)
        .min_by_key(|&(d, _)| d)
        .map(|(_, k)| k)
}

/// The pieces between dashes, in alphabetical order.
fn pieces(word: &str) -> Vec<&str> {
    let mut pieces: Vec<&str> = word.split('-').collect();
    pieces.sort_unstable();
    pieces
}

/// Least number of insertions, deletions and replacements between two words (Levenshtein).
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_characters_not_bytes() {
        let faults = Faults::new("a.toml", "title = \"é\" x\ny");
        assert_eq!(faults.place(12), (1, 12));
        assert_eq!(faults.place(14), (1, 14));
        assert_eq!(faults.place(15), (2, 1));
        assert_eq!(faults.place(1000), (2, 2));
    }

    #[test]
    fn measured_numbers_are_written_with_six_digits() {
        assert_eq!(short(0.020000000000000018), "0.02");
        assert_eq!(short(-1.0 + 1e-16), "-1");
        assert_eq!(short(1.234567891e-9), "1.23457e-9");
        assert_eq!(short(f64::NAN), "NaN");
    }

    #[test]
    fn nearest_finds_a_misspelt_key_and_ignores_a_foreign_one() {
        assert_eq!(nearest("velocty", ["velocity", "material"]), Some("velocity"));
        assert_eq!(nearest("banana", ["velocity", "material"]), None);
        assert_eq!(nearest("mm-kg-ms", ["cm-g-us", "mm-ms-kg"]), Some("mm-ms-kg"));
    }

    #[test]
    fn faults_are_listed_in_the_order_of_their_places() {
        let faults = Faults::new("a.toml", "a\nb\nc");
        faults.add(4, "c", "d", "write d");
        faults.add(0, "a", "b", "write b");
        let text: Vec<String> = faults.into_list().iter().map(Fault::to_string).collect();
        assert_eq!(
            text,
            ["a.toml:1:1: read a; expected b; write b", "a.toml:3:1: read c; expected d; write d"]
        );
    }
}
