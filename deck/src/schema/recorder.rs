//! What the readers of decks ask: which keys of which tables, and what values of them.

use std::{cell::RefCell, collections::BTreeMap};

use crate::table::Range;

/// What a reader asks a value to be.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    Number(Range),
    /// From the first to the second.
    Integer(u64, u64),
    Text,
    /// A name of a part, material or gauge.
    Name,
    Words(Vec<&'static str>),
    Boolean,
    /// Of so many values, if that matters.
    List(Option<usize>),
    Table,
}

/// What was asked of a value, or of the items of a list.
#[derive(Debug, Default)]
pub(crate) struct Level {
    pub(crate) kinds: Vec<Kind>,
    /// The kind of table that it is.
    pub(crate) table: Option<usize>,
    /// By question, whether it was answered with no, and with yes.
    pub(crate) answers: BTreeMap<&'static str, [bool; 2]>,
}

/// What was asked under a key.
#[derive(Debug, Default)]
pub(crate) struct Key {
    /// In how many tables it was required.
    pub(crate) required: u32,
    /// What a reader says that it expects.
    pub(crate) expected: Option<String>,
    /// Of the value, of its items, of their items.
    pub(crate) levels: Vec<Level>,
}

/// A kind of table, such as a `[[part]]`.
#[derive(Debug, Default)]
pub(crate) struct TableKind {
    /// How many there were.
    pub(crate) tables: u32,
    pub(crate) keys: BTreeMap<&'static str, Key>,
}

/// Everything that was asked so far. The first kind of table is the deck.
#[derive(Debug)]
pub(crate) struct Recorder {
    kinds: RefCell<Vec<TableKind>>,
    /// Tables that are read alike wherever they stand: the kind of each name, and the kinds that it stands for.
    shared: RefCell<BTreeMap<&'static str, usize>>,
    same: RefCell<BTreeMap<usize, usize>>,
}

impl Recorder {
    /// The kind of table that the deck is.
    pub(crate) const WHOLE: usize = 0;

    pub(crate) fn new() -> Self {
        Self {
            kinds: RefCell::new(vec![TableKind::default()]),
            shared: RefCell::new(BTreeMap::new()),
            same: RefCell::new(BTreeMap::new()),
        }
    }

    pub(crate) fn into_kinds(self) -> Vec<TableKind> {
        let mut kinds = self.kinds.into_inner();
        let same = self.same.into_inner();
        let levels = kinds.iter_mut().flat_map(|kind| kind.keys.values_mut()).flat_map(|key| &mut key.levels);
        for table in levels.filter_map(|level| level.table.as_mut()) {
            *table = same.get(table).copied().unwrap_or(*table);
        }
        kinds
    }

    /// The kind that tables of this name have wherever they stand; a table of `kind`, of which nothing was asked yet, becomes one.
    pub(crate) fn share(&self, kind: usize, name: &'static str) -> usize {
        let known = *self.shared.borrow_mut().entry(name).or_insert(kind);
        if known != kind {
            self.same.borrow_mut().insert(kind, known);
            self.begin(known);
        }
        known
    }

    /// One more table of this kind.
    pub(crate) fn begin(&self, kind: usize) {
        self.kinds.borrow_mut()[kind].tables += 1;
    }

    /// A key that a reader looks for.
    pub(crate) fn ask(&self, kind: usize, key: &'static str) {
        self.kinds.borrow_mut()[kind].keys.entry(key).or_default();
    }

    /// A key that a table has to have.
    pub(crate) fn require(&self, kind: usize, key: &'static str, expected: &str) {
        let mut kinds = self.kinds.borrow_mut();
        let key = kinds[kind].keys.entry(key).or_default();
        key.required += 1;
        key.expected.get_or_insert_with(|| expected.to_string());
    }

    /// What a value under a key is to be, `depth` lists inside.
    pub(crate) fn note(&self, kind: usize, key: &'static str, depth: usize, what: Kind) {
        self.at_level(kind, key, depth, |level| {
            if !level.kinds.contains(&what) {
                level.kinds.push(what);
            }
        });
    }

    /// The kind of table that a value under a key is.
    pub(crate) fn table(&self, kind: usize, key: &'static str, depth: usize) -> usize {
        self.note(kind, key, depth, Kind::Table);
        let next = self.kinds.borrow().len();
        let mut found = next;
        self.at_level(kind, key, depth, |level| found = *level.table.get_or_insert(next));
        if found == next {
            self.kinds.borrow_mut().push(TableKind::default());
        }
        found
    }

    /// An answer that decides how a reader goes on.
    pub(crate) fn answer(
        &self,
        kind: usize,
        key: &'static str,
        depth: usize,
        question: &'static str,
        answer: bool,
    ) {
        self.at_level(kind, key, depth, |level| {
            level.answers.entry(question).or_default()[usize::from(answer)] = true;
        });
    }

    fn at_level(&self, kind: usize, key: &'static str, depth: usize, change: impl FnOnce(&mut Level)) {
        let mut kinds = self.kinds.borrow_mut();
        let levels = &mut kinds[kind].keys.entry(key).or_default().levels;
        if levels.len() <= depth {
            levels.resize_with(depth + 1, Level::default);
        }
        change(&mut levels[depth]);
    }
}
