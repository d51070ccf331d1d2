//! Proof of who is at the other end: mutual TLS 1.3 from PEM files, or loopback only.
//!
//! Every host holds three files ([`Paths`]): the lab's CA, its own certificate and its key. Both sides of
//! a connection show a certificate of the same CA. A certificate carries the role of its holder as a URI
//! among its subject's alternative names, `bolide:master`, `bolide:worker` or `bolide:client`, so that a
//! stolen client's certificate does not pass for a master. Making certificates is not done here.

use crate::token::pin_of;
use crate::{Error, Result};
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::ServerCertVerifier;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::WebPkiClientVerifier;
use rustls::{AlertDescription, CertificateError, RootCertStore};
pub use rustls::{ClientConfig, ServerConfig};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::io::{AsyncRead, AsyncWrite, BufReader};
use tokio_rustls::{TlsAcceptor, TlsConnector, TlsStream};
use x509_parser::extensions::GeneralName;
use x509_parser::prelude::{FromDer, X509Certificate};

mod verify;
mod watch;
pub use watch::{Revoked, watch};

/// The longest a TLS handshake may take: a peer that dials and says nothing holds a task no longer.
pub const HANDSHAKE_LIMIT: Duration = Duration::from_secs(10);

/// Bytes asked of the stream at a time: four records. TLS by itself asks for a quarter of one.
pub const READ_BUFFER: usize = 64 << 10;

/// What a URI in a certificate starts with when it names a role.
pub const ROLE_PREFIX: &str = "bolide:";

/// What the holder of a certificate may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// The master: listens, and may be anything else too.
    Master,
    /// A worker: dials a master, listens to and dials other workers.
    Worker,
    /// A client: submits, watches and cancels jobs.
    Client,
}

impl Role {
    pub const ALL: [Self; 3] = [Self::Master, Self::Worker, Self::Client];

    /// The role's name, as certificates and messages spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Master => "master",
            Self::Worker => "worker",
            Self::Client => "client",
        }
    }

    /// The URI that a certificate of this role carries, such as `bolide:worker`.
    pub fn uri(self) -> String {
        format!("{ROLE_PREFIX}{}", self.name())
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Who a verified certificate says its holder is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// What it may be.
    pub role: Role,
    /// Its common name: the name of a worker's host.
    pub name: String,
    /// Hash of the certificate, in hexadecimal digits: what a list of revoked ones names.
    pub fingerprint: String,
    /// Its last second (s since 1970).
    pub expires: i64,
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.role, self.name, self.fingerprint)
    }
}

/// The three PEM files of a host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Paths {
    /// The certificate of the CA that signs every host of the lab.
    pub ca: PathBuf,
    /// The host's certificate.
    pub certificate: PathBuf,
    /// The host's private key; readable by its owner only.
    pub key: PathBuf,
}

impl Paths {
    /// `ca.pem`, `host.pem` and `host-key.pem` in `folder`.
    pub fn in_folder(folder: &Path) -> Self {
        Self {
            ca: folder.join("ca.pem"),
            certificate: folder.join("host.pem"),
            key: folder.join("host-key.pem"),
        }
    }
}

/// Passes `address` when it is within 127.0.0.0/8 or is `::1`: the rule for a daemon without certificates.
///
/// # Errors
/// [`Error::Address`], which says how to make certificates.
pub fn loopback_only(address: SocketAddr) -> Result<()> {
    if address.ip().is_loopback() { Ok(()) } else { Err(Error::Address { address }) }
}

/// The listening side's configuration; a caller without a certificate of the same CA is turned away.
///
/// # Errors
/// [`Error::Certificate`] naming the file that is missing, unreadable, open to others or out of date.
pub fn server_config(paths: &Paths) -> Result<Arc<ServerConfig>> {
    let files = Files::load(paths)?;
    files.check_dates(&paths.certificate, SystemTime::now())?;
    files.server(paths, false)
}

/// As [`server_config`], for a side that also takes newcomers: callers without a certificate, who say in their greeting
/// what they come with. [`accept_any`] tells them apart.
///
/// # Errors
/// As for [`server_config`].
pub fn open_server_config(paths: &Paths) -> Result<Arc<ServerConfig>> {
    let files = Files::load(paths)?;
    files.check_dates(&paths.certificate, SystemTime::now())?;
    files.server(paths, true)
}

/// The dialling side's configuration of a host without certificates, toward whoever holds one of the CA with this pin.
pub fn newcomer_config(pin: [u8; 16]) -> Result<Arc<ClientConfig>> {
    let config = ClientConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| Error::Certificate(error.to_string()))?
        .dangerous()
        .with_custom_certificate_verifier(Arc::new(verify::Pinned { pin, provider: provider() }))
        .with_no_client_auth();
    Ok(Arc::new(config))
}

/// The configuration of a page for browsers, which hold no certificate: what they may is not decided by TLS.
///
/// # Errors
/// As for [`server_config`].
pub fn page_config(paths: &Paths) -> Result<Arc<ServerConfig>> {
    let files = Files::load(paths)?;
    files.check_dates(&paths.certificate, SystemTime::now())?;
    ServerConfig::builder_with_provider(provider())
        .with_safe_default_protocol_versions()
        .map_err(|error| unusable(&paths.certificate, &error))?
        .with_no_client_auth()
        .with_single_cert(files.chain, files.key)
        .map(Arc::new)
        .map_err(|error| unusable(&paths.key, &error))
}

/// The dialling side's configuration.
///
/// # Errors
/// As for [`server_config`].
pub fn client_config(paths: &Paths) -> Result<Arc<ClientConfig>> {
    let files = Files::load(paths)?;
    files.check_dates(&paths.certificate, SystemTime::now())?;
    files.client(paths, false)
}

/// The dialling side's configuration toward another worker, which the master names by address and whose certificate
/// need not list that address: it must be of the same CA, and what it may be is checked by [`connect_any`]. Whom to
/// dial comes from the master, over a link whose host was proved.
///
/// # Errors
/// As for [`server_config`].
pub fn peer_config(paths: &Paths) -> Result<Arc<ClientConfig>> {
    let files = Files::load(paths)?;
    files.check_dates(&paths.certificate, SystemTime::now())?;
    files.client(paths, true)
}

/// Takes a connection: the TLS handshake, then the caller's identity.
///
/// # Errors
/// [`Error::Io`] or [`Error::Certificate`] in one line; a caller that takes longer than
/// [`HANDSHAKE_LIMIT`].
pub async fn accept<S>(stream: S, config: &Arc<ServerConfig>) -> Result<(TlsStream<BufReader<S>>, Identity)>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let (stream, identity) = accept_any(stream, config).await?;
    Ok((stream, identity.ok_or_else(no_certificate)?))
}

/// As [`accept`] with an [`open_server_config`]: a newcomer has no identity.
///
/// # Errors
/// As for [`accept`].
pub async fn accept_any<S>(
    stream: S,
    config: &Arc<ServerConfig>,
) -> Result<(TlsStream<BufReader<S>>, Option<Identity>)>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let stream = BufReader::with_capacity(READ_BUFFER, stream);
    let stream = in_time(TlsAcceptor::from(Arc::clone(config)).accept(stream)).await?;
    let shown = stream.get_ref().1.peer_certificates().and_then(<[_]>::first);
    let identity = shown.map(|certificate| identity(certificate)).transpose()?;
    Ok((TlsStream::Server(stream), identity))
}

/// Dials: the TLS handshake over `stream` with the host called `host` (a name or an address that its
/// certificate must list), which must hold a certificate for `role`.
///
/// The listening side judges this side's certificate after this returns: a refusal is the first thing
/// that reading then gives.
///
/// # Errors
/// As for [`accept`], and [`Error::Certificate`] for another role.
pub async fn connect<S>(
    stream: S,
    host: &str,
    config: &Arc<ClientConfig>,
    role: Role,
) -> Result<(TlsStream<BufReader<S>>, Identity)>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    connect_any(stream, host, config, &[role]).await
}

/// As [`connect`], with a host that may hold a certificate for any of `roles`.
///
/// # Errors
/// As for [`connect`].
pub async fn connect_any<S>(
    stream: S,
    host: &str,
    config: &Arc<ClientConfig>,
    roles: &[Role],
) -> Result<(TlsStream<BufReader<S>>, Identity)>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let name = ServerName::try_from(host.to_owned())
        .map_err(|_| Error::Certificate(format!("{host:?} is neither a host's name nor an address")))?;
    let stream = BufReader::with_capacity(READ_BUFFER, stream);
    let shaken = in_time(TlsConnector::from(Arc::clone(config)).connect(name, stream)).await;
    let stream = shaken.map_err(doubt_tls)?;
    let shown = stream.get_ref().1.peer_certificates().and_then(<[_]>::first);
    let identity = identity(shown.ok_or_else(no_certificate)?)?;
    if !roles.contains(&identity.role) {
        let expected: Vec<&str> = roles.iter().map(|role| role.name()).collect();
        return Err(Error::Certificate(format!(
            "the certificate of {host:?} is for a {}, expected a {}",
            identity.role,
            expected.join(" or a ")
        )));
    }
    Ok((TlsStream::Client(stream), identity))
}

async fn in_time<T>(handshake: impl Future<Output = std::io::Result<T>>) -> Result<T> {
    match tokio::time::timeout(HANDSHAKE_LIMIT, handshake).await {
        Ok(result) => result.map_err(|error| Error::io("TLS handshake", &error)),
        Err(_) => {
            let kind = std::io::ErrorKind::TimedOut;
            let why = format!("not done after {} s", HANDSHAKE_LIMIT.as_secs());
            Err(Error::Io { doing: "TLS handshake".into(), kind, why })
        }
    }
}

/// A peer without certificates hangs up on who begins with TLS.
fn doubt_tls(error: Error) -> Error {
    use std::io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof};
    match error {
        Error::Io { doing, kind, why }
            if matches!(kind, UnexpectedEof | ConnectionReset | ConnectionAborted | BrokenPipe) =>
        {
            Error::Io { doing, kind, why: format!("{why}; it may run without certificates") }
        }
        error => error,
    }
}

fn no_certificate() -> Error {
    Error::Certificate("the peer shows no certificate; make one with `bolide certs`".into())
}

/// What a list of revoked certificates knows a certificate in DER by.
pub fn fingerprint(certificate: &[u8]) -> String {
    crate::token::hex(&pin_of(certificate))
}

/// Who the first certificate in a PEM file is of.
///
/// # Errors
/// [`Error::Certificate`] naming the file.
pub fn identity_of_file(path: &Path) -> Result<Identity> {
    let certificates = certificates(path)?;
    identity(certificates.first().ok_or_else(|| unusable(path, &"no certificate in it"))?)
}

/// The pins of the certificates in a PEM file.
///
/// # Errors
/// [`Error::Certificate`] naming the file.
pub fn pins_of_file(path: &Path) -> Result<Vec<[u8; 16]>> {
    Ok(certificates(path)?.iter().map(|certificate| pin_of(certificate)).collect())
}

/// Reads role and name from a certificate in DER; it must name exactly one role.
///
/// # Errors
/// [`Error::Certificate`].
pub fn identity(certificate: &[u8]) -> Result<Identity> {
    let (_, parsed) = X509Certificate::from_der(certificate)
        .map_err(|error| Error::Certificate(format!("certificate is not X.509: {error}")))?;
    let name = parsed.subject().iter_common_name().find_map(|name| name.as_str().ok());
    let name = name.unwrap_or("without a name").to_owned();
    let alternatives = parsed
        .subject_alternative_name()
        .map_err(|error| Error::Certificate(format!("certificate of {name:?}: {error}")))?;
    let names = alternatives.map_or(&[][..], |extension| &extension.value.general_names);
    let mut roles = names.iter().filter_map(|name| match name {
        GeneralName::URI(uri) => uri.strip_prefix(ROLE_PREFIX),
        _ => None,
    });
    let (first, more) = (roles.next(), roles.next());
    match (Role::ALL.into_iter().find(|role| Some(role.name()) == first), more) {
        (Some(role), None) => Ok(Identity {
            role,
            name,
            fingerprint: fingerprint(certificate),
            expires: parsed.validity().not_after.timestamp(),
        }),
        _ => Err(Error::Certificate(format!(
            "certificate of {name:?} names {} as its role, expected one of bolide:master, bolide:worker and \
             bolide:client; make it with `bolide certs`",
            first.map_or_else(|| "nothing".to_owned(), |role| format!("{role:?}"))
        ))),
    }
}

/// What the three files hold.
struct Files {
    roots: Arc<RootCertStore>,
    chain: Vec<CertificateDer<'static>>,
    key: PrivateKeyDer<'static>,
}

impl Files {
    fn load(paths: &Paths) -> Result<Self> {
        let mut roots = RootCertStore::empty();
        for authority in certificates(&paths.ca)? {
            roots.add(authority).map_err(|error| unusable(&paths.ca, &error))?;
        }
        let chain = certificates(&paths.certificate)?;
        check_private(&paths.key)?;
        let key = PrivateKeyDer::from_pem_file(&paths.key).map_err(|error| unusable(&paths.key, &error))?;
        Ok(Self { roots: Arc::new(roots), chain, key })
    }

    /// Says before any connection that this host's own certificate is out of date.
    fn check_dates(&self, path: &Path, now: SystemTime) -> Result<()> {
        let Some(own) = self.chain.first() else { return Ok(()) };
        let (_, parsed) = X509Certificate::from_der(own).map_err(|error| unusable(path, &error))?;
        let now = now.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() as i64);
        let (path, dates) = (path.display(), parsed.validity());
        if now > dates.not_after.timestamp() {
            let end = dates.not_after;
            return Err(Error::Certificate(format!(
                "{path} expired on {end}; make another with `bolide certs`"
            )));
        }
        if now < dates.not_before.timestamp() {
            let start = dates.not_before;
            return Err(Error::Certificate(format!("{path} is valid from {start}; check this host's clock")));
        }
        Ok(())
    }

    /// With `newcomers`, callers without a certificate are let in as well, and shown the CA that their token pins.
    fn server(mut self, paths: &Paths, newcomers: bool) -> Result<Arc<ServerConfig>> {
        let mut verifier = WebPkiClientVerifier::builder_with_provider(self.roots, provider());
        if newcomers {
            verifier = verifier.allow_unauthenticated();
            self.chain.extend(certificates(&paths.ca)?);
        }
        let verifier = verifier.build().map_err(|error| unusable(&paths.ca, &error))?;
        let config = ServerConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .and_then(|config| {
                config.with_client_cert_verifier(verifier).with_single_cert(self.chain, self.key)
            })
            .map_err(|error| unusable(&paths.certificate, &error))?;
        Ok(Arc::new(config))
    }

    /// With `any_host`, whatever names the other side's certificate lists.
    fn client(self, paths: &Paths, any_host: bool) -> Result<Arc<ClientConfig>> {
        let verifier = WebPkiServerVerifier::builder_with_provider(self.roots, provider())
            .build()
            .map_err(|error| unusable(&paths.ca, &error))?;
        let verifier: Arc<dyn ServerCertVerifier> =
            if any_host { Arc::new(verify::AnyHost(verifier)) } else { verifier };
        let config = ClientConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .and_then(|config| {
                config
                    .dangerous()
                    .with_custom_certificate_verifier(verifier)
                    .with_client_auth_cert(self.chain, self.key)
            })
            .map_err(|error| unusable(&paths.certificate, &error))?;
        Ok(Arc::new(config))
    }
}

/// Bytes that nobody can guess, from the source that TLS keys come from.
///
/// # Errors
/// [`Error::Io`] if the system gives none.
pub fn secret() -> Result<[u8; 16]> {
    let mut bytes = [0; 16];
    let none = |_| Error::io("drawing a secret", &std::io::ErrorKind::Other.into());
    provider().secure_random.fill(&mut bytes).map_err(none)?;
    Ok(bytes)
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>> {
    let read =
        CertificateDer::pem_file_iter(path).and_then(Iterator::collect::<std::result::Result<Vec<_>, _>>);
    let certificates = read.map_err(|error| unusable(path, &error))?;
    if certificates.is_empty() {
        return Err(unusable(path, &"no certificate in it"));
    }
    Ok(certificates)
}

fn unusable(path: &Path, why: &dyn fmt::Display) -> Error {
    Error::Certificate(format!("{}: {why}; make certificates with `bolide certs`", path.display()))
}

/// Refuses a key that others on the machine can read.
fn check_private(path: &Path) -> Result<()> {
    match system::private::open_to_others(path).map_err(|error| unusable(path, &error))? {
        None => Ok(()),
        Some(why) => Err(Error::Certificate(format!("{} {why}", path.display()))),
    }
}

/// Whether these are the first bytes of an alert or a greeting of TLS.
pub const fn begins(bytes: [u8; 2]) -> bool {
    matches!(bytes, [0x15 | 0x16, 3])
}

/// The words for a failed read, write or handshake: a fault of certificates on one line with what to do,
/// anything else as the system says it.
pub fn explain(error: &std::io::Error) -> String {
    let fault = error.get_ref().and_then(|inner| inner.downcast_ref::<rustls::Error>());
    match fault {
        Some(rustls::Error::InvalidCertificate(why)) => explain_certificate(why),
        Some(rustls::Error::AlertReceived(alert)) => explain_alert(*alert),
        Some(rustls::Error::NoCertificatesPresented) => {
            "the peer shows no certificate; make one with `bolide certs`".into()
        }
        Some(rustls::Error::InvalidMessage(_)) => {
            "the peer does not speak TLS; it may run without certificates".into()
        }
        // rustls adds the address of its manual.
        _ if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the peer closed the connection in the middle".into()
        }
        _ => error.to_string(),
    }
}

fn explain_certificate(why: &CertificateError) -> String {
    match why {
        CertificateError::Expired | CertificateError::ExpiredContext { .. } => {
            "the peer's certificate has expired; make another with `bolide certs`".into()
        }
        CertificateError::NotValidYet | CertificateError::NotValidYetContext { .. } => {
            "the peer's certificate is not valid yet; check the clocks".into()
        }
        CertificateError::UnknownIssuer | CertificateError::BadSignature => {
            "the peer's certificate is from another CA than this host's ca.pem".into()
        }
        CertificateError::NotValidForNameContext { expected, presented } => format!(
            "the peer's certificate is for {}, dialled was {}; make one that lists it, with `bolide certs`",
            presented.join(" and "),
            expected.to_str()
        ),
        other => format!("the peer's certificate is not accepted: {other}"),
    }
}

fn explain_alert(alert: AlertDescription) -> String {
    let why = match alert {
        AlertDescription::UnknownCA | AlertDescription::DecryptError => "it is from another CA",
        AlertDescription::CertificateExpired => "it has expired",
        AlertDescription::CertificateRequired => "none was shown",
        AlertDescription::BadCertificate => "it does not list the name that was dialled, or is damaged",
        other => return format!("the peer ended TLS: {other:?}"),
    };
    format!("the peer does not accept this host's certificate: {why}; make one with `bolide certs`")
}
