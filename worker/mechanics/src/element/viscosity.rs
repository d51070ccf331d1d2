//! Artificial viscosity, characteristic lengths and the Courant limit.
//!
//! With `S = sum_I B_I B_I^T` (B the volume gradient) a cube of side h has `S = h^4/2 I`. Two lengths follow:
//! `L_v = V / sqrt(2/3 tr S)`, an average, scales the viscosity; `L_e = V / sqrt(2 lambda_max(S))`, the thickness
//! however flat the element, limits the step.
//!
//! Viscosity acts in compression only, but its linear term enters the limit of every element in every cycle. If it came and went with
//! the sign of the rate of volume, the step would breathe with the vibration of a small free body and pump it.

use super::vector::Vector;
use crate::lanes::Lane;

/// The symmetric tensor `S` or a multiple of it.
#[derive(Clone, Copy)]
pub(crate) struct Spread<L> {
    pub xx: L,
    pub yy: L,
    pub zz: L,
    pub xy: L,
    pub yz: L,
    pub zx: L,
}

impl<L: Lane> Spread<L> {
    /// `512 S` from the vectors `64 G_m` of the gradient, since `S = 8 sum_m G_m G_m^T`.
    #[inline(always)]
    pub fn of(gradient: [&Vector<L>; 6]) -> Self {
        Self::gram(gradient)
    }

    /// `sum a a^T` over these vectors.
    #[inline(always)]
    pub fn gram<const N: usize>(vectors: [&Vector<L>; N]) -> Self {
        let a = vectors[0];
        let mut s =
            Self { xx: a.x * a.x, yy: a.y * a.y, zz: a.z * a.z, xy: a.x * a.y, yz: a.y * a.z, zx: a.z * a.x };
        let mut other = 1;
        while other < N {
            s.add(vectors[other]);
            other += 1;
        }
        s
    }

    /// `self : other`.
    #[inline(always)]
    pub fn contract(&self, other: &Self) -> L {
        let off = self.xy.mul_add(other.xy, self.yz.mul_add(other.yz, self.zx * other.zx));
        let on = self.xx.mul_add(other.xx, self.yy.mul_add(other.yy, self.zz * other.zz));
        L::splat(2.0).mul_add(off, on)
    }

    #[inline(always)]
    pub fn add(&mut self, g: &Vector<L>) {
        self.xx = g.x.mul_add(g.x, self.xx);
        self.yy = g.y.mul_add(g.y, self.yy);
        self.zz = g.z.mul_add(g.z, self.zz);
        self.xy = g.x.mul_add(g.y, self.xy);
        self.yz = g.y.mul_add(g.z, self.yz);
        self.zx = g.z.mul_add(g.x, self.zx);
    }

    #[inline(always)]
    pub fn trace(&self) -> L {
        self.xx + self.yy + self.zz
    }

    /// A bound of the largest eigenvalue from above: the largest sum of magnitudes of a row (Gershgorin).
    #[inline(always)]
    pub fn eigenvalue_bound(&self) -> L {
        let (xy, yz, zx) = (self.xy.abs(), self.yz.abs(), self.zx.abs());
        let (x, y, z) = (self.xx + xy + zx, self.yy + xy + yz, self.zz + yz + zx);
        x.max(y).max(z)
    }

    /// The largest eigenvalue, from the closed form of the cubic: `m + 2 p cos(phi/3)`,
    /// `cos phi = det((S - m I)/p) / 2`. The cosine of the third is `1/2 + t` with `6 t^2 + 4 t^3 = 1 + cos phi`,
    /// solved by Newton's steps from `sqrt((1 + cos phi)/6)`, which is at most 1.16 times too large: five reach
    /// the last place. Where two eigenvalues fall together the result is good to 1e-8. Never above
    /// [`Spread::eigenvalue_bound`], to the bit.
    #[inline(always)]
    pub fn largest_eigenvalue(&self) -> L {
        let (one, two) = (L::splat(1.0), L::splat(2.0));
        let mean = self.trace() * L::splat(1.0 / 3.0);
        let (xx, yy, zz) = (self.xx - mean, self.yy - mean, self.zz - mean);
        let off = self.xy.mul_add(self.xy, self.yz.mul_add(self.yz, self.zx * self.zx));
        let square = xx.mul_add(xx, yy.mul_add(yy, zz.mul_add(zz, two * off))) * L::splat(1.0 / 6.0);
        let p = square.sqrt();
        let minor_x = self.yz.neg_mul_add(self.yz, yy * zz);
        let minor_y = self.yz.neg_mul_add(self.zx, self.xy * zz);
        let minor_z = yy.neg_mul_add(self.zx, self.xy * self.yz);
        let determinant = self.zx.mul_add(minor_z, self.xy.neg_mul_add(minor_y, xx * minor_x));
        let cosine = determinant / (two * square * p).max(L::splat(1e-300));
        let right = cosine.min(one).max(-one) + one;
        let mut t = (right * L::splat(1.0 / 6.0)).sqrt().max(L::splat(1e-9));
        let mut round = 0;
        while round < 5 {
            let square = t * t;
            let above = (L::splat(8.0) * square).mul_add(t, L::splat(6.0).mul_add(square, right));
            t = above / (L::splat(12.0) * t.mul_add(t, t));
            round += 1;
        }
        (two * p).mul_add(t + L::splat(0.5), mean).min(self.eigenvalue_bound())
    }
}

/// Safety factors up to this one keep an element stable whose corners nothing else holds, see [`Swing`].
pub(crate) const FREE: f64 = 0.7;

/// What limits the step of an element, beside its largest eigenvalue.
///
/// In a mesh, the neighbours of an element hold its corners, and its fastest motion is a wave across its thickness, see
/// [`frequency`]. An element alone can change its volume in all directions at once, which is faster: the corners, each with an
/// eighth of the mass, swing at `omega^2 = 8/V^2 ((c^2 - 2 G/rho) tr S + 2 (G/rho) lambda_max(S))`, which is exact for a cube and for a
/// flat element. The viscosity damps this motion at the rate `C = 8 damping tr S / V^2` while the volume shrinks and not while it
/// grows. It acts with the velocity of half a step before, so the motion is bounded while `omega^2 dt^2 + C dt < 4`.
#[derive(Clone, Copy)]
pub(crate) struct Swing<L> {
    /// Viscosity over density (length^2 / time).
    pub damping: L,
    /// `c^2`.
    pub sound_square: L,
    /// `G / rho`.
    pub shear_square: L,
    /// `2 tr S / V^2`.
    pub trace: L,
}

impl<L: Lane> Swing<L> {
    /// The frequency whose inverse is the limit of the step: the greater of that in a mesh and [`FREE`] times that of an element
    /// alone. `largest` is `2 lambda_max(S) / V^2` or a bound of it; the frequency grows with it.
    #[inline(always)]
    pub fn frequency(&self, largest: L) -> L {
        let two_shears = self.shear_square + self.shear_square;
        let rate = L::splat(0.5 * FREE) * self.damping * self.trace;
        let square = (self.sound_square - two_shears).mul_add(self.trace, two_shears * largest);
        let square = (L::splat(FREE * FREE) * square).max(L::splat(0.0));
        let alone = rate + rate.mul_add(rate, square).sqrt();
        frequency(largest, self.damping, self.sound_square).max(alone)
    }

    /// Whether [`Swing::frequency`] may exceed `least` in a lane: never false where it does. A frequency `a + sqrt(a^2 + b)` exceeds t
    /// where `t^2 < b + 2 a t`, which takes no root.
    #[inline(always)]
    pub fn may_exceed(&self, least: f64, largest: L) -> L::Mask {
        // More than rounding can do here and in `frequency`.
        let least = least * (1.0 - 1e-14);
        let two_shears = self.shear_square + self.shear_square;
        let square = (self.sound_square - two_shears).mul_add(self.trace, two_shears * largest);
        let damping = L::splat(least) * self.damping;
        let in_mesh = largest * (damping + damping + self.sound_square);
        let square = square.max(L::splat(0.0));
        let alone = L::splat(FREE * FREE).mul_add(square, L::splat(FREE) * damping * self.trace);
        L::splat(least * least).less(in_mesh.max(alone))
    }
}

/// The frequency whose inverse is the Courant limit in a mesh, `L_e / (Q + sqrt(Q^2 + c^2))` with
/// `Q = damping / L_e`: `damping / L_e^2 + sqrt((damping / L_e^2)^2 + c^2 / L_e^2)`.
#[inline(always)]
pub(crate) fn frequency<L: Lane>(inverse_length_square: L, damping: L, sound_square: L) -> L {
    let rate = damping * inverse_length_square;
    rate + rate.mul_add(rate, sound_square * inverse_length_square).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    fn spread(s: [f64; 6]) -> Spread<Scalar> {
        let [xx, yy, zz, xy, yz, zx] = s.map(Scalar);
        Spread { xx, yy, zz, xy, yz, zx }
    }

    #[test]
    fn the_largest_eigenvalue_is_that_of_the_library() {
        let mut seed = 0x1234_5678_9abc_def1_u64;
        for _ in 0..2000 {
            let mut draw = || {
                seed ^= seed << 13;
                seed ^= seed >> 7;
                seed ^= seed << 17;
                seed as f64 / u64::MAX as f64 - 0.5
            };
            let m = nalgebra::Matrix3::from_fn(|_, _| draw());
            let s = m * m.transpose();
            let expected = s.symmetric_eigenvalues().max();
            let s = spread([s[(0, 0)], s[(1, 1)], s[(2, 2)], s[(0, 1)], s[(1, 2)], s[(2, 0)]]);
            let found = s.largest_eigenvalue().0;
            assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");
            assert!(s.eigenvalue_bound().0 >= found);
        }
    }

    #[test]
    fn the_test_without_roots_misses_no_frequency_that_exceeds() {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        let mut draw = || {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            seed as f64 / u64::MAX as f64
        };
        let (mut passed, mut refused) = (0, 0);
        for _ in 0..100_000 {
            let [damping, sound, shear, trace] = [draw(), draw(), draw(), draw()].map(Scalar);
            let swing = Swing { damping, sound_square: sound, shear_square: shear * sound, trace };
            let largest = trace * Scalar(draw());
            let frequency = swing.frequency(largest).0;
            assert!(swing.may_exceed(frequency, largest), "{frequency} of {largest:?}");
            let above = frequency * (1.0 + 1e-12);
            if swing.may_exceed(above, largest) { passed += 1 } else { refused += 1 }
        }
        assert!(refused > 99_000, "{passed} pass, {refused} do not");
    }

    #[test]
    fn equal_eigenvalues_are_no_trouble() {
        for (s, expected) in [
            ([2.0, 2.0, 2.0, 0.0, 0.0, 0.0], 2.0),
            ([3.0, 3.0, 1.0, 0.0, 0.0, 0.0], 3.0),
            ([3.0, 1.0, 1.0, 0.0, 0.0, 0.0], 3.0),
            ([1.5, 1.5, 0.5, 0.5, 0.0, 0.0], 2.0),
            ([1e-12, 1e-12, 1e-12, 0.0, 0.0, 0.0], 1e-12),
        ] {
            let found = spread(s).largest_eigenvalue().0;
            assert!((found / expected - 1.0).abs() < 2e-8, "{s:?}: {found}");
        }
    }
}
