//! DIAL: from the address of a master, or of another worker, to a link that has greeted it.

use std::{
    net::{IpAddr, SocketAddr},
    path::Path,
    sync::Arc,
    time::Duration,
};

use crate::tls::ClientConfig;
use tokio::net::TcpStream;

use crate::{
    Error, Result,
    handshake::{self, Hello, Welcome},
    link::{self, Receiver, Sender, Settings},
    memory::Near,
    shape::{Shape, Shaped},
    tls,
};

/// The port of a master where none is given.
pub const PORT: u16 = 7117;
/// The longest that one address is tried.
pub const CONNECT_LIMIT: Duration = Duration::from_secs(10);
/// The longest that this side waits for its last words to be written.
const LEAVE_LIMIT: Duration = Duration::from_secs(1);

/// A link to a master that has taken this side in.
pub struct Call {
    /// The sending half.
    pub sender: Sender,
    /// The receiving half.
    pub receiver: Receiver,
    /// The place that the master gave.
    pub welcome: Welcome,
    /// Whether it is over memory, within this machine.
    pub shares_memory: bool,
}

/// The configuration for dialling with the certificates in a folder; none without a folder.
///
/// # Errors
/// [`Error::Certificate`].
pub fn certificates(folder: Option<&Path>) -> Result<Option<Arc<ClientConfig>>> {
    folder.map(|folder| tls::client_config(&tls::Paths::in_folder(folder))).transpose()
}

/// A connection that has not been greeted over.
pub struct Reached {
    stream: link::Socket,
    host: String,
    certificates: Option<Arc<ClientConfig>>,
    /// What the other side's certificate may be for.
    roles: &'static [tls::Role],
    settings: Settings,
    port: Option<Shape>,
    may_share: bool,
}

impl Reached {
    /// The same through this host's emulated port.
    #[must_use]
    pub fn through(mut self, port: Option<&Shape>) -> Self {
        self.port = port.cloned();
        self
    }

    /// The same, which may go on over memory if the other side is on this machine; not through an emulated port.
    #[must_use]
    pub const fn sharing_memory(mut self, may_share: bool) -> Self {
        self.may_share = may_share;
        self
    }

    /// The address of this side: of the interface that the other side is reached by.
    ///
    /// # Errors
    /// [`Error::Io`] if the system does not know it.
    pub fn local_ip(&self) -> Result<IpAddr> {
        let address = self.stream.local_addr();
        address.map(|address| address.ip()).map_err(|e| Error::io("the address of a connection", &e))
    }

    /// TLS if there are certificates, then the greeting.
    ///
    /// # Errors
    /// [`Error::Certificate`], or what [`link::greet`] gives.
    pub async fn greet(self, hello: &Hello) -> Result<Call> {
        let may_share = self.may_share && self.port.is_none();
        let near = if may_share { Near::of(&self.stream) } else { None };
        let stream = Shaped::new(self.stream, self.port.as_ref());
        let (sender, receiver) = match &self.certificates {
            None => link::split(stream, self.settings),
            Some(config) => {
                let (stream, identity) = tls::connect_any(stream, &self.host, config, self.roles).await?;
                let (sender, receiver) = link::split(stream, self.settings);
                tls::watch(&sender, identity, None);
                (sender, receiver)
            }
        };
        greet_near(sender, receiver, hello, near).await
    }
}

/// Dials `master` (`HOST`, `HOST:PORT` or `[V6]:PORT`) and greets it. Without certificates only loopback addresses are
/// dialled.
///
/// # Errors
/// [`Error::Io`] when nobody answers, [`Error::Address`], [`Error::Certificate`], or what [`link::greet`] gives.
pub async fn dial(master: &str, certificates: Option<&Arc<ClientConfig>>, hello: &Hello) -> Result<Call> {
    reach(master, certificates).await?.greet(hello).await
}

/// Connects to another worker, which may hold a certificate of a worker or of a master; `certificates` as
/// [`tls::peer_config`] gives them. Without any only loopback addresses are dialled.
///
/// # Errors
/// [`Error::Io`] when nobody answers, [`Error::Address`].
pub async fn reach_peer(
    address: SocketAddr,
    certificates: Option<&Arc<ClientConfig>>,
    settings: Settings,
) -> Result<Reached> {
    if certificates.is_none() {
        tls::loopback_only(address)?;
    }
    let stream = connect(&[address], &address.to_string()).await?;
    let roles = &[tls::Role::Worker, tls::Role::Master];
    let host = address.ip().to_string();
    let certificates = certificates.cloned();
    Ok(Reached { stream, host, certificates, roles, settings, port: None, may_share: false })
}

/// Connects to `master` as [`dial`] does, without a greeting.
///
/// # Errors
/// [`Error::Io`] when nobody answers, [`Error::Address`].
pub async fn reach(master: &str, certificates: Option<&Arc<ClientConfig>>) -> Result<Reached> {
    let (host, port) = split_address(master)?;
    let fault = |error: std::io::Error| Error::io(format!("connecting to {master}"), &error);
    let addresses: Vec<SocketAddr> = tokio::net::lookup_host((host, port)).await.map_err(fault)?.collect();
    if certificates.is_none() {
        addresses.iter().try_for_each(|address| tls::loopback_only(*address))?;
    }
    Ok(Reached {
        stream: connect(&addresses, master).await?,
        host: host.to_owned(),
        certificates: certificates.cloned(),
        roles: &[tls::Role::Master],
        settings: Settings::default(),
        port: None,
        may_share: false,
    })
}

async fn connect(addresses: &[SocketAddr], name: &str) -> Result<link::Socket> {
    let doing = || format!("connecting to {name}");
    let fault = |error: std::io::Error| Error::io(doing(), &error);
    let late = || {
        let why = format!("no answer after {} s", CONNECT_LIMIT.as_secs());
        Error::Io { doing: doing(), kind: std::io::ErrorKind::TimedOut, why }
    };
    let connecting = TcpStream::connect(addresses);
    let stream = tokio::time::timeout(CONNECT_LIMIT, connecting).await.map_err(|_| late())?.map_err(fault)?;
    link::Socket::new(stream)
}

/// Greets over a link that stands.
///
/// # Errors
/// What [`link::greet`] gives.
pub async fn greet(sender: Sender, receiver: Receiver, hello: &Hello) -> Result<Call> {
    greet_near(sender, receiver, hello, None).await
}

async fn greet_near(
    sender: Sender,
    mut receiver: Receiver,
    hello: &Hello,
    near: Option<Near>,
) -> Result<Call> {
    let (welcome, shares_memory) = link::greet_near(&sender, &mut receiver, hello, near).await?;
    Ok(Call { sender, receiver, welcome, shares_memory })
}

/// Ends a connection on purpose: the reason is the last that the peer hears. What is queued is written first.
pub async fn leave(sender: &Sender, reason: &str) {
    let Ok(bye) = handshake::bye(reason) else { return };
    if sender.send(bye).is_ok() {
        // A peer that does not read is left without the words.
        let _ = tokio::time::timeout(LEAVE_LIMIT, sender.finish()).await;
    }
}

/// Host and port of `text`; without a port [`PORT`].
fn split_address(text: &str) -> Result<(&str, u16)> {
    let wrong = |why: &str| {
        Error::Message(format!("address {text:?}: {why}; expected HOST, HOST:PORT or [ADDRESS]:PORT"))
    };
    let (host, port) = if let Some(rest) = text.strip_prefix('[') {
        let (host, rest) = rest.split_once(']').ok_or_else(|| wrong("no closing bracket"))?;
        (host, rest.strip_prefix(':'))
    } else {
        match text.rsplit_once(':') {
            Some((host, port)) if !host.contains(':') => (host, Some(port)),
            _ => (text, None),
        }
    };
    let port = match port {
        None => PORT,
        Some(port) => port.parse().map_err(|_| wrong("the port is no number up to 65535"))?,
    };
    if host.is_empty() { Err(wrong("no host")) } else { Ok((host, port)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_come_with_and_without_port() {
        for (text, host, port) in [
            ("pc-1", "pc-1", PORT),
            ("pc-1:9", "pc-1", 9),
            ("127.0.0.1:80", "127.0.0.1", 80),
            ("::1", "::1", PORT),
            ("[::1]:81", "::1", 81),
            ("[::1]", "::1", PORT),
        ] {
            assert_eq!(split_address(text).expect("an address"), (host, port), "{text}");
        }
        for text in ["", ":80", "pc:x", "pc:70000", "[::1"] {
            assert!(split_address(text).is_err(), "{text}");
        }
    }

    #[tokio::test]
    async fn without_certificates_only_loopback_is_dialled() {
        let hello = Hello::new(handshake::Role::Worker, "pc", 1.0, 1, "scalar", 1);
        let error = dial("192.0.2.7:9", None, &hello).await.err().expect("not loopback");
        assert!(matches!(error, Error::Address { .. }), "{error}");
    }
}
