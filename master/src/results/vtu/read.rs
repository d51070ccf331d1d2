//! Reads the VTK files and indices that [`super`] writes: no XML parser, but lines whose form is known.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use super::{super::PVD, VTK_PYRAMID, VTK_TETRA, VTK_WEDGE, appended, field_data};
use crate::results::Error;

/// What stands between head and numbers.
const MARKER: &[u8] = b"<AppendedData encoding=\"raw\">\n_";

/// Points and cells that a piece may have: a bound on what a damaged head can ask for.
const MOST: usize = 1 << 32;

/// Where an array is, and of what.
#[derive(Clone, Debug, PartialEq)]
pub struct Heading {
    pub name: String,
    /// `PointData`, `CellData`, `Points`, `Cells`, `Polys`.
    pub section: String,
    /// VTK's name of the type: `Float64`, `Int64`, `UInt32`, `UInt8`.
    pub kind: String,
    /// Numbers per tuple.
    pub components: usize,
    /// Its unit; empty for plain numbers.
    pub unit: String,
    offset: usize,
}

/// One state or surface as it stands in its file.
pub struct Piece {
    path: PathBuf,
    bytes: Vec<u8>,
    /// Where the numbers begin.
    start: usize,
    compressed: bool,
    /// Time (time).
    pub time: f64,
    pub cycle: u64,
    pub n_points: usize,
    /// Number of cells; of polygons in a surface.
    pub n_cells: usize,
    /// Its arrays, in the order of the file.
    pub headings: Vec<Heading>,
    /// Lists of words by name: the [`super::field_data`].
    words: BTreeMap<String, Vec<String>>,
}

impl Piece {
    /// Opens a file and reads its head.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Malformed`] for a file that no run writes.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::of(path, fs::read(path).map_err(Error::io("read", path))?)
    }

    /// Of the bytes of a file, which `path` names in errors.
    ///
    /// # Errors
    /// [`Error::Malformed`] for a file that no run writes.
    pub fn of(path: &Path, bytes: Vec<u8>) -> Result<Self, Error> {
        let malformed = |line: usize, what: String| Error::Malformed { path: path.to_owned(), line, what };
        let end = bytes.windows(MARKER.len()).position(|window| window == MARKER);
        let head = end.and_then(|end| std::str::from_utf8(&bytes[..end]).ok()).map(str::to_owned);
        let (Some(end), Some(head)) = (end, head) else {
            return Err(malformed(
                1,
                "expected a VTK file with raw appended data, as bolide writes it".into(),
            ));
        };
        let mut piece = Self {
            path: path.to_owned(),
            start: end + MARKER.len(),
            bytes,
            compressed: false,
            time: 0.0,
            cycle: 0,
            n_points: 0,
            n_cells: 0,
            headings: Vec::new(),
            words: BTreeMap::new(),
        };
        let mut section = String::new();
        for (line, text) in (1..).zip(head.lines().map(str::trim)) {
            let number = |name: &str| -> Result<usize, Error> {
                let found = attribute(text, name).and_then(|value| value.parse::<usize>().ok());
                let found = found.filter(|&number| number <= MOST);
                found.ok_or_else(|| malformed(line, format!("expected a number {name} in {text:?}")))
            };
            let word = |name: &str| {
                attribute(text, name)
                    .map(str::to_owned)
                    .ok_or_else(|| malformed(line, format!("expected {name} in {text:?}")))
            };
            if text.starts_with("<VTKFile") {
                piece.compressed = attribute(text, "compressor").is_some();
            } else if text.starts_with("<Piece") {
                piece.n_points = number("NumberOfPoints")?;
                let cells = if text.contains("NumberOfCells") { "NumberOfCells" } else { "NumberOfPolys" };
                piece.n_cells = number(cells)?;
            } else if let (true, Some(codes)) = (text.contains(r#" type="String""#), content(text)) {
                let words = field_data::read(codes)
                    .ok_or_else(|| malformed(line, "expected the codes of words".to_owned()))?;
                piece.words.insert(word("Name")?, words);
            } else if let (true, Some(value)) = (text.starts_with("<DataArray"), content(text)) {
                let value: f64 =
                    value.parse().map_err(|_| malformed(line, format!("expected a number in {text:?}")))?;
                match attribute(text, "Name") {
                    Some("TimeValue") => piece.time = value,
                    Some("cycle") => piece.cycle = value as u64,
                    _ => {}
                }
            } else if text.starts_with("<DataArray") {
                let components =
                    if text.contains("NumberOfComponents") { number("NumberOfComponents")? } else { 1 };
                piece.headings.push(Heading {
                    name: word("Name")?,
                    section: section.clone(),
                    kind: word("type")?,
                    components: components.min(64),
                    unit: String::new(),
                    offset: number("offset")?,
                });
            } else if text.starts_with("<InformationKey") {
                if let (Some(heading), Some(unit)) = (piece.headings.last_mut(), content(text)) {
                    heading.unit = unit.to_owned();
                }
            } else if let Some(name) = text.strip_prefix('<').and_then(|text| text.strip_suffix('>'))
                && !name.starts_with('/')
            {
                section = name.to_owned();
            }
        }
        Ok(piece)
    }

    /// The numbers of `tuples` tuples of an array as they are in the file: little-endian, of the width of their type.
    ///
    /// # Errors
    /// [`Error::Malformed`] where they are not what the head announces.
    pub fn bytes(&self, heading: &Heading, tuples: usize) -> Result<Vec<u8>, Error> {
        let malformed = |what: String| Error::Malformed {
            path: self.path.clone(),
            line: 1,
            what: format!("array {}: {what}", heading.name),
        };
        let width = match heading.kind.as_str() {
            "Float64" | "Int64" => 8,
            "UInt32" => 4,
            "UInt8" => 1,
            other => return Err(malformed(format!("numbers of type {other}, which no run writes"))),
        };
        let expected = tuples
            .checked_mul(heading.components * width)
            .ok_or_else(|| malformed("more numbers than any file holds".into()))?;
        let from = self.start.checked_add(heading.offset).and_then(|from| self.bytes.get(from..));
        let from = from.ok_or_else(|| malformed("the file ends before it".into()))?;
        appended::decode(from, self.compressed, expected).map_err(malformed)
    }

    /// The numbers of `tuples` tuples of an array, as decimal numbers.
    ///
    /// # Errors
    /// As [`Self::bytes`].
    pub fn numbers(&self, heading: &Heading, tuples: usize) -> Result<Vec<f64>, Error> {
        let bytes = self.bytes(heading, tuples)?;
        let wide = bytes.chunks_exact(8).map(|b| <[u8; 8]>::try_from(b).expect("chunks of eight"));
        Ok(match heading.kind.as_str() {
            "Float64" => wide.map(f64::from_le_bytes).collect(),
            "Int64" => wide.map(|b| i64::from_le_bytes(b) as f64).collect(),
            "UInt32" => bytes
                .chunks_exact(4)
                .map(|b| f64::from(u32::from_le_bytes(b.try_into().expect("chunks of four"))))
                .collect(),
            _ => bytes.into_iter().map(f64::from).collect(),
        })
    }

    /// The array of this name in a section, if there is one.
    pub fn find(&self, section: &str, name: &str) -> Option<&Heading> {
        self.headings.iter().find(|heading| heading.section == section && heading.name == name)
    }

    /// The array of this name in a section, which every file has.
    ///
    /// # Errors
    /// [`Error::Malformed`] if it is not there.
    pub fn expect(&self, section: &str, name: &str) -> Result<&Heading, Error> {
        self.find(section, name).ok_or_else(|| Error::Malformed {
            path: self.path.clone(),
            line: 1,
            what: format!("no array {name} in {section}"),
        })
    }

    /// The words of a list of the field data, such as [`field_data::PART_NAMES`]; none where the file has no such list.
    pub fn words(&self, name: &str) -> &[String] {
        self.words.get(name).map_or(&[], Vec::as_slice)
    }

    /// Positions of the points.
    ///
    /// # Errors
    /// [`Error::Malformed`].
    pub fn points(&self) -> Result<Vec<[f64; 3]>, Error> {
        let numbers = self.numbers(self.expect("Points", "Points")?, self.n_points)?;
        Ok(numbers.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
    }

    /// Corners of every cell, as indices of points; of a wedge, a pyramid or a tetrahedron of four nodes those of the hexahedron that it is
    /// in the mesh. `section` is `Cells`, or `Polys` of a surface.
    ///
    /// # Errors
    /// [`Error::Malformed`], also for corners that are no points.
    pub fn cells(&self, section: &str) -> Result<Vec<Vec<u32>>, Error> {
        let malformed =
            |what: &str| Error::Malformed { path: self.path.clone(), line: 1, what: what.to_owned() };
        let ends = self.numbers(self.expect(section, "offsets")?, self.n_cells)?;
        let n_corners = ends.last().map_or(0, |&end| end as usize);
        let corners = self.numbers(self.expect(section, "connectivity")?, n_corners)?;
        if corners.iter().any(|&corner| !(0.0..self.n_points as f64).contains(&corner)) {
            return Err(malformed("a corner that is no point"));
        }
        let types = match section {
            "Cells" => self.numbers(self.expect(section, "types")?, self.n_cells)?,
            _ => Vec::new(),
        };
        let mut cells = Vec::with_capacity(ends.len());
        let mut start = 0;
        for (i, end) in ends.into_iter().enumerate() {
            let end = end as usize;
            let cell = corners.get(start..end).ok_or_else(|| malformed("offsets of cells do not rise"))?;
            let cell: Vec<u32> = cell.iter().map(|&corner| corner as u32).collect();
            let kind = types.get(i).map_or(0, |&kind| kind as u8);
            cells.push(match (kind, cell[..].len()) {
                (VTK_WEDGE, 6) => [0, 1, 4, 3, 2, 2, 5, 5].map(|node| cell[node]).to_vec(),
                (VTK_PYRAMID, 5) => [0, 1, 2, 3, 4, 4, 4, 4].map(|node| cell[node]).to_vec(),
                (VTK_TETRA, 4) => [0, 1, 2, 2, 3, 3, 3, 3].map(|node| cell[node]).to_vec(),
                _ => cell,
            });
            start = end;
        }
        Ok(cells)
    }
}

/// Time and file of every state that the index of a results folder lists.
///
/// # Errors
/// [`Error::Io`]; [`Error::Malformed`] for an index that no run writes, and for one that lists nothing.
pub fn index(folder: &Path) -> Result<Vec<(f64, PathBuf)>, Error> {
    let path = folder.join(PVD);
    let text = fs::read_to_string(&path).map_err(Error::io("read", &path))?;
    let mut states = Vec::new();
    for (line, text) in (1..).zip(text.lines()).filter(|(_, text)| text.contains("<DataSet")) {
        let time = attribute(text, "timestep").and_then(|time| time.parse().ok());
        let file = attribute(text, "file").filter(|file| !file.contains(['/', '\\']));
        let (Some(time), Some(file)) = (time, file) else {
            let what = format!("expected timestep and file of a state, found {text:?}");
            return Err(Error::Malformed { path, line, what });
        };
        states.push((time, folder.join(file)));
    }
    if states.is_empty() {
        return Err(Error::Malformed { path, line: 1, what: "expected a state, found none".into() });
    }
    Ok(states)
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

/// What stands between a tag and its end on one line.
fn content(line: &str) -> Option<&str> {
    let (_, rest) = line.split_once('>')?;
    rest.split_once("</").map(|(content, _)| content)
}
