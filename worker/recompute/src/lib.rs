//! Computes a block of a run again, from what a checkpoint has of it, so that nobody needs to believe the machines that computed it.
//!
//! A *block file* is a [`Sample`] in bytes: 16 letters that say what it is, the release that computes it, the sample. The master gives the
//! one of its newest checkpoint (`GET /api/jobs/N/sample`). For WebAssembly this crate is the whole module, see `module.rs`: the physics of
//! every other platform, on one lane and one thread.
//!
//! As in `protocol::codec`, which does not compile for browsers, numbers are little-endian and of fixed size, and nothing is read
//! beyond a limit.

use mechanics::{lanes::Width, proof, sample::Sample};

#[cfg(target_family = "wasm")]
pub mod module;

/// How a block file begins.
const MAGIC: &[u8; 16] = b"BOLIDE BLOCK 01\n";
/// The longest block file (bytes). The blocks of a run have a few thousand elements, of some hundred bytes.
pub const LIMIT: usize = 256 << 20;

/// The release that computes a sample: another one may have other bits.
pub const RELEASE: &str = env!("CARGO_PKG_VERSION");

fn config() -> impl bincode::config::Config {
    bincode::config::standard().with_little_endian().with_fixed_int_encoding().with_limit::<LIMIT>()
}

/// The bytes of a block file.
///
/// # Errors
/// If it would be longer than [`LIMIT`].
pub fn write(sample: &Sample) -> Result<Vec<u8>, String> {
    let mut bytes = MAGIC.to_vec();
    let length = bincode::serde::encode_into_std_write((RELEASE, sample), &mut bytes, config())
        .map_err(|error| format!("the block cannot be written: {error}"))?;
    if length > LIMIT {
        return Err(format!(
            "a block of {length} bytes, at most {LIMIT} are given; run the job on more threads"
        ));
    }
    Ok(bytes)
}

/// The sample of a block file.
///
/// # Errors
/// If it is something else, damaged, or of another release.
pub fn read(bytes: &[u8]) -> Result<Sample, String> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err("this is no block of a run; ask a master for one at /api/jobs/N/sample".to_owned());
    };
    let damaged = |error| format!("the block is damaged: {error}");
    let (release, _) = bincode::serde::decode_from_slice::<String, _>(rest, config()).map_err(damaged)?;
    if release != RELEASE {
        return Err(format!(
            "the block is of Bolide {release:?}, this is {RELEASE}; compute it with that release"
        ));
    }
    let decoded = bincode::serde::decode_from_slice::<(String, Sample), _>(rest, config());
    let ((_, sample), length) = decoded.map_err(damaged)?;
    if length != rest.len() {
        return Err(format!("the block is damaged: {length} bytes are read, {} are there", rest.len()));
    }
    Ok(sample)
}

/// What was computed again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recomputed {
    pub cycle: u64,
    /// How many there are in the block.
    pub elements: usize,
    /// Of what the elements come to: 32 hexadecimal digits.
    pub hash: String,
    /// The proof of this machine's arithmetic, [`proof::digest`].
    pub proof: String,
}

/// Computes the block of a file again.
///
/// # Errors
/// As [`read`] and [`Sample::hash`].
pub fn recompute(bytes: &[u8]) -> Result<Recomputed, String> {
    let sample = read(bytes)?;
    let (cycle, elements) = (sample.cycle, sample.piece.elements.len());
    let hash = sample.hash(Width::best())?.iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(Recomputed { cycle, elements, hash, proof: proof::digest(Width::best()) })
}

/// As a line of JSON, `{"cycle", "elements", "hash", "proof"}` or `{"error"}`.
pub fn answer(bytes: &[u8]) -> String {
    match recompute(bytes) {
        Ok(Recomputed { cycle, elements, hash, proof }) => {
            format!(r#"{{"cycle":{cycle},"elements":{elements},"hash":"{hash}","proof":"{proof}"}}"#)
        }
        // Rust's escapes of quotes and backslashes are those of JSON, and the reasons have no other letters that need one.
        Err(reason) => format!(r#"{{"error":{reason:?}}}"#),
    }
}

#[cfg(test)]
mod tests {
    use mechanics::proof::sample;

    use super::*;

    #[test]
    fn a_block_is_the_same_after_its_way_through_a_file() {
        let sample = sample();
        let bytes = write(&sample).expect("short");
        assert_eq!(read(&bytes).as_ref(), Ok(&sample));
        let due: String =
            sample.clone().hash(Width::Scalar).expect("a block").iter().map(|b| format!("{b:02x}")).collect();
        let found = recompute(&bytes).expect("it computes");
        assert_eq!((&found.hash, found.elements), (&due, sample.piece.elements.len()));
        assert_eq!(found.proof, proof::of_this_machine());
        let mut other = sample;
        other.piece.v[0][0] *= 1.0 + 1e-6;
        let other = recompute(&write(&other).expect("short")).expect("it computes");
        assert_ne!(other.hash, due, "a millionth of one velocity");
    }

    #[test]
    fn what_is_no_block_or_damaged_or_of_another_release_is_refused() {
        let bytes = write(&sample()).expect("short");
        assert!(read(b"BOLIDE").expect_err("too short").contains("no block of a run"));
        for length in [16, 20, 30, bytes.len() / 2, bytes.len() - 1] {
            assert!(read(&bytes[..length]).expect_err("cut").contains("damaged"), "{length}");
        }
        assert!(read(&[&bytes[..], &[0]].concat()).expect_err("longer").contains("damaged"));
        let mut other = bytes.clone();
        // Behind the letters stand eight bytes of a length, then the release.
        other[24] = b'9';
        assert!(read(&other).expect_err("a release").contains("is of Bolide \"9.1.0\""));
        other[24] = 1;
        let words = r#"{"error":"the block is of Bolide \"\\u{1}.1.0\", this is 0.1.0; compute it with that release"}"#;
        assert_eq!(answer(&other), words, "it is JSON whatever letters the release has");
        let mut endless = bytes;
        endless[16..24].fill(0xff);
        assert!(read(&endless).expect_err("a length").contains("damaged"));
        assert_eq!(
            answer(b""),
            r#"{"error":"this is no block of a run; ask a master for one at /api/jobs/N/sample"}"#
        );
    }
}
