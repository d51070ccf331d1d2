//! What a run leaves on disk: one folder with states, histories and a summary.
//!
//! A results folder holds `state-NNNNNN.vtu` (one file per written state, [`vtu`]), `results.pvd` (the index
//! that ParaView opens, with the time of each state), where the deck asks for it `contact-NNNNNN.vtp` and `contact.pvd`
//! (the same of the contact surface, [`surface`]), `history.csv` ([`history`]), `summary.json`
//! ([`summary`]), `report.html` ([`report`]), the same states in other formats where they are wanted ([`mod@format`]), the deck that it was
//! computed from with all that it refers to (`input.deck`), and, where the run
//! came to an end, checksums of all that ([`sums`]). Every file appears whole or not at all: it is written under a temporary name and renamed.
//! Only the history grows in place, by whole rows. So the folder of a killed run opens.
//!
//! Nothing here computes physics or decides when to write.

use std::{
    fmt, fs,
    fs::{File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

pub mod d3plot;
pub mod field_unit;
pub mod format;
pub mod formats;
pub mod hdf5;
pub mod history;
pub mod plot;
pub mod report;
pub mod summary;
pub mod sums;
pub mod surface;
pub mod trace;
pub mod von_mises;
pub mod vtkhdf;
pub mod vtu;
pub mod writer;

/// Name of the index of states.
pub const PVD: &str = "results.pvd";
/// Name of the index of contact surfaces.
pub const CONTACT_PVD: &str = "contact.pvd";
/// Name of the table of histories.
pub const HISTORY: &str = "history.csv";
/// Name of the summary.
pub const SUMMARY: &str = "summary.json";
/// Name of the report.
pub const REPORT: &str = "report.html";
/// Name of the trace of a job's workers.
pub const TRACE: &str = "trace.json";
/// Name of the deck that was computed, gathered with the files that it refers to.
pub const INPUT: &str = "input.deck";
/// Name of the checksums.
pub const SUMS: &str = "checksums.json";

pub use deck::model::FIELD_NAMES;
pub use summary::Summary;

use tracing::warn;

use crate::disk::sync_folder;

/// What the lock of a folder leaves there on Windows.
pub const LOCK: &str = "locked";

/// Why results could not be written or read.
#[derive(Debug)]
pub enum Error {
    /// The folder holds something and may not be written over.
    NotEmpty { path: PathBuf },
    /// Another run writes to the folder.
    Taken { path: PathBuf },
    /// The operating system refused: disk full, no permission, not a folder.
    Io {
        /// What was tried, as a verb: `create`, `write`, `read`, `rename`, `remove`.
        action: &'static str,
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A file is not what was written.
    Damaged { path: PathBuf },
    /// A file is not what a run writes.
    Malformed {
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What was expected and what was read.
        what: String,
    },
    /// A field that [`FIELD_NAMES`] does not list.
    UnknownField {
        /// The name as given.
        name: String,
    },
}

impl Error {
    /// Whether what was to be read is gone or damaged; else the system could not look, and it may be whole.
    pub fn is_loss(&self) -> bool {
        match self {
            Self::Damaged { .. } => true,
            Self::Io { source, .. } => source.kind() == io::ErrorKind::NotFound,
            _ => false,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotEmpty { path } => write!(
                f,
                "results folder {} is not empty; name another with --out, or give --force to replace its results",
                path.display()
            ),
            Self::Taken { path } => write!(
                f,
                "results folder {}: another run writes to this folder; wait for its end, or name another with --out",
                path.display()
            ),
            Self::Io { action, path, source } => {
                write!(f, "cannot {action} {}: {source}", path.display())?;
                match source.kind() {
                    io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                        write!(
                            f,
                            "; free some space, or name a folder on another disk (--out; of a master --spool)"
                        )
                    }
                    _ => Ok(()),
                }
            }
            Self::Damaged { path } => {
                write!(f, "{}: damaged: its bytes do not match their checksum", path.display())
            }
            Self::Malformed { path, line, what } => write!(f, "{}, line {line}: {what}", path.display()),
            Self::UnknownField { name } => {
                write!(f, "unknown output field {name:?}; known are {}", FIELD_NAMES.join(", "))
            }
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

impl Error {
    /// An adapter for `map_err`: names what was tried on which path.
    fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}

/// The results folder of one run. It exists and held no results when it was taken.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    /// Held by the run that has claimed it; the system lets go of it when that is killed.
    _lock: Option<Arc<File>>,
}

impl Folder {
    /// Creates the folder, with its parents, or takes an empty one.
    ///
    /// With `force` a folder that is not empty is taken too, and the files that a run writes, left there by an
    /// earlier run, are removed first. Other files stay.
    ///
    /// No other run can take the folder while this value or a clone of it lives.
    ///
    /// # Errors
    /// [`Error::NotEmpty`] without `force`; [`Error::Taken`] if another run has it; [`Error::Io`] if the folder cannot be created, listed or
    /// cleared.
    pub fn create(path: &Path, force: bool) -> Result<Self, Error> {
        let folder = Self::claim(path, force)?;
        folder.clear()?;
        Ok(folder)
    }

    /// The same for a run that may still fail to begin: what is in the folder stays until [`Folder::clear`].
    ///
    /// # Errors
    /// [`Error::NotEmpty`] without `force`; [`Error::Taken`] if another run has it; [`Error::Io`] if it cannot be created or listed.
    pub fn claim(path: &Path, force: bool) -> Result<Self, Error> {
        fs::create_dir_all(path).map_err(Error::io("create", path))?;
        for entry in fs::read_dir(path).map_err(Error::io("read", path))? {
            let name = entry.map_err(Error::io("read", path))?.file_name();
            if !force && name != LOCK {
                return Err(Error::NotEmpty { path: path.to_owned() });
            }
        }
        Self::take(path)
    }

    /// Takes a folder for as long as the value lives.
    fn take(path: &Path) -> Result<Self, Error> {
        let lock = match system::folders::lock(path) {
            Ok(Some(lock)) => Some(Arc::new(lock)),
            Ok(None) => return Err(Error::Taken { path: path.to_owned() }),
            Err(why) => {
                warn!("{}: not locked: {why}; see that no other run writes to this folder", path.display());
                None
            }
        };
        Ok(Self { path: path.to_owned(), _lock: lock })
    }

    /// Removes the files that a run writes. Other files stay.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be listed or cleared.
    pub fn clear(&self) -> Result<(), Error> {
        self.clear_but(|_| false)
    }

    /// The same, without those of some paths.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be listed or cleared.
    pub fn clear_but(&self, stays: impl Fn(&Path) -> bool) -> Result<(), Error> {
        // First the checksums: who looks at files meanwhile does not take those that are gone for damaged.
        if !stays(&self.file(SUMS)) {
            sums::remove(self)?;
        }
        for entry in fs::read_dir(&self.path).map_err(Error::io("read", &self.path))? {
            let entry = entry.map_err(Error::io("read", &self.path))?;
            if entry.file_name().to_str().is_some_and(is_written_by_a_run) && !stays(&entry.path()) {
                fs::remove_file(entry.path()).map_err(Error::io("remove", &entry.path()))?;
            }
        }
        Ok(())
    }

    /// Takes a folder as an earlier session of the same run left it, to go on writing.
    ///
    /// # Errors
    /// [`Error::Taken`] if another run has it; [`Error::Io`] if it cannot be listed.
    pub fn reopen(path: &Path) -> Result<Self, Error> {
        fs::read_dir(path).map_err(Error::io("read", path))?;
        Self::take(path)
    }

    /// BLAKE3 of the files of a state.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn sum_of_state(&self, index: u32) -> Result<[u8; 32], Error> {
        sum_of_state(&self.path, index)
    }

    /// Removes the files of all states but the first so many, of which one that is missing is an error.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep_states(&self, count: usize) -> Result<(), Error> {
        for entry in fs::read_dir(&self.path).map_err(Error::io("read", &self.path))? {
            let entry = entry.map_err(Error::io("read", &self.path))?;
            let name = entry.file_name();
            let number = |start: &str, end: &str| {
                name.to_str().and_then(|n| n.strip_prefix(start)?.strip_suffix(end)?.parse::<usize>().ok())
            };
            let index = number("state-", ".vtu").or_else(|| number("contact-", ".vtp"));
            if index.is_some_and(|index| index >= count) {
                fs::remove_file(entry.path()).map_err(Error::io("remove", &entry.path()))?;
            }
        }
        for index in 0..count {
            let path = self.file(&state_name(index as u32));
            fs::metadata(&path).map_err(Error::io("read", &path))?;
        }
        Ok(())
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

/// Looks whether the states in a folder are those that a snapshot counts on, by their checksums.
///
/// # Errors
/// [`Error::Damaged`] or [`Error::Io`] of the first that is not.
pub fn check_states(folder: &Path, sums: &[[u8; 32]]) -> Result<(), Error> {
    for (index, stated) in sums.iter().enumerate() {
        let computed = sum_of_state(folder, index as u32)?;
        if computed != *stated {
            return Err(Error::Damaged { path: folder.join(state_name(index as u32)) });
        }
    }
    Ok(())
}

fn sum_of_state(folder: &Path, index: u32) -> Result<[u8; 32], Error> {
    let mut hasher = blake3::Hasher::new();
    let state = folder.join(state_name(index));
    let mut add = |path: &Path| {
        let mut file = File::open(path).map_err(Error::io("read", path))?;
        io::copy(&mut file, &mut hasher).map_err(Error::io("read", path)).map(|_| ())
    };
    add(&state)?;
    match add(&folder.join(contact_name(index))) {
        // Decks that do not ask for it have none.
        Err(Error::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {}
        other => other?,
    }
    Ok(*hasher.finalize().as_bytes())
}

/// Name of the file of state `index`; 16 to 20 bytes long.
pub fn state_name(index: u32) -> String {
    format!("state-{index:06}.vtu")
}

/// Name of the file of the contact surface in state `index`.
pub fn contact_name(index: u32) -> String {
    format!("contact-{index:06}.vtp")
}

/// Whether a run writes files of this name: the only ones that `--force` removes.
fn is_written_by_a_run(name: &str) -> bool {
    let stem = name.strip_prefix('.').and_then(|n| n.strip_suffix(".tmp")).unwrap_or(name);
    [PVD, CONTACT_PVD, HISTORY, SUMMARY, REPORT, TRACE, INPUT, SUMS].contains(&stem)
        || is_of_a_state(stem)
        || formats::FORMATS.iter().any(|format| format.writes(stem))
}

/// Whether a file of this name is a state or its contact surface.
fn is_of_a_state(name: &str) -> bool {
    let state = name.strip_prefix("state-").and_then(|n| n.strip_suffix(".vtu"));
    let contact = || name.strip_prefix("contact-").and_then(|n| n.strip_suffix(".vtp"));
    state
        .or_else(contact)
        .is_some_and(|n| (6..=10).contains(&n.len()) && n.bytes().all(|b| b.is_ascii_digit()))
}

/// Creates a file that was not there: what stood under the name is removed, a link itself and not what it leads to, so
/// that nothing is ever written outside of the folder.
///
/// # Errors
/// What the system says.
pub fn create_anew(path: &Path) -> io::Result<File> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    OpenOptions::new().write(true).create_new(true).open(path)
}

/// Looks whether [`write_whole`] could write a file; what stands under its name stays.
///
/// # Errors
/// [`Error::Io`] with the path of the file.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let temporary = temporary_of(path).filter(|_| !path.is_dir());
    let temporary = temporary.ok_or_else(|| Error::io("create", path)(io::ErrorKind::IsADirectory.into()))?;
    create_anew(&temporary).and_then(|_| fs::remove_file(&temporary)).map_err(Error::io("create", path))
}

/// The temporary name `.NAME.tmp` beside a file; none where the path names no file.
pub fn temporary_of(path: &Path) -> Option<PathBuf> {
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(path.file_name()?);
    hidden.push(".tmp");
    Some(path.with_file_name(hidden))
}

/// Writes a file under the temporary name `.NAME.tmp` beside it and renames it, so that readers and killed runs
/// see the former file or the new one.
///
/// # Errors
/// [`Error::Io`] with the path of the file in question; the temporary file is then removed.
///
/// # Panics
/// If `path` ends in no file name.
pub fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let temporary = temporary_of(path).unwrap_or_else(|| panic!("{} names no file", path.display()));
    let file = create_anew(&temporary).map_err(Error::io("create", path))?;
    let mut out = BufWriter::with_capacity(1 << 16, file);
    // Network file systems report a full disk only when the data is synchronised.
    let written = content(&mut out).and_then(|()| out.flush()).and_then(|()| out.get_ref().sync_data());
    let result = match written {
        Ok(()) => {
            let renamed = fs::rename(&temporary, path).map_err(Error::io("rename", path));
            renamed.and_then(|()| sync_folder(path).map_err(Error::io("write", path)))
        }
        Err(source) => {
            // What could not be written must not be written again when the buffer is dropped.
            drop(out.into_parts());
            Err(Error::Io { action: "write", path: path.to_owned(), source })
        }
    };
    if result.is_err() {
        // The first error is the one to report; a file that stays is removed by the next run with force.
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Names of the consistent units of a deck, for headers and tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Units {
    /// Unit of length.
    pub length: &'static str,
    /// Unit of mass.
    pub mass: &'static str,
    /// Unit of time.
    pub time: &'static str,
    /// Unit of energy: mass length^2 / time^2.
    pub energy: &'static str,
    /// Unit of stress: energy / length^3.
    pub stress: &'static str,
    /// Unit of force: energy / length.
    pub force: &'static str,
    /// Unit of energy per mass.
    pub specific: &'static str,
}

impl Units {
    /// The units of a results folder, by the headings of its history; dimensions where there is none.
    pub fn of_results(folder: &Path) -> Self {
        let columns = history::Table::read_columns(&folder.join(HISTORY), &[]).map(|(columns, _)| columns);
        let columns = columns.unwrap_or_default();
        let fits = |units: &Self| {
            let (time, energy) = (format!("time [{}]", units.time), format!("kinetic [{}]", units.energy));
            columns.contains(&time) && columns.contains(&energy)
        };
        let sets = ["SI", "cm-g-us", "mm-ms-kg", "mm-s-t", "in-s-lbf"].map(Self::named);
        sets.into_iter().find(fits).unwrap_or(Self::named(""))
    }

    /// The units that [`deck::model::Model::units`] names; an unknown name gives the dimensions themselves.
    pub fn named(name: &str) -> Self {
        let (length, mass, time, energy, stress, force, specific) = match name {
            "SI" => ("m", "kg", "s", "J", "Pa", "N", "J/kg"),
            // 1 Mbar = 1e11 Pa and 1 cm3 = 1e-6 m3: 1e5 J.
            "cm-g-us" => ("cm", "g", "us", "Mbar*cm3", "Mbar", "Mbar*cm2", "Mbar*cm3/g"),
            "mm-ms-kg" => ("mm", "kg", "ms", "J", "GPa", "kN", "J/kg"),
            "mm-s-t" => ("mm", "t", "s", "mJ", "MPa", "N", "mJ/t"),
            "in-s-lbf" => ("in", "lbf*s2/in", "s", "in*lbf", "psi", "lbf", "in2/s2"),
            _ => ("length", "mass", "time", "energy", "stress", "force", "energy/mass"),
        };
        Self { length, mass, time, energy, stress, force, specific }
    }

    /// By quantity, for programs.
    pub fn json(&self) -> serde_json::Value {
        let Self { length, mass, time, energy, stress, force, specific } = self;
        serde_json::json!({
            "length": length, "mass": mass, "time": time, "energy": energy, "stress": stress, "force": force,
            "specific": specific,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn links_in_the_folder_of_a_job_are_not_followed() {
        let folder = tempfile::tempdir().expect("room for a folder");
        let outside = folder.path().join("outside");
        fs::write(&outside, "untouched").expect("room");
        let job = folder.path().join("job-1");
        fs::create_dir(&job).expect("room");
        for name in [HISTORY, ".history.csv.tmp"] {
            std::os::unix::fs::symlink(&outside, job.join(name)).expect("a link");
        }
        write_whole(&job.join(HISTORY), |out| out.write_all(b"row")).expect("room");
        assert_eq!(fs::read(job.join(HISTORY)).expect("a file"), b"row");
        assert!(job.join(HISTORY).symlink_metadata().expect("there").is_file());
        assert_eq!(fs::read(&outside).expect("there"), b"untouched");
    }

    #[test]
    fn force_knows_the_names_of_a_run_and_no_others() {
        for name in [
            "results.pvd",
            "contact.pvd",
            "history.csv",
            "summary.json",
            "results.vtkhdf",
            "d3plot",
            "d3plot01",
            ".state-000000.vtu.tmp",
            ".results.pvd.tmp",
        ] {
            assert!(is_written_by_a_run(name), "{name}");
        }
        for index in [0, 999_999, 1_000_000, u32::MAX] {
            assert!(is_written_by_a_run(&state_name(index)), "{index}");
            assert!(is_written_by_a_run(&contact_name(index)), "{index}");
        }
        for name in
            ["notes.txt", "state-.vtu", "state-00000a.vtu", "state-1.vtu", "history.csv.tmp", ".tmp", ""]
        {
            assert!(!is_written_by_a_run(name), "{name}");
        }
    }

    #[test]
    fn energy_unit_of_every_set_is_the_one_its_base_units_give() {
        let joule = |mass_kg: f64, length_m: f64, time_s: f64| mass_kg * (length_m / time_s).powi(2);
        let size = |unit: &str| match unit {
            "Pa" | "N" => 1.0,
            "Mbar" => 1e11,
            "Mbar*cm2" => 1e7,
            "GPa" => 1e9,
            "MPa" => 1e6,
            "kN" => 1e3,
            "lbf" => 4.448_221_615_260_5,
            "psi" => 4.448_221_615_260_5 / 0.0254f64.powi(2),
            "J" => 1.0,
            "mJ" => 1e-3,
            "Mbar*cm3" => 1e11 * 1e-6,
            "in*lbf" => 0.0254 * 4.448_221_615_260_5,
            other => panic!("no size known for {other}"),
        };
        for (name, expected, metre) in [
            ("SI", joule(1.0, 1.0, 1.0), 1.0),
            ("cm-g-us", joule(1e-3, 1e-2, 1e-6), 1e-2),
            ("mm-ms-kg", joule(1.0, 1e-3, 1e-3), 1e-3),
            ("mm-s-t", joule(1e3, 1e-3, 1.0), 1e-3),
            ("in-s-lbf", joule(4.448_221_615_260_5 / 0.0254, 0.0254, 1.0), 0.0254),
        ] {
            let units = Units::named(name);
            for (unit, expected) in [
                (units.energy, expected),
                (units.force, expected / metre),
                (units.stress, expected / metre.powi(3)),
            ] {
                let named = size(unit);
                assert!(
                    (named / expected - 1.0).abs() < 1e-12,
                    "{name}: {unit} is {named}, derived {expected}"
                );
            }
        }
    }
}
