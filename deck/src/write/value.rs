//! Lines and values of a TOML deck.

use std::fmt::Debug;

use mechanics::load::Span;

use crate::typed::condition::{Circle, Components, Drive, Parts};

/// A text on the way.
#[derive(Default)]
pub(super) struct Text {
    text: String,
    /// Where the last heading starts, and the text behind it.
    last: (usize, usize),
}

impl Text {
    /// A heading after an empty line.
    pub(super) fn heading(&mut self, words: &str) {
        let start = self.text.len();
        self.text.push('\n');
        self.text.push_str(words);
        self.text.push('\n');
        self.last = (start, self.text.len());
    }

    /// Takes back a heading under which nothing was written.
    pub(super) fn drop_heading(&mut self) {
        if self.text.len() == self.last.1 {
            self.text.truncate(self.last.0);
        }
    }

    /// `key = value`.
    pub(super) fn key(&mut self, key: &str, value: impl AsRef<str>) {
        self.text.push_str(key);
        self.text.push_str(" = ");
        self.text.push_str(value.as_ref());
        self.text.push('\n');
    }

    pub(super) fn some(&mut self, key: &str, value: Option<impl Debug>) {
        if let Some(value) = value {
            self.key(key, format!("{value:?}"));
        }
    }

    pub(super) fn into_string(self) -> String {
        self.text
    }
}

/// A text in TOML's quotes. Control characters, which no reader lets through, become spaces.
pub(crate) fn quoted(words: &str) -> String {
    let mut text = String::from("\"");
    for c in words.chars() {
        match c {
            '"' | '\\' => text.extend(['\\', c]),
            c if c.is_control() => text.push(' '),
            c => text.push(c),
        }
    }
    text.push('"');
    text
}

/// Values in square brackets.
pub(super) fn list(values: impl Iterator<Item = String>) -> String {
    format!("[{}]", values.collect::<Vec<_>>().join(", "))
}

/// Keys with values in braces.
pub(super) fn table(keys: &[(&str, String)]) -> String {
    let keys: Vec<String> = keys.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("{{ {} }}", keys.join(", "))
}

pub(super) fn vector(v: [f64; 3]) -> String {
    numbers(&v)
}

/// Numbers in square brackets.
pub(super) fn numbers(numbers: &[f64]) -> String {
    list(numbers.iter().map(|x| format!("{x:?}")))
}

pub(super) fn names(parts: &Parts) -> String {
    match parts {
        Parts::All | Parts::Broken => quoted("all"),
        Parts::Named(names) => list(names.iter().map(|name| quoted(&name.value))),
    }
}

/// A number that may follow a curve.
pub(super) fn drive(drive: &Drive) -> String {
    let mut keys = match &drive.curve {
        None if drive.span == Span::ALWAYS => return format!("{:?}", drive.factor),
        None => vec![("value", format!("{:?}", drive.factor))],
        Some(curve) => vec![("curve", quoted(&curve.value)), ("factor", format!("{:?}", drive.factor))],
    };
    keys.extend(span(&drive.span));
    table(&keys)
}

/// `from` and `until`, where they are not those of a whole run.
pub(super) fn span(span: &Span) -> impl Iterator<Item = (&'static str, String)> {
    let from = (span.from != 0.0).then(|| ("from", format!("{:?}", span.from)));
    let until = (span.until != Span::ALWAYS.until).then(|| ("until", format!("{:?}", span.until)));
    from.into_iter().chain(until)
}

/// Axis, point and rate of a turn.
pub(super) fn circle(circle: &Circle) -> [(&'static str, String); 3] {
    let axis = quoted(["x", "y", "z"][circle.axis]);
    [("axis", axis), ("point", vector(circle.point)), ("rate", drive(&circle.rate))]
}

/// Numbers by axis.
pub(super) fn components(components: &Components) -> String {
    let given = ["x", "y", "z"].into_iter().zip(components);
    let keys: Vec<(&str, String)> = given.filter_map(|(axis, c)| Some((axis, drive(c.as_ref()?)))).collect();
    table(&keys)
}
