//! Lanes: one f64 calculation done on 1, 4 or 8 elements at a time, with one result on every width.
//!
//! [`Lane`] is the vocabulary of the kernels. A kernel is a generic `#[inline(always)]` function over `L: Lane`,
//! called from one of the `#[target_feature]` functions of [`dispatch`], which [`Width::run`] chooses; only inside them do
//! its operations become single instructions. Two rules keep the bits: lanes never mix, and a product that is
//! added to something is written as [`Lane::mul_add`] on every width (no compiler fuses by itself).
//! Closures do not inherit target features, so kernels have none.

use std::{
    fmt,
    ops::{Add, Div, Mul, Neg, Sub},
    str::FromStr,
};

pub(crate) mod apart;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
pub(crate) mod dispatch;
pub mod functions;
#[cfg(target_arch = "aarch64")]
pub(crate) mod neon;
pub mod scalar;
#[cfg(any(test, target_arch = "x86_64", target_arch = "aarch64"))]
pub(crate) mod twice;

/// Slots in a lane set: the grouping of elements is the same on every width, and the widest holds 8.
pub const SET: usize = 8;

/// `N` f64 values, each of which belongs to its own element.
///
/// Addition, subtraction, multiplication, division and square root are those of IEEE 754, rounded to nearest.
pub trait Lane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Number of values; divides [`SET`].
    const N: usize;
    /// One truth value per lane.
    type Mask: Copy;

    fn splat(x: f64) -> Self;
    /// `from[at..at + N]`.
    ///
    /// # Safety
    /// `at + N <= from.len()`.
    unsafe fn load(from: &[f64], at: usize) -> Self;
    /// Writes `to[at..at + N]`.
    ///
    /// # Safety
    /// `at + N <= to.len()`.
    unsafe fn store(self, to: &mut [f64], at: usize);
    /// `from[indices[at]], .. from[indices[at + N - 1]]`.
    ///
    /// # Safety
    /// `at + N <= indices.len()`; every index read is below `from.len()` and below 2^31.
    unsafe fn gather(from: &[f64], indices: &[u32], at: usize) -> Self;
    /// Entry `a` of the rows `from[indices[at]], .. from[indices[at + N - 1]]`, for each of the four.
    ///
    /// # Safety
    /// As [`Lane::gather`].
    unsafe fn rows(from: &[[f64; 4]], indices: &[u32], at: usize) -> [Self; 4];
    /// `from[at..at + N]` as they are, whole numbers.
    ///
    /// # Safety
    /// `at + N <= from.len()`; every number read is below 2^31.
    unsafe fn whole(from: &[u32], at: usize) -> Self;
    /// Writes whole numbers to `to[at..at + N]`, the inverse of [`Lane::whole`].
    ///
    /// # Safety
    /// `at + N <= to.len()`; every number is whole, from 0 to below 2^31.
    unsafe fn store_whole(self, to: &mut [u32], at: usize);

    /// `self * b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// `if self < other { self } else { other }`, which is x86's rule for NaN and signed zeros.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`.
    fn max(self, other: Self) -> Self;
    /// The larger of the magnitudes, for numbers that are not NaN.
    fn max_magnitude(self, other: Self) -> Self;

    /// `self < other`; false if either is NaN.
    fn less(self, other: Self) -> Self::Mask;
    /// `self <= other`; false if either is NaN.
    fn less_equal(self, other: Self) -> Self::Mask;
    /// `self == other`; false if either is NaN.
    fn equal(self, other: Self) -> Self::Mask;
    /// Lane `i` set where bit `i` is; higher bits are no matter.
    fn mask(bits: u32) -> Self::Mask;
    fn both(one: Self::Mask, other: Self::Mask) -> Self::Mask;
    fn either(one: Self::Mask, other: Self::Mask) -> Self::Mask;
    /// `yes` where the mask is set, else `no`. What is not chosen has no influence, NaN included.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Bit `i` is lane `i`.
    fn bits(mask: Self::Mask) -> u32;
    /// True if any lane is set.
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        Self::bits(mask) != 0
    }

    /// `(k, m)` with `self = m 2^k` and m between sqrt(1/2) and sqrt(2); for positive normal numbers.
    fn split(self) -> (Self, Self);
    /// `2^self` for whole numbers between -1022 and 1023.
    fn power_of_two(self) -> Self;

    /// The lanes moved up by one, zero in the first; and the last lane, which falls out.
    fn shifted_up(self) -> (Self, f64);

    /// Does a part of a kernel in a function of its own, which has the instructions of these lanes.
    fn apart<T: apart::Apart>(task: T);

    /// The lanes in order, zeros behind them.
    #[inline(always)]
    fn to_array(self) -> [f64; SET] {
        let mut values = [0.0; SET];
        // SAFETY: N divides SET, so the lanes fit.
        unsafe { self.store(&mut values, 0) };
        values
    }
}

/// Each of the numbers in all lanes. A loop, because the standard library's `map` is a call where the compiler does not inline it.
#[inline(always)]
pub fn splat_each<L: Lane, const K: usize>(numbers: &[f64; K]) -> [L; K] {
    let mut lanes = [L::splat(0.0); K];
    for i in 0..K {
        lanes[i] = L::splat(numbers[i]);
    }
    lanes
}

/// How many elements an instruction works on. The result does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Width {
    /// One element at a time.
    Scalar,
    /// Four in two registers, with NEON.
    Neon,
    /// Four, with AVX2 and FMA.
    Avx2,
    /// Eight, with AVX-512 F and DQ.
    Avx512,
}

impl Width {
    /// All widths, narrowest first.
    pub const ALL: [Width; 4] = [Width::Scalar, Width::Neon, Width::Avx2, Width::Avx512];

    /// The widest that this machine has.
    pub fn best() -> Width {
        Width::ALL.into_iter().rev().find(|width| width.available()).unwrap_or(Width::Scalar)
    }

    /// Whether this machine has the instructions.
    pub fn available(self) -> bool {
        match self {
            Width::Scalar => true,
            Width::Neon => cfg!(target_arch = "aarch64"),
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => {
                Width::Avx2.available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Width::Avx2 | Width::Avx512 => false,
        }
    }

    /// This width, if the machine has it.
    ///
    /// # Errors
    /// [`WidthError::Unavailable`].
    pub fn require(self) -> Result<Width, WidthError> {
        if self.available() { Ok(self) } else { Err(WidthError::Unavailable { width: self }) }
    }
}

impl fmt::Display for Width {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Width::Scalar => "scalar",
            Width::Neon => "neon",
            Width::Avx2 => "avx2",
            Width::Avx512 => "avx512",
        })
    }
}

impl FromStr for Width {
    type Err = WidthError;

    fn from_str(text: &str) -> Result<Self, WidthError> {
        let known = Width::ALL.into_iter().find(|width| width.to_string() == text);
        known.ok_or_else(|| WidthError::Unknown { text: text.to_owned() })
    }
}

/// Why a lane width cannot be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WidthError {
    /// The text names no width.
    Unknown {
        /// What was read.
        text: String,
    },
    /// The machine lacks the instructions.
    Unavailable {
        /// What was asked for.
        width: Width,
    },
}

impl fmt::Display for WidthError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WidthError::Unknown { text } => {
                write!(f, "lane width {text:?}, expected scalar, neon, avx2 or avx512; name one of them")
            }
            WidthError::Unavailable { width } => {
                let best = Width::best();
                write!(
                    f,
                    "lane width {width} is not on this machine, whose widest is {best}; use that, the result is the same"
                )
            }
        }
    }
}

impl std::error::Error for WidthError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_width_reads_back_from_its_name_and_others_are_named() {
        for width in Width::ALL {
            assert_eq!(width.to_string().parse(), Ok(width));
        }
        let error = "sse".parse::<Width>().expect_err("no such width");
        assert_eq!(
            error.to_string(),
            "lane width \"sse\", expected scalar, neon, avx2 or avx512; name one of them"
        );
        let missing = WidthError::Unavailable { width: Width::Avx512 }.to_string();
        assert!(missing.starts_with("lane width avx512 is not on this machine"), "{missing}");
    }

    /// Rows, whole numbers, equality and the joining of masks on one width, a value per lane.
    fn rows_and_masks<L: Lane>() {
        let from: Vec<[f64; 4]> =
            (0..40).map(|i| [0.0, 0.25, 0.5, 0.75].map(|part| f64::from(i) + part)).collect();
        let indices: Vec<u32> = (0..24).map(|i| (7 * i + 3) % 40).collect();
        for at in [0, 5, 16] {
            // SAFETY: eight indices are left behind `at`, each below the number of rows.
            let (rows, whole) = unsafe { (L::rows(&from, &indices, at), L::whole(&indices, at)) };
            let four = L::splat(f64::from(indices[at]));
            for lane in 0..L::N {
                let wanted = from[indices[at + lane] as usize];
                assert_eq!(rows.map(|row| row.to_array()[lane]), wanted);
                assert_eq!(whole.to_array()[lane], f64::from(indices[at + lane]));
            }
            let mut to = vec![u32::MAX; 24];
            // SAFETY: eight places are left behind `at`; the numbers are below 40.
            unsafe { whole.store_whole(&mut to, at) };
            for (i, number) in to.into_iter().enumerate() {
                let is_written = (at..at + L::N).contains(&i);
                assert_eq!(number, if is_written { indices[i] } else { u32::MAX });
            }
            assert_eq!(L::bits(whole.equal(four)), 1);
            assert_eq!(L::bits(whole.equal(whole)), (1 << L::N) - 1);
        }
        let nan = L::splat(f64::NAN);
        assert_eq!(L::bits(nan.equal(nan)), 0);
        for (one, other) in [(0b1010_0110, 0b0011_0101), (0, 0), (0, 0b1000_0001)] {
            let all = (1 << L::N) - 1;
            assert_eq!(L::bits(L::either(L::mask(one), L::mask(other))), (one | other) & all);
            assert_eq!(L::bits(L::both(L::mask(one), L::mask(other))), one & other & all);
        }
    }

    #[test]
    fn rows_and_masks_are_the_same_on_every_width() {
        rows_and_masks::<scalar::Scalar>();
        rows_and_masks::<twice::Twice<scalar::Scalar>>();
        #[cfg(target_arch = "aarch64")]
        {
            rows_and_masks::<neon::Neon>();
            rows_and_masks::<twice::Twice<neon::Neon>>();
        }
        #[cfg(target_arch = "x86_64")]
        if Width::Avx2.available() {
            rows_and_masks::<avx2::Avx2>();
            rows_and_masks::<twice::Twice<avx2::Avx2>>();
        }
        #[cfg(target_arch = "x86_64")]
        if Width::Avx512.available() {
            rows_and_masks::<avx512::Avx512>();
        }
    }

    #[test]
    fn the_best_width_is_available_and_required_without_error() {
        assert_eq!(Width::best().require(), Ok(Width::best()));
        assert!(Width::Scalar.available());
    }
}
