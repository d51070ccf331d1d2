//! Certificates for a lab: one CA, and for each host a folder with the three files that TLS reads.
//!
//! `FOLDER/ca.pem` and `FOLDER/ca-key.pem` are the CA; the key signs hosts and never leaves this folder.
//! `FOLDER/NAME/` holds `ca.pem`, `host.pem` and `host-key.pem` and is what is copied to the host. What
//! the files are used for is in [`protocol::tls`].

pub mod arguments;
pub mod fit;

use protocol::tls::{Paths, Role};
use rcgen::{
    BasicConstraints, Certificate, CertificateParams, CertificateSigningRequestParams, DistinguishedName,
    DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair, KeyUsagePurpose, SanType, date_time_ymd,
};
use std::fmt;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use system::Readers;

/// Days that a CA is valid.
pub const CA_DAYS: u64 = 3650;
/// Days that a host's certificate is valid.
pub const HOST_DAYS: u64 = 825;
/// How far back validity starts, for hosts whose clocks are behind.
const CLOCK_SLACK: Duration = Duration::from_secs(24 * 3600);
/// Most addresses in one certificate.
const ADDRESS_LIMIT: usize = 64;

/// Why certificates were not made.
#[derive(Debug)]
pub enum Error {
    /// The file is there and was not to be replaced.
    Exists(PathBuf),
    /// The CA's key is not in the folder.
    NoAuthority(PathBuf),
    /// A name or an address that no certificate can hold.
    Name {
        given: String,
        /// What it must be.
        expected: &'static str,
    },
    /// The system would not read or write a file.
    Io {
        path: PathBuf,
        /// The system's words.
        error: std::io::Error,
    },
    /// Something that the lab's rules forbid: a used token, an unknown host.
    Rule(String),
    /// A key that is no key, or a certificate that cannot be made of it.
    Unusable {
        path: PathBuf,
        /// What is wrong.
        error: rcgen::Error,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exists(path) => {
                write!(f, "{} exists; choose another folder, or give --force to replace it", path.display())
            }
            Self::NoAuthority(path) => write!(f, "{} is missing; make the CA first", path.display()),
            Self::Name { given, expected } => write!(f, "{given:?} must be {expected}"),
            Self::Io { path, error } => write!(f, "{}: {error}", path.display()),
            Self::Rule(why) => f.write_str(why),
            Self::Unusable { path, error } => write!(f, "{}: {error}", path.display()),
        }
    }
}

impl std::error::Error for Error {}

/// Makes a CA in `folder`: `ca.pem` and, with mode 0600, `ca-key.pem`. Gives the path of `ca.pem`.
///
/// With `force` an existing CA is replaced, and the certificates of all its hosts with it become useless.
///
/// # Errors
/// [`Error::Exists`] when either file is there and `force` is not given; nothing is written then.
pub fn make_ca(folder: &Path, force: bool) -> Result<PathBuf, Error> {
    let (path, key_path) = (folder.join("ca.pem"), folder.join("ca-key.pem"));
    check_absent(&[&path, &key_path], force)?;
    create_folder(folder)?;
    let unusable = |error| Error::Unusable { path: path.clone(), error };
    let key = KeyPair::generate().map_err(unusable)?;
    let certificate = authority().self_signed(&key).map_err(unusable)?;
    write(&key_path, &key.serialize_pem(), Readers::Owner)?;
    write(&path, &certificate.pem(), Readers::All)?;
    Ok(path)
}

/// Makes the folder `folder/name` with the certificate of one host, signed by the CA in `folder`.
///
/// The certificate lists `name`, every one of `addresses` (names or IP addresses under which others dial
/// it) and the loopback addresses. It serves for dialling and for listening.
///
/// # Errors
/// [`Error::NoAuthority`] without a CA, [`Error::Exists`] when one of the files is there and `force` is
/// not given (nothing is written then), [`Error::Name`] for a name that is no name of a host.
pub fn make_host(
    folder: &Path,
    name: &str,
    addresses: &[String],
    role: Role,
    force: bool,
) -> Result<Paths, Error> {
    let params = host(name, addresses, role)?;
    let (authority_pem, issuer) = issuer(folder)?;

    let host_folder = folder.join(name);
    let paths = Paths::in_folder(&host_folder);
    check_absent(&[&paths.ca, &paths.certificate, &paths.key], force)?;
    let unusable = |error| Error::Unusable { path: paths.certificate.clone(), error };
    let key = KeyPair::generate().map_err(unusable)?;
    let certificate = params.signed_by(&key, &issuer).map_err(unusable)?;

    record(folder, &certificate)?;
    create_folder(&host_folder)?;
    write(&paths.key, &key.serialize_pem(), Readers::Owner)?;
    write(&paths.certificate, &certificate.pem(), Readers::All)?;
    write(&paths.ca, &authority_pem, Readers::All)?;
    Ok(paths)
}

/// The CA in `folder`: its certificate in PEM, and what signs in its name.
fn issuer(folder: &Path) -> Result<(String, Issuer<'static, KeyPair>), Error> {
    let key_path = folder.join("ca-key.pem");
    let pem = read(&folder.join("ca.pem"))?;
    let key =
        KeyPair::from_pem(&read(&key_path)?).map_err(|error| Error::Unusable { path: key_path, error })?;
    Ok((pem, Issuer::new(authority(), key)))
}

/// Keeps a certificate in `folder/issued`, by its fingerprint, so that it can be revoked by its host's name.
fn record(folder: &Path, certificate: &Certificate) -> Result<(), Error> {
    let issued = folder.join("issued");
    create_folder(&issued)?;
    let name = format!("{}.pem", protocol::tls::fingerprint(certificate.der()));
    write(&issued.join(name), &certificate.pem(), Readers::All)
}

/// Signs the key of a newcomer's request (PKCS#10, DER) for the host `name`; what else the request says does not count.
/// Gives the certificate and that of the CA, both in PEM.
pub(crate) fn sign_request(
    folder: &Path,
    request: &[u8],
    name: &str,
    addresses: &[String],
    role: Role,
) -> Result<(String, String), Error> {
    let params = host(name, addresses, role)?;
    let (ca, issuer) = issuer(folder)?;
    let wrong = |error| Error::Rule(format!("the request for a certificate: {error}"));
    let request = CertificateSigningRequestParams::from_der(&request.into()).map_err(wrong)?;
    let certificate = params.signed_by(&request.public_key, &issuer).map_err(wrong)?;
    record(folder, &certificate)?;
    Ok((certificate.pem(), ca))
}

/// A new key, kept to this host, and a request (PKCS#10, DER) to have it signed.
pub(crate) fn make_request() -> Result<(KeyPair, Vec<u8>), Error> {
    let wrong = |error: rcgen::Error| Error::Rule(format!("a request for a certificate: {error}"));
    let key = KeyPair::generate().map_err(wrong)?;
    let request = CertificateParams::default().serialize_request(&key).map_err(wrong)?;
    Ok((key, request.der().to_vec()))
}

/// Puts the three files of this host into `folder`, in place of any that are there.
pub(crate) fn install(folder: &Path, key: &KeyPair, certificate: &str, ca: &str) -> Result<Paths, Error> {
    let paths = Paths::in_folder(folder);
    create_folder(folder)?;
    write(&paths.key, &key.serialize_pem(), Readers::Owner)?;
    write(&paths.ca, ca, Readers::All)?;
    write(&paths.certificate, certificate, Readers::All)?;
    Ok(paths)
}

/// What every CA of ours says of itself; only the key tells one from another, so that the key alone is
/// enough to sign a host.
fn authority() -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = common_name("bolide certificate authority");
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    set_dates(&mut params, CA_DAYS);
    params
}

/// Names that no worker and no client may have: that of the master, and folders of the lab.
const RESERVED: [&str; 4] = ["master", "localhost", "issued", "tokens"];

/// Whether a host of this role may have a name.
///
/// # Errors
/// [`Error::Name`].
pub(crate) fn check_host(name: &str, role: Role) -> Result<(), Error> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let (first, length) = (name.chars().next(), name.len());
    if length > 64 || !first.is_some_and(|c| c.is_ascii_alphanumeric()) || !name.chars().all(plain) {
        let expected = "1 to 64 letters, digits, - _ or ., starting with a letter or digit";
        return Err(Error::Name { given: name.to_owned(), expected });
    }
    if RESERVED.iter().any(|reserved| name.eq_ignore_ascii_case(reserved))
        && (role != Role::Master || name != "master")
    {
        return Err(Error::Name { given: name.to_owned(), expected: "the name of a host: it is reserved" });
    }
    Ok(())
}

fn host(name: &str, addresses: &[String], role: Role) -> Result<CertificateParams, Error> {
    check_host(name, role)?;
    if addresses.len() > ADDRESS_LIMIT {
        let given = format!("{} addresses", addresses.len());
        return Err(Error::Name { given, expected: "at most 64 addresses" });
    }
    let mut params = CertificateParams::default();
    params.distinguished_name = common_name(name);
    params.extended_key_usages =
        vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    set_dates(&mut params, HOST_DAYS);
    let known = [name, "localhost", "127.0.0.1", "::1"];
    for address in known.into_iter().chain(addresses.iter().map(String::as_str)) {
        let alternative = alternative(address)?;
        if !params.subject_alt_names.contains(&alternative) {
            params.subject_alt_names.push(alternative);
        }
    }
    let uri =
        role.uri().try_into().map_err(|_| Error::Name { given: role.uri(), expected: "a URI in ASCII" })?;
    params.subject_alt_names.push(SanType::URI(uri));
    Ok(params)
}

fn alternative(address: &str) -> Result<SanType, Error> {
    if let Ok(ip) = address.parse::<IpAddr>() {
        return Ok(SanType::IpAddress(ip));
    }
    let expected = "an IP address or the name of a host, without port";
    let wrong = || Error::Name { given: address.to_owned(), expected };
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if address.is_empty() || address.len() > 253 || !address.chars().all(plain) {
        return Err(wrong());
    }
    Ok(SanType::DnsName(address.to_owned().try_into().map_err(|_| wrong())?))
}

fn common_name(name: &str) -> DistinguishedName {
    let mut distinguished = DistinguishedName::new();
    distinguished.push(DnType::CommonName, name);
    distinguished
}

fn set_dates(params: &mut CertificateParams, days: u64) {
    // A clock before 1970 gives certificates of 1970, which a peer will say are out of date.
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let epoch = date_time_ymd(1970, 1, 1);
    params.not_before = epoch + now.saturating_sub(CLOCK_SLACK);
    params.not_after = epoch + now + Duration::from_secs(days * 24 * 3600);
}

fn check_absent(paths: &[&Path], force: bool) -> Result<(), Error> {
    match paths.iter().find(|path| path.symlink_metadata().is_ok()) {
        Some(path) if !force => Err(Error::Exists(path.to_path_buf())),
        _ => Ok(()),
    }
}

pub(crate) fn create_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(|error| Error::Io { path: path.to_owned(), error })
}

fn read(path: &Path) -> Result<String, Error> {
    fs::read_to_string(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => Error::NoAuthority(path.to_owned()),
        _ => Error::Io { path: path.to_owned(), error },
    })
}

/// Writes a new file that is for these readers from its first moment on; what was at `path` is removed before, so
/// that an old mode or a link does not live on.
pub(crate) fn write(path: &Path, text: &str, readers: Readers) -> Result<(), Error> {
    let fault = |error| Error::Io { path: path.to_owned(), error };
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(fault(error)),
        _ => {}
    }
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    let mut file = system::private::open(&options, path, readers).map_err(fault)?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(fault)
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::tls;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a folder for the test")
    }

    #[tokio::test]
    async fn hosts_of_one_ca_meet_and_know_their_roles() {
        let folder = folder();
        make_ca(folder.path(), false).expect("a new CA");
        let master = make_host(folder.path(), "master", &["192.0.2.7".into()], Role::Master, false);
        let worker = make_host(folder.path(), "pc-1", &[], Role::Worker, false);
        let server = tls::server_config(&master.expect("a host")).expect("usable");
        let client = tls::client_config(&worker.expect("a host")).expect("usable");
        for dialled in ["192.0.2.7", "127.0.0.1", "::1", "localhost", "master"] {
            let (near, far) = duplex(4096);
            let (dialling, listening) =
                tokio::join!(tls::connect(near, dialled, &client, Role::Master), tls::accept(far, &server));
            let (mut near, theirs) = dialling.expect("the master lists this address");
            let (mut far, ours) = listening.expect("the worker is of the same CA");
            assert_eq!((theirs.role, theirs.name.as_str()), (Role::Master, "master"));
            assert_eq!((ours.role, ours.name.as_str()), (Role::Worker, "pc-1"));
            near.write_all(b"hit").await.expect("room");
            near.flush().await.expect("room");
            let mut said = [0; 3];
            far.read_exact(&mut said).await.expect("three bytes");
            assert_eq!(&said, b"hit");
        }
    }

    #[test]
    fn keys_are_for_their_owner_only() {
        let others = |path: &Path| system::private::open_to_others(path).expect("the file is there");
        let folder = folder();
        let authority = make_ca(folder.path(), false).expect("a new CA");
        let host = make_host(folder.path(), "pc", &[], Role::Client, false).expect("a host");
        assert_eq!(others(&folder.path().join("ca-key.pem")), None);
        assert_eq!(others(&host.key), None);
        // Replacing a key that was open to all closes it.
        write(&host.key, "", Readers::All).expect("ours");
        assert!(others(&host.key).is_some());
        make_host(folder.path(), "pc", &[], Role::Client, true).expect("forced");
        assert_eq!(others(&host.key), None);
        assert_eq!(fs::read(authority).expect("CA"), fs::read(host.ca).expect("its copy"));
    }

    #[test]
    fn nothing_is_replaced_without_force() {
        let folder = folder();
        make_ca(folder.path(), false).expect("a new CA");
        let host = make_host(folder.path(), "pc", &[], Role::Worker, false).expect("a host");
        let files = [folder.path().join("ca.pem"), folder.path().join("ca-key.pem"), host.key.clone()];
        let before = files.each_ref().map(|path| fs::read(path).expect("written"));
        let path = folder.path().join("ca.pem");
        let expected =
            format!("{} exists; choose another folder, or give --force to replace it", path.display());
        assert_eq!(make_ca(folder.path(), false).expect_err("there is one").to_string(), expected);
        let error = make_host(folder.path(), "pc", &[], Role::Worker, false).expect_err("there is one");
        assert!(matches!(error, Error::Exists(path) if path == host.ca));
        fs::remove_file(&path).expect("ours");
        assert!(make_ca(folder.path(), false).is_err(), "a key without its certificate is kept too");
        fs::write(&path, &before[0]).expect("ours");
        assert_eq!(files.each_ref().map(|path| fs::read(path).expect("kept")), before);
        make_ca(folder.path(), true).expect("forced");
        assert!(files.each_ref().map(|path| fs::read(path).expect("there"))[0] != before[0]);
    }

    #[test]
    fn hosts_need_a_ca_and_a_name() {
        let folder = folder();
        let make = |name: &str, addresses: &[String]| {
            make_host(folder.path(), name, addresses, Role::Worker, false).expect_err("a fault").to_string()
        };
        let expected = format!("{} is missing; make the CA first", folder.path().join("ca.pem").display());
        assert_eq!(make("pc", &[]), expected);
        make_ca(folder.path(), false).expect("a new CA");
        for name in ["", "..", "a/b", "a b"] {
            let rule = "must be 1 to 64 letters, digits, - _ or ., starting with a letter or digit";
            assert_eq!(make(name, &[]), format!("{name:?} {rule}"));
        }
        let expected = "\"pc:4711\" must be an IP address or the name of a host, without port";
        assert_eq!(make("pc", &["pc:4711".into()]), expected);
        assert!(!folder.path().join("pc").exists(), "nothing was written");
    }
}
