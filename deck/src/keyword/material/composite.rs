//! `*MAT_` of what has axes: composites and honeycomb.

use mechanics::{
    material::{Eos, Failure, Hardening, Strength},
    mesh::Axis,
    strength::{ChangChang, Honeycomb, Orthotropic},
};

use super::{Law, not_negative};
use crate::{
    keyword::{erosion::Limits, fields::Fields},
    log::Log,
    place::Origin,
    table::Range,
};

/// Strengths that a card leaves out.
const UNLIMITED: f64 = 1e30;
/// AOPT of axes by two vectors.
const GLOBAL: f64 = 2.0;

/// AOPT by the sides of elements, and by a vector and their normals.
const ELEMENT: f64 = 0.0;
const NORMAL: f64 = 3.0;

/// Where angle 0 of a material is in shells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::keyword) struct Fibres {
    /// AOPT.
    pub(in crate::keyword) origin: Origin,
    pub(in crate::keyword) axis: Axis,
    /// The angle of the material (degrees), to which those of layers are added.
    pub(in crate::keyword) turn: f64,
}

/// The axes by the fields of AOPT, A1, V1 and the angle of the material; with AOPT 2 that of a is a constant of the law.
fn fibres(
    f: &[Fields<'_>; 8],
    option: (usize, usize),
    vector: (usize, usize),
    (card, i): (usize, usize),
) -> Fibres {
    let origin = f[option.0].origin(option.1, "AOPT");
    let axis = match f[option.0].real(option.1, 0.0) {
        ELEMENT => Axis::Side,
        GLOBAL => Axis::Material,
        NORMAL => Axis::Across([0, 1, 2].map(|k| f[vector.0].real(vector.1 + k, 0.0))),
        _ => {
            let expected =
                "AOPT 0, 2 or 3: axes by the element, the vector A, or the vector V and the normal";
            f[option.0].fault(option.1, expected, "give one of them");
            Axis::Material
        }
    };
    if let Axis::Across([0.0, 0.0, 0.0]) = axis {
        f[vector.0].fault(vector.1, "a vector V of some length with AOPT 3", "give V1 to V3");
    }
    if axis == Axis::Material {
        refuse(&f[card], i, "no angle of the material with AOPT 2", "turn A, or the angles of the layers");
    }
    Fibres { origin, axis, turn: f[card].real(i, 0.0) }
}

fn refuse(f: &Fields<'_>, i: usize, expected: &str, advice: &str) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, expected, advice);
    }
}

/// The vectors a and d of the law, from the fields of A1 and D1; those of axes by the elements are turned from any.
fn axes(f: &[Fields<'_>; 8], global: bool, a: (usize, usize), d: (usize, usize)) -> [[f64; 3]; 2] {
    if !global {
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
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
pub(super) fn orthotropic(f: &[Fields<'_>; 8], fails: bool) -> (Option<Law>, Fibres) {
    let option = if fails { 4 } else { 3 };
    let fibres = fibres(f, (1, option), (3, 0), (3, 6));
    (orthotropic_law(f, fails, fibres.axis == Axis::Material), fibres)
}

/// Its law; with axes by the elements those of the law are not used.
fn orthotropic_law(f: &[Fields<'_>; 8], fails: bool, global: bool) -> Option<Law> {
    let [young_a, young_b, young_c] =
        [(2, "EA"), (3, "EB"), (4, "EC")].map(|(i, what)| f[0].positive(i, what));
    let [modulus_ab, modulus_bc, modulus_ca] =
        [(0, "GAB"), (1, "GBC"), (2, "GCA")].map(|(i, what)| f[1].positive(i, what));
    let [[ax, ay, az], [dx, dy, dz]] = axes(f, global, (2, 3), (3, 3));
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

/// Six to eight cards of `*MAT_ENHANCED_COMPOSITE_DAMAGE`.
pub(super) fn enhanced(f: &[Fields<'_>; 8], limits: &mut Limits) -> (Option<Law>, Fibres) {
    let fibres = fibres(f, (1, 4), (3, 0), (2, 6));
    (enhanced_law(f, limits, fibres.axis == Axis::Material), fibres)
}

fn enhanced_law(f: &[Fields<'_>; 8], limits: &mut Limits, global: bool) -> Option<Law> {
    for (card, i, expected) in [
        (1, 5, "no 2WAY: fibres along a alone"),
        (1, 6, "no TI"),
        (4, 0, "no time step TFAIL at which elements leave"),
        (4, 1, "a shear stress in a line with its strain: ALPH 0"),
        (6, 1, "no EPSF: damage of transverse shear"),
        (6, 2, "no EPSR: damage of transverse shear"),
        (6, 3, "no TSMD: damage of transverse shear"),
        (6, 4, "no SOFT2: strengths that do not depend on neighbours"),
        (7, 0, "no SLIMT1"),
        (7, 1, "no SLIMC1"),
        (7, 2, "no SLIMT2"),
        (7, 3, "no SLIMC2"),
        (7, 4, "no SLIMS"),
        (7, 5, "no NCYRED"),
        (7, 6, "no SOFTG"),
    ] {
        refuse(&f[card], i, expected, "leave it blank");
    }
    if !matches!(f[4].real(2, 0.0), 0.0 | 1.0) {
        f[4].fault(2, "SOFT 1: strengths that do not depend on neighbours", "leave SOFT blank");
    }
    if !matches!(f[6].real(0, 0.0), 0.0 | 100.0) {
        f[6].fault(0, "PEL 100: elements leave when all their layers have failed", "leave PEL blank");
    }
    if !matches!(f[5].real(5, 0.0), 0.0 | 54.0) {
        f[5].fault(5, "CRIT 54: the criterion of Chang and Chang", "give CRIT 54");
    }
    let [young_a, young_b] = [(2, "EA"), (3, "EB")].map(|(i, what)| f[0].positive(i, what));
    let [modulus_ab, modulus_bc, modulus_ca] =
        [(0, "GAB"), (1, "GBC"), (2, "GCA")].map(|(i, what)| f[1].positive(i, what));
    let strength = |i: usize| match not_negative(&f[5], i) {
        strength if strength > 0.0 => strength,
        _ => UNLIMITED,
    };
    // Strains of 0 are none, and DFAILC is negative.
    let strain = |card: usize, i: usize| match f[card].real(i, 0.0).abs() {
        strain if strain > 0.0 => strain,
        _ => UNLIMITED,
    };
    let holds = f[4].real(5, 0.0) > 0.0;
    let along = |card: usize, i: usize| if holds { strain(card, i) } else { UNLIMITED };
    let (compression_a, compression_b) = (strength(0), strength(2));
    let factor = f[4].real(4, 0.0);
    let factor = if factor > 0.0 { factor } else { 2.0 };
    let crushed_compression = if compression_a < UNLIMITED && compression_b < UNLIMITED {
        (factor * compression_b / compression_a).min(1.0)
    } else {
        1.0
    };
    let crushed_tension = match f[4].real(3, 0.0) {
        share if 0.0 < share && share < 1.0 => share,
        _ => 1.0,
    };
    let [ax, ay, az] = match global {
        true => [0, 1, 2].map(|k| f[2].real(3 + k, 0.0)),
        false => [1.0, 0.0, 0.0],
    };
    let law = ChangChang {
        young_a: young_a?,
        young_b: young_b?,
        poisson_ba: f[0].real(5, 0.0),
        modulus_ab: modulus_ab?,
        modulus_bc: modulus_bc?,
        modulus_ca: modulus_ca?,
        ax,
        ay,
        az,
        tension_a: strength(1),
        compression_a,
        tension_b: strength(3),
        compression_b,
        shear_ab: strength(4),
        shear_share: not_negative(&f[5], 6),
        crushed_tension,
        crushed_compression,
        strain_tension_a: along(4, 5),
        strain_compression_a: along(4, 6),
        strain_b: along(3, 6),
        strain_ab: along(3, 7),
        strain_effective: strain(4, 7),
    };
    limits.by_failure(f[5].origin(1, "XT"));
    checked(&f[0], Strength::ChangChang(law))
}

/// Five cards of `*MAT_HONEYCOMB`.
pub(super) fn honeycomb(f: &[Fields<'_>; 8], log: &Log<'_>) -> (Option<Law>, Fibres) {
    let axis = match f[2].real(6, 0.0) {
        ELEMENT => Axis::Side,
        GLOBAL => Axis::Material,
        _ => {
            f[2].fault(6, "AOPT 0 or 2: axes by the element, or the vectors A and D", "give one of them");
            Axis::Material
        }
    };
    let fibres = Fibres { origin: f[2].origin(6, "AOPT"), axis, turn: 0.0 };
    (honeycomb_law(f, axis == Axis::Material, log), fibres)
}

fn honeycomb_law(f: &[Fields<'_>; 8], global: bool, log: &Log<'_>) -> Option<Law> {
    for (i, name) in [(6, "MU"), (7, "BULK")] {
        if f[0].real(i, 0.0) != 0.0 {
            log.warn(f[0].origin(i, name).at, format!("{name}: the viscosity is that of the deck here"));
        }
    }
    if !matches!(f[2].real(7, 0.0), 0.0 | 1.0) {
        f[2].fault(7, "axes in their order", "leave MACF blank and exchange the constants");
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
    let [[ax, ay, az], [dx, dy, dz]] = axes(f, global, (3, 3), (4, 0));
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
