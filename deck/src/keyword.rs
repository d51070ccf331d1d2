//! LS-DYNA keyword decks: read, and put into the words of a TOML deck and a mesh file.
//!
//! 1. [`cards`]: lines, includes, cases and parameters become blocks of cards;
//! 2. [`problem`]: each keyword is read by its columns;
//! 3. [`translate`]: what was read becomes the text of a TOML deck and a mesh.
//!
//! The TOML reader then makes the model, so that a keyword deck is checked as any other, and `convert` writes down
//! exactly what `run` computes. Faults that the TOML reader finds are given the line of the keyword deck from which
//! theirs was made. Nothing is passed over in silence: what is read and not honoured is a fault where it would change
//! what is computed, else a warning.

mod cards;
mod condition;
mod contact;
mod control;
mod draft;
mod erosion;
mod fields;
mod log;
mod material;
mod parameter;
mod problem;
mod rigid;
mod set;
mod translate;
mod unit;

pub use log::Warning;
pub use unit::NAMES as UNIT_NAMES;

pub(crate) use cards::includes;

use crate::{bundle::Bundle, fault::Fault, mesh_file::MeshFile, model::Model, typed::mesh::Meshes};

/// Name of the mesh inside the deck that is made.
const MESH: &str = "keyword.mesh";

/// A keyword deck in our words.
pub(crate) struct Translated {
    pub(crate) deck: String,
    pub(crate) mesh: MeshFile,
    pub(crate) model: Model,
    pub(crate) warnings: Vec<Warning>,
}

/// Reads a keyword deck; its mesh will be called `mesh_name`.
///
/// # Errors
/// Every fault of the deck that could be found, in the order of files and lines.
pub(crate) fn read(bundle: &Bundle<'_>, mesh_name: Option<&str>) -> Result<Translated, Vec<Fault>> {
    let log = log::Log::new(bundle.files.iter().map(|(name, _)| (*name).to_string()).collect());
    let mut lines = cards::read(bundle, &log);
    let problem = problem::Problem::read(&mut lines, &log);
    let mesh_name = mesh_name.unwrap_or(MESH);
    let (draft, mesh) = translate::translate(&problem, bundle.options.units.as_deref(), mesh_name, &log);
    drop(problem);
    if log.count() > 0 {
        return Err(log.into_lists().0);
    }
    let meshes = Meshes::from([(mesh_name.to_string(), Some(mesh.into()))]);
    let model = crate::read_toml(&draft.text, "deck", &meshes);
    let mesh = meshes.into_values().flatten().next().map(|mesh| mesh.file).unwrap_or_default();
    match model {
        Ok(model) => {
            let (_, warnings) = log.into_lists();
            Ok(Translated { deck: draft.text, mesh, model, warnings })
        }
        Err(faults) => {
            for fault in faults {
                let at = draft.origin(fault.line);
                let [read, expected] =
                    [&fault.read, &fault.expected].map(|words| draft.relined(words, at, &log));
                log.fault(at, read, expected, fault.advice);
            }
            Err(log.into_lists().0)
        }
    }
}
