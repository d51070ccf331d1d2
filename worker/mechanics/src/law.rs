//! How a law declares its constants and its history variables, once, in the file of the law.
//!
//! The deck reads a declared law, checks it and converts it between sets of units without knowing it. History variables are declared
//! by name and unit: their columns in blocks, in states that travel and are stored, in digests and in results follow from that.

use crate::strength::Hardening;

/// Powers of length, mass and time; temperatures stay in K in every set of units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Power of the unit of length.
    pub length: i32,
    /// Power of the unit of mass.
    pub mass: i32,
    /// Power of the unit of time.
    pub time: i32,
}

impl Unit {
    /// A plain number.
    pub const NONE: Self = Self { length: 0, mass: 0, time: 0 };
    /// Force per area, energy per volume.
    pub const STRESS: Self = Self { length: -1, mass: 1, time: -2 };
    /// Square of a stress.
    pub const STRESS_SQUARED: Self = Self { length: -2, mass: 2, time: -4 };
    /// One over a stress.
    pub const COMPLIANCE: Self = Self { length: 1, mass: -1, time: 2 };
    /// Energy per mass; with temperatures in K also that per kelvin.
    pub const SPECIFIC_ENERGY: Self = Self { length: 2, mass: 0, time: -2 };
    /// Length per time.
    pub const VELOCITY: Self = Self { length: 1, mass: 0, time: -1 };
    /// Mass per volume.
    pub const DENSITY: Self = Self { length: -3, mass: 1, time: 0 };
    /// Strain per time.
    pub const RATE: Self = Self { length: 0, mass: 0, time: -1 };
}

/// A history variable: a number that a law keeps for an element from cycle to cycle, beside those that every element has
/// ([`crate::state::FIELDS`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// Name of its array in results, different from those in [`crate::state::FIELDS`].
    pub name: &'static str,
    pub unit: Unit,
    /// Its value at the start of a run.
    pub initial: f64,
}

/// Most history variables of a law.
pub const MAX_HISTORY: usize = 8;

/// What values a constant may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// From 0 to 1.
    Fraction,
    /// Whatever.
    Any,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// The key that a deck writes.
    pub key: &'static str,
    /// Its unit.
    pub unit: Unit,
    pub bound: Bound,
    /// Its value where a deck gives none; none of a constant that a deck has to give.
    pub default: Option<f64>,
}

/// A law as a deck names it, and how its constants make one.
pub struct Declaration<T> {
    /// The word after `type`.
    pub name: &'static str,
    /// Its constants, in the order that `of` takes.
    pub constants: &'static [Constant],
    /// The law with these constants, each within its bounds.
    pub of: fn(&[f64]) -> T,
}

/// A law as a deck names it that has a curve beside its constants, by the key `points`.
pub struct Curved<T> {
    /// The word after `type`.
    pub name: &'static str,
    /// Its constants, in the order that `of` takes.
    pub constants: &'static [Constant],
    /// What the two numbers of a point are.
    pub points: &'static str,
    /// The law with these constants, each within its bounds, and this curve.
    pub of: fn(&[f64], Hardening) -> T,
}

/// A law whose constants are plain numbers, each declared with its key, unit and bounds, and perhaps a default: the struct, its
/// declaration, and the way from and to values in the order of the declaration.
macro_rules! declared {
    (@default) => {
        None
    };
    (@default $default:literal) => {
        Some($default)
    };
    (
        $(#[$of_law:meta])*
        pub struct $law:ident = $name:literal {
            $($(#[$of_constant:meta])* $constant:ident: $unit:ident, $bound:ident $(= $default:literal)?;)*
        }
    ) => {
        $(#[$of_law])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $law {
            $($(#[$of_constant])* pub $constant: f64,)*
        }

        impl $law {
            /// The word after `type` in a deck.
            pub const NAME: &'static str = $name;

            /// The constants in the order of their declaration.
            pub const CONSTANTS: &'static [$crate::law::Constant] = &[$($crate::law::Constant {
                key: stringify!($constant),
                unit: $crate::law::Unit::$unit,
                bound: $crate::law::Bound::$bound,
                default: $crate::law::declared!(@default $($default)?),
            }),*];

            /// The law with these constants, in the order of their declaration.
            ///
            /// # Panics
            /// If there are fewer.
            pub(crate) fn of(values: &[f64]) -> Self {
                let mut values = values.iter().copied();
                $(let $constant = values.next().expect("a value for each constant");)*
                Self { $($constant),* }
            }

            /// The constants by key.
            pub(crate) fn constants(&self) -> Vec<(&'static str, f64)> {
                vec![$((stringify!($constant), self.$constant)),*]
            }

            /// The law with each constant as `convert` makes it of its unit and value.
            pub(crate) fn converted(mut self, convert: &dyn Fn($crate::law::Unit, f64) -> f64) -> Self {
                $(self.$constant = convert($crate::law::Unit::$unit, self.$constant);)*
                self
            }
        }
    };
}
pub(crate) use declared;
