//! Parameters that a deck leaves open: `${thickness}` in a TOML deck, `*PARAMETER` in a keyword deck.
//!
//! Their values come from outside, by name: `--set thickness=5` or a study. In a TOML deck an expression between `${` and `}` is replaced
//! by its value before the deck is read, in numbers and in texts; what stands in a comment stays. In a keyword deck a value from outside
//! replaces that of the deck's own `*PARAMETER`, and expressions of other parameters follow it.

use std::collections::BTreeMap;

use crate::{
    fault::{Faults, nearest},
    keyword::evaluate,
};

/// Values by name.
pub type Parameters = BTreeMap<String, f64>;

/// Most parameters of a deck that may be given.
pub const MAX_PARAMETERS: usize = 64;
/// Longest name of a parameter (characters).
pub const MAX_PARAMETER: usize = 32;

/// Whether a name may be that of a parameter: small letters, digits and underscores, a letter first.
pub fn is_parameter(name: &str) -> bool {
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    // Expressions know `pi` by themselves.
    name != "pi"
        && name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.len() <= MAX_PARAMETER
        && name.chars().all(fits)
}

/// The value of an expression over parameters: `+ - * / **`, brackets, `sqrt(x)`, `max(a, b)` and the other functions of keyword decks.
///
/// # Errors
/// What to do about it.
pub fn value_of(expression: &str, known: &Parameters) -> Result<f64, String> {
    match evaluate(expression, known) {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) => Err(format!("it comes to {value}; a finite number is needed")),
        Err(why) => Err(why.to_string()),
    }
}

/// A number as a TOML deck writes it: whole ones without a point, so that they may stand for counts.
pub fn written(value: f64) -> String {
    const WHOLE: f64 = 1e15;
    if value.trunc() == value && value.abs() < WHOLE { format!("{value:.0}") } else { format!("{value:?}") }
}

/// Puts the values of expressions in their places. Faults are added where an expression has no value, and where a given parameter stands nowhere.
pub(crate) fn substitute(text: &str, given: &Parameters, faults: &Faults<'_>) -> Option<String> {
    let before = faults.count();
    let mut out = String::with_capacity(text.len());
    let mut used: Vec<&str> = Vec::new();
    let mut at = 0;
    while let Some(open) = open_after(text, at) {
        out.push_str(&text[at..open]);
        let inside = open + 2;
        let line_end = text[inside..].find('\n').map_or(text.len(), |n| inside + n);
        let Some(close) = text[inside..line_end].find('}').map(|n| inside + n) else {
            faults.add(open, faults.quote(open, line_end), "${ ... } on one line", "close the bracket");
            return None;
        };
        let expression = &text[inside..close];
        used.extend(names_in(expression));
        match value_of(expression, given) {
            Ok(value) => out.push_str(&written(value)),
            Err(why) => {
                let known: Vec<&str> = given.keys().map(String::as_str).collect();
                let missing = names_in(expression).find(|name| !given.contains_key(*name));
                let advice = match missing {
                    Some(name) if known.is_empty() => format!("give it one with --set {name}=VALUE"),
                    Some(name) => match nearest(name, known.iter().copied()) {
                        Some(near) => format!("write {near}, or give {name} with --set {name}=VALUE"),
                        None => {
                            format!("give {name} with --set {name}=VALUE; given are {}", known.join(", "))
                        }
                    },
                    None => why,
                };
                let expected = "an expression of parameters that are given";
                faults.add(open, faults.quote(open, close + 1), expected, advice);
                out.push('0');
            }
        }
        at = close + 1;
    }
    out.push_str(&text[at..]);
    for name in given.keys().filter(|name| !used.contains(&name.as_str())) {
        faults.add(
            0,
            format!("a deck without ${{{name}}}"),
            format!("{name}, which is given, in an expression of the deck"),
            "write it into the deck, or do not give it",
        );
    }
    (faults.count() == before).then_some(out)
}

/// As [`substitute`], with nothing told: the text itself where that fails.
pub(crate) fn substituted_if_possible(text: &str, given: &Parameters) -> String {
    let faults = Faults::new("", text);
    substitute(text, given, &faults).unwrap_or_else(|| text.to_string())
}

/// Whether an expression stands anywhere but in comments.
pub(crate) fn has_any(text: &str) -> bool {
    open_after(text, 0).is_some()
}

/// Offset of the next `${` that stands in no comment, from an offset that stands in none.
fn open_after(text: &str, from: usize) -> Option<usize> {
    let mut at = from;
    while let Some(open) = text[at..].find("${").map(|n| at + n) {
        let line_start = text[..open].rfind('\n').map_or(0, |n| n + 1);
        if !is_in_comment(&text[line_start..open]) {
            return Some(open);
        }
        at = text[open..].find('\n').map_or(text.len(), |n| open + n);
    }
    None
}

/// Whether a comment has begun in the start of a line.
fn is_in_comment(start: &str) -> bool {
    let mut quote = None;
    for letter in start.chars() {
        match (letter, quote) {
            ('#', None) => return true,
            ('"' | '\'', None) => quote = Some(letter),
            (letter, Some(open)) if letter == open => quote = None,
            _ => {}
        }
    }
    false
}

/// Names of parameters in an expression, without those of functions.
pub fn names_in(expression: &str) -> impl Iterator<Item = &str> {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut rest = expression;
    std::iter::from_fn(move || {
        loop {
            let start = rest.find(|c: char| part(c) || c == '.')?;
            let word = &rest[start..];
            let end = word.find(|c: char| !(part(c) || c == '.')).unwrap_or(word.len());
            rest = &word[end..];
            let is_name = word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
            if is_name && !rest.trim_start().starts_with('(') && &word[..end] != "pi" {
                return Some(&word[..end]);
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn substituted(text: &str, given: &[(&str, f64)]) -> Result<String, Vec<String>> {
        let faults = Faults::new("deck.toml", text);
        let given = given.iter().map(|(name, value)| ((*name).to_string(), *value)).collect();
        let text = substitute(text, &given, &faults);
        text.ok_or_else(|| faults.into_list().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn expressions_become_numbers_everywhere_but_in_comments() {
        let text = "title = \"# ${n} plies\" # of ${nothing}\ncells = [${n}, ${2 * n}]\norigin = ${-t / 2}\nfine = ${t * 1e-9}\n";
        assert_eq!(
            substituted(text, &[("n", 4.0), ("t", 2.5)]).as_deref(),
            Ok("title = \"# 4 plies\" # of ${nothing}\ncells = [4, 8]\norigin = -1.25\nfine = 2.5e-9\n")
        );
    }

    #[test]
    fn every_fault_has_its_place() {
        let faults =
            substituted("a = ${thicknes}\nb = ${1 / 0}\n", &[("thickness", 1.0)]).expect_err("faulty");
        assert_eq!(
            faults,
            [
                "deck.toml:1:1: read a deck without ${thickness}; expected thickness, which is given, in an expression of the deck; \
                 write it into the deck, or do not give it",
                "deck.toml:1:5: read ${thicknes}; expected an expression of parameters that are given; write thickness, or give \
                 thicknes with --set thicknes=VALUE",
                "deck.toml:2:5: read ${1 / 0}; expected an expression of parameters that are given; it comes to inf; a finite number is \
                 needed",
            ]
        );
        let open = substituted("a = ${thick\n", &[]).expect_err("open");
        assert!(
            open[0].starts_with("deck.toml:1:5: read ${thick; expected ${ ... } on one line"),
            "{open:?}"
        );
    }

    #[test]
    fn names_are_small_letters_digits_and_underscores() {
        assert!(is_parameter("thickness_2"));
        for bad in ["", "pi", "2t", "Thick", "a b", "a-b", "_a", &"a".repeat(33)] {
            assert!(!is_parameter(bad), "{bad}");
        }
        assert_eq!(names_in("2e3 * max(t, v_0) + pi + 1.5e-3").collect::<Vec<_>>(), ["t", "v_0"]);
    }
}
