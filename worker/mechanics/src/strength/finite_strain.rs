//! Large stretches: the left Cauchy-Green tensor of an element at unit volume, carried from step to step.
//!
//! On the geometry of the middle of a step its velocity gradient L is that of straight paths, so
//! `dF = (I + L dt/2) (I - L dt/2)^-1` maps the edges before the step onto those after it without an error in dt, and a rigid
//! rotation of any angle is one. The tensor follows as `dF b dF^T`, brought back to unit determinant: its volume is that of
//! the equation of state, and rounding does not add up.

use crate::{
    element::vector::{Tensor, Vector},
    lanes::{Lane, functions::cbrt},
    law::{Unit, Variable},
};

/// The columns of a law that keeps the tensor, first among its history variables.
pub(super) const COLUMNS: [Variable; 6] = [
    column("left_cauchy_green_xx", 1.0),
    column("left_cauchy_green_yy", 1.0),
    column("left_cauchy_green_zz", 1.0),
    column("left_cauchy_green_xy", 0.0),
    column("left_cauchy_green_yz", 0.0),
    column("left_cauchy_green_zx", 0.0),
];

const fn column(name: &'static str, initial: f64) -> Variable {
    Variable { name, unit: Unit::NONE, initial }
}

/// A symmetric tensor.
#[derive(Clone, Copy)]
pub(super) struct Symmetric<L> {
    pub xx: L,
    pub yy: L,
    pub zz: L,
    pub xy: L,
    pub yz: L,
    pub zx: L,
}

impl<L: Lane> Symmetric<L> {
    /// Of the first six history variables.
    #[inline(always)]
    pub fn of(v: &[L]) -> Self {
        Self { xx: v[0], yy: v[1], zz: v[2], xy: v[3], yz: v[4], zx: v[5] }
    }

    /// As the first six history variables.
    #[inline(always)]
    pub fn keep(&self, v: &mut [L]) {
        (v[0], v[1], v[2], v[3], v[4], v[5]) = (self.xx, self.yy, self.zz, self.xy, self.yz, self.zx);
    }

    #[inline(always)]
    pub fn trace(&self) -> L {
        self.xx + self.yy + self.zz
    }

    /// Second invariant: the sum of the cofactors of the diagonal, `(trace^2 - trace of the square) / 2`.
    #[inline(always)]
    pub fn second(&self) -> L {
        let [x, y, z] = self.cofactors();
        x + y + z
    }

    #[inline(always)]
    fn cofactors(&self) -> [L; 3] {
        [
            self.yz.neg_mul_add(self.yz, self.yy * self.zz),
            self.zx.neg_mul_add(self.zx, self.zz * self.xx),
            self.xy.neg_mul_add(self.xy, self.xx * self.yy),
        ]
    }

    #[inline(always)]
    fn determinant(&self) -> L {
        let across_xy = self.yz.neg_mul_add(self.zx, self.xy * self.zz);
        let across_zx = self.yy.neg_mul_add(self.zx, self.xy * self.yz);
        let [x, ..] = self.cofactors();
        self.zx.mul_add(across_zx, self.xx.mul_add(x, -(self.xy * across_xy)))
    }

    /// The tensor at the end of a step `dt` with this velocity gradient in its middle.
    #[inline(always)]
    pub fn stretched(&self, gradient: &Tensor<L>, dt: L) -> Self {
        let map = increment(gradient, dt);
        let before = Tensor {
            x: Vector { x: self.xx, y: self.xy, z: self.zx },
            y: Vector { x: self.xy, y: self.yy, z: self.yz },
            z: Vector { x: self.zx, y: self.yz, z: self.zz },
        };
        let (x, y, z) = (before.apply(&map.x), before.apply(&map.y), before.apply(&map.z));
        let after = Self {
            xx: x.dot(&map.x),
            yy: y.dot(&map.y),
            zz: z.dot(&map.z),
            xy: x.dot(&map.y),
            yz: y.dot(&map.z),
            zx: z.dot(&map.x),
        };
        after.scaled(L::splat(1.0) / cbrt(after.determinant()))
    }

    #[inline(always)]
    fn scaled(&self, factor: L) -> Self {
        Self {
            xx: self.xx * factor,
            yy: self.yy * factor,
            zz: self.zz * factor,
            xy: self.xy * factor,
            yz: self.yz * factor,
            zx: self.zx * factor,
        }
    }
}

/// `dF = 2 (I - L dt/2)^-1 - I`, by cofactors.
#[inline(always)]
fn increment<L: Lane>(gradient: &Tensor<L>, dt: L) -> Tensor<L> {
    let (one, half) = (L::splat(1.0), L::splat(-0.5) * dt);
    let Tensor { x: a, y: b, z: c } = gradient.scaled(half);
    let a = Vector { x: a.x + one, ..a };
    let b = Vector { y: b.y + one, ..b };
    let c = Vector { z: c.z + one, ..c };
    // Columns of the inverse are cross products of rows over the determinant.
    let (x, y, z) = (b.cross(&c), c.cross(&a), a.cross(&b));
    let twice = L::splat(2.0) / a.dot(&x);
    let (x, y, z) = (x.scaled(twice), y.scaled(twice), z.scaled(twice));
    Tensor {
        x: Vector { x: x.x - one, y: y.x, z: z.x },
        y: Vector { x: x.y, y: y.y - one, z: z.y },
        z: Vector { x: x.z, y: y.z, z: z.z - one },
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::{
        block::Block,
        element::{ElementVote, Step},
        exact::Quantum,
        lanes::{Width, scalar::Scalar},
        material::{Eos, Failure, Material, Strength},
        mesh::Topology,
        piece::Piece,
        state::{N_FIELDS, ShellState, field},
    };

    /// A cube of one element of a law, led along a path of deformation gradients.
    pub struct Cube {
        pub block: Block,
        material: Material,
        corners: Vec<[f64; 3]>,
    }

    /// Rows of a deformation gradient.
    pub type Gradient = [[f64; 3]; 3];

    impl Cube {
        pub fn of(strength: Strength, bulk: f64) -> Self {
            let (eos, failure) = (Eos::Linear { bulk }, Failure::None);
            Self::of_material(Material { name: "a".into(), density: 1000.0, eos, strength, failure })
        }

        pub fn of_material(material: Material) -> Self {
            let corners: Vec<[f64; 3]> =
                (0..8_u32).map(|n| [n % 2, n / 2 % 2, n / 4].map(|c| f64::from(c) - 0.5)).collect();
            let history = material.history();
            let block = Block::new(&Piece {
                part: 0,
                material: 0,
                topology: Topology::Structured { cells: [1; 3] },
                nodes: (0..8).collect(),
                elements: vec![0],
                x: corners.clone(),
                v: vec![[0.0; 3]; 8],
                mass: vec![1.0; 8],
                constraint: vec![0; 8],
                initial_volume: vec![1.0],
                fields: std::array::from_fn(|k| match k {
                    field::RELATIVE_VOLUME => vec![1.0],
                    field::TEMPERATURE => vec![material.initial_temperature()],
                    _ => vec![0.0],
                }),
                erosion: None,
                history: history.iter().map(|variable| vec![variable.initial]).collect(),
                contact: Vec::new(),
                shells: ShellState::default(),
                own: Vec::new(),
                hourglass: crate::element::hourglass::Hourglass::VISCOUS,
            });
            Self { block, material, corners }
        }

        /// One step to a deformation gradient.
        pub fn step_to(&mut self, f: &Gradient, dt: f64) {
            for (n, corner) in self.corners.iter().enumerate() {
                for axis in 0..3 {
                    let x: f64 = (0..3).map(|b| f[axis][b] * corner[b]).sum();
                    self.block.v[axis][n] = (x - self.block.x[axis][n]) / dt;
                    self.block.x[axis][n] = x;
                }
            }
            let step = Step {
                dt,
                linear_viscosity: 0.0,
                quadratic_viscosity: 0.0,
                force_quantum: Quantum::for_reference(1e12, 42),
                energy_quantum: Quantum::for_reference(1e12, 40),
                arm: 1.0,
            };
            let mut vote = ElementVote::default();
            let sets = std::slice::from_ref(&(0..1));
            self.block.compute(&self.material, sets, &step, Width::best(), &mut vote);
            assert!(vote.fault.is_none(), "{:?}", vote.fault);
        }

        /// Cauchy's deviator, xx yy zz xy yz zx.
        pub fn deviator(&self) -> [f64; 6] {
            let s = self.block.reading(0);
            let (xx, yy) = (s[field::SXX], s[field::SYY]);
            [xx, yy, -(xx + yy), s[field::SXY], s[field::SYZ], s[field::SZX]]
        }

        pub fn history(&self) -> Vec<f64> {
            self.block.reading(0)[N_FIELDS..].to_vec()
        }
    }

    /// A stretch along x at unit volume.
    pub fn uniaxial(stretch: f64) -> Gradient {
        let across = stretch.powf(-0.5);
        [[stretch, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]]
    }

    /// The same stretch along x and y.
    pub fn biaxial(stretch: f64) -> Gradient {
        [[stretch, 0.0, 0.0], [0.0, stretch, 0.0], [0.0, 0.0, stretch.powi(-2)]]
    }

    /// A shear of the plane xy, then a turn about z.
    pub fn sheared(shear: f64, angle: f64) -> Gradient {
        let (sine, cosine) = angle.sin_cos();
        [[cosine, shear * cosine - sine, 0.0], [sine, shear * sine + cosine, 0.0], [0.0, 0.0, 1.0]]
    }

    /// The last of some steps along a path from 0 to 1.
    pub fn led(strength: Strength, bulk: f64, steps: u32, path: impl Fn(f64) -> Gradient) -> Cube {
        let mut cube = Cube::of(strength, bulk);
        (1..=steps).for_each(|n| cube.step_to(&path(f64::from(n) / f64::from(steps)), 1e-3));
        cube
    }

    #[test]
    fn the_tensor_is_that_of_the_deformation_whatever_the_steps() {
        let law = Strength::MooneyRivlin(super::super::MooneyRivlin { a: 1e6, b: 0.0 });
        for steps in [7, 100] {
            // A shear of 1.5 that turns by 200 degrees on its way, and a swelling that has no part in it.
            let turn = 200f64.to_radians();
            let path = |s: f64| sheared(1.5 * s, turn * s).map(|row| row.map(|c| c * (1.0 + 0.05 * s)));
            let found = led(law, 1e9, steps, path).history();
            let f = sheared(1.5, turn);
            let of = |a: usize, b: usize| (0..3).map(|k| f[a][k] * f[b][k]).sum::<f64>();
            let wanted = [of(0, 0), of(1, 1), of(2, 2), of(0, 1), of(1, 2), of(2, 0)];
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-12, "{steps}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn no_motion_leaves_the_tensor_as_it_is() {
        let zero = Vector { x: Scalar(0.0), y: Scalar(0.0), z: Scalar(0.0) };
        let still = Tensor { x: zero, y: zero, z: zero };
        let unit = Symmetric::of(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0].map(Scalar));
        let same = unit.stretched(&still, Scalar(1e-3));
        assert_eq!(
            [same.xx.0, same.yy.0, same.zz.0, same.xy.0, same.yz.0, same.zx.0],
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
        );
    }
}
