//! Verification book 4.1: regions, distances and weights of the contact detection zone.

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
fn unit_square_gives_the_table_of_regions() {
    let s3 = 1.0 / 3.0_f64.sqrt();
    let table = [
        ([0.5, 0.5, 0.05], Feature::Face, 0.05, [0., 0., 1.], [0.25; 4]),
        ([0.5, 0.5, -0.05], Feature::Face, 0.05, [0., 0., -1.], [0.25; 4]),
        ([0.25, 0.75, 0.0999], Feature::Face, 0.0999, [0., 0., 1.], [0.1875, 0.0625, 0.1875, 0.5625]),
        ([0.25, 0.75, 0.1001], Feature::Face, 0.1001, [0., 0., 1.], [0.1875, 0.0625, 0.1875, 0.5625]),
        (
            [1.05, 0.5, 0.03],
            Feature::Edge(1),
            0.05830951894845304,
            [0.8574929257125444, 0., 0.5144957554275261],
            [0., 0.5, 0.5, 0.],
        ),
        (
            [1.05, 0.5, -0.03],
            Feature::Edge(1),
            0.05830951894845304,
            [0.8574929257125444, 0., -0.5144957554275261],
            [0., 0.5, 0.5, 0.],
        ),
        ([0.5, -0.08, 0.], Feature::Edge(0), 0.08, [0., -1., 0.], [0.5, 0.5, 0., 0.]),
        ([1.05, 1.05, 0.05], Feature::Corner(2), 0.08660254037844392, [s3, s3, s3], [0., 0., 1., 0.]),
        ([1.06, 1.06, 0.06], Feature::Corner(2), 0.1039230484541327, [s3, s3, s3], [0., 0., 1., 0.]),
        (
            [-0.05, -0.02, 0.07],
            Feature::Corner(0),
            0.08831760866327848,
            [-0.5661385170722978, -0.22645540682891913, 0.792593923901217],
            [1., 0., 0., 0.],
        ),
        (
            [1.1, 0.5, 0.05],
            Feature::Edge(1),
            0.11180339887498957,
            [0.8944271909999161, 0., 0.44721359549995765],
            [0., 0.5, 0.5, 0.],
        ),
        ([1.0, 0.5, 0.05], Feature::Edge(1), 0.05, [0., 0., 1.], [0., 0.5, 0.5, 0.]),
    ];
    for (p, feature, distance, normal, weights) in table {
        let c = closest(&SQUARE, p);
        assert_eq!(c.feature, feature, "{p:?}");
        assert!((c.distance - distance).abs() < 1e-15, "{p:?}: {} for {distance}", c.distance);
        for (v, n) in c.vector.iter().zip(normal) {
            assert!((v / c.distance - n).abs() < 1e-14, "{p:?}: {:?}", c.vector);
        }
        for (found, w) in c.weights.iter().zip(weights) {
            assert!((found - w).abs() < 1e-14, "{p:?}: {:?}", c.weights);
        }
    }
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
fn split_faces_are_near_the_bilinear_surface_and_equal_at_its_border() {
    // The bilinear distances are .0693009, .0601049, .0119690, .0866025; a split differs by less than the warp.
    let bilinear = [
        ([0.5, 0.5, 0.12], 0.06930087677540327, 0.01),
        ([0.9, 0.9, 0.1], 0.0601049130716016, 0.01),
        ([0.3, 0.2, 0.0], 0.011968989210117204, 0.02),
        ([1.05, 1.05, 0.25], 0.0866025403784439, 1e-14),
    ];
    for (p, distance, tolerance) in bilinear {
        let found = closest(&WARPED, p).distance;
        assert!((found - distance).abs() < tolerance, "{p:?}: {found} for {distance}");
    }
    assert_eq!(closest(&WARPED, [1.05, 1.05, 0.25]).feature, Feature::Corner(2));
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
