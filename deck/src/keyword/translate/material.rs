//! Materials in use, each with the equation of state of its part.

use std::collections::BTreeSet;

use mechanics::material::{
    CowperSymonds, Eos, Failure, Hardening, Heat, MAX_HARDENING, MAX_POINTS, Material, Points, Strength,
    Tabulated,
};

use super::state::Translation;
use crate::{
    fault::short,
    keyword::{
        explosive::Jwl,
        material::{EosCard, Law, MaterialCard},
        problem::{PartCard, Section},
    },
    library::{Clash, clashes},
    log::Log,
    place::Place,
    typed::part::Own,
};

/// The name of a material of the deck that is made.
pub(super) fn material_name(material: u32, eos: u32) -> String {
    match eos {
        0 => format!("material {material}"),
        _ => format!("material {material} eos {eos}"),
    }
}

/// Adds the materials in use to the deck. One that could not be made keeps its name, so that it is no second fault.
pub(super) fn write(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let mut done = BTreeSet::new();
    for id in t.names.keys() {
        let part = &problem.parts[id];
        let section = problem.sections.get(&part.section.value);
        if matches!(section, Some((_, Section::Discrete))) {
            continue;
        }
        if !done.insert((part.material.value, part.eos.value)) {
            continue;
        }
        let Some(card) = problem.materials.get(&part.material.value) else {
            if problem.springs.contains_key(&part.material.value) {
                let expected = "a material of elements with volume: this one is of springs";
                log.fault_of(part.material.origin, expected, "give the part a *SECTION_DISCRETE");
            } else if !problem.refused_materials.contains(&part.material.value) {
                log.fault_of(part.material.origin, "a material of the deck", "add the *MAT");
            }
            continue;
        };
        if matches!(card.law, Law::Cable { .. }) && !matches!(section, Some((_, Section::Cable(_)))) {
            let expected = "a *SECTION_BEAM of ELFORM 6: the material is of cables";
            log.fault_of(part.material.origin, expected, "correct SECID, or take *MAT_ELASTIC");
        }
        let name = material_name(part.material.value, part.eos.value);
        let material = make(t, card, part, name.clone());
        t.deck.materials.push(Own { name, named: None, material });
    }
}

/// A material; none after a fault.
fn make(t: &Translation<'_>, card: &MaterialCard, part: &PartCard, name: String) -> Option<Material> {
    let (problem, log) = (t.problem, t.log);
    let eos = problem.equations.get(&part.eos.value);
    let strength = strength_of(t, card);
    if part.eos.value != 0 && eos.is_none() {
        if !problem.refused_equations.contains(&part.eos.value) {
            log.fault_of(part.eos.origin, "an *EOS of the deck", "add it");
        }
        return None;
    }
    // LS-DYNA's own laws with moduli make their pressure of them, whatever EOSID says.
    let makes_pressure = card.elastic.is_some() && !matches!(eos, Some(EosCard::Jwl(_)));
    if eos.is_some() && makes_pressure {
        log.warn(
            part.eos.origin.at,
            format!(
                "EOSID {}: material {} makes its pressure of E and PR, so the *EOS is left out, as in LS-DYNA",
                part.eos.value, part.material.value
            ),
        );
    }
    let eos = eos_of(t, card, eos.filter(|_| !makes_pressure), part);
    let failure = match &card.law {
        Law::Null { cut_off } if cut_off.value < 0.0 => {
            Failure::Hydrostatic { tension: -cut_off.value, heals: true }
        }
        Law::Whole { failure, .. } => *failure,
        Law::JohnsonCook { damage: Some(d), .. } => Failure::JohnsonCook { d: d.map(|d| d + 0.0) },
        _ => Failure::None,
    };
    let material = Material { name, density: card.density, eos: eos?, strength: strength?, failure };
    for clash in clashes(&material) {
        match (clash, &card.law) {
            (Clash::Failure, Law::Null { cut_off }) => {
                log.fault_of(cut_off.origin, "no cut-off of the pressure in a gas", "leave PC blank");
            }
            (Clash::Strength, _) => {
                log.fault_of(
                    part.eos.origin,
                    "no gas: the material has a strength",
                    "take a *MAT_NULL with it",
                );
            }
            // Told with the strength.
            (Clash::Failure | Clash::Damage | Clash::Porous | Clash::Vapour, _) => {}
        }
    }
    Some(material)
}

/// The equation of state of a material; none after a fault.
fn eos_of(
    t: &Translation<'_>,
    material: &MaterialCard,
    eos: Option<&EosCard>,
    part: &PartCard,
) -> Option<Eos> {
    let log = t.log;
    if let Law::Curved { strength, .. } = &material.law {
        if eos.is_some() {
            log.fault_of(part.eos.origin, "no *EOS: the curve of the material is one", "leave EOSID blank");
        }
        return strength
            .bulk()
            .map(|bulk| Eos::Linear { bulk: t.number(material.at, "a bulk modulus of", bulk) });
    }
    if let Law::Whole { eos: own, given, .. } = &material.law {
        if eos.is_some() {
            let expected = format!(
                "no *EOS: {given} of the material {} one",
                if given.contains(' ') { "are" } else { "is" }
            );
            log.fault_of(part.eos.origin, expected, "leave EOSID blank");
        }
        return Some(match own {
            Eos::Linear { bulk } => Eos::Linear { bulk: t.number(material.at, "a bulk modulus of", *bulk) },
            own => *own,
        });
    }
    match (eos, &material.law) {
        (Some(EosCard::Jwl(jwl)), Law::Explosive { speed, pressure }) => {
            let Jwl { a, b, r1, r2, omega, energy } = *jwl;
            return Some(Eos::Jwl {
                a,
                b,
                r1,
                r2,
                omega,
                energy,
                detonation: *speed,
                cj_pressure: *pressure,
            });
        }
        (Some(EosCard::Jwl(_)), _) | (_, Law::Explosive { .. }) => {
            let expected = "*MAT_HIGH_EXPLOSIVE_BURN with *EOS_JWL: one goes with the other";
            log.fault_of(part.eos.origin, expected, "give both, or neither");
            return None;
        }
        _ => {}
    }
    let is_of_solids =
        matches!(t.problem.sections.get(&part.section.value), None | Some((_, Section::Solid { .. })));
    let is_of_shells = matches!(t.problem.sections.get(&part.section.value), Some((_, Section::Shell(_))));
    let elastic = match material.law {
        Law::JohnsonCook { of_shells, .. } if is_of_shells => material.elastic.or(of_shells),
        _ => material.elastic,
    };
    match (eos, elastic) {
        // Told above.
        (Some(EosCard::Jwl(_)), _) => None,
        (Some(EosCard::Grueneisen { c, s, gamma }), _) => {
            Some(Eos::Shock { c0: *c, s: s + 0.0, gamma: gamma + 0.0 })
        }
        (Some(EosCard::Tabulated { gamma, curves, points }), _) => {
            let mut tables = Vec::new();
            for (curve, points) in curves.iter().zip(points) {
                let points = match curve.value {
                    0 => points.clone(),
                    id => t.points(id, curve.origin.at)?.to_vec(),
                };
                // The card has the logarithm of the relative volume, which compression makes negative.
                let mut points: Vec<[f64; 2]> =
                    points.iter().map(|[at, value]| [-at + 0.0, *value]).collect();
                points.sort_by(|a, b| a[0].total_cmp(&b[0]));
                let ascends = points.windows(2).all(|w| w[0][0] < w[1][0]);
                if !ascends || !(1..=MAX_POINTS).contains(&points.len()) {
                    let expected = format!("1 to {MAX_POINTS} points at different volumes");
                    log.fault_of(curve.origin, expected, "correct the points, or fit fewer");
                    return None;
                }
                let number = |value: f64| t.number(curve.origin.at, "a value of", value);
                let points: Vec<[f64; 2]> = points.iter().map(|[at, value]| [*at, number(*value)]).collect();
                tables.push(Points::through(&points));
            }
            let law =
                Eos::Tabulated(Tabulated { gamma: gamma + 0.0, pressure: tables[0], factor: tables[1] });
            if let Some(expected) = law.fault(material.density) {
                log.fault_of(curves[0].origin, expected, "correct the points");
                return None;
            }
            Some(law)
        }
        (Some(EosCard::Polynomial { origin, c, energy }), _) => {
            let refuse = |what: &str, advice: &str| {
                let expected = "a polynomial that fits p = C1 mu + C2 mu^2 + C3 mu^3 + (C4 + C5 mu) E";
                log.fault(origin.at.at_column(1), what, expected, advice);
                None
            };
            let [c0, c1, c2, c3, c4, c5, c6] = c.map(|c| c + 0.0);
            if [c0, c1, c2, c3, c6].iter().all(|c| *c == 0.0) && c4 > 0.0 && c4 == c5 {
                if c4 > 9.0 {
                    return refuse("C4 above 9", "give a gas of gamma - 1 at most 9");
                }
                if *energy <= 0.0 {
                    return refuse("E0 that is not above 0", "give the energy of the gas at the start");
                }
                let energy = t.number(origin.at, "an energy by mass of", energy / material.density);
                return Some(Eos::IdealGas { gamma: c4 + 1.0, energy });
            }
            if c0 != 0.0 || c6 != 0.0 {
                return refuse("C0 or C6", "leave them blank");
            }
            if *energy != 0.0 {
                return refuse("E0 of a condensed material", "leave it blank");
            }
            if c1 <= 0.0 {
                return refuse("C1 that is not above 0", "give the bulk modulus");
            }
            if c4 < 0.0 || c5 < 0.0 {
                return refuse("C4 or C5 below 0", "give them as 0 or above");
            }
            Some(Eos::Polynomial { a1: c1, a2: c2, a3: c3, b0: c4, b1: c5, t1: c1, t2: 0.0 })
        }
        (None, Some((young, poisson))) => {
            let bulk = young / (3.0 * (1.0 - 2.0 * poisson));
            Some(Eos::Linear { bulk: t.number(material.at, "a bulk modulus of", bulk) })
        }
        (None, None) if !is_of_solids && matches!(material.law, Law::Null { .. }) => {
            log.fault_of(
                part.material.origin,
                "a material that resists deformation: null shells and beams, which have mass alone, are not computed",
                "take *MAT_ELASTIC with a small modulus, or *ELEMENT_MASS for their mass, and leave out what is only looked at",
            );
            None
        }
        (None, None) => {
            log.fault(
                part.at,
                "a part whose material needs an equation of state and which has none",
                "the number of an *EOS",
                "give EOSID in *PART",
            );
            None
        }
    }
}

/// The strength of a material; none after a fault.
fn strength_of(t: &Translation<'_>, material: &MaterialCard) -> Option<Strength> {
    let log = t.log;
    let (young, poisson) = material.elastic.unwrap_or_default();
    let shear = young / (2.0 * (1.0 + poisson));
    let shear = || t.number(material.at, "a shear modulus of", shear);
    let rate_of =
        |rate: &Option<[f64; 2]>| rate.map(|[reference, exponent]| CowperSymonds { reference, exponent });
    Some(match &material.law {
        Law::Strength(strength) | Law::Whole { strength, .. } => *strength,
        Law::Curved { strength, curve, points } => {
            let mut points = match curve.value {
                0 => points.clone(),
                id => t.points(id, curve.origin.at)?.to_vec(),
            };
            if let Strength::SoilFoam(..) = strength {
                // The card has the logarithm of the relative volume, which compression makes negative.
                points.iter_mut().for_each(|point| point[0] = -point[0] + 0.0);
                points.push([0.0; 2]);
                points.sort_by(|a, b| a[0].total_cmp(&b[0]));
                points.dedup();
            }
            let at = curve.origin.at;
            let strength = strength.with_curve(held(t, hardening(points, true, at, log)?, at));
            if let Some(expected) = strength.fault() {
                log.fault_of(curve.origin, expected, "correct the curve or the constants");
                return None;
            }
            strength
        }
        Law::Elastic | Law::Cable { .. } | Law::Rigid { .. } => Strength::Elastic { shear: shear() },
        Law::Null { .. } | Law::Explosive { .. } => Strength::Hydro,
        Law::Bilinear { yield_stress, tangent, rate } => {
            if !(0.0 <= tangent.value && tangent.value < young) {
                let expected = format!("a tangent modulus from 0 to below Young's {young}");
                log.fault_of(tangent.origin, expected, "correct it");
                return None;
            }
            // The tangent is of the total strain, hardening of the plastic one.
            let hardening = young * tangent.value / (young - tangent.value);
            Strength::VonMises {
                shear: shear(),
                yield_stress: *yield_stress,
                hardening: t.number(tangent.origin.at, "a hardening of", hardening),
                rate: rate_of(rate),
            }
        }
        Law::Tabulated { points, curve, rate } => {
            let points = match curve.value {
                0 => points.clone(),
                id => t.points(id, curve.origin.at)?.to_vec(),
            };
            let points = hardening(points, false, material.at, log)?;
            let hardening = held(t, points, material.at);
            Strength::Tabulated { shear: shear(), hardening, rate: rate_of(rate) }
        }
        Law::JohnsonCook {
            shear, constants: [a, b, n, c, m], t_melt, t_room, rate0, specific_heat, ..
        } => {
            let shear = t.number(material.at, "a shear modulus of", *shear);
            Strength::JohnsonCook {
                shear,
                a: *a,
                b: b + 0.0,
                n: *n,
                c: c + 0.0,
                m: *m,
                t_melt: *t_melt,
                t_room: *t_room,
                specific_heat: *specific_heat,
                rate0: *rate0,
                heat: Heat::PlasticWork,
            }
        }
    })
}

/// The points of a curve as a law holds them.
fn held(t: &Translation<'_>, mut points: Vec<[f64; 2]>, at: Place) -> Hardening {
    for point in &mut points {
        *point = [t.number(at, "a strain of", point[0]), t.number(at, "a stress of", point[1])];
    }
    Hardening::through(&points)
}

/// Points of a yield curve, or of one that may begin without stress, as our law takes them: from strain 0, not descending, few; beyond the last the last slope
/// goes on, as LS-DYNA continues curves.
fn hardening(mut points: Vec<[f64; 2]>, from_zero: bool, at: Place, log: &Log<'_>) -> Option<Vec<[f64; 2]>> {
    let given = points.len();
    points.retain(|p| p[0] >= 0.0);
    if points.len() < given {
        let n = given - points.len();
        log.warn(at, format!("{n} points of a curve by strain lie below strain 0: they are left out"));
    }
    let bad = points.windows(2).find(|w| w[1][0] <= w[0][0] || w[1][1] < w[0][1]);
    let stress = if from_zero { points.last() } else { points.first() }.map_or(0.0, |p| p[1]);
    if stress <= 0.0 || points[0][1] < 0.0 || bad.is_some() {
        let read = bad.map_or("a curve without a positive stress".to_string(), |w| {
            format!("a curve from {:?} to {:?}", w[0], w[1])
        });
        log.fault(at, read, "strains that ascend, stresses that do not descend", "flatten what softens");
        return None;
    }
    if let ([first, second, ..], false) = (&points[..], from_zero)
        && first[0] > 0.0
    {
        // The first line goes back to strain 0, as LS-DYNA continues curves.
        let stress = (second[1] - first[1]) / (second[0] - first[0]) * -first[0] + first[1];
        match stress > 0.0 {
            true => points.insert(0, [0.0, stress]),
            false => log.warn(
                at,
                format!(
                    "a yield curve that begins at strain {} and comes to no stress at 0: the first stress, {}, is that of 0",
                    short(first[0]),
                    short(first[1])
                ),
            ),
        }
    }
    points[0][0] = 0.0;
    if let [.., a, b] = points[..] {
        let slope = (b[1] - a[1]) / (b[0] - a[0]);
        if slope > 0.0 {
            let far = (2.0 * b[0]).max(10.0);
            points.push([far, slope.mul_add(far - b[0], b[1])]);
        }
    }
    let mut worst = 0.0f64;
    while points.len() > MAX_HARDENING {
        // The point that lies nearest to the line between its neighbours goes.
        let off = |i: usize| {
            let [a, p, b] = [points[i - 1], points[i], points[i + 1]];
            let line = (b[1] - a[1]) / (b[0] - a[0]) * (p[0] - a[0]) + a[1];
            ((p[1] - line) / p[1]).abs()
        };
        let least = (1..points.len() - 1).min_by(|i, j| off(*i).total_cmp(&off(*j)))?;
        worst = worst.max(off(least));
        points.remove(least);
    }
    if worst > 1e-3 {
        log.warn(
            at,
            format!(
                "the yield curve was reduced to {MAX_HARDENING} points, off by {:.2} % at most each",
                100.0 * worst
            ),
        );
    }
    Some(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_yield_curve_is_cut_to_ten_points_and_goes_on_with_its_last_slope() {
        let log = Log::keyword(&[("a.k", "")]);
        let at = Place::card(0, 1);
        assert_eq!(
            hardening(vec![[0.0, 1.0], [1.0, 2.0]], false, at, &log),
            Some(vec![[0.0, 1.0], [1.0, 2.0], [10.0, 11.0]])
        );
        let many: Vec<[f64; 2]> = (0..50).map(|i| f64::from(i) * 0.01).map(|e| [e, 1.0 + e.sqrt()]).collect();
        let few = hardening(many, false, at, &log).expect("ascends");
        assert_eq!(few.len(), MAX_HARDENING);
        assert_eq!(few[0], [0.0, 1.0]);
        assert!(hardening(vec![[0.0, 1.0], [1.0, 0.5]], false, at, &log).is_none());
        // From strain 0 by the first slope, where a stress is left there.
        let later = hardening(vec![[0.1, 1.0], [0.3, 1.4], [0.4, 1.4]], false, at, &log);
        assert_eq!(later, Some(vec![[0.0, 0.8], [0.1, 1.0], [0.3, 1.4], [0.4, 1.4]]));
        assert_eq!(
            hardening(vec![[0.1, 0.1], [0.2, 1.0], [0.4, 1.0]], false, at, &log),
            Some(vec![[0.0, 0.1], [0.2, 1.0], [0.4, 1.0]])
        );
        assert!(hardening(vec![], false, at, &log).is_none());
        assert!(hardening(vec![[0.0, 0.0], [1.0, 0.5]], false, at, &log).is_none());
        assert!(hardening(vec![[0.0, 0.0], [1.0, 0.5]], true, at, &log).is_some());
    }
}
