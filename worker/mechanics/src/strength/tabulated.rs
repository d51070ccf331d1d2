//! Von Mises yield whose yield stress goes in straight lines from point to point of the plastic strain.
//!
//! Beyond the last point it is constant. The rate factor multiplies the whole table.

use super::{Deviator, History, RateFactor, Strain, StrengthLaw};
use crate::{
    lanes::{Lane, splat_each},
    material::{Hardening, MAX_HARDENING},
};

/// The table made ready.
#[derive(Clone, Copy)]
pub(crate) struct Tabulated {
    /// G (stress).
    pub shear: f64,
    n_points: usize,
    /// Plastic strain, yield stress and the slope behind, by point.
    points: [[f64; 3]; MAX_HARDENING],
    rate: RateFactor,
}

impl Tabulated {
    /// From the constants of a material.
    pub fn new(shear: f64, hardening: &Hardening, rate: RateFactor) -> Self {
        let n_points = (hardening.n_points as usize).clamp(1, MAX_HARDENING);
        let Hardening { strain, stress, .. } = hardening;
        let points = std::array::from_fn(|i| {
            let slope = if i + 1 < n_points {
                (stress[i + 1] - stress[i]) / (strain[i + 1] - strain[i])
            } else {
                0.0
            };
            [strain[i], stress[i], slope]
        });
        Self { shear, n_points, points, rate }
    }
}

impl StrengthLaw for Tabulated {
    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        let (mut stress, mut slope) = (L::splat(self.points[0][1]), L::splat(0.0));
        let mut point = 0;
        while point < self.n_points {
            let [at, here, next] = splat_each::<L, _>(&self.points[point]);
            let beyond = at.less_equal(strain);
            stress = L::select(beyond, next.mul_add(strain - at, here), stress);
            slope = L::select(beyond, next, slope);
            point += 1;
        }
        (stress * factor, slope * factor)
    }

    /// The first of the table, which never descends.
    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, _temperature: L) -> L {
        L::splat(self.points[0][1])
    }

    #[inline(always)]
    fn factor<L: Lane>(&self, rate: L, _temperature: L) -> L {
        self.rate.at(rate)
    }

    /// The implicit return `sigma - 3 G d = Y(e + d)` has its root on the last line whose first point still leaves
    /// stress above the table; on a line it is linear in d, hence exact.
    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let sigma_square = trial.mises_square();
        // The table never descends, and no factor is below 1. The margin is far above the roundings.
        let first = self.points[0][1];
        let low = sigma_square.less_equal(L::splat(first * first * (1.0 - 1e-9)));
        if L::bits(L::both(low, active)) == L::bits(active) {
            return trial;
        }
        let sigma = sigma_square.sqrt();
        let factor = self.rate.at(strain.rate);
        let three_g = L::splat(3.0 * self.shear);
        let before = history.plastic_strain;
        let [at, stress, slope] = splat_each::<L, _>(&self.points[0]);
        let (mut at, mut stress, mut slope) = (at, stress * factor, slope * factor);
        let mut point = 1;
        while point < self.n_points {
            let [next_at, next_stress, next_slope] = splat_each::<L, _>(&self.points[point]);
            let next_stress = next_stress * factor;
            let left = three_g.neg_mul_add(next_at - before, sigma);
            let beyond = next_stress.less(left);
            at = L::select(beyond, next_at, at);
            stress = L::select(beyond, next_stress, stress);
            slope = L::select(beyond, next_slope * factor, slope);
            point += 1;
        }
        let yield_stress = slope.mul_add(before - at, stress);
        let slip = ((sigma - yield_stress) / (three_g + slope)).max(zero);
        let yields = zero.less(slip);
        history.plastic_strain = before + slip;
        trial.scaled(L::select(yields, three_g.neg_mul_add(slip, sigma).max(zero) / sigma, one))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{lanes::scalar::Scalar, material::CowperSymonds};

    const SHEAR: f64 = 80e9;

    fn table(points: &[[f64; 2]], rate: Option<CowperSymonds>) -> Tabulated {
        let mut hardening = Hardening {
            n_points: points.len() as u32,
            strain: [0.0; MAX_HARDENING],
            stress: [0.0; MAX_HARDENING],
        };
        for (i, [strain, stress]) in points.iter().enumerate() {
            (hardening.strain[i], hardening.stress[i]) = (*strain, *stress);
        }
        Tabulated::new(SHEAR, &hardening, RateFactor::of(rate))
    }

    /// Von Mises stress and plastic strain after a step of pure shear to a trial of `sigma`.
    fn after(law: &Tabulated, sigma: f64, plastic_strain: f64, rate: f64) -> [f64; 2] {
        let mut trial = Deviator::<Scalar>::zero();
        trial.xy = Scalar(sigma / 3f64.sqrt());
        let mut history = History { plastic_strain: Scalar(plastic_strain), temperature: Scalar(0.0) };
        let strain = Strain { rate: Scalar(rate), increment: Scalar(1e-3) };
        let stress = law.update(trial, strain, &mut history, true);
        [(1.5 * stress.contract(&stress).0).sqrt(), history.plastic_strain.0]
    }

    #[test]
    fn a_return_ends_on_the_table_whatever_lines_it_crosses() {
        let points = [[0.0, 300e6], [0.01, 400e6], [0.05, 450e6], [0.2, 450e6], [0.4, 900e6]];
        let law = table(&points, None);
        let expected = |e: f64| {
            let last = points.iter().rposition(|p| p[0] <= e).expect("the first is 0");
            match points.get(last + 1) {
                None => points[last][1],
                Some(next) => {
                    let [e0, y0] = points[last];
                    y0 + (next[1] - y0) * (e - e0) / (next[0] - e0)
                }
            }
        };
        for before in [0.0, 0.004, 0.01, 0.03, 0.15, 0.39, 1.0] {
            for overshoot in [1e6, 1e8, 3e9, 2e10, 1.5e11] {
                let [stress, strain] = after(&law, expected(before) + overshoot, before, 0.0);
                assert!((stress / expected(strain) - 1.0).abs() < 1e-9, "{before} {overshoot}: {stress}");
                let slip = strain - before;
                assert!((slip * 3.0 * SHEAR / (expected(before) + overshoot - stress) - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_lane_inside_the_surface_comes_back_to_the_bit() {
        let law = table(&[[0.0, 300e6], [0.1, 500e6]], None);
        for (sigma, strain) in [(299e6, 0.0), (398e6, 0.05), (499e6, 0.5)] {
            let mut trial = Deviator::<Scalar>::zero();
            trial.xy = Scalar(sigma / 3f64.sqrt());
            let mut history = History { plastic_strain: Scalar(strain), temperature: Scalar(0.0) };
            let rate = Strain { rate: Scalar(10.0), increment: Scalar(1e-3) };
            let back = law.update(trial, rate, &mut history, true);
            assert_eq!(back.xy.0.to_bits(), trial.xy.0.to_bits());
            assert_eq!(history.plastic_strain.0.to_bits(), strain.to_bits());
        }
    }

    #[test]
    fn two_points_are_linear_hardening_and_the_rate_factor_multiplies_it() {
        let cowper_symonds = Some(CowperSymonds { reference: 40.4, exponent: 5.0 });
        for rate in [None, cowper_symonds] {
            let law = table(&[[0.0, 250e6], [10.0, 250e6 + 10.0 * 1e9]], rate);
            let line = crate::strength::VonMises {
                shear: SHEAR,
                yield_stress: 250e6,
                hardening: 1e9,
                rate: RateFactor::of(rate),
            };
            let mut trial = Deviator::<Scalar>::zero();
            trial.xy = Scalar(1e9);
            let mut history = History { plastic_strain: Scalar(0.1), temperature: Scalar(0.0) };
            let strain = Strain { rate: Scalar(500.0), increment: Scalar(1e-3) };
            let by_line = line.update(trial, strain, &mut history, true);
            let [stress, slipped] = after(&law, 1e9 * 3f64.sqrt(), 0.1, 500.0);
            assert!((slipped / history.plastic_strain.0 - 1.0).abs() < 1e-12);
            assert!((stress / (by_line.xy.0 * 3f64.sqrt()) - 1.0).abs() < 1e-12);
            let factor = if rate.is_some() { 1.0 + (500.0_f64 / 40.4).powf(0.2) } else { 1.0 };
            assert!((stress / (factor * (250e6 + 1e9 * slipped)) - 1.0).abs() < 1e-9);
        }
    }
}
