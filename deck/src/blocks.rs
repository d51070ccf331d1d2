//! Mesh blocks: the shapes a deck can ask for, as nodes and hexahedra of one part.
//!
//! A shape is first read ([`Shape`]), its size checked against the limits, and only then built, so that no
//! deck allocates more than the limits allow. Every shape gives hexahedra of positive volume, which the
//! whole-mesh check confirms again.

mod block;
mod cut;
mod o_grid;
mod sheet;
mod structured;
#[cfg(test)]
mod tests;

pub(crate) use block::{Block, Sector};
pub(crate) use cut::Straddles;
pub(crate) use structured::graded;

use mechanics::mesh::Section;

/// A shape with all its numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// A brick with node planes at these coordinates.
    Brick {
        /// Ascending coordinates along x, y, z.
        coordinates: [Vec<f64>; 3],
    },
    /// A solid cylinder as an O-grid: a square core of `2 core` cells across inside rings.
    Cylinder {
        axis: usize,
        base: [f64; 3],
        radius: f64,
        length: f64,
        sector: Sector,
        /// Half width of the core over the radius.
        core_fraction: f64,
        /// Cells across half the core, through the rings, along the axis.
        cells: [u32; 3],
    },
    /// A solid sphere as a cube of cells inside layers.
    Sphere {
        centre: [f64; 3],
        radius: f64,
        sector: Sector,
        core_fraction: f64,
        /// Cells across half the core, through the layers.
        cells: [u32; 2],
    },
    /// A hollow cylinder or a piece of one; I is radial, J goes round, K along the axis.
    Tube {
        axis: usize,
        base: [f64; 3],
        /// Inner and outer radius.
        radii: [f64; 2],
        length: f64,
        /// First angle and angle covered (degrees); 360 closes the tube.
        degrees: [f64; 2],
        cells: [u32; 3],
    },
    /// A parallelogram of shells; I along the first side, J along the second, the upper side by the right hand.
    Plate {
        origin: [f64; 3],
        /// From the origin along I and along J.
        sides: [[f64; 3]; 2],
        cells: [u32; 2],
        section: Section,
    },
    /// The wall of a tube of shells, round or with flat sides; I goes round, J along the axis, the upper side outward.
    Prism {
        axis: usize,
        base: [f64; 3],
        /// Of the middle surface, to the corners.
        radius: f64,
        length: f64,
        /// Number of flat sides; none for a round tube.
        sides: Option<u32>,
        cells: [u32; 2],
        section: Section,
    },
}

impl Shape {
    /// Number of nodes and elements that [`Shape::build`] makes; `None` past 2^63.
    pub(crate) fn size(&self) -> Option<(u64, u64)> {
        let wide = |c: u32| u64::from(c);
        match self {
            Self::Brick { coordinates } => {
                let nodes = coordinates.iter().try_fold(1u64, |n, c| n.checked_mul(c.len() as u64))?;
                let cells = coordinates.iter().try_fold(1u64, |n, c| n.checked_mul(c.len() as u64 - 1))?;
                Some((nodes, cells))
            }
            Self::Cylinder { sector, cells: [core, ring, length], .. } => {
                // No more than the full disc, which has (2c+1)^2 core nodes and 8c nodes a ring.
                let quarters: u64 = if *sector == Sector::Full {
                    4
                } else if *sector == Sector::Half {
                    2
                } else {
                    1
                };
                let core = wide(*core);
                let layer = quarters.checked_mul(
                    core.checked_mul(core)?.checked_add(core.checked_mul(wide(*ring))?.checked_mul(2)?)?,
                )?;
                let rim = core.checked_mul(8)?.checked_add(wide(*ring).checked_mul(2)?)?.checked_add(1)?;
                let nodes = layer.checked_add(rim)?.checked_mul(wide(*length) + 1)?;
                Some((nodes, layer.checked_mul(wide(*length))?))
            }
            Self::Sphere { sector, cells: [core, layers], .. } => {
                let octants: u64 = match sector {
                    Sector::Full => 8,
                    Sector::Half => 4,
                    Sector::Quarter => 2,
                    Sector::Octant => 1,
                };
                let square = wide(*core).checked_mul(wide(*core))?;
                let cells = octants.checked_mul(
                    square
                        .checked_mul(wide(*core))?
                        .checked_add(square.checked_mul(wide(*layers))?.checked_mul(3)?)?,
                )?;
                // A convex grid of hexahedra has at most eight nodes a cell.
                Some((cells.checked_mul(8)?, cells))
            }
            Self::Tube { cells, .. } => {
                let nodes = cells.iter().try_fold(1u64, |n, &c| n.checked_mul(wide(c) + 1))?;
                let elements = cells.iter().try_fold(1u64, |n, &c| n.checked_mul(wide(c)))?;
                Some((nodes, elements))
            }
            Self::Plate { cells: [ni, nj], .. } | Self::Prism { cells: [ni, nj], .. } => {
                let nodes = (wide(*ni) + 1).checked_mul(wide(*nj) + 1)?;
                Some((nodes, wide(*ni).checked_mul(wide(*nj))?))
            }
        }
    }

    /// Its counts of cells, in the order that a deck gives them.
    pub(crate) fn cells(&self) -> Vec<u32> {
        match self {
            Self::Brick { coordinates } => coordinates.iter().map(|planes| planes.len() as u32 - 1).collect(),
            Self::Cylinder { cells, .. } | Self::Tube { cells, .. } => cells.to_vec(),
            Self::Sphere { cells, .. } | Self::Plate { cells, .. } | Self::Prism { cells, .. } => {
                cells.to_vec()
            }
        }
    }

    /// The nodes and elements of this shape.
    pub(crate) fn build(&self) -> Block {
        match self {
            Self::Brick { coordinates } => structured::brick(coordinates),
            Self::Cylinder { axis, base, radius, length, sector, core_fraction, cells } => {
                let mut block = o_grid::cylinder(*radius, *length, *sector, *core_fraction, *cells);
                block.place(*axis, *base);
                block
            }
            Self::Sphere { centre, radius, sector, core_fraction, cells } => {
                let mut block = o_grid::sphere(*radius, *sector, *core_fraction, *cells);
                block.place(2, *centre);
                block
            }
            Self::Tube { axis, base, radii, length, degrees, cells } => {
                let mut block = structured::tube(*radii, *length, *degrees, *cells);
                block.place(*axis, *base);
                block
            }
            Self::Plate { origin, sides, cells, section } => {
                sheet::plate(*origin, *sides, *cells, section.clone())
            }
            Self::Prism { axis, base, radius, length, sides, cells, section } => {
                let mut block = sheet::prism(*radius, *length, *sides, *cells, section.clone());
                block.place(*axis, *base);
                block
            }
        }
    }
}
