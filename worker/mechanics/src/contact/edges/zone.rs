//! Two edges: their closest points, and how much of the spring between them is the pair's own.
//!
//! With `a`, `b` the ends of the first edge, `c`, `d` those of the second, `u = b - a`, `v = d - c`, the closest points of the
//! two lines are `a + s u` and `c + t v`; the vector `r` between them is across both. The *offset* of an end is its
//! distance from the other line seen along `r`: `s h1`, `(1 - s) h1`, `t h2`, `(1 - t) h2` with
//! `h1 = |u x v| / |v|`, `h2 = |u x v| / |u|`. The weight is the product of `z^2 (3 - 2 z)` over the four offsets
//! in gaps, 1 from one gap on. An end on the other line, or edges that are parallel, have none: there the ends are in
//! zones themselves, and all that the pair could do is theirs.

use super::super::zone::{Vector, cross, dot, scale, sub};

/// Squared sine of the angle below which two edges are parallel: closest points would be noise.
const PARALLEL: f64 = 1e-12;

/// Closest points of two edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closest {
    /// Fractions of the way along both, from 0 to 1.
    pub(super) at: [f64; 2],
    /// From the second to the first.
    pub(super) vector: Vector,
    /// Square of its length (length squared).
    pub(super) distance2: f64,
    /// Whether the closest points are those of the lines: only then the pair has a spring.
    pub(super) crosses: bool,
    /// Lengths of both edges.
    pub(super) lengths: [f64; 2],
    u: Vector,
    v: Vector,
    /// `|u x v|`.
    area: f64,
}

/// The weight of a pair and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weight {
    /// From 0 to 1.
    pub(super) value: f64,
    /// Where it is between: derivatives by a displacement of the first against the second at the closest points, by a
    /// change of `u`, and of `v`.
    pub(super) slopes: Option<[Vector; 3]>,
}

#[inline(always)]
fn add(a: Vector, s: f64, b: Vector) -> Vector {
    [s.mul_add(b[0], a[0]), s.mul_add(b[1], a[1]), s.mul_add(b[2], a[2])]
}

#[inline(always)]
fn clamp(x: f64) -> f64 {
    x.clamp(0.0, 1.0)
}

/// Closest points of the edges `x[0] x[1]` and `x[2] x[3]` (Ericson 2005, section 5.1.9); none if one has no length.
#[inline(always)]
pub(super) fn closest(x: &[Vector; 4]) -> Option<Closest> {
    let (u, v, w) = (sub(x[1], x[0]), sub(x[3], x[2]), sub(x[0], x[2]));
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    if uu <= 0.0 || vv <= 0.0 {
        return None;
    }
    let (uw, vw) = (dot(u, w), dot(v, w));
    let normal = cross(u, v);
    let area2 = dot(normal, normal);
    let (mut s, mut t, mut crosses) = (0.0, 0.0, false);
    if area2 > PARALLEL * (uu * vv) {
        s = uv.mul_add(vw, -(uw * vv)) / area2;
        t = uu.mul_add(vw, -(uv * uw)) / area2;
        crosses = s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0;
    }
    if !crosses {
        s = clamp(s);
        t = uv.mul_add(s, vw) / vv;
        if t < 0.0 {
            (s, t) = (clamp(-uw / uu), 0.0);
        } else if t > 1.0 {
            (s, t) = (clamp((uv - uw) / uu), 1.0);
        }
    }
    let vector = add(add(w, s, u), -t, v);
    let lengths = [uu.sqrt(), vv.sqrt()];
    let distance2 = dot(vector, vector);
    Some(Closest { at: [s, t], vector, distance2, crosses, lengths, u, v, area: area2.sqrt() })
}

/// `z^2 (3 - 2 z)` and its derivative by the offset, 1 and 0 from a gap on.
#[inline(always)]
fn step(offset: f64, gap: f64) -> (f64, f64) {
    let z = offset / gap;
    if z >= 1.0 { (1.0, 0.0) } else { (z * z * (-2.0_f64).mul_add(z, 3.0), 6.0 * z * (1.0 - z) / gap) }
}

impl Closest {
    /// The greatest weight that the pair is likely to have when its vote acts, in which time ends move by about half a gap.
    #[inline(always)]
    pub(super) fn weight_ahead(&self, gap: f64) -> f64 {
        let ([s, t], [lu, lv]) = (self.at, self.lengths);
        let (h1, h2) = (self.area / lv, self.area / lu);
        let ahead = |offset: f64| step(0.5_f64.mul_add(gap, offset), gap).0;
        (ahead(s * h1) * ahead((1.0 - s) * h1)) * (ahead(t * h2) * ahead((1.0 - t) * h2))
    }

    /// The weight of a pair that crosses.
    ///
    /// With `m1`, `m2` the unit vectors in the plane of both, across `u` and `v`, and `e` the displacement of the
    /// first closest point's material against the second's: `h1 ds = -e.m2 - (d/h1) n.du + (uv d / (S |v|)) n.dv`,
    /// `dh1 = du.m2 + (|u|/|v|) dv.m1 - (h1/|v|^2) v.dv`, and the same the other way round.
    #[inline(always)]
    pub(super) fn weight(&self, gap: f64) -> Weight {
        let ([s, t], [lu, lv], area) = (self.at, self.lengths, self.area);
        let (h1, h2) = (area / lv, area / lu);
        let offsets = [s * h1, (1.0 - s) * h1, t * h2, (1.0 - t) * h2];
        let of_end =
            [step(offsets[0], gap), step(offsets[1], gap), step(offsets[2], gap), step(offsets[3], gap)];
        let [a, b, c, d] = of_end;
        if (a.0 >= 1.0) & (b.0 >= 1.0) & (c.0 >= 1.0) & (d.0 >= 1.0) {
            return Weight { value: 1.0, slopes: None };
        }
        let (first, second) = (a.0 * b.0, c.0 * d.0);
        let value = first * second;
        if value <= 0.0 {
            return Weight { value: 0.0, slopes: None };
        }
        // Derivatives by the four offsets.
        let by = [a.1 * b.0 * second, b.1 * a.0 * second, first * (c.1 * d.0), first * (d.1 * c.0)];
        // By what moves the closest points along the edges, and by the widths h1 and h2.
        let (g1, g2) = (by[0] - by[1], by[2] - by[3]);
        let (w1, w2) = (s.mul_add(by[0], (1.0 - s) * by[1]), t.mul_add(by[2], (1.0 - t) * by[3]));
        let (u, v) = (self.u, self.v);
        let (uu, uv, vv) = (lu * lu, dot(u, v), lv * lv);
        let m1 = scale(1.0 / (area * lu), add(scale(uu, v), -uv, u));
        let m2 = scale(1.0 / (area * lv), add(scale(vv, u), -uv, v));
        let along = add(scale(g2, m1), -g1, m2);
        // r = d n.
        let r = self.vector;
        let of_u = (-(g1 * lv)).mul_add(1.0 / area, -(g2 * uv / (area * lu)));
        let by_u = add(scale(of_u, r), w2.mul_add(lv / lu, w1), m2);
        let by_u = add(by_u, -(w2 * h2 / uu), u);
        let of_v = (g2 * lu).mul_add(1.0 / area, g1 * uv / (area * lv));
        let by_v = add(scale(of_v, r), w1.mul_add(lu / lv, w2), m1);
        let by_v = add(by_v, -(w1 * h1 / vv), v);
        Weight { value, slopes: Some([along, by_u, by_v]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn distance(x: &[Vector; 4], [s, t]: [f64; 2]) -> f64 {
        let r = [0, 1, 2].map(|a| x[0][a] + s * (x[1][a] - x[0][a]) - x[2][a] - t * (x[3][a] - x[2][a]));
        dot(r, r).sqrt()
    }

    #[test]
    fn closest_points_of_random_edges_are_nearer_than_any_others() {
        let mut random = Random(5);
        let mut crossing = 0;
        for _ in 0..2000 {
            let x: [Vector; 4] = [(); 4].map(|()| [random.next(), random.next(), 0.3 * random.next()]);
            let found = closest(&x).expect("no edge is without length");
            crossing += u32::from(found.crosses);
            let least = found.distance2.sqrt();
            assert!((distance(&x, found.at) - least).abs() < 1e-12);
            for i in 0..=20 {
                for j in 0..=20 {
                    let other = distance(&x, [f64::from(i) / 20.0, f64::from(j) / 20.0]);
                    assert!(least <= other + 1e-12, "{x:?}: {least} at {:?}, {other}", found.at);
                }
            }
        }
        assert!((300..1700).contains(&crossing), "{crossing}");
    }

    #[test]
    fn slopes_of_the_weight_are_its_differences() {
        let mut random = Random(9);
        let mut between = 0;
        for _ in 0..4000 {
            let x: [Vector; 4] = [(); 4].map(|()| [random.next(), random.next(), 0.2 * random.next()]);
            let gap = 0.4;
            let Some(found) = closest(&x).filter(|c| c.crosses) else { continue };
            let weight = found.weight(gap);
            let Some([e, u, v]) = weight.slopes.filter(|_| weight.value > 0.01) else { continue };
            between += 1;
            let [s, t] = found.at;
            for node in 0..4 {
                for axis in 0..3 {
                    let of_node = [
                        (1.0 - s) * e[axis] - u[axis],
                        s * e[axis] + u[axis],
                        -(1.0 - t) * e[axis] - v[axis],
                        -t * e[axis] + v[axis],
                    ];
                    let at = |by: f64| {
                        let mut moved = x;
                        moved[node][axis] += by;
                        let moved = closest(&moved).expect("they have a length");
                        moved.weight(gap).value
                    };
                    let by = 1e-6;
                    let difference = (at(by) - at(-by)) / (2.0 * by);
                    let off = (difference - of_node[node]).abs();
                    assert!(
                        off < 1e-4 * (1.0 + difference.abs()),
                        "{node} {axis}: {} {difference}",
                        of_node[node]
                    );
                }
            }
        }
        assert!(between > 300, "{between}");
    }

    #[test]
    fn an_end_on_the_other_edge_has_no_weight_and_one_a_gap_away_all_of_it() {
        let cross = |s: f64| {
            let x = [[-s, 0.0, 0.1], [1.0 - s, 0.0, 0.1], [0.0, -0.5, 0.0], [0.0, 0.5, 0.0]];
            closest(&x).expect("they have a length")
        };
        assert!(!cross(0.0).crosses && !cross(1.0).crosses && cross(1e-9).crosses);
        assert!(cross(1e-9).weight(0.2).value < 1e-15);
        assert_eq!(cross(0.2).weight(0.2), Weight { value: 1.0, slopes: None });
        assert!((cross(0.1).weight(0.2).value - 0.5).abs() < 1e-12);
        // Parallel and nearly parallel: nothing, and nearly nothing.
        let turned = |angle: f64| {
            let (x, y) = (0.5 * angle.cos(), 0.5 * angle.sin());
            closest(&[[-0.5, 0.0, 0.1], [0.5, 0.0, 0.1], [-x, -y, 0.0], [x, y, 0.0]]).expect("a length")
        };
        assert!(!turned(0.0).crosses && turned(0.0).distance2 > 0.00999);
        assert!(turned(0.01).crosses && turned(0.01).weight(0.2).value < 1e-8);
        assert!(closest(&[[1.0; 3], [1.0; 3], [0.0; 3], [2.0, 0.0, 0.0]]).is_none(), "an edge of no length");
    }
}
