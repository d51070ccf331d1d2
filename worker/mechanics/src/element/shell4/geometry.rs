//! Geometry of the four-node shell: its frame, gradients, fibers and hourglass pattern.
//!
//! The frame turns with the element: its normal is that of the diagonals, its first axis lies midway between the two
//! middle lines, so that no corner is preferred. Corner fibers are the normals of the corners, scaled to 1 along the
//! frame's normal and freed of their mean in the plane (the pseudo-normals of Belytschko, Wong and Chiang 1992).
//!
//! Everything follows from three vectors: half the diagonals, `T` from corner 0 to 2 and `D` from corner 3 to 1, which lie in the
//! plane of the frame, and the warp `R`, which leaves it where an element is warped. From their middle the corners stand at `R - T`,
//! `D - R`, `R + T` and `-D - R`.

use crate::{element::vector::Vector, lanes::Lane};

/// What corners 0 and 1 have; 2 and 3 have the same with the other sign.
pub(super) type Opposed<L> = [L; 2];

/// Geometry of one configuration.
#[derive(Clone, Copy)]
pub(super) struct Geometry<L> {
    /// Axes of the frame.
    pub e: [Vector<L>; 3],
    pub area: L,
    pub inverse_area: L,
    /// Derivative of the mean gradient by corner: `d/dx = sum bx_I`.
    pub bx: Opposed<L>,
    pub by: Opposed<L>,
    /// Its change per unit of height above the middle surface.
    pub cx: Opposed<L>,
    pub cy: Opposed<L>,
    /// In-plane components of the fibers.
    pub px: [L; 4],
    pub py: [L; 4],
    /// The hourglass pattern is 1/4, -1/4, 1/4, -1/4 less this: then it is orthogonal to linear fields.
    pub lean: Opposed<L>,
    /// The part of the warp in the plane, and the pattern's moment of the height z: the part across it.
    pub warp: [L; 2],
    pub gz: L,
    /// Moments of x x, x y and y y of the pattern, of `bx` and of `by`: what they see of a curved deflection.
    pub curved: [[L; 3]; 3],
    /// Least normal component of a corner's edge product (area); not positive for an element turned over. Of a triangle that of
    /// the corners that are one alone.
    pub least: L,
}

impl<L: Lane> Geometry<L> {
    /// Geometry of the corners.
    #[inline(always)]
    pub fn of(r: &[Vector<L>; 4]) -> Self {
        let (one, half, quarter) = (L::splat(1.0), L::splat(0.5), L::splat(0.25));
        let minus = L::splat(-1.0);
        // `-2 T` and `2 D`.
        let [back, over] = [r[2].mul_add(minus, &r[0]), r[3].mul_add(minus, &r[1])];
        let normal = back.cross(&over);
        // The first middle line, and the second turned round.
        let (g1, g2) = (back.mul_add(minus, &over), over.mul_add(one, &back));
        let (n_square, g1_square) = (normal.dot(&normal), g1.dot(&g1));
        // `g1 / |g1| + e3 x g2 / |g2|` times `g1^2 |g2| |normal|`.
        let lengths = (n_square * (g1_square * g2.dot(&g2))).sqrt();
        let between = g1.mul_add(lengths, &normal.cross(&g2).scaled(g1_square));
        let twice_area = n_square.sqrt();
        let inverse = one / twice_area;
        let e3 = normal.scaled(inverse);
        let e1 = between.scaled(one / between.dot(&between).sqrt());
        let e2 = e3.cross(&e1);

        // From corner 3 to 2: nothing in a triangle, whose third corner stands for both.
        let last_side = r[3].mul_add(minus, &r[2]);
        let is_triangle = last_side.dot(&last_side).less_equal(L::splat(0.0));
        let warp = r[1].mul_add(minus, &r[0]).mul_add(one, &last_side).scaled(quarter);
        let (tx, ty) = (-(half * e1.dot(&back)), -(half * e2.dot(&back)));
        let (dx, dy) = (half * e1.dot(&over), half * e2.dot(&over));
        let (rx, ry, rz) = (e1.dot(&warp), e2.dot(&warp), e3.dot(&warp));
        let (area, inverse_area) = (half * twice_area, inverse + inverse);
        let bx = [dy * inverse_area, ty * inverse_area];
        let by = [-(dx * inverse_area), -(tx * inverse_area)];
        let lean = [rx.mul_add(bx[0], ry * by[0]), rx.mul_add(bx[1], ry * by[1])];

        // A quarter of the edge product is `even - across` at corner 0, `even + along` at 1, `even + across` at 2, `even - along` at 3.
        let even = quarter * area;
        let (across, along) = (dy.neg_mul_add(rx, dx * ry), ty.neg_mul_add(rx, tx * ry));
        let least = L::splat(4.0) * (even - across.max_magnitude(along));
        let least = L::select(is_triangle, twice_area, least);
        // With `volume` over that product a fiber is this part of the corner's gradient, less the mean of all.
        // A triangle is flat: its fibers are its normal.
        let volume = L::select(is_triangle, L::splat(0.0), area * rz);
        let product = |between: L| L::select(is_triangle, one, between.neg_mul_add(between, even * even));
        let (first, second) = (volume / product(across), volume / product(along));
        let parts = [
            -(first * (even + across)),
            second * (even - along),
            first * (even - across),
            -(second * (even + along)),
        ];
        let (px, py) = (fibers(&parts, &bx), fibers(&parts, &by));
        let (first, second) = (quarter * first, quarter * second);
        let cx = [second * by[1], first * by[0]];
        let cy = [-(second * bx[1]), -(first * bx[0])];

        let curved = curved(&[tx, ty], &[dx, dy], &[rx, ry], inverse_area);
        Self {
            e: [e1, e2, e3],
            area,
            inverse_area,
            bx,
            by,
            cx,
            cy,
            px,
            py,
            lean,
            warp: [rx, ry],
            gz: rz,
            curved,
            least,
        }
    }

    /// `sum bx_I bx_I`, `sum by_I by_I` and the largest eigenvalue of the sum of dyads.
    #[inline(always)]
    pub fn squares(&self) -> (L, L, L) {
        let two = L::splat(2.0);
        let (xx, yy) = (dot(&self.bx, &self.bx), dot(&self.by, &self.by));
        let (difference, xy) = (xx - yy, two * dot(&self.bx, &self.by));
        (two * xx, two * yy, (xx + yy) + difference.mul_add(difference, xy * xy).sqrt())
    }
}

/// A component of the fibers: each its part of the corner's gradient, less the mean.
#[inline(always)]
fn fibers<L: Lane>(parts: &[L; 4], b: &Opposed<L>) -> [L; 4] {
    let p = [parts[0] * b[0], parts[1] * b[1], parts[2] * b[0], parts[3] * b[1]];
    let mean = L::splat(0.25) * ((p[0] + p[1]) + (p[2] + p[3]));
    [p[0] - mean, p[1] - mean, p[2] - mean, p[3] - mean]
}

/// Moments of x x, x y and y y of the hourglass pattern and of the gradients, see [`Geometry::curved`]: those of the gradients are
/// products with the warp, since opposite corners differ by it alone.
#[inline(always)]
fn curved<L: Lane>(t: &[L; 2], d: &[L; 2], r: &[L; 2], inverse_area: L) -> [[L; 3]; 3] {
    let half = L::splat(0.5);
    let quadruple = L::splat(4.0) * inverse_area;
    let [rx, ry] = *r;
    let xx = quadruple * (t[0] * d[0]);
    let xy = half * quadruple * t[0].mul_add(d[1], t[1] * d[0]);
    let yy = quadruple * (t[1] * d[1]);
    let of_bx = [-(L::splat(2.0) * (rx * xy)), -rx.mul_add(yy, ry * xy), -(L::splat(2.0) * (ry * yy))];
    let of_by = [L::splat(2.0) * (rx * xx), rx.mul_add(xy, ry * xx), L::splat(2.0) * (ry * xy)];
    let squares = [
        d[0].neg_mul_add(d[0], t[0] * t[0]),
        d[0].neg_mul_add(d[1], t[0] * t[1]),
        d[1].neg_mul_add(d[1], t[1] * t[1]),
    ];
    let mut of_pattern = squares;
    let mut i = 0;
    while i < 3 {
        of_pattern[i] = rx.neg_mul_add(of_bx[i], ry.neg_mul_add(of_by[i], half * squares[i]));
        i += 1;
    }
    [of_pattern, of_bx, of_by]
}

/// Sum of products over the first two corners.
#[inline(always)]
pub(super) fn dot<L: Lane>(a: &Opposed<L>, b: &Opposed<L>) -> L {
    a[0].mul_add(b[0], a[1] * b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    const SIGNS: [f64; 4] = [0.25, -0.25, 0.25, -0.25];

    fn sum(of: impl Fn(usize) -> f64) -> f64 {
        (0..4).map(of).sum()
    }

    /// All four corners of what the first two hold.
    fn all(opposed: Opposed<Scalar>) -> [f64; 4] {
        let [first, second] = opposed.map(|value| value.0);
        [first, second, -first, -second]
    }

    #[test]
    fn gradients_fibers_and_moments_are_those_of_their_definitions() {
        let warped = [[0.1, -0.2, 0.05], [1.3, 0.1, -0.1], [1.1, 0.9, 0.2], [-0.2, 1.2, -0.15]];
        let corners = warped.map(|[x, y, z]| Vector { x: Scalar(x), y: Scalar(y), z: Scalar(z) });
        let g = Geometry::of(&corners);
        let place = |axis: usize| -> [f64; 4] {
            let e = g.e[axis];
            let along = warped.map(|[x, y, z]| e.x.0 * x + e.y.0 * y + e.z.0 * z);
            along.map(|a| a - 0.25 * along.iter().sum::<f64>())
        };
        let [x, y, z] = [place(0), place(1), place(2)];
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{a}, not {b}");
        let (bx, by, lean) = (all(g.bx), all(g.by), all(g.lean));
        let gamma: Vec<f64> = (0..4).map(|i| SIGNS[i] - lean[i]).collect();
        // Middle lines are as far from the first axis as from the second.
        let line = |a: usize, b: usize| (x[a] + x[b], y[a] + y[b]);
        let ((ax, ay), (bx_, by_)) = (line(1, 2), line(2, 3));
        close(ay / ax.hypot(ay), bx_ / bx_.hypot(by_));
        for (of, linear) in [(&bx, [1.0, 0.0]), (&by, [0.0, 1.0])] {
            close(sum(|i| of[i] * x[i]), linear[0]);
            close(sum(|i| of[i] * y[i]), linear[1]);
        }
        close(sum(|i| gamma[i] * x[i]), 0.0);
        close(sum(|i| gamma[i] * y[i]), 0.0);
        close(sum(|i| gamma[i] * z[i]), g.gz.0);
        close(g.area.0 * g.inverse_area.0, 1.0);
        let (mut least, mut fibers) = (f64::MAX, [[0.0; 2]; 4]);
        for i in 0..4 {
            let (next, last) = ((i + 1) % 4, (i + 3) % 4);
            let [a, b] = [next, last].map(|n| [x[n] - x[i], y[n] - y[i], z[n] - z[i]]);
            let nz = a[0] * b[1] - a[1] * b[0];
            fibers[i] = [(a[1] * b[2] - a[2] * b[1]) / nz, (a[2] * b[0] - a[0] * b[2]) / nz];
            least = least.min(nz);
        }
        close(g.least.0, least);
        let mean = [0, 1].map(|axis| 0.25 * sum(|i| fibers[i][axis]));
        for i in 0..4 {
            close(g.px[i].0, fibers[i][0] - mean[0]);
            close(g.py[i].0, fibers[i][1] - mean[1]);
        }
        // The gradient over the layer at height 1 is that of corners moved by their fibers.
        let twice_area = 2.0 * g.area.0;
        for (i, (a, b)) in [(0, (1, 3)), (1, (2, 0))] {
            close(g.cx[i].0, (g.py[a].0 - g.py[b].0) / twice_area);
            close(g.cy[i].0, -(g.px[a].0 - g.px[b].0) / twice_area);
        }
        for (of, moments) in [(gamma.as_slice(), g.curved[0]), (&bx, g.curved[1]), (&by, g.curved[2])] {
            close(sum(|i| of[i] * x[i] * x[i]), moments[0].0);
            close(sum(|i| of[i] * x[i] * y[i]), moments[1].0);
            close(sum(|i| of[i] * y[i] * y[i]), moments[2].0);
        }
        let (xx, yy, largest) = g.squares();
        let [sxx, syy, sxy] = [sum(|i| bx[i] * bx[i]), sum(|i| by[i] * by[i]), sum(|i| bx[i] * by[i])];
        close(xx.0, sxx);
        close(yy.0, syy);
        close(largest.0, 0.5 * (sxx + syy) + (0.5 * (sxx - syy)).hypot(sxy));
    }
}
