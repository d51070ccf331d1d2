//! FUZZ: what others may send, written or pasted, damaged in every way, into everything that reads it.
//!
//! Each [`Target`] takes an input drawn from a seed: a good one from a corpus of its own, damaged by a few [`Draws`] (flipped,
//! changed, cut, doubled and spliced bytes; lengths and floats of the kind that hurt). It may refuse the input in words; it
//! may not panic, and what it accepts it must be able to go on with. A finding is a target and a number.

mod said;
mod targets;

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::{Duration, Instant},
};

pub use targets::{Target, all};

use crate::seeds::Draws;

/// The target of this name.
///
/// # Panics
/// If there is none.
pub fn named(name: &str) -> Box<dyn Target> {
    let target = all().into_iter().find(|target| target.name() == name);
    target.unwrap_or_else(|| panic!("no target {name:?}"))
}

/// What became of many inputs.
#[derive(Clone, Debug, Default)]
pub struct Count {
    /// Inputs that were tried.
    pub inputs: u64,
    /// Of these, taken for good ones.
    pub taken: u64,
    /// The numbers of those that made the target panic, with its words; the first few.
    pub findings: Vec<(u64, String)>,
}

/// Tries inputs from number `first` on, for as many or for as long as is said.
pub fn attack(target: &mut dyn Target, first: u64, inputs: u64, time: Duration) -> Count {
    let (mut count, started) = (Count::default(), Instant::now());
    while count.inputs < inputs && started.elapsed() < time {
        let number = first + count.inputs;
        count.inputs += 1;
        match catch_unwind(AssertUnwindSafe(|| target.attack(&mut Draws::new(number)))) {
            Ok(taken) => count.taken += u64::from(taken),
            Err(panic) => {
                let words = panic.downcast_ref::<String>().cloned();
                let words = words.or_else(|| panic.downcast_ref::<&str>().map(|&words| words.to_owned()));
                count.findings.push((number, words.unwrap_or_default()));
                if count.findings.len() >= 5 {
                    break;
                }
            }
        }
    }
    count
}

/// Damages bytes in one to four ways; one input in twenty stays whole.
pub fn damage(bytes: &mut Vec<u8>, draws: &mut Draws) {
    if draws.below(20) == 0 {
        return;
    }
    for _ in 0..=draws.below(4) {
        let n = bytes.len() as u64;
        if n == 0 {
            bytes.push(draws.below(256) as u8);
            continue;
        }
        let at = draws.below(n) as usize;
        match draws.below(9) {
            0 => bytes[at] ^= 1 << draws.below(8),
            1 => bytes[at] = draws.below(256) as u8,
            2 => bytes.truncate(at),
            3 => bytes.insert(at, draws.below(256) as u8),
            4 => {
                bytes.remove(at);
            }
            5 => {
                let end = at + draws.below(16).min(n - at as u64) as usize;
                let piece = bytes[at..end].to_vec();
                let to = draws.below(n) as usize;
                bytes.splice(to..to, piece);
            }
            kind => {
                let hurtful: [u64; 10] = [
                    0,
                    1,
                    u64::MAX,
                    1 << 63,
                    u64::from(u32::MAX),
                    1 << 40,
                    f64::NAN.to_bits(),
                    f64::INFINITY.to_bits(),
                    f64::MIN_POSITIVE.to_bits(),
                    (-1e300_f64).to_bits(),
                ];
                let word = hurtful[draws.below(10) as usize].to_le_bytes();
                let length = if kind == 6 { 4 } else { 8 };
                for (byte, new) in bytes[at..].iter_mut().zip(&word[..length]) {
                    *byte = *new;
                }
            }
        }
    }
}
