//! How nodes approach their closest points, many features at a time: depth, direction, shape functions.

use super::{
    PLANE,
    lanes::Closest,
    vectors::{V, along, corners, cross, dot, inverse, points, sub},
};
use crate::{
    contact::near_pairs::NearPairs,
    lanes::{Lane, SET, Width, dispatch::Task},
};

/// How nodes approach closest points, by near feature.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Approach {
    /// Index of the closest point among all.
    pub(in crate::contact) index: Vec<u32>,
    /// 1 for a node on the outer side, -1 on the inner.
    pub(in crate::contact) sign: Vec<f64>,
    /// Depth in the zone: gap minus signed distance; zero beyond the gap (length).
    pub(in crate::contact) depth: Vec<f64>,
    /// Unit vector along the line of node and closest point, out of the solid.
    pub(in crate::contact) direction: [Vec<f64>; 3],
    /// Shape functions of the corners.
    pub(in crate::contact) weights: [Vec<f64>; 4],
}

impl Approach {
    pub(in crate::contact) fn clear(&mut self) {
        self.index.clear();
        self.sign.clear();
    }

    /// Repeats the last feature until lane sets are full.
    pub(in crate::contact) fn fill_up(&mut self) {
        let n = self.index.len().next_multiple_of(SET);
        self.index.resize(n, self.index.last().copied().unwrap_or(0));
        self.sign.resize(n, 1.0);
    }

    fn resize(&mut self, n: usize) {
        self.depth.resize(n, 0.0);
        self.direction.iter_mut().chain(&mut self.weights).for_each(|values| values.resize(n, 0.0));
    }
}

/// Depths, directions and weights of near features, whose `index` and `sign` are given: depth and direction to
/// the bits of the reduction, weights to those of [`Frame::weights`](super::Frame::weights). `pairs` are those of
/// the features, `closest` the closest points of all.
///
/// # Panics
/// If an index is out of range, there are not as many as pairs or the machine lacks the width.
pub(in crate::contact) fn approach(
    width: Width,
    rows: &[[f64; 4]],
    gap: f64,
    pairs: &NearPairs,
    closest: &Closest,
    found: &mut Approach,
) {
    pairs.check(width, rows.len());
    let n = pairs.node().len();
    assert!(found.index.len() == n && found.sign.len() == n, "{} features of {n} pairs", found.index.len());
    let highest = found.index.iter().fold(0, |highest, &i| if i > highest { i } else { highest });
    let lists = closest.vector.iter().chain(&closest.shares).chain([&closest.triangle, &closest.distance2]);
    lists.for_each(|list| assert!(n == 0 || (highest as usize) < list.len(), "point {highest}"));
    found.resize(n);
    width.run(Near { rows, gap, pairs, closest, found });
}

/// How pairs approach, with indices, lengths and width that [`approach`] has checked.
struct Near<'a> {
    rows: &'a [[f64; 4]],
    gap: f64,
    pairs: &'a NearPairs,
    closest: &'a Closest,
    found: &'a mut Approach,
}

impl Task for Near<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        let Self { rows, gap, pairs, closest, found } = self;
        // SAFETY: `approach`, which alone makes one, has checked.
        unsafe { near::<L>(rows, gap, pairs, closest, found) }
    }
}

/// # Safety
/// Pairs and indices checked, all lists of `found` as long as the pairs.
#[inline(always)]
unsafe fn near<L: Lane>(
    rows: &[[f64; 4]],
    gap: f64,
    pairs: &NearPairs,
    closest: &Closest,
    found: &mut Approach,
) {
    let (zero, gap) = (L::splat(0.0), L::splat(gap));
    let mut at = 0;
    while at < pairs.node().len() {
        // SAFETY: the caller's; `at + N` is within the lists because N divides SET.
        unsafe {
            let index = &found.index[..];
            let triangle = L::gather(&closest.triangle, index, at);
            let vector = gather::<L>(&closest.vector, index, at);
            let shares = gather::<L>(&closest.shares, index, at);
            let sign = L::load(&found.sign, at);
            let distance = L::gather(&closest.distance2, index, at).sqrt();
            let depth = L::select(distance.less(gap), gap - sign * distance, zero);
            let scale = sign / distance;
            depth.store(&mut found.depth, at);
            (scale * vector[0]).store(&mut found.direction[0], at);
            (scale * vector[1]).store(&mut found.direction[1], at);
            (scale * vector[2]).store(&mut found.direction[2], at);
            let mut weights = of_shares(triangle, shares);
            let plane = L::splat(PLANE as f64).less_equal(triangle);
            if L::any(plane) {
                let p: V<L> = points(rows, pairs.node(), at);
                let x = corners::<L>(rows, pairs.corners(), at);
                let inside = bilinear(sub(sub(p, vector), x[0]), &x);
                weights = [
                    L::select(plane, inside[0], weights[0]),
                    L::select(plane, inside[1], weights[1]),
                    L::select(plane, inside[2], weights[2]),
                    L::select(plane, inside[3], weights[3]),
                ];
            }
            weights[0].store(&mut found.weights[0], at);
            weights[1].store(&mut found.weights[1], at);
            weights[2].store(&mut found.weights[2], at);
            weights[3].store(&mut found.weights[3], at);
        }
        at += L::N;
    }
}

/// Weights of a closest point on a triangle or on the border.
#[inline(always)]
fn of_shares<L: Lane>(triangle: L, shares: V<L>) -> [L; 4] {
    let quarter = L::splat(0.25) * shares[0];
    let (here, next) = (quarter + shares[1], quarter + shares[2]);
    let is = [
        L::splat(1.0).less_equal(triangle),
        L::splat(2.0).less_equal(triangle),
        L::splat(3.0).less_equal(triangle),
    ];
    // Triangle 0, then 1, 2, 3 from there on.
    [
        L::select(is[2], next, L::select(is[0], quarter, here)),
        L::select(is[1], quarter, L::select(is[0], here, next)),
        L::select(is[2], quarter, L::select(is[1], here, L::select(is[0], next, quarter))),
        L::select(is[2], here, L::select(is[1], next, quarter)),
    ]
}

/// As [`Frame::weights`](super::Frame::weights) inside a coplanar face.
#[inline(always)]
fn bilinear<L: Lane>(q: V<L>, x: &[V<L>; 4]) -> [L; 4] {
    let (zero, one, two) = (L::splat(0.0), L::splat(1.0), L::splat(2.0));
    let area = cross(sub(x[2], x[0]), sub(x[3], x[1]));
    let inverse_size = inverse(dot(area, area).sqrt());
    let normal = [inverse_size * area[0], inverse_size * area[1], inverse_size * area[2]];
    let b = sub(x[1], x[0]);
    let (e2, e3) = (sub(x[3], x[2]), sub(x[0], x[3]));
    let c = [-e3[0], -e3[1], -e3[2]];
    let d = sub([-e2[0], -e2[1], -e2[2]], b);
    let k0 = turn(normal, q, b);
    let k1 = turn(normal, q, d) + turn(normal, b, c);
    let k2 = -turn(normal, c, d);
    let root = k1.mul_add(k1, -(L::splat(4.0) * k2 * k0)).max(zero).sqrt();
    let forward = zero.less_equal(k1);
    let sum = k1 + root;
    let divided = L::select(forward, L::splat(-2.0) * k0, root - k1) / L::select(forward, sum, two * k2);
    let t = L::select(forward, L::select(zero.less(sum), divided, L::splat(0.5)), divided);
    let xs = along(b, t, d);
    let s = dot(along(q, -t, c), xs) / dot(xs, xs);
    let xt = along(c, s, d);
    let st = s * t;
    let rest = sub(along(along(q, -s, b), -t, c), [st * d[0], st * d[1], st * d[2]]);
    let jacobian = turn(normal, xs, xt);
    let regular = zero.less(jacobian);
    let s = clamped(L::select(regular, s + turn(normal, rest, xt) / jacobian, s));
    let t = clamped(L::select(regular, t + turn(normal, xs, rest) / jacobian, t));
    let (s1, t1) = (one - s, one - t);
    [s1 * t1, s * t1, s * t, s1 * t]
}

#[inline(always)]
fn turn<L: Lane>(normal: V<L>, a: V<L>, b: V<L>) -> L {
    dot(normal, cross(a, b))
}

/// Between zero and one.
#[inline(always)]
fn clamped<L: Lane>(x: L) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let x = L::select(x.less(zero), zero, x);
    L::select(one.less(x), one, x)
}

/// # Safety
/// As [`Lane::gather`].
#[inline(always)]
unsafe fn gather<L: Lane>(x: &[Vec<f64>; 3], indices: &[u32], at: usize) -> V<L> {
    // SAFETY: the caller's.
    unsafe { [L::gather(&x[0], indices, at), L::gather(&x[1], indices, at), L::gather(&x[2], indices, at)] }
}
