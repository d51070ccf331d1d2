//! Distances and weights of the contact detection zone; its table of regions is a case of the verification book.

use mechanics::contact::zone::{Feature, Frame};

use crate::world::Random;

/// All of a closest point.
struct Closest {
    feature: Feature,
    distance: f64,
    vector: [f64; 3],
    weights: [f64; 4],
}

fn closest(x: &[[f64; 3]; 4], p: [f64; 3]) -> Closest {
    let frame = Frame::new(x);
    let nearest = frame.nearest(p);
    let weights = frame.weights(&nearest, p);
    Closest { feature: nearest.feature, distance: nearest.distance2.sqrt(), vector: nearest.vector, weights }
}

const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
const WARPED: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.2], [0., 1., 0.]];

/// Largest difference of the weighted corners from the closest point.
fn miss(x: &[[f64; 3]; 4], p: [f64; 3], c: &Closest) -> f64 {
    (0..3)
        .map(|a| {
            let point = p[a] - c.vector[a];
            ((0..4).map(|i| c.weights[i] * x[i][a]).sum::<f64>() - point).abs()
        })
        .fold(0.0, f64::max)
}

fn random_quad(random: &mut Random, planar: bool) -> [[f64; 3]; 4] {
    let mut x = SQUARE.map(|c| [0, 1, 2].map(|a| c[a] + random.within(-0.3, 0.3)));
    if planar {
        x.iter_mut().for_each(|c| c[2] = 0.0);
    }
    // A rotation by its axis and angle, and an offset.
    let axis = random.point(-1.0, 1.0);
    let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let n = axis.map(|a| a / length);
    let (sin, cos) = random.within(0.0, 6.0).sin_cos();
    let offset = random.point(-5.0, 5.0);
    x.map(|c| {
        let d = n[0] * c[0] + n[1] * c[1] + n[2] * c[2];
        let r = [n[1] * c[2] - n[2] * c[1], n[2] * c[0] - n[0] * c[2], n[0] * c[1] - n[1] * c[0]];
        [0, 1, 2].map(|a| cos * c[a] + sin * r[a] + (1.0 - cos) * d * n[a] + offset[a])
    })
}

#[test]
fn weights_reproduce_the_closest_point_of_any_face() {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for round in 0..20_000 {
        let x = random_quad(&mut random, round % 2 == 0);
        let p = [0, 1, 2].map(|a| 0.25 * (x[0][a] + x[1][a] + x[2][a] + x[3][a]) + random.within(-0.9, 0.9));
        let c = closest(&x, p);
        assert!(miss(&x, p, &c) < 2e-14, "{x:?} {p:?}: {}", miss(&x, p, &c));
        assert!((c.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!(c.weights.iter().all(|w| (-1e-15..=1.0).contains(w)), "{:?}", c.weights);
        let length = c.vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((length - c.distance).abs() < 1e-14);
    }
}

#[test]
fn no_point_of_a_face_is_nearer_than_the_closest() {
    let mut random = Random(77);
    for round in 0..300 {
        let x = random_quad(&mut random, round % 2 == 0);
        let p = [0, 1, 2].map(|a| 0.25 * (x[0][a] + x[1][a] + x[2][a] + x[3][a]) + random.within(-0.9, 0.9));
        let found = closest(&x, p).distance;
        // Points of the four triangles about the mid-point.
        let mid = [0, 1, 2].map(|a| 0.25 * (x[0][a] + x[1][a] + x[2][a] + x[3][a]));
        let mut least = f64::INFINITY;
        let n = 60;
        for t in 0..4 {
            for i in 0..=n {
                for j in 0..=n - i {
                    let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                    let d2: f64 = (0..3)
                        .map(|a| {
                            let q = mid[a] + u * (x[t][a] - mid[a]) + v * (x[(t + 1) & 3][a] - mid[a]);
                            (q - p[a]).powi(2)
                        })
                        .sum();
                    least = least.min(d2.sqrt());
                }
            }
        }
        assert!(found <= least + 1e-14, "{x:?} {p:?}: {found} for {least}");
        assert!(least - found < 0.03, "{x:?} {p:?}: {found} for {least}");
    }
}

#[test]
fn faces_on_both_sides_of_an_edge_measure_the_same_distance_to_it() {
    // Convex along the shared edge from (1,0,0) to (1,1,.2); one neighbour warped, one coplanar.
    for last in [[2., 1., -0.9], [2., 1., -0.8]] {
        let neighbour = [[1., 0., 0.], [2., 0., -1.0], last, [1., 1., 0.2]];
        let mut on_both = 0;
        for i in 0..=1000 {
            let t = 1e-3 * f64::from(i);
            let p = [1.03, t, 0.2 * t + 0.05];
            let (a, b) = (closest(&WARPED, p), closest(&neighbour, p));
            if a.feature == Feature::Edge(1) && b.feature == Feature::Edge(3) {
                assert!((a.distance - b.distance).abs() < 1e-15, "{p:?}");
                for i in 0..3 {
                    assert!((a.vector[i] - b.vector[i]).abs() < 1e-15, "{p:?}");
                }
                assert!((a.weights[1] - b.weights[0]).abs() + (a.weights[2] - b.weights[3]).abs() < 1e-14);
                on_both += 1;
            }
        }
        assert!(on_both > 900, "{on_both} points met the edge from both sides");
    }
}

#[test]
fn distance_is_continuous_across_coplanarity() {
    for warp in [1e-8, 1e-9, 1.01e-10, 0.99e-10, 1e-11, 0.0] {
        let x = [[0., 0., 0.], [1., 0., 0.], [1., 1., warp], [0., 1., 0.]];
        for p in [[0.7, 0.2, 0.06], [1.03, 0.4, -0.05], [1.02, 1.04, 0.01]] {
            assert!((closest(&x, p).distance - closest(&SQUARE, p).distance).abs() < 2.0 * warp + 1e-15);
        }
    }
}

#[test]
fn distance_and_direction_change_smoothly_through_edge_and_corner_zones() {
    for (from, step) in [
        ([0.9, 0.5, 0.05], [1e-3, 0., 0.]),
        ([0.9, 0.93, 0.05], [1e-3, 7e-4, 0.]),
        ([1.04, 0.9, -0.03], [0., 1e-3, 1e-4]),
    ] {
        let mut last: Option<Closest> = None;
        for i in 0..200 {
            let p = [0, 1, 2].map(|a| from[a] + f64::from(i) * step[a]);
            let c = closest(&SQUARE, p);
            if let Some(l) = last {
                assert!((c.distance - l.distance).abs() < 1.3e-3, "{p:?}");
                for a in 0..3 {
                    assert!((c.vector[a] / c.distance - l.vector[a] / l.distance).abs() < 0.05, "{p:?}");
                }
            }
            last = Some(c);
        }
    }
}

#[test]
fn nothing_is_lost_between_the_regions_of_edges_and_corners() {
    let steps = [0.0, 1e-16, 1e-14, 9e-13, 1.1e-12, 1e-10, 0.07];
    let mut along: Vec<f64> = vec![0.3];
    for step in steps {
        along.extend([-step, step, 1.0 - step, 1.0 + step]);
    }
    let beyond = |c: f64| (-c).max(c - 1.0).max(0.0);
    let nearly = SQUARE.map(|[x, y, z]| [x + 1e-13 * y, y - 2e-13 * x, z]);
    let hardly_warped = [SQUARE[0], SQUARE[1], [1., 1., 1e-9], SQUARE[3]];
    for x in [SQUARE, nearly, hardly_warped] {
        for &u in &along {
            for &v in &along {
                for height in [0.0, 1e-13, 0.05, -0.05] {
                    // Square, rotated by a third of a turn about (1, 1, 1), so that every plane is tried.
                    for turns in 0..3 {
                        let turned = |p: [f64; 3]| [p[turns], p[(turns + 1) % 3], p[(turns + 2) % 3]];
                        let c = closest(&x.map(turned), turned([u, v, height]));
                        let exact = (beyond(u).powi(2) + beyond(v).powi(2) + height * height).sqrt();
                        let off = (c.distance - exact).abs();
                        assert!(off < 3e-9, "{x:?} {u} {v} {height}: {} for {exact}", c.distance);
                    }
                }
            }
        }
    }
}

#[test]
fn a_collapsed_face_is_a_triangle() {
    let triangle = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 1., 0.]];
    for (p, distance) in
        [([0.25, 0.25, 0.07], 0.07), ([0.6, 0.6, 0.0], 0.2 * 0.5_f64.sqrt()), ([-0.03, 1.04, 0.0], 0.05)]
    {
        let c = closest(&triangle, p);
        assert!((c.distance - distance).abs() < 1e-15, "{p:?}: {}", c.distance);
        assert!(miss(&triangle, p, &c) < 1e-15);
    }
}
