//! SCRUB: when a master starts, results of jobs that are over are compared with their checksums, on a thread of the lowest priority.
//!
//! What is damaged is a warning with the file: nothing here can compute it again. A job that goes on looks at its files itself.

use std::path::{Path, PathBuf};

use tracing::{info, warn};

use crate::results::{
    Error, SUMS,
    sums::{self, Checked},
};

/// Begins to look at these results folders, by job. Ends with the process.
pub fn begin(folders: Vec<(u32, PathBuf)>) {
    if folders.is_empty() {
        return;
    }
    let look = move || {
        system::processors::lowest_priority();
        let (mut count, mut damaged) = (0, 0);
        for (job, folder) in folders {
            match of_what_stands(&folder, sums::check(&folder)) {
                Ok(Some(checked)) => {
                    count += checked.count;
                    damaged += checked.damaged.len();
                    checked.damaged.iter().for_each(|error| tell(job, error));
                }
                // It was taken away, or never came to its end.
                Ok(None) => {}
                Err(error) => warn!(job, "its results are not looked at: {error}"),
            }
        }
        info!(damaged, "{count} checksums of results were looked at");
    };
    if let Err(error) = std::thread::Builder::new().name("scrub".to_owned()).spawn(look) {
        warn!("results of earlier jobs are not looked at: {error}");
    }
}

/// What was found in a folder, unless its results were removed meanwhile: their checksums go first.
fn of_what_stands(folder: &Path, found: Result<Option<Checked>, Error>) -> Result<Option<Checked>, Error> {
    if folder.join(SUMS).exists() { found } else { Ok(None) }
}

fn tell(job: u32, error: &Error) {
    warn!(job, "{error}; submit the job again, or take the file from a copy");
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::results::Folder;

    #[test]
    fn what_is_missing_is_told_unless_the_results_are_being_removed() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = Folder::create(place.path(), false).expect("empty");
        let states: Vec<_> = (0..9).map(|index| folder.file(&format!("state-{index:06}.vtu"))).collect();
        states.iter().for_each(|path| fs::write(path, "a state").expect("room"));
        sums::write(&folder, &[]).expect("room");
        fs::remove_file(&states[0]).expect("it is there");
        let found = of_what_stands(place.path(), sums::check(place.path())).expect("readable");
        assert_eq!(found.map(|checked| checked.damaged.len()), Some(1));

        let during = sums::check(place.path());
        // A removal that comes no further than to the first of these.
        for path in &states[1..] {
            fs::remove_file(path).expect("it is there");
            fs::create_dir(path).expect("room");
        }
        folder.clear().expect_err("no file has these names");
        assert!(of_what_stands(place.path(), during).expect("readable").is_none());
    }
}
