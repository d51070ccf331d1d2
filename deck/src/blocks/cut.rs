//! Blocks cut at a plane across an axis, through the origin: whole elements stay or go.

use mechanics::{element::tet10, mesh::Topology};

use super::block::Block;
use crate::geometry::{norm, sub};

/// Distance at which a node counts as on the plane, over the shortest edge of the block.
const ON_PLANE: f64 = 1e-3;

/// An element that a cut would go through, from its least to its greatest coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Straddles {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Block {
    /// Whether the block has nodes below and above the plane; none of a block without nodes.
    pub(crate) fn side_of(&self, axis: usize) -> Option<(bool, bool)> {
        let near = self.near();
        let along = || self.positions.iter().map(|x| x[axis]);
        (!self.positions.is_empty()).then(|| (along().any(|x| x < -near), along().any(|x| x > near)))
    }

    /// Leaves the elements above the plane, puts the nodes at it exactly on it, and drops faces that are gone.
    ///
    /// # Errors
    /// An element that lies on both sides; the block is as it was.
    pub(crate) fn cut(&mut self, axis: usize) -> Result<(), Straddles> {
        let near = self.near();
        let x = |node: u32| self.positions[node as usize][axis];
        let mut keeps = Vec::with_capacity(self.n_elements());
        for e in 0..self.n_elements() {
            let along = || self.corners(e).into_iter().map(x);
            let (low, high) =
                (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
            if low < -near && high > near {
                return Err(Straddles { low, high });
            }
            keeps.push(high > near);
        }
        let mut used = vec![false; self.positions.len()];
        for e in (0..keeps.len()).filter(|e| keeps[*e]) {
            match &self.topology {
                Topology::Tetrahedra { tetrahedra } => {
                    tetrahedra[e].iter().for_each(|node| used[*node as usize] = true);
                }
                _ => self.corners(e).into_iter().for_each(|node| used[node as usize] = true),
            }
        }
        let mut new = vec![u32::MAX; used.len()];
        let mut positions = Vec::new();
        for (old, _) in used.iter().enumerate().filter(|(_, used)| **used) {
            new[old] = positions.len() as u32;
            let mut position = self.positions[old];
            if position[axis].abs() <= near {
                position[axis] = 0.0;
            }
            positions.push(position);
        }
        let renumbered = |corner: &u32| new[*corner as usize];
        let whole: Option<Vec<[u32; 8]>> = match &self.topology {
            // What is left of a tube that reaches across the plane twice is no grid.
            Topology::Structured { cells } if grid_nodes(left(*cells, &keeps)) != positions.len() => {
                let kept = (0..keeps.len()).filter(|e| keeps[*e]);
                Some(kept.map(|e| self.corners(e).each_ref().map(renumbered)).collect())
            }
            _ => None,
        };
        let mut kept = keeps.iter();
        let mut stays = || *kept.next().unwrap_or(&false);
        match &mut self.topology {
            Topology::Structured { cells } => *cells = left(*cells, &keeps),
            Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => {
                hexahedra.retain(|_| stays());
                hexahedra.iter_mut().for_each(|corners| *corners = corners.each_ref().map(renumbered));
            }
            Topology::Tetrahedra { tetrahedra } => {
                tetrahedra.retain(|_| stays());
                tetrahedra.iter_mut().for_each(|nodes| *nodes = nodes.each_ref().map(renumbered));
            }
            Topology::Shells { quads, thicknesses, .. } => {
                let keep: Vec<bool> = quads.iter().map(|_| stays()).collect();
                let mut kept = keep.iter();
                quads.retain(|_| *kept.next().expect("one for each"));
                let mut kept = keep.iter();
                thicknesses.retain(|_| *kept.next().expect("one for each"));
                quads.iter_mut().for_each(|corners| *corners = corners.each_ref().map(renumbered));
            }
            Topology::Beams { bars, across, .. } => {
                let keep: Vec<bool> = bars.iter().map(|_| stays()).collect();
                let mut kept = keep.iter();
                bars.retain(|_| *kept.next().expect("one for each"));
                let mut kept = keep.iter();
                across.retain(|_| *kept.next().expect("one for each"));
                bars.iter_mut().for_each(|ends| *ends = ends.each_ref().map(renumbered));
            }
            Topology::Trusses { bars, .. } | Topology::Springs { bars, .. } => {
                bars.retain(|_| stays());
                bars.iter_mut().for_each(|ends| *ends = ends.each_ref().map(renumbered));
            }
        }
        if let Some(hexahedra) = whole {
            self.topology = Topology::Explicit { hexahedra };
        }
        for (_, nodes) in &mut self.faces {
            nodes.retain(|node| used[*node as usize]);
            nodes.iter_mut().for_each(|node| *node = new[*node as usize]);
        }
        // Of a face across the plane only its edge on the plane may be left, which is no face.
        self.faces.retain(|(_, nodes)| nodes.iter().any(|node| positions[*node as usize][axis] > near));
        self.positions = positions;
        Ok(())
    }

    fn n_elements(&self) -> usize {
        match &self.topology {
            Topology::Structured { cells } => cells.iter().map(|c| *c as usize).product(),
            Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => hexahedra.len(),
            Topology::Tetrahedra { tetrahedra } => tetrahedra.len(),
            Topology::Shells { quads, .. } => quads.len(),
            Topology::Trusses { bars, .. }
            | Topology::Springs { bars, .. }
            | Topology::Beams { bars, .. } => bars.len(),
        }
    }

    /// The nodes of an element, some of them twice where it has fewer than eight.
    fn corners(&self, e: usize) -> [u32; 8] {
        match &self.topology {
            Topology::Structured { cells } => {
                let [ni, nj, _] = cells.map(|c| c as usize);
                let first = e % ni + (ni + 1) * (e / ni % nj + (nj + 1) * (e / ni / nj));
                let layer = (ni + 1) * (nj + 1);
                let quad = [first, first + 1, first + ni + 2, first + ni + 1];
                std::array::from_fn(|c| (quad[c % 4] + layer * (c / 4)) as u32)
            }
            Topology::Explicit { hexahedra } | Topology::EightPoint { hexahedra } => hexahedra[e],
            Topology::Tetrahedra { tetrahedra } => tet10::collapsed(&tetrahedra[e]),
            Topology::Shells { quads, .. } => std::array::from_fn(|c| quads[e][c % 4]),
            Topology::Trusses { bars, .. }
            | Topology::Springs { bars, .. }
            | Topology::Beams { bars, .. } => std::array::from_fn(|c| bars[e][c % 2]),
        }
    }

    /// Distance at which a node counts as on a plane.
    fn near(&self) -> f64 {
        let mut shortest = f64::INFINITY;
        for e in 0..self.n_elements() {
            let corners = self.corners(e);
            for [a, b] in crate::geometry::EDGES {
                if corners[a] != corners[b] {
                    let [a, b] = [a, b].map(|c| self.positions[corners[c] as usize]);
                    shortest = shortest.min(norm(sub(a, b)));
                }
            }
        }
        if shortest.is_finite() { ON_PLANE * shortest } else { 0.0 }
    }
}

fn grid_nodes(cells: [u32; 3]) -> usize {
    cells.iter().map(|c| *c as usize + 1).product()
}

/// Cells along I, J and K of what is kept of a grid, where that is a range along one of the three.
fn left(cells: [u32; 3], keeps: &[bool]) -> [u32; 3] {
    let [ni, nj, nk] = cells.map(|c| c as usize);
    let at = |i: usize, j: usize, k: usize| keeps[i + ni * (j + nj * k)];
    let along = |n: usize, has: &dyn Fn(usize) -> bool| (0..n).filter(|index| has(*index)).count() as u32;
    [
        along(ni, &|i| (0..nk).any(|k| (0..nj).any(|j| at(i, j, k)))),
        along(nj, &|j| (0..nk).any(|k| (0..ni).any(|i| at(i, j, k)))),
        along(nk, &|k| (0..nj).any(|j| (0..ni).any(|i| at(i, j, k)))),
    ]
}
