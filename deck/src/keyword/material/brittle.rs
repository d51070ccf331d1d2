//! `*MAT_` of what breaks: ceramics, glass, concrete.

use mechanics::{
    material::{Eos, Failure, Strength},
    strength::{HolmquistJohnsonCook, JohnsonHolmquist},
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
