//! Blocks of shells: plates and the walls of tubes.

use mechanics::mesh::{Section, Topology};

use super::block::{Block, cosine_and_sine};
use crate::geometry::{add, scaled};

/// A parallelogram from `origin` over two sides.
pub(super) fn plate(origin: [f64; 3], sides: [[f64; 3]; 2], [ni, nj]: [u32; 2], section: Section) -> Block {
    let share = |i: u32, n: u32| f64::from(i) / f64::from(n);
    let mut positions = Vec::with_capacity(((ni + 1) * (nj + 1)) as usize);
    for j in 0..=nj {
        for i in 0..=ni {
            let along = add(scaled(sides[0], share(i, ni)), scaled(sides[1], share(j, nj)));
            positions.push(add(origin, along));
        }
    }
    let node = |i: u32, j: u32| i + (ni + 1) * j;
    let side = |fits: &dyn Fn(u32, u32) -> bool| {
        let all = (0..=nj).flat_map(|j| (0..=ni).map(move |i| (i, j)));
        all.filter(|&(i, j)| fits(i, j)).map(|(i, j)| node(i, j)).collect::<Vec<u32>>()
    };
    let faces = vec![
        ("i-min", side(&|i, _| i == 0)),
        ("i-max", side(&|i, _| i == ni)),
        ("j-min", side(&|_, j| j == 0)),
        ("j-max", side(&|_, j| j == nj)),
    ];
    Block {
        positions,
        topology: Topology::Shells { quads: quads(ni, nj, &node), section, thicknesses: Vec::new() },
        faces,
    }
}

/// The wall of a tube about z from z = 0, closed on itself.
pub(super) fn prism(
    radius: f64,
    length: f64,
    sides: Option<u32>,
    [ni, nj]: [u32; 2],
    section: Section,
) -> Block {
    // A round tube has a corner at every node.
    let corners = sides.unwrap_or(ni);
    let each = ni / corners;
    let corner = |c: u32| cosine_and_sine(360.0 * f64::from(c) / f64::from(corners)).map(|x| radius * x);
    let mut positions = Vec::with_capacity((ni * (nj + 1)) as usize);
    for j in 0..=nj {
        let z = if j == nj { length } else { length * f64::from(j) / f64::from(nj) };
        for i in 0..ni {
            let (from, to) = (corner(i / each), corner((i / each + 1) % corners));
            let t = f64::from(i % each) / f64::from(each);
            positions.push([from[0] * (1.0 - t) + to[0] * t, from[1] * (1.0 - t) + to[1] * t, z]);
        }
    }
    let node = |i: u32, j: u32| (i % ni) + ni * j;
    let faces = vec![("j-min", (0..ni).collect()), ("j-max", (ni * nj..ni * (nj + 1)).collect())];
    Block {
        positions,
        topology: Topology::Shells { quads: quads(ni, nj, &node), section, thicknesses: Vec::new() },
        faces,
    }
}

fn quads(ni: u32, nj: u32, node: &dyn Fn(u32, u32) -> u32) -> Vec<[u32; 4]> {
    let cells = (0..nj).flat_map(|j| (0..ni).map(move |i| (i, j)));
    cells.map(|(i, j)| [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]).collect()
}
