//! Points that fill a box: Latin hypercubes and Sobol sequences, equal to the last bit on every machine.
//!
//! All is done in whole numbers; the one conversion, from 32 or 53 bits to a fraction, is exact. Sobol sequences go by the direction numbers
//! of Joe and Kuo (2008, new-joe-kuo-6), shifted by a mask of the seed, which keeps their nets. Longer sequences begin with the shorter
//! ones, so a study that asks for more points later repeats none. The points of a Latin hypercube depend on their number.

use mechanics::draw::mixed;

/// Most parameters that are sampled together.
pub const MAX_DIMENSIONS: usize = 16;

/// How points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Along each parameter one point in each of as many equal slices as there are points.
    LatinHypercube,
    /// A digitally shifted Sobol sequence.
    Sobol,
}

/// `count` points of the unit box, each with a coordinate for every dimension.
///
/// # Panics
/// If there are more than [`MAX_DIMENSIONS`].
pub fn points(kind: Kind, count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    assert!(dimensions <= MAX_DIMENSIONS, "{dimensions} dimensions, at most {MAX_DIMENSIONS}");
    let by_dimension: Vec<Vec<f64>> = (0..dimensions)
        .map(|d| match kind {
            Kind::LatinHypercube => slices(count, Numbers::new(seed, d)),
            Kind::Sobol => sobol(count, d, (mixed(seed ^ mixed(d as u64)) >> 32) as u32),
        })
        .collect();
    (0..count).map(|n| by_dimension.iter().map(|column| column[n]).collect()).collect()
}

/// Pseudo-random numbers: splitmix64.
struct Numbers(u64);

impl Numbers {
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

    fn new(seed: u64, dimension: usize) -> Self {
        Self(mixed(seed ^ mixed(dimension as u64)))
    }

    fn next(&mut self) -> u64 {
        let number = mixed(self.0);
        self.0 = self.0.wrapping_add(Self::STEP);
        number
    }

    /// A number from 0 to below 1, of 53 bits.
    fn fraction(&mut self) -> f64 {
        const PARTS: f64 = 9_007_199_254_740_992.0;
        (self.next() >> 11) as f64 / PARTS
    }

    /// A whole number below `n`, each as probable as the others to a part in 2^64.
    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }
}

/// One coordinate of a Latin hypercube: each slice once, in the order of a shuffle, with a place inside of it.
fn slices(count: usize, mut numbers: Numbers) -> Vec<f64> {
    let mut slice: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        slice.swap(last, numbers.below(last + 1));
    }
    slice.into_iter().map(|n| (n as f64 + numbers.fraction()) / count as f64).collect()
}

/// Degree of the polynomial, its inner coefficients, and the first direction numbers of dimensions 2 to 16.
const JOE_KUO: [(u32, u32, &[u32]); MAX_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
];

/// Direction numbers of a dimension, from 0.
fn directions(dimension: usize) -> [u32; 32] {
    let mut v: [u32; 32] = std::array::from_fn(|bit| 1 << (31 - bit));
    let Some((degree, coefficients, first)) = dimension.checked_sub(1).map(|d| JOE_KUO[d]) else { return v };
    let s = degree as usize;
    for bit in 0..32 {
        v[bit] = if bit < s {
            first[bit] << (31 - bit)
        } else {
            (1..s)
                .filter(|k| coefficients >> (s - 1 - k) & 1 == 1)
                .fold(v[bit - s] ^ (v[bit - s] >> s), |sum, k| sum ^ v[bit - k])
        };
    }
    v
}

/// One coordinate of a Sobol sequence in the order of Gray codes, with all bits of `shift` flipped.
fn sobol(count: usize, dimension: usize, shift: u32) -> Vec<f64> {
    const PARTS: f64 = 4_294_967_296.0;
    let v = directions(dimension);
    let mut x = 0;
    (0..count)
        .map(|n| {
            let point = f64::from(x ^ shift) / PARTS;
            x ^= v[(n.trailing_ones() as usize).min(31)];
            point
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unshifted_sequences_are_those_of_joe_and_kuo() {
        // The first rows that their own program prints for three dimensions.
        let columns = [0, 1, 2].map(|d| sobol(8, d, 0));
        assert_eq!(columns[0], [0.0, 0.5, 0.75, 0.25, 0.375, 0.875, 0.625, 0.125]);
        assert_eq!(columns[1], [0.0, 0.5, 0.25, 0.75, 0.375, 0.875, 0.125, 0.625]);
        assert_eq!(columns[2], [0.0, 0.5, 0.25, 0.75, 0.625, 0.125, 0.875, 0.375]);
    }

    #[test]
    fn any_power_of_two_of_sobol_points_has_one_in_each_slice_of_each_dimension() {
        for (kind, count) in [(Kind::Sobol, 256), (Kind::LatinHypercube, 250)] {
            for seed in 0..4 {
                let all = points(kind, count, MAX_DIMENSIONS, seed);
                for d in 0..MAX_DIMENSIONS {
                    let mut slices: Vec<usize> = all.iter().map(|p| (p[d] * count as f64) as usize).collect();
                    slices.sort_unstable();
                    assert!(slices.into_iter().eq(0..count), "{kind:?} of seed {seed}, dimension {d}");
                }
            }
        }
    }

    #[test]
    fn a_longer_sobol_sequence_begins_with_the_shorter_one() {
        assert_eq!(points(Kind::Sobol, 100, 3, 5)[..37], points(Kind::Sobol, 37, 3, 5));
        assert_ne!(points(Kind::Sobol, 4, 3, 5), points(Kind::Sobol, 4, 3, 6));
    }

    /// The first two dimensions are a (0, 2)-sequence: every dyadic box of the right size has one point.
    #[test]
    fn the_first_two_dimensions_fill_boxes_of_every_shape() {
        let all = points(Kind::Sobol, 64, 2, 9);
        for wide in 0..=6 {
            let (columns, rows) = (1 << wide, 64 >> wide);
            let mut boxes: Vec<usize> = all
                .iter()
                .map(|p| (p[0] * columns as f64) as usize * rows + (p[1] * rows as f64) as usize)
                .collect();
            boxes.sort_unstable();
            assert!(boxes.into_iter().eq(0..64), "{columns} by {rows}");
        }
    }

    #[test]
    fn points_have_these_bits_on_every_machine() {
        // From a second implementation, in Python.
        let bits = |kind| points(kind, 5, 2, 42)[3].iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(Kind::Sobol), [0x3fab_367e_3c00_0000, 0x3fe7_d676_7280_0000]);
        assert_eq!(bits(Kind::LatinHypercube), [0x3fdb_fe41_a456_af1b, 0x3fde_d5a1_7ff2_56d8]);
    }
}
