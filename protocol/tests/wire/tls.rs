//! TLS over loopback TCP: who gets in, and the words for those who do not.

use protocol::frame::{Frame, Header, Kind};
use protocol::link::{Settings, split};
use protocol::tls::{self, Identity, Paths, Role};
use protocol::token::Token;
use protocol::{Error, Result};
use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair, SanType, date_time_ymd};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ClientConfig, RootCertStore, ServerConfig};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::sync::Arc;
use std::time::Duration;
use system::Readers;
use tempfile::TempDir;
use tokio::io::BufReader;
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::TlsStream;

/// A CA of a test.
pub(crate) struct Authority {
    name: &'static str,
    key: KeyPair,
}

impl Authority {
    pub(crate) fn new(name: &'static str) -> Self {
        Self { name, key: KeyPair::generate().expect("a key") }
    }

    fn params(&self) -> CertificateParams {
        let mut params = CertificateParams::default();
        params.distinguished_name.push(DnType::CommonName, self.name);
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params
    }

    /// A folder with the three files of a host on 127.0.0.1, changed by `change` before signing.
    pub(crate) fn host(&self, uri: &str, change: impl FnOnce(&mut CertificateParams)) -> (TempDir, Paths) {
        let mut params = CertificateParams::new(vec!["127.0.0.1".into()]).expect("an address");
        params.distinguished_name.push(DnType::CommonName, "pc-1");
        params.subject_alt_names.push(SanType::URI(uri.try_into().expect("ASCII")));
        change(&mut params);
        let key = KeyPair::generate().expect("a key");
        let issuer = Issuer::new(self.params(), &self.key);
        let certificate = params.signed_by(&key, &issuer).expect("signs");
        let folder = tempfile::tempdir().expect("a folder for the test");
        let paths = Paths::in_folder(folder.path());
        let authority = self.params().self_signed(&self.key).expect("signs");
        fs::write(&paths.ca, authority.pem()).expect("ours");
        fs::write(&paths.certificate, certificate.pem()).expect("ours");
        let mut options = OpenOptions::new();
        let file = system::private::open(options.write(true).create_new(true), &paths.key, Readers::Owner);
        file.and_then(|mut file| file.write_all(key.serialize_pem().as_bytes())).expect("ours");
        (folder, paths)
    }
}

/// One side of a connection after its handshake.
type Side = Result<(TlsStream<BufReader<TcpStream>>, Identity)>;

/// Dials `host` on a free port of 127.0.0.1, expecting a master there.
async fn meet(client: &Arc<ClientConfig>, host: &str, server: &Arc<ServerConfig>) -> (Side, Side) {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("bound");
    let dial = async {
        let stream = TcpStream::connect(address).await.expect("it listens");
        tls::connect(stream, host, client, Role::Master).await
    };
    let listen = async {
        let (stream, _) = listener.accept().await.expect("it dials");
        tls::accept(stream, server).await
    };
    tokio::join!(dial, listen)
}

/// The line that a dialling side gets which was let in by its own judgement only.
async fn first_word(side: Side) -> String {
    let (stream, _) = side.expect("TLS 1.3 judges the caller after the caller is done");
    let (_sender, mut receiver) = split(stream, Settings::default());
    receiver.receive().await.expect_err("turned away").to_string()
}

fn usual(_: &mut CertificateParams) {}

fn expired(params: &mut CertificateParams) {
    params.not_before = date_time_ymd(2001, 1, 1);
    params.not_after = date_time_ymd(2002, 1, 1);
}

/// A listening configuration with a certificate that [`tls::server_config`] would not take.
fn careless_server(paths: &Paths) -> Arc<ServerConfig> {
    let chain = vec![CertificateDer::from_pem_file(&paths.certificate).expect("written")];
    let key = PrivateKeyDer::from_pem_file(&paths.key).expect("written");
    let config = ServerConfig::builder().with_no_client_auth().with_single_cert(chain, key);
    Arc::new(config.expect("a key and its certificate"))
}

/// A dialling configuration that shows the certificate in `paths`, or none.
fn careless_client(paths: &Paths, shows: bool) -> Arc<ClientConfig> {
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(&paths.ca).expect("written")).expect("a CA");
    let config = ClientConfig::builder().with_root_certificates(roots);
    if !shows {
        return Arc::new(config.with_no_client_auth());
    }
    let chain = vec![CertificateDer::from_pem_file(&paths.certificate).expect("written")];
    let key = PrivateKeyDer::from_pem_file(&paths.key).expect("written");
    Arc::new(config.with_client_auth_cert(chain, key).expect("a key and its certificate"))
}

#[tokio::test]
async fn right_certificates_carry_frames_and_roles() {
    let lab = Authority::new("lab");
    let (_m, master) = lab.host("bolide:master", usual);
    let (_w, worker) = lab.host("bolide:worker", usual);
    let (server, client) = (tls::server_config(&master), tls::client_config(&worker));
    let (near, far) = meet(&client.expect("usable"), "127.0.0.1", &server.expect("usable")).await;
    let ((near, theirs), (far, ours)) = (near.expect("dialled"), far.expect("accepted"));
    assert_eq!((theirs.role, theirs.name.as_str()), (Role::Master, "pc-1"));
    assert_eq!(ours.role, Role::Worker);

    // Both ways at once, with more than a socket holds.
    let big = |cycle| Frame::new(Header { cycle, ..Header::new(Kind::Cycle) }, vec![cycle as u8; 6_000_000]);
    let exchange = |stream, mine, theirs| async move {
        let (sender, mut receiver) = split(stream, Settings::default());
        sender.send(big(mine)).expect("queued");
        let frame = receiver.receive().await.expect("the other's frame");
        assert!(frame.payload == big(theirs).payload);
        sender.finish().await.expect("written");
        assert_eq!(receiver.receive().await, Err(Error::Closed));
    };
    let both = async { tokio::join!(exchange(near, 1, 2), exchange(far, 2, 1)) };
    tokio::time::timeout(Duration::from_secs(60), both).await.expect("no deadlock");
}

#[tokio::test]
async fn a_peer_is_known_by_its_ca_and_role_whatever_its_address() {
    let (lab, other) = (Authority::new("lab"), Authority::new("lab"));
    let elsewhere = |params: &mut CertificateParams| {
        params.subject_alt_names.retain(|name| matches!(name, SanType::URI(_)));
    };
    let (_d, dials) = lab.host("bolide:worker", usual);
    let client = tls::peer_config(&dials).expect("usable");
    for (authority, role, words) in [
        (&lab, "bolide:worker", ""),
        (&lab, "bolide:client", "is for a client, expected a worker or a master"),
        (&other, "bolide:worker", "is from another CA than this host's ca.pem"),
    ] {
        let (_l, listens) = authority.host(role, elsewhere);
        let server = tls::server_config(&listens).expect("usable");
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("bound");
        let dial = async {
            let stream = TcpStream::connect(address).await.expect("it listens");
            tls::connect_any(stream, "127.0.0.1", &client, &[Role::Worker, Role::Master]).await
        };
        let listen = async { tls::accept(listener.accept().await.expect("it dials").0, &server).await };
        let (near, _far) = tokio::join!(dial, listen);
        match near {
            Ok((_, identity)) => assert_eq!((identity.role, words), (Role::Worker, "")),
            Err(error) => assert!(!words.is_empty() && error.to_string().contains(words), "{error}"),
        }
    }
}

#[tokio::test]
async fn another_ca_is_turned_away_on_both_sides_in_words() {
    for other in ["other", "lab"] {
        // Even a CA of the same name is another one.
        let (lab, other) = (Authority::new("lab"), Authority::new(other));
        let (_m, master) = lab.host("bolide:master", usual);
        let (_w, worker) = other.host("bolide:worker", usual);
        let server = tls::server_config(&master).expect("usable");

        let client = tls::client_config(&worker).expect("usable");
        let (near, far) = meet(&client, "127.0.0.1", &server).await;
        let text = near.expect_err("foreign").to_string();
        let expected = "TLS handshake: the peer's certificate is from another CA than this host's ca.pem";
        assert_eq!(text, expected);
        let text = far.expect_err("told so").to_string();
        let start = "TLS handshake: the peer does not accept this host's certificate: it is from another CA";
        assert!(text.starts_with(start), "{text}");

        // A caller that trusts the master but is not of its CA.
        fs::copy(&master.ca, &worker.ca).expect("ours");
        let client = tls::client_config(&worker).expect("usable");
        let (near, far) = meet(&client, "127.0.0.1", &server).await;
        assert_eq!(far.expect_err("foreign").to_string(), expected);
        let text = first_word(near).await;
        let start = "reading from the peer: the peer does not accept this host's certificate: it is from \
                     another CA";
        assert!(text.starts_with(start), "{text}");
    }
}

#[tokio::test]
async fn expired_certificates_are_turned_away_on_both_sides_in_words() {
    let lab = Authority::new("lab");
    let (_m, master) = lab.host("bolide:master", usual);
    let (_w, worker) = lab.host("bolide:worker", usual);
    let (_o, old) = lab.host("bolide:master", expired);
    let words = "TLS handshake: the peer's certificate has expired; make another with `bolide certs`";
    let told =
        "the peer does not accept this host's certificate: it has expired; make one with `bolide certs`";

    let client = tls::client_config(&worker).expect("usable");
    let (near, far) = meet(&client, "127.0.0.1", &careless_server(&old)).await;
    assert_eq!(near.expect_err("expired").to_string(), words);
    assert_eq!(far.expect_err("told so").to_string(), format!("TLS handshake: {told}"));

    let server = tls::server_config(&master).expect("usable");
    let (near, far) = meet(&careless_client(&old, true), "127.0.0.1", &server).await;
    assert_eq!(far.expect_err("expired").to_string(), words);
    assert_eq!(first_word(near).await, format!("reading from the peer: {told}"));

    // The host itself says so before it dials or listens.
    let path = old.certificate.display();
    for error in [tls::server_config(&old).err(), tls::client_config(&old).err()] {
        let text = error.expect("expired").to_string();
        assert!(text.starts_with(&format!("{path} expired on ")), "{text}");
        assert!(text.ends_with("; make another with `bolide certs`"), "{text}");
    }
}

#[tokio::test]
async fn callers_without_certificate_and_hosts_with_the_wrong_name_or_role_are_turned_away() {
    let lab = Authority::new("lab");
    let (_m, master) = lab.host("bolide:master", usual);
    let (_w, worker) = lab.host("bolide:worker", usual);
    let server = tls::server_config(&master).expect("usable");
    let client = tls::client_config(&worker).expect("usable");

    let (near, far) = meet(&careless_client(&worker, false), "127.0.0.1", &server).await;
    let told = first_word(near).await;
    assert!(told.ends_with("certificate: none was shown; make one with `bolide certs`"), "{told}");
    let text = far.expect_err("anonymous").to_string();
    assert_eq!(text, "TLS handshake: the peer shows no certificate; make one with `bolide certs`");

    let (near, _) = meet(&client, "pc-9", &server).await;
    let text = near.expect_err("another host").to_string();
    assert!(text.contains("dialled was pc-9; make one that lists it"), "{text}");
    let (near, _) = meet(&client, "pc 9:1", &server).await;
    let text = near.expect_err("no name").to_string();
    assert_eq!(text, "\"pc 9:1\" is neither a host's name nor an address");

    let impostor = tls::server_config(&worker).expect("usable");
    let (near, _) = meet(&client, "127.0.0.1", &impostor).await;
    let text = near.expect_err("a worker").to_string();
    assert_eq!(text, "the certificate of \"127.0.0.1\" is for a worker, expected a master");
}

#[tokio::test]
async fn a_peer_without_tls_is_named() {
    let (_f, paths) = Authority::new("lab").host("bolide:master", usual);
    let server = tls::server_config(&paths).expect("usable");
    let (near, far) = tokio::io::duplex(4096);
    let (sender, mut receiver) = split(near, Settings::default());
    sender.send(Frame::new(Header::new(Kind::Hello), vec![0; 50])).expect("queued");
    let text = tls::accept(far, &server).await.expect_err("plain frames").to_string();
    assert_eq!(text, "TLS handshake: the peer does not speak TLS; it may run without certificates");
    assert!(receiver.receive().await.is_err());
}

#[tokio::test(start_paused = true)]
async fn a_caller_that_says_nothing_is_dropped_in_time() {
    let (_f, paths) = Authority::new("lab").host("bolide:master", usual);
    let server = tls::server_config(&paths).expect("usable");
    let (_near, far) = tokio::io::duplex(4096);
    let text = tls::accept(far, &server).await.expect_err("silence").to_string();
    assert_eq!(text, "TLS handshake: not done after 10 s");
}

#[test]
fn certificates_name_exactly_one_role() {
    let lab = Authority::new("lab");
    let role = |uri: &str, change: fn(&mut CertificateParams)| {
        let (_folder, paths) = lab.host(uri, change);
        tls::identity(&CertificateDer::from_pem_file(&paths.certificate).expect("written"))
    };
    for known in Role::ALL {
        assert_eq!(role(&known.uri(), usual).expect("a role").role, known);
    }
    let two = |params: &mut CertificateParams| {
        params.subject_alt_names.push(SanType::URI("bolide:master".try_into().expect("ASCII")));
    };
    let text = role("bolide:king", usual).expect_err("no role").to_string();
    assert!(
        text.starts_with("certificate of \"pc-1\" names \"king\" as its role, expected one of"),
        "{text}"
    );
    assert!(role("https://bolide", usual).expect_err("none").to_string().contains(" names nothing as"));
    assert!(role("bolide:worker", two).is_err(), "two roles");
    assert!(tls::identity(b"no certificate").is_err());
}

#[test]
fn files_that_cannot_be_used_are_named() {
    let (_folder, paths) = Authority::new("lab").host("bolide:master", usual);
    let text = |paths: &Paths| tls::server_config(paths).expect_err("unusable").to_string();

    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(&paths.key, PermissionsExt::from_mode(0o640)).expect("ours");
        let key = paths.key.display();
        assert_eq!(text(&paths), format!("{key} has mode 0640, must be 0600; run chmod 600 {key}"));
        fs::set_permissions(&paths.key, PermissionsExt::from_mode(0o600)).expect("ours");
    }

    fs::write(&paths.ca, "no certificate").expect("ours");
    let path = paths.ca.display();
    assert_eq!(text(&paths), format!("{path}: no certificate in it; make certificates with `bolide certs`"));
    fs::remove_file(&paths.ca).expect("ours");
    let missing = text(&paths);
    // Its number is that of Unix and of Windows.
    let why = std::io::Error::from_raw_os_error(2);
    assert!(missing.starts_with(&format!("{path}: ")) && missing.contains(&why.to_string()), "{missing}");
}

#[test]
fn without_certificates_only_loopback_is_allowed() {
    for good in ["127.0.0.1:4711", "127.255.0.9:0", "[::1]:4711"] {
        assert_eq!(tls::loopback_only(good.parse().expect("an address")), Ok(()));
    }
    for bad in ["0.0.0.0:4711", "192.168.1.4:4711", "128.0.0.1:1", "[::]:4711", "[::ffff:127.0.0.1]:1"] {
        let address = bad.parse().expect("an address");
        let error = tls::loopback_only(address).expect_err("not loopback");
        assert_eq!(error, Error::Address { address });
        assert!(error.to_string().starts_with(&format!("address {bad} is not a loopback address")));
        assert!(error.to_string().contains("make some with `bolide certs`"));
    }
}

#[tokio::test]
async fn a_newcomer_knows_the_master_by_its_token_alone_and_is_let_in_where_newcomers_are() {
    let (lab, other) = (Authority::new("lab"), Authority::new("other"));
    let (_m, master) = lab.host("bolide:master", usual);
    let (_w, worker) = lab.host("bolide:worker", usual);
    let pin = tls::pins_of_file(&master.ca).expect("a CA")[0];
    let token = Token { pin, secret: [5; 16] };
    let server = tls::open_server_config(&master).expect("usable");
    let newcomer = tls::newcomer_config(token.pin).expect("usable");
    let listen = |config: Arc<ServerConfig>| async move {
        let (near, far) = tokio::io::duplex(1 << 16);
        (near, tokio::spawn(async move { tls::accept_any(far, &config).await.map(|(_, who)| who) }))
    };
    // Whatever address it dials: the token says whom it trusts.
    let (near, far) = listen(server.clone()).await;
    let (_kept, theirs) =
        tls::connect(near, "192.0.2.1", &newcomer, Role::Master).await.expect("the pinned CA's master");
    assert_eq!(theirs.role, Role::Master);
    assert_eq!(far.await.expect("no panic").expect("let in"), None, "it has no identity");
    // One with a certificate is who it is.
    let (near, far) = listen(server.clone()).await;
    let client = tls::client_config(&worker).expect("usable");
    let _kept = tls::connect(near, "127.0.0.1", &client, Role::Master).await.expect("a host of the lab");
    let who = far.await.expect("no panic").expect("let in").expect("a worker");
    assert_eq!(who.role, Role::Worker);
    // Another lab's master, and a worker of this one, do not pass for its master.
    let (_o, stranger) = other.host("bolide:master", usual);
    // The same CA's certificate to the byte: this harness signs it anew for each host.
    let worker = Paths { ca: master.ca.clone(), ..worker };
    for (paths, words) in
        [(&stranger, "from another CA than"), (&worker, "is for a worker, expected a master")]
    {
        let (near, _far) = listen(tls::open_server_config(paths).expect("usable")).await;
        let text = match tls::connect(near, "127.0.0.1", &newcomer, Role::Master).await {
            Ok(_) => panic!("{words}: trusted"),
            Err(error) => error.to_string(),
        };
        assert!(text.contains(words), "{text}");
    }
    // Where newcomers are not let in it is turned away.
    let (near, far) = listen(tls::server_config(&master).expect("usable")).await;
    let _ = tls::connect(near, "127.0.0.1", &newcomer, Role::Master).await;
    assert!(far.await.expect("no panic").is_err());
}

#[tokio::test]
async fn a_certificate_that_expires_or_is_revoked_ends_the_link_that_it_made_with_the_reason() {
    let lab = Authority::new("lab");
    let (_m, master) = lab.host("bolide:master", usual);
    let soon = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970");
    let soon = date_time_ymd(1970, 1, 1) + Duration::from_secs(soon.as_secs() + 3);
    let (_s, short) = lab.host("bolide:worker", |params| params.not_after = soon);
    let (_w, worker) = lab.host("bolide:worker", usual);
    let server = tls::server_config(&master).expect("usable");
    for (paths, words) in [(&short, "worker \"pc-1\" has expired"), (&worker, "worker \"pc-1\" was revoked")]
    {
        let client = tls::client_config(paths).expect("usable");
        let (near, far) = meet(&client, "127.0.0.1", &server).await;
        let ((near, _), (far, identity)) = (near.expect("dialled"), far.expect("accepted"));
        let (_kept, mut heard) = split(near, Settings::default());
        let (sender, mut receiver) = split(far, Settings::default());
        let (news, revoked) = tokio::sync::watch::channel(Arc::default());
        assert_eq!(identity.fault(Some(&revoked), std::time::SystemTime::now()), None, "good so far");
        let fingerprint = identity.fingerprint.clone();
        tls::watch(&sender, identity, Some(revoked));
        if words.contains("revoked") {
            news.send_replace(Arc::new([fingerprint].into()));
        }
        let told = tokio::time::timeout(Duration::from_secs(30), heard.receive()).await.expect("in time");
        let told = protocol::handshake::reason(&told.expect("a last word")).expect("a reason");
        assert!(told.contains(words), "{told}");
        let ended = receiver.receive().await.expect_err("ended").to_string();
        assert!(ended.contains(words) || ended == "connection closed", "{ended}");
    }
}

#[tokio::test]
async fn a_peer_that_hangs_up_on_tls_may_run_without_certificates() {
    let (_f, paths) = Authority::new("lab").host("bolide:worker", usual);
    let client = tls::client_config(&paths).expect("usable");
    let (near, mut far) = tokio::io::duplex(4096);
    let hang_up = async move {
        let mut said = [0; 16];
        tokio::io::AsyncReadExt::read_exact(&mut far, &mut said).await.expect("a greeting");
    };
    let (told, ()) = tokio::join!(tls::connect(near, "127.0.0.1", &client, Role::Master), hang_up);
    let text = told.expect_err("nobody there").to_string();
    assert!(text.ends_with("in the middle; it may run without certificates"), "{text}");
}

#[tokio::test]
async fn a_caller_without_certificates_hears_that_the_peer_speaks_tls() {
    let (near, mut far) = tokio::io::duplex(4096);
    let (_sender, mut receiver) = split(near, Settings::default());
    // The alert of a server that read no greeting of TLS.
    tokio::io::AsyncWriteExt::write_all(&mut far, &[0x15, 3, 3, 0, 2, 2, 10]).await.expect("room");
    drop(far);
    let text = receiver.receive().await.expect_err("no frame").to_string();
    assert!(text.contains("speaks TLS") && text.contains("--certs FOLDER"), "{text}");
}
