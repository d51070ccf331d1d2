//! Meshes in files of their own: nodes, bodies of elements and named sets, by the numbers of the file.
//!
//! Every format is read into one value, [`MeshFile`], by a reader of its own: that of this program (`own`), Gmsh, Abaqus, Nastran, and
//! LS-DYNA keywords (`crate::keyword`). The ending of a file's name says its format. What a deck does with a mesh is in `make/part.rs`;
//! materials, supports and loads of the other formats are not taken over, and a warning names what was left out.

mod abaqus;
mod composite;
mod draft;
mod gmsh;
mod nastran;
mod of_deck;
mod own;
pub(crate) mod skeleton;

use std::collections::BTreeMap;

use crate::{
    bundle::Bundle,
    fault::{Fault, Faults},
    keyword,
    limits::MAX_TEXT,
    log::Warning,
    place::Place,
};
use draft::Report;
pub(crate) use of_deck::read_all;

/// A mesh by the user's numbers. Every element names nodes of the mesh; numbers are unique among nodes and among the
/// elements of one kind; of other programs an element may be in several bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshFile {
    /// Number and position (length) of each node.
    pub nodes: Vec<(u32, [f64; 3])>,
    /// Bodies in the order of the file.
    pub bodies: Vec<Body>,
    /// Node numbers of each named set.
    pub sets: BTreeMap<String, Vec<u32>>,
    /// Faces of each named set by their four nodes; the last two are equal in a triangle.
    pub segments: BTreeMap<String, Vec<[u32; 4]>>,
    /// Initial velocities of nodes (length per time); they go before those of parts.
    pub velocities: Vec<(u32, [f64; 3])>,
    /// Initial rotation rates of nodes of shells (1/time).
    pub spins: Vec<(u32, [f64; 3])>,
}

/// The elements of one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Body {
    /// Name by which a part asks for it. Bodies of one name have elements of different kinds.
    pub name: String,
    /// Its number in the file, where it has one: a part may ask for that as well.
    pub number: Option<u32>,
    /// Number and corners of each hexahedron.
    pub solids: Vec<(u32, [u32; 8])>,
    /// Number and nodes of each tetrahedron with nodes on its edges, in the order of [`mechanics::element::tet10`].
    pub tetrahedra: Vec<(u32, [u32; 10])>,
    /// Number and corners of each shell.
    pub shells: Vec<(u32, [u32; 4])>,
    /// Of each shell its own thickness (length), 0 where that of the part serves; empty where no shell has its own.
    pub thicknesses: Vec<f64>,
    /// Number and ends of each truss. A body has elements of one kind.
    pub trusses: Vec<(u32, [u32; 2])>,
    /// Of each truss a direction that a beam there has across it, or none of any.
    pub across: Vec<[f64; 3]>,
}

impl Body {
    /// The nodes of its elements, as often as they are corners.
    pub fn corners(&self) -> impl Iterator<Item = u32> + '_ {
        self.elements().flat_map(|(_, nodes)| nodes.iter().copied())
    }

    /// Number and nodes of each element.
    pub fn elements(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let solids = self.solids.iter().map(|(id, nodes)| (*id, &nodes[..]));
        let shells = self.shells.iter().map(|(id, nodes)| (*id, &nodes[..]));
        let tetrahedra = self.tetrahedra.iter().map(|(id, nodes)| (*id, &nodes[..]));
        solids.chain(tetrahedra).chain(shells).chain(self.trusses.iter().map(|(id, nodes)| (*id, &nodes[..])))
    }

    /// Its name in messages, with its number where it has one.
    pub fn title(&self) -> String {
        match self.number {
            Some(number) if !self.name.ends_with(&format!(" {number}")) => {
                format!("{} ({number})", self.name)
            }
            _ => self.name.clone(),
        }
    }

    /// The word of its elements.
    pub fn kind(&self) -> &'static str {
        match (self.shells.is_empty(), self.trusses.is_empty()) {
            (true, true) => "solids",
            (false, _) => "shells",
            (true, false) => "trusses",
        }
    }
}

impl MeshFile {
    /// The bodies of that name, and where there are none those of that number.
    pub fn bodies_called<'m>(&'m self, name: &'m str) -> impl Iterator<Item = (usize, &'m Body)> {
        let bodies = || self.bodies.iter().enumerate();
        let named = bodies().any(|(_, body)| body.name == name);
        let number: Option<u32> = name.parse().ok().filter(|_| !named);
        bodies().filter(move |(_, body)| match named {
            true => body.name == name,
            false => number.is_some() && body.number == number,
        })
    }
}

/// Formats of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// That of this program.
    Own,
    /// Gmsh 4.1, ASCII.
    Gmsh,
    /// Keywords of Abaqus.
    Abaqus,
    /// Bulk data of Nastran.
    Nastran,
    /// Keywords of LS-DYNA.
    Keyword,
}

/// The endings of files of other programs, in lower case.
const ENDINGS: [(&str, Format); 9] = [
    ("msh", Format::Gmsh),
    ("inp", Format::Abaqus),
    ("bdf", Format::Nastran),
    ("nas", Format::Nastran),
    ("dat", Format::Nastran),
    ("fem", Format::Nastran),
    ("k", Format::Keyword),
    ("key", Format::Keyword),
    ("dyn", Format::Keyword),
];

impl Format {
    /// The format of a file: by the ending of its name, and that of this program for every other ending. What calls itself `*KEYWORD` is
    /// of LS-DYNA, whose decks have all kinds of endings.
    pub fn of(name: &str, text: &str) -> Self {
        let ending = name.rsplit_once('.').map_or(String::new(), |(_, ending)| ending.to_ascii_lowercase());
        let format = ENDINGS.iter().find(|(known, _)| *known == ending).map(|(_, format)| *format);
        let is_keyword = |line: &str| line.get(..8).is_some_and(|word| word.eq_ignore_ascii_case("*KEYWORD"));
        match format {
            Some(Self::Abaqus | Self::Nastran) if text.lines().take(HEAD).any(is_keyword) => Self::Keyword,
            Some(format) => format,
            None => Self::Own,
        }
    }

    /// Whether a file holds a mesh of another program, and no deck.
    pub fn is_foreign_mesh(name: &str, text: &str) -> bool {
        matches!(Self::of(name, text), Self::Gmsh | Self::Abaqus | Self::Nastran)
    }
}

/// Lines among which `*KEYWORD` stands.
const HEAD: usize = 1000;

/// A mesh that was read.
pub(crate) struct Found {
    pub(crate) mesh: MeshFile,
    /// Of the elements of each body, as cards of files of the bundle; empty where they are not known.
    pub(crate) places: Vec<Vec<Place>>,
    /// What is left out.
    pub(crate) warnings: Vec<Warning>,
}

/// A mesh, or the faults of its file.
pub(crate) type Read = Result<Found, Vec<Fault>>;

/// Reads a mesh file that refers to no other.
///
/// # Errors
/// Its faults, each with its line.
pub fn parse(text: &str, file_name: &str) -> Result<MeshFile, Vec<Fault>> {
    let bundle = Bundle { options: Default::default(), files: vec![(file_name, text)], outside: Vec::new() };
    read(&bundle, 0).map(|found| found.mesh)
}

/// Reads a file of a bundle as a mesh; a mesh of keywords may include other files of the bundle.
///
/// # Errors
/// Its faults, each with its line.
pub(crate) fn read(bundle: &Bundle<'_>, file: usize) -> Read {
    let (name, text) = bundle.files[file];
    let format = Format::of(name, text);
    if text.len() > MAX_TEXT && !matches!(format, Format::Own | Format::Keyword) {
        let faults = Faults::new(name, text);
        let read = format!("a mesh file of {} bytes", text.len());
        faults.add(0, read, format!("at most {MAX_TEXT}"), "make a coarser mesh, or a file for each body");
        return Err(faults.into_list());
    }
    let other = |read: fn(&Report<'_>) -> draft::Draft| {
        let report = Report::new((name, text), file as u16);
        let draft = read(&report);
        draft.into_mesh(report)
    };
    match format {
        Format::Own => {
            own::parse(text, name).map(|mesh| Found { mesh, places: Vec::new(), warnings: Vec::new() })
        }
        Format::Gmsh => other(gmsh::read),
        Format::Abaqus => other(abaqus::read),
        Format::Nastran => other(nastran::read),
        Format::Keyword => {
            let mut files = bundle.files.clone();
            files.swap(0, file);
            let mut found =
                keyword::read_mesh(&Bundle { options: Default::default(), files, outside: Vec::new() })?;
            for place in found.places.iter_mut().flatten() {
                if let Place::Card { file: of, .. } = place {
                    *of = match usize::from(*of) {
                        0 => file as u16,
                        other if other == file => 0,
                        _ => *of,
                    };
                }
            }
            Ok(found)
        }
    }
}
