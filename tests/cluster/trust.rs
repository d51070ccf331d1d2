//! Nobody gets in: tokens, revocation, arithmetic, and connections that say nothing or garbage.

use std::{
    io::{Read, Write},
    net::TcpStream,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use protocol::{
    codec,
    frame::{Frame, Header, Kind, encode_header},
    handshake::{Hello, Role, reason},
};
use tests::cluster::{Cluster, Process, Said, said};

use crate::{BOLIDE, digest_of, reference, run, small};

/// Cycles of the job that is under way while a certificate is revoked: nearly all of the deck, and a master looks once a second.
const CYCLES: &str = "40000";

fn bolide(folder: &Path, arguments: &[&str]) -> Said {
    said(Command::new(BOLIDE).args(arguments).current_dir(folder))
}

/// A lab whose master takes newcomers: its folder, the master, and what it printed.
struct Lab {
    folder: tempfile::TempDir,
    master: Process,
    address: String,
}

impl Lab {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder for the test");
        for arguments in [
            vec!["certs", "ca", "lab"],
            vec!["certs", "host", "lab", "master", "--role", "master"],
            vec!["certs", "host", "lab", "me", "--role", "client"],
        ] {
            let made = bolide(folder.path(), &arguments);
            assert_eq!(made.code, Some(0), "{made:?}");
        }
        let (master, address) = Self::master(folder.path(), "127.0.0.1:0");
        Self { folder, master, address }
    }

    fn master(folder: &Path, listen: &str) -> (Process, String) {
        let mut command = Command::new(BOLIDE);
        command.args(["master", "--listen", listen, "--certs", "lab/master", "--lab", "lab"]);
        let master = Process::start("master", command.current_dir(folder).env("BOLIDE_LOG", "info"));
        let address = master.wait_for("listening on ").trim_start_matches("listening on ").to_owned();
        (master, address)
    }

    /// The words of the line to paste that the master printed.
    fn pasted(&self) -> Vec<String> {
        let line = self.master.wait_for("a new PC joins with: ");
        let line = line.trim_start_matches("a new PC joins with: bolide ");
        line.split(' ').map(str::to_owned).collect()
    }

    /// The line, pasted on the PC `name`.
    fn paste(&self, name: &str, line: &[String]) -> Process {
        let pc = self.folder.path().join(name);
        std::fs::create_dir_all(&pc).expect("room");
        let mut command = Command::new(BOLIDE);
        command.args(line).args(["--name", name, "--threads", "1"]);
        Process::start(name, command.current_dir(pc).env("BOLIDE_LOG", "info"))
    }

    fn client(&self, arguments: &[&str]) -> Said {
        let mut command = Command::new(BOLIDE);
        command.args(arguments).args(["--master", &self.address, "--certs", "lab/me"]);
        said(command.current_dir(self.folder.path()))
    }
}

#[test]
fn one_pasted_line_takes_a_bare_pc_in_and_serves_no_second_one() {
    let mut lab = Lab::start();
    let line = lab.pasted();
    let first = lab.paste("pc-1", &line);
    lab.master.wait_for("worker pc-1 joined");
    assert!(lab.folder.path().join("pc-1/bolide-certs/host-key.pem").is_file());
    let mut second = lab.paste("pc-2", &line);
    assert_eq!(second.wait().code(), Some(1));
    second.wait_for("the token was used before; ask for another with `bolide certs token`");
    // A master that starts anew remembers that; the first PC comes back by itself, with the same line or without.
    lab.master.kill();
    let (master, _) = Lab::master(lab.folder.path(), &lab.address);
    lab.master = master;
    let mut third = lab.paste("pc-3", &line);
    assert_eq!(third.wait().code(), Some(1));
    third.wait_for("the token was used before");
    lab.master.wait_for("worker pc-1 joined");
    drop(first);
    let again = lab.paste("pc-1", &line);
    again.wait_for("joined");
    // Another token is another place, for a role of its own: a client's certificate computes nothing.
    let token =
        bolide(lab.folder.path(), &["certs", "token", "lab", "--role", "client", "--master", &lab.address]);
    let words: Vec<&str> = token.out.trim().split(' ').skip(1).collect();
    let joined = bolide(lab.folder.path(), &words);
    assert_eq!(joined.code, Some(0), "{joined:?}");
    let listed = bolide(lab.folder.path(), &["hosts", "--master", &lab.address, "--certs", "bolide-certs"]);
    assert!(listed.out.contains("pc-1"), "{listed:?}");
    let worker = ["worker", "--master", &lab.address, "--certs", "bolide-certs"];
    let refused = bolide(lab.folder.path(), &worker);
    assert!(refused.err.contains("role worker, the certificate is for a client"), "{refused:?}");
    // A worker's certificate submits nothing.
    let refused =
        bolide(lab.folder.path(), &["jobs", "--master", &lab.address, "--certs", "pc-1/bolide-certs"]);
    assert!(refused.err.contains("role client, the certificate is for a worker"), "{refused:?}");
}

#[test]
fn a_token_of_another_lab_finds_no_master_and_a_guessed_one_no_certificate() {
    let (lab, other) = (Lab::start(), Lab::start());
    let mut line = lab.pasted();
    let theirs = other.pasted();
    let token = line.len() - 1;
    line[token].clone_from(&theirs[token]);
    let mut wrong = lab.paste("pc-1", &line);
    assert_eq!(wrong.wait().code(), Some(1));
    wrong.wait_for("is from another CA");
    let right = &lab.pasted()[token];
    line[token] = format!("{}{}", &right[..right.len() - 4], "0000");
    let mut guessed = lab.paste("pc-2", &line);
    assert_eq!(guessed.wait().code(), Some(1));
    guessed.wait_for("this lab did not issue the token");
}

#[test]
fn a_revoked_worker_is_cut_off_in_mid_run_and_the_others_finish_with_the_same_digest() {
    let lab = Lab::start();
    let line = lab.pasted();
    let mut first = lab.paste("pc-1", &line);
    lab.master.wait_for("worker pc-1 joined");
    let token = bolide(lab.folder.path(), &["certs", "token", "lab", "--master", &lab.address]);
    let line: Vec<String> = token.out.trim().split(' ').skip(1).map(str::to_owned).collect();
    let second = lab.paste("pc-2", &line);
    second.wait_for("joined");
    let submit = ["submit", &small(), "--cycles", CYCLES, "--no-output", "--min-workers", "2"];
    assert_eq!(lab.client(&submit).code, Some(0));
    lab.master.wait_for("job starts");
    let revoked = bolide(lab.folder.path(), &["certs", "revoke", "lab", "pc-1"]);
    assert!(revoked.out.starts_with("revoked 1 of pc-1"), "{revoked:?}");
    lab.master.wait_for("the certificate of worker \"pc-1\" was revoked");
    first.wait_for("the certificate of worker \"pc-1\" was revoked");
    // It dials again, and is refused by name.
    assert_eq!(first.wait().code(), Some(1));
    let watched = lab.client(&["watch", "1", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&watched.out).expect("a summary");
    assert_eq!(digest_of(&summary), digest_of(&run(&["--cycles", CYCLES])));
    assert_eq!(summary["losses"].as_array().map(Vec::len), Some(1), "{summary}");
}

#[test]
fn another_user_of_the_pc_is_nobody_to_a_master_on_loopback() {
    if tests::faults::stuck::another_user(BOLIDE.as_ref()).is_none() {
        println!("skipped: only root may be another user");
    }
}

#[test]
fn a_token_may_come_from_a_file() {
    let lab = Lab::start();
    let mut line = lab.pasted();
    let token = line.pop().expect("a token");
    let path = lab.folder.path().join("token");
    std::fs::write(&path, token + "\n").expect("room");
    line.push(format!("@{}", path.display()));
    let _first = lab.paste("pc-1", &line);
    lab.master.wait_for("worker pc-1 joined");
}

/// Sends a greeting as it stands, gives the refusal.
fn greet(address: &str, hello: &Hello) -> String {
    let mut frame = Frame::new(Header::new(Kind::Hello), codec::encode(hello).expect("plain"));
    frame.seal().expect("short");
    let mut stream = TcpStream::connect(address).expect("the master listens");
    stream.write_all(&encode_header(&frame.header)).expect("it reads");
    stream.write_all(&frame.payload).expect("it reads");
    let mut bytes = Vec::new();
    // The end may be a reset; what was said before counts.
    let _ = stream.read_to_end(&mut bytes);
    let head: [u8; protocol::frame::HEADER_LEN] =
        bytes[..protocol::frame::HEADER_LEN].try_into().expect("a frame");
    let header = protocol::frame::decode_header(&head).expect("a header");
    reason(&Frame::new(header, bytes[head.len()..].to_vec())).expect("a reason")
}

#[test]
fn a_worker_whose_arithmetic_is_another_is_refused_with_both_digests() {
    let cluster = Cluster::start(BOLIDE, false);
    let ours = mechanics::proof::of_this_machine();
    let mut hello = Hello::new(Role::Worker, "odd", 1.0, 1, "scalar", 3);
    let refused = greet(&cluster.address, &hello);
    assert!(
        refused.contains("worker odd: its arithmetic gives no proof") && refused.contains(&ours),
        "{refused}"
    );
    hello.proof = Some("0123456789abcdef0123456789abcdef".to_owned());
    let refused = greet(&cluster.address, &hello);
    assert!(refused.contains("gives 0123456789abcdef") && refused.contains(&ours), "{refused}");
    cluster.master.wait_for("keep this processor out");
}

/// Largest memory that a process has had (kB).
fn peak_memory(id: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).expect("it runs");
    let line = status.lines().find(|line| line.starts_with("VmHWM")).expect("Linux says so");
    line.split_whitespace().nth(1).and_then(|kb| kb.parse().ok()).expect("a number")
}

#[test]
fn two_hundred_connections_of_silence_and_garbage_cost_bounded_memory_and_no_bit() {
    let mut cluster = Cluster::start(BOLIDE, true);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    assert_eq!(cluster.json(&["submit", &small(), "--cycles", "40", "--no-output"])["job"], 1);
    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), reference());
    let before = peak_memory(cluster.master.id());
    let started = Instant::now();
    let mut strangers: Vec<TcpStream> = (0..200_u8)
        .map(|i| {
            let mut stream = TcpStream::connect(&cluster.address).expect("the master listens");
            match i % 4 {
                0 | 1 => {}
                2 => stream.write_all(&[i; 4096]).expect("room"),
                // The beginning of a TLS record that promises more.
                _ => stream.write_all(&[22, 3, 1, 0x40, 0, 1, 0, 0x3f, 0xfc, 3, 3, i]).expect("room"),
            }
            stream
        })
        .collect();
    let submit = ["submit", &small(), "--cycles", "60", "--no-output", "--min-workers", "2"];
    assert_eq!(cluster.json(&submit)["job"], 2);
    assert_eq!(digest_of(&cluster.json(&["watch", "2"])), digest_of(&run(&["--cycles", "60"])));
    let grown = peak_memory(cluster.master.id()) - before;
    println!("200 strangers: master's peak memory grew by {grown} kB");
    assert!(grown < 100_000, "{grown} kB");
    // All are turned away in time: nothing holds a place for longer than a handshake and a greeting.
    for stream in &mut strangers {
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a socket");
        // A reset is an end as well; a timeout is none.
        if let Err(error) = stream.read_to_end(&mut Vec::new()) {
            assert_ne!(
                error.kind(),
                std::io::ErrorKind::WouldBlock,
                "still held after {:?}",
                started.elapsed()
            );
        }
    }
    assert!(cluster.master.is_alive());
}

/// Sends a request of a browser to the page; gives its answer.
fn get(address: &str, path: &str, more: &str) -> String {
    let mut asking = TcpStream::connect(address).expect("it is taken");
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n{more}\r\n");
    asking.write_all(request.as_bytes()).expect("it is read");
    asking.set_read_timeout(Some(Duration::from_secs(60))).expect("a limit");
    let mut answer = Vec::new();
    asking.read_to_end(&mut answer).expect("an answer");
    String::from_utf8_lossy(&answer).into_owned()
}

/// Browsers send a cookie to every port of an address, so that a server of another user on this PC would get one that goes with `/`.
#[test]
fn the_cookie_of_the_page_goes_with_a_random_path_alone_and_the_page_works_below_it() {
    let cluster = Cluster::start_with(BOLIDE, false, &["--http", "127.0.0.1:0"], None);
    let line = cluster.master.wait_for("page: http://");
    let (address, query) =
        line.trim_start_matches("page: http://").split_once('/').expect("an address and a token");
    let token = query.trim_start_matches("?token=");

    let opened = get(address, &format!("/{query}"), "");
    let header = |name: &str| {
        let line = opened.lines().find(|line| line.to_lowercase().starts_with(&format!("{name}: ")));
        line.unwrap_or_else(|| panic!("no {name} in {opened}"))[name.len() + 2..].to_owned()
    };
    let (path, cookie) = (header("location"), header("set-cookie"));
    assert!(path.len() == 34 && path.starts_with('/') && path.ends_with('/'), "{path}");
    assert!(cookie.contains(&format!("; Path={path};")), "{cookie}");
    assert!(!path.contains(token), "the path does not tell the token");

    let cookie = format!("Cookie: {}\r\n", cookie.split(';').next().expect("a name and a value"));
    let page = get(address, &path, &cookie);
    assert!(page.starts_with("HTTP/1.1 200"), "{page}");
    // Whatever the page asks for stands below its path, where the cookie goes with it.
    for attribute in ["href=\"/", "src=\"/"] {
        assert!(!page.contains(attribute), "{page}");
    }
    for name in ["main.js", "lists.js", "style.css", "icon.svg", "api/overview"] {
        let answer = get(address, &format!("{path}{name}"), &cookie);
        assert!(answer.starts_with("HTTP/1.1 200"), "{name}: {answer}");
        assert!(!answer.contains("'/api/") && !answer.contains("from '/"), "{name}: {answer}");
    }
    assert!(get(address, &path, "").starts_with("HTTP/1.1 401"), "the path alone opens nothing");
    let bearer = format!("Authorization: Bearer {token}\r\n");
    assert!(get(address, "/api/overview", &bearer).starts_with("HTTP/1.1 200"), "programs need no path");
}
