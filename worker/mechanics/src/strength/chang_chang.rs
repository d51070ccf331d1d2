//! A unidirectional or woven layer of a composite shell: orthotropic in plane stress, with four modes of failure.
//!
//! F. K. Chang, K. Y. Chang, A progressive damage model for laminated composites containing stress concentrations, J. Compos. Mater. 21 (1987)
//! 834, in the form of the LS-DYNA theory manual (2006, materials 22 and 54); B. Wade, P. Feraboli, M. Osborne, Simulating laminated
//! composites using LS-DYNA material model MAT54 (JAMS 2012), write the shear term of the fibres squared, as here. With a along the fibres, b
//! across them and `t = (s_ab/shear_ab)^2`:
//!
//! - fibre tension, `s_a > 0`: `(s_a/tension_a)^2 + shear_share t`;
//! - fibre compression, `s_a < 0`: `(s_a/compression_a)^2`;
//! - matrix tension, `s_b >= 0`: `(s_b/tension_b)^2 + t`;
//! - matrix compression, `s_b < 0`: `(s_b/(2 shear_ab))^2 + ((compression_b/(2 shear_ab))^2 - 1) s_b/compression_b + t`.
//!
//! A mode fails when it comes to 1. Without strains at failure its stress falls in the next step: in fibre tension the whole layer, in fibre
//! compression `s_a`, in both modes of the matrix `s_b` and `s_ab`; what is left has no Poisson's ratio. A layer without fibres and without matrix is gone.
//!
//! With `strain_tension_a` a mode holds its stress at the criterion, by scaling the components that are in it, and the layer is gone when a strain
//! along its axes comes to one of the strains at failure. In either case it is gone at `strain_effective`, that of
//! `sqrt(4/3 (e_a^2 + e_a e_b + e_b^2 + e_ab^2))`, shears being those of the tensor.

use crate::{
    lanes::Lane,
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law, for shells.
    pub struct ChangChang = "chang-chang" {
        /// Young's modulus along the fibres and across them (stress).
        young_a: STRESS, Positive;
        young_b: STRESS, Positive;
        /// Poisson's ratio: minus the strain along a of a stress along b, over that along b.
        poisson_ba: NONE, Any;
        /// Shear moduli of the planes (stress); c is across the layer.
        modulus_ab: STRESS, Positive;
        modulus_bc: STRESS, Positive;
        modulus_ca: STRESS, Positive;
        /// A vector whose part in the plane of an element is the direction of angle 0 at the start.
        ax: NONE, Any = 1.0;
        ay: NONE, Any = 0.0;
        az: NONE, Any = 0.0;
        /// Strengths (stress): of fibres,
        tension_a: STRESS, Positive = 1e30;
        compression_a: STRESS, Positive = 1e30;
        /// and of the matrix.
        tension_b: STRESS, Positive = 1e30;
        compression_b: STRESS, Positive = 1e30;
        shear_ab: STRESS, Positive = 1e30;
        /// Share of the shear term in fibre tension.
        shear_share: NONE, NotNegative = 1.0;
        /// Shares of the strengths of fibres that are left where the matrix has failed in compression.
        crushed_tension: NONE, Positive = 1.0;
        crushed_compression: NONE, Positive = 1.0;
        /// Strains at failure along a, in tension and in compression,
        strain_tension_a: NONE, Positive = 1e30;
        strain_compression_a: NONE, Positive = 1e30;
        /// across it, and of shear (that of the tensor).
        strain_b: NONE, Positive = 1e30;
        strain_ab: NONE, Positive = 1e30;
        /// Effective strain at which a layer is gone.
        strain_effective: NONE, Positive = 1e30;
    }
}

/// A number above which a constant is none.
const NONE: f64 = 1e29;

/// Places of the history variables of a layer: stress aa, bb, ab, bc, ca first.
pub(crate) const N_STRESSES: usize = 5;
const FIBRE_TENSION: usize = 5;
const FIBRE_COMPRESSION: usize = 6;
const MATRIX_TENSION: usize = 7;
const MATRIX_COMPRESSION: usize = 8;
/// Strains aa, bb, ab.
const STRAIN: usize = 9;
/// Whether the layer is gone.
pub(crate) const GONE: usize = 12;
/// Number of history variables of a layer.
pub(crate) const N_VARIABLES: usize = 13;

const fn variable(name: &'static str, unit: Unit) -> Variable {
    Variable { name, unit, initial: 0.0 }
}

impl ChangChang {
    /// What each layer keeps.
    pub const OF_LAYER: &'static [Variable; N_VARIABLES] = &[
        variable("stress_aa", Unit::STRESS),
        variable("stress_bb", Unit::STRESS),
        variable("stress_ab", Unit::STRESS),
        variable("stress_bc", Unit::STRESS),
        variable("stress_ca", Unit::STRESS),
        variable("fibre_tension", Unit::NONE),
        variable("fibre_compression", Unit::NONE),
        variable("matrix_tension", Unit::NONE),
        variable("matrix_compression", Unit::NONE),
        variable("strain_aa", Unit::NONE),
        variable("strain_bb", Unit::NONE),
        variable("strain_ab", Unit::NONE),
        variable("layer_failure", Unit::NONE),
    ];

    /// Stiffness in the plane: aa, bb, ab of normal strains; none where the layer would give energy away.
    fn normal(&self) -> Option<[f64; 3]> {
        let coupled = self.poisson_ba * self.young_a;
        let left = 1.0 - self.poisson_ba * coupled / self.young_b;
        (left > 0.0 && left.is_finite()).then(|| [self.young_a, self.young_b, coupled].map(|x| x / left))
    }

    /// Stiffness that no strain in the plane and no transverse shear exceeds, in whatever direction: the greatest eigenvalue of the tensor (stress).
    pub(crate) fn stiffest(&self) -> f64 {
        let Some([aa, bb, ab]) = self.normal() else { return 0.0 };
        let (mean, half) = (0.5 * (aa + bb), 0.5 * (aa - bb));
        let of_normal = mean + (half * half + ab * ab).sqrt();
        of_normal.max(2.0 * self.modulus_ab).max(2.0 * self.modulus_bc).max(2.0 * self.modulus_ca)
    }

    /// Young's modulus and Poisson's ratio of a laminate of these layers in all directions alike (S. W. Tsai, N. J. Pagano 1968): the
    /// invariants `U1 = (3 Qaa + 3 Qbb + 2 Qab + 4 G)/8` and `U4 = (Qaa + Qbb + 6 Qab - 4 G)/8`.
    pub(crate) fn in_all_directions(&self) -> (f64, f64) {
        let [aa, bb, ab] = self.normal().unwrap_or_default();
        let u1 = 0.125 * (3.0 * (aa + bb) + 2.0 * ab + 4.0 * self.modulus_ab);
        let u4 = 0.125 * ((aa + bb) + 6.0 * ab - 4.0 * self.modulus_ab);
        let poisson = u4 / u1;
        (u1 * (1.0 - poisson * poisson), poisson)
    }

    /// With [`ChangChang::shear`] the moduli of an isotropic material that is as stiff as the stiffest direction.
    pub(crate) fn bulk(&self) -> f64 {
        0.5 * self.stiffest()
    }

    pub(crate) fn shear(&self) -> f64 {
        0.375 * self.stiffest()
    }

    /// Whether a mode that has failed holds its stress until a strain at failure.
    fn holds(&self) -> bool {
        self.strain_tension_a < NONE
    }

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        if self.normal().is_none() {
            return Some(
                "Poisson's ratio with which no strain gives energy away: poisson_ba^2 below young_b/young_a",
            );
        }
        let a = [self.ax, self.ay, self.az];
        let square: f64 = a.iter().map(|x| x * x).sum();
        if !(square > 0.0 && square.is_finite()) {
            return Some("an axis a of some length");
        }
        if self.crushed_tension > 1.0 || self.crushed_compression > 1.0 {
            return Some("crushed_tension and crushed_compression of at most 1");
        }
        let others = [self.strain_compression_a, self.strain_b, self.strain_ab];
        (!self.holds() && others.iter().any(|strain| *strain < NONE))
            .then_some("strain_tension_a beside the other strains along the axes of a layer")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Ply {
    law: ChangChang,
    /// Stiffness of normal strains: aa, bb, ab.
    normal: [f64; 3],
    /// Share of the transverse shear stiffness that a section has.
    transverse: f64,
    holds: bool,
}

impl Ply {
    /// The layer of a law without [fault](ChangChang::fault), in a section that has this share of the transverse shear stiffness.
    pub fn new(law: &ChangChang, transverse: f64) -> Self {
        Self { law: *law, normal: law.normal().unwrap_or_default(), transverse, holds: law.holds() }
    }

    /// Brings a layer to the end of a step with these strains along its axes: aa, bb, and ab, bc, ca of shear as engineers have it. Gives the lanes
    /// whose fibres do not hold: what the others carry along their fibres the one point of an element does not see, so hourglass control stays whole.
    #[inline(always)]
    pub fn update<L: Lane>(&self, layer: &mut [L; N_VARIABLES], strain: &[L; N_STRESSES]) -> L::Mask {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let is_one = |x: L| one.less_equal(x);
        let law = &self.law;
        let gone = is_one(layer[GONE]);
        let crushed = is_one(layer[MATRIX_COMPRESSION]);
        let (mut no_a, mut no_b) = (gone, gone);
        if !self.holds {
            no_a = L::either(gone, is_one(layer[FIBRE_COMPRESSION]));
            no_b = L::either(gone, L::either(is_one(layer[MATRIX_TENSION]), crushed));
        }
        let alone = L::either(no_a, no_b);
        let [aa, bb, ab] = self.normal.map(L::splat);
        let (aa, bb) =
            (L::select(alone, L::splat(law.young_a), aa), L::select(alone, L::splat(law.young_b), bb));
        let ab = L::select(alone, zero, ab);
        let [e_a, e_b, e_ab, e_bc, e_ca] = *strain;
        let mut s_a = L::select(no_a, zero, aa.mul_add(e_a, ab.mul_add(e_b, layer[0])));
        let mut s_b = L::select(no_b, zero, ab.mul_add(e_a, bb.mul_add(e_b, layer[1])));
        let mut s_ab = L::select(no_b, zero, L::splat(law.modulus_ab).mul_add(e_ab, layer[2]));
        let across = |modulus: f64, strain: L, before: L| {
            L::select(gone, zero, L::splat(self.transverse * modulus).mul_add(strain, before))
        };
        layer[3] = across(law.modulus_bc, e_bc, layer[3]);
        layer[4] = across(law.modulus_ca, e_ca, layer[4]);

        let left = |share: f64, strength: f64| {
            L::select(crushed, L::splat(1.0 / (share * strength)), L::splat(1.0 / strength))
        };
        let over_tension = left(law.crushed_tension, law.tension_a);
        let over_compression = left(law.crushed_compression, law.compression_a);
        let over_shear = L::splat(1.0 / law.shear_ab);
        let pulled = |s_a: L, s_ab: L| {
            let (a, t) = (s_a * over_tension, s_ab * over_shear);
            L::select(zero.less(s_a), a.mul_add(a, L::splat(law.shear_share) * t * t), zero)
        };
        let half_shear = 0.5 / law.shear_ab;
        let ratio = law.compression_b * half_shear;
        // Of the criterion of the matrix the square and the linear part.
        let of_matrix = |s_b: L, s_ab: L| {
            let t = s_ab * over_shear;
            let presses = s_b.less(zero);
            let over = L::select(presses, L::splat(half_shear), L::splat(1.0 / law.tension_b));
            let linear = s_b * L::splat((ratio * ratio - 1.0) / law.compression_b);
            ((s_b * over).mul_add(s_b * over, t * t), L::select(presses, linear, zero))
        };

        let fibre = pulled(s_a, s_ab);
        let breaks = is_one(fibre);
        let buckles = L::both(s_a.less(zero), one.less_equal(-(s_a * over_compression)));
        let mut strained = L::either(breaks, buckles);
        if self.holds {
            let scale = L::select(breaks, one / fibre.max(one).sqrt(), one);
            s_ab = if law.shear_share > 0.0 { s_ab * scale } else { s_ab };
            s_a = s_a * scale;
            s_a = L::select(buckles, -(one / over_compression), s_a);
        }
        let (square, linear) = of_matrix(s_b, s_ab);
        let fails = is_one(square + linear);
        if self.holds {
            // r of `square r^2 + linear r = 1`.
            let root = linear.mul_add(linear, L::splat(4.0) * square).sqrt() + linear;
            let scale =
                L::select(fails, (L::splat(2.0) / root.max(L::splat(f64::MIN_POSITIVE))).min(one), one);
            (s_b, s_ab) = (s_b * scale, s_ab * scale);
        }
        let mark = |fails: L::Mask, so_far: L| L::select(fails, one, so_far);
        layer[FIBRE_TENSION] = mark(breaks, layer[FIBRE_TENSION]);
        layer[FIBRE_COMPRESSION] = mark(buckles, layer[FIBRE_COMPRESSION]);
        layer[MATRIX_TENSION] = mark(L::both(fails, zero.less_equal(s_b)), layer[MATRIX_TENSION]);
        layer[MATRIX_COMPRESSION] = mark(L::both(fails, s_b.less(zero)), layer[MATRIX_COMPRESSION]);
        (layer[0], layer[1], layer[2]) = (s_a, s_b, s_ab);

        let half = L::splat(0.5);
        let e_a = layer[STRAIN] + e_a;
        let e_b = layer[STRAIN + 1] + e_b;
        let e_ab = half.mul_add(e_ab, layer[STRAIN + 2]);
        (layer[STRAIN], layer[STRAIN + 1], layer[STRAIN + 2]) = (e_a, e_b, e_ab);
        let reaches = |limit: f64, strain: L| L::splat(limit).less_equal(strain);
        let inner = e_a.mul_add(e_a, e_b.mul_add(e_b, e_a.mul_add(e_b, e_ab * e_ab)));
        let most = 0.75 * law.strain_effective * law.strain_effective;
        let mut ends = reaches(most, inner);
        if self.holds {
            ends = L::either(ends, reaches(law.strain_tension_a, e_a));
            ends = L::either(ends, reaches(law.strain_compression_a, -e_a));
            ends = L::either(ends, reaches(law.strain_b, e_b.abs()));
            ends = L::either(ends, reaches(law.strain_ab, e_ab.abs()));
        } else {
            let matrix = L::either(is_one(layer[MATRIX_TENSION]), is_one(layer[MATRIX_COMPRESSION]));
            let both = L::both(is_one(layer[FIBRE_COMPRESSION]), matrix);
            ends = L::either(ends, L::either(is_one(layer[FIBRE_TENSION]), both));
            strained = no_a;
        }
        layer[GONE] = mark(ends, layer[GONE]);
        L::either(strained, gone)
    }
}

#[cfg(test)]
mod tests;
