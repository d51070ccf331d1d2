//! Clouds of boxes, and what a sort of them finds beside what brute force finds.

use std::collections::BTreeSet;

use mechanics::{
    contact::{Exclusions, Settings, Surface, WorkUnit, sort},
    mesh::Mesh,
};

use super::world::{Random, add_block, deform, materials, on_surface};

/// Whether a pair is to be tested, and near enough to be on the list.
fn wanted(surface: &Surface, x: &[[f64; 3]], settings: &Settings, node: u32, face: u32) -> bool {
    let f = &surface.faces[face as usize];
    let p = x[node as usize];
    settings.interacts[surface.node_part[node as usize] as usize * settings.n_parts() + f.part as usize]
        && !f.corners.contains(&surface.nodes[node as usize])
        && (0..3).all(|a| {
            let c = f.nodes.map(|n| x[n as usize][a]);
            let min = c.into_iter().fold(f64::INFINITY, f64::min);
            let max = c.into_iter().fold(f64::NEG_INFINITY, f64::max);
            p[a] >= min - settings.reach() && p[a] <= max + settings.reach()
        })
}

fn sorted_pairs(
    surface: &Surface,
    x: &[[f64; 3]],
    settings: &Settings,
    units: &[WorkUnit],
) -> BTreeSet<(u32, u32)> {
    let mut pairs = BTreeSet::new();
    let mut seen = BTreeSet::new();
    for unit in units {
        let mut interactions = 0;
        for &n in &unit.nodes {
            assert!(seen.insert(n), "node {n} is in two units");
            for &f in &unit.faces {
                let face = &surface.faces[f as usize];
                let part = surface.node_part[n as usize] as usize;
                if settings.interacts[part * settings.n_parts() + face.part as usize]
                    && !face.corners.contains(&surface.nodes[n as usize])
                {
                    interactions += 1;
                }
                if wanted(surface, x, settings, n, f) {
                    assert!(pairs.insert((n, f)));
                }
            }
        }
        assert!(unit.nodes.is_sorted() && unit.faces.is_sorted());
        assert_eq!(unit.interactions, interactions, "{:?}", unit.cube);
        assert!(interactions > 0);
    }
    pairs
}

fn brute_force(surface: &Surface, x: &[[f64; 3]], settings: &Settings) -> BTreeSet<(u32, u32)> {
    let mut pairs = BTreeSet::new();
    for n in 0..surface.nodes.len() as u32 {
        for f in 0..surface.faces.len() as u32 {
            if wanted(surface, x, settings, n, f) {
                pairs.insert((n, f));
            }
        }
    }
    pairs
}

/// How many pairs brute force finds, and how many one of the two finds alone.
pub fn compare(mesh: &Mesh, settings: &Settings) -> (usize, usize) {
    let surface = Surface::new(mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let units = sort(&surface, &x, settings, &Exclusions::default());
    let brute = brute_force(&surface, &x, settings);
    let sorted = sorted_pairs(&surface, &x, settings, &units);
    (brute.len(), brute.symmetric_difference(&sorted).count())
}

/// How many pairs both find.
pub fn agree(mesh: &Mesh, settings: &Settings) -> usize {
    let (pairs, differences) = compare(mesh, settings);
    assert_eq!(differences, 0, "of {pairs}");
    pairs
}

/// Positions on a grid fine enough to look random and coarse enough that a large translation is exact.
fn exact(p: f64) -> f64 {
    (p * 65536.0).round() / 65536.0
}

/// Boxes of two elements, bent a little, anywhere in a cube of side `n`: one part each.
pub fn cloud(n: usize, parts: usize, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let mut mesh = Mesh::default();
    for _ in 0..parts {
        let mut part = Mesh::default();
        let size = random.within(0.2, 1.5);
        add_block(&mut part, [1, 1, 2], [0.0; 3], size);
        let offset = random.point(0.0, n as f64);
        deform(&mut part, |p| [0, 1, 2].map(|a| exact(p[a] + offset[a] + random.within(-0.1, 0.1))));
        let first = mesh.positions.len() as u32;
        part.parts[0].nodes.iter_mut().for_each(|node| *node += first);
        mesh.positions.extend(part.positions);
        mesh.node_ids.extend(part.node_ids);
        mesh.parts.extend(part.parts);
    }
    mesh
}
