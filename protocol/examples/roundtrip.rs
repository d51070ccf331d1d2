//! Measures a link over loopback TCP: half a round trip of one frame, and megabytes per second.
//!
//! `cargo run --release -p protocol --example roundtrip`; both ends on one thread.

use protocol::frame::{Frame, Header, Kind};
use protocol::link::{Receiver, Sender, Settings, Socket, split};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpStream};

type Fault = Box<dyn std::error::Error>;

/// Half a round trip of `bytes` of payload, the median of five rounds of `times`.
async fn half_round_trip(
    near: &mut (Sender, Receiver),
    far: &mut (Sender, Receiver),
    bytes: usize,
    times: u32,
) -> Result<Duration, Fault> {
    let mut rounds = Vec::new();
    for _ in 0..5 {
        let start = Instant::now();
        let there = async {
            let mut payload = vec![1; bytes];
            for _ in 0..times {
                near.0.send(Frame::new(Header::new(Kind::Cycle), payload))?;
                payload = near.1.receive().await?.payload;
            }
            Ok::<_, protocol::Error>(())
        };
        let back = async {
            for _ in 0..times {
                let frame = far.1.receive().await?;
                far.0.send(frame)?;
            }
            Ok::<_, protocol::Error>(())
        };
        tokio::try_join!(there, back)?;
        rounds.push(start.elapsed() / (2 * times));
    }
    rounds.sort();
    Ok(rounds[2])
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Fault> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let (near, far) = tokio::join!(TcpStream::connect(listener.local_addr()?), listener.accept());
    let (near, far) = (near?, far?.0);
    let near = Socket::new(near)?;
    let far = Socket::new(far)?;
    let (mut near, mut far) = (split(near, Settings::default()), split(far, Settings::default()));
    println!("{:>9}  {:>14}  {:>8}", "bytes", "half trip, us", "MB/s");
    for (bytes, times) in [(8, 20_000), (64 << 10, 4000), (1 << 20, 400), (4 << 20, 100)] {
        let time = half_round_trip(&mut near, &mut far, bytes, times).await?;
        let rate = bytes as f64 / time.as_secs_f64() / 1e6;
        println!("{bytes:>9}  {:>14.1}  {rate:>8.0}", time.as_secs_f64() * 1e6);
    }
    Ok(())
}
