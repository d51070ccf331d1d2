//! Concrete after Riedel, Hiermaier and Thoma (RHT): an elastic, a failure and a residual surface that depend on pressure, rate and the third
//! invariant, and a pressure that compacts pores.
//!
//! W. Riedel, K. Thoma, S. Hiermaier, E. Schmolinske, Penetration of reinforced concrete by BETA-B-500, 9th Int. Symp. IEMS (1999) 315; the
//! form of T. Borrvall, W. Riedel, The RHT concrete model in LS-DYNA, 8th European LS-DYNA Users Conf. (2011), in which all surfaces are
//! scaled from one. With f the compressive strength, `P* = p/f`, and `F` the factor of the rate:
//!
//! - *failure surface* `s(P*, F)`: `a (P* - F/3 + (a/F)^(-1/n))^n` where `3 P* >= F`; straight lines below that through `F` at `F/3`, the shear
//!   strength at no pressure and the tensile strength, down to nothing at `P_t`;
//! - *third invariant* `R(angle, Q)` after Willam and Warnke, `Q = q0 + b P*`: 1 where one principal stress is pressed more than two equal
//!   ones, Q where one is pulled;
//! - *rate*: `(rate/rate0)^beta` in compression and in tension, by straight lines between;
//! - *elastic surface*: the failure surface shrunk towards no pressure by a factor that goes with the plastic strain from `elastic_compression` or
//!   `elastic_tension`, times a cap that closes it at the pressure of the pores, to 1. The strain that takes it there is the one that gives a
//!   hardening shear modulus of `hardening` times G;
//! - *damage* by the increments of plastic strain beyond that, over `max(d1 (P* - (1 - D) P_t)^d2, least_strain)`; the strength then goes from the
//!   failure surface to the residual one, `residual_a P*^residual_n`;
//! - *pressure*: `p = (b0 + b1 e) E/v + (a1 e + a2 e^2 + a3 e^3)/alpha` with `e = alpha/(alpha0 v) - 1`, v the relative volume and E the energy by
//!   initial volume; the distension alpha falls from `distension` as `1 + (distension - 1) ((pc - p)/(pc - pe))^pore_exponent` and never grows.
//!   In tension only `b0` and `a1` act. It goes no lower than `(1 - D) P_t f`.
//!
//! Three things differ from the paper: the share of hardening is added up step by step, so it never falls; the strength at the end of a step is
//! taken on the line to the failure surface, since explicit hardening swings where the material is nearly torn; and `P_t` is that of `Q = q0`.

use super::{Around, Deviator, History, Memory, StrengthLaw, principal::greatest_principal};
use crate::{
    lanes::{
        Lane,
        functions::{exp, ln, pow},
        scalar::Scalar,
    },
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law, which makes the whole pressure.
    pub struct RiedelHiermaierThoma = "riedel-hiermaier-thoma" {
        /// G (stress).
        shear: STRESS, Positive;
        /// f (stress): uniaxial compressive strength at rest.
        compressive_strength: STRESS, Positive;
        /// Uniaxial tensile strength over f.
        tension: NONE, Positive;
        /// Strength in shear without pressure over f.
        shear_strength: NONE, Positive;
        /// A, factor of the failure surface.
        a: NONE, Positive;
        /// N, its exponent.
        n: NONE, Positive;
        /// Q0: the tensile over the compressive meridian without pressure.
        q0: NONE, Positive;
        /// B: how Q grows with `P*`.
        b: NONE, NotNegative;
        /// Rate in compression up to which the strength does not depend on it (1/time).
        rate0: RATE, Positive;
        /// The same in tension.
        tension_rate0: RATE, Positive;
        /// Exponent of the rate in compression.
        beta: NONE, NotNegative;
        /// Exponent of the rate in tension.
        tension_beta: NONE, NotNegative;
        /// Elastic limit over the strength in compression.
        elastic_compression: NONE, Fraction;
        /// The same in tension.
        elastic_tension: NONE, Fraction;
        /// Hardening shear modulus over G.
        hardening: NONE, Fraction;
        /// D1: strain to fracture where `P* - P_t` is 1.
        d1: NONE, NotNegative;
        /// D2, its exponent.
        d2: NONE, Positive;
        /// The least strain to fracture.
        least_strain: NONE, Positive;
        /// A of the residual surface.
        residual_a: NONE, NotNegative;
        /// Its exponent.
        residual_n: NONE, Positive;
        /// Distension at the start: density of the material without pores over that of the porous one, above 1.
        distension: NONE, Positive;
        /// Pressure at which pores begin to collapse.
        crush_pressure: STRESS, Positive;
        /// Pressure at which all have collapsed.
        compaction_pressure: STRESS, Positive;
        /// Exponent of the distension.
        pore_exponent: NONE, Positive;
        /// A1 (stress): bulk modulus without pores.
        a1: STRESS, Positive;
        /// A2 (stress).
        a2: STRESS, NotNegative = 0.0;
        /// A3 (stress).
        a3: STRESS, NotNegative = 0.0;
        /// B0, of the energy.
        b0: NONE, NotNegative = 0.0;
        /// B1.
        b1: NONE, NotNegative = 0.0;
    }
}

/// Index of the share of the pores' way that is crushed among the history variables.
const CRUSHED: usize = 0;
/// Index of the share of hardening.
const HARDENED: usize = 1;

/// Steps of Newton towards the pressure of collapsing pores. The function is convex and each starts beyond its root, so they come down to it.
const STEPS: usize = 8;

/// Least factor of the elastic surface: a cap that closes it divides by none.
const LEAST: f64 = 1e-6;

impl RiedelHiermaierThoma {
    /// What the law keeps of an element beside damage and plastic strain.
    pub const HISTORY: &'static [Variable] = &[
        Variable { name: "crushed_pores", unit: Unit::NONE, initial: 0.0 },
        Variable { name: "hardening", unit: Unit::NONE, initial: 0.0 },
    ];

    /// The bulk modulus before pores collapse.
    pub(crate) fn bulk(&self) -> f64 {
        self.a1 / self.distension
    }

    /// `R` at the angle of pure shear and no pressure.
    fn shear_meridian(&self) -> f64 {
        meridian_of(0.75_f64.sqrt(), self.q0)
    }

    /// Slope of the strength by `3 P*` under tension, with its sign turned.
    fn pulled(&self) -> f64 {
        1.0 / self.q0 - self.shear_strength / (self.shear_meridian() * self.tension)
    }

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        if !(0.5 < self.q0 && self.q0 <= 1.0) {
            return Some("a q0 above 0.5 and at most 1");
        }
        if self.distension <= 1.0 || self.compaction_pressure <= self.crush_pressure {
            return Some("a distension above 1, and a compaction_pressure above crush_pressure");
        }
        (self.pulled() >= 0.0).then_some(
            "a shear_strength above the tension that the third invariant takes it to, so that strength falls with tension",
        )
    }
}

/// `R` by the cosine of the angle, in plain numbers.
fn meridian_of(cosine: f64, q: f64) -> f64 {
    let wide = 4.0 * (1.0 - q * q) * cosine * cosine;
    let narrow = 2.0 * q - 1.0;
    let root = (wide + 5.0 * q * q - 4.0 * q).max(0.0).sqrt();
    (2.0 * (1.0 - q * q) * cosine + narrow * root) / (wide + narrow * narrow)
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Concrete {
    law: RiedelHiermaierThoma,
    bulk: f64,
    inverse_strength: f64,
    log_rate0: f64,
    log_tension_rate0: f64,
    /// Shear strength on the compressive meridian: what is left of it at no pressure.
    cohesion: f64,
    /// See [`RiedelHiermaierThoma::pulled`]; below 0.
    pulled: f64,
    inverse_n: f64,
    /// One over the pressure that pores need from first to last.
    span: f64,
}

/// A pressure, what stiffness it follows, and how far pores are crushed.
struct Compacted<L> {
    pressure: L,
    /// `rho dp/drho`.
    stiffness: L,
    crushed: L,
    /// The pressure at which pores collapse on.
    cap: L,
}

/// What the surfaces have at a pressure and a rate, on the compressive meridian.
struct Surfaces<L> {
    /// Von Mises stress at which the material yields, before damage.
    yielding: L,
    /// The elastic limit over the strength.
    elastic: L,
    /// The pressure over f.
    normal: L,
    /// That of the rate.
    factor: L,
    /// The pressure, over f, at which strength under tension vanishes, without damage.
    torn: L,
    /// What strengths are on the tensile meridian, over these.
    q: L,
}

impl Concrete {
    pub fn new(law: &RiedelHiermaierThoma) -> Self {
        Self {
            law: *law,
            bulk: law.bulk(),
            inverse_strength: 1.0 / law.compressive_strength,
            log_rate0: ln(Scalar(law.rate0)).0,
            log_tension_rate0: ln(Scalar(law.tension_rate0)).0,
            cohesion: law.shear_strength / law.shear_meridian(),
            pulled: law.pulled(),
            inverse_n: 1.0 / law.n,
            span: law.compaction_pressure - law.crush_pressure,
        }
    }

    /// Pressure, stiffness and the derivative of the pressure by the distension.
    #[inline(always)]
    fn state<L: Lane>(&self, distension: L, volume: L, energy: L) -> [L; 3] {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let dense = distension / (L::splat(law.distension) * volume);
        let excess = dense - one;
        let pressed = excess.max(zero);
        let (a1, a2, a3) = (L::splat(law.a1), L::splat(law.a2), L::splat(law.a3));
        let cold = excess * pressed.mul_add(pressed.mul_add(a3, a2), a1);
        let slope = pressed.mul_add(pressed.mul_add(L::splat(3.0) * a3, L::splat(2.0) * a2), a1);
        let heat = energy / volume;
        let warm = pressed.mul_add(L::splat(law.b1), L::splat(law.b0)) * heat;
        let inverse = one / distension;
        let by_excess = slope.mul_add(inverse, L::select(zero.less(excess), L::splat(law.b1) * heat, zero));
        let pressure = cold.mul_add(inverse, warm);
        let stiffness = dense.mul_add(by_excess, warm);
        let by_distension = (dense * by_excess - cold * inverse) * inverse;
        [pressure, stiffness, by_distension]
    }

    /// The pressure at a relative volume and energy, after pores were crushed so far.
    #[inline(always)]
    fn compacted<L: Lane>(&self, volume: L, energy: L, crushed: L) -> Compacted<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let (pores, exponent) = (L::splat(law.distension - 1.0), L::splat(law.pore_exponent));
        let (span, first) = (L::splat(self.span), L::splat(law.crush_pressure));
        let mut crushed = crushed;
        // The same whether or not another lane asks for the power.
        let open_at = |crushed: L| {
            if L::any(zero.less(crushed)) {
                L::select(zero.less(crushed), pores * pow(one - crushed, exponent), pores)
            } else {
                pores
            }
        };
        let mut open = open_at(crushed);
        let [mut pressure, mut stiffness, mut by_distension] = self.state(one + open, volume, energy);
        // Above the pressure that collapses pores on.
        let mut beyond = pressure - crushed.mul_add(span, first);
        if L::any(zero.less(beyond)) {
            let mut step = 0;
            while step < STEPS {
                let collapses = zero.less(beyond);
                let by_crushed = exponent * open / (one - crushed).max(L::splat(1e-12));
                let next = (crushed + beyond / by_distension.mul_add(by_crushed, span)).min(one);
                crushed = L::select(collapses, next, crushed);
                open = open_at(crushed);
                [pressure, stiffness, by_distension] = self.state(one + open, volume, energy);
                beyond = pressure - crushed.mul_add(span, first);
                step += 1;
            }
        }
        let cap = crushed.mul_add(span, first);
        // Exactly that where pores collapse, so that the cap closes the elastic surface. Where none are left the solid is pressed further.
        let pressure = L::select(crushed.less(one), pressure.min(cap), pressure);
        Compacted { pressure, stiffness, crushed, cap }
    }

    /// The failure surface on the compressive meridian, over f, at a pressure over f and a factor of the rate.
    #[inline(always)]
    fn failure<L: Lane>(&self, pressure: L, factor: L) -> L {
        let (zero, one, three) = (L::splat(0.0), L::splat(1.0), L::splat(3.0));
        let law = &self.law;
        let triple = three * pressure;
        let cohesion = factor * L::splat(self.cohesion);
        let pressed = triple.mul_add(one - L::splat(self.cohesion), cohesion);
        let pulled = triple.neg_mul_add(L::splat(self.pulled), cohesion).max(zero);
        let straight = L::select(triple.less(zero), pulled, pressed);
        let is_curved = factor.less_equal(triple);
        if !L::any(is_curved) {
            return straight;
        }
        let start = pow(factor * L::splat(1.0 / law.a), L::splat(self.inverse_n));
        let raised = (pressure - factor * L::splat(1.0 / 3.0) + start).max(zero);
        L::select(is_curved, L::splat(law.a) * pow(raised, L::splat(law.n)), straight)
    }

    /// A number that is one where `3 P*` is at least `high`, another where it is at most `-low`, and between both between.
    #[inline(always)]
    fn between<L: Lane>(triple: L, [pressed, high]: [L; 2], [pulled, low]: [L; 2]) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let share = ((high - triple) / (high + low)).max(zero).min(one);
        share.mul_add(pulled - pressed, pressed)
    }

    /// What strengths are over those on the compressive meridian for a deviator of this von Mises stress: from `q` to 1.
    #[inline(always)]
    fn meridian<L: Lane>(trial: &Deviator<L>, sigma: L, q: L) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        // The cosine of the angle by the greatest principal stress: s1 = 2/3 sigma cos.
        let greatest = greatest_principal(trial);
        let cosine = L::splat(1.5) * greatest / sigma.max(L::splat(1e-300));
        let cosine = cosine.max(L::splat(0.5)).min(one);
        let square = L::splat(4.0) * q.neg_mul_add(q, one);
        let wide = square * cosine * cosine;
        let narrow = L::splat(2.0) * q - one;
        let root = q.mul_add(L::splat(5.0) * q - L::splat(4.0), wide).max(zero).sqrt();
        let across = (L::splat(0.5) * square).mul_add(cosine, narrow * root);
        let meridian = across / narrow.mul_add(narrow, wide).max(L::splat(1e-12));
        L::select(wide.less(L::splat(1e-12)), one, meridian)
    }

    /// The surfaces at a pressure and that of the pores.
    #[inline(always)]
    fn surfaces<L: Lane>(&self, (pressure, cap): (L, L), rate: L, hardened: L) -> Surfaces<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let normal = pressure * L::splat(self.inverse_strength);
        let triple = L::splat(3.0) * normal;
        let log = ln(rate.max(L::splat(1e-300)));
        let raised = |log0: f64, beta: f64| exp(L::splat(beta) * (log - L::splat(log0)).max(zero));
        let fast = raised(self.log_rate0, law.beta);
        let fast_pulled = raised(self.log_tension_rate0, law.tension_beta);
        let torn_at = fast_pulled * L::splat(law.tension);
        let factor = Self::between(triple, [fast, fast], [fast_pulled, torn_at]);
        let q = normal.mul_add(L::splat(law.b), L::splat(law.q0)).max(L::splat(0.5)).min(one);
        let (gc, gt) = (L::splat(law.elastic_compression), L::splat(law.elastic_tension));
        let elastic = Self::between(triple, [gc, fast * gc], [gt, torn_at * gt]);
        let closed = cap * L::splat(self.inverse_strength);
        let opens = fast * gc * L::splat(1.0 / 3.0);
        let way = ((normal - opens) / (closed - opens).max(L::splat(LEAST))).max(zero).min(one);
        let elastic = elastic * way.neg_mul_add(way, one).max(zero).sqrt();
        let shrunk = hardened.neg_mul_add(elastic, elastic + hardened).max(L::splat(LEAST));
        let f = L::splat(law.compressive_strength);
        let yielding = f * shrunk * self.failure(normal / shrunk, factor);
        let torn = fast_pulled * L::splat(self.cohesion / (3.0 * self.pulled));
        Surfaces { yielding, elastic, normal, factor, torn, q }
    }
}

impl StrengthLaw for Concrete {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        history: &mut History<L>,
        memory: &mut Memory<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let damage = memory.damage;
        let Around { relative_volume, relative_volume_before, pressure_before, .. } = *around;
        // The energy of the end as far as the pressure before the step changes it.
        let energy = pressure_before.neg_mul_add(relative_volume - relative_volume_before, around.energy);
        let compacted = self.compacted(relative_volume, energy, memory.variables[CRUSHED]);
        memory.variables[CRUSHED] = compacted.crushed;

        let sigma = trial.mises_square().sqrt();
        let hardened = memory.variables[HARDENED];
        let whole = one - damage;
        let at = (compacted.pressure, compacted.cap);
        let surfaces = self.surfaces(at, around.strain.rate, hardened);
        memory.least_pressure = whole * surfaces.torn * L::splat(law.compressive_strength);
        let pressure = compacted.pressure.max(memory.least_pressure);
        memory.added_pressure = pressure - around.pressure;
        memory.added_stiffness = (compacted.stiffness - L::splat(self.bulk)).max(zero);

        let f = L::splat(law.compressive_strength);
        let mut residual = zero;
        if L::any(zero.less(damage)) {
            let pressed = surfaces.normal.max(zero);
            residual = damage * f * L::splat(law.residual_a) * pow(pressed, L::splat(law.residual_n));
        }
        // No meridian is below the tensile one.
        let least = (whole * surfaces.q).mul_add(surfaces.yielding, residual);
        if !L::any(L::both(least.less(sigma), active)) {
            return trial;
        }
        let meridian = Self::meridian(&trial, sigma, surfaces.q);
        let whole_strength = whole * meridian;
        let strength = whole_strength.mul_add(surfaces.yielding, residual);
        let yields = strength.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        // On the way to the failure surface the strength rises with the slip of this very step; from there on it stays in it.
        let failing = f * self.failure(surfaces.normal, surfaces.factor);
        let strain = (one - surfaces.elastic) * L::splat(1.0 / (3.0 * law.hardening * law.shear));
        let to_failure = (failing * strain * meridian).max(L::splat(1e-12));
        let left = (one - hardened) * to_failure;
        let rise = meridian * (failing - surfaces.yielding).max(zero) / left.max(L::splat(1e-30));
        let stiffness = L::splat(3.0 * law.shear);
        let rising = (sigma - strength) / (stiffness + rise);
        let beyond = (sigma - whole_strength.mul_add(failing, residual)) / stiffness;
        let slip = L::select(yields, L::select(rising.less(left), rising, beyond.max(left)), zero);
        history.plastic_strain = history.plastic_strain + slip;
        let hardening = slip.min(left);
        memory.variables[HARDENED] = (hardened + hardening / to_failure).min(one);
        let normal = pressure * L::splat(self.inverse_strength);
        let raised = whole.neg_mul_add(surfaces.torn, normal).max(zero);
        let to_fracture = (L::splat(law.d1) * pow(raised, L::splat(law.d2))).max(L::splat(law.least_strain));
        memory.damage = (damage + (slip - hardening) / to_fracture).min(one);
        trial.scaled(L::select(yields, stiffness.neg_mul_add(slip, sigma) / sigma, one))
    }
}

#[cfg(test)]
mod tests;
