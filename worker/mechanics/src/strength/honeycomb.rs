//! Honeycomb and foam with a grain: three normal and three shear stresses along the axes of the material, none of which knows of the others, until it
//! is compacted to a solid.
//!
//! J. O. Hallquist, LS-DYNA theoretical manual (1998), material model 26. With `s = (1 - v)/(1 - solid_volume)` between 0 and 1:
//!
//! - each stress grows by its modulus times the strain of the step; the modulus goes with `s` from its own to that of the solid;
//! - each is bounded, either way, by its factor times the curve at the loss of volume `1 - v`;
//! - from `solid_volume` down it is an isotropic elastic solid that yields after von Mises without hardening.
//!
//! The law makes the whole pressure; bulk and shear moduli are those of the solid.

use super::{
    Around, Deviator, Hardening, History, Memory, StrengthLaw,
    curve::Curve,
    material_axes::{self, Axes, COLUMNS},
};
use crate::{
    lanes::Lane,
    law::{Variable, declared},
};

declared! {
    /// Constants of the law; the curve is that of the stress by loss of volume along a.
    pub struct Honeycomb = "honeycomb" {
        /// Young's modulus of the solid (stress).
        young: STRESS, Positive;
        /// Poisson's ratio of the solid.
        poisson: NONE, NotNegative;
        /// Its yield stress.
        yield_stress: STRESS, Positive;
        /// Relative volume from which down it is solid.
        solid_volume: NONE, Fraction;
        /// Moduli before it is crushed (stress).
        young_a: STRESS, Positive;
        young_b: STRESS, Positive;
        young_c: STRESS, Positive;
        modulus_ab: STRESS, Positive;
        modulus_bc: STRESS, Positive;
        modulus_ca: STRESS, Positive;
        /// The bound of each stress over the curve.
        factor_b: NONE, NotNegative = 1.0;
        factor_c: NONE, NotNegative = 1.0;
        factor_ab: NONE, NotNegative = 1.0;
        factor_bc: NONE, NotNegative = 1.0;
        factor_ca: NONE, NotNegative = 1.0;
        /// The axis a at the start, of any length.
        ax: NONE, Any = 1.0;
        ay: NONE, Any = 0.0;
        az: NONE, Any = 0.0;
        /// A vector in the plane of a and b, on the side of b.
        dx: NONE, Any = 0.0;
        dy: NONE, Any = 1.0;
        dz: NONE, Any = 0.0;
    }
}

impl Honeycomb {
    /// What the points of the curve are.
    pub const POINTS: &'static str = "[loss of volume, stress]";

    /// The turn of an element.
    pub const HISTORY: &'static [Variable] = &COLUMNS;

    /// That of the solid.
    pub(crate) fn bulk(&self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    /// That of the solid.
    pub(crate) fn shear(&self) -> f64 {
        0.5 * self.young / (1.0 + self.poisson)
    }

    pub(crate) fn axes(&self) -> Option<[[f64; 3]; 3]> {
        material_axes::at_start([self.ax, self.ay, self.az], [self.dx, self.dy, self.dz])
    }

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        if self.poisson >= 0.5 {
            return Some("a Poisson's ratio below 0.5");
        }
        if self.solid_volume <= 0.0 || self.solid_volume >= 1.0 {
            return Some("a solid_volume above 0 and below 1");
        }
        let normal = [self.young_a, self.young_b, self.young_c].into_iter().fold(0.0, f64::max);
        let sheared = [self.modulus_ab, self.modulus_bc, self.modulus_ca].into_iter().fold(0.0, f64::max);
        if normal > self.young || sheared > self.shear() {
            return Some("moduli of the cells at most those of the solid");
        }
        self.axes().is_none().then_some("axes a and d that are not parallel and not of no length")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Cells {
    law: Honeycomb,
    axes: [[f64; 3]; 3],
    curve: Curve,
    /// Moduli of the six stresses before it is crushed, and what the solid has more.
    moduli: [[f64; 2]; 6],
    factors: [f64; 6],
    bulk: f64,
    shear: f64,
}

impl Cells {
    /// # Panics
    /// If the law has a [`Honeycomb::fault`].
    pub fn new(law: &Honeycomb, curve: &Hardening) -> Self {
        let (young, twice) = (law.young, 2.0 * law.shear());
        Self {
            law: *law,
            axes: law.axes().expect("a law without fault"),
            curve: Curve::new(curve),
            moduli: [
                [law.young_a, young - law.young_a],
                [law.young_b, young - law.young_b],
                [law.young_c, young - law.young_c],
                [2.0 * law.modulus_ab, twice - 2.0 * law.modulus_ab],
                [2.0 * law.modulus_bc, twice - 2.0 * law.modulus_bc],
                [2.0 * law.modulus_ca, twice - 2.0 * law.modulus_ca],
            ],
            factors: [1.0, law.factor_b, law.factor_c, law.factor_ab, law.factor_bc, law.factor_ca],
            bulk: law.bulk(),
            shear: law.shear(),
        }
    }

    /// The solid: elastic and perfectly plastic.
    #[inline(always)]
    fn solid<L: Lane>(&self, before: &[L; 6], strain: &[L; 6]) -> [L; 6] {
        let third = L::splat(1.0 / 3.0);
        let swelling = strain[0] + strain[1] + strain[2];
        let mean = (before[0] + before[1] + before[2]) * third;
        let twice = L::splat(2.0 * self.shear);
        let mut s = *before;
        let mut i = 0;
        while i < 6 {
            let [own, all] = if i < 3 { [mean, swelling * third] } else { [L::splat(0.0); 2] };
            s[i] = twice.mul_add(strain[i] - all, before[i] - own);
            i += 1;
        }
        let normal = s[0].mul_add(s[0], s[1].mul_add(s[1], s[2] * s[2]));
        let sheared = s[3].mul_add(s[3], s[4].mul_add(s[4], s[5] * s[5]));
        let mises = (L::splat(1.5) * L::splat(2.0).mul_add(sheared, normal)).sqrt();
        let bound = L::splat(self.law.yield_stress);
        let factor = L::select(bound.less(mises), bound / mises.max(bound), L::splat(1.0));
        let mean = L::splat(self.bulk).mul_add(swelling, mean);
        [
            factor.mul_add(s[0], mean),
            factor.mul_add(s[1], mean),
            factor.mul_add(s[2], mean),
            factor * s[3],
            factor * s[4],
            factor * s[5],
        ]
    }
}

impl StrengthLaw for Cells {
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
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let axes = Axes::turned(&self.axes, &mut memory.variables, around);
        let strain = axes.strain(around);
        let before = axes.stress_before(&trial, around, &strain, self.shear);
        let lost = one - around.relative_volume;
        let share = (lost * L::splat(1.0 / (1.0 - self.law.solid_volume))).max(zero).min(one);
        let [bound, slope, _] = self.curve.at(lost.max(zero));
        let is_solid = around.relative_volume.less_equal(L::splat(self.law.solid_volume));
        let solid = self.solid(&before, &strain);
        let mut stress = before;
        let mut i = 0;
        while i < 6 {
            let [modulus, more] = self.moduli[i].map(L::splat);
            let grown = share.mul_add(more, modulus).mul_add(strain[i], before[i]);
            let bound = bound * L::splat(self.factors[i]);
            stress[i] = L::select(is_solid, solid[i], grown.min(bound).max(-bound));
            i += 1;
        }
        // The solid holds the step down from the start, and what unloads grows towards it. What is crushed meets the waves of the cells.
        let met = slope + L::splat(self.law.young_a.max(self.law.young_b).max(self.law.young_c));
        let whole = L::splat((4.0 / 3.0 * self.shear) + self.bulk);
        memory.idle_stiffness = L::select(is_solid, zero, (whole - met).max(zero));
        axes.answer(stress, &trial, around, memory)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::finite_strain::tests::Cube, *};
    use crate::{material::Strength, state::field};

    const LAW: Honeycomb = Honeycomb {
        young: 70e9,
        poisson: 0.3,
        yield_stress: 200e6,
        solid_volume: 0.2,
        young_a: 1e9,
        young_b: 0.3e9,
        young_c: 0.2e9,
        modulus_ab: 0.4e9,
        modulus_bc: 0.1e9,
        modulus_ca: 0.2e9,
        factor_b: 0.1,
        factor_c: 0.05,
        factor_ab: 0.4,
        factor_bc: 0.2,
        factor_ca: 0.3,
        ax: 1.0,
        ay: 0.0,
        az: 0.0,
        dx: 0.0,
        dy: 1.0,
        dz: 0.0,
    };
    const POINTS: [[f64; 2]; 3] = [[0.0, 5e6], [0.6, 6e6], [0.8, 40e6]];

    fn cube(law: Honeycomb) -> Cube {
        assert_eq!(law.fault(), None);
        Cube::of(Strength::Honeycomb(law, Hardening::through(&POINTS)), law.bulk())
    }

    /// xx, yy, zz, xy, yz, zx.
    fn stress(cube: &Cube) -> [f64; 6] {
        let (s, p) = (cube.deviator(), cube.block.reading(0)[field::PRESSURE]);
        [s[0] - p, s[1] - p, s[2] - p, s[3], s[4], s[5]]
    }

    #[test]
    fn each_stress_is_crushed_along_its_own_curve_and_the_others_stay_nothing() {
        for axis in 0..3 {
            let mut cube = cube(LAW);
            let factor = [1.0, LAW.factor_b, LAW.factor_c][axis];
            for n in 1..=75 {
                let lost = 0.01 * f64::from(n);
                let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                f[axis][axis] = 1.0 - lost;
                cube.step_to(&f, 1e-3);
                let curve = if lost < 0.6 { 5e6 + lost / 0.6 * 1e6 } else { 6e6 + (lost - 0.6) / 0.2 * 34e6 };
                let found = stress(&cube);
                assert!((found[axis] + factor * curve).abs() < 1e-6 * curve, "{axis} {lost}: {found:?}");
                for other in (0..6).filter(|other| *other != axis) {
                    assert!(found[other].abs() < 1e-6 * curve, "{axis} {lost}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn small_strains_have_moduli_of_their_own() {
        for (i, modulus) in [
            LAW.young_a,
            LAW.young_b,
            LAW.young_c,
            2.0 * LAW.modulus_ab,
            2.0 * LAW.modulus_bc,
            2.0 * LAW.modulus_ca,
        ]
        .into_iter()
        .enumerate()
        {
            let (row, column) = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)][i];
            let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            f[row][column] += 1e-7;
            if row != column {
                f[column][row] += 1e-7;
            }
            let mut cube = cube(LAW);
            cube.step_to(&f, 1e-3);
            let found = stress(&cube);
            for (j, component) in found.into_iter().enumerate() {
                let wanted = if i == j { modulus * 1e-7 } else { 0.0 };
                assert!((component - wanted).abs() < 1e-5 * modulus * 1e-7, "{i} {j}: {found:?}");
            }
        }
    }

    #[test]
    fn a_sheared_honeycomb_yields_at_the_bound_of_that_plane() {
        let mut cube = cube(LAW);
        for n in 1..=100 {
            let gamma = 2e-4 * f64::from(n);
            cube.step_to(&[[1.0, gamma, 0.0], [gamma, 1.0, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        }
        let found = stress(&cube);
        let lost = 0.02_f64 * 0.02;
        let wanted = LAW.factor_ab * (5e6 + lost / 0.6 * 1e6);
        assert!((found[3] / wanted - 1.0).abs() < 1e-6, "{found:?} {wanted}");
    }

    #[test]
    fn compacted_it_is_a_solid_that_yields() {
        let mut cube = cube(LAW);
        for n in 1..=800 {
            cube.step_to(&[[1.0 - 0.001 * f64::from(n), 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        }
        let start = stress(&cube);
        let mean = |s: [f64; 6]| (s[0] + s[1] + s[2]) / 3.0;
        for n in 1..=100 {
            let x = 0.2 - 1e-4 * f64::from(n);
            cube.step_to(&[[x, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        }
        let found = stress(&cube);
        let wanted = LAW.bulk() * (0.19_f64 / 0.2).ln();
        assert!(((mean(found) - mean(start)) / wanted - 1.0).abs() < 1e-3, "{found:?} {start:?}");
        assert!(((found[0] - found[1]).abs() / LAW.yield_stress - 1.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_turned_honeycomb_is_crushed_along_its_turned_axis() {
        let (sine, cosine) = 0.5_f64.sin_cos();
        let mut cube = cube(LAW);
        for n in 1..=50 {
            let angle = 0.01 * f64::from(n);
            let (s, c) = angle.sin_cos();
            cube.step_to(&[[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        }
        // Half of its length along the turned a.
        for n in 1..=100 {
            let x = 1.0 - 0.005 * f64::from(n);
            cube.step_to(&[[x * cosine, -sine, 0.0], [x * sine, cosine, 0.0], [0.0, 0.0, 1.0]], 1e-3);
        }
        let [xx, yy, zz, xy, ..] = stress(&cube);
        let crush = -(5e6 + 0.5 / 0.6 * 1e6);
        for (found, wanted) in
            [(xx, crush * cosine * cosine), (yy, crush * sine * sine), (xy, crush * sine * cosine), (zz, 0.0)]
        {
            assert!((found - wanted).abs() < 1e-6 * 6e6, "{found} {wanted}");
        }
    }

    #[test]
    fn constants_that_make_no_honeycomb_are_refused() {
        for law in [
            Honeycomb { poisson: 0.5, ..LAW },
            Honeycomb { solid_volume: 1.0, ..LAW },
            Honeycomb { young_b: 80e9, ..LAW },
            Honeycomb { dx: 1.0, dy: 0.0, ..LAW },
        ] {
            assert!(law.fault().is_some(), "{law:?}");
        }
    }
}
