//! Hourglass control of the eight-node hexahedron, orthogonal to linear fields.
//!
//! The four modes of the velocity that a linear field cannot have are `q = v_m - L x_m` for
//! m = eta zeta, xi zeta, xi eta, xi eta zeta, with the velocity gradient L and the modes x_m of the mid-step
//! geometry. Each is resisted by a force amplitude `p_m` on its pattern, made orthogonal to linear fields at the end of the step:
//! `f_I = -sum_m [Gamma_mI - (8/V) x_m . B_I] p_m`. Its second part acts like a
//! stress `-(8/V) sum_m p_m x_m^T` (not symmetric), and is given to the element as that, so that the forces have
//! neither resultant nor moment. The power taken from the nodes is `8 sum_m p_m . q_m`.
//!
//! - Viscous (Flanagan and Belytschko 1981): `p = c q`, `c = 2 Q rho c_sound V / L_v`, less in bent elements: see [`bounded`].
//! - Stiffness (the same): `dp = k q dt`, `k = Q (K + 4G/3) V / (2 L_v^2)`, so that with Q = 1 the modes of a cube are as fast as
//!   its fastest strain.
//! - Assumed strain (Belytschko and Bindeman 1993, their ASQBI element for three dimensions): `p` grows as the elastic stress of those
//!   strains that the modes have in a bent or twisted bar, without those that lock it. With Q = 1 a bar of one layer bends as a beam does.
//!
//! The forces of the last two are a state of the element, vectors that turn with it. They yield with it, too: what a radial return
//! leaves of its stress, it leaves of them, and they do not pass the moment at which a bar of the yield stress is plastic throughout. Beside them acts
//! [`DAMPING`] of viscous control. A failed element keeps nothing of them. Nothing but its pressure is left, so its modes move as those of a fluid do: what resists them is viscous, with
//! [`FAILED`] of the coefficient of a fluid. With viscous control it keeps what a whole element has.

use serde::{Deserialize, Serialize};

use super::{
    vector::{Tensor, Vector},
    viscosity::Spread,
};
use crate::{
    lanes::{Lane, scalar::Scalar},
    material::{Failure, Material},
    strength::{AnyStrength, StrengthLaw},
};

/// Number of arrays that the state of elastic control has: the components of `p_m`, mode by mode.
pub const N_FORCES: usize = 12;

/// Viscous coefficient of elements that have no shear stiffness or have lost it.
const FLUID: f64 = 0.1;

/// Viscous coefficient beside elastic forces. How these grow depends on the shape of the element, which swings too, so the work that they do
/// on a closed path need not vanish: a single free element of steel that shook at 30 m/s gained half of its energy in 11,000 cycles. Three thousandths
/// of the usual viscous control take some five times as much, and hardly anything from motions that are slow beside the mesh.
const DAMPING: f64 = 3e-4;

/// Share of the viscous coefficient of a fluid that resists an element which has failed, with elastic control. With all of it a sphere that
/// breaks at 3 or 6 km/s gave more energy to hourglass control than to heat; a ten-thousandth of the wave impedance and less is what other
/// codes give fluids.
const FAILED: f64 = 3e-4;

/// What resists the hourglass modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// In proportion to their rate.
    Viscous,
    /// In proportion to what they come to, by a share of the stiffness of the element.
    Stiffness,
    /// By the stresses of assumed strains.
    AssumedStrain,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Viscous, Self::Stiffness, Self::AssumedStrain];

    /// Its word in a deck.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Viscous => "viscous",
            Self::Stiffness => "stiffness",
            Self::AssumedStrain => "assumed-strain",
        }
    }

    /// The coefficient where none is given.
    pub const fn usual(self) -> f64 {
        match self {
            Self::Viscous => 0.1,
            Self::Stiffness => 0.05,
            Self::AssumedStrain => 1.0,
        }
    }
}

/// Hourglass control of the hexahedra of a part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hourglass {
    pub kind: Kind,
    /// Q.
    pub coefficient: f64,
}

impl Default for Hourglass {
    fn default() -> Self {
        Self::ASSUMED_STRAIN
    }
}

impl Hourglass {
    /// No control.
    pub const NONE: Self = Self::viscous(0.0);
    /// Viscous control with its usual coefficient.
    pub const VISCOUS: Self = Self::viscous(Kind::Viscous.usual());
    /// Assumed strains with their usual coefficient: the default.
    pub const ASSUMED_STRAIN: Self =
        Self { kind: Kind::AssumedStrain, coefficient: Kind::AssumedStrain.usual() };

    pub const fn viscous(coefficient: f64) -> Self {
        Self { kind: Kind::Viscous, coefficient }
    }

    /// Whether elements keep forces of it as a state.
    pub fn is_elastic(&self) -> bool {
        self.kind != Kind::Viscous
    }

    /// That of a part of this material. Without shear stiffness nothing is elastic: the viscous default stands in for it.
    #[must_use]
    pub fn on(self, material: &Material) -> Self {
        if material.shear() > 0.0 || !self.is_elastic() { self } else { Self::viscous(FLUID) }
    }

    /// The greatest coefficient of what resists in proportion to the rate.
    pub fn damping(&self) -> f64 {
        if self.is_elastic() { FLUID } else { self.coefficient }
    }

    /// The viscous coefficient of a whole element.
    pub(crate) fn of_whole(&self) -> f64 {
        if self.is_elastic() { DAMPING } else { self.coefficient }
    }

    /// The viscous coefficient of an element of this material that has failed. A law that keeps strength at full damage keeps its
    /// elements' resistance, too.
    pub(crate) fn of_failed(&self, material: &Material) -> f64 {
        let share = if self.is_elastic() && material.failure != Failure::None { FAILED } else { 1.0 };
        share * self.damping()
    }
}

/// Constants of hourglass control, made ready for a material.
#[derive(Clone, Copy)]
pub(crate) struct Resistance {
    /// Whether elements keep forces of it.
    pub elastic: bool,
    /// Viscous coefficient.
    pub viscous: f64,
    /// The same where an element has failed.
    pub failed: f64,
    /// Of stiffness.
    pub stiffness: f64,
    /// Whether strains are assumed, and not the stiffness.
    pub assumes_strain: bool,
    /// `Q 2 G / (1 - nu) / 3` (stress): of bending.
    pub bending: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// `Q G / 3` (stress): of twisting.
    pub twisting: f64,
    /// `Q E / 9` (stress): of the fourth mode.
    pub fourth: f64,
    /// Squared stress of the forces up to which none yields: [`PLASTIC`] times the least yield stress.
    pub sound: f64,
}

impl Resistance {
    pub fn of(control: Hourglass, material: &Material) -> Self {
        let Hourglass { kind, coefficient } = control;
        let (bulk, shear) = (material.bulk(), material.shear());
        let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
        let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
        Self {
            elastic: control.is_elastic(),
            viscous: control.of_whole(),
            failed: control.of_failed(material),
            stiffness: coefficient,
            assumes_strain: kind == Kind::AssumedStrain,
            bending: coefficient * 2.0 * shear / (3.0 * (1.0 - poisson)),
            poisson,
            twisting: coefficient * shear / 3.0,
            fourth: coefficient * young / 9.0,
            sound: (PLASTIC * least_yield(material)).powi(2),
        }
    }

    /// Of an element whose stress at its points resists all its motions, and part of which yields with the stress.
    pub fn of_points(material: &Material) -> Self {
        Self { elastic: true, ..Self::of_failed_alone(material) }
    }

    /// Of an element whose stress at eight points resists its modes, until it fails.
    pub fn of_failed_alone(material: &Material) -> Self {
        Self { failed: FAILED * FLUID, ..Self::of(Hourglass::NONE, material) }
    }
}

/// Stress at the surface of an elastic bar over the yield stress, where its section is plastic throughout.
pub(crate) const PLASTIC: f64 = 1.5;

/// Yield stress before any strain, at no rate and at the initial temperature; of a law that heat softens, a tenth of that.
fn least_yield(material: &Material) -> f64 {
    let law = AnyStrength::of(material);
    let factor = law.factor(Scalar(f64::MIN_POSITIVE), Scalar(material.initial_temperature()));
    let softened = if law.thermal() { 0.1 } else { 1.0 };
    softened * law.flow(Scalar(LEAST_STRAIN), factor).0.0
}

/// The strain at which the yield stress is taken where there is none: its slope may be infinite at zero.
pub(crate) const LEAST_STRAIN: f64 = 1e-16;

/// One vector for each of the four modes: amplitudes of the velocity, eight times as large as q, as the modes are, or forces.
#[derive(Clone, Copy)]
pub(crate) struct Amplitudes<L> {
    pub d: Vector<L>,
    pub e: Vector<L>,
    pub f: Vector<L>,
    pub g: Vector<L>,
}

/// `v - L x`.
#[inline(always)]
pub(crate) fn amplitude<L: Lane>(v: &Vector<L>, gradient: &Tensor<L>, x: &Vector<L>) -> Vector<L> {
    let linear = gradient.apply(x);
    Vector { x: v.x - linear.x, y: v.y - linear.y, z: v.z - linear.z }
}

impl<L: Lane> Amplitudes<L> {
    /// From components, mode by mode.
    #[inline(always)]
    pub fn from_array([dx, dy, dz, ex, ey, ez, fx, fy, fz, gx, gy, gz]: [L; N_FORCES]) -> Self {
        Self {
            d: Vector { x: dx, y: dy, z: dz },
            e: Vector { x: ex, y: ey, z: ez },
            f: Vector { x: fx, y: fy, z: fz },
            g: Vector { x: gx, y: gy, z: gz },
        }
    }

    #[inline(always)]
    pub fn to_array(self) -> [L; N_FORCES] {
        let Self { d, e, f, g } = self;
        [d.x, d.y, d.z, e.x, e.y, e.z, f.x, f.y, f.z, g.x, g.y, g.z]
    }

    /// Sum of the squares; of amplitudes `64 q . q`.
    #[inline(always)]
    pub fn square(&self) -> L {
        self.dot(self)
    }

    /// Sum of the products.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> L {
        self.d.dot(&other.d) + self.e.dot(&other.e) + (self.f.dot(&other.f) + self.g.dot(&other.g))
    }

    /// `self * factor`.
    #[inline(always)]
    pub fn scaled(&self, factor: L) -> Self {
        Self {
            d: self.d.scaled(factor),
            e: self.e.scaled(factor),
            f: self.f.scaled(factor),
            g: self.g.scaled(factor),
        }
    }

    /// `self * factor + other`.
    #[inline(always)]
    pub fn mul_add(&self, factor: L, other: &Self) -> Self {
        Self {
            d: self.d.mul_add(factor, &other.d),
            e: self.e.mul_add(factor, &other.e),
            f: self.f.mul_add(factor, &other.f),
            g: self.g.mul_add(factor, &other.g),
        }
    }

    /// Each vector turned by `rotation`.
    #[inline(always)]
    pub fn turned(&self, rotation: &Tensor<L>) -> Self {
        Self {
            d: rotation.apply(&self.d),
            e: rotation.apply(&self.e),
            f: rotation.apply(&self.f),
            g: rotation.apply(&self.g),
        }
    }

    /// `sum_m p_m x_m^T` for the modes x_m at the end of the step; of amplitudes `64 sum_m q_m x_m^T`.
    #[inline(always)]
    pub fn against(&self, d: &Vector<L>, e: &Vector<L>, f: &Vector<L>, g: &Vector<L>) -> Tensor<L> {
        Tensor::outer(&self.d, d).outer_add(&self.e, e).outer_add(&self.f, f).outer_add(&self.g, g)
    }
}

/// The scale of [`bounded`] for `512 S` and modes that are plain sums over eight corners, whose patterns are as long as the root of 8.
pub(crate) const OF_SUMS: f64 = 1.0 / 4096.0;

/// The coefficient of viscous control that an element has where its part has this one, both twice as large. Forces reach the nodes by the
/// patterns h_m of the modes (here of length 1) less what of these is linear, `h_m - x_m . B / V`, with the modes x_m of the corners.
/// `e = sum_m x_m . S x_m / V^2` is the square of that second part: nothing in a parallelepiped, little in a usual mesh, and thousands in an
/// element that is squashed and bent. So many times as fast would the control damp its nodes, which beyond a step drives them:
/// `Q / (1 + Q e / 0.1)` keeps the rate below that of a cube with Q = 0.1. `scale` takes S and the modes to the units of `V^2`.
#[inline(always)]
pub(crate) fn bounded<L: Lane, const N: usize>(
    twice_coefficient: L,
    modes: [&Vector<L>; N],
    spread: &Spread<L>,
    inverse_volume: L,
    scale: f64,
) -> L {
    let one = L::splat(1.0);
    let longer = Spread::gram(modes).contract(spread) * inverse_volume * inverse_volume;
    twice_coefficient / (L::splat(0.5 * scale / FLUID) * twice_coefficient).mul_add(longer, one)
}

/// The geometry of an element that elastic forces grow by.
pub(crate) struct Frame<'a, L> {
    /// The modes along xi, eta and zeta at the middle of the step, eight times as large.
    pub axes: [&'a Vector<L>; 3],
    /// At the middle of the step.
    pub volume: L,
    /// `(K + 4G/3) V / L_v^2`.
    pub stiffness: L,
}

/// The squared stress at the surface that bending and twisting by these forces make: `sum (12 p_m . g_i / V)^2`, with `g_i` the natural
/// axes.
#[inline(always)]
pub(crate) fn stress_square<L: Lane>(p: &Amplitudes<L>, frame: &Frame<'_, L>) -> L {
    let mut sum = L::splat(0.0);
    let mut axis = 0;
    while axis < 3 {
        let along = frame.axes[axis];
        let (d, e, f, g) = (along.dot(&p.d), along.dot(&p.e), along.dot(&p.f), along.dot(&p.g));
        sum = d.mul_add(d, e.mul_add(e, f.mul_add(f, g.mul_add(g, sum))));
        axis += 1;
    }
    let scale = L::splat(3.0) / frame.volume;
    sum * scale * scale
}

/// What the forces of elastic control grow by in a step, for the amplitudes `q`, eight times as large.
#[inline(always)]
pub(crate) fn growth<L: Lane>(
    resistance: &Resistance,
    q: &Amplitudes<L>,
    frame: &Frame<'_, L>,
    dt: f64,
) -> Amplitudes<L> {
    if resistance.assumes_strain {
        assumed(resistance, q, frame, dt)
    } else {
        q.scaled(L::splat(resistance.stiffness * dt / 16.0) * frame.stiffness)
    }
}

/// The stresses of assumed strains on the modes. Along the natural axes `g_i`, of length `l_i`, the mode of axis j has the component
/// `r_ij = g_i . q_j / l_i`. With `H_ij = 4 V / (3 l_i l_j)`, twice the work of the modes per time is
/// `sum over i != j of 2G/(1 - nu) (H_ii r_ij^2 + nu H_ij r_ij r_ji)`, which bends,
/// `+ sum over i < j of G (4V/3) (r_ii / l_j + r_jj / l_i)^2`, which twists, `+ sum E H_ii r_i4^2 / 3`. The axes need not be
/// orthogonal, and no choice of one before another enters.
#[inline(always)]
fn assumed<L: Lane>(
    resistance: &Resistance,
    q: &Amplitudes<L>,
    frame: &Frame<'_, L>,
    dt: f64,
) -> Amplitudes<L> {
    let [a, b, c] = frame.axes;
    // Inverse squares of the lengths, by one division.
    let (a2, b2, c2) = (a.dot(a), b.dot(b), c.dot(c));
    let (ab, bc, ca) = (a2 * b2, b2 * c2, c2 * a2);
    let inverse = L::splat(1.0) / (ab * c2);
    let (sa, sb, sc) = (bc * inverse, ca * inverse, ab * inverse);
    let volume = frame.volume * L::splat(dt);
    let (bending, poisson) = (L::splat(resistance.bending) * volume, L::splat(resistance.poisson));
    let twisting = L::splat(resistance.twisting) * volume;
    let fourth = L::splat(resistance.fourth) * volume;
    // Twisting: the component of each mode along its own axis.
    let (ta, tb, tc) = (sa * a.dot(&q.d), sb * b.dot(&q.e), sc * c.dot(&q.f));
    let twist_a = twisting * sa * ((sb + sc).mul_add(a.dot(&q.d), tb + tc));
    let twist_b = twisting * sb * ((sc + sa).mul_add(b.dot(&q.e), tc + ta));
    let twist_c = twisting * sc * ((sa + sb).mul_add(c.dot(&q.f), ta + tb));
    // Bending: the component along i of the mode of axis j, and that along j of the mode of axis i.
    let (ba, ab) = (sb * b.dot(&q.d), sa * a.dot(&q.e));
    let (cb, bc) = (sc * c.dot(&q.e), sb * b.dot(&q.f));
    let (ac, ca) = (sa * a.dot(&q.f), sc * c.dot(&q.d));
    let (bend_a, bend_b, bend_c) = (bending * sa, bending * sb, bending * sc);
    let (bend_ba, bend_ab) = (bend_b * poisson.mul_add(ab, ba), bend_a * poisson.mul_add(ba, ab));
    let (bend_cb, bend_bc) = (bend_c * poisson.mul_add(bc, cb), bend_b * poisson.mul_add(cb, bc));
    let (bend_ac, bend_ca) = (bend_a * poisson.mul_add(ca, ac), bend_c * poisson.mul_add(ac, ca));
    let (fa, fb, fc) = (sa * a.dot(&q.g), sb * b.dot(&q.g), sc * c.dot(&q.g));
    let along = [a, b, c];
    Amplitudes {
        d: combined(along, [twist_a, bend_ba, bend_ca]),
        e: combined(along, [bend_ab, twist_b, bend_cb]),
        f: combined(along, [bend_ac, bend_bc, twist_c]),
        g: combined(along, [fourth * sa * fa, fourth * sb * fb, fourth * sc * fc]),
    }
}

/// The sum of the axes times these factors.
#[inline(always)]
fn combined<L: Lane>([a, b, c]: [&Vector<L>; 3], [along_a, along_b, along_c]: [L; 3]) -> Vector<L> {
    a.mul_add(along_a, &b.mul_add(along_b, &c.scaled(along_c)))
}
