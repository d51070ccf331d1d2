//! Geometry of the four-node shell: its frame, gradients, fibers and hourglass pattern.
//!
//! The frame turns with the element: its normal is that of the diagonals, its first axis lies midway between the two
//! middle lines, so that no corner is preferred. Corner fibers are the normals of the corners, scaled to 1 along the
//! frame's normal and freed of their mean in the plane (the pseudo-normals of Belytschko, Wong and Chiang 1992).

use crate::{element::vector::Vector, lanes::Lane};

/// Geometry of one configuration.
#[derive(Clone, Copy)]
pub(super) struct Geometry<L> {
    /// Axes of the frame.
    pub e: [Vector<L>; 3],
    pub area: L,
    /// Derivative of the mean gradient by corner: `d/dx = sum bx_I`.
    pub bx: [L; 4],
    pub by: [L; 4],
    /// Its change per unit of height above the middle surface.
    pub cx: [L; 4],
    pub cy: [L; 4],
    /// In-plane components of the fibers.
    pub px: [L; 4],
    pub py: [L; 4],
    /// Hourglass pattern orthogonal to linear fields, magnitude 1/4 on a parallelogram.
    pub gamma: [L; 4],
    /// Its moment of the height z.
    pub gz: L,
    /// Moments of x x, x y and y y of the pattern, of `bx` and of `by`: what they see of a curved deflection.
    pub curved: [[L; 3]; 3],
    /// Least normal component of a corner's edge product (area); not positive for an element turned over.
    pub least: L,
}

impl<L: Lane> Geometry<L> {
    /// Geometry of the corners.
    #[inline(always)]
    pub fn of(r: &[Vector<L>; 4]) -> Self {
        let (zero, one, half, quarter) = (L::splat(0.0), L::splat(1.0), L::splat(0.5), L::splat(0.25));
        let minus = L::splat(-1.0);
        let d1 = r[0].mul_add(minus, &r[2]);
        let d2 = r[1].mul_add(minus, &r[3]);
        let normal = d1.cross(&d2);
        let twice_area = normal.dot(&normal).sqrt();
        let e3 = normal.scaled(one / twice_area);
        let g1 = d2.mul_add(minus, &d1);
        let g2 = d2.mul_add(one, &d1);
        let a = g1.scaled(one / g1.dot(&g1).sqrt());
        let b = g2.scaled(one / g2.dot(&g2).sqrt());
        let between = b.cross_add(&e3, &a);
        let e1 = between.scaled(one / between.dot(&between).sqrt());
        let e2 = e3.cross(&e1);

        // Positions from the middle of the corners, in the frame.
        let (mut x, mut y, mut z) = ([zero; 4], [zero; 4], [zero; 4]);
        let mut middle = r[0].mul_add(one, &r[1]);
        middle = middle.mul_add(one, &r[2].mul_add(one, &r[3])).scaled(quarter);
        let mut i = 0;
        while i < 4 {
            let from = middle.mul_add(minus, &r[i]);
            (x[i], y[i], z[i]) = (e1.dot(&from), e2.dot(&from), e3.dot(&from));
            i += 1;
        }
        let (mut px, mut py) = ([zero; 4], [zero; 4]);
        let mut least = L::splat(f64::MAX);
        let mut i = 0;
        while i < 4 {
            let (next, last) = ((i + 1) % 4, (i + 3) % 4);
            let (ax, ay, az) = (x[next] - x[i], y[next] - y[i], z[next] - z[i]);
            let (bx, by, bz) = (x[last] - x[i], y[last] - y[i], z[last] - z[i]);
            let nz = ay.neg_mul_add(bx, ax * by);
            px[i] = az.neg_mul_add(by, ay * bz) / nz;
            py[i] = ax.neg_mul_add(bz, az * bx) / nz;
            least = least.min(nz);
            i += 1;
        }
        let mean_x = quarter * ((px[0] + px[1]) + (px[2] + px[3]));
        let mean_y = quarter * ((py[0] + py[1]) + (py[2] + py[3]));
        let mut i = 0;
        while i < 4 {
            (px[i], py[i]) = (px[i] - mean_x, py[i] - mean_y);
            i += 1;
        }
        let inverse = one / twice_area;
        let bx = opposite(&y, inverse);
        let by = opposite(&x, -inverse);
        let cx = opposite(&py, inverse);
        let cy = opposite(&px, -inverse);
        let sx = quarter * ((x[0] - x[1]) + (x[2] - x[3]));
        let sy = quarter * ((y[0] - y[1]) + (y[2] - y[3]));
        let mut gamma = [zero; 4];
        let mut gz = zero;
        let mut sign = quarter;
        let mut i = 0;
        while i < 4 {
            gamma[i] = sy.neg_mul_add(by[i], sx.neg_mul_add(bx[i], sign));
            gz = gamma[i].mul_add(z[i], gz);
            sign = -sign;
            i += 1;
        }
        let area = half * twice_area;
        let curved = [moments(&gamma, &x, &y), moments(&bx, &x, &y), moments(&by, &x, &y)];
        Self { e: [e1, e2, e3], area, bx, by, cx, cy, px, py, gamma, gz, curved, least }
    }

    /// `sum bx_I bx_I`, `sum by_I by_I` and the largest eigenvalue of the sum of dyads.
    #[inline(always)]
    pub fn squares(&self) -> (L, L, L) {
        let (xx, yy, xy) = (dot(&self.bx, &self.bx), dot(&self.by, &self.by), dot(&self.bx, &self.by));
        let half = L::splat(0.5);
        let difference = half * (xx - yy);
        (xx, yy, half.mul_add(xx + yy, difference.mul_add(difference, xy * xy).sqrt()))
    }
}

/// `[a1 - a3, a2 - a0, a3 - a1, a0 - a2] factor`.
#[inline(always)]
fn opposite<L: Lane>(a: &[L; 4], factor: L) -> [L; 4] {
    let (one, two) = ((a[1] - a[3]) * factor, (a[2] - a[0]) * factor);
    [one, two, -one, -two]
}

/// `sum a x x`, `sum a x y`, `sum a y y`.
#[inline(always)]
fn moments<L: Lane>(a: &[L; 4], x: &[L; 4], y: &[L; 4]) -> [L; 3] {
    let zero = L::splat(0.0);
    let (mut xx, mut xy, mut yy) = (zero, zero, zero);
    let mut i = 0;
    while i < 4 {
        let (ax, ay) = (a[i] * x[i], a[i] * y[i]);
        xx = ax.mul_add(x[i], xx);
        xy = ax.mul_add(y[i], xy);
        yy = ay.mul_add(y[i], yy);
        i += 1;
    }
    [xx, xy, yy]
}

/// Sum of products over the corners.
#[inline(always)]
pub(super) fn dot<L: Lane>(a: &[L; 4], b: &[L; 4]) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul_add(b[2], a[3] * b[3])))
}
