//! Pressure of explosions in air on a face, by the polynomials of Kingery and Bulmash.
//!
//! C. N. Kingery, G. Bulmash, Airblast parameters from TNT spherical air burst and hemispherical surface burst, ARBRL-TR-02555
//! (1984): each quantity is `10^(sum of c_i U^i)`, `U = k0 + k1 log10 Z`, of the scaled distance `Z = R / W^(1/3)` in m/kg^(1/3), in kPa
//! and ms (over `W^(1/3)`). Between arrival and the end of the positive phase a pressure falls as
//! `P (1 - s) e^(-b s)`, s the time since the arrival over the duration and b such that it has the impulse of the
//! polynomial; what follows has curves of its own ([`Negative`]). On a face whose outward normal makes the angle a with the way to the charge it is
//! `reflected cos^2 a + incident (1 + cos^2 a - 2 cos a)`, and `incident` on one that is turned away (G. Randers-Pehrson, K. A.
//! Bannister, Airblast loading model for DYNA2D and DYNA3D, ARL-TR-1310, 1997).

mod negative;
mod tables;

use serde::{Deserialize, Serialize};

use super::Span;
use crate::{
    lanes::{
        functions::{cbrt, exp, ln},
        scalar::Scalar,
    },
    vectors::{cross, dot, minus},
};
pub use negative::Negative;
use tables::{AIR_BURST, SURFACE_BURST};

/// How the charge lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Burst {
    /// A sphere in free air.
    Air,
    /// A hemisphere on hard ground, which adds to the wave.
    Surface,
}

/// A charge of TNT and the units of the problem.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Charge {
    /// Its centre (length).
    pub point: [f64; 3],
    /// Cube root of its mass in kg.
    pub root: f64,
    /// When it explodes, and when its pressure ends (time).
    pub span: Span,
    pub burst: Burst,
    /// Whether the pressure after the positive phase acts too.
    pub negative: bool,
    /// Metres in a unit of length, milliseconds in one of time, kPa in one of stress.
    pub units: [f64; 3],
    /// Bound on its pressure on any face of the problem (stress).
    pub greatest: f64,
}

/// Scaled distances in which the polynomials hold, ends included; those of durations begin later.
const FARTHEST: f64 = 40.0;
/// Cosine of the way to a charge and a normal up to which the charge lies in the plane of a face.
const BESIDE: f64 = 1e-9;

/// One polynomial: k0, k1, and c from the constant on.
struct Polynomial {
    k: [f64; 2],
    c: &'static [f64],
}

impl Polynomial {
    /// Its value at the natural logarithm of a scaled distance.
    fn at(&self, log: f64) -> f64 {
        let u = self.k[1].mul_add(log * std::f64::consts::LOG10_E, self.k[0]);
        let power = self.c.iter().rev().fold(0.0_f64, |sum, c| sum.mul_add(u, *c));
        exp(Scalar(power * std::f64::consts::LN_10)).0
    }
}

/// The polynomials of one kind of burst; each of several reaches to a scaled distance.
struct Table {
    nearest: f64,
    incident: Polynomial,
    reflected: Polynomial,
    incident_impulse: [(f64, Polynomial); 2],
    reflected_impulse: Polynomial,
    arrival: Polynomial,
    /// The duration is given from here on; nearer faces have the one of here.
    from: f64,
    duration: [(f64, Polynomial); 3],
}

impl Burst {
    /// The least scaled distance at which pressures are known (m/kg^(1/3)).
    pub fn nearest(self) -> f64 {
        self.table().nearest
    }

    fn table(self) -> &'static Table {
        match self {
            Burst::Air => &AIR_BURST,
            Burst::Surface => &SURFACE_BURST,
        }
    }
}

/// A wave at a distance from its charge, in kPa and ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    pub arrival: f64,
    pub duration: f64,
    /// Peaks and impulses of the incident pressure and of that which is reflected straight back.
    pub peaks: [f64; 2],
    pub impulses: [f64; 2],
    /// What follows.
    pub negative: Negative,
}

impl Wave {
    /// At a scaled distance, which is taken as the nearest or farthest known where it is beyond.
    pub fn at(burst: Burst, scaled: f64, root: f64) -> Self {
        let table = burst.table();
        let scaled = scaled.max(table.nearest).min(FARTHEST);
        let log = ln(Scalar(scaled)).0;
        let reached = |list: &'static [(f64, Polynomial)], scaled: f64, log: f64| {
            let found = list.iter().find(|(to, _)| scaled <= *to).or(list.last());
            found.map_or(0.0, |(_, polynomial)| polynomial.at(log))
        };
        let lasting = scaled.max(table.from);
        Self {
            arrival: root * table.arrival.at(log),
            duration: root * reached(&table.duration, lasting, ln(Scalar(lasting)).0),
            peaks: [table.incident.at(log), table.reflected.at(log)],
            impulses: [
                root * reached(&table.incident_impulse, scaled, log),
                root * table.reflected_impulse.at(log),
            ],
            negative: Negative::at(burst, (scaled, log), root),
        }
    }

    /// Incident and reflected pressure at a time after the arrival.
    pub fn pressures(&self, since: f64) -> [f64; 2] {
        if since >= self.duration {
            return self.negative.pressures(since - self.duration);
        }
        let s = since / self.duration;
        [0, 1].map(|i| self.peaks[i] * (1.0 - s) * exp(Scalar(-self.decay(i) * s)).0)
    }

    /// Impulses of both from a time after the arrival until another; none before it.
    pub fn impulses_within(&self, times: [f64; 2]) -> [f64; 2] {
        let below = times.map(|since| self.negative.impulses_until(since - self.duration));
        [0, 1].map(|i| {
            let decay = self.decay(i);
            let [from, until] =
                times.map(|since| begun_phase(decay, (since / self.duration).clamp(0.0, 1.0)));
            (self.peaks[i] * self.duration).mul_add(until - from, below[0][i] - below[1][i])
        })
    }

    /// The b of the incident or of the reflected positive phase.
    fn decay(&self, which: usize) -> f64 {
        decay(self.impulses[which] / (self.peaks[which] * self.duration))
    }
}

/// `integral of (1 - s) e^(-b s)` from 0 to 1, and its slope by b.
fn positive_phase(b: f64) -> [f64; 2] {
    if b.abs() < 0.5 {
        // sum of (-b)^n / (n + 2)!
        let (mut value, mut slope, mut term) = (0.0, 0.0, 0.5);
        for n in 0..14 {
            value += term;
            let next = term * -b / f64::from(n + 3);
            slope -= f64::from(n + 1) * term / f64::from(n + 3);
            term = next;
        }
        return [value, slope];
    }
    let e = exp(Scalar(-b)).0;
    let inverse = 1.0 / b;
    let value = inverse * (1.0 - inverse * (1.0 - e));
    [value, inverse * inverse * (2.0 * inverse * (1.0 - e) - 1.0 - e)]
}

/// `integral of (1 - t) e^(-b t)` from 0 to s; `1 - s u = (1 - s) + s (1 - u)` for t = s u.
fn begun_phase(b: f64, s: f64) -> f64 {
    let [whole, _] = positive_phase(b * s);
    s * (1.0 - s).mul_add(1.0 - b * s * whole, s * whole)
}

/// Most Newton steps for a decay.
const STEPS: usize = 30;

/// The b whose positive phase is `share` of peak times duration. The integral is convex and falls, and `e^(-b/3) / 2` lies below it: from
/// there Newton's steps go one way.
fn decay(share: f64) -> f64 {
    let mut b = -3.0 * ln(Scalar(2.0 * share)).0;
    for _ in 0..STEPS {
        let [value, slope] = positive_phase(b);
        let change = (share - value) / slope;
        b += change;
        if change.abs() < 1e-12 * (1.0 + b.abs()) {
            break;
        }
    }
    b
}

impl Charge {
    /// Cube root of a mass.
    pub fn root(kilograms: f64) -> f64 {
        cbrt(Scalar(kilograms)).0
    }

    /// Scaled distance of a point (m/kg^(1/3)).
    pub fn scaled_distance(&self, x: [f64; 3]) -> f64 {
        let way: [f64; 3] = std::array::from_fn(|a| self.point[a] - x[a]);
        dot(way, way).sqrt() * self.units[0] / self.root
    }

    /// Whether it lies behind the face with these corners, not beside it: more than a rounding error below its plane.
    pub fn is_behind(&self, corners: [[f64; 3]; 4]) -> bool {
        let centre: [f64; 3] = std::array::from_fn(|a| 0.25 * corners.iter().map(|x| x[a]).sum::<f64>());
        let normal = cross(minus(corners[2], corners[0]), minus(corners[3], corners[1]));
        let way = minus(self.point, centre);
        dot(way, normal) < -BESIDE * (dot(way, way) * dot(normal, normal)).sqrt()
    }

    /// The reflected peak at a scaled distance (stress).
    pub fn reflected_peak(&self, scaled: f64) -> f64 {
        Wave::at(self.burst, scaled, self.root).peaks[1] / self.units[2]
    }

    /// Mean pressure from a time on until another on a face with its centre at `x` and this outward normal of unit length (stress); that of an
    /// instant where both are the same.
    pub fn pressure(&self, x: [f64; 3], normal: [f64; 3], [from, until]: [f64; 2]) -> f64 {
        let scaled = self.scaled_distance(x);
        let ends = until.min(self.span.until);
        if from >= self.span.until || scaled > FARTHEST || scaled == 0.0 {
            return 0.0;
        }
        let [metres, milliseconds, kilopascals] = self.units;
        let wave = Wave::at(self.burst, scaled, self.root);
        let since = [from, ends].map(|time| (time - self.span.from) * milliseconds - wave.arrival);
        let over = if self.negative { f64::INFINITY } else { wave.duration };
        if since[1] < 0.0 || since[0] >= over {
            return 0.0;
        }
        let way: [f64; 3] = std::array::from_fn(|a| self.point[a] - x[a]);
        let cosine = dot(way, normal) * metres / (scaled * self.root);
        let [incident, reflected] = if until > from {
            wave.impulses_within(since.map(|since| since.min(over)))
                .map(|impulse| impulse / ((until - from) * milliseconds))
        } else {
            wave.pressures(since[0])
        };
        let pressure = if cosine > 0.0 {
            let square = cosine * cosine;
            reflected.mul_add(square, incident * (1.0 + square - 2.0 * cosine))
        } else {
            incident
        };
        pressure / kilopascals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `e^(sum of c_i (ln Z)^i)`, the form of M. M. Swisdak, Simplified Kingery airblast calculations, 26th DoD Explosives Safety Seminar
    /// (1994), for hemispherical surface bursts.
    fn swisdak(c: &[f64], z: f64) -> f64 {
        (0..).zip(c).map(|(i, c)| c * z.ln().powi(i)).sum::<f64>().exp()
    }

    /// Twenty scaled distances from 0.2 on.
    fn distances() -> impl Iterator<Item = f64> {
        (0..20).map(|i| 0.2 * 200f64.powf(f64::from(i) / 19.5))
    }

    #[test]
    fn a_surface_burst_is_within_a_hundredth_of_another_published_fit_at_twenty_distances() {
        for z in distances() {
            let wave = Wave::at(Burst::Surface, z, 1.0);
            let incident: &[f64] = match z {
                z if z < 2.9 => &[7.2106, -2.1069, -0.3229, 0.1117, 0.0685],
                z if z < 23.8 => &[7.5938, -3.0523, 0.40977, 0.0261, -0.01267],
                _ => &[6.0536, -1.4066],
            };
            let arrival: &[f64] = match z < 1.5 {
                true => &[-0.7604, 1.8058, 0.1257, -0.0437, -0.0310, -0.00669],
                false => &[-0.7137, 1.5732, 0.5561, -0.4213, 0.1054, -0.00929],
            };
            let pairs = [
                (wave.peaks[0], swisdak(incident, z)),
                (wave.arrival, swisdak(arrival, z)),
                (wave.impulses[1], swisdak(&[6.7853, -1.3466, 0.101, -0.01123], z)),
            ];
            for (found, published) in pairs {
                assert!((found / published - 1.0).abs() < 0.01, "{z}: {found} {published}");
            }
            if z < 2.0 {
                let reflected = [9.006, -2.6893, -0.6295, 0.1011, 0.29255, 0.13505, 0.019736];
                assert!((wave.peaks[1] / swisdak(&reflected, z) - 1.0).abs() < 0.01, "{z}: {wave:?}");
            }
        }
    }

    #[test]
    fn every_polynomial_is_that_of_the_platform_at_twenty_distances() {
        for burst in [Burst::Air, Burst::Surface] {
            let table = burst.table();
            let impulses = table.incident_impulse.iter().map(|(_, p)| p);
            let durations = table.duration.iter().map(|(_, p)| p);
            let others = [&table.incident, &table.reflected, &table.reflected_impulse, &table.arrival];
            for polynomial in impulses.chain(durations).chain(others) {
                for z in distances() {
                    let u = polynomial.k[0] + polynomial.k[1] * z.log10();
                    let power: f64 = (0..).zip(polynomial.c).map(|(i, c)| c * u.powi(i)).sum();
                    // Far outside its reach a piece is no number of this world.
                    if power.abs() > 12.0 {
                        continue;
                    }
                    let found = polynomial.at(z.ln());
                    assert!((found / 10f64.powf(power) - 1.0).abs() < 1e-9, "{z}: {found}");
                }
            }
        }
    }

    #[test]
    fn pieces_meet_and_an_air_burst_is_weaker_than_one_on_the_ground() {
        for burst in [Burst::Air, Burst::Surface] {
            let table = burst.table();
            let seams = table.incident_impulse[..1].iter().chain(&table.duration[..2]).map(|(to, _)| *to);
            for z in seams {
                let [near, far] = [z, z * (1.0 + 1e-12)].map(|z| Wave::at(burst, z, 1.0));
                let pairs = [(near.duration, far.duration), (near.impulses[0], far.impulses[0])];
                assert!(pairs.iter().all(|(a, b)| (a / b - 1.0).abs() < 0.02), "{z}: {near:?} {far:?}");
            }
        }
        for z in distances() {
            let [air, ground] = [Burst::Air, Burst::Surface].map(|burst| Wave::at(burst, z, 1.0));
            // A rule of thumb: the ground stands for 1.8 times the charge.
            let stronger = Wave::at(Burst::Air, z / cbrt(Scalar(1.8)).0, 1.0);
            assert!(air.peaks[0] < ground.peaks[0] && air.peaks[1] < ground.peaks[1]);
            assert!((stronger.peaks[0] / ground.peaks[0] - 1.0).abs() < 0.16, "{z}: {stronger:?} {ground:?}");
        }
    }

    #[test]
    fn the_positive_phase_has_the_impulse_of_the_polynomial() {
        for burst in [Burst::Air, Burst::Surface] {
            for z in distances() {
                let wave = Wave::at(burst, z, 2.0);
                let n = 20_000;
                for i in 0..2 {
                    let step = wave.duration / f64::from(n);
                    let sum: f64 = (0..n).map(|k| wave.pressures((f64::from(k) + 0.5) * step)[i]).sum();
                    let off = sum * step / wave.impulses[i] - 1.0;
                    assert!(off.abs() < 1e-5, "{burst:?} {z} {i}: {off}");
                }
                assert_eq!(wave.pressures(0.0), wave.peaks);
            }
        }
        for share in [0.01, 0.2, 0.4999, 0.5, 0.51, 0.9] {
            assert!((positive_phase(decay(share))[0] / share - 1.0).abs() < 1e-11, "{share}");
        }
    }

    fn charge(burst: Burst, negative: bool) -> Charge {
        // 8 kg at 4 m in mm, ms, GPa.
        let (root, units) = (Charge::root(8.0), [1e-3, 1.0, 1e6]);
        Charge { point: [0.0, 0.0, 4000.0], root, span: Span::ALWAYS, burst, negative, units, greatest: 1.0 }
    }

    #[test]
    fn a_charge_is_behind_a_face_unless_it_is_before_or_beside_it() {
        let charge = charge(Burst::Air, true);
        let square = [[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0], [0.0, 1000.0]];
        let behind = |x: [[f64; 3]; 4]| {
            let turned = [x[0], x[3], x[2], x[1]];
            [charge.is_behind(x), charge.is_behind(turned)]
        };
        let floor = |height: f64| square.map(|[x, y]| [x, y, height]);
        assert_eq!([0.0, 8000.0].map(|z| behind(floor(z))), [[false, true], [true, false]]);
        // In its plane, on a wall beside it, and on a face without area.
        assert_eq!(behind(floor(4000.0)), [false; 2]);
        assert_eq!(behind(square.map(|[x, z]| [x, 0.1 * x, 3000.0 + z])), [false; 2]);
        assert_eq!(behind([[1.0; 3]; 4]), [false; 2]);
    }

    #[test]
    fn a_face_feels_the_pressure_of_its_distance_and_angle_in_the_units_of_the_problem() {
        let ground = charge(Burst::Surface, false);
        assert!((ground.root - 2.0).abs() < 1e-15);
        let wave = Wave::at(Burst::Surface, 2.0, 2.0);
        let after = wave.arrival + 1e-9;
        let near = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-6, "{found} {wanted}");
        let at = |normal: [f64; 3], time: f64| ground.pressure([0.0; 3], normal, [time; 2]);
        near(at([0.0, 0.0, 1.0], after), wave.peaks[1] * 1e-6);
        near(at([1.0, 0.0, 0.0], after), wave.peaks[0] * 1e-6);
        near(at([0.0, 0.0, -1.0], after), wave.peaks[0] * 1e-6);
        let half = [3f64.sqrt() / 2.0, 0.0, 0.5];
        near(at(half, after), (0.25 * wave.peaks[1] + 0.25 * wave.peaks[0]) * 1e-6);
        assert_eq!(at([0.0, 0.0, 1.0], wave.arrival - 1e-9), 0.0);
        assert_eq!(at([0.0, 0.0, 1.0], wave.arrival + 1.01 * wave.duration), 0.0);
        let sucking = |normal: [f64; 3], share: f64| {
            let time = wave.arrival + wave.duration + share * wave.negative.duration;
            charge(Burst::Surface, true).pressure([0.0; 3], normal, [time; 2])
        };
        near(sucking([0.0, 0.0, 1.0], 1.0 / 3.0), -wave.negative.peak * 1e-6);
        near(sucking([0.0, 0.0, -1.0], 1.0 / 3.0), -0.5 * wave.negative.peak * 1e-6);
        assert_eq!((sucking([0.0, 0.0, 1.0], 1.001), sucking([0.0, 0.0, 1.0], 50.0)), (0.0, 0.0));
        let late = Charge { span: Span { from: 5.0, until: 9.0 }, ..ground };
        near(late.pressure([0.0; 3], [0.0, 0.0, 1.0], [5.0 + after; 2]), wave.peaks[1] * 1e-6);
        assert_eq!(late.pressure([0.0; 3], [0.0, 0.0, 1.0], [9.0; 2]), 0.0);
        assert_eq!(ground.pressure([0.0, 0.0, 90_000.0], [0.0, 0.0, -1.0], [1e3; 2]), 0.0);
    }

    #[test]
    fn steps_of_any_length_give_a_face_the_impulse_of_the_wave() {
        let normal = [0.0, 0.0, 1.0];
        for burst in [Burst::Air, Burst::Surface] {
            let wave = Wave::at(burst, 2.0, 2.0);
            let below = wave.negative.impulses()[1];
            for (negative, wanted) in [(false, wave.impulses[1]), (true, wave.impulses[1] - below)] {
                let charge = charge(burst, negative);
                let end = wave.arrival + wave.duration + wave.negative.duration;
                for steps in [1, 2, 7, 100, 10_000] {
                    let step = 1.1 * end / f64::from(steps);
                    let at =
                        |k: u32| charge.pressure([0.0; 3], normal, [k, k + 1].map(|k| f64::from(k) * step));
                    let impulse = step * (0..steps).map(at).sum::<f64>() * 1e6;
                    assert!(
                        (impulse - wanted).abs() < 1e-9 * wave.impulses[1],
                        "{steps}: {impulse} {wanted}"
                    );
                }
                // Cut off by the end of its span.
                let until = wave.arrival + 0.5 * wave.duration;
                let cut = Charge { span: Span { from: 0.0, until }, ..charge };
                let impulse = end * cut.pressure([0.0; 3], normal, [0.0, end]) * 1e6;
                assert!((impulse / wave.impulses_within([0.0, 0.5 * wave.duration])[1] - 1.0).abs() < 1e-12);
                assert!(impulse > 0.5 * wave.impulses[1] && impulse < wave.impulses[1]);
                assert_eq!(cut.pressure([0.0; 3], normal, [until, end]), 0.0);
            }
            // A short step has the pressure of its middle.
            for after in [0.1, 0.9, 1.5] {
                let time = wave.arrival + after * wave.duration;
                let [mean, instant] = [[time - 1e-5, time + 1e-5], [time; 2]]
                    .map(|times| charge(burst, true).pressure([0.0; 3], normal, times));
                assert!((mean / instant - 1.0).abs() < 1e-6, "{after}: {mean} {instant}");
            }
        }
    }
}
