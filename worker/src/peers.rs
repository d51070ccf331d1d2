//! PEERS: links between workers, on route direct.
//!
//! A worker listens for others ([`Peers`]) and tells the master the port. The master tells the workers of a job and
//! epoch where they find each other and a secret that only they know (`Circle`); of two, the one with the higher
//! index dials. Whoever calls shows a certificate of a worker where certificates are in use, then the secret and its
//! index. A bad caller costs one line in the log. From then on both sides send cycle frames only, whose header must
//! name job, epoch and the sender's incarnation.
//!
//! Tasks here carry frames to and from the compute thread and decide nothing; which way a frame goes is decided in
//! [`links`].

mod connect;
pub mod links;
pub mod pairs;

use std::{
    collections::BTreeSet,
    net::{IpAddr, SocketAddr},
    path::Path,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use protocol::{
    Error, Result,
    frame::{Header, Kind},
    handshake,
    link::{Receiver, Settings},
    message::{Introduction, ToPeer},
    shape::Shape,
    tls::{self, ClientConfig, ServerConfig},
    wire,
};
use tokio::{
    net::TcpListener,
    runtime::Handle,
    sync::{mpsc, watch},
    task::JoinHandle,
};

use crate::input::{Input, Key, News, What};

/// The longest that a worker tries to reach another before the master relays for them.
pub const DIAL_LIMIT: Duration = Duration::from_secs(5);
/// Connections of peers that may stand at a time, greeted or not.
pub const CONNECTIONS: usize = 1024;
/// Interval of heartbeats between peers (ms): shorter than the master's, as a link that is given up costs a detour only.
const HEARTBEAT_MS: u32 = 500;

/// The bounds of a link between workers: at most two cycles are under way, and of each sort a few frames.
fn settings() -> Settings {
    Settings { queued_frames: 64, bulk_messages: 0, ..Settings::default() }
}

/// The listening side of a worker's process, from its start to its end.
pub struct Peers {
    shared: Arc<Shared>,
    accepting: JoinHandle<()>,
}

/// What the tasks of all connections need.
struct Shared {
    certificates: Option<(Arc<ServerConfig>, Arc<ClientConfig>)>,
    /// This host's emulated port.
    port: Option<Shape>,
    /// Links within this machine may go on over memory.
    share_memory: bool,
    /// Who may call now.
    circle: watch::Sender<Option<Arc<Circle>>>,
    runtime: Handle,
}

impl Peers {
    /// Takes peers on `listener`, with the certificates in a folder if there are any, through this host's emulated
    /// port if it has one; else over memory within this machine, if that may be. Called within a runtime.
    ///
    /// # Errors
    /// [`Error::Certificate`].
    pub fn start(
        listener: TcpListener,
        certs: Option<&Path>,
        port: Option<Shape>,
        share_memory: bool,
    ) -> Result<Self> {
        let certificates = match certs {
            None => None,
            Some(folder) => {
                let paths = tls::Paths::in_folder(folder);
                Some((tls::server_config(&paths)?, tls::peer_config(&paths)?))
            }
        };
        let shared = Arc::new(Shared {
            certificates,
            port,
            share_memory,
            circle: watch::Sender::new(None),
            runtime: Handle::current(),
        });
        let accepting = tokio::spawn(connect::listen(listener, Arc::clone(&shared)));
        Ok(Self { shared, accepting })
    }

    /// Binds a listener on an interface; port 0 for any.
    ///
    /// # Errors
    /// [`Error::Io`] with the address.
    pub async fn bind(ip: IpAddr, port: u16) -> Result<TcpListener> {
        let address = SocketAddr::new(ip, port);
        let doing = || format!("listening for other workers on {address}");
        TcpListener::bind(address).await.map_err(|e| Error::io(doing(), &e))
    }
}

impl Drop for Peers {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

/// The workers of one epoch of a job.
struct Circle {
    key: Key,
    who: Introduction,
    /// Workers that have called or were dialled.
    taken: Mutex<BTreeSet<u32>>,
    /// To the compute thread; weak, so that it ends with the connection to the master.
    news: mpsc::WeakSender<Input>,
}

impl Circle {
    /// Whether this is the first call of a worker.
    fn take(&self, index: u32) -> bool {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner).insert(index)
    }

    /// Tells the compute thread, if it still listens.
    async fn tell(&self, from: u32, what: What) {
        if let Some(news) = self.news.upgrade() {
            let _ = news.send(Input::Peer(News { key: self.key, from, what })).await;
        }
    }

    /// Carries the frames of a link that stands to the compute thread, to its end.
    async fn carry(&self, from: u32, receiver: &mut Receiver) {
        let error = loop {
            match self.next(from, receiver).await {
                Ok((header, message)) => self.tell(from, What::Frame(header, message)).await,
                Err(error) => break error,
            }
        };
        self.tell(from, What::Ended(error)).await;
    }

    async fn next(&self, from: u32, receiver: &mut Receiver) -> Result<(Header, ToPeer)> {
        let frame = receiver.receive().await?;
        let header = frame.header;
        if header.kind == Kind::Bye {
            return Err(Error::Left { reason: handshake::reason(&frame)? });
        }
        let incarnation = self.who.peer_workers.get(from as usize).map_or(0, |member| member.incarnation);
        for (what, found, expected) in [
            ("job", header.job, self.key.job),
            ("epoch", header.epoch, self.key.epoch),
            ("incarnation", header.incarnation, incarnation),
        ] {
            if found != expected {
                return Err(Error::Message(format!(
                    "{} frame of {what} {found}, this link is of {expected}",
                    header.kind
                )));
            }
        }
        let message = wire::unpack_to_peer(header.kind, &frame.payload)?;
        if message.cycle != header.cycle {
            return Err(Error::Message(format!(
                "cycle {} in a frame of cycle {}",
                message.cycle, header.cycle
            )));
        }
        receiver.recycle(frame.payload);
        Ok((header, message))
    }
}

#[cfg(test)]
mod tests;
