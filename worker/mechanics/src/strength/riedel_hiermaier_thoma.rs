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
    /// # Panics
    /// Never: a law with a [`RiedelHiermaierThoma::fault`] makes no sense, but no harm.
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
        let mut open = pores;
        if L::any(zero.less(crushed)) {
            open = L::select(zero.less(crushed), pores * pow(one - crushed, exponent), pores);
        }
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
                open = pores * pow(one - crushed, exponent);
                [pressure, stiffness, by_distension] = self.state(one + open, volume, energy);
                beyond = pressure - crushed.mul_add(span, first);
                step += 1;
            }
        }
        let cap = crushed.mul_add(span, first);
        // Exactly that where pores collapse, so that the cap closes the elastic surface.
        Compacted { pressure: pressure.min(cap), stiffness, crushed, cap }
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
mod tests {
    use super::{super::finite_strain::tests::Cube, *};
    use crate::{material::Strength, state::field};

    /// Concrete of 35 MPa.
    pub const LAW: RiedelHiermaierThoma = RiedelHiermaierThoma {
        shear: 16.7e9,
        compressive_strength: 35e6,
        tension: 0.1,
        shear_strength: 0.18,
        a: 1.6,
        n: 0.61,
        q0: 0.6805,
        b: 0.0105,
        rate0: 3e-5,
        tension_rate0: 3e-6,
        beta: 0.032,
        tension_beta: 0.036,
        elastic_compression: 0.53,
        elastic_tension: 0.7,
        hardening: 0.5,
        d1: 0.04,
        d2: 1.0,
        least_strain: 0.01,
        residual_a: 1.6,
        residual_n: 0.61,
        distension: 1.1884,
        crush_pressure: 23.3e6,
        compaction_pressure: 6e9,
        pore_exponent: 3.0,
        a1: 35.27e9,
        a2: 39.58e9,
        a3: 9.04e9,
        b0: 1.22,
        b1: 1.22,
    };
    const DT: f64 = 1e-7;

    /// The published equations, written out in plain numbers for a motion that keeps its axes: the angle by its cosine of three times it, the
    /// distension by halves of an interval.
    #[derive(Default, Debug)]
    struct Published {
        deviator: [f64; 3],
        pressure: f64,
        strain: f64,
        damage: f64,
        crushed: f64,
        hardened: f64,
    }

    fn pressure_at(distension: f64, volume: f64, energy: f64) -> f64 {
        let eta = distension / (1.1884 * volume) - 1.0;
        if eta > 0.0 {
            (1.22 + 1.22 * eta) * energy / volume
                + eta * (35.27e9 + eta * (39.58e9 + eta * 9.04e9)) / distension
        } else {
            1.22 * energy / volume + 35.27e9 * eta / distension
        }
    }

    fn meridian(angle: f64, q: f64) -> f64 {
        let (c, w) = (angle.cos(), 1.0 - q * q);
        (2.0 * w * c + (2.0 * q - 1.0) * (4.0 * w * c * c + 5.0 * q * q - 4.0 * q).sqrt())
            / (4.0 * w * c * c + (1.0 - 2.0 * q).powi(2))
    }

    fn failure(p: f64, f: f64) -> f64 {
        let q1 = meridian(std::f64::consts::PI / 6.0, 0.6805);
        if 3.0 * p >= f {
            1.6 * (p - f / 3.0 + (1.6 / f).powf(-1.0 / 0.61)).powf(0.61)
        } else if p >= 0.0 {
            f * 0.18 / q1 + 3.0 * p * (1.0 - 0.18 / q1)
        } else {
            (f * 0.18 / q1 - 3.0 * p * (1.0 / 0.6805 - 0.18 / (q1 * 0.1))).max(0.0)
        }
    }

    impl Published {
        /// From one length of each axis to the next; `energy` is that by initial volume as the pressure is to see it.
        fn step(&mut self, before: [f64; 3], after: [f64; 3], energy: f64) {
            let rate = [0, 1, 2].map(|i| (after[i] - before[i]) / DT / (0.5 * (after[i] + before[i])));
            let third = rate.iter().sum::<f64>() / 3.0;
            let effective = (2.0 / 3.0 * rate.iter().map(|r| (r - third) * (r - third)).sum::<f64>()).sqrt();
            let volume = after.iter().product::<f64>();
            // Pores collapse where the pressure is above theirs.
            let top = |crushed: f64| 23.3e6 + (6e9 - 23.3e6) * crushed;
            let open = |crushed: f64| 1.0 + 0.1884 * (1.0 - crushed).powi(3);
            if pressure_at(open(self.crushed), volume, energy) > top(self.crushed) {
                let mut above = 1.0;
                for _ in 0..200 {
                    let middle = 0.5 * (self.crushed + above);
                    let collapses = pressure_at(open(middle), volume, energy) > top(middle);
                    if collapses { self.crushed = middle } else { above = middle }
                }
            }
            let whole = pressure_at(open(self.crushed), volume, energy).min(top(self.crushed));
            let cap = top(self.crushed) / 35e6;

            for i in 0..3 {
                self.deviator[i] += 2.0 * LAW.shear * (rate[i] - third) * DT;
            }
            let sigma = (1.5 * self.deviator.iter().map(|s| s * s).sum::<f64>()).sqrt();
            let [x, y, z] = self.deviator;
            let cosine = if sigma > 0.0 { 13.5 * x * y * z / sigma.powi(3) } else { -1.0 };
            let angle = cosine.clamp(-1.0, 1.0).acos() / 3.0;

            let p = whole / 35e6;
            let fc = (effective / 3e-5).max(1.0).powf(0.032);
            let ft = (effective / 3e-6).max(1.0).powf(0.036);
            let by_pressure = |pressed: f64, high: f64, pulled: f64, low: f64| {
                if 3.0 * p >= high {
                    pressed
                } else if 3.0 * p <= -low {
                    pulled
                } else {
                    pressed - (3.0 * p - high) / (high + low) * (pulled - pressed)
                }
            };
            let f = by_pressure(fc, fc, ft, ft * 0.1);
            let r = meridian(angle, (0.6805 + 0.0105 * p).clamp(0.5, 1.0));
            let fe = by_pressure(0.53, fc * 0.53, 0.7, ft * 0.1 * 0.7);
            let opens = fc * 0.53 / 3.0;
            let way = ((p - opens) / (cap - opens)).clamp(0.0, 1.0);
            let fe = fe * (1.0 - way * way).sqrt();
            let gamma = (self.hardened + (1.0 - self.hardened) * fe).max(1e-6);
            let yielding = 35e6 * gamma * failure(p / gamma, f) * r;
            let to_failure = (35e6 * failure(p, f) * r * (1.0 - fe) / (3.0 * 0.5 * 16.7e9)).max(1e-12);
            let q1 = meridian(std::f64::consts::PI / 6.0, 0.6805);
            let torn = ft * 0.6805 * 0.18 * 0.1 / (3.0 * (q1 * 0.1 - 0.6805 * 0.18));
            self.pressure = whole.max((1.0 - self.damage) * torn * 35e6);
            let residual = self.damage * 35e6 * 1.6 * p.max(0.0).powf(0.61);
            let damaged = |strength: f64| (1.0 - self.damage) * strength + residual;
            if sigma <= damaged(yielding) {
                return;
            }
            // The strength at the end of the step, by a straight line to the failure surface.
            let failing = 35e6 * failure(p, f) * r;
            let left = (1.0 - self.hardened) * to_failure;
            let rise = if left > 0.0 { (failing - yielding).max(0.0) / left } else { 0.0 };
            let rising = (sigma - damaged(yielding)) / (3.0 * LAW.shear + rise);
            let slip = if rising < left {
                rising
            } else {
                ((sigma - damaged(failing)) / (3.0 * LAW.shear)).max(left)
            };
            self.deviator = self.deviator.map(|s| s * (1.0 - 3.0 * LAW.shear * slip / sigma));
            self.strain += slip;
            let hardening = slip.min(left);
            self.hardened = (self.hardened + hardening / to_failure).min(1.0);
            let above = (self.pressure / 35e6 - (1.0 - self.damage) * torn).max(0.0);
            self.damage = (self.damage + (slip - hardening) / (0.04 * above).max(0.01)).min(1.0);
        }
    }

    fn stretched([x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
        [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
    }

    /// Through points of three lengths, in steps of the same number each: every step against the equations.
    fn follow(points: &[[f64; 3]], steps: u32) -> (Cube, Published) {
        let strength = Strength::RiedelHiermaierThoma(LAW);
        let (mut cube, mut published) = (Cube::of(strength, LAW.bulk()), Published::default());
        let mut last = [1.0; 3];
        for (leg, point) in points.iter().enumerate() {
            let start = last;
            for n in 1..=steps {
                let share = f64::from(n) / f64::from(steps);
                let next = [0, 1, 2].map(|i| start[i] + (point[i] - start[i]) * share);
                let before = cube.block.reading(0);
                let grown = next.iter().product::<f64>() - last.iter().product::<f64>();
                let energy = before[field::ENERGY] - before[field::PRESSURE] * grown;
                cube.step_to(&stretched(next), DT);
                published.step(last, next, energy);
                last = next;
                let s = cube.block.reading(0);
                let history = cube.history();
                // Where pores collapse the cap has closed the elastic surface to the root of a rounding.
                for (found, wanted, scale) in [
                    (s[field::PRESSURE], published.pressure, 1e9),
                    (s[field::SXX], published.deviator[0], 1e8),
                    (s[field::SYY], published.deviator[1], 1e8),
                    (s[field::PLASTIC_STRAIN], published.strain, 0.01),
                    (s[field::DAMAGE], published.damage, 1.0),
                    (history[CRUSHED], published.crushed, 0.1),
                    (history[HARDENED], published.hardened, 1.0),
                ] {
                    assert!(
                        (found - wanted).abs() <= 1e-6 * scale,
                        "leg {leg}, step {n}: {found} for {wanted}, {published:?}"
                    );
                }
            }
        }
        (cube, published)
    }

    #[test]
    fn uniaxial_strain_follows_the_published_equations_there_and_back() {
        // Elastic, pores crushed in part, unloaded, crushed whole, unloaded until it is torn.
        let lengths = [0.9995, 0.93, 0.95, 0.72, 0.90];
        let (_, published) = follow(&lengths.map(|x| [x, 1.0, 1.0]), 4000);
        assert!(published.crushed == 1.0 && published.damage == 1.0, "{published:?}");
        assert_eq!(published.pressure, 0.0);
    }

    #[test]
    fn shear_under_pressure_and_tension_follow_the_published_equations() {
        let (_, published) = follow(&[[0.995; 3], [0.84, 1.08, 1.08]], 4000);
        assert!(published.damage == 1.0 && published.hardened == 1.0, "{published:?}");
        // Below the pressure that collapsed pores: on the cap itself the elastic surface would be the root of a rounding.
        let (_, sheared) = follow(&[[0.999; 3], [0.9995; 3], [0.972, 0.9995, 1.027]], 4000);
        assert!(sheared.damage > 0.1, "{sheared:?}");
        let (_, pulled) = follow(&[[1.0002, 1.0, 1.0], [1.02, 1.0, 1.0]], 2000);
        assert!(pulled.damage > 0.9 && pulled.crushed == 0.0, "{pulled:?}");
    }

    /// The four points that the failure surface is drawn through: uniaxial compression, shear, uniaxial tension, and nothing beyond.
    #[test]
    fn surface_goes_through_the_strengths_that_are_given() {
        let law = Concrete::new(&LAW);
        let at = |stress: [f64; 3]| {
            let pressure = -stress.iter().sum::<f64>() / 3.0;
            let [xx, yy, zz] = stress.map(|s| Scalar(s + pressure));
            let zero = Scalar(0.0);
            let trial = Deviator { xx, yy, zz, xy: zero, yz: zero, zx: zero };
            let sigma = trial.mises_square().sqrt();
            let surfaces = law.surfaces((Scalar(pressure), Scalar(1e12)), Scalar(0.0), Scalar(1.0));
            let meridian = Concrete::meridian(&trial, sigma, surfaces.q);
            surfaces.yielding.0 * meridian.0 / sigma.0
        };
        for (stress, what) in
            [([-35e6, 0.0, 0.0], "uniaxial compression"), ([3.5e6, 0.0, 0.0], "uniaxial tension")]
        {
            assert!((at(stress) - 1.0).abs() < 2e-3, "{what}: {}", at(stress));
        }
        // In shear the von Mises stress is root three of it; the strength is that of sigma.
        let shear = 0.18 * 35e6 / 3.0_f64.sqrt();
        assert!((at([shear, -shear, 0.0]) - 1.0).abs() < 1e-9, "{}", at([shear, -shear, 0.0]));
    }

    #[test]
    fn constants_that_make_no_surface_are_refused() {
        assert_eq!(LAW.fault(), None);
        for law in [
            RiedelHiermaierThoma { q0: 0.5, ..LAW },
            RiedelHiermaierThoma { q0: 1.1, ..LAW },
            RiedelHiermaierThoma { distension: 1.0, ..LAW },
            RiedelHiermaierThoma { compaction_pressure: 20e6, ..LAW },
            RiedelHiermaierThoma { shear_strength: 0.05, ..LAW },
        ] {
            assert!(law.fault().is_some(), "{law:?}");
        }
    }
}
