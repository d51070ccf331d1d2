//! D3PLOT: the states of a run as LS-DYNA writes them: `d3plot` with the mesh, then `d3plot01`, `d3plot02`, ... with one state each.
//!
//! Format: "LS-DYNA database binary output files" of LST, as lasso-python reads it: 64 control words, geometry, numbers of nodes
//! and elements, titles of parts; single precision, little-endian, an end mark of -999999 behind each file and zeros up to a
//! multiple of 512 words. Solids have stress, plastic strain and history variables, shells the mean through their thickness as one
//! layer in the global frame. Elements that have eroded are marked as deleted. Energies are in `history.csv`, not here.

use std::io::Write;

use super::{
    Error,
    format::{Format, States, Written},
    vtu::{
        field_data::{PART_NAMES, TITLE},
        read::Piece,
    },
    write_whole,
};

mod elements;
mod geometry;
mod state;

use elements::Elements;

/// Name of the file with the mesh; numbers follow it for the states.
pub const NAME: &str = "d3plot";

/// Behind everything in a file.
const END: f32 = -999_999.0;

/// Files are multiples of so many words of four bytes.
const BLOCK: usize = 512;

/// Scalar fields of elements that are not history variables there: they follow from stress, or have a place of their own.
const NO_HISTORY: [&str; 10] = [
    "pressure",
    "von_mises",
    "von_mises_max",
    "plastic_strain",
    "part",
    "material",
    "element_id",
    "worker",
    "thickness",
    "stress",
];

/// The format.
pub struct D3plot;

impl Format for D3plot {
    fn name(&self) -> &'static str {
        "d3plot"
    }

    fn writes(&self, file: &str) -> bool {
        file.strip_prefix(NAME).is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()))
    }

    fn fields(&self) -> &'static [&'static str] {
        &["velocity", "displacement", "plastic_strain", "stress"]
    }

    fn write(&self, states: &States) -> Result<Written, Error> {
        let first = states.read(0)?;
        let elements = Elements::of(states, &first)?;
        let content = Content::of(&first, &elements);
        let folder = states.folder();
        // Those of before may be more.
        for entry in std::fs::read_dir(folder).map_err(Error::io("read", folder))? {
            let path = entry.map_err(Error::io("read", folder))?.path();
            if path.file_name().and_then(|name| name.to_str()).is_some_and(|name| self.writes(name)) {
                std::fs::remove_file(&path).map_err(Error::io("remove", &path))?;
            }
        }
        for index in 0..states.count() {
            let piece = states.read(index)?;
            let words = state::words(states, index, &piece, &elements, &content)?;
            write_words(&folder.join(format!("{NAME}{:02}", index + 1)), words)?;
        }
        // A reader begins with this file, so it comes when the others are there.
        let path = folder.join(NAME);
        write_words(&path, geometry::words(states, &first, &elements, &content)?)?;
        Ok(Written { path, note: content.note() })
    }
}

/// What the states have.
struct Content {
    title: String,
    parts: Vec<String>,
    velocity: bool,
    stress: bool,
    plastic_strain: bool,
    /// Element fields that become history variables, in this order.
    history: Vec<String>,
    /// Shells have their thickness as the history variable behind these.
    thickness: bool,
    /// Whether there are beams, whose forces and moments [`BEAM`] words are.
    beams: bool,
}

/// Words of a beam in a state: axial force, two shear forces, two bending moments, torque.
const BEAM: usize = 6;

impl Content {
    fn of(first: &Piece, elements: &Elements) -> Self {
        let has = |section: &str, name: &str| first.find(section, name).is_some();
        let history = first.headings.iter().filter(|heading| {
            heading.section == "CellData"
                && heading.components == 1
                && heading.kind == "Float64"
                && !NO_HISTORY.contains(&heading.name.as_str())
        });
        let mut parts = first.words(PART_NAMES).to_vec();
        let n_parts = elements.n_parts.max(parts.len());
        parts.resize(n_parts, String::new());
        Self {
            title: first.words(TITLE).first().cloned().unwrap_or_default(),
            parts,
            velocity: has("PointData", "velocity"),
            stress: has("CellData", "stress"),
            plastic_strain: has("CellData", "plastic_strain"),
            history: history.map(|heading| heading.name.clone()).collect(),
            thickness: has("CellData", "thickness"),
            beams: has("CellData", "beam_force"),
        }
    }

    /// Variables of a solid in a state.
    fn of_solid(&self) -> usize {
        6 * usize::from(self.stress) + usize::from(self.plastic_strain) + self.history.len()
    }

    /// Variables of a beam or truss in a state.
    fn of_beam(&self) -> usize {
        BEAM * usize::from(self.beams)
    }

    /// Variables of a shell in a state: of its one layer.
    fn of_shell(&self) -> usize {
        self.of_solid() + usize::from(self.thickness)
    }

    /// Names of the history variables, and what is missing.
    fn note(&self) -> String {
        let mut names: Vec<String> =
            (1..).zip(&self.history).map(|(n, name)| format!("{n} {name}")).collect();
        if self.thickness {
            names.push(format!("{} thickness (of shells)", self.history.len() + 1));
        }
        let mut note =
            if names.is_empty() { String::new() } else { format!("history variables: {}", names.join(", ")) };
        let missing =
            [(self.stress, "stress"), (self.plastic_strain, "plastic_strain"), (self.velocity, "velocity")];
        let missing: Vec<&str> = missing.iter().filter(|(is, _)| !is).map(|(_, name)| *name).collect();
        if !missing.is_empty() {
            if !note.is_empty() {
                note.push_str("; ");
            }
            note.push_str(&format!(
                "without {}, which the states lack: name it in fields of [output], or run with formats = [\"d3plot\"]",
                missing.join(", ")
            ));
        }
        note
    }
}

/// A word of four bytes.
#[derive(Clone, Copy)]
enum Word {
    Int(i32),
    Real(f32),
}

impl Word {
    fn bytes(self) -> [u8; 4] {
        match self {
            Self::Int(value) => value.to_le_bytes(),
            Self::Real(value) => value.to_le_bytes(),
        }
    }
}

/// Words of a file, as bytes.
#[derive(Default)]
struct Words(Vec<u8>);

impl Words {
    fn int(&mut self, value: usize) {
        self.0.extend(Word::Int(i32::try_from(value).unwrap_or(i32::MAX)).bytes());
    }

    fn real(&mut self, value: f64) {
        self.0.extend(Word::Real(value as f32).bytes());
    }

    /// Text in so many words, cut or filled with blanks; what is not ASCII becomes a question mark.
    fn text(&mut self, text: &str, words: usize) {
        let ascii = text.chars().map(|c| if c.is_ascii() && !c.is_control() { c as u8 } else { b'?' });
        self.0.extend(ascii.chain(std::iter::repeat(b' ')).take(4 * words));
    }
}

/// Writes a file of words with its end mark and zeros behind it.
fn write_words(path: &std::path::Path, mut words: Words) -> Result<(), Error> {
    words.0.extend(Word::Real(END).bytes());
    let size = words.0.len().next_multiple_of(4 * BLOCK);
    words.0.resize(size, 0);
    write_whole(path, |out| out.write_all(&words.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_files_are_those_of_the_format_and_others_are_not() {
        for name in ["d3plot", "d3plot01", "d3plot100"] {
            assert!(D3plot.writes(name), "{name}");
        }
        for name in ["d3plot.txt", "d3plots", "my-d3plot", "d3plo"] {
            assert!(!D3plot.writes(name), "{name}");
        }
    }

    #[test]
    fn text_is_cut_and_filled() {
        let mut words = Words::default();
        words.text("größer als acht", 2);
        words.text("a", 1);
        assert_eq!(words.0, b"gr??er aa   ");
    }
}
