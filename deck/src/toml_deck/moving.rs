//! `[[load]]` of type `moving-pressure`: a pressure by the distance from an axis, and the way of that axis.

use mechanics::load::Span;

use super::entry::{components, direction, drive, span, text};
use crate::{
    limits::MAX_CURVE_POINTS,
    table::{Range, Table, Value},
    typed::condition::{Moving, Path},
};

/// Points of integration along each side of a face where a deck says none.
pub(crate) const USUAL_POINTS: u32 = 3;

/// `pressure`, `profile`, `radius`, `axis`, `points`, and of the way `path`, or `point` and `velocity`.
pub(super) fn read(table: &Table<'_>) -> Option<Moving> {
    let pressure = table.require("pressure", "a number or a curve").and_then(drive);
    let span = span(table);
    let profile = table.get("profile").map(text);
    let radius = table.number("radius", Range::Positive);
    let axis = direction(table, "axis");
    let points = table.integer_or("points", u64::from(USUAL_POINTS), 1, 5) as u32;
    let path = match table.get("path") {
        Some(value) => {
            if let Some(other) = ["point", "velocity"].into_iter().find_map(|key| table.get(key)) {
                other.fault("path, or point and velocity", "remove one of them");
            }
            read_path(&value)
        }
        None => {
            let start = table.vector("point");
            let velocity = match table.has("velocity") {
                true => components(table, "velocity"),
                false => Some([const { None }; 3]),
            };
            start
                .zip(velocity)
                .map(|(start, velocity)| Path::Velocity { start, velocity: Box::new(velocity) })
        }
    };
    let mut pressure = pressure?;
    if pressure.span == Span::ALWAYS {
        pressure.span = span;
    }
    let profile = match profile {
        Some(name) => Some(name?),
        None => None,
    };
    Some(Moving { pressure, profile, radius: radius?, axis: axis?, path: path?, points })
}

/// `[[time, x, y, z], ...]` with ascending times.
fn read_path(value: &Value<'_>) -> Option<Path> {
    let items = value.items()?;
    if items.is_empty() || items.len() > MAX_CURVE_POINTS {
        value.fault(&format!("1 to {MAX_CURVE_POINTS} places"), "write [[time, x, y, z], ...]");
        return None;
    }
    let mut places: Vec<[f64; 4]> = Vec::with_capacity(items.len());
    for item in items {
        let place = item.numbers::<4>("[time, x, y, z]", Range::Any)?;
        if places.last().is_some_and(|last| last[0] >= place[0]) {
            item.fault("a time after that of the place before", "put the places in the order of time");
            return None;
        }
        places.push(place);
    }
    Some(Path::Places(places))
}
