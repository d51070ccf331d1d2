//! Round solid blocks: a core of bulged cells on a lattice inside layers that grow round.
//!
//! Nodes are numbered on an integer lattice: a point of the core is `(a, b)` (cylinder) or `(a, b, c)`
//! (sphere) with each index from `-n` or 0 to `n`; the points of the lattice's rim go out through the
//! layers to the surface. Positions follow from the magnitudes of the indices and take their signs, so
//! the meshes are symmetric to the bit and cut planes are exact planes. The directions of the rim are
//! equiangular: the tangent of `index / n * 45` degrees.

use std::collections::BTreeMap;

use mechanics::mesh::Topology;

use super::block::{Block, Sector};
use crate::geometry::norm;

/// Distance of the core's diagonal corner per axis over its half width (cylinder): 0.42 R for 0.5 R.
const DIAGONAL: f64 = 0.84;
/// The same for the corner of the sphere's core.
const CORNER: f64 = 0.74;

/// Tangent of `i / n` times 45 degrees, exactly 1 at the end.
fn tangent(i: i32, n: i32) -> f64 {
    if i.abs() == n {
        1.0
    } else {
        libm::tan(f64::from(i.abs()) / f64::from(n) * std::f64::consts::FRAC_PI_4)
    }
}

/// `x` with the sign of an index; zero for index zero.
fn signed(x: f64, index: i32) -> f64 {
    match index.signum() {
        0 => 0.0,
        1 => x,
        _ => -x,
    }
}

/// A cylinder along z from z = 0.
pub(super) fn cylinder(radius: f64, length: f64, sector: Sector, core: f64, cells: [u32; 3]) -> Block {
    let [n, rings, layers] = cells.map(|c| c as i32);
    let low = [if sector < Sector::Quarter { -n } else { 0 }, if sector == Sector::Full { -n } else { 0 }];
    let mut points = Vec::new();
    let mut index = BTreeMap::new();
    let on_rim = |a: i32, b: i32| a.abs() == n || b.abs() == n;
    for ring in 0..=rings {
        for b in low[1]..=n {
            for a in low[0]..=n {
                if ring == 0 || on_rim(a, b) {
                    index.insert((ring, a, b), points.len() as u32);
                    points.push(disc_point([a, b], ring, n, rings, radius, core));
                }
            }
        }
    }
    let mut quads = Vec::new();
    for b in low[1]..n {
        for a in low[0]..n {
            quads.push([(0, a, b), (0, a + 1, b), (0, a + 1, b + 1), (0, a, b + 1)]);
        }
    }
    // The rim against the clock's hands.
    let mut rim = Vec::new();
    rim.extend((low[1]..n).map(|b| ((n, b), (n, b + 1))));
    rim.extend((low[0]..n).rev().map(|a| ((a + 1, n), (a, n))));
    if low[0] < 0 {
        rim.extend((low[1]..n).rev().map(|b| ((-n, b + 1), (-n, b))));
    }
    if low[1] < 0 {
        rim.extend((low[0]..n).map(|a| ((a, -n), (a + 1, -n))));
    }
    for (p, q) in rim {
        for r in 0..rings {
            quads.push([(r, p.0, p.1), (r + 1, p.0, p.1), (r + 1, q.0, q.1), (r, q.0, q.1)]);
        }
    }
    let quads: Vec<[u32; 4]> = quads.iter().map(|quad| quad.map(|key| index[&key])).collect();
    let per_layer = points.len() as u32;
    let mut positions = Vec::with_capacity(points.len() * (layers as usize + 1));
    let mut hexahedra = Vec::with_capacity(quads.len() * layers as usize);
    for k in 0..=layers {
        let z = if k == layers { length } else { length * f64::from(k) / f64::from(layers) };
        positions.extend(points.iter().map(|[x, y]| [*x, *y, z]));
    }
    for k in 0..layers as u32 {
        for quad in &quads {
            let [a, b, c, d] = quad.map(|node| node + k * per_layer);
            let [e, f, g, h] = quad.map(|node| node + (k + 1) * per_layer);
            hexahedra.push([a, b, c, d, e, f, g, h]);
        }
    }
    let all_layers = |fits: &dyn Fn(i32, i32, i32) -> bool| -> Vec<u32> {
        let mut flat: Vec<u32> =
            index.iter().filter(|((r, a, b), _)| fits(*r, *a, *b)).map(|(_, &node)| node).collect();
        flat.sort_unstable();
        (0..=layers as u32).flat_map(|k| flat.iter().map(move |node| node + k * per_layer)).collect()
    };
    let mut faces = vec![
        ("i-max", all_layers(&|r, _, _| r == rings)),
        ("k-min", (0..per_layer).collect()),
        ("k-max", (0..per_layer).map(|node| node + layers as u32 * per_layer).collect()),
    ];
    if low[1] == 0 {
        faces.push(("j-min", all_layers(&|_, _, b| b == 0)));
    }
    if low[0] == 0 {
        faces.push(("j-max", all_layers(&|_, a, _| a == 0)));
    }
    Block { positions, topology: Topology::Explicit { hexahedra }, faces }
}

/// Position of lattice point `at` on ring `ring` of the disc.
fn disc_point(at: [i32; 2], ring: i32, n: i32, rings: i32, radius: f64, core: f64) -> [f64; 2] {
    let [u, w] = at.map(|i| f64::from(i.abs()) / f64::from(n));
    let (side, diagonal) = (core * radius, DIAGONAL * core * radius);
    let inner = [u * ((1.0 - w) * side + w * diagonal), w * ((1.0 - u) * side + u * diagonal)];
    let t = f64::from(ring) / f64::from(rings);
    let position = if ring == 0 {
        inner
    } else {
        let direction = at.map(|i| tangent(i, n));
        let long = libm::hypot(direction[0], direction[1]);
        [0, 1].map(|i| (1.0 - t) * inner[i] + t * radius * direction[i] / long)
    };
    [signed(position[0], at[0]), signed(position[1], at[1])]
}

/// A sphere about the origin.
pub(super) fn sphere(radius: f64, sector: Sector, core: f64, cells: [u32; 2]) -> Block {
    let [n, layers] = cells.map(|c| c as i32);
    let low = [
        if sector < Sector::Octant { -n } else { 0 },
        if sector < Sector::Quarter { -n } else { 0 },
        if sector < Sector::Half { -n } else { 0 },
    ];
    let mut positions = Vec::new();
    let mut index = BTreeMap::new();
    for layer in 0..=layers {
        for c in low[2]..=n {
            for b in low[1]..=n {
                for a in low[0]..=n {
                    let at = [a, b, c];
                    if layer == 0 || at.iter().any(|i| i.abs() == n) {
                        index.insert((layer, at), positions.len() as u32);
                        positions.push(ball_point(at, layer, n, layers, radius, core));
                    }
                }
            }
        }
    }
    let mut hexahedra = Vec::new();
    for c in low[2]..n {
        for b in low[1]..n {
            for a in low[0]..n {
                let square = |c| [[a, b, c], [a + 1, b, c], [a + 1, b + 1, c], [a, b + 1, c]];
                let ([p, q, r, s], [t, u, v, w]) = (square(c), square(c + 1));
                hexahedra.push([p, q, r, s, t, u, v, w].map(|at| index[&(0, at)]));
            }
        }
    }
    for axis in 0..3 {
        for end in [-1, 1] {
            if end < 0 && low[axis] == 0 {
                continue;
            }
            let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
            for j in low[second]..n {
                for i in low[first]..n {
                    let point = |i: i32, j: i32| {
                        let mut at = [0; 3];
                        at[axis] = end * n;
                        at[first] = i;
                        at[second] = j;
                        at
                    };
                    let mut quad = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
                    if end < 0 {
                        quad.reverse();
                    }
                    for layer in 0..layers {
                        let [a, b, c, d] = quad.map(|at| index[&(layer, at)]);
                        let [e, f, g, h] = quad.map(|at| index[&(layer + 1, at)]);
                        hexahedra.push([a, b, c, d, e, f, g, h]);
                    }
                }
            }
        }
    }
    let mut surface: Vec<u32> =
        index.iter().filter(|((layer, _), _)| *layer == layers).map(|(_, &node)| node).collect();
    surface.sort_unstable();
    Block { positions, topology: Topology::Explicit { hexahedra }, faces: vec![("i-max", surface)] }
}

/// Position of lattice point `at` on layer `layer` of the ball.
fn ball_point(at: [i32; 3], layer: i32, n: i32, layers: i32, radius: f64, core: f64) -> [f64; 3] {
    let u = at.map(|i| f64::from(i.abs()) / f64::from(n));
    let side = core * radius;
    let mut inner = [0.0; 3];
    for axis in 0..3 {
        let (v, w) = (u[(axis + 1) % 3], u[(axis + 2) % 3]);
        let near = (1.0 - v) * (1.0 - w) + DIAGONAL * (v * (1.0 - w) + w * (1.0 - v)) + CORNER * v * w;
        inner[axis] = side * u[axis] * near;
    }
    let t = f64::from(layer) / f64::from(layers);
    let direction = at.map(|i| tangent(i, n));
    let long = norm(direction);
    let mut position = inner;
    if layer > 0 {
        for axis in 0..3 {
            position[axis] = (1.0 - t) * inner[axis] + t * radius * direction[axis] / long;
        }
    }
    [0, 1, 2].map(|axis| signed(position[axis], at[axis]))
}
