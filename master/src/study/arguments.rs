//! Flags of `bolide study`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::notify::NotifyArgs;

/// Who computes the runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum On {
    /// Job arrays through sbatch
    Slurm,
    /// The command of --template
    Command,
}

/// Flags of `bolide study`.
#[derive(Args, Clone, Debug)]
pub struct StudyArgs {
    /// The study (TOML); master/STUDY.md has every key
    pub study: PathBuf,
    #[arg(long, help = "Folder for the table and the page [default: results/study/<study name>]")]
    pub out: Option<PathBuf>,
    /// Print the points that are known before the first run, with their identities, and run nothing
    #[arg(long)]
    pub list: bool,
    /// Folder of earlier results, from which runs with the same identity are answered
    #[arg(long, value_name = "FOLDER", default_value = "results/cache")]
    pub cache: PathBuf,
    /// Compute everything anew, and keep no results for other studies
    #[arg(long)]
    pub no_cache: bool,
    /// Remove the results from --cache that were not used for the longest time when all take more gigabytes
    #[arg(long, value_name = "GB", default_value_t = 10.0, value_parser = crate::command::amount)]
    pub keep_gb: f64,
    /// Runs at once on this PC [default: one more than its cores]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub runs: Option<u32>,
    /// Compute threads of each run on this PC [default: its cores, shared by the runs that there are]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Whom to tell when it is over
    #[command(flatten)]
    pub notify: NotifyArgs,
    #[arg(long, conflicts_with_all = ["runs", "threads"], help = "Put the runs into the queue of this master instead: HOST, HOST:PORT or [ADDRESS]:PORT")]
    pub master: Option<String>,
    /// Folder with this host's certificates, as `bolide certs host` makes it
    #[arg(long, value_name = "FOLDER", requires = "master")]
    pub certs: Option<PathBuf>,
    /// Jobs in the master's queue, tasks in Slurm's, or launchers at once [default: 16; with slurm 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub queue: Option<u32>,
    /// Have the runs computed by job arrays of Slurm, or by a launcher; --out must be in a folder that all machines see
    #[arg(long, value_enum, conflicts_with_all = ["master", "runs"])]
    pub on: Option<On>,
    /// The launcher of a run: a command that ends when the run does, with {run} where the run's own command belongs, such as
    /// 'ssh pc7 {run}'
    #[arg(long, value_name = "TEMPLATE", required_if_eq("on", "command"))]
    pub template: Option<String>,
    /// Print the goal's results as JSON
    #[arg(long)]
    pub json: bool,
}

impl StudyArgs {
    /// The folder for the table and the page.
    pub fn folder(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| {
            let name = self.study.file_stem().unwrap_or(std::ffi::OsStr::new("study"));
            Path::new("results").join("study").join(name)
        })
    }
}
