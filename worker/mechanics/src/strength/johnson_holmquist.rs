//! Ceramics and glass after Johnson and Holmquist (JH-2): strength that grows with pressure and falls with damage, and the
//! pressure with which broken material swells.
//!
//! G. R. Johnson, T. J. Holmquist, An improved computational constitutive model for brittle materials, in High-Pressure Science and
//! Technology 1993, AIP Conf. Proc. 309 (1994) 981. With `P* = P / hel_pressure` and `T* = tension / hel_pressure`:
//!
//! - intact `s_i = a (P* + T*)^n (1 + c ln max(rate/rate0, 1))`, fractured `s_f = b P*^m (1 + c ln ..)`, at most `fractured_limit`;
//! - strength `hel_stress (s_i - D (s_i - s_f))`, D the damage at the start of the step;
//! - damage grows by plastic strain increment over `d1 (P* + T*)^d2`, up to 1, and at once where that is zero;
//! - the pressure of the equation of state, plus the bulking pressure q, is at least `-(1 - D) tension`;
//! - damage lowers the strength from s to s', which releases `U = (s^2 - s'^2) / (6 G)` of elastic energy, of which `beta` goes
//!   into swelling: `q' = -K mu + sqrt((K mu + q)^2 + 2 beta K U)`, with K the bulk modulus. Where `K mu + q` is negative nothing
//!   presses against the swelling, and q stays.

use super::{Around, Deviator, History, Memory, StrengthLaw};
use crate::{
    lanes::{
        Lane,
        functions::{ln, pow},
    },
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law; K, K2 and K3 are those of the polynomial equation of state beside it.
    pub struct JohnsonHolmquist = "johnson-holmquist" {
        /// G (stress).
        shear: STRESS, Positive;
        /// A of the intact material.
        a: NONE, NotNegative;
        /// B of the fractured one.
        b: NONE, NotNegative;
        /// C, of the rate.
        c: NONE, NotNegative;
        /// M, exponent of the fractured material.
        m: NONE, Positive;
        /// N, exponent of the intact one.
        n: NONE, Positive;
        /// The rate up to which the strength does not depend on it (1/time).
        rate0: RATE, Positive;
        /// T (stress): the mean tension that the intact material bears.
        tension: STRESS, Positive;
        /// Most of the normalised strength of the fractured material.
        fractured_limit: NONE, Positive;
        /// Equivalent stress at the Hugoniot elastic limit, `1.5 (HEL - hel_pressure)`.
        hel_stress: STRESS, Positive;
        /// Pressure at the Hugoniot elastic limit.
        hel_pressure: STRESS, Positive;
        /// Share of the released elastic energy that goes into swelling.
        beta: NONE, Fraction;
        /// D1: plastic strain to fracture where `P* + T*` is 1.
        d1: NONE, NotNegative;
        /// D2, its exponent.
        d2: NONE, Positive;
    }
}

/// Index of the bulking pressure among the history variables.
const BULKING: usize = 0;
/// Index of the elastic energy that damage has released so far.
const RELEASED: usize = 1;

impl JohnsonHolmquist {
    /// What the law keeps of an element beside damage and plastic strain.
    pub const HISTORY: &'static [Variable] = &[
        Variable { name: "bulking_pressure", unit: Unit::STRESS, initial: 0.0 },
        Variable { name: "released_energy", unit: Unit::STRESS, initial: 0.0 },
    ];
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Ceramic {
    law: JohnsonHolmquist,
    bulk: f64,
    inverse_rate0: f64,
    inverse_pressure: f64,
    /// T*.
    tension: f64,
}

impl Ceramic {
    /// In a material of this bulk modulus.
    pub fn new(law: &JohnsonHolmquist, bulk: f64) -> Self {
        Self {
            law: *law,
            bulk,
            inverse_rate0: 1.0 / law.rate0,
            inverse_pressure: 1.0 / law.hel_pressure,
            tension: law.tension / law.hel_pressure,
        }
    }

    /// Strength of the intact and of the fractured material, and plastic strain to fracture.
    #[inline(always)]
    fn curves<L: Lane>(&self, pressure: L, rate: L) -> [L; 3] {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let normal = pressure * L::splat(self.inverse_pressure);
        let raised = (normal + L::splat(self.tension)).max(zero);
        let log = ln((rate * L::splat(self.inverse_rate0)).max(one));
        let factor = L::splat(law.c).mul_add(log, one);
        let intact = L::splat(law.a) * pow(raised, L::splat(law.n)) * factor;
        let fractured = L::splat(law.b) * pow(normal.max(zero), L::splat(law.m)) * factor;
        let fractured = fractured.min(L::splat(law.fractured_limit));
        let stress = L::splat(law.hel_stress);
        [stress * intact, stress * fractured, L::splat(law.d1) * pow(raised, L::splat(law.d2))]
    }
}

/// The bulking pressure after a release of elastic energy, where something presses: `elastic` is the pressure without it, `stiffness` the
/// bulk modulus times the share of the energy that swells.
#[inline(always)]
pub(super) fn bulked<L: Lane>(elastic: L, bulking: L, released: L, stiffness: f64) -> L {
    let zero = L::splat(0.0);
    let pressed = elastic + bulking;
    let root = pressed.mul_add(pressed, L::splat(2.0 * stiffness) * released).sqrt();
    let swells = L::both(zero.less(released), zero.less_equal(pressed));
    L::select(swells, root - elastic, bulking)
}

impl StrengthLaw for Ceramic {
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
        let (damage, bulking) = (memory.damage, memory.variables[BULKING]);
        memory.added_pressure = bulking;
        memory.least_pressure = -((one - damage) * L::splat(self.law.tension));
        let pressure = (around.pressure + bulking).max(memory.least_pressure);
        let [intact, fractured, to_fracture] = self.curves(pressure, around.strain.rate);
        let lost = intact - fractured;
        let strength = damage.neg_mul_add(lost, intact);
        let sigma = trial.mises_square().sqrt();
        let yields = strength.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        let slip = L::select(yields, (sigma - strength) * L::splat(1.0 / (3.0 * self.law.shear)), zero);
        history.plastic_strain = history.plastic_strain + slip;
        let grown = L::select(zero.less(to_fracture), damage + slip / to_fracture, one).min(one);
        let after = L::select(yields, grown, damage);
        memory.damage = after;

        let left = after.neg_mul_add(lost, intact);
        let released = strength.mul_add(strength, -(left * left)).max(zero);
        let released = L::select(yields, released * L::splat(1.0 / (6.0 * self.law.shear)), zero);
        memory.variables[RELEASED] = memory.variables[RELEASED] + released;
        let elastic = L::splat(self.bulk) * (one / around.relative_volume - one);
        memory.variables[BULKING] = bulked(elastic, bulking, released, self.law.beta * self.bulk);
        trial.scaled(L::select(yields, strength / sigma, one))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Strain, *};
    use crate::{
        block::Block,
        element::{ElementVote, Step},
        exact::Quantum,
        lanes::Width,
        material::{Eos, Failure, Material, Strength},
        mesh::Topology,
        piece::Piece,
        state::{ShellState, field},
    };

    /// Boron carbide (Johnson and Holmquist 1999).
    const LAW: JohnsonHolmquist = JohnsonHolmquist {
        shear: 197e9,
        a: 0.927,
        b: 0.70,
        c: 0.005,
        m: 0.85,
        n: 0.67,
        rate0: 1.0,
        tension: 0.26e9,
        fractured_limit: 0.2,
        hel_stress: 1.5 * (19e9 - 8.71e9),
        hel_pressure: 8.71e9,
        beta: 1.0,
        d1: 0.001,
        d2: 0.5,
    };
    const K: [f64; 3] = [233e9, -593e9, 2800e9];
    const STEP: f64 = 2e-9;

    fn boron_carbide() -> Material {
        let [a1, a2, a3] = K;
        let eos = Eos::Polynomial { a1, a2, a3, b0: 0.0, b1: 0.0, t1: a1, t2: 0.0 };
        let strength = Strength::JohnsonHolmquist(LAW);
        Material { name: "boron carbide".into(), density: 2510.0, eos, strength, failure: Failure::None }
    }

    fn cube() -> Block {
        let corner = |n: u32| [n % 2, n / 2 % 2, n / 4].map(f64::from);
        Block::new(&Piece {
            part: 0,
            material: 0,
            topology: Topology::Structured { cells: [1; 3] },
            nodes: (0..8).collect(),
            elements: vec![0],
            x: (0..8).map(corner).collect(),
            v: vec![[0.0; 3]; 8],
            mass: vec![1.0; 8],
            constraint: vec![0; 8],
            initial_volume: vec![1.0],
            fields: std::array::from_fn(|k| vec![if k == field::RELATIVE_VOLUME { 1.0 } else { 0.0 }]),
            erosion: None,
            history: vec![vec![0.0]; 2],
            contact: Vec::new(),
            shells: ShellState::default(),
            own: Vec::new(),
            hourglass: crate::element::hourglass::Hourglass::NONE,
        })
    }

    /// The published equations in uniaxial strain, written out in plain numbers: length and its rate to axial deviator.
    #[derive(Default, Debug)]
    struct Published {
        /// Axial deviator.
        axial: f64,
        pressure: f64,
        strain: f64,
        damage: f64,
        bulking: f64,
        released: f64,
    }

    impl Published {
        fn step(&mut self, length: f64, middle: f64, rate: f64) {
            let mu = 1.0 / length - 1.0;
            let cold = if mu > 0.0 { K[0] * mu + K[1] * mu * mu + K[2] * mu * mu * mu } else { K[0] * mu };
            self.pressure = (cold + self.bulking).max(-(1.0 - self.damage) * LAW.tension);
            let stretching = rate / middle;
            let (p, t) = (self.pressure / LAW.hel_pressure, LAW.tension / LAW.hel_pressure);
            let effective_rate = 2.0 / 3.0 * stretching.abs();
            let factor = 1.0 + LAW.c * (effective_rate / LAW.rate0).max(1.0).ln();
            let intact = LAW.hel_stress * LAW.a * (p + t).max(0.0).powf(LAW.n) * factor;
            let fractured = (LAW.b * p.max(0.0).powf(LAW.m) * factor).min(LAW.fractured_limit);
            let fractured = LAW.hel_stress * fractured;
            let at = |damage: f64| intact - damage * (intact - fractured);
            let strength = at(self.damage);
            self.axial += 2.0 * LAW.shear * (2.0 / 3.0) * stretching * STEP;
            let sigma = 1.5 * self.axial.abs();
            if sigma > strength {
                let slip = (sigma - strength) / (3.0 * LAW.shear);
                let to_fracture = LAW.d1 * (p + t).max(0.0).powf(LAW.d2);
                let before = self.damage;
                self.damage = if to_fracture > 0.0 { (before + slip / to_fracture).min(1.0) } else { 1.0 };
                let energy = |damage: f64| at(damage) * at(damage) / (6.0 * LAW.shear);
                let released = (energy(before) - energy(self.damage)).max(0.0);
                let pressed = K[0] * mu + self.bulking;
                if pressed >= 0.0 && released > 0.0 {
                    self.bulking = -K[0] * mu + (pressed * pressed + 2.0 * LAW.beta * K[0] * released).sqrt();
                }
                self.released += released;
                self.strain += slip;
                self.axial *= strength / sigma;
            }
        }
    }

    /// Compressed by 6 %, pulled until it is 5 % too long, compressed again by 2 %: elastic limit, damage, bulking, tension cut.
    #[test]
    fn an_element_follows_the_published_equations_through_loading_and_unloading() {
        let material = boron_carbide();
        let step = Step {
            dt: STEP,
            linear_viscosity: 0.0,
            quadratic_viscosity: 0.0,
            force_quantum: Quantum::for_reference(1e12, 42),
            energy_quantum: Quantum::for_reference(1e12, 40),
            arm: 1.0,
        };
        let (mut block, mut published) = (cube(), Published::default());
        let (mut highest, mut elastic) = (0.0f64, 0);
        for n in 0..11_000 {
            let rate = if (4000..9500).contains(&n) { 10_000.0 } else { -7_500.0 };
            for (x, v) in block.x[0].iter_mut().zip(&mut block.v[0]).take(8) {
                if *x > 0.5 {
                    *v = rate;
                    *x += STEP * rate;
                }
            }
            let middle = block.x[0][1] - 0.5 * STEP * rate;
            let length = block.x[0][1];
            let mut vote = ElementVote::default();
            block.compute(&material, std::slice::from_ref(&(0..1)), &step, Width::best(), &mut vote);
            assert!(vote.fault.is_none(), "{:?}", vote.fault);
            published.step(length, middle, rate);
            let reading = block.reading(0);
            let near = |found: f64, wanted: f64, scale: f64| (found - wanted).abs() <= 1e-8 * scale;
            let all = [
                (reading[field::SXX], published.axial, 1e10),
                (reading[field::PRESSURE], published.pressure, 1e10),
                (reading[field::PLASTIC_STRAIN], published.strain, 1e-2),
                (reading[field::DAMAGE], published.damage, 1.0),
                (reading[crate::state::N_FIELDS + BULKING], published.bulking, 1e9),
                (reading[crate::state::N_FIELDS + RELEASED], published.released, 1e8),
            ];
            for (found, wanted, scale) in all {
                assert!(near(found, wanted, scale), "step {n}: {found} for {wanted}, {published:?}");
            }
            highest = highest.max(reading[field::PRESSURE]);
            elastic += u32::from(reading[field::PLASTIC_STRAIN] == 0.0);
            if n == 3999 {
                // Closed form of the fractured material: the limit of its strength, the pressure of its volume and the bulking.
                let cap = LAW.hel_stress * LAW.fractured_limit;
                assert_eq!(reading[field::DAMAGE], 1.0);
                assert!((1.5 * reading[field::SXX].abs() / cap - 1.0).abs() < 1e-9, "{reading:?}");
                let mu = 1.0 / length - 1.0;
                let cold = mu * (K[0] + mu * (K[1] + mu * K[2]));
                let more = reading[field::PRESSURE] - cold;
                assert!(more > 1e8 && near(more, published.bulking, 1e9), "{more}");
            }
            if n == 9499 {
                // Nothing is left that bears tension, and no shear without pressure.
                assert_eq!((reading[field::PRESSURE], reading[field::SXX]), (0.0, 0.0));
            }
        }
        assert!(highest > 12e9 && (500..4000).contains(&elastic), "{highest} {elastic}");
    }

    #[test]
    fn the_strength_is_that_of_the_damage_between_the_intact_and_the_fractured_curve() {
        use crate::{
            element::vector::{Tensor, Vector},
            lanes::scalar::Scalar,
        };
        let law = Ceramic::new(&LAW, K[0]);
        // Quasi-static at the elastic limit: A (1 + T*)^N of the equivalent stress there.
        let [intact, fractured, strain] = law.curves(Scalar(8.71e9), Scalar(0.5)).map(|x| x.0);
        let raised: f64 = 1.0 + 0.26 / 8.71;
        assert!((intact / (LAW.hel_stress * 0.927 * raised.powf(0.67)) - 1.0).abs() < 1e-14, "{intact}");
        assert!((fractured / (LAW.hel_stress * 0.2) - 1.0).abs() < 1e-14, "{fractured}");
        assert!((strain / (0.001 * raised.sqrt()) - 1.0).abs() < 1e-14, "{strain}");
        let at = |damage: f64| {
            let mut trial = Deviator::<Scalar>::zero();
            trial.xy = Scalar(1e11);
            let zero = Scalar(0.0);
            let still = Vector { x: zero, y: zero, z: zero };
            let strain = Strain { rate: Scalar(0.5), increment: zero };
            let around = Around {
                pressure: Scalar(8.71e9),
                pressure_before: zero,
                energy: zero,
                density: Scalar(2610.0),
                relative_volume_before: Scalar(1.0),
                relative_volume: Scalar(0.96),
                gradient: Tensor { x: still, y: still, z: still },
                spin: still,
                rate: Deviator::zero(),
                volume_rate: zero,
                strain,
                length: Scalar(1.0),
                dt: Scalar(1e-9),
            };
            let mut history = History { plastic_strain: zero, temperature: zero };
            let mut memory = Memory { damage: Scalar(damage), ..Memory::none() };
            law.remember(trial, &around, &mut history, &mut memory, true).mises_square().0.sqrt()
        };
        for damage in [0.0, 0.25, 1.0] {
            let wanted = (1.0 - damage) * intact + damage * fractured;
            assert!((at(damage) / wanted - 1.0).abs() < 1e-13, "{damage}: {}", at(damage));
        }
        // Under the tension that it bears the intact material has no strength, and fails at any strain.
        let [intact, _, strain] = law.curves(Scalar(-0.26e9), Scalar(0.5)).map(|x| x.0);
        assert!(intact < 1e-3 * LAW.hel_stress && strain < 1e-6, "{intact} {strain}");
    }
}
