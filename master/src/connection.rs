//! CONNECTION: one task per connection, from its first byte to its end. It carries, and decides nothing.
//!
//! TLS if there are certificates, the greeting, then messages of a worker to its job's thread, or requests of a client
//! to the [`crate::client_requests`]. Every fault ends this connection with one line in the log, and nothing else.

use std::{
    net::SocketAddr,
    sync::{
        Arc, Mutex, OnceLock,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    time::Duration,
};

use protocol::{
    Error, Result,
    dial::leave,
    frame::Frame,
    handshake::{Hello, Policy, Role, Server, Welcome},
    link::{self, MISSED_HEARTBEATS, Receiver, Sender, Settings},
    memory::Near,
    message::ToMaster,
    order::{BULK_ON_THE_WAY, Inbox, Outbox},
    shape::{Shape, Shaped},
    tls::{self, Revoked, ServerConfig},
    wire,
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    sync::{mpsc, oneshot},
    time::Instant,
};
use tracing::{info, warn};

use crate::{
    ca_folder::CaFolder,
    client_requests::{self, Caller},
    drive::{Delivery, Input, WorkerLink},
    event::WorkerSpec,
    files, neighbour, newcomer,
    notice::{End, Notice},
    places::{Place, Places},
};

/// Most connections at a time, those in their greeting included.
pub const CONNECTIONS: usize = 4096;
/// Connections that may be in their handshake or greeting at a time, each with some 200 kB of buffers.
pub const GREETINGS: usize = 256;
/// The longest that a connection waits for a place among them.
const PLACE_LIMIT: Duration = Duration::from_secs(30);
/// A worker is suspect after this part of the silence after which it is dead.
const SUSPECT: f64 = 0.3;

/// What every connection needs of the daemon.
pub struct Acceptor {
    /// To the scheduler.
    notices: mpsc::Sender<Notice>,
    /// Who is taken in.
    roles: Vec<Role>,
    /// The secret that greetings must hold.
    token: Option<String>,
    /// Certificates; none on loopback.
    tls: Option<Arc<ServerConfig>>,
    /// Where newcomers exchange their tokens, and the certificates that count no more.
    ca_folder: Option<(CaFolder, Revoked)>,
    /// Places for connections that are not welcomed yet.
    greetings: Places,
    /// This host's emulated port, which all connections pass.
    port: Option<Shape>,
    /// Without a byte for so long, a peer is dead.
    dead_after: Duration,
    /// Without certificates, callers of any user of this PC are taken in.
    shared: bool,
    /// Links within this machine may go on over memory; never through an emulated port.
    share_memory: bool,
    /// The last incarnation that was given.
    incarnations: AtomicU32,
    ending: AtomicBool,
}

impl Acceptor {
    /// With nobody taken in yet.
    pub fn new(
        notices: mpsc::Sender<Notice>,
        roles: Vec<Role>,
        token: Option<String>,
        tls: Option<Arc<ServerConfig>>,
    ) -> Self {
        let (incarnations, ending) = (AtomicU32::new(0), AtomicBool::new(false));
        let greetings = Places::new(GREETINGS);
        let (ca_folder, port, dead_after, shared) = (None, None, Settings::default().silence, false);
        Self {
            notices,
            roles,
            token,
            tls,
            ca_folder,
            greetings,
            port,
            dead_after,
            shared,
            share_memory: true,
            incarnations,
            ending,
        }
    }

    /// Newcomers may exchange tokens of this lab, and certificates on its list are not accepted.
    #[must_use]
    pub fn of(mut self, ca_folder: Option<(CaFolder, Revoked)>) -> Self {
        self.ca_folder = ca_folder;
        self
    }

    /// All connections pass this emulated port.
    #[must_use]
    pub fn behind(mut self, port: Option<Shape>) -> Self {
        self.port = port;
        self
    }

    /// Without certificates, callers of any user of this PC are taken in.
    #[must_use]
    pub fn shared(mut self, shared: bool) -> Self {
        self.shared = shared;
        self
    }

    /// Whether links within this machine may go on over memory, as they do if nothing is said.
    #[must_use]
    pub fn sharing_memory(mut self, share_memory: bool) -> Self {
        self.share_memory = share_memory;
        self
    }

    /// A peer is dead after so long without a byte.
    #[must_use]
    pub fn patient_for(mut self, dead_after: Duration) -> Self {
        self.dead_after = dead_after;
        self
    }

    /// The interval that peers are told (ms).
    fn heartbeat_ms(&self) -> u32 {
        u32::try_from(self.settings().heartbeat.as_millis()).unwrap_or(u32::MAX).max(1)
    }

    fn settings(&self) -> Settings {
        let heartbeat = Settings::default().heartbeat.min(self.dead_after / MISSED_HEARTBEATS);
        Settings { heartbeat, silence: self.dead_after, ..Settings::default() }
    }

    /// This side ends all connections from now on, so that their ends are no faults.
    pub fn end(&self) {
        self.ending.store(true, Ordering::Relaxed);
    }

    /// Whether [`Acceptor::end`] was called.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Relaxed)
    }

    /// Serves a TCP connection to its end; a fault is one line in the log, with the certificate that was shown.
    async fn attend(self: Arc<Self>, stream: TcpStream, address: SocketAddr) {
        let certificate = OnceLock::new();
        if let Err(error) = Arc::clone(&self).take(stream, address, &certificate).await
            && !self.is_ending()
        {
            warn!(certificate = certificate.get(), "connection from {address}: {error}");
        }
    }

    /// The same; gives why it ended, unless a client left.
    async fn take(
        self: Arc<Self>,
        stream: TcpStream,
        theirs: SocketAddr,
        certificate: &OnceLock<String>,
    ) -> Result<()> {
        let address = theirs.to_string();
        let ours = stream.local_addr().ok();
        let socket = link::Socket::new(stream)?;
        // A connection costs its socket until there is a place to greet it; strangers hold a place no longer than a
        // handshake and a greeting may take.
        let place = tokio::time::timeout(PLACE_LIMIT, self.greetings.wait(theirs.ip())).await;
        let full = || {
            let of_address = self.greetings.most_of_an_address();
            Error::Message(format!(
                "others are being greeted, at most {GREETINGS}, and {of_address} of one address"
            ))
        };
        let place = place.map_err(|_| full())?.ok_or_else(full)?;
        let near = if self.share_memory && self.port.is_none() { Near::of(&socket) } else { None };
        let stream = Shaped::new(socket, self.port.as_ref());
        match self.tls.clone() {
            None => {
                let unlisted = Some(neighbour::Refusal::Unlisted(theirs));
                let refusal = match ours {
                    _ if self.shared => None,
                    Some(ours) => {
                        let check = move || neighbour::check(ours, theirs).err();
                        tokio::task::spawn_blocking(check).await.unwrap_or(unlisted)
                    }
                    None => unlisted,
                };
                let refusal = refusal.map(|refusal| refusal.to_string());
                let policy = Policy { roles: self.roles.clone(), refusal, ..Policy::default() };
                let (sender, receiver) = link::split(stream, self.settings());
                let caller = Caller { address, certificate: None };
                self.greet((sender, receiver), near, caller, policy, Some(place)).await
            }
            Some(config) => {
                let (stream, identity) = tls::accept_any(stream, &config).await?;
                let (sender, receiver) = link::split(stream, self.settings());
                let policy = self.policy_for(identity.as_ref());
                let shown = identity.as_ref().map(ToString::to_string);
                if let Some(words) = &shown {
                    certificate.get_or_init(|| words.clone());
                }
                if let Some(identity) = identity {
                    tls::watch(
                        &sender,
                        identity,
                        self.ca_folder.as_ref().map(|(_, revoked)| revoked.clone()),
                    );
                }
                let caller = Caller { address, certificate: shown };
                self.greet((sender, receiver), near, caller, policy, Some(place)).await
            }
        }
    }

    /// Whom to take on a connection with this certificate: without one, newcomers only.
    fn policy_for(&self, identity: Option<&tls::Identity>) -> Policy {
        let revoked = self.ca_folder.as_ref().map(|(_, revoked)| revoked);
        match identity {
            None => Policy { roles: vec![Role::Newcomer], ..Policy::default() },
            Some(identity) => Policy {
                roles: self.roles.clone(),
                certificate: Some(identity.role),
                // Whoever may be a master may start workers of any name.
                name: (identity.role == tls::Role::Worker).then(|| identity.name.clone()),
                refusal: identity.fault(revoked, std::time::SystemTime::now()),
                ..Policy::default()
            },
        }
    }

    /// Serves any stream to its end; `certificate` is the role that its certificate proved.
    ///
    /// # Errors
    /// If the caller greets otherwise than it may, or the connection breaks; not if a client left.
    pub async fn serve<S>(
        self: Arc<Self>,
        stream: S,
        address: String,
        certificate: Option<tls::Role>,
    ) -> Result<()>
    where
        S: AsyncRead + AsyncWrite + Send + 'static,
    {
        let link = link::split(stream, self.settings());
        let policy = Policy { roles: self.roles.clone(), certificate, ..Policy::default() };
        self.greet(link, None, Caller { address, certificate: None }, policy, None).await
    }

    async fn greet(
        self: Arc<Self>,
        (sender, mut receiver): (Sender, Receiver),
        near: Option<Near>,
        caller: Caller,
        policy: Policy,
        place: Option<Place>,
    ) -> Result<()> {
        let newcomer = policy.roles == [Role::Newcomer];
        let token = self.token.clone().filter(|_| !newcomer);
        let policy = Policy { token, ..policy };
        let (server, hello) = link::hear(&sender, &mut receiver, policy).await?;
        let incarnation = self.incarnations.fetch_add(1, Ordering::Relaxed) + 1;
        if hello.role == Role::Worker {
            drop(place);
            return self.worker(server, &hello, (sender, receiver), near, caller, incarnation).await;
        }
        let welcome = Welcome::new(incarnation, 0, self.heartbeat_ms());
        link::admit(server, &sender, &mut receiver, welcome)?;
        if newcomer {
            let (ca_folder, _) =
                self.ca_folder.as_ref().ok_or_else(|| Error::Message("no lab to join here".into()))?;
            // It keeps its place: nobody knows it yet.
            let served = newcomer::serve(ca_folder, &hello, &caller.address, &sender, &mut receiver).await;
            drop(place);
            return served;
        }
        drop(place);
        match client_requests::serve(&self.notices, &sender, &mut receiver, (incarnation, caller)).await {
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
        (sender, mut receiver): (Sender, Receiver),
        near: Option<Near>,
        Caller { address, certificate }: Caller,
        incarnation: u32,
    ) -> Result<()> {
        let (answer, answered) = oneshot::channel();
        let knock =
            Notice::Knock { hello: Box::new(hello.clone()), address: address.clone(), incarnation, answer };
        // The owner lives as long as the daemon.
        let _ = self.notices.send(knock).await;
        let host = match answered.await {
            // A daemon that ends hangs up: the worker finds the next one by dialling again.
            Err(_) => return Err(Error::Message("the master is ending".to_owned())),
            Ok(Ok(host)) => host,
            Ok(Err(reason)) => {
                sender.send(server.refuse(&reason)?)?;
                let _ = tokio::time::timeout(link::GREETING_LIMIT, sender.finish()).await;
                return Err(Error::Message(reason));
            }
        };
        let delivery = Arc::new(Delivery::default());
        let welcome = Welcome::new(incarnation, host, self.heartbeat_ms());
        let admitted = link::admit_near(server, &sender, &mut receiver, welcome, hello, near).await;
        let error = match admitted {
            Err(error) => error,
            Ok(_) => {
                let worker_link = WorkerLink {
                    spec: WorkerSpec {
                        region: hello.region.clone(),
                        ..WorkerSpec::new(&hello.name, hello.speed, hello.threads)
                    },
                    address: address.clone(),
                    memory: hello.memory,
                    divides: hello.divides,
                    certificate,
                    peer: peer_address(&address, hello.peer_port),
                    incarnation,
                    outbox: Arc::new(Mutex::new(Outbox::new(sender.clone(), 0))),
                    delivery: Arc::clone(&delivery),
                };
                let _ = self.notices.send(Notice::Joined(worker_link)).await;
                self.listen(&mut receiver, hello, incarnation, &delivery).await
            }
        };
        let (end, words) = match (delivery.dismissal(), &error) {
            (Some(words), _) => (End::Dropped, words),
            (None, Error::Left { reason }) => (End::Left, reason.clone()),
            (None, error) => (End::Lost, error.to_string()),
        };
        if !matches!(error, Error::Closed | Error::Left { .. } | Error::Io { .. }) {
            leave(&sender, &words).await;
        }
        drop(receiver);
        let why = format!("{} at {address}: {words}", hello.name);
        if let Some((index, send)) = delivery.lose(&why) {
            // The job may be over by now.
            let _ = send.send(Input::Lost(index, why)).await;
        }
        let _ = self.notices.send(Notice::Left { incarnation, why: words, end }).await;
        if delivery.is_to_end() { Ok(()) } else { Err(error) }
    }

    /// Hands a worker's messages to its job, and says when it has been silent; ends with the link, or when the job will
    /// have no more to do with the worker.
    async fn listen(
        &self,
        receiver: &mut Receiver,
        hello: &Hello,
        incarnation: u32,
        delivery: &Delivery,
    ) -> Error {
        let mut inbox = Inbox::new(incarnation, BULK_ON_THE_WAY);
        let mut look = tokio::time::interval(self.dead_after.mul_f64(SUSPECT) / 4);
        let mut silent_since = None;
        loop {
            let frame = tokio::select! {
                biased;
                frame = receiver.receive() => Some(frame),
                () = delivery.dismissed() => return Error::Message("its job dropped it".to_owned()),
                _ = look.tick() => None,
            };
            let handed = match frame {
                Some(Ok(frame)) => hand_on(frame, receiver, &mut inbox, delivery).await,
                Some(Err(error)) => Err(error),
                None => {
                    self.look_at(&hello.name, incarnation, receiver.last_seen(), &mut silent_since).await;
                    Ok(())
                }
            };
            if let Err(error) = handed {
                return error;
            }
        }
    }

    /// Says when a worker has become suspect, and when it is heard again.
    async fn look_at(
        &self,
        name: &str,
        incarnation: u32,
        last_seen: Instant,
        silent_since: &mut Option<Instant>,
    ) {
        let note = match *silent_since {
            None if last_seen.elapsed() >= self.dead_after.mul_f64(SUSPECT) => {
                *silent_since = Some(last_seen);
                let (quiet, dead) = (last_seen.elapsed().as_secs_f64(), self.dead_after.as_secs_f64());
                let note = format!("suspect: silent for {quiet:.1} s, dead after {dead} s");
                warn!("worker {name} is {note}");
                Some(note)
            }
            Some(since) if last_seen > since => {
                *silent_since = None;
                info!("worker {name} is heard again after {:.1} s", (last_seen - since).as_secs_f64());
                None
            }
            _ => return,
        };
        // The owner lives as long as the daemon.
        let _ = self.notices.send(Notice::Suspect { incarnation, note }).await;
    }
}

/// Where other workers find one that calls from `address` and takes peers on `port`; none if it takes none.
fn peer_address(address: &str, port: u16) -> Option<SocketAddr> {
    let caller: SocketAddr = address.parse().ok().filter(|_| port != 0)?;
    Some(SocketAddr::new(caller.ip(), port))
}

async fn hand_on(
    frame: Frame,
    receiver: &mut Receiver,
    inbox: &mut Inbox,
    delivery: &Delivery,
) -> Result<()> {
    inbox.accept(frame)?;
    while let Some(letter) = inbox.take() {
        let header = letter.header;
        let Some((index, send)) = delivery.find(&header)? else { continue };
        let message: ToMaster = wire::unpack_to_master(header.kind, &letter.bytes)?;
        receiver.recycle(letter.bytes);
        // The job may be over by now.
        let _ = send.send(Input::Message(index, header, message)).await;
    }
    Ok(())
}

/// Takes connections for ever; each fault of one is one line in the log.
pub async fn listen(listener: TcpListener, acceptor: Arc<Acceptor>) {
    // The rest is for results: callers that only stay may not take the files that a run writes.
    let most = CONNECTIONS.min(files::raise_limit());
    let places = Places::new(most);
    loop {
        let (stream, address) = match listener.accept().await {
            Ok(taken) => taken,
            Err(error) => {
                // Out of file descriptors, most likely: connections that end give some back.
                warn!("taking a connection: {error}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let Some(place) = places.take(address.ip()) else {
            let of_address = places.most_of_an_address();
            warn!("connection from {address} not taken: at most {most} stand, {of_address} of one address");
            continue;
        };
        let acceptor = Arc::clone(&acceptor);
        tokio::spawn(async move {
            acceptor.attend(stream, address).await;
            drop(place);
        });
    }
}
