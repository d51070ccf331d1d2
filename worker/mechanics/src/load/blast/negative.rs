//! The pressure below that of the air which follows the positive phase of a wave.
//!
//! Peak and impulse of a face that reflects straight back are fits to the charts of UFC 3-340-02, figures 2-8 (a sphere in free air) and
//! 2-16 (a hemisphere on the ground), by S. E. Rigby, A. Tyas, T. Bennett, S. D. Clarke, S. D. Fay, The negative phase of the blast load,
//! International Journal of Protective Structures 5 (2014) 1-19. Those of the hemisphere are published there, up to 37.6 m/kg^(1/3) (read from
//! a program that has them, not from the paper); those of
//! the sphere are of Rigby's program Blast.m, as A. W. Q. R. Reis transcribed it (DYNAblast, 2019). Near a charge
//! the peak is a bound of the charts, 100 kPa. The pressure is Granstrom's cubic
//! `-p (27/4) s (1 - s)^2`, s the time since the end of the positive phase over a duration which gives it its impulse,
//! `16/9 i / p`: it starts from nothing, is lowest at a third and ends.
//!
//! The incident wave has half of both and the same duration, which is the law of sound: so weak a wave is doubled where it reflects. In free air this is
//! within 11 % of Brode's 35 kPa / Z from 1.6 to 40 m/kg^(1/3) (P. D. Smith, J. G. Hetherington, Blast and ballistic loading of structures, 1994);
//! nearer it is a guess, of at most 50 kPa.

use super::Burst;
use crate::lanes::{functions::exp, scalar::Scalar};

/// A fit over scaled distances.
#[derive(Clone, Copy)]
enum Fit {
    /// By powers 0, 1, 2 of the scaled distance.
    Square([f64; 3]),
    /// A factor and the power.
    Power(f64, f64),
}

impl Fit {
    fn at(self, scaled: f64, log: f64) -> f64 {
        match self {
            Self::Square([c, b, a]) => a.mul_add(scaled, b).mul_add(scaled, c),
            Self::Power(factor, power) => factor * exp(Scalar(power * log)).0,
        }
    }
}

/// Fits, each to a scaled distance.
type Fits = [(f64, Fit); 4];

/// Reflected peaks (kPa).
const AIR_PEAKS: Fits = [
    (0.7, Fit::Square([100.0, 0.0, 0.0])),
    (1.469, Fit::Square([114.0, 0.0352, -29.078])),
    (2.754, Fit::Power(84.132, -1.286)),
    (f64::INFINITY, Fit::Power(59.559, -0.945)),
];
const SURFACE_PEAKS: Fits = [
    (0.669, Fit::Square([100.0, 0.0, 0.0])),
    (1.27, Fit::Square([106.0, 13.0, -32.91])),
    (2.78, Fit::Power(93.0, -1.215)),
    (f64::INFINITY, Fit::Power(72.99, -0.978)),
];
/// Reflected impulses (kPa ms/kg^(1/3)).
const AIR_IMPULSES: Fits = [
    (0.304, Fit::Square([496.0, 0.0, 0.0])),
    (1.44, Fit::Square([583.0, -298.72, 36.919])),
    (5.25, Fit::Power(316.36, -0.879)),
    (f64::INFINITY, Fit::Power(316.36, -0.879)),
];
const SURFACE_IMPULSES: Fits = [
    (0.58, Fit::Square([553.0, 445.34, -724.37])),
    (1.19, Fit::Square([752.0, -314.76, 11.356])),
    (5.25, Fit::Power(461.8, -0.88)),
    (f64::INFINITY, Fit::Power(433.6, -0.842)),
];

/// The negative phase of a wave at a distance, in kPa and ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Negative {
    /// How far the reflected pressure falls below that of the air.
    pub peak: f64,
    pub duration: f64,
}

impl Negative {
    /// At a scaled distance and its natural logarithm, of a charge with this cube root of its mass in kg.
    pub(super) fn at(burst: Burst, (scaled, log): (f64, f64), root: f64) -> Self {
        let (peaks, impulses) = match burst {
            Burst::Air => (&AIR_PEAKS, &AIR_IMPULSES),
            Burst::Surface => (&SURFACE_PEAKS, &SURFACE_IMPULSES),
        };
        let [peak, impulse] = [peaks, impulses].map(|fits| {
            let [first, others @ ..] = fits;
            let (_, fit) =
                others.iter().fold(first, |found, next| if scaled <= found.0 { found } else { next });
            fit.at(scaled, log)
        });
        Self { peak, duration: root * (16.0 / 9.0) * impulse / peak }
    }

    /// Impulses of the incident and of the reflected wave, above 0.
    pub fn impulses(&self) -> [f64; 2] {
        let reflected = 9.0 / 16.0 * self.peak * self.duration;
        [0.5 * reflected, reflected]
    }

    /// Impulses of both, above 0, up to a time after the end of the positive phase; none before it.
    pub(super) fn impulses_until(&self, since: f64) -> [f64; 2] {
        let s = (since / self.duration).clamp(0.0, 1.0);
        // 12 times the integral of s (1 - s)^2
        let share = s * s * s.mul_add(s.mul_add(3.0, -8.0), 6.0);
        self.impulses().map(|impulse| impulse * share)
    }

    /// Incident and reflected pressure at a time after the end of the positive phase: none above 0.
    pub(super) fn pressures(&self, since: f64) -> [f64; 2] {
        let s = since / self.duration;
        if s >= 1.0 {
            return [0.0; 2];
        }
        let reflected = -6.75 * self.peak * s * (1.0 - s) * (1.0 - s);
        [0.5 * reflected, reflected]
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Wave, *};

    /// Scaled distances from the nearest to the farthest that are known.
    fn distances(burst: Burst) -> impl Iterator<Item = f64> {
        (0..=400).map(move |i| burst.nearest() * (40.0 / burst.nearest()).powf(f64::from(i) / 400.0))
    }

    #[test]
    fn fits_meet_fall_with_the_distance_and_never_reach_the_pressure_of_the_air() {
        for burst in [Burst::Air, Burst::Surface] {
            let all = match burst {
                Burst::Air => [AIR_PEAKS, AIR_IMPULSES],
                Burst::Surface => [SURFACE_PEAKS, SURFACE_IMPULSES],
            };
            for seam in all.iter().flat_map(|fits| fits[..3].iter().map(|(to, _)| *to)) {
                let [near, far] = [seam, seam * (1.0 + 1e-12)].map(|z| Negative::at(burst, (z, z.ln()), 1.0));
                let pairs = [(near.peak, far.peak), (near.impulses()[1], far.impulses()[1])];
                assert!(pairs.iter().all(|(a, b)| (a / b - 1.0).abs() < 0.011), "{seam}: {near:?} {far:?}");
            }
            let mut last = f64::MAX;
            for z in distances(burst) {
                let wave = Wave::at(burst, z, 1.0);
                let Negative { peak, duration } = wave.negative;
                assert!(peak > 0.0 && peak <= 100.0 && peak <= last * 1.003, "{z}: {peak}");
                assert!((6.5..18.0).contains(&duration) && duration > wave.duration, "{z}: {wave:?}");
                assert!(peak < wave.peaks[1], "{z}: {wave:?}");
                last = peak;
            }
        }
    }

    #[test]
    fn the_incident_wave_is_that_of_brode() {
        for z in distances(Burst::Air).filter(|z| *z >= 1.6) {
            let found = 0.5 * Wave::at(Burst::Air, z, 1.0).negative.peak;
            assert!((found * z / 35.0 - 1.0).abs() < 0.11, "{z}: {found}");
        }
    }

    #[test]
    fn a_wave_falls_through_nothing_to_its_lowest_and_ends_with_its_impulse() {
        for burst in [Burst::Air, Burst::Surface] {
            for z in distances(burst).step_by(10) {
                let wave = Wave::at(burst, z, 2.0);
                let (n, negative) = (4000, wave.negative);
                let at = |s: f64| wave.pressures(wave.duration + s * negative.duration);
                let sum: f64 = (0..n).map(|k| at((f64::from(k) + 0.5) / f64::from(n))[1]).sum();
                let impulse = -sum / f64::from(n) * negative.duration;
                assert!((impulse / negative.impulses()[1] - 1.0).abs() < 1e-6, "{z}: {impulse}");
                let lowest = at(1.0 / 3.0);
                assert!((lowest[1] / negative.peak + 1.0).abs() < 1e-12 && lowest[0] == 0.5 * lowest[1]);
                assert!((0..n).all(|k| at(f64::from(k) / f64::from(n))[1] >= lowest[1] * (1.0 + 1e-12)));
                assert_eq!((at(1.000_001), at(100.0)), ([0.0; 2], [0.0; 2]));
                let seam = [1.0 - 1e-9, 1.0, 1.0 + 1e-9].map(|s| wave.pressures(s * wave.duration));
                let small = 1e-6 * wave.peaks[1];
                assert!(seam.iter().flatten().all(|p| p.abs() < small), "{z}: {seam:?}");
            }
        }
    }

    /// Far from a charge nearly nothing of the impulse of a wave stays: a sphere of sound carries none.
    #[test]
    fn what_stays_of_the_impulse_far_from_a_charge_is_small() {
        // kPa ms/kg^(1/3): from the charts' fits and the polynomials by hand.
        let air = [[2.18, 6.44], [0.23, -2.09], [-0.61, -3.55], [-0.87, -3.22]];
        let surface = [[3.24, 13.53], [-0.18, -3.06], [-1.54, -6.13], [-1.79, -5.60]];
        for (burst, wanted) in [(Burst::Air, air), (Burst::Surface, surface)] {
            for (z, wanted) in [5.0, 10.0, 20.0, 39.0].into_iter().zip(wanted) {
                let wave = Wave::at(burst, z, 1.0);
                let below = wave.negative.impulses();
                for i in 0..2 {
                    let net = wave.impulses[i] - below[i];
                    assert!((net - wanted[i]).abs() < 0.01, "{burst:?} {z} {i}: {net}, {}", wanted[i]);
                    assert!(net.abs() < 0.4 * wave.impulses[i], "{burst:?} {z} {i}: {net} {wave:?}");
                }
                assert!(wave.negative.peak < 0.6 * wave.peaks[1], "{wave:?}");
            }
        }
    }
}
