use super::*;
use std::collections::VecDeque;
use std::sync::mpsc;
use std::time::Duration;

use system::shared::{self, Made};

/// A ring, and its memory; none where the system has none.
fn ring() -> Option<(Producer, Consumer, Arc<Shared>)> {
    if !shared::IS_THERE {
        return None;
    }
    let Made { shared, .. } = shared::make(crate::memory::BYTES).expect("memory");
    let memory = Arc::new(shared);
    // The second of the two, whose end is that of the memory.
    let (producer, consumer) = (
        Producer::new(Arc::clone(&memory), Direction::Back),
        Consumer::new(Arc::clone(&memory), Direction::Back),
    );
    Some((producer, consumer, memory))
}

/// Numbers below a limit, the same in every run.
struct Draws(u64);

impl Draws {
    fn below(&mut self, limit: u64) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % limit) as usize
    }
}

#[test]
fn what_is_put_in_comes_out_in_every_size_and_around_the_end() {
    let Some((mut producer, mut consumer, _)) = ring() else { return };
    let (mut draws, mut model, mut next) = (Draws(1), VecDeque::<u8>::new(), 0_u8);
    let (mut full, mut empty, mut passed) = (0, 0, 0);
    for _ in 0..4000 {
        let most = if draws.below(4) == 0 { BYTES as u64 + 9 } else { 5000 };
        let mut bytes = vec![0; draws.below(most)];
        if draws.below(2) == 0 {
            for byte in &mut bytes {
                next = next.wrapping_mul(31).wrapping_add(7);
                *byte = next;
            }
            let room = BYTES - model.len();
            let count = producer.put(&bytes).expect("both play by the rules");
            assert_eq!(count, bytes.len().min(room));
            assert_eq!(producer.unpublished(), count as u64);
            producer.publish();
            model.extend(&bytes[..count]);
            full += usize::from(count < bytes.len());
        } else {
            assert_eq!(consumer.filled().expect("both play by the rules"), model.len());
            let count = consumer.take(&mut bytes).expect("both play by the rules");
            assert_eq!(count, bytes.len().min(model.len()));
            assert!(model.drain(..count).eq(bytes[..count].iter().copied()));
            empty += usize::from(count < bytes.len());
            passed += count;
        }
    }
    assert!(full > 50 && empty > 50 && passed > 50 * BYTES, "full {full}, empty {empty}, passed {passed}");
}

#[test]
fn nothing_is_seen_before_it_is_published_and_the_end_comes_last() {
    let Some((mut producer, mut consumer, _)) = ring() else { return };
    let mut three = [0; 3];
    assert_eq!(producer.put(&[1, 2, 3]).expect("room"), 3);
    assert_eq!(consumer.take(&mut three).expect("good"), 0);
    assert!(!producer.publish() && !consumer.is_closed(), "nobody waits");
    consumer.wait();
    assert_eq!(producer.put(&[4]).expect("room"), 1);
    assert!(producer.close(), "it is to be woken");
    assert!(!producer.close(), "once");
    assert!(consumer.is_closed());
    assert_eq!((consumer.take(&mut three).expect("good"), three), (3, [1, 2, 3]));
    assert_eq!((consumer.take(&mut three).expect("good"), three[0]), (1, 4));
}

#[test]
fn a_writer_is_woken_when_half_of_the_ring_is_free() {
    let Some((mut producer, mut consumer, _)) = ring() else { return };
    assert_eq!(producer.put(&vec![1; BYTES + 1]).expect("room"), BYTES);
    producer.publish();
    assert_eq!((producer.put(&[1]).expect("good"), producer.room(1).expect("good")), (0, 0));
    producer.wait();
    let mut some = vec![0; BYTES / 2 - 1];
    assert_eq!(consumer.take(&mut some).expect("good"), some.len());
    assert!(!consumer.has_made_room());
    assert_eq!(consumer.take(&mut some[..1]).expect("good"), 1);
    assert!(consumer.has_made_room());
    assert!(!consumer.has_made_room(), "once");
    assert_eq!(producer.room(1).expect("good"), BYTES / 2);
}

#[test]
fn indices_that_cannot_be_are_refused() {
    let bytes = BYTES as u64;
    for (written, taken) in
        [(9, 11), (12 + bytes, 11), (u64::MAX, 11), (0, 11), (30, 10), (30, 31), (30, u64::MAX)]
    {
        let Some((mut producer, mut consumer, _)) = ring() else { return };
        assert_eq!(producer.put(&[7; 30]).expect("room"), 30);
        producer.publish();
        assert_eq!(consumer.take(&mut [0; 11]).expect("good"), 11);
        assert_eq!(producer.room(BYTES).expect("good"), BYTES - 19);
        producer.ring.number(WRITTEN).store(written, Relaxed);
        producer.ring.number(TAKEN).store(taken, Relaxed);
        let (mut into, from) = (vec![0; BYTES], vec![9; BYTES]);
        if written != 30 {
            let error = consumer.take(&mut into).expect_err("nonsense").to_string();
            assert!(
                error.starts_with(&format!("shared memory: {written} bytes written, expected 30 to ")),
                "{error}"
            );
            assert!(consumer.filled().is_err() && into == vec![0; BYTES]);
        }
        if taken != 11 {
            let error = producer.put(&from).expect_err("nonsense").to_string();
            assert_eq!(error, format!("shared memory: {taken} bytes taken, expected 11 to 30"));
            assert!(producer.room(BYTES).is_err());
        }
    }
}

/// What the other side writes over bytes and words at any time changes what comes out, not where from.
#[test]
fn a_memory_full_of_noise_gives_bytes_or_an_error() {
    let Some((mut producer, mut consumer, memory)) = ring() else { return };
    let (mut draws, mut refused) = (Draws(2), 0);
    let mut buffer = vec![0; BYTES];
    for _ in 0..20_000 {
        let at = producer.ring.indices + 256 * draws.below(5);
        let noise = match draws.below(3) {
            0 => draws.below(1 << 21) as u64,
            1 => u64::MAX - draws.below(100) as u64,
            _ => consumer.written.wrapping_add(draws.below(100) as u64),
        };
        let before = memory.number(at).swap(noise, Relaxed);
        let count = draws.below(2000);
        let results = [producer.put(&buffer[..count]), consumer.take(&mut buffer[..count])];
        refused += results.iter().filter(|result| result.is_err()).count();
        producer.publish();
        let _ = (consumer.has_made_room(), consumer.is_closed(), producer.close());
        memory.number(at).store(before, Relaxed);
    }
    assert!(refused > 1000, "{refused}");
}

/// Two threads that sleep as often as they can: one that is not woken sleeps for ever.
#[test]
fn no_change_is_slept_through() {
    let Some((mut producer, mut consumer, _)) = ring() else { return };
    const DEADLINE: Duration = Duration::from_secs(120);
    const MESSAGES: u64 = 200_000;
    let (call_reader, reader_called) = mpsc::channel();
    let (call_writer, writer_called) = mpsc::channel();
    let writing = std::thread::spawn(move || {
        let (mut draws, mut sleeps) = (Draws(3), 0);
        for message in 0..MESSAGES {
            // Every so often one that fills the ring.
            let length = if message % 5000 == 4999 { 2 * BYTES } else { 8 * (1 + draws.below(8)) };
            let bytes = message.to_le_bytes().repeat(length / 8);
            let mut rest = &bytes[..];
            while !rest.is_empty() {
                let count = producer.put(rest).expect("good");
                rest = &rest[count..];
                if count > 0 && producer.publish() {
                    call_reader.send(()).expect("it reads");
                }
                if count == 0 {
                    producer.wait();
                    if producer.room(1).expect("good") == 0 {
                        sleeps += 1;
                        writer_called.recv_timeout(DEADLINE).expect("the writer is woken");
                    }
                }
            }
        }
        if producer.close() {
            call_reader.send(()).expect("it reads");
        }
        sleeps
    });
    let (mut all, mut sleeps, mut buffer) = (Vec::new(), 0, vec![0; 1 << 16]);
    loop {
        let closed = consumer.is_closed();
        let count = consumer.take(&mut buffer).expect("good");
        all.extend_from_slice(&buffer[..count]);
        if count > 0 {
            if consumer.has_made_room() {
                // It may have written its last meanwhile.
                let _ = call_writer.send(());
            }
        } else if closed {
            break;
        } else {
            consumer.wait();
            if consumer.filled().expect("good") == 0 && !consumer.is_closed() {
                sleeps += 1;
                reader_called.recv_timeout(DEADLINE).expect("the reader is woken");
            }
        }
    }
    let writer_slept = writing.join().expect("it ends");
    let (mut draws, mut at) = (Draws(3), 0);
    for message in 0..MESSAGES {
        let length = if message % 5000 == 4999 { 2 * BYTES } else { 8 * (1 + draws.below(8)) };
        assert!(
            all[at..at + length].chunks(8).all(|word| word == message.to_le_bytes()),
            "message {message}"
        );
        at += length;
    }
    assert_eq!(at, all.len());
    assert!(sleeps > 0 && writer_slept > 0, "reader slept {sleeps} times, writer {writer_slept}");
}
