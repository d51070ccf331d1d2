//! Text in, checked [`Model`] out.
//!
//! [`read`] takes the text of a TOML deck (`README.md` is the reference of the format) or of an LS-DYNA keyword deck,
//! alone or with the files that it refers to ([`bundle`]), and gives either a
//! [`Model`] that can run, or every [`Fault`] of the deck with line, column, what was read, what was
//! expected and what to do. It opens no file, allocates nothing before its size is known to be inside the
//! named limits, and does not panic on any text.
//!
//! Parts are built from blocks, by the material library or materials of the deck ([`library`]), in one
//! named consistent set of units ([`units`]). Nothing is computed here that a cycle needs.

#![cfg_attr(test, expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions"))]

mod blocks;
pub mod bundle;
pub mod fault;
mod geometry;
mod include;
mod keyword;
pub mod library;
mod limits;
mod log;
mod make;
pub mod mesh_file;
pub mod model;
pub mod parameters;
pub mod perturb;
pub mod physics;
mod place;
pub mod schema;
pub mod starters;
pub mod table;
mod toml_deck;
mod typed;
pub mod units;
mod write;

use bundle::{Bundle, Kind};
use fault::Faults;
use log::Log;
use mesh_file::MeshFile;
use typed::{
    Deck,
    mesh::{Mesh, Meshes, Source},
    part::Part,
};

pub use fault::{Fault, MAX_FAULTS};
pub use keyword::UNIT_NAMES;
pub use limits::{MAX_CONTACT_PARTS, MAX_ELEMENTS, MAX_ENTRIES, MAX_NODES, MAX_PARTS, MAX_TEXT, MAX_TITLE};
pub use log::Warning;
pub use model::Model;
pub use table::{MAX_NAME, MAX_NUMBER};

/// A deck that can run, and what its user should know.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The checked problem.
    pub model: Model,
    /// What is done otherwise than the deck says; TOML decks have none.
    pub warnings: Vec<Warning>,
    /// Of each part the counts of cells of its block, in the order of `cells` in a TOML deck; empty of a part with another mesh.
    pub cells: Vec<Vec<u32>>,
}

/// Reads and checks a deck, or a bundle of files that [`bundle::gather`] made. `file_name` stands in the faults of a
/// deck of one file; no file is opened.
///
/// # Errors
///
/// Every fault of the deck, ordered by place, at most [`MAX_FAULTS`]. Faults of syntax hide all others.
pub fn read(text: &str, file_name: &str) -> Result<Model, Vec<Fault>> {
    read_whole(text, file_name).map(|reading| reading.model)
}

/// As [`read`], for a deck that may ask for no more elements than this: who reads it has no memory for more.
///
/// # Errors
/// As [`read`].
pub fn read_at_most(text: &str, file_name: &str, most_elements: u64) -> Result<Model, Vec<Fault>> {
    let bundle = Bundle::of(text, file_name)?;
    let reading = match Kind::of(bundle.files[0].1) {
        Kind::Keyword => read_keyword(&bundle, MESH, most_elements).map(|whole| whole.reading),
        _ => read_toml(&bundle, most_elements),
    };
    reading.map(|reading| reading.model)
}

/// As [`read`], with the warnings.
///
/// # Errors
/// As [`read`].
pub fn read_whole(text: &str, file_name: &str) -> Result<Reading, Vec<Fault>> {
    let bundle = Bundle::of(text, file_name)?;
    match Kind::of(bundle.files[0].1) {
        Kind::Keyword => read_keyword(&bundle, MESH, MAX_ELEMENTS).map(|whole| whole.reading),
        _ => read_toml(&bundle, MAX_ELEMENTS),
    }
}

/// Name of the mesh of a keyword deck that is not written.
const MESH: &str = "keyword.mesh";

/// Reads and checks a TOML deck with its mesh files.
fn read_toml(bundle: &Bundle<'_>, most_elements: u64) -> Result<Reading, Vec<Fault>> {
    let (name, text) = bundle.files[0];
    let given = &bundle.options.parameters;
    let substituted;
    let text = if given.is_empty() && !lacks_parameters(text) {
        text
    } else {
        let faults = Faults::new(name, text);
        let Some(text) = parameters::substitute(text, given, &faults) else { return Err(faults.into_list()) };
        substituted = text;
        &substituted
    };
    let log = Log::toml(name, text).with_most_elements(most_elements);
    let mut of_meshes = Vec::new();
    let mut meshes = Meshes::new();
    for (path, text) in &bundle.files[1..] {
        // The deck names its meshes as it sees them.
        let folder = name.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
        let seen = path.strip_prefix(&folder).unwrap_or(path);
        let mesh = mesh_file::parse(text, path).map_err(|faults| of_meshes.extend(faults));
        meshes.insert(seen.to_string(), mesh.ok().map(Mesh::from));
    }
    let deck = toml_deck::read(text, &log);
    let model = deck.as_ref().and_then(|deck| make::model(deck, &meshes, &log));
    let mut reading = conclude(model, deck.as_ref(), log, bundle);
    if !of_meshes.is_empty() {
        of_meshes.extend(reading.err().unwrap_or_default());
        reading = Err(of_meshes);
    }
    reading
}

/// A keyword deck that can run, as a typed deck too.
struct WholeKeyword {
    reading: Reading,
    deck: Deck,
    mesh: MeshFile,
}

/// Reads and checks a keyword deck.
fn read_keyword(
    bundle: &Bundle<'_>,
    mesh_name: &str,
    most_elements: u64,
) -> Result<WholeKeyword, Vec<Fault>> {
    let log = Log::keyword(&bundle.files).with_most_elements(most_elements);
    let (deck, mesh) = keyword::read(bundle, mesh_name, &log);
    let meshes = Meshes::from([(mesh_name.to_string(), Some(mesh))]);
    let model = make::model(&deck, &meshes, &log);
    let mesh = meshes.into_values().flatten().next().map(|mesh| mesh.file).unwrap_or_default();
    Ok(WholeKeyword { reading: conclude(model, Some(&deck), log, bundle)?, deck, mesh })
}

/// Whether a deck that was given no parameters cannot be read without them.
fn lacks_parameters(text: &str) -> bool {
    text.len() <= MAX_TEXT && parameters::has_any(text) && toml::de::DeTable::parse(text).is_err()
}

/// The model of a deck without a fault, perturbed and named as asked.
fn conclude(
    model: Option<Model>,
    deck: Option<&Deck>,
    log: Log<'_>,
    bundle: &Bundle<'_>,
) -> Result<Reading, Vec<Fault>> {
    match model {
        Some(mut model) if log.count() == 0 => {
            if let Some(perturbation) = bundle.options.perturbation {
                perturb::perturb(&mut model, perturbation);
            }
            if let Some(title) = &bundle.options.title {
                model.title.clone_from(title);
            }
            let cells = |part: &Part| match part.mesh.as_ref().map(|mesh| &mesh.source) {
                Some(Source::Shape(shape)) => shape.cells(),
                _ => Vec::new(),
            };
            let cells = deck.map_or_else(Vec::new, |deck| deck.parts.iter().map(cells).collect());
            Ok(Reading { model, warnings: log.into_lists().1, cells })
        }
        _ => {
            assert!(log.count() > 0, "a deck was refused without a fault");
            Err(log.into_lists().0)
        }
    }
}

/// A keyword deck as a TOML deck and a mesh file.
#[derive(Clone, Debug)]
pub struct Converted {
    pub deck: String,
    /// Text of the mesh file.
    pub mesh: String,
    /// What is done otherwise than the keyword deck says.
    pub warnings: Vec<Warning>,
}

/// Puts a keyword deck into a TOML deck, which calls its mesh file `mesh_name`. Both give the same model.
///
/// # Errors
/// Every fault of the deck; a deck that is no keyword deck is one.
pub fn convert(text: &str, file_name: &str, mesh_name: &str) -> Result<Converted, Vec<Fault>> {
    let bundle = Bundle::of(text, file_name)?;
    let (name, deck) = bundle.files[0];
    if Kind::of(deck) != Kind::Keyword {
        let faults = Faults::new(name, deck);
        faults.add(0, faults.quote(0, 60), "an LS-DYNA keyword deck", "run a TOML deck as it is");
        return Err(faults.into_list());
    }
    if bundle.options.perturbation.is_some() {
        let faults = Faults::new(name, deck);
        faults.add(
            0,
            "a perturbation of the nodes",
            "a deck as it is",
            "perturb the nodes where it runs, with --perturb",
        );
        return Err(faults.into_list());
    }
    let WholeKeyword { reading, deck, mesh } = read_keyword(&bundle, mesh_name, MAX_ELEMENTS)?;
    Ok(Converted { deck: write::text(&deck), mesh: mesh.text(), warnings: reading.warnings })
}

/// Names of the library's materials.
pub fn materials() -> Vec<&'static str> {
    library::names()
}
