//! The master as a process: a listener whose connections, and a page whose requests, talk to the
//! [scheduler](crate::scheduler).

use std::{net::SocketAddr, process::ExitCode, sync::Arc, time::Duration};

use protocol::{
    handshake::Role,
    shape::{Shape, Wire},
    tls,
    token::Token,
};
use tokio::{net::TcpListener, sync::mpsc};
use worker::{ending, notify};

use crate::{
    ca_folder::CaFolder,
    certs::fit,
    command::MasterArgs,
    connection::{Acceptor, listen},
    http::{self, board::Board},
    interrupt::stop_on_interrupt,
    machine::host_name,
    notice::{Notice, WAITING_NOTICES},
    notify::Notifier,
    scheduler::{Scheduler, retention::Limits},
    scrub,
    shell::print,
    spool::Spool,
};

/// How long the token that a master prints at its start is good.
const FIRST_TOKEN_HOURS: u64 = 24;
/// `bolide master`: listens until Ctrl-C or SIGTERM.
///
/// # Errors
/// If it cannot listen there, or the certificates cannot be used.
pub fn run(args: &MasterArgs) -> Result<ExitCode, String> {
    let ca_folder =
        args.lab.as_ref().map(|folder| CaFolder::open(folder)).transpose().map_err(|e| e.to_string())?;
    let tls = args.certs.as_ref().map(|folder| tls::Paths::in_folder(folder));
    let config = if ca_folder.is_some() { tls::open_server_config } else { tls::server_config };
    let tls = tls.map(|paths| config(&paths)).transpose().map_err(|e| e.to_string())?;
    if let Some(folder) = &args.certs {
        fit::check(folder, args.lab.as_deref())?;
    }
    if tls.is_none() {
        tls::loopback_only(args.listen).map_err(|e| e.to_string())?;
    }
    let port = args.link.map(|rate| Shape::port(Wire::ethernet(rate)));
    // Decks, results and the queue are the owner's alone.
    system::private::from_now_on(&args.spool)
        .map_err(|e| format!("spool folder {}: {e}", args.spool.display()))?;
    let (spool, left) = Spool::open(&args.spool)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .thread_name("link")
        .build()
        .map_err(|e| format!("threads of links: {e}"))?;
    let notifier = Notifier::start(&args.notify)?;
    let dead_after = Duration::from_secs_f64(args.dead_after);
    let result = runtime.block_on(async {
        let listener = TcpListener::bind(args.listen).await.map_err(|e| format!("{}: {e}", args.listen))?;
        let address = listener.local_addr().map_err(|e| e.to_string())?;
        // Nothing is announced before both are listened at.
        let place = match args.http {
            Some(address) => Some(http::Place::open(address, args.certs.as_deref()).await?),
            None => None,
        };
        let join = announce(address, tls.is_some(), ca_folder.as_ref())?;
        let ca_folder =
            ca_folder.map(|ca_folder| ca_folder.follow().map(|revoked| (ca_folder, revoked))).transpose();
        let ca_folder = ca_folder.map_err(|e| e.to_string())?;
        if let Some(folder) = &args.certs {
            ending::watch(tls::Paths::in_folder(folder).certificate);
        }
        let (notices, heard) = mpsc::channel(WAITING_NOTICES);
        let acceptor = Arc::new(
            Acceptor::new(notices.clone(), vec![Role::Worker, Role::Client], None, tls)
                .behind(port)
                .of(ca_folder)
                .shared(args.share)
                .sharing_memory(!args.no_shared_memory)
                .patient_for(dead_after),
        );
        tokio::spawn(listen(listener, Arc::clone(&acceptor)));
        let board = place.map(|place| open_page(args, place, join, &notices)).transpose()?;
        let stop = stop_on_interrupt("ending; the job under way is stored for the next master");
        notify::say(&format!("READY=1\nSTATUS=listening on {address}"));
        let limits = Limits {
            age: args.keep_days.map(|days| Duration::from_secs_f64(days * 86_400.0)),
            bytes: args.keep_gb.map(|gigabytes| (gigabytes * 1e9) as u64),
        };
        let over = left.jobs.iter().filter(|(record, _)| record.ended.is_some());
        scrub::begin(over.map(|(record, _)| (record.job, spool.results(record.job))).collect());
        let scheduler =
            Scheduler::new(args.spool.clone(), spool, left, notices, board, notifier).keeping(limits);
        scheduler.run(heard, &stop, &acceptor).await;
        Ok(ExitCode::SUCCESS)
    });
    runtime.shutdown_background();
    result
}

/// Opens the page, and prints its address with its token.
fn open_page(
    args: &MasterArgs,
    place: http::Place,
    join: String,
    notices: &mpsc::Sender<Notice>,
) -> Result<Arc<Board>, String> {
    let (address, secure) = (place.address()?, place.is_secure());
    let loopback = address.ip().is_loopback();
    let guard = http::guard::Guard::new(&args.spool, address.port(), loopback, secure, host_name())?;
    let scheme = if secure { "https" } else { "http" };
    print(&format!("page: {scheme}://{}/?token={}", reachable(address), guard.token()))?;
    let board = Arc::new(Board::default());
    let (notices, board_of_page) = (notices.clone(), Arc::clone(&board));
    let api_state =
        http::api_state::ApiState { notices, board: board_of_page, join, only_shows: false, guard };
    tokio::spawn(http::serve(place, api_state));
    Ok(board)
}

/// Says where it listens and how workers join; gives the line for workers. The page shows it as well, to whoever may submit
/// jobs, so the line with a token is printed here only.
fn announce(address: SocketAddr, certificates: bool, ca_folder: Option<&CaFolder>) -> Result<String, String> {
    let host = reachable(address);
    let certs = if certificates { " --certs FOLDER" } else { "" };
    let join = format!("bolide worker --master {host}{certs}");
    print(&format!("listening on {address}"))?;
    print(&format!("workers join with: {join}"))?;
    if let Some(ca_folder) = ca_folder {
        let token = ca_folder.issue(tls::Role::Worker, FIRST_TOKEN_HOURS).map_err(|e| e.to_string())?;
        print(&format!("a new PC joins with: {}", line_to_paste(&host, &token, tls::Role::Worker)))?;
        print(&format!("more such lines: bolide certs token LAB --master {host}"))?;
    }
    Ok(join)
}

/// What is pasted on a bare PC.
pub fn line_to_paste(master: &str, token: &Token, role: tls::Role) -> String {
    match role {
        tls::Role::Worker => format!("bolide worker --master {master} --certs bolide-certs --join {token}"),
        _ => format!("bolide certs join {master} {token} bolide-certs"),
    }
}

/// Host and port as others write them.
fn reachable(address: SocketAddr) -> String {
    let host = if address.ip().is_unspecified() { host_name() } else { address.ip().to_string() };
    let host = if host.contains(':') { format!("[{host}]") } else { host };
    format!("{host}:{}", address.port())
}
