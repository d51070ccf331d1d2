//! What a file says of the run as a whole: when it was, and the names behind its indices.
//!
//! Words are lists of the codes of their bytes (UTF-8), each word with a zero behind it, as VTK has strings in text.

use std::{io, io::Write};

use deck::model::Model;

/// Name of the array with the name of the part of each index.
pub const PART_NAMES: &str = "part_names";
/// Name of the array with the name of the material of each index.
pub const MATERIAL_NAMES: &str = "material_names";
/// Name of the array with the name of the set of units.
pub const UNITS: &str = "units";
/// Name of the array with the title of the deck.
pub const TITLE: &str = "title";

/// Writes the field data of a state or surface: time, cycle, title, units, names of parts and materials.
pub(super) fn write(out: &mut impl Write, model: &Model, (time, cycle): (f64, u64)) -> io::Result<()> {
    writeln!(out, "    <FieldData>")?;
    writeln!(
        out,
        r#"      <DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{time:?}</DataArray>"#
    )?;
    writeln!(
        out,
        r#"      <DataArray type="Int64" Name="cycle" NumberOfTuples="1" format="ascii">{cycle}</DataArray>"#
    )?;
    words(out, TITLE, &[&model.title])?;
    words(out, UNITS, &[&model.units])?;
    words(out, PART_NAMES, &model.mesh.parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>())?;
    let materials: Vec<&str> = model.setup.materials.iter().map(|material| material.name.as_str()).collect();
    words(out, MATERIAL_NAMES, &materials)?;
    writeln!(out, "    </FieldData>")
}

fn words(out: &mut impl Write, name: &str, words: &[&str]) -> io::Result<()> {
    let n = words.len();
    write!(out, r#"      <Array type="String" Name="{name}" NumberOfTuples="{n}" format="ascii">"#)?;
    for word in words {
        for byte in word.bytes().filter(|&byte| byte != 0) {
            write!(out, "{byte} ")?;
        }
        write!(out, "0 ")?;
    }
    writeln!(out, "</Array>")
}

/// The words of an array; none where the codes are not those of a list of words.
pub(super) fn read(codes: &str) -> Option<Vec<String>> {
    let mut words = Vec::new();
    let mut word = Vec::new();
    for code in codes.split_ascii_whitespace() {
        match code.parse::<u8>().ok()? {
            0 => words.push(String::from_utf8(std::mem::take(&mut word)).ok()?),
            byte => word.push(byte),
        }
    }
    word.is_empty().then_some(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_whatever_is_in_them() {
        let list = ["plate", "", "a <b> & \"c\"", "Stahlgüte, 4 mm"];
        let mut bytes = Vec::new();
        words(&mut bytes, "names", &list).expect("into memory");
        let line = String::from_utf8(bytes).expect("text");
        let codes = line.split_once('>').and_then(|(_, rest)| rest.split_once('<')).expect("a tag").0;
        assert_eq!(read(codes).expect("words"), list);
        assert_eq!(read(""), Some(vec![]));
        for damaged in ["112 300 0", "112", "x 0", "255 0"] {
            assert_eq!(read(damaged), None, "{damaged}");
        }
    }
}
