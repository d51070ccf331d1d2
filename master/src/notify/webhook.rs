//! WEBHOOK: JSON that is posted when something is over. Its `text` is what Slack, Mattermost and Rocket.Chat show; the other fields are
//! for programs.

use std::{io::ErrorKind, sync::Arc, time::Duration};

use rustls::crypto::ring;
use serde::Serialize;
use ureq::{
    Agent,
    http::Uri,
    tls::{Certificate, RootCerts, TlsConfig},
};

use super::Over;
use crate::machine::host_name;

/// The longest that one try may take.
const LIMIT: Duration = Duration::from_secs(10);
/// Before a second and a third try (s).
const WAITS: [u64; 2] = [1, 4];

/// What is posted.
#[derive(Serialize)]
struct Post<'a> {
    text: String,
    job: &'a str,
    state: &'a str,
    folder: String,
    reason: &'a str,
    host: String,
}

/// Reads an address.
///
/// # Errors
/// If it is none of http or https.
pub fn url(text: &str) -> Result<String, String> {
    match text.parse::<Uri>() {
        Ok(uri) if uri.host().is_some() && matches!(uri.scheme_str(), Some("http" | "https")) => {
            Ok(text.to_owned())
        }
        _ => Err("expected an address such as https://chat.example.com/hooks/7".to_owned()),
    }
}

/// Posts; tries again where the network or the server may be better in a moment.
///
/// # Errors
/// What the last try came to. Of the address it names the host alone: the rest is what others must not know.
pub fn post(url: &str, over: &Over) -> Result<(), String> {
    let text = if over.reason.is_empty() { over.line() } else { format!("{}: {}", over.line(), over.reason) };
    let folder = over.folder.as_ref().map(|folder| folder.display().to_string()).unwrap_or_default();
    let post =
        Post { text, job: &over.job, state: over.state, folder, reason: &over.reason, host: host_name() };
    let json = serde_json::to_string(&post).map_err(|error| format!("--webhook: {error}"))?;
    let agent = agent();
    let mut waits = WAITS.iter();
    loop {
        let sent = agent.post(url).header("Content-Type", "application/json").send(&json);
        let Err(error) = sent else { return Ok(()) };
        match waits.next().filter(|_| may_pass(&error)) {
            Some(wait) => std::thread::sleep(Duration::from_secs(*wait)),
            None => {
                let host = url.parse::<Uri>().ok().and_then(|uri| uri.host().map(str::to_owned));
                return Err(format!("--webhook of {}: {error}", host.unwrap_or_default()));
            }
        }
    }
}

/// Whether it is worth another try: what the server has refused it refuses again, and a certificate stays what it is.
fn may_pass(error: &ureq::Error) -> bool {
    match error {
        ureq::Error::StatusCode(code) => *code == 429 || *code >= 500,
        ureq::Error::Io(error) => error.kind() != ErrorKind::InvalidData,
        ureq::Error::BadUri(_) => false,
        _ => true,
    }
}

/// Trusts whom this host trusts, a CA of the lab's own included.
fn agent() -> Agent {
    let certificates = rustls_native_certs::load_native_certs().certs;
    let trusted = certificates.iter().map(|certificate| Certificate::from_der(certificate).to_owned());
    // Of an address of http too: it may send us on to one of https.
    let tls = TlsConfig::builder()
        .unversioned_rustls_crypto_provider(Arc::new(ring::default_provider()))
        .root_certs(RootCerts::Specific(Arc::new(trusted.collect())))
        .build();
    Agent::config_builder().timeout_global(Some(LIMIT)).tls_config(tls).build().into()
}

#[cfg(test)]
mod tests {
    use std::{
        io::{BufRead, BufReader, Read, Write},
        net::TcpListener,
    };

    use super::*;

    /// Answers one request after the other with these statuses; gives what the last one posted.
    fn server(statuses: &'static [&str]) -> (String, std::thread::JoinHandle<String>) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("loopback");
        let url = format!("http://{}/hooks/secret", listener.local_addr().expect("bound"));
        let answer = move || {
            let mut last = String::new();
            for status in statuses {
                let (stream, _) = listener.accept().expect("a request");
                let mut reader = BufReader::new(&stream);
                let (mut line, mut length) = (String::new(), 0);
                while reader.read_line(&mut line).expect("a head") > 2 {
                    let lower = line.to_lowercase();
                    if let Some(value) = lower.strip_prefix("content-length:") {
                        length = value.trim().parse().expect("a length");
                    }
                    line.clear();
                }
                let mut body = vec![0; length];
                reader.read_exact(&mut body).expect("a body");
                last = String::from_utf8(body).expect("JSON");
                write!(&stream, "HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
                    .expect("an answer");
            }
            last
        };
        (url, std::thread::spawn(answer))
    }

    fn over() -> Over {
        Over {
            job: "7".to_owned(),
            title: "job 7 (plate.toml)".to_owned(),
            state: "failed",
            folder: Some("/tmp/x".into()),
            reason: "no \"disk\"".to_owned(),
        }
    }

    #[test]
    fn it_is_posted_again_after_an_error_of_the_server() {
        let (url, posted) = server(&["503 Busy", "200 OK"]);
        assert_eq!(post(&url, &over()), Ok(()));
        let json: serde_json::Value = serde_json::from_str(&posted.join().expect("served")).expect("JSON");
        let text = format!("bolide: job 7 (plate.toml) is failed on {}: no \"disk\"", host_name());
        let expected = serde_json::json!({
            "text": text, "job": "7", "state": "failed", "folder": "/tmp/x", "reason": "no \"disk\"", "host": host_name()
        });
        assert_eq!(json, expected);
    }

    #[test]
    fn a_refusal_is_final_and_its_error_has_no_secret() {
        let (url, posted) = server(&["404 Not Found"]);
        let error = post(&url, &over()).expect_err("it was refused");
        assert_eq!(error, "--webhook of 127.0.0.1: http status: 404");
        posted.join().expect("served once");
    }

    #[test]
    fn an_address_is_one_of_http() {
        for bad in ["chat.example.com", "ftp://x/y", "https://", "http://a b", "/hooks/7", ""] {
            assert!(url(bad).is_err(), "{bad}");
        }
        assert!(url("https://chat.example.com/hooks/7?x=1").is_ok());
    }
}
