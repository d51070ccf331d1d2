//! `*PARAMETER` and `*PARAMETER_EXPRESSION`: named numbers, and the arithmetic between them.

use std::{collections::BTreeMap, fmt};

use super::cards::{Block, Width};
use crate::log::Log;

/// Deepest nesting of brackets in an expression.
const MAX_DEPTH: usize = 50;

/// What is wrong with an expression. Displayed as what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Error {
    /// Something stands behind its end.
    Rest(char),
    TooDeep,
    Open,
    Incomplete,
    NoNumber(String),
    Sign(char),
    Unknown(String),
    /// It has no value because of a fault that was reported.
    Broken(String),
    Function(String, usize),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rest(c) => write!(f, "remove what starts at \"{c}\""),
            Self::TooDeep => write!(f, "use at most {MAX_DEPTH} brackets one in another"),
            Self::Open => write!(f, "close the bracket"),
            Self::Incomplete => write!(f, "complete the expression"),
            Self::NoNumber(words) => write!(f, "{words} is no number"),
            Self::Sign(c) => write!(f, "remove \"{c}\""),
            Self::Unknown(name) => write!(f, "there is no parameter {name} before it"),
            Self::Broken(name) => write!(f, "correct parameter {name}"),
            Self::Function(name, n) => write!(f, "there is no function {name} of {n} numbers"),
        }
    }
}

/// Reads the parameters of a block into `known`; a later value of a name replaces an earlier one, and one that is given from outside
/// replaces all.
pub(super) fn read(
    block: &Block<'_>,
    known: &mut BTreeMap<String, f64>,
    given: &BTreeMap<String, f64>,
    log: &Log<'_>,
) {
    let expressions = block.keyword.contains("EXPRESSION");
    let width = if block.width == Width::Long { 20 } else { 10 };
    for card in &block.cards {
        let text = card.text.as_ref();
        if text.trim().is_empty() {
            continue;
        }
        let pairs: Vec<(&str, &str)> = if expressions {
            vec![text.split_once(',').unwrap_or_else(|| cut(text, width))]
        } else if text.contains(',') {
            let words: Vec<&str> = text.split(',').collect();
            words.chunks(2).map(|pair| (pair[0], pair.get(1).copied().unwrap_or(""))).collect()
        } else {
            (0..4)
                .map(|n| {
                    let rest = cut(text, 2 * n * width).1;
                    let (name, rest) = cut(rest, width);
                    (name, cut(rest, width).0)
                })
                .collect()
        };
        for (name, value) in pairs {
            let (name, value) = (name.trim(), value.trim());
            if name.is_empty() && value.is_empty() {
                continue;
            }
            // The first letter says the kind: real, integer, characters.
            let kind = name.chars().next().map(|c| c.to_ascii_uppercase());
            let name = name.get(1..).unwrap_or_default().trim().to_ascii_lowercase();
            let Some(kind) = kind.filter(|k| matches!(k, 'R' | 'I' | 'C') && !name.is_empty()) else {
                log.fault(
                    card.at,
                    log.quote(text),
                    "R, I or C and a name, then a value",
                    "write for instance Rwidth",
                );
                continue;
            };
            if kind == 'C' {
                log.warn(card.at, format!("parameter {name}: characters are not put in for parameters"));
                continue;
            }
            if let Some(&value) = given.get(&name) {
                known.insert(name, value);
                continue;
            }
            match evaluate(value, known) {
                Ok(number) if number.is_finite() => {
                    known.insert(name, if kind == 'I' { number.trunc() } else { number });
                }
                faulty => {
                    match faulty {
                        Ok(number) => log.fault(
                            card.at,
                            format!("parameter {name} = {number}"),
                            "a finite number",
                            "correct it",
                        ),
                        Err(Error::Broken(_)) => {}
                        Err(why) => {
                            log.fault(
                                card.at,
                                log.quote(value),
                                "a number or an expression",
                                why.to_string(),
                            );
                        }
                    }
                    // What refers to it is no fault of its own.
                    known.insert(name, f64::NAN);
                }
            }
        }
    }
}

/// The text before and after a column.
fn cut(text: &str, column: usize) -> (&str, &str) {
    text.split_at(column.min(text.len()))
}

/// The value of an expression over the parameters.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn evaluate(text: &str, known: &BTreeMap<String, f64>) -> Result<f64, Error> {
    let mut reader = Reader { rest: text, known, depth: 0 };
    let value = reader.sum()?;
    reader.skip();
    match reader.rest.chars().next() {
        None => Ok(value),
        Some(c) => Err(Error::Rest(c)),
    }
}

struct Reader<'a> {
    rest: &'a str,
    known: &'a BTreeMap<String, f64>,
    depth: usize,
}

impl Reader<'_> {
    fn skip(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn take(&mut self, sign: &str) -> bool {
        self.skip();
        let rest = self.rest.strip_prefix(sign);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn sum(&mut self) -> Result<f64, Error> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(Error::TooDeep);
        }
        let mut value = self.product()?;
        loop {
            if self.take("+") {
                value += self.product()?;
            } else if self.take("-") {
                value -= self.product()?;
            } else {
                self.depth -= 1;
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Result<f64, Error> {
        let mut value = self.signed()?;
        loop {
            if self.rest.trim_start().starts_with("**") {
                return Ok(value);
            } else if self.take("*") {
                value *= self.signed()?;
            } else if self.take("/") {
                value /= self.signed()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn signed(&mut self) -> Result<f64, Error> {
        let mut sign = 1.0;
        loop {
            if self.take("-") {
                sign = -sign;
            } else if !self.take("+") {
                return Ok(sign * self.power()?);
            }
        }
    }

    fn power(&mut self) -> Result<f64, Error> {
        let mut powers = vec![self.atom()?];
        while self.take("**") || self.take("^") {
            let negative = self.take("-");
            let exponent = self.atom()?;
            powers.push(if negative { -exponent } else { exponent });
        }
        // From the right: 2**3**2 is 2**9.
        let mut value = 1.0;
        for base in powers.into_iter().rev().enumerate() {
            value = if base.0 == 0 { base.1 } else { libm::pow(base.1, value) };
        }
        Ok(value)
    }

    fn atom(&mut self) -> Result<f64, Error> {
        self.skip();
        if self.take("(") {
            let value = self.sum()?;
            return if self.take(")") { Ok(value) } else { Err(Error::Open) };
        }
        let _ = self.take("&");
        let starts_a_number = |c: char| c.is_ascii_digit() || c == '.';
        let first = self.rest.chars().next().ok_or(Error::Incomplete)?;
        if starts_a_number(first) {
            let length = number_length(self.rest);
            let (number, rest) = self.rest.split_at(length);
            self.rest = rest;
            return real(number).ok_or_else(|| Error::NoNumber(number.to_string()));
        }
        let end =
            self.rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        if name.is_empty() {
            return Err(Error::Sign(first));
        }
        self.rest = rest;
        let name = name.to_ascii_lowercase();
        if !self.take("(") {
            let value = self.known.get(&name).copied();
            return match (value, name.as_str()) {
                (Some(value), _) if value.is_nan() => Err(Error::Broken(name)),
                (Some(value), _) => Ok(value),
                (None, "pi") => Ok(std::f64::consts::PI),
                (None, _) => Err(Error::Unknown(name)),
            };
        }
        let mut given = vec![self.sum()?];
        while self.take(",") {
            given.push(self.sum()?);
        }
        if !self.take(")") {
            return Err(Error::Open);
        }
        call(&name, &given)
    }
}

/// A function of one or two numbers. Its value is the same on every machine, so it is never the platform's.
fn call(name: &str, given: &[f64]) -> Result<f64, Error> {
    let value = match (name, given) {
        ("sqrt", [x]) => x.sqrt(),
        ("abs", [x]) => x.abs(),
        ("exp", [x]) => libm::exp(*x),
        ("log" | "ln", [x]) => libm::log(*x),
        ("log10", [x]) => libm::log10(*x),
        ("sin", [x]) => libm::sin(*x),
        ("cos", [x]) => libm::cos(*x),
        ("tan", [x]) => libm::tan(*x),
        ("asin", [x]) => libm::asin(*x),
        ("acos", [x]) => libm::acos(*x),
        ("atan", [x]) => libm::atan(*x),
        ("sinh", [x]) => libm::sinh(*x),
        ("cosh", [x]) => libm::cosh(*x),
        ("tanh", [x]) => libm::tanh(*x),
        ("int" | "aint", [x]) => x.trunc(),
        ("nint" | "anint", [x]) => x.round(),
        ("float", [x]) => *x,
        ("atan2", [y, x]) => libm::atan2(*y, *x),
        ("min", [a, b]) => a.min(*b),
        ("max", [a, b]) => a.max(*b),
        ("mod", [a, b]) => a % b,
        ("sign", [a, b]) => a.abs().copysign(*b),
        _ => return Err(Error::Function(name.to_string(), given.len())),
    };
    Ok(value)
}

/// Length of the number at the start of a text, with an exponent that has its letter.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(|b| b.is_ascii_digit() || *b == b'.') {
            at += 1;
        }
        at
    };
    let end = digits(0);
    if !bytes.get(end).is_some_and(|b| matches!(b, b'e' | b'E' | b'd' | b'D')) {
        return end;
    }
    let sign = usize::from(bytes.get(end + 1).is_some_and(|b| matches!(b, b'+' | b'-')));
    let exponent = digits(end + 1 + sign);
    if exponent > end + 1 + sign { exponent } else { end }
}

/// A number as Fortran reads it: `1.`, `.5`, `1.0D3`, and `1.5-3` for 1.5e-3.
pub(super) fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    let plain = |c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-' | 'e' | 'E' | 'd' | 'D');
    if text.is_empty() || !text.chars().all(plain) || !text.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    if let Ok(number) = text.parse::<f64>() {
        return number.is_finite().then_some(number);
    }
    let text = text.replace(['d', 'D'], "e");
    let number = text.parse::<f64>().ok().or_else(|| {
        let at = text.rfind(['+', '-']).filter(|at| *at > 0)?;
        format!("{}e{}", &text[..at], &text[at..]).parse().ok()
    });
    number.filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_fortran_writes_them() {
        let cases = [
            ("1.000000E8", 1e8),
            ("-3.339E-02", -0.03339),
            ("1.", 1.0),
            (".5", 0.5),
            ("1.5-3", 1.5e-3),
            ("-1.5+3", -1.5e3),
            ("2.D0", 2.0),
            ("7", 7.0),
        ];
        for (text, value) in cases {
            assert_eq!(real(text), Some(value), "{text}");
        }
        for text in ["", "nan", "inf", "1e999", "x", "1-", "--1", "+"] {
            assert_eq!(real(text), None, "{text}");
        }
    }

    #[test]
    fn expressions_have_the_usual_order() {
        let known = BTreeMap::from([("v".to_string(), 3.0)]);
        let cases = [
            ("1+2*v", 7.0),
            ("-(v-1)**2", -4.0),
            ("2**3**2", 512.0),
            ("2**-1", 0.5),
            ("&v/2", 1.5),
            ("sqrt(v*v) + max(1, 2)", 5.0),
            ("sin(pi/2)", 1.0),
            ("1.5e2 - 1", 149.0),
        ];
        for (text, value) in cases {
            assert_eq!(evaluate(text, &known), Ok(value), "{text}");
        }
        for text in ["", "1+", "w", "f(1)", "(1", "1 2", "&", &"(".repeat(1000)] {
            assert!(evaluate(text, &known).is_err(), "{text}");
        }
    }

    /// At arguments where glibc rounds otherwise.
    #[test]
    fn functions_have_the_same_bits_on_every_machine() {
        let known = BTreeMap::new();
        for (text, bits) in [
            ("exp(-0.089)", 0x3fed_466a_396c_9074_u64),
            ("log(4.51)", 0x3ff8_19cb_0b46_72dc),
            ("log10(44.556)", 0x3ffa_61eb_766d_f68b),
            ("sin(1.21)", 0x3fed_f090_f809_278d),
            ("cos(1.448)", 0x3fbf_5b5e_d860_5f8b),
            ("tan(0.747)", 0x3fed_a1dc_762d_e59a),
            ("asin(-0.32)", 0xbfd4_d8c0_7dd1_7d7c),
            ("acos(-0.06)", 0x3ffa_17e3_b2fd_d3de),
            ("atan(2.486)", 0x3ff3_037a_d163_a774),
            ("atan2(2.993, 0.7)", 0x3ff5_74ed_9c46_0e00),
            ("sinh(1.026)", 0x3ff3_739a_0388_5c16),
            ("cosh(1.435)", 0x4001_c044_4152_b01c),
            ("tanh(0.999)", 0x3fe8_5b89_494c_dea0),
            ("2.999**1.37", 0x4012_029a_549c_889a),
        ] {
            let value = evaluate(text, &known).expect("an expression");
            assert_eq!(value.to_bits(), bits, "{text}: {:#018x}", value.to_bits());
        }
    }
}
