//! CLIENT: `submit`, `watch`, `jobs`, `hosts`, `cancel`, `hold`, `resume` and `results`, the other end of the [`client_requests`](crate::client_requests).

use std::{
    io::{IsTerminal, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use clap::ValueEnum;
use protocol::{
    Error,
    codec::{self, MESSAGE_LIMIT},
    dial::{self, Call},
    frame::Kind,
    handshake::{Hello, Role},
    link::Receiver,
    options::JobOptions,
    order::{BULK_ON_THE_WAY, Inbox, Outbox, Place},
    request::{DECK_LIMIT, HostRow, Reply, Request, State, Status, check_file_name},
    wire::Packed,
};

use arguments::{ClientArgs, MASTER, SubmitArgs};

use crate::{
    deck_file::{self, doubt, gather_deck, warn},
    machine::host_name,
    progress::span,
    results::{Folder, SUMMARY, Summary, Units, create_anew, summary::significant, temporary_of},
    shell::{obeys, print, quoted, tell},
};

pub mod arguments;
pub mod screen;
pub mod top;
/// How long a master that has gone is dialled again while one of its jobs is followed.
const RETURN_LIMIT: Duration = Duration::from_secs(60);
/// How often.
const DIAL_EVERY: Duration = Duration::from_millis(500);

/// How far a job is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Until {
    /// Until it runs, or is over
    Running,
    /// Until it is done; ends with 1 if it ends otherwise or is held
    Done,
}

impl Until {
    /// Whether a job in this state is followed no further.
    const fn is_met_by(self, state: State) -> bool {
        match self {
            Self::Running => matches!(state, State::Running),
            Self::Done => matches!(state, State::Held),
        }
    }
}

/// A connection to a master.
pub struct Client {
    runtime: tokio::runtime::Runtime,
    outbox: Outbox,
    inbox: Inbox,
    receiver: Receiver,
    /// The connection has ended.
    pub gone: bool,
    /// The job that is followed.
    following: Option<u32>,
}

impl Client {
    /// Connects.
    ///
    /// # Errors
    /// If there is no master, or it does not take this client.
    pub fn new(at: &ClientArgs) -> Result<Self, String> {
        let certificates = dial::certificates(at.certs.as_deref()).map_err(|e| e.to_string())?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(|e| format!("threads of the link: {e}"))?;
        let hello = Hello::new(Role::Client, host_name(), 1.0, 1, "none", worker::random());
        let call = runtime.block_on(dial::dial(&at.master, certificates.as_ref(), &hello));
        let Call { sender, receiver, welcome, .. } = call.map_err(|e| match e {
            Error::Silent { .. } => format!("the master at {} {}", at.master, silence(&e)),
            e => e.to_string(),
        })?;
        Ok(Self {
            runtime,
            outbox: Outbox::new(sender, welcome.incarnation),
            inbox: Inbox::new(0, BULK_ON_THE_WAY),
            receiver,
            gone: false,
            following: None,
        })
    }

    /// Asks for something and waits for the answer; a refusal is an error.
    ///
    /// # Errors
    /// The refusal, or the end of the connection.
    pub fn ask(&mut self, request: &Request) -> Result<Reply, String> {
        let bytes = codec::encode(request).map_err(|e| e.to_string())?;
        let packed = Packed { kind: Kind::Control, cycle: 0, bytes };
        // Outside of the runtime: the link's own task writes.
        self.outbox.send(Place::default(), packed).map_err(|e| e.to_string())?;
        self.hear()
    }

    fn hear(&mut self) -> Result<Reply, String> {
        let Self { runtime, inbox, receiver, .. } = self;
        let letter = runtime.block_on(async {
            loop {
                if let Some(letter) = inbox.take() {
                    return Ok(letter);
                }
                inbox.accept(receiver.receive().await?)?;
            }
        });
        let letter = letter.map_err(|e: Error| {
            self.gone = true;
            match e {
                Error::Silent { .. } => format!("the master {}", silence(&e)),
                e => format!("the master: {e}"),
            }
        })?;
        match codec::decode(&letter.bytes, MESSAGE_LIMIT).map_err(|e| e.to_string())? {
            Reply::No(why) => Err(why),
            reply => Ok(reply),
        }
    }

    /// Puts a deck into the queue.
    ///
    /// # Errors
    /// Faults of the deck, or whatever went wrong on the way.
    pub fn submit(&mut self, name: String, text: String, options: JobOptions) -> Result<u32, String> {
        if text.len() > DECK_LIMIT {
            return Err(format!("{name}: {} bytes, at most {DECK_LIMIT} can be sent", text.len()));
        }
        match self.ask(&Request::Submit { name, text, options: Box::new(options) })? {
            Reply::Submitted { job } => Ok(job),
            Reply::Faults(lines) => Err(deck_file::Error::Faults(lines).into()),
            _ => Err(surprise()),
        }
    }

    /// Every job that the master knows, oldest first.
    ///
    /// # Errors
    /// Whatever went wrong on the way.
    pub fn jobs(&mut self) -> Result<Vec<Status>, String> {
        let Reply::Jobs(jobs) = self.ask(&Request::Jobs)? else { return Err(surprise()) };
        Ok(jobs)
    }

    /// Fetches a file of a job's results to a path; gives its length (bytes).
    ///
    /// # Errors
    /// If there is none, it cannot be written, or whatever went wrong on the way.
    pub fn fetch(&mut self, job: u32, name: &str, path: &Path) -> Result<u64, String> {
        let fault = |e: std::io::Error| format!("{}: {e}", path.display());
        let mut file = create_anew(path).map_err(fault)?;
        let mut offset = 0;
        loop {
            let request = Request::File { job, name: name.to_owned(), offset };
            let Reply::Piece(bytes) = self.ask(&request)? else { return Err(surprise()) };
            if bytes.is_empty() {
                return Ok(offset);
            }
            file.write_all(&bytes).map_err(fault)?;
            offset += bytes.len() as u64;
        }
    }

    /// Follows a job to its end; reports go to standard error.
    fn follow(&mut self, job: Option<u32>, until: Option<Until>, quiet: bool) -> Result<Status, String> {
        let mut reply = self.ask(&Request::Watch { job })?;
        let mut line = Line::new();
        loop {
            let Reply::Status(status) = reply else { return Err(surprise()) };
            self.following = Some(status.job);
            if !quiet {
                line.show(&line_of(&status), status.state);
            }
            if status.ended.is_some() || until.is_some_and(|until| until.is_met_by(status.state)) {
                return Ok(*status);
            }
            reply = self.hear()?;
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.runtime.block_on(dial::leave(self.outbox.sender(), "done"));
    }
}

/// Of a master that takes connections and says nothing.
fn silence(error: &Error) -> String {
    format!("does not answer ({error}): it is stopped or overloaded; look at its log, or start it again")
}

fn surprise() -> String {
    "the master answered something else; install the same release on both".to_owned()
}

/// How a followed job stands, on standard error: one line that stays in a terminal, and elsewhere one now and then.
struct Line {
    stays: bool,
    last: String,
    state: Option<State>,
    at: Instant,
}

/// Between two lines where none stays.
const LINE_EVERY: Duration = Duration::from_secs(10);

impl Line {
    fn new() -> Self {
        Self {
            stays: std::io::stderr().is_terminal() && obeys(),
            last: String::new(),
            state: None,
            at: Instant::now(),
        }
    }

    fn show(&mut self, line: &str, state: State) {
        // What comes from others may hold letters that a terminal obeys.
        let line = line.replace(char::is_control, " ");
        if line == self.last {
            return;
        }
        if self.stays {
            // Without wrapping, so that a narrow terminal has one line too.
            let _ = write!(std::io::stderr(), "\r\x1b[?7l{line}\x1b[K\x1b[?7h");
        } else if self.is_due(state, Instant::now()) {
            tell(&line);
            self.at = Instant::now();
        }
        self.state = Some(state);
        self.last = line;
    }

    /// Whether a line is told where none stays: of each state the first, and later ones at times.
    fn is_due(&self, state: State, now: Instant) -> bool {
        self.state != Some(state) || now.duration_since(self.at) >= LINE_EVERY
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        if self.stays && !self.last.is_empty() {
            tell("");
        }
    }
}

/// One line on how a job stands.
fn line_of(status: &Status) -> String {
    let Status { job, state, waits_for, progress, .. } = status;
    match (state, waits_for) {
        (State::Queued, Some(what)) => format!("job {job} queued, waits for {what}"),
        (State::Running, Some(what)) => format!("job {job} running, waits for {what}"),
        (State::Held, Some(what)) => format!("job {job} held, waits for {what}"),
        (State::Running, None) => format!("job {job} running  {progress}"),
        _ => format!("job {job} {}", state.name()),
    }
}

/// `bolide submit`.
///
/// # Errors
/// Faults of the deck, or whatever went wrong on the way.
pub fn submit(args: &SubmitArgs) -> Result<ExitCode, String> {
    args.notify.check()?;
    let name = args.deck.display().to_string();
    let text = gather_deck(&args.deck, &args.reading.options())?;
    // The master answers with faults; what a run does otherwise than the deck says is told here.
    if let Ok(reading) = deck::read_whole(&text, &name) {
        warn(&reading.warnings);
        doubt(&reading.model);
    }
    let options = JobOptions {
        min_workers: args.min_workers.unwrap_or(args.workers[0]),
        max_workers: args.workers[1],
        min_speed: args.min_speed,
        min_memory: args.min_memory,
        priority: args.priority,
        trace: args.trace,
        ..args.job.clone()
    };
    let mut client = Client::new(&args.at)?;
    let job = client.submit(name, text, options)?;
    if args.wait {
        if !args.at.json {
            tell(&format!("job {job} submitted"));
        }
        let result = finish(client, &args.at, Some(job), None);
        args.notify.tell_of(&job.to_string(), None, &result);
        return result;
    }
    if args.at.json {
        print(&format!("{{\"job\":{job}}}"))?;
    } else {
        print(&format!("job {job} submitted"))?;
        tell(&next(job, &args.at).to_string());
    }
    Ok(ExitCode::SUCCESS)
}

/// The commands that follow a submission, for the master that it went to.
fn next(job: u32, at: &ClientArgs) -> String {
    let master =
        if at.master == MASTER { String::new() } else { format!(" --master {}", quoted(&at.master)) };
    let certs = at.certs.as_ref().map(|folder| format!(" --certs {}", quoted(&folder.display().to_string())));
    let flags = master + &certs.unwrap_or_default();
    let commands = [
        (format!("bolide watch {job}{flags}"), "follows it until it ends"),
        (format!("bolide results {job}{flags}"), "then fetches its results"),
    ];
    let width = commands.iter().map(|(command, _)| command.len()).max().unwrap_or(0);
    let lines = commands.map(|(command, what)| format!("  {command:width$}   # {what}"));
    format!("next:\n{}", lines.join("\n"))
}

/// `bolide watch`: ends as `run` would.
///
/// # Errors
/// The job's failure, or whatever went wrong on the way.
pub fn watch(job: Option<u32>, until: Option<Until>, at: &ClientArgs) -> Result<ExitCode, String> {
    finish(Client::new(at)?, at, job, until)
}

/// Follows a job to its end, over a restart of its master as well.
fn finish(
    mut client: Client,
    at: &ClientArgs,
    mut job: Option<u32>,
    until: Option<Until>,
) -> Result<ExitCode, String> {
    let json = at.json;
    let status = loop {
        match client.follow(job, until, json) {
            Ok(status) => break status,
            Err(why) if client.gone && client.following.is_some() => {
                job = client.following;
                tell(&format!("{why}; dialling again for {} s", RETURN_LIMIT.as_secs()));
                client = dial_again(at, &why)?;
                client.following = job;
            }
            Err(why) => return Err(why),
        }
    };
    let ended = status.ended.unwrap_or_default();
    if let Some(text) = if json { ended.summary } else { ended.table } {
        print(&text)?;
    }
    match (ended.failure, status.state) {
        (Some(why), _) => Err(format!("job {}: {why}", status.job)),
        (None, State::Cancelled | State::Held) if until == Some(Until::Done) => {
            Err(format!("job {} is {}", status.job, status.state.name()))
        }
        (None, State::Cancelled) => Ok(ExitCode::from(130)),
        (None, _) => Ok(ExitCode::SUCCESS),
    }
}

/// A connection to the master that is started again.
fn dial_again(at: &ClientArgs, why: &str) -> Result<Client, String> {
    let since = Instant::now();
    loop {
        std::thread::sleep(DIAL_EVERY);
        match Client::new(at) {
            Ok(client) => return Ok(client),
            Err(_) if since.elapsed() < RETURN_LIMIT => {}
            Err(last) => return Err(format!("{why}; then {last}")),
        }
    }
}

/// A status as programs read it: the summary of a job that is over as JSON, not as text within.
pub fn as_json(status: &Status) -> serde_json::Value {
    let mut value = serde_json::json!(status);
    if let Some(summary) = value.pointer_mut("/ended/summary")
        && let Some(read) = summary.as_str().and_then(|text| serde_json::from_str(text).ok())
    {
        *summary = read;
    }
    value
}

/// `bolide jobs`.
///
/// # Errors
/// Whatever went wrong on the way.
pub fn jobs(at: &ClientArgs) -> Result<ExitCode, String> {
    let jobs = Client::new(at)?.jobs()?;
    if at.json {
        print(&serde_json::Value::from_iter(jobs.iter().map(as_json)).to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&table(&jobs))?;
    Ok(ExitCode::SUCCESS)
}

/// Jobs as a table: what each reached, how long it took or has left, and when it was over.
fn table(jobs: &[Status]) -> String {
    let mut table = format!(
        "{:>5}  {:<9} {:>9} {:>14} {:>9}  {:<20}  {:<32}  note\n",
        "job", "state", "cycle", "reached", "took", "over", "title"
    );
    for job in jobs {
        let summary = job.ended.as_ref().and_then(|ended| ended.summary.as_deref());
        let summary: Option<Summary> = summary.and_then(|text| serde_json::from_str(text).ok());
        let unit = match &summary {
            Some(summary) if job.time_unit.is_empty() => Units::named(&summary.units).time,
            _ => &job.time_unit,
        };
        let reached =
            if job.cycle == 0 { "-".to_owned() } else { format!("{} {unit}", significant(job.time)) };
        let took = summary.as_ref().map_or_else(|| "-".to_owned(), |summary| span(summary.wall_s));
        let over = summary.map(|summary| summary.origin.date).filter(|date| !date.is_empty());
        let left =
            job.progress.split_once(", ").filter(|_| job.state == State::Running).map(|(left, _)| left);
        let failure = job.ended.as_ref().and_then(|ended| ended.failure.clone());
        let waits = job.waits_for.as_ref().map(|what| format!("waits for {what}"));
        let note = waits.or(failure).unwrap_or_else(|| {
            let shares = job.shares.iter().map(|s| format!("{} elements on {}", s.elements, s.host));
            shares.collect::<Vec<_>>().join(", ")
        });
        let title: String = job.title.chars().take(32).collect();
        let line = format!(
            "{:>5}  {:<9} {:>9} {reached:>14} {took:>9}  {:<20}  {title:<32}  {note}",
            job.job,
            job.state.name(),
            job.cycle,
            over.as_deref().or(left).unwrap_or("-"),
        );
        table.push_str(line.replace(char::is_control, " ").trim_end());
        table.push('\n');
    }
    table
}

/// `bolide hosts`.
///
/// # Errors
/// Whatever went wrong on the way.
pub fn hosts(at: &ClientArgs) -> Result<ExitCode, String> {
    let Reply::Hosts(hosts) = Client::new(at)?.ask(&Request::Hosts)? else { return Err(surprise()) };
    if at.json {
        print(&serde_json::to_string(&hosts).map_err(|e| e.to_string())?)?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&format!(
        "{:>4}  {:<24} {:>7} {:>7}  {:<7} {:<22} {:<5} note",
        "host", "name", "speed", "threads", "lanes", "address", "state"
    ))?;
    for HostRow { host, name, speed, threads, lanes, address, state, note, .. } in hosts {
        print(&format!(
            "{host:>4}  {name:<24} {speed:>7} {threads:>7}  {lanes:<7} {address:<22} {state:<5} {note}"
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// `bolide cancel`, `hold`, `resume` and `rm`: asks for a change of a job and prints what comes of it.
///
/// # Errors
/// If there is no such job, its state does not allow that, or whatever went wrong on the way.
pub fn act(request: &Request, at: &ClientArgs) -> Result<ExitCode, String> {
    let Reply::Done(what) = Client::new(at)?.ask(request)? else { return Err(surprise()) };
    if at.json {
        print(&serde_json::json!({ "done": what }).to_string())?;
    } else {
        print(&what)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// `bolide results`.
///
/// # Errors
/// If the job has none, the folder holds something already, a file cannot be written, or whatever went wrong on the way.
pub fn results(job: u32, out: Option<PathBuf>, force: bool, at: &ClientArgs) -> Result<ExitCode, String> {
    let folder = out.unwrap_or_else(|| Path::new("results").join(format!("job-{job}")));
    let mut client = Client::new(at)?;
    let Reply::Files(files) = client.ask(&Request::Files { job })? else { return Err(surprise()) };
    let is_new = !folder.exists();
    let taken = Folder::claim(&folder, force).map_err(|e| e.to_string())?;
    let fetched = fetch_all(&mut client, job, &files, &taken);
    let total = fetched.inspect_err(|_| {
        for (name, _) in &files {
            // What does not bear the name of a file was not written.
            let _ = temporary_of(&folder.join(name)).map(std::fs::remove_file);
        }
        if is_new {
            let _ = std::fs::remove_dir(&folder);
        }
    })?;
    drop(taken);
    if !files.iter().any(|(name, _)| name == SUMMARY) {
        tell(&format!(
            "job {job} has no {SUMMARY}: it runs, or did not come to an end; these are its results so far"
        ));
    }
    if at.json {
        let names: Vec<&String> = files.iter().map(|(name, _)| name).collect();
        print(&serde_json::to_string(&names).map_err(|e| e.to_string())?)?;
    } else {
        print(&format!("{} files, {total} bytes in {}", files.len(), folder.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Fetches files under temporary names; they have their own, in place of what stood there, once all are whole. Gives their length (bytes).
fn fetch_all(client: &mut Client, job: u32, files: &[(String, u64)], folder: &Folder) -> Result<u64, String> {
    let mut total = 0;
    let mut whole = Vec::new();
    for (name, _) in files {
        // The master is believed no more than any other peer.
        check_file_name(name)?;
        let path = folder.file(name);
        let temporary = temporary_of(&path).ok_or_else(|| format!("{name:?} names no file"))?;
        total += client.fetch(job, name, &temporary)?;
        whole.push((temporary, path));
    }
    folder
        .clear_but(|path| whole.iter().any(|(temporary, _)| temporary == path))
        .map_err(|e| e.to_string())?;
    for (temporary, path) in whole {
        std::fs::rename(&temporary, &path).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_in_a_status_is_json_and_no_text_of_it() {
        let mut status = Status::queued(3, "plates".to_owned());
        assert_eq!(as_json(&status)["ended"], serde_json::Value::Null);
        let summary = Some(r#"{"cycles":40,"digest":"ab"}"#.to_owned());
        status.ended = Some(protocol::request::Ended { summary, ..Default::default() });
        assert_eq!(as_json(&status)["ended"]["summary"]["cycles"], 40);
        assert_eq!(as_json(&status)["job"], 3);
    }

    #[test]
    fn jobs_have_units_and_times_and_no_letters_that_a_terminal_obeys() {
        let mut running = Status::queued(1, "plates\x1b[2J".to_owned());
        running.state = State::Running;
        (running.cycle, running.time, running.time_unit) = (120, 0.0125, "ms".to_owned());
        running.progress = "12 min left, 34.0 %".to_owned();
        let mut done = Status::queued(2, "bar".to_owned());
        (done.state, done.cycle, done.time) = (State::Done, 40, 2.0);
        let origin =
            crate::results::summary::Origin { date: "2026-11-25 16:40 UTC".to_owned(), ..Default::default() };
        let summary = Summary { units: "cm-g-us".to_owned(), wall_s: 250.0, origin, ..Summary::default() };
        let summary = serde_json::to_string(&summary).ok();
        done.ended = Some(protocol::request::Ended { summary, ..Default::default() });
        let table = table(&[running, done, Status::queued(3, "next".to_owned())]);
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines[1].contains("0.0125000 ms") && lines[1].contains("12 min left"), "{table}");
        assert!(
            lines[2].contains("2.00000 us") && lines[2].contains("4 min  2026-11-25 16:40 UTC"),
            "{table}"
        );
        assert!(lines[3].contains("queued") && !table.contains('\x1b'), "{table}");
    }

    #[test]
    fn a_line_that_does_not_stay_is_told_of_each_state_and_at_times() {
        let mut line = Line { stays: false, last: String::new(), state: None, at: Instant::now() };
        assert!(line.is_due(State::Queued, line.at));
        line.show("job 1 queued", State::Queued);
        assert!(!line.is_due(State::Queued, line.at + LINE_EVERY / 2));
        assert!(line.is_due(State::Running, line.at) && line.is_due(State::Queued, line.at + LINE_EVERY));
    }

    #[test]
    fn what_follows_a_submission_names_the_master_it_went_to() {
        let at = ClientArgs { master: MASTER.to_owned(), certs: None, json: false };
        assert!(next(3, &at).contains("  bolide watch 3     #"), "{}", next(3, &at));
        let at = ClientArgs { master: "lab:9".to_owned(), certs: Some("my certs".into()), json: false };
        let told = next(3, &at);
        assert!(told.contains("bolide results 3 --master lab:9 --certs 'my certs'  "), "{told}");
    }
}
