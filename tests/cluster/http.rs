//! The JSON that programs ask a master for: what is refused is told as all that cannot be done.

use std::{
    io::{Read, Write},
    net::TcpStream,
    time::Duration,
};

use tests::cluster::Cluster;

use crate::{BOLIDE, small};

/// The master's page, as a program asks for it.
struct Page {
    address: String,
    token: String,
}

impl Page {
    fn of(cluster: &Cluster) -> Self {
        let line = cluster.master.wait_for("page: http://");
        let line = line.trim_start_matches("page: http://");
        let (address, token) = line.split_once("/?token=").expect("an address and a token");
        Self { address: address.to_owned(), token: token.to_owned() }
    }

    /// Status and JSON of an answer.
    fn ask(&self, method: &str, path: &str, body: &str) -> (u16, serde_json::Value) {
        let Self { address, token } = self;
        let mut asking = TcpStream::connect(address).expect("it is taken");
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nAuthorization: Bearer {token}\r\n\
             Content-Length: {}\r\n\r\n{body}",
            body.len()
        );
        asking.write_all(request.as_bytes()).expect("it is read");
        asking.set_read_timeout(Some(Duration::from_secs(60))).expect("a limit");
        let mut answer = Vec::new();
        asking.read_to_end(&mut answer).expect("an answer");
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let (head, body) = answer.split_once("\r\n\r\n").expect("a head and a body");
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
        (status, serde_json::from_str(body).unwrap_or_else(|e| panic!("{method} {path}: {e}: {answer}")))
    }
}

#[test]
fn jobs_are_listed_and_every_refusal_is_json_with_an_error() {
    let cluster = Cluster::start_with(BOLIDE, false, &["--http", "127.0.0.1:0"], None);
    let page = Page::of(&cluster);
    let deck = std::fs::read_to_string(small()).expect("the deck");
    assert_eq!(page.ask("GET", "/api/jobs", ""), (200, serde_json::json!([])));
    for (method, path, status, words) in [
        ("GET", "/api/jobs/abc", 400, "abc"),
        ("GET", "/api/jobs/7", 404, "no job"),
        ("GET", "/api/job", 404, "no such path"),
        ("DELETE", "/api/jobs", 405, "Method Not Allowed"),
        ("GET", "/api/check", 405, "Method Not Allowed"),
        ("POST", "/api/jobs?cycles=abc", 400, "cycles"),
        ("POST", "/api/jobs?cykles=5", 400, "unknown field `cykles`"),
        ("GET", "/api/jobs/7/history?column=3", 400, "unknown field `column`"),
        ("GET", "/api/jobs/7/surface/0?cutt=x", 400, "unknown field `cutt`"),
        ("POST", "/api/jobs?min_workers=0", 422, "min_workers 0"),
        ("POST", "/api/jobs?min_workers=99999999", 422, "min-workers"),
    ] {
        let (found, answer) = page.ask(method, path, &deck);
        let error = answer["error"].as_str().unwrap_or_default();
        assert!(found == status && error.contains(words), "{method} {path}: {found} {answer}");
    }
    assert_eq!(page.ask("POST", "/api/jobs?min_workers=2&cycles=40", &deck).1["job"], 1);
    let (status, jobs) = page.ask("GET", "/api/jobs", "");
    let of = |key: &str| jobs[0][key].clone();
    assert_eq!((status, of("job"), of("state")), (200, 1.into(), "queued".into()), "{jobs}");
    assert_eq!(of("waits_for"), "2 workers, 0 are idle");
}

#[test]
fn nothing_is_announced_where_the_address_of_the_page_is_taken() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound").to_string();
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = std::process::Command::new(BOLIDE);
    command.args(["master", "--listen", "127.0.0.1:0", "--http", &address]).current_dir(folder.path());
    let said = tests::cluster::said(&mut command);
    assert!(said.code == Some(1) && said.err.contains(&format!("--http {address}: ")), "{said:?}");
    assert_eq!(said.out, "", "{said:?}");
}
