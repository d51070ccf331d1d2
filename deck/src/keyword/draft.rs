//! The TOML deck that a keyword deck becomes, each line with the place that it comes from.

use super::log::{Log, Place};

/// A deck on the way.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) text: String,
    /// Origin of each line of the text.
    pub(super) origins: Vec<Place>,
}

impl Draft {
    /// Adds a line.
    pub(super) fn line(&mut self, at: Place, words: impl AsRef<str>) {
        self.text.push_str(words.as_ref());
        self.text.push('\n');
        self.origins.push(at);
    }

    /// Adds an empty line and a heading.
    pub(super) fn heading(&mut self, at: Place, words: &str) {
        self.line(at, "");
        self.line(at, words);
    }

    /// Where line `line` of the text, from 1, comes from.
    pub(super) fn origin(&self, line: u32) -> Place {
        let index = (line as usize).saturating_sub(1).min(self.origins.len().saturating_sub(1));
        self.origins.get(index).copied().unwrap_or(Place { file: 0, line: 1 })
    }

    /// The words of a fault at `at`, with the lines of this text that they name replaced by their origins.
    pub(super) fn relined(&self, words: &str, at: Place, log: &Log) -> String {
        let mut told = String::new();
        let mut rest = words;
        while let Some(start) = rest.find("line ") {
            let (before, number) = rest.split_at(start + 5);
            told.push_str(before);
            let digits = number.find(|c: char| !c.is_ascii_digit()).unwrap_or(number.len());
            rest = &number[digits..];
            match number[..digits].parse::<u32>().map(|line| self.origin(line)) {
                Ok(origin) if origin.file == at.file => told += &origin.line.to_string(),
                Ok(origin) => told += &format!("{} of {}", origin.line, log.file(origin)),
                Err(_) => told.push_str(&number[..digits]),
            }
        }
        told + rest
    }
}

/// A text in TOML's quotes.
pub(super) fn quoted(words: &str) -> String {
    let plain: String =
        words.chars().map(|c| if matches!(c, '"' | '\\') || c.is_control() { ' ' } else { c }).collect();
    format!("\"{}\"", plain.trim())
}

/// A vector as TOML writes it.
pub(super) fn vector(v: [f64; 3]) -> String {
    format!("[{:?}, {:?}, {:?}]", v[0], v[1], v[2])
}
