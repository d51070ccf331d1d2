//! Values to bytes and back, and large messages in chunks.

use protocol::Error;
use protocol::codec::{Assembler, Chunker, check_finite, decode, encode, f64s, finite, put_f64s, put_u32s};
use protocol::codec::{put_u64s, read_f64s, u32s, u64s};
use protocol::frame::{CHUNK, CHUNK_PREFIX, Frame, Header, Kind, decode_header};
use serde::{Deserialize, Serialize};

#[derive(Debug, PartialEq, Serialize, Deserialize)]
enum Word {
    Step {
        cycle: u64,
        #[serde(deserialize_with = "finite")]
        dt: f64,
    },
    Names(Vec<String>),
}

fn step() -> Word {
    Word::Step { cycle: 0x0102, dt: 1.5 }
}

/// Numbers from a seed: SplitMix64.
struct Seeded(u64);

impl Seeded {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next() as u8).collect()
    }
}

#[test]
fn control_messages_have_golden_bytes() {
    let golden = [0, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf8, 0x3f];
    assert_eq!(encode(&step()), Ok(golden.to_vec()));
    let golden = [1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, b'p', b'c'];
    assert_eq!(encode(&Word::Names(vec!["pc".into()])), Ok(golden.to_vec()));
}

#[test]
fn messages_cut_short_at_any_byte_or_continued_are_refused() {
    let mut bytes = encode(&step()).expect("a message");
    assert_eq!(decode(&bytes, 100), Ok(step()));
    for length in 0..bytes.len() {
        assert!(matches!(decode::<Word>(&bytes[..length], 100), Err(Error::Message(_))), "{length} bytes");
    }
    bytes.push(0);
    assert_eq!(decode::<Word>(&bytes, 100), Err(Error::Trailing { used: 20, found: 21 }));
    assert_eq!(decode::<Word>(&bytes, 20), Err(Error::TooLong { what: "message", length: 21, limit: 20 }));
}

#[test]
fn lengths_beyond_memory_are_refused_before_allocation() {
    // Without a limit, bincode allocates 2^36 bytes for this one and the process dies.
    let mut bytes = vec![1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend_from_slice(&(1u64 << 36).to_le_bytes());
    assert!(matches!(decode::<Word>(&bytes, 1 << 20), Err(Error::Message(_))));
    bytes[4..12].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(matches!(decode::<Word>(&bytes, 1 << 20), Err(Error::Message(_))));
}

#[test]
fn infinities_and_nan_do_not_pass_a_control_message() {
    for dt in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let bytes = encode(&Word::Step { cycle: 1, dt }).expect("encodes");
        let error = decode::<Word>(&bytes, 100).expect_err("not finite");
        assert_eq!(error.to_string(), format!("control message: number is {dt}, must be finite"));
        assert!(matches!(check_finite("speed", dt), Err(Error::NotFinite { .. })));
    }
    assert_eq!(check_finite("speed", -0.5), Ok(-0.5));
}

#[test]
fn packed_arrays_keep_every_bit() {
    let mut bytes = Vec::new();
    put_f64s(&mut bytes, &[1.0]);
    put_u32s(&mut bytes, &[0x0102_0304]);
    put_u64s(&mut bytes, &[0x0102_0304_0506_0708]);
    assert_eq!(bytes, [0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 4, 3, 2, 1, 8, 7, 6, 5, 4, 3, 2, 1]);

    let mut seeded = Seeded(5);
    let words: Vec<u64> = (0..1000).map(|_| seeded.next()).collect();
    let values: Vec<f64> = words.iter().map(|&bits| f64::from_bits(bits)).collect();
    // One byte ahead, so that the array is not aligned.
    let mut bytes = vec![0xff];
    put_f64s(&mut bytes, &values);
    let back = f64s(&bytes[1..]).expect("whole elements");
    assert!(back.iter().map(|value| value.to_bits()).eq(words.iter().copied()));
    let mut into = vec![0.0; 1000];
    read_f64s(&bytes[1..], &mut into).expect("as many elements");
    assert!(into.iter().map(|value| value.to_bits()).eq(words.iter().copied()));
    assert_eq!(u64s(&bytes[1..]), Ok(words));

    assert_eq!(f64s(&bytes[2..]), Err(Error::ArrayLength { found: 7999, expected: 8 }));
    assert_eq!(u32s(&bytes[..6]), Err(Error::ArrayLength { found: 6, expected: 4 }));
    assert_eq!(read_f64s(&bytes[9..], &mut into), Err(Error::ArrayLength { found: 7992, expected: 8000 }));
}

fn chunks(stream: u64, bytes: Vec<u8>) -> Vec<Frame> {
    let header = Header { job: 1, epoch: 4, ..Header::new(Kind::Control) };
    Chunker::new(header, stream, bytes).expect("within the limit").collect()
}

#[test]
fn messages_come_whole_out_of_their_chunks() {
    let mut seeded = Seeded(6);
    for (length, count) in [(0, 1), (1, 1), (CHUNK, 1), (CHUNK + 1, 2), (3 * CHUNK, 3)] {
        let bytes = seeded.bytes(length);
        let frames = chunks(8, bytes.clone());
        assert_eq!(frames.len(), count, "{length} bytes");
        let mut assembler = Assembler::new(3 * CHUNK as u64, 1);
        for (index, mut frame) in frames.into_iter().enumerate() {
            frame.seal().expect("a chunk is within the limit of its kind");
            let message = assembler.accept(&frame).expect("in order");
            assert_eq!(message.is_some(), index + 1 == count);
            if let Some(message) = message {
                assert_eq!((message.stream, message.header.epoch), (8, 4));
                assert_eq!(message.bytes, bytes);
            }
        }
        assert_eq!(assembler.open(), 0);
    }
}

#[test]
fn streams_may_take_turns() {
    let (a, b) = (chunks(1, vec![1; 3 * CHUNK]), chunks(2, vec![2; 2 * CHUNK]));
    let mut assembler = Assembler::new(5 * CHUNK as u64, 2);
    for frame in [&a[0], &b[0], &a[1]] {
        assert_eq!(assembler.accept(frame), Ok(None));
    }
    assert_eq!(assembler.accept(&b[1]).expect("its last").map(|done| done.stream), Some(2));
    assert_eq!(assembler.accept(&a[2]).expect("its last").map(|done| done.bytes), Some(vec![1; 3 * CHUNK]));
}

#[test]
fn announcements_beyond_the_bounds_are_refused() {
    let (a, b, c) = (chunks(1, vec![1; 3 * CHUNK]), chunks(2, vec![2; 2 * CHUNK]), chunks(3, vec![3; CHUNK]));
    let mut assembler = Assembler::new(4 * CHUNK as u64, 2);
    assert_eq!(assembler.accept(&a[0]), Ok(None));
    let (length, limit) = (5 * CHUNK as u64, 4 * CHUNK as u64);
    let refused = Err(Error::TooLong { what: "bulk messages on their way", length, limit });
    assert_eq!(assembler.accept(&b[0]), refused);
    assert!(assembler.forget(1) && !assembler.forget(1));
    assert_eq!(assembler.accept(&b[0]), Ok(None), "the first stream's bytes are free again");

    let mut assembler = Assembler::new(u64::MAX, 1);
    assert_eq!(assembler.accept(&a[0]), Ok(None));
    assert_eq!(
        assembler.accept(&c[0]),
        Err(Error::TooLong { what: "open bulk streams", length: 2, limit: 1 })
    );
    // A stream that lies about its length: 2^64 - 1 bytes are announced, none are allocated.
    let mut liar = chunks(9, vec![0; CHUNK]).remove(0);
    liar.payload[8..16].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(matches!(Assembler::new(1 << 30, 1).accept(&liar), Err(Error::TooLong { .. })));
}

#[test]
fn chunks_that_do_not_continue_their_stream_are_refused() {
    let frames = chunks(1, vec![1; 2 * CHUNK + 5]);
    let begun = || {
        let mut assembler = Assembler::new(1 << 20, 4);
        assert_eq!(assembler.accept(&frames[0]), Ok(None));
        assembler
    };
    let fault = |change: &dyn Fn(&mut Frame)| {
        let mut frame = frames[1].clone();
        change(&mut frame);
        begun().accept(&frame).expect_err("a fault").to_string()
    };
    assert_eq!(fault(&|frame| frame.header.sequence = 2), "bulk stream 1: chunk 2 came, expected 1");
    assert_eq!(fault(&|frame| frame.header.sequence = 0), "bulk stream 1: chunk 0 came, expected 1");
    assert_eq!(
        fault(&|frame| frame.header.epoch = 5),
        "bulk stream 1: chunk 1 is of job and epoch (1, 5), chunk 0 of (1, 4)"
    );
    assert_eq!(
        fault(&|frame| frame.payload[8] = 6),
        "bulk stream 1: chunk 1 states 131078 bytes, chunk 0 stated 131077"
    );
    assert_eq!(
        fault(&|frame| frame.payload.truncate(CHUNK)),
        "bulk stream 1: chunk 1 has 65520 bytes, expected 65536"
    );
    assert_eq!(
        fault(&|frame| frame.payload.truncate(CHUNK_PREFIX - 1)),
        "bulk prefix: ended after 15 bytes, needs 16"
    );
    assert_eq!(fault(&|frame| frame.header.kind = Kind::Cycle), "cycle frame, expected bulk");
    let unknown = Assembler::new(1 << 20, 4).accept(&frames[1]).expect_err("a stream from the middle");
    assert_eq!(unknown.to_string(), "bulk stream 1: chunk 1 came, expected 0");
}

#[test]
fn random_bytes_never_panic_a_decoder() {
    let mut seeded = Seeded(7);
    let mut assembler = Assembler::new(1 << 20, 4);
    let mut kinds = [0; 2];
    for _ in 0..100_000 {
        let length = (seeded.next() % 120) as usize;
        let mut bytes = seeded.bytes(length);
        if let Some(head) = bytes.first_chunk_mut::<52>() {
            // Most of the way is beyond magic, version and checksum: let half of the inputs pass them.
            if head[51] & 1 == 0 {
                head[..6].copy_from_slice(b"BLDE\x01\0");
                head[6] %= 12;
                head[10..12].fill(0);
                let crc = crc32c::crc32c(&head[..48]);
                head[48..].copy_from_slice(&crc.to_le_bytes());
            }
            let header = decode_header(head);
            kinds[usize::from(header.is_ok())] += 1;
            if let Ok(header) = header {
                assert!(header.length <= header.kind.limit());
                let frame = Frame::new(header, bytes[52..].to_vec());
                let _ = frame.verify();
                let _ = assembler.accept(&Frame::new(Header { kind: Kind::Bulk, ..header }, bytes.clone()));
            }
        }
        if let Ok(word) = decode::<Word>(&bytes, 1 << 20) {
            assert_eq!(encode(&word), Ok(bytes.clone()), "a message has one encoding");
        }
        let _ = (f64s(&bytes), u32s(&bytes), u64s(&bytes));
    }
    assert!(kinds.iter().all(|&count| count > 1000), "headers refused and taken: {kinds:?}");
}
