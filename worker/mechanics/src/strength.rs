//! Strength laws on lanes: what becomes of a trial deviator.
//!
//! The element turns the deviatoric stress and adds the elastic increment `2 G dev(D) dt`; a law returns this
//! trial to its yield surface and keeps the history. A new law is a file like its neighbours here: constants,
//! [`StrengthLaw`], tests. Lanes whose trial lies inside the surface come back
//! unchanged to the bit, so that leaving out the plastic branch for a set without yielding lanes changes nothing.

use crate::{
    lanes::Lane,
    material::{Material, Strength},
};

pub(crate) mod cowper_symonds;
pub(crate) mod elastic;
pub(crate) mod johnson_cook;
pub(crate) mod plane_stress;
pub(crate) mod tabulated;
pub(crate) mod von_mises;

pub(crate) use {
    cowper_symonds::RateFactor, elastic::Elastic, elastic::Hydro, johnson_cook::JohnsonCook,
    tabulated::Tabulated, von_mises::VonMises,
};

/// Deviatoric stress, or the deviator of the rate of deformation.
#[derive(Clone, Copy)]
pub(crate) struct Deviator<L> {
    pub xx: L,
    pub yy: L,
    pub zz: L,
    pub xy: L,
    pub yz: L,
    pub zx: L,
}

impl<L: Lane> Deviator<L> {
    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = L::splat(0.0);
        Self { xx: zero, yy: zero, zz: zero, xy: zero, yz: zero, zx: zero }
    }

    /// Double contraction `self : other`.
    #[inline(always)]
    pub fn contract(&self, other: &Self) -> L {
        let shear = self.xy.mul_add(other.xy, self.yz.mul_add(other.yz, self.zx * other.zx));
        let normal = self.xx.mul_add(other.xx, self.yy.mul_add(other.yy, self.zz * other.zz));
        L::splat(2.0).mul_add(shear, normal)
    }

    /// Squared von Mises stress, `3/2 self : self`.
    #[inline(always)]
    pub fn mises_square(&self) -> L {
        L::splat(1.5) * self.contract(self)
    }

    /// `self + other`.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            yy: self.yy + other.yy,
            zz: self.zz + other.zz,
            xy: self.xy + other.xy,
            yz: self.yz + other.yz,
            zx: self.zx + other.zx,
        }
    }

    /// Sum of the components: finite only if all are.
    #[inline(always)]
    pub fn sum(&self) -> L {
        (self.xx + self.yy + self.zz) + (self.xy + self.yz + self.zx)
    }

    /// `self * factor`.
    #[inline(always)]
    pub fn scaled(&self, factor: L) -> Self {
        Self {
            xx: self.xx * factor,
            yy: self.yy * factor,
            zz: self.zz * factor,
            xy: self.xy * factor,
            yz: self.yz * factor,
            zx: self.zx * factor,
        }
    }

    /// `self * factor + other`.
    #[inline(always)]
    pub fn mul_add(&self, factor: L, other: &Self) -> Self {
        Self {
            xx: self.xx.mul_add(factor, other.xx),
            yy: self.yy.mul_add(factor, other.yy),
            zz: self.zz.mul_add(factor, other.zz),
            xy: self.xy.mul_add(factor, other.xy),
            yz: self.yz.mul_add(factor, other.yz),
            zx: self.zx.mul_add(factor, other.zx),
        }
    }
}

/// What a law remembers of an element.
#[derive(Clone, Copy)]
pub(crate) struct History<L> {
    /// Effective plastic strain.
    pub plastic_strain: L,
    /// Temperature (K).
    pub temperature: L,
}

/// The rate of a step: effective deviatoric strain rate `sqrt(2/3 D':D')` (1/time) and its product with dt.
#[derive(Clone, Copy)]
pub(crate) struct Strain<L> {
    pub rate: L,
    pub increment: L,
}

/// A strength law.
pub(crate) trait StrengthLaw: Copy {
    /// Whether there is a deviatoric stress at all.
    #[inline(always)]
    fn deviatoric(&self) -> bool {
        true
    }

    /// Whether the plastic strain changes.
    #[inline(always)]
    fn plastic(&self) -> bool {
        true
    }

    /// Whether the temperature matters and changes.
    #[inline(always)]
    fn thermal(&self) -> bool {
        false
    }

    /// Shear modulus G (stress).
    fn shear(&self) -> f64;

    /// Returns the trial deviator to the yield surface. Only lanes in `active` need be right; what the others
    /// hold is arbitrary.
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L>;
}

/// Any of the laws, chosen by the material: the choice is one branch for a lane set, the same for the whole block.
#[derive(Clone, Copy)]
pub(crate) enum AnyStrength {
    Hydro(Hydro),
    Elastic(Elastic),
    VonMises(VonMises),
    Tabulated(Tabulated),
    JohnsonCook(JohnsonCook),
}

impl AnyStrength {
    /// That of a material, made ready. Gases have none.
    pub fn of(material: &Material) -> Self {
        match material.strength {
            _ if material.is_gas() => Self::Hydro(Hydro),
            Strength::Hydro => Self::Hydro(Hydro),
            Strength::Elastic { shear } => Self::Elastic(Elastic { shear }),
            Strength::VonMises { shear, yield_stress, hardening, rate } => {
                Self::VonMises(VonMises { shear, yield_stress, hardening, rate: RateFactor::of(rate) })
            }
            Strength::Tabulated { shear, hardening, rate } => {
                Self::Tabulated(Tabulated::new(shear, &hardening, RateFactor::of(rate)))
            }
            Strength::JohnsonCook { shear, a, b, n, c, m, t_melt, t_room, specific_heat, rate0 } => {
                Self::JohnsonCook(JohnsonCook {
                    shear,
                    a,
                    b,
                    n,
                    c,
                    m,
                    t_room,
                    inverse_range: 1.0 / (t_melt - t_room),
                    heating: 1.0 / (material.density * specific_heat),
                    inverse_rate0: 1.0 / rate0,
                })
            }
        }
    }
}

impl StrengthLaw for AnyStrength {
    #[inline(always)]
    fn deviatoric(&self) -> bool {
        !matches!(self, Self::Hydro(_))
    }

    #[inline(always)]
    fn plastic(&self) -> bool {
        !matches!(self, Self::Hydro(_) | Self::Elastic(_))
    }

    #[inline(always)]
    fn thermal(&self) -> bool {
        matches!(self, Self::JohnsonCook(_))
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        match self {
            Self::Hydro(law) => law.shear(),
            Self::Elastic(law) => law.shear(),
            Self::VonMises(law) => law.shear(),
            Self::Tabulated(law) => law.shear(),
            Self::JohnsonCook(law) => law.shear(),
        }
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        match self {
            Self::Hydro(law) => law.update(trial, strain, history, active),
            Self::Elastic(law) => law.update(trial, strain, history, active),
            Self::VonMises(law) => law.update(trial, strain, history, active),
            Self::Tabulated(law) => law.update(trial, strain, history, active),
            Self::JohnsonCook(law) => law.update(trial, strain, history, active),
        }
    }
}
