//! `*MAT_` of what has axes: composites and honeycomb.

use mechanics::{
    material::{Eos, Failure, Hardening, Strength},
    strength::{Honeycomb, Orthotropic},
};

use super::{Law, not_negative};
use crate::{keyword::fields::Fields, log::Log, table::Range};

/// Strengths that a card leaves out.
const UNLIMITED: f64 = 1e30;
/// AOPT of axes by two vectors.
const GLOBAL: f64 = 2.0;

fn refuse(f: &Fields<'_>, i: usize, expected: &str, advice: &str) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, expected, advice);
    }
}

/// The vectors a and d, from the fields of AOPT, A1 and D1.
fn axes(f: &[Fields<'_>; 8], option: (usize, usize), a: (usize, usize), d: (usize, usize)) -> [[f64; 3]; 2] {
    if f[option.0].real(option.1, 0.0) != GLOBAL {
        let expected = "AOPT 2: axes by the vectors A and D, the same for each element";
        f[option.0].fault(
            option.1,
            expected,
            "give AOPT 2, A1 to A3 and D1 to D3, and a part for each direction",
        );
    }
    [a, d].map(|(card, first)| [0, 1, 2].map(|k| f[card].real(first + k, 0.0)))
}

/// The law of a card, told where its constants are not one.
fn checked(f: &Fields<'_>, law: Strength) -> Option<Law> {
    if let Some(expected) = law.fault() {
        f.fault(2, expected, "correct the constants");
        return None;
    }
    Some(Law::Whole {
        eos: Eos::Linear { bulk: law.bulk()? },
        strength: law,
        failure: Failure::None,
        given: "the moduli",
    })
}

/// Four cards of `*MAT_ORTHOTROPIC_ELASTIC`, five of `*MAT_COMPOSITE_DAMAGE`.
pub(super) fn orthotropic(f: &[Fields<'_>; 8], fails: bool) -> Option<Law> {
    let [young_a, young_b, young_c] =
        [(2, "EA"), (3, "EB"), (4, "EC")].map(|(i, what)| f[0].positive(i, what));
    let [modulus_ab, modulus_bc, modulus_ca] =
        [(0, "GAB"), (1, "GBC"), (2, "GCA")].map(|(i, what)| f[1].positive(i, what));
    let option = if fails { 4 } else { 3 };
    let [[ax, ay, az], [dx, dy, dz]] = axes(f, (1, option), (2, 3), (3, 3));
    refuse(&f[3], 6, "no angle BETA with AOPT 2", "turn A and D");
    let macf = if fails { f[1].real(5, 0.0) } else { f[2].real(6, 0.0) };
    if !matches!(macf, 0.0 | 1.0) {
        let (card, i) = if fails { (1, 5) } else { (2, 6) };
        f[card].fault(i, "axes in their order", "leave MACF blank and exchange the constants");
    }
    if fails {
        refuse(&f[1], 6, "axes that turn with the element", "leave ATRACK blank");
        refuse(&f[4], 4, "a shear stress in a line with its strain", "leave ALPH blank");
    } else {
        refuse(&f[1], 4, "no frequency damping", "leave G and SIGF blank");
        refuse(&f[1], 5, "no frequency damping", "leave G and SIGF blank");
        refuse(&f[3], 7, "a geometry at the start without stress", "leave REF blank");
    }
    let strength = |i: usize| match not_negative(&f[4], i) {
        strength if fails && strength > 0.0 => strength,
        _ => UNLIMITED,
    };
    let law = Orthotropic {
        young_a: young_a?,
        young_b: young_b?,
        young_c: young_c?,
        poisson_ba: f[0].real(5, 0.0),
        poisson_ca: f[0].real(6, 0.0),
        poisson_cb: f[0].real(7, 0.0),
        modulus_ab: modulus_ab?,
        modulus_bc: modulus_bc?,
        modulus_ca: modulus_ca?,
        ax,
        ay,
        az,
        dx,
        dy,
        dz,
        tension_a: strength(1),
        // The card has no strength of fibres in compression.
        compression_a: UNLIMITED,
        tension_b: strength(2),
        compression_b: strength(3),
        shear_ab: strength(0),
        tension_c: strength(5),
        shear_bc: strength(6),
        shear_ca: strength(7),
        failed_bulk: if fails { not_negative(&f[1], 3) } else { 0.0 },
    };
    checked(&f[0], Strength::Orthotropic(law))
}

/// Five cards of `*MAT_HONEYCOMB`.
pub(super) fn honeycomb(f: &[Fields<'_>; 8], log: &Log<'_>) -> Option<Law> {
    for (i, name) in [(6, "MU"), (7, "BULK")] {
        if f[0].real(i, 0.0) != 0.0 {
            log.warn(f[0].origin(i, name).at, format!("{name}: the viscosity is that of the deck here"));
        }
    }
    let curve = f[1].reference(0, "LCA");
    for i in 1..7 {
        let other = f[1].integer(i);
        if other != 0 && other != i64::from(curve.value) {
            let expected = "the curve of LCA for all stresses";
            f[1].fault(i, expected, "leave it blank, or take the law with factors in a TOML deck");
        }
    }
    refuse(&f[1], 7, "no factor of the rate", "leave LCSR blank");
    for (i, name) in [(3, "TSEF"), (4, "SSEF"), (5, "VREF"), (6, "TREF"), (7, "SHDFLG")] {
        let expected = format!("no {name}");
        refuse(&f[4], i, &expected, "leave it blank; erosion is a part's");
    }
    let [young, yield_stress] = [(2, "E"), (4, "SIGY")].map(|(i, what)| f[0].positive(i, what));
    let poisson = f[0].within(3, 0.0, Range::NotNegative);
    let solid_volume = f[0].positive(5, "VF");
    let [young_a, young_b, young_c, modulus_ab, modulus_bc, modulus_ca] =
        [(0, "EAAU"), (1, "EBBU"), (2, "ECCU"), (3, "GABU"), (4, "GBCU"), (5, "GCAU")]
            .map(|(i, what)| f[2].positive(i, what));
    let [[ax, ay, az], [dx, dy, dz]] = axes(f, (2, 6), (3, 3), (4, 0));
    let law = Honeycomb {
        young: young?,
        poisson,
        yield_stress: yield_stress?,
        solid_volume: solid_volume?,
        young_a: young_a?,
        young_b: young_b?,
        young_c: young_c?,
        modulus_ab: modulus_ab?,
        modulus_bc: modulus_bc?,
        modulus_ca: modulus_ca?,
        factor_b: 1.0,
        factor_c: 1.0,
        factor_ab: 1.0,
        factor_bc: 1.0,
        factor_ca: 1.0,
        ax,
        ay,
        az,
        dx,
        dy,
        dz,
    };
    let strength = Strength::Honeycomb(law, Hardening::NONE);
    checked(&f[0], strength)?;
    Some(Law::Curved { strength, curve, points: Vec::new() })
}
