//! MESSAGES: half a round trip of one message between two processes, over the link that a run uses.
//!
//! The near process dials and greets as a worker does, then sends a frame, takes it back and counts time; the far
//! one returns whatever it gets. Checksums, queues, heartbeats and (with certificates) TLS are those of any link.

use std::{
    io::{BufRead, BufReader},
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    process::{Child, Command, ExitCode, Stdio},
    sync::Arc,
    time::Instant,
};

use protocol::{
    Error, Result,
    codec::{Assembler, MESSAGE_LIMIT},
    dial::{self, Call, leave},
    frame::{Frame, Header, Kind},
    handshake::{Hello, Policy, Role, Welcome},
    link::{self, Receiver, Sender, Settings, Socket},
    memory::Near,
    tls::{self, ServerConfig},
};
use serde::Serialize;
use tokio::net::{TcpListener, TcpStream};

use crate::{certs, command::MessagesArgs, shell::print};

/// Interval of heartbeats (ms), as everywhere.
const HEARTBEAT_MS: u32 = 1000;

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// How the message travelled: `frame`, one frame as partial forces do, or `bulk`, in chunks as decks and states.
    pub kind: &'static str,
    /// Whether TLS was on.
    pub tls: bool,
    /// Whether it went over memory, within this machine.
    pub memory: bool,
    pub bytes: usize,
    /// Half of a round trip (us), the median of the rounds.
    pub half_round_trip_us: f64,
    /// Bytes by half a round trip (MB/s).
    pub mb_per_s: f64,
}

/// Runs `bench messages`: the far end with `--listen`, the near end otherwise, with a child as the far end unless
/// `--to` names one.
///
/// # Errors
/// If a link cannot be made or ends, or the child does not start.
pub fn run(args: &MessagesArgs) -> std::result::Result<ExitCode, String> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|e| format!("the thread of the link: {e}"))?;
    if let Some(address) = args.listen {
        let far = far_end(address, args.certs.as_deref(), !args.no_shared_memory);
        runtime.block_on(far).map_err(|e| e.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut rows = Vec::new();
    match &args.to {
        Some(to) => rows.extend(runtime.block_on(near_end(to, args)).map_err(|e| e.to_string())?),
        None => {
            // Over memory where there is some, over TCP, and with TLS.
            let may_share = system::shared::IS_THERE && !args.no_shared_memory;
            for (memory, tls) in [(true, false), (false, false), (false, true)] {
                if memory && !may_share {
                    continue;
                }
                let certs = if tls { Some(Certificates::new().map_err(|e| e.to_string())?) } else { None };
                let folder = certs.as_ref().map(|made| made.folder.join("pc"));
                let far = FarEnd::start(folder.as_deref())?;
                let args = MessagesArgs { certs: folder, no_shared_memory: !memory, ..args.clone() };
                rows.extend(runtime.block_on(near_end(&far.address, &args)).map_err(|e| e.to_string())?);
            }
        }
    }
    if args.json {
        print(&serde_json::json!({ "rows": rows }).to_string())?;
    } else {
        print_table(&rows)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print_table(rows: &[Row]) -> std::result::Result<(), String> {
    print(&format!("{:>10}  {:>5}  {:>6}  {:>14}  {:>8}", "bytes", "kind", "way", "half trip (us)", "MB/s"))?;
    for row in rows {
        let way = match (row.memory, row.tls) {
            (true, _) => "memory",
            (false, true) => "TLS",
            (false, false) => "TCP",
        };
        let (half, rate) = (row.half_round_trip_us, row.mb_per_s);
        print(&format!("{:>10}  {:>5}  {way:>6}  {half:>14.2}  {rate:>8.0}", row.bytes, row.kind))?;
    }
    Ok(())
}

/// Round trips that are timed; a tenth as many go before.
const fn trips(bytes: usize) -> u64 {
    match bytes {
        0..=4096 => 1000,
        4097..=0x1_0000 => 500,
        0x1_0001..=0x4_0000 => 200,
        _ => 40,
    }
}

async fn near_end(to: &str, args: &MessagesArgs) -> Result<Vec<Row>> {
    let certificates = dial::certificates(args.certs.as_deref())?;
    let hello = Hello::new(Role::Client, "bench", 1.0, 1, "scalar", worker::random());
    let reached = dial::reach(to, certificates.as_ref()).await?.sharing_memory(!args.no_shared_memory);
    let mut call = reached.greet(&hello).await?;
    let mut rows = Vec::new();
    for kind in [Kind::Cycle, Kind::Bulk] {
        for &bytes in &args.sizes {
            let mut rounds = Vec::new();
            for _ in 0..args.rounds {
                rounds.push(half_round_trip(&mut call, kind, bytes).await?);
            }
            rounds.sort_by(f64::total_cmp);
            let half = rounds[rounds.len() / 2];
            rows.push(Row {
                kind: if kind == Kind::Bulk { "bulk" } else { "frame" },
                tls: certificates.is_some(),
                memory: call.shares_memory,
                bytes,
                half_round_trip_us: 1e6 * half,
                mb_per_s: bytes as f64 / half * 1e-6,
            });
        }
    }
    leave(&call.sender, "measured").await;
    Ok(rows)
}

/// Seconds of half a round trip of `bytes`.
async fn half_round_trip(call: &mut Call, kind: Kind, bytes: usize) -> Result<f64> {
    let times = trips(bytes);
    let mut message = vec![1; bytes];
    let mut start = Instant::now();
    for trip in 0..times / 10 + times {
        if trip == times / 10 {
            start = Instant::now();
        }
        let header = Header { cycle: trip, ..Header::new(kind) };
        give(&call.sender, header, message)?;
        let (back, bytes_back) = take(&mut call.receiver).await?;
        if (back.cycle, bytes_back.len()) != (trip, bytes) {
            let (cycle, length) = (back.cycle, bytes_back.len());
            return Err(Error::Message(format!(
                "message {cycle} of {length} bytes came back, sent was {trip} of {bytes}"
            )));
        }
        message = bytes_back;
    }
    Ok(start.elapsed().as_secs_f64() / (2 * times) as f64)
}

fn give(sender: &Sender, header: Header, message: Vec<u8>) -> Result<()> {
    match header.kind {
        Kind::Bulk => sender.send_bulk(header, 0, message),
        _ => sender.send(Frame::new(header, message)),
    }
}

/// The next message, in whatever it came.
async fn take(receiver: &mut Receiver) -> Result<(Header, Vec<u8>)> {
    let mut assembler = Assembler::new(MESSAGE_LIMIT as u64, 1);
    loop {
        let frame = receiver.receive().await?;
        match frame.header.kind {
            Kind::Cycle => return Ok((frame.header, frame.payload)),
            Kind::Bulk => {
                let whole = assembler.accept(&frame)?;
                receiver.recycle(frame.payload);
                if let Some(message) = whole {
                    return Ok((message.header, message.bytes));
                }
            }
            Kind::Bye => return Err(Error::Closed),
            found => return Err(Error::Unexpected { found, expected: "cycle, bulk or bye" }),
        }
    }
}

/// Listens at `address`, says where on standard output, and returns what the first caller sends.
async fn far_end(address: SocketAddr, certs: Option<&Path>, share_memory: bool) -> Result<()> {
    let config = certs.map(|folder| tls::server_config(&tls::Paths::in_folder(folder))).transpose()?;
    if config.is_none() {
        tls::loopback_only(address)?;
    }
    let fault = |error: std::io::Error| Error::io(format!("listening on {address}"), &error);
    let listener = TcpListener::bind(address).await.map_err(fault)?;
    print(&format!("listening on {}", listener.local_addr().map_err(fault)?)).map_err(Error::Message)?;
    let (stream, _) = listener.accept().await.map_err(fault)?;
    let (sender, mut receiver) = answer(stream, config.as_ref(), share_memory).await?;
    loop {
        let (header, message) = match take(&mut receiver).await {
            Ok(message) => message,
            Err(Error::Closed) => return Ok(()),
            Err(error) => return Err(error),
        };
        give(&sender, header, message)?;
    }
}

async fn answer(
    stream: TcpStream,
    config: Option<&Arc<ServerConfig>>,
    share_memory: bool,
) -> Result<(Sender, Receiver)> {
    let stream = Socket::new(stream)?;
    let near = if share_memory { Near::of(&stream) } else { None };
    let (certificate, (sender, mut receiver)) = match config {
        None => (None, link::split(stream, Settings::default())),
        Some(config) => {
            let (stream, identity) = tls::accept(stream, config).await?;
            (Some(identity.role), link::split(stream, Settings::default()))
        }
    };
    let policy = Policy { roles: vec![Role::Client], certificate, ..Policy::default() };
    let (server, hello) = link::hear(&sender, &mut receiver, policy).await?;
    let welcome = Welcome::new(1, 0, HEARTBEAT_MS);
    link::admit_near(server, &sender, &mut receiver, welcome, &hello, near).await?;
    Ok((sender, receiver))
}

/// A child that listens on loopback; ended with this value.
struct FarEnd {
    child: Child,
    address: String,
}

impl FarEnd {
    fn start(certs: Option<&Path>) -> std::result::Result<Self, String> {
        let binary = std::env::current_exe().map_err(|e| format!("the path of this program: {e}"))?;
        let mut command = Command::new(binary);
        command.args([
            "bench",
            "messages",
            "--listen",
            &SocketAddr::from((Ipv4Addr::LOCALHOST, 0)).to_string(),
        ]);
        if let Some(folder) = certs {
            command.arg("--certs").arg(folder);
        }
        let fault = |e| format!("starting the far end: {e}");
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().map_err(fault)?;
        let said = child.stdout.take();
        let mut far = Self { child, address: String::new() };
        let mut line = String::new();
        if let Some(said) = said {
            BufReader::new(said).read_line(&mut line).map_err(fault)?;
        }
        far.address = match line.trim().strip_prefix("listening on ") {
            Some(address) => address.to_owned(),
            None => return Err(format!("the far end said {line:?}, expected where it listens")),
        };
        Ok(far)
    }
}

impl Drop for FarEnd {
    fn drop(&mut self) {
        // It has ended by itself if all went well.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A CA and one host's certificate in a folder of their own, removed with this value.
struct Certificates {
    folder: PathBuf,
}

impl Certificates {
    fn new() -> std::result::Result<Self, certs::Error> {
        let folder = std::env::temp_dir().join(format!("bolide-bench-{:016x}", worker::random()));
        let made = Self { folder };
        certs::make_ca(&made.folder, false)?;
        certs::make_host(&made.folder, "pc", &[], tls::Role::Master, false)?;
        Ok(made)
    }
}

impl Drop for Certificates {
    fn drop(&mut self) {
        // What cannot be removed is of no use to anybody in a day.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Reads a size that a frame and a bulk message can have.
pub(crate) fn message_size(text: &str) -> std::result::Result<usize, String> {
    let limit = Kind::Cycle.limit() as usize;
    match text.parse() {
        Ok(bytes) if bytes <= limit => Ok(bytes),
        Ok(bytes) => Err(format!("{bytes} bytes, a frame takes at most {limit}")),
        Err(_) => Err(format!("{text:?} is no number of bytes")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::frame::CHUNK;

    #[tokio::test]
    async fn what_a_far_end_gets_comes_back_as_frame_and_as_bulk() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.expect("a port");
        let address = listener.local_addr().expect("bound").to_string();
        let far = async {
            let (stream, _) = listener.accept().await.expect("a caller");
            let (sender, mut receiver) = answer(stream, None, true).await.expect("a greeting");
            loop {
                match take(&mut receiver).await {
                    Ok((header, message)) => give(&sender, header, message).expect("room"),
                    Err(error) => return error,
                }
            }
        };
        let args = MessagesArgs {
            listen: None,
            to: None,
            certs: None,
            sizes: vec![0, 8, CHUNK + 1],
            rounds: 1,
            no_shared_memory: true,
            json: false,
        };
        let (error, rows) = tokio::join!(far, near_end(&address, &args));
        assert_eq!(error, Error::Closed);
        let rows = rows.expect("measured");
        let what: Vec<_> = rows.iter().map(|row| (row.kind, row.bytes, row.tls)).collect();
        let sizes = [0, 8, CHUNK + 1];
        let expected = ["frame", "bulk"].map(|kind| sizes.map(|bytes| (kind, bytes, false))).concat();
        assert_eq!(what, expected);
        assert!(rows.iter().all(|row| row.half_round_trip_us > 0.0));
    }
}
