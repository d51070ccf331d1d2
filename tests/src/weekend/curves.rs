//! What master, workers and spool take over time.

use std::{fmt::Write as _, fs, path::Path, time::Duration};

/// Rows that are printed at most.
const ROWS: usize = 24;
/// Characters of the longest bar.
const WIDTH: f64 = 24.0;

/// At one instant.
#[derive(Clone, Copy, Debug)]
struct Sample {
    at: Duration,
    /// Resident memory of the master (MB).
    master: f64,
    /// Descriptors that the master holds.
    files: f64,
    /// Resident memory of all workers (MB).
    workers: f64,
    /// Bytes of the spool's files (MB).
    spool: f64,
}

/// A number of a sample.
type Pick = fn(&Sample) -> f64;

/// Samples in the order of time.
#[derive(Debug, Default)]
pub struct Curves {
    samples: Vec<Sample>,
}

impl Curves {
    /// Looks at the processes and the spool; a process that is dead takes nothing.
    pub(super) fn sample(&mut self, at: Duration, master: u32, workers: &[u32], spool: &Path) {
        let files = fs::read_dir(format!("/proc/{master}/fd")).map_or(0, Iterator::count);
        self.samples.push(Sample {
            at,
            master: resident(master),
            files: files as f64,
            workers: workers.iter().map(|&id| resident(id)).sum(),
            spool: bytes_below(spool) as f64 / 1e6,
        });
    }

    /// As a table with bars: of each stretch of time the most. Below it, the most of the first and of the last quarter.
    pub fn table(&self) -> String {
        let of: [(&str, Pick); 4] = [
            ("master (MB)", |sample| sample.master),
            ("its descriptors", |sample| sample.files),
            ("workers (MB)", |sample| sample.workers),
            ("spool (MB)", |sample| sample.spool),
        ];
        let stretch = self.samples.len().div_ceil(ROWS).max(1);
        let mut text = String::new();
        for (name, pick) in of {
            let most = |samples: &[Sample]| samples.iter().map(pick).fold(0.0, f64::max);
            let top = most(&self.samples).max(f64::MIN_POSITIVE);
            // Writing to a string does not fail.
            let _ = writeln!(text, "{name}");
            for samples in self.samples.chunks(stretch) {
                let value = most(samples);
                let bar = "#".repeat((WIDTH * value / top).round() as usize);
                let minutes = samples[0].at.as_secs_f64() / 60.0;
                let _ = writeln!(text, "  {minutes:6.1} min {value:8.1} {bar}");
            }
            let quarter = self.samples.len().div_ceil(4);
            let (first, last) = (&self.samples[..quarter], &self.samples[self.samples.len() - quarter..]);
            let _ = writeln!(text, "  first quarter at most {:.1}, last {:.1}", most(first), most(last));
        }
        text
    }
}

/// Resident memory of a process (MB).
fn resident(id: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes: Option<f64> = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    kilobytes.unwrap_or_default() * 1024.0 / 1e6
}

fn bytes_below(folder: &Path) -> u64 {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let of = |entry: fs::DirEntry| match entry.metadata() {
        Ok(meta) if meta.is_dir() => bytes_below(&entry.path()),
        // What fills the disk is none of its files.
        Ok(meta) if entry.file_name() != "ballast" => meta.len(),
        _ => 0,
    };
    entries.flatten().map(of).sum()
}
