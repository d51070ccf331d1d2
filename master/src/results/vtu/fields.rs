//! Which fields a state file holds.

use deck::model::Output;

use super::read;
use crate::results::{Error, FIELD_NAMES, formats};

/// Fields whose numbers identify rather than measure: written whatever the deck selects.
const IDENTITY: [&str; 4] = ["node_id", "element_id", "part", "material"];

/// Fields that follow from others or never change: written only if the deck names them.
const ON_REQUEST: [&str; 10] = [
    "stress",
    "relative_volume",
    "stress_xx",
    "stress_yy",
    "stress_xy",
    "stress_yz",
    "stress_zx",
    "mass",
    "time_to_light",
    "viscosity",
];

/// Which fields a state file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fields {
    /// One flag per entry of [`FIELD_NAMES`].
    selected: [bool; FIELD_NAMES.len()],
}

impl Fields {
    /// The fields of a deck, and those that its formats need.
    ///
    /// # Errors
    /// [`Error::UnknownField`].
    pub fn of(output: &Output) -> Result<Self, Error> {
        let mut fields = Self::select(&output.fields)?;
        for format in output.formats.iter().filter_map(|name| formats::named(name)) {
            fields.add(format.fields());
        }
        Ok(fields)
    }

    /// Adds those that a format needs and a state has, whose run was asked for that format beside its deck.
    pub fn add_those_of(&mut self, written: &read::Piece) {
        let has = |name: &str| written.headings.iter().any(|heading| heading.name == name);
        for format in formats::FORMATS {
            if format.fields().iter().all(|name| has(name)) {
                self.add(format.fields());
            }
        }
    }

    fn add(&mut self, names: &[&str]) {
        for (known, selected) in FIELD_NAMES.iter().zip(&mut self.selected) {
            *selected |= names.contains(known);
        }
    }

    /// The fields of `output.fields`; an empty list selects all but the relative volume,
    /// the components of stress, the nodal mass and the time until the detonation arrives.
    ///
    /// # Errors
    /// [`Error::UnknownField`].
    pub fn select(names: &[String]) -> Result<Self, Error> {
        if let Some(name) = names.iter().find(|name| !FIELD_NAMES.contains(&name.as_str())) {
            return Err(Error::UnknownField { name: name.clone() });
        }
        let selected = FIELD_NAMES.map(|known| {
            IDENTITY.contains(&known)
                || names.iter().any(|name| name == known)
                || names.is_empty() && !ON_REQUEST.contains(&known)
        });
        Ok(Self { selected })
    }

    /// Whether the field of this name is written.
    pub(super) fn contains(&self, name: &str) -> bool {
        FIELD_NAMES.iter().zip(self.selected).any(|(known, selected)| selected && *known == name)
    }
}
