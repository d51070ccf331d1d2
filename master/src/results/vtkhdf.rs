//! VTKHDF: all states of a run in one HDF5 file with their times, `results.vtkhdf`, as ParaView 5.12 and pyvista read it.
//!
//! Format: "VTKHDF file format" of the VTK documentation, version 2.1, an unstructured grid with `Steps`. Points and fields are
//! stored for every state. Cells are stored once where none erodes, else for every state. Numbers are those of the
//! VTU files, of the same types, uncompressed; each array has its unit as the attribute `units`.

use std::io::{Seek, SeekFrom, Write};

use super::{
    Error,
    format::{Format, States, Written},
    hdf5::{Array, Attribute, File, Group, Kind},
    vtu::{
        field_data::{MATERIAL_NAMES, PART_NAMES, TITLE, UNITS},
        read::{Heading, Piece},
    },
    write_whole,
};

/// Name of the file.
pub const NAME: &str = "results.vtkhdf";

/// The format.
pub struct VtkHdf;

/// What the arrays of a state have to fit.
struct Sizes {
    time: f64,
    cycle: u64,
    points: u64,
    cells: u64,
    corners: u64,
}

impl Format for VtkHdf {
    fn name(&self) -> &'static str {
        "vtkhdf"
    }

    fn writes(&self, file: &str) -> bool {
        file == NAME
    }

    fn fields(&self) -> &'static [&'static str] {
        &[]
    }

    fn write(&self, states: &States) -> Result<Written, Error> {
        let first = states.read(0)?;
        let sizes =
            (0..states.count()).map(|index| measure(states, index, &first)).collect::<Result<Vec<_>, _>>()?;
        let layout = Layout::of(&first, sizes)?;
        let path = states.folder().join(NAME);
        let mut trouble = None;
        let written = write_whole(&path, |out| {
            out.write_all(layout.file.head())?;
            for (address, bytes) in layout.file.words() {
                put(out, *address, bytes)?;
            }
            for (array, bytes) in layout.small() {
                put(out, layout.file.address(&array), &bytes)?;
            }
            for index in 0..states.count() {
                // A fault of a state is told as it is, not as one of the disk.
                let written = states.read(index).and_then(|piece| layout.arrays_of(index, &piece));
                match written {
                    Ok(arrays) => {
                        for (address, bytes) in arrays {
                            put(out, address, &bytes)?;
                        }
                    }
                    Err(error) => {
                        trouble = Some(error);
                        return Err(std::io::Error::other("a state cannot be read"));
                    }
                }
            }
            // What was written last need not be what comes last.
            out.flush()?;
            out.get_ref().set_len(layout.file.length())
        });
        match trouble {
            Some(error) => Err(error),
            None => written.map(|()| Written { path, note: String::new() }),
        }
    }
}

fn put(out: &mut (impl Write + Seek), address: u64, bytes: &[u8]) -> std::io::Result<()> {
    out.seek(SeekFrom::Start(address))?;
    out.write_all(bytes)
}

/// The sizes of a state, which has the arrays of the first.
fn measure(states: &States, index: usize, first: &Piece) -> Result<Sizes, Error> {
    let piece = states.read(index)?;
    let named = |piece: &Piece| -> Vec<(String, String, usize)> {
        piece.headings.iter().map(|h| (h.section.clone(), h.name.clone(), h.components)).collect()
    };
    if named(&piece) != named(first) || piece.n_points != first.n_points {
        return Err(states.malformed(index, "expected the points and arrays of the first state"));
    }
    let ends = piece.numbers(piece.expect("Cells", "offsets")?, piece.n_cells)?;
    Ok(Sizes {
        time: piece.time,
        cycle: piece.cycle,
        points: piece.n_points as u64,
        cells: piece.n_cells as u64,
        corners: ends.last().map_or(0, |&end| end as u64),
    })
}

/// Where the numbers of every state go.
struct Layout {
    file: File,
    sizes: Vec<Sizes>,
    /// Node and element fields of every state, with their unit.
    fields: Vec<Heading>,
    /// Whether cells are stored once.
    is_static: bool,
    /// Words of the field data by name.
    words: Vec<(&'static str, Vec<String>)>,
}

fn kind_of(heading: &Heading) -> Kind {
    match heading.kind.as_str() {
        "Float64" => Kind::F64,
        "Int64" => Kind::I64,
        "UInt32" => Kind::U32,
        _ => Kind::U8,
    }
}

impl Layout {
    fn of(first: &Piece, sizes: Vec<Sizes>) -> Result<Self, Error> {
        let is_static = sizes.iter().all(|s| (s.cells, s.corners) == (sizes[0].cells, sizes[0].corners));
        let fields: Vec<Heading> = first
            .headings
            .iter()
            .filter(|h| matches!(h.section.as_str(), "PointData" | "CellData"))
            .cloned()
            .collect();
        let words = [TITLE, UNITS, PART_NAMES, MATERIAL_NAMES].map(|name| (name, first.words(name).to_vec()));
        let words: Vec<_> = words.into_iter().filter(|(_, words)| !words.is_empty()).collect();
        let n = sizes.len() as u64;
        let stored = if is_static { &sizes[..1] } else { &sizes[..] };
        let sum = |of: fn(&Sizes) -> u64, sizes: &[Sizes]| sizes.iter().map(of).sum::<u64>();
        let points = sum(|s| s.points, &sizes);

        let mut grid = Group::named("VTKHDF");
        grid.attributes =
            vec![Attribute::list("Version", &[2, 1]), Attribute::word("Type", "UnstructuredGrid")];
        for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
            grid.add(name, Kind::I64, &[stored.len() as u64]);
        }
        let unit = |array: &mut Array, unit: &str| {
            if !unit.is_empty() {
                array.attributes.push(Attribute::word("units", unit));
            }
        };
        grid.add("Points", Kind::F64, &[points, 3]);
        unit(grid.arrays.last_mut().expect("just added"), &first.expect("Points", "Points")?.unit);
        grid.add("Connectivity", Kind::I64, &[sum(|s| s.corners, stored)]);
        grid.add("Offsets", Kind::I64, &[sum(|s| s.cells + 1, stored)]);
        grid.add("Types", Kind::U8, &[sum(|s| s.cells, stored)]);
        for (section, tuples) in [("PointData", points), ("CellData", sum(|s| s.cells, &sizes))] {
            let mut group = Group::named(section);
            for heading in fields.iter().filter(|h| h.section == section) {
                let components = heading.components as u64;
                let shape = if components == 1 { vec![tuples] } else { vec![tuples, components] };
                group.add(&heading.name, kind_of(heading), &shape);
                unit(group.arrays.last_mut().expect("just added"), &heading.unit);
            }
            grid.groups.push(group);
        }
        let mut of_run = Group::named("FieldData");
        of_run.add("cycle", Kind::I64, &[n]);
        for (name, list) in &words {
            of_run.add_words(name, list);
        }
        grid.groups.push(of_run);
        grid.groups.push(steps(&fields, &words, n));

        let root = Group { groups: vec![grid], ..Group::default() };
        Ok(Self { file: File::of(&root), sizes, fields, is_static, words })
    }

    /// The states whose cells are stored.
    fn stored(&self) -> &[Sizes] {
        if self.is_static { &self.sizes[..1] } else { &self.sizes }
    }

    /// Arrays that say where the numbers of states are, and what belongs to the run as a whole.
    fn small(&self) -> Vec<(String, Vec<u8>)> {
        let list = |numbers: Vec<u64>| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
        let before = |of: &dyn Fn(&Sizes) -> u64| {
            let sums = self.sizes.iter().scan(0, |sum, sizes| {
                let start = *sum;
                *sum += of(sizes);
                Some(start)
            });
            sums.collect::<Vec<u64>>()
        };
        let n = self.sizes.len();
        let once = |of: Vec<u64>| if self.is_static { vec![0; n] } else { of };
        let steps = "/VTKHDF/Steps";
        let mut arrays = vec![
            ("/VTKHDF/NumberOfPoints".to_owned(), list(self.stored().iter().map(|s| s.points).collect())),
            ("/VTKHDF/NumberOfCells".to_owned(), list(self.stored().iter().map(|s| s.cells).collect())),
            (
                "/VTKHDF/NumberOfConnectivityIds".to_owned(),
                list(self.stored().iter().map(|s| s.corners).collect()),
            ),
            (format!("{steps}/Values"), self.sizes.iter().flat_map(|s| s.time.to_le_bytes()).collect()),
            (format!("{steps}/NumberOfParts"), list(vec![1; n])),
            (format!("{steps}/PartOffsets"), list(once((0..n as u64).collect()))),
            (format!("{steps}/PointOffsets"), list(before(&|s| s.points))),
            (format!("{steps}/CellOffsets"), list(once(before(&|s| s.cells)))),
            (format!("{steps}/ConnectivityIdOffsets"), list(once(before(&|s| s.corners)))),
            ("/VTKHDF/FieldData/cycle".to_owned(), list(self.sizes.iter().map(|s| s.cycle).collect())),
            (format!("{steps}/FieldDataOffsets/cycle"), list((0..n as u64).collect())),
            (format!("{steps}/FieldDataSizes/cycle"), list(vec![1; 2 * n])),
        ];
        for heading in &self.fields {
            let offsets =
                if heading.section == "PointData" { before(&|s| s.points) } else { before(&|s| s.cells) };
            arrays.push((format!("{steps}/{}Offsets/{}", heading.section, heading.name), list(offsets)));
        }
        for (name, words) in &self.words {
            arrays.push((format!("{steps}/FieldDataOffsets/{name}"), list(vec![0; n])));
            let size = [1, words.len() as u64];
            arrays.push((format!("{steps}/FieldDataSizes/{name}"), list(size.repeat(n))));
        }
        arrays
    }

    /// Addresses and bytes of the arrays of a state.
    fn arrays_of(&self, index: usize, piece: &Piece) -> Result<Vec<(u64, Vec<u8>)>, Error> {
        let sum = |of: fn(&Sizes) -> u64| self.sizes[..index].iter().map(of).sum::<u64>();
        let (points, cells, corners) = (sum(|s| s.points), sum(|s| s.cells), sum(|s| s.corners));
        let at = |array: &str, start: u64| self.file.address(array) + start;
        let mut arrays = vec![(
            at("/VTKHDF/Points", 24 * points),
            piece.bytes(piece.expect("Points", "Points")?, piece.n_points)?,
        )];
        if index == 0 || !self.is_static {
            let n_corners = self.sizes[index].corners as usize;
            let cell = |name: &str, tuples: usize| piece.bytes(piece.expect("Cells", name)?, tuples);
            arrays.push((at("/VTKHDF/Connectivity", 8 * corners), cell("connectivity", n_corners)?));
            let mut ends = 0u64.to_le_bytes().to_vec();
            ends.extend(cell("offsets", piece.n_cells)?);
            arrays.push((at("/VTKHDF/Offsets", 8 * (cells + index as u64)), ends));
            arrays.push((at("/VTKHDF/Types", cells), cell("types", piece.n_cells)?));
        }
        for heading in &self.fields {
            let (start, tuples) = match heading.section.as_str() {
                "PointData" => (points, piece.n_points),
                _ => (cells, piece.n_cells),
            };
            let bytes = piece.bytes(piece.expect(&heading.section, &heading.name)?, tuples)?;
            let width = heading.components as u64 * kind_of(heading).width();
            arrays.push((at(&format!("/VTKHDF/{}/{}", heading.section, heading.name), start * width), bytes));
        }
        Ok(arrays)
    }
}

/// The group that says which numbers belong to which of `n` states.
fn steps(fields: &[Heading], words: &[(&'static str, Vec<String>)], n: u64) -> Group {
    let mut steps = Group::named("Steps");
    steps.attributes.push(Attribute::number("NSteps", n as i64));
    steps.add("Values", Kind::F64, &[n]);
    for name in ["NumberOfParts", "PartOffsets", "PointOffsets"] {
        steps.add(name, Kind::I64, &[n]);
    }
    for name in ["CellOffsets", "ConnectivityIdOffsets"] {
        steps.add(name, Kind::I64, &[n, 1]);
    }
    for section in ["PointData", "CellData"] {
        let mut group = Group::named(&format!("{section}Offsets"));
        for heading in fields.iter().filter(|h| h.section == section) {
            group.add(&heading.name, Kind::I64, &[n]);
        }
        steps.groups.push(group);
    }
    let names = || ["cycle"].into_iter().chain(words.iter().map(|(name, _)| *name));
    let mut offsets = Group::named("FieldDataOffsets");
    names().for_each(|name| offsets.add(name, Kind::I64, &[n]));
    let mut sizes = Group::named("FieldDataSizes");
    names().for_each(|name| sizes.add(name, Kind::I64, &[n, 2]));
    steps.groups.extend([offsets, sizes]);
    steps
}
