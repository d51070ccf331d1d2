//! REPORT: `bolide report FOLDER`, the page of the master for results that are there: no master, no worker, and nothing is run.
//!
//! It serves on loopback, with a token, until Ctrl-C. The page's requests are answered as a master's are, by a [`desk`](serve) that
//! knows the folders as jobs.

use std::{
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use clap::Args;
use protocol::request::{Ended, State, Status};
use tokio::sync::{mpsc, watch};

use crate::{
    http::{self, api_state::ApiState, board::Board, guard::Guard},
    interrupt::stop_on_interrupt,
    machine::host_name,
    notice::{Error, Notice, WAITING_NOTICES},
    queue,
    results::{HISTORY, PVD, Summary, Units, vtu::read::index},
    shell::{print, tell},
};

/// Flags of `report`.
#[derive(Args, Clone, Debug)]
pub struct ReportArgs {
    /// Results folders; the page compares several
    #[arg(required = true, value_name = "FOLDER")]
    pub folders: Vec<PathBuf>,
    /// Open it in a browser
    #[arg(long)]
    pub open: bool,
    /// Port on 127.0.0.1 [default: any that is free]
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    pub port: u16,
}

/// How often it looks for Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Serves the page until Ctrl-C.
///
/// # Errors
/// A folder that holds no results, or the system's reason why it cannot serve.
pub fn run(args: &ReportArgs) -> Result<ExitCode, String> {
    for folder in &args.folders {
        if !folder.join(HISTORY).is_file() && !folder.join(PVD).is_file() {
            return Err(format!(
                "{}: no results of a run; name a folder that bolide run or bolide results wrote",
                folder.display()
            ));
        }
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.map_err(|e| e.to_string())?;
    let result = runtime.block_on(async {
        let place =
            http::Place::open(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), args.port), None).await?;
        let address = place.address()?;
        let guard = Guard::passing(address.port(), host_name())?;
        let page = format!("http://{address}/?token={}", guard.token());
        let (notices, heard) = mpsc::channel(WAITING_NOTICES);
        tokio::spawn(serve(args.folders.clone(), heard));
        let api_state = ApiState {
            notices,
            board: Arc::new(Board::default()),
            join: String::new(),
            only_shows: true,
            guard,
        };
        tokio::spawn(http::serve(place, api_state));
        print(&format!("page: {page}"))?;
        print("Ctrl-C ends it")?;
        if args.open
            && let Err(why) = open(&page)
        {
            // It serves all the same.
            tell(&why);
        }
        let stop = stop_on_interrupt("ending");
        while !stop.load(Ordering::Relaxed) {
            tokio::time::sleep(LOOK_EVERY).await;
        }
        Ok(ExitCode::SUCCESS)
    });
    runtime.shutdown_background();
    result
}

/// Opens an address in the user's browser.
fn open(address: &str) -> Result<(), String> {
    let (program, arguments): (&str, &[&str]) = match std::env::consts::OS {
        "windows" => ("cmd", &["/C", "start", ""]),
        "macos" => ("open", &[]),
        _ => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(arguments).arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().map(|_| ()).map_err(|e| format!("{program}: {e}; open the address above yourself"))
}

/// Answers what the page asks of the owner of a queue.
async fn serve(folders: Vec<PathBuf>, mut heard: mpsc::Receiver<Notice>) {
    // Of each job its number from 1; watchers of one hear nothing more.
    let numbered = || (1..).zip(&folders);
    let find = |job: u32| {
        numbered()
            .find(|(number, _)| *number == job)
            .map(|(_, folder)| folder)
            .ok_or(Error::Queue(queue::Error::Unknown(job)))
    };
    // A caller that has gone needs no answer.
    while let Some(notice) = heard.recv().await {
        match notice {
            Notice::Jobs(answer) => {
                let _ = answer.send(numbered().map(|(job, folder)| status(job, folder)).collect());
            }
            Notice::Hosts(answer) => {
                let _ = answer.send(Vec::new());
            }
            Notice::Alive(answer) => {
                let _ = answer.send(());
            }
            Notice::Folder(job, answer) => {
                let _ = answer.send(find(job).cloned());
            }
            Notice::Watch(job, answer) => {
                let job = job.unwrap_or(folders.len() as u32);
                let _ = answer.send(find(job).map(|folder| watch::channel(status(job, folder)).1));
            }
            Notice::Submit { answer, .. } => {
                let _ = answer.send(Err(Error::OnlyShows));
            }
            Notice::Wish(_, _, answer) | Notice::Resume(_, answer) | Notice::Remove(_, answer) => {
                let _ = answer.send(Err(Error::OnlyShows));
            }
            // Workers have no way here.
            _ => {}
        }
    }
}

/// How the run of a folder stands, as its files say.
fn status(job: u32, folder: &Path) -> Status {
    let named = folder
        .file_name()
        .map_or_else(|| folder.display().to_string(), |name| name.to_string_lossy().into_owned());
    let summary = Summary::read(folder).ok();
    let last = index(folder).ok().and_then(|states| states.last().map(|(time, _)| *time));
    let (title, cycle, time) = match &summary {
        Some(summary) => (format!("{} ({named})", summary.title), summary.cycles, summary.end_time),
        None => (named, 0, last.unwrap_or_default()),
    };
    let ended = summary.as_ref().map(|summary: &Summary| Ended {
        failure: None,
        digest: Some(summary.digest.clone()).filter(|digest| !digest.is_empty()),
        summary: serde_json::to_string(summary).ok(),
        table: Some(summary.table(&summary.units, true)),
    });
    // What has no summary is under way, or was ended before it had one.
    let ended = ended.or_else(|| Some(Ended::default()));
    Status {
        job,
        title,
        state: if summary.is_some() { State::Done } else { State::Cancelled },
        waits_for: None,
        cycle,
        time,
        time_unit: summary.as_ref().map_or_else(String::new, |s| Units::named(&s.units).time.to_owned()),
        left_s: None,
        progress: String::new(),
        shares: Vec::new(),
        ended,
    }
}
