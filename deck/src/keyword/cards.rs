//! Lines of keyword files, put together: blocks of cards with their places, includes followed, cases chosen.
//!
//! What was seen in decks is read as LS-DYNA reads it: `$` comments inside cards, blank lines that are cards, words
//! behind a keyword, `*END` in the middle of a file, options of a keyword such as `LONG=Y` and `CID=1`.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use super::parameter::Parameters;
use crate::{
    bundle::Bundle,
    include::{beside, candidates, has_end, lines, path_of},
    log::Log,
    place::Place,
};

/// Deepest nesting of includes.
const MAX_DEPTH: usize = 16;
/// Most lines of all files together.
const MAX_LINES: usize = 64_000_000;
/// Most includes that are followed: a file may be named again and again, and so may those that it names.
const MAX_INCLUDES: usize = 10_000;
/// Lines that includes may repeat, beside those that the files have.
const MAX_REPEATED: usize = 1_000_000;

/// How wide the fields of a card are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Width {
    /// As each keyword's page says.
    Standard,
    /// Fields of 8 have 10 columns.
    I10,
    /// All fields have 20 columns.
    Long,
}

/// One line that is neither a comment nor a keyword.
#[derive(Clone, Debug)]
pub(super) struct Card<'a> {
    pub(super) at: Place,
    /// Without its line end and trailing blanks.
    pub(super) text: Cow<'a, str>,
    /// Whether somebody took anything from it.
    is_read: Cell<bool>,
}

impl<'a> Card<'a> {
    pub(super) fn new(at: Place, text: Cow<'a, str>) -> Self {
        Self { at, text, is_read: Cell::new(false) }
    }

    pub(super) fn is_blank(&self) -> bool {
        self.text.trim().is_empty()
    }

    /// Notes that the card was read, or that it may be left.
    pub(super) fn mark(&self) {
        self.is_read.set(true);
    }
}

/// A keyword with its cards.
#[derive(Clone, Debug)]
pub(super) struct Block<'a> {
    pub(super) at: Place,
    /// In capitals, without the star and without words behind it.
    pub(super) keyword: String,
    pub(super) width: Width,
    pub(super) cards: Vec<Card<'a>>,
    /// Whether each set of cards has a heading of its own before it, which its reader passes over.
    pub(super) is_headed: bool,
    /// Index among all blocks of the deck, by which parameters have their values.
    pub(super) order: usize,
    /// What stands behind the last card.
    end: Card<'a>,
}

impl<'a> Block<'a> {
    fn new(at: Place, keyword: String, width: Width) -> Self {
        Self {
            at,
            keyword,
            width,
            cards: Vec::new(),
            is_headed: false,
            order: 0,
            end: Card::new(at, Cow::Borrowed("")),
        }
    }

    /// Takes `suffix` off the keyword; whether it was there.
    pub(super) fn take(&mut self, suffix: &str) -> bool {
        let stem = self.keyword.strip_suffix(suffix).map(str::len);
        if let Some(length) = stem {
            self.keyword.truncate(length);
        }
        stem.is_some()
    }

    /// The card of that index; a blank one past the end, as LS-DYNA reads defaults there.
    pub(super) fn card(&self, index: usize) -> &Card<'a> {
        self.cards.get(index).unwrap_or(&self.end)
    }

    /// Drops the blank cards at the end.
    pub(super) fn trim(&mut self) {
        while self.cards.last().is_some_and(Card::is_blank) {
            self.cards.pop();
        }
        self.end.at = self.cards.last().map_or(self.at, |card| card.at);
    }

    /// Leaves the first `n` cards: those that were not read change nothing here.
    pub(super) fn leave(&self, n: usize) {
        self.cards.iter().take(n).for_each(Card::mark);
    }

    /// Leaves all cards.
    pub(super) fn leave_all(&self) {
        self.leave(self.cards.len());
    }

    /// A keyword that changes nothing here: its cards are left.
    pub(super) fn ignore(&self, log: &Log<'_>) {
        self.leave_all();
        log.ignore(self.at, &self.keyword);
    }

    /// Reports the first card that nobody read and nobody left, so that no keyword drops cards in silence.
    pub(super) fn check_all_is_read(&self, log: &Log<'_>) {
        // Cards of zeros say as little as blank ones.
        let says = |card: &Card<'_>| card.text.contains(|c: char| !matches!(c, ' ' | ',' | '0' | '.'));
        let unread = |card: &&Card<'_>| !card.is_read.get() && says(card);
        let Some(card) = self.cards.iter().find(unread) else { return };
        log.fault(
            card.at,
            log.quote(&card.text),
            format!(
                "no further card of *{}: this one and those below it are not read",
                log.quote(&self.keyword)
            ),
            "write the keyword again before each set of cards, or take the card out",
        );
    }
}

/// What the lines of a deck hold.
pub(super) struct Lines<'a> {
    pub(super) blocks: Vec<Block<'a>>,
    pub(super) parameters: Parameters,
}

/// A walk through the files of a bundle.
struct Walk<'b, 'a> {
    bundle: &'b Bundle<'a>,
    log: &'b Log<'b>,
    folders: Vec<String>,
    blocks: Vec<Block<'a>>,
    parameters: Parameters,
    /// Parameters from outside that the deck has not defined yet.
    given: BTreeSet<&'b str>,
    n_lines: usize,
    /// Most of them, for files of this length.
    most_lines: usize,
    n_includes: usize,
    /// A limit was met: nothing more is read.
    full: bool,
    /// Cases of the deck: their number and the command identifiers they switch on.
    cases: BTreeMap<u32, Vec<u32>>,
    first_case: Option<Place>,
    /// Identifiers of the case that was chosen.
    active: BTreeSet<u32>,
    /// Identifiers of the `*CASE_BEGIN_n` that are open and not chosen.
    closed: Vec<u32>,
    left_out: usize,
}

pub(super) fn read<'a>(bundle: &Bundle<'a>, log: &Log<'_>) -> Lines<'a> {
    let mut walk = Walk {
        bundle,
        log,
        folders: Vec::new(),
        blocks: Vec::new(),
        parameters: Parameters::default(),
        given: bundle.options.parameters.keys().map(String::as_str).collect(),
        n_lines: 0,
        most_lines: MAX_LINES
            .min(MAX_REPEATED + bundle.files.iter().map(|(_, text)| text.len()).sum::<usize>()),
        n_includes: 0,
        full: false,
        cases: BTreeMap::new(),
        first_case: None,
        active: BTreeSet::new(),
        closed: Vec::new(),
        left_out: 0,
    };
    walk.file(0, 0);
    for name in std::mem::take(&mut walk.given) {
        log.fault(
            Place::card(0, 1),
            format!("a deck without a *PARAMETER {name}"),
            format!("{name}, which is given, as a parameter of the deck"),
            "define it in the deck, or do not give it",
        );
    }
    walk.conclude();
    Lines { blocks: walk.blocks, parameters: walk.parameters }
}

impl<'a> Walk<'_, 'a> {
    /// A file; the parameters that are its own end with it.
    fn file(&mut self, file: usize, depth: usize) {
        self.parameters.enter();
        self.lines_of(file, depth);
        self.parameters.leave(self.blocks.len());
    }

    fn lines_of(&mut self, file: usize, depth: usize) {
        let text = self.bundle.files[file].1;
        let mut width = Width::Standard;
        let mut block: Option<Block<'a>> = None;
        for (line, words) in lines(text) {
            self.n_lines += 1;
            let at = Place::card(file as u16, line);
            if self.full {
                return;
            }
            if self.n_lines > self.most_lines {
                self.full = true;
                self.log.fault(
                    at,
                    "more lines",
                    format!("at most {} in all files, as often as they are included", self.most_lines),
                    "shorten the deck, or include a file once",
                );
                return;
            }
            let Some(keyword) = words.strip_prefix('*') else {
                if let Some(block) = &mut block {
                    block.cards.push(Card::new(at, plain(words)));
                } else if !words.trim().is_empty() {
                    let quote = words.trim();
                    self.log.fault(at, self.log.quote(quote), "a keyword first", "put it under a *KEYWORD");
                    return;
                }
                continue;
            };
            self.close(block.take(), depth);
            block = self.open(at, keyword, &mut width);
        }
        if let Some(block) = block.as_ref().filter(|_| depth == 0) {
            self.warn_of_cut(block, text);
        }
        self.close(block, depth);
    }

    /// Warns of a deck that ends among its nodes or elements, as one does whose upload was cut off.
    fn warn_of_cut(&self, last: &Block<'_>, text: &str) {
        let is_long = last.keyword == "NODE" || last.keyword.starts_with("ELEMENT_");
        if is_long && !has_end(text) {
            let words = format!(
                "the file ends with a *{}, without *END: if it was cut off, nodes, elements or conditions are missing",
                self.log.quote(&last.keyword)
            );
            self.log.warn(last.cards.last().map_or(last.at, |card| card.at), words);
        }
    }

    /// A keyword line; none where the case that it belongs to is not chosen.
    fn open(&mut self, at: Place, words: &str, file_width: &mut Width) -> Option<Block<'a>> {
        let mut parts = words.split_whitespace();
        let mut keyword = parts.next().unwrap_or_default().to_ascii_uppercase();
        let options: Vec<String> = parts.map(str::to_ascii_uppercase).collect();
        let mut width = *file_width;
        // One of these signs behind a keyword, or as a word of its own, sets the width of its cards.
        let sign = keyword.chars().last().filter(|c| matches!(c, '+' | '-' | '%')).inspect(|_| {
            keyword.pop();
        });
        let alone = || options.first().filter(|o| o.len() == 1).and_then(|o| o.chars().next());
        match sign.or_else(alone) {
            Some('+') => width = Width::Long,
            Some('-') => width = Width::Standard,
            Some('%') => width = Width::I10,
            _ => {}
        }
        if keyword == "KEYWORD" {
            for option in &options {
                match option.split_once('=') {
                    // Of the two letters that say how another program writes what it read, S reads standard fields and K long ones.
                    Some(("LONG", "Y" | "K")) => *file_width = Width::Long,
                    Some(("LONG", "N" | "S")) => {}
                    Some(("LONG", value)) => self.log.fault(
                        at,
                        format!("LONG={}", self.log.quote(value)),
                        "LONG=Y, K, S or N",
                        "write LONG=Y where all fields have 20 columns, else leave it out",
                    ),
                    Some(("I10", "Y")) => *file_width = Width::I10,
                    _ => {}
                }
            }
            width = *file_width;
        }
        for (prefix, begins) in [("CASE_BEGIN_", true), ("CASE_END_", false)] {
            let Some(number) = keyword.strip_prefix(prefix) else { continue };
            self.first_case.get_or_insert(at);
            match number.parse::<u32>() {
                Ok(id) if begins && !self.active(id, at) => self.closed.push(id),
                Ok(id) if !begins => self.closed.retain(|open| *open != id),
                Ok(_) => {}
                Err(_) => self.log.fault(
                    at,
                    format!("*{}", self.log.quote(&keyword)),
                    "a whole number at its end",
                    "write for instance *CASE_BEGIN_1",
                ),
            }
            return Some(Block::new(at, "COMMENT".to_string(), width));
        }
        let chosen = options
            .iter()
            .filter_map(|o| o.strip_prefix("CID=")?.parse::<u32>().ok())
            .all(|id| self.active(id, at));
        if !self.closed.is_empty() || !chosen {
            self.left_out += 1;
            // Its cards are read and dropped.
            keyword = "COMMENT".to_string();
        }
        Some(Block::new(at, keyword, width))
    }

    /// Whether a command identifier belongs to the case that was chosen.
    fn active(&mut self, id: u32, at: Place) -> bool {
        self.first_case.get_or_insert(at);
        self.active.contains(&id)
    }

    fn close(&mut self, block: Option<Block<'a>>, depth: usize) {
        let Some(mut block) = block else { return };
        match block.keyword.as_str() {
            "COMMENT" => {}
            "CASE" => self.case(&block),
            "INCLUDE" => self.include(&block, depth),
            "INCLUDE_PATH" | "INCLUDE_PATH_RELATIVE" => {
                let name = self.bundle.files[usize::from(block.at.file())].0;
                let mut before = String::new();
                for card in &block.cards {
                    if let Some(path) = path_of(&card.text, &mut before) {
                        let relative = block.keyword.ends_with("RELATIVE");
                        self.folders.push(if relative { beside(name, &path) } else { path });
                    }
                }
            }
            "PARAMETER"
            | "PARAMETER_LOCAL"
            | "PARAMETER_EXPRESSION"
            | "PARAMETER_EXPRESSION_LOCAL"
            | "PARAMETER_DUPLICATION" => {
                let next = self.blocks.len();
                self.parameters.read(&block, next, &self.bundle.options.parameters, self.log);
                self.given.retain(|name| !self.parameters.is_defined(name));
            }
            _ => {
                block.order = self.blocks.len();
                self.blocks.push(block);
            }
        }
    }

    /// `*CASE`: its number and a name, commands, and the identifiers it switches on.
    fn case(&mut self, block: &Block<'a>) {
        self.first_case.get_or_insert(block.at);
        let first = block.card(0);
        let Some(id) = first.text.split([',', ' ']).find(|w| !w.is_empty()).and_then(|w| w.parse().ok())
        else {
            self.log.fault(first.at, self.log.quote(&first.text), "the number of the case", "give it one");
            return;
        };
        let mut identifiers = Vec::new();
        for card in block.cards.iter().skip(1) {
            // Commands such as MEMORY=20M are for another program.
            let numbers: Option<Vec<u32>> =
                card.text.split([',', ' ']).filter(|w| !w.is_empty()).map(|w| w.parse().ok()).collect();
            identifiers.extend(numbers.unwrap_or_default().into_iter().filter(|n| *n > 0));
        }
        if self.bundle.options.case == Some(id) {
            self.active.extend(&identifiers);
        }
        self.cases.insert(id, identifiers);
    }

    fn include(&mut self, block: &Block<'a>, depth: usize) {
        let name = self.bundle.files[usize::from(block.at.file())].0;
        let mut before = String::new();
        for card in &block.cards {
            if self.full {
                return;
            }
            let Some(path) = path_of(&card.text, &mut before) else { continue };
            self.n_includes += 1;
            if self.n_includes > MAX_INCLUDES {
                self.full = true;
                let expected =
                    format!("at most {MAX_INCLUDES} includes, those of included files counted each time");
                return self.log.fault(card.at, self.log.quote(&path), expected, "include a file once");
            }
            if depth == MAX_DEPTH {
                let advice = "take out the file that includes itself";
                self.log.fault(card.at, path, format!("at most {MAX_DEPTH} files one in another"), advice);
                return;
            }
            let tried = candidates(name, &path, &self.folders);
            match tried.iter().find_map(|candidate| self.bundle.file(candidate)) {
                Some(file) => self.file(file, depth + 1),
                None => self.log.fault(
                    card.at,
                    self.log.quote(&path),
                    format!("a file that can be read ({})", tried.join(", ")),
                    "put it there, or correct the name",
                ),
            }
        }
    }

    /// What cases were there and which was asked for.
    fn conclude(&self) {
        let list: Vec<String> = self.cases.keys().map(u32::to_string).collect();
        let start = Place::card(0, 1);
        match (self.bundle.options.case, self.first_case) {
            (Some(case), _) if !self.cases.contains_key(&case) => self.log.fault(
                self.first_case.unwrap_or(start),
                format!("--case {case}"),
                if list.is_empty() {
                    "a deck with cases".to_string()
                } else {
                    format!("one of {}", list.join(", "))
                },
                "choose a case of the deck, or leave out --case",
            ),
            (None, Some(at)) => self.log.warn(
                at,
                format!(
                    "no case was chosen, {} keywords of cases are left out; --case takes one of {}",
                    self.left_out,
                    list.join(", ")
                ),
            ),
            _ => {}
        }
    }
}

/// The line in ASCII, so that columns are characters; what is not becomes `?`.
fn plain(line: &str) -> Cow<'_, str> {
    if line.is_ascii() && !line.contains('\t') {
        return Cow::Borrowed(line);
    }
    Cow::Owned(
        line.chars()
            .map(|c| match c {
                '\t' => ' ',
                c if c.is_ascii() => c,
                _ => '?',
            })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundle::Options;

    fn blocks(files: &[(&'static str, &'static str)], case: Option<u32>) -> (Vec<String>, Vec<String>) {
        let options = Options { case, ..Options::default() };
        let bundle = Bundle { options, files: files.to_vec(), outside: Vec::new() };
        let log = Log::keyword(&bundle.files);
        let lines = read(&bundle, &log);
        let words = lines
            .blocks
            .iter()
            .map(|b| {
                let cards: Vec<&str> = b.cards.iter().map(|c| c.text.as_ref()).collect();
                let Place::Card { file, line, .. } = b.at else { panic!("a card") };
                format!("{}@{file}.{line} {:?} {}", b.keyword, b.width, cards.join("|"))
            })
            .collect();
        let (faults, warnings) = log.into_lists();
        let said = faults.iter().map(ToString::to_string).chain(warnings.iter().map(ToString::to_string));
        (words, said.collect())
    }

    #[test]
    fn comments_blank_cards_words_behind_a_keyword_and_line_ends_are_as_ls_dyna_reads_them() {
        let deck = "*KEYWORD\r\n$ a comment\r\n*node (some words)\r\n 1\r\n$ inside\r\n\r\n*PART \r\nname\r\n*END\r\n*SECRET\n";
        let (blocks, said) = blocks(&[("a.k", deck)], None);
        assert_eq!(blocks, ["KEYWORD@0.1 Standard ", "NODE@0.3 Standard  1|", "PART@0.7 Standard name"]);
        assert!(said.is_empty(), "{said:?}");
    }

    #[test]
    fn widths_are_those_of_the_file_or_of_the_keyword() {
        let deck = "*KEYWORD LONG=Y\n*NODE\n*NODE -\n*NODE%\n*INCLUDE\nb.k\n";
        let (blocks, _) = blocks(&[("a.k", deck), ("b.k", "*NODE\n*NODE +\n")], None);
        let widths: Vec<&str> = blocks.iter().filter_map(|b| b.split(' ').nth(1)).collect();
        assert_eq!(widths, ["Long", "Long", "Standard", "I10", "Standard", "Long"]);
    }

    #[test]
    fn an_include_that_is_missing_or_includes_itself_is_a_fault_at_its_line() {
        let (_, said) = blocks(&[("d/a.k", "*INCLUDE\n$\nnone.k\n"), ("b.k", "")], None);
        assert_eq!(
            said,
            [
                "d/a.k:3:1: read none.k (card 1 of *INCLUDE); expected a file that can be read (d/none.k); put it there, or correct the name"
            ]
        );
        let (_, said) = blocks(&[("a.k", "*INCLUDE\na.k\n")], None);
        assert!(said[0].contains("at most 16 files one in another"), "{said:?}");
    }

    #[test]
    fn a_case_switches_on_its_own_keywords_only() {
        let deck = "*CASE\n 101 LOW\nMEMORY=20M\n1\n*CASE\n 102 ZERO\n2\n*TITLE CID=2\nzero\n*CASE_BEGIN_1\n*ONE\n*CASE_END_1\n*CASE_BEGIN_2\n*TWO\n*CASE_END_2\n*ALL\n";
        let names = |case| {
            let (blocks, said) = blocks(&[("a.k", deck)], case);
            let names: Vec<String> =
                blocks.iter().filter_map(|b| b.split('@').next()).map(str::to_string).collect();
            (names.join(" "), said)
        };
        assert_eq!(names(Some(101)), ("ONE ALL".to_string(), vec![]));
        assert_eq!(names(Some(102)), ("TITLE TWO ALL".to_string(), vec![]));
        let (all, said) = names(None);
        assert_eq!(all, "ALL");
        assert!(said[0].contains(
            "a.k:1: no case was chosen, 3 keywords of cases are left out; --case takes one of 101, 102"
        ));
        assert!(names(Some(7)).1[0].contains("read --case 7; expected one of 101, 102"));
    }
}
