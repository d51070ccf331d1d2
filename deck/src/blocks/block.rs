//! Nodes and elements of one part, and how they are turned and moved.

use mechanics::mesh::Topology;

use crate::geometry::{add, cross, dot, scaled, sub};

/// Nodes and elements of one part, before parts are put together.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) topology: Topology,
    /// Named outer faces: the local nodes of each.
    pub(crate) faces: Vec<(&'static str, Vec<u32>)>,
}

/// How much of a round body is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub(crate) enum Sector {
    Full,
    /// Where the second local axis is not negative (sphere: z).
    Half,
    /// Where both local axes are not negative (sphere: y and z).
    Quarter,
    /// Sphere only: where x, y and z are not negative.
    Octant,
}

impl Block {
    /// Turns a block built along z so that its z axis becomes `axis` (x and y follow in cyclic order), then
    /// moves its origin to `base`.
    pub(super) fn place(&mut self, axis: usize, base: [f64; 3]) {
        for p in &mut self.positions {
            let mut turned = [0.0; 3];
            for (local, x) in p.iter().enumerate() {
                turned[(local + axis + 1) % 3] = *x;
            }
            *p = add(turned, base);
        }
    }

    /// Turns the block about an axis of unit length through `point` (Rodrigues), `degrees` counted by the
    /// right hand.
    pub(crate) fn rotate(&mut self, point: [f64; 3], axis: [f64; 3], degrees: f64) {
        let [cosine, sine] = cosine_and_sine(degrees);
        let turned = |r: [f64; 3]| {
            let parallel = scaled(axis, dot(axis, r) * (1.0 - cosine));
            add(add(scaled(r, cosine), scaled(cross(axis, r), sine)), parallel)
        };
        for p in &mut self.positions {
            *p = add(turned(sub(*p, point)), point);
        }
        if let Topology::Beams { across, .. } = &mut self.topology {
            across.iter_mut().for_each(|across| *across = turned(*across));
        }
    }

    /// Moves the block.
    pub(crate) fn translate(&mut self, by: [f64; 3]) {
        for p in &mut self.positions {
            *p = add(*p, by);
        }
    }
}

/// Cosine and sine of an angle in degrees, exact at multiples of 90, so that cut planes are planes.
pub(super) fn cosine_and_sine(degrees: f64) -> [f64; 2] {
    let turned = degrees.rem_euclid(360.0);
    if turned == 0.0 {
        [1.0, 0.0]
    } else if turned == 90.0 {
        [0.0, 1.0]
    } else if turned == 180.0 {
        [-1.0, 0.0]
    } else if turned == 270.0 {
        [0.0, -1.0]
    } else {
        let radians = turned.to_radians();
        [libm::cos(radians), libm::sin(radians)]
    }
}
