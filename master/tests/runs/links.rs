//! Sessions over links that hold next to nothing, and many workers in one process: the digest does not know.

use std::{
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use deck::model::Model;
use master::{
    connection::Acceptor,
    drive::{WorkerLink, channel, drive},
    embedded::{self, Sink},
    event::{Action, Outcome, WorkerSpec},
    job::Job,
    notice::Notice,
    options::SessionOptions,
    snapshot::Snapshot,
};
use protocol::{
    dial,
    handshake::{Hello, Role},
    link::{Settings, split},
    options::{JobOptions, Route},
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpSocket, TcpStream},
    sync::mpsc,
};
use worker::{
    daemon::{Service, compute_pool},
    owner::Share,
    peers::Peers,
    slots::Slot,
};

const PLATES: &str = include_str!("../../../deck/examples/plates-free-slip.toml");
/// The longest that a run over links may take.
const DEADLINE: Duration = Duration::from_secs(120);

/// Cycles of a run over links, long enough for sorts, a state and a snapshot.
const CYCLES: u64 = 30;

/// Keeps the snapshot and nothing else.
#[derive(Default)]
struct Keep(Option<Box<Snapshot>>);

impl Sink for Keep {
    fn take(&mut self, action: Action) -> Result<(), String> {
        if let Action::Snapshot(snapshot) = action {
            assert!(self.0.replace(snapshot).is_none(), "one snapshot was asked for");
        }
        Ok(())
    }
}

fn options(route: Route) -> SessionOptions {
    let asked = JobOptions { route: Some(route), snapshot_at: Some(17), ..JobOptions::default() };
    SessionOptions { asked, ..SessionOptions::default() }
}

fn model(text: &str, cycles: u64) -> Arc<Model> {
    let mut model = deck::read(text, "deck").expect("a good deck");
    model.setup.control.end_cycle = cycles;
    Arc::new(model)
}

fn specs(n: usize) -> Vec<WorkerSpec> {
    (0..n).map(|i| WorkerSpec::new(format!("worker-{i}"), 1.0 + i as f64, 1)).collect()
}

fn digest(outcome: &Outcome) -> String {
    assert_eq!(outcome.failure, None);
    assert_eq!(outcome.digest.len(), 32);
    outcome.digest.clone()
}

fn embedded_run(model: &Arc<Model>, specs: &[WorkerSpec]) -> (String, Option<Box<Snapshot>>) {
    let (job, first) = Job::new(Arc::clone(model), specs, options(Route::Master), None).expect("it starts");
    let (stop, mut sink) = (AtomicBool::new(false), Keep::default());
    let run = embedded::run(job, first, specs.len(), 2, &mut sink, &stop).expect("it runs");
    (digest(&run.0), sink.0)
}

/// Runs the plates over these pairs of streams: the master's end and the worker's. Assignments and states are long
/// enough to travel in bulk, which frames of cycles overtake.
async fn run_over<S>(pairs: Vec<(S, S)>, route: Route)
where
    S: AsyncRead + AsyncWrite + Send + 'static,
{
    let model = model(PLATES, CYCLES);
    let specs = specs(pairs.len());
    let (expected, snapshot) = embedded_run(&model, &specs);
    let (events, mut heard) = mpsc::channel(16);
    let acceptor = Arc::new(Acceptor::new(events, vec![Role::Worker], None, None));
    for (i, ((near, far), spec)) in pairs.into_iter().zip(&specs).enumerate() {
        let mut hello = Hello::new(Role::Worker, &spec.name, spec.speed, 1, "any", i as u64);
        let peers = match route {
            Route::Master => None,
            Route::Direct => {
                // What it accepts has the buffers of what it listens on.
                let listener = tight_socket("127.0.0.1:0").listen(16).expect("listens");
                hello.peer_port = listener.local_addr().expect("bound").port();
                Some(Arc::new(Peers::start(listener, None, None, false).expect("no certificates")))
            }
        };
        tokio::spawn(Arc::clone(&acceptor).serve(near, format!("127.0.0.1:{}", i + 1), None));
        tokio::spawn(async move {
            let (sender, receiver) = split(far, Settings::default());
            let call = dial::greet(sender, receiver, &hello).await.expect("taken in");
            let pool = compute_pool(1).expect("threads");
            worker::daemon::serve(
                call,
                Service {
                    pool,
                    peers,
                    compute: |machine, task, _| machine.run(task),
                    share: Share::default(),
                    slot: Slot::whole(1),
                },
            )
            .await
        });
    }
    let mut worker_links: Vec<WorkerLink> = Vec::new();
    while worker_links.len() < specs.len() {
        match heard.recv().await.expect("the gate stands") {
            Notice::Knock { hello, answer, .. } => {
                let place = specs.iter().position(|spec| spec.name == hello.name).expect("one of ours");
                answer.send(Ok(place as u32)).expect("it waits");
            }
            Notice::Joined(worker_link) => worker_links.push(worker_link),
            Notice::Left { why, .. } => panic!("a worker left: {why}"),
            _ => panic!("no client is here"),
        }
    }
    worker_links.sort_by(|a, b| a.spec.name.cmp(&b.spec.name));
    let running = tokio::task::spawn_blocking(move || {
        let options = options(route);
        let (job, first) = Job::new(model, &specs, options, None).expect("it starts");
        let mut sink = Keep::default();
        let ran = drive(
            job,
            first,
            1,
            &worker_links,
            channel(worker_links.len()),
            &mut sink,
            &AtomicBool::new(false),
        );
        ran.map(|(outcome, traffic)| (outcome, traffic, sink.0))
    });
    let ran = tokio::time::timeout(DEADLINE, running).await.expect("nobody waits for the other");
    let (outcome, traffic, stored) = ran.expect("no bug").expect("a sink that takes all");
    assert_eq!(digest(&outcome), expected);
    assert!(traffic.bytes > 10 << 20, "{}", traffic.bytes);
    assert!(outcome.reports.iter().all(|report| report.relayed.is_empty()));
    let linked = outcome.reports.iter().map(|report| report.linked.len()).sum::<usize>();
    assert_eq!(linked > 0, route == Route::Direct, "{linked}");
    let stored = stored.expect("it was asked for");
    assert_eq!(stored.state.cycle, 17);
    assert!(snapshot.is_some_and(|snapshot| snapshot == stored), "the halves of a snapshot are of one cycle");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_finishes_over_pipes_of_a_thousand_bytes() {
    run_over((0..3).map(|_| tokio::io::duplex(1024)).collect(), Route::Master).await;
}

/// Two ends of a TCP connection whose buffers in the system are the smallest it has.
async fn tight_pair() -> (TcpStream, TcpStream) {
    let listener = tight_socket("127.0.0.1:0").listen(1).expect("listens");
    let address = listener.local_addr().expect("bound");
    let (far, near) = tokio::join!(tight_socket("127.0.0.1:0").connect(address), listener.accept());
    (near.expect("taken").0, far.expect("connected"))
}

fn tight_socket(address: &str) -> TcpSocket {
    let socket = TcpSocket::new_v4().expect("a socket");
    socket.set_send_buffer_size(4096).expect("a buffer");
    socket.set_recv_buffer_size(4096).expect("a buffer");
    socket.bind(address.parse().expect("an address")).expect("a port");
    socket
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_finishes_over_sockets_of_four_kilobytes() {
    let mut pairs = Vec::new();
    for _ in 0..3 {
        pairs.push(tight_pair().await);
    }
    run_over(pairs, Route::Master).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_finishes_over_links_between_workers_of_four_kilobytes() {
    let mut pairs = Vec::new();
    for _ in 0..3 {
        pairs.push(tight_pair().await);
    }
    run_over(pairs, Route::Direct).await;
}

#[test]
fn two_hundred_workers_start_in_one_process_and_give_the_digest_of_one() {
    let model = model(PLATES, 6);
    assert_eq!(model.mesh.n_elements(), 27_000);
    assert_eq!(embedded_run(&model, &specs(200)), embedded_run(&model, &specs(1)));
}
