//! EXPORT: `bolide export`, the states of a results folder in another format, for programs that do not read VTU.

use std::{path::PathBuf, process::ExitCode};

use clap::{Args, builder::PossibleValuesParser};
use deck::model::FORMAT_NAMES;

use crate::{
    results::{format::Written, formats},
    shell::print,
};

/// Flags of `export`.
#[derive(Args, Clone, Debug)]
pub struct ExportArgs {
    /// A results folder, also of a run that goes on or was killed; its states stay
    pub results: PathBuf,
    /// The format, or several separated by commas: vtkhdf is one file for ParaView, d3plot is for programs that read LS-DYNA
    #[arg(long, required = true, value_delimiter = ',', value_parser = PossibleValuesParser::new(FORMAT_NAMES))]
    pub format: Vec<String>,
}

/// Writes the states of a folder in other formats.
///
/// # Errors
/// Files that cannot be read or written.
pub fn run(args: &ExportArgs) -> Result<ExitCode, String> {
    for written in formats::write_all(&args.results, &args.format).map_err(|e| e.to_string())? {
        print(&line(&written))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What was written, in a line.
pub fn line(written: &Written) -> String {
    match written.note.as_str() {
        "" => format!("wrote {}", written.path.display()),
        note => format!("wrote {}; {note}", written.path.display()),
    }
}
