//! DIAL: from the address of a master to a link that has greeted it.

use std::{net::SocketAddr, path::Path, sync::Arc, time::Duration};

use crate::tls::ClientConfig;
use tokio::net::TcpStream;

use crate::{
    Error, Result,
    handshake::{self, Hello, Welcome},
    link::{self, Receiver, Sender, Settings},
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
}

/// The configuration for dialling with the certificates in a folder; none without a folder.
///
/// # Errors
/// [`Error::Certificate`].
pub fn certificates(folder: Option<&Path>) -> Result<Option<Arc<ClientConfig>>> {
    folder.map(|folder| tls::client_config(&tls::Paths::in_folder(folder))).transpose()
}

/// Dials `master` (`HOST`, `HOST:PORT` or `[V6]:PORT`) and greets it. Without certificates only loopback addresses are
/// dialled.
///
/// # Errors
/// [`Error::Io`] when nobody answers, [`Error::Address`], [`Error::Certificate`], or what [`link::greet`] gives.
pub async fn dial(master: &str, certificates: Option<&Arc<ClientConfig>>, hello: &Hello) -> Result<Call> {
    dial_from(master, certificates, hello, None).await
}

/// As [`dial`], through a shape: this host's emulated port.
///
/// # Errors
/// As for [`dial`].
pub async fn dial_from(
    master: &str,
    certificates: Option<&Arc<ClientConfig>>,
    hello: &Hello,
    shape: Option<&Shape>,
) -> Result<Call> {
    let (host, port) = split_address(master)?;
    let doing = || format!("connecting to {master}");
    let fault = |error: std::io::Error| Error::io(doing(), &error);
    let addresses: Vec<SocketAddr> = tokio::net::lookup_host((host, port)).await.map_err(fault)?.collect();
    if certificates.is_none() {
        addresses.iter().try_for_each(|address| tls::loopback_only(*address))?;
    }
    let late = || {
        let why = format!("no answer after {} s", CONNECT_LIMIT.as_secs());
        Error::Io { doing: doing(), kind: std::io::ErrorKind::TimedOut, why }
    };
    let connecting = TcpStream::connect(addresses.as_slice());
    let stream = tokio::time::timeout(CONNECT_LIMIT, connecting).await.map_err(|_| late())?.map_err(fault)?;
    link::tune(&stream)?;
    let stream = Shaped::new(stream, shape);
    let (sender, receiver) = match certificates {
        None => link::split(stream, Settings::default()),
        Some(config) => {
            let (stream, _) = tls::connect(stream, host, config, tls::Role::Master).await?;
            link::split(stream, Settings::default())
        }
    };
    greet(sender, receiver, hello).await
}

/// Greets over a link that stands.
///
/// # Errors
/// What [`link::greet`] gives.
pub async fn greet(sender: Sender, mut receiver: Receiver, hello: &Hello) -> Result<Call> {
    let welcome = link::greet(&sender, &mut receiver, hello).await?;
    Ok(Call { sender, receiver, welcome })
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
