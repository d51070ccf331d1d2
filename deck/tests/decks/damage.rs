//! Damaged decks: what they are drawn by, and what reading one comes to.

use deck::Fault;

/// xorshift64*: a seeded stream of numbers, so that a failure can be repeated.
pub struct Stream(pub u64);

impl Stream {
    /// A number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n
    }
}

/// Reads a deck that was damaged by `seed`: gives whether it is a model still.
///
/// # Panics
/// If the model has a node nowhere, or the faults of the deck have no place in it.
pub fn is_read(deck: &str, name: &str, seed: u64) -> bool {
    match deck::read(deck, name) {
        Ok(model) => {
            assert!(model.mesh.positions.iter().flatten().all(|x| x.is_finite()), "seed {seed}");
            true
        }
        Err(faults) => {
            let lines = deck.split('\n').count() as u32;
            assert!(!faults.is_empty(), "seed {seed}");
            let placed = |f: &Fault| (1..=lines).contains(&f.line) && f.column > 0;
            assert!(faults.iter().all(placed), "seed {seed}: {}", faults[0]);
            false
        }
    }
}
