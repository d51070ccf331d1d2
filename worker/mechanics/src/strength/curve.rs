//! Curves of straight lines that a law is given: how a material holds one, and how lanes read it.

use serde::{Deserialize, Serialize};

use crate::lanes::Lane;

/// Most points of a [`Hardening`].
pub const MAX_HARDENING: usize = 10;

/// Stress at growing strains: the yield stress by plastic strain, or what another law reads from its curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hardening {
    /// Points in use, 1 to [`MAX_HARDENING`].
    pub n_points: u32,
    /// Strain: the first is 0, the others ascend.
    pub strain: [f64; MAX_HARDENING],
    /// Stress there, not negative and not descending, the last positive; yield stresses are all positive.
    pub stress: [f64; MAX_HARDENING],
}

impl Hardening {
    /// One point, no stress: stands where the points are still to come.
    pub const NONE: Self = Self { n_points: 1, strain: [0.0; MAX_HARDENING], stress: [0.0; MAX_HARDENING] };

    /// Through these points.
    ///
    /// # Panics
    /// If there are none, or more than [`MAX_HARDENING`].
    pub fn through(points: &[[f64; 2]]) -> Self {
        assert!((1..=MAX_HARDENING).contains(&points.len()), "{} points", points.len());
        let mut curve = Self { n_points: points.len() as u32, ..Self::NONE };
        for (i, [strain, stress]) in points.iter().enumerate() {
            (curve.strain[i], curve.stress[i]) = (*strain, *stress);
        }
        curve
    }

    /// The points in use.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..(self.n_points as usize).clamp(1, MAX_HARDENING)).map(|i| [self.strain[i], self.stress[i]])
    }

    /// The steepest of its lines (stress).
    pub fn steepest(&self) -> f64 {
        let points: Vec<[f64; 2]> = self.points().collect();
        points.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).fold(0.0, f64::max)
    }
}

/// A curve made ready for lanes.
#[derive(Clone, Copy)]
pub(super) struct Curve {
    n_points: usize,
    /// Strain, stress, the slope behind and the area before, by point.
    points: [[f64; 4]; MAX_HARDENING],
}

impl Curve {
    pub fn new(curve: &Hardening) -> Self {
        let n_points = (curve.n_points as usize).clamp(1, MAX_HARDENING);
        let Hardening { strain, stress, .. } = curve;
        let mut points = [[0.0; 4]; MAX_HARDENING];
        let mut area = 0.0;
        for i in 0..n_points {
            let mut slope = 0.0;
            let before = area;
            if i + 1 < n_points {
                let width = strain[i + 1] - strain[i];
                slope = (stress[i + 1] - stress[i]) / width;
                area += 0.5 * (stress[i + 1] + stress[i]) * width;
            }
            points[i] = [strain[i], stress[i], slope, before];
        }
        if n_points > 1 {
            points[n_points - 1][2] = points[n_points - 2][2];
        }
        Self { n_points, points }
    }

    /// Stress, slope and the area from 0 on, at a strain of 0 or more; beyond the last point the last line goes on, because what is compacted
    /// grows no softer.
    #[inline(always)]
    pub fn at<L: Lane>(&self, strain: L) -> [L; 3] {
        let (mut stress, mut slope, mut area) = (L::splat(self.points[0][1]), L::splat(0.0), L::splat(0.0));
        let mut point = 0;
        while point < self.n_points {
            let [at, here, next, before] = self.points[point].map(L::splat);
            let beyond = at.less_equal(strain);
            let past = strain - at;
            let rise = next * past;
            stress = L::select(beyond, here + rise, stress);
            slope = L::select(beyond, next, slope);
            area = L::select(beyond, L::splat(0.5).mul_add(rise, here).mul_add(past, before), area);
            point += 1;
        }
        [stress, slope, area]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    #[test]
    fn a_curve_has_stress_slope_and_area_of_its_lines() {
        let hardening = Hardening::through(&[[0.0, 2.0], [0.5, 3.0], [0.75, 11.0]]);
        let curve = Curve::new(&hardening);
        for (strain, wanted) in [
            (0.0, [2.0, 2.0, 0.0]),
            (0.25, [2.5, 2.0, 0.5625]),
            (0.5, [3.0, 32.0, 1.25]),
            (0.625, [7.0, 32.0, 1.875]),
            (1.0, [19.0, 32.0, 3.0 + 3.75]),
        ] {
            assert_eq!(curve.at(Scalar(strain)).map(|x| x.0), wanted, "{strain}");
        }
        assert_eq!(hardening.steepest(), 32.0);
    }
}
