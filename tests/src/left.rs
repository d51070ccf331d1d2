//! LEFT: what a run leaves on disk, to be compared to the byte with what another one left.

use std::{fs, path::Path};

/// Digest, energies, and the bytes of each file but those that hold times of day and wall times: the summary, the
/// report that draws it, and the checksums of both.
pub struct Left {
    /// Of the final state.
    pub digest: String,
    /// Of the summary.
    pub energies: serde_json::Value,
    /// Name and bytes, by name.
    pub files: Vec<(String, Vec<u8>)>,
}

impl Left {
    /// Reads a results folder; `summary` is what the run printed.
    ///
    /// # Panics
    /// If there is no such folder, or the summary has no digest.
    pub fn of(folder: &Path, summary: &serde_json::Value) -> Self {
        let mut files: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
            .expect("a results folder")
            .map(|entry| entry.expect("readable").path())
            .filter(|path| {
                let timed = ["summary.json", "report.html", "checksums.json"];
                path.is_file() && !timed.iter().any(|name| path.ends_with(name))
            })
            .map(|path| {
                let name = path.file_name().expect("a file").to_string_lossy().into_owned();
                (name, fs::read(&path).expect("readable"))
            })
            .collect();
        files.sort();
        let digest = summary["digest"].as_str().expect("a digest").to_owned();
        Self { digest, energies: summary["energies"].clone(), files }
    }

    /// What differs between this and another one, in words; none if nothing does.
    pub fn difference(&self, other: &Self) -> Option<String> {
        if self.digest != other.digest {
            return Some(format!("digest {} and {}", self.digest, other.digest));
        }
        if self.energies != other.energies {
            return Some(format!("energies {} and {}", self.energies, other.energies));
        }
        let names = |left: &Self| left.files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        if names(self) != names(other) {
            return Some(format!("files {:?} and {:?}", names(self), names(other)));
        }
        let different = self.files.iter().zip(&other.files).find(|(mine, theirs)| mine.1 != theirs.1);
        different.map(|((name, mine), (_, theirs))| {
            format!("{name} differs: {} and {} bytes", mine.len(), theirs.len())
        })
    }

    /// # Panics
    /// If anything differs.
    pub fn assert_same(&self, other: &Self) {
        if let Some(what) = self.difference(other) {
            panic!("{what}");
        }
    }
}
