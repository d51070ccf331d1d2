//! SCRUB: when a master starts, results of jobs that are over are compared with their checksums, on a thread of the lowest priority.
//!
//! What is damaged is a warning with the file: nothing here can compute it again. A job that goes on looks at its files itself.

use std::path::PathBuf;

use tracing::{info, warn};

use crate::results::{Error, sums};

/// Begins to look at these results folders, by job. Ends with the process.
pub fn begin(folders: Vec<(u32, PathBuf)>) {
    if folders.is_empty() {
        return;
    }
    let look = move || {
        system::processors::lowest_priority();
        let (mut count, mut damaged) = (0, 0);
        for (job, folder) in folders {
            match sums::check(&folder) {
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

fn tell(job: u32, error: &Error) {
    warn!(job, "{error}; submit the job again, or take the file from a copy");
}
