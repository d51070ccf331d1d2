//! Sessions over links that hold next to nothing, and many workers in one process: the digest does not know.

use std::{
    sync::{Arc, OnceLock, atomic::AtomicBool},
    time::Duration,
};

use deck::model::Model;
use master::{
    connection::Gate,
    daemon::Event,
    drive::{Seat, drive},
    embedded::{self, Sink},
    job::{Action, Hand, Job, Options, Outcome},
};
use protocol::{
    dial,
    handshake::{Hello, Role},
    link::{Settings, split},
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpSocket, TcpStream},
    sync::mpsc,
};
use worker::daemon::compute_pool;

const SMALL: &str = include_str!("../../tests/decks/plates-small.toml");
const PLATES: &str = include_str!("../../deck/examples/plates-free-slip.toml");
/// The longest that a run over links may take.
const DEADLINE: Duration = Duration::from_secs(120);

/// Takes everything and keeps nothing.
struct Nowhere;

impl Sink for Nowhere {
    fn take(&mut self, _: Action) -> Result<(), String> {
        Ok(())
    }
}

fn model(text: &str, cycles: u64) -> Arc<Model> {
    let mut model = deck::read(text, "deck").expect("a good deck");
    model.setup.control.end_cycle = cycles;
    Arc::new(model)
}

fn hands(n: usize) -> Vec<Hand> {
    (0..n).map(|i| Hand { name: format!("worker-{i}"), speed: 1.0 + i as f64, threads: 1 }).collect()
}

fn digest(outcome: &Outcome) -> String {
    assert_eq!(outcome.failure, None);
    assert_eq!(outcome.digest.len(), 32);
    outcome.digest.clone()
}

fn embedded_digest(model: &Arc<Model>, hands: &[Hand]) -> String {
    let (job, first) = Job::new(Arc::clone(model), hands, Options::default(), None).expect("it starts");
    let stop = AtomicBool::new(false);
    let run = embedded::run(job, first, hands.len(), 2, &mut Nowhere, &stop).expect("it runs");
    digest(&run.0)
}

/// Forty cycles of the small deck.
fn small() -> (Arc<Model>, &'static str) {
    static DIGEST: OnceLock<String> = OnceLock::new();
    let model = model(SMALL, 40);
    let digest = DIGEST.get_or_init(|| embedded_digest(&model, &hands(1)));
    (model, digest)
}

/// Runs the small deck, with images on the way, over these pairs of streams: the master's end and the worker's.
async fn run_over<S>(pairs: Vec<(S, S)>)
where
    S: AsyncRead + AsyncWrite + Send + 'static,
{
    let (model, expected) = small();
    let hands = hands(pairs.len());
    let (events, mut heard) = mpsc::channel(16);
    let gate = Arc::new(Gate::new(events, vec![Role::Worker], None, None));
    for (i, ((near, far), hand)) in pairs.into_iter().zip(&hands).enumerate() {
        tokio::spawn(Arc::clone(&gate).serve(near, format!("pair {i}"), None));
        let hello = Hello::new(Role::Worker, &hand.name, hand.speed, 1, "any", i as u64);
        tokio::spawn(async move {
            let (sender, receiver) = split(far, Settings::default());
            let call = dial::greet(sender, receiver, &hello).await.expect("taken in");
            worker::daemon::serve(call, compute_pool(1).expect("threads")).await
        });
    }
    let mut seats: Vec<Seat> = Vec::new();
    while seats.len() < hands.len() {
        match heard.recv().await.expect("the gate stands") {
            Event::Knock { hello, answer, .. } => {
                let place = hands.iter().position(|hand| hand.name == hello.name).expect("one of ours");
                answer.send(Ok(place as u32)).expect("it waits");
            }
            Event::Joined(seat) => seats.push(seat),
            Event::Left { why, .. } => panic!("a worker left: {why}"),
            _ => panic!("no client is here"),
        }
    }
    seats.sort_by(|a, b| a.hand.name.cmp(&b.hand.name));
    let running = tokio::task::spawn_blocking(move || {
        let options = Options { states: true, snapshot_at: Some(17), ..Options::default() };
        let (job, first) = Job::new(model, &hands, options, None).expect("it starts");
        drive(job, first, 1, &seats, &mut Nowhere, &AtomicBool::new(false))
    });
    let ran = tokio::time::timeout(DEADLINE, running).await.expect("nobody waits for the other");
    let (outcome, traffic) = ran.expect("no bug").expect("a sink that takes all");
    assert_eq!(digest(&outcome), expected);
    assert!(traffic.bytes > 1_000_000, "{}", traffic.bytes);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_finishes_over_pipes_of_a_thousand_bytes() {
    run_over((0..3).map(|_| tokio::io::duplex(1024)).collect()).await;
}

/// Two ends of a TCP connection whose buffers in the system are the smallest it has.
async fn tight_pair() -> (TcpStream, TcpStream) {
    let socket = |()| {
        let socket = TcpSocket::new_v4().expect("a socket");
        socket.set_send_buffer_size(4096).expect("a buffer");
        socket.set_recv_buffer_size(4096).expect("a buffer");
        socket
    };
    let listening = socket(());
    listening.bind("127.0.0.1:0".parse().expect("an address")).expect("a port");
    let listener = listening.listen(1).expect("listens");
    let address = listener.local_addr().expect("bound");
    let (far, near) = tokio::join!(socket(()).connect(address), listener.accept());
    (near.expect("taken").0, far.expect("connected"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_finishes_over_sockets_of_four_kilobytes() {
    let mut pairs = Vec::new();
    for _ in 0..3 {
        pairs.push(tight_pair().await);
    }
    run_over(pairs).await;
}

#[test]
fn two_hundred_workers_start_in_one_process_and_give_the_digest_of_one() {
    let model = model(PLATES, 6);
    assert_eq!(model.mesh.n_elements(), 27_000);
    assert_eq!(embedded_digest(&model, &hands(200)), embedded_digest(&model, &hands(1)));
}
