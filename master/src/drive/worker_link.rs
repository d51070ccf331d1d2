//! WORKER LINK: a connected worker as a job has it, and the way of its messages to the job that it computes.

use std::{
    net::SocketAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use protocol::{
    frame::Header,
    link::Sender,
    message::ToWorker,
    order::{Outbox, Place},
    wire,
};
use tokio::sync::{Notify, mpsc};

use super::Input;
use crate::{event::WorkerSpec, footprint::Bearer};

/// A connected worker, as those see it who send to it.
#[derive(Clone)]
pub struct WorkerLink {
    /// The host.
    pub spec: WorkerSpec,
    /// Where it calls from.
    pub address: String,
    /// Memory that its process may take (bytes), as it said when it called; 0 if it does not say.
    pub memory: u64,
    /// Whether it can give threads to another slot of its process.
    pub divides: bool,
    /// The certificate that it showed, in words.
    pub certificate: Option<String>,
    /// Where it takes other workers, if it does.
    pub peer: Option<SocketAddr>,
    /// Its connection.
    pub incarnation: u32,
    /// The way to it.
    pub outbox: Arc<Mutex<Outbox>>,
    /// The way from it.
    pub delivery: Arc<Delivery>,
}

impl WorkerLink {
    /// What it can take of a job.
    pub(crate) fn bearer(&self) -> Bearer<'_> {
        Bearer { name: &self.spec.name, speed: self.spec.speed, memory: self.memory }
    }

    /// It has so many threads from now on, and speed and memory in proportion.
    pub(crate) fn compute_with(&mut self, threads: u32) {
        let part = f64::from(threads) / f64::from(self.spec.threads.max(1));
        self.memory = (self.memory as f64 * part) as u64;
        self.spec.compute_with(threads);
    }

    /// Queues a message to it.
    pub(crate) fn send(&self, place: Place, message: &ToWorker) -> protocol::Result<()> {
        let packed = wire::pack_to_worker(message)?;
        self.outbox.lock().unwrap_or_else(PoisonError::into_inner).send(place, packed)
    }

    /// Queues a message to it that is made when its turn comes.
    pub(crate) fn send_later(
        &self,
        place: Place,
        make: impl FnOnce() -> ToWorker + Send + 'static,
    ) -> protocol::Result<()> {
        let mut outbox = self.outbox.lock().unwrap_or_else(PoisonError::into_inner);
        outbox.send_later(place, || wire::pack_to_worker(&make()))
    }

    /// The link's sending half.
    pub fn sender(&self) -> Sender {
        self.outbox.lock().unwrap_or_else(PoisonError::into_inner).sender().clone()
    }

    /// That have travelled since the link stood, both ways.
    pub(super) fn bytes(&self) -> u64 {
        let counters = self.sender().counters();
        counters.bytes_sent + counters.bytes_received
    }
}

/// A worker that was given to the job.
pub(super) struct Member {
    pub(super) link: WorkerLink,
    /// What had travelled on its link before it was the job's.
    bytes_before: u64,
    /// What had once it was the job's no more.
    bytes_freed: Option<u64>,
}

impl Member {
    pub(super) fn new(link: WorkerLink) -> Self {
        Self { bytes_before: link.bytes(), link, bytes_freed: None }
    }

    /// It has been released.
    pub(super) fn free(&mut self) {
        self.bytes_freed = Some(self.link.bytes());
    }

    /// Whether it is the job's no more, and may be another's.
    pub(super) const fn is_freed(&self) -> bool {
        self.bytes_freed.is_some()
    }

    /// What travelled for the job.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes_freed.unwrap_or_else(|| self.link.bytes()) - self.bytes_before
    }
}

/// The way from a worker's connection to the job that it computes.
#[derive(Default)]
pub struct Delivery {
    port: Mutex<Port>,
    /// The job will have no more to do with the worker.
    dismissed: Notify,
}

#[derive(Default)]
struct Port {
    /// The last job that the worker was given.
    job: u32,
    /// The highest number of those that it was given so far.
    most: u32,
    to: Option<(usize, mpsc::Sender<Input>)>,
    /// Why the connection has ended.
    gone: Option<String>,
    /// Why the job will have no more to do with the worker.
    dismissal: Option<String>,
    /// The connection is about to end, as it was asked to.
    is_to_end: bool,
}

impl Delivery {
    fn port(&self) -> MutexGuard<'_, Port> {
        self.port.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The worker failed by itself: its connection is to end with this reason, and it may not come back.
    pub(super) fn dismiss(&self, why: String) {
        let mut port = self.port();
        port.to = None;
        port.dismissal = Some(format!("dropped: {why}"));
        self.dismissed.notify_one();
    }

    /// Waits until the worker is dismissed. Cancel safe.
    pub async fn dismissed(&self) {
        self.dismissed.notified().await;
    }

    /// The worker was asked to end the connection: its end is no fault.
    pub(crate) fn expect_end(&self) {
        self.port().is_to_end = true;
    }

    /// Whether it was.
    pub(crate) fn is_to_end(&self) -> bool {
        self.port().is_to_end
    }

    /// Why the worker was dismissed, if it was.
    pub fn dismissal(&self) -> Option<String> {
        self.port().dismissal.clone()
    }

    /// From now on messages of `job` go to `send`.
    pub(super) fn open(&self, job: u32, index: usize, send: mpsc::Sender<Input>) -> Result<(), String> {
        let mut port = self.port();
        port.job = job;
        port.most = port.most.max(job);
        match &port.gone {
            Some(why) => Err(why.clone()),
            None => {
                port.to = Some((index, send));
                Ok(())
            }
        }
    }

    /// The worker is this job's no more; it may be another's already.
    pub(super) fn close(&self, job: u32) {
        let mut port = self.port();
        if port.job == job {
            port.to = None;
        }
    }

    /// Where a frame goes: none for what a job that is over still had on its way.
    ///
    /// # Errors
    /// For a frame of a job that the worker cannot have been given.
    pub fn find(&self, header: &Header) -> protocol::Result<Option<(usize, mpsc::Sender<Input>)>> {
        let port = self.port();
        if header.job > port.most || header.job == 0 {
            return Err(protocol::Error::Message(format!(
                "{} frame of job {}, the worker was given job {}",
                header.kind, header.job, port.job
            )));
        }
        Ok(if header.job == port.job { port.to.clone() } else { None })
    }

    /// The connection has ended; gives where to say so.
    pub fn lose(&self, why: &str) -> Option<(usize, mpsc::Sender<Input>)> {
        let mut port = self.port();
        port.gone = Some(why.to_owned());
        port.to.take()
    }
}
