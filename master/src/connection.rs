//! CONNECTION: one task per connection, from its first byte to its end. It carries, and decides nothing.
//!
//! TLS if there are certificates, the greeting, then messages of a worker to its job's thread, or requests of a client
//! to the [`desk`](crate::desk). Every fault ends this connection with one line in the log, and nothing else.

use std::{
    net::SocketAddr,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
};

use protocol::{
    Error, Result,
    dial::leave,
    handshake::{Hello, Policy, Role, Server, Welcome},
    link::{self, Receiver, Sender, Settings},
    message::ToMaster,
    order::{BULK_ON_THE_WAY, Inbox, Outbox},
    shape::{Shape, Shaped},
    tls::{self, ServerConfig},
    wire,
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::TcpStream,
    sync::{mpsc, oneshot},
};

use crate::{
    daemon::Event,
    desk,
    drive::{Input, Route, Seat},
    event::Hand,
};

/// Interval of heartbeats on every connection (ms).
const HEARTBEAT_MS: u32 = 1000;

/// What every connection needs of the daemon.
pub struct Gate {
    /// To the owner of hosts and queue.
    events: mpsc::Sender<Event>,
    /// Who is taken in.
    roles: Vec<Role>,
    /// The secret that greetings must hold.
    token: Option<String>,
    /// Certificates; none on loopback.
    tls: Option<Arc<ServerConfig>>,
    /// This host's emulated port, which all connections pass.
    port: Option<Shape>,
    /// The last incarnation that was given.
    incarnations: AtomicU32,
    ending: AtomicBool,
}

impl Gate {
    /// With nobody taken in yet.
    pub fn new(
        events: mpsc::Sender<Event>,
        roles: Vec<Role>,
        token: Option<String>,
        tls: Option<Arc<ServerConfig>>,
    ) -> Self {
        let (incarnations, ending) = (AtomicU32::new(0), AtomicBool::new(false));
        Self { events, roles, token, tls, port: None, incarnations, ending }
    }

    /// All connections pass this emulated port.
    #[must_use]
    pub fn behind(mut self, port: Option<Shape>) -> Self {
        self.port = port;
        self
    }

    /// This side ends all connections from now on, so that their ends are no faults.
    pub fn end(&self) {
        self.ending.store(true, Ordering::Relaxed);
    }

    /// Whether [`Gate::end`] was called.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Relaxed)
    }

    /// Serves a TCP connection to its end.
    ///
    /// # Errors
    /// Why it ended, unless a client left.
    pub async fn take(self: Arc<Self>, stream: TcpStream, address: String) -> Result<()> {
        let stream = Shaped::new(link::Socket::new(stream)?, self.port.as_ref());
        match self.tls.clone() {
            None => self.serve(stream, address, None).await,
            Some(config) => {
                let (stream, identity) = tls::accept(stream, &config).await?;
                self.serve(stream, address, Some(identity.role)).await
            }
        }
    }

    /// Serves any stream to its end; `certificate` is the role that its certificate proved.
    ///
    /// # Errors
    /// As for [`Gate::take`].
    pub async fn serve<S>(
        self: Arc<Self>,
        stream: S,
        address: String,
        certificate: Option<tls::Role>,
    ) -> Result<()>
    where
        S: AsyncRead + AsyncWrite + Send + 'static,
    {
        let (sender, mut receiver) = link::split(stream, Settings::default());
        let policy = Policy { roles: self.roles.clone(), certificate, token: self.token.clone() };
        let (server, hello) = link::hear(&sender, &mut receiver, policy).await?;
        let incarnation = self.incarnations.fetch_add(1, Ordering::Relaxed) + 1;
        if hello.role == Role::Worker {
            return self.worker(server, &hello, sender, receiver, address, incarnation).await;
        }
        let welcome = Welcome { incarnation, host: 0, heartbeat_ms: HEARTBEAT_MS };
        link::admit(server, &sender, &mut receiver, welcome)?;
        match desk::serve(&self.events, &sender, &mut receiver, incarnation).await {
            // A client may go as it likes.
            Error::Closed | Error::Left { .. } | Error::Io { .. } => Ok(()),
            error => {
                leave(&sender, &error.to_string()).await;
                Err(error)
            }
        }
    }

    async fn worker(
        &self,
        mut server: Server,
        hello: &Hello,
        sender: Sender,
        mut receiver: Receiver,
        address: String,
        incarnation: u32,
    ) -> Result<()> {
        let (answer, answered) = oneshot::channel();
        let knock =
            Event::Knock { hello: Box::new(hello.clone()), address: address.clone(), incarnation, answer };
        // The owner lives as long as the daemon; a daemon that ends refuses.
        let _ = self.events.send(knock).await;
        let host = match answered.await.unwrap_or_else(|_| Err("the master is ending".to_owned())) {
            Ok(host) => host,
            Err(reason) => {
                sender.send(server.refuse(&reason)?)?;
                let _ = tokio::time::timeout(link::GREETING_LIMIT, sender.finish()).await;
                return Err(Error::Message(reason));
            }
        };
        let route = Arc::new(Route::default());
        let welcome = Welcome { incarnation, host, heartbeat_ms: HEARTBEAT_MS };
        let error = match link::admit(server, &sender, &mut receiver, welcome) {
            Err(error) => error,
            Ok(()) => {
                let seat = Seat {
                    hand: Hand { name: hello.name.clone(), speed: hello.speed, threads: hello.threads },
                    address: address.clone(),
                    peer: peer_address(&address, hello.peer_port),
                    incarnation,
                    outbox: Arc::new(Mutex::new(Outbox::new(sender.clone(), 0))),
                    route: Arc::clone(&route),
                };
                let _ = self.events.send(Event::Joined(seat)).await;
                listen(&mut receiver, incarnation, &route).await
            }
        };
        if !matches!(error, Error::Closed | Error::Left { .. } | Error::Io { .. }) {
            leave(&sender, &error.to_string()).await;
        }
        drop(receiver);
        let why = format!("{} at {address}: {error}", hello.name);
        if let Some((index, send)) = route.lose(&why) {
            // The job may be over by now.
            let _ = send.send(Input::Lost(index, why)).await;
        }
        let _ = self.events.send(Event::Left { incarnation, why: error.to_string() }).await;
        Err(error)
    }
}

/// Where other workers find one that calls from `address` and takes peers on `port`; none if it takes none.
fn peer_address(address: &str, port: u16) -> Option<SocketAddr> {
    let caller: SocketAddr = address.parse().ok().filter(|_| port != 0)?;
    Some(SocketAddr::new(caller.ip(), port))
}

/// Hands a worker's messages to its job; ends with the link.
async fn listen(receiver: &mut Receiver, incarnation: u32, route: &Route) -> Error {
    let mut inbox = Inbox::new(incarnation, BULK_ON_THE_WAY);
    loop {
        if let Err(error) = hand_on(receiver, &mut inbox, route).await {
            return error;
        }
    }
}

async fn hand_on(receiver: &mut Receiver, inbox: &mut Inbox, route: &Route) -> Result<()> {
    inbox.accept(receiver.receive().await?)?;
    while let Some(letter) = inbox.take() {
        let header = letter.header;
        let Some((index, send)) = route.find(&header)? else { continue };
        let message: ToMaster = wire::unpack_to_master(header.kind, &letter.bytes)?;
        receiver.recycle(letter.bytes);
        // The job may be over by now.
        let _ = send.send(Input::Message(index, header, message)).await;
    }
    Ok(())
}
