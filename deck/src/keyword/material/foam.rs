//! `*MAT_` of foams and soil: laws that have a curve.

use mechanics::{
    material::{Hardening, Strength},
    strength::{CrushableFoam, LowDensityFoam, SoilFoam},
};

use super::{Law, not_negative};
use crate::{keyword::fields::Fields, log::Log, table::Range};

/// TC where the card has none.
const UNLIMITED: f64 = 1e20;

/// One of the three.
pub(super) fn read(word: &str, f: &[Fields<'_>; 8], log: &Log<'_>) -> Option<Law> {
    match word {
        "MAT_CRUSHABLE_FOAM" => crushable(f, log),
        "MAT_LOW_DENSITY_FOAM" => low_density(f, log),
        _ => soil(f),
    }
}

fn undamped(f: &Fields<'_>, i: usize, log: &Log<'_>) {
    if f.real(i, 0.0) != 0.0 {
        log.warn(f.origin(i, "DAMP").at, "DAMP: foam has no damping here beside artificial viscosity");
    }
}

fn refuse(f: &Fields<'_>, i: usize, expected: &str, advice: &str) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, expected, advice);
    }
}

/// One card. Poisson's ratio is not used there either.
fn crushable(f: &[Fields<'_>; 8], log: &Log<'_>) -> Option<Law> {
    undamped(&f[0], 6, log);
    refuse(&f[0], 7, "a crush curve by the volume alone", "leave MODEL blank");
    let (young, tension) = (f[0].positive(2, "Young's modulus"), not_negative(&f[0], 5));
    let law = CrushableFoam { young: young?, tension };
    let strength = Strength::CrushableFoam(law, Hardening::NONE);
    Some(Law::Curved { strength, curve: f[0].reference(4, "LCID"), points: Vec::new() })
}

/// Two cards.
fn low_density(f: &[Fields<'_>; 8], log: &Log<'_>) -> Option<Law> {
    undamped(&f[0], 7, log);
    refuse(&f[0], 6, "no decay", "leave BETA blank");
    refuse(&f[1], 1, "tension that stays at its cut-off", "leave FAIL blank");
    refuse(&f[1], 3, "no relaxation", "leave ED and BETA1 blank");
    refuse(&f[1], 6, "a geometry at the start without stress", "leave REF blank");
    if f[1].real(5, 0.0) != 0.0 {
        log.warn(f[1].origin(5, "KCON").at, "KCON: the stiffness of contact follows from the material here");
    }
    let or = |value: f64, default: f64| if value > 0.0 { value } else { default };
    let young = f[0].positive(2, "Young's modulus");
    let law = LowDensityFoam {
        young: young?,
        tension: or(not_negative(&f[0], 4), UNLIMITED),
        hysteresis: f[0].within(5, 1.0, Range::Within(-f64::MIN_POSITIVE, 1.0, "a number from 0 to 1")),
        shape: or(not_negative(&f[1], 0), 1.0),
    };
    let strength = Strength::LowDensityFoam(law, Hardening::NONE);
    Some(Law::Curved { strength, curve: f[0].reference(3, "LCID"), points: Vec::new() })
}

/// Two cards, and four with points where LCID is 0.
fn soil(f: &[Fields<'_>; 8]) -> Option<Law> {
    refuse(&f[1], 0, "crushing that stays", "leave VCR blank");
    refuse(&f[1], 1, "a geometry at the start without stress", "leave REF blank");
    let (shear, unloading) = (f[0].positive(2, "G"), f[0].positive(3, "KUN"));
    let cut_off = f[0].real(7, 0.0);
    if cut_off > 0.0 {
        f[0].fault(7, "a pressure cut-off of 0 or below", "give it as a negative pressure");
    }
    let law = SoilFoam {
        shear: shear?,
        unloading: unloading?,
        a0: not_negative(&f[0], 4),
        a1: not_negative(&f[0], 5),
        a2: f[0].real(6, 0.0),
        tension: (-cut_off).max(0.0),
    };
    let curve = f[1].reference(2, "LCID");
    let mut points: Vec<[f64; 2]> = Vec::new();
    for i in (0..10).filter(|_| curve.value == 0) {
        let of = |card: usize| f[card + i / 8].real(i % 8, 0.0);
        let point = [of(2), of(4)];
        if point != [0.0; 2] {
            points.push(point);
        }
    }
    Some(Law::Curved { strength: Strength::SoilFoam(law, Hardening::NONE), curve, points })
}
