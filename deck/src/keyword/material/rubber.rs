//! `*MAT_` of rubber and of what relaxes.

use mechanics::{
    material::{Eos, Failure, Strength},
    strength::{MooneyRivlin, Ogden, Viscoelastic},
};

use super::{Law, not_negative};
use crate::keyword::fields::Fields;

/// Pairs of Ogden's law that a material may have.
const PAIRS: usize = 3;

/// The law with the bulk modulus of a Poisson's ratio in field `i`.
fn nearly_incompressible(strength: Strength, shear: f64, f: &Fields<'_>, i: usize) -> Option<Law> {
    let poisson = f.real(i, 0.0);
    if !(0.0 < poisson && poisson < 0.5) {
        f.fault(i, "Poisson's ratio above 0 and below 0.5", "give 0.49 to 0.4999 of rubber");
        return None;
    }
    let bulk = 2.0 * shear * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson));
    let (eos, failure) = (Eos::Linear { bulk }, Failure::None);
    Some(Law::Whole { strength, eos, failure, given: "Poisson's ratio" })
}

/// A field that asks for more than the constants of the card.
fn refuse(f: &Fields<'_>, i: usize, expected: &str, advice: &str) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, expected, advice);
    }
}

/// `*MAT_MOONEY-RIVLIN_RUBBER`.
pub(super) fn mooney_rivlin(f: &[Fields<'_>; 8]) -> Option<Law> {
    refuse(&f[0], 5, "a geometry at the start without stress", "leave REF blank");
    refuse(&f[1], 3, "constants A and B", "fit the curve and give them");
    let (a, b) = (f[0].positive(3, "A")?, not_negative(&f[0], 4));
    nearly_incompressible(Strength::MooneyRivlin(MooneyRivlin { a, b }), 2.0 * (a + b), &f[0], 2)
}

/// `*MAT_OGDEN_RUBBER`: pairs on the second and third cards.
pub(super) fn ogden(f: &[Fields<'_>; 8]) -> Option<Law> {
    refuse(&f[0], 3, "constants MU and ALPHA", "fit the curve and give them");
    refuse(&f[0], 4, "no relaxation", "leave NV blank");
    refuse(&f[0], 5, "no frequency-independent damping", "leave G blank");
    refuse(&f[0], 7, "a geometry at the start without stress", "leave REF blank");
    refuse(&f[3], 0, "no relaxation", "leave out the cards with GI and BETAI");
    let mut pairs: Vec<[f64; 2]> = Vec::new();
    for i in 0..8 {
        let pair = [f[1].real(i, 0.0), f[2].real(i, 0.0)];
        if pair[0] != 0.0 {
            pairs.push(pair);
        }
        if pairs.len() > PAIRS {
            f[1].fault(i, format!("at most {PAIRS} pairs of MU and ALPHA"), "fit fewer");
            return None;
        }
    }
    pairs.resize(PAIRS, [0.0, 1.0]);
    let [[mu1, alpha1], [mu2, alpha2], [mu3, alpha3]] = [pairs[0], pairs[1], pairs[2]];
    let strength = Strength::Ogden(Ogden { mu1, alpha1, mu2, alpha2, mu3, alpha3 });
    if let Some(expected) = strength.fault() {
        f[1].fault(0, expected, "correct MU or ALPHA");
        return None;
    }
    let shear = 0.5 * pairs.iter().map(|[mu, alpha]| mu * alpha).sum::<f64>();
    nearly_incompressible(strength, shear, &f[0], 2)
}

/// `*MAT_VISCOELASTIC`.
pub(super) fn viscoelastic(f: &[Fields<'_>; 8]) -> Option<Law> {
    let (bulk, shear) = (f[0].positive(2, "a bulk modulus"), f[0].positive(3, "G0"));
    let (long_shear, decay) = (not_negative(&f[0], 4), not_negative(&f[0], 5));
    let strength = Strength::Viscoelastic(Viscoelastic { shear: shear?, long_shear, decay });
    if strength.fault().is_some() {
        f[0].fault(4, "a GI that is not above G0", "correct one of them");
        return None;
    }
    Some(Law::Whole { strength, eos: Eos::Linear { bulk: bulk? }, failure: Failure::None, given: "BULK" })
}
