//! Scatter of strength: each element of a part fails at a limit of its own, drawn once at the start.
//!
//! Solids break where flaws are, so equal elements break at unequal loads; without that a ring that expands evenly would break everywhere at
//! once. Weibull (J. Appl. Mech. 18, 1951, 293): of elements of the volume V the part `1 - 2^(-(V/V0) f^m)` breaks below `f` times the limit of the
//! law, so half of those of the volume V0 break below the limit itself. A small element holds a bad flaw less often and is stronger.
//!
//! The factor is kept as the damage that an element starts with, `1 - f`: negative in one that is stronger than the law says. Damage that
//! grows to 1 so comes there at f times the plastic strain or work, and a limit of stress is `1 - damage` times that of the law.

use serde::{Deserialize, Serialize};

use crate::{draw, material::Failure};

/// How the elements of a part differ in strength.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scatter {
    /// Index of the part.
    pub part: u32,
    /// Weibull's modulus m: the greater, the more alike are the elements.
    pub modulus: f64,
    /// The volume V0 of whose elements half are weaker than the law says (volume); none for the volume of each element.
    pub volume: Option<f64>,
    /// Of the draw. Another one is another sample of the same solid.
    pub seed: u64,
}

impl Scatter {
    /// Whether a failure law can have it: one whose damage grows from its start, or a limit of stress.
    pub const fn fits(failure: &Failure) -> bool {
        match failure {
            Failure::PrincipalStress { .. }
            | Failure::JohnsonCook { .. }
            | Failure::CockcroftLatham { .. } => true,
            Failure::None | Failure::PlasticStrain { .. } | Failure::Hydrostatic { .. } => false,
        }
    }

    /// The factor on the limit of an element of this number and volume.
    pub fn factor(&self, number: u32, volume: f64) -> f64 {
        /// `2^-53`.
        const STEP: f64 = 1.0 / 9_007_199_254_740_992.0;
        // Above 0 and below 1: the middle of an interval.
        let share = (draw::of_place(self.seed, u64::from(number)) as f64 + 0.5) * STEP;
        let flaws = self.volume.map_or(1.0, |reference| volume / reference);
        libm::pow(-libm::log2(share) / flaws, 1.0 / self.modulus)
    }

    /// The damage that the element starts with.
    pub fn damage(&self, number: u32, volume: f64) -> f64 {
        1.0 - self.factor(number, volume)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factors(scatter: &Scatter, volume: f64) -> Vec<f64> {
        let mut factors: Vec<f64> = (1..=20_000).map(|number| scatter.factor(number, volume)).collect();
        factors.sort_by(f64::total_cmp);
        factors
    }

    #[test]
    fn factors_are_distributed_as_weibull_says() {
        let scatter = Scatter { part: 0, modulus: 8.0, volume: None, seed: 3 };
        let factors = factors(&scatter, 2.0);
        for share in [0.01, 0.1, 0.5, 0.9, 0.99] {
            let factor = libm::pow(-libm::log2(1.0 - share), 1.0 / 8.0);
            let below = factors.partition_point(|found| *found < factor) as f64 / 20_000.0;
            // Four standard deviations of so many draws.
            let apart = 4.0 * (share * (1.0 - share) / 20_000.0_f64).sqrt();
            assert!((below - share).abs() < apart, "{share}: {below}");
        }
    }

    #[test]
    fn a_large_element_is_as_weak_as_the_weakest_of_the_small_ones_in_its_place() {
        let scatter = Scatter { part: 0, modulus: 8.0, volume: Some(1.0), seed: 3 };
        let (small, large) = (factors(&scatter, 1.0), factors(&scatter, 16.0));
        let ratio = small[10_000] / large[10_000];
        assert!((ratio - libm::pow(16.0, 1.0 / 8.0)).abs() < 1e-12, "{ratio}");
        assert!((small[10_000] - 1.0).abs() < 0.005);
    }

    #[test]
    fn another_seed_is_another_draw_and_the_same_one_is_the_same() {
        let of = |seed| {
            let scatter = Scatter { part: 0, modulus: 20.0, volume: None, seed };
            [1, 2, 3].map(|number| scatter.factor(number, 1.0))
        };
        assert_eq!(of(7), of(7));
        assert!(of(7).iter().zip(of(8)).all(|(a, b)| *a != b));
        let [a, b, c] = of(7);
        assert!(a != b && b != c && a != c);
    }
}
