//! Every subcommand and flag, with help and default.

#![allow(
    rustdoc::broken_intra_doc_links,
    rustdoc::invalid_html_tags,
    reason = "what stands in brackets is part of the help that users read"
)]

use std::{net::SocketAddr, path::PathBuf};

use clap::{Args, Parser, Subcommand, builder::PossibleValuesParser};
use deck::{model::FORMAT_NAMES, refine::MAX_FACTOR};
use protocol::{
    options::{self, ADVANCED, Balance, JobOptions, Route, SortBy},
    shape::Rate,
};
use worker::{owner::hours::Hours, processors::Processors};

mod help;

use help::{EXIT_CODES, PICTURE_EXAMPLES, RUN_EXAMPLES, SUBMIT_EXAMPLES};

use crate::{
    as_service::ServiceArgs,
    bench::grind::Speed,
    certs::arguments::Certs,
    client::arguments::{ClientArgs, SubmitArgs},
    export::ExportArgs,
    notify::NotifyArgs,
    picture::arguments::PictureArgs,
    report::ReportArgs,
    study::arguments::StudyArgs,
    verify::arguments::VerifyArgs,
};
pub use crate::{client::Until, reading::ReadingArgs};

/// Simulates impacts: bodies that strike, crush, penetrate or explode
#[derive(Debug, Parser)]
#[command(name = "bolide", version, max_term_width = 100, after_help = EXIT_CODES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a deck here: master and workers in one process
    #[command(after_help = RUN_EXAMPLES)]
    Run(RunArgs),
    /// Run a deck with many values: tables, ballistic limits, thresholds
    Study(StudyArgs),
    /// Predict how long a deck takes on an emulated cluster
    Simulate(SimulateArgs),
    /// Listen for workers and clients, and run the jobs of the queue
    Master(MasterArgs),
    /// Compute for a master
    Worker(WorkerArgs),
    /// Start workers over ssh, on the hosts of a file
    Add(AddArgs),
    /// Put a deck into a master's queue
    #[command(after_help = SUBMIT_EXAMPLES)]
    Submit(SubmitArgs),
    /// Follow a job until it ends, then print its summary
    Watch {
        /// The job [default: the newest that is not over, else the newest]
        job: Option<u32>,
        /// Follow it only until it runs, or until it is done: then any other end is a failure, and so is a job that is held
        #[arg(long, value_enum, value_name = "STATE")]
        until: Option<Until>,
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// List the jobs of a master
    Jobs {
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// List the hosts of a master
    Hosts {
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Remove a job from the queue, or end it with the results so far
    Cancel {
        /// The job
        job: u32,
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Keep a job back until it is resumed; one that runs is stored first
    Hold {
        /// The job
        job: u32,
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Put a failed or held job back, at its last checkpoint
    Resume {
        /// The job
        job: u32,
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Remove a job that is over, with its results and checkpoints
    Rm {
        /// The job
        job: u32,
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Fetch the results of a job
    Results {
        /// The job
        job: u32,
        /// Folder for them [default: results/job-<JOB>]
        #[arg(long)]
        out: Option<PathBuf>,
        /// Replace the results in an existing folder
        #[arg(long)]
        force: bool,
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Measure the speed of this machine, and of its messages
    #[command(args_conflicts_with_subcommands = true)]
    Bench {
        /// What to measure instead
        #[command(subcommand)]
        what: Option<Bench>,
        /// Grind times
        #[command(flatten)]
        grind: GrindArgs,
    },
    /// Make certificates: a CA, and one folder for each host
    Certs {
        /// What to make
        #[command(subcommand)]
        what: Certs,
    },
    /// Have Windows start a master or a worker
    Service {
        /// What to do
        #[command(subcommand)]
        what: ServiceArgs,
    },
    /// Write a commented deck of a usual problem, or list them
    Init {
        /// Which
        name: Option<String>,
        /// The file to write, - for standard output; a file that is there stays [default: <NAME>.toml]
        file: Option<PathBuf>,
    },
    /// Print a JSON Schema of decks, by which editors complete them
    Schema,
    /// Find errors and doubtful physics of a deck, and what a run takes
    Check {
        /// The deck
        deck: PathBuf,
        /// Print JSON on standard output, faults too
        #[arg(long)]
        json: bool,
        /// What the deck leaves open
        #[command(flatten)]
        reading: ReadingArgs,
    },
    /// Compute a results folder again and name the first difference
    Verify(VerifyArgs),
    /// Show results in a browser: bodies, curves, verdict, files
    Report(ReportArgs),
    /// Draw a state, a deck before it runs, or an animation
    #[command(after_help = PICTURE_EXAMPLES)]
    Picture(PictureArgs),
    /// Write the states in another format: one VTKHDF file, or d3plot
    Export(ExportArgs),
    /// Make a TOML deck of an LS-DYNA keyword deck, or for a mesh
    Convert {
        /// The keyword deck, or a mesh: Gmsh (.msh), Abaqus (.inp), Nastran (.bdf, .nas, .dat, .fem)
        deck: PathBuf,
        /// The TOML deck to write; the mesh of a keyword deck goes beside it, ending in .mesh [default: <DECK>.toml]
        to: Option<PathBuf>,
        /// Replace files that are there
        #[arg(long)]
        force: bool,
        /// What the deck leaves open
        #[command(flatten)]
        reading: ReadingArgs,
    },
    /// List the materials, or print one: constants, units, source
    Materials(MaterialsArgs),
    /// Show hosts and jobs of a master, updated once a second
    Top {
        /// The master
        #[command(flatten)]
        at: ClientArgs,
    },
    /// Print shell completions
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write a page for each command
    Man {
        /// Folder for all of them
        #[arg(long, value_name = "FOLDER")]
        out: Option<PathBuf>,
    },
}

/// Flags of `materials`.
#[derive(Args, Clone, Debug)]
pub struct MaterialsArgs {
    /// The material; without it all are listed
    pub name: Option<String>,
    /// Units of the values
    #[arg(long, default_value = "SI", value_parser = ["SI", "cm-g-us", "mm-ms-kg", "mm-s-t"])]
    pub units: String,
    /// Print JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// Flags of `run`.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// The deck (TOML, or LS-DYNA keywords)
    pub deck: PathBuf,
    /// What the deck leaves open
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Number of workers [default: one for each of --speeds, else 1]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub workers: Option<u32>,
    /// Relative speeds of the workers, separated by commas; missing ones are 1
    #[arg(long, value_delimiter = ',')]
    pub speeds: Vec<f64>,
    /// Compute threads per worker [default: the cores that it may use, with --processes an equal share of them]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// A process for each worker, over loopback TCP
    #[arg(long, help_heading = ADVANCED)]
    pub processes: bool,
    /// Use only these processors, as in 0,2-3
    #[arg(long, value_name = "LIST", help_heading = ADVANCED)]
    pub pin: Option<Processors>,
    /// Resume from a checkpoint: this file, or the newest valid one of this results folder, which the run continues to write
    #[arg(long, value_name = "FILE|FOLDER")]
    pub resume: Option<PathBuf>,
    /// Results folder [default: the one resumed from, else results/<deck name>]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Formats of the states beside VTU, separated by commas, as `formats` of [output] has them
    #[arg(long, value_delimiter = ',', value_parser = PossibleValuesParser::new(FORMAT_NAMES), conflicts_with = "no_output")]
    pub format: Vec<String>,
    /// Replace the results in an existing folder
    #[arg(long)]
    pub force: bool,
    /// Write a trace of the last cycles of every worker for Perfetto
    #[arg(long, value_name = "FILE", help_heading = ADVANCED)]
    pub trace: Option<PathBuf>,
    /// Whom to tell when it is over
    #[command(flatten)]
    pub notify: NotifyArgs,
    /// Print the summary alone, as JSON, on standard output
    #[arg(long)]
    pub json: bool,
    /// Run the deck as it is, then again with so many times as many cells along every direction of its blocks, and compare what both
    /// come to
    #[arg(long, value_name = "FACTOR", value_parser = clap::value_parser!(u32).range(2..=i64::from(MAX_FACTOR)), conflicts_with_all = ["resume", "no_output", "json", "trace"])]
    pub refine: Option<u32>,
    /// With --refine: compare this too, as `of` of a study has it: "last(rear:uz)", "residual velocity of rod"; may be repeated
    #[arg(long, value_name = "FORMULA", requires = "refine")]
    pub measure: Vec<String>,
    /// Tell in the summary how it was computed, too
    #[arg(long, short)]
    pub verbose: bool,
    /// The rest
    #[command(flatten)]
    pub job: JobOptions,
}

/// Flags of `simulate`.
#[expect(
    unused_qualifications,
    reason = "by the whole path clap takes an option for the type of the value, as `auto` needs"
)]
#[derive(Args, Clone, Debug)]
pub struct SimulateArgs {
    /// The deck (TOML)
    #[arg(
        required_unless_present_any = ["table", "decomposition", "queue"],
        conflicts_with_all = ["table", "decomposition", "queue"]
    )]
    pub deck: Option<PathBuf>,
    /// The cluster file (TOML)
    #[arg(long)]
    pub cluster: PathBuf,
    /// Print the cluster file's tables instead of one run
    #[arg(long)]
    pub table: bool,
    /// Measure what work costs on this machine by the deck, beside the cluster file's constants
    #[arg(long, conflicts_with_all = ["table", "decomposition"])]
    pub measure_costs: bool,
    /// Lane width to measure with: the machines of the paper had none; the widest by default
    #[arg(long, value_parser = options::lanes(), requires = "measure_costs")]
    pub lanes: Option<String>,
    /// How often to measure; medians count
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repetitions: u32,
    /// Print how near hosts of random speeds come to their bound, contact included, instead of one run
    #[arg(long, conflicts_with = "table")]
    pub decomposition: bool,
    /// Print what the queue makes of mixes of many jobs on these hosts, instead of one run
    #[arg(long, conflicts_with_all = ["table", "decomposition", "measure_costs"])]
    pub queue: bool,
    /// How many sets of random speeds, or mixes of jobs
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Use only so many hosts, the first of the file
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "table")]
    pub hosts: Option<u32>,
    /// Stop after this many cycles, or at the deck's end, whichever comes first
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u64).range(4..))]
    pub cycles: u64,
    /// Route of the shared-node forces
    #[arg(long, value_parser = options::routes(), default_value = "direct")]
    pub route: std::option::Option<Route>,
    /// Speeds by which work is distributed, in a run of one deck
    #[arg(long, value_enum, default_value = "given", conflicts_with = "table")]
    pub balance: Balance,
    /// Who sorts the contact surface, in a run of one deck
    #[arg(long, value_enum, default_value = "auto", conflicts_with = "table")]
    pub sort_by: SortBy,
    /// Folder for pictures and the trace; without it none are drawn
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Print JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// Flags of `master`.
#[derive(Args, Clone, Debug)]
pub struct MasterArgs {
    /// Address to listen on; other than loopback only with --certs
    #[arg(long, default_value = "127.0.0.1:7117")]
    pub listen: SocketAddr,
    /// Folder with this host's certificates, as `bolide certs host` makes it
    #[arg(long, value_name = "FOLDER")]
    pub certs: Option<PathBuf>,
    /// Folder of the CA, as `bolide certs ca` makes it: newcomers exchange tokens for certificates, and those that are
    /// revoked count no more
    #[arg(long, value_name = "FOLDER", requires = "certs")]
    pub lab: Option<PathBuf>,
    /// Folder for jobs, their results and checkpoints; a restarted master continues the jobs in it
    #[arg(long, default_value = "results/spool")]
    pub spool: PathBuf,
    /// Serve a page and a JSON API there, 127.0.0.1:7118 for example; other than loopback only with --certs, by HTTPS
    #[arg(long, value_name = "ADDRESS")]
    pub http: Option<SocketAddr>,
    /// Seconds of silence after which a worker is lost; it is suspect after three tenths of that
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = deadline)]
    pub dead_after: f64,
    /// Send and receive no faster than this: 10mbit, 100mbit, 1gbit or bits per second
    #[arg(long, value_name = "RATE")]
    pub link: Option<Rate>,
    /// Remove jobs that are over, with their results, after so many days [default: never]
    #[arg(long, value_name = "DAYS", value_parser = amount)]
    pub keep_days: Option<f64>,
    /// Remove the oldest jobs that are over, with their results, when those of all take more gigabytes [default: never]
    #[arg(long, value_name = "GB", value_parser = amount)]
    pub keep_gb: Option<f64>,
    /// Whom to tell of each job that is over
    #[command(flatten)]
    pub notify: NotifyArgs,
    /// Without certificates serve every user of this PC, not only its own and root
    #[arg(long, conflicts_with = "certs")]
    pub share: bool,
    /// Stay on TCP with workers of this PC too
    #[arg(long)]
    pub no_shared_memory: bool,
}

/// A number of days, gigabytes, seconds or processors.
pub fn amount(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(amount) if (0.0..=1e6).contains(&amount) => Ok(amount),
        _ => Err("expected a number from 0 to 1e6".to_owned()),
    }
}

fn deadline(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (1.0..=3600.0).contains(&seconds) => Ok(seconds),
        _ => Err("expected seconds from 1 to 3600".to_owned()),
    }
}

/// Flags of `worker`.
#[derive(Args, Clone, Debug)]
pub struct WorkerArgs {
    /// The master: HOST, HOST:PORT or [ADDRESS]:PORT
    #[arg(long)]
    pub master: String,
    /// Speed relative to the other workers; auto measures it: 1 is a thread that takes 100 ns for an element-cycle
    #[arg(long, default_value = "1", value_name = "NUMBER|auto")]
    pub speed: Speed,
    /// Use only these processors, as in 0,2-3
    #[arg(long, value_name = "LIST")]
    pub pin: Option<Processors>,
    /// Compute threads, which small jobs share [default: the cores that it may
    /// use]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Memory that its share of a job may take (GB); a job whose share would take more waits for other workers [default: what is available
    /// when it starts]
    #[arg(long, value_name = "GB", value_parser = amount)]
    pub memory: Option<f64>,
    /// Name, unlike that of any other worker: with certificates, that in this host's, or NAME@ANY [default: host name and process
    /// id]
    #[arg(long)]
    pub name: Option<String>,
    /// Name that it shares with the workers to which it has fast links, where not all links are fast: of a floor, a site
    #[arg(long, value_name = "NAME")]
    pub region: Option<String>,
    /// Folder with this host's certificates, as `bolide certs host` makes it
    #[arg(long, value_name = "FOLDER")]
    pub certs: Option<PathBuf>,
    /// Seconds to keep trying to reach a master that does not answer
    #[arg(long, default_value_t = 300)]
    pub patience: u64,
    /// End when the master closes the connection, instead of reconnecting
    #[arg(long)]
    pub once: bool,
    /// Send and receive no faster than this: 10mbit, 100mbit, 1gbit or bits per second
    #[arg(long, value_name = "RATE")]
    pub link: Option<Rate>,
    /// Exchange this token at the master for a certificate, into the folder of --certs, unless it holds one; @FILE or - reads it from a
    /// file or standard input, and BOLIDE_JOIN may hold it: no list of processes shows it then
    #[arg(long, value_name = "TOKEN", requires = "certs")]
    pub join: Option<String>,
    /// Port for other workers, on the interface that leads to the master [default: any]
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    pub peer_port: u16,
    /// Port to which other workers connect, if it is forwarded to --peer-port
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1..))]
    pub peer_announce: Option<u16>,
    /// Make no connections to other workers: everything passes through the master
    #[arg(long, conflicts_with_all = ["peer_port", "peer_announce"])]
    pub no_peers: bool,
    /// Stay on TCP with processes of this PC too
    #[arg(long)]
    pub no_shared_memory: bool,
    /// Its owner comes first: while somebody types or logs in, other programs take processors, or the PC is hot or on battery, work
    /// only this part of the time; 0 leaves the job to others [default: 0 if the flag is given]
    #[arg(long, value_name = "SHARE", num_args = 0..=1, require_equals = true, default_missing_value = "0", value_parser = share)]
    pub yield_to_owner: Option<f64>,
    /// Its owner counts as at work when other programs, but for those of raised nice value, keep more processors busy
    #[arg(long, value_name = "PROCESSORS", default_value_t = 0.5, value_parser = amount, requires = "yield_to_owner")]
    pub owner_load: f64,
    /// Come back when the owner has not needed the PC for so many seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 300.0, value_parser = amount, requires = "yield_to_owner")]
    pub owner_quiet: f64,
    /// Work only then, at the time of day where this host stands: "Mon-Fri 18:00-08:00, Sat-Sun"
    #[arg(long, value_name = "HOURS")]
    pub hours: Option<Hours>,
}

/// A part of the time.
fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..1.0).contains(&share) => Ok(share),
        _ => Err("expected a number from 0 to below 1".to_owned()),
    }
}

/// Flags of `add`.
#[derive(Args, Clone, Debug)]
pub struct AddArgs {
    /// Those to start, deferred ones too [default: all that are not deferred]
    pub names: Vec<String>,
    /// The host file (TOML)
    #[arg(long, value_name = "FILE", default_value = "hosts.toml")]
    pub hosts: PathBuf,
    /// The master as the hosts reach it, HOST:PORT [default: the host file's]
    #[arg(long)]
    pub master: Option<String>,
    /// Print the commands and do nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Print JSON
    #[arg(long, conflicts_with = "dry_run")]
    pub json: bool,
}

/// Flags of `bench` alone.
#[derive(Args, Clone, Debug)]
pub struct GrindArgs {
    /// Rounds, of which the median and the least are printed
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub rounds: u32,
    /// Elements along each side of the cube of two plates
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(6..=120))]
    pub side: u32,
    /// Lane width; the widest by default
    #[arg(long, value_parser = options::lanes())]
    pub lanes: Option<String>,
    /// Use only these processors, as in 0,2-3
    #[arg(long, value_name = "LIST")]
    pub pin: Option<Processors>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// What `bench` measures.
#[derive(Debug, Subcommand)]
pub enum Bench {
    /// Messages: half a round trip between two processes, on this machine unless --to names another
    Messages(MessagesArgs),
}

/// Flags of `bench messages`.
#[derive(Args, Clone, Debug)]
pub struct MessagesArgs {
    /// Be the far end at this address for one caller; other than loopback only with --certs
    #[arg(long, value_name = "ADDRESS", conflicts_with = "to")]
    pub listen: Option<SocketAddr>,
    /// The far end, HOST:PORT, where `bolide bench messages --listen` runs; otherwise one is started here
    #[arg(long, value_name = "HOST:PORT")]
    pub to: Option<String>,
    /// Folder with this host's certificates, as `bolide certs host` makes it; the far end's must be a master's.
    /// Without --to memory, TCP and TLS are measured, with certificates made for it
    #[arg(long, value_name = "FOLDER")]
    pub certs: Option<PathBuf>,
    /// Bytes of the messages
    #[arg(long, value_delimiter = ',', default_value = "8,64,512,4096,16384,65536,262144,1048576,4194304")]
    #[arg(value_parser = crate::bench::messages::message_size)]
    pub sizes: Vec<usize>,
    /// Rounds per size, of which the median is printed
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
    /// Stay on TCP between processes of this PC too
    #[arg(long)]
    pub no_shared_memory: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}
