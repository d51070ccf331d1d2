//! `beam = { ... }` of a part: the section of beams and how they stand.

use mechanics::element::beam2::{BeamSection, Shape, USUAL_POINTS};

use crate::{
    table::{Range, Table, Value},
    typed::part::Kind,
};

/// `beam = { rectangle, round, tube, or area, inertia and torsion; points, shear_area, across }`.
pub(super) fn read(value: Value<'_>, name: &str) -> Option<Kind> {
    let table = value.table(format!("beam of \"{name}\""))?;
    let section = read_section(&value, &table);
    let shear = table.get("shear_area").map(|v| v.numbers::<2>("two areas", Range::NotNegative));
    let across = table.get("across").map_or(Some([0.0; 3]), |v| v.vector());
    table.finish();
    let mut section = section?;
    if let Some(given) = shear {
        section.shear = given?;
    }
    Some(Kind::Beams { section, across: across? })
}

fn read_section(value: &Value<'_>, table: &Table<'_>) -> Option<BeamSection> {
    const KEYS: [&str; 4] = ["rectangle", "round", "tube", "area"];
    let given: Vec<(&str, Value<'_>)> =
        KEYS.into_iter().filter_map(|key| table.get(key).map(|found| (key, found))).collect();
    let [(key, found)] = given[..] else {
        value.fault("exactly one of rectangle, round, tube and area", "give the section of the beams");
        return None;
    };
    if key == "area" {
        let area = found.number(Range::Positive);
        let inertia = table
            .require("inertia", "two second moments of area")
            .and_then(|v| v.numbers::<2>("two second moments of area", Range::Positive));
        let torsion = table.number("torsion", Range::Positive);
        return Some(BeamSection {
            area: area?,
            inertia: inertia?,
            torsion: torsion?,
            shear: [0.0; 2],
            fibres: None,
            breaks: None,
        });
    }
    let points = match table.get("points") {
        None => Some(u64::from(USUAL_POINTS)),
        Some(points) => points.integer(2, 10).filter(|count| {
            let is_even = count % 2 == 0;
            if !is_even {
                points.fault("an even number from 2 to 10", "take one more");
            }
            is_even
        }),
    };
    let shape = match key {
        "rectangle" => found.numbers::<2>("two sides", Range::Positive).map(Shape::Rectangle),
        "round" => found.number(Range::Positive).map(|outer| Shape::Round([outer, 0.0])),
        _ => found.numbers::<2>("the outer and the inner diameter", Range::Positive).and_then(
            |[outer, inner]| {
                if inner >= outer {
                    found.fault("an inner diameter below the outer one", "give the outer one first");
                    return None;
                }
                Some(Shape::Round([outer, inner]))
            },
        ),
    };
    Some(shape?.section(points? as u32))
}
