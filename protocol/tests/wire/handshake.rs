//! The greeting's bytes, and every reason to refuse one.

use protocol::frame::{Frame, Header, Kind};
use protocol::handshake::{Client, Hello, Policy, Role, Server, VERSION, Verdict, Welcome, bye, reason};
use protocol::{Error, codec, tls};

fn hello() -> Hello {
    Hello::new(Role::Worker, "pc-1", 1.5, 2, "avx2", 0x0102_0304_0506_0708)
}

fn policy() -> Policy {
    Policy { roles: vec![Role::Worker, Role::Client], ..Policy::default() }
}

const WELCOME: Welcome = Welcome::new(3, 1, 1000);

/// The reason for which a server refuses `frame`, as the client reads it.
fn refusal(policy: Policy, frame: &Frame) -> String {
    match Server::new(policy).apply(frame).expect("the first frame") {
        Verdict::Bad { frame, reason: ours } => {
            let theirs = reason(&frame).expect("a refusal carries its reason");
            assert_eq!(theirs, ours);
            theirs
        }
        Verdict::Good(hello) => panic!("{hello:?} was taken"),
    }
}

/// The same for a greeting that its own sender would not send.
fn refused(change: impl Fn(&mut Hello)) -> String {
    let mut hello = hello();
    change(&mut hello);
    let bytes = codec::encode(&hello).expect("encodes");
    refusal(policy(), &Frame::new(Header::new(Kind::Hello), bytes))
}

#[test]
fn greeting_has_its_golden_bytes() {
    let (_, frame) = Client::new(&hello()).expect("a good greeting");
    #[rustfmt::skip]
    let golden = [
        22, 0,                                           // version
        0, 0, 0, 0,                                      // worker
        4, 0, 0, 0, 0, 0, 0, 0, b'p', b'c', b'-', b'1',  // name
        0, 0, 0, 0, 0, 0, 0xf8, 0x3f,                    // speed 1.5
        2, 0, 0, 0,                                      // threads
        4, 0, 0, 0, 0, 0, 0, 0, b'a', b'v', b'x', b'2',  // lanes
        8, 7, 6, 5, 4, 3, 2, 1,                          // nonce
        0,                                               // no token
        0, 0,                                            // takes no peers
        0,                                               // no place in a job
        0,                                               // no proof
        0, 0, 0, 0, 0, 0, 0, 0,                          // does not say what memory it has
        0,                                               // does not divide
        0, 0, 0, 0, 0, 0, 0, 0,                          // names no region
        0,                                               // stays on TCP
    ];
    assert_eq!(frame.payload, golden);
    assert_eq!(frame.header, Header::new(Kind::Hello));
}

#[test]
fn welcome_has_its_golden_bytes() {
    let mut server = Server::new(policy());
    let (_, frame) = Client::new(&hello()).expect("a good greeting");
    server.apply(&frame).expect("the first frame");
    let frame = server.welcome(WELCOME).expect("greeted");
    assert_eq!(frame.payload, [3, 0, 0, 0, 1, 0, 0, 0, 0xe8, 3, 0, 0, 0]);
}

#[test]
fn greeting_and_welcome_bring_both_sides_to_the_end() {
    let mut server = Server::new(policy());
    let (mut client, first) = Client::new(&hello()).expect("a good greeting");
    assert_eq!(server.apply(&first), Ok(Verdict::Good(hello())));
    let answer = server.welcome(WELCOME).expect("greeted");
    assert_eq!(client.apply(&answer), Ok(WELCOME));
    // Nothing may follow.
    let state = |event| Error::State { state: "done", event };
    assert_eq!(client.apply(&answer), Err(state("a welcome")));
    assert_eq!(server.apply(&first), Err(state("another greeting")));
    assert_eq!(server.welcome(WELCOME), Err(state("a welcome")));
    assert_eq!(server.refuse("late"), Err(state("a refusal")));
}

#[test]
fn nobody_is_welcome_before_a_greeting() {
    let waiting = Error::State { state: "waiting", event: "a welcome" };
    assert_eq!(Server::new(policy()).welcome(WELCOME), Err(waiting));
}

#[test]
fn another_version_is_refused_whatever_follows_it() {
    let next = VERSION + 1;
    let reason =
        format!("protocol version {next}, this side speaks {VERSION}; install the same release on both");
    assert_eq!(refused(|hello| hello.version = next), reason);
    let garbage = vec![next as u8, 0, 0xff];
    assert_eq!(refusal(policy(), &Frame::new(Header::new(Kind::Hello), garbage)), reason);
    let error = Client::new(&Hello { version: next, ..hello() }).expect_err("not ours");
    assert_eq!(error, Error::Message(reason));
}

#[test]
fn greetings_with_bad_values_are_refused_with_both_values() {
    for speed in [f64::NAN, f64::INFINITY, 0.0, -1.0, 9e-7, 1_000_001.0] {
        let reason = format!("speed {speed}, must be from 1e-6 to 1e6");
        assert_eq!(refused(|hello| hello.speed = speed), reason);
    }
    let (long, rule) = ("x".repeat(65), "must be 1 to 64 letters, digits, - _ or .");
    assert_eq!(refused(|hello| hello.name.clear()), format!("name \"\" of 0 bytes, {rule}"));
    assert_eq!(refused(|hello| hello.name = "a\nb".into()), format!("name \"a\\nb\" of 3 bytes, {rule}"));
    let shown = &long[..64];
    assert_eq!(refused(|hello| hello.name = long.clone()), format!("name {shown:?} of 65 bytes, {rule}"));
    assert!(refused(|hello| hello.lanes = "../..".into()).starts_with("lanes \"../..\" of 5 bytes"));
    assert!(
        refused(|hello| hello.region = "two floors".into()).starts_with("region \"two floors\" of 10 bytes")
    );
    assert_eq!(refused(|hello| hello.threads = 0), "0 threads, must be 1 to 4096");
    assert_eq!(refused(|hello| hello.threads = 4097), "4097 threads, must be 1 to 4096");
    let long = || Some("x".repeat(129));
    assert_eq!(refused(|hello| hello.token = long()), "token of 129 bytes, must have at most 128");
}

#[test]
fn frames_that_are_no_greeting_are_refused() {
    let frame = Frame::new(Header::new(Kind::Cycle), Vec::new());
    assert_eq!(refusal(policy(), &frame), "first frame is cycle, expected hello");
    let (_, mut frame) = Client::new(&hello()).expect("a good greeting");
    frame.payload.push(0);
    let reason = refusal(policy(), &frame);
    assert_eq!(reason, "hello: message of 73 bytes in a payload of 74");
    for length in 0..frame.payload.len() - 1 {
        let cut = Frame::new(frame.header, frame.payload[..length].to_vec());
        assert!(refusal(policy(), &cut).starts_with("hello: control message: "), "{length} bytes");
    }
}

#[test]
fn roles_answer_to_the_policy_and_to_the_certificate() {
    let greeting = |role| Client::new(&Hello { role, ..hello() }).expect("a good greeting").1;
    let named = |name: &str| Policy { name: Some(name.into()), ..policy() };
    for (name, certificate, good) in [
        ("pc1", "pc1", true),
        ("pc1@4711", "pc1", true),
        ("pc2", "pc1", false),
        ("pc1-2", "pc1", false),
        ("pc2@pc1", "pc1", false),
    ] {
        let greeting = Hello::new(Role::Worker, name, 1.0, 1, "scalar", 1);
        let (_, frame) = Client::new(&greeting).expect("a good name");
        let verdict = Server::new(named(certificate)).apply(&frame).expect("the first frame");
        match verdict {
            Verdict::Good(_) => assert!(good, "{name} with the certificate of {certificate}"),
            Verdict::Bad { reason, .. } => {
                assert!(!good && reason.contains("the certificate is of \"pc1\""), "{reason}");
            }
        }
    }
    for bad in ["@x", "pc1@", "a@b@c"] {
        assert!(Client::new(&Hello::new(Role::Worker, bad, 1.0, 1, "scalar", 1)).is_err(), "{bad}");
    }
    let certified = |certificate| Policy { certificate: Some(certificate), ..policy() };
    assert_eq!(refusal(policy(), &greeting(Role::Peer)), "role peer, this side takes worker and client");
    assert_eq!(
        refusal(certified(tls::Role::Client), &greeting(Role::Worker)),
        "role worker, the certificate is for a client"
    );
    assert_eq!(
        refusal(certified(tls::Role::Worker), &greeting(Role::Client)),
        "role client, the certificate is for a worker"
    );
    for (certificate, role) in [
        (tls::Role::Worker, Role::Worker),
        (tls::Role::Client, Role::Client),
        (tls::Role::Master, Role::Worker),
    ] {
        let verdict = Server::new(certified(certificate)).apply(&greeting(role));
        assert!(matches!(verdict, Ok(Verdict::Good(hello)) if hello.role == role));
    }
    assert!(Role::Peer.is_certified_by(tls::Role::Worker) && !Role::Peer.is_certified_by(tls::Role::Client));
}

#[test]
fn a_token_that_is_asked_for_must_be_the_same() {
    let asked = || Policy { token: Some("open".into()), ..policy() };
    for (token, good) in [(None, false), (Some("opem"), false), (Some("opens"), false), (Some("open"), true)]
    {
        let hello = Hello { token: token.map(String::from), ..hello() };
        let (_, frame) = Client::new(&hello).expect("a good greeting");
        if good {
            assert_eq!(Server::new(asked()).apply(&frame), Ok(Verdict::Good(hello)));
        } else {
            assert_eq!(refusal(asked(), &frame), "token missing or wrong");
        }
    }
}

#[test]
fn the_owner_may_refuse_a_good_greeting() {
    let mut server = Server::new(policy());
    let (mut client, first) = Client::new(&hello()).expect("a good greeting");
    server.apply(&first).expect("the first frame");
    let frame = server.refuse("host \"pc-1\" is here already,\nwith nonce 7").expect("greeted");
    let reason = "host \"pc-1\" is here already, with nonce 7".to_owned();
    assert_eq!(client.apply(&frame), Err(Error::Refused { reason }));
    assert!(matches!(client.apply(&frame), Err(Error::State { state: "refused", .. })));
}

#[test]
fn answers_that_are_none_are_errors() {
    let dial = || Client::new(&hello()).expect("a good greeting").0;
    let cycle = Frame::new(Header::new(Kind::Cycle), Vec::new());
    let expected = "welcome or refuse";
    assert_eq!(dial().apply(&cycle), Err(Error::Unexpected { found: Kind::Cycle, expected }));
    for (welcome, words) in [
        (Welcome { incarnation: 0, ..WELCOME }, "welcome with incarnation 0, must be 1 or more"),
        (Welcome { heartbeat_ms: 0, ..WELCOME }, "heartbeat of 0 ms, must be within 10..=60000"),
    ] {
        let bytes = codec::encode(&welcome).expect("encodes");
        let answer = dial().apply(&Frame::new(Header::new(Kind::Welcome), bytes));
        assert_eq!(answer, Err(Error::Message(words.into())));
    }
}

#[test]
fn reasons_are_one_short_line() {
    let frame = bye(&"job 4\r\nis over ".repeat(100)).expect("any reason");
    let text = reason(&frame).expect("a reason");
    assert_eq!(text.chars().count(), 500);
    assert!(text.starts_with("job 4  is over job 4"));
    assert!(matches!(
        reason(&Frame::new(Header::new(Kind::Hello), Vec::new())),
        Err(Error::Unexpected { .. })
    ));
}
