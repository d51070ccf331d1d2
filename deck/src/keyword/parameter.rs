//! `*PARAMETER` and `*PARAMETER_EXPRESSION`: named numbers, and the arithmetic between them.

use std::collections::BTreeMap;

use super::{
    cards::{Block, Width},
    expression::{Error, Number, evaluate_keyword},
};
use crate::{log::Log, place::Place};

/// What becomes of a name that is defined again, by DFLAG of `*PARAMETER_DUPLICATION`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Duplicates {
    /// The first definition stays, and the other is warned of.
    #[default]
    Warned,
    WarnedAndTaken,
    Refused,
    Taken,
    Passed,
}

impl Duplicates {
    /// Reads DFLAG; another than 1 to 5 is reported, and `present` stays.
    fn read(present: Self, block: &Block<'_>, log: &Log<'_>) -> Self {
        let card = block.card(0);
        let flag = card.text.split(',').next().unwrap_or_default();
        match cut(flag, 10 * usize::from(block.width == Width::Long) + 10).0.trim() {
            "" | "0" | "1" => Self::Warned,
            "2" => Self::WarnedAndTaken,
            "3" => Self::Refused,
            "4" => Self::Taken,
            "5" => Self::Passed,
            words => {
                let expected = "DFLAG 1 to 5: what becomes of a parameter that is defined twice";
                log.fault(card.at, log.quote(words), expected, "correct it, or take the keyword out");
                present
            }
        }
    }
}

/// A value of a name, from a block of the deck on.
struct Definition {
    /// Index of the first block that sees it.
    from: usize,
    /// None where the name is of no parameter from there on.
    number: Option<Number>,
    /// How deep among the includes the file stands that it ends with; none where it does not end.
    local: Option<usize>,
    at: Place,
}

/// What a name was before a local parameter of a file took it.
struct Masked {
    name: String,
    number: Option<Number>,
    local: Option<usize>,
}

/// The parameters of a deck by lower-case name, each with its definitions in the order of the deck.
#[derive(Default)]
pub(super) struct Parameters {
    by_name: BTreeMap<String, Vec<Definition>>,
    /// Local names of the files that are open, the deck first.
    open: Vec<Vec<Masked>>,
    duplicates: Duplicates,
}

impl Parameters {
    #[cfg(test)]
    pub(super) fn of(known: &[(&str, f64)]) -> Self {
        let mut list = Self::default();
        for &(name, value) in known {
            list.define(name.to_string(), Number { value, is_whole: false }, 0, false, Place::card(0, 1));
        }
        list
    }

    /// Begins a file.
    pub(super) fn enter(&mut self) {
        self.open.push(Vec::new());
    }

    /// Ends a file behind block `next`: its local parameters go.
    pub(super) fn leave(&mut self, next: usize) {
        for Masked { name, number, local } in self.open.pop().unwrap_or_default().into_iter().rev() {
            let Some(list) = self.by_name.get_mut(&name) else { continue };
            let Some(at) = list.last().map(|last| last.at) else { continue };
            list.push(Definition { from: next, number, local, at });
        }
    }

    pub(super) fn is_defined(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// The value of a name in a block. One that stands before its first definition has the value of that all the same.
    pub(super) fn value_in(&self, name: &str, block: usize) -> Option<Number> {
        let list = self.by_name.get(name)?;
        match list.partition_point(|definition| definition.from <= block) {
            0 => list.first().filter(|first| first.local.is_none())?.number,
            n => list.get(n - 1)?.number,
        }
    }

    /// The definition of a name that counts now.
    fn present(&self, name: &str) -> Option<&Definition> {
        self.by_name.get(name)?.last().filter(|last| last.number.is_some())
    }

    fn define(&mut self, name: String, number: Number, from: usize, is_local: bool, at: Place) {
        let depth = self.open.len();
        let local = is_local.then_some(depth);
        let before = self.present(&name).map(|known| (known.number, known.local));
        if is_local
            && before.is_none_or(|(_, local)| local != Some(depth))
            && let Some(names) = self.open.last_mut()
        {
            let (number, local) = before.unwrap_or_default();
            names.push(Masked { name: name.clone(), number, local });
        }
        self.by_name.entry(name).or_default().push(Definition { from, number: Some(number), local, at });
    }

    /// Reads the parameters of a block, which the blocks from `next` on see. One that is given from outside has that value
    /// whatever the deck says.
    pub(super) fn read(
        &mut self,
        block: &Block<'_>,
        next: usize,
        given: &BTreeMap<String, f64>,
        log: &Log<'_>,
    ) {
        if block.keyword == "PARAMETER_DUPLICATION" {
            self.duplicates = Duplicates::read(self.duplicates, block, log);
            return;
        }
        let is_local = block.keyword.ends_with("_LOCAL");
        for Given { at, card, name, value } in pairs(block) {
            // The first letter says the kind: real, integer, characters.
            let kind = name.chars().next().map(|c| c.to_ascii_uppercase());
            let name = name.get(1..).unwrap_or_default().trim().to_ascii_lowercase();
            let Some(kind) = kind.filter(|k| matches!(k, 'R' | 'I' | 'C') && !name.is_empty()) else {
                log.fault(
                    at,
                    log.quote(card),
                    "R, I or C and a name, then a value",
                    "write for instance Rwidth",
                );
                continue;
            };
            if kind == 'C' {
                log.warn(at, format!("parameter {name}: characters are not put in for parameters"));
                continue;
            }
            let is_whole = kind == 'I';
            if let Some(&value) = given.get(&name) {
                if !self.is_defined(&name) {
                    self.define(name, Number { value, is_whole }, next, false, at);
                }
                continue;
            }
            let known = |name: &str| self.present(name).and_then(|known| known.number);
            let number = match evaluate_keyword(&value, &known) {
                Ok(Number { value, .. }) if value.is_finite() => {
                    if is_whole {
                        value.trunc()
                    } else {
                        value
                    }
                }
                faulty => {
                    match faulty {
                        Ok(Number { value, .. }) => log.fault(
                            at,
                            format!("parameter {name} = {value}"),
                            "a finite number",
                            "correct it",
                        ),
                        Err(Error::Broken(_)) => {}
                        Err(why) => {
                            log.fault(at, log.quote(&value), "a number or an expression", why.to_string());
                        }
                    }
                    // What refers to it is no fault of its own.
                    f64::NAN
                }
            };
            if self.is_to_be_taken(&name, number, is_local, (at, log)) {
                self.define(name, Number { value: number, is_whole }, next, is_local, at);
            }
        }
    }

    /// Whether a definition counts: a name that has one already is told by DFLAG, and a local name is another one than that of the files
    /// above.
    fn is_to_be_taken(&self, name: &str, value: f64, is_local: bool, (at, log): (Place, &Log<'_>)) -> bool {
        let Some(first) = self.present(name) else { return true };
        let Some(known) = first.number.map(|number| number.value) else { return true };
        if (is_local && first.local != Some(self.open.len())) || known.is_nan() || value.is_nan() {
            return true;
        }
        if known == value {
            return false;
        }
        let line = log.line(first.at, at);
        match self.duplicates {
            Duplicates::Warned => {
                let words = format!(
                    "parameter {name}: {line} has defined it as {known}, which stays; {value} is not taken"
                );
                log.warn(at, words);
            }
            Duplicates::WarnedAndTaken => {
                let words = format!("parameter {name}: {value} from here on, in place of {known} of {line}");
                log.warn(at, words);
            }
            Duplicates::Refused => {
                let expected =
                    format!("one definition of each parameter, as DFLAG 3 demands: {line} has another");
                log.fault(at, format!("parameter {name} = {value}"), expected, "take one of the two out");
            }
            Duplicates::Taken | Duplicates::Passed => {}
        }
        matches!(self.duplicates, Duplicates::WarnedAndTaken | Duplicates::Taken)
    }
}

/// A name with its letter, and what is to be its value.
struct Given<'c> {
    at: Place,
    /// The card, to be quoted.
    card: &'c str,
    name: &'c str,
    value: String,
}

/// The names and values on the cards of a block.
fn pairs<'c>(block: &'c Block<'_>) -> Vec<Given<'c>> {
    let is_expression = block.keyword.contains("EXPRESSION");
    let width = if block.width == Width::Long { 20 } else { 10 };
    let mut list: Vec<Given<'c>> = Vec::new();
    for card in block.cards.iter().filter(|card| !card.is_blank()) {
        let text = card.text.as_ref();
        // An expression goes on where the columns of the name are blank.
        if is_expression
            && cut(text, width).0.trim().is_empty()
            && let Some(last) = list.last_mut()
        {
            last.value.push_str(text.trim());
            continue;
        }
        let mut add = |name: &'c str, value: &str| {
            let (name, value) = (name.trim(), value.trim().to_string());
            if !(name.is_empty() && value.is_empty()) {
                list.push(Given { at: card.at, card: text, name, value });
            }
        };
        if is_expression {
            // A comma inside brackets is one between the numbers of a function.
            let free = text.split_once(',').filter(|(name, _)| !name.contains('('));
            let (name, value) = free.unwrap_or_else(|| cut(text, width));
            add(name, value);
        } else if text.contains(',') {
            let mut words = text.split(',');
            while let Some(name) = words.next() {
                add(name, words.next().unwrap_or_default());
            }
        } else {
            for n in 0..4 {
                let (name, rest) = cut(cut(text, 2 * n * width).1, width);
                add(name, cut(rest, width).0);
            }
        }
    }
    list
}

/// The text before and after a column.
fn cut(text: &str, column: usize) -> (&str, &str) {
    text.split_at(column.min(text.len()))
}
