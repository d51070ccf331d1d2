//! How values become payloads: control messages, packed arrays, and large messages in chunks.
//!
//! This is the only module that knows bincode, but for the crate `recompute` (fixed-size little-endian integers, always with a limit).
//! Rules for message types that pass through here: no container whose elements take no bytes (a length
//! of 2^60 would then cost that many steps), no recursive types, no `char`; floating-point fields carry
//! `#[serde(deserialize_with = "crate::codec::finite")]` or are checked with [`check_finite`].
//!
//! Arrays of cycle frames are raw little-endian elements without a length: the exchange plan knows it.

use crate::frame::{CHUNK, CHUNK_PREFIX, Frame, Header, Kind};
use crate::{Error, Result};
use bincode::enc::write::SizeWriter;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The largest message that [`decode`] takes, whatever limit it is given: 1 GiB, a state of some
/// four million elements.
pub const MESSAGE_LIMIT: usize = 1 << 30;

/// Messages that one side sends in chunks at a time, and that the other assembles at a time.
pub const OPEN_STREAMS: usize = 16;

/// Writes the bytes of a value of any length, such as into a checksum.
///
/// # Errors
/// What the writer refused.
pub fn encode_into<T: Serialize>(value: &T, mut into: &mut dyn std::io::Write) -> Result<()> {
    let config = bincode::config::standard().with_little_endian().with_fixed_int_encoding();
    let written = bincode::serde::encode_into_std_write(value, &mut into, config);
    written.map(|_| ()).map_err(|error| Error::Message(error.to_string()))
}

/// The bytes of `value`.
///
/// # Errors
/// [`Error::Message`] when the type cannot be encoded (a sequence of unknown length), [`Error::TooLong`]
/// over [`MESSAGE_LIMIT`].
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>> {
    let config = bincode::config::standard().with_little_endian().with_fixed_int_encoding();
    let bytes =
        bincode::serde::encode_to_vec(value, config).map_err(|error| Error::Message(error.to_string()))?;
    bounded("message", bytes.len(), MESSAGE_LIMIT)?;
    Ok(bytes)
}

/// How long [`encode`] of `value` would be. Nothing is written, so that long arrays take next to no time.
///
/// # Errors
/// As there, but for a length over the limit.
pub fn measure<T: Serialize>(value: &T) -> Result<u64> {
    let config = bincode::config::standard().with_little_endian().with_fixed_int_encoding();
    let mut size = SizeWriter::default();
    let measured = bincode::serde::encode_into_writer(value, &mut size, config);
    measured.map(|()| size.bytes_written as u64).map_err(|error| Error::Message(error.to_string()))
}

/// The value whose bytes are all of `bytes`, which may be at most `limit` (and [`MESSAGE_LIMIT`]) long.
///
/// A length inside a message of at most 1 MiB can make it allocate at most 1 MiB, in a longer one 1 GiB. Each such limit compiles
/// all messages once more, so there are two.
///
/// # Errors
/// [`Error::TooLong`] over the limit, [`Error::Message`] when the bytes are no such value,
/// [`Error::Trailing`] when bytes are left.
pub fn decode<T: DeserializeOwned>(bytes: &[u8], limit: usize) -> Result<T> {
    bounded("message", bytes.len(), limit.min(MESSAGE_LIMIT))?;
    let (value, used) = match bytes.len() {
        0..=0x10_0000 => decode_within::<T, 0x10_0000>(bytes),
        _ => decode_within::<T, MESSAGE_LIMIT>(bytes),
    }?;
    if used != bytes.len() {
        return Err(Error::Trailing { used: used as u64, found: bytes.len() as u64 });
    }
    Ok(value)
}

fn decode_within<T: DeserializeOwned, const LIMIT: usize>(bytes: &[u8]) -> Result<(T, usize)> {
    let config =
        bincode::config::standard().with_little_endian().with_fixed_int_encoding().with_limit::<LIMIT>();
    bincode::serde::decode_from_slice(bytes, config).map_err(|error| match error {
        bincode::error::DecodeError::OtherString(why) => Error::Message(why),
        error => Error::Message(error.to_string()),
    })
}

fn bounded(what: &'static str, length: usize, limit: usize) -> Result<()> {
    if length > limit {
        return Err(Error::TooLong { what, length: length as u64, limit: limit as u64 });
    }
    Ok(())
}

/// Passes on a finite `value`, and names it otherwise.
///
/// # Errors
/// [`Error::NotFinite`] for an infinity or a NaN.
pub fn check_finite(what: &str, value: f64) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(Error::NotFinite { what: what.to_owned(), value }) }
}

/// Reads a floating-point field that must be finite; for `#[serde(deserialize_with)]`.
///
/// # Errors
/// The deserializer's error for an infinity or a NaN, naming the value.
pub fn finite<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<f64, D::Error> {
    let value = f64::deserialize(deserializer)?;
    if value.is_finite() {
        return Ok(value);
    }
    Err(serde::de::Error::custom(format_args!("number is {value}, must be finite")))
}

/// The same of a number that may be missing.
///
/// # Errors
/// Names the number, if there is one and it is not finite.
pub fn finite_or_none<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> std::result::Result<Option<f64>, D::Error> {
    match Option::<f64>::deserialize(deserializer)? {
        Some(value) if !value.is_finite() => {
            Err(serde::de::Error::custom(format_args!("number is {value}, must be finite")))
        }
        value => Ok(value),
    }
}

/// A number that is packed as its little-endian bytes; every bit pattern is one.
trait Packed: bytemuck::Pod {
    fn put(self, out: &mut Vec<u8>);
    fn get(bytes: &[u8]) -> Self;
}

macro_rules! packed {
    ($number:ty) => {
        impl Packed for $number {
            fn put(self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn get(bytes: &[u8]) -> Self {
                let mut array = [0; size_of::<Self>()];
                array.copy_from_slice(bytes);
                Self::from_le_bytes(array)
            }
        }
    };
}
packed!(f64);
packed!(u32);
packed!(u64);

fn put<T: Packed>(out: &mut Vec<u8>, values: &[T]) {
    if cfg!(target_endian = "little") {
        out.extend_from_slice(bytemuck::cast_slice(values));
    } else {
        values.iter().for_each(|value| value.put(out));
    }
}

fn read<T: Packed>(bytes: &[u8], into: &mut [T]) -> Result<()> {
    let expected = size_of_val(into);
    if bytes.len() != expected {
        return Err(Error::ArrayLength { found: bytes.len() as u64, expected: expected as u64 });
    }
    if cfg!(target_endian = "little") {
        bytemuck::cast_slice_mut(into).copy_from_slice(bytes);
    } else {
        for (value, bytes) in into.iter_mut().zip(bytes.chunks_exact(size_of::<T>())) {
            *value = T::get(bytes);
        }
    }
    Ok(())
}

fn all<T: Packed>(bytes: &[u8]) -> Result<Vec<T>> {
    if !bytes.len().is_multiple_of(size_of::<T>()) {
        return Err(Error::ArrayLength { found: bytes.len() as u64, expected: size_of::<T>() as u64 });
    }
    let mut values = vec![T::zeroed(); bytes.len() / size_of::<T>()];
    read(bytes, &mut values)?;
    Ok(values)
}

/// Appends `values` to `out`, 8 bytes each; NaN and infinities keep their bits.
pub fn put_f64s(out: &mut Vec<u8>, values: &[f64]) {
    put(out, values);
}

/// Appends `values` to `out`, 4 bytes each.
pub fn put_u32s(out: &mut Vec<u8>, values: &[u32]) {
    put(out, values);
}

/// Appends `values` to `out`, 8 bytes each.
pub fn put_u64s(out: &mut Vec<u8>, values: &[u64]) {
    put(out, values);
}

/// All of `bytes` as numbers, bit for bit.
///
/// # Errors
/// [`Error::ArrayLength`] when `bytes` is no whole number of elements.
pub fn f64s(bytes: &[u8]) -> Result<Vec<f64>> {
    all(bytes)
}

/// All of `bytes` as 32-bit integers.
///
/// # Errors
/// [`Error::ArrayLength`] when `bytes` is no whole number of elements.
pub fn u32s(bytes: &[u8]) -> Result<Vec<u32>> {
    all(bytes)
}

/// All of `bytes` as 64-bit integers.
///
/// # Errors
/// [`Error::ArrayLength`] when `bytes` is no whole number of elements.
pub fn u64s(bytes: &[u8]) -> Result<Vec<u64>> {
    all(bytes)
}

/// Fills `into` from exactly as many bytes, bit for bit, without allocating.
///
/// # Errors
/// [`Error::ArrayLength`] when `bytes` has another length than `into`.
pub fn read_f64s(bytes: &[u8], into: &mut [f64]) -> Result<()> {
    read(bytes, into)
}

/// A large message on its way out, cut into bulk frames of [`CHUNK`] bytes one at a time.
///
/// Each payload starts with the stream's number and the total length, so the other side can refuse the
/// message at its first chunk. An empty message is one empty chunk.
#[derive(Clone, Debug)]
pub struct Chunker {
    header: Header,
    stream: u64,
    bytes: Arc<Vec<u8>>,
    done: bool,
}

impl Chunker {
    /// Cuts `bytes` into chunks of `stream`; job, epoch, incarnation, cycle and plan are taken from
    /// `header`, its kind and sequence are not.
    ///
    /// # Errors
    /// [`Error::TooLong`] over [`MESSAGE_LIMIT`].
    pub fn new(header: Header, stream: u64, bytes: impl Into<Arc<Vec<u8>>>) -> Result<Self> {
        let bytes = bytes.into();
        bounded("bulk message", bytes.len(), MESSAGE_LIMIT)?;
        let header = Header { kind: Kind::Bulk, sequence: 0, ..header };
        Ok(Self { header, stream, bytes, done: false })
    }

    /// Bytes of the whole message.
    pub fn total(&self) -> usize {
        self.bytes.len()
    }

    /// The next chunk, in `payload` (whose contents are thrown away); `None` after the last.
    pub fn next_into(&mut self, mut payload: Vec<u8>) -> Option<Frame> {
        if self.done {
            return None;
        }
        let start = self.header.sequence as usize * CHUNK;
        let end = (start + CHUNK).min(self.bytes.len());
        payload.clear();
        payload.reserve(CHUNK_PREFIX + end - start);
        put_u64s(&mut payload, &[self.stream, self.bytes.len() as u64]);
        payload.extend_from_slice(&self.bytes[start..end]);
        let frame = Frame::new(self.header, payload);
        self.header.sequence += 1;
        self.done = end == self.bytes.len();
        Some(frame)
    }

    /// Whether the last chunk has been taken.
    pub const fn is_done(&self) -> bool {
        self.done
    }
}

impl Iterator for Chunker {
    type Item = Frame;

    fn next(&mut self) -> Option<Frame> {
        self.next_into(Vec::new())
    }
}

/// Large messages on their way in, one per stream.
///
/// Invariant: the totals that the open streams announced add up to at most `max_bytes`, and at most
/// `max_open` are open. Memory grows with the bytes that came, not with what was announced.
#[derive(Debug)]
pub struct Assembler {
    max_bytes: u64,
    max_open: usize,
    announced: u64,
    open: BTreeMap<u64, Assembly>,
}

#[derive(Debug)]
struct Assembly {
    header: Header,
    total: u64,
    bytes: Vec<u8>,
}

/// A large message that has come whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The stream's number, as the sender chose it.
    pub stream: u64,
    /// The header of its first chunk.
    pub header: Header,
    pub bytes: Vec<u8>,
}

impl Assembler {
    /// Takes up to `max_open` streams at a time with `max_bytes` announced by all of them together.
    pub const fn new(max_bytes: u64, max_open: usize) -> Self {
        Self { max_bytes, max_open, announced: 0, open: BTreeMap::new() }
    }

    /// Adds a bulk frame; gives the message when this was its last chunk.
    ///
    /// # Errors
    /// [`Error::Unexpected`] for another kind, [`Error::Truncated`] for a chunk without its prefix,
    /// [`Error::TooLong`] when too much is announced or too many streams are open, [`Error::Chunk`] for a
    /// chunk out of sequence, of another length than its place needs, or of another job, epoch or total
    /// than its stream. After an error the stream is unchanged; the connection should end.
    pub fn accept(&mut self, frame: &Frame) -> Result<Option<Message>> {
        let (header, payload) = (frame.header, &frame.payload);
        if header.kind != Kind::Bulk {
            return Err(Error::Unexpected { found: header.kind, expected: "bulk" });
        }
        let (Some(prefix), Some(chunk)) = (payload.get(..CHUNK_PREFIX), payload.get(CHUNK_PREFIX..)) else {
            let found = payload.len() as u64;
            return Err(Error::Truncated { what: "bulk prefix", found, needed: CHUNK_PREFIX as u64 });
        };
        let (stream, total) = (u64::get(&prefix[..8]), u64::get(&prefix[8..]));
        let wrong = |why: String| Err(Error::Chunk { stream, why });

        let (done, next, known) = match self.open.get(&stream) {
            Some(open) => (open.bytes.len() as u64, open.bytes.len() / CHUNK, Some(open)),
            None => (0, 0, None),
        };
        if header.sequence as usize != next {
            return wrong(format!("chunk {} came, expected {next}", header.sequence));
        }
        if let Some(open) = known {
            let (first, now) = ((open.header.job, open.header.epoch), (header.job, header.epoch));
            if total != open.total {
                return wrong(format!("chunk {next} states {total} bytes, chunk 0 stated {}", open.total));
            }
            if first != now {
                return wrong(format!("chunk {next} is of job and epoch {now:?}, chunk 0 of {first:?}"));
            }
        } else {
            let announced = self.announced.saturating_add(total);
            if announced > self.max_bytes {
                let what = "bulk messages on their way";
                return Err(Error::TooLong { what, length: announced, limit: self.max_bytes });
            }
            if self.open.len() >= self.max_open {
                let (length, limit) = (self.open.len() as u64 + 1, self.max_open as u64);
                return Err(Error::TooLong { what: "open bulk streams", length, limit });
            }
        }
        let expected = (total - done).min(CHUNK as u64);
        if chunk.len() as u64 != expected {
            return wrong(format!("chunk {next} has {} bytes, expected {expected}", chunk.len()));
        }

        let open = self.open.entry(stream).or_insert_with(|| Assembly { header, total, bytes: Vec::new() });
        if next == 0 {
            self.announced += total;
        }
        open.bytes.extend_from_slice(chunk);
        if open.bytes.len() as u64 == total {
            return Ok(self.take(stream).map(|done| Message {
                stream,
                header: done.header,
                bytes: done.bytes,
            }));
        }
        Ok(None)
    }

    /// Drops what has come of `stream`, as when its epoch is over; whether there was any.
    ///
    /// Chunks of it that are still on their way must not reach [`accept`](Self::accept), which would take
    /// them for a broken stream: compare a frame's epoch first.
    pub fn forget(&mut self, stream: u64) -> bool {
        self.take(stream).is_some()
    }

    /// Streams that are begun and not ended.
    pub fn open(&self) -> usize {
        self.open.len()
    }

    fn take(&mut self, stream: u64) -> Option<Assembly> {
        let assembly = self.open.remove(&stream)?;
        self.announced -= assembly.total;
        Some(assembly)
    }
}
