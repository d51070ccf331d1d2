//! Answers the requests of one client after another.
//!
//! What concerns hosts and queue is asked of the scheduler; decks are read and files opened here, on blocking threads.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    time::Duration,
};

use protocol::{
    Error, Result, codec,
    frame::Kind,
    link::{Receiver, Sender},
    options::JobOptions,
    order::{Inbox, Outbox, Place},
    request::{DECK_LIMIT, PIECE_LIMIT, Reply, Request, check_file_name},
    wire::Packed,
};
use tokio::sync::{mpsc, oneshot};
use tracing::info;

use crate::notice::Notice;

/// Bytes of a request around a deck.
const AROUND_A_DECK: usize = 4096;
/// The shortest time between two reports to a client that watches.
const REPORT_EVERY: Duration = Duration::from_millis(250);

/// Serves a client until its connection ends; gives the reason.
pub async fn serve(
    notices: &mpsc::Sender<Notice>,
    sender: &Sender,
    receiver: &mut Receiver,
    (incarnation, caller): (u32, String),
) -> Error {
    let mut client_requests = ClientRequests {
        notices,
        caller,
        outbox: Outbox::new(sender.clone(), 0),
        inbox: Inbox::new(incarnation, (DECK_LIMIT + AROUND_A_DECK) as u64),
    };
    loop {
        if let Err(error) = client_requests.next(receiver).await {
            return error;
        }
    }
}

struct ClientRequests<'a> {
    notices: &'a mpsc::Sender<Notice>,
    /// Who asks: its certificate, else its address.
    caller: String,
    outbox: Outbox,
    inbox: Inbox,
}

impl ClientRequests<'_> {
    async fn next(&mut self, receiver: &mut Receiver) -> Result<()> {
        self.inbox.accept(receiver.receive().await?)?;
        while let Some(letter) = self.inbox.take() {
            if letter.header.kind != Kind::Control {
                return Err(Error::Unexpected { found: letter.header.kind, expected: "a request" });
            }
            let request = codec::decode(&letter.bytes, DECK_LIMIT + AROUND_A_DECK)?;
            drop(letter);
            match request {
                Request::Watch { job } => self.watch(job, receiver).await?,
                request => {
                    let reply = self.answer(request).await.unwrap_or_else(Reply::No);
                    self.reply(&reply)?;
                }
            }
        }
        Ok(())
    }

    fn reply(&mut self, reply: &Reply) -> Result<()> {
        let bytes = codec::encode(reply)?;
        self.outbox.send(Place::default(), Packed { kind: Kind::Control, cycle: 0, bytes })
    }

    /// Asks the scheduler.
    async fn ask<T>(
        &self,
        event: impl FnOnce(oneshot::Sender<T>) -> Notice,
    ) -> std::result::Result<T, String> {
        let (answer, answered) = oneshot::channel();
        let ending = "the master is ending".to_owned();
        self.notices.send(event(answer)).await.map_err(|_| ending.clone())?;
        answered.await.map_err(|_| ending)
    }

    async fn answer(&self, request: Request) -> std::result::Result<Reply, String> {
        Ok(match request {
            Request::Submit { name, text, options } => self.submit(name, text, options).await?,
            Request::Jobs => Reply::Jobs(self.ask(Notice::Jobs).await?),
            Request::Hosts => Reply::Hosts(self.ask(Notice::Hosts).await?),
            Request::Cancel { job } => {
                info!(job, by = self.caller, "asked to cancel");
                Reply::Done(self.ask(|answer| Notice::Cancel(job, answer)).await??)
            }
            Request::Resume { job } => {
                info!(job, by = self.caller, "asked to resume");
                Reply::Done(self.ask(|answer| Notice::Resume(job, answer)).await??)
            }
            Request::Files { job } => {
                let folder = self.folder(job).await?;
                Reply::Files(blocking(move || list(&folder)).await?)
            }
            Request::File { job, name, offset } => {
                check_file_name(&name)?;
                let folder = self.folder(job).await?;
                Reply::Piece(blocking(move || piece(&folder.join(name), offset)).await?)
            }
            Request::Watch { .. } => return Err("a watch is not answered here".to_owned()),
        })
    }

    async fn folder(&self, job: u32) -> std::result::Result<PathBuf, String> {
        self.ask(|answer| Notice::Folder(job, answer)).await?
    }

    async fn submit(
        &self,
        name: String,
        text: String,
        options: JobOptions,
    ) -> std::result::Result<Reply, String> {
        if options.end_time.is_some_and(|time| !(time.is_finite() && time > 0.0)) {
            return Err("the end time must be a positive number".to_owned());
        }
        let (deck, file) = (text, name.clone());
        let read = blocking(move || {
            Ok(match deck::read(&deck, &file) {
                Ok(model) => Ok((deck, model.title)),
                Err(faults) => Err(faults.iter().map(ToString::to_string).collect()),
            })
        });
        match read.await? {
            Err(faults) => Ok(Reply::Faults(faults)),
            Ok((text, title)) => {
                let submit = |answer| Notice::Submit { name, title, text, options, answer };
                let job = self.ask(submit).await??;
                info!(job, by = self.caller, "submitted");
                Ok(Reply::Submitted { job })
            }
        }
    }

    /// Reports on a job until it has ended or the client leaves.
    async fn watch(&mut self, job: Option<u32>, receiver: &mut Receiver) -> Result<()> {
        let mut status = match self.ask(|answer| Notice::Watch(job, answer)).await.and_then(|s| s) {
            Ok(status) => status,
            Err(why) => return self.reply(&Reply::No(why)),
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

async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> std::result::Result<T, String> + Send + 'static,
) -> std::result::Result<T, String> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|_| Err("a bug in the master; its log has the words".to_owned()))
}

/// The results files of a folder with their lengths, by name.
fn list(folder: &Path) -> std::result::Result<Vec<(String, u64)>, String> {
    let fault = |e: std::io::Error| format!("{}: {e}", folder.display());
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
fn piece(path: &Path, offset: u64) -> std::result::Result<Vec<u8>, String> {
    let fault = |e: std::io::Error| format!("{}: {e}", path.display());
    if !path.symlink_metadata().map_err(fault)?.is_file() {
        return Err(format!("{} is no file", path.display()));
    }
    let mut file = File::open(path).map_err(fault)?;
    file.seek(SeekFrom::Start(offset)).map_err(fault)?;
    let mut bytes = Vec::new();
    file.take(u64::from(PIECE_LIMIT)).read_to_end(&mut bytes).map_err(fault)?;
    Ok(bytes)
}
