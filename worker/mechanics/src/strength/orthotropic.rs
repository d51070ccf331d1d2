//! Orthotropic and elastic along three axes, with failure of fibres, matrix and layers: unidirectional and woven composites.
//!
//! F. K. Chang, K. Y. Chang, A progressive damage model for laminated composites containing stress concentrations, J. Compos. Mater. 21 (1987)
//! 834, for the plane of `a` (fibres) and `b`; delamination by the quadratic criterion of J. C. Brewer, P. A. Lagace, J. Compos. Mater. 22
//! (1988) 1141. With `t = (s_ab/shear_ab)^2`:
//!
//! - fibres: `(s_a/tension_a)^2 + t` in tension, `-s_a/compression_a` in compression; then `s_a`, `s_b` and `s_ab` are gone;
//! - matrix: `(s_b/tension_b)^2 + t` in tension, `(s_b/(2 shear_ab))^2 + ((compression_b/(2 shear_ab))^2 - 1) s_b/compression_b + t` in
//!   compression; then `s_b` and `s_ab` are gone;
//! - delamination: `(s_c/tension_c)^2` in tension `+ (s_bc/shear_bc)^2 + (s_ca/shear_ca)^2`; then `s_c`, `s_bc` and `s_ca` are gone.
//!
//! Each fails when it comes to 1, and the stress falls in the next step. A normal stress that is gone is replaced by the pressure of rubble, `failed_bulk`
//! times the compression of the volume. What is left is as stiff as where the stresses that are gone stay what they are.
//!
//! The law is hypoelastic along axes that turn with the spin of the element, and makes the whole pressure. Its bulk and shear moduli are those of an
//! isotropic material with its fastest wave.

use super::{
    Around, ChangChang, Deviator, History, Memory, StrengthLaw,
    material_axes::{self, Axes, COLUMNS},
};
use crate::{
    lanes::Lane,
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law, which makes the whole pressure.
    pub struct Orthotropic = "orthotropic" {
        /// Young's modulus along a (stress), as are the next two along b and c.
        young_a: STRESS, Positive;
        young_b: STRESS, Positive;
        young_c: STRESS, Positive;
        /// Poisson's ratio: minus the strain along a of a stress along b, over that along b.
        poisson_ba: NONE, Any;
        /// The same along a of a stress along c.
        poisson_ca: NONE, Any;
        /// The same along b of a stress along c.
        poisson_cb: NONE, Any;
        /// Shear moduli of the planes (stress).
        modulus_ab: STRESS, Positive;
        modulus_bc: STRESS, Positive;
        modulus_ca: STRESS, Positive;
        /// The axis a at the start, of any length.
        ax: NONE, Any = 1.0;
        ay: NONE, Any = 0.0;
        az: NONE, Any = 0.0;
        /// A vector in the plane of a and b, on the side of b.
        dx: NONE, Any = 0.0;
        dy: NONE, Any = 1.0;
        dz: NONE, Any = 0.0;
        /// Strengths (stress): of fibres,
        tension_a: STRESS, Positive = 1e30;
        compression_a: STRESS, Positive = 1e30;
        /// of the matrix,
        tension_b: STRESS, Positive = 1e30;
        compression_b: STRESS, Positive = 1e30;
        shear_ab: STRESS, Positive = 1e30;
        /// and between layers.
        tension_c: STRESS, Positive = 1e30;
        shear_bc: STRESS, Positive = 1e30;
        shear_ca: STRESS, Positive = 1e30;
        /// Bulk modulus of what has failed (stress).
        failed_bulk: STRESS, NotNegative = 0.0;
    }
}

/// Indices of what has failed among the history variables.
const FIBRES: usize = 4;
const MATRIX: usize = 5;
const LAYERS: usize = 6;

impl Orthotropic {
    /// What the law keeps of an element: its turn and what has failed.
    pub const HISTORY: &'static [Variable] = &[
        COLUMNS[0],
        COLUMNS[1],
        COLUMNS[2],
        COLUMNS[3],
        Variable { name: "fibre_failure", unit: Unit::NONE, initial: 0.0 },
        Variable { name: "matrix_failure", unit: Unit::NONE, initial: 0.0 },
        Variable { name: "delamination", unit: Unit::NONE, initial: 0.0 },
    ];

    pub(crate) fn axes(&self) -> Option<[[f64; 3]; 3]> {
        material_axes::at_start([self.ax, self.ay, self.az], [self.dx, self.dy, self.dz])
    }

    /// Stiffness of normal strains, by rows; none where the material would give energy away.
    fn normal(&self) -> Option<[[f64; 3]; 3]> {
        let (a, b, c) = (1.0 / self.young_a, 1.0 / self.young_b, 1.0 / self.young_c);
        let (ab, ca, bc) = (-self.poisson_ba * b, -self.poisson_ca * c, -self.poisson_cb * c);
        // Inverse by cofactors.
        let (aa, bb, cc) = (b * c - bc * bc, c * a - ca * ca, a * b - ab * ab);
        let (fab, fbc, fca) = (bc * ca - ab * c, ab * ca - a * bc, ab * bc - b * ca);
        let determinant = a * aa + ab * fab + ca * fca;
        if !(determinant > 0.0 && aa > 0.0 && bb > 0.0 && cc > 0.0) {
            return None;
        }
        Some([[aa, fab, fca], [fab, bb, fbc], [fca, fbc, cc]].map(|row| row.map(|x| x / determinant)))
    }

    /// Stiffness of a volume that swells alike in all directions.
    pub(crate) fn bulk(&self) -> f64 {
        self.normal().map_or(0.0, |c| c.as_flattened().iter().sum::<f64>() / 9.0)
    }

    /// With the bulk modulus the stiffness of the fastest wave.
    pub(crate) fn shear(&self) -> f64 {
        0.75 * (self.stiffest() - self.bulk())
    }

    /// Stiffness of the fastest waves along the axes and midway between two of them (stress).
    fn stiffest(&self) -> f64 {
        let Some(c) = self.normal() else { return 0.0 };
        let moduli =
            [[0, 1], [1, 2], [2, 0]].into_iter().zip([self.modulus_ab, self.modulus_bc, self.modulus_ca]);
        moduli.fold(0.0, |most, ([i, j], g)| {
            let midway = 0.25 * (c[i][i] + c[j][j] + 2.0 * c[i][j] + 4.0 * g);
            f64::max(most, c[i][i]).max(c[j][j]).max(midway).max(g)
        })
    }

    /// The same in the layers of a shell, which leaves out what is across them.
    pub(crate) fn in_layers(&self) -> ChangChang {
        ChangChang {
            young_a: self.young_a,
            young_b: self.young_b,
            poisson_ba: self.poisson_ba,
            modulus_ab: self.modulus_ab,
            modulus_bc: self.modulus_bc,
            modulus_ca: self.modulus_ca,
            ax: self.ax,
            ay: self.ay,
            az: self.az,
            tension_a: self.tension_a,
            compression_a: self.compression_a,
            tension_b: self.tension_b,
            compression_b: self.compression_b,
            shear_ab: self.shear_ab,
            shear_share: 1.0,
            crushed_tension: 1.0,
            crushed_compression: 1.0,
            strain_tension_a: 1e30,
            strain_compression_a: 1e30,
            strain_b: 1e30,
            strain_ab: 1e30,
            strain_effective: 1e30,
        }
    }

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        if self.normal().is_none() {
            return Some(
                "Poisson's ratios with which no strain gives energy away: poisson_ba^2 below young_b/young_a, and so on",
            );
        }
        self.axes().is_none().then_some("axes a and d that are not parallel and not of no length")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Laminate {
    law: Orthotropic,
    axes: [[f64; 3]; 3],
    /// Stiffness of normal strains: aa, bb, cc, ab, bc, ca.
    normal: [f64; 6],
    shear: f64,
}

impl Laminate {
    /// # Panics
    /// If the law has a [`Orthotropic::fault`].
    pub fn new(law: &Orthotropic) -> Self {
        let (c, axes) =
            (law.normal().expect("a law without fault"), law.axes().expect("a law without fault"));
        Self {
            law: *law,
            axes,
            normal: [c[0][0], c[1][1], c[2][2], c[0][1], c[1][2], c[2][0]],
            shear: law.shear(),
        }
    }
}

/// A stress over a strength, squared.
#[inline(always)]
fn part<L: Lane>(stress: L, strength: f64) -> L {
    let part = stress * L::splat(1.0 / strength);
    part * part
}

impl StrengthLaw for Laminate {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        _history: &mut History<L>,
        memory: &mut Memory<L>,
        _active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one, two) = (L::splat(0.0), L::splat(1.0), L::splat(2.0));
        let law = &self.law;
        let axes = Axes::turned(&self.axes, &mut memory.variables, around);
        let [fibres, matrix, layers] =
            [memory.variables[FIBRES], memory.variables[MATRIX], memory.variables[LAYERS]];
        let is_one = |x: L| one.less_equal(x);
        let no_a = is_one(fibres);
        let no_b = L::either(no_a, is_one(matrix));
        let no_c = is_one(layers);

        // Strains along an axis whose stress is gone are free: the others are condensed.
        let [mut aa, mut bb, mut cc, mut ab, mut bc, mut ca] = self.normal.map(L::splat);
        let (over, free) = (one / bb, no_b);
        let (to_a, to_c) = (ab * over, bc * over);
        aa = L::select(free, to_a.neg_mul_add(ab, aa), aa);
        cc = L::select(free, to_c.neg_mul_add(bc, cc), cc);
        ca = L::select(free, to_a.neg_mul_add(bc, ca), ca);
        (ab, bc, bb) = (L::select(free, zero, ab), L::select(free, zero, bc), L::select(free, zero, bb));
        let (over, free) = (one / cc, no_c);
        let (to_a, to_b) = (ca * over, bc * over);
        aa = L::select(free, to_a.neg_mul_add(ca, aa), aa);
        bb = L::select(free, to_b.neg_mul_add(bc, bb), bb);
        ab = L::select(free, to_a.neg_mul_add(bc, ab), ab);
        (ca, bc, cc) = (L::select(free, zero, ca), L::select(free, zero, bc), L::select(free, zero, cc));
        // Without fibres the matrix is gone, too, so only c is left beside a.
        let (over, free) = (one / aa, no_a);
        cc = L::select(free, (ca * over).neg_mul_add(ca, cc), cc);
        (aa, ca) = (L::select(free, zero, aa), L::select(free, zero, ca));
        ab = L::select(free, zero, ab);

        let strain = axes.strain(around);
        let before = axes.stress_before(&trial, around, &strain, self.shear);
        let rubble = L::splat(-law.failed_bulk) * (one / around.relative_volume - one).max(zero);
        let normal = |i: usize, row: [L; 3], gone: L::Mask| {
            let [x, y, z] = row;
            let grown = x.mul_add(strain[0], y.mul_add(strain[1], z.mul_add(strain[2], before[i])));
            L::select(gone, rubble, grown)
        };
        let sheared = |i: usize, modulus: f64, gone: L::Mask| {
            L::select(gone, zero, (L::splat(modulus) * two).mul_add(strain[i], before[i]))
        };
        let stress = [
            normal(0, [aa, ab, ca], no_a),
            normal(1, [ab, bb, bc], no_b),
            normal(2, [ca, bc, cc], no_c),
            sheared(3, law.modulus_ab, no_b),
            sheared(4, law.modulus_bc, no_c),
            sheared(5, law.modulus_ca, no_c),
        ];

        let [s_a, s_b, s_c, s_ab, s_bc, s_ca] = stress;
        let shear = part(s_ab, law.shear_ab);
        let pulled = part(s_a.max(zero), law.tension_a) + shear;
        let pressed = s_a * L::splat(-1.0 / law.compression_a);
        let breaks = L::either(is_one(L::select(zero.less(s_a), pulled, zero)), is_one(pressed));
        let split = L::select(zero.less(s_b), part(s_b, law.tension_b) + shear, zero);
        let half_shear = 0.5 / law.shear_ab;
        let ratio = law.compression_b * half_shear;
        let crushed = (s_b * L::splat(half_shear)).mul_add(
            s_b * L::splat(half_shear),
            (s_b * L::splat((ratio * ratio - 1.0) / law.compression_b)) + shear,
        );
        let crushed = L::select(s_b.less(zero), crushed, zero);
        let peeled = part(s_c.max(zero), law.tension_c) + part(s_bc, law.shear_bc) + part(s_ca, law.shear_ca);
        let moves = zero.less(around.dt);
        let or = |fails: L::Mask, so_far: L| L::select(L::both(fails, moves), one, so_far);
        memory.variables[FIBRES] = or(breaks, fibres);
        memory.variables[MATRIX] = or(L::either(is_one(split), is_one(crushed)), matrix);
        memory.variables[LAYERS] = or(is_one(peeled), layers);
        memory.damage = memory.variables[FIBRES];

        axes.answer(stress, &trial, around, memory)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

    use super::{
        super::finite_strain::tests::{Cube, Gradient},
        *,
    };
    use crate::{material::Strength, state::field};

    /// A unidirectional carbon fibre in epoxy, without failure; axes askew.
    const LAW: Orthotropic = Orthotropic {
        young_a: 140e9,
        young_b: 10e9,
        young_c: 8e9,
        poisson_ba: 0.02,
        poisson_ca: 0.015,
        poisson_cb: 0.35,
        modulus_ab: 5e9,
        modulus_bc: 3e9,
        modulus_ca: 4e9,
        ax: 1.0,
        ay: 2.0,
        az: -0.5,
        dx: 0.0,
        dy: 1.0,
        dz: 1.0,
        tension_a: 1e30,
        compression_a: 1e30,
        tension_b: 1e30,
        compression_b: 1e30,
        shear_ab: 1e30,
        tension_c: 1e30,
        shear_bc: 1e30,
        shear_ca: 1e30,
        failed_bulk: 0.0,
    };
    /// The same along x, y and z, with strengths.
    const BRITTLE: Orthotropic = Orthotropic {
        ax: 1.0,
        ay: 0.0,
        az: 0.0,
        dz: 0.0,
        tension_a: 2e9,
        compression_a: 1.2e9,
        tension_b: 50e6,
        compression_b: 200e6,
        shear_ab: 80e6,
        tension_c: 40e6,
        shear_bc: 60e6,
        shear_ca: 70e6,
        ..LAW
    };

    fn cube(law: Orthotropic) -> Cube {
        assert_eq!(law.fault(), None);
        Cube::of(Strength::Orthotropic(law), law.bulk())
    }

    fn stress(cube: &Cube) -> Matrix3<f64> {
        let s = cube.deviator();
        let p = cube.block.reading(0)[field::PRESSURE];
        Matrix3::new(s[0] - p, s[3], s[5], s[3], s[1] - p, s[4], s[5], s[4], -s[0] - s[1] - p)
    }

    /// Rows a, b, c.
    fn axes(law: &Orthotropic) -> Matrix3<f64> {
        let a = Vector3::new(law.ax, law.ay, law.az).normalize();
        let c = a.cross(&Vector3::new(law.dx, law.dy, law.dz)).normalize();
        let b = c.cross(&a);
        Matrix3::from_rows(&[a.transpose(), b.transpose(), c.transpose()])
    }

    /// Stress of a small strain by the inverse of the compliance, in global components.
    fn by_compliance(law: &Orthotropic, strain: &Matrix3<f64>) -> Matrix3<f64> {
        let mut s = Matrix6::zeros();
        for (i, e) in [law.young_a, law.young_b, law.young_c].into_iter().enumerate() {
            s[(i, i)] = 1.0 / e;
        }
        s[(0, 1)] = -law.poisson_ba / law.young_b;
        s[(0, 2)] = -law.poisson_ca / law.young_c;
        s[(1, 2)] = -law.poisson_cb / law.young_c;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            s[(j, i)] = s[(i, j)];
        }
        for (i, g) in [law.modulus_ab, law.modulus_bc, law.modulus_ca].into_iter().enumerate() {
            s[(3 + i, 3 + i)] = 1.0 / g;
        }
        let axes = axes(law);
        let e = axes * strain * axes.transpose();
        let e =
            Vector6::new(e[(0, 0)], e[(1, 1)], e[(2, 2)], 2.0 * e[(0, 1)], 2.0 * e[(1, 2)], 2.0 * e[(2, 0)]);
        let t = s.try_inverse().expect("positive") * e;
        let t = Matrix3::new(t[0], t[3], t[5], t[3], t[1], t[4], t[5], t[4], t[2]);
        axes.transpose() * t * axes
    }

    fn rows(m: &Matrix3<f64>) -> Gradient {
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)]))
    }

    fn turn(angle: f64) -> Matrix3<f64> {
        *nalgebra::Rotation3::new(Vector3::new(0.3, -0.5, 0.8).normalize() * angle).matrix()
    }

    #[test]
    fn small_strains_in_all_directions_have_the_stress_of_the_compliance() {
        for component in 0..6 {
            let (i, j) = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)][component];
            let mut strain = Matrix3::zeros();
            strain[(i, j)] = 1e-7;
            strain[(j, i)] = 1e-7;
            let mut cube = cube(LAW);
            cube.step_to(&rows(&(Matrix3::identity() + strain)), 1e-3);
            let (found, wanted) = (stress(&cube), by_compliance(&LAW, &strain));
            assert!((found - wanted).norm() < 1e-6 * wanted.norm(), "{component}: {found} {wanted}");
        }
    }

    #[test]
    fn an_element_that_turns_takes_its_stress_and_its_axes_with_it() {
        let strain = Matrix3::new(2e-4, 1e-4, -0.5e-4, 1e-4, -1e-4, 0.7e-4, -0.5e-4, 0.7e-4, 0.5e-4);
        let stretch = Matrix3::identity() + strain;
        let mut cube = cube(LAW);
        cube.step_to(&rows(&stretch), 1e-3);
        let still = stress(&cube);
        for n in 1..=40 {
            cube.step_to(&rows(&(turn(f64::from(n) * 0.1) * stretch)), 1e-3);
        }
        let r = turn(4.0);
        let (found, wanted) = (stress(&cube), r * still * r.transpose());
        assert!((found - wanted).norm() < 1e-9 * wanted.norm(), "{found} {wanted}");
        // What is strained after the turn finds the turned axes.
        let more = r * (Matrix3::identity() + 2.0 * strain);
        cube.step_to(&rows(&more), 1e-3);
        let (found, wanted) = (stress(&cube), r * by_compliance(&LAW, &(2.0 * strain)) * r.transpose());
        assert!((found - wanted).norm() < 2e-3 * wanted.norm(), "{found} {wanted}");
    }

    /// Drives a strain of one component until the stress has failed; the greatest magnitude of a stress before, and the stress after.
    fn driven(
        law: Orthotropic,
        (i, j): (usize, usize),
        sign: f64,
        step: f64,
    ) -> (f64, Matrix3<f64>, Vec<f64>) {
        let mut cube = cube(law);
        let mut most = 0.0_f64;
        for n in 1..=4000 {
            let mut f = Matrix3::identity();
            let strain = sign * step * f64::from(n);
            // Uniaxial strains; shears by a symmetric stretch.
            f[(i, j)] += strain;
            if i != j {
                f[(j, i)] += strain;
            }
            cube.step_to(&rows(&f), 1e-3);
            let now = stress(&cube)[(i, j)].abs();
            if now < 0.5 * most {
                break;
            }
            most = most.max(now);
        }
        (most, stress(&cube), cube.history())
    }

    #[test]
    fn each_stress_fails_at_its_strength_and_takes_with_it_what_the_mode_says() {
        let (fibre, matrix, layers) = (FIBRES, MATRIX, LAYERS);
        for (direction, sign, strength, mode) in [
            ((0, 0), 1.0, BRITTLE.tension_a, fibre),
            ((0, 0), -1.0, BRITTLE.compression_a, fibre),
            ((1, 1), 1.0, BRITTLE.tension_b, matrix),
            ((1, 1), -1.0, BRITTLE.compression_b, matrix),
            ((2, 2), 1.0, BRITTLE.tension_c, layers),
            ((1, 2), 1.0, BRITTLE.shear_bc, layers),
            ((2, 0), -1.0, BRITTLE.shear_ca, layers),
        ] {
            // Only the mode that is asked for may fail: across the strain the others are stressed, too.
            let mut law = Orthotropic {
                tension_a: 1e30,
                compression_a: 1e30,
                tension_b: 1e30,
                compression_b: 1e30,
                tension_c: 1e30,
                shear_bc: 1e30,
                shear_ca: 1e30,
                ..BRITTLE
            };
            match mode {
                FIBRES => (law.tension_a, law.compression_a) = (BRITTLE.tension_a, BRITTLE.compression_a),
                MATRIX => (law.tension_b, law.compression_b) = (BRITTLE.tension_b, BRITTLE.compression_b),
                _ => {
                    (law.tension_c, law.shear_bc, law.shear_ca) =
                        (BRITTLE.tension_c, BRITTLE.shear_bc, BRITTLE.shear_ca);
                }
            }
            let (most, after, history) = driven(law, direction, sign, 1e-5);
            assert!((most / strength - 1.0).abs() < 0.02, "{direction:?} {sign}: {most:e} {strength:e}");
            assert_eq!(history[mode], 1.0, "{direction:?}");
            let gone: &[(usize, usize)] = match mode {
                FIBRES => &[(0, 0), (1, 1), (0, 1)],
                MATRIX => &[(1, 1), (0, 1)],
                _ => &[(2, 2), (1, 2), (2, 0)],
            };
            for &at in gone {
                assert!(after[at].abs() < 1e-6 * strength, "{direction:?} {at:?}: {:e}", after[at]);
            }
        }
        let (most, after, history) = driven(BRITTLE, (0, 1), 1.0, 1e-5);
        assert!((most / BRITTLE.shear_ab - 1.0).abs() < 0.01 && after[(0, 1)].abs() < 1.0, "{most}");
        assert!(history[FIBRES] == 1.0 || history[MATRIX] == 1.0);
    }

    #[test]
    fn without_the_matrix_the_fibres_are_drawn_as_a_bar() {
        // b is free: the stress along a is that of plane stress in b.
        let law = Orthotropic { tension_b: 1e3, poisson_ca: 0.0, poisson_cb: 0.0, ..LAW };
        let law = Orthotropic { ax: 1.0, ay: 0.0, az: 0.0, dz: 0.0, ..law };
        let mut cube = cube(law);
        cube.step_to(&[[1.0, 0.0, 0.0], [0.0, 1.0 + 1e-6, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        cube.step_to(&[[1.0, 0.0, 0.0], [0.0, 1.0 + 2e-6, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        let start = stress(&cube)[(0, 0)];
        cube.step_to(&[[1.0 + 1e-6, 0.0, 0.0], [0.0, 1.0 + 2e-6, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        let found = stress(&cube);
        let slope = (found[(0, 0)] - start) / 1e-6;
        assert!((slope / law.young_a - 1.0).abs() < 1e-5 && found[(1, 1)].abs() < 1.0, "{slope:e} {found}");
    }

    #[test]
    fn energy_is_the_work_of_the_stresses_through_failure() {
        let law = Orthotropic { failed_bulk: 1e9, ..BRITTLE };
        let mut cube = cube(law);
        let mut work = 0.0;
        let path = |s: f64| 1.0 + 0.02 * s * (1.0 - 2.0 * s);
        let mut last = stress(&cube);
        for n in 1..=4000 {
            let (from, to) = (path(f64::from(n - 1) / 4000.0), path(f64::from(n) / 4000.0));
            cube.step_to(&[[to, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1e-3);
            let now = stress(&cube);
            work += 0.5 * (last[(0, 0)] + now[(0, 0)]) * (to - from);
            last = now;
        }
        let energy = cube.block.reading(0)[field::ENERGY];
        assert!(cube.history()[MATRIX] > 0.0 || cube.history()[LAYERS] > 0.0 || cube.history()[FIBRES] > 0.0);
        assert!((energy - work).abs() < 1e-6 * work.abs().max(1e3), "{energy} {work}");
    }

    #[test]
    fn constants_that_make_no_material_are_refused() {
        for law in [
            Orthotropic { poisson_ba: 0.9, ..LAW },
            Orthotropic { ax: 0.0, ay: 0.0, az: 0.0, ..LAW },
            Orthotropic { dx: 2.0, dy: 4.0, dz: -1.0, ..LAW },
        ] {
            assert!(law.fault().is_some(), "{law:?}");
        }
        // An isotropic one has the moduli that it is known by.
        let g = 80e9 / 2.6;
        let isotropic = Orthotropic {
            young_a: 80e9,
            young_b: 80e9,
            young_c: 80e9,
            poisson_ba: 0.3,
            poisson_ca: 0.3,
            poisson_cb: 0.3,
            modulus_ab: g,
            modulus_bc: g,
            modulus_ca: g,
            ..LAW
        };
        assert!((isotropic.bulk() / (80e9 / 1.2) - 1.0).abs() < 1e-12);
        assert!((isotropic.shear() / g - 1.0).abs() < 1e-12);
    }
}
