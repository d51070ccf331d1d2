//! Answers the requests of one client after another.
//!
//! What concerns hosts and queue is asked of the scheduler; decks are read and files opened here, on blocking threads.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
    time::Duration,
};

use protocol::{
    Error, Result, codec,
    frame::{Frame, Kind},
    link::{Receiver, Sender},
    options::JobOptions,
    order::{Inbox, Outbox, Place, WAITING_BYTES_OF_A_CLIENT},
    request::{DECK_LIMIT, PIECE_LIMIT, Reply, Request, check_file_name},
    wire::Packed,
};
use tokio::sync::{mpsc, oneshot};
use tracing::info;

use crate::{
    desk::{self, Brought},
    notice::{self, Notice},
    queue::Wish,
};

/// Bytes of a request around a deck.
const AROUND_A_DECK: usize = 4096;
/// Frames that a client may send before it has its answer.
const EARLY_FRAMES: usize = 8;
/// The shortest time between two reports to a client that watches.
const REPORT_EVERY: Duration = Duration::from_millis(250);

/// Serves a client until its connection ends; gives the reason.
pub async fn serve(
    notices: &mpsc::Sender<Notice>,
    sender: &Sender,
    receiver: &mut Receiver,
    (incarnation, caller): (u32, Caller),
) -> Error {
    let mut client_requests = ClientRequests {
        notices,
        caller,
        outbox: Outbox::new(sender.clone(), 0),
        inbox: Inbox::new(incarnation, (DECK_LIMIT + AROUND_A_DECK) as u64)
            .with_waiting_limit(WAITING_BYTES_OF_A_CLIENT),
        held: Held(0),
    };
    loop {
        if let Err(error) = client_requests.next(receiver).await {
            return error;
        }
    }
}

/// Who asks.
pub struct Caller {
    pub address: String,
    /// The certificate that it showed, in words.
    pub certificate: Option<String>,
}

impl Caller {
    /// Its certificate, else its address.
    fn name(&self) -> &str {
        self.certificate.as_ref().unwrap_or(&self.address)
    }
}

struct ClientRequests<'a> {
    notices: &'a mpsc::Sender<Notice>,
    caller: Caller,
    outbox: Outbox,
    inbox: Inbox,
    held: Held,
}

/// Bytes of requests that are on their way, of all clients together.
static ON_THE_WAY: AtomicUsize = AtomicUsize::new(0);
/// Most of them: four decks of the greatest length.
const ON_THE_WAY_LIMIT: usize = 4 * DECK_LIMIT;

/// What of these bytes is this client's.
struct Held(usize);

impl Held {
    fn add(&mut self, bytes: usize) -> Result<()> {
        self.0 += bytes;
        let all = ON_THE_WAY.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if all > ON_THE_WAY_LIMIT {
            let what = "bytes of requests of all clients that are on their way";
            return Err(Error::TooLong { what, length: all as u64, limit: ON_THE_WAY_LIMIT as u64 });
        }
        Ok(())
    }

    fn clear(&mut self) {
        ON_THE_WAY.fetch_sub(std::mem::take(&mut self.0), Ordering::Relaxed);
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.clear();
    }
}

impl ClientRequests<'_> {
    async fn next(&mut self, receiver: &mut Receiver) -> Result<()> {
        self.take(receiver.receive().await?)?;
        while let Some(letter) = self.inbox.take() {
            if letter.header.kind != Kind::Control {
                return Err(Error::Unexpected { found: letter.header.kind, expected: "a request" });
            }
            let request = codec::decode(&letter.bytes, DECK_LIMIT + AROUND_A_DECK)?;
            drop(letter);
            self.held.clear();
            match request {
                Request::Watch { job } => self.watch(job, receiver).await?,
                request => {
                    let reply = self.answer_while_there(request, receiver).await?;
                    self.reply(&reply)?;
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, frame: Frame) -> Result<()> {
        self.held.add(frame.payload.len())?;
        self.inbox.accept(frame)
    }

    /// An answer that nobody waits for any more is not made.
    async fn answer_while_there(&mut self, request: Request, receiver: &mut Receiver) -> Result<Reply> {
        let mut early = Vec::new();
        let reply = {
            let answer = self.answer(request);
            tokio::pin!(answer);
            loop {
                tokio::select! {
                    reply = &mut answer => break reply.unwrap_or_else(|why| Reply::No(why.to_string())),
                    frame = receiver.receive(), if early.len() < EARLY_FRAMES => early.push(frame?),
                }
            }
        };
        early.into_iter().try_for_each(|frame| self.take(frame))?;
        Ok(reply)
    }

    fn reply(&mut self, reply: &Reply) -> Result<()> {
        let bytes = codec::encode(reply)?;
        self.outbox.send(Place::default(), Packed { kind: Kind::Control, cycle: 0, bytes })
    }

    /// Asks the scheduler.
    async fn ask<T>(
        &self,
        question: impl FnOnce(oneshot::Sender<T>) -> Notice,
    ) -> std::result::Result<T, notice::Error> {
        notice::ask(self.notices, question).await
    }

    async fn answer(&self, request: Request) -> std::result::Result<Reply, Refusal> {
        Ok(match request {
            Request::Submit { name, text, options } => self.submit(name, text, *options).await?,
            Request::Jobs => Reply::Jobs(self.ask(Notice::Jobs).await?),
            Request::Hosts => Reply::Hosts(self.ask(Notice::Hosts).await?),
            Request::Cancel { job } => {
                info!(job, by = self.caller.name(), "asked to cancel");
                Reply::Done(self.ask(|answer| Notice::Wish(job, Wish::Cancel, answer)).await??)
            }
            Request::Hold { job } => {
                info!(job, by = self.caller.name(), "asked to hold");
                Reply::Done(self.ask(|answer| Notice::Wish(job, Wish::Hold, answer)).await??)
            }
            Request::Resume { job } => {
                info!(job, by = self.caller.name(), "asked to resume");
                Reply::Done(self.ask(|answer| Notice::Resume(job, answer)).await??)
            }
            Request::Remove { job } => {
                info!(job, by = self.caller.name(), "asked to remove");
                Reply::Done(self.ask(|answer| Notice::Remove(job, answer)).await??)
            }
            Request::Files { job } => {
                let folder = self.folder(job).await?;
                Reply::Files(blocking(move || list(&folder)).await?)
            }
            Request::File { job, name, offset } => {
                check_file_name(&name).map_err(Refusal::Name)?;
                let folder = self.folder(job).await?;
                Reply::Piece(blocking(move || piece(&folder.join(name), offset)).await?)
            }
            Request::Watch { .. } => return Err(Refusal::Watch),
        })
    }

    async fn folder(&self, job: u32) -> std::result::Result<PathBuf, notice::Error> {
        self.ask(|answer| Notice::Folder(job, answer)).await?
    }

    async fn submit(
        &self,
        name: String,
        text: String,
        options: JobOptions,
    ) -> std::result::Result<Reply, Refusal> {
        options.check().map_err(desk::Error::Options)?;
        let brought = match desk::read(name.clone(), text).await {
            Ok(brought) => brought,
            Err(desk::Error::Faults(faults)) => {
                return Ok(Reply::Faults(faults.iter().map(ToString::to_string).collect()));
            }
            Err(error) => return Err(error.into()),
        };
        let size = brought.size(&options);
        let Brought { text, title, .. } = brought;
        let owner = self.caller.certificate.clone().unwrap_or_default();
        let submit = |answer| Notice::Submit { name, title, text, size, options, owner, answer };
        let job = self.ask(submit).await??;
        info!(job, by = self.caller.name(), "submitted");
        Ok(Reply::Submitted { job })
    }

    /// Reports on a job until it has ended or the client leaves.
    async fn watch(&mut self, job: Option<u32>, receiver: &mut Receiver) -> Result<()> {
        let mut status = match self.ask(|answer| Notice::Watch(job, answer)).await.and_then(|s| s) {
            Ok(status) => status,
            Err(why) => return self.reply(&Reply::No(why.to_string())),
        };
        loop {
            let now = status.borrow_and_update().clone();
            let over = now.ended.is_some();
            self.reply(&Reply::Status(Box::new(now)))?;
            if over {
                return Ok(());
            }
            tokio::select! {
                // A client that watches has nothing to say, but it may leave.
                frame = receiver.receive() => {
                    self.inbox.accept(frame?)?;
                    return Err(Error::Message("a request during a watch".into()));
                }
                changed = async {
                    tokio::time::sleep(REPORT_EVERY).await;
                    status.changed().await
                } => if changed.is_err() {
                    return self.reply(&Reply::No("the master has forgotten the job".into()));
                },
            }
        }
    }
}

/// Why a request is not answered as it asks.
#[derive(Debug)]
pub enum Refusal {
    Scheduler(notice::Error),
    Deck(desk::Error),
    /// The name stands for no file of results.
    Name(String),
    File(PathBuf, std::io::Error),
    /// Of results, something that is a folder or a link.
    NoFile(PathBuf),
    /// A watch is no single answer.
    Watch,
    /// Reading files had a bug.
    Bug,
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scheduler(error) => error.fmt(f),
            Self::Deck(error) => error.fmt(f),
            Self::Name(why) => f.write_str(why),
            Self::File(path, error) => write!(f, "{}: {error}", path.display()),
            Self::NoFile(path) => write!(f, "{} is no file", path.display()),
            Self::Watch => f.write_str("a watch is not answered here"),
            Self::Bug => f.write_str("a bug in the master; its log has the words"),
        }
    }
}

impl From<notice::Error> for Refusal {
    fn from(error: notice::Error) -> Self {
        Self::Scheduler(error)
    }
}

impl From<desk::Error> for Refusal {
    fn from(error: desk::Error) -> Self {
        Self::Deck(error)
    }
}

async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> std::result::Result<T, Refusal> + Send + 'static,
) -> std::result::Result<T, Refusal> {
    tokio::task::spawn_blocking(work).await.unwrap_or(Err(Refusal::Bug))
}

/// The results files of a folder with their lengths, by name.
///
/// # Errors
/// If the folder cannot be read.
pub fn list(folder: &Path) -> std::result::Result<Vec<(String, u64)>, Refusal> {
    let fault = |e: std::io::Error| Refusal::File(folder.to_owned(), e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let entry = entry.map_err(fault)?;
        let meta = entry.metadata().map_err(fault)?;
        if let Ok(name) = entry.file_name().into_string()
            && meta.is_file()
            && check_file_name(&name).is_ok()
        {
            files.push((name, meta.len()));
        }
    }
    files.sort();
    Ok(files)
}

/// At most [`PIECE_LIMIT`] bytes of a file.
fn piece(path: &Path, offset: u64) -> std::result::Result<Vec<u8>, Refusal> {
    let fault = |e: std::io::Error| Refusal::File(path.to_owned(), e);
    if !path.symlink_metadata().map_err(fault)?.is_file() {
        return Err(Refusal::NoFile(path.to_owned()));
    }
    let mut file = File::open(path).map_err(fault)?;
    file.seek(SeekFrom::Start(offset)).map_err(fault)?;
    let mut bytes = Vec::new();
    file.take(u64::from(PIECE_LIMIT)).read_to_end(&mut bytes).map_err(fault)?;
    Ok(bytes)
}
