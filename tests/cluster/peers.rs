//! Peers that break the rules, against a master whose job is under way.

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpStream},
    path::Path,
};

use protocol::{
    codec,
    frame::{Frame, HEADER_LEN, Header, Kind, encode_header},
    handshake::{Hello, Role, VERSION},
};
use tests::cluster::{Cluster, make_certificates, said};

use crate::{BOLIDE, LONG, digest_of, long_reference, small};

fn frame(header: Header, payload: Vec<u8>) -> Vec<u8> {
    let mut frame = Frame::new(header, payload);
    frame.seal().expect("within its limit");
    let mut bytes = encode_header(&frame.header).to_vec();
    bytes.extend(frame.payload);
    bytes
}

/// Sends `bytes`, then nothing more; gives the own address once the master has closed the connection.
fn send(master: &str, bytes: &[u8]) -> String {
    let mut stream = TcpStream::connect(master).expect("the master listens");
    let address = stream.local_addr().expect("connected").to_string();
    // A master that has closed already refuses the rest, or resets.
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(Shutdown::Write);
    let _ = stream.read_to_end(&mut Vec::new());
    address
}

#[test]
fn bad_peers_are_one_line_each_and_the_job_goes_on() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    let submit = ["submit", &small(), "--cycles", LONG, "--no-output", "--min-workers", "2"];
    cluster.json(&submit);
    cluster.wait_until_running(1);

    let wrong = VERSION + 1;
    let version = format!("protocol version {wrong}, this side speaks {VERSION}");
    let hello = Hello { version: wrong, ..Hello::new(Role::Worker, "old", 1.0, 1, "scalar", 1) };
    let old = frame(Header::new(Kind::Hello), codec::encode(&hello).expect("plain"));
    let peer = Hello::new(Role::Peer, "peer", 1.0, 1, "scalar", 1);
    let peer = frame(Header::new(Kind::Hello), codec::encode(&peer).expect("plain"));
    let oversize = encode_header(&Header { length: u32::MAX, ..Header::new(Kind::Hello) });
    let stranger = frame(Header::new(Kind::Cycle), vec![0; 64]);
    let mut damaged = old.clone();
    damaged[HEADER_LEN + 3] ^= 1;
    for (bytes, words) in [
        (old.clone(), version.as_str()),
        (vec![0x55; 400], "frame starts with [55, 55, 55, 55]"),
        (oversize.to_vec(), "hello: length 4294967295, limit 4096"),
        (old[..20].to_vec(), "frame header: ended after 20 bytes, needs 52"),
        (Vec::new(), "connection closed"),
        (peer, "role peer, this side takes worker and client"),
        (stranger, "first frame is cycle, expected hello"),
        (damaged, "hello frame: payload checksum"),
    ] {
        assert_eq!(cluster.job(1)["state"], "running", "the job ended before {words:?}");
        let address = send(&cluster.address, &bytes);
        let line = cluster.master.wait_for(&format!("connection from {address}: "));
        assert!(line.contains(words) && line.contains("WARN"), "{line}, expected {words:?}");
        assert_eq!(cluster.master.count(&address), 1, "{}", cluster.master.text());
    }

    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), long_reference());
    assert!(cluster.master.is_alive());
}

#[test]
fn wrong_certificates_are_one_line_each_and_the_job_goes_on() {
    let mut cluster = Cluster::start(BOLIDE, true);
    cluster.worker("a", "1");
    let other = cluster.folder().join("other");
    make_certificates(Path::new(BOLIDE), &other);
    cluster.json(&["submit", &small(), "--cycles", LONG, "--no-output"]);
    cluster.wait_until_running(1);

    let dial = |certs: &Path| {
        let mut command = std::process::Command::new(BOLIDE);
        command.args(["worker", "--name", "x", "--patience", "0", "--master", &cluster.address]);
        said(command.arg("--certs").arg(certs))
    };
    let running = || assert_eq!(cluster.job(1)["state"], "running");
    let another_ca = dial(&other.join("worker"));
    assert_eq!(another_ca.code, Some(1));
    assert!(another_ca.err.contains("is from another CA than this host's ca.pem"), "{another_ca:?}");
    running();
    let another_role = dial(&cluster.folder().join("certs/client"));
    assert_eq!(another_role.code, Some(1));
    assert!(another_role.err.contains("role worker, the certificate is for a client"), "{another_role:?}");
    running();
    let address = send(&cluster.address, &[0x55; 400]);
    let line = cluster.master.wait_for(&format!("connection from {address}: "));
    assert!(line.contains("the peer does not speak TLS"), "{line}");
    running();
    let plain = said(std::process::Command::new(BOLIDE).args([
        "worker",
        "--patience",
        "0",
        "--master",
        &cluster.address,
    ]));
    assert_eq!(plain.code, Some(1), "{plain:?}");

    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), long_reference());
    for words in [
        "role worker, the certificate is for a client",
        "the peer does not accept this host's certificate: it is from another CA",
    ] {
        assert_eq!(cluster.master.count(words), 1, "{}", cluster.master.text());
    }
    assert_eq!(cluster.master.count("WARN"), 4, "{}", cluster.master.text());
    assert!(cluster.master.is_alive());
}
