//! Blocks on an I,J,K grid: bricks with graded spacing, tubes.

use mechanics::mesh::Topology;

use super::block::{Block, cosine_and_sine};

/// Coordinates of `cells + 1` node planes from `origin` over `size`, the last cell `ratio` times as long as
/// the first, each cell longer than the one before by the same factor.
pub(crate) fn graded(origin: f64, size: f64, cells: u32, ratio: f64) -> Vec<f64> {
    let n = f64::from(cells);
    let factor = if cells > 1 { libm::pow(ratio, 1.0 / (n - 1.0)) } else { 1.0 };
    let mut coordinates: Vec<f64> = (0..=cells)
        .map(|i| {
            let i = f64::from(i);
            let part = if (factor - 1.0).abs() < 1e-12 {
                size * i / n
            } else {
                size * ((libm::pow(factor, i) - 1.0) / (libm::pow(factor, n) - 1.0))
            };
            origin + part
        })
        .collect();
    coordinates[0] = origin;
    coordinates[cells as usize] = origin + size;
    coordinates
}

/// A brick with node planes at the given coordinates.
pub(super) fn brick(coordinates: &[Vec<f64>; 3]) -> Block {
    let [xs, ys, zs] = coordinates;
    let mut positions = Vec::with_capacity(xs.len() * ys.len() * zs.len());
    for &z in zs {
        for &y in ys {
            positions.extend(xs.iter().map(|&x| [x, y, z]));
        }
    }
    let cells = [xs.len() - 1, ys.len() - 1, zs.len() - 1].map(|c| c as u32);
    Block { positions, topology: Topology::Structured { cells }, faces: grid_faces(cells) }
}

/// The six sides of an I,J,K grid by name.
fn grid_faces(cells: [u32; 3]) -> Vec<(&'static str, Vec<u32>)> {
    const NAMES: [[&str; 2]; 3] = [["i-min", "i-max"], ["j-min", "j-max"], ["k-min", "k-max"]];
    let nodes = cells.map(|c| c + 1);
    let mut faces = Vec::new();
    for (axis, names) in NAMES.iter().enumerate() {
        for (end, name) in names.iter().enumerate() {
            let fixed = if end == 0 { 0 } else { cells[axis] };
            let (low, high) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut side = Vec::with_capacity((nodes[low] * nodes[high]) as usize);
            for b in 0..nodes[high] {
                for a in 0..nodes[low] {
                    let mut index = [0; 3];
                    index[axis] = fixed;
                    index[low] = a;
                    index[high] = b;
                    side.push(index[0] + nodes[0] * (index[1] + nodes[1] * index[2]));
                }
            }
            side.sort_unstable();
            faces.push((*name, side));
        }
    }
    faces
}

/// A tube about z from z = 0: structured if it is open, explicit if it closes on itself.
pub(super) fn tube(radii: [f64; 2], length: f64, degrees: [f64; 2], cells: [u32; 3]) -> Block {
    let closed = degrees[1] == 360.0;
    let [ni, nj, nk] = cells;
    let rows = if closed { nj } else { nj + 1 };
    let mut positions = Vec::with_capacity(((ni + 1) * rows * (nk + 1)) as usize);
    for k in 0..=nk {
        let z = if k == nk { length } else { length * f64::from(k) / f64::from(nk) };
        for j in 0..rows {
            let [cosine, sine] = cosine_and_sine(degrees[0] + degrees[1] * f64::from(j) / f64::from(nj));
            for i in 0..=ni {
                let t = f64::from(i) / f64::from(ni);
                let r = radii[0] * (1.0 - t) + radii[1] * t;
                positions.push([r * cosine, r * sine, z]);
            }
        }
    }
    if !closed {
        return Block { positions, topology: Topology::Structured { cells }, faces: grid_faces(cells) };
    }
    let node = |i: u32, j: u32, k: u32| i + (ni + 1) * ((j % nj) + nj * k);
    let mut hexahedra = Vec::with_capacity((ni * nj * nk) as usize);
    for k in 0..nk {
        for j in 0..nj {
            for i in 0..ni {
                let ring = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (ring(k), ring(k + 1));
                hexahedra.push([a, b, c, d, e, f, g, h]);
            }
        }
    }
    let side = |fits: &dyn Fn(u32, u32) -> bool| {
        let mut nodes = Vec::new();
        for k in 0..=nk {
            for j in 0..nj {
                nodes.extend((0..=ni).filter(|&i| fits(i, k)).map(|i| node(i, j, k)));
            }
        }
        nodes
    };
    let faces = vec![
        ("i-min", side(&|i, _| i == 0)),
        ("i-max", side(&|i, _| i == ni)),
        ("k-min", side(&|_, k| k == 0)),
        ("k-max", side(&|_, k| k == nk)),
    ];
    Block { positions, topology: Topology::Explicit { hexahedra }, faces }
}
