//! Exact sums: terms rounded once to a multiple of a quantum add in any order to the same bits.
//!
//! Addition of `f64` is exact, hence associative, while every term is a multiple of one quantum `q` (a power
//! of two) and every partial sum stays below `2^53 q`. This is the one-bin form of the reproducible sums of
//! Demmel and Nguyen (2013). A term is rounded by adding and taking away `M = 1.5 * 2^52 * q`, which is right
//! for `|x| < 2^51 q`.

use serde::{Deserialize, Serialize};

use crate::lanes::{Lane, scalar::Scalar};

/// Bits of the reference of forces in quanta: a term may then reach 32 references (`2^47 q`) and 64 terms add without overflow.
pub const FORCE_BITS: i32 = 42;
/// The same of energies, of which sums over all nodes and elements may reach 16 references before their quantum grows.
pub const ENERGY_BITS: i32 = 46;
/// The same of momenta.
pub const MOMENTUM_BITS: i32 = 50;

/// A power of two to whose multiples terms of one kind are rounded before they are added.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantum {
    q: f64,
}

impl Quantum {
    /// The quantum at which a reference magnitude is `2^bits` quanta.
    ///
    /// # Panics
    /// If `reference` is not a positive finite number or the quantum would leave the range of normal numbers.
    pub fn for_reference(reference: f64, bits: i32) -> Self {
        assert!(reference.is_finite() && reference > 0.0, "reference magnitude {reference} must be positive");
        let quantum = Self::if_normal(reference, bits);
        quantum.unwrap_or_else(|| panic!("quantum out of range for reference {reference:e} of {bits} bits"))
    }

    /// The same; none where there is no such quantum.
    pub fn if_normal(reference: f64, bits: i32) -> Option<Self> {
        let exponent = ((reference.to_bits() >> 52) & 0x7ff) as i32 - 1022 - bits;
        let is_good = reference.is_finite() && reference > 0.0 && (-1000..900).contains(&exponent);
        is_good.then(|| Self { q: power_of_two(exponent) })
    }

    /// This quantum times a power of two.
    pub fn times(self, power_of_two: f64) -> Self {
        Self { q: self.q * power_of_two }
    }

    pub fn value(self) -> f64 {
        self.q
    }

    /// The quantum that is `2^bits` times as large: sums of so many more terms stay exact.
    #[must_use]
    pub fn coarser(self, bits: u32) -> Self {
        Self { q: self.q * power_of_two(bits as i32) }
    }

    /// The number `M` that rounds when added and taken away.
    pub fn magic(self) -> f64 {
        self.q * (1.5 * 4_503_599_627_370_496.0)
    }

    /// `x` rounded to the nearest multiple, ties to even. Right for `|x| < 2^51 q`.
    #[inline(always)]
    pub fn round(self, x: f64) -> f64 {
        let m = self.magic();
        (x + m) - m
    }

    /// This quantum for increments of this cycle.
    #[inline(always)]
    pub fn dithered(self, cycle: u64) -> Dithered {
        // Multiples of the golden ratio, their fractions: 2^64 are a turn.
        let turned = cycle.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11;
        Dithered { quantum: self, phase: turned as f64 / (1_u64 << 53) as f64 }
    }

    /// Largest magnitude a single term may have: `2^47 q`.
    pub fn term_bound(self) -> f64 {
        self.q * 140_737_488_355_328.0
    }

    /// Magnitude of a sum of any number of terms at which a coarser quantum is asked for: `2^50 q`, an eighth of what is exact, for a
    /// sum goes on growing until the coarser one acts.
    pub fn sum_bound(self) -> f64 {
        self.q * 1_125_899_906_842_624.0
    }

    /// Magnitude of a term of forces at which a coarser quantum is asked for: `2^44 q`.
    pub fn rescale_bound(self) -> f64 {
        self.q * 17_592_186_044_416.0
    }
}

/// A quantum for increments that add up over many cycles, such as the work of a load on a node.
///
/// An increment below half a quantum would be lost in every cycle if it were rounded to the nearest multiple. So a *dither* is added
/// first, evenly spread over one quantum, and what is booked comes to what was done on average. It follows from the cycle and the increment
/// itself (a Weyl sequence that begins at the increment's own low bits), so it is the same wherever the increment is booked. An increment of
/// zero stays zero.
#[derive(Clone, Copy, Debug)]
pub struct Dithered {
    quantum: Quantum,
    /// Of this cycle, in quanta.
    phase: f64,
}

/// Quanta up to which an increment is dithered: more lose at most two thousandths by rounding.
const DITHERED: f64 = 256.0;
/// Low bits of an increment of one quantum that choose its dither.
const LOW_BITS: f64 = (1_u64 << 40) as f64;

impl Dithered {
    /// `x` rounded to one of the multiples around it, as [`Quantum::round`] where it is large.
    pub fn round(self, x: f64) -> f64 {
        self.round_lanes(Scalar(x)).0
    }

    /// Each lane likewise.
    #[inline(always)]
    pub(crate) fn round_lanes<L: Lane>(self, x: L) -> L {
        let q = self.quantum.value();
        // Plain products and sums: outside of kernels a fused one is a call.
        let chosen = x * L::splat(LOW_BITS / q) + L::splat(self.phase);
        let whole = rounded(chosen, L::splat(Quantum { q: 1.0 }.magic()));
        let dither = L::select(x.abs().less(L::splat(DITHERED * q)), chosen - whole, L::splat(0.0));
        rounded(x + dither * L::splat(q), L::splat(self.quantum.magic()))
    }
}

/// The quanta of a run's sums; all but that of arms grow where sums near what is exact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quanta {
    /// Forces.
    pub force: Quantum,
    /// Energies.
    pub energy: Quantum,
    /// Momenta.
    pub momentum: Quantum,
    /// Quantum of moments over that of forces, a power of two (length).
    pub arm: f64,
}

/// Whether sums are exact: always, but in builds that measure what that costs (feature `plain-sums`).
pub(crate) const EXACT: bool = !cfg!(feature = "plain-sums");

/// Each lane rounded to the nearest multiple of the quantum whose [`Quantum::magic`] this is, as [`Quantum::round`] does it.
#[inline(always)]
pub(crate) fn rounded<L: Lane>(x: L, magic: L) -> L {
    if EXACT { (x + magic) - magic } else { x }
}

/// `2^exponent` for exponents of normal numbers.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_terms_add_to_the_same_bits_in_any_order() {
        let q = Quantum::for_reference(3.7e9, 42);
        let mut seed = 88172645463325252_u64;
        let mut terms: Vec<f64> = (0..64)
            .map(|_| {
                seed ^= seed << 13;
                seed ^= seed >> 7;
                seed ^= seed << 17;
                q.round((seed as f64 / u64::MAX as f64 - 0.5) * 1e11)
            })
            .collect();
        let forward: f64 = terms.iter().sum();
        terms.reverse();
        let backward: f64 = terms.iter().sum();
        terms.sort_by(f64::total_cmp);
        let sorted: f64 = terms.iter().sum();
        assert_eq!(forward.to_bits(), backward.to_bits());
        assert_eq!(forward.to_bits(), sorted.to_bits());
    }

    #[test]
    fn increments_below_half_a_quantum_add_up_to_what_was_done() {
        let q = Quantum::for_reference(1.0, 46);
        let unit = q.value();
        for increment in [0.03, 0.21, 0.5, -0.3, 1.4, 17.3, 4000.25] {
            // The same in each cycle, and one that grows.
            for growth in [0.0, 1e-7] {
                let (mut booked, mut done, mut nearest) = (0.0, 0.0, 0.0);
                for cycle in 0..10_000_u32 {
                    let x = unit * increment * (1.0 + growth * f64::from(cycle));
                    booked += q.dithered(cycle.into()).round(x);
                    nearest += q.round(x);
                    done += x;
                }
                assert!((booked - done).abs() < 1e-3_f64.mul_add(done.abs(), 60.0 * unit), "{booked} {done}");
                assert_eq!(booked, q.round(booked));
                if increment == 0.03 {
                    assert_eq!(nearest, 0.0);
                }
            }
        }
        for cycle in 0..1000 {
            assert_eq!(q.dithered(cycle).round(0.0), 0.0);
            let large = 1e12 * unit + 0.25 * unit;
            assert_eq!(q.dithered(cycle).round(large), q.round(large));
        }
    }

    #[test]
    fn reference_stands_between_half_and_whole_of_two_to_the_bits() {
        for reference in [1.0, 1.5, 1.99, 2.0, 1e-12, 7e17] {
            let q = Quantum::for_reference(reference, 42);
            let quanta = reference / q.value();
            assert!((2f64.powi(41)..=2f64.powi(42)).contains(&quanta), "{reference}: {quanta}");
        }
    }
}
