//! The appended arrays of a VTK file: a size and the numbers, or blocks under zlib.
//!
//! Raw: the number of bytes (64 bits), then the bytes. Compressed, as `vtkZLibDataCompressor` has it: the number of
//! blocks, the size of a whole block, that of the last one if it is not whole (else zero), the compressed size of each
//! block, all of 64 bits, then the blocks, each a zlib stream by itself. Equal numbers give equal bytes on every
//! machine: the compressor is pinned and has one code path. Blocks of numbers without a pattern, such as velocities behind a shock, are
//! stored as they are: compression takes most of the time of a state and would gain a tenth of them.

#![cfg_attr(test, expect(clippy::disallowed_methods, reason = "tests write waves"))]

use std::{collections::BTreeMap, io, io::Write, sync::Arc};

use miniz_oxide::{deflate::compress_to_vec_zlib, inflate::decompress_to_vec_zlib_with_limit};

use super::array::Array;

/// Bytes of numbers in a block.
const BLOCK: usize = 1 << 18;

/// Level of compression. On states of impacts a higher one takes three times the time for a few per cent.
const LEVEL: u8 = 1;

/// Bytes at the start of a block by which it is judged, and the share of them that must be left at most for compression to be worth it.
const SAMPLE: usize = 1 << 13;
const WORTH: f64 = 0.8;

/// Level of blocks that are stored.
const STORED: u8 = 0;

/// Bytes of raw numbers that are held at once.
const CHUNK: usize = 1 << 16;

/// Blocks that a reader takes at most; a header that says more is damaged.
const MOST_BLOCKS: u64 = 1 << 32;

/// What stands for one array behind the head of the file.
pub(super) enum Appended {
    /// So many bytes of numbers, which come as they are written.
    Raw(u64),
    /// Header and blocks.
    Compressed(Arc<[u8]>),
}

/// Arrays that all states of a run have in common, compressed once, by name.
#[derive(Default)]
pub struct Constants(BTreeMap<String, Arc<[u8]>>);

impl Constants {
    fn encoded(&mut self, array: &Array) -> Arc<[u8]> {
        if !array.constant {
            return encode(array).into();
        }
        let known = self.0.entry(array.name.to_owned()).or_insert_with(|| encode(array).into());
        Arc::clone(known)
    }
}

impl Appended {
    /// Compresses the numbers of an array unless they are among `constants`, or only measures them.
    pub(super) fn of(array: &Array, compress: bool, constants: &mut Constants) -> Self {
        if compress { Self::Compressed(constants.encoded(array)) } else { Self::Raw(array.n_bytes()) }
    }

    /// Bytes in the file, the header included.
    pub(super) fn n_bytes(&self) -> u64 {
        match self {
            Self::Raw(size) => 8 + size,
            Self::Compressed(bytes) => bytes.len() as u64,
        }
    }

    /// Writes header and numbers; raw ones through a buffer of bounded size.
    pub(super) fn write(self, array: &Array, out: &mut impl Write) -> io::Result<()> {
        match self {
            Self::Raw(size) => {
                out.write_all(&size.to_le_bytes())?;
                chunks(array, CHUNK, |numbers| out.write_all(numbers))
            }
            Self::Compressed(bytes) => out.write_all(&bytes),
        }
    }
}

/// Gives the numbers of an array in chunks of `size` bytes, of which the last may be shorter.
fn chunks(array: &Array, size: usize, mut take: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
    let mut buffer = Vec::with_capacity(size + array.components * array.width);
    for tuple in 0..array.tuples {
        (array.put)(tuple, &mut buffer);
        if buffer.len() >= size {
            take(&buffer[..size])?;
            buffer.drain(..size);
        }
    }
    if buffer.is_empty() { Ok(()) } else { take(&buffer) }
}

/// At which level a block is compressed.
fn level_of(block: &[u8]) -> u8 {
    let Some(sample) = block.get(..SAMPLE) else { return LEVEL };
    let left = compress_to_vec_zlib(sample, LEVEL).len();
    if left as f64 > WORTH * SAMPLE as f64 { STORED } else { LEVEL }
}

/// Header and blocks of an array.
fn encode(array: &Array) -> Vec<u8> {
    let size = array.n_bytes();
    let mut sizes: Vec<u64> = vec![size.div_ceil(BLOCK as u64), BLOCK as u64, size % BLOCK as u64];
    let mut blocks = Vec::new();
    let compressed = chunks(array, BLOCK, |numbers| {
        let block = compress_to_vec_zlib(numbers, level_of(numbers));
        sizes.push(block.len() as u64);
        blocks.extend_from_slice(&block);
        Ok(())
    });
    debug_assert!(compressed.is_ok(), "a block in memory takes what it is given");
    sizes.iter().flat_map(|size| size.to_le_bytes()).chain(blocks).collect()
}

/// The numbers of an array whose header stands at the start of `bytes`, of which it must have `expected` bytes.
///
/// # Errors
/// What is wrong with them.
pub(super) fn decode(bytes: &[u8], compressed: bool, expected: usize) -> Result<Vec<u8>, String> {
    let word = |index: u64| -> Result<u64, String> {
        let start =
            usize::try_from(8 * index).map_err(|_| "a header too long for this machine".to_owned())?;
        let word = bytes.get(start..start + 8).and_then(|word| word.try_into().ok());
        word.map(u64::from_le_bytes).ok_or_else(|| "the file ends within a header".to_owned())
    };
    if !compressed {
        let size = word(0)?;
        if size != expected as u64 {
            return Err(format!("{size} bytes where {expected} were announced"));
        }
        return bytes
            .get(8..8 + expected)
            .map(<[u8]>::to_vec)
            .ok_or_else(|| "the file ends within it".into());
    }
    let (n_blocks, block, last) = (word(0)?, word(1)?, word(2)?);
    if n_blocks > MOST_BLOCKS || block > 1 << 30 || last > block {
        return Err(format!("a header of {n_blocks} blocks of {block} bytes, the last of {last}"));
    }
    let mut numbers = Vec::new();
    let mut at = 8 * (3 + n_blocks);
    for index in 0..n_blocks {
        let size = word(3 + index)?;
        let end = at.checked_add(size).ok_or("a block too long for any file")?;
        let stream = usize::try_from(at).ok().zip(usize::try_from(end).ok());
        let stream = stream.and_then(|(at, end)| bytes.get(at..end)).ok_or("the file ends within a block")?;
        let limit = if index + 1 == n_blocks && last > 0 { last } else { block };
        let raw = decompress_to_vec_zlib_with_limit(stream, limit as usize)
            .map_err(|error| format!("block {index} is damaged: {error}"))?;
        if numbers.len() + raw.len() > expected {
            return Err(format!("more than the {expected} bytes that were announced"));
        }
        numbers.extend_from_slice(&raw);
        at = end;
    }
    if numbers.len() != expected {
        return Err(format!("{} bytes where {expected} were announced", numbers.len()));
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(n: usize) -> Array<'static> {
        Array::f64("wave", n, |i| [(i as f64 * 0.01).sin(), 0.0, i as f64])
    }

    fn raw(n: usize) -> Vec<u8> {
        let mut numbers = Vec::new();
        (0..n).for_each(|i| (array(n).put)(i, &mut numbers));
        numbers
    }

    #[test]
    fn numbers_come_back_from_any_number_of_blocks() {
        // None, a part of one, exactly two (24 bytes a tuple, 2^18 divides 3 * 2^18), and some.
        for n in [0, 1, 1000, 2 * BLOCK / 8, 50_000] {
            for compress in [false, true] {
                let mut bytes = Vec::new();
                let appended = Appended::of(&array(n), compress, &mut Constants::default());
                let size = appended.n_bytes();
                appended.write(&array(n), &mut bytes).expect("into memory");
                assert_eq!(bytes.len() as u64, size);
                bytes.extend_from_slice(b"what comes after");
                assert_eq!(decode(&bytes, compress, 24 * n), Ok(raw(n)), "{n} tuples, {compress}");
            }
        }
    }

    #[test]
    fn numbers_without_a_pattern_are_stored_and_come_back() {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let noise: Vec<f64> = (0..2 * BLOCK / 8)
            .map(|_| {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                f64::from_bits(state)
            })
            .collect();
        // The first block is noise, the second does not begin with it.
        let of = |i: usize| if (BLOCK / 8..=BLOCK / 8 + SAMPLE).contains(&i) { 1.0 } else { noise[i] };
        let bytes = encode(&Array::f64("noise", noise.len(), |i| [of(i)]));
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight")) as usize;
        assert!((BLOCK..BLOCK + 64).contains(&word(24)), "{} bytes stored", word(24));
        assert!(word(32) < BLOCK, "{} bytes compressed", word(32));
        let raw: Vec<u8> = (0..noise.len()).flat_map(|i| of(i).to_le_bytes()).collect();
        assert!(decode(&bytes, true, raw.len()) == Ok(raw));
    }

    #[test]
    fn constants_are_compressed_once_and_others_each_time() {
        let mut constants = Constants::default();
        let mut encoded = |array: Array| constants.encoded(&array).to_vec();
        let first = encoded(array(1000).constant());
        assert_eq!(encoded(array(1000)), first);
        assert_ne!(encoded(array(999)), first, "nobody said that it is constant");
        let other = Array::f64("wave", 1000, |_| [0.5]);
        assert_eq!(encoded(other.constant()), first, "it is known by its name");
    }

    #[test]
    fn header_is_that_of_vtk() {
        let bytes = encode(&array(12_000));
        let words: Vec<u64> =
            bytes[..40].chunks(8).map(|w| u64::from_le_bytes(w.try_into().expect("chunks of 8"))).collect();
        assert_eq!(words[..3], [2, BLOCK as u64, 288_000 - BLOCK as u64]);
        assert_eq!(words[3] + words[4] + 40, bytes.len() as u64);
    }

    #[test]
    fn damage_is_an_error_and_never_a_panic() {
        let bytes = encode(&array(20_000));
        for end in [0, 7, 8, 23, 30, 100, bytes.len() - 1] {
            decode(&bytes[..end], true, 480_000).expect_err("cut short");
        }
        for (at, value) in [(0, 9), (7, 0xff), (10, 1), (15, 0xff), (24, 3), (31, 0x7f), (60, 0x55)] {
            let mut wrong = bytes.clone();
            wrong[at] = value;
            decode(&wrong, true, 480_000).expect_err("a byte changed");
        }
        decode(&bytes, true, 479_976).expect_err("fewer announced");
        decode(&bytes, true, 480_024).expect_err("more announced");
        decode(&bytes, false, 480_000).expect_err("not raw");
    }
}
