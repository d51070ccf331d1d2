//! The header's bytes, and every way in which a header can be wrong.

use protocol::Error;
use protocol::frame::{CYCLE_LIMIT, Frame, HEADER_LEN, Header, Kind, decode_header, encode_header};

fn cycle_frame() -> Frame {
    let header = Header {
        flags: 0x5a,
        job: 7,
        epoch: 2,
        incarnation: 9,
        cycle: 0x0102_0304_0506_0708,
        plan: 0x1122_3344_5566_7788,
        sequence: 3,
        ..Header::new(Kind::Cycle)
    };
    let mut frame = Frame::new(header, b"123456789".to_vec());
    frame.seal().expect("nine bytes are within the limit");
    frame
}

/// Puts a right checksum under a header that was changed on purpose.
fn resign(bytes: &mut [u8; HEADER_LEN]) {
    let crc = crc32c::crc32c(&bytes[..48]);
    bytes[48..].copy_from_slice(&crc.to_le_bytes());
}

#[test]
fn header_has_its_golden_bytes() {
    // e3069283 is the published CRC-32C of "123456789".
    let golden: [u8; 48] = [
        b'B', b'L', b'D', b'E', 1, 0, 5, 0x5a, 9, 0, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, 9, 0, 0, 0, 8, 7, 6, 5, 4,
        3, 2, 1, 0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 3, 0, 0, 0, 0x83, 0x92, 0x06, 0xe3,
    ];
    let bytes = encode_header(&cycle_frame().header);
    assert_eq!(bytes[..48], golden);
    assert_eq!(bytes[48..], CRC_OF_GOLDEN);
    assert_eq!(decode_header(&bytes), Ok(cycle_frame().header));
}

/// CRC-32C of the 48 golden bytes, worked out bit by bit apart from the crate that is used.
const CRC_OF_GOLDEN: [u8; 4] = [0xdb, 0xaf, 0x22, 0x91];

#[test]
fn every_bit_flipped_in_a_header_is_refused() {
    let good = encode_header(&cycle_frame().header);
    for bit in 0..HEADER_LEN * 8 {
        let mut bytes = good;
        bytes[bit / 8] ^= 1 << (bit % 8);
        let error = decode_header(&bytes).expect_err("one bit differs");
        match bit / 8 {
            0..4 => assert!(matches!(error, Error::Magic { .. }), "bit {bit}: {error}"),
            4..6 => assert!(matches!(error, Error::FrameVersion { ours: 1, .. }), "bit {bit}: {error}"),
            _ => assert!(matches!(error, Error::HeaderChecksum { .. }), "bit {bit}: {error}"),
        }
    }
}

#[test]
fn every_bit_flipped_in_a_payload_is_refused() {
    let good = cycle_frame();
    good.verify().expect("the frame as it was sealed");
    for bit in 0..good.payload.len() * 8 {
        let mut frame = good.clone();
        frame.payload[bit / 8] ^= 1 << (bit % 8);
        assert!(matches!(frame.verify(), Err(Error::PayloadChecksum { kind: Kind::Cycle, .. })));
    }
}

#[test]
fn payload_of_another_length_is_refused() {
    let mut frame = cycle_frame();
    frame.payload.pop();
    assert_eq!(frame.verify(), Err(Error::Truncated { what: "cycle", found: 8, needed: 9 }));
    frame.payload.extend_from_slice(b"90");
    assert_eq!(frame.verify(), Err(Error::Trailing { used: 9, found: 10 }));
}

#[test]
fn another_version_names_both() {
    let mut bytes = encode_header(&Header::new(Kind::Bye));
    bytes[4] = 3;
    let error = decode_header(&bytes).expect_err("version 3");
    let text = "frame version 3, this side speaks 1; install the same release on both";
    assert_eq!(error.to_string(), text);
}

#[test]
fn each_kind_takes_its_limit_and_not_a_byte_more() {
    for kind in Kind::ALL {
        let mut header = Header { length: kind.limit(), ..Header::new(kind) };
        assert_eq!(decode_header(&encode_header(&header)), Ok(header));
        header.length += 1;
        let (length, limit) = (u64::from(kind.limit()) + 1, u64::from(kind.limit()));
        let expected = Err(Error::TooLong { what: kind.name(), length, limit });
        assert_eq!(decode_header(&encode_header(&header)), expected);
    }
    let mut frame = Frame::new(Header::new(Kind::Cycle), vec![0; CYCLE_LIMIT as usize + 1]);
    assert!(matches!(frame.seal(), Err(Error::TooLong { what: "cycle", .. })));
}

#[test]
fn unknown_kinds_are_refused() {
    for byte in [0, 11, 255] {
        let mut bytes = encode_header(&Header::new(Kind::Bye));
        bytes[6] = byte;
        resign(&mut bytes);
        assert_eq!(decode_header(&bytes), Err(Error::Kind { found: byte }));
    }
    for kind in Kind::ALL {
        assert_eq!(Kind::from_byte(kind as u8), Ok(kind));
    }
}
