//! Strength laws on lanes: what becomes of a trial deviator.
//!
//! The element turns the deviatoric stress and adds the elastic increment `2 G dev(D) dt`; a law returns this
//! trial to its yield surface and keeps the history. A new law is a file like its neighbours here: constants,
//! [`StrengthLaw`], tests. Lanes whose trial lies inside the surface come back
//! unchanged to the bit, so that leaving out the plastic branch for a set without yielding lanes changes nothing.

use serde::{Deserialize, Serialize};

use crate::{
    element::vector::{Tensor, Vector},
    lanes::Lane,
    law::{Curved, Declaration, MAX_HISTORY, Unit, Variable},
};

pub(crate) mod any;
pub(crate) mod apart;
pub(crate) mod chang_chang;
pub(crate) mod cowper_symonds;
pub(crate) mod crushable_foam;
pub(crate) mod curve;
pub(crate) mod elastic;
pub(crate) mod finite_strain;
pub(crate) mod holmquist_johnson_cook;
pub(crate) mod honeycomb;
pub(crate) mod johnson_cook;
pub(crate) mod johnson_holmquist;
pub(crate) mod low_density_foam;
pub(crate) mod material_axes;
pub(crate) mod modified_johnson_cook;
pub(crate) mod mooney_rivlin;
pub(crate) mod newton;
mod of_material;
pub(crate) mod ogden;
pub(crate) mod orthotropic;
pub(crate) mod plane_stress;
pub(crate) mod porous;
pub(crate) mod power_law;
pub(crate) mod principal;
pub(crate) mod remembering;
pub(crate) mod riedel_hiermaier_thoma;
pub(crate) mod segmented_ceramic;
pub(crate) mod soil_foam;
pub(crate) mod steinberg_guinan;
pub(crate) mod tabulated;
pub(crate) mod tangent;
pub(crate) mod viscoelastic;
pub(crate) mod voce;
pub(crate) mod von_mises;
pub(crate) mod zerilli_armstrong;

pub use chang_chang::ChangChang;
pub use cowper_symonds::CowperSymonds;
pub use crushable_foam::CrushableFoam;
pub use curve::{Hardening, MAX_HARDENING};
pub use holmquist_johnson_cook::HolmquistJohnsonCook;
pub use honeycomb::Honeycomb;
pub use johnson_cook::Heat;
pub use johnson_holmquist::JohnsonHolmquist;
pub use low_density_foam::LowDensityFoam;
pub use modified_johnson_cook::ModifiedJohnsonCook;
pub use mooney_rivlin::MooneyRivlin;
pub use ogden::Ogden;
pub use orthotropic::Orthotropic;
pub use power_law::PowerLaw;
pub use riedel_hiermaier_thoma::RiedelHiermaierThoma;
pub use segmented_ceramic::SegmentedCeramic;
pub use soil_foam::SoilFoam;
pub use steinberg_guinan::SteinbergGuinan;
pub use viscoelastic::Viscoelastic;
pub use voce::Voce;
pub use zerilli_armstrong::ZerilliArmstrong;
pub(crate) use {
    any::AnyStrength, cowper_symonds::RateFactor, elastic::Elastic, elastic::Hydro,
    johnson_cook::JohnsonCook, principal::greatest_principal, remembering::AnyRemembering,
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

    /// `self` in the lanes of a mask, `other` in the rest.
    #[inline(always)]
    pub fn or(&self, mask: L::Mask, other: &Self) -> Self {
        Self {
            xx: L::select(mask, self.xx, other.xx),
            yy: L::select(mask, self.yy, other.yy),
            zz: L::select(mask, self.zz, other.zz),
            xy: L::select(mask, self.xy, other.xy),
            yz: L::select(mask, self.yz, other.yz),
            zx: L::select(mask, self.zx, other.zx),
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

/// What a law with history variables sees of an element beside the trial, at the end of the step where nothing else is said.
#[derive(Clone, Copy)]
#[expect(dead_code, reason = "laws are shown all of it, whichever they read")]
pub(crate) struct Around<L> {
    /// That of the equation of state at the energy of the start; [`Memory::added_pressure`] is not in it, nor is viscosity.
    pub pressure: L,
    /// The whole pressure before the step, without viscosity.
    pub pressure_before: L,
    /// Internal energy at the start of the step, per initial volume.
    pub energy: L,
    pub density: L,
    /// Volume over initial volume.
    pub relative_volume: L,
    /// The same before the step.
    pub relative_volume_before: L,
    /// Velocity gradient in the middle of the step, by rows of the velocity.
    pub gradient: Tensor<L>,
    /// Axial vector of the spin of the step, by which the trial was turned.
    pub spin: Vector<L>,
    /// Deviator of the rate of deformation in the middle of the step.
    pub rate: Deviator<L>,
    /// Rate of the volume by volume, there.
    pub volume_rate: L,
    pub strain: Strain<L>,
    /// The length that artificial viscosity goes by.
    pub length: L,
    /// The time step.
    pub dt: L,
}

impl<L: Lane> Around<L> {
    /// A bound of the strain of this step along any direction; of one direction alone it is that.
    #[inline(always)]
    pub fn shortened(&self) -> L {
        (self.volume_rate * self.dt).abs().mul_add(L::splat(1.0 / 3.0), self.strain.increment)
    }
}

/// How many steps like this one a law looks ahead along its curve for the stiffness that holds the next one down, which may be longer.
pub(crate) const AHEAD: f64 = 3.0;

/// What a law with history variables keeps of an element, and what it asks of the pressure of this step.
#[derive(Clone, Copy)]
pub(crate) struct Memory<L> {
    /// In the order of [`Strength::history`].
    pub variables: [L; MAX_HISTORY],
    /// Damage, 0 to 1, with which the step begins; after the update, with which the next one begins.
    pub damage: L,
    /// Volume over that of the solid, whose equation of state it is; 1 without pores.
    pub distension: L,
    /// The distension at the start over that now: what takes the relative volume to that of the solid.
    pub stretch: L,
    /// Added to the pressure of the equation of state.
    pub added_pressure: L,
    /// The pressure goes no lower (stress).
    pub least_pressure: L,
    /// Added to the stiffness of waves that the equation of state and [`StrengthLaw::shear`] make (stress).
    pub added_stiffness: L,
    /// What of the whole stiffness no wave meets now, and only the step reckons with (stress).
    pub idle_stiffness: L,
}

impl<L: Lane> Memory<L> {
    /// Of a law that keeps nothing.
    #[inline(always)]
    pub fn none() -> Self {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        Self {
            variables: [zero; MAX_HISTORY],
            damage: zero,
            distension: one,
            stretch: one,
            added_pressure: zero,
            least_pressure: zero,
            added_stiffness: zero,
            idle_stiffness: zero,
        }
    }
}

pub(crate) trait StrengthLaw: Copy {
    /// Whether the law has history variables: then the kernel calls [`StrengthLaw::remember`] in place of
    /// [`StrengthLaw::update`], the damage of the element is the law's, and no failure law stands beside it.
    const REMEMBERS: bool = false;

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

    /// Yield stress and its slope at a plastic strain, with the `factor` of [`StrengthLaw::factor`]: what plane stress returns to. A law
    /// that never yields has none.
    #[inline(always)]
    fn flow<L: Lane>(&self, _strain: L, _factor: L) -> (L, L) {
        (L::splat(f64::MAX), L::splat(0.0))
    }

    /// A stress that the yield stress of [`StrengthLaw::flow`] is not below at any rate, cheap to find; zero if the law knows none. Where no
    /// lane is above it, rate and hardening need not be known.
    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, _temperature: L) -> L {
        L::splat(0.0)
    }

    /// The factor of rate and temperature on the yield stress of [`StrengthLaw::flow`].
    #[inline(always)]
    fn factor<L: Lane>(&self, _rate: L, _temperature: L) -> L {
        L::splat(1.0)
    }

    /// Rise of the temperature by plastic work per volume.
    #[inline(always)]
    fn heating(&self) -> f64 {
        0.0
    }

    /// Kelvin per internal energy per initial volume above the cold curve, where the temperature follows that; else 0.
    #[inline(always)]
    fn heating_by_energy(&self) -> f64 {
        0.0
    }

    /// As [`StrengthLaw::update`], of a law with history variables.
    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        history: &mut History<L>,
        _memory: &mut Memory<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        self.update(trial, around.strain, history, active)
    }

    /// Returns the trial deviator to the yield surface: of a law that never yields, or that does all in [`StrengthLaw::remember`],
    /// the trial. Only lanes in `active` need be right; what the others hold is arbitrary.
    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        _strain: Strain<L>,
        _history: &mut History<L>,
        _active: L::Mask,
    ) -> Deviator<L> {
        trial
    }
}

/// Strength law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Strength {
    /// No shear strength.
    Hydro,
    /// Hypoelastic.
    Elastic {
        /// Shear modulus G (stress).
        shear: f64,
    },
    /// Von Mises yield with linear isotropic hardening: `Y = yield_stress + hardening * plastic strain`.
    VonMises {
        /// Shear modulus G (stress).
        shear: f64,
        /// Initial yield stress.
        yield_stress: f64,
        /// `d Y / d plastic strain`.
        hardening: f64,
        /// Factor for the strain rate.
        rate: Option<CowperSymonds>,
    },
    /// Von Mises yield, the yield stress a line from point to point of the plastic strain and constant beyond.
    Tabulated {
        /// Shear modulus G (stress).
        shear: f64,
        /// Yield stress by plastic strain.
        hardening: Hardening,
        /// Factor for the strain rate.
        rate: Option<CowperSymonds>,
    },
    /// `Y = (A + B e^n)(1 + C ln max(rate/rate0, 1))(1 - T*^m)`, `T* = (T - t_room)/(t_melt - t_room)` clamped
    /// to 0..1 (Johnson and Cook 1983).
    JohnsonCook {
        /// Shear modulus G (stress).
        shear: f64,
        /// A (stress).
        a: f64,
        /// B (stress).
        b: f64,
        /// Hardening exponent n.
        n: f64,
        /// Rate coefficient C.
        c: f64,
        /// Thermal exponent m.
        m: f64,
        /// Melting temperature (K).
        t_melt: f64,
        /// Room temperature (K), also the initial one.
        t_room: f64,
        /// Specific heat (energy per mass per K).
        specific_heat: f64,
        /// Reference strain rate (1/time).
        rate0: f64,
        /// What T follows; shells take plastic work always.
        heat: Heat,
    },
    /// Von Mises yield with saturating hardening.
    Voce(Voce),
    /// Von Mises yield with hardening by a power of the whole strain.
    PowerLaw(PowerLaw),
    /// Johnson and Cook's with saturating hardening and a rate factor that is a power.
    ModifiedJohnsonCook(ModifiedJohnsonCook),
    /// By the motion of dislocations.
    ZerilliArmstrong(ZerilliArmstrong),
    /// Shear modulus and yield stress follow pressure and temperature.
    SteinbergGuinan(SteinbergGuinan),
    /// Ceramics and glass, with damage and bulking.
    JohnsonHolmquist(JohnsonHolmquist),
    /// Ceramics whose strength falls when damage is whole.
    SegmentedCeramic(SegmentedCeramic),
    /// Concrete, with damage and a curve of crushing.
    HolmquistJohnsonCook(HolmquistJohnsonCook),
    /// Concrete, with an elastic, a failure and a residual surface and pores that collapse.
    RiedelHiermaierThoma(RiedelHiermaierThoma),
    /// Composites: orthotropic, with failure of fibres, matrix and layers.
    Orthotropic(Orthotropic),
    /// Layers of composite shells: orthotropic, with four modes of failure.
    ChangChang(ChangChang),
    /// Rubber by the invariants of its stretch.
    MooneyRivlin(MooneyRivlin),
    /// Rubber by its principal stretches.
    Ogden(Ogden),
    /// A shear modulus that relaxes.
    Viscoelastic(Viscoelastic),
    /// Foam that is crushed, with its crush stress by loss of volume.
    CrushableFoam(CrushableFoam, Hardening),
    /// Foam that comes back, with its nominal stress by nominal strain in compression.
    LowDensityFoam(LowDensityFoam, Hardening),
    /// Soil and concrete-like foam, with its pressure by logarithmic compression.
    SoilFoam(SoilFoam, Hardening),
    /// Honeycomb, with its crush stress along its first axis by loss of volume.
    Honeycomb(Honeycomb, Hardening),
}

/// The laws that declare their constants, by their names in [`Strength`]: the one list that declarations go by.
macro_rules! declared_laws {
    ($($law:ident),*; $($curved:ident),* $(,)?) => {
        impl Strength {
            /// The laws that declare their constants.
            pub const DECLARED: &'static [Declaration<Strength>] = &[$(Declaration {
                name: $law::NAME,
                constants: $law::CONSTANTS,
                of: |values| Strength::$law($law::of(values)),
            }),*];

            /// The laws that declare their constants and have a curve beside them.
            pub const CURVED: &'static [Curved<Strength>] = &[$(Curved {
                name: $curved::NAME,
                constants: $curved::CONSTANTS,
                points: $curved::POINTS,
                of: |values, curve| Strength::$curved($curved::of(values), curve),
            }),*];

            /// The name and the constants by key of a law that declares them.
            pub fn declared(&self) -> Option<(&'static str, Vec<(&'static str, f64)>)> {
                match self {
                    $(Strength::$law(law) => Some(($law::NAME, law.constants())),)*
                    $(Strength::$curved(law, _) => Some(($curved::NAME, law.constants())),)*
                    _ => None,
                }
            }

            /// The curve of a law that declares one beside its constants.
            pub fn curve(&self) -> Option<&Hardening> {
                match self {
                    $(Strength::$curved(_, curve) => Some(curve),)*
                    _ => None,
                }
            }

            /// A law that declares a curve with this one; any other law as it is.
            pub fn with_curve(self, curve: Hardening) -> Self {
                match self {
                    $(Strength::$curved(law, _) => Strength::$curved(law, curve),)*
                    other => other,
                }
            }

            /// A law that declares its constants with each as `convert` makes it of its unit and value; any other law as it is.
            pub fn converted(self, convert: &dyn Fn(Unit, f64) -> f64) -> Self {
                match self {
                    $(Strength::$law(law) => Strength::$law(law.converted(convert)),)*
                    $(Strength::$curved(law, mut curve) => {
                        curve.stress = curve.stress.map(|stress| convert(Unit::STRESS, stress));
                        Strength::$curved(law.converted(convert), curve)
                    })*
                    other => other,
                }
            }
        }
    };
}

declared_laws!(
    Voce, PowerLaw, ModifiedJohnsonCook, ZerilliArmstrong, SteinbergGuinan, JohnsonHolmquist, SegmentedCeramic, HolmquistJohnsonCook, RiedelHiermaierThoma, Orthotropic, ChangChang, MooneyRivlin, Ogden, Viscoelastic;
    CrushableFoam, LowDensityFoam, SoilFoam, Honeycomb,
);

impl Strength {
    /// The history variables of the law.
    pub fn history(&self) -> &'static [Variable] {
        match self {
            Strength::JohnsonHolmquist(_) => JohnsonHolmquist::HISTORY,
            Strength::SegmentedCeramic(_) => SegmentedCeramic::HISTORY,
            Strength::HolmquistJohnsonCook(_) => HolmquistJohnsonCook::HISTORY,
            Strength::RiedelHiermaierThoma(_) => RiedelHiermaierThoma::HISTORY,
            Strength::MooneyRivlin(_) => MooneyRivlin::HISTORY,
            Strength::Ogden(_) => Ogden::HISTORY,
            Strength::Viscoelastic(_) => Viscoelastic::HISTORY,
            Strength::CrushableFoam(..) => CrushableFoam::HISTORY,
            Strength::LowDensityFoam(..) => LowDensityFoam::HISTORY,
            Strength::SoilFoam(..) => SoilFoam::HISTORY,
            Strength::Honeycomb(..) => Honeycomb::HISTORY,
            Strength::Orthotropic(_) => Orthotropic::HISTORY,
            _ => &[],
        }
    }

    /// Whether the law damages its elements itself.
    pub fn damages(&self) -> bool {
        use Strength::{
            ChangChang, HolmquistJohnsonCook, JohnsonHolmquist, Orthotropic, RiedelHiermaierThoma,
            SegmentedCeramic,
        };
        matches!(
            self,
            JohnsonHolmquist(_)
                | SegmentedCeramic(_)
                | HolmquistJohnsonCook(_)
                | RiedelHiermaierThoma(_)
                | Orthotropic(_)
                | ChangChang(_)
        )
    }

    /// What the constants would have to be, where each is within its bounds and together they make no law.
    pub fn fault(&self) -> Option<&'static str> {
        match self {
            Strength::ModifiedJohnsonCook(law) => law.fault(),
            Strength::ZerilliArmstrong(law) => law.fault(),
            Strength::SteinbergGuinan(law) => law.fault(),
            Strength::SegmentedCeramic(law) => law.fault(),
            Strength::HolmquistJohnsonCook(law) => law.fault(),
            Strength::RiedelHiermaierThoma(law) => law.fault(),
            Strength::Ogden(law) => law.fault(),
            Strength::Viscoelastic(law) => law.fault(),
            Strength::SoilFoam(law, curve) => law.fault(curve),
            Strength::Orthotropic(law) => law.fault(),
            Strength::ChangChang(law) => law.fault(),
            Strength::Honeycomb(law, _) => law.fault(),
            _ => None,
        }
    }

    /// The layers of shells that are laminates of it; none of laws that are no composites.
    pub fn layers(&self) -> Option<ChangChang> {
        match self {
            Strength::ChangChang(law) => Some(*law),
            Strength::Orthotropic(law) => Some(law.in_layers()),
            _ => None,
        }
    }

    /// The axes a, b and c at the start of a law of solids that has some among its constants.
    pub fn axes(&self) -> Option<[[f64; 3]; 3]> {
        match self {
            Strength::Orthotropic(law) => law.axes(),
            Strength::Honeycomb(law, _) => law.axes(),
            _ => None,
        }
    }

    /// The bulk modulus of a law that makes the pressure itself: the equation of state beside it has this one.
    pub fn bulk(&self) -> Option<f64> {
        match self {
            Strength::HolmquistJohnsonCook(law) => Some(law.bulk()),
            Strength::RiedelHiermaierThoma(law) => Some(law.bulk()),
            Strength::CrushableFoam(law, _) => Some(law.bulk()),
            Strength::LowDensityFoam(law, _) => Some(law.bulk()),
            Strength::SoilFoam(law, _) => Some(law.unloading),
            Strength::Orthotropic(law) => Some(law.bulk()),
            Strength::ChangChang(law) => Some(law.bulk()),
            Strength::Honeycomb(law, _) => Some(law.bulk()),
            _ => None,
        }
    }
}
