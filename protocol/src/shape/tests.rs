//! Rates by bytes over paused time: no clock of this machine is asked.

use super::*;
use crate::{
    frame::{Frame, HEADER_LEN, Header, Kind},
    link::{Receiver, Sender, Settings, split},
};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex},
    time::timeout,
};

/// Time over which bytes are counted.
const LONG: Duration = Duration::from_secs(10);

fn rate(text: &str) -> Rate {
    text.parse().expect("a rate")
}

/// Bytes of payload that TCP over Ethernet carries in [`LONG`] at a rate.
fn goodput(rate: Rate) -> f64 {
    rate.bits_per_second() / 8.0 * LONG.as_secs_f64() * SEGMENT as f64 / (SEGMENT + SEGMENT_OVERHEAD) as f64
}

/// Writes as fast as the stream takes it; gives what was read on the other side in [`LONG`].
async fn carried(mut near: Shaped<DuplexStream>, mut far: Shaped<DuplexStream>) -> f64 {
    tokio::spawn(async move { while near.write_all(&[7; 60_000]).await.is_ok() {} });
    let mut count = 0;
    let _ = timeout(LONG, async {
        let mut bytes = vec![0; 100_000];
        while let Ok(n) = far.read(&mut bytes).await
            && n > 0
        {
            assert!(bytes[..n].iter().all(|&b| b == 7));
            count += n;
        }
    })
    .await;
    count as f64
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{found}, expected {expected} within {tolerance}");
}

#[test]
fn rates_are_read_with_and_without_unit() {
    for (text, bits, shown) in [
        ("10mbit", 1e7, "10mbit"),
        ("1gbit", 1e9, "1gbit"),
        ("2.5gbit", 2.5e9, "2.5gbit"),
        ("64kbit", 64e3, "64kbit"),
        ("100000000", 1e8, "100mbit"),
    ] {
        assert_eq!(rate(text).bits_per_second(), bits, "{text}");
        assert_eq!(rate(text).to_string(), shown);
    }
    for (text, words) in [
        ("ten", "no rate"),
        ("10mbps", "no rate"),
        ("1", "outside"),
        ("NaN", "outside"),
        ("-5mbit", "outside"),
    ] {
        let error = text.parse::<Rate>().expect_err(text);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_lane_counts_headers_of_every_packet_and_of_an_empty_message() {
    let wire = Wire { payload: 1000, overhead: 100, ..Wire::ethernet(rate("8mbit")) };
    assert_eq!(wire.wire_bytes(0), 100);
    assert_eq!(wire.wire_bytes(1), 101);
    assert_eq!(wire.wire_bytes(1000), 1100);
    assert_eq!(wire.wire_bytes(1001), 1201);
    assert_eq!(wire.occupation(2000), Duration::from_micros(2200));
}

#[tokio::test(start_paused = true)]
async fn a_lane_grants_time_in_the_order_it_is_asked_and_keeps_no_idle_time() {
    let wire = Wire { payload: 1000, overhead: 0, ..Wire::ethernet(rate("8mbit")) };
    let (lane, now) = (Lane::new(wire), Instant::now());
    let ms = |ms| now + Duration::from_millis(ms);
    assert_eq!(lane.grant(now, 3000), (now, ms(3)));
    assert_eq!(lane.grant(ms(1), 2000), (ms(3), ms(5)));
    assert_eq!(lane.grant(ms(9), 1000), (ms(9), ms(10)));
    assert_eq!(lane.carried(), 6000);
}

#[tokio::test(start_paused = true)]
async fn goodput_of_a_port_is_that_of_ethernet_in_each_direction_at_once() {
    for text in ["1mbit", "10mbit", "100mbit", "1gbit"] {
        let shape = Shape::port(Wire::ethernet(rate(text)));
        // Out of the port over one stream, into it over another.
        let (a, b) = duplex(1 << 16);
        let (c, d) = duplex(1 << 16);
        let out = carried(Shaped::new(a, Some(&shape)), Shaped::new(b, None));
        let into = carried(Shaped::new(c, None), Shaped::new(d, Some(&shape)));
        let (out, into) = tokio::join!(out, into);
        close(out, goodput(rate(text)), 0.02);
        close(into, goodput(rate(text)), 0.02);
    }
}

#[tokio::test(start_paused = true)]
async fn streams_of_one_port_share_its_rate_and_two_ports_in_turn_carry_as_one() {
    let [near, far] = [(); 2].map(|()| Shape::port(Wire::ethernet(rate("10mbit"))));
    let mut streams = Vec::new();
    for _ in 0..3 {
        let (a, b) = duplex(1 << 14);
        streams.push(tokio::spawn(carried(Shaped::new(a, Some(&near)), Shaped::new(b, Some(&far)))));
    }
    let mut sum = 0.0;
    for stream in streams {
        let share = stream.await.expect("no bug");
        close(share, goodput(rate("10mbit")) / 3.0, 0.05);
        sum += share;
    }
    close(sum, goodput(rate("10mbit")), 0.02);
    // What was read has passed both; what is held has passed the first.
    let ((out, _), (_, into)) = (near.carried(), far.carried());
    close(out as f64, into as f64, 0.02);
}

#[tokio::test(start_paused = true)]
async fn both_directions_of_all_streams_share_a_hub() {
    let hub = Shape::hub(Wire::ethernet(rate("10mbit")));
    let mut streams = Vec::new();
    for _ in 0..2 {
        let (a, b) = duplex(1 << 16);
        let (a, b) = (Shaped::new(a, Some(&hub)), Shaped::new(b, Some(&hub)));
        streams.push(tokio::spawn(carried(a, b)));
    }
    let mut sum = 0.0;
    for stream in streams {
        sum += stream.await.expect("no bug");
    }
    close(sum, goodput(rate("10mbit")), 0.02);
    close(hub.carried().0 as f64, 10e6 / 8.0 * LONG.as_secs_f64(), 0.02);
}

async fn pass((sender, receiver): (&Sender, &mut Receiver), bytes: usize) -> Duration {
    let start = Instant::now();
    sender.send(Frame::new(Header::new(Kind::Cycle), vec![1; bytes])).expect("queued");
    assert_eq!(receiver.receive().await.expect("it comes").payload.len(), bytes);
    start.elapsed()
}

#[tokio::test(start_paused = true)]
async fn a_frame_takes_its_bytes_over_the_rate_and_the_latency_of_the_way() {
    let wire =
        Wire { payload: 1 << 20, overhead: 0, burst: Duration::ZERO, piece: 1 << 20, rate: rate("8mbit") };
    let latency = Duration::from_millis(30);
    let port = || Shape::port(wire).with_latency(latency);
    let hub = Shape::hub(wire).with_latency(latency);
    for (here, there) in [(port(), port()), (hub.clone(), hub)] {
        let (a, b) = duplex(1 << 20);
        let (near, _kept) = split(Shaped::new(a, Some(&here)), Settings::default());
        let (_far, mut receiver) = split(Shaped::new(b, Some(&there)), Settings::default());
        let bytes = 50_000 - HEADER_LEN;
        let took = pass((&near, &mut receiver), bytes).await;
        let expected = Duration::from_millis(50) + latency;
        assert!(took.abs_diff(expected) <= 2 * TICK, "{took:?}, expected {expected:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_end_of_a_shaped_stream_comes_after_its_last_byte() {
    let shape = Shape::port(Wire::ethernet(rate("1mbit")));
    let (a, b) = duplex(1 << 16);
    let (mut near, mut far) = (Shaped::new(a, Some(&shape)), Shaped::new(b, Some(&shape)));
    near.write_all(&[3; 20_000]).await.expect("it fits");
    near.shutdown().await.expect("it can");
    drop(near);
    let mut all = Vec::new();
    far.read_to_end(&mut all).await.expect("the end");
    assert_eq!(all, vec![3; 20_000]);
}
