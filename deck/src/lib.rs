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
pub mod refine;
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
use mesh_file::{Format, MeshFile};
use typed::{
    Deck,
    mesh::{Meshes, Source},
    part::Part,
};

pub use fault::{Fault, MAX_FAULTS};
pub use keyword::UNIT_NAMES;
pub use limits::{
    Bounds, MAX_CONTACT_PARTS, MAX_ELEMENTS, MAX_ENTRIES, MAX_NODES, MAX_PARTS, MAX_TEXT, MAX_TITLE,
};
pub use log::Warning;
pub use model::Model;
pub use table::{MAX_NAME, MAX_NUMBER};

/// A deck that can run, and what its user should know.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The checked problem.
    pub model: Model,
    /// What is done otherwise than the deck and its meshes say.
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

/// Nothing but what bounds every deck.
const UNBOUNDED: Bounds<'static> = Bounds { elements: MAX_ELEMENTS, is_given_up: &|| false };

/// As [`read`], within bounds.
///
/// # Errors
/// As [`read`]; a deck that is given up has one fault.
pub fn read_within(text: &str, file_name: &str, bounds: &Bounds<'_>) -> Result<Model, Vec<Fault>> {
    read_with(text, file_name, bounds).map(|reading| reading.model)
}

/// As [`read`], with the warnings.
///
/// # Errors
/// As [`read`].
pub fn read_whole(text: &str, file_name: &str) -> Result<Reading, Vec<Fault>> {
    read_with(text, file_name, &UNBOUNDED)
}

/// As [`read_within`], with the warnings.
///
/// # Errors
/// As [`read_within`].
pub fn read_whole_within(text: &str, file_name: &str, bounds: &Bounds<'_>) -> Result<Reading, Vec<Fault>> {
    read_with(text, file_name, bounds)
}

fn read_with(text: &str, file_name: &str, bounds: &Bounds<'_>) -> Result<Reading, Vec<Fault>> {
    let bundle = deck_of(text, file_name)?;
    let reading = match Kind::of(bundle.files[0].1) {
        Kind::Keyword => read_keyword(&bundle, MESH, bounds).map(|whole| whole.reading),
        _ => read_toml(&bundle, bounds),
    };
    let mut reading = reading.map_err(|faults| bundle.conceal(faults))?;
    reading.warnings.iter_mut().for_each(|warning| bundle.conceal_words(warning));
    Ok(reading)
}

/// The files of a deck; a mesh of another program is none.
fn deck_of<'a>(text: &'a str, file_name: &'a str) -> Result<Bundle<'a>, Vec<Fault>> {
    let bundle = Bundle::of(text, file_name)?;
    let (name, text) = bundle.files[0];
    let is_toml = || Kind::of(text) == Kind::Toml && toml::de::DeTable::parse(text).is_ok();
    if Format::is_foreign_mesh(name, text) && !is_toml() {
        let faults = Faults::new(name, text);
        let advice = format!("write one that names this mesh: bolide convert {name}");
        faults.add(0, "a mesh", "a deck, with materials and times", advice);
        return Err(faults.into_list());
    }
    Ok(bundle)
}

/// Name of the mesh of a keyword deck that is not written.
const MESH: &str = "keyword.mesh";

/// Reads and checks a TOML deck with its mesh files.
fn read_toml(bundle: &Bundle<'_>, bounds: &Bounds<'_>) -> Result<Reading, Vec<Fault>> {
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
    let mut files = bundle.files.clone();
    files[0].1 = text;
    let log = Log::toml(&files).within(bounds);
    let mut deck = toml_deck::read(text, &log);
    if let (Some(deck), Some(factor)) = (&mut deck, bundle.options.refine) {
        refine::refine(deck, factor, &log);
    }
    let mut meshes = mesh_file::read_all(bundle, deck.as_ref(), &log);
    let model = deck.as_ref().and_then(|deck| make::model(deck, &meshes.by_name, &log));
    let reading = conclude(model, deck.as_ref(), log, bundle);
    if !meshes.faults.is_empty() {
        meshes.faults.extend(reading.err().unwrap_or_default());
        return Err(meshes.faults);
    }
    reading.map(|mut reading| {
        meshes.warnings.append(&mut reading.warnings);
        Reading { warnings: meshes.warnings, ..reading }
    })
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
    bounds: &Bounds<'_>,
) -> Result<WholeKeyword, Vec<Fault>> {
    let log = Log::keyword(&bundle.files).within(bounds);
    let (mut deck, mesh) = keyword::read(bundle, mesh_name, &log);
    if let Some(factor) = bundle.options.refine {
        refine::refine(&mut deck, factor, &log);
    }
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
        _ if log.is_given_up() => {
            let faults = Faults::new(bundle.files[0].0, "");
            faults.add(0, "a deck that is given up", "a caller who waits for it", "send it again");
            Err(faults.into_list())
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
    let whole = read_keyword(&bundle, mesh_name, &UNBOUNDED).map_err(|faults| bundle.conceal(faults))?;
    let WholeKeyword { mut reading, deck, mesh } = whole;
    reading.warnings.iter_mut().for_each(|warning| bundle.conceal_words(warning));
    Ok(Converted { deck: write::text(&deck), mesh: mesh.text(), warnings: reading.warnings })
}

/// A TOML deck to start from.
#[derive(Clone, Debug)]
pub struct Start {
    pub deck: String,
    /// What is not taken over, and what is assumed.
    pub warnings: Vec<Warning>,
}

/// Writes a TOML deck to start from for a mesh of another program, whose path from that deck is `mesh_name`. Materials and units are not
/// those of the file: it runs, and its user is to choose them.
///
/// # Errors
/// Every fault of the mesh.
pub fn start_from_mesh(text: &str, file_name: &str, mesh_name: &str) -> Result<Start, Vec<Fault>> {
    let bundle = Bundle::of(text, file_name)?;
    let (name, mesh_text) = bundle.files[0];
    let asked = bundle.options.units.as_deref();
    let Some(units) =
        keyword::units_of(asked).and_then(|name| units::SETS.iter().find(|set| set.name == name))
    else {
        let faults = Faults::new(name, mesh_text);
        let read = format!("--units {}", asked.unwrap_or_default());
        faults.add(0, read, format!("one of {UNIT_NAMES}"), "choose one of them");
        return Err(faults.into_list());
    };
    let found = mesh_file::read(&bundle, 0).map_err(|faults| bundle.conceal(faults))?;
    let mesh_file::Found { mesh, mut warnings, .. } = found;
    warnings.iter_mut().for_each(|warning| bundle.conceal_words(warning));
    if asked.is_none() {
        let words = format!("a mesh does not say its units, {} is assumed; give --units", units.name);
        warnings.push(Warning { file: name.to_string(), line: 1, words });
    }
    let title = mesh_name.rsplit(['/', '\\']).next().unwrap_or(mesh_name);
    Ok(Start { deck: mesh_file::skeleton::text(&mesh, title, mesh_name, units), warnings })
}

/// Names of the library's materials.
pub fn materials() -> Vec<&'static str> {
    library::names()
}
