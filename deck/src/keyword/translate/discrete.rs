//! The laws of springs and dampers, of the cards of their materials and their elements.

use mechanics::element::spring2::{Damper, Elastic, Line, Spring};

use super::state::Translation;
use crate::{
    fault::short,
    keyword::{discrete::SpringLaw, problem::PartCard},
    place::{Origin, Placed},
};

/// A linear spring.
pub(super) fn linear(stiffness: f64) -> Spring {
    Spring { elastic: Elastic::Linear { stiffness }, damper: Damper::None, offset: 0.0 }
}

/// The law of a part of springs; none after a fault.
pub(super) fn law(t: &Translation<'_>, id: u32, part: &PartCard) -> Option<Spring> {
    let (problem, log) = (t.problem, t.log);
    let mut elements = problem.discretes.iter().filter(|element| element.part == id);
    let first = elements.next()?;
    for other in elements {
        for (mine, theirs, name) in
            [(&other.scale, &first.scale, "S"), (&other.offset, &first.offset, "OFFSET")]
        {
            if mine.value != theirs.value {
                let expected = format!("{name} {}, that of the first of part {id}", short(theirs.value));
                log.fault_of(mine.origin, expected, "make one part of those of each law");
                return None;
            }
        }
    }
    let Some(card) = problem.springs.get(&part.material.value) else {
        if !problem.refused_materials.contains(&part.material.value) {
            let expected = "a *MAT_SPRING_ or *MAT_DAMPER_ of the deck: the section is of springs";
            log.fault_of(part.material.origin, expected, "add it, or correct SECID");
        }
        return None;
    };
    let line = |curve: &Placed<u32>| {
        let points = t.points(curve.value, curve.origin.at)?;
        let number = |x: f64| t.number(curve.origin.at, "a value of", x);
        Some(Line { points: points.iter().map(|point| point.map(number)).collect() })
    };
    // Where the numbers of the law stand.
    let mut at: Origin = part.material.origin;
    let (elastic, damper) = match &card.law {
        SpringLaw::Elastic { stiffness } => (Elastic::Linear { stiffness: *stiffness }, Damper::None),
        SpringLaw::Damper { damping } => (Elastic::None, Damper::Linear { damping: *damping }),
        SpringLaw::Plastic { stiffness, tangent, yields } => {
            at = tangent.origin;
            let (stiffness, tangent, yields) = (*stiffness, tangent.value, *yields);
            (Elastic::Plastic { stiffness, tangent, yields }, Damper::None)
        }
        SpringLaw::Curve(curve) => {
            at = curve.origin;
            (Elastic::Curve(line(curve)?), Damper::None)
        }
        SpringLaw::DamperCurve(curve) => {
            at = curve.origin;
            (Elastic::None, Damper::Curve(line(curve)?))
        }
    };
    let spring = Spring { elastic, damper, offset: first.offset.value }.scaled(first.scale.value);
    if let Some(expected) = spring.fault() {
        log.fault_of(at, expected, "correct the constants, the curve or OFFSET");
        return None;
    }
    Some(spring)
}
