//! Limits of stress, volume and shape, and the lanes that have come to one of them.
//!
//! A limit that the deck does not give is infinite: no element comes to it.

use std::f64::consts::SQRT_2;

use super::criteria::Criteria;
use crate::{
    element::{vector::Tensor, viscosity::Spread},
    failure::principal_stress,
    lanes::{
        Lane,
        functions::{exp, ln},
        scalar::Scalar,
    },
    strength::Deviator,
};

/// Limits of the stress at the end of a cycle (stress); none where no criterion goes by it.
#[derive(Clone, Copy)]
pub(super) struct Stress {
    pressure: f64,
    tension: f64,
    principal: Option<f64>,
    /// Two thirds of the square of the von Mises stress: what `s:s` comes to.
    square: f64,
}

impl Stress {
    pub(super) fn of(criteria: &Criteria) -> Option<Self> {
        let Criteria { pressure, tension, principal_stress: principal, von_mises, .. } = *criteria;
        [pressure, tension, principal, von_mises].iter().any(Option::is_some).then(|| Self {
            pressure: pressure.unwrap_or(f64::INFINITY),
            tension: tension.unwrap_or(f64::INFINITY),
            principal,
            square: von_mises.map_or(f64::INFINITY, |y| 2.0 / 3.0 * (y * y)),
        })
    }

    /// Bits of the lanes that a deviator and a pressure have brought to a limit.
    #[inline(always)]
    pub(super) fn met<L: Lane>(&self, s: &Deviator<L>, pressure: L) -> u32 {
        let mut bits = L::bits(L::splat(self.pressure).less_equal(pressure))
            | L::bits(L::splat(self.tension).less_equal(-pressure))
            | L::bits(L::splat(self.square).less_equal(s.contract(s)));
        if let Some(limit) = self.principal {
            bits |= !L::bits(principal_stress::below(s, pressure, L::splat(limit)));
        }
        bits
    }
}

/// Limits of the logarithm of the volume over the initial one; none where no criterion goes by it.
#[derive(Clone, Copy)]
pub(super) struct Volume {
    expansion: f64,
    compaction: f64,
}

impl Volume {
    pub(super) fn of(criteria: &Criteria) -> Option<Self> {
        let Criteria { expansion, compaction, .. } = *criteria;
        (expansion.is_some() || compaction.is_some()).then(|| Self {
            expansion: expansion.unwrap_or(f64::INFINITY),
            compaction: compaction.unwrap_or(f64::INFINITY),
        })
    }

    /// Bits of the lanes whose volume over the initial one has come to a limit.
    #[inline(always)]
    pub(super) fn met<L: Lane>(&self, relative: L) -> u32 {
        let strain = ln(relative.max(L::splat(f64::MIN_POSITIVE)));
        L::bits(L::splat(self.expansion).less_equal(strain))
            | L::bits(L::splat(self.compaction).less_equal(-strain))
    }
}

/// Limits of the logarithmic strain h from the initial shape to that of now, with principal values `h1 >= h2 >= h3`; none
/// where no criterion goes by it.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Of `sqrt(2/3 h:h)`.
    effective: f64,
    /// Of `(h1 - h3) / 2`.
    shear: f64,
    longest: f64,
    /// Of `-h3`.
    shortest: f64,
    /// Squared stretch, and its inverse, below which all principal ones are where no limit can have been met.
    safe: f64,
}

impl Shape {
    pub(super) fn of(criteria: &Criteria) -> Option<Self> {
        let given = [
            criteria.geometric_strain,
            criteria.shear_strain,
            criteria.principal_strain,
            criteria.compressive_strain,
        ];
        let [effective, shear, longest, shortest] = given.map(|limit| limit.unwrap_or(f64::INFINITY));
        // sqrt(2/3 h:h) is at most sqrt(2) times the greatest magnitude of h, the others are at most that.
        let magnitude = (effective / SQRT_2).min(shear).min(longest).min(shortest);
        let safe = exp(Scalar(2.0 * magnitude)).0;
        given.iter().any(Option::is_some).then_some(Self { effective, shear, longest, shortest, safe })
    }

    /// Lanes whose deformation gradient F turns the element inside out or strains it to a limit or more.
    ///
    /// No stretch is above `sqrt(tr C)`, `C = F^T F`, nor below `det F / sqrt(tr cof C)`; most elements are far below the
    /// limits by these bounds.
    #[inline(always)]
    pub(super) fn met<L: Lane>(&self, f: &Tensor<L>) -> L::Mask {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let cofactor = [f.y.cross(&f.z), f.z.cross(&f.x), f.x.cross(&f.y)];
        let determinant = f.x.dot(&cofactor[0]);
        let square = determinant * determinant;
        let stretch = Spread::gram([&f.x, &f.y, &f.z]);
        let shrink = Spread::gram([&cofactor[0], &cofactor[1], &cofactor[2]]);
        let most = L::splat(self.safe);
        let within = L::both(stretch.trace().less(most), shrink.trace().less(most * square));
        let upright = zero.less(determinant);
        let whole = L::both(within, upright);
        if !L::any(not::<L>(whole)) {
            return L::mask(0);
        }
        // Of those that are inside out the logarithms mean nothing.
        let largest = L::select(upright, stretch.largest_eigenvalue(), one);
        let two_largest = L::select(upright, shrink.largest_eigenvalue(), one);
        let logarithm = |eigenvalue: L| ln(eigenvalue.max(L::splat(f64::MIN_POSITIVE)));
        let (of_square, of_largest, of_two) =
            (logarithm(L::select(upright, square, one)), logarithm(largest), logarithm(two_largest));
        // Logarithms of squared stretches are twice the strains.
        let (first, second, third) = (of_largest, of_two - of_largest, of_square - of_two);
        let sum = first.mul_add(first, second.mul_add(second, third * third));
        let bits = L::bits(L::splat(self.effective * self.effective).less_equal(L::splat(1.0 / 6.0) * sum))
            | L::bits(L::splat(self.shear).less_equal(L::splat(0.25) * (first - third)))
            | L::bits(L::splat(self.longest).less_equal(L::splat(0.5) * first))
            | L::bits(L::splat(self.shortest).less_equal(L::splat(-0.5) * third));
        L::mask(bits | !L::bits(upright))
    }
}

/// The lanes that a mask leaves out.
#[inline(always)]
fn not<L: Lane>(mask: L::Mask) -> L::Mask {
    L::mask(!L::bits(mask) & ((1 << L::N) - 1))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::*;
    use crate::element::vector::Vector;

    fn draws() -> impl FnMut() -> f64 {
        let mut seed = 0x1234_5678_9abc_def1_u64;
        move || {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            seed as f64 / u64::MAX as f64 - 0.5
        }
    }

    /// Whether a deformation gradient, by rows, meets a criterion of shape.
    fn erodes(f: [[f64; 3]; 3], criteria: Criteria) -> bool {
        let [x, y, z] = f.map(|[x, y, z]| Vector { x: Scalar(x), y: Scalar(y), z: Scalar(z) });
        let shape = Shape::of(&criteria).expect("a limit of shape");
        Scalar::bits(shape.met(&Tensor { x, y, z })) & 1 == 1
    }

    fn effective(limit: f64) -> Criteria {
        Criteria { geometric_strain: Some(limit), ..Criteria::default() }
    }

    #[test]
    fn a_bar_drawn_out_at_constant_volume_has_the_logarithm_of_its_length_as_strain() {
        for length in [0.2_f64, 0.5, 1.5, 4.0, 20.0] {
            let thin = 1.0 / length.sqrt();
            let f = [[length, 0.0, 0.0], [0.0, thin, 0.0], [0.0, 0.0, thin]];
            let strain = length.ln().abs();
            assert!(erodes(f, effective(strain * (1.0 - 1e-9))), "{length}");
            assert!(!erodes(f, effective(strain * (1.0 + 1e-9))), "{length}");
        }
    }

    #[test]
    fn strains_are_those_of_the_singular_values_and_turning_adds_none() {
        let mut draw = draws();
        for _ in 0..500 {
            let m = Matrix3::from_fn(|r, c| f64::from(u8::from(r == c)) + 1.2 * draw());
            let rows = [0, 1, 2].map(|r| [m[(r, 0)], m[(r, 1)], m[(r, 2)]]);
            if m.determinant() <= 0.0 {
                assert!(erodes(rows, effective(50.0)), "an element inside out erodes at any limit");
                continue;
            }
            let h = m.singular_values().map(f64::ln);
            let limit = |which: usize, x: f64| {
                let mut given = [None; 4];
                given[which] = Some(x);
                let [geometric_strain, shear_strain, principal_strain, compressive_strain] = given;
                Criteria {
                    geometric_strain,
                    shear_strain,
                    principal_strain,
                    compressive_strain,
                    ..Criteria::default()
                }
            };
            let strains =
                [(2.0 / 3.0 * h.norm_squared()).sqrt(), 0.5 * (h.max() - h.min()), h.max(), -h.min()];
            for (which, strain) in strains.into_iter().enumerate() {
                if strain < 1e-3 {
                    assert!(!erodes(rows, limit(which, 2e-3)), "{which} {strain}: {m}");
                    continue;
                }
                assert!(erodes(rows, limit(which, strain * (1.0 - 1e-6))), "{which} {strain}: {m}");
                assert!(!erodes(rows, limit(which, strain * (1.0 + 1e-6))), "{which} {strain}: {m}");
            }
        }
    }

    #[test]
    fn limits_of_stress_are_met_by_pressure_mean_principal_and_von_mises_stress() {
        let mut draw = draws();
        for round in 0..300 {
            let turn = Rotation3::from_euler_angles(draw() * 6.0, draw() * 6.0, draw() * 6.0);
            let principal = Vector3::from_fn(|_, _| 1e9 * draw());
            let sigma = turn * Matrix3::from_diagonal(&principal) * turn.transpose();
            let p = -sigma.trace() / 3.0;
            let s = Deviator {
                xx: Scalar(sigma.m11 + p),
                yy: Scalar(sigma.m22 + p),
                zz: Scalar(sigma.m33 + p),
                xy: Scalar(sigma.m12),
                yz: Scalar(sigma.m23),
                zx: Scalar(sigma.m31),
            };
            let mises = (1.5 * (principal.add_scalar(p)).norm_squared()).sqrt();
            for (which, value) in [p, -p, principal.max(), mises].into_iter().enumerate() {
                let met = |limit: f64| {
                    let mut given = [None; 4];
                    given[which] = Some(limit);
                    let [pressure, tension, principal_stress, von_mises] = given;
                    let criteria =
                        Criteria { pressure, tension, principal_stress, von_mises, ..Criteria::default() };
                    let limits = Stress::of(&criteria).expect("a limit of stress");
                    limits.met(&s, Scalar(p)) & 1 == 1
                };
                if value < 1e6 {
                    assert!(!met(2e6), "{round} {which} {value}");
                } else {
                    assert!(met(value * (1.0 - 1e-6)), "{round} {which} {value}");
                    assert!(!met(value * (1.0 + 1e-6)), "{round} {which} {value}");
                }
            }
        }
        assert!(Stress::of(&effective(1.0)).is_none());
    }

    #[test]
    fn limits_of_volume_are_logarithms_in_both_directions() {
        let grown = Criteria { expansion: Some(0.1), ..Criteria::default() };
        let crushed = Criteria { compaction: Some(0.1), ..Criteria::default() };
        let met = |criteria: &Criteria, relative: f64| {
            Volume::of(criteria).expect("a limit of volume").met(Scalar(relative)) & 1 == 1
        };
        let (up, down) = (0.1f64.exp(), (-0.1f64).exp());
        assert!(met(&grown, up * 1.000_001) && !met(&grown, up * 0.999_999) && !met(&grown, down * 0.9));
        assert!(
            met(&crushed, down * 0.999_999) && !met(&crushed, down * 1.000_001) && !met(&crushed, up * 1.1)
        );
    }
}
