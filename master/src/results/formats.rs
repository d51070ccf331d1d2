//! The formats that there are.

use std::path::Path;

use super::{
    Error, d3plot,
    format::{Format, States, Written},
    vtkhdf,
};

/// All formats, in the order of [`deck::model::FORMAT_NAMES`].
pub static FORMATS: [&dyn Format; 2] = [&vtkhdf::VtkHdf, &d3plot::D3plot];

/// The format of a name.
pub fn named(name: &str) -> Option<&'static dyn Format> {
    FORMATS.into_iter().find(|format| format.name() == name)
}

/// Writes the states of a folder in formats of these names, which must be those of formats.
///
/// # Errors
/// Those of [`Format::write`].
pub fn write_all(folder: &Path, names: &[String]) -> Result<Vec<Written>, Error> {
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let states = States::of(folder)?;
    names.iter().filter_map(|name| named(name)).map(|format| format.write(&states)).collect()
}

/// As [`write_all`], but one that cannot be written keeps none of the others away: for each what was written, or why it was not.
pub fn write_each(folder: &Path, names: &[String]) -> Vec<Result<Written, String>> {
    if names.is_empty() {
        return Vec::new();
    }
    let states = States::of(folder);
    let write = |format: &dyn Format| match &states {
        Ok(states) => format.write(states).map_err(|e| e.to_string()),
        Err(error) => Err(error.to_string()),
    };
    let missing = |name: &str, why| format!("format {name} is missing, it cannot be written: {why}");
    let formats = names.iter().filter_map(|name| named(name));
    formats.map(|format| write(format).map_err(|why| missing(format.name(), why))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_have_the_names_that_decks_know() {
        assert_eq!(FORMATS.map(Format::name), deck::model::FORMAT_NAMES);
    }
}
