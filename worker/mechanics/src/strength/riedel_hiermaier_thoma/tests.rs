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
        (1.22 + 1.22 * eta) * energy / volume + eta * (35.27e9 + eta * (39.58e9 + eta * 9.04e9)) / distension
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
        let mut whole = pressure_at(open(self.crushed), volume, energy);
        if self.crushed < 1.0 {
            whole = whole.min(top(self.crushed));
        }
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
        let slip =
            if rising < left { rising } else { ((sigma - damaged(failing)) / (3.0 * LAW.shear)).max(left) };
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
fn without_pores_the_pressure_is_that_of_the_solid() {
    let (_, published) = follow(&[[0.7, 1.0, 1.0]], 4000);
    let solid = pressure_at(1.0, 0.7, 0.0);
    assert!(published.crushed == 1.0 && published.pressure > 0.99 * solid && solid > 8e9, "{published:?}");
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
