//! Logarithm, exponential, power and cube root on lanes: the platform's differ from machine to machine, these
//! give one result on every width.
//!
//! The logarithm is fdlibm's (Sun, 1993: `s = f / (2 + f)`, a polynomial in `s^2` with error below 2^-58); the
//! power carries it in two pieces, so that its error stays a few units in the last place while
//! `|y ln x| < 100`.

use super::Lane;

const LN2_HI: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
/// `1.5 * 2^52`: added and taken away, it rounds to a whole number.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// Largest magnitude of an exponent; beyond it [`exp`] saturates.
const LARGEST: f64 = 708.0;
const SMALLEST_NORMAL: f64 = f64::MIN_POSITIVE;

/// `ln(1 + f) - f + f^2 / 2` and `f^2 / 2`, for `1 + f` between sqrt(1/2) and sqrt(2).
#[inline(always)]
fn log1p_tail<L: Lane>(f: L) -> (L, L) {
    let s = f / (L::splat(2.0) + f);
    let z = s * s;
    let w = z * z;
    let odd = L::splat(1.531_383_769_920_937_3e-1)
        .mul_add(w, L::splat(2.222_219_843_214_978_4e-1))
        .mul_add(w, L::splat(3.999_999_999_940_942e-1))
        * w;
    let even = L::splat(1.479_819_860_511_658_6e-1)
        .mul_add(w, L::splat(1.818_357_216_161_805e-1))
        .mul_add(w, L::splat(2.857_142_874_366_239e-1))
        .mul_add(w, L::splat(6.666_666_666_666_735e-1))
        * z;
    let half_square = L::splat(0.5) * f * f;
    (s * (half_square + (odd + even)), half_square)
}

/// Natural logarithm of positive normal numbers.
#[inline(always)]
pub fn ln<L: Lane>(x: L) -> L {
    let (k, m) = x.split();
    let f = m - L::splat(1.0);
    let (tail, half_square) = log1p_tail(f);
    let small = half_square - k.mul_add(L::splat(LN2_LO), tail);
    k.mul_add(L::splat(LN2_HI), f - small)
}

/// Logarithm in two pieces, `high + low`.
#[inline(always)]
fn ln_pieces<L: Lane>(x: L) -> (L, L) {
    let (k, m) = x.split();
    let f = m - L::splat(1.0);
    let (tail, half_square) = log1p_tail(f);
    let half_square_low = (L::splat(0.5) * f).mul_add(f, -half_square);
    // k ln2_hi is exact and zero or larger than f, which is larger than f^2 / 2: both sums lose nothing.
    let whole = k * L::splat(LN2_HI);
    let with_f = whole + f;
    let lost_f = (whole - with_f) + f;
    let with_square = with_f - half_square;
    let lost_square = (with_f - with_square) - half_square;
    let low = k.mul_add(L::splat(LN2_LO), tail) + ((lost_f + lost_square) - half_square_low);
    let high = with_square + low;
    (high, (with_square - high) + low)
}

/// `e^(x + low)` for a `low` that is tiny beside 1.
#[inline(always)]
fn exp_pieces<L: Lane>(x: L, low: L) -> L {
    let x = x.max(L::splat(-LARGEST)).min(L::splat(LARGEST));
    let k = (x.mul_add(L::splat(std::f64::consts::LOG2_E), L::splat(WHOLE))) - L::splat(WHOLE);
    let r = k.neg_mul_add(L::splat(LN2_LO), k.neg_mul_add(L::splat(LN2_HI), x)) + low;
    let square = r * r;
    let fourth = square * square;
    // Taylor to degree 13, in even and odd halves of short chains: below 5e-18 for |r| <= ln(2)/2.
    let p0 = r.mul_add(L::splat(1.0 / 6.0), L::splat(0.5));
    let p1 = r.mul_add(L::splat(1.0 / 120.0), L::splat(1.0 / 24.0));
    let p2 = r.mul_add(L::splat(1.0 / 5040.0), L::splat(1.0 / 720.0));
    let p3 = r.mul_add(L::splat(1.0 / 362_880.0), L::splat(1.0 / 40_320.0));
    let p4 = r.mul_add(L::splat(1.0 / 39_916_800.0), L::splat(1.0 / 3_628_800.0));
    let p5 = r.mul_add(L::splat(1.0 / 6_227_020_800.0), L::splat(1.0 / 479_001_600.0));
    let high = p5.mul_add(square, p4).mul_add(fourth, p3.mul_add(square, p2));
    let poly = high.mul_add(fourth, p1.mul_add(square, p0));
    (L::splat(1.0) + poly.mul_add(square, r)) * k.power_of_two()
}

/// Exponential; saturates beyond magnitudes of 708.
#[inline(always)]
pub fn exp<L: Lane>(x: L) -> L {
    exp_pieces(x, L::splat(0.0))
}

/// `x^y` for x >= 0; zero where x is zero or subnormal, so y is to be positive there. Saturates like [`exp`].
#[inline(always)]
pub fn pow<L: Lane>(x: L, y: L) -> L {
    let tiny = x.less(L::splat(SMALLEST_NORMAL));
    let (high, low) = ln_pieces(L::select(tiny, L::splat(1.0), x));
    let product = y * high;
    let rest = y.mul_add(low, y.mul_add(high, -product));
    L::select(tiny, L::splat(0.0), exp_pieces(product, rest))
}

/// Cube root of positive normal numbers: the power by thirds, and one step of Newton.
#[inline(always)]
pub fn cbrt<L: Lane>(x: L) -> L {
    let root = exp(ln(x) * L::splat(1.0 / 3.0));
    let square = root * root;
    let excess = square.mul_add(root, -x);
    root - excess / (L::splat(3.0) * square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Width, dispatch::Task, scalar::Scalar};

    fn seeded(n: usize) -> impl Iterator<Item = f64> {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        (0..n).map(move |_| {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        })
    }

    fn ulps(ours: f64, theirs: f64) -> f64 {
        let ulp = f64::from_bits(theirs.abs().to_bits() + 1) - theirs.abs();
        ((ours - theirs) / ulp).abs()
    }

    /// Not with those of the platform: the powers of mingw are further off.
    #[test]
    fn functions_agree_with_those_of_libm_to_a_few_units_in_the_last_place() {
        let draws: Vec<f64> = seeded(60_000).collect();
        for pair in draws.chunks_exact(2) {
            let x = libm::exp(pair[0] * 1200.0 - 600.0);
            assert!(ulps(ln(Scalar(x)).0, libm::log(x)) <= 2.0, "ln {x}");
            let near = 0.5 + pair[0];
            assert!(ulps(ln(Scalar(near)).0, libm::log(near)) <= 2.0, "ln {near}");
            let y = pair[1] * 1400.0 - 700.0;
            assert!(ulps(exp(Scalar(y)).0, libm::exp(y)) <= 2.0, "exp {y}");
            assert!(ulps(cbrt(Scalar(x)).0, libm::cbrt(x)) <= 2.0, "cbrt {x}");
            let base = libm::exp(pair[0] * 60.0 - 40.0);
            let power = pair[1] * 4.0 - 1.5;
            assert!(
                ulps(pow(Scalar(base), Scalar(power)).0, libm::pow(base, power)) <= 4.0,
                "{base}^{power}"
            );
        }
    }

    #[test]
    fn ends_of_the_ranges_are_exact() {
        assert_eq!(ln(Scalar(1.0)).0, 0.0);
        assert_eq!(exp(Scalar(0.0)).0, 1.0);
        assert_eq!(pow(Scalar(0.0), Scalar(0.31)).0, 0.0);
        assert_eq!(pow(Scalar(1.0), Scalar(0.31)).0, 1.0);
        assert_eq!(exp(Scalar(1e9)).0.to_bits(), exp(Scalar(708.0)).0.to_bits());
    }

    #[inline(always)]
    fn all<L: Lane>(x: &[f64], y: &[f64], out: &mut [f64]) {
        let mut at = 0;
        while at < x.len() {
            // SAFETY: the lengths are equal multiples of 8, `out` holds four times as many.
            unsafe {
                let (a, b) = (L::load(x, at), L::load(y, at));
                ln(a).store(out, at);
                exp(b).store(out, at + x.len());
                pow(a, b).store(out, at + 2 * x.len());
                cbrt(a).store(out, at + 3 * x.len());
            }
            at += L::N;
        }
    }

    struct All<'a> {
        x: &'a [f64],
        y: &'a [f64],
        out: &'a mut [f64],
    }

    impl Task for All<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lane>(self) {
            all::<L>(self.x, self.y, self.out);
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let n = 4096;
        let x: Vec<f64> = seeded(n).map(|u| (u * 1000.0 - 500.0).exp()).collect();
        let y: Vec<f64> = seeded(n).map(|u| u * 1600.0 - 800.0).collect();
        let mut scalar = vec![0.0; 4 * n];
        all::<Scalar>(&x, &y, &mut scalar);
        for width in [Width::Avx2, Width::Avx512] {
            if let Err(error) = width.require() {
                println!("not compared: {error}");
                continue;
            }
            let mut wide = vec![0.0; 4 * n];
            width.run(All { x: &x, y: &y, out: &mut wide });
            for (at, (a, b)) in scalar.iter().zip(&wide).enumerate() {
                assert_eq!(a.to_bits(), b.to_bits(), "{width}, function {}, lane {}", at / n, at % n);
            }
        }
    }
}
