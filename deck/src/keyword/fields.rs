//! Fields of a card: fixed columns, or separated by commas; numbers, parameters, numbers of things.

use super::{
    cards::{Block, Card, Width},
    expression::{Error, evaluate_keyword, real},
    parameter::Parameters,
};
use crate::{
    log::Log,
    place::{Origin, Place, Placed},
    table::{Range, holds},
};

/// Most fields of a card.
const MAX_FIELDS: usize = 16;
/// Eight fields of ten columns, as most cards have.
pub(super) const TENS: [usize; 8] = [10; 8];
/// Cards of numbers with eight columns, as elements have.
pub(super) const EIGHTS: [usize; 10] = [8; 10];

/// What reading fields needs of the deck.
#[derive(Clone, Copy)]
pub(super) struct Context<'d> {
    pub(super) log: &'d Log<'d>,
    pub(super) parameters: &'d Parameters,
    /// The block whose cards are read.
    pub(super) block: usize,
}

/// The fields of one card.
pub(super) struct Fields<'c> {
    pub(super) at: Place,
    /// Column from 1 and words of each field.
    cells: [(u32, &'c str); MAX_FIELDS],
    n: usize,
    card: &'c Card<'c>,
    context: Context<'c>,
}

impl<'d> Context<'d> {
    /// The same for another block.
    pub(super) fn of(self, block: &Block<'_>) -> Self {
        Self { block: block.order, ..self }
    }

    /// Cuts a card into fields of the standard `widths`.
    pub(super) fn fields<'c>(&self, card: &'c Card<'c>, width: Width, widths: &[usize]) -> Fields<'c>
    where
        'd: 'c,
    {
        let text: &str = &card.text;
        let mut cells = [(1, ""); MAX_FIELDS];
        let mut n = 0;
        let mut at = 0;
        if text.contains(',') {
            for cell in text.split(',').take(MAX_FIELDS) {
                cells[n] = (at as u32 + 1, cell.trim());
                at += cell.len() + 1;
                n += 1;
            }
        } else {
            for standard in widths {
                let columns = match (width, standard) {
                    (Width::Long, _) => 20,
                    (Width::I10, 8) => 10,
                    (_, columns) => *columns,
                };
                let end = (at + columns).min(text.len());
                let cell = text.get(at.min(end)..end).unwrap_or_default();
                let lead = cell.len() - cell.trim_start().len();
                cells[n] = ((at + lead) as u32 + 1, cell.trim());
                at += columns;
                n += 1;
            }
        }
        Fields { at: card.at, cells, n, card, context: *self }
    }
}

impl<'c> Fields<'c> {
    /// The words of a field; whoever asks for those of any has read the card.
    pub(super) fn words(&self, i: usize) -> &'c str {
        self.card.mark();
        if i < self.n { self.cells[i].1 } else { "" }
    }

    /// How many fields behind the first eight have words: of cards that have no more.
    pub(super) fn beyond_eight(&self) -> usize {
        (8..self.n).filter(|i| !self.cells[*i].1.is_empty()).count()
    }

    /// Whether a field is empty.
    pub(super) fn blank(&self, i: usize) -> bool {
        self.words(i).is_empty()
    }

    /// Whether all fields are empty.
    pub(super) fn all_blank(&self) -> bool {
        (0..self.n).all(|i| self.blank(i))
    }

    /// Reports a field.
    pub(super) fn fault(&self, i: usize, expected: impl Into<String>, advice: impl Into<String>) {
        let log = self.context.log;
        log.fault_in_field(self.place(i), i, &log.quote(self.words(i)), expected, advice);
    }

    /// Where a field stands.
    pub(super) fn place(&self, i: usize) -> Place {
        self.at.at_column(self.cells[i.min(MAX_FIELDS - 1)].0)
    }

    /// The words of a field that is called `name`.
    pub(super) fn origin(&self, i: usize, name: &'static str) -> Origin {
        let column = self.cells[i.min(MAX_FIELDS - 1)].0;
        Origin { at: self.place(i), end: column + self.words(i).len() as u32, word: name }
    }

    /// Something that was read from a field that is called `name`.
    pub(super) fn placed<T>(&self, i: usize, name: &'static str, value: T) -> Placed<T> {
        Placed::new(value, self.origin(i, name))
    }

    /// The number of a thing that a field called `name` refers to.
    pub(super) fn reference(&self, i: usize, name: &'static str) -> Placed<u32> {
        self.placed(i, name, self.id(i))
    }

    /// A number in a range; `default` where the field is empty, or faulty and reported.
    pub(super) fn within(&self, i: usize, default: f64, range: Range) -> f64 {
        match self.number(i) {
            Some(value) if !range.admits(value) => {
                self.fault(i, range.words(), "correct it");
                default
            }
            value => value.unwrap_or(default),
        }
    }

    /// A number; `default` where the field is empty, or faulty and reported.
    pub(super) fn real(&self, i: usize, default: f64) -> f64 {
        self.number(i).unwrap_or(default)
    }

    fn number(&self, i: usize) -> Option<f64> {
        let words = self.words(i);
        if words.is_empty() {
            return None;
        }
        let value = if words.contains('&') {
            let Context { parameters, block, .. } = self.context;
            match evaluate_keyword(words, &|name| parameters.value_in(name, block)) {
                Ok(number) => Some(number.value),
                // The deck is refused already; this value is only there to make no further faults.
                Err(Error::Broken(_)) => return Some(1.0),
                Err(why) => {
                    self.fault(i, "a parameter that is defined", why.to_string());
                    return None;
                }
            }
        } else {
            real(words)
        };
        let value = value.filter(|x| holds(*x));
        if value.is_none() {
            self.fault(
                i,
                "a number",
                "mind the columns: fields of this card are fixed, or separated by commas",
            );
        }
        value
    }

    /// A number that must be above 0; reported otherwise.
    pub(super) fn positive(&self, i: usize, what: &str) -> Option<f64> {
        let value = if self.blank(i) { 0.0 } else { self.number(i)? };
        if value > 0.0 {
            return Some(value);
        }
        self.fault(i, format!("{what} above 0"), "give one");
        None
    }

    /// A whole number; 0 where the field is empty, or faulty and reported.
    pub(super) fn integer(&self, i: usize) -> i64 {
        let words = self.words(i);
        // Most fields of most decks: plain digits.
        if let Ok(value) = words.parse::<i64>() {
            return value;
        }
        let Some(value) = self.number(i) else { return 0 };
        if value.fract() == 0.0 && value.abs() < 1e15 {
            return value as i64;
        }
        self.fault(i, "a whole number", "mind the columns, or correct it");
        0
    }

    /// The number of a thing; 0 where the field is empty, or faulty and reported.
    pub(super) fn id(&self, i: usize) -> u32 {
        let value = self.integer(i);
        match u32::try_from(value) {
            Ok(id) if id <= 2_000_000_000 => id,
            _ => {
                self.fault(i, "a number from 0 to 2,000,000,000", "renumber it");
                0
            }
        }
    }

    /// Three numbers; those of empty fields are 0.
    pub(super) fn vector(&self, i: usize) -> [f64; 3] {
        [0, 1, 2].map(|a| self.real(i + a, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;

    fn with(text: &str, width: Width, widths: &[usize], check: impl Fn(&Fields<'_>)) -> Vec<String> {
        let log = Log::keyword(&[("a.k", "")]);
        let parameters = Parameters::of(&[("v", 2.5)]);
        let card = Card::new(Place::card(0, 3), Cow::Borrowed(text));
        check(&Context { log: &log, parameters: &parameters, block: 0 }.fields(&card, width, widths));
        log.into_lists().0.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn adjacent_fields_without_a_blank_are_cut_by_their_columns() {
        let faults =
            with("       0.0       0.01.000000E8 0.000E+00-3.339E-02", Width::Standard, &TENS, |f| {
                assert_eq!([0, 1, 2, 3, 4].map(|i| f.real(i, 9.0)), [0.0, 0.0, 1e8, 0.0, -0.03339]);
                assert_eq!((f.real(5, 9.0), f.blank(5)), (9.0, true));
            });
        assert!(faults.is_empty(), "{faults:?}");
    }

    #[test]
    fn commas_make_a_card_free_and_long_makes_fields_of_twenty() {
        with("1,2.5,,-&v", Width::Standard, &[8, 16, 16, 16], |f| {
            assert_eq!((f.id(0), f.real(1, 0.0), f.blank(2), f.real(3, 0.0)), (1, 2.5, true, -2.5));
        });
        let long = format!("{:>20}{:>20}", 7, 1.5);
        with(&long, Width::Long, &[8, 16], |f| assert_eq!((f.id(0), f.real(1, 0.0)), (7, 1.5)));
        with("         7       8", Width::I10, &[8, 8], |f| assert_eq!((f.id(0), f.id(1)), (7, 8)));
    }

    #[test]
    fn what_is_no_number_is_a_fault_at_its_column() {
        let faults = with("         1      1.2x       1.5", Width::Standard, &TENS, |f| {
            assert_eq!((f.id(0), f.real(1, 4.0), f.integer(2)), (1, 4.0, 0));
        });
        assert_eq!(faults.len(), 2);
        assert!(faults[0].starts_with("a.k:3:17: read 1.2x; expected a number"), "{}", faults[0]);
        assert!(faults[1].starts_with("a.k:3:28: read 1.5; expected a whole number"), "{}", faults[1]);
    }
}
