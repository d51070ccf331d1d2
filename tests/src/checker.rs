//! Looks for nodes inside elements of foreign parts, and for shells and outer faces that pass through each other; knows
//! nothing of the contact code.
//!
//! A hexahedron is taken as 24 tetrahedra: its centre, the mid-point of a face, and an edge of that face. Its border is
//! then the surface that contact sees, where a face that is not flat is split about its mid-point.

use std::collections::HashMap;

use mechanics::mesh::{FACES, Mesh, Part};

/// A node inside an element of a part that it does not belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Intruder {
    /// Global node index.
    pub node: u32,
    /// Global element index.
    pub element: u32,
}

/// Smallest weight of the centre that counts as inside: below it the node is on the border.
const INSIDE: f64 = 1e-6;

/// Every node that is inside an element of a part that does not have it, at positions `x` by global node index.
pub fn intruders(mesh: &Mesh, x: &[[f64; 3]]) -> Vec<Intruder> {
    let mut found = Vec::new();
    for (p, part) in mesh.parts.iter().enumerate() {
        let first = mesh.element_offsets()[p];
        let mut mine = vec![false; mesh.n_nodes()];
        for &n in &part.nodes {
            mine[n as usize] = true;
        }
        let corners: Vec<[[f64; 3]; 8]> =
            (0..part.n_elements()).map(|e| part.corners(e).map(|n| x[n as usize])).collect();
        let boxes: Vec<[[f64; 3]; 2]> = corners.iter().map(|corners| bounds(corners)).collect();
        let side = boxes
            .iter()
            .flat_map(|[low, high]| (0..3).map(move |a| high[a] - low[a]))
            .fold(f64::MIN_POSITIVE, f64::max);
        let cell = |p: [f64; 3]| p.map(|c| (c / side).floor() as i64);
        let mut bins: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for (e, [low, high]) in boxes.iter().enumerate() {
            let (low, high) = (cell(*low), cell(*high));
            for i in low[0]..=high[0] {
                for j in low[1]..=high[1] {
                    for k in low[2]..=high[2] {
                        bins.entry([i, j, k]).or_default().push(e as u32);
                    }
                }
            }
        }
        for (n, &point) in x.iter().enumerate().filter(|(n, _)| !mine[*n]) {
            for &e in bins.get(&cell(point)).into_iter().flatten() {
                let [low, high] = boxes[e as usize];
                let near = (0..3).all(|a| low[a] < point[a] && point[a] < high[a]);
                if near && holds(&corners[e as usize], point) {
                    found.push(Intruder { node: n as u32, element: first as u32 + e });
                    break;
                }
            }
        }
    }
    found
}

fn bounds(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    points.iter().fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], c| {
        [[0, 1, 2].map(|a| low[a].min(c[a])), [0, 1, 2].map(|a| high[a].max(c[a]))]
    })
}

/// Whether a point is inside a hexahedron.
pub fn holds(corners: &[[f64; 3]; 8], point: [f64; 3]) -> bool {
    let mean = |of: &[[f64; 3]]| [0, 1, 2].map(|a| of.iter().map(|c| c[a]).sum::<f64>() / of.len() as f64);
    let centre = mean(corners);
    FACES.iter().any(|face| {
        let face = face.map(|c| corners[c]);
        let middle = mean(&face);
        (0..4).any(|i| in_tetrahedron([centre, middle, face[i], face[(i + 1) % 4]], point))
    })
}

/// Whether a point is in a tetrahedron and not on the face opposite to its first corner.
fn in_tetrahedron(corners: [[f64; 3]; 4], point: [f64; 3]) -> bool {
    let whole = triple(corners[0], corners[1], corners[2], corners[3]);
    if whole == 0.0 {
        return false;
    }
    let weight = |i: usize| {
        let mut moved = corners;
        moved[i] = point;
        triple(moved[0], moved[1], moved[2], moved[3]) / whole
    };
    weight(0) > INSIDE && (1..4).all(|i| weight(i) >= -1e-12)
}

/// Six times the signed volume of a tetrahedron.
fn triple(o: [f64; 3], a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| [0, 1, 2].map(|i| p[i] - o[i]));
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// A pair of shells that share no node, of which an edge of the first goes through the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pierced {
    /// Global index of the element whose edge goes through.
    pub edge_of: u32,
    /// Global index of the element that is gone through.
    pub element: u32,
}

/// Every pair of shells of all parts that share no node and pass through each other, at positions `x` by global node
/// index. A shell is four triangles about the mean of its corners; two of them cross where an edge of one, outer or inner,
/// goes through a triangle of the other.
pub fn pierced(mesh: &Mesh, x: &[[f64; 3]]) -> Vec<Pierced> {
    among(&faces_of(mesh, &|part| part.section().is_some()), x)
}

/// The same of the outer faces of all parts, solids and shells.
pub fn crossed(mesh: &Mesh, x: &[[f64; 3]]) -> Vec<Pierced> {
    among(&faces_of(mesh, &|_| true), x)
}

/// The smallest distance between shells of all parts that share no node, at positions `x` by global node index: 0 where two
/// pass through each other, `within` where none come nearer than that. Shells are taken as [`pierced`] takes them.
pub fn nearest(mesh: &Mesh, x: &[[f64; 3]], within: f64) -> f64 {
    let shells = faces_of(mesh, &|part| part.section().is_some());
    if !among(&shells, x).is_empty() {
        return 0.0;
    }
    let points = with_middles(&shells, x);
    // Boxes that are wider by half of it on each side meet where shells may be so near.
    let boxes: Vec<[[f64; 3]; 2]> = points
        .iter()
        .map(|points| bounds(points))
        .map(|[low, high]| [low.map(|c| c - 0.5 * within), high.map(|c| c + 0.5 * within)])
        .collect();
    let mut smallest = within;
    for (a, b) in meeting(&boxes).into_iter().filter(|(a, b)| a < b) {
        if shells[a].1.iter().any(|n| shells[b].1.contains(n)) {
            continue;
        }
        let [p, q] = [&points[a], &points[b]];
        let triangles = |p: &[[f64; 3]; 5]| [0, 1, 2, 3].map(|i| [p[i], p[(i + 1) % 4], p[4]]);
        for (mine, theirs) in triangles(p).iter().flat_map(|t| triangles(q).map(|u| (*t, u))) {
            let of_nodes = mine.iter().map(|n| from_triangle(*n, theirs));
            let of_theirs = theirs.iter().map(|n| from_triangle(*n, mine));
            let of_edges = (0..3).flat_map(|i| {
                (0..3).map(move |j| between([mine[i], mine[(i + 1) % 3]], [theirs[j], theirs[(j + 1) % 3]]))
            });
            smallest = of_nodes.chain(of_theirs).chain(of_edges).fold(smallest, f64::min);
        }
    }
    smallest
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Distance of two segments; that of parallel ones is left to their ends.
fn between(first: [[f64; 3]; 2], second: [[f64; 3]; 2]) -> f64 {
    let (u, v, w) = (minus(first[1], first[0]), minus(second[1], second[0]), minus(first[0], second[0]));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let crossed = uu * vv - uv * uv;
    let apart = |s: f64, t: f64| {
        let d = [0, 1, 2].map(|a| w[a] + s * u[a] - t * v[a]);
        dot(d, d).sqrt()
    };
    let mut smallest = f64::INFINITY;
    if crossed > 0.0 {
        let (s, t) = ((uv * vw - vv * uw) / crossed, (uu * vw - uv * uw) / crossed);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            smallest = apart(s, t);
        }
    }
    for end in [0.0, 1.0] {
        smallest = smallest.min(apart(end, ((vw + end * uv) / vv).clamp(0.0, 1.0)));
        smallest = smallest.min(apart(((end * uv - uw) / uu).clamp(0.0, 1.0), end));
    }
    smallest
}

/// Distance of a point to the inside of a triangle where it stands above it; that to its edges is left to [`between`].
fn from_triangle(point: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (u, v, w) = (minus(b, a), minus(c, a), minus(point, a));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let square = dot(normal, normal);
    if square == 0.0 {
        return f64::INFINITY;
    }
    let turned = |a: [f64; 3], b: [f64; 3]| {
        dot([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], normal)
            / square
    };
    let (s, t) = (turned(w, v), turned(u, w));
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 { dot(w, normal).abs() / square.sqrt() } else { f64::INFINITY }
}

/// Element and corners of the outer faces of some parts: of a shell its one face, of solids those that one element of the
/// part has.
fn faces_of(mesh: &Mesh, wanted: &dyn Fn(&Part) -> bool) -> Vec<(u32, [u32; 4])> {
    let mut faces: Vec<(u32, [u32; 4])> = Vec::new();
    for (part, first) in mesh.parts.iter().zip(mesh.element_offsets()).filter(|(part, _)| wanted(part)) {
        let mut outer: HashMap<[u32; 4], Option<(u32, [u32; 4])>> = HashMap::new();
        for e in 0..part.n_elements() {
            let (corners, element) = (part.corners(e), (first + e) as u32);
            if part.section().is_some() {
                let [a, b, c, d, ..] = corners;
                faces.push((element, [a, b, c, d]));
                continue;
            }
            for nodes in FACES.map(|face| face.map(|c| corners[c])) {
                let mut key = nodes;
                key.sort_unstable();
                outer.entry(key).and_modify(|seen| *seen = None).or_insert(Some((element, nodes)));
            }
        }
        faces.extend(outer.into_values().flatten());
    }
    faces.sort_unstable();
    faces
}

/// Pairs of faces that share no node and pass through each other.
fn among(shells: &[(u32, [u32; 4])], x: &[[f64; 3]]) -> Vec<Pierced> {
    let points = with_middles(shells, x);
    let boxes: Vec<[[f64; 3]; 2]> = points.iter().map(|points| bounds(points)).collect();
    let mut found = Vec::new();
    for (a, b) in meeting(&boxes) {
        if shells[a].1.iter().any(|n| shells[b].1.contains(n)) {
            continue;
        }
        let p = &points[a];
        let edges = (0..4).flat_map(|i| [[p[i], p[(i + 1) % 4]], [p[i], p[4]]]);
        let q = &points[b];
        let mut triangles = (0..4).map(|i| [q[i], q[(i + 1) % 4], q[4]]);
        let through = |t: [[f64; 3]; 3]| edges.clone().any(|edge| goes_through(edge, t));
        if triangles.any(through) {
            found.push(Pierced { edge_of: shells[a].0, element: shells[b].0 });
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Corners of faces, and their mean as the fifth.
fn with_middles(faces: &[(u32, [u32; 4])], x: &[[f64; 3]]) -> Vec<[[f64; 3]; 5]> {
    let all = faces.iter().map(|(_, nodes)| {
        let [a, b, c, d] = nodes.map(|n| x[n as usize]);
        [a, b, c, d, [0, 1, 2].map(|i| 0.25 * (a[i] + b[i] + c[i] + d[i]))]
    });
    all.collect()
}

/// Pairs of boxes that touch, each twice: in both orders.
fn meeting(boxes: &[[[f64; 3]; 2]]) -> Vec<(usize, usize)> {
    let sides = boxes.iter().flat_map(|[low, high]| (0..3).map(move |a| high[a] - low[a]));
    let side = sides.fold(f64::MIN_POSITIVE, f64::max);
    let cells = |[low, high]: &[[f64; 3]; 2]| {
        let [low, high] = [low, high].map(|p| p.map(|c| (c / side).floor() as i64));
        let along = move |a: usize| low[a]..=high[a];
        along(0).flat_map(move |i| along(1).flat_map(move |j| along(2).map(move |k| [i, j, k])))
    };
    let mut bins: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (s, bounds) in boxes.iter().enumerate() {
        cells(bounds).for_each(|cell| bins.entry(cell).or_default().push(s));
    }
    let mut pairs = Vec::new();
    for (a, bounds) in boxes.iter().enumerate() {
        for &b in cells(bounds).flat_map(|cell| bins.get(&cell)).flatten() {
            if a != b && (0..3).all(|i| bounds[1][i] >= boxes[b][0][i] && boxes[b][1][i] >= bounds[0][i]) {
                pairs.push((a, b));
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Whether a segment crosses a triangle from one side to the other, inside it.
fn goes_through([from, to]: [[f64; 3]; 2], [a, b, c]: [[f64; 3]; 3]) -> bool {
    let (start, end) = (triple(from, a, b, c), triple(to, a, b, c));
    if start * end >= 0.0 {
        return false;
    }
    let around = [triple(from, to, a, b), triple(from, to, b, c), triple(from, to, c, a)];
    around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::model;

    const SKEWED: [[f64; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.2, 1.1, 0.1],
        [0.0, 1.0, 0.2],
        [0.1, 0.0, 1.0],
        [1.0, 0.2, 1.3],
        [1.1, 1.0, 1.0],
        [-0.1, 1.0, 0.9],
    ];

    #[test]
    fn points_pulled_in_from_the_faces_are_inside_and_pushed_out_are_not() {
        let centre = [0, 1, 2].map(|a| SKEWED.iter().map(|c| c[a]).sum::<f64>() / 8.0);
        for face in FACES {
            let c = face.map(|i| SKEWED[i]);
            for edge in 0..4 {
                let (a, b) = (c[edge], c[(edge + 1) % 4]);
                let middle = [0, 1, 2].map(|i| 0.25 * (c[0][i] + c[1][i] + c[2][i] + c[3][i]));
                let on = [0, 1, 2].map(|i| 0.5 * middle[i] + 0.3 * a[i] + 0.2 * b[i]);
                for (towards, inside) in
                    [(0.999, true), (0.5, true), (0.01, true), (1.001, false), (1.5, false)]
                {
                    let point = [0, 1, 2].map(|i| centre[i] + towards * (on[i] - centre[i]));
                    assert_eq!(holds(&SKEWED, point), inside, "{towards} of {on:?}");
                }
            }
        }
    }

    #[test]
    fn a_planted_node_is_found_and_bodies_apart_have_none() {
        let deck = r#"
            title = "two boxes"
            units = "SI"
            [control]
            end_cycle = 1
            [[part]]
            name = "left"
            material = "CU_OFHC"
            box = { origin = [0, 0, 0], size = [3, 3, 3], cells = [3, 3, 3] }
            [[part]]
            name = "right"
            material = "CU_OFHC"
            box = { origin = [3.1, 0.2, 0.2], size = [2, 2, 2], cells = [2, 2, 2] }
        "#;
        let mesh = model(deck).mesh;
        assert_eq!(intruders(&mesh, &mesh.positions), []);
        let node = mesh.parts[1].nodes[0];
        let mut x = mesh.positions.clone();
        x[node as usize] = [2.9, 0.2, 0.2];
        assert_eq!(intruders(&mesh, &x), [Intruder { node, element: 2 }]);
        // The other way round: a corner of the first part in the middle of an element of the second.
        let corner = mesh.parts[0].nodes[63];
        let mut x = mesh.positions.clone();
        x[corner as usize] = [4.6, 1.7, 1.7];
        // Drawn so far, the last element of the first part has swallowed a node as well.
        let found = intruders(&mesh, &x);
        assert!(found.contains(&Intruder { node: corner, element: 27 + 7 }), "{found:?}");
    }

    #[test]
    fn planted_bars_that_cross_without_a_node_inside_either_are_found() {
        let deck = r#"
            title = "two bars"
            units = "SI"
            [control]
            end_cycle = 1
            [[part]]
            name = "along x"
            material = "CU_OFHC"
            box = { origin = [-5, -1, -1], size = [10, 2, 2], cells = [1, 1, 1] }
            [[part]]
            name = "along y"
            material = "CU_OFHC"
            box = { origin = [-0.9, -5, 1.1], size = [2, 10, 2], cells = [1, 1, 1] }
        "#;
        let mesh = model(deck).mesh;
        assert_eq!(crossed(&mesh, &mesh.positions), []);
        let mut x = mesh.positions.clone();
        for n in &mesh.parts[1].nodes {
            x[*n as usize][2] -= 0.3;
        }
        assert_eq!(intruders(&mesh, &x), [], "no node is inside the other bar");
        let found = crossed(&mesh, &x);
        assert!(found.iter().any(|p| p.edge_of == 0 && p.element == 1), "{found:?}");
        assert!(found.iter().any(|p| p.edge_of == 1 && p.element == 0), "{found:?}");
        assert_eq!(pierced(&mesh, &x), [], "there are no shells");
    }

    #[test]
    fn a_planted_crossing_of_shells_is_found_and_sheets_apart_have_none() {
        let deck = r#"
            title = "two sheets"
            units = "SI"
            [control]
            end_cycle = 1
            [[part]]
            name = "lower"
            material = "MILD_STEEL"
            shell = { thickness = 0.1 }
            plate = { origin = [0, 0, 0], side_i = [5, 0, 0], side_j = [0, 5, 0], cells = [5, 5] }
            [[part]]
            name = "upper"
            material = "MILD_STEEL"
            shell = { thickness = 0.1 }
            plate = { origin = [0.3, 0.2, 0.2], side_i = [4, 0, 0], side_j = [0, 4, 0], cells = [4, 4] }
        "#;
        let mesh = model(deck).mesh;
        assert_eq!(pierced(&mesh, &mesh.positions), []);
        // A node of the upper sheet under the lower: its four elements go through.
        let node = mesh.parts[1].nodes[12] as usize;
        let mut x = mesh.positions.clone();
        x[node][2] = -0.05;
        let found = pierced(&mesh, &x);
        let uppers: std::collections::BTreeSet<u32> =
            found.iter().flat_map(|p| [p.edge_of, p.element]).filter(|e| *e >= 25).collect();
        assert_eq!(uppers.into_iter().collect::<Vec<_>>(), [25 + 5, 25 + 6, 25 + 9, 25 + 10], "{found:?}");
        // A sheet that stands upright across the other.
        let mut x = mesh.positions.clone();
        for n in &mesh.parts[1].nodes {
            let x = &mut x[*n as usize];
            *x = [2.6, x[1], x[0] - 2.35];
        }
        let found = pierced(&mesh, &x);
        assert!(found.iter().any(|p| p.edge_of >= 25 && p.element < 25), "{found:?}");
        // Within one sheet: a fold that passes through a row further on.
        let mut x = mesh.positions.clone();
        x[mesh.parts[0].nodes[0] as usize] = [3.5, 3.5, 0.1];
        x[mesh.parts[0].nodes[21] as usize][2] = 0.5;
        assert!(pierced(&mesh, &x).iter().any(|p| p.edge_of == 0 || p.element == 0));
    }

    #[test]
    fn distances_of_shells_are_those_of_nodes_edges_and_faces() {
        let deck = r#"
            title = "two sheets"
            units = "SI"
            [control]
            end_cycle = 1
            [[part]]
            name = "lower"
            material = "MILD_STEEL"
            shell = { thickness = 0.1 }
            plate = { origin = [0, 0, 0], side_i = [1, 0, 0], side_j = [0, 1, 0], cells = [1, 1] }
            [[part]]
            name = "upper"
            material = "MILD_STEEL"
            shell = { thickness = 0.1 }
            plate = { origin = [0.3, 0.2, 0.2], side_i = [1, 0, 0], side_j = [0, 1, 0], cells = [1, 1] }
        "#;
        let mesh = model(deck).mesh;
        let near = |distance: f64, expected: f64| {
            assert!((distance - expected).abs() < 1e-14, "{distance} {expected}")
        };
        near(nearest(&mesh, &mesh.positions, 1.0), 0.2);
        near(nearest(&mesh, &mesh.positions, 0.1), 0.1);
        // The upper sheet in four places: a corner over the face, beside an edge, beyond a corner, upright through it.
        let placed = |corners: [[f64; 3]; 4]| {
            let mut x = mesh.positions.clone();
            for (n, corner) in mesh.parts[1].corners(0).into_iter().zip(corners) {
                x[n as usize] = corner;
            }
            nearest(&mesh, &x, 1.0)
        };
        near(placed([[0.5, 0.4, 0.05], [1.5, 0.4, 1.0], [1.5, 1.4, 2.0], [0.5, 1.4, 1.0]]), 0.05);
        near(placed([[1.03, 0.5, 0.04], [2.0, 0.5, 0.04], [2.0, 1.5, 0.04], [1.03, 1.5, 0.04]]), 0.05);
        near(placed([[1.02, 1.03, 0.06], [2.0, 1.03, 0.06], [2.0, 2.0, 0.06], [1.02, 2.0, 0.06]]), 0.07);
        near(placed([[0.5, 0.2, -0.5], [0.5, 0.8, -0.5], [0.5, 0.8, 0.5], [0.5, 0.2, 0.5]]), 0.0);
        // Edges that cross 0.1 apart, no node over a face.
        near(placed([[1.05, -0.5, -0.5], [1.05, 0.5, 0.5], [3.0, 0.5, 0.5], [3.0, -0.5, -0.5]]), 0.05);
    }
}
