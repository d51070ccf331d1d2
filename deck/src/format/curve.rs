//! `[[curve]]`: tabulated functions of time, and the numbers that may follow one.

use std::collections::BTreeMap;

use mechanics::load::{Curve, Drive};

use super::MAX_ENTRIES;
use crate::{
    fault::nearest,
    table::{Range, Table, Value},
};

/// Most points of a curve.
const MAX_POINTS: usize = 100_000;

/// The curves of a deck.
pub(crate) struct Curves {
    index: BTreeMap<String, u32>,
    pub(crate) list: Vec<Curve>,
}

impl Curves {
    /// Reads every `[[curve]]`.
    pub(crate) fn read(deck: &Table<'_>) -> Self {
        let mut curves = Self { index: BTreeMap::new(), list: Vec::new() };
        for table in deck.tables("curve", MAX_ENTRIES) {
            let value = table.require("name", "a name in quotes");
            let name = value.and_then(|v| v.name());
            if let (Some(value), Some(name)) = (value, &name)
                && curves.index.contains_key(name)
            {
                value.fault("a name that no other [[curve]] has", "choose another name");
            }
            // A curve that cannot be read keeps its name, so that what refers to it is no second fault.
            let points = read_points(&table).unwrap_or_else(|| vec![[0.0; 2]]);
            table.finish();
            if let Some(name) = name {
                curves.index.entry(name).or_insert(curves.list.len() as u32);
            }
            curves.list.push(Curve { points });
        }
        curves
    }

    /// A number, or `{ curve = "name", factor = 2.0 }`.
    pub(crate) fn drive(&self, value: Value<'_>) -> Option<Drive> {
        if !value.is_table() {
            return value.number(Range::Any).map(Drive::constant);
        }
        let table = value.table("a value by curve".to_string())?;
        let curve = self.required(&table);
        let factor = table.number_or("factor", 1.0, Range::Any);
        table.finish();
        Some(Drive { factor, curve: Some(curve?) })
    }

    /// The curve under `curve` of a table, which must have one.
    fn required(&self, table: &Table<'_>) -> Option<u32> {
        self.find(table.require("curve", "the name of a [[curve]]")?)
    }

    /// The curve under `curve` of a table times `factor`; a constant where there is none.
    pub(crate) fn of_table(&self, table: &Table<'_>, factor: f64) -> Drive {
        let curve = table.get("curve").and_then(|value| self.find(value));
        Drive { factor, curve }
    }

    fn find(&self, value: Value<'_>) -> Option<u32> {
        let name = value.text()?;
        let found = self.index.get(name).copied();
        if found.is_none() {
            let advice = match nearest(name, self.index.keys().map(String::as_str)) {
                Some(near) => format!("write \"{near}\""),
                None => "add a [[curve]] of that name".to_string(),
            };
            value.fault("the name of a [[curve]]", &advice);
        }
        found
    }

    /// How a message writes a drive.
    pub(crate) fn words(&self, drive: Drive) -> String {
        match self.index.iter().find(|(_, index)| Some(**index) == drive.curve) {
            Some((name, _)) => format!("{} x curve \"{name}\"", drive.factor),
            None => drive.factor.to_string(),
        }
    }
}

/// `points = [[t, y], ...]` with ascending times.
fn read_points(table: &Table<'_>) -> Option<Vec<[f64; 2]>> {
    let value = table.require("points", "[[time, value], ...]")?;
    let items = value.items()?;
    if items.is_empty() || items.len() > MAX_POINTS {
        value.fault(&format!("1 to {MAX_POINTS} points"), "write [[time, value], ...]");
        return None;
    }
    let mut points: Vec<[f64; 2]> = Vec::with_capacity(items.len());
    for item in items {
        let point = item.numbers::<2>("[time, value]", Range::Any)?;
        if points.last().is_some_and(|last| last[0] >= point[0]) {
            item.fault("a time after that of the point before", "put the points in the order of time");
            return None;
        }
        points.push(point);
    }
    Some(points)
}
