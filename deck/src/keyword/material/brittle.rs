//! `*MAT_` of what breaks: ceramics, glass, concrete.

use mechanics::{
    material::{Eos, Failure, Strength},
    strength::{HolmquistJohnsonCook, JohnsonHolmquist, RiedelHiermaierThoma},
};

use super::{Law, not_negative};
use crate::{
    keyword::{erosion::Limits, fields::Fields},
    log::Log,
    table::Range,
    typed::part::Criterion,
};

/// SFMAX where the card has none.
const UNLIMITED: f64 = 1e20;

/// Three cards of `*MAT_JOHNSON_HOLMQUIST_CERAMICS`.
pub(super) fn johnson_holmquist(f: &[Fields<'_>; 8], limits: &mut Limits) -> Option<Law> {
    let [shear, a, n] = [(2, "G"), (3, "A"), (7, "N")].map(|(i, what)| f[0].positive(i, what));
    let [b, c] = [4, 5].map(|i| not_negative(&f[0], i));
    // Without a fractured strength its exponent says nothing.
    let m = if b > 0.0 { f[0].positive(6, "M") } else { Some(1.0) };
    let [tension, hel, hel_pressure] =
        [(1, "T"), (3, "HEL"), (4, "PHEL")].map(|(i, what)| f[1].positive(i, what));
    let fractured_limit = Some(f[1].real(2, 0.0)).filter(|limit| *limit > 0.0).unwrap_or(UNLIMITED);
    let beta = f[1].within(5, 0.0, Range::Within(-f64::MIN_POSITIVE, 1.0, "a number from 0 to 1"));
    let (d1, d2) = (not_negative(&f[2], 0), f[2].positive(1, "D2"));
    let k1 = f[2].positive(2, "K1");
    let [k2, k3] = [3, 4].map(|i| f[2].real(i, 0.0));
    match f[2].real(5, 0.0) {
        fs if fs < 0.0 => f[2].fault(5, "no failure by the pressure", "leave FS blank"),
        _ => limits.read_failure_strain(&f[2], 5, "FS"),
    }
    let (hel, hel_pressure) = (hel?, hel_pressure?);
    if hel <= hel_pressure {
        f[1].fault(3, "a HEL above PHEL", "correct one of them");
        return None;
    }
    let constants = JohnsonHolmquist {
        shear: shear?,
        a: a?,
        b,
        c,
        m: m?,
        n: n?,
        rate0: Some(f[1].real(0, 1.0)).filter(|rate| *rate > 0.0).unwrap_or(1.0),
        tension: tension?,
        fractured_limit,
        hel_stress: 1.5 * (hel - hel_pressure),
        hel_pressure,
        beta,
        d1,
        d2: d2?,
    };
    let a1 = k1?;
    let eos = Eos::Polynomial { a1, a2: k2, a3: k3, b0: 0.0, b1: 0.0, t1: a1, t2: 0.0 };
    Some(Law::Whole {
        strength: Strength::JohnsonHolmquist(constants),
        eos,
        failure: Failure::None,
        given: "K1, K2 and K3",
    })
}

/// Three cards of `*MAT_JOHNSON_HOLMQUIST_CONCRETE`.
pub(super) fn concrete(f: &[Fields<'_>; 8], limits: &mut Limits, log: &Log<'_>) -> Option<Law> {
    let [shear, n, compressive_strength] =
        [(2, "G"), (6, "N"), (7, "FC")].map(|(i, what)| f[0].positive(i, what));
    let [a, b, c] = [3, 4, 5].map(|i| not_negative(&f[0], i));
    let [tension, least_strain, crush_pressure, crush_compression, lock_pressure, lock_compression] =
        [(0, "T"), (2, "EFMIN"), (4, "PC"), (5, "UC"), (6, "PL"), (7, "UL")]
            .map(|(i, what)| f[1].positive(i, what));
    let strength_limit = Some(f[1].real(3, 0.0)).filter(|limit| *limit > 0.0).unwrap_or(UNLIMITED);
    let [d2, k1] = [(1, "D2"), (2, "K1")].map(|(i, what)| f[2].positive(i, what));
    match f[2].real(5, 0.0) {
        fs if fs < 0.0 => f[2].fault(5, "no failure by the damaged strength", "leave FS blank"),
        0.0 => {
            if let Some(tension) = tension {
                log.warn(f[2].place(5), "FS 0: elements leave when their tension comes to T");
                limits.add(Criterion::Tension, f[1].placed(0, "T", tension));
            }
        }
        _ => limits.read_failure_strain(&f[2], 5, "FS"),
    }
    let law = HolmquistJohnsonCook {
        shear: shear?,
        a,
        b,
        n: n?,
        c,
        rate0: Some(f[1].real(1, 1.0)).filter(|rate| *rate > 0.0).unwrap_or(1.0),
        compressive_strength: compressive_strength?,
        strength_limit,
        tension: tension?,
        crush_pressure: crush_pressure?,
        crush_compression: crush_compression?,
        lock_pressure: lock_pressure?,
        lock_compression: lock_compression?,
        k1: k1?,
        k2: f[2].real(3, 0.0),
        k3: f[2].real(4, 0.0),
        d1: not_negative(&f[2], 0),
        d2: d2?,
        least_strain: least_strain?,
    };
    let strength = Strength::HolmquistJohnsonCook(law);
    if let Some(expected) = strength.fault() {
        f[1].fault(7, expected, "correct PC, UC, PL, UL or K1 to K3");
        return None;
    }
    let eos = Eos::Linear { bulk: strength.bulk()? };
    Some(Law::Whole { strength, eos, failure: Failure::None, given: "PC, UC, PL, UL and K1 to K3" })
}

/// Beyond this a rate is never.
const NEVER: f64 = 1e15;

/// Five cards of `*MAT_RHT`.
pub(super) fn rht(f: &[Fields<'_>; 8], limits: &mut Limits, log: &Log<'_>) -> Option<Law> {
    let shear = f[0].positive(2, "SHEAR");
    let [a, n, compressive_strength, shear_strength, tension, q0] =
        [(0, "A"), (1, "N"), (2, "FC"), (3, "FS*"), (4, "FT*"), (5, "Q0")]
            .map(|(i, what)| f[1].positive(i, what));
    let [rate0, tension_rate0] = [(0, "E0C"), (1, "E0T")].map(|(i, what)| f[2].positive(i, what));
    let [hardening, d2, least_strain, residual_n] =
        [(2, "XI"), (4, "D2"), (5, "EPM"), (7, "NF")].map(|(i, what)| f[3].positive(i, what));
    let [a1, crush_pressure, compaction_pressure, pore_exponent, distension] =
        [(1, "A1"), (4, "PEL"), (5, "PCO"), (6, "NP"), (7, "ALPHA0")].map(|(i, what)| f[4].positive(i, what));
    for (i, name) in [(2, "EC"), (3, "ET")] {
        if (f64::MIN_POSITIVE..NEVER).contains(&f[2].real(i, 0.0)) {
            f[2].fault(
                i,
                format!("{name} beyond any rate: one power of the rate"),
                "leave it blank or give 3e25",
            );
        }
    }
    if let Some(a1) = a1
        && ![0.0, a1].contains(&f[0].real(7, 0.0))
    {
        f[0].fault(7, "T1 that is A1", "correct it");
    }
    if f[1].real(7, 0.0) != 0.0 {
        f[1].fault(7, "T2 0", "leave it blank");
    }
    if f[2].real(6, 0.0) > 0.0 {
        log.warn(f[2].place(6), "PTF: plastic flow does not follow the pressure here");
    }
    if f[4].real(0, 0.0) != 0.0 {
        f[4].fault(0, "GAMMA 0: the energy by B0 and B1", "leave it blank, and give B0 and B1");
    }
    limits.read_failure_strain(&f[0], 4, "EPSF");
    let elastic =
        [0, 1].map(|i| f[3].within(i, 1.0, Range::Within(0.0, 1.0, "a number above 0 and at most 1")));
    let law = RiedelHiermaierThoma {
        shear: shear?,
        compressive_strength: compressive_strength?,
        tension: tension?,
        shear_strength: shear_strength?,
        a: a?,
        n: n?,
        q0: q0?,
        b: not_negative(&f[1], 6),
        rate0: rate0?,
        tension_rate0: tension_rate0?,
        beta: not_negative(&f[2], 4),
        tension_beta: not_negative(&f[2], 5),
        elastic_compression: elastic[0],
        elastic_tension: elastic[1],
        hardening: hardening?,
        d1: not_negative(&f[3], 3),
        d2: d2?,
        least_strain: least_strain?,
        residual_a: not_negative(&f[3], 6),
        residual_n: residual_n?,
        distension: distension?,
        crush_pressure: crush_pressure?,
        compaction_pressure: compaction_pressure?,
        pore_exponent: pore_exponent?,
        a1: a1?,
        a2: not_negative(&f[4], 2),
        a3: not_negative(&f[4], 3),
        b0: not_negative(&f[0], 5),
        b1: not_negative(&f[0], 6),
    };
    let strength = Strength::RiedelHiermaierThoma(law);
    if let Some(expected) = strength.fault() {
        f[1].fault(5, expected, "correct Q0, FS*, FT*, ALPHA0, PEL or PCO");
        return None;
    }
    let eos = Eos::Linear { bulk: strength.bulk()? };
    Some(Law::Whole { strength, eos, failure: Failure::None, given: "A1 to A3, PEL, PCO and ALPHA0" })
}
