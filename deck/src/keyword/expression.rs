//! Arithmetic of parameters: sums, products, powers, functions, by the rules of arithmetic or by those of LS-DYNA.

use std::{collections::BTreeMap, fmt};

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

/// A value, and whether it is an integer, whose quotient by another is one too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) is_whole: bool,
}

impl Number {
    fn real(value: f64) -> Self {
        Self { value, is_whole: false }
    }

    /// What an operation makes of both: an integer of integers.
    fn with(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        Self { value: operation(self.value, other.value), is_whole: self.is_whole && other.is_whole }
    }

    fn over(self, other: Self) -> Self {
        let quotient = self.with(other, |a, b| a / b);
        if quotient.is_whole { Self { value: quotient.value.trunc(), ..quotient } } else { quotient }
    }

    fn times_sign(self, sign: f64) -> Self {
        Self { value: sign * self.value, ..self }
    }

    /// An integer to the power of one that is not negative is an integer.
    fn to_the(self, exponent: Self) -> Self {
        let power = self.with(exponent, libm::pow);
        Self { is_whole: power.is_whole && exponent.value >= 0.0, ..power }
    }
}

/// Whose rules an expression follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rules {
    /// Those of arithmetic: `-3**2` is -9, and 2/5 is 0.4.
    Usual,
    /// Those of LS-DYNA: a sign binds tighter than a power, so that `-3**2` is 9, and integers divide as such: 2/5 is 0.
    LsDyna,
}

/// The value of an expression over the parameters, by the rules of arithmetic.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn evaluate(text: &str, known: &BTreeMap<String, f64>) -> Result<f64, Error> {
    let look_up = |name: &str| known.get(name).copied().map(Number::real);
    Ok(evaluate_by(Rules::Usual, text, &look_up)?.value)
}

/// The value of an expression of a keyword deck, by the rules of LS-DYNA; `known` tells the parameters.
///
/// # Errors
/// What is wrong with it.
pub(super) fn evaluate_keyword(text: &str, known: &dyn Fn(&str) -> Option<Number>) -> Result<Number, Error> {
    evaluate_by(Rules::LsDyna, text, known)
}

fn evaluate_by(rules: Rules, text: &str, known: &dyn Fn(&str) -> Option<Number>) -> Result<Number, Error> {
    let mut reader = Reader { rest: text, known, depth: 0, rules };
    let value = reader.sum()?;
    reader.skip();
    match reader.rest.chars().next() {
        None => Ok(value),
        Some(c) => Err(Error::Rest(c)),
    }
}

struct Reader<'a> {
    rest: &'a str,
    known: &'a dyn Fn(&str) -> Option<Number>,
    depth: usize,
    rules: Rules,
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

    fn sum(&mut self) -> Result<Number, Error> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(Error::TooDeep);
        }
        let mut value = self.product()?;
        loop {
            if self.take("+") {
                value = value.with(self.product()?, |a, b| a + b);
            } else if self.take("-") {
                value = value.with(self.product()?, |a, b| a - b);
            } else {
                self.depth -= 1;
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Result<Number, Error> {
        let mut value = self.signed()?;
        loop {
            if self.rest.trim_start().starts_with("**") {
                return Ok(value);
            } else if self.take("*") {
                value = value.with(self.signed()?, |a, b| a * b);
            } else if self.take("/") {
                let by = self.signed()?;
                value = match self.rules {
                    Rules::Usual => value.with(by, |a, b| a / b),
                    Rules::LsDyna => value.over(by),
                };
            } else {
                return Ok(value);
            }
        }
    }

    fn signed(&mut self) -> Result<Number, Error> {
        let mut sign = 1.0;
        loop {
            if self.take("-") {
                sign = -sign;
            } else if !self.take("+") {
                return match self.rules {
                    Rules::Usual => Ok(self.power(1.0)?.times_sign(sign)),
                    Rules::LsDyna => self.power(sign),
                };
            }
        }
    }

    /// A power whose base has a sign.
    fn power(&mut self, sign: f64) -> Result<Number, Error> {
        let mut powers = vec![self.atom()?.times_sign(sign)];
        while self.take("**") || self.take("^") {
            let sign = if self.take("-") { -1.0 } else { 1.0 };
            powers.push(self.atom()?.times_sign(sign));
        }
        // From the right: 2**3**2 is 2**9.
        let of = |exponent: Number, base: Number| base.to_the(exponent);
        powers.into_iter().rev().reduce(of).ok_or(Error::Incomplete)
    }

    fn atom(&mut self) -> Result<Number, Error> {
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
            let is_whole = number.chars().all(|c| c.is_ascii_digit());
            let value = real(number).ok_or_else(|| Error::NoNumber(number.to_string()))?;
            return Ok(Number { value, is_whole });
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
            return match ((self.known)(&name), name.as_str()) {
                (Some(number), _) if number.value.is_nan() => Err(Error::Broken(name)),
                (Some(number), _) => Ok(number),
                (None, "pi") => Ok(Number::real(std::f64::consts::PI)),
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
fn call(name: &str, given: &[Number]) -> Result<Number, Error> {
    let values: Vec<f64> = given.iter().map(|number| number.value).collect();
    let value = match (name, &values[..]) {
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
    let is_whole = match name {
        "int" | "nint" => true,
        "abs" | "min" | "max" | "mod" | "sign" => given.iter().all(|number| number.is_whole),
        _ => false,
    };
    Ok(Number { value, is_whole })
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

    #[test]
    fn expressions_of_keyword_decks_have_the_order_and_the_integers_of_ls_dyna() {
        let known = |name: &str| match name {
            "n" => Some(Number { value: 7.0, is_whole: true }),
            "x" => Some(Number::real(7.0)),
            _ => None,
        };
        let cases = [
            ("-3**2", 9.0),
            ("2-3**2", -7.0),
            ("-(n-5)**2", 4.0),
            ("2/5", 0.0),
            ("2./5", 0.4),
            ("-n/2", -3.0),
            ("x/2", 3.5),
            ("n/2*2.0", 6.0),
            ("2**-1", 0.5),
            ("float(n)/2", 3.5),
            ("max(3,5)/2", 2.0),
            ("sqrt(16)/3*3", 4.0),
        ];
        for (text, value) in cases {
            assert_eq!(evaluate_keyword(text, &known).map(|number| number.value), Ok(value), "{text}");
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
