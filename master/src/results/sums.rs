//! Checksums of a results folder that is complete: `checksums.json`, written last.
//!
//! One BLAKE3 sum for each state with its contact surface, one for each other file that a run writes. [`check`] says what has been damaged or
//! is missing since; it computes nothing again, which `bolide verify` does.

use std::{
    collections::BTreeMap,
    fs, io,
    io::Write as _,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    Error, Folder, SUMS, is_of_a_state, is_written_by_a_run, state_name, sum_of_state, vtu::read, write_whole,
};

/// The file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sums {
    /// By index of the state, hexadecimal.
    states: Vec<String>,
    /// By name of the file, hexadecimal.
    files: BTreeMap<String, String>,
}

/// What a look at the files of a folder found.
#[derive(Debug, Default)]
pub struct Checked {
    /// Sums that were looked at.
    pub count: usize,
    /// Files that are not what was written.
    pub damaged: Vec<Error>,
}

/// Writes the checksums of a folder in which nothing else will be written. `known` are those of its first states.
///
/// # Errors
/// [`Error::Io`].
pub fn write(folder: &Folder, known: &[[u8; 32]]) -> Result<(), Error> {
    let mut sums = Sums { states: Vec::new(), files: BTreeMap::new() };
    for index in 0.. {
        let sum = match known.get(index) {
            Some(sum) => *sum,
            None if folder.file(&state_name(index as u32)).is_file() => folder.sum_of_state(index as u32)?,
            None => break,
        };
        sums.states.push(hex(&sum));
    }
    for name in names(folder.path())? {
        sums.files.insert(name.clone(), hex(&sum_of(&folder.file(&name))?));
    }
    write_whole(&folder.file(SUMS), |out| {
        serde_json::to_writer_pretty(&mut *out, &sums)?;
        out.write_all(b"\n")
    })
}

/// Removes the checksums of a folder that is going to be written to.
///
/// # Errors
/// [`Error::Io`].
pub fn remove(folder: &Folder) -> Result<(), Error> {
    let path = folder.file(SUMS);
    match fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io("remove", &path)(error)),
        _ => Ok(()),
    }
}

/// Reads every file of a results folder and compares it with its checksum; none where the folder has no checksums: of a run that did not
/// come to its end.
///
/// # Errors
/// If the checksums cannot be read, or the system could not look at a file.
pub fn check(folder: &Path) -> Result<Option<Checked>, Error> {
    let path = folder.join(SUMS);
    let bytes = match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes.map_err(Error::io("read", &path))?,
    };
    let Ok(Sums { states, files }) = serde_json::from_slice(&bytes) else {
        return Ok(Some(Checked { count: 0, damaged: vec![Error::Damaged { path }] }));
    };
    let mut checked = Checked { count: states.len() + files.len(), damaged: Vec::new() };
    // A state that was taken away before the sums were written has none, and those behind it neither.
    for (index, (_, path)) in read::index(folder).unwrap_or_default().into_iter().enumerate() {
        if let Some(error) = fs::metadata(&path).err().filter(|_| index >= states.len()) {
            checked.count += 1;
            checked.damaged.push(Error::io("read", &path)(error));
        }
    }
    let of_states = states.iter().enumerate().map(|(index, stated)| {
        (folder.join(state_name(index as u32)), stated, sum_of_state(folder, index as u32))
    });
    let of_files = files.iter().map(|(name, stated)| {
        let path = folder.join(name);
        let sum = sum_of(&path);
        (path, stated, sum)
    });
    for (path, stated, sum) in of_states.chain(of_files) {
        let path: PathBuf = path;
        match sum {
            Ok(sum) if hex(&sum) == *stated => {}
            Ok(_) => checked.damaged.push(Error::Damaged { path }),
            Err(error) if error.is_loss() => checked.damaged.push(error),
            Err(error) => return Err(error),
        }
    }
    Ok(Some(checked))
}

/// Names of the files that have a sum of their own.
fn names(folder: &Path) -> Result<Vec<String>, Error> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io("read", folder))? {
        let entry = entry.map_err(Error::io("read", folder))?;
        let Ok(name) = entry.file_name().into_string() else { continue };
        let temporary = name.starts_with('.');
        if is_written_by_a_run(&name) && !temporary && !is_of_a_state(&name) && name != SUMS {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn sum_of(path: &Path) -> Result<[u8; 32], Error> {
    let mut hasher = blake3::Hasher::new();
    let mut file = fs::File::open(path).map_err(Error::io("read", path))?;
    io::copy(&mut file, &mut hasher).map_err(Error::io("read", path))?;
    Ok(*hasher.finalize().as_bytes())
}

fn hex(sum: &[u8; 32]) -> String {
    blake3::Hash::from_bytes(*sum).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::{super::PVD, *};

    #[test]
    fn every_flipped_bit_and_every_missing_file_is_named_and_what_others_put_there_is_none_of_it() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = Folder::create(place.path(), false).expect("empty");
        assert!(check(folder.path()).expect("readable").is_none(), "nothing was written yet");
        let files =
            ["state-000000.vtu", "contact-000000.vtp", "state-000001.vtu", "history.csv", "summary.json"];
        for name in files {
            fs::write(folder.file(name), format!("what {name} holds")).expect("room");
        }
        fs::write(folder.file("thesis.txt"), "mine").expect("room");
        let known = [folder.sum_of_state(0).expect("readable")];
        write(&folder, &known).expect("room");
        fs::write(folder.file("thesis.txt"), "better").expect("room");
        let whole = check(folder.path()).expect("readable").expect("it has sums");
        assert!((whole.count, whole.damaged.len()) == (4, 0), "{whole:?}");
        for name in files.into_iter().chain([SUMS]) {
            let path = folder.file(name);
            let bytes = fs::read(&path).expect("written");
            let mut damaged = bytes.clone();
            damaged[3] ^= 4;
            fs::write(&path, damaged).expect("room");
            let found = check(folder.path()).expect("readable").expect("it has sums");
            assert_eq!(found.damaged.len(), 1, "{name}: {found:?}");
            fs::write(&path, bytes).expect("room");
        }
        fs::remove_file(folder.file("state-000001.vtu")).expect("it is there");
        let found = check(folder.path()).expect("readable").expect("it has sums");
        assert!(found.damaged[0].to_string().contains("state-000001.vtu"), "{found:?}");
        remove(&folder).expect("ours");
        assert!(check(folder.path()).expect("readable").is_none());
    }

    #[test]
    fn a_state_that_was_gone_before_the_sums_were_written_is_named_as_well() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = Folder::create(place.path(), false).expect("empty");
        let listed = |index| {
            format!("<DataSet timestep=\"{index}\" group=\"\" part=\"0\" file=\"{}\"/>\n", state_name(index))
        };
        fs::write(folder.file(PVD), [0, 1, 2].map(listed).concat()).expect("room");
        for index in [0, 2] {
            fs::write(folder.file(&state_name(index)), "a state").expect("room");
        }
        write(&folder, &[]).expect("room");
        let found = check(folder.path()).expect("readable").expect("it has sums");
        assert_eq!((found.count, found.damaged.len()), (3, 1), "{found:?}");
        assert!(found.damaged[0].to_string().contains("state-000001.vtu"), "{found:?}");
    }
}
